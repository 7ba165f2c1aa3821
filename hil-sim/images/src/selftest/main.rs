//! A program that tests the core it runs on: what an exception must keep, what may
//! interrupt what, what wakes. The host reads the outcome at a breakpoint.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod checks;
#[cfg(target_os = "none")]
mod program;

/// For the emulated core alone.
#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("This image runs on the emulated board; the tests of hil-sim build and run it.");
    std::process::ExitCode::from(2)
}
