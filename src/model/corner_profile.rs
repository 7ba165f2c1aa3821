//! Rise of the wheel over a corner, which compresses the spring, and the drive force that it takes.

use crate::numeric::{checked, divide, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{Direction, Millimetres, Q16, Ratio, q16};

/// Tread depth at the corner, as a part of the step height; it varies little over
/// the preloads of a crossing.
const CORNER_PART: f64 = 0.28;
/// Tread depth on the continuous wall, likewise.
const WALL_PART: f64 = 0.08;

/// Motor force over radial force times the corner's inclination: part of the radial force comes
/// from traction itself, `1/(cos + u sin)` against `1/cos` at the utilisation of a crossing.
const DRIVE_SLOPE_PART: Ratio = q16(850_000);

/// Travel from touch-down until the corner is free, over that from touch to lift-off.
const BACK_PART: f64 = 0.3;

/// Rise of the centre per axial travel over the distance to the face, dimensionless: on the corner
/// a circle of radius R - c rolls about a point, `dy/dx = d / sqrt((R-c)^2 - d^2)`; the tread
/// recovers from its depth at the corner to that on the wall, as a triangle that ends half a patch
/// behind the edge; from the first touch it runs in with the square of the distance.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CornerProfile {
    /// Distance of the centre from an edge that carries, mm.
    reach: Millimetres,
    /// Distance of first touch, mm.
    touch: Millimetres,
    /// Distance within which the circle has taken over from the run-in, and its slope there.
    rolls: Millimetres,
    at_rolls: Ratio,
    /// Distance at lift-off, mm.
    lift: Millimetres,
    /// Half the patch on the continuous wall: distance behind the edge at which it is
    /// clear of it, mm.
    patch: Millimetres,
    /// Slope of the recovering tread at the face.
    recovery: Ratio,
    /// Reciprocals of the run-in, of the circle, of the patch, and of the distances over which the
    /// corner takes the load over on the way out and back, 1/mm.
    per: [Q16; 5],
}

impl CornerProfile {
    /// Profile of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let (r, h) = (rig.rig.wheel_radius_mm, rig.rig.step_height_mm);
        let (corner, wall) = (CORNER_PART * h, WALL_PART * h);
        let reach = r - corner;
        let low = r - h - wall;
        let touch = libm::sqrt(r * r - low * low).max(rig.corner_reach_mm());
        let patch = 1.4 * libm::sqrt(r * r - (r - wall) * (r - wall));
        let lift = libm::sqrt((reach * reach - (r - h) * (r - h)).max(0.01));
        let rolls = 0.93 * lift;
        let number = |value: f64| checked("rig.step_height_mm", value);
        let mut per = [Q16::ZERO; 5];
        let back = BACK_PART * (touch - lift);
        for (per, of) in per.iter_mut().zip([touch - rolls, rolls, patch, touch - lift, back]) {
            *per = number(1.0 / of)?;
        }
        Ok(Self {
            reach: number(reach)?,
            touch: number(touch)?,
            rolls: number(rolls)?,
            at_rolls: number(rolls / libm::sqrt(reach * reach - rolls * rolls))?,
            lift: number(lift)?,
            patch: number(patch)?,
            recovery: number(2.0 * (corner - wall) / (rolls + patch))?,
            per,
        })
    }

    /// Slope of a circle that rolls about an edge at this distance ahead.
    fn on_edge(&self, ahead: Millimetres) -> Ratio {
        divide(ahead, sqrt(self.reach * self.reach - ahead * ahead))
    }

    /// Distance to the face at which the corner may first touch in this direction, mm.
    pub const fn first_contact(&self, direction: Direction) -> Millimetres {
        if matches!(direction, Direction::Deploy) { self.touch } else { self.patch }
    }

    /// Distance behind an edge after which the patch is clear of it, mm.
    pub const fn patch(&self) -> Millimetres {
        self.patch
    }

    /// Motor force per radial force that a corner `ahead` mm outwards of the centre
    /// costs; zero away from it.
    pub fn drive_slope(&self, direction: Direction, ahead: Millimetres) -> Ratio {
        if ahead <= Q16::ZERO || ahead >= self.touch {
            return Q16::ZERO;
        }
        // The load passes from wall to corner between first touch and lift-off. Back it passes
        // within a few tenths of that travel: the relaxed tread is still deep at the corner.
        let [.., out, back] = self.per;
        let per = if direction == Direction::Deploy { out } else { back };
        let part = Ratio::ONE - (ahead - self.lift).max(Q16::ZERO) * per;
        self.on_edge(ahead.min(self.lift)) * DRIVE_SLOPE_PART * part.max(Ratio::ZERO)
    }

    /// Rise per axial travel outwards with the face `ahead` mm outwards of the centre,
    /// negative behind the edge; zero away from a corner.
    pub fn slope(&self, ahead: Millimetres) -> Ratio {
        let [run_in, circle, patch, ..] = self.per;
        if ahead <= -self.patch || ahead >= self.touch {
            Q16::ZERO
        } else if ahead > self.rolls {
            let part = (self.touch - ahead) * run_in;
            self.at_rolls * part * part
        } else if ahead > Q16::ZERO {
            self.on_edge(ahead) + self.recovery * (Ratio::ONE - ahead * circle)
        } else {
            self.recovery * (Ratio::ONE + ahead * patch)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_integrates_to_the_step_height() {
        let corner = CornerProfile::try_build(&Rig::prototype()).unwrap();
        let mut height = 0.0;
        for i in -8_000..16_000 {
            height += corner.slope(Q16::from_num(f64::from(i) * 1e-3)).to_num::<f64>() * 1e-3;
        }
        assert!((height - 4.0).abs() < 0.2, "{height}");
    }

    /// The shape that the type describes, in f64: slope, and the drive's part out and back.
    fn exact(rig: &Rig, d: f64) -> [f64; 3] {
        let (r, h) = (rig.rig.wheel_radius_mm, rig.rig.step_height_mm);
        let (reach, wall) = (r - 0.28 * h, 0.08 * h);
        let touch = (r * r - (r - h - wall).powi(2)).sqrt().max(rig.corner_reach_mm());
        let patch = 1.4 * (r * r - (r - wall).powi(2)).sqrt();
        let lift = (reach * reach - (r - h).powi(2)).max(0.01).sqrt();
        let rolls = 0.93 * lift;
        let circle = |d: f64| (d / reach).asin().tan();
        let recovers = |part: f64| 0.4 * h / (rolls + patch) * part;
        let slope = match d {
            d if d <= -patch || d >= touch => 0.0,
            d if d <= 0.0 => recovers(1.0 + d / patch),
            d if d <= rolls => circle(d) + recovers(1.0 - d / rolls),
            d => circle(rolls) * ((touch - d) / (touch - rolls)).powi(2),
        };
        let drive = |over: f64| match d {
            d if d <= 0.0 || d >= touch => 0.0,
            d => 0.85 * circle(d.min(lift)) * (1.0 - (d - lift).max(0.0) / over).max(0.0),
        };
        [slope, drive(touch - lift), drive(0.3 * (touch - lift))]
    }

    proptest::proptest! {
        #[test]
        fn slopes_have_the_shape_that_is_described(
            radius in 15.0..60.0f64, height in 2.0..6.0f64, ahead in -10.0..30.0f64,
        ) {
            let mut rig = Rig::prototype();
            (rig.rig.wheel_radius_mm, rig.rig.step_height_mm) = (radius, height);
            let corner = CornerProfile::try_build(&rig).unwrap();
            let at = Q16::from_num(ahead);
            let back = corner.drive_slope(Direction::Retract, at);
            let found = [corner.slope(at), corner.drive_slope(Direction::Deploy, at), back];
            // At an end of the range the rounded distance may lie on the other side.
            let [low, high] = [-1e-3, 1e-3].map(|by| exact(&rig, ahead + by));
            for ((found, low), high) in found.into_iter().zip(low).zip(high) {
                let found: f64 = found.to_num();
                let within = low.min(high) - 1e-3..=low.max(high) + 1e-3;
                proptest::prop_assert!(within.contains(&found), "{found} {within:?}");
            }
        }

        #[test]
        fn slopes_are_those_of_a_wheel_whatever_the_distance(bits in proptest::prelude::any::<i32>()) {
            let corner = CornerProfile::try_build(&Rig::prototype()).unwrap();
            let ahead = Q16::from_bits(bits);
            let within = |x: Ratio| (-0.01..1.0).contains(&x.to_num::<f64>());
            proptest::prop_assert!(within(corner.slope(ahead)));
            for direction in Direction::ALL {
                proptest::prop_assert!(within(corner.drive_slope(direction, ahead)));
            }
        }
    }
}
