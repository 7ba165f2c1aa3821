//! From a rig to the controller's machine units, once at start.

use super::Controller;
use crate::control::preload_loop::{PreloadLoop, answer_s};
use crate::control::schedule::Schedule;
use crate::control::speed_loop::SpeedLoop;
use crate::estimate::Estimator;
use crate::estimate::vibration::VibrationObserver;
use crate::model::profile::Profile;
use crate::numeric::checked;
use crate::rig::{CLIMB_PART, Rig, RigError};
use crate::sense::{FILTER_S, Senses};
use crate::supervise::Monitor;
use crate::units::TICK_HZ;

/// Bandwidth of the speed observer, rad/s: three times the speed loop's crossover;
/// an encoder count every 2 ms at crossing speed leaves it quiet enough.
const OBSERVER_RAD_S: f64 = 60.0;

impl Controller {
    /// Turns a rig into machine units, once; fails where a parameter is out of range or does
    /// not fit the others.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        rig.validate()?;
        let (preload, drive, plant) = (&rig.preload, &rig.drive, &rig.plant);
        let climb = (CLIMB_PART * preload.slew_n_per_s / preload.spring_n_per_mm).min(1000.0);
        let inertia = (drive.reflected_mass_kg + plant.moved_mass_kg) * 1e-3;
        Ok(Self {
            senses: Senses::try_build_with(rig, OBSERVER_RAD_S, FILTER_S)?,
            monitor: Monitor::try_build(rig)?,
            estimator: Estimator::try_build(rig)?,
            vibration: VibrationObserver::try_build(rig)?,
            skipping: true,
            schedule: Schedule::try_build(rig)?,
            profile: Profile::try_build(rig)?,
            speed_loop: SpeedLoop::try_build(rig)?,
            preload_loop: PreloadLoop::try_build(rig)?,
            preload_timeout: ((2.0 * preload.limit_n / preload.slew_n_per_s
                + (2.0 * answer_s(rig)).max(1.0))
                * f64::from(TICK_HZ)) as u32,
            climb_speed: checked("preload.spring_n_per_mm", climb)?,
            spring: checked("preload.spring_n_per_mm", preload.spring_n_per_mm)?,
            preload_latency: checked("preload.delay_s", rig.preload_latency_s())?,
            load: checked("plant.top_load_n", plant.top_load_n * plant.top_load_share)?,
            arm_coupling: checked("plant.arm_coupling", plant.arm_coupling)?,
            inertia: checked("drive.reflected_mass_kg", inertia)?,
            friction: checked("plant.mu", plant.mu)?,
            least_speed: checked("drive.min_crossing_speed_mm_s", drive.min_crossing_speed_mm_s)?,
            rolling_preload: checked("control.slip_margin", rig.rolling_preload_n())?,
        })
    }

    /// The same controller without skipping: every stage runs in every tick, with the same
    /// outputs to the bit.
    pub fn without_skipping(mut self) -> Self {
        self.skipping = false;
        self
    }
}
