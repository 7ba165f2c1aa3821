//! How far the plant may differ from the rig as the controller knows it, and how its
//! sensors err.

use documented::DocumentedFields;
use serde::{Deserialize, Serialize};

/// Width of the per-seed draw of the plant. Keys in `_rel` are standard deviations
/// relative to the nominal value; keys with a unit are half-widths about it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, DocumentedFields)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// Relaxed stiffness of the tread, relative.
    pub k_inf_rel: f64,
    /// Stiffening of the tread, relative.
    pub stiffening_rel: f64,
    /// Relaxation time of the tread, relative.
    pub tau_rel: f64,
    /// Friction of tread on wall, relative.
    pub mu_rel: f64,
    /// Top load, relative.
    pub top_load_rel: f64,
    /// Position of each step, mm.
    pub step_position_mm: f64,
    /// Height of each step, mm.
    pub step_height_mm: f64,
    /// Wheel radius as made, mm.
    pub wheel_radius_mm: f64,
    /// Loss of wheel radius by wear, mm: drawn from 0 to this.
    pub wear_mm: f64,
    /// Rate of the preload spring, relative.
    pub spring_rel: f64,
    /// Dead time of the pre-tightener, relative.
    pub delay_rel: f64,
    /// Lag of the pre-tightener, relative.
    pub lag_rel: f64,
    /// Largest rate of the pre-tightener, relative.
    pub slew_rel: f64,
    /// Gain of the preload sensor, relative.
    pub preload_sensor_gain_rel: f64,
    /// Gain of the compression sensor, relative.
    pub compression_sensor_gain_rel: f64,
    /// Zero of the arm angle sensor, degrees.
    pub arm_angle_zero_deg: f64,
    /// Supply of the bridges, relative.
    pub supply_rel: f64,
    /// Dividers of their readback, relative.
    pub readback_gain_rel: f64,
    /// Zero of their readback, parts of the supply: standard deviation.
    pub readback_zero_duty: f64,
    /// Time constant of their readback, relative.
    pub readback_lag_rel: f64,
}

impl Spread {
    /// That of the usual rigs.
    pub const fn usual() -> Self {
        Self {
            k_inf_rel: 0.04,
            stiffening_rel: 0.03,
            tau_rel: 0.05,
            mu_rel: 0.03,
            top_load_rel: 0.05,
            step_position_mm: 0.3,
            step_height_mm: 0.05,
            wheel_radius_mm: 0.05,
            wear_mm: 0.05,
            spring_rel: 0.05,
            delay_rel: 0.15,
            lag_rel: 0.15,
            slew_rel: 0.05,
            preload_sensor_gain_rel: 0.005,
            compression_sensor_gain_rel: 0.005,
            arm_angle_zero_deg: 0.05,
            supply_rel: 0.006,
            readback_gain_rel: 0.002,
            readback_zero_duty: 0.002,
            readback_lag_rel: 0.05,
        }
    }

    /// No spread: every seed draws the nominal plant.
    pub fn none() -> Self {
        Self::default()
    }
}

/// Noise of the sensors, one standard deviation, and their conversion delays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, DocumentedFields)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Preload sensor, N.
    pub preload_sensor_n: f64,
    /// Compression sensor, mm.
    pub compression_sensor_mm: f64,
    /// Arm angle, steps of its 14-bit code.
    pub arm_angle_lsb: f64,
    /// Edges of the wheel encoder, counts.
    pub wheel_encoder_jitter_counts: f64,
    /// Age of a preload-sensor reading when it is handed over, s.
    pub preload_sensor_delay_s: f64,
    /// Age of a compression-sensor reading when it is handed over, s.
    pub compression_sensor_delay_s: f64,
    /// Age of an arm angle reading when it is handed over, s.
    pub arm_angle_delay_s: f64,
    /// Readback of the bridges, parts of the supply.
    pub readback_duty: f64,
}

impl Noise {
    /// That of the usual sensors.
    pub const fn usual() -> Self {
        Self {
            preload_sensor_n: 0.05,
            compression_sensor_mm: 0.002,
            arm_angle_lsb: 0.5,
            wheel_encoder_jitter_counts: 0.0,
            preload_sensor_delay_s: 0.000_5,
            compression_sensor_delay_s: 0.000_5,
            arm_angle_delay_s: 0.000_1,
            readback_duty: 0.002,
        }
    }

    /// Ideal sensors: quantised, but without noise and delay.
    pub fn none() -> Self {
        Self::default()
    }
}
