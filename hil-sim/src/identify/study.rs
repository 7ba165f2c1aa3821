//! How well identification does: on logs of rigs whose parameters are hidden from it, how
//! often each parameter lies within its interval, and how far off the values are.

use rayon::prelude::*;
use serde::Serialize;

use super::forward::Fineness;
use super::hidden::{Hidden, hidden};
use super::result::{Identification, identify};
use crate::scenario::Scenario;

/// One parameter over all rigs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// The parameter.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Rigs whose logs tell it.
    pub identified: usize,
    /// Of these, rigs whose interval holds the hidden value.
    pub within: usize,
    /// Root mean square of the error, in the parameter's unit.
    pub rms_error: f64,
    /// Mean of the error: what all the rigs have in common.
    pub mean_error: f64,
    /// Largest error over the hidden value, absolute; none where that may be nought.
    pub worst_rel: Option<f64>,
    /// Median half-width of the interval.
    pub half_width: f64,
}

/// All parameters over all rigs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Study {
    /// Rigs.
    pub cases: usize,
    /// Rigs for which nothing was identified, with the reason.
    pub failed: Vec<(u64, String)>,
    /// The parameters.
    pub parameters: Vec<Line>,
}

/// One parameter of one rig.
#[derive(Clone, Debug)]
struct Found {
    name: String,
    unit: &'static str,
    identified: bool,
    within: bool,
    truth: f64,
    error: f64,
    half_width: f64,
}

/// Identifies the rigs of these seeds; `done` is told of each.
#[must_use]
pub fn study(
    scenario: &Scenario,
    seeds: &[u64],
    fineness: Fineness,
    done: &(impl Fn() + Sync),
) -> Study {
    let cases: Vec<Result<Vec<Found>, (u64, String)>> = seeds
        .par_iter()
        .map(|&seed| {
            let found = one(scenario, seed, fineness).map_err(|why| (seed, why));
            done();
            found
        })
        .collect();
    let failed = cases.iter().filter_map(|case| case.as_ref().err().cloned()).collect();
    let good: Vec<&Vec<Found>> = cases.iter().filter_map(|case| case.as_ref().ok()).collect();
    let count = good.first().map_or(0, |found| found.len());
    let parameters = (0..count)
        .map(|index| line(&good.iter().map(|found| &found[index]).collect::<Vec<_>>()))
        .collect();
    Study { cases: seeds.len(), failed, parameters }
}

fn one(scenario: &Scenario, seed: u64, fineness: Fineness) -> Result<Vec<Found>, String> {
    let hidden = hidden(scenario, seed).map_err(|error| error.to_string())?;
    let told = &hidden.records[0].scenario;
    let identified =
        identify(&hidden.records, told, fineness).map_err(|error| error.to_string())?;
    Ok(found(&hidden, &identified))
}

fn found(hidden: &Hidden, identified: &Identification) -> Vec<Found> {
    let truths = hidden.parameters();
    let of = |(name, truth): (String, f64)| {
        let parameter = identified.parameter(&name)?;
        let (low, high) = (parameter.low?, parameter.high?);
        Some(Found {
            name,
            unit: parameter.unit,
            identified: parameter.identified,
            within: (low..=high).contains(&truth),
            truth,
            error: parameter.value - truth,
            half_width: 0.5 * (high - low),
        })
    };
    truths.into_iter().filter_map(of).collect()
}

fn line(all: &[&Found]) -> Line {
    let told: Vec<&&Found> = all.iter().filter(|found| found.identified).collect();
    let n = told.len().max(1) as f64;
    let square: f64 = told.iter().map(|found| found.error * found.error).sum();
    let mut widths: Vec<f64> = told.iter().map(|found| found.half_width).collect();
    widths.sort_by(f64::total_cmp);
    let nought = all.iter().any(|found| found.truth.abs() < found.half_width.max(1e-12));
    let relative = told.iter().map(|found| (found.error / found.truth).abs());
    Line {
        name: all[0].name.clone(),
        unit: all[0].unit,
        identified: told.len(),
        within: told.iter().filter(|found| found.within).count(),
        rms_error: (square / n).sqrt(),
        mean_error: told.iter().map(|found| found.error).sum::<f64>() / n,
        worst_rel: (!nought && !told.is_empty()).then(|| relative.fold(0.0, f64::max)),
        half_width: widths.get(widths.len() / 2).copied().unwrap_or(0.0),
    }
}

impl Study {
    /// A parameter by its name.
    #[must_use]
    pub fn line(&self, name: &str) -> Option<&Line> {
        self.parameters.iter().find(|line| line.name == name)
    }
}
