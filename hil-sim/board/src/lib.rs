//! The emulated board: the processor core, what its instructions cost, the chip around
//! it, and images that run on it.

pub mod account;
pub mod bench;
pub mod campaign;
pub mod chip;
pub mod cli;
pub mod core;
pub mod elf;
pub mod exceptions;
pub mod faults;
pub mod gdb;
pub mod heat;
pub mod image;
pub mod load;
pub mod log;
pub mod machine;
pub mod model;
pub mod panics;
pub mod params;
pub mod peripherals;
pub mod port;
pub mod resets;
pub mod rtt;
pub mod run;
pub(crate) mod tampered;
pub mod thumb;
pub mod timing;
