//! What a ring is made of.

use interstage::rig::Rig;

/// Wheel and rubber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingParameters {
    /// Undeformed radius, mm.
    pub radius_mm: f64,
    /// Width, mm.
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
            second_relaxation: 1.0,
        }
    }

    /// Whether the elements are coupled.
    pub fn is_coupled(&self) -> bool {
        self.tread_thickness_mm > 0.0
    }

    /// Whether the rubber relaxes twice.
    pub fn relaxes_twice(&self) -> bool {
        self.second_relaxation > 1.0
    }

    /// Relaxation times, the faster one first, s.
    pub fn relaxations_s(&self) -> [f64; 2] {
        [self.tau_s / self.second_relaxation, self.tau_s * self.second_relaxation]
    }
}
