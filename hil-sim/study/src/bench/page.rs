//! What was measured as tables and as plots, and `docs/PERFORMANCE.md`.

use hil_sim::plant::precision::Point;
use hil_sim::table::{number, plain};

use super::Report;
use super::peers::{LEVEL, Peers, RING};
use crate::figure::{Figure, Panel, Series};
use crate::figure_svg::svg;

/// The page and its plots: names below `docs`, and texts.
pub fn files(report: &Report) -> Vec<(&'static str, String)> {
    let peers = vec![peers_panel(&report.peers)];
    vec![
        ("PERFORMANCE.md", page(report)),
        ("figures/performance.svg", svg(&figure("performance", 1, vec![plant_panel(report)]))),
        ("figures/peers.svg", svg(&figure("peers", 1, peers))),
    ]
}

fn figure(id: &'static str, columns: usize, panels: Vec<Panel>) -> Figure {
    Figure::new(id, "", String::new(), columns, panels)
}

fn plant_panel(report: &Report) -> Panel {
    // At the default's ratio of elements and stride.
    let usual = report.plant.default;
    let product = usual.elements as f64 * usual.stride_mm;
    let of = |error: fn(&Point) -> f64| {
        let line = report.plant.settings.iter();
        let line = line
            .filter(|point| (point.elements as f64 * point.stride_mm / product - 1.0).abs() < 1e-9);
        line.map(|point| (1e-6 * point.wall_ns, error(point))).collect()
    };
    let series = vec![
        Series::method(3, "gap", of(|point| point.gap_error)),
        Series::method(4, "force", of(|point| point.force_error)),
    ];
    let (title, x) = ("Plant: worst of twelve crossings", "time of a crossing, ms");
    Panel::new(title, x, "relative error", series).logarithmic()
}

fn peers_panel(peers: &Peers) -> Panel {
    let series = peers.least_seconds.iter().enumerate().map(|(index, (name, _))| {
        let of = peers.settings.iter().filter(|setting| setting.name == *name);
        let mut points: Vec<(f64, f64)> =
            of.filter_map(|s| Some((1e3 * s.seconds, s.error?))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Settings that no other of the method beats in both.
        let mut least = f64::INFINITY;
        points.retain(|&(_, error)| {
            let better = error < least;
            least = least.min(error);
            better
        });
        Series::method(index, name, points)
    });
    let (title, y) = ("One crossing (5 mm/s, 100 N)", "relative error of gap or force");
    Panel::new(title, "time, ms", y, series.collect()).logarithmic()
}

/// The tables of a measurement.
pub fn tables(report: &Report) -> String {
    let tables = [rollout_table(report), plant_table(report), peers_table(&report.peers)];
    let mut text = tables.concat();
    if let Some(why) = &report.cycles_left_out {
        text += &format!("left out: {why}\n");
    }
    text
}

fn rollout_table(report: &Report) -> String {
    let rows = report.variants.iter().map(|variant| {
        vec![
            variant.name.to_owned(),
            number(100.0 * variant.max_rel_error, 3),
            number(100.0 * variant.rms_rel_error, 3),
            variant.cycles.map_or_else(|| "-".to_owned(), |cycles| cycles.to_string()),
            number(variant.host_ns, 0),
        ]
    });
    let head = ["model", "max error %", "RMS error %", "cycles", "host ns"];
    let tick = report.tick.map_or_else(String::new, |tick| {
        let (task, waits) = (tick.firmware, tick.firmware.with_waits);
        let line = |what: &str, mean: f64, worst: u64| {
            format!("{what}: {mean:.0} cycles on average, {worst} at most\n")
        };
        line("control tick", tick.mean, tick.worst)
            + &line("its task in the firmware", task.mean, task.worst)
            + &line("the same with the flash's wait states", waits.mean, waits.worst)
    });
    format!("{}\n{tick}\n", plain(&head, rows))
}

fn plant_table(report: &Report) -> String {
    let rows = report.plant.settings.iter().map(|point| {
        let default = Some(point) == report.plant.usual();
        vec![
            format!("{}{}", point.elements, if default { " (default)" } else { "" }),
            number(point.stride_mm, 2),
            number(100.0 * point.gap_error, 3),
            number(100.0 * point.force_error, 3),
            number(1e-6 * point.wall_ns, 3),
        ]
    });
    let head = ["plant: elements", "stride mm", "gap error %", "force error %", "crossing ms"];
    format!("{}\n\n", plain(&head, rows))
}

fn peers_table(peers: &Peers) -> String {
    let ring = peers.least_seconds.iter().find(|(name, _)| name == RING).and_then(|own| own.1);
    let rows = peers.least_seconds.iter().map(|(name, seconds)| {
        let never = || "never".to_owned();
        vec![
            name.clone(),
            seconds.map_or_else(never, |seconds| number(1e3 * seconds, 2)),
            seconds.zip(ring).map_or_else(never, |(seconds, ring)| number(seconds / ring, 1)),
        ]
    });
    let within = format!("ms within {} %", 100.0 * LEVEL);
    format!("{}\n\n", plain(&["method", &within, "over the ring"], rows))
}

fn page(report: &Report) -> String {
    let machine = format!("{} {}", std::env::consts::ARCH, std::env::consts::OS);
    let [scipy, mujoco] = &report.peers.versions;
    format!(
        "# Performance\n\nWritten by `cargo rig bench --docs`; do not edit.\n\n\
         Run time against error. Times are processor time of one thread on {machine}, the least of several runs. \
         Cycles are textbook Cortex-M4 cycles of the emulated core, without flash wait states unless they are named. Tests hold errors and cycles.\n\n\
         ## Rollout\n\n\
         The tread as the firmware rolls it out ([`tread.rs`](../src/model/tread.rs)): error of the gap on twelve \
         crossings against the plant's ring with four times the elements and a quarter of the stride. \
         Promised are 0.7 %. Cycles are those of the costliest crossing.\n\n```text\n{}```\n\n\
         ## Plant\n\n\
         Gap and largest axial force of twelve crossings (three speeds and preloads, pushed and driven, both \
         directions) against the ring with {} times the elements and as small a part of the stride. The error is that \
         of the worst crossing, the time the mean. Promised are 0.5 % at the default.\n\n\
         [![Error against time of the plant](figures/performance.svg)](figures/performance.svg)\n\n```text\n{}```\n\
         \n## Other solvers\n\n\
         The published crossing (5 mm/s, 100 N, frictionless, quasi-static) by the plant's *ring*, by {scipy} and by {mujoco}, \
         as [`run.py`](../hil-sim/study/peers/run.py) stored them. \
         *LSODA*, *RK23* and *DOP853* solve the ring's own equations with the height eliminated; *Radau* and *BDF* \
         solve them with a small damper beside the contact, which makes them stiff. The equations are compiled. \
         MuJoCo's disc has normal springs fitted to the ring at 80 and 120 N, and no memory.\n\n\
         [![Error against time by method](figures/peers.svg)](figures/peers.svg)\n\n```text\n{}```\n",
        rollout_table(report),
        report.plant.finer,
        plant_table(report),
        peers_table(&report.peers),
    )
}
