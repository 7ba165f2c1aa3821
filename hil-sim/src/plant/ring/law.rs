//! The three-parameter solid over one step, integrated exactly for a depth that runs
//! linearly in it.

use wide::f64x4;

use super::RingParameters;

/// A number per element of a block.
pub(super) type Lanes = f64x4;

/// Displacement that counts as none, before it turns denormal and slow, mm.
pub(super) const GONE: f64 = 1e-200;

/// Below this ratio of step to relaxation time the differences are taken from their
/// series, whose first term left out is a part of 1e-13.
const SERIES_BELOW: f64 = 1e-4;

/// One relaxation over a step of given length: q' = (delta - q)/tau gives
/// `q1 = keep q0 + from_old delta0 + from_new delta1`, exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Branch {
    pub(super) keep: f64,
    pub(super) from_old: f64,
    pub(super) from_new: f64,
}

impl Branch {
    fn new(dt_s: f64, tau_s: f64) -> Self {
        let r = dt_s / tau_s;
        let keep = (-r).exp();
        let (from_old, from_new) = if r < SERIES_BELOW {
            (r * (0.5 - r * (1.0 / 3.0 - r / 8.0)), r * (0.5 - r * (1.0 / 6.0 - r / 24.0)))
        } else {
            // Mean of the kernel over the step.
            let mean = -(-r).exp_m1() / r;
            (mean - keep, 1.0 - mean)
        };
        Self { keep, from_old, from_new }
    }

    /// What the step's start leaves of the internal displacement at its end, mm, but for the
    /// new depth's part.
    #[inline(always)]
    pub(super) fn carry(&self, q: Lanes, old: Lanes) -> Lanes {
        Lanes::splat(self.keep) * q + Lanes::splat(self.from_old) * old
    }

    /// The internal displacement at the step's end, mm; what has all but decayed is gone.
    #[inline(always)]
    pub(super) fn advance(&self, q: Lanes, old: Lanes, new: Lanes) -> Lanes {
        let q = self.carry(q, old) + Lanes::splat(self.from_new) * new;
        q & q.abs().simd_gt(Lanes::splat(GONE))
    }
}

/// The solid over a step: one relaxation, or two of equal share (generalised Maxwell solid,
/// Christensen 1982, 1.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Law {
    pub(super) dt_s: f64,
    pub(super) k_inf: f64,
    /// k_0 - k_inf, N/mm^3, of all relaxations together.
    pub(super) excess: f64,
    pub(super) first: Branch,
    /// The slower one of two.
    pub(super) second: Option<Branch>,
    /// dp/d(depth) at the step's end, N/mm^3.
    pub(super) tangent: f64,
}

impl Law {
    pub(super) fn new(parameters: &RingParameters, dt_s: f64) -> Self {
        let [fast_s, slow_s] = parameters.relaxations_s();
        let first = Branch::new(dt_s, fast_s);
        let second = parameters.relaxes_twice().then(|| Branch::new(dt_s, slow_s));
        let from_new = second.map_or(first.from_new, |s| 0.5 * (first.from_new + s.from_new));
        let k_inf = parameters.k_inf;
        let excess = parameters.k_0 - k_inf;
        let tangent = k_inf + excess * (1.0 - from_new);
        Self { dt_s, k_inf, excess, first, second, tangent }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interstage::rig::Rig;
    use proptest::prelude::*;

    fn rubber(tau_s: f64) -> RingParameters {
        RingParameters { k_inf: 0.6, k_0: 2.5, tau_s, ..RingParameters::of(&Rig::fe(), 4) }
    }

    fn advance(law: &Law, q: f64, old: f64, new: f64) -> f64 {
        let Branch { keep, from_old, from_new } = law.first;
        keep * q + from_old * old + from_new * new
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
        for (a, b) in [
            (below.first.from_old, above.first.from_old),
            (below.first.from_new, above.first.from_new),
        ] {
            assert!((a / b - 1.0).abs() < 1e-8, "{a} {b}");
        }
    }

    /// Two relaxations keep the stiffness at once and at rest; between, the pressure of a
    /// depth held since the start is their mean.
    #[test]
    fn two_relaxations_share_the_excess() {
        let rubber = RingParameters { second_relaxation: 4.0, ..rubber(0.1) };
        let at_once = Law::new(&rubber, 1e-9);
        assert!((at_once.tangent - 2.5).abs() < 1e-6);
        assert!((Law::new(&rubber, 1e9).tangent - 0.6).abs() < 1e-6);
        let held = Law::new(&rubber, 0.2);
        let kept = 0.5 * (held.first.keep + held.second.unwrap().keep);
        let expected = 0.5 * ((-0.2f64 / 0.025).exp() + (-0.2f64 / 0.4).exp());
        assert!((kept - expected).abs() < 1e-12);
    }
}
