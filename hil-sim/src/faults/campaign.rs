//! Every fault at random instants of random rigs, each beside the same run without it.

mod case;
mod matrix;
pub mod operator;
pub mod twin;

use interstage::supervise::{Leg, Mode};
use rayon::prelude::*;
use serde::Serialize;

use super::judge::{Finding, Judge};
use crate::plant::rig::VirtualRig;
use crate::scenario::Scenario;
use crate::scenario::injection::{Injection, Kind, Target};
use crate::session::{Options, RunError, Session};

pub use case::Case;
pub use matrix::{MatrixRow, MedianAndWorst, Outcome};
use operator::Operator;
use twin::Twin;

/// Longest run, s.
pub const LONGEST_S: f64 = 60.0;
/// How long a run is watched after its end, s.
pub const AFTER_S: f64 = 1.0;

/// What became of one fault at one instant.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Instant {
    /// Seed of the rig.
    pub seed: u64,
    /// When the fault came, s since boot; none if it was present from the start.
    pub at_s: Option<f64>,
    /// Measure of the fault, in the unit of the catalogue.
    pub magnitude: Option<f64>,
    /// What the drive was doing.
    pub during: &'static str,
    /// What became of it.
    pub finding: Finding,
    /// Code of the fault, or of the limit.
    pub code: Option<u16>,
    /// What restarted the controller, if something did and it was reported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restart: Option<&'static str>,
    /// From the first effect of the fault to its report, ms. Of a fault of a bridge: from when
    /// the duty was off by more than the readback's band.
    pub latency_ms: Option<f64>,
    /// From the report to rest with both bridges off, ms.
    pub rest_ms: Option<f64>,
    /// How the run ended.
    pub end: &'static str,
    /// Largest preload, N.
    pub peak_preload_n: f64,
    /// Distance moved uncommanded, mm.
    pub motion_mm: f64,
    /// Largest gap over the reference gap.
    pub gap_part: f64,
    /// Which bounds of the mechanism were exceeded; empty if it was safe.
    pub harms: Vec<String>,
}

/// A campaign.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Rig, strategy, first seed.
    pub scenario: Scenario,
    /// Instants a fault.
    pub instants: usize,
    /// Faults to try.
    pub cases: Vec<Case>,
}

impl Campaign {
    /// Number of its runs.
    #[must_use]
    pub fn runs(&self) -> u64 {
        (self.instants * (self.cases.len() + 1)) as u64
    }

    /// Runs it in software on all processors and calls `done` after each run. The outcome does
    /// not depend on the number of processors.
    ///
    /// # Errors
    /// [`RunError`] if a run without a fault cannot be made.
    pub fn run(&self, done: &(dyn Fn() + Sync)) -> Result<Outcome, RunError> {
        self.run_on("sil", Twin::run, watched, done)
    }

    /// Runs it on a target: each rig without a fault first, then every fault on each. A run
    /// that cannot be made counts as undetected.
    ///
    /// # Errors
    /// Those of `twin`.
    pub fn run_on<E: std::fmt::Display + Send>(
        &self,
        target: &'static str,
        twin: impl Fn(&Scenario) -> Result<Twin, E> + Sync,
        watched: impl Fn(&Scenario, &Twin) -> Result<Instant, E> + Sync,
        done: &(dyn Fn() + Sync),
    ) -> Result<Outcome, E> {
        let rig = |instant: usize| {
            let mut scenario = self.scenario.clone();
            scenario.run.seed += 1 + instant as u64;
            let twin = twin(&scenario)?;
            done();
            Ok((scenario, twin))
        };
        let rigs = (0..self.instants).into_par_iter().map(rig).collect::<Result<Vec<_>, E>>()?;
        let row = |case: &Case| {
            let one = |(instant, (rig, twin)): (usize, &(Scenario, Twin))| {
                let scenario = case.scenario(rig, twin, instant);
                let found = watched(&scenario, twin);
                done();
                found.unwrap_or_else(|error| Instant {
                    seed: scenario.run.seed,
                    during: "at rest",
                    end: "plant failed",
                    harms: vec![error.to_string()],
                    ..Instant::default()
                })
            };
            let instants: Vec<Instant> = rigs.par_iter().enumerate().map(one).collect();
            MatrixRow::of(case, &instants)
        };
        Ok(Outcome::of(target, self.cases.iter().map(row).collect(), self.instants))
    }
}

/// A name for what the drive is doing.
#[must_use]
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
#[must_use]
pub fn crossed(plant: &VirtualRig, twin: &Twin, worst_mm: f64) -> (f64, bool) {
    let crossings = plant.ledger().crossings();
    let steps = plant.parameters().wall.steps().len();
    let [out, back] = twin.gap_ref_mm;
    let parts = crossings.iter().map(|c| c.gap_mm / if c.climbing { out } else { back });
    (parts.fold(worst_mm / out, f64::max), crossings.len() == 2 * steps)
}

/// Runs a scenario with its fault beside its twin.
fn watched(scenario: &Scenario, twin: &Twin) -> Result<Instant, RunError> {
    let mut session = Session::new(scenario, Options::default())?;
    let mut judge = Judge::new(scenario, session.plant().truth());
    let mut operator = Operator::default();
    let injection = scenario.run.faults.first();
    let reset = injection.filter(|fault| fault.target == Target::Reset).map(|fault| fault.kind);
    let (mut during, mut after_s, mut worst_mm) = ("at rest", 0.0, 0.0f64);
    while session.time_s() < LONGEST_S && after_s < AFTER_S {
        let t_s = session.time_s();
        let before = session.mode();
        let command = operator.command(before);
        let output = session.step(command)?;
        let active = injection.is_none() || session.struck_s().is_some();
        if session.struck_s() == Some(t_s) {
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
    let at_s = session.struck_s();
    let since = |from_s: Option<f64>| {
        let ((to_s, _), from_s) = (report?, from_s?);
        Some(1e3 * (to_s - from_s).max(0.0))
    };
    Ok(Instant {
        seed: scenario.run.seed,
        at_s,
        magnitude: injection.map(Injection::magnitude),
        during,
        finding,
        code: report.map(|(_, code)| code),
        restart: reset.map(|kind| match kind {
            Kind::Recorded => "reset by pin",
            _ => "reset by supply",
        }),
        // A report before the first effect has no latency.
        latency_ms: since(session.tells_s()).or(since(session.acts_s()).map(|_| 0.0)),
        rest_ms: judge.fault.and_then(|(at_s, _)| Some(1e3 * (judge.rest_s? - at_s).max(0.0))),
        end: judge.end(),
        peak_preload_n: judge.peak_preload_n,
        motion_mm: judge.motion_mm,
        gap_part,
        harms: judge.harms(),
    })
}
