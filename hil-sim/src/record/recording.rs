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
use interstage::tick::Event;
use mcap::records::Record;
use serde_json::Value;

use super::read::{CSV, MCAP, ReadError, content, parameters, records};
use super::recorder::{restart_words, text};
use super::time_lost::{TimeLost, TimeSplit};
use super::{Controller, CrossingLine, LedgerLine, LogLine, Recording, Run, Summary, Tick};
use crate::scenario::{Direction, Scenario};
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
            Some("/tick") => match serde_json::from_slice::<Tick>(&data) {
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
    let mut summary = summary(run, scenario.as_ref());
    let mut log = Vec::new();
    for entry in &run.events {
        let t_s = f64::from(entry.at) * 1e-3;
        log.push(LogLine { t_s, text: text(&entry.event) });
        summary.take(t_s, &entry.event);
    }
    // The end of a run that a restart or a cut follows at once is in the log's lines alone.
    let mut modes = run.events.iter().filter_map(|entry| match entry.event {
        Event::Mode(mode) => Some((entry.at, mode)),
        _ => None,
    });
    let later =
        modes.next_back().filter(|(at, _)| run.rows.last().is_some_and(|row| row.tick < *at));
    summary.completed |= later.is_some_and(|(_, mode)| matches!(mode, Mode::Complete(_)));
    summary.completed &= summary.faults.is_empty();
    summary.crossings = run.ledger.iter().map(|line| crossing(run, line)).collect();
    let mut levels = run.rows.iter().filter(moves);
    let levels = levels.next().zip(levels.next_back());
    let passed = levels.map_or(0, |(first, last)| usize::from(first.level.abs_diff(last.level)));
    if passed > summary.crossings.len() {
        let left = counted(passed - summary.crossings.len(), "crossing");
        let why = "the controller reports them on the way to the next step";
        summary.missing.push(format!("figures of {left}: {why}"));
    }
    let gaps = summary.crossings.iter().filter_map(|line| line.gap_measured_mm);
    summary.max_gap_mm = gaps.fold(f64::NAN, f64::max);
    if !summary.crossings.is_empty() {
        summary.slip_mm = summary.crossings.iter().map(|line| line.slip_mm).sum();
    }
    let rows = run.rows.iter().map(|row| Tick { controller: *row, truth: None }).collect();
    let parameters = scenario
        .map_or_else(|| run.parameters.clone().unwrap_or_default(), |known| known.to_toml());
    Recording { summary, rows, log, parameters, ..Recording::default() }
}

/// Tick that accepted the command which the first motion of the log follows from: there the
/// preload began to build. None if it is not in the log.
fn commanded(run: &Run) -> Option<u32> {
    let mut before = None;
    for entry in &run.events {
        let Event::Mode(mode) = entry.event else { continue };
        if mode.moves() {
            return before.and_then(|(mode, at)| matches!(mode, Mode::Preload(_)).then_some(at));
        }
        before = Some((mode, entry.at));
    }
    None
}

fn moves(row: &&Controller) -> bool {
    row.mode().is_some_and(Mode::moves)
}

/// Whether the log ends with the drive at its end of travel.
fn arrived(run: &Run) -> bool {
    let last = run.rows.last().and_then(Controller::mode);
    last.is_some_and(|mode| matches!(mode, Mode::Complete(_)))
}

/// Where the time of a run that arrived goes, by the controller's position.
fn lost(run: &Run, scenario: Option<&Scenario>) -> Option<TimeLost> {
    let known = scenario.filter(|_| arrived(run) && commanded(run).is_some())?;
    let mut split = TimeSplit::default();
    run.rows.iter().for_each(|row| split.add(row.t_s, row.mode, row.position_mm));
    Some(split.lost(known.rig.drive.cruise_speed_mm_s))
}

/// A run as the controller reports it.
fn summary(run: &Run, scenario: Option<&Scenario>) -> Summary {
    let moving: Vec<&Controller> = run.rows.iter().filter(moves).collect();
    let (first, last) = (moving.first(), moving.last());
    let between = |of: fn(&Controller) -> f64| {
        first.zip(last).map_or(0.0, |(first, last)| of(last) - of(first))
    };
    let retracts = first.is_some_and(|row| row.retracts);
    let direction = if retracts { Direction::Retract } else { Direction::Deploy };
    let preload: f64 = moving.iter().map(|row| row.preload_n).sum();
    let header = run.header.clone().unwrap_or_default();
    // The reference that this controller planned for.
    let planner = scenario.and_then(|scenario| Planner::try_build(&scenario.rig).ok());
    let gap_ref_mm = planner.map(|planner| planner.gap_ref(direction.into()).to_num());
    // A host's build has no hash.
    let has_hash = header.build.bytes().any(|digit| digit != b'0');
    let build = if has_hash { format!(", build {}", header.build) } else { String::new() };
    let unknown = f64::NAN;
    Summary {
        measured: true,
        missing: run.missing(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        overrides: scenario.map(Scenario::overrides).unwrap_or_default(),
        seed: scenario.map_or(0, |scenario| scenario.run.seed),
        completed: arrived(run),
        target: format!("log of version {}{build}", header.version),
        controller: scenario.map_or("unknown", |known| known.run.controller.name()).to_owned(),
        direction: direction.name().to_owned(),
        rig: header.rig,
        commanded_s: commanded(run).map(|at| 1e-3 * f64::from(at)),
        duration_s: last.zip(commanded(run)).map(|(row, at)| row.t_s - 1e-3 * f64::from(at)),
        lost: lost(run, scenario),
        moving_s: between(|row| row.t_s),
        total_s: run.rows.last().map_or(0.0, |row| row.t_s),
        travel_mm: between(|row| row.position_mm).abs(),
        position_sigma_mm: run.rows.last().and_then(|row| row.position_sigma_mm),
        gap_ref_mm: gap_ref_mm.unwrap_or(unknown),
        max_gap_mm: unknown,
        slip_mm: unknown,
        mean_preload_n: preload / moving.len() as f64,
        energy_j: unknown,
        friction_work_j: unknown,
        real_time_factor: 1.0,
        ..Summary::default()
    }
}

/// A crossing by the controller's estimates; its instants follow from the contact stage.
fn crossing(run: &Run, line: &Line) -> CrossingLine {
    let seen = LedgerLine::from(line);
    let on_corner = |row: &Controller| (3..=5).contains(&row.stage);
    let before = |end: usize| {
        let end = run.rows[..end].iter().rposition(on_corner).map_or(end, |place| place + 1);
        let begin = run.rows[..end].iter().rposition(|row| !on_corner(row));
        (begin.map_or(0, |place| place + 1), end)
    };
    let reviewed = run.rows.partition_point(|row| row.tick <= line.at);
    let (begin, end) = before(reviewed);
    // The review takes its time: what has just been touched is the step after it.
    let is_next = run.rows.get(begin).is_some_and(|row| row.tick + 2 * PLAN_TICKS > line.at);
    let (begin, end) = if is_next { before(begin) } else { (begin, end) };
    let span = &run.rows[begin..end.max(begin)];
    let touch = span.first();
    let lift = span.iter().find(|row| Some(row.stage) != touch.map(|first| first.stage));
    CrossingLine {
        index: seen.index,
        speed_mm_s: seen.speed_mm_s,
        preload_n: seen.preload_n,
        gap_mm: f64::NAN,
        gap_predicted_mm: Some(seen.gap_predicted_mm),
        gap_measured_mm: Some(seen.gap_measured_mm),
        corner_force_n: f64::NAN,
        lead_time_s: Some(seen.lead_time_s),
        // Creep and the tolerances of the steps are part of it.
        slip_mm: seen.slip_mm,
        slip_measured_mm: seen.slip_measured_mm,
        slip_sigma_mm: seen.slip_sigma_mm,
        height_measured_mm: seen.height_measured_mm,
        touch_s: touch.map_or(seen.t_s, |row| row.t_s),
        lift_s: lift.or(span.last()).map_or(seen.t_s, |row| row.t_s),
        step_mm: seen.step_found_mm - seen.residual_mm,
        step_found_mm: Some(seen.step_found_mm),
        peak_preload_n: seen.peak_preload_n,
        peak_utilisation: f64::NAN,
        limited_by: seen.limited_by,
    }
}

#[cfg(test)]
mod tests {
    use mcap::records::MessageHeader;
    use serde_json::json;

    use super::*;
    use crate::record::decoder::tests::deployment;
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
        assert!(commanded(&whole).is_some());
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
        assert!((believed.summary.moving_s - truth.summary.moving_s).abs() < 2e-3);
        let durations = [&believed, &truth].map(|run| run.summary.duration_s.expect("commanded"));
        assert!((durations[0] - durations[1]).abs() < 2e-3, "{durations:?}");
        assert!(durations[1] > truth.summary.moving_s + 0.1, "{durations:?}");
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
    }
    fn log(messages: &[(&str, Value)]) -> Vec<u8> {
        let mut file = std::io::Cursor::new(Vec::new());
        let mut writer = mcap::Writer::new(&mut file).unwrap();
        for (topic, message) in messages {
            let channel_id = writer.add_channel(0, topic, "json", &Default::default()).unwrap();
            let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, message.to_string().as_bytes()).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        file.into_inner()
    }

    #[test]
    fn what_another_version_has_written_is_kept_as_far_as_it_goes_and_named() {
        let mut tick = json!({ "tick": 1, "position_true_mm": 2.0, "slip_mm": 0.5 });
        let mut strange_tick = tick.clone();
        strange_tick["mode"] = "hovering".into();
        let summary = json!(Summary::default());
        let read = |messages: &[(&str, Value)]| {
            let mut strange = Vec::new();
            let recording = with_truth(&log(messages), &mut strange);
            (recording, strange)
        };
        let all = [("/tick", tick.clone()), ("/tick", strange_tick), ("/summary", summary.clone())];
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
        let (recording, _) = read(&[("/tick", tick), ("/summary", summary.clone())]);
        assert_eq!(recording.expect("a summary").summary.missing.len(), 1);
        let mut old = summary;
        old.as_object_mut().unwrap().remove("trace_digest");
        let (recording, strange) = read(&[("/summary", old)]);
        assert!(recording.is_none());
        assert!(strange.len() == 1 && strange[0].contains("trace_digest"), "{strange:?}");
    }
}
