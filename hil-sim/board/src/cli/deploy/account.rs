//! The account of a run on the board, as text.

use std::fmt::Write;

use crate::load::{Cost, Load};
use hil_sim::table::plain;

/// Places shown that shut interrupts out, the longest first.
const SHUT: usize = 3;

/// Load, tick by phase, tasks and interrupts, and who shuts interrupts out.
pub(super) fn text(load: &Load, missed: &[String]) -> String {
    let us = |cycles: f64| cycles * 1e6 / load.clock_hz as f64;
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "  core busy {:.2} % of the time; tick {:.0} cycles in the mean, {} at worst; it starts\n  \
         {:.1} us late in the mean, {:.1} us at most; stack {} of {} bytes, flash {}, RAM {}",
        100.0 * load.load,
        load.tick.mean,
        load.tick.worst,
        us(load.start.late_mean),
        us(load.start.jitter as f64),
        load.stack_used,
        load.stack,
        load.flash,
        load.ram,
    );
    let row = |kind: &str, name: &str, cost: &Cost, latency: Option<(f64, u64)>| {
        let latency = latency.map_or_else(Default::default, |(mean, worst)| {
            [format!("{mean:.0}"), worst.to_string()]
        });
        let [mean, worst] = latency;
        vec![
            format!("{kind} {name}"),
            cost.runs.to_string(),
            format!("{:.0}", cost.mean),
            cost.worst.to_string(),
            format!("{:.2} %", 100.0 * cost.share),
            mean,
            worst,
        ]
    };
    let phases = load.phases.iter().map(|p| row("tick in", &p.name, &p.cost, None));
    let tasks = load.tasks.iter().map(|t| row("task", &t.name, &t.cost, None));
    let interrupts = load
        .interrupts
        .iter()
        .map(|i| row("interrupt", &i.name, &i.cost, Some((i.latency_mean, i.latency_worst))));
    let shut = load.masked.iter().take(SHUT).map(|shut| {
        let name = format!("{} ({})", shut.function, shut.level);
        row("shut out by", &name, &shut.cost(load.cycles), None)
    });
    let head = ["cycles of", "runs", "mean", "worst", "time", "latency", "worst"];
    let _ = writeln!(text, "{}", plain(&head, phases.chain(tasks).chain(interrupts).chain(shut)));
    for missed in missed {
        let _ = writeln!(text, "  over budget: {missed}");
    }
    text
}
