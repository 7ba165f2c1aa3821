//! What a run costs: the plant's phases with their share of the time.
//!
//! The run is made once, its bridge commands are kept, and the plant alone is then led
//! through them again: the clock is read where the phase changes and nowhere else, so
//! that reading it does not count.

use cpu_time::ThreadTime;

use serde::Serialize;

use super::{Options, RunError, Session, TICK_S, drives, run};
use crate::plant::rig::{Drives, PHASES, PhaseWork, VirtualRig};
use crate::record::starter;
use crate::scenario::Scenario;

/// What one phase of the plant did and took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PhaseProfile {
    /// Name of the phase.
    pub name: &'static str,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Time it took, s.
    pub wall_s: f64,
    /// Steps of the ring.
    pub ring_strides: u64,
    /// Heights tried in the radial balance, on the ring.
    pub newton_iterations: u64,
    /// Elements visited, once for every height tried.
    pub elements: u64,
    /// Contacts of steady rolling computed node by node.
    pub steady_computed: u64,
    /// Heights tried on a tangent of one.
    pub steady_iterations: u64,
}

impl PhaseProfile {
    /// Time taken per simulated second; none if the phase did not come up.
    #[must_use]
    pub fn cost(&self) -> Option<f64> {
        (self.simulated_s > 0.0).then(|| self.wall_s / self.simulated_s)
    }
}

/// What a run costs: all of it, the plant alone, and by phase.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlantProfile {
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Controller, sensors, plant and ledger, without rows or files, s.
    pub sil_wall_s: f64,
    /// The plant alone under the same commands, s.
    pub plant_wall_s: f64,
    /// Its phases.
    pub phases: Vec<PhaseProfile>,
}

impl PlantProfile {
    /// Simulated over real time of the loop.
    #[must_use]
    pub fn sil_factor(&self) -> f64 {
        self.simulated_s / self.sil_wall_s
    }

    /// Simulated over real time of the plant alone.
    #[must_use]
    pub fn plant_factor(&self) -> f64 {
        self.simulated_s / self.plant_wall_s
    }

    /// How many times a simulated second of a crossing costs one of the smooth wall; none
    /// if the run had no such phase.
    #[must_use]
    pub fn crossing_over_smooth(&self) -> Option<f64> {
        let cost = |name: &str| self.phases.iter().find(|phase| phase.name == name)?.cost();
        Some(cost(PHASES[2].name())? / cost(PHASES[0].name())?)
    }
}

/// The profile of a scenario, with the plant as `changed` makes it: computed more finely, or
/// with less skipped. Of `repeats` runs the fastest counts, as the others were disturbed.
///
/// # Errors
/// [`RunError`] as of [`run`].
pub fn profile(
    scenario: &Scenario,
    repeats: usize,
    changed: impl FnOnce(VirtualRig) -> VirtualRig,
) -> Result<PlantProfile, RunError> {
    let repeats = repeats.max(1);
    let (fresh, commands) = record(scenario)?;
    let fresh = changed(fresh);
    let mut sil_wall_s = f64::INFINITY;
    for _ in 0..repeats {
        let started = ThreadTime::now();
        run(scenario, Options::default())?;
        sil_wall_s = sil_wall_s.min(started.elapsed().as_secs_f64());
    }
    let (mut walls, mut work) = replay(fresh.clone(), &commands)?;
    for _ in 1..repeats {
        let (again, same) = replay(fresh.clone(), &commands)?;
        for (least, took) in walls.iter_mut().zip(again) {
            *least = least.min(took);
        }
        work = same;
    }
    let phases =
        PHASES.iter().zip(walls.iter().zip(&work)).map(|(phase, (&wall_s, work))| PhaseProfile {
            name: phase.name(),
            simulated_s: work.simulated_s,
            wall_s,
            ring_strides: work.ring.strides,
            newton_iterations: work.ring.iterations,
            elements: work.ring.elements,
            steady_computed: work.steady_computed,
            steady_iterations: work.steady_iterations,
        });
    Ok(PlantProfile {
        simulated_s: commands.len() as f64 * TICK_S,
        sil_wall_s,
        plant_wall_s: walls.iter().sum(),
        phases: phases.collect(),
    })
}

/// The plant before the run, and what its bridges were driven with.
fn record(scenario: &Scenario) -> Result<(VirtualRig, Vec<Drives>), RunError> {
    let mut session = Session::new(scenario, Options::default())?;
    let fresh = session.plant().clone();
    let mut commands = Vec::new();
    let mut start = Some(starter(scenario.run.direction));
    while let Some(output) = super::tick(&mut session, &mut start)? {
        commands.push(drives(output.drive, output.preload));
    }
    Ok((fresh, commands))
}

/// Leads a plant through the commands; time and work of each phase.
fn replay(
    mut plant: VirtualRig,
    commands: &[Drives],
) -> Result<([f64; PHASES.len()], [PhaseWork; PHASES.len()]), RunError> {
    let mut walls = [0.0; PHASES.len()];
    let mut phase = plant.phase();
    let mut since = ThreadTime::now();
    for command in commands {
        plant.step(command, TICK_S)?;
        if plant.phase() != phase {
            let now = ThreadTime::now();
            walls[phase as usize] += now.duration_since(since).as_secs_f64();
            (phase, since) = (plant.phase(), now);
        }
    }
    walls[phase as usize] += since.elapsed().as_secs_f64();
    Ok((walls, *plant.phases()))
}
