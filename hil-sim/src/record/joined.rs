//! The log of a board, joined with the plant's truth of the same ticks.

use std::collections::VecDeque;

use interstage::log::Identity;
use interstage::model::Planner;
use interstage::tick::{Entry, Telemetry};
use interstage::units::{Direction, Tick};

use super::{Columns, Decoder, Item, Recording, RunRecorder};
use crate::plant::rig::{Truth, VirtualRig};
use crate::scenario::Scenario;

/// A run's record as it grows. The log comes some milliseconds after its tick, so the record is
/// made at the end.
#[derive(Default)]
pub struct JoinedLog {
    /// Number of the board's first tick, which counts as 0.
    first: Tick,
    decoder: Decoder,
    /// Ticks and events by the millisecond from the first.
    ticks: VecDeque<(Tick, Telemetry, Columns)>,
    events: VecDeque<(Tick, Entry)>,
    /// The plant before each millisecond.
    truths: Vec<Truth>,
    identity: Option<Identity>,
    /// Milliseconds of the board's latest start and of the one that the log has come to, and the
    /// last tick.
    latest: Tick,
    start: Tick,
    last: Tick,
}

impl JoinedLog {
    /// A log whose first tick has this number.
    pub fn new(first: Tick) -> Self {
        Self { first, ..Self::default() }
    }

    /// Adds the plant before the next millisecond.
    pub fn add(&mut self, truth: &Truth) {
        self.truths.push(*truth);
    }

    /// The board has restarted in the millisecond whose plant was added last.
    pub const fn restarted(&mut self) {
        self.latest = self.truths.len() as Tick;
    }

    /// Takes bytes of the log. What is of before the first tick is left out.
    pub fn read(&mut self, frames: &[u8]) {
        let Self { first, decoder, ticks, events, identity, latest, start, last, .. } = self;
        decoder.read(frames, &mut |item| match item {
            Item::Tick(mut record, mut codes) if record.at() >= *first => {
                let from_first = |at: &mut Tick| *at = at.wrapping_sub(*first);
                from_first(&mut record.telemetry.at);
                codes.samples.iter_mut().flatten().for_each(|sample| from_first(&mut sample.at));
                let at = record.at();
                if at < *last {
                    *start = *latest;
                }
                *last = at;
                let mut columns = Columns::of(&record, &codes);
                columns.t_s += f64::from(*start) * 1e-3;
                ticks.push_back((*start + at, record.telemetry, columns));
            }
            Item::Event(Entry { at, event }) if at >= *first => {
                let at = at - *first;
                events.push_back((*start + at, Entry { at, event }));
            }
            Item::Identity(found) => *identity = Some(found),
            _ => {}
        });
    }

    /// Who has made the log, as soon as it says so.
    pub(crate) const fn identity(&self) -> Option<&Identity> {
        self.identity.as_ref()
    }

    /// Number of the first tick that is not in the log although the plant is there.
    pub(crate) fn lacks(&self) -> Option<Tick> {
        let there = (0..).zip(&self.ticks).take_while(|(at, tick)| *at == tick.0).count();
        (there < self.truths.len()).then(|| self.first + there as Tick)
    }

    /// The record of a run that took `wall_s` to compute and arrived in this direction or did
    /// not, with its rows if they are kept.
    pub fn finish(
        mut self,
        target: &'static str,
        (scenario, plant): (&Scenario, &VirtualRig),
        arrived: Option<Direction>,
        keep_rows: bool,
        wall_s: f64,
    ) -> Recording {
        let direction = scenario.run.direction.into();
        let planner = Planner::try_build(&scenario.rig).ok();
        let gap_ref = planner.map_or(f64::NAN, |planner| planner.gap_ref(direction).to_num());
        let start_mm = self.truths.first().map_or(0.0, |truth| truth.position_mm);
        let mut recorder = RunRecorder::new(gap_ref, start_mm);
        let mut seen = Telemetry::default();
        for (now, truth) in (0..).zip(&self.truths) {
            let mut columns = Columns::unknown(now);
            while let Some((_, telemetry, tick)) = self.ticks.pop_front_if(|tick| tick.0 <= now) {
                (seen, columns) = (telemetry, tick);
            }
            let due = self.events.partition_point(|event| event.0 <= now);
            let events: Vec<Entry> = self.events.drain(..due).map(|event| event.1).collect();
            recorder.take(&seen, &events, truth, keep_rows.then_some(columns));
        }
        recorder.finish(target, scenario, plant, arrived, wall_s)
    }
}
