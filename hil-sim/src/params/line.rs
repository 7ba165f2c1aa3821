//! A board's parameters over its binary line.

use std::time::Duration;

use interstage::params::link::{FrameReader, ToBoard, ToHost, frame};
use interstage::params::service::{Description, Origin, PIECE, Piece, Request, Response};

use super::{Held, Store, StoreError};
use crate::probe::{Port, exchange};

/// Timeout of an answer: erasing takes 50 ms.
const TIMEOUT: Duration = Duration::from_secs(1);

/// RTT channels of the line, down and up.
const DOWN: u32 = 1;
const UP: u32 = 2;

/// Asks a board about its parameters.
pub struct Client<P> {
    port: P,
    gatherer: FrameReader,
    number: u16,
}

impl<P: Port> Client<P> {
    pub const fn new(port: P) -> Self {
        Self { port, gatherer: FrameReader::new(), number: 0 }
    }

    pub fn into_port(self) -> P {
        self.port
    }

    /// The port, to listen to it.
    pub(crate) const fn port_mut(&mut self) -> &mut P {
        &mut self.port
    }

    /// One request, one answer; ignores answers to earlier requests.
    pub fn ask(&mut self, request: Request) -> Result<Response, StoreError> {
        self.number = self.number.wrapping_add(1);
        let message = ToBoard::Parameters(self.number, request);
        let bytes = frame(&message).ok_or(StoreError::Answer)?;
        let own = |answer| match answer {
            ToHost::Parameters(number, response) if number == self.number => Some(response),
            _ => None,
        };
        let (lines, times) = ((DOWN, UP), (TIMEOUT, TIMEOUT));
        match exchange(&mut self.port, &mut self.gatherer, lines, &bytes, times, own)? {
            Some(Response::Refused(refusal)) => Err(StoreError::Refused(refusal.sentence())),
            Some(response) => Ok(response),
            None => Err(StoreError::Silent { seconds: TIMEOUT.as_secs_f64() }),
        }
    }

    fn done(&mut self, request: Request) -> Result<(), StoreError> {
        match self.ask(request)? {
            Response::Done => Ok(()),
            _ => Err(StoreError::Answer),
        }
    }

    /// The board's description of its parameters.
    pub(crate) fn describe(&mut self) -> Result<Description, StoreError> {
        match self.ask(Request::Describe)? {
            Response::Description(description) => Ok(description),
            _ => Err(StoreError::Answer),
        }
    }

    fn read(&mut self, length: usize) -> Result<Vec<u8>, StoreError> {
        let mut set = Vec::new();
        while set.len() < length {
            match self.ask(Request::Read { offset: set.len() as u16 })? {
                Response::Piece(piece) if !piece.is_empty() => set.extend(piece),
                _ => return Err(StoreError::Answer),
            }
        }
        Ok(set)
    }
}

impl<P: Port> Store for Client<P> {
    fn held(&mut self) -> Result<Held, StoreError> {
        let description = self.describe()?;
        let origin = match description.origin {
            Origin::Image => "the image: nothing is stored".to_owned(),
            Origin::Stored { sequence } => format!("flash, set number {sequence}"),
        };
        let set = self.read(description.length.into())?;
        Held::of(&set, origin).map_err(|source| StoreError::Set { place: "board".into(), source })
    }

    fn put(&mut self, set: &[u8]) -> Result<(), StoreError> {
        let length = u16::try_from(set.len()).map_err(|_| StoreError::Answer)?;
        self.done(Request::Begin { length })?;
        for piece in set.chunks(PIECE) {
            let piece = Piece::from_slice(piece).map_err(|_| StoreError::Answer)?;
            self.done(Request::Append(piece))?;
        }
        self.done(Request::Seal)
    }

    fn restore(&mut self) -> Result<(), StoreError> {
        self.done(Request::Restore)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::set_of;
    use crate::probe::{Mute, PortError};
    use interstage::params::Refusal;
    use interstage::params::service::Service;
    use interstage::params::slots::{PAGE_BYTES, SLOT_BYTES, SetMemory, Slot, WORD_BYTES};
    use interstage::rig::Rig;

    struct Flash([Vec<u8>; 2]);

    impl SetMemory for Flash {
        fn bytes(&self, slot: Slot) -> &[u8] {
            &self.0[slot as usize]
        }

        async fn erase(&mut self, slot: Slot, page: usize) -> Result<(), Refusal> {
            self.0[slot as usize][page * PAGE_BYTES..][..PAGE_BYTES].fill(0xFF);
            Ok(())
        }

        async fn program(
            &mut self,
            slot: Slot,
            offset: usize,
            word: [u8; WORD_BYTES],
        ) -> Result<(), Refusal> {
            self.0[slot as usize][offset..][..WORD_BYTES].copy_from_slice(&word);
            Ok(())
        }
    }

    /// A board's end of the line, with a narrow buffer and lost bytes.
    struct Board {
        service: Service<Flash>,
        gatherer: FrameReader,
        answers: Vec<u8>,
        at_rest: bool,
        /// Every so many bytes down are lost; 0 for none.
        loses: usize,
        seen: usize,
        now: Duration,
    }

    impl Board {
        fn new() -> Self {
            let image = set_of("prototype", &Rig::prototype()).unwrap().leak();
            let flash = Flash([vec![0xFF; SLOT_BYTES], vec![0xFF; SLOT_BYTES]]);
            Self {
                service: Service::new(flash, image, 0),
                gatherer: FrameReader::new(),
                answers: Vec::new(),
                at_rest: true,
                loses: 0,
                seen: 0,
                now: Duration::ZERO,
            }
        }
    }

    impl Port for Board {
        fn down(&mut self, _: u32, bytes: &[u8]) -> Result<usize, PortError> {
            let taken = bytes.len().min(7);
            for byte in &bytes[..taken] {
                self.seen += 1;
                if self.loses > 0 && self.seen.is_multiple_of(self.loses) {
                    continue;
                }
                if let Some(ToBoard::Parameters(number, request)) = self.gatherer.take(*byte) {
                    let answer = self.service.answer(request, self.at_rest);
                    let response = embassy_futures::block_on(answer);
                    let message = ToHost::Parameters(number, response);
                    self.answers.extend(frame(&message).unwrap());
                }
            }
            Ok(taken)
        }

        fn up(&mut self, _: u32) -> Result<Vec<u8>, PortError> {
            let half = self.answers.len().div_ceil(2);
            Ok(self.answers.drain(..half).collect())
        }

        fn reset(&mut self) -> Result<(), PortError> {
            panic!("parameters take no reset");
        }

        fn memory(&mut self, _: u32, _: &mut [u8]) -> Result<(), PortError> {
            panic!("memory is not read");
        }

        fn pass(&mut self) -> Result<(), PortError> {
            self.now += Duration::from_millis(5);
            Ok(())
        }

        fn now(&self) -> Duration {
            self.now
        }
    }

    #[test]
    fn parameters_go_there_and_back() {
        let mut client = Client::new(Board::new());
        assert_eq!(client.held().unwrap().rig, Rig::prototype());
        client.put(&set_of("fe", &Rig::fe()).unwrap()).unwrap();
        let held = client.held().unwrap();
        assert_eq!((held.name.as_str(), &held.rig), ("fe", &Rig::fe()));
        assert!(held.origin.contains("number 1"), "{}", held.origin);
        client.restore().unwrap();
        assert_eq!(client.held().unwrap().rig, Rig::prototype());
    }

    #[test]
    fn a_refusal_is_reported_in_words() {
        let mut board = Board::new();
        board.at_rest = false;
        let mut client = Client::new(board);
        let error = client.restore().unwrap_err().to_string();
        assert!(error.contains("not at rest"), "{error}");
        assert_eq!(client.held().unwrap().rig, Rig::prototype());
    }

    #[test]
    fn a_line_that_loses_bytes_ends_in_an_error_and_changes_nothing() {
        let mut board = Board::new();
        board.loses = 400;
        let mut client = Client::new(board);
        let error = client.put(&set_of("fe", &Rig::fe()).unwrap()).unwrap_err();
        assert!(matches!(error, StoreError::Silent { .. }), "{error}");
        client.port.loses = 0;
        assert_eq!(client.held().unwrap().rig, Rig::prototype());
    }
    #[test]
    fn a_slow_probe_does_not_stretch_the_timeout() {
        let mut client = Client::new(Mute::new());
        let error = client.ask(Request::Describe).unwrap_err();
        assert!(matches!(error, StoreError::Silent { .. }), "{error}");
        let waited = client.port.now();
        assert!(waited < TIMEOUT + Duration::from_millis(20), "{waited:?}");
    }
}
