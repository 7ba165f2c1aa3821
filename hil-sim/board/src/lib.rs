//! The emulated board: the processor core, what its instructions cost, the chip around
//! it, and images that run on it.

pub mod accelerator;
pub mod bench;
pub mod bringup;
pub mod campaign;
pub mod chip;
pub mod cli;
pub mod core;
pub mod cycles;
pub mod description;
pub mod elf;
pub mod error;
pub mod exceptions;
pub mod fault_injector;
pub mod faults;
pub mod image;
pub mod load;
pub mod log;
pub mod machine;
pub mod params;
pub mod peripherals;
pub mod port;
pub mod rtt;
pub mod rules;
pub mod run;
pub mod spread;
pub mod thumb;
pub mod timing;
pub mod wiring;
