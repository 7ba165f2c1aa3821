//! How fast a bridge's motor may turn, known from its duties alone.
//!
//! The motor follows the output of its bridge with a lag, `w' = (u - w) / tau`, in parts of its
//! speed at full duty without load. The output lies between zero and the duty, so the motor turns
//! forwards at most as fast as under the positive duties alone, and backwards as under the
//! negative ones. A bound that rises with the shortest lag and falls with the longest one holds
//! for every lag between them.

use crate::numeric::{LowPass, LowPassState};
use crate::units::{Q16, Ratio};

/// Shortest and longest lag, parts of the known one: three standard deviations of 15 % each.
pub(super) const LAG_ENDS: [f64; 2] = [0.55, 1.45];

/// Lag of a motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(super) struct Motor {
    rises: LowPass,
    falls: LowPass,
}

/// Largest speed in either direction, parts of that at full duty, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Turning {
    forwards: LowPassState,
    backwards: LowPassState,
}

impl Motor {
    /// A motor that follows its bridge with this time constant, s.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub(super) fn build(lag_s: f64) -> Self {
        let [rises, falls] = LAG_ENDS.map(|part| LowPass::build(part * lag_s));
        Self { rises, falls }
    }

    /// One tick under this duty, Q15.
    pub(super) fn step(&self, turning: &mut Turning, duty: i16) {
        let duty = Q16::from_bits(2 * i32::from(duty));
        for (bound, drives) in [(&mut turning.forwards, duty), (&mut turning.backwards, -duty)] {
            let drives = drives.max(Q16::ZERO);
            let lag = if drives > bound.output() { self.rises } else { self.falls };
            lag.step(bound, drives);
        }
    }
}

impl Turning {
    /// Largest speed against a duty of this sign.
    pub(super) const fn against(&self, duty: i16) -> Ratio {
        if duty < 0 { self.forwards.output() } else { self.backwards.output() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LAG_S: f64 = 0.06;

    proptest! {
        /// Whatever the bridge leaves of its duties and however fast the motor follows.
        #[test]
        fn no_motor_turns_faster_than_its_bounds(
            steps in prop::collection::vec((-32_767i16..=32_767, 0.0..=1.0f64, 1usize..200), 1..20),
            lag in LAG_ENDS[0]..LAG_ENDS[1],
        ) {
            let motor = Motor::build(LAG_S);
            let (mut turning, mut speed) = (Turning::default(), 0.0);
            let keeps = (-1e-3 / (lag * LAG_S)).exp();
            for (duty, left, ticks) in steps {
                let output = f64::from(duty) / 32_768.0 * left;
                for _ in 0..ticks {
                    motor.step(&mut turning, duty);
                    speed = output + (speed - output) * keeps;
                    let [forwards, backwards] =
                        [-1, 1].map(|duty| turning.against(duty).to_num::<f64>());
                    // A few parts in 2^16 of rounding.
                    prop_assert!(speed <= forwards + 2e-4 && -speed <= backwards + 2e-4);
                }
            }
        }
    }

    #[test]
    fn the_bounds_are_those_of_the_shortest_and_of_the_longest_lag() {
        let motor = Motor::build(LAG_S);
        let mut turning = Turning::default();
        let mut after = |duty: i16, ticks: u32| {
            (0..ticks).for_each(|_| motor.step(&mut turning, duty));
            [1, -1].map(|duty| turning.against(duty).to_num::<f64>())
        };
        let near = |got: f64, expected: f64| assert!((got - expected).abs() < 2e-3, "{got}");
        let [backwards, forwards] = after(32_767, 60);
        near(backwards, 0.0);
        near(forwards, 1.0 - (-1.0 / LAG_ENDS[0]).exp());
        let [_, forwards] = after(32_767, 1000);
        near(forwards, 1.0);
        let [backwards, forwards] = after(-16_384, 60);
        near(forwards, (-1.0 / LAG_ENDS[1]).exp());
        near(backwards, 0.5 * (1.0 - (-1.0 / LAG_ENDS[0]).exp()));
    }
}
