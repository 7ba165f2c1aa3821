//! Axial position: the wheel's travel, corrected at every recognised step.

#![deny(clippy::float_arithmetic)]

use crate::units::{Millimetres, Q16, Ratio, Travel, q16};

/// Part of a step's residual that is taken for odometry error; the rest is left to
/// the step's own tolerance. Half: creep over 22 mm and the machining of a sleeve
/// are alike.
const CORRECTION: Ratio = q16(500_000);

/// Largest correction at one step, mm: beyond it the step is not the one expected.
const LARGEST: Millimetres = q16(2_000_000);

/// Offset of the position from the wheel's travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Odometry {
    offset: Travel,
}

impl Odometry {
    /// Position by this travel, mm from the stow end.
    pub fn position(&self, travel: Travel) -> Millimetres {
        let position = travel.saturating_add(self.offset);
        Q16::narrow(position)
    }

    /// Declares that the wheel stands at `position`.
    pub fn set(&mut self, travel: Travel, position: Millimetres) {
        self.offset = position.widen().saturating_sub(travel);
    }

    /// Takes over part of the difference between where a step was found and where
    /// the table has it, mm.
    pub fn correct(&mut self, residual: Millimetres) {
        let share = (residual * CORRECTION).clamp(-LARGEST, LARGEST);
        self.offset = self.offset.saturating_sub(share.widen());
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use crate::units::Q16;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_position_set_is_the_position_read(travel in -1e4..1e4f64, at in -100.0..200.0f64) {
            let mut odometry = Odometry::default();
            let travel = Travel::from_num(travel);
            odometry.set(travel, Q16::from_num(at));
            let got = odometry.position(travel).to_num::<f64>();
            prop_assert!((got - at).abs() < 2e-5);
        }

        #[test]
        fn a_residual_moves_the_position_towards_the_table(residual in -3.0..3.0f64) {
            let mut odometry = Odometry::default();
            odometry.correct(Q16::from_num(residual));
            let got = odometry.position(Travel::ZERO).to_num::<f64>();
            prop_assert!((got + 0.5 * residual).abs() < 1e-4, "{got}");
        }
    }
}
