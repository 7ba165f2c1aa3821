//! Refined runs: how fast stride and step of time bring the plant to its limit.
//!
//! What is looked at are the work of a crossing and the height of lift-off of the ring,
//! over the stride, and the way of the rig, over the step of time. The ring is exact in
//! time for a depth that runs linearly, which leaves the second order; what a contact
//! that begins between two strides costs is of the first. Stated: first order at least.

use rayon::prelude::*;
use serde::Serialize;

use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::draw::PlantParameters;
use crate::plant::rig::{Drives, Resolution, VirtualRig};
use crate::plant::ring::RingParameters;
use crate::scenario::Scenario;

/// Least order by Richardson's quotient that still counts as the first.
const LEAST_ORDER: f64 = 0.8;

/// Differences below this part of the value are the ring's grain, and the ends of the way
/// over which work is summed, known to a stride.
const GRAIN: f64 = 5e-4;

/// A quantity on three resolutions, each half of the one before.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// What is refined and where.
    pub name: String,
    /// Its values, coarse to fine.
    pub values: [f64; 3],
    /// Order by Richardson's quotient; none where both differences are in the grain.
    pub order: Option<f64>,
    /// Whether it is of the stated order, or converged.
    pub holds: bool,
}

fn line(name: String, values: [f64; 3]) -> Line {
    let [coarse, middle, fine] = values;
    let (first, second) = ((middle - coarse).abs(), (fine - middle).abs());
    let grain = GRAIN * fine.abs();
    let order = (first > grain).then(|| (first / second.max(1e-300)).log2());
    // Written so that a NaN fails.
    let holds = second <= grain || order.is_some_and(|order| order >= LEAST_ORDER);
    Line { name, values, order, holds: holds && values.iter().all(|v| v.is_finite()) }
}

/// Ring and rig over a lattice of speeds, treads and preloads.
#[must_use]
pub fn run(quick: bool) -> Vec<Line> {
    let mut ring = Vec::new();
    let speeds: &[f64] = if quick { &[5.0] } else { &[5.0, -5.0, 60.0, -500.0, 2000.0] };
    for &speed in speeds {
        for (k_inf, stiffening, tau_s) in [(0.6, 4.2, 0.1), (0.06, 1.0, 1.0), (3.0, 20.0, 0.01)] {
            for preload in [15.0, 100.0] {
                ring.push((speed, k_inf, stiffening, tau_s, preload));
            }
        }
    }
    let crossed = |&(speed, k_inf, stiffening, tau_s, preload_n): &(f64, f64, f64, f64, f64)| {
        let at = |stride_mm| {
            let case = CrossingCase {
                ring: RingParameters {
                    radius_mm: 25.0,
                    width_mm: 28.0,
                    k_inf,
                    k_0: k_inf * stiffening,
                    tau_s,
                    elements: 11_520,
                },
                step_height_mm: 4.0,
                speed_mm_s: speed,
                preload_n,
                axial: Axial::Pushed,
                stride_mm,
            };
            cross(&case).map_or(f64::NAN, |crossed| crossed.climb_work_mj)
        };
        let name = format!(
            "work of a crossing over the stride: {speed} mm/s, {preload_n} N, {:.1e} Pa/m x {stiffening}, {tau_s} s",
            k_inf * 1e9
        );
        line(name, [at(0.16), at(0.08), at(0.04)])
    };
    let mut lines: Vec<Line> = ring.par_iter().map(crossed).collect();
    let speeds: &[f64] = if quick { &[30.0] } else { &[8.0, 30.0, 120.0] };
    lines.extend(
        speeds
            .par_iter()
            .map(|&speed| {
                let at = |dt_s| way(speed, dt_s).unwrap_or(f64::NAN);
                let name = format!("way of the rig over the step of time: {speed} mm/s");
                line(name, [at(4e-3), at(2e-3), at(1e-3)])
            })
            .collect::<Vec<_>>(),
    );
    lines
}

/// Where the rig stands 0.2 s after full duty for this speed, mm.
fn way(speed: f64, dt_s: f64) -> Option<f64> {
    let mut plant = PlantParameters::draw(&Scenario::default());
    plant.ripple.0 = 0.0;
    plant.drive.no_load_mm_s = 2.0 * speed;
    // The step of time alone: no stride cuts it.
    let whole = Resolution { stride_mm: 1e3, ..Resolution::default() };
    let mut rig = VirtualRig::new(plant, 0.0, 33.3, dt_s).with_resolution(whole);
    for _ in 0..(0.2 / dt_s).round() as usize {
        rig.step(&Drives { drive: 0.5, drive_on: true, ..Drives::default() }, dt_s).ok()?;
    }
    Some(rig.truth().position_mm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refined_runs_converge() {
        for line in run(true) {
            assert!(line.holds, "{line:?}");
        }
    }

    #[test]
    fn the_order_is_that_of_the_differences() {
        let second = line(String::new(), [1.16, 1.04, 1.01]);
        assert!(second.holds && (second.order.unwrap() - 2.0).abs() < 1e-9);
        assert!(!line(String::new(), [1.2, 1.1, 1.3]).holds);
        assert!(!line(String::new(), [1.0, f64::NAN, 1.0]).holds);
        assert!(line(String::new(), [1.0, 1.0, 1.0]).holds);
    }
}
