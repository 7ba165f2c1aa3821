//! `rig stress`: numbers at the ends of every range.

use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use crate::progress;
use crate::stress::{hostile, plant, primitives, refine, settle};
use crate::table::plain;

/// Cases of a quick run.
const QUICK_CASES: usize = 300;

/// Every how many inputs of a primitive a quick run looks at one.
const QUICK_STRIDE: u64 = 10_007;

/// Ticks of the vibration observer.
const DRIFT_TICKS: u64 = 1_000_000_000;

/// Ticks of each hostile run.
const HOSTILE_TICKS: u32 = 20_000;

/// Plant, controller and fixed-point primitives at the ends of every range.
///
/// Every case of the plant stays finite, in radial balance, with bounded penetration and
/// without creating energy; what cannot be is refused by name before the run. Hostile codes and plans panic no
/// controller and switch no bridge on where none may be. Constant inputs come to rest to
/// the last bit, a thousand million ticks leave no drift. Every primitive is held against
/// exact arithmetic over all its inputs.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Cases of the plant, not counting those that have to be refused.
    #[arg(short = 'n', long = "cases", value_name = "CASES", default_value_t = 10_000)]
    cases: usize,

    /// Seed of the cases between the corners, and of the garbage.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// A few hundred cases, a lattice of the primitives' inputs, a million ticks.
    #[arg(long)]
    quick: bool,

    /// The fixed-point primitives alone.
    #[arg(long)]
    primitives: bool,

    /// The cases of the plant alone.
    #[arg(long, conflicts_with = "primitives")]
    plant: bool,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed {
    /// Cases of the plant that ran.
    cases: usize,
    /// Failures of all parts.
    failures: usize,
    /// The worst cases of the plant, by figure.
    worst: Vec<plant::Worst>,
    /// Everything that failed, in words.
    failed: Vec<String>,
    /// Cases of the plant refused before the run, by reason.
    refusals: std::collections::BTreeMap<&'static str, usize>,
    /// One message of each.
    refused: std::collections::BTreeMap<&'static str, String>,
    refined: Vec<refine::Line>,
    primitives: Vec<primitives::Line>,
    settling: Vec<settle::Line>,
    drift: Option<settle::Drift>,
    hostile: hostile::Report,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.cases == 0 {
        return Err(Failure::input("--cases 0: expected at least 1"));
    }
    let cases = if args.quick { args.cases.min(QUICK_CASES) } else { args.cases };
    let stride = if args.quick { QUICK_STRIDE } else { 1 };
    let primitives = if args.plant {
        Vec::new()
    } else {
        let bar = progress::bar("fixed-point inputs", primitives::inputs());
        primitives::run(stride, &|inputs| bar.advance(inputs))
    };
    let printed = if args.primitives {
        gather(
            plant::Report::default(),
            vec![],
            primitives,
            vec![],
            None,
            hostile::Report::default(),
        )
    } else {
        let report = {
            let bar = progress::bar("cases of the plant", cases as u64);
            plant::run(cases, args.seed, &|| bar.advance(1))
        };
        if args.plant {
            let rest = hostile::Report::default();
            let printed = gather(report, vec![], vec![], vec![], None, rest);
            return print(args, &printed);
        }
        let _spinner = progress::spinner("refinement, hostile inputs, rest and drift");
        let (drift_ticks, hostile_ticks) =
            if args.quick { (1_000_000, 2000) } else { (DRIFT_TICKS, HOSTILE_TICKS) };
        let (drift, rest) = rayon::join(
            || settle::drift(drift_ticks),
            || (refine::run(args.quick), settle::run(), hostile::run(hostile_ticks, args.seed)),
        );
        let (refined, settling, hostile) = rest;
        gather(report, refined, primitives, settling, Some(drift), hostile)
    };
    print(args, &printed)
}

fn print(args: &Args, printed: &Printed) -> Result<Outcome, Failure> {
    output::result(args.json, printed, || human(printed))?;
    Ok(Outcome::of(printed.failures == 0))
}

fn gather(
    report: plant::Report,
    refined: Vec<refine::Line>,
    primitives: Vec<primitives::Line>,
    settling: Vec<settle::Line>,
    drift: Option<settle::Drift>,
    hostile: hostile::Report,
) -> Printed {
    let mut failed: Vec<String> = report
        .failures
        .iter()
        .map(|failure| {
            let case = &failure.case;
            format!(
                "case {}: {}: {:.1e} Pa/m x {:.0}, {:.0e} s, step {:.0e} s, {:.0} mm/s {:?}, {:.1} mm, mu {:.2}, arm {}",
                case.index,
                failure.why,
                case.k_inf_pa_per_m,
                case.stiffening,
                case.tau_s,
                case.dt_s,
                case.speed_mm_s,
                case.course,
                case.step_mm,
                case.mu,
                case.coupling
            )
        })
        .collect();
    let refine = refined.iter().filter(|line| !line.holds);
    failed.extend(refine.map(|line| format!("{}: order {:?}", line.name, line.order)));
    let primitive = primitives.iter().filter(|line| !line.holds);
    failed.extend(
        primitive.map(|line| format!("{}: {} to {} LSB", line.name, line.least_lsb, line.most_lsb)),
    );
    let restless = settling.iter().filter(|line| !line.holds);
    failed.extend(restless.map(|line| format!("{}: not at rest after {}", line.name, line.within)));
    let drifting = drift.iter().filter(|drift| !drift.holds);
    failed.extend(drifting.map(|drift| format!("vibration observer drifts: {drift:?}")));
    let broken = hostile.broken.iter();
    failed.extend(broken.map(|b| format!("{}, {} codes: {}", b.rig, b.feed, b.why)));
    Printed {
        cases: report.cases,
        failures: failed.len(),
        worst: report.worst,
        failed,
        refusals: report.refusals,
        refused: report.refused,
        refined,
        primitives,
        settling,
        drift,
        hostile,
    }
}

fn human(printed: &Printed) -> String {
    let mut text = String::new();
    if printed.cases > 0 {
        text += &the_plant(printed);
    }
    if printed.primitives.is_empty() {
        return text + &failures(printed);
    }
    let rows = printed.primitives.iter().map(|line| {
        vec![
            line.name.to_owned(),
            line.inputs.to_string() + if line.exhaustive { ", all" } else { "" },
            format!("{:.3} to {:.3}", line.least_lsb, line.most_lsb),
            format!("{:.3} to {:.3}", line.bound_lsb.0, line.bound_lsb.1),
            format!("{:#x}", line.worst_input),
        ]
    });
    text += &format!(
        "{}\n",
        plain(&["primitive", "inputs", "error, LSB", "stated, LSB", "worst input"], rows)
    );
    if let Some(drift) = &printed.drift {
        text += &format!(
            "vibration observer: {:.4} um at first, {:.4} um after {:.0e} ticks, forgotten after {}\n",
            drift.first_um,
            drift.last_um,
            drift.ticks as f64,
            drift.forgotten_after.map_or("never".to_owned(), |ticks| format!("{ticks} ticks")),
        );
    }
    let slowest = printed.settling.iter().max_by_key(|line| line.settled_after);
    if let Some(slowest) = slowest {
        text += &format!(
            "{} stages at rest to the last bit; the slowest after {} ticks: {}\n",
            printed.settling.len(),
            slowest.settled_after,
            slowest.name
        );
    }
    if printed.hostile.rigs > 0 {
        text += &format!(
            "hostile inputs: {} rigs at the ends of their parameters ({} refused), {:.1e} ticks, {} broken\n",
            printed.hostile.rigs,
            printed.hostile.refused.len(),
            printed.hostile.ticks as f64,
            printed.hostile.broken.len()
        );
    }
    text + &failures(printed)
}

fn failures(printed: &Printed) -> String {
    let failed: String =
        printed.failed.iter().map(|failed| format!("  failed: {failed}\n")).collect();
    failed + &format!("{} failures\n", printed.failures)
}

fn the_plant(printed: &Printed) -> String {
    let rows = printed.worst.iter().map(|worst| {
        let case = &worst.case;
        vec![
            format!("{:?}", worst.figure),
            format!("{:.3}", worst.value),
            case.index.to_string(),
            format!("{:.1e} x {:.0}", case.k_inf_pa_per_m, case.stiffening),
            format!("{:.0e}, {:.0e}", case.tau_s, case.dt_s),
            format!("{:.0}", case.speed_mm_s),
            format!("{:.1}", case.step_mm),
            format!("{:.1}", case.mu),
            format!("{:.0e}", case.mass_ratio),
        ]
    });
    const HEAD: [&str; 9] = [
        "figure",
        "of limit",
        "case",
        "Pa/m",
        "tau, dt\ns",
        "speed\nmm/s",
        "step\nmm",
        "mu",
        "masses",
    ];
    let mut text = format!("{} cases of the plant\n{}\n", printed.cases, plain(&HEAD, rows));
    for (name, count) in &printed.refusals {
        let message = printed.refused.get(name).map_or("", String::as_str);
        text += &format!("  refused {count}: {name}, as: {message}\n");
    }
    if printed.refined.is_empty() {
        return text;
    }
    let shown = printed.refined.iter().filter(|line| line.shows());
    let least = shown.clone().filter_map(|line| Some(line.order? / line.stated));
    text += &format!(
        "{} refined runs, {} of them of the order stated (at least {:.2} of it), the rest without a difference left\n",
        printed.refined.len(),
        shown.count(),
        least.fold(f64::INFINITY, f64::min),
    );
    text
}
