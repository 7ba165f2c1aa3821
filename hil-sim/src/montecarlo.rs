//! Runs many random rigs, one per seed, in parallel, and finds what limits them.

mod drawn;
mod outcome;

use interstage::fault::Limit;
use serde::{Deserialize, Serialize};

use crate::campaign::Campaign;
use crate::record::{CrossingLine, Report, Summary, or_nan};
use crate::report::verdict::SLIP_SEEN_MM;
use crate::scenario::Scenario;
use crate::session::{self, Options, RunError};

pub(crate) use drawn::Drawn;
pub(crate) use outcome::{Least, Outcome};

/// The result of one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunLine {
    pub seed: u64,
    /// Whether it reached the end of travel with every step crossed and no fault.
    pub completed: bool,
    /// From the accepted command to arrival, s, see [`Summary::duration_s`].
    pub duration_s: Option<f64>,
    /// From the start of motion to its end, s.
    pub moving_s: f64,
    /// Largest gap at a step, or separation elsewhere, mm.
    #[serde(deserialize_with = "or_nan")]
    pub max_gap_mm: f64,
    /// The same over the reference gap; none without reference.
    pub gap_over_ref: Option<f64>,
    /// Gap of the first crossing over the reference.
    pub first_gap_over_ref: Option<f64>,
    /// Largest gap of the crossings after it over the reference.
    pub later_gap_over_ref: Option<f64>,
    /// Distance from the commanded end, mm, of a run that the controller calls complete.
    pub end_off_mm: Option<f64>,
    /// The same over the one sigma that the controller states of its position there.
    pub end_off_sigmas: Option<f64>,
    /// Steps that were found: number, and distance of the face on record from the true one, mm.
    pub found_off_mm: Vec<(u8, f64)>,
    /// Whether it ended short of the end and nothing reports it.
    pub silent: bool,
    /// Whether it ended without a fault although something was wrong that nothing reports.
    pub unreported: bool,
    /// Whether a fault ended it although the wheel had neither slipped nor opened a wide gap.
    pub stopped_sound: bool,
    /// Crossings with gross slip, or 1 if the run slipped but none of them did.
    pub slip_events: usize,
    /// Least time by which the preload was reached before a corner touched, s.
    pub least_lead_s: Option<f64>,
    /// Least of the plant's friction less the utilisation at its peak in a crossing.
    pub least_slip_margin: Option<f64>,
    /// Mean true preload while moving, N.
    #[serde(deserialize_with = "or_nan")]
    pub mean_preload_n: f64,
    pub faults: Vec<Report>,
    /// Codes of the limits that occurred, each once, ascending.
    pub limits: Vec<u16>,
    /// Why the plant failed, if it did.
    pub error: Option<String>,
    /// SHA-256 over the controller's trace.
    pub trace_digest: String,
}

impl RunLine {
    /// The line of a finished run on a plant with friction `mu`, commanded to travel this far,
    /// mm.
    pub(crate) fn new(summary: Summary, mu: f64, travel_mm: f64) -> Self {
        let crossings = &summary.crossings;
        let least = |values: &mut dyn Iterator<Item = f64>| values.min_by(f64::total_cmp);
        let mut limits: Vec<u16> = summary.limits.iter().map(|limit| limit.code).collect();
        limits.sort_unstable();
        limits.dedup();
        let over_ref = |gap: f64| gap / summary.gap_ref_mm;
        let gaps = || crossings.iter().map(|c| over_ref(c.gap_mm));
        let referred = summary.gap_ref_mm > 0.0;
        let completed = summary.completed && summary.faults.is_empty();
        let reported =
            !summary.faults.is_empty() || limits.iter().any(|code| REPORT_END.contains(code));
        let called_complete = summary.faults.is_empty() && summary.cut_off_s.is_none();
        let end_off_mm = called_complete.then(|| (summary.travel_mm - travel_mm).abs());
        let found = |c: &CrossingLine| Some((c.index, (c.step_found_mm? - c.step_mm).abs()));
        Self {
            seed: summary.seed,
            completed,
            first_gap_over_ref: gaps().next().filter(|_| referred),
            later_gap_over_ref: gaps().skip(1).max_by(f64::total_cmp).filter(|_| referred),
            end_off_sigmas: end_off_mm.zip(summary.position_sigma_mm).map(|(off, one)| off / one),
            end_off_mm,
            found_off_mm: crossings.iter().filter_map(found).collect(),
            silent: !completed && !reported,
            stopped_sound: !summary.faults.is_empty()
                && summary.slip_mm <= UNNAMED.0
                && !opened_wide(&summary),
            unreported: summary.faults.is_empty() && is_unreported(&summary, &limits, travel_mm),
            duration_s: summary.duration_s,
            moving_s: summary.moving_s,
            max_gap_mm: summary.max_gap_mm,
            gap_over_ref: (referred && summary.max_gap_mm.is_finite())
                .then(|| over_ref(summary.max_gap_mm)),
            slip_events: slip_events(&summary),
            least_lead_s: least(&mut crossings.iter().filter_map(|c| c.lead_time_s)),
            least_slip_margin: least(&mut crossings.iter().map(|c| mu - c.peak_utilisation)),
            mean_preload_n: summary.mean_preload_n,
            faults: summary.faults,
            limits,
            error: None,
            trace_digest: summary.trace_digest,
        }
    }
}

/// Codes of the limits that say that the run does not end where it should.
const REPORT_END: [u16; 3] =
    [Limit::StepMissing.code(), Limit::PositionUnconfirmed.code(), Limit::EndOverrun.code()];

/// Slip that is named wrong by more than this, mm, by more than this part of it and by more than
/// two of its sigmas as stated; distance from the end, mm; and gap over the reference, from which a
/// run that names none of them is wrong in silence.
const UNNAMED: (f64, f64) = (0.5, 0.2);
const END_MM: f64 = 1.0;
const GAP: f64 = 1.1;

/// Whether a run slipped, ended elsewhere or opened a gap without a word of it.
fn is_unreported(summary: &Summary, limits: &[u16], travel_mm: f64) -> bool {
    let off = |slip: f64, named: f64, sigma: f64| {
        (slip - named).abs() > UNNAMED.0.max(UNNAMED.1 * slip).max(2.0 * sigma)
    };
    let crossings = &summary.crossings;
    let crossed: f64 = crossings.iter().map(|c| c.slip_mm).sum();
    let wide = opened_wide(summary);
    let misnamed = |c: &CrossingLine| {
        let [named, sigma] = [c.slip_measured_mm, c.slip_sigma_mm].map(Option::unwrap_or_default);
        off(c.slip_mm, named, sigma)
    };
    crossings.iter().any(misnamed)
        || off(summary.slip_mm - crossed, 0.0, 0.0)
        || (summary.travel_mm - travel_mm).abs() > END_MM
            && !limits.contains(&Limit::EndOverrun.code())
        || wide && !limits.contains(&Limit::GapWide.code())
}

fn opened_wide(summary: &Summary) -> bool {
    summary.max_gap_mm > GAP * summary.gap_ref_mm && summary.gap_ref_mm > 0.0
}

/// Crossings with gross slip; a run that slipped only elsewhere counts as one.
pub(crate) fn slip_events(summary: &Summary) -> usize {
    let crossings = summary.crossings.iter().filter(|c| c.slip_mm > SLIP_SEEN_MM).count();
    crossings.max(usize::from(summary.slip_mm > SLIP_SEEN_MM))
}

/// The campaign that runs `scenario` once for each of `seeds`. A plant that fails, or is
/// refused, is a line with an error.
pub fn campaign(
    scenario: &Scenario,
    seeds: Vec<u64>,
) -> Campaign<'_, u64, RunLine, Vec<RunLine>, RunError> {
    Campaign {
        steps: ("runs", 1),
        cases: seeds,
        run: Box::new(|seed, watch| {
            let line = one(scenario, *seed);
            (watch.done)();
            line.map(Some)
        }),
        fold: Box::new(|lines| lines.into_iter().map(|(_, line)| line).collect()),
    }
}

fn one(scenario: &Scenario, seed: u64) -> Result<RunLine, RunError> {
    let mut scenario = scenario.clone();
    scenario.run.seed = seed;
    match session::run(&scenario, Options::default()) {
        Ok(recording) => {
            let travel_mm = scenario.rig.rig.travel_mm;
            Ok(RunLine::new(recording.summary, scenario.plant().mu, travel_mm))
        }
        Err(error @ (RunError::Plant(_) | RunError::Refused(_))) => {
            Ok(RunLine { seed, error: Some(error.to_string()), ..RunLine::default() })
        }
        Err(error) => Err(error),
    }
}

fn limit_text(code: u16) -> &'static str {
    let known = Limit::ALL.into_iter().find(|limit| limit.code() == code);
    known.map_or("unknown limit", Limit::sentence)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossing(slip_mm: f64, lead: Option<f64>, peak_utilisation: f64) -> CrossingLine {
        CrossingLine { slip_mm, lead_time_s: lead, peak_utilisation, ..CrossingLine::default() }
    }

    fn limit(code: u16) -> Report {
        Report { t_s: 1.0, code, text: String::new() }
    }

    #[test]
    fn slip_counts_by_crossing_and_else_by_run() {
        let crossings =
            vec![crossing(0.2, None, 0.0), crossing(0.01, None, 0.0), crossing(0.06, None, 0.0)];
        let slipped = Summary { slip_mm: 0.3, crossings, ..Summary::default() };
        assert_eq!(slip_events(&slipped), 2);
        let elsewhere = Summary { slip_mm: 0.3, ..Summary::default() };
        assert_eq!(slip_events(&elsewhere), 1);
        assert_eq!(slip_events(&Summary { slip_mm: 0.05, ..Summary::default() }), 0);
    }

    #[test]
    fn a_line_keeps_the_worst_of_its_crossings() {
        let summary = Summary {
            completed: true,
            max_gap_mm: 2.0,
            gap_ref_mm: 2.5,
            travel_mm: 79.7,
            total_s: 6.0,
            limits: vec![limit(205), limit(201), limit(205)],
            crossings: vec![crossing(0.0, Some(0.3), 0.7), crossing(0.0, Some(-0.1), 0.9)],
            ..Summary::default()
        };
        let line = RunLine::new(summary, 1.0, 80.0);
        assert_eq!(line.gap_over_ref, Some(0.8));
        assert_eq!(line.least_lead_s, Some(-0.1));
        assert!((line.least_slip_margin.unwrap() - 0.1).abs() < 1e-12);
        assert_eq!(line.limits, [201, 205]);
        assert!((line.end_off_mm.unwrap() - 0.3).abs() < 1e-12 && !line.silent);
    }

    #[test]
    fn first_and_later_gaps_and_found_steps_are_told_apart() {
        let line = |index, gap_mm, found| CrossingLine {
            index,
            gap_mm,
            step_mm: 18.0,
            step_found_mm: found,
            ..CrossingLine::default()
        };
        let crossings =
            vec![line(1, 3.0, Some(18.5)), line(2, 2.0, None), line(3, 2.5, Some(17.9))];
        let summary = Summary { gap_ref_mm: 2.0, crossings, ..Summary::default() };
        let line = RunLine::new(summary, 1.0, 80.0);
        assert_eq!((line.first_gap_over_ref, line.later_gap_over_ref), (Some(1.5), Some(1.25)));
        assert_eq!(line.found_off_mm.iter().map(|found| found.0).collect::<Vec<_>>(), [1, 3]);
        assert!((line.found_off_mm[1].1 - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_run_that_ends_short_is_silent_unless_a_fault_or_limit_says_so() {
        let silent = |summary: Summary| RunLine::new(summary, 1.0, 80.0).silent;
        let short = Summary { total_s: 5.0, limits: vec![limit(206)], ..Summary::default() };
        assert!(silent(short.clone()));
        assert!(!silent(Summary { completed: true, ..short.clone() }));
        for (code, says) in [(202, false), (203, true), (213, true), (220, true)] {
            assert_eq!(silent(Summary { limits: vec![limit(code)], ..short.clone() }), !says);
        }
        assert!(!silent(Summary { faults: vec![limit(121)], ..short }));
    }

    #[test]
    fn a_fault_that_stops_a_sound_run_is_counted() {
        let sound = |summary: Summary| RunLine::new(summary, 1.0, 80.0).stopped_sound;
        let faults = vec![limit(136)];
        let stopped = Summary { faults, max_gap_mm: 2.7, gap_ref_mm: 2.66, ..Summary::default() };
        assert!(sound(stopped.clone()));
        assert!(!sound(Summary { faults: Vec::new(), ..stopped.clone() }));
        assert!(!sound(Summary { slip_mm: 0.6, ..stopped.clone() }));
        assert!(!sound(Summary { max_gap_mm: 3.0, ..stopped }));
    }
}
