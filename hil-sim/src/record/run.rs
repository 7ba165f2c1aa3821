//! A log in memory.

use interstage::log::Identity;
use interstage::log::identity::fingerprint;
use interstage::log::ledger::Line;
use interstage::model::{Plan, PlanRequest};
use interstage::restart::Restart;
use interstage::supervise::ServiceDuties;
use interstage::tick::{Entry, Event};
use serde::{Deserialize, Serialize};

use super::{Columns, Counts, Decoder, Item, Mark};
use crate::scenario::{Scenario, ScenarioError};
use crate::table::counted;

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

/// Where a file ends before its log does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cut {
    /// Time of the last tick that is there, s since boot.
    pub at_s: f64,
    /// Ticks that are missing behind it; none if the file does not say how many it had.
    pub missing_ticks: Option<u64>,
    /// Bytes that its last record lacks, if it ends within one whose length is known.
    pub lacks_bytes: Option<u64>,
}

impl std::fmt::Display for Cut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the file is cut off at {:.3} s: ", self.at_s)?;
        match (self.missing_ticks, self.lacks_bytes) {
            (Some(ticks), _) => write!(f, "missing behind it: {}", counted(ticks, "tick")),
            (None, Some(bytes)) => {
                let bytes = counted(bytes, "byte");
                write!(f, "its last record lacks {bytes}, and what followed is not known")
            }
            (None, None) => f.write_str("it does not say how much followed"),
        }
    }
}

/// Why the parameters of the controller that made a log are not known.
#[derive(Debug, thiserror::Error)]
pub enum Unknown {
    /// Neither parameters nor the name of a rig are in the log.
    #[error("its rig is not known")]
    Unnamed,
    #[error("made with parameters {0}, these are {1}")]
    Other(String, String),
    /// The parameters that it has, or what is laid over them, are wrong.
    #[error(transparent)]
    Wrong(#[from] ScenarioError),
}

/// Numbers of items before a start of the target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Boot {
    pub rows: usize,
    pub events: usize,
    pub plans: usize,
    pub requests: usize,
    pub ledger: usize,
}

/// A log in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Its header; none if the log has no identity.
    pub header: Option<Header>,
    /// A row a tick, in the order of the log.
    pub rows: Vec<Columns>,
    pub events: Vec<Entry>,
    /// Plans with the ticks that received them.
    pub plans: Vec<(u32, Plan)>,
    /// Requests with the ticks that made them.
    pub requests: Vec<(u32, PlanRequest)>,
    pub ledger: Vec<Line>,
    /// Each start after the first.
    pub boots: Vec<Boot>,
    /// Marks with the row that each precedes.
    pub marks: Vec<(usize, Mark)>,
    /// Counts of what was read and what is missing.
    pub counts: Counts,
    /// The rig's parameters as TOML, if the file has them.
    pub parameters: Option<String>,
    /// Where the file was cut off, if it was.
    pub cut: Option<Cut>,
}

impl Run {
    /// The scenario that the log was made with: the parameters in it, or the preset that it names
    /// if that has their hash, with these overrides, each `key=value`.
    pub(crate) fn scenario(&self, sets: &[String]) -> Result<Scenario, Unknown> {
        let scenario = match (&self.parameters, &self.header) {
            (Some(toml), _) => Scenario::parse("parameters of the log", toml, sets)?,
            (None, Some(header)) => Scenario::resolve(Some(&header.rig), None, sets)?,
            (None, None) if sets.is_empty() => return Err(Unknown::Unnamed),
            (None, None) => Scenario::resolve(None, None, sets)?,
        };
        let here = format!("{:08x}", fingerprint(&scenario.rig));
        match &self.header {
            Some(header) if header.parameters != here => {
                Err(Unknown::Other(header.parameters.clone(), here))
            }
            _ => Ok(scenario),
        }
    }

    /// What is missing of the log, in sentences; none if nothing is known to be.
    pub(crate) fn missing(&self) -> Vec<String> {
        let Counts { lost_frames, lost_ticks, .. } = self.counts;
        let (frames, ticks) = (counted(lost_frames, "frame"), counted(lost_ticks, "tick"));
        let lost = (lost_frames + lost_ticks > 0).then(|| format!("{frames} and {ticks} missing"));
        self.cut.map(|cut| cut.to_string()).into_iter().chain(lost).collect()
    }

    /// Marks the file as cut off behind its last tick. `total` is the number of ticks that it
    /// states, `lacks_bytes` what its last record lacks.
    pub(super) fn cut_off(&mut self, total: Option<u64>, lacks_bytes: Option<u64>) {
        let at_s = self.rows.last().map_or(0.0, |row| row.t_s);
        let missing_ticks = total.map(|total| total.saturating_sub(self.counts.ticks));
        self.cut = Some(Cut { at_s, missing_ticks, lacks_bytes });
    }

    /// Reads the bytes of the binary channel.
    pub fn of_stream(bytes: &[u8]) -> Self {
        let (mut decoder, mut run) = (Decoder::new(), Self::default());
        decoder.read(bytes, &mut |item| run.add(&item));
        decoder.finish(&mut |item| run.add(&item));
        run.counts = *decoder.counts();
        run
    }

    pub(crate) fn add(&mut self, item: &Item) {
        match item {
            Item::Identity(identity) => self.header = Some(identity.into()),
            Item::Tick(record, sensors) => self.rows.push(Columns::of(record, sensors)),
            Item::Plan(at, plan) => self.plans.push((*at, *plan)),
            Item::Request(at, request) => self.requests.push((*at, *request)),
            Item::Event(entry) => self.events.push(*entry),
            Item::Ledger(line) => self.ledger.push(*line),
            Item::Mark(mark) => {
                if *mark == Mark::Restart {
                    self.boots.push(self.end());
                }
                self.marks.push((self.rows.len(), *mark));
            }
            Item::Frame(_) => {}
        }
    }

    /// The log of a start of the target, counted from 0, without marks. Each start counts its
    /// ticks from 0. What is missing is counted in the last.
    pub fn since_boot(&self, boot: usize) -> Self {
        let from = boot.checked_sub(1).and_then(|before| self.boots.get(before));
        let from = from.copied().unwrap_or_default();
        let to = self.boots.get(boot).copied().unwrap_or_else(|| self.end());
        let is_last = boot == self.boots.len();
        Self {
            header: self.header.clone(),
            rows: self.rows[from.rows..to.rows].to_vec(),
            events: self.events[from.events..to.events].to_vec(),
            plans: self.plans[from.plans..to.plans].to_vec(),
            requests: self.requests[from.requests..to.requests].to_vec(),
            ledger: self.ledger[from.ledger..to.ledger].to_vec(),
            counts: if is_last { self.counts } else { Counts::default() },
            parameters: self.parameters.clone(),
            cut: self.cut.filter(|_| is_last),
            ..Self::default()
        }
    }

    /// Why the target started first, if the log has it.
    pub fn restart(&self) -> Option<Restart> {
        self.events.iter().find_map(|entry| match entry.event {
            Event::Restart(restart) => Some(restart),
            _ => None,
        })
    }

    /// Duties that the host asked for in the service mode, as of this tick: only a change is an
    /// event.
    pub(crate) fn service(&self, tick: u32) -> ServiceDuties {
        let before = self.events.iter().rev().filter(|entry| entry.at <= tick);
        let mut asked = before.filter_map(|entry| match entry.event {
            Event::Service(duties) => Some(duties),
            _ => None,
        });
        asked.next().unwrap_or(ServiceDuties::REST)
    }

    /// What has come so far.
    fn end(&self) -> Boot {
        Boot {
            rows: self.rows.len(),
            events: self.events.len(),
            plans: self.plans.len(),
            requests: self.requests.len(),
            ledger: self.ledger.len(),
        }
    }

    /// Whether nothing is known to be missing.
    pub fn is_complete(&self) -> bool {
        self.marks.is_empty()
    }
}
