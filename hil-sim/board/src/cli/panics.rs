//! `rig panics`: what of the image's panics the control tick can reach.

use hil_sim::cli::failure::{Failure, Outcome};

/// Walks the firmware's machine code from the control tick and the sensors' tasks to every
/// panic that branches lead to.
///
/// Each is listed with its place in the source and why it is never taken; calls through
/// registers are listed likewise. The exit code is 1 if one has no such reason.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Lists the way from the task to each as well.
    #[arg(long)]
    paths: bool,

    /// Prints what was found as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Without the emulated board's reader of images: go on with a binary that has it.
#[cfg(not(feature = "board"))]
pub(super) fn run(_: &Args) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(hil_sim::provision::go_on()?))
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    use hil_sim::cli::output;
    use hil_sim::firmware::{self, Profile};
    use crate::panics::walk;

    let elf = firmware::image(Profile::Release)?;
    let found = walk(&elf).map_err(Failure::run)?;
    output::result(args.json, &found, || human(&found, args.paths))?;
    Ok(Outcome::of(found.unexplained().next().is_none()))
}

fn human(found: &crate::panics::Found, paths: bool) -> String {
    use crate::panics::Site;

    let mut text = format!(
        "{} of {} functions can be reached from the control tick and the sensors' tasks.\n",
        found.reached, found.functions
    );
    let mut list = |head: &str, sites: &[Site]| {
        text += &format!("{head}: {}\n", sites.len());
        for site in sites {
            let function = site.frames.first().map_or("", |frame| &frame.function);
            let calls = if site.calls.is_empty() { "" } else { " -> " };
            text += &format!("  {:#010x} {}{calls}{}\n", site.address, function, site.calls);
            text += &format!("    at {}: ", site.place());
            text += site.reason.unwrap_or("NOT KNOWN TO BE HARMLESS");
            text.push('\n');
            if paths {
                for frame in &site.frames {
                    text += &format!("      in {} {}:{}\n", frame.function, frame.file, frame.line);
                }
                for function in &site.path {
                    text += &format!("      by {function}\n");
                }
            }
        }
    };
    list("panics", &found.panics);
    list("calls through registers", &found.indirect);
    text
}
