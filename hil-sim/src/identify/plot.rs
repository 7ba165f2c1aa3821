//! Plots the residuals of a log, a row per channel, with the 95 % band of a normal
//! distribution with their root mean square.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::result::{NORMAL_95, Residuals};
use crate::report::axis::{Scale, extent, label, padded, ticks};
use crate::report::svg::{Area, Drawn, SCALE, fixed, font};
use crate::report::{mesh, palette};

const S: i32 = SCALE as i32;
/// Width of a picture and height of a row, CSS pixels.
const WIDTH: u32 = 1040;
const ROW: u32 = 190;
/// Height of a row's title.
const TITLE: u32 = 24;
const TITLE_PX: f64 = 13.0;
const LEFT: i32 = 78 * S;

pub fn svg(rows: &[&Residuals]) -> String {
    let times = rows.iter().flat_map(|row| row.series.iter().map(|(t, _)| *t));
    let x = padded(extent(times).unwrap_or((0.0, 1.0)), 0.01);
    fixed((WIDTH, ROW * rows.len() as u32), |area| {
        let cells = area.split_evenly((rows.len().max(1), 1));
        for (index, (row, cell)) in rows.iter().zip(&cells).enumerate() {
            draw(row, x, index + 1 == rows.len(), cell)?;
        }
        Ok(())
    })
}

fn colour(channel: &str) -> RGBColor {
    match channel {
        "compression" => palette::COMPRESSION,
        "arm angle" => palette::RADIUS,
        "drive effort" => palette::SPEED,
        _ => palette::PRELOAD,
    }
}

fn draw(row: &Residuals, x: (f64, f64), last: bool, cell: &Area) -> Drawn {
    let (head, body) = cell.split_vertically(TITLE * SCALE);
    let title = format!(
        "{}, {}: rms {:.2e} {}, {} values, {:.0} of them independent",
        row.log, row.channel, row.rms, row.unit, row.count, row.independent
    );
    let style = font(TITLE_PX, palette::TEXT, HPos::Left, VPos::Center);
    head.draw(&Text::new(title, (LEFT, (TITLE * SCALE) as i32 / 2), style))?;
    let band = NORMAL_95 * row.rms;
    let values = row.series.iter().map(|(_, r)| *r).chain([-1.2 * band, 1.2 * band]);
    let y = padded(extent(values).unwrap_or((-1.0, 1.0)), 0.05);
    let (x_ticks, x_decimals) = ticks(x, 12);
    let (y_ticks, y_decimals) = ticks(y, 4);
    let mut chart = ChartBuilder::on(&body)
        .margin_right(16 * S)
        .margin_top(2 * S)
        .x_label_area_size(if last { 38 * S } else { 8 * S })
        .y_label_area_size(LEFT)
        .build_cartesian_2d(Scale::new(x, x_ticks), Scale::new(y, y_ticks))?;
    chart.draw_series([Rectangle::new([(x.0, -band), (x.1, band)], palette::SHADE.filled())])?;
    mesh::plain(&mut chart.configure_mesh())
        .x_label_formatter(&|x| if last { label(*x, x_decimals) } else { String::new() })
        .y_label_formatter(&|y| label(*y, y_decimals))
        .x_desc(if last { "time, s" } else { "" })
        .y_desc(row.unit)
        .draw()?;
    let dot = |&(t, r): &(f64, f64)| Circle::new((t, r), 3, colour(row.channel).filled());
    chart.draw_series(row.series.iter().map(dot))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_residual_is_drawn_and_the_channel_named() {
        let row = |channel| Residuals {
            log: "a.csv".into(),
            channel,
            unit: "mm",
            rms: 0.1,
            count: 3,
            independent: 2.0,
            series: vec![(0.0, 0.1), (1.0, -0.1), (2.0, 0.05)],
        };
        let (first, second) = (row("compression"), row("preload"));
        let svg = svg(&[&first, &second]);
        assert_eq!(svg.matches("<circle").count(), 6);
        assert!(svg.contains("a.csv, compression: rms 1.00e-1 mm, 3 values"), "{svg}");
        assert!(svg.contains("time, s"));
    }
}
