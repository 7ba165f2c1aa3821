//! A crossing as it was measured against the tread rolled through the same history, and what is
//! learned from it.

#![deny(clippy::float_arithmetic)]

use super::{
    KNOWN_DEVIATION, LEAST_RESERVE, MOST_RESERVE, Planner, STRANGE, SURPRISE, UNKNOWN_VARIANCE,
    WIDE,
};
use crate::model::history::{HistoryStride, STRIDES};
use crate::model::plan::{Learned, Outcome, Review};
use crate::model::reduced::{Point, Scale};
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

impl Planner {
    /// The tread rolled through a review's history from this position, mm, with this stiffness;
    /// what comes of it, and where the wheel is when the history ends.
    ///
    /// A history that is full says nothing of what was before: the wheel rolls in, as it did
    /// first, over more than a patch. One that is not began at rest.
    fn replayed(
        &self,
        state: &mut TreadState,
        review: &Review,
        load: Newtons,
        (from, scale): (Millimetres, Ratio),
    ) -> (LiftOff, Millimetres) {
        let first = review.history.strides().next().unwrap_or_default();
        let full = review.history.strides().count() == STRIDES;
        let roll_in = if full { ROLL_IN } else { 0 };
        let mut drive = Drive {
            direction: review.direction,
            axial: Axial::Driven(load),
            pressed: first.pressed(),
            duration: Q16::ZERO,
            scale,
            level: false,
        };
        let before = self.tread.stride() * Q16::from_num(roll_in as i32);
        let before = if review.direction == Direction::Deploy { -before } else { before };
        self.tread.put_down(state, from + before, &drive);
        let mut lift_off = LiftOff::default();
        let mut roll = |state: &mut TreadState, stride: HistoryStride| {
            drive.pressed = stride.pressed();
            drive.duration = ticks_to_seconds(u32::from(stride.ticks));
            let contact = self.tread.advance(state, &drive);
            lift_off.follow(&self.tread, review.direction, &contact);
            lift_off.is_found()
        };
        for _ in 0..roll_in {
            roll(state, first);
        }
        let mut last = first;
        for stride in review.history.strides() {
            roll(state, stride);
            last = stride;
        }
        let end = state.position();
        for _ in 0..GOES_ON {
            if roll(state, last) {
                break;
            }
        }
        (lift_off, end)
    }

    /// Position from which the wheel is at the end of the history where the arm had it, mm.
    fn begins(
        &self,
        state: &mut TreadState,
        review: &Review,
        load: Newtons,
        scale: Ratio,
    ) -> Millimetres {
        let strides = Q16::from_num(review.history.strides().count() as u32);
        let travel = self.tread.stride() * strides - self.tread.height() * AROUND;
        // The filters of arm and compression show the wheel as it was this long before.
        let late = review.held * FILTER_LAG;
        let (end, guess) = match review.direction {
            Direction::Deploy => (late - review.distance, late - review.distance - travel),
            Direction::Retract => (-review.distance - late, travel - review.distance - late),
        };
        let (_, reached) = self.replayed(state, review, load, (guess, scale));
        guess + end - reached
    }

    /// What the tread, rolled through the history of a crossing, makes of it.
    fn rolled(&self, review: &Review, known: &Learned) -> LiftOff {
        let state = &mut TreadState::default();
        let load = self.load + known.extra_load;
        let from = self.begins(state, review, load, known.scale);
        self.replayed(state, review, load, (from, known.scale)).0
    }

    /// Compares a crossing with the tread, and learns from it.
    ///
    /// Predicted gap and friction needed are those of the tread rolled through the measured
    /// history. The stiffness is learned in the terms of the model that plans with it: what that
    /// reads too high or low is learned with it. (By the rolled tread, and planned by the other,
    /// wide rigs open 1.069 of the reference in 99 %, and 1.054 so.)
    ///
    /// A scalar Kalman filter on the logarithm of the stiffness scale. What is known of the tread is
    /// never surer than of one as known: each sleeve is another. A stiffness that contradicts
    /// what is known makes that uncertain by as much: a stiffer one is taken at once, too
    /// stiff a guess only costs time; a softer one with the next that agrees.
    pub(super) fn review(&self, review: &Review, known: &Learned) -> Outcome {
        let rolled = self.rolled(review, known);
        let at = Point {
            direction: review.direction,
            speed: review.speed,
            scale: Scale::new(known.scale),
            extra_load: known.extra_load,
        };
        let force = review.preload + self.thrust(known, review.tan_arm);
        let planned = self.model.crossing(&at, force);
        let (friction, _) = self.friction_of(known);
        let used = if rolled.is_found() { rolled.utilisation } else { planned.utilisation };
        let mut outcome = Outcome {
            gap_predicted: if rolled.is_found() { rolled.gap } else { planned.gap },
            slip_margin: friction - used,
            learned: *known,
            bounded: false,
            strange: false,
            wide: review.seen > self.gap_ref(review.direction) * WIDE,
        };
        if !review.trusted {
            return outcome;
        }
        let learned = &mut outcome.learned;
        if !review.slipped {
            // As the plan reads it.
            learned.grips = learned.grips.max(planned.utilisation);
        }
        let ratio = divide(self.model.observed_scale(&at, review.gap, force), known.scale);
        outcome.strange = (ratio - Q16::ONE).abs() > STRANGE;
        // The logarithm, by its first Pade approximant: at most 2 in magnitude.
        let off = divide((ratio - Q16::ONE) + (ratio - Q16::ONE), ratio + Q16::ONE);
        let measured = if known.unknown {
            UNKNOWN_VARIANCE.max(self.measured_variance)
        } else {
            self.measured_variance
        };
        let mut variance = known.deviation * known.deviation;
        let beyond = off * off - measured;
        let surprising = off * off > (variance + measured) * SURPRISE;
        if surprising && off > Q16::ZERO {
            variance = beyond;
        }
        let gain = divide(variance, variance + measured);
        variance = if surprising && off < Q16::ZERO { beyond } else { gain * measured };
        learned.deviation = sqrt(variance).max(KNOWN_DEVIATION);
        let half = off * gain.half();
        let wanted = known.scale * divide(Q16::ONE + half, Q16::ONE - half);
        learned.scale = between(wanted, self.scale_range.0, self.scale_range.1);
        let missed = divide((review.gap - planned.gap).abs(), review.gap.max(q16(100_000)));
        let reserve = known.reserve.half() + missed * self.by_reserve;
        learned.reserve = reserve.clamp(LEAST_RESERVE, MOST_RESERVE);
        outcome.bounded = learned.scale != wanted;
        outcome
    }
}
