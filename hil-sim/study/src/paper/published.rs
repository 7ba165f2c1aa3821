//! What the study publishes as numbers. Its tables and the images of its figures are
//! not part of its text; nothing is read off them here.

pub(super) use crate::reference::vibration::{CONSTRAINED_HZ, FREE_HZ};
pub(super) use hil_sim::identify::published::{AMPLITUDE_MM, CASES};

/// Finite-element collision force of the first three of [`CASES`], N (its Fig. 13).
pub(super) const COLLISION_N: [f64; 3] = [56.5261, 51.2358, 58.5963];

/// Finite-element impact stress of the same (its Fig. 14). Printed as Pa; the unit is
/// doubtful, so that only ratios are used.
pub(super) const STRESS: [f64; 3] = [66.7738, 63.6418, 69.3387];

pub(super) const LEAST_SPEED_MM_S: f64 = 2.9741;

/// Least preload with which the drive works under its top load, N.
pub(super) const LEAST_PRELOAD_N: f64 = 100.0;

/// Runs of an experiment, runs of a mean, interval of the log, s.
pub(super) const RUNS: usize = 40;
/// Runs that are averaged into one mean.
pub(super) const RUNS_OF_A_MEAN: usize = 10;
/// Interval of the log, s.
pub(super) const LOG_S: f64 = 0.1;

/// Largest difference between the four means: of the gap against preload and against
/// speed, mm.
pub(super) const GAP_SPREAD_MM: [f64; 2] = [0.24, 0.32];
/// Of the embedding depth against preload and against speed, mm.
pub(super) const DEPTH_SPREAD_MM: [f64; 2] = [0.18, 0.21];
/// Of the contact area against preload and against speed, mm^2.
pub(super) const AREA_SPREAD_MM2: [f64; 2] = [2.04, 2.71];
