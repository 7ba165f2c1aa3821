//! Sources of a log.

use std::collections::VecDeque;
use std::io::Read;

use interstage::supervise::{Command, Mode};

use crate::scenario::{Direction, Scenario};
use crate::session::{self, RunningRig, Session};

#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The bytes of the input of this name cannot be read.
    #[error("{0}: {1}")]
    Read(String, std::io::Error),
    #[error(transparent)]
    Run(Box<dyn std::error::Error + Send + Sync>),
    #[error(transparent)]
    Port(#[from] crate::probe::PortError),
}

/// A source of the binary log.
pub trait Source {
    /// The bytes since the last call, possibly empty; none at the end.
    fn read(&mut self) -> Result<Option<Vec<u8>>, SourceError>;

    /// Sends a letter to the console; a source without a console drops it.
    fn send(&mut self, letter: u8) -> Result<(), SourceError>;

    /// Events of the connection since the last call, a line each.
    fn news(&mut self) -> Vec<String> {
        Vec::new()
    }
}

pub const fn letter(command: Command) -> u8 {
    match command {
        Command::Start => b's',
        Command::Stop => b'x',
        Command::Retract => b'r',
        Command::Reset => b'0',
    }
}

fn command(letter: u8) -> Option<Command> {
    Command::ALL.into_iter().find(|command| self::letter(*command) == letter)
}

/// The command that begins a run in this direction.
pub const fn starter(direction: Direction) -> Command {
    match direction {
        Direction::Deploy => Command::Start,
        Direction::Retract => Command::Retract,
    }
}

/// A recorded stream, or one from a pipe.
pub struct Bytes {
    name: String,
    input: Box<dyn Read + Send>,
}

impl Bytes {
    /// Reads from `input`, which is called `name`.
    pub(crate) fn new(name: String, input: Box<dyn Read + Send>) -> Self {
        Self { name, input }
    }
}

impl Source for Bytes {
    fn read(&mut self) -> Result<Option<Vec<u8>>, SourceError> {
        let mut bytes = vec![0; 1 << 16];
        let length = self.input.read(&mut bytes);
        let length = length.map_err(|error| SourceError::Read(self.name.clone(), error))?;
        bytes.truncate(length);
        Ok((length > 0).then_some(bytes))
    }

    fn send(&mut self, _: u8) -> Result<(), SourceError> {
        Ok(())
    }
}

/// Milliseconds that a virtual rig runs per call.
const TICKS: u32 = 20;

/// Milliseconds for which a run without an operator goes on after its end.
const AFTER: u32 = 100;

/// A virtual rig: the controller on this host or on the emulated board, in closed loop with the
/// plant.
pub struct Virtual<R> {
    rig: R,
    letters: VecDeque<u8>,
    /// Command as soon as the drive is idle; none if an operator commands.
    start: Option<Command>,
    attended: bool,
    /// Longest run without an operator, s.
    longest_s: f64,
    /// Ticks still logged after the end.
    left: u32,
}

impl Virtual<Session> {
    pub fn new(scenario: &Scenario, attended: bool) -> Result<Self, session::RunError> {
        let session = Session::new(scenario, session::Options::default())?;
        Ok(Self::of(session.logging(), scenario, attended))
    }
}

impl<R: RunningRig> Virtual<R> {
    /// A rig of this scenario. Unless an operator attends it, it starts by itself and ends when
    /// the drive has arrived.
    pub fn of(rig: R, scenario: &Scenario, attended: bool) -> Self {
        Self {
            rig,
            letters: VecDeque::new(),
            start: (!attended).then(|| starter(scenario.run.direction)),
            attended,
            longest_s: session::longest_s(&scenario.rig),
            left: AFTER,
        }
    }

    /// Runs a millisecond; false if the run is over.
    fn tick(&mut self) -> Result<bool, R::Error> {
        let over = session::is_over(self.rig.mode()) || self.rig.time_s() >= self.longest_s;
        if !self.attended && over {
            self.left = self.left.saturating_sub(1);
        }
        if self.left == 0 {
            return Ok(false);
        }
        let typed = self.letters.pop_front().and_then(command);
        let idle = self.rig.mode() == Mode::Idle;
        let command = typed.or_else(|| if idle { self.start.take() } else { None });
        self.rig.step(command)?;
        Ok(true)
    }
}

impl<R: RunningRig<Error: std::error::Error + Send + Sync + 'static>> Source for Virtual<R> {
    fn read(&mut self) -> Result<Option<Vec<u8>>, SourceError> {
        for _ in 0..TICKS {
            if !self.tick().map_err(|error| SourceError::Run(Box::new(error)))? {
                let rest = self.rig.take_log(true);
                return Ok((!rest.is_empty()).then_some(rest));
            }
        }
        Ok(Some(self.rig.take_log(false)))
    }

    fn send(&mut self, letter: u8) -> Result<(), SourceError> {
        self.letters.push_back(letter);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Run;

    #[test]
    fn rows_that_nobody_reads_are_not_kept() {
        let mut source = Virtual::new(&Scenario::default(), true).unwrap();
        (0..100).for_each(|_| assert!(!source.read().unwrap().unwrap().is_empty()));
        assert!(source.rig.finish(1.0).rows.is_empty());
    }

    #[test]
    fn an_operator_starts_and_stops() {
        let mut source = Virtual::new(&Scenario::default(), true).unwrap();
        let mut bytes = Vec::new();
        for round in 0..200 {
            match round {
                100 => source.send(letter(Command::Start)).unwrap(),
                190 => source.send(letter(Command::Stop)).unwrap(),
                _ => {}
            }
            bytes.extend(source.read().unwrap().unwrap());
        }
        let run = Run::of_stream(&bytes);
        let commands: Vec<u8> =
            run.rows.iter().map(|row| row.command).filter(|command| *command > 0).collect();
        assert_eq!(commands, [1, 2]);
    }
}
