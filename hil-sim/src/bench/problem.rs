//! The crossings that resolutions, solvers and engines are compared on, and their
//! converged answers.

use interstage::rig::Rig;
use rayon::prelude::*;

use crate::plant::balance::{Axial, BalanceError};
use crate::plant::crossing::{CrossingCase, CrossingResult, cross};
use crate::plant::draw::ELEMENTS;
use crate::plant::rig::Resolution;
use crate::plant::ring::RingParameters;

/// How much finer than the default the converged run is, in elements and in stride.
pub const FINER: usize = 20;

/// Elements around the ring and axial way per step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Elements around the ring.
    pub elements: usize,
    /// Axial way per step, mm.
    pub stride_mm: f64,
}

impl Mesh {
    /// What the plant runs with unless told otherwise.
    #[must_use]
    pub fn usual() -> Self {
        Self { elements: ELEMENTS, stride_mm: Resolution::default().stride_mm }
    }

    /// That many times as fine.
    #[must_use]
    pub fn finer(self, times: usize) -> Self {
        Self { elements: self.elements * times, stride_mm: self.stride_mm / times as f64 }
    }

    /// The same with other element counts nearby: where the elements stand when the
    /// lower wall stops carrying is luck, and differs by about a third of their pitch
    /// from one to the next.
    #[must_use]
    pub fn lucks(self) -> [Self; 3] {
        [self.elements - 3, self.elements, self.elements + 3]
            .map(|elements| Self { elements, ..self })
    }
}

/// One crossing, apart from how finely it is computed.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    /// Wheel and rubber; its element count is set by the mesh.
    pub ring: RingParameters,
    /// Height of the step, mm.
    pub step_height_mm: f64,
    /// Axial speed, mm/s; negative retracts.
    pub speed_mm_s: f64,
    /// Radial preload, N.
    pub preload_n: f64,
    /// How the wheel is moved.
    pub axial: Axial,
}

impl Problem {
    /// The one that engines and solvers are compared on: the published case of 5 mm/s
    /// under 100 N, frictionless and quasi-static.
    #[must_use]
    pub fn published() -> Self {
        Self::of(&Rig::fe(), 5.0, 100.0, Axial::Pushed)
    }

    /// What the plant's resolution has to hold on: the published case, a driven
    /// crossing of the prototype and its way back, and a fast one.
    #[must_use]
    pub fn all() -> [Self; 4] {
        let rig = Rig::prototype();
        let load = Axial::Driven(rig.plant.top_load_n * rig.plant.top_load_share);
        [
            Self::published(),
            Self::of(&rig, 8.0, 48.0, load),
            Self::of(&rig, -8.0, 48.0, load),
            Self::of(&rig, 30.0, 50.0, Axial::Pushed),
        ]
    }

    fn of(rig: &Rig, speed_mm_s: f64, preload_n: f64, axial: Axial) -> Self {
        let ring = RingParameters::of(rig, ELEMENTS);
        Self { ring, step_height_mm: rig.rig.step_height_mm, speed_mm_s, preload_n, axial }
    }

    /// The same at another preload.
    #[must_use]
    pub fn under(self, preload_n: f64) -> Self {
        Self { preload_n, ..self }
    }

    /// The crossing at this resolution.
    #[must_use]
    pub fn case(&self, mesh: Mesh) -> CrossingCase {
        CrossingCase {
            ring: RingParameters { elements: mesh.elements, ..self.ring },
            step_height_mm: self.step_height_mm,
            speed_mm_s: self.speed_mm_s,
            preload_n: self.preload_n,
            axial: self.axial,
            stride_mm: mesh.stride_mm,
        }
    }

    /// Gap and force of the converged ring: this many times finer than the default.
    ///
    /// # Errors
    /// [`BalanceError`] if no height of the centre balances the preload.
    pub fn converged(&self, finer: usize) -> Result<Truth, BalanceError> {
        let at = |times| cross(&self.case(Mesh::usual().finer(times))).map(Figures::from);
        let (half, full) = rayon::join(|| at(finer / 2), || at(finer));
        let (half, full) = (half?, full?);
        let doubt = half.errors(&full);
        Ok(Truth { figures: full, doubt: doubt.0.max(doubt.1) })
    }
}

/// The converged answers of some problems.
///
/// # Errors
/// [`BalanceError`] if no height of the centre balances a preload.
pub fn converged(problems: &[Problem], finer: usize) -> Result<Vec<Truth>, BalanceError> {
    problems.par_iter().map(|problem| problem.converged(finer)).collect()
}

/// What is compared of a crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Gap, mm.
    pub gap_mm: f64,
    /// Largest axial force, N.
    pub force_n: f64,
}

impl From<CrossingResult> for Figures {
    fn from(result: CrossingResult) -> Self {
        Self { gap_mm: result.gap_mm, force_n: result.corner_force_n }
    }
}

impl Figures {
    /// Relative errors of gap and force against `truth`.
    #[must_use]
    pub fn errors(&self, truth: &Self) -> (f64, f64) {
        let off = |a: f64, b: f64| (a / b - 1.0).abs();
        (off(self.gap_mm, truth.gap_mm), off(self.force_n, truth.force_n))
    }
}

/// A converged answer and how much it may itself be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Gap and force.
    pub figures: Figures,
    /// Largest relative difference of both from those at half that.
    pub doubt: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_relative_and_unsigned() {
        let truth = Figures { gap_mm: 2.0, force_n: 50.0 };
        let (gap, force) = Figures { gap_mm: 1.9, force_n: 51.0 }.errors(&truth);
        assert!((gap - 0.05).abs() < 1e-12 && (force - 0.02).abs() < 1e-12);
    }

    #[test]
    fn a_finer_mesh_is_finer_both_ways() {
        let mesh = Mesh { elements: 100, stride_mm: 0.1 }.finer(4);
        assert_eq!(mesh, Mesh { elements: 400, stride_mm: 0.025 });
    }

    #[test]
    fn the_problems_cover_both_ways_with_and_without_friction() {
        let problems = Problem::all();
        assert!(problems.iter().any(|p| p.speed_mm_s < 0.0));
        assert!(problems.iter().any(|p| p.axial == Axial::Pushed));
        assert!(problems.iter().any(|p| matches!(p.axial, Axial::Driven(load) if load > 5.0)));
    }
}
