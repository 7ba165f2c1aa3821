//! A recording from a log: what a report shows.
//!
//! The log of a deployment on the virtual rig has the truth in it. A log that was
//! captured has what the controller believes, and nothing else is made up.

use std::path::Path;

use interstage::log::ledger::Line;
use interstage::supervise::Mode;
use interstage::tick::Event;
use interstage::units::Direction;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::complete::believe;
use super::file::{MCAP, ReadError};
use super::ledger::LedgerLine;
use super::row::Row;
use super::run::Run;
use crate::record::{self, CrossingLine, LogLine, Recording, Report, Summary};
use crate::sil;

/// Reads what a report shows from any log.
///
/// # Errors
/// [`ReadError`] if the file cannot be read or is no log.
pub fn recording(path: &Path) -> Result<Recording, ReadError> {
    let bytes =
        std::fs::read(path).map_err(|source| ReadError::File { path: path.to_owned(), source })?;
    if bytes.starts_with(MCAP)
        && let Some(recording) = with_truth(&bytes)
    {
        return Ok(recording);
    }
    Ok(believed(&Run::read(path)?))
}

/// The recording in the log of a deployment; none if there is no summary in it.
fn with_truth(bytes: &[u8]) -> Option<Recording> {
    fn read<T: DeserializeOwned>(data: &[u8]) -> Option<T> {
        serde_json::from_slice(data).ok()
    }
    let bytes = super::sound(bytes);
    let (mut recording, mut summary) = (Recording::default(), None);
    for message in
        mcap::MessageStream::new_with_options(bytes, mcap::read::Options::IgnoreEndMagic.into())
            .ok()?
    {
        let Ok(message) = message else { break };
        let data = &message.data[..];
        match message.channel.topic.as_str() {
            "/telemetry" => recording.rows.extend(read::<record::Row>(data)),
            "/summary" => summary = read::<Summary>(data),
            "/log" => {
                let line = read::<Value>(data)?;
                let text = line["message"].as_str().unwrap_or_default().to_owned();
                recording.log.push(LogLine { t_s: message.log_time as f64 / 1e9, text });
            }
            _ => {}
        }
    }
    recording.summary = summary?;
    recording.parameters = super::file::parameters(bytes).unwrap_or_default();
    Some(recording)
}

/// The recording of a log without truth.
#[must_use]
pub(crate) fn believed(run: &Run) -> Recording {
    let rows: Vec<record::Row> = run.rows.iter().map(row).collect();
    let mut summary = summary(run);
    for event in &run.events {
        let t_s = f64::from(event.at) * 1e-3;
        let report = |code, text: &str| Report { t_s, code, text: text.to_owned() };
        match event.event {
            Event::Fault(fault) => summary.faults.push(report(fault.code(), fault.sentence())),
            Event::Limit(limit) => summary.limits.push(report(limit.code(), limit.sentence())),
            _ => {}
        }
    }
    summary.completed &= summary.faults.is_empty();
    summary.crossings = run.ledger.iter().map(|line| crossing(run, line)).collect();
    let lines = run.events.iter();
    let log = lines
        .map(|entry| LogLine { t_s: f64::from(entry.at) * 1e-3, text: sil::text(&entry.event) })
        .collect();
    let parameters = run.parameters.clone().unwrap_or_default();
    Recording { summary, rows, log, parameters, ..Recording::default() }
}

fn row(row: &Row) -> record::Row {
    let mut place = record::Row { t_s: row.t_s, ..record::Row::unknown() };
    believe(&mut place, row);
    place.vibration_um = row.vibration_mm * 1e3;
    place
}

/// What the controller's own word tells of a run.
fn summary(run: &Run) -> Summary {
    let mode = |row: &Row| row.telemetry().map(|seen| seen.mode);
    let moves = |row: &&Row| mode(row).is_some_and(Mode::moves);
    let (first, last) = (run.rows.iter().find(moves), run.rows.iter().rfind(moves));
    let retracts = first.and_then(mode).is_some_and(|mode| {
        matches!(mode, Mode::Run(Direction::Retract, _) | Mode::Stopping(Direction::Retract))
    });
    let moving: Vec<&Row> = run.rows.iter().filter(moves).collect();
    let preload: f64 = moving.iter().map(|row| row.preload_n).sum();
    let between = |of: fn(&Row) -> f64| match (first, last) {
        (Some(first), Some(last)) => of(last) - of(first),
        _ => 0.0,
    };
    let header = run.header.clone().unwrap_or_default();
    let unknown = f64::NAN;
    Summary {
        completed: run
            .rows
            .last()
            .and_then(mode)
            .is_some_and(|mode| matches!(mode, Mode::Complete(_))),
        target: format!("log of version {}, build {}", header.version, header.build),
        controller: "recorded".to_owned(),
        direction: if retracts { "retract" } else { "deploy" }.to_owned(),
        rig: header.rig,
        duration_s: between(|row| row.t_s),
        total_s: run.rows.last().map_or(0.0, |row| row.t_s),
        travel_mm: between(|row| row.position_mm).abs(),
        gap_ref_mm: unknown,
        max_gap_mm: unknown,
        slip_mm: unknown,
        mean_preload_n: preload / moving.len() as f64,
        energy_j: unknown,
        wear_j: unknown,
        real_time_factor: 1.0,
        ..Summary::default()
    }
}

/// The line of a crossing as the controller saw it; its instants by the contact stage.
fn crossing(run: &Run, line: &Line) -> CrossingLine {
    let told = LedgerLine::from(line);
    let closed = run.rows.partition_point(|row| row.tick <= line.at);
    let on_corner = |row: &Row| (3..=5).contains(&row.stage);
    let end = run.rows[..closed].iter().rposition(on_corner).map_or(closed, |place| place + 1);
    let begin =
        run.rows[..end].iter().rposition(|row| !on_corner(row)).map_or(0, |place| place + 1);
    let span = &run.rows[begin..end.max(begin)];
    let touch = span.first();
    let lift = span.iter().find(|row| Some(row.stage) != touch.map(|first| first.stage));
    CrossingLine {
        index: told.index,
        speed_mm_s: told.speed_mm_s,
        preload_n: told.preload_n,
        gap_mm: f64::NAN,
        gap_predicted_mm: Some(told.gap_predicted_mm),
        gap_measured_mm: Some(told.gap_measured_mm),
        corner_force_n: f64::NAN,
        lead_time_s: Some(told.lead_time_s),
        // The ledger's has creep and tolerances in it.
        slip_mm: f64::NAN,
        touch_s: touch.map_or(told.t_s, |row| row.t_s),
        lift_s: lift.or(span.last()).map_or(told.t_s, |row| row.t_s),
        step_mm: told.step_found_mm - told.residual_mm,
        step_found_mm: Some(told.step_found_mm),
        peak_preload_n: told.peak_preload_n,
        peak_utilisation: f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::write_mcap;
    use crate::scenario::Scenario;

    fn run() -> Recording {
        let options = sil::Options { rows: true, ..sil::Options::default() };
        sil::run(&Scenario::default(), options).unwrap()
    }

    #[test]
    fn the_log_of_a_deployment_gives_its_recording_back() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log.mcap");
        let written = run();
        write_mcap(&written, &path).unwrap();
        let read = recording(&path).unwrap();
        assert_eq!(read.summary, written.summary);
        assert_eq!(format!("{:?}", read.rows), format!("{:?}", written.rows));
        assert_eq!(read.log.len(), written.log.len());
        for (read, written) in read.log.iter().zip(&written.log) {
            assert_eq!(read.text, written.text);
            assert!((read.t_s - written.t_s).abs() < 1e-9);
        }
        assert_eq!(read.parameters, written.parameters);
    }

    #[test]
    fn a_log_without_truth_shows_what_the_controller_believes() {
        let truth = run();
        let believed = believed(&Run::of_stream(&truth.stream));
        assert!(believed.summary.completed);
        assert!((believed.summary.duration_s - truth.summary.duration_s).abs() < 2e-3);
        assert_eq!(believed.summary.crossings.len(), 3);
        for (seen, real) in believed.summary.crossings.iter().zip(&truth.summary.crossings) {
            assert_eq!(seen.gap_measured_mm, real.gap_measured_mm);
            assert!(seen.gap_mm.is_nan());
            assert!((seen.touch_s - real.touch_s).abs() < 0.2, "{} {}", seen.touch_s, real.touch_s);
            assert!((seen.lift_s - real.lift_s).abs() < 0.1, "{} {}", seen.lift_s, real.lift_s);
            assert!((seen.step_mm - real.step_mm).abs() < 0.5);
        }
        assert_eq!(believed.log, truth.log);
        let page = crate::report::html(&believed);
        assert!(page.contains("Deployed") && !page.contains("NaN"), "{}", &page[..2000]);
    }
}
