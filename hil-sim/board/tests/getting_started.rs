//! The commands of `docs/GETTING_STARTED.md`, in its order, with the emulated board in the place of
//! the one at the probe. They are read from the page, so that a new one is run as well.

use std::fs;
use std::path::Path;

use hil_sim::testing::long;

use crate::common::cli::rig;

/// Commands before this heading are run always, the others with the long samples.
const LONG_FROM: &str = "## 7.";
/// Commands of other programs, which set up the host.
const ELSEWHERE: [&str; 2] = ["rustup target add ", "cargo install probe-rs-tools"];

/// A block of code of the page.
struct Block<'a> {
    language: &'a str,
    text: &'a str,
    is_long: bool,
}

fn blocks(page: &str) -> Vec<Block<'_>> {
    let mut at = 0;
    let mut blocks = Vec::new();
    for (number, part) in page.split("```").enumerate() {
        if number % 2 == 1 {
            let (language, text) = part.split_once('\n').expect("a block has lines");
            let is_long = page.find(LONG_FROM).is_some_and(|from| from < at);
            blocks.push(Block { language, text, is_long });
        }
        at += part.len() + 3;
    }
    blocks
}

/// As the page says it, with the emulated board for the probe's, a view without a terminal and a
/// bring-up without a hand. One with a mistake in the wiring has to find it.
#[cfg(unix)]
fn follow(place: &Path, command: &str) {
    let on_board = command.replace("--target probe", "--target board");
    let mut arguments: Vec<&str> = on_board.split_whitespace().collect();
    if arguments[0] == "live" {
        arguments.extend(["--headless", "--fast", "--listen", "127.0.0.1:0"]);
    }
    if arguments[0] == "bringup" {
        let more = [&["--target", "board"][..], &["--yes"]];
        arguments.extend(more.into_iter().filter(|more| !on_board.contains(more[0])).flatten());
    }
    let said = rig(place, &arguments);
    let expected = i32::from(arguments.contains(&"--mistake"));
    assert_eq!(said.code, Some(expected), "{arguments:?}: {}{}", said.text, said.printed);
}

#[cfg(unix)]
#[test]
fn every_command_of_the_page_works_in_its_order() {
    use std::os::unix::fs::PermissionsExt;

    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/GETTING_STARTED.md");
    let page = fs::read_to_string(page).expect("the page");
    let directory = tempfile::tempdir().expect("a directory");
    let place = directory.path();
    // What flashes the real board.
    let probe_rs = place.join("probe-rs");
    fs::write(&probe_rs, "#!/bin/sh\necho probe-rs 0.32.0 \"$@\"\n").expect("a program");
    fs::set_permissions(&probe_rs, fs::Permissions::from_mode(0o755)).expect("a program");

    let (mut followed, mut left) = (0, 0);
    for Block { language, text, is_long } in blocks(&page) {
        if language == "toml" {
            let (name, _) = text.split_once('\n').expect("lines");
            fs::write(place.join(name.trim_start_matches("# ")), text).expect("a file");
            continue;
        }
        assert_eq!(language, "sh");
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            match line.strip_prefix("cargo rig ") {
                Some(_) if is_long && !long() => left += 1,
                Some(command) => {
                    follow(place, command);
                    followed += 1;
                }
                None => {
                    let known = ELSEWHERE.iter().any(|known| line.starts_with(known));
                    assert!(known || line.is_empty(), "{line}: who runs it?");
                }
            }
        }
    }
    assert!(followed >= 7 && followed + left >= 14, "{followed} followed, {left} left");
}
