//! Vibration: the arm under the force of a crossing.
//!
//! The study turns the stress waves of the impact into the excitation of a beam (41-56)
//! and takes the amplitude of that beam for the contact gap. Here the arm is [`beam`] with
//! the wheel as a mass at its tip, the collision force bends it, and the amplitude is what
//! it is: tenths of a millimetre of still bending, less than a micrometre of vibration. The published
//! millimetres are the clearance at the step root, see [`collision`].
//!
//! [`beam`]: super::beam
//! [`collision`]: super::collision

mod arm;
pub mod modal;

use super::case::Case;
use super::collision::Crossing;
use super::error::ReferenceError;

pub use arm::{Arm, CONSTRAINED_HZ, FREE_HZ};

/// Time between the instants that are given, s.
const SAMPLE_S: f64 = 1e-3;

/// Modes that move; those beyond, above 20 kHz, follow as if still.
const MODES: usize = 6;

/// The arm's motion at the wheel at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bending {
    /// Time since the touch of the corner, s.
    pub t_s: f64,
    /// Deflection at the wheel across the arm, mm.
    pub deflection_mm: f64,
    /// Part of it that a force held still would not give, mm: the vibration.
    pub vibration_mm: f64,
}

/// Deflection at the wheel across the arm under what the crossing adds to the force of
/// steady rolling.
///
/// # Errors
/// [`ReferenceError`] if the rig's arm is out of range.
pub fn bending(case: &Case, crossing: &Crossing) -> Result<Vec<Bending>, ReferenceError> {
    let arm = Arm::of(case)?;
    let mut modal = arm.modal(MODES)?;
    let forces = across(case, &arm, crossing);
    let mut course = Vec::new();
    let mut next = f64::NEG_INFINITY;
    let mut last: Option<(f64, f64)> = None;
    for (t_s, force_n) in forces {
        let Some((before_s, _)) = last.replace((t_s, force_n)) else {
            modal.rest(force_n);
            continue;
        };
        modal.step(force_n, t_s - before_s);
        if t_s >= next {
            let deflection_mm = 1e3 * modal.deflection_m();
            let vibration_mm = 1e3 * modal.vibration_m();
            course.push(Bending { t_s, deflection_mm, vibration_mm });
            next = t_s + SAMPLE_S;
        }
    }
    Ok(course)
}

/// Force across the arm over time, less that of steady rolling: the collision force and
/// what accelerates the wheel radially, each by its part across the inclined arm.
fn across(case: &Case, arm: &Arm, crossing: &Crossing) -> Vec<(f64, f64)> {
    let rolling: Vec<f64> =
        crossing.samples.iter().filter(|s| s.t_s < 0.0).map(|s| s.axial_n).collect();
    let steady = rolling.iter().sum::<f64>() / rolling.len().max(1) as f64;
    let (sin, cos) = arm.angle_rad.sin_cos();
    let force = |axial: f64, radial: f64| (axial - steady) * sin + (radial - case.preload_n) * cos;
    crossing.samples.iter().map(|s| (s.t_s, force(s.axial_n, s.radial_n))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::collision::dynamic;

    fn course(speed_mm_s: f64) -> (Vec<Bending>, f64) {
        let case = Case { speed_mm_s, ..Case::study()[0].clone() };
        let compliance = Arm::of(&case).unwrap().compliance_m_per_n();
        let crossing = dynamic(&case).unwrap();
        let climb = crossing.peak_n() - crossing.samples[0].axial_n;
        (bending(&case, &crossing).unwrap(), climb * compliance * 1e3)
    }

    #[test]
    fn at_millimetres_per_second_the_arm_bends_as_under_a_still_force() {
        let (course, still_mm) = course(5.0);
        let most = course.iter().map(|now| now.deflection_mm).fold(0.0, f64::max);
        // sin(46.4 deg) of the climbing force, less rolling resistance, lies across the arm.
        assert!((most / (0.724 * still_mm) - 1.0).abs() < 0.01, "{most} {still_mm}");
        assert!((0.1..0.25).contains(&most), "{most}");
        let climbing = course.iter().filter(|now| now.t_s < 2.0);
        let shaken = climbing.map(|now| now.vibration_mm.abs()).fold(0.0, f64::max);
        assert!(shaken < 0.01 * most, "{shaken} {most}");
    }

    #[test]
    fn vibration_grows_with_speed() {
        let most = |speed: f64| {
            let (course, _) = course(speed);
            // Before the edge passes under the centre, where the ring's grain shakes.
            let climbing = course.iter().filter(|now| now.t_s * speed < 10.0);
            climbing.map(|now| now.vibration_mm.abs()).fold(0.0, f64::max)
        };
        let (slow, medium, fast) = (most(8.0), most(50.0), most(400.0));
        assert!(slow < medium && medium < fast, "{slow} {medium} {fast}");
    }

    #[test]
    fn nothing_moves_before_the_touch() {
        let (course, still_mm) = course(8.0);
        for now in course.iter().filter(|now| now.t_s < -0.02) {
            assert!(now.deflection_mm.abs() < 0.02 * still_mm, "{now:?}");
        }
    }
}
