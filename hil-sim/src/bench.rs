//! Run time against error, measured: the plant's resolution, other engines and
//! solvers on one identical crossing, and what skipping saves.
//!
//! Times are processor time of one thread, the least of several runs from the same
//! state, with the answer used and checked. They depend on the machine; the ratios
//! within one run hardly do, and errors and counts do not at all. The last are held
//! by `budget.toml`, the first two are kept in the history.

pub mod budget;
pub mod chart;
pub mod clock;
pub mod history;
pub mod machine;
pub mod mesh;
pub mod page;
pub mod peers;
pub mod problem;
pub mod run;

use anyhow::Result;
use serde::Serialize;

use budget::{Budget, Line};
use machine::Machine;
use mesh::Precision;
use peers::Peers;
use problem::{Problem, Truth};
use run::Costs;

/// How much finer than the default the converged run of a quick measurement is.
const QUICK_FINER: usize = 4;

/// What is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The other engines and solvers too; sets up what they need.
    pub peers: bool,
    /// Fewer resolutions against a less converged run: for trying it out.
    pub quick: bool,
}

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Version of this package.
    pub version: &'static str,
    /// What it was measured on.
    pub machine: Machine,
    /// The plant.
    pub plant: Plant,
    /// The others, if they were asked for and could be had.
    pub peers: Option<Peers>,
    /// Why they are left out.
    pub peers_left_out: Option<String>,
    /// Bounds and whether they are kept.
    pub budgets: Vec<Line>,
}

/// Work and precision of the plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plant {
    /// How much finer than the default the converged answers are.
    pub finer: usize,
    /// Largest doubt about a converged answer, relative.
    pub doubt: f64,
    /// Resolutions.
    pub meshes: Vec<Precision>,
    /// Whole runs.
    pub costs: Costs,
}

impl Plant {
    /// The resolution that the plant runs with unless told otherwise.
    #[must_use]
    pub fn default_mesh(&self) -> Option<&Precision> {
        self.meshes.iter().find(|mesh| mesh.default)
    }
}

/// Measures; `say` hears what is going on.
///
/// # Errors
/// If a crossing cannot be balanced or a run does not complete.
pub fn measure(options: Options, say: &(dyn Fn(&str) + Sync)) -> Result<Report> {
    say("whole runs");
    let costs = run::measure()?;
    say("converged crossings");
    let problems = Problem::all();
    let finer = if options.quick { QUICK_FINER } else { problem::FINER };
    let truths = problem::converged(&problems, finer)?;
    say("resolutions");
    let meshes = if options.quick { mesh::few() } else { mesh::meshes() };
    let meshes: Result<Vec<Precision>, _> = meshes
        .into_iter()
        .map(|(sweep, mesh)| mesh::measure(sweep, mesh, &problems, &truths))
        .collect();
    let doubt = truths.iter().map(|truth| truth.doubt).fold(0.0, f64::max);
    let plant = Plant { finer, doubt, meshes: meshes?, costs };
    let (peers, peers_left_out) = peers_if(options.peers, &truths[0], say);
    let mut report = Report {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::here(),
        plant,
        peers,
        peers_left_out,
        budgets: Vec::new(),
    };
    report.budgets = Budget::shipped()?.lines(&report);
    Ok(report)
}

/// The peers, or in one line why not.
fn peers_if(
    wanted: bool,
    truth: &Truth,
    say: &(dyn Fn(&str) + Sync),
) -> (Option<Peers>, Option<String>) {
    if !wanted {
        return (None, Some("not asked for: `rig bench --peers` sets them up".to_owned()));
    }
    match peers::compare(truth, &|what| say(what)) {
        Ok(peers) => (Some(peers), None),
        Err(error) => (None, Some(format!("{error:#}").replace('\n', " "))),
    }
}

/// Errors of the default resolution alone, as a full measurement has them.
///
/// # Errors
/// If a crossing cannot be balanced.
pub fn default_precision() -> Result<Precision> {
    let problems = Problem::all();
    let truths = problem::converged(&problems, problem::FINER)?;
    Ok(mesh::measure("both", problem::Mesh::usual(), &problems, &truths)?)
}
