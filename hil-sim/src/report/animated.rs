//! The crossing of a step as a picture that moves by itself, for pages without scripts.

use std::fmt::Write as _;

use super::crossings::view;
use super::palette;
use super::panel::{Look, WIDE, ZOOM};
use super::scene::Scene;
use super::svg::escape;
use super::verdict::origin;
use crate::record::Recording;

/// Size of the picture, CSS pixels.
const SIZE: (f64, f64) = (ZOOM * WIDE, 705.0);
/// Where the pictures of wheel and corner are, and where the plots begin, with their heights.
const WHEEL: &str = "y=\"40\" width=\"390\" height=\"300\" viewBox=\"-50 -54 80.6 62\"";
const CORNER: &str = "x=\"400\" y=\"40\" width=\"240\" height=\"300\" viewBox=\"-11 -15 16 20\"";
const PLOTS: f64 = 345.0;
const PLOT: [f64; 2] = [145.0, 215.0];
/// Shown around the first touch and lift-off, s.
const AROUND_S: (f64, f64) = (0.45, 0.75);
/// How many times slower than the run, and how long it stops at lift-off, s.
const SLOWER: f64 = 4.0;
const STOP_S: f64 = 2.0;
/// Pictures between which it moves evenly.
const FRAMES: usize = 60;

/// What moves the element that it is in.
const MOVE: &str = "animateTransform attributeName=\"transform\" type=\"translate\"";

/// The second crossing of the run, the first where there is no other; none without one.
pub(crate) fn animated_svg(recording: &Recording) -> Option<String> {
    let recording = &recording.since_command();
    let scene = Scene::new(recording)?;
    let place = scene.crossings.len().checked_sub(1)?.min(1);
    let (c, line) = (&scene.crossings[place], &recording.summary.crossings[place]);
    let (first, last) = (c.touch_s.min(c.lift_s), c.touch_s.max(c.lift_s));
    let (from, to) = (first - AROUND_S.0, last + AROUND_S.1);
    let long = SLOWER * (to - from) + STOP_S;
    // Instants of the run, and when they are shown: lift-off twice, the time that it stops apart.
    let even = (0..=FRAMES).map(|n| from + (to - from) * n as f64 / FRAMES as f64);
    let mut times: Vec<f64> = even.chain([c.lift_s, c.lift_s]).collect();
    times.sort_by(f64::total_cmp);
    let stop = times.iter().position(|t| *t >= c.lift_s)?;
    let shown = |(n, t): (usize, &f64)| SLOWER * (t - from) + if n > stop { STOP_S } else { 0.0 };
    let keys: Vec<String> =
        times.iter().enumerate().map(|at| format!("{:.4}", shown(at) / long)).collect();
    let keys = keys.join(";");
    let animate = |attributes: &str, value: &dyn Fn(f64) -> String| {
        let values: Vec<String> = times.iter().map(|t| value(*t)).collect();
        format!(
            "<{attributes} values=\"{}\" keyTimes=\"{keys}\" dur=\"{long:.2}s\" repeatCount=\"indefinite\"/>",
            values.join(";")
        )
    };
    let g = &scene.geometry;
    let (r, lower) = (g.wheel_radius_mm, g.wall_mm(c.face_mm) - c.height_mm);
    // Relative to the step's root, y downwards.
    let axle = |t: f64| {
        let [_, position, radius, ..] = scene.row(t);
        (position - c.face_mm, lower + radius - g.wall_radius_mm)
    };
    let moved = animate(MOVE, &|t| format!("{:.3} {:.3}", axle(t).0, axle(t).1));
    let turned = animate("animateTransform attributeName=\"transform\" type=\"rotate\"", &|t| {
        format!("{:.1}", (axle(t).0 / r).to_degrees())
    });
    let arrow = |t: f64| 0.5 * scene.row(t)[3];
    let tail = animate("animate attributeName=\"y1\"", &|t| format!("{:.2}", -arrow(t)));
    // The point of the undeformed wheel next to the root.
    let rim = |t: f64| {
        let (x, y) = axle(t);
        let part = 1.0 - r / x.hypot(y);
        if x < 0.0 { (x * part, y * part) } else { (0.0, 0.0) }
    };
    let gap_x = animate("animate attributeName=\"x2\"", &|t| format!("{:.3}", rim(t).0));
    let gap_y = animate("animate attributeName=\"y2\"", &|t| format!("{:.3}", rim(t).1));
    let mut words = String::new();
    let reference = format!("gap {:.2} mm, reference {:.2} mm", c.gap_mm, scene.gap_ref_mm);
    let carries = if scene.retracts { "the lower wall carries" } else { "lift-off" };
    let shown = |when: &dyn Fn(f64) -> bool| {
        animate("animate attributeName=\"opacity\" calcMode=\"discrete\"", &|t| {
            u8::from(when(t)).to_string()
        })
    };
    let named = shown(&|t| rim(t) != (0.0, 0.0));
    for (text, since, until) in [
        ("It slows before the step".to_owned(), f64::MIN, first),
        ("The corner takes over the load".to_owned(), first, last),
        (format!("Step {}, {carries}: {reference}", c.index), last, last.next_up()),
        (format!("Over the corner; {carries}: {reference}"), last.next_up(), f64::MAX),
    ] {
        let opacity = shown(&|t| (since..until).contains(&t));
        let _ = writeln!(
            words,
            "<text x=\"20\" y=\"27\" font-size=\"17\" opacity=\"0\">{text}{opacity}</text>"
        );
    }
    let view = view(recording, line, AROUND_S);
    let (mut plots, mut down) = (String::new(), PLOTS);
    for (mut panel, high) in [view.preload(), view.gap()].into_iter().zip(PLOT) {
        panel.title.truncate("Clearance".len());
        // As much as fits its height.
        panel.y_name = panel.y_name.trim_end_matches(" of reference").to_owned();
        if down == PLOTS {
            panel.x_name.clear();
        }
        if !scene.measured {
            panel.lines.retain(|line| !matches!(line.look, Look::Measured(_)));
            panel.marks.retain(|marks| marks.name == "gap, true");
        }
        let (plot, [left, right, top, bottom]) = panel.alone(high / ZOOM);
        let at = animate(MOVE, &|t| {
            format!("{:.1} 0", left + (t - from) / (to - from) * (right - left))
        });
        let _ = writeln!(
            plots,
            "<g transform=\"translate(0 {down}) scale({ZOOM})\">{plot}<path stroke=\"{}\" \
stroke-width=\"1.5\" d=\"M0 {top}V{bottom}\">{at}</path></g>",
            palette::GAP,
        );
        down += high;
    }
    let [gap, preload] = [palette::GAP, palette::PRELOAD];
    let (h, reach, hub) = (c.height_mm, scene.gap_ref_mm, 0.7 * r);
    Some(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
font-family=\"sans-serif\" fill=\"#1f2937\">\n<title>A crossing of a simulated run, {SLOWER} times slower: {2}</title>\n\
<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n<svg {WHEEL}>\n<g id=\"crossing\">\n\
<g>{moved}<g>{turned}<circle r=\"{r}\" fill=\"#59616d\"/><circle r=\"{hub}\" fill=\"#e3e7ec\"/>\
<path d=\"M-17 0H17M0 -17V17\" stroke=\"#5b6472\" stroke-width=\"0.4\"/></g></g>\n\
<path d=\"M-99 99V0H0V-{h}H99V99Z\" fill=\"#c3cad4\" stroke=\"#1f2937\" stroke-width=\"0.2\"/>\n\
<path d=\"M-{reach} 0A{reach} {reach} 0 0 1 0 -{reach}\" fill=\"none\" stroke=\"#287c3c\" stroke-width=\"0.25\"/>\n\
<line x1=\"0\" y1=\"0\" stroke=\"{gap}\" stroke-width=\"0.5\">{gap_x}{gap_y}</line></g>\n\
<g>{moved}<circle r=\"{r}\" fill=\"none\" stroke=\"#1f2937\" stroke-width=\"0.3\" stroke-dasharray=\"1 0.8\"/>\
<g stroke=\"{preload}\" stroke-width=\"1\" fill=\"none\"><line y2=\"0\">{tail}</line><path d=\"M-1.4 -2.4L0 0L1.4 -2.4\"/></g>\
<text x=\"2\" y=\"-5\" font-size=\"3\">preload</text></g></svg>\n\
<svg {CORNER}><rect x=\"-11\" y=\"-15\" width=\"16\" height=\"20\" fill=\"#f4f5f7\"/><use href=\"#crossing\"/>\
<g font-size=\"1\"><text x=\"0.4\" y=\"1.2\" fill=\"{gap}\">clearance{named}</text>\
<text x=\"-3\" y=\"1.3\" text-anchor=\"end\" fill=\"#287c3c\">reference gap</text></g></svg>\n\
{words}{plots}</svg>\n",
        SIZE.0,
        SIZE.1,
        escape(&origin(&recording.summary)),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn the_picture_moves_by_the_rows_of_the_run_and_stops_at_the_gap() {
        let mut run = example::deploy();
        let svg = animated_svg(&run).expect("a crossing");
        let gap_mm = run.summary.crossings[1].gap_mm;
        assert!(svg.contains(&format!("Step 2, lift-off: gap {gap_mm:.2} mm, reference")), "{svg}");
        let of = |name: &str, after: &str| -> Vec<String> {
            let text =
                svg.split(after).nth(1).and_then(|rest| rest.split(&format!("{name}=\"")).nth(1));
            text.unwrap().split('"').next().unwrap().split(';').map(str::to_owned).collect()
        };
        let keys: Vec<f64> =
            of("keyTimes", "translate").iter().map(|t| t.parse().unwrap()).collect();
        assert_eq!((keys[0], keys[keys.len() - 1]), (0.0, 1.0));
        assert!(keys.windows(2).all(|pair| pair[0] <= pair[1]));
        // It stops at lift-off, where the line is as long as the gap.
        let stop = keys.windows(2).position(|pair| pair[1] - pair[0] > 0.1).expect("a stop");
        let [x, y] = ["x2", "y2"].map(|end| {
            of("values", &format!("attributeName=\"{end}\""))[stop].parse::<f64>().unwrap()
        });
        assert!((x.hypot(y) - gap_mm).abs() < 0.01, "{x} {y} {gap_mm}");
        assert!(!svg.contains("NaN") && svg.len() < 200_000, "{} bytes", svg.len());
        // Without a crossing there is no picture.
        run.summary.crossings.clear();
        assert!(animated_svg(&run).is_none());
    }
}
