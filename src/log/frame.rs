//! A frame of the binary log: how it lies on the channel.
//!
//! ```text
//! sync | length | kind | 0 | sequence | dropped | body, zeros to a whole word | CRC-32
//!    4 |      2 |    1 | 1 |        4 |       4 |                   length .. |      4
//! ```
//! Numbers have their little end first; the check is over all between sync and itself.
//! Everything stands on whole words, so that the core copies words and its CRC unit takes
//! them; stuffing bytes would cost several times all the rest. A reader that comes late or
//! meets garbage looks for the next sync with a sound frame behind it: a sync in the middle
//! of other content is told by the check. Every frame stands for itself: the loss of one
//! takes nothing from the others. The sequence counts frames since boot, those that found
//! no room too; `dropped` counts these.

use serde::Deserialize;

use super::capture::CaptureChunk;
use super::crc::crc32;
use super::delta::DeltaRecord;
use super::identity::Identity;
use super::ledger::Line;
use super::record::Record;
use crate::model::{Plan, PlanRequest};
use crate::tick::Entry;
use crate::units::Tick;

/// Longest frame on the channel, bytes.
pub const LONGEST: usize = 512;

/// Longest body, bytes.
pub const BODY: usize = LONGEST - HEAD - CHECK;

/// First bytes of a frame.
const SYNC: [u8; 4] = [0xE7, 0x1C, 0xB2, 0x5D];

/// Bytes up to the body.
const HEAD: usize = 16;

/// Bytes of the check.
const CHECK: usize = 4;

const _: () = assert!(BODY.is_multiple_of(4) && HEAD.is_multiple_of(4));

/// What a frame holds, as a number that stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// An [`Identity`].
    Identity = 1,
    /// [`Record`]s, each but the first as difference to the one before.
    Ticks = 2,
    /// A plan with the tick that was given it.
    Plan = 3,
    /// A request with the tick that made it.
    Request = 4,
    /// A log [`Entry`].
    Event = 5,
    /// A piece of a capture: [`CaptureChunk`].
    CaptureChunk = 6,
    /// A [`Line`] of the crossings' ledger.
    Ledger = 7,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Self; 7] = [
        Self::Identity,
        Self::Ticks,
        Self::Plan,
        Self::Request,
        Self::Event,
        Self::CaptureChunk,
        Self::Ledger,
    ];
}

/// What stands before a frame's body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// What it holds.
    pub kind: u8,
    /// Frames since boot before this one.
    pub sequence: u32,
    /// Of these, the ones that found no room on the channel.
    pub dropped: u32,
}

/// Room for a frame.
#[derive(Debug)]
#[repr(align(4))]
pub struct FrameBuffer([u8; LONGEST]);

impl Default for FrameBuffer {
    fn default() -> Self {
        Self::new()
    }
}

impl FrameBuffer {
    /// An empty one.
    pub const fn new() -> Self {
        Self([0; LONGEST])
    }

    /// Makes it the frame whose body `fill` writes, so many bytes of it, and returns that.
    #[inline]
    pub fn write(&mut self, head: Head, fill: impl FnOnce(&mut [u8; BODY]) -> usize) -> &[u8] {
        let Some((start, rest)) = self.0.split_first_chunk_mut::<HEAD>() else { return &[] };
        let Some(body) = rest.first_chunk_mut::<BODY>() else { return &[] };
        let length = fill(body).min(BODY);
        let whole = length.next_multiple_of(4);
        body[length..whole].fill(0);
        let [a, b] = (length as u16).to_le_bytes();
        start[..4].copy_from_slice(&SYNC);
        start[4..8].copy_from_slice(&[a, b, head.kind, 0]);
        start[8..12].copy_from_slice(&head.sequence.to_le_bytes());
        start[12..].copy_from_slice(&head.dropped.to_le_bytes());
        let end = HEAD + whole;
        let sum = crc32(&self.0[SYNC.len()..end]);
        if let Some(place) = self.0[end..].first_chunk_mut() {
            *place = sum.to_le_bytes();
        }
        &self.0[..end + CHECK]
    }
}

/// Why bytes are not a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// It does not begin as one, or has another length.
    Form,
    /// The check does not fit.
    Check,
    /// The check fits and the content does not: not written by this program.
    Content,
}

/// A frame whose check fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// What stands before the body.
    pub head: Head,
    body: &'a [u8],
}

/// What a frame says.
#[derive(Clone, Debug, PartialEq)]
pub enum Body<'a> {
    /// Who speaks.
    Identity(Identity),
    /// Ticks.
    Ticks(Ticks<'a>),
    /// A tick was given this plan.
    Plan(Tick, Plan),
    /// A tick asked for a plan.
    Request(Tick, PlanRequest),
    /// Something happened.
    Event(Entry),
    /// A piece of a capture.
    CaptureChunk(CaptureChunk),
    /// A crossing was closed.
    Ledger(Line),
    /// Something that this reader does not know.
    Unknown,
}

/// What stands at the beginning of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen<'a> {
    /// A frame, and its length with all that belongs to it.
    Frame(Frame<'a>, usize),
    /// The beginning of a frame, or of what looks like one: more has to come.
    Part,
    /// So many bytes that are no frame, one at least.
    Garbage(usize),
}

/// Looks at the beginning of bytes.
pub fn look(bytes: &[u8]) -> Seen<'_> {
    let begins = |at: &usize| {
        let seen = &bytes[*at..bytes.len().min(at + SYNC.len())];
        SYNC.starts_with(seen)
    };
    match (0..bytes.len()).find(begins) {
        Some(0) => {}
        Some(garbage) => return Seen::Garbage(garbage),
        None if bytes.is_empty() => return Seen::Part,
        None => return Seen::Garbage(bytes.len()),
    }
    let Some((start, rest)) = bytes.split_first_chunk::<HEAD>() else { return Seen::Part };
    let &[_, _, _, _, a, b, kind, zero, ..] = start;
    let length = usize::from(u16::from_le_bytes([a, b]));
    if length > BODY || zero != 0 {
        return Seen::Garbage(1);
    }
    let word = |at: usize| start[at..].first_chunk().map_or(0, |word| u32::from_le_bytes(*word));
    let end = HEAD + length.next_multiple_of(4);
    let Some(sum) = bytes.get(end..end + CHECK) else { return Seen::Part };
    if crc32(&bytes[SYNC.len()..end]).to_le_bytes() != sum {
        return Seen::Garbage(1);
    }
    let head = Head { kind, sequence: word(8), dropped: word(12) };
    Seen::Frame(Frame { head, body: &rest[..length] }, end + CHECK)
}

impl<'a> Frame<'a> {
    /// Opens bytes that are one frame.
    ///
    /// # Errors
    /// [`FrameError`] for anything but a whole frame.
    pub fn open(bytes: &'a [u8]) -> Result<Self, FrameError> {
        match look(bytes) {
            Seen::Frame(frame, length) if length == bytes.len() => Ok(frame),
            Seen::Garbage(1) => Err(FrameError::Check),
            _ => Err(FrameError::Form),
        }
    }

    /// Reads the body.
    ///
    /// # Errors
    /// [`FrameError::Content`] if it is not of its kind.
    pub fn body(&self) -> Result<Body<'a>, FrameError> {
        let Some(kind) = Kind::ALL.into_iter().find(|kind| *kind as u8 == self.head.kind) else {
            return Ok(Body::Unknown);
        };
        Ok(match kind {
            Kind::Identity => Body::Identity(whole(self.body)?),
            Kind::Ticks => Body::Ticks(Ticks { before: DeltaRecord::default(), rest: self.body }),
            Kind::Plan => whole(self.body).map(|(at, plan)| Body::Plan(at, plan))?,
            Kind::Request => whole(self.body).map(|(at, request)| Body::Request(at, request))?,
            Kind::Event => Body::Event(whole(self.body)?),
            Kind::CaptureChunk => Body::CaptureChunk(whole(self.body)?),
            Kind::Ledger => Body::Ledger(whole(self.body)?),
        })
    }
}

fn take<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(T, &'a [u8]), FrameError> {
    postcard::take_from_bytes(bytes).map_err(|_| FrameError::Content)
}

fn whole<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, FrameError> {
    match take(bytes)? {
        (value, []) => Ok(value),
        _ => Err(FrameError::Content),
    }
}

/// The records of a frame, in their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks<'a> {
    before: DeltaRecord,
    rest: &'a [u8],
}

impl Iterator for Ticks<'_> {
    type Item = Result<Record, FrameError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let read = DeltaRecord::take(&self.before, self.rest).and_then(|(wire, rest)| {
            let record = wire.record()?;
            (self.before, self.rest) = (wire, rest);
            Some(record)
        });
        if read.is_none() {
            self.rest = &[];
        }
        Some(read.ok_or(FrameError::Content))
    }
}

/// A frame of ticks that fills up, one record behind the other.
#[derive(Debug)]
pub(super) struct TicksFrame {
    buffer: FrameBuffer,
    before: DeltaRecord,
    length: usize,
    ticks: usize,
}

impl TicksFrame {
    /// Without a tick.
    pub(super) const fn new() -> Self {
        Self { buffer: FrameBuffer::new(), before: DeltaRecord::ZERO, length: 0, ticks: 0 }
    }

    /// Ticks in it.
    pub(super) const fn ticks(&self) -> usize {
        self.ticks
    }

    /// The latest of them.
    pub(super) const fn latest(&self) -> Tick {
        self.before.at
    }

    /// Adds a record; false if there is no room for one of any kind.
    pub(super) fn push(&mut self, record: &Record) -> bool {
        let rest = self.buffer.0.get_mut(HEAD + self.length..LONGEST - CHECK);
        let Some(room) = rest.and_then(|rest| rest.first_chunk_mut()) else { return false };
        self.length += DeltaRecord::of(record).put(&mut self.before, room);
        self.ticks += 1;
        true
    }

    /// The frame; the next record begins another.
    pub(super) fn close(&mut self, sequence: u32, dropped: u32) -> &[u8] {
        let length = self.length;
        (self.before, self.length, self.ticks) = (DeltaRecord::ZERO, 0, 0);
        let head = Head { kind: Kind::Ticks as u8, sequence, dropped };
        self.buffer.write(head, |_| length)
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::tests::any_record;
    use super::*;
    use proptest::prelude::*;

    fn head(kind: Kind, sequence: u32) -> Head {
        Head { kind: kind as u8, sequence, dropped: sequence / 3 }
    }

    /// A frame of these records, as many as fit, and how many that were.
    fn frame(records: &[Record], sequence: u32) -> (Vec<u8>, usize) {
        let mut frame = TicksFrame::new();
        let put = records.iter().take_while(|record| frame.push(record)).count();
        assert_eq!(frame.ticks(), put);
        (frame.close(sequence, sequence / 3).to_vec(), put)
    }

    /// Frames found one after the other in bytes, and how many bytes are none.
    fn read(mut bytes: &[u8]) -> (Vec<Head>, usize) {
        let (mut heads, mut garbage) = (Vec::new(), 0);
        loop {
            let used = match look(bytes) {
                Seen::Frame(frame, length) => {
                    heads.push(frame.head);
                    length
                }
                Seen::Part if bytes.is_empty() => return (heads, garbage),
                // Nothing more comes.
                Seen::Part => {
                    garbage += 1;
                    1
                }
                Seen::Garbage(used) => {
                    garbage += used;
                    used
                }
            };
            bytes = &bytes[used..];
        }
    }

    proptest! {
        #[test]
        fn ticks_come_back(
            records in prop::collection::vec(any_record(), 0..12),
            sequence in any::<u32>(),
        ) {
            let (bytes, put) = frame(&records, sequence);
            prop_assert_eq!(bytes.len() % 4, 0);
            let frame = Frame::open(&bytes).unwrap();
            prop_assert_eq!(frame.head, head(Kind::Ticks, sequence));
            let Body::Ticks(ticks) = frame.body().unwrap() else { panic!("ticks") };
            let back: Vec<Record> = ticks.map(Result::unwrap).collect();
            prop_assert_eq!(&back[..], &records[..put]);
            prop_assert!(put >= 4.min(records.len()), "{} of any kind fit", put);
        }

        #[test]
        fn a_flipped_bit_is_found(record in any_record(), at in any::<prop::sample::Index>(), bit in 0..8) {
            let mut bytes = frame(&[record], 9).0;
            let at = at.index(bytes.len());
            bytes[at] ^= 1_u8 << bit;
            prop_assert!(Frame::open(&bytes).is_err());
        }

        #[test]
        fn frames_behind_garbage_are_found_whatever_it_is(
            record in any_record(),
            garbage in prop::collection::vec(prop_oneof![any::<u8>(), prop::sample::select(SYNC.to_vec())], 0..600),
            cut in any::<prop::sample::Index>(),
        ) {
            let whole = [frame(&[record], 1).0, frame(&[record, record], 2).0].concat();
            // A part of a frame too is garbage, as for a reader that comes late.
            let part = &whole[cut.index(whole.len() / 2)..];
            let bytes = [&garbage[..], part, &whole].concat();
            let heads = read(&bytes).0;
            let sequences: Vec<u32> = heads.iter().map(|head| head.sequence).collect();
            prop_assert!(sequences.ends_with(&[1, 2]), "{sequences:?}");
        }

        #[test]
        fn a_sync_inside_a_frame_is_content(kind in any::<u8>(), at in 0..BODY - 4, length in any::<u16>()) {
            let mut buffer = FrameBuffer::new();
            let bytes = buffer.write(Head { kind, sequence: 5, dropped: 0 }, |body| {
                body.fill(0);
                body[at..at + 4].copy_from_slice(&SYNC);
                if let Some(place) = body[at + 4..].first_chunk_mut() {
                    *place = length.to_le_bytes();
                }
                BODY
            });
            prop_assert_eq!(read(bytes).0.len(), 1);
            // Of a frame that lost its beginning nothing is made up.
            prop_assert_eq!(read(&bytes[1..]), (vec![], bytes.len() - 1));
        }
    }

    #[test]
    fn the_longest_body_fits() {
        let most = Head { kind: u8::MAX, sequence: u32::MAX, dropped: u32::MAX };
        let mut buffer = FrameBuffer::new();
        let bytes = buffer.write(most, |body| {
            body.fill(0xA5);
            BODY + 7
        });
        assert_eq!(bytes.len(), LONGEST);
        let frame = Frame::open(bytes).unwrap();
        assert_eq!((frame.head, frame.body), (most, &[0xA5; BODY][..]));
    }
}
