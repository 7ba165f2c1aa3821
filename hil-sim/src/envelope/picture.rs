//! The envelope as a picture: a map of friction and load for each strategy, known and unknown.

use super::{Cell, Envelope};
use crate::compare::STRATEGIES;
use crate::report::axis::{Scale, label};
use crate::report::palette;
use crate::report::panel::{HeatCell, Marks, Panel, Shape, sheet};
use crate::scenario::ControllerKind;

pub(crate) fn picture(envelope: &Envelope) -> String {
    let places = STRATEGIES.into_iter().flat_map(|kind| [true, false].map(|k| (k, kind)));
    sheet(places.map(|place| map(envelope, place)).collect(), 2, true)
}

/// Half the distance of neighbours: a cell reaches so far to each side.
fn half(values: &[f64]) -> f64 {
    0.5 * (values[values.len() - 1] - values[0]) / (values.len() - 1) as f64
}

/// The values with as many decimals as show every one, at most three: every second where there are
/// many.
fn axis(values: &[f64]) -> Scale {
    let shows = |n: &usize| {
        let scale = 10_f64.powi(*n as i32);
        values.iter().all(|value| ((value * scale).round() / scale - value).abs() < 1e-6)
    };
    let decimals = (0..3).find(shows).unwrap_or(3);
    let named = values.iter().step_by(values.len().div_ceil(8));
    Scale::Named(named.map(|value| (*value, label(*value, decimals))).collect())
}

/// The map of one strategy.
fn map(envelope: &Envelope, (known, controller): (bool, ControllerKind)) -> Panel {
    let (frictions, loads) = (&envelope.frictions, &envelope.loads_n);
    let has_numbers = frictions.len() <= 10 && loads.len() <= 12;
    let part = envelope.area(controller);
    let (what, part) = if known { ("known", part.known) } else { ("unknown", part.unknown) };
    let own = |cell: &&Cell| cell.known == known && cell.controller == controller;
    let all = frictions.len() * loads.len();
    let of = match envelope.cells.iter().filter(own).count() {
        done if done < all => format!(" of {done} of {all} places"),
        _ => String::new(),
    };
    let seconds = if has_numbers { "; seconds from the command" } else { "" };
    let good = format!("completes without slip, in % of the grid{seconds}");
    let (dx, dy) = (half(frictions), half(loads));
    let cell = |cell: &Cell| {
        let (place, name) = match (cell.good(), cell.completed) {
            (true, _) => (0, &*good),
            (false, true) => (1, "completes, but slips"),
            (false, false) => (2, "does not complete"),
        };
        let seconds = cell.duration_s.filter(|_| cell.completed && has_numbers);
        HeatCell {
            x: (cell.friction - dx, cell.friction + dx),
            y: (cell.load_n - dy, cell.load_n + dy),
            colour: palette::OUTCOMES[place],
            name: name.to_owned(),
            text: seconds.map_or_else(String::new, |seconds| label(seconds, 1)),
        }
    };
    let ends = |values: &[f64], by: f64| (values[0] - by, values[values.len() - 1] + by);
    Panel {
        title: format!("{}, {what}: {:.0} %{of}", controller.name(), 100.0 * part),
        x_name: "friction".to_owned(),
        y_name: "load, N".to_owned(),
        x_axis: axis(frictions),
        y_axis: axis(loads),
        x: ends(frictions, dx),
        y: Some(ends(loads, dy)),
        cells: envelope.cells.iter().filter(own).map(cell).collect(),
        marks: vec![Marks {
            name: "nominal".to_owned(),
            shape: Shape::Dot,
            colour: palette::TRUTH,
            points: vec![envelope.nominal],
        }],
        ..Panel::default()
    }
}
