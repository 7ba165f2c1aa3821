//! The four sensors and the readback of the bridges: from what is true to the codes that the
//! converters give.

use std::collections::VecDeque;

use interstage::hal::hil::Given;
use interstage::sense::raw::{AdcCode, AngleFrame, BridgeCode, BridgeCodes, EncoderCount};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::draw::SensorParameters;

/// What the sensors look at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensed {
    /// Angle the wheel has turned, rad.
    pub rotation_rad: f64,
    /// Radial preload, N.
    pub preload_n: f64,
    /// Largest tread depth, mm.
    pub depth_mm: f64,
    /// Arm angle from the pillar, rad.
    pub arm_rad: f64,
    /// Outputs of the bridges of drive and pre-tightener since the last call, parts of the
    /// nominal supply.
    pub bridges: [f64; 2],
}

/// The codes of one millisecond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Codes {
    /// Wheel encoder.
    pub wheel_encoder: EncoderCount,
    /// Preload sensor.
    pub preload_sensor: AdcCode,
    /// Tread compression.
    pub compression_sensor: AdcCode,
    /// Arm angle.
    pub arm_angle: AngleFrame,
    /// Outputs of the bridges.
    pub bridges: BridgeCodes,
}

impl From<Codes> for Given {
    fn from(codes: Codes) -> Self {
        let Codes { wheel_encoder, preload_sensor, compression_sensor, arm_angle, bridges } = codes;
        Self::codes(wheel_encoder, preload_sensor, compression_sensor, arm_angle, bridges)
    }
}

/// Sensors with their noise.
#[derive(Clone, Debug)]
pub struct Sensors {
    parameters: SensorParameters,
    noise: ChaCha8Rng,
    /// What was true at the last calls, newest first.
    past: VecDeque<Sensed>,
    readback: Readback,
}

/// The readback of the bridges, with noise of its own: what the other sensors make of a seed
/// does not depend on it.
#[derive(Clone, Debug)]
struct Readback {
    noise: ChaCha8Rng,
    /// Outputs behind the low-pass.
    lagged: [f64; 2],
}

/// Time constant of the low-pass, s, as the parts on the board have it.
const READBACK_S: f64 = 1e-3;
/// Part of the half range of the converter at which a bridge gives the nominal supply.
const SUPPLY: f64 = 0.8;

impl Readback {
    /// Codes of these outputs, each held for `dt_s` until now.
    fn read(&mut self, outputs: [f64; 2], p: &SensorParameters, dt_s: f64) -> BridgeCodes {
        let takes = -(-dt_s / (READBACK_S * p.readback_lag)).exp_m1();
        let [drive, pretightener] = [0, 1].map(|i| {
            self.lagged[i] += (outputs[i] - self.lagged[i]) * takes;
            let normal: f64 = StandardNormal.sample(&mut self.noise);
            let part = self.lagged[i] * p.readback_gain[i] + p.readback_zero[i];
            let part = part + p.noise.readback_duty * normal;
            let code = 2048.0 * (1.0 + SUPPLY * part);
            BridgeCode::new(code.round().clamp(0.0, 4095.0) as u16)
        });
        BridgeCodes { drive, pretightener }
    }
}

/// Oldest reading that may be handed over, in calls.
const LONGEST: usize = 256;

/// Part of the converter's range at which a bridge reads zero.
const ZERO: f64 = 0.05;
/// Part of the converter's range at which it reads full scale.
const FULL: f64 = 0.90;

impl Sensors {
    /// Sensors whose noise follows `seed`.
    pub fn new(parameters: SensorParameters, seed: u64) -> Self {
        // Another stream than the plant's draw, which has the seed itself.
        let noise = ChaCha8Rng::seed_from_u64(seed ^ 0x005e_4504_0153_0000);
        let readback = Readback {
            noise: ChaCha8Rng::seed_from_u64(seed ^ 0x000b_41d6_e000_0000),
            lagged: [0.0; 2],
        };
        Self { parameters, noise, past: VecDeque::new(), readback }
    }

    /// Codes of what is true now, `dt_s` after the last call; a reading handed over late
    /// is interpolated between the calls around its time.
    pub fn read(&mut self, now: Sensed, dt_s: f64) -> Codes {
        self.past.push_front(now);
        self.past.truncate(LONGEST);
        let (p, past) = (&self.parameters, &self.past);
        let aged = |of: fn(&Sensed) -> f64, delay_s: f64| {
            let oldest = past.len() - 1;
            let back = (delay_s / dt_s).clamp(0.0, oldest as f64);
            let at = back as usize;
            let (newer, older) = (of(&past[at]), of(&past[(at + 1).min(oldest)]));
            newer + (older - newer) * (back - at as f64)
        };
        let noise = &p.noise;
        let random = &mut self.noise;
        let mut normal = |deviation: f64| {
            if deviation == 0.0 {
                return 0.0;
            }
            let normal: f64 = StandardNormal.sample(random);
            deviation * normal
        };
        let preload = aged(|s| s.preload_n, noise.preload_sensor_delay_s) * p.preload_sensor_gain;
        let depth = aged(|s| s.depth_mm, noise.compression_sensor_delay_s) * p.tread_gain;
        let arm = aged(|s| s.arm_rad, noise.arm_angle_delay_s) + p.angle_zero_rad;
        let turns = now.rotation_rad / std::f64::consts::TAU;
        let counts = turns * p.counts_per_turn + normal(noise.wheel_encoder_jitter_counts);
        let preload = preload + normal(noise.preload_sensor_n);
        let depth = depth + normal(noise.compression_sensor_mm);
        let code = arm / std::f64::consts::TAU * 16_384.0
            + p.angle_zero_code
            + normal(noise.arm_angle_lsb);
        Codes {
            wheel_encoder: EncoderCount::new((counts.floor() as i64) as u16),
            preload_sensor: bridge(preload / p.preload_full_scale_n),
            compression_sensor: bridge(depth / p.tread_full_scale_mm),
            arm_angle: frame(code),
            bridges: self.readback.read(now.bridges, &self.parameters, dt_s),
        }
    }
}

/// Converter code of a bridge at this part of its full scale.
fn bridge(part: f64) -> AdcCode {
    let code = (ZERO + (FULL - ZERO) * part) * 65_535.0;
    AdcCode::new(code.round().clamp(0.0, 65_535.0) as u16)
}

/// Frame of the magnetic encoder: 14 bits of angle, no error, even parity.
fn frame(code: f64) -> AngleFrame {
    let bits = ((code.round() as i64) & 0x3fff) as u16;
    AngleFrame::new(bits | (((bits.count_ones() & 1) as u16) << 15))
}
