//! How large the project may be: lines outside tests and lines of tests, as they are read, with
//! blank lines and comments. Raising a number is a line in CHANGELOG with its reason.

use std::fs;
use std::path::{Path, PathBuf};

/// Part of the project, lines outside tests, lines of tests.
const BUDGET: [(&str, usize, usize); 2] = [("firmware", 19_700, 10_400), ("host", 47_500, 23_560)];

/// Lines inside `#[cfg(test)] mod name { ... }`, by the closing brace in the column of `mod`.
fn inline_tests(text: &str) -> usize {
    let (mut count, mut end, mut is_test) = (0, None::<String>, false);
    for line in text.lines() {
        let code = line.trim_start();
        if end.is_some() {
            count += 1;
            end = end.filter(|closing| line != closing);
        } else if code.starts_with("#[") {
            is_test |= code.contains("cfg(test)") || code.contains("cfg(all(test");
        } else {
            let declared = code.split_once("mod ").filter(|_| is_test && line.ends_with(" {"));
            if declared.is_some_and(|(before, _)| before.is_empty() || before.starts_with("pub")) {
                count += 1;
                end = Some(" ".repeat(line.len() - code.len()) + "}");
            }
            is_test = false;
        }
    }
    count
}

/// Every Rust file below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        let name = path.file_name().unwrap().to_string_lossy();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            found.extend(sources(&path));
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
    found
}

#[test]
fn the_project_keeps_to_its_budget_of_lines() {
    let host = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = host.parent().expect("the workspace");
    let all = sources(root);
    for (part, most, most_of_tests) in BUDGET {
        let (mut lines, mut of_tests) = (0, 0);
        for path in all.iter().filter(|path| path.starts_with(host) == (part == "host")) {
            let text = fs::read_to_string(path).unwrap();
            let name = path.file_name().unwrap().to_string_lossy();
            let is_test = path
                .strip_prefix(root)
                .unwrap()
                .parent()
                .is_some_and(|folders| folders.iter().any(|folder| folder == "tests"))
                || name == "tests.rs"
                || name.ends_with("_tests.rs");
            let tests = if is_test { text.lines().count() } else { inline_tests(&text) };
            (lines, of_tests) = (lines + text.lines().count() - tests, of_tests + tests);
        }
        let found = format!("{part}: {lines} lines outside tests, {of_tests} of tests");
        println!("{found}");
        assert!(
            lines <= most && of_tests <= most_of_tests,
            "{found}: at most {most}, {most_of_tests}"
        );
    }
}
