//! Watches the tick's quantities for faults.

#![deny(clippy::float_arithmetic)]

use super::{Direction, Fault, Mode};
use crate::numeric::checked;
use crate::rig::{Rig, RigError};
use crate::sense::{Reason, SensedState, Validity};
use crate::units::{MillimetresPerSecond, Newtons, Ratio, q16};

/// Preload above the limit that counts as overpressure, relative: regulation and
/// the spring that a climb compresses stay below it.
const OVERPRESSURE_PART: f64 = 0.10;
/// Ticks that overpressure must last: noise does not.
const OVERPRESSURE_TICKS: u16 = 10;
/// Ticks without motion under a moving reference: longer than the wheel takes to start.
const STALL_TICKS: u16 = 150;
/// Ticks of motion beyond the reference or against it.
const RUNAWAY_TICKS: u16 = 30;
/// Ticks that a preload may be short of what the actuator should have reached: dead time
/// and lag are in that already, so these are for their tolerance.
const PRELOAD_TICKS: u16 = 400;

/// One half.
const HALF: Ratio = q16(500_000);

/// Bounds of a rig.
#[derive(Clone, Debug)]
pub struct Monitor {
    overpressure: Newtons,
    /// Speed below which the wheel counts as standing, mm/s.
    standing: MillimetresPerSecond,
    /// Speed that the wheel may have against its way, or beyond one and a half times its
    /// reference, mm/s: what the speed observer swings when the load jumps.
    beyond: MillimetresPerSecond,
    /// Preload error that counts as short, N.
    short: Newtons,
}

/// How long each condition has lasted, ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MonitorState {
    overpressure: u16,
    stall: u16,
    runaway: u16,
    short: u16,
}

/// What is looked at beside the sensors.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// Mode before the tick.
    pub mode: Mode,
    /// Sensors.
    pub sensed: &'a SensedState,
    /// Speed reference, signed, mm/s.
    pub speed_ref: MillimetresPerSecond,
    /// Preload that the actuator should have reached by now, N.
    pub preload_due: Newtons,
    /// The tick came more than a period late.
    pub overrun: bool,
    /// The emergency stop has cut the bridges.
    pub emergency_stop: bool,
}

impl Monitor {
    /// Bounds of a rig.
    ///
    /// # Errors
    /// [`RigError`] if a parameter is out of range.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Ok(Self {
            overpressure: checked(
                "preload.limit_n",
                rig.preload.limit_n * (1.0 + OVERPRESSURE_PART),
            )?,
            standing: q16(200_000),
            beyond: q16(5_000_000),
            short: checked("preload.cruise_n", 0.1 * rig.preload.cruise_n)?,
        })
    }

    /// Whether the wheel turns against its reference or far beyond it.
    fn runs_away(
        &self,
        mode: Mode,
        speed: MillimetresPerSecond,
        wanted: MillimetresPerSecond,
    ) -> bool {
        let way = match mode {
            Mode::Run(way, _) | Mode::Stopping(way) => way,
            _ => return speed.abs() > self.beyond,
        };
        let (along, asked) = match way {
            Direction::Deploy => (speed, wanted),
            Direction::Retract => (-speed, -wanted),
        };
        along < -self.beyond || along > asked + asked * HALF + self.beyond
    }

    /// The fault of this tick, if any; the gravest first.
    pub fn step(&self, state: &mut MonitorState, seen: &Observed<'_>) -> Option<Fault> {
        if matches!(seen.mode, Mode::Boot | Mode::FaultHold(_)) {
            *state = MonitorState::default();
            return None;
        }
        let preload = seen.sensed.preload.value;
        let speed = seen.sensed.speed.value;
        let acting = driven(seen.mode) || matches!(seen.mode, Mode::Preload(_));
        // With the bridges off nothing here could relieve it; while it falls as it should,
        // it is being relieved.
        let pressed = preload > self.overpressure
            && (driven(seen.mode) || acting && preload - seen.preload_due > self.short);
        lasting(&mut state.overpressure, pressed);
        lasting(&mut state.short, acting && seen.preload_due - preload > self.short);
        let asked = seen.speed_ref.abs() > self.standing + self.standing;
        let stands = speed.abs() < self.standing;
        lasting(&mut state.stall, driven(seen.mode) && asked && stands);
        lasting(&mut state.runaway, self.runs_away(seen.mode, speed, seen.speed_ref));
        let lost = sensor_fault(seen.sensed);
        if seen.emergency_stop {
            Some(Fault::EmergencyStop)
        } else if seen.overrun {
            Some(Fault::TickOverrun)
        } else if state.overpressure >= OVERPRESSURE_TICKS {
            Some(Fault::Overpressure)
        } else if lost.is_some() {
            lost
        } else if state.runaway >= RUNAWAY_TICKS {
            Some(Fault::DriveRunaway)
        } else if state.stall >= STALL_TICKS {
            Some(Fault::DriveStalled)
        } else if state.short >= PRELOAD_TICKS {
            Some(Fault::PreloadNotReached)
        } else {
            None
        }
    }
}

/// Whether the drive's bridge is on.
fn driven(mode: Mode) -> bool {
    mode.moves()
}

/// Counts ticks while a condition lasts.
fn lasting(count: &mut u16, condition: bool) {
    *count = if condition { count.saturating_add(1) } else { 0 };
}

/// The fault of a sensor that cannot be used any more.
fn sensor_fault(sensed: &SensedState) -> Option<Fault> {
    let judge = |validity: Validity, stale: Fault, range: Fault| match validity {
        Validity::Valid | Validity::Held(_) => None,
        Validity::Absent | Validity::Stale => Some(stale),
        Validity::Invalid(Reason::OutOfRange) => Some(range),
        Validity::Invalid(_) => Some(stale),
    };
    judge(sensed.speed.validity, Fault::SpeedStale, Fault::SpeedStale)
        .or(judge(sensed.preload.validity, Fault::PressureStale, Fault::PressureRange))
        .or(judge(sensed.compression.validity, Fault::DisplacementStale, Fault::DisplacementRange))
        .or(judge(sensed.radius.validity, Fault::AngleStale, Fault::AngleRange))
}
