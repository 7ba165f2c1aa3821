//! The commands of `docs/GETTING_STARTED.md`, in its order, with the emulated board in the place of
//! the one at the probe. They are read from the page, so that a new one is run as well. What its
//! measurements depend on exists.

use std::fs;
use std::path::Path;

use hil_sim::testing::long;

use crate::common::cli::rig;

/// Commands before this heading are run always, the others with the long samples.
const LONG_FROM: &str = "\n### First crossing";
/// Commands of other programs, which set up the host.
const ELSEWHERE: [&str; 2] = ["rustup target add ", "cargo install probe-rs-tools"];

const PAGE: &str = include_str!("../../../docs/GETTING_STARTED.md");

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

    let directory = tempfile::tempdir().expect("a directory");
    let place = directory.path();
    // What flashes the real board.
    let probe_rs = place.join("probe-rs");
    fs::write(&probe_rs, "#!/bin/sh\necho probe-rs 0.32.0 \"$@\"\n").expect("a program");
    fs::set_permissions(&probe_rs, fs::Permissions::from_mode(0o755)).expect("a program");

    let (mut followed, mut left) = (0, 0);
    for Block { language, text, is_long } in blocks(PAGE) {
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

/// Whether a text has this word by itself.
fn has_word(text: &str, word: &str) -> bool {
    text.split(|c: char| c != '_' && !c.is_alphanumeric()).any(|found| found == word)
}

#[test]
fn the_measurements_are_there_and_name_code_that_exists() {
    let number = |row: &str| row.strip_prefix("| ")?.split(' ').next()?.parse::<u32>().ok();
    let mut rows: Vec<_> = PAGE.lines().filter_map(|row| Some((number(row)?, row))).collect();
    rows.sort_unstable();
    let numbers: Vec<u32> = rows.iter().map(|(number, _)| *number).collect();
    assert_eq!(numbers, (1..=26).collect::<Vec<_>>());
    assert!(!PAGE.contains("half duty"), "no command gives it");
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    for (_, row) in rows {
        // A name in back quotes and a file beside the page.
        let parts = row.split("[`").skip(1);
        let links: Vec<_> = parts.filter_map(|part| part.split_once("`](")).collect();
        assert!(!links.is_empty(), "no code: {row}");
        for (name, rest) in links {
            let file = rest.split_once(')').expect("a link ends").0;
            let text = fs::read_to_string(docs.join(file));
            let text = text.unwrap_or_else(|error| panic!("{file}: {error}"));
            assert!(has_word(&text, name), "{file} has no `{name}`");
        }
    }
    assert!(!has_word("const HANG_MS", "HANG") && has_word("const HANG_MS", "HANG_MS"));
}
