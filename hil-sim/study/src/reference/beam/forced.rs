//! Forced response by waves: what a normalised mode, as (56) has it, cannot give.
//!
//! A force at x_f sends waves both ways (50, 51). What returns to it from either side has
//! run there and back once, `S_A = f(x_f) R_A f(x_f)`, `S_B = f(L-x_f) R_B f(L-x_f)`, so
//! that all round trips sum to `xi^- = (I - S_B S_A)^-1 [S_B (q + m) + q - m]`,
//! `xi^+ = S_A xi^-` (B. R. Mace, J. Sound Vib. 97 (1984) 237-246).

use nalgebra::{Complex, Vector2};

use super::waves::Transfer;
use super::{Beam, BeamError, Ends, Tip, require};

type Waves = Vector2<Complex<f64>>;

/// A force on the beam, and how fast and in what material it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forcing {
    /// Where it acts, m from end A.
    pub at_m: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Loss factor of the beam's modulus, `E (1 + i eta)`.
    pub loss_factor: f64,
}

impl Beam {
    /// Deflection at `seen_m` per force, m/N, for a force `e^{i omega t}`.
    ///
    /// Equation: as the module says, with `k = (omega^2 rho A/(E I))^(1/4)` and the mass
    /// and spring of end B in R_B; `W = [1 1] (waves running either way)`, each counted from
    /// where it starts, so that nothing grows.
    /// Sign: along the force; behind it where losses delay it. Units: m/N.
    /// Range: frequency above 0, loss factor 0 to 1, both places on the beam.
    /// Error: 1e-9, relative, away from a lossless resonance, while `k L > 0.1`.
    /// Cost: some ten products of 2 x 2 complex matrices.
    ///
    /// # Errors
    /// [`BeamError::OutOfRange`] names the argument that is not in its range.
    pub fn receptance(
        &self,
        ends: Ends,
        tip: Tip,
        forcing: Forcing,
        seen_m: f64,
    ) -> Result<Complex<f64>, BeamError> {
        self.check()?;
        let (mass, spring) = self.ratios(tip)?;
        let Forcing { at_m, frequency_hz, loss_factor } = forcing;
        let on_beam = |x: f64| (0.0..=self.length_m).contains(&x);
        require("at_m", at_m, on_beam(at_m), || format!("0 to {} m", self.length_m))?;
        require("seen_m", seen_m, on_beam(seen_m), || format!("0 to {} m", self.length_m))?;
        let positive = frequency_hz.is_finite() && frequency_hz > 0.0;
        require("frequency_hz", frequency_hz, positive, || "a finite number above 0".into())?;
        require("loss_factor", loss_factor, (0.0..=1.0).contains(&loss_factor), || {
            "0 to 1".into()
        })?;
        // Lengths in beam lengths, stiffness in EI/L^3 of the lossless beam.
        let scale_hz = self.frequency_scale_hz();
        let stiffness = Complex::new(1.0, loss_factor);
        let square = (frequency_hz / scale_hz).powi(2);
        let k = (Complex::from(square) / stiffness).powf(0.25);
        let z = (Complex::from(spring) - mass * square) / (stiffness * k.powi(3));
        let (from, to) = (at_m / self.length_m, seen_m / self.length_m);
        let f = |way: f64| carried(k, way);
        let (end_a, end_b) = (ends.end_a().reflection(), loaded(z));
        let (before, behind) = (f(from), f(1.0 - from));
        let (back_a, back_b) = (before * end_a * before, behind * end_b * behind);
        let q = sent(stiffness * k.powi(3));
        let rounds = Transfer::identity() - back_b * back_a;
        let minus = rounds.lu().solve(&(back_b * q + q)).unwrap_or_else(|| {
            // At a lossless resonance to the last bit there is no amplitude.
            Waves::repeat(Complex::from(f64::INFINITY))
        });
        let waves = if to <= from {
            let leaving_a = end_a * before * minus;
            f(to) * leaving_a + f(from - to) * minus
        } else {
            let plus = back_a * minus + q;
            let leaving_b = end_b * behind * plus;
            f(to - from) * plus + f(1.0 - to) * leaving_b
        };
        let unit = self.length_m.powi(3) / self.bending_stiffness_n_m2();
        Ok(waves.sum() * unit)
    }
}

/// What a unit force sends either way (51): `[-i, -1]/(4 EI k^3)`.
fn sent(ei_k3: Complex<f64>) -> Waves {
    Waves::new(Complex::new(0.0, -1.0), Complex::from(-1.0)) / (ei_k3 * 4.0)
}

/// Propagation over `way`, k being complex where there is loss (44).
fn carried(k: Complex<f64>, way: f64) -> Transfer {
    let zero = Complex::from(0.0);
    Transfer::new((Complex::new(0.0, -way) * k).exp(), zero, zero, (-k * way).exp())
}

/// [`super::waves::Load::reflection`] for a complex load.
fn loaded(z: Complex<f64>) -> Transfer {
    let c = Complex::new;
    let numerator =
        Transfer::new(z * 2.0 - c(1.0, 1.0), c(2.0, 0.0), c(0.0, -2.0), z * 2.0 + c(1.0, 1.0));
    numerator / (c(1.0, -1.0) - z * 2.0)
}
