//! Discontinuities (46-51): what a change of section, a mass, or a spring along the beam
//! lets through and sends back.

use nalgebra::{Complex, Matrix4, Matrix4x2};

use super::waves::Transfer;

/// A discontinuity. Every part of it is lossless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Junction {
    /// Wave number behind it over that before it, `k_b/k_a`.
    pub number_ratio: f64,
    /// Bending stiffness behind it over that before it, `(EI)_b/(EI)_a`.
    pub stiffness_ratio: f64,
    /// Shear per deflection that a spring to ground and a mass take there,
    /// `(K - m omega^2)/(EI k^3)_a`.
    pub deflection_load: f64,
    /// Moment per slope that a rotational spring and an inertia take there,
    /// `(K_r - J omega^2)/(EI k)_a`.
    pub slope_load: f64,
}

/// How waves leave a junction that one side sends waves to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// Back to where they came from.
    pub reflection: Transfer,
    /// Through it.
    pub transmission: Transfer,
}

impl Junction {
    /// No discontinuity at all.
    pub const NONE: Self =
        Self { number_ratio: 1.0, stiffness_ratio: 1.0, deflection_load: 0.0, slope_load: 0.0 };

    /// Two sections of one material, from the second moments and areas of `(a, b)`:
    /// `k` goes with `(A/I)^(1/4)`.
    #[must_use]
    pub fn of_sections(moments_m4: (f64, f64), areas_m2: (f64, f64)) -> Self {
        let area = areas_m2.1 / areas_m2.0;
        let moment = moments_m4.1 / moments_m4.0;
        Self { number_ratio: (area / moment).powf(0.25), stiffness_ratio: moment, ..Self::NONE }
    }

    /// Power that a propagating wave behind the junction carries over that of one of the
    /// same amplitude before it: `(EI k^3)_b/(EI k^3)_a`.
    #[must_use]
    pub fn power_ratio(&self) -> f64 {
        self.stiffness_ratio * self.number_ratio.powi(3)
    }

    /// Waves that come from before the junction.
    ///
    /// Equation: deflection and slope continue; `EI w'''` grows by
    /// `(K - m omega^2) w` less, `EI w''` by `(K_r - J omega^2) w'` (46, 47, with
    /// Q and M what spring and mass exert). Pairs are (propagating, evanescent).
    /// Range: ratios above 0. Cost: one 4 x 4 complex solution.
    /// Source: the study, eqs 46-51; B. R. Mace, J. Sound Vib. 97 (1984) 237-246.
    #[must_use]
    pub fn forwards(&self) -> Scattering {
        let i = Complex::<f64>::i();
        let one = Complex::from(1.0);
        let (beta, stiff) = (self.number_ratio, self.stiffness_ratio);
        // Derivatives 0 to 3 by k_a x of e^{-ikx} and e^{-kx}; mirrored for what returns.
        let onwards = [[one, one], [-i, -one], [-one, one], [i, -one]];
        let back = [[one, one], [i, one], [-one, one], [-i, one]];
        let behind = |order: usize, wave: usize| {
            let scale = if order >= 2 { stiff } else { 1.0 };
            onwards[order][wave] * scale * beta.powi(order as i32)
        };
        // Loads act on the common deflection and slope: written with those behind.
        let load = |order: usize, wave: usize| match order {
            2 => -behind(1, wave) * self.slope_load,
            3 => behind(0, wave) * self.deflection_load,
            _ => Complex::from(0.0),
        };
        let left = Matrix4::from_fn(|order, column| match column {
            0 | 1 => back[order][column],
            _ => -(behind(order, column - 2) + load(order, column - 2)),
        });
        let right = Matrix4x2::from_fn(|order, wave| -onwards[order][wave]);
        let solution = left.lu().solve(&right).unwrap_or_else(|| {
            // A junction of positive ratios always scatters; only infinite loads do not.
            Matrix4x2::from_element(Complex::from(f64::NAN))
        });
        Scattering {
            reflection: solution.fixed_rows::<2>(0).into(),
            transmission: solution.fixed_rows::<2>(2).into(),
        }
    }

    /// Waves that come from behind it: the same junction seen the other way round.
    #[must_use]
    pub fn backwards(&self) -> Scattering {
        let (beta, stiff) = (self.number_ratio, self.stiffness_ratio);
        let turned = Self {
            number_ratio: 1.0 / beta,
            stiffness_ratio: 1.0 / stiff,
            deflection_load: self.deflection_load / (stiff * beta.powi(3)),
            slope_load: self.slope_load / (stiff * beta),
        };
        turned.forwards()
    }

    /// What waves from before the junction meet, if those behind it meet `end`:
    /// all their ways through it and back summed.
    #[must_use]
    pub fn before(&self, end: &Transfer) -> Transfer {
        let (there, back) = (self.forwards(), self.backwards());
        let rounds = Transfer::identity() - end * back.reflection;
        let returned = rounds.lu().solve(&(end * there.transmission));
        let returned = returned.unwrap_or_else(|| Transfer::repeat(Complex::from(f64::NAN)));
        there.reflection + back.transmission * returned
    }
}
