//! `rig docs`: the generated pages and pictures of `docs/`.

use std::path::Path;

use super::failure::{Failure, Outcome};
use super::{compare as compare_verb, montecarlo as montecarlo_verb, output};
use crate::compare;
use crate::docs;
use crate::export::write_text;
use crate::faults::campaign::{self as faults, Campaign};
use crate::montecarlo;
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::ring::RingParameters;
use crate::progress;
use crate::report;
use crate::scenario::Scenario;
use crate::sil;
use crate::table;

/// Writes the generated parts of `docs/`: modes and codes, the picture of a
/// deployment, the results that the other pages refer to, figures and plot of the page on
/// the model, and the campaign of faults.
///
/// Takes several minutes; the lengths are for trying it out.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Writes this part alone.
    #[arg(long, value_name = "PART")]
    only: Option<Part>,

    /// Random rigs of the campaign, each way.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    runs: u64,

    /// Instants at which each fault comes.
    #[arg(long, value_name = "N", default_value_t = 100)]
    instants: usize,

    /// Random rigs of the comparison of strategies.
    #[arg(long, value_name = "N", default_value_t = 200)]
    rigs: usize,
}

/// Parts that can be written alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// Modes, faults and limits.
    Modes,
    /// The results, and the picture of a deployment.
    Results,
    /// The generated blocks of the page on the model, and its plot.
    Model,
    /// The generated blocks of the page on faults.
    Safety,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs");
    let mut written = Vec::new();
    let mut write = |name: &str, text: &str| -> Result<(), Failure> {
        let path = folder.join(name);
        write_text(&path, text)?;
        written.push(path);
        Ok(())
    };
    let wanted = |part| args.only.is_none_or(|only| only == part);
    if wanted(Part::Modes) {
        write("MODES.md", &docs::modes())?;
    }
    if wanted(Part::Model) {
        let page = std::fs::read_to_string(folder.join("MODEL.md")).map_err(Failure::run)?;
        write("MODEL.md", &docs::fill_model(&page).map_err(Failure::run)?)?;
        write("model.svg", &docs::model_svg().map_err(Failure::run)?)?;
    }
    if wanted(Part::Safety) {
        let page = std::fs::read_to_string(folder.join("SAFETY.md")).map_err(Failure::run)?;
        let outcome = campaign(args.instants)?;
        write("SAFETY.md", &docs::fill_safety(&page, &outcome).map_err(Failure::run)?)?;
    }
    if wanted(Part::Results) {
        let recording = deploy(&[])?;
        write("deployment.svg", &report::overview_svg(&recording))?;
        write("RESULTS.md", &results(args, &recording)?)?;
    }
    output::print(&written.iter().map(|path| shown(path)).collect::<String>())?;
    Ok(Outcome::of(true))
}

fn shown(path: &Path) -> String {
    format!("{}\n", path.display())
}

/// Every fault at so many instants.
fn campaign(instants: usize) -> Result<faults::Outcome, Failure> {
    let campaign = Campaign { scenario: Scenario::default(), instants, cases: faults::Case::all() };
    let bar = progress::bar("faults", campaign.runs());
    Ok(campaign.run(&|| bar.advance(1))?)
}

fn deploy(sets: &[String]) -> Result<crate::record::Recording, Failure> {
    let scenario = Scenario::resolve(None, None, sets)?;
    Ok(sil::run(&scenario, sil::Options { rows: true, speed: None })?)
}

fn results(args: &Args, deployed: &crate::record::Recording) -> Result<String, Failure> {
    let mut page = docs::head("Results");
    page += "\nFigures of the virtual rig at the state of this page, each below the command \
             that prints it. The plant is a model: see [PLANT.md](PLANT.md) for what it takes \
             for granted.\n";
    let mut block = |command: &str, text: &str| {
        page += &format!("\n## `{command}`\n\n```text\n{}\n```\n", text.trim_end());
    };
    block("cargo rig deploy", &table::run(&deployed.summary, &[]));
    let back = deploy(&["run.direction=retract".into()])?;
    block("cargo rig deploy --retract", &table::run(&back.summary, &[]));
    block("cargo rig crossing --rig fe ...", &published()?);
    for (options, sets) in [("", vec![]), (" --retract", vec!["run.direction=retract".to_owned()])]
    {
        let scenario = Scenario::resolve(None, None, &sets)?;
        let seeds: Vec<u64> = (1..=args.runs).collect();
        let lines = {
            let bar = progress::bar("random rigs", args.runs);
            montecarlo::run(&scenario, &seeds, &|| bar.advance(1))?
        };
        let outcome = montecarlo::Outcome::of(&lines);
        let text = format!(
            "{} of {} runs completed, {} slip events\n{}",
            outcome.completed,
            outcome.runs,
            outcome.slip_events,
            montecarlo_verb::human(&outcome)
        );
        block(&format!("cargo rig montecarlo -n {}{options}", args.runs), &text);
    }
    let scenario = Scenario::default();
    let comparison = {
        let bar = progress::bar("comparison, at most", compare::most_runs(args.rigs) as u64);
        compare::compare(&scenario, 1, args.rigs, &|| bar.advance(1))?
    };
    block(&format!("cargo rig compare -n {}", args.rigs), &compare_verb::human(&comparison));
    Ok(page)
}

/// The three published cases beside the ring: the gaps are those that the material was
/// fitted to, the forces are not.
fn published() -> Result<String, Failure> {
    let rig = interstage::rig::Rig::fe();
    let cases = [
        (5.0, 100.0, 1.7079, 56.5261),
        (5.0, 120.0, 1.5567, 51.2358),
        (8.0, 100.0, 1.9014, 58.5963),
    ];
    let mut rows = Vec::new();
    for (speed, preload, gap, force) in cases {
        let result = cross(&CrossingCase {
            ring: RingParameters::of(&rig, 5760),
            step_height_mm: rig.rig.step_height_mm,
            speed_mm_s: speed,
            preload_n: preload,
            axial: Axial::Pushed,
            stride_mm: 0.005,
        })
        .map_err(Failure::run)?;
        rows.push(vec![
            format!("{speed}"),
            format!("{preload}"),
            table::number(Some(gap), 4),
            table::number(Some(result.gap_mm), 3),
            table::number(Some(force), 1),
            table::number(Some(result.corner_force_n), 1),
        ]);
    }
    let head = [
        "mm/s",
        "N",
        "gap published (fitted)",
        "gap of the ring",
        "force published (not fitted)",
        "force of the ring",
    ];
    Ok(table::plain(&head, rows).to_string())
}
