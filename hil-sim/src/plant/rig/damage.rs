//! What breaks while the rig runs.

use super::VirtualRig;
use crate::plant::rolling::Steady;

impl VirtualRig {
    /// Friction of tread on wall becomes this.
    pub fn set_friction(&mut self, mu: f64) {
        self.parameters.mu = mu;
        self.truth.friction = mu;
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
            self.calm.for_s = 0.0;
        }
    }

    /// The preload spring keeps this part of its rate, and with it of its force.
    pub fn break_spring(&mut self, part: f64) {
        self.parameters.spring_n_per_mm *= part;
        self.preload.weaken(part);
        self.derive();
    }
}

#[cfg(test)]
mod tests {
    use crate::plant::rig::{Drives, VirtualRig};
    use crate::scenario::Scenario;

    fn pressed() -> VirtualRig {
        let mut rig = VirtualRig::new(Scenario::default().plant(), 0.0, 30.0, 1e-3);
        for _ in 0..500 {
            rig.step(&Drives::default(), 1e-3).expect("a sound plant");
        }
        rig
    }

    #[test]
    fn a_broken_spring_presses_with_its_part() {
        let mut rig = pressed();
        let before = rig.truth().preload_n;
        rig.break_spring(0.5);
        for _ in 0..500 {
            rig.step(&Drives::default(), 1e-3).expect("a sound plant");
        }
        let part = rig.truth().preload_n / before;
        assert!((part - 0.5).abs() < 0.01, "{part}");
    }

    #[test]
    fn a_soft_tread_lets_the_wheel_sink() {
        let mut rig = pressed();
        let before = rig.truth().depth_mm;
        let ring = rig.parameters().ring;
        rig.set_stiffness(0.3 * ring.k_inf, 0.3 * ring.k_0);
        for _ in 0..1000 {
            rig.step(&Drives::default(), 1e-3).expect("a sound plant");
        }
        // Force grows as depth to 3/2.
        let deeper = rig.truth().depth_mm / before / (1.0f64 / 0.3).powf(2.0 / 3.0);
        assert!((deeper - 1.0).abs() < 0.05, "{deeper}");
    }
}
