//! Coefficients for `interstage-arith`: the polynomials of the shipping model, fitted
//! from the formulas in f64.

use interstage::model::felt::{self, FORCE_END, Kind};
use interstage::model::formula::{Formula, LEAST_RUN};
use interstage::rig::Rig;
use interstage::supervise::Direction;
use interstage_arith::{Shared, Way};
use nalgebra::{DMatrix, DVector};

/// Unit of force over the largest elastic force: leaves it at a quarter.
const UNIT_OVER_LARGEST: f64 = 4.0;

/// Least elastic force, N, and most friction that the guess serves, as the shipping one.
const LEAST_ELASTIC_N: f64 = 9.0;
pub(super) const MOST_UTILISATION: f64 = 1.7;

/// Nodes of a fit in one variable; of each in two.
const NODES: usize = 64;
const GRID: usize = 32;

/// Coefficients of a rig for both ways; none if a fit is singular.
pub(super) fn coefficients(rig: &Rig) -> Option<(Shared, [Way; 2])> {
    let formula = Formula::new(rig);
    let load_n = rig.plant.top_load_n * rig.plant.top_load_share;
    let kind = |direction| Kind { direction, driven: true };
    let bench = Bench {
        formula,
        load_n,
        longest_mm: formula.largest_run_mm(kind(Direction::Deploy)),
        unit_n: UNIT_OVER_LARGEST * FORCE_END * formula.unit_force_n(),
    };
    let way = |direction| bench.way(kind(direction));
    Some((bench.shared(rig)?, [way(Direction::Deploy)?, way(Direction::Retract)?]))
}

/// A rig and its units.
struct Bench {
    formula: Formula,
    load_n: f64,
    longest_mm: f64,
    unit_n: f64,
}

impl Bench {
    fn shared(&self, rig: &Rig) -> Option<Shared> {
        let (f, kind) = (&self.formula, Kind { direction: Direction::Deploy, driven: true });
        let gap = |part: f64| f.gap_after_mm(part * self.longest_mm);
        let slope = |part: f64| f.contact(gap(part)).slope();
        let impact = &f.impact;
        let distance = |part: f64| f.free_run_mm() - part * self.longest_mm;
        let least = LEAST_RUN * f.radius_mm / self.longest_mm;
        let fitted = |of: &dyn Fn(f64) -> f64| quartic(least, of);
        let slopes = fitted(&slope)?;
        let load = self.load_n / self.unit_n;
        Some(Shared {
            parts_per_128_n: 128.0 / self.unit_n,
            unit_128_n: self.unit_n / 128.0,
            free: f.free_run_mm() / f.radius_mm,
            longest: self.longest_mm / f.radius_mm,
            least,
            inverse_longest_4: 0.25 * f.radius_mm / self.longest_mm,
            half_radius_16: 0.5 * f.radius_mm / 16.0,
            inverse_radius: 1.0 / f.radius_mm,
            load,
            least_lifting: load * slope(1.0).min(slope(least)),
            stress: 128.0 * impact.stress_per_speed * 1e-3 / 16.0,
            ramp: if impact.mode_rad_s > 0.0 {
                2.0 * 128.0 / (impact.mode_rad_s * self.longest_mm)
            } else {
                0.0
            },
            deflection: 1e3 * self.unit_n / impact.arm_n_per_mm / 4096.0,
            friction: rig.plant.mu,
            force: fitted(&|part| {
                f.relaxed_force_n(kind, gap(part)) * f.stiffening / (self.unit_n * part * part)
            })?,
            slope: slopes,
            cosine: fitted(&|part| 1.0 / (1.0 + slope(part) * slope(part)))?,
            gap: fitted(&|part| 2.0 * f.radius_mm * gap(part) / distance(part).powi(2))?,
        })
    }

    fn way(&self, kind: Kind) -> Option<Way> {
        let f = &self.formula;
        let folded = f.fold(kind, self.load_n);
        let part_of_excess = (f.stiffening - 1.0) / f.stiffening;
        let felt_at = |x: f64, part: f64| {
            part_of_excess * felt::value(&folded, x, part * self.longest_mm / f.radius_mm)
        };
        let grid: Vec<(f64, f64)> =
            nodes(GRID).flat_map(|x| nodes(GRID).map(move |part| (x, part))).collect();
        let felt_points = grid.iter().map(|&(x, part)| (x, part, felt_at(x, part), 1.0));
        // Elastic forces from what the domain's least force or the friction that rubber
        // holds leaves, to the unit's quarter, which the root can tell.
        let slope_after = |part: f64| f.contact(f.gap_after_mm(part * self.longest_mm)).slope();
        let least = LEAST_RUN * f.radius_mm / self.longest_mm;
        let least_slope = slope_after(least).min(slope_after(1.0));
        let load = self.load_n / self.unit_n;
        let steepest = f.contact(f.gap_after_mm(LEAST_RUN * f.radius_mm)).slope();
        let grip = (1.0 + steepest * steepest) / (MOST_UTILISATION - steepest);
        let least_root = 2.0 * ((self.load_n * grip).max(LEAST_ELASTIC_N) / self.unit_n).sqrt();
        let guess_points = grid.iter().filter_map(|&(x, part)| {
            let part = part.max(least);
            let gap = f.gap_after_mm(part * self.longest_mm);
            let stiffness = 1.0 / f.stiffening + x * felt_at(x, part);
            let elastic = f.relaxed_force_n(kind, gap) * f.stiffening * stiffness / self.unit_n;
            // The load's least part is taken off before the root; what its slope adds is not.
            let slope = f.contact(gap).slope();
            let root = 2.0 * (elastic + load * (slope - least_slope)).sqrt();
            (least_root..=1.0).contains(&root).then(|| (x, root, part / root, root / part))
        });
        Some(Way {
            half_speed: f.half_speed_mm_s(kind) / 128.0,
            relaxed: 1.0 / f.stiffening,
            felt: surface(&powers(felt::FAST_DEGREE, felt::RUN_DEGREE), felt_points)?,
            guess: surface(&powers(5, 5), guess_points)?,
        })
    }
}

/// Chebyshev's nodes from 0 to 1.
fn nodes(count: usize) -> impl Iterator<Item = f64> {
    let angle = move |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / count as f64;
    (0..count).map(move |k| 0.5 * (1.0 - angle(k).cos()))
}

/// Quartic in `2 part - 1` with the least error of `of` from `least` to 1.
fn quartic(least: f64, of: impl Fn(f64) -> f64) -> Option<[f64; 5]> {
    let parts: Vec<f64> = nodes(NODES).map(|node| least + (1.0 - least) * node).collect();
    let matrix =
        DMatrix::from_fn(NODES, 5, |row, power| (2.0 * parts[row] - 1.0).powi(power as i32));
    let right = DVector::from_fn(NODES, |row, _| of(parts[row]));
    let solution = matrix.svd(true, true).solve(&right, 1e-14).ok()?;
    Some(std::array::from_fn(|power| solution[power]))
}

/// Powers of two variables whose parts of the largest sum to one at most: by the second
/// and then the first.
fn powers(first: usize, second: usize) -> Vec<(i32, i32)> {
    let most = |j: usize| first * (second - j) / second;
    (0..=second).flat_map(|j| (0..=most(j)).map(move |i| (i as i32, j as i32))).collect()
}

/// Polynomial of these powers in two parts, each as `2 part - 1`. Points are both parts,
/// value, weight.
fn surface<const TERMS: usize>(
    powers: &[(i32, i32)],
    points: impl Iterator<Item = (f64, f64, f64, f64)>,
) -> Option<[f64; TERMS]> {
    let points: Vec<_> = points.collect();
    let matrix = DMatrix::from_fn(points.len(), TERMS, |row, term| {
        let ((x, y, _, weight), (i, j)) = (points[row], powers[term]);
        weight * (2.0 * x - 1.0).powi(i) * (2.0 * y - 1.0).powi(j)
    });
    let right = DVector::from_iterator(points.len(), points.iter().map(|p| p.2 * p.3));
    let solution = matrix.svd(true, true).solve(&right, 1e-14).ok()?;
    Some(std::array::from_fn(|term| solution[term]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_is_found_again() {
        let exact = |x: f64, y: f64| {
            let (u, t) = (2.0 * x - 1.0, 2.0 * y - 1.0);
            0.5 - 0.2 * u * t + 0.1 * t.powi(5) + 0.3 * u.powi(2) * t.powi(3)
        };
        let points = nodes(12).flat_map(|x| nodes(12).map(move |y| (x, y, exact(x, y), 1.0)));
        let found = surface::<21>(&powers(5, 5), points).unwrap();
        // By t and then u: 6 + 5 + 4 + 3 + 2 + 1.
        for (term, value) in [(0, 0.5), (7, -0.2), (20, 0.1), (17, 0.3), (3, 0.0)] {
            assert!((found[term] - value).abs() < 1e-12, "{term}: {found:?}");
        }
    }

    #[test]
    fn the_powers_are_those_of_the_model() {
        let found = powers(felt::FAST_DEGREE, felt::RUN_DEGREE);
        assert_eq!(found.len(), interstage_arith::FELT);
        assert!(found.contains(&(5, 0)) && found.contains(&(0, 6)) && !found.contains(&(1, 5)));
    }

    #[test]
    fn a_quartic_follows_what_is_smooth() {
        let of = |part: f64| (1.0 + part).exp();
        let found = quartic(0.01, of).unwrap();
        for part in [0.01, 0.2, 0.6, 1.0] {
            let value = found.iter().rev().fold(0.0, |sum, c| sum * (2.0 * part - 1.0) + c);
            assert!((value / of(part) - 1.0).abs() < 1e-4, "{part}");
        }
    }
}
