//! Parameters stored by the firmware in the emulated board's flash, and power that goes
//! while it writes.

use hil_sim::scenario::Scenario;
use interstage::params::compile;
use interstage::params::link::{FrameReader, ToBoard, ToHost, frame};
use interstage::params::service::{Origin, PIECE, Piece, Request, Response};
use interstage::rig::Rig;
use rig_board::bench::Bench;
use rig_board::chip::map::PARAMETER_SETS;
use rig_board::peripherals::flash::{Cut, Wrong};
use rig_board::peripherals::rcc::Cause;
use rig_board::rtt::Probe;

use crate::common::{elf, strings};

/// Channels of the binary line.
const UP: u32 = 2;
const DOWN: u32 = 1;

/// A set that the image does not carry.
fn set() -> Vec<u8> {
    let mut rig = Rig::prototype();
    rig.preload.cruise_n += 1.0;
    compile("changed", &rig).expect("a sound rig").to_vec()
}

/// A board and the host at its binary line.
struct Board {
    bench: Bench<'static>,
    probe: Probe,
    reader: FrameReader,
    number: u16,
}

impl Board {
    /// Powered up and idle.
    fn idle() -> Self {
        let scenario = Scenario::resolve(Some("prototype"), None, &[]).expect("a scenario");
        let bench = Bench::new(elf(), strings(), &scenario).expect("a bench");
        let probe = Probe::of(&bench.machine).expect("a control block");
        let mut board = Self { bench, probe, reader: FrameReader::new(), number: 0 };
        board.until("mode: idle");
        board
    }

    /// Runs until the log has this text.
    fn until(&mut self, text: &str) {
        let mut said = Vec::new();
        for _ in 0..3000 {
            let (_, lines) = self.bench.step().expect("runs");
            said.extend(lines.into_iter().map(|line| line.text));
            if said.iter().any(|line| line.contains(text)) {
                return;
            }
        }
        panic!("no `{text}`: {said:#?}");
    }

    fn restarts(&self) -> usize {
        self.bench.machine.restarts().len()
    }

    /// Sends a request; no response if the board restarts first.
    fn ask(&mut self, request: Request) -> Option<Response> {
        let before = self.restarts();
        self.number += 1;
        let frame = frame(&ToBoard::Parameters(self.number, request)).expect("fits");
        let mut sent = 0;
        while sent < frame.len() {
            sent += self.probe.down(&mut self.bench.machine, DOWN, &frame[sent..]).expect("runs");
            if sent < frame.len() {
                self.bench.step().expect("runs");
            }
        }
        for _ in 0..500 {
            self.bench.step().expect("runs");
            if self.restarts() > before {
                self.reader = FrameReader::new();
                return None;
            }
            for byte in self.probe.up(&mut self.bench.machine, UP).expect("runs") {
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
        self.bench.machine.chip().flash.begun()
    }
}

#[test]
fn a_stored_set_is_active_after_a_loss_of_power() {
    let mut board = Board::idle();
    assert_eq!(board.active().0, Origin::Image);
    assert!(board.store(&set()));
    let stored = (Origin::Stored { sequence: 1 }, "changed".to_owned());
    assert_eq!(board.active(), stored);
    board.bench.machine.restart(Cause::Power).expect("restarts");
    board.until("mode: idle");
    assert_eq!(board.active(), stored);
    let strays = board.bench.machine.chip().strays().count();
    assert_eq!(strays, 0);
}

/// The chip breaks the timers by a flag of its own, which a reset of the fault has to clear.
#[test]
fn a_damaged_set_stops_the_drive_until_the_fault_is_reset() {
    let mut board = Board::idle();
    assert!(board.store(&set()));
    let place = PARAMETER_SETS + 2 * PIECE as u32;
    board.bench.machine.spoil(place, Wrong::Check).expect("flash");
    board.active();
    board.until("fault 151");
    // A fault is held for a tenth of a second at least.
    for _ in 0..150 {
        board.bench.step().expect("runs");
    }
    board.bench.send(b'0').expect("runs");
    board.until("mode: idle");
    board.bench.send(b's').expect("runs");
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
            board.bench.machine.chip_mut().flash.cut_power(cut);
            // If the last write was over, the answer may yet have been sent.
            let done = board.store(&set) && board.restarts() == 0;
            if board.restarts() == 0 {
                board.bench.step().expect("runs");
            }
            board.until("mode: idle");
            assert_eq!(board.restarts(), 1, "{cut:?}");
            let (origin, name) = board.active();
            // Intact; a half-written header reads as an erased number.
            let new = origin != Origin::Image && name == "changed";
            assert!(new || origin == Origin::Image, "{cut:?}: {origin:?} {name}");
            assert!(new || !done, "{cut:?}: it had said that it is stored");
            // What the supply tore is not read any more: the chip would cut the bridges.
            board.bench.send(b's').expect("runs");
            board.until("mode: preloading to deploy");
            assert_eq!(board.active(), (origin, name), "{cut:?}");
            board.until("deploying: cruise");
            board.bench.send(b'x').expect("runs");
            board.until("mode: idle");
            // A half-written set does not block the next save.
            assert!(board.store(&set), "{cut:?}");
            assert_eq!(board.active().1, "changed", "{cut:?}");
        }
    }
}
