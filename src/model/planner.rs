//! The schedule: speed and preload that hold the gap at the next step.

#![deny(clippy::float_arithmetic)]

mod approach;
#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;

pub use approach::KNOWN_SCALE;

use super::dip::Dip;
use super::guard::Guard;
use super::plan::{
    Approach, KNOWN_DEVIATION, Learned, LimitedBy, Outcome, Plan, PlanRequest, Review, Strategy,
};
use super::reduced::{Point, ReducedModel, Scale};
use super::timing::Timing;
use crate::fault::Limit;
use crate::numeric::{between, divide, sqrt};
use crate::rig::MAX_STEPS;
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Seconds, q16,
};

/// One sigma of the logarithm of the stiffness of a tread that has shown before the first crossing
/// that it is not as known.
pub const SHOWN_DEVIATION: Ratio = q16(240_000);
/// Variance of a measured stiffness of a tread that is not as known, 0.2 squared: at the next speed
/// its gap is another by 5 to 6 %, its stiffness by three to four times that.
const UNKNOWN_VARIANCE: Ratio = q16(40_000);
/// A measured stiffness further off than so many sigmas, squared, contradicts what is known.
const SURPRISE: Q16 = q16(9_000_000);

/// Relative difference of an observed stiffness above which it is reported. Rubber that is off
/// by three deviations makes 0.12 at the first crossing; the rest is the measurement, where a
/// stiff guess costs most. One in a hundred random rigs exceeds it at one of its crossings.
const STRANGE: Ratio = q16(270_000);

/// Measured gap over the reference from which it is reported: twice the error of the measurement
/// on coupled treads.
const WIDE: Ratio = q16(1_030_000);

/// Bounds of the reserve that the crossings leave, as shares of the rig's.
const LEAST_RESERVE: Ratio = q16(333_333);
const MOST_RESERVE: Ratio = q16(2_000_000);

/// Preloads between that of cruise and the limit that are compared, and their distance as a
/// part of the range.
const PRELOADS: u32 = 16;
const PRELOAD_STEP: Ratio = q16(62_500);

/// Part of the cruise preload with which the wheel may cross while the preload is being built up.
const BUILDING: Ratio = q16(900_000);

/// Error of the model's inverse, N.
const HOLDS_WITHIN: Newtons = q16(100_000);

/// Friction margin that a second is worth, 1/s: 0.01 for half a second. With the need read up to
/// 0.06 too low and the friction known to 3 %, a margin of 0.05 is short in one crossing of ten, and
/// 0.01 more of it saves one slip in twenty: a run that is stopped and repeated, 10 s.
const MARGIN_PER_SECOND: Ratio = q16(20_000);

/// By how much the model may read the friction needed too low; how much more often 0.01 of a margin
/// that is less saves a slip.
const READ_LOW: Ratio = q16(60_000);
const LIKELY_TIMES: Q16 = q16(3_000_000);

/// Difference of the friction needed that is none: a preload counts as reached within 2 %.
const SAME_NEED: Ratio = q16(5_000);

/// Smaller gap that is compared, as a part.
const SMALLER: Ratio = q16(980_000);

/// Halvings by which the gap is found that leaves the slip margin: to 0.4 % of it, which is 3 % of
/// the speed.
const GRIP_HALVINGS: usize = 7;

/// The model side of the schedule; runs outside the tick. The default is a place to read one
/// into.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Planner {
    model: ReducedModel,
    guard: Guard,
    timing: Timing,
    dip: Dip,
    strategy: Strategy,
    /// Tangent of the arm angle at each step.
    tangents: heapless::Vec<Ratio, MAX_STEPS>,
    /// Radial force that the arm's inclination adds, per load and tangent.
    coupling: Ratio,
    /// Axial load on this wheel as known, N.
    load: Newtons,
    /// Gap to hold, deploy and retract, mm.
    gap_ref: [Millimetres; 2],
    /// Part by which the gap aimed at is below it while no crossing has shown what the tread
    /// does, and its reciprocal; 0 for none.
    reserve: Ratio,
    by_reserve: Q16,
    cruise_speed: MillimetresPerSecond,
    least_speed: MillimetresPerSecond,
    safe_speed: MillimetresPerSecond,
    /// Speed at which the pre-tightener just follows the spring at lift-off, mm/s.
    climb_speed: MillimetresPerSecond,
    /// Crossing speed set by a comparison, mm/s.
    prescribed_speed: Option<MillimetresPerSecond>,
    /// Whether the crossing speed also applies between the steps.
    uniform: bool,
    cruise_preload: Newtons,
    radius: Millimetres,
    /// Tolerance of a step's place, mm.
    tolerance: Millimetres,
    /// Distance to the face at which the corner shows where it is, deploy and retract, mm.
    felt_at: [Millimetres; 2],
    /// Preload with which the wheel may roll along the wall, N.
    rolling_preload: Newtons,
    /// Preload that the plan may ask for, N.
    most_preload: Newtons,
    /// Friction of tread on wall as far as known.
    friction: Ratio,
    /// The part of it that may be used.
    usable: Ratio,
    scale_range: (Ratio, Ratio),
    /// Variance of the logarithm of a measured stiffness.
    measured_variance: Ratio,
}

impl Planner {
    /// Answers a request.
    pub fn plan(&self, request: &PlanRequest) -> Plan {
        let mut learned = request.learned;
        learned.scale = between(learned.scale, self.scale_range.0, self.scale_range.1);
        let outcome = request.review.map(|review| self.review(&review, &learned));
        let mut learned = outcome.map_or(learned, |outcome| outcome.learned);
        if let Some(force) = request.slipped {
            let at = Point {
                extra_load: learned.extra_load,
                ..Point::nominal(request.direction, self.least_speed)
            };
            let used = self.model.crossing(&at, force).utilisation;
            learned.slips = learned.slips.min(used.max(learned.grips));
        }
        let (cruise_speed, moved) = self.guard.below(self.cruise_speed);
        let limits = [moved.then_some(Limit::ResonanceAvoided), None, None];
        let mut plan = Plan {
            sequence: request.sequence,
            step: request.step,
            direction: request.direction,
            cruise_speed,
            cross_speed: cruise_speed,
            cruise_preload: self.between_steps(),
            cross_preload: self.between_steps(),
            ramp_preload: self.between_steps(),
            most_preload: match self.strategy {
                Strategy::Constant => self.cruise_preload,
                _ => self.most_preload,
            },
            gap: self.target(request.direction, learned.reserve),
            slip_margin: self.usable,
            slips: learned.slips,
            short: false,
            brake_distance: Millimetres::ZERO,
            brake_time: Seconds::ZERO,
            brake_horizon: Millimetres::ZERO,
            approach: Approach {
                window_speed: cruise_speed,
                slowest_speed: cruise_speed,
                ..Approach::default()
            },
            // Without look-ahead the preload rises when the step is detected, never before.
            look_ahead: self.strategy != Strategy::Reactive,
            limited_by: LimitedBy::Drive,
            limits,
            outcome,
        };
        if request.step > 0 {
            self.crossing(&PlanRequest { learned, ..*request }, &mut plan);
        }
        if self.uniform {
            plan.cruise_speed = plan.cross_speed;
        }
        self.braking(&mut plan);
        plan
    }

    /// Gap that the schedule holds in this direction, mm.
    pub fn gap_ref(&self, direction: Direction) -> Millimetres {
        self.gap_ref[direction as usize]
    }

    /// Speed and preload at the step.
    fn crossing(&self, request: &PlanRequest, plan: &mut Plan) {
        let at = Point {
            direction: request.direction,
            speed: self.least_speed,
            scale: Scale::new(request.learned.scale),
            extra_load: request.learned.extra_load,
        };
        let arm_thrust = self.arm_thrust_at(request);
        let floor = self.least_speed.min(plan.cruise_speed);
        // No faster than the pre-tightener can follow the spring over the corner.
        let ceiling = plan.cruise_speed.min(self.climb_speed.max(floor));
        let (floor, ceiling) = match self.prescribed_speed {
            Some(speed) => (speed, speed),
            None => (floor, ceiling),
        };
        let choice = self.choose(request, &at, arm_thrust, (floor, ceiling));
        let Choice { preload: most, gap, speed, rising, .. } = choice;
        let (speed, moved) = self.guard.below(speed);
        if moved {
            add(&mut plan.limits, Limit::ResonanceAvoided);
        }
        plan.limited_by = if moved && speed >= floor {
            LimitedBy::Resonance
        } else {
            self.limited_by(
                &choice,
                self.target(request.direction, request.learned.reserve),
                (floor, ceiling),
                plan.most_preload,
            )
        };
        // A band that reaches below the floor is entered: too slow would be worse.
        let speed = speed.max(floor);
        let at = Point { speed, ..at };
        let wanted = self.model.force(&at, gap) - arm_thrust;
        plan.cross_speed = speed;
        if wanted > most + HOLDS_WITHIN && speed <= floor {
            add(&mut plan.limits, Limit::SpeedFloor);
        } else if wanted >= self.most_preload * q16(980_000) && speed < self.safe_speed {
            add(&mut plan.limits, Limit::PreloadLimited);
        }
        plan.cross_preload = match self.strategy {
            Strategy::Scheduled => {
                // Below that of cruise only where the choice is.
                wanted.max(most.min(self.cruise_preload)).min(most)
            }
            Strategy::Constant => self.cruise_preload,
            Strategy::Limit => self.most_preload,
            Strategy::Reactive => wanted.clamp(self.cruise_preload, self.most_preload),
        };
        plan.ramp_preload = plan.cross_preload;
        // Until the step behind has been reviewed, the tread may turn out stiffer.
        if self.strategy == Strategy::Scheduled && (rising || request.review.is_none()) {
            plan.ramp_preload = self.most_preload;
        }
        let carried = plan.cross_preload.min(most) + arm_thrust;
        let crossing = self.model.crossing(&at, carried);
        plan.gap = crossing.gap;
        let (friction, _) = self.friction_of(&request.learned);
        let margin = friction - crossing.utilisation;
        plan.slip_margin = margin;
        plan.short = crossing.utilisation + SAME_NEED >= request.learned.slips;
        if margin < self.friction - self.usable {
            add(&mut plan.limits, Limit::SlipMarginLow);
        }
        plan.approach = self.approach(request, &at, carried, plan.gap);
        plan.approach.earlier_per_preload =
            self.earlier_per_preload(&at, carried, plan.approach.lift);
    }

    /// What keeps a crossing of this choice from being faster.
    fn limited_by(
        &self,
        choice: &Choice,
        target: Millimetres,
        (floor, ceiling): (MillimetresPerSecond, MillimetresPerSecond),
        most: Newtons,
    ) -> LimitedBy {
        if choice.speed >= ceiling {
            LimitedBy::Drive
        } else if choice.speed <= floor {
            LimitedBy::LeastSpeed
        } else if choice.gap < target {
            LimitedBy::Friction
        } else if choice.preload < most {
            LimitedBy::Slew
        } else {
            LimitedBy::Preload
        }
    }

    /// The preload, and with it the speed, with which the wheel is over the step soonest: more
    /// preload takes time to build, less makes the crossing slow.
    fn choose(
        &self,
        request: &PlanRequest,
        at: &Point,
        arm_thrust: Newtons,
        bounds: (MillimetresPerSecond, MillimetresPerSecond),
    ) -> Choice {
        let (low, high) = match self.strategy {
            Strategy::Scheduled => (self.least_preload(request), self.most_preload),
            Strategy::Limit => (self.most_preload, self.most_preload),
            Strategy::Constant => (self.cruise_preload, self.cruise_preload),
            Strategy::Reactive => {
                let reached = self.reached_on_corner(request, at, arm_thrust, bounds);
                (reached, reached)
            }
        };
        let mut best = self.gripping(request, at, high, arm_thrust, bounds);
        for part in 1..=PRELOADS {
            if high == low {
                break;
            }
            let preload = high - (high - low) * Q16::from_num(part) * PRELOAD_STEP;
            let choice = self.gripping(request, at, preload, arm_thrust, bounds);
            if choice.better_than(&best) {
                best = choice;
            }
        }
        best
    }

    /// The most preload that a rise which begins at the corner still reaches before lift-off
    /// (retract: touch-down), at the speed that this preload allows.
    fn reached_on_corner(
        &self,
        request: &PlanRequest,
        at: &Point,
        arm_thrust: Newtons,
        (floor, ceiling): (MillimetresPerSecond, MillimetresPerSecond),
    ) -> Newtons {
        let gap = self.target(request.direction, request.learned.reserve);
        let run = self.felt_at[request.direction as usize] - self.lift(request.direction, gap);
        let step = (self.most_preload - self.cruise_preload) * PRELOAD_STEP;
        let preload = |part: u32| self.cruise_preload + step * Q16::from_num(part);
        let reached = (1..=PRELOADS).take_while(|&part| {
            let speed = self.model.speed(at, gap, preload(part) + arm_thrust, floor, ceiling);
            self.timing.preload_change(preload(part) - self.cruise_preload) <= divide(run, speed)
        });
        preload(reached.last().unwrap_or(0))
    }

    /// With this preload: the largest gap up to the target, and the speed with it, that leave
    /// the slip margin, or as much of it as is worth its time.
    fn gripping(
        &self,
        request: &PlanRequest,
        at: &Point,
        preload: Newtons,
        arm_thrust: Newtons,
        (floor, ceiling): (MillimetresPerSecond, MillimetresPerSecond),
    ) -> Choice {
        let target = self.target(request.direction, request.learned.reserve);
        let carried = preload + arm_thrust;
        let (friction, usable) = self.friction_of(&request.learned);
        let speed_at = |gap| self.model.speed(at, gap, carried, floor, ceiling);
        let used = |gap, speed| self.model.utilisation(&Point { speed, ..*at }, gap);
        // Time that the missing margin is worth, and that which the crossing takes, s.
        let price = |used: Ratio| {
            let likely = (used - (friction - READ_LOW)).max(Q16::ZERO) * LIKELY_TIMES;
            divide((used - usable).max(Q16::ZERO) + likely, MARGIN_PER_SECOND)
        };
        let takes = |gap: Millimetres, speed| {
            let approach = self.approach(request, &Point { speed, ..*at }, carried, gap);
            self.travels(request.distance, &approach)
                + self.lost(approach.slowest_speed, self.cruise_speed)
        };
        let grips = |gap: Millimetres, speed| {
            let needs = used(gap, speed);
            let smaller = gap * SMALLER;
            let slower = speed_at(smaller);
            needs <= usable
                || needs < friction
                    && takes(gap, speed) + price(needs)
                        <= takes(smaller, slower) + price(used(smaller, slower))
        };
        let (mut gap, mut speed) = (target, speed_at(target));
        if !grips(gap, speed) && speed > floor {
            let mut part = target.half();
            gap = part;
            for _ in 0..GRIP_HALVINGS {
                part = part.half();
                let larger = gap + part;
                let speed = speed_at(larger);
                if grips(larger, speed) || speed <= floor {
                    gap = larger;
                }
            }
            speed = speed_at(gap);
        }
        let at = Point { speed, ..*at };
        let carries = self.model.force(&at, gap) <= carried + HOLDS_WITHIN;
        let holds = carries && grips(gap, speed);
        let approach = self.approach(request, &at, carried, gap);
        let until = |preload: Newtons| {
            self.timing.preload_change((preload - request.preload).max(Q16::ZERO))
        };
        // Below the cruise preload a wheel that stays slow would wait for long on the corner.
        let holds =
            holds && (preload >= self.cruise_preload || approach.release_time > Seconds::ZERO);
        let ready = until(preload);
        let starts = if request.preload < self.rolling_preload {
            until(self.rolling_preload)
        } else {
            Seconds::ZERO
        };
        let travels = starts + self.travels(request.distance, &approach);
        let rising = ready > travels;
        let time = ready.max(travels) + self.lost(approach.slowest_speed, self.cruise_speed);
        let time = time + price(used(gap, speed));
        Choice { preload, gap, speed, time, rising, holds }
    }

    /// Distance and time of braking before the step.
    fn braking(&self, plan: &mut Plan) {
        plan.brake_horizon =
            self.timing.longest_brake_distance(plan.cruise_speed.max(plan.cross_speed));
        plan.brake_distance =
            self.timing.brake_distance(plan.cruise_speed, plan.approach.slowest_speed);
        plan.brake_time = self.timing.speed_change(plan.cruise_speed - plan.approach.slowest_speed);
    }

    /// Compares a crossing with the model, and learns from it.
    ///
    /// A scalar Kalman filter on the logarithm of the stiffness scale. What is known of the tread is
    /// never surer than of one as known: each sleeve is another. A stiffness that contradicts
    /// what is known makes that uncertain by as much: a stiffer one is taken at once, too
    /// stiff a guess only costs time; a softer one with the next that agrees.
    fn review(&self, review: &Review, known: &Learned) -> Outcome {
        let at = Point {
            direction: review.direction,
            speed: review.speed,
            scale: Scale::new(known.scale),
            extra_load: known.extra_load,
        };
        let force = review.preload + self.thrust(known, review.tan_arm);
        let crossing = self.model.crossing(&at, force);
        let (friction, _) = self.friction_of(known);
        let mut outcome = Outcome {
            gap_predicted: crossing.gap,
            slip_margin: friction - crossing.utilisation,
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
            learned.grips = learned.grips.max(crossing.utilisation);
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
        let missed = divide((review.gap - crossing.gap).abs(), review.gap.max(q16(100_000)));
        let reserve = known.reserve.half() + missed * self.by_reserve;
        learned.reserve = reserve.clamp(LEAST_RESERVE, MOST_RESERVE);
        outcome.bounded = learned.scale != wanted;
        outcome
    }

    /// Friction as far as known, and the part of it that may be used. What has gripped may be used
    /// again; what has slipped did so by the model's own reading.
    fn friction_of(&self, learned: &Learned) -> (Ratio, Ratio) {
        let friction = self.friction.min(learned.slips);
        let margin = self.friction - self.usable;
        let usable = self.usable.min(learned.slips - (margin - READ_LOW).max(Q16::ZERO));
        (friction, usable.max(learned.grips.min(friction)))
    }

    /// Radial force that the load adds at this tangent of the arm angle, N.
    fn thrust(&self, learned: &Learned, tan_arm: Ratio) -> Newtons {
        (self.load + learned.extra_load) * self.coupling * tan_arm
    }

    fn arm_thrust_at(&self, request: &PlanRequest) -> Newtons {
        let index = usize::from(request.step).saturating_sub(1);
        let tangent = self.tangents.get(index).copied().unwrap_or_default();
        self.thrust(&request.learned, tangent)
    }

    /// Least preload for the step ahead, N: that of cruise, or less while it is being built up. Under
    /// more load than was told, all that there is until a crossing has gripped.
    fn least_preload(&self, request: &PlanRequest) -> Newtons {
        let Learned { extra_load, grips, .. } = request.learned;
        if extra_load > Q16::ZERO && grips == Q16::ZERO {
            return self.most_preload;
        }
        let least = self.cruise_preload * BUILDING;
        request.preload.clamp(least, self.cruise_preload)
    }

    fn between_steps(&self) -> Newtons {
        match self.strategy {
            Strategy::Limit => self.most_preload,
            _ => self.cruise_preload,
        }
    }

    /// Gap aimed at with this share of the reserve, mm.
    fn target(&self, direction: Direction, share: Ratio) -> Millimetres {
        let gap = self.gap_ref(direction);
        gap - gap * (self.reserve * share)
    }
}

/// A preload with what it allows.
#[derive(Clone, Copy, Debug)]
struct Choice {
    preload: Newtons,
    gap: Millimetres,
    speed: MillimetresPerSecond,
    /// Until the step is behind, s, but for what is the same for every preload, and what the
    /// missing margin is worth.
    time: Seconds,
    /// The wheel waits for it: it lifts off while the preload rises.
    rising: bool,
    /// It holds the gap and keeps the slip margin.
    holds: bool,
}

impl Choice {
    /// Sooner over the step, if it holds; of those that do not, the highest preload is best.
    fn better_than(&self, higher: &Self) -> bool {
        self.holds && (!higher.holds || self.time < higher.time)
    }
}

/// Adds a limit, once; a plan holds three.
fn add(limits: &mut [Option<Limit>; 3], limit: Limit) {
    if !limits.contains(&Some(limit))
        && let Some(free) = limits.iter_mut().find(|slot| slot.is_none())
    {
        *free = Some(limit);
    }
}

#[cfg(test)]
#[path = "planner/planner_tests.rs"]
#[allow(clippy::float_arithmetic, reason = "the gaps are written in mm")]
mod tests;
