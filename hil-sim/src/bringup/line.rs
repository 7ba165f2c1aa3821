//! The line to the board with its log: what it does each millisecond, and what it is asked.

use std::ops::ControlFlow;
use std::time::Duration;

use interstage::log::Record;
use interstage::params::service::Request;
use interstage::supervise::{Command, Mode, ServiceDuties};
use interstage::units::Duty;

use super::BringupError;
use crate::params::{Client, Held, Store, StoreError};
use crate::probe::{CONSOLE, LOG, Port, PortError};
use crate::record::{Decoder, Item, letter};

/// Time after which a request is repeated, ms of the board: a quarter of the firmware's dead
/// man.
const REPEAT_MS: u32 = 50;
/// Longest wait for a mode, ms: boot, self-test and zero take less.
const MODE_MS: u32 = 8000;
/// Longest silence of the log, host's time.
const SILENCE: Duration = Duration::from_secs(4);

/// The port with what its log has brought.
struct Listener<'p> {
    port: &'p mut dyn Port,
    decoder: Decoder,
    rows: Vec<Record>,
}

/// Reads the log whenever the board runs on.
impl Port for Listener<'_> {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        self.port.up(channel)
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        self.port.down(channel, bytes)
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.port.reset()
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.port.memory(address, into)
    }

    fn pass(&mut self) -> Result<(), PortError> {
        self.port.pass()?;
        let bytes = self.port.up(LOG)?;
        let rows = &mut self.rows;
        self.decoder.read(&bytes, &mut |item| {
            if let Item::Tick(record, _) = item {
                rows.push(record);
            }
        });
        Ok(())
    }

    fn now(&self) -> Duration {
        self.port.now()
    }
}

/// A motion in the service mode.
#[derive(Clone, Debug, Default)]
pub(super) struct Motion {
    /// Rows from the request to the time at which all is at rest again.
    pub rows: Vec<Record>,
    /// Mode after it.
    pub mode: Mode,
}

pub struct Line<'p> {
    client: Client<Listener<'p>>,
}

impl<'p> Line<'p> {
    /// Over this port.
    pub fn new(port: &'p mut dyn Port) -> Self {
        let listener = Listener { port, decoder: Decoder::new(), rows: Vec::new() };
        Self { client: Client::new(listener) }
    }

    fn listener(&mut self) -> &mut Listener<'p> {
        self.client.port_mut()
    }

    /// The parameters on the board.
    pub(crate) fn held(&mut self) -> Result<Held, StoreError> {
        self.client.held()
    }

    /// A word of memory or of a register.
    pub(super) fn word(&mut self, address: u32) -> Result<u32, BringupError> {
        let mut bytes = [0; 4];
        self.listener().memory(address, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Rows of so many milliseconds of the board; fewer if its log is silent, or if `each`, which
    /// is called meanwhile, breaks it off.
    fn listen_and(
        &mut self,
        milliseconds: u32,
        mut each: impl FnMut(&mut Self) -> Result<ControlFlow<()>, BringupError>,
    ) -> Result<Vec<Record>, BringupError> {
        self.listener().rows.clear();
        let (mut heard, mut heard_at) = (0, self.listener().now());
        loop {
            self.listener().pass()?;
            let flow = each(self)?;
            let now = self.listener().now();
            let rows = &mut self.listener().rows;
            if rows.len() > heard {
                (heard, heard_at) = (rows.len(), now);
            }
            let is_silent = now.saturating_sub(heard_at) > SILENCE;
            if heard >= milliseconds as usize || is_silent || flow.is_break() {
                return Ok(std::mem::take(rows));
            }
        }
    }

    /// The same from now on: what the channel has kept from before, as while somebody was asked,
    /// is not heard.
    pub(super) fn listen(&mut self, milliseconds: u32) -> Result<Vec<Record>, BringupError> {
        self.listener().pass()?;
        self.listen_and(milliseconds, |_| Ok(ControlFlow::Continue(())))
    }

    /// The present mode; none while the log is silent.
    pub(super) fn mode(&mut self) -> Result<Option<Mode>, BringupError> {
        Ok(mode_of(&self.listen(2)?))
    }

    /// Waits until it is idle, holds a fault or is silent; returns the rows until then.
    fn rest(&mut self) -> Result<Vec<Record>, BringupError> {
        let mut rows = Vec::new();
        for _ in 0..MODE_MS / 20 {
            let heard = self.listen(20)?;
            let last = heard.last().map(|row| row.telemetry.mode);
            rows.extend(heard);
            if matches!(last, None | Some(Mode::Idle | Mode::FaultHold(_))) {
                break;
            }
        }
        Ok(rows)
    }

    /// Resets the controller; returns the rows until it is idle or holds a fault.
    pub(super) fn reset_rows(&mut self) -> Result<Vec<Record>, BringupError> {
        // A fault hold lasts a tenth of a second at least.
        let mut rows = self.listen(150)?;
        self.client.ask(Request::Reset)?;
        rows.extend(self.listen(50)?);
        rows.extend(self.rest()?);
        Ok(rows)
    }

    /// Leaves service mode or fault hold; returns the mode, which is idle if all is well.
    pub(super) fn reset(&mut self) -> Result<Option<Mode>, BringupError> {
        Ok(mode_of(&self.reset_rows()?))
    }

    /// Sends an operator's command.
    pub(super) fn command(&mut self, command: Command) -> Result<(), BringupError> {
        let since = self.listener().now();
        while self.listener().down(CONSOLE, &[letter(command)])? == 0 {
            if self.listener().now().saturating_sub(since) > SILENCE {
                return Err(silent());
            }
            self.listener().pass()?;
        }
        Ok(())
    }

    /// Leaves the service mode if the board is in it, after a failure: as well as it goes.
    pub(super) fn leave(&mut self) {
        if matches!(self.mode(), Ok(Some(Mode::Service))) {
            let _ = self.reset();
        }
    }

    /// Waits until the board is idle, after a start by itself.
    pub(super) fn idle(&mut self) -> Result<Option<Mode>, BringupError> {
        Ok(mode_of(&self.rest()?))
    }

    /// The mode once the board has started.
    pub(super) fn started(&mut self) -> Result<Mode, BringupError> {
        let mode = match self.mode()? {
            Some(Mode::Boot | Mode::SelfTest | Mode::Zero) => self.idle()?,
            mode => mode,
        };
        mode.ok_or_else(silent)
    }

    /// What was heard in the present wait.
    pub(super) fn heard(&mut self) -> &[Record] {
        &self.listener().rows
    }

    /// Asks for a motion, again and again, for so many milliseconds, and for rest afterwards.
    /// Ends early at a fault, or when `each`, which is called meanwhile, breaks it off.
    pub(super) fn move_and(
        &mut self,
        duties: ServiceDuties,
        milliseconds: u32,
        rest_ms: u32,
        mut each: impl FnMut(&mut Self) -> Result<ControlFlow<()>, BringupError>,
    ) -> Result<Motion, BringupError> {
        let mut rows = Vec::new();
        self.client.ask(Request::Service(ServiceDuties::REST))?;
        rows.extend(self.listen(20)?);
        let (mut left, mut is_over) = (milliseconds, false);
        while left > 0 && !is_over {
            let part = left.min(REPEAT_MS);
            self.listener().rows.clear();
            match self.client.ask(Request::Service(duties)) {
                // A fault has ended it.
                Err(StoreError::Refused(_)) => break,
                other => other?,
            };
            let asked = std::mem::take(&mut self.listener().rows);
            let spent = asked.len() as u32;
            rows.extend(asked);
            rows.extend(self.listen_and(part.saturating_sub(spent), |line| {
                let flow = each(line)?;
                is_over = flow.is_break();
                Ok(flow)
            })?);
            left -= part;
        }
        self.listener().rows.clear();
        match self.client.ask(Request::Service(ServiceDuties::REST)) {
            Ok(_) | Err(StoreError::Refused(_)) => {}
            Err(error) => return Err(error.into()),
        }
        rows.append(&mut self.listener().rows);
        rows.extend(self.listen(rest_ms.max(1))?);
        let mode = rows.last().map(|row| row.telemetry.mode).unwrap_or_default();
        Ok(Motion { rows, mode })
    }

    pub(super) fn moved(
        &mut self,
        duties: ServiceDuties,
        milliseconds: u32,
        rest_ms: u32,
    ) -> Result<Motion, BringupError> {
        self.move_and(duties, milliseconds, rest_ms, |_| Ok(ControlFlow::Continue(())))
    }
}

/// The log has brought nothing.
pub(super) fn silent() -> BringupError {
    StoreError::Silent { seconds: SILENCE.as_secs_f64() }.into()
}

fn mode_of(rows: &[Record]) -> Option<Mode> {
    rows.last().map(|row| row.telemetry.mode)
}

fn duty(part: f64) -> Duty {
    Duty::from_bits((part * 32_768.0) as i16)
}

pub(super) fn drive(part: f64) -> ServiceDuties {
    ServiceDuties { drive: duty(part), ..ServiceDuties::REST }
}

/// A duty of the pre-tightener.
pub(super) fn press(part: f64) -> ServiceDuties {
    ServiceDuties { pretightener: duty(part), ..ServiceDuties::REST }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::Mute;

    #[test]
    fn a_slow_probe_does_not_stretch_the_wait_for_a_silent_log() {
        let mut port = Mute::new();
        let rows = Line::new(&mut port).listen(10).expect("a silent log is no failure");
        assert!(rows.is_empty());
        assert!(port.now() < SILENCE + Duration::from_millis(20), "{:?}", port.now());
    }
}
