//! `rig modes`: natural frequencies of the arm.

use clap::ValueEnum;
use serde::Serialize;

use crate::reference::beam::{Beam, BeamError, Ends, Mode, Tip};
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output;
use hil_sim::table::{number, plain};

/// Natural frequencies of the drive arm by the wave-vector method.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// How the arm is held at the pillar, and its other end.
    #[arg(long, value_name = "ENDS", value_enum, default_value_t = Ends::ClampedFree)]
    ends: Ends,

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
struct Printed {
    ends: Ends,
    tip_mass_kg: f64,
    frequencies_hz: Vec<f64>,
    beta_l: Vec<f64>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let tip = Tip { mass_kg: args.tip_mass_kg, ..Tip::default() };
    let beam = Beam::drive_arm();
    let modes = beam.modes(args.ends, tip, args.count).map_err(refused)?;
    let printed = Printed {
        ends: args.ends,
        tip_mass_kg: args.tip_mass_kg,
        frequencies_hz: modes.iter().map(|mode| mode.frequency_hz).collect(),
        beta_l: modes.iter().map(|mode| mode.beta_l).collect(),
    };
    output::result(args.json, &printed, || human(args, &beam, &modes))?;
    Ok(Outcome::Good)
}

/// The error in terms of the options.
fn refused(error: BeamError) -> Failure {
    let option = if error.argument == "count" { "--count" } else { "--tip-mass-kg" };
    Failure::input(format!("{option} {}: expected {}", error.value, error.expected))
}

fn human(args: &Args, beam: &Beam, modes: &[Mode]) -> String {
    let rows = modes.iter().enumerate().map(|(index, mode)| {
        vec![(index + 1).to_string(), number(mode.frequency_hz, 2), number(mode.beta_l, 6)]
    });
    let ends = args.ends.to_possible_value();
    format!(
        "Drive arm of {:.0} mm and {:.1} g, {}, {:.1} g at the tip\n{}\n",
        beam.length_m * 1e3,
        beam.mass_kg() * 1e3,
        ends.as_ref().map_or("", |ends| ends.get_name()),
        args.tip_mass_kg * 1e3,
        plain(&["mode", "Hz", "beta L"], rows)
    )
}
