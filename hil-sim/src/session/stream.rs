//! The binary log of a run in software: the firmware's own tape and scribe, so that one
//! decoder serves both.

use interstage::log::{BATCH, Identity, LogEncoder, Tape, identity};
use interstage::restart::Restart;
use interstage::tick::{Controller, Entry, Event, Input, Output};

use crate::scenario::Scenario;

/// The binary log as it grows. Its channel has room for everything.
pub struct Stream {
    tape: Tape,
    scribe: LogEncoder,
    bytes: Vec<u8>,
}

impl Stream {
    /// A log of this controller from its first tick on.
    #[must_use]
    pub fn new(scenario: &Scenario, controller: &Controller) -> Self {
        let scribe = LogEncoder::new(of(scenario, controller));
        Self { tape: Tape::new(), scribe, bytes: Vec::new() }
    }

    /// Keeps a tick and what happened in it, as the journal does on the board, if it is
    /// read.
    pub fn keep(&mut self, input: &Input, output: &Output, read: bool) {
        let mut send = |frame: &[u8]| {
            if read {
                self.bytes.extend_from_slice(frame);
            }
            read
        };
        self.tape.keep(input, output);
        for entry in &output.events {
            self.scribe.entry(entry, &mut send);
        }
        if self.tape.unread() >= BATCH {
            self.scribe.read(&self.tape, &mut send);
        }
    }

    /// What has come since the last call.
    pub fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }

    /// The controller restarts; what it had not yet sent is lost.
    pub(super) fn restart(&mut self, scenario: &Scenario, controller: &Controller) {
        let bytes = self.take();
        *self = Self { bytes, ..Self::new(scenario, controller) };
    }

    /// The controller reports why it has started, as the board does first of all.
    pub(super) fn report(&mut self, restart: Restart) {
        let entry = Entry { at: 0, event: Event::Restart(restart) };
        self.scribe.entry(&entry, &mut |frame: &[u8]| {
            self.bytes.extend_from_slice(frame);
            true
        });
    }

    /// The rest of the log.
    #[must_use]
    pub fn finish(mut self) -> Vec<u8> {
        self.scribe.read(&self.tape, &mut |frame: &[u8]| {
            self.bytes.extend_from_slice(frame);
            true
        });
        self.bytes
    }
}

/// The identity of the controller on this host.
fn of(scenario: &Scenario, controller: &Controller) -> Identity {
    Identity {
        schema: identity::SCHEMA,
        version: identity::text(env!("CARGO_PKG_VERSION")),
        build: [0; 8],
        rig: identity::text(&scenario.preset),
        parameters: identity::fingerprint(&scenario.rig),
        calibration: identity::fingerprint(&scenario.rig.sense),
        corner: controller.corner_reach(),
    }
}
