//! Drawing into SVG text.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::palette;

/// A drawing area of an SVG.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Result of drawing; into a text it cannot fail.
pub type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// Drawing units to one CSS pixel. The backend draws in whole units, so that lines
/// are placed to half a pixel.
pub const SCALE: u32 = 2;

/// An SVG of `size` CSS pixels that scales to its container, on transparent ground, with `name`
/// for screen readers.
pub(crate) fn fluid(size: (u32, u32), name: &str, draw: impl FnOnce(&Area) -> Drawn) -> String {
    let attributes = format!(r#"role="img" aria-label="{}""#, escape(name));
    picture(size, &attributes, draw)
}

/// An SVG of exactly `size` CSS pixels on white ground.
pub fn fixed(size: (u32, u32), draw: impl FnOnce(&Area) -> Drawn) -> String {
    let attributes = format!(r#"width="{}" height="{}""#, size.0, size.1);
    picture(size, &attributes, |area| {
        area.fill(&WHITE)?;
        draw(area)
    })
}

fn picture(size: (u32, u32), attributes: &str, draw: impl FnOnce(&Area) -> Drawn) -> String {
    let (width, height) = (size.0 * SCALE, size.1 * SCALE);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        draw(&area).and_then(|()| area.present()).expect("a text takes every drawing");
    }
    let head = format!(r#"<svg width="{width}" height="{height}""#);
    let mut text =
        text.replacen(&head, &format!(r#"<svg {attributes} stroke-linejoin="round""#), 1);
    for (colour, dashes) in palette::DASHES {
        let stroke = format!(r#"stroke="{colour}""#);
        text = text.replace(&stroke, &format!(r#"{stroke} stroke-dasharray="{dashes}""#));
    }
    text.replace(" opacity=\"1\"", "").replace(" \"/>\n", "\"/>\n")
}

/// Text of `px` CSS pixels.
pub fn font(px: f64, colour: RGBColor, h: HPos, v: VPos) -> TextStyle<'static> {
    ("sans-serif", size(px)).into_font().color(&colour).pos(Pos::new(h, v))
}

/// The backend's font size for text of `px` CSS pixels.
pub fn size(px: f64) -> f64 {
    px * f64::from(SCALE) * 1.24
}

/// Estimated width of `text` of `px` CSS pixels, in drawing units, on the wide side.
pub fn text_width(text: &str, px: f64) -> i32 {
    (0.60 * px * f64::from(SCALE) * text.chars().count() as f64).ceil() as i32
}

/// `text` with what HTML would read as mark-up escaped.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashed_colours_get_their_dashes() {
        let dashed = [palette::WANTED, palette::LIMIT, palette::SIMULATED, palette::TOUCH];
        assert_eq!(dashed.len(), palette::DASHES.len());
        for (colour, (text, _)) in dashed.iter().zip(palette::DASHES) {
            assert_eq!(format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2), text);
        }
        let svg =
            fixed((10, 10), |area| area.draw(&PathElement::new([(0, 0), (5, 5)], palette::WANTED)));
        assert!(svg.contains("stroke-dasharray=\"11 7\""), "{svg}");
        assert!(svg.contains(r#"<svg width="10" height="10""#), "{svg}");
    }

    #[test]
    fn markup_is_escaped() {
        assert_eq!(escape("a<b & \"c\">"), "a&lt;b &amp; &quot;c&quot;&gt;");
    }
}
