//! `rig` with the study: the verbs that need it.

fn main() -> std::process::ExitCode {
    rig_study::cli::main()
}
