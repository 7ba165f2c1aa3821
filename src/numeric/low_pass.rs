//! First-order low-pass at the control rate.

use crate::units::Q16;

/// First-order low-pass `y += a (x - y)`, one call a tick T, `a = 1 - exp(-T / tau)`: the step
/// response is that of the continuous filter at the ticks.
///
/// Range: all of [`Q16`]. The state has 16 more bits than the output: no dead band. Error: 1 LSB
/// against the same filter in f64, plus 2^-17 / a relative of a jump from the rounding of `a`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct LowPass {
    /// `a` in Q16, 1 to 65536.
    pub(super) gain: u32,
}

/// State of a [`LowPass`]: its output with 32 fractional bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LowPassState {
    /// Bits of Q16.
    integer: i32,
    /// The bits behind them, 0 to 65535.
    rest: u32,
}

impl LowPassState {
    /// A filter at rest at `value`.
    pub const fn at(value: Q16) -> Self {
        Self { integer: value.to_bits(), rest: 0 }
    }

    /// The present output.
    pub const fn output(&self) -> Q16 {
        Q16::from_bits(self.integer.saturating_add((self.rest >> 15) as i32))
    }
}

impl LowPass {
    /// One tick with input `x`.
    pub fn step(&self, state: &mut LowPassState, x: Q16) -> Q16 {
        // a (x - y) in two products: y's integer bits, then the 16 behind them.
        let error = i64::from(x.to_bits()) - i64::from(state.integer);
        let gained = error * i64::from(self.gain) - i64::from((state.rest * self.gain) >> 16);
        let moved = (i64::from(state.integer) << 16) + i64::from(state.rest) + gained;
        state.integer = (moved >> 16) as i32;
        state.rest = moved as u32 & 0xFFFF;
        state.output()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_step_is_answered_as_by_the_continuous_filter() {
        let filter = LowPass::build(0.005);
        let mut state = LowPassState::at(Q16::ZERO);
        let mut worst = 0.0_f64;
        for tick in 1..=100 {
            let got = filter.step(&mut state, Q16::from_num(100)).to_num::<f64>();
            let exact = 100.0 * (1.0 - (-f64::from(tick) / 5.0).exp());
            worst = worst.max((got - exact).abs());
        }
        assert!(worst <= 100.0 * 5e-5, "{worst}");
    }

    #[test]
    fn no_time_constant_passes_the_input() {
        let filter = LowPass::build(0.0);
        let mut state = LowPassState::at(Q16::MIN);
        assert_eq!(filter.step(&mut state, Q16::MAX), Q16::MAX);
        assert_eq!(filter.step(&mut state, Q16::MIN), Q16::MIN);
    }

    proptest! {
        #[test]
        fn a_constant_is_reached_to_the_last_bit(start in any::<i32>(), end in any::<i32>()) {
            let filter = LowPass::build(0.005);
            let mut state = LowPassState::at(Q16::from_bits(start));
            let end = Q16::from_bits(end);
            for _ in 0..300 {
                filter.step(&mut state, end);
            }
            prop_assert_eq!(state.output(), end);
        }

        #[test]
        fn the_output_is_that_of_the_filter_in_f64(
            inputs in prop::collection::vec(-200.0_f64..200.0, 1..300),
            tau in 0.002_f64..0.1,
        ) {
            let filter = LowPass::build(tau);
            let a = f64::from(filter.gain) / 65_536.0;
            let mut state = LowPassState::at(Q16::ZERO);
            let mut reference = 0.0;
            for x in inputs {
                let x = Q16::from_num(x);
                reference += a * (x.to_num::<f64>() - reference);
                let got = filter.step(&mut state, x).to_num::<f64>();
                prop_assert!((got - reference).abs() <= 1.0 / 65_536.0);
            }
        }
    }
}
