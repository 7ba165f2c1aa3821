//! A faulty sensor: distorts its code before the controller gets it.
//!
//! Every sensor is a number in codes, the wheel encoder's counter without its wrap. A fault
//! changes that number alike for all.

use std::collections::VecDeque;

use interstage::rig::Rig;
use interstage::sense::raw::{BridgeCode, BridgeCodes, EncoderCount, SensorFrame};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::plant::sensors::{Coding, SENSORS};
use crate::scenario::injection::{Kind, Target};

/// Largest code of a bridge, and the codes of a duty of one.
const BRIDGE: (f64, f64) = (4095.0, 32_768.0 / BridgeCode::DUTY as f64);
/// Rounding error of sums of milliseconds, s.
const TIME_S: f64 = 1e-6;
/// Period of an intermittent contact, s.
const PERIOD_S: f64 = 0.1;

#[derive(Clone, Debug)]
pub(super) struct FaultySensor {
    target: Target,
    kind: Kind,
    /// In codes where the kind has it in the sensor's unit.
    magnitude: f64,
    /// Code at which the sensor reads zero.
    zero: f64,
    /// Counter of the encoder before, and without its wrap.
    counter: Option<(EncoderCount, i64)>,
    /// The last true reading, s and codes.
    last: Option<(f64, f64)>,
    /// The true reading when the fault began.
    first: Option<f64>,
    filtered: f64,
    past: VecDeque<(f64, f64)>,
    /// The last sample before the fault, given while none comes.
    held: SensorFrame,
}

impl FaultySensor {
    /// A sensor of `rig`, or a readback.
    pub(super) fn new(target: Target, kind: Kind, magnitude: f64, rig: &Rig) -> Self {
        let (per_unit, zero) = match target {
            Target::Sensor(sensor) => (SENSORS[sensor as usize].scale)(rig),
            _ => (BRIDGE.1, f64::from(BridgeCode::CENTRE)),
        };
        let magnitude = if kind == Kind::Offset { magnitude * per_unit } else { magnitude };
        Self {
            target,
            kind,
            magnitude,
            zero,
            counter: None,
            last: None,
            first: None,
            filtered: 0.0,
            past: VecDeque::new(),
            held: SensorFrame::default(),
        }
    }

    /// Puts the faulty code into `frame`, `since_s` after the fault began; without a fault
    /// nothing is changed.
    pub(super) fn read(
        &mut self,
        frame: &mut SensorFrame,
        t_s: f64,
        since_s: Option<f64>,
        random: &mut ChaCha8Rng,
    ) {
        let truth = self.code(frame);
        let Some(since_s) = since_s else {
            (self.held, self.first) = (*frame, None);
            if let Some(truth) = truth {
                self.filtered = truth;
                self.remember(t_s, truth);
            }
            return;
        };
        let Some(truth) = truth else { return };
        let silent = match self.kind {
            Kind::Off => true,
            Kind::Intermittent => since_s % PERIOD_S < self.magnitude * PERIOD_S,
            _ => false,
        };
        if silent {
            self.silence(frame);
            return;
        }
        self.held = *frame;
        if self.kind == Kind::Garbage {
            let code: u16 = random.random();
            self.put(frame, code);
            return;
        }
        let first = *self.first.get_or_insert(self.last.map_or(truth, |(_, code)| code));
        let given = match self.kind {
            Kind::Stuck => first,
            // The counter has no zero of its own: it goes wrong from where it was.
            Kind::Gain if self.counter.is_some() => first + (truth - first) * self.magnitude,
            Kind::Gain => self.zero + (truth - self.zero) * self.magnitude,
            Kind::Offset => truth + self.magnitude,
            Kind::Slow => {
                let dt_s = self.last.map_or(0.0, |(before_s, _)| t_s - before_s);
                self.filtered += (truth - self.filtered) * -(-dt_s / self.magnitude).exp_m1();
                self.filtered
            }
            Kind::Delayed => self.late(t_s),
            _ => truth,
        };
        self.remember(t_s, truth);
        self.write(frame, given);
    }

    fn remember(&mut self, t_s: f64, truth: f64) {
        self.last = Some((t_s, truth));
        if self.kind == Kind::Delayed {
            self.past.push_back((t_s, truth));
            while self.past.get(1).is_some_and(|(at_s, _)| *at_s <= t_s - self.magnitude + TIME_S) {
                self.past.pop_front();
            }
        }
    }

    /// The true reading so long ago.
    fn late(&self, t_s: f64) -> f64 {
        let due = |(at_s, _): &&(f64, f64)| *at_s <= t_s - self.magnitude + TIME_S;
        let then = self.past.iter().rev().find(due).or(self.past.front());
        then.map_or(0.0, |(_, code)| *code)
    }

    /// The sensor's number in this frame; none before the first, or if it is invalid.
    fn code(&mut self, frame: &SensorFrame) -> Option<f64> {
        let Target::Sensor(sensor) = self.target else {
            let mut codes = frame.bridges?;
            return Some(readback(self.target, &mut codes).map_or(0.0, |code| code.get().into()));
        };
        let code = frame[sensor]?.code;
        let coding = SENSORS[sensor as usize].coding;
        if coding != Coding::Counter {
            return coding.number(code);
        }
        let count = EncoderCount::new(code);
        let (before, sum) = self.counter.unwrap_or((count, i64::from(code)));
        let sum = sum + i64::from(count.since(before));
        self.counter = Some((count, sum));
        Some(sum as f64)
    }

    /// Puts in the code nearest to this number.
    fn write(&self, frame: &mut SensorFrame, number: f64) {
        let code = match self.target {
            Target::Sensor(sensor) => SENSORS[sensor as usize].coding.code(number),
            _ => number.round().clamp(0.0, BRIDGE.0) as u16,
        };
        self.put(frame, code);
    }

    fn put(&self, frame: &mut SensorFrame, code: u16) {
        if let Target::Sensor(sensor) = self.target {
            frame[sensor].iter_mut().for_each(|sample| sample.code = code);
        } else if let Some(old) =
            frame.bridges.as_mut().and_then(|codes| readback(self.target, codes))
        {
            *old = BridgeCode::new(code & 0xFFF);
        }
    }

    /// Gives the sample before again.
    fn silence(&self, frame: &mut SensorFrame) {
        match self.target {
            Target::Sensor(sensor) => frame[sensor] = self.held[sensor],
            _ => frame.bridges = None,
        }
    }
}

/// The code of the bridge that this target is about; none for both.
fn readback(target: Target, codes: &mut BridgeCodes) -> Option<&mut BridgeCode> {
    match target {
        Target::DriveReadback => Some(&mut codes.drive),
        Target::PretightenerReadback => Some(&mut codes.pretightener),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use interstage::sense::raw::{Sample, SensorId};
    use rand::SeedableRng;

    use super::*;
    use crate::plant::sensors::{decode, encode};

    /// What the controller gets of a preload sensor that reads 10, 11, 12 ... N a millisecond.
    fn given(kind: Kind, magnitude: f64) -> Vec<f64> {
        let (rig, preload) = (Rig::prototype(), SensorId::PreloadSensor);
        let mut sensor = FaultySensor::new(Target::Sensor(preload), kind, magnitude, &rig);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        (0..40u32)
            .map(|tick| {
                let code = encode(preload, &rig, 10.0 + f64::from(tick)).round() as u16;
                let mut frame = SensorFrame::default();
                frame[preload] = Some(Sample { code, at: tick });
                let t_s = f64::from(tick) * 1e-3;
                let since_s = (tick >= 20).then_some(t_s - 0.020);
                sensor.read(&mut frame, t_s, since_s, &mut random);
                let sample = frame[preload].expect("a sample");
                if sample.at < tick {
                    return f64::NAN;
                }
                decode(preload, &rig, sample.code.into())
            })
            .collect()
    }

    #[test]
    fn a_sensor_is_intact_until_its_fault_comes() {
        for kind in [Kind::Off, Kind::Stuck, Kind::Garbage, Kind::Gain, Kind::Slow, Kind::Delayed] {
            for (tick, force) in given(kind, 0.01).iter().take(20).enumerate() {
                assert!((force - 10.0 - tick as f64).abs() < 0.01, "{kind:?} {tick} {force}");
            }
        }
    }

    #[test]
    fn a_readback_is_wrong_about_its_bridge_alone_and_falls_silent_with_both() {
        let rig = Rig::prototype();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let codes = BridgeCodes { drive: BridgeCode::of(3277), pretightener: BridgeCode::of(0) };
        let mut given = |target, kind, magnitude| {
            let mut sensor = FaultySensor::new(target, kind, magnitude, &rig);
            let mut frame = SensorFrame { bridges: Some(codes), ..SensorFrame::default() };
            sensor.read(&mut frame, 0.0, None, &mut random);
            sensor.read(&mut frame, 1e-3, Some(0.0), &mut random);
            frame.bridges
        };
        assert_eq!(given(Target::Readback, Kind::Off, 0.0), None);
        let off = given(Target::DriveReadback, Kind::Offset, 0.1).expect("a code");
        assert!((off.drive.duty() - 6554).abs() <= BridgeCode::DUTY, "{off:?}");
        assert_eq!(off.pretightener, codes.pretightener);
        let gain = given(Target::PretightenerReadback, Kind::Gain, 5.0).expect("a code");
        assert_eq!(gain, codes, "nothing is nothing at any gain");
    }

    #[test]
    fn each_kind_distorts_in_its_own_way() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 0.02, "{a} {b}");
        assert!(given(Kind::Off, 0.0)[20..].iter().all(|force| force.is_nan()));
        given(Kind::Stuck, 0.0)[20..].iter().for_each(|force| near(*force, 29.0));
        near(given(Kind::Gain, 1.2)[30], 48.0);
        near(given(Kind::Offset, -5.0)[30], 35.0);
        near(given(Kind::Delayed, 0.005)[30], 35.0);
        // A ramp through a low-pass lags by its time constant.
        let slow = given(Kind::Slow, 0.002)[39];
        assert!((46.5..48.5).contains(&slow), "{slow}");
        let part = given(Kind::Intermittent, 0.1);
        assert!(part[25].is_nan() && part[35] > 44.0, "{part:?}");
        let garbage = given(Kind::Garbage, 0.0);
        assert!(garbage[20..].iter().filter(|f| (**f - 40.0).abs() > 20.0).count() > 10);
    }
}
