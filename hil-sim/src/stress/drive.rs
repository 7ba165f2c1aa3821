//! A case on the complete rig: motor, arm, screw, friction and ring, along its course over the
//! step, with its energies accounted for. And on the ring alone: pushed, frictionless; energy that
//! wall and wheel put into the tread may be lost, never gained.

use super::cases::{Course, RADIUS_MM, StressCase};
use crate::plant::actuators::DriveMotor;
use crate::plant::balance::{Axial, Balance, BalanceError};
use crate::plant::draw::{ELEMENTS, PlantParameters};
use crate::plant::rig::{Drives, PlantError, Truth, VirtualRig};
use crate::plant::ring::{Motion, Ring};
use crate::plant::wall::{Step, Wall};
use crate::scenario::Scenario;

/// Ring steps of a run, about.
const BUDGET: f64 = 1000.0;

/// Least number of steps of time.
const LEAST_TICKS: f64 = 20.0;

/// Tolerance of the balance, N.
const LEAST_N: f64 = 1e-2;

/// Longest stride, mm: the distance of the fastest and longest tick over the plant's most
/// strides.
const LONGEST_MM: f64 = 0.16;

/// Figures of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drove {
    /// Largest depth of the tread, mm.
    pub depth_mm: f64,
    /// Largest unbalanced radial force over the balanced one.
    pub unbalanced: f64,
    /// Largest speed of the tread over that of the unloaded motor.
    pub overspeed: f64,
    /// Energy gained without a source, mJ.
    pub created_mj: f64,
    /// What the stated approximations can account for, mJ.
    pub allowed_mj: f64,
}

/// The rig of a case: the nominal one with the case's parameters.
pub(super) fn plant(case: &StressCase) -> PlantParameters {
    let mut plant = Scenario::default().plant();
    // Strong enough to climb.
    let limit_n = 2.0 * (case.load_n + case.preload_n);
    plant.ring = case.ring();
    plant.wall = Wall::new(vec![Step { position_mm: 0.0, height_mm: case.step_mm }]);
    plant.arm.coupling = case.coupling;
    plant.stops_mm = (-100.0, 100.0);
    plant.mu = case.mu;
    plant.ripple.0 = 0.006 * limit_n;
    plant.load_n = case.load_n;
    plant.spring_n_per_mm = case.spring_n_per_mm;
    plant.mass_kg = case.mass_kg;
    plant.drive = DriveMotor {
        no_load_mm_s: case.no_load_mm_s(),
        stall_n: 2.0 * limit_n,
        limit_n,
        mass_kg: case.mass_kg / case.mass_ratio,
        friction_n: 0.02 * limit_n,
    };
    plant
}

fn ticks(case: &StressCase) -> usize {
    let per_tick = case.speed_mm_s * case.dt_s;
    let travel = 2.0 * case.reach_mm() + RADIUS_MM;
    let strides = (per_tick / 0.02).ceil().clamp(1.0, BUDGET / LEAST_TICKS);
    (travel / per_tick).ceil().clamp(LEAST_TICKS, BUDGET / strides) as usize
}

pub(super) fn run(case: &StressCase, plant: &PlantParameters) -> Result<Drove, PlantError> {
    let ticks = ticks(case);
    let travel = case.speed_mm_s * case.dt_s * ticks as f64;
    let lead = (0.3 * travel).clamp(0.01, 0.5 * RADIUS_MM);
    let start = if case.course == Course::Back { lead } else { -case.reach_mm() - 2.0 - lead };
    let mut rig = VirtualRig::new(plant.clone(), start, case.preload_n, case.dt_s)
        .with_speed(case.course.speed(0.0) * case.speed_mm_s);
    let mut out = Drove::default();
    let mut before = *rig.truth();
    // The screw does not move.
    let seat_n = before.preload_n - plant.spring_n_per_mm * (before.height_mm - RADIUS_MM);
    let (mut first, rest_mm) = (0.0, before.depth_mm);
    let (mut arm_work, mut modes, mut force) = (0.0, 0.0f64, 0.0f64);
    let mut fastest = case.speed_mm_s;
    for tick in 0..ticks {
        let part = tick as f64 / ticks as f64;
        let speed = case.course.speed(part) * case.speed_mm_s;
        let drive_on = !(case.course == Course::Coasting && part >= 0.5);
        let drive = speed / plant.drive.no_load_mm_s;
        rig.step(&Drives { drive, drive_on, ..Drives::default() }, case.dt_s)?;
        let now = *rig.truth();
        let rise = now.height_mm - before.height_mm;
        // An inclined arm carries its load along as the wheel rises.
        let slope = plant.arm.coupling * 0.5 * (now.arm_rad.tan() + before.arm_rad.tan());
        arm_work += plant.load_n * slope * rise;
        force = force.max(force_of(&now));
        fastest = fastest.max(now.speed_mm_s.abs()).max(now.tread_mm_s.abs());
        // Motion of the wheel takes nothing from the arm's modes.
        modes = modes.max(arm_work - rig.energy().arm_mj);
        let held = mechanical(plant, &now, seat_n) + arm_work - now.work_mj;
        if tick == 0 {
            first = held;
        }
        let gained = held - first;
        out.created_mj = largest(out.created_mj, gained);
        out.depth_mm = out.depth_mm.max(now.depth_mm);
        let unbalanced = now.unbalanced_n.abs() / force_of(&now).max(LEAST_N);
        out.unbalanced = largest(out.unbalanced, unbalanced);
        let top = plant.drive.no_load_mm_s;
        out.overspeed = out.overspeed.max(now.tread_mm_s.abs() / top);
        before = now;
    }
    // The tread's own store; heights to the ring's elements and forces to a stride.
    let pressed = case.preload_n + 1.1 * case.coupling.abs() * case.load_n;
    let stored = pressed * (rest_mm + out.depth_mm.min(1.0));
    let grain = std::f64::consts::TAU * RADIUS_MM / ELEMENTS as f64;
    let stride = (fastest * case.dt_s).min(LONGEST_MM);
    out.allowed_mj = stored + force * grain + (force + plant.load_n) * stride + modes;
    Ok(out)
}

/// The larger one; a value that is no number stays.
fn largest(most: f64, value: f64) -> f64 {
    if value <= most || most.is_nan() { most } else { value }
}

fn force_of(truth: &Truth) -> f64 {
    truth.floor_n + truth.corner_n
}

/// Kinetic and potential energy of masses, load and spring, mJ.
fn mechanical(plant: &PlantParameters, truth: &Truth, seat_n: f64) -> f64 {
    let spring = plant.spring_n_per_mm;
    // A slack spring does not pull.
    let pressed = (seat_n + spring * (truth.height_mm - RADIUS_MM)).max(0.0);
    let kinetic =
        plant.mass_kg * truth.speed_mm_s.powi(2) + plant.drive.mass_kg * truth.tread_mm_s.powi(2);
    0.5e-3 * kinetic + plant.load_n * truth.position_mm + 0.5 * pressed * pressed / spring
}

/// Stride, mm, and the most strides in a step of time: those of the plant.
const STRIDE_MM: f64 = 0.02;
const MOST_STRIDES: f64 = 256.0;

/// Ring steps of a run.
const ROLL_BUDGET: usize = 1000;

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

pub(super) fn roll(case: &StressCase) -> Result<Roll, BalanceError> {
    let per_tick = case.speed_mm_s * case.dt_s;
    let parts = (per_tick / STRIDE_MM).ceil().clamp(1.0, MOST_STRIDES);
    let (dt_s, stride) = (case.dt_s / parts, per_tick / parts);
    let reach = case.reach_mm();
    let longest = 2.0 * reach + RADIUS_MM;
    let steps = if stride > 0.0 {
        (longest / stride).ceil().min(ROLL_BUDGET as f64) as usize
    } else {
        ROLL_BUDGET / 4
    };
    // A run too short for the complete step begins somewhere on the step.
    let travel = stride * steps as f64;
    let lead = (travel * 0.4).min(0.5 * RADIUS_MM);
    let sense = case.course.speed(0.0);
    let first = if sense > 0.0 { -reach - lead } else { lead };
    let mut x = first + sense * case.phase * (longest - travel).max(0.0);
    let wall = Wall::new(vec![Step { position_mm: 0.0, height_mm: case.step_mm }]);
    let mut ring = Ring::new(case.ring());
    let balance = Balance::under(case.preload_n, Axial::Pushed);
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
        out.created_mj = largest(out.created_mj, -given - stored);
        out.depth_mm = if y.is_nan() { f64::NAN } else { out.depth_mm.max(contact.depth_mm) };
    }
    // A corner between two elements touches neither: heights are known to the distance of the
    // elements, work to that and the trapezoids of a stride.
    let grain = std::f64::consts::TAU * RADIUS_MM / ELEMENTS as f64 + stride;
    out.resolved_mj = case.preload_n * (grain + 0.01 * lift);
    Ok(out)
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_value_that_is_no_number_is_not_forgotten() {
        let of = |values: [f64; 3]| values.into_iter().fold(0.0, super::largest);
        assert!(of([1.0, f64::NAN, 2.0]).is_nan() && of([1.0, 3.0, 2.0]) == 3.0);
    }
}
