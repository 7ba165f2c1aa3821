//! Makes the recordings that a report shows from a log, one of each start of the target.
//!
//! The log of a deployment on the virtual rig contains the plant's truth. A captured log has
//! the controller's estimates alone; what is unknown there is `NaN`.

use std::collections::HashMap;
use std::path::Path;

use interstage::log::ledger::Line;
use interstage::model::Planner;
use interstage::model::plan::PLAN_TICKS;
use interstage::supervise::Mode;
use mcap::records::Record;
use serde_json::Value;

use super::read::{CSV, MCAP, ReadError, content, parameters, records};
use super::recorder::restart_words;
use super::row::MOVES;
use super::{
    Columns, CrossingLine, LedgerLine, LogLine, Recording, Row, Run, RunRecorder, Summary,
};
use crate::scenario::Direction;
use crate::table::counted;

/// Reads the recordings of any log: of each start of the target, as its clock begins anew there.
pub fn recordings(path: &Path) -> Result<Vec<Recording>, ReadError> {
    let bytes = content(path)?;
    if bytes.starts_with(CSV) {
        return Err(ReadError::Table(path.display().to_string()));
    }
    let mut strange = Vec::new();
    if bytes.starts_with(MCAP)
        && let Some(recording) = with_truth(&bytes, &mut strange)
    {
        return Ok(vec![recording]);
    }
    let mut recordings = boots(&Run::read(path)?);
    recordings.iter_mut().for_each(|one| one.summary.missing.extend_from_slice(&strange));
    Ok(recordings)
}

/// The recording in the log of a deployment; none if there is no summary in it, or none that
/// this version reads. What it does not read is told in `strange`.
fn with_truth(bytes: &[u8], strange: &mut Vec<String>) -> Option<Recording> {
    let (mut recording, mut summary, mut topics) = (Recording::default(), None, HashMap::new());
    let mut left_out = (0, None);
    let end = records(bytes, |record| match record {
        Record::Channel(channel) => drop(topics.insert(channel.id, channel.topic)),
        Record::Metadata(metadata) => recording.parameters.extend(parameters(&metadata)),
        Record::Message { header, data } => match topics.get(&header.channel_id).map(|t| &**t) {
            Some("/tick") => match serde_json::from_slice::<Row>(&data) {
                Ok(tick) => recording.rows.push(tick),
                Err(why) => left_out = (left_out.0 + 1, left_out.1.take().or(Some(why))),
            },
            Some("/summary") => summary = Some(serde_json::from_slice::<Summary>(&data)),
            Some("/log") => {
                let text = serde_json::from_slice::<Value>(&data).unwrap_or_default();
                let text = text["message"].as_str().unwrap_or_default().to_owned();
                recording.log.push(LogLine { t_s: header.log_time as f64 / 1e9, text });
            }
            _ => {}
        },
        _ => {}
    });
    if let (count, Some(why)) = left_out {
        strange.push(format!("{} of another version left out: {why}", counted(count, "tick")));
    }
    match summary.filter(|_| end.is_complete)? {
        Ok(summary) => recording.summary = summary,
        Err(why) => {
            let what = "the truth, which another version has written";
            strange.push(format!("{what}: its summary: {why}"));
            return None;
        }
    }
    recording.summary.missing.append(strange);
    Some(recording)
}

/// The recordings of a log without truth; each says what restarted the target behind it.
fn boots(run: &Run) -> Vec<Recording> {
    let boots: Vec<Run> = (0..=run.boots.len()).map(|boot| run.since_boot(boot)).collect();
    let mut recordings: Vec<Recording> = boots.iter().map(measured).collect();
    for (recording, next) in recordings.iter_mut().zip(boots.iter().skip(1)) {
        let cause = next.restart();
        recording.summary.restart =
            Some(cause.map_or_else(|| "no cause in the log".to_owned(), restart_words));
    }
    recordings
}

/// The recording of a start of the target: what the controller measured.
fn measured(run: &Run) -> Recording {
    let scenario = run.scenario(&[]).ok();
    let mut recorder = RunRecorder::default();
    let mut events = run.events.iter().peekable();
    for row in &run.rows {
        while let Some(entry) = events.next_if(|entry| entry.at <= row.tick) {
            recorder.event(entry.at, &entry.event);
        }
        recorder.rows.push(Row { controller: *row, truth: None });
        let measured = (row.position_mm, row.preload_n);
        recorder.close_tick(row.tick, &row.telemetry().unwrap_or_default(), measured, 0.0);
    }
    // The end of a run that a restart or a cut follows at once is in the log's lines alone.
    events.for_each(|entry| recorder.event(entry.at, &entry.event));
    let arrived = matches!(recorder.mode, Mode::Complete(_));
    let mut missing = run.missing();
    let mut moving = run.rows.iter().filter(|row| MOVES.contains(&row.mode));
    let first = moving.next();
    let (first, last) = (first, moving.next_back().or(first));
    let between = |of: fn(&Columns) -> f64| {
        first.zip(last).map_or(0.0, |ends| (of(ends.1) - of(ends.0)).abs())
    };
    let crossings: Vec<CrossingLine> = run.ledger.iter().map(|line| crossing(run, line)).collect();
    let left = between(|row| row.level.into()) as usize;
    let left = left.saturating_sub(crossings.len());
    if left > 0 {
        let left = counted(left, "crossing");
        let why = "the controller reports them on the way to the next step";
        missing.push(format!("figures of {left}: {why}"));
    }
    let retracts = first.is_some_and(|row| row.retracts);
    let direction = if retracts { Direction::Retract } else { Direction::Deploy };
    let header = run.header.clone().unwrap_or_default();
    // The reference that this controller planned for.
    let planner = scenario.as_ref().and_then(|known| Planner::try_build(&known.rig).ok());
    let gap_ref_mm = planner.map(|planner| planner.gap_ref(direction.into()).to_num());
    // A host's build has no hash.
    let has_hash = header.build.bytes().any(|digit| digit != b'0');
    let build = if has_hash { format!(", build {}", header.build) } else { String::new() };
    let gaps = crossings.iter().filter_map(|line| line.gap_measured_mm);
    let slips = crossings.iter().map(|line| line.slip_mm);
    let unknown = f64::NAN;
    let common = recorder.summary(scenario.as_ref(), arrived);
    let summary = Summary {
        measured: true,
        missing,
        target: format!("log of version {}{build}", header.version),
        direction: direction.name().to_owned(),
        rig: header.rig,
        travel_mm: between(|row| row.position_mm),
        gap_ref_mm: gap_ref_mm.unwrap_or(unknown),
        max_gap_mm: gaps.fold(unknown, f64::max),
        slip_mm: slips.reduce(|sum, slip| sum + slip).unwrap_or(unknown),
        mean_preload_n: first.map_or(unknown, |_| common.mean_preload_n),
        energy_j: unknown,
        friction_work_j: unknown,
        real_time_factor: 1.0,
        crossings,
        ..common
    };
    let parameters = scenario
        .map_or_else(|| run.parameters.clone().unwrap_or_default(), |known| known.to_toml());
    Recording { summary, rows: recorder.rows, log: recorder.log, parameters, stream: Vec::new() }
}

/// A crossing by the controller's estimates; its instants follow from the contact stage.
fn crossing(run: &Run, line: &Line) -> CrossingLine {
    let seen = LedgerLine::from(line);
    let on_corner = |row: &Columns| (3..=5).contains(&row.stage);
    let spans = run.rows.chunk_by(|a, b| on_corner(a) == on_corner(b));
    // The review takes its time: what has just been touched is the step after it.
    let is_its =
        |span: &&[Columns]| on_corner(&span[0]) && span[0].tick + 2 * PLAN_TICKS <= line.at;
    let span = spans.rev().find(is_its).unwrap_or_default();
    let touch = span.first();
    let lift = span.iter().find(|row| Some(row.stage) != touch.map(|first| first.stage));
    CrossingLine {
        index: seen.index,
        speed_mm_s: seen.speed_mm_s,
        preload_n: seen.preload_n,
        gap_mm: f64::NAN,
        corner_force_n: f64::NAN,
        // Creep and the tolerances of the steps are part of it.
        slip_mm: seen.slip_mm,
        touch_s: touch.map_or(seen.t_s, |row| row.t_s),
        lift_s: lift.or(span.last()).map_or(seen.t_s, |row| row.t_s),
        step_mm: seen.step_found_mm - seen.residual_mm,
        peak_preload_n: seen.peak_preload_n,
        peak_utilisation: f64::NAN,
        ..CrossingLine::from(&line.crossing)
    }
}

#[cfg(test)]
mod tests {
    use interstage::tick::Event;
    use serde_json::json;

    use super::*;
    use crate::record::Topic::{self, Summary as SUMMARY, Tick as TICK};
    use crate::record::decoder::tests::deployment;
    use crate::record::mcap_file::McapFile;
    use crate::record::write_mcap;

    #[test]
    fn the_log_of_a_deployment_gives_its_recording_back() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log.mcap");
        let written = deployment();
        write_mcap(&written, &path).unwrap();
        let read = recordings(&path).unwrap().remove(0);
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
    fn a_log_without_the_command_has_no_duration() {
        let stream = deployment().stream;
        let whole = Run::of_stream(&stream);
        // A capture that began while the preload was building.
        let from = whole.events.iter().position(|e| matches!(e.event, Event::Mode(Mode::Run(..))));
        let events = whole.events[from.expect("it moved")..].to_vec();
        let late = measured(&Run { events, ..whole.clone() }).summary;
        assert_eq!(late.duration_s, None);
        assert!(late.moving_s > 1.0);
    }

    #[test]
    fn a_log_without_truth_shows_what_the_controller_believes() {
        let truth = deployment();
        let believed = measured(&Run::of_stream(&truth.stream));
        assert!(believed.summary.completed);
        let times = |s: &Summary| (s.commanded_s, s.duration_s, s.moving_s, s.total_s);
        assert_eq!(times(&believed.summary), times(&truth.summary));
        assert!(truth.summary.duration_s > Some(truth.summary.moving_s + 0.1));
        assert_eq!(believed.summary.crossings.len(), 3);
        for (seen, real) in believed.summary.crossings.iter().zip(&truth.summary.crossings) {
            assert_eq!(seen.gap_measured_mm, real.gap_measured_mm);
            assert!(seen.gap_mm.is_nan());
            assert!((seen.touch_s - real.touch_s).abs() < 0.2, "{} {}", seen.touch_s, real.touch_s);
            assert!((seen.lift_s - real.lift_s).abs() < 0.1, "{} {}", seen.lift_s, real.lift_s);
            assert!((seen.step_mm - real.step_mm).abs() < 0.5);
        }
        assert_eq!(believed.log, truth.log);
        // Every quantity of every tick in less than this.
        let mean = truth.stream.len() as f64 / truth.rows.len() as f64;
        assert!(mean < 50.0, "{mean} bytes a tick");
        let page = crate::report::html(&believed, &[]);
        assert!(page.contains("Deployed") && !page.contains("NaN"), "{}", &page[..2000]);
        // A quantity that the log lacks is unknown.
        let mut lacking = Run::of_stream(&truth.stream);
        lacking.rows.iter_mut().for_each(|row| row.preload_n = f64::NAN);
        assert!(measured(&lacking).summary.mean_preload_n.is_nan());
    }

    fn log(messages: &[(Topic, Value)]) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut file = McapFile::new(&mut bytes).unwrap();
        for (topic, message) in messages {
            file.message(0, *topic, message.to_string().as_bytes()).unwrap();
        }
        file.finish().unwrap();
        drop(file);
        bytes.into_inner()
    }

    #[test]
    fn what_another_version_has_written_is_kept_as_far_as_it_goes_and_named() {
        let mut tick = json!({ "tick": 1, "position_true_mm": 2.0, "slip_mm": 0.5 });
        let mut strange_tick = tick.clone();
        strange_tick["mode"] = "hovering".into();
        let summary = json!(Summary::default());
        let read = |messages: &[(Topic, Value)]| {
            let mut strange = Vec::new();
            let recording = with_truth(&log(messages), &mut strange);
            (recording, strange)
        };
        let all = [(TICK, tick.clone()), (TICK, strange_tick), (SUMMARY, summary.clone())];
        let (recording, _) = read(&all);
        let recording = recording.expect("a summary");
        // A column that was not there yet takes no other one with it.
        let truth = recording.rows[0].truth.expect("the truth");
        assert_eq!((truth.position_true_mm, truth.slip_mm), (2.0, 0.5));
        assert!(truth.preload_true_n.is_nan());
        let missing = &recording.summary.missing;
        assert!(missing.len() == 1 && missing[0].contains("1 tick of"), "{missing:?}");
        assert!(missing[0].contains("hovering"), "{missing:?}");
        // A truth of another form is no tick without truth.
        tick["slip_mm"] = "none".into();
        let (recording, _) = read(&[(TICK, tick), (SUMMARY, summary.clone())]);
        assert_eq!(recording.expect("a summary").summary.missing.len(), 1);
        let mut old = summary;
        old.as_object_mut().unwrap().remove("trace_digest");
        let (recording, strange) = read(&[(SUMMARY, old)]);
        assert!(recording.is_none());
        assert!(strange.len() == 1 && strange[0].contains("trace_digest"), "{strange:?}");
    }
}
