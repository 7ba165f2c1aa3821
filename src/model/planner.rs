//! The schedule: the fastest course over the next step that keeps the gap and the friction margin,
//! by rolling the tread out over it.

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod course;
mod review;
mod search;

use super::approach::Approach;
use super::guard::Guard;
use super::plan::{Learned, LimitedBy, Plan, PlanRequest, Review, Strategy};
use super::profile::Profile;
use super::timing::Timing;
use super::tread::{Tread, TreadState};
use super::wind_up::Shear;
use crate::fault::Limit;
use crate::numeric::{between, divide, sqrt};
use crate::rig::MAX_STEPS;
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, NewtonsPerSecond, Q16, Ratio, Seconds,
    q16, ticks_to_seconds,
};
use course::{Course, Scene};
use embassy_futures::block_on;
use search::Search;

/// One sigma of the logarithm of the stiffness of a tread that has shown before the first crossing
/// that it is not as known.
pub const SHOWN_DEVIATION: Ratio = q16(240_000);
/// Stiffness scale up to which the tread is as known: four deviations of 4 %, which one of 15,000
/// exceeds.
pub const KNOWN_SCALE: Ratio = q16(1_160_000);
/// Deviations of the stiffness by which the plan takes the tread for stiffer than it seems: five of
/// six are not stiffer.
const SIGMAS: Ratio = q16(1_000_000);

/// Measured gap over the reference from which it is reported: twice the error of the measurement
/// on coupled treads.
const WIDE: Ratio = q16(1_030_000);

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

/// Relative difference of a gap from its target that is none.
const SAME_GAP: Ratio = q16(10_000);

/// Height that the centre lacks at lift-off where the search begins, mm: what the tread still keeps of
/// its compression.
const SHORT: Millimetres = q16(110_000);

/// How a wheel falls behind its profile while a corner is not fed forward.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct DriveModel {
    /// Part of the lag that the speed loop makes good in a tick.
    decay: Q16,
    /// Speed lost per load that appears, mm/s/N.
    lag_per_load: Q16,
}

/// How the preload follows its command.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct PretightenerModel {
    /// Dead time and lag, s.
    settles: Seconds,
    /// Rate of a rise, N/s.
    rate: NewtonsPerSecond,
}

/// The model side of the schedule; runs outside the tick. The default is a place to read one into.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Planner {
    tread: Tread,
    shear: Shear,
    profile: Profile,
    timing: Timing,
    drive: DriveModel,
    pretightener: PretightenerModel,
    guard: Guard,
    strategy: Strategy,
    /// Tangent of the arm angle at each step.
    tangents: heapless::Vec<Ratio, MAX_STEPS>,
    /// Radial force that the arm's inclination adds, per load and tangent.
    coupling: Ratio,
    /// Axial load on this wheel as known, N.
    load: Newtons,
    /// Gap to hold, deploy and retract, mm.
    gap_ref: [Millimetres; 2],
    /// Gap aimed at, deploy and retract, mm.
    aimed: [Millimetres; 2],
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
    /// Distance to the face at which a wheel that is not compressed touches the corner, mm.
    touch_at: Millimetres,
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
}

impl Planner {
    /// Answers a request at once.
    pub fn plan(&self, request: &PlanRequest) -> Plan {
        block_on(self.plan_pausing(&mut TreadState::default(), request, async || ()))
    }

    /// Answers a request with a tread from outside, whose two kilobytes are never on the stack; it
    /// pauses every few strides, so that tasks beside it run on.
    pub async fn plan_pausing(
        &self,
        state: &mut TreadState,
        request: &PlanRequest,
        mut pause: impl AsyncFnMut(),
    ) -> Plan {
        let pause = &mut pause;
        let mut learned = request.learned;
        learned.scale = between(learned.scale, self.scale_range.0, self.scale_range.1);
        let outcome = match request.review.as_ref() {
            Some(review) => Some(self.review((&mut *state, &mut *pause), review, &learned).await),
            None => None,
        };
        let mut learned = outcome.as_ref().map_or(learned, |outcome| outcome.learned);
        if let Some(force) = request.slipped {
            let used = self
                .needed_at_least_speed((&mut *state, &mut *pause), request, &learned, force)
                .await;
            learned.slips = learned.slips.min(used.max(learned.grips));
        }
        // Until the step behind has been reviewed, the tread may turn out stiffer.
        let rises_further = request.review.is_none();
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
            most_preload: self.most(),
            rolling_preload: self.rolling_preload(),
            gap: self.aimed[request.direction as usize],
            slip_margin: self.usable,
            slips: learned.slips,
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
            ..Plan::default()
        };
        if request.step > 0 {
            // The speed at which a tread that is not as known has kept the gap keeps it again: that of
            // its slowest stride.
            let keeps = |review: &&Review| {
                [review.direction, request.direction] == [Direction::Retract; 2]
                    && (review.trusted && learned.unknown)
                    && review.gap <= self.gap_ref(Direction::Retract)
            };
            let review = request.review.as_ref().filter(keeps);
            let ticks = review.and_then(|review| review.history.strides().map(|s| s.ticks()).max());
            let kept = ticks
                .map_or(Q16::ZERO, |ticks| divide(self.tread.stride(), ticks_to_seconds(ticks)));
            let request = PlanRequest { learned, review: None, ..*request };
            self.crossing((state, pause), &request, (rises_further, kept), &mut plan).await;
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

    /// Distance to the face at which the corner is felt, mm: as learned, or under a tread that is not
    /// as known as late as it may be.
    fn felt_at(&self, request: &PlanRequest) -> Millimetres {
        let direction = request.direction as usize;
        let late = request.learned.felt_late[direction];
        let unsure = request.learned.unknown && late == Q16::ZERO;
        self.felt_at[direction] - if unsure { review::FELT_LATE } else { late }
    }

    fn scene(&self, request: &PlanRequest, cruise: MillimetresPerSecond) -> Scene {
        let learned = &request.learned;
        let index = usize::from(request.step).saturating_sub(1);
        let tangent = self.tangents.get(index).copied().unwrap_or_default();
        Scene {
            direction: request.direction,
            load: self.load + learned.extra_load,
            felt_at: self.felt_at(request),
            scale: learned.scale * (Ratio::ONE + SIGMAS * learned.deviation),
            cruise,
            arm_thrust: self.thrust(learned, tangent),
            preload: request.preload,
            most: self.most(),
            reacts: self.strategy == Strategy::Reactive,
            distance: request.distance,
            speed: request.speed,
            starts: (request.preload < self.rolling_preload()).then(|| {
                let missing = self.rolling_preload() - request.preload;
                self.pretightener.settles + divide(missing, self.pretightener.rate)
            }),
        }
    }

    /// Speed and preload at the step.
    async fn crossing(
        &self,
        (state, pause): (&mut TreadState, &mut impl AsyncFnMut()),
        request: &PlanRequest,
        (rises_further, kept): (bool, MillimetresPerSecond),
        plan: &mut Plan,
    ) {
        let learned = &request.learned;
        let target = self.aimed[request.direction as usize];
        let scene = self.scene(request, plan.cruise_speed);
        let floor = self.least_speed.max(kept).min(plan.cruise_speed);
        // No faster than the pre-tightener can follow the spring over the corner.
        let ceiling = plan.cruise_speed.min(self.climb_speed.max(floor));
        let ends = self.prescribed_speed.map_or((floor, ceiling), |speed| (speed, speed));
        let (floor, ceiling) = ends;
        let mut search =
            Search::new(self, (&mut *state, &mut *pause), scene, request, (floor, ceiling));
        let course = search.fastest().await;
        // A band that reaches below the floor is entered: too slow would be worse.
        let (speed, moved) = self.guard.below(course.approach.slowest_speed);
        let moved = moved && speed >= floor;
        let course = if moved {
            let approach = Approach { slowest_speed: speed, ..course.approach };
            let rolled = self.roll_out((&mut *state, &mut *pause), &scene, &approach).await;
            Course { approach, rolled }
        } else {
            course
        };
        let Course { approach, rolled } = course;
        let slowest = approach.slowest_speed;
        plan.approach = Approach { release_time: rolled.released, lift: rolled.lift, ..approach };
        plan.cross_speed = self.prescribed_speed.unwrap_or(rolled.speed.max(slowest));
        plan.cross_preload = rolled.preload;
        let raises = match self.strategy {
            Strategy::Constant => false,
            Strategy::Scheduled => rolled.rising || rises_further,
            Strategy::Reactive | Strategy::Limit => true,
        };
        plan.ramp_preload = if raises { self.most_preload } else { plan.cross_preload };
        plan.gap = rolled.gap;
        let (friction, _) = self.friction_of(learned);
        plan.slip_margin = friction - rolled.utilisation;
        plan.short = rolled.utilisation + SAME_NEED >= learned.slips;
        let too_wide = rolled.gap > target + target * SAME_GAP;
        plan.limited_by = if moved {
            add(&mut plan.limits, Limit::ResonanceAvoided);
            LimitedBy::Resonance
        } else if slowest >= ceiling {
            LimitedBy::Drive
        } else if rolled.gap < target - target * SAME_GAP {
            LimitedBy::Friction
        } else if slowest <= floor || too_wide {
            LimitedBy::LeastSpeed
        } else if rolled.rising {
            LimitedBy::Slew
        } else {
            LimitedBy::Preload
        };
        if too_wide {
            add(&mut plan.limits, Limit::SpeedFloor);
        } else if !rolled.rising && slowest < self.safe_speed {
            add(&mut plan.limits, Limit::PreloadLimited);
        }
        if plan.slip_margin < self.friction - self.usable {
            add(&mut plan.limits, Limit::SlipMarginLow);
        }
    }

    /// Friction that a crossing at the least speed needs under this radial force, N.
    async fn needed_at_least_speed(
        &self,
        rolling: (&mut TreadState, &mut impl AsyncFnMut()),
        request: &PlanRequest,
        learned: &Learned,
        force: Newtons,
    ) -> Ratio {
        let scene = self.scene(&PlanRequest { learned: *learned, ..*request }, self.cruise_speed);
        let preload = force - scene.arm_thrust;
        let scene = Scene { preload, most: preload, scale: learned.scale, starts: None, ..scene };
        let approach = Approach {
            window_from: self.touch_at,
            window_speed: self.least_speed,
            slowest_speed: self.least_speed,
            ..Approach::default()
        };
        self.roll_out(rolling, &scene, &approach).await.utilisation
    }

    /// Time that the margin of friction is worth which is missing, s.
    fn price(&self, used: Ratio, friction: Ratio, usable: Ratio) -> Seconds {
        let likely = (used - (friction - READ_LOW)).max(Q16::ZERO) * LIKELY_TIMES;
        divide((used - usable).max(Q16::ZERO) + likely, MARGIN_PER_SECOND)
    }

    /// Distance and time of braking before the step.
    fn braking(&self, plan: &mut Plan) {
        let (cruise, slowest) = (plan.cruise_speed, plan.approach.slowest_speed);
        plan.brake_horizon = self.timing.longest_brake_distance(cruise.max(plan.cross_speed));
        plan.brake_distance = self.timing.brake_distance(cruise, slowest);
        plan.brake_time = self.timing.speed_change(cruise - slowest);
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

    fn between_steps(&self) -> Newtons {
        if self.strategy == Strategy::Limit { self.most_preload } else { self.cruise_preload }
    }

    /// Highest preload that the strategy allows, N.
    fn most(&self) -> Newtons {
        if self.strategy == Strategy::Constant { self.cruise_preload } else { self.most_preload }
    }

    /// Preload from which the wheel may roll, N: at a prescribed speed all that it is to have.
    fn rolling_preload(&self) -> Newtons {
        self.prescribed_speed.map_or(self.rolling_preload, |_| self.most())
    }

    /// Distance along the run to the face at lift-off (retract: touch-down) with this gap, mm.
    fn lift(&self, direction: Direction, gap: Millimetres) -> Millimetres {
        // The tread's memory leaves the wall before the centre is as high as the free wheel's.
        let deploys = direction == Direction::Deploy;
        let height = if deploys { self.radius - SHORT } else { self.radius };
        let reach = self.radius + gap;
        let lift = sqrt((reach - height) * (reach + height));
        if deploys { lift } else { -lift }
    }

    /// Time that a change between these speeds takes longer than its distance at cruise speed, s.
    fn lost(&self, slow: MillimetresPerSecond, fast: MillimetresPerSecond) -> Seconds {
        let mean = (slow + fast).half();
        let share = divide(self.cruise_speed - mean, self.cruise_speed);
        self.timing.speed_change(fast - slow) * share.max(Q16::ZERO)
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
mod tests;
