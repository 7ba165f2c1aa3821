//! A whole log in memory.

use interstage::log::capture::Shots;
use interstage::log::ledger::Line;
use interstage::log::{Entry, Identity};
use interstage::model::{Plan, PlanRequest};
use serde::{Deserialize, Serialize};

use super::decoder::{Decoder, Item, Mark, Tally};
use super::row::Row;

/// Who made a log, with which parameters.
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
    /// Way of the wheel over a corner, mm.
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

/// A whole log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Who made it; none if the log has not come to say so.
    pub header: Option<Header>,
    /// A row a tick, in the order of the log.
    pub rows: Vec<Row>,
    /// What happened.
    pub events: Vec<Entry>,
    /// Plans with the ticks that were given them.
    pub plans: Vec<(u32, Plan)>,
    /// Requests with the ticks that made them.
    pub requests: Vec<(u32, PlanRequest)>,
    /// Lines of the ledger.
    pub ledger: Vec<Line>,
    /// Pieces of captures.
    pub shots: Vec<Shots>,
    /// What is missing, and before which row.
    pub marks: Vec<(usize, Mark)>,
    /// Counts of what came and what is missing.
    pub tally: Tally,
    /// The rig's parameters as TOML, if the file has them with it.
    pub parameters: Option<String>,
}

impl Run {
    /// Reads the bytes of the binary channel.
    #[must_use]
    pub fn of_stream(bytes: &[u8]) -> Self {
        let (mut decoder, mut run) = (Decoder::new(), Self::default());
        decoder.read(bytes, &mut |item| run.add(&item));
        decoder.finish(&mut |item| run.add(&item));
        run.tally = *decoder.tally();
        run
    }

    /// Adds an item.
    pub fn add(&mut self, item: &Item) {
        match item {
            Item::Identity(identity) => self.header = Some(identity.into()),
            Item::Tick(record, sensors) => self.rows.push(Row::of(record, sensors)),
            Item::Plan(at, plan) => self.plans.push((*at, *plan)),
            Item::Request(at, request) => self.requests.push((*at, *request)),
            Item::Event(entry) => self.events.push(*entry),
            Item::Shots(shots) => self.shots.push(shots.clone()),
            Item::Ledger(line) => self.ledger.push(*line),
            Item::Mark(mark) => self.marks.push((self.rows.len(), *mark)),
        }
    }

    /// Whether nothing is known to be missing.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.marks.is_empty()
    }
}
