//! The emulated board: the processor core, what its instructions cost, the chip around
//! it, and images that run on it.

mod accelerator;
pub mod bench;
pub mod bringup;
pub mod campaign;
pub mod chip;
pub mod cli;
pub mod core;
pub mod cycles;
pub mod description;
pub mod elf;
mod error;
pub mod exceptions;
pub mod fault_injector;
pub mod faults;
pub mod image;
mod load;
pub mod log;
pub mod machine;
mod params;
pub mod peripherals;
pub mod port;
mod rtt;
pub mod rules;
pub mod run;
mod spread;
pub mod thumb;
mod timing;
pub mod wiring;
