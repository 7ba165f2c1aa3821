//! What a run is made of: the rig, how far the plant may differ from it, the noise
//! of its sensors, and how it is run. A scenario starts from a preset, takes any
//! subset of keys from a TOML file, and then what `--set key=value` overrides.

mod docs;
mod error;
pub mod injection;
mod injections;
mod keys;
mod merge;
mod run;
mod set;
mod spread;
mod suggest;
mod validate;

use std::path::Path;

use interstage::rig::{Drive, Geometry, Goals, Loads, Pretightener, Rig, Sensors, Tread};
use serde::{Deserialize, Serialize};

pub use error::{Origin, ScenarioError};
pub use keys::KeyInfo;
pub use run::{ControllerKind, Direction, RunOptions, StepAnomaly};
pub use spread::{Noise, Spread};

/// Names of the presets.
pub const PRESETS: [&str; 2] = ["prototype", "fe"];

/// One rig, its mismatch, its noise and its run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Document", into = "Document")]
pub struct Scenario {
    /// The preset that it started from, one of [`PRESETS`].
    pub preset: String,
    /// The rig as the controller believes it to be.
    pub rig: Rig,
    /// How far the plant may differ from the rig.
    pub spread: Spread,
    /// Noise and delay of the sensors.
    pub noise: Noise,
    /// How it is run.
    pub run: RunOptions,
}

/// The scenario as it stands in a file: the rig's sections beside the others.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    preset: String,
    rig: Geometry,
    tread: Tread,
    plant: Loads,
    preload: Pretightener,
    drive: Drive,
    sense: Sensors,
    control: Goals,
    spread: Spread,
    noise: Noise,
    run: RunOptions,
}

impl From<Document> for Scenario {
    fn from(d: Document) -> Self {
        Self {
            preset: d.preset,
            rig: Rig {
                rig: d.rig,
                tread: d.tread,
                plant: d.plant,
                preload: d.preload,
                drive: d.drive,
                sense: d.sense,
                control: d.control,
            },
            spread: d.spread,
            noise: d.noise,
            run: d.run,
        }
    }
}

impl From<Scenario> for Document {
    fn from(s: Scenario) -> Self {
        let Rig { rig, tread, plant, preload, drive, sense, control } = s.rig;
        Self {
            preset: s.preset,
            rig,
            tread,
            plant,
            preload,
            drive,
            sense,
            control,
            spread: s.spread,
            noise: s.noise,
            run: s.run,
        }
    }
}

impl Default for Scenario {
    fn default() -> Self {
        Self::from_rig("prototype", Rig::prototype())
    }
}

impl Scenario {
    /// The scenario of a preset: its rig, with the usual spread and noise.
    ///
    /// # Errors
    /// [`ScenarioError::UnknownPreset`] if there is none of that name.
    pub fn named(preset: &str) -> Result<Self, ScenarioError> {
        Self::from_preset(preset, Origin::Set)
    }

    /// Preset, then file, then overrides; then every check.
    ///
    /// `preset` is the one asked for on the command line. Without it the file's
    /// `preset` key counts, and without that `prototype`. Each of `sets` is
    /// `key=value` with a dotted key.
    ///
    /// # Errors
    /// The first thing found wrong, with the key and where it was written.
    pub fn resolve(
        preset: Option<&str>,
        file: Option<&Path>,
        sets: &[String],
    ) -> Result<Self, ScenarioError> {
        let mut given = Vec::new();
        if let Some(path) = file {
            given.push((Origin::File(path.to_owned()), merge::read(path)?));
        }
        Self::resolve_layers(preset, given, sets)
    }

    /// As [`Scenario::resolve`], with the text of the file; `name` stands for its
    /// path in messages.
    ///
    /// # Errors
    /// The first thing found wrong, with the key and where it was written.
    pub fn parse(name: &str, text: &str, sets: &[String]) -> Result<Self, ScenarioError> {
        let table = merge::parse(Path::new(name), text)?;
        Self::resolve_layers(None, vec![(Origin::File(name.into()), table)], sets)
    }

    /// The scenario of a rig that is near this preset's, with the usual spread and noise.
    #[must_use]
    pub fn of_rig(preset: &str, rig: Rig) -> Self {
        Self::from_rig(preset, rig)
    }

    /// This scenario with overrides, each `key=value`; then every check.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn with(self, sets: &[String]) -> Result<Self, ScenarioError> {
        let mut merged = merge::Merged::new(&self);
        for text in sets {
            merged.set(text)?;
        }
        let (scenario, provenance) = merged.finish();
        validate::check(&scenario, &provenance)?;
        Ok(scenario)
    }

    /// Every key with its unit, value, what it takes, and its description.
    #[must_use]
    pub fn keys(&self) -> Vec<KeyInfo> {
        keys::list(self)
    }

    /// The whole scenario as TOML; reading it back gives the same scenario.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("numbers, words and lists are always TOML")
    }

    /// Step positions of the nominal plant, mm, ascending: the step table with the
    /// anomalies of the run applied.
    #[must_use]
    pub fn true_steps_mm(&self) -> Vec<f64> {
        self.true_steps().into_iter().map(|(position, _)| position).collect()
    }

    /// The same, each with how much higher than the table says it is, mm.
    #[must_use]
    pub fn true_steps(&self) -> Vec<(f64, f64)> {
        run::apply(&self.rig.rig.step_positions_mm, &self.run.anomalies)
    }

    /// Checks every value against its range and the values against one another.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn validate(&self) -> Result<(), ScenarioError> {
        validate::check(self, &merge::Provenance::new(&self.preset))
    }

    fn from_preset(preset: &str, origin: Origin) -> Result<Self, ScenarioError> {
        Rig::named(preset)
            .map(|rig| Self::from_rig(preset, rig))
            .ok_or_else(|| ScenarioError::UnknownPreset { origin, name: preset.to_owned() })
    }

    fn from_rig(preset: &str, rig: Rig) -> Self {
        Self {
            preset: preset.to_owned(),
            rig,
            spread: Spread::default(),
            noise: Noise::default(),
            run: RunOptions::default(),
        }
    }

    fn resolve_layers(
        preset: Option<&str>,
        mut layers: Vec<(Origin, toml::Table)>,
        sets: &[String],
    ) -> Result<Self, ScenarioError> {
        let from_file = merge::take_preset(&mut layers)?;
        let from_set = sets.iter().rev().filter_map(|text| set::split(text));
        let from_set = from_set.filter(|(key, _)| *key == "preset").map(|(_, name)| name).next();
        let base = match (from_set.or(preset), from_file) {
            (Some(name), _) => Self::from_preset(name.trim_matches('"'), Origin::Set)?,
            (None, Some((name, origin))) => Self::from_preset(&name, origin)?,
            (None, None) => Self::default(),
        };
        let mut merged = merge::Merged::new(&base);
        for (origin, table) in &layers {
            merged.layer(origin, table)?;
        }
        for text in sets {
            merged.set(text)?;
        }
        let (scenario, provenance) = merged.finish();
        validate::check(&scenario, &provenance)?;
        Ok(scenario)
    }
}

#[cfg(test)]
mod tests;
