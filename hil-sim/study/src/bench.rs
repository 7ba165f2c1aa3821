//! Run time against error, measured: the reduced model in five arithmetics, the plant's
//! resolution, other engines and solvers on one identical crossing, and what skipping
//! saves.
//!
//! Times are processor time of one thread, the least of several runs from the same
//! state, with the answer used and checked. They depend on the machine; the ratios
//! within one run hardly do, and errors and counts do not at all. The last are held
//! by `budget.toml`, the first two are kept in the history.

pub mod arithmetic;
pub mod budget;
pub mod chart;
pub mod clock;
pub mod history;
pub mod machine;
pub mod page;
pub mod peers;
pub mod problem;
pub mod run;
pub mod skipping;

use anyhow::Result;
use interstage::rig::Rig;
use serde::Serialize;

use arithmetic::{Arithmetics, Variant};
use budget::{Budget, Line};
use machine::Machine;
use peers::Peers;
use problem::{Problem, Truth};
use run::Costs;
use skipping::Firmware;

use hil_sim::plant::precision::{FINER, Point, Setting, work_precision};

/// Crossings at a setting of which the fastest counts.
const REPEATS: usize = 5;

/// What is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The other engines and solvers too; sets up what they need.
    pub peers: bool,
    /// Cycles on the emulated core, if this binary has it.
    pub cycles: bool,
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
    /// The reduced model in five arithmetics.
    pub variants: Vec<Variant>,
    /// How they were compared.
    pub arithmetics: Arithmetics,
    /// Cycles of the control tick by phase and stage, if they were measured.
    pub account: Option<Firmware>,
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
    /// How much finer the measure of the errors is, in elements and in stride.
    pub finer: usize,
    /// What it runs with unless told otherwise.
    pub default: Setting,
    /// Error and cost by setting.
    pub settings: Vec<Point>,
    /// Whole runs.
    pub costs: Costs,
}

impl Plant {
    /// The default setting's errors and cost.
    #[must_use]
    pub fn usual(&self) -> Option<&Point> {
        self.settings.iter().find(|point| {
            (point.elements, point.stride_mm) == (self.default.elements, self.default.stride_mm)
        })
    }
}

/// Measures; `say` hears what is going on.
///
/// # Errors
/// If a crossing cannot be balanced or a run does not complete.
pub fn measure(options: Options, say: &(dyn Fn(&str) + Sync)) -> Result<Report> {
    say("arithmetics");
    let mut arithmetics = arithmetic::measure(options.quick, options.cycles)?;
    let variants = std::mem::take(&mut arithmetics.variants);
    say("control tick");
    let account = firmware(options.cycles)?;
    say("whole runs");
    let costs = run::measure(options.quick)?;
    say("resolutions");
    let default = Setting::usual();
    let (sweep, repeats) = if options.quick { (few(), 1) } else { (Setting::sweep(), REPEATS) };
    let settings = work_precision(&Rig::prototype(), &sweep, repeats, || ())?;
    let plant = Plant { finer: FINER, default, settings, costs };
    let (peers, peers_left_out) = peers_if(options.peers, say);
    let mut report = Report {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::here(),
        variants,
        arithmetics,
        account,
        plant,
        peers,
        peers_left_out,
        budgets: Vec::new(),
    };
    report.budgets = Budget::shipped()?.lines(&report);
    Ok(report)
}

/// The peers, or in one line why not.
fn peers_if(wanted: bool, say: &(dyn Fn(&str) + Sync)) -> (Option<Peers>, Option<String>) {
    if !wanted {
        return (None, Some("not asked for: `rig bench --peers` sets them up".to_owned()));
    }
    say("converged crossing");
    let found = Problem::published()
        .converged()
        .map_err(anyhow::Error::from)
        .and_then(|truth: Truth| peers::compare(&truth, &|what| say(what)));
    match found {
        Ok(peers) => (Some(peers), None),
        Err(error) => (None, Some(format!("{error:#}").replace('\n', " "))),
    }
}

#[cfg(feature = "board")]
fn firmware(wanted: bool) -> Result<Option<Firmware>> {
    wanted.then(skipping::measure).transpose()
}

#[cfg(not(feature = "board"))]
fn firmware(_: bool) -> Result<Option<Firmware>> {
    Ok(None)
}

/// The default setting and a coarse one.
fn few() -> Vec<Setting> {
    let usual = Setting::usual();
    vec![Setting { elements: usual.elements / 4, stride_mm: 4.0 * usual.stride_mm }, usual]
}
