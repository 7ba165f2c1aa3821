//! Follows a crossing: what the watch detects becomes odometry, level and review.

use super::crossing::{Contact, CrossingEvent, Lift, WatchInput};
use super::landing::OnEdge;
use super::odometry::Rolling;
use super::state::Climb;
use super::tread::{Rolls, Shown};
use super::wind_up::Pulled;
use super::{EstimateState, Estimator, Expectation, Findings, LiftPoint, OpenCrossing, Position};
use crate::fault::{Fault, Limit};
use crate::model::LimitedBy;
use crate::sense::{FILTER_LAG, SensedState};
use crate::units::{Direction, Millimetres, Newtons, Q16, Ratio, Tick, q16};

/// Ticks for which a wheel may slip under the most preload that there is: five times those in which
/// the published tread relaxes.
const HOPELESS_TICKS: u32 = 500;

/// What the estimator is given in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Follow<'a> {
    /// Time.
    pub now: Tick,
    /// Sensors.
    pub sensed: &'a SensedState,
    /// Radial force on the wheel, N.
    pub pressed: Newtons,
    /// Axial load on it, N, inwards.
    pub load: Newtons,
    /// Duty of the drive in the last tick.
    pub duty: Ratio,
    /// The preload is as high as it may be.
    pub most_pressed: bool,
    /// Since when the crossing preload has been reached.
    pub standing_since: Option<Tick>,
    /// What keeps the crossing ahead from being faster, by its plan.
    pub limited_by: Option<LimitedBy>,
}

/// Part of the load by which a compression falls that may be read low.
const MISSED: Ratio = q16(666_667);
/// Age of a reading of the arm from which it counts as silent: at a reading each tick, two missing.
const SILENT_TICKS: u32 = 2;

impl Estimator {
    /// Load on a tread at rest that is compressed by so much, N.
    pub fn means(&self, compression: Millimetres) -> Newtons {
        self.tread.means(compression)
    }

    /// Begins a tick: position, and preload as the tread has it.
    pub fn begin_tick(&self, state: &mut EstimateState, sensed: &SensedState) {
        state.begin_tick(sensed.travel);
        self.memory.step(&mut state.remembered, sensed.preload_filtered);
    }

    /// One tick in which the drive moves.
    pub fn follow(&self, state: &mut EstimateState, tick: &Follow<'_>) -> Findings {
        let mut found = Findings::default();
        let direction = state.direction;
        state.history.step(self.stride, direction, state.turns(tick.sensed).0, tick.pressed);
        self.watch_slip(state, tick, &mut found);
        let seen = self.watch_input(state, tick.sensed);
        let event = self.watch.step(&mut state.watch, direction, &seen);
        let on_corner = state.on_corner();
        let rolling = Rolling {
            radius: tick.sensed.radius.value,
            lag: self.worn + self.rolling_lag * tick.sensed.compression_filtered,
            on_corner,
        };
        state.odometry.roll(tick.sensed.travel, &rolling, event.is_some());
        state.begin_tick(tick.sensed.travel);
        self.sink(state, tick);
        if let Some(open) = state.crossing.as_mut() {
            open.peak_preload = open.peak_preload.max(tick.sensed.preload_filtered);
        }
        match event {
            None => {}
            Some(CrossingEvent::Touched) => self.touched(state, tick, &mut found),
            Some(CrossingEvent::Released) => state.crossing = None,
            Some(CrossingEvent::Lifted(lift)) => self.lifted(state, tick, lift, &mut found),
            Some(CrossingEvent::Passed) => state.pass(),
            Some(CrossingEvent::GapClosed(measured)) => {
                self.close(state, tick.sensed, &measured, &mut found);
            }
            Some(CrossingEvent::Retouched { gap_as_table }) => {
                self.close(state, tick.sensed, &self.as_table(gap_as_table), &mut found);
                self.touched(state, tick, &mut found);
            }
        }
        self.feel(state, tick.sensed);
        self.hold_to_corner(state, tick);
        self.read_over_edge(state, tick.sensed);
        if state.watch.contact == Contact::Wall || state.known.is_searching() {
            let (travel, speed) = state.turns(tick.sensed);
            let Follow { duty, pressed, sensed, .. } = *tick;
            let compression = sensed.compression_filtered;
            let rolls = Rolls { direction, travel, speed, duty, pressed, compression };
            let shown = self.tread.roll(&mut state.tread, &rolls);
            let unlike = |shown: &Shown| (shown.rolled - Ratio::ONE).abs();
            found.shown = shown.inspect(|shown| state.odometry.doubt_tread(unlike(shown)));
        }
        found
    }

    /// The tread gives way to what pulls at it, once a run has shown that; beside a wheel that stands
    /// the axle sinks.
    pub fn sink(&self, state: &mut EstimateState, tick: &Follow<'_>) {
        if state.wind_up.is_known() {
            let pulled = self.pulled(state, tick);
            let (wind_up, odometry) = (&mut state.wind_up, &mut state.odometry);
            self.pulls.step(wind_up, odometry, tick.sensed.travel, &pulled);
        }
    }

    /// What pulls at the tread, and where.
    fn pulled(&self, state: &EstimateState, tick: &Follow<'_>) -> Pulled {
        let seen = self.watch_input(state, tick.sensed);
        let on_corner = matches!(state.watch.contact, Contact::Both | Contact::Corner);
        let ahead = self.edge(state, &seen).map(|face| face - state.position);
        // Too far for an edge, on a step that is not as high as the table has it.
        let most = self.corner().first_contact(Direction::Deploy);
        let beyond = ahead.is_some_and(|ahead| ahead > most) && !on_corner;
        // A retracting wheel that leaves its edge is on the lower wall, wherever its table has that.
        let retracts = state.direction == Direction::Retract;
        let leaves = state.watch.contact == Contact::Leaving;
        let off = beyond || retracts && leaves;
        let ahead = ahead.filter(|_| !off).map_or(Q16::MIN, |ahead| ahead.min(most));
        let drops = on_corner && retracts;
        let over = leaves && ahead <= Q16::ZERO;
        let floor = if beyond || over {
            seen.compression
        } else {
            self.watch.floor(&state.watch, state.direction, &seen)
        };
        // Half of a patch hangs over an edge that is nearer.
        let reach = self.corner().first_contact(state.direction);
        let far = self.distance(state).is_none_or(|distance| distance > reach);
        Pulled {
            pressed: tick.pressed,
            load: tick.load,
            depth: seen.compression,
            ahead,
            floor,
            below: state.watch.contact != Contact::Wall && !over,
            lost: if drops { state.watch.eased * MISSED } else { Q16::ZERO },
            level: far && self.watch.is_level(&state.watch, state.direction, &seen),
        }
    }

    /// Face of the step whose edge may be under the wheel, mm.
    fn edge(&self, state: &EstimateState, seen: &WatchInput) -> Option<Millimetres> {
        if let Some(open) = &state.crossing {
            let face = open.lift.map(|point| point.face).or(open.felt);
            return face.or(self.steps.face(open.step));
        }
        if state.direction == Direction::Deploy {
            return state.leaving.filter(|face| *face <= state.position);
        }
        // A wheel that goes over an edge is on it before that shows.
        let over = -self.distance(state)?;
        let may = self.watch.may_be_over(&state.watch, seen, over.max(Q16::ZERO));
        may.then(|| state.position + over)
    }

    /// Where the step is, from the moment at which its corner carries.
    fn feel(&self, state: &mut EstimateState, sensed: &SensedState) {
        let seen = self.watch_input(state, sensed);
        let direction = state.direction;
        let ahead = self.watch.to_face(&state.watch, direction, &seen);
        let position = position_of_radius(state, sensed);
        let Some(open) = state.crossing.as_mut().filter(|open| open.felt.is_none()) else { return };
        let Some(ahead) = ahead else { return };
        open.felt_at = ahead;
        open.felt = Some(match direction {
            Direction::Deploy => position + ahead,
            Direction::Retract => position - ahead,
        });
    }

    /// Late and missing steps.
    pub fn watch_expectation(&self, state: &mut EstimateState) -> Findings {
        let mut found = Findings::default();
        if state.watch.contact != Contact::Wall || state.known.is_searching() {
            return found;
        }
        match self.steps.expectation(state.direction, self.distance(state)) {
            Expectation::Ahead | Expectation::Due => {}
            Expectation::Late => {
                if !state.late {
                    state.late = true;
                    found.limit(Limit::StepLate);
                }
            }
            Expectation::Missing => {
                found.limit(Limit::StepMissing);
                // Or is it there, and the wheel elsewhere?
                state.odometry.slip(Q16::ZERO, self.steps.tolerance);
                state.missed_in_a_row = state.missed_in_a_row.saturating_add(1);
                state.missed = match state.direction {
                    Direction::Deploy => state.missed.saturating_add(1),
                    Direction::Retract => state.missed.saturating_sub(1),
                };
                self.advance(state, &mut found);
                if state.missed_in_a_row > 1 {
                    found.fault = Some(Fault::StepsLost);
                }
            }
        }
        found
    }

    /// Distance along the run to the face of the step ahead, mm; none if no step is left.
    pub fn distance(&self, state: &EstimateState) -> Option<Millimetres> {
        self.steps.distance(state.next_step, state.direction, state.position)
    }

    /// Distance along the run to the face of the step ahead as its corner shows it, mm.
    pub fn felt(&self, state: &EstimateState) -> Option<Millimetres> {
        let open = state.crossing.as_ref().filter(|open| open.lift.is_none())?;
        let face = open.felt.filter(|_| open.step > 0 && open.step == state.next_step)?;
        Some(match state.direction {
            Direction::Deploy => face - state.position,
            Direction::Retract => state.position - face,
        })
    }

    /// A wheel at rest under preload: the baseline follows its wall. Whether compression and
    /// preload contradict each other there; `begin` starts the comparison again, of a wheel that has
    /// rested for these ticks, or for long.
    pub fn rest(
        &self,
        state: &mut EstimateState,
        sensed: &SensedState,
        arm_thrust: Newtons,
        begin: Option<Option<u32>>,
    ) -> bool {
        let seen = self.watch_input(state, sensed);
        self.watch.rest(&mut state.watch, &seen);
        let (preload, compression) = (sensed.preload_filtered, sensed.compression_filtered);
        // Where the wheel is not known it is on a wall by its compression.
        let on_edge = if state.known.is_searching() {
            self.tread.may_rest_on_edge(preload, compression)
        } else {
            state.on_corner()
        };
        if begin.is_some() || on_edge {
            let (travel, _) = state.turns(sensed);
            let rested = begin.unwrap_or(Some(0));
            self.tread.begin(&mut state.tread, (travel, rested), preload, compression);
            return false;
        }
        self.tread.rest(&mut state.tread, preload, arm_thrust, compression)
            && !self.steps.may_touch(state.position)
    }

    fn touched(&self, state: &mut EstimateState, tick: &Follow<'_>, found: &mut Findings) {
        // Behind a corner the effort is another one.
        state.tread.rises = false;
        let distance = self.distance(state);
        let expectation = self.steps.expectation(state.direction, distance);
        let searching = state.known.is_searching() && state.next_step > 0;
        let belongs = searching || self.steps.belongs(state.direction, distance);
        if searching {
            // Any step found now sets the position.
        } else if !belongs {
            found.limit(Limit::StepExtra);
        } else if expectation == Expectation::Ahead {
            found.limit(Limit::StepEarly);
        }
        state.crossing = Some(OpenCrossing {
            step: if belongs { state.next_step } else { 0 },
            direction: state.direction,
            expected: belongs && (searching || expectation != Expectation::Ahead),
            reported: expectation == Expectation::Ahead || state.late,
            touched_at: tick.now,
            standing_since: tick.standing_since,
            limited_by: tick.limited_by.filter(|_| belongs),
            peak_preload: tick.sensed.preload_filtered,
            ..OpenCrossing::default()
        });
    }

    /// A wheel that turns on a corner far longer than a crossing takes slips, as does one that
    /// goes on slipping under all the preload that there is.
    fn watch_slip(&self, state: &mut EstimateState, tick: &Follow<'_>, found: &mut Findings) {
        let on_corner = matches!(state.watch.contact, Contact::Both | Contact::Corner);
        let Some(open) = state.crossing.as_mut().filter(|_| on_corner) else { return };
        let from = *open.from.get_or_insert(tick.sensed.travel);
        let turned = tick.sensed.travel.saturating_sub(from).saturating_abs();
        let hopeless = tick.most_pressed && open.slip.goes_on();
        let since = *open.hopeless_since.get_or_insert(tick.now);
        if !hopeless {
            open.hopeless_since = None;
        }
        if turned > self.corner_travel.widen()
            || hopeless && tick.now.wrapping_sub(since) > HOPELESS_TICKS
        {
            found.fault = Some(Fault::WheelSlips);
            found.slip = open.slipped(state.position);
        }
    }

    /// Takes the place from the corner under a wheel that slips on it. Nearer to the edge than a
    /// quarter of the wheel's radius the height hardly shows the distance.
    fn hold_to_corner(&self, state: &mut EstimateState, tick: &Follow<'_>) {
        let sensed = tick.sensed;
        // An arm that is silent stands still beside a tread that turns, as under a slip.
        if sensed.radius.age(tick.now) > SILENT_TICKS {
            if let Some(open) = state.crossing.as_mut() {
                open.slip.begin_run();
            }
            return;
        }
        match (state.watch.contact, state.direction) {
            (Contact::Wall, _) | (Contact::Leaving, Direction::Deploy) => return,
            _ => {}
        }
        let seen = self.watch_input(state, sensed);
        let Some(ahead) = self.watch.to_face(&state.watch, state.direction, &seen) else { return };
        let position = position_of_radius(state, sensed);
        let rise = self.watch.rise(&state.watch, state.direction, &seen);
        let fall = match state.direction {
            Direction::Deploy => self.steps.height - rise,
            Direction::Retract => rise,
        } + seen.compression;
        let travel = sensed.travel.saturating_sub((sensed.speed.value * FILTER_LAG).widen());
        let gave = state.wind_up.gave();
        let at = OnEdge { travel, position, fall, depth: seen.compression, gave };
        let on_floor = state.watch.contact == Contact::Both;
        // Of a crossing that began in its middle the wall below was not measured.
        let Some(open) = state.crossing.as_mut().filter(|open| !open.turned) else { return };
        if ahead.abs() <= self.telling {
            let climbs = open.lift.filter(|_| state.direction == Direction::Deploy);
            if let Some(lift) = climbs.filter(|_| open.climb.is_none()) {
                let mut climb = Climb::default();
                if open.searched {
                    // The wheel may have begun on this corner, and lifted off elsewhere.
                    let moved = position + ahead - lift.face;
                    state.odometry.set_by_step(sensed.travel, state.position - moved);
                } else {
                    let height = self.watch.height(&state.watch, &seen);
                    let since = state.odometry.since(state.position);
                    let from_face = position - lift.face;
                    climb = Climb { from_face, depth: seen.compression, height, since };
                }
                open.climb = Some(climb);
                state.begin_tick(sensed.travel);
            }
            return;
        }
        let lost = match state.direction {
            Direction::Deploy => open.slip.step(self.watch.radius, &at, on_floor),
            Direction::Retract => {
                let Some(landing) = open.slide.step(self.watch.radius, &at) else { return };
                open.landing = Some(landing);
                open.slip.lost += landing.slid;
                landing.lost
            }
        };
        if lost > Q16::ZERO {
            // The face that corrects a retracting wheel was seen before its slide: what that adds
            // counts behind the step.
            let sigma = match state.direction {
                Direction::Deploy => open.slip.sigma_of(lost.min(open.slip.lost)),
                Direction::Retract => Q16::ZERO,
            };
            state.odometry.slip(lost, sigma);
            state.begin_tick(sensed.travel);
        }
    }

    fn lifted(
        &self,
        state: &mut EstimateState,
        tick: &Follow<'_>,
        lift: Lift,
        found: &mut Findings,
    ) {
        let Some(mut open) = state.crossing else { return };
        let sensed = tick.sensed;
        let table = self.steps.face(open.step);
        let seen = position_of_radius(state, sensed) + lift.distance;
        let retracts = state.direction == Direction::Retract;
        let face = if open.resumed { table.unwrap_or(seen) } else { seen };
        let mut residual = table.map_or(Q16::ZERO, |table| face - table);
        let corrects = open.step > 0 && !open.turned;
        let before = residual;
        if corrects && state.known.is_searching() && !retracts {
            state.odometry.set_by_step(sensed.travel, state.position - residual);
            state.known = Position::Located;
            (residual, open.corrected) = (Q16::ZERO, true);
            open.searched = true;
        } else if corrects && !retracts && self.is_explained(state, open.step, residual) {
            residual = self.correct(state, sensed, (open.step, residual), found);
            open.corrected = true;
        } else if corrects && !retracts {
            state.odometry.leave(state.position);
        }
        // Another one is judged when the step's height is known.
        state.begin_tick(sensed.travel);
        open.lift = Some(LiftPoint {
            at: tick.now,
            position: state.position,
            gap_as_table: lift.gap,
            history: *state.history.history(),
            distance: lift.distance,
            speed: state.history.history().speed(self.stride),
            held: sensed.speed.value,
            preload: sensed.preload_filtered,
            remembered: state.remembered_preload(),
            tan_arm: sensed.tan_arm,
            // As the odometry has it once this step has corrected it.
            face: face - (before - residual),
            residual,
            leverage: self.watch.leverage(lift.depth, lift.distance),
        });
        state.crossing = Some(open);
        if open.step > 0 {
            self.advance(state, found);
        }
        found.replan = true;
    }

    /// Input of the crossing watch.
    pub(super) fn watch_input(&self, state: &EstimateState, sensed: &SensedState) -> WatchInput {
        let to_window = self.steps.to_window(state.direction, self.distance(state));
        WatchInput {
            radius: sensed.radius.value,
            compression: sensed.compression_filtered,
            preload: sensed.preload_filtered,
            travel: sensed.travel,
            // A search does not know where its step is.
            near: to_window.is_some_and(|ahead| ahead <= Q16::ZERO) && !state.known.is_searching(),
            over: self.is_over(state),
            clear: self.clear_of(state, sensed),
            short: self.pulls.short(&state.wind_up),
        }
    }

    /// Whether a retracting wheel is further from the edge that it came over than an undeformed one
    /// could be with the edge still under it.
    fn is_over(&self, state: &EstimateState) -> bool {
        let felt = state.crossing.as_ref().and_then(|open| open.felt);
        state.direction == Direction::Retract
            && felt.is_some_and(|face| {
                face - state.position > self.corner().first_contact(Direction::Deploy)
            })
    }

    /// Whether the wheel has left the corner of the last step behind; none where a doubtful position
    /// cannot tell.
    fn clear_of(&self, state: &EstimateState, sensed: &SensedState) -> Option<bool> {
        let doubtful = state.known.is_unsure() || state.known.is_searching();
        if state.crossing.as_ref().map_or(doubtful, |open| open.resumed) {
            return None;
        }
        let landed = |open: &OpenCrossing| open.landing.map(|landing| landing.face);
        let lifted =
            |open: &OpenCrossing| open.lift.map(|point| landed(open).unwrap_or(point.face));
        let followed = state.crossing.as_ref().and_then(lifted);
        let Some(face) = followed.or(state.leaving) else { return Some(true) };
        let nominal = self.corner().first_contact(state.direction.opposite());
        let (past, reach) = match state.direction {
            Direction::Deploy => (state.position - face, nominal),
            // From a higher step the edge is met farther out.
            Direction::Retract => {
                let fallen = sensed.radius.value - sensed.compression_filtered;
                (face - state.position, nominal.max(self.watch.reach(&state.watch, fallen)))
            }
        };
        // The patch must be clear of the edge: on the upper wall behind the centre, on the
        // lower wall ahead of it.
        Some(past > reach)
    }

    /// On to the next step.
    fn advance(&self, state: &mut EstimateState, found: &mut Findings) {
        state.next_step = self.steps.after(state.next_step, state.direction);
        state.late = false;
        found.advanced = true;
        found.replan = true;
    }
}

/// Where the wheel was when its centre had the radius that the low-pass of the angle shows
/// now, mm.
fn position_of_radius(state: &EstimateState, sensed: &SensedState) -> Millimetres {
    state.position - sensed.speed.value * FILTER_LAG
}

#[cfg(test)]
#[path = "follow_tests.rs"]
mod tests;
