//! Modes of the drive, and the operator's commands.

use crate::fault::Fault;
use crate::units::Direction;

/// An operator's command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Command {
    /// Deploy from where the wheel is.
    Start,
    /// Come to rest and hold.
    Stop,
    /// Retract from where the wheel is.
    Retract,
    /// Leave the fault hold, or zero the sensors again when idle at the stow end.
    Reset,
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

impl Command {
    /// Every command.
    pub const ALL: [Self; 4] = [Self::Start, Self::Stop, Self::Retract, Self::Reset];

    /// Its name, as the logs have it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Stop => "stop",
            Self::Retract => "retract",
            Self::Reset => "reset",
        }
    }
}

impl Mode {
    /// Every mode but the fault holds, of which there is one per [`Fault`].
    pub const WITHOUT_FAULT: [Self; 19] = {
        use Direction::{Deploy, Retract};
        use Leg::{Approach, Crossing, Cruise, Settle};
        [
            Self::Boot,
            Self::SelfTest,
            Self::Zero,
            Self::Idle,
            Self::Preload(Deploy),
            Self::Run(Deploy, Cruise),
            Self::Run(Deploy, Approach),
            Self::Run(Deploy, Crossing),
            Self::Run(Deploy, Settle),
            Self::Stopping(Deploy),
            Self::Complete(Deploy),
            Self::Preload(Retract),
            Self::Run(Retract, Cruise),
            Self::Run(Retract, Approach),
            Self::Run(Retract, Crossing),
            Self::Run(Retract, Settle),
            Self::Stopping(Retract),
            Self::Complete(Retract),
            Self::Service,
        ]
    };

    /// Every mode.
    #[cfg(test)]
    pub(super) fn all() -> impl Iterator<Item = Self> {
        Self::WITHOUT_FAULT.into_iter().chain(Fault::ALL.map(Self::FaultHold))
    }

    /// The mode in words, as the logs have it.
    pub const fn words(self) -> &'static str {
        use Direction::{Deploy, Retract};
        match self {
            Self::Boot => "boot",
            Self::SelfTest => "self-test",
            Self::Zero => "zeroing",
            Self::Idle => "idle",
            Self::Preload(Deploy) => "preloading to deploy",
            Self::Preload(Retract) => "preloading to retract",
            Self::Run(Deploy, Leg::Cruise) => "deploying: cruise",
            Self::Run(Deploy, Leg::Approach) => "deploying: approach",
            Self::Run(Deploy, Leg::Crossing) => "deploying: crossing",
            Self::Run(Deploy, Leg::Settle) => "deploying: settle",
            Self::Run(Retract, Leg::Cruise) => "retracting: cruise",
            Self::Run(Retract, Leg::Approach) => "retracting: approach",
            Self::Run(Retract, Leg::Crossing) => "retracting: crossing",
            Self::Run(Retract, Leg::Settle) => "retracting: settle",
            Self::Stopping(Deploy) => "stopping while deploying",
            Self::Stopping(Retract) => "stopping while retracting",
            Self::Complete(Deploy) => "deployed",
            Self::Complete(Retract) => "retracted",
            Self::FaultHold(_) => "fault hold",
            Self::Service => "service",
        }
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
