//! The account of a run as a section of its page.

use super::{Cost, Load};
use hil_sim::report::svg::escape;

/// Functions shown; the rest is summed up.
const FUNCTIONS: usize = 25;

/// Heading of the section.
pub const TITLE: &str = "What it cost on the core";

/// Load, tick by phase, tasks, interrupts, functions, memory; `missed` are the budgets
/// that were not kept.
#[must_use]
pub fn html(load: &Load, missed: &[String]) -> String {
    let us = |cycles: f64| cycles * 1e6 / load.clock_hz as f64;
    let part = |used: f64, whole: f64| format!("{used:.0} of {whole:.0} bytes");
    let pairs = [
        ("Core busy", format!("{:.2} % of the time", 100.0 * load.load)),
        ("Asleep", format!("{:.2} %", 100.0 * load.idle)),
        ("Tick, mean", format!("{:.0} cycles, {:.1} µs", load.tick.mean, us(load.tick.mean))),
        (
            "Tick, worst",
            format!("{} cycles, {:.1} µs", load.tick.worst, us(load.tick.worst as f64)),
        ),
        ("Tick starts late, mean", format!("{:.1} µs", us(load.start.late_mean))),
        ("Jitter of its start", format!("{:.1} µs", us(load.start.jitter as f64))),
        ("Stack used", part(load.stack_used.into(), load.stack as f64)),
        ("Flash", format!("{} bytes", load.flash)),
        ("RAM, stack included", format!("{} bytes", load.ram)),
        ("Accesses to nothing", load.unmodelled.len().to_string()),
    ];
    let cells: String = pairs
        .iter()
        .map(|(name, value)| format!("<div><dt>{name}</dt><dd>{}</dd></div>\n", escape(value)))
        .collect();
    let missed: String =
        missed.iter().map(|line| format!("<p>Over budget: {}</p>\n", escape(line))).collect();
    format!(
        "<dl>\n{cells}</dl>\n{missed}{}{}<p class=\"note\">Textbook cycles of a Cortex-M4 from the \
first command on, without wait states of the flash. A task or interrupt that is preempted is not \
charged for what preempts it. Latency: from the request to the first instruction. The tick starts \
late against an even beat through its earliest start.</p>\n",
        table(load),
        functions(load),
    )
}

/// Phases, tasks and interrupts.
fn table(load: &Load) -> String {
    const HEAD: &str = "<table class=\"ledger\">\n<thead>\n<tr><th>cycles of</th><th>runs</th>\
<th>mean</th><th>worst</th><th>time</th><th>latency</th><th>worst</th></tr>\n</thead>\n<tbody>\n";
    let row = |kind: &str, name: &str, cost: &Cost, latency: Option<(f64, u64)>| {
        let latency = latency.map_or_else(
            || "<td></td><td></td>".to_owned(),
            |(mean, worst)| format!("<td>{mean:.0}</td><td>{worst}</td>"),
        );
        format!(
            "<tr><td>{kind} {}</td><td>{}</td><td>{:.0}</td><td>{}</td><td>{:.2} %</td>{latency}</tr>\n",
            escape(name),
            cost.runs,
            cost.mean,
            cost.worst,
            100.0 * cost.share,
        )
    };
    let phases = load.phases.iter().map(|p| row("tick in", &p.name, &p.cost, None));
    let tasks = load.tasks.iter().map(|t| row("task", &t.name, &t.cost, None));
    let interrupts = load
        .interrupts
        .iter()
        .map(|i| row("interrupt", &i.name, &i.cost, Some((i.latency_mean, i.latency_worst))));
    let shut = load.masked.iter().map(|shut| {
        let name = format!("{} ({})", shut.function, shut.level);
        row("interrupts shut out by", &name, &shut.cost(load.cycles), None)
    });
    let rows: String = phases.chain(tasks).chain(interrupts).chain(shut).collect();
    format!("{HEAD}{rows}</tbody>\n</table>\n")
}

/// Functions of the source.
fn functions(load: &Load) -> String {
    let rows: String = load
        .functions
        .iter()
        .take(FUNCTIONS)
        .map(|f| {
            format!("<tr><td>{:.0}</td><td>{}</td></tr>\n", f.cycles_per_ms, escape(&f.function))
        })
        .collect();
    format!(
        "<details><summary>Cycles a millisecond by function of the source, what was inlined by \
itself</summary>\n<table class=\"lines\">\n{rows}</table>\n</details>\n"
    )
}
