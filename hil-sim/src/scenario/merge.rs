//! Lays values over a preset key by key and checks each for its kind.

use std::collections::BTreeMap;
use std::path::Path;

use toml::{Table, Value};

use super::error::ScenarioError;
use super::keys::{self, Kind};
use super::value::{checked, from_text, has_unit, split};

/// Origin of what `--set` overrides.
pub(super) const COMMAND_LINE: &str = "command line";

/// Where each value was written.
#[derive(Clone, Debug)]
pub(super) struct Provenance {
    preset: String,
    written: BTreeMap<String, String>,
}

impl Provenance {
    /// Every value is that of the preset.
    pub(super) fn new(preset: &str) -> Self {
        Self { preset: format!("preset {preset}"), written: BTreeMap::new() }
    }

    /// Where the value of `key` was written.
    pub(super) fn of(&self, key: &str) -> &str {
        self.written.get(key).unwrap_or(&self.preset)
    }

    /// Whether a file or an override has the key.
    pub(super) fn is_written(&self, key: &str) -> bool {
        self.written.contains_key(key)
    }

    /// Where the first key of `message` that is not the preset's own was written.
    pub(super) fn of_message(&self, message: &str) -> &str {
        let written = message.split([' ', ':', ',']).find_map(|word| self.written.get(word));
        written.unwrap_or(&self.preset)
    }
}

/// A scenario under construction: each value is of the kind of its key.
pub(super) struct Merged {
    pub(super) table: Table,
    pub(super) provenance: Provenance,
}

impl Merged {
    /// Lays one `key=value` over it.
    pub(super) fn set(&mut self, text: &str) -> Result<(), ScenarioError> {
        let (key, text) = split(text).ok_or_else(|| {
            let example = "as in --set tread.tau_s=0.12";
            ScenarioError(format!("--set {text}: expected key=value, {example}"))
        })?;
        let kind = self.find(key).map_or(Kind::Number, |place| Kind::of(key, place));
        self.put(COMMAND_LINE, key, &from_text(kind, text))
    }

    /// Lays a file over it.
    pub(super) fn layer(&mut self, origin: &str, given: &Table) -> Result<(), ScenarioError> {
        given.iter().try_for_each(|(key, value)| self.put(origin, key, value))
    }

    fn put(&mut self, origin: &str, key: &str, value: &Value) -> Result<(), ScenarioError> {
        let place = self.find(key).ok_or_else(|| self.unknown(origin, key))?;
        if let Value::Table(section) = place {
            let Value::Table(inner) = value else {
                let first = section.keys().next().map_or("", String::as_str);
                let expected = format!("a section with keys such as {key}.{first}");
                return Err(ScenarioError::wrong(origin, key, value, expected));
            };
            let mut inner = inner.iter();
            return inner.try_for_each(|(name, v)| self.put(origin, &format!("{key}.{name}"), v));
        }
        let checked = checked(origin, key, Kind::of(key, place), value)?;
        let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
        let table = match self.table.get_mut(section) {
            Some(Value::Table(inner)) => inner,
            _ => &mut self.table,
        };
        table.insert(name.to_owned(), checked);
        self.provenance.written.insert(key.to_owned(), origin.to_owned());
        Ok(())
    }

    fn unknown(&self, origin: &str, key: &str) -> ScenarioError {
        let mut known: Vec<String> =
            keys::leaves(&self.table).into_iter().map(|(key, _)| key).collect();
        known.extend(self.table.keys().cloned());
        ScenarioError::unknown_key(origin, key, &keys::hint(key, &known))
    }

    fn find(&self, key: &str) -> Option<&Value> {
        let mut names = key.split('.');
        let first = self.table.get(names.next()?)?;
        names.try_fold(first, |value, name| value.get(name))
    }
}

/// The section `sources` of a file: a text for each key.
pub(super) fn sources(
    origin: &str,
    stated: Value,
) -> Result<BTreeMap<String, String>, ScenarioError> {
    let sources: BTreeMap<String, String> = stated.clone().try_into().map_err(|_| {
        let expected = "a text for each key, as in \"tread.tau_s\" = \"0.11 to 0.12, by its logs\"";
        ScenarioError::wrong(origin, "sources", stated, expected)
    })?;
    let known: Vec<String> = super::Scenario::default().keys().into_iter().map(|i| i.key).collect();
    match sources.keys().find(|key| !known.contains(key)) {
        Some(key) => {
            let hint = keys::hint(key, &known);
            Err(ScenarioError::unknown_key(origin, &format!("sources.{key}"), &hint))
        }
        None => Ok(sources),
    }
}

pub(super) fn read(path: &Path) -> Result<(String, Table), ScenarioError> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|error| ScenarioError::at(&name, format!("cannot be read: {error}")))?;
    let table = parse(&name, &text)?;
    Ok((name, table))
}

/// The table in the `text` of the file of this name.
pub(super) fn parse(name: &str, text: &str) -> Result<Table, ScenarioError> {
    text.parse::<Table>().map_err(|error| {
        let at = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = 1 + text.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count();
        unit_at(name, text, line).unwrap_or_else(|| {
            let why = error.message().replace('\n', ", ");
            ScenarioError::at(&format!("{name}, line {line}"), format!("not valid TOML: {why}"))
        })
    })
}

/// A line such as `tau_s = 0.1 s`, which is no TOML because of the unit.
fn unit_at(file: &str, text: &str, line: usize) -> Option<ScenarioError> {
    let (name, value) = text.lines().nth(line - 1)?.split_once('=')?;
    let (name, value) = (name.trim(), value.split('#').next()?.trim());
    if !has_unit(value) {
        return None;
    }
    let sections = text.lines().take(line);
    let section = sections.filter_map(|l| l.trim().strip_prefix('[')?.split_once(']')).last();
    let key = section.map_or(name.to_owned(), |(section, _)| format!("{}.{name}", section.trim()));
    Some(ScenarioError::unit_in_value(file, &key, value))
}
