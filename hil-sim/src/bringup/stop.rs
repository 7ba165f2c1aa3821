//! The emergency stop, pressed, and the bridges while the board is in reset.

use interstage::log::Flags;
use interstage::supervise::Mode;

use super::{Action, BringupError, Check, Question, Row, Seen, Session, row};

/// Emergency stop and reset.
pub(super) fn run(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    session.operator.act(Action::PressStop)?;
    let rows = session.line.listen(100)?;
    let seen = rows.iter().any(|row| row.flags.has(Flags::EMERGENCY));
    let supplied = session.operator.look(Question::Supplied)?;
    session.operator.act(Action::ReleaseStop)?;
    let measured = if seen { "fault 151" } else { "no fault" };
    let mut checks = vec![row::STOP_PRESSED.check(
        seen,
        measured.to_owned(),
        "the board does not see the emergency stop: its line is shorted to ground, or the contact \
         is bridged. PB12 and PB7 must be at 3.3 V while it is pressed",
    )];
    checks.push(nothing_seen(
        &row::STOP_CUTS_SUPPLY,
        supplied,
        ["no supply", "the motors keep their supply"],
        "the emergency stop's second contact does not cut the motors' supply: put it in series with \
         the supply's plus",
    ));
    if checks.iter().any(|check| !check.ok) {
        return Ok(checks);
    }
    session.operator.act(Action::HoldReset)?;
    let moved = session.operator.look(Question::MovedInReset)?;
    checks.push(nothing_seen(
        &row::HELD_IN_RESET,
        moved,
        ["no voltage", "voltage, or motion"],
        "a pull-down of 3.3 kOhm at a bridge's PWM or enable line is missing (PA8, PA10, PC6, PC9): \
         that of the bridge with voltage",
    ));
    // What was found stays, whatever the probe finds of the board after its reset.
    if let Err(error) = back(session) {
        (session.say)(&format!("  after the reset: {error}"));
    }
    Ok(checks)
}

/// A check in which nothing must be seen: what is measured if so, and if not.
fn nothing_seen(row: &Row, seen: Seen, [nothing, yes]: [&str; 2], advice: &str) -> Check {
    let (measured, advice) = match seen {
        Seen::Nothing => (nothing, ""),
        Seen::Yes => (yes, advice),
        _ => ("not observed", "nobody looked; run again and answer"),
    };
    row.check(seen == Seen::Nothing, measured.to_owned(), advice)
}

/// Waits until the board is idle. The reset has left the fault hold as well.
fn back(session: &mut Session<'_, '_>) -> Result<(), BringupError> {
    session.line.idle()?;
    if session.line.mode()? != Some(Mode::Idle) {
        session.line.reset()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_seen_is_what_is_said() {
        for (seen, says) in [(Seen::Nothing, ("none", true)), (Seen::Yes, ("some", false))] {
            let check = nothing_seen(&row::HELD_IN_RESET, seen, ["none", "some"], "look");
            assert_eq!((&*check.measured, check.ok), says);
        }
    }
}
