//! Watches the tick's quantities for faults.

use super::Mode;
use super::crosscheck::{CrossCheck, CrossState, Noise, lasts};
use super::readback::{Readback, ReadbackState};
use crate::control::preload_loop::answer_s;
use crate::fault::Fault;
use crate::numeric::{LowPass, LowPassState, checked};
use crate::rig::{OVERPRESSURE_PART, Rig, RigError};
use crate::sense::raw::{BridgeCodes, SensorId};
use crate::sense::{Reason, SensedState, Validity};
use crate::units::{
    Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, TICK_HZ, Tick, Travel, q16,
};

/// Ticks that overpressure must last, longer than noise.
pub const OVERPRESSURE_TICKS: u16 = 10;
/// Speed of a wheel whose bridge is off, mm/s: the observer's ringing is less.
const BEYOND: MillimetresPerSecond = q16(5_000_000);
/// Ticks that this must last.
const RUNAWAY_TICKS: u16 = 12;
/// Ticks for which a wheel turns on, by its observer, after a drive of the service mode.
const COAST_TICKS: u16 = 150;

/// Bounds of a rig.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Monitor {
    overpressure: Newtons,
    /// Preload error that counts as short, N.
    short: Newtons,
    /// Ticks that this must last, the time in which the loop corrects it.
    short_ticks: u16,
    /// Rate of the pre-tightener's spring, N/mm, and how long its loop takes to answer.
    spring: Q16,
    answers: LowPass,
    cross: CrossCheck,
    readback: Readback,
}

/// How long each condition has lasted, ticks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MonitorState {
    overpressure: u16,
    runaway: u16,
    short: u16,
    /// Ticks for which the wheel may still turn after a drive of the service mode.
    coasts: u16,
    /// The drive was on in the last tick.
    driving: bool,
    /// Radius of the wheel centre that the preload loop has answered; none while it is off.
    answered: Option<LowPassState>,
    cross: CrossState,
    noise: Noise,
    pub(crate) readback: ReadbackState,
}

/// Inputs of the monitor.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// Tick.
    pub now: Tick,
    /// Mode before the tick.
    pub mode: Mode,
    /// Sensors.
    pub sensed: &'a SensedState,
    /// Travel that the drive is asked for, by the axle.
    pub travel: Travel,
    /// How far the tread is wound up, mm.
    pub wound: Millimetres,
    /// Readback of the bridges since the last tick.
    pub bridges: Option<BridgeCodes>,
    /// Speed reference, signed, mm/s.
    pub speed_ref: MillimetresPerSecond,
    /// Preload that the actuator should have reached by now, N.
    pub preload_due: Newtons,
    /// Duty that the speed loop adds to its feed-forward beyond what a corner explains, if the
    /// reference is steady.
    pub effort: Option<Ratio>,
    /// The tick came more than a period late.
    pub overrun: bool,
    /// The emergency stop has cut the bridges.
    pub emergency_stop: bool,
}

impl Monitor {
    /// Bounds of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let (preload, cross) = (&rig.preload, CrossCheck::try_build(rig)?);
        Ok(Self {
            overpressure: checked("preload.limit_n", preload.limit_n * (1.0 + OVERPRESSURE_PART))?,
            short: cross.short,
            short_ticks: (answer_s(rig) * f64::from(TICK_HZ)) as u16,
            spring: checked("preload.spring_n_per_mm", preload.spring_n_per_mm)?,
            answers: LowPass::build(answer_s(rig)),
            cross,
            readback: Readback::build(rig),
        })
    }

    /// The fault of this tick, if any; the gravest first.
    pub fn step(&self, state: &mut MonitorState, seen: &Observed<'_>) -> Option<Fault> {
        if matches!(seen.mode, Mode::Boot | Mode::FaultHold(_)) {
            *state = MonitorState::default();
            return None;
        }
        let preload = seen.sensed.preload.value;
        let speed = seen.sensed.speed.value;
        let acting = seen.mode.moves() || matches!(seen.mode, Mode::Preload(_));
        // With the bridges off nothing could relieve it; a preload that falls as planned is being
        // relieved.
        let pressed = preload > self.overpressure
            && (seen.mode.moves()
                || seen.mode == Mode::Service
                || acting && preload - seen.preload_due > self.short);
        let overpressure = lasts(&mut state.overpressure, pressed, OVERPRESSURE_TICKS);
        let off = self.off(state, seen, acting);
        let short = lasts(&mut state.short, off < -self.short, self.short_ticks);
        let serving = seen.mode == Mode::Service && state.readback.drives();
        state.coasts = if serving { COAST_TICKS } else { state.coasts.saturating_sub(1) };
        let turns = !seen.mode.moves() && speed.abs() > BEYOND && state.coasts == 0;
        let runaway = lasts(&mut state.runaway, turns, RUNAWAY_TICKS);
        // The self-test ends once the wheel rests.
        let coasts = seen.mode == Mode::SelfTest;
        let bridge = self.readback.step(&mut state.readback, seen.bridges, coasts);
        let crossed = self.check(state, seen, off);
        seen.emergency_stop
            .then_some(Fault::EmergencyStop)
            .or(seen.overrun.then_some(Fault::TickOverrun))
            .or(overpressure.then_some(Fault::Overpressure))
            .or(sensor_fault(seen.sensed, true))
            .or(bridge)
            .or(runaway.then_some(Fault::DriveRunaway))
            .or(crossed)
            .or(short.then_some(Fault::PreloadNotReached))
    }

    /// Preload off what the actuator should have reached, N, beyond what the wheel has moved the
    /// spring by before the loop could answer; none while it is off.
    fn off(&self, state: &mut MonitorState, seen: &Observed<'_>, acting: bool) -> Newtons {
        if !acting {
            state.answered = None;
            return Newtons::ZERO;
        }
        let radius: Millimetres = seen.sensed.radius.value;
        let answered = state.answered.get_or_insert(LowPassState::at(radius));
        let yields = (self.answers.step(answered, radius) - radius) * self.spring;
        let off = seen.sensed.preload.value - seen.preload_due;
        off - off.clamp(yields.min(Q16::ZERO), yields.max(Q16::ZERO))
    }

    /// The sensors against one another, while a bridge is on.
    fn check(&self, state: &mut MonitorState, seen: &Observed<'_>, off: Newtons) -> Option<Fault> {
        let before = core::mem::replace(&mut state.driving, seen.mode.moves());
        if state.driving {
            if !before {
                state.cross.begin(seen);
            }
            self.cross.step(&mut state.cross, &state.noise, seen, off)
        } else if matches!(seen.mode, Mode::Preload(_)) {
            self.cross.preload(&mut state.cross, &state.noise, seen, off)
        } else {
            state.cross = CrossState::default();
            // A motion of the service mode is no noise.
            if seen.mode != Mode::Service {
                state.noise.rest(seen);
            }
            None
        }
    }
}

/// The fault of a sensor that cannot be used; whether one that is out of range has another one than
/// one that is silent.
pub(super) fn sensor_fault(sensed: &SensedState, ranged: bool) -> Option<Fault> {
    let faults: [_; SensorId::COUNT] = [
        (Fault::WheelEncoderStale, Fault::WheelEncoderStale),
        (Fault::PreloadSensorStale, Fault::PreloadSensorRange),
        (Fault::CompressionSensorStale, Fault::CompressionSensorRange),
        (Fault::ArmAngleStale, Fault::ArmAngleRange),
    ];
    sensed.validities().into_iter().zip(faults).find_map(
        |(validity, (stale, range))| match validity {
            Validity::Valid | Validity::Held(_) => None,
            Validity::Invalid(Reason::OutOfRange) if ranged => Some(range),
            Validity::Invalid(Reason::NoField) => Some(Fault::ArmAngleMagnet),
            _ => Some(stale),
        },
    )
}

#[cfg(test)]
#[path = "monitor_tests.rs"]
mod tests;
