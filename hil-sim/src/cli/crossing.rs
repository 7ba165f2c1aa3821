//! `rig crossing`: one isolated crossing at constant speed and preload.

use clap::ValueEnum;
use interstage::model::effective_stiffness::Kind;
use interstage::model::formula::{Formula, LEAST_RUN};
use interstage::model::reduced::{Point, ReducedModel};
use interstage::rig::Rig;
use interstage::units::Direction;
use interstage::units::Q16;
use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::ScenarioArgs;
use crate::fit_range::{Asked, FitRange};
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::mismatch::Mismatch;
use crate::plant::ring::RingParameters;
use crate::progress;
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
/// Gap from an end of the model within which it is at that end, mm.
const NEAR_END_MM: f64 = 1e-7;

/// One isolated crossing at constant speed and preload, without arm and controller.
///
/// Figures of the ring are taken over the complete crossing: the largest axial force of
/// the contact, its work, the largest tread compression, the largest friction utilisation.
/// The reduced model gives force, compression and utilisation at the instant at which the
/// lower wall stops carrying (on retract: begins to). Its work is the elastic one, preload
/// times step height, without the rubber's losses; on retract it is negative.
///
/// The reduced model is checked against the ring from 1 to 100 mm/s, 15 to 150 N, steps of 2 to
/// 6 mm, loads up to 20 N and friction up to 1.5 on the published wheel, and at the same paces,
/// pressures and shapes on any other. Beyond that the answer says so: `in_range` is false.
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
    /// Reduced model, f64: closed forms in the gap.
    Reduced,
    /// Reduced model in fixed point, as the firmware runs it.
    Fixed,
}

/// A crossing to compute.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct CrossingSetup {
    pub(super) speed_mm_s: f64,
    pub(super) preload_n: f64,
    #[serde(skip)]
    pub(super) direction: Direction,
    /// Axial load lifted by friction, N; none pushes a frictionless wheel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) load_n: Option<f64>,
}

impl CrossingSetup {
    /// Refuses a speed or preload out of range, by the names that they were given with.
    pub(super) fn check(&self, [speed, preload]: [&str; 2]) -> Result<(), Failure> {
        for (option, value, max, unit) in [
            (speed, self.speed_mm_s, MAX_SPEED_MM_S, "mm/s"),
            (preload, self.preload_n, MAX_PRELOAD_N, "N"),
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

    /// The figures by this method, and what of them is out of its range.
    pub(super) fn compute(
        &self,
        method: Method,
        scenario: &Scenario,
    ) -> Result<(Figures, Vec<String>), Failure> {
        let rig = &scenario.rig;
        let figures = match method {
            Method::Ring => return Ok((ring(rig, &scenario.mismatch, self)?, Vec::new())),
            Method::Reduced => reduced(rig, self),
            Method::Fixed => fixed(rig, self)?,
        };
        Ok((figures, outside(rig, self, &figures)))
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
    #[serde(flatten)]
    case: CrossingSetup,
    #[serde(flatten)]
    figures: Figures,
    /// Whether the method is known to hold here: the ring always, the reduced model where its
    /// fit is checked.
    in_range: bool,
    /// What is out of range.
    #[serde(skip)]
    outside: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut case = CrossingSetup {
        speed_mm_s: args.speed_mm_s,
        preload_n: args.preload_n,
        direction: if args.retract { Direction::Retract } else { Direction::Deploy },
        load_n: None,
    };
    case.check(["--speed-mm-s", "--preload-n"])?;
    let scenario = args.scenario.resolve()?;
    let loads = &scenario.rig.plant;
    case.load_n = args.driven.then_some(loads.top_load_n * loads.top_load_share);
    let (figures, outside) = {
        let _progress = progress::spinner("crossing");
        case.compute(args.method, &scenario)?
    };
    let printed = Printed {
        in_range: outside.is_empty(),
        outside,
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
        Method::Reduced => "reduced model",
        Method::Fixed => "reduced model in fixed point",
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
        ("impact stress", figures.impact_stress_pa.map(|stress| number(stress, 0)), "Pa"),
        ("vibration of the arm", figures.vibration_um.map(|um| number(um, 2)), "um"),
    ];
    let rows = rows
        .into_iter()
        .filter_map(|(name, value, unit)| Some(vec![name.into(), value?, unit.into()]));
    let mut text = format!(
        "{} at {} mm/s under {} N, {driven}, rig {}, by the {method}\n{}\n",
        if case.direction == Direction::Retract { "Drop" } else { "Climb" },
        case.speed_mm_s,
        case.preload_n,
        printed.rig,
        plain(&["", "value", "unit"], rows)
    );
    if !printed.in_range {
        let outside = printed.outside.join("; ");
        text += &format!(
            "Out of the range in which the reduced model is checked against the ring, so do not \
             rely on these figures (--method ring has no such range): {outside}\n"
        );
    }
    text
}

/// What of this crossing is outside the range of the reduced model.
fn outside(rig: &Rig, case: &CrossingSetup, figures: &Figures) -> Vec<String> {
    let formula = Formula::new(rig);
    let asked = Asked {
        speed_mm_s: case.speed_mm_s,
        preload_n: case.preload_n,
        load_n: case.load_n.unwrap_or_default(),
        utilisation: figures.mu_needed.unwrap_or_default(),
    };
    let mut outside = FitRange::of(&formula).outside(formula.step_mm, &asked);
    if figures.at_model_end {
        outside.push("the gap is at an end of the model, which it holds".to_owned());
    }
    outside
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
        return Err(Failure::run(
            "the wheel sinks in so far that the lower wall carries until the step is under its \
             centre: this crossing has no gap",
        ));
    }
    Ok(Figures {
        gap_mm: result.gap_mm,
        corner_force_n: result.corner_force_n,
        climb_work_mj: result.climb_work_mj,
        embedding_mm: result.embedding_mm,
        mu_needed: case.load_n.map(|_| result.mu_needed),
        ..Figures::default()
    })
}

/// The reduced model in f64.
fn reduced(rig: &Rig, case: &CrossingSetup) -> Figures {
    let formula = Formula::new(rig);
    let CrossingSetup { speed_mm_s, preload_n, direction, load_n } = *case;
    let crossing = formula.crossing(direction, speed_mm_s, preload_n, load_n);
    let kind = Kind { direction, driven: load_n.is_some() };
    let longest = formula.gap_after_mm(formula.largest_run_mm(kind));
    let shortest = formula.gap_after_mm(LEAST_RUN * formula.radius_mm);
    let inside = longest + NEAR_END_MM..=shortest - NEAR_END_MM;
    Figures {
        gap_mm: crossing.gap_mm,
        corner_force_n: crossing.corner_force_n,
        climb_work_mj: elastic_work_mj(rig, case),
        embedding_mm: formula.depth_mm(crossing.gap_mm),
        mu_needed: load_n.map(|_| crossing.utilisation),
        impact_stress_pa: Some(crossing.impact_stress_pa),
        vibration_um: Some(1e3 * crossing.vibration_mm),
        at_model_end: !inside.contains(&crossing.gap_mm),
    }
}

/// The reduced model as the firmware runs it.
fn fixed(rig: &Rig, case: &CrossingSetup) -> Result<Figures, Failure> {
    let model = ReducedModel::try_build_for(rig, case.load_n)?;
    let speed = Q16::from_num(case.speed_mm_s);
    let point = Point::nominal(case.direction, speed);
    let crossing = model.crossing(&point, Q16::from_num(case.preload_n));
    Ok(Figures {
        gap_mm: crossing.gap.to_num(),
        corner_force_n: crossing.corner_force.to_num(),
        climb_work_mj: elastic_work_mj(rig, case),
        embedding_mm: model.depth(crossing.gap).to_num(),
        mu_needed: case.load_n.map(|_| crossing.utilisation.to_num()),
        impact_stress_pa: Some(1e3 * crossing.impact_stress_kpa.to_num::<f64>()),
        vibration_um: Some(crossing.vibration_um.to_num()),
        at_model_end: crossing.at_end,
    })
}

/// Work of a frictionless elastic climb, mJ: the preload times the step's height.
fn elastic_work_mj(rig: &Rig, case: &CrossingSetup) -> f64 {
    f64::from(case.direction.sign()) * case.preload_n * rig.rig.step_height_mm
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(speed_mm_s: f64, preload_n: f64, load_n: Option<f64>) -> CrossingSetup {
        CrossingSetup { speed_mm_s, preload_n, direction: Direction::Deploy, load_n }
    }

    #[test]
    fn fixed_point_follows_the_closed_form() {
        let rig = Rig::prototype();
        let close = |a: f64, b: f64, within: f64| assert!((a / b - 1.0).abs() < within);
        for direction in [Direction::Deploy, Direction::Retract] {
            for load_n in [None, Some(6.7)] {
                let case = CrossingSetup { direction, ..case(8.0, 40.0, load_n) };
                let (exact, got) = (reduced(&rig, &case), fixed(&rig, &case).unwrap());
                close(got.gap_mm, exact.gap_mm, 5e-4);
                close(got.corner_force_n, exact.corner_force_n, 2e-3);
                close(got.embedding_mm, exact.embedding_mm, 2e-3);
                assert_eq!(got.climb_work_mj, exact.climb_work_mj);
                assert_eq!(got.mu_needed.is_some(), load_n.is_some());
                if let (Some(got), Some(exact)) = (got.mu_needed, exact.mu_needed) {
                    close(got, exact, 2e-3);
                }
            }
        }
    }

    #[test]
    fn the_pushed_corner_force_is_the_preload_on_the_slope() {
        let rig = Rig::fe();
        let figures = reduced(&rig, &case(5.0, 100.0, None));
        let contact = Formula::new(&rig).contact(figures.gap_mm);
        let expected = 100.0 * contact.axial / contact.radial;
        assert!((figures.corner_force_n / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_gap_beyond_the_model_is_reported() {
        let rig = Rig::prototype();
        for (preload_n, beyond) in [(1000.0, true), (0.01, true), (33.3, false)] {
            let case = case(5.0, preload_n, None);
            assert_eq!(reduced(&rig, &case).at_model_end, beyond);
            assert_eq!(fixed(&rig, &case).unwrap().at_model_end, beyond);
            assert_eq!(outside(&rig, &case, &reduced(&rig, &case)).is_empty(), !beyond);
        }
    }
}
