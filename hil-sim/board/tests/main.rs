//! The firmware, and other images, on the emulated board.

mod common;
mod cycles;
mod faults;
mod firmware;
mod flash;
mod gdb;
mod hil;
mod kept;
mod log;
mod panics;
mod params;
mod processor;
mod resets;
mod second;
mod silicon;
mod verbs;
