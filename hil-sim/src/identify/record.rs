//! The input of identification: the sensors' readings and the bridges' duties of every
//! tick, in the units of the rig that the log names, and nothing that the plant alone
//! knows. Logs of `rig capture` and `rig deploy`, MCAP and CSV alike, have the sensors' own
//! codes of every tick, and the rig's parameters if they are known.

use std::f64::consts::TAU;
use std::path::Path;

use interstage::rig::Rig;
use interstage::sense::raw::{EncoderCount, SensorFrame, SensorId};
use interstage::supervise::Mode;

use super::IdentifyError;
use crate::plant::rig::Drives;
use crate::plant::sensors::{Coding, decode};
use crate::record::{Columns, Run};
use crate::scenario::{Direction, Scenario};

/// Longest gap in a log that is bridged by the last reading, ticks.
const LONGEST_GAP: u32 = 20;

/// One tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Wheel encoder since boot, counts, unwrapped.
    pub counts: f64,
    pub preload_n: f64,
    /// Tread compression, mm.
    pub compression_mm: f64,
    /// Arm angle from the pillar, rad, where a new frame came.
    pub arm_rad: Option<f64>,
    /// Duty of the drive, -1 to 1.
    pub drive: f64,
    /// Whether its bridge is on.
    pub drive_on: bool,
    /// Duty of the pre-tightener, -1 to 1.
    pub pretightener: f64,
    /// Whether its bridge is on.
    pub pretightener_on: bool,
}

/// A log as identification sees it.
#[derive(Clone, Debug)]
pub struct Record {
    /// Its name in messages and plots.
    pub name: String,
    /// The rig as the controller believed it to be, and how the log was made.
    pub scenario: Scenario,
    /// One a tick, without gaps.
    pub samples: Vec<Sample>,
    /// What is missing of the log, in sentences.
    pub missing: Vec<String>,
}

impl Record {
    /// Reads a log; `given` is the rig of a log without parameters.
    pub fn read(path: &Path, given: Option<&Scenario>) -> Result<Self, IdentifyError> {
        let name = path.display().to_string();
        let bad = |why| IdentifyError::Log(name.clone(), why);
        let run = Run::read(path).map_err(|error| bad(error.reason()))?;
        let mut scenario = match (&run.parameters, given) {
            (None, Some(given)) => given.clone(),
            _ => run.scenario(&[]).map_err(|error| {
                bad(format!("{error}: give the rig with --rig, --scenario or --set"))
            })?,
        };
        if let Some(row) = run.rows.iter().find(|row| row.mode().is_some_and(Mode::moves)) {
            scenario.run.direction =
                if row.retracts { Direction::Retract } else { Direction::Deploy };
        }
        let mut reader = Reader::new(&scenario);
        let sample = |row: &Columns| {
            let driven = Drives {
                drive: row.drive_duty,
                drive_on: row.drive_on,
                preload: row.pretightener_duty,
                preload_on: row.pretightener_on,
                ..Drives::default()
            };
            (row.tick, reader.sample(&row.sensors(), &driven))
        };
        let ticked: Vec<_> = run.rows.iter().map(sample).collect();
        Ok(Self { missing: run.missing(), ..Self::new(&name, scenario, ticked)? })
    }

    /// A record of samples with their ticks.
    pub fn new(
        name: &str,
        scenario: Scenario,
        ticked: impl IntoIterator<Item = (u32, Sample)>,
    ) -> Result<Self, IdentifyError> {
        let bad = |why| IdentifyError::Log(name.to_owned(), why);
        let mut samples: Vec<Sample> = Vec::new();
        let mut last: Option<u32> = None;
        for (tick, sample) in ticked {
            if let Some(before) = last {
                let gap = tick.checked_sub(before).filter(|gap| *gap > 0);
                let gap = gap.ok_or_else(|| bad(format!("tick {tick} follows tick {before}")))?;
                if gap > LONGEST_GAP {
                    return Err(bad(format!("{gap} ticks are missing before tick {tick}")));
                }
                let held = samples.last().copied().unwrap_or_default();
                let held = Sample { arm_rad: None, ..held };
                samples.extend(std::iter::repeat_n(held, gap as usize - 1));
            }
            let numbers = [
                sample.counts,
                sample.preload_n,
                sample.compression_mm,
                sample.arm_rad.unwrap_or(0.0),
                sample.drive,
                sample.pretightener,
            ];
            if numbers.iter().any(|number| !number.is_finite()) {
                return Err(bad(format!("tick {tick} holds what is no number")));
            }
            samples.push(sample);
            last = Some(tick);
        }
        Ok(Self { name: name.to_owned(), scenario, samples, missing: Vec::new() })
    }

    /// Whether the wheel goes out, onto the smaller radius.
    pub(crate) fn deploys(&self) -> bool {
        self.scenario.run.direction == Direction::Deploy
    }

    /// Where the run begins, mm.
    pub(crate) fn start_mm(&self) -> f64 {
        if self.deploys() { 0.0 } else { self.scenario.rig.rig.travel_mm }
    }
}

/// Makes samples of raw codes, tick after tick.
#[derive(Clone, Debug)]
pub struct Reader {
    rig: Rig,
    wheel: Option<EncoderCount>,
    counts: i64,
    angle_at: Option<u32>,
}

impl Reader {
    /// For the sensors of this scenario's rig.
    pub fn new(scenario: &Scenario) -> Self {
        Self { rig: scenario.rig.clone(), wheel: None, counts: 0, angle_at: None }
    }

    /// The sample of a tick: what the sensors said before it, and its duties.
    pub fn sample(&mut self, frame: &SensorFrame, driven: &Drives) -> Sample {
        if let Some(wheel) = frame.get(SensorId::WheelEncoder, EncoderCount::new) {
            let since = self.wheel.map_or_else(|| wheel.code.get() as i16, |b| wheel.code.since(b));
            self.counts += i64::from(since);
            self.wheel = Some(wheel.code);
        }
        let shown = |sensor: SensorId| {
            frame[sensor].map_or(0.0, |s| decode(sensor, &self.rig, s.code.into()))
        };
        let arm = frame[SensorId::ArmAngle];
        let new = arm.filter(|arm| self.angle_at != Some(arm.at));
        self.angle_at = arm.map(|arm| arm.at);
        // A frame that fails its parity is no reading.
        let arm_rad = new.and_then(|arm| Coding::Angle.number(arm.code)).map(|number| {
            let turned = decode(SensorId::ArmAngle, &self.rig, number) / 360.0;
            TAU * (turned - turned.round())
        });
        Sample {
            counts: self.counts as f64,
            preload_n: shown(SensorId::PreloadSensor),
            compression_mm: shown(SensorId::CompressionSensor),
            arm_rad,
            drive: driven.drive,
            drive_on: driven.drive_on,
            pretightener: driven.preload,
            pretightener_on: driven.preload_on,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(ticks: &[u32]) -> Result<Record, IdentifyError> {
        let sample = |tick: u32| Sample { counts: f64::from(tick), ..Sample::default() };
        Record::new("a", Scenario::default(), ticks.iter().map(|&tick| (tick, sample(tick))))
    }

    #[test]
    fn short_gaps_are_bridged_by_the_last_reading() {
        let record = record(&[5, 6, 9]).unwrap();
        let counts: Vec<f64> = record.samples.iter().map(|s| s.counts).collect();
        assert_eq!(counts, [5.0, 6.0, 6.0, 6.0, 9.0]);
    }

    #[test]
    fn long_gaps_and_time_that_runs_backwards_are_refused() {
        assert!(record(&[5, 60]).unwrap_err().to_string().contains("55 ticks are missing"));
        assert!(record(&[5, 5]).unwrap_err().to_string().contains("tick 5 follows tick 5"));
        let nothing = Sample { preload_n: f64::NAN, ..Sample::default() };
        let error = Record::new("a", Scenario::default(), [(3, nothing)]).unwrap_err();
        assert!(error.to_string().contains("tick 3"), "{error}");
    }

    #[test]
    fn codes_become_what_the_sensors_measure() {
        use crate::plant::sensors::SPAN;
        use interstage::sense::raw::Sample as At;
        let mut reader = Reader::new(&Scenario::default());
        let bridge = |part: f64| (part * SPAN) as u16;
        // 2000 + 2048 has seven bits: the parity bit is set.
        let codes = [65_530, bridge(0.475), bridge(0.05), 0x8000 | 4048];
        let mut frame = SensorFrame::taken(0, codes);
        let first = reader.sample(&frame, &Drives::default());
        assert_eq!(first.counts, -6.0);
        assert!((first.preload_n - 100.0).abs() < 0.005, "{}", first.preload_n);
        assert!(first.compression_mm.abs() < 1e-4);
        assert!((first.arm_rad.unwrap() - TAU / 8.0).abs() < 1e-12);
        frame[SensorId::WheelEncoder] = Some(At { code: 4, at: 1 });
        let second = reader.sample(&frame, &Drives::default());
        assert_eq!((second.counts, second.arm_rad), (4.0, None));
    }

    #[test]
    fn what_is_no_log_is_refused_in_a_line_with_its_name() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("notes.csv");
        let refused = || Record::read(&path, None).unwrap_err().to_string();
        assert!(refused().contains("notes.csv: No such file"), "{}", refused());
        std::fs::write(&path, "a,b\n1,2\n").unwrap();
        assert!(refused().contains("notes.csv: it holds no tick"), "{}", refused());
        std::fs::write(&path, "").unwrap();
        assert!(refused().contains("it holds no tick"), "{}", refused());
        std::fs::write(&path, b"\x89MCAP and no more").unwrap();
        assert!(refused().contains("notes.csv: "), "{}", refused());
    }
}
