//! The firmware, and other images, on the emulated board.

mod bringup;
mod commissioning;
mod common;
mod cycles;
mod faults;
mod firmware;
mod flash;
mod getting_started;
mod hil;
mod kept;
mod log;
mod operate;
mod panics;
mod params;
mod probe;
mod processor;
mod registers;
mod resets;
mod rules;
mod silicon;
mod verbs;
