//! A run on the emulated board: power-up, one command, arrival.

use std::time::Instant;

use super::campaign::{Board, Firmware};
use super::elf::RAM;
use super::error::BoardError;
use super::load::{Gathered, Load};
use super::log::{Line, Strings};
use super::machine::Machine;
use interstage::supervise::Mode;

use hil_sim::firmware::Footprint;
use hil_sim::record::{JoinedLog, LogLine, Recording};
use hil_sim::scenario::{ControllerKind, Scenario};
use hil_sim::session::{RunningRig, drive, is_over, longest_s, once};

/// Time for which the board runs on after arrival, ms.
const AFTER: u32 = 100;
/// The same after a restart under way, s: it reports the cause and is idle again.
const AFTER_RESTART_S: f64 = 1.0;

/// A finished run.
pub struct Ran {
    /// Summary, ledger, rows, log.
    pub recording: Recording,
    pub load: Load,
    /// The board at the end.
    pub machine: Machine,
}

/// Checks that the firmware can run a scenario.
pub fn check(scenario: &Scenario) -> Result<(), BoardError> {
    if scenario.run.controller != ControllerKind::Scheduled {
        return Err(BoardError::Controller(scenario.run.controller.name().to_owned()));
    }
    Ok(())
}

/// Options of a run beside its scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunOptions {
    /// Keep one row a millisecond.
    pub rows: bool,
    /// Count the flash's wait states; takes three times as long.
    pub wait_states: bool,
}

/// Runs a scenario on the board with the image in `elf`. `watch` gets each line of the log with
/// its time, s.
pub fn run(
    elf: &[u8],
    scenario: &Scenario,
    options: &RunOptions,
    mut watch: impl FnMut(f64, &Line),
) -> Result<Ran, BoardError> {
    check(scenario)?;
    let footprint = Footprint::of_elf(elf)?;
    let strings = Strings::of(elf)?;
    let mut board = Board::new(Firmware { elf, strings: &strings }, scenario)?;
    if options.wait_states {
        board.bench.machine.count_waits()?;
    }
    let (mut log, mut lines_of_log, mut stream) = (JoinedLog::new(0), Vec::new(), Vec::new());
    let (started, mut gathered, mut waits) = (Instant::now(), Gathered::default(), true);
    let (mut restarts, mut ends_at, mut after) = (0, f64::INFINITY, AFTER);
    let (mut t_s, mut truth) = (0.0, *board.plant().truth());
    let operator = once(scenario.run.direction);
    drive(&mut board, longest_s(&scenario.rig), operator, |board, _, _| {
        log.add(&truth);
        for line in &board.lines {
            watch(board.time_s(), line);
            let level = if line.level.is_empty() { "" } else { " " };
            let text = format!("{}{level}{}", line.level, line.text);
            lines_of_log.push(LogLine { t_s, text });
        }
        (t_s, truth) = (board.time_s(), *board.plant().truth());
        if board.restarts > std::mem::replace(&mut restarts, board.restarts) {
            log.restarted();
            if !waits {
                // It starts with the drive at rest and waits for a command.
                ends_at = ends_at.min(t_s + AFTER_RESTART_S);
            }
        }
        // The command follows.
        if waits && board.mode() == Mode::Idle {
            waits = false;
            gathered.begin(&mut board.bench.machine);
        } else {
            gathered.gather(&mut board.bench.machine);
        }
        let frames = board.take_log(false);
        log.read(&frames);
        stream.extend(frames);
        after -= u32::from(is_over(board.mode()));
        after == 0 || t_s >= ends_at
    })?;
    let wall_s = started.elapsed().as_secs_f64();
    let arrived = match board.mode() {
        Mode::Complete(direction) => Some(direction),
        _ => None,
    };
    let of = (scenario, board.plant());
    let recording = log.finish("board", of, arrived, options.rows, wall_s);
    let recording = Recording { log: lines_of_log, stream, ..recording };
    let machine = board.bench.machine;
    let stack = stack_used(&machine)?;
    let load = gathered.close(&machine, &footprint, stack);
    Ok(Ran { recording, load, machine })
}

/// Bytes of the stack that were used, deepest since power came up.
pub fn stack_used(machine: &Machine) -> Result<u32, BoardError> {
    let end = machine.image.symbol("_stack_end")?;
    let start = machine.image.symbol("_stack_start")?;
    let mut stack = vec![0; start.saturating_sub(end.max(RAM.base)) as usize];
    machine.peek(end, &mut stack)?;
    let untouched = stack.iter().take_while(|byte| **byte == super::machine::BLANK).count();
    Ok(stack.len() as u32 - untouched as u32)
}
