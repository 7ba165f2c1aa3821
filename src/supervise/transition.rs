//! The transition table.

use super::{Command, Leg, Mode};
use crate::fault::Fault;
use crate::units::Direction;

/// Cause of a transition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// Every sensor has answered.
    SensorsAnswer,
    /// The self-test passed.
    TestPassed {
        /// The wheel is at the stow end and unloaded, so that the zeros can be taken.
        stowed: bool,
    },
    /// The zeros are taken.
    Zeroed,
    /// An operator's command.
    Command(Command),
    /// The preload is reached.
    PreloadReached,
    /// The run enters this leg.
    Leg(Leg),
    /// The wheel has come to rest.
    AtRest,
    /// The end of travel is reached and the arm confirms the level.
    Arrived,
    /// The host asks for the service mode.
    Service,
    /// A fault was found.
    Fault(Fault),
}

/// The mode after `trigger` in `mode`; none if the mode ignores it. A fault leads to the fault
/// hold from every mode, and the first fault is kept. During motion, start and retract mean
/// stop. The service mode is entered from idle alone, by the host's line alone; every command leads
/// out of it through the self-test.
pub const fn next(mode: Mode, trigger: Trigger) -> Option<Mode> {
    use Command::{Reset, Retract, Start, Stop};
    use Direction::{Deploy, Retract as Back};
    use Mode as M;
    use Trigger as T;
    Some(match (mode, trigger) {
        (M::FaultHold(_), T::Fault(_)) => return None,
        (_, T::Fault(fault)) => M::FaultHold(fault),
        (M::FaultHold(_), T::Command(Reset)) => M::SelfTest,
        (M::Boot, T::SensorsAnswer) => M::SelfTest,
        (M::SelfTest, T::TestPassed { stowed: true }) => M::Zero,
        (M::SelfTest, T::TestPassed { stowed: false }) => M::Idle,
        (M::Zero, T::Zeroed) => M::Idle,
        (M::Idle | M::Complete(_), T::Command(Reset)) => M::SelfTest,
        (M::Idle | M::Complete(Back), T::Command(Start)) => M::Preload(Deploy),
        (M::Idle | M::Complete(Deploy), T::Command(Retract)) => M::Preload(Back),
        (M::Preload(direction), T::PreloadReached) => M::Run(direction, Leg::Cruise),
        // A press of the button stops whatever moves.
        (M::Preload(_), T::Command(Stop | Start | Retract)) => M::Idle,
        (M::Run(direction, _), T::Leg(leg)) => M::Run(direction, leg),
        (M::Run(direction, _), T::Command(Stop | Start | Retract)) => M::Stopping(direction),
        (M::Run(direction, _), T::Arrived) => M::Complete(direction),
        (M::Stopping(_), T::AtRest) => M::Idle,
        (M::Idle, T::Service) => M::Service,
        (M::Service, T::Command(_)) => M::SelfTest,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triggers() -> impl Iterator<Item = Trigger> {
        let legs = [Leg::Cruise, Leg::Approach, Leg::Crossing, Leg::Settle].map(Trigger::Leg);
        let passed = [true, false].map(|stowed| Trigger::TestPassed { stowed });
        [Trigger::SensorsAnswer, Trigger::Zeroed, Trigger::PreloadReached]
            .into_iter()
            .chain([Trigger::AtRest, Trigger::Arrived, Trigger::Service])
            .chain(passed)
            .chain(legs)
            .chain(Command::ALL.map(Trigger::Command))
            .chain(Fault::ALL.map(Trigger::Fault))
    }

    /// Every mode with every trigger.
    fn all() -> impl Iterator<Item = (Mode, Trigger)> {
        Mode::all().flat_map(|mode| triggers().map(move |trigger| (mode, trigger)))
    }

    #[test]
    fn a_fault_holds_from_every_mode_and_the_first_is_kept() {
        for mode in Mode::all() {
            for fault in Fault::ALL {
                let first = !matches!(mode, Mode::FaultHold(_));
                let held = first.then_some(Mode::FaultHold(fault));
                assert_eq!(next(mode, Trigger::Fault(fault)), held);
            }
        }
    }

    #[test]
    fn only_a_reached_preload_starts_motion() {
        for (mode, trigger) in all() {
            let starts = next(mode, trigger).is_some_and(Mode::moves) && !mode.moves();
            assert!(!starts || trigger == Trigger::PreloadReached, "{mode:?} {trigger:?}");
        }
    }

    #[test]
    fn the_service_mode_is_entered_from_idle_alone_and_left_by_the_self_test_alone() {
        for (mode, trigger) in all() {
            let after = next(mode, trigger);
            if after == Some(Mode::Service) {
                assert_eq!((mode, trigger), (Mode::Idle, Trigger::Service));
            }
            if mode == Mode::Service {
                let out = matches!(after, None | Some(Mode::SelfTest | Mode::FaultHold(_)));
                assert!(out, "{trigger:?} {after:?}");
            }
        }
    }

    #[test]
    fn every_mode_can_be_left_and_every_mode_is_reached() {
        let mut reached = vec![Mode::Boot];
        let mut at = 0;
        while let Some(&mode) = reached.get(at) {
            let next = triggers().filter_map(|t| next(mode, t)).filter(|m| *m != mode);
            let next: Vec<Mode> = next.collect();
            assert!(!next.is_empty(), "{mode:?} is a trap");
            for mode in next {
                if !reached.contains(&mode) {
                    reached.push(mode);
                }
            }
            at += 1;
        }
        assert_eq!(reached.len(), Mode::all().count());
    }

    #[test]
    fn a_stop_from_motion_never_leads_back_into_it_by_itself() {
        for direction in [Direction::Deploy, Direction::Retract] {
            let stopping =
                next(Mode::Run(direction, Leg::Crossing), Trigger::Command(Command::Stop));
            assert_eq!(stopping, Some(Mode::Stopping(direction)));
            assert_eq!(next(Mode::Stopping(direction), Trigger::AtRest), Some(Mode::Idle));
            assert_eq!(next(Mode::Stopping(direction), Trigger::Leg(Leg::Cruise)), None);
        }
    }
}
