//! `log.mcap`: telemetry, crossings, log and summary on one time axis, as JSON with
//! a schema each, so that any MCAP viewer can plot them.

use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::path::Path;

use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};
use serde_json::Value;

use super::whole::{self, Failure};
use super::{ExportError, json};
use crate::log::{self, FRAMES};
use crate::record::{CrossingLine, LogLine, Recording, Row};

/// Writes `recording` to `path`: a message a row on `/telemetry`, one a ledger line
/// on `/crossing` at the time of lift-off, one a line on `/log`, one at the end on
/// `/summary`, the controller's own log frame by frame on [`FRAMES`], and the parameters,
/// version and seed as metadata. Times count from boot.
///
/// # Errors
/// [`ExportError::File`] with the reason.
pub fn write_mcap(recording: &Recording, path: &Path) -> Result<(), ExportError> {
    whole::write(path, |out| {
        let options = WriteOptions::new()
            .compression(Some(mcap::Compression::Lz4))
            .library(concat!("interstage ", env!("CARGO_PKG_VERSION")));
        let mut log = Log { out: options.create(out)?, counts: BTreeMap::new() };
        fill(&mut log, recording)?;
        log.out.finish()?;
        Ok(())
    })
}

fn fill<W: Write + Seek>(log: &mut Log<W>, recording: &Recording) -> Result<(), Failure> {
    for metadata in metadata(recording) {
        log.out.write_metadata(&metadata)?;
    }
    let telemetry = log.channel("/telemetry", &telemetry_schema()?)?;
    let mut events = events(log, recording)?;
    let frames = log.out.add_channel(0, FRAMES, "interstage-frames", &BTreeMap::new())?;
    let timed = log::timed(&recording.stream).rev();
    events.extend(timed.map(|(t_s, frame)| Event { t_s, channel: frames, body: frame.to_vec() }));
    // The earliest stands last, to be popped first; the sort is stable, so that lines of
    // one time keep their order.
    events.sort_by(|a, b| b.t_s.total_cmp(&a.t_s));
    for row in &recording.rows {
        while let Some(event) = events.pop_if(|event| event.t_s < row.t_s) {
            log.message(event.channel, event.t_s, &event.body)?;
        }
        log.message(telemetry, row.t_s, &json::bytes(row)?)?;
    }
    while let Some(event) = events.pop() {
        log.message(event.channel, event.t_s, &event.body)?;
    }
    let end_s = recording.rows.last().map_or(recording.summary.total_s, |row| row.t_s);
    let summary = json::object(&recording.summary)?;
    let channel = log.channel("/summary", &json::schema("interstage.Summary", &summary, &[]))?;
    log.message(channel, end_s, &serde_json::to_vec(&summary)?)
}

/// A message between the rows.
struct Event {
    t_s: f64,
    channel: u16,
    body: Vec<u8>,
}

/// Crossings and log lines, each from the last to the first.
fn events<W: Write + Seek>(log: &mut Log<W>, recording: &Recording) -> Result<Vec<Event>, Failure> {
    let crossing = log.channel("/crossing", &crossing_schema()?)?;
    let lines = log.channel("/log", &json::log_schema())?;
    let mut events = Vec::new();
    for line in recording.log.iter().rev() {
        events.push(Event { t_s: line.t_s, channel: lines, body: log_line(line)? });
    }
    for line in recording.summary.crossings.iter().rev() {
        events.push(Event { t_s: line.lift_s, channel: crossing, body: json::bytes(line)? });
    }
    Ok(events)
}

fn telemetry_schema() -> Result<Value, Failure> {
    let example = serde_json::to_value(Row::default())?;
    let required: Vec<&str> = example
        .as_object()
        .into_iter()
        .flatten()
        .map(|(name, _)| name.as_str())
        .filter(|name| *name != "root_clearance_mm")
        .collect();
    Ok(json::schema("interstage.Telemetry", &example, &required))
}

fn crossing_schema() -> Result<Value, Failure> {
    let example = serde_json::to_value(CrossingLine {
        gap_predicted_mm: Some(0.0),
        gap_measured_mm: Some(0.0),
        lead_time_s: Some(0.0),
        step_found_mm: Some(0.0),
        ..CrossingLine::default()
    })?;
    Ok(json::schema("interstage.Crossing", &example, &["index", "gap_mm", "touch_s", "lift_s"]))
}

fn log_line(line: &LogLine) -> Result<Vec<u8>, Failure> {
    const INFO: u8 = 2;
    Ok(serde_json::to_vec(&json::log_message(nanoseconds(line.t_s), INFO, &line.text))?)
}

fn metadata(recording: &Recording) -> [Metadata; 2] {
    let summary = &recording.summary;
    let run = [
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("target", summary.target.clone()),
        ("controller", summary.controller.clone()),
        ("direction", summary.direction.clone()),
        ("rig", summary.rig.clone()),
        ("seed", summary.seed.to_string()),
        ("trace_digest", summary.trace_digest.clone()),
    ];
    let table = |pairs: &[(&str, String)]| {
        pairs.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect()
    };
    [
        Metadata { name: "run".to_owned(), metadata: table(&run) },
        Metadata {
            name: "parameters".to_owned(),
            metadata: table(&[("toml", recording.parameters.clone())]),
        },
    ]
}

/// Time since boot in ns; what lies before boot is boot.
fn nanoseconds(t_s: f64) -> u64 {
    (t_s * 1e9).round() as u64
}

/// A writer that counts the messages of each channel.
struct Log<W: Write + Seek> {
    out: mcap::Writer<W>,
    counts: BTreeMap<u16, u32>,
}

impl<W: Write + Seek> Log<W> {
    fn channel(&mut self, topic: &str, schema: &Value) -> Result<u16, Failure> {
        let name = schema["title"].as_str().unwrap_or(topic);
        let schema = self.out.add_schema(name, "jsonschema", &serde_json::to_vec(schema)?)?;
        Ok(self.out.add_channel(schema, topic, "json", &BTreeMap::new())?)
    }

    fn message(&mut self, channel_id: u16, t_s: f64, body: &[u8]) -> Result<(), Failure> {
        let sequence = self.counts.entry(channel_id).or_default();
        let log_time = nanoseconds(t_s);
        let header =
            MessageHeader { channel_id, sequence: *sequence, log_time, publish_time: log_time };
        *sequence += 1;
        Ok(self.out.write_to_known_channel(&header, body)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn messages_are_read_back_in_order_of_time() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log.mcap");
        let recording = example::deploy();
        write_mcap(&recording, &path).unwrap();
        let bytes = std::fs::read(&path).unwrap();

        let mut counts = BTreeMap::new();
        let mut rows = recording.rows.iter();
        let mut last = 0;
        for message in mcap::MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            assert!(message.log_time >= last, "{} went back in time", message.channel.topic);
            last = message.log_time;
            *counts.entry(message.channel.topic.clone()).or_insert(0) += 1;
            if message.channel.topic == FRAMES {
                continue;
            }
            assert_eq!(message.channel.schema.as_ref().unwrap().encoding, "jsonschema");
            let body: Value = serde_json::from_slice(&message.data).unwrap();
            if message.channel.topic == "/telemetry" {
                let row = rows.next().unwrap();
                assert_eq!(message.log_time, nanoseconds(row.t_s));
                assert_eq!(body["speed_true_mm_s"], row.speed_true_mm_s);
                assert_eq!(body.get("root_clearance_mm").is_none(), row.root_clearance_mm.is_nan());
            }
        }
        assert_eq!(counts["/telemetry"], recording.rows.len());
        assert_eq!(counts["/crossing"], 3);
        assert_eq!(counts["/log"], recording.log.len());
        assert_eq!(counts["/summary"], 1);
    }

    #[test]
    fn metadata_holds_parameters_version_and_seed() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log.mcap");
        let recording = example::deploy();
        write_mcap(&recording, &path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let read: BTreeMap<String, Metadata> = summary
            .metadata_indexes
            .iter()
            .map(|index| mcap::read::metadata(&bytes, index).unwrap())
            .map(|metadata| (metadata.name.clone(), metadata))
            .collect();
        assert_eq!(read["parameters"].metadata["toml"], recording.parameters);
        assert_eq!(read["run"].metadata["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(read["run"].metadata["seed"], recording.summary.seed.to_string());
    }

    #[test]
    fn times_before_boot_and_no_times_become_boot() {
        assert_eq!(nanoseconds(-1.0), 0);
        assert_eq!(nanoseconds(f64::NAN), 0);
        assert_eq!(nanoseconds(0.001), 1_000_000);
    }
}
