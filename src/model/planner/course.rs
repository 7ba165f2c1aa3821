//! One crossing of a plan, rolled out: the wheel follows the plan's approach as the tick does, and
//! the tread says what comes of it.

use super::Planner;
use crate::model::approach::{Approach, Begun, Place};
use crate::model::plan::PLAN_TICKS;
use crate::model::profile::ProfileState;
use crate::model::rollout::{LEAST_SPEED, LiftOff};
use crate::model::tread::{Axial, Drive, TreadState};
use crate::model::wind_up::Spread;
use crate::numeric::divide;
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Seconds, per_tick, q16,
    ticks_to_seconds,
};

/// Tread that rolls before the corner is touched, over the wheel radius: half of the longest patch.
const ROLL_IN: Ratio = q16(250_000);
/// Ticks of a stride at most: a wheel that stands.
const MOST_TICKS: u32 = 400;
/// Ticks before the tread is rolled, at most.
const MOST_TICKS_BEFORE: u32 = 4000;
/// Strides of a rollout at most.
const MOST_STRIDES: u32 = 220;
/// Strides between two pauses, 0.1 ms each, and steps before the tread is rolled.
pub(super) const STRIDES_AT_ONCE: u32 = 4;
const STEPS_AT_ONCE: u32 = 64;
/// Travel at a steady speed that is taken at once, mm.
const STEADY: Millimetres = q16(20_000);

/// What stays the same while a crossing is planned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene {
    pub(super) direction: Direction,
    /// Load and stiffness as known.
    pub(super) load: Newtons,
    pub(super) scale: Ratio,
    /// Distance to the face at which the corner is felt, mm.
    pub(super) felt_at: Millimetres,
    /// Largest speed up to the step, mm/s.
    pub(super) cruise: MillimetresPerSecond,
    /// Radial force beside the preload, N.
    pub(super) arm_thrust: Newtons,
    /// Preload now, that to which it rises, N, distance to the face, mm, and speed, mm/s.
    pub(super) preload: Newtons,
    pub(super) most: Newtons,
    pub(super) distance: Millimetres,
    pub(super) speed: MillimetresPerSecond,
    /// It rises from where the corner is felt.
    pub(super) reacts: bool,
    /// Time until a wheel at rest moves, s.
    pub(super) starts: Option<Seconds>,
}

/// A crossing rolled out.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RolledOut {
    pub(super) gap: Millimetres,
    /// Distance along the run to the face at lift-off (retract: touch-down), mm.
    pub(super) lift: Millimetres,
    /// Preload there, N.
    pub(super) preload: Newtons,
    /// It still rises.
    pub(super) rising: bool,
    /// Largest friction needed.
    pub(super) utilisation: Ratio,
    /// Speed at lift-off, mm/s.
    pub(super) speed: MillimetresPerSecond,
    /// Where the corner is looked for, mm, and from there to lift-off, s.
    pub(super) from: Millimetres,
    pub(super) takes: Seconds,
    /// From where it speeds up again to lift-off, s.
    pub(super) released: Seconds,
    /// Time that is lost until the speed is that of cruise again, s.
    pub(super) regains: Seconds,
    /// Strides that were rolled.
    pub(super) strides: u32,
}

/// An approach and what it gives.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Course {
    pub(super) approach: Approach,
    pub(super) rolled: RolledOut,
}

impl Planner {
    /// Rolls the wheel over the step by this approach under this preload, N.
    pub(super) async fn roll_out(
        &self,
        (state, pause): (&mut TreadState, &mut impl AsyncFnMut()),
        scene: &Scene,
        approach: &Approach,
    ) -> RolledOut {
        let forward = scene.direction == Direction::Deploy;
        let along = |position: Millimetres| if forward { -position } else { position };
        let braking = self.timing.brake_distance(scene.cruise, approach.window_speed);
        let looks = approach.window_from + braking;
        let sense = if forward { Q16::ONE } else { -Q16::ONE };
        let touches = if forward { self.touch_at } else { Q16::ZERO };
        let mut from = touches + self.radius * ROLL_IN;
        let (direction, axial) = (scene.direction, Axial::Driven(scene.load));
        let mut drive = Drive { direction, axial, scale: scene.scale, ..Drive::default() };
        // A wheel that is close and not at cruise speed goes on from where it then is; one at rest
        // has no tread to roll in.
        let goes_on = scene.distance - scene.speed * ticks_to_seconds(PLAN_TICKS);
        let reach = looks + self.timing.brake_distance(scene.cruise, Q16::ZERO);
        let (before, start, speed, steady) = if let Some(starts) = scene.starts {
            from = from.min(scene.distance).max(touches);
            (starts, scene.distance.max(from), Q16::ZERO, Q16::MAX)
        } else if scene.speed < scene.cruise && goes_on < reach && goes_on > touches {
            (ticks_to_seconds(PLAN_TICKS), goes_on.max(from), scene.speed, goes_on)
        } else {
            let start = looks.max(from);
            let rolls = (scene.distance - start).max(Q16::ZERO);
            (divide(rolls, scene.cruise), start, scene.cruise, Q16::MAX)
        };
        let mut reacts_at = None;
        let mut preload = |ticks: u32, felt: bool| {
            let mut since = before + ticks_to_seconds(ticks);
            if scene.reacts {
                let at = felt.then(|| *reacts_at.get_or_insert(since));
                since = at.map_or(Q16::ZERO, |at| since - at);
            }
            let rising = (since - self.pretightener.settles).max(Q16::ZERO);
            (scene.preload + rising * self.pretightener.rate).min(scene.most.max(scene.preload))
        };
        // What lies before the tread's first stride is driven without it.
        let mut follower = Follower { profile: ProfileState::at(speed), ..Follower::default() };
        let mut distance = start;
        let (mut ticks_in_all, mut steps) = (0, 0_u32);
        while distance > from && ticks_in_all < MOST_TICKS_BEFORE {
            let ticks = follower.step(self, approach, scene, distance);
            distance -= Q16::narrow(per_tick(follower.speed())) * Q16::from_num(ticks);
            ticks_in_all += ticks;
            steps += 1;
            if steps % STEPS_AT_ONCE == 0 {
                pause().await;
            }
        }
        drive.pressed = preload(ticks_in_all, false) + scene.arm_thrust;
        self.tread.put_down(state, along(from), &drive);
        let mut rolled = RolledOut { from: start, ..RolledOut::default() };
        let mut lift = LiftOff::wary();
        let (mut per_tread, mut left) = (Q16::ONE, Q16::ZERO);
        let mut carried = Q16::ZERO;
        let mut overshot = Q16::ZERO;
        let (mut here, mut speed) = (from, Q16::ZERO);
        // The tread gives way against its load; the drive makes up for it later.
        let (mut winding, mut spread) = (self.shear.rest(scene.load), Spread::default());
        for stride in 0..MOST_STRIDES {
            if stride % STRIDES_AT_ONCE == 0 {
                pause().await;
            }
            left += self.tread.stride();
            rolled.strides = stride;
            let mut ticks = 0;
            // Up to where it goes on the tread rolls in.
            if distance > steady {
                left = Q16::ZERO;
                drive.duration = divide(self.tread.stride(), follower.speed());
                let contact = self.tread.advance(state, &drive);
                lift.follow(&self.tread, scene.direction, &contact);
                here = along(contact.position);
                distance = here;
                carried = contact.axial;
                continue;
            }
            while left > Q16::ZERO && ticks < MOST_TICKS {
                let passed = follower.step(self, approach, scene, distance);
                let travel = Q16::narrow(per_tick(follower.speed())) * Q16::from_num(passed);
                left -= travel;
                for _ in 0..passed {
                    spread.eases();
                    left -= sense * Q16::narrow(spread.gives);
                }
                distance -= travel * per_tread;
                ticks += passed;
            }
            let ticks = ticks.max(1);
            ticks_in_all += ticks;
            // The last tick goes on into the next stride.
            let over = divide(-left, follower.speed());
            drive.duration = ticks_to_seconds(ticks) - over + overshot;
            overshot = over;
            drive.pressed = preload(ticks_in_all, follower.felt) + scene.arm_thrust;
            let contact = self.tread.advance(state, &drive);
            let now = along(contact.position);
            per_tread = divide(here - now, self.tread.stride() - drive.gives);
            let stride = (self.tread.stride(), drive.duration);
            drive.gives = sense * self.shear.follow(&mut winding, &contact, stride);
            spread.owes += (sense * drive.gives).widen();
            here = now;
            // The stride's remainder lies ahead.
            distance = now - left;
            if follower.begun.released {
                rolled.released += drive.duration;
            }
            // A corner that is felt is fed forward.
            if !follower.felt {
                follower.lags += (contact.axial - carried) * self.drive.lag_per_load;
            }
            carried = contact.axial;
            lift.follow(&self.tread, scene.direction, &contact);
            speed = follower.speed() * per_tread;
            if lift.is_found() {
                break;
            }
        }
        rolled.gap = lift.gap;
        rolled.utilisation = lift.utilisation;
        rolled.lift = along(lift.position);
        rolled.speed = speed;
        rolled.preload = preload(ticks_in_all, follower.felt);
        rolled.rising = rolled.preload < scene.most;
        rolled.takes = ticks_to_seconds(ticks_in_all);
        // A wheel that still brakes first has to end that.
        let slows = (-follower.profile.acceleration()).max(Q16::ZERO);
        let until_level = self.timing.until_level(slows);
        let now = follower.profile.speed();
        let level = (now - slows * until_level.half()).max(Q16::ZERO);
        let share = divide(scene.cruise - (now + level).half(), scene.cruise);
        rolled.regains = until_level * share + self.lost(level, scene.cruise);
        rolled
    }
}

/// The speed that the tick asks for on its way over a corner, and that the wheel has.
#[derive(Default)]
struct Follower {
    profile: ProfileState,
    begun: Begun,
    felt: bool,
    /// By how much the wheel is slower than the profile, mm/s.
    lags: MillimetresPerSecond,
}

impl Follower {
    fn speed(&self) -> MillimetresPerSecond {
        (self.profile.speed() - self.lags).max(LEAST_SPEED)
    }

    /// Goes on for a tick, or for as many as a steady speed needs for [`STEADY`]; returns how many.
    fn step(
        &mut self,
        planner: &Planner,
        approach: &Approach,
        scene: &Scene,
        distance: Millimetres,
    ) -> u32 {
        self.felt |= distance <= scene.felt_at;
        let (speed, acceleration) = (self.profile.speed(), self.profile.acceleration());
        // The preload is that of the rollout: it is waited for where it is another.
        let at = Place { distance, felt: self.felt, speed, acceleration, ready: true };
        let target = approach.speed(&mut self.begun, &at, &planner.timing, scene.cruise);
        let ticks = if speed == target && acceleration == Q16::ZERO {
            divide(STEADY, Q16::narrow(per_tick(self.speed()))).to_num::<u32>().max(1)
        } else {
            planner.profile.step(&mut self.profile, target);
            1
        };
        let decay = planner.drive.decay * Q16::from_num(ticks);
        self.lags -= self.lags * decay.min(Q16::ONE);
        ticks
    }
}
