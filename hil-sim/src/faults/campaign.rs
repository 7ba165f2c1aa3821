//! Every fault at random instants of random rigs, each beside the same run without it.

mod case;
mod matrix;
mod twin;

use std::borrow::Cow;

use interstage::rig::Rig;
use interstage::supervise::{Command, Leg, Mode};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::judge::{Finding, Judge};
use crate::campaign::{Campaign, Watch};
use crate::injector::FaultTimes;
use crate::scenario::Scenario;
use crate::scenario::injection::{Injection, Kind, Target};
use crate::session::{self, Options, RunError, RunningRig, Session};

pub use case::Case;
pub use matrix::{MatrixRow, MedianAndWorst, Outcome};
pub use twin::{Operator, Twin};

/// How long a run is watched after its end, s.
pub const AFTER_S: f64 = 1.0;

/// Longest run out and back, s: half of what one direction alone may take at the least useful
/// speed, and three times the travel at cruise speed.
pub(crate) fn longest_s(rig: &Rig) -> f64 {
    let cruise_s = rig.rig.travel_mm / rig.drive.cruise_speed_mm_s;
    (0.5 * session::longest_s(rig)).max(3.0 * cruise_s)
}

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
        let mut judge = Judge::new(scenario, rig.plant().truth());
        let mut operator = Operator::default();
        let (mut during, mut over_s, mut worst_mm) = (None, 0.0, 0.0f64);
        let longest_s = longest_s(&scenario.rig);
        while rig.time_s() < longest_s {
            let (t_s, before) = (rig.time_s(), rig.mode());
            let command = if rig.is_free() { operator.command(before) } else { None };
            let output = rig.step(command)?;
            let struck = rig.fault_times().struck_s.is_some();
            if struck && during.is_none() {
                during = Some(doing(before));
                if injection.is_some_and(|fault| fault.target == Target::Reset) {
                    operator.press_again();
                }
            }
            let truth = rig.plant().truth();
            judge.look(t_s, &output, truth, struck || injection.is_none());
            if rig.mode().moves() {
                worst_mm = worst_mm.max(truth.separation_mm);
            }
            let over = is_over(rig, t_s, command, operator.over(rig.mode()));
            over_s = if over { over_s + 1e-3 } else { 0.0 };
            if over && over_s >= after_s {
                break;
            }
        }
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

/// Each rig and its run without a fault.
pub(crate) type Rigs = Vec<(Scenario, Twin)>;

impl FaultCampaign {
    /// Runs each rig without a fault.
    pub fn rigs<E: Send>(
        &self,
        twin: impl Fn(&Scenario) -> Result<Twin, E> + Sync,
        done: &(dyn Fn() + Sync),
    ) -> Result<Rigs, E> {
        let rig = |instant: usize| {
            let mut scenario = self.scenario.clone();
            scenario.run.seed += 1 + instant as u64;
            let twin = twin(&scenario)?;
            done();
            Ok((scenario, twin))
        };
        (0..self.instants).into_par_iter().map(rig).collect()
    }

    /// The campaign of every fault on each of these rigs on a target. A run that cannot be made
    /// counts as undetected.
    pub fn on<'a, E: std::fmt::Display>(
        &'a self,
        target: &'static str,
        rigs: &'a Rigs,
        watched: impl Fn(&Scenario, &Twin) -> Result<Instant, E> + Sync + 'a,
    ) -> Campaign<'a, Case, MatrixRow, Outcome, E> {
        let row = move |case: &Case, watch: Watch| {
            let one = |(instant, (rig, twin)): (usize, &(Scenario, Twin))| {
                let scenario = case.scenario(rig, twin, instant);
                let found = watched(&scenario, twin);
                (watch.done)();
                found.unwrap_or_else(|error| Instant {
                    seed: scenario.run.seed,
                    during: "at rest".into(),
                    end: "plant failed".into(),
                    harms: vec![error.to_string()],
                    ..Instant::default()
                })
            };
            let instants: Vec<Instant> = rigs.par_iter().enumerate().map(one).collect();
            Ok(Some(MatrixRow::of(case, &instants)))
        };
        let fold = move |lines: Vec<(Case, MatrixRow)>| {
            let rows = lines.into_iter().map(|(_, row)| row).collect();
            Outcome::of(target, rows, self.instants)
        };
        let steps = ("runs", self.instants);
        Campaign { steps, cases: self.cases.clone(), run: Box::new(row), fold: Box::new(fold) }
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
    let reset = scenario.run.faults.first().filter(|fault| fault.target == Target::Reset);
    Ok(Instant {
        restart: reset.map(|fault| match fault.kind {
            Kind::Recorded => "reset by pin".into(),
            _ => "reset by supply".into(),
        }),
        ..trial.found(trial.report().map(|(at_s, _)| at_s))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_time_for_both_directions_at_any_cruise_speed() {
        let mut rig = Rig::prototype();
        assert_eq!(longest_s(&rig), 60.0);
        for (travel_mm, cruise_mm_s) in [(1000.0, 5.0), (160.0, 2.0), (80.0, 0.5)] {
            (rig.rig.travel_mm, rig.drive.cruise_speed_mm_s) = (travel_mm, cruise_mm_s);
            let both_s = 2.0 * travel_mm / cruise_mm_s;
            assert!(longest_s(&rig) > 1.2 * both_s && session::longest_s(&rig) > 0.7 * both_s);
        }
    }
}
