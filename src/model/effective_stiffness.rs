//! Effective stiffness of the tread in a crossing: the polynomial fitted to the ring.
//!
//! In units of the wheel (lengths over R, forces over k_inf R^2 L) the crossing of a quasi-static
//! ring depends on the speed v tau / R, the run over the corner r / R, the step h / R, the load
//! T / (k_inf R^2 L) and the stiffening s alone. `k_eff / k_inf = 1 + (s - 1) x E`, with the fast
//! part `x = speed / (speed + l)` of the crossing, and E a polynomial in x, run, step and load.

use super::constants::{DEPLOY, DEPLOY_PUSHED, RETRACT, RETRACT_PUSHED};
use crate::units::Direction;

/// Highest degree in x.
pub const FAST_DEGREE: usize = 5;
/// Highest degree in the run.
pub const RUN_DEGREE: usize = 6;
/// Highest degree in step and load.
pub const SLOW_DEGREE: usize = 3;
/// Coefficients `E_ij` of `T_i(2 x - 1) T_j(run)` for one step and load.
pub type Folded = [[f64; RUN_DEGREE + 1]; FAST_DEGREE + 1];

/// Run over R at the upper end of its Chebyshev range; the lower end is 0.
pub const RUN_END: f64 = 0.352;
/// Least and largest step over R of the fit.
pub const STEP_RANGE: (f64, f64) = (0.076, 0.244);
/// Largest load over k_inf R^2 L of the fit.
pub const LOAD_END: f64 = 2.08e-3;
/// Largest elastic force over k_inf R^2 L of the fit: 229 N on the published wheel.
pub const FORCE_END: f64 = 0.0217;
/// Unit of the constants.
const UNIT: f64 = 1e-8;

/// Which polynomial: direction, and whether friction drives the wheel or it is pushed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Direction of the crossing.
    pub direction: Direction,
    /// Driven by friction, with a load or without; else pushed and frictionless.
    pub driven: bool,
}

impl Kind {
    /// All four.
    pub const ALL: [Self; 4] = [
        Self { direction: Direction::Deploy, driven: true },
        Self { direction: Direction::Deploy, driven: false },
        Self { direction: Direction::Retract, driven: true },
        Self { direction: Direction::Retract, driven: false },
    ];

    /// Pace v tau / R at which half the crossing is fast. Chosen: least scatter of the fit.
    pub const fn half_speed(self) -> f64 {
        match self.direction {
            Direction::Deploy => 0.04,
            Direction::Retract => 0.12,
        }
    }

    /// The fitted coefficients in the order of [`Kind::terms`], in 1e-8.
    const fn coefficients(self) -> &'static [i32] {
        match (self.direction, self.driven) {
            (Direction::Deploy, true) => &DEPLOY,
            (Direction::Deploy, false) => &DEPLOY_PUSHED,
            (Direction::Retract, true) => &RETRACT,
            (Direction::Retract, false) => &RETRACT_PUSHED,
        }
    }

    /// Degrees in x, run, step and load of each term: those of which the degrees, each
    /// over its highest, sum to at most one.
    pub fn terms(self) -> impl Iterator<Item = [usize; 4]> {
        let most = if self.driven { SLOW_DEGREE } else { 0 };
        let all = move |i| {
            (0..=RUN_DEGREE).flat_map(move |j| {
                (0..=SLOW_DEGREE).flat_map(move |k| (0..=most).map(move |l| [i, j, k, l]))
            })
        };
        (0..=FAST_DEGREE).flat_map(all).filter(|&[i, j, k, l]| 6 * i + 5 * j + 10 * (k + l) <= 30)
    }

    /// The polynomial for one step and load, both over the wheel's units and held at the
    /// ends of the fit.
    pub fn fold(self, step: f64, load: f64) -> Folded {
        let mut folded = Folded::default();
        let (by_step, by_load) = (step_values(step), load_values(load));
        for ([i, j, k, l], &c) in self.terms().zip(self.coefficients()) {
            if let Some(entry) = folded.get_mut(i).and_then(|row| row.get_mut(j)) {
                *entry += UNIT * f64::from(c) * by_step[k] * by_load[l];
            }
        }
        folded
    }
}

/// Chebyshev polynomials of the first kind at `t`, T_0 to T_(N-1).
pub fn chebyshev<const N: usize>(t: f64) -> [f64; N] {
    let (mut now, mut next) = (1.0, t);
    [(); N].map(|()| {
        let value = now;
        (now, next) = (next, 2.0 * t * next - now);
        value
    })
}

/// Chebyshev values in x, 0 to 1.
pub fn fast_values(x: f64) -> [f64; FAST_DEGREE + 1] {
    chebyshev(2.0 * x - 1.0)
}

/// Chebyshev values in the run over R.
pub fn run_values(run: f64) -> [f64; RUN_DEGREE + 1] {
    chebyshev(2.0 * run / RUN_END - 1.0)
}

/// Chebyshev values in the step over R, held at the ends.
pub fn step_values(step: f64) -> [f64; SLOW_DEGREE + 1] {
    let (low, high) = STEP_RANGE;
    chebyshev(2.0 * (step.max(low).min(high) - low) / (high - low) - 1.0)
}

/// Chebyshev values in the load over k_inf R^2 L, held at the ends.
pub fn load_values(load: f64) -> [f64; SLOW_DEGREE + 1] {
    chebyshev(2.0 * load.clamp(0.0, LOAD_END) / LOAD_END - 1.0)
}

/// Value of a folded polynomial.
pub fn value(folded: &Folded, x: f64, run: f64) -> f64 {
    let (by_x, by_run) = (fast_values(x), run_values(run));
    let row = |row: &[f64; RUN_DEGREE + 1]| row.iter().zip(by_run).map(|(c, t)| c * t).sum::<f64>();
    folded.iter().zip(by_x).map(|(c, t)| row(c) * t).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn there_is_a_constant_for_each_term() {
        for kind in Kind::ALL {
            assert_eq!(kind.terms().count(), kind.coefficients().len(), "{kind:?}");
            let (fast, run) = (FAST_DEGREE as f64, RUN_DEGREE as f64);
            assert!(kind.terms().all(|[i, j, k, l]| {
                i as f64 / fast + j as f64 / run + (k + l) as f64 / SLOW_DEGREE as f64 <= 1.0 + 1e-9
            }));
        }
    }

    proptest! {
        #[test]
        fn chebyshev_polynomials_are_cosines(angle in 0.0..3.2f64) {
            for (n, value) in chebyshev::<8>(angle.cos()).into_iter().enumerate() {
                prop_assert!((value - (n as f64 * angle).cos()).abs() < 1e-12);
            }
        }

        #[test]
        fn a_folded_polynomial_is_the_sum_of_its_terms(
            which in 0..4usize,
            x in 0.0..1.0f64,
            run in 0.0..RUN_END,
            step in 0.05..0.3f64,
            load in 0.0..3e-3f64,
        ) {
            let kind = Kind::ALL[which];
            let direct: f64 = kind
                .terms()
                .zip(kind.coefficients())
                .map(|([i, j, k, l], &c)| {
                    1e-8 * f64::from(c) * fast_values(x)[i] * run_values(run)[j]
                        * step_values(step)[k] * load_values(load)[l]
                })
                .sum();
            let got = value(&kind.fold(step, load), x, run);
            prop_assert!((got - direct).abs() < 1e-12, "{got} {direct}");
        }
    }
}
