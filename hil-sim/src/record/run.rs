//! A log in memory.

use interstage::log::Identity;
use interstage::log::capture::CaptureChunk;
use interstage::log::ledger::Line;
use interstage::model::{Plan, PlanRequest};
use interstage::restart::Restart;
use interstage::tick::{Entry, Event};
use serde::{Deserialize, Serialize};

use super::{Controller, Counts, Decoder, Item, Mark};

/// Firmware and parameters that made a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Layout of the frames.
    pub schema: u16,
    /// Version of the firmware.
    pub version: String,
    /// Hash of its image, hexadecimal; zeros on a host.
    pub build: String,
    /// Name of the rig.
    pub rig: String,
    /// CRC-32 of the rig's parameters, hexadecimal.
    pub parameters: String,
    /// CRC-32 of its sensors' parameters, hexadecimal.
    pub calibration: String,
    /// Travel of the wheel over a corner, mm.
    pub corner_mm: f64,
}

impl From<&Identity> for Header {
    fn from(identity: &Identity) -> Self {
        Self {
            schema: identity.schema,
            version: identity.version.as_str().to_owned(),
            build: identity.build.iter().map(|byte| format!("{byte:02x}")).collect(),
            rig: identity.rig.as_str().to_owned(),
            parameters: format!("{:08x}", identity.parameters),
            calibration: format!("{:08x}", identity.calibration),
            corner_mm: identity.corner.to_num(),
        }
    }
}

/// Numbers of items before a start of the target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Boot {
    /// Events.
    pub events: usize,
    /// Plans.
    pub plans: usize,
    /// Requests.
    pub requests: usize,
}

/// Items from one start of the target to the next.
#[derive(Clone, Copy, Debug)]
pub struct Since<'a> {
    /// Events.
    pub events: &'a [Entry],
    /// Plans with the ticks that received them.
    pub plans: &'a [(u32, Plan)],
    /// Requests with the ticks that made them.
    pub requests: &'a [(u32, PlanRequest)],
}

impl Since<'_> {
    /// Why the target started, if the log has it.
    #[must_use]
    pub fn restart(&self) -> Option<Restart> {
        self.events.iter().find_map(|entry| match entry.event {
            Event::Restart(restart) => Some(restart),
            _ => None,
        })
    }
}

/// A log in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Its header; none if the log has no identity.
    pub header: Option<Header>,
    /// A row a tick, in the order of the log.
    pub rows: Vec<Controller>,
    /// Events.
    pub events: Vec<Entry>,
    /// Plans with the ticks that received them.
    pub plans: Vec<(u32, Plan)>,
    /// Requests with the ticks that made them.
    pub requests: Vec<(u32, PlanRequest)>,
    /// Lines of the ledger.
    pub ledger: Vec<Line>,
    /// Parts of captures.
    pub captures: Vec<CaptureChunk>,
    /// Each start after the first.
    pub boots: Vec<Boot>,
    /// Marks with the row that each precedes.
    pub marks: Vec<(usize, Mark)>,
    /// Counts of what was read and what is missing.
    pub counts: Counts,
    /// The rig's parameters as TOML, if the file has them.
    pub parameters: Option<String>,
}

impl Run {
    /// Reads the bytes of the binary channel.
    #[must_use]
    pub fn of_stream(bytes: &[u8]) -> Self {
        let (mut decoder, mut run) = (Decoder::new(), Self::default());
        decoder.read(bytes, &mut |item| run.add(&item));
        decoder.finish(&mut |item| run.add(&item));
        run.counts = *decoder.counts();
        run
    }

    /// Adds an item.
    pub fn add(&mut self, item: &Item) {
        match item {
            Item::Identity(identity) => self.header = Some(identity.into()),
            Item::Tick(record, sensors) => self.rows.push(Controller::of(record, sensors)),
            Item::Plan(at, plan) => self.plans.push((*at, *plan)),
            Item::Request(at, request) => self.requests.push((*at, *request)),
            Item::Event(entry) => self.events.push(*entry),
            Item::CaptureChunk(chunk) => self.captures.push(chunk.clone()),
            Item::Ledger(line) => self.ledger.push(*line),
            Item::Mark(mark) => {
                if *mark == Mark::Restart {
                    self.boots.push(self.end());
                }
                self.marks.push((self.rows.len(), *mark));
            }
        }
    }

    /// The items of a start of the target, counted from 0. Each start counts its ticks from 0.
    #[must_use]
    pub fn since_boot(&self, boot: usize) -> Since<'_> {
        let from = boot.checked_sub(1).and_then(|before| self.boots.get(before));
        let from = from.copied().unwrap_or_default();
        let to = self.boots.get(boot).copied().unwrap_or_else(|| self.end());
        Since {
            events: self.events.get(from.events..to.events).unwrap_or_default(),
            plans: self.plans.get(from.plans..to.plans).unwrap_or_default(),
            requests: self.requests.get(from.requests..to.requests).unwrap_or_default(),
        }
    }

    /// What has come so far.
    fn end(&self) -> Boot {
        let Self { events, plans, requests, .. } = self;
        Boot { events: events.len(), plans: plans.len(), requests: requests.len() }
    }

    /// Whether nothing is known to be missing.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.marks.is_empty()
    }
}
