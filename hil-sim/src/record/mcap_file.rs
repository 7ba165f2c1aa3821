//! MCAP files: ticks, ledger, events and the controller's own frames on one time axis, as
//! JSON with a schema each, so that any MCAP viewer can plot them.

use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};
use std::path::Path;

use interstage::restart::Reset;
use interstage::tick::{Entry, Event};
use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{
    Columns, CrossingLine, Decoder, Item, LedgerLine, MODE_NAMES, Recording, Row, STAGE_NAMES,
    Summary, text,
};
use crate::files::{Failure, FileError, atomic_write};

/// Topic that carries the frames as they were on the channel, each in a protobuf message, which
/// viewers can open.
pub const FRAMES: &str = "/frames";

/// A field of a protobuf message: its number, wire type 2, length and bytes.
fn field(number: u8, bytes: &[u8]) -> Vec<u8> {
    let mut message = vec![number << 3 | 2];
    let mut length = bytes.len();
    while length > 0x7F {
        message.push(length as u8 | 0x80);
        length >>= 7;
    }
    message.push(length as u8);
    message.extend(bytes);
    message
}

/// A frame as message `interstage.Frame { bytes data = 1; }`.
pub(super) fn wrapped(frame: &[u8]) -> Vec<u8> {
    field(1, frame)
}

/// The frame of a message; files of earlier versions have the frame alone.
pub fn unwrapped(message: &[u8]) -> &[u8] {
    let after = message.iter().skip(1).position(|byte| byte & 0x80 == 0).map_or(0, |at| at + 2);
    let frame = message.get(after..).unwrap_or_default();
    let head = message.len() - frame.len();
    let is_wrapped = field(1, frame).get(..head) == message.get(..head);
    if after > 0 && is_wrapped { frame } else { message }
}

/// The `FileDescriptorSet` of `interstage.Frame`, by the numbers of `descriptor.proto`.
fn frame_schema() -> Vec<u8> {
    // One field of type bytes (12), number 1, optional (1).
    let data = [field(1, b"data"), vec![3 << 3, 1, 4 << 3, 1, 5 << 3, 12]].concat();
    let message = [field(1, b"Frame"), field(2, &data)].concat();
    let file = [
        field(1, b"interstage/frame.proto"),
        field(2, b"interstage"),
        field(4, &message),
        field(12, b"proto3"),
    ];
    field(1, &file.concat())
}

/// Levels of a log line, as viewers know them.
const INFO: u8 = 2;
const WARNING: u8 = 3;
const ERROR: u8 = 4;

/// Nanoseconds of a tick.
pub(super) const TICK_NS: u64 = 1_000_000;

/// The topic of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Topic {
    Tick,
    /// An event or a mark as a line of text.
    Log,
    Ledger,
    Crossing,
    Summary,
    Frames,
}

impl Topic {
    /// The topics of a log that grows.
    pub(crate) const LIVE: [Self; 3] = [Self::Tick, Self::Log, Self::Ledger];

    pub(crate) const fn name(self) -> &'static str {
        ["/tick", "/log", "/ledger", "/crossing", "/summary", FRAMES][self as usize]
    }

    /// JSON schema of its messages; null for frames, which are protobuf.
    pub(crate) fn schema(self) -> Value {
        match self {
            Self::Tick => {
                let (tick, required) = (Row::example(true), ["tick", "t_s", "mode"]);
                let mut schema = flat_schema("interstage.Tick", &tick, &required);
                enumerate(&mut schema, "mode", &MODE_NAMES);
                enumerate(&mut schema, "stage", &STAGE_NAMES);
                schema
            }
            Self::Log => log_schema(),
            Self::Ledger => {
                flat_schema("interstage.Ledger", &LedgerLine::default(), &["index", "count"])
            }
            Self::Crossing => {
                let required = ["index", "touch_s", "lift_s"];
                flat_schema("interstage.Crossing", &CrossingLine::default(), &required)
            }
            Self::Summary => flat_schema("interstage.Summary", &Summary::default(), &[]),
            Self::Frames => Value::Null,
        }
    }
}

/// The message of an item; none for an item that only a reader of frames needs.
pub fn messages(item: &Item) -> Option<(Topic, Vec<u8>)> {
    match item {
        Item::Tick(record, sensors) => {
            let tick = Row { controller: Columns::of(record, sensors), truth: None };
            body(Topic::Tick, &tick)
        }
        Item::Ledger(line) => body(Topic::Ledger, &LedgerLine::from(line)),
        Item::Event(entry) => {
            let ns = u64::from(entry.at) * TICK_NS;
            body(Topic::Log, &log_message(ns, level(entry), &text(&entry.event)))
        }
        Item::Mark(mark) => body(Topic::Log, &log_message(0, WARNING, &mark.to_string())),
        Item::Identity(_) | Item::Plan(..) | Item::Request(..) | Item::Frame(_) => None,
    }
}

fn body(topic: Topic, message: &impl Serialize) -> Option<(Topic, Vec<u8>)> {
    // Numbers and texts always have a JSON form.
    bytes(message).ok().map(|bytes| (topic, bytes))
}

/// `message` as a JSON object without the fields that have no value.
fn bytes(message: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    let mut value = serde_json::to_value(message)?;
    if let Value::Object(fields) = &mut value {
        fields.retain(|_, field| !field.is_null());
    }
    serde_json::to_vec(&value)
}

fn level(entry: &Entry) -> u8 {
    match entry.event {
        Event::Fault(_) => ERROR,
        Event::Restart(restart) if restart.reset != Reset::Power => ERROR,
        Event::Limit(_) | Event::Lost(_) | Event::Refused(_) => WARNING,
        _ => INFO,
    }
}

pub(super) struct McapFile<W: Write + Seek> {
    out: mcap::Writer<W>,
    /// Channel and number of messages of each topic.
    channels: HashMap<Topic, (u16, u32)>,
}

impl<W: Write + Seek> McapFile<W> {
    pub(super) fn new(out: W) -> Result<Self, Failure> {
        let options = WriteOptions::new()
            .compression(Some(mcap::Compression::Lz4))
            .library(concat!("interstage ", env!("CARGO_PKG_VERSION")));
        Ok(Self { out: options.create(out)?, channels: HashMap::new() })
    }

    /// Adds a metadata record of this name.
    pub(super) fn metadata(
        &mut self,
        name: &str,
        pairs: impl IntoIterator<Item = (impl Into<String>, String)>,
    ) -> Result<(), Failure> {
        let metadata = pairs.into_iter().map(|(key, value)| (key.into(), value)).collect();
        Ok(self.out.write_metadata(&Metadata { name: name.to_owned(), metadata })?)
    }

    pub(super) fn parameters(&mut self, toml: &str) -> Result<(), Failure> {
        self.metadata("parameters", [("toml", toml.to_owned())])
    }

    /// Adds a message at a time since boot, ns. A topic's first message adds its channel.
    pub(super) fn message(&mut self, ns: u64, topic: Topic, body: &[u8]) -> Result<(), Failure> {
        let (channel_id, sequence) = match self.channels.get(&topic) {
            Some(known) => *known,
            None => (self.channel(topic)?, 0),
        };
        self.channels.insert(topic, (channel_id, sequence.wrapping_add(1)));
        let header = MessageHeader { channel_id, sequence, log_time: ns, publish_time: ns };
        Ok(self.out.write_to_known_channel(&header, body)?)
    }

    fn channel(&mut self, topic: Topic) -> Result<u16, Failure> {
        let (schema, encoding) = match topic.schema() {
            Value::Null => {
                let bytes = frame_schema();
                (self.out.add_schema("interstage.Frame", "protobuf", &bytes)?, "protobuf")
            }
            schema => {
                let name = schema["title"].as_str().unwrap_or(topic.name());
                let bytes = serde_json::to_vec(&schema)?;
                (self.out.add_schema(name, "jsonschema", &bytes)?, "json")
            }
        };
        Ok(self.out.add_channel(schema, topic.name(), encoding, &BTreeMap::new())?)
    }

    /// Passes everything to the system as complete chunks.
    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        Ok(self.out.flush()?)
    }

    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        self.out.finish()?;
        Ok(())
    }
}

/// Writes `recording` to `path`: a message a tick on `/tick`, one a crossing on `/crossing` at
/// the time of lift-off, one a line on `/log`, one at the end on `/summary`, the controller's
/// own log frame by frame on [`FRAMES`]; parameters, version and seed as metadata. Times count
/// from boot.
pub fn write_mcap(recording: &Recording, path: &Path) -> Result<(), FileError> {
    atomic_write(path, |out| {
        let mut file = McapFile::new(out)?;
        let summary = &recording.summary;
        let about = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("target", summary.target.clone()),
            ("controller", summary.controller.clone()),
            ("direction", summary.direction.clone()),
            ("rig", summary.rig.clone()),
            ("seed", summary.seed.to_string()),
            ("trace_digest", summary.trace_digest.clone()),
            ("ticks", recording.rows.len().to_string()),
        ];
        file.metadata("run", about)?;
        file.parameters(&recording.parameters)?;
        let mut all = Vec::new();
        for tick in &recording.rows {
            all.push((tick.controller.t_s, Topic::Tick, bytes(tick)?));
        }
        for line in &recording.log {
            let message = log_message(nanoseconds(line.t_s), INFO, &line.text);
            all.push((line.t_s, Topic::Log, bytes(&message)?));
        }
        for line in &summary.crossings {
            all.push((line.lift_s, Topic::Crossing, bytes(line)?));
        }
        // A frame is of the time of the newest tick up to it.
        let mut t_s = 0.0;
        Decoder::new().read(&recording.stream, &mut |item| match item {
            Item::Tick(record, _) => t_s = f64::from(record.at()) * 1e-3,
            Item::Frame(bytes) => all.push((t_s, Topic::Frames, wrapped(&bytes))),
            _ => {}
        });
        // A stable sort: messages of one time keep their order.
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (t_s, topic, body) in &all {
            file.message(nanoseconds(*t_s), *topic, body)?;
        }
        let last = all.last().map_or(summary.total_s, |(t_s, ..)| *t_s);
        file.message(nanoseconds(last), Topic::Summary, &bytes(summary)?)?;
        file.finish()
    })
}

/// Time since boot, ns; 0 for times before boot.
fn nanoseconds(t_s: f64) -> u64 {
    (t_s * 1e9).round() as u64
}

/// A JSON schema named `title` of flat objects like `example`. Fields outside `required` may
/// be absent from a message.
fn flat_schema(title: &str, example: &impl Serialize, required: &[&str]) -> Value {
    let example = serde_json::to_value(example).unwrap_or_default();
    let properties: Map<String, Value> = example
        .as_object()
        .into_iter()
        .flatten()
        .map(|(name, value)| (name.clone(), json!({ "type": kind(value) })))
        .collect();
    json!({ "title": title, "type": "object", "properties": properties, "required": required })
}

/// States the texts that a property may have.
fn enumerate(schema: &mut Value, property: &str, names: &[&str]) {
    schema["properties"][property] = json!({ "type": "string", "enum": names });
}

/// The form of a log line that viewers show in their log panel.
fn log_schema() -> Value {
    json!({
        "title": "foxglove.Log",
        "type": "object",
        "properties": {
            "timestamp": {
                "type": "object",
                "title": "time",
                "properties": { "sec": { "type": "integer" }, "nsec": { "type": "integer" } },
            },
            "level": { "type": "integer" },
            "message": { "type": "string" },
            "name": { "type": "string" },
        },
    })
}

/// A log line of this form at a time in ns.
fn log_message(ns: u64, level: u8, text: &str) -> Value {
    json!({
        "timestamp": { "sec": ns / 1_000_000_000, "nsec": ns % 1_000_000_000 },
        "level": level,
        "message": text,
        "name": "interstage",
    })
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Bool(_) => "boolean",
        Value::Number(n) if !n.is_f64() => "integer",
        // A number without a value in the example.
        Value::Number(_) | Value::Null => "number",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
        Value::String(_) => "string",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::decoder::tests::frames;
    use crate::report::example;

    /// What is in the messages is read back beside `recording.rs`, and by Python.
    #[test]
    fn messages_are_in_order_of_time_without_fields_that_have_no_value() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log.mcap");
        let recording = example::deploy();
        write_mcap(&recording, &path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let (mut rows, mut last) = (recording.rows.iter(), 0);
        for message in mcap::MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            assert!(message.log_time >= last, "{} went back in time", message.channel.topic);
            last = message.log_time;
            if message.channel.topic == "/tick" {
                let body: Value = serde_json::from_slice(&message.data).unwrap();
                let row = rows.next().unwrap();
                assert_eq!(message.log_time, nanoseconds(row.controller.t_s));
                let absent = row.truth.unwrap().root_clearance_mm.is_nan();
                assert_eq!(body.get("root_clearance_mm").is_none(), absent);
            }
        }
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let index = summary.metadata_indexes.iter().find(|index| index.name == "run").unwrap();
        let run = mcap::read::metadata(&bytes, index).unwrap().metadata;
        assert_eq!(run["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(run["seed"], recording.summary.seed.to_string());
    }

    #[test]
    fn a_frame_comes_back_from_its_message_and_a_bare_one_stays() {
        for length in [0, 1, 9, 127, 128, 300, 20_000] {
            let frame: Vec<u8> = (0..length).map(|i| (i * 7 % 251) as u8).collect();
            assert_eq!(unwrapped(&wrapped(&frame)), frame, "{length}");
        }
        assert!(frames(0, 80).iter().all(|frame| unwrapped(frame) == frame));
    }

    #[test]
    fn times_before_boot_and_no_times_become_boot() {
        assert_eq!([-1.0, f64::NAN, 0.001].map(nanoseconds), [0, 0, 1_000_000]);
    }
}
