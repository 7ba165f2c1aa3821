//! What the chip and the sensor on its bus do by their manuals, and a firmware has to know.

use hil_sim::record::Run;
use hil_sim::scenario::injection::{Injection, Kind, Target};
use interstage::restart::{Reset, Stopped};
use interstage::supervise::Mode;
use rig_board::bench::STEP;
use rig_board::chip::InputErrors;
use rig_board::core::{Access, Bus, Register};
use rig_board::description::flash::{self, acr};
use rig_board::description::{self, rcc};
use rig_board::machine::Machine;
use rig_board::peripherals::flash::Wrong;
use rig_board::peripherals::pwr::Then;
use rig_board::peripherals::rcc::Cause;
use rig_board::peripherals::{HZ, Peripheral};

use crate::common::{Board, fault};

#[test]
fn a_reset_in_the_middle_of_a_frame_does_not_silence_the_angle_sensor() {
    let mut board = Board::idle();
    // The bus shifts for 3 us in every second millisecond: a reset within it.
    let machine = board.machine();
    let end = machine.now() + 3 * STEP;
    while !machine.chip().spi.is_busy() {
        assert!(machine.now() < end, "no frame");
        machine.run_on(machine.now() + 50).expect("runs");
    }
    machine.restart(Cause::Pin).expect("restarts");
    board.until("mode: idle", 3000);
}

#[test]
fn the_data_cache_is_off_whenever_flash_is_written() {
    let mut board = Board::idle();
    let flash = &board.machine().chip().flash;
    assert!(flash.begun > 0, "the first start stores the checksum");
    assert_eq!(flash.cache_hazards, 0);
    // The record of a supply that falls.
    board.strike(fault(Target::Supply, Kind::Off));
    board.until("mode: idle", 3000);
    let flash = &board.machine().chip().flash;
    assert_eq!(flash.cache_hazards, 0);
}

#[test]
fn flash_is_read_with_prefetch_caches_and_the_wait_states_of_its_clock() {
    let mut board = Board::idle();
    let access = board.machine().chip_mut().flash.read(flash::ACR, 0).expect("a register");
    // Source: RM0440, number of wait states: 4 from 136 MHz on.
    assert_eq!(acr::LATENCY.of(access), 4);
    assert!([acr::PRFTEN, acr::ICEN, acr::DCEN].iter().all(|field| field.is_in(access)));
}

#[test]
fn one_bank_of_flash_is_refused_by_name_and_nothing_is_written() {
    let mut board = Board::off(&[]);
    board.machine().chip_mut().flash.set_single_bank(true);
    board.until("DBANK", 3000);
    assert!(board.said("STM32_Programmer_CLI"), "{:#?}", board.log);
    board.assert_off(1500);
    assert_eq!(board.machine().chip().flash.begun, 0);
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
        // Between two ticks the core sleeps, once it has planned, and nothing is popped first.
        let _ = (0..200).map(|_| board.step()).count();
        let machine = board.machine();
        machine.run_on(machine.now() + HZ / 2500).expect("runs");
        let end = board.bench.machine.image.symbol("_stack_end").expect("a symbol");
        if left == 0 {
            let push = board.function("interstage::tick::Controller::step_into");
            board.set(Register::Pc, push);
        }
        board.set(Register::Sp, end + left);
        // The record ends it, not the watchdog.
        board.ends(Cause::Software, 60, 2);
        let restart = board.report();
        match restart.crash.expect("a crash").stopped {
            Stopped::Fault { cfsr, .. } => assert_ne!(cfsr & FORBIDDEN, 0, "{cfsr:#x}"),
            other => panic!("{other:?}"),
        }
        assert!(restart.snapshot.is_some());
    }
}

#[test]
fn a_tick_that_never_comes_is_cut_after_the_watchdog_s_own_time() {
    let mut board = Board::off(&[]);
    let machine = board.machine();
    while !machine.chip().watchdog.started {
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
fn the_watchdog_ends_a_hang_and_nothing_else_at_both_ends_of_its_oscillator() {
    // DS12288, LSI characteristics: over temperature and supply.
    for hz in [29_500, 34_000] {
        let under_way = || {
            let mut board = Board::off(&[]);
            board.machine().chip_mut().watchdog.lsi_hz = hz;
            board.until("mode: idle", 3000);
            board.send(b's');
            board.until("deploying: approach", 8000);
            assert!(board.machine().restarts().is_empty(), "{hz} Hz");
            board
        };
        // With interrupts masked it alone ends it, 800 times four periods after the last feed.
        let mut board = under_way();
        board.set(Register::Primask, 1);
        board.machine().hang().expect("hangs");
        let after = board.ends(Cause::Watchdog, 150, 150);
        let timeout_ms = 3200.0 * 1e3 / hz as f64;
        assert!((timeout_ms - 1.5..=timeout_ms).contains(&f64::from(after)), "{hz} Hz: {after}");
        let restart = board.report();
        assert_eq!((restart.reset, restart.crash), (Reset::Watchdog, None), "{hz} Hz");
        assert!(matches!(restart.snapshot.and_then(|f| f.mode()), Some(Mode::Run(..))));
        // Otherwise the software is earlier: bridges off, and the hang named.
        let mut board = under_way();
        let machine = board.machine();
        // A hang in an interrupt or a critical section is for the watchdog alone.
        while machine.register(Register::Primask).expect("a register") & 1 != 0
            || machine.register(Register::Xpsr).expect("a register") & 0x1FF != 0
        {
            machine.run_on(machine.now() + 5).expect("runs");
        }
        machine.hang().expect("hangs");
        let (_, after, driven) = board.reset(300);
        let cut = driven.iter().rposition(|on| *on).expect("it was driven") as u32;
        assert!(cut + 10 < after, "{hz} Hz: cut after {cut}, reset after {after} ms");
        let stopped = board.report().crash.map(|crash| crash.stopped);
        assert!(matches!(stopped, Some(Stopped::Hang { .. })), "{hz} Hz: {stopped:?}");
    }
}

/// A line a second under way, by the core's own counter: what the tick takes, without its task's
/// wake-up and with what preempts it.
#[test]
fn the_log_states_the_cycles_of_the_tick() {
    let mut board = Board::moving();
    let tick = board.machine().tasks.names().position(|name| name == "motors");
    board.until("cycles on average", 1200);
    board.machine().profile.take_polls();
    let from = board.log.len();
    board.until("cycles on average", 1200);
    let polls = board.machine().profile.take_polls().into_iter();
    let polls: Vec<u64> =
        polls.filter(|poll| Some(poll.task) == tick).map(|poll| poll.cycles).collect();
    let line = board.log[from..].iter().find(|line| line.contains("tick: ")).expect("a line");
    let (_, numbers) = line.split_once("tick: ").expect("its numbers");
    let numbers: Vec<u64> = numbers.split(' ').filter_map(|word| word.parse().ok()).collect();
    let [mean, most] = numbers[..] else { panic!("{line}") };
    let emulated = polls.iter().sum::<u64>() / polls.len() as u64;
    let worst = polls.into_iter().max().unwrap_or(0);
    // The waking of the task is not in it.
    assert!((1..500).contains(&emulated.saturating_sub(mean)), "{line}; emulated {emulated}");
    assert!((1..500).contains(&worst.saturating_sub(most)), "{line}; emulated {worst}");
}

#[test]
fn a_damaged_flash_cuts_the_bridges_without_the_software() {
    let mut board = Board::moving();
    board.set(Register::Faultmask, 1);
    let hang = board.machine();
    hang.hang().expect("hangs");
    // The code that it hangs in.
    hang.spoil(hang.pc(), Wrong::Two).expect("a place");
    board.step();
    assert_eq!(board.step().drives.drive, 0.0);
}

/// Codes of 16 bits are means of 12: they have their resolution from the noise at the pins alone.
#[test]
fn inputs_without_noise_give_codes_of_12_bits_and_no_fault() {
    // Noise of a third of a step of 12 bits, and none; errors of this sign, or none.
    for (noise_n, sign) in [(0.02, 0), (0.0, 0), (0.02, -1), (0.0, 1)] {
        let noise_mm = noise_n / 40.0;
        let noise =
            format!("noise.preload_sensor_n={noise_n} noise.compression_sensor_mm={noise_mm}");
        let mut board = Board::off(&noise.split(' ').collect::<Vec<_>>());
        let errors = InputErrors::large(sign);
        board.machine().chip_mut().defects.input_errors = Some(errors);
        // Preload by the millisecond, which is the tick's number.
        let mut truths = vec![0.0];
        while !board.said("mode: deployed") && truths.len() < 20_000 {
            // At rest for longer than what counts as stuck.
            if truths.len() == 3000 {
                board.send(b's');
            }
            board.step();
            truths.push(board.bench.plant.truth().preload_n);
        }
        assert!(board.said("mode: deployed") && !board.said("] fault "), "{:#?}", board.log);
        let line = board.log.iter().find(|line| line.contains("zero: preload ")).expect("zeroed");
        let (_, zero) = line.split_once("zero: preload ").expect("its code");
        let zero: f64 = zero.split(' ').next().and_then(|word| word.parse().ok()).expect("a code");
        assert!((zero - f64::from(3277 + errors.offset)).abs() < 16.0, "{line}: {errors:?}");
        for row in Run::of_stream(&board.frames).rows {
            let seen = row.telemetry().expect("a row of a controller");
            let off = (seen.preload.to_num::<f64>() - truths[row.tick as usize]).abs();
            assert!(off < 1.0 || !matches!(seen.mode, Mode::Run(..)), "{sign}: {off} N, {row:?}");
        }
    }
}

/// Its code is not constant, so that its own check cannot find it.
#[test]
fn a_dead_sensor_whose_code_the_pwm_moves_is_found_by_other_checks() {
    for sensor in [0, 1] {
        let mut board = Board::moving();
        let defects = &mut board.machine().chip_mut().defects;
        defects.input_errors = Some(InputErrors::large(1));
        defects.stuck_codes[sensor] = Some([12_000, 7000][sensor]);
        board.until("] fault ", 8000);
        assert!(!board.said("fault 116") && !board.said("fault 117"), "{:#?}", board.log);
        board.run(50);
        board.assert_off(100);
    }
}

/// Most of it is the image's checksum at 16 MHz; the tick begins four milliseconds after it.
#[test]
fn the_start_at_the_slow_clock_takes_a_fiftieth_of_a_second() {
    let mut board = Board::off(&[]);
    let tick = board.function("interstage::tick::Controller::step_into");
    let machine = board.machine();
    let clock_in_use = |machine: &mut Machine| {
        let now = machine.now();
        machine.chip_mut().rcc.read(rcc::CFGR, now).expect("a register")
    };
    while rcc::cfgr::SWS.of(clock_in_use(machine)) == 1 {
        machine.run_on(machine.now() + 1000).expect("runs");
    }
    let full = machine.now();
    assert!(machine.run_to(tick, full + 10 * STEP).expect("runs"), "no tick");
    let [slow_ms, first_ms] = [full, machine.now()].map(|at| at as f64 / STEP as f64);
    assert!((20.0..24.0).contains(&slow_ms), "{slow_ms} ms");
    assert!((3.0..6.0).contains(&(first_ms - slow_ms)), "{first_ms} ms");
}

/// The detector has no filter; what is over after some microseconds was no fall.
#[test]
fn a_bounce_of_the_supply_ends_no_run() {
    let mut board = Board::moving();
    for us in [1, 5, 15] {
        let machine = board.machine();
        let now = machine.now();
        machine.chip_mut().supply_falls(now + us * HZ / 1_000_000, Then::Back, now);
        board.run(20);
        assert!(board.machine().restarts().is_empty(), "{us} us: {:#?}", board.log);
    }
    board.until("mode: deployed", 20_000);
    assert!(!board.said("] fault "), "{:#?}", board.log);
}

/// A probe that attaches halts the core for some milliseconds, and the timers freeze with it.
#[test]
fn a_core_halted_by_a_debugger_drives_nothing_and_then_goes_on() {
    for milliseconds in [1, 5, 50] {
        let mut board = Board::moving();
        let before = board.position_mm();
        board.strike(Injection::at(Target::Debugger, Kind::Halted, 0.0, milliseconds.into()));
        for millisecond in 0..milliseconds {
            let drives = board.step().drives;
            assert!(millisecond == 0 || drives.drive == 0.0, "{drives:?}");
        }
        let moved = board.position_mm() - before;
        assert!(moved < 0.1, "{milliseconds} ms: {moved} mm");
        board.until("mode: deployed", 20_000);
        assert!(!board.said("] fault "), "{:#?}", board.log);
        let reports = board.log.iter().filter(|line| line.contains("limit 216: a debugger halted"));
        assert_eq!(reports.count(), 1, "{:#?}", board.log);
        assert!(board.machine().restarts().is_empty(), "the watchdog stood still");
    }
}

/// On a corner, where the wheel is pushed while its motor has no power: the run can end in a
/// fault, whose own text is not the cause. The log has that before it.
#[test]
fn a_fault_after_a_long_halt_of_the_core_has_its_cause_before_it_in_the_log() {
    for milliseconds in [500, 1000] {
        let mut board = Board::moving();
        board.until("sliding on the corner", 5000);
        board.run(150);
        board.strike(Injection::at(Target::Debugger, Kind::Halted, 0.0, milliseconds.into()));
        board.run(milliseconds + 300);
        let at = |text: &str| board.log.iter().position(|line| line.contains(text));
        let (halt, fault) = (at("limit 216: a debugger halted"), at("] fault "));
        assert!(halt.is_some() && fault > halt, "{:#?}", board.log);
        assert!(board.machine().restarts().is_empty(), "the watchdog stood still");
    }
}

/// The timers' own dead man: nothing masks it, and no software takes part. At full speed.
#[test]
fn a_tick_that_hangs_loses_the_pwm_within_three_milliseconds() {
    let mut board = Board::moving();
    while board.bench.plant.truth().tread_mm_s < 29.5 {
        board.step();
    }
    let tick = board.function("interstage::tick::Controller::step_into");
    let machine = board.machine();
    assert!(machine.run_to(tick, machine.now() + 2 * STEP).expect("runs"), "no tick");
    machine.hang().expect("hangs");
    let from = board.position_mm();
    let driven: Vec<bool> = (0..70).map(|_| board.step().drives.drive != 0.0).collect();
    let moved = board.position_mm() - from;
    assert!(driven[0] && !driven[3..].contains(&true), "{driven:?}");
    assert!(moved < 0.3, "{moved} mm");
}

/// First words of the interrupts' enable bits and priorities.
const ENABLED: u32 = 0xE000_E100;
const PRIORITIES: u32 = 0xE000_E400;

/// The system timer finds every hang but its own and that of the supply's end.
#[test]
fn the_system_timer_preempts_every_interrupt_but_the_supply_s() {
    let mut board = Board::idle();
    let none = board.function("DefaultHandler") | 1;
    let machine = board.machine();
    let handlers: Vec<u32> =
        (0..102).map(|at| machine.word(0x0800_0040 + 4 * at).expect("a vector")).collect();
    let now = machine.now();
    let chip = machine.chip_mut();
    let mut read = |address| chip.read(Access { address, size: 4, pc: 0, now });
    // The library enables some that nothing handles, and nothing requests.
    let urgent: Vec<u32> = (0..102)
        .filter(|number| handlers[*number as usize] != none)
        .filter(|number| {
            let enabled = read(ENABLED + number / 32 * 4) >> (number % 32) & 1 != 0;
            enabled && read(PRIORITIES + number / 4 * 4) >> (number % 4 * 8) & 0xFF == 0
        })
        .collect();
    let supply = description::interrupt("PVD_PVM").expect("described");
    assert_eq!(urgent, [u32::from(supply)]);
}

/// A function that runs every millisecond.
const EVERY_MILLISECOND: &str = "safety::look_at";

/// Two wrong bits in code that runs every millisecond, of the correction or of the code itself.
/// The start that follows compares the image, of which the first are no part.
#[test]
fn two_wrong_bits_in_code_that_runs_end_it_and_are_no_emergency_stop() {
    for wrong in [Wrong::Check, Wrong::Two] {
        let mut board = Board::moving();
        // Its first whole double word: the one before is also another function's.
        let place = board.function(EVERY_MILLISECOND).next_multiple_of(8);
        board.machine().spoil(place, wrong).expect("a place");
        board.ends(Cause::Software, 30, 2);
        board.run(600);
        assert!(!board.said("fault 151"), "{:#?}", board.log);
        match wrong {
            Wrong::Check => assert!(board.said("a bit of the image had"), "{:#?}", board.log),
            _ => assert!(board.said("image: "), "{:#?}", board.log),
        }
        board.assert_off(300);
    }
}

#[test]
fn one_wrong_bit_in_code_that_runs_is_corrected() {
    let mut board = Board::moving();
    let place = board.function(EVERY_MILLISECOND);
    board.machine().spoil(place, Wrong::One).expect("a place");
    board.until("mode: deployed", 20_000);
    assert!(!board.said("] fault ") && board.machine().restarts().is_empty());
    let ecc = board.machine().chip_mut().flash.read(flash::ECCR, 0).expect("a register");
    assert_eq!(ecc >> 30, 1, "it was read, and corrected");
}
