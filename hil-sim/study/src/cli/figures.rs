//! `rig-study figures`: the figures that `docs/MODEL.md` refers to.

use super::{docs, failed, write};
use crate::figure_svg::svg;
use crate::model_figures;
use hil_sim::cli::failure::{Failure, Outcome};

/// Writes `docs/figures/model.json` and `docs/figures/model.svg`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(_: &Args) -> Result<Outcome, Failure> {
    let figures = model_figures::compute().map_err(failed)?;
    let text = serde_json::to_string_pretty(&figures).map_err(Failure::run)? + "\n";
    let plot = svg(&model_figures::figure().map_err(failed)?);
    write(&docs().join("figures"), [("model.json", text), ("model.svg", plot)])?;
    Ok(Outcome::Good)
}
