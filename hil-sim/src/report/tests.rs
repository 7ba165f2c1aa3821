pub(crate) mod example;
mod plots;

use super::*;
use crate::record::Recording;

#[test]
fn the_page_needs_no_other_file_and_is_small() {
    let page = html(&example::deploy(), &[]);
    for outside in ["http://", "https://", " src=", "<link", "url(", "@import", "fetch(", "import("]
    {
        let found = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!found.contains(outside), "{outside}");
    }
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
}

#[test]
fn the_page_of_a_long_log_is_small_too() {
    let log = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/resets-3.mcap");
    let boots = crate::record::recordings(log.as_ref()).unwrap();
    assert!(boots.iter().map(|boot| boot.rows.len()).sum::<usize>() > 18_000);
    let page = log_html(&boots);
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
}

#[test]
fn the_page_shows_every_plot_and_figure() {
    let recording = example::deploy();
    let page = html(&recording, &[]);
    // Six plots and the bands on two axes, six plots for each of three crossings.
    assert_eq!(page.matches("<figure data-across").count(), 2 * 7 + 3 * 6);
    for text in ["3 crossings", "worst gap", "tau_s = 0.1059", env!("CARGO_PKG_VERSION")] {
        assert!(page.to_lowercase().contains(&text.to_lowercase()), "{text}");
    }
    assert!(page.contains(&recording.summary.trace_digest));
}

#[test]
fn a_fault_is_in_the_headline() {
    let page = html(&example::faulted(), &[]);
    assert!(page.contains("<header class=\"bad\">"));
    assert!(page.contains("Did not complete: fault 121"));
}

#[test]
fn a_run_that_never_began_still_has_a_page() {
    let page = html(&Recording::default(), &[]);
    assert!(page.contains("No rows were recorded"));
}

#[test]
fn every_number_drawn_is_finite() {
    for recording in [example::deploy(), example::faulted(), Recording::default()] {
        let text = html(&recording, &[]);
        assert!(!text.contains("NaN") && !text.contains("inf,"));
    }
}

#[test]
fn a_crossing_is_animated_from_the_rows_of_the_run() {
    let page = html(&example::deploy(), &[]);
    let data = page.split("id=\"scene\">").nth(1).expect("no data of the scene");
    let data = data.split("</script>").next().unwrap();
    let scene: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(scene["geometry"]["wheel_radius_mm"], 25.0);
    assert_eq!(scene["crossings"].as_array().unwrap().len(), 3);
    assert!(scene["rows"].as_array().unwrap().len() > 1000);
    // What the script looks for is in the page.
    let script = include_str!("scene.js");
    for id in script.split("$(\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
    }
}
