//! The references' figures of one case.

use interstage::rig::Rig;

use crate::reference::{Case, ReferenceError, Resolution, collision, impact, vibration};

/// Way before the edge from which on the grain of the ring shakes it, mm.
const EDGE_MM: f64 = -0.2;

/// Figures of one case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Speed, mm/s, and preload, N.
    pub at: (f64, f64),
    /// Gap, mm, without inertia.
    pub gap_mm: f64,
    /// Largest collision force, N, without inertia.
    pub force_n: f64,
    /// Largest stress increment at the hub, Pa.
    pub stress_pa: f64,
    /// Patch of steady rolling, mm^2.
    pub patch_mm2: f64,
    /// Closing speed, mm/s.
    pub closing_mm_s: f64,
    /// Largest force that accelerates what moves while it climbs, N.
    pub inertia_n: f64,
    /// What it would be if the whole rolling contact met the corner at once, N.
    pub inertia_bound_n: f64,
    /// Jump of stress if the whole face met it at once, Pa.
    pub jump_pa: f64,
    /// Largest deflection of the arm, mm.
    pub bending_mm: f64,
    /// Largest of its vibration while climbing, mm.
    pub vibration_mm: f64,
}

/// The study's case at this speed, mm/s, and preload, N.
pub(super) fn case((speed_mm_s, preload_n): (f64, f64), resolution: Resolution) -> Case {
    Case { resolution, ..Case::new(Rig::fe(), speed_mm_s, preload_n) }
}

impl Figures {
    /// Computes them.
    ///
    /// # Errors
    /// If a reference refuses.
    pub fn of(at: (f64, f64)) -> Result<Self, ReferenceError> {
        let still = collision::quasi_static(&case(at, Resolution::FIGURE))?;
        let case = case(at, Resolution { step_s: 2e-4, ..Resolution::FIGURE });
        let moving = collision::dynamic(&case)?;
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let climbing = moving.samples.iter().filter(|s| s.x_mm < EDGE_MM);
        let climbing_s = climbing.clone().map(|s| s.t_s).fold(f64::NEG_INFINITY, f64::max);
        let patch_mm2 = moving.samples[0].area_mm2;
        let stiffness = case.tread()?.instant() * patch_mm2 * 1e-6;
        let closing_mm_s = case.closing_speed_mm_s();
        let mass_kg = case.rig.plant.moved_mass_kg;
        let bending = vibration::bending(&case, &moving)?;
        let stress = impact::history_of(&case, &moving)?;
        let shaken = bending.iter().filter(|now| now.t_s < climbing_s);
        Ok(Self {
            at,
            gap_mm: still.lift.map_or(f64::NAN, |lift| lift.gap_mm),
            force_n: still.peak_n(),
            stress_pa: largest(&mut stress.into_iter().map(|point| point.1)),
            patch_mm2,
            closing_mm_s,
            inertia_n: largest(&mut climbing.map(|s| (s.radial_n - at.1).abs())),
            inertia_bound_n: 1e-3 * closing_mm_s * (stiffness * mass_kg).sqrt(),
            jump_pa: impact::Rubber::of(&case)?.impedance() * 1e-3 * closing_mm_s,
            bending_mm: largest(&mut bending.iter().map(|now| now.deflection_mm)),
            vibration_mm: largest(&mut shaken.map(|now| now.vibration_mm.abs())),
        })
    }
}
