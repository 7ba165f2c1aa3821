//! A host that saves parameters, while power is lost or the board is reset.

use interstage::params::link::{FrameReader, ToBoard, ToHost, frame};
use interstage::params::service::{PIECE, Piece, Request, Response};

use crate::machine::Machine;
use crate::peripherals::flash::Cut;

/// Time after which a refused save is tried again, ms.
const RETRY: u32 = 10;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Saving {
    /// Requested; the board refuses, or has not answered yet.
    Requested,
    Writing,
    /// The board restarted before it confirmed the save.
    Interrupted,
    /// The board has confirmed the save.
    Stored,
}

/// The host.
pub(super) struct Save {
    set: Vec<u8>,
    cut: Cut,
    armed: bool,
    pub(super) state: Saving,
    accepted: usize,
    /// Number of the request without an answer.
    open: Option<u16>,
    number: u16,
    /// Milliseconds until the next request.
    pause: u32,
    /// Bytes that the board has not taken yet.
    pub(super) to_board: Vec<u8>,
    reader: FrameReader,
    /// Restarts of the board before it began.
    restarts: usize,
}

impl Save {
    pub(super) fn new(machine: &Machine, set: Vec<u8>, cut: Cut) -> Self {
        Self {
            set,
            cut,
            armed: false,
            state: Saving::Requested,
            accepted: 0,
            open: None,
            number: 0,
            pause: 0,
            to_board: Vec::new(),
            reader: FrameReader::new(),
            restarts: machine.restarts().len(),
        }
    }

    /// Cycle at which the board restarted during the save.
    pub(super) fn cut_at(&self, machine: &Machine) -> Option<u64> {
        machine.restarts().get(self.restarts).map(|(at, _)| *at)
    }

    /// A millisecond begins: the board took `sent` bytes and answered with `received`.
    pub(super) fn exchanged(&mut self, machine: &mut Machine, received: &[u8], sent: usize) {
        self.to_board.drain(..sent.min(self.to_board.len()));
        for byte in received {
            if let Some(ToHost::Parameters(number, response)) = self.reader.take(*byte)
                && self.open == Some(number)
            {
                self.open = None;
                self.take(&response);
            }
        }
        if self.cut_at(machine).is_some() && self.state != Saving::Stored {
            self.state = Saving::Interrupted;
            self.to_board.clear();
        }
        if matches!(self.state, Saving::Interrupted | Saving::Stored) || self.open.is_some() {
            return;
        }
        if self.pause > 0 {
            self.pause -= 1;
            return;
        }
        if !std::mem::replace(&mut self.armed, true) {
            machine.chip_mut().flash.cut_power(self.cut);
        }
        self.number = self.number.wrapping_add(1);
        let message = ToBoard::Parameters(self.number, self.request());
        if let Some(bytes) = frame(&message) {
            self.open = Some(self.number);
            self.to_board.extend(bytes);
        }
    }

    fn pieces(&self) -> usize {
        self.set.len().div_ceil(PIECE)
    }

    fn request(&self) -> Request {
        match self.accepted.checked_sub(1) {
            None => Request::Begin { length: self.set.len() as u16 },
            Some(piece) if piece < self.pieces() => {
                let from = piece * PIECE;
                let bytes = &self.set[from..self.set.len().min(from + PIECE)];
                Request::Append(Piece::from_slice(bytes).unwrap_or_default())
            }
            Some(_) => Request::Seal,
        }
    }

    fn take(&mut self, response: &Response) {
        if *response != Response::Done {
            (self.accepted, self.pause, self.state) = (0, RETRY, Saving::Requested);
            return;
        }
        self.state = Saving::Writing;
        if self.accepted > self.pieces() {
            self.state = Saving::Stored;
        }
        self.accepted += 1;
    }
}
