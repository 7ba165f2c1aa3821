//! The three ways to compute a crossing.

use interstage::model::effective_stiffness::Kind;
use interstage::model::formula::{Formula, LEAST_RUN};
use interstage::model::reduced::{Point, ReducedModel, Scale};
use interstage::rig::Rig;
use interstage::units::{Direction, Q16};

use super::{Case, Figures};
use crate::cli::failure::Failure;
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::ring::RingParameters;

/// Elements around the ring and axial way per step, mm: the gap is within 0.1 % of
/// that at half the stride and twice the elements.
const ELEMENTS: usize = 5760;
const STRIDE_MM: f64 = 0.005;

/// Gap from an end of the model within which it is at that end, mm.
const NEAR_END_MM: f64 = 1e-7;

/// Why there is no gap.
const SUNK: &str = "the wheel sinks in so far that the lower wall carries until the step lies \
                    under its centre: this crossing has no gap";

/// The ring with memory, as the plant has it.
pub(super) fn ring(rig: &Rig, case: &Case) -> Result<Figures, Failure> {
    ring_of(rig, case, ELEMENTS, STRIDE_MM)
}

fn ring_of(rig: &Rig, case: &Case, elements: usize, stride_mm: f64) -> Result<Figures, Failure> {
    let result = cross(&CrossingCase {
        ring: RingParameters::of(rig, elements),
        step_height_mm: rig.rig.step_height_mm,
        speed_mm_s: case.speed_mm_s * f64::from(case.direction.sign()),
        preload_n: case.preload_n,
        axial: case.load_n.map_or(Axial::Pushed, Axial::Driven),
        stride_mm,
    })?;
    if result.lift == (0.0, 0.0) {
        return Err(Failure::run(SUNK));
    }
    Ok(Figures {
        gap_mm: result.gap_mm,
        corner_force_n: result.corner_force_n,
        climb_work_mj: result.climb_work_mj,
        embedding_mm: result.embedding_mm,
        mu_needed: case.load_n.map(|_| result.mu_needed),
        impact_stress_pa: None,
        vibration_um: None,
        at_model_end: false,
    })
}

/// The reduced model in f64.
pub(super) fn reduced(rig: &Rig, case: &Case) -> Result<Figures, Failure> {
    let formula = Formula::new(rig);
    let Case { speed_mm_s, preload_n, direction, load_n } = *case;
    let crossing = formula.crossing(direction, speed_mm_s, preload_n, load_n);
    let kind = Kind { direction, driven: load_n.is_some() };
    let least_run = LEAST_RUN * formula.radius_mm;
    let (least, most) =
        (formula.gap_after_mm(formula.largest_run_mm(kind)), formula.gap_after_mm(least_run));
    Ok(Figures {
        gap_mm: crossing.gap_mm,
        corner_force_n: crossing.corner_force_n,
        climb_work_mj: elastic_work(rig, case),
        embedding_mm: formula.depth_mm(crossing.gap_mm),
        mu_needed: load_n.map(|_| crossing.utilisation),
        impact_stress_pa: Some(crossing.impact_stress_pa),
        vibration_um: Some(1e3 * crossing.vibration_mm),
        at_model_end: !(least + NEAR_END_MM..=most - NEAR_END_MM).contains(&crossing.gap_mm),
    })
}

/// The reduced model as the firmware runs it.
pub(super) fn fixed(rig: &Rig, case: &Case) -> Result<Figures, Failure> {
    let model = ReducedModel::try_build_for(rig, case.load_n)?;
    let point = Point {
        direction: case.direction,
        speed: Q16::from_num(case.speed_mm_s),
        scale: Scale::NOMINAL,
    };
    let crossing = model.crossing(&point, Q16::from_num(case.preload_n));
    Ok(Figures {
        gap_mm: crossing.gap.to_num(),
        corner_force_n: crossing.corner_force.to_num(),
        climb_work_mj: elastic_work(rig, case),
        embedding_mm: model.depth(crossing.gap).to_num(),
        mu_needed: case.load_n.map(|_| crossing.utilisation.to_num()),
        impact_stress_pa: Some(1e3 * crossing.impact_stress_kpa.to_num::<f64>()),
        vibration_um: Some(crossing.vibration_um.to_num()),
        at_model_end: crossing.at_end,
    })
}

/// Work of a frictionless elastic climb, mJ: the preload lifted by the step.
fn elastic_work(rig: &Rig, case: &Case) -> f64 {
    let sign = match case.direction {
        Direction::Deploy => 1.0,
        Direction::Retract => -1.0,
    };
    sign * case.preload_n * rig.rig.step_height_mm
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(speed_mm_s: f64, preload_n: f64, load_n: Option<f64>) -> Case {
        Case { speed_mm_s, preload_n, direction: Direction::Deploy, load_n }
    }

    #[test]
    fn fixed_point_follows_the_closed_form() {
        let rig = Rig::prototype();
        for direction in [Direction::Deploy, Direction::Retract] {
            for load_n in [None, Some(6.7)] {
                let case = Case { direction, ..case(8.0, 40.0, load_n) };
                let exact = reduced(&rig, &case).unwrap();
                let got = fixed(&rig, &case).unwrap();
                let close = |a: f64, b: f64, within: f64| assert!((a / b - 1.0).abs() < within);
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
        let formula = Formula::new(&rig);
        let figures = reduced(&rig, &case(5.0, 100.0, None)).unwrap();
        let contact = formula.contact(figures.gap_mm);
        let expected = 100.0 * contact.axial / contact.radial;
        assert!((figures.corner_force_n / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_gap_beyond_the_model_is_told() {
        let rig = Rig::prototype();
        for method in [reduced, fixed] {
            let beyond =
                |preload_n| method(&rig, &case(5.0, preload_n, None)).unwrap().at_model_end;
            assert!(beyond(1000.0) && beyond(0.01));
            assert!(!beyond(33.3));
        }
    }

    #[test]
    fn a_wheel_that_sinks_in_has_no_gap() {
        let sunk = case(5.0, 1000.0, None);
        assert!(matches!(ring(&Rig::prototype(), &sunk), Err(Failure::Run(_))));
    }

    #[test]
    fn the_ring_is_converged() {
        let rig = Rig::fe();
        let case = case(5.0, 100.0, None);
        let used = ring(&rig, &case).unwrap();
        let finer = ring_of(&rig, &case, 2 * ELEMENTS, 0.5 * STRIDE_MM).unwrap();
        assert!((used.gap_mm / finer.gap_mm - 1.0).abs() < 1e-3, "{used:?} {finer:?}");
    }
}
