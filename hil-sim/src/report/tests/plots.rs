//! What a reader has to find in the plots.

use super::example;
use crate::report::panels::{Across, View};

fn text_of(panel: &crate::report::panel::Panel) -> String {
    panel.figure("", (1100, 240), "")
}

#[test]
fn every_axis_has_its_unit() {
    let recording = example::deploy();
    let view = View::new(&recording, Across::Time);
    for panel in view.all().iter().filter(|panel| panel.bands.is_empty()) {
        assert!(panel.y_name.contains(", "), "{}: {}", panel.title, panel.y_name);
    }
}

#[test]
fn the_time_axis_begins_at_the_command() {
    let recording = example::deploy().since_command();
    assert!(recording.rows[0].controller.t_s < -0.1);
    assert_eq!(View::new(&recording, Across::Time).x.0, 0.0);
}

#[test]
fn what_was_measured_is_drawn_over_the_truth() {
    let recording = example::deploy();
    let svg = text_of(&View::new(&recording, Across::Time).preload());
    let line = |name: &str| svg.find(&format!("line{name}\"")).expect(name);
    assert!(
        line("\" data-name=\"measured") > line(" truth"),
        "the truth hides the measured preload"
    );
}
