//! The emergency stop, pressed, and the bridges while the board is in reset.

use interstage::log::Flags;
use interstage::supervise::Mode;

use super::{Action, BringupError, Check, Question, Seen, Session, check};

const NOBODY_LOOKED: &str = "nobody looked; run again and answer";

/// Emergency stop and reset.
pub(super) fn run(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    session.operator.act(Action::PressStop)?;
    let rows = session.line.listen(100)?;
    let seen = rows.iter().any(|row| row.flags.has(Flags::EMERGENCY));
    let supplied = session.operator.look(Question::Supplied)?;
    session.operator.act(Action::ReleaseStop)?;
    let measured = if seen { "fault 151" } else { "no fault" };
    let mut checks = vec![check(
        "stop pressed",
        seen,
        measured.to_owned(),
        "the board does not see the emergency stop: its line is shorted to ground, or the contact \
         is bridged. PB12 and PB7 must be at 3.3 V while it is pressed",
    )];
    let (measured, advice) = match supplied {
        Seen::Yes => (
            "the motors keep their supply",
            "the emergency stop's second contact does not cut the motors' supply: put it in series \
             with the supply's plus",
        ),
        Seen::Nothing => ("no supply", ""),
        _ => ("not observed", NOBODY_LOOKED),
    };
    let good = supplied == Seen::Nothing;
    checks.push(check("stop cuts supply", good, measured.to_owned(), advice));
    if checks.iter().any(|check| !check.ok) {
        return Ok(checks);
    }
    session.operator.act(Action::HoldReset)?;
    let moved = session.operator.look(Question::MovedInReset)?;
    let (measured, advice) = match moved {
        Seen::Nothing => ("nothing moved", ""),
        Seen::Yes => (
            "something moved",
            "a pull-down of 4.7 kOhm at a bridge's PWM or enable line is missing (PA8, PA10, PC6, \
             PC9): the one whose motor moved",
        ),
        _ => ("not observed", NOBODY_LOOKED),
    };
    let good = moved == Seen::Nothing;
    checks.push(check("held in reset", good, measured.to_owned(), advice));
    // What was found stays, whatever the probe finds of the board after its reset.
    if let Err(error) = back(session) {
        (session.say)(&format!("  after the reset: {error}"));
    }
    Ok(checks)
}

/// Waits until the board is idle. The reset has left the fault hold as well.
fn back(session: &mut Session<'_, '_>) -> Result<(), BringupError> {
    session.line.idle()?;
    if session.line.mode()? != Some(Mode::Idle) {
        session.line.reset()?;
    }
    Ok(())
}
