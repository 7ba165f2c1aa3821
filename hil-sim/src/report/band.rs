//! Mode, contact stage and sleeve level as three bands on the axis of the plots.

use std::collections::BTreeSet;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis;
use super::mesh::TEXT_PX;
use super::palette;
use super::panel::{HEAD, LEFT, RIGHT};
use super::panels::View;
use super::svg::{Area, Drawn, SCALE, escape, font, text_width};
use crate::record::{MODE_NAMES, STAGE_NAMES, Tick};

const S: i32 = SCALE as i32;

/// One band: its name, and what a row shows in it.
struct Lane {
    name: &'static str,
    of: fn(&Tick) -> u8,
    show: fn(u8) -> (String, RGBColor),
}

const LANES: [Lane; 3] = [
    Lane { name: "mode", of: |row| row.controller.mode, show: mode },
    Lane { name: "stage", of: |row| row.controller.stage, show: stage },
    Lane { name: "level", of: |row| row.controller.level, show: level },
];

fn mode(number: u8) -> (String, RGBColor) {
    let place = usize::from(number);
    let name = MODE_NAMES.get(place).map_or_else(|| format!("mode {number}"), |&n| n.to_owned());
    (name, palette::MODES[place % palette::MODES.len()])
}

fn stage(number: u8) -> (String, RGBColor) {
    let place = usize::from(number).wrapping_sub(1);
    let name =
        STAGE_NAMES.get(place).map_or_else(|| "none".to_owned(), |n| format!("{number} {n}"));
    (name, palette::STAGES[place % palette::STAGES.len()])
}

fn level(number: u8) -> (String, RGBColor) {
    let place = usize::from(number);
    (number.to_string(), palette::LEVELS[place % palette::LEVELS.len()])
}

/// Where the bands are in a picture of `size` CSS pixels: left, right, top and bottom, in drawing
/// units.
pub(super) fn frame(size: (u32, u32)) -> [i32; 4] {
    let (wide, high) = ((size.0 * SCALE) as i32, (size.1 * SCALE) as i32);
    [LEFT, wide - RIGHT, HEAD, high - 44 * S]
}

/// Draws the bands of `view` into `area`.
pub(super) fn draw(view: &View, area: &Area) -> Drawn {
    let (head, body) = area.split_vertically(HEAD);
    let style = font(14.0, palette::TRUTH, HPos::Left, VPos::Center);
    head.draw(&Text::new("Mode, contact stage and sleeve level", (8 * S, HEAD / 2), style))?;
    let (wide, high) = body.dim_in_pixel();
    let (from, to) = (LEFT, wide as i32 - RIGHT);
    let x_of = |x: f64| {
        from + ((x - view.x.0) / (view.x.1 - view.x.0) * f64::from(to - from)).round() as i32
    };
    let lane_height = (high as i32 - 44 * S) / LANES.len() as i32;
    for (place, lane) in LANES.iter().enumerate() {
        let top = place as i32 * lane_height + 2 * S;
        let bottom = top + lane_height - 5 * S;
        let middle = (top + bottom) / 2;
        let name = font(TEXT_PX, palette::TEXT, HPos::Right, VPos::Center);
        body.draw(&Text::new(lane.name, (LEFT - 8 * S, middle), name))?;
        for (start, end, value) in spans(view, lane.of) {
            let (label, colour) = (lane.show)(value);
            let (left, right) = (x_of(start.max(view.x.0)), x_of(end.min(view.x.1)));
            if right <= left {
                continue;
            }
            body.draw(&Rectangle::new([(left, top), (right, bottom)], colour.filled()))?;
            if text_width(&label, 11.0) + 4 * S <= right - left {
                let style = font(11.0, palette::TRUTH, HPos::Center, VPos::Center);
                body.draw(&Text::new(label, ((left + right) / 2, middle), style))?;
            }
        }
    }
    let base = LANES.len() as i32 * lane_height + 2 * S;
    body.draw(&PathElement::new([(from, base), (to, base)], palette::AXIS.stroke_width(2)))?;
    let (ticks, decimals) = axis::ticks(view.x, (wide as i32 / (75 * S)).max(2) as usize);
    for tick in ticks {
        let at = x_of(tick);
        let mark =
            PathElement::new([(at, base), (at, base + 4 * S)], palette::AXIS.stroke_width(2));
        body.draw(&mark)?;
        let style = font(TEXT_PX, palette::TEXT, HPos::Center, VPos::Top);
        body.draw(&Text::new(axis::label(tick, decimals), (at, base + 6 * S), style))?;
    }
    let style = font(TEXT_PX, palette::TEXT, HPos::Center, VPos::Bottom);
    body.draw(&Text::new(view.across.name(), ((from + to) / 2, high as i32 - 4 * S), style))
}

/// Spans of the axis over which `of` stays the same.
fn spans(view: &View, of: fn(&Tick) -> u8) -> Vec<(f64, f64, u8)> {
    let x = |row: &Tick| view.across.of(row);
    let runs: Vec<&[Tick]> = view.rows.chunk_by(|a, b| of(a) == of(b)).collect();
    let next = runs.iter().skip(1).map(|run| x(&run[0])).chain(view.rows.last().map(x));
    let spans = runs.iter().zip(next).map(|(run, end)| (x(&run[0]), end, of(&run[0])));
    spans.map(|(a, b, value)| (a.min(b), a.max(b), value)).collect()
}

/// The colours of the modes and stages that occur, as HTML.
pub(super) fn legend(rows: &[Tick]) -> String {
    let mut html = String::new();
    for lane in &LANES[..2] {
        let present: BTreeSet<u8> = rows.iter().map(lane.of).collect();
        let chips: String = present
            .into_iter()
            .map(lane.show)
            .map(|(name, RGBColor(r, g, b))| {
                let name = escape(&name);
                format!("<span><i style=\"background:#{r:02x}{g:02x}{b:02x}\"></i>{name}</span>")
            })
            .collect();
        html += &format!("<p class=\"chips\"><b>{}</b> {chips}</p>\n", lane.name);
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Controller, Recording};
    use crate::report::panels::Across;

    #[test]
    fn spans_join_and_name_what_follows() {
        let row = |t_s, mode| {
            let controller = Controller { t_s, mode, ..Controller::default() };
            Tick { controller, truth: None }
        };
        let rows = vec![row(0.0, 5), row(1.0, 5), row(2.0, 6), row(3.0, 7)];
        let recording = Recording { rows, ..Recording::default() };
        let view = View::new(&recording, Across::Time);
        assert_eq!(
            spans(&view, |row| row.controller.mode),
            [(0.0, 2.0, 5), (2.0, 3.0, 6), (3.0, 3.0, 7)]
        );
        let legend = legend(&recording.rows);
        assert!(legend.contains("cruise") && !legend.contains("fault"), "{legend}");
    }

    #[test]
    fn unknown_numbers_still_have_a_name() {
        assert_eq!(mode(77).0, "mode 77");
        assert_eq!(stage(0).0, "none");
        assert_eq!(stage(7).0, "none");
    }
}
