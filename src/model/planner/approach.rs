//! How the wheel comes to a crossing, and how long that takes.

#![deny(clippy::float_arithmetic)]

use super::Planner;
use crate::model::plan::{Approach, PlanRequest};
use crate::model::reduced::Point;
use crate::numeric::{divide, sqrt};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Seconds, q16,
};

/// Travel before lift-off that the tread remembers, mm, beside what the lift-off comes earlier
/// at the speed of the window: the speed before it hardly counts. On retract the corner carries
/// alone all along, and its whole patch remembers.
const MEMORY: [Millimetres; 2] = [q16(100_000), q16(2_000_000)];

/// Stiffness scale up to which the tread is as known, and by how much earlier than the model
/// says, mm per scale, a stiffer one lifts off at the speed of the window.
pub const KNOWN_SCALE: Ratio = q16(1_150_000);
const EARLIER_PER_SCALE: Millimetres = q16(1_500_000);

/// Height that the centre lacks at lift-off, mm: what the tread still keeps of its compression.
const SHORT: Millimetres = q16(110_000);

/// Error of the place of a corner that is felt, with the travel until braking begins, mm.
const FELT_WITHIN: Millimetres = q16(150_000);

/// By how much earlier the wheel may lift off at the speed of the window, mm. With more, the tread
/// would still relax when it does.
const MOST_EARLIER: Millimetres = q16(600_000);

/// What the wheel lifts off earlier, over what the model of steady speeds says: the tread comes from
/// the window and has not relaxed yet. Chosen by the gaps of 1000 random rigs and 200 of preset fe.
const UNRELAXED: Ratio = q16(1_250_000);

/// Part of the predicted gap at which the wheel has surely lifted off.
const SURELY_LIFTED: Ratio = q16(750_000);

impl Planner {
    /// How the wheel comes to a crossing with this gap.
    pub(super) fn approach(
        &self,
        request: &PlanRequest,
        at: &Point,
        carried: Newtons,
        gap: Millimetres,
    ) -> Approach {
        let direction = at.direction;
        let lift = self.lift(direction, gap);
        let felt = self.felt_at[direction as usize];
        // Until the corner is felt nothing moves the pre-tightener.
        let fastest = self.cruise_speed.min(self.climb_speed);
        let speed_into = |distance, slowest: MillimetresPerSecond| {
            self.timing.fastest_into(distance, slowest, fastest).max(slowest)
        };
        let ready_from = lift + MEMORY[direction as usize];
        let window_speed = speed_into(felt - FELT_WITHIN - ready_from, at.speed);
        // The tread still has the stiffness of the window's speed, with which the wheel would
        // lift off earlier.
        let fast = self.model.gap(&Point { speed: window_speed, ..*at }, carried);
        let earlier = (self.lift(direction, fast) - lift).max(Q16::ZERO)
            + (request.learned.scale - KNOWN_SCALE).max(Q16::ZERO) * EARLIER_PER_SCALE;
        let slow_from = ready_from + earlier;
        // At the least speed nothing is left to correct a gap with: the wheel stays slow until it
        // has surely lifted off.
        let release_from = match direction {
            Direction::Deploy if at.speed <= self.least_speed => {
                self.lift(direction, gap * SURELY_LIFTED)
            }
            _ => lift,
        };
        let slow = Approach {
            window_from: felt + self.tolerance,
            window_speed: speed_into(felt - FELT_WITHIN - slow_from, at.speed),
            slow_from,
            slowest_speed: at.speed,
            ready_from,
            earlier_per_preload: Ratio::ZERO,
            release_from,
            release_time: Seconds::ZERO,
            lift,
        };
        let slowest_speed = at.speed * self.dip.part;
        let known = !request.learned.unknown && request.learned.scale <= KNOWN_SCALE;
        let known = known && self.prescribed_speed.is_none();
        if direction == Direction::Retract || !known || slowest_speed < self.least_speed {
            return slow;
        }
        // A tread that is as known: the wheel speeds up again before it lifts off. It may be
        // slowest as late as at lift-off, and half the tolerance is enough for the window.
        let dip = self.dip.distance(slowest_speed);
        let slow_from = lift + (earlier * UNRELAXED).max(dip);
        let later = if earlier > dip { dip * q16(750_000) } else { dip };
        let mut window_speed = speed_into(felt - slow_from + later, slowest_speed);
        if earlier > MOST_EARLIER {
            let part = divide(MOST_EARLIER, earlier);
            window_speed = slowest_speed + (window_speed - slowest_speed) * part;
        }
        Approach {
            window_from: felt + self.tolerance.half(),
            window_speed,
            slow_from,
            slowest_speed,
            release_from: lift + dip,
            release_time: self.dip.time,
            ..slow
        }
    }

    /// How much earlier the wheel lifts off per preload that it lacks, mm/N.
    pub(super) fn earlier_per_preload(
        &self,
        at: &Point,
        carried: Newtons,
        lift: Millimetres,
    ) -> Ratio {
        let less = carried * q16(100_000);
        let gap = self.model.gap(at, carried - less);
        let earlier = self.lift(at.direction, gap) - lift;
        divide(earlier.max(Q16::ZERO), less)
    }

    /// Distance along the run to the face at lift-off (retract: touch-down) with this gap, mm.
    pub(super) fn lift(&self, direction: Direction, gap: Millimetres) -> Millimetres {
        // The tread's memory leaves the wall before the centre is as high as the free wheel's.
        let height = match direction {
            Direction::Deploy => self.radius - SHORT,
            Direction::Retract => self.radius,
        };
        let reach = self.radius + gap;
        let lift = sqrt((reach - height) * (reach + height));
        match direction {
            Direction::Deploy => lift,
            Direction::Retract => -lift,
        }
    }

    /// Time until lift-off (retract: touch-down) from this distance to the face, s.
    pub(super) fn travels(&self, distance: Millimetres, to: &Approach) -> Seconds {
        let cruised = (distance - to.lift).max(Q16::ZERO);
        let end = to.release_from;
        let slow = |distance: Millimetres, speed| {
            let distance = distance.max(Q16::ZERO);
            divide(distance, speed) - divide(distance, self.cruise_speed)
        };
        divide(cruised, self.cruise_speed)
            + self.lost(to.window_speed, self.cruise_speed)
            + slow(to.window_from - to.slow_from, to.window_speed)
            + self.lost(to.slowest_speed, to.window_speed)
            + slow(to.slow_from - end, to.slowest_speed)
    }

    /// Time that a change between these speeds takes longer than its distance at cruise speed, s.
    pub(super) fn lost(&self, slow: MillimetresPerSecond, fast: MillimetresPerSecond) -> Seconds {
        let mean = (slow + fast).half();
        let share = divide(self.cruise_speed - mean, self.cruise_speed);
        self.timing.speed_change(fast - slow) * share.max(Q16::ZERO)
    }
}
