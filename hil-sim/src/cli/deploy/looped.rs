//! `rig deploy` with hardware in the loop: the controller on a board, the plant here.

use std::path::Path;

use super::Args;
use crate::cli::failure::{Failure, Outcome};
use crate::scenario::Scenario;

/// Without probe-rs, and for the emulated board: starts a binary that has it.
#[cfg(not(feature = "probe"))]
pub(super) fn on_board(args: &Args, _: &Scenario, _: Option<&Path>) -> Result<Outcome, Failure> {
    Err(Failure::of_target(&args.target))
}

#[cfg(feature = "probe")]
pub(super) fn on_board(
    args: &Args,
    scenario: &Scenario,
    directory: Option<&Path>,
) -> Result<Outcome, Failure> {
    use crate::cli::probe::attach;
    use crate::firmware::{self, Profile};
    use crate::hil::Image;
    use crate::progress;

    // Reported before minutes of building.
    attach(&args.target, None)?;
    let path = firmware::build(Profile::Loop)?;
    let image = Image::of(&super::read(&path)?)?;
    let mut port = attach(&args.target, Some(image.block))?;
    if !image.is_on(&mut port).map_err(Failure::run)? {
        let _progress = progress::spinner("flashing the firmware for the loop");
        port.flash(&path).map_err(Failure::run)?;
    }
    let ended = close(args, &mut port, scenario, directory, "probe");
    eprintln!(
        "the board keeps the firmware for the loop, which moves no motor; `cargo rig flash` puts \
         the other back"
    );
    ended
}

/// Runs the scenario over this port.
pub fn close(
    args: &Args,
    port: &mut dyn crate::probe::Port,
    scenario: &Scenario,
    directory: Option<&Path>,
    target: &'static str,
) -> Result<Outcome, Failure> {
    use crate::hil::{self, Asked, HilError};
    use crate::progress;

    let asked = Asked { rows: directory.is_some(), target };
    let direction = scenario.run.direction.name();
    let recording = {
        let progress = progress::spinner(direction);
        hil::run(port, scenario, asked, |t_s| progress.say(&format!("{direction}, {t_s:.1} s")))
    };
    let recording = recording.map_err(|error| match error {
        HilError::Controller(_)
        | HilError::Rig(_)
        | HilError::Refused(_)
        | HilError::Parameters { .. } => Failure::input(error),
        _ => Failure::run(error),
    })?;
    super::conclude(args, &recording, directory)
}
