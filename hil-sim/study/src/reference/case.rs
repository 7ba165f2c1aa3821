//! What is crossed and how, for all stages alike.

use interstage::rig::Rig;

use hil_sim::plant::balance::{Axial, Balance, BalanceError};
use hil_sim::plant::crossing::{CrossingCase, CrossingResult, cross};
use hil_sim::plant::ring::RingParameters;

/// How finely a crossing is resolved. How near that is to the converged one, the tests of the
/// plant's crossing show, which is the same ring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resolution {
    /// Elements around the ring.
    pub elements: usize,
    /// Longest axial travel per step, mm.
    pub stride_mm: f64,
    pub step_s: f64,
}

impl Resolution {
    /// For histories: gap and force within 0.1 % of the converged ones.
    pub(crate) const HISTORY: Self = Self { elements: 2880, stride_mm: 0.01, step_s: 2e-4 };
}

/// One crossing of one step while deploying.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReferenceCase {
    /// Wheel, tread, arm, step, moved mass.
    pub rig: Rig,
    /// Axial speed, mm/s, held; above 0.
    pub speed_mm_s: f64,
    /// Radial preload, N, held; above 0.
    pub preload_n: f64,
    /// Frictionless ([`Axial::Pushed`], to which the tread is fitted), or driven by
    /// torque against the part of the top load that this wheel lifts.
    pub axial: Axial,
    pub resolution: Resolution,
}

impl ReferenceCase {
    /// A frictionless crossing of the rig's own step.
    pub(crate) fn new(rig: Rig, speed_mm_s: f64, preload_n: f64) -> Self {
        let resolution = Resolution::HISTORY;
        Self { rig, speed_mm_s, preload_n, axial: Axial::Pushed, resolution }
    }

    /// The first case of the study, at its top load of 60 N: 5 mm/s, 100 N.
    pub(crate) fn first() -> Self {
        Self::new(Rig::fe(), 5.0, 100.0)
    }

    /// The same crossing, driven by torque against this wheel's share of the top load.
    pub(crate) fn driven(self) -> Self {
        let load_n = self.rig.plant.top_load_n * self.rig.plant.top_load_share;
        Self { axial: Axial::Driven(load_n), ..self }
    }

    /// Wheel and tread as a ring.
    pub(crate) fn ring(&self) -> RingParameters {
        RingParameters::of(&self.rig, self.resolution.elements)
    }

    /// Radial load and how the wheel is moved.
    pub(crate) fn balance(&self) -> Balance {
        Balance::under(self.preload_n, self.axial)
    }

    /// The crossing of the plant's ring, without inertia.
    pub(crate) fn still(&self) -> Result<CrossingResult, BalanceError> {
        let Resolution { elements, stride_mm, .. } = self.resolution;
        let of = (self.speed_mm_s, self.preload_n, self.axial);
        cross(&CrossingCase::of(&self.rig, (elements, stride_mm), of))
    }

    /// Stiffness of the tread at once, per area, Pa/m: k_0.
    pub(crate) fn instant_pa_per_m(&self) -> f64 {
        self.rig.tread.k_inf_pa_per_m * self.rig.tread.stiffening
    }

    /// Angle between the wall and the path of a rigid wheel that touches the corner,
    /// rad: `cos phi = (R - h) / R`.
    pub(crate) fn climb_angle(&self) -> f64 {
        (1.0 - self.rig.rig.step_height_mm / self.rig.rig.wheel_radius_mm).acos()
    }

    /// Speed at which tread and corner close along their normal, mm/s: `v sin phi`.
    pub(crate) fn closing_speed_mm_s(&self) -> f64 {
        self.speed_mm_s * self.climb_angle().sin()
    }
}
