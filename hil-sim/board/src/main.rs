//! `rig` with the emulated board: the verbs that need it, with the arguments of `rig`.

fn main() -> std::process::ExitCode {
    rig_board::cli::main()
}
