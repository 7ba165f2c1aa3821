//! Plots the residuals of a log, a row per channel, with the 95 % band of a normal
//! distribution with their root mean square.

use super::result::Residuals;
use crate::report::axis::{extent, padded};
use crate::report::palette;
use crate::report::panel::{Look, Marks, Panel, Shape, sheet};

/// Half-width of the band, standard deviations.
const NORMAL_95: f64 = 1.96;

pub(crate) fn svg(rows: &[&Residuals]) -> String {
    let times = rows.iter().flat_map(|row| row.series.iter().map(|(t, _)| *t));
    let x = padded(extent(times).unwrap_or((0.0, 1.0)), 0.01);
    let panel = |row: &&Residuals| Panel {
        title: format!(
            "{}, {}: rms {:.2e} {}, {} values, {:.0} of them independent",
            row.log, row.channel, row.rms, row.unit, row.count, row.independent
        ),
        y_name: format!("{} residual, {}", row.channel, row.unit),
        x_name: "time from boot, s".to_owned(),
        x,
        marks: vec![Marks {
            name: row.channel.into(),
            shape: Shape::Dot,
            colour: match row.channel {
                "compression" => palette::COMPRESSION,
                "arm angle" => palette::RADIUS,
                "drive effort" => palette::SPEED,
                _ => palette::PRELOAD,
            },
            points: row.series.clone(),
        }],
        levels: [-1.0, 1.0].map(|end| ("95 %", Look::Limit, end * NORMAL_95 * row.rms)).to_vec(),
        ..Panel::default()
    };
    sheet(rows.iter().map(panel).collect(), 1, false)
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
        // Rim and body of all three, and of the legend's.
        assert_eq!(svg.matches("h0\"/>").count(), 2 * (2 + 2));
        assert_eq!(svg.matches("h0M").count(), 2 * 2 * 2);
        assert!(svg.contains("a.csv, compression: rms 1.00e-1 mm, 3 values"), "{svg}");
        assert!(svg.contains("time from boot, s") && svg.contains("compression residual, mm"));
    }
}
