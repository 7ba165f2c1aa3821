//! The rig led through what was recorded: spin and preload given, the rest computed.

use super::{Drives, PlantError, VirtualRig};

impl VirtualRig {
    /// Advances by `dt_s` with the wheel turning at this tread speed, mm/s, under this
    /// radial preload, N, in place of motor and pre-tightener. The preload is the whole
    /// of it: the spring's rate is to be 0. Modes of the arm stand still.
    ///
    /// # Errors
    /// [`PlantError`] when the state stops meaning anything.
    pub fn follow(&mut self, tread_mm_s: f64, preload_n: f64, dt_s: f64) -> Result<(), PlantError> {
        self.preload.hold(preload_n);
        self.led_mm_s = Some(tread_mm_s);
        let parts = (tread_mm_s.abs() * dt_s / self.resolution.stride_mm).ceil();
        let parts = parts.clamp(1.0, super::MOST_STRIDES);
        for _ in 0..parts as usize {
            self.roll(&Drives::default(), dt_s / parts)?;
        }
        self.led_mm_s = None;
        self.truth.time_s += dt_s;
        self.derive();
        self.check()
    }

    /// Traction of the tread, N: what the drive works against.
    #[must_use]
    pub fn traction_n(&self) -> f64 {
        self.truth.utilisation * self.forces.0
    }
}
