//! A case on the ring alone: pushed, frictionless, along its course over the step. Energy that
//! wall and wheel put into the tread may be lost, never gained.

use super::cases::{RADIUS_MM, StressCase};
use crate::plant::balance::{Axial, Balance, BalanceError};
use crate::plant::draw::ELEMENTS;
use crate::plant::ring::{Motion, Ring};
use crate::plant::wall::{Step, Wall};

/// Stride, mm, and the most strides in a step of time: those of the plant.
const STRIDE_MM: f64 = 0.02;
const MOST_STRIDES: f64 = 256.0;

/// Ring steps of a run.
const BUDGET: usize = 1000;

/// Figures of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Roll {
    /// Largest depth of the tread, mm.
    pub depth_mm: f64,
    /// Energy taken out of the tread beyond what it was given, mJ.
    pub created_mj: f64,
    /// What the ring's resolution can account for, mJ.
    pub resolved_mj: f64,
}

/// Rolls `case`.
pub(super) fn run(case: &StressCase) -> Result<Roll, BalanceError> {
    let per_tick = case.speed_mm_s * case.dt_s;
    let parts = (per_tick / STRIDE_MM).ceil().clamp(1.0, MOST_STRIDES);
    let (dt_s, stride) = (case.dt_s / parts, per_tick / parts);
    let reach = case.reach_mm();
    let longest = 2.0 * reach + RADIUS_MM;
    let steps = if stride > 0.0 {
        (longest / stride).ceil().min(BUDGET as f64) as usize
    } else {
        BUDGET / 4
    };
    // A run too short for the complete step begins somewhere on the step.
    let travel = stride * steps as f64;
    let lead = (travel * 0.4).min(0.5 * RADIUS_MM);
    let sense = case.course.speed(0.0);
    let first = if sense > 0.0 { -reach - lead } else { lead };
    let mut x = first + sense * case.phase * (longest - travel).max(0.0);
    let wall = Wall::new(vec![Step { position_mm: 0.0, height_mm: case.step_mm }]);
    let mut ring = Ring::new(case.ring());
    let balance = Balance {
        preload_n: case.preload_n,
        spring_n_per_mm: 0.0,
        arm_n: 0.0,
        axial: Axial::Pushed,
    };
    let mut y = RADIUS_MM + wall.local(x).base_mm;
    let mut out = Roll::default();
    let (mut given, mut stored, mut lift) = (0.0f64, 0.0, 0.0);
    let mut forces = (0.0, 0.0);
    for index in 0..steps {
        let dx = stride * case.course.speed(index as f64 / steps as f64);
        x += dx;
        let local = wall.local(x);
        let height_mm = y - local.base_mm;
        let motion = Motion { wall: local, height_mm, turn_rad: dx / RADIUS_MM, dt_s };
        let solved = balance.solve(&mut ring, motion)?;
        ring.commit(&Motion { height_mm: solved.height_mm, ..motion });
        let height = solved.height_mm + local.base_mm;
        let contact = solved.contact;
        let now = (contact.sine_n, contact.cosine_n);
        if index == 0 {
            // Put down onto wall or corner: no more than this can come back.
            stored = case.preload_n * contact.depth_mm.max(0.0);
        } else {
            let dy = height - y;
            given += 0.5 * ((forces.0 + now.0) * dx - (forces.1 + now.1) * dy);
            lift += dy.abs();
        }
        (y, forces) = (height, now);
        // Written so that a value that is not finite shows.
        out.created_mj =
            if given.is_nan() { f64::NAN } else { out.created_mj.max(-given - stored) };
        out.depth_mm = if y.is_nan() { f64::NAN } else { out.depth_mm.max(contact.depth_mm) };
    }
    // A corner between two elements touches neither: heights are known to the distance of the
    // elements, work to that and the trapezoids of a stride.
    let grain = std::f64::consts::TAU * RADIUS_MM / ELEMENTS as f64 + stride;
    out.resolved_mj = case.preload_n * (grain + 0.01 * lift);
    Ok(out)
}
