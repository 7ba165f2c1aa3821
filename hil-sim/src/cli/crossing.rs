//! `rig crossing`: one isolated crossing at constant speed and preload.

mod methods;

use clap::ValueEnum;
use interstage::units::Direction;
use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::ScenarioArgs;
use crate::progress;
use crate::table::{number, plain};

/// Fastest crossing, mm/s.
const MAX_SPEED_MM_S: f64 = 2000.0;

/// Largest preload, N.
const MAX_PRELOAD_N: f64 = 1000.0;

/// One isolated crossing at constant speed and preload, without arm and controller.
///
/// Figures of the ring are taken over the whole crossing: the largest axial force of
/// the contact, its work, the largest tread depth, the largest friction utilisation.
/// The reduced model knows the instant at which the lower wall stops carrying (on
/// the way back: begins to) and gives force, depth and utilisation there; its work
/// is the elastic one, preload times step height, without what the rubber loses. On
/// the way back the work is negative: the step gives it back.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Axial speed, mm/s.
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    speed_mm_s: f64,

    /// Radial preload, N.
    #[arg(long, value_name = "P", allow_negative_numbers = true)]
    preload_n: f64,

    /// What computes the crossing.
    #[arg(long, value_enum, default_value_t = Method::Ring)]
    method: Method,

    /// Driven by torque against this wheel's share of the top load.
    ///
    /// Shows the friction that this takes. Without it the wheel is pushed at its axle
    /// and frictionless.
    #[arg(long)]
    driven: bool,

    /// The way back: dropping off the step.
    #[arg(long)]
    retract: bool,

    #[command(flatten)]
    scenario: ScenarioArgs,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What computes a crossing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
enum Method {
    /// Ring of tread elements with memory, f64: the converged physics.
    Ring,
    /// Reduced model, f64: closed forms in the gap.
    Reduced,
    /// Reduced model in fixed point, as the firmware runs it.
    Fixed,
}

/// A crossing to compute.
#[derive(Clone, Copy, Debug)]
struct Case {
    speed_mm_s: f64,
    preload_n: f64,
    direction: Direction,
    /// Axial load lifted by friction, N; none pushes a frictionless wheel.
    load_n: Option<f64>,
}

/// What a method gives.
#[derive(Clone, Copy, Debug, Serialize)]
struct Figures {
    gap_mm: f64,
    corner_force_n: f64,
    climb_work_mj: f64,
    embedding_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    mu_needed: Option<f64>,
    /// Stress increment of the first touch; the quasi-static ring has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    impact_stress_pa: Option<f64>,
    /// Amplitude of the arm's first mode afterwards.
    #[serde(skip_serializing_if = "Option::is_none")]
    vibration_um: Option<f64>,
    /// The gap lies beyond the reduced model, which holds its end.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    at_model_end: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    method: Method,
    rig: &'a str,
    direction: &'static str,
    speed_mm_s: f64,
    preload_n: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    load_n: Option<f64>,
    #[serde(flatten)]
    figures: Figures,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let within = |option, value, max, unit| {
        // Written so that a NaN fails.
        if value > 0.0 && value <= max {
            return Ok(());
        }
        Err(Failure::input(format!(
            "{option} {value}: expected a value above 0, at most {max} {unit}"
        )))
    };
    within("--speed-mm-s", args.speed_mm_s, MAX_SPEED_MM_S, "mm/s")?;
    within("--preload-n", args.preload_n, MAX_PRELOAD_N, "N")?;
    let scenario = args.scenario.resolve()?;
    let loads = &scenario.rig.plant;
    let case = Case {
        speed_mm_s: args.speed_mm_s,
        preload_n: args.preload_n,
        direction: if args.retract { Direction::Retract } else { Direction::Deploy },
        load_n: args.driven.then_some(loads.top_load_n * loads.top_load_share),
    };
    let figures = {
        let _progress = progress::spinner("crossing");
        match args.method {
            Method::Ring => methods::ring(&scenario.rig, &case)?,
            Method::Reduced => methods::reduced(&scenario.rig, &case)?,
            Method::Fixed => methods::fixed(&scenario.rig, &case)?,
        }
    };
    let printed = Printed {
        method: args.method,
        rig: &scenario.preset,
        direction: if args.retract { "retract" } else { "deploy" },
        speed_mm_s: case.speed_mm_s,
        preload_n: case.preload_n,
        load_n: case.load_n,
        figures,
    };
    output::result(args.json, &printed, || human(&printed))?;
    Ok(Outcome::Good)
}

fn human(printed: &Printed<'_>) -> String {
    let method = match printed.method {
        Method::Ring => "ring",
        Method::Reduced => "reduced model",
        Method::Fixed => "reduced model in fixed point",
    };
    let driven = printed
        .load_n
        .map_or("frictionless".to_owned(), |load| format!("driven against {load:.2} N"));
    let figures = &printed.figures;
    let mut rows = vec![
        ("gap", number(figures.gap_mm, 3), "mm"),
        ("corner force", number(figures.corner_force_n, 2), "N"),
        ("work of the climb", number(figures.climb_work_mj, 1), "mJ"),
        ("embedding", number(figures.embedding_mm, 3), "mm"),
    ];
    if let Some(mu) = figures.mu_needed {
        // Hardly pressed, it slides whatever the friction.
        let mu = if mu < 100.0 { number(mu, 3) } else { "> 100".to_owned() };
        rows.push(("friction needed", mu, ""));
    }
    if let Some(stress) = figures.impact_stress_pa {
        rows.push(("impact stress", number(stress, 0), "Pa"));
    }
    if let Some(vibration) = figures.vibration_um {
        rows.push(("vibration of the arm", number(vibration, 2), "um"));
    }
    let note = if figures.at_model_end {
        "the gap lies beyond the reduced model, which holds its end\n"
    } else {
        ""
    };
    let rows = rows.into_iter().map(|(name, value, unit)| vec![name.into(), value, unit.into()]);
    format!(
        "{} at {} mm/s under {} N, {driven}, rig {}, by the {method}\n{}\n{note}",
        if printed.direction == "retract" { "Way back" } else { "Climb" },
        printed.speed_mm_s,
        printed.preload_n,
        printed.rig,
        plain(&["", "value", "unit"], rows)
    )
}
