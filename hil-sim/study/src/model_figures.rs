//! The reference models' figures of the study's three finite-element cases, for
//! `docs/MODEL.md`: `docs/figures/model.json` and `model.svg`.

use anyhow::Result;
use interstage::rig::Rig;
use rayon::prelude::*;
use serde::Serialize;

use crate::figure::{Chart, Figure, Series, Source};
use crate::paper::published::{AMPLITUDE_MM, CASES, COLLISION_N, STRESS};
use crate::reference::rubber::{Rubber, THICKNESS_MM};
use crate::reference::vibration::{Arm, CONSTRAINED_HZ, FREE_HZ, bending};
use crate::reference::{ReferenceCase, Resolution, collision, impact};
use hil_sim::plant::balance::BalanceError;
use hil_sim::plant::crossing::CrossingResult;

/// Place of the centre from the edge, mm, from which on single elements shake the ring.
const EDGE_MM: f64 = -0.2;

/// Everything that the page refers to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelFigures {
    pub cases: Vec<CaseFigures>,
    /// Waves in three rubbers.
    pub rubbers: Vec<RubberFigures>,
    /// First four modes of the bare arm, Hz.
    pub bare_arm_hz: Vec<f64>,
    /// Of the arm with the fitted mass at its tip.
    pub arm_hz: Vec<f64>,
    pub arm_on_tread_hz: Vec<f64>,
    /// Published: first constrained and seventh free mode, Hz.
    pub published_hz: [f64; 2],
}

/// Figures of one case, published and ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaseFigures {
    pub speed_mm_s: f64,
    pub preload_n: f64,
    pub published_gap_mm: f64,
    /// Gap without inertia, mm; the tread is fitted to it.
    pub gap_mm: f64,
    pub published_force_n: f64,
    /// Largest collision force without inertia, N.
    pub force_n: f64,
    /// Published impact stress; its unit is doubtful.
    pub published_stress: f64,
    /// Largest stress increment at the hub, Pa.
    pub stress_pa: f64,
    /// Speed at which tread and corner close, mm/s.
    pub closing_mm_s: f64,
    /// Largest force that accelerates the moved mass while it climbs, N.
    pub inertia_n: f64,
    /// That force if the rolling contact met the corner at once, N.
    pub inertia_bound_n: f64,
    /// Jump of stress if the face met the corner at once, Pa.
    pub jump_pa: f64,
    /// Largest deflection of the arm, mm.
    pub bending_mm: f64,
    /// Largest vibration of the arm while climbing, mm.
    pub vibration_mm: f64,
}

/// Stress waves in one rubber.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RubberFigures {
    pub name: &'static str,
    /// Transit of the tread by the front, ms.
    pub front_ms: f64,
    pub slow_ms: f64,
    /// Largest attenuation over the tread, dB.
    pub loss_db: f64,
}

/// A crossing at the study's loads.
fn case(speed_mm_s: f64, preload_n: f64) -> ReferenceCase {
    ReferenceCase {
        resolution: Resolution::FIGURE,
        ..ReferenceCase::new(Rig::fe(), speed_mm_s, preload_n)
    }
}

pub fn compute() -> Result<ModelFigures> {
    let computed: Vec<(CaseFigures, f64)> =
        (0..3).into_par_iter().map(of_case).collect::<Result<_>>()?;
    let patch_mm2 = computed[0].1;
    let first = ReferenceCase::first();
    let rubbers = [
        ("the fitted tread", Rubber::of(&first)),
        ("sheets, tan delta 0.1 at 10 Hz", Rubber::of_sheets(0.1, 10.0)),
        ("sheets, tan delta 0.25 at 100 Hz", Rubber::of_sheets(0.25, 100.0)),
    ];
    let arm = Arm::of(&first.rig)?;
    let bare = Arm { tip: Default::default(), ..arm };
    Ok(ModelFigures {
        cases: computed.into_iter().map(|pair| pair.0).collect(),
        rubbers: rubbers.map(|(name, rubber)| of_rubber(name, &rubber)).into(),
        bare_arm_hz: bare.frequencies_hz(4)?,
        arm_hz: arm.frequencies_hz(4)?,
        arm_on_tread_hz: arm.on_tread(&first, patch_mm2).frequencies_hz(4)?,
        published_hz: [CONSTRAINED_HZ, FREE_HZ],
    })
}

/// Figures of a case, and the patch of steady rolling, mm^2.
fn of_case(index: usize) -> Result<(CaseFigures, f64)> {
    let (speed_mm_s, preload_n) = CASES[index];
    let case = case(speed_mm_s, preload_n);
    let still = case.still()?;
    let moving = collision::dynamic(&case)?;
    let climbing = moving.samples.iter().filter(|sample| sample.x_mm < EDGE_MM);
    let climbing_s = climbing.clone().map(|sample| sample.t_s).fold(f64::NEG_INFINITY, f64::max);
    let patch_mm2 = moving.samples[0].area_mm2;
    let stiffness = case.instant_pa_per_m() * patch_mm2 * 1e-6;
    let closing_mm_s = case.closing_speed_mm_s();
    let bending = bending(&case, &moving)?;
    let shaken = bending.iter().filter(|now| now.t_s < climbing_s);
    let figures = CaseFigures {
        speed_mm_s,
        preload_n,
        published_gap_mm: AMPLITUDE_MM[index],
        gap_mm: still.gap_mm,
        published_force_n: COLLISION_N[index],
        force_n: still.corner_force_n,
        published_stress: STRESS[index],
        stress_pa: largest(impact::stress(&case, &moving).into_iter().map(|point| point.1)),
        closing_mm_s,
        inertia_n: largest(climbing.map(|sample| (sample.radial_n - preload_n).abs())),
        inertia_bound_n: 1e-3 * closing_mm_s * (stiffness * case.rig.plant.moved_mass_kg).sqrt(),
        jump_pa: Rubber::of(&case).impedance() * 1e-3 * closing_mm_s,
        bending_mm: largest(bending.iter().map(|now| now.deflection_mm)),
        vibration_mm: largest(shaken.map(|now| now.vibration_mm.abs())),
    };
    Ok((figures, patch_mm2))
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

fn of_rubber(name: &'static str, rubber: &Rubber) -> RubberFigures {
    RubberFigures {
        name,
        front_ms: THICKNESS_MM / rubber.front_speed_m_s(),
        slow_ms: THICKNESS_MM / rubber.slow_speed_m_s(),
        loss_db: rubber.loss_db(1e-3 * THICKNESS_MM),
    }
}

/// Gap and collision force of the ring over preload at 5 and 8 mm/s, with the published
/// values.
pub fn figure() -> Result<Figure> {
    let (mut gaps, mut forces) = (Vec::new(), Vec::new());
    for (number, speed) in [(1, 5.0), (2, 8.0)] {
        let points: Vec<(f64, CrossingResult)> = (0..=10)
            .into_par_iter()
            .map(|index| {
                let preload = 80.0 + 6.0 * f64::from(index);
                Ok((preload, case(speed, preload).still()?))
            })
            .collect::<Result<_, BalanceError>>()?;
        let series = |of: fn(&CrossingResult) -> f64| {
            let points = points.iter().map(|(preload, result)| (*preload, of(result)));
            Series::method(number, &format!("ring, {speed} mm/s"), points.collect())
        };
        gaps.push(series(|result| result.gap_mm));
        forces.push(series(|result| result.corner_force_n));
    }
    let marks = |values: [f64; 3]| CASES.iter().zip(values).map(|(case, y)| (case.1, y)).collect();
    gaps.push(Series::new(Source::Fitted, marks(AMPLITUDE_MM)));
    forces.push(Series::new(Source::Published, marks(COLLISION_N)));
    let (gap, force) = ("Gap: the tread is fitted to these marks", "Collision force: not fitted");
    let panels = vec![
        Chart::new(gap, "preload, N", "gap, mm", gaps),
        Chart::new(force, "preload, N", "force, N", forces),
    ];
    Ok(Figure::new("model", "Gap and collision force over preload", String::new(), 2, panels))
}
