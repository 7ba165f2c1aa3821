//! The outcome of a campaign: a row for each fault.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Case, Finding, Instant};

/// Median and worst of a figure over the instants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MedianAndWorst {
    pub median: f64,
    pub worst: f64,
}

impl MedianAndWorst {
    /// Of these values; none without a value.
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut all: Vec<f64> = values.collect();
        all.sort_by(f64::total_cmp);
        Some(Self { median: *all.get(all.len() / 2)?, worst: *all.last()? })
    }
}

/// A fault at all its instants.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MatrixRow {
    pub fault: String,
    /// What happens, in words.
    pub text: String,
    /// The code that it was reported by most often; none if it was tolerated throughout.
    pub code: Option<u16>,
    /// Every code that it was reported by, with how often.
    pub codes: BTreeMap<u16, usize>,
    /// Restarts of the controller that it was reported by, with how often.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub restarts: BTreeMap<Cow<'static, str>, usize>,
    /// Whether at every instant it was reported or tolerated.
    pub detected: bool,
    /// Worst time from fault to report, ms; none if nothing was reported.
    pub latency_ms: Option<f64>,
    pub latency_median_ms: Option<f64>,
    /// From the report to rest with both bridges off, ms.
    pub rest_ms: Option<MedianAndWorst>,
    /// Whether at every instant the mechanism was held.
    pub safe: bool,
    /// Instants with a latched fault.
    pub found: usize,
    /// Instants with a reported limit.
    pub limited: usize,
    /// Instants at which it was reported as something else.
    pub otherwise: usize,
    /// Instants tolerated without a report.
    pub tolerated: usize,
    pub undetected: usize,
    /// Instants at which a bound of the mechanism was exceeded.
    #[serde(rename = "unsafe")]
    pub unheld: usize,
    /// Ends of the runs and how often each occurred.
    pub ends: BTreeMap<Cow<'static, str>, usize>,
    pub worst_preload_n: f64,
    /// Longest distance moved uncommanded, mm.
    pub worst_motion_mm: f64,
    /// Instants undetected or unsafe, in full.
    pub failures: Vec<Instant>,
}

impl MatrixRow {
    /// The most frequent restart of the controller.
    pub fn restarted(&self) -> Option<&str> {
        most_frequent(&self.restarts).map(AsRef::as_ref)
    }

    /// The row of a fault.
    pub(crate) fn of(case: &Case, instants: &[&Instant]) -> Self {
        let count = |finding| instants.iter().filter(|i| i.finding == finding).count();
        let codes = counts(instants.iter().filter_map(|i| i.code));
        let failed = |i: &&Instant| i.finding == Finding::Undetected || !i.harms.is_empty();
        let failures = instants.iter().copied().filter(failed).cloned().collect();
        let latency = MedianAndWorst::of(instants.iter().filter_map(|i| i.latency_ms));
        let unheld = instants.iter().filter(|i| !i.harms.is_empty()).count();
        Self {
            fault: case.name(),
            text: case.text(),
            code: most_frequent(&codes).copied(),
            codes,
            restarts: counts(instants.iter().filter_map(|i| i.restart.clone())),
            detected: count(Finding::Undetected) == 0,
            latency_ms: latency.map(|l| l.worst),
            latency_median_ms: latency.map(|l| l.median),
            rest_ms: MedianAndWorst::of(instants.iter().filter_map(|i| i.rest_ms)),
            safe: unheld == 0,
            found: count(Finding::Found),
            limited: count(Finding::Limited),
            otherwise: count(Finding::Otherwise),
            tolerated: count(Finding::Tolerated),
            undetected: count(Finding::Undetected),
            unheld,
            ends: counts(instants.iter().map(|i| i.end.clone())),
            worst_preload_n: instants.iter().map(|i| i.peak_preload_n).fold(0.0, f64::max),
            worst_motion_mm: instants.iter().map(|i| i.motion_mm).fold(0.0, f64::max),
            failures,
        }
    }
}

/// How often each value occurs.
fn counts<T: Ord>(values: impl Iterator<Item = T>) -> BTreeMap<T, usize> {
    let mut counts = BTreeMap::new();
    values.for_each(|value| *counts.entry(value).or_default() += 1);
    counts
}

fn most_frequent<T>(counts: &BTreeMap<T, usize>) -> Option<&T> {
    counts.iter().max_by_key(|(_, times)| **times).map(|(value, _)| value)
}

/// A complete campaign.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// What ran the controller.
    pub target: &'static str,
    /// Instants a fault.
    pub instants: usize,
    /// A row for each fault.
    pub matrix: Vec<MatrixRow>,
    /// Instants at which a fault was reported as something else.
    pub otherwise: usize,
    /// Instants at which a fault was neither reported nor tolerated.
    pub undetected: usize,
    /// Instants at which the mechanism was not held.
    #[serde(rename = "unsafe")]
    pub unheld: usize,
}

impl Outcome {
    /// The outcome of these rows.
    pub(crate) fn of(target: &'static str, matrix: Vec<MatrixRow>, instants: usize) -> Self {
        let otherwise = matrix.iter().map(|line| line.otherwise).sum();
        let undetected = matrix.iter().map(|line| line.undetected).sum();
        let unheld = matrix.iter().map(|line| line.unheld).sum();
        Self { target, instants, matrix, otherwise, undetected, unheld }
    }

    /// Whether every fault was found or tolerated and every bound kept.
    pub(crate) const fn is_good(&self) -> bool {
        self.undetected == 0 && self.unheld == 0
    }
}
