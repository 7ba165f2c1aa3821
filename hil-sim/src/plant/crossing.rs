//! One isolated crossing, at constant speed and preload or along a course.

use super::balance::{Axial, Balance, BalanceError};
use super::ring::{Contact, Motion, Ring, RingParameters};
use super::wall::{Step, Wall};

/// What is crossed, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingCase {
    /// Wheel and rubber.
    pub ring: RingParameters,
    /// Step height, mm.
    pub step_height_mm: f64,
    /// Axial speed, mm/s; negative retracts.
    pub speed_mm_s: f64,
    /// Radial preload, N.
    pub preload_n: f64,
    /// Frictionless, or driven by torque against an axial load.
    pub axial: Axial,
    /// Axial travel per step of time, mm.
    pub stride_mm: f64,
}

/// What a crossing gives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CrossingResult {
    /// Clearance between step root and undeformed wheel when the lower wall stops
    /// (retract: begins) to carry, mm.
    pub gap_mm: f64,
    /// Largest axial force of the contact against the motion, N.
    pub corner_force_n: f64,
    /// Work of the axial contact force over the whole crossing, mJ.
    pub climb_work_mj: f64,
    /// Largest tread depth, mm.
    pub embedding_mm: f64,
    /// Largest friction utilisation; 0 when frictionless.
    pub mu_needed: f64,
    /// Wheel centre at that instant: axially from the face, and above the lower wall, mm.
    pub lift: (f64, f64),
    /// Tread depth at that instant, mm.
    pub lift_depth_mm: f64,
    /// Friction utilisation at that instant.
    pub lift_utilisation: f64,
    /// Contact area at that instant, mm^2.
    pub lift_area_mm2: f64,
}

/// Rolls the wheel over one step and measures.
///
/// # Errors
/// [`BalanceError`] if no height of the centre balances the preload.
pub fn cross(case: &CrossingCase) -> Result<CrossingResult, BalanceError> {
    let speed_mm_s = case.speed_mm_s.abs();
    cross_along(case, &|_| (speed_mm_s, case.preload_n))
}

/// The same with the speed, mm/s, and the preload, N, of each place of the axle, mm from the face
/// outwards; of the case's speed the sign counts.
///
/// # Errors
/// [`BalanceError`] if no height of the centre balances the preload.
pub fn cross_along(
    case: &CrossingCase,
    course: &dyn Fn(f64) -> (f64, f64),
) -> Result<CrossingResult, BalanceError> {
    let radius = case.ring.radius_mm;
    let forward = case.speed_mm_s > 0.0;
    let wall = Wall::new(vec![Step { position_mm: 0.0, height_mm: case.step_height_mm }]);
    let mut ring = Ring::new(case.ring);
    // Far enough before the corner to forget how the wheel was put down, and past
    // it until the patch has left the edge.
    let below = radius - case.step_height_mm;
    let run = (radius * radius - below * below).sqrt();
    let settle = |speed: f64| (8.0 * case.ring.tau_s * speed).min(2.0 * radius) + 0.5 * radius;
    let first = if forward { -run } else { 0.0 };
    let (start, end) = match (forward, settle(course(first).0)) {
        (true, settle) => (-run - settle, 0.6 * radius),
        (false, settle) => (settle, -run - 0.6 * radius),
    };
    let steps = ((end - start).abs() / case.stride_mm).ceil() as usize;
    let dx = case.stride_mm.copysign(case.speed_mm_s);

    let mut result = CrossingResult::default();
    let mut x = start;
    let mut height = radius - 0.01;
    let mut base = wall.local(x).base_mm;
    let mut last: Option<(f64, f64, Contact, f64)> = None;
    let mut previous_axial = 0.0;
    for index in 0..steps {
        x = start + dx * (index + 1) as f64;
        let local = wall.local(x);
        height += base - local.base_mm;
        base = local.base_mm;
        let (speed_mm_s, preload_n) = course(x);
        let dt_s = case.stride_mm / speed_mm_s;
        let balance = Balance { preload_n, spring_n_per_mm: 0.0, arm_n: 0.0, axial: case.axial };
        let motion = Motion { wall: local, height_mm: height, turn_rad: dx / radius, dt_s };
        let solved = balance.solve(&mut ring, motion)?;
        height = solved.height_mm;
        ring.commit(&Motion { height_mm: height, ..motion });
        let absolute = height + base;
        let contact = solved.contact;
        let near = x.abs() < run + 0.5 * radius;
        if near {
            let axial = contact.sine_n;
            if index > 0 {
                result.climb_work_mj += 0.5 * (axial + previous_axial) * dx;
            }
            result.corner_force_n = result.corner_force_n.max(axial);
            result.embedding_mm = result.embedding_mm.max(contact.depth_mm);
            result.mu_needed = result.mu_needed.max(solved.utilisation);
        }
        previous_axial = contact.sine_n;
        // Floor pressure relative to the lower wall: before the face that is the
        // wall under the centre.
        if x < 0.0 {
            if let Some((x0, y0, before, used)) = last {
                let (a, b) = (before.floor_pressure, contact.floor_pressure);
                let lifted = if forward { a > 0.0 && b <= 0.0 } else { a <= 0.0 && b > 0.0 };
                if lifted && result.gap_mm == 0.0 && x > -run {
                    let part = a / (a - b);
                    let mix = |from: f64, to: f64| from + part * (to - from);
                    let (xl, yl) = (mix(x0, x), mix(y0, absolute));
                    result.gap_mm = xl.hypot(yl) - radius;
                    result.lift = (xl, yl);
                    result.lift_depth_mm = mix(before.depth_mm, contact.depth_mm);
                    result.lift_utilisation = mix(used, solved.utilisation);
                    result.lift_area_mm2 = mix(before.area_mm2, contact.area_mm2);
                }
            }
            last = Some((x, absolute, contact, solved.utilisation));
        }
    }
    Ok(result)
}
