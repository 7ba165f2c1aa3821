//! Every fault at random instants of random rigs, each beside the same run without it.

mod kept;
mod matrix;
pub mod operator;
pub mod twin;

use std::borrow::Cow;

use interstage::supervise::{Leg, Mode};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::judge::{Finding, Judge};
use super::{CATALOGUE, Entry, HARDWARE, Injection, Kind, Target, sets};
use crate::params::set_of;
use crate::plant::rig::VirtualRig;
use crate::scenario::{Scenario, StepAnomaly};
use crate::sil::{Options, RunError, Session};

pub use kept::{Kept, KeptError};
pub use matrix::{Line, Outcome, Spread};
use operator::Operator;
use twin::Twin;

/// Longest run, s.
const LONGEST_S: f64 = 60.0;
/// How long a run is watched after its end, s.
pub const AFTER_S: f64 = 1.0;
/// How long an interrupt asks without end, s: longer than the watchdog waits, and not for
/// ever, or the board would not come up again to tell.
const STORM_S: f64 = 0.25;
/// How long commands come at random, s.
const COMMANDS_S: f64 = 1.0;

/// A fault of the matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Case {
    /// One that comes under way.
    Struck(&'static Entry),
    /// A step that does not stand where or as the table says.
    Step(StepFault),
}

/// How a step may differ from the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepFault {
    /// 2 mm nearer to the stow end.
    Early,
    /// 2 mm farther out.
    Late,
    /// Not there.
    Missing,
    /// Followed by one that the table lacks, as close as the wheel can tell them apart.
    Doubled,
    /// A quarter higher.
    Higher,
}

/// All of them.
const STEP_FAULTS: [StepFault; 5] =
    [StepFault::Early, StepFault::Late, StepFault::Missing, StepFault::Doubled, StepFault::Higher];

impl Case {
    /// Every fault of the matrix.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let struck = CATALOGUE.iter().map(Self::Struck);
        struck.chain(STEP_FAULTS.into_iter().map(Self::Step)).collect()
    }

    /// Every fault of the matrix on the emulated board: those of software and of hardware. A
    /// model that does not answer is a task that hangs there.
    #[must_use]
    pub fn all_on_board() -> Vec<Self> {
        let software = CATALOGUE.iter().filter(|entry| entry.target != Target::Model);
        let struck = software.chain(HARDWARE).map(Self::Struck);
        struck.chain(STEP_FAULTS.into_iter().map(Self::Step)).collect()
    }

    /// Its name in the matrix.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Struck(entry) => format!("{} {}", entry.target.name(), entry.kind.name()),
            Self::Step(fault) => format!("step {fault:?}").to_lowercase(),
        }
    }

    /// Whether the name of the fault contains one of these, or there are none.
    #[must_use]
    pub fn is_one_of(&self, wanted: &[String]) -> bool {
        wanted.is_empty() || wanted.iter().any(|text| self.name().contains(text))
    }

    /// What happens, in words.
    #[must_use]
    pub fn text(&self) -> String {
        match self {
            Self::Struck(entry) if entry.unit.is_empty() => entry.text.to_owned(),
            Self::Struck(entry) => {
                format!("{}: {} {}", entry.text, entry.magnitude, entry.unit)
            }
            Self::Step(fault) => match fault {
                StepFault::Early => "2 mm nearer to the stow end than the table says",
                StepFault::Late => "2 mm farther out than the table says",
                StepFault::Missing => "not there",
                StepFault::Doubled => "another one 15 mm behind it",
                StepFault::Higher => "1 mm higher than the table says",
            }
            .to_owned(),
        }
    }

    /// The sign or direction of the measure by the number of the instant.
    fn magnitude(entry: &Entry, instant: usize) -> f64 {
        let other = instant % 4 >= 2;
        match entry.kind {
            Kind::Gain if other => 1.0 / entry.magnitude,
            Kind::Offset | Kind::Runaway if other => -entry.magnitude,
            // Along the word, one bit, which the parity tells, or two, which it does not.
            Kind::BitErrors => f64::from((1 + 2 * u16::from(other)) << (instant % 14)),
            Kind::Stuck if entry.target.is_hardware() && !entry.unit.is_empty() => {
                [entry.magnitude, 0.0, 12_000.0, 65_535.0][instant % 4]
            }
            _ => entry.magnitude,
        }
    }

    /// The measure of a fault of stored parameters: a random bit, every fourth time of the
    /// seal and length, or a random operation of the flash.
    fn measure(
        entry: &Entry,
        base: &Scenario,
        instant: usize,
        random: &mut ChaCha8Rng,
    ) -> Option<f64> {
        let stored = entry.target != Target::ImageSet;
        let set = set_of(if stored { sets::KEPT } else { "prototype" }, &base.rig).ok()?;
        let number = match entry.kind {
            Kind::BitErrors if stored && instant % 4 == 1 => {
                random.random_range(0..sets::seal_bits())
            }
            Kind::BitErrors => random.random_range(0..sets::bits(set.len(), stored)),
            _ => random.random_range(1..=sets::operations(set.len())),
        };
        Some(f64::from(number))
    }

    /// The scenario of an instant.
    fn scenario(&self, base: &Scenario, twin: &Twin, instant: usize) -> Scenario {
        let mut scenario = base.clone();
        let mut random = ChaCha8Rng::seed_from_u64(base.run.seed ^ 0x00fa_017e);
        match self {
            Self::Struck(entry) => {
                let mut at_s = twin.instant(instant, &mut random);
                let mut magnitude = Self::magnitude(entry, instant);
                if entry.target.is_of_sets() {
                    magnitude = Self::measure(entry, base, instant, &mut random).unwrap_or(1.0);
                    // One of three before the board starts.
                    at_s = if instant.is_multiple_of(3) { 0.0 } else { at_s };
                }
                if entry.target == Target::Image {
                    magnitude = random.random_range(entry.range.0..=entry.range.1).floor();
                }
                let mut fault = Injection::at(entry.target, entry.kind, at_s, magnitude);
                // Who presses buttons at random stops doing so some time.
                fault.duration_s = match entry.target {
                    Target::Commands => Some(COMMANDS_S),
                    Target::Interrupt => Some(STORM_S),
                    _ => None,
                };
                scenario.run.faults = vec![fault];
            }
            Self::Step(fault) => {
                let steps = &base.rig.rig.step_positions_mm;
                let step = random.random_range(0..steps.len().max(1));
                let number = step as u8 + 1;
                let anomaly = match fault {
                    StepFault::Early => StepAnomaly::Early { step: number, offset_mm: 2.0 },
                    StepFault::Late => StepAnomaly::Late { step: number, offset_mm: 2.0 },
                    StepFault::Missing => StepAnomaly::Missing { step: number },
                    StepFault::Higher => StepAnomaly::Higher { step: number, offset_mm: 1.0 },
                    StepFault::Doubled => {
                        // In the widest room behind or before a step.
                        let position_mm = steps.last().map_or(40.0, |last| last + 15.0);
                        StepAnomaly::Extra { position_mm }
                    }
                };
                scenario.run.anomalies = vec![anomaly];
            }
        }
        scenario
    }
}

/// What became of one fault at one instant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Instant {
    /// Seed of the rig.
    pub seed: u64,
    /// When the fault came, s since boot; none if it was there from the start.
    pub at_s: Option<f64>,
    /// Measure of the fault, in the unit of the catalogue.
    pub magnitude: Option<f64>,
    /// What the drive was doing.
    pub during: Cow<'static, str>,
    /// What became of it.
    pub finding: Finding,
    /// Code of the fault, or of the limit.
    pub code: Option<u16>,
    /// What restarted the board, if something did and it was reported.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restart: Option<Cow<'static, str>>,
    /// From when the fault first did something to its report, ms. Where it lies in a bridge:
    /// from when the duty was off by more than the readback's band.
    pub latency_ms: Option<f64>,
    /// The same from when the duty was off by two parts in a hundred, ms.
    pub latency_any_ms: Option<f64>,
    /// The same from when the plant first ran otherwise than without the fault, ms.
    pub after_sign_ms: Option<f64>,
    /// From the report to rest with both bridges off, ms.
    pub rest_ms: Option<f64>,
    /// How the run ended.
    pub end: Cow<'static, str>,
    /// Largest preload, N.
    pub peak_preload_n: f64,
    /// Way gone uncommanded, mm.
    pub motion_mm: f64,
    /// Largest gap over the reference gap.
    pub gap_part: f64,
    /// What the mechanism was not spared; empty if it was safe.
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
    /// Runs that it takes.
    #[must_use]
    pub fn runs(&self) -> u64 {
        (self.instants * (self.cases.len() + 1)) as u64
    }

    /// Makes all of them, on all processors, and calls `done` after each. The outcome does
    /// not depend on the number of processors.
    ///
    /// # Errors
    /// [`CampaignError`] if a run without a fault cannot be made.
    pub fn run(&self, done: &(dyn Fn() + Sync)) -> Result<Outcome, CampaignError<RunError>> {
        self.run_keeping(&mut Kept::default(), done)
    }

    /// The same, with what is done kept, and what is kept not done again.
    ///
    /// # Errors
    /// [`CampaignError`], also if what is done cannot be kept.
    pub fn run_keeping(
        &self,
        kept: &mut Kept,
        done: &(dyn Fn() + Sync),
    ) -> Result<Outcome, CampaignError<RunError>> {
        self.run_on("sil", Twin::run, watched, kept, done)
    }

    /// Makes all of them on a target: each rig without a fault first, then every fault on
    /// each. One that cannot be made counts as undetected.
    pub fn run_on<E: std::fmt::Display + Send>(
        &self,
        target: &'static str,
        twin: impl Fn(&Scenario) -> Result<Twin, E> + Sync,
        watched: impl Fn(&Scenario, &Twin) -> Result<Instant, E> + Sync,
        kept: &mut Kept,
        done: &(dyn Fn() + Sync),
    ) -> Result<Outcome, CampaignError<E>> {
        let scenarios: Vec<Scenario> = (0..self.instants).map(|i| self.base(i)).collect();
        let twin = |scenario: &Scenario| {
            let twin = twin(scenario);
            done();
            twin
        };
        let missing = self.cases.iter().any(|case| kept.line(&case.name()).is_none());
        let needed = if missing { &scenarios[..] } else { &[] };
        let twins: Vec<Twin> =
            needed.par_iter().map(twin).collect::<Result<_, _>>().map_err(CampaignError::Run)?;
        let mut lines = Vec::new();
        for case in &self.cases {
            if let Some(line) = kept.line(&case.name()) {
                lines.push(line.clone());
                (0..self.instants).for_each(|_| done());
                continue;
            }
            let one = |instant: usize| {
                let twin = &twins[instant];
                let scenario = case.scenario(&scenarios[instant], twin, instant);
                let found = watched(&scenario, twin);
                done();
                found.unwrap_or_else(|error| failed(&scenario, &error))
            };
            let instants: Vec<Instant> = (0..self.instants).into_par_iter().map(one).collect();
            let line = Line::of(case, &instants);
            kept.keep(&line)?;
            lines.push(line);
        }
        Ok(Outcome::of(target, lines, self.instants))
    }

    /// Rig of an instant.
    fn base(&self, instant: usize) -> Scenario {
        let mut scenario = self.scenario.clone();
        scenario.run.seed += 1 + instant as u64;
        scenario
    }
}

/// Why there is no outcome of a campaign; displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError<E> {
    /// A run without a fault cannot be made.
    #[error("{0}")]
    Run(E),
    /// What is done cannot be kept.
    #[error(transparent)]
    Kept(#[from] KeptError),
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

/// A run that could not be made.
fn failed(scenario: &Scenario, error: &impl std::fmt::Display) -> Instant {
    Instant {
        seed: scenario.run.seed,
        at_s: None,
        magnitude: None,
        during: "at rest".into(),
        finding: Finding::Undetected,
        code: None,
        restart: None,
        latency_ms: None,
        latency_any_ms: None,
        after_sign_ms: None,
        rest_ms: None,
        end: "plant failed".into(),
        peak_preload_n: 0.0,
        motion_mm: 0.0,
        gap_part: 0.0,
        harms: vec![error.to_string()],
    }
}

/// Largest gap over the reference gap, of crossings and elsewhere (`worst_mm`), and whether
/// every step was crossed both ways.
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
    let early = scenario.run.faults.is_empty();
    let (mut during, mut sign_s, mut tick, mut after_s) = ("at rest", None, 0, 0.0);
    let mut worst_mm = 0.0f64;
    while session.time_s() < LONGEST_S && after_s < AFTER_S {
        let t_s = session.time_s();
        let before = session.mode();
        let command = operator.command(before);
        let output = session.step(command)?;
        let struck = early || session.struck_s().is_some();
        if session.struck_s() == Some(t_s) {
            during = doing(before);
        }
        let truth = session.plant().truth();
        judge.look(t_s, &output, truth, struck);
        if session.mode().moves() {
            worst_mm = worst_mm.max(truth.separation_mm);
        }
        if struck && sign_s.is_none() && twin.differs(tick, truth) {
            sign_s = Some(t_s);
        }
        after_s = if operator.over(session.mode()) { after_s + 1e-3 } else { 0.0 };
        tick += 1;
    }
    let (gap_part, crossed) = crossed(session.plant(), twin, worst_mm);
    let finding = judge.finding(&twin.limits, gap_part, crossed);
    let report = judge.fault.or_else(|| judge.new_limit(&twin.limits));
    let at_s = session.struck_s();
    let since = |from_s: Option<f64>| {
        let ((to_s, _), from_s) = (report?, from_s?);
        Some(1e3 * (to_s - from_s).max(0.0))
    };
    let injection = scenario.run.faults.first();
    let moving = injection.is_some_and(|fault| fault.target.moves());
    Ok(Instant {
        seed: scenario.run.seed,
        at_s,
        magnitude: injection.map(Injection::magnitude),
        during: during.into(),
        finding,
        code: report.map(|(_, code)| code),
        restart: None,
        // Found before it had to be is found at once.
        latency_ms: since(session.tells_s()).or(since(session.acts_s()).map(|_| 0.0)),
        latency_any_ms: since(session.acts_s()),
        after_sign_ms: if moving { since(sign_s.or(report.map(|r| r.0))) } else { None },
        rest_ms: judge.fault.and_then(|(at_s, _)| Some(1e3 * (judge.rest_s? - at_s).max(0.0))),
        end: judge.end().into(),
        peak_preload_n: judge.peak_preload_n,
        motion_mm: judge.motion_mm,
        gap_part,
        harms: judge.harms(),
    })
}
