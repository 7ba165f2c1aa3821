//! How the tread gives way along the wall: a tread that pulls winds up against its wheel and creeps
//! ahead of it.
//!
//! Steadily rolling on a contact of length a it is displaced by `F / (k_t S)` and creeps by
//! `F / (k_t sigma S)`: k_t is its tangential stiffness, sigma its relaxation length, S what is left
//! of its stiffening s at that speed, `(a/2 + s v tau) / (a/2 + v tau)`.

#![deny(clippy::float_arithmetic)]

use crate::numeric::{checked, divide, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Seconds, q16};

/// Utilisation beyond which the wheel is about to slip; creep is no longer elastic.
const MOST: Ratio = q16(900_000);
/// Relaxation length over the length of the contact: pi G L / k_t of a bonded layer of rubber; its
/// reciprocal.
const PER_RELAXATION_LENGTH: Ratio = q16(476_190);
/// Contact on the wall over half the chord of the wheel at its compression: behind its deepest
/// point a tread with memory is clear of the wall early.
const CHORD: Ratio = q16(1_500_000);
/// Least length of a contact, mm.
const LEAST: Millimetres = q16(1_000_000);

/// What moves the tread along the wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulled {
    /// Radial force on the wheel, N.
    pub pressed: Newtons,
    /// Force that a corner adds to the load, N.
    pub climb: Newtons,
    /// Distance outwards to the edge under the wheel, mm; none on the wall.
    pub edge: Option<Millimetres>,
    /// The wall under the wheel carries too, or alone.
    pub on_wall: bool,
    /// Largest compression, mm.
    pub compression: Millimetres,
    /// Speed, mm/s.
    pub speed: MillimetresPerSecond,
}

/// The tread along the wall, under the load that the wheel carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Creep {
    /// Of the relaxed tread, mm/N.
    compliance: Q16,
    /// Twice the wheel's radius, mm.
    diameter: Millimetres,
    tau: Seconds,
    stiffening: Ratio,
    /// Axial load on this wheel, N, inwards.
    load: Newtons,
    friction: Ratio,
}

impl Creep {
    /// The creep of a rig; fails where a parameter is out of range.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub(super) fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let (plant, tread) = (&rig.plant, &rig.tread);
        Ok(Self {
            compliance: checked("tread.tangential_n_per_mm", 1.0 / tread.tangential_n_per_mm)?,
            diameter: checked("rig.wheel_radius_mm", 2.0 * rig.rig.wheel_radius_mm)?,
            tau: checked("tread.tau_s", tread.tau_s)?,
            stiffening: checked("tread.stiffening", tread.stiffening)?,
            load: checked("plant.top_load_n", plant.top_load_n * plant.top_load_share)?,
            friction: checked("plant.mu", plant.mu)?,
        })
    }

    /// Part by which the tread runs outwards of the axle, and by how much it is displaced outwards
    /// of it, mm. Load and corner push inwards in both directions.
    ///
    /// A contact that slides in part creeps by `2 (1 - sqrt(1 - u)) / u` times as much at the
    /// utilisation u, here up to its square.
    pub(super) fn outwards(&self, by: &Pulled) -> (Ratio, Millimetres) {
        if by.pressed <= Q16::ZERO {
            return (Q16::ZERO, Q16::ZERO);
        }
        let traction = self.load + by.climb;
        let used = divide(traction, self.friction * by.pressed).min(MOST);
        let slides = Q16::ONE + used * (q16(250_000) + used * q16(125_000));
        let sunk = self.diameter * by.compression.max(Q16::ZERO);
        let wall = (sqrt(sunk) * CHORD).max(LEAST);
        // From the edge to where the wheel clears the wall behind it.
        let corner = by.edge.map(|edge| (sqrt(edge * edge + sunk) - edge).max(LEAST));
        let contact = corner.unwrap_or(wall);
        let relaxes = by.speed.abs() * self.tau;
        let half = contact.half();
        let softer = divide(half + relaxes, half + self.stiffening * relaxes);
        let displaced = traction * self.compliance * softer;
        let renewed = if by.on_wall { wall } else { contact };
        (divide(displaced * slides * PER_RELAXATION_LENGTH, renewed), displaced)
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;

    proptest::proptest! {
        #[test]
        fn creep_and_displacement_are_those_of_the_force_transmitted(
            pressed in 20.0..150.0f64,
            compression in 0.1..1.5f64,
            speed in -30.0..30.0f64,
            climb in 0.0..0.4f64,
            edge in proptest::option::of(-5.0..13.0f64),
        ) {
            let rig = Rig::prototype();
            let climb = climb * pressed;
            let by = Pulled {
                pressed: Q16::from_num(pressed),
                climb: Q16::from_num(climb),
                edge: edge.map(Q16::from_num),
                on_wall: edge.is_none(),
                compression: Q16::from_num(compression),
                speed: Q16::from_num(speed),
            };
            let (creep, wound) = Creep::try_build(&rig).unwrap().outwards(&by);
            let traction = rig.plant.top_load_n * rig.plant.top_load_share + climb;
            let chord = (50.0 * compression).sqrt();
            let contact = edge.map_or(1.5 * chord, |d| (d * d + 50.0 * compression).sqrt() - d);
            let (contact, tread) = (contact.max(1.0), &rig.tread);
            let old = 0.5 * contact;
            let relaxes = speed.abs() * tread.tau_s;
            let stiffer = (old + tread.stiffening * relaxes) / (old + relaxes);
            let exact = traction / tread.tangential_n_per_mm / stiffer;
            proptest::prop_assert!((wound.to_num::<f64>() - exact).abs() < 2e-4 + 2e-3 * exact);
            let used = (traction / pressed / rig.plant.mu).min(0.9);
            let slides = 2.0 * (1.0 - (1.0 - used).sqrt()) / used;
            let exact = exact * slides / (2.1 * contact);
            // A series of three terms misses 4 % of it at u = 0.7, and less below.
            let within = if used < 0.7 { 0.04 } else { 0.15 };
            proptest::prop_assert!((creep.to_num::<f64>() - exact).abs() < 2e-4 + within * exact);
        }

        #[test]
        fn creep_stays_small_whatever_presses(pressed in proptest::prelude::any::<i32>()) {
            let by = Pulled {
                pressed: Q16::from_bits(pressed),
                climb: Q16::ZERO,
                edge: None,
                on_wall: true,
                compression: Q16::from_num(0.3),
                speed: Q16::ZERO,
            };
            let got = Creep::try_build(&Rig::prototype()).unwrap().outwards(&by).0;
            proptest::prop_assert!((0.0..0.05).contains(&got.to_num::<f64>()), "{got}");
        }
    }
}
