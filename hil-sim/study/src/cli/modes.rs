//! `rig modes`: natural frequencies of the arm.

use clap::builder::PossibleValuesParser;
use serde::Serialize;

use crate::reference::beam::{Beam, BeamError, Ends, Mode, Tip};
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output;
use hil_sim::table::{number, plain};

/// Natural frequencies of the drive arm by the wave-vector method.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// How the arm is held at the pillar, and its other end.
    #[arg(long, value_name = "ENDS", default_value = "clamped-free",
          value_parser = PossibleValuesParser::new(Ends::ALL.map(Ends::name)))]
    ends: String,

    /// Point mass at the wheel's end, kg.
    #[arg(long, value_name = "M", default_value_t = 0.0, allow_negative_numbers = true)]
    tip_mass_kg: f64,

    /// How many modes.
    #[arg(long, value_name = "N", default_value_t = 4)]
    count: usize,

    /// Prints the modes as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    ends: &'a str,
    tip_mass_kg: f64,
    frequencies_hz: Vec<f64>,
    beta_l: Vec<f64>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let ends: Ends = args.ends.parse().map_err(Failure::input)?;
    let tip = Tip { mass_kg: args.tip_mass_kg, ..Tip::default() };
    let beam = Beam::drive_arm();
    let modes = beam.modes(ends, tip, args.count).map_err(|error| refused(&error))?;
    let printed = Printed {
        ends: &args.ends,
        tip_mass_kg: args.tip_mass_kg,
        frequencies_hz: modes.iter().map(|mode| mode.frequency_hz).collect(),
        beta_l: modes.iter().map(|mode| mode.beta_l).collect(),
    };
    output::result(args.json, &printed, || human(args, &beam, &modes))?;
    Ok(Outcome::Good)
}

/// The error in terms of the options.
fn refused(error: &BeamError) -> Failure {
    Failure::input(match error {
        BeamError::OutOfRange { argument: "tip.mass_kg", value, expected } => {
            format!("--tip-mass-kg {value}: expected {expected}")
        }
        BeamError::OutOfRange { argument: "count", value, expected } => {
            format!("--count {value}: expected {expected}")
        }
        other => other.to_string(),
    })
}

fn human(args: &Args, beam: &Beam, modes: &[Mode]) -> String {
    let rows = modes.iter().enumerate().map(|(index, mode)| {
        vec![(index + 1).to_string(), number(mode.frequency_hz, 2), number(mode.beta_l, 6)]
    });
    format!(
        "Drive arm of {:.0} mm and {:.1} g, {}, {:.1} g at the tip\n{}\n",
        beam.length_m * 1e3,
        beam.mass_kg() * 1e3,
        args.ends,
        args.tip_mass_kg * 1e3,
        plain(&["mode", "Hz", "beta L"], rows)
    )
}
