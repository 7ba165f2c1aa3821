//! A run in the loop: reset, one command, arrival.

use std::collections::VecDeque;
use std::time::Instant;

use interstage::hal::hil::{FIRST, Given};
use interstage::log::{Identity, Record, identity};
use interstage::model::Planner;
use interstage::sense::raw::SensorFrame;
use interstage::supervise::Mode;
use interstage::tick::{Entry, Event};
use interstage::units::Tick;

use super::{HilError, HostLine};
use crate::plant::rig::{Truth, VirtualRig};
use crate::plant::sensors::Codes;
use crate::probe::Port;
use crate::record::{Controller, Decoder, Item, Recording, RunRecorder, starter};
use crate::scenario::{ControllerKind, Scenario};
use crate::session::{LONGEST_S, TICK_S, drives, initial_rig, read};

/// RTT channel of the binary log.
const LOG: u32 = 1;
/// RTT channel of the text log, read only so that it does not fill.
const TEXT: u32 = 0;
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
    let mut log = BoardLog::new(scenario, &plant, asked.rows)?;
    let mut line = HostLine::begin(port)?;
    let mut start = Some(starter(scenario.run.direction));
    let started = Instant::now();
    let (mut tick, mut mode) = (FIRST, Mode::Boot);
    let over = |mode: Mode| matches!(mode, Mode::Complete(_) | Mode::FaultHold(_));
    let mut given = Given::default();
    while !over(mode) && f64::from(tick - FIRST) * TICK_S < LONGEST_S {
        let codes = read(&mut sensors, &plant);
        let command = if mode == Mode::Idle { start.take() } else { None };
        given = given_by(codes).with(command);
        let taken = line.tick(tick, given)?;
        mode = taken.mode().unwrap_or(mode);
        log.truths.push_back(*plant.truth());
        let (drive, preload) = taken.commands();
        plant.step(&drives(drive, preload), TICK_S)?;
        tick += 1;
        if tick.is_multiple_of(POLL) {
            log.take(line.port())?;
            watch(f64::from(tick - FIRST) * TICK_S);
        }
    }
    let wall_s = started.elapsed().as_secs_f64();
    // The plant does not move while the rest of the log arrives.
    for tick in tick..tick + AFTER {
        line.tick(tick, given.with(None))?;
        if tick.is_multiple_of(POLL) {
            log.take(line.port())?;
        }
    }
    log.take(line.port())?;
    log.finish(scenario, &plant, asked.target, mode, wall_s)
}

const fn given_by(codes: Codes) -> Given {
    Given::codes(
        codes.wheel_encoder,
        codes.preload_sensor,
        codes.compression_sensor,
        codes.arm_angle,
        codes.bridges,
    )
}

/// The board's log, joined with the plant's truth of the same tick.
struct BoardLog {
    recorder: RunRecorder,
    decoder: Decoder,
    stream: Vec<u8>,
    rows: bool,
    /// States of the plant whose ticks are not in the log yet.
    truths: VecDeque<Truth>,
    /// Entries of ticks that are not in the log yet.
    events: VecDeque<Entry>,
    /// The next tick.
    due: Tick,
    name: String,
    parameters: u32,
}

impl BoardLog {
    fn new(scenario: &Scenario, plant: &VirtualRig, rows: bool) -> Result<Self, HilError> {
        let planner = Planner::try_build(&scenario.rig)?;
        let gap_ref = planner.gap_ref(scenario.run.direction.into()).to_num();
        Ok(Self {
            recorder: RunRecorder::new(gap_ref, plant.truth().position_mm),
            decoder: Decoder::new(),
            stream: Vec::new(),
            rows,
            truths: VecDeque::new(),
            events: VecDeque::new(),
            due: FIRST,
            name: scenario.preset.clone(),
            parameters: identity::fingerprint(&scenario.rig),
        })
    }

    /// Reads the log.
    fn take(&mut self, port: &mut dyn Port) -> Result<(), HilError> {
        port.up(TEXT)?;
        let bytes = port.up(LOG)?;
        let mut items = Vec::new();
        self.decoder.read(&bytes, &mut |item| items.push(item));
        for item in items {
            match item {
                Item::Identity(identity) => self.check_parameters(&identity)?,
                // This host has reset the board.
                Item::Event(Entry { event: Event::Restart(_), .. }) => {}
                Item::Event(entry) => self.events.push_back(entry),
                Item::Tick(record, sensors) => self.tick(&record, sensors)?,
                _ => {}
            }
        }
        if self.rows {
            self.stream.extend(bytes);
        }
        Ok(())
    }

    /// Refuses a board with other parameters than the scenario's.
    fn check_parameters(&self, identity: &Identity) -> Result<(), HilError> {
        if identity.parameters == self.parameters {
            return Ok(());
        }
        Err(HilError::Parameters {
            board: identity.rig.as_str().to_owned(),
            board_hash: format!("{:08x}", identity.parameters),
            scenario: self.name.clone(),
            scenario_hash: format!("{:08x}", self.parameters),
        })
    }

    /// A tick of the log; those after the end have no truth and are skipped.
    fn tick(&mut self, record: &Record, mut sensors: SensorFrame) -> Result<(), HilError> {
        let at = record.at();
        if at != self.due {
            return Err(HilError::Incomplete(self.due));
        }
        self.due += 1;
        // This host counts from zero.
        let from_zero = |at: Tick| at.wrapping_sub(FIRST);
        let mut record = *record;
        record.telemetry.at = from_zero(at);
        sensors.wheel_encoder.iter_mut().for_each(|sample| sample.at = from_zero(sample.at));
        sensors.preload_sensor.iter_mut().for_each(|sample| sample.at = from_zero(sample.at));
        sensors.compression_sensor.iter_mut().for_each(|sample| sample.at = from_zero(sample.at));
        sensors.arm_angle.iter_mut().for_each(|sample| sample.at = from_zero(sample.at));
        let mut events = Vec::new();
        while let Some(entry) = self.events.pop_front_if(|entry| entry.at <= at) {
            events.push(Entry { at: from_zero(entry.at), ..entry });
        }
        if let Some(truth) = self.truths.pop_front() {
            let columns = self.rows.then(|| Controller::of(&record, &sensors));
            self.recorder.take(&record.telemetry, &events, &truth, columns);
        }
        Ok(())
    }

    /// The recording of a run that ended in this mode.
    fn finish(
        self,
        scenario: &Scenario,
        plant: &VirtualRig,
        target: &'static str,
        mode: Mode,
        wall_s: f64,
    ) -> Result<Recording, HilError> {
        if !self.truths.is_empty() {
            return Err(HilError::Incomplete(self.due));
        }
        let arrived = match mode {
            Mode::Complete(direction) => Some(direction),
            _ => None,
        };
        let mut recording = self.recorder.finish(target, scenario, plant, arrived, wall_s);
        recording.stream = self.stream;
        Ok(recording)
    }
}
