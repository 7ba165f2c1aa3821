//! `rig crossing`: one isolated crossing, at constant speed and preload or along a course.

use std::path::PathBuf;

use clap::ValueEnum;
use interstage::rig::Rig;
use interstage::units::Direction;
use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::ScenarioArgs;
use crate::plant::balance::Axial;
use crate::plant::crossing::{Course, MAX_PRELOAD_N, MAX_SPEED_MM_S};
use crate::plant::crossing::{CrossingCase, cross_along};
use crate::plant::ring::RingParameters;
use crate::progress;
use crate::rollout::{CrossingSetup, Wheel};
use crate::scenario::Scenario;
use crate::table::{number, plain};

/// Elements of the ring and stride, mm: the gap is within 0.1 % of that at half the stride
/// and twice the elements.
const FINENESS: (usize, f64) = (5760, 0.005);
/// The same where elements are coupled.
const FINENESS_COUPLED: (usize, f64) = (1440, 0.02);

/// One isolated crossing, at constant speed and preload or along a course, without arm and controller.
///
/// Figures of the ring are taken over the complete crossing: the largest axial force of
/// the contact, its work, the largest tread compression, the largest friction utilisation.
/// In fixed point the compression is that at the instant at which the lower wall stops carrying
/// (on retract: begins to), and the work is the elastic one, preload times step height, without
/// the rubber's losses; on retract it is negative.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Axial speed, mm/s.
    #[arg(
        long,
        value_name = "V",
        allow_negative_numbers = true,
        required_unless_present = "course"
    )]
    speed_mm_s: Option<f64>,

    /// Radial preload, N.
    #[arg(
        long,
        value_name = "P",
        allow_negative_numbers = true,
        required_unless_present = "course"
    )]
    preload_n: Option<f64>,

    /// Speed and preload over the place, in place of constant ones: CSV with the columns `x_mm` (of
    /// the axle from the face outwards, in the order of the run), `speed_mm_s`, `preload_n`.
    ///
    /// Straight lines between the rows; the first holds before it, the last behind it.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["speed_mm_s", "preload_n"])]
    course: Option<PathBuf>,

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
    course: Option<&Course>,
    method: Method,
    scenario: &Scenario,
) -> Result<Figures, Failure> {
    let at = |x_mm: f64| course.map_or((case.speed_mm_s, case.preload_n), |course| course.at(x_mm));
    match method {
        Method::Ring => ring(scenario, case, &at),
        Method::Fixed => fixed(&scenario.rig, case, &at),
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
    #[serde(skip_serializing_if = "Option::is_none")]
    speed_mm_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    preload_n: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    course: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    load_n: Option<f64>,
    #[serde(flatten)]
    figures: Figures,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let read = |path: &PathBuf| Course::read(path, args.retract).map_err(Failure::input);
    let course = args.course.as_ref().map(read).transpose()?;
    let start = course.as_ref().map(Course::start);
    let mut case = CrossingSetup {
        speed_mm_s: start.map(|start| start.0).or(args.speed_mm_s).unwrap_or_default(),
        preload_n: start.map(|start| start.1).or(args.preload_n).unwrap_or_default(),
        direction: if args.retract { Direction::Retract } else { Direction::Deploy },
        load_n: None,
    };
    check(&case, ["--speed-mm-s", "--preload-n"])?;
    let scenario = args.scenario.resolve()?;
    let loads = &scenario.rig.plant;
    case.load_n = args.driven.then_some(loads.top_load_n * loads.top_load_share);
    let figures = {
        let _progress = progress::spinner("crossing");
        compute(&case, course.as_ref(), args.method, &scenario)?
    };
    let printed = Printed {
        method: args.method,
        rig: &scenario.preset,
        direction: if args.retract { "retract" } else { "deploy" },
        speed_mm_s: args.speed_mm_s,
        preload_n: args.preload_n,
        course: args.course.as_ref().map(|path| path.display().to_string()),
        load_n: case.load_n,
        figures,
    };
    output::result(args.json, &printed, || human(&printed, &case))?;
    Ok(Outcome::Good)
}

fn human(printed: &Printed<'_>, case: &CrossingSetup) -> String {
    let method = match printed.method {
        Method::Ring => "ring",
        Method::Fixed => "tread rolled out in fixed point",
    };
    let figures = &printed.figures;
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
    let moved = match &printed.course {
        Some(course) => format!("along {course}"),
        None => format!("at {} mm/s under {} N", case.speed_mm_s, case.preload_n),
    };
    format!(
        "{} {moved}, {driven}, rig {}, by the {method}\n{}\n",
        if case.direction == Direction::Retract { "Drop" } else { "Climb" },
        printed.rig,
        plain(&["", "value", "unit"], rows)
    )
}

/// The ring with memory, as the plant has it.
fn ring(
    scenario: &Scenario,
    case: &CrossingSetup,
    course: &dyn Fn(f64) -> (f64, f64),
) -> Result<Figures, Failure> {
    let (rig, mismatch) = (&scenario.rig, &scenario.mismatch);
    let driven = case.load_n.is_some();
    let coupled = mismatch.tread_thickness > 0.0;
    let (elements, stride_mm) = if coupled { FINENESS_COUPLED } else { FINENESS };
    let case = CrossingCase {
        ring: RingParameters::of(rig, elements).with_mismatch(mismatch),
        step_height_mm: rig.rig.step_height_mm,
        speed_mm_s: case.speed_mm_s * f64::from(case.direction.sign()),
        preload_n: case.preload_n,
        axial: case.load_n.map_or(Axial::Pushed, Axial::Driven),
        stride_mm,
    };
    let result = cross_along(&case, course)?;
    if result.lift == (0.0, 0.0) {
        return Err(no_gap());
    }
    Ok(Figures {
        gap_mm: result.gap_mm,
        corner_force_n: result.corner_force_n,
        climb_work_mj: result.climb_work_mj,
        embedding_mm: result.embedding_mm,
        mu_needed: driven.then_some(result.mu_needed),
    })
}

/// The tread rolled out as the firmware has it.
fn fixed(
    rig: &Rig,
    case: &CrossingSetup,
    course: &dyn Fn(f64) -> (f64, f64),
) -> Result<Figures, Failure> {
    let crossed = Wheel::try_build(rig)?.cross_along(case, course).ok_or_else(no_gap)?;
    Ok(Figures {
        gap_mm: crossed.gap_mm,
        corner_force_n: crossed.corner_force_n,
        climb_work_mj: f64::from(case.direction.sign())
            * course(-crossed.ahead_mm).1
            * rig.rig.step_height_mm,
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
