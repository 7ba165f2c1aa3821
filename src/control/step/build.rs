//! From a rig to the controller's machine units, once at start.

use super::Controller;
use crate::control::preload_loop::PreloadLoop;
use crate::control::profile::Profile;
use crate::control::rise::Rise;
use crate::control::schedule::Schedule;
use crate::control::speed_loop::SpeedLoop;
use crate::estimate::crossing::CrossingWatch;
use crate::estimate::tread::TreadLaw;
use crate::estimate::vibration::VibrationObserver;
use crate::model::formula::Formula;
use crate::numeric::checked;
use crate::rig::{Rig, RigError};
use crate::sense::{Senses, Tuning};
use crate::supervise::Monitor;
use crate::units::TICK_HZ;

/// Bandwidth of the speed observer, rad/s: three times the speed loop's crossover;
/// an encoder count every 2 ms at crossing speed leaves it quiet enough.
const OBSERVER_RAD_S: f64 = 60.0;

/// Part of the pre-tightener's slew that the spring may use up while the wheel climbs.
const CLIMB_PART: f64 = 0.9;

/// Way of the wheel between touching a corner and leaving it, over its radius, beyond
/// which it turns without getting over: twice the way of a crossing.
const CORNER_PART: f64 = 1.5;

impl Controller {
    /// Turns a rig into machine units, once.
    ///
    /// # Errors
    /// [`RigError`] if a parameter is out of range or does not fit the others.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        rig.validate()?;
        let mut steps = heapless::Vec::new();
        for &position in &rig.rig.step_positions_mm {
            // Never full: both lists hold as many.
            let _ = steps.push(checked("rig.step_positions_mm", position)?);
        }
        let tuning = Tuning { speed_bandwidth_rad_s: OBSERVER_RAD_S, ..Tuning::default() };
        Ok(Self {
            senses: Senses::try_build_tuned(rig, &tuning)?,
            monitor: Monitor::try_build(rig)?,
            watch: CrossingWatch::try_build(rig)?,
            tread: TreadLaw::try_build(rig)?,
            vibration: VibrationObserver::try_build(rig)?,
            skipping: true,
            rise: Rise::try_build(rig)?,
            schedule: Schedule::try_build(rig)?,
            profile: Profile::try_build(rig)?,
            speed_loop: SpeedLoop::try_build(rig)?,
            preload_loop: PreloadLoop::try_build(rig)?,
            steps,
            travel: checked("rig.travel_mm", rig.rig.travel_mm)?,
            patience: ((2.0 * rig.preload.limit_n / rig.preload.slew_n_per_s + 1.0)
                * f64::from(TICK_HZ)) as u32,
            rise_speed: checked(
                "preload.spring_n_per_mm",
                (CLIMB_PART * rig.preload.slew_n_per_s / rig.preload.spring_n_per_mm).min(1000.0),
            )?,
            corner_reach: checked("rig.step_height_mm", Formula::new(rig).free_run_mm())?,
            corner_way: checked("rig.wheel_radius_mm", CORNER_PART * rig.rig.wheel_radius_mm)?,
            spring: checked("preload.spring_n_per_mm", rig.preload.spring_n_per_mm)?,
            foresight: checked("preload.delay_s", rig.preload.delay_s + rig.preload.lag_s)?,
            load: checked("plant.top_load_n", rig.plant.top_load_n * rig.plant.top_load_share)?,
            full_wedge: checked(
                "plant.arm_coupling",
                rig.plant.arm_coupling * rig.plant.top_load_n * rig.plant.top_load_share,
            )?,
            inertia: checked(
                "drive.reflected_mass_kg",
                (rig.drive.reflected_mass_kg + rig.plant.moved_mass_kg) * 1e-3,
            )?,
            friction: checked("plant.mu", rig.plant.mu)?,
        })
    }

    /// The same controller with every stage run in every tick, needed or not: what it
    /// puts out is the same to the bit.
    #[must_use]
    pub fn without_skipping(mut self) -> Self {
        self.skipping = false;
        self
    }
}
