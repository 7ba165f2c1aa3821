//! What whole runs cost: controller and plant together, the plant alone by phase, and
//! what it saves to let the ring sleep on the smooth wall.

use anyhow::{Result, ensure};
use serde::Serialize;

use hil_sim::plant::rig::Resolution;
use hil_sim::scenario::Scenario;
use hil_sim::session::plant_profile::{PlantProfile, profile};
use hil_sim::session::{self, Options};

/// Cruise of the deployment that is timed: 80 mm of travel in the study's ten seconds.
const CRUISE: &str = "drive.cruise_speed_mm_s=8";

/// Runs of which the fastest counts.
const REPEATS: usize = 15;

/// Costs of a deployment of about ten seconds, one thread on one core.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Costs {
    /// As it is run.
    pub account: PlantProfile,
    /// The plant alone with the ring resolved throughout.
    pub always_awake: PlantProfile,
    /// And with every element visited that faces the wall, in reach or not.
    pub nothing_skipped: PlantProfile,
    /// Times faster than real time: controller, sensors and plant.
    pub run_real_time_factor: f64,
    /// The plant alone.
    pub plant_real_time_factor: f64,
    /// Cost of a simulated second of a crossing over one of the smooth wall; none if the
    /// run has no smooth wall.
    pub crossing_over_smooth: Option<f64>,
    /// Time of the plant with nothing skipped over that as it is run.
    pub saving: f64,
    /// The same of the elements visited, which does not depend on the machine.
    pub saving_of_elements: f64,
}

/// Measures them.
///
/// # Errors
/// If the run does not complete.
pub fn measure(quick: bool) -> Result<Costs> {
    let repeats = if quick { 1 } else { REPEATS };
    let scenario = Scenario::resolve(None, None, &[CRUISE.to_owned()])?;
    let run = session::run(&scenario, Options::default())?;
    ensure!(run.summary.completed, "a deployment with {CRUISE} does not complete");
    let account = profile(&scenario, repeats, |rig| rig)?;
    let awake = Resolution { always_awake: true, ..Resolution::default() };
    let always_awake = profile(&scenario, repeats, |rig| rig.with_resolution(awake))?;
    let nothing_skipped =
        profile(&scenario, repeats, |rig| rig.with_resolution(awake).visiting_all())?;
    Ok(Costs {
        run_real_time_factor: account.sil_factor(),
        plant_real_time_factor: account.plant_factor(),
        crossing_over_smooth: account.crossing_over_smooth(),
        saving: nothing_skipped.plant_wall_s / account.plant_wall_s,
        saving_of_elements: elements(&nothing_skipped) as f64 / elements(&account) as f64,
        account,
        always_awake,
        nothing_skipped,
    })
}

/// Elements visited in all phases.
#[must_use]
pub fn elements(account: &PlantProfile) -> u64 {
    account.phases.iter().map(|phase| phase.elements).sum()
}

/// Part of the simulated time in the phase of this name.
#[must_use]
pub fn part(account: &PlantProfile, phase: &str) -> f64 {
    let within = account.phases.iter().filter(|found| found.name == phase);
    within.map(|found| found.simulated_s).sum::<f64>() / account.simulated_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ring_is_resolved_where_it_is_needed_and_nowhere_else() {
        let costs = measure(true).unwrap();
        let simulated: f64 = costs.account.phases.iter().map(|phase| phase.simulated_s).sum();
        assert!((simulated - costs.account.simulated_s).abs() < 1e-6);
        assert!(costs.account.simulated_s > 9.0, "{costs:?}");
        assert!(part(&costs.account, "smooth wall") > 0.05, "{costs:?}");
        assert_eq!(part(&costs.always_awake, "smooth wall"), 0.0);
        assert!(costs.saving_of_elements > 1.3, "{costs:?}");
        let smooth = &costs.account.phases[0];
        assert_eq!((smooth.name, smooth.elements), ("smooth wall", 0));
    }
}
