//! What was measured as tables and as plots, and its places in `docs/EMULATION.md` and `docs/PLANT.md`.

use std::path::Path;
use std::{fs, io};

use hil_sim::plant::precision::Point;
use hil_sim::report::axis::{Scale, extent, padded};
use hil_sim::report::palette;
use hil_sim::report::panel::{Line, Look, Panel, sheet};
use hil_sim::table::{number, plain};

use super::Report;

/// The pages in the folder `docs` with these tables, and the plots: names below it, and texts.
pub(crate) fn files(report: &Report, docs: &Path) -> io::Result<Vec<(&'static str, String)>> {
    let model = fs::read_to_string(docs.join("EMULATION.md"))?;
    let plant = fs::read_to_string(docs.join("PLANT.md"))?;
    Ok(vec![
        ("EMULATION.md", filled(&model, "model", &rollout_table(report))?),
        ("PLANT.md", filled(&plant, "plant", &plant_table(report))?),
        ("figures/performance.svg", sheet(vec![plant_panel(report)], 1, true)),
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

fn plant_panel(report: &Report) -> Panel {
    // At the default's ratio of elements and stride.
    let usual = report.plant.default;
    let product = usual.elements as f64 * usual.stride_mm;
    let is_similar =
        |one: &&Point| (one.elements as f64 * one.stride_mm / product - 1.0).abs() < 1e-9;
    let settings = report.plant.settings.iter().filter(is_similar);
    let line = |name: &str, colour, error: fn(&Point) -> f64| {
        let at = |one: &Point| ((1e-6 * one.wall_ns).log10(), error(one).log10());
        let (name, look) = (name.to_owned(), Look::Measured(colour));
        Line { name, look, points: settings.clone().map(at).collect() }
    };
    let lines = vec![
        line("gap", palette::GAP, |point| point.gap_error),
        line("force", palette::PRELOAD, |point| point.force_error),
    ];
    Panel {
        title: "Plant: worst of twelve crossings".to_owned(),
        x_name: "time of a crossing, ms".to_owned(),
        y_name: "relative error".to_owned(),
        x_axis: Scale::Log,
        y_axis: Scale::Log,
        x: padded(extent(lines[0].points.iter().map(|at| at.0)).unwrap_or_default(), 0.03),
        marks: lines.iter().map(Line::dots).collect(),
        lines,
        ..Panel::default()
    }
}

/// The tables of a measurement.
pub(crate) fn tables(report: &Report) -> String {
    let mut text = rollout_table(report) + &plant_table(report);
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
        for (page, name) in [("EMULATION", "model"), ("PLANT", "plant")] {
            let page = fs::read_to_string(format!("{docs}/{page}.md")).unwrap();
            assert!(filled(&page, name, "").is_ok(), "{name}");
        }
    }
}
