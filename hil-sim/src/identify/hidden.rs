//! Logs of rigs whose parameters are hidden: what identification is judged by.
//!
//! A rig is drawn far beyond its tolerances where the parameter is to be found, within
//! them where it is only known to a tolerance; three deployments are made on it by the
//! shipping controller, which believes in the nominal rig, and their sensor readings
//! alone are handed on.

use interstage::sense::raw::{AngleFrame, Sample, SensorFrame};
use interstage::supervise::{Command, Mode};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::IdentifyError;
use super::record::{Reader, Record};
use crate::plant::draw::PlantParameters;
use crate::plant::sensors::{Codes, Sensors};
use crate::scenario::{ControllerKind, Scenario};
use crate::session::{Options, RunError, Session, drives, read};

/// Longest log, ticks.
const LONGEST: usize = 20_000;
/// Zeros of load cell and displacement sensor, half-widths, N and mm.
const ZEROS: (f64, f64) = (0.3, 0.02);

/// The three deployments that together excite every parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Experiment {
    /// As scheduled: fast on the smooth wall, high preload and speed at the steps.
    Scheduled,
    /// A constant preload of three quarters of cruise: slow, near the limit of friction.
    Light,
    /// A constant preload a quarter above cruise.
    Heavy,
}

impl Experiment {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Scheduled, Self::Light, Self::Heavy];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scheduled => "scheduled",
            Self::Light => "light",
            Self::Heavy => "heavy",
        }
    }

    /// The scenario that makes it of a rig.
    #[must_use]
    pub fn of(self, scenario: &Scenario) -> Scenario {
        let mut scenario = scenario.clone();
        let cruise = scenario.rig.preload.cruise_n;
        let (controller, part) = match self {
            Self::Scheduled => (ControllerKind::Scheduled, 1.0),
            Self::Light => (ControllerKind::Constant, 0.75),
            Self::Heavy => (ControllerKind::Constant, 1.25),
        };
        scenario.run.controller = controller;
        scenario.rig.preload.cruise_n = part * cruise;
        scenario
    }
}

/// A rig with its hidden parameters, and the logs made on it.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// The parameters.
    pub truth: PlantParameters,
    /// Zeros of load cell, N, and displacement sensor, mm.
    pub zeros: (f64, f64),
    /// The logs.
    pub records: Vec<Record>,
}

impl Hidden {
    /// The hidden values by the names under which they are identified.
    #[must_use]
    pub fn parameters(&self) -> Vec<(String, f64)> {
        let p = &self.truth;
        let told = &self.records[0].scenario.rig;
        let mut list: Vec<(String, f64)> = [
            ("tread.k_inf_pa_per_m", 1e9 * p.ring.k_inf),
            ("tread.stiffening", p.ring.k_0 / p.ring.k_inf),
            ("tread.tau_s", p.ring.tau_s),
            ("plant.mu", p.mu),
            ("plant.top_load_n", p.load_n / told.plant.top_load_share),
            ("gearbox friction", p.drive.friction_n),
            ("plant.elastic_creep", p.elastic_creep),
            ("drive force over nominal", 1.0),
            ("rig.wheel_radius_mm", p.ring.radius_mm),
            ("load cell gain", p.sensors.load_cell_gain),
            ("displacement gain", p.sensors.tread_gain),
            (
                "sense.angle_zero_code",
                p.sensors.angle_zero_code
                    + 16_384.0 * p.sensors.angle_zero_rad / std::f64::consts::TAU,
            ),
            ("preload.delay_s", p.delay_s),
            ("preload.lag_s", p.lag_s),
            ("preload.slew_n_per_s", p.slew_n_per_s),
            ("preload.spring_n_per_mm", p.spring_n_per_mm),
            ("load cell zero", self.zeros.0),
            ("displacement zero", self.zeros.1),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .into();
        for (index, step) in p.wall.steps().iter().enumerate() {
            list.push((format!("rig.step_positions_mm[{}]", index + 1), step.position_mm));
            list.push((format!("rig.step_height_mm[{}]", index + 1), step.height_mm));
        }
        list
    }
}

/// How widely the hidden parameters are drawn about the nominal rig.
#[must_use]
pub fn widened(scenario: &Scenario) -> Scenario {
    let mut wide = scenario.clone();
    wide.spread.k_inf_rel = 0.15;
    wide.spread.stiffening_rel = 0.12;
    wide.spread.tau_rel = 0.15;
    wide.spread.mu_rel = 0.06;
    wide.spread.top_load_rel = 0.10;
    wide.spread.spring_rel = 0.10;
    wide.spread.delay_rel = 0.20;
    wide.spread.lag_rel = 0.20;
    wide.spread.slew_rel = 0.10;
    wide
}

/// Draws the rig of a seed and makes its logs.
///
/// # Errors
/// [`RunError`] if a run cannot be made.
pub fn hidden(scenario: &Scenario, seed: u64) -> Result<Hidden, HiddenError> {
    let mut wide = widened(scenario);
    wide.run.seed = seed;
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x1de7_71f1);
    let mut about = |half_width: f64| half_width * (2.0 * random.random::<f64>() - 1.0);
    let zeros = (about(ZEROS.0), about(ZEROS.1));
    let records = Experiment::ALL
        .iter()
        .map(|experiment| log(*experiment, &wide, zeros))
        .collect::<Result<_, _>>()?;
    Ok(Hidden { truth: PlantParameters::draw(&wide), zeros, records })
}

/// What can go wrong while logs are made.
#[derive(Debug, thiserror::Error)]
pub enum HiddenError {
    /// The run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The record.
    #[error(transparent)]
    Record(#[from] IdentifyError),
}

/// What the controller finds at a tick: every code new, the arm's every second tick.
fn frame(codes: &Codes, at: u32, arm: &mut Option<Sample<AngleFrame>>) -> SensorFrame {
    if at.is_multiple_of(2) {
        *arm = Some(Sample { code: codes.arm, at });
    }
    SensorFrame {
        wheel: Some(Sample { code: codes.wheel, at }),
        load_cell: Some(Sample { code: codes.load_cell, at }),
        tread: Some(Sample { code: codes.tread, at }),
        arm: *arm,
        bridges: Some(codes.bridges),
    }
}

fn log(experiment: Experiment, wide: &Scenario, zeros: (f64, f64)) -> Result<Record, HiddenError> {
    let scenario = experiment.of(wide);
    let mut session = Session::new(&scenario, Options::default())?;
    // Sensors of their own, or every log of a rig would have the same noise.
    let noise = wide.run.seed.wrapping_mul(31).wrapping_add(1 + experiment as u64);
    let mut sensors = Sensors::new(session.plant().parameters().sensors.clone(), noise);
    let mut arm = None;
    let mut reader = Reader::new(&scenario);
    let mut samples = Vec::new();
    let mut start = Some(Command::Start);
    while samples.len() < LONGEST {
        let over = matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_));
        if over {
            break;
        }
        let command = if session.mode() == Mode::Idle { start.take() } else { None };
        let frame = frame(&read(&mut sensors, session.plant()), samples.len() as u32, &mut arm);
        let output = session.advance(&frame, command)?;
        let mut sample = reader.sample(&frame, &drives(output.drive, output.preload));
        sample.preload_n += zeros.0;
        sample.compression_mm += zeros.1;
        samples.push((samples.len() as u32, sample));
    }
    // What the log says of itself is the nominal rig; the draw is hidden.
    let mut told = scenario;
    told.run.seed = 0;
    Ok(Record::new(experiment.name(), told, samples)?)
}
