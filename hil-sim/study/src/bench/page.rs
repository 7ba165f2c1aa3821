//! What was measured, as tables and as the page `docs/PERFORMANCE.md` with its plots.

use std::fmt::Write as _;

use super::arithmetic::{Course, Variant};
use super::chart::{Bars, Chart, Series};
use super::peers::{Peers, RING, Setting};
use super::run::Costs;
use super::skipping::Firmware;
use super::{Plant, Report};
use hil_sim::plant::precision::Point;
use hil_sim::session::plant_profile::PlantProfile;
use hil_sim::table::plain;

/// The tables of a report, for the terminal.
#[must_use]
pub fn tables(report: &Report) -> String {
    let mut text = format!("{}\n", arithmetics(report));
    if let Some(account) = &report.account {
        text += &format!("{}\n", firmware(account));
    }
    text += &settings(&report.plant);
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
        ("performance/plant-phases.svg".to_owned(), phases_bars(&report.plant.costs).svg()),
        ("performance/arithmetic-cycles.svg".to_owned(), cycles_chart(&report.variants).svg()),
        ("performance/arithmetic-host.svg".to_owned(), host_chart(&report.variants).svg()),
    ];
    if let Some(account) = &report.account {
        files.push(("performance/tick-stages.svg".to_owned(), stages_bars(account).svg()));
    }
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
        "The reduced model: five arithmetics",
        "The same polynomials in five arithmetics: speed and force to everything of a \
         crossing, and speed and gap to force, on the points of a Sobol sequence over speed \
         (1 to 100 mm/s), force (15 to 150 N) and way, for both presets and steps of 2 to \
         6 mm. Errors are those of the gap (of the force for the inverse) against the \
         formulas of [`formula.rs`](../src/model/formula.rs) solved to convergence in f64, \
         relative to the gap or 0.1 mm, whichever is larger: an answer has a resolution of \
         15 nm, and its rounding alone is 7.6e-5 of that. How far the formulas are from the \
         ring is stated beside them. Cycles are \
         [textbook Cortex-M4 cycles](EMULATION.md) of an image built like the firmware, its \
         answers checked against the host's. Each is tuned: the shipping model has its formats \
         chosen number by number; the others find the cells of their guess by exponent and \
         mantissa, with polynomials unrolled, the format of the `fixed` crate with the least \
         error, micromath's root brought to all bits by two of Heron's steps.\n\n\
         ![Error against cycles](performance/arithmetic-cycles.svg)\n\n\
         ![Error against time on the host](performance/arithmetic-host.svg)",
        &arithmetics(report),
    );
    if let Some(account) = &report.account {
        section(
            "The control tick: stages by phase",
            "Textbook Cortex-M4 cycles of the tick over a deployment and a retraction of the \
             prototype, each tick with the same output on host and core. What is inlined counts \
             where its source is; *primitives* are the square roots, tables and products that \
             all stages use. What a phase does not need is not run: outputs are the same to the \
             bit with and without, by test.\n\n\
             ![Cycles of the tick by phase and stage](performance/tick-stages.svg)",
            &firmware(account),
        );
    }
    section(
        "The plant: resolution",
        &format!(
            "Gap and largest axial force of twelve crossings (three speeds and preloads; pushed \
             and driven; out and back) against the ring at {} times the default's resolution \
             in elements and in stride. The error is that of the worst crossing, the time that \
             of the mean one.\n\n\
             ![Error of gap and force against the time of a crossing](performance/plant.svg)",
            report.plant.finer
        ),
        &settings(&report.plant),
    );
    section(
        "The plant: whole runs",
        "A deployment that cruises at 8 mm/s, about the study's ten seconds. The plant alone \
         repeats the bridge commands of the closed-loop run. On the smooth wall the steady \
         solution stands in for the ring, which is woken before a step; elements out \
         of reach are not visited. The bars show what each saves.\n\n\
         ![Time of the plant by phase](performance/plant-phases.svg)",
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
    section(
        "Bounds",
        "An aim fails nothing: the machine decides, or it is not reached yet.",
        &budgets(report),
    );
    page
}

fn arithmetics(report: &Report) -> String {
    let cost = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.0}"));
    let row = |name: String, course: &Course, front: &str| {
        vec![
            name,
            format!("{:.1e}", course.max_rel_error),
            format!("{:.1e}", course.rms_rel_error),
            cost(course.cycles.map(|cycles| cycles as f64)),
            cost(course.mean_cycles),
            format!("{:.1}", course.host_ns),
            front.to_owned(),
        ]
    };
    let forwards = report.variants.iter().map(|variant| {
        let front = if variant.on_front { "yes" } else { "" };
        row(variant.name.to_owned(), &variant.forward, front)
    });
    let back = report.variants.iter().map(|v| row(format!("{}, inverse", v.name), &v.inverse, ""));
    let head = [
        "reduced model",
        "max error",
        "RMS error",
        "cycles\nat worst",
        "cycles\nmean",
        "host ns",
        "on the\nfront",
    ];
    let how = &report.arithmetics;
    let ring = &how.ring;
    let mut text = format!(
        "Reduced model in five arithmetics, {} points ({} more lie beyond the model or what friction lifts)\n\
         {}\nThe model itself against {} crossings of the ring: gap within {} %, RMS {} %, at most \
         {} mm;\nin the shipping arithmetic within {} %\n",
        how.points,
        how.beyond,
        plain(&head, forwards.chain(back)),
        ring.crossings,
        percent(ring.max_rel_error),
        percent(ring.rms_rel_error),
        short(ring.max_error_mm),
        percent(ring.shipping_max_rel_error),
    );
    if let Some(why) = &how.cycles_left_out {
        let _ = writeln!(text, "cycles left out: {why}");
    }
    text
}

fn firmware(account: &Firmware) -> String {
    let head = [
        "phase", "ticks", "mean", "whole", "most", "senses", "contact", "super", "plan", "tick",
        "prims",
    ];
    let rows = account.phases.iter().map(|phase| {
        let [senses, odometry, vibration, supervision, schedule, loops, tick, primitives] =
            phase.stages;
        let shares =
            [senses, odometry + vibration, supervision, schedule + loops, tick, primitives];
        let start = [
            phase.phase.clone(),
            phase.ticks.to_string(),
            format!("{:.0}", phase.mean),
            format!("{:.0}", phase.mean_whole),
            phase.most.to_string(),
        ];
        let shares = shares.map(|cycles| format!("{:.0}", 100.0 * cycles / phase.mean));
        start.into_iter().chain(shares).collect()
    });
    format!(
        "Control tick by phase: textbook cycles; % of them in senses, odometry and contact with \
         the\nvibration observer, supervision, schedule and loops, the tick itself with its \
         telemetry, and\nprimitives\n{}\n\
         mean {:.0}, at worst {}; on the smooth wall at worst {}; a plan between ticks at worst {}\n\
         skipping: whole is the mean with every stage run in every tick: {:.0} over all; on the \
         smooth\nwall skipping saves {} %\n",
        plain(&head, rows),
        account.mean,
        account.most,
        account.smooth_most(),
        account.plan_most,
        account.mean_whole,
        percent(account.smooth_saving()),
    )
}

fn stages_bars(account: &Firmware) -> Bars {
    Bars {
        title: "Control tick: mean cycles by phase and stage".to_owned(),
        x_name: "textbook Cortex-M4 cycles",
        kinds: account.stages.iter().map(|&stage| stage.to_owned()).collect(),
        rows: account.phases.iter().map(|p| (p.phase.clone(), p.stages.to_vec())).collect(),
    }
}

fn settings(plant: &Plant) -> String {
    let usual = plant.usual();
    let rows = plant.settings.iter().map(|point| {
        let mark = if usual == Some(point) { " (default)" } else { "" };
        vec![
            format!("{}{mark}", point.elements),
            format!("{}", point.stride_mm),
            percent(point.gap_error),
            percent(point.force_error),
            short(1e-6 * point.wall_ns),
        ]
    });
    let head = ["elements", "stride mm", "gap error %", "force error %", "crossing ms"];
    format!("Plant: error against cost of a crossing\n{}\n", plain(&head, rows))
}

fn runs(plant: &Plant) -> String {
    let costs = &plant.costs;
    let phases = costs.account.phases.iter().map(|phase| {
        vec![
            phase.name.to_owned(),
            short(phase.simulated_s),
            short(1e3 * phase.wall_s),
            percent(phase.wall_s / costs.account.plant_wall_s),
            phase.cost().map_or_else(|| "-".to_owned(), |cost| short(1e3 * cost)),
            phase.ring_strides.to_string(),
            phase.newton_iterations.to_string(),
            phase.elements.to_string(),
            phase.steady_computed.to_string(),
        ]
    });
    let head = [
        "phase of the plant",
        "simulated\ns",
        "ms",
        "% of\nthe time",
        "ms per\nsecond",
        "ring\nsteps",
        "heights\ntried",
        "elements\nvisited",
        "steady\ncontacts",
    ];
    let over = costs.crossing_over_smooth.map_or_else(|| "-".to_owned(), short);
    format!(
        "Plant: a deployment of {} s, one core\n{}\n\
         plant alone {} times real time; controller, sensors and plant {} times\n\
         a second of a crossing costs {over} times one on the smooth wall\n\
         skipping: with the ring always resolved and all its elements visited the plant takes {} \
         times\nas long and visits {} times as many\n",
        short(costs.account.simulated_s),
        plain(&head, phases),
        short(costs.plant_real_time_factor),
        short(costs.run_real_time_factor),
        short(costs.saving),
        short(costs.saving_of_elements),
    )
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
    let mut best: Vec<&Setting> =
        peers.settings.iter().filter(|setting| !beaten(setting)).collect();
    let place = |name: &str| peers.settings.iter().position(|setting| setting.name == name);
    best.sort_by(|a, b| place(&a.name).cmp(&place(&b.name)).then(a.seconds.total_cmp(&b.seconds)));
    best
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
        let verdict = match (line.holds, line.aim) {
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

/// From root mean square to largest error of each arithmetic, above its cost.
fn variants_chart(
    variants: &[Variant],
    (title, x_name): (&str, &'static str),
    cost: impl Fn(&Course) -> Option<f64>,
) -> Chart {
    let series = variants.iter().map(|variant| {
        let course = &variant.forward;
        let at = cost(course).unwrap_or(f64::NAN);
        let points = vec![(at, course.rms_rel_error), (at, course.max_rel_error)];
        Series { name: variant.name.to_owned(), points }
    });
    let shipping = variants.first().and_then(|variant| {
        Some(("shipped", (cost(&variant.forward)?, variant.forward.max_rel_error)))
    });
    Chart {
        title: title.to_owned(),
        x_name,
        y_name: "relative error of the gap, RMS and largest",
        series: series.collect(),
        ringed: shipping,
        bound: Some(("allowed", 1e-4)),
    }
}

fn cycles_chart(variants: &[Variant]) -> Chart {
    let names = (
        "Reduced model, speed and force to a crossing: error against cycles",
        "textbook Cortex-M4 cycles at worst",
    );
    variants_chart(variants, names, |course| course.cycles.map(|cycles| cycles as f64))
}

fn host_chart(variants: &[Variant]) -> Chart {
    let names = (
        "Reduced model, speed and force to a crossing: error against time on this host",
        "processor time of a call, ns",
    );
    variants_chart(variants, names, |course| Some(course.host_ns))
}

fn plant_chart(plant: &Plant) -> Chart {
    let mut series: Vec<Series> = Vec::new();
    let mut counts: Vec<usize> = plant.settings.iter().map(|point| point.elements).collect();
    counts.dedup();
    for (what, error) in
        [("gap", (|p| p.gap_error) as fn(&Point) -> f64), ("force", |p| p.force_error)]
    {
        for &count in &counts {
            let points = plant.settings.iter().filter(|point| point.elements == count);
            let points = points.map(|p| (1e-6 * p.wall_ns, 100.0 * error(p))).collect();
            series.push(Series { name: format!("{what}, {count} elements"), points });
        }
    }
    Chart {
        title: "Ring: error against the time of a crossing, by elements and stride".to_owned(),
        x_name: "time of a crossing, ms",
        y_name: "largest relative error, %",
        series,
        ringed: plant.usual().map(|p| ("default", (1e-6 * p.wall_ns, 100.0 * p.gap_error))),
        bound: Some(("allowed for the gap", 0.5)),
    }
}

fn phases_bars(costs: &Costs) -> Bars {
    let row = |name: &str, account: &PlantProfile| {
        (name.to_owned(), account.phases.iter().map(|phase| 1e3 * phase.wall_s).collect())
    };
    Bars {
        title: "The plant over a deployment at 8 mm/s: time by phase".to_owned(),
        x_name: "ms",
        kinds: costs.account.phases.iter().map(|phase| phase.name.to_owned()).collect(),
        rows: vec![
            row("as run", &costs.account),
            row("ring always resolved", &costs.always_awake),
            row("and all elements visited", &costs.nothing_skipped),
        ],
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
    for series in &mut series {
        series.points.sort_by(|a, b| a.0.total_cmp(&b.0));
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
#[must_use]
pub fn short(value: f64) -> String {
    if !value.is_finite() {
        return "-".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let decimals = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
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
