//! `rig keys`: the parameters of a scenario.

use clap::builder::PossibleValuesParser;
use comfy_table::{Cell, Table};
use serde::Serialize;
use serde_json::Value;

use super::failure::{Failure, Outcome};
use super::output;
use crate::scenario::{KeyInfo, PRESETS, Scenario};
use crate::table::plain;

/// The parameters that a scenario file and --set take.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Rig preset whose values are shown.
    #[arg(long, value_name = "NAME", default_value = PRESETS[0],
          value_parser = PossibleValuesParser::new(PRESETS))]
    rig: String,

    /// Prints the keys as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    rig: &'a str,
    keys: Vec<Key<'a>>,
}

#[derive(Serialize)]
struct Key<'a> {
    key: &'a str,
    unit: &'a str,
    default: Value,
    expected: &'a str,
    description: &'a str,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let keys = Scenario::named(&args.rig)?.keys();
    let printed = Printed { rig: &args.rig, keys: keys.iter().map(key).collect() };
    output::result(args.json, &printed, || human(&keys))?;
    Ok(Outcome::Good)
}

fn key(info: &KeyInfo) -> Key<'_> {
    Key {
        key: &info.key,
        unit: info.unit,
        default: value(&info.value),
        expected: &info.expected,
        description: &info.description,
    }
}

/// A TOML value as JSON.
pub(super) fn value(text: &str) -> Value {
    let table: Result<Value, _> = toml::from_str(&format!("value = {text}"));
    match table {
        Ok(Value::Object(mut fields)) => fields.remove("value").unwrap_or_default(),
        _ => Value::String(text.to_owned()),
    }
}

fn human(keys: &[KeyInfo]) -> String {
    // Text throughout, so every column stands on the left.
    let mut table: Table = plain(&[], []);
    table.set_header(["key", "default", "unit", "what"].map(Cell::new));
    for info in keys {
        table.add_row([&*info.key, &*info.value, info.unit, &*info.description].map(Cell::new));
    }
    format!("{table}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_json_of_their_own_kind() {
        assert_eq!(value("0.5"), 0.5);
        assert_eq!(value("\"scheduled\""), "scheduled");
        assert_eq!(value("[163.0, 276.0]"), serde_json::json!([163.0, 276.0]));
    }
}
