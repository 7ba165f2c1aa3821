//! The operator of a run, who deploys and, after arrival, retracts; and the same run without the
//! fault: when it moves and crosses, and what it reports.

use interstage::model::Planner;
use interstage::rig::RigError;
use interstage::supervise::{Command, Leg, Mode};
use interstage::units::Direction;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::Trial;
use crate::scenario::Scenario;
use crate::session::RunningRig;

/// A run without fault.
#[derive(Default)]
pub struct Twin {
    /// From the command to the end, s since boot.
    pub started_s: f64,
    ended_s: f64,
    /// Begin and end of its crossings, s.
    crossings: Vec<(f64, f64)>,
    /// Codes of the limits that it reports.
    pub limits: Vec<u16>,
    /// Reference gap of deployment and retraction, mm.
    pub gap_ref_mm: [f64; 2],
}

impl Twin {
    /// Runs it, and watches what comes within this time of its end, s.
    pub fn run<R>(mut rig: R, scenario: &Scenario, after_s: f64) -> Result<Self, R::Error>
    where
        R: RunningRig<Error: From<RigError>>,
    {
        let planner = Planner::try_build(&scenario.rig)?;
        let gap_ref_mm = Direction::ALL.map(|direction| planner.gap_ref(direction).to_num());
        let mut twin = Self { gap_ref_mm, ..Self::default() };
        let (alone, mut started, mut crossing_s) = (Self::default(), false, None);
        let trial = Trial::run(&mut rig, scenario, &alone, after_s, |rig, t_s, command, over| {
            started |= command.is_some();
            if !started {
                twin.started_s = t_s;
            }
            let over = over && command.is_none();
            if !over || after_s == 0.0 {
                twin.ended_s = t_s;
            }
            if let Mode::Run(_, Leg::Crossing) = rig.mode() {
                crossing_s.get_or_insert(t_s);
            } else if let Some(from_s) = crossing_s.take() {
                twin.crossings.push((from_s, t_s));
            }
            over
        })?;
        twin.limits = trial.judge.limits.iter().map(|(_, code)| *code).collect();
        Ok(twin)
    }

    /// A random instant: of every three, one in a crossing and two anywhere in the run.
    pub(crate) fn instant(&self, number: usize, random: &mut ChaCha8Rng) -> f64 {
        let (from_s, to_s) = if number % 3 == 2 && !self.crossings.is_empty() {
            self.crossings[random.random_range(0..self.crossings.len())]
        } else {
            (self.started_s, self.ended_s)
        };
        let at_s = random.random_range(from_s..to_s.max(from_s + 1e-3));
        // On a tick.
        (at_s * 1e3).round() * 1e-3
    }
}

/// Ticks that the drive rests at the far end.
const DWELL_TICKS: u32 = 100;

/// An operator who deploys and, after arrival, retracts. `again`: who gives the last command again
/// after a restart.
pub(super) fn out_and_back(again: bool) -> impl FnMut(Mode) -> Option<Command> {
    let (mut last, mut given, mut rested) = (Command::Start, false, 0);
    move |mode| {
        match mode {
            Mode::Boot | Mode::SelfTest | Mode::Zero if again => given = false,
            Mode::Idle if !given => {
                given = true;
                return Some(last);
            }
            Mode::Complete(Direction::Deploy) if last == Command::Start => {
                rested += 1;
                if rested > DWELL_TICKS {
                    last = Command::Retract;
                    return Some(last);
                }
            }
            _ => {}
        }
        None
    }
}
