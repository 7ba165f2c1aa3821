//! Work and precision of the ring: elements and stride against the errors of gap and
//! force on the converged run.

use std::time::Duration;

use serde::Serialize;

use super::clock::{Effort, least};
use super::problem::{Figures, Mesh, Problem, Truth};
use crate::plant::balance::BalanceError;
use crate::plant::crossing::cross;

/// What a resolution costs and how far off it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Precision {
    /// Which sweep it belongs to.
    pub sweep: &'static str,
    /// Elements around the ring.
    pub elements: usize,
    /// Axial way per step, mm.
    pub stride_mm: f64,
    /// Whether the plant runs with it unless told otherwise.
    pub default: bool,
    /// Largest relative error of the gap, over the crossings and the luck of where the
    /// elements stand.
    pub max_gap_error: f64,
    /// Largest relative error of the force.
    pub max_force_error: f64,
    /// Processor time of a crossing, mean over the crossings, ms.
    pub crossing_ms: f64,
}

/// The default resolution and one much coarser.
#[must_use]
pub fn few() -> Vec<(&'static str, Mesh)> {
    let usual = Mesh::usual();
    let coarse = Mesh { elements: usual.elements / 4, stride_mm: 4.0 * usual.stride_mm };
    vec![("both", coarse), ("both", usual)]
}

/// Resolutions of the sweeps: both together, elements alone, stride alone.
#[must_use]
pub fn meshes() -> Vec<(&'static str, Mesh)> {
    let usual = Mesh::usual();
    let by = |factor: f64| {
        let elements = (usual.elements as f64 * factor).round() as usize;
        Mesh { elements, stride_mm: usual.stride_mm / factor }
    };
    let factors = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0];
    let mut meshes = Vec::new();
    for factor in factors {
        meshes.push(("both", by(factor)));
    }
    for factor in factors.into_iter().filter(|&factor| factor != 1.0) {
        meshes.push(("elements", Mesh { stride_mm: usual.stride_mm, ..by(factor) }));
    }
    for factor in factors.into_iter().filter(|&factor| factor != 1.0) {
        meshes.push(("stride", Mesh { elements: usual.elements, ..by(factor) }));
    }
    meshes
}

/// Measures one resolution on `problems` with their converged answers.
///
/// # Errors
/// [`BalanceError`] if no height of the centre balances a preload.
pub fn measure(
    sweep: &'static str,
    mesh: Mesh,
    problems: &[Problem],
    truths: &[Truth],
) -> Result<Precision, BalanceError> {
    let effort = Effort { repeats: 5, within: Duration::from_millis(100) };
    let (mut gap, mut force, mut seconds) = (0.0_f64, 0.0_f64, 0.0);
    for (problem, truth) in problems.iter().zip(truths) {
        let timed = least(effort, || problem.case(mesh), |case| cross(&case));
        seconds += timed.seconds;
        let mut found = vec![Figures::from(timed.answer?)];
        for other in mesh.lucks() {
            found.push(cross(&problem.case(other))?.into());
        }
        for figures in found {
            let errors = figures.errors(&truth.figures);
            (gap, force) = (gap.max(errors.0), force.max(errors.1));
        }
    }
    Ok(Precision {
        sweep,
        elements: mesh.elements,
        stride_mm: mesh.stride_mm,
        default: mesh == Mesh::usual(),
        max_gap_error: gap,
        max_force_error: force,
        crossing_ms: 1e3 * seconds / problems.len() as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_among_the_meshes_once() {
        for meshes in [meshes(), few()] {
            let usual = meshes.into_iter().filter(|&(_, mesh)| mesh == Mesh::usual());
            assert_eq!(usual.count(), 1);
        }
    }

    #[test]
    fn a_coarse_ring_is_worse_than_a_fine_one() {
        let problem = Problem::published();
        let fine = Mesh { elements: 2880, stride_mm: 0.01 };
        let figures = Figures::from(cross(&problem.case(fine)).unwrap());
        let truth = Truth { figures, doubt: 0.0 };
        let of = |elements, stride_mm| {
            measure("both", Mesh { elements, stride_mm }, &[problem], &[truth]).unwrap()
        };
        let (coarse, middle) = (of(180, 0.3), of(1440, 0.02));
        assert!(coarse.max_gap_error > 2.0 * middle.max_gap_error, "{coarse:?} {middle:?}");
        assert!(coarse.max_force_error > 2.0 * middle.max_force_error, "{coarse:?} {middle:?}");
        assert!(coarse.crossing_ms < middle.crossing_ms);
    }
}
