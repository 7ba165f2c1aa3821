//! Vibration of the arm.

use std::f64::consts::TAU;

use super::VirtualRig;
use crate::plant::arm::Ripple;

impl VirtualRig {
    /// Force of the contact on the arm's modes, N: what the tread has to push with against load
    /// and step, by the torque that the motor on the arm holds against it. By the direction of
    /// the contact's force, so that neither the modes' own force nor the carriage's inertia,
    /// which both follow a tick late, drives them.
    fn excitation_n(&self) -> f64 {
        let (_, cosine, sine) = self.forces;
        if cosine <= 0.0 {
            return 0.0;
        }
        let (leans, load) = (sine / cosine, self.parameters.load_n);
        let pressed = self.preload_now() + self.thrust_ratio() * self.thrust_n;
        let carried = ((pressed - load * leans) / (1.0 + leans * leans)).max(0.0);
        let friction = self.parameters.friction_at(self.truth.position_mm);
        (load + leans * carried).min(friction * carried)
    }

    /// Modes of the arm, forced by the torque ripple of motor and gearbox and by the load that
    /// the contact puts on the drive.
    pub(super) fn vibrate(&mut self, dt_s: f64) {
        let load_n = self.excitation_n();
        let load = (std::mem::replace(&mut self.excitation_n, load_n), load_n);
        let (amplitude, pitch) = self.parameters.ripple;
        let spin = self.truth.tread_mm_s;
        let tread = self.truth.rotation_rad * self.parameters.ring.radius_mm;
        let to = (TAU * (tread / pitch).fract()).sin_cos();
        let force = Ripple {
            amplitude_n: if spin == 0.0 { 0.0 } else { amplitude },
            omega: TAU * spin / pitch,
            from: std::mem::replace(&mut self.ripple_phase, to),
            to,
        };
        let (mut deflection, mut sum) = (0.0, 0.0);
        for mode in &mut self.modes {
            mode.step(&force, load, dt_s);
            deflection += mode.deflection_mm();
            sum += mode.force_n();
        }
        self.truth.vibration_mm = deflection;
        self.vibration_n = sum / self.modes.len().max(1) as f64;
    }
}
