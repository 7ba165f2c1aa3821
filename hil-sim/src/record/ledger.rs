//! A line of the crossings' ledger with names and units.

use interstage::log::ledger::Line;
use interstage::model::LimitedBy;
use interstage::units::{Direction, Q16};
use serde::{Deserialize, Serialize};

/// A line of the controller's ledger: estimates, no plant truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LedgerLine {
    /// When it was closed, s since boot.
    pub t_s: f64,
    /// Crossings since boot, this one included.
    pub count: u16,
    /// Step number, from 1; 0 for a step that the table lacks.
    pub index: u8,
    /// Whether the step was climbed; else it was dropped off.
    pub climbed: bool,
    /// Position at which the step was detected, mm.
    pub step_found_mm: f64,
    /// Found position minus table, mm.
    pub residual_mm: f64,
    /// Speed at lift-off (touch-down on retract), mm/s.
    pub speed_mm_s: f64,
    /// Largest speed deficit on the corner, mm/s.
    pub speed_dip_mm_s: f64,
    /// Measured preload at that instant, N.
    pub preload_n: f64,
    /// Largest measured preload, N.
    pub peak_preload_n: f64,
    /// Largest tread compression, mm.
    pub compression_mm: f64,
    /// Gap by the model, mm.
    pub gap_predicted_mm: f64,
    /// Gap measured from compression and arm angle, mm.
    pub gap_measured_mm: f64,
    /// Measured minus predicted, mm.
    pub gap_residual_mm: f64,
    /// How long before the corner touched the preload was reached, s.
    pub lead_time_s: f64,
    /// Friction left unused, by the model.
    pub slip_margin: f64,
    /// Travel of the tread beyond the axial travel since the last step found, mm.
    pub slip_mm: f64,
    /// Slip measured on the corner, mm.
    #[serde(default)]
    pub slip_measured_mm: Option<f64>,
    /// Measured height of the step, mm.
    #[serde(default)]
    pub height_measured_mm: Option<f64>,
    /// Stiffness scale after this crossing.
    pub stiffness_scale: f64,
    /// Its change per crossing, the newest weighing a quarter.
    pub trend: f64,
    /// What kept it from being faster, by its plan.
    #[serde(default)]
    pub limited_by: Option<LimitedBy>,
}

impl From<&Line> for LedgerLine {
    fn from(line: &Line) -> Self {
        let crossing = &line.crossing;
        let num = |value: Q16| value.to_num::<f64>();
        Self {
            t_s: f64::from(line.at) * 1e-3,
            count: line.count,
            index: crossing.index,
            climbed: crossing.direction == Direction::Deploy,
            step_found_mm: num(crossing.position),
            residual_mm: num(crossing.residual),
            speed_mm_s: num(crossing.speed),
            speed_dip_mm_s: num(line.speed_dip),
            preload_n: num(crossing.preload),
            peak_preload_n: num(crossing.peak_preload),
            compression_mm: num(crossing.compression),
            gap_predicted_mm: num(crossing.gap_predicted),
            gap_measured_mm: num(crossing.gap_measured),
            gap_residual_mm: num(line.gap_residual),
            lead_time_s: num(crossing.lead_time),
            slip_margin: num(crossing.slip_margin),
            slip_mm: num(line.slip),
            slip_measured_mm: Some(num(crossing.slip)),
            height_measured_mm: Some(num(crossing.height)),
            stiffness_scale: num(crossing.stiffness_scale),
            trend: num(line.trend),
            limited_by: crossing.limited_by,
        }
    }
}
