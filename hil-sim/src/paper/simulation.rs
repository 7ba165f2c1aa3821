//! The ring with memory rolled over the three steps at constant speed: the reference
//! for gap, depth, area and collision force, and for their histories.

use crate::plant::balance::{Axial, Balance, BalanceError};
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::ring::{Motion, Ring, RingParameters};
use crate::plant::wall::{Step, Wall};

use super::case::Case;
use super::measure::stress_kpa;
use super::theory::{Drive, Lift, corner_area_mm2};

/// Elements of the ring and axial way of a step, mm, of single crossings: the gap is
/// within 0.2 % of the converged one.
const ELEMENTS: usize = 2880;
const STRIDE_MM: f64 = 0.01;

/// The same of whole deployments, of which only forces are shown.
const COARSE: (usize, f64) = (1440, 0.02);

/// A moment of a deployment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Time since the motion began, s.
    pub time_s: f64,
    /// Axial force of corner and face against the motion, N.
    pub collision_n: f64,
    /// That force over the surface that the step cuts off, kPa.
    pub impact_kpa: f64,
    /// Tread depth, mm.
    pub depth_mm: f64,
    /// Clearance of the undeformed wheel from the root of the step ahead, mm; none
    /// farther than a radius from it.
    pub clearance_mm: Option<f64>,
}

/// Axial forces of a wheel that crosses from sleeve `level`, and the force that presses
/// it, N.
fn loading(case: &Case, drive: Drive, level: usize) -> (Axial, f64) {
    match drive {
        Drive::Pushed => (Axial::Pushed, case.preload_n),
        Drive::Driven => (Axial::Driven(case.load_n()), case.pressing_n(level)),
    }
}

/// The ring's crossing from sleeve `level`, at the instant at which the lower wall stops
/// carrying; the collision is the largest of the crossing.
///
/// The area is the part of the wheel that the step cuts off, as a compression sensor
/// would have it: elements of the ring enter and leave whole.
///
/// # Errors
/// [`BalanceError`] if no height of the centre balances the preload.
pub fn lift(case: &Case, drive: Drive, level: usize) -> Result<Lift, BalanceError> {
    let rig = case.loads.rig();
    let (axial, preload_n) = loading(case, drive, level);
    let ring = RingParameters::of(&rig, ELEMENTS);
    let step = rig.rig.step_height_mm;
    let result = cross(&CrossingCase {
        ring,
        step_height_mm: step,
        speed_mm_s: case.speed_mm_s,
        preload_n,
        axial,
        stride_mm: STRIDE_MM,
    })?;
    let (x, y) = result.lift;
    let area = corner_area_mm2(ring.radius_mm, ring.width_mm, -x, y - step);
    Ok(Lift {
        gap_mm: result.gap_mm,
        depth_mm: result.lift_depth_mm,
        area_mm2: area,
        collision_n: result.corner_force_n,
        impact_kpa: stress_kpa(result.corner_force_n, area),
    })
}

/// A whole deployment, one moment an `interval_s`.
///
/// `ring` is the tread: that of the rig, or an elastic one of the effective stiffness.
///
/// # Errors
/// [`BalanceError`] if no height of the centre balances the preload.
pub fn deployment(
    case: &Case,
    drive: Drive,
    elastic: Option<f64>,
    interval_s: f64,
) -> Result<Vec<Moment>, BalanceError> {
    let rig = case.loads.rig();
    let mut parameters = RingParameters::of(&rig, COARSE.0);
    if let Some(stiffness) = elastic {
        parameters.k_inf *= stiffness;
        parameters.k_0 = parameters.k_inf;
    }
    let height_mm = rig.rig.step_height_mm;
    let steps = rig.rig.step_positions_mm.iter();
    let wall = Wall::new(steps.map(|&position_mm| Step { position_mm, height_mm }).collect());
    let mut ring = Ring::new(parameters);
    let radius = parameters.radius_mm;
    let stride = COARSE.1;
    let dt_s = stride / case.speed_mm_s;
    // Put down a wheel's radius before the travel begins, so that it is forgotten there.
    let lead = (radius / stride).ceil();
    let count = (rig.rig.travel_mm / stride + lead) as usize;
    let mut height = radius - 0.01;
    let mut base = 0.0;
    let mut moments = Vec::new();
    for index in 0..count {
        let x = (index as f64 + 1.0 - lead) * stride;
        let local = wall.local(x);
        height += base - local.base_mm;
        base = local.base_mm;
        let (axial, preload_n) = loading(case, drive, local.level);
        let balance = Balance { preload_n, spring_n_per_mm: 0.0, axial };
        let motion = Motion { wall: local, height_mm: height, turn_rad: stride / radius, dt_s };
        let solved = balance.solve(&ring, motion)?;
        height = solved.height_mm;
        ring.commit(&Motion { height_mm: height, ..motion });
        let time_s = x / case.speed_mm_s;
        if time_s < moments.len() as f64 * interval_s - 1e-9 {
            continue;
        }
        let collision_n = solved.contact.step_sine_n.max(0.0);
        let above = height - local.rise_mm;
        let area = corner_area_mm2(radius, parameters.width_mm, local.ahead_mm, above);
        moments.push(Moment {
            time_s,
            collision_n,
            impact_kpa: stress_kpa(collision_n, area),
            depth_mm: solved.contact.depth_mm,
            clearance_mm: (local.ahead_mm < radius).then(|| local.ahead_mm.hypot(height) - radius),
        });
    }
    Ok(moments)
}
