//! Every end of the firmware, on the emulated board: the bridges go off, and the next start
//! reports the cause.

use hil_sim::faults::campaign::Case;
use hil_sim::scenario::injection::{Kind, Target};
use interstage::restart::{MissedCheckIns, Reset, Restart, Stopped};
use interstage::supervise::Mode;
use interstage::units::Direction;
use rig_board::bench::STEP;
use rig_board::core::Register;
use rig_board::fault_injector::TaskSearch;
use rig_board::faults::switch;
use rig_board::peripherals::rcc::Cause;

use crate::common::{Board, fault, tried};

fn hang(restart: &Restart) -> (u32, MissedCheckIns) {
    match restart.crash.map(|crash| crash.stopped) {
        Some(Stopped::Hang { pc, missed, .. }) => (pc, missed),
        _ => panic!("{restart}"),
    }
}

#[test]
fn a_panic_is_reported_with_its_line_and_what_the_drive_did() {
    let mut board = Board::moving();
    let at = board.position_mm();
    let panics = board.function("panic_bounds_check");
    // Index, length, and the address of some location.
    let place = 0x0800_1000;
    let line = board.bench.machine.word(place + 8).expect("flash");
    for (register, value) in [(Register::R(0), 7), (Register::R(1), 3), (Register::R(2), place)] {
        board.set(register, value);
    }
    board.set(Register::Pc, panics);
    board.ends(Cause::Software, 40, 2);
    let restart = board.report();
    assert_eq!(restart.reset, Reset::Software);
    assert_eq!(restart.crash.expect("a crash").stopped, Stopped::Panic { place, line });
    let snapshot = restart.snapshot.expect("what it did");
    assert!(matches!(snapshot.mode(), Some(Mode::Run(Direction::Deploy, _))), "{snapshot:?}");
    assert!((snapshot.position.to_num::<f64>() - at).abs() < 0.3, "{snapshot:?} at {at}");
    for said in ["restarted by software", "panicked in line", "before: tick"] {
        assert!(board.said(said), "{said}: {:#?}", board.log);
    }
}

#[test]
fn a_hard_fault_is_reported_with_where_and_why() {
    let mut board = Board::moving();
    // No memory.
    board.set(Register::Pc, 0x0900_0000);
    board.ends(Cause::Software, 60, 2);
    let restart = board.report();
    match restart.crash.expect("a crash").stopped {
        Stopped::Fault { pc, cfsr, hfsr, .. } => {
            assert_eq!(pc, 0x0900_0000);
            assert_ne!(cfsr, 0);
            assert_eq!(hfsr, 1 << 30, "escalated");
        }
        other => panic!("{other:?}"),
    }
    assert!(restart.snapshot.is_some());
}

/// Tasks by their functions in `main.rs`, those of converters by their sensors, their names in the
/// record, and cycles into the middle of a poll, before the task checks in.
const TASKS: [(&str, &str, u64); 8] = [
    ("wheel_encoder", "wheel encoder", 60),
    ("preload_sensor", "preload sensor", 130),
    ("compression_sensor", "compression sensor", 130),
    ("arm_angle", "arm angle", 60),
    ("motors", "the control tick", 100),
    ("model", "model", 1050),
    ("journal", "journal", 1500),
    ("link", "an operator's task or the host's line", 300),
];

/// Runs the board to the next poll of a task, and so many cycles into it.
fn into_poll(board: &mut Board, task: &'static str, cycles: u64) {
    let mut search = TaskSearch::new(board.machine(), task, cycles);
    for _ in 0..500 {
        let until = board.bench.end;
        let machine = board.machine();
        if search.run(machine, until).expect("runs") {
            // A hang in a critical section is for the watchdog alone.
            while machine.register(Register::Primask).expect("a register") & 1 != 0 {
                machine.run_on(machine.now() + 5).expect("runs");
            }
            return;
        }
        board.step();
    }
    panic!("{task} is not polled");
}

#[test]
fn the_task_that_hangs_is_named_whichever_it_is() {
    for (task, name, cycles) in TASKS {
        let mut board = Board::moving();
        into_poll(&mut board, task, cycles);
        board.strike(fault(Target::Processor, Kind::Hung));
        // Time until the task is missed, and that of the watchdog.
        board.ends(Cause::Watchdog, 161, 135);
        let restart = board.report();
        assert_eq!(restart.reset, Reset::Watchdog, "{task}");
        let (pc, missed) = hang(&restart);
        assert_eq!(missed.name(), name, "{task}: {restart}");
        assert_ne!(pc, 0, "{task}");
    }
}

#[test]
fn an_interrupt_that_never_ceases_ends_in_a_reset_that_names_the_starved_tick() {
    let mut board = Board::moving();
    // Between two ticks the core sleeps.
    let machine = board.machine();
    machine.run_on(machine.now() + STEP / 2).expect("runs");
    let at = board.position_mm();
    board.strike(fault(Target::Interrupt, Kind::Flooding));
    // The system timer's interrupt is more urgent and cuts before the watchdog resets.
    board.ends(Cause::Watchdog, 116, 85);
    let storm = fault(Target::Interrupt, Kind::Flooding);
    switch(board.machine(), &storm, false).expect("a fault");
    let restart = board.report();
    let (pc, missed) = hang(&restart);
    assert_eq!(missed, MissedCheckIns::STARVED);
    assert_ne!(pc, 0);
    let on = board.position_mm() - at;
    assert!(on < 1.0, "it moved on by {on} mm");
}

#[test]
fn a_report_is_made_once() {
    let mut board = Board::moving();
    board.strike(fault(Target::ResetPin, Kind::Reset));
    let first = board.report();
    assert_eq!(first.reset, Reset::Pin);
    assert!(matches!(first.snapshot.and_then(|f| f.mode()), Some(Mode::Run(..))));
    board.machine().restart(Cause::Software).expect("restarts");
    let second = board.report();
    assert_eq!(second.reset, Reset::Software);
    assert_eq!(second.snapshot.and_then(|f| f.mode()), Some(Mode::Idle));
}

#[test]
fn after_resets_at_random_instants_the_drive_holds_and_the_next_run_arrives() {
    if !hil_sim::testing::long() {
        return;
    }
    let all = Case::all_on_board().into_iter();
    let cases = all.filter(|case| case.is_one_of(&["reset".to_owned()])).collect();
    assert!(tried(cases, 4).matrix.len() >= 5);
}
