//! One isolated crossing, at constant speed and preload or along a course, which is speed and
//! preload over the axle's place.

use std::path::Path;

use interstage::rig::Rig;
use serde::Deserialize;

use super::balance::{Axial, Balance, BalanceError};
use super::ring::{Contact, Motion, Ring, RingParameters};
use super::wall::{Step, Wall};

/// What is crossed, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingCase {
    /// Wheel and rubber.
    pub ring: RingParameters,
    pub step_height_mm: f64,
    /// Axial speed, mm/s; negative retracts.
    pub speed_mm_s: f64,
    pub preload_n: f64,
    /// Frictionless, or driven by torque against an axial load.
    pub axial: Axial,
    /// Axial travel per step of time, mm.
    pub stride_mm: f64,
}

impl CrossingCase {
    /// A crossing of this rig's step by a ring of so many elements, in strides of this axial
    /// travel, mm: its speed, mm/s, preload, N, and how it is moved.
    pub fn of(
        rig: &Rig,
        (elements, stride_mm): (usize, f64),
        (speed_mm_s, preload_n, axial): (f64, f64, Axial),
    ) -> Self {
        let (ring, step_height_mm) = (RingParameters::of(rig, elements), rig.rig.step_height_mm);
        Self { ring, step_height_mm, speed_mm_s, preload_n, axial, stride_mm }
    }
}

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
pub fn cross(case: &CrossingCase) -> Result<CrossingResult, BalanceError> {
    let speed_mm_s = case.speed_mm_s.abs();
    cross_along(case, &|_| (speed_mm_s, case.preload_n))
}

/// The same with the speed, mm/s, and the preload, N, of each place of the axle, mm from the face
/// outwards; of the case's speed the sign counts.
pub(crate) fn cross_along(
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
        let balance = Balance::under(preload_n, case.axial);
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

/// Largest speed, mm/s, and preload, N, of a course.
pub(crate) const MAX_SPEED_MM_S: f64 = 2000.0;
/// See [`MAX_SPEED_MM_S`].
pub(crate) const MAX_PRELOAD_N: f64 = 1000.0;

/// One line of a course.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Knot {
    /// Place of the axle from the face outwards, mm.
    pub x_mm: f64,
    /// Axial speed there, mm/s.
    pub speed_mm_s: f64,
    /// Radial force there, N.
    pub preload_n: f64,
}

/// Knots in the order in which the wheel comes to them: straight lines between them, the first one
/// before it, the last one behind it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Course(Vec<Knot>);

impl Course {
    /// Reads a CSV file with the columns of [`Knot`].
    ///
    /// # Errors
    /// One sentence that names the file, the line and what was expected.
    pub(crate) fn read(path: &Path, retracts: bool) -> Result<Self, String> {
        let at = |what: &dyn std::fmt::Display| format!("{}: {what}", path.display());
        let mut table = csv::Reader::from_path(path).map_err(|error| at(&error))?;
        let knots = table.deserialize().collect::<Result<_, _>>().map_err(|error| at(&error))?;
        Self::try_new(knots, retracts).map_err(|error| at(&error))
    }

    /// The course through these knots.
    ///
    /// # Errors
    /// One sentence that names the knot and what was expected.
    pub(crate) fn try_new(knots: Vec<Knot>, retracts: bool) -> Result<Self, String> {
        if knots.is_empty() {
            return Err("expected at least one row of x_mm, speed_mm_s, preload_n".to_owned());
        }
        for (index, knot) in knots.iter().enumerate() {
            for (name, value, most) in [
                ("speed_mm_s", knot.speed_mm_s, MAX_SPEED_MM_S),
                ("preload_n", knot.preload_n, MAX_PRELOAD_N),
            ] {
                // A NaN fails too.
                if !(value > 0.0 && value <= most) {
                    return Err(format!(
                        "row {}: {name} {value}: expected a value above 0, at most {most}",
                        index + 1
                    ));
                }
            }
            let before = index.checked_sub(1).map(|before| knots[before].x_mm);
            let onwards =
                before.is_none_or(|x| if retracts { knot.x_mm < x } else { knot.x_mm > x });
            if !(knot.x_mm.is_finite() && onwards) {
                let order = if retracts { "falls" } else { "rises" };
                return Err(format!(
                    "row {}: x_mm {}: expected a place that {order} from row to row",
                    index + 1,
                    knot.x_mm
                ));
            }
        }
        Ok(Self(knots))
    }

    /// Speed, mm/s, and preload, N, with which it begins.
    pub(crate) fn start(&self) -> (f64, f64) {
        (self.0[0].speed_mm_s, self.0[0].preload_n)
    }

    /// Speed, mm/s, and preload, N, at a place, mm.
    pub(crate) fn at(&self, x_mm: f64) -> (f64, f64) {
        let value = |knot: &Knot| (knot.speed_mm_s, knot.preload_n);
        let is_between = |pair: &&[Knot]| {
            let (a, b) = (pair[0].x_mm, pair[1].x_mm);
            (a.min(b)..a.max(b)).contains(&x_mm)
        };
        let Some([a, b]) = self.0.windows(2).find(is_between) else {
            let (first, last) = (&self.0[0], &self.0[self.0.len() - 1]);
            let is_before = (x_mm - first.x_mm).abs() < (x_mm - last.x_mm).abs();
            return value(if is_before { first } else { last });
        };
        let part = (x_mm - a.x_mm) / (b.x_mm - a.x_mm);
        let mix = |a: f64, b: f64| a + part * (b - a);
        (mix(a.speed_mm_s, b.speed_mm_s), mix(a.preload_n, b.preload_n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(knots: &[(f64, f64, f64)], retracts: bool) -> Result<Course, String> {
        let knot = |&(x_mm, speed_mm_s, preload_n): &_| Knot { x_mm, speed_mm_s, preload_n };
        Course::try_new(knots.iter().map(knot).collect(), retracts)
    }

    #[test]
    fn between_knots_it_is_straight_and_beyond_them_held() {
        let out = course(&[(-14.0, 20.0, 30.0), (-12.0, 10.0, 40.0)], false).unwrap();
        for (x, expected) in [(-50.0, (20.0, 30.0)), (-13.0, (15.0, 35.0)), (5.0, (10.0, 40.0))] {
            assert_eq!(out.at(x), expected, "{x}");
        }
        let back = course(&[(4.0, 20.0, 30.0), (-12.0, 4.0, 46.0)], true).unwrap();
        for (x, expected) in [(9.0, (20.0, 30.0)), (-4.0, (12.0, 38.0)), (-20.0, (4.0, 46.0))] {
            assert_eq!(back.at(x), expected, "{x}");
        }
    }

    #[test]
    fn a_course_that_no_wheel_can_drive_is_refused_by_its_row() {
        let error = |knots: &[(f64, f64, f64)]| course(knots, false).unwrap_err();
        assert!(error(&[]).contains("at least one row"));
        assert!(error(&[(0.0, 0.0, 30.0)]).starts_with("row 1: speed_mm_s 0"));
        assert!(error(&[(0.0, 1.0, f64::NAN)]).starts_with("row 1: preload_n NaN"));
        let twice = error(&[(0.0, 1.0, 30.0), (0.0, 1.0, 30.0)]);
        assert!(twice.starts_with("row 2: x_mm 0: expected a place that rises"), "{twice}");
        assert!(course(&[(0.0, 1.0, 30.0), (1.0, 1.0, 30.0)], true).is_err());
    }
}
