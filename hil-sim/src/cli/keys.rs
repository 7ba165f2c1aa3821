//! `rig keys`: the parameters of a scenario.

use clap::builder::PossibleValuesParser;
use comfy_table::{Cell, ColumnConstraint};
use serde_json::json;

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

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let keys = Scenario::named(&args.rig)?.keys();
    output::result(args.json, &json!({ "rig": args.rig, "keys": keys }), || human(&keys))?;
    Ok(Outcome::Good)
}

fn human(keys: &[KeyInfo]) -> String {
    // Text throughout: every column is aligned to the left.
    let mut table = plain(&[], []);
    table.set_header(["key", "default", "unit", "what"].map(Cell::new));
    for info in keys {
        let value = info.value.to_string();
        table.add_row([&*info.key, &*value, info.unit, &*info.description].map(Cell::new));
    }
    // A broken key cannot be copied.
    if let Some(keys) = table.column_mut(0) {
        keys.set_constraint(ColumnConstraint::ContentWidth);
    }
    format!("{table}\n")
}
