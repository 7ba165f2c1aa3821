//! The `rig` command with the emulated board in it.

fn main() -> std::process::ExitCode {
    hil_sim::cli::main()
}
