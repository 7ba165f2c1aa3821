//! What sensors, pre-tightener and drive of a rig can do.

use super::Bound::{AtLeast, AtMost};
use super::{Rig, RigError};
use crate::sense::analog::{BROKEN_ABOVE, FULL_AT, ZERO_AT};

/// Crossover of the speed loop's integral part, rad/s: a third of the speed observer's bandwidth.
pub(crate) const CROSSOVER_RAD_S: f64 = 20.0;
/// Its proportional part, as a fraction of the inverse motor gain.
pub(crate) const PROPORTIONAL: f64 = 0.3;
/// Largest error that it integrates, mm/s.
pub(crate) const MOST_ERROR_MM_S: f64 = 4.0;

/// Part of the cruise preload by which a preload is short.
pub(crate) const SHORT_PART: f64 = 0.1;

/// Part of the pre-tightener's slew that the spring may take while the wheel climbs.
pub(crate) const CLIMB_PART: f64 = 0.9;

/// Preload above the limit that counts as overpressure, relative: regulation and the spring that
/// a climb compresses stay below it.
pub const OVERPRESSURE_PART: f64 = 0.10;

/// Preload kept free below the limit for regulation, relative to the limit, beside the error of the
/// preload sensor: the spring's compression in a climb beyond the feed-forward. On the presets no
/// rig within its tolerances exceeds the limit with it.
const REGULATION_PART: f64 = 0.03;

/// Largest part of an analogue sensor's full scale that it still shows.
const SHOWN_PART: f64 = (BROKEN_ABOVE - ZERO_AT) / (FULL_AT - ZERO_AT);

/// Steepest rise of the wheel over a corner, that behind lift-off.
const LIFT_SLOPE: f64 = 0.5;

/// Part by which the least planned speed exceeds the least useful one: creep of the tread and
/// the dip under the corner's load take up to a tenth.
const DIP_PART: f64 = 0.12;

/// Largest travel of an encoder count, mm: at the least speed of a crossing, 1.5 mm/s, the speed
/// observer then has three counts within its settling time.
const LARGEST_COUNT_MM: f64 = 0.08;

/// Travel of the reference that a wheel which has not turned may stay behind, mm: on a corner the
/// integral part of the speed loop first has to find the duty that lifts it.
pub(crate) const START_LAG_MM: f64 = 2.0;

impl Rig {
    /// Whether sensors, pre-tightener and drive can do what the controller asks of them.
    pub(super) fn abilities(&self) -> Result<(), RigError> {
        let (preload, drive, spring) = (&self.preload, &self.drive, self.preload.spring_n_per_mm);
        let turn_mm = 2.0 * core::f64::consts::PI * self.rig.wheel_radius_mm;
        // A corner pressed by the limit into a relaxed tread: a triangle on each side of it, at the
        // slope of a wheel that touches it, carries `k L d^2 / tan(phi)`.
        let slope = self.corner_reach_mm() / (self.rig.wheel_radius_mm - self.rig.step_height_mm);
        let rate = 1e-9 * self.tread.k_inf_pa_per_m * self.rig.wheel_width_mm;
        let deepest = libm::sqrt(preload.limit_n * slope / rate);
        let load = self.plant.top_load_n * self.plant.top_load_share;
        let moved_kg = drive.reflected_mass_kg + self.plant.moved_mass_kg;
        let accelerated = load + 1e-3 * moved_kg * drive.acceleration_mm_s2;
        let climbs = load + preload.limit_n * slope;
        // What the proportional part adds, whatever the load.
        let adds = drive.stall_force_n * PROPORTIONAL * MOST_ERROR_MM_S / drive.no_load_speed_mm_s;
        let checks: [(_, _, &[&'static str], _); 9] = [
            (
                self.sense.encoder_counts,
                AtLeast(turn_mm / LARGEST_COUNT_MM),
                &["sense.encoder_counts", "rig.wheel_radius_mm"],
                "a count is too long for the speed of a crossing",
            ),
            (
                self.sense.preload_full_scale_n,
                AtLeast(preload.limit_n * (1.0 + OVERPRESSURE_PART) / SHOWN_PART),
                &["sense.preload_full_scale_n", "preload.limit_n"],
                "the sensor does not show a preload beyond preload.limit_n",
            ),
            (
                self.sense.tread_full_scale_mm,
                AtLeast(deepest / SHOWN_PART),
                &["sense.tread_full_scale_mm", "preload.limit_n", "tread.k_inf_pa_per_m"],
                "the sensor does not show how deep preload.limit_n presses a corner into the tread",
            ),
            (
                preload.slew_n_per_s,
                AtMost(preload.cruise_n / self.preload_latency_s()),
                &["preload.slew_n_per_s", "preload.cruise_n", "preload.delay_s", "preload.lag_s"],
                "preload.delay_s and preload.lag_s allow more than preload.cruise_n before it answers",
            ),
            (
                spring,
                AtMost(self.regulation_n() / (LIFT_SLOPE * self.rig.step_tolerance_mm)),
                &["preload.spring_n_per_mm", "preload.limit_n", "rig.step_tolerance_mm"],
                "a step that is off by rig.step_tolerance_mm changes the preload beyond regulation",
            ),
            (
                spring,
                AtMost(spring * self.climb_speed_mm_s() / self.least_planned_speed_mm_s()),
                &[
                    "preload.spring_n_per_mm",
                    "preload.slew_n_per_s",
                    "preload.delay_s",
                    "preload.lag_s",
                    "drive.min_crossing_speed_mm_s",
                    "preload.limit_n",
                ],
                "the pre-tightener does not follow it over a step at drive.min_crossing_speed_mm_s",
            ),
            (
                drive.force_limit_n,
                AtLeast(accelerated.max(climbs) + adds),
                &[
                    "drive.force_limit_n",
                    "drive.stall_force_n",
                    "drive.no_load_speed_mm_s",
                    "drive.reflected_mass_kg",
                    "drive.acceleration_mm_s2",
                    "plant.top_load_n",
                    "plant.top_load_share",
                    "preload.limit_n",
                ],
                "the drive does not accelerate as planned, or climb with preload.limit_n",
            ),
            (
                drive.stall_force_n,
                AtLeast(accelerated / (1.0 - drive.cruise_speed_mm_s / drive.no_load_speed_mm_s)),
                &[
                    "drive.stall_force_n",
                    "drive.no_load_speed_mm_s",
                    "drive.cruise_speed_mm_s",
                    "drive.reflected_mass_kg",
                    "drive.acceleration_mm_s2",
                ],
                "the drive does not accelerate as planned up to drive.cruise_speed_mm_s",
            ),
            (
                drive.stall_force_n,
                AtLeast(climbs * drive.no_load_speed_mm_s / (CROSSOVER_RAD_S * START_LAG_MM)),
                &[
                    "drive.stall_force_n",
                    "drive.no_load_speed_mm_s",
                    "preload.limit_n",
                    "plant.top_load_n",
                    "plant.top_load_share",
                ],
                "the wheel stands on a corner for too long until the speed loop lifts it",
            ),
        ];
        for (value, bound, keys, reason) in checks {
            let kept = match bound {
                AtLeast(least) => value >= least,
                AtMost(most) => value <= most,
            };
            if !kept {
                return Err(RigError::Unable { value, bound, reason, keys });
            }
        }
        Ok(())
    }

    /// Preload kept free below the limit for regulation, N.
    fn regulation_n(&self) -> f64 {
        REGULATION_PART * self.preload.limit_n
    }

    /// Largest preload to ask for, N: with regulation and the sensor's error, within the limit.
    pub fn most_preload_n(&self) -> f64 {
        self.preload.limit_n * (1.0 - self.sense.preload_error) - self.regulation_n()
    }

    /// Dead time and lag of the pre-tightener, s.
    pub const fn preload_latency_s(&self) -> f64 {
        self.preload.delay_s + self.preload.lag_s
    }

    /// Speed at which the pre-tightener just follows the spring at lift-off, mm/s: by its slew, and
    /// so that the preload is not short by what the spring does within its dead time and lag.
    pub fn climb_speed_mm_s(&self) -> f64 {
        let late = SHORT_PART * self.preload.cruise_n / self.preload_latency_s();
        late.min(CLIMB_PART * self.preload.slew_n_per_s)
            / (LIFT_SLOPE * self.preload.spring_n_per_mm)
    }

    /// Least speed that is planned for a crossing, mm/s.
    pub const fn least_planned_speed_mm_s(&self) -> f64 {
        self.drive.min_crossing_speed_mm_s * (1.0 + DIP_PART)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_presets_plan_with_the_preload_that_they_had() {
        for (name, most_n) in [("prototype", 47.75), ("fe", 143.25)] {
            let rig = Rig::named(name).expect("a preset");
            assert_eq!(rig.validate(), Ok(()));
            assert!((rig.most_preload_n() - most_n).abs() < 1e-9);
        }
    }

    #[test]
    fn what_cannot_work_is_refused_with_key_value_bound_and_reason() {
        type Case = (fn(&mut Rig), &'static str);
        let cases: [Case; 6] = [
            (
                |rig| rig.sense.encoder_counts = 1024.0,
                "sense.encoder_counts = 1024: expected at least 1963.5",
            ),
            (
                |rig| rig.preload.spring_n_per_mm = 4.0,
                "preload.spring_n_per_mm = 4: expected at most 3.75",
            ),
            (
                |rig| rig.preload.slew_n_per_s = 500.0,
                "preload.slew_n_per_s = 500: expected at most 237.8",
            ),
            (
                |rig| rig.sense.preload_full_scale_n = 50.0,
                "sense.preload_full_scale_n = 50: expected at least 50.2",
            ),
            (
                |rig| rig.drive.stall_force_n = 40.0,
                "drive.stall_force_n = 40: expected at least 58",
            ),
            (
                |rig| rig.drive.force_limit_n = 38.0,
                "drive.force_limit_n = 38: expected at least 42",
            ),
        ];
        for (change, expected) in cases {
            let mut rig = Rig::prototype();
            change(&mut rig);
            let text = rig.validate().expect_err("refused").to_string();
            assert!(text.starts_with(expected), "{text}");
        }
    }
}
