//! A crossing as it was measured against the tread rolled through the same history, and what is
//! learned from it.

use super::course::STRIDES_AT_ONCE;
use super::{Planner, WIDE};
use crate::model::history::{HistoryStride, STRIDES};
use crate::model::plan::{KNOWN_DEVIATION, Learned, Outcome, Review};
use crate::model::rollout::LiftOff;
use crate::model::tread::{Axial, Drive, TreadState};
use crate::numeric::{between, divide, sqrt};
use crate::sense::FILTER_LAG;
use crate::units::{Direction, Millimetres, Newtons, Q16, Ratio, q16, ticks_to_seconds};

/// Tread that runs farther than the axle up to lift-off, mm over the step's height: `R (beta - sin
/// beta)` of 4 mm is 0.77 mm around the complete edge, half of it up to lift-off.
const AROUND: Ratio = q16(90_000);
/// Strides for which the wheel goes on as it last did, should the tread not lift off by then.
const GOES_ON: u32 = 24;
/// Strides that a wheel rolls in, more than the longest patch.
const ROLL_IN: usize = 45;

/// Rollouts that align a history with where the arm had the wheel, at most, and how near, mm.
const ALIGNMENTS: u32 = 4;
const ALIGNED: Millimetres = q16(20_000);
/// Latest that a corner is felt, mm: under a bonded tread of 12 mm.
pub(super) const FELT_LATE: Millimetres = q16(600_000);
/// A stiffness that is tried beside the known one, over it, and its logarithm.
const STIFFER: Ratio = q16(1_100_000);
const LN_STIFFER: Ratio = q16(95_310);
/// Least relative change of a gap with the logarithm of the stiffness.
const LEAST_SENSITIVITY: Ratio = q16(100_000);
/// One sigma of a measured gap against the rolled one, mm: two readings of an arm angle of which a
/// code is at most 0.056 mm of radius make 0.023, a rollout's 0.7 % 0.018, and the preload sensor's 1.5 % 0.02.
const MEASURED_WITHIN: Millimetres = q16(36_000);
/// Largest difference of the logarithm of a stiffness that one crossing may show.
const MOST_OFF: Ratio = q16(1_000_000);
/// The same of the logarithm of the stiffness of a tread that is not as known: at the next speed its
/// gap is another by 4 %.
const UNLIKE: Ratio = q16(300_000);
/// The tread is never known better than this, one sigma of the logarithm of its stiffness.
const SUREST: Ratio = q16(20_000);

impl Planner {
    /// The tread rolled through a review's history from this position, mm, with this stiffness;
    /// what comes of it, and where the wheel is when the history ends.
    ///
    /// A history that is full says nothing of what was before: the wheel rolls in, as it did
    /// first, over more than a patch. One that is not began at rest.
    async fn replayed(
        &self,
        (state, pause): (&mut TreadState, &mut impl AsyncFnMut()),
        review: &Review,
        load: Newtons,
        (from, scale): (Millimetres, Ratio),
    ) -> (LiftOff, Millimetres) {
        let first = review.history.strides().next().unwrap_or_default();
        let full = review.history.strides().count() == STRIDES;
        let roll_in = if full { ROLL_IN } else { 0 };
        let (direction, axial, pressed) = (review.direction, Axial::Driven(load), first.pressed());
        let mut drive = Drive { direction, axial, pressed, scale, ..Drive::default() };
        let before = self.tread.stride() * Q16::from_num(roll_in as i32);
        let before = if review.direction == Direction::Deploy { -before } else { before };
        self.tread.put_down(state, from + before, &drive);
        let mut lift_off = LiftOff::default();
        let mut winding = self.shear.rest(load);
        let sense = Q16::from_num(review.direction.sign());
        let mut roll = |state: &mut TreadState, stride: HistoryStride| {
            drive.pressed = stride.pressed();
            drive.duration = ticks_to_seconds(stride.ticks());
            let contact = self.tread.advance(state, &drive);
            let stride = (self.tread.stride(), drive.duration);
            drive.gives = sense * self.shear.follow(&mut winding, &contact, stride);
            lift_off.follow(&self.tread, review.direction, &contact);
            lift_off.is_found()
        };
        let mut last = first;
        let rolled_in = core::iter::repeat_n(first, roll_in);
        for (at, stride) in (0..).zip(rolled_in.chain(review.history.strides())) {
            if at % STRIDES_AT_ONCE == 0 {
                pause().await;
            }
            roll(state, stride);
            last = stride;
        }
        let end = state.position();
        for at in 0..GOES_ON {
            if at % STRIDES_AT_ONCE == 0 {
                pause().await;
            }
            if roll(state, last) {
                break;
            }
        }
        (lift_off, end)
    }

    /// The history rolled so that it ends where the arm had the wheel. How far the axle comes depends on
    /// when the wheel lifts off, and that on where it began.
    async fn rolled(
        &self,
        (state, pause): (&mut TreadState, &mut impl AsyncFnMut()),
        review: &Review,
        load: Newtons,
        scale: Ratio,
    ) -> LiftOff {
        let strides = Q16::from_num(review.history.strides().count() as u32);
        let travel = self.tread.stride() * strides - self.tread.height() * AROUND;
        // The filters of arm and compression show the wheel as it was this long before.
        let late = review.held * FILTER_LAG;
        let (end, mut from) = match review.direction {
            Direction::Deploy => (late - review.distance, late - review.distance - travel),
            Direction::Retract => (-review.distance - late, travel - review.distance - late),
        };
        let mut lift_off = LiftOff::default();
        for _ in 0..ALIGNMENTS {
            let rolling = (&mut *state, &mut *pause);
            let (lifted, reached) = self.replayed(rolling, review, load, (from, scale)).await;
            lift_off = lifted;
            let off = end - reached;
            if off.abs() < ALIGNED {
                break;
            }
            from += off;
        }
        lift_off
    }

    /// Compares a crossing with the tread rolled through its measured history, and learns from it.
    ///
    /// A scalar Kalman filter on the logarithm of the stiffness scale. The stiffness that makes the
    /// rolled gap the measured one is a step of the secant away: the gap with another stiffness
    /// shows how it depends on it. A measurement that is farther off than its variance allows makes
    /// the estimate as uncertain as it is off.
    pub(super) async fn review(
        &self,
        (state, pause): (&mut TreadState, &mut impl AsyncFnMut()),
        review: &Review,
        known: &Learned,
    ) -> Outcome {
        let load = self.load + known.extra_load;
        let rolled = self.rolled((state, pause), review, load, known.scale).await;
        let (friction, _) = self.friction_of(known);
        let mut outcome = Outcome {
            gap_predicted: rolled.gap,
            slip_margin: friction - rolled.utilisation,
            learned: *known,
            bounded: false,
            strange: false,
            wide: review.gap > self.gap_ref(review.direction) * WIDE,
        };
        if !review.trusted || !rolled.is_found() {
            return outcome;
        }
        let learned = &mut outcome.learned;
        if let Some(felt_at) = review.felt_at {
            let way = review.direction as usize;
            learned.felt_late[way] = (self.felt_at[way] - felt_at).clamp(Q16::ZERO, FELT_LATE);
        }
        if !review.slipped {
            learned.grips = learned.grips.max(rolled.utilisation);
        }
        let stiffer = known.scale * STIFFER;
        let other = self.rolled((state, pause), review, load, stiffer).await;
        // Change of the gap with the logarithm of the stiffness, as a part of it.
        let slope = divide(other.gap - rolled.gap, rolled.gap * LN_STIFFER).max(LEAST_SENSITIVITY);
        let missed = divide(review.gap_as_table - rolled.gap, rolled.gap);
        let seen = between(divide(missed, slope), -MOST_OFF, MOST_OFF);
        let error = divide(MEASURED_WITHIN, rolled.gap * slope);
        // Rubber and measurement, three deviations of each.
        outcome.strange = seen.abs() > (KNOWN_DEVIATION + error) * q16(3_000_000);
        // The first crossing shows a tread no stiffer than the known one: it was softer, and is
        // as known otherwise.
        let first = known.grips == Q16::ZERO && review.direction == Direction::Deploy;
        learned.unknown &= !first || known.scale + known.scale * seen > Ratio::ONE;
        let unknown = learned.unknown;
        let error = if unknown { error.max(UNLIKE) } else { error };
        let (prior, measured) = (known.deviation * known.deviation, error * error);
        // A wider gap than is credible is believed: the tread was less certain than it seemed. A
        // narrower one only as far as two deviations, until the next shows the same: too stiff a
        // guess costs time, too soft a one the gap.
        let credible = sqrt(prior + measured) * q16(2_000_000);
        let prior = if seen > credible { seen * seen - measured } else { prior };
        let off = seen.max(-credible);
        let gain = divide(prior, prior + measured);
        let least = if unknown { UNLIKE } else { SUREST };
        learned.deviation = sqrt(gain * measured).max(least).max((off - seen).half());
        let half = off * gain.half();
        let wanted = known.scale * divide(Q16::ONE + half, Q16::ONE - half);
        learned.scale = between(wanted, self.scale_range.0, self.scale_range.1);
        if seen > credible {
            learned.unknown = true;
            learned.deviation = learned.deviation.max(UNLIKE);
        }
        outcome.bounded = learned.scale != wanted;
        outcome
    }
}
