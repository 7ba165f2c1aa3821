//! Exchanges ticks with the board over a port.

use std::time::Duration;

use interstage::hal::hil::{DOWN, FIRST, Given, PROTOCOL, Taken, ToBoard, ToHost, UP};
use interstage::params::link::{FrameReader, frame};
use interstage::units::Tick;

use super::HilError;
use crate::probe::{Port, exchange};

/// Time after which a request is repeated: well below the board's own timeout of 50 ms.
const RETRY: Duration = Duration::from_millis(10);
/// Longest time to an answer: a board that starts takes a fifth of a second.
const TIMEOUT: Duration = Duration::from_secs(2);

/// This host's end of the loop.
pub struct HostLine<'a> {
    port: &'a mut dyn Port,
    gatherer: FrameReader,
}

impl<'a> HostLine<'a> {
    /// Resets the board and waits until it is ready for its first tick.
    pub fn begin(port: &'a mut dyn Port) -> Result<Self, HilError> {
        port.reset()?;
        let mut line = Self::begin_at(port);
        match line.ask(&ToBoard::Hello { protocol: PROTOCOL }, |_| true)? {
            Some(ToHost::Next { tick: FIRST, alone: false }) => Ok(line),
            Some(ToHost::Next { tick, .. }) => Err(HilError::Apart { board: tick, host: FIRST }),
            Some(ToHost::Done(..)) | None => Err(HilError::NoAnswer),
        }
    }

    /// Continues with a board that runs already.
    pub const fn begin_at(port: &'a mut dyn Port) -> Self {
        Self { port, gatherer: FrameReader::new() }
    }

    pub fn tick(&mut self, tick: Tick, given: Given) -> Result<Taken, HilError> {
        let answers = |answer: &ToHost| !matches!(answer, ToHost::Done(done, _) if *done != tick);
        match self.ask(&ToBoard::Tick(tick, given), answers)? {
            Some(ToHost::Done(_, taken)) => Ok(taken),
            Some(ToHost::Next { tick, alone: true }) => Err(HilError::Alone(tick)),
            Some(ToHost::Next { tick: board, .. }) => Err(HilError::Apart { board, host: tick }),
            None => Err(HilError::Silent(tick)),
        }
    }

    /// Asks for the board's state: its next tick, and whether it has gone on alone.
    pub fn state(&mut self) -> Result<(Tick, bool), HilError> {
        let hello = ToBoard::Hello { protocol: PROTOCOL };
        match self.ask(&hello, |answer| matches!(answer, ToHost::Next { .. }))? {
            Some(ToHost::Next { tick, alone }) => Ok((tick, alone)),
            _ => Err(HilError::NoAnswer),
        }
    }

    /// The port, for its other channels.
    pub fn port(&mut self) -> &mut dyn Port {
        self.port
    }

    /// Repeats the request until its answer arrives; none if there is none in time.
    fn ask(
        &mut self,
        message: &ToBoard,
        answers: impl Fn(&ToHost) -> bool,
    ) -> Result<Option<ToHost>, HilError> {
        // Every message fits.
        let Some(bytes) = frame(message) else { return Ok(None) };
        let picked = |answer| answers(&answer).then_some(answer);
        let times = (RETRY, TIMEOUT);
        Ok(exchange(self.port, &mut self.gatherer, (DOWN, UP), &bytes, times, picked)?)
    }
}
