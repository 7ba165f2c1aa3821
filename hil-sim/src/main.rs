//! The `rig` command, see [`hil_sim::cli`].

fn main() -> std::process::ExitCode {
    hil_sim::cli::main()
}
