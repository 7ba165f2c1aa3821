//! The page in the repository: its blocks are current and what it names is there.

use super::*;

fn page() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/MODEL.md");
    std::fs::read_to_string(path).unwrap()
}

/// All sources of the references, tests included.
fn sources() -> String {
    fn add(folder: &std::path::Path, text: &mut String) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                add(&path, text);
            } else {
                *text += &std::fs::read_to_string(path).unwrap();
            }
        }
    }
    let mut text = String::new();
    add(std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src/reference")), &mut text);
    text
}

#[test]
fn the_blocks_in_the_repository_are_current() {
    let page = page();
    assert_eq!(fill_model(&page).unwrap(), page, "run `cargo rig docs --only model`");
}

#[test]
fn every_test_that_the_page_names_is_there() {
    let (page, sources) = (page(), sources());
    let names: Vec<&str> = page
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|name| name.matches('_').count() >= 3 && !name.contains(['/', ' ', ':']))
        .collect();
    assert!(names.len() > 15, "{names:?}");
    for name in names {
        assert!(sources.contains(&format!("fn {name}(")), "no test `{name}`");
    }
}

#[test]
fn the_mismatch_of_the_force_is_on_the_page() {
    let figures = [(5.0, 100.0), (5.0, 120.0)].map(|at| Figures::of(at).unwrap());
    assert!(figures[1].force_n > figures[0].force_n && PRINTED[1].force_n < PRINTED[0].force_n);
    // The study's gap falls with preload, and so does ours.
    assert!(figures[1].gap_mm < figures[0].gap_mm && PRINTED[1].gap_mm < PRINTED[0].gap_mm);
}
