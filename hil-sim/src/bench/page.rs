//! What was measured, as tables and as the page `docs/PERFORMANCE.md` with its plots.

use std::fmt::Write as _;

use super::chart::{Chart, Series};
use super::peers::{Peers, RING, Setting};
use super::{Plant, Report};
use crate::table::plain;

/// The tables of a report, for the terminal.
#[must_use]
pub fn tables(report: &Report) -> String {
    let mut text = meshes(&report.plant);
    text += &format!("\n{}", runs(&report.plant));
    match (&report.peers, &report.peers_left_out) {
        (Some(found), _) => {
            text += &format!("\n{}\n{}{}", peers(found), ratios(found), notes(found));
        }
        (None, why) => {
            let why = why.as_deref().unwrap_or("no reason given");
            let _ = write!(text, "\nOther engines and solvers left out: {why}\n");
        }
    }
    text + &format!("\n{}", budgets(report))
}

/// Files under `docs/`: the page, and the plots that it shows.
#[must_use]
pub fn files(report: &Report) -> Vec<(String, String)> {
    let mut files = vec![
        ("PERFORMANCE.md".to_owned(), page(report)),
        ("performance/plant.svg".to_owned(), plant_chart(&report.plant).svg()),
    ];
    if let Some(peers) = &report.peers {
        files.push(("performance/peers.svg".to_owned(), peers_chart(peers).svg()));
    }
    files
}

fn page(report: &Report) -> String {
    let machine = &report.machine;
    let mut page = format!(
        "# Performance\n\nWritten by `cargo rig bench --peers --docs`; do not edit.\n\n\
         Run time against error. Times are processor time of one thread, the least of several \
         runs from the same state, on {} ({}). Errors and counts do not depend on the machine; \
         [`hil-sim/budget.toml`](../hil-sim/budget.toml) bounds them, a test holds the bounds, \
         and [history.jsonl](performance/history.jsonl) keeps what earlier versions \
         reached.\n",
        machine.processor, machine.system
    );
    let mut section = |title: &str, text: &str, block: &str| {
        let _ = write!(page, "\n## {title}\n\n{text}\n\n```text\n{}\n```\n", block.trim_end());
    };
    section(
        "The plant: resolution",
        &format!(
            "Gap and largest axial force of four crossings (published; driven out and back; \
             fast) against the ring at {} times the default's resolution, both ways. The error \
             is the largest of the four and of three element counts a few apart: where the \
             elements happen to stand at the instant of lift-off is luck.\n\n\
             ![Error of gap and force against the time of a crossing](performance/plant.svg)",
            report.plant.finer
        ),
        &meshes(&report.plant),
    );
    section(
        "The plant: whole runs",
        "A deployment at 8 mm/s throughout. The plant alone repeats the bridge commands of a \
         closed-loop run. On the smooth wall the steady solution stands in for the ring, which \
         is woken before a step; *always resolved* shows what that saves.",
        &runs(&report.plant),
    );
    if let Some(found) = &report.peers {
        section(
            "Other engines and solvers",
            &format!(
                "One crossing, the published case: 5 mm/s, 100 N, frictionless, quasi-static; \
                 the same wheel, step and way for all, in one run. {}.\n\n\
                 - *Ring*: this plant's.\n\
                 - *LSODA, RK23, DOP853* (SciPy): the ring's own equations with the height of \
                 the centre eliminated by Newton's method in each evaluation; not stiff. *Radau, \
                 BDF*: the same with a damper of 0.1 N s/mm beside the contact and the height as \
                 a state; stiff, with its exact sparse Jacobian. The equations are compiled C; \
                 the loop of LSODA is compiled too, those of the others are Python's. Reading \
                 the result out is not timed.\n\
                 - *MuJoCo*: the wheel as a disc on floor and step, its normal springs fitted to \
                 the ring at 80 and 120 N; damping and mass are the best of a grid. It has no \
                 counterpart for the rubber's memory and for pressure spread over face and top.\
                 \n\n![Error against the time of a crossing, by method](performance/peers.svg)",
                found.versions.join(", ")
            ),
            &format!("{}\n{}{}", peers(found), ratios(found), notes(found)),
        );
    }
    section("Bounds", "An aim depends on the machine and fails nothing.", &budgets(report));
    page
}

fn meshes(plant: &Plant) -> String {
    let rows = plant.meshes.iter().map(|mesh| {
        vec![
            format!("{}{}", mesh.sweep, if mesh.default { " (default)" } else { "" }),
            mesh.elements.to_string(),
            format!("{}", mesh.stride_mm),
            percent(mesh.max_gap_error),
            percent(mesh.max_force_error),
            short(mesh.crossing_ms),
        ]
    });
    let head = ["sweep", "elements", "stride mm", "gap error %", "force error %", "crossing ms"];
    format!(
        "Plant: resolution, elements and stride together and each alone\n{}\n\
         the converged answers differ by {} % from those at half their resolution\n",
        plain(&head, rows),
        percent(plant.doubt)
    )
}

fn runs(plant: &Plant) -> String {
    let costs = &plant.costs;
    let row = |name: &str, value: f64, unit: &str| vec![name.into(), short(value), unit.into()];
    let rows = [
        row("simulated", costs.simulated_s, "s"),
        row("of that with the ring resolved", costs.ring_awake_s, "s"),
        row("plant alone", costs.plant_real_time_factor, "x real time"),
        row(
            "plant alone, ring always resolved",
            costs.always_awake_real_time_factor,
            "x real time",
        ),
        row("controller, sensors and plant", costs.run_real_time_factor, "x real time"),
        row("a second on the smooth wall", 1e3 * costs.smooth_s_per_s, "ms"),
        row("a second of a crossing", 1e3 * costs.crossing_s_per_s, "ms"),
        row("crossing over smooth wall", costs.crossing_over_smooth, ""),
    ];
    format!("Plant: whole runs, one core\n{}\n", plain(&["", "value", "unit"], rows))
}

fn peers(peers: &Peers) -> String {
    let rows = best(peers).into_iter().map(|setting| {
        let either = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
        let fineness = match (setting.tolerance, setting.time_step_s) {
            (Some(tolerance), _) => format!("{tolerance:.0e}"),
            (None, Some(step)) => format!("{} ms", short(1e3 * step)),
            (None, None) => "-".to_owned(),
        };
        vec![
            setting.name.clone(),
            either(setting.elements.map(|elements| elements.to_string())),
            fineness,
            either(setting.gap_error.map(percent)),
            percent(setting.force_error),
            short(1e3 * setting.seconds),
            either(setting.contact_sums.map(|sums| sums.to_string())),
        ]
    });
    let head = [
        "method",
        "elements",
        "tolerance\nor step",
        "gap error %",
        "force error %",
        "ms",
        "contact sums",
    ];
    format!(
        "One crossing (5 mm/s, 100 N) by {} and the ring: settings that no other of the same \
         method beats in both\n{}\n",
        peers.versions.join(", "),
        plain(&head, rows)
    )
}

/// The settings on the front of each method, by rising time.
fn best(peers: &Peers) -> Vec<&Setting> {
    let beaten = |setting: &Setting| {
        let better = |other: &&Setting| {
            other.name == setting.name
                && other.seconds < setting.seconds
                && other.error() <= setting.error()
        };
        peers.settings.iter().any(|other| better(&other))
    };
    peers.settings.iter().filter(|setting| !beaten(setting)).collect()
}

fn ratios(peers: &Peers) -> String {
    let mut names: Vec<&str> = peers.ratios.iter().map(|ratio| ratio.name.as_str()).collect();
    names.dedup();
    let mut levels: Vec<f64> = peers.ratios.iter().map(|ratio| ratio.level).collect();
    levels.dedup();
    names.truncate(peers.ratios.len() / levels.len().max(1));
    let head: Vec<String> = std::iter::once("time over the ring's".to_owned())
        .chain(levels.iter().map(|level| format!("both within {} %", percent(*level))))
        .collect();
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let rows = names.iter().map(|name| {
        let at = |level: &f64| {
            let found = peers.ratios.iter().find(|r| r.name == *name && r.level == *level);
            let ratio = found.and_then(|ratio| ratio.time_ratio);
            ratio.map_or_else(|| "never there".to_owned(), short)
        };
        std::iter::once((*name).to_owned()).chain(levels.iter().map(at)).collect()
    });
    format!("{}\n", plain(&head, rows))
}

fn notes(peers: &Peers) -> String {
    let mut text = String::new();
    if let Some(error) = peers.mujoco_gap_error_at_other_speed {
        let _ = writeln!(
            text,
            "MuJoCo at twice the speed with the same contacts: gap off by {} %",
            percent(error)
        );
    }
    let _ = match peers.mujoco_cylinder_gap_error {
        Some(error) => writeln!(
            text,
            "MuJoCo's cylinder for the disc: gap off by {} %; its contact with the corner has \
             the normal of the face",
            percent(error)
        ),
        None => writeln!(text, "MuJoCo's cylinder for the disc does not climb"),
    };
    text
}

fn budgets(report: &Report) -> String {
    let rows = report.budgets.iter().map(|line| {
        let verdict = match (line.holds, line.machine) {
            (true, _) => "yes",
            (false, true) => "no (aim)",
            (false, false) => "NO",
        };
        vec![
            line.name.clone(),
            format!("{} {}", if line.at_least { ">=" } else { "<=" }, short(line.bound)),
            short(line.reached),
            verdict.to_owned(),
        ]
    });
    format!("Bounds\n{}\n", plain(&["", "bound", "reached", "kept"], rows))
}

fn plant_chart(plant: &Plant) -> Chart {
    let of = |sweep: &str, name: &str, error: fn(&super::Precision) -> f64| {
        let mut points: Vec<_> = plant
            .meshes
            .iter()
            .filter(|mesh| mesh.sweep == sweep || mesh.default)
            .map(|mesh| (mesh.crossing_ms, 100.0 * error(mesh)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Series { name: name.to_owned(), points }
    };
    let gap = |mesh: &super::Precision| mesh.max_gap_error;
    let force = |mesh: &super::Precision| mesh.max_force_error;
    Chart {
        title: "Ring: error of gap and force against the time of a crossing".to_owned(),
        x_name: "processor time of a crossing, ms",
        y_name: "largest relative error, %",
        series: vec![
            of("both", "gap, both finer", gap),
            of("elements", "gap, more elements", gap),
            of("stride", "gap, shorter stride", gap),
            of("both", "force, both finer", force),
        ],
        ringed: plant
            .default_mesh()
            .map(|mesh| ("default", (mesh.crossing_ms, 100.0 * mesh.max_gap_error))),
        bound: Some(("allowed for the gap", 0.5)),
    }
}

fn peers_chart(peers: &Peers) -> Chart {
    let mut series: Vec<Series> = Vec::new();
    let mut add = |name: &str, point: (f64, f64)| match series
        .iter_mut()
        .find(|series| series.name == name)
    {
        Some(series) => series.points.push(point),
        None => series.push(Series { name: name.to_owned(), points: vec![point] }),
    };
    for setting in best(peers) {
        let name = if setting.name == RING { "ring (this plant)" } else { &setting.name };
        add(name, (1e3 * setting.seconds, 100.0 * setting.error()));
    }
    // Its gap is fitted, its force is not.
    for setting in peers.settings.iter().filter(|setting| setting.name.starts_with("MuJoCo")) {
        if let Some(gap) = setting.gap_error {
            add("the same, gap alone", (1e3 * setting.seconds, 100.0 * gap));
        }
    }
    Chart {
        title: "One crossing: larger error of gap and force against time, best settings of each"
            .to_owned(),
        x_name: "processor time of the crossing, ms",
        y_name: "larger relative error of gap and force, %",
        series,
        ringed: None,
        bound: None,
    }
}

fn percent(part: f64) -> String {
    short(100.0 * part)
}

/// Three significant digits.
fn short(value: f64) -> String {
    if !value.is_finite() {
        return "-".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let decimals = (2.0 - value.abs().log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_are_shown() {
        assert_eq!(short(1234.5), "1234");
        assert_eq!(short(12.345), "12.3");
        assert_eq!(short(0.012345), "0.0123");
        assert_eq!(percent(0.005), "0.500");
    }

    #[test]
    fn what_another_setting_beats_is_not_shown() {
        let setting = |name: &str, seconds: f64, error: f64| Setting {
            name: name.to_owned(),
            elements: None,
            tolerance: None,
            time_step_s: None,
            gap_error: Some(error),
            force_error: 0.0,
            seconds,
            contact_sums: None,
        };
        let settings = vec![
            setting("a", 1.0, 1.0),
            setting("a", 2.0, 2.0),
            setting("a", 3.0, 0.5),
            setting("b", 9.0, 3.0),
        ];
        let peers = Peers {
            versions: Vec::new(),
            doubt: 0.0,
            settings,
            ratios: Vec::new(),
            mujoco_gap_error_at_other_speed: None,
            mujoco_cylinder_gap_error: None,
        };
        let shown: Vec<f64> = best(&peers).iter().map(|setting| setting.seconds).collect();
        assert_eq!(shown, [1.0, 3.0, 9.0]);
    }
}
