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
fn the_build_up_of_the_preload_takes_a_small_part_of_the_axes() {
    let recording = example::deploy();
    let view = View::new(&recording, Across::Time);
    let rows = &recording.rows;
    let start = rows.iter().find(|row| row.position_mm() > rows[0].position_mm() + 0.01).unwrap();
    let part = (start.controller.t_s - view.x.0) / (view.x.1 - view.x.0);
    assert!(part < 0.16, "{part} of the axis is before the first motion");
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
