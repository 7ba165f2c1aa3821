//! `rig crossing`: one isolated crossing at constant speed and preload.

use clap::ValueEnum;
use interstage::rig::Rig;
use interstage::units::Direction;
use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::ScenarioArgs;
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::mismatch::Mismatch;
use crate::plant::ring::RingParameters;
use crate::progress;
use crate::rollout::{CrossingSetup, Wheel};
use crate::scenario::Scenario;
use crate::table::{number, plain};

/// Fastest crossing, mm/s.
const MAX_SPEED_MM_S: f64 = 2000.0;
/// Largest preload, N.
const MAX_PRELOAD_N: f64 = 1000.0;
/// Elements of the ring and stride, mm: the gap is within 0.1 % of that at half the stride
/// and twice the elements.
const FINENESS: (usize, f64) = (5760, 0.005);
/// The same where elements are coupled: the gap is within 0.1 % of that at half the stride and
/// twice the elements.
const FINENESS_COUPLED: (usize, f64) = (1440, 0.02);

/// One isolated crossing at constant speed and preload, without arm and controller.
///
/// Figures of the ring are taken over the complete crossing: the largest axial force of
/// the contact, its work, the largest tread compression, the largest friction utilisation.
/// In fixed point the compression is that at the instant at which the lower wall stops carrying
/// (on retract: begins to), and the work is the elastic one, preload times step height, without
/// the rubber's losses; on retract it is negative.
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

    /// Retracts: drops off the step.
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
pub(super) enum Method {
    /// Ring of tread elements with memory, f64: the converged physics.
    Ring,
    /// The tread rolled out in fixed point, as the firmware plans with it.
    Fixed,
    /// Refused: it is gone.
    #[value(hide = true)]
    Reduced,
}

/// Refuses a speed or preload out of range, by the names that they were given with.
pub(super) fn check(case: &CrossingSetup, [speed, preload]: [&str; 2]) -> Result<(), Failure> {
    for (option, value, max, unit) in [
        (speed, case.speed_mm_s, MAX_SPEED_MM_S, "mm/s"),
        (preload, case.preload_n, MAX_PRELOAD_N, "N"),
    ] {
        // A NaN fails too.
        if !(value > 0.0 && value <= max) {
            return Err(Failure::input(format!(
                "{option} {value}: expected a value above 0, at most {max} {unit}"
            )));
        }
    }
    Ok(())
}

/// The figures by this method.
pub(super) fn compute(
    case: &CrossingSetup,
    method: Method,
    scenario: &Scenario,
) -> Result<Figures, Failure> {
    match method {
        Method::Ring => ring(&scenario.rig, &scenario.mismatch, case),
        Method::Fixed => fixed(&scenario.rig, case),
        Method::Reduced => Err(Failure::input(
            "--method reduced: the reduced model is gone, expected ring or fixed",
        )),
    }
}

/// What a method gives.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Figures {
    pub(super) gap_mm: f64,
    pub(super) corner_force_n: f64,
    pub(super) climb_work_mj: f64,
    pub(super) embedding_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) mu_needed: Option<f64>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    method: Method,
    rig: &'a str,
    direction: &'static str,
    #[serde(flatten)]
    case: CrossingSetup,
    #[serde(flatten)]
    figures: Figures,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut case = CrossingSetup {
        speed_mm_s: args.speed_mm_s,
        preload_n: args.preload_n,
        direction: if args.retract { Direction::Retract } else { Direction::Deploy },
        load_n: None,
    };
    check(&case, ["--speed-mm-s", "--preload-n"])?;
    let scenario = args.scenario.resolve()?;
    let loads = &scenario.rig.plant;
    case.load_n = args.driven.then_some(loads.top_load_n * loads.top_load_share);
    let figures = {
        let _progress = progress::spinner("crossing");
        compute(&case, args.method, &scenario)?
    };
    let printed = Printed {
        method: args.method,
        rig: &scenario.preset,
        direction: if args.retract { "retract" } else { "deploy" },
        case,
        figures,
    };
    output::result(args.json, &printed, || human(&printed))?;
    Ok(Outcome::Good)
}

fn human(printed: &Printed<'_>) -> String {
    let method = match printed.method {
        Method::Ring => "ring",
        Method::Fixed | Method::Reduced => "tread rolled out in fixed point",
    };
    let (case, figures) = (&printed.case, &printed.figures);
    let driven =
        case.load_n.map_or("frictionless".to_owned(), |load| format!("driven against {load:.2} N"));
    // Hardly pressed, it slides at any friction.
    let mu = |mu| if mu < 100.0 { number(mu, 3) } else { "> 100".to_owned() };
    let rows = [
        ("gap", Some(number(figures.gap_mm, 3)), "mm"),
        ("corner force", Some(number(figures.corner_force_n, 2)), "N"),
        ("work of the climb", Some(number(figures.climb_work_mj, 1)), "mJ"),
        ("embedding", Some(number(figures.embedding_mm, 3)), "mm"),
        ("friction needed", figures.mu_needed.map(mu), ""),
    ];
    let rows = rows
        .into_iter()
        .filter_map(|(name, value, unit)| Some(vec![name.into(), value?, unit.into()]));
    format!(
        "{} at {} mm/s under {} N, {driven}, rig {}, by the {method}\n{}\n",
        if case.direction == Direction::Retract { "Drop" } else { "Climb" },
        case.speed_mm_s,
        case.preload_n,
        printed.rig,
        plain(&["", "value", "unit"], rows)
    )
}

/// The ring with memory, as the plant has it.
fn ring(rig: &Rig, mismatch: &Mismatch, case: &CrossingSetup) -> Result<Figures, Failure> {
    let coupled = mismatch.tread_thickness_mm > 0.0;
    let (elements, stride_mm) = if coupled { FINENESS_COUPLED } else { FINENESS };
    let result = cross(&CrossingCase {
        ring: RingParameters::of(rig, elements).with_mismatch(mismatch),
        step_height_mm: rig.rig.step_height_mm,
        speed_mm_s: case.speed_mm_s * f64::from(case.direction.sign()),
        preload_n: case.preload_n,
        axial: case.load_n.map_or(Axial::Pushed, Axial::Driven),
        stride_mm,
    })?;
    if result.lift == (0.0, 0.0) {
        return Err(no_gap());
    }
    Ok(Figures {
        gap_mm: result.gap_mm,
        corner_force_n: result.corner_force_n,
        climb_work_mj: result.climb_work_mj,
        embedding_mm: result.embedding_mm,
        mu_needed: case.load_n.map(|_| result.mu_needed),
    })
}

/// The tread rolled out as the firmware has it.
fn fixed(rig: &Rig, case: &CrossingSetup) -> Result<Figures, Failure> {
    let crossed = Wheel::try_build(rig)?.cross(case).ok_or_else(no_gap)?;
    Ok(Figures {
        gap_mm: crossed.gap_mm,
        corner_force_n: crossed.corner_force_n,
        climb_work_mj: f64::from(case.direction.sign()) * case.preload_n * rig.rig.step_height_mm,
        embedding_mm: crossed.depth_mm,
        mu_needed: case.load_n.map(|_| crossed.utilisation),
    })
}

fn no_gap() -> Failure {
    Failure::run(
        "the wheel sinks in so far that the lower wall carries until the step is under its \
         centre: this crossing has no gap",
    )
}
