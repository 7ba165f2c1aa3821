//! The binary log of a run in software: the firmware's own encoder, so that one decoder
//! serves both.

use interstage::log::{Identity, LogEncoder, Record, identity};
use interstage::restart::Restart;
use interstage::tick::{Controller, Entry, Event, Input, Output};

use crate::scenario::Scenario;

/// The binary log as it grows. Its channel has room for everything.
pub struct Stream {
    encoder: LogEncoder,
    bytes: Vec<u8>,
}

impl Stream {
    /// A log of this controller from its first tick on.
    #[must_use]
    pub fn new(scenario: &Scenario, controller: &Controller) -> Self {
        Self { encoder: LogEncoder::new(of(scenario, controller)), bytes: Vec::new() }
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
        for entry in &output.events {
            self.encoder.entry(entry, &mut send);
        }
        if let Some(request) = &output.request {
            self.encoder.request(input.now, request, &mut send);
        }
        if let Some(plan) = &input.plan {
            self.encoder.plan(input.now, plan, &mut send);
        }
        self.encoder.tick(&Record::of(input, output), &mut send);
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
        self.encoder.entry(&entry, &mut |frame: &[u8]| {
            self.bytes.extend_from_slice(frame);
            true
        });
    }

    /// The rest of the log.
    #[must_use]
    pub fn finish(mut self) -> Vec<u8> {
        self.encoder.flush(&mut |frame: &[u8]| {
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
