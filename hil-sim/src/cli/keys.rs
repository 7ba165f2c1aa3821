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
    output::result(args.json, &json!({ "rig": args.rig, "keys": keys }), || human(keys.clone()))?;
    Ok(Outcome::Good)
}

/// Those that matter first.
const FIRST: &str = "preset rig.step_positions_mm rig.step_height_mm rig.travel_mm \
    rig.wheel_radius_mm rig.wall_radius_mm rig.step_tolerance_mm tread.k_inf_pa_per_m \
    tread.stiffening tread.tau_s plant.mu plant.top_load_n plant.top_load_share \
    plant.arm_coupling preload.cruise_n preload.limit_n preload.delay_s preload.lag_s \
    preload.slew_n_per_s preload.spring_n_per_mm drive.cruise_speed_mm_s \
    drive.min_crossing_speed_mm_s drive.force_limit_n sense.angle_zero_code control.gap_ref_mm \
    control.safe_speed_mm_s mismatch.friction run.direction run.controller run.seed run.mismatch";

fn human(mut keys: Vec<KeyInfo>) -> String {
    let place = |info: &KeyInfo| FIRST.split_whitespace().position(|key| key == info.key);
    let section = |info: &KeyInfo| info.key.split('.').next().unwrap_or_default().to_owned();
    let group_of = |info: &KeyInfo| place(info).map_or(section(info), |_| "first".to_owned());
    keys.sort_by_key(|info| place(info).unwrap_or(usize::MAX));
    // Text throughout: every column is aligned to the left.
    let mut table = plain(&[""; 0], []);
    table.set_header(["key, default", "what"].map(Cell::new));
    let mut group = String::new();
    for info in &keys {
        if group_of(info) != group {
            group = group_of(info);
            table.add_row([Cell::new(format!("[{group}]"))]);
        }
        let range = info
            .range
            .map_or_else(String::new, |(low, high)| format!(" {} to {}.", short(low), short(high)));
        let mark = if info.measure { " [measure on your rig]" } else { "" };
        let what = format!("{}{range}{mark}", info.description);
        table.add_row([format!("{}\n  {} {}", info.key, info.value, info.unit), what]);
    }
    // A broken key cannot be copied; the rest of the width is the description's.
    if let Some(keys) = table.column_mut(0) {
        keys.set_constraint(ColumnConstraint::ContentWidth);
    }
    format!("{table}\n")
}

/// A bound with an exponent where it would be long.
fn short(bound: f64) -> String {
    if bound.abs() >= 1e6 { format!("{bound:.0e}") } else { bound.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keys_that_matter_come_first_and_their_description_has_the_width() {
        let keys = Scenario::default().keys();
        for first in FIRST.split_whitespace() {
            assert!(keys.iter().any(|info| info.key == first), "{first}");
        }
        let text = human(keys);
        let line = |part: &str| {
            text.lines().position(|line| line.trim_start().starts_with(part)).expect(part)
        };
        assert!((1..6).contains(&line("[first]")) && line("[first]") < line("plant.mu"));
        assert!(line("sense.angle_zero_code") < line("[spread]"), "{text}");
        let longest = text.lines().map(|line| line.chars().count()).max().expect("lines");
        assert!(longest <= 100, "{longest}");
        assert!(text.lines().count() < 600, "{} lines", text.lines().count());
    }
}
