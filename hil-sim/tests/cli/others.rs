//! `rig keys`, `rig flash` with other programs in the place of probe-rs, and the help.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use super::{code, folder, good, good_in, number, rig, stderr, stdout};

fn of<'a>(keys: &'a [Value], name: &str) -> &'a Value {
    keys.iter().find(|key| key["key"] == name).unwrap()
}

#[test]
fn keys_are_listed_with_unit_default_and_description() {
    let listed = good(&["keys", "--json", "--rig", "fe"]);
    let keys = listed["keys"].as_array().unwrap();
    let limit = of(keys, "preload.limit_n");
    assert_eq!((limit["unit"].as_str(), number(limit, "default")), (Some("N"), 150.0));
    assert!(limit["description"].as_str().unwrap().len() > 10);
    assert_eq!(of(keys, "run.seed")["default"], 0);
    assert!(of(keys, "rig.step_positions_mm")["default"].is_array());
    let output = rig(&["keys"]);
    assert_eq!(code(&output), 0);
    for key in keys {
        assert!(stdout(&output).contains(key["key"].as_str().unwrap()), "{key}");
    }
}

#[test]
fn keys_are_found_by_a_pattern_with_range_and_mark() {
    let found = good(&["keys", "--json", "FRICTION"]);
    let keys = found["keys"].as_array().unwrap();
    assert!(keys.len() > 2 && keys.len() < 20, "{}", keys.len());
    // Its description has the word.
    let mu = of(keys, "plant.mu");
    assert_eq!((&mu["range"][1], &mu["measure"]), (&3.0.into(), &true.into()));
    assert_eq!(of(keys, "mismatch.friction")["measure"], false);
    let text = stdout(&rig(&["keys", "Preload.limit"])).to_owned();
    assert!(text.contains("5 to 180") && !text.contains("drive."), "{text}");
    super::refused(&["keys", "sleeve colour"], &["sleeve colour", "`rig keys`"]);
    let all = good(&["keys", "--json"]);
    let without: Vec<&str> = all["keys"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|key| key["default"].is_number() && key["range"].is_null())
        .map(|key| key["key"].as_str().unwrap())
        .collect();
    assert!(without.is_empty(), "numbers without a range: {without:?}");
}

#[test]
fn a_shell_completes_verbs_and_options_and_help_takes_a_verb() {
    for shell in ["bash", "zsh", "fish"] {
        let output = rig(&["completions", shell]);
        assert_eq!(code(&output), 0);
        for word in ["montecarlo", "sweep", "seed"] {
            assert!(stdout(&output).contains(word), "{shell} {word}");
        }
    }
    let (help, option) = (rig(&["help", "sweep"]), rig(&["sweep", "--help"]));
    assert_eq!((code(&help), stdout(&help)), (0, stdout(&option)));
}

#[test]
fn help_lists_the_verbs_and_is_no_error() {
    let output = rig(&["--help"]);
    assert_eq!(code(&output), 0);
    let verbs = "modes bench paper deploy crossing compare envelope montecarlo keys test";
    for verb in verbs.split(' ') {
        assert!(stdout(&output).contains(&format!("\n  {verb} ")), "{verb}");
    }
    let text = stdout(&rig(&["deploy", "--help"])).to_owned();
    assert!(text.contains("Usage: cargo rig deploy"), "{text}");
    assert!(text.contains("board") && text.contains("probe"), "{text}");
    assert!(stdout(&rig(&["--version"])).starts_with("rig "));
}

/// A program of the shell with these lines, in a folder of its own.
#[cfg(unix)]
fn program(script: &str) -> (tempfile::TempDir, PathBuf) {
    use std::os::unix::fs::PermissionsExt;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("program");
    std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    (directory, path)
}

#[cfg(unix)]
#[test]
fn a_build_is_announced_only_when_something_is_built() {
    for (fresh, said) in [(true, ""), (false, "building the study, once: up to some minutes\n")] {
        // In the place of cargo: it has built a program, and compiled it just now or not.
        let (_directory, cargo) = program(&format!(
            r#"echo '{{"reason":"compiler-artifact","target":{{"name":"rig-study"}},"executable":"/bin/true","fresh":{fresh}}}'"#
        ));
        let mut rig = Command::new(env!("CARGO_BIN_EXE_rig"));
        let output = rig.env("CARGO", cargo).arg("modes").output().expect("the command starts");
        assert_eq!((code(&output), &*stderr(&output)), (0, said));
    }
}

/// Where it is not built, its help is a line that says how its options are shown.
#[cfg(unix)]
#[test]
fn help_of_a_verb_of_another_part_builds_nothing() {
    for arguments in [["help", "modes"], ["modes", "--help"], ["bench", "-h"], ["paper", "--help"]]
    {
        let mut rig = Command::new(env!("CARGO_BIN_EXE_rig"));
        let output = rig.env("CARGO", "/nowhere/cargo").args(arguments).output().expect("starts");
        assert_eq!(code(&output), 0, "{arguments:?}: {}", stderr(&output));
        assert!(stdout(&output).contains("Usage: "), "{arguments:?}: {}", stdout(&output));
    }
}

fn flash_by(program: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig"))
        .env("PROBE_RS", program)
        .arg("flash")
        .args(arguments)
        .output()
        .expect("the command starts")
}

/// A program in the place of probe-rs: its version, and what it does with its arguments.
#[cfg(unix)]
fn stand_in(version: &str, run: &str) -> (tempfile::TempDir, PathBuf) {
    program(&format!("case $1 in --version) echo '{version}';; *) {run};; esac"))
}

#[cfg(unix)]
#[test]
fn the_image_is_flashed_and_read_back_and_only_the_text_log_is_shown() {
    let (_directory, probe_rs) = stand_in("probe-rs 0.32.0 (git commit: none)", "echo \"$@\"");
    let output = flash_by(&probe_rs, &["--", "--probe", "0483:374b"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let (arguments, image) = stdout(&output).trim().rsplit_once(' ').expect("arguments");
    let expected = "run --chip STM32G474RETx --verify --no-catch-reset --no-catch-hardfault \
                    --rtt-up-channels 0 --rtt-channel-mode no-block-skip --probe 0483:374b";
    assert_eq!(arguments, expected);
    assert!(std::fs::read(image).expect("an image").starts_with(b"\x7fELF"), "{image}");
}

#[cfg(unix)]
#[test]
fn probe_rs_has_to_be_there_and_new_enough_and_gives_the_exit_code() {
    let (_directory, probe_rs) = stand_in("probe-rs 1.0.0", "exit 1");
    assert_eq!(code(&flash_by(&probe_rs, &[])), 1);
    let output = flash_by("/no/such/probe-rs".as_ref(), &[]);
    assert_eq!(code(&output), 2);
    let text = stderr(&output);
    assert!(text.contains("/no/such/probe-rs: ") && text.contains("probe-rs-tools"), "{text}");
    let (_directory, old) = stand_in("probe-rs 0.31.0", "echo it ran");
    let output = flash_by(&old, &[]);
    assert_eq!((code(&output), stdout(&output)), (2, ""));
    let text = stderr(&output);
    assert!(text.contains("probe-rs 0.31.0") && text.contains("0.32"), "{text}");
}

/// Minutes of building for a probe that is not there would be in vain.
#[cfg(target_os = "linux")]
#[test]
fn a_probe_is_looked_for_before_anything_is_built() {
    let found = r#"case $1 in list) echo "No debug probes were found.";; *) echo it ran;; esac"#;
    let (_directory, alone) = stand_in("probe-rs 0.33.0", found);
    let at = &folder();
    for arguments in [
        &["flash"][..],
        &["deploy", "--target", "probe"],
        &["capture", "--target", "probe"],
        &["live", "--headless", "--listen", "127.0.0.1:0", "--target", "probe"],
        &["params", "get", "--target", "probe"],
        &["bringup", "--yes"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_rig"))
            .current_dir(&**at)
            .envs([("CARGO", "/nowhere/cargo"), ("PROBE_RS_PROBE", "dead:beef:none")])
            .env("PROBE_RS", &alone)
            .args(arguments)
            .output()
            .expect("the command starts");
        let said = stderr(&output);
        assert_eq!((code(&output), stdout(&output)), (2, ""), "{arguments:?}: {said}");
        assert!(said.contains("no debug probe") && said.lines().count() == 1, "{said}");
        assert!(super::is_empty(at), "{arguments:?} left files");
    }
}

#[test]
fn a_file_that_becomes_active_is_asked_for_what_no_default_knows() {
    let at = &folder();
    let restored = |file: &str, text: &str| {
        std::fs::write(at.join(file), text).unwrap();
        stderr(&good_in(at, &["params", "restore", file, "--file", "board.set"]))
    };
    let mine = "[rig]\nwheel_width_mm = 31.0\n[sources]\n\"rig.wheel_radius_mm\" = \"calliper\"\n";
    let said = restored("mine.toml", mine);
    assert_eq!(said.lines().count(), 1, "{said}");
    for part in ["mine.toml", "`prototype`", "rig.step_positions_mm", "plant.arm_coupling"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // It states one, has a source of another, and the third is a choice.
    for other in ["rig.wheel_width_mm", "rig.wheel_radius_mm", "drive.cruise_speed_mm_s"] {
        assert!(!said.contains(other), "{other}: {said}");
    }
    good_in(at, &["params", "save", "all.toml", "--file", "board.set"]);
    let all = std::fs::read_to_string(at.join("all.toml")).unwrap();
    assert!(restored("all.toml", &all).contains("rig.wheel_radius_mm"), "whose are they?");
    super::refused_in(at, &["params", "get"], &["--target", "--file"]);
}

/// `hil-sim/release.py` packs what cargo has built; from there `rig` runs the parts beside it and
/// flashes the image beside it, without cargo.
#[cfg(unix)]
#[test]
fn a_release_runs_and_flashes_without_a_toolchain() {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use sha2::{Digest, Sha256};

    let folder = tempfile::tempdir().expect("a directory");
    let at = |name: &str| folder.path().join(name);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = |arguments: &[&std::ffi::OsStr]| {
        let mut python = Command::new("python3");
        let output = python.current_dir(folder.path()).args(arguments).output();
        output.expect("python3 starts")
    };
    let release = root.join("release.py");
    let pack = || python(&[release.as_ref(), "--target".as_ref(), at("target").as_ref()]);
    let image = "target/thumbv7em-none-eabihf/release/interstage";
    for name in [image, "target/debug/rig-probe"] {
        fs::create_dir_all(at(name).parent().expect("a folder")).expect("folders");
        fs::write(at(name), "#!/bin/sh\necho beside: \"$@\"\n").expect("a file");
    }
    assert!(stderr(&pack()).contains("debug/rig: not there; build it first"));
    fs::copy(env!("CARGO_BIN_EXE_rig"), at("target/debug/rig")).expect("copied");
    let packed = pack();
    assert_eq!(code(&packed), 0, "{}", stderr(&packed));
    let archive = stdout(&packed).trim().to_owned();
    let start = concat!("interstage-", env!("CARGO_PKG_VERSION"), "-");
    assert!(archive.starts_with(start) && archive.ends_with(".tar.gz"), "{archive}");
    let unpack = ["-m", "tarfile", "-e", &archive].map(std::ffi::OsStr::new);
    assert_eq!(code(&python(&unpack)), 0);
    let place = at(archive.trim_end_matches(".tar.gz"));
    let sums = fs::read_to_string(place.join("SHA256SUMS")).expect("sums");
    for (line, name) in sums.lines().zip(["rig", "rig-probe", "interstage", "LICENSE-MIT"]) {
        let sum = Sha256::digest(fs::read(place.join(name)).expect("a file"));
        assert_eq!(line, format!("{sum:x}  {name}"));
    }
    fs::write(at("probe-rs"), "#!/bin/sh\necho probe-rs 0.32.0 \"$@\"\n").expect("a program");
    fs::set_permissions(at("probe-rs"), fs::Permissions::from_mode(0o755)).expect("a program");
    let rig = |arguments: &[&str]| {
        let mut rig = Command::new(place.join("rig"));
        let rig = rig.env("PATH", "/usr/bin:/bin").env("CARGO", "/no/cargo");
        rig.env("PROBE_RS", at("probe-rs")).args(arguments).output().expect("starts")
    };
    // A part that needs no probe stands for the one that does.
    fs::rename(place.join("rig-probe"), place.join("rig-study")).expect("renamed");
    assert_eq!(stdout(&rig(&["paper"])), "beside: paper\n");
    let flashed = rig(&["flash"]);
    let elf = place.canonicalize().expect("there").join("interstage");
    assert!(stdout(&flashed).trim().ends_with(elf.to_str().unwrap()), "{}", stdout(&flashed));
}
