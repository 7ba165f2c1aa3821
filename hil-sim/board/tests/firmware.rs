//! The firmware itself on the emulated board, the plant at its pins.

use hil_sim::plant::rig::Drives;
use hil_sim::record::{Columns, CrossingLine, Recording, Run, starter};
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Kind, Target};
use hil_sim::session::{Options, RunningRig, Session};
use interstage::model::LimitedBy::{Preload, Slew};
use interstage::restart::{Reset, Restart};
use interstage::supervise::Mode;
use rig_board::chip::Pin;
use rig_board::core::{Access, Bus};
use rig_board::faults::switch;
use rig_board::peripherals::rcc::Cause;

use crate::common::{Board, fault, ran, scenario};

fn press(board: &mut Board, pressed: bool) {
    let now = board.machine().now();
    board.machine().chip_mut().drive(Pin::BUTTON, pressed, now);
}

fn assert_no_strays(board: &Board) {
    let strays: Vec<_> = board.bench.machine.chip().strays.iter().collect();
    assert!(strays.is_empty(), "{strays:#?}");
}

/// Whether a motor is driven within the next milliseconds.
fn drives(board: &mut Board, milliseconds: u32) -> bool {
    (0..milliseconds).any(|_| {
        let drives = board.step().drives;
        drives.drive_on && drives.drive != 0.0 || drives.preload_on && drives.preload != 0.0
    })
}

/// Rows of the binary log, a tick each.
fn rows(recording: &Recording) -> Vec<Columns> {
    Run::of_stream(&recording.stream).rows
}

/// The software on the same rig from the same noise on. The board's first tick, of this number,
/// finds the plant some milliseconds after power-up and the sensors as often read; its operator
/// gave the command in the tick `command`.
fn software(scenario: &Scenario, first: u32, command: u32) -> Recording {
    let start = starter(scenario.run.direction);
    let mut session = Session::new(scenario, Options::ROWS).expect("a session");
    // The bench reads the sensors as power comes up too.
    for _ in 0..=first {
        session.sense();
        session = session.with_plant(|plant, _| {
            plant.step(&Drives::default(), 1e-3).expect("a sound plant");
        });
    }
    for tick in first.. {
        let given = (tick == command).then_some(start);
        session.step(given).expect("runs");
        if matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_)) {
            break;
        }
    }
    session.finish(1.0)
}

/// Codes of the four sensors.
fn codes(row: &Columns) -> [Option<u16>; 4] {
    [row.wheel_encoder_code, row.preload_code, row.compression_code, row.arm_angle_code]
}

/// Ticks from the command to the first motion of a part: dead time of the pre-tightener.
const STILL: u32 = 60;

/// A quantity of the ledger, how far board and software may differ, and by how much more a
/// millimetre of difference between the gaps that they measured at the step before.
type Quantity = (&'static str, fn(&CrossingLine) -> f64, f64, f64);

/// How far the measured gaps may differ, mm: as below.
const MEASURED_MM: f64 = 0.114;

/// From the command on a few things differ: it reaches the bridges 0.05 ms later and rounded to a
/// part in 8500, and the codes of a moving part are means over 0.15 ms. So the runs part in
/// the last bits, and the noise of the sensors' rounding with them. Each bound is four standard
/// deviations of the difference over the rigs of seeds 2 to 14, at the step where it is largest:
/// the first, where the preload still rises, or the third. The speed of a step is planned from the
/// gap measured at the one before: it changes by 60 mm/s a millimetre of that, and the gap by
/// 0.027 mm a mm/s of speed. Whether the preload's limit or its slew bounds a crossing may change
/// with it.
const QUANTITIES: [Quantity; 4] = [
    ("gap, mm", |c| c.gap_mm, 0.054, 60.0 * 0.027),
    ("preload, N", |c| c.preload_n, 1.63, 0.0),
    ("speed, mm/s", |c| c.speed_mm_s, 2.07, 60.0),
    ("corner force, N", |c| c.corner_force_n, 1.79, 0.0),
];

/// Codes by which a sensor at rest differs from itself a millisecond before or after: six deviations
/// of the noise of two readings.
const NOISE_CODES: u16 = 250;

/// Until something moves, board and software read the same but for the noise: the board's tick
/// stands anywhere in the plant's millisecond. Then the runs stay together.
fn assert_alike(board: &Recording, scenario: &Scenario) {
    let on_board = rows(board);
    let first = on_board.first().expect("a tick").tick;
    let command = on_board.iter().find(|row| row.command != 0).expect("a command").tick;
    let software = software(scenario, first, command);
    let in_software = rows(&software);
    let still = (command + STILL - first) as usize;
    for (one, other) in on_board.iter().zip(&in_software).take(still) {
        for (ours, theirs) in codes(one).into_iter().zip(codes(other)) {
            let off = ours.expect("a code").abs_diff(theirs.expect("a code"));
            assert!(off <= NOISE_CODES, "tick {}: {ours:?}, {theirs:?}", one.tick);
        }
    }
    let (board, software) = (&board.summary, &software.summary);
    assert!(board.completed && software.completed, "{:?}, {:?}", board.faults, software.faults);
    assert_eq!((board.crossings.len(), software.crossings.len()), (3, 3));
    let mut before = 0.0;
    for (on_board, in_software) in board.crossings.iter().zip(&software.crossings) {
        for (what, of, most, more) in QUANTITIES {
            let (value, expected, index) = (of(on_board), of(in_software), on_board.index);
            let most = most + more * before;
            println!("step {index}: {what} {value:.4}, {expected:.4} in software");
            assert!(
                (value - expected).abs() <= most,
                "step {index}: {what} {value} on the board, {expected} in software"
            );
        }
        let named = [on_board.limited_by, in_software.limited_by];
        let by_preload = named.iter().all(|by| matches!(by, Some(Preload | Slew)));
        assert!(named[0] == named[1] || by_preload, "step {}: {named:?}", on_board.index);
        let measured = [on_board, in_software].map(|line| line.gap_measured_mm.expect("measured"));
        before = (measured[0] - measured[1]).abs();
        assert!(before < MEASURED_MM, "step {}: measured {measured:?}", on_board.index);
        let found = on_board.step_found_mm.expect("the firmware logged the crossing");
        assert!((found - on_board.step_mm).abs() < 0.5, "found at {found}");
    }
}

fn assert_as_in_software(sets: &[&str]) {
    let first = ran(&scenario(sets), false);
    assert_alike(&first.recording, &scenario(sets));
    assert!(first.load.unmodelled.is_empty(), "{:#?}", first.load.unmodelled);
    assert!(first.machine.restarts().is_empty());
    assert_eq!(first.load.missed(), Vec::<String>::new());
    // A sensor's frame more or less before it is all that moves the tick.
    assert!(first.load.tick.jitter < 4_000, "{:?}", first.load.tick);
    assert!(u64::from(first.load.stack_used) < first.load.stack, "{}", first.load.stack_used);
    let ticks = first.load.cycles / first.load.clock_hz.div_euclid(1000);
    assert!(first.load.tick.runs.abs_diff(ticks) <= 1, "{} of {ticks}", first.load.tick.runs);
    // Again, the same bytes.
    let again = ran(&scenario(sets), false);
    let (a, b) = (&again.recording, &first.recording);
    assert_eq!(a.summary.trace_digest, b.summary.trace_digest);
    assert_eq!(a.log, b.log);
    assert_eq!(again.load, first.load);
}

#[test]
fn other_rigs_run_on_the_board_as_in_software() {
    for seed in 2..=5 {
        let scenario = scenario(&[&format!("run.seed={seed}")]);
        assert_alike(&ran(&scenario, false).recording, &scenario);
    }
}

/// A board that restarts under way waits for a command: the run ends there, says why, and shows the
/// second start at its own time.
#[test]
fn a_restart_under_way_ends_the_run_with_its_cause() {
    let mut scenario = scenario(&[]);
    scenario.run.faults = vec![Injection::at(Target::Supply, Kind::Weak, 2.0, 0.0)];
    let ran = ran(&scenario, true);
    let (summary, rows) = (&ran.recording.summary, &ran.recording.rows);
    assert!(!summary.completed && summary.total_s < 4.0, "{}", summary.total_s);
    let cause = summary.restart.as_deref().expect("it is reported");
    assert!(cause.contains("supply") && cause.contains("before: "), "{cause}");
    assert!(summary.injected[0].ends_with(" s (2 s from boot)"), "{:?}", summary.injected);
    let known: Vec<f64> = rows.iter().map(|row| row.controller.t_s).collect();
    let falls = known.windows(2).filter(|pair| pair[1] < pair[0]).count();
    assert_eq!(falls, 0, "the time of a row never goes back");
    // The second start has ticks, each within a frame's time of its row.
    let late = rows.iter().enumerate().skip(2500).filter(|(_, row)| row.controller.preload_n > 0.0);
    let late: Vec<f64> = late.map(|(n, row)| row.controller.t_s - n as f64 * 1e-3).collect();
    assert!(late.len() > 300 && late.iter().all(|off| off.abs() < 0.003), "{late:?}");
}

#[test]
fn a_deployment_is_that_of_the_software_and_the_same_again() {
    assert_as_in_software(&["run.seed=1"]);
}

#[test]
fn a_retraction_is_that_of_the_software_and_the_same_again() {
    assert_as_in_software(&["run.seed=1", "run.direction=retract"]);
}

/// Processor time of this thread against the time of the rig, the best of three runs: a slow hook
/// or repeated translation would show.
#[test]
fn a_deployment_is_far_ahead_of_the_rig() {
    const AHEAD: f64 = 2.0;
    if !hil_sim::testing::long() {
        return;
    }
    let ahead = |_| {
        let begun = cpu_time::ThreadTime::now();
        let load = ran(&scenario(&["run.seed=1"]), false).load;
        load.cycles as f64 / load.clock_hz as f64 / begun.elapsed().as_secs_f64()
    };
    let best = (0..3).map(ahead).fold(0.0, f64::max);
    assert!(best >= AHEAD, "{best:.2} times as fast as the rig");
}

#[test]
fn power_up_leads_to_idle_with_the_bridges_off_and_reports_power_alone() {
    let mut board = Board::off(&[]);
    let power = Restart { reset: Reset::Power, snapshot: None, crash: None };
    assert_eq!(board.report(), power);
    for text in ["interstage", "mode: self-test", "mode: zeroing", "mode: idle", "zero: preload 3"]
    {
        assert!(board.said(text), "{text}: {:#?}", board.log);
    }
    assert!(!board.said("restarted") && !board.said("before:"), "{:#?}", board.log);
    assert_no_strays(&board);
}

#[test]
fn a_short_press_starts_and_holding_stops() {
    let mut board = Board::idle();
    press(&mut board, true);
    board.run(100);
    press(&mut board, false);
    board.until("preloading to deploy", 500);
    press(&mut board, true);
    board.until("stop", 1100);
    assert_no_strays(&board);
}

#[test]
fn an_open_emergency_stop_takes_the_drive_away_until_it_is_reset() {
    let mut board = Board::moving();
    board.run(100);
    board.open_stop(true);
    board.until("fault 151", 20);
    assert!(!drives(&mut board, 200));
    board.open_stop(false);
    assert!(!drives(&mut board, 200), "closing the contact starts nothing");
    board.send(b'0');
    board.until("mode: idle", 1500);
    board.send(b's');
    assert!(drives(&mut board, 500));
}

#[test]
fn power_lost_in_the_middle_of_a_crossing_is_survived() {
    let mut board = Board::moving();
    board.until("sliding on the corner", 8000);
    board.machine().restart(Cause::Power).expect("restarts");
    assert!(!drives(&mut board, 3000), "nothing moves before a command");
    assert!(board.said("mode: idle") && !board.said("restarted by the watchdog"));
    board.send(b's');
    board.until("mode: deployed", 40_000);
    assert!((board.position_mm() - 80.0).abs() < 1.0, "{}", board.position_mm());
    assert_no_strays(&board);
}

#[test]
fn a_driver_on_the_wrong_timer_channel_is_caught() {
    const TIM1_CCER: u32 = 0x4001_2C20;
    let mut board = Board::idle();
    let at = Access { address: TIM1_CCER, size: 4, pc: 0, now: board.machine().now() };
    let enables = board.machine().chip_mut().read(at);
    assert_eq!(enables & 0xF0, 0, "only channel 1 and its complement: {enables:#x}");
    // Channel 2 instead of channel 1.
    board.machine().chip_mut().write(at, enables << 4);
    board.send(b's');
    board.until("] fault ", 10_000);
    assert!(board.position_mm().abs() < 0.1, "{}", board.position_mm());
}

#[test]
fn an_interrupt_flag_that_is_not_cleared_is_caught() {
    let mut board = Board::off(&[]);
    board.strike(fault(Target::Timer, Kind::Stuck));
    board.run(2000);
    assert!(!board.said("mode: idle"), "it starts as if nothing were wrong: {:#?}", board.log);
}

/// A run with a fault that comes when this is logged; what is logged after that.
fn struck(text: &str, fault: Injection, milliseconds: u32) -> (Board, Vec<String>) {
    let mut board = Board::moving();
    board.until(text, 8000);
    let from = board.log.len();
    board.strike(fault);
    board.run(milliseconds);
    let lines = board.log.split_off(from);
    (board, lines)
}

#[test]
fn a_broken_sensor_under_way_stops_the_drive_with_a_fault() {
    for fault in [
        Injection::at(Target::PreloadSensorConverter, Kind::Stuck, 0.0, 65_535.0),
        Injection::at(Target::TreadConverter, Kind::Stuck, 0.0, 0.0),
        Injection::at(Target::AngleBus, Kind::BitErrors, 0.0, 512.0),
        fault(Target::AngleBus, Kind::Off),
        fault(Target::EncoderLineB, Kind::Off),
        fault(Target::Dma, Kind::Stalled),
    ] {
        let (mut board, lines) = struck("deploying: approach", fault, 1500);
        assert!(lines.iter().any(|line| line.contains("] fault ")), "{fault:?}: {lines:#?}");
        assert!(!drives(&mut board, 300), "{fault:?}");
        assert!(board.bench.machine.restarts().is_empty(), "{fault:?}: the tasks live on");
    }
}

#[test]
fn bit_errors_that_pass_are_ridden_out() {
    let mut board = Board::moving();
    board.until("deploying: approach", 8000);
    for _ in 0..5 {
        let fault = Injection::at(Target::AngleBus, Kind::BitErrors, 0.0, 32.0);
        board.strike(fault);
        board.run(3);
        switch(board.machine(), &fault, false).expect("a fault");
        board.run(40);
    }
    assert!(!board.said("] fault "), "{:#?}", board.log);
    board.until("mode: deployed", 20_000);
}

/// Numbers become machine units on the host. So the board needs neither libm nor the compiler's
/// functions for f64, which the core lacks; of micromath only what the text log states of the zeros.
#[test]
fn the_image_contains_no_function_of_a_mathematics_library() {
    let board = Board::off(&[]);
    let functions = &board.bench.machine.image.functions;
    assert!(functions.len() > 100);
    let of_library = |name: &str| {
        ["libm::", "micromath::", "::float::", "::math::"].iter().any(|part| name.contains(part))
            && !name.contains("micromath::statistics")
            || ["__aeabi_d", "__aeabi_f"].iter().any(|start| name.starts_with(start))
    };
    let found: Vec<_> = functions.iter().filter(|f| of_library(&f.name)).collect();
    assert!(found.is_empty(), "{:#?}", found.iter().map(|f| &f.name).collect::<Vec<_>>());
}
