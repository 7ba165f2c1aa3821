//! The options that choose a rig and how it is run.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;

use super::failure::Failure;
use crate::scenario::{ControllerKind, PRESETS, Scenario};

/// Which rig.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct ScenarioArgs {
    /// Rig preset; by default that of the file.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(PRESETS))]
    rig: Option<String>,

    /// Overrides a parameter, any number of times; `rig keys` lists them.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,

    /// Scenario file, TOML.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,

    /// Scenario file, TOML; the same as --scenario.
    #[arg(value_name = "FILE", conflicts_with = "scenario")]
    file: Option<PathBuf>,
}

impl ScenarioArgs {
    /// The file, however it was given.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.scenario.as_deref().or(self.file.as_deref())
    }

    /// The scenario: preset, then file, then overrides.
    pub(crate) fn resolve(&self) -> Result<Scenario, Failure> {
        self.resolve_with(&[])
    }

    fn resolve_with(&self, last: &[String]) -> Result<Scenario, Failure> {
        let sets = [&self.set, last].concat();
        Ok(Scenario::resolve(self.rig.as_deref(), self.file(), &sets)?)
    }
}

/// Which rig, and how it is run.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct RunArgs {
    /// Which rig.
    #[command(flatten)]
    pub scenario: ScenarioArgs,

    /// Retraction: from the end of travel, dropping off the steps.
    #[arg(long)]
    retract: bool,

    /// How preload and speed are chosen; by default scheduled.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(ControllerKind::NAMES))]
    controller: Option<String>,

    /// A fault and its onset in seconds from boot, as in wheel.slip@2, in place of the scenario's
    /// `run.faults`, which can say more; may be repeated.
    #[arg(long, alias = "board-fault", value_name = "TARGET.KIND@S")]
    fault: Vec<String>,

    /// Draws by the seed, too, what the controller is not told: all of `mismatch.*` within
    /// its wide range.
    #[arg(long)]
    wide: bool,

    /// As --wide, with friction, load and heights of the steps far beyond the rig's design: to
    /// see whether what goes wrong is reported.
    #[arg(long, conflicts_with = "wide")]
    adversarial: bool,

    /// Seed of plant and noise; 0, the default, is the nominal plant.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    seed: Option<u64>,
}

/// Says which properties of the rig nobody has measured: no default of them is safe on another rig
/// than the preset's.
pub(super) fn remind(what: &str, scenario: &Scenario) {
    let (keys, preset) = (scenario.assumed(), &scenario.preset);
    if !keys.is_empty() {
        let keys = keys.join(", ");
        eprintln!(
            "{what}: these properties of the rig are the preset's, `{preset}`, and not measured. \
             Measure yours, or state a source of each under [sources]: {keys}"
        );
    }
}

/// Reads a seed.
pub(super) fn seed(text: &str) -> Result<u64, &'static str> {
    let seed = text.parse().ok().filter(|seed| *seed <= i64::MAX as u64);
    seed.ok_or("expected a whole number, 0 or more, at most 9223372036854775807")
}

impl RunArgs {
    /// Refuses `--controller`, and its key, where it has no effect.
    pub(super) fn without_controller(&self, because: &str) -> Result<(), Failure> {
        let set = self.scenario.set.iter().find(|set| set.starts_with("run.controller="));
        let found = self.controller.as_ref().map(|value| format!("--controller {value}"));
        let found = found.or_else(|| set.map(|set| format!("--set {set}")));
        found.map_or(Ok(()), |found| {
            Err(Failure::input(format!("{found}: has no effect, as {because}")))
        })
    }

    /// The scenario; the options come after every `--set`.
    pub fn resolve(&self) -> Result<Scenario, Failure> {
        let faults = self.fault.iter().map(entry_of).collect::<Result<Vec<_>, _>>()?;
        let flag = |is_given: bool, set: &str| is_given.then(|| set.to_owned());
        let sets = [
            flag(self.retract, "run.direction=retract"),
            flag(self.wide, "run.mismatch=wide"),
            flag(self.adversarial, "run.mismatch=adversarial"),
            self.controller.as_ref().map(|name| format!("run.controller={name}")),
            self.seed.map(|seed| format!("run.seed={seed}")),
            (!faults.is_empty()).then(|| format!("run.faults=[{}]", faults.join(","))),
        ];
        let sets: Vec<String> = sets.into_iter().flatten().collect();
        self.scenario.resolve_with(&sets)
    }
}

/// The entry of `run.faults` that a text of --fault is.
fn entry_of(text: &String) -> Result<String, Failure> {
    let parts = text.split_once('@').and_then(|(fault, at)| Some((fault.split_once('.')?, at)));
    let at = parts.and_then(|(_, at)| at.parse::<f64>().ok()).filter(|at| at.is_finite());
    let (Some(((target, kind), _)), Some(at)) = (parts, at) else {
        let error = format!("--fault {text}: expected TARGET.KIND@SECONDS, as in wheel.slip@2");
        return Err(Failure::input(error));
    };
    Ok(format!("{{target={target:?},kind={kind:?},at_s={at:?}}}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::injection::{Kind, Target};
    use crate::scenario::{Direction, MismatchDraw};

    #[test]
    fn options_override_what_was_set() {
        let args = RunArgs {
            scenario: ScenarioArgs {
                rig: Some("fe".into()),
                set: vec!["run.seed=3".into(), "tread.tau_s=0.2".into()],
                ..ScenarioArgs::default()
            },
            retract: true,
            wide: true,
            adversarial: false,
            controller: Some("limit".into()),
            seed: Some(5),
            fault: vec!["supply.weak@2".into(), "encoder-line-b.off@5.5".into()],
        };
        let scenario = args.resolve().unwrap();
        assert_eq!(scenario.preset, "fe");
        assert_eq!(scenario.rig.tread.tau_s, 0.2);
        assert_eq!(scenario.run.seed, 5);
        assert_eq!(scenario.run.direction, Direction::Retract);
        assert_eq!(scenario.run.controller, ControllerKind::Limit);
        assert_eq!(scenario.run.mismatch, MismatchDraw::Wide);
        let faults = scenario.run.faults.iter().map(|fault| (fault.target, fault.kind, fault.at_s));
        let expected =
            [(Target::Supply, Kind::Weak, Some(2.0)), (Target::EncoderLineB, Kind::Off, Some(5.5))];
        assert_eq!(faults.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn a_fault_that_cannot_be_read_is_named() {
        for text in ["supply-dip@2", "supply.weak", "supply.weak@soon", "supply.weak@inf", "@2"] {
            let args = RunArgs { fault: vec![text.into()], ..RunArgs::default() };
            let error = args.resolve().unwrap_err().to_string();
            let expected = format!("--fault {text}: expected TARGET.KIND@S");
            assert!(error.starts_with(&expected), "{error}");
        }
        let args = RunArgs { fault: vec!["suply.weak@2".into()], ..RunArgs::default() };
        assert!(args.resolve().unwrap_err().to_string().contains("run.faults[1].target"));
    }
}
