//! Log entries.

use crate::estimate::{ContactStage, Slip};
use crate::fault::{Fault, Limit};
use crate::model::LimitedBy;
use crate::restart::Restart;
use crate::supervise::{Command, Mode, ServiceDuties};
use crate::units::{Direction, Millimetres, MillimetresPerSecond, Newtons, Ratio, Seconds, Tick};

/// One line of the log.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Entry {
    /// Time.
    pub at: Tick,
    /// Event.
    pub event: Event,
}

/// Event of a log entry.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Event {
    /// The mode changed to this.
    Mode(Mode),
    /// The contact stage changed to this.
    Stage(ContactStage),
    /// A command was accepted.
    Command(Command),
    /// A command that the present mode does not take was refused.
    Refused(Command),
    /// A fault was latched.
    Fault(Fault),
    /// A limit became active.
    Limit(Limit),
    /// A crossing was reviewed.
    Crossing(CrossingRecord),
    /// Number of log entries dropped here because the journal did not keep up.
    Lost(u32),
    /// The board has started; its report of the run before.
    Restart(Restart),
    /// The host asked for these duties, other than before, in the service mode or for it.
    Service(ServiceDuties),
    /// A slip of the wheel on a corner has come to its end.
    Slip(Slip),
}

/// Crossing as the controller observed it.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CrossingRecord {
    /// Step number, 1 at the outermost sleeve; 0 for a step that the table lacks.
    pub index: u8,
    /// Direction of the crossing.
    pub direction: Direction,
    /// Where the step was found, mm of travel.
    pub position: Millimetres,
    /// Found position minus table, mm; 0 for a step that the table lacks.
    pub residual: Millimetres,
    /// Speed as the lower wall stops (retract: begins) to carry, mm/s.
    pub speed: MillimetresPerSecond,
    /// Measured preload at that instant, N.
    pub preload: Newtons,
    /// Largest measured preload of the crossing, N.
    pub peak_preload: Newtons,
    /// Largest tread compression of the crossing, mm.
    pub compression: Millimetres,
    /// Gap of the tread rolled out along the course that was measured, mm.
    pub gap_predicted: Millimetres,
    /// Gap measured from compression and arm angle, mm.
    pub gap_measured: Millimetres,
    /// Height of the step as measured, mm; that of the table if the wall behind it was not.
    pub height: Millimetres,
    /// Slip measured on the corner, mm; 0 if it is within one sigma of none.
    pub slip: Millimetres,
    /// One sigma of a slip that is named, mm; 0 of none: a smaller one is not excluded.
    pub slip_sigma: Millimetres,
    /// Time for which the wanted preload was reached before the corner touched, s; negative when
    /// it was late.
    pub lead_time: Seconds,
    /// Friction that the crossing leaves unused by the model, absolute.
    pub slip_margin: Ratio,
    /// Stiffness scale after this crossing's correction.
    pub stiffness_scale: Ratio,
    /// What kept it from being faster, by its plan; none for a step that the table lacks.
    pub limited_by: Option<LimitedBy>,
}
