//! Laying values over a preset, key by key, each checked for its kind.

use std::collections::BTreeMap;
use std::path::Path;

use toml::{Table, Value};

use super::error::{Origin, ScenarioError};
use super::keys::{self, Kind, PRESETS};
use super::suggest;
use super::value::{checked, from_text, has_unit, split, wrong_type};

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
    /// Starts from the values in `table`, those of a preset.
    pub(super) fn new(preset: &str, table: Table) -> Self {
        Self { table, provenance: Provenance::new(preset) }
    }

    /// Lays a file over it.
    pub(super) fn layer(&mut self, origin: &Origin, given: &Table) -> Result<(), ScenarioError> {
        self.section("", origin, given)
    }

    /// Lays one `key=value` over it.
    pub(super) fn set(&mut self, text: &str) -> Result<(), ScenarioError> {
        let (key, text) =
            split(text).ok_or_else(|| ScenarioError::NotAnAssignment { text: text.to_owned() })?;
        match self.find(key) {
            Some(Value::Table(_)) => Err(self.is_section(&Origin::Set, key, text)),
            Some(leaf) => {
                let value = from_text(Kind::of(key, leaf), text);
                self.put(&Origin::Set, key, &value)
            }
            None => Err(self.unknown(&Origin::Set, key)),
        }
    }

    /// The table, each value of the kind of its key, and where the values come from.
    pub(super) fn finish(self) -> (Table, Provenance) {
        (self.table, self.provenance)
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

/// Takes the `preset` keys out of the layers; the last one counts.
pub(super) fn take_preset(
    layers: &mut [(Origin, Table)],
) -> Result<Option<(String, Origin)>, ScenarioError> {
    let mut found = None;
    for (origin, table) in layers {
        match table.remove("preset") {
            Some(Value::String(name)) => found = Some((name, origin.clone())),
            Some(other) => {
                return Err(wrong_type(origin, "preset", Kind::Word(&PRESETS), &other));
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
    if !has_unit(value) {
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
