//! The columns of the crossings' ledger, for page, terminal and comparison.

use interstage::model::LimitedBy;

use crate::record::CrossingLine;
use crate::table::signed;

/// The true value that a column is compared with, and the error as text.
type Truth = (fn(&CrossingLine) -> f64, fn(f64, f64) -> String);

pub(crate) struct Column {
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) decimals: usize,
    pub(crate) of: fn(&CrossingLine) -> Option<f64>,
    /// The true value of a prediction or measurement, and the error as text.
    pub(crate) truth: Option<Truth>,
    /// Shown on a terminal without -v: it has no room for all.
    pub(crate) on_terminal: bool,
}

/// All of them, after the step's number.
pub(crate) const COLUMNS: [Column; 13] = {
    const fn new(
        name: &'static str,
        unit: &'static str,
        decimals: usize,
        of: fn(&CrossingLine) -> Option<f64>,
    ) -> Column {
        Column { name, unit, decimals, of, truth: None, on_terminal: true }
    }
    const GAP: Option<Truth> = Some((|c| c.gap_mm, gap_error));
    const STEP: Option<Truth> = Some((|c| c.step_mm, step_error));
    [
        new("gap", "mm", 3, |c| Some(c.gap_mm)),
        Column {
            truth: GAP,
            on_terminal: false,
            ..new("predicted", "mm", 3, |c| c.gap_predicted_mm)
        },
        Column { truth: GAP, ..new("measured", "mm", 3, |c| c.gap_measured_mm) },
        new("speed", "mm/s", 2, |c| Some(c.speed_mm_s)),
        new("preload", "N", 2, |c| Some(c.preload_n)),
        Column { on_terminal: false, ..new("peak preload", "N", 2, |c| Some(c.peak_preload_n)) },
        Column { on_terminal: false, ..new("corner", "N", 1, |c| Some(c.corner_force_n)) },
        Column { on_terminal: false, ..new("friction used", "", 2, |c| Some(c.peak_utilisation)) },
        new("lead", "s", 2, |c| c.lead_time_s),
        Column { on_terminal: false, ..new("slip", "mm", 2, |c| Some(c.slip_mm)) },
        new("step at", "mm", 2, |c| Some(c.step_mm)),
        Column { truth: STEP, on_terminal: false, ..new("found at", "mm", 2, |c| c.step_found_mm) },
        Column {
            on_terminal: false,
            ..new("touch to lift", "s", 3, |c| Some((c.lift_s - c.touch_s).abs()))
        },
    ]
};

/// What kept a crossing from being faster, in words.
pub(crate) fn slowed_by(line: &CrossingLine) -> &'static str {
    match line.limited_by {
        None => "-",
        Some(LimitedBy::Preload) => "preload limit",
        Some(LimitedBy::Slew) => "slow preload",
        Some(LimitedBy::Friction) => "low friction",
        Some(LimitedBy::Resonance) => "resonance",
        Some(LimitedBy::LeastSpeed) => "least speed",
        Some(LimitedBy::Drive) => "drive speed",
    }
}

fn gap_error(error: f64, truth: f64) -> String {
    format!("{} µm, {} %", signed(1e3 * error, 0), signed(100.0 * error / truth, 1))
}

fn step_error(error: f64, _: f64) -> String {
    format!("{} µm", signed(1e3 * error, 0))
}
