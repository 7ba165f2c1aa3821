//! A run in the loop: reset, one command, arrival.

use std::time::Instant;

use interstage::hal::hil::{FIRST, Given};
use interstage::log::identity;
use interstage::model::Planner;
use interstage::supervise::Mode;
use interstage::units::Tick;

use super::{HilError, HostLine};
use crate::probe::{LOG, Port, TEXT};
use crate::record::{JoinedLog, Recording};
use crate::scenario::{ControllerKind, Scenario, TICK_S};
use crate::session::{drives, initial_rig, is_over, longest_s, once, read};

/// Ticks between two polls of the log; the channel holds a hundred.
const POLL: Tick = 16;
/// Ticks after the end within which the log arrives: two frames and a poll.
const AFTER: Tick = 64;

/// Options of a run beside its scenario.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked {
    /// Keep one row a tick, and the log's bytes.
    pub rows: bool,
    /// Name of the target in the summary.
    pub target: &'static str,
}

/// Runs a scenario with the controller on the board behind `port`; passes the time, s, to
/// `watch` now and then.
pub fn run(
    port: &mut dyn Port,
    scenario: &Scenario,
    asked: Asked,
    mut watch: impl FnMut(f64),
) -> Result<Recording, HilError> {
    let kind = scenario.run.controller;
    if kind != ControllerKind::Scheduled {
        return Err(HilError::Controller(kind.name()));
    }
    let (mut plant, mut sensors) = initial_rig(scenario)?;
    Planner::try_build(&scenario.rig)?;
    let (mut log, mut stream) = (JoinedLog::new(FIRST), asked.rows.then(Vec::new));
    let mut line = HostLine::begin(port)?;
    let (started, mut operator) = (Instant::now(), once(scenario.run.direction));
    let (mut tick, mut mode) = (FIRST, Mode::Boot);
    let mut given = Given::default();
    while !is_over(mode) && f64::from(tick - FIRST) * TICK_S < longest_s(&scenario.rig) {
        let codes = read(&mut sensors, &plant);
        given = Given::codes(codes.sensors, codes.bridges).with(operator(mode));
        let taken = line.tick(tick, given)?;
        mode = taken.mode().unwrap_or(mode);
        log.add(plant.truth());
        let (drive, preload) = taken.commands();
        plant.step(&drives(drive, preload), TICK_S)?;
        tick += 1;
        if tick.is_multiple_of(POLL) {
            read_log(line.port(), &mut log, stream.as_mut(), scenario)?;
            watch(f64::from(tick - FIRST) * TICK_S);
        }
    }
    let wall_s = started.elapsed().as_secs_f64();
    // The plant does not move while the rest of the log arrives.
    for tick in tick..tick + AFTER {
        line.tick(tick, given.with(None))?;
        if tick.is_multiple_of(POLL) {
            read_log(line.port(), &mut log, stream.as_mut(), scenario)?;
        }
    }
    read_log(line.port(), &mut log, stream.as_mut(), scenario)?;
    if let Some(tick) = log.lacks() {
        return Err(HilError::Incomplete(tick));
    }
    let arrived = match mode {
        Mode::Complete(direction) => Some(direction),
        _ => None,
    };
    let recording = log.finish(asked.target, (scenario, &plant), arrived, asked.rows, wall_s);
    Ok(Recording { stream: stream.unwrap_or_default(), ..recording })
}

/// Reads the board's logs: the binary one, whose bytes are kept if there is a place for them, and
/// the one of text, so that it does not fill. Refuses a board with other parameters than the
/// scenario's.
fn read_log(
    port: &mut dyn Port,
    log: &mut JoinedLog,
    kept: Option<&mut Vec<u8>>,
    scenario: &Scenario,
) -> Result<(), HilError> {
    port.up(TEXT)?;
    let bytes = port.up(LOG)?;
    log.read(&bytes);
    kept.into_iter().for_each(|kept| kept.extend(&bytes));
    let parameters = identity::fingerprint(&scenario.rig);
    match log.identity().filter(|identity| identity.parameters != parameters) {
        None => Ok(()),
        Some(identity) => Err(HilError::Parameters {
            board: identity.rig.as_str().to_owned(),
            board_hash: format!("{:08x}", identity.parameters),
            scenario: scenario.preset.clone(),
            scenario_hash: format!("{parameters:08x}"),
        }),
    }
}
