//! The firmware itself on the emulated board, the plant at its pins.

use hil_sim::record::{CrossingLine, Summary};
use hil_sim::scenario::Direction;
use hil_sim::session::{self, Options, Session};
use interstage::restart::{Reset, Restart};
use interstage::supervise::{Command, Mode};
use rig_board::chip::Pin;
use rig_board::core::{Access, Bus};
use rig_board::faults::Fault;
use rig_board::peripherals::rcc::Cause;
use rig_board::run::{self, Ran};

use crate::common::{Board, elf, scenario};

fn press(board: &mut Board, pressed: bool) {
    let now = board.machine().now();
    board.machine().chip_mut().drive(Pin::BUTTON, pressed, now);
}

fn assert_no_strays(board: &Board) {
    let strays: Vec<_> = board.bench.machine().chip().strays().iter().collect();
    assert!(strays.is_empty(), "{strays:#?}");
}

/// Whether a motor is driven within the next milliseconds.
fn drives(board: &mut Board, milliseconds: u32) -> bool {
    (0..milliseconds).any(|_| {
        let drives = board.step().drives;
        drives.drive_on && drives.drive != 0.0 || drives.preload_on && drives.preload != 0.0
    })
}

fn ran(sets: &[&str]) -> Ran {
    run::run(elf(), &scenario(sets), false, |_, _| {}).expect("a run")
}

/// The software on the same rig, zeroed again and started at several moments: sensor noise
/// differs, and with it the sensors' zeros, what the controller believes of the rubber and the
/// speeds that it plans. The board has zeros of a moment of its own too.
fn software(sets: &[&str]) -> Vec<Summary> {
    let scenario = scenario(sets);
    let start = match scenario.run.direction {
        Direction::Deploy => Command::Start,
        Direction::Retract => Command::Retract,
    };
    (0..8)
        .map(|moment| {
            let mut session = Session::new(&scenario, Options::default()).expect("a session");
            let (mut wait, mut commands) = (10 * moment, [Command::Reset, start].into_iter());
            while !matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_)) {
                let idle = session.mode() == Mode::Idle;
                let command = if idle && wait == 0 { commands.next() } else { None };
                session.step(command).expect("runs");
                wait -= u32::from(idle && wait > 0);
            }
            session.finish(1.0).summary
        })
        .collect()
}

/// A quantity of the ledger, and what of it drivers and one tick's delay may change.
type Quantity = (&'static str, fn(&CrossingLine) -> f64, f64);

const QUANTITIES: [Quantity; 4] = [
    ("gap, mm", |c| c.gap_mm, 0.005),
    ("preload, N", |c| c.preload_n, 0.05),
    ("speed, mm/s", |c| c.speed_mm_s, 0.05),
    ("corner force, N", |c| c.corner_force_n, 0.2),
];

/// The board's ledger lies where the software's does, within four deviations of what
/// the noise of another moment makes.
fn assert_alike(board: &Summary, software: &[Summary]) {
    assert!(board.completed, "{:?}", board.faults);
    assert!(software.iter().all(|run| run.completed && run.crossings.len() == 3));
    assert_eq!(board.crossings.len(), 3);
    let count = software.len() as f64;
    for (step, on_board) in board.crossings.iter().enumerate() {
        for (what, of, own) in QUANTITIES {
            let values: Vec<f64> = software.iter().map(|run| of(&run.crossings[step])).collect();
            let mean = values.iter().sum::<f64>() / count;
            let spread = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
            let (value, within) = (of(on_board), 4.0 * spread.sqrt() + own);
            let index = on_board.index;
            assert!(
                (value - mean).abs() <= within,
                "step {index}: {what} {value} on the board, {mean} +- {within} in software"
            );
        }
        let found = on_board.step_found_mm.expect("the firmware logged the crossing");
        assert!((found - on_board.step_mm).abs() < 0.5, "found at {found}");
    }
}

fn assert_as_in_software(sets: &[&str]) {
    let first = ran(sets);
    assert_alike(&first.recording.summary, &software(sets));
    assert!(first.load.unmodelled.is_empty(), "{:#?}", first.load.unmodelled);
    assert!(first.machine.restarts().is_empty());
    assert_eq!(first.load.missed(), Vec::<String>::new());
    // A sensor's frame more or less before it is all that moves the tick.
    assert!(first.load.tick.jitter < 4_000, "{:?}", first.load.tick);
    assert!(u64::from(first.load.stack_used) < first.load.stack, "{}", first.load.stack_used);
    let ticks = first.load.cycles / first.load.clock_hz.div_euclid(1000);
    assert!(first.load.tick.runs.abs_diff(ticks) <= 1, "{} of {ticks}", first.load.tick.runs);
    // Again, the same bytes.
    let again = ran(sets);
    let (a, b) = (&again.recording, &first.recording);
    assert_eq!(a.summary.trace_digest, b.summary.trace_digest);
    assert_eq!(a.log, b.log);
    assert_eq!(again.load, first.load);
}

#[test]
fn a_deployment_is_that_of_the_software_and_the_same_again() {
    assert_as_in_software(&["run.seed=1"]);
}

#[test]
fn a_retraction_is_that_of_the_software_and_the_same_again() {
    assert_as_in_software(&["run.seed=1", "run.direction=retract"]);
}

/// The board against the same deployment in software, by processor time of
/// this thread, the best of alternating runs: a slow hook or repeated translation would show.
#[test]
fn a_deployment_is_far_ahead_of_the_rig() {
    const MOST: f64 = 60.0;
    if !hil_sim::testing::long() {
        return;
    }
    let timed = |run: &dyn Fn()| {
        let begun = cpu_time::ThreadTime::now();
        run();
        begun.elapsed().as_secs_f64()
    };
    let sets = ["run.seed=1"];
    let (mut board, mut software) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..4 {
        board = board.min(timed(&|| drop(ran(&sets))));
        let run = || drop(session::run(&scenario(&sets), Options::default()).expect("a run"));
        software = software.min(timed(&run));
    }
    assert!(board <= MOST * software, "{board:.3} s on the board, {software:.4} s in software");
}

#[test]
fn power_up_leads_to_idle_with_the_bridges_off_and_reports_power_alone() {
    let mut board = Board::off(&[]);
    let power = Restart { reset: Reset::Power, snapshot: None, crash: None };
    assert_eq!(board.report(), power);
    for text in ["interstage", "mode: self-test", "mode: zeroing", "mode: idle"] {
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
    let mut board = Board::idle();
    board.send(b's');
    board.until("deploying: cruise", 4000);
    board.run(100);
    let open = |board: &mut Board, open| {
        let now = board.bench.machine().now();
        for pin in [Pin::STOP_DRIVE, Pin::STOP_PRELOAD] {
            board.machine().chip_mut().drive(pin, open, now);
        }
    };
    open(&mut board, true);
    board.until("fault 151", 20);
    assert!(!drives(&mut board, 200));
    open(&mut board, false);
    assert!(!drives(&mut board, 200), "closing the contact starts nothing");
    board.send(b'0');
    board.until("mode: idle", 1500);
    board.send(b's');
    assert!(drives(&mut board, 500));
}

#[test]
fn power_lost_in_the_middle_of_a_crossing_is_survived() {
    let mut board = Board::idle();
    board.send(b's');
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
    board.strike(Fault::TimerFlags);
    board.run(2000);
    assert!(!board.said("mode: idle"), "it starts as if nothing were wrong: {:#?}", board.log);
}

/// A run with a fault that comes when this is logged; what is logged after that.
fn struck(text: &str, fault: Fault, milliseconds: u32) -> (Board, Vec<String>) {
    let mut board = Board::idle();
    board.send(b's');
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
        Fault::StuckCode(0, 0xFFFF),
        Fault::StuckCode(1, 0),
        Fault::BitErrors(1 << 9),
        Fault::AngleLost,
        Fault::EncoderLine(1),
        Fault::DmaStalled,
    ] {
        let (mut board, lines) = struck("deploying: approach", fault, 1500);
        assert!(lines.iter().any(|line| line.contains("] fault ")), "{fault}: {lines:#?}");
        assert!(!drives(&mut board, 300), "{fault}");
        assert!(board.bench.machine().restarts().is_empty(), "{fault}: the tasks live on");
    }
}

#[test]
fn bit_errors_that_pass_are_ridden_out() {
    let mut board = Board::idle();
    board.send(b's');
    board.until("deploying: approach", 8000);
    for _ in 0..5 {
        let fault = Fault::BitErrors(1 << 5);
        board.strike(fault);
        board.run(3);
        fault.switch(board.machine(), false).expect("a fault");
        board.run(40);
    }
    assert!(!board.said("] fault "), "{:#?}", board.log);
    board.until("mode: deployed", 20_000);
}
