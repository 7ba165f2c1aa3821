//! The fastest course over a step that keeps the gap and the friction margin.
//!
//! A course is slow in the window in which the corner is looked for, brakes where it is felt, and
//! speeds up again shortly before lift-off. Three numbers make it: the speed in the window, the
//! slowest speed and the place of the release. For each window and release the slowest speed follows
//! from the gap; of those pairs the one is taken whose course takes least time.

use super::Planner;
use super::course::{Course, RolledOut, Scene};
use crate::model::approach::Approach;
use crate::model::plan::PlanRequest;
use crate::model::tread::TreadState;
use crate::numeric::{between, divide};
use crate::units::{Direction, Millimetres, MillimetresPerSecond, Q16, Ratio, Seconds, q16};

/// The gap is met if it is below its target by no more than this part.
const WITHIN: Ratio = q16(2_000);
/// Rollouts that bring it there.
const SOLVES: u32 = 6;
/// Windows that are compared, by golden section, and releases before the last possible one, mm.
const WINDOWS: u32 = 5;
const RELEASES: [Millimetres; 3] = [q16(50_000), q16(-200_000), q16(300_000)];
/// Golden section.
const GOLDEN: Ratio = q16(618_034);
/// A gap this near its target serves to compare, as a part.
const NEAR: Ratio = q16(5_000);
/// Strides of a search, at rest and under way, after which it compares no more and solves for the
/// best that it has, in at most 1,400 more: 22,000 textbook cycles each, with the waits of flash and
/// beside the tick 1.4 times that.
const MOST_STRIDES: [u32; 2] = [4500, 3200];
/// Change of the slowest speed with the gap that is tried first, 1/s.
const FIRST_SLOPE: Q16 = q16(30_000_000);
/// What a course counts that opens too wide a gap at its slowest, s, times that gap over the target:
/// more than any that keeps it, and the narrowest least.
const INFEASIBLE: Seconds = q16(1_000_000_000);
/// Windows that are tried for a tread that no compared one suits.
const SLOWER: u32 = 5;

/// A search for a course; it pauses every few strides.
pub(super) struct Search<'a, P> {
    pause: &'a mut P,
    planner: &'a Planner,
    state: &'a mut TreadState,
    scene: Scene,
    target: Millimetres,
    /// Lift-off with this gap, mm.
    lift: Millimetres,
    floor: MillimetresPerSecond,
    ceiling: MillimetresPerSecond,
    friction: Ratio,
    usable: Ratio,
    /// The wheel speeds up again before it lifts off.
    releases: bool,
    searching: bool,
    /// The slowest speed that met the gap last.
    guess: MillimetresPerSecond,
    /// Time that a wider gap saves, s/mm.
    per_gap: Q16,
    /// Strides that are left.
    strides: u32,
}

impl<'a, P: AsyncFnMut()> Search<'a, P> {
    pub(super) fn new(
        planner: &'a Planner,
        (state, pause): (&'a mut TreadState, &'a mut P),
        scene: Scene,
        request: &PlanRequest,
        (floor, ceiling): (MillimetresPerSecond, MillimetresPerSecond),
    ) -> Self {
        let target = planner.aimed[request.direction as usize];
        let (friction, usable) = planner.friction_of(&request.learned);
        Self {
            pause,
            planner,
            state,
            scene,
            target,
            lift: planner.lift(request.direction, target),
            floor,
            ceiling,
            friction,
            usable,
            releases: request.direction == Direction::Deploy
                && !request.learned.unknown
                && planner.prescribed_speed.is_none(),
            searching: request.searching,
            guess: ceiling,
            per_gap: q16(-1_500_000),
            strides: MOST_STRIDES[usize::from(request.speed > Q16::ZERO)],
        }
    }

    /// The fastest course.
    pub(super) async fn fastest(&mut self) -> Course {
        let planner = self.planner;
        let top = planner.prescribed_speed.unwrap_or(planner.cruise_speed.min(planner.climb_speed));
        // As fast as it goes.
        let at_once = self.roll(top, Q16::ZERO, self.ceiling).await;
        if self.fits(&at_once.rolled) && self.price(&at_once.rolled) == Q16::ZERO {
            return at_once;
        }
        self.guess = self.floor.max(self.ceiling * q16(300_000));
        // Where the preload is still missing it pays to stay slow for longer.
        let releases: &[Millimetres] = match (self.releases, at_once.rolled.rising) {
            (false, _) => &[Q16::ZERO],
            (true, false) => &RELEASES[..1],
            (true, true) => &RELEASES,
        };
        let (mut window, mut best, mut least) = (self.floor, Q16::ZERO, Q16::MAX);
        for &release in releases {
            if least < Q16::MAX && self.strides == 0 {
                break;
            }
            let (at, cost) = self.window(top, release).await;
            if cost < least {
                (window, best, least) = (at, release, cost);
            }
        }
        // Of a tread that opens too wide a gap with each of these: slower, and slow for longer.
        for _ in 0..SLOWER {
            if least < INFEASIBLE || window <= self.floor {
                break;
            }
            let part = if self.strides > 0 { q16(600_000) } else { Q16::ZERO };
            window = (window * part).max(self.floor);
            best = if self.releases { RELEASES[1] } else { Q16::ZERO };
            least = self.costs(window, best).await;
        }
        let course = self.solve(window, best).await;
        self.gripping(window, best, course).await
    }

    /// The window with which this release costs least, s: golden section.
    async fn window(
        &mut self,
        fastest: MillimetresPerSecond,
        release: Millimetres,
    ) -> (MillimetresPerSecond, Seconds) {
        let (mut low, mut high) = (self.floor, fastest);
        let mut inner = [high - (high - low) * GOLDEN, low + (high - low) * GOLDEN];
        let mut costs = [self.costs(inner[0], release).await, self.costs(inner[1], release).await];
        for _ in 2..WINDOWS {
            if self.strides == 0 {
                break;
            }
            let [slower, faster] = costs;
            if slower < faster {
                high = inner[1];
                inner = [high - (high - low) * GOLDEN, inner[0]];
                costs = [self.costs(inner[0], release).await, slower];
            } else {
                low = inner[0];
                inner = [inner[1], low + (high - low) * GOLDEN];
                costs = [faster, self.costs(inner[1], release).await];
            }
        }
        // The section does not come to its ends.
        let last = self.costs(fastest, release).await;
        let windows = [(inner[0], costs[0]), (inner[1], costs[1]), (fastest, last)];
        windows.into_iter().min_by_key(|(_, cost)| *cost).unwrap_or((fastest, last))
    }

    /// Time that the course with this window and release costs whose gap is the target, s, by
    /// interpolation between the last two that come near it.
    async fn costs(&mut self, window: MillimetresPerSecond, release: Millimetres) -> Seconds {
        let [course, before] = self.approach_target(window, release, NEAR).await;
        let (gap, cost) = (course.rolled.gap, self.cost(&course));
        let slowest = course.approach.slowest_speed;
        if slowest > self.floor {
            self.guess = slowest;
        }
        if gap > self.target + self.target * NEAR || slowest <= self.floor && gap > self.target {
            return divide(gap, self.target) * INFEASIBLE;
        }
        let apart = before.rolled.gap - gap;
        if before.rolled.gap > Q16::ZERO && apart.abs() > self.target * WITHIN {
            self.per_gap = divide(self.cost(&before) - cost, apart).min(Q16::ZERO);
        }
        // Under its target at the window's speed, this window gives no more.
        let capped = slowest >= window.min(self.ceiling) && gap < self.target;
        cost + if capped { Q16::ZERO } else { (self.target - gap) * self.per_gap }
    }

    /// The course with this window and release whose gap is the target or a little less.
    async fn solve(&mut self, window: MillimetresPerSecond, release: Millimetres) -> Course {
        let [course, before] = self.approach_target(window, release, Q16::ZERO).await;
        if self.fits(&course.rolled) || !self.fits(&before.rolled) { course } else { before }
    }

    /// The last two courses on the way to the target: regula falsi. Ends where the gap is less than
    /// the target by at most [`WITHIN`], or more by at most `over`, both as parts.
    async fn approach_target(
        &mut self,
        window: MillimetresPerSecond,
        release: Millimetres,
        over: Ratio,
    ) -> [Course; 2] {
        let most = window.min(self.ceiling);
        let (mut low, mut high) = (self.floor, most);
        let (mut under, mut above): (Option<Course>, Option<Course>) = (None, None);
        let mut speed = between(self.guess, low, high);
        let aim = self.target + self.target * (over - WITHIN).half();
        let mut last = [Course::default(); 2];
        for _ in 0..SOLVES {
            let course = self.roll(window, release, speed).await;
            last = [course, last[0]];
            let gap = course.rolled.gap;
            let (least, greatest) =
                (self.target - self.target * (over + WITHIN), self.target + self.target * over);
            if self.fits(&course.rolled) {
                (low, under) = (speed, Some(course));
            } else {
                (high, above) = (speed, Some(course));
            }
            let reached = least <= gap && gap <= greatest || high <= self.floor || low >= most;
            if reached || self.strides == 0 && over > Q16::ZERO {
                return last;
            }
            let next = if last[1].rolled.gap > Q16::ZERO && last[1].rolled.gap != gap {
                let before = last[1].approach.slowest_speed;
                speed + (aim - gap) * divide(speed - before, gap - last[1].rolled.gap)
            } else {
                speed + (aim - gap) * FIRST_SLOPE
            };
            let edge = (high - low) * q16(150_000);
            // To an end of the range if nothing between is known.
            let low_end = if under.is_some() { low + edge } else { low };
            let high_end = if above.is_some() { high - edge } else { high };
            speed = between(next, low_end, high_end);
        }
        match under {
            Some(course) if !self.fits(&last[0].rolled) => [course, last[0]],
            _ => last,
        }
    }

    /// The course, or a slower one if the margin that it saves is worth its time. Where none keeps the
    /// gap, a search is no slower than the safe speed, whose gap is the reference.
    async fn gripping(
        &mut self,
        window: MillimetresPerSecond,
        release: Millimetres,
        course: Course,
    ) -> Course {
        let mut best = course;
        if !self.fits(&course.rolled) && self.searching {
            let safe = between(self.planner.safe_speed, self.floor, self.ceiling);
            best = self.roll(window.max(safe), release, safe).await;
        } else if self.price(&course.rolled) > Q16::ZERO {
            // A preload that still rises has more time where the wheel is slow before the corner, too.
            let (fastest, rising) = (course.approach.slowest_speed, course.rolled.rising);
            for part in [q16(750_000), q16(500_000), q16(250_000), Q16::ZERO] {
                let slowed = |speed: MillimetresPerSecond| self.floor + (speed - self.floor) * part;
                let (slowest, windows) = (slowed(fastest), [window, slowed(window)]);
                for &window in &windows[..1 + usize::from(rising)] {
                    let slower = self.roll(window, release, slowest).await;
                    if self.cost(&slower) < self.cost(&best) {
                        best = slower;
                    }
                }
            }
        }
        best
    }

    async fn roll(
        &mut self,
        window: MillimetresPerSecond,
        release: Millimetres,
        slowest: MillimetresPerSecond,
    ) -> Course {
        let approach = self.shape(window.max(slowest), release, slowest);
        let rolling = (&mut *self.state, &mut *self.pause);
        let rolled = self.planner.roll_out(rolling, &self.scene, &approach).await;
        self.strides = self.strides.saturating_sub(rolled.strides);
        Course { approach, rolled }
    }

    fn fits(&self, rolled: &RolledOut) -> bool {
        rolled.gap <= self.target && rolled.gap > Q16::ZERO
    }

    fn cost(&self, course: &Course) -> Seconds {
        let rolled = &course.rolled;
        let before = (self.scene.distance - rolled.from).max(Q16::ZERO);
        // A wheel that searches is as slow as at a corner.
        let slowest = course.approach.slowest_speed;
        let speed = if self.searching { slowest } else { self.scene.cruise };
        divide(before, speed) + rolled.takes + rolled.regains + self.price(rolled)
    }

    /// Time that the margin of friction is worth which this lacks, s.
    fn price(&self, rolled: &RolledOut) -> Seconds {
        self.planner.price(rolled.utilisation, self.friction, self.usable)
    }

    /// The approach with this speed in the window, this much of release before the last possible
    /// one, and this slowest speed.
    fn shape(
        &self,
        window_speed: MillimetresPerSecond,
        release: Millimetres,
        slowest_speed: MillimetresPerSecond,
    ) -> Approach {
        let planner = self.planner;
        let (window, release_from) = if self.releases {
            let (travel, _) = planner.timing.build_up(slowest_speed);
            (planner.tolerance.half(), self.lift + travel + release)
        } else if planner.prescribed_speed.is_some() {
            // Only where lift-off shows.
            (planner.tolerance, Q16::MIN)
        } else {
            (planner.tolerance, self.lift)
        };
        let felt_at = planner.felt_at[self.scene.direction as usize];
        Approach {
            window_from: felt_at + window,
            window_speed,
            brake_from: felt_at,
            slowest_speed,
            release_from,
            lift: self.lift,
            ..Approach::default()
        }
    }
}
