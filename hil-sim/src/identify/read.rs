//! Records out of logs: those of `rig capture` and `rig deploy`, MCAP and CSV alike, have the
//! sensors' own codes of every tick, and the rig's parameters if they are known.

use std::path::Path;

use super::IdentifyError;
use super::record::{Reader, Record};
use crate::plant::rig::Drives;
use crate::record::Run;
use crate::scenario::Scenario;

impl Record {
    /// Reads a log; `scenario` is the rig's where the log does not say.
    ///
    /// # Errors
    /// [`IdentifyError::Log`] if it cannot be read or is no log of a run.
    pub fn read(path: &Path, scenario: &Scenario) -> Result<Self, IdentifyError> {
        let name = path.display().to_string();
        let run = Run::read(path)
            .map_err(|error| IdentifyError::Log { name: name.clone(), why: error.reason() })?;
        of_codes(&name, run, scenario)
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
    let ticked = run.rows.iter().map(|row| {
        let driven = Drives {
            drive: row.drive_duty,
            drive_on: row.drive_on,
            preload: row.pretightener_duty,
            preload_on: row.pretightener_on,
            ..Drives::default()
        };
        (row.tick, reader.sample(&row.sensors(), &driven))
    });
    let ticked: Vec<_> = ticked.collect();
    Record::new(name, scenario, ticked)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{write_csv, write_mcap};
    use crate::session;

    #[test]
    fn both_files_of_a_run_give_what_the_sensors_said() {
        let mut scenario = Scenario::default();
        scenario.run.seed = 3;
        let directory = tempfile::tempdir().unwrap();
        let recording =
            session::run(&scenario, session::Options { rows: true, ..session::Options::default() })
                .unwrap();
        let (csv, mcap) = (directory.path().join("log.csv"), directory.path().join("log.mcap"));
        write_csv(&recording, &csv).unwrap();
        write_mcap(&recording, &mcap).unwrap();
        let [csv, mcap] = [csv, mcap].map(|path| Record::read(&path, &scenario).unwrap());
        assert_eq!(csv.samples.len(), mcap.samples.len());
        assert_eq!(mcap.scenario, scenario);
        assert_eq!(csv.samples, mcap.samples);

        let mut session = session::Session::new(&scenario, session::Options::default()).unwrap();
        let mut reader = Reader::new(&scenario);
        let mut start = Some(interstage::supervise::Command::Start);
        for coded in &mcap.samples {
            let idle = session.mode() == interstage::supervise::Mode::Idle;
            let command = if idle { start.take() } else { None };
            let frame = session.sense();
            let output = session.advance(&frame, command).unwrap();
            let sample = reader.sample(&frame, &session::drives(output.drive, output.preload));
            assert_eq!(&sample, coded, "the codes are the sensors' own");
        }
    }

    #[test]
    fn what_is_no_log_is_told_in_a_line_with_its_name() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("notes.csv");
        let refused = || Record::read(&path, &Scenario::default()).unwrap_err().to_string();
        assert!(refused().contains("notes.csv: No such file"), "{}", refused());
        std::fs::write(&path, "a,b\n1,2\n").unwrap();
        assert!(refused().contains("notes.csv: it holds no tick"), "{}", refused());
        std::fs::write(&path, "").unwrap();
        assert!(refused().contains("it holds no tick"), "{}", refused());
        std::fs::write(&path, b"\x89MCAP and no more").unwrap();
        assert!(refused().contains("notes.csv: "), "{}", refused());
    }
}
