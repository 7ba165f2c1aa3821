//! Parameters stored by the firmware in the emulated board's flash, and power that goes
//! while it writes.

use hil_sim::params::{Client, Store};
use interstage::params::compile;
use interstage::params::service::{Origin, PIECE, Request, Response};
use interstage::rig::Rig;
use rig_board::chip::map::PARAMETER_SETS;
use rig_board::peripherals::flash::{Cut, Wrong};
use rig_board::peripherals::rcc::Cause;

use crate::common::Board;

/// A set that the image does not carry.
fn set() -> Vec<u8> {
    let mut rig = Rig::prototype();
    rig.preload.cruise_n += 1.0;
    compile("changed", &rig).expect("a sound rig").to_vec()
}

/// Stores a set; false if power went meanwhile.
fn store(board: &mut Board, set: &[u8]) -> bool {
    Client::new(board).put(set).is_ok()
}

/// Origin of the active set, and its rig's name.
fn active(board: &mut Board) -> (Origin, String) {
    match Client::new(board).ask(Request::Describe) {
        Ok(Response::Description(d)) => (d.origin, d.name.as_str().to_owned()),
        other => panic!("{other:?}"),
    }
}

fn operations(board: &Board) -> u64 {
    board.bench.machine.chip().flash.begun
}

#[test]
fn a_stored_set_is_active_after_a_loss_of_power() {
    let mut board = Board::idle();
    assert_eq!(active(&mut board).0, Origin::Image);
    assert!(store(&mut board, &set()));
    let stored = (Origin::Stored { sequence: 1 }, "changed".to_owned());
    assert_eq!(active(&mut board), stored);
    board.machine().restart(Cause::Power).expect("restarts");
    board.until("mode: idle", 3000);
    assert_eq!(active(&mut board), stored);
    assert_eq!(board.machine().chip().strays.count(), 0);
}

/// The chip breaks the timers by a flag of its own, which a reset of the fault has to clear.
#[test]
fn a_damaged_set_stops_the_drive_until_the_fault_is_reset() {
    let mut board = Board::idle();
    assert!(store(&mut board, &set()));
    let place = PARAMETER_SETS + 2 * PIECE as u32;
    board.machine().spoil(place, Wrong::Check).expect("flash");
    active(&mut board);
    board.until("fault 151", 3000);
    // A fault is held for a tenth of a second at least.
    board.run(150);
    board.send(b'0');
    board.until("mode: idle", 3000);
    board.send(b's');
    board.until("deploying: cruise", 3000);
}

#[test]
fn power_lost_in_any_write_leaves_the_old_set_or_the_new() {
    let set = set();
    let mut board = Board::idle();
    let before = operations(&board);
    assert!(store(&mut board, &set));
    let all = operations(&board) - before;
    assert!(all > set.len() as u64 / 8, "{all}");
    // The erasing, the first and some later words, the last and what seals.
    let cuts = [1, all / 2, all - 1, all, 2, 3, 4, all - 2];
    for &cut in &cuts[..if hil_sim::testing::long() { 8 } else { 4 }] {
        for cut in [Cut::Within(cut), Cut::After(cut)] {
            let mut board = Board::idle();
            board.machine().chip_mut().flash.cut_power(cut);
            // If the last write was over, the answer may yet have been sent.
            let lines = board.log.len();
            let done = store(&mut board, &set) && board.machine().restarts().is_empty();
            board.run(1500);
            assert_eq!(board.machine().restarts().len(), 1, "{cut:?}");
            assert!(board.log[lines..].iter().any(|line| line.contains("mode: idle")), "{cut:?}");
            let (origin, name) = active(&mut board);
            // Intact; a half-written header reads as an erased number.
            let new = origin != Origin::Image && name == "changed";
            assert!(new || origin == Origin::Image, "{cut:?}: {origin:?} {name}");
            assert!(new || !done, "{cut:?}: it had said that it is stored");
            // What the supply tore is not read any more: the chip would cut the bridges.
            board.send(b's');
            board.until("mode: preloading to deploy", 3000);
            assert_eq!(active(&mut board), (origin, name), "{cut:?}");
            board.until("deploying: cruise", 3000);
            board.send(b'x');
            board.until("mode: idle", 3000);
            // A half-written set does not block the next save.
            assert!(store(&mut board, &set), "{cut:?}");
            assert_eq!(active(&mut board).1, "changed", "{cut:?}");
        }
    }
}
