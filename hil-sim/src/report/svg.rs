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

/// An SVG of exactly `size` CSS pixels on white ground.
pub fn fixed(size: (u32, u32), draw: impl FnOnce(&Area) -> Drawn) -> String {
    let (width, height) = (size.0 * SCALE, size.1 * SCALE);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        let drawn = area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present());
        drawn.expect("a text takes every drawing");
    }
    let head = format!(r#"<svg width="{width}" height="{height}""#);
    let shown = format!(r#"<svg width="{}" height="{}" stroke-linejoin="round""#, size.0, size.1);
    let stroke = format!(r#"stroke="{}""#, hex(palette::SIMULATED).to_uppercase());
    let text = text.replacen(&head, &shown, 1);
    let text = text.replace(&stroke, &format!(r#"{stroke} stroke-dasharray="16 8""#));
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
    (f64::from(SCALE) * width(text, px)).ceil() as i32
}

/// The same in CSS pixels.
pub(crate) fn width(text: &str, px: f64) -> f64 {
    0.60 * px * text.chars().count() as f64
}

/// A colour as SVG and HTML write it.
pub(crate) fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// `text` with what HTML would read as mark-up escaped.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_simulated_is_dashed() {
        let line = PathElement::new([(0, 0), (5, 5)], palette::SIMULATED);
        let svg = fixed((10, 10), |area| area.draw(&line));
        assert!(svg.contains("stroke-dasharray=\"16 8\""), "{svg}");
        assert!(svg.contains(r#"<svg width="10" height="10""#), "{svg}");
    }
}
