//! `rig crossing`: one isolated crossing at constant speed and preload, or over a course of both.

use std::path::PathBuf;

use clap::ValueEnum;
use interstage::model::effective_stiffness::Kind;
use interstage::model::formula::{Formula, LEAST_RUN};
use interstage::model::rollout::{Run, roll_watched};
use interstage::model::tread::{self, Tread, TreadState};
use interstage::rig::Rig;
use interstage::units::{Direction, Q16};
use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::ScenarioArgs;
use crate::course::{Course, MAX_PRELOAD_N, MAX_SPEED_MM_S, Row};
use crate::fit_range::{Asked, FitRange};
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross_course, span_mm};
use crate::plant::mismatch::Mismatch;
use crate::plant::ring::RingParameters;
use crate::progress;
use crate::scenario::Scenario;
use crate::table::{number, plain};

/// Elements of the ring and stride, mm: the gap is within 0.1 % of that at half the stride
/// and twice the elements.
const FINENESS: (usize, f64) = (5760, 0.005);
/// The same where elements are coupled: the gap is within 0.1 % of that at half the stride and
/// twice the elements.
const FINENESS_COUPLED: (usize, f64) = (1440, 0.02);
/// Gap from an end of the model within which it is at that end, mm.
const NEAR_END_MM: f64 = 1e-7;

/// One isolated crossing at constant speed and preload, or over a course of both, without arm and
/// controller.
///
/// Figures of ring and fixed point are taken over the complete crossing: the largest axial force of
/// the contact, its work, the largest tread compression, the largest friction utilisation.
/// The reduced model gives force, compression and utilisation at the instant at which the
/// lower wall stops carrying (on retract: begins to). Its work is the elastic one, preload
/// times step height, without the rubber's losses; on retract it is negative.
///
/// Fixed point and the reduced model are checked against the ring from 1 to 100 mm/s, 15 to 150 N,
/// steps of 2 to 6 mm, loads up to 20 N and friction up to 1.5 on the published wheel, and at the
/// same paces, pressures and shapes on any other. Beyond that the answer says so: `in_range` is
/// false.
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

    /// Speed and preload by position instead: a CSV file.
    ///
    /// Its columns are `x_mm`, the axle's position from the step's face, negative before it,
    /// `speed_mm_s` and `preload_n`. The first row holds before it, the last after it; between two
    /// rows both are linear.
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
    /// Reduced model, f64: closed forms in the gap.
    Reduced,
    /// Rolled-out tread in fixed point, as the firmware runs it.
    Fixed,
}

/// A crossing to compute.
#[derive(Clone, Debug)]
pub(super) struct CrossingSetup {
    pub(super) course: Course,
    pub(super) direction: Direction,
    /// Axial load lifted by friction, N; none pushes a frictionless wheel.
    pub(super) load_n: Option<f64>,
}

/// A course at constant speed and preload; refuses what is out of range, by the names that they
/// were given with.
pub(super) fn constant(
    [speed, preload]: [&str; 2],
    speed_mm_s: f64,
    preload_n: f64,
) -> Result<Course, Failure> {
    for (option, value, max, unit) in
        [(speed, speed_mm_s, MAX_SPEED_MM_S, "mm/s"), (preload, preload_n, MAX_PRELOAD_N, "N")]
    {
        // A NaN fails too.
        if !(value > 0.0 && value <= max) {
            return Err(Failure::input(format!(
                "{option} {value}: expected a value above 0, at most {max} {unit}"
            )));
        }
    }
    Ok(Course::constant(speed_mm_s, preload_n))
}

impl CrossingSetup {
    /// The figures by this method, and what of them is out of its range.
    pub(super) fn compute(
        &self,
        method: Method,
        scenario: &Scenario,
    ) -> Result<(Figures, Vec<String>), Failure> {
        let rig = &scenario.rig;
        let figures = match (method, self.course.rows()) {
            (Method::Ring, _) => return Ok((ring(rig, &scenario.mismatch, self)?, Vec::new())),
            (Method::Reduced, [row]) => reduced(rig, self, row),
            (Method::Reduced, _) => {
                return Err(Failure::input(
                    "--course: the reduced model knows one speed and preload: expected --method \
                     ring or fixed",
                ));
            }
            (Method::Fixed, _) => fixed(rig, self)?,
        };
        Ok((figures, outside(rig, self, &figures)))
    }

    /// The plant's crossing on a ring of this many elements, in strides of this length.
    fn case(&self, rig: &Rig, (elements, stride_mm): (usize, f64)) -> CrossingCase {
        let (speed, preload_n) = self.course.at(self.begins_at());
        CrossingCase {
            ring: RingParameters::of(rig, elements),
            step_height_mm: rig.rig.step_height_mm,
            speed_mm_s: speed * f64::from(self.direction.sign()),
            preload_n,
            axial: self.load_n.map_or(Axial::Pushed, Axial::Driven),
            stride_mm,
        }
    }

    /// From where the course begins.
    fn begins_at(&self) -> f64 {
        f64::NEG_INFINITY * f64::from(self.direction.sign())
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
    /// Stress increment of the first touch; the quasi-static ring has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    impact_stress_pa: Option<f64>,
    /// Amplitude of the arm's first mode afterwards.
    #[serde(skip_serializing_if = "Option::is_none")]
    vibration_um: Option<f64>,
    /// The reduced model holds its end: the gap is not that of this crossing.
    #[serde(skip)]
    at_model_end: bool,
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
    /// Whether the method is known to hold here: the ring always, the others where they are
    /// checked against it.
    in_range: bool,
    /// What is out of range.
    #[serde(skip)]
    outside: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let course = match &args.course {
        Some(path) => Course::read(path)
            .map_err(|error| Failure::input(format!("{}: {error}", path.display())))?,
        None => constant(
            ["--speed-mm-s", "--preload-n"],
            args.speed_mm_s.unwrap_or_default(),
            args.preload_n.unwrap_or_default(),
        )?,
    };
    let scenario = args.scenario.resolve()?;
    let loads = &scenario.rig.plant;
    let setup = CrossingSetup {
        course,
        direction: if args.retract { Direction::Retract } else { Direction::Deploy },
        load_n: args.driven.then_some(loads.top_load_n * loads.top_load_share),
    };
    let (figures, outside) = {
        let _progress = progress::spinner("crossing");
        setup.compute(args.method, &scenario)?
    };
    let printed = Printed {
        in_range: outside.is_empty(),
        outside,
        method: args.method,
        rig: &scenario.preset,
        direction: if args.retract { "retract" } else { "deploy" },
        speed_mm_s: args.speed_mm_s,
        preload_n: args.preload_n,
        course: args.course.as_ref().map(|path| path.display().to_string()),
        load_n: setup.load_n,
        figures,
    };
    output::result(args.json, &printed, || human(&printed))?;
    Ok(Outcome::Good)
}

fn human(printed: &Printed<'_>) -> String {
    let method = match printed.method {
        Method::Ring => "ring",
        Method::Reduced => "reduced model",
        Method::Fixed => "rolled-out tread in fixed point",
    };
    let figures = &printed.figures;
    let driven = printed
        .load_n
        .map_or("frictionless".to_owned(), |load| format!("driven against {load:.2} N"));
    let how = match (&printed.course, printed.speed_mm_s, printed.preload_n) {
        (Some(course), ..) => format!("by {course}"),
        (None, speed, preload) => {
            format!("at {} mm/s under {} N", speed.unwrap_or_default(), preload.unwrap_or_default())
        }
    };
    // Hardly pressed, it slides at any friction.
    let mu = |mu| if mu < 100.0 { number(mu, 3) } else { "> 100".to_owned() };
    let rows = [
        ("gap", Some(number(figures.gap_mm, 3)), "mm"),
        ("corner force", Some(number(figures.corner_force_n, 2)), "N"),
        ("work of the climb", Some(number(figures.climb_work_mj, 1)), "mJ"),
        ("embedding", Some(number(figures.embedding_mm, 3)), "mm"),
        ("friction needed", figures.mu_needed.map(mu), ""),
        ("impact stress", figures.impact_stress_pa.map(|stress| number(stress, 0)), "Pa"),
        ("vibration of the arm", figures.vibration_um.map(|um| number(um, 2)), "um"),
    ];
    let rows = rows
        .into_iter()
        .filter_map(|(name, value, unit)| Some(vec![name.into(), value?, unit.into()]));
    let mut text = format!(
        "{} {how}, {driven}, rig {}, by the {method}\n{}\n",
        if printed.direction == "retract" { "Drop" } else { "Climb" },
        printed.rig,
        plain(&["", "value", "unit"], rows)
    );
    if !printed.in_range {
        let outside = printed.outside.join("; ");
        text += &format!(
            "Out of the range in which this method is checked against the ring, so do not \
             rely on these figures (--method ring has no such range): {outside}\n"
        );
    }
    text
}

/// What of this crossing is outside the range in which a model is checked.
fn outside(rig: &Rig, case: &CrossingSetup, figures: &Figures) -> Vec<String> {
    let formula = Formula::new(rig);
    let range = FitRange::of(&formula);
    let mut outside: Vec<String> = Vec::new();
    for row in case.course.rows() {
        let asked = Asked {
            speed_mm_s: row.speed_mm_s,
            preload_n: row.preload_n,
            load_n: case.load_n.unwrap_or_default(),
            utilisation: figures.mu_needed.unwrap_or_default(),
        };
        for text in range.outside(formula.step_mm, &asked) {
            if !outside.contains(&text) {
                outside.push(text);
            }
        }
    }
    if figures.at_model_end {
        outside.push("the gap is at an end of the model, which it holds".to_owned());
    }
    outside
}

/// The wheel never left the lower wall.
fn no_gap() -> Failure {
    Failure::run(
        "the wheel sinks in so far that the lower wall carries until the step is under its \
         centre: this crossing has no gap",
    )
}

/// The ring with memory, as the plant has it.
fn ring(rig: &Rig, mismatch: &Mismatch, setup: &CrossingSetup) -> Result<Figures, Failure> {
    let coupled = mismatch.tread_thickness_mm > 0.0;
    let mut case = setup.case(rig, if coupled { FINENESS_COUPLED } else { FINENESS });
    case.ring = case.ring.with_mismatch(mismatch);
    let result = cross_course(&case, |x| setup.course.at(x))?;
    if result.lift == (0.0, 0.0) {
        return Err(no_gap());
    }
    Ok(Figures {
        gap_mm: result.gap_mm,
        corner_force_n: result.corner_force_n,
        climb_work_mj: result.climb_work_mj,
        embedding_mm: result.embedding_mm,
        mu_needed: setup.load_n.map(|_| result.mu_needed),
        ..Figures::default()
    })
}

/// The reduced model in f64.
fn reduced(rig: &Rig, setup: &CrossingSetup, row: &Row) -> Figures {
    let formula = Formula::new(rig);
    let CrossingSetup { direction, load_n, .. } = *setup;
    let crossing = formula.crossing(direction, row.speed_mm_s, row.preload_n, load_n);
    let kind = Kind { direction, driven: load_n.is_some() };
    let longest = formula.gap_after_mm(formula.largest_run_mm(kind));
    let shortest = formula.gap_after_mm(LEAST_RUN * formula.radius_mm);
    let inside = longest + NEAR_END_MM..=shortest - NEAR_END_MM;
    Figures {
        gap_mm: crossing.gap_mm,
        corner_force_n: crossing.corner_force_n,
        climb_work_mj: f64::from(direction.sign()) * row.preload_n * rig.rig.step_height_mm,
        embedding_mm: formula.depth_mm(crossing.gap_mm),
        mu_needed: load_n.map(|_| crossing.utilisation),
        impact_stress_pa: Some(crossing.impact_stress_pa),
        vibration_um: Some(1e3 * crossing.vibration_mm),
        at_model_end: !inside.contains(&crossing.gap_mm),
    }
}

/// The rolled-out tread as the firmware runs it.
fn fixed(rig: &Rig, setup: &CrossingSetup) -> Result<Figures, Failure> {
    let tread = Tread::try_build(rig)?;
    let case = setup.case(rig, FINENESS);
    let (start, end) = span_mm(&case, case.speed_mm_s.abs());
    let run = Run {
        direction: setup.direction,
        axial: setup
            .load_n
            .map_or(tread::Axial::Pushed, |load| tread::Axial::Driven(Q16::from_num(load))),
        scale: Q16::ONE,
        // As the ring: the axle moves as far as the tread.
        level: true,
        from: Q16::from_num(start),
        until: Q16::from_num(end),
    };
    let (radius, step) = (rig.rig.wheel_radius_mm, rig.rig.step_height_mm);
    let near = (radius * radius - (radius - step) * (radius - step)).sqrt() + 0.5 * radius;
    let mut figures = Figures::default();
    let mut before = (start, 0.0);
    let course = |x: Q16| {
        let (speed, preload) = setup.course.at(x.to_num());
        (Q16::from_num(speed), Q16::from_num(preload))
    };
    let rolled = roll_watched(&tread, &mut TreadState::default(), &run, course, |contact| {
        let (x, y): (f64, f64) = (contact.position.to_num(), contact.centre.to_num());
        let axial: f64 = contact.axial.to_num();
        if x.abs() < near {
            figures.climb_work_mj += 0.5 * (axial + before.1) * (x - before.0);
            let wall = if x < 0.0 { y.min(x.hypot(y - step)) } else { y - step };
            figures.embedding_mm = figures.embedding_mm.max(radius - wall);
        }
        before = (x, axial);
    });
    if rolled.gap == Q16::ZERO {
        return Err(no_gap());
    }
    Ok(Figures {
        gap_mm: rolled.gap.to_num(),
        corner_force_n: rolled.corner_force.to_num(),
        mu_needed: setup.load_n.map(|_| rolled.utilisation.to_num()),
        ..figures
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setup(speed_mm_s: f64, preload_n: f64, load_n: Option<f64>) -> CrossingSetup {
        let course = Course::constant(speed_mm_s, preload_n);
        CrossingSetup { course, direction: Direction::Deploy, load_n }
    }

    #[test]
    fn fixed_point_follows_the_ring_over_a_course() {
        let rig = Rig::prototype();
        let row = |x_mm, speed_mm_s, preload_n| Row { x_mm, speed_mm_s, preload_n };
        let rows = vec![row(-18.0, 30.0, 40.0), row(-13.0, 10.0, 48.0), row(-11.0, 10.0, 48.0)];
        let course = Course::try_new(rows).unwrap();
        let close = |a: f64, b: f64, within: f64| assert!((a / b - 1.0).abs() < within, "{a} {b}");
        for direction in [Direction::Deploy, Direction::Retract] {
            for load_n in [None, Some(6.7)] {
                let setup = CrossingSetup { course: course.clone(), direction, load_n };
                let exact = ring(&rig, &Mismatch::default(), &setup).unwrap();
                let got = fixed(&rig, &setup).unwrap();
                close(got.gap_mm, exact.gap_mm, 7e-3);
                close(got.corner_force_n, exact.corner_force_n, 0.01);
                close(got.embedding_mm, exact.embedding_mm, 0.01);
                close(got.climb_work_mj, exact.climb_work_mj, 0.02);
                assert_eq!(got.mu_needed.is_some(), load_n.is_some());
                if let (Some(got), Some(exact)) = (got.mu_needed, exact.mu_needed) {
                    assert!((got - exact).abs() < 0.01, "{got} {exact}");
                }
            }
        }
    }

    #[test]
    fn the_pushed_corner_force_is_the_preload_on_the_slope() {
        let rig = Rig::fe();
        let setup = setup(5.0, 100.0, None);
        let figures = reduced(&rig, &setup, &setup.course.rows()[0]);
        let contact = Formula::new(&rig).contact(figures.gap_mm);
        let expected = 100.0 * contact.axial / contact.radial;
        assert!((figures.corner_force_n / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_gap_beyond_the_model_is_reported() {
        let rig = Rig::prototype();
        for (preload_n, beyond) in [(1000.0, true), (0.01, true), (33.3, false)] {
            let setup = setup(5.0, preload_n, None);
            let figures = reduced(&rig, &setup, &setup.course.rows()[0]);
            assert_eq!(figures.at_model_end, beyond);
            assert_eq!(outside(&rig, &setup, &figures).is_empty(), !beyond);
        }
    }
}
