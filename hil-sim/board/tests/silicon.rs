//! What the chip and the sensor on its bus do by their manuals, and a firmware has to know.

use hil_sim::scenario::Scenario;
use interstage::restart::Stopped;
use rig_board::bench::{Bench, STEP};
use rig_board::chip::Pin;
use rig_board::core::Register;
use rig_board::faults::Fault;
use rig_board::peripherals::rcc::Cause;
use rig_board::peripherals::{HZ, Peripheral};

use crate::common::{Board, elf, strings};

/// Of the flash's access control register: wait states, prefetch, instruction and data cache.
const ACCESS: u32 = 0x00;
const WAIT_STATES: u32 = 0xF;
const PREFETCH_AND_CACHES: u32 = 7 << 8;

#[test]
fn a_disturbed_frame_of_the_angle_sensor_costs_that_frame_alone() {
    let mut board = Board::moving();
    for _ in 0..3 {
        board.strike(Fault::AngleDisturbed);
        board.run(60);
    }
    assert!(!board.said("] fault "), "{:#?}", board.log);
    board.until("mode: deployed", 20_000);
}

#[test]
fn a_reset_in_the_middle_of_a_frame_does_not_silence_the_angle_sensor() {
    let mut board = Board::idle();
    // The bus shifts for 3 us in every second millisecond: a reset within it.
    let machine = board.machine();
    let end = machine.now() + 3 * STEP;
    while !machine.chip().angle_bus_is_busy() {
        assert!(machine.now() < end, "no frame");
        machine.run_on(machine.now() + 50).expect("runs");
    }
    machine.restart(Cause::Pin).expect("restarts");
    board.until("mode: idle", 3000);
}

#[test]
fn a_missing_magnet_is_named() {
    let mut board = Board::off(&[]);
    board.strike(Fault::MagnetLost);
    board.until("fault 106", 3000);
    assert!(board.said("magnet"), "{:#?}", board.log);
    let mut board = Board::moving();
    board.strike(Fault::MagnetLost);
    board.until("fault 106", 60);
}

#[test]
fn the_data_cache_is_off_whenever_flash_is_written() {
    let mut board = Board::idle();
    let flash = &board.machine().chip().flash;
    assert!(flash.begun() > 0, "the first start stores the checksum");
    assert_eq!(flash.cache_hazards(), 0);
    // The record of a supply that falls.
    board.strike(Fault::BrownOut);
    board.until("mode: idle", 3000);
    let flash = &board.machine().chip().flash;
    assert_eq!(flash.cache_hazards(), 0);
}

#[test]
fn flash_is_read_with_prefetch_caches_and_the_wait_states_of_its_clock() {
    let mut board = Board::idle();
    let access = board.machine().chip_mut().flash.read(ACCESS, 0).expect("a register");
    // Source: RM0440, number of wait states: 4 from 136 MHz on.
    assert_eq!(access & WAIT_STATES, 4);
    assert_eq!(access & PREFETCH_AND_CACHES, PREFETCH_AND_CACHES);
}

#[test]
fn one_bank_of_flash_is_refused_by_name_and_nothing_is_written() {
    let mut board = Board::off(&[]);
    board.machine().chip_mut().flash.set_single_bank(true);
    board.until("DBANK", 3000);
    assert!(board.said("STM32_Programmer_CLI"), "{:#?}", board.log);
    board.assert_off(1500);
    assert_eq!(board.machine().chip().flash.begun(), 0);
    assert!(board.machine().restarts().is_empty());
    assert!(!board.said("mode: "), "{:#?}", board.log);
}

/// Of the fault status: a read or write, or a stacking, that the protection forbids.
const FORBIDDEN: u32 = 1 << 1 | 1 << 4;

#[test]
fn a_stack_that_overflows_ends_at_the_protection_whatever_lies_below_ram() {
    // So close to its end that an exception's frame crosses it; and beyond by a push.
    for left in [16, 0] {
        let mut board = Board::moving();
        let end = board.bench.machine().image().symbol("_stack_end").expect("a symbol");
        if left == 0 {
            let push = board.function("interstage::tick::");
            board.set(Register::Pc, push);
        }
        board.set(Register::Sp, end + left);
        let (_, after, driven) = board.reset(150);
        assert!(!driven[2..].contains(&true), "{driven:?}");
        assert!(after < 60, "the record ends it, not the watchdog: {after} ms");
        match board.report().crash.expect("a crash").stopped {
            Stopped::Fault { cfsr, .. } => assert_ne!(cfsr & FORBIDDEN, 0, "{cfsr:#x}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_tick_that_never_comes_is_cut_after_the_watchdog_s_own_time() {
    let mut board = Board::off(&[]);
    let machine = board.machine();
    while !machine.chip().watchdog.is_started() {
        assert!(machine.now() < HZ, "it is not started");
        machine.run_on(machine.now() + 50).expect("runs");
    }
    // No tick comes to feed it; the start goes on.
    machine.set_register(Register::Primask, 1).expect("a register");
    machine.run_on(machine.now() + STEP).expect("runs");
    machine.hang().expect("hangs");
    let from = machine.now();
    machine.run_on(from + HZ).expect("runs");
    let [(at, Cause::Watchdog)] = machine.restarts()[..1] else { panic!("not by the watchdog") };
    let after_ms = (at - from) as f64 / STEP as f64;
    assert!((90.0..=102.0).contains(&after_ms), "{after_ms} ms");
}

#[test]
fn a_low_supply_and_a_damaged_flash_cut_the_bridges_without_the_software() {
    for fault in [Fault::SupplyDip, Fault::TwoWrongBits] {
        let mut board = Board::moving();
        board.set(Register::Faultmask, 1);
        let hang = board.machine();
        hang.hang().expect("hangs");
        fault.strike(hang).expect("strikes");
        board.step();
        assert!(!board.step().drives.drive.abs().gt(&0.0), "{fault}");
    }
}

#[test]
fn two_wrong_bits_at_rest_are_no_reason_to_stop() {
    let mut board = Board::idle();
    board.strike(Fault::TwoWrongBits);
    board.run(100);
    assert!(board.machine().restarts().is_empty(), "{:#?}", board.log);
    assert!(!board.machine().chip().flash.has_two_wrong_bits(), "the handler clears it");
}

/// A probe that attaches halts the core for some milliseconds, and the timers freeze with it.
#[test]
fn a_core_halted_by_a_debugger_drives_nothing_and_then_goes_on() {
    for milliseconds in [1, 5, 50] {
        let mut board = Board::moving();
        let before = board.position_mm();
        for millisecond in 0..milliseconds {
            board.machine().halt(STEP).expect("halts");
            while board.bench.is_due() {
                let (passed, _) = board.bench.close().expect("runs");
                assert!(millisecond == 0 || passed.drives.drive == 0.0, "{passed:?}");
            }
        }
        let moved = board.position_mm() - before;
        assert!(moved < 0.1, "{milliseconds} ms: {moved} mm");
        board.until("mode: deployed", 20_000);
        assert!(!board.said("] fault "), "{:#?}", board.log);
        assert!(board.machine().restarts().is_empty(), "the watchdog stood still");
    }
}

/// The bit of `memcpy` after which no start comes to its first word.
fn dark() -> Bench<'static> {
    let mut bench = Bench::new(elf(), strings(), &Scenario::default()).expect("a bench");
    for _ in 0..3000 {
        let (_, lines) = bench.step().expect("runs");
        if lines.iter().any(|line| line.text.contains("mode: idle")) {
            break;
        }
    }
    let functions = &bench.machine().image().functions;
    let copies = functions.iter().find(|f| f.name == "compiler_builtins::mem::memcpy");
    let place = copies.expect("it copies").range.start + 0x115;
    Fault::BitFlip(place, 4).strike(bench.machine_mut()).expect("flash");
    bench.machine_mut().restart(Cause::Pin).expect("restarts");
    bench
}

/// Cycles in a second: of the oscillator that the chip starts on, and of its full clock. The
/// emulated core counts both alike.
const CLOCKS_HZ: [f64; 2] = [16e6, HZ as f64];
/// `RCC_CFGR`: bits 2 and 3 say which clock is in use, 1 the oscillator.
const CLOCK_IN_USE: u32 = 0x08;

#[test]
fn the_light_of_a_damaged_image_blinks_twice_a_second() {
    let mut bench = dark();
    let (mut before, mut time_s) = (false, 0.0);
    let mut rises = Vec::new();
    for _ in 0..600 {
        bench.step().expect("runs");
        let chip = bench.machine_mut().chip_mut();
        let clock = chip.rcc.read(CLOCK_IN_USE, 0).expect("a register") >> 2 & 3;
        time_s += STEP as f64 / CLOCKS_HZ[usize::from(clock != 1)];
        let on = chip.level(Pin::LIGHT);
        if on && !before {
            rises.push(time_s);
        }
        before = on;
    }
    let periods: Vec<f64> = rises.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(periods.len() >= 4, "{rises:?}");
    assert!(periods.iter().all(|period| (0.45..=0.56).contains(period)), "{periods:.2?} s");
}
