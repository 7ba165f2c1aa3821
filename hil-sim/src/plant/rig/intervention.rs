//! The rig under an imposed rotation and preload, and parameters that change in a run.

use super::{Drives, MOST_STRIDES, PlantError, VirtualRig};
use crate::plant::rolling::Steady;

/// Height of a wheel above the wall that a block holds off, mm.
const BLOCK_MM: f64 = 3.0;

impl VirtualRig {
    /// Advances by `dt_s` with the wheel turning at this tread speed, mm/s, under this
    /// radial preload, N, in place of motor and pre-tightener. It is the total preload:
    /// the spring's rate must be 0. Modes of the arm are at rest.
    pub fn follow(&mut self, tread_mm_s: f64, preload_n: f64, dt_s: f64) -> Result<(), PlantError> {
        self.preload.hold(preload_n);
        self.imposed_speed_mm_s = Some(tread_mm_s);
        let parts = (tread_mm_s.abs() * dt_s / self.resolution.stride_mm).ceil();
        let parts = parts.clamp(1.0, MOST_STRIDES);
        for _ in 0..parts as usize {
            self.roll(&Drives::default(), dt_s / parts)?;
        }
        self.imposed_speed_mm_s = None;
        self.truth.time_s += dt_s;
        self.derive();
        self.check()
    }

    /// Load of the drive at the tread, N, signed as its speed: traction, and what rolling takes.
    pub const fn tread_load_n(&self) -> f64 {
        self.tread_load_n
    }

    /// Mean friction of tread on wall becomes this.
    pub(crate) fn set_friction(&mut self, mu: f64) {
        self.parameters.mu = mu;
    }

    /// Axial load on the wheel becomes this, N.
    pub fn set_load(&mut self, load_n: f64) {
        self.parameters.load_n = load_n;
    }

    /// Stiffness of the tread becomes this, N/mm^3, relaxed and instant.
    pub fn set_stiffness(&mut self, k_inf: f64, k_0: f64) {
        let ring = &mut self.parameters.ring;
        if (ring.k_inf, ring.k_0) != (k_inf, k_0) {
            (ring.k_inf, ring.k_0) = (k_inf, k_0);
            self.ring.set_stiffness(k_inf, k_0);
            self.steady = Steady::default();
            self.settle_timer.for_s = 0.0;
        }
    }

    /// Rests the carriage on its stop and the wheel, clear of the wall, on its spring, with a weight
    /// on it that pulls with this force, N, and a gauge under the compression sensor, mm.
    pub fn lift(&mut self, hung_n: f64, gauge_mm: Option<f64>) {
        (self.hung_n, self.gauge_mm, self.latched) = (hung_n, gauge_mm, true);
        self.blocked = false;
        let lift = (hung_n - self.preload.seat_n()) / self.parameters.spring_n_per_mm;
        let radius = self.parameters.ring.radius_mm + self.eccentric().1;
        self.truth.height_mm = radius + lift.max(self.base_mm);
        self.settle_timer.for_s = 0.0;
        self.derive();
    }

    /// Rests the carriage on its stop and holds the wheel by a block, clear of the wall.
    pub fn block(&mut self) {
        self.lift(self.preload.seat_n() + self.parameters.spring_n_per_mm * BLOCK_MM, None);
        (self.hung_n, self.blocked) = (0.0, true);
    }

    /// The preload spring keeps this part of its rate, and with it of its force.
    pub fn break_spring(&mut self, part: f64) {
        self.parameters.spring_n_per_mm *= part;
        self.preload.scale_force(part);
        self.derive();
    }
}
