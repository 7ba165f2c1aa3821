//! What a campaign comes to: a line a fault.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Case, Finding, Instant};

/// Median and worst of what varies between instants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// Largest.
    pub worst: f64,
}

impl Spread {
    /// Of these values; none of nothing.
    #[must_use]
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut all: Vec<f64> = values.collect();
        all.sort_by(f64::total_cmp);
        Some(Self { median: *all.get(all.len() / 2)?, worst: *all.last()? })
    }
}

/// A fault at all its instants.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Line {
    /// The fault.
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
    /// Median of the same, ms.
    pub latency_median_ms: Option<f64>,
    /// The same from when the duty was off by two parts in a hundred, ms.
    pub latency_any_ms: Option<Spread>,
    /// The same of the instants outside of crossings, ms.
    pub latency_off_corner_ms: Option<Spread>,
    /// The same from when the plant first ran otherwise than without the fault, ms.
    pub after_sign_ms: Option<Spread>,
    /// From the report to rest with both bridges off, ms.
    pub rest_ms: Option<Spread>,
    /// The same of the instants in a crossing.
    pub rest_in_crossing_ms: Option<Spread>,
    /// Whether at every instant the mechanism was held.
    pub safe: bool,
    /// Instants by what became of them.
    pub found: usize,
    /// Limited.
    pub limited: usize,
    /// Tolerated.
    pub tolerated: usize,
    /// Undetected.
    pub undetected: usize,
    /// Unsafe.
    #[serde(rename = "unsafe")]
    pub unheld: usize,
    /// How the runs ended, with how many did.
    pub ends: BTreeMap<Cow<'static, str>, usize>,
    /// Largest preload, N.
    pub worst_preload_n: f64,
    /// Longest distance moved uncommanded, mm.
    pub worst_motion_mm: f64,
    /// Instants undetected or unsafe, in full.
    pub failures: Vec<Instant>,
}

impl Line {
    /// What it restarted the controller by most often.
    #[must_use]
    pub fn restarted(&self) -> Option<&str> {
        self.restarts.iter().max_by_key(|(_, times)| **times).map(|(cause, _)| cause.as_ref())
    }

    /// The line of a fault.
    #[must_use]
    pub fn of(case: &Case, instants: &[Instant]) -> Self {
        let count = |finding| instants.iter().filter(|i| i.finding == finding).count();
        let mut codes = BTreeMap::new();
        let mut restarts = BTreeMap::new();
        let mut ends = BTreeMap::new();
        for instant in instants {
            *ends.entry(instant.end.clone()).or_default() += 1;
            if let Some(code) = instant.code {
                *codes.entry(code).or_default() += 1;
            }
            if let Some(cause) = &instant.restart {
                *restarts.entry(cause.clone()).or_default() += 1;
            }
        }
        let failed = |i: &&Instant| i.finding == Finding::Undetected || !i.harms.is_empty();
        let failures: Vec<Instant> = instants.iter().filter(failed).cloned().collect();
        let latency = Spread::of(instants.iter().filter_map(|i| i.latency_ms));
        let crossing = |i: &&Instant| i.during == "crossing";
        let unheld = instants.iter().filter(|i| !i.harms.is_empty()).count();
        Self {
            fault: case.name(),
            text: case.text(),
            code: codes.iter().max_by_key(|(_, n)| **n).map(|(code, _)| *code),
            codes,
            restarts,
            detected: count(Finding::Undetected) == 0,
            latency_ms: latency.map(|l| l.worst),
            latency_median_ms: latency.map(|l| l.median),
            latency_any_ms: Spread::of(instants.iter().filter_map(|i| i.latency_any_ms)),
            latency_off_corner_ms: Spread::of(
                instants.iter().filter(|i| !crossing(i)).filter_map(|i| i.latency_ms),
            ),
            after_sign_ms: Spread::of(instants.iter().filter_map(|i| i.after_sign_ms)),
            rest_ms: Spread::of(instants.iter().filter_map(|i| i.rest_ms)),
            rest_in_crossing_ms: Spread::of(
                instants.iter().filter(crossing).filter_map(|i| i.rest_ms),
            ),
            safe: unheld == 0,
            found: count(Finding::Found),
            limited: count(Finding::Limited),
            tolerated: count(Finding::Tolerated),
            undetected: count(Finding::Undetected),
            unheld,
            ends,
            worst_preload_n: instants.iter().map(|i| i.peak_preload_n).fold(0.0, f64::max),
            worst_motion_mm: instants.iter().map(|i| i.motion_mm).fold(0.0, f64::max),
            failures,
        }
    }
}

/// A whole campaign.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// What ran the controller.
    pub target: &'static str,
    /// Instants a fault.
    pub instants: usize,
    /// A line a fault.
    pub matrix: Vec<Line>,
    /// Instants at which a fault was neither reported nor tolerated.
    pub undetected: usize,
    /// Instants at which the mechanism was not held.
    #[serde(rename = "unsafe")]
    pub unheld: usize,
}

impl Outcome {
    /// The outcome of these lines.
    #[must_use]
    pub fn of(target: &'static str, matrix: Vec<Line>, instants: usize) -> Self {
        let undetected = matrix.iter().map(|line| line.undetected).sum();
        let unheld = matrix.iter().map(|line| line.unheld).sum();
        Self { target, instants, matrix, undetected, unheld }
    }

    /// Whether every fault was found or tolerated, and nothing was left unheld.
    #[must_use]
    pub const fn is_good(&self) -> bool {
        self.undetected == 0 && self.unheld == 0
    }
}
