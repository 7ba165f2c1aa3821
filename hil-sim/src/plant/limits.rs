//! What the plant refuses before a run: parameters each possible, which together bury
//! the wheel. A wheel in its tread up to the hub has no height that carries it, and a
//! corner at the height of the hub is a wall.

use super::draw::PlantParameters;

/// Deepest that a corner may be pressed into the tread, parts of the wheel's radius.
/// The radial law ends where the depth is no longer small against the radius.
pub const DEEPEST: f64 = 0.4;

/// Highest that a corner, pressed in as deep as it can be, may stand, parts of the
/// radius: from there the face leans on the wheel at the height of its axle.
pub const HIGHEST: f64 = 0.85;

/// Utilisation times tangent of the arm angle from which an arm wedges itself tight.
const SELF_LOCKING: f64 = 0.75;

/// Time in which a wheel whose bridge is switched off stops, s.
const STOPS_WITHIN_S: f64 = 0.003;

/// A combination of parameters that cannot be computed, because it cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// Preload on the corner.
    #[error(
        "preload of {force_n:.1} N on a tread of {k_inf_pa_per_m:.3e} Pa/m presses a corner {depth_mm:.1} mm deep: at most {most_mm:.1} mm"
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
    /// Thrust of motor and inertia through the arm.
    #[error(
        "thrust of {thrust_n:.1} N through an arm that presses the wheel by {wedge:.2} of it, on a tread of {k_inf_pa_per_m:.3e} Pa/m, presses a corner {depth_mm:.1} mm deep: at most {most_mm:.1} mm"
    )]
    Wedges {
        /// Largest axial thrust, N.
        thrust_n: f64,
        /// Radial force per thrust.
        wedge: f64,
        /// Relaxed stiffness, Pa/m.
        k_inf_pa_per_m: f64,
        /// Depth, mm.
        depth_mm: f64,
        /// Largest depth, mm.
        most_mm: f64,
    },
    /// Step and depth together.
    #[error(
        "a step of {step_mm:.1} mm, its corner {depth_mm:.1} mm deep in the tread, stands as high as the hub of a wheel of {radius_mm:.1} mm: at most {most_mm:.1} mm together"
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
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Sinks { .. } => "preload sinks the wheel",
            Self::Wedges { .. } => "arm wedges the wheel in",
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
        let depth_mm = corner_depth(self, preload_n);
        if depth_mm > most_mm || depth_mm.is_nan() {
            return Err(Refusal::Sinks { force_n: preload_n, k_inf_pa_per_m, depth_mm, most_mm });
        }
        let step_mm = self.wall.steps().iter().fold(0.0f64, |most, s| most.max(s.height_mm));
        let highest = HIGHEST * radius_mm;
        if step_mm + depth_mm > highest {
            return Err(Refusal::Towers { step_mm, depth_mm, radius_mm, most_mm: highest });
        }
        let wedge = self.arm.wedge(self.wall_radius_mm - radius_mm).abs();
        // Only an arm that wedges itself tight transmits more than friction.
        if wedge * self.mu < SELF_LOCKING {
            return Ok(());
        }
        let drive = &self.drive;
        let brakes = drive.limit_n / drive.mass_kg + 1e-3 * drive.no_load_mm_s / STOPS_WITHIN_S;
        let thrust_n = drive.limit_n + self.load_n.abs() + self.mass_kg * brakes;
        let depth_mm = corner_depth(self, preload_n + wedge * thrust_n);
        if depth_mm <= most_mm {
            return Ok(());
        }
        Err(Refusal::Wedges { thrust_n, wedge, k_inf_pa_per_m, depth_mm, most_mm })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    fn nominal() -> PlantParameters {
        PlantParameters::draw(&Scenario::default())
    }

    #[test]
    fn the_presets_are_far_from_every_refusal() {
        for (preset, preload) in [("prototype", 50.0), ("fe", 150.0)] {
            let plant = PlantParameters::draw(&Scenario::named(preset).unwrap());
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
        assert!(refusal.to_string().contains("50.0 N on a tread of 1.000e6 Pa/m"), "{refusal}");
        let mut high = nominal();
        high.wall = crate::plant::wall::Wall::new(vec![crate::plant::wall::Step {
            position_mm: 20.0,
            height_mm: 20.5,
        }]);
        assert!(matches!(high.check(50.0), Err(Refusal::Towers { .. })));
        assert_eq!(high.check(5.0), Ok(()));
        let mut heavy = nominal();
        heavy.mass_kg = 200.0;
        heavy.drive.mass_kg = 0.2;
        assert!(matches!(heavy.check(50.0), Err(Refusal::Wedges { .. })));
        // An arm that does not lock transmits no more than friction.
        heavy.mu = 0.5;
        assert_eq!(heavy.check(50.0), Ok(()));
    }

    #[test]
    fn what_is_not_a_number_is_refused() {
        let mut plant = nominal();
        plant.ring.k_inf = f64::NAN;
        assert!(plant.check(50.0).is_err());
        assert!(nominal().check(f64::NAN).is_err());
    }
}
