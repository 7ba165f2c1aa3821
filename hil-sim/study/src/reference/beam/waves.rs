//! Bending waves of a uniform beam: propagation, reflection at an end, and the
//! frequency equation as one real number.
//!
//! A deflection `W(x) e^{i w t}` is split into waves running towards +x,
//! `(a e^{-ikx}, a_N e^{-kx})`, and towards -x, `(a e^{ikx}, a_N e^{kx})`: one
//! propagating and one evanescent component each (eq 41). Lengths are in units of
//! the beam length, so `k` appears as `beta_l = k L` alone.
//!
//! Source: the study, eqs 41-54 (its eq 42 prints a square root where the fourth
//! root belongs); B. R. Mace, "Wave reflection and transmission in beams", J. Sound
//! Vib. 97 (1984) 237-246.

use nalgebra::{Complex, Matrix2};

/// What acts on a pair (propagating, evanescent) of wave amplitudes.
pub(crate) type Transfer = Matrix2<Complex<f64>>;

const I: Complex<f64> = Complex::new(0.0, 1.0);

/// A complex number from its parts.
const fn c(re: f64, im: f64) -> Complex<f64> {
    Complex::new(re, im)
}

/// An ideal end of a beam.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// No deflection, no slope.
    Clamped,
    /// No deflection, no moment.
    Pinned,
    /// No moment, no shear.
    Free,
}

impl End {
    /// Reflection matrix R of this end, the same at either end of the beam (eqs 48-54).
    pub(crate) fn reflection(self) -> Transfer {
        match self {
            Self::Clamped => Transfer::new(-I, c(-1.0, -1.0), c(-1.0, 1.0), I),
            Self::Pinned => -Transfer::identity(),
            Self::Free => Transfer::new(-I, c(1.0, 1.0), c(1.0, -1.0), I),
        }
    }

    /// Determinant of this end's two conditions on the wave that leaves it, up to a
    /// real factor: the denominator of R, and the phase that [`frequency_function`]
    /// takes out of the determinant.
    fn denominator(self) -> Complex<f64> {
        match self {
            Self::Pinned => c(1.0, 0.0),
            Self::Clamped | Self::Free => c(1.0, -1.0),
        }
    }
}

/// What end B carries: the shear per deflection of an end without moment,
/// `z = W''' / (k^3 W)`, as a direction `(cos, sin)` so that neither free (z = 0)
/// nor pinned (z infinite) is a special case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Load {
    shear: f64,
    deflection: f64,
}

impl Load {
    /// Nothing there: `W''' = 0`.
    pub(crate) const FREE: Self = Self { shear: 1.0, deflection: 0.0 };
    /// An immovable pin: `W = 0`.
    pub(crate) const PINNED: Self = Self { shear: 0.0, deflection: 1.0 };

    /// Mass and spring to ground at the tip.
    ///
    /// Equation: `z = spring / beta_l^3 - mass * beta_l`. With x out of the beam and w
    /// positive, the beam is pushed at its end x = L by `-EI w'''`, and mass and spring
    /// push it by `-m w_tt - K w = (m w^2 - K) w`. Equal forces give
    /// `EI w''' = m w_tt + K w`, hence z: positive where the spring rules, negative
    /// where the mass does. Rotary inertia of the tip is left out.
    ///
    /// Units: `mass` in beam masses (`m / rho A L`), `spring` in `EI / L^3`.
    /// Range: finite, `beta_l > 0`.
    pub(crate) fn mass_and_spring(mass: f64, spring: f64, beta_l: f64) -> Self {
        let z = spring / beta_l.powi(3) - mass * beta_l;
        let norm = z.hypot(1.0);
        Self { shear: 1.0 / norm, deflection: z / norm }
    }

    /// Reflection matrix of an end that carries this load.
    ///
    /// Equation: from `W'' = 0` and `shear * W''' = k^3 deflection * W` with
    /// z = deflection / shear,
    /// `R = [[2z - (1+i), 2], [-2i, 2z + (1+i)]] / ((1-i) - 2z)`.
    /// [`End::Free`] at z = 0, [`End::Pinned`] as |z| grows. The denominator has no
    /// real zero.
    pub(crate) fn reflection(self) -> Transfer {
        let (q, p) = (self.shear, 2.0 * self.deflection);
        let numerator = Transfer::new(c(p - q, -q), c(2.0 * q, 0.0), c(0.0, -2.0 * q), c(p + q, q));
        numerator / self.denominator()
    }

    fn denominator(self) -> Complex<f64> {
        c(self.shear - 2.0 * self.deflection, -self.shear)
    }
}

/// Propagation matrix over the beam, `f(L)` (eq 44).
pub(crate) fn propagation(beta_l: f64) -> Transfer {
    Transfer::new(
        Complex::from_polar(1.0, -beta_l),
        c(0.0, 0.0),
        c(0.0, 0.0),
        c((-beta_l).exp(), 0.0),
    )
}

/// A real function of `beta_l` whose roots are the roots of the frequency equation (54),
/// `det(R_A f R_B f - I) = 0`, linear in `(b.shear, b.deflection)`.
///
/// The determinant is turned by its known phase, so that it is imaginary. Conjugating a
/// deflection swaps its two propagating waves. The determinant of the four end conditions,
/// which are real, so changes its sign under conjugation: it is imaginary. The determinant
/// of (54) is that one over the denominators of R_A and R_B and the factor `e^{i beta_l}` of
/// the two columns; multiplying by these three makes it imaginary again.
///
/// Equation: for a clamped end A and z = deflection / shear it is
/// `-8 e^{-beta_l} shear [1 + cos cosh - z (cos sinh - sin cosh)](beta_l)`.
/// Range: `beta_l > 0`; nothing overflows, the exponentials only fall.
/// Error: a few units of rounding of a number of order one.
/// Cost: three products and one determinant of 2 x 2 complex matrices.
pub(crate) fn frequency_function(a: End, b: Load, beta_l: f64) -> f64 {
    let f = propagation(beta_l);
    let round_trip = a.reflection() * f * b.reflection() * f;
    let phase = Complex::from_polar(1.0, beta_l) * a.denominator() * b.denominator();
    ((round_trip - Transfer::identity()).determinant() * phase).im
}
