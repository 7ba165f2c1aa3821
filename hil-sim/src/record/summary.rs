//! The summary of a run and its parts; a line of the controller's ledger with names and units.

use interstage::log::ledger::Line;
use interstage::model::LimitedBy;
use interstage::units::{Direction, Q16};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

use super::{Row, TimeLost};

/// A row of the page's table of crossings: the plant's truth beside what the controller reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CrossingLine {
    /// Step number, from 1.
    pub index: u8,
    /// True speed when the lower wall stopped (retract: began) to carry, mm/s.
    pub speed_mm_s: f64,
    /// True preload at that instant, N.
    pub preload_n: f64,
    /// True gap: clearance between step root and undeformed wheel at that instant, mm.
    pub gap_mm: f64,
    /// The controller's, mm; none if it reported none: of the tread rolled out, and measured.
    pub gap_predicted_mm: Option<f64>,
    pub gap_measured_mm: Option<f64>,
    /// Largest force of corner and face on the wheel, N.
    pub corner_force_n: f64,
    /// How long before the controller detected the corner the preload was reached, s; negative by
    /// how long it was missing, until lift-off at most.
    pub lead_time_s: Option<f64>,
    /// Gross slip during the crossing, mm.
    pub slip_mm: f64,
    /// Slip on the corner that the controller measured, mm.
    #[serde(default)]
    pub slip_measured_mm: Option<f64>,
    /// One sigma of it, mm.
    #[serde(default)]
    pub slip_sigma_mm: Option<f64>,
    /// Height of the step that the controller measured, mm.
    #[serde(default)]
    pub height_measured_mm: Option<f64>,
    /// True time of the corner's first touch, s.
    pub touch_s: f64,
    /// True time of lift-off (touch-down on retract), s.
    pub lift_s: f64,
    /// True position of the step, mm.
    pub step_mm: f64,
    /// Position of the step that the controller found, mm.
    pub step_found_mm: Option<f64>,
    /// Largest true preload during the crossing, N.
    pub peak_preload_n: f64,
    /// Largest friction utilisation during the crossing.
    pub peak_utilisation: f64,
    /// What kept it from being faster, by the controller's plan.
    #[serde(default)]
    pub limited_by: Option<LimitedBy>,
}

/// A fault or limit that the controller reported.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// When, s since boot.
    pub t_s: f64,
    /// Stable code.
    pub code: u16,
    pub text: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogLine {
    /// When, s since boot.
    pub t_s: f64,
    pub text: String,
}

/// The summary of a run; `rig deploy --json` prints it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Whether the drive reached the end of travel with every step crossed.
    pub completed: bool,
    /// `sil`, `board` or `probe`.
    pub target: String,
    /// `scheduled`, `constant`, `limit` or `reactive`.
    pub controller: String,
    /// `deploy` or `retract`.
    pub direction: String,
    pub rig: String,
    /// Seed of the plant's draw.
    pub seed: u64,
    /// Version of this program.
    #[serde(default)]
    pub version: String,
    /// Keys of the scenario whose value is not the preset's, apart from those that have a field
    /// of their own here.
    #[serde(default)]
    pub overrides: Map<String, Value>,
    /// The plant of the seed: the value of each key that is drawn.
    #[serde(default)]
    pub drawn: Map<String, Value>,
    /// Whether the figures are the controller's measurements, as in a log without the plant's
    /// truth.
    #[serde(default)]
    pub measured: bool,
    /// What is missing of the log that this was read from, in sentences.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// What restarted the controller and so ended the recording, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restart: Option<String>,
    /// When the command was accepted that the motion follows from, s since boot.
    #[serde(default)]
    pub commanded_s: Option<f64>,
    /// From the accepted command to arrival, or to the end of the motion of a run that did not
    /// arrive, s; none if the log has no such command or nothing moved.
    pub duration_s: Option<f64>,
    /// From the start of motion to its end, s: the duration without the preload that is built
    /// before the wheel moves. A wait before a corner counts.
    pub moving_s: f64,
    /// Where the duration goes beside travel at cruise speed.
    #[serde(default)]
    pub lost: Option<TimeLost>,
    /// From boot to the end of the run, s.
    pub total_s: f64,
    /// Longest time that it was given, s, if that cut it off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_off_s: Option<f64>,
    pub travel_mm: f64,
    /// One sigma of the position at the end by the controller, mm; none if nothing bears it out.
    #[serde(default)]
    pub position_sigma_mm: Option<f64>,
    /// Reference gap of the schedule, mm.
    pub gap_ref_mm: f64,
    /// Largest gap at a step, or separation elsewhere, mm; none (`NaN`) without a crossing.
    #[serde(default = "nan", deserialize_with = "or_nan")]
    pub max_gap_mm: f64,
    /// Gross slip, mm; of a measured run the tread's travel beyond the axial travel up to the
    /// last step found, creep included.
    #[serde(default = "nan", deserialize_with = "or_nan")]
    pub slip_mm: f64,
    /// Mean true preload while moving, N.
    pub mean_preload_n: f64,
    /// Mechanical energy of the drive, J.
    pub energy_j: f64,
    /// Friction work of creep and slip at the tread, J: what wears it.
    #[serde(alias = "wear_j")]
    pub friction_work_j: f64,
    /// Latched faults.
    pub faults: Vec<Report>,
    /// Active limits reported.
    pub limits: Vec<Report>,
    /// Faults that the scenario injected.
    #[serde(default)]
    pub injected: Vec<String>,
    /// Simulated over wall-clock time.
    pub real_time_factor: f64,
    /// SHA-256 over the controller's trace.
    pub trace_digest: String,
    pub crossings: Vec<CrossingLine>,
}

/// A complete run.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    pub summary: Summary,
    pub rows: Vec<Row>,
    pub log: Vec<LogLine>,
    /// Parameters used, as TOML.
    pub parameters: String,
    /// The binary log as it was on its channel; empty if it was not kept.
    pub stream: Vec<u8>,
}

impl Recording {
    /// The recording with its times counted from the command, if the log has it.
    pub(crate) fn since_command(&self) -> Self {
        let mut from = self.clone();
        let zero_s = self.summary.commanded_s.unwrap_or(0.0);
        let Summary { faults, limits, crossings, .. } = &mut from.summary;
        let reports = faults.iter_mut().chain(limits).map(|report| &mut report.t_s);
        let lines = crossings.iter_mut().flat_map(|line| [&mut line.touch_s, &mut line.lift_s]);
        let log = from.log.iter_mut().map(|line| &mut line.t_s);
        let rows = from.rows.iter_mut().map(|row| &mut row.controller.t_s);
        reports.chain(lines).chain(log).chain(rows).for_each(|t_s| *t_s -= zero_s);
        from
    }
}

pub(super) fn nan() -> f64 {
    f64::NAN
}

/// A number, or `NaN` where JSON has null.
pub(crate) fn or_nan<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

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
    /// Where the step was found, mm of travel.
    pub step_found_mm: f64,
    /// Found position minus table, mm.
    pub residual_mm: f64,
    /// Speed at lift-off (touch-down on retract), mm/s.
    pub speed_mm_s: f64,
    /// Largest speed deficit on the corner, mm/s.
    pub speed_dip_mm_s: f64,
    /// Measured preload at that instant, N.
    pub preload_n: f64,
    pub peak_preload_n: f64,
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
    #[serde(default)]
    pub slip_measured_mm: Option<f64>,
    /// One sigma of it, mm.
    #[serde(default)]
    pub slip_sigma_mm: Option<f64>,
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
            slip_sigma_mm: Some(num(crossing.slip_sigma)),
            height_measured_mm: Some(num(crossing.height)),
            stiffness_scale: num(crossing.stiffness_scale),
            trend: num(line.trend),
            limited_by: crossing.limited_by,
        }
    }
}
