//! Layout of a frame of the binary log.
//!
//! ```text
//! sync | length | kind | 0 | sequence | dropped | body, zeros to a full word | CRC-32
//!    4 |      2 |    1 | 1 |        4 |       4 |                   length .. |      4
//! ```
//! Little-endian; the check covers everything between the sync and itself. Everything is
//! word-aligned, so that the core copies words; byte stuffing would cost several times as much.
//! A reader that joins late or meets garbage searches the next sync with a sound frame behind
//! it; the check rejects a sync inside other content. Frames are independent: the loss of one
//! affects no other. The sequence counts all frames since boot, `dropped` those without room.

use super::delta::DeltaRecord;
use super::identity::Identity;
use super::ledger::Line;
use super::record::Record;
use super::{complete, crc32};
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

/// Content of a frame; the numbers are stable. 6 is of older logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// An [`Identity`].
    Identity = 1,
    /// [`Record`]s, each but the first as its difference from the one before.
    Ticks = 2,
    /// A plan with the tick that received it.
    Plan = 3,
    /// A request with the tick that made it.
    Request = 4,
    /// A log [`Entry`].
    Event = 5,
    /// A [`Line`] of the crossings' ledger.
    Ledger = 7,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Self; 6] =
        [Self::Identity, Self::Ticks, Self::Plan, Self::Request, Self::Event, Self::Ledger];
}

/// Head of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// [`Kind`] of its content.
    pub kind: u8,
    /// Frames since boot before this one.
    pub sequence: u32,
    /// Those of them that found no room on the channel.
    pub dropped: u32,
}

/// Buffer of a frame.
#[derive(Debug)]
#[repr(align(4))]
pub struct FrameBuffer([u8; LONGEST]);

impl FrameBuffer {
    /// An empty buffer.
    pub const EMPTY: Self = Self([0; LONGEST]);

    /// Builds a frame in the buffer and returns it; `fill` writes the body and returns its
    /// length, bytes.
    #[inline]
    pub fn write(&mut self, head: Head, fill: impl FnOnce(&mut [u8; BODY]) -> usize) -> &[u8] {
        let Some((start, rest)) = self.0.split_first_chunk_mut::<HEAD>() else { return &[] };
        let Some(body) = rest.first_chunk_mut::<BODY>() else { return &[] };
        let length = fill(body).min(BODY);
        let padded = length.next_multiple_of(4);
        body[length..padded].fill(0);
        let [a, b] = (length as u16).to_le_bytes();
        start[..4].copy_from_slice(&SYNC);
        start[4..8].copy_from_slice(&[a, b, head.kind, 0]);
        start[8..12].copy_from_slice(&head.sequence.to_le_bytes());
        start[12..].copy_from_slice(&head.dropped.to_le_bytes());
        let end = HEAD + padded;
        let sum = crc32(&self.0[SYNC.len()..end]);
        if let Some(place) = self.0[end..].first_chunk_mut() {
            *place = sum.to_le_bytes();
        }
        &self.0[..end + CHECK]
    }
}

/// A frame whose check fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Its head.
    pub head: Head,
    body: &'a [u8],
}

/// Content of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Body<'a> {
    /// The source of the log.
    Identity(Identity),
    /// Ticks.
    Ticks(Ticks<'a>),
    /// The plan that a tick received.
    Plan(Tick, Plan),
    /// The request of a tick.
    Request(Tick, PlanRequest),
    /// A log entry.
    Event(Entry),
    /// The ledger line of a crossing.
    Ledger(Line),
    /// A kind that this reader does not know.
    Unknown,
}

/// What bytes begin with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found<'a> {
    /// A frame, and its complete length.
    Frame(Frame<'a>, usize),
    /// A possible begin of a frame: more bytes are needed.
    Part,
    /// So many bytes that belong to no frame, at least one.
    Garbage(usize),
}

/// Finds what bytes begin with.
pub fn find(bytes: &[u8]) -> Found<'_> {
    let begins = |at: &usize| SYNC.starts_with(&bytes[*at..bytes.len().min(at + SYNC.len())]);
    let garbage = (0..bytes.len()).find(begins).unwrap_or(bytes.len());
    if garbage > 0 {
        return Found::Garbage(garbage);
    }
    let Some((start, rest)) = bytes.split_first_chunk::<HEAD>() else { return Found::Part };
    let &[_, _, _, _, a, b, kind, zero, ..] = start;
    let length = usize::from(u16::from_le_bytes([a, b]));
    if length > BODY || zero != 0 {
        return Found::Garbage(1);
    }
    let word = |at: usize| start[at..].first_chunk().map_or(0, |word| u32::from_le_bytes(*word));
    let end = HEAD + length.next_multiple_of(4);
    let Some(sum) = bytes.get(end..end + CHECK) else { return Found::Part };
    if crc32(&bytes[SYNC.len()..end]).to_le_bytes() != sum {
        return Found::Garbage(1);
    }
    let head = Head { kind, sequence: word(8), dropped: word(12) };
    Found::Frame(Frame { head, body: &rest[..length] }, end + CHECK)
}

impl<'a> Frame<'a> {
    /// Opens bytes that are one complete frame.
    pub fn open(bytes: &'a [u8]) -> Option<Self> {
        match find(bytes) {
            Found::Frame(frame, length) if length == bytes.len() => Some(frame),
            _ => None,
        }
    }

    /// Reads the body; none if it is not of its kind: written by another program.
    pub fn body(&self) -> Option<Body<'a>> {
        let Some(kind) = Kind::ALL.into_iter().find(|kind| *kind as u8 == self.head.kind) else {
            return Some(Body::Unknown);
        };
        Some(match kind {
            Kind::Identity => Body::Identity(complete(self.body)?),
            Kind::Ticks => Body::Ticks(Ticks { before: DeltaRecord::ZERO, rest: self.body }),
            Kind::Plan => complete(self.body).map(|(at, plan)| Body::Plan(at, plan))?,
            Kind::Request => complete(self.body).map(|(at, request)| Body::Request(at, request))?,
            Kind::Event => Body::Event(complete(self.body)?),
            Kind::Ledger => Body::Ledger(complete(self.body)?),
        })
    }
}

/// The records of a frame, in their order; none in place of the first that is not one.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks<'a> {
    before: DeltaRecord,
    rest: &'a [u8],
}

impl Iterator for Ticks<'_> {
    type Item = Option<Record>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let read = DeltaRecord::take(&self.before, self.rest).and_then(|(delta, rest)| {
            let record = delta.record()?;
            (self.before, self.rest) = (delta, rest);
            Some(record)
        });
        if read.is_none() {
            self.rest = &[];
        }
        Some(read)
    }
}

/// A frame of ticks that is being filled.
#[derive(Debug)]
pub(super) struct TicksFrame {
    buffer: FrameBuffer,
    before: DeltaRecord,
    length: usize,
    ticks: usize,
}

impl TicksFrame {
    pub(super) const fn new() -> Self {
        Self { buffer: FrameBuffer::EMPTY, before: DeltaRecord::ZERO, length: 0, ticks: 0 }
    }

    pub(super) const fn ticks(&self) -> usize {
        self.ticks
    }

    /// The latest tick.
    pub(super) const fn latest(&self) -> Tick {
        self.before.at()
    }

    /// Adds a record; false if there might be no room.
    pub(super) fn push(&mut self, record: &Record) -> bool {
        let rest = self.buffer.0.get_mut(HEAD + self.length..LONGEST - CHECK);
        let Some(room) = rest.and_then(|rest| rest.first_chunk_mut()) else { return false };
        self.length += DeltaRecord::of(record).put(&mut self.before, room);
        self.ticks += 1;
        true
    }

    /// Returns the frame and begins the next.
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

    /// Heads of the frames in these bytes, and how many bytes belong to none.
    fn read(mut bytes: &[u8]) -> (Vec<Head>, usize) {
        let (mut heads, mut garbage) = (Vec::new(), 0);
        loop {
            let used = match find(bytes) {
                Found::Frame(frame, length) => {
                    heads.push(frame.head);
                    length
                }
                Found::Part if bytes.is_empty() => return (heads, garbage),
                // The input ends here.
                Found::Part => {
                    garbage += 1;
                    1
                }
                Found::Garbage(used) => {
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
            let back: Vec<Record> = ticks.map(Option::unwrap).collect();
            prop_assert_eq!(&back[..], &records[..put]);
            prop_assert!(put >= 4.min(records.len()), "{} of any kind fit", put);
        }

        #[test]
        fn a_flipped_bit_is_found(record in any_record(), at in any::<prop::sample::Index>(), bit in 0..8) {
            let mut bytes = frame(&[record], 9).0;
            let at = at.index(bytes.len());
            bytes[at] ^= 1_u8 << bit;
            prop_assert!(Frame::open(&bytes).is_none());
        }

        #[test]
        fn frames_behind_garbage_are_found_whatever_it_is(
            record in any_record(),
            garbage in prop::collection::vec(prop_oneof![any::<u8>(), prop::sample::select(SYNC.to_vec())], 0..600),
            cut in any::<prop::sample::Index>(),
        ) {
            let frames = [frame(&[record], 1).0, frame(&[record, record], 2).0].concat();
            // A partial frame is garbage too, as for a reader that joins late.
            let part = &frames[cut.index(frames.len() / 2)..];
            let bytes = [&garbage[..], part, &frames].concat();
            let heads = read(&bytes).0;
            let sequences: Vec<u32> = heads.iter().map(|head| head.sequence).collect();
            prop_assert!(sequences.ends_with(&[1, 2]), "{sequences:?}");
        }

        #[test]
        fn a_sync_inside_a_frame_is_content(kind in any::<u8>(), at in 0..BODY - 4, length in any::<u16>()) {
            let mut buffer = FrameBuffer::EMPTY;
            let bytes = buffer.write(Head { kind, sequence: 5, dropped: 0 }, |body| {
                body.fill(0);
                body[at..at + 4].copy_from_slice(&SYNC);
                if let Some(place) = body[at + 4..].first_chunk_mut() {
                    *place = length.to_le_bytes();
                }
                BODY
            });
            prop_assert_eq!(read(bytes).0.len(), 1);
            // A frame without its begin yields nothing.
            prop_assert_eq!(read(&bytes[1..]), (vec![], bytes.len() - 1));
        }
    }

    #[test]
    fn the_longest_body_fits() {
        let most = Head { kind: u8::MAX, sequence: u32::MAX, dropped: u32::MAX };
        let mut buffer = FrameBuffer::EMPTY;
        let bytes = buffer.write(most, |body| {
            body.fill(0xA5);
            BODY + 7
        });
        assert_eq!(bytes.len(), LONGEST);
        let frame = Frame::open(bytes).unwrap();
        assert_eq!((frame.head, frame.body), (most, &[0xA5; BODY][..]));
    }
}
