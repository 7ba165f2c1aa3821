//! What `docs/FIRST_BOARD.md` names exists.

use std::path::Path;

const PAGE: &str = include_str!("../../../docs/FIRST_BOARD.md");

/// The links to code: a name in back quotes and a file beside the page.
fn links() -> Vec<(&'static str, &'static str)> {
    let parts = PAGE.split("[`").skip(1);
    let link = |part: &'static str| {
        let (name, rest) = part.split_once("`](")?;
        Some((name, rest.split_once(')')?.0))
    };
    parts.filter_map(link).collect()
}

/// Whether a text has this word by itself.
fn has_word(text: &str, word: &str) -> bool {
    text.split(|c: char| c != '_' && !c.is_alphanumeric()).any(|found| found == word)
}

#[test]
fn the_first_board_s_page_has_its_measurements_whose_code_exists() {
    let rows: Vec<_> =
        PAGE.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| |")).collect();
    let numbers: Vec<u32> =
        rows.iter().filter_map(|row| row.split('|').nth(1)?.trim().parse().ok()).collect();
    assert_eq!(numbers, (1..=26).collect::<Vec<_>>());
    assert!(!PAGE.contains("half duty"), "no command gives it");
    for row in &rows {
        assert!(row.contains("[`"), "no code: {row}");
    }
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    for (name, file) in links() {
        let text = std::fs::read_to_string(docs.join(file));
        let text = text.unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(has_word(&text, name), "{file} has no `{name}`");
    }
    assert!(!has_word("const HANG_MS", "HANG") && has_word("const HANG_MS", "HANG_MS"));
}
