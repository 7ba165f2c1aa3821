//! Text in SVG and HTML.

/// Size of all text of a plot, user units.
pub(super) const TEXT_PX: f64 = 12.0;

/// Estimated width of `text`, user units, on the wide side.
pub(super) fn width(text: &str) -> f64 {
    0.60 * TEXT_PX * text.chars().count() as f64
}

/// `text` with what HTML would read as mark-up escaped.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
