//! The three-parameter solid over one step, integrated exactly for a depth that runs
//! linearly in it.

use super::RingParameters;

/// Below this ratio of step to relaxation time the differences are taken from their
/// series, whose first term left out is a part of 1e-13.
const SERIES_BELOW: f64 = 1e-4;

/// The solid over a step of given length: q' = (delta - q)/tau gives
/// `q1 = keep q0 + from_old delta0 + from_new delta1`, exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Law {
    /// Step, s.
    pub(super) dt_s: f64,
    /// k_0 - k_inf, N/mm^3.
    pub(super) excess: f64,
    pub(super) keep: f64,
    pub(super) from_old: f64,
    pub(super) from_new: f64,
    /// dp/d(depth) at the step's end, N/mm^3.
    pub(super) tangent: f64,
}

impl Law {
    pub(super) fn new(parameters: &RingParameters, dt_s: f64) -> Self {
        let r = dt_s / parameters.tau_s;
        let keep = (-r).exp();
        let (from_old, from_new) = if r < SERIES_BELOW {
            (r * (0.5 - r * (1.0 / 3.0 - r / 8.0)), r * (0.5 - r * (1.0 / 6.0 - r / 24.0)))
        } else {
            // Mean of the kernel over the step.
            let mean = -(-r).exp_m1() / r;
            (mean - keep, 1.0 - mean)
        };
        let excess = parameters.k_0 - parameters.k_inf;
        let tangent = parameters.k_inf + excess * (1.0 - from_new);
        Self { dt_s, excess, keep, from_old, from_new, tangent }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rubber(tau_s: f64) -> RingParameters {
        RingParameters { radius_mm: 25.0, width_mm: 28.0, k_inf: 0.6, k_0: 2.5, tau_s, elements: 4 }
    }

    fn advance(law: &Law, q: f64, old: f64, new: f64) -> f64 {
        law.keep * q + law.from_old * old + law.from_new * new
    }

    proptest! {
        /// One step or two halves of it, at any ratio of step to relaxation time.
        #[test]
        fn halving_a_step_changes_nothing(
            exponent in -9.0f64..9.0, q in 0.0f64..2.0, old in 0.0f64..2.0, new in 0.0f64..2.0,
        ) {
            let tau = 1e-3 * 10f64.powf(-exponent);
            let (whole, half) = (Law::new(&rubber(tau), 1e-3), Law::new(&rubber(tau), 0.5e-3));
            let mid = 0.5 * (old + new);
            let once = advance(&whole, q, old, new);
            let twice = advance(&half, advance(&half, q, old, mid), mid, new);
            prop_assert!((once - twice).abs() < 1e-12, "{once} {twice}");
            // An average of what it comes from: it creates nothing.
            let (low, high) = (q.min(old).min(new), q.max(old).max(new));
            prop_assert!((low - 1e-12..=high + 1e-12).contains(&once));
        }
    }

    #[test]
    fn the_series_meets_the_quotient() {
        let [below, above] =
            [1.0 - 1e-9, 1.0 + 1e-9].map(|part| Law::new(&rubber(1.0), SERIES_BELOW * part));
        for (a, b) in [(below.from_old, above.from_old), (below.from_new, above.from_new)] {
            assert!((a / b - 1.0).abs() < 1e-8, "{a} {b}");
        }
    }
}
