//! What the reduced model says: gap, embedding depth, contact area and collision force
//! of a crossing in closed form, and its history as that of an elastic ring of the
//! effective stiffness.

use interstage::model::formula::Formula;
use interstage::supervise::Direction;

use super::case::Case;

/// Whether the wheel is pushed without friction, as in the study's theory, or drives
/// itself against its load, as on a rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// Pushed at its axle over a frictionless wall.
    Pushed,
    /// Driven by torque, with the arm that wedges it into the wall.
    Driven,
}

/// Figures of a crossing at the instant at which the lower wall stops carrying.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lift {
    /// Gap, mm.
    pub gap_mm: f64,
    /// Tread depth at the corner, mm.
    pub depth_mm: f64,
    /// Contact area, mm^2.
    pub area_mm2: f64,
    /// Axial force of the contact against the motion, N.
    pub collision_n: f64,
    /// That force over the contact area, kPa.
    pub impact_kpa: f64,
}

/// The reduced model's crossing from sleeve `level`.
#[must_use]
pub fn lift(case: &Case, drive: Drive, level: usize) -> Lift {
    let formula = Formula::new(&case.loads.rig());
    let (force, load) = match drive {
        Drive::Pushed => (case.preload_n, None),
        Drive::Driven => (case.pressing_n(level), Some(case.load_n())),
    };
    let gap = formula.gap_mm(Direction::Deploy, case.speed_mm_s, force, load);
    let stiffness = formula.k_inf * formula.stiffness(Direction::Deploy, case.speed_mm_s, gap);
    let area = area_of_gap_mm2(&formula, gap);
    let collision = stiffness * formula.contact(gap).axial;
    Lift {
        gap_mm: gap,
        depth_mm: formula.depth_mm(gap),
        area_mm2: area,
        collision_n: collision,
        impact_kpa: super::measure::stress_kpa(collision, area),
    }
}

/// The same, mean over the three stages.
#[must_use]
pub fn mean_lift(case: &Case, drive: Drive) -> Lift {
    let all: Vec<Lift> = (0..3).map(|level| lift(case, drive, level)).collect();
    let mean = |figure: fn(&Lift) -> f64| all.iter().map(figure).sum::<f64>() / 3.0;
    Lift {
        gap_mm: mean(|l| l.gap_mm),
        depth_mm: mean(|l| l.depth_mm),
        area_mm2: mean(|l| l.area_mm2),
        collision_n: mean(|l| l.collision_n),
        impact_kpa: mean(|l| l.impact_kpa),
    }
}

/// Contact area at lift-off with this gap, mm^2.
fn area_of_gap_mm2(formula: &Formula, gap_mm: f64) -> f64 {
    let above = formula.radius_mm - formula.step_mm;
    corner_area_mm2(formula.radius_mm, formula.width_mm, formula.distance_mm(gap_mm), above)
}

/// Part of the undeformed wheel's surface that face and top of a step cut off, mm^2.
///
/// Equation: `A = R L (acos(u/R) - asin(d/R))`, d the way to the face and u the height
/// of the centre above the top, both mm. Range: 0 where the corner stands outside the
/// wheel. Memory lets the trailing part of it go earlier: the true area is smaller.
#[must_use]
pub fn corner_area_mm2(radius_mm: f64, width_mm: f64, ahead_mm: f64, above_mm: f64) -> f64 {
    if ahead_mm.hypot(above_mm) >= radius_mm || above_mm < 0.0 {
        return 0.0;
    }
    let start = (ahead_mm.max(0.0) / radius_mm).min(1.0).asin();
    let end = (above_mm / radius_mm).min(1.0).acos();
    radius_mm * width_mm * (end - start)
}

/// Contact area that belongs to a tread depth at lift-off, mm^2, by the nominal
/// geometry: how a compression sensor's reading becomes an area.
#[must_use]
pub fn area_of_depth_mm2(case: &Case, depth_mm: f64) -> f64 {
    let formula = Formula::new(&case.loads.rig());
    let above = formula.radius_mm - formula.step_mm;
    let reach = formula.radius_mm - depth_mm;
    let ahead = (reach * reach - above * above).max(0.0).sqrt();
    corner_area_mm2(formula.radius_mm, formula.width_mm, ahead, above)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::case::Loads;

    #[test]
    fn depth_and_gap_give_the_same_area() {
        for preload in [33.3, 50.0] {
            let case = Case::new(Loads::Prototype, 5.0, preload);
            let lift = lift(&case, Drive::Driven, 1);
            let area = area_of_depth_mm2(&case, lift.depth_mm);
            assert!((area / lift.area_mm2 - 1.0).abs() < 1e-9, "{area} {lift:?}");
        }
    }

    #[test]
    fn the_area_is_that_of_a_fine_sum() {
        let (radius, width, ahead, above) = (25.0, 28.0, 10.0, 21.0);
        let n = 200_000;
        let pitch = 1.2 / f64::from(n);
        let inside = (0..n)
            .map(|i| (f64::from(i) + 0.5) * pitch)
            .filter(|psi: &f64| {
                // The ray meets the face first, or passes over the corner to the top.
                let face = ahead / psi.sin();
                let at_face = radius.min(face) * psi.cos();
                let reach = if at_face >= above { face } else { above / psi.cos() };
                reach < radius
            })
            .count();
        let sum = inside as f64 * pitch * radius * width;
        let area = corner_area_mm2(radius, width, ahead, above);
        assert!((area / sum - 1.0).abs() < 1e-3, "{area} {sum}");
    }

    #[test]
    fn the_fitted_gaps_are_met_without_friction() {
        let gaps = [1.7427, 1.5682, 1.8994];
        for ((speed, preload), gap) in crate::paper::published::CASES.into_iter().zip(gaps) {
            let lift = lift(&Case::new(Loads::Fe, speed, preload), Drive::Pushed, 0);
            assert!((lift.gap_mm - gap).abs() < 0.01, "{lift:?}");
        }
    }
}
