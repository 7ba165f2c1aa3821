//! From the plan and the way to the step: speed and preload asked for in this tick.

#![deny(clippy::float_arithmetic)]

use crate::estimate::Steps;
use crate::model::Plan;
use crate::model::timing::Timing;
use crate::numeric::{checked, divide};
use crate::rig::{Rig, RigError};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons, Q16, Seconds, q16,
};

/// Short of the wanted preload by no more than this part of the limit, it stands:
/// worth 1.2 % of the gap, less than the schedule's reserve.
const REACHED_PART: Q16 = q16(20_000);
/// Way by which braking starts early, for the tick and the loop's lag, mm.
const BRAKE_RESERVE: Millimetres = q16(300_000);
/// Time that a preload needs after its reference, kept before a window, s.
const SETTLING: Seconds = q16(150_000);
/// Speed at which the last tenths of a millimetre are covered, mm/s.
const END_CREEP: MillimetresPerSecond = q16(1_500_000);
/// Limits of a rig.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Schedule {
    timing: Timing,
    /// Short of the wanted preload by no more than this, it stands, N.
    reached_within: Newtons,
}

/// Where the wheel is on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Way of the run.
    pub direction: Direction,
    /// Axial way to the face of the step ahead, along the run; none if no step is left.
    pub distance: Option<Millimetres>,
    /// Axial way to the end of travel, along the run, mm.
    pub remaining: Millimetres,
    /// A corner is felt and the lower wall has not been left (retract: reached).
    pub critical: bool,
    /// The preload is already being raised for this step.
    pub ramping: bool,
    /// The speed is already being brought down for this step.
    pub braking: bool,
    /// Speed and acceleration of the profile, along the run, mm/s and mm/s^2.
    pub speed: MillimetresPerSecond,
    /// See `speed`.
    pub acceleration: MillimetresPerSecond2,
    /// Preload reference as far as it has come, N.
    pub reference: Newtons,
    /// Measured preload, N.
    pub preload: Newtons,
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
    /// The speed is brought down for the step ahead; likewise.
    pub braking: bool,
    /// The step ahead already has an effect.
    pub approaching: bool,
    /// The speed is held back because the preload does not stand yet.
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

    /// Short of the wanted preload by no more than this, it stands, N.
    pub const fn reached_within(&self) -> Newtons {
        self.reached_within
    }

    /// What to ask for.
    pub fn targets(&self, steps: &Steps, plan: &Plan, course: &Course) -> Targets {
        let to_window = steps.to_window(course.direction, course.distance);
        let within = |way: Millimetres| to_window.is_some_and(|ahead| ahead <= way);
        // Out of sight of a step no braking can be due, whatever the speed is doing.
        let sight = self.sight(plan, course);
        let braking = course.braking
            || course.critical
            || within(sight) && within(self.brake_way(course, plan.cross_speed) + BRAKE_RESERVE);
        let ramping =
            course.ramping || course.critical || within(self.ramp_way(plan, course.reference));
        let preload = if ramping { plan.cross_preload } else { plan.cruise_preload };
        let mut speed = if braking { plan.cross_speed } else { plan.cruise_speed };
        let mut waiting = false;
        let short = plan.cross_preload - course.preload;
        if let (false, true, Some(ahead)) = (course.critical, ramping, to_window)
            && short > self.reached_within
            && ahead > -steps.tolerance()
        {
            // Arrive no sooner than the preload: at the window, not at the corner.
            let needed = self.timing.ramp(short) + SETTLING;
            let allowed = divide(ahead.max(Q16::ZERO), needed);
            if allowed < speed {
                speed = allowed;
                waiting = allowed < plan.cross_speed;
            }
        }
        Targets {
            speed: speed.min(self.end_speed(steps, course, sight)),
            preload,
            ramping,
            braking,
            approaching: braking || ramping,
            waiting,
        }
    }

    /// Way before the window at which a preload now referenced at `reference` must
    /// start to steps, mm: what it takes longer than the braking is driven at cruise
    /// speed.
    fn ramp_way(&self, plan: &Plan, reference: Newtons) -> Millimetres {
        let missing = plan.cross_preload - reference;
        if !plan.look_ahead || plan.cross_preload <= plan.cruise_preload {
            return if plan.look_ahead { plan.brake_way } else { Q16::MIN };
        }
        let needed = self.timing.preload_change(missing.max(Q16::ZERO));
        plan.brake_way + (needed - plan.brake_time).max(Q16::ZERO) * plan.cruise_speed
    }

    /// Way within which a step or the end can ask for another speed, mm.
    fn sight(&self, plan: &Plan, course: &Course) -> Millimetres {
        if course.speed <= plan.cruise_speed.max(plan.cross_speed) {
            plan.brake_horizon + BRAKE_RESERVE
        } else {
            Q16::MAX
        }
    }

    /// Way in which the profile comes from where it stands to `speed`, mm. Acceleration
    /// still under way is first taken back: until then the speed rises to a peak.
    fn brake_way(&self, course: &Course, speed: MillimetresPerSecond) -> Millimetres {
        let rising = course.acceleration.max(Q16::ZERO);
        let until_peak = self.timing.until_level(rising);
        let peak = course.speed + rising * until_peak * q16(500_000);
        peak * until_peak + self.timing.brake_way(peak, speed)
    }

    /// Speed towards the end of travel, mm/s: free until braking must begin, then a creep
    /// that is left within a few hundredths of a millimetre.
    fn end_speed(
        &self,
        steps: &Steps,
        course: &Course,
        sight: Millimetres,
    ) -> MillimetresPerSecond {
        if course.remaining > sight {
            Q16::MAX
        } else if steps.arrived(course.remaining) {
            Q16::ZERO
        } else if course.remaining <= self.brake_way(course, END_CREEP) + BRAKE_RESERVE {
            END_CREEP
        } else {
            Q16::MAX
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use crate::model::{PlanRequest, Planner};
    use proptest::prelude::*;

    fn setting(back: bool) -> (Rig, Schedule, Steps, Plan) {
        let rig = Rig::prototype();
        let direction = if back { Direction::Retract } else { Direction::Deploy };
        let plan = Planner::try_build(&rig).unwrap().plan(&PlanRequest {
            sequence: 1,
            direction,
            step: 2,
            scale: q16(1_000_000),
            review: None,
        });
        (rig.clone(), Schedule::try_build(&rig).unwrap(), Steps::try_build(&rig).unwrap(), plan)
    }

    fn course(plan: &Plan, distance: f64, speed: f64, preload: f64) -> Course {
        Course {
            direction: plan.direction,
            distance: Some(Q16::from_num(distance)),
            remaining: Q16::from_num(500),
            critical: false,
            ramping: false,
            braking: false,
            speed: Q16::from_num(speed),
            acceleration: Q16::ZERO,
            reference: Q16::from_num(preload),
            preload: Q16::from_num(preload),
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
            prop_assert!(got.preload == plan.cruise_preload || got.preload == plan.cross_preload);
        }

        #[test]
        fn inside_the_window_speed_and_preload_are_those_of_the_crossing(
            back in any::<bool>(),
            into in 0.0..3.0f64,
        ) {
            let (_, schedule, steps, plan) = setting(back);
            let edge = steps.corner().first_contact(plan.direction) + steps.tolerance();
            let distance = edge.to_num::<f64>() - into;
            let standing = plan.cross_preload.to_num::<f64>();
            let got = schedule.targets(&steps, &plan, &course(&plan, distance, 8.0, standing));
            prop_assert_eq!(got.speed, plan.cross_speed);
            prop_assert_eq!(got.preload, plan.cross_preload);
            prop_assert!(got.approaching && !got.waiting);
        }

        #[test]
        fn without_its_preload_the_wheel_does_not_enter_the_window(
            back in any::<bool>(),
            ahead in 0.0..2.0f64,
        ) {
            let (rig, schedule, steps, plan) = setting(back);
            let edge = steps.corner().first_contact(plan.direction) + steps.tolerance();
            let distance = edge.to_num::<f64>() + ahead;
            let got = schedule.targets(&steps, &plan, &course(&plan, distance, 8.0, 33.3));
            // At most so fast that the missing preload is there first.
            let missing = plan.cross_preload.to_num::<f64>() - 33.3;
            let bound = ahead / (missing / rig.preload.slew_n_per_s);
            prop_assert!(got.speed.to_num::<f64>() <= bound + 1e-3, "{} {bound}", got.speed);
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
            let got = schedule.targets(&steps, &plan, &at).speed.to_num::<f64>();
            let way = schedule.timing.brake_way(Q16::from_num(speed), END_CREEP).to_num::<f64>();
            if remaining < way {
                prop_assert_eq!(got, END_CREEP.to_num::<f64>());
            } else if remaining > way + 0.4 {
                prop_assert_eq!(got, plan.cruise_speed.to_num::<f64>());
            }
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
            let needs = schedule.brake_way(&at, plan.cross_speed) + BRAKE_RESERVE;
            prop_assert!(needs <= schedule.sight(&plan, &at), "{needs}");
        }
    }

    #[test]
    fn a_step_is_in_sight_from_the_longest_braking_way_and_a_reserve() {
        for back in [false, true] {
            let (_, schedule, _, plan) = setting(back);
            let sight = |speed: Q16| {
                schedule.sight(&plan, &Course { speed, ..course(&plan, 0.0, 0.0, 40.0) })
            };
            let most = plan.cruise_speed.max(plan.cross_speed);
            assert_eq!(sight(most), plan.brake_horizon + BRAKE_RESERVE);
            assert_eq!(sight(Q16::ZERO), plan.brake_horizon + BRAKE_RESERVE);
            assert_eq!(sight(most + Q16::DELTA), Q16::MAX);
        }
    }

    #[test]
    fn who_does_not_look_ahead_raises_nothing_ahead() {
        for back in [false, true] {
            let (_, schedule, _, plan) = setting(back);
            let way = |plan: &Plan| schedule.ramp_way(plan, plan.cruise_preload);
            let blind = Plan { look_ahead: false, ..plan };
            let level = Plan { cross_preload: plan.cruise_preload, ..plan };
            let neither = Plan { look_ahead: false, ..level };
            assert!(plan.cross_preload > plan.cruise_preload && way(&plan) >= plan.brake_way);
            assert_eq!(way(&level), plan.brake_way);
            assert_eq!([way(&blind), way(&neither)], [Q16::MIN; 2]);
        }
    }
}
