//! Where a log comes from: what `capture` and `live` have in common.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::failure::{Failure, Outcome};
use super::scenario::RunArgs;
use crate::provision::{self, Extra};
use crate::record::{Bytes, Source, Virtual};
use crate::scenario::Scenario;

/// What can run the controller.
const TARGETS: [&str; 3] = ["sil", "board", "probe"];

/// Refuses a target that is none.
pub(super) fn check_target(target: &str) -> Result<(), Failure> {
    if TARGETS.contains(&target) {
        return Ok(());
    }
    let available = TARGETS.join(", ");
    Err(Failure::input(format!("--target {target}: not available; available targets: {available}")))
}

/// The source of a log.
#[derive(Debug, clap::Args)]
pub struct SourceArgs {
    #[command(flatten)]
    run: RunArgs,

    /// Reads a recorded stream of the binary channel; `-` is standard input.
    #[arg(long, value_name = "FILE", conflicts_with = "target")]
    stream: Option<PathBuf>,

    /// What runs the controller: sil, this host; board, the firmware on an emulated board; or
    /// probe, a real board, which is left as it is; its probe may be unplugged for up to two
    /// minutes meanwhile.
    #[arg(long, value_name = "TARGET", default_value = "sil")]
    target: String,
}

impl SourceArgs {
    /// Opens the source, `attended` by an operator or not, and hands it to `act` with the
    /// scenario that it runs.
    pub(super) fn open(
        &self,
        attended: bool,
        act: impl FnOnce(&mut dyn Source, Option<&Scenario>) -> Result<Outcome, Failure>,
    ) -> Result<Outcome, Failure> {
        if let Some(path) = &self.stream {
            return act(&mut opened(path)?, None);
        }
        check_target(&self.target)?;
        let scenario = self.run.resolve()?;
        match self.target.as_str() {
            "sil" => act(&mut Virtual::new(&scenario, attended)?, Some(&scenario)),
            "board" => Ok(Outcome::Code(provision::go_on(Extra::Board)?)),
            _ => probe(act),
        }
    }

    /// What is to be run.
    pub fn scenario(&self) -> Result<Scenario, Failure> {
        self.run.resolve()
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

#[cfg(not(feature = "probe"))]
fn probe(
    _: impl FnOnce(&mut dyn Source, Option<&Scenario>) -> Result<Outcome, Failure>,
) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(provision::go_on(Extra::Probe)?))
}

#[cfg(feature = "probe")]
fn probe(
    act: impl FnOnce(&mut dyn Source, Option<&Scenario>) -> Result<Outcome, Failure>,
) -> Result<Outcome, Failure> {
    act(&mut crate::record::Probed::new(super::probe::reconnecting()?), None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_that_is_not_there_is_refused_with_those_that_are() {
        assert!(TARGETS.into_iter().all(|target| check_target(target).is_ok()));
        let error = check_target("moon").unwrap_err().to_string();
        let there = error.ends_with("available targets: sil, board, probe");
        assert!(error.contains("moon") && there, "{error}");
    }
}
