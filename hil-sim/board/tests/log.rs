//! The binary log of the firmware itself, on the emulated board.

use hil_sim::record::{Columns, Mark, Run};
use hil_sim::replay::replay;
use interstage::rig::Rig;
use interstage::supervise::Mode;
use interstage::tick::Event;
use interstage::units::Q16;
use rig_board::bench::STEP;
use rig_board::peripherals::rcc::Cause;

use crate::common::{Board, ran, scenario};

/// How far the log may be from the truth during a run. Position: the tolerance of the steps'
/// places, which the controller knows from its table and corrects itself by. Preload: two
/// deviations of the preload sensor's gain at 50 N, six of its noise, and its age.
const POSITION_MM: f64 = 0.8;
const PRELOAD_N: f64 = 1.0;

#[test]
fn every_tick_of_a_run_is_logged_and_runs_again_on_this_host() {
    for sets in [&["run.seed=1"][..], &["run.seed=1", "run.direction=retract"]] {
        let ran = ran(&scenario(sets), true);
        let run = Run::of_stream(&ran.recording.stream);
        assert!(run.is_complete(), "{:?}", run.marks);
        assert_eq!(run.ledger.len(), 3);
        let header = run.header.clone().expect("it says who it is");
        assert_eq!((header.rig.as_str(), header.build.len()), ("prototype", 16));
        assert_ne!(header.build, "0".repeat(16));
        let result = replay(&run, &Rig::prototype()).expect("a sound rig");
        assert!(result.is_equal(), "{result:?}");
        // Why the board started is not the controller's to say.
        let own = run.events.iter().filter(|entry| !matches!(entry.event, Event::Restart(_)));
        assert!(result.events as usize == own.count() && result.plans.1 == 0, "{result:?}");
        // What the report shows of the controller is its own word.
        let rows = &ran.recording.rows;
        // But for the last ticks, which had not left the board when the run ended.
        let logged = &rows[2000..rows.len() - 24];
        assert!(logged.iter().all(|row| row.controller.position_mm.is_finite()));
        // Bytes a tick: what a probe has to keep up with.
        let mean = ran.recording.stream.len() as f64 / run.rows.len() as f64;
        assert!(mean < 50.0, "{mean}");
    }
}

/// Reader of the binary log's channel.
#[derive(Clone, Copy, PartialEq)]
enum Reader {
    /// One that keeps up.
    There,
    Absent,
    /// One that stalls for 700 of every 1000 ms.
    Stalled,
    /// None, and the image records no tick.
    Mute,
}

/// What the control tick cost, tick by tick, and when it began.
#[derive(Default)]
struct Ticks {
    cycles: Vec<u64>,
    starts: Vec<u64>,
}

impl Ticks {
    fn gather(&mut self, board: &mut Board) {
        let machine = &mut board.bench.machine;
        let tick = machine.tasks.names().position(|name| name == "motors").expect("the tick");
        for turn in machine.profile.take_polls().iter().filter(|turn| turn.task == tick) {
            self.cycles.push(turn.cycles);
            self.starts.push(turn.began);
        }
    }

    /// Mean cycles, of all ticks and of the dearest hundredth: in which of them a plan comes differs with
    /// how much of the core the model task has.
    fn cost(&self) -> [f64; 2] {
        let mut cycles = self.cycles.clone();
        cycles.sort_unstable();
        let mean = |part: &[u64]| part.iter().sum::<u64>() as f64 / part.len() as f64;
        [mean(&cycles), mean(&cycles[cycles.len() * 99 / 100..])]
    }

    /// Deviation of the beginnings from an even beat, cycles, and from the earliest to the latest.
    fn jitter(&self) -> [f64; 2] {
        let first = self.starts[0] / STEP;
        let phase = |(tick, at): (u64, &u64)| *at as f64 - ((first + tick) * STEP) as f64;
        let mut phases: Vec<f64> = (0..).zip(&self.starts).map(phase).collect();
        let mean = phases.iter().sum::<f64>() / phases.len() as f64;
        let square = phases.iter().map(|phase| (phase - mean).powi(2)).sum::<f64>();
        // One tick in a thousand coincides with what another run's does not.
        phases.sort_by(f64::total_cmp);
        let (last, cut) = (phases.len() - 1, phases.len() / 1000);
        [(square / phases.len() as f64).sqrt(), phases[last - cut] - phases[cut]]
    }
}

/// Has the image keep no tick for the log: the function that does returns at once.
fn mute(board: &mut Board) {
    const BX_LR: [u8; 2] = [0x70, 0x47];
    let keeps = board.function("exchange::Exchange::record");
    board.machine().poke(keeps, &BX_LR).expect("flash");
}

/// A run until the drive has arrived: how long it took, ms, and what the tick cost. That the
/// controller gives the same bits with any reader is seen in lockstep: `hil.rs`.
fn deployment(reader: Reader) -> (u32, Ticks) {
    let mut board = Board::off(&["run.seed=1"]);
    board.bench.listen(reader == Reader::There);
    if reader == Reader::Mute {
        mute(&mut board);
    }
    board.until("mode: idle", 3000);
    let mut ticks = Ticks::default();
    board.bench.machine.profile.take_polls();
    board.send(b's');
    for millisecond in 0..8000 {
        if reader == Reader::Stalled {
            board.bench.listen(millisecond % 1000 < 300);
        }
        board.step();
        ticks.gather(&mut board);
        if board.said("mode: deployed") {
            return (millisecond, ticks);
        }
    }
    panic!("it did not arrive");
}

/// Telemetry at full rate changes nothing of the control tick's beginning, with or without a
/// reader, and whether there is any.
#[test]
fn neither_telemetry_nor_its_reader_changes_when_the_tick_begins_or_what_it_takes() {
    /// What two runs may differ by, relative.
    const SAME: f64 = 0.02;
    /// And the extremes of their beginnings, cycles: 1 us, a thousandth of the period.
    const EXTREMES: f64 = 170.0;
    let (arrived, read) = deployment(Reader::There);
    let off = |one: f64, other: f64| (one / other - 1.0).abs();
    for (name, reader) in
        [("absent", Reader::Absent), ("stalled", Reader::Stalled), ("mute", Reader::Mute)]
    {
        let (millisecond, ticks) = deployment(reader);
        assert!(arrived.abs_diff(millisecond) <= 20, "{name}: {arrived} ms, {millisecond} ms");
        let (cost, jitter) = (ticks.cost(), ticks.jitter());
        for (what, one, other) in [
            ("deviation of its beginning", read.jitter()[0], jitter[0]),
            ("mean cycles", read.cost()[0], cost[0]),
            ("mean of the dearest hundredth", read.cost()[1], cost[1]),
        ] {
            assert!(off(one, other) <= SAME, "{name}: {what}: {one:.1}, {other:.1}");
        }
        let (one, other) = (read.jitter()[1], jitter[1]);
        println!("{name}: earliest to latest beginning: {one}, {other} cycles");
        assert!((one - other).abs() <= EXTREMES, "{name}: extremes: {one}, {other}");
    }
}

#[test]
fn frames_that_found_no_room_are_marked_and_the_capture_waits_for_its_reader() {
    let mut board = Board::off(&["run.seed=1"]);
    board.until("mode: idle", 3000);
    // The channel is not read during the start and the first crossing.
    board.bench.listen(false);
    board.send(b's');
    board.until("deploying: settle", 9000);
    board.run(1500);
    board.bench.listen(true);
    board.run(1500);
    let run = Run::of_stream(&board.frames);
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
    assert_eq!((run.counts.lost_frames, run.counts.lost_ticks), (u64::from(frames), ticks));
}

#[test]
fn a_restart_in_the_middle_is_marked_and_both_parts_run_again() {
    let mut board = Board::off(&["run.seed=1"]);
    board.until("mode: idle", 3000);
    board.send(b's');
    board.until("deploying: crossing", 8000);
    // The record of the first run survives this restart.
    board.bench.machine.restart(Cause::Pin).expect("restarts");
    board.until("mode: idle", 3000);
    board.send(b's');
    board.until("mode: deployed", 12_000);
    board.send(b'r');
    board.until("mode: retracted", 12_000);
    board.send(b's');
    board.until("deploying: crossing", 8000);
    board.bench.machine.restart(Cause::Power).expect("restarts");
    board.until("mode: idle", 3000);
    board.run(200);
    let run = Run::of_stream(&board.frames);
    assert_eq!(run.counts.restarts, 2, "{:?}", run.marks);
    let placed = |boot| run.since_boot(boot).restart().and_then(|restart| restart.place());
    assert_eq!([0, 1, 2].map(|boot| placed(boot).is_some()), [false, true, false]);
    let result = replay(&run, &Rig::prototype()).expect("a sound rig");
    assert!(result.difference.is_none(), "{result:?}");
    let idle = run.rows.last().and_then(Columns::telemetry).expect("a row");
    assert_eq!(idle.mode, Mode::Idle);
    assert!(result.ticks as usize > run.rows.len() / 2, "{result:?}");
}

/// Two minutes on the board. What it logs stays as close to the truth as in the first round.
#[test]
fn minutes_of_deploying_and_retracting_are_logged_without_a_gap_or_drift() {
    const ROUNDS: usize = 36;
    if !hil_sim::testing::long() {
        return;
    }
    let mut board = Board::off(&["run.seed=1"]);
    // Position and preload of the plant by the millisecond, which is the tick's number.
    let mut truths = vec![(0.0, 0.0)];
    let mut step = |board: &mut Board| {
        board.step();
        let truth = board.bench.plant.truth();
        truths.push((truth.position_mm, truth.preload_n));
        // What the emulator books of the tasks is not the board's.
        board.bench.machine.profile.take_polls();
    };
    for round in 0..=ROUNDS {
        let (letter, arrived) = match round {
            0 => (None, "mode: idle"),
            _ if round % 2 == 1 => (Some(b's'), "mode: deployed"),
            _ => (Some(b'r'), "mode: retracted"),
        };
        letter.into_iter().for_each(|letter| board.send(letter));
        let (from, mut left) = (board.log.len(), 20_000);
        while !board.log[from..].iter().any(|line| line.contains(arrived)) {
            assert!(left > 0, "round {round} does not arrive");
            left -= 1;
            step(&mut board);
        }
        (0..100).for_each(|_| step(&mut board));
    }
    let run = Run::of_stream(&board.frames);
    assert!(run.is_complete() && run.rows.len() > 120_000, "{:?}", run.counts);
    assert!(run.rows.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1));
    assert_eq!(run.counts.garbage_bytes, 0);
    for row in &run.rows {
        let seen = row.telemetry().expect("a row of a controller");
        let (position_mm, preload_n) = truths[row.tick as usize];
        let off = |seen: Q16, truth: f64| (seen.to_num::<f64>() - truth).abs();
        if matches!(seen.mode, Mode::Run(..)) {
            assert!(off(seen.position, position_mm) < POSITION_MM, "{row:?}: {position_mm} mm");
            assert!(off(seen.preload, preload_n) < PRELOAD_N, "{row:?}: {preload_n} N");
        }
    }
    assert_eq!(run.ledger.len(), 3 * ROUNDS);
    assert!(replay(&run, &Rig::prototype()).expect("a sound rig").is_equal());
}
