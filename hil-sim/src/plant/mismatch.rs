//! What the plant has and the controller is not told. What both know is in `rig.*`,
//! `tread.*`, `plant.*` and the like; a value here acts on the plant alone.

use documented::DocumentedFields;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::draw::PlantParameters;
use super::ring::RingParameters;
use super::spread::{Field, Section, section};
use super::wall::Form;

section! {
    /// Departures of the plant from the rig that the controller knows; the usual one is neutral.
    /// Factors are neutral at 1, everything else at 0, but for [`Mismatch::rolling_compression`].
    Mismatch {
        /// Factor of the friction of tread on wall: dust, moisture, polish.
        friction: 1.0, (0.0, 3.0), (0.9, 1.1);
        /// Factor of the tread's relaxed stiffness: compound and thickness.
        tread_stiffness: 1.0, (0.3, 3.0), (0.85, 1.15);
        /// Factor of the tread's stiffening, instant over relaxed stiffness: compound.
        tread_stiffening: 1.0, (0.3, 3.0), (0.85, 1.15);
        /// Factor of the tread's time constant: compound, and its temperature; 10 K change it
        /// two- to threefold.
        tread_tau: 1.0, (0.3, 3.0), (0.3, 3.0);
        /// Part of the compression by which the rolling radius is less than the undeformed one:
        /// a third by tyre textbooks.
        rolling_compression: 1.0 / 3.0, (0.0, 1.0), (0.2, 0.5);
        /// Radius of the edge of every step: deburred, worn.
        edge_radius_mm: 0.0, (0.0, 0.5), (0.0, 0.5);
        /// Rise of the wall towards the pillar from the stow end to the end of travel: the bore's
        /// taper.
        taper_mm: 0.0, (-0.5, 0.5), (-0.1, 0.1);
        /// Rise of the wall towards the pillar in the middle of the travel above the line between
        /// the ends: a bent sleeve.
        bend_mm: 0.0, (-0.5, 0.5), (-0.1, 0.1);
        /// Distance of the wheel's axis of rotation from the axis of its rim.
        run_out_mm: 0.0, (0.0, 0.1), (0.0, 0.05);
        /// Travel of the tread when the drive force changes sign: play in the gearbox.
        backlash_mm: 0.0, (0.0, 0.5), (0.0, 0.1);
        /// Coulomb friction in the arm's pivot, as force at the wheel that the preload sensor does
        /// not see.
        pivot_friction_n: 0.0, (0.0, 5.0), (0.0, 1.0);
        /// Axial load beside the top load: the weight of what moves on an upright rig.
        weight_n: 0.0, (0.0, 20.0), (0.0, 2.0);
        /// What the compression sensor measures: 0 the deepest point of the tread, 1 the mean
        /// depth of the patch that carries.
        compression_patch: 0.0, (0.0, 1.0), (0.0, 1.0);
        /// Compliance of what the compression sensor is mounted on: it adds to the reading.
        compression_compliance_mm_per_n: 0.0, (0.0, 0.01), (0.0, 0.001);
        /// Factor of the frequencies of the arm's modes: mounting, and the mass of cables.
        mode_frequency: 1.0, (0.5, 2.0), (0.95, 1.05);
        /// Factor of the modes' damping ratio, which is 0.02, chosen.
        mode_damping: 1.0, (0.1, 10.0), (0.5, 2.0);
        /// Factor of the modal mass, which is 0.2 kg, chosen.
        mode_mass: 1.0, (0.1, 10.0), (0.5, 2.0);
        /// Part of the force at the tread that drives a mode: its shape there, 1, chosen.
        mode_shape: 1.0, (0.0, 2.0), (0.5, 1.0);
        /// Thickness of the tread as a layer of incompressible rubber, whose elements push each
        /// other, over `tread.thickness_mm`; 0: independent elements, as the controller's model has
        /// them.
        tread_thickness: 0.0, (0.0, 2.0), (0.9, 1.1);
        /// Spread s of two relaxations of equal share in place of the one at tau: at tau/s and
        /// tau s.
        second_relaxation: 1.0, (1.0, 10.0), (1.0, 4.0);
        /// Part of the pre-tightener's speed that raising the preload limit takes: its motor has that
        /// part of its stall torque to give. At the limit it still has its slew.
        screw_droop: 0.0, (0.0, 0.5), (0.0, 0.2);
        /// Part of full duty that the friction of the pre-tightener's screw takes: below it nothing
        /// moves.
        screw_friction: 0.0, (0.0, 0.2), (0.0, 0.05);
        /// Amplitude of waves of the friction along the wall, part of its mean: machining, wear, dust.
        friction_waviness: 0.0, (0.0, 0.5), (0.0, 0.1);
        /// Length of the waves of the friction: of the order of the distance of two steps.
        friction_wave_mm: 22.0, (2.0, 200.0), (11.0, 44.0);
        /// Factor of the tread's compliance along the wall: compound, and form of the hub.
        wind_up_compliance: 1.0, (0.1, 3.0), (0.7, 1.4);
    }
}

impl Default for Mismatch {
    fn default() -> Self {
        Self::usual()
    }
}

impl Mismatch {
    /// The wide draw of a seed: each value evenly within its range, a factor evenly in its
    /// logarithm. A value that is not neutral stays. `beyond`: names with another range.
    pub(crate) fn draw(&self, seed: u64, beyond: &[(&str, (f64, f64))]) -> Self {
        // Another stream than that of the spread and those of the sensors.
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0031_5a7c_0000_0000);
        let mut drawn = self.clone();
        for field in Self::FIELDS {
            let part: f64 = random.random();
            let other = beyond.iter().find(|(name, _)| *name == field.name);
            let Some((low, high)) = other.map(|(_, range)| *range).or(field.wide) else { continue };
            let value = if field.usual == 1.0 {
                low * (high / low).powf(part)
            } else {
                low + (high - low) * part
            };
            let place = (field.of)(&mut drawn);
            if *place == field.usual {
                *place = value;
            }
        }
        drawn
    }
}

impl RingParameters {
    /// This wheel and rubber with what the controller is not told of.
    pub(crate) fn with_mismatch(mut self, mismatch: &Mismatch) -> Self {
        let Mismatch { tread_stiffness, tread_stiffening, tread_tau, .. } = *mismatch;
        // Rubber that softens at once does not exist.
        let stiffening = (self.k_0 / self.k_inf * tread_stiffening).max(1.0);
        if (tread_stiffness, tread_stiffening) != (1.0, 1.0) {
            self.k_inf *= tread_stiffness;
            self.k_0 = self.k_inf * stiffening;
        }
        self.tau_s *= tread_tau;
        self.tread_thickness_mm = mismatch.tread_thickness * self.layer_mm;
        self.second_relaxation = mismatch.second_relaxation;
        self
    }
}

impl PlantParameters {
    /// This plant with what the controller is not told of.
    pub fn with_mismatch(mut self, mismatch: &Mismatch) -> Self {
        self.mu *= mismatch.friction;
        self.ring = self.ring.with_mismatch(mismatch);
        self.rolling_compression = mismatch.rolling_compression;
        self.wall = self.wall.with_form(Form {
            edge_radius_mm: mismatch.edge_radius_mm,
            taper_mm: mismatch.taper_mm,
            bend_mm: mismatch.bend_mm,
            length_mm: self.stops_mm.0 + self.stops_mm.1,
        });
        (self.screw_droop, self.screw_friction) = (mismatch.screw_droop, mismatch.screw_friction);
        self.friction_waves = (mismatch.friction_waviness, mismatch.friction_wave_mm);
        self.wind_up = mismatch.wind_up_compliance;
        self.run_out_mm = mismatch.run_out_mm;
        self.backlash_mm = mismatch.backlash_mm;
        self.pivot_friction_n = mismatch.pivot_friction_n;
        self.load_n += mismatch.weight_n;
        self.compression_patch = mismatch.compression_patch;
        self.compression_compliance_mm_per_n = mismatch.compression_compliance_mm_per_n;
        for mode in &mut self.modes {
            mode.frequency_hz *= mismatch.mode_frequency;
            mode.damping *= mismatch.mode_damping;
            mode.mass_kg *= mismatch.mode_mass;
            mode.shape *= mismatch.mode_shape;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    #[test]
    fn the_neutral_mismatch_changes_nothing() {
        let plant = Scenario::default().plant();
        assert_eq!(plant.clone().with_mismatch(&Mismatch::default()), plant);
    }

    #[test]
    fn every_key_changes_the_plant() {
        let nominal = Scenario::default().plant();
        for field in Mismatch::FIELDS {
            let mut mismatch = Mismatch::default();
            // One end of the range may be neutral.
            let (low, high) = field.wide.unwrap_or(field.range);
            *(field.of)(&mut mismatch) = if high == field.usual { low } else { high };
            assert_ne!(nominal.clone().with_mismatch(&mismatch), nominal, "{}", field.name);
        }
    }

    #[test]
    fn friction_waves_along_the_wall_about_its_mean() {
        let mismatch =
            Mismatch { friction_waviness: 0.1, friction_wave_mm: 20.0, ..Mismatch::default() };
        let plant = Scenario::default().plant().with_mismatch(&mismatch);
        for (position_mm, part) in [(0.0, 1.0), (5.0, 1.1), (10.0, 1.0), (35.0, 0.9)] {
            assert!((plant.friction_at(position_mm) / plant.mu - part).abs() < 1e-12);
        }
    }

    #[test]
    fn the_wide_draw_fills_its_ranges_and_keeps_what_was_set() {
        let set = Mismatch { backlash_mm: 0.4, ..Mismatch::default() };
        let draws: Vec<Mismatch> = (1..=500).map(|seed| set.draw(seed, &[])).collect();
        assert_eq!(draws[4], set.draw(5, &[]));
        for (index, field) in Mismatch::FIELDS.iter().enumerate() {
            let (low, high) = field.wide.unwrap_or((field.usual, field.usual));
            assert!(field.range.0 <= low && low <= high && high <= field.range.1);
            let values = draws.iter().map(|draw| draw.values().nth(index).unwrap().1);
            if field.name == "backlash_mm" {
                assert!(values.into_iter().all(|value| value == 0.4));
                continue;
            }
            assert!(low < high);
            let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                assert!((low..=high).contains(&x), "{}: {x}", field.name);
                (a.min(x), b.max(x))
            });
            let span = high - low;
            assert!(least < low + 0.02 * span && most > high - 0.02 * span, "{}", field.name);
        }
    }
}
