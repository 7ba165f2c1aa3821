//! Every fault at random instants of random rigs, each beside the same run without it.

mod case;
mod matrix;
mod twin;

use std::borrow::Cow;

use interstage::supervise::{Command, Leg, Mode};
use interstage::units::Direction;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::judge::{Finding, Judge};
use crate::campaign::{Campaign, Watch};
use crate::injector::FaultTimes;
use crate::record::or_nan;
use crate::scenario::Scenario;
use crate::scenario::injection::{Injection, Target, restarts};
use crate::session::{Options, RunError, RunningRig, Session, drive, longest_s};

pub use case::Case;
pub use matrix::{MatrixRow, MedianAndWorst, Outcome};
pub use twin::Twin;
use twin::out_and_back;

/// How long a run is watched after its end, s.
pub const AFTER_S: f64 = 1.0;

/// What became of one fault at one instant.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Instant {
    pub seed: u64,
    /// When the fault came, s since boot; none if it was present from the start.
    pub at_s: Option<f64>,
    /// Measure of the fault, in the unit of the catalogue.
    pub magnitude: Option<f64>,
    /// What the drive was doing.
    pub during: Cow<'static, str>,
    /// What became of it.
    pub finding: Finding,
    /// Code of the fault, or of the limit.
    pub code: Option<u16>,
    /// What restarted the controller, if something did and it was reported.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restart: Option<Cow<'static, str>>,
    /// From the first effect of the fault to its report, ms. Of a fault of a bridge: from when
    /// the duty was off by more than the readback's band.
    pub latency_ms: Option<f64>,
    /// From the report to rest with both bridges off, ms.
    pub rest_ms: Option<f64>,
    /// How the run ended.
    pub end: Cow<'static, str>,
    pub peak_preload_n: f64,
    /// Distance moved uncommanded, mm.
    pub motion_mm: f64,
    /// Largest gap over the reference gap.
    #[serde(deserialize_with = "or_nan")]
    pub gap_part: f64,
    /// Which bounds of the mechanism were exceeded; empty if it was safe.
    pub harms: Vec<String>,
}

/// A run with its fault, beside its twin.
pub struct Trial<'a> {
    scenario: &'a Scenario,
    twin: &'a Twin,
    pub judge: Judge,
    during: &'static str,
    times: FaultTimes,
    /// Largest gap over the reference gap.
    gap_part: f64,
    /// Every step was crossed in both directions.
    pub crossed: bool,
}

impl<'a> Trial<'a> {
    /// Runs a rig until its run has been over for `after_s`. After each tick, `is_over` gets its
    /// time, s, its command and whether the operator is done, and decides whether the run is over.
    pub fn run<R: RunningRig>(
        rig: &mut R,
        scenario: &'a Scenario,
        twin: &'a Twin,
        after_s: f64,
        mut is_over: impl FnMut(&R, f64, Option<Command>, bool) -> bool,
    ) -> Result<Self, R::Error> {
        let injection = scenario.run.faults.first();
        let resets = injection.is_some_and(|fault| fault.target == Target::Reset);
        let mut judge = Judge::new(scenario, rig.plant().truth());
        let (mut during, mut over_s, mut worst_mm) = (None, 0.0, 0.0f64);
        let (mut t_s, mut before, mut last) = (rig.time_s(), rig.mode(), None);
        let longest_s = longest_s(&scenario.rig);
        drive(rig, longest_s, out_and_back(resets), |rig, command, output| {
            let struck = rig.fault_times().struck_s.is_some();
            if struck {
                during.get_or_insert(doing(before));
            }
            let (truth, mode) = (rig.plant().truth(), rig.mode());
            judge.look(t_s, output, truth, struck || injection.is_none());
            if mode.moves() {
                worst_mm = worst_mm.max(truth.separation_mm);
            }
            last = command.or(last);
            let out = mode == Mode::Complete(Direction::Deploy) && last != Some(Command::Retract);
            // A controller that starts again is not at rest yet.
            let starts = matches!(mode, Mode::Boot | Mode::SelfTest | Mode::Zero);
            let rests = last.is_some() && mode.is_at_rest() && !starts && !out;
            let over = is_over(rig, t_s, command, rests);
            over_s = if over { over_s + 1e-3 } else { 0.0 };
            (t_s, before) = (rig.time_s(), mode);
            over && over_s >= after_s
        })?;
        let crossings = rig.plant().ledger().crossings();
        let steps = rig.plant().parameters().wall.steps().len();
        let [out, back] = twin.gap_ref_mm;
        let parts = crossings.iter().map(|c| c.gap_mm / if c.climbing { out } else { back });
        Ok(Self {
            scenario,
            twin,
            judge,
            during: during.unwrap_or("at rest"),
            times: rig.fault_times(),
            gap_part: parts.fold(worst_mm / out, f64::max),
            crossed: crossings.len() == 2 * steps,
        })
    }

    /// What became of the fault by the judge.
    pub fn finding(&self) -> Finding {
        self.judge.finding(&self.twin.limits, self.gap_part, self.crossed)
    }

    /// Which bounds of the mechanism were exceeded, in words.
    pub fn harms(&self) -> Vec<String> {
        self.judge.harms(self.gap_part)
    }

    /// The report that counts: when, s, and its code.
    pub fn report(&self) -> Option<(f64, u16)> {
        self.judge.report(&self.twin.limits)
    }

    /// What became of the fault, which was reported at this time, s.
    pub fn found(&self, reported_s: Option<f64>) -> Instant {
        let (scenario, judge, times) = (self.scenario, &self.judge, self.times);
        let since = |from_s: Option<f64>| Some(1e3 * (reported_s? - from_s?).max(0.0));
        Instant {
            seed: scenario.run.seed,
            at_s: times.struck_s,
            magnitude: scenario.run.faults.first().map(Injection::magnitude),
            during: self.during.into(),
            finding: self.finding(),
            code: self.report().map(|(_, code)| code),
            restart: None,
            // A report before the first effect has no latency.
            latency_ms: since(times.shows_s).or(since(times.acts_s).map(|_| 0.0)),
            rest_ms: judge.fault.and_then(|(at_s, _)| Some(1e3 * (judge.rest_s? - at_s).max(0.0))),
            end: judge.end().into(),
            peak_preload_n: judge.peak_preload_n,
            motion_mm: judge.motion_mm,
            gap_part: self.gap_part,
            harms: self.harms(),
        }
    }
}

/// Which faults on which rigs.
#[derive(Clone, Debug)]
pub struct FaultCampaign {
    /// Rig, strategy, first seed.
    pub scenario: Scenario,
    /// Instants a fault.
    pub instants: usize,
    pub cases: Vec<Case>,
}

impl FaultCampaign {
    /// The campaign on a target, a rig a case: its run without a fault and, beside that, one with
    /// each. A run with a fault that cannot be made counts as undetected.
    pub fn on<'a, E: std::fmt::Display + Send + 'a>(
        &'a self,
        target: &'static str,
        twin: impl Fn(&Scenario) -> Result<Twin, E> + Sync + 'a,
        watched: impl Fn(&Scenario, &Twin) -> Result<Instant, E> + Sync + 'a,
    ) -> Campaign<'a, usize, Vec<Instant>, Outcome, E> {
        let run = move |instant: &usize, watch: Watch| {
            let mut rig = self.scenario.clone();
            rig.run.seed += 1 + *instant as u64;
            let twin = twin(&rig)?;
            (watch.done)();
            let one = |case: &Case| {
                if (watch.stop)() {
                    return None;
                }
                let scenario = case.scenario(&rig, &twin, *instant);
                let found = watched(&scenario, &twin);
                (watch.done)();
                Some(found.unwrap_or_else(|error| Instant {
                    seed: scenario.run.seed,
                    during: "at rest".into(),
                    end: "plant failed".into(),
                    harms: vec![error.to_string()],
                    ..Instant::default()
                }))
            };
            Ok(self.cases.par_iter().map(one).collect())
        };
        let fold = move |lines: Vec<(usize, Vec<Instant>)>| {
            let row = |(at, case): (usize, &Case)| {
                MatrixRow::of(case, &lines.iter().map(|(_, line)| &line[at]).collect::<Vec<_>>())
            };
            Outcome::of(target, self.cases.iter().enumerate().map(row).collect(), lines.len())
        };
        let steps = ("runs", 1 + self.cases.len());
        let cases = (0..self.instants).collect();
        Campaign { steps, cases, run: Box::new(run), fold: Box::new(fold) }
    }
}

/// A name for what the drive is doing.
fn doing(mode: Mode) -> &'static str {
    match mode {
        Mode::Preload(_) => "preload",
        Mode::Run(_, Leg::Cruise) => "cruise",
        Mode::Run(_, Leg::Approach) => "approach",
        Mode::Run(_, Leg::Crossing) => "crossing",
        Mode::Run(_, Leg::Settle) => "settle",
        Mode::Stopping(_) => "stopping",
        _ => "at rest",
    }
}

/// Runs a scenario in software without a fault.
pub fn twin(scenario: &Scenario) -> Result<Twin, RunError> {
    Twin::run(Session::new(scenario, Options::default())?, scenario, 0.0)
}

/// Runs a scenario in software with its fault, beside its twin.
pub fn watched(scenario: &Scenario, twin: &Twin) -> Result<Instant, RunError> {
    let mut session = Session::new(scenario, Options::default())?;
    let trial = Trial::run(&mut session, scenario, twin, AFTER_S, |_, _, _, over| over)?;
    let fault = scenario.run.faults.first();
    let restarts = fault.map_or(&[][..], |fault| restarts(fault.target, fault.kind));
    let restart = restarts.first().map(|restart| (*restart).into());
    Ok(Instant { restart, ..trial.found(trial.report().map(|(at_s, _)| at_s)) })
}
