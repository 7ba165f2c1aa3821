//! Which crossings the reduced model is fitted to, and which it is checked on.

use hil_sim::fit_range::PUBLISHED;
use interstage::model::effective_stiffness::{FORCE_END, Kind};
use interstage::model::formula::Formula;
use interstage::units::Direction;

/// A crossing of the published wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignPoint {
    /// Direction, and whether it is driven.
    pub kind: Kind,
    /// Step height, mm.
    pub step_mm: f64,
    pub speed_mm_s: f64,
    /// Radial force, N.
    pub preload_n: f64,
    /// Load lifted by friction, N; 0 if pushed.
    pub load_n: f64,
}

/// What a crossing is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// The domain of use and a margin around it.
    Fit,
    /// The corners beyond it that the solver may pass through: large forces at large
    /// speeds, small at small. Thinly covered and lightly weighted.
    Tame,
    /// Checks the fit and is never used in it; inside the domain.
    Hold,
}

/// Utilisation up to which loads are drawn for the fit; rubber holds about 1.5.
const FIT_UTILISATION: f64 = 1.72;
/// Largest load of the fit, N.
const FIT_LOAD_N: f64 = 22.0;

/// Crossings of one kind and use, by default.
pub fn count(kind: Kind, of: Use) -> usize {
    match (of, kind.driven) {
        (Use::Fit, true) => 900,
        (Use::Fit, false) => 450,
        (Use::Tame, true) => 300,
        (Use::Tame, false) => 150,
        (Use::Hold, true) => 200,
        (Use::Hold, false) => 100,
    }
}

/// The crossings of one kind and use, of a wheel with these proportions.
pub fn cases(formula: &Formula, kind: Kind, of: Use) -> Vec<DesignPoint> {
    (0..count(kind, of)).filter_map(|index| case(formula, kind, of, index)).collect()
}

fn case(formula: &Formula, kind: Kind, of: Use, index: usize) -> Option<DesignPoint> {
    // Each set takes its own stretch of the sequence.
    let [speed, force, step, load] = match of {
        Use::Fit => low_discrepancy(index + 1).map(towards_ends),
        Use::Tame => low_discrepancy(index + 5_000).map(towards_ends),
        Use::Hold => low_discrepancy(index + 10_000),
    };
    let between = |low: f64, high: f64, part: f64| low + (high - low) * part;
    let log_between = |low: f64, high: f64, part: f64| low * (high / low).powf(part);
    let (speed_mm_s, step_mm) = match of {
        Use::Fit => (log_between(0.5, 200.0, speed), between(1.9, 6.1, step)),
        Use::Tame => (log_between(0.4, 250.0, speed), between(1.9, 6.1, step)),
        Use::Hold => {
            let ((slow, fast), (low, high)) = (PUBLISHED.speed_mm_s, PUBLISHED.step_mm);
            (log_between(slow, fast, speed), between(low, high, step))
        }
    };
    let shape = Formula { step_mm, ..*formula };
    // Axial over radial reaction as the contact sets in, nearly.
    let slope = 0.9 * shape.free_run_mm() / (shape.radius_mm - step_mm);
    let lifted = |utilisation: f64| (utilisation - slope) / (1.0 + utilisation * slope);
    let (preload_n, most_n) = match of {
        Use::Fit => {
            let preload = log_between(10.0, 230.0, force);
            (preload, (preload * lifted(FIT_UTILISATION)).min(FIT_LOAD_N))
        }
        Use::Hold => {
            let preload = log_between(PUBLISHED.preload_n.0, PUBLISHED.preload_n.1, force);
            (preload, (preload * lifted(PUBLISHED.utilisation)).min(PUBLISHED.load_n))
        }
        Use::Tame => {
            let run = between(0.1, 0.98, force) * shape.largest_run_mm(kind);
            let contact = shape.contact(shape.gap_after_mm(run));
            let sigma = contact.axial / contact.radial;
            let half = if kind.direction == Direction::Deploy { 19.0 } else { 60.0 };
            let stiffness = shape.k_inf * (1.0 + 3.2 * speed_mm_s / (speed_mm_s + half));
            let carried = stiffness * contact.radial;
            if !kind.driven {
                (carried, 0.0)
            } else {
                let most = ((FIT_UTILISATION - sigma) * carried).clamp(0.0, FIT_LOAD_N);
                (carried * (1.0 + sigma * sigma) + load * most * sigma, most)
            }
        }
    };
    let load_n = if kind.driven { rounded(load * most_n.max(0.0)) } else { 0.0 };
    let limit = 2.0 * FORCE_END * shape.unit_force_n();
    (3.0..limit).contains(&preload_n).then(|| DesignPoint {
        kind,
        step_mm: rounded(step_mm),
        speed_mm_s: rounded(speed_mm_s),
        preload_n: rounded(preload_n),
        load_n,
    })
}

/// Point `index` of the additive sequence of least discrepancy in four dimensions, each
/// from 0 to 1. Source: Roberts 2018, the powers of the root of g^5 = g + 1.
fn low_discrepancy(index: usize) -> [f64; 4] {
    const ROOT: f64 = 1.167_303_978_261_418_7;
    [1, 2, 3, 4].map(|power| (0.5 + index as f64 / ROOT.powi(power)).fract())
}

/// Chebyshev's density, as polynomials want it.
fn towards_ends(part: f64) -> f64 {
    0.5 - 0.5 * (std::f64::consts::PI * part).cos()
}

/// To five significant digits, so that a file holds exactly what was run.
fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use interstage::rig::Rig;

    #[test]
    fn the_check_stays_inside_the_domain_and_the_fit_around_it() {
        let formula = Formula::new(&Rig::fe());
        for kind in Kind::ALL {
            let hold = cases(&formula, kind, Use::Hold);
            assert_eq!(hold.len(), count(kind, Use::Hold));
            for case in &hold {
                assert!((1.0..=100.0).contains(&case.speed_mm_s), "{case:?}");
                assert!((15.0..=150.0).contains(&case.preload_n), "{case:?}");
                assert!((2.0..=6.0).contains(&case.step_mm), "{case:?}");
                assert!((0.0..=20.0).contains(&case.load_n), "{case:?}");
            }
            let fit = cases(&formula, kind, Use::Fit);
            let reaches = |of: fn(&DesignPoint) -> f64, low: f64, high: f64| {
                fit.iter().any(|c| of(c) < low) && fit.iter().any(|c| of(c) > high)
            };
            assert!(reaches(|c| c.speed_mm_s, 0.9, 110.0));
            assert!(reaches(|c| c.preload_n, 14.0, 160.0));
            assert!(reaches(|c| c.step_mm, 2.0, 6.0));
            assert!(!kind.driven || reaches(|c| c.load_n, 0.2, 20.0));
        }
    }

    #[test]
    fn no_crossing_of_the_check_is_in_the_fit() {
        let formula = Formula::new(&Rig::fe());
        for kind in Kind::ALL {
            let fit = cases(&formula, kind, Use::Fit);
            let hold = cases(&formula, kind, Use::Hold);
            assert!(hold.iter().all(|case| !fit.contains(case)));
        }
    }

    #[test]
    fn the_sequence_is_even() {
        // Each of 8 slices of each axis holds an eighth of the points.
        for axis in 0..4 {
            let mut slices = [0; 8];
            for index in 1..=800 {
                slices[(8.0 * low_discrepancy(index)[axis]) as usize] += 1;
            }
            assert!(slices.iter().all(|n| (85..=115).contains(n)), "{slices:?}");
        }
    }
}
