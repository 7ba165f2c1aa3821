//! A frame of the binary log: how it lies on the channel.
//!
//! ```text
//! COBS( kind | sequence | dropped | body | CRC-32, little end first ) 00
//! ```
//! Numbers and body are postcard. A zero ends a frame and occurs nowhere else, so that a
//! reader that comes late or meets garbage is in step again at the next zero. Every frame
//! stands for itself: the loss of one takes nothing from the others. The sequence counts
//! frames since boot, those that found no room too; `dropped` counts these.

use cobs::CobsEncoder;
use crc::{CRC_32_ISO_HDLC, Crc, Table};
use serde::Deserialize;

use super::capture::Shots;
use super::entry::Entry;
use super::identity::Identity;
use super::ledger::Line;
use super::record::Record;
use super::wire::{self, Wire};
use crate::model::{Plan, PlanRequest};
use crate::units::Tick;

/// Longest frame on the channel with its end, bytes.
pub const LONGEST: usize = 512;

/// Bytes of the check.
const CHECK: usize = 4;

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

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
    /// A piece of a capture: [`Shots`].
    Shots = 6,
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
        Self::Shots,
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

/// Longest body, bytes. With head, check, stuffing and end it just fits into a frame.
pub const BODY: usize = LONGEST - HEAD - CHECK - STUFFING - 1;

/// Longest head: kind, sequence, dropped.
const HEAD: usize = 1 + 5 + 5;

/// What COBS adds at most: a byte, and one for every 254.
const STUFFING: usize = 1 + LONGEST / 254;

/// Writes a frame into `bytes` and returns it with the zero that ends it; of a body longer
/// than [`BODY`], only so much.
pub fn write<'a>(bytes: &'a mut [u8; LONGEST], head: Head, body: &[u8]) -> &'a [u8] {
    let body = &body[..body.len().min(BODY)];
    let mut start = [0; HEAD];
    let start = match postcard::to_slice(&(head.kind, head.sequence, head.dropped), &mut start) {
        Ok(start) => &*start,
        // It has room for the largest.
        Err(_) => &[],
    };
    let mut digest = CRC.digest();
    let mut cobs = CobsEncoder::new(&mut bytes[..LONGEST - 1]);
    for part in [start, body] {
        digest.update(part);
        // There is room, see [`BODY`].
        let _ = cobs.push(part);
    }
    let _ = cobs.push(&digest.finalize().to_le_bytes());
    let length = cobs.finalize();
    bytes[length] = 0;
    &bytes[..=length]
}

/// Why bytes are not a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// Not what COBS makes of anything.
    Stuffing,
    /// The check does not fit, or the bytes are too few for one.
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
    Shots(Shots),
    /// A crossing was closed.
    Ledger(Line),
    /// Something that this reader does not know.
    Unknown,
}

impl<'a> Frame<'a> {
    /// Opens what stands between two zeros, in place.
    ///
    /// # Errors
    /// [`FrameError`] for anything but a whole frame.
    pub fn open(bytes: &'a mut [u8]) -> Result<Self, FrameError> {
        let length = cobs::decode_in_place(bytes).map_err(|_| FrameError::Stuffing)?;
        let whole = bytes.get(..length).ok_or(FrameError::Stuffing)?;
        let (content, sum) = whole.split_last_chunk::<CHECK>().ok_or(FrameError::Check)?;
        if CRC.checksum(content) != u32::from_le_bytes(*sum) {
            return Err(FrameError::Check);
        }
        let ((kind, sequence, dropped), body) = take(content)?;
        Ok(Self { head: Head { kind, sequence, dropped }, body })
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
            Kind::Ticks => Body::Ticks(Ticks { before: Wire::default(), rest: self.body }),
            Kind::Plan => whole(self.body).map(|(at, plan)| Body::Plan(at, plan))?,
            Kind::Request => whole(self.body).map(|(at, request)| Body::Request(at, request))?,
            Kind::Event => Body::Event(whole(self.body)?),
            Kind::Shots => Body::Shots(whole(self.body)?),
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
    before: Wire,
    rest: &'a [u8],
}

impl Iterator for Ticks<'_> {
    type Item = Result<Record, FrameError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let read = take::<Wire>(self.rest).and_then(|(difference, rest)| {
            let wire = difference.after(&self.before);
            let record = wire.record().ok_or(FrameError::Content)?;
            (self.before, self.rest) = (wire, rest);
            Ok(record)
        });
        if read.is_err() {
            self.rest = &[];
        }
        Some(read)
    }
}

/// Makes a body of ticks until it is full or there are none; its length.
pub(super) fn put_ticks(body: &mut [u8; BODY], mut next: impl FnMut() -> Option<Record>) -> usize {
    let (mut before, mut length) = (Wire::default(), 0);
    while let Some(room) = body.get_mut(length..length + wire::LONGEST) {
        let Some(record) = next() else { break };
        let wire = Wire::of(&record);
        length += wire.since(&before).put(room);
        before = wire;
    }
    length
}

#[cfg(test)]
mod tests {
    use super::super::record::tests::any_record;
    use super::*;
    use proptest::prelude::*;

    fn head(kind: Kind, sequence: u32) -> Head {
        Head { kind: kind as u8, sequence, dropped: sequence / 3 }
    }

    proptest! {
        #[test]
        fn ticks_come_back(
            records in prop::collection::vec(any_record(), 0..12),
            sequence in any::<u32>(),
        ) {
            let mut bytes = [0xA5; LONGEST];
            let mut left = records.iter().copied();
            let mut put = 0;
            let next = || {
                let next = left.next();
                put += usize::from(next.is_some());
                next
            };
            let mut body = [0; BODY];
            let used = put_ticks(&mut body, next);
            let length = write(&mut bytes, head(Kind::Ticks, sequence), &body[..used]).len();
            let (end, frame) = bytes[..length].split_last_mut().unwrap();
            prop_assert_eq!(*end, 0);
            prop_assert!(!frame.contains(&0), "a zero inside");
            let frame = Frame::open(frame).unwrap();
            prop_assert_eq!(frame.head, head(Kind::Ticks, sequence));
            let Body::Ticks(ticks) = frame.body().unwrap() else { panic!("ticks") };
            let back: Vec<Record> = ticks.map(Result::unwrap).collect();
            prop_assert_eq!(&back[..], &records[..put]);
            prop_assert!(put >= 4.min(records.len()), "{} of any kind fit", put);
        }

        #[test]
        fn a_flipped_bit_is_found(record in any_record(), at in any::<prop::sample::Index>(), bit in 0..8) {
            let mut bytes = [0; LONGEST];
            let mut once = Some(record);
            let mut body = [0; BODY];
            let used = put_ticks(&mut body, || once.take());
            let length = write(&mut bytes, head(Kind::Ticks, 9), &body[..used]).len() - 1;
            let frame = &mut bytes[..length];
            frame[at.index(length)] ^= 1_u8 << bit;
            prop_assert!(Frame::open(frame).is_err());
        }

        #[test]
        fn random_bytes_are_no_frame_and_no_panic(
            mut bytes in prop::collection::vec(any::<u8>(), 0..600),
        ) {
            if let Ok(frame) = Frame::open(&mut bytes) {
                // A check that fits by chance.
                let _ = frame.body();
            }
        }

        #[test]
        fn a_body_of_random_bytes_is_no_panic(
            kind in 0..9_u8,
            body in prop::collection::vec(any::<u8>(), 0..300),
        ) {
            let frame = Frame { head: Head { kind, sequence: 0, dropped: 0 }, body: &body };
            if let Ok(Body::Ticks(ticks)) = frame.body() {
                prop_assert!(ticks.count() <= body.len());
            }
        }
    }

    #[test]
    fn the_longest_body_fits_whatever_it_is() {
        let most = Head { kind: u8::MAX, sequence: u32::MAX, dropped: u32::MAX };
        for byte in [0, 1, 255] {
            let (mut bytes, body) = ([0xA5; LONGEST], [byte; BODY + 7]);
            let whole = write(&mut bytes, most, &body);
            let (end, frame) = whole.split_last().unwrap();
            assert!(*end == 0 && !frame.contains(&0));
            let mut frame = frame.to_vec();
            let frame = Frame::open(&mut frame).unwrap();
            assert_eq!((frame.head, frame.body), (most, &body[..BODY]));
        }
    }
}
