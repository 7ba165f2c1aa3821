//! `rig constants`: the generated constants of the reduced model, and the sets of
//! parameters made with them.

use std::path::{Path, PathBuf};

use interstage::model::felt::Kind;
use interstage::model::formula::Formula;
use interstage::params::{MAX_SET, compile};
use interstage::rig::Rig;
use serde::Serialize;

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output;
use crate::constants::data::{self, Row};
use crate::constants::design::Use;
use crate::constants::{fit, plan, source, stored, sweep, verify};
use hil_sim::files::write_text;
use hil_sim::progress;
use hil_sim::table::{number, plain};

/// Of how many stored crossings `--check` runs one again.
const CHECKED_ONE_IN: usize = 50;

/// Regenerates the constants of the reduced model from crossings of the ring.
///
/// Runs all crossings, which takes some minutes, writes them to
/// `hil-sim/data/crossings.csv`, fits the model and writes `src/model/constants.rs`.
/// What the image carries is made with the constants in this program, so `cargo rig
/// constants --set` follows.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Fits the stored crossings again without running them.
    #[arg(long)]
    refit: bool,

    /// Writes nothing; exit code 1 if a sample of the crossings or the constants are
    /// stale.
    #[arg(long, conflicts_with = "refit")]
    check: bool,

    /// Writes `src/params/prototype.set`, the parameters that the image carries, with the
    /// constants that this program was built with, and nothing else.
    #[arg(long, conflicts_with_all = ["refit", "check"])]
    set: bool,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed {
    path: PathBuf,
    current: bool,
    written: bool,
    crossings: usize,
    kinds: Vec<Quality>,
}

/// How well the constants in the program fit the crossings: effective stiffness over the
/// fitted ones, relative, and gap over those left out of the fit, in parts of 1 % or
/// 10 um, whichever is larger.
#[derive(Serialize)]
struct Quality {
    kind: &'static str,
    fitted: usize,
    stiffness_max: f64,
    stiffness_rms: f64,
    held: usize,
    gap_max: f64,
    gap_rms: f64,
}

/// What `--json` prints with `--set`.
#[derive(Serialize)]
struct PrintedSet {
    path: PathBuf,
    bytes: usize,
    written: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.set {
        return write_set(args.json);
    }
    let failed = |error: anyhow::Error| Failure::run(format!("{error:#}"));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("src/model/constants.rs");
    let old = std::fs::read_to_string(&path)
        .map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
    let rows = if args.refit || args.check {
        stored().map_err(failed)?
    } else {
        let bar = progress::bar("crossings", plan().len() as u64);
        sweep(&|| bar.advance(1)).map_err(failed)?
    };
    let fresh = if args.check {
        let bar = progress::bar("crossings", rows.len().div_ceil(CHECKED_ONE_IN) as u64);
        verify(&rows, CHECKED_ONE_IN, &|| bar.advance(1))
    } else {
        Ok(())
    };
    let new = source(&rows).map_err(failed)?;
    let current = old == new && fresh.is_ok();
    let written = !current && !args.check;
    if written {
        write_text(&data::path(), &data::write(&rows))?;
        write_text(&path, &new)?;
    }
    let printed = Printed {
        path,
        current,
        written,
        crossings: rows.len(),
        kinds: Kind::ALL.map(|kind| quality(kind, &rows)).into(),
    };
    output::result(args.json, &printed, || human(&printed))?;
    fresh.map_err(failed)?;
    Ok(Outcome::of(current || written))
}

/// Writes the set of the prototype if it is not what the image carries already.
fn write_set(json: bool) -> Result<Outcome, Failure> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("src/params/prototype.set");
    let mut room = [0; MAX_SET];
    let length = compile("prototype", &Rig::prototype(), &mut room)
        .map_err(|error| Failure::run(error.to_string()))?;
    let set = &room[..length];
    let written = std::fs::read(&path).ok().as_deref() != Some(set);
    if written {
        std::fs::write(&path, set)
            .map_err(|error| Failure::run(format!("{}: {error}", path.display())))?;
    }
    let printed = PrintedSet { path, bytes: length, written };
    output::result(json, &printed, || {
        let state = if written { "rewritten" } else { "is current" };
        format!("{} {state}, {length} bytes\n", printed.path.display())
    })?;
    Ok(Outcome::of(true))
}

/// Errors of the constants built into this program.
fn quality(kind: Kind, rows: &[Row]) -> Quality {
    let formula = Formula::new(&Rig::fe());
    let stiffness: Vec<f64> = rows
        .iter()
        .filter(|row| row.case.kind == kind && fit::takes_part(row) && row.of == Use::Fit)
        .map(|row| fit::stiffness_error(&formula, row))
        .collect();
    let gap: Vec<f64> = rows
        .iter()
        .filter(|row| row.case.kind == kind && row.of == Use::Hold)
        .map(|row| fit::gap_error(&formula, row))
        .collect();
    let most = |errors: &[f64]| errors.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
    let rms = |errors: &[f64]| {
        (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt()
    };
    Quality {
        kind: data::kind_name(kind),
        fitted: stiffness.len(),
        stiffness_max: most(&stiffness),
        stiffness_rms: rms(&stiffness),
        held: gap.len(),
        gap_max: most(&gap),
        gap_rms: rms(&gap),
    }
}

fn human(printed: &Printed) -> String {
    let rows = printed.kinds.iter().map(|quality| {
        vec![
            quality.kind.to_owned(),
            quality.fitted.to_string(),
            number(100.0 * quality.stiffness_max, 2),
            number(100.0 * quality.stiffness_rms, 2),
            quality.held.to_string(),
            number(quality.gap_max, 2),
            number(quality.gap_rms, 2),
        ]
    });
    let state = match (printed.current, printed.written) {
        (true, _) => "is current",
        (false, true) => "rewritten: the errors above are those of the constants before",
        (false, false) => "is stale: run `cargo rig constants`, then `cargo rig constants --set`",
    };
    let columns = ["", "fitted", "stiffness max %", "RMS %", "held out", "gap max", "RMS"];
    format!(
        "Constants in this program against the ring; gap in parts of 1 % or 10 um\n{}\n{} {state}\n",
        plain(&columns, rows),
        printed.path.display()
    )
}
