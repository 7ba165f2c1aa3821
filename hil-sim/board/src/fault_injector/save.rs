//! A host that saves parameters, and power or reset that comes while the board writes them.

use interstage::params::link::{FrameReader, ToBoard, ToHost, frame};
use interstage::params::service::{PIECE, Piece, Request, Response};

use crate::machine::Machine;
use crate::peripherals::flash::Cut;

/// How long it is waited before a save that was refused is tried again, ms.
const AGAIN: u32 = 10;

/// How far a save has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Saving {
    /// Asked for; so far the board refuses, or has not answered.
    Asked,
    /// The board writes.
    Writing,
    /// The board restarted before it had said that all is stored.
    BrokenOff,
    /// The board has said that all is stored.
    Stored,
}

/// The host.
pub(super) struct Save {
    set: Vec<u8>,
    cut: Cut,
    armed: bool,
    state: Saving,
    /// Pieces that have been taken, the beginning among them.
    taken: usize,
    /// Number of the request that has not been answered yet.
    open: Option<u16>,
    number: u16,
    /// Milliseconds until it asks again.
    pause: u32,
    /// Bytes on their way down.
    down: Vec<u8>,
    gatherer: FrameReader,
    /// Restarts of the board before it began.
    restarts: usize,
}

impl Save {
    pub(super) fn new(machine: &Machine, set: Vec<u8>, cut: Cut) -> Self {
        Self {
            set,
            cut,
            armed: false,
            state: Saving::Asked,
            taken: 0,
            open: None,
            number: 0,
            pause: 0,
            down: Vec::new(),
            gatherer: FrameReader::new(),
            restarts: machine.restarts().len(),
        }
    }

    pub(super) const fn state(&self) -> Saving {
        self.state
    }

    /// When the board restarted under it, in cycles.
    pub(super) fn cut_at(&self, machine: &Machine) -> Option<u64> {
        machine.restarts().get(self.restarts).map(|(at, _)| *at)
    }

    /// A millisecond begins: what has come up, and how much of what was to go down went.
    pub(super) fn turn(&mut self, machine: &mut Machine, came: &[u8], went: usize) {
        self.down.drain(..went.min(self.down.len()));
        for byte in came {
            if let Some(ToHost::Parameters(number, response)) = self.gatherer.take(*byte)
                && self.open == Some(number)
            {
                self.open = None;
                self.take(&response);
            }
        }
        if self.cut_at(machine).is_some() && self.state != Saving::Stored {
            self.state = Saving::BrokenOff;
            self.down.clear();
        }
        if matches!(self.state, Saving::BrokenOff | Saving::Stored) || self.open.is_some() {
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
            self.down.extend(bytes);
        }
    }

    /// The bytes that are to go down.
    pub(super) fn says(&self) -> Vec<u8> {
        self.down.clone()
    }

    fn pieces(&self) -> usize {
        self.set.len().div_ceil(PIECE)
    }

    fn request(&self) -> Request {
        match self.taken.checked_sub(1) {
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
            (self.taken, self.pause, self.state) = (0, AGAIN, Saving::Asked);
            return;
        }
        self.state = Saving::Writing;
        if self.taken > self.pieces() {
            self.state = Saving::Stored;
        }
        self.taken += 1;
    }
}
