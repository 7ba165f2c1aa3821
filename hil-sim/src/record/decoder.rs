//! Decodes the bytes of the binary channel.
//!
//! What is missing between two frames is an item of its own. Garbage ends at the next valid
//! frame. A target has restarted if its sequence or its clock goes back.

use crate::table::counted;
use interstage::log::frame::{Body, Found, Frame, LONGEST, find};
use interstage::log::identity::SCHEMA;
use interstage::log::ledger::Line;
use interstage::log::{Flags, Identity, Record};
use interstage::model::{Plan, PlanRequest};
use interstage::sense::raw::SensorFrame;
use interstage::tick::Entry;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// The target's identity; once a second.
    Identity(Identity),
    /// A tick, and the sensor codes that it used, with their times.
    Tick(Record, SensorFrame),
    /// A plan that this tick received.
    Plan(u32, Plan),
    /// A request for a plan that this tick made.
    Request(u32, PlanRequest),
    Event(Entry),
    Ledger(Line),
    /// Something is missing here.
    Mark(Mark),
    /// The bytes of a frame, behind its items, with those before it that are no frame.
    Frame(Vec<u8>),
}

/// What is missing at a place of a log, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Mark {
    /// Frames are missing.
    Lost {
        frames: u32,
        /// How many of them the target dropped because its channel was full.
        dropped: u32,
    },
    /// Bytes that belong to no frame.
    Garbage {
        bytes: u64,
    },
    /// Ticks are missing although no frame is: the journal task was too late.
    Skipped {
        ticks: u32,
    },
    /// Ticks did not run: the control tick was late.
    Overrun {
        ticks: u32,
    },
    /// The log does not begin with the target's first frame.
    Joined {
        /// How many went before.
        frames: u32,
    },
    Restart,
    /// A frame of another layout than this reader knows, and its number.
    Schema {
        found: u16,
    },
}

impl std::fmt::Display for Mark {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Lost { frames, dropped } => {
                write!(f, "{} lost, {dropped} of them for lack of room", counted(frames, "frame"))
            }
            Self::Garbage { bytes } => {
                write!(f, "garbage between frames: {}", counted(bytes, "byte"))
            }
            Self::Skipped { ticks } => write!(f, "{} not logged", counted(ticks, "tick")),
            Self::Overrun { ticks } => write!(f, "{} did not run", counted(ticks, "tick")),
            Self::Joined { frames } => {
                write!(f, "the log begins {} after the target's first", counted(frames, "frame"))
            }
            Self::Restart => write!(f, "the target restarted"),
            Self::Schema { found } => {
                write!(f, "frames of schema {found}, this reader knows {SCHEMA}")
            }
        }
    }
}

/// What the decoder has read so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    pub bytes: u64,
    pub frames: u64,
    pub ticks: u64,
    /// Frames known to be missing.
    pub lost_frames: u64,
    /// Those of them that the target dropped.
    pub dropped_frames: u64,
    /// Bytes that are no frame.
    pub garbage_bytes: u64,
    /// Ticks known to be missing, by the clock.
    pub lost_ticks: u64,
    pub overrun_ticks: u64,
    /// Times that the target restarted.
    pub restarts: u64,
}

impl Counts {
    /// Whether there are ticks, and none is known to be missing.
    pub(crate) const fn is_complete(&self) -> bool {
        self.ticks > 0 && self.lost_frames == 0 && self.lost_ticks == 0
    }
}

/// Decodes bytes in pieces of any size.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    /// The beginning of a frame that is not complete yet.
    partial: Vec<u8>,
    /// Bytes before it that are no frame: their number, and those that no item has had yet.
    garbage: u64,
    strange: Vec<u8>,
    /// Sequence and count of dropped frames expected in the next head.
    due: Option<(u32, u32)>,
    /// Time of the last tick and its codes.
    last: Option<(u32, SensorFrame)>,
    /// Frames are missing since the last tick.
    torn: bool,
    /// The frames are of another layout, as the last identity says: none is decoded.
    is_other: bool,
    counts: Counts,
}

impl Decoder {
    /// A decoder that starts anywhere in a log.
    pub fn new() -> Self {
        Self::default()
    }

    /// What has been read so far.
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Reads on and passes each item to `take`.
    pub fn read(&mut self, bytes: &[u8], take: &mut impl FnMut(Item)) {
        self.counts.bytes += bytes.len() as u64;
        let mut held = std::mem::take(&mut self.partial);
        held.extend_from_slice(bytes);
        let used = self.find(&held, false, take);
        held.drain(..used);
        self.partial = held;
        // Only the end of them may become a frame.
        if self.strange.len() > LONGEST {
            take(Item::Frame(std::mem::take(&mut self.strange)));
        }
    }

    /// The log ends here; a frame that has begun is garbage.
    pub(crate) fn finish(&mut self, take: &mut impl FnMut(Item)) {
        let held = std::mem::take(&mut self.partial);
        self.find(&held, true, take);
        self.report_garbage(take);
    }

    /// Takes the complete frames at the beginning of `bytes`, or everything if they are the
    /// last; returns how many bytes it used.
    fn find(&mut self, bytes: &[u8], last: bool, take: &mut impl FnMut(Item)) -> usize {
        let mut used = 0;
        while let Some(rest) = bytes.get(used..).filter(|rest| !rest.is_empty()) {
            let length = match find(rest) {
                Found::Frame(frame, length) => {
                    self.report_garbage(take);
                    self.frame(&frame, length as u64, take);
                    let mut bytes = std::mem::take(&mut self.strange);
                    bytes.extend_from_slice(&rest[..length]);
                    take(Item::Frame(bytes));
                    used += length;
                    continue;
                }
                Found::Garbage(length) => length,
                // What looks like the beginning of a frame may be garbage before a frame.
                Found::Part if last => 1,
                Found::Part => break,
            };
            self.garbage += length as u64;
            self.strange.extend_from_slice(&rest[..length]);
            used += length;
        }
        used
    }

    fn report_garbage(&mut self, take: &mut impl FnMut(Item)) {
        let bytes = std::mem::take(&mut self.garbage);
        if bytes > 0 {
            self.mark_garbage(bytes, take);
        }
    }

    fn mark_garbage(&mut self, bytes: u64, take: &mut impl FnMut(Item)) {
        self.counts.garbage_bytes += bytes;
        take(Item::Mark(Mark::Garbage { bytes }));
    }

    fn frame(&mut self, frame: &Frame<'_>, length: u64, take: &mut impl FnMut(Item)) {
        let Some(body) = frame.body() else {
            // The checksum matches by chance.
            return self.mark_garbage(length, take);
        };
        self.counts.frames += 1;
        self.follow(frame, &body, take);
        match body {
            Body::Identity(identity) => {
                self.is_other = identity.schema != SCHEMA;
                let mark = Item::Mark(Mark::Schema { found: identity.schema });
                take(if self.is_other { mark } else { Item::Identity(identity) });
            }
            _ if self.is_other => {}
            Body::Ticks(ticks) => {
                for record in ticks {
                    match record {
                        Some(record) => self.tick(&record, take),
                        None => self.mark_garbage(length, take),
                    }
                }
            }
            Body::Plan(at, plan) => take(Item::Plan(at, plan)),
            Body::Request(at, request) => take(Item::Request(at, request)),
            Body::Event(entry) => take(Item::Event(entry)),
            Body::Ledger(line) => take(Item::Ledger(line)),
            Body::Unknown => {}
        }
    }

    /// Compares the head of a frame with the one before.
    fn follow(&mut self, frame: &Frame<'_>, body: &Body<'_>, take: &mut impl FnMut(Item)) {
        let head = frame.head;
        if let Some((sequence, dropped)) = self.due {
            let ahead = head.sequence.wrapping_sub(sequence) as i32;
            if ahead < 0 || self.clock_went_back(body) {
                self.restart(take);
                self.lose(head.sequence, head.dropped, take);
            } else {
                self.lose(ahead as u32, head.dropped.wrapping_sub(dropped), take);
            }
        } else if head.sequence > 0 {
            take(Item::Mark(Mark::Joined { frames: head.sequence }));
        }
        self.due = Some((head.sequence.wrapping_add(1), head.dropped));
    }

    fn clock_went_back(&self, body: &Body<'_>) -> bool {
        let Some((last, _)) = self.last else { return false };
        let Body::Ticks(ticks) = body else { return false };
        let first = ticks.clone().flatten().next();
        first.is_some_and(|first| (first.at().wrapping_sub(last) as i32) <= 0)
    }

    fn restart(&mut self, take: &mut impl FnMut(Item)) {
        self.counts.restarts += 1;
        self.last = None;
        self.torn = false;
        take(Item::Mark(Mark::Restart));
    }

    fn lose(&mut self, frames: u32, dropped: u32, take: &mut impl FnMut(Item)) {
        if frames > 0 {
            let dropped = dropped.min(frames);
            self.torn = true;
            self.counts.lost_frames += u64::from(frames);
            self.counts.dropped_frames += u64::from(dropped);
            take(Item::Mark(Mark::Lost { frames, dropped }));
        }
    }

    fn tick(&mut self, record: &Record, take: &mut impl FnMut(Item)) {
        let before = self.last.map_or(SensorFrame::default(), |(_, sensors)| sensors);
        if let Some((last, _)) = self.last {
            let ticks = record.at().wrapping_sub(last).wrapping_sub(1);
            if ticks > 0 && record.flags.has(Flags::OVERRUN) && !self.torn {
                self.counts.overrun_ticks += u64::from(ticks);
                take(Item::Mark(Mark::Overrun { ticks }));
            } else if ticks > 0 {
                self.counts.lost_ticks += u64::from(ticks);
                if !self.torn {
                    take(Item::Mark(Mark::Skipped { ticks }));
                }
            }
        }
        self.torn = false;
        let sensors = record.sensors(&before);
        self.last = Some((record.at(), sensors));
        self.counts.ticks += 1;
        take(Item::Tick(*record, sensors));
    }
}

#[cfg(test)]
pub(super) mod tests;
