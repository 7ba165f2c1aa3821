//! The fit to what the study publishes: three gaps, three parameters of the tread.
//!
//! Three points fit three parameters exactly: nothing is left to tell how well, so there
//! is neither a validation nor an interval.

use nalgebra_lm::Matrix3;
use nalgebra_lm::Vector3;
use rayon::prelude::*;

use super::IdentifyError;
use crate::paper::published::{AMPLITUDE_MM, CASES};
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::ring::RingParameters;
use crate::scenario::Scenario;

/// Largest deviation from a published gap at which the fit has arrived, mm.
const ARRIVED_MM: f64 = 1e-5;
/// Most Newton steps.
const MOST_STEPS: usize = 30;
/// Change of a logarithm for the differences.
const MOVED: f64 = 0.01;
/// Longest Newton step of a logarithm.
const LONGEST: f64 = 0.3;

/// How finely the ring is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Elements around the ring.
    pub elements: usize,
    /// Axial way per step, mm.
    pub stride_mm: f64,
}

impl Fineness {
    /// The coarse ring that the presets' tread was fitted with.
    pub const STATED: Self = Self { elements: 720, stride_mm: 0.05 };
    /// Gaps within 0.1 % of the converged ones.
    pub const CONVERGED: Self = Self { elements: 5760, stride_mm: 0.005 };
}

/// The tread that shows the published gaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tread {
    /// Relaxed stiffness, Pa/m.
    pub k_inf_pa_per_m: f64,
    /// Stiffening.
    pub stiffening: f64,
    /// Relaxation time, s.
    pub tau_s: f64,
    /// Its gaps less the published ones, mm.
    pub residuals_mm: [f64; 3],
}

/// Gaps of the published cases for these logarithms, mm; pushed without friction.
fn gaps(
    scenario: &Scenario,
    x: &Vector3<f64>,
    fineness: Fineness,
) -> Result<Vector3<f64>, IdentifyError> {
    let k_inf = x[0].exp();
    let ring = RingParameters {
        k_inf,
        k_0: k_inf * x[1].exp(),
        tau_s: x[2].exp(),
        ..RingParameters::of(&scenario.rig, fineness.elements)
    };
    let gap = |case: usize| {
        let (speed_mm_s, preload_n) = CASES[case];
        let case = CrossingCase {
            ring,
            step_height_mm: scenario.rig.rig.step_height_mm,
            speed_mm_s,
            preload_n,
            axial: Axial::Pushed,
            stride_mm: fineness.stride_mm,
        };
        cross(&case).map(|result| result.gap_mm)
    };
    let gaps: Result<Vec<f64>, _> = (0..3).into_par_iter().map(gap).collect();
    let gaps = gaps.map_err(|error| IdentifyError::NoFit { why: error.to_string() })?;
    Ok(Vector3::from_vec(gaps))
}

/// Solves for the tread whose three gaps are the published ones, by Newton's method on
/// the logarithms.
///
/// # Errors
/// [`IdentifyError::NoFit`] if it does not arrive.
pub fn fit(scenario: &Scenario, fineness: Fineness) -> Result<Tread, IdentifyError> {
    let wanted = Vector3::from(AMPLITUDE_MM);
    let tread = &scenario.rig.tread;
    let start = [tread.k_inf_pa_per_m * 1e-9, tread.stiffening, tread.tau_s];
    let mut x = Vector3::from(start.map(f64::ln));
    let mut residuals = gaps(scenario, &x, fineness)? - wanted;
    for _ in 0..MOST_STEPS {
        if residuals.amax() < ARRIVED_MM {
            let [k, stiffening, tau_s] = [x[0], x[1], x[2]].map(f64::exp);
            let residuals_mm = residuals.into();
            return Ok(Tread { k_inf_pa_per_m: 1e9 * k, stiffening, tau_s, residuals_mm });
        }
        let mut slopes = Matrix3::zeros();
        for index in 0..3 {
            let mut moved = x;
            moved[index] += MOVED;
            let change = gaps(scenario, &moved, fineness)? - wanted - residuals;
            slopes.set_column(index, &(change / MOVED));
        }
        let step = slopes.lu().solve(&residuals).ok_or_else(|| IdentifyError::NoFit {
            why: "the gaps do not determine the tread".into(),
        })?;
        // Shortened while it overshoots.
        let mut part = (LONGEST / step.amax()).min(1.0);
        loop {
            let tried = x - part * step;
            let after = gaps(scenario, &tried, fineness)? - wanted;
            if after.norm() < residuals.norm() {
                (x, residuals) = (tried, after);
                break;
            }
            part *= 0.5;
            if part < 1e-3 {
                return Err(IdentifyError::NoFit {
                    why: format!("stuck {:.1e} mm off the published gaps", residuals.amax()),
                });
            }
        }
    }
    Err(IdentifyError::NoFit { why: format!("{:.1e} mm off after all steps", residuals.amax()) })
}
