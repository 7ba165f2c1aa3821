//! The record of a run on the board: the binary log beside the plant's truth.

use std::collections::VecDeque;

use interstage::model::Planner;
use interstage::tick::{Entry, Telemetry};

use crate::log::Line;
use hil_sim::plant::rig::{Truth, VirtualRig};
use hil_sim::record::{Controller, Decoder, Item, LogLine, Recording, RunRecorder};
use hil_sim::scenario::Scenario;

const COMPLETE: u8 = 10;
const FAULT_HOLD: u8 = 11;

/// A run's record as it grows. The log comes some milliseconds after its tick, so the record is
/// made at the end.
pub(super) struct Trace {
    decoder: Decoder,
    /// Ticks and events by the millisecond from power-up.
    ticks: VecDeque<(u32, Telemetry, Controller)>,
    events: VecDeque<(u32, Entry)>,
    /// The plant before each millisecond.
    truths: Vec<Truth>,
    log: Vec<LogLine>,
    /// Milliseconds of the board's latest start and of the one that the log has come to, and the
    /// last tick.
    latest: u32,
    start: u32,
    last: u32,
}

impl Trace {
    pub(super) fn new(plant: &VirtualRig) -> Self {
        Self {
            decoder: Decoder::new(),
            ticks: VecDeque::new(),
            events: VecDeque::new(),
            truths: vec![*plant.truth()],
            log: Vec::new(),
            latest: 0,
            start: 0,
            last: 0,
        }
    }

    /// Whether it has arrived, or holds because of a fault.
    pub(super) fn is_over(&self) -> bool {
        self.ticks.back().is_some_and(|(.., tick)| matches!(tick.mode, COMPLETE | FAULT_HOLD))
    }

    /// Adds a millisecond that ended with the plant in `truth`, and in which the board may have
    /// restarted.
    pub(super) fn add(&mut self, frames: &[u8], lines: &[Line], truth: &Truth, restarted: bool) {
        let now = self.truths.len() as u32;
        if restarted {
            self.latest = now;
        }
        let Self { decoder, ticks, events, latest, start, last, .. } = self;
        decoder.read(frames, &mut |item| match item {
            Item::Tick(record, codes) => {
                let at = record.telemetry.at;
                if at < *last {
                    *start = *latest;
                }
                *last = at;
                let mut columns = Controller::of(&record, &codes);
                columns.t_s += f64::from(*start) * 1e-3;
                ticks.push_back((*start + at, record.telemetry, columns));
            }
            Item::Event(entry) => events.push_back((*start + entry.at, entry)),
            _ => {}
        });
        let t_s = f64::from(now - 1) * 1e-3;
        self.log.extend(lines.iter().map(|line| {
            let level = if line.level.is_empty() { "" } else { " " };
            LogLine { t_s, text: format!("{}{level}{}", line.level, line.text) }
        }));
        self.truths.push(*truth);
    }

    /// The record of a run that took `wall_s` to compute, with its rows if they are kept.
    pub(super) fn finish(
        mut self,
        scenario: &Scenario,
        plant: &VirtualRig,
        keep_rows: bool,
        wall_s: f64,
    ) -> Recording {
        let direction = scenario.run.direction.into();
        let planner = Planner::try_build(&scenario.rig).ok();
        let gap_ref = planner.map_or(f64::NAN, |planner| planner.gap_ref(direction).to_num());
        let arrived = self.ticks.back().is_some_and(|(.., tick)| tick.mode == COMPLETE);
        let mut recorder = RunRecorder::new(gap_ref, self.truths[0].position_mm);
        let mut seen = Telemetry::default();
        // The last one is of after the run.
        self.truths.pop();
        for (now, truth) in (0..).zip(&self.truths) {
            let mut columns = Controller::unknown(now);
            while let Some((_, telemetry, tick)) = self.ticks.pop_front_if(|tick| tick.0 <= now) {
                (seen, columns) = (telemetry, tick);
            }
            let due = self.events.partition_point(|event| event.0 <= now);
            let events: Vec<Entry> = self.events.drain(..due).map(|event| event.1).collect();
            recorder.take(&seen, &events, truth, keep_rows.then_some(columns));
        }
        let arrived = arrived.then_some(direction);
        let recording = recorder.finish("board", scenario, plant, arrived, wall_s);
        Recording { log: self.log, ..recording }
    }
}
