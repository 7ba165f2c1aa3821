//! `rig keys`: the parameters of a scenario.

use clap::builder::PossibleValuesParser;
use comfy_table::{Cell, ColumnConstraint};
use serde_json::json;

use super::failure::{Failure, Outcome};
use super::output;
use crate::scenario::{KeyInfo, PRESETS, Scenario};
use crate::table::plain;

/// The parameters that a scenario file and --set take, with their ranges; what is a property of
/// the rig, to be measured there, is marked.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Only keys whose name or description contains this, capital or not.
    #[arg(value_name = "PATTERN")]
    pattern: Option<String>,

    /// Rig preset whose values are shown.
    #[arg(long, value_name = "NAME", default_value = PRESETS[0],
          value_parser = PossibleValuesParser::new(PRESETS))]
    rig: String,

    /// Prints the keys as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut keys = Scenario::named(&args.rig)?.keys();
    if let Some(pattern) = &args.pattern {
        let wanted = pattern.to_lowercase();
        let has = |text: &str| text.to_lowercase().contains(&wanted);
        keys.retain(|info| has(&info.key) || has(&info.description));
        if keys.is_empty() {
            let why = "no key has this in its name or description; `rig keys` lists all";
            return Err(Failure::input(format!("{pattern}: {why}")));
        }
    }
    output::result(args.json, &json!({ "rig": args.rig, "keys": keys }), || human(&keys))?;
    Ok(Outcome::Good)
}

fn human(keys: &[KeyInfo]) -> String {
    // Text throughout: every column is aligned to the left.
    let mut table = plain(&[], []);
    table.set_header(["key", "default", "range", "unit", "what"].map(Cell::new));
    for info in keys {
        let value = info.value.to_string();
        let range = info
            .range
            .map_or_else(String::new, |(low, high)| format!("{} to {}", short(low), short(high)));
        let mark = if info.measure { " [measure on your rig]" } else { "" };
        let what = format!("{}{mark}", info.description);
        table.add_row([&*info.key, &*value, &*range, info.unit, &*what].map(Cell::new));
    }
    // A broken key cannot be copied.
    if let Some(keys) = table.column_mut(0) {
        keys.set_constraint(ColumnConstraint::ContentWidth);
    }
    format!("{table}\n")
}

/// A bound with an exponent where it would be long.
fn short(bound: f64) -> String {
    if bound.abs() >= 1e6 { format!("{bound:.0e}") } else { bound.to_string() }
}
