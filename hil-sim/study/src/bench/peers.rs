//! SciPy's ODE solvers and MuJoCo on one crossing, beside the plant's ring: the stored results of
//! `peers/run.py`, which runs on demand.
//!
//! - SciPy solves exactly the ring's equations, compiled, from loose to tight tolerances.
//! - MuJoCo has its wheel, its step and its soft contacts, fitted to the ring at loads around the
//!   crossing's own.

use anyhow::Result;
use serde::{Deserialize, Serialize};

/// Error at which times are compared.
pub const LEVEL: f64 = 0.005;
/// Name of the ring among the methods.
pub const RING: &str = "ring";

/// One setting of one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    pub name: String,
    /// Elements around the ring, if it has one.
    pub elements: Option<usize>,
    /// Relative and absolute tolerance of a solver.
    pub tolerance: Option<f64>,
    pub time_step_s: Option<f64>,
    /// Gap, mm, if the wheel lifted off.
    pub gap_mm: Option<f64>,
    /// Largest axial force, N.
    pub corner_force_n: f64,
    /// Relative error of gap or force, the larger; none without a gap.
    pub error: Option<f64>,
    /// Processor time, s.
    pub seconds: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peers {
    /// Versions of SciPy and MuJoCo.
    pub versions: [String; 2],
    /// Settings of every method, the ring first.
    pub settings: Vec<Setting>,
    /// Least time within [`LEVEL`] by method, s; none if a method does not get there.
    pub least_seconds: Vec<(String, Option<f64>)>,
}

impl Peers {
    pub fn stored() -> Result<Self> {
        Ok(serde_json::from_str(include_str!("../../peers/results.json"))?)
    }
}
