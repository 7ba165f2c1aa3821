//! The four preload strategies on the same random rigs: how fast each deploys when
//! all are held to the same worst gap, and how large the worst gap is when all cross
//! at the same speed.

use interstage::model::Planner;
use interstage::units::Direction;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::record::Summary;
use crate::scenario::{ControllerKind, Scenario};
use crate::session::{Options, RunError, run};

/// Slip of a run that counts as an event, mm.
pub const SLIP_EVENT_MM: f64 = 0.05;
/// Largest reserve below the reference gap that the tuning tries.
const MOST_RESERVE: f64 = 0.25;
/// How close to the reference the worst gap is tuned, relative.
const TUNED_WITHIN: f64 = 0.002;
/// Most evaluations of one tuning.
const MOST_TRIES: usize = 9;
/// Crossing speed of the comparison at equal speed, mm/s.
pub const EQUAL_SPEED_MM_S: f64 = 8.0;

/// How the speed is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Crossing speed at the steps, cruise speed between them, for every strategy.
    StepAware,
    /// One speed throughout, as a drive without look-ahead must; the scheduled one
    /// keeps its own.
    OneSpeed,
}

/// One strategy over all rigs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Strategy.
    pub controller: String,
    /// How the speed is chosen.
    pub policy: Policy,
    /// Crossing speed prescribed, mm/s; none for the scheduled strategy.
    pub crossing_speed_mm_s: Option<f64>,
    /// Reserve below the reference gap; the scheduled strategy's tuning.
    pub gap_reserve: f64,
    /// Whether the worst gap was brought to the reference; at the least crossing speed
    /// it may still lie above, at the greatest below.
    pub tuned: bool,
    /// Mean time from start of motion to the end of travel, s.
    pub deploy_time_s: f64,
    /// Largest gap of all crossings, mm.
    pub worst_gap_mm: f64,
    /// Runs with gross slip.
    pub slip_events: usize,
    /// Runs that did not complete.
    pub incomplete: usize,
    /// Mean preload while moving, N.
    pub mean_preload_n: f64,
    /// Mean mechanical work of the drive, J.
    pub energy_j: f64,
    /// Mean friction work on the tread, J.
    pub wear_j: f64,
}

/// A comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Rigs drawn.
    pub runs: usize,
    /// Reference gap, mm.
    pub gap_ref_mm: f64,
    /// All held to the same worst gap.
    pub equal_gap: Vec<Entry>,
    /// All crossing at [`EQUAL_SPEED_MM_S`].
    pub equal_speed: Vec<Entry>,
}

impl Comparison {
    /// The entry of a strategy at equal worst gap.
    #[must_use]
    pub fn find(&self, controller: ControllerKind, policy: Policy) -> Option<&Entry> {
        self.equal_gap.iter().find(|e| e.controller == controller.name() && e.policy == policy)
    }

    /// How many times as fast as `other` the scheduled strategy deploys at equal worst
    /// gap.
    #[must_use]
    pub fn speed_up(&self, other: ControllerKind, policy: Policy) -> Option<f64> {
        let scheduled = self.find(ControllerKind::Scheduled, Policy::StepAware)?;
        Some(self.find(other, policy)?.deploy_time_s / scheduled.deploy_time_s)
    }
}

/// Compares over `runs` rigs of the scenario, seeds `first_seed` and up. `progress` is
/// called after every run.
///
/// # Errors
/// [`RunError`] if the parameters do not make a rig or a plant fails.
pub fn compare(
    scenario: &Scenario,
    first_seed: u64,
    runs: usize,
    progress: &(dyn Fn() + Sync),
) -> Result<Comparison, RunError> {
    let bench = Bench { scenario, first_seed, runs, progress };
    let direction: Direction = scenario.run.direction.into();
    let reference = Planner::try_build(&scenario.rig)?.gap_ref(direction).to_num::<f64>();
    let mut equal_gap = vec![bench.tune_reserve(reference)?];
    for policy in [Policy::StepAware, Policy::OneSpeed] {
        for kind in [ControllerKind::Constant, ControllerKind::Limit, ControllerKind::Reactive] {
            equal_gap.push(bench.tune_speed(kind, policy, reference)?);
        }
    }
    let speed = EQUAL_SPEED_MM_S.min(scenario.rig.drive.cruise_speed_mm_s);
    let equal_speed = [
        ControllerKind::Scheduled,
        ControllerKind::Constant,
        ControllerKind::Limit,
        ControllerKind::Reactive,
    ]
    .into_iter()
    .map(|kind| {
        let reserve = scenario.rig.control.gap_reserve;
        let entry = bench.evaluate(kind, Policy::StepAware, Some(speed), reserve)?;
        // Nothing to tune: all cross at the same speed.
        Ok(Entry { tuned: true, ..entry })
    })
    .collect::<Result<_, RunError>>()?;
    Ok(Comparison { runs, gap_ref_mm: reference, equal_gap, equal_speed })
}

/// Most runs that [`compare`] makes over so many rigs, for a progress bar.
#[must_use]
pub fn most_runs(rigs: usize) -> usize {
    rigs * (7 * MOST_TRIES + 4)
}

struct Bench<'a> {
    scenario: &'a Scenario,
    first_seed: u64,
    runs: usize,
    progress: &'a (dyn Fn() + Sync),
}

impl Bench<'_> {
    /// The reserve at which the scheduled strategy's worst gap meets the reference.
    fn tune_reserve(&self, reference: f64) -> Result<Entry, RunError> {
        let kind = ControllerKind::Scheduled;
        // A smaller reserve gives a larger gap: the tuning variable runs in the other direction.
        self.tune(reference, (-MOST_RESERVE, 0.0), |x| {
            self.evaluate(kind, Policy::StepAware, None, -x)
        })
    }

    /// The crossing speed at which a strategy's worst gap meets the reference.
    fn tune_speed(
        &self,
        kind: ControllerKind,
        policy: Policy,
        reference: f64,
    ) -> Result<Entry, RunError> {
        let drive = &self.scenario.rig.drive;
        let range = (drive.min_crossing_speed_mm_s, drive.cruise_speed_mm_s);
        self.tune(reference, range, |speed| self.evaluate(kind, policy, Some(speed), 0.0))
    }

    /// Brings the worst gap, which rises with the variable, to the reference by the
    /// Illinois variant of regula falsi.
    fn tune(
        &self,
        reference: f64,
        range: (f64, f64),
        evaluate: impl Fn(f64) -> Result<Entry, RunError>,
    ) -> Result<Entry, RunError> {
        let off = |entry: &Entry| entry.worst_gap_mm / reference - 1.0;
        let (mut low, mut high) = range;
        let at_low = evaluate(low)?;
        let at_high = evaluate(high)?;
        if off(&at_low) >= -TUNED_WITHIN {
            return Ok(Entry { tuned: off(&at_low) <= TUNED_WITHIN, ..at_low });
        }
        if off(&at_high) <= TUNED_WITHIN {
            return Ok(Entry { tuned: off(&at_high) >= -TUNED_WITHIN, ..at_high });
        }
        let (mut f_low, mut f_high) = (off(&at_low), off(&at_high));
        // The fastest that keeps the reference, should the tries run out.
        let mut best = at_low;
        for _ in 2..MOST_TRIES {
            let x = (low * f_high - high * f_low) / (f_high - f_low);
            let x = x.clamp(low + 0.02 * (high - low), high - 0.02 * (high - low));
            let entry = evaluate(x)?;
            let f = off(&entry);
            if f.abs() <= TUNED_WITHIN {
                return Ok(Entry { tuned: true, ..entry });
            }
            if f < 0.0 {
                (low, f_low) = (x, f);
                f_high *= 0.5;
                best = entry;
            } else {
                (high, f_high) = (x, f);
                f_low *= 0.5;
            }
        }
        Ok(best)
    }

    fn evaluate(
        &self,
        kind: ControllerKind,
        policy: Policy,
        speed: Option<f64>,
        reserve: f64,
    ) -> Result<Entry, RunError> {
        let options =
            Options { rows: false, speed: speed.map(|speed| (speed, policy == Policy::OneSpeed)) };
        let summaries = (0..self.runs as u64)
            .into_par_iter()
            .map(|offset| {
                let mut scenario = self.scenario.clone();
                scenario.run.seed = self.first_seed + offset;
                scenario.run.controller = kind;
                scenario.rig.control.gap_reserve = reserve;
                let result = run(&scenario, options).map(|recording| recording.summary);
                (self.progress)();
                result
            })
            .collect::<Result<Vec<_>, _>>()?;
        let mean = |f: fn(&Summary) -> f64| {
            summaries.iter().map(f).sum::<f64>() / summaries.len().max(1) as f64
        };
        Ok(Entry {
            controller: kind.name().into(),
            policy,
            crossing_speed_mm_s: speed,
            gap_reserve: reserve,
            tuned: false,
            deploy_time_s: mean(|s| s.duration_s),
            worst_gap_mm: summaries.iter().map(|s| s.max_gap_mm).fold(0.0, f64::max),
            slip_events: summaries.iter().filter(|s| s.slip_mm > SLIP_EVENT_MM).count(),
            incomplete: summaries.iter().filter(|s| !s.completed).count(),
            mean_preload_n: mean(|s| s.mean_preload_n),
            energy_j: mean(|s| s.energy_j),
            wear_j: mean(|s| s.wear_j),
        })
    }
}

/// The aims of the schedule against the other strategies, each with the figure met.
#[must_use]
pub fn aims(comparison: &Comparison) -> Vec<(String, bool)> {
    let mut out = Vec::new();
    for policy in [Policy::StepAware, Policy::OneSpeed] {
        let name = match policy {
            Policy::StepAware => "same step-aware speed",
            Policy::OneSpeed => "one speed throughout",
        };
        if let Some(ratio) = comparison.speed_up(ControllerKind::Constant, policy) {
            out.push((
                format!("{ratio:.2} times as fast as constant at cruise, {name} (aim 2.5)"),
                ratio >= 2.5,
            ));
        }
        if let Some(ratio) = comparison.speed_up(ControllerKind::Limit, policy) {
            out.push((
                format!(
                    "{:+.1} % time against constant at the limit, {name} (aim at most +5)",
                    (1.0 / ratio - 1.0) * 100.0
                ),
                ratio >= 1.0 / 1.05,
            ));
        }
        if let Some(ratio) = comparison.speed_up(ControllerKind::Reactive, policy) {
            out.push((
                format!("{ratio:.2} times as fast as reactive, {name} (aim above 1)"),
                ratio > 1.0,
            ));
        }
    }
    let pair = (
        comparison.find(ControllerKind::Scheduled, Policy::StepAware),
        comparison.find(ControllerKind::Limit, Policy::StepAware),
    );
    if let (Some(scheduled), Some(limit)) = pair {
        let preload = scheduled.mean_preload_n / limit.mean_preload_n - 1.0;
        let wear = scheduled.wear_j / limit.wear_j - 1.0;
        out.push((
            format!("{:+.1} % mean preload against constant at the limit", preload * 100.0),
            preload < -0.02,
        ));
        out.push((
            format!("{:+.1} % tread wear against constant at the limit", wear * 100.0),
            wear < -0.02,
        ));
    }
    let clean = comparison
        .equal_gap
        .iter()
        .filter(|e| e.controller == ControllerKind::Scheduled.name())
        .all(|e| e.slip_events == 0 && e.incomplete == 0);
    out.push(("scheduled without slip and without an incomplete run".into(), clean));
    out
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn all_meet_the_reference_and_none_is_faster_than_the_schedule() {
        let runs = AtomicUsize::new(0);
        let count = || {
            runs.fetch_add(1, Ordering::Relaxed);
        };
        let comparison = compare(&Scenario::default(), 1, 2, &count).unwrap();
        let runs = runs.into_inner();
        assert!((50..=most_runs(2)).contains(&runs), "{runs}");
        assert_eq!((comparison.equal_gap.len(), comparison.equal_speed.len()), (7, 4));
        let scheduled = comparison.find(ControllerKind::Scheduled, Policy::StepAware).unwrap();
        for entry in &comparison.equal_gap {
            let off = entry.worst_gap_mm / comparison.gap_ref_mm - 1.0;
            assert!(entry.tuned && off.abs() < 0.005, "{entry:?}");
            assert_eq!((entry.slip_events, entry.incomplete), (0, 0), "{entry:?}");
            // The limit throughout is as fast, at a higher preload.
            let slack = if entry.controller == "limit" { 1.02 } else { 1.0 };
            assert!(scheduled.deploy_time_s <= slack * entry.deploy_time_s, "{entry:?}");
            assert!(entry.controller != "limit" || entry.mean_preload_n > scheduled.mean_preload_n);
        }
        for policy in [Policy::StepAware, Policy::OneSpeed] {
            assert!(comparison.speed_up(ControllerKind::Constant, policy).unwrap() > 1.3);
        }
        // At the same speed what counts is the preload at the step.
        let gap = |name| {
            let entry = comparison.equal_speed.iter().find(|e| e.controller == name).unwrap();
            assert_eq!(entry.crossing_speed_mm_s, Some(EQUAL_SPEED_MM_S));
            entry.worst_gap_mm / comparison.gap_ref_mm
        };
        assert!((gap("scheduled") - gap("limit")).abs() < 0.005);
        assert!((1.03..1.08).contains(&(gap("constant") / gap("scheduled"))));
        assert!((1.03..1.08).contains(&(gap("reactive") / gap("scheduled"))));
        assert!(aims(&comparison).iter().any(|(aim, met)| aim.contains("without slip") && *met));
    }

    /// Tunes a worst gap that is this function of the variable, between 3 and 30, and
    /// returns the entry with the number of evaluations.
    fn tuned(gap: impl Fn(f64) -> f64) -> (Entry, usize) {
        let scenario = Scenario::default();
        let bench = Bench { scenario: &scenario, first_seed: 1, runs: 0, progress: &|| {} };
        let tries = Cell::new(0);
        let entry = bench.tune(2.0, (3.0, 30.0), |speed| {
            tries.set(tries.get() + 1);
            Ok(Entry {
                controller: "constant".into(),
                policy: Policy::StepAware,
                crossing_speed_mm_s: Some(speed),
                gap_reserve: 0.0,
                tuned: false,
                deploy_time_s: 80.0 / speed,
                worst_gap_mm: gap(speed),
                slip_events: 0,
                incomplete: 0,
                mean_preload_n: 0.0,
                energy_j: 0.0,
                wear_j: 0.0,
            })
        });
        (entry.unwrap(), tries.get())
    }

    #[test]
    fn the_tuning_finds_the_speed_of_the_reference() {
        let curves: [fn(f64) -> f64; 3] =
            [|v| 1.5 + 0.05 * v, |v| 1.0 + 0.35 * v.sqrt(), |v| 2.6 - 4.0 / v];
        for gap in curves {
            let (entry, tries) = tuned(gap);
            assert!(entry.tuned && tries <= MOST_TRIES, "{entry:?} {tries}");
            assert!((entry.worst_gap_mm / 2.0 - 1.0).abs() <= TUNED_WITHIN, "{entry:?}");
        }
    }

    #[test]
    fn a_reference_out_of_reach_is_told() {
        // Always too large: the slowest. Always below: the fastest.
        for (gap, speed) in [(2.5, 3.0), (1.5, 30.0)] {
            let (entry, _) = tuned(|_| gap);
            assert!(!entry.tuned);
            assert_eq!(entry.crossing_speed_mm_s, Some(speed));
        }
        // Met at an end.
        assert!(tuned(|v| if v < 3.5 { 2.0 } else { 2.5 }).0.tuned);
        // Jumped over: the fastest that keeps it.
        let (entry, tries) = tuned(|v| if v < 11.0 { 1.9 } else { 2.1 });
        assert!(!entry.tuned && entry.worst_gap_mm < 2.0 && tries == MOST_TRIES, "{entry:?}");
        assert!(entry.crossing_speed_mm_s > Some(9.0), "{entry:?}");
    }
}
