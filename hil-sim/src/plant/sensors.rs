//! The sensors and the readback of the bridges: from what is true to the codes that the
//! converters give. A sensor is an entry of `SENSORS`, with its noise in [`Noise`].

use std::collections::VecDeque;
use std::f64::consts::TAU;

use documented::DocumentedFields;
use interstage::rig::Rig;
use interstage::sense::angle;
use interstage::sense::raw::{AngleFrame, BridgeCode, BridgeCodes, Sample, SensorFrame, SensorId};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::spread::{Field, Section, section};
use super::truth::Truth;

/// Form of a sensor's code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coding {
    /// A counter that wraps.
    Counter,
    /// A converter, from 0 to 65535.
    Converter,
    /// A frame of the magnetic encoder: 14 bits of angle, an error flag, even parity.
    Angle,
}

impl Coding {
    /// The code nearest to this number.
    pub(crate) fn code(self, number: f64) -> u16 {
        match self {
            Self::Counter => number.floor() as i64 as u16,
            Self::Converter => number.round().clamp(0.0, SPAN) as u16,
            Self::Angle => with_parity((number.round() as i64 & 0x3fff) as u16),
        }
    }

    /// The number of a code; none of a frame with wrong parity or the error flag.
    pub(crate) fn number(self, code: u16) -> Option<f64> {
        match self {
            Self::Counter | Self::Converter => Some(code.into()),
            Self::Angle => angle::decode(AngleFrame::new(code)).ok().map(f64::from),
        }
    }
}

/// A frame of the angle sensor, of 15 bits, with even parity on top.
pub const fn with_parity(frame: u16) -> u16 {
    frame & 0x7fff | ((frame << 1).count_ones() as u16 & 1) << 15
}

/// A sensor of the plant, and how a fault distorts it.
pub(crate) struct SensorModel {
    pub coding: Coding,
    /// The quantity that it measures.
    truth: fn(&Truth) -> f64,
    /// Age of a reading when it is handed over, s, and standard deviation of its noise.
    noise: fn(&Noise) -> (f64, f64),
    /// Its number in codes, of the quantity and its noise.
    number: fn(&SensorParameters, f64, f64) -> f64,
    /// Codes of a unit, and the code of zero.
    pub scale: fn(&Rig) -> (f64, f64),
    /// Faults: gain by default; offset by default and at most, its unit and what it does.
    pub faults: (f64, (f64, f64, &'static str, &'static str)),
}

/// Largest code of a converter.
pub(crate) const SPAN: f64 = 65_535.0;
/// Codes of a turn of the angle sensor.
pub(crate) const TURN: f64 = 16_384.0;
/// Part of the converter's range at which a bridge reads zero.
const ZERO: f64 = 0.05;
/// Part of the converter's range at which it reads full scale.
const FULL: f64 = 0.90;
/// An offset of a quantity.
pub(crate) const MORE: &str = "reads so much more than is true";

/// Number of a converter at a bridge at this part of its full scale.
fn bridge(part: f64) -> f64 {
    (ZERO + (FULL - ZERO) * part) * SPAN
}

/// Codes of a unit, and of zero, of a bridge of this full scale.
fn bridge_scale(full_scale: f64) -> (f64, f64) {
    ((FULL - ZERO) * SPAN / full_scale, ZERO * SPAN)
}

/// The number in codes at which a sensor of this rig shows so many mm, N or degrees.
pub fn encode(sensor: SensorId, rig: &Rig, value: f64) -> f64 {
    let (per_unit, zero) = (SENSORS[sensor as usize].scale)(rig);
    zero + value * per_unit
}

/// What it shows by this number.
pub fn decode(sensor: SensorId, rig: &Rig, number: f64) -> f64 {
    let (per_unit, zero) = (SENSORS[sensor as usize].scale)(rig);
    (number - zero) / per_unit
}

/// Every sensor, by [`SensorId`].
pub(crate) static SENSORS: [SensorModel; SensorId::COUNT] = [
    SensorModel {
        coding: Coding::Counter,
        truth: |t| t.rotation_rad,
        noise: |n| (0.0, n.wheel_encoder_jitter_counts),
        number: |p, rad, noise| rad / TAU * p.counts_per_turn + noise,
        scale: |rig| (rig.sense.encoder_counts / (TAU * rig.rig.wheel_radius_mm), 0.0),
        faults: (1.5, (2.0, 100.0, "mm", "jumps by so much once")),
    },
    SensorModel {
        coding: Coding::Converter,
        truth: |t| t.preload_n,
        noise: |n| (n.preload_sensor_delay_s, n.preload_sensor_n),
        number: |p, n, noise| bridge((n * p.preload_sensor_gain + noise) / p.preload_full_scale_n),
        scale: |rig| bridge_scale(rig.sense.preload_full_scale_n),
        faults: (1.2, (6.0, 200.0, "N", MORE)),
    },
    SensorModel {
        coding: Coding::Converter,
        truth: |t| t.compression_mm,
        noise: |n| (n.compression_sensor_delay_s, n.compression_sensor_mm),
        number: |p, mm, noise| bridge((mm * p.compression_gain + noise) / p.tread_full_scale_mm),
        scale: |rig| bridge_scale(rig.sense.tread_full_scale_mm),
        faults: (1.2, (0.3, 5.0, "mm", MORE)),
    },
    SensorModel {
        coding: Coding::Angle,
        truth: |t| t.arm_rad,
        noise: |n| (n.arm_angle_delay_s, n.arm_angle_lsb),
        number: |p, rad, noise| (rad + p.angle_zero_rad) / TAU * TURN + p.angle_zero_code + noise,
        scale: |rig| (TURN / 360.0, rig.sense.angle_zero_code),
        faults: (1.2, (1.0, 90.0, "deg", MORE)),
    },
];

section! {
    /// Noise of the sensors, one standard deviation, and their conversion delays.
    #[derive(Default)]
    Noise {
        /// Preload sensor, N.
        preload_sensor_n: 0.05, (0.0, 10.0);
        /// Compression sensor, mm.
        compression_sensor_mm: 0.002, (0.0, 0.5);
        /// Arm angle, steps of its 14-bit code.
        arm_angle_lsb: 0.5, (0.0, 50.0);
        /// Edges of the wheel encoder, counts.
        wheel_encoder_jitter_counts: 0.0, (0.0, 10.0);
        /// Age of a preload-sensor reading when it is handed over, s.
        preload_sensor_delay_s: 0.000_5, (0.0, 0.02);
        /// Age of a compression-sensor reading when it is handed over, s.
        compression_sensor_delay_s: 0.000_5, (0.0, 0.02);
        /// Age of an arm angle reading when it is handed over, s.
        arm_angle_delay_s: 0.000_1, (0.0, 0.02);
        /// Readback of the bridges, parts of the supply.
        readback_duty: 0.002, (0.0, 0.1);
    }
}

/// Sensors of one plant.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorParameters {
    pub counts_per_turn: f64,
    /// Full scale at 90 % of the converter, N.
    pub preload_full_scale_n: f64,
    /// Gain error factor.
    pub preload_sensor_gain: f64,
    /// Full scale at 90 % of the converter, mm.
    pub tread_full_scale_mm: f64,
    /// Gain error factor.
    pub compression_gain: f64,
    /// Code with the arm along the pillar.
    pub angle_zero_code: f64,
    pub angle_zero_rad: f64,
    /// Gain error factors of the bridges' readback: supply, divider and reference.
    pub readback_gain: [f64; 2],
    /// Its zero errors, parts of the supply.
    pub readback_zero: [f64; 2],
    /// Factor of its time constant.
    pub readback_lag: f64,
    pub noise: Noise,
}

/// The codes of one millisecond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Codes {
    /// By [`SensorId`].
    pub sensors: [u16; SensorId::COUNT],
    /// Outputs of the bridges.
    pub bridges: BridgeCodes,
}

impl Codes {
    /// Puts the codes of the sensors that are read in this tick into `frame`.
    pub fn put(&self, frame: &mut SensorFrame, at: u32) {
        for sensor in SensorId::ALL {
            if at.is_multiple_of(SensorId::PERIODS[sensor as usize]) {
                frame[sensor] = Some(Sample { code: self.sensors[sensor as usize], at });
            }
        }
        frame.bridges = Some(self.bridges);
    }
}

#[derive(Clone, Debug)]
pub struct Sensors {
    parameters: SensorParameters,
    noise: ChaCha8Rng,
    /// The quantities of the last calls, newest first.
    past: VecDeque<[f64; SensorId::COUNT]>,
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
    pub fn read(&mut self, now: &Truth, dt_s: f64) -> Codes {
        self.past.push_front(SENSORS.each_ref().map(|sensor| (sensor.truth)(now)));
        self.past.truncate(LONGEST);
        let (p, past) = (&self.parameters, &self.past);
        let sensors = SensorId::ALL.map(|sensor| {
            let (place, sensor) = (sensor as usize, &SENSORS[sensor as usize]);
            let oldest = past.len() - 1;
            let (delay_s, deviation) = (sensor.noise)(&p.noise);
            let back = (delay_s / dt_s).clamp(0.0, oldest as f64);
            let at = back as usize;
            let (newer, older) = (past[at][place], past[(at + 1).min(oldest)][place]);
            let truth = newer + (older - newer) * (back - at as f64);
            // None is drawn for a sensor without noise.
            let noise = if deviation == 0.0 {
                0.0
            } else {
                let normal: f64 = StandardNormal.sample(&mut self.noise);
                deviation * normal
            };
            sensor.coding.code((sensor.number)(p, truth, noise))
        });
        Codes { sensors, bridges: self.readback.read(now.bridges, &self.parameters, dt_s) }
    }
}
