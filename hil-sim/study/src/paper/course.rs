//! A deployment over time, at even intervals, and the arm that bends in it.

use super::case::Case;
use crate::reference::vibration::{Arm, modal::Modal};
use crate::reference::{Case as Reference, ReferenceError};

/// Interval of a course, s.
const INTERVAL_S: f64 = 0.01;

/// Modes of the arm that are followed.
const MODES: usize = 6;

/// Points: time, s, and value.
pub type Points = Vec<(f64, f64)>;

/// The state of a deployment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instant {
    /// Time since the motion began, s.
    pub time_s: f64,
    /// Collision force, N.
    pub collision_n: f64,
    /// Impact stress, kPa.
    pub impact_kpa: f64,
    /// Deflection of the arm at the wheel, um.
    pub arm_um: f64,
    /// Clearance of the undeformed wheel from the root of the first step, mm, before it.
    pub clearance_mm: Option<f64>,
}

/// A deployment, one point an interval: collision and impact at its time, of the arm's
/// deflection the largest in the interval before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Course {
    /// Collision force, N.
    pub collision: Points,
    /// Impact stress, kPa.
    pub impact: Points,
    /// Deflection of the arm, um.
    pub vibration: Points,
    /// Clearance at the first step, mm.
    pub clearance: Points,
    largest_um: f64,
}

impl Course {
    /// Takes an instant not before the last.
    pub fn push(&mut self, now: &Instant) {
        self.largest_um = self.largest_um.max(now.arm_um.abs());
        let time = self.collision.len() as f64 * INTERVAL_S;
        if now.time_s < time - 1e-9 {
            return;
        }
        self.collision.push((now.time_s, now.collision_n));
        self.impact.push((now.time_s, now.impact_kpa));
        self.vibration.push((now.time_s, self.largest_um));
        if let Some(clearance) = now.clearance_mm {
            self.clearance.push((now.time_s, clearance));
        }
        self.largest_um = 0.0;
    }
}

/// The arm at each sleeve: the reference's, bent by the part of the collision force that
/// lies across it.
#[derive(Clone, Debug)]
pub struct Arms {
    arm: Arm,
    /// Sine of its angle from the pillar, by level.
    across: [f64; 3],
}

impl Arms {
    /// The arm of a case.
    ///
    /// # Errors
    /// [`ReferenceError`] if the arm refuses.
    pub fn of(case: &Case) -> Result<Self, ReferenceError> {
        let rig = case.loads.rig();
        let across = std::array::from_fn(|level| case.arm_rad(level).sin());
        let arm = Arm::of(&Reference::new(rig, case.speed_mm_s, case.preload_n))?;
        Ok(Self { arm, across })
    }

    /// Force across the arm of a collision force from sleeve `level`, N.
    #[must_use]
    pub fn across_n(&self, level: usize, collision_n: f64) -> f64 {
        self.across[level.min(2)] * collision_n
    }

    /// Deflection under a collision force that is held still, mm.
    #[must_use]
    pub fn still_mm(&self, level: usize, collision_n: f64) -> f64 {
        1e3 * self.arm.compliance_m_per_n() * self.across_n(level, collision_n)
    }

    /// Its motion.
    ///
    /// # Errors
    /// [`ReferenceError`] if the arm refuses.
    pub fn modal(&self) -> Result<Modal, ReferenceError> {
        self.arm.modal(MODES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::case::Loads;

    #[test]
    fn a_course_is_even_and_keeps_the_arm_s_peaks() {
        let mut course = Course::default();
        for index in 0..100 {
            let arm_um = if index == 55 { -9.0 } else { 1.0 };
            let time_s = f64::from(index) * 1e-3;
            course.push(&Instant { time_s, arm_um, collision_n: time_s, ..Instant::default() });
        }
        assert_eq!(course.collision.len(), 10);
        assert_eq!(course.vibration.iter().map(|p| p.1).fold(0.0, f64::max), 9.0);
        assert!((course.collision[7].1 - 0.07).abs() < 1e-9 && course.clearance.is_empty());
    }

    #[test]
    fn the_arm_lies_flatter_from_sleeve_to_sleeve() {
        let arms = Arms::of(&Case::new(Loads::Fe, 5.0, 100.0)).unwrap();
        let bent: Vec<f64> = (0..3).map(|level| arms.still_mm(level, 50.0)).collect();
        assert!(bent.windows(2).all(|pair| pair[1] < pair[0]), "{bent:?}");
        // 50 N sin(46.4 deg) on a cantilever of 145 mm.
        assert!((bent[0] / (36.2 * 0.145_f64.powi(3) / (3.0 * 244.69) * 1e3) - 1.0).abs() < 1e-3);
    }
}
