//! Load of the core in a run: control tick, stack, memory.
//!
//! Cycles are textbook ones, see [`super::timing`]. Counting begins with the command: the
//! start of the program, which builds the controller's tables, is left out.

use serde::Serialize;

use super::chip::Stray;
use super::machine::{Machine, Poll};
use super::peripherals::HZ;
use hil_sim::firmware::{Footprint, WithWaits};

/// Cycles from one control tick to the next.
const PERIOD: u64 = HZ / 1000;
/// Name of the task that runs the control tick.
const TICK: &str = "motors";
/// Largest mean load: the flash's waits make 1.3 times of it where they are counted, less than half
/// of the core, so that a plan takes at most twice as long as its own cycles.
const LOAD: f64 = 0.33;
/// Largest control tick, with waits where they are counted, as a part of its period. The tick
/// begins with its millisecond; another one as long, of lower priority or of the sensors, still
/// ends before the host and the model have their turn in its middle.
const TICK_PART: f64 = 0.20;
/// How many times the stack that was used has to fit the one that is set apart: a run need not
/// reach the deepest path, nor an interrupt on each level at its deepest place.
const STACKS: f64 = 2.0;
/// The first bank of flash, bytes: the image may not reach into the second, which is written while
/// the program runs. Held by the linker; see `memory.x`.
const BANK: u64 = 256 * 1024;

/// Heading of the page's section.
pub(crate) const TITLE: &str = "What it cost on the core";

/// Cycles of the control tick's task, a poll each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cost {
    /// Number of polls.
    pub runs: u64,
    /// Mean cycles.
    pub mean: f64,
    /// Most cycles.
    pub worst: u64,
    /// Range of its beginnings against an even period, cycles.
    pub jitter: u64,
    /// The same with the flash's wait states, see [`super::accelerator`], if they were counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with_waits: Option<WithWaits>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Load {
    pub clock_hz: u64,
    /// Cycles counted.
    pub cycles: u64,
    /// Part of the time in which the core did not sleep.
    pub load: f64,
    /// The same with the flash's wait states, if they were counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_with_waits: Option<f64>,
    /// The control tick with its task.
    pub tick: Cost,
    pub stack_used: u32,
    /// Bytes set apart for the stack.
    pub stack: u64,
    /// Bytes of flash.
    pub flash: u64,
    /// Bytes of RAM, the stack included.
    pub ram: u64,
    /// Accesses that no model has, to reserved bits, or against a rule of the chip.
    pub unmodelled: Vec<Stray>,
}

/// Measurements during a run.
#[derive(Debug, Default)]
pub(crate) struct Gathered {
    from: Option<(u64, u64, u64)>,
    ticks: Vec<Poll>,
}

impl Gathered {
    pub(crate) fn begin(&mut self, machine: &mut Machine) {
        machine.profile.take_polls();
        *self = Self {
            from: Some((machine.now(), machine.profile.slept(), machine.waits())),
            ..Self::default()
        };
    }

    /// Takes the polls of the tick's task since the last call.
    pub(crate) fn gather(&mut self, machine: &mut Machine) {
        let tick = machine.tasks.names().position(|name| name == TICK);
        let polls = machine.profile.take_polls();
        if self.from.is_some() {
            self.ticks.extend(polls.into_iter().filter(|poll| Some(poll.task) == tick));
        }
    }

    /// The load from the first command to now.
    pub(crate) fn close(self, machine: &Machine, footprint: &Footprint, stack_used: u32) -> Load {
        let (from, slept, waits) = self.from.unwrap_or_default();
        let cycles = machine.now() - from;
        let idle = (machine.profile.slept() - slept) as f64 / cycles.max(1) as f64;
        let waits = (machine.waits() - waits) as f64 / cycles.max(1) as f64;
        Load {
            clock_hz: HZ,
            cycles,
            load: 1.0 - idle,
            load_with_waits: (waits > 0.0).then_some(1.0 - idle + waits),
            tick: cost(&self.ticks),
            stack_used,
            stack: footprint.stack,
            flash: footprint.flash,
            ram: footprint.ram,
            unmodelled: machine.chip().strays.iter().copied().collect(),
        }
    }
}

fn cost(ticks: &[Poll]) -> Cost {
    let first = ticks.first().map_or(0, |tick| tick.began);
    let offset = |tick: &Poll| {
        let since = tick.began - first;
        since as i64 - ((since + PERIOD / 2) / PERIOD * PERIOD) as i64
    };
    let earliest = ticks.iter().map(offset).min().unwrap_or(0);
    let latest = ticks.iter().map(offset).max().unwrap_or(0);
    Cost {
        runs: ticks.len() as u64,
        mean: ticks.iter().map(|tick| tick.cycles).sum::<u64>() as f64 / ticks.len().max(1) as f64,
        worst: ticks.iter().map(|tick| tick.cycles).max().unwrap_or(0),
        jitter: (latest - earliest) as u64,
        with_waits: ticks.iter().any(|tick| tick.waits > 0).then(|| {
            let each = ticks.iter().map(|tick| tick.cycles + tick.waits);
            let sum: u64 = each.clone().sum();
            WithWaits { mean: sum as f64 / ticks.len() as f64, worst: each.max().unwrap_or(0) }
        }),
    }
}

impl Load {
    /// Names and values of the report.
    fn pairs(&self) -> Vec<(&'static str, String)> {
        let us = |cycles: f64| cycles * 1e6 / self.clock_hz as f64;
        let (mean, worst) = (self.tick.mean, self.tick.worst);
        let mut pairs = vec![
            ("Core busy", format!("{:.2} % of the time", 100.0 * self.load)),
            ("Tick, mean", format!("{mean:.0} cycles, {:.1} µs", us(mean))),
            ("Tick, worst", format!("{worst} cycles, {:.1} µs", us(worst as f64))),
            ("Jitter of the tick", format!("{:.1} µs", us(self.tick.jitter as f64))),
            ("Stack used", format!("{} of {} bytes", self.stack_used, self.stack)),
            ("Flash", format!("{} bytes", self.flash)),
            ("RAM, stack included", format!("{} bytes", self.ram)),
        ];
        if let (Some(load), Some(tick)) = (self.load_with_waits, self.tick.with_waits) {
            let (mean, worst) = (tick.mean, tick.worst);
            let tick = format!("{mean:.0} cycles on average, {worst} at most");
            pairs.push(("With wait states, core busy", format!("{:.2} %", 100.0 * load)));
            pairs.push(("With wait states, tick", tick));
        }
        pairs
    }

    /// As a section of the run's page; `missed` are the budgets that were not kept.
    pub(crate) fn html(&self, missed: &[String]) -> String {
        let pair = |(name, value)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>\n");
        let cells: String = self.pairs().into_iter().map(pair).collect();
        let missed: String =
            missed.iter().map(|line| format!("<p>Over budget: {line}</p>\n")).collect();
        format!(
            "<dl>\n{cells}</dl>\n{missed}<p class=\"note\">Textbook cycles of a Cortex-M4 from \
the first command on, without wait states of the flash. The tick is not charged for what \
preempts it.</p>\n"
        )
    }

    pub(crate) fn text(&self, missed: &[String]) -> String {
        let pair = |(name, value)| format!("  {name}: {value}\n");
        let pairs: String = self.pairs().into_iter().map(pair).collect();
        let missed: String = missed.iter().map(|line| format!("  over budget: {line}\n")).collect();
        pairs + &missed
    }

    /// The budgets that are missed, a sentence each.
    pub fn missed(&self) -> Vec<String> {
        let worst = self.tick.with_waits.map_or(self.tick.worst, |tick| tick.worst);
        let reached = [
            ("mean load", self.load, LOAD),
            ("worst tick, part of its period", worst as f64 / PERIOD as f64, TICK_PART),
            (
                "stack used, part of it",
                f64::from(self.stack_used) / self.stack as f64,
                1.0 / STACKS,
            ),
            ("flash, part of its first bank", self.flash as f64 / BANK as f64, 1.0),
        ];
        let missed = reached.into_iter().filter(|(_, value, most)| value > most);
        missed.map(|(what, value, most)| format!("{what}: {value:.3}, at most {most}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_is_the_range_of_the_beginnings() {
        let tick = |began, cycles| Poll { task: 0, began, cycles, waits: 3 };
        let starts = [1000, 1000 + PERIOD + 40, 1000 + 2 * PERIOD - 10, 1000 + 5 * PERIOD];
        let ticks: Vec<Poll> =
            starts.iter().zip([30, 10, 20, 40]).map(|(s, c)| tick(*s, c)).collect();
        let with_waits = Some(WithWaits { mean: 28.0, worst: 43 });
        let expected = Cost { runs: 4, mean: 25.0, worst: 40, jitter: 50, with_waits };
        assert_eq!(cost(&ticks), expected);
    }
}
