//! State of the controller between ticks.

use crate::control::preload_loop::PreloadLoopState;
use crate::control::speed_loop::SpeedLoopState;
use crate::estimate::crossing::Contact;
use crate::estimate::vibration::VibrationTracking;
use crate::estimate::{ContactStage, EstimateState, OpenCrossing, Place, PositionConfidence};
use crate::model::approach::Begun;
use crate::model::profile::ProfileState;
use crate::model::{Learned, Plan, Review};
use crate::sense::{SensesState, Zeros};
use crate::supervise::service::ServiceState;
use crate::supervise::{Leg, Mode, MonitorState};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Tick, Travel, per_tick, q16,
};

/// How a braking wheel closes on its profile: rate, 1/s, the speed loop's crossover; most, mm.
const CLOSES: Q16 = q16(20_000_000);
const MOST_BEHIND: Millimetres = q16(250_000); // Farther off, its place has been corrected.
/// Ticks over which the feed-forward of a detected corner is blended in.
pub(super) const BLEND_TICKS: u8 = 32;

/// State of the controller.
#[derive(Clone, Debug, Default)]
pub struct State {
    pub(super) mode: Mode,
    /// Ticks since the mode was entered.
    pub(super) in_mode: u32,
    /// Ticks for which the drive has been at rest; none if that is as long as is known.
    pub(super) rested: Option<u32>,
    /// Ticks for which the condition that the mode waits for has held.
    pub(super) condition_ticks: u32,
    pub(super) senses: SensesState,
    pub(super) monitor: MonitorState,
    pub(super) estimate: EstimateState,
    pub(super) stage: ContactStage,
    pub(super) vibration: VibrationTracking,
    pub(super) profile: ProfileState,
    pub(super) speed_loop: SpeedLoopState,
    pub(super) preload_loop: PreloadLoopState,
    pub(super) planning: Planning,
    pub(super) approach: Approach,
    pub(super) service: ServiceState,
    /// Ticks for which a corner has been detected, up to [`BLEND_TICKS`].
    pub(super) corner_blend_ticks: u8,
    /// Where a wheel that brakes is by its profile, mm.
    pub(super) brake_position: Option<Travel>,
}

/// The approach to the step ahead; it begins again with the next step and with each run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Approach {
    /// The preload is being raised for the step.
    pub ramping: bool,
    /// What of the plan's approach has begun.
    pub begun: Begun,
    /// The wheel sped up on the corner behind, before it lifted off.
    pub sped_up: bool,
    /// Time since which the crossing preload is reached.
    pub standing_since: Option<Tick>,
    /// Waiting for the preload has been reported.
    pub wait_reported: bool,
    /// Ticks for which the drive has waited for the preload.
    pub waiting: u32,
    /// The preload was behind what the actuator's model expects, and still is by half of that.
    pub late: bool,
}

/// The exchange with the model task.
#[derive(Clone, Debug, Default)]
pub(super) struct Planning {
    pub plan: Option<Plan>,
    /// Answer to the newest request, until it counts.
    pub answer: Option<Plan>,
    /// Sequence of the newest request.
    pub sequence: u32,
    /// Ticks for which it has waited for its answer, from 1; 0 if answered.
    pub asked: u32,
    /// Tread, load and friction as learned so far.
    pub learned: Learned,
    /// Slip on the corner so far, mm.
    pub lost: Millimetres,
    /// Largest radial force under which it has grown since the last plan, N.
    pub slipped: Option<Newtons>,
    /// The last crossing, until its review is complete.
    pub closed: Option<OpenCrossing>,
    /// The review without an answer; part of every request until then.
    pub review: Option<Review>,
}

impl State {
    /// State of a start with this record of the wheel's position, if there is one.
    pub fn restored(record: Option<Place>) -> Self {
        Self {
            estimate: EstimateState::restored(record),
            senses: SensesState::with(record.map(|place| place.zeros).unwrap_or_default()),
            rested: record.and(Some(0)),
            ..Self::default()
        }
    }

    /// Zeros of the analogue sensors, for a restart.
    pub const fn zeros(&self) -> Zeros {
        self.senses.zeros()
    }

    /// Confidence of the position, for a restart.
    pub const fn confidence(&self) -> PositionConfidence {
        self.estimate.confidence()
    }

    /// Mode of the drive.
    pub const fn mode(&self) -> Mode {
        self.mode
    }

    /// Estimated over nominal stiffness of the tread.
    pub const fn stiffness_scale(&self) -> Ratio {
        self.planning.learned.scale
    }

    /// What is along the run, signed outwards.
    pub(super) fn outwards(&self, along: Q16) -> Q16 {
        if self.estimate.direction == Direction::Deploy { along } else { -along }
    }

    /// Speed that brings a wheel which brakes to rest back to where its profile has it, mm/s outwards.
    pub(super) fn make_up(&mut self, target: MillimetresPerSecond) -> MillimetresPerSecond {
        let (at, speed) = (self.estimate.position.widen(), self.outwards(self.profile.speed()));
        if target != Q16::ZERO || speed == Q16::ZERO || !matches!(self.mode, Mode::Run(..)) {
            self.brake_position = None;
            return Q16::ZERO;
        }
        let planned = self.brake_position.unwrap_or(at).saturating_add(per_tick(speed));
        self.brake_position = Some(planned);
        Q16::narrow(planned.saturating_sub(at)).clamp(-MOST_BEHIND, MOST_BEHIND) * CLOSES
    }

    /// Part of a corner's feed-forward that is blended in, 0 to 1, after one more tick, and what
    /// this tick adds to it.
    pub(super) fn blend_corner(&mut self) -> (Ratio, Ratio) {
        // BLEND_TICKS is 2^5: bits of Q16 shifted.
        let part = |ticks: u8| Q16::from_bits(i32::from(ticks) << 11);
        let before = part(self.corner_blend_ticks);
        self.corner_blend_ticks = if self.estimate.on_corner() {
            self.corner_blend_ticks.saturating_add(1).min(BLEND_TICKS)
        } else {
            self.corner_blend_ticks.saturating_sub(1)
        };
        let blend = part(self.corner_blend_ticks);
        (blend, (blend - before).max(Q16::ZERO))
    }

    pub(super) fn leg(&self, approaching: bool) -> Leg {
        match self.estimate.contact() {
            Contact::Both | Contact::Corner => Leg::Crossing,
            Contact::Leaving => Leg::Settle,
            Contact::Wall if approaching || self.estimate.slow_down() => Leg::Approach,
            Contact::Wall => Leg::Cruise,
        }
    }

    /// Forgets where the wheel is and what the run so far has shown, as a start without a record.
    pub(super) fn forget(&mut self) {
        self.estimate = EstimateState::default();
        self.monitor = MonitorState::default();
        self.vibration = VibrationTracking::default();
        self.approach = Approach::default();
        let sequence = self.planning.sequence;
        self.planning = Planning { sequence, ..Planning::default() };
        self.halt();
    }

    /// Stops loops and profile where they are.
    pub(super) fn halt(&mut self) {
        self.profile.halt();
        self.speed_loop = SpeedLoopState::default();
        self.preload_loop.halt();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_has_the_zeros_of_its_record() {
        let zeros = Zeros { preload: q16(3_000_000), compression: q16(100_000) };
        let place = Place { position: q16(30_000_000), sure: true, zeros };
        assert_eq!(State::restored(Some(place)).zeros(), zeros);
        assert_eq!(State::restored(None).zeros(), Zeros::default());
    }

    #[test]
    fn a_corner_is_blended_in_over_its_ticks_or_at_once() {
        let mut state = State::default();
        state.estimate.watch.contact = Contact::Both;
        let parts: Vec<_> = (0..40).map(|_| state.blend_corner().0).collect();
        assert_eq!((parts[0], parts[15], parts[31]), (q16(31_250), q16(500_000), q16(1_000_000)));
        assert_eq!(parts[39], q16(1_000_000));
        let mut state = State::default();
        state.estimate.watch.contact = Contact::Corner;
        state.corner_blend_ticks = BLEND_TICKS;
        assert_eq!(state.blend_corner(), (q16(1_000_000), Q16::ZERO));
        state.estimate.watch.contact = Contact::Wall;
        assert_eq!(state.blend_corner(), (q16(968_750), Q16::ZERO));
        state.estimate.watch.contact = Contact::Both;
        assert_eq!(state.blend_corner(), (q16(1_000_000), q16(31_250)));
    }
}
