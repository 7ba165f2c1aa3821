//! The binary line to the host: framed and checked in both directions.
//!
//! A frame is postcard with its CRC-32, coded in COBS, with a zero at the end. A reader that
//! joins late or loses bytes is in step again at the next zero, and drops damaged frames.

use serde::{Deserialize, Serialize};

use crate::log::{complete, crc32};
use crate::params::service::{Request, Response};

/// Longest frame including its end, bytes.
pub const LONGEST: usize = 96;

/// What the host sends.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToBoard {
    /// A request about the parameters, with a number that the answer repeats.
    Parameters(u16, Request),
}

/// What the board sends.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToHost {
    /// The answer to the request of this number.
    Parameters(u16, Response),
}

/// Bytes of a frame.
pub type Frame = heapless::Vec<u8, LONGEST>;

/// Bytes of the check.
const CHECK: usize = 4;

/// The frame of a message; none if it is longer than [`LONGEST`], which no message of this
/// module is.
pub fn frame(message: &impl Serialize) -> Option<Frame> {
    let mut room = [0; LONGEST - CHECK];
    let content = postcard::to_slice(message, &mut room).ok()?;
    let mut plain = Frame::from_slice(content).ok()?;
    plain.extend_from_slice(&crc32(content).to_le_bytes()).ok()?;
    let mut coded = Frame::new();
    coded.resize(cobs::max_encoding_length(plain.len()).min(LONGEST), 0).ok()?;
    let length = cobs::try_encode(&plain, &mut coded).ok()?;
    coded.truncate(length);
    coded.push(0).ok()?;
    Some(coded)
}

/// Assembles bytes to frames.
#[derive(Clone, Debug, Default)]
pub struct FrameReader {
    bytes: Frame,
    /// More bytes than fit: all are dropped up to the next end.
    too_long: bool,
    dropped: u32,
}

impl FrameReader {
    /// An empty reader.
    pub const fn new() -> Self {
        Self { bytes: Frame::new(), too_long: false, dropped: 0 }
    }

    /// Frames dropped so far because they were damaged, unknown or too long.
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Takes one byte; returns the message that it completes.
    pub fn take<T: for<'de> Deserialize<'de>>(&mut self, byte: u8) -> Option<T> {
        if byte != 0 {
            self.too_long |= self.bytes.push(byte).is_err();
            return None;
        }
        let message = if self.too_long { None } else { open(&mut self.bytes) };
        let anything = self.too_long || !self.bytes.is_empty();
        if message.is_none() && anything {
            self.dropped = self.dropped.wrapping_add(1);
        }
        self.bytes.clear();
        self.too_long = false;
        message
    }
}

fn open<T: for<'de> Deserialize<'de>>(coded: &mut [u8]) -> Option<T> {
    let length = cobs::decode_in_place(coded).ok()?;
    let (content, sum) = coded.get(..length)?.split_last_chunk::<CHECK>()?;
    if crc32(content) != u32::from_le_bytes(*sum) {
        return None;
    }
    complete(content)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::MAX_NAME;
    use crate::params::service::{Description, Origin, PIECE, Piece};
    use proptest::prelude::*;

    fn gathered<T: for<'de> Deserialize<'de>>(bytes: &[u8]) -> (Vec<T>, u32) {
        let mut gatherer = FrameReader::new();
        let messages = bytes.iter().filter_map(|byte| gatherer.take(*byte)).collect();
        (messages, gatherer.dropped())
    }

    #[test]
    fn the_longest_messages_fit() {
        let piece = Piece::from_slice(&[0xFF; PIECE]).unwrap();
        let down = ToBoard::Parameters(u16::MAX, Request::Append(piece.clone()));
        let coded = frame(&down).expect("fits");
        assert_eq!(gathered::<ToBoard>(&coded), (vec![down], 0));
        for response in [
            Response::Piece(piece),
            Response::Description(Description {
                origin: Origin::Stored { sequence: u32::MAX },
                length: u16::MAX,
                schema: u16::MAX,
                expected: u16::MAX,
                name: "n".repeat(MAX_NAME).parse().unwrap(),
                parameters: u32::MAX,
                running: u32::MAX,
            }),
        ] {
            let up = ToHost::Parameters(u16::MAX, response);
            let coded = frame(&up).expect("fits");
            assert_eq!(gathered::<ToHost>(&coded), (vec![up], 0));
        }
    }

    proptest! {
        #[test]
        fn frames_come_through_garbage(
            numbers in prop::collection::vec(any::<u16>(), 1..6),
            garbage in prop::collection::vec(any::<u8>(), 0..300),
        ) {
            let mut bytes = garbage;
            bytes.push(0);
            let sent: Vec<_> =
                numbers.iter().map(|n| ToBoard::Parameters(*n, Request::Seal)).collect();
            for message in &sent {
                bytes.extend(frame(message).unwrap());
            }
            let (got, _) = gathered::<ToBoard>(&bytes);
            prop_assert_eq!(got, sent);
        }

        #[test]
        fn a_damaged_frame_is_dropped_and_counted(at in 0_usize..20, bit in 0_u8..8) {
            let piece = Piece::from_slice(&[3; 16]).unwrap();
            let message = ToBoard::Parameters(9, Request::Append(piece));
            let mut coded = frame(&message).unwrap();
            let at = at % (coded.len() - 1);
            coded[at] ^= 1 << bit;
            let (got, dropped) = gathered::<ToBoard>(&coded);
            prop_assert_eq!(got, vec![]);
            prop_assert!(dropped > 0);
        }
    }
}
