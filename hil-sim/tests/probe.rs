//! `--target probe` where there is none. Run with `--features probe`.

use std::process::Command;

/// A probe that nobody has: a board that happens to be attached is left alone.
const NOBODYS: &str = "dead:beef:none";

#[test]
fn a_probe_that_is_not_there_is_told_in_one_line() {
    for arguments in [
        &["deploy"][..],
        &["capture"],
        &["live", "--headless", "--listen", "127.0.0.1:0"],
        &["params", "get"],
    ] {
        let directory = tempfile::tempdir().expect("a directory");
        let output = Command::new(env!("CARGO_BIN_EXE_rig-probe"))
            .current_dir(directory.path())
            .env("PROBE_RS_PROBE", NOBODYS)
            .args(arguments)
            .args(["--target", "probe"])
            .output()
            .expect("starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        assert!(said.starts_with("error: --target probe: ") && said.contains(NOBODYS), "{said}");
        let left = std::fs::read_dir(directory.path()).expect("a directory").next();
        assert!(left.is_none(), "{arguments:?} left {left:?}");
    }
}
