//! `rig jog`, `home`, `release`, `zero`: a rig at rest, moved by hand.

use super::bringup::person;
use super::failure::{Failure, Outcome};
use super::log_files::Stop;
use super::output;
use super::parse::distance;
use crate::bringup::{Line, Operated, Operation, Operator, operate};
use crate::probe::Port;

/// The verbs of an operator.
#[derive(Debug, clap::Subcommand)]
pub enum Verb {
    /// Turns the wheel a little, within the bounds of the firmware's service mode.
    ///
    /// Ctrl-C stops it. The controller does not know its position afterwards.
    Jog {
        /// Travel of the tread, mm, outwards if positive.
        #[arg(value_name = "MM", allow_negative_numbers = true, value_parser = distance)]
        distance_mm: f64,
        #[command(flatten)]
        place: Place,
    },
    /// Retracts to the stow end, from wherever the wheel is.
    ///
    /// Ctrl-C stops it.
    Home(Place),
    /// Takes the preload off: turns the pre-tightener back, drive at rest, within the bounds of
    /// the firmware's service mode.
    ///
    /// Without preload it turns it back by a second at a quarter of the duty: the wheel comes
    /// clear of the wall. Ctrl-C stops it. The wheel no longer holds the unit afterwards.
    Release(Place),
    /// Resets the controller, which takes the sensors' zeros at the stow end.
    ///
    /// It leaves a fault hold as well. The exit code is 1 if no zeros were taken.
    Zero(Place),
}

/// The board.
#[derive(Debug, clap::Args)]
pub struct Place {
    /// The board: probe, a real one, or board, the emulated one, stowed for jog and zero, and
    /// pressed at the end of travel for home and release.
    #[arg(long, value_name = "TARGET", default_value = "probe", value_parser = ["board", "probe"])]
    target: String,

    /// Allows the motion unasked.
    #[arg(long)]
    yes: bool,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

impl Verb {
    /// What is done, and where.
    pub const fn parts(&self) -> (Operation, &Place) {
        match self {
            Self::Jog { distance_mm, place } => (Operation::Jog(*distance_mm), place),
            Self::Home(place) => (Operation::Home, place),
            Self::Release(place) => (Operation::Release, place),
            Self::Zero(place) => (Operation::Zero, place),
        }
    }
}

/// Runs the verb.
pub(crate) fn run(verb: &Verb) -> Result<Outcome, Failure> {
    carry_out(verb, &mut super::probe::reconnecting(&verb.parts().1.target)?)
}

/// Carries it out at this port.
pub fn carry_out(verb: &Verb, port: &mut dyn Port) -> Result<Outcome, Failure> {
    let (operation, place) = verb.parts();
    let stop = Stop::by_ctrl_c();
    let person: &mut dyn Operator = &mut person(place.yes);
    let ended = operate(&mut Line::new(port), person, operation, &|| stop.is_wanted());
    let ended = ended.map_err(Failure::run)?;
    output::result(place.json, &ended, || human(&ended))?;
    Ok(Outcome::of(ended.done))
}

fn human(ended: &Operated) -> String {
    let Operated { done, note, mode, travel_mm, preload_n, compression_mm } = ended;
    let verdict = if *done { "done" } else { "NOT done" };
    format!(
        "{verdict}: {note}\n  {mode}; travel {travel_mm:+.2} mm, preload {preload_n:.1} N, \
         compression {compression_mm:.3} mm\n"
    )
}
