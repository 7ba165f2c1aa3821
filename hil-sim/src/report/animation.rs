//! The section that shows why the preload rises: still pictures of a crossing's two instants, and
//! the animation that a script draws.

use super::scene::{Event, Geometry, Scene};
use super::verdict::GAP_TOLERANCE;
use crate::table::number;

/// The animation's controls and pictures, hidden until the script runs.
const STAGE: &str = include_str!("scene.html");
const SCRIPT: &str = include_str!("scene.js");

/// The section's content, as HTML.
pub(super) fn html(scene: Option<&Scene>) -> String {
    let Some(scene) = scene else {
        return "<p>The rows or the rig's parameters are not in this log, so the wheel cannot be \
drawn.</p>\n"
            .to_owned();
    };
    let mut html = why(scene);
    if scene.crossings.is_empty() {
        html += "<p>No crossing is complete in the log.</p>\n";
    }
    html += STAGE;
    html += &format!("<p class=\"note\">{}</p>\n", legend(scene));
    if let Some(first) = scene.crossings.first() {
        html += &stills(scene, first);
    }
    html
}

/// The script with its data, for the end of the page.
pub(super) fn script(scene: &Scene) -> String {
    format!(
        "<script type=\"application/json\" id=\"scene\">{}</script>\n<script>\n{SCRIPT}</script>\n",
        scene.json()
    )
}

fn why(scene: &Scene) -> String {
    let instant = if scene.retracts {
        "The wheel rolls over the edge, and for a moment the edge alone carries it until it \
reaches the lower wall."
    } else {
        "The wheel climbs over the edge, and the edge takes the load from the lower wall until \
that wall carries none."
    };
    let (reference_mm, most) = (scene.gap_ref_mm, 100.0 * GAP_TOLERANCE);
    let wanted = format!(
        "The gap should be at most {most:.0} % over its reference of {reference_mm:.2} mm."
    );
    let wanted = if reference_mm > 0.0 { wanted } else { String::new() };
    let did = at_the_steps(scene);
    format!(include_str!("why.html"), instant = instant, did = did, wanted = wanted)
}

/// What this run's preload was at its steps.
fn at_the_steps(scene: &Scene) -> String {
    let cruise_n = number(scene.geometry.cruise_n, 1);
    let at =
        scene.crossings.iter().map(|c| format!("{} N at step {}", number(c.preload_n, 1), c.index));
    let at = at.collect::<Vec<_>>().join(", ");
    let here = if at.is_empty() { at } else { format!("Here it was {at}. ") };
    format!("{here}Without a step {cruise_n} N are wanted.")
}

fn legend(scene: &Scene) -> String {
    let forces = if scene.measured {
        "This is a captured log: position, radius and preload are those that the \
controller measured or estimated, a touch is where it noticed it, the clearance follows from them, and the forces of corner and \
wall are not measured."
    } else {
        "Arrows: preload on the axle, force of the wall under it (preload, and what the inclined arm adds), force of the corner, drawn \
from the edge towards the axle. The second picture is the corner, five times as large: the areas are the forces \
of wall and corner, spread as deep as the tread is pressed in, the arc is the reference gap."
    };
    format!(
        "{forces} In each picture lengths are true to scale; the pillar is at the top. Dashed: the undeformed \
wheel; the sleeve covers what is pressed flat. The spring shortens by its true deflection; its \
length, the hub and the screw are only drawn. A click in a plot goes to its instant."
    )
}

/// Both instants of a crossing as still pictures.
fn stills(scene: &Scene, c: &Event) -> String {
    let at = |t_s: f64| {
        let [_, position, radius, ..] = scene.row(t_s);
        (*position, scene.geometry.wall_radius_mm - radius)
    };
    let names = if scene.retracts {
        ["The edge takes the load", "The lower wall carries again"]
    } else {
        ["First touch of the corner", "Lift-off from the lower wall"]
    };
    let first = still(&scene.geometry, c, at(c.touch_s), names[0], None);
    let gap = Some(c.gap_mm).filter(|gap| gap.is_finite());
    let second = still(&scene.geometry, c, at(c.lift_s), names[1], gap);
    format!("<div class=\"stills\">\n{first}{second}</div>\n")
}

/// The wheel with its axle at `(x, y)` at the step of `c`.
fn still(g: &Geometry, c: &Event, (x, y): (f64, f64), title: &str, gap: Option<f64>) -> String {
    let (r, face) = (g.wheel_radius_mm, c.face_mm);
    let upper = g.wall_mm(face);
    let lower = upper - c.height_mm;
    // Relative to the root of the step, y downwards as SVG has it.
    let (cx, cy) = (x - face, lower - y);
    let mut marks = String::new();
    if cx < -0.5 {
        marks += &format!(
            "<path class=\"measure\" d=\"M{cx:.2},{cy:.2}V5M0,0V5M{cx:.2},3.5H0\"/>\n\
<text x=\"{:.2}\" y=\"9\" text-anchor=\"middle\">{:.1} mm to the face</text>\n",
            0.5 * cx,
            cx.abs(),
        );
    }
    let away = cx.hypot(cy);
    if let Some(gap) = gap {
        let rim = (cx * (1.0 - r / away), cy * (1.0 - r / away));
        marks += &format!(
            "<path class=\"gap\" d=\"M0,0L{:.2},{:.2}\"/>\n<text class=\"gap\" x=\"2\" y=\"3.4\">gap {gap:.2} mm</text>\n",
            rim.0, rim.1
        );
    }
    format!(
        "<figure class=\"still\"><svg viewBox=\"-43 -55 74 67\" role=\"img\" aria-label=\"{title}\">\n\
<circle class=\"rubber\" cx=\"{cx:.2}\" cy=\"{cy:.2}\" r=\"{r}\"/><circle class=\"hub\" cx=\"{cx:.2}\" cy=\"{cy:.2}\" r=\"{:.2}\"/>\n\
<path class=\"sleeve\" d=\"M-60,20V0H0V{:.2}H60V20Z\"/>\n\
<circle class=\"outline\" cx=\"{cx:.2}\" cy=\"{cy:.2}\" r=\"{r}\"/>\n{marks}</svg>\n\
<figcaption>Step {}: {title}</figcaption></figure>\n",
        0.7 * r,
        -c.height_mm,
        c.index,
    )
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;
    use crate::report::example;

    #[test]
    fn the_pictures_say_where_the_corner_touches() {
        let scene = Scene::new(&example::deploy()).unwrap();
        let html = html(Some(&scene));
        assert!(html.contains(">13.8 mm to the face</text>"), "{html}");
        for c in &scene.crossings {
            assert!(html.contains(&format!("{:.1} N at step {}", c.preload_n, c.index)), "{html}");
        }
        assert!(!html.contains("raises the preload"));
        assert_eq!(html.matches("<figcaption>").count(), 2);
    }

    #[test]
    fn measured_figures_are_said_to_be_measured() {
        let mut recording = example::deploy();
        assert!(!html(Scene::new(&recording).as_ref()).contains("captured log"));
        recording.rows.iter_mut().for_each(|row| row.truth = None);
        assert!(html(Scene::new(&recording).as_ref()).contains("captured log"));
        assert!(html(None).contains("cannot be drawn"));
    }

    /// Runs the script's own functions where there is a `node`.
    #[test]
    fn the_script_draws_the_geometry_of_the_rig() {
        let recording = example::deploy();
        let scene = Scene::new(&recording).unwrap();
        let times = scene.crossings.iter().flat_map(|c| [c.touch_s, c.lift_s]);
        let times: Vec<f64> = times.map(|t_s| (1e3 * t_s).floor() * 1e-3).collect();
        // Where the axle passes the first face, the load jumps from corner to wall.
        let face_mm = scene.crossings[0].face_mm;
        let place = scene.rows.iter().position(|row| row[1] >= face_mm).unwrap();
        let [before, behind] = [scene.rows[place - 1], scene.rows[place]];
        let program = format!(
            "{SCRIPT}\nconst scene = {};\n\
const jump = rowAt(scene, {}), edge = pose(scene, {{ ...jump, position_mm: {face_mm} + 0.01, corner_force_n: 50 }}).edge;\n\
if (jump.corner_force_n !== 0 || jump.floor_force_n !== {} || edge[0] !== {face_mm}) throw new Error(JSON.stringify([jump, edge]));\n\
const out = {times:?}.map((t) => {{\n\
const row = rowAt(scene, t), p = pose(scene, row);\n\
const arm = Math.hypot(p.pivot[0] - p.x, p.pivot[1] - p.y);\n\
const gap = Math.hypot(p.root[0] - p.rim[0], p.root[1] - p.rim[1]);\n\
return [p.x, p.y, gap, p.edge[0], p.edge[1], arm, p.spring_mm, phase(scene, row).length, \
current(scene, t).index];\n\
}});\nconsole.log(JSON.stringify(out));\n",
            scene.json(),
            before[0] + 0.3 * (behind[0] - before[0]),
            behind[6],
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.cjs");
        std::fs::write(&path, program).unwrap();
        let Ok(done) = Command::new("node").arg(&path).output() else {
            eprintln!("left out: there is no node");
            return;
        };
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let out: Vec<Vec<f64>> = serde_json::from_slice(&done.stdout).unwrap();
        assert_eq!(out.len(), 6);
        for (place, (t_s, drawn)) in times.iter().zip(&out).enumerate() {
            let row = &recording.rows[(1e3 * t_s).round() as usize];
            let truth = row.truth.unwrap();
            let crossing = &scene.crossings[place / 2];
            let spring_mm = 45.0 - truth.preload_true_n / (2.0 * 1.2);
            // Rows that were thinned out are interpolated.
            for (drawn, is, within) in [
                (drawn[0], truth.position_true_mm, 0.02),
                (drawn[1], 150.0 - truth.radius_true_mm, 0.02),
                (drawn[2], truth.root_clearance_mm, 0.02),
                (drawn[3], crossing.face_mm, 1e-9),
                (drawn[4], 4.0 * (1.0 + (place / 2) as f64), 1e-9),
                (drawn[5], 145.0, 1e-6),
                (drawn[6], spring_mm, 0.05),
            ] {
                assert!((drawn - is).abs() < within, "at {t_s}: {drawn} {is}");
            }
            assert!(drawn[7] > 40.0);
            assert!((drawn[8] - f64::from(crossing.index)).abs() < 1e-9, "another crossing");
        }
    }
}
