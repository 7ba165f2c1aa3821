//! The inputs of a run: the rig, the tolerances of the plant, the noise of its sensors, and
//! the options of the run. A scenario starts from a preset, takes any subset of keys from a
//! TOML file, and then what `--set key=value` overrides.

pub mod injection;
mod keys;
mod merge;
mod run;
#[cfg(test)]
mod tests;
mod validate;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

use interstage::rig::Rig;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::plant::draw::PlantParameters;
use crate::plant::mismatch::Mismatch;
use crate::plant::sensors::Noise;
use crate::plant::spread::{Section, Spread};

use keys::Kind;
use merge::{COMMAND_LINE, Merged, Provenance};

/// Control period, s.
pub const TICK_S: f64 = 1e-3;

pub(crate) use keys::{KeyInfo, PRESETS};
pub(crate) use keys::{leaves, nearest_word};
pub use run::{ControllerKind, Direction, MismatchDraw, RunOptions, StepAnomaly};

/// One rig, its mismatch, its noise and its run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scenario {
    /// The preset that it started from, one of `PRESETS`.
    pub preset: String,
    /// The rig by the controller's parameters; its sections are beside the others.
    #[serde(flatten)]
    pub rig: Rig,
    /// Tolerances of the plant.
    pub spread: Spread,
    /// Noise and delay of the sensors.
    pub noise: Noise,
    /// What the plant has and the controller is not told.
    pub mismatch: Mismatch,
    pub run: RunOptions,
    /// What each measured value comes from, with its interval, by key: the file's section
    /// `sources`.
    #[serde(skip)]
    pub sources: BTreeMap<String, String>,
}

/// A scenario that cannot be used. Displays as one line: where the value was written, its
/// key, and what was expected.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ScenarioError(String);

impl ScenarioError {
    /// Something is wrong with what `origin` says.
    fn at(origin: &str, what: impl Display) -> Self {
        Self(format!("{origin}: {what}"))
    }

    /// There is no such key; `hint` is the second half of the sentence.
    fn unknown_key(origin: &str, key: &str, hint: &str) -> Self {
        Self::at(origin, format!("{key}: no such key{hint}"))
    }

    /// The value is not what the key takes.
    fn wrong(origin: &str, key: &str, found: impl Display, expected: impl Display) -> Self {
        Self::at(origin, format!("{key} = {found}: expected {expected}"))
    }

    fn out_of_range(origin: &str, key: &str, value: f64, (min, max): (f64, f64)) -> Self {
        Self::wrong(origin, key, value, format!("a value from {min} to {max}"))
    }

    /// A number with a unit behind it.
    fn unit_in_value(origin: &str, key: &str, found: &str) -> Self {
        let unit = keys::in_unit(key);
        let why = if unit.is_empty() { "" } else { ": that is part of the key's name" };
        Self::wrong(origin, key, found, format!("a bare number{unit}, without the unit{why}"))
    }
}

impl Default for Scenario {
    fn default() -> Self {
        Self::of_rig("prototype", Rig::prototype())
    }
}

/// Half-width of the heights in the adversarial draw, mm: steps up to half a millimetre off.
const ADVERSARIAL_HEIGHT_MM: f64 = 0.5;

/// Ranges of the adversarial draw other than the wide ones: friction down to where nothing holds,
/// and a load of more than twice the one that is known.
const ADVERSARIAL: &[(&str, (f64, f64))] = &[("friction", (0.6, 1.1)), ("weight_n", (0.0, 8.0))];

/// Most draws of a seed: what is refused as often is refused for what is stated.
const DRAWS: u64 = 64;

impl Scenario {
    /// The scenario of a preset: its rig, with the usual spread and noise.
    pub fn named(preset: &str) -> Result<Self, ScenarioError> {
        Self::from_preset(preset, COMMAND_LINE)
    }

    /// Preset, then file, then overrides; then every check.
    ///
    /// `preset` is the one asked for on the command line. Without it the file's
    /// `preset` key counts, and without that `prototype`. Each of `sets` is
    /// `key=value` with a dotted key.
    pub fn resolve(
        preset: Option<&str>,
        file: Option<&Path>,
        sets: &[String],
    ) -> Result<Self, ScenarioError> {
        Self::layered(preset, file.map(merge::read).transpose()?, sets)
    }

    /// As [`Scenario::resolve`], with the text of the file; `name` is its path in messages.
    pub fn parse(name: &str, text: &str, sets: &[String]) -> Result<Self, ScenarioError> {
        Self::layered(None, Some((name.to_owned(), merge::parse(name, text)?)), sets)
    }

    /// The scenario of a rig that is near this preset's, with the usual spread and noise.
    pub(crate) fn of_rig(preset: &str, rig: Rig) -> Self {
        Self {
            preset: preset.to_owned(),
            rig,
            spread: Spread::usual(),
            noise: Noise::usual(),
            mismatch: Mismatch::default(),
            run: RunOptions::default(),
            sources: BTreeMap::new(),
        }
    }

    /// This scenario with overrides, each `key=value`; then every check.
    pub fn with(self, sets: &[String]) -> Result<Self, ScenarioError> {
        self.overlaid(None, sets)
    }

    /// Every key with its unit, value, what it takes, and its description.
    pub fn keys(&self) -> Vec<KeyInfo> {
        keys::list(&self.table(), &validate::all_ranges(self))
    }

    /// The keys whose value is not the preset's, in the order of their sections, without those of
    /// a run's own: direction, controller and seed.
    pub fn overrides(&self) -> serde_json::Map<String, serde_json::Value> {
        const OWN: [&str; 4] = ["preset", "run.direction", "run.controller", "run.seed"];
        let (ours, preset) = (self.table(), Self::named(&self.preset).unwrap_or_default().table());
        let preset = leaves(&preset);
        let differs = |(key, value): &(String, &Value)| {
            !OWN.contains(&&**key) && !preset.contains(&(key.clone(), *value))
        };
        let changed = leaves(&ours).into_iter().filter(differs);
        changed.map(|(key, value)| (key, serde_json::json!(value))).collect()
    }

    /// Properties of the rig that nobody has measured: the preset's value, and no source.
    pub(crate) fn assumed(&self) -> Vec<String> {
        let stated = self.overrides();
        let is_known = |key: &String| stated.contains_key(key) || self.sources.contains_key(key);
        let measured = self.keys().into_iter().filter(|info| info.measure).map(|info| info.key);
        measured.filter(|key| !is_known(key)).collect()
    }

    /// The complete scenario as TOML; reading it back gives the same scenario.
    pub fn to_toml(&self) -> String {
        const ALWAYS: &str = "numbers, words and lists are always TOML";
        let text = toml::to_string(self).expect(ALWAYS);
        if self.sources.is_empty() {
            return text;
        }
        text + "\n[sources]\n" + &toml::to_string(&self.sources).expect(ALWAYS)
    }

    /// The `count` seeds that follow this one.
    pub(crate) fn seeds(&self, count: u64) -> Result<Vec<u64>, ScenarioError> {
        let seed = self.run.seed;
        let last = seed.checked_add(count).filter(|last| i64::try_from(*last).is_ok());
        let most = (i64::MAX as u64).saturating_sub(count);
        let expected = format!("at most {most}, so that {count} seeds can follow");
        let last = last.ok_or_else(|| ScenarioError::wrong("seeds", "run.seed", seed, expected))?;
        Ok((seed + 1..=last).collect())
    }

    pub fn plant(&self) -> PlantParameters {
        self.plant_with(&self.drawn_mismatch())
    }

    fn plant_with(&self, mismatch: &Mismatch) -> PlantParameters {
        let (seed, mut spread) = (self.run.seed, self.spread.clone());
        if self.run.mismatch == MismatchDraw::Adversarial {
            spread.step_height_mm = spread.step_height_mm.max(ADVERSARIAL_HEIGHT_MM);
        }
        PlantParameters::draw(&self.rig, &self.true_steps(), &spread, &self.noise, seed)
            .with_mismatch(mismatch)
    }

    /// The mismatch of the scenario's seed: as stated, or drawn wide. Seed 0 draws none. What
    /// makes no wheel, such as a tread too thin for its load, is drawn again.
    pub(crate) fn drawn_mismatch(&self) -> Mismatch {
        let beyond = match self.run.mismatch {
            MismatchDraw::Wide if self.run.seed > 0 => &[],
            MismatchDraw::Adversarial if self.run.seed > 0 => ADVERSARIAL,
            _ => return self.mismatch.clone(),
        };
        let draw = |again: u64| self.mismatch.draw(self.run.seed ^ again << 48, beyond);
        let rolls =
            |mismatch: &Mismatch| self.plant_with(mismatch).check(self.rig.preload.limit_n).is_ok();
        (0..DRAWS).map(draw).find(rolls).unwrap_or_else(|| draw(0))
    }

    /// Steps of the nominal plant, ascending: position, mm, and how much higher than the
    /// step table says each is, mm. The anomalies of the run are applied.
    pub fn true_steps(&self) -> Vec<(f64, f64)> {
        run::apply(&self.rig.rig.step_positions_mm, &self.run.anomalies)
    }

    /// Checks every value against its range and the values against one another.
    pub fn validate(&self) -> Result<(), ScenarioError> {
        validate::check(self, &Provenance::new(&self.preset))
    }

    fn from_preset(preset: &str, origin: &str) -> Result<Self, ScenarioError> {
        let rig = Rig::named(preset).ok_or_else(|| no_preset(origin, &preset.into()))?;
        Ok(Self::of_rig(preset, rig))
    }

    /// The preset, then the file of this name, then the overrides.
    fn layered(
        preset: Option<&str>,
        mut file: Option<(String, Table)>,
        sets: &[String],
    ) -> Result<Self, ScenarioError> {
        let (mut from_file, mut sources) = (None, BTreeMap::new());
        if let Some((origin, table)) = &mut file {
            if let Some(name) = table.remove("preset") {
                let name = name.as_str().ok_or_else(|| no_preset(origin, &name))?;
                from_file = Some((name.to_owned(), origin.clone()));
            }
            if let Some(stated) = table.remove("sources") {
                sources = merge::sources(origin, stated)?;
            }
        }
        let from_set = sets.iter().rev().filter_map(|text| merge::split(text));
        let from_set = from_set.filter(|(key, _)| *key == "preset").map(|(_, name)| name).next();
        let mut base = match (from_set.or(preset), from_file) {
            (Some(name), _) => Self::named(name.trim_matches('"'))?,
            (None, Some((name, origin))) => Self::from_preset(&name, &origin)?,
            (None, None) => Self::default(),
        };
        base.sources = sources;
        base.overlaid(file.as_ref(), sets)
    }

    /// This scenario with a file and then overrides laid over it.
    fn overlaid(
        &self,
        file: Option<&(String, Table)>,
        sets: &[String],
    ) -> Result<Self, ScenarioError> {
        let provenance = Provenance::new(&self.preset);
        let mut merged = Merged { table: self.table(), provenance };
        if let Some((origin, table)) = file {
            merged.layer(origin, table)?;
        }
        sets.iter().try_for_each(|text| merged.set(text))?;
        let mut scenario: Self =
            merged.table.try_into().expect("every value was checked for the kind of its key");
        // What the command line overrides is not what was measured.
        scenario.sources = self.sources.clone();
        scenario.sources.retain(|key, _| merged.provenance.of(key) != COMMAND_LINE);
        validate::check(&scenario, &merged.provenance)?;
        Ok(scenario)
    }

    fn table(&self) -> Table {
        Table::try_from(self).expect("numbers, words and lists are always TOML")
    }
}

/// A value as short as it can be written: no decimals without need, no blanks, no quotes.
pub(crate) fn brief(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Number(number) => {
            number.as_f64().map_or_else(|| number.to_string(), |number| number.to_string())
        }
        serde_json::Value::String(text) => text.clone(),
        serde_json::Value::Array(list) => list.iter().map(brief).collect::<Vec<_>>().join(","),
        other => other.to_string(),
    }
}

fn no_preset(origin: &str, found: &Value) -> ScenarioError {
    ScenarioError::wrong(origin, "preset", found, Kind::Word(&PRESETS).expected("preset"))
}
