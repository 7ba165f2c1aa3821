//! Collision force and impact stress from the state of the virtual rig.
//!
//! The collision force is the axial force of corner and face against the motion. The
//! plant does not keep it, but it follows from what it keeps: a gripping wheel carries
//! `C + u S = N` radially and `u C - S = T` axially, with the friction utilisation u,
//! the pressing force N and the thrust T; from S goes what the lower wall resists.

use super::theory::corner_area_mm2;
use crate::plant::rig::VirtualRig;

/// Watches a plant for the force of its corners.
#[derive(Clone, Copy, Debug, Default)]
pub struct CollisionGauge {
    /// Rolling resistance over radial force on the smooth wall.
    resistance: f64,
}

impl CollisionGauge {
    /// Axial force of corner and face against the motion, N, within the inertia of the
    /// carriage, 0.3 N, as long as the wheel grips; 0 on the continuous wall.
    pub fn read_n(&mut self, plant: &VirtualRig) -> f64 {
        let (truth, parameters) = (plant.truth(), plant.parameters());
        let used = truth.utilisation;
        let thrust = if used == 0.0 { 0.0 } else { parameters.load_n };
        let pressing = truth.preload_n + parameters.arm.wedge(truth.radius_mm) * thrust;
        let radial = (pressing + used * thrust) / (1.0 + used * used);
        let axial = used * radial - thrust;
        if truth.corner_n <= 0.0 {
            self.resistance = if radial > 0.0 { axial / radial } else { 0.0 };
            return 0.0;
        }
        (axial - self.resistance * truth.floor_n).max(0.0)
    }
}

/// Mean stress that this collision force puts on the face and top of the step ahead,
/// kPa (1e-3 N/mm^2): the force over the part of the wheel's undeformed arc that the
/// step cuts off.
#[must_use]
pub fn impact_kpa(plant: &VirtualRig, collision_n: f64) -> f64 {
    let (truth, parameters) = (plant.truth(), plant.parameters());
    let local = parameters.wall.local(truth.position_mm);
    let above = truth.height_mm - local.base_mm - local.rise_mm;
    let ring = &parameters.ring;
    stress_kpa(collision_n, corner_area_mm2(ring.radius_mm, ring.width_mm, local.ahead_mm, above))
}

/// Force over area, kPa; 0 where nothing touches.
#[must_use]
pub fn stress_kpa(force_n: f64, area_mm2: f64) -> f64 {
    if area_mm2 > 0.0 { 1e3 * force_n / area_mm2 } else { 0.0 }
}
