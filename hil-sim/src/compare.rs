//! The four preload strategies on the same random rigs: how fast each deploys when all are
//! held to the same worst gap.

use interstage::model::Planner;
use interstage::units::Direction;
use rayon::prelude::*;
use serde::Serialize;

use crate::record::Summary;
use crate::report::verdict::SLIP_SEEN_MM;
use crate::scenario::{ControllerKind, Scenario};
use crate::session::{Options, RunError, run};

/// Largest reserve below the reference gap that the tuning tries.
const MOST_RESERVE: f64 = 0.25;
/// How close to the reference the worst gap is tuned, relative.
const TUNED_WITHIN: f64 = 0.002;
/// Most evaluations of one tuning.
const MOST_TRIES: usize = 9;

/// How the speed is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Crossing speed at the steps, cruise speed between them, for every strategy.
    StepAware,
    /// One speed throughout, as a drive without look-ahead must; the scheduled one
    /// keeps its own.
    OneSpeed,
}

/// One strategy over all rigs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Strategy.
    pub controller: &'static str,
    /// How the speed is chosen.
    pub policy: Policy,
    /// Crossing speed prescribed, mm/s; none for the scheduled strategy.
    pub crossing_speed_mm_s: Option<f64>,
    /// Reserve below the reference gap; the scheduled strategy's tuning.
    pub gap_reserve: f64,
    /// Whether the worst gap was brought to the reference. At the least crossing speed it may
    /// still be above, at the greatest below.
    pub tuned: bool,
    /// Mean time from the accepted command to arrival, s; infinite if a run never moved.
    pub duration_s: f64,
    /// Mean time from start of motion to its end, s.
    pub moving_s: f64,
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
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Rigs drawn.
    pub runs: usize,
    /// Reference gap, mm.
    pub gap_ref_mm: f64,
    /// The strategies, all held to the same worst gap: the scheduled one first.
    pub entries: Vec<Entry>,
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
    // A smaller reserve gives a larger gap: the variable is the reserve's negative.
    let scheduled = bench.tune(reference, (-MOST_RESERVE, 0.0), |x| {
        bench.evaluate(ControllerKind::Scheduled, Policy::StepAware, None, -x)
    });
    let mut entries = vec![scheduled?];
    let drive = &scenario.rig.drive;
    let speeds = (drive.min_crossing_speed_mm_s, drive.cruise_speed_mm_s);
    for policy in [Policy::StepAware, Policy::OneSpeed] {
        for kind in [ControllerKind::Constant, ControllerKind::Limit, ControllerKind::Reactive] {
            let evaluate = |speed| bench.evaluate(kind, policy, Some(speed), 0.0);
            entries.push(bench.tune(reference, speeds, evaluate)?);
        }
    }
    Ok(Comparison { runs, gap_ref_mm: reference, entries })
}

/// Most runs that [`compare`] makes over so many rigs, for a progress bar.
#[must_use]
pub fn most_runs(rigs: usize) -> usize {
    rigs * 7 * MOST_TRIES
}

struct Bench<'a> {
    scenario: &'a Scenario,
    first_seed: u64,
    runs: usize,
    progress: &'a (dyn Fn() + Sync),
}

impl Bench<'_> {
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
        // The fastest that keeps the reference, if the tries run out.
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
            controller: kind.name(),
            policy,
            crossing_speed_mm_s: speed,
            gap_reserve: reserve,
            tuned: false,
            duration_s: mean(|s| s.duration_s.unwrap_or(f64::INFINITY)),
            moving_s: mean(|s| s.moving_s),
            worst_gap_mm: summaries.iter().map(|s| s.max_gap_mm).fold(0.0, f64::max),
            slip_events: summaries.iter().filter(|s| s.slip_mm > SLIP_SEEN_MM).count(),
            incomplete: summaries.iter().filter(|s| !s.completed).count(),
            mean_preload_n: mean(|s| s.mean_preload_n),
            energy_j: mean(|s| s.energy_j),
            wear_j: mean(|s| s.wear_j),
        })
    }
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
        let [scheduled, others @ ..] = &comparison.entries[..] else { panic!("no entry") };
        assert_eq!((scheduled.controller, others.len()), ("scheduled", 6));
        for entry in &comparison.entries {
            let off = entry.worst_gap_mm / comparison.gap_ref_mm - 1.0;
            assert!(entry.tuned && off.abs() < 0.005, "{entry:?}");
            assert_eq!((entry.slip_events, entry.incomplete), (0, 0), "{entry:?}");
            // The limit throughout is as fast, at a higher preload.
            let slack = if entry.controller == "limit" { 1.02 } else { 1.0 };
            assert!(scheduled.duration_s <= slack * entry.duration_s, "{entry:?}");
            assert!(entry.controller != "limit" || entry.mean_preload_n > scheduled.mean_preload_n);
            let factor = entry.duration_s / scheduled.duration_s;
            assert!(entry.controller != "constant" || factor > 1.3, "{entry:?}");
        }
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
                controller: "constant",
                policy: Policy::StepAware,
                crossing_speed_mm_s: Some(speed),
                gap_reserve: 0.0,
                tuned: false,
                duration_s: 80.0 / speed,
                moving_s: 80.0 / speed,
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
    fn a_reference_out_of_reach_is_reported() {
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
