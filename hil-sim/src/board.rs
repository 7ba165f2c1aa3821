//! The emulated board: the processor core, what its instructions cost, the chip around
//! it, and images that run on it.

pub mod account;
pub mod bench;
pub mod chip;
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
pub mod peripherals;
pub mod rtt;
pub mod run;
pub(crate) mod tampered;
pub mod thumb;
pub mod timing;
