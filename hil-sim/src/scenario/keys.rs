//! The keys of a scenario: what each takes and in which unit.

use documented::DocumentedFields;
use interstage::rig::{ControlSettings, Drive, Geometry, Loads, Pretightener, Sensors, Tread};
use serde::Serialize;
use toml::{Table, Value};

use super::run::{ControllerKind, Direction, MismatchDraw, RunOptions};
use crate::plant::mismatch::Mismatch;
use crate::plant::sensors::Noise;
use crate::plant::spread::Spread;
use crate::plant::spread::{Field, Section};

pub(crate) const PRESETS: [&str; 2] = ["prototype", "fe"];

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KeyInfo {
    /// Dotted path, as in `--set`.
    pub key: String,
    /// Unit of its value; empty if it has none.
    pub unit: &'static str,
    #[serde(rename = "default")]
    pub value: Value,
    /// What it takes.
    pub expected: String,
    /// Least and largest value; none of words and lists.
    pub range: Option<(f64, f64)>,
    /// Whether it is a property of the rig, to be measured there, not a choice.
    pub measure: bool,
    pub description: String,
}

/// What a key takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A finite number.
    Number,
    /// An integer, not negative.
    Integer,
    /// A list of at most so many numbers.
    Numbers(usize),
    Word(&'static [&'static str]),
    /// A list of step anomalies.
    Anomalies,
    Faults,
}

impl Kind {
    /// What the key at `path` takes, known by its value in the preset.
    pub(super) fn of(path: &str, value: &Value) -> Self {
        match (path, value) {
            ("preset", _) => Self::Word(&PRESETS),
            ("run.direction", _) => Self::Word(&Direction::NAMES),
            ("run.controller", _) => Self::Word(&ControllerKind::NAMES),
            ("run.mismatch", _) => Self::Word(&MismatchDraw::NAMES),
            ("run.anomalies", _) => Self::Anomalies,
            ("run.faults", _) => Self::Faults,
            ("drive.modes_hz", _) => Self::Numbers(interstage::rig::MAX_MODES),
            (_, Value::Array(_)) => Self::Numbers(interstage::rig::MAX_STEPS),
            (_, Value::Integer(_)) => Self::Integer,
            _ => Self::Number,
        }
    }

    /// Half a sentence: what the key takes.
    pub(super) fn expected(self, path: &str) -> String {
        let unit = in_unit(path);
        match self {
            Self::Number => format!("a number{unit}"),
            Self::Integer => "a whole number, 0 or more".to_owned(),
            Self::Numbers(most) => format!("a list of at most {most} numbers{unit}"),
            Self::Word(words) => one_of(words),
            Self::Anomalies => {
                "a list such as [{ kind = \"late\", step = 2, offset_mm = 1.0 }]".to_owned()
            }
            Self::Faults => {
                "a list such as [{ target = \"preload-sensor\", kind = \"stuck\", at_s = 2.0 }]"
                    .to_owned()
            }
        }
    }
}

/// Half a sentence: one of these words.
pub(super) fn one_of(words: &[impl std::fmt::Display]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or ")
}

/// Units by the end of a key, the longer ends first.
const UNITS: [(&str, &str); 19] = [
    ("_mm_per_n", "mm/N"),
    ("_pa_per_m", "Pa/m"),
    ("_n_per_mm", "N/mm"),
    ("_n_per_s", "N/s"),
    ("_mm_s3", "mm/s^3"),
    ("_mm_s2", "mm/s^2"),
    ("_mm_s", "mm/s"),
    ("_m_s", "m/s"),
    ("_mm", "mm"),
    ("_um", "um"),
    ("_ms", "ms"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_deg", "degrees"),
    ("_rad", "rad"),
    ("_lsb", "LSB"),
    ("_counts", "counts"),
    ("_n", "N"),
    ("_s", "s"),
];

/// Unit that the end of the key's name says; empty if none.
fn unit(path: &str) -> &'static str {
    UNITS.iter().find(|(end, _)| path.ends_with(end)).map_or("", |(_, unit)| unit)
}

/// The unit as half a sentence; empty if there is none.
pub(super) fn in_unit(path: &str) -> String {
    match unit(path) {
        "" => String::new(),
        unit => format!(" in {unit}"),
    }
}

/// The key's name without its unit.
fn stem(name: &str) -> &str {
    UNITS.iter().find_map(|(end, _)| name.strip_suffix(end)).unwrap_or(name)
}

/// Every leaf of `table` with its dotted path.
pub(crate) fn leaves(table: &Table) -> Vec<(String, &Value)> {
    let mut found = Vec::new();
    for (name, value) in table {
        match value {
            Value::Table(section) => found.extend(
                leaves(section).into_iter().map(|(rest, leaf)| (format!("{name}.{rest}"), leaf)),
            ),
            leaf => found.push((name.clone(), leaf)),
        }
    }
    found
}

/// Every key of a section with its description.
fn fields<T: DocumentedFields>(section: &str) -> Vec<(String, String)> {
    let plain = |text: &str| text.replace(['`', '[', ']'], "").replace('\n', " ");
    let fields = T::FIELD_NAMES.iter().zip(T::FIELD_DOCS);
    fields.map(|(name, text)| (format!("{section}.{name}"), plain(text))).collect()
}

/// Every key with its description, the documentation of its field, in the order of
/// declaration.
fn descriptions() -> Vec<(String, String)> {
    let preset = ("preset".to_owned(), "Rig that the scenario starts from.".to_owned());
    [
        vec![preset],
        fields::<Geometry>("rig"),
        fields::<Tread>("tread"),
        fields::<Loads>("plant"),
        fields::<Pretightener>("preload"),
        fields::<Drive>("drive"),
        fields::<Sensors>("sense"),
        fields::<ControlSettings>("control"),
        fields::<Spread>("spread"),
        fields::<Noise>("noise"),
        mismatch(),
        fields::<RunOptions>("run"),
    ]
    .concat()
}

/// The keys of the mismatch, each with the range of its wide draw.
fn mismatch() -> Vec<(String, String)> {
    let described = fields::<Mismatch>("mismatch").into_iter().zip(Mismatch::FIELDS);
    let with_range = |((key, text), field): ((String, String), &Field<Mismatch>)| match field.wide {
        Some((from, to)) => (key, format!("{text} Wide {from} to {to}.")),
        None => (key, text),
    };
    described.map(with_range).collect()
}

/// Sections of properties of the rig, and what is a choice in them.
const PROPERTIES: [&str; 6] = ["rig", "tread", "plant", "preload", "drive", "sense"];
const CHOICES: [&str; 9] = [
    "rig.step_tolerance_mm",
    "preload.cruise_n",
    "preload.limit_n",
    "drive.cruise_speed_mm_s",
    "drive.min_crossing_speed_mm_s",
    "drive.acceleration_mm_s2",
    "drive.jerk_mm_s3",
    "drive.guard_band",
    "sense.stale_after_s",
];

/// Whether a key is a property of the rig.
fn is_measured(key: &str) -> bool {
    PROPERTIES.contains(&split(key).0) && !CHOICES.contains(&key)
}

/// Every key of the scenario in `table`, in the order of declaration, with the ranges in
/// `ranges`.
pub(super) fn list(table: &Table, ranges: &[(String, (f64, f64))]) -> Vec<KeyInfo> {
    let values = leaves(table);
    let range = |key: &str| ranges.iter().find(|(name, _)| name == key).map(|(_, range)| *range);
    let info = |(key, description): (String, String)| {
        let (_, value) = values.iter().find(|(name, _)| *name == key)?;
        let expected = Kind::of(&key, value).expected(&key);
        Some(KeyInfo {
            unit: unit(&key),
            value: (*value).clone(),
            expected,
            range: range(&key),
            measure: is_measured(&key),
            description,
            key,
        })
    };
    descriptions().into_iter().filter_map(info).collect()
}

/// A half-sentence that points at the known key nearest to `key`, or at the list.
pub(super) fn hint(key: &str, known: &[String]) -> String {
    match nearest(key, known) {
        Some(found) => format!(", did you mean {found}?"),
        None => "; `rig keys` lists them".to_owned(),
    }
}

/// The known word nearest to `word`, if any is near.
pub(crate) fn nearest_word<'a>(word: &str, known: &'a [String]) -> Option<&'a str> {
    let edits = |other: &String| strsim::damerau_levenshtein(word, other);
    known
        .iter()
        .min_by_key(|other| edits(other))
        .filter(|other| edits(other) <= 1 + word.len() / 4)
        .map(String::as_str)
}

/// The known key nearest to `key`, if any is near.
fn nearest<'a>(key: &str, known: &'a [String]) -> Option<&'a str> {
    known
        .iter()
        .map(|candidate| (distance(key, candidate), candidate.as_str()))
        .min()
        .filter(|&(distance, _)| distance <= 3 + key.len() / 8)
        .map(|(_, candidate)| candidate)
}

/// How far `candidate` is from `key`: edits, twice as far in a short name. The wrong section
/// costs one, so does the wrong unit or none, and each word that was left out.
fn distance(key: &str, candidate: &str) -> usize {
    let ((section, found), (its_section, wanted)) = (split(key), split(candidate));
    if its_section.is_empty() && !section.is_empty() {
        // A section is no key of another one.
        return usize::MAX;
    }
    let edits = |a: &str, b: &str| {
        let edits = strsim::damerau_levenshtein(a, b);
        if a.len() < 6 { 2 * edits } else { edits }
    };
    let elsewhere = usize::from(!section.is_empty() && section != its_section);
    if found == wanted {
        return elsewhere;
    }
    let (ours, its) = (stem(found), stem(wanted));
    let words = || ours.split('_').filter(|word| !word.is_empty());
    let has_all = words().all(|word| its.split('_').any(|other| other == word));
    let left_out = its.split('_').count().saturating_sub(words().count());
    let of_words =
        if has_all && words().next().is_some() { 1 + left_out + elsewhere } else { usize::MAX };
    of_words.min(1 + elsewhere + edits(ours, its))
}

/// Section and name; a key without a dot is a name without section.
fn split(key: &str) -> (&str, &str) {
    key.rsplit_once('.').unwrap_or(("", key))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known() -> Vec<String> {
        crate::scenario::Scenario::default().keys().into_iter().map(|k| k.key).collect()
    }

    #[test]
    fn finds_typing_errors_wrong_sections_and_forgotten_units() {
        let known = known();
        for (key, wanted) in [
            ("tread.tau", "tread.tau_s"),
            ("tread.tau_ms", "tread.tau_s"),
            ("tau_s", "tread.tau_s"),
            ("tread.stifening", "tread.stiffening"),
            ("rig.mu", "plant.mu"),
            ("prelaod.limit_n", "preload.limit_n"),
            ("rig.step_height", "rig.step_height_mm"),
            ("seed", "run.seed"),
            ("drive.cruise_speed_m_s", "drive.cruise_speed_mm_s"),
            ("sead", "run.seed"),
            ("tread.mu", "plant.mu"),
            ("rig.friction", "mismatch.friction"),
            ("plant.mass_kg", "plant.moved_mass_kg"),
            ("limit", "preload.limit_n"),
            ("friction", "mismatch.friction"),
            ("plant.tread_thickness_mm", "mismatch.tread_thickness"),
            ("preload.limit", "preload.limit_n"),
            ("cruise_speed", "drive.cruise_speed_mm_s"),
            ("control.cruise_speed_mm_s", "drive.cruise_speed_mm_s"),
        ] {
            assert_eq!(nearest(key, &known), Some(wanted), "{key}");
        }
    }

    #[test]
    fn does_not_guess_when_nothing_is_near() {
        for key in ["colour.of_the_sleeve", "preload.max_n", "preload.noise_n"] {
            assert_eq!(nearest(key, &known()), None, "{key}");
        }
    }

    #[test]
    fn every_key_has_a_description_and_every_description_a_key() {
        let table = Table::try_from(crate::scenario::Scenario::default()).expect("a table");
        let listed = list(&table, &[]);
        assert_eq!(listed.len(), leaves(&table).len());
        assert_eq!(listed.len(), descriptions().len());
        assert!(listed.iter().all(|key| key.description.len() > 4));
    }
}
