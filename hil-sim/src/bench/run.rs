//! What whole runs cost: the plant alone over a recorded deployment, on the smooth
//! wall and in its crossings, and controller and plant together.

use std::time::Duration;

use anyhow::{Result, ensure};
use cpu_time::ThreadTime;
use interstage::supervise::{Command, Mode};
use serde::Serialize;

use super::clock::{Effort, least};
use crate::plant::draw::PlantParameters;
use crate::plant::rig::{Drives, PlantError, Resolution, VirtualRig};
use crate::scenario::Scenario;
use crate::sil::{self, Options, Session, drives};

/// Control period, s.
const TICK_S: f64 = 1e-3;

/// Speed of the deployment that is timed, mm/s: 80 mm of travel in the study's ten
/// seconds.
const SPEED_MM_S: f64 = 8.0;

/// Longest run that is taken, s.
const LONGEST_S: f64 = 60.0;

/// Costs of a run, all of one thread on one core.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Costs {
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Of that, time with the ring resolved, s.
    pub ring_awake_s: f64,
    /// Times faster than real time, the plant alone.
    pub plant_real_time_factor: f64,
    /// The same with the ring resolved on the smooth wall too.
    pub always_awake_real_time_factor: f64,
    /// Times faster than real time, controller, sensors and plant.
    pub run_real_time_factor: f64,
    /// Cost of a simulated second on the smooth wall, s.
    pub smooth_s_per_s: f64,
    /// Cost of a simulated second of a crossing, s.
    pub crossing_s_per_s: f64,
    /// Crossing over smooth wall.
    pub crossing_over_smooth: f64,
}

/// Measures a deployment at 8 mm/s throughout, ten seconds of the way.
///
/// # Errors
/// If the run does not complete.
pub fn measure() -> Result<Costs> {
    let scenario = Scenario::default();
    let options = Options { speed: Some((SPEED_MM_S, true)), ..Options::default() };
    let (recorded, _) = record(&scenario, options)?;
    let parameters = PlantParameters::draw(&scenario);
    let awake = Resolution { always_awake: true, ..Resolution::default() };
    let fresh = |resolution: Resolution| {
        VirtualRig::new(parameters.clone(), 0.0, 0.0, TICK_S).with_resolution(resolution)
    };
    let effort = Effort { repeats: 7, within: Duration::from_millis(800) };
    let alone = least(effort, || fresh(Resolution::default()), |rig| replay(rig, &recorded));
    let resolved = least(effort, || fresh(awake), |rig| replay(rig, &recorded));
    let whole = least(effort, || (), |()| sil::run(&scenario, options));
    let [skipping, always] = [alone.answer?, resolved.answer?];
    ensure!(skipping > 70.0 && always > 70.0, "the replay of a deployment does not arrive");
    ensure!(whole.answer?.summary.completed, "a deployment at {SPEED_MM_S} mm/s does not complete");
    let parts = parts(|| fresh(Resolution::default()), &recorded)?;
    let simulated_s = recorded.len() as f64 * TICK_S;
    let [smooth, crossing] = parts.map(|part| part.cost_s / part.simulated_s);
    Ok(Costs {
        simulated_s,
        ring_awake_s: parts[1].simulated_s,
        plant_real_time_factor: simulated_s / alone.seconds,
        always_awake_real_time_factor: simulated_s / resolved.seconds,
        run_real_time_factor: simulated_s / whole.seconds,
        smooth_s_per_s: smooth,
        crossing_s_per_s: crossing,
        crossing_over_smooth: crossing / smooth,
    })
}

/// The bridge commands of a run, tick by tick, and where it came to, mm.
fn record(scenario: &Scenario, options: Options) -> Result<(Vec<Drives>, f64)> {
    let mut session = Session::new(scenario, options)?;
    let mut start = Some(Command::Start);
    let mut commands = Vec::new();
    while session.time_s() < LONGEST_S {
        let command = if session.mode() == Mode::Idle { start.take() } else { None };
        let output = session.step(command)?;
        commands.push(drives(output.drive, output.preload));
        if matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_)) {
            break;
        }
    }
    Ok((commands, session.plant().truth().position_mm))
}

/// The plant under these commands: where it comes to, mm.
fn replay(mut rig: VirtualRig, commands: &[Drives]) -> Result<f64, PlantError> {
    for drives in commands {
        rig.step(drives, TICK_S)?;
    }
    Ok(rig.truth().position_mm)
}

#[derive(Clone, Copy, Debug, Default)]
struct Part {
    simulated_s: f64,
    cost_s: f64,
}

/// Smooth wall and crossings: every run of ticks of one kind is timed as a piece, and
/// counts with the least of its times.
fn parts(fresh: impl Fn() -> VirtualRig, commands: &[Drives]) -> Result<[Part; 2]> {
    const RUNS: usize = 7;
    let mut pieces: Vec<(bool, usize, f64)> = Vec::new();
    let mut rig = fresh();
    for drives in commands {
        rig.step(drives, TICK_S)?;
        let awake = rig.truth().ring_awake;
        match pieces.last_mut() {
            Some((kind, ticks, _)) if *kind == awake => *ticks += 1,
            _ => pieces.push((awake, 1, f64::INFINITY)),
        }
    }
    for _ in 0..RUNS {
        let mut rig = fresh();
        let mut rest = commands;
        for (_, ticks, least) in &mut pieces {
            let (now, later) = rest.split_at(*ticks);
            rest = later;
            let begun = ThreadTime::now();
            for drives in now {
                rig.step(drives, TICK_S)?;
            }
            *least = least.min(begun.elapsed().as_secs_f64());
        }
    }
    let mut parts = [Part::default(); 2];
    for (awake, ticks, cost_s) in pieces {
        let part = &mut parts[usize::from(awake)];
        part.simulated_s += ticks as f64 * TICK_S;
        part.cost_s += cost_s;
    }
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_replay_goes_where_the_run_went() {
        let scenario = Scenario::default();
        let (commands, end_mm) = record(&scenario, Options::default()).unwrap();
        let rig = VirtualRig::new(PlantParameters::draw(&scenario), 0.0, 0.0, TICK_S);
        assert_eq!(replay(rig.clone(), &commands).unwrap(), end_mm);
        assert!(end_mm > 79.0, "{end_mm}");
        let parts = parts(|| rig.clone(), &commands).unwrap();
        let simulated: f64 = parts.iter().map(|part| part.simulated_s).sum();
        assert!((simulated - commands.len() as f64 * TICK_S).abs() < 1e-9);
        assert!(parts.iter().all(|part| part.cost_s.is_finite()));
    }
}
