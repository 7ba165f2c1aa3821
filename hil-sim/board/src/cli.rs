//! The verbs of `rig` that run on the emulated board.

mod deploy;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use hil_sim::bringup::Operation;
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::{bringup, capture, faults, live, operate, output, params};
use hil_sim::faults::campaign::Twin;
use hil_sim::firmware::{self, Profile, build_binary};
use hil_sim::params::Client;
use hil_sim::progress;
use hil_sim::record::Virtual;
use hil_sim::scenario::{Direction, Scenario};
use serde::Serialize;

use crate::bench::Bench;
use crate::bringup::Attended;
use crate::campaign::{self, Board, Firmware};
use crate::cycles::{self, Step, TickCycles};
use crate::image::Image;
use crate::load;
use crate::log::Strings;
use crate::run::{self, RunOptions};
use crate::wiring::Mistake;

/// The verbs of `rig` on the emulated board; `rig` starts this program where one needs it.
#[derive(Debug, Parser)]
#[command(name = "rig-board", bin_name = "cargo rig", version, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Deploy(hil_sim::cli::deploy::Args),
    Bringup(bringup::Args),
    Capture(capture::Args),
    Live(live::Args),
    Faults(faults::Args),
    Params(params::Args),
    #[command(flatten)]
    Operate(operate::Verb),
    #[command(hide = true)]
    Cycles(CyclesArgs),
}

/// Textbook cycles of the measuring image's functions.
///
/// With a script, the results of its steps; without one, the control tick over a deployment
/// and a retraction of the prototype, and its task in the firmware over a deployment, with and
/// without the flash's wait states.
#[derive(Debug, clap::Args)]
struct CyclesArgs {
    /// Steps to carry out, a JSON array: see `rig_board::cycles::Step`.
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,

    /// Prints one JSON object, as is the default.
    #[arg(long)]
    json: bool,
}

/// What the control tick costs.
#[derive(Serialize)]
struct Measured {
    /// By itself.
    #[serde(flatten)]
    tick: TickCycles,
    /// Its task in the firmware.
    firmware: load::Cost,
}

/// Runs the command with the arguments of this process.
pub fn main() -> ExitCode {
    hil_sim::cli::run(|cli: &Cli| match &cli.verb {
        Verb::Deploy(args) => deploy::run(args),
        Verb::Bringup(args) => bring_up(args),
        Verb::Capture(args) => capture(args),
        Verb::Live(args) => live(args),
        Verb::Faults(args) => faults(args),
        Verb::Params(args) => params(args),
        Verb::Operate(verb) => operate(verb),
        Verb::Cycles(args) => cycles(args),
    })
}

/// The firmware as it is flashed, with the strings of its log, for a scenario that it can
/// run.
fn image(scenario: &Scenario) -> Result<(Vec<u8>, Strings), Failure> {
    crate::run::check(scenario).map_err(Failure::input)?;
    let elf = firmware::image(Profile::Release)?;
    let strings = Strings::of(&elf).map_err(Failure::run)?;
    Ok((elf, strings))
}

/// The first power-up of the emulated board, with the mistakes in its wiring that are asked for.
fn bring_up(args: &bringup::Args) -> Result<Outcome, Failure> {
    if args.log.is_some() {
        return bringup::run(args);
    }
    let mistake = |name: &String| {
        Mistake::from_str(name, false).map_err(|_| {
            let all = Mistake::value_variants().iter().filter_map(Mistake::to_possible_value);
            let names: Vec<_> = all.map(|value| value.get_name().to_owned()).collect();
            Failure::input(format!("--mistake {name}: expected one of {}", names.join(", ")))
        })
    };
    let mistakes: Vec<Mistake> = args.mistake.iter().map(mistake).collect::<Result<_, _>>()?;
    let scenario = args.scenario()?.unwrap_or_default();
    let (elf, strings) = image(&scenario)?;
    let mut bench = Bench::wired(&elf, &strings, &scenario, &mistakes).map_err(Failure::run)?;
    crate::params::store(&mut bench.machine, &scenario).map_err(Failure::run)?;
    let mut board = Attended::new(bench);
    let mut person = board.person(bringup::person(args.yes));
    bringup::carry_out(args, &mut board, &mut person)
}

/// An operator's verb: stowed to jog and zero, pressed at the end of travel to release and go home.
fn operate(verb: &operate::Verb) -> Result<Outcome, Failure> {
    let mut scenario = Scenario::default();
    if matches!(verb.parts().0, Operation::Home | Operation::Release) {
        scenario.run.direction = Direction::Retract;
    }
    let (elf, strings) = image(&scenario)?;
    let mut bench = Bench::new(&elf, &strings, &scenario).map_err(Failure::run)?;
    operate::carry_out(verb, &mut bench)
}

fn capture(args: &capture::Args) -> Result<Outcome, Failure> {
    let scenario = args.source.run.resolve()?;
    let (elf, strings) = image(&scenario)?;
    capture::write(args, &mut emulated(&elf, &strings, &scenario, false)?, &scenario)
}

fn live(args: &live::Args) -> Result<Outcome, Failure> {
    let scenario = args.source.run.resolve()?;
    let (elf, strings) = image(&scenario)?;
    let mut source = emulated(&elf, &strings, &scenario, !args.headless)?;
    live::watch(args, &mut source, &scenario)
}

/// The board as a source of its log.
fn emulated<'a>(
    elf: &'a [u8],
    strings: &'a Strings,
    scenario: &Scenario,
    attended: bool,
) -> Result<Virtual<Board<'a>>, Failure> {
    let board = Board::new(Firmware { elf, strings }, scenario).map_err(Failure::run)?;
    Ok(Virtual::of(board, scenario, attended))
}

fn faults(args: &faults::Args) -> Result<Outcome, Failure> {
    let campaign = args.campaign()?;
    let (elf, strings) = image(&campaign.scenario)?;
    let firmware = Firmware { elf: &elf, strings: &strings };
    let twin = |scenario: &Scenario| campaign::twin(firmware, scenario).map_err(Failure::run);
    let watched = |scenario: &Scenario, twin: &Twin| {
        campaign::watched(firmware, scenario, twin).map_err(Failure::run)
    };
    faults::carry_out(args, &campaign, twin, watched)
}

/// Starts the board with the flash that the file holds, does what was asked with its
/// parameters, and writes the flash back to the file even if that failed.
fn params(args: &params::Args) -> Result<Outcome, Failure> {
    let elf = firmware::image(Profile::Release)?;
    if let Some(folder) = args.flash.parent() {
        fs::create_dir_all(folder)
            .map_err(|error| Failure::input(format!("{}: {error}", folder.display())))?;
    }
    let mut client = {
        let _progress = progress::spinner("starting the board");
        Client::new(crate::params::start(&elf, &args.flash)?)
    };
    let outcome = params::act(args, &mut client);
    crate::params::keep(&client.into_port(), &args.flash)?;
    outcome
}

fn cycles(args: &CyclesArgs) -> Result<Outcome, Failure> {
    let (package, binary) = cycles::IMAGE;
    let read = hil_sim::cli::deploy::read;
    let elf = read(&build_binary(package, binary, Profile::Release, &[])?)?;
    let mut image = Image::start(&elf).map_err(Failure::run)?;
    let none = String::new;
    if let Some(path) = &args.script {
        let steps: Vec<Step> = serde_json::from_slice(&read(path)?).map_err(Failure::input)?;
        let done = cycles::run(&mut image, &steps).map_err(Failure::run)?;
        output::result(true, &done, none)?;
    } else {
        let tick = cycles::tick(&mut image, &Scenario::default()).map_err(Failure::run)?;
        let elf = firmware::image(Profile::Release)?;
        let options = RunOptions { wait_states: true, ..RunOptions::default() };
        let ran = run::run(&elf, &Scenario::default(), &options, |_, _| {});
        let firmware = ran.map_err(Failure::run)?.load.tick;
        output::result(true, &Measured { tick, firmware }, none)?;
    }
    Ok(Outcome::Good)
}
