//! Modes, stages and commands as numbers of the log. The numbers are stable: none is ever given
//! a second meaning.

use super::{Command, Mode};
use crate::estimate::ContactStage;
use crate::fault::Fault;
use crate::units::Direction;

/// Number of a mode: its index in [`Mode::WITHOUT_FAULT`], or the code of the fault held, 101 to
/// 160. Called every tick, so it does not search.
pub const fn of_mode(mode: Mode) -> u8 {
    /// Modes of each direction.
    const OF_DIRECTION: u8 = 7;
    let (first, direction) = match mode {
        Mode::Boot => return 0,
        Mode::SelfTest => return 1,
        Mode::Zero => return 2,
        Mode::Idle => return 3,
        Mode::Preload(direction) => (4, direction),
        Mode::Run(direction, leg) => (5 + leg as u8, direction),
        Mode::Stopping(direction) => (9, direction),
        Mode::Complete(direction) => (10, direction),
        Mode::FaultHold(fault) => return fault.code() as u8,
        Mode::Service => return 4 + 2 * OF_DIRECTION,
    };
    if matches!(direction, Direction::Deploy) { first } else { first + OF_DIRECTION }
}

/// The mode of a number; none if the number has no meaning.
pub fn mode(number: u8) -> Option<Mode> {
    let held = || Fault::ALL.into_iter().find(|fault| fault.code() == u16::from(number));
    let plain = Mode::WITHOUT_FAULT.get(usize::from(number)).map(|(mode, _)| *mode);
    plain.or_else(|| held().map(Mode::FaultHold))
}

/// The contact stage of a number, 1 to 6.
pub fn stage(number: u8) -> Option<ContactStage> {
    ContactStage::ALL.into_iter().find(|stage| *stage as u8 == number)
}

/// Number of a command, from 1 in the order of [`Command::ALL`]; 0 for none.
pub const fn of_command(command: Option<Command>) -> u8 {
    match command {
        None => 0,
        Some(command) => command as u8 + 1,
    }
}

/// The command of a number; none for 0 and for what has no meaning.
pub fn command(number: u8) -> Option<Command> {
    Command::ALL.get(usize::from(number).checked_sub(1)?).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_has_its_number() {
        for known in Mode::all() {
            assert_eq!(mode(of_mode(known)), Some(known));
        }
        let places = Mode::WITHOUT_FAULT.map(|(mode, _)| of_mode(mode)).into_iter();
        assert!(places.eq(0..Mode::WITHOUT_FAULT.len() as u8));
        let known = (0..=u8::MAX).filter(|number| mode(*number).is_some()).count();
        assert_eq!(known, Mode::all().count());
    }

    #[test]
    fn stages_and_commands_have_theirs() {
        for known in ContactStage::ALL {
            assert_eq!(stage(known as u8), Some(known));
        }
        assert_eq!((stage(0), stage(7)), (None, None));
        for known in Command::ALL {
            assert_eq!(command(of_command(Some(known))), Some(known));
        }
        assert_eq!((of_command(None), command(0), command(5)), (0, None, None));
    }
}
