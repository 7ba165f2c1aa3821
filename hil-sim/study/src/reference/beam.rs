//! The drive arm by the wave-vector method: natural frequencies here, their [`Shape`]s
//! (55) beside them.
//!
//! An Euler-Bernoulli beam with end A at the pillar and end B at the wheel; end B may
//! carry a mass and press on a spring to ground (the contact). A wave that runs from A
//! to B and back must meet itself: `det(R_A f R_B f - I) = 0` (the study, eq 54).
//!
//! Shear deformation and rotary inertia are left out, as in the study: for an arm about ten
//! times as long as it is thick the frequencies come out somewhat high, the more so
//! the higher the mode.

mod roots;
mod shapes;
pub(crate) mod waves;

#[cfg(test)]
mod tests;

use std::f64::consts::PI;

use interstage::rig::Rig;
use serde::Serialize;

use waves::{End, Load, frequency_function};

pub(crate) use roots::bisect;
pub(crate) use shapes::Shape;

/// Most modes that may be asked for.
pub(crate) const MAX_COUNT: usize = 20;

/// Heaviest tip, in beam masses. Beyond it the first root sinks into rounding.
pub(crate) const MAX_MASS_RATIO: f64 = 1e6;

/// Softest and stiffest spring at the tip other than none, in `EI / L^3`. Softer ones
/// sink into rounding, stiffer ones are pins.
pub(crate) const SPRING_RATIOS: (f64, f64) = (1e-6, 1e12);

/// An argument outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{argument} is {value}, expected {expected}")]
pub(crate) struct BeamError {
    pub argument: &'static str,
    /// What was given, in the unit of the argument's name.
    pub value: f64,
    /// What it should have been.
    pub expected: String,
}

/// How the beam is held: end A, then end B before any [`Tip`] is put on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
#[expect(clippy::enum_variant_names, reason = "both ends are named")]
pub(crate) enum Ends {
    /// Held fast at the pillar.
    ClampedFree,
    /// Turning on its pivot at the pillar.
    PinnedFree,
    /// Held nowhere.
    FreeFree,
}

impl Ends {
    /// End A alone.
    fn end_a(self) -> End {
        match self {
            Self::ClampedFree => End::Clamped,
            Self::PinnedFree => End::Pinned,
            Self::FreeFree => End::Free,
        }
    }
}

/// What end B carries. The default is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Tip {
    pub mass_kg: f64,
    /// Spring to ground across the beam, N/m.
    pub spring_n_per_m: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mode {
    /// Wave number times length, dimensionless.
    pub beta_l: f64,
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
}

/// A uniform beam of rectangular section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beam {
    pub length_m: f64,
    /// Young's modulus, Pa.
    pub e_pa: f64,
    /// Density, kg/m^3.
    pub rho_kg_m3: f64,
    /// Section across the direction of bending, m.
    pub width_m: f64,
    /// Section in the direction of bending, m.
    pub height_m: f64,
}

impl Beam {
    /// The drive arm, bending in the plane in which it swings, about an axis along
    /// that of the wheel: the plane of the preload and of the climb over a step.
    ///
    /// Published: length, section 12 x 15 mm, alloy 2A12 (density 2780 kg/m^3, modulus
    /// 70 to 73 GPa by the source; 72.5 taken). Not published: which side of the
    /// section lies in that plane. Chosen: the 15 mm one, as one would mount it.
    pub(crate) fn drive_arm() -> Self {
        Self {
            length_m: Rig::prototype().rig.arm_length_mm * 1e-3,
            e_pa: 72.5e9,
            rho_kg_m3: 2780.0,
            width_m: 0.012,
            height_m: 0.015,
        }
    }

    pub(crate) fn mass_kg(&self) -> f64 {
        self.rho_kg_m3 * self.width_m * self.height_m * self.length_m
    }

    /// Bending stiffness EI, N m^2, with I = width height^3 / 12.
    pub(crate) fn bending_stiffness_n_m2(&self) -> f64 {
        self.e_pa * self.width_m * self.height_m.powi(3) / 12.0
    }

    /// The first `count` natural modes, ascending; rigid motion at zero frequency is
    /// left out.
    ///
    /// Equation: `det(R_A f R_B f - I) = 0` (54) with R_B from
    /// [`Load::mass_and_spring`]; `frequency = beta_l^2 / (2 pi L^2) sqrt(EI / rho A)`
    /// (42, with the fourth root).
    /// Range: count 1 to [`MAX_COUNT`], mass up to [`MAX_MASS_RATIO`] beam masses,
    /// spring none or within [`SPRING_RATIOS`].
    /// Error: `beta_l` within 1e-9, relative, anywhere in that range.
    /// Cost: three bisections to the last bit a mode.
    /// Source: the study, eqs 41-54; classical roots in R. D. Blevins, "Formulas for
    /// Natural Frequency and Mode Shape", table 8-1.
    pub(crate) fn modes(&self, ends: Ends, tip: Tip, count: usize) -> Result<Vec<Mode>, BeamError> {
        let (mass, spring) = self.ratios(tip)?;
        require("count", count as f64, (1..=MAX_COUNT).contains(&count), || {
            format!("1 to {MAX_COUNT} modes")
        })?;
        let roots = roots::first(ends.end_a(), mass, spring, count);
        Ok(roots.into_iter().map(|beta_l| self.mode(beta_l)).collect())
    }

    /// The tip mass, kg, that brings the first clamped-free mode to `frequency_hz`.
    ///
    /// Equation: the frequency function is linear in the load, so
    /// `z = -g_free / g_pinned` at the wanted `beta_l` and `m = -z rho A L / beta_l`.
    /// It needs no iteration, and has one answer: the first frequency falls steadily
    /// as the mass grows.
    /// Range: from the first frequency of the bare beam down to that with
    /// [`MAX_MASS_RATIO`] beam masses.
    ///
    /// The published first constrained mode of the rig, 276 Hz, takes 62.9 g on
    /// [`Self::drive_arm`] (bare: 588.5 Hz). That is an equivalent mass, not a weighed one:
    /// it represents wheel and axle, and whatever yields in the clamp.
    pub(crate) fn tip_mass_for(&self, frequency_hz: f64) -> Result<f64, BeamError> {
        let first = |mass| self.mode(roots::first(End::Clamped, mass, 0.0, 1)[0]).frequency_hz;
        let (bare_hz, least_hz) = (first(0.0), first(MAX_MASS_RATIO));
        let in_range = (least_hz..=bare_hz).contains(&frequency_hz);
        require("frequency_hz", frequency_hz, in_range, || {
            format!("{least_hz:.6} to {bare_hz:.6} Hz, the latter without tip mass")
        })?;
        let beta_l = (frequency_hz / self.frequency_scale_hz()).sqrt();
        let free = frequency_function(End::Clamped, Load::FREE, beta_l);
        let pinned = frequency_function(End::Clamped, Load::PINNED, beta_l);
        let ratio = (free / pinned / beta_l).clamp(0.0, MAX_MASS_RATIO);
        Ok(ratio * self.mass_kg())
    }

    fn mode(&self, beta_l: f64) -> Mode {
        Mode { beta_l, frequency_hz: beta_l * beta_l * self.frequency_scale_hz() }
    }

    /// Frequency at `beta_l` = 1, Hz.
    fn frequency_scale_hz(&self) -> f64 {
        let per_length = self.mass_kg() / self.length_m;
        let celerity = (self.bending_stiffness_n_m2() / per_length).sqrt();
        celerity / (2.0 * PI * self.length_m.powi(2))
    }

    /// Tip mass in beam masses and tip spring in `EI / L^3`.
    fn ratios(&self, tip: Tip) -> Result<(f64, f64), BeamError> {
        let mass = tip.mass_kg / self.mass_kg();
        require("tip.mass_kg", tip.mass_kg, (0.0..=MAX_MASS_RATIO).contains(&mass), || {
            format!("0 to {:.4e} kg", MAX_MASS_RATIO * self.mass_kg())
        })?;
        let unit = self.bending_stiffness_n_m2() / self.length_m.powi(3);
        let spring = tip.spring_n_per_m / unit;
        let (softest, stiffest) = SPRING_RATIOS;
        let ok = spring == 0.0 || (softest..=stiffest).contains(&spring);
        require("tip.spring_n_per_m", tip.spring_n_per_m, ok, || {
            format!("0, or {:.4e} to {:.4e} N/m", softest * unit, stiffest * unit)
        })?;
        Ok((mass, spring))
    }
}

/// `ok`, or the error that says why not.
fn require(
    argument: &'static str,
    value: f64,
    ok: bool,
    expected: impl FnOnce() -> String,
) -> Result<(), BeamError> {
    if ok { Ok(()) } else { Err(BeamError { argument, value, expected: expected() }) }
}
