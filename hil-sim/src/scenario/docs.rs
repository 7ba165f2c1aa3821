//! Descriptions of the keys, taken from the documentation of the fields that they
//! set, so that no description stands in two places.

/// Where each section of a scenario is declared: section, structure, source text.
const SECTIONS: [(&str, &str, &str); 10] = [
    ("rig", "Geometry", RIG),
    ("tread", "Tread", RIG),
    ("plant", "Loads", RIG),
    ("preload", "Pretightener", RIG),
    ("drive", "Drive", RIG),
    ("sense", "Sensors", RIG),
    ("control", "ControlSettings", RIG),
    ("spread", "Spread", SPREAD),
    ("noise", "Noise", SPREAD),
    ("run", "RunOptions", RUN),
];

const RIG: &str = include_str!("../../../src/rig.rs");
const SPREAD: &str = include_str!("spread.rs");
const RUN: &str = include_str!("run.rs");

/// Every key by its dotted path, with its description, in the order of declaration.
pub(super) fn all() -> Vec<(String, String)> {
    let mut docs = vec![("preset".to_owned(), "Rig that the scenario starts from.".to_owned())];
    for (section, structure, source) in SECTIONS {
        for (field, text) in fields(source, structure) {
            docs.push((format!("{section}.{field}"), text));
        }
    }
    docs
}

/// Fields of `structure` in `source` with their documentation.
fn fields(source: &str, structure: &str) -> Vec<(String, String)> {
    let head = format!("pub struct {structure} {{");
    let body = source.lines().skip_while(|line| *line != head).skip(1).take_while(|l| *l != "}");
    let mut text = String::new();
    let mut found = Vec::new();
    for line in body.map(str::trim) {
        if let Some(comment) = line.strip_prefix("///") {
            if !text.is_empty() {
                text.push(' ');
            }
            text.push_str(comment.trim());
        } else if let Some((name, _)) = line.strip_prefix("pub ").and_then(|l| l.split_once(':')) {
            found.push((name.to_owned(), plain(&std::mem::take(&mut text))));
        }
    }
    found
}

/// Documentation without its mark-up.
fn plain(text: &str) -> String {
    text.replace(['`', '[', ']'], "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_over_two_lines_becomes_one_description() {
        let source =
            "pub struct A {\n    /// One,\n    /// two `x`.\n    #[serde]\n    pub x_mm: f64,\n}\n";
        assert_eq!(fields(source, "A"), [("x_mm".to_owned(), "One, two x.".to_owned())]);
    }
}
