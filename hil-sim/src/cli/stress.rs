//! `rig stress`: the plant at the ends of its ranges.

use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::seed;
use crate::progress;
use crate::stress::{self, StressReport};
use crate::table::plain;

/// The plant at the ends of every range.
///
/// Every case stays finite, in radial balance, with bounded penetration and without
/// creating energy. Impossible combinations are refused by name before the run.
/// The ten thousand cases of the default take less than a minute.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Cases, without those that must be refused.
    #[arg(short = 'n', long = "cases", value_name = "CASES", default_value_t = 10_000,
          allow_negative_numbers = true,
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    cases: u64,

    /// Seed of the cases between the corners.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true,
          value_parser = seed)]
    seed: u64,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    report: &'a StressReport,
    /// Number of failures.
    failures: usize,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let report = {
        let bar = progress::bar("cases of the plant", args.cases);
        stress::run(args.cases as usize, args.seed, &|| bar.advance(1))
    };
    let printed = Printed { report: &report, failures: report.failed.len() };
    output::result(args.json, &printed, || human(&report))?;
    Ok(Outcome::of(report.failed.is_empty()))
}

fn human(report: &StressReport) -> String {
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
    let rows = report.worst.iter().map(|worst| {
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
    let mut text = format!("{} cases of the plant\n{}\n", report.cases, plain(&HEAD, rows));
    for (name, refused) in &report.refused {
        text += &format!("  refused {}: {name}, as: {}\n", refused.count, refused.example);
    }
    for failure in &report.failed {
        text += &format!("  failed: {}: {:?}\n", failure.why, failure.case);
    }
    text + &format!("{} failures\n", report.failed.len())
}
