//! The three ways to compute a crossing.

use interstage::model::formula::Formula;
use interstage::model::reduced::{Point, ReducedModel};
use interstage::rig::Rig;
use interstage::supervise::Direction;
use interstage::units::{Q16, q16};

use super::{Case, Figures};
use crate::cli::failure::Failure;
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::ring::RingParameters;

/// Elements around the ring and axial way per step, mm: the gap is within 0.1 % of
/// that at half the stride and twice the elements.
const ELEMENTS: usize = 5760;
const STRIDE_MM: f64 = 0.005;

/// Gap from the end of the firmware's table within which it is at that end: 6e-5 mm.
const NEAR_END: Q16 = q16(62);

/// Gap below which the closed form is at its end, mm.
const LEAST_GAP_MM: f64 = 1e-6;

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
        at_table_end: false,
    })
}

/// The reduced model in f64.
pub(super) fn reduced(rig: &Rig, case: &Case) -> Result<Figures, Failure> {
    let formula = Formula::new(rig);
    let Case { speed_mm_s, preload_n, direction, load_n } = *case;
    let gap_mm = formula.gap_mm(direction, speed_mm_s, preload_n, load_n);
    if gap_mm < LEAST_GAP_MM {
        return Err(Failure::run(SUNK));
    }
    let stiffness = formula.k_inf * formula.stiffness(direction, speed_mm_s, gap_mm);
    Ok(Figures {
        gap_mm,
        // Pushed, this is the preload times axial over radial integral; the driven
        // contact carries less, as the traction on its slope carries the rest.
        corner_force_n: stiffness * formula.contact(gap_mm).axial,
        climb_work_mj: elastic_work(rig, case),
        embedding_mm: formula.depth_mm(gap_mm),
        mu_needed: load_n.map(|load| formula.utilisation(direction, speed_mm_s, gap_mm, load)),
        at_table_end: false,
    })
}

/// The reduced model as the firmware runs it.
pub(super) fn fixed(rig: &Rig, case: &Case) -> Result<Figures, Failure> {
    let model = ReducedModel::try_build(rig)?;
    let point = Point {
        direction: case.direction,
        speed: Q16::from_num(case.speed_mm_s),
        load: Q16::from_num(case.load_n.unwrap_or(0.0)),
        scale: Q16::from_num(1),
    };
    let force = Q16::from_num(case.preload_n);
    let gap = match case.load_n {
        Some(_) => model.gap(&point, force),
        None => model.pushed_gap(&point, force),
    };
    // The search closes in on an end of the table without reaching it.
    let (low, high) = model.gap_range();
    let (least, most) = (low + NEAR_END, high - NEAR_END);
    let carried = model.pushed_force(&point, gap);
    Ok(Figures {
        gap_mm: gap.to_num(),
        corner_force_n: model.climbing_force(gap, carried).to_num(),
        climb_work_mj: elastic_work(rig, case),
        embedding_mm: model.depth(gap).to_num(),
        mu_needed: case.load_n.map(|_| model.utilisation(&point, gap).to_num()),
        at_table_end: least > gap || gap > most,
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
    fn a_gap_beyond_the_table_is_told() {
        let rig = Rig::prototype();
        let beyond = |preload_n| fixed(&rig, &case(5.0, preload_n, None)).unwrap().at_table_end;
        assert!(beyond(1000.0) && beyond(1.0));
        assert!(!beyond(33.3));
    }

    #[test]
    fn a_wheel_that_sinks_in_has_no_gap() {
        let sunk = case(5.0, 1000.0, None);
        for method in [ring, reduced] {
            assert!(matches!(method(&Rig::prototype(), &sunk), Err(Failure::Run(_))));
        }
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
