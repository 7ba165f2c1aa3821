//! The binary log of the firmware itself, on the emulated board.

#![cfg(feature = "board")]

use std::sync::OnceLock;

use hil_sim::board::bench::Bench;
use hil_sim::board::load::Gathered;
use hil_sim::board::log::{Line, Strings};
use hil_sim::board::peripherals::rcc::Cause;
use hil_sim::board::run;
use hil_sim::firmware::{self, Footprint, Profile};
use hil_sim::log::{Mark, Row, Run};
use hil_sim::replay::replay;
use hil_sim::scenario::Scenario;
use interstage::log::capture::Trigger;
use interstage::rig::Rig;
use interstage::supervise::Mode;

fn elf() -> &'static [u8] {
    static ELF: OnceLock<Vec<u8>> = OnceLock::new();
    ELF.get_or_init(|| {
        let path = firmware::build(Profile::Release).expect("the firmware builds");
        std::fs::read(path).expect("readable")
    })
}

fn strings() -> &'static Strings {
    static STRINGS: OnceLock<Strings> = OnceLock::new();
    STRINGS.get_or_init(|| Strings::of(elf()).expect("it logs"))
}

fn scenario(sets: &[&str]) -> Scenario {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    Scenario::resolve(Some("prototype"), None, &sets).expect("a scenario")
}

/// A board under way, with what it has said on both channels.
struct Board {
    bench: Bench<'static>,
    lines: Vec<Line>,
    frames: Vec<u8>,
}

impl Board {
    fn off() -> Self {
        let bench = Bench::new(elf(), strings(), &scenario(&["run.seed=1"])).expect("a bench");
        Self { bench, lines: Vec::new(), frames: Vec::new() }
    }

    fn run(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.lines.extend(self.bench.step().expect("runs").1);
            self.frames.extend(self.bench.take_frames());
        }
    }

    fn until(&mut self, text: &str, milliseconds: u32) {
        let from = self.lines.len();
        for _ in 0..milliseconds {
            self.run(1);
            if self.lines[from..].iter().any(|line| line.text.contains(text)) {
                return;
            }
        }
        panic!("no `{text}` within {milliseconds} ms");
    }

    fn send(&mut self, letter: u8) {
        assert!(self.bench.send(letter).expect("runs"), "the console listens");
    }

    fn log(&self) -> Run {
        Run::of_stream(&self.frames)
    }
}

#[test]
fn every_tick_of_a_run_is_logged_and_runs_again_on_this_host() {
    for sets in [&["run.seed=1"][..], &["run.seed=1", "run.direction=retract"]] {
        let ran = run::run(elf(), &scenario(sets), true, |_, _| {}).expect("a run");
        let run = Run::of_stream(&ran.recording.stream);
        assert!(run.is_whole(), "{:?}", run.marks);
        assert_eq!(run.ledger.len(), 3);
        let header = run.header.clone().expect("it says who it is");
        assert_eq!((header.rig.as_str(), header.build.len()), ("prototype", 16));
        assert_ne!(header.build, "0".repeat(16));
        let result = replay(&run, &Rig::prototype()).expect("a sound rig");
        assert!(result.is_equal(), "{result:?}");
        assert!(result.events as usize == run.events.len() && result.plans.1 == 0, "{result:?}");
        // What the report shows of the controller is its own word.
        let rows = &ran.recording.rows;
        // But for the last ticks, which had not left the board when the run ended.
        let logged = &rows[2000..rows.len() - 24];
        assert!(logged.iter().all(|row| row.position_est_mm.is_finite()));
        // Bytes a tick: what a probe has to keep up with.
        let mean = ran.recording.stream.len() as f64 / run.rows.len() as f64;
        assert!(mean < 50.0, "{mean}");
    }
}

/// A run until the drive has arrived, with the channel read or not: how long it took, ms,
/// what the text log says of the crossings, and what the tick cost.
fn deployment(listen: bool) -> (u32, Vec<Vec<f64>>, hil_sim::board::load::Load) {
    let mut board = Board::off();
    board.bench.listen(listen);
    board.until("mode: idle", 3000);
    let (mut gathered, mut crossings) = (Gathered::default(), Vec::new());
    gathered.begin(board.bench.machine_mut());
    board.send(b's');
    for millisecond in 0..8000 {
        let (_, lines) = board.bench.step().expect("runs");
        board.bench.take_frames();
        let closed = lines.iter().filter(|line| line.text.contains("] step "));
        // From the speed on: what stands before it is the time and the place.
        crossings.extend(closed.map(|line| line.numbers()[4..].to_vec()));
        gathered.gather(board.bench.machine_mut(), 5);
        if lines.iter().any(|line| line.text.contains("mode: deployed")) {
            let footprint = Footprint::of_elf(elf()).expect("an image");
            let machine = board.bench.into_machine();
            return (millisecond, crossings, gathered.close(&machine, &footprint, 0));
        }
    }
    panic!("it did not arrive");
}

#[test]
fn a_reader_that_is_not_there_changes_nothing() {
    let (read, unread) = (deployment(true), deployment(false));
    // The journal's time differs by the copying of its frames, and with it the cycle in
    // which an interrupt is taken; the loop amplifies that as it does any noise.
    assert!(read.0.abs_diff(unread.0) <= 20, "{} ms, {} ms", read.0, unread.0);
    assert_eq!((read.1.len(), unread.1.len()), (3, 3));
    for (read, unread) in read.1.iter().flatten().zip(unread.1.iter().flatten()) {
        assert!((read - unread).abs() <= 0.3 + 0.02 * unread.abs(), "{read} {unread}");
    }
    let (with, without) = (read.2, unread.2);
    let near = |a: f64, b: f64| (a / b - 1.0).abs() <= 0.02;
    assert!(near(with.tick.mean, without.tick.mean), "{:?} {:?}", with.tick, without.tick);
    assert!(near(with.tick.worst as f64, without.tick.worst as f64));
    assert!(near(with.start.jitter as f64, without.start.jitter as f64));
}

#[test]
fn frames_that_found_no_room_are_marked_and_the_capture_waits_for_its_reader() {
    let mut board = Board::off();
    board.until("mode: idle", 3000);
    // Nobody listens while the drive is started and goes over the first step.
    board.bench.listen(false);
    board.send(b's');
    board.until("deploying: settle", 9000);
    board.run(1500);
    board.bench.listen(true);
    board.run(1500);
    let run = board.log();
    // A short frame may find room where a long one did not, so there are several marks.
    let (mut frames, mut ticks) = (0, 0);
    for (_, mark) in &run.marks {
        match mark {
            Mark::Lost { frames: lost, dropped } => {
                assert_eq!(lost, dropped);
                frames += lost;
            }
            other => panic!("{other}"),
        }
    }
    for pair in run.rows.windows(2) {
        ticks += u64::from(pair[1].tick - pair[0].tick - 1);
    }
    assert!(frames > 300 && ticks > 2400, "{frames} frames, {ticks} ticks");
    assert_eq!((run.tally.lost_frames, run.tally.lost_ticks), (u64::from(frames), ticks));
    // The command came first, and its capture is kept whole until it has been read.
    let first = run.shots.first().expect("captured");
    assert_eq!(first.trigger, Trigger::Command);
    let pieces: Vec<_> = run.shots.iter().take_while(|piece| piece.at == first.at).collect();
    let shots: usize = pieces.iter().map(|piece| piece.shots.len()).sum();
    assert_eq!(shots, usize::from(first.of));
    assert_eq!(pieces.len(), usize::from(first.of).div_ceil(16));
}

#[test]
fn a_restart_in_the_middle_is_marked_and_both_parts_run_again() {
    let mut board = Board::off();
    board.until("mode: idle", 3000);
    board.send(b's');
    board.until("deploying: crossing", 8000);
    board.bench.machine_mut().restart(Cause::Power).expect("restarts");
    board.until("mode: idle", 3000);
    board.run(200);
    let run = board.log();
    assert_eq!(run.tally.restarts, 1, "{:?}", run.marks);
    let result = replay(&run, &Rig::prototype()).expect("a sound rig");
    assert!(result.difference.is_none(), "{result:?}");
    let idle = run.rows.last().and_then(Row::telemetry).expect("a row");
    assert_eq!(idle.mode, Mode::Idle);
    assert!(result.ticks as usize > run.rows.len() / 2, "{result:?}");
}

/// Minutes of deploying and retracting without a gap.
#[test]
fn a_minute_of_deploying_and_retracting_is_logged_without_a_gap() {
    let mut board = Board::off();
    board.until("mode: idle", 3000);
    for round in 0..6 {
        let (letter, arrived) =
            if round % 2 == 0 { (b's', "mode: deployed") } else { (b'r', "mode: retracted") };
        board.send(letter);
        board.until(arrived, 20_000);
        board.run(100);
    }
    let run = board.log();
    assert!(run.is_whole(), "{:?}", run.marks);
    assert_eq!(run.ledger.len(), 18);
    assert!(replay(&run, &Rig::prototype()).expect("a sound rig").is_equal());
}
