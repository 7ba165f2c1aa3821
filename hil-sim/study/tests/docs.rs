//! `docs/MODEL.md` names tests that exist.

use std::path::Path;

use super::doc;

/// All sources of the references, tests included.
fn sources(folder: &Path) -> String {
    let mut text = String::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        text +=
            &if path.is_dir() { sources(&path) } else { std::fs::read_to_string(path).unwrap() };
    }
    text
}

#[test]
fn every_test_that_the_page_names_is_there() {
    let page = doc("MODEL.md");
    let sources = sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/reference"));
    let quoted = page.split('`').skip(1).step_by(2);
    let names: Vec<&str> = quoted
        .filter(|name| name.matches('_').count() >= 3 && !name.contains(['/', ' ', ':']))
        .collect();
    assert!(names.len() > 15, "{names:?}");
    for name in names {
        assert!(sources.contains(&format!("fn {name}(")), "no test `{name}`");
    }
}
