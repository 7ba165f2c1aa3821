//! The `rig` command with a real debug probe in reach.

fn main() -> std::process::ExitCode {
    hil_sim::cli::main()
}
