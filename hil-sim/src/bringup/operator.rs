//! What only a person at the rig can do, see or allow.

use std::fmt;
use std::io::{BufRead, Write};

use interstage::sense::raw::SensorId;

use super::BringupError;

pub(super) const fn name(sensor: SensorId) -> &'static str {
    SensorId::NAMES[sensor as usize]
}

/// What a hand is asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Switch the motor supply on, its current limit low.
    SwitchOn,
    /// Press the emergency stop and hold it.
    PressStop,
    ReleaseStop,
    Unplug(SensorId),
    /// Plug it in again.
    Plug(SensorId),
    /// Rest the carriage on its stop and hold the wheel off the wall by a block.
    Block,
    /// Take the block out: the wheel touches the wall.
    SetDown,
    /// Rest the carriage on its stop and lift the wheel off the wall.
    LiftOff,
    /// Take off the weight or the gauge.
    TakeOff(SensorId),
    /// Hold the board's reset button for two seconds.
    HoldReset,
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SwitchOn => f.write_str(
                "Switch the motor supply on, with a low current limit. Nothing may move.",
            ),
            Self::PressStop => f.write_str("Press the emergency stop and leave it pressed."),
            Self::ReleaseStop => f.write_str("Release the emergency stop."),
            Self::Unplug(sensor) => write!(f, "Unplug the {}.", name(*sensor)),
            Self::Plug(sensor) => write!(f, "Plug the {} in again.", name(*sensor)),
            Self::Block => f.write_str(
                "Carriage on its stop: hold the arm off by a block, the wheel clear of the wall.",
            ),
            Self::SetDown => f.write_str(
                "No block under the arm: turn the screw by hand until the wheel touches the wall.",
            ),
            Self::LiftOff => f.write_str(
                "Carriage on its stop: turn the screw back by hand until the wheel is clear of the wall.",
            ),
            Self::TakeOff(sensor) => write!(f, "Take that off the {} again.", name(*sensor)),
            Self::HoldReset => f.write_str("Hold the board's reset button for 2 s."),
        }
    }
}

/// What an eye is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// How the wheel turned in the last motion.
    Turned,
    /// Whether the motors have their supply.
    Supplied,
    /// How the wheel or the screw moved while the reset button was held.
    MovedInReset,
}

impl Question {
    /// The answers with the letters that stand for them.
    pub(crate) const fn answers(self) -> &'static [(char, Seen)] {
        match self {
            Self::Turned => &[('o', Seen::Outwards), ('i', Seen::Inwards), ('n', Seen::Nothing)],
            Self::Supplied => &[('y', Seen::Yes), ('n', Seen::Nothing)],
            Self::MovedInReset => &[('y', Seen::Yes), ('n', Seen::Nothing)],
        }
    }
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Turned => {
                "Which way did the wheel turn: outwards as to deploy, inwards, or not (o/i/n)?"
            }
            Self::Supplied => {
                "Emergency stop pressed for 5 s: do the bridges' supply pins have 3 V or more (y/n)?"
            }
            Self::MovedInReset => "Had an output of a bridge voltage meanwhile, or did anything move (y/n)?",
        })
    }
}

/// What an eye has seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// The wheel turned as to deploy.
    Outwards,
    /// It turned as to retract.
    Inwards,
    Yes,
    /// No, or nothing.
    Nothing,
    /// Nobody looked.
    Unknown,
}

/// The person at the rig.
pub trait Operator {
    /// Allows a motion.
    fn confirm(&mut self, motion: &str) -> Result<(), BringupError>;

    /// Does something at the rig; returns when it is done.
    fn act(&mut self, action: Action) -> Result<(), BringupError>;

    /// Looks at the rig.
    fn look(&mut self, question: Question) -> Result<Seen, BringupError>;

    /// Puts the first or second weight, N, or gauge, mm, at a sensor; returns what is written on
    /// it.
    fn put(&mut self, sensor: SensorId, is_second: bool) -> Result<f64, BringupError>;
}

/// A person at the terminal, or the lines of a script.
pub struct Stdin<R, W> {
    input: R,
    prompts: W,
    /// Allows every motion unasked.
    yes: bool,
}

impl<R: BufRead, W: Write> Stdin<R, W> {
    /// Answers from `input` to prompts at `prompts`; with `yes` motions are not asked for.
    pub const fn new(input: R, prompts: W, yes: bool) -> Self {
        Self { input, prompts, yes }
    }

    /// The next line, lower case.
    fn ask(&mut self, prompt: &str) -> Result<String, BringupError> {
        // A prompt that nobody reads is not answered either.
        let _ = write!(self.prompts, "{prompt} ");
        let _ = self.prompts.flush();
        let mut line = String::new();
        match self.input.read_line(&mut line) {
            Ok(1..) => Ok(line.trim().to_lowercase()),
            _ => {
                let _ = writeln!(self.prompts);
                Err(BringupError::NoAnswer(prompt.to_owned()))
            }
        }
    }
}

impl<R: BufRead, W: Write> Operator for Stdin<R, W> {
    fn confirm(&mut self, motion: &str) -> Result<(), BringupError> {
        if self.yes {
            return Ok(());
        }
        match self.ask(&format!("{motion} Go on (y/n)?")) {
            Ok(answer) if answer.starts_with('y') => Ok(()),
            _ => Err(BringupError::Declined(motion.to_owned())),
        }
    }

    fn act(&mut self, action: Action) -> Result<(), BringupError> {
        self.ask(&format!("{action} Then Enter.")).map(|_| ())
    }

    fn look(&mut self, question: Question) -> Result<Seen, BringupError> {
        let answer = self.ask(&question.to_string())?;
        let first = answer.chars().next();
        let seen = question.answers().iter().find(|(letter, _)| Some(*letter) == first);
        Ok(seen.map_or(Seen::Unknown, |(_, seen)| *seen))
    }

    fn put(&mut self, sensor: SensorId, is_second: bool) -> Result<f64, BringupError> {
        let which = if is_second { "second, twice the first or more" } else { "first" };
        let prompt = match sensor {
            SensorId::PreloadSensor => {
                "Hang a weight on the wheel, which pulls as the wall presses. Its N"
            }
            _ => "Put a gauge under the compression sensor. Its mm",
        };
        loop {
            let answer = self.ask(&format!("{prompt} (the {which})?"))?.replace(',', ".");
            if let Some(value) = answer.parse().ok().filter(|v: &f64| v.is_finite() && *v > 0.0) {
                return Ok(value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_answers_and_its_end_allows_nothing() {
        let mut script = Stdin::new(&b"y\n\no\nn\n2 kg\n19,6\nno\n"[..], Vec::new(), false);
        assert!(script.confirm("The wheel turns.").is_ok());
        assert!(script.act(Action::PressStop).is_ok());
        assert_eq!(script.look(Question::Turned).unwrap(), Seen::Outwards);
        assert_eq!(script.look(Question::Supplied).unwrap(), Seen::Nothing);
        assert_eq!(script.put(SensorId::PreloadSensor, false).unwrap(), 19.6);
        assert!(matches!(script.confirm("Again."), Err(BringupError::Declined(_))));
        assert!(matches!(script.confirm("Again."), Err(BringupError::Declined(_))));
        assert!(matches!(script.act(Action::ReleaseStop), Err(BringupError::NoAnswer(_))));
    }
}
