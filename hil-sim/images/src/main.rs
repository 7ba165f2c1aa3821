//! An image whose functions the host calls one at a time, with a stopped board around
//! each call: built like the firmware, so that it costs what the firmware costs.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod image;

/// For the emulated core alone.
#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!("This image runs on the emulated board; `cargo rig bench` builds and runs it.");
    std::process::ExitCode::from(2)
}
