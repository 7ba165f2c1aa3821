//! From the plan and the distance to the step: speed and preload asked for in this tick.

#![deny(clippy::float_arithmetic)]

use crate::estimate::Steps;
use crate::model::Plan;
use crate::model::timing::Timing;
use crate::numeric::{checked, divide};
use crate::rig::{Rig, RigError};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons, Q16, Ratio,
    Seconds, q16,
};

/// Short of the wanted preload by no more than this part of the limit, it is reached:
/// worth 1.2 % of the gap, less than the schedule's reserve.
const REACHED_PART: Q16 = q16(20_000);
/// Speed over the slowest one at which the wheel may speed up again.
const SLOWEST_WITHIN: Ratio = q16(1_100_000);
/// Time by which braking starts early, for detection, tick and the loop's lag, s.
const BRAKE_LAG: Seconds = q16(10_000);
/// Time for which a wheel that is slow stays short of where it would lift off with the preload of
/// now, s.
const HELD_FOR: Seconds = q16(100_000);
/// Distance by which braking for the end starts late, mm: the ticks make the profile's braking
/// shorter by as much.
const END_LATE: Millimetres = q16(30_000);

/// Limits of a rig.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Schedule {
    timing: Timing,
    /// Short of the wanted preload by no more than this, it is reached, N.
    reached_within: Newtons,
    /// Travel of the tread over that of the axle where the lower wall stops carrying.
    around_corner: Ratio,
}

/// Where the wheel is on its run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Direction of the run.
    pub direction: Direction,
    /// Axial distance to the face of the step ahead, along the run; none if no step is left.
    pub distance: Option<Millimetres>,
    /// Axial distance to the end of travel, along the run, mm.
    pub remaining: Millimetres,
    /// A corner is detected and the lower wall has not been left (retract: reached).
    pub critical: bool,
    /// The distance is that which the corner under the wheel shows.
    pub felt: bool,
    /// The preload is already being raised for this step.
    pub ramping: bool,
    /// The speed is already being brought down for the window of this step.
    pub looking: bool,
    /// The speed is already being brought down for this step.
    pub braking: bool,
    /// The wheel already speeds up again for this step.
    pub released: bool,
    /// Speed and acceleration of the profile, along the run, mm/s and mm/s^2.
    pub speed: MillimetresPerSecond,
    /// See `speed`.
    pub acceleration: MillimetresPerSecond2,
    /// Preload reference as far as it has come, N.
    pub reference: Newtons,
    /// Preload as the tread has it, N.
    pub preload: Newtons,
    /// The preload is behind what the actuator's model expects.
    pub preload_late: bool,
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Targets {
    /// Speed along the run, mm/s.
    pub speed: MillimetresPerSecond,
    /// Preload, N.
    pub preload: Newtons,
    /// The preload is raised for the step ahead; once so, until the step is behind.
    pub ramping: bool,
    /// The speed is brought down for the window of the step ahead; likewise.
    pub looking: bool,
    /// The speed is brought down for the step ahead; likewise.
    pub braking: bool,
    /// The wheel speeds up again on the corner; likewise.
    pub released: bool,
    /// The step ahead already has an effect.
    pub approaching: bool,
    /// The speed is held back because the preload is not reached yet.
    pub waiting: bool,
}

impl Schedule {
    /// Limits of a rig; fails where one is out of range.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Ok(Self {
            timing: Timing::try_build(rig)?,
            reached_within: checked("preload.limit_n", rig.preload.limit_n)? * REACHED_PART,
            around_corner: checked(
                "rig.step_height_mm",
                0.97 / (1.0 - rig.rig.step_height_mm / rig.rig.wheel_radius_mm),
            )?,
        })
    }

    /// Short of the wanted preload by no more than this, it is reached, N.
    pub const fn reached_within(&self) -> Newtons {
        self.reached_within
    }

    /// What to ask for.
    pub fn targets(&self, steps: &Steps, plan: &Plan, course: &Course) -> Targets {
        // To where crossing speed and preload must be reached, by the table or the felt corner.
        let ahead = course.distance.map(|distance| distance - plan.approach.slow_from);
        let within =
            |from: Option<Millimetres>, distance| from.is_some_and(|from| from <= distance);
        // Out of sight of a step no braking can be due, whatever the speed is doing.
        let sight = self.sight(plan, course);
        let due = |from: Option<Millimetres>, speed, lag: Seconds| {
            within(from, sight)
                && within(from, self.brake_distance(course, speed) + course.speed * lag)
        };
        // A wheel that stays slow must be slow in time; of one that speeds up again at once the
        // slowest place may come later. Around the corner its tread runs farther than the axle.
        let (felt, lag) = if plan.approach.release_time > Q16::ZERO {
            (ahead.map(|ahead| ahead * self.around_corner), Q16::ZERO)
        } else {
            (ahead, BRAKE_LAG)
        };
        let window = course.distance.map(|distance| distance - plan.approach.window_from);
        let looking = course.looking || course.felt || due(window, plan.approach.window_speed, lag);
        let braking = course.braking || course.felt && due(felt, plan.approach.slowest_speed, lag);
        let earliest = if course.felt { ahead } else { ahead.map(|at| at - steps.tolerance()) };
        let ramping = course.ramping
            || course.critical
            || within(
                earliest,
                self.ramp_distance(plan, course.reference.min(plan.cruise_preload)),
            );
        let preload = if ramping { plan.ramp_preload } else { plan.cruise_preload };
        let mut speed = match (looking, braking) {
            (_, true) => plan.approach.slowest_speed,
            (true, false) => plan.approach.window_speed,
            (false, false) => plan.cruise_speed,
        };
        let mut waiting = false;
        // Without look-ahead the preload between the steps is the one to have there.
        let due = if plan.look_ahead { plan.cross_preload } else { plan.cruise_preload };
        let short = due - course.preload;
        if let Some(distance) = course.distance
            && short > self.reached_within
            // On the edge alone a wheel that goes back cannot wait: its tread sinks in.
            && !(course.critical && course.direction == Direction::Retract)
        {
            // Lift off with the preload, not before it; what is slow lies within that time.
            let needed = self.timing.ramp(short);
            let ready_from = plan.approach.ready_from + short * plan.approach.earlier_per_preload;
            let fast = distance - ready_from.max(plan.approach.slow_from);
            let slow_distance = (plan.approach.slow_from - plan.approach.ready_from).max(Q16::ZERO);
            let slow = divide(slow_distance, plan.approach.slowest_speed);
            let allowed = if fast > Q16::ZERO {
                if needed > slow { self.arriving_in(needed - slow, fast, course) } else { Q16::MAX }
            } else {
                let ready = self.arriving_in(needed.min(HELD_FOR), distance - ready_from, course);
                let lifting = distance - plan.approach.ready_from;
                self.arriving_in(needed, lifting, course).min(ready)
            };
            if allowed < speed {
                speed = allowed;
                // A preload that rises as planned is not waited for.
                waiting = allowed < plan.approach.slowest_speed && course.preload_late;
            }
        }
        let short = short - self.reached_within;
        let released = course.released
            || course.felt
                && within(course.distance, plan.approach.release_from)
                && course.speed <= plan.approach.slowest_speed * SLOWEST_WITHIN
                && (short <= Q16::ZERO
                    || !course.preload_late
                        && self.timing.ramp(short) <= plan.approach.release_time);
        if released {
            speed = plan.cruise_speed;
        }
        Targets {
            speed: speed.min(self.end_speed(steps, course, sight)),
            preload,
            ramping,
            looking,
            braking,
            released,
            approaching: looking || ramping,
            waiting,
        }
    }

    /// Speed at which what is `ahead` takes this time, mm/s, braking to it included.
    fn arriving_in(
        &self,
        needed: Seconds,
        ahead: Millimetres,
        course: &Course,
    ) -> MillimetresPerSecond {
        let mean = divide(ahead.max(Q16::ZERO), needed);
        let braking = self.timing.speed_change((course.speed - mean).max(Q16::ZERO));
        if braking >= needed {
            return mean;
        }
        let braked =
            if course.speed > mean { self.brake_distance(course, mean) } else { Q16::ZERO };
        divide((ahead - braked).max(Q16::ZERO), needed - braking)
    }

    /// Distance before the earliest place where the preload must be reached at which a preload now
    /// referenced at `reference` must start to rise, mm: what it takes longer than the braking
    /// is driven at cruise speed.
    fn ramp_distance(&self, plan: &Plan, reference: Newtons) -> Millimetres {
        let missing = plan.cross_preload - reference;
        if !plan.look_ahead || plan.cross_preload <= plan.cruise_preload {
            return if plan.look_ahead { plan.brake_distance } else { Q16::MIN };
        }
        let needed = self.timing.preload_change(missing.max(Q16::ZERO));
        plan.brake_distance + (needed - plan.brake_time).max(Q16::ZERO) * plan.cruise_speed
    }

    /// Distance within which a step or the end can ask for another speed, mm.
    fn sight(&self, plan: &Plan, course: &Course) -> Millimetres {
        if course.speed <= plan.cruise_speed.max(plan.cross_speed) {
            plan.brake_horizon + course.speed * BRAKE_LAG
        } else {
            Q16::MAX
        }
    }

    /// Distance in which the profile comes from its speed to `speed`, mm. Acceleration
    /// still under way is first taken back: until then the speed rises to a peak.
    fn brake_distance(&self, course: &Course, speed: MillimetresPerSecond) -> Millimetres {
        let rising = course.acceleration.max(Q16::ZERO);
        let until_peak = self.timing.until_level(rising);
        let peak = course.speed + rising * until_peak * q16(500_000);
        peak * until_peak + self.timing.brake_distance(peak, speed)
    }

    /// Speed towards the end of travel, mm/s: free until braking to rest must begin.
    fn end_speed(
        &self,
        steps: &Steps,
        course: &Course,
        sight: Millimetres,
    ) -> MillimetresPerSecond {
        let due = || course.remaining <= self.brake_distance(course, Q16::ZERO) - END_LATE;
        if steps.arrived(course.remaining) || course.remaining <= sight && due() {
            Q16::ZERO
        } else {
            Q16::MAX
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use crate::model::{Learned, PlanRequest, Planner};
    use proptest::prelude::*;

    fn setting(back: bool) -> (Rig, Schedule, Steps, Plan) {
        let rig = Rig::prototype();
        let direction = if back { Direction::Retract } else { Direction::Deploy };
        let plan = Planner::try_build(&rig).unwrap().plan(&PlanRequest {
            sequence: 1,
            direction,
            step: 2,
            learned: Learned::default(),
            preload: Q16::from_num(50),
            distance: Q16::ZERO,
            review: None,
            slipped: None,
        });
        (rig.clone(), Schedule::try_build(&rig).unwrap(), Steps::try_build(&rig).unwrap(), plan)
    }

    fn course(plan: &Plan, distance: f64, speed: f64, preload: f64) -> Course {
        Course {
            direction: plan.direction,
            distance: Some(Q16::from_num(distance)),
            remaining: Q16::from_num(500),
            critical: false,
            felt: false,
            ramping: false,
            looking: false,
            braking: false,
            released: false,
            speed: Q16::from_num(speed),
            acceleration: Q16::ZERO,
            reference: Q16::from_num(preload),
            preload: Q16::from_num(preload),
            preload_late: false,
        }
    }

    proptest! {
        #[test]
        fn targets_stay_between_the_plan_s_ends(
            back in any::<bool>(),
            distance in -30.0..60.0f64,
            speed in 0.0..40.0f64,
            preload in 0.0..60.0f64,
        ) {
            let (_, schedule, steps, plan) = setting(back);
            let got = schedule.targets(&steps, &plan, &course(&plan, distance, speed, preload));
            prop_assert!(got.speed >= Q16::ZERO && got.speed <= plan.cruise_speed);
            prop_assert!(got.preload == plan.cruise_preload || got.preload == plan.ramp_preload);
        }

        #[test]
        fn in_the_window_the_wheel_is_ready_for_a_corner_and_brakes_once_it_is_felt(
            back in any::<bool>(),
            into in 0.0..1.0f64,
        ) {
            let (_, schedule, steps, plan) = setting(back);
            let standing = plan.cross_preload.to_num::<f64>();
            let at = |distance: Millimetres, felt| Course {
                felt,
                ..course(&plan, distance.to_num::<f64>() - into, 8.0, standing)
            };
            let looking = schedule.targets(&steps, &plan, &at(plan.approach.window_from, false));
            prop_assert_eq!(looking.speed, plan.approach.window_speed);
            prop_assert_eq!(looking.preload, plan.ramp_preload);
            prop_assert!(looking.looking && !looking.braking && !looking.waiting);
            let felt = schedule.targets(&steps, &plan, &at(plan.approach.slow_from, true));
            prop_assert!(felt.braking && !felt.waiting);
            // As slow as planned and with its preload it speeds up again before it lifts off.
            let from = plan.approach.release_from.to_num::<f64>();
            let there = plan.approach.slow_from.to_num::<f64>() - into < from;
            prop_assert_eq!(felt.released, there);
            let speed = if there { plan.cruise_speed } else { plan.approach.slowest_speed };
            prop_assert_eq!(felt.speed, speed);
            let fast = Course { speed: q16(20_000_000), ..at(plan.approach.slow_from, true) };
            let fast = schedule.targets(&steps, &plan, &fast);
            prop_assert!(!fast.released && fast.speed == plan.approach.slowest_speed);
            let short = Course { preload: q16(33_300_000), ..at(plan.approach.slow_from, true) };
            prop_assert!(!schedule.targets(&steps, &plan, &short).released);
        }

        #[test]
        fn without_its_preload_the_wheel_does_not_lift_off(
            back in any::<bool>(),
            ahead in 0.0..2.0f64,
        ) {
            let (rig, schedule, steps, plan) = setting(back);
            let distance = plan.approach.ready_from.to_num::<f64>() + ahead;
            let at = Course { felt: true, ..course(&plan, distance, 8.0, 33.3) };
            let got = schedule.targets(&steps, &plan, &at);
            // At most so fast that the missing preload is there first.
            let missing = plan.cross_preload.to_num::<f64>() - 33.3;
            let bound = ahead / (missing / rig.preload.slew_n_per_s);
            prop_assert!(got.speed.to_num::<f64>() <= bound + 1e-3, "{} {bound}", got.speed);
            // It waits in earnest only for a preload that is behind its actuator.
            prop_assert!(!got.waiting);
            let late = Course { preload_late: true, ..at };
            let late = schedule.targets(&steps, &plan, &late);
            prop_assert_eq!(late.waiting, late.speed < plan.approach.slowest_speed);
        }

        #[test]
        fn the_end_is_approached_at_a_speed_that_the_profile_can_stop_from(
            remaining in 0.06..40.0f64,
            speed in 0.0..30.0f64,
        ) {
            let (_, schedule, steps, plan) = setting(false);
            let at = Course {
                remaining: Q16::from_num(remaining),
                distance: None,
                ..course(&plan, 0.0, speed, 33.3)
            };
            let got = schedule.targets(&steps, &plan, &at).speed;
            let least = schedule.timing.brake_distance(Q16::from_num(speed), Q16::ZERO) - END_LATE;
            let least = least.to_num::<f64>();
            prop_assume!((remaining - least).abs() > 1e-3);
            let wanted = if remaining < least { Q16::ZERO } else { plan.cruise_speed };
            prop_assert_eq!(got, wanted);
        }
    }

    proptest! {
        #[test]
        fn out_of_sight_no_braking_is_due(
            back in any::<bool>(),
            speed in 0.0..90.0f64,
            rising in 0.0..1.0f64,
        ) {
            let (rig, schedule, _, plan) = setting(back);
            let acceleration = Q16::from_num(rising * rig.drive.acceleration_mm_s2);
            let at = Course { acceleration, ..course(&plan, 0.0, speed, 40.0) };
            let needs = schedule.brake_distance(&at, plan.cross_speed) + at.speed * BRAKE_LAG;
            prop_assert!(needs <= schedule.sight(&plan, &at), "{needs}");
        }
    }

    #[test]
    fn who_does_not_look_ahead_raises_nothing_ahead() {
        for back in [false, true] {
            let (_, schedule, _, plan) = setting(back);
            let ramp = |plan: &Plan| schedule.ramp_distance(plan, plan.cruise_preload);
            let blind = Plan { look_ahead: false, ..plan };
            let level = Plan { cross_preload: plan.cruise_preload, ..plan };
            let neither = Plan { look_ahead: false, ..level };
            assert!(plan.cross_preload > plan.cruise_preload && ramp(&plan) >= plan.brake_distance);
            assert_eq!(ramp(&level), plan.brake_distance);
            assert_eq!([ramp(&blind), ramp(&neither)], [Q16::MIN; 2]);
        }
    }
}
