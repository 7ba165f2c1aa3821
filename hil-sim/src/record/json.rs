//! JSON messages and their schemas.

use serde::Serialize;
use serde_json::{Map, Value, json};

/// `message` as a JSON object without the fields that have no value.
pub(crate) fn object(message: &impl Serialize) -> serde_json::Result<Value> {
    let mut value = serde_json::to_value(message)?;
    if let Value::Object(fields) = &mut value {
        fields.retain(|_, field| !field.is_null());
    }
    Ok(value)
}

/// A JSON schema named `title` of flat objects like `example`. Fields outside `required` may
/// be absent from a message.
pub(crate) fn schema(title: &str, example: &impl Serialize, required: &[&str]) -> Value {
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
pub(crate) fn enumerate(schema: &mut Value, property: &str, names: &[&str]) {
    schema["properties"][property] = json!({ "type": "string", "enum": names });
}

/// The form of a log line that viewers show in their log panel.
pub(crate) fn log_schema() -> Value {
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
        Value::Number(n) if !n.is_f64() => "integer",
        // A number without a value in the example.
        Value::Number(_) | Value::Null => "number",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
        Value::String(_) => "string",
    }
}
