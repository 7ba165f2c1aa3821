//! One colour for a quantity, one look for a role, in every plot: truth is dark, references are
//! dashed, measurements and estimates have the quantity's colour.

use plotters::style::RGBColor;

pub const TRUTH: RGBColor = RGBColor(0x1f, 0x29, 0x37);
/// References; drawn dashed.
pub(crate) const WANTED: RGBColor = RGBColor(0x6b, 0x72, 0x80);
/// Limits; drawn dashed.
pub(crate) const LIMIT: RGBColor = RGBColor(0xb9, 0x1c, 0x1c);

/// First touch of a corner; drawn dashed.
pub(crate) const TOUCH: RGBColor = RGBColor(0xb4, 0x53, 0x09);
/// Face of a step.
pub(crate) const FACE: RGBColor = RGBColor(0x64, 0x74, 0x8b);

/// A limit that was reported.
pub(crate) const WARNING: RGBColor = RGBColor(0xa1, 0x62, 0x07);

/// Simulated by the reference models; drawn dashed.
pub const SIMULATED: RGBColor = RGBColor(0x1c, 0x6f, 0xd6);

pub const SPEED: RGBColor = RGBColor(0x1d, 0x7f, 0xe0);
pub const PRELOAD: RGBColor = RGBColor(0xe0, 0x7b, 0x12);
pub const GAP: RGBColor = RGBColor(0xd0, 0x2f, 0x6b);
pub const RADIUS: RGBColor = RGBColor(0x0f, 0x97, 0x97);
pub const SLIP: RGBColor = RGBColor(0x35, 0xa1, 0x4a);
/// Compression of the tread.
pub const COMPRESSION: RGBColor = RGBColor(0x80, 0x5a, 0xd5);
/// Force on the lower wall.
pub(crate) const FLOOR: RGBColor = RGBColor(0x3d, 0x8e, 0xb9);

pub const TEXT: RGBColor = RGBColor(0x37, 0x41, 0x51);
/// Axes.
pub(crate) const AXIS: RGBColor = RGBColor(0x9c, 0xa3, 0xaf);
/// Lines of the grid.
pub const GRID: RGBColor = RGBColor(0xe9, 0xeb, 0xef);
/// Shaded stretches.
pub(crate) const SHADE: RGBColor = RGBColor(0xfa, 0xf1, 0xdf);

/// Pale fills for the modes, by mode number.
pub(crate) const MODES: [u32; 13] = [
    0xe5e7eb, 0xd1d5db, 0xc7d2e8, 0xeef0f3, 0xddd0f2, 0xc3e3f5, 0xfce3a6, 0xf9b98f, 0xcbe8c4,
    0xd8c9b8, 0xa8dcb4, 0xf29b9b, 0xbcc1ca,
];

/// Pale fills for the contact stages; the first is for none.
pub(crate) const STAGES: [u32; 7] =
    [0xe5e7eb, 0xe5e7eb, 0xddd0f2, 0xfbd5b5, 0xe8b87a, 0xfce3a6, 0xc3e3f5];

/// Pale fills for the sleeve levels, repeated.
pub(crate) const LEVELS: [u32; 2] = [0xe9ecf1, 0xd6dce5];

/// Pale fills for how a run ended: well, with slip, not at all.
pub(crate) const OUTCOMES: [RGBColor; 3] = [rgb(0xb9e3c3), rgb(0xfce3a6), rgb(0xf4b8b8)];

/// The colour of its usual six digits.
pub(crate) const fn rgb(digits: u32) -> RGBColor {
    let [_, red, green, blue] = digits.to_be_bytes();
    RGBColor(red, green, blue)
}
