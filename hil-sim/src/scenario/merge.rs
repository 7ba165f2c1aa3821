//! Laying values over a preset, key by key, each checked for its kind.

use std::collections::BTreeMap;
use std::path::Path;

use toml::{Table, Value};

use super::keys::{self, Kind};
use super::{Origin, Scenario, ScenarioError, StepAnomaly, injections, set, suggest};

/// Where each overridden key was written.
#[derive(Clone, Debug)]
pub(super) struct Provenance {
    preset: Origin,
    written: BTreeMap<String, Origin>,
}

impl Provenance {
    /// Everything comes from the preset.
    pub(super) fn new(preset: &str) -> Self {
        Self { preset: Origin::Preset(preset.to_owned()), written: BTreeMap::new() }
    }

    /// Where the value of `key` was written.
    pub(super) fn of(&self, key: &str) -> Origin {
        self.written.get(key).unwrap_or(&self.preset).clone()
    }

    /// Where the first key of `message` that is not the preset's own was written.
    pub(super) fn of_message(&self, message: &str) -> Origin {
        let written = message.split([' ', ':', ',']).find_map(|word| self.written.get(word));
        written.unwrap_or(&self.preset).clone()
    }
}

/// A scenario under construction.
pub(super) struct Merged {
    table: Table,
    provenance: Provenance,
}

impl Merged {
    /// Starts from `base`.
    pub(super) fn new(base: &Scenario) -> Self {
        Self { table: table_of(base), provenance: Provenance::new(&base.preset) }
    }

    /// Lays a whole file over it.
    pub(super) fn layer(&mut self, origin: &Origin, given: &Table) -> Result<(), ScenarioError> {
        self.section("", origin, given)
    }

    /// Lays one `key=value` over it.
    pub(super) fn set(&mut self, text: &str) -> Result<(), ScenarioError> {
        let (key, text) = set::split(text)
            .ok_or_else(|| ScenarioError::NotAnAssignment { text: text.to_owned() })?;
        match self.find(key) {
            Some(Value::Table(_)) => Err(self.is_section(&Origin::Set, key, text)),
            Some(leaf) => {
                let value = set::value(Kind::of(key, leaf), text);
                self.put(&Origin::Set, key, &value)
            }
            None => Err(self.unknown(&Origin::Set, key)),
        }
    }

    /// The scenario and where its values come from.
    pub(super) fn finish(self) -> (Scenario, Provenance) {
        let scenario = Value::Table(self.table)
            .try_into()
            .expect("every value was checked for the kind of its key");
        (scenario, self.provenance)
    }

    fn section(&mut self, at: &str, origin: &Origin, given: &Table) -> Result<(), ScenarioError> {
        for (name, value) in given {
            let key = if at.is_empty() { name.clone() } else { format!("{at}.{name}") };
            match (self.find(&key), value) {
                (None, _) => return Err(self.unknown(origin, &key)),
                (Some(Value::Table(_)), Value::Table(inner)) => {
                    self.section(&key, origin, inner)?
                }
                (Some(Value::Table(_)), _) => {
                    return Err(self.is_section(origin, &key, &value.to_string()));
                }
                (Some(_), _) => self.put(origin, &key, value)?,
            }
        }
        Ok(())
    }

    fn put(&mut self, origin: &Origin, key: &str, value: &Value) -> Result<(), ScenarioError> {
        let place = self.find(key).expect("the key was found before");
        let checked = checked(origin, key, Kind::of(key, place), value)?;
        let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
        let table = match self.table.get_mut(section) {
            Some(Value::Table(inner)) => inner,
            _ => &mut self.table,
        };
        table.insert(name.to_owned(), checked);
        self.provenance.written.insert(key.to_owned(), origin.clone());
        Ok(())
    }

    fn find(&self, key: &str) -> Option<&Value> {
        let mut names = key.split('.');
        let first = self.table.get(names.next()?)?;
        names.try_fold(first, |value, name| value.get(name))
    }

    fn unknown(&self, origin: &Origin, key: &str) -> ScenarioError {
        let mut known: Vec<String> =
            keys::leaves(&self.table).into_iter().map(|(key, _)| key).collect();
        known.extend(self.table.keys().cloned());
        ScenarioError::UnknownKey {
            origin: origin.clone(),
            key: key.to_owned(),
            hint: suggest::hint(key, &known),
        }
    }

    fn is_section(&self, origin: &Origin, key: &str, found: &str) -> ScenarioError {
        let inside = match self.find(key) {
            Some(Value::Table(inner)) => inner.keys().next().cloned().unwrap_or_default(),
            _ => String::new(),
        };
        ScenarioError::WrongType {
            origin: origin.clone(),
            key: key.to_owned(),
            found: found.to_owned(),
            expected: format!("a section with keys such as {key}.{inside}"),
        }
    }
}

/// `value` in the form that `kind` has in a scenario, or why it cannot be.
pub(super) fn checked(
    origin: &Origin,
    key: &str,
    kind: Kind,
    value: &Value,
) -> Result<Value, ScenarioError> {
    let wrong = || wrong_type(origin, key, kind, value);
    match (kind, value) {
        (Kind::Number, Value::Float(x)) if x.is_finite() => Ok(value.clone()),
        (Kind::Number, Value::Integer(n)) => Ok(Value::Float(*n as f64)),
        (Kind::Whole, Value::Integer(0..)) => Ok(value.clone()),
        (Kind::Word(words), Value::String(word)) if words.contains(&word.as_str()) => {
            Ok(value.clone())
        }
        (Kind::Numbers(most), Value::Array(list)) if list.len() <= most => list
            .iter()
            .map(|one| checked(origin, key, Kind::Number, one).map_err(|_| wrong()))
            .collect::<Result<_, _>>()
            .map(Value::Array),
        (Kind::Anomalies, Value::Array(list)) => list
            .iter()
            .enumerate()
            .map(|(i, one)| anomaly(origin, &format!("{key}[{}]", i + 1), one))
            .collect::<Result<_, _>>()
            .map(Value::Array),
        (Kind::Faults, Value::Array(list)) => list
            .iter()
            .enumerate()
            .map(|(i, one)| injections::checked(origin, &format!("{key}[{}]", i + 1), one))
            .collect::<Result<_, _>>()
            .map(Value::Array),
        (Kind::Number | Kind::Whole, Value::String(text)) if set::has_unit(text) => {
            Err(ScenarioError::UnitInValue {
                origin: origin.clone(),
                key: key.to_owned(),
                found: text.clone(),
                unit: keys::unit(key),
            })
        }
        _ => Err(wrong()),
    }
}

/// One step anomaly: the kind decides which keys it has.
fn anomaly(origin: &Origin, at: &str, value: &Value) -> Result<Value, ScenarioError> {
    let Value::Table(given) = value else {
        return Err(wrong_type(origin, at, Kind::Anomalies, value));
    };
    let kind_key = format!("{at}.kind");
    let Some(kind) = given.get("kind") else {
        return Err(ScenarioError::WrongType {
            origin: origin.clone(),
            key: kind_key.clone(),
            found: "nothing".to_owned(),
            expected: Kind::Word(&StepAnomaly::NAMES).expected(&kind_key),
        });
    };
    let kind = checked(origin, &kind_key, Kind::Word(&StepAnomaly::NAMES), kind)?;
    let fields = StepAnomaly::fields(kind.as_str().unwrap_or_default());
    for name in given.keys().filter(|name| *name != "kind") {
        if !fields.contains(&name.as_str()) {
            return Err(ScenarioError::UnknownKey {
                origin: origin.clone(),
                key: format!("{at}.{name}"),
                hint: format!("; kind = {kind} takes {}", fields.join(" and ")),
            });
        }
    }
    let mut found = Table::new();
    for &name in fields {
        let key = format!("{at}.{name}");
        let field = if name == "step" { Kind::Whole } else { Kind::Number };
        let Some(value) = given.get(name) else {
            return Err(ScenarioError::WrongType {
                origin: origin.clone(),
                expected: field.expected(&key),
                key,
                found: "nothing".to_owned(),
            });
        };
        let value = checked(origin, &key, field, value)?;
        let most = interstage::rig::MAX_STEPS;
        if let Some(step) = value.as_integer().filter(|&n| !(1..=most as i64).contains(&n)) {
            return Err(ScenarioError::OutOfRange {
                origin: origin.clone(),
                key,
                value: step as f64,
                min: 1.0,
                max: most as f64,
            });
        }
        found.insert(name.to_owned(), value);
    }
    found.insert("kind".to_owned(), kind);
    Ok(Value::Table(found))
}

pub(super) fn wrong_type(origin: &Origin, key: &str, kind: Kind, value: &Value) -> ScenarioError {
    ScenarioError::WrongType {
        origin: origin.clone(),
        key: key.to_owned(),
        found: value.to_string().replace('\n', " "),
        expected: kind.expected(key),
    }
}

/// The scenario as the table that its file would be.
pub(super) fn table_of(scenario: &Scenario) -> Table {
    Table::try_from(scenario).expect("numbers, words and lists are always TOML")
}

/// Takes the `preset` keys out of the layers; the last one counts.
pub(super) fn take_preset(
    layers: &mut [(Origin, Table)],
) -> Result<Option<(String, Origin)>, ScenarioError> {
    let mut found = None;
    for (origin, table) in layers {
        match table.remove("preset") {
            Some(Value::String(name)) => found = Some((name, origin.clone())),
            Some(other) => {
                return Err(wrong_type(origin, "preset", Kind::Word(&super::PRESETS), &other));
            }
            None => {}
        }
    }
    Ok(found)
}

/// The table in the file at `path`.
pub(super) fn read(path: &Path) -> Result<Table, ScenarioError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| ScenarioError::Unreadable { path: path.to_owned(), source })?;
    parse(path, &text)
}

/// The table in `text`.
pub(super) fn parse(path: &Path, text: &str) -> Result<Table, ScenarioError> {
    text.parse::<Table>().map_err(|error| {
        let at = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = 1 + text.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count();
        unit_at(path, text, line).unwrap_or_else(|| ScenarioError::NotToml {
            path: path.to_owned(),
            line,
            message: error.message().replace('\n', ", "),
        })
    })
}

/// A line such as `tau_s = 0.1 s`, which is no TOML because of the unit.
fn unit_at(path: &Path, text: &str, line: usize) -> Option<ScenarioError> {
    let (name, value) = text.lines().nth(line - 1)?.split_once('=')?;
    let value = value.split('#').next()?.trim();
    if !set::has_unit(value) {
        return None;
    }
    let section = text
        .lines()
        .take(line)
        .filter_map(|l| l.trim().strip_prefix('[')?.split_once(']').map(|(name, _)| name.trim()))
        .last();
    let name = name.trim();
    let key = section.map_or_else(|| name.to_owned(), |section| format!("{section}.{name}"));
    Some(ScenarioError::UnitInValue {
        origin: Origin::File(path.to_owned()),
        unit: keys::unit(&key),
        key,
        found: value.to_owned(),
    })
}
