//! What the controller's model says, the tread rolled out in fixed point: gap, embedding depth,
//! contact area and collision force of a crossing, and its history as that of an elastic ring of
//! the effective stiffness.

use anyhow::{Context, Result};
use interstage::units::Direction;

use super::case::{Arms, Case};
use super::history::{History, INTERVAL_S, Instant};
use super::measure::{corner_area_mm2, step_area_mm2, stress_kpa};
use hil_sim::plant::balance::{Axial, Balance};
use hil_sim::plant::ring::{Motion, Ring, RingParameters};
use hil_sim::plant::wall::{Step, Wall};
use hil_sim::rollout::{CrossingSetup, Wheel, halved};

/// Whether the wheel is pushed without friction, as in the study's theory, or drives
/// itself against its load, as on a rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Drive {
    /// Pushed at its axle over a frictionless wall.
    Pushed,
    /// Driven by torque, with the arm that presses it into the wall.
    Driven,
}

/// Figures of a crossing at the instant at which the lower wall stops carrying.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lift {
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

impl Lift {
    /// With this gap and depth, mm, area, mm^2, and collision force, N.
    pub(super) fn new((gap_mm, depth_mm): (f64, f64), area_mm2: f64, collision_n: f64) -> Self {
        let impact_kpa = stress_kpa(collision_n, area_mm2);
        Self { gap_mm, depth_mm, area_mm2, collision_n, impact_kpa }
    }
}

/// How the wheel crosses from sleeve `level`.
pub(super) fn setup(case: &Case, drive: Drive, level: usize) -> CrossingSetup {
    let (preload_n, load_n) = match drive {
        Drive::Pushed => (case.preload_n, None),
        Drive::Driven => (case.pressing_n(level), Some(case.load_n())),
    };
    CrossingSetup { speed_mm_s: case.speed_mm_s, preload_n, direction: Direction::Deploy, load_n }
}

/// The model's crossing from sleeve `level`; the collision is the largest of the crossing.
pub(super) fn lift(case: &Case, drive: Drive, level: usize) -> Result<Lift> {
    let rig = case.loads.rig();
    let crossed = Wheel::try_build(&rig)?.cross(&setup(case, drive, level));
    let crossed = crossed.context("a wheel that sinks in has no gap")?;
    let size = (rig.rig.wheel_radius_mm, rig.rig.wheel_width_mm);
    let area = corner_area_mm2(size, crossed.ahead_mm, crossed.above_mm);
    Ok(Lift::new((crossed.gap_mm, crossed.depth_mm), area, crossed.corner_force_n))
}

/// The same, mean over the three stages.
pub(super) fn mean_lift(case: &Case, drive: Drive) -> Result<Lift> {
    let all: Vec<Lift> = (0..3).map(|level| lift(case, drive, level)).collect::<Result<_>>()?;
    let mean = |figure: fn(&Lift) -> f64| all.iter().map(figure).sum::<f64>() / 3.0;
    Ok(Lift {
        gap_mm: mean(|l| l.gap_mm),
        depth_mm: mean(|l| l.depth_mm),
        area_mm2: mean(|l| l.area_mm2),
        collision_n: mean(|l| l.collision_n),
        impact_kpa: mean(|l| l.impact_kpa),
    })
}

/// Elements of the elastic ring of a deployment and its axial travel per step, mm.
const COARSE: (usize, f64) = (1440, 0.02);

/// Stiffness, over the relaxed one, of the elastic tread that lifts off with the gap of the
/// driven wheel.
fn effective_stiffness(case: &Case) -> Result<f64> {
    let gap_mm = mean_lift(case, Drive::Driven)?.gap_mm;
    let setup = setup(case, Drive::Driven, 1);
    let rig = case.loads.rig();
    let softer = |stiffness: f64| {
        let mut elastic = rig.clone();
        elastic.tread.k_inf_pa_per_m *= stiffness;
        elastic.tread.stiffening = 1.0;
        let crossed = Wheel::try_build(&elastic).ok().and_then(|wheel| wheel.cross(&setup));
        crossed.is_none_or(|crossed| crossed.gap_mm < gap_mm)
    };
    Ok(halved((1.0, rig.tread.stiffening), softer))
}

/// A deployment of the driven wheel as an elastic ring of the stiffness that is effective at
/// lift-off, and an arm that bends as under a static force.
pub(super) fn deployment(case: &Case, arms: &Arms) -> Result<History> {
    let rig = case.loads.rig();
    let mut tread = RingParameters::of(&rig, COARSE.0);
    tread.k_inf *= effective_stiffness(case)?;
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
        let balance = Balance::under(case.pressing_n(local.level), Axial::Driven(case.load_n()));
        let motion = Motion { wall: local, height_mm: height, turn_rad, dt_s };
        let solved = balance.solve(&mut ring, motion)?;
        height = solved.height_mm;
        ring.commit(&Motion { height_mm: height, ..motion });
        // Nothing resists the rolling of an elastic wheel.
        let collision_n = solved.contact.sine_n.max(0.0);
        let area = step_area_mm2((radius, tread.width_mm), &local, height);
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
    fn the_fitted_gaps_are_met_without_friction() {
        let gaps = [1.7427, 1.5682, 1.8994];
        for ((speed, preload), gap) in crate::paper::published::CASES.into_iter().zip(gaps) {
            let lift = lift(&Case::new(Loads::Fe, speed, preload), Drive::Pushed, 0).unwrap();
            assert!((lift.gap_mm - gap).abs() < 0.01, "{lift:?}");
        }
    }
}
