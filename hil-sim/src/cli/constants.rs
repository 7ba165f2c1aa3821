//! `rig constants`: the generated constants of the reduced model.

use std::path::{Path, PathBuf};

use interstage::supervise::Direction;
use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use crate::constants::{crossings, generate};
use crate::export::write_text;
use crate::progress;
use crate::table::{number, plain};

/// Regenerates the constants of the reduced model from crossings of the ring.
///
/// Writes `src/model/constants.rs` of the workspace.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Writes nothing; exit code 1 if the file in place is stale.
    #[arg(long)]
    check: bool,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints; errors are those of the effective stiffness, relative, way
/// out and way back.
#[derive(Serialize)]
struct Printed {
    path: PathBuf,
    current: bool,
    written: bool,
    max_rel_error: [f64; 2],
    rms_rel_error: [f64; 2],
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("src/model/constants.rs");
    let old = std::fs::read_to_string(&path)
        .map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
    let (new, errors) = {
        let bar = progress::bar("crossings", crossings() as u64);
        generate(&|| bar.advance(1)).map_err(|error| Failure::run(format!("{error:#}")))?
    };
    let current = old == new;
    let written = !current && !args.check;
    if written {
        write_text(&path, &new)?;
    }
    let printed = Printed {
        path,
        current,
        written,
        max_rel_error: errors.map(|(max, _)| max),
        rms_rel_error: errors.map(|(_, rms)| rms),
    };
    output::result(args.json, &printed, || human(&printed))?;
    Ok(Outcome::of(current || written))
}

fn human(printed: &Printed) -> String {
    let rows = [Direction::Deploy, Direction::Retract].iter().enumerate().map(|(index, way)| {
        let percent = |errors: [f64; 2]| number(100.0 * errors[index], 2);
        let name = if *way == Direction::Deploy { "way out" } else { "way back" };
        vec![name.to_owned(), percent(printed.max_rel_error), percent(printed.rms_rel_error)]
    });
    let state = match (printed.current, printed.written) {
        (true, _) => "is current",
        (false, true) => "rewritten",
        (false, false) => "is stale: run `cargo rig constants`",
    };
    format!(
        "Error of the effective stiffness against the ring\n{}\n{} {state}\n",
        plain(&["", "max %", "RMS %"], rows),
        printed.path.display()
    )
}
