//! Generated blocks inside a page that is otherwise written by hand: what stands between
//! `<!-- generated: name -->` and `<!-- end -->` is replaced, the rest is left alone.

use anyhow::{Context, Result, ensure};

const END: &str = "<!-- end -->";

/// `page` with the block `name` replaced by `text`.
///
/// # Errors
/// If the page does not have that block exactly once, or it does not end.
pub fn fill(page: &str, name: &str, text: &str) -> Result<String> {
    let start = format!("<!-- generated: {name} -->");
    let (before, rest) = page.split_once(&start).with_context(|| format!("no block `{name}`"))?;
    ensure!(!rest.contains(&start), "block `{name}` stands twice");
    let (old, after) =
        rest.split_once(END).with_context(|| format!("block `{name}` has no end"))?;
    ensure!(!old.contains("<!-- generated:"), "block `{name}` has no end of its own");
    Ok(format!("{before}{start}\n{}\n{END}{after}", text.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str =
        "a\n<!-- generated: x -->\nold\n<!-- end -->\nb\n<!-- generated: y -->\n<!-- end -->\n";

    #[test]
    fn only_the_named_block_changes() {
        let page = fill(PAGE, "x", "new\n").unwrap();
        assert_eq!(page, PAGE.replace("old", "new"));
        assert_eq!(fill(&page, "x", "new").unwrap(), page);
        assert!(fill(PAGE, "y", "z").unwrap().ends_with("y -->\nz\n<!-- end -->\n"));
    }

    #[test]
    fn a_broken_page_is_told() {
        for (page, wanted) in [
            ("", "no block `x`"),
            ("<!-- generated: x -->", "block `x` has no end"),
            ("<!-- generated: x -->\n<!-- generated: y -->\n<!-- end -->", "no end of its own"),
            (&format!("{PAGE}{PAGE}"), "stands twice"),
        ] {
            let error = fill(page, "x", "new").unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
        }
    }
}
