//! Mode shapes from the waves of a root (55), in a form in which nothing grows.
//!
//! As printed, (55) carries both waves with `f(x)`; the one from end B must be carried
//! with `f(-x)`, whose evanescent part grows. Counted from end B instead, where that
//! wave starts, it falls like the other: `xi^-(x) = f(L - x) eta_B^-`.

use nalgebra::{Complex, Vector2};

use super::waves::{Load, Transfer, propagation};
use super::{Beam, BeamError, Ends, Mode, Tip};

/// Pieces of Simpson's rule for the modal mass.
const PIECES: usize = 4096;

/// One mode's shape, of unit modal mass and with its tip on the positive side.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape {
    pub mode: Mode,
    length_m: f64,
    /// Wave leaving end A, wave leaving end B.
    from_a: Vector2<Complex<f64>>,
    from_b: Vector2<Complex<f64>>,
}

impl Shape {
    /// Deflection at `x_m` from end A, 1/sqrt(kg).
    ///
    /// Equation: `W(x) = [1 1] f(x) xi_A^+ + [1 1] f(L - x) eta_B^-` (55).
    /// Range: 0 to the length. Error: 1e-8 of the largest deflection while
    /// `beta_l > 0.1`; a soft spring's rigid mode below that cancels the more.
    pub(crate) fn at(&self, x_m: f64) -> f64 {
        self.waves(x_m / self.length_m).re
    }

    /// Both waves at this part of the length.
    fn waves(&self, part: f64) -> Complex<f64> {
        let beta_l = self.mode.beta_l;
        let waves = propagation(beta_l * part) * self.from_a
            + propagation(beta_l * (1.0 - part)) * self.from_b;
        waves.sum()
    }

    /// Deflection at end B, 1/sqrt(kg).
    pub(crate) fn tip(&self) -> f64 {
        self.at(self.length_m)
    }

    fn scale(&mut self, factor: Complex<f64>) {
        self.from_a *= factor;
        self.from_b *= factor;
    }
}

impl Beam {
    /// Shapes of the first `count` natural modes.
    ///
    /// Equation: `xi_A^+` is what `R_A f R_B f` leaves as it is (53),
    /// `eta_B^- = R_B f xi_A^+`; scaled to `int rho A W^2 dx + m W(L)^2 = 1`.
    pub(crate) fn shapes(
        &self,
        ends: Ends,
        tip: Tip,
        count: usize,
    ) -> Result<Vec<Shape>, BeamError> {
        let modes = self.modes(ends, tip, count)?;
        let (mass, spring) = self.ratios(tip)?;
        let end_a = ends.end_a().reflection();
        let shapes = modes.into_iter().map(|mode| {
            let f = propagation(mode.beta_l);
            let back = Load::mass_and_spring(mass, spring, mode.beta_l).reflection() * f;
            let from_a = kept(&(end_a * f * back));
            let mut shape = Shape { mode, length_m: self.length_m, from_a, from_b: back * from_a };
            self.normalise(&mut shape, tip.mass_kg);
            shape
        });
        Ok(shapes.collect())
    }

    /// Turns the shape real, to unit modal mass, its tip positive.
    fn normalise(&self, shape: &mut Shape, tip_mass_kg: f64) {
        // The phase is the same everywhere; seen best where the deflection is largest.
        let parts = (0..=200).map(|i| shape.waves(f64::from(i) / 200.0));
        let largest =
            parts.fold(Complex::new(0.0, 0.0), |a, b| if b.norm() > a.norm() { b } else { a });
        shape.scale(largest.conj() / largest.norm_sqr());
        let h = self.length_m / PIECES as f64;
        let square = |i: usize| shape.at(h * i as f64).powi(2);
        let odd: f64 = (1..PIECES).step_by(2).map(square).sum();
        let even: f64 = (2..PIECES).step_by(2).map(square).sum();
        let integral = (square(0) + square(PIECES) + 4.0 * odd + 2.0 * even) * h / 3.0;
        let mass = self.mass_kg() / self.length_m * integral + tip_mass_kg * square(PIECES);
        let sign = if shape.tip() < 0.0 { -1.0 } else { 1.0 };
        shape.scale(Complex::from(sign / mass.sqrt()));
    }
}

/// The vector that `matrix` leaves as it is, one of its eigenvalues being 1.
fn kept(matrix: &Transfer) -> Vector2<Complex<f64>> {
    let m = matrix - Transfer::identity();
    // Orthogonal to the larger of the two rows, which are parallel.
    let row = if m.row(0).norm() >= m.row(1).norm() { 0 } else { 1 };
    let vector = Vector2::new(-m[(row, 1)], m[(row, 0)]);
    vector / Complex::from(vector.norm())
}
