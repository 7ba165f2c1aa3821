//! What the controller remembers between ticks.

use crate::control::preload_loop::PreloadLoopState;
use crate::control::profile::ProfileState;
use crate::control::speed_loop::SpeedLoopState;
use crate::estimate::ContactStage;
use crate::estimate::crossing::{Contact, WatchState};
use crate::estimate::odometry::Odometry;
use crate::estimate::tread::TreadState;
use crate::estimate::vibration::VibrationState;
use crate::model::{Plan, Review};
use crate::restart::{Place, PositionConfidence};
use crate::sense::SensesState;
use crate::supervise::{Direction, Leg, Mode, MonitorState};
use crate::units::{
    Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons, Q16, Ratio, Tick, Travel,
    q16,
};

/// Ticks over which a felt corner is blended into the feed-forward.
const BLEND_TICKS: u8 = 32;

/// State of the controller.
#[derive(Clone, Debug)]
pub struct State {
    pub(super) mode: Mode,
    /// Ticks since the mode was entered.
    pub(super) in_mode: u32,
    /// Ticks for which what the mode waits for has stood.
    pub(super) stood: u32,
    pub(super) senses: SensesState,
    pub(super) monitor: MonitorState,
    pub(super) odometry: Odometry,
    /// Whether the odometry has been given an origin.
    pub(super) located: bool,
    /// That origin is a guess: the next step found tells where the wheel is, and until
    /// then the drive goes as if the step came at once.
    pub(super) searching: bool,
    /// The position is that of a record which may be off, and no step found since then
    /// confirms it.
    pub(super) unsure: bool,
    /// Where a record has the wheel, until the odometry has an origin.
    pub(super) kept: Option<Place>,
    /// Located without having rolled there: before the next run it is to be found out
    /// whether the wheel stands on a corner.
    pub(super) resumed: bool,
    pub(super) watch: WatchState,
    pub(super) tread: TreadState,
    pub(super) stage: ContactStage,
    pub(super) vibration: Shaking,
    /// Level by steps recognised.
    pub(super) level: u8,
    /// Step ahead, from 1; 0 when none is left.
    pub(super) next_step: u8,
    pub(super) direction: Direction,
    pub(super) profile: ProfileState,
    pub(super) speed_loop: SpeedLoopState,
    pub(super) preload_loop: PreloadLoopState,
    pub(super) plan: Option<Plan>,
    /// Sequence of the newest request.
    pub(super) sequence: u32,
    /// Ticks for which it has waited for its answer, from 1; 0 when answered.
    pub(super) asked: u32,
    pub(super) scale: Ratio,
    /// The crossing under way or just behind.
    pub(super) crossing: Option<OpenCrossing>,
    /// Its line, waiting for the model's review.
    pub(super) line: Option<OpenCrossing>,
    /// The review asked for and not yet answered; goes with every request until then.
    pub(super) review: Option<Review>,
    /// The preload is being raised for the step ahead.
    pub(super) ramping: bool,
    /// The speed is being brought down for the step ahead.
    pub(super) braking: bool,
    /// Since when the crossing preload has stood.
    pub(super) standing_since: Option<Tick>,
    /// The step ahead is late and has been reported.
    pub(super) late: bool,
    /// Waiting for the preload has been reported for this step.
    pub(super) waited: bool,
    /// Ticks for which a corner has been felt, up to [`BLEND_TICKS`].
    felt: u8,
    /// Residual of the last step found, if it was beyond the tolerance, mm.
    pub(super) displaced: Option<Millimetres>,
    /// Face of the step being left although its crossing is not followed, mm.
    pub(super) leaving: Option<Millimetres>,
    /// Ticks for which the drive has waited for the preload.
    pub(super) waiting: u32,
    /// Steps of the table given up since the stow end.
    pub(super) given_up: u8,
    /// Steps given up since the last one found.
    pub(super) lost_in_a_row: u8,
    /// Steps climbed that the table lacks, since the stow end.
    pub(super) extra: u8,
}

/// What is known of the arm's vibration.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shaking {
    pub observer: VibrationState,
    /// The observer is being listened to.
    pub awake: bool,
    /// Largest amplitude since it woke, mm.
    pub peak: Millimetres,
}

/// A crossing under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct OpenCrossing {
    /// Step of the table; 0 if the table lacks it.
    pub step: u8,
    pub direction: Direction,
    /// Felt inside its window, so that baseline and preload were ready.
    pub expected: bool,
    /// The wheel turned back on this very corner: its first half is not seen.
    pub turned: bool,
    /// The wheel stood on it when the board started: where its face is, was not seen.
    pub resumed: bool,
    /// That it was not where the table has it has been reported.
    pub told: bool,
    pub touched_at: Tick,
    /// Odometry when the corner was first felt.
    pub from: Option<Travel>,
    pub standing_since: Option<Tick>,
    pub peak_preload: Newtons,
    pub lift: Option<LiftPoint>,
    /// Gap and compression when closed.
    pub gap: Millimetres,
    pub deepest: Millimetres,
}

impl OpenCrossing {
    /// A crossing that begins now.
    pub(super) fn begin(step: u8, direction: Direction, expected: bool, now: Tick) -> Self {
        Self {
            step,
            direction,
            expected,
            turned: false,
            resumed: false,
            told: false,
            touched_at: now,
            from: None,
            standing_since: None,
            peak_preload: Newtons::ZERO,
            lift: None,
            gap: Millimetres::ZERO,
            deepest: Millimetres::ZERO,
        }
    }
}

/// The instant of lift-off.
#[derive(Clone, Copy, Debug)]
pub(super) struct LiftPoint {
    pub at: Tick,
    /// Gap with the nominal step height, mm.
    pub gap: Millimetres,
    pub speed: MillimetresPerSecond,
    pub preload: Newtons,
    pub tan_arm: Ratio,
    /// Where the face was found, mm.
    pub face: Millimetres,
    /// Found minus table, mm.
    pub residual: Millimetres,
}

impl Default for State {
    fn default() -> Self {
        Self {
            mode: Mode::Boot,
            in_mode: 0,
            stood: 0,
            senses: SensesState::default(),
            monitor: MonitorState::default(),
            odometry: Odometry::default(),
            located: false,
            searching: false,
            unsure: false,
            kept: None,
            resumed: false,
            watch: WatchState::default(),
            tread: TreadState::default(),
            stage: ContactStage::Initial,
            vibration: Shaking::default(),
            level: 0,
            next_step: 0,
            direction: Direction::Deploy,
            profile: ProfileState::default(),
            speed_loop: SpeedLoopState::default(),
            preload_loop: PreloadLoopState::default(),
            plan: None,
            sequence: 0,
            asked: 0,
            scale: q16(1_000_000),
            crossing: None,
            line: None,
            review: None,
            ramping: false,
            braking: false,
            standing_since: None,
            late: false,
            waited: false,
            felt: 0,
            displaced: None,
            leaving: None,
            waiting: 0,
            given_up: 0,
            lost_in_a_row: 0,
            extra: 0,
        }
    }
}

impl State {
    /// A start with the wheel where a record has it, if there is one.
    #[must_use]
    pub fn standing(kept: Option<Place>) -> Self {
        let mut state = Self { kept, ..Self::default() };
        if let Some(place) = kept {
            state.unsure = !place.sure;
            // The wheel's travel begins with the start.
            state.odometry.set(Travel::ZERO, place.position);
        }
        state
    }

    /// Whether a start could go on from the position.
    #[must_use]
    pub const fn trust(&self) -> PositionConfidence {
        let steps_found = self.given_up == 0 && self.extra == 0;
        let known = self.kept.is_some() || self.located && steps_found;
        match (known, self.unsure, self.searching) {
            (true, true, _) => PositionConfidence::Unsure,
            (true, false, false) => PositionConfidence::Sure,
            _ => PositionConfidence::Guess,
        }
    }

    /// What the drive is doing.
    #[must_use]
    pub const fn mode(&self) -> Mode {
        self.mode
    }

    /// Estimated over nominal stiffness of the tread.
    #[must_use]
    pub const fn stiffness_scale(&self) -> Ratio {
        self.scale
    }

    /// Speed reference, signed outwards.
    pub(super) fn signed_speed(&self) -> MillimetresPerSecond {
        match self.direction {
            Direction::Deploy => self.profile.speed(),
            Direction::Retract => -self.profile.speed(),
        }
    }

    /// Acceleration reference, signed outwards.
    pub(super) fn acceleration(&self) -> MillimetresPerSecond2 {
        match self.direction {
            Direction::Deploy => self.profile.acceleration(),
            Direction::Retract => -self.profile.acceleration(),
        }
    }

    /// A corner is felt and the lower wall not yet left (retract: not yet reached).
    pub(super) fn critical(&self) -> bool {
        let on_corner = matches!(self.watch.contact, Contact::Both | Contact::Corner);
        on_corner && self.crossing.as_ref().is_some_and(|crossing| crossing.lift.is_none())
    }

    /// How far a felt corner is blended in, 0 to 1: a tick towards it or away from it.
    pub(super) fn feel_corner(&mut self) -> Ratio {
        self.felt = if self.on_corner() {
            self.felt.saturating_add(1).min(BLEND_TICKS)
        } else {
            self.felt.saturating_sub(1)
        };
        // BLEND_TICKS is 2^5: bits of Q16 shifted.
        Q16::from_bits(i32::from(self.felt) << 11)
    }

    /// A corner is felt from now on, without a way towards it.
    pub(super) fn feel_at_once(&mut self) {
        self.felt = BLEND_TICKS;
    }

    /// A corner is felt.
    pub(super) fn on_corner(&self) -> bool {
        self.watch.contact != Contact::Wall
    }

    /// Whether something unexpected asks for crossing speed.
    pub(super) fn slow_down(&self) -> bool {
        self.late || self.searching && self.next_step > 0 || self.critical()
    }

    /// Who carries the wheel, as shown; a wheel that searches after a restart is taken to
    /// be on the wall until a corner is felt.
    pub(super) fn contact(&self) -> Contact {
        let followed = self.crossing.is_some();
        if self.searching && !followed { Contact::Wall } else { self.watch.contact }
    }

    /// Leg of the run.
    pub(super) fn leg(&self, approaching: bool) -> Leg {
        match self.contact() {
            Contact::Both | Contact::Corner => Leg::Crossing,
            Contact::Leaving => Leg::Settle,
            Contact::Wall if approaching || self.late => Leg::Approach,
            Contact::Wall => Leg::Cruise,
        }
    }

    /// Outward distance from `at` to the face of a step that the table lacks, while
    /// the wheel is on it.
    pub(super) fn extra_face(&self, at: Millimetres) -> Option<Millimetres> {
        let crossing = self.crossing.as_ref().filter(|crossing| crossing.step == 0)?;
        let face = crossing.lift.as_ref()?.face;
        (face > at).then_some(face - at)
    }

    /// Stops loops and profile where they are.
    pub(super) fn halt(&mut self) {
        self.profile.halt();
        self.speed_loop.reset();
        self.preload_loop.halt();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_known_only_with_every_step_found_where_the_table_has_it() {
        for (searching, given_up, extra, placed) in [
            (false, 0, 0, true),
            (true, 0, 0, false),
            (false, 1, 0, false),
            (false, 0, 1, false),
            (true, 1, 0, false),
            (true, 0, 1, false),
            (false, 1, 1, false),
        ] {
            let state = State { located: true, searching, given_up, extra, ..State::default() };
            let trust = if placed { PositionConfidence::Sure } else { PositionConfidence::Guess };
            assert_eq!(state.trust(), trust, "{searching} {given_up} {extra}");
            // That of a record which may be off stays so, whether it searches or not.
            let steps_found = given_up == 0 && extra == 0;
            let trust =
                if steps_found { PositionConfidence::Unsure } else { PositionConfidence::Guess };
            assert_eq!(State { unsure: true, ..state }.trust(), trust, "{given_up} {extra}");
        }
        assert_eq!(State::default().trust(), PositionConfidence::Guess);
        for (sure, trust) in [(true, PositionConfidence::Sure), (false, PositionConfidence::Unsure)]
        {
            let kept = Some(Place { position: Q16::ZERO, sure });
            assert_eq!(State::standing(kept).trust(), trust);
        }
    }

    #[test]
    fn a_step_that_the_table_lacks_is_ahead_until_its_face() {
        let lifted = |step: u8| {
            let zero = Q16::ZERO;
            let lift = LiftPoint {
                at: 0,
                gap: zero,
                speed: zero,
                preload: zero,
                tan_arm: zero,
                face: q16(30_000_000),
                residual: zero,
            };
            let open = OpenCrossing::begin(step, Direction::Deploy, false, 0);
            let crossing = Some(OpenCrossing { lift: Some(lift), ..open });
            State { crossing, ..State::default() }
        };
        let unknown = lifted(0);
        assert_eq!(unknown.extra_face(q16(25_000_000)), Some(q16(5_000_000)));
        assert_eq!(unknown.extra_face(q16(30_000_000)), None);
        assert_eq!(unknown.extra_face(q16(35_000_000)), None);
        assert_eq!(lifted(1).extra_face(q16(25_000_000)), None);
        assert_eq!(State::default().extra_face(q16(25_000_000)), None);
    }

    #[test]
    fn a_corner_is_blended_in_over_its_ticks_or_at_once() {
        let mut state = State::default();
        state.watch.contact = Contact::Both;
        let felt: Vec<Ratio> = (0..40).map(|_| state.feel_corner()).collect();
        assert_eq!((felt[0], felt[15], felt[31]), (q16(31_250), q16(500_000), q16(1_000_000)));
        assert_eq!(felt[39], q16(1_000_000));
        let mut state = State::default();
        state.watch.contact = Contact::Corner;
        state.feel_at_once();
        assert_eq!(state.feel_corner(), q16(1_000_000));
        state.watch.contact = Contact::Wall;
        assert_eq!(state.feel_corner(), q16(968_750));
    }
}
