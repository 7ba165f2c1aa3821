//! The committed page of the study's figures is what this build makes of them: every
//! verdict on a claim, and the data behind it.

use std::collections::BTreeMap;

use rig_study::paper;
use serde_json::Value;

use super::doc;

/// Largest difference of a value from the recorded one over the range of its series:
/// other processors' sines and exponentials move a history by about a ten thousandth.
const SAME_WITHIN: f64 = 0.01;

/// Verdict of each claim by its name.
fn verdicts(study: &Value) -> BTreeMap<&str, bool> {
    let claims = study["claims"].as_array().expect("claims").iter();
    claims.map(|one| (one["id"].as_str().expect("id"), one["holds"] == true)).collect()
}

/// Points of each series by figure, panel, source and name.
fn series(study: &Value) -> BTreeMap<String, Vec<(f64, f64)>> {
    let mut all = BTreeMap::new();
    for figure in study["figures"].as_array().expect("figures") {
        for (panel, plot) in figure["panels"].as_array().expect("panels").iter().enumerate() {
            for one in plot["series"].as_array().expect("series") {
                let key = format!("{} {panel} {} {}", figure["id"], one["source"], one["name"]);
                let point = |p: &Value| (p[0].as_f64().expect("x"), p[1].as_f64().expect("y"));
                let points = one["points"].as_array().expect("points").iter().map(point);
                assert!(all.insert(key.clone(), points.collect()).is_none(), "{key} twice");
            }
        }
    }
    all
}

/// Largest distance between two series over the range of the first.
fn apart(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
    let values = a.iter().map(|p| p.1);
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), y| (low.min(y), high.max(y)));
    let off = |(a, b): (&(f64, f64), &(f64, f64))| (a.0 - b.0).abs().max((a.1 - b.1).abs());
    a.iter().zip(b).map(off).fold(0.0, f64::max) / (high - low).max(f64::MIN_POSITIVE)
}

#[test]
fn the_committed_data_are_what_this_build_makes() {
    if !super::long() {
        return;
    }
    let experiments = paper::experiment::campaign(&paper::cases()).complete(&|| {});
    let study = paper::regenerate(&experiments.expect("the rigs run"))
        .expect("the study can be regenerated");
    let made: Value = serde_json::from_str(&paper::json(&study).unwrap()).unwrap();
    let kept: Value = serde_json::from_str(&doc("paper/paper.json")).unwrap();
    assert_eq!(verdicts(&made), verdicts(&kept), "verdicts that changed; see `cargo rig paper`");

    let (now, then) = (series(&made), series(&kept));
    assert!(now.keys().eq(then.keys()), "other series than recorded");
    for (key, points) in &now {
        let kept = &then[key];
        assert_eq!(points.len(), kept.len(), "{key}");
        let off = apart(kept, points);
        assert!(off < SAME_WITHIN, "{key} is off by {off}; see `cargo rig paper`");
    }
}

#[test]
fn the_committed_page_says_what_the_data_say_and_shows_every_figure() {
    let kept: Value = serde_json::from_str(&doc("paper/paper.json")).unwrap();
    let text = doc("paper/README.md");
    let claims = kept["claims"].as_array().unwrap();
    for claim in claims {
        let verdict = match (claim["holds"] == true, claim["fitted"] == true) {
            (true, false) => "holds",
            (true, true) => "holds (fitted)",
            (false, _) => "**does not hold**",
        };
        let row = format!("| {} | {verdict} |", claim["claim"].as_str().unwrap());
        assert!(text.contains(&row), "{row}");
    }
    for figure in kept["figures"].as_array().unwrap() {
        let file = figure["file"].as_str().unwrap();
        assert!(text.contains(&format!("]({file})")), "{file}");
        assert!(doc(&format!("paper/{file}")).starts_with("<svg "));
        assert!(claims.iter().any(|claim| claim["figure"] == figure["id"]), "{file}");
    }
}
