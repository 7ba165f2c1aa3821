//! `summary.json`, and the JSON schemas of the messages in `log.mcap`.

use std::path::Path;

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{ExportError, whole};
use crate::record::Summary;

/// Writes `summary` to `path`: the object that `rig deploy --json` prints.
///
/// # Errors
/// [`ExportError::File`] with the reason.
pub fn write_summary(summary: &Summary, path: &Path) -> Result<(), ExportError> {
    whole::write(path, |out| {
        serde_json::to_writer_pretty(&mut *out, summary)?;
        Ok(std::io::Write::write_all(out, b"\n")?)
    })
}

/// `message` as a JSON object without the fields that have no value.
pub(crate) fn object(message: &impl Serialize) -> serde_json::Result<Value> {
    let mut value = serde_json::to_value(message)?;
    if let Value::Object(fields) = &mut value {
        fields.retain(|_, field| !field.is_null());
    }
    Ok(value)
}

/// The bytes of [`object`].
pub(crate) fn bytes(message: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    serde_json::to_vec(&object(message)?)
}

/// A JSON schema named `title` of flat objects like `example`, in which every field
/// has a value. Fields outside `required` may be left out of a message.
pub(crate) fn schema(title: &str, example: &Value, required: &[&str]) -> Value {
    let properties: Map<String, Value> = example
        .as_object()
        .into_iter()
        .flatten()
        .map(|(name, value)| (name.clone(), json!({ "type": kind(value) })))
        .collect();
    json!({ "title": title, "type": "object", "properties": properties, "required": required })
}

/// The form of a log line that viewers show in their log panel.
pub(crate) fn log_schema() -> Value {
    let time = json!({
        "type": "object",
        "title": "time",
        "properties": { "sec": { "type": "integer" }, "nsec": { "type": "integer" } },
    });
    json!({
        "title": "foxglove.Log",
        "type": "object",
        "properties": {
            "timestamp": time,
            "level": { "type": "integer" },
            "message": { "type": "string" },
            "name": { "type": "string" },
        },
    })
}

/// A log line of this form, at `ns` nanoseconds.
pub(crate) fn log_message(ns: u64, level: u8, text: &str) -> Value {
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
        Value::Number(n) if n.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
        Value::String(_) | Value::Null => "string",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Row;
    use crate::report::example;

    #[test]
    fn the_summary_is_read_back() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("summary.json");
        let summary = example::deploy().summary;
        write_summary(&summary, &path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(serde_json::from_str::<Summary>(&text).unwrap(), summary);
    }

    #[test]
    fn a_field_without_value_is_left_out() {
        let row = Row { root_clearance_mm: f64::NAN, ..Row::default() };
        let object = object(&row).unwrap();
        assert!(object.get("root_clearance_mm").is_none());
        assert_eq!(object.as_object().unwrap().len(), 26);
    }
}
