//! What the reduced model says: gap, embedding depth, contact area and collision force
//! of a crossing in closed form, and its history as that of an elastic ring of the
//! effective stiffness.

use interstage::model::formula::Formula;
use interstage::units::Direction;

use super::case::{Arms, Case};
use super::history::{History, INTERVAL_S, Instant};
use super::measure::{corner_area_mm2, stress_kpa};
use hil_sim::plant::balance::{Axial, Balance, BalanceError};
use hil_sim::plant::ring::{Motion, Ring, RingParameters};
use hil_sim::plant::wall::{Step, Wall};

/// Whether the wheel is pushed without friction, as in the study's theory, or drives
/// itself against its load, as on a rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// Pushed at its axle over a frictionless wall.
    Pushed,
    /// Driven by torque, with the arm that presses it into the wall.
    Driven,
}

/// Figures of a crossing at the instant at which the lower wall stops carrying.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lift {
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
pub fn lift(case: &Case, drive: Drive, level: usize) -> Lift {
    let formula = Formula::new(&case.loads.rig());
    let (force, load) = match drive {
        Drive::Pushed => (case.preload_n, None),
        Drive::Driven => (case.pressing_n(level), Some(case.load_n())),
    };
    let crossing = formula.crossing(Direction::Deploy, case.speed_mm_s, force, load);
    let gap = crossing.gap_mm;
    let area = area_of_gap_mm2(&formula, gap);
    let collision = crossing.corner_force_n;
    Lift {
        gap_mm: gap,
        depth_mm: formula.depth_mm(gap),
        area_mm2: area,
        collision_n: collision,
        impact_kpa: stress_kpa(collision, area),
    }
}

/// The same, mean over the three stages.
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
    corner_area_mm2((formula.radius_mm, formula.width_mm), formula.distance_mm(gap_mm), above)
}

/// Contact area that belongs to a tread depth at lift-off, mm^2, by the nominal
/// geometry: how a compression sensor's reading becomes an area.
pub fn area_of_depth_mm2(case: &Case, depth_mm: f64) -> f64 {
    let formula = Formula::new(&case.loads.rig());
    let above = formula.radius_mm - formula.step_mm;
    let reach = formula.radius_mm - depth_mm;
    let ahead = (reach * reach - above * above).max(0.0).sqrt();
    corner_area_mm2((formula.radius_mm, formula.width_mm), ahead, above)
}

/// Elements of the elastic ring of a deployment and its axial travel per step, mm.
const COARSE: (usize, f64) = (1440, 0.02);

/// A deployment of the driven wheel as the reduced model has it: an elastic ring of the
/// stiffness that is effective at lift-off, and an arm that bends as under a static force.
pub fn deployment(case: &Case, arms: &Arms) -> Result<History, BalanceError> {
    let rig = case.loads.rig();
    let formula = Formula::new(&rig);
    let gap = mean_lift(case, Drive::Driven).gap_mm;
    let mut tread = RingParameters::of(&rig, COARSE.0);
    tread.k_inf *= formula.stiffness(Direction::Deploy, case.speed_mm_s, gap, Some(case.load_n()));
    tread.k_0 = tread.k_inf;
    let height_mm = rig.rig.step_height_mm;
    let steps = rig.rig.step_positions_mm.iter();
    let wall = Wall::new(steps.map(|&position_mm| Step { position_mm, height_mm }).collect());
    let mut ring = Ring::new(tread);
    let (radius, stride) = (tread.radius_mm, COARSE.1);
    let (dt_s, turn_rad) = (stride / case.speed_mm_s, stride / radius);
    let mut height = radius - 0.01;
    let mut base = 0.0;
    let mut history = History::default();
    for index in 0..(rig.rig.travel_mm / stride) as usize {
        let x = (index + 1) as f64 * stride;
        let local = wall.local(x);
        height += base - local.base_mm;
        base = local.base_mm;
        let balance = Balance {
            preload_n: case.pressing_n(local.level),
            spring_n_per_mm: 0.0,
            arm_n: 0.0,
            axial: Axial::Driven(case.load_n()),
        };
        let motion = Motion { wall: local, height_mm: height, turn_rad, dt_s };
        let solved = balance.solve(&mut ring, motion)?;
        height = solved.height_mm;
        ring.commit(&Motion { height_mm: height, ..motion });
        // Nothing resists the rolling of an elastic wheel.
        let collision_n = solved.contact.sine_n.max(0.0);
        let size = (radius, tread.width_mm);
        let ahead = corner_area_mm2(size, local.ahead_mm, height - local.rise_mm);
        let area =
            if ahead > 0.0 { ahead } else { corner_area_mm2(size, -local.behind_mm, height) };
        let now = Instant {
            time_s: x / case.speed_mm_s,
            position_mm: x,
            collision_n,
            impact_kpa: stress_kpa(collision_n, area),
            arm_um: 1e3 * arms.static_mm(local.level, collision_n),
            clearance_mm: (local.ahead_mm < radius && local.level == 0)
                .then(|| local.ahead_mm.hypot(height) - radius),
        };
        history.push(&now, INTERVAL_S);
    }
    Ok(history)
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
    fn the_fitted_gaps_are_met_without_friction() {
        let gaps = [1.7427, 1.5682, 1.8994];
        for ((speed, preload), gap) in crate::paper::published::CASES.into_iter().zip(gaps) {
            let lift = lift(&Case::new(Loads::Fe, speed, preload), Drive::Pushed, 0);
            assert!((lift.gap_mm - gap).abs() < 0.01, "{lift:?}");
        }
    }
}
