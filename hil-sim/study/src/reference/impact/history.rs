//! The stress that a crossing sends through the tread.

use super::Rubber;
use super::rod::{Face, Rod};
use super::rubber::THICKNESS_MM;
use crate::reference::beam::Beam;
use crate::reference::case::Case;
use crate::reference::collision::Crossing;
use crate::reference::error::ReferenceError;

/// Cells across the tread.
const CELLS: usize = 16;

/// Time between the instants that are given, s.
const SAMPLE_S: f64 = 1e-3;

/// Part of a wave's pressure that a hub of the arm's alloy sends back:
/// `(Z_hub - Z)/(Z_hub + Z)`, 0.98: it has a hundred times the impedance of rubber.
#[must_use]
pub fn hub_reflection(rubber: &Rubber) -> f64 {
    let alloy = Beam::drive_arm();
    let hub = (alloy.e_pa * alloy.rho_kg_m3).sqrt();
    (hub - rubber.impedance()) / (hub + rubber.impedance())
}

/// The tread of a case as a rod.
fn tread(case: &Case) -> Result<Rod, ReferenceError> {
    let rubber = Rubber::of(case)?;
    Rod::new(rubber, THICKNESS_MM * 1e-3, CELLS, hub_reflection(&rubber))
}

/// Time, s, from the touch of the corner on, and the stress increment at the hub, Pa:
/// the mean pressure of the contact above that of steady rolling (the study: what the
/// collision adds to the preload), sent through the tread as positive and negative waves.
///
/// The stress at the hub is that on the face a transit before, to some thousandths of its
/// peak.
///
/// # Errors
/// [`ReferenceError`] if the tread is none of a passive solid.
pub fn stress(case: &Case, crossing: &Crossing) -> Result<Vec<(f64, f64)>, ReferenceError> {
    let mut rod = tread(case)?;
    let Some(first) = crossing.samples.first() else { return Ok(Vec::new()) };
    let (mut t, mut next) = (first.t_s, first.t_s);
    let mut course = Vec::new();
    for pair in crossing.samples.windows(2) {
        let rate = (pair[1].pressure_pa - pair[0].pressure_pa) / (pair[1].t_s - pair[0].t_s);
        while t < pair[1].t_s {
            let pressure = pair[0].pressure_pa + rate * (t - pair[0].t_s);
            rod.step(Face::Pressure(pressure - crossing.cruise_pressure_pa));
            t += rod.step_s();
            if t >= next {
                course.push((t, rod.hub_pa()));
                next += SAMPLE_S;
            }
        }
    }
    Ok(course)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::collision::dynamic;

    #[test]
    fn the_hub_bears_what_the_face_does_a_transit_later() {
        let case = Case::study()[2].clone();
        let crossing = dynamic(&case).unwrap();
        let course = stress(&case, &crossing).unwrap();
        let peak = course.iter().map(|point| point.1).fold(0.0, f64::max);
        let transit = THICKNESS_MM * 1e-3 / Rubber::of(&case).unwrap().front_speed_m_s();
        let mut worst = 0.0_f64;
        for &(t, hub) in course.iter().filter(|(t, _)| *t > 0.05) {
            let t = t - transit;
            let after = crossing.samples.partition_point(|s| s.t_s < t).max(1);
            let [before, next] = [crossing.samples[after - 1], crossing.samples[after]];
            // Past the edge the ring shakes.
            if next.x_mm > -0.2 {
                break;
            }
            let part = (t - before.t_s) / (next.t_s - before.t_s);
            let face = before.pressure_pa + part * (next.pressure_pa - before.pressure_pa);
            worst = worst.max((hub - (face - crossing.cruise_pressure_pa)).abs());
        }
        assert!(peak > 1e4 && worst < 5e-3 * peak, "{worst} of {peak}");
    }
}
