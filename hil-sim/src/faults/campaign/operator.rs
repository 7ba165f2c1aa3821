//! The operator of a run: deploys and, after arrival, retracts.

use interstage::supervise::{Command, Mode};
use interstage::units::Direction;

/// Ticks that the drive rests at the far end.
const DWELL_TICKS: u32 = 100;

/// The operator.
#[derive(Clone, Debug, Default)]
pub struct Operator {
    started: bool,
    turned: bool,
    rested: u32,
}

impl Operator {
    /// The command of a tick in which the drive is in this mode.
    pub fn command(&mut self, mode: Mode) -> Option<Command> {
        if mode == Mode::Idle && !self.started {
            self.started = true;
            return Some(if self.turned { Command::Retract } else { Command::Start });
        }
        if mode == Mode::Complete(Direction::Deploy) && !self.turned {
            self.rested += 1;
            if self.rested > DWELL_TICKS {
                self.turned = true;
                return Some(Command::Retract);
            }
        }
        None
    }

    /// The controller has restarted: the last command is given again.
    pub const fn press_again(&mut self) {
        self.started = false;
    }

    /// Whether the run has been started.
    pub const fn started(&self) -> bool {
        self.started
    }

    /// Whether it is over: at rest, and no further command comes.
    pub fn over(&self, mode: Mode) -> bool {
        self.started
            && mode.is_at_rest()
            && (mode != Mode::Complete(Direction::Deploy) || self.turned)
    }
}
