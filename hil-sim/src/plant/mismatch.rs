//! What the plant has and the controller is not told. What both know is in `rig.*`,
//! `tread.*`, `plant.*` and the like; a value here acts on the plant alone.

use documented::DocumentedFields;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::draw::PlantParameters;
use super::ring::RingParameters;
use super::wall::Form;

/// Departures of the plant from the rig that the controller knows. Factors are neutral at 1,
/// everything else at 0, but for [`Mismatch::rolling_compression`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, DocumentedFields)]
#[serde(deny_unknown_fields)]
pub struct Mismatch {
    /// Factor of the friction of tread on wall: dust, moisture, polish.
    pub friction: f64,
    /// Factor of the tread's relaxed stiffness: compound and thickness.
    pub tread_stiffness: f64,
    /// Factor of the tread's stiffening, instant over relaxed stiffness: compound.
    pub tread_stiffening: f64,
    /// Factor of the tread's time constant: compound, and its temperature; 10 K change it
    /// two- to threefold.
    pub tread_tau: f64,
    /// Part of the compression by which the rolling radius is less than the undeformed one:
    /// a third by tyre textbooks.
    pub rolling_compression: f64,
    /// Radius of the edge of every step: deburred, worn.
    pub edge_radius_mm: f64,
    /// Rise of the wall towards the pillar from the stow end to the end of travel: the bore's
    /// taper.
    pub taper_mm: f64,
    /// Rise of the wall towards the pillar in the middle of the travel above the line between
    /// the ends: a bent sleeve.
    pub bend_mm: f64,
    /// Distance of the wheel's axis of rotation from the axis of its rim.
    pub run_out_mm: f64,
    /// Travel of the tread when the drive force changes sign: play in the gearbox.
    pub backlash_mm: f64,
    /// Coulomb friction in the arm's pivot, as force at the wheel that the preload sensor does
    /// not see.
    pub pivot_friction_n: f64,
    /// Axial load beside the top load: the weight of what moves on an upright rig.
    pub weight_n: f64,
    /// What the compression sensor measures: 0 the deepest point of the tread, 1 the mean
    /// depth of the patch that carries.
    pub compression_patch: f64,
    /// Compliance of what the compression sensor is mounted on: it adds to the reading.
    pub compression_compliance_mm_per_n: f64,
    /// Factor of the frequencies of the arm's modes: mounting, and the mass of cables.
    pub mode_frequency: f64,
    /// Factor of the modes' damping ratio, which is 0.02, chosen.
    pub mode_damping: f64,
    /// Factor of the modal mass, which is 0.2 kg, chosen.
    pub mode_mass: f64,
    /// Part of the force at the tread that drives a mode: its shape there, 1, chosen.
    pub mode_shape: f64,
    /// Thickness of the tread as a layer of incompressible rubber, whose elements push each
    /// other; 0: independent elements, as the controller's model has them.
    pub tread_thickness_mm: f64,
    /// Spread s of two relaxations of equal share in place of the one at tau: at tau/s and
    /// tau s.
    pub second_relaxation: f64,
    /// Part of the pre-tightener's speed that raising the preload limit takes: its motor has that
    /// part of its stall torque to give. At the limit it still has its slew.
    pub screw_droop: f64,
    /// Part of full duty that the friction of the pre-tightener's screw takes: below it nothing
    /// moves.
    pub screw_friction: f64,
    /// Amplitude of waves of the friction along the wall, part of its mean: machining, wear, dust.
    pub friction_waviness: f64,
    /// Length of the waves of the friction: of the order of the distance of two steps.
    pub friction_wave_mm: f64,
    /// Part of the tread's compliance along the wall that the plant has: 0 none, as the controller
    /// believes, 1 that of a layer of rubber. Not drawn.
    pub wind_up: f64,
    /// Factor of that compliance: compound, and form of the hub.
    pub wind_up_compliance: f64,
}

/// A key of [`Mismatch`].
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Value without effect.
    pub neutral: f64,
    /// Values that it takes.
    pub range: (f64, f64),
    /// Range of the wide draw; of no width: it is not drawn.
    pub wide: (f64, f64),
    /// Its place.
    of: fn(&mut Mismatch) -> &mut f64,
}

impl Field {
    /// Whether the wide draw draws it.
    pub fn is_drawn(&self) -> bool {
        self.wide.0 < self.wide.1
    }
}

/// One line a key: neutral value, range, range of the wide draw.
macro_rules! fields {
    ($($name:ident: $neutral:expr, $range:expr, $wide:expr;)*) => {
        /// All keys, in the order in which they are drawn: a new one comes last.
        pub const FIELDS: &[Field] = &[$(Field {
            name: stringify!($name),
            neutral: $neutral,
            range: $range,
            wide: $wide,
            of: |mismatch| &mut mismatch.$name,
        }),*];

        impl Default for Mismatch {
            fn default() -> Self {
                Self { $($name: $neutral),* }
            }
        }
    };
}

fields! {
    friction: 1.0, (0.0, 3.0), (0.9, 1.1);
    tread_stiffness: 1.0, (0.3, 3.0), (0.85, 1.15);
    tread_stiffening: 1.0, (0.3, 3.0), (0.85, 1.15);
    tread_tau: 1.0, (0.3, 3.0), (0.3, 3.0);
    rolling_compression: 1.0 / 3.0, (0.0, 1.0), (0.2, 0.5);
    edge_radius_mm: 0.0, (0.0, 0.5), (0.0, 0.5);
    taper_mm: 0.0, (-0.5, 0.5), (-0.1, 0.1);
    bend_mm: 0.0, (-0.5, 0.5), (-0.1, 0.1);
    run_out_mm: 0.0, (0.0, 0.1), (0.0, 0.05);
    backlash_mm: 0.0, (0.0, 0.5), (0.0, 0.1);
    pivot_friction_n: 0.0, (0.0, 5.0), (0.0, 1.0);
    weight_n: 0.0, (0.0, 20.0), (0.0, 2.0);
    compression_patch: 0.0, (0.0, 1.0), (0.0, 1.0);
    compression_compliance_mm_per_n: 0.0, (0.0, 0.01), (0.0, 0.001);
    mode_frequency: 1.0, (0.5, 2.0), (0.95, 1.05);
    mode_damping: 1.0, (0.1, 10.0), (0.5, 2.0);
    mode_mass: 1.0, (0.1, 10.0), (0.5, 2.0);
    mode_shape: 1.0, (0.0, 2.0), (0.5, 1.0);
    tread_thickness_mm: 0.0, (0.0, 16.0), (4.0, 12.0);
    second_relaxation: 1.0, (1.0, 10.0), (1.0, 4.0);
    screw_droop: 0.0, (0.0, 0.5), (0.0, 0.2);
    screw_friction: 0.0, (0.0, 0.2), (0.0, 0.05);
    friction_waviness: 0.0, (0.0, 0.5), (0.0, 0.1);
    friction_wave_mm: 22.0, (2.0, 200.0), (11.0, 44.0);
    wind_up: 0.0, (0.0, 1.0), (0.0, 0.0);
    wind_up_compliance: 1.0, (0.1, 3.0), (0.7, 1.4);
}

impl Mismatch {
    /// The wide draw of a seed: each value evenly within its range, a factor evenly in its
    /// logarithm. A value that is not neutral stays. `beyond`: names with another range.
    pub fn draw(&self, seed: u64, beyond: &[(&str, (f64, f64))]) -> Self {
        // Another stream than that of the spread and those of the sensors.
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0031_5a7c_0000_0000);
        let mut drawn = self.clone();
        for field in FIELDS {
            let part: f64 = random.random();
            let other = beyond.iter().find(|(name, _)| *name == field.name);
            let (low, high) = other.map_or(field.wide, |(_, range)| *range);
            let value = if field.neutral == 1.0 {
                low * (high / low).powf(part)
            } else {
                low + (high - low) * part
            };
            let place = (field.of)(&mut drawn);
            if field.is_drawn() && *place == field.neutral {
                *place = value;
            }
        }
        drawn
    }

    /// Every key with its value.
    pub fn values(&self) -> impl Iterator<Item = (&'static Field, f64)> {
        let mut all = self.clone();
        FIELDS.iter().map(move |field| (field, *(field.of)(&mut all)))
    }
}

impl RingParameters {
    /// This wheel and rubber with what the controller is not told of.
    pub fn with_mismatch(mut self, mismatch: &Mismatch) -> Self {
        let Mismatch { tread_stiffness, tread_stiffening, tread_tau, .. } = *mismatch;
        // Rubber that softens at once does not exist.
        let stiffening = (self.k_0 / self.k_inf * tread_stiffening).max(1.0);
        if (tread_stiffness, tread_stiffening) != (1.0, 1.0) {
            self.k_inf *= tread_stiffness;
            self.k_0 = self.k_inf * stiffening;
        }
        self.tau_s *= tread_tau;
        self.tread_thickness_mm = mismatch.tread_thickness_mm;
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
        self.wind_up = (mismatch.wind_up, mismatch.wind_up_compliance);
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
        for (field, value) in Mismatch::default().values() {
            assert_eq!(value, field.neutral, "{}", field.name);
        }
    }

    #[test]
    fn every_key_is_listed_once_and_changes_the_plant() {
        let names: Vec<&str> = FIELDS.iter().map(|field| field.name).collect();
        assert_eq!(names, Mismatch::FIELD_NAMES);
        let nominal = Scenario::default().plant();
        for field in FIELDS {
            let mut mismatch = Mismatch::default();
            // One end of the range may be neutral.
            let (low, high) = if field.is_drawn() { field.wide } else { field.range };
            *(field.of)(&mut mismatch) = if high == field.neutral { low } else { high };
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
        for (index, field) in FIELDS.iter().enumerate() {
            let (low, high) = field.wide;
            assert!(field.range.0 <= low && low <= high && high <= field.range.1);
            let values = draws.iter().map(|draw| draw.values().nth(index).unwrap().1);
            let stays = match field.name {
                "backlash_mm" => Some(0.4),
                "wind_up" => Some(0.0),
                _ => None,
            };
            if let Some(stays) = stays {
                assert!(values.into_iter().all(|value| value == stays), "{}", field.name);
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
