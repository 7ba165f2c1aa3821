//! Generates the constants of the reduced model from crossings of the ring.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use interstage::model::formula::Formula;
use interstage::rig::Rig;
use interstage::supervise::Direction;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::ring::RingParameters;

/// Entries of each generated table.
const ENTRIES: usize = 33;
/// Degree of the polynomial in z that is fitted before it is tabulated.
const DEGREE: usize = 7;

/// One crossing of the fit: Deborah number, stiffening felt, effective stiffness.
#[derive(Clone, Copy, Debug)]
struct Point {
    deborah: f64,
    felt: f64,
    stiffness: f64,
}

/// The generated source of `src/model/constants.rs`, and the largest and RMS
/// relative error of the effective stiffness over the crossings of each way.
///
/// # Errors
/// If a crossing cannot be balanced or the fit is singular.
pub fn generate(progress: &(dyn Fn() + Sync)) -> Result<(String, [(f64, f64); 2])> {
    let mut source = String::from(
        "//! Part of the stiffening that a crossing feels, in millionths, at equal steps of\n\
         //! z = De/(1 + De) from 0 to 1. Written by `cargo rig constants` from crossings of\n\
         //! the converged ring; do not edit.\n",
    );
    let mut errors = [(0.0, 0.0); 2];
    for (slot, direction, name, doc) in [
        (0, Direction::Deploy, "DEPLOY", "Way out: the wheel climbs."),
        (1, Direction::Retract, "RETRACT", "Way back: the wheel drops off."),
    ] {
        let points = points(direction, progress)?;
        let (table, error) = fit(&points).context("stiffening fit is singular")?;
        errors[slot] = error;
        let _ =
            write!(source, "\n/// {doc}\n#[rustfmt::skip]\npub const {name}: [i32; {ENTRIES}] = [");
        for (index, value) in table.iter().enumerate() {
            let _ = write!(source, "{}{value},", if index % 8 == 0 { "\n    " } else { " " });
        }
        source.push_str("\n];\n");
    }
    Ok((source, errors))
}

/// Crossings of both ways that [`generate`] runs, for a progress bar.
#[must_use]
pub fn crossings() -> usize {
    2 * cases().len()
}

/// Speeds, forces and loads of the fit: the published step height, the range of
/// both rigs; a load of `None` is the frictionless wheel.
fn cases() -> Vec<(f64, f64, Option<f64>)> {
    let mut cases = Vec::new();
    for speed in [1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 16.0, 22.0, 30.0, 45.0, 70.0, 100.0] {
        for force in [25.0, 33.3, 40.0, 50.0, 62.0, 75.0, 100.0, 150.0] {
            for load in [None, Some(0.0), Some(6.7), Some(20.0)] {
                // Above a utilisation of about 1.5 no rubber holds.
                if load.is_none_or(|l| force >= 3.6 * l) {
                    cases.push((speed, force, load));
                }
            }
        }
    }
    cases
}

fn points(direction: Direction, progress: &(dyn Fn() + Sync)) -> Result<Vec<Point>> {
    let rig = Rig::fe();
    let formula = Formula::new(&rig);
    let ring = RingParameters::of(&rig, 2880);
    cases()
        .into_par_iter()
        // The rig never goes back without its load.
        .filter(|case| direction == Direction::Deploy || case.2.is_some())
        .map(|(speed, force, load)| {
            let result = cross(&CrossingCase {
                ring,
                step_height_mm: formula.step_mm,
                speed_mm_s: speed * f64::from(direction.sign()),
                preload_n: force,
                axial: load.map_or(Axial::Pushed, Axial::Driven),
                stride_mm: 0.01,
            })?;
            progress();
            let contact = formula.contact(result.gap_mm);
            let slope = contact.axial / contact.radial;
            let stiffness = match load {
                None => force / contact.radial,
                Some(l) => (force - l * slope) / (contact.radial + slope * contact.axial),
            } / formula.k_inf;
            Ok(Point {
                deborah: speed * formula.deborah_per_speed(direction, result.gap_mm),
                felt: (stiffness - 1.0) / (formula.stiffening - 1.0),
                stiffness,
            })
        })
        .collect()
}

/// Least squares of the relative stiffness error by a polynomial in z without
/// constant term, tabulated in millionths.
fn fit(points: &[Point]) -> Option<([i32; ENTRIES], (f64, f64))> {
    let z = |deborah: f64| deborah / (1.0 + deborah);
    let rows = points.len();
    let matrix = DMatrix::from_fn(rows, DEGREE, |r, c| {
        z(points[r].deborah).powi(c as i32 + 1) / points[r].stiffness
    });
    let right = DVector::from_fn(rows, |r, _| points[r].felt / points[r].stiffness);
    let solution = matrix.svd(true, true).solve(&right, 1e-12).ok()?;
    let value = |x: f64| solution.iter().rev().fold(0.0, |sum, c| (sum + c) * x);
    let mut table = [0; ENTRIES];
    for (index, entry) in table.iter_mut().enumerate() {
        let x = index as f64 / (ENTRIES - 1) as f64;
        *entry = (value(x) * 1e6).round() as i32;
    }
    // Beyond the data, at the end of z, the polynomial bends down: stiffening does not.
    for index in ENTRIES / 2..ENTRIES {
        table[index] = table[index].max(table[index - 1]);
    }
    let excess = Formula::new(&Rig::fe()).stiffening - 1.0;
    let errors =
        points.iter().map(|p| ((value(z(p.deborah)) - p.felt) * excess / p.stiffness).abs());
    let worst = errors.clone().fold(0.0, f64::max);
    let rms = (errors.map(|e| e * e).sum::<f64>() / rows as f64).sqrt();
    Some((table, (worst, rms)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a known law of z, with the stiffness that it gives.
    fn on(law: impl Fn(f64) -> f64) -> Vec<Point> {
        let excess = Formula::new(&Rig::fe()).stiffening - 1.0;
        (1..200)
            .map(|i| {
                let deborah = 0.05 * f64::from(i);
                let felt = law(deborah / (1.0 + deborah));
                Point { deborah, felt, stiffness: 1.0 + excess * felt }
            })
            .collect()
    }

    #[test]
    fn a_polynomial_is_found_again() {
        let law = |z: f64| z * (0.4 + z * (0.9 - 0.3 * z));
        let (table, (worst, rms)) = fit(&on(law)).unwrap();
        assert!(worst < 1e-9 && rms <= worst, "{worst} {rms}");
        for (index, value) in table.into_iter().enumerate() {
            let exact = law(index as f64 / (ENTRIES - 1) as f64) * 1e6;
            assert!((f64::from(value) - exact).abs() <= 0.51, "{index}: {value} {exact}");
        }
    }

    #[test]
    fn what_bends_down_beyond_the_data_is_held() {
        let (table, _) = fit(&on(|z| z * (2.0 - z * z))).unwrap();
        assert_eq!(table[0], 0);
        assert!(table[ENTRIES / 2..].windows(2).all(|pair| pair[1] >= pair[0]), "{table:?}");
    }

    #[test]
    fn the_error_is_that_of_the_stiffness() {
        let mut points = on(|z| z);
        points[60].felt += 0.01;
        let excess = Formula::new(&Rig::fe()).stiffening - 1.0;
        let (_, (worst, _)) = fit(&points).unwrap();
        let expected = 0.01 * excess / points[60].stiffness;
        assert!((worst / expected - 1.0).abs() < 0.2, "{worst} {expected}");
    }

    #[test]
    fn the_fit_covers_both_rigs_and_what_rubber_holds() {
        let cases = cases();
        assert_eq!(crossings(), 2 * cases.len());
        for rig in [Rig::prototype(), Rig::fe()] {
            let load = rig.plant.top_load_n * rig.plant.top_load_share;
            let speeds = [rig.drive.min_crossing_speed_mm_s, rig.drive.cruise_speed_mm_s];
            let forces = [rig.preload.cruise_n, rig.preload.limit_n];
            for (value, of) in speeds.map(|s| (s, 0)).into_iter().chain(forces.map(|f| (f, 1))) {
                let found = cases.iter().map(|case| if of == 0 { case.0 } else { case.1 });
                let (least, most) =
                    found.fold((f64::MAX, 0.0f64), |(a, b), x| (a.min(x), b.max(x)));
                assert!((least..=most).contains(&value), "{value} outside {least} to {most}");
            }
            assert!(cases.iter().any(|case| case.2.is_some_and(|l| (l - load).abs() < 0.1)));
        }
        assert!(cases.iter().all(|&(_, force, load)| load.is_none_or(|l| l <= force / 3.6)));
    }
}
