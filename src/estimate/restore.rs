//! The position after a restart: from the record of the run before, or from what the arm
//! shows of a corner under the wheel.

use super::{EstimateState, Estimator, Findings, OpenCrossing, Place, Position};
use crate::fault::Limit;
use crate::sense::SensedState;
use crate::units::{Direction, Millimetres, Q16, Ratio, Tick, q16};

/// Largest deviation of the wheel's height from that of a record, steps: the tolerances of
/// sleeve and arm, with a tread that is compressed more than before.
const HEIGHT_WITHIN: Ratio = q16(200_000);
/// Off a wall's height by less than this, the wheel is on it, mm: the tolerances of sleeve
/// and arm.
const ON_WALL: Millimetres = q16(250_000);
/// Off a wall's height by more than this, without a record, it is on a corner, mm.
const ON_CORNER: Millimetres = q16(500_000);
/// Error of a record, mm: coasting and the odometry's error.
const SURE_WITHIN: Millimetres = q16(500_000);
/// Error of a record after a drive ran unobserved, mm: half of what it may have gone.
const UNSURE_WITHIN: Millimetres = q16(2_000_000);
/// Nearer to the edge than this, the wheel is on top of it, mm.
const AT_EDGE: Millimetres = q16(300_000);
/// Travel from the first contact over which a corner carries so little that a retracting
/// wheel leaves it at once, mm.
const RUN_IN: Millimetres = q16(2_000_000);

/// What is under the wheel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ground {
    /// The wall of this level.
    Wall(u8),
    /// The corner of this step, from 1.
    Corner(u8),
}

impl Estimator {
    /// Gives the odometry its origin. Only the stow end, found unloaded, is certain. Elsewhere
    /// a record or a corner under the wheel gives the position; else the arm gives the level,
    /// the position on it is assumed, and the next step is searched for.
    pub fn locate(&self, state: &mut EstimateState, sensed: &SensedState, stowed: bool) {
        if stowed {
            state.set_position(sensed.travel, Millimetres::ZERO);
            state.known = Position::Located;
            state.crossing = None;
            (state.level, state.missed, state.extra) = (0, 0, 0);
        } else if !state.known.is_located() && !self.restore(state, sensed) {
            state.level = sensed.level;
            state.set_position(sensed.travel, self.steps.middle_of(state.level));
            state.known = Position::Searching;
        }
    }

    /// Takes the position of a record, if the arm does not contradict it, or that of a corner
    /// under the wheel; whether there was one.
    fn restore(&self, state: &mut EstimateState, sensed: &SensedState) -> bool {
        // With what the wheel has been moved since the start.
        let recorded = state.odometry.position(sensed.travel);
        let (position, sure) = match state.known {
            Position::Recorded(Place { sure, .. })
                if self.may_be_at(sensed, recorded, error_of(sure)) =>
            {
                (recorded, sure)
            }
            _ => {
                let Ground::Corner(step) = self.ground(sensed, ON_CORNER) else { return false };
                let Some(face) = self.steps.face(step) else { return false };
                let (radius, compression) = (sensed.radius.value, sensed.compression_filtered);
                (face - self.watch.to_edge(step - 1, radius, compression), true)
            }
        };
        state.set_position(sensed.travel, position);
        state.level = sensed.level;
        state.known = Position::Restored { sure };
        true
    }

    /// Before the first run after a restart: on a corner the crossing goes on, or is taken
    /// back; else everything starts on the wall. A run in which no step can confirm the
    /// position goes by the record, and reports it. Whether the wheel is on a corner.
    pub(super) fn resume(
        &self,
        state: &mut EstimateState,
        sensed: &SensedState,
        now: Tick,
        found: &mut Findings,
    ) -> bool {
        let direction = state.direction;
        let seen = self.watch_input(state, sensed);
        let searching = state.known.is_searching();
        let known = if searching { None } else { self.corner_at(state.position, direction) };
        let ground = known.unwrap_or_else(|| self.ground(sensed, ON_WALL));
        let confirmed = match ground {
            Ground::Corner(step) => {
                state.level = match direction {
                    Direction::Deploy => step - 1,
                    Direction::Retract => step,
                };
                state.next_step = step;
                state.crossing = Some(OpenCrossing {
                    step,
                    direction,
                    turned: true,
                    resumed: true,
                    touched_at: now,
                    ..OpenCrossing::default()
                });
                self.watch.begin_between(&mut state.watch, direction, state.level, &seen);
                self.steps.after(step, direction) > 0
            }
            Ground::Wall(level) => {
                state.level = level;
                state.next_step = self.steps.ahead_of_level(level, direction);
                state.crossing = None;
                self.begin_on_wall(state, sensed);
                state.next_step > 0
            }
        };
        if searching && !confirmed {
            state.known.stop_searching();
            found.limit(Limit::PositionUnconfirmed);
        }
        matches!(ground, Ground::Corner(_))
    }

    /// Whether a wheel within so much of this position can be as high as it is.
    fn may_be_at(&self, sensed: &SensedState, position: Millimetres, within: Millimetres) -> bool {
        let within = within + self.steps.tolerance;
        let touch = self.corner().first_contact(Direction::Deploy);
        let behind = |at: Millimetres| Ratio::from_num(self.steps.behind(at));
        let (least, most) = (behind(position - within), behind(position + within + touch));
        let up = sensed.steps_up;
        up >= least - HEIGHT_WITHIN && up <= most + HEIGHT_WITHIN
    }

    /// The corner under a wheel at this position. A deploying wheel counts as on it as soon as
    /// it may touch it: the wall can no longer be measured.
    fn corner_at(&self, position: Millimetres, direction: Direction) -> Option<Ground> {
        let within = match direction {
            Direction::Deploy => self.steps.touches_within(),
            Direction::Retract => self.corner().first_contact(Direction::Deploy) - RUN_IN,
        };
        self.steps.between(position, AT_EDGE, within).map(Ground::Corner)
    }

    /// Starts on the wall of the present level. A retracting wheel that may still touch the
    /// corner behind it has the wall measured when it is clear: the corner adds compression,
    /// which would be taken for the wall's height. So has a wheel that is up, but not yet past the
    /// face. In doubt it may be on a corner's end, which the arm cannot tell from the wall.
    pub(super) fn begin_on_wall(&self, state: &mut EstimateState, sensed: &SensedState) {
        if state.known.is_unsure() {
            return self.begin_off(state);
        }
        let tolerance = self.steps.tolerance;
        let behind = |step| self.steps.face(step).map(|face| face - state.position);
        let left = match state.direction {
            Direction::Deploy => {
                let up = state.next_step.checked_sub(1).unwrap_or(self.steps.count());
                behind(up).map(|ahead| ahead + tolerance).filter(|ahead| *ahead > Q16::ZERO)
            }
            Direction::Retract => behind(state.next_step.saturating_add(1))
                .filter(|ahead| *ahead < self.steps.touches_within())
                .map(|ahead| ahead - tolerance),
        };
        match left {
            Some(ahead) => {
                state.leaving = Some(state.position + ahead);
                self.watch.begin_on_corner(&mut state.watch, state.direction, state.level);
            }
            None => {
                let seen = self.watch_input(state, sensed);
                self.watch.begin(&mut state.watch, &seen);
            }
        }
    }

    /// Starts towards the wall of the present level, perhaps off a corner.
    pub(super) fn begin_off(&self, state: &mut EstimateState) {
        state.leaving = None;
        self.watch.begin_on_corner(&mut state.watch, state.direction, state.level);
    }

    /// What is under the wheel by its height: a wall within so much of its own, or a corner.
    fn ground(&self, sensed: &SensedState, within: Millimetres) -> Ground {
        let steps = self.steps.count();
        let level = sensed.level.min(steps);
        let (radius, compression) = (sensed.radius.value, sensed.compression_filtered);
        let height = self.watch.height_over(level, radius, compression);
        // A wall may lie off its height, but only an edge presses the tread in so far.
        let edge = self.tread.may_rest_on_edge(sensed.preload_filtered, compression);
        if height.abs() <= within || !edge {
            Ground::Wall(level)
        } else if height > Q16::ZERO && level < steps {
            Ground::Corner(level + 1)
        } else if height < Q16::ZERO && level > 0 {
            Ground::Corner(level)
        } else {
            Ground::Wall(level)
        }
    }
}

/// Error of a record, mm.
const fn error_of(sure: bool) -> Millimetres {
    if sure { SURE_WITHIN } else { UNSURE_WITHIN }
}

#[cfg(test)]
#[path = "restore_tests.rs"]
pub(super) mod tests;
