//! How the rubber of a wheel gives way along the wall.

use core::f64::consts::{PI, TAU};

/// Length of the contact that the stiffness is taken at, mm: the corner's at 33 to 50 N, where
/// traction is largest. The wall's is twice as long and 1.2 times as stiff.
const REFERENCE_MM: f64 = 2.5;

/// Rubber between rim and hub, displaced along the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shear {
    /// Stiffness of the relaxed tread along the wall, N/mm.
    pub n_per_mm: f64,
    /// Relaxation length over the length of the contact.
    pub relaxation_lengths: f64,
}

impl Shear {
    /// The layer of rubber on a wheel, `k_inf` in N/mm^3.
    ///
    /// Incompressible rubber of thickness t and width L, bonded to the hub, on a contact of length
    /// a under elliptic pressure and traction in proportion to it, G its relaxed shear modulus:
    /// `G L / k = ln(1 + 9.9 t/a) / 2 pi + ((1 - t/R)^-2 - 1) / 4 pi + 0.22 t/R`, the compliance of
    /// a flat layer, the rim's rotation on the hub, and the curvature. Within 2 % of the sum over
    /// the waves of the layer, at 2.5 mm and from 3 to 16 mm thick. Steady creep is that of a
    /// half-space, `F / (pi G L a)` (Johnson, Contact Mechanics, 8.3).
    pub fn of_layer(radius_mm: f64, width_mm: f64, thickness_mm: f64, k_inf: f64) -> Self {
        let compliance = compliance_of(radius_mm, thickness_mm, REFERENCE_MM);
        Self {
            n_per_mm: modulus(thickness_mm, k_inf) * width_mm / compliance,
            relaxation_lengths: PI * compliance,
        }
    }
}

/// Relaxed shear modulus, N/mm^2, that gives the gap of independent elements of `k_inf` at 100 N:
/// within 2 % from 3 to 16 mm thick.
pub fn modulus(thickness_mm: f64, k_inf: f64) -> f64 {
    let cubed = |x: f64| x * x * x;
    let thin = 1.0 + cubed(2.27 / thickness_mm);
    k_inf * 0.1096 * thickness_mm / (thin * (1.0 + 0.0052 * thickness_mm))
}

/// Displacement of the rim in the contact per traction, times `G L`.
pub fn compliance_of(radius_mm: f64, thickness_mm: f64, contact_mm: f64) -> f64 {
    let part = thickness_mm / radius_mm;
    let hub = 1.0 - part;
    let layer = libm::log1p(9.9 * thickness_mm / contact_mm) / TAU;
    let rotation = (1.0 / (hub * hub) - 1.0) / (2.0 * TAU);
    layer + rotation + 0.22 * part
}

impl super::Rig {
    /// How its tread gives way along the wall.
    pub fn shear(&self) -> Shear {
        let k_inf = 1e-9 * self.tread.k_inf_pa_per_m;
        let (radius, width) = (self.rig.wheel_radius_mm, self.rig.wheel_width_mm);
        Shear::of_layer(radius, width, self.tread.thickness_mm, k_inf)
    }
}
