//! Every fault at random instants of random rigs, each beside the same run without it.

mod case;
mod matrix;
mod twin;

use std::borrow::Cow;

use interstage::rig::Rig;
use interstage::supervise::{Leg, Mode};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::judge::{Finding, Judge};
use crate::campaign::{Campaign, Watch};
use crate::plant::rig::VirtualRig;
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
pub fn longest_s(rig: &Rig) -> f64 {
    let cruise_s = rig.rig.travel_mm / rig.drive.cruise_speed_mm_s;
    (0.5 * session::longest_s(rig)).max(3.0 * cruise_s)
}

/// What became of one fault at one instant.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Instant {
    /// Seed of the rig.
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
    /// Largest preload, N.
    pub peak_preload_n: f64,
    /// Distance moved uncommanded, mm.
    pub motion_mm: f64,
    /// Largest gap over the reference gap.
    pub gap_part: f64,
    /// Which bounds of the mechanism were exceeded; empty if it was safe.
    pub harms: Vec<String>,
}

impl Instant {
    /// What the judge has seen of a run of this scenario whose largest gap was `gap_part` of the
    /// reference.
    pub fn judged(scenario: &Scenario, judge: &Judge, twin: &Twin, gap_part: f64) -> Self {
        Self {
            seed: scenario.run.seed,
            magnitude: scenario.run.faults.first().map(Injection::magnitude),
            during: "at rest".into(),
            code: judge.report(&twin.limits).map(|(_, code)| code),
            rest_ms: judge.fault.and_then(|(at_s, _)| Some(1e3 * (judge.rest_s? - at_s).max(0.0))),
            end: judge.end().into(),
            peak_preload_n: judge.peak_preload_n,
            motion_mm: judge.motion_mm,
            gap_part,
            harms: judge.harms(),
            ..Self::default()
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
    /// Faults to try.
    pub cases: Vec<Case>,
}

/// Each rig and its run without a fault.
pub type Rigs = Vec<(Scenario, Twin)>;

impl FaultCampaign {
    /// Runs each rig without a fault.
    ///
    /// # Errors
    /// Those of `twin`.
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
pub fn doing(mode: Mode) -> &'static str {
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

/// Largest gap over the reference gap, of crossings and elsewhere (`worst_mm`), and whether
/// every step was crossed in both directions.
pub fn crossed(plant: &VirtualRig, twin: &Twin, worst_mm: f64) -> (f64, bool) {
    let crossings = plant.ledger().crossings();
    let steps = plant.parameters().wall.steps().len();
    let [out, back] = twin.gap_ref_mm;
    let parts = crossings.iter().map(|c| c.gap_mm / if c.climbing { out } else { back });
    (parts.fold(worst_mm / out, f64::max), crossings.len() == 2 * steps)
}

/// Runs a scenario in software without a fault.
///
/// # Errors
/// [`RunError`] if it cannot be made.
pub fn twin(scenario: &Scenario) -> Result<Twin, RunError> {
    Twin::run(Session::new(scenario, Options::default())?, scenario, 0.0)
}

/// Runs a scenario in software with its fault, beside its twin.
///
/// # Errors
/// [`RunError`] if it cannot be made.
pub fn watched(scenario: &Scenario, twin: &Twin) -> Result<Instant, RunError> {
    let mut session = Session::new(scenario, Options::default())?;
    let mut judge = Judge::new(scenario, session.plant().truth());
    let mut operator = Operator::default();
    let injection = scenario.run.faults.first();
    let reset = injection.filter(|fault| fault.target == Target::Reset).map(|fault| fault.kind);
    let (mut during, mut after_s, mut worst_mm) = ("at rest", 0.0, 0.0f64);
    let longest_s = longest_s(&scenario.rig);
    while session.time_s() < longest_s && after_s < AFTER_S {
        let t_s = session.time_s();
        let before = session.mode();
        let command = operator.command(before);
        let output = session.step(command)?;
        let struck_s = session.fault_times().struck_s;
        let active = injection.is_none() || struck_s.is_some();
        if struck_s == Some(t_s) {
            during = doing(before);
            if reset.is_some() {
                operator.press_again();
            }
        }
        let truth = session.plant().truth();
        judge.look(t_s, &output, truth, active);
        if session.mode().moves() {
            worst_mm = worst_mm.max(truth.separation_mm);
        }
        after_s = if operator.over(session.mode()) { after_s + 1e-3 } else { 0.0 };
    }
    let (gap_part, crossed) = crossed(session.plant(), twin, worst_mm);
    let finding = judge.finding(&twin.limits, gap_part, crossed);
    let report = judge.report(&twin.limits);
    let times = session.fault_times();
    let since = |from_s: Option<f64>| {
        let ((to_s, _), from_s) = (report?, from_s?);
        Some(1e3 * (to_s - from_s).max(0.0))
    };
    Ok(Instant {
        at_s: times.struck_s,
        during: during.into(),
        finding,
        restart: reset.map(|kind| match kind {
            Kind::Recorded => "reset by pin".into(),
            _ => "reset by supply".into(),
        }),
        // A report before the first effect has no latency.
        latency_ms: since(times.shows_s).or(since(times.acts_s).map(|_| 0.0)),
        ..Instant::judged(scenario, &judge, twin, gap_part)
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
