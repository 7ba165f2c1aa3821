//! From a rig to the tread's machine units, once at start.

use super::PitchedTread;
use crate::numeric::checked;
use crate::rig::{Rig, RigError};

/// Part of the compression by which a loaded rubber wheel rolls on less than its undeformed
/// radius (Clark, Mechanics of Pneumatic Tires).
const ROLLING_COMPRESSION: f64 = 1.0 / 3.0;

impl<const PITCH: u32, const ELEMENTS: usize> PitchedTread<PITCH, ELEMENTS> {
    /// The tread of a rig at one of its steps.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let radius = rig.rig.wheel_radius_mm;
        let scaled = |key, value: f64, bits: i32| {
            Ok::<i32, RigError>(checked(key, value)?.to_bits().saturating_mul(1 << bits))
        };
        let stride = 1e-6 * f64::from(PITCH) * radius;
        let rate = 1e-9 * rig.tread.k_inf_pa_per_m * rig.rig.wheel_width_mm * stride;
        Ok(Self {
            radius: scaled("rig.wheel_radius_mm", radius, 6)?,
            height: scaled("rig.step_height_mm", rig.rig.step_height_mm, 6)?,
            stride: checked("rig.wheel_radius_mm", stride)?,
            rate: checked("tread.k_inf_pa_per_m", rate)?,
            excess: scaled("tread.stiffening", rig.tread.stiffening - 1.0, 10)?,
            per_tau: checked("tread.tau_s", 1.0 / rig.tread.tau_s)?,
            rolling_lag: checked("rig.wheel_radius_mm", ROLLING_COMPRESSION / radius)?,
        })
    }
}
