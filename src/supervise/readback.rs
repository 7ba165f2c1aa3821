//! Compares each bridge's output with its duty. The output, the difference of its two legs, goes
//! through a low-pass to a converter; the duty goes through the same low-pass here. A wrong duty
//! shows within milliseconds.
//!
//! A bridge at its current limit gives less than its duty, of the same sign: as much as holds
//! the limit. With the motor at rest or turning with its duty that is [`REGULATED`] at least.
//! A motor that still turns against its duty adds its own voltage to the current, and the bridge
//! gives less by that, down to nothing. So much is no fault; less, more or the other sign is.
//!
//! Faults behind the output (a motor without force, a slipping gear, a jammed screw) are left to
//! the comparison of the sensors in `crosscheck`.

use super::motor::{Motor, Turning};
use crate::fault::Fault;
use crate::rig::Rig;
use crate::sense::raw::{BridgeCode, BridgeCodes};
use crate::units::Duty;

/// Time constant of the low-pass before the converter, ticks. A period of the PWM, 50 us, leaves
/// 1 % of ripple after it, and next to none in the mean of 0.15 ms.
pub const LAG_TICKS: f64 = 1.0;
/// Response of the low-pass to a step within a tick, Q15: `1 - exp(-1 / LAG_TICKS)`.
const TAKES: i32 = 20_713;
/// The same of a low-pass that is 15 % faster or slower.
const TAKES_ENDS: [i32; 2] = [22_662, 19_035];
/// Tolerance of the output, Q15 duty: five deviations of its noise, 0.002 each, and three of its
/// zero, as much again; the voltage drop of the transistors is less.
pub const BAND: i32 = 655;
/// Tolerance relative to the expected output, as a shift: three deviations of supply, divider
/// and reference together, 0.7 % each.
pub const BAND_SHIFT: u32 = 5;
/// Least output of a bridge that regulates its current and whose motor does not turn against its
/// duty, Q15 duty: a quarter. At standstill the presets' force limit takes half of the full duty,
/// more in motion; the other half is for the spread of limit and winding, and for a wheel that is
/// braked. A smaller duty never reaches the limit and is judged by itself.
const REGULATED: i16 = 8192;
/// Ticks for which the output must be off.
pub const OFF_TICKS: i8 = 4;
/// Ticks without a conversion that count as a fault, as for the sensors.
const SILENT_TICKS: u8 = 20;

/// Ticks after the start that are not judged: then the low-pass keeps a thousandth of the duty
/// before a restart.
const SETTLES: i8 = 7;

/// Both bridges' motors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Readback {
    drive: Motor,
    pretightener: Motor,
}

/// State of both bridges' comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadbackState {
    drive: Bridge,
    pretightener: Bridge,
    /// Ticks without a conversion.
    silent: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Bridge {
    /// Duty commanded until now, Q15.
    commanded: i16,
    /// It through the fastest and the slowest low-pass.
    lags: [Lag; 2],
    /// The same of what regulation at least leaves of it.
    regulated: [Lag; 2],
    /// What the motor's speed may be.
    turning: Turning,
    /// Least and largest output a tick ago, Q15.
    before: (i32, i32),
    /// Ticks for which it has been off; if negative, ticks until it is judged.
    off: i8,
}

impl Default for Bridge {
    fn default() -> Self {
        let lags = [Lag(0); 2];
        let turning = Turning::default();
        Self { commanded: 0, lags, regulated: lags, turning, before: (0, 0), off: -SETTLES }
    }
}

/// The low-pass before the converter: `y' = (u - y) / LAG_TICKS`, exact for a duty that is
/// held through the tick, but for the rounding, 1 LSB of Q15 at most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lag(i32);

impl Lag {
    /// Output after a tick under this duty, Q15.
    pub const fn step(&mut self, duty: i32) -> i32 {
        self.step_by(duty, TAKES)
    }

    const fn step_by(&mut self, duty: i32, takes: i32) -> i32 {
        // |duty - output| <= 2^16: the product stays below 2^31.
        self.0 += ((duty - self.0) * takes + (1 << 14)) >> 15;
        self.0
    }
}

impl Readback {
    /// The motors of a rig. The drive's follows its bridge as its torque over speed accelerates
    /// the rotor.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn build(rig: &Rig) -> Self {
        let drive = &rig.drive;
        let lag_s = 1e-3 * drive.reflected_mass_kg * drive.no_load_speed_mm_s / drive.stall_force_n;
        Self { drive: Motor::build(lag_s), pretightener: Motor::build(rig.preload.lag_s) }
    }

    /// One tick with the readback of the duties set before it. A wheel that may coast, as after a
    /// restart in motion, drives its motor as a generator: then its bridge is not judged.
    pub fn step(
        &self,
        state: &mut ReadbackState,
        found: Option<BridgeCodes>,
        coasts: bool,
    ) -> Option<Fault> {
        let Some(found) = found else {
            state.drive.advance(&self.drive);
            state.pretightener.advance(&self.pretightener);
            state.silent = state.silent.saturating_add(1);
            return (state.silent >= SILENT_TICKS).then_some(Fault::ReadbackStale);
        };
        state.silent = 0;
        let drive = state.drive.is_off(&self.drive, found.drive);
        let pretightener = state.pretightener.is_off(&self.pretightener, found.pretightener);
        if drive && !coasts {
            return Some(Fault::DriveBridge);
        }
        if coasts {
            state.drive.off = state.drive.off.min(0);
        }
        pretightener.then_some(Fault::PretightenerBridge)
    }
}

impl ReadbackState {
    /// Sets the duties until the next tick; 0 with the bridge off.
    pub const fn set_duties(&mut self, drive: Duty, pretightener: Duty) {
        self.drive.commanded = drive.to_bits();
        self.pretightener.commanded = pretightener.to_bits();
    }

    /// Whether the drive has been given a duty.
    pub const fn drives(&self) -> bool {
        self.drive.commanded != 0
    }
}

impl Bridge {
    /// Least and largest output after a tick under the duty.
    fn advance(&mut self, motor: &Motor) -> (i32, i32) {
        // The speed before the tick, when it is farthest from the duty, in Q15.
        let against = self.turning.against(self.commanded).to_bits() >> 1;
        // Between 0 and REGULATED.
        let leaves = (i32::from(REGULATED) - against).max(0) as i16;
        // Not `clamp`, which can panic.
        let least = self.commanded.max(-leaves).min(leaves);
        motor.step(&mut self.turning, self.commanded);
        for (lags, duty) in [(&mut self.lags, self.commanded), (&mut self.regulated, least)] {
            let [fast, slow] = lags;
            fast.step_by(duty.into(), TAKES_ENDS[0]);
            slow.step_by(duty.into(), TAKES_ENDS[1]);
        }
        self.bounds()
    }

    /// Least and largest output now. Whatever the output is between the two duties, its low-pass
    /// is between theirs.
    fn bounds(&self) -> (i32, i32) {
        let ([Lag(a), Lag(b)], [Lag(c), Lag(d)]) = (self.lags, self.regulated);
        (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
    }

    /// Whether it has been off for too long. The code was taken at some moment of the last two
    /// ticks: it may lie anywhere between the outputs of three.
    fn is_off(&mut self, motor: &Motor, code: BridgeCode) -> bool {
        let older = self.before;
        let before = self.bounds();
        let now = self.advance(motor);
        self.before = before;
        let low = now.0.min(before.0).min(older.0);
        let high = now.1.max(before.1).max(older.1);
        let band = BAND + (now.0.abs().max(now.1.abs()) >> BAND_SHIFT);
        let found = code.duty();
        let off = found < low - band || found > high + band;
        self.off = if off || self.off < 0 { self.off.saturating_add(1) } else { 0 };
        self.off >= OFF_TICKS
    }
}

#[cfg(test)]
#[path = "readback_tests.rs"]
mod tests;
