//! How the wheel rises over a corner: for the spring that the climb compresses and
//! the force that it costs.

#![deny(clippy::float_arithmetic)]

use crate::model::formula::Formula;
use crate::numeric::{Table, checked};
use crate::rig::{Rig, RigError};
use crate::supervise::Direction;
use crate::units::{Millimetres, Q16, Ratio};

/// Tread depth at the corner that the profile assumes, as a part of the free run's
/// largest; it varies little over the preloads of a crossing.
const DEPTH_PART: f64 = 0.2;

/// Rise of the centre per axial way over the distance to the face, dimensionless:
/// `dy/dx = d / sqrt((R-c)^2 - d^2)` on the corner, run in linearly from the first
/// touch to lift-off. Source: circle of radius R - c rolling about a point.
#[derive(Clone, Debug)]
pub struct Rise {
    slope: Table<65>,
    /// Distance of first touch, mm.
    touch: Millimetres,
    /// Distance at which the wheel lies on the edge again, seen from the upper wall, mm.
    edge: Millimetres,
}

impl Rise {
    /// Profile of a rig.
    ///
    /// # Errors
    /// [`RigError`] if a length is out of range.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let (r, h) = (rig.rig.wheel_radius_mm, rig.rig.step_height_mm);
        let formula = Formula::new(rig);
        let depth = DEPTH_PART * h;
        let reach = r - depth;
        let below = r - h;
        let lift = libm::sqrt((reach * reach - below * below).max(0.01));
        // A tread compressed by a seventh of the step touches earlier than a free one.
        let low = r - h - h / 7.0;
        let touch = libm::sqrt(r * r - low * low).max(formula.free_run_mm());
        let on_corner = |d: f64| d / libm::sqrt(reach * reach - d * d);
        let slope = Table::build(0.0, touch, |d| {
            if d <= lift {
                on_corner(d)
            } else {
                on_corner(lift) * (touch - d) / (touch - lift)
            }
        })
        .ok_or(RigError::OutOfRange {
            key: "rig.step_height_mm",
            value: h,
            min: 0.5,
            max: 8.0,
        })?;
        // Half the patch on the smooth wall at a tenth of the step's height in depth.
        let patch = libm::sqrt(r * r - (r - 0.1 * h) * (r - 0.1 * h));
        Ok(Self {
            slope,
            touch: checked("rig.step_height_mm", touch)?,
            edge: checked("rig.wheel_radius_mm", patch)?,
        })
    }

    /// Distance to the face at which the corner may first be felt on this way, mm.
    #[must_use]
    pub const fn first_contact(&self, direction: Direction) -> Millimetres {
        match direction {
            Direction::Deploy => self.touch,
            Direction::Retract => self.edge,
        }
    }

    /// Rise per axial way outwards with the face `ahead` mm outwards of the centre;
    /// zero away from a corner.
    #[must_use]
    pub fn slope(&self, ahead: Millimetres) -> Ratio {
        if ahead <= Q16::ZERO || ahead >= self.touch {
            Q16::ZERO
        } else {
            self.slope.eval(ahead)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_integrates_to_the_step_height() {
        let rise = Rise::try_build(&Rig::prototype()).unwrap();
        let mut height = 0.0;
        for i in 0..16_000 {
            height += rise.slope(Q16::from_num(f64::from(i) * 1e-3)).to_num::<f64>() * 1e-3;
        }
        // From the compressed tread before to the corner's depth at the top.
        assert!((height - 4.0).abs() < 0.4, "{height}");
    }
}
