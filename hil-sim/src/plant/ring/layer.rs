//! The tread as a continuum: a layer of incompressible rubber in plane strain, bonded to the
//! rigid hub, small strains.
//!
//! A pressure of n waves around the rim presses it in by n waves. The rubber flows as in
//! creeping flow (Stokes and incompressible elasticity have the same equations): the stream
//! function is f(r) sin(n theta) with f from r^n, r^-n, r^(n+2), r^(2-n) (n = 1: r, 1/r, r^3,
//! r ln r; Michell 1899), no displacement at the hub, no shear at the rim. Incompressibility
//! leaves n = 0 without displacement: what is pressed in bulges out beside it.

use std::f64::consts::TAU;

use nalgebra::{Matrix4, Vector4};

use super::RingParameters;
use super::complementarity::Complementarity;

/// Waves per radius and thickness beyond which the layer is as good as a half-space, whose
/// compliance goes with the inverse of the waves.
const DEEP: f64 = 40.0;

/// Gap at which the shear modulus is calibrated, mm: that of the relaxed ring at the 4 mm
/// step under 100 N, as for the finite elements. Of another wheel both go with its radius.
const CALIBRATED_AT: Release = Release { radius_mm: 25.0, step_mm: 4.0, gap_mm: 1.487 };

/// Elements around the rim for the calibration.
const FINE: usize = 2880;

/// Rise of modulus with the largest compression over the thickness: the strain stiffening
/// that small strains leave out. Fitted to the 21 static gaps of the finite elements at a 4 mm
/// step (5, 8, 12 mm thick, 20 to 150 N); everything else is without it.
pub(super) const STIFFENING: f64 = 1.0 / 3.0;

/// A wheel pushed at a step, its lower wall just touched.
struct Release {
    radius_mm: f64,
    step_mm: f64,
    gap_mm: f64,
}

/// Inward displacement of the rim per inward pressure over shear modulus, mm, both of `waves`
/// waves around it.
fn mode_compliance(radius_mm: f64, thickness_mm: f64, waves: usize) -> f64 {
    if waves == 0 {
        return 0.0;
    }
    let [outward, _] = displacement(radius_mm, thickness_mm, waves, [0.0, -1.0]);
    -outward
}

/// Displacement of the rim along itself per shear traction over shear modulus, mm, both of
/// `waves` waves around it; without waves the rim turns on the hub.
#[cfg(test)]
pub(in crate::plant) fn shear_compliance(radius_mm: f64, thickness_mm: f64, waves: usize) -> f64 {
    if waves == 0 {
        let hub = 1.0 - thickness_mm / radius_mm;
        return 0.5 * radius_mm * (1.0 / (hub * hub) - 1.0);
    }
    displacement(radius_mm, thickness_mm, waves, [1.0, 0.0])[1]
}

/// Displacement of the rim outwards and along itself, mm, by this shear and normal stress over
/// shear modulus, of `waves` waves around it, at least 1.
fn displacement(
    radius_mm: f64,
    thickness_mm: f64,
    waves: usize,
    [shear, normal]: [f64; 2],
) -> [f64; 2] {
    let n = waves as f64;
    let hub = 1.0 - thickness_mm / radius_mm;
    // Value and two derivatives of each part of f, and its pressure over the modulus at the
    // rim, both at radius 1; what grows inwards is scaled to the hub.
    let power = |e: f64, scale: f64, r: f64| {
        let value = scale * r.powf(e);
        [value, e * value / r, e * (e - 1.0) * value / (r * r)]
    };
    let inwards = |e: f64, r: f64| {
        let value = (hub / r).powf(n) * r.powf(e + n);
        [value, e * value / r, e * (e - 1.0) * value / (r * r)]
    };
    let parts = |r: f64| {
        if waves == 1 {
            let log = [r * r.ln(), r.ln() + 1.0, 1.0 / r];
            [power(1.0, 1.0, r), power(-1.0, 1.0, r), power(3.0, 1.0, r), log]
        } else {
            [power(n, 1.0, r), inwards(-n, r), power(n + 2.0, 1.0, r), inwards(2.0 - n, r)]
        }
    };
    let pressures = if waves == 1 {
        [0.0, 0.0, 8.0, -2.0]
    } else {
        [0.0, 0.0, 4.0 * (n + 1.0), 4.0 * (n - 1.0) * hub.powf(n)]
    };
    let (at_hub, at_rim) = (parts(hub), parts(1.0));
    let column = |j: usize| {
        let ([v, d, _], [value, slope, bend]) = (at_hub[j], at_rim[j]);
        // Radial and tangential displacement at the hub, shear and normal stress at the rim.
        let normal = -pressures[j] + 2.0 * n * (slope - value);
        Vector4::new(v, d, -n * n * value - bend + slope, normal)
    };
    let columns = [0, 1, 2, 3].map(column);
    let scales = columns.map(|c| c.amax());
    let matrix = Matrix4::from_columns(&[0, 1, 2, 3].map(|j| columns[j] / scales[j]));
    let solved = matrix.lu().solve(&Vector4::new(0.0, 0.0, shear, normal));
    // Singular at no thickness alone: nothing moves.
    let solved = solved.unwrap_or_else(Vector4::zeros);
    let sum = |of: usize| (0..4).map(|j| solved[j] / scales[j] * at_rim[j][of]).sum::<f64>();
    [sum(0) * n * radius_mm, -sum(1) * radius_mm]
}

/// Inward displacement of an element by a pressure over shear modulus on another, mm, by
/// their distance in elements.
pub(super) fn compliance(radius_mm: f64, thickness_mm: f64, elements: usize) -> Vec<f64> {
    let half = elements / 2;
    let solved = half.min((DEEP * radius_mm / thickness_mm) as usize);
    let mut modes: Vec<f64> =
        (0..=solved).map(|n| mode_compliance(radius_mm, thickness_mm, n)).collect();
    let last = modes[solved] * solved as f64;
    modes.extend((solved + 1..=half).map(|n| last / n as f64));
    let cosines: Vec<f64> =
        (0..elements).map(|i| (TAU * i as f64 / elements as f64).cos()).collect();
    (0..elements)
        .map(|lag| {
            let sum: f64 = (1..=half)
                .map(|n| {
                    // The shortest wave of an even number of elements is its own mirror image.
                    let twice = if 2 * n == elements { 1.0 } else { 2.0 };
                    twice * modes[n] * cosines[n * lag % elements]
                })
                .sum();
            sum / elements as f64
        })
        .collect()
}

/// Shear modulus over k_inf, mm: with it the relaxed gap at the calibration's point is that of
/// independent elements.
pub(in crate::plant) fn modulus_mm(parameters: &RingParameters) -> f64 {
    let (radius, thickness) = (parameters.radius_mm, parameters.tread_thickness_mm);
    let pitch = TAU / FINE as f64;
    // The elements that face the step ahead and the wall under the centre.
    let angles: Vec<f64> = (-200..=600).map(|i| f64::from(i) * pitch).collect();
    let mut contact = Complementarity::new(&compliance(radius, thickness, FINE), angles.len());
    let like = radius / CALIBRATED_AT.radius_mm;
    let (step_mm, gap_mm) = (like * CALIBRATED_AT.step_mm, like * CALIBRATED_AT.gap_mm);
    let step = |height: f64, angle: f64| {
        let over = (radius + gap_mm).powi(2) - height * height;
        let face = radius - over.max(0.0).sqrt() / angle.sin().max(1e-9);
        face.min(radius - (height - step_mm) / angle.cos())
    };
    let (mut low, mut high) = (radius - 0.5 * like, radius + gap_mm);
    let mut active = vec![false; angles.len()];
    for _ in 0..40 {
        let height = 0.5 * (low + high);
        let wanted: Vec<f64> = angles.iter().map(|a| step(height, *a)).collect();
        contact.solve(&wanted, &mut active);
        // The wall that is just touched carries nothing: its deepest point sets the height.
        let sunk = angles.iter().zip(&contact.displacement);
        let deepest = sunk.map(|(a, z)| radius - height / a.cos() - z);
        if deepest.fold(f64::NEG_INFINITY, f64::max) > 0.0 {
            low = height;
        } else {
            high = height;
        }
    }
    let height = 0.5 * (low + high);
    let ahead = ((radius + gap_mm).powi(2) - height * height).sqrt();
    let deepest = radius - ahead.hypot(height - step_mm);
    let stiffer = 1.0 + STIFFENING * deepest / thickness;
    let layer: f64 = angles.iter().zip(contact.pressures).map(|(a, p)| p * a.cos()).sum();
    let ring: f64 = angles.iter().map(|a| step(radius, *a).max(0.0) * a.cos()).sum();
    ring / (stiffer * layer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use interstage::rig::Rig;

    /// A thin layer far from the hub's axis is flat: bonded incompressible layer in plane
    /// strain (Fourier transform; limits k^2 t^3/3 and 1/(2k)).
    #[test]
    fn a_large_wheel_has_a_flat_layer() {
        let (radius, thickness) = (2e4, 8.0);
        for waves in [200, 1000, 2500, 6000, 20_000] {
            let k = waves as f64 / radius;
            let kt = k * thickness;
            let flat = ((2.0 * kt).sinh() - 2.0 * kt)
                / ((2.0 * kt).cosh() + 1.0 + 2.0 * kt * kt)
                / (2.0 * k);
            let got = mode_compliance(radius, thickness, waves);
            assert!((got / flat - 1.0).abs() < 2e-3, "{waves}: {got} {flat}");
        }
    }

    #[test]
    fn a_short_wave_does_not_see_the_hub() {
        for waves in [100, 400] {
            let half_space = 25.0 / (2.0 * waves as f64);
            let got = mode_compliance(25.0, 12.0, waves);
            assert!((got / half_space - 1.0).abs() < 1e-3, "{waves}: {got} {half_space}");
        }
    }

    /// Nothing is lost of what is pressed in, and work is positive.
    #[test]
    fn the_volume_is_kept() {
        for thickness in [4.0, 8.0, 16.0] {
            let table = compliance(25.0, thickness, 360);
            assert!(table.iter().sum::<f64>().abs() < 1e-9 * table[0]);
            assert!((1..=180).all(|n| mode_compliance(25.0, thickness, n) > 0.0));
        }
    }

    /// The finite elements' moduli for the same gap: 0.286, 0.503 and 0.756 N/mm^2.
    #[test]
    fn the_modulus_is_near_that_of_the_finite_elements() {
        for (thickness, modulus) in [(5.0, 0.286), (8.0, 0.503), (12.0, 0.756)] {
            let rubber = RingParameters {
                tread_thickness_mm: thickness,
                ..RingParameters::of(&Rig::fe(), 4)
            };
            let got = rubber.k_inf * modulus_mm(&rubber);
            assert!((got / modulus - 1.0).abs() < 0.03, "{thickness}: {got} {modulus}");
        }
    }
    #[test]
    fn a_wheel_twice_as_large_in_everything_is_calibrated_alike() {
        let of = |like: f64| {
            let rubber = RingParameters::of(&Rig::fe(), 4);
            modulus_mm(&RingParameters {
                radius_mm: like * rubber.radius_mm,
                tread_thickness_mm: like * 8.0,
                ..rubber
            })
        };
        assert!((of(2.0) / (2.0 * of(1.0)) - 1.0).abs() < 1e-9);
    }
}
