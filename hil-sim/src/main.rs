//! The `rig` command; what it does stands in [`hil_sim::cli`].

fn main() -> std::process::ExitCode {
    hil_sim::cli::main()
}
