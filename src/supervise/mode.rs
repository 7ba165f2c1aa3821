//! Modes of the drive, and the operator's commands.

use super::codes;
use crate::fault::{Fault, worded};
use crate::units::Direction;

worded! {
    /// An operator's command.
    Command, word:
    /// Deploy from where the wheel is.
    Start "start";
    /// Come to rest and hold.
    Stop "stop";
    /// Retract from where the wheel is.
    Retract "retract";
    /// Leave the fault hold, or zero the sensors again when idle at the stow end.
    Reset "reset";
}

/// Part of a run between two steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Leg {
    /// On the continuous wall, no step inside the horizon.
    Cruise,
    /// A step lies ahead: preload is raised and the speed brought to crossing speed.
    Approach,
    /// The wheel touches the corner.
    Crossing,
    /// On the next wall: preload returns to cruise, the ledger is closed.
    Settle,
}

/// Mode of the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Mode {
    /// Waiting for every sensor's first reading.
    #[default]
    Boot,
    /// Checking that readings are in range and at rest.
    SelfTest,
    /// Averaging the zeros of preload and compression sensor, unloaded.
    Zero,
    /// At rest, bridges off, gears holding.
    Idle,
    /// Bringing the preload to cruise before moving.
    Preload(Direction),
    /// Running.
    Run(Direction, Leg),
    /// Braking to rest on command.
    Stopping(Direction),
    /// Arrived at the end of travel; bridges off, gears holding.
    Complete(Direction),
    /// A fault is latched; bridges off, gears holding, preload in the spring.
    FaultHold(Fault),
    // Behind all others: logs have the place in this list.
    /// At rest, or moved a little by a host on the line; see [`service`](super::service).
    Service,
}

impl Mode {
    /// Every mode but the fault holds, of which there is one per [`Fault`], and its words, as the
    /// logs have them.
    pub const WITHOUT_FAULT: [(Self, &str); 19] = {
        use Direction::{Deploy, Retract};
        use Leg::{Approach, Crossing, Cruise, Settle};
        [
            (Self::Boot, "boot"),
            (Self::SelfTest, "self-test"),
            (Self::Zero, "zeroing"),
            (Self::Idle, "idle"),
            (Self::Preload(Deploy), "preloading to deploy"),
            (Self::Run(Deploy, Cruise), "deploying: cruise"),
            (Self::Run(Deploy, Approach), "deploying: approach"),
            (Self::Run(Deploy, Crossing), "deploying: crossing"),
            (Self::Run(Deploy, Settle), "deploying: settle"),
            (Self::Stopping(Deploy), "stopping while deploying"),
            (Self::Complete(Deploy), "deployed"),
            (Self::Preload(Retract), "preloading to retract"),
            (Self::Run(Retract, Cruise), "retracting: cruise"),
            (Self::Run(Retract, Approach), "retracting: approach"),
            (Self::Run(Retract, Crossing), "retracting: crossing"),
            (Self::Run(Retract, Settle), "retracting: settle"),
            (Self::Stopping(Retract), "stopping while retracting"),
            (Self::Complete(Retract), "retracted"),
            (Self::Service, "service"),
        ]
    };

    /// Every mode.
    #[cfg(test)]
    pub(super) fn all() -> impl Iterator<Item = Self> {
        Self::WITHOUT_FAULT.map(|(mode, _)| mode).into_iter().chain(Fault::ALL.map(Self::FaultHold))
    }

    /// The mode in words, as the logs have it.
    pub fn words(self) -> &'static str {
        let number = usize::from(codes::of_mode(self));
        Self::WITHOUT_FAULT.get(number).map_or("fault hold", |(_, words)| words)
    }

    /// Whether nothing is driven in this mode, neither wheel nor pre-tightener.
    pub const fn is_at_rest(self) -> bool {
        !matches!(self, Self::Preload(_) | Self::Run(..) | Self::Stopping(_) | Self::Service)
    }

    /// Whether the controller turns the drive in this mode.
    pub const fn moves(self) -> bool {
        matches!(self, Self::Run(..) | Self::Stopping(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_is_what_drives_neither_wheel_nor_pretightener() {
        let run = Mode::Run(Direction::Deploy, Leg::Settle);
        let stopping = Mode::Stopping(Direction::Retract);
        let preload = Mode::Preload(Direction::Deploy);
        assert!([run, stopping, preload, Mode::Service].iter().all(|mode| !mode.is_at_rest()));
        assert!(run.moves() && stopping.moves() && !preload.moves());
        assert!(!Mode::Service.moves());
        let held = Mode::FaultHold(Fault::TickOverrun);
        let complete = Mode::Complete(Direction::Deploy);
        for mode in [Mode::Boot, Mode::SelfTest, Mode::Zero, Mode::Idle, complete, held] {
            assert!(mode.is_at_rest() && !mode.moves(), "{mode:?}");
        }
    }
}
