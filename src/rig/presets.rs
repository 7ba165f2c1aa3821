//! The two rigs of the study.

use super::{ControlSettings, Drive, Geometry, Loads, Pretightener, Rig, Sensors, Tread};

impl Rig {
    /// The 1:1 prototype: one drive unit at a third of the study's loads.
    pub fn prototype() -> Self {
        Self {
            rig: Geometry {
                wheel_radius_mm: 25.0,
                wheel_wear_mm: 0.05,
                wheel_width_mm: 28.0,
                step_height_mm: 4.0,
                step_positions_mm: [18.0, 40.0, 62.0].into(),
                step_tolerance_mm: 0.8,
                travel_mm: 80.0,
                wall_radius_mm: 150.0,
                arm_length_mm: 145.0,
                arm_pivot_radius_mm: 20.0,
            },
            tread: Tread {
                k_inf_pa_per_m: 0.6044e9,
                stiffening: 4.2235,
                tau_s: 0.1059,
                thickness_mm: 8.0,
            },
            plant: Loads {
                mu: 1.1,
                top_load_n: 20.0,
                top_load_share: 1.0 / 3.0,
                moved_mass_kg: 1.0,
                arm_coupling: 1.0,
            },
            preload: Pretightener {
                cruise_n: 33.3,
                limit_n: 50.0,
                spring_n_per_mm: 1.2,
                slew_n_per_s: 25.0,
                delay_s: 0.080,
                lag_s: 0.060,
            },
            drive: Drive {
                no_load_speed_mm_s: 60.0,
                stall_force_n: 160.0,
                force_limit_n: 80.0,
                reflected_mass_kg: 40.0,
                cruise_speed_mm_s: 30.0,
                min_crossing_speed_mm_s: 1.5,
                acceleration_mm_s2: 250.0,
                jerk_mm_s3: 5000.0,
                ripple_pitch_mm: 0.1309,
                modes_hz: [163.0, 276.0].into(),
                guard_band: 0.08,
            },
            sense: Sensors {
                encoder_counts: 8192.0,
                preload_full_scale_n: 200.0,
                preload_error: 0.015,
                tread_full_scale_mm: 5.0,
                angle_zero_code: 2000.0,
                stale_after_s: 0.020,
            },
            control: ControlSettings {
                gap_ref_mm: 0.0,
                safe_speed_mm_s: 5.0,
                gap_reserve: 0.0,
                slip_margin: 0.10,
                adaptation_range: 0.25,
                adaptation_gain: 0.5,
            },
        }
    }

    /// The study's own loads: 60 N on top, 100 N of preload, 150 N at most, with a
    /// spring and a motor three times as strong.
    pub fn fe() -> Self {
        let mut rig = Self::prototype();
        rig.plant.top_load_n = 60.0;
        rig.plant.moved_mass_kg = 3.0;
        rig.preload.cruise_n = 100.0;
        rig.preload.limit_n = 150.0;
        rig.preload.spring_n_per_mm = 3.6;
        rig.preload.slew_n_per_s = 75.0;
        // At a third of the gap's range, the same tolerances weigh more.
        rig.control.gap_reserve = 0.03;
        rig.drive.stall_force_n = 480.0;
        rig.drive.force_limit_n = 240.0;
        rig.drive.reflected_mass_kg = 120.0;
        rig
    }

    /// The preset of that name: `prototype` or `fe`.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "prototype" => Some(Self::prototype()),
            "fe" => Some(Self::fe()),
            _ => None,
        }
    }
}
