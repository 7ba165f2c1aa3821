//! From the plan and the distance to the step: speed and preload asked for in this tick.

use crate::estimate::Steps;
use crate::model::Plan;
use crate::model::approach::{Begun, Place};
use crate::model::timing::Timing;
use crate::numeric::{checked, divide};
use crate::rig::{Rig, RigError};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons, Q16, Seconds, q16,
};

/// Short of the wanted preload by no more than this part of the limit, it is reached:
/// worth 1.2 % of the gap, less than the schedule's reserve.
pub(super) const REACHED_PART: Q16 = q16(20_000);
/// Time by which braking starts early, for detection, tick and the loop's lag, s.
const BRAKE_LAG: Seconds = q16(10_000);
/// Distance by which braking for the end starts late, mm: the ticks make the profile's braking
/// shorter by as much.
const END_LATE: Millimetres = q16(30_000);

/// Limits of a rig.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Schedule {
    timing: Timing,
    /// Short of the wanted preload by no more than this, it is reached, N.
    pub(crate) reached_within: Newtons,
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
    /// What of the approach has begun.
    pub begun: Begun,
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Targets {
    /// Speed along the run, mm/s.
    pub speed: MillimetresPerSecond,
    /// Preload, N.
    pub preload: Newtons,
    /// The preload is raised for the step ahead; once so, until the step is behind.
    pub ramping: bool,
    /// What of the approach has begun.
    pub begun: Begun,
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
        })
    }

    /// What to ask for.
    pub fn targets(&self, steps: &Steps, plan: &Plan, course: &Course) -> Targets {
        let sight = self.sight(plan, course);
        // To where the corner is felt, by the table or the corner itself.
        let ahead = course.distance.map(|distance| distance - plan.approach.brake_from);
        let earliest = if course.felt { ahead } else { ahead.map(|at| at - steps.tolerance) };
        let ramping = course.ramping
            || course.critical
            || earliest.is_some_and(|at| {
                at <= self.ramp_distance(plan, course.reference.min(plan.cruise_preload))
            });
        let preload = if ramping { plan.ramp_preload } else { plan.cruise_preload };
        // Without look-ahead the preload between the steps is the one to have there.
        let due = if plan.look_ahead { plan.cross_preload } else { plan.cruise_preload };
        let missing = due - course.preload;
        let needed = self.timing.ramp((missing - self.reached_within).max(Q16::ZERO));
        let mut begun = course.begun;
        let mut speed = plan.cruise_speed;
        let mut waiting = false;
        if let Some(distance) = course.distance {
            let place = Place {
                distance,
                felt: course.felt,
                speed: course.speed,
                acceleration: course.acceleration,
                ready: needed == Q16::ZERO
                    || !course.preload_late && needed <= plan.approach.release_time,
            };
            // Out of sight of a step no braking can be due, whatever the speed is doing.
            let seen = begun.looking || distance - plan.approach.window_from <= sight;
            if seen || course.felt {
                speed = plan.approach.speed(&mut begun, &place, &self.timing, plan.cruise_speed);
            }
            // On the edge alone a wheel that goes back cannot wait: its tread sinks in.
            // A plan that counts on all of the preload also waits for it where the corner is looked
            // for; one that crosses while it rises has its own speed there.
            let counts = begun.looking && plan.cross_preload >= plan.most_preload;
            let waits = course.felt || course.preload_late || counts;
            let sinks = course.critical && course.direction == Direction::Retract;
            if missing > self.reached_within && waits && !sinks {
                let allowed = self.until_ready(plan, course, distance, needed);
                // A preload that rises as planned is not waited for.
                waiting = allowed < plan.approach.slowest_speed && course.preload_late;
                if !begun.released {
                    speed = speed.min(allowed);
                }
            }
        }
        Targets {
            speed: speed.min(self.end_speed(steps, course, sight)),
            preload,
            ramping,
            approaching: begun.looking || ramping,
            begun,
            waiting,
        }
    }

    /// Largest speed at which the wheel lifts off with its preload, which needs this time, and not
    /// before it, mm/s: what is missing where it speeds up again still rises until then.
    fn until_ready(
        &self,
        plan: &Plan,
        course: &Course,
        distance: Millimetres,
        needed: Seconds,
    ) -> MillimetresPerSecond {
        let held = needed - plan.approach.release_time;
        let release = distance - plan.approach.release_from.max(plan.approach.lift);
        if held <= Q16::ZERO {
            Q16::MAX
        } else if release > Q16::ZERO {
            self.in_time(held, release, course)
        } else {
            self.in_time(needed, distance - plan.approach.lift, course)
        }
    }

    /// Speed at which what is `ahead` takes this `time`, mm/s, braking to it included.
    fn in_time(&self, time: Seconds, ahead: Millimetres, course: &Course) -> MillimetresPerSecond {
        let mean = divide(ahead.max(Q16::ZERO), time);
        let braking = self.timing.speed_change((course.speed - mean).max(Q16::ZERO));
        if braking >= time {
            return mean;
        }
        let slows = if course.speed > mean { self.brake_distance(course, mean) } else { Q16::ZERO };
        divide((ahead - slows).max(Q16::ZERO), time - braking)
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

    /// Distance in which the profile comes from its speed to `speed`, mm.
    fn brake_distance(&self, course: &Course, speed: MillimetresPerSecond) -> Millimetres {
        self.timing.distance_to(course.speed, course.acceleration, speed)
    }

    /// Speed towards the end of travel, mm/s: free until braking to rest must begin.
    fn end_speed(&self, steps: &Steps, course: &Course, seen: Millimetres) -> MillimetresPerSecond {
        let due = || course.remaining <= self.brake_distance(course, Q16::ZERO) - END_LATE;
        if steps.arrived(course.remaining) || course.remaining <= seen && due() {
            Q16::ZERO
        } else {
            Q16::MAX
        }
    }
}

#[cfg(test)]
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
            speed: Q16::ZERO,
            searching: false,
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
            begun: Begun::default(),
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
            prop_assert!(looking.begun.looking && !looking.begun.braking && !looking.waiting);
            let braking = at(plan.approach.brake_from, true);
            let felt = schedule.targets(&steps, &plan, &Course { speed: q16(20_000_000), ..braking });
            prop_assert!(felt.begun.braking && !felt.begun.released && !felt.waiting);
            prop_assert_eq!(felt.speed, plan.approach.slowest_speed.min(plan.cruise_speed));
        }

        #[test]
        fn a_wheel_speeds_up_again_where_it_is_slow_and_has_its_preload(
            back in any::<bool>(),
            into in 0.0..0.2f64,
        ) {
            let (_, schedule, steps, plan) = setting(back);
            let distance = plan.approach.release_from.to_num::<f64>() - into;
            let slow = plan.approach.slowest_speed.to_num::<f64>();
            let standing = plan.cross_preload.to_num::<f64>();
            let at = Course { felt: true, ..course(&plan, distance, slow, standing) };
            let released = |course: &Course| {
                let targets = schedule.targets(&steps, &plan, course);
                assert!(!targets.begun.released || targets.speed == plan.cruise_speed);
                targets.begun.released
            };
            prop_assert!(released(&at));
            let fast = Course { speed: plan.cruise_speed + q16(5_000_000), ..at };
            prop_assert!(!released(&fast));
            let short = Course { preload: q16(33_300_000), ..at };
            prop_assert!(!released(&short));
        }

        #[test]
        fn without_its_preload_the_wheel_does_not_lift_off(
            back in any::<bool>(),
            ahead in 0.0..2.0f64,
        ) {
            let (rig, schedule, steps, plan) = setting(back);
            let distance = plan.approach.lift.to_num::<f64>() + ahead;
            let at = Course { felt: true, ..course(&plan, distance, 8.0, 33.3) };
            let got = schedule.targets(&steps, &plan, &at);
            // At most so fast that the missing preload is there first.
            let reached = schedule.reached_within.to_num::<f64>();
            let missing = plan.cross_preload.to_num::<f64>() - 33.3 - reached;
            let takes = missing / (0.98 * rig.preload.slew_n_per_s);
            let release = plan.approach.release_time.to_num::<f64>();
            let bound = ahead / (takes - release);
            prop_assert!(got.speed.to_num::<f64>() <= bound + 0.01, "{} {bound}", got.speed);
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
