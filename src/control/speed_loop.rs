//! Speed loop of the drive: feed-forward of speed and load, PI on the rest.

use crate::numeric::{between, checked};
use crate::rig::{CROSSOVER_RAD_S, MOST_ERROR_MM_S, PROPORTIONAL, Rig, RigError};
use crate::units::{Duty, MillimetresPerSecond, Newtons, Q16, Ratio, Travel, per_tick, q16};

/// Largest error that is integrated, mm/s: a wheel that no longer answers must not wind
/// the drive up before it is noticed.
const MOST_ERROR: MillimetresPerSecond = q16((MOST_ERROR_MM_S * 1e6) as i64);
/// Full duty.
const FULL: Ratio = q16(1_000_000);
/// Most that the integral part may contribute, duty.
const INTEGRAL_LIMIT: Ratio = q16(500_000);

/// What a wheel lacks, over what its measured error shows while the load rises: the motor and the
/// proportional part make 1.3; the rest, for a measured speed that lags behind, has no derivation.
/// With 1.3 the plant deploys as fast, but 7 % slower at a friction of 0.8.
const LAGS: Ratio = q16(2_500_000);

/// Gains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SpeedLoop {
    /// Duty per speed, s/mm: the motor's inverse gain.
    per_speed: Q16,
    /// Duty per load, 1/N, times 256 for resolution.
    per_load: Q16,
    proportional: Q16,
    /// Integral gain, duty per mm.
    integral: Q16,
}

/// The integral part, duty, Q31.32, what a corner adds to the feed-forward, and the last duty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SpeedLoopState {
    integral: Travel,
    corner: Ratio,
    duty: Ratio,
}

impl SpeedLoop {
    /// Gains of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let inverse = 1.0 / rig.drive.no_load_speed_mm_s;
        Ok(Self {
            per_speed: checked("drive.no_load_speed_mm_s", inverse)?,
            per_load: checked("drive.stall_force_n", 256.0 / rig.drive.stall_force_n)?,
            proportional: checked("drive.no_load_speed_mm_s", PROPORTIONAL * inverse)?,
            integral: checked("drive.no_load_speed_mm_s", CROSSOVER_RAD_S * inverse)?,
        })
    }

    /// Of a corner's load this part is fed forward from now on. The integral part yields as much, but for
    /// what the wheel still lacks by its error, mm/s: it has carried the load so far.
    pub fn hand_over(
        &self,
        state: &mut SpeedLoopState,
        load: Newtons,
        part: Ratio,
        error: MillimetresPerSecond,
    ) {
        let whole = self.forward(load);
        state.corner = whole;
        let lacks = error * self.per_speed * LAGS;
        let lacks = between(lacks, whole.min(Q16::ZERO), whole.max(Q16::ZERO));
        let limit = INTEGRAL_LIMIT.widen();
        state.integral =
            state.integral.saturating_sub(((whole - lacks) * part).widen()).clamp(-limit, limit);
    }

    /// Duty that a load needs.
    fn forward(&self, load: Newtons) -> Ratio {
        Q16::from_bits((load * self.per_load).to_bits() >> 8)
    }

    /// Duty for `wanted` speed at `measured` speed against `load`, all signed
    /// outwards. The integral holds while the duty saturates in the same direction, and where
    /// it would only brake harder: against a load along the motion the worm does that by itself.
    pub fn step(
        &self,
        state: &mut SpeedLoopState,
        wanted: MillimetresPerSecond,
        measured: MillimetresPerSecond,
        load: Newtons,
    ) -> Duty {
        let error = wanted - measured;
        let forward = wanted * self.per_speed + self.forward(load);
        let whole = forward + self.proportional * error + state.value();
        let least = if wanted > Q16::ZERO { Q16::ZERO } else { -FULL };
        let most = if wanted < Q16::ZERO { Q16::ZERO } else { FULL };
        let pushing = if error < Q16::ZERO { whole > least } else { whole < most };
        if pushing {
            let limit = INTEGRAL_LIMIT.widen();
            state.integral = state
                .integral
                .saturating_add(per_tick(self.integral * error.clamp(-MOST_ERROR, MOST_ERROR)))
                .clamp(-limit, limit);
        }
        state.duty = whole.clamp(-FULL, FULL);
        Duty::saturating(whole)
    }
}

impl SpeedLoopState {
    /// Duty of the last tick.
    pub const fn duty(&self) -> Ratio {
        self.duty
    }

    /// Duty that it adds to the feed-forward.
    pub fn value(&self) -> Ratio {
        Q16::narrow(self.integral)
    }

    /// What of that a corner does not explain, whose force is known to a half.
    pub fn effort(&self) -> Ratio {
        let (value, part) = (self.value(), self.corner.abs().half());
        between(Q16::ZERO, value - part, value + part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A first-order motor with the rig's gain under the loop.
    fn settle(load: f64, wanted: f64, seconds: f64) -> f64 {
        let rig = Rig::prototype();
        let control = SpeedLoop::try_build(&rig).unwrap();
        let (mut state, mut speed) = (SpeedLoopState::default(), 0.0);
        for _ in 0..(seconds * 1e3) as usize {
            let out =
                control.step(&mut state, Q16::from_num(wanted), Q16::from_num(speed), Q16::ZERO);
            let rest = rig.drive.no_load_speed_mm_s
                * (f64::from(out.to_bits()) / 32768.0 - load / rig.drive.stall_force_n);
            speed += (rest - speed) * 0.1;
        }
        speed
    }

    #[test]
    fn an_unknown_load_is_regulated_away() {
        for wanted in [3.0, 12.0, -20.0] {
            let speed = settle(25.0, wanted, 1.0);
            assert!((speed - wanted).abs() < 0.02, "{speed} {wanted}");
        }
    }

    #[test]
    fn the_integral_winds_up_neither_against_a_wall_nor_to_brake() {
        let control = SpeedLoop::try_build(&Rig::prototype()).unwrap();
        let step = |state: &mut _, wanted, measured| {
            control.step(state, Q16::from_num(wanted), Q16::from_num(measured), Q16::ZERO)
        };
        let mut state = SpeedLoopState::default();
        assert!((0..20_000).all(|_| step(&mut state, 60, 0).to_bits() > 0));
        assert!(state.value() <= INTEGRAL_LIMIT);
        // Released, it comes back within a fraction of a second.
        assert!((0..200).any(|_| step(&mut state, 10, 30).to_bits() <= 0));
        for sign in [1, -1] {
            let duties = (0..20_000).map(|_| step(&mut state, 10 * sign, 11 * sign).to_bits());
            assert!(duties.last().unwrap().abs() < 99);
        }
    }

    /// What handing a load over changes of the duty at this error, the duty of the load, and the effort
    /// that it leaves.
    fn handed(load: f64, error: f64) -> [f64; 3] {
        let control = SpeedLoop::try_build(&Rig::prototype()).unwrap();
        let mut state = SpeedLoopState::default();
        let (load, error) = (Q16::from_num(load), Q16::from_num(error));
        (0..32).for_each(|_| control.hand_over(&mut state, load, q16(31_250), error));
        let forward: f64 = control.forward(load).to_num();
        [forward + state.value().to_num::<f64>(), forward, state.effort().to_num()]
    }

    #[test]
    fn what_the_integral_carried_is_taken_from_it() {
        for load in [12.0, -12.0] {
            let [change, forward, effort] = handed(load, 0.0);
            assert!(change.abs() < 1e-3 && (effort + 0.5 * forward).abs() < 1e-3, "{effort}");
            // A wheel that does not lag gets nothing, one that stands all of it.
            assert!(handed(load, -load.signum())[0].abs() < 1e-3);
            let [change, forward, effort] = handed(load, 50.0 * load.signum());
            assert!((change - forward).abs() < 1e-3 && forward.abs() > 0.07 && effort == 0.0);
            let [change, ..] = handed(load, 0.6 * load.signum());
            assert!((change.abs() - 0.025).abs() < 1e-3, "{change}");
        }
    }

    proptest! {
        #[test]
        fn no_input_overflows(wanted in any::<i32>(), measured in any::<i32>(), load in any::<i32>()) {
            let control = SpeedLoop::try_build(&Rig::prototype()).unwrap();
            let mut state = SpeedLoopState::default();
            let at = |bits| Q16::from_bits(bits);
            for _ in 0..3 {
                control.step(&mut state, at(wanted), at(measured), at(load));
                control.hand_over(&mut state, at(load), Q16::ONE, at(measured));
            }
            prop_assert!(state.value().abs() <= INTEGRAL_LIMIT);
        }
    }
}
