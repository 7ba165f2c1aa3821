//! Following a crossing: what the watch notices becomes odometry, ledger, review.

use super::resume::UNSURE_WITHIN;
use super::state::{LiftPoint, OpenCrossing};
use super::{Controller, Pass, State};
use crate::control::schedule::{Course, Expectation};
use crate::estimate::crossing::{Contact, Lift, Seen, Sign};
use crate::log::{CrossingRecord, Event};
use crate::model::{Outcome, Review};
use crate::supervise::{Direction, Fault, Limit, Mode};
use crate::units::{Millimetres, Q16, Seconds, Tick, ticks_to_seconds};

impl Controller {
    /// Lets the watch look at the tick while the drive moves.
    pub(super) fn follow_contact(&self, state: &mut State, pass: &mut Pass<'_>) {
        let direction = match state.mode {
            Mode::Run(direction, _) | Mode::Stopping(direction) => direction,
            _ => return,
        };
        self.watch_slip(state, pass);
        let seen = self.seen(state, pass);
        let sign = self.watch.step(&mut state.watch, direction, &seen);
        if let Some(open) = state.crossing.as_mut() {
            open.peak_preload = open.peak_preload.max(pass.sensed.preload_filtered);
        }
        match sign {
            None => {}
            Some(Sign::Touched) => self.touched(state, pass, direction),
            Some(Sign::Released) => state.crossing = None,
            Some(Sign::Lifted(lift)) => self.lifted(state, pass, direction, lift),
            Some(Sign::Over) => self.over(state, direction),
            Some(Sign::Closed { gap, plausible, .. }) => self.closed(state, pass, gap, plausible),
            Some(Sign::Again { gap }) => {
                self.closed(state, pass, gap, false);
                self.touched(state, pass, direction);
            }
        }
    }

    /// One level on; the arm confirms the count at the end.
    fn over(&self, state: &mut State, direction: Direction) {
        let unknown = state.crossing.as_ref().is_some_and(|open| open.step == 0);
        state.lost_in_a_row = 0;
        match direction {
            Direction::Deploy => {
                state.level = state.level.saturating_add(1);
                state.extra = state.extra.saturating_add(u8::from(unknown));
            }
            Direction::Retract => {
                state.level = state.level.saturating_sub(1);
                state.extra = state.extra.saturating_sub(u8::from(unknown));
            }
        }
    }

    fn touched(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction) {
        let course = self.course(state, pass, direction);
        let expectation = self.schedule.expectation(&self.rise, &course);
        let searching = state.searching && state.next_step > 0;
        let belongs = searching || self.schedule.belongs(&self.rise, &course);
        if searching {
            // Any step found now is the one that tells where the wheel is.
        } else if !belongs {
            pass.log(Event::Limit(Limit::StepExtra));
        } else if expectation == Expectation::Ahead {
            pass.log(Event::Limit(Limit::StepEarly));
        }
        let step = if belongs { state.next_step } else { 0 };
        let expected = belongs && !searching && expectation != Expectation::Ahead;
        state.crossing = Some(OpenCrossing {
            standing_since: state.standing_since,
            peak_preload: pass.sensed.preload_filtered,
            told: expectation == Expectation::Ahead,
            ..OpenCrossing::begin(step, direction, expected, pass.now)
        });
    }

    /// A wheel that turns on a corner far longer than a crossing takes does not get over.
    fn watch_slip(&self, state: &mut State, pass: &mut Pass<'_>) {
        let on_corner = matches!(state.watch.contact, Contact::Both | Contact::Corner);
        let Some(open) = state.crossing.as_mut().filter(|_| on_corner) else { return };
        let from = *open.from.get_or_insert(pass.sensed.travel);
        let way = pass.sensed.travel.saturating_sub(from).saturating_abs();
        if way > self.corner_way.widen() {
            self.give_up(state, pass, Fault::WheelSlips);
        }
    }

    fn lifted(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction, lift: Lift) {
        let Some(mut open) = state.crossing else { return };
        let table = self.step_position(open.step);
        let seen = pass.position + lift.distance;
        let face = if open.resumed { table.unwrap_or(seen) } else { seen };
        let residual = table.map_or(Q16::ZERO, |table| face - table);
        open.lift = Some(LiftPoint {
            at: pass.now,
            gap: lift.gap,
            speed: pass.sensed.speed.value.abs(),
            preload: pass.sensed.preload_filtered,
            tan_arm: pass.sensed.tan_arm,
            face,
            residual,
        });
        state.crossing = Some(open);
        if open.step > 0 {
            if !open.turned {
                self.correct(state, pass, direction, residual);
            }
            pass.position = state.odometry.position(pass.sensed.travel);
            self.advance(state, direction);
        }
        self.ask(state, pass);
    }

    /// Odometry by a step's residual.
    fn correct(
        &self,
        state: &mut State,
        pass: &mut Pass<'_>,
        direction: Direction,
        residual: Millimetres,
    ) {
        let tolerance = self.schedule.tolerance();
        let alike = |other: Millimetres| (residual - other).abs() <= tolerance;
        if state.searching {
            state.odometry.set(pass.sensed.travel, pass.position - residual);
            (state.searching, state.unsure) = (false, false);
        } else if residual.abs() <= tolerance {
            state.odometry.correct(residual);
            state.displaced = None;
        } else if state.displaced.is_some_and(alike) {
            // Two in a row off by the same: it is the odometry.
            state.odometry.set(pass.sensed.travel, pass.position - residual);
            state.displaced = None;
        } else if state.displaced.is_some() {
            // By another way than the one before: the odometry has lost its measure, or the
            // table is wrong throughout.
            self.give_up(state, pass, Fault::StepsDisagree);
        } else {
            // One alone: it is the step that is displaced.
            state.displaced = Some(residual);
            self.report_displaced(state, pass, direction, residual);
        }
    }

    /// A step outside its window, unless it has been reported already.
    fn report_displaced(
        &self,
        state: &State,
        pass: &mut Pass<'_>,
        direction: Direction,
        residual: Millimetres,
    ) {
        let early = match direction {
            Direction::Deploy => residual < Q16::ZERO,
            Direction::Retract => residual > Q16::ZERO,
        };
        let told = state.crossing.is_some_and(|open| open.told) || state.late;
        if !told {
            pass.log(Event::Limit(if early { Limit::StepEarly } else { Limit::StepLate }));
        }
    }

    /// The crossing is behind: hands it to the model for review.
    pub(super) fn closed(
        &self,
        state: &mut State,
        pass: &mut Pass<'_>,
        gap: Millimetres,
        sure: bool,
    ) {
        let Some(mut open) = state.crossing.take() else { return };
        open.gap = gap;
        open.deepest = state.watch.deepest;
        // Half a crossing has no line of its own.
        let Some(point) = open.lift.filter(|_| !open.turned) else { return };
        state.line = Some(open);
        state.review = Some(Review {
            direction: open.direction,
            speed: point.speed,
            preload: point.preload,
            tan_arm: point.tan_arm,
            gap,
            trusted: open.expected && sure,
        });
        self.ask(state, pass);
    }

    /// Completes the ledger line with the model's review.
    pub(super) fn close_line(&self, state: &mut State, pass: &mut Pass<'_>, outcome: &Outcome) {
        state.review = None;
        let Some(open) = state.line.take() else { return };
        let Some(point) = open.lift else { return };
        pass.log(Event::Crossing(CrossingRecord {
            index: open.step,
            direction: open.direction,
            position: point.face,
            residual: point.residual,
            speed: point.speed,
            preload: point.preload,
            peak_preload: open.peak_preload,
            compression: open.deepest,
            gap_predicted: outcome.gap_predicted,
            gap_measured: open.gap,
            lead_time: lead_time(&open, point.at),
            slip_margin: outcome.slip_margin,
            stiffness_scale: outcome.scale,
        }));
    }

    /// Late and missing steps.
    pub(super) fn watch_expectation(
        &self,
        state: &mut State,
        pass: &mut Pass<'_>,
        course: &Course,
    ) {
        if state.watch.contact != Contact::Wall || state.searching {
            return;
        }
        match self.schedule.expectation(&self.rise, course) {
            Expectation::Ahead | Expectation::Due => {}
            Expectation::Late => {
                if !state.late {
                    state.late = true;
                    pass.log(Event::Limit(Limit::StepLate));
                }
            }
            Expectation::Missing => {
                pass.log(Event::Limit(Limit::StepMissing));
                state.lost_in_a_row = state.lost_in_a_row.saturating_add(1);
                state.given_up = match course.direction {
                    Direction::Deploy => state.given_up.saturating_add(1),
                    Direction::Retract => state.given_up.saturating_sub(1),
                };
                self.advance(state, course.direction);
                self.ask(state, pass);
                if state.lost_in_a_row > 1 {
                    self.give_up(state, pass, Fault::StepsLost);
                }
            }
        }
    }

    /// What the crossing watch looks at.
    pub(super) fn seen(&self, state: &State, pass: &Pass<'_>) -> Seen {
        let course = self.course(state, pass, state.direction);
        let near =
            self.schedule.to_window(&self.rise, &course).is_some_and(|ahead| ahead <= Q16::ZERO);
        Seen {
            radius: pass.sensed.radius.value,
            compression: pass.sensed.compression_filtered,
            near,
            clear: self.clear_of(state, pass),
        }
    }

    /// Whether the wheel has left the corner of the last step behind.
    fn clear_of(&self, state: &State, pass: &Pass<'_>) -> bool {
        let followed =
            state.crossing.as_ref().and_then(|open| open.lift.as_ref()).map(|point| point.face);
        let Some(face) = followed.or(state.leaving) else { return true };
        let past = match state.direction {
            Direction::Deploy => pass.position - face,
            Direction::Retract => face - pass.position,
        };
        // The patch must be clear of the edge: on the upper wall behind the centre, on
        // the lower wall ahead of it.
        let other = match state.direction {
            Direction::Deploy => Direction::Retract,
            Direction::Retract => Direction::Deploy,
        };
        // By the table, that face is where a record in doubt has it.
        let doubt = if state.unsure && followed.is_some() { UNSURE_WITHIN } else { Q16::ZERO };
        past > self.rise.first_contact(other) + doubt
    }

    /// On to the next step.
    fn advance(&self, state: &mut State, direction: Direction) {
        let steps = self.steps.len() as u8;
        state.next_step = match direction {
            Direction::Deploy if state.next_step < steps => state.next_step + 1,
            Direction::Deploy => 0,
            Direction::Retract => state.next_step.saturating_sub(1),
        };
        state.ramping = false;
        state.braking = false;
        state.late = false;
        state.waited = false;
        state.standing_since = None;
    }
}

/// How long the preload stood before the corner was felt; negative by how long it
/// was still missing.
fn lead_time(open: &OpenCrossing, lifted_at: Tick) -> Seconds {
    match open.standing_since {
        Some(since) => ticks_to_seconds(open.touched_at.wrapping_sub(since)),
        None => -ticks_to_seconds(lifted_at.wrapping_sub(open.touched_at)),
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "quantities of a test")]
mod tests {
    use super::*;

    #[test]
    fn a_preload_that_came_too_late_has_a_negative_lead() {
        let touched = OpenCrossing::begin(1, Direction::Deploy, true, 5000);
        let lead = |standing_since: Option<Tick>| {
            lead_time(&OpenCrossing { standing_since, ..touched }, 5400).to_num::<f64>()
        };
        // It stood 0.25 s before the touch; or not yet when the wheel lifted, 0.4 s after it.
        assert!((lead(Some(4750)) - 0.25).abs() < 1e-4, "{}", lead(Some(4750)));
        assert!((lead(None) + 0.4).abs() < 1e-4, "{}", lead(None));
    }

    use super::super::state::LiftPoint;
    use super::super::tests::{at, sensed};
    use crate::supervise::{Leg, Mode};
    use crate::units::q16;

    #[test]
    fn the_second_step_missed_in_a_row_is_one_too_many() {
        for (direction, from) in [(Direction::Deploy, 1), (Direction::Retract, 3)] {
            let mut state = State::default();
            state.mode = Mode::Run(direction, Leg::Approach);
            (state.direction, state.next_step, state.given_up) = (direction, from, 0);
            // Past every step of the prototype, which stand at 18, 40 and 62 mm.
            let position = if direction == Direction::Deploy { 79.0 } else { 1.0 };
            at(&sensed(0, 0.0, 0.3), position, |controller, pass| {
                for missed in 1..=2 {
                    assert_eq!(state.mode, Mode::Run(direction, Leg::Approach));
                    let course = controller.course(&state, pass, direction);
                    controller.watch_expectation(&mut state, pass, &course);
                    assert_eq!(state.lost_in_a_row, missed);
                    let missing = Event::Limit(Limit::StepMissing);
                    let told = pass.output.events.iter().filter(|e| e.event == missing).count();
                    assert_eq!(told, usize::from(missed));
                }
            });
            assert_eq!(state.mode, Mode::FaultHold(Fault::StepsLost));
            assert_eq!(state.next_step, 3 - u8::from(direction == Direction::Retract) * 2);
        }
    }

    #[test]
    fn in_doubt_a_corner_is_left_behind_so_much_later() {
        let face = q16(18_000_000);
        for direction in Direction::ALL {
            for unsure in [false, true] {
                let mut state = State::default();
                (state.direction, state.unsure) = (direction, unsure);
                let (zero, now) = (Q16::ZERO, 0);
                let lift = Some(LiftPoint {
                    at: now,
                    gap: zero,
                    speed: zero,
                    preload: zero,
                    tan_arm: zero,
                    face,
                    residual: zero,
                });
                let open = OpenCrossing::begin(1, direction, true, now);
                state.crossing = Some(OpenCrossing { lift, ..open });
                at(&sensed(1, 0.0, 0.3), 0.0, |controller, pass| {
                    let (sign, other) = match direction {
                        Direction::Deploy => (1, Direction::Retract),
                        Direction::Retract => (-1, Direction::Deploy),
                    };
                    let doubt = if unsure { UNSURE_WITHIN } else { zero };
                    let way = controller.rise.first_contact(other) + doubt;
                    let mut clear = |past: Millimetres| {
                        pass.position = face + past * Q16::from_num(sign);
                        controller.clear_of(&state, pass)
                    };
                    assert!(!clear(way) && clear(way + Q16::DELTA), "{direction:?} {unsure}");
                });
            }
        }
    }

    #[test]
    fn a_displaced_step_is_early_where_it_comes_before_its_place_on_the_way() {
        let told = |direction: Direction, residual: i32| {
            let state = State::default();
            at(&sensed(0, 0.0, 0.3), 18.0, |controller, pass| {
                let residual = Q16::from_num(residual);
                controller.report_displaced(&state, pass, direction, residual);
                pass.output.events.iter().map(|entry| entry.event).collect::<Vec<_>>()
            })
        };
        let (early, late) = (Event::Limit(Limit::StepEarly), Event::Limit(Limit::StepLate));
        assert_eq!(told(Direction::Deploy, -2), [early]);
        assert_eq!(told(Direction::Deploy, 2), [late]);
        assert_eq!(told(Direction::Retract, 2), [early]);
        assert_eq!(told(Direction::Retract, -2), [late]);
    }
}
