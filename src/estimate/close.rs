//! Closes a crossing: its step corrects the position, and it is reported for review.

use super::crossing::Measured;
use super::landing::Landing;
use super::{EstimateState, Estimator, Findings, LiftPoint, OpenCrossing, Position, Slip};
use crate::fault::{Fault, Limit};
use crate::numeric::{divide, sqrt};
use crate::sense::SensedState;
use crate::units::{Direction, Millimetres, Q16, Ratio, q16};

/// Deviation of a step's height that is reported, mm: three of the angle's codes, and a sleeve's 0.05.
const HEIGHT_SEEN: Millimetres = q16(120_000);
/// How much of what a misread compression moves the face by is off, once it is known right over the edge:
/// at a lift-off it may be anything from none to twice of that part, evenly spread.
const MISREAD_SIGMA: Ratio = q16(577_000);

impl Estimator {
    /// Largest residual of a step that is where the table has it, mm: its tolerance, and what the
    /// position is off by in 99 of 100, which are independent.
    pub(super) fn tolerated(&self, state: &EstimateState) -> Millimetres {
        let off = state.odometry.spread(state.position) * q16(2_576_000);
        let tolerance = self.steps.tolerance;
        sqrt(tolerance * tolerance + off * off)
    }

    /// Whether a step is off by no more than is tolerated, or by as much as the one before it.
    pub(super) fn is_explained(
        &self,
        state: &EstimateState,
        step: u8,
        residual: Millimetres,
    ) -> bool {
        // A step that is met again does not speak for another one.
        let other = state.displaced.filter(|(other, _)| *other != step);
        let before = other.map_or(Q16::ZERO, |(_, off)| off);
        let tolerance = self.tolerated(state);
        residual.abs() <= tolerance || (residual - before).abs() <= tolerance
    }

    /// Corrects the odometry by a step's residual; what is left of it, mm.
    pub(super) fn correct(
        &self,
        state: &mut EstimateState,
        sensed: &SensedState,
        (step, residual): (u8, Millimetres),
        found: &mut Findings,
    ) -> Millimetres {
        if residual.abs() <= self.tolerated(state) {
            state.displaced = None;
            state.odometry.correct(state.position, residual)
        } else if self.is_explained(state, step, residual) {
            // Two in a row off by the same: the odometry is wrong.
            state.odometry.set_by_step(sensed.travel, state.position - residual);
            state.displaced = None;
            Q16::ZERO
        } else if state.displaced.is_some_and(|(other, _)| other != step) {
            // Two in a row off by different distances: the odometry has lost its scale, or the
            // table is wrong throughout.
            found.fault.get_or_insert(Fault::StepsDisagree);
            residual
        } else {
            // One alone: the step is displaced, or as likely the wheel.
            state.odometry.slip(Q16::ZERO, residual.half());
            state.displaced = Some((step, residual));
            report_displaced(state, residual, found);
            residual
        }
    }

    /// Right over an edge the wheel's fall below the upper wall is its compression.
    pub(super) fn read_over_edge(&self, state: &mut EstimateState, sensed: &SensedState) {
        let seen = self.watch_input(state, sensed);
        let rise = self.watch.rise(&state.watch, state.direction, &seen);
        let (step, past, fallen) = match state.direction {
            Direction::Deploy => {
                let Some(open) = state.crossing.as_ref() else { return };
                let past = open.lift.map(|lift| state.position - lift.face);
                (open.step, past, self.steps.height - rise)
            }
            Direction::Retract => {
                let past = self.distance(state).filter(|_| !state.known.is_searching());
                (state.next_step, past.map(|ahead| -ahead), rise)
            }
        };
        // Farther on the distance would count.
        let over = past.is_some_and(|past| past >= Q16::ZERO && past < Millimetres::ONE);
        if over && state.over.0 != step {
            state.over = (step, [fallen + seen.compression, seen.compression]);
        }
    }

    /// A step whose wall behind it was not measured.
    pub(super) fn as_table(&self, gap_as_table: Millimetres) -> Measured {
        let (height, shift) = (self.steps.height, Q16::ZERO);
        Measured { height, gap: gap_as_table, gap_as_table, shift, plausible: false }
    }

    /// Ends a crossing that is past its lift-off, at the end of travel.
    pub fn close_crossing(&self, state: &mut EstimateState, sensed: &SensedState) -> Findings {
        let mut found = Findings::default();
        if let Some(point) = state.crossing.as_ref().and_then(|open| open.lift) {
            self.close(state, sensed, &self.as_table(point.gap_as_table), &mut found);
        }
        found
    }

    /// The crossing is behind: its step corrects the position, and it is reported for review,
    /// unless only half of it was observed.
    pub(super) fn close(
        &self,
        state: &mut EstimateState,
        sensed: &SensedState,
        measured: &Measured,
        found: &mut Findings,
    ) {
        let higher = measured.height - self.steps.height;
        state.raised += higher * Q16::from_num(state.direction.sign());
        let Some(mut open) = state.crossing else { return };
        if let Some(mut point) = open.lift {
            if !open.resumed && !open.turned {
                self.relocate(state, sensed, measured, (&mut open, &mut point), found);
            }
            point.gap_as_table = measured.gap_as_table;
            open.lift = Some(point);
            // Closed at the end of travel, the wheel may still be on its corner.
            state.leaving = Some(point.face);
        }
        state.crossing = None;
        open.gap = measured.gap;
        open.height = measured.height;
        open.deepest = state.watch.deepest;
        found.slip = open.slipped(open.lift.map_or(state.position, |point| point.face));
        // Of a crossing that began in its middle the wall below was not measured.
        if higher.abs() > HEIGHT_SEEN && !open.resumed {
            found.limit(Limit::StepHeight);
        }
        if open.lift.is_some() && !open.turned {
            found.closed = Some((open, measured.plausible));
            found.replan = true;
        }
    }

    /// The step of a crossing corrects the position: by where the wheel left it, by what the wall behind
    /// shows of that, and by what of it is a sensor's or a slide's.
    fn relocate(
        &self,
        state: &mut EstimateState,
        sensed: &SensedState,
        measured: &Measured,
        (open, point): (&mut OpenCrossing, &mut LiftPoint),
        found: &mut Findings,
    ) {
        let higher = measured.height - self.steps.height;
        let retracts = state.direction == Direction::Retract;
        // How low the wall lies that takes a retracting wheel was not known at the lift.
        // A slide may follow what looked like the end of one.
        let known = open.landing.filter(|landing| landing.slid > Q16::ZERO);
        let more = |last: &Landing| known.is_none_or(|known| last.slid > known.slid);
        let landing = open.slide.landing().filter(more).inspect(|last| {
            let before = known.unwrap_or_default();
            open.slip.lost += last.slid - before.slid;
            open.landing = Some(*last);
            state.odometry.slip(last.lost - before.lost, Q16::ZERO);
            state.begin_tick(sensed.travel);
        });
        let landing = landing.or(known);
        let shift = landing.map_or(measured.shift, |landing| landing.face - point.face);
        // Retracting, it was over the edge where the table has that.
        let elsewhere = retracts && (point.residual + shift).abs() > self.steps.tolerance;
        let missed = missed(state, open.step, higher).filter(|_| !elsewhere);
        let misread = point.leverage * missed.unwrap_or(Ratio::ZERO);
        let shift = shift - misread;
        // Unless the height behind it and the compression on it were measured, the edge tells nothing.
        let climb = open.climb.filter(|climb| climb.depth > Q16::ZERO && measured.plausible);
        if let Some((climb, missed)) = climb.zip(missed) {
            let depth = climb.depth + climb.depth * missed;
            let ahead = self.watch.measure(depth, climb.height, measured.height).distance;
            let moved = climb.from_face + ahead - shift;
            // The ends of a contact are tilted: of a compression c they show less, by c / R of it.
            let tilted = self.watch.leverage(depth, ahead) * divide(depth, self.watch.radius);
            let misread = misread * MISREAD_SIGMA;
            let sigma = sqrt(tilted * tilted + misread * misread) + open.slip.sigma();
            state.odometry.climb(state.position, &climb.since, moved, sigma);
            state.begin_tick(sensed.travel);
        }
        if state.known.is_searching() && open.step > 0 {
            self.count_down(state, sensed, open);
            found.advanced = true;
        }
        let left = match self.steps.face(open.step) {
            Some(table) if state.known.is_searching() => {
                let left = table - point.face;
                let position = state.position + left - shift;
                state.odometry.set_by_step(sensed.travel, position);
                state.known = Position::Located;
                (point.residual, open.corrected) = (-left, true);
                left
            }
            None => shift,
            Some(_) if open.corrected => state.odometry.refine(shift),
            Some(_) => {
                let residual = point.residual + shift;
                self.correct(state, sensed, (open.step, residual), found) - point.residual
            }
        };
        if missed.is_some() {
            state.odometry.misread(state.direction, misread.abs() * MISREAD_SIGMA);
        }
        if let Some(landing) = landing.filter(|landing| landing.slid > Q16::ZERO) {
            state.odometry.slip(Q16::ZERO, landing.sigma());
            if higher > HEIGHT_SEEN {
                open.slip.lost -= open.slide.unwound(landing.slid);
            }
        }
        if higher.abs() > HEIGHT_SEEN {
            // The height moves the face, and is read on a wall that is not there.
            state.odometry.doubt(shift);
        }
        point.face += left;
        point.residual += left;
        state.begin_tick(sensed.travel);
    }

    /// A step found by a search on the way down is the one above the wall that the arm shows behind
    /// it: between walls, steps off their heights might have been taken for another level.
    pub(super) fn count_down(
        &self,
        state: &mut EstimateState,
        sensed: &SensedState,
        open: &mut OpenCrossing,
    ) {
        let most = i32::from(self.steps.count()) - 1;
        let level = sensed.steps_up.round().min(most).max(0) as u8;
        state.level = level;
        state.next_step = level;
        open.step = level + 1;
    }
}

/// Part of the compression on the edge of a step that the sensor misses, if the wheel was right over it. A
/// wall that lies `higher`, mm, than its table moves the fall of a climbing wheel, measured from below.
fn missed(state: &EstimateState, step: u8, higher: Millimetres) -> Option<Ratio> {
    let (over, [fall, compression]) = state.over;
    let higher = if state.direction == Direction::Retract { Q16::ZERO } else { higher };
    let fall = fall + higher;
    let part = divide(fall - compression, fall.max(compression).max(Q16::DELTA));
    (step > 0 && over == step).then_some(part)
}

impl OpenCrossing {
    /// Slip so far, of a wheel that is here, if it is more than one of its sigmas.
    pub(crate) fn slipped(&self, position: Millimetres) -> Option<Slip> {
        let amount = self.slip.lost + self.slip.beside;
        let sigma = self.landing.map_or(self.slip.sigma(), |landing| landing.sigma());
        (amount > sigma).then_some(Slip { position, amount, sigma })
    }
}

/// Reports a step outside its window, unless it has been reported already.
pub(super) fn report_displaced(state: &EstimateState, residual: Millimetres, found: &mut Findings) {
    let early = match state.direction {
        Direction::Deploy => residual < Q16::ZERO,
        Direction::Retract => residual > Q16::ZERO,
    };
    let reported = state.crossing.is_some_and(|open| open.reported);
    if !reported {
        found.limit(if early { Limit::StepEarly } else { Limit::StepLate });
    }
}
