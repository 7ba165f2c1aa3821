//! Parameters stored by the firmware in the emulated board's flash, and power that goes
//! while it writes.

use interstage::params::compile;
use interstage::params::link::{FrameReader, ToBoard, ToHost, frame};
use interstage::params::service::{Origin, PIECE, Piece, Request, Response};
use interstage::rig::Rig;
use rig_board::chip::map::PARAMETER_SETS;
use rig_board::peripherals::flash::{Cut, Wrong};
use rig_board::peripherals::rcc::Cause;

use crate::common;

/// A set that the image does not carry.
fn set() -> Vec<u8> {
    let mut rig = Rig::prototype();
    rig.preload.cruise_n += 1.0;
    compile("changed", &rig).expect("a sound rig").to_vec()
}

/// A board and the host at its binary line.
struct Board {
    board: common::Board,
    reader: FrameReader,
    number: u16,
}

impl Board {
    /// Powered up and idle.
    fn idle() -> Self {
        Self { board: common::Board::idle(), reader: FrameReader::new(), number: 0 }
    }

    /// Runs until the log has this text.
    fn until(&mut self, text: &str) {
        self.board.until(text, 3000);
    }

    fn restarts(&self) -> usize {
        self.board.bench.machine.restarts().len()
    }

    /// Sends a request; no response if the board restarts first.
    fn ask(&mut self, request: Request) -> Option<Response> {
        let before = self.restarts();
        self.number += 1;
        let frame = frame(&ToBoard::Parameters(self.number, request)).expect("fits");
        let mut sent = 0;
        while sent < frame.len() {
            sent += self.board.bench.line_send(&frame[sent..]).expect("runs");
            if sent < frame.len() {
                self.board.step();
            }
        }
        for _ in 0..500 {
            self.board.step();
            if self.restarts() > before {
                self.reader = FrameReader::new();
                return None;
            }
            for byte in self.board.bench.line_take().expect("runs") {
                if let Some(ToHost::Parameters(number, response)) = self.reader.take(byte)
                    && number == self.number
                {
                    return Some(response);
                }
            }
        }
        panic!("no answer");
    }

    /// Stores a set; false if power went meanwhile.
    fn store(&mut self, set: &[u8]) -> bool {
        let begin = Request::Begin { length: set.len() as u16 };
        let pieces =
            set.chunks(PIECE).map(|piece| Request::Append(Piece::from_slice(piece).expect("fits")));
        for request in std::iter::once(begin).chain(pieces).chain([Request::Seal]) {
            match self.ask(request) {
                Some(response) => assert_eq!(response, Response::Done),
                None => return false,
            }
        }
        true
    }

    /// Origin of the active set, and its rig's name.
    fn active(&mut self) -> (Origin, String) {
        match self.ask(Request::Describe) {
            Some(Response::Description(d)) => (d.origin, d.name.as_str().to_owned()),
            other => panic!("{other:?}"),
        }
    }

    fn operations(&self) -> u64 {
        self.board.bench.machine.chip().flash.begun
    }
}

#[test]
fn a_stored_set_is_active_after_a_loss_of_power() {
    let mut board = Board::idle();
    assert_eq!(board.active().0, Origin::Image);
    assert!(board.store(&set()));
    let stored = (Origin::Stored { sequence: 1 }, "changed".to_owned());
    assert_eq!(board.active(), stored);
    board.board.machine().restart(Cause::Power).expect("restarts");
    board.until("mode: idle");
    assert_eq!(board.active(), stored);
    assert_eq!(board.board.machine().chip().strays.count(), 0);
}

/// The chip breaks the timers by a flag of its own, which a reset of the fault has to clear.
#[test]
fn a_damaged_set_stops_the_drive_until_the_fault_is_reset() {
    let mut board = Board::idle();
    assert!(board.store(&set()));
    let place = PARAMETER_SETS + 2 * PIECE as u32;
    board.board.machine().spoil(place, Wrong::Check).expect("flash");
    board.active();
    board.until("fault 151");
    // A fault is held for a tenth of a second at least.
    board.board.run(150);
    board.board.send(b'0');
    board.until("mode: idle");
    board.board.send(b's');
    board.until("deploying: cruise");
}

#[test]
fn power_lost_in_any_write_leaves_the_old_set_or_the_new() {
    let set = set();
    let mut board = Board::idle();
    let before = board.operations();
    assert!(board.store(&set));
    let all = board.operations() - before;
    assert!(all > set.len() as u64 / 8, "{all}");
    // The erasing, the first and some later words, the last and what seals.
    for cut in [1, 2, 3, 4, all / 2, all - 2, all - 1, all] {
        for cut in [Cut::Within(cut), Cut::After(cut)] {
            let mut board = Board::idle();
            board.board.machine().chip_mut().flash.cut_power(cut);
            // If the last write was over, the answer may yet have been sent.
            let done = board.store(&set) && board.restarts() == 0;
            if board.restarts() == 0 {
                board.board.step();
            }
            board.until("mode: idle");
            assert_eq!(board.restarts(), 1, "{cut:?}");
            let (origin, name) = board.active();
            // Intact; a half-written header reads as an erased number.
            let new = origin != Origin::Image && name == "changed";
            assert!(new || origin == Origin::Image, "{cut:?}: {origin:?} {name}");
            assert!(new || !done, "{cut:?}: it had said that it is stored");
            // What the supply tore is not read any more: the chip would cut the bridges.
            board.board.send(b's');
            board.until("mode: preloading to deploy");
            assert_eq!(board.active(), (origin, name), "{cut:?}");
            board.until("deploying: cruise");
            board.board.send(b'x');
            board.until("mode: idle");
            // A half-written set does not block the next save.
            assert!(board.store(&set), "{cut:?}");
            assert_eq!(board.active().1, "changed", "{cut:?}");
        }
    }
}
