//! The binary log of a run in software: the firmware's own encoder, so that one decoder
//! serves both.

use interstage::log::{Identity, LogEncoder, Record, identity};
use interstage::restart::Restart;
use interstage::tick::{Controller, Entry, Event, Input, Output};

use crate::scenario::Scenario;

/// The binary log of a run. Its channel is never full.
pub(crate) struct Stream {
    encoder: LogEncoder,
    bytes: Vec<u8>,
}

impl Stream {
    /// A log of this controller from its first tick on.
    pub(crate) fn new(scenario: &Scenario, controller: &Controller) -> Self {
        Self { encoder: LogEncoder::new(of(scenario, controller)), bytes: Vec::new() }
    }

    /// Keeps a tick and its events, as the journal task does on the board; drops them unless
    /// the log is read.
    pub(crate) fn keep(&mut self, input: &Input, output: &Output, read: bool) {
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

    /// The bytes since the last call, at the log's `end` with what is not sent yet.
    pub(crate) fn take(&mut self, end: bool) -> Vec<u8> {
        if end {
            self.encoder.flush(&mut into(&mut self.bytes));
        }
        std::mem::take(&mut self.bytes)
    }

    /// The controller restarts; what it had not sent is lost.
    pub(super) fn restart(&mut self, scenario: &Scenario, controller: &Controller) {
        let bytes = self.take(false);
        *self = Self { bytes, ..Self::new(scenario, controller) };
    }

    /// The controller reports why it has started, as the board does first.
    pub(super) fn report(&mut self, restart: Restart) {
        let entry = Entry { at: 0, event: Event::Restart(restart) };
        self.encoder.entry(&entry, &mut into(&mut self.bytes));
    }
}

/// Sends frames into these bytes.
fn into(bytes: &mut Vec<u8>) -> impl FnMut(&[u8]) -> bool {
    |frame| {
        bytes.extend_from_slice(frame);
        true
    }
}

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
