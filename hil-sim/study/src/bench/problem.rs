//! The one crossing that engines and solvers are compared on, and its converged answer.

use interstage::rig::Rig;

use hil_sim::plant::balance::{Axial, BalanceError};
use hil_sim::plant::crossing::{CrossingCase, CrossingResult, cross};
use hil_sim::plant::precision::{FINER, Setting};
use hil_sim::plant::ring::RingParameters;

/// One crossing, apart from how finely it is computed.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    /// Wheel and rubber; its element count is set by the setting.
    pub ring: RingParameters,
    /// Height of the step, mm.
    pub step_height_mm: f64,
    /// Axial speed, mm/s.
    pub speed_mm_s: f64,
    /// Radial preload, N.
    pub preload_n: f64,
}

impl Problem {
    /// The published case of 5 mm/s under 100 N, frictionless and quasi-static.
    #[must_use]
    pub fn published() -> Self {
        let rig = Rig::fe();
        Self {
            ring: RingParameters::of(&rig, Setting::usual().elements),
            step_height_mm: rig.rig.step_height_mm,
            speed_mm_s: 5.0,
            preload_n: 100.0,
        }
    }

    /// The same at another preload.
    #[must_use]
    pub fn under(self, preload_n: f64) -> Self {
        Self { preload_n, ..self }
    }

    /// The crossing at this setting.
    #[must_use]
    pub fn case(&self, setting: Setting) -> CrossingCase {
        CrossingCase {
            ring: RingParameters { elements: setting.elements, ..self.ring },
            step_height_mm: self.step_height_mm,
            speed_mm_s: self.speed_mm_s,
            preload_n: self.preload_n,
            axial: Axial::Pushed,
            stride_mm: setting.stride_mm,
        }
    }

    /// Gap and force of the converged ring: finer than the usual setting as the plant's
    /// own precision is measured.
    ///
    /// # Errors
    /// [`BalanceError`] if no height of the centre balances the preload.
    pub fn converged(&self) -> Result<Truth, BalanceError> {
        let at = |times| cross(&self.case(Setting::usual().finer(times))).map(Figures::from);
        let (half, full) = rayon::join(|| at(FINER / 2), || at(FINER));
        let (half, full) = (half?, full?);
        let doubt = half.errors(&full);
        Ok(Truth { figures: full, doubt: doubt.0.max(doubt.1) })
    }
}

/// The same setting with other element counts nearby: where the elements stand when the
/// lower wall stops carrying is luck, and differs by about a third of their pitch from one
/// to the next.
#[must_use]
pub fn lucks(setting: Setting) -> [Setting; 3] {
    [setting.elements - 3, setting.elements, setting.elements + 3]
        .map(|elements| Setting { elements, ..setting })
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
    /// Largest relative difference of both from those at half the resolution.
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
    fn the_crossing_is_the_one_that_the_rubber_was_fitted_to() {
        let fine = Setting { elements: 2880, stride_mm: 0.02 };
        let found = Figures::from(cross(&Problem::published().case(fine)).unwrap());
        assert!((found.gap_mm - 1.744).abs() < 0.002, "{found:?}");
        assert!((found.force_n - 53.72).abs() < 0.05, "{found:?}");
    }
}
