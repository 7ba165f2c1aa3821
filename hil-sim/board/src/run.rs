//! A run on the emulated board: power-up, one command, arrival.

use std::time::Instant;

use super::bench::Bench;
use super::elf::RAM;
use super::error::BoardError;
use super::load::{Gathered, Load};
use super::log::{Line, Strings};
use super::machine::Machine;
use interstage::params::{CompileError, slots};
use interstage::rig::Rig;

use crate::chip::map::PARAMETER_SETS;
use hil_sim::faults::sets;
use hil_sim::firmware::Footprint;
use hil_sim::params::set_of;
use hil_sim::record::{JoinedLog, LogLine, Recording, letter, starter};
use hil_sim::scenario::injection::{Injection, Target};
use hil_sim::scenario::{ControllerKind, Scenario};
use hil_sim::session::longest_s;

/// Numbers of the modes in which a run is over.
const COMPLETE: u8 = 10;
const FAULT_HOLD: u8 = 11;
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

/// Stores the parameters of a rig that is not the image's own in the board's flash, as `rig
/// params` does. For a fault of stored parameters any rig is stored, with another one in the
/// spare slot.
pub(crate) fn store(machine: &mut Machine, scenario: &Scenario) -> Result<(), BoardError> {
    let of_sets = |fault: &Injection| fault.target.is_of_sets();
    let mut faults = scenario.run.faults.iter().filter(|fault| of_sets(fault));
    if faults.any(|fault| fault.target != Target::ImageSet) {
        machine.poke(PARAMETER_SETS, &sets::places(scenario)?)?;
        return Ok(());
    }
    if scenario.rig == Rig::prototype() {
        return Ok(());
    }
    let set = set_of(&scenario.preset, &scenario.rig)?;
    let place = slots::slot_image(&set, 1).ok_or(CompileError::Room)?;
    machine.poke(PARAMETER_SETS, &place)?;
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
    let mut bench = Bench::new(elf, &strings, scenario)?;
    store(&mut bench.machine, scenario)?;
    if options.wait_states {
        bench.machine.count_waits()?;
    }
    let (mut log, mut lines_of_log) = (JoinedLog::new(0), Vec::new());
    let (mut start, mut idle) = (Some(letter(starter(scenario.run.direction))), false);
    let started = Instant::now();
    let mut after = AFTER;
    let mut gathered = Gathered::default();
    let mut stream = Vec::new();
    let mut ends_at = longest_s(&scenario.rig);
    while bench.time_s() < ends_at && after > 0 {
        let waited = start.is_some();
        let restarts = bench.machine.restarts().len();
        log.add(bench.plant.truth());
        let t_s = bench.time_s();
        let (_, lines) = bench.step()?;
        for line in &lines {
            watch(bench.time_s(), line);
            idle |= line.text.contains("mode: idle");
            let level = if line.level.is_empty() { "" } else { " " };
            let text = format!("{}{level}{}", line.level, line.text);
            lines_of_log.push(LogLine { t_s, text });
        }
        match start {
            Some(letter) if idle && bench.send(letter)? => {
                start = None;
                gathered.begin(&mut bench.machine);
            }
            _ => gathered.gather(&mut bench.machine),
        }
        let frames = bench.take_frames();
        if bench.machine.restarts().len() > restarts {
            log.restarted();
            if !waited {
                // It starts with the drive at rest and waits for a command.
                ends_at = ends_at.min(bench.time_s() + AFTER_RESTART_S);
            }
        }
        log.read(&frames);
        stream.extend(frames);
        if matches!(log.mode(), Some(COMPLETE | FAULT_HOLD)) {
            after -= 1;
        }
    }
    let wall_s = started.elapsed().as_secs_f64();
    let arrived = (log.mode() == Some(COMPLETE)).then_some(scenario.run.direction.into());
    let of = (scenario, &bench.plant);
    let recording = log.finish("board", of, arrived, options.rows, wall_s);
    let recording = Recording { log: lines_of_log, stream, ..recording };
    let machine = bench.machine;
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
