//! Lays values over a preset key by key: reads each from the text of an override or a file, and
//! checks it for what its key takes and for units that are part of the key's name.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use interstage::rig::MAX_STEPS;
use toml::{Table, Value};

use super::ScenarioError;
use super::injection::{self, CATALOGUE, HARDWARE};
use super::keys::{self, Kind, nearest_word, one_of};
use super::run::StepAnomaly;

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

/// Key and text of `key=value`.
pub(super) fn split(text: &str) -> Option<(&str, &str)> {
    let (key, value) = text.split_once('=')?;
    let (key, value) = (key.trim(), value.trim());
    (!key.is_empty() && !value.is_empty()).then_some((key, value))
}

/// The value of `text` where a key takes `kind`: TOML, but words need no quotes and lists of
/// numbers no brackets. Anything else stays text, which [`checked`] refuses.
pub(super) fn from_text(kind: Kind, text: &str) -> Value {
    let as_text = || Value::String(text.trim_matches('"').to_owned());
    match kind {
        Kind::Word(_) => as_text(),
        Kind::Numbers(_) if !text.starts_with('[') => {
            toml_value(&format!("[{text}]")).unwrap_or_else(as_text)
        }
        Kind::Number => {
            toml_value(text).or_else(|| text.parse().ok().map(Value::Float)).unwrap_or_else(as_text)
        }
        _ => toml_value(text).unwrap_or_else(as_text),
    }
}

fn toml_value(text: &str) -> Option<Value> {
    toml::from_str::<toml::Table>(&format!("v = {text}")).ok()?.remove("v")
}

/// Whether `text` is a number with a unit behind it.
pub(super) fn has_unit(text: &str) -> bool {
    let text = text.trim();
    let is_number =
        |end: &usize| text.get(..*end).is_some_and(|n| n.trim_end().parse::<f64>().is_ok());
    (1..=text.len()).rev().find(is_number).is_some_and(|end| {
        let rest = text[end..].trim_start();
        rest.starts_with(|c: char| c.is_alphabetic() || matches!(c, '%' | '°' | '/'))
    })
}

/// `value` in the form that `kind` has in a scenario.
pub(super) fn checked(
    origin: &str,
    key: &str,
    kind: Kind,
    value: &Value,
) -> Result<Value, ScenarioError> {
    let wrong = |key: &str, value: &Value| {
        let found = value.to_string().replace('\n', " ");
        ScenarioError::wrong(origin, key, found, kind.expected(key))
    };
    let entry = |(index, one): (usize, &Value)| {
        let at = format!("{key}[{}]", index + 1);
        let given = one.as_table().ok_or_else(|| wrong(&at, one))?;
        let entry = Entry { origin, at, given, found: Table::new() };
        let table = if kind == Kind::Faults { entry.fault() } else { entry.anomaly() };
        table.map(Value::Table)
    };
    match (kind, value) {
        (Kind::Number, Value::Float(x)) if x.is_finite() => Ok(value.clone()),
        (Kind::Number, Value::Integer(n)) => Ok(Value::Float(*n as f64)),
        (Kind::Integer, Value::Integer(0..)) => Ok(value.clone()),
        (Kind::Word(words), Value::String(word)) if words.contains(&word.as_str()) => {
            Ok(value.clone())
        }
        (Kind::Numbers(most), Value::Array(list)) if list.len() <= most => {
            let one = |one| checked(origin, key, Kind::Number, one).map_err(|_| wrong(key, value));
            list.iter().map(one).collect::<Result<_, _>>().map(Value::Array)
        }
        (Kind::Anomalies | Kind::Faults, Value::Array(list)) => {
            list.iter().enumerate().map(entry).collect::<Result<_, _>>().map(Value::Array)
        }
        (Kind::Number | Kind::Integer, Value::String(text)) if has_unit(text) => {
            Err(ScenarioError::unit_in_value(origin, key, text))
        }
        _ => Err(wrong(key, value)),
    }
}

/// An entry of a list of anomalies or faults, under check.
struct Entry<'a> {
    origin: &'a str,
    /// Its key, with its number from 1.
    at: String,
    given: &'a Table,
    found: Table,
}

impl Entry<'_> {
    /// A step anomaly: its kind decides which keys it has.
    fn anomaly(mut self) -> Result<Table, ScenarioError> {
        let kind = self.word("kind", StepAnomaly::NAMES.map(str::to_owned).to_vec())?;
        let fields = StepAnomaly::fields(&kind);
        let takes = fields.join(" and ");
        self.known(&["kind"], fields, &format!("; kind = \"{kind}\" takes {takes}"))?;
        for name in fields {
            let (kind, most) = match *name {
                "step" => (Kind::Integer, Some(MAX_STEPS as f64)),
                _ => (Kind::Number, None),
            };
            if !self.field(name, most)? {
                return Err(self.wrong(name, "nothing", &kind.expected(&self.key(name))));
            }
        }
        Ok(self.found)
    }

    /// A fault: its target decides which kinds there are.
    fn fault(mut self) -> Result<Table, ScenarioError> {
        const ONSETS: [&str; 3] = ["at_s", "at_mm", "at_crossing"];
        const FIELDS: [&str; 5] = ["at_s", "at_mm", "at_crossing", "duration_s", "magnitude"];
        let all: Vec<&injection::Entry> = CATALOGUE.iter().chain(HARDWARE).collect();
        let targets: BTreeSet<String> = all.iter().map(|entry| entry.target.name()).collect();
        let target = self.word("target", targets.into_iter().collect())?;
        let kinds = all.iter().filter(|entry| entry.target.name() == target);
        self.word("kind", kinds.map(|entry| entry.kind.name()).collect())?;
        let hint = format!("; a fault takes target, kind, {}", FIELDS.join(", "));
        self.known(&["target", "kind"], &FIELDS, &hint)?;
        for name in FIELDS {
            self.field(name, (name == "at_crossing").then_some(250.0))?;
        }
        let onsets: Vec<&str> =
            ONSETS.into_iter().filter(|name| self.given.contains_key(*name)).collect();
        let found = match onsets.as_slice() {
            [_] => return Ok(self.found),
            [] => "nothing".to_owned(),
            several => several.join(" and "),
        };
        Err(self.wrong("at_s", &found, "one of at_s, at_mm and at_crossing"))
    }

    fn key(&self, name: &str) -> String {
        format!("{}.{name}", self.at)
    }

    fn wrong(&self, name: &str, found: &str, expected: &str) -> ScenarioError {
        ScenarioError::wrong(self.origin, &self.key(name), found, expected)
    }

    /// Takes one of these words, which must be there.
    fn word(&mut self, name: &str, known: Vec<String>) -> Result<String, ScenarioError> {
        let all = self.given;
        let given = all.get(name);
        let word = given.and_then(Value::as_str);
        if let Some(word) = word.filter(|word| known.iter().any(|one| one == word)) {
            self.found.insert(name.to_owned(), word.into());
            return Ok(word.to_owned());
        }
        let found = given.map_or_else(|| "nothing".to_owned(), Value::to_string);
        Err(match word.and_then(|word| nearest_word(word, &known)) {
            Some(near) => {
                let why = format!("no such {name}, did you mean \"{near}\"?");
                ScenarioError::at(self.origin, format!("{} = {found}: {why}", self.key(name)))
            }
            None => self.wrong(name, &found, &one_of(&known)),
        })
    }

    /// Refuses every other key than these.
    fn known(&self, words: &[&str], fields: &[&str], hint: &str) -> Result<(), ScenarioError> {
        let unknown = |name: &&String| !words.iter().chain(fields).any(|known| known == name);
        self.given.keys().find(unknown).map_or(Ok(()), |name| {
            Err(ScenarioError::unknown_key(self.origin, &self.key(name), hint))
        })
    }

    /// Takes a number; an integer from 1 to `most` where the field counts something. Returns
    /// whether the field is there.
    fn field(&mut self, name: &str, most: Option<f64>) -> Result<bool, ScenarioError> {
        let Some(value) = self.given.get(name) else { return Ok(false) };
        let (key, kind) = (self.key(name), most.map_or(Kind::Number, |_| Kind::Integer));
        let value = checked(self.origin, &key, kind, value)?;
        if let (Some(number), Some(most)) = (value.as_integer().map(|n| n as f64), most)
            && !(1.0..=most).contains(&number)
        {
            return Err(ScenarioError::out_of_range(self.origin, &key, number, (1.0, most)));
        }
        self.found.insert(name.to_owned(), value);
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_distinguished_from_other_text() {
        for text in ["0.1s", "5mm/s", "5 mm/s", "3 %", "1e-3 s", "-2N", "0.5°", "12µm"] {
            assert!(has_unit(text), "{text}");
        }
        for text in ["abc", "", "1,5", "1 2", "0.1", "s"] {
            assert!(!has_unit(text), "{text}");
        }
    }

    #[test]
    fn words_need_no_quotes_and_lists_no_brackets() {
        assert_eq!(from_text(Kind::Word(&[]), "retract"), Value::String("retract".into()));
        assert_eq!(from_text(Kind::Word(&[]), "\"retract\""), Value::String("retract".into()));
        assert_eq!(
            from_text(Kind::Numbers(3), "18, 40.5"),
            Value::Array(vec![Value::Integer(18), Value::Float(40.5)])
        );
        assert_eq!(from_text(Kind::Numbers(3), "[18]"), Value::Array(vec![Value::Integer(18)]));
        assert_eq!(from_text(Kind::Number, ".5"), Value::Float(0.5));
        assert_eq!(from_text(Kind::Number, "0.1s"), Value::String("0.1s".into()));
    }

    #[test]
    fn an_assignment_has_a_key_and_a_value() {
        assert_eq!(split(" a.b = 1 "), Some(("a.b", "1")));
        for text in ["a.b", "=1", "a.b=", ""] {
            assert_eq!(split(text), None, "{text}");
        }
    }
}
