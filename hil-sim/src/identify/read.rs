//! Records out of logs: those of `rig capture` and `log.mcap` of `rig deploy` have the
//! sensors' own codes of every tick, and the rig's parameters if they are known.
//!
//! A `log.csv` of `rig deploy` holds the controller's estimates. Encoder counts are then
//! the differences of its odometry without its corrections at the steps: those are no
//! whole number of counts, or no travel that the wheel can have made at its speed.

use std::path::Path;

use serde::Deserialize;

use super::IdentifyError;
use super::record::{Reader, Record, Sample, TICK_S};
use crate::log::Run;
use crate::plant::rig::Drives;
use crate::scenario::Scenario;

/// First bytes of an MCAP file.
const MCAP: &[u8] = b"\x89MCAP";
/// Lag of the arm's filter in the controller, s.
const ARM_FILTER_S: f64 = 0.005;
/// Deviation from whole counts beyond which the odometry was corrected, counts.
const CORRECTED: f64 = 0.05;
/// Deviation from the travel at the estimated speed beyond which it was corrected, counts:
/// a count may come or not, and the estimate swings when the load does.
const LEAPT: f64 = 2.5;
/// Modes in which a bridge is on: the pre-tightener's, and the drive's.
const PRELOAD_MODES: std::ops::RangeInclusive<u8> = 4..=9;
const DRIVE_MODES: std::ops::RangeInclusive<u8> = 5..=9;

/// What is needed of a row.
#[derive(Clone, Copy, Debug, Deserialize)]
struct Line {
    t_s: f64,
    mode: u8,
    position_est_mm: f64,
    speed_est_mm_s: f64,
    preload_meas_n: f64,
    radius_est_mm: f64,
    compression_meas_mm: f64,
    drive_duty: f64,
    preload_duty: f64,
}

impl Record {
    /// Reads a log; `scenario` is the rig's where the log does not say.
    ///
    /// # Errors
    /// [`IdentifyError::Log`] if it cannot be read or is no log of a run.
    pub fn read(path: &Path, scenario: &Scenario) -> Result<Self, IdentifyError> {
        let name = path.display().to_string();
        let bad = |why: String| IdentifyError::Log { name: name.clone(), why };
        let bytes = std::fs::read(path).map_err(|error| bad(error.to_string()))?;
        match Run::read(path) {
            Ok(run) => return of_codes(&name, run, scenario),
            Err(error) if bytes.starts_with(MCAP) => {
                let why = error.to_string();
                return Err(bad(why.trim_start_matches(&format!("{name}: ")).to_owned()));
            }
            Err(_) => {}
        }
        let rows = csv::Reader::from_reader(&bytes[..]).into_deserialize();
        let lines: Vec<Line> = rows
            .collect::<Result<_, _>>()
            .map_err(|error: csv::Error| bad(format!("no log of a run: {error}")))?;
        if lines.is_empty() {
            return Err(bad("it holds no row".into()));
        }
        let mut record = Self::new(&name, scenario.clone(), samples(&lines, scenario))?;
        record.arm_delay_s += ARM_FILTER_S;
        Ok(record)
    }
}

/// The record of a log with the sensors' codes.
fn of_codes(name: &str, run: Run, scenario: &Scenario) -> Result<Record, IdentifyError> {
    let scenario = match run.parameters {
        Some(text) => Scenario::parse(name, &text, &[]).map_err(|error| IdentifyError::Log {
            name: name.to_owned(),
            why: error.to_string(),
        })?,
        None => scenario.clone(),
    };
    let mut reader = Reader::new(&scenario);
    let ticked: Vec<_> = run
        .rows
        .iter()
        .map(|row| {
            let driven = Drives {
                drive: row.drive_duty,
                drive_on: row.drive_on,
                preload: row.preload_duty,
                preload_on: row.preload_on,
                ..Drives::default()
            };
            (row.tick, reader.sample(&row.sensors(), &driven))
        })
        .collect();
    Record::new(name, scenario, ticked)
}

fn samples(lines: &[Line], scenario: &Scenario) -> Vec<(u32, Sample)> {
    let rig = &scenario.rig;
    let count_mm = std::f64::consts::TAU * rig.rig.wheel_radius_mm / rig.sense.encoder_counts;
    let mut counts = 0.0;
    let mut before: Option<&Line> = None;
    lines
        .iter()
        .map(|line| {
            if let Some(before) = before {
                let moved = (line.position_est_mm - before.position_est_mm) / count_mm;
                let whole = moved.round();
                // Corrected: the speed gives what the wheel did meanwhile.
                let expected = line.speed_est_mm_s * TICK_S / count_mm;
                let corrected =
                    (moved - whole).abs() > CORRECTED || (moved - expected).abs() > LEAPT;
                let turned = if corrected { expected.round() } else { whole };
                counts += turned;
            }
            before = Some(line);
            let sine = (line.radius_est_mm - rig.rig.arm_pivot_radius_mm) / rig.rig.arm_length_mm;
            let sample = Sample {
                counts,
                preload_n: line.preload_meas_n,
                compression_mm: line.compression_meas_mm,
                arm_rad: Some(sine.clamp(-1.0, 1.0).asin()),
                drive: line.drive_duty,
                drive_on: DRIVE_MODES.contains(&line.mode),
                pretightener: line.preload_duty,
                pretightener_on: PRELOAD_MODES.contains(&line.mode),
            };
            ((line.t_s / TICK_S).round() as u32, sample)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::MODE_NAMES;
    use crate::{export, sil};

    #[test]
    fn the_modes_are_those_of_the_rows() {
        assert_eq!(MODE_NAMES[usize::from(*PRELOAD_MODES.start())], "preload");
        assert_eq!(MODE_NAMES[usize::from(*DRIVE_MODES.start())], "cruise");
        assert_eq!(MODE_NAMES[usize::from(*DRIVE_MODES.end())], "stopping");
    }

    #[test]
    fn both_files_of_a_run_give_what_the_sensors_said() {
        let mut scenario = Scenario::default();
        scenario.run.seed = 3;
        let directory = tempfile::tempdir().unwrap();
        let recording =
            sil::run(&scenario, sil::Options { rows: true, ..sil::Options::default() }).unwrap();
        let (csv, mcap) = (directory.path().join("log.csv"), directory.path().join("log.mcap"));
        export::write_csv(&recording, &csv).unwrap();
        export::write_mcap(&recording, &mcap).unwrap();
        let [csv, mcap] = [csv, mcap].map(|path| Record::read(&path, &scenario).unwrap());
        assert_eq!(csv.samples.len(), mcap.samples.len());
        assert_eq!(mcap.scenario, scenario);
        // The filter is the controller's.
        assert!(csv.arm_delay_s > mcap.arm_delay_s);

        let mut session = sil::Session::new(&scenario, sil::Options::default()).unwrap();
        let mut reader = Reader::new(&scenario);
        let mut start = Some(interstage::supervise::Command::Start);
        for (read, coded) in csv.samples.iter().zip(&mcap.samples) {
            let idle = session.mode() == interstage::supervise::Mode::Idle;
            let command = if idle { start.take() } else { None };
            let frame = session.sense();
            let output = session.advance(&frame, command).unwrap();
            let sample = reader.sample(&frame, &sil::drives(output.drive, output.preload));
            assert_eq!(&sample, coded, "the codes are the sensors' own");
            assert!((sample.counts - read.counts).abs() <= 2.0, "{sample:?} {read:?}");
            // The controller has taken its zeros.
            assert!((sample.preload_n - read.preload_n).abs() < 0.5);
            assert_eq!(sample.drive_on, read.drive_on);
            assert_eq!(sample.pretightener_on, read.pretightener_on);
            assert!((sample.pretightener - read.pretightener).abs() < 1e-9);
        }
    }

    #[test]
    fn what_is_no_log_is_told_in_a_line_with_its_name() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("notes.csv");
        let refused = || Record::read(&path, &Scenario::default()).unwrap_err().to_string();
        assert!(refused().contains("notes.csv: No such file"), "{}", refused());
        std::fs::write(&path, "a,b\n1,2\n").unwrap();
        assert!(refused().contains("notes.csv: no log of a run: "), "{}", refused());
        std::fs::write(&path, "").unwrap();
        assert!(refused().contains("it holds no row"), "{}", refused());
        std::fs::write(&path, b"\x89MCAP and no more").unwrap();
        assert!(refused().contains("notes.csv: "), "{}", refused());
    }
}
