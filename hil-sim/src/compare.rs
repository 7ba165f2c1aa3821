//! The four preload strategies on the same random rigs, with equal privileges: how fast each
//! deploys when all are held to the same worst gap. Beside them the best run that the same
//! plants allow, see [`crate::oracle`].

mod tuning;

use interstage::model::Planner;
use interstage::units::Direction;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::campaign::{Campaign, Watch};
use crate::montecarlo::{self, RunLine};
use crate::oracle::{self, Bounds};
use crate::scenario::{ControllerKind, Scenario};
use crate::session::RunError;

use tuning::MOST_TRIES;
pub(crate) use tuning::TUNED_WITHIN;

/// The strategies, the one that the others are compared with first.
pub(crate) const STRATEGIES: [ControllerKind; 4] = [
    ControllerKind::Scheduled,
    ControllerKind::Constant,
    ControllerKind::Limit,
    ControllerKind::Reactive,
];

/// Name of the entry of the best runs.
pub(crate) const ORACLE: &str = "oracle";

/// One strategy over all rigs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Entry {
    /// Strategy, or [`ORACLE`].
    pub controller: String,
    /// Part of the reference gap by which the planner's own one is below it; the tuning. None for
    /// the oracle.
    pub gap_reserve: Option<f64>,
    /// Whether the worst gap was brought to the reference. At the least crossing speed it may
    /// still be above, without any reserve below.
    pub tuned: bool,
    /// Mean time from the accepted command to arrival over the completed runs, s.
    pub duration_s: Option<f64>,
    /// Mean time from the start of motion to arrival over the completed runs, s.
    pub moving_s: Option<f64>,
    /// Largest gap of all crossings, mm; none without runs.
    pub worst_gap_mm: Option<f64>,
    /// Least of the plant's friction less its utilisation in a crossing.
    pub least_slip_margin: Option<f64>,
    /// Crossings with gross slip, and runs that slipped elsewhere.
    pub slip_events: usize,
    /// Runs that did not complete.
    pub incomplete: usize,
    /// Mean preload while moving, over the completed runs, N.
    pub mean_preload_n: Option<f64>,
}

impl Entry {
    /// The entry of these runs.
    fn of(controller: &str, gap_reserve: Option<f64>, lines: &[RunLine]) -> Self {
        let completed = || lines.iter().filter(|line| line.completed);
        let mean = |of: &dyn Fn(&RunLine) -> Option<f64>| {
            let values: Vec<f64> = completed().filter_map(of).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        let gaps = lines.iter().filter(|line| line.error.is_none()).map(|line| line.max_gap_mm);
        let gaps = gaps.filter(|gap| gap.is_finite());
        let margins = lines.iter().filter_map(|line| line.least_slip_margin);
        Self {
            controller: controller.to_owned(),
            gap_reserve,
            tuned: false,
            duration_s: mean(&|line| line.duration_s),
            moving_s: mean(&|line| Some(line.moving_s)),
            worst_gap_mm: gaps.max_by(f64::total_cmp),
            least_slip_margin: margins.min_by(f64::total_cmp),
            slip_events: lines.iter().map(|line| line.slip_events).sum(),
            incomplete: lines.len() - completed().count(),
            mean_preload_n: mean(&|line| Some(line.mean_preload_n)),
        }
    }
}

/// A strategy over all rigs and, behind the scheduled one, the oracle.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Compared {
    entry: Entry,
    oracle: Option<Entry>,
    /// Seeds of plants for which the oracle found no run, and which bound it could not keep.
    oracle_fails: Vec<(u64, String)>,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Comparison {
    /// Rigs drawn.
    pub runs: usize,
    pub gap_ref_mm: f64,
    /// The strategies, all held to the same worst gap, the scheduled one first; then the oracle.
    pub entries: Vec<Entry>,
    /// Seeds of plants for which the oracle found no run, and which bound it could not keep.
    #[serde(skip)]
    pub oracle_fails: Vec<(u64, String)>,
}

/// The campaign that compares the strategies over the rigs of these seeds, with the oracle if
/// it has an `effort`: on each plant the best run within the worst gap of the scheduled run there and
/// the demanded slip margin.
///
/// Every strategy has the same planner: it rolls while the preload builds, brakes late, keeps
/// the same friction check and aims at a gap that lies below the reference by a reserve. The
/// reserve of each is tuned until its worst gap over all rigs is the reference; then the times are
/// comparable.
pub(crate) fn campaign(
    scenario: &Scenario,
    seeds: Vec<u64>,
    effort: Option<oracle::Effort>,
) -> Result<Campaign<'_, ControllerKind, Compared, Comparison, RunError>, RunError> {
    let direction: Direction = scenario.run.direction.into();
    let reference = Planner::try_build(&scenario.rig)?.gap_ref(direction).to_num::<f64>();
    let runs = seeds.len();
    let run = move |kind: &ControllerKind, watch: Watch| {
        let tuned = tuning::tune(reference, |reserve| {
            let mut scenario = scenario.clone();
            scenario.run.controller = *kind;
            // Not the rig's own reserve: the crossings earn that back.
            scenario.rig.control.gap_ref_mm = reference * (1.0 - reserve);
            let rigs = montecarlo::campaign(&scenario, seeds.clone());
            let lines = rigs.lines(&(0..runs).collect::<Vec<_>>(), watch)?;
            let lines: Vec<RunLine> = lines.into_iter().map(|(_, line)| line).collect();
            let entry = Entry::of(kind.name(), Some(reserve), &lines);
            Ok((lines.len() == runs).then_some((entry, lines)))
        })?;
        let Some((entry, lines)) = tuned else { return Ok(None) };
        let mut compared = Compared { entry, oracle: None, oracle_fails: Vec::new() };
        if let Some(effort) = effort.filter(|_| *kind == ControllerKind::Scheduled) {
            let best = |line: &RunLine| {
                if (watch.stop)() {
                    return Ok(None);
                }
                let mut scenario = scenario.clone();
                scenario.run.seed = line.seed;
                let bounds = Bounds::of(line, reference, scenario.rig.control.slip_margin);
                let found = oracle::search(&scenario, &bounds, effort);
                (watch.done)();
                found.map(|run| Some(run.line))
            };
            let lines: Option<Vec<_>> =
                lines.par_iter().map(best).collect::<Result<_, RunError>>()?;
            let Some(lines) = lines else { return Ok(Some(compared)) };
            let fails = |line: &RunLine| Some((line.seed, line.error.clone()?));
            compared.oracle_fails = lines.iter().filter_map(fails).collect();
            compared.oracle = Some(Entry { tuned: true, ..Entry::of(ORACLE, None, &lines) });
        }
        Ok(Some(compared))
    };
    let fold = move |lines: Vec<(ControllerKind, Compared)>| {
        let oracle = lines.iter().find_map(|(_, line)| line.oracle.clone());
        let fails = lines.iter().flat_map(|(_, line)| line.oracle_fails.clone()).collect();
        let entries = lines.into_iter().map(|(_, line)| line.entry).chain(oracle).collect();
        Comparison { runs, gap_ref_mm: reference, entries, oracle_fails: fails }
    };
    Ok(Campaign {
        steps: ("runs at most", runs * MOST_TRIES),
        cases: STRATEGIES.to_vec(),
        run: Box::new(run),
        fold: Box::new(fold),
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn every_strategy_is_held_to_the_reference_and_the_oracle_is_the_fastest() {
        let runs = AtomicUsize::new(0);
        let count = || {
            runs.fetch_add(1, Ordering::Relaxed);
        };
        let scenario = Scenario::default();
        let campaign = campaign(&scenario, vec![1], Some(oracle::Effort::COARSE)).unwrap();
        let most = campaign.steps.1 * campaign.cases.len();
        let comparison = campaign.complete(&count).unwrap();
        let runs = runs.into_inner();
        assert!((STRATEGIES.len()..=most).contains(&runs), "{runs}");
        for entry in &comparison.entries {
            let off = entry.worst_gap_mm.unwrap() / comparison.gap_ref_mm - 1.0;
            assert!(!entry.tuned || entry.controller == ORACLE || off.abs() < 0.005, "{entry:?}");
            assert_eq!((entry.slip_events, entry.incomplete), (0, 0), "{entry:?}");
            assert!(entry.duration_s > entry.moving_s, "{entry:?}");
        }
        let [scheduled, .., oracle] = &comparison.entries[..] else { panic!("no entries") };
        assert!(oracle.duration_s < scheduled.duration_s, "{oracle:?} {scheduled:?}");
        assert!(oracle.worst_gap_mm <= scheduled.worst_gap_mm, "{oracle:?} {scheduled:?}");
        let wanted = scenario.rig.control.slip_margin;
        assert!(oracle.least_slip_margin >= Some(0.99 * wanted), "{oracle:?}");
    }

    #[test]
    fn an_entry_takes_times_from_completed_runs_and_the_worst_of_all() {
        let good = RunLine {
            completed: true,
            duration_s: Some(5.0),
            moving_s: 4.0,
            max_gap_mm: 2.0,
            least_slip_margin: Some(0.3),
            ..RunLine::default()
        };
        let slipped = RunLine {
            duration_s: Some(120.0),
            moving_s: 119.0,
            max_gap_mm: 3.0,
            slip_events: 2,
            least_slip_margin: Some(0.0),
            ..RunLine::default()
        };
        let failed = RunLine { error: Some("not finite".into()), ..RunLine::default() };
        let entry = Entry::of("limit", Some(0.1), &[good.clone(), slipped, failed.clone(), good]);
        assert_eq!((entry.duration_s, entry.moving_s), (Some(5.0), Some(4.0)));
        assert_eq!((entry.worst_gap_mm, entry.least_slip_margin), (Some(3.0), Some(0.0)));
        assert_eq!((entry.slip_events, entry.incomplete), (2, 2));
        let none = Entry::of("limit", None, &[failed]);
        assert_eq!((none.duration_s, none.worst_gap_mm, none.incomplete), (None, None, 1));
    }
}
