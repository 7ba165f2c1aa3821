//! Slip on a corner. The edge under the wheel shows the axle's place, whatever the tread does: the
//! face seems to move outwards by what slips.
//!
//! A step that is off its table's height by e moves it, too: with the edge `a` ahead of the centre and
//! `o` beside it, by `e o / a`, which grows as the wheel comes up. So does a compression read low by m,
//! by `m r / a` on a wheel of radius r there. What the largest e and m cannot explain is slip: a
//! cumulative sum (Page 1954) with their motion as its reference and the noise of the arm's code as its
//! threshold.

use super::crossing::HEIGHT_MOST;
use super::landing::OnEdge;
use crate::numeric::{divide, sqrt};
use crate::units::{Millimetres, Q16, Ratio, Travel, q16};

/// Part of the axial travel by which the face moves on a wheel that grips, at most: creep 0.05 close
/// to the limit of friction, and the rolling radius 0.02.
const CREEPS: Ratio = q16(70_000);
/// Part of the compression as read that a sensor misses, at most: one of the mean over a patch of
/// parabolic depth reads two thirds.
const MISSED: Ratio = q16(500_000);
/// Rise of the centre that is noise, mm: three steps of the angle code.
const NOISE: Millimetres = q16(120_000);
/// Travel of the tread within which a slip of half of it shows beyond the noise, mm: 0.12 times the
/// slope of 1.6 at the first contact.
const SHOWS_WITHIN: Travel = q16(400_000).widen();
/// Square of the distance down to which an edge shows its place, over the wheel's radius, mm. On a step
/// lower by e the wheel may be over an edge that seems `sqrt(2 R e)` ahead; half as much again keeps
/// to the first order in e.
const SHOWN: Millimetres = Q16::from_bits(3 * HEIGHT_MOST.to_bits());
/// Largest motion of the face in a tick, mm. More is a sensor that errs.
const MOST: Millimetres = q16(800_000);
/// Part of a slip that is one sigma of it: what the reference lets pass 10 mm before the face, 0.27 of
/// the travel and [`CREEPS`], evenly spread.
const SLIP_SIGMA: Ratio = q16(200_000);

/// Where a tick has the face.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Seen {
    travel: Travel,
    /// Place of the face over the axial travel by the tread, mm.
    face: Millimetres,
    /// Grows by slip alone, mm.
    beyond: Millimetres,
}

/// Slip of one crossing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CornerSlip {
    /// Axial travel by the tread since the edge was first seen, mm.
    rolled: Millimetres,
    last: Option<Seen>,
    /// Least so far; while the wheel slips the largest.
    mark: Seen,
    slipping: bool,
    /// Largest face before the wheel slips, mm: where the axle runs ahead of a tread that lets go of
    /// the lower wall, the face moves inwards, and back again.
    outermost: Millimetres,
    /// Noise of the face where it slipped, mm.
    noise: Millimetres,
    /// Axial slip so far, mm: travel of the tread that moved no axle, or of the axle that no tread made.
    pub lost: Millimetres,
    /// What the tread slipped beyond it, mm: it turns across the edge.
    pub beside: Millimetres,
}

impl CornerSlip {
    /// A tick of a wheel of this radius, mm, on an edge, `on_floor` while the lower wall carries, too.
    /// Returns by how much the axle is further in than the tread has it, once that is known, mm. The
    /// load pulls inwards, so nothing slips outwards.
    pub(super) fn step(&mut self, radius: Millimetres, at: &OnEdge, on_floor: bool) -> Millimetres {
        let (over, reach, ahead) = (radius - at.fall, radius - at.depth, at.ahead(radius));
        if ahead * ahead < radius * SHOWN {
            self.begin_run();
            return Q16::ZERO;
        }
        let along = if on_floor { Ratio::ONE } else { divide(over, reach).min(Ratio::ONE) };
        let turned = self.last.map_or(Travel::ZERO, |last| at.travel.saturating_sub(last.travel));
        self.rolled += Q16::narrow(turned) * along;
        let face = self.rolled + ahead;
        let misread = divide(over * HEIGHT_MOST + reach * at.depth * MISSED, ahead);
        let beyond = face - misread - self.rolled * CREEPS;
        let now = Seen { travel: at.travel, face, beyond };
        let last = self.last.replace(now);
        if last.is_none_or(|last| face - last.face > MOST) {
            (self.mark, self.outermost, self.slipping) = (now, face, false);
            return Q16::ZERO;
        }
        let noise = divide(over, ahead) * NOISE;
        let bound = if self.slipping { Q16::ZERO } else { noise };
        let rise = beyond - self.mark.beyond;
        // What the largest misreading leaves of it, or all.
        let moved = face - self.outermost;
        if rise > bound && moved > Q16::ZERO {
            let lost = (moved + rise.min(moved)).half();
            (self.mark, self.outermost, self.slipping) = (now, face, true);
            self.noise = self.noise.max(noise);
            self.lost += lost;
            self.beside += divide(lost, along) - lost;
            return lost;
        }
        if rise < bound - noise {
            (self.mark, self.slipping) = (now, false);
            self.outermost = self.outermost.max(face);
        }
        Q16::ZERO
    }

    /// A run begins: nothing is known of how wheel and axle moved since the last one.
    pub(super) fn begin_run(&mut self) {
        *self = Self { lost: self.lost, beside: self.beside, noise: self.noise, ..Self::default() };
    }

    /// The wheel slips, or has not been seen to grip since.
    pub const fn is_slipping(&self) -> bool {
        self.slipping
    }

    /// The slip grows.
    pub(super) fn goes_on(&self) -> bool {
        let turned = |last: Seen| last.travel.saturating_sub(self.mark.travel).saturating_abs();
        self.slipping && self.last.is_some_and(|last| turned(last) < SHOWS_WITHIN)
    }

    /// One sigma of the slip so far, mm.
    pub fn sigma(&self) -> Millimetres {
        self.noise + self.lost * SLIP_SIGMA
    }

    /// One sigma that the last `lost` of it adds to the position, mm: what the parts of a slip are
    /// off by has one cause, so that in all it is [`Self::sigma`].
    pub(super) fn sigma_of(&self, lost: Millimetres) -> Millimetres {
        let now = self.sigma();
        let before = if lost >= self.lost { Q16::ZERO } else { now - lost * SLIP_SIGMA };
        sqrt((now - before) * (now + before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const R: f64 = 25.0;
    const DEPTH: f64 = 0.9;

    /// A wheel 13 mm before a face turns by 9 mm on its edge; from `at` mm on `rate` of that slips,
    /// until the axle has lost `slip` mm. The arm has this noise, and the step is `error` mm lower than
    /// its table; the compression sensor misses the part `missed`. Returns what was found.
    fn found(at: f64, slip: f64, rate: f64, noise: f64, (error, missed): (f64, f64)) -> f64 {
        let (mut watch, mut taken, mut ahead, mut lost) = (CornerSlip::default(), 0.0, 13.0, 0.0);
        let (reach, mut slipped) = (R - DEPTH, 0.0);
        for tick in 0..900 {
            let turned = 0.01 * f64::from(tick);
            let over = (reach * reach - f64::powi(ahead, 2)).sqrt();
            let jitter = noise * f64::from(tick * 7919 % 101 - 50) / 50.0;
            let at_edge = OnEdge {
                travel: Travel::from_num(turned),
                position: Q16::ZERO,
                fall: Q16::from_num(R - over + error + jitter - missed * DEPTH),
                depth: Q16::from_num((1.0 - missed) * DEPTH),
                gave: Travel::ZERO,
            };
            if at_edge.ahead(Q16::from_num(R)) > Q16::from_num(0.25 * R) {
                taken += watch.step(Q16::from_num(R), &at_edge, false).to_num::<f64>();
            }
            let along = 0.01 * over / reach;
            let slips = if turned > at && lost < slip { along * rate } else { 0.0 };
            lost += slips;
            slipped += slips * reach / over;
            ahead -= along - slips;
        }
        assert_eq!(watch.lost.to_num::<f64>(), taken);
        // The tread slips along the arc of the axle.
        let more = taken * (slipped / lost.max(1e-9) - 1.0);
        assert!((watch.beside.to_num::<f64>() - more).abs() < 0.03 * (taken + 0.01), "{more}");
        taken
    }

    proptest! {
        #[test]
        fn a_slip_is_measured(
            at in 0.5..2.0f64,
            slip in 0.5..4.0f64,
            rate in 0.6..1.0f64,
            noise in 0.0..0.03f64,
            error in -0.2..0.2f64,
        ) {
            let got = found(at, slip, rate, noise, (error, 0.0));
            // Of a wheel that half grips all may pass that the reference does: see SLIP_SIGMA.
            let part = if rate < 0.7 { 0.34 } else { 0.18 };
            prop_assert!((got - slip).abs() < 0.15 + part * slip, "{got} of {slip}");
        }

        #[test]
        fn a_wheel_that_grips_slips_nothing(
            noise in 0.0..0.03f64,
            error in -1.0..1.0f64,
            missed in 0.0..0.33f64,
        ) {
            prop_assert_eq!(found(0.0, 0.0, 0.0, noise, (error, missed)), 0.0);
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
        let reach = R - DEPTH;
        let lost: f64 = (0..100)
            .map(|tick| {
                let ahead = 11.0 + 0.01 * f64::from(tick);
                let fall = Q16::from_num(R - (reach * reach - ahead * ahead).sqrt());
                let (travel, position) = (Travel::ZERO, Q16::ZERO);
                let depth = Q16::from_num(DEPTH);
                let at = OnEdge { travel, position, fall, depth, gave: Travel::ZERO };
                watch.step(Q16::from_num(R), &at, false).to_num::<f64>()
            })
            .sum();
        assert!(watch.is_slipping() && watch.goes_on() && (0.95..1.0).contains(&lost), "{lost}");
    }
}
