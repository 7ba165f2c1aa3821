//! Motion of the tip over time as a sum of modes, each exact for a force that runs in
//! straight pieces.

use crate::reference::beam::Shape;

/// One mode as an oscillator `u'' + 2 zeta w u' + w^2 u = W(L) F`.
#[derive(Clone, Copy, Debug)]
struct Oscillator {
    omega: f64,
    zeta: f64,
    /// W(L), 1/sqrt(kg).
    gain: f64,
    /// u and u', with the mode's scale.
    state: (f64, f64),
}

/// The tip under a force on it.
#[derive(Clone, Debug)]
pub struct Modal {
    oscillators: Vec<Oscillator>,
    /// Still deflection per force, and the part of it that the modes left out give, m/N.
    compliance: f64,
    rest_compliance: f64,
    force_n: f64,
}

impl Modal {
    /// At rest and unloaded: modes of one damping ratio, and the deflection per still
    /// force, m/N, to which the modes beyond them are taken to follow at once.
    #[must_use]
    pub fn new(shapes: &[Shape], zeta: f64, compliance_m_per_n: f64) -> Self {
        let oscillators: Vec<Oscillator> = shapes
            .iter()
            .map(|shape| Oscillator {
                omega: std::f64::consts::TAU * shape.mode.frequency_hz,
                zeta,
                gain: shape.tip(),
                state: (0.0, 0.0),
            })
            .collect();
        let held: f64 = oscillators.iter().map(|o| (o.gain / o.omega).powi(2)).sum();
        let rest_compliance = compliance_m_per_n - held;
        Self { oscillators, compliance: compliance_m_per_n, rest_compliance, force_n: 0.0 }
    }

    /// Sets it at rest under `force_n`.
    pub fn rest(&mut self, force_n: f64) {
        self.force_n = force_n;
        for oscillator in &mut self.oscillators {
            oscillator.state = (oscillator.gain * force_n / oscillator.omega.powi(2), 0.0);
        }
    }

    /// Runs the force linearly to `force_n` within `dt_s`, which must be above 0.
    ///
    /// Equation: with `f = F_0 + F' t` the motion is `(f - 2 zeta F'/w)/w^2` and a
    /// damped oscillation. Range: zeta from 0 to below 1. Error: rounding.
    pub fn step(&mut self, force_n: f64, dt_s: f64) {
        let rate = (force_n - self.force_n) / dt_s;
        for oscillator in &mut self.oscillators {
            oscillator.step(self.force_n, rate, dt_s);
        }
        self.force_n = force_n;
    }

    /// Deflection of the tip, m.
    #[must_use]
    pub fn deflection_m(&self) -> f64 {
        let modes: f64 = self.oscillators.iter().map(|o| o.gain * o.state.0).sum();
        modes + self.rest_compliance * self.force_n
    }

    /// Deflection beyond that of the same force held still, m.
    #[must_use]
    pub fn vibration_m(&self) -> f64 {
        self.deflection_m() - self.compliance * self.force_n
    }
}

impl Oscillator {
    fn step(&mut self, force_n: f64, rate: f64, dt: f64) {
        let (w, z) = (self.omega, self.zeta);
        let still = |force: f64| self.gain * (force - 2.0 * z * rate / w) / (w * w);
        let drift = self.gain * rate / (w * w);
        let (u, v) = (self.state.0 - still(force_n), self.state.1 - drift);
        let damped = w * (1.0 - z * z).sqrt();
        let decay = (-z * w * dt).exp();
        let (sin, cos) = (damped * dt).sin_cos();
        let (a, b) = (z * w / damped, 1.0 / damped);
        let moved = decay * ((cos + a * sin) * u + b * sin * v);
        let speed = decay * ((cos - a * sin) * v - w * w * b * sin * u);
        self.state = (still(force_n + rate * dt) + moved, drift + speed);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::super::Arm;
    use super::*;
    use crate::reference::Case;
    use crate::reference::beam::{Ends, Forcing};

    fn arm() -> Arm {
        Arm::of(&Case::study()[0]).unwrap()
    }

    #[test]
    fn it_settles_to_the_still_deflection() {
        let arm = arm();
        let mut modal = arm.modal(4).unwrap();
        modal.step(50.0, 1e-6);
        for _ in 0..200 {
            modal.step(50.0, 0.1);
        }
        let wanted = 50.0 * arm.beam.length_m.powi(3) / (3.0 * 244.6875);
        assert!((modal.deflection_m() / wanted - 1.0).abs() < 1e-9);
        assert!(modal.vibration_m().abs() < 1e-9 * wanted);
        let mut held = arm.modal(4).unwrap();
        held.rest(50.0);
        held.step(50.0, 0.3);
        assert!((held.deflection_m() / wanted - 1.0).abs() < 1e-9);
    }

    #[test]
    fn it_oscillates_as_the_waves_of_the_forced_response() {
        // Modes against (56): two ways to the same motion. The loss factor of the one is
        // the viscous damping of the other at resonance only, so beside it no damping.
        let arm = Arm { loss_factor: 0.0, ..arm() };
        let shapes = arm.beam.shapes(Ends::ClampedFree, arm.tip, 12).unwrap();
        for hz in [20.0, 150.0, 260.0, 290.0, 600.0] {
            let forcing = Forcing { at_m: arm.beam.length_m, frequency_hz: hz, loss_factor: 0.0 };
            let waves = arm
                .beam
                .receptance(Ends::ClampedFree, arm.tip, forcing, arm.beam.length_m)
                .unwrap();
            let square = (TAU * hz).powi(2);
            let held: f64 = shapes
                .iter()
                .map(|s| {
                    let own = (TAU * s.mode.frequency_hz).powi(2);
                    s.tip().powi(2) * (1.0 / (own - square) - 1.0 / own)
                })
                .sum();
            let modes = held + arm.compliance_m_per_n();
            assert!((modes / waves.re - 1.0).abs() < 1e-6, "{hz}: {modes} {}", waves.re);
        }
    }

    #[test]
    fn a_sine_is_followed_as_its_straight_pieces_get_short() {
        let arm = Arm { loss_factor: 0.1, ..arm() };
        let mut modal = arm.modal(1).unwrap();
        let (omega, dt) = (TAU * 200.0, 2e-5);
        let own = TAU * 276.0;
        let gain = arm.beam.shapes(Ends::ClampedFree, arm.tip, 1).unwrap()[0].tip().powi(2);
        let rest = arm.compliance_m_per_n() - gain / own.powi(2);
        let mut worst = 0.0_f64;
        for step in 1..=20_000 {
            let t = dt * f64::from(step);
            modal.step((omega * t).sin(), dt);
            if step > 15_000 {
                let (a, b) = (own * own - omega * omega, 0.1 * own * omega);
                let wanted =
                    gain * (a * (omega * t).sin() - b * (omega * t).cos()) / (a * a + b * b);
                worst = worst.max((modal.deflection_m() - wanted - rest * (omega * t).sin()).abs());
            }
        }
        // (omega dt)^2/12 of the force is lost with the corners; 2.1 is the resonance.
        let lost = (omega * dt).powi(2) / 12.0;
        assert!(worst < 2.2 * lost * gain / own.powi(2), "{worst:e}");
    }

    proptest! {
        #[test]
        fn the_cut_into_pieces_does_not_matter(
            forces in prop::collection::vec(-100.0..100.0_f64, 1..12), cuts in 2..9_u32,
        ) {
            let [mut whole, mut cut] = [arm().modal(5).unwrap(), arm().modal(5).unwrap()];
            let mut last = 0.0;
            for force in forces {
                whole.step(force, 3e-3);
                for piece in 1..=cuts {
                    let part = f64::from(piece) / f64::from(cuts);
                    cut.step(last + part * (force - last), 3e-3 / f64::from(cuts));
                }
                last = force;
                prop_assert!((whole.deflection_m() - cut.deflection_m()).abs() < 1e-12);
            }
        }

        #[test]
        fn left_alone_it_only_calms_down(force in 1.0..100.0_f64, dt in 1e-5..1e-1_f64) {
            let mut modal = arm().modal(1).unwrap();
            modal.rest(force);
            modal.step(0.0, 1e-6);
            let energy = |modal: &Modal| {
                let o = modal.oscillators[0];
                (o.omega * o.state.0).powi(2) + o.state.1.powi(2)
            };
            let mut last = energy(&modal);
            for _ in 0..50 {
                modal.step(0.0, dt);
                prop_assert!(energy(&modal) <= last);
                last = energy(&modal);
            }
        }
    }
}
