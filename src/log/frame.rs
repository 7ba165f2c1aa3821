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
use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};
use postcard::ser_flavors::Flavor;
use serde::{Deserialize, Serialize};

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

/// Writes a frame into `bytes` and returns it with the zero that ends it.
pub fn write(bytes: &mut [u8; LONGEST], head: Head, fill: impl FnOnce(&mut Writer<'_>)) -> &[u8] {
    // The last byte is kept for the end.
    let mut writer = Writer::new(&mut bytes[..LONGEST - 1], head);
    fill(&mut writer);
    let length = writer.close();
    bytes[length] = 0;
    &bytes[..=length]
}

/// A frame that is being written.
pub struct Writer<'a> {
    cobs: CobsEncoder<'a>,
    digest: Digest<'static, u32, Table<1>>,
    written: usize,
}

impl<'a> Writer<'a> {
    /// Begins a frame. There is always room for the head.
    #[inline(never)]
    fn new(room: &'a mut [u8], head: Head) -> Self {
        let mut writer = Self { cobs: CobsEncoder::new(room), digest: CRC.digest(), written: 0 };
        let _ = writer.put(&(head.kind, head.sequence, head.dropped));
        writer
    }

    /// Appends a value. False if it did not fit; the frame is then spoilt.
    #[must_use]
    pub fn put(&mut self, value: &impl Serialize) -> bool {
        postcard::serialize_with_flavor(value, &mut *self).is_ok()
    }

    /// Whether a value of so many bytes will fit.
    #[must_use]
    pub fn has_room(&self, bytes: usize) -> bool {
        // COBS adds a byte to the first and to every 254; the check comes last.
        let whole = self.written + bytes + CHECK;
        whole + whole / 254 + 1 < LONGEST
    }

    /// Appends the check; the frame is the first so many bytes.
    #[inline(never)]
    fn close(self) -> usize {
        let Self { mut cobs, digest, .. } = self;
        // Room for it has been kept by `has_room`.
        let _ = cobs.push(&digest.finalize().to_le_bytes());
        cobs.finalize()
    }
}

impl Flavor for &mut Writer<'_> {
    type Output = ();

    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.try_extend(&[byte])
    }

    /// Not inlined, or its body would stand wherever a number is written.
    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        if !self.has_room(bytes.len()) {
            return Err(postcard::Error::SerializeBufferFull);
        }
        self.digest.update(bytes);
        self.written += bytes.len();
        self.cobs.push(bytes).map_err(|_| postcard::Error::SerializeBufferFull)
    }

    fn finalize(self) -> postcard::Result<()> {
        Ok(())
    }
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

/// Appends ticks to a frame until it has no more room for one or there are none.
pub(super) fn put_ticks(writer: &mut Writer<'_>, mut next: impl FnMut() -> Option<Record>) {
    let mut before = Wire::default();
    while writer.has_room(wire::LONGEST) {
        let Some(record) = next() else { return };
        let wire = Wire::of(&record);
        let _ = writer.put(&wire.since(&before));
        before = wire;
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
            let length = write(&mut bytes, head(Kind::Ticks, sequence), |writer| {
                put_ticks(writer, next);
            })
            .len();
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
            let whole = write(&mut bytes, head(Kind::Ticks, 9), |writer| {
                put_ticks(writer, || once.take());
            });
            let length = whole.len() - 1;
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
    fn a_value_that_does_not_fit_is_refused() {
        let mut bytes = [0; LONGEST];
        let whole = write(&mut bytes, head(Kind::Event, 0), |writer| {
            assert!(writer.put(&[7_u8; 32]));
            while writer.has_room(32) {
                assert!(writer.put(&[7_u8; 32]));
            }
            assert!(!writer.put(&[7_u8; 32]));
            while writer.put(&7_u8) {}
        });
        assert!(whole.len() > LONGEST - 4);
        let (_, frame) = whole.split_last().unwrap();
        assert!(Frame::open(&mut frame.to_vec()).is_ok());
    }
}
