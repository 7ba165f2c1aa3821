//! A terminal's screen as a picture, for the pages.

use std::fmt::Write;

use ratatui::buffer::Buffer;
use ratatui::style::{Color, Modifier};

/// Size of a cell, CSS pixels.
const CELL: (u32, u32) = (8, 17);
/// Ground and text.
const GROUND: &str = "#14171c";
const TEXT: &str = "#d8dce2";

/// The screen as an SVG of a monospaced font; cells of one look that follow one another
/// are one text.
#[must_use]
pub fn svg(buffer: &Buffer) -> String {
    let area = buffer.area;
    let (width, height) = (u32::from(area.width) * CELL.0, u32::from(area.height) * CELL.1);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
font-family=\"DejaVu Sans Mono, monospace\" font-size=\"13.29\" xml:space=\"preserve\">\n\
<rect width=\"100%\" height=\"100%\" fill=\"{GROUND}\"/>\n"
    );
    for y in 0..area.height {
        let mut x = 0;
        while x < area.width {
            let look = look(buffer, x, y);
            let from = x;
            let mut text = String::new();
            while x < area.width && self::look(buffer, x, y) == look {
                text += buffer[(x, y)].symbol();
                x += 1;
            }
            put(&mut svg, (from, y, x - from), &look, &text);
        }
    }
    svg + "</svg>\n"
}

/// How a cell looks: text, ground, bold.
type Look = (&'static str, Option<&'static str>, bool);

fn look(buffer: &Buffer, x: u16, y: u16) -> Look {
    let cell = &buffer[(x, y)];
    let ground = match cell.bg {
        Color::Reset => None,
        other => Some(colour(other)),
    };
    (colour(cell.fg), ground, cell.modifier.contains(Modifier::BOLD))
}

fn put(svg: &mut String, (x, y, cells): (u16, u16, u16), look: &Look, text: &str) {
    let (fill, ground, bold) = look;
    let (left, top) = (u32::from(x) * CELL.0, u32::from(y) * CELL.1);
    let width = u32::from(cells) * CELL.0;
    // Writing into a text cannot fail.
    if let Some(ground) = ground {
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{}\" fill=\"{ground}\"/>",
            CELL.1
        );
    }
    if text.trim().is_empty() {
        return;
    }
    let weight = if *bold { " font-weight=\"bold\"" } else { "" };
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    // Blanks that are not left out, or the text would be stretched over their place.
    let text = text.replace(' ', "\u{a0}");
    let _ = writeln!(
        svg,
        "<text x=\"{left}\" y=\"{}\" fill=\"{fill}\" textLength=\"{width}\"{weight}>{text}</text>",
        top + 13
    );
}

const fn colour(colour: Color) -> &'static str {
    match colour {
        Color::Black => "#14171c",
        Color::Gray => "#9aa4b2",
        Color::Red | Color::LightRed => "#ef6b6b",
        Color::Green => "#5fc27a",
        Color::Yellow => "#e6a93c",
        Color::Cyan => "#4fb3d9",
        Color::Magenta => "#c58be0",
        _ => TEXT,
    }
}

#[cfg(test)]
mod tests {
    use super::super::screen::tests::drawn;
    use super::*;

    #[test]
    fn the_picture_shows_what_the_screen_does() {
        let svg = svg(&drawn());
        for part in ["speed,\u{a0}mm/s", "r\u{a0}retract", "#4fb3d9", "</svg>"] {
            assert!(svg.contains(part), "{part}");
        }
        assert_eq!(svg.matches("<svg").count(), 1);
    }
}
