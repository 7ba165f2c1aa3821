//! What the plant refuses before a run: parameters each possible, which together bury
//! the wheel. A wheel in its tread up to the hub has no height that carries it, and a
//! corner at the height of the hub is a wall.

use super::draw::PlantParameters;
use super::ring::RingParameters;

/// Deepest that a corner may be pressed into the tread, parts of the wheel's radius.
/// The radial law ends where the depth is no longer small against the radius.
pub(crate) const DEEPEST: f64 = 0.4;

/// Highest that a corner, pressed in as deep as it can be, may stand, parts of the
/// radius: from there the face leans on the wheel at the height of its axle.
pub(crate) const HIGHEST: f64 = 0.85;

/// Deepest that a corner may be pressed into a tread of coupled elements, parts of its
/// thickness: small strains end there. The depth is that of independent elements, a seventh
/// more than coupled ones give way.
pub(crate) const CRUSHED: f64 = 0.65;

/// A combination of parameters that cannot be computed, because it cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{text}")]
pub struct Refusal {
    /// Its name in counts.
    pub name: &'static str,
    /// The parameters, what they come to, and the limit.
    pub text: String,
}

/// Name of a refusal: preload on the corner.
pub(crate) const SINKS: &str = "preload sinks the wheel";
/// Preload on a corner of a thin tread.
pub(crate) const CRUSHES: &str = "preload crushes the tread";
/// Momentum and friction together.
pub(crate) const DIGS: &str = "braked wheel digs itself in";
/// Step and depth together.
pub(crate) const TOWERS: &str = "corner as high as the hub";

impl PlantParameters {
    /// Whether the rig can be run under preloads up to `preload_n`.
    pub(crate) fn check(&self, preload_n: f64) -> Result<(), Refusal> {
        let radius_mm = self.ring.radius_mm;
        let most_mm = DEEPEST * radius_mm;
        let wedge = self.arm.thrust_ratio(self.wall_radius_mm - radius_mm);
        let force_n = preload_n + (wedge * self.load_n).max(0.0);
        // In a right-angled corner of the relaxed tread, two faces at 45 degrees: `F = k L d^2`.
        let depth_mm = (force_n / (self.ring.k_inf * self.ring.width_mm)).sqrt();
        let refused = |name, text| Err(Refusal { name, text });
        let pressed = format!("preload.limit_n, with the load through the arm {force_n:.1} N");
        if depth_mm > most_mm || depth_mm.is_nan() {
            return refused(
                SINKS,
                format!(
                    "{pressed}, on tread.k_inf_pa_per_m = {:.3e} presses a corner {depth_mm:.1} mm \
                     deep: at most {most_mm:.1} mm",
                    1e9 * self.ring.k_inf
                ),
            );
        }
        let thickness_mm = self.ring.tread_thickness_mm;
        let most_mm = CRUSHED * thickness_mm;
        if self.ring.is_coupled() && depth_mm > most_mm {
            return refused(
                CRUSHES,
                format!(
                    "{pressed}, presses a corner {depth_mm:.1} mm deep into \
                     mismatch.tread_thickness, {thickness_mm:.1} mm: at most {most_mm:.1} mm"
                ),
            );
        }
        let step_mm = self.wall.steps().iter().fold(0.0f64, |most, s| most.max(s.height_mm));
        let most_mm = HIGHEST * radius_mm;
        if step_mm + depth_mm > most_mm {
            return refused(
                TOWERS,
                format!(
                    "rig.step_height_mm = {step_mm:.1}, the corner {depth_mm:.1} mm deep in the \
                     tread, reaches as high as the hub of a wheel of {radius_mm:.1} mm: at most \
                     {most_mm:.1} mm together"
                ),
            );
        }
        let tangent = leans(radius_mm, step_mm + depth_mm);
        let (mass_kg, speed_mm_s) = (self.mass_kg, self.drive.no_load_mm_s);
        let energy_mj = 0.5e-3 * mass_kg * speed_mm_s * speed_mm_s;
        let most_mj = takes(&self.ring, step_mm);
        let mu = self.mu * (1.0 + self.friction_waves.0);
        if mu * tangent >= 1.0 && energy_mj > most_mj {
            return refused(
                DIGS,
                format!(
                    "plant.mu = {mu:.2} on a corner that leans by {tangent:.2} drags a wheel down \
                     that is braked, and plant.moved_mass_kg = {mass_kg:.3} at {speed_mm_s:.0} mm/s \
                     brings {energy_mj:.2} mJ, of which the tread takes at most {most_mj:.2} mJ"
                ),
            );
        }
        Ok(())
    }
}

/// Tangent of the direction from the wheel's centre to a corner this far above the lowest
/// point of its rim, mm: axial over radial force of a frictionless contact there.
pub(crate) fn leans(radius_mm: f64, above_mm: f64) -> f64 {
    let over = radius_mm - above_mm;
    (radius_mm * radius_mm - over * over).max(0.0).sqrt() / over.max(1e-9)
}

/// Energy that a corner of a step may bring into the tread, mJ: a fourth of what takes it to
/// the depth allowed, `k L d^3/3`, for the rest of the tread is not as stiff.
pub(crate) fn takes(ring: &RingParameters, step_mm: f64) -> f64 {
    let depth = (DEEPEST * ring.radius_mm).min(HIGHEST * ring.radius_mm - step_mm);
    ring.k_inf * ring.width_mm * depth.powi(3) / 12.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::sensors::Noise;
    use crate::plant::spread::Spread;
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
        assert_eq!(refusal.name, SINKS);
        assert!(refusal.to_string().contains("on tread.k_inf_pa_per_m = 1.000e6"), "{refusal}");
        let mut high = nominal();
        high.wall = crate::plant::wall::Wall::new(vec![crate::plant::wall::Step {
            position_mm: 20.0,
            height_mm: 20.5,
        }]);
        assert_eq!(high.check(50.0).unwrap_err().name, TOWERS);
        (high.load_n, high.mu) = (0.0, 0.1);
        assert_eq!(high.check(5.0), Ok(()));
        // Braked, it would dig itself in, if it were heavy enough for that.
        high.mu = 1.1;
        assert_eq!(high.check(5.0).unwrap_err().name, DIGS);
        high.mass_kg = 0.1;
        assert_eq!(high.check(5.0), Ok(()));
        let mut thin = nominal();
        thin.ring.tread_thickness_mm = 5.0;
        assert_eq!(thin.check(150.0), Ok(()));
        let refusal = thin.check(190.0).unwrap_err();
        assert!(refusal.to_string().contains("mismatch.tread_thickness, 5.0 mm"), "{refusal}");
        // The load presses too, through a trailing arm.
        let mut heavy = nominal();
        heavy.ring.k_inf = 0.02;
        assert_eq!(heavy.check(48.0), Ok(()));
        heavy.load_n = 20.0;
        assert_eq!(heavy.check(48.0).unwrap_err().name, SINKS);
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
