//! One isolated crossing, at constant speed and preload or over a course of both.

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

/// Rolls the wheel over one step at constant speed and preload, and measures.
///
/// # Errors
/// [`BalanceError`] if no height of the centre balances the preload.
pub fn cross(case: &CrossingCase) -> Result<CrossingResult, BalanceError> {
    cross_course(case, |_| (case.speed_mm_s.abs(), case.preload_n))
}

/// Where a crossing that begins at this speed starts and ends, mm from the face: far enough from
/// the corner to forget how the wheel was put down, and past it until the patch has left the edge.
#[must_use]
pub fn span_mm(case: &CrossingCase, speed_mm_s: f64) -> (f64, f64) {
    let radius = case.ring.radius_mm;
    let below = radius - case.step_height_mm;
    let run = (radius * radius - below * below).sqrt();
    let settle = (8.0 * case.ring.tau_s * speed_mm_s).min(2.0 * radius) + 0.5 * radius;
    if case.speed_mm_s > 0.0 {
        (-run - settle, 0.6 * radius)
    } else {
        (settle, -run - 0.6 * radius)
    }
}

/// The same where `course` gives speed, mm/s, not negative, and preload, N, at a position of the
/// axle, mm from the face. Of the case only the speed's sign counts.
///
/// # Errors
/// [`BalanceError`] if no height of the centre balances the preload.
pub fn cross_course(
    case: &CrossingCase,
    course: impl Fn(f64) -> (f64, f64),
) -> Result<CrossingResult, BalanceError> {
    let radius = case.ring.radius_mm;
    let forward = case.speed_mm_s > 0.0;
    let wall = Wall::new(vec![Step { position_mm: 0.0, height_mm: case.step_height_mm }]);
    let mut ring = Ring::new(case.ring);
    let below = radius - case.step_height_mm;
    let run = (radius * radius - below * below).sqrt();
    let far = if forward { f64::NEG_INFINITY } else { f64::INFINITY };
    let (start, end) = span_mm(case, course(far).0);
    let steps = ((end - start).abs() / case.stride_mm).ceil() as usize;
    let dx = case.stride_mm.copysign(case.speed_mm_s);

    let mut result = CrossingResult::default();
    let mut x = start;
    let mut height = radius - 0.01;
    let mut base = wall.local(x).base_mm;
    let mut last: Option<(f64, f64, Contact, f64)> = None;
    let mut previous_axial = 0.0;
    for index in 0..steps {
        // Timed by its middle, pressed as at its end.
        let dt = case.stride_mm / course(x + 0.5 * dx).0;
        x = start + dx * (index + 1) as f64;
        let (_, preload_n) = course(x);
        let balance = Balance { preload_n, spring_n_per_mm: 0.0, arm_n: 0.0, axial: case.axial };
        let local = wall.local(x);
        height += base - local.base_mm;
        base = local.base_mm;
        let motion = Motion { wall: local, height_mm: height, turn_rad: dx / radius, dt_s: dt };
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
