//! From the tape to frames: the journal's part of the binary log.

use super::capture::Capture;
use super::entry::{Entry, Event};
use super::frame::{self, Checker, FrameBuffer, Head, Kind, put_ticks};
use super::identity::Identity;
use super::ledger::Ledger;
use super::tape::Tape;
use crate::units::Tick;
use serde::Serialize;

/// Ticks from one identity to the next.
const IDENTITY_EVERY: u32 = 1000;

/// Writes frames. It never waits: what finds no room is dropped whole and counted.
pub struct LogEncoder {
    identity: Identity,
    introduced: Option<Tick>,
    sequence: u32,
    dropped: u32,
    capture: Capture,
    ledger: Ledger,
    page: FrameBuffer,
    /// What sums up its frames if not the library's own code. None to begin with, so that a
    /// new scribe is all zeros and takes no room in flash.
    check: Option<Checker>,
}

impl LogEncoder {
    /// A scribe that has written nothing yet.
    #[must_use]
    pub const fn new(identity: Identity) -> Self {
        Self {
            identity,
            introduced: None,
            sequence: 0,
            dropped: 0,
            capture: Capture::new(),
            ledger: Ledger::new(),
            page: FrameBuffer::new(),
            check: None,
        }
    }

    /// Says from now on that this one speaks.
    pub fn set_identity(&mut self, identity: Identity) {
        self.identity = identity;
    }

    /// Has its frames summed up by this from now on.
    pub fn check_by(&mut self, check: Checker) {
        self.check = Some(check);
    }

    /// Writes what is on the tape. `send` takes a frame whole, or says that it did not.
    pub fn read(&mut self, tape: &Tape, send: &mut dyn FnMut(&[u8]) -> bool) {
        if let Some((at, request)) = tape.take_request() {
            self.one(Kind::Request, &(at, request), send);
        }
        if let Some((at, plan)) = tape.take_plan() {
            self.one(Kind::Plan, &(at, plan), send);
        }
        while tape.unread() > 0 {
            self.introduce(tape, send);
            self.ticks(tape, send);
        }
        // A capture waits for the room that the ticks leave.
        if let Some(piece) = self.capture.piece()
            && self.one(Kind::CaptureChunk, &piece, send)
        {
            self.capture.sent(&piece);
        }
    }

    /// Writes a log entry; of a crossing, its line of the ledger as well.
    pub fn entry(&mut self, entry: &Entry, send: &mut dyn FnMut(&[u8]) -> bool) {
        self.one(Kind::Event, entry, send);
        if let Event::Crossing(crossing) = &entry.event {
            let line = self.ledger.close(entry.at, crossing);
            self.one(Kind::Ledger, &line, send);
        }
    }

    /// Says who speaks, if it is time.
    fn introduce(&mut self, tape: &Tape, send: &mut dyn FnMut(&[u8]) -> bool) {
        let now = tape.now();
        let due = |last: Tick| now.wrapping_sub(last) >= IDENTITY_EVERY;
        if self.introduced.is_none_or(due) {
            self.introduced = Some(now);
            let identity = self.identity.clone();
            self.one(Kind::Identity, &identity, send);
        }
    }

    /// One frame of ticks.
    fn ticks(&mut self, tape: &Tape, send: &mut dyn FnMut(&[u8]) -> bool) {
        let head = self.head(Kind::Ticks);
        let Self { capture, ledger, identity, page, check, .. } = self;
        let frame = page.write(head, check.unwrap_or(frame::check), |body| {
            put_ticks(body, |record| {
                let there = tape.take_into(record);
                if there {
                    capture.look(record, identity.corner);
                    ledger.look(record);
                }
                there
            })
        });
        let room = send(frame);
        self.count(room);
    }

    /// A frame of one value; whether there was room for it.
    #[inline(never)]
    fn one(
        &mut self,
        kind: Kind,
        value: &impl Serialize,
        send: &mut dyn FnMut(&[u8]) -> bool,
    ) -> bool {
        let head = self.head(kind);
        // All of them fit, see the test.
        let frame = self.page.write(head, self.check.unwrap_or(frame::check), |body| {
            postcard::to_slice(value, body).map_or(0, |used| used.len())
        });
        let room = send(frame);
        self.count(room);
        room
    }

    const fn head(&self, kind: Kind) -> Head {
        Head { kind: kind as u8, sequence: self.sequence, dropped: self.dropped }
    }

    /// A frame has been made, and has found room or not.
    fn count(&mut self, room: bool) {
        self.sequence = self.sequence.wrapping_add(1);
        self.dropped = self.dropped.wrapping_add(u32::from(!room));
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "positions of the test")]
mod tests {
    use super::super::capture::{CaptureChunk, CaptureSample, IN_FRAME, Trigger};
    use super::super::frame::{Body, Frame};
    use super::super::ledger::tests::crossing;
    use super::super::record::Record;
    use super::super::{CrossingRecord, identity};
    use super::*;
    use crate::control::{Input, Output};
    use crate::model::{Outcome, Plan, PlanRequest, Review};
    use crate::supervise::{Direction, Limit, Mode};
    use crate::units::Q16;

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
                    records.extend(ticks.map(Result::unwrap));
                }
            }
            (heads, records)
        }
    }

    fn scribe() -> LogEncoder {
        LogEncoder::new(Identity {
            schema: identity::SCHEMA,
            version: identity::text("1.2.3"),
            rig: identity::text("prototype"),
            ..Identity::default()
        })
    }

    fn tick(tape: &Tape, at: Tick) {
        let mut output = Output::default();
        output.telemetry.at = at;
        output.telemetry.mode = Mode::Idle;
        output.telemetry.position = Q16::from_num(f64::from(at) * 0.008);
        tape.keep(&Input { now: at, ..Input::default() }, &output);
    }

    fn run(
        scribe: &mut LogEncoder,
        tape: &Tape,
        channel: &mut Channel,
        ticks: core::ops::Range<Tick>,
    ) {
        for at in ticks {
            tick(tape, at);
            if tape.unread() == super::super::BATCH {
                scribe.read(tape, &mut |frame| channel.send(frame));
            }
        }
    }

    #[test]
    fn every_tick_arrives_and_the_identity_every_second() {
        let (mut scribe, tape, mut channel) = (scribe(), Tape::new(), Channel::default());
        run(&mut scribe, &tape, &mut channel, 0..4000);
        let (heads, records) = channel.read();
        assert!(records.iter().map(Record::at).eq(0..4000));
        assert!(heads.iter().map(|head| head.sequence).eq(0..heads.len() as u32));
        assert_eq!(heads[0].kind, Kind::Identity as u8);
        let identities = heads.iter().filter(|head| head.kind == Kind::Identity as u8);
        assert_eq!(identities.count(), 4);
    }

    #[test]
    fn it_speaks_for_whom_it_was_told_to() {
        let mut scribe = LogEncoder::new(Identity::NOBODY);
        let somebody =
            Identity { parameters: 0xABCD, rig: identity::text("fe"), ..Identity::NOBODY };
        scribe.set_identity(somebody.clone());
        let (tape, mut channel) = (Tape::new(), Channel::default());
        run(&mut scribe, &tape, &mut channel, 0..super::super::BATCH);
        let said = Frame::open(&channel.frames[0]).unwrap().body().unwrap();
        assert_eq!(said, Body::Identity(somebody));
    }

    #[test]
    fn who_is_told_to_sum_up_does() {
        let (mut scribe, tape, mut channel) = (scribe(), Tape::new(), Channel::default());
        scribe.check_by(|bytes| !frame::check(bytes));
        run(&mut scribe, &tape, &mut channel, 0..super::super::BATCH);
        assert!(channel.frames.iter().all(|frame| Frame::open(frame).is_err()));
    }

    #[test]
    fn what_finds_no_room_is_counted_and_takes_nothing_else_with_it() {
        let (mut scribe, tape, mut channel) = (scribe(), Tape::new(), Channel::default());
        run(&mut scribe, &tape, &mut channel, 0..80);
        channel.room = Some(0);
        run(&mut scribe, &tape, &mut channel, 80..160);
        channel.room = None;
        run(&mut scribe, &tape, &mut channel, 160..240);
        let (heads, records) = channel.read();
        assert!(records.iter().map(Record::at).eq((0..80).chain(160..240)));
        let jump = heads.windows(2).find(|pair| pair[1].sequence != pair[0].sequence + 1).unwrap();
        assert_eq!(jump[1].sequence - jump[0].sequence - 1, 10);
        assert_eq!((jump[0].dropped, jump[1].dropped), (0, 10));
    }

    #[test]
    fn a_crossing_is_an_event_and_a_line_of_the_ledger() {
        let (mut scribe, mut channel) = (scribe(), Channel::default());
        let event = Event::Crossing(crossing(Direction::Deploy, 1.0));
        scribe.entry(&Entry { at: 7, event }, &mut |frame| channel.send(frame));
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
            lead_time: most,
            slip_margin: most,
            stiffness_scale: most,
        };
        let review = Review {
            direction: Direction::Retract,
            speed: most,
            preload: most,
            tan_arm: most,
            gap: most,
            trusted: true,
        };
        let direction = Direction::Retract;
        let request = PlanRequest {
            sequence: u32::MAX,
            direction,
            step: 255,
            scale: most,
            review: Some(review),
        };
        let outcome = Outcome {
            gap_predicted: most,
            slip_margin: most,
            scale: most,
            bounded: true,
            strange: true,
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
            brake_way: most,
            brake_time: most,
            brake_horizon: most,
            look_ahead: true,
            limits: [Some(Limit::SlipMarginLow); 3],
            outcome: Some(outcome),
        };
        let shot = CaptureSample {
            at: u16::MAX,
            codes: [u16::MAX; 4],
            duties: [i16::MIN; 2],
            mode: 255,
            stage: 255,
        };
        let piece = CaptureChunk {
            trigger: Trigger::Command,
            at: u32::MAX,
            first: 255,
            of: 255,
            shots: core::iter::repeat_n(shot, IN_FRAME).collect(),
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
        let mut scribe = scribe();
        scribe.sequence = u32::MAX;
        scribe.dropped = u32::MAX;
        let mut bodies = Vec::new();
        let mut send = |frame: &[u8]| {
            bodies.push(frame.to_vec());
            true
        };
        let entry = Entry { at: u32::MAX, event: Event::Crossing(crossing) };
        scribe.entry(&entry, &mut send);
        scribe.one(Kind::Plan, &(u32::MAX, plan), &mut send);
        scribe.one(Kind::Request, &(u32::MAX, request), &mut send);
        scribe.one(Kind::CaptureChunk, &piece, &mut send);
        scribe.one(Kind::Identity, &identity, &mut send);
        let mut read = bodies.iter().map(|bytes| Frame::open(bytes).unwrap().body().unwrap());
        assert_eq!(read.next(), Some(Body::Event(entry)));
        assert!(matches!(read.next(), Some(Body::Ledger(line)) if line.crossing == crossing));
        assert_eq!(read.next(), Some(Body::Plan(u32::MAX, plan)));
        assert_eq!(read.next(), Some(Body::Request(u32::MAX, request)));
        assert_eq!(read.next(), Some(Body::CaptureChunk(piece)));
        assert_eq!(read.next(), Some(Body::Identity(identity)));
    }
}
