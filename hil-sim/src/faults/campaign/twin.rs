//! The same run without the fault: when it moves and crosses, what it reports by itself, and
//! where the rig is in every tick.

use interstage::model::Planner;
use interstage::rig::RigError;
use interstage::supervise::{Leg, Mode};
use interstage::tick::{Event, Output};
use interstage::units::Direction;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::LONGEST_S;
use super::operator::Operator;
use crate::plant::rig::Truth;
use crate::scenario::Scenario;
use crate::session::{Options, RunError, Session};

/// Differences from the twin that count as a sign of the fault: preload, N; position, mm;
/// speed, mm/s. Ten deviations of the preload sensor, five counts of the encoder, and what the
/// speed observer swings by itself.
const SIGNS: (f64, f64, f64) = (0.5, 0.1, 2.0);

/// A run without fault.
pub struct Twin {
    /// From the command to the end, s since boot.
    pub started_s: f64,
    ended_s: f64,
    /// When the present crossing began, s.
    crossing_s: Option<f64>,
    /// Stretches of time in which it crosses a step, s.
    crossings: Vec<(f64, f64)>,
    /// Codes of the limits that it reports.
    pub limits: Vec<u16>,
    /// Reference gap of deployment and retraction, mm.
    pub gap_ref_mm: [f64; 2],
    /// Preload, position, speed by tick.
    states: Vec<[f32; 3]>,
}

impl Twin {
    /// Runs it.
    pub fn run(scenario: &Scenario) -> Result<Self, RunError> {
        let mut session = Session::new(scenario, Options::default())?;
        let mut operator = Operator::default();
        let mut twin = Self::new(scenario)?;
        while session.time_s() < LONGEST_S {
            let t_s = session.time_s();
            let command = operator.command(session.mode());
            if !operator.started() {
                twin.started_s = t_s;
            }
            let output = session.step(command)?;
            twin.note(t_s, session.mode(), &output, session.plant().truth(), false);
            if operator.over(session.mode()) && command.is_none() {
                break;
            }
        }
        Ok(twin)
    }

    /// Before the first tick.
    pub fn new(scenario: &Scenario) -> Result<Self, RigError> {
        let planner = Planner::try_build(&scenario.rig)?;
        Ok(Self {
            started_s: 0.0,
            ended_s: 0.0,
            crossing_s: None,
            crossings: Vec::new(),
            limits: Vec::new(),
            gap_ref_mm: Direction::ALL.map(|way| planner.gap_ref(way).to_num()),
            states: Vec::new(),
        })
    }

    /// A tick, after which the drive is in this mode; `over` says that it counts no more.
    pub fn note(&mut self, t_s: f64, mode: Mode, output: &Output, truth: &Truth, over: bool) {
        self.states.push(state(truth));
        for entry in &output.events {
            if let Event::Limit(limit) = entry.event {
                self.limits.push(limit.code());
            }
        }
        match (mode, self.crossing_s) {
            (Mode::Run(_, Leg::Crossing), None) => self.crossing_s = Some(t_s),
            (Mode::Run(_, Leg::Crossing), Some(_)) | (_, None) => {}
            (_, Some(from_s)) => {
                self.crossings.push((from_s, t_s));
                self.crossing_s = None;
            }
        }
        if !over {
            self.ended_s = t_s;
        }
    }

    /// A random instant: of every three, one in a crossing and two anywhere in the run.
    pub fn instant(&self, number: usize, random: &mut ChaCha8Rng) -> f64 {
        let (from_s, to_s) = if number % 3 == 2 && !self.crossings.is_empty() {
            self.crossings[random.random_range(0..self.crossings.len())]
        } else {
            (self.started_s, self.ended_s)
        };
        let at_s = random.random_range(from_s..to_s.max(from_s + 1e-3));
        // On a tick.
        (at_s * 1e3).round() * 1e-3
    }

    /// Whether the state of the rig differs in this tick.
    pub fn differs(&self, tick: usize, truth: &Truth) -> bool {
        let Some(then) = self.states.get(tick).or(self.states.last()) else { return false };
        let now = state(truth);
        let apart = |i: usize| f64::from(now[i] - then[i]).abs();
        apart(0) > SIGNS.0 || apart(1) > SIGNS.1 || apart(2) > SIGNS.2
    }
}

fn state(truth: &Truth) -> [f32; 3] {
    [truth.preload_n as f32, truth.position_mm as f32, truth.tread_mm_s as f32]
}
