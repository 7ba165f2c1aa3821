//! Rise of the wheel over a corner, which compresses the spring, and the drive force that it
//! takes.

#![deny(clippy::float_arithmetic)]

use crate::numeric::{Table, checked};
use crate::rig::{Rig, RigError};
use crate::units::{Direction, Millimetres, Q16, Ratio};

/// Tread depth at the corner, as a part of the step height; it varies little over
/// the preloads of a crossing.
const CORNER_PART: f64 = 0.28;
/// Tread depth on the continuous wall, likewise.
const WALL_PART: f64 = 0.08;

/// Motor force over radial force times the corner's inclination: part of the radial
/// force comes from traction itself, `1/(cos + u sin)` against `1/cos` at the
/// utilisation of a crossing.
const DRIVE_SLOPE_PART: f64 = 0.85;

/// Travel from touch-down until the corner is free, over that from touch to lift-off.
const BACK_PART: f64 = 0.3;

/// Rise of the centre per axial travel over the distance to the face, dimensionless: on the
/// corner a circle of radius R - c rolls about a point, `dy/dx = d / sqrt((R-c)^2 - d^2)`; the
/// tread recovers from its depth at the corner to that on the wall, as a triangle that ends
/// half a patch behind the edge; from the first touch it runs in with the square of the
/// distance.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CornerProfile {
    slope: Table<97>,
    /// Tangent of the contact's mean inclination: what the climb costs the motor, per
    /// radial force. It runs ahead of the rise by the energy that the tread stores.
    drive_slope: [Table<65>; 2],
    /// Distance of first touch, mm.
    touch: Millimetres,
    /// Half the patch on the continuous wall: distance behind the edge at which it is
    /// clear of it, mm.
    patch: Millimetres,
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
        // Lift-off, and where the circle has taken over from the run-in.
        let lift = libm::sqrt((reach * reach - (r - h) * (r - h)).max(0.01));
        let rolls = 0.93 * lift;
        let on_corner = |d: f64| if d > 0.0 { d / libm::sqrt(reach * reach - d * d) } else { 0.0 };
        let most = 2.0 * (corner - wall) / (rolls + patch);
        let recovery = |d: f64| {
            let part = if d > 0.0 { 1.0 - d / rolls } else { 1.0 + d / patch };
            most * part.max(0.0)
        };
        let high = RigError::OutOfRange { key: "rig.step_height_mm", value: h, min: 0.5, max: 8.0 };
        let slope = Table::build(-patch, touch, |d| {
            if d <= rolls {
                on_corner(d) + recovery(d)
            } else {
                let part = (touch - d) / (touch - rolls);
                on_corner(rolls) * part * part
            }
        })
        .ok_or(high)?;
        // The load passes from wall to corner between first touch and lift-off. Back it passes
        // within a few tenths of that travel: the relaxed tread is still deep at the corner.
        let drive_slope = |ends: f64| {
            Table::build(0.0, touch, |d| {
                let full = DRIVE_SLOPE_PART * on_corner(d.min(lift));
                let part = ((ends - d) / (ends - lift)).clamp(0.0, 1.0);
                full * part
            })
            .ok_or(high)
        };
        let back = lift + BACK_PART * (touch - lift);
        Ok(Self {
            slope,
            drive_slope: [drive_slope(touch)?, drive_slope(back)?],
            touch: checked("rig.step_height_mm", touch)?,
            patch: checked("rig.wheel_radius_mm", patch)?,
        })
    }

    /// Distance to the face at which the corner may first touch in this direction, mm.
    pub const fn first_contact(&self, direction: Direction) -> Millimetres {
        match direction {
            Direction::Deploy => self.touch,
            Direction::Retract => self.patch,
        }
    }

    /// Distance behind an edge after which the patch is clear of it, mm.
    pub const fn patch(&self) -> Millimetres {
        self.patch
    }

    /// Motor force per radial force that a corner `ahead` mm outwards of the centre
    /// costs; zero away from it.
    pub fn drive_slope(&self, direction: Direction, ahead: Millimetres) -> Ratio {
        let [out, back] = &self.drive_slope;
        if ahead <= Q16::ZERO || ahead >= self.touch {
            return Q16::ZERO;
        }
        match direction {
            Direction::Deploy => out.eval(ahead),
            Direction::Retract => back.eval(ahead),
        }
    }

    /// Rise per axial travel outwards with the face `ahead` mm outwards of the centre,
    /// negative behind the edge; zero away from a corner.
    pub fn slope(&self, ahead: Millimetres) -> Ratio {
        if ahead <= -self.patch || ahead >= self.touch { Q16::ZERO } else { self.slope.eval(ahead) }
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
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

    proptest::proptest! {
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
