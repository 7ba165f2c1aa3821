//! What the plant refuses before a run: parameters each possible, which together bury
//! the wheel. A wheel in its tread up to the hub has no height that carries it, and a
//! corner at the height of the hub is a wall.

use super::draw::PlantParameters;
use super::ring::RingParameters;

/// Deepest that a corner may be pressed into the tread, parts of the wheel's radius.
/// The radial law ends where the depth is no longer small against the radius.
pub const DEEPEST: f64 = 0.4;

/// Highest that a corner, pressed in as deep as it can be, may stand, parts of the
/// radius: from there the face leans on the wheel at the height of its axle.
pub const HIGHEST: f64 = 0.85;

/// Deepest that a corner may be pressed into a tread of coupled elements, parts of its
/// thickness: small strains end there. The depth is that of independent elements, a seventh
/// more than coupled ones give way.
pub const CRUSHED: f64 = 0.65;

/// A combination of parameters that cannot be computed, because it cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// Preload on the corner.
    #[error(
        "preload.limit_n, with the load through the arm {force_n:.1} N, on tread.k_inf_pa_per_m = {k_inf_pa_per_m:.3e} presses a corner {depth_mm:.1} mm deep: at most {most_mm:.1} mm"
    )]
    Sinks {
        /// Radial force, N.
        force_n: f64,
        /// Relaxed stiffness, Pa/m.
        k_inf_pa_per_m: f64,
        /// Depth, mm.
        depth_mm: f64,
        /// Largest depth, mm.
        most_mm: f64,
    },
    /// Preload on a corner of a thin tread.
    #[error(
        "preload.limit_n, with the load through the arm {force_n:.1} N, presses a corner {depth_mm:.1} mm deep into mismatch.tread_thickness_mm = {thickness_mm:.1}: at most {most_mm:.1} mm"
    )]
    Crushes {
        /// Radial force, N.
        force_n: f64,
        /// Depth, mm.
        depth_mm: f64,
        /// Thickness of the tread, mm.
        thickness_mm: f64,
        /// Largest depth, mm.
        most_mm: f64,
    },
    /// Momentum and friction together.
    #[error(
        "plant.mu = {mu:.2} on a corner that leans by {tangent:.2} drags a wheel down that is braked, and plant.moved_mass_kg = {mass_kg:.3} at {speed_mm_s:.0} mm/s brings {energy_mj:.0} mJ, of which the tread takes at most {most_mj:.0} mJ"
    )]
    Digs {
        /// Friction.
        mu: f64,
        /// Tangent of the direction to the corner.
        tangent: f64,
        /// Moved mass, kg.
        mass_kg: f64,
        /// Largest speed, mm/s.
        speed_mm_s: f64,
        /// Kinetic energy, mJ.
        energy_mj: f64,
        /// Energy that the tread takes, mJ.
        most_mj: f64,
    },
    /// Step and depth together.
    #[error(
        "rig.step_height_mm = {step_mm:.1}, the corner {depth_mm:.1} mm deep in the tread, reaches as high as the hub of a wheel of {radius_mm:.1} mm: at most {most_mm:.1} mm together"
    )]
    Towers {
        /// Step, mm.
        step_mm: f64,
        /// Depth of its corner, mm.
        depth_mm: f64,
        /// Radius of the wheel, mm.
        radius_mm: f64,
        /// Largest sum, mm.
        most_mm: f64,
    },
}

impl Refusal {
    /// Its name in counts.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Sinks { .. } => "preload sinks the wheel",
            Self::Crushes { .. } => "preload crushes the tread",
            Self::Digs { .. } => "braked wheel digs itself in",
            Self::Towers { .. } => "corner as high as the hub",
        }
    }
}

/// Depth of a right-angled corner in the relaxed tread under this force, mm: two faces
/// at 45 degrees, `F = k L d^2`.
fn corner_depth(plant: &PlantParameters, force_n: f64) -> f64 {
    (force_n / (plant.ring.k_inf * plant.ring.width_mm)).sqrt()
}

impl PlantParameters {
    /// Whether the rig can be run under preloads up to `preload_n`.
    ///
    /// # Errors
    /// The [`Refusal`] that names the parameters and their limit.
    pub fn check(&self, preload_n: f64) -> Result<(), Refusal> {
        let radius_mm = self.ring.radius_mm;
        let k_inf_pa_per_m = self.ring.k_inf * 1e9;
        let most_mm = DEEPEST * radius_mm;
        let wedge = self.arm.thrust_ratio(self.wall_radius_mm - radius_mm);
        let force_n = preload_n + (wedge * self.load_n).max(0.0);
        let depth_mm = corner_depth(self, force_n);
        if depth_mm > most_mm || depth_mm.is_nan() {
            return Err(Refusal::Sinks { force_n, k_inf_pa_per_m, depth_mm, most_mm });
        }
        let thickness_mm = self.ring.tread_thickness_mm;
        let most_mm = CRUSHED * thickness_mm;
        if self.ring.is_coupled() && depth_mm > most_mm {
            return Err(Refusal::Crushes { force_n, depth_mm, thickness_mm, most_mm });
        }
        let step_mm = self.wall.steps().iter().fold(0.0f64, |most, s| most.max(s.height_mm));
        let most_mm = HIGHEST * radius_mm;
        if step_mm + depth_mm > most_mm {
            return Err(Refusal::Towers { step_mm, depth_mm, radius_mm, most_mm });
        }
        let tangent = leans(radius_mm, step_mm + depth_mm);
        let (mass_kg, speed_mm_s) = (self.mass_kg, self.drive.no_load_mm_s);
        let energy_mj = 0.5e-3 * mass_kg * speed_mm_s * speed_mm_s;
        let most_mj = takes(&self.ring, step_mm);
        let mu = self.mu * (1.0 + self.friction_waves.0);
        if mu * tangent >= 1.0 && energy_mj > most_mj {
            return Err(Refusal::Digs { mu, tangent, mass_kg, speed_mm_s, energy_mj, most_mj });
        }
        Ok(())
    }
}

/// Tangent of the direction from the wheel's centre to a corner this far above the lowest
/// point of its rim, mm: axial over radial force of a frictionless contact there.
pub fn leans(radius_mm: f64, above_mm: f64) -> f64 {
    let over = radius_mm - above_mm;
    (radius_mm * radius_mm - over * over).max(0.0).sqrt() / over.max(1e-9)
}

/// Energy that a corner of a step may bring into the tread, mJ: a fourth of what takes it to
/// the depth allowed, `k L d^3/3`, for the rest of the tread is not as stiff.
pub fn takes(ring: &RingParameters, step_mm: f64) -> f64 {
    let depth = (DEEPEST * ring.radius_mm).min(HIGHEST * ring.radius_mm - step_mm);
    ring.k_inf * ring.width_mm * depth.powi(3) / 12.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::spread::{Noise, Spread};
    use interstage::rig::Rig;

    fn of(rig: &Rig) -> PlantParameters {
        let steps: Vec<_> = rig.rig.step_positions_mm.iter().map(|at| (*at, 0.0)).collect();
        PlantParameters::draw(rig, &steps, &Spread::default(), &Noise::default(), 0)
    }

    fn nominal() -> PlantParameters {
        of(&Rig::prototype())
    }

    #[test]
    fn the_presets_are_far_from_every_refusal() {
        for (rig, preload) in [(Rig::prototype(), 50.0), (Rig::fe(), 150.0)] {
            let plant = of(&rig);
            assert_eq!(plant.check(preload), Ok(()));
            assert_eq!(plant.check(5.0 * preload), Ok(()));
        }
    }

    #[test]
    fn each_refusal_names_what_is_too_much() {
        let mut soft = nominal();
        soft.ring.k_inf = 1e-3;
        let refusal = soft.check(50.0).unwrap_err();
        assert!(matches!(refusal, Refusal::Sinks { .. }));
        assert!(refusal.to_string().contains("on tread.k_inf_pa_per_m = 1.000e6"), "{refusal}");
        let mut high = nominal();
        high.wall = crate::plant::wall::Wall::new(vec![crate::plant::wall::Step {
            position_mm: 20.0,
            height_mm: 20.5,
        }]);
        assert!(matches!(high.check(50.0), Err(Refusal::Towers { .. })));
        (high.load_n, high.mu) = (0.0, 0.1);
        assert_eq!(high.check(5.0), Ok(()));
        // Braked, it would dig itself in, if it were heavy enough for that.
        high.mu = 1.1;
        assert!(matches!(high.check(5.0), Err(Refusal::Digs { .. })));
        high.mass_kg = 0.1;
        assert_eq!(high.check(5.0), Ok(()));
        let mut thin = nominal();
        thin.ring.tread_thickness_mm = 5.0;
        assert_eq!(thin.check(150.0), Ok(()));
        let refusal = thin.check(190.0).unwrap_err();
        assert!(refusal.to_string().contains("mismatch.tread_thickness_mm = 5.0"), "{refusal}");
        // The load presses too, through a trailing arm.
        let mut heavy = nominal();
        heavy.ring.k_inf = 0.02;
        assert_eq!(heavy.check(48.0), Ok(()));
        heavy.load_n = 20.0;
        assert!(matches!(heavy.check(48.0), Err(Refusal::Sinks { .. })));
        heavy.arm.coupling = -1.0;
        assert_eq!(heavy.check(48.0), Ok(()));
    }

    #[test]
    fn what_is_not_a_number_is_refused() {
        let mut plant = nominal();
        plant.ring.k_inf = f64::NAN;
        assert!(plant.check(50.0).is_err());
        assert!(nominal().check(f64::NAN).is_err());
    }
}
