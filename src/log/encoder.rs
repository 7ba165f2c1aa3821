//! From ticks and entries to frames of the binary log; run by the journal.

use super::frame::{FrameBuffer, Head, Kind, TicksFrame};
use super::identity::Identity;
use super::ledger::Ledger;
use super::record::Record;
use crate::model::{Plan, PlanRequest};
use crate::tick::{Entry, Event};
use crate::units::Tick;
use serde::Serialize;

/// Ticks from one identity to the next.
const IDENTITY_EVERY: u32 = 1000;

/// Ticks in a frame, as far as they fit.
pub const TICKS_PER_FRAME: usize = 8;

/// Takes a complete frame, and returns whether it did.
pub type FrameSink<'a> = &'a mut dyn FnMut(&[u8]) -> bool;

/// Writes frames. It never waits: a frame that finds no room is dropped and counted.
pub struct LogEncoder {
    identity: Identity,
    introduced: Option<Tick>,
    sequence: u32,
    dropped: u32,
    ledger: Ledger,
    ticks: TicksFrame,
    buffer: FrameBuffer,
}

impl LogEncoder {
    /// An encoder that has written nothing yet.
    pub const fn new(identity: Identity) -> Self {
        Self {
            identity,
            introduced: None,
            sequence: 0,
            dropped: 0,
            ledger: Ledger::EMPTY,
            ticks: TicksFrame::new(),
            buffer: FrameBuffer::EMPTY,
        }
    }

    /// Sets the identity that the log reports from now on.
    pub fn set_identity(&mut self, identity: Identity) {
        self.identity = identity;
    }

    /// Adds a tick; its frame is sent with the last of [`TICKS_PER_FRAME`].
    pub fn tick(&mut self, record: &Record, send: FrameSink<'_>) {
        self.ledger.look(record);
        if !self.ticks.push(record) {
            self.flush(send);
            self.ticks.push(record);
        }
        if self.ticks.ticks() >= TICKS_PER_FRAME {
            self.flush(send);
        }
    }

    /// Writes the plan that the tick of this number was given.
    pub fn plan(&mut self, at: Tick, plan: &Plan, send: FrameSink<'_>) {
        self.one(Kind::Plan, &(at, plan), send);
    }

    /// Writes the request that the tick of this number made.
    pub fn request(&mut self, at: Tick, request: &PlanRequest, send: FrameSink<'_>) {
        self.one(Kind::Request, &(at, request), send);
    }

    /// Writes a log entry, and after a crossing its line of the ledger.
    pub fn entry(&mut self, entry: &Entry, send: FrameSink<'_>) {
        self.one(Kind::Event, entry, send);
        if let Event::Crossing(crossing) = &entry.event {
            let line = self.ledger.close(entry.at, crossing);
            self.one(Kind::Ledger, &line, send);
        }
    }

    /// Sends the buffered ticks, and once a second the identity before them.
    pub fn flush(&mut self, send: FrameSink<'_>) {
        if self.ticks.ticks() == 0 {
            return;
        }
        let now = self.ticks.latest();
        let due = |last: Tick| now.wrapping_sub(last) >= IDENTITY_EVERY;
        if self.introduced.is_none_or(due) {
            self.introduced = Some(now);
            let identity = self.identity.clone();
            self.one(Kind::Identity, &identity, send);
        }
        let room = send(self.ticks.close(self.sequence, self.dropped));
        self.count(room);
    }

    /// Sends a frame of one value.
    #[inline(never)]
    fn one(&mut self, kind: Kind, value: &impl Serialize, send: FrameSink<'_>) {
        let head = Head { kind: kind as u8, sequence: self.sequence, dropped: self.dropped };
        // All values fit, see the test.
        let frame = self
            .buffer
            .write(head, |body| postcard::to_slice(value, body).map_or(0, |used| used.len()));
        let room = send(frame);
        self.count(room);
    }

    /// Counts a frame, sent or not.
    fn count(&mut self, room: bool) {
        self.sequence = self.sequence.wrapping_add(1);
        self.dropped = self.dropped.wrapping_add(u32::from(!room));
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::{Body, Frame};
    use super::super::identity;
    use super::super::ledger::tests::crossing;
    use super::*;
    use crate::fault::Limit;
    use crate::model::history::History;
    use crate::model::{Approach, Learned, LimitedBy, Outcome, Plan, PlanRequest, Review};
    use crate::supervise::Mode;
    use crate::tick::CrossingRecord;

    use crate::units::{Direction, Q16};

    /// A channel that keeps what it is sent, as long as it has room.
    #[derive(Default)]
    struct Channel {
        frames: Vec<Vec<u8>>,
        room: Option<usize>,
    }

    impl Channel {
        fn send(&mut self, frame: &[u8]) -> bool {
            match &mut self.room {
                Some(room) if *room < frame.len() => return false,
                Some(room) => *room -= frame.len(),
                None => {}
            }
            self.frames.push(frame.to_vec());
            true
        }

        /// Heads and records of what has come, in order.
        fn read(&self) -> (Vec<Head>, Vec<Record>) {
            let (mut heads, mut records) = (Vec::new(), Vec::new());
            for frame in &self.frames {
                let frame = Frame::open(frame).unwrap();
                heads.push(frame.head);
                if let Body::Ticks(ticks) = frame.body().unwrap() {
                    records.extend(ticks.map(Option::unwrap));
                }
            }
            (heads, records)
        }
    }

    fn encoder() -> LogEncoder {
        LogEncoder::new(Identity {
            schema: identity::SCHEMA,
            version: identity::text("1.2.3"),
            rig: identity::text("prototype"),
            ..Identity::default()
        })
    }

    fn run(encoder: &mut LogEncoder, channel: &mut Channel, ticks: core::ops::Range<Tick>) {
        for at in ticks {
            let mut record = Record::default();
            record.telemetry.at = at;
            record.telemetry.mode = Mode::Idle;
            record.telemetry.position = Q16::from_num(f64::from(at) * 0.008);
            encoder.tick(&record, &mut |frame| channel.send(frame));
        }
    }

    #[test]
    fn every_tick_arrives_and_the_identity_every_second() {
        let (mut encoder, mut channel) = (encoder(), Channel::default());
        run(&mut encoder, &mut channel, 0..4000);
        let (heads, records) = channel.read();
        assert!(records.iter().map(Record::at).eq(0..4000));
        assert!(heads.iter().map(|head| head.sequence).eq(0..heads.len() as u32));
        assert_eq!(heads[0].kind, Kind::Identity as u8);
        let identities = heads.iter().filter(|head| head.kind == Kind::Identity as u8);
        assert_eq!(identities.count(), 4);
    }

    #[test]
    fn it_sends_the_identity_that_was_set() {
        let mut encoder = LogEncoder::new(Identity::NOBODY);
        let identity =
            Identity { parameters: 0xABCD, rig: identity::text("fe"), ..Identity::NOBODY };
        encoder.set_identity(identity.clone());
        let mut channel = Channel::default();
        run(&mut encoder, &mut channel, 0..TICKS_PER_FRAME as u32);
        let sent = Frame::open(&channel.frames[0]).unwrap().body().unwrap();
        assert_eq!(sent, Body::Identity(identity));
    }

    #[test]
    fn a_frame_without_room_is_counted_and_alone_is_lost() {
        let (mut encoder, mut channel) = (encoder(), Channel::default());
        run(&mut encoder, &mut channel, 0..80);
        channel.room = Some(0);
        run(&mut encoder, &mut channel, 80..160);
        channel.room = None;
        run(&mut encoder, &mut channel, 160..240);
        let (heads, records) = channel.read();
        assert!(records.iter().map(Record::at).eq((0..80).chain(160..240)));
        let jump = heads.windows(2).find(|pair| pair[1].sequence != pair[0].sequence + 1).unwrap();
        assert_eq!(jump[1].sequence - jump[0].sequence - 1, 10);
        assert_eq!((jump[0].dropped, jump[1].dropped), (0, 10));
    }

    #[test]
    fn a_crossing_is_an_event_and_a_line_of_the_ledger() {
        let (mut encoder, mut channel) = (encoder(), Channel::default());
        let event = Event::Crossing(crossing(Direction::Deploy, 1.0));
        encoder.entry(&Entry { at: 7, event }, &mut |frame| channel.send(frame));
        let kinds: Vec<u8> = channel.read().0.iter().map(|head| head.kind).collect();
        assert_eq!(kinds, [Kind::Event as u8, Kind::Ledger as u8]);
    }

    /// The longest of every kind; each is read back, so it had room.
    #[test]
    fn every_value_fits_into_a_frame() {
        let most = Q16::MIN;
        let crossing = CrossingRecord {
            index: 255,
            direction: Direction::Retract,
            position: most,
            residual: most,
            speed: most,
            preload: most,
            peak_preload: most,
            compression: most,
            gap_predicted: most,
            gap_measured: most,
            height: most,
            slip: most,
            slip_sigma: most,
            lead_time: most,
            slip_margin: most,
            stiffness_scale: most,
            limited_by: Some(LimitedBy::Drive),
        };
        let review = Review {
            direction: Direction::Retract,
            history: History::steady(u16::MAX, most),
            distance: most,
            held: most,
            felt_at: Some(most),
            tan_arm: most,
            gap_as_table: most,
            gap: most,
            trusted: true,
            slipped: true,
        };
        let learned = Learned {
            scale: most,
            deviation: most,
            unknown: true,
            felt_late: [most; 2],
            extra_load: most,
            grips: most,
            slips: most,
        };
        let direction = Direction::Retract;
        let request = PlanRequest {
            sequence: u32::MAX,
            direction,
            step: 255,
            learned,
            preload: most,
            distance: most,
            speed: most,
            searching: true,
            review: Some(review),
            slipped: Some(most),
        };
        let outcome = Outcome {
            gap_predicted: most,
            slip_margin: most,
            learned,
            bounded: true,
            strange: true,
            wide: true,
        };
        let plan = Plan {
            sequence: u32::MAX,
            step: 255,
            direction,
            cruise_speed: most,
            cross_speed: most,
            cruise_preload: most,
            cross_preload: most,
            gap: most,
            slip_margin: most,
            slips: most,
            short: true,
            brake_distance: most,
            brake_time: most,
            approach: Approach {
                window_from: most,
                window_speed: most,
                brake_from: most,
                slowest_speed: most,
                release_from: most,
                release_time: most,
                lift: most,
            },
            ramp_preload: most,
            most_preload: most,
            rolling_preload: most,
            brake_horizon: most,
            look_ahead: true,
            limited_by: LimitedBy::Drive,
            limits: [Some(Limit::SlipMarginLow); 3],
            outcome: Some(outcome),
        };
        let text = "x".repeat(identity::MAX_TEXT);
        let identity = Identity {
            schema: u16::MAX,
            version: identity::text(&text),
            build: [255; 8],
            rig: identity::text(&text),
            parameters: u32::MAX,
            calibration: u32::MAX,
            corner: most,
        };
        let mut encoder = encoder();
        encoder.sequence = u32::MAX;
        encoder.dropped = u32::MAX;
        let mut frames = Channel::default();
        let mut send = |frame: &[u8]| frames.send(frame);
        let entry = Entry { at: u32::MAX, event: Event::Crossing(crossing) };
        encoder.entry(&entry, &mut send);
        encoder.one(Kind::Plan, &(u32::MAX, plan), &mut send);
        encoder.one(Kind::Request, &(u32::MAX, request), &mut send);
        encoder.one(Kind::Identity, &identity, &mut send);
        let mut read =
            frames.frames.iter().map(|bytes| Frame::open(bytes).unwrap().body().unwrap());
        assert_eq!(read.next(), Some(Body::Event(entry)));
        assert!(matches!(read.next(), Some(Body::Ledger(line)) if line.crossing == crossing));
        assert_eq!(read.next(), Some(Body::Plan(u32::MAX, plan)));
        assert_eq!(read.next(), Some(Body::Request(u32::MAX, request)));
        assert_eq!(read.next(), Some(Body::Identity(identity)));
    }
}
