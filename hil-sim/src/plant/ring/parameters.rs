//! What a ring is made of, and what the wall does to it.

use interstage::rig::Rig;

/// Wheel and rubber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingParameters {
    /// Undeformed radius, mm.
    pub radius_mm: f64,
    pub width_mm: f64,
    /// Relaxed stiffness per area, N/mm^3 (1e9 Pa/m).
    pub k_inf: f64,
    /// Instant stiffness per area, N/mm^3.
    pub k_0: f64,
    /// Relaxation time, s.
    pub tau_s: f64,
    /// Elements around the ring.
    pub elements: usize,
    /// Thickness of the tread, a layer of incompressible rubber bonded to the hub, mm;
    /// 0: independent elements, of no thickness.
    pub tread_thickness_mm: f64,
    /// Thickness of the rubber by which independent elements give way along the wall, mm.
    pub layer_mm: f64,
    /// Spread s of two relaxations of equal share, at `tau_s / s` and `tau_s s`; 1: one.
    pub second_relaxation: f64,
}

impl RingParameters {
    /// Wheel and rubber of a rig, by this many elements.
    pub fn of(rig: &Rig, elements: usize) -> Self {
        // Pa/m to N/mm^3.
        let k_inf = rig.tread.k_inf_pa_per_m * 1e-9;
        Self {
            radius_mm: rig.rig.wheel_radius_mm,
            width_mm: rig.rig.wheel_width_mm,
            k_inf,
            k_0: k_inf * rig.tread.stiffening,
            tau_s: rig.tread.tau_s,
            elements,
            tread_thickness_mm: 0.0,
            layer_mm: rig.tread.thickness_mm,
            second_relaxation: 1.0,
        }
    }

    /// Way around the wheel from one element to the next, mm.
    pub fn pitch_mm(&self) -> f64 {
        std::f64::consts::TAU * self.radius_mm / self.elements as f64
    }

    /// Whether the elements are coupled.
    pub(crate) fn is_coupled(&self) -> bool {
        self.tread_thickness_mm > 0.0
    }

    pub(crate) fn relaxes_twice(&self) -> bool {
        self.second_relaxation > 1.0
    }

    /// Relaxation times, the faster one first, s.
    pub(crate) fn relaxations_s(&self) -> [f64; 2] {
        [self.tau_s / self.second_relaxation, self.tau_s * self.second_relaxation]
    }
}

/// Resultants of the contact pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// Sum of p over all contact, N.
    pub normal_n: f64,
    /// Sum of p cos(psi) over all contact, N.
    pub cosine_n: f64,
    /// Sum of p sin(psi) over all contact, N.
    pub sine_n: f64,
    /// The part of `cosine_n` carried by the floor, N.
    pub floor_n: f64,
    /// Sum of p cos(psi) over face and top of the step ahead, N.
    pub step_cosine_n: f64,
    /// Sum of p sin(psi) over face and top of the step ahead, N.
    pub step_sine_n: f64,
    /// Largest depth, at the point of the wall nearest to the centre, mm; negative is
    /// clearance.
    pub depth_mm: f64,
    /// Arc in contact times width, mm^2.
    pub area_mm2: f64,
    /// Largest pressure on the floor before it is cut off at zero, N/mm^2; where no
    /// element reaches the floor, minus what a fresh one would carry as deep in it as it
    /// is away, so that the instant of a touch-down lies on a straight line.
    pub floor_pressure: f64,
    /// Derivatives of `cosine_n` and `sine_n` by the centre's height, N/mm.
    pub slope: (f64, f64),
}

impl Contact {
    /// The contact a little higher up, by its derivatives, its parts as the whole.
    pub(crate) fn moved(self, change_mm: f64) -> Self {
        let cosine_n = self.cosine_n + self.slope.0 * change_mm;
        let part = cosine_n / self.cosine_n;
        Self {
            normal_n: self.normal_n * part,
            cosine_n,
            sine_n: self.sine_n + self.slope.1 * change_mm,
            floor_n: self.floor_n * part,
            step_cosine_n: self.step_cosine_n * part,
            step_sine_n: self.step_sine_n * part,
            depth_mm: self.depth_mm - change_mm,
            ..self
        }
    }

    /// Magnitude of the step's force on the wheel, N.
    pub(crate) fn step_force_n(&self) -> f64 {
        self.step_cosine_n.hypot(self.step_sine_n)
    }
}
