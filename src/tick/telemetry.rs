//! The controller's state as one row a tick.

use crate::estimate::ContactStage;
use crate::supervise::Mode;
use crate::units::{Duty, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Tick};

/// All control-rate quantities of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Telemetry {
    /// Tick of the row.
    pub at: Tick,
    /// Mode after the tick.
    pub mode: Mode,
    /// Contact stage.
    pub stage: ContactStage,
    /// Estimated axial position, mm.
    pub position: Millimetres,
    /// Estimated speed, mm/s.
    pub speed: MillimetresPerSecond,
    /// Speed asked for by the profile, mm/s.
    pub speed_ref: MillimetresPerSecond,
    /// Measured preload, N.
    pub preload: Newtons,
    /// Preload asked for, N.
    pub preload_ref: Newtons,
    /// Measured tread compression, mm.
    pub compression: Millimetres,
    /// Wheel centre's distance from the pillar axis, from the arm angle, mm.
    pub radius: Millimetres,
    /// Sleeve level: 0 at the outermost wall, one more per step.
    pub level: u8,
    /// Gap predicted for the step ahead, mm.
    pub gap_predicted: Millimetres,
    /// Friction left unused, by the model for the present contact.
    pub slip_margin: Ratio,
    /// Amplitude of the arm's mode: its largest since the approach to the latest step
    /// began, mm.
    pub vibration: Millimetres,
    /// Distance to the next corner touch, mm; 32767 when none is expected.
    pub distance: Millimetres,
    /// Drive duty.
    pub drive: Duty,
    /// Pre-tightener duty.
    pub pretightener: Duty,
}

impl Telemetry {
    /// The state before the first tick.
    pub const EMPTY: Self = Self {
        at: 0,
        mode: Mode::Boot,
        stage: ContactStage::Initial,
        position: Q16::ZERO,
        speed: Q16::ZERO,
        speed_ref: Q16::ZERO,
        preload: Q16::ZERO,
        preload_ref: Q16::ZERO,
        compression: Q16::ZERO,
        radius: Q16::ZERO,
        level: 0,
        gap_predicted: Q16::ZERO,
        slip_margin: Q16::ZERO,
        vibration: Q16::ZERO,
        distance: Q16::ZERO,
        drive: Duty::ZERO,
        pretightener: Duty::ZERO,
    };
}
