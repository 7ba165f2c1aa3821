//! Requests of the tick to the model task, and its answers.

use super::approach::Approach;
use super::history::History;
use crate::fault::{Limit, worded};
use crate::units::{Direction, Millimetres, MillimetresPerSecond, Newtons, Ratio, Seconds, q16};

/// One sigma of the logarithm of the stiffness of a tread as known: stiffness 4 %, stiffening 3 %
/// and relaxation time 5 % off.
pub(super) const KNOWN_DEVIATION: Ratio = q16(50_000);

/// Ticks from a request until its answer counts: longer than a plan takes on the board, and the same
/// on any core, so that a run is the same.
pub const PLAN_TICKS: u32 = 120;

/// How preload and speed are chosen. The product is [`Strategy::Scheduled`]; the others are for
/// comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Strategy {
    /// Preload raised ahead of each step as far as the speed needs.
    #[default]
    Scheduled,
    /// Cruise preload throughout.
    Constant,
    /// The preload limit throughout.
    Limit,
    /// Preload raised when the step is detected.
    Reactive,
}

worded! {
    /// What keeps the crossing of a step from being faster.
    #[derive(Default)]
    #[serde(rename_all = "kebab-case")]
    LimitedBy, words:
    /// The preload is as high as it may be.
    #[default]
    Preload "preload";
    /// The pre-tightener's slew: more preload would take longer to build than it saves.
    Slew "slew";
    /// The slip margin: the gap is made smaller than the wanted one.
    Friction "friction";
    /// The band of a mode below the speed that gap and margin allow.
    Resonance "resonance";
    /// The least crossing speed: gap or margin would ask for less.
    LeastSpeed "least speed";
    /// The drive's cruise speed, or that at which the pre-tightener still follows the spring.
    Drive "drive";
}

/// A closed crossing, for the model to compare with its prediction.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Review {
    /// Direction of the crossing.
    pub direction: Direction,
    /// How the wheel came to lift-off, and its distance to the face then, mm.
    pub history: History,
    /// See `history`.
    pub distance: Millimetres,
    /// Wheel speed then, mm/s.
    pub held: MillimetresPerSecond,
    /// Distance to the face at which the corner was felt, mm, if it was.
    pub felt_at: Option<Millimetres>,
    /// Tangent of the arm angle at lift-off.
    pub tan_arm: Ratio,
    /// Measured gap of a step of nominal height, mm: how high this one is shows the sleeve, not
    /// the tread.
    pub gap_as_table: Millimetres,
    /// Measured gap at the step as it is, mm.
    pub gap: Millimetres,
    /// Whether the gap may correct the stiffness: not after an odd crossing.
    pub trusted: bool,
    /// The wheel slipped on the corner.
    pub slipped: bool,
}

/// What the runs so far have shown of tread, load and friction.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Learned {
    /// Estimated over nominal stiffness of the tread.
    pub scale: Ratio,
    /// One sigma of its logarithm.
    pub deviation: Ratio,
    /// The tread has shown before the first crossing that it is not as known.
    pub unknown: bool,
    /// By how much later than by the rig's geometry a corner is felt, deploy and retract, mm.
    pub felt_late: [Millimetres; 2],
    /// Axial load on this wheel beyond that of the rig, N; 0 until the drive has shown another.
    pub extra_load: Newtons,
    /// Largest utilisation of friction, by the model, that has gripped: a lower bound of the
    /// friction.
    pub grips: Ratio,
    /// Least that has slipped: an upper bound.
    pub slips: Ratio,
}

impl Default for Learned {
    /// Of a rig that has not run.
    fn default() -> Self {
        Self {
            scale: Ratio::ONE,
            deviation: KNOWN_DEVIATION,
            unknown: false,
            felt_late: [Millimetres::ZERO; 2],
            extra_load: Newtons::ZERO,
            grips: Ratio::ZERO,
            slips: Ratio::MAX,
        }
    }
}

/// Request for the schedule of the step ahead, and first for the review of the step behind.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PlanRequest {
    /// Numbers the requests, so that a late answer is recognised.
    pub sequence: u32,
    /// Direction of the run.
    pub direction: Direction,
    /// Step ahead, from 1 at the outermost sleeve; 0 when none is left.
    pub step: u8,
    /// Tread, load and friction as learned so far.
    pub learned: Learned,
    /// Measured preload, N.
    pub preload: Newtons,
    /// Axial distance along the run to the face of the step, mm.
    pub distance: Millimetres,
    /// Speed along the run, mm/s.
    pub speed: MillimetresPerSecond,
    /// The place is not known: the step may come at once.
    pub searching: bool,
    /// The crossing just closed.
    pub review: Option<Review>,
    /// Radial force under which the wheel slips on the corner, N.
    pub slipped: Option<Newtons>,
}

/// Result of a review.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outcome {
    /// Gap that the model gives for the reviewed speed and preload, mm.
    pub gap_predicted: Millimetres,
    /// Friction left unused at that point.
    pub slip_margin: Ratio,
    /// What is learned with this crossing.
    pub learned: Learned,
    /// Whether the correction reached the end of its range.
    pub bounded: bool,
    /// Whether the measured gap implies a stiffness far from the estimated one.
    pub strange: bool,
    /// Whether the measured gap is wider than the reference by more than 3 %.
    pub wide: bool,
}

/// Speed and preload up to the next step and over it.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Plan {
    /// Sequence of the request answered.
    pub sequence: u32,
    /// Its step; 0 when none is left.
    pub step: u8,
    /// Direction of the run.
    pub direction: Direction,
    /// Speed between the steps, mm/s.
    pub cruise_speed: MillimetresPerSecond,
    /// Speed at the step as the tread remembers it, mm/s.
    pub cross_speed: MillimetresPerSecond,
    /// Preload between the steps, N.
    pub cruise_preload: Newtons,
    /// Preload at the step, N.
    pub cross_preload: Newtons,
    /// Preload at which the rise for the step ends, N: beyond that at the step where the wheel
    /// lifts off while it still rises.
    pub ramp_preload: Newtons,
    /// Highest preload that the strategy allows, N: for a wheel that slips.
    pub most_preload: Newtons,
    /// Preload from which the wheel may roll, N.
    pub rolling_preload: Newtons,
    /// Gap that this gives, mm.
    pub gap: Millimetres,
    /// Friction left unused at the step, by what is learned of it.
    pub slip_margin: Ratio,
    /// Least utilisation of friction that has slipped, with the slip of the request.
    pub slips: Ratio,
    /// Even the choice that needs least of the friction has slipped.
    pub short: bool,
    /// Braking distance from cruise to the slowest speed, mm.
    pub brake_distance: Millimetres,
    /// Time that this braking takes, s.
    pub brake_time: Seconds,
    /// How the wheel comes to the step.
    pub approach: Approach,
    /// Distance before a step or the end within which braking can be due, mm.
    pub brake_horizon: Millimetres,
    /// Whether the preload is raised ahead of the step.
    pub look_ahead: bool,
    /// What keeps the crossing from being faster.
    pub limited_by: LimitedBy,
    /// Limits met, in the order found.
    pub limits: [Option<Limit>; 3],
    /// Review of the step behind.
    pub outcome: Option<Outcome>,
}
