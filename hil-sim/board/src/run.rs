//! A whole run on the emulated board: power up, one command, arrival.

mod trace;

use std::time::Instant;

use super::bench::{Bench, BenchError};
use super::elf::RAM;
use super::faults::Timed;
use super::load::{Gathered, Load};
use super::log::{Line, Strings};
use super::machine::Machine;
use interstage::params::{CompileError, slots};
use interstage::rig::Rig;

use crate::chip::map::PARAMETER_SETS;
use hil_sim::faults::sets;
use hil_sim::firmware::{FirmwareError, Footprint};
use hil_sim::params::set_of;
use hil_sim::record;
use hil_sim::record::Recording;
use hil_sim::scenario::injection::{Injection, Target};
use hil_sim::scenario::{ControllerKind, Direction, Scenario};

use trace::Trace;

/// Longest run, s: as in software.
const LONGEST_S: f64 = 120.0;
/// How long the board is watched after it has arrived, ms.
const AFTER: u32 = 100;

/// A run that cannot be made on the board.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The bench.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// The image's sections.
    #[error(transparent)]
    Image(#[from] FirmwareError),
    /// The firmware has one controller.
    #[error("the firmware schedules: --controller {0} runs in software alone")]
    Controller(String),
    /// The scenario's parameters.
    #[error("{0}")]
    Scenario(String),
    /// The rig cannot be put into the board's flash.
    #[error(transparent)]
    Parameters(#[from] CompileError),
}

/// A run that was made.
pub struct Ran {
    /// Summary, ledger, rows, log.
    pub recording: Recording,
    /// What it cost.
    pub load: Load,
    /// The board as it was left.
    pub machine: Machine,
}

/// What the firmware can be asked to do.
///
/// # Errors
/// [`RunError::Controller`] if the scenario wants another controller than the firmware's.
pub fn check(scenario: &Scenario) -> Result<(), RunError> {
    if scenario.run.controller != ControllerKind::Scheduled {
        return Err(RunError::Controller(scenario.run.controller.name().to_owned()));
    }
    Ok(())
}

/// Puts the parameters of a rig that is not the image's own into the board's flash, as
/// `rig params` would have. For a fault of stored parameters it is put there as well, with
/// another one in the spare place.
pub(crate) fn store(machine: &mut Machine, scenario: &Scenario) -> Result<(), RunError> {
    let of_sets = |fault: &Injection| fault.target.is_of_sets();
    let mut faults = scenario.run.faults.iter().filter(|fault| of_sets(fault));
    if faults.any(|fault| fault.target != Target::ImageSet) {
        machine.poke(PARAMETER_SETS, &sets::places(scenario)?).map_err(BenchError::from)?;
        return Ok(());
    }
    if scenario.rig == Rig::prototype() {
        return Ok(());
    }
    let set = set_of(&scenario.preset, &scenario.rig)?;
    let place = slots::slot_image(&set, 1).ok_or(CompileError::Room)?;
    machine.poke(PARAMETER_SETS, &place).map_err(BenchError::from)?;
    Ok(())
}

/// What is asked of a run beside its scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// Keep one row a millisecond.
    pub rows: bool,
    /// Faults of the hardware that come while it goes on.
    pub faults: Vec<Timed>,
}

/// Runs a scenario on the board with the image in `elf`; rows are kept if asked. Each
/// line of the log is shown to `watch` as it comes.
///
/// # Errors
/// [`RunError`] if the run cannot be made. One that ends in a fault is a result.
pub fn run(
    elf: &[u8],
    scenario: &Scenario,
    rows: bool,
    watch: impl FnMut(f64, &Line),
) -> Result<Ran, RunError> {
    run_with(elf, scenario, &Asked { rows, ..Asked::default() }, watch)
}

/// The same with all that may be asked.
///
/// # Errors
/// As [`run`].
pub fn run_with(
    elf: &[u8],
    scenario: &Scenario,
    asked: &Asked,
    mut watch: impl FnMut(f64, &Line),
) -> Result<Ran, RunError> {
    check(scenario)?;
    let footprint = Footprint::of_elf(elf)?;
    let strings = Strings::of(elf).map_err(BenchError::from)?;
    let mut bench = Bench::new(elf, &strings, scenario).map_err(BenchError::from)?;
    store(bench.machine_mut(), scenario)?;
    let mut trace = Trace::new(scenario, bench.plant());
    let mut start = Some(match scenario.run.direction {
        Direction::Deploy => b's',
        Direction::Retract => b'r',
    });
    let started = Instant::now();
    let mut after = AFTER;
    let mut gathered = Gathered::default();
    let mut stream = Vec::new();
    let mut faults = asked.faults.clone();
    while bench.time_s() < LONGEST_S && after > 0 {
        let now = bench.time_s();
        for due in faults.extract_if(.., |due| due.at_s <= now) {
            due.fault.strike(bench.machine_mut()).map_err(BenchError::from)?;
        }
        if trace.is_idle()
            && let Some(letter) = start
            && bench.send(letter)?
        {
            start = None;
            gathered.begin(bench.machine_mut());
        }
        let (passed, lines) = bench.step()?;
        for line in &lines {
            watch(bench.time_s(), line);
        }
        gathered.gather(bench.machine_mut());
        stream.extend(bench.take_frames());
        trace.look(&passed, &lines, bench.plant().truth(), asked.rows);
        if trace.is_over() {
            after -= 1;
        }
    }
    let mut recording = trace.finish(scenario, bench.plant(), started.elapsed().as_secs_f64());
    record::complete(&mut recording, &record::Run::of_stream(&stream));
    recording.stream = stream;
    let machine = bench.into_machine();
    let stack = stack_used(&machine)?;
    let load = gathered.close(&machine, &footprint, stack);
    Ok(Ran { recording, load, machine })
}

/// Bytes of the stack that were used, deepest since power came up.
///
/// # Errors
/// [`BenchError`] if the image does not say where its stack is.
pub fn stack_used(machine: &Machine) -> Result<u32, BenchError> {
    let end = machine.image().symbol("_stack_end")?;
    let start = machine.image().symbol("_stack_start")?;
    let mut stack = vec![0; start.saturating_sub(end.max(RAM.base)) as usize];
    machine.peek(end, &mut stack)?;
    let untouched = stack.iter().take_while(|byte| **byte == super::machine::BLANK).count();
    Ok(stack.len() as u32 - untouched as u32)
}
