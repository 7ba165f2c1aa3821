//! The ring's gaps and forces over preload, with the published ones as marks.

use super::palette;
use super::panel::{Look, Marks, Panel, Shape};
use super::svg;

/// Size of the picture, CSS pixels.
const SIZE: (u32, u32) = (1120, 400);

/// (preload, gap, force) in N, mm, N: lines of the model at 5 and 8 mm/s, and what is
/// published at these.
#[derive(Clone, Debug)]
pub struct Published {
    /// The ring at 5 mm/s.
    pub slow: Vec<(f64, f64, f64)>,
    /// The ring at 8 mm/s.
    pub fast: Vec<(f64, f64, f64)>,
    /// Published at 5 mm/s.
    pub printed_slow: Vec<(f64, f64, f64)>,
    /// Published at 8 mm/s.
    pub printed_fast: Vec<(f64, f64, f64)>,
}

/// Two plots side by side, gap and collision force, as an SVG of 1120 x 400.
#[must_use]
pub fn published_svg(data: &Published) -> String {
    let gap = panel(data, "Gap: the tread is fitted to these three marks", "mm", |p| (p.0, p.1));
    let force = panel(data, "Collision force: not fitted", "N", |p| (p.0, p.2));
    svg::fixed(SIZE, |area| {
        let (left, right) = area.split_horizontally(svg::SCALE * SIZE.0 / 2);
        gap.draw(&left)?;
        force.draw(&right)
    })
}

fn panel(
    data: &Published,
    title: &str,
    y_name: &'static str,
    of: fn(&(f64, f64, f64)) -> (f64, f64),
) -> Panel {
    let points = |list: &[(f64, f64, f64)]| list.iter().map(of).collect::<Vec<_>>();
    let (slow, fast) = (palette::SPEED, palette::PRELOAD);
    let line = |name, colour, list: &[(f64, f64, f64)]| super::panel::Line {
        name,
        look: Look::Other(colour),
        points: points(list),
    };
    let marks = |name, shape, colour, list: &[(f64, f64, f64)]| Marks {
        name,
        shape,
        colour,
        shift: 0,
        points: points(list),
    };
    Panel {
        title: title.to_owned(),
        y_name,
        x_name: Some("preload, N"),
        x: (78.0, 142.0),
        y: None,
        least_span: 0.0,
        lines: vec![line("ring, 5 mm/s", slow, &data.slow), line("ring, 8 mm/s", fast, &data.fast)],
        marks: vec![
            marks("published, 5", Shape::Dot, slow, &data.printed_slow),
            marks("published, 8", Shape::Triangle, fast, &data.printed_fast),
        ],
        levels: Vec::new(),
        shades: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_published_marks_are_drawn_apart() {
        let data = Published {
            slow: vec![(80.0, 1.9, 45.0), (140.0, 1.4, 70.0)],
            fast: vec![(80.0, 2.1, 46.0), (140.0, 1.6, 72.0)],
            printed_slow: vec![(100.0, 1.71, 56.5), (120.0, 1.56, 51.2)],
            printed_fast: vec![(100.0, 1.9, 58.6)],
        };
        let svg = published_svg(&data);
        for text in ["ring, 5 mm/s", "ring, 8 mm/s", "published, 5", "preload, N", "not fitted"] {
            assert!(svg.contains(text), "{text}");
        }
        // Two published dots, one in the legend, on each plot; each with its rim.
        assert_eq!(svg.matches("<circle").count(), 2 * 3 * 2);
    }
}
