//! The study's experiment on the virtual rig: forty rigs within their tolerances, each
//! deployed once a case with the shipping controller and noisy sensors, and four means
//! of ten.
//!
//! Gap, embedding depth and contact area are what the sensors say; forces and arm
//! vibration, for which the rig has no sensor, are what the plant did.

use anyhow::Result;
use interstage::tick::Event;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::case::{Arms, Case};
use super::history::{History, Instant};
use super::measure::{area_of_depth_mm2, collision_n, impact_kpa, resistance};
use super::published::{LOG_S, RUNS, RUNS_OF_A_MEAN};
use crate::figure::Series;
use crate::reference::beam::BeamError;
use crate::reference::vibration::Modal;
use hil_sim::campaign::Campaign;
use hil_sim::plant::rig::VirtualRig;
use hil_sim::report::axis::extent;
use hil_sim::scenario::Scenario;
use hil_sim::session::{Options, RunningRig, Session, drive, is_over, longest_s, once};

/// Crossings of a deployment.
pub(super) const STAGES: usize = 3;

/// A tick of the session, s.
const TICK_S: f64 = 1e-3;

/// Seed of the choice of runs for the means.
const CHOICE: u64 = 40;

/// One crossing as the rig saw it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Reading {
    /// Gap measured by the controller, mm.
    pub gap_mm: f64,
    pub true_gap_mm: f64,
    /// Tread compression that its sensor shows when the lower wall stops carrying, mm.
    pub depth_mm: f64,
    /// Contact area that geometry makes of that compression, mm^2.
    pub area_mm2: f64,
    /// Largest less least true preload in the crossing, N.
    pub preload_swing_n: f64,
}

/// One deployment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Readings of the three crossings; none of one that was not completed.
    pub(super) crossings: Vec<Reading>,
    /// The log: what is true at its times.
    pub(super) log: History,
    /// Largest separation of wheel and wall away from the steps, at the times of the log, mm.
    pub separation_mm: f64,
    /// Contact stages that the controller went through, 1 to 6.
    pub stages: [bool; 6],
    pub slip_mm: f64,
}

impl Run {
    /// Mean over the crossings of a figure; none if none was completed.
    pub(super) fn mean(&self, figure: impl Fn(&Reading) -> f64) -> Option<f64> {
        let count = self.crossings.len();
        (count > 0).then(|| self.crossings.iter().map(figure).sum::<f64>() / count as f64)
    }
}

/// Forty runs of a case.
#[derive(Clone, Debug)]
pub struct Experiment {
    pub case: Case,
    /// Its runs, by seed from 1.
    pub runs: Vec<Run>,
}

/// The runs of each of four means, drawn once for all cases.
pub(super) fn groups() -> Vec<Vec<usize>> {
    let mut all: Vec<usize> = (0..RUNS).collect();
    all.shuffle(&mut ChaCha8Rng::seed_from_u64(CHOICE));
    all.chunks(RUNS_OF_A_MEAN).map(<[usize]>::to_vec).collect()
}

/// Adds the four means of `all`, by run, and their range to the marks at `x`.
pub(super) fn marks(x: f64, all: &[f64], series: &mut Series) {
    for group in groups() {
        let of: Vec<f64> = group.iter().filter_map(|&run| all.get(run).copied()).collect();
        series.points.push((x, of.iter().sum::<f64>() / of.len() as f64));
    }
    series.range.extend(extent(all.iter().copied()).map(|(low, high)| (x, low, high)));
}

/// Every case on forty rigs.
pub fn campaign(
    cases: &[Case],
) -> Campaign<'static, (Case, u64), Run, Vec<Experiment>, anyhow::Error> {
    let seeds = |case: &Case| (1..=RUNS as u64).map(|seed| (*case, seed)).collect::<Vec<_>>();
    let experiment = |all: &[((Case, u64), Run)]| Experiment {
        case: all[0].0.0,
        runs: all.iter().map(|(_, run)| run.clone()).collect(),
    };
    Campaign {
        steps: ("deployments", 1),
        cases: cases.iter().flat_map(seeds).collect(),
        run: Box::new(|(case, seed), watch| {
            let run = run_as(case, &case.scenario(*seed))?;
            (watch.done)();
            Ok(Some(run))
        }),
        fold: Box::new(move |runs| runs.chunks(RUNS).map(experiment).collect()),
    }
}

/// One deployment of a case by the rig of this scenario.
pub(super) fn run_as(case: &Case, scenario: &Scenario) -> Result<Run> {
    let options = Options { speed: Some((case.speed_mm_s, true)), ..Options::default() };
    let mut session = Session::new(scenario, options)?;
    let mut watch = Watch::new(case, session.plant())?;
    let operator = once(scenario.run.direction);
    drive(&mut session, longest_s(&scenario.rig), operator, |session, _, output| {
        let telemetry = &output.telemetry;
        watch.run.stages[(telemetry.stage as usize).clamp(1, 6) - 1] = true;
        for entry in &output.events {
            if let Event::Crossing(record) = entry.event {
                watch.measured.push((usize::from(record.index), record.gap_measured.to_num()));
            }
        }
        watch.look(telemetry.mode.moves(), telemetry.compression.to_num(), session.plant());
        is_over(session.mode())
    })?;
    Ok(watch.finish(case, session.plant()))
}

/// What is kept of a run while it goes on.
struct Watch {
    run: Run,
    /// Step and gap as the controller reports them.
    measured: Vec<(usize, f64)>,
    /// Measured compression and true preload of every tick.
    ticks: Vec<(f32, f32)>,
    /// Rolling resistance over radial force on the continuous wall.
    resistance: f64,
    arms: Arms,
    arm: Modal,
    moving_since: Option<f64>,
}

impl Watch {
    fn new(case: &Case, plant: &VirtualRig) -> Result<Self, BeamError> {
        let arms = Arms::of(case)?;
        Ok(Self {
            run: Run::default(),
            measured: Vec::new(),
            ticks: Vec::new(),
            resistance: resistance(plant, case.speed_mm_s, case.pressing_n(1)),
            arm: arms.modal()?,
            arms,
            moving_since: None,
        })
    }

    /// Looks at one millisecond.
    fn look(&mut self, moves: bool, compression_mm: f64, plant: &VirtualRig) {
        let truth = plant.truth();
        self.ticks.push((compression_mm as f32, truth.preload_n as f32));
        let axial = collision_n(plant, self.resistance);
        let level = plant.parameters().wall.local(truth.position_mm).level;
        self.arm.step(self.arms.across_n(level, axial), TICK_S);
        if moves {
            self.moving_since.get_or_insert(truth.time_s);
        }
        let now = Instant {
            time_s: truth.time_s - self.moving_since.unwrap_or(f64::INFINITY),
            position_mm: truth.position_mm,
            collision_n: axial,
            impact_kpa: impact_kpa(plant, axial),
            // The plant's own vibration is that of the torque ripple.
            arm_um: 1e6 * self.arm.deflection_m() + 1e3 * truth.vibration_mm,
            clearance_mm: truth.root_clearance_mm,
        };
        if self.run.log.push(&now, LOG_S) {
            self.run.separation_mm = self.run.separation_mm.max(truth.separation_mm);
        }
    }

    fn finish(mut self, case: &Case, plant: &VirtualRig) -> Run {
        self.run.slip_mm = plant.truth().slip_mm;
        for crossing in plant.ledger().crossings() {
            let tick = (crossing.lift_s / TICK_S) as usize;
            let gap = self.measured.iter().find(|(index, _)| *index == crossing.index);
            let (Some(&(_, gap_mm)), Some(&(depth, _))) = (gap, self.ticks.get(tick)) else {
                continue;
            };
            let since = ((crossing.touch_s / TICK_S) as usize).min(tick);
            let preloads = self.ticks[since..=tick].iter().map(|tick| f64::from(tick.1));
            // The experimenter knows the drawing, not the rig as built.
            let depth_mm = f64::from(depth);
            self.run.crossings.push(Reading {
                gap_mm,
                true_gap_mm: crossing.gap_mm,
                depth_mm,
                area_mm2: area_of_depth_mm2(case, depth_mm),
                preload_swing_n: extent(preloads).map_or(0.0, |(low, high)| high - low),
            });
        }
        self.run
    }
}
