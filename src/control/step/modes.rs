//! What each mode waits for, and for how long.

use super::{Controller, Pass, State};
use crate::control::start::{TEST_TICKS, all_answer, at_rest, silent, stowed};
use crate::log::Event;
use crate::supervise::{Direction, Fault, Limit, Mode, Trigger, next};
use crate::units::Q16;

/// Ticks that a preload must stand before the drive starts.
const STANDING_TICKS: u32 = 60;
/// Ticks after which a sensor that has not answered since boot counts as missing.
const BOOT_TICKS: u32 = 2000;
/// Ticks within which the wheel must come to rest for the self-test.
const REST_TICKS: u32 = 2000;
/// Ticks after which a zero that does not come in counts as failed.
const ZERO_TICKS: u32 = 2000;
/// Ticks within which the wheel must stand after a stop.
const STOP_TICKS: u32 = 1500;

impl Controller {
    /// Offers a trigger to the table; whether it was taken.
    pub(super) fn trigger(&self, state: &mut State, pass: &mut Pass<'_>, trigger: Trigger) -> bool {
        let Some(mode) = next(state.mode, trigger) else { return false };
        if let Trigger::Fault(fault) = trigger {
            pass.log(Event::Fault(fault));
        }
        if mode != state.mode {
            let before = state.mode;
            state.mode = mode;
            state.in_mode = 0;
            state.stood = 0;
            pass.log(Event::Mode(mode));
            self.enter(state, pass, before);
        }
        true
    }

    fn enter(&self, state: &mut State, pass: &mut Pass<'_>, before: Mode) {
        match state.mode {
            Mode::SelfTest => pass.output.rearm = matches!(before, Mode::FaultHold(_)),
            Mode::Zero => state.senses.begin_zero(),
            Mode::Preload(direction) => self.prepare(state, pass, direction),
            Mode::Idle if matches!(before, Mode::SelfTest | Mode::Zero) => {
                self.locate(state, pass, before == Mode::Zero);
            }
            _ => {}
        }
    }

    /// What the present mode waits for.
    pub(super) fn advance_mode(&self, state: &mut State, pass: &mut Pass<'_>) {
        state.in_mode = state.in_mode.saturating_add(1);
        match state.mode {
            Mode::Boot if all_answer(pass.sensed) => {
                self.trigger(state, pass, Trigger::SensorsAnswer);
            }
            Mode::Boot if state.in_mode >= BOOT_TICKS => {
                self.give_up(state, pass, silent(pass.sensed));
            }
            Mode::SelfTest => self.await_rest(state, pass),
            Mode::Zero => self.await_zero(state, pass),
            Mode::Preload(direction) => self.await_preload(state, pass, direction),
            Mode::Run(direction, _) => self.await_arrival(state, pass, direction),
            Mode::Stopping(_) if state.profile.speed() == Q16::ZERO && at_rest(pass.sensed) => {
                self.trigger(state, pass, Trigger::AtRest);
            }
            Mode::Stopping(_) if state.in_mode >= STOP_TICKS => {
                self.give_up(state, pass, Fault::DriveRunaway);
            }
            _ => {}
        }
    }

    pub(super) fn give_up(&self, state: &mut State, pass: &mut Pass<'_>, fault: Fault) {
        self.trigger(state, pass, Trigger::Fault(fault));
    }

    fn await_rest(&self, state: &mut State, pass: &mut Pass<'_>) {
        state.stood = if at_rest(pass.sensed) { state.stood + 1 } else { 0 };
        if state.stood >= TEST_TICKS {
            let stowed = stowed(pass.sensed);
            self.trigger(state, pass, Trigger::TestPassed { stowed });
        } else if state.in_mode >= REST_TICKS {
            self.give_up(state, pass, Fault::SelfTest);
        }
    }

    fn await_zero(&self, state: &mut State, pass: &mut Pass<'_>) {
        match state.senses.zeroed() {
            Some(true) => {
                self.trigger(state, pass, Trigger::Zeroed);
            }
            None if state.in_mode < ZERO_TICKS => {}
            _ => self.give_up(state, pass, Fault::SelfTest),
        }
    }

    /// Compression against preload, on a wheel that surely stands on a wall.
    fn compare_tread(&self, state: &mut State, pass: &mut Pass<'_>) {
        let (preload, wedge) = (pass.sensed.preload_filtered, pass.wedge);
        let compression = pass.sensed.compression_filtered;
        if state.in_mode <= 1 || state.on_corner() || state.searching {
            self.tread.begin(&mut state.tread, preload);
        } else if self.tread.step(&mut state.tread, preload, wedge, compression)
            && !self.may_feel_corner(pass.position)
        {
            pass.log(Event::Limit(Limit::TreadStrange));
        }
    }

    fn await_preload(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction) {
        let seen = self.seen(state, pass);
        self.watch.rest(&mut state.watch, &seen);
        self.compare_tread(state, pass);
        let stands = state.plan.as_ref().is_some_and(|plan| {
            let course = self.course(state, pass, direction);
            let wanted = self.schedule.targets(&self.rise, plan, &course).preload;
            let off = (pass.sensed.preload_filtered - wanted).abs();
            off <= self.schedule.stands_within()
        });
        state.stood = if stands { state.stood + 1 } else { 0 };
        if state.stood >= STANDING_TICKS {
            self.trigger(state, pass, Trigger::PreloadStands);
        } else if state.in_mode >= self.patience {
            self.give_up(state, pass, Fault::PreloadNotReached);
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "quantities of a test")]
mod tests {
    use super::super::tests::{at, sensed};
    use super::*;
    use crate::estimate::crossing::Contact;
    use crate::sense::{SensedState, Validity};
    use crate::supervise::Command;
    use crate::units::q16;

    /// Every sensor answers, and the wheel stands.
    fn answering() -> SensedState {
        let mut all = sensed(0, 0.0, 0.0);
        all.speed.validity = Validity::Valid;
        all.preload.validity = Validity::Valid;
        all.compression.validity = Validity::Valid;
        all.radius.validity = Validity::Valid;
        all
    }

    #[test]
    fn boot_waits_two_seconds_for_every_sensor() {
        let mut state = State::default();
        let mut deaf = answering();
        deaf.radius.validity = Validity::Absent;
        at(&deaf, 0.0, |controller, pass| {
            for tick in 1..2000 {
                controller.advance_mode(&mut state, pass);
                assert_eq!(state.mode, Mode::Boot, "{tick}");
            }
            controller.advance_mode(&mut state, pass);
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::AngleStale));
        let mut state = State::default();
        at(&answering(), 0.0, |controller, pass| controller.advance_mode(&mut state, pass));
        assert_eq!(state.mode, Mode::SelfTest);
    }

    #[test]
    fn a_zero_that_does_not_come_in_is_given_up_after_two_seconds() {
        let mut state = State::default();
        state.mode = Mode::Zero;
        state.senses.begin_zero();
        at(&answering(), 0.0, |controller, pass| {
            for tick in 1..2000 {
                controller.advance_mode(&mut state, pass);
                assert_eq!(state.mode, Mode::Zero, "{tick}");
            }
            controller.advance_mode(&mut state, pass);
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::SelfTest));
    }

    #[test]
    fn a_tread_is_compared_on_a_wall_alone() {
        // Pressed with 40 N, and the displacement sensor shows nothing.
        let strange = SensedState { preload_filtered: q16(40_000_000), ..sensed(0, 0.0, 0.0) };
        let told = |contact: Contact, searching: bool, position: f64| {
            let mut state = State::default();
            state.watch.contact = contact;
            state.searching = searching;
            at(&strange, position, |controller, pass| {
                for tick in 1..500 {
                    state.in_mode = tick;
                    controller.compare_tread(&mut state, pass);
                }
                let strange = Event::Limit(Limit::TreadStrange);
                pass.output.events.iter().filter(|entry| entry.event == strange).count()
            })
        };
        assert_eq!(told(Contact::Wall, false, 0.0), 1);
        assert_eq!(told(Contact::Both, false, 0.0), 0);
        assert_eq!(told(Contact::Leaving, false, 0.0), 0);
        assert_eq!(told(Contact::Wall, true, 0.0), 0);
        // The corner at 18 mm may carry a part.
        assert_eq!(told(Contact::Wall, false, 12.0), 0);
    }

    #[test]
    fn a_wheel_that_does_not_stop_is_given_up_after_a_second_and_a_half() {
        let stopping = |speed: Q16| {
            let mut state = State::default();
            state.mode = Mode::Stopping(Direction::Deploy);
            let mut turning = answering();
            turning.speed.value = speed;
            let ticks = at(&turning, 10.0, |controller, pass| {
                (1..5000).find(|_| {
                    controller.advance_mode(&mut state, pass);
                    state.mode != Mode::Stopping(Direction::Deploy)
                })
            });
            (ticks, state.mode)
        };
        let runs = (Some(1500), Mode::FaultHold(Fault::DriveRunaway));
        assert_eq!(stopping(q16(20_000_000)), runs);
        assert_eq!(stopping(q16(-20_000_000)), runs);
        assert_eq!(stopping(Q16::ZERO), (Some(1), Mode::Idle));
    }

    #[test]
    fn a_preload_that_never_stands_is_given_up_after_twice_its_longest_rise_and_a_second() {
        let mut rig = crate::rig::Rig::prototype();
        for limit_n in [50.0, 60.0] {
            rig.preload.limit_n = limit_n;
            let controller = Controller::try_build(&rig).expect("sound");
            let mut state = State::default();
            state.mode = Mode::Preload(Direction::Deploy);
            let ticks = at(&answering(), 0.0, |_, pass| {
                (1..20_000).find(|_| {
                    controller.advance_mode(&mut state, pass);
                    state.mode != Mode::Preload(Direction::Deploy)
                })
            });
            assert_eq!(state.mode, Mode::FaultHold(Fault::PreloadNotReached));
            let patience_s = 2.0 * limit_n / rig.preload.slew_n_per_s + 1.0;
            assert_eq!(ticks, Some((1000.0 * patience_s) as u32));
        }
    }

    #[test]
    fn bridges_are_armed_anew_by_a_reset_from_a_fault_alone() {
        let idle = answering();
        let armed = |from: Mode, trigger: Trigger| {
            let mut state = State::default();
            state.mode = from;
            at(&idle, 0.0, |controller, pass| {
                assert!(controller.trigger(&mut state, pass, trigger));
                (state.mode, pass.output.rearm)
            })
        };
        let reset = Trigger::Command(Command::Reset);
        let fault = Mode::FaultHold(Fault::TickOverrun);
        assert_eq!(armed(fault, reset), (Mode::SelfTest, true));
        assert_eq!(armed(Mode::Boot, Trigger::SensorsAnswer), (Mode::SelfTest, false));
        for from in [Mode::Idle, Mode::Complete(Direction::Retract)] {
            assert_eq!(armed(from, reset), (Mode::SelfTest, false), "{from:?}");
        }
    }
}
