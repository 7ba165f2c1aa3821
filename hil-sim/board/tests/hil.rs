//! Hardware in the loop over the emulated board: the plant on this host, the controller
//! in the firmware with the feature `hil`.

use std::sync::OnceLock;

use hil_sim::firmware::{self, Profile};
use hil_sim::hil::{self, Asked, HilError, HostLine, Image};
use hil_sim::plant::rig::VirtualRig;
use hil_sim::plant::sensors::Sensors;
use hil_sim::probe::Port;
use hil_sim::record::Recording;
use hil_sim::record::{Columns, Run};
use hil_sim::replay::replay;
use hil_sim::scenario::Scenario;
use hil_sim::session;
use interstage::fault::Fault;
use interstage::hal::hil::{FIRST, Given, Taken};
use interstage::rig::Rig;
use interstage::supervise::{Command, Mode};
use rig_board::bench::STEP;
use rig_board::log::Strings;
use rig_board::port::EmulatedPort;

use crate::common::{self, OnUsb, scenario};

fn elf() -> &'static [u8] {
    static ELF: OnceLock<Vec<u8>> = OnceLock::new();
    ELF.get_or_init(|| firmware::image(Profile::Loop).expect("the firmware builds"))
}

fn board() -> EmulatedPort {
    EmulatedPort::new(elf()).expect("an image")
}

/// A run over this port, with its rows.
fn looped(port: &mut dyn Port, scenario: &Scenario) -> Result<Recording, HilError> {
    hil::run(port, scenario, Asked { rows: true, target: "board" }, |_| {})
}

#[test]
fn a_run_in_the_loop_is_the_run_in_software_bit_for_bit() {
    for sets in [&["run.seed=3"][..], &["run.seed=4", "run.direction=retract"]] {
        let scenario = scenario(sets);
        let mut port = board();
        let board = looped(&mut port, &scenario).expect("a run");
        let software = session::run(&scenario, session::Options::ROWS).expect("a run");
        let (seen, wanted) = (&board.summary, &software.summary);
        assert!(seen.completed && seen.faults.is_empty(), "{:?}", seen.faults);
        assert_eq!((seen.target.as_str(), wanted.target.as_str()), ("board", "sil"));
        assert_eq!(seen.trace_digest, wanted.trace_digest);
        assert_eq!(seen.crossings, wanted.crossings);
        assert_eq!(seen.crossings.len(), 3);
        let all = |recording: &Recording| format!("{:?}", recording.rows);
        assert!(all(&board) == all(&software), "rows differ");
        let lines = |recording: &Recording| {
            recording.log.iter().map(|line| (line.t_s, line.text.clone())).collect::<Vec<_>>()
        };
        assert_eq!(lines(&board), lines(&software));
        // The log is the board's own, and replays.
        let run = Run::of_stream(&board.stream);
        assert!(run.is_complete(), "{:?}", run.marks);
        assert!(replay(&run, &Rig::prototype()).expect("a sound rig").is_equal());
        // Nothing but the host's side was driven, and the watchdog never bit.
        bridges_have_no_power(&mut port);
        assert_eq!(port.machine.restarts().len(), 1, "the reset before the run");
    }
}

/// Neither PWM nor enable lines were ever driven.
fn bridges_have_no_power(port: &mut EmulatedPort) {
    let now = port.machine.now();
    for motor in port.machine.chip_mut().take_motors(now) {
        assert_eq!((motor.duty, motor.enabled), (0.0, 0.0));
    }
}

#[test]
fn a_slow_port_stretches_time_and_changes_nothing() {
    let moves = |tick: u32, mode| tick >= FIRST + 800 && matches!(mode, Mode::Run(..));
    let slow = deployed(&mut OnUsb::new(board()), |_| true, moves);
    let fast = deployed(&mut board(), |_| true, moves);
    assert!(fast.1.len() > 10_000 && slow.1 == fast.1, "{} bytes", fast.1.len());
    assert!(slow.0 == fast.0, "other commands");
}

/// A deployment over this port up to the tick in which `ends` says so, with the log's channel read
/// in the ticks that `reads` names: the commands of the bridges in every tick, what was read, and
/// the last codes.
fn deployed(
    port: &mut dyn Port,
    reads: impl Fn(u32) -> bool,
    ends: impl Fn(u32, Mode) -> bool,
) -> (Vec<Taken>, Vec<u8>, Given) {
    let (mut rig, mut line) = (Rigged::new(3), HostLine::begin(port).expect("ready"));
    let (mut start, mut mode) = (Some(Command::Start), Mode::Boot);
    let (mut all, mut log) = (Vec::new(), Vec::new());
    for tick in FIRST..FIRST + 12_000 {
        let command = if mode == Mode::Idle { start.take() } else { None };
        let taken = rig.tick(&mut line, tick, command);
        mode = taken.mode().expect("a mode");
        all.push(taken);
        if reads(tick) {
            log.extend(line.port().up(1).expect("reads"));
        }
        if ends(tick, mode) {
            return (all, log, rig.given);
        }
    }
    panic!("it does not arrive: {mode:?}");
}

/// Commands of the bridges in every tick of a deployment, and what was read of its log.
fn commands(reads: impl Fn(u32) -> bool) -> (Vec<Taken>, Vec<u8>) {
    let arrives = |_, mode| matches!(mode, Mode::Complete(_));
    let (all, log, _) = deployed(&mut board(), reads, arrives);
    (all, log)
}

/// Runs a deployment for so many ticks, and gives the board's codes there.
fn under_way(port: &mut EmulatedPort, ticks: u32) -> Given {
    let reads = |tick: u32| tick.is_multiple_of(32);
    let (all, _, given) = deployed(port, reads, |tick, _| tick == FIRST + ticks - 1);
    let mode = all.last().and_then(Taken::mode);
    assert!(matches!(mode, Some(Mode::Run(..))), "{mode:?}");
    given
}

#[test]
fn a_reader_that_stalls_or_is_not_there_changes_no_bit_of_the_control_trace() {
    let (read, log) = commands(|_| true);
    let run = Run::of_stream(&log);
    assert!(run.is_complete() && run.rows.len() > 4000, "{:?}", run.marks);
    let (absent, nothing) = commands(|_| false);
    assert!(nothing.is_empty() && absent == read, "absent");
    let (stalled, part) = commands(|tick| (500..800).contains(&(tick % 1000)));
    assert!(stalled == read, "stalled");
    let part = Run::of_stream(&part);
    assert!(part.counts.lost_frames > 100, "{:?}", part.counts);
    // What was lost is marked, and what was read is true.
    assert!(replay(&part, &Rig::prototype()).expect("a sound rig").difference.is_none());
    let lost = part.counts.lost_ticks as usize + part.rows.len();
    assert!(lost.abs_diff(run.rows.len()) < 110, "{lost} of {}", run.rows.len());
}

/// A plant with its sensors.
struct Rigged {
    plant: VirtualRig,
    sensors: Sensors,
    given: Given,
}

impl Rigged {
    fn new(seed: u64) -> Self {
        let parameters = scenario(&[&format!("run.seed={seed}")]).plant();
        let sensors = Sensors::new(parameters.sensors.clone(), seed);
        let plant = VirtualRig::new(parameters, 0.0, 0.0, 1e-3);
        Self { plant, sensors, given: Given::default() }
    }

    fn tick(&mut self, line: &mut HostLine<'_>, tick: u32, command: Option<Command>) -> Taken {
        let codes = session::read(&mut self.sensors, &self.plant);
        self.given = Given::codes(codes.sensors, codes.bridges);
        let taken = line.tick(tick, self.given.with(command)).expect("goes");
        let (drive, preload) = taken.commands();
        self.plant.step(&session::drives(drive, preload), 1e-3).expect("moves");
        taken
    }
}

#[test]
fn a_host_that_falls_silent_leaves_the_bridges_off() {
    let mut port = board();
    let given = under_way(&mut port, 3000);
    port.up(1).expect("reads");
    // A second of nothing.
    let mut stream = Vec::new();
    for _ in 0..1000 {
        let machine = &mut port.machine;
        let until = machine.now() + 170_000;
        machine.run_on(until).expect("runs");
        stream.extend(port.up(1).expect("reads"));
    }
    let run = Run::of_stream(&stream);
    let alone = run.rows.iter().position(|row| row.tick >= FIRST + 3000).expect("it continues");
    let rows = &run.rows[alone..];
    let seen: Vec<_> = rows.iter().filter_map(Columns::telemetry).collect();
    // It went on alone: after 200 ms a tick a millisecond, of which the last few are not
    // in the log yet.
    assert!((785..=800).contains(&seen.len()), "{} ticks", seen.len());
    let held = seen.iter().position(|seen| matches!(seen.mode, Mode::FaultHold(_)));
    let held = held.expect("a fault hold");
    let stale = (Rig::prototype().sense.stale_after_s * 1e3) as usize;
    assert!(held <= stale + 3, "{held} ticks alone");
    // The counter cannot be silent: it stops, and the reference advances.
    let found = [
        Fault::PreloadSensorStale,
        Fault::CompressionSensorStale,
        Fault::ArmAngleStale,
        Fault::DriveRunaway,
        Fault::DriveStalled,
    ];
    assert!(
        matches!(seen[held].mode, Mode::FaultHold(fault) if found.contains(&fault)),
        "{:?}",
        seen[held].mode
    );
    assert!(rows[held..].iter().all(|row| !row.drive_on && !row.pretightener_on));
    // What is still driven are ticks that ran: the watchdog has not bitten.
    assert_eq!(port.machine.restarts().len(), 1);
    bridges_have_no_power(&mut port);
    // A host that comes back gets an error, and has to start again.
    let next = FIRST + 3000;
    let mut line = HostLine::begin_at(&mut port);
    assert!(matches!(line.tick(next, given), Err(HilError::Alone(_))));
    assert!(matches!(line.state(), Ok((_, true))));
    let ran = looped(&mut port, &scenario(&["run.seed=3"])).expect("a run");
    assert!(ran.summary.completed);
}

#[test]
fn a_question_asked_twice_is_answered_twice_and_done_once() {
    let mut port = board();
    let given = under_way(&mut port, 3000);
    let mut line = HostLine::begin_at(&mut port);
    let last = FIRST + 2999;
    let (first, again) =
        (line.tick(last, given).expect("repeated"), line.tick(last, given).expect("and again"));
    assert_eq!(first, again);
    assert_eq!(line.state().expect("stands"), (FIRST + 3000, false));
    let error = line.tick(FIRST + 3200, given).unwrap_err();
    assert!(matches!(error, HilError::Apart { board, .. } if board == FIRST + 3000), "{error}");
}

#[test]
fn other_firmware_and_other_parameters_are_told_from_a_board_in_the_loop() {
    let fe = Scenario::named("fe").expect("a preset");
    let error = looped(&mut board(), &fe).unwrap_err();
    assert!(matches!(&error, HilError::Parameters { board, .. } if board == "prototype"));
    assert!(error.to_string().contains("rig params restore"), "{error}");
    let mut port = EmulatedPort::new(common::elf()).expect("an image");
    let error = looped(&mut port, &scenario(&[])).unwrap_err();
    assert!(error.to_string().contains("feature `hil`"), "{error}");
}

#[test]
fn an_image_is_known_by_its_hash() {
    let ordinary = Image::of(common::elf()).expect("an image");
    let looped = Image::of(elf()).expect("an image");
    let mut port = board();
    assert_eq!(looped.is_on(&mut port), Ok(true));
    assert_eq!(ordinary.is_on(&mut port), Ok(false));
}

#[test]
fn without_a_host_the_pins_are_low_a_watchdog_runs_and_the_log_says_that_nothing_moves() {
    let mut port = board();
    port.machine.chip_mut().defects.drive_bridge_floats = true;
    let mut wait = |milliseconds: u64| {
        let machine = &mut port.machine;
        machine.run_on(machine.now() + milliseconds * STEP).expect("runs");
        let now = machine.now();
        machine.chip_mut().take_motors(now)
    };
    wait(1);
    for motor in wait(300) {
        assert_eq!((motor.duty, motor.enabled), (0.0, 0.0), "low");
    }
    assert!(port.machine.chip().watchdog.started);
    assert_eq!(port.machine.restarts(), []);
    let strings = Strings::of(elf()).expect("it logs");
    let lines = strings.reader().read(&port.up(0).expect("runs"));
    assert!(lines.iter().any(|line| line.text.contains("moves no motor")), "{lines:?}");
}
