//! The line to the board with its log: what it does each millisecond, and what it is asked.

use std::time::Duration;

use interstage::log::Record;
use interstage::params::service::Request;
use interstage::supervise::{Mode, ServiceDuties};
use interstage::units::Duty;

use super::BringupError;
use crate::params::{Client, Held, Store, StoreError};
use crate::probe::{Port, PortError};
use crate::record::{Decoder, Item};

/// RTT channel of the binary log.
const LOG: u32 = 1;
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
    pub fn held(&mut self) -> Result<Held, StoreError> {
        self.client.held()
    }

    /// A word of memory or of a register.
    pub(super) fn word(&mut self, address: u32) -> Result<u32, BringupError> {
        let mut bytes = [0; 4];
        self.listener().memory(address, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Rows of so many milliseconds of the board; fewer if its log is silent. `each` is called
    /// meanwhile.
    pub(super) fn listen_and(
        &mut self,
        milliseconds: u32,
        mut each: impl FnMut(&mut Self) -> Result<(), BringupError>,
    ) -> Result<Vec<Record>, BringupError> {
        self.listener().rows.clear();
        let (mut heard, mut heard_at) = (0, self.listener().now());
        loop {
            self.listener().pass()?;
            each(self)?;
            let now = self.listener().now();
            let rows = &mut self.listener().rows;
            if rows.len() > heard {
                (heard, heard_at) = (rows.len(), now);
            }
            if heard >= milliseconds as usize || now.saturating_sub(heard_at) > SILENCE {
                return Ok(std::mem::take(rows));
            }
        }
    }

    /// The same from now on: what the channel has kept from before, as while somebody was asked,
    /// is not heard.
    pub(super) fn listen(&mut self, milliseconds: u32) -> Result<Vec<Record>, BringupError> {
        self.listener().pass()?;
        self.listen_and(milliseconds, |_| Ok(()))
    }

    /// The present mode; none while the log is silent.
    pub(super) fn mode(&mut self) -> Result<Option<Mode>, BringupError> {
        Ok(self.listen(2)?.last().map(|row| row.telemetry.mode))
    }

    /// Waits until a mode or a fault hold; returns the last mode.
    fn until(&mut self, wanted: Mode) -> Result<Option<Mode>, BringupError> {
        let mut last = None;
        for _ in 0..MODE_MS / 20 {
            last = self.listen(20)?.last().map(|row| row.telemetry.mode);
            let held = matches!(last, Some(Mode::FaultHold(_)));
            if last == Some(wanted) || held || last.is_none() {
                break;
            }
        }
        Ok(last)
    }

    /// Leaves service mode or fault hold; returns the mode, which is idle if all is well.
    pub(super) fn reset(&mut self) -> Result<Option<Mode>, BringupError> {
        // A fault hold lasts a tenth of a second at least.
        self.listen(150)?;
        self.client.ask(Request::Reset)?;
        self.listen(50)?;
        self.until(Mode::Idle)
    }

    /// Leaves the service mode if the board is in it, after a failure: as well as it goes.
    pub(super) fn leave(&mut self) {
        if matches!(self.mode(), Ok(Some(Mode::Service))) {
            let _ = self.reset();
        }
    }

    /// Waits until the board is idle, after a start by itself.
    pub(super) fn idle(&mut self) -> Result<Option<Mode>, BringupError> {
        self.until(Mode::Idle)
    }

    /// Asks for a motion, again and again, for so many milliseconds, and for rest afterwards.
    /// Ends early at a fault. `each` is called meanwhile.
    pub(super) fn move_and(
        &mut self,
        duties: ServiceDuties,
        milliseconds: u32,
        rest_ms: u32,
        mut each: impl FnMut(&mut Self) -> Result<(), BringupError>,
    ) -> Result<Motion, BringupError> {
        let mut rows = Vec::new();
        self.client.ask(Request::Service(ServiceDuties::REST))?;
        rows.extend(self.listen(20)?);
        let mut left = milliseconds;
        while left > 0 {
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
            rows.extend(self.listen_and(part.saturating_sub(spent), &mut each)?);
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
        self.move_and(duties, milliseconds, rest_ms, |_| Ok(()))
    }
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
