//! The source of a log, for `capture` and `live`.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::failure::{Failure, Outcome};
use super::scenario::{RunArgs, remind};
use crate::bringup::gates;
use crate::record::{Bytes, Probed, Source, Virtual};
use crate::scenario::Scenario;

/// What can run the controller.
pub(super) const TARGETS: [&str; 3] = ["sil", "board", "probe"];

/// The source of a log.
#[derive(Debug, clap::Args)]
pub struct SourceArgs {
    #[command(flatten)]
    pub run: RunArgs,

    /// Reads a recorded stream of the binary channel; `-` is standard input.
    #[arg(long, value_name = "FILE", conflicts_with = "target")]
    stream: Option<PathBuf>,

    /// What runs the controller: sil, this host; board, the firmware on an emulated board; or
    /// probe, a real board, which is not changed: give the scenario file that it holds, so that
    /// the log has its parameters. Its probe may be unplugged for up to two minutes.
    #[arg(long, value_name = "TARGET", default_value = "sil", value_parser = TARGETS)]
    target: String,
}

impl SourceArgs {
    /// Opens the source, `attended` by an operator or not, and hands it to `act` with the
    /// scenario that it runs, or is said to run.
    pub(super) fn open(
        &self,
        attended: bool,
        act: impl FnOnce(&mut dyn Source, &Scenario) -> Result<Outcome, Failure>,
    ) -> Result<Outcome, Failure> {
        let scenario = self.run.resolve()?;
        if let Some(path) = &self.stream {
            return act(&mut opened(path)?, &scenario);
        }
        match self.target.as_str() {
            "sil" => act(&mut Virtual::new(&scenario, attended)?, &scenario),
            target => {
                let port = super::probe::reconnecting(target)?;
                remind("the rig at the probe", &scenario);
                if let Some(lacking) = gates::lacking(self.run.scenario.file()) {
                    eprintln!("the rig at the probe: {lacking}");
                }
                act(&mut Probed::new(port), &scenario)
            }
        }
    }
}

fn opened(path: &Path) -> Result<Bytes, Failure> {
    if path == Path::new("-") {
        return Ok(Bytes::new("standard input".to_owned(), Box::new(std::io::stdin())));
    }
    let name = path.display().to_string();
    let input = File::open(path).map_err(|error| Failure::input(format!("{name}: {error}")))?;
    Ok(Bytes::new(name, Box::new(input)))
}
