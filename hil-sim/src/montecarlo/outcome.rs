//! Statistics of a campaign.

use serde::Serialize;

use super::{Drawn, RunLine, drawn, limit_text};
use crate::scenario::Scenario;

/// Median, 95th and 99th percentile and maximum of a figure over the runs that have it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Quantiles {
    pub p50: f64,
    pub p95: f64,
    pub p99: f64,
    pub max: f64,
    /// Seed of the largest; the lowest of several.
    pub seed: u64,
}

/// Least of a figure over the runs that have it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Least {
    pub min: f64,
    /// Its seed; the lowest of several.
    pub seed: u64,
}

/// A fault or failure, and in which run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct SeedReport {
    pub seed: u64,
    /// The fault's code; none if the plant failed.
    pub code: Option<u16>,
    pub text: String,
}

/// How many runs met a limit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct LimitCount {
    pub code: u16,
    pub text: &'static str,
    /// Runs in which it occurred.
    pub runs: usize,
}

/// How far from the true face of a step the controller recorded it, mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct StepFound {
    /// Step number, from 1.
    pub index: u8,
    /// Runs in which it was found.
    pub runs: usize,
    #[serde(flatten)]
    pub off_mm: Quantiles,
}

/// A campaign; `rig montecarlo --json` prints it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Outcome {
    pub runs: usize,
    /// Runs that reached the end of travel with every step crossed and no fault.
    pub completed: usize,
    /// Largest gap at a step, or separation elsewhere, mm.
    pub worst_gap_mm: Option<f64>,
    pub worst_gap_seed: Option<u64>,
    /// Crossings with gross slip, and runs that slipped elsewhere.
    pub slip_events: usize,
    /// Faults, in the order of seeds.
    pub faults: Vec<SeedReport>,
    /// Seeds of the runs that did not complete.
    pub incomplete: Vec<u64>,
    /// Seeds of those of them that no fault and no limit reports.
    pub silent: Vec<u64>,
    /// Seeds of the runs without a fault in which the wheel slipped by over 0.5 mm unnamed, that
    /// ended over 1 mm off, or whose gap was over 1.1 of the reference, with nothing reported.
    pub unreported: Vec<u64>,
    /// Seeds of the runs that a fault ended although the wheel had slipped by no more than 0.5 mm,
    /// and no gap was over 1.1 of the reference: false faults are among them.
    pub stopped_sound: Vec<u64>,
    /// Duration of the completed runs from the accepted command to arrival, s.
    pub duration_s: Option<Quantiles>,
    /// Part of it in which the wheel moved, s.
    pub moving_s: Option<Quantiles>,
    /// Worst gap of each run over the reference.
    pub gap_over_ref: Option<Quantiles>,
    /// Gap of the first crossing over the reference.
    pub first_gap_over_ref: Option<Quantiles>,
    /// Worst gap of the crossings after it over the reference.
    pub later_gap_over_ref: Option<Quantiles>,
    /// Distance from the commanded end of the runs that the controller calls complete, mm.
    pub end_off_mm: Option<Quantiles>,
    /// The same over the one sigma that the controller states of its position there.
    pub end_off_sigmas: Option<Quantiles>,
    pub steps_found: Vec<StepFound>,
    /// Least time by which the preload was reached before a corner touched, s.
    pub lead_time_s: Option<Least>,
    /// Least of the plant's friction less its utilisation.
    pub slip_margin: Option<Least>,
    /// Limits that occurred, by code.
    pub limits: Vec<LimitCount>,
    /// What the runs have and the controller is not told.
    pub drawn: Vec<Drawn>,
}

impl Outcome {
    /// The campaign of these runs.
    pub(crate) fn of(lines: &[RunLine]) -> Self {
        let figure = |pick: &dyn Fn(&RunLine) -> Option<f64>| -> Vec<(f64, u64)> {
            lines.iter().filter_map(|line| Some((pick(line)?, line.seed))).collect()
        };
        // A plant that failed has no gap, nor has a run without a crossing.
        let gaps = quantiles(figure(&|line| {
            line.error.is_none().then_some(line.max_gap_mm).filter(|gap| gap.is_finite())
        }));
        Self {
            runs: lines.len(),
            completed: lines.iter().filter(|line| line.completed).count(),
            worst_gap_mm: gaps.map(|gaps| gaps.max),
            worst_gap_seed: gaps.map(|gaps| gaps.seed),
            slip_events: lines.iter().map(|line| line.slip_events).sum(),
            faults: lines.iter().flat_map(faults).collect(),
            incomplete: lines.iter().filter(|line| !line.completed).map(|l| l.seed).collect(),
            silent: lines.iter().filter(|line| line.silent).map(|line| line.seed).collect(),
            unreported: lines.iter().filter(|line| line.unreported).map(|l| l.seed).collect(),
            stopped_sound: lines.iter().filter(|l| l.stopped_sound).map(|l| l.seed).collect(),
            duration_s: quantiles(figure(&|line| line.duration_s.filter(|_| line.completed))),
            moving_s: quantiles(figure(&|line| line.completed.then_some(line.moving_s))),
            gap_over_ref: quantiles(figure(&|line| line.gap_over_ref)),
            first_gap_over_ref: quantiles(figure(&|line| line.first_gap_over_ref)),
            later_gap_over_ref: quantiles(figure(&|line| line.later_gap_over_ref)),
            end_off_mm: quantiles(figure(&|line| line.end_off_mm)),
            end_off_sigmas: quantiles(figure(&|line| line.end_off_sigmas)),
            steps_found: steps_found(lines),
            lead_time_s: least(figure(&|line| line.least_lead_s)),
            slip_margin: least(figure(&|line| line.least_slip_margin)),
            limits: limits(lines),
            drawn: Vec::new(),
        }
    }

    /// The same with what these seeds of the scenario draw.
    pub(crate) fn drawn_from(self, scenario: &Scenario, seeds: &[u64]) -> Self {
        Self { drawn: drawn::mismatch(scenario, seeds), ..self }
    }
}

fn faults(line: &RunLine) -> impl Iterator<Item = SeedReport> {
    let seed = line.seed;
    let reported = line.faults.iter().map(move |fault| SeedReport {
        seed,
        code: Some(fault.code),
        text: fault.text.clone(),
    });
    let failed =
        line.error.iter().map(move |text| SeedReport { seed, code: None, text: text.clone() });
    reported.chain(failed)
}

fn steps_found(lines: &[RunLine]) -> Vec<StepFound> {
    let all = || lines.iter().flat_map(|line| &line.found_off_mm);
    let most = all().map(|found| found.0).max().unwrap_or(0);
    (1..=most)
        .filter_map(|index| {
            let of = |line: &RunLine| {
                let found = line.found_off_mm.iter().find(|found| found.0 == index)?;
                Some((found.1, line.seed))
            };
            let figures: Vec<(f64, u64)> = lines.iter().filter_map(of).collect();
            let runs = figures.len();
            Some(StepFound { index, runs, off_mm: quantiles(figures)? })
        })
        .collect()
}

fn limits(lines: &[RunLine]) -> Vec<LimitCount> {
    let mut codes: Vec<u16> = lines.iter().flat_map(|line| line.limits.iter().copied()).collect();
    codes.sort_unstable();
    codes
        .chunk_by(|a, b| a == b)
        .map(|same| LimitCount { code: same[0], text: limit_text(same[0]), runs: same.len() })
        .collect()
}

/// Nearest-rank quantiles: each is the figure of one of the runs.
fn quantiles(mut figures: Vec<(f64, u64)>) -> Option<Quantiles> {
    figures.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    let (max, seed) = *figures.last()?;
    let at = |percent: usize| figures[(figures.len() * percent).div_ceil(100) - 1].0;
    Some(Quantiles { p50: at(50), p95: at(95), p99: at(99), max, seed })
}

fn least(figures: Vec<(f64, u64)>) -> Option<Least> {
    figures
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        .map(|(min, seed)| Least { min, seed })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Report;

    fn line(seed: u64, max_gap_mm: f64) -> RunLine {
        let (duration_s, moving_s) = (Some(5.0), 4.0);
        RunLine { seed, completed: true, duration_s, moving_s, max_gap_mm, ..RunLine::default() }
    }

    #[test]
    fn quantiles_are_figures_of_runs_and_among_equals_name_the_lowest_seed() {
        let figures = (1..=20).map(|seed| (seed as f64, seed)).collect();
        let found = quantiles(figures).unwrap();
        assert_eq!((found.p50, found.p95, found.max, found.seed), (10.0, 19.0, 20.0, 20));
        let one = quantiles(vec![(3.0, 7)]).unwrap();
        assert_eq!((one.p50, one.p95, one.max, one.seed), (3.0, 3.0, 3.0, 7));
        assert_eq!(quantiles(Vec::new()), None);
        assert_eq!(quantiles(vec![(1.0, 2), (1.0, 5)]).unwrap().seed, 2);
        assert_eq!(least(vec![(1.0, 5), (1.0, 2)]).unwrap().seed, 2);
    }

    #[test]
    fn a_campaign_counts_faults_limits_and_failures() {
        let fault = Report { t_s: 1.0, code: 121, text: "late".into() };
        let lines = [
            RunLine { limits: vec![205, 209], slip_events: 2, ..line(1, 2.0) },
            RunLine { completed: false, faults: vec![fault], limits: vec![205], ..line(2, 1.0) },
            RunLine { seed: 3, error: Some("not finite".into()), ..RunLine::default() },
        ];
        let outcome = Outcome::of(&lines);
        assert_eq!((outcome.runs, outcome.completed, outcome.slip_events), (3, 1, 2));
        assert_eq!((outcome.worst_gap_mm, outcome.worst_gap_seed), (Some(2.0), Some(1)));
        assert_eq!(outcome.incomplete, [2, 3]);
        assert!(outcome.silent.is_empty());
        let codes: Vec<_> = outcome.faults.iter().map(|f| (f.seed, f.code)).collect();
        assert_eq!(codes, [(2, Some(121)), (3, None)]);
        let limits: Vec<_> = outcome.limits.iter().map(|l| (l.code, l.runs)).collect();
        assert_eq!(limits, [(205, 2), (209, 1)]);
        let longest = [outcome.duration_s, outcome.moving_s].map(|times| times.unwrap().max);
        assert_eq!(longest, [5.0, 4.0]);
        assert_eq!(outcome.lead_time_s, None);
        let none = Outcome::of(&[]);
        assert_eq!((none.runs, none.worst_gap_mm), (0, None));
    }

    #[test]
    fn steps_are_judged_each_by_the_runs_that_found_it() {
        let of = |seed, found: &[(u8, f64)]| RunLine {
            found_off_mm: found.to_vec(),
            silent: seed == 2,
            ..line(seed, 1.0)
        };
        let outcome = Outcome::of(&[of(1, &[(1, 0.2), (3, 0.1)]), of(2, &[(1, 0.4)])]);
        let found = outcome.steps_found;
        assert_eq!(found.iter().map(|s| (s.index, s.runs)).collect::<Vec<_>>(), [(1, 2), (3, 1)]);
        assert_eq!((found[0].off_mm.p50, found[0].off_mm.max, found[0].off_mm.seed), (0.2, 0.4, 2));
        assert_eq!(outcome.silent, [2]);
    }
}
