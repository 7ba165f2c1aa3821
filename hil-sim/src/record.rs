//! What a run leaves behind: one row a tick, one ledger line a crossing, and the
//! summary. Sensed, estimated and true values stand side by side.

pub mod tally;

use interstage::supervise::{Leg, Mode};
use serde::{Deserialize, Serialize};

/// One millisecond of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default = "Row::unknown")]
pub struct Row {
    /// Time since boot, s.
    pub t_s: f64,
    /// Mode number, see [`MODE_NAMES`].
    pub mode: u8,
    /// Contact stage, 1 to 6.
    pub stage: u8,
    /// Sleeve level by the controller.
    pub level: u8,
    /// True axial position of the wheel centre, mm.
    pub position_true_mm: f64,
    /// The same by the controller's odometry, mm.
    pub position_est_mm: f64,
    /// True axial speed, mm/s.
    pub speed_true_mm_s: f64,
    /// Estimated speed, mm/s.
    pub speed_est_mm_s: f64,
    /// Speed asked for, mm/s.
    pub speed_ref_mm_s: f64,
    /// True radial preload, N.
    pub preload_true_n: f64,
    /// Measured radial preload, N.
    pub preload_meas_n: f64,
    /// Preload asked for, N.
    pub preload_ref_n: f64,
    /// True distance of the wheel centre from the pillar axis, mm.
    pub radius_true_mm: f64,
    /// The same from the arm angle, mm.
    pub radius_est_mm: f64,
    /// True largest tread compression, mm.
    pub compression_true_mm: f64,
    /// Measured tread compression, mm.
    pub compression_meas_mm: f64,
    /// Clearance between the root of the nearest step and the undeformed wheel
    /// circle, mm; NaN away from a step.
    pub root_clearance_mm: f64,
    /// Gap that the controller predicts for the step ahead, mm.
    pub gap_predicted_mm: f64,
    /// Force of the step's corner and face on the wheel, N.
    pub corner_force_n: f64,
    /// Force of the lower wall on the wheel, N.
    pub floor_force_n: f64,
    /// Friction utilisation, traction over normal force.
    pub utilisation: f64,
    /// Friction left unused by the plant: mu minus utilisation.
    pub slip_margin_true: f64,
    /// The same by the controller's model.
    pub slip_margin_est: f64,
    /// Gross slip so far, mm.
    pub slip_mm: f64,
    /// Deflection of the arm by its modes, um.
    pub vibration_um: f64,
    /// Drive duty, -1 to 1.
    pub drive_duty: f64,
    /// Pre-tightener duty, -1 to 1.
    pub preload_duty: f64,
}

impl Row {
    /// A row of which nothing is known.
    #[must_use]
    pub const fn unknown() -> Self {
        let unknown = f64::NAN;
        Self {
            t_s: unknown,
            mode: 12,
            stage: 1,
            level: 0,
            position_true_mm: unknown,
            position_est_mm: unknown,
            speed_true_mm_s: unknown,
            speed_est_mm_s: unknown,
            speed_ref_mm_s: unknown,
            preload_true_n: unknown,
            preload_meas_n: unknown,
            preload_ref_n: unknown,
            radius_true_mm: unknown,
            radius_est_mm: unknown,
            compression_true_mm: unknown,
            compression_meas_mm: unknown,
            root_clearance_mm: unknown,
            gap_predicted_mm: unknown,
            corner_force_n: unknown,
            floor_force_n: unknown,
            utilisation: unknown,
            slip_margin_true: unknown,
            slip_margin_est: unknown,
            slip_mm: unknown,
            vibration_um: unknown,
            drive_duty: unknown,
            preload_duty: unknown,
        }
    }
}

/// Names of the mode numbers in [`Row::mode`].
pub const MODE_NAMES: [&str; 13] = [
    "boot",
    "self-test",
    "zero",
    "idle",
    "preload",
    "cruise",
    "approach",
    "crossing",
    "settle",
    "stopping",
    "complete",
    "fault hold",
    "off",
];

/// Index into [`MODE_NAMES`].
#[must_use]
pub fn mode_number(mode: Mode) -> u8 {
    match mode {
        Mode::Boot => 0,
        Mode::SelfTest => 1,
        Mode::Zero => 2,
        Mode::Idle => 3,
        Mode::Preload(_) => 4,
        Mode::Run(_, Leg::Cruise) => 5,
        Mode::Run(_, Leg::Approach) => 6,
        Mode::Run(_, Leg::Crossing) => 7,
        Mode::Run(_, Leg::Settle) => 8,
        Mode::Stopping(_) => 9,
        Mode::Complete(_) => 10,
        Mode::FaultHold(_) => 11,
    }
}

/// Names of the contact stages, from number 1.
pub const STAGE_NAMES: [&str; 6] =
    ["initial", "preloaded", "static friction", "sliding", "rolling", "continuous"];

/// Ledger line of one crossing: the plant's truth beside the controller's view.
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
    /// Gap that the controller predicted, mm.
    pub gap_predicted_mm: Option<f64>,
    /// Gap that the controller measured, mm.
    pub gap_measured_mm: Option<f64>,
    /// Largest force of corner and face on the wheel, N.
    pub corner_force_n: f64,
    /// How long the wanted preload stood before the corner touched, s.
    pub lead_time_s: Option<f64>,
    /// Gross slip during the crossing, mm.
    pub slip_mm: f64,
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
}

/// A fault or limit that the controller reported.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// When, s since boot.
    pub t_s: f64,
    /// Stable code.
    pub code: u16,
    /// Sentence.
    pub text: String,
}

/// One line of the log as text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogLine {
    /// When, s since boot.
    pub t_s: f64,
    /// What.
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
    /// Rig preset.
    pub rig: String,
    /// Seed of the plant's draw.
    pub seed: u64,
    /// From the start of motion to the end of travel, s.
    pub duration_s: f64,
    /// From boot to the end of the run, s.
    pub total_s: f64,
    /// Distance travelled, mm.
    pub travel_mm: f64,
    /// Reference gap of the schedule, mm.
    pub gap_ref_mm: f64,
    /// Largest gap at a step, or separation elsewhere, mm.
    pub max_gap_mm: f64,
    /// Gross slip, mm.
    pub slip_mm: f64,
    /// Mean true preload while moving, N.
    pub mean_preload_n: f64,
    /// Mechanical energy of the drive, J.
    pub energy_j: f64,
    /// Tread wear: friction work of creep and slip, J.
    pub wear_j: f64,
    /// Latched faults.
    pub faults: Vec<Report>,
    /// Active limits reported.
    pub limits: Vec<Report>,
    /// Faults that the scenario brought about.
    #[serde(default)]
    pub injected: Vec<String>,
    /// Simulated over wall-clock time.
    pub real_time_factor: f64,
    /// SHA-256 over the controller's trace.
    pub trace_digest: String,
    /// Ledger.
    pub crossings: Vec<CrossingLine>,
}

/// A whole run.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Summary and ledger.
    pub summary: Summary,
    /// One row a tick.
    pub rows: Vec<Row>,
    /// Log lines.
    pub log: Vec<LogLine>,
    /// Parameters used, as TOML.
    pub parameters: String,
    /// The binary log as it lay on its channel; empty if it was not kept.
    pub stream: Vec<u8>,
}
