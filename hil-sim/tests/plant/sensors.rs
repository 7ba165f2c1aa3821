//! The emulated sensors through the firmware's own conversion.

use hil_sim::plant::rig::Truth;
use hil_sim::plant::sensors::{Codes, Noise, SensorParameters, Sensors};
use hil_sim::scenario::Scenario;
use interstage::rig::Rig;
use interstage::sense::raw::{SensorFrame, SensorId};
use interstage::sense::speed::BANDWIDTH_RAD_S;
use interstage::sense::{SensedState, Senses, SensesState, Validity};
use interstage::units::MillimetresPerSecond2;

use super::bench::{TICK_S, nominal};

/// The firmware's sensors without filters, and the plant's, ideal but for `noise`.
struct Chain {
    plant: Sensors,
    firmware: Senses,
    state: SensesState,
    now: u32,
}

impl Chain {
    fn new(noise: Noise) -> Self {
        let parameters = SensorParameters { noise, ..nominal("prototype").sensors };
        Self {
            plant: Sensors::new(parameters, 1),
            firmware: Senses::try_build_with(&Rig::prototype(), BANDWIDTH_RAD_S, 0.0).unwrap(),
            state: SensesState::default(),
            now: 0,
        }
    }

    fn read(&mut self, sensed: Truth) -> Codes {
        self.plant.read(&sensed, TICK_S)
    }

    fn sense(&mut self, sensed: Truth) -> SensedState {
        let codes = self.read(sensed);
        let at = self.now;
        let frame =
            SensorFrame { bridges: Some(codes.bridges), ..SensorFrame::taken(at, codes.sensors) };
        self.now += 1;
        let rest = MillimetresPerSecond2::from_num(0);
        self.firmware.step(&mut self.state, at, &frame, rest)
    }
}

/// Arm angle at this distance of the wheel centre from the pillar axis.
fn arm_rad(radius_mm: f64) -> f64 {
    ((radius_mm - 20.0) / 145.0).asin()
}

#[test]
fn every_quantity_comes_back_within_its_quantisation() {
    let mut chain = Chain::new(Noise::default());
    let mut offset = [0.0f64; 2];
    for i in 0..4000 {
        let part = f64::from(i) / 4000.0;
        let (preload, depth, radius) = (190.0 * part, 4.8 * part, 112.0 + 14.0 * part);
        // Forwards and back again, slowly enough for a wheel.
        let travel = 60.0 * (part * 6.0).sin();
        let seen = chain.sense(Truth {
            rotation_rad: travel / 25.0,
            preload_n: preload,
            compression_mm: depth,
            arm_rad: arm_rad(radius),
            ..Truth::default()
        });
        assert_eq!(seen.preload.validity, Validity::Valid);
        assert_eq!(seen.compression.validity, Validity::Valid);
        assert_eq!(seen.radius.validity, Validity::Valid);
        // Half a code: 0.0018 N, 45 nm, 22 um.
        let error = |got: f64, exact: f64| (got - exact).abs();
        assert!(error(seen.preload.value.to_num(), preload) < 0.0019);
        assert!(error(seen.compression.value.to_num(), depth) < 7e-5);
        let off = seen.radius.value.to_num::<f64>() - radius;
        assert!(off.abs() < 0.024, "{off} at {radius}");
        offset[0] += off;
        // A full count, 19 um, from where the wheel started.
        let off = travel - seen.travel.to_num::<f64>();
        assert!((-1e-6..0.0193).contains(&off), "{off} at {travel}");
        offset[1] += off;
    }
    // Angles are rounded to the nearest code, counts are passed.
    assert!((offset[0] / 4000.0).abs() < 1e-3, "{offset:?}");
    assert!((offset[1] / 4000.0 - 0.0096).abs() < 1e-3, "{offset:?}");
}

#[test]
fn a_reading_is_as_old_as_its_delay() {
    for ticks in [0.0, 0.4, 1.0, 3.5, 20.0] {
        let delay = ticks * TICK_S;
        let noise = Noise {
            preload_sensor_delay_s: delay,
            compression_sensor_delay_s: delay,
            arm_angle_delay_s: delay,
            ..Noise::default()
        };
        let mut chain = Chain::new(noise);
        for i in 0..200 {
            // Ramps of 0.5 N, 0.01 mm and 0.05 mm a millisecond.
            let at = f64::from(i);
            let seen = chain.sense(Truth {
                rotation_rad: 0.0,
                preload_n: 0.5 * at,
                compression_mm: 0.01 * at,
                arm_rad: arm_rad(125.0 - 0.05 * at),
                ..Truth::default()
            });
            // Before there was anything older, the oldest.
            let then = (at - ticks).max(0.0);
            let radius = 125.0 - 0.05 * then;
            assert!((seen.preload.value.to_num::<f64>() - 0.5 * then).abs() < 0.002, "{ticks}");
            assert!((seen.compression.value.to_num::<f64>() - 0.01 * then).abs() < 1e-4);
            assert!((seen.radius.value.to_num::<f64>() - radius).abs() < 0.024, "{ticks}");
        }
    }
}

#[test]
fn noise_has_its_deviation_and_no_bias() {
    let noise = Noise {
        preload_sensor_n: 0.05,
        compression_sensor_mm: 0.002,
        arm_angle_lsb: 2.0,
        ..Noise::default()
    };
    let mut chain = Chain::new(noise);
    let (count, radius) = (5000, 120.0);
    let mut sums = [(0.0, 0.0); 3];
    for _ in 0..count {
        let seen = chain.sense(Truth {
            rotation_rad: 0.0,
            preload_n: 40.0,
            compression_mm: 0.8,
            arm_rad: arm_rad(radius),
            ..Truth::default()
        });
        let off = [
            seen.preload.value.to_num::<f64>() - 40.0,
            seen.compression.value.to_num::<f64>() - 0.8,
            seen.radius.value.to_num::<f64>() - radius,
        ];
        for (sum, off) in sums.iter_mut().zip(off) {
            *sum = (sum.0 + off, sum.1 + off * off);
        }
    }
    // Two codes of angle and their rounding, as radius.
    let per_code = 145.0 * arm_rad(radius).cos() * std::f64::consts::TAU / 16_384.0;
    let angle = per_code * (4.0f64 + 1.0 / 12.0).sqrt();
    for (sum, deviation) in sums.into_iter().zip([0.05, 0.002, angle]) {
        let found = (sum.1 / f64::from(count)).sqrt();
        assert!((found / deviation - 1.0).abs() < 0.04, "{found} for {deviation}");
        assert!((sum.0 / f64::from(count)).abs() < 0.05 * deviation + per_code * 0.01);
    }
}

#[test]
fn codes_stop_at_the_converters_ends() {
    let mut chain = Chain::new(Noise::default());
    let mut codes = |preload_n| {
        let codes = chain.read(Truth { preload_n, ..Truth::default() });
        codes.sensors[SensorId::PreloadSensor as usize]
    };
    assert_eq!((codes(1e6), codes(-1e6)), (u16::MAX, 0));
}

#[test]
fn a_bridge_reads_its_output_behind_a_low_pass_within_what_the_controller_allows() {
    use interstage::supervise::{BAND, BAND_SHIFT, Lag};
    for seed in 0..50 {
        let mut scenario = Scenario::named("prototype").expect("a preset");
        scenario.run.seed = seed;
        let parameters = scenario.plant().sensors;
        let mut sensors = Sensors::new(parameters, seed);
        let mut lags = [Lag::default(); 2];
        for tick in 0..400 {
            let output = [[0.0, 1.0], [0.9, -0.3], [-1.0, 0.0]][tick / 40 % 3];
            let codes = sensors.read(&Truth { bridges: output, ..Truth::default() }, 1e-3).bridges;
            for (i, code) in [codes.drive, codes.pretightener].into_iter().enumerate() {
                let expected = lags[i].step((output[i] * 32_768.0) as i32);
                let settled = tick % 40 > 4;
                let off = (code.duty() - expected).abs();
                let band = BAND + (expected.abs() >> BAND_SHIFT);
                assert!(!settled || off <= band, "{seed} {tick}: {off} of {band}");
            }
        }
    }
}
