//! What the estimator remembers between ticks, and what it reports of one.

use super::crossing::{Contact, WatchState};
use super::landing::{Landing, Slide};
use super::odometry::Odometry;
use super::tread::{Shown, TreadState};
use super::wind_up::WindUp;
use super::{CornerSlip, Place, Position, PositionConfidence};
use crate::fault::{Fault, Limit};
use crate::model::LimitedBy;
use crate::model::history::{History, HistoryWriter};
use crate::numeric::LowPassState;
use crate::sense::{SensedState, Zeros};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Tick, Travel, q16,
};

/// Part of its load that an edge has surely lost to a wall: beyond the noise of the sensors.
const EASED: Ratio = q16(50_000);
/// Error of the place at which a lift-off is detected, mm: the steps of the angle code, and the
/// tolerance of the step's height on a wheel that creeps.
const LIFT_WITHIN: Millimetres = q16(300_000);

/// State of the estimator.
#[derive(Clone, Debug, Default)]
pub struct EstimateState {
    /// Axial position in this tick, mm from the stow end.
    pub position: Millimetres,
    pub(super) odometry: Odometry,
    pub(super) known: Position,
    pub(super) wind_up: WindUp,
    /// Crossing watch.
    pub watch: WatchState,
    pub(super) tread: TreadState,
    pub(super) history: HistoryWriter,
    /// Preload behind the memory of the tread, N.
    pub(super) remembered: LowPassState,
    /// Direction of the run.
    pub direction: Direction,
    /// Level by steps detected.
    pub level: u8,
    /// Step ahead, from 1; 0 if none is left.
    pub next_step: u8,
    /// The crossing under way or just behind.
    pub crossing: Option<OpenCrossing>,
    /// The step ahead is late and has been reported.
    pub(super) late: bool,
    /// Residual of the last step found, if it was beyond the tolerance, mm.
    pub(super) displaced: Option<(u8, Millimetres)>,
    /// Face of the step being left although its crossing is not followed, mm.
    pub(super) leaving: Option<Millimetres>,
    /// Steps of the table given up since the stow end.
    pub(super) missed: u8,
    /// Steps given up since the last one found.
    pub(super) missed_in_a_row: u8,
    /// Steps climbed that the table lacks, since the stow end.
    pub(super) extra: u8,
    /// Step that the wheel was right over, its fall below the upper wall there and its compression, mm.
    pub(super) over: (u8, [Millimetres; 2]),
    /// By how much the walls passed lie further in than by the table, mm.
    pub(super) raised: Millimetres,
}

/// A crossing under way.
#[derive(Clone, Copy, Debug, Default)]
pub struct OpenCrossing {
    /// Step of the table; 0 if the table lacks it.
    pub step: u8,
    /// Direction in which it began.
    pub direction: Direction,
    /// Detected inside its window, so that baseline and preload were ready.
    pub expected: bool,
    /// The wheel turned back on this corner: its first half was not observed.
    pub turned: bool,
    /// The wheel was on it when the board started: its face was not observed.
    pub resumed: bool,
    /// That it is not where the table has it has been reported.
    pub reported: bool,
    /// Its step has corrected the position.
    pub corrected: bool,
    /// It has found the position.
    pub searched: bool,
    /// What the edge showed while the wheel climbed.
    pub climb: Option<Climb>,
    /// When the corner was first detected.
    pub touched_at: Tick,
    /// Position of the face by the corner that carries, as soon as it shows, mm.
    pub felt: Option<Millimetres>,
    /// Distance to the face when it first showed, mm.
    pub felt_at: Millimetres,
    /// Slide of a retracting wheel before it lands, and its landing.
    pub slide: Slide,
    /// See `slide`.
    pub landing: Option<Landing>,
    /// Slip on it.
    pub slip: CornerSlip,
    /// Since when it slips under the most preload that there is.
    pub hopeless_since: Option<Tick>,
    /// Odometry at that time.
    pub from: Option<Travel>,
    /// Since when the crossing preload had been reached.
    pub standing_since: Option<Tick>,
    /// What kept it from being faster, by its plan.
    pub limited_by: Option<LimitedBy>,
    /// Largest preload so far, N.
    pub peak_preload: Newtons,
    /// Lift-off.
    pub lift: Option<LiftPoint>,
    /// Gap when closed, mm.
    pub gap: Millimetres,
    /// Height of the step when closed, mm.
    pub height: Millimetres,
    /// Largest compression when closed, mm.
    pub deepest: Millimetres,
}

/// The instant of lift-off.
#[derive(Clone, Copy, Debug, Default)]
pub struct LiftPoint {
    /// When.
    pub at: Tick,
    /// Position of the wheel, mm.
    pub position: Millimetres,
    /// Gap with the nominal step height, mm: of a wheel as deep in the corner.
    pub gap_as_table: Millimetres,
    /// How the wheel came here, and its distance to the face, mm.
    pub history: History,
    /// See `history`.
    pub distance: Millimetres,
    /// Wheel speed as the tread remembers it, mm/s.
    pub speed: MillimetresPerSecond,
    /// Wheel speed in that tick, mm/s.
    pub held: MillimetresPerSecond,
    /// Preload, N.
    pub preload: Newtons,
    /// Preload behind the memory of the tread, N.
    pub remembered: Newtons,
    /// Tangent of the arm angle.
    pub tan_arm: Ratio,
    /// Position of the face as found, mm.
    pub face: Millimetres,
    /// Found minus table, mm.
    pub residual: Millimetres,
    /// By how much it seems further out per part of the compression that the sensor misses, mm.
    pub leverage: Millimetres,
}

/// An edge under a climbing wheel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Climb {
    /// Position of the wheel from the edge as its lift-off showed that, mm.
    pub from_face: Millimetres,
    /// Its compression, and the height of its centre over the lower wall, mm.
    pub depth: Millimetres,
    /// See `depth`.
    pub height: Millimetres,
    /// What shifted the position since the lift-off.
    pub since: [Ratio; 4],
}

/// Slip of the wheel, as measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Slip {
    /// Where, mm.
    pub position: Millimetres,
    /// Travel of the tread that moved no axle, mm.
    pub amount: Millimetres,
    /// One sigma of it, mm.
    pub sigma: Millimetres,
}

/// What a stage of the estimate has found in a tick.
#[derive(Debug, Default)]
pub struct Findings {
    /// Limits to report, in order.
    pub limits: heapless::Vec<Limit, 4>,
    /// The fault found, if any.
    pub fault: Option<Fault>,
    /// A slip that has come to its end.
    pub slip: Option<Slip>,
    /// Another step is ahead.
    pub advanced: bool,
    /// A crossing that was observed from touch to end, and whether its gap is plausible.
    pub closed: Option<(OpenCrossing, bool)>,
    /// What tread and drive show before the first crossing.
    pub shown: Option<Shown>,
    /// A new plan is needed.
    pub replan: bool,
}

impl Findings {
    pub(super) fn limit(&mut self, limit: Limit) {
        // No stage reports more than three.
        let _ = self.limits.push(limit);
    }
}

impl EstimateState {
    /// A start with the wheel where a record has it, if there is one.
    pub fn restored(record: Option<Place>) -> Self {
        let mut state = Self::default();
        if let Some(place) = record {
            state.known = Position::Recorded(place);
            // The wheel's travel begins with the start.
            state.odometry.set(Travel::ZERO, place.position);
        }
        state
    }

    /// Preload behind the memory of the tread, N: what the tread has had time to take up.
    pub fn remembered_preload(&self) -> Newtons {
        self.remembered.output()
    }

    /// Travel that the drive is asked for, mm.
    pub fn driven(&self, sensed: &SensedState) -> Travel {
        sensed.travel.saturating_add(self.wind_up.lags())
    }

    /// How far the tread is wound up, mm.
    pub fn wound(&self) -> Millimetres {
        self.wind_up.displaced().abs()
    }

    /// Travel and speed of the wheel, mm and mm/s.
    pub fn turns(&self, sensed: &SensedState) -> (Travel, MillimetresPerSecond) {
        let wind_up = &self.wind_up;
        (sensed.travel.saturating_add(wind_up.gave()), sensed.speed.value + wind_up.speed())
    }

    /// Takes off travel and speed of the wheel what moves no axle. A drive that `runs` makes up for it.
    pub fn rim(&mut self, sensed: &mut SensedState, runs: bool) {
        self.wind_up.follow(runs);
        sensed.travel = sensed.travel.saturating_sub(self.wind_up.gave());
        sensed.speed.value -= self.wind_up.speed();
    }

    /// Begins a tick at this travel of the wheel.
    pub fn begin_tick(&mut self, travel: Travel) {
        self.position = self.odometry.position(travel);
    }

    /// The start followed at once on a run whose zeros were taken, and has not located the wheel yet.
    pub fn has_zeros(&self) -> bool {
        matches!(self.known, Position::Recorded(at) if at.sure && at.zeros != Zeros::default())
    }

    /// Whether a start could go on from the position.
    pub const fn confidence(&self) -> PositionConfidence {
        let steps_found = self.missed == 0 && self.extra == 0;
        match self.known {
            Position::Recorded(_) => {}
            _ if !self.known.is_located() || !steps_found => return PositionConfidence::Guess,
            _ => {}
        }
        if self.known.is_unsure() {
            PositionConfidence::Unsure
        } else if self.known.is_searching() {
            PositionConfidence::Guess
        } else {
            PositionConfidence::Sure
        }
    }

    /// Declares the position of the wheel at this travel.
    pub(super) fn set_position(&mut self, travel: Travel, position: Millimetres) {
        self.odometry.set(travel, position);
        self.position = position;
    }

    /// A corner carries and the lower wall has not been left (retract: reached).
    pub fn critical(&self) -> bool {
        let on_corner = matches!(self.watch.contact, Contact::Both | Contact::Corner);
        on_corner && self.crossing.as_ref().is_some_and(|crossing| crossing.lift.is_none())
    }

    /// Speed at the lift-off that has just been detected, mm/s: it is kept until the lower wall has
    /// surely been left. On retract until it surely carries: the step may be higher than its table.
    pub fn lifting(&self) -> Option<MillimetresPerSecond> {
        let point = self.crossing.as_ref()?.lift?;
        let doubtful = match self.direction {
            Direction::Deploy => (self.position - point.position).abs() < LIFT_WITHIN,
            Direction::Retract => self.watch.contact == Contact::Both && self.watch.eased < EASED,
        };
        doubtful.then_some(point.held)
    }

    /// One level on; the arm confirms the count at the end.
    pub(super) fn pass(&mut self) {
        let extra = u8::from(self.crossing.as_ref().is_some_and(|open| open.step == 0));
        self.missed_in_a_row = 0;
        match self.direction {
            Direction::Deploy => {
                self.level = self.level.saturating_add(1);
                self.extra = self.extra.saturating_add(extra);
            }
            Direction::Retract => {
                self.level = self.level.saturating_sub(1);
                self.extra = self.extra.saturating_sub(extra);
            }
        }
    }

    /// The wheel slips on a corner now, or has slipped on it.
    pub fn slips(&self) -> (bool, bool) {
        let on_corner = matches!(self.watch.contact, Contact::Both | Contact::Corner);
        let slip = self.crossing.as_ref().filter(|_| on_corner).map(|open| open.slip);
        slip.map_or((false, false), |slip| (slip.is_slipping(), slip.lost > Q16::ZERO))
    }

    /// A corner is detected.
    pub fn on_corner(&self) -> bool {
        self.watch.contact != Contact::Wall
    }

    /// Whether something unexpected asks for crossing speed.
    pub fn slow_down(&self) -> bool {
        let expected = self.crossing.as_ref().is_some_and(|crossing| crossing.expected);
        let surprised = self.critical() && !expected;
        self.late || self.known.is_searching() && self.next_step > 0 || surprised
    }

    /// The place is not known until a step is found.
    pub const fn is_searching(&self) -> bool {
        self.known.is_searching()
    }

    /// What carries the wheel, as reported: a wheel that searches after a restart counts as on
    /// the wall until a corner is detected.
    pub fn contact(&self) -> Contact {
        let followed = self.crossing.is_some();
        if self.known.is_searching() && !followed { Contact::Wall } else { self.watch.contact }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Q16;

    #[test]
    fn a_place_is_known_only_with_every_step_found_where_the_table_has_it() {
        use PositionConfidence::{Guess, Sure, Unsure};
        for (missed, extra) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let steps_found = missed == 0 && extra == 0;
            for (known, confidence) in [
                (Position::Unknown, Guess),
                (Position::Restored { sure: true }, Sure),
                (Position::Restored { sure: false }, Unsure),
                (Position::Unconfirmed { searching: true }, Unsure),
                (Position::Unconfirmed { searching: false }, Unsure),
                (Position::Searching, Guess),
                (Position::Located, Sure),
            ] {
                let state = EstimateState { known, missed, extra, ..EstimateState::default() };
                let expected = if steps_found { confidence } else { Guess };
                assert_eq!(state.confidence(), expected, "{known:?} {missed} {extra}");
            }
        }
        for (sure, confidence) in [(true, Sure), (false, Unsure)] {
            let record = Some(Place { position: Q16::ZERO, sure, zeros: Default::default() });
            assert_eq!(EstimateState::restored(record).confidence(), confidence);
        }
    }
}
