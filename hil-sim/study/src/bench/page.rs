//! What was measured as tables and as plots, and its places in `docs/EMULATION.md` and `docs/PLANT.md`.

use std::path::Path;
use std::{fs, io};

use hil_sim::plant::precision::Point;
use hil_sim::table::{number, plain};

use super::Report;
use super::peers::{LEVEL, Peers, RING};
use crate::figure::{Chart, Figure, Series};
use crate::figure_svg::svg;

/// The pages in the folder `docs` with these tables, and the plots: names below it, and texts.
pub fn files(report: &Report, docs: &Path) -> io::Result<Vec<(&'static str, String)>> {
    let performance = vec![plant_panel(report)];
    let peers = vec![peers_panel(&report.peers)];
    let model = fs::read_to_string(docs.join("EMULATION.md"))?;
    let plant = fs::read_to_string(docs.join("PLANT.md"))?;
    let plant = filled(&plant, "plant", &plant_table(report))?;
    Ok(vec![
        ("EMULATION.md", filled(&model, "model", &rollout_table(report))?),
        ("PLANT.md", filled(&plant, "solvers", &peers_table(&report.peers))?),
        ("figures/performance.svg", svg(&figure("performance", 1, performance))),
        ("figures/peers.svg", svg(&figure("peers", 1, peers))),
    ])
}

/// `page` with this table between the marks of its name.
fn filled(page: &str, name: &str, table: &str) -> io::Result<String> {
    let mark = format!("<!-- bench: {name} -->\n");
    let parts = page.split_once(&mark).and_then(|(before, rest)| {
        let (_, after) = rest.split_once("<!-- end -->")?;
        Some(format!("{before}{mark}```text\n{}\n```\n<!-- end -->{after}", table.trim_end()))
    });
    parts.ok_or_else(|| io::Error::other(format!("no place for the table `{name}` in its page")))
}

fn figure(id: &'static str, columns: usize, panels: Vec<Chart>) -> Figure {
    Figure::new(id, "", String::new(), columns, panels)
}

fn plant_panel(report: &Report) -> Chart {
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
        Series::method(4, "gap", of(|point| point.gap_error)),
        Series::method(0, "force", of(|point| point.force_error)),
    ];
    let (title, x) = ("Plant: worst of twelve crossings", "time of a crossing, ms");
    Chart::new(title, x, "relative error", series).logarithmic()
}

fn peers_panel(peers: &Peers) -> Chart {
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
    Chart::new(title, "time, ms", y, series.collect()).logarithmic()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_replaces_the_one_of_its_name_and_the_pages_have_its_place() {
        let page =
            "a\n<!-- bench: x -->\nold\n<!-- end -->\nb\n<!-- bench: y -->\nc\n<!-- end -->\n";
        let new = filled(page, "y", "new\n\n").unwrap();
        assert_eq!(new.split("<!-- bench: y -->").next(), page.split("<!-- bench: y -->").next());
        assert!(new.ends_with("<!-- bench: y -->\n```text\nnew\n```\n<!-- end -->\n"), "{new}");
        assert!(filled(page, "z", "").unwrap_err().to_string().contains("`z`"));
        let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");
        for (page, name) in [("EMULATION", "model"), ("PLANT", "plant"), ("PLANT", "solvers")] {
            let page = fs::read_to_string(format!("{docs}/{page}.md")).unwrap();
            assert!(filled(&page, name, "").is_ok(), "{name}");
        }
    }
}
