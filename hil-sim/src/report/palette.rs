//! One colour for a quantity, one look for a role, in every plot: truth is dark, references are
//! dashed, measurements and estimates have the quantity's colour.

/// A colour as SVG and HTML write it.
pub(crate) type Colour = &'static str;

pub(crate) const TRUTH: Colour = "#1f2937";
/// References; drawn dashed.
pub(crate) const WANTED: Colour = "#6b7280";
/// Limits; drawn dashed.
pub(crate) const LIMIT: Colour = "#b91c1c";

/// First touch of a corner; drawn dashed.
pub(crate) const TOUCH: Colour = "#b45309";
/// Face of a step.
pub(crate) const FACE: Colour = "#64748b";

/// A limit that was reported.
pub(crate) const WARNING: Colour = "#a16207";

/// Simulated by the reference models; drawn dashed.
pub const SIMULATED: Colour = "#1c6fd6";

pub(crate) const SPEED: Colour = "#1d7fe0";
pub const PRELOAD: Colour = "#e07b12";
pub const GAP: Colour = "#d02f6b";
pub(crate) const RADIUS: Colour = "#0f9797";
pub(crate) const SLIP: Colour = "#35a14a";
/// Compression of the tread.
pub(crate) const COMPRESSION: Colour = "#805ad5";
/// Force on the lower wall.
pub(crate) const FLOOR: Colour = "#3d8eb9";

pub(crate) const TEXT: Colour = "#374151";
/// Axes.
pub(crate) const AXIS: Colour = "#9ca3af";
/// Lines of the grid.
pub(crate) const GRID: Colour = "#e9ebef";
/// Shaded stretches.
pub(crate) const SHADE: Colour = "#faf1df";

/// Pale fills for the modes, by mode number.
pub(crate) const MODES: [Colour; 13] = [
    "#e5e7eb", "#d1d5db", "#c7d2e8", "#eef0f3", "#ddd0f2", "#c3e3f5", "#fce3a6", "#f9b98f",
    "#cbe8c4", "#d8c9b8", "#a8dcb4", "#f29b9b", "#bcc1ca",
];

/// Pale fills for the contact stages; the first is for none.
pub(crate) const STAGES: [Colour; 7] =
    ["#e5e7eb", "#e5e7eb", "#ddd0f2", "#fbd5b5", "#e8b87a", "#fce3a6", "#c3e3f5"];

/// Pale fills for the sleeve levels, repeated.
pub(crate) const LEVELS: [Colour; 2] = ["#e9ecf1", "#d6dce5"];

/// Pale fills for how a run ended: well, with slip, not at all.
pub(crate) const OUTCOMES: [Colour; 3] = ["#b9e3c3", "#fce3a6", "#f4b8b8"];

/// Shaded range of many runs.
pub const RANGE: Colour = "#fbe9d2";

/// Colours of several of one kind, in their order.
pub(crate) const SERIES: [Colour; 7] = [TRUTH, SPEED, PRELOAD, RADIUS, GAP, COMPRESSION, SLIP];
