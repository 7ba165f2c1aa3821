//! The envelope as a picture: a map of friction and load for each strategy, known and unknown.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{Cell, Envelope};
use crate::compare::STRATEGIES;
use crate::report::axis::{self, Scale, label};
use crate::report::palette;
use crate::report::svg::{self, Area, Drawn, SCALE, font};
use crate::scenario::ControllerKind;

const S: i32 = SCALE as i32;
/// Size, CSS pixels: its text can still be read at a width of 400.
const SIZE: (u32, u32) = (640, 1160);
/// Height of a map's title.
const HEAD: i32 = 26 * S;
/// Height of the legend above all.
const LEGEND: i32 = 52 * S;
/// Text in a cell, CSS pixels.
const CELL_PX: f64 = 11.0;

/// The picture as SVG.
pub fn picture(envelope: &Envelope) -> String {
    let has_numbers = envelope.frictions.len() <= 10 && envelope.loads_n.len() <= 12;
    svg::fixed(SIZE, |area| {
        let (head, maps) = area.split_vertically(LEGEND);
        legend(&head, has_numbers)?;
        let places = STRATEGIES.into_iter().flat_map(|kind| [true, false].map(|k| (k, kind)));
        for (area, (known, kind)) in maps.split_evenly((STRATEGIES.len(), 2)).iter().zip(places) {
            map(envelope, area, (known, kind), has_numbers)?;
        }
        Ok(())
    })
}

/// What the colours say.
fn legend(head: &Area, has_numbers: bool) -> Drawn {
    let seconds = if has_numbers { "; seconds from the command" } else { "" };
    let good = format!("completes without slip, in % of the grid{seconds}");
    let style = || font(axis::TEXT_PX, palette::TEXT, HPos::Left, VPos::Center);
    for (colour, text, (left, middle)) in [
        (palette::OUTCOMES[0], &*good, (14, 15)),
        (palette::OUTCOMES[1], "completes, but slips", (14, 37)),
        (palette::OUTCOMES[2], "does not complete", (234, 37)),
    ] {
        let box_ = [(left * S, (middle - 6) * S), ((left + 18) * S, (middle + 6) * S)];
        head.draw(&Rectangle::new(box_, colour.filled()))?;
        head.draw(&Text::new(text, ((left + 24) * S, middle * S), style()))?;
    }
    head.draw(&Circle::new((442 * S, 37 * S), 3 * S, palette::TRUTH.stroke_width(3)))?;
    head.draw(&Text::new("nominal", (454 * S, 37 * S), style()))
}

/// Half the distance of neighbours: a cell reaches so far to each side.
fn half(values: &[f64]) -> f64 {
    0.5 * (values[values.len() - 1] - values[0]) / (values.len() - 1) as f64
}

/// How many decimals show every value; at most three.
fn decimals(values: &[f64]) -> usize {
    let shows = |n: &usize| {
        let scale = 10_f64.powi(*n as i32);
        values.iter().all(|value| ((value * scale).round() / scale - value).abs() < 1e-6)
    };
    (0..3).find(shows).unwrap_or(3)
}

/// The map of one strategy.
fn map(
    envelope: &Envelope,
    area: &Area,
    (known, controller): (bool, ControllerKind),
    has_numbers: bool,
) -> Drawn {
    let (head, body) = area.split_vertically(HEAD);
    let part = envelope.area(controller);
    let (what, part) = if known { ("known", part.known) } else { ("unknown", part.unknown) };
    let own = |cell: &&Cell| cell.known == known && cell.controller == controller;
    let all = envelope.frictions.len() * envelope.loads_n.len();
    let of = match envelope.cells.iter().filter(own).count() {
        done if done < all => format!("{done} of {all} places"),
        _ => "the grid".to_owned(),
    };
    let title = format!("{}, {what}: {:.0} % of {of}", controller.name(), 100.0 * part);
    let style = font(13.0, palette::TRUTH, HPos::Left, VPos::Center);
    head.draw(&Text::new(title, (46 * S, HEAD / 2), style))?;
    let (frictions, loads) = (&envelope.frictions, &envelope.loads_n);
    let (dx, dy) = (half(frictions), half(loads));
    let ends = |values: &[f64], by: f64| (values[0] - by, values[values.len() - 1] + by);
    let (x, y) = (ends(frictions, dx), ends(loads, dy));
    // Every second tick where there are many.
    let ticks = |values: &[f64]| {
        let every = values.len().div_ceil(8);
        values.iter().copied().step_by(every).collect::<Vec<_>>()
    };
    let mut chart = ChartBuilder::on(&body)
        .margin_left(4 * S)
        .margin_right(10 * S)
        .x_label_area_size(38 * S)
        .y_label_area_size(42 * S)
        .build_cartesian_2d(Scale::new(x, ticks(frictions)), Scale::new(y, ticks(loads)))?;
    axis::plain(&mut chart.configure_mesh())
        .x_label_formatter(&|x| label(*x, decimals(frictions)))
        .y_label_formatter(&|y| label(*y, decimals(loads)))
        .x_desc("friction")
        .y_desc("load, N")
        .draw()?;
    for cell in envelope.cells.iter().filter(own) {
        let (fx, fy) = (cell.friction, cell.load_n);
        let (colour, text) = match (cell.good(), cell.completed) {
            (true, _) => (palette::OUTCOMES[0], cell.duration_s),
            (false, true) => (palette::OUTCOMES[1], cell.duration_s),
            (false, false) => (palette::OUTCOMES[2], None),
        };
        let corners = [(fx - dx, fy - dy), (fx + dx, fy + dy)];
        chart.draw_series([Rectangle::new(corners, colour.filled())])?;
        if let Some(seconds) = text.filter(|_| has_numbers) {
            let style = font(CELL_PX, palette::TEXT, HPos::Center, VPos::Center);
            let text = Text::new(label(seconds, 1), (0, 0), style);
            chart.draw_series([EmptyElement::at((fx, fy)) + text])?;
        }
    }
    let ring = Circle::new(envelope.nominal, 3 * S, palette::TRUTH.stroke_width(3));
    let (friction, load) = envelope.nominal;
    let inside = (x.0..=x.1).contains(&friction) && (y.0..=y.1).contains(&load);
    chart.draw_series(inside.then_some(ring))?;
    Ok(())
}
