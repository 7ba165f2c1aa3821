//! Coefficients for `interstage-arith`: the polynomials of the shipping model, fitted
//! from the formulas in f64.

use interstage::model::effective_stiffness::{self, FORCE_END, Kind};
use interstage::model::formula::{Formula, LEAST_RUN};
use interstage::rig::Rig;
use interstage::units::Direction;
use interstage_arith::{CELL, FAST_CELLS, FORCE_CELLS, Shared, Way};
use nalgebra::{DMatrix, DVector};

/// Most friction of the points compared.
pub(super) const MOST_UTILISATION: f64 = 1.7;

/// Largest force of a guess's fit over k_inf R^2 L, and weight of the points beyond it, as
/// the shipping one.
const FORCE_OF_USE: f64 = 0.0151;
const TAME: f64 = 1e-2;

/// Runs and fast parts of a cell that its guess is fitted at.
const RUNS: usize = 300;
const FAST_NODES: usize = 8;

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
        unit_n: (FORCE_END * formula.unit_force_n() * formula.stiffening).log2().ceil().exp2(),
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
        let least = LEAST_RUN * f.radius_mm / self.longest_mm;
        let load = self.load_n / self.unit_n;
        Some(Shared {
            parts_per_256_n: 256.0 / self.unit_n,
            unit_256_n: self.unit_n / 256.0,
            free: f.free_run_mm() / f.radius_mm,
            least,
            inverse_longest_4: 0.25 * f.radius_mm / self.longest_mm,
            inverse_radius: 1.0 / f.radius_mm,
            load,
            most_lifting: load * slope(least),
            stress: 128.0 * impact.stress_per_speed * 1e-3 / 16.0,
            ramp: if impact.mode_rad_s > 0.0 {
                2.0 * 128.0 / (impact.mode_rad_s * self.longest_mm)
            } else {
                0.0
            },
            deflection: 1e3 * self.unit_n / impact.arm_n_per_mm / 4096.0,
            friction: rig.plant.mu,
            force: polynomial(least, |part| {
                f.relaxed_force_n(kind, gap(part)) * f.stiffening / (self.unit_n * part * part)
            })?,
            slope: polynomial(least, slope)?,
            cosine: polynomial(least, |part| 1.0 / (1.0 + slope(part) * slope(part)))?,
            gap: polynomial(least, |part| gap(part) / 16.0)?,
        })
    }

    fn way(&self, kind: Kind) -> Option<Way> {
        let f = &self.formula;
        let folded = f.fold(kind, self.load_n);
        let part_of_excess = (f.stiffening - 1.0) / f.stiffening;
        let felt_at = |x: f64, part: f64| {
            part_of_excess
                * effective_stiffness::value(&folded, x, part * self.longest_mm / f.radius_mm)
        };
        let grid: Vec<(f64, f64)> =
            nodes(GRID).flat_map(|x| nodes(GRID).map(move |part| (x, part))).collect();
        let felt_points = grid.iter().map(|&(x, part)| (x, part, felt_at(x, part), 1.0));
        Some(Way {
            half_speed: f.half_speed_mm_s(kind) / 128.0,
            relaxed: 1.0 / f.stiffening,
            felt: surface(
                &powers(effective_stiffness::FAST_DEGREE, effective_stiffness::RUN_DEGREE),
                felt_points,
            )?,
            guess: self.guess(kind, &felt_at)?,
        })
    }
}

impl Bench {
    /// The guess of the run in each cell.
    fn guess(&self, kind: Kind, felt_at: &dyn Fn(f64, f64) -> f64) -> Option<Guess> {
        const POWERS: [(i32, i32); CELL] =
            [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (2, 2)];
        let f = &self.formula;
        let load = self.load_n / self.unit_n;
        let slope_after = |part: f64| f.contact(f.gap_after_mm(part * self.longest_mm)).slope();
        let most_lifting = load * slope_after(LEAST_RUN * f.radius_mm / self.longest_mm);
        let most_of_use = FORCE_OF_USE * f.unit_force_n() / self.unit_n;
        let mut guess = [[[0.0; CELL]; FORCE_CELLS]; FAST_CELLS];
        for (column, cells) in guess.iter_mut().enumerate() {
            let mut points = vec![Vec::new(); FORCE_CELLS];
            for node in nodes(FAST_NODES) {
                let x = (column as f64 + node) / FAST_CELLS as f64;
                let mut add = |excess: f64, part: f64, weight: f64| {
                    let octave = excess.log2().floor();
                    let mantissa = excess / octave.exp2();
                    let half = f64::from(mantissa >= 1.5);
                    let row = 2.0 * (octave + 7.0) + half;
                    if (0.0..FORCE_CELLS as f64).contains(&row) {
                        let m = 2.0 * (mantissa - 1.0) - half;
                        points[row as usize].push((node, m, part, weight / part));
                    }
                };
                let ratio = (1.03_f64 / 0.03).powf(1.0 / (RUNS - 1) as f64);
                let (mut part, mut most) = (0.03, 0.0);
                for _ in 0..RUNS {
                    let gap = f.gap_after_mm(part * self.longest_mm);
                    let stiffness = 1.0 / f.stiffening + x * felt_at(x, part);
                    let elastic = f.relaxed_force_n(kind, gap) * f.stiffening * stiffness;
                    let sought = elastic / self.unit_n + load * slope_after(part);
                    let excess = sought - most_lifting;
                    if excess > most {
                        add(excess, part, if sought < most_of_use { 1.0 } else { TAME });
                        most = excess;
                    } else if most > 0.0 {
                        // Beyond it the force falls again.
                        break;
                    }
                    part *= ratio;
                }
                // On as the root of the force, so that every cell is tame.
                while most > 0.0 && most < 0.25 {
                    most *= ratio * ratio;
                    add(most, part, TAME);
                    part *= ratio;
                }
            }
            for (cell, points) in cells.iter_mut().zip(points) {
                *cell = surface(&POWERS, points.into_iter())?;
            }
        }
        Some(guess)
    }
}

type Guess = [[[f64; CELL]; FORCE_CELLS]; FAST_CELLS];

/// Chebyshev's nodes from 0 to 1.
fn nodes(count: usize) -> impl Iterator<Item = f64> {
    let angle = move |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / count as f64;
    (0..count).map(move |k| 0.5 * (1.0 - angle(k).cos()))
}

/// Polynomial in `2 part - 1` with the least error of `of` from `least` to 1.
fn polynomial<const TERMS: usize>(least: f64, of: impl Fn(f64) -> f64) -> Option<[f64; TERMS]> {
    let parts: Vec<f64> = nodes(NODES).map(|node| least + (1.0 - least) * node).collect();
    let matrix =
        DMatrix::from_fn(NODES, TERMS, |row, power| (2.0 * parts[row] - 1.0).powi(power as i32));
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
        let found = powers(effective_stiffness::FAST_DEGREE, effective_stiffness::RUN_DEGREE);
        assert_eq!(found.len(), interstage_arith::FELT);
        assert!(found.contains(&(5, 0)) && found.contains(&(0, 6)) && !found.contains(&(1, 5)));
    }

    #[test]
    fn a_polynomial_follows_what_is_smooth() {
        let of = |part: f64| (1.0 + part).exp();
        let found: [f64; 5] = polynomial(0.01, of).unwrap();
        for part in [0.01, 0.2, 0.6, 1.0] {
            let value = found.iter().rev().fold(0.0, |sum, c| sum * (2.0 * part - 1.0) + c);
            assert!((value / of(part) - 1.0).abs() < 1e-4, "{part}");
        }
    }
}
