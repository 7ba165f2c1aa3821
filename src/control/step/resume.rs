//! Going on after a restart: from the record of the run before, or from what the arm tells
//! of a corner under the wheel.

use super::state::OpenCrossing;
use super::{Controller, Pass, State};
use crate::log::Event;
use crate::supervise::{Direction, Limit};
use crate::units::{Millimetres, Q16, Ratio, q16};

/// Most deviation of the wheel's height from what a record has it at, steps: what a sleeve
/// and the arm's zero are off, with a tread that is pressed more than it was.
const HEIGHT_WITHIN: Ratio = q16(200_000);
/// Off a wall's height by less than this, the wheel stands on it, mm: the tolerances of
/// sleeve and arm.
const ON_WALL: Millimetres = q16(250_000);
/// Off a wall's height by more than this, without a record, it stands on a corner, mm.
const ON_CORNER: Millimetres = q16(500_000);
/// How far off a record may be, mm: the coasting and what the odometry had gathered.
const SURE_WITHIN: Millimetres = q16(500_000);
/// The same after a drive went on that nobody watched, mm: half of what it may have gone.
pub(super) const UNSURE_WITHIN: Millimetres = q16(2_000_000);
/// Nearer to the edge than this, the wheel stands on top of it, mm.
const AT_EDGE: Millimetres = q16(300_000);
/// From here on to its edge a wheel on a corner stands within [`ON_WALL`] of the next wall,
/// mm: `sqrt(2 R h)` with R of 25 mm is 3.5 mm.
const ON_TOP: Millimetres = q16(4_000_000);
/// Way from the first contact over which a corner carries so little that a wheel on its way
/// back is off it at once, mm.
const RUN_IN: Millimetres = q16(2_000_000);

/// What is under the wheel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ground {
    /// The wall of this level.
    Wall(u8),
    /// The corner of this step, from 1.
    Corner(u8),
}

impl Controller {
    /// Takes the place that a record has, if the arm does not contradict it, or the one that
    /// a corner under the wheel tells; whether there was one.
    pub(super) fn go_on_from(&self, state: &mut State, pass: &mut Pass<'_>) -> bool {
        // With what the wheel has been moved since the start.
        let stands = state.odometry.position(pass.sensed.travel);
        let position = match state.kept.take() {
            Some(place) if self.may_stand_at(pass, stands, within(place.sure)) => {
                // A wheel that may have gone on looks for the next step as one without a
                // record does, and can do without it.
                (state.searching, state.unsure) = (!place.sure, !place.sure);
                stands
            }
            _ => {
                let Ground::Corner(step) = self.ground(pass, ON_CORNER) else { return false };
                let Some(face) = self.step_position(step) else { return false };
                (state.searching, state.unsure) = (false, false);
                face - self.to_face(pass, step)
            }
        };
        state.odometry.set(pass.sensed.travel, position);
        pass.position = position;
        state.level = pass.sensed.level;
        state.located = true;
        state.resumed = true;
        true
    }

    /// Before the first run after that: on a corner the crossing goes on, or is taken back;
    /// else everything starts on the wall. A run that no step ahead can confirm goes by the
    /// record, and says so.
    pub(super) fn resume(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction) {
        let steps = self.steps.len() as u8;
        let seen = self.seen(state, pass);
        let known = if state.searching { None } else { self.corner_at(pass.position, direction) };
        let confirmed;
        match known.unwrap_or_else(|| self.ground(pass, ON_WALL)) {
            Ground::Corner(step) => {
                // The drive has been off: nothing jumps if the corner's force is there at once,
                // and without it the wheel would roll off before the speed loop has found it.
                state.feel_at_once();
                let from = match direction {
                    Direction::Deploy => step - 1,
                    Direction::Retract => step,
                };
                state.level = from;
                state.next_step = step;
                state.crossing = Some(OpenCrossing {
                    turned: true,
                    resumed: true,
                    ..OpenCrossing::begin(step, direction, false, pass.now)
                });
                self.watch.begin_between(&mut state.watch, direction, from, &seen);
                let further = match direction {
                    Direction::Deploy => step < steps,
                    Direction::Retract => step > 1,
                };
                confirmed = further;
            }
            Ground::Wall(level) => {
                state.level = level;
                state.next_step = match direction {
                    Direction::Deploy if level < steps => level + 1,
                    Direction::Deploy => 0,
                    Direction::Retract => level,
                };
                state.crossing = None;
                self.begin_on_wall(state, pass, direction);
                confirmed = state.next_step > 0;
            }
        }
        if state.searching && !confirmed {
            state.searching = false;
            pass.log(Event::Limit(Limit::PositionUnconfirmed));
        }
    }

    /// Whether a wheel within so much of this position can stand as high as it does.
    fn may_stand_at(&self, pass: &Pass<'_>, position: Millimetres, within: Millimetres) -> bool {
        let within = within + self.schedule.tolerance();
        let touch = self.rise.first_contact(Direction::Deploy);
        let behind = |at: Millimetres| {
            Ratio::from_num(self.steps.iter().filter(|face| **face <= at).count() as u8)
        };
        let (least, most) = (behind(position - within), behind(position + within + touch));
        let up = pass.sensed.steps_up;
        up >= least - HEIGHT_WITHIN && up <= most + HEIGHT_WITHIN
    }

    /// The corner on which a wheel at this position stands. One that is on its way out stands
    /// on it as soon as it may feel it: the wall can no longer be measured.
    fn corner_at(&self, position: Millimetres, direction: Direction) -> Option<Ground> {
        let felt = match direction {
            Direction::Deploy => self.felt_within(),
            Direction::Retract => self.rise.first_contact(Direction::Deploy) - RUN_IN,
        };
        let on = |face: &Millimetres| *face - position > AT_EDGE && *face - position < felt;
        let step = self.steps.iter().position(on)?;
        Some(Ground::Corner(step as u8 + 1))
    }

    /// Starts on the wall of the present level. A wheel that may feel the corner which it
    /// leaves on its way back has that wall measured when it is clear of it: what the corner
    /// adds to the depth of its tread would else be taken for the wall's height, and the wall
    /// behind for the next corner. As long as the place is in doubt it may be on a corner's
    /// end: within what the arm is off, that cannot be told from the wall.
    pub(super) fn begin_on_wall(&self, state: &mut State, pass: &Pass<'_>, direction: Direction) {
        if state.unsure {
            return self.begin_off(state, pass, direction, ON_TOP);
        }
        let left = match direction {
            Direction::Deploy => None,
            Direction::Retract => self.step_position(state.next_step.saturating_add(1)),
        };
        match left.filter(|face| *face - pass.position < self.felt_within()) {
            Some(face) => {
                state.leaving = Some(face - self.schedule.tolerance());
                self.watch.begin_on_corner(&mut state.watch, direction, state.level);
            }
            None => {
                let seen = self.seen(state, pass);
                self.watch.begin(&mut state.watch, &seen);
            }
        }
    }

    /// Whether a wheel at this position may feel a corner: that of a step ahead of it, or of
    /// one behind it.
    pub(super) fn may_feel_corner(&self, position: Millimetres) -> bool {
        let behind = self.rise.first_contact(Direction::Retract) + self.schedule.tolerance();
        let ahead = self.felt_within();
        self.steps.iter().any(|face| {
            let distance = *face - position;
            distance < ahead && distance > -behind
        })
    }

    /// Nearer to a face than this, a wheel before it may feel its corner, mm.
    fn felt_within(&self) -> Millimetres {
        self.rise.first_contact(Direction::Deploy) + self.schedule.tolerance()
    }

    /// What is under the wheel by its height: a wall within so much of its own, or a corner.
    fn ground(&self, pass: &Pass<'_>, within: Millimetres) -> Ground {
        let steps = self.steps.len() as u8;
        let level = pass.sensed.level.min(steps);
        let height = self.watch.height_over(level, pass.sensed.radius.value, pass.compressed());
        if height.abs() <= within {
            Ground::Wall(level)
        } else if height > Q16::ZERO && level < steps {
            Ground::Corner(level + 1)
        } else if height < Q16::ZERO && level > 0 {
            Ground::Corner(level)
        } else {
            Ground::Wall(level)
        }
    }

    /// Axial distance from the wheel's centre to the face of the step that it stands on, mm.
    fn to_face(&self, pass: &Pass<'_>, step: u8) -> Millimetres {
        self.watch.to_edge(step - 1, pass.sensed.radius.value, pass.compressed())
    }
}

/// How far off a record may be, mm.
const fn within(sure: bool) -> Millimetres {
    if sure { SURE_WITHIN } else { UNSURE_WITHIN }
}

#[cfg(test)]
#[path = "resume_tests.rs"]
#[allow(clippy::float_arithmetic, reason = "quantities of a test")]
mod tests;
