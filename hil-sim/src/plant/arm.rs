//! The inclined drive arm: geometry, friction of its pivot, and its first modes as oscillators.

use interstage::rig::Rig;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    pub length_mm: f64,
    /// Pivot's distance from the pillar axis, mm.
    pub pivot_mm: f64,
    /// Sense of the axial coupling, see [`interstage::rig::Loads::arm_coupling`].
    pub coupling: f64,
}

impl Arm {
    pub fn of(rig: &Rig) -> Self {
        let (length_mm, pivot_mm) = (rig.rig.arm_length_mm, rig.rig.arm_pivot_radius_mm);
        Self { length_mm, pivot_mm, coupling: rig.plant.arm_coupling }
    }

    /// Angle from the pillar with the wheel centre at this radius, rad.
    pub fn angle(&self, radius_mm: f64) -> f64 {
        ((radius_mm - self.pivot_mm) / self.length_mm).clamp(-1.0, 1.0).asin()
    }

    /// Radial force that an axial thrust adds, per unit of thrust.
    pub fn thrust_ratio(&self, radius_mm: f64) -> f64 {
        // Tangent of the angle from its sine.
        let sine = ((radius_mm - self.pivot_mm) / self.length_mm).clamp(-1.0, 1.0);
        self.coupling * sine / (1.0 - sine * sine).sqrt()
    }
}

/// A mode of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeParameters {
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    pub damping: f64,
    pub mass_kg: f64,
    /// Shape where the force at the tread acts: the part of that force that drives the mode.
    pub shape: f64,
}

impl ModeParameters {
    /// A mode at this frequency, Hz. The paper publishes 276 Hz for the constrained and 163 Hz
    /// for the free rig and nothing else: damping 0.02, modal mass 0.2 kg and shape 1 are chosen.
    /// The arm alone has 0.073 kg; wheel and motor move with its end.
    pub(crate) const fn at(frequency_hz: f64) -> Self {
        Self { frequency_hz, damping: 0.02, mass_kg: 0.2, shape: 1.0 }
    }
}

/// A sinusoidal force over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ripple {
    pub amplitude_n: f64,
    /// Circular frequency, rad/s; signed.
    pub omega: f64,
    /// Sine and cosine of the phase at the step's start.
    pub from: (f64, f64),
    /// Sine and cosine of the phase at its end.
    pub to: (f64, f64),
}

/// One mode of the arm: a damped oscillator, integrated exactly for a sinusoidal force and one
/// that runs linearly.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Mode {
    /// Circular frequency, rad/s.
    omega: f64,
    /// Damping ratio.
    zeta: f64,
    /// Modal stiffness, N/mm.
    stiffness: f64,
    /// Part of the force that drives it.
    shape: f64,
    /// Deflection by which it holds the slow force, mm.
    held: f64,
    /// Deflection, mm.
    deflection: f64,
    /// Its rate, mm/s.
    rate: f64,
    /// Step that the propagator is made for, s.
    step: f64,
    /// Propagator of the free motion (deflection, rate).
    propagator: [[f64; 2]; 2],
}

impl Mode {
    /// A mode at rest.
    pub(crate) fn new(parameters: ModeParameters) -> Self {
        let ModeParameters { frequency_hz, damping: zeta, mass_kg, shape } = parameters;
        let omega = std::f64::consts::TAU * frequency_hz;
        Self { omega, zeta, stiffness: mass_kg * omega * omega * 1e-3, shape, ..Self::default() }
    }

    /// Advances by `dt_s` under `force` and a force that runs from one value to the other, N:
    /// what is not the steady response to them dies away freely. That to the second one is
    /// `F/k - 2 zeta F'/(omega k)`. With x = Omega/omega the response to sin is
    /// ((1 - x^2) sin - 2 zeta x cos) / ((1 - x^2)^2 + (2 zeta x)^2) of the static one.
    pub(crate) fn step(&mut self, force: &Ripple, load_n: (f64, f64), dt_s: f64) {
        let still = self.deflection == 0.0 && self.rate == 0.0 && load_n == (0.0, 0.0);
        if force.amplitude_n == 0.0 && still {
            return;
        }
        if self.step != dt_s {
            self.prepare(dt_s);
        }
        let x = force.omega / self.omega;
        let (spring, damper) = (1.0 - x * x, 2.0 * self.zeta * x);
        let each =
            self.shape * force.amplitude_n / (self.stiffness * (spring * spring + damper * damper));
        let response = |(sin, cos): (f64, f64)| {
            let deflection = each * (spring * sin - damper * cos);
            (deflection, each * force.omega * (spring * cos + damper * sin))
        };
        let per_load = self.shape / self.stiffness;
        let (from, to) = (per_load * load_n.0, per_load * load_n.1);
        let rate = (to - from) / dt_s;
        let lag = 2.0 * self.zeta / self.omega * rate;
        let with =
            |(deflection, speed): (f64, f64), held: f64| (deflection + held - lag, speed + rate);
        let before = with(response(force.from), from);
        let after = with(response(force.to), to);
        self.held = to;
        let (u, v) = (self.deflection - before.0, self.rate - before.1);
        let m = &self.propagator;
        self.deflection = after.0 + m[0][0] * u + m[0][1] * v;
        self.rate = after.1 + m[1][0] * u + m[1][1] * v;
    }

    /// Deflection beyond that by which it holds the slow force, mm.
    pub(crate) fn deflection_mm(&self) -> f64 {
        self.deflection - self.held
    }

    /// Elastic force of that deflection, N.
    pub(crate) fn force_n(&self) -> f64 {
        self.deflection_mm() * self.stiffness
    }

    /// exp(A dt) of the underdamped oscillator.
    fn prepare(&mut self, dt_s: f64) {
        let (w, z) = (self.omega, self.zeta);
        let damped = w * (1.0 - z * z).sqrt();
        let decay = (-z * w * dt_s).exp();
        let (sin, cos) = (damped * dt_s).sin_cos();
        self.propagator = [
            [decay * (cos + z * w / damped * sin), decay * sin / damped],
            [-decay * w * w / damped * sin, decay * (cos - z * w / damped * sin)],
        ];
        self.step = dt_s;
    }
}

/// Travel over which the pivot's friction turns round, mm at the wheel. Chosen, so that it is
/// softer than the tread.
const TURNS_IN_MM: f64 = 0.05;

/// Coulomb friction in the arm's pivot that turns round over a short travel (Dahl's model,
/// linear up to its bound).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pivot {
    /// Friction, N at the wheel.
    friction_n: f64,
    /// Travel since friction turned round, mm, bounded either way.
    bent_mm: f64,
}

impl Pivot {
    /// A pivot with this friction, N at the wheel, relaxed.
    pub(crate) const fn new(friction_n: f64) -> Self {
        Self { friction_n, bent_mm: 0.0 }
    }

    /// The wheel has moved by this towards the pillar, mm.
    pub(crate) fn follow(&mut self, rise_mm: f64) {
        self.bent_mm = (self.bent_mm + rise_mm).clamp(-TURNS_IN_MM, TURNS_IN_MM);
    }

    /// Force that presses the wheel to the wall, N: against its motion.
    pub(crate) fn force_n(&self) -> f64 {
        self.friction_n * self.bent_mm / TURNS_IN_MM
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force of this amplitude and circular frequency from `t` to `t + dt`.
    fn ripple(amplitude_n: f64, omega: f64, phase: f64, t: f64, dt: f64) -> Ripple {
        let at = |t: f64| (omega * t + phase).sin_cos();
        Ripple { amplitude_n, omega, from: at(t), to: at(t + dt) }
    }

    #[test]
    fn a_step_force_rings_down_to_its_static_deflection() {
        let mut mode = Mode::new(ModeParameters::at(276.0));
        let rest = 5.0 / (0.2 * (std::f64::consts::TAU * 276.0).powi(2) * 1e-3);
        // A sine of no frequency at its crest.
        let held = ripple(5.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0, 2.5e-4);
        let mut peak = 0.0f64;
        for _ in 0..4000 {
            mode.step(&held, (0.0, 0.0), 2.5e-4);
            peak = peak.max(mode.deflection_mm());
        }
        let overshoot = 1.0 + (-std::f64::consts::PI * 0.02 / (1.0f64 - 4e-4).sqrt()).exp();
        assert!((peak / rest - overshoot).abs() < 0.02, "{}", peak / rest);
        assert!((mode.deflection_mm() / rest - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_step_does_not_matter() {
        for omega in [0.0, 40.0, -1020.0, 1734.0, 1e5] {
            let [coarse, fine] = [1usize, 50].map(|parts| {
                let mut mode = Mode::new(ModeParameters::at(276.0));
                let dt = 1e-3 / parts as f64;
                for i in 0..100 * parts {
                    let load = |i: usize| 3.0 * i as f64 * dt;
                    let load = (load(i), load(i + 1));
                    mode.step(&ripple(0.5, omega, 0.3, i as f64 * dt, dt), load, dt);
                }
                (mode.deflection_mm(), mode.rate)
            });
            assert!((coarse.0 - fine.0).abs() < 1e-12, "{coarse:?} {fine:?}");
            assert!((coarse.1 - fine.1).abs() < 1e-8, "{coarse:?} {fine:?}");
        }
    }

    #[test]
    fn a_load_that_comes_at_once_shakes_and_one_that_comes_slowly_does_not() {
        let shakes = |rise_s: f64| {
            let mut mode = Mode::new(ModeParameters::at(163.0));
            let load = |i: i32| 20.0 * (f64::from(i) * 1e-3 / rise_s).min(1.0);
            (0..1000).fold(0.0f64, |most, i| {
                mode.step(&ripple(0.0, 0.0, 0.0, 0.0, 1e-3), (load(i), load(i + 1)), 1e-3);
                most.max(mode.force_n().abs())
            })
        };
        // A ramp's kink rings with its slope over omega; what comes within a tick, with all.
        let kink = |rise_s: f64| 20.0 / rise_s / (std::f64::consts::TAU * 163.0);
        assert!((shakes(0.1) / kink(0.1) - 1.0).abs() < 0.9, "{} {}", shakes(0.1), kink(0.1));
        assert!(shakes(1e-3) > 15.0 && shakes(0.1) < 0.4);
    }

    #[test]
    fn the_wedge_falls_as_the_sleeve_narrows() {
        let arm = Arm { length_mm: 145.0, pivot_mm: 20.0, coupling: 1.0 };
        assert!((arm.angle(125.0).to_degrees() - 46.397).abs() < 1e-2);
        assert!(arm.thrust_ratio(125.0) > arm.thrust_ratio(113.0));
        assert!(arm.thrust_ratio(113.0) > 0.8);
    }

    #[test]
    fn friction_presses_against_the_motion_up_to_its_bound() {
        let mut pivot = Pivot::new(2.0);
        assert_eq!(pivot.force_n(), 0.0);
        pivot.follow(0.025);
        assert_eq!(pivot.force_n(), 1.0);
        pivot.follow(3.0);
        assert_eq!(pivot.force_n(), 2.0);
        // Both bounds apart: the hysteresis.
        pivot.follow(-0.1);
        assert_eq!(pivot.force_n(), -2.0);
    }
}
