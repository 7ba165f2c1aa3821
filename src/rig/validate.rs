//! Checks of a rig's parameters.

use super::Rig;

/// Reserve of the preload with which the wheel begins to roll: load, friction and a preload sensor
/// near its zero are known less well than under way, and a tread that rests under more preload
/// shows better what it is.
const ROLLING_RESERVE: f64 = 2.0;
/// Friction coefficient, less its margin, with which a wheel is still reckoned to roll.
const LEAST_GRIP: f64 = 1e-3;

/// Least speed of the unloaded motor over the cruise speed, for regulation.
const TOP_SPEED_RESERVE: f64 = 1.2;

/// Error of a parameter set: the key, its value, the expected range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RigError {
    /// A value lies outside its range.
    #[error("{key} = {value}: expected a value from {min} to {max}")]
    OutOfRange {
        /// Key of the parameter, as in a scenario file.
        key: &'static str,
        /// The value found.
        value: f64,
        /// Least value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// The step table is not ascending with room for a wheel between the steps.
    #[error(
        "rig.step_positions_mm: step {step} is at {position_mm} mm, expected at least \
         {least_mm:.1} mm: the wheel has to finish one step before it touches the next"
    )]
    StepOrder {
        /// Position of the offending step in the table, from 1.
        step: usize,
        /// Its position, mm.
        position_mm: f64,
        /// Least position allowed there, mm.
        least_mm: f64,
    },
    /// A step lies beyond the travel.
    #[error(
        "rig.step_positions_mm: step {step} is at {position_mm} mm, expected at most {travel_mm} \
         mm, which is rig.travel_mm"
    )]
    StepBeyondTravel {
        /// Position of the offending step in the table, from 1.
        step: usize,
        /// Its position, mm.
        position_mm: f64,
        /// The travel, mm.
        travel_mm: f64,
    },
    /// Two values that do not go together: the upper one has to be at least `ratio` times the
    /// lower one.
    #[error("{} = {}: expected at least {:.1}, as {} = {}",
        upper.0, upper.1, lower.1 * ratio, lower.0, lower.1)]
    Pair {
        /// Key and value of the upper one.
        upper: (&'static str, f64),
        /// Key and value of the lower one.
        lower: (&'static str, f64),
        /// Least upper value over the lower one.
        ratio: f64,
    },
    /// A value with which the drive could not do its work.
    #[error("{} = {value}: expected {bound}: {reason}", keys.first().unwrap_or(&"rig"))]
    Unable {
        /// The value found.
        value: f64,
        /// What it has to keep.
        bound: Bound,
        /// What happens beyond it.
        reason: &'static str,
        /// Key of the parameter, then those that set the bound.
        keys: &'static [&'static str],
    },
    /// The arm cannot reach a wall at this radius.
    #[error(
        "rig.arm_length_mm: the arm reaches wheel-centre radii from {min_mm:.1} to {max_mm:.1} mm, \
         expected to include {radius_mm:.1} mm"
    )]
    OutOfReach {
        /// Wheel-centre radius asked for, mm.
        radius_mm: f64,
        /// Smallest radius the arm reaches, mm.
        min_mm: f64,
        /// Largest radius the arm reaches, mm.
        max_mm: f64,
    },
}

impl RigError {
    /// The keys that take part, the one that its text begins with first.
    pub const fn keys(&self) -> &[&'static str] {
        match self {
            Self::OutOfRange { key, .. } => core::slice::from_ref(key),
            Self::StepOrder { .. } => &[
                "rig.step_positions_mm",
                "rig.wheel_radius_mm",
                "rig.step_height_mm",
                "rig.step_tolerance_mm",
            ],
            Self::StepBeyondTravel { .. } => &["rig.step_positions_mm", "rig.travel_mm"],
            Self::Pair { upper, .. } => core::slice::from_ref(&upper.0),
            Self::Unable { keys, .. } => keys,
            Self::OutOfReach { .. } => &[
                "rig.arm_length_mm",
                "rig.arm_pivot_radius_mm",
                "rig.wall_radius_mm",
                "rig.wheel_radius_mm",
                "rig.step_height_mm",
                "rig.step_positions_mm",
            ],
        }
    }

    /// The same from the side of the other value, where there are two: its key, its value, and
    /// the bound of it that is broken: at least, or else at most.
    pub fn other_side(&self) -> Option<(&'static str, f64, Bound)> {
        match *self {
            Self::StepBeyondTravel { position_mm, travel_mm, .. } => {
                Some(("rig.travel_mm", travel_mm, Bound::AtLeast(position_mm)))
            }
            Self::Pair { upper: (_, value), lower: (key, lower), ratio } => {
                Some((key, lower, Bound::AtMost(value / ratio)))
            }
            _ => None,
        }
    }
}

/// The bound of a value that another one sets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// The least value.
    AtLeast(f64),
    /// The largest value.
    AtMost(f64),
}

impl core::fmt::Display for Bound {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        // Rounded so that the number itself is within the bound.
        match *self {
            Self::AtLeast(least) => write!(f, "at least {:.2}", libm::ceil(least * 100.0) / 100.0),
            Self::AtMost(most) => write!(f, "at most {:.2}", libm::floor(most * 100.0) / 100.0),
        }
    }
}

impl Rig {
    /// Checks every value against its range and the values against one another.
    pub fn validate(&self) -> Result<(), RigError> {
        self.ranges()?;
        self.step_table()?;
        self.pairs()?;
        self.reach()?;
        self.abilities()
    }

    /// Values that bound one another.
    fn pairs(&self) -> Result<(), RigError> {
        let cruise = ("drive.cruise_speed_mm_s", self.drive.cruise_speed_mm_s);
        let safe = ("control.safe_speed_mm_s", self.control.safe_speed_mm_s);
        let least = ("drive.min_crossing_speed_mm_s", self.drive.min_crossing_speed_mm_s);
        let top = ("drive.no_load_speed_mm_s", self.drive.no_load_speed_mm_s);
        let limit = ("preload.limit_n", self.preload.limit_n);
        let pressed = ("preload.cruise_n", self.preload.cruise_n);
        for (upper, lower, ratio) in [
            (safe, least, 1.0),
            (cruise, safe, 1.0),
            (top, cruise, TOP_SPEED_RESERVE),
            (limit, pressed, self.preload.limit_n / self.most_preload_n()),
        ] {
            if upper.1 < lower.1 * ratio {
                return Err(RigError::Pair { upper, lower, ratio });
            }
        }
        Ok(())
    }

    /// Wheel-centre radius with an undeformed wheel on the wall of `level`, mm.
    pub fn centre_radius_mm(&self, level: usize) -> f64 {
        self.rig.wall_radius_mm - self.rig.step_height_mm * level as f64 - self.rig.wheel_radius_mm
    }

    /// Axial distance of a corner from the centre at which the undeformed wheel touches it, mm.
    pub fn corner_reach_mm(&self) -> f64 {
        let (radius, height) = (self.rig.wheel_radius_mm, self.rig.step_height_mm);
        libm::sqrt(radius * radius - (radius - height) * (radius - height))
    }

    /// Preload with which the wheel may roll along the wall, N: its tread carries load and
    /// carriage, not the inertia of the rotor behind it. A trailing arm presses it on besides,
    /// which is left as a reserve; what a leading one lifts it by counts. The limit where the
    /// friction is no more than its margin.
    pub fn rolling_preload_n(&self) -> f64 {
        let load = self.plant.top_load_n * self.plant.top_load_share
            + 1e-3 * self.plant.moved_mass_kg * self.drive.acceleration_mm_s2;
        let sine =
            (self.centre_radius_mm(0) - self.rig.arm_pivot_radius_mm) / self.rig.arm_length_mm;
        let lifted = (-self.plant.arm_coupling).max(0.0) * sine / libm::sqrt(1.0 - sine * sine);
        let grip = (self.plant.mu - self.control.slip_margin).max(LEAST_GRIP);
        (ROLLING_RESERVE * load * (1.0 / grip + lifted)).min(self.preload.limit_n)
    }

    /// Keys with their value and its least and largest value.
    pub const fn bounds(&self) -> [(&'static str, f64, f64, f64); 46] {
        [
            ("rig.wheel_radius_mm", self.rig.wheel_radius_mm, 10.0, 150.0),
            ("rig.wheel_wear_mm", self.rig.wheel_wear_mm, 0.0, 0.2),
            ("rig.wheel_width_mm", self.rig.wheel_width_mm, 1.0, 200.0),
            ("rig.step_height_mm", self.rig.step_height_mm, 1.5, 8.0),
            ("rig.step_tolerance_mm", self.rig.step_tolerance_mm, 0.1, 5.0),
            ("rig.travel_mm", self.rig.travel_mm, 1.0, 2000.0),
            ("rig.wall_radius_mm", self.rig.wall_radius_mm, 50.0, 1000.0),
            ("rig.arm_length_mm", self.rig.arm_length_mm, 20.0, 1000.0),
            ("rig.arm_pivot_radius_mm", self.rig.arm_pivot_radius_mm, 0.0, 500.0),
            ("tread.k_inf_pa_per_m", self.tread.k_inf_pa_per_m, 1e7, 5e10),
            ("tread.stiffening", self.tread.stiffening, 1.0, 20.0),
            ("tread.tau_s", self.tread.tau_s, 1e-3, 10.0),
            ("tread.thickness_mm", self.tread.thickness_mm, 3.0, 16.0),
            ("plant.mu", self.plant.mu, 0.0, 3.0),
            ("plant.top_load_n", self.plant.top_load_n, 0.0, 200.0),
            ("plant.top_load_share", self.plant.top_load_share, 0.0, 1.0),
            ("plant.moved_mass_kg", self.plant.moved_mass_kg, 0.01, 100.0),
            ("plant.arm_coupling", self.plant.arm_coupling, -1.0, 1.0),
            ("preload.cruise_n", self.preload.cruise_n, 5.0, 180.0),
            ("preload.limit_n", self.preload.limit_n, 5.0, 180.0),
            ("preload.spring_n_per_mm", self.preload.spring_n_per_mm, 0.1, 20.0),
            ("preload.slew_n_per_s", self.preload.slew_n_per_s, 1.0, 500.0),
            ("preload.delay_s", self.preload.delay_s, 0.0, 0.25),
            ("preload.lag_s", self.preload.lag_s, 0.005, 1.0),
            ("drive.no_load_speed_mm_s", self.drive.no_load_speed_mm_s, 5.0, 300.0),
            ("drive.stall_force_n", self.drive.stall_force_n, 5.0, 5000.0),
            ("drive.force_limit_n", self.drive.force_limit_n, 5.0, 250.0),
            ("drive.reflected_mass_kg", self.drive.reflected_mass_kg, 0.1, 1000.0),
            ("drive.cruise_speed_mm_s", self.drive.cruise_speed_mm_s, 3.0, 100.0),
            ("drive.min_crossing_speed_mm_s", self.drive.min_crossing_speed_mm_s, 0.5, 20.0),
            ("drive.acceleration_mm_s2", self.drive.acceleration_mm_s2, 5.0, 2000.0),
            ("drive.jerk_mm_s3", self.drive.jerk_mm_s3, 50.0, 30_000.0),
            ("drive.ripple_pitch_mm", self.drive.ripple_pitch_mm, 0.01, 100.0),
            ("drive.guard_band", self.drive.guard_band, 0.0, 0.5),
            ("sense.encoder_counts", self.sense.encoder_counts, 1024.0, 65_536.0),
            ("sense.preload_full_scale_n", self.sense.preload_full_scale_n, 20.0, 2000.0),
            ("sense.tread_full_scale_mm", self.sense.tread_full_scale_mm, 0.5, 50.0),
            ("sense.preload_error", self.sense.preload_error, 0.0, 0.3),
            ("sense.angle_zero_code", self.sense.angle_zero_code, 0.0, 16_383.0),
            ("sense.stale_after_s", self.sense.stale_after_s, 0.005, 1.0),
            ("control.gap_ref_mm", self.control.gap_ref_mm, 0.0, 10.0),
            ("control.safe_speed_mm_s", self.control.safe_speed_mm_s, 0.5, 100.0),
            ("control.gap_reserve", self.control.gap_reserve, 0.0, 0.5),
            ("control.slip_margin", self.control.slip_margin, 0.0, 1.0),
            ("control.adaptation_range", self.control.adaptation_range, 0.0, 0.9),
            ("control.adaptation_gain", self.control.adaptation_gain, 0.0, 1.0),
        ]
    }

    fn ranges(&self) -> Result<(), RigError> {
        let modes = self.drive.modes_hz.iter().map(|mode| ("drive.modes_hz", *mode, 0.1, 10_000.0));
        for (key, value, min, max) in self.bounds().into_iter().chain(modes) {
            // A NaN is in no range.
            if !(min..=max).contains(&value) {
                return Err(RigError::OutOfRange { key, value, min, max });
            }
        }
        Ok(())
    }

    /// Steps ascend, with the contact run of a wheel between them and before
    /// the first, and lie inside the travel.
    fn step_table(&self) -> Result<(), RigError> {
        let (value, max) = (self.rig.step_height_mm, self.rig.wheel_radius_mm);
        if max - value <= 0.0 {
            return Err(RigError::OutOfRange { key: "rig.step_height_mm", value, min: 0.5, max });
        }
        let (run, travel_mm) = (self.corner_reach_mm(), self.rig.travel_mm);
        let mut least_mm = run + 2.0 * self.rig.step_tolerance_mm;
        for (step, &position_mm) in (1..).zip(&self.rig.step_positions_mm) {
            if position_mm > travel_mm {
                return Err(RigError::StepBeyondTravel { step, position_mm, travel_mm });
            }
            // A NaN fails.
            if position_mm < least_mm || position_mm.is_nan() {
                return Err(RigError::StepOrder { step, position_mm, least_mm });
            }
            least_mm = position_mm + run + 2.0 * self.rig.step_tolerance_mm;
        }
        Ok(())
    }

    fn reach(&self) -> Result<(), RigError> {
        let min_mm = self.rig.arm_pivot_radius_mm + 0.1 * self.rig.arm_length_mm;
        let max_mm = self.rig.arm_pivot_radius_mm + 0.9 * self.rig.arm_length_mm;
        for level in [0, self.rig.step_positions_mm.len()] {
            let radius_mm = self.centre_radius_mm(level);
            if !(min_mm..=max_mm).contains(&radius_mm) {
                return Err(RigError::OutOfReach { radius_mm, min_mm, max_mm });
            }
        }
        Ok(())
    }
}
