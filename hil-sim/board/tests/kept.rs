//! What the board's flash keeps beside parameters: the state of the drive when the supply
//! fell, and the checksum of the image.

use hil_sim::scenario::injection::{Kind, Target};
use interstage::params::slots::SLOT_BYTES;
use interstage::restart::page::PAGE_BYTES;
use interstage::restart::{DriveSnapshot, Reset, Restart, Stopped};
use interstage::supervise::Mode;
use rig_board::bench::STEP;
use rig_board::chip::Pin;
use rig_board::peripherals::HZ;
use rig_board::peripherals::flash::Cut;
use rig_board::peripherals::pwr::{HOLDS, Then};
use rig_board::peripherals::rcc::Cause;
use rig_board::thumb::sweep;

use crate::common::{Board, fault};

/// Addresses of the pages, as in `docs/PARAMETERS.md`.
const RECORDS: u32 = 0x0808_0000 - 2 * SLOT_BYTES as u32 - PAGE_BYTES as u32;
const CHECKSUMS: u32 = RECORDS - PAGE_BYTES as u32;

/// The log's line of a damaged image.
const DAMAGED: &str = "image: a bit has turned over";

/// Longest time of two checks of the image, ms.
const CHECKED_MS: u32 = 12_500;

fn page(board: &Board, address: u32) -> Vec<u8> {
    let mut bytes = vec![0; PAGE_BYTES];
    board.bench.machine.peek(address, &mut bytes).expect("flash");
    bytes
}

/// Runs until the start has taken the record, 24 bytes on; the tick has not begun.
fn until_taken(board: &mut Board) {
    let taken = (0..600).any(|_| {
        let now = board.machine().now();
        board.machine().run_on(now + STEP / 20).expect("runs");
        page(board, RECORDS)[24..32] == [0; 8]
    });
    assert!(taken, "{:#?}", board.log);
    board.bench.end = board.machine().now() + STEP;
}

/// Asserts that a start restored the position near `at`, mm, as an unconfirmed one.
fn assert_unconfirmed(restart: &Restart, at: f64) {
    let place = restart.place().expect("a position");
    assert!((place.position.to_num::<f64>() - at).abs() < 0.3 && !place.sure, "{restart} at {at}");
}

/// Lets the supply fall during a run; the snapshot in the report of the next start.
fn falls(board: &mut Board) -> Option<DriveSnapshot> {
    board.strike(fault(Target::Supply, Kind::Off));
    board.ends(Cause::Power, 2, 1);
    let restart = board.report();
    assert_eq!(restart.reset, Reset::Power);
    assert_eq!(restart.snapshot.is_some(), restart.crash.is_some());
    if let Some(crash) = restart.crash {
        assert_eq!(crash.stopped, Stopped::Supply);
    }
    restart.snapshot
}

#[test]
fn a_supply_that_falls_leaves_a_record_that_is_reported_once() {
    let mut board = Board::moving();
    let at = board.position_mm();
    let snapshot = falls(&mut board).expect("a record");
    assert!(matches!(snapshot.mode(), Some(Mode::Run(..))), "{snapshot:?}");
    assert!((snapshot.position.to_num::<f64>() - at).abs() < 0.3, "{snapshot:?} at {at}");
    for said in ["the supply fell too low", "before: tick"] {
        assert!(board.said(said), "{said}: {:#?}", board.log);
    }
    // RAM is lost again, without a warning.
    board.strike(fault(Target::Supply, Kind::Gone));
    let second = board.report();
    assert_eq!((second.reset, second.snapshot, second.crash), (Reset::Power, None, None));
}

/// The wiring has to give it a millisecond, of which it takes at most half.
#[test]
fn a_record_of_the_supply_is_written_in_half_of_its_time() {
    // An empty page, which is searched from its end, and one with room for one more.
    for filled in [0, PAGE_BYTES - 32] {
        let mut board = Board::moving();
        board.machine().poke(RECORDS, &vec![0; filled]).expect("flash");
        board.strike(fault(Target::Supply, Kind::Off));
        let fell = board.bench.machine.now();
        // The record's last word is the lower one of its third double word.
        let written = |board: &Board| page(board, RECORDS)[filled + 16..filled + 20] != [0xFF; 4];
        while !written(&board) {
            let machine = board.machine();
            let now = machine.now();
            assert!(now - fell < HOLDS / 2, "{filled}: not yet");
            machine.run_on(now + STEP / 100).expect("runs");
        }
        let took_ms = (board.bench.machine.now() - fell) as f64 / STEP as f64;
        assert!((0.2..0.4).contains(&took_ms), "{filled}: {took_ms} ms");
    }
}

#[test]
fn a_supply_that_flickers_leaves_its_first_record() {
    let mut board = Board::moving();
    board.strike(fault(Target::Supply, Kind::Off));
    until_taken(&mut board);
    let snapshot = falls(&mut board).expect("the same record");
    assert!(matches!(snapshot.mode(), Some(Mode::Run(..))), "{snapshot:?}");
}

#[test]
fn a_record_is_intact_or_absent_whenever_power_is_lost() {
    // The fourth double word is the record's last.
    for (operations, intact) in [(1, false), (3, false), (4, true), (5, true)] {
        let mut board = Board::moving();
        // An earlier one, which must not be reported as this one.
        let earlier = falls(&mut board).expect("a record");
        board.send(b's');
        board.until("deploying: cruise", 6000);
        board.frames.clear();
        board.machine().chip_mut().flash.cut_power(Cut::Within(operations));
        board.strike(fault(Target::Supply, Kind::Off));
        board.reset(5);
        let restart = board.report();
        assert_eq!(restart.snapshot.is_some(), intact, "{operations}: {restart}");
        assert!(
            restart.snapshot.is_none_or(|snapshot| snapshot.tick != earlier.tick),
            "{operations}"
        );
        if !intact {
            // A torn record does not block the next.
            let next = falls(&mut board).expect("the next record");
            assert_eq!(next.mode(), Some(Mode::Idle));
        }
    }
}

#[test]
fn a_full_page_of_records_makes_room() {
    let mut board = Board::idle();
    let full = [0; PAGE_BYTES];
    board.machine().poke(RECORDS, &full).expect("flash");
    board.strike(fault(Target::ResetPin, Kind::Reset));
    board.until("mode: idle", 3000);
    assert_eq!(page(&board, RECORDS), [0xFF; PAGE_BYTES]);
    board.frames.clear();
    let snapshot = falls(&mut board).expect("a record");
    assert_eq!(snapshot.mode(), Some(Mode::Idle));
}

#[test]
fn a_dip_of_the_supply_cuts_the_bridges_and_restarts() {
    let mut board = Board::moving();
    let at = board.position_mm();
    board.strike(fault(Target::Supply, Kind::Weak));
    board.ends(Cause::Software, 40, 1);
    let restart = board.report();
    assert_eq!(restart.crash.expect("a crash").stopped, Stopped::Supply);
    assert_unconfirmed(&restart, at);
}

/// A low supply for a while, without a loss of power.
fn sags(board: &mut Board, milliseconds: u64) {
    let machine = board.machine();
    let now = machine.now();
    machine.chip_mut().supply_falls(now + milliseconds * STEP, Then::Back, now);
}

/// With and without room for its record.
#[test]
fn a_low_supply_until_the_watchdog_resets_is_no_hang() {
    for has_room in [true, false] {
        let mut board = Board::moving();
        let at = board.position_mm();
        if !has_room {
            board.machine().poke(RECORDS, &[0; PAGE_BYTES]).expect("flash");
        }
        sags(&mut board, 400);
        assert!(board.ends(Cause::Watchdog, 130, 1) >= 80);
        let restart = board.report();
        assert_eq!(restart.crash.expect("a crash").stopped, Stopped::Supply);
        // Where the bridges went off; but the drive may have been moved since.
        assert_unconfirmed(&restart, at);
    }
}

#[test]
fn a_reset_after_a_lost_supply_leaves_its_position_unconfirmed() {
    let mut board = Board::moving();
    let at = board.position_mm();
    board.strike(fault(Target::Supply, Kind::Off));
    board.reset(5);
    until_taken(&mut board);
    board.strike(fault(Target::ResetPin, Kind::Reset));
    let restart = board.report();
    assert_eq!((restart.reset, restart.crash), (Reset::Pin, None));
    assert_unconfirmed(&restart, at);
}

#[test]
fn a_position_without_a_detected_step_stays_unconfirmed() {
    let mut board = Board::moving();
    let at = board.position_mm();
    let lost = falls(&mut board).expect("a record");
    for _ in 0..2 {
        board.run(50);
        board.strike(fault(Target::ResetPin, Kind::Reset));
        let restart = board.report();
        assert!(restart.snapshot.is_some_and(|snapshot| snapshot.tick != lost.tick), "{restart}");
        assert_unconfirmed(&restart, at);
    }
}

#[test]
fn a_reset_into_a_low_supply_leaves_its_place_unsure() {
    let mut board = Board::moving();
    board.strike(fault(Target::ResetPin, Kind::Reset));
    sags(&mut board, 300);
    let restart = board.report();
    assert_eq!((restart.reset, restart.crash), (Reset::Power, None));
    assert!(restart.place().is_some_and(|place| !place.sure), "{restart}");
}

#[test]
fn a_start_waits_for_its_supply() {
    let mut board = Board::idle();
    board.frames.clear();
    // Power comes back with a low supply for a tenth of a second, of which 22 ms at the slow clock.
    board.machine().restart(Cause::Power).expect("restarts");
    sags(&mut board, 100);
    let lines = board.log.len();
    board.run(99 - 22);
    assert_eq!(board.log.len(), lines, "{:#?}", &board.log[lines..]);
    board.until("mode: idle", 3000);
}

#[test]
fn the_first_start_of_an_image_stores_its_checksum() {
    let first = |board: &Board| {
        board.log.iter().filter(|line| line.contains("first start of this image")).count()
    };
    let mut board = Board::idle();
    assert_eq!(first(&board), 1, "{:#?}", board.log);
    let checksums = page(&board, CHECKSUMS);
    assert_ne!(checksums[..16], [0xFF; 16]);
    assert_eq!(checksums[16..], [0xFF; PAGE_BYTES - 16]);
    board.strike(fault(Target::ResetPin, Kind::Reset));
    board.until("mode: idle", 3000);
    assert_eq!(first(&board), 1, "known by now");
    assert_eq!(page(&board, CHECKSUMS), checksums);
}

/// Bytes of the image: of its vectors, its code, its constants, its hash.
fn places(board: &Board) -> Vec<u32> {
    let image = &board.bench.machine.image;
    let last = image.flash.iter().rposition(|byte| *byte != 0xFF).expect("an image") as u32;
    let hash = image.symbol("__build_id").expect("a symbol");
    vec![0x0800_0000 + 0x1D0, board.function("panic_bounds_check"), 0x0800_0000 + last, hash + 16]
}

#[test]
fn an_inverted_bit_of_the_image_is_reported_and_held() {
    for place in places(&Board::idle()) {
        let mut board = Board::moving();
        board.flip(place, 4);
        board.until(DAMAGED, CHECKED_MS);
        board.ends(Cause::Software, 20, 1);
        // It stays off and reports every second; it ignores commands.
        for _ in 0..2 {
            board.until(DAMAGED, 1100);
            board.bench.send(b's').expect("runs");
        }
        board.assert_off(500);
        // Flashed again, it goes on.
        board.flip(place, 4);
        board.strike(fault(Target::ResetPin, Kind::Reset));
        board.until("mode: idle", 3000);
    }
}

#[test]
fn an_image_names_no_folder_of_the_machine_that_built_it() {
    let board = Board::idle();
    let image = &board.bench.machine.image.flash;
    let holds = |text: &str| image.windows(text.len()).any(|bytes| bytes == text.as_bytes());
    assert!(holds("src/main.rs"), "places of panics are in it");
    let home = std::env::home_dir().expect("a home");
    for folder in ["registry", ".cargo", home.to_str().expect("a path")] {
        assert!(!holds(folder), "{folder}");
    }
}

/// A start that fails before its tasks, because `memcpy` is damaged, has reported it before.
#[test]
fn a_damaged_image_that_no_longer_starts_is_reported() {
    let mut board = Board::moving();
    let copies = board.function("compiler_builtins::mem::memcpy");
    board.flip(copies + 0x22F, 4);
    board.until(DAMAGED, CHECKED_MS);
    // Off from here on, however often it restarts.
    board.step();
    board.assert_off(500);
}

/// An image that cannot log blinks the light, twice a second; on a sound board the light is off
/// until the first line of the log.
#[test]
fn a_damaged_image_that_cannot_log_blinks() {
    let lit = |board: &Board| board.bench.machine.chip().level(Pin::LIGHT);
    let mut board = Board::moving();
    board.strike(fault(Target::ResetPin, Kind::Reset));
    let from = board.log.len();
    while board.log.len() == from {
        board.step();
        assert!(board.log.len() > from || !lit(&board));
    }
    let mut board = Board::moving();
    // The bit after which no start comes to its first word.
    let copies = board.function("compiler_builtins::mem::memcpy");
    board.flip(copies + 0x115, 4);
    board.strike(fault(Target::ResetPin, Kind::Reset));
    board.step();
    let from = board.log.len();
    let now_s = |board: &mut Board| board.machine().now() as f64 / HZ as f64;
    let (begun_s, mut lit_s, mut rises) = (now_s(&mut board), 0.0, Vec::new());
    let (mut time_s, mut before) = (begun_s, lit(&board));
    // A start that does not come to its full clock is looked at every 31 ms.
    while time_s < begun_s + 3.0 {
        board.assert_off(1);
        let (last_s, on) = (std::mem::replace(&mut time_s, now_s(&mut board)), lit(&board));
        if on && !before {
            rises.push(time_s);
        }
        lit_s += if on { time_s - last_s } else { 0.0 };
        before = on;
    }
    assert_eq!(board.log.len(), from, "{:#?}", &board.log[from..]);
    let periods: Vec<f64> = rises.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(periods.len() >= 4 && (0.6..2.4).contains(&lit_s), "{rises:?}, {lit_s}");
    assert!(periods.iter().all(|period| (0.45..=0.56).contains(period)), "{periods:.2?} s");
}

/// The floating-point unit is off until the start-up code enables it; code before that must not
/// use it, not even for copies.
#[test]
fn the_first_code_of_a_start_uses_no_floating_point() {
    let board = Board::idle();
    let image = &board.bench.machine.image;
    let mut checked = 0;
    for name in
        ["__pre_init", "board::image::checksums", "interstage::restart::page::word", "Reset"]
    {
        for function in image.functions.iter().filter(|function| function.name.contains(name)) {
            let range = function.range.start - 0x0800_0000..function.range.end - 0x0800_0000;
            let code = &image.flash[range.start as usize..range.end as usize];
            for (place, instruction, _) in sweep(code, function.range.start) {
                let at = (place - function.range.start) as usize;
                let half = |at: usize| u16::from_le_bytes([code[at], code[at + 1]]);
                let wide = instruction.size == 4 && (0xEC..=0xEF).contains(&(half(at) >> 8));
                let float = wide && matches!(half(at + 2) >> 8 & 0xF, 10 | 11);
                assert!(!float, "{} at {place:#x}", function.name);
            }
            checked += 1;
        }
    }
    assert!(checked >= 3, "{checked}");
}
