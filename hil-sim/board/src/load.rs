//! What a run on the board cost: tick by phase, tasks, interrupts, sleep, stack, memory.
//!
//! Cycles are textbook ones, see [`super::timing`]. The start of the program, which
//! builds the controller's tables, is left out: counting begins when the drive is idle.

pub mod page;

use std::collections::BTreeMap;

use serde::Serialize;

use super::chip::Stray;
use super::core::Masked;
use super::exceptions::number::SYS_TICK;
use super::heat::by_function;
use super::heat::names::Names;
use super::image::ImageError;
use super::machine::{Machine, Poll, Share, THREAD};
use super::peripherals::HZ;
use crate::bench::budget::BoardBudget;
use hil_sim::firmware::Footprint;
use hil_sim::record::MODE_NAMES;

/// Cycles from one control tick to the next.
const PERIOD: u64 = HZ / 1000;
/// Name of the task that runs the control tick.
const TICK: &str = "motors";

/// Runs of something with their cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cost {
    /// How often.
    pub runs: u64,
    /// Mean cycles.
    pub mean: f64,
    /// Most cycles.
    pub worst: u64,
    /// Part of all time.
    pub share: f64,
    #[serde(skip)]
    sum: u64,
}

impl Cost {
    fn note(&mut self, cycles: u64) {
        self.runs += 1;
        self.sum += cycles;
        self.worst = self.worst.max(cycles);
    }

    fn closed(mut self, whole: u64) -> Self {
        self.mean = self.sum as f64 / self.runs.max(1) as f64;
        self.share = self.sum as f64 / whole.max(1) as f64;
        self
    }
}

/// Something that runs, with what it costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// Its cost.
    #[serde(flatten)]
    pub cost: Cost,
}

/// An interrupt.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Interrupt {
    /// Name of its vector.
    pub name: String,
    /// Its cost, tasks that run in it included.
    #[serde(flatten)]
    pub cost: Cost,
    /// Mean cycles from its request to its first instruction.
    pub latency_mean: f64,
    /// Most of them.
    pub latency_worst: u64,
}

/// Interrupts shut out, which delays them all by so much at most.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shut {
    /// By this function.
    pub function: String,
    /// In the exception of this name, or in thread mode.
    pub level: String,
    /// How often.
    pub times: u64,
    /// Mean cycles.
    pub mean: f64,
    /// Most cycles.
    pub worst: u64,
    /// Where it begins.
    pub pc: u32,
}

impl Shut {
    /// What it cost, as a row among the others.
    #[must_use]
    pub fn cost(&self, whole: u64) -> Cost {
        let share = self.mean * self.times as f64 / whole.max(1) as f64;
        Cost { runs: self.times, mean: self.mean, worst: self.worst, share, sum: 0 }
    }
}

/// A function of the source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spent {
    /// Its name.
    pub function: String,
    /// Cycles by itself, per millisecond.
    pub cycles_per_ms: f64,
}

/// When the control tick begins, against an even beat.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Start {
    /// Mean cycles behind the earliest.
    pub late_mean: f64,
    /// Most: the jitter, from the earliest to the latest.
    pub jitter: u64,
}

/// The account of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Load {
    /// Clock of the core, Hz.
    pub clock_hz: u64,
    /// Cycles accounted for.
    pub cycles: u64,
    /// Part of the time in which the core did not sleep.
    pub load: f64,
    /// Part of the time in which it slept.
    pub idle: f64,
    /// The control tick with its task.
    pub tick: Cost,
    /// When it begins.
    pub start: Start,
    /// The control tick by phase.
    pub phases: Vec<Named>,
    /// Every task.
    pub tasks: Vec<Named>,
    /// Every exception that was taken.
    pub interrupts: Vec<Interrupt>,
    /// Cycles by function of the source, what was inlined by itself; the most expensive
    /// first, as many as make up nearly all.
    pub functions: Vec<Spent>,
    /// Where interrupts were shut out, the longest first: each place, down to those that
    /// hardly delay anything.
    pub masked: Vec<Shut>,
    /// Bytes of the stack that were used, and those set apart for it.
    pub stack_used: u32,
    /// See [`Load::stack_used`].
    pub stack: u64,
    /// Bytes of flash.
    pub flash: u64,
    /// Bytes of RAM, the stack included.
    pub ram: u64,
    /// Accesses to registers that no model has.
    pub unmodelled: Vec<Stray>,
}

/// What is gathered for an account while a run goes on.
#[derive(Debug, Default)]
pub struct Gathered {
    from: Option<(u64, u64)>,
    tasks: BTreeMap<usize, Cost>,
    phases: BTreeMap<u8, Cost>,
    tick: Cost,
    starts: Vec<u64>,
}

impl Gathered {
    /// Counting begins.
    pub fn begin(&mut self, machine: &mut Machine) {
        let now = machine.now();
        machine.profile_mut().clear(now);
        machine.take_heat();
        machine.take_masked();
        *self = Self { from: Some((now, machine.profile().slept())), ..Self::default() };
    }

    /// Takes what has gathered in the board, in a phase of this number.
    pub fn gather(&mut self, machine: &mut Machine, phase: u8) {
        let polls = machine.profile_mut().take_polls();
        if self.from.is_none() {
            return;
        }
        let tick = machine.tasks().iter().position(|name| *name == TICK);
        for Poll { task, began, cycles } in polls {
            self.tasks.entry(task).or_default().note(cycles);
            if Some(task) == tick {
                self.tick.note(cycles);
                self.phases.entry(phase).or_default().note(cycles);
                self.starts.push(began);
            }
        }
    }

    /// The account; functions are not told apart yet.
    #[must_use]
    pub fn close(self, machine: &Machine, footprint: &Footprint, stack_used: u32) -> Load {
        let (from, slept) = self.from.unwrap_or_default();
        let cycles = machine.now() - from;
        let idle = (machine.profile().slept() - slept) as f64 / cycles.max(1) as f64;
        let names = machine.tasks();
        let named =
            |name: &str, cost: Cost| Named { name: name.to_owned(), cost: cost.closed(cycles) };
        let task = |(number, cost): (&usize, &Cost)| {
            named(names.get(*number).copied().unwrap_or("unknown"), *cost)
        };
        let phase = |(number, cost): (&u8, &Cost)| {
            named(MODE_NAMES.get(usize::from(*number)).copied().unwrap_or("unknown"), *cost)
        };
        let interrupt = |(number, share): (u8, Share)| {
            let runs = share.entries;
            let cost = Cost { runs, sum: share.cycles, worst: share.worst, ..Cost::default() };
            Interrupt {
                name: vector(number),
                cost: cost.closed(cycles),
                latency_mean: share.latency as f64 / runs.max(1) as f64,
                latency_worst: share.worst_latency,
            }
        };
        Load {
            clock_hz: HZ,
            cycles,
            load: 1.0 - idle,
            idle,
            tick: self.tick.closed(cycles),
            start: start(&self.starts),
            phases: self.phases.iter().map(phase).collect(),
            tasks: self.tasks.iter().map(task).collect(),
            interrupts: machine
                .profile()
                .shares()
                .filter(|(number, _)| *number != THREAD)
                .map(interrupt)
                .collect(),
            functions: Vec::new(),
            masked: Vec::new(),
            stack_used,
            stack: footprint.stack,
            flash: footprint.flash,
            ram: footprint.ram,
            unmodelled: machine.chip().strays().iter().copied().collect(),
        }
    }
}

/// Functions per millisecond of `cycles`, down to those that hardly count.
fn spent(functions: Vec<(String, u64)>, cycles: u64) -> Vec<Spent> {
    /// Of all that was spent, what is left out.
    const REST: f64 = 0.02;
    let mut left = functions.iter().map(|(_, spent)| *spent as f64).sum::<f64>();
    let rest = REST * left;
    let counts = |(_, spent): &(String, u64)| {
        let counts = left > rest;
        left -= *spent as f64;
        counts
    };
    let ms = cycles as f64 / PERIOD as f64;
    let found = functions.into_iter().take_while(counts);
    found.map(|(function, spent)| Spent { function, cycles_per_ms: spent as f64 / ms }).collect()
}

/// Places at which interrupts are shut out, as many as are kept.
const PLACES: usize = 12;

/// A place at which interrupts are shut out, by the function that asks for it: the first
/// that is not about just that.
fn shut((pc, exception): (u32, u32), by: &Masked, names: &Names<'_>) -> Shut {
    let about =
        ["core::", "cortex_m::", "critical_section::", "_critical_section", "blocking_mutex"];
    let frames = names.frames(pc).into_iter().map(|frame| frame.function);
    let mut others = frames.filter(|name| !about.iter().any(|about| name.contains(about)));
    Shut {
        function: others.next().unwrap_or_else(|| "unknown".to_owned()),
        level: if exception == 0 { "thread mode".to_owned() } else { vector(exception as u8) },
        times: by.times,
        mean: by.cycles as f64 / by.times.max(1) as f64,
        worst: by.worst,
        pc,
    }
}

/// Beginnings of the tick against a beat of one period.
fn start(starts: &[u64]) -> Start {
    let Some(first) = starts.first() else { return Start::default() };
    let phase = |at: &u64| {
        let beats = ((at - first) + PERIOD / 2) / PERIOD;
        (at - first) as i64 - (beats * PERIOD) as i64
    };
    let earliest = starts.iter().map(phase).min().unwrap_or(0);
    let late = |at: &u64| (phase(at) - earliest) as u64;
    Start {
        late_mean: starts.iter().map(late).sum::<u64>() as f64 / starts.len() as f64,
        jitter: starts.iter().map(late).max().unwrap_or(0),
    }
}

/// Name of a vector that the firmware uses.
fn vector(number: u8) -> String {
    match number.checked_sub(16) {
        None if number == SYS_TICK => "SysTick".into(),
        None => format!("exception {number}"),
        Some(channel @ 11..=17) => format!("DMA1_CHANNEL{}", channel - 10),
        Some(28) => "TIM2".into(),
        Some(40) => "EXTI15_10".into(),
        Some(53) => "UART5 (control)".into(),
        Some(interrupt) => format!("interrupt {interrupt}"),
    }
}

impl Load {
    /// Tells apart the functions that the cycles since the account's beginning went to;
    /// `elf` is the image.
    ///
    /// # Errors
    /// [`ImageError`] if its debug information cannot be read.
    pub fn name_functions(&mut self, machine: &mut Machine, elf: &[u8]) -> Result<(), ImageError> {
        let heat = machine.take_heat();
        self.functions = spent(by_function(elf, machine.image(), &heat)?, self.cycles);
        let masked = machine.take_masked();
        let names = Names::read(elf)?;
        self.masked = masked.iter().map(|(place, by)| shut(*place, by, &names)).collect();
        self.masked.sort_by_key(|shut| std::cmp::Reverse(shut.worst));
        self.masked.truncate(PLACES);
        Ok(())
    }

    /// Holds the account against its budgets; says which is missed.
    #[must_use]
    pub fn missed(&self, budget: &BoardBudget) -> Vec<String> {
        /// SRAM1 and SRAM2.
        const MEMORY: u64 = 96 * 1024;
        let left = MEMORY - (self.ram - self.stack);
        let worst = self.tick.worst as f64 / PERIOD as f64;
        let stack = f64::from(self.stack_used) / left as f64;
        let checks = [
            ("mean load", self.load, budget.mean_load),
            ("worst tick, part of its period", worst, budget.worst_tick),
            ("stack, part of what is left", stack, budget.stack),
        ];
        let missed = checks.into_iter().filter(|(_, value, most)| value > most);
        missed.map(|(what, value, most)| format!("{what}: {value:.3}, at most {most}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lateness_is_counted_from_the_earliest_beat() {
        let starts = [1000, 1000 + PERIOD + 40, 1000 + 2 * PERIOD - 10, 1000 + 5 * PERIOD];
        let start = start(&starts);
        assert_eq!(start.jitter, 50);
        assert_eq!(start.late_mean, (10.0 + 50.0 + 0.0 + 10.0) / 4.0);
    }

    #[test]
    fn costs_close_to_means_and_shares() {
        let mut cost = Cost::default();
        for cycles in [10, 30] {
            cost.note(cycles);
        }
        let closed = cost.closed(400);
        assert_eq!((closed.mean, closed.worst, closed.share), (20.0, 30, 0.1));
    }
}
