//! All four sensors of one tick.

use super::analog::{AnalogChannel, AnalogState, Zeroing};
use super::angle::AngleSensor;
use super::arm::Arm;
use super::freshness::{LastGood, Reading, Validity};
use super::raw::{AdcCode, AngleFrame, EncoderCount, SensorFrame, SensorId};
use super::speed::{self, SpeedState, Speedometer};
use crate::rig::{Rig, RigError};
use crate::units::{
    Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons, Ratio, Seconds, TICK_HZ,
    Tick, Travel, q16,
};

/// Time constant of the low-pass of preload, compression and arm angle sensor, s. Chosen: reduces a
/// millisecond's noise to a third and costs the preload loop 5 ms beside the 140 ms of its
/// actuator; equal, so that all see a crossing with the same lag. A code of the arm angle is
/// 0.04 mm of radius: 5 ms smooths the staircase of a climb (3 mm/s, a code every 13 ms) and lags
/// it by 0.015 mm.
pub const FILTER_S: f64 = 0.005;
/// The same as machine units, s: by so much a filtered ramp is late.
pub const FILTER_LAG: Seconds = q16(5_000);

/// The four sensors in machine units.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Senses {
    wheel_encoder: Speedometer,
    preload_sensor: AnalogChannel,
    compression_sensor: AnalogChannel,
    arm_angle: AngleSensor,
    arm: Arm,
    /// Largest age of a reading, ticks.
    limit: u32,
}

/// State of [`Senses`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensesState {
    wheel_encoder: SpeedState,
    preload_sensor: AnalogState,
    compression_sensor: AnalogState,
    arm_angle: LastGood,
    level: Option<u8>,
}

/// Sensor values of one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensedState {
    /// Odometry since the first reading, mm, positive outwards, exact.
    pub travel: Travel,
    /// Speed along the sleeve, mm/s; its validity is the odometry's too.
    pub speed: Reading<MillimetresPerSecond>,
    /// Radial preload, N.
    pub preload: Reading<Newtons>,
    /// The same through its low-pass, N.
    pub preload_filtered: Newtons,
    /// Tread compression, mm.
    pub compression: Reading<Millimetres>,
    /// The same through its low-pass, mm.
    pub compression_filtered: Millimetres,
    /// Wheel centre's distance from the pillar axis, mm, by the low-pass of the angle.
    pub radius: Reading<Millimetres>,
    /// Tangent of the arm angle.
    pub tan_arm: Ratio,
    /// Wall under the wheel above the outermost one, in steps, not rounded.
    pub steps_up: Ratio,
    /// Sleeve level; valid as far as radius and compression are.
    pub level: u8,
}

impl Senses {
    /// The sensors of `rig` with the default filters.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Self::try_build_with(rig, speed::BANDWIDTH_RAD_S, FILTER_S)
    }

    /// The sensors of `rig` with a speed observer of this bandwidth, rad/s, and a low-pass of this
    /// time constant, s, for the others.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build_with(rig: &Rig, observer_rad_s: f64, filter_s: f64) -> Result<Self, RigError> {
        let (arm, sense) = (Arm::try_build(rig)?, &rig.sense);
        let channel = |key, full_scale| AnalogChannel::try_build(key, full_scale, filter_s);
        Ok(Self {
            wheel_encoder: Speedometer::try_build(rig, observer_rad_s)?,
            preload_sensor: channel("sense.preload_full_scale_n", sense.preload_full_scale_n)?,
            compression_sensor: channel("sense.tread_full_scale_mm", sense.tread_full_scale_mm)?,
            arm_angle: AngleSensor::build(sense.angle_zero_code, arm.reach, filter_s),
            arm,
            limit: libm::round(sense.stale_after_s * f64::from(TICK_HZ)) as u32,
        })
    }

    /// Largest zero correction of the preload sensor, N.
    pub const fn preload_zero_limit(&self) -> Newtons {
        self.preload_sensor.zero_limit
    }

    /// One tick: `frame` holds the latest codes, new or not; `acceleration` is that of the speed
    /// profile in this tick, mm/s^2.
    pub fn step(
        &self,
        state: &mut SensesState,
        now: Tick,
        frame: &SensorFrame,
        acceleration: MillimetresPerSecond2,
    ) -> SensedState {
        let (wheel, tread, limit) = (&self.wheel_encoder, &self.compression_sensor, self.limit);
        let counted = frame.get(SensorId::WheelEncoder, EncoderCount::new);
        let motion = wheel.step(&mut state.wheel_encoder, now, counted, acceleration, limit);
        let code = frame.get(SensorId::PreloadSensor, AdcCode::new);
        let preload = self.preload_sensor.step(&mut state.preload_sensor, now, code, limit);
        let code = frame.get(SensorId::CompressionSensor, AdcCode::new);
        let compression = tread.step(&mut state.compression_sensor, now, code, limit);
        let turned = frame.get(SensorId::ArmAngle, AngleFrame::new);
        let angle = self.arm_angle.step(&mut state.arm_angle, now, turned, limit);
        let (radius, tan_arm) = self.arm.stance(angle.filtered);
        let steps_up = self.arm.steps_up(radius, compression.filtered);
        let level = self.arm.level(state.level, steps_up);
        if angle.reading.is_usable() && compression.reading.is_usable() {
            state.level = Some(level);
        }
        SensedState {
            travel: motion.travel,
            speed: motion.speed,
            preload: preload.reading,
            preload_filtered: preload.filtered,
            compression: compression.reading,
            compression_filtered: compression.filtered,
            radius: Reading { value: radius, ..angle.reading },
            tan_arm,
            steps_up,
            level: state.level.unwrap_or(0),
        }
    }
}

impl SensedState {
    /// Validity of wheel encoder, preload sensor, compression sensor and arm angle.
    pub const fn validities(&self) -> [Validity; SensorId::COUNT] {
        let Self { speed, preload, compression, radius, .. } = self;
        [speed.validity, preload.validity, compression.validity, radius.validity]
    }
}

/// What preload and compression sensor show unloaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Zeros {
    /// Preload sensor, N.
    pub preload: Newtons,
    /// Compression sensor, mm.
    pub compression: Millimetres,
}

impl SensesState {
    /// A start with these zeros.
    pub fn with(zeros: Zeros) -> Self {
        let mut state = Self::default();
        state.preload_sensor.offset = zeros.preload;
        state.compression_sensor.offset = zeros.compression;
        state
    }

    /// The zeros that apply.
    pub const fn zeros(&self) -> Zeros {
        let (preload, compression) = (self.preload_sensor.offset, self.compression_sensor.offset);
        Zeros { preload, compression }
    }

    /// Starts taking the zero of preload and compression sensor.
    pub fn begin_zero(&mut self) {
        self.preload_sensor.begin_zero();
        self.compression_sensor.begin_zero();
    }

    /// Result of taking both zeros: none while in progress, then whether both were accepted.
    pub const fn zeroed(&self) -> Option<bool> {
        match (self.preload_sensor.zeroing, self.compression_sensor.zeroing) {
            (Zeroing::Done, Zeroing::Done) => Some(true),
            (Zeroing::Running { .. } | Zeroing::Off, _)
            | (_, Zeroing::Running { .. } | Zeroing::Off) => None,
            _ => Some(false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl SensedState {
        /// As [`SensedState::validities`], to be set.
        pub(crate) const fn validities_mut(&mut self) -> [&mut Validity; 4] {
            let Self { speed, preload, compression, radius, .. } = self;
            [
                &mut speed.validity,
                &mut preload.validity,
                &mut compression.validity,
                &mut radius.validity,
            ]
        }
    }

    /// What the sensors of the prototype give in a state of the mechanism.
    #[derive(Clone, Copy)]
    struct Truth {
        position_mm: f64,
        preload_n: f64,
        compression_mm: f64,
        radius_mm: f64,
    }

    const STOWED: Truth =
        Truth { position_mm: 0.0, preload_n: 0.0, compression_mm: 0.0, radius_mm: 125.0 };

    fn theta(radius_mm: f64) -> f64 {
        ((radius_mm - 20.0) / 145.0).asin()
    }

    fn frame(truth: &Truth, at: Tick) -> SensorFrame {
        let count_mm = 2.0 * core::f64::consts::PI * 25.0 / 8192.0;
        let counts = (truth.position_mm / count_mm).floor() as i64 as u16;
        let analog = |part: f64| (65_535.0 * (0.05 + 0.85 * part)).round() as u16;
        let angle = theta(truth.radius_mm) / (2.0 * core::f64::consts::PI) * 16_384.0 + 2000.0;
        let code = angle.round() as u16;
        let parity = (code.count_ones() % 2) as u16;
        let [preload, compression] = [truth.preload_n / 200.0, truth.compression_mm / 5.0];
        SensorFrame::taken(at, [counts, analog(preload), analog(compression), code | parity << 15])
    }

    fn build() -> Senses {
        Senses::try_build(&Rig::prototype()).expect("in range")
    }

    fn still(senses: &Senses, state: &mut SensesState, now: Tick, truth: &Truth) -> SensedState {
        senses.step(state, now, &frame(truth, now), Default::default())
    }

    #[test]
    fn every_quantity_comes_out_as_it_went_in() {
        let senses = build();
        let mut state = SensesState::default();
        let mut sensed = still(&senses, &mut state, 0, &STOWED);
        let mut truth = Truth { preload_n: 33.3, compression_mm: 0.8, ..STOWED };
        for now in 1..=3000 {
            truth.position_mm = 12.0 * f64::from(now) * 1e-3;
            truth.radius_mm = 121.8;
            sensed = still(&senses, &mut state, now, &truth);
        }
        let near = |got: crate::units::Q16, exact: f64, bound: f64| {
            let error = (got.to_num::<f64>() - exact).abs();
            assert!(error <= bound, "{got} for {exact}");
        };
        near(sensed.speed.value, 12.0, 0.02);
        near(sensed.preload.value, 33.3, 0.002);
        near(sensed.preload_filtered, 33.3, 0.002);
        near(sensed.compression.value, 0.8, 5e-5);
        near(sensed.compression_filtered, 0.8, 7e-5);
        near(sensed.radius.value, 121.8, 0.0215);
        near(sensed.tan_arm, theta(121.8).tan(), 4e-4);
        near(sensed.steps_up, 1.0, 0.006);
        assert_eq!(sensed.level, 1);
        assert!((sensed.travel.to_num::<f64>() - 36.0).abs() <= 0.02);
        assert_eq!(sensed.validities(), [Validity::Valid; 4]);
    }

    #[test]
    fn each_sensor_becomes_stale_on_its_own() {
        let senses = build();
        for silent in 0..SensorId::COUNT {
            let mut state = SensesState::default();
            let mut sensed = still(&senses, &mut state, 0, &STOWED);
            for now in 1..=21 {
                let mut mixed = frame(&STOWED, now);
                mixed.samples[silent] = frame(&STOWED, 0).samples[silent];
                sensed = senses.step(&mut state, now, &mixed, Default::default());
            }
            let mut expected = [Validity::Valid; 4];
            expected[silent] = Validity::Stale;
            assert_eq!(sensed.validities(), expected, "silent {silent}");
        }
    }

    #[test]
    fn the_level_changes_once_on_the_way_up_and_once_on_the_way_down() {
        let senses = build();
        let mut state = SensesState::default();
        let mut changes = Vec::new();
        let mut level = still(&senses, &mut state, 0, &STOWED).level;
        for now in 1..=4000_u32 {
            // Up a step and down again, trembling by 0.15 mm all the while.
            let climb = 4.0 - (f64::from(now) - 2000.0).abs() / 500.0;
            let tremble = 0.15 * (f64::from(now) * 0.01).sin();
            let truth = Truth { radius_mm: 125.0 - climb + tremble, ..STOWED };
            let sensed = still(&senses, &mut state, now, &truth);
            if sensed.level != level {
                level = sensed.level;
                changes.push((level, climb));
            }
        }
        assert_eq!(changes.iter().map(|(level, _)| *level).collect::<Vec<_>>(), [1, 0]);
        assert!((2.2..=2.6).contains(&changes[0].1), "{changes:?}");
        assert!((1.4..=1.8).contains(&changes[1].1), "{changes:?}");
    }

    #[test]
    fn one_of_angle_and_displacement_alone_changes_no_level() {
        let senses = build();
        let level = |truth: Truth, spoil: fn(&mut SensorFrame)| {
            let mut state = SensesState::default();
            still(&senses, &mut state, 0, &STOWED);
            let mut sensed = still(&senses, &mut state, 1, &STOWED);
            for now in 2..=200 {
                // What is lost is lost before anything moves.
                let mut frame = frame(if now < 100 { &STOWED } else { &truth }, now);
                spoil(&mut frame);
                sensed = senses.step(&mut state, now, &frame, Default::default());
            }
            sensed.level
        };
        let (pressed, up) =
            (Truth { compression_mm: 3.6, ..STOWED }, Truth { radius_mm: 121.0, ..STOWED });
        // Each of them shows a step while the other is sound.
        assert_eq!((level(pressed, |_| ()), level(up, |_| ())), (1, 1));
        assert_eq!(level(pressed, |frame| frame[SensorId::ArmAngle] = None), 0);
        assert_eq!(level(up, |frame| frame[SensorId::CompressionSensor] = None), 0);
    }

    #[test]
    fn zeroing_waits_for_both_and_says_when_it_failed() {
        let senses = build();
        for (preload_n, compression_mm, accepted) in
            [(2.0, 0.05, true), (20.0, 0.05, false), (2.0, 0.5, false)]
        {
            let truth = Truth { preload_n, compression_mm, ..STOWED };
            let mut state = SensesState::default();
            assert_eq!(state.zeroed(), None);
            state.begin_zero();
            for now in 0..256 {
                assert_eq!(state.zeroed(), None);
                still(&senses, &mut state, now, &truth);
            }
            assert_eq!(state.zeroed(), Some(accepted));
            if accepted {
                let sensed = still(&senses, &mut state, 256, &truth);
                assert_eq!(sensed.preload.value, Newtons::ZERO);
                assert_eq!(sensed.compression.value, Millimetres::ZERO);
            }
        }
    }
}
