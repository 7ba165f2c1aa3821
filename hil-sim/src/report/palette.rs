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
pub const MODES: [RGBColor; 13] = [
    RGBColor(0xe5, 0xe7, 0xeb),
    RGBColor(0xd1, 0xd5, 0xdb),
    RGBColor(0xc7, 0xd2, 0xe8),
    RGBColor(0xee, 0xf0, 0xf3),
    RGBColor(0xdd, 0xd0, 0xf2),
    RGBColor(0xc3, 0xe3, 0xf5),
    RGBColor(0xfc, 0xe3, 0xa6),
    RGBColor(0xf9, 0xb9, 0x8f),
    RGBColor(0xcb, 0xe8, 0xc4),
    RGBColor(0xd8, 0xc9, 0xb8),
    RGBColor(0xa8, 0xdc, 0xb4),
    RGBColor(0xf2, 0x9b, 0x9b),
    RGBColor(0xbc, 0xc1, 0xca),
];

/// Pale fills for how a run ended: well, with slip, not at all.
pub(crate) const OUTCOMES: [RGBColor; 3] =
    [RGBColor(0xb9, 0xe3, 0xc3), RGBColor(0xfc, 0xe3, 0xa6), RGBColor(0xf4, 0xb8, 0xb8)];

/// Pale fills for the contact stages, from number 1.
pub const STAGES: [RGBColor; 6] = [
    RGBColor(0xe5, 0xe7, 0xeb),
    RGBColor(0xdd, 0xd0, 0xf2),
    RGBColor(0xfb, 0xd5, 0xb5),
    RGBColor(0xe8, 0xb8, 0x7a),
    RGBColor(0xfc, 0xe3, 0xa6),
    RGBColor(0xc3, 0xe3, 0xf5),
];

/// Pale fills for the sleeve levels, repeated.
pub(crate) const LEVELS: [RGBColor; 2] = [RGBColor(0xe9, 0xec, 0xf1), RGBColor(0xd6, 0xdc, 0xe5)];
