//! Slip on a corner. The edge under the wheel shows the axle's place, whatever the tread does: a
//! face that seems to move outwards as fast as the tread turns is a wheel that slips.

#![deny(clippy::float_arithmetic)]

use crate::numeric::sqrt;
use crate::units::{Millimetres, Q16, Ratio, Travel, q16};

/// Travel of the tread over which tread and edge are compared, mm: ten steps of the arm's code, as
/// the place of an edge shows them at lift-off.
const WINDOW: Millimetres = q16(400_000);
/// Part of it that the face must seem to move, for a slip to begin and to go on. A step 0.5 mm
/// off its table's height, or a sensor of the mean compression, moves it by a third, creep and
/// chord by a tenth.
const BEGINS: Ratio = q16(650_000);
const GOES_ON: Ratio = q16(500_000);
/// Largest distance that a face seems to move beyond the tread's travel, mm: a window in which the
/// axle slides back by as much.
const MOST: Millimetres = q16(800_000);
/// Windows without slip after which the wheel grips again.
const GRIPS_AFTER: u8 = 2;

/// One sigma of a measured slip, mm, and the part of it that adds: what a window hides at its ends,
/// and how the face moves without slip. Chosen on drawn rigs, wider than the 0.25 mm that slips there
/// are off by.
const WINDOW_SIGMA: Millimetres = q16(300_000);
const PART_SIGMA: Ratio = q16(200_000);

/// Slip of one crossing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CornerSlip {
    /// Travel of the tread and face by the corner at the last comparison.
    from: Option<(Travel, Millimetres)>,
    /// What the face moved in the window before, if that may have been slip.
    doubtful: Millimetres,
    /// Windows until the wheel counts as gripping.
    slipping: u8,
    /// Slip so far, mm: travel of the tread that moved no axle, or of the axle that no tread made.
    pub lost: Millimetres,
}

impl CornerSlip {
    /// A tick with this travel of the tread and the face where the corner has it. Returns by how
    /// much the axle is further in than the tread has it, once that is known, mm. The load
    /// pulls inwards, so nothing slips outwards.
    pub(super) fn step(&mut self, travel: Travel, face: Millimetres) -> Millimetres {
        let Some((from, was)) = self.from else {
            self.from = Some((travel, face));
            return Q16::ZERO;
        };
        let turned = Q16::narrow(travel.saturating_sub(from)).abs();
        let moved = face - was;
        if turned < WINDOW && moved < WINDOW {
            return Q16::ZERO;
        }
        // More than the tread turned and the axle slides back is a sensor that errs.
        if moved > turned + MOST {
            *self = Self { from: Some((travel, face)), lost: self.lost, ..Self::default() };
            return Q16::ZERO;
        }
        let doubtful = moved > turned * GOES_ON;
        let slips = if self.slipping > 0 { doubtful } else { moved > turned * BEGINS };
        let lost = match (slips, self.slipping) {
            (true, 0) => moved + self.doubtful,
            (true, _) => moved,
            (false, _) => Q16::ZERO,
        };
        self.slipping = if slips { GRIPS_AFTER } else { self.slipping.saturating_sub(1) };
        self.doubtful = if doubtful && !slips { moved } else { Q16::ZERO };
        self.lost += lost;
        self.from = Some((travel, face - lost));
        lost
    }

    /// A run begins: nothing is known of how wheel and axle moved since the last one.
    pub(super) fn begin_run(&mut self) {
        *self = Self { lost: self.lost, ..Self::default() };
    }

    /// The wheel slips now.
    pub const fn is_slipping(&self) -> bool {
        self.slipping > 0
    }

    /// One sigma of the slip so far, mm.
    pub fn sigma(&self) -> Millimetres {
        WINDOW_SIGMA + self.lost * PART_SIGMA
    }

    /// One sigma that the last `lost` of it adds to the position, mm: what the parts of a slip are
    /// off by has one cause, so that in all it is [`Self::sigma`].
    pub(super) fn sigma_of(&self, lost: Millimetres) -> Millimetres {
        let now = self.sigma();
        let begins = lost >= self.lost;
        let before = if begins { Q16::ZERO } else { now - lost * PART_SIGMA };
        sqrt((now - before) * (now + before))
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rolls 12 mm towards a face at 20 mm of which the tread slips over `slip` mm from `at` mm
    /// on, with the face seen with this noise and drift, mm and mm/mm; returns what was found.
    fn found(at: f64, slip: f64, noise: f64, drift: f64) -> f64 {
        let (mut watch, mut taken) = (CornerSlip::default(), 0.0);
        for tick in 0..1200 {
            let turned = 0.01 * f64::from(tick);
            let slipped = (turned - at).clamp(0.0, slip);
            let jitter = noise * f64::from(tick * 7919 % 101 - 50) / 50.0;
            let face = 20.0 + slipped - taken + drift * turned + jitter;
            taken += watch.step(Travel::from_num(turned), Q16::from_num(face)).to_num::<f64>();
        }
        assert_eq!(watch.lost.to_num::<f64>(), taken);
        taken
    }

    proptest! {
        #[test]
        fn a_slip_is_measured_within_a_window(
            at in 0.5..5.0f64,
            // Less may hide in two windows.
            slip in 0.55..6.0f64,
            noise in 0.0..0.03f64,
        ) {
            let got = found(at, slip, noise, 0.0);
            prop_assert!((got - slip).abs() < 0.45, "{got} of {slip}");
        }

        #[test]
        fn a_wheel_that_grips_slips_nothing(noise in 0.0..0.06f64, drift in -0.5..0.3f64) {
            prop_assert_eq!(found(0.0, 0.0, noise, drift), 0.0);
        }
    }

    #[test]
    fn what_a_slip_in_parts_adds_is_as_unsure_as_the_whole() {
        let mut slip = CornerSlip::default();
        let variance: f64 = (0..10)
            .map(|_| {
                slip.lost += q16(400_000);
                slip.sigma_of(q16(400_000)).to_num::<f64>().powi(2)
            })
            .sum();
        let whole = slip.sigma().to_num::<f64>();
        assert!((variance.sqrt() - whole).abs() < 1e-3, "{variance} {whole}");
    }

    #[test]
    fn a_wheel_that_slides_at_rest_is_found_too() {
        let mut watch = CornerSlip::default();
        let lost: f64 = (0..100)
            .map(|tick| {
                let face = Q16::from_num(20.0 + 0.01 * f64::from(tick)) - watch.lost;
                watch.step(Travel::ZERO, face).to_num::<f64>()
            })
            .sum();
        assert!(watch.is_slipping() && (0.59..1.0).contains(&lost), "{lost}");
    }
}
