//! `rig params`: the parameters that a board, or a file, holds.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;
use toml::Value;

use super::failure::{Failure, Outcome};
use super::output;
use crate::files::write_text;
use crate::params::{Client, Held, SetFile, Store, StoreError, set_of};
use crate::scenario::{KeyInfo, PRESETS, Scenario};
use crate::table::plain;

/// Sections of a scenario that a board does not hold.
const ELSEWHERE: [&str; 5] = ["preset", "mismatch.", "spread.", "noise.", "run."];

/// Reads and changes the parameters that a board, or a file, holds.
///
/// A change is checked before it is sent, and becomes active completely or not at all; a board
/// uses it from its next start. `restore FILE` names each property of the rig that nobody has
/// measured.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    action: Action,

    /// Those in this file, which holds one set of parameters.
    #[arg(long, global = true, value_name = "FILE", conflicts_with_all = ["target", "flash"])]
    file: Option<PathBuf>,

    /// Those of a board: probe, a real one; or board, the emulated one.
    #[arg(long, global = true, value_name = "TARGET", value_parser = ["board", "probe"])]
    pub target: Option<String>,

    /// File that keeps the emulated board's flash between runs.
    #[arg(long, global = true, value_name = "FILE", default_value = "out/board.flash")]
    pub flash: PathBuf,

    /// Prints the result as one JSON object.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Shows parameters: these, or all.
    Get {
        /// Keys such as tread.tau_s; `rig keys` lists them.
        keys: Vec<String>,
    },
    /// Changes parameters and makes them active.
    Set {
        /// Keys and their values.
        #[arg(required = true, value_name = "KEY=VALUE")]
        sets: Vec<String>,
        /// Gives the set another name.
        #[arg(long)]
        name: Option<String>,
    },
    /// Writes the parameters to a scenario file, TOML.
    Save {
        /// The file.
        to: PathBuf,
    },
    /// Makes the defaults active, or the parameters of a scenario file.
    Restore {
        /// The file.
        from: Option<PathBuf>,
    },
    /// Makes a set that other firmware has stored usable by this one: the rig stays, and what
    /// the controller computes from it is computed again.
    Migrate,
    /// Shows what differs from the defaults, or from a scenario file.
    Diff {
        /// The file.
        from: Option<PathBuf>,
    },
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    name: &'a str,
    origin: &'a str,
    schema: u16,
    hash: String,
    changed: bool,
    parameters: BTreeMap<&'a str, &'a Value>,
    /// With `diff` and `set`: what it was compared with.
    #[serde(skip_serializing_if = "Option::is_none")]
    before: Option<BTreeMap<&'a str, &'a Value>>,
}

/// Runs the verb.
pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    match (&args.file, args.target.as_deref()) {
        (Some(file), _) => act(args, &mut SetFile::new(file)),
        (None, Some(target)) => act(args, &mut Client::new(super::probe::attach(target, None)?)),
        (None, None) => Err(Failure::input(
            "whose parameters? give --target probe (a real board), --target board (the \
                 emulated one) or --file FILE",
        )),
    }
}

/// Carries out the action on the parameters of this place.
pub fn act(args: &Args, store: &mut impl Store) -> Result<Outcome, Failure> {
    let file = match &args.action {
        Action::Restore { from } | Action::Diff { from } => from.as_ref(),
        _ => None,
    };
    let given = file.map(|path| Scenario::resolve(None, Some(path), &[])).transpose()?;
    let held = match store.held() {
        // A board's set that is unreadable or damaged can still be replaced.
        Err(StoreError::Set { .. } | StoreError::Refused(_))
            if args.file.is_none() && matches!(args.action, Action::Restore { .. }) =>
        {
            store.restore()?;
            store.held()?
        }
        held => held?,
    };
    let scenario = scenario_of(&held);
    match &args.action {
        Action::Get { keys } => show(args, &held, false, &chosen(&scenario, keys)?, None),
        Action::Set { sets, name } => {
            let new = scenario.clone().with(sets)?;
            let name = name.as_deref().unwrap_or(&held.name);
            if new != (Scenario { rig: new.rig.clone(), ..scenario.clone() }) {
                return Err(not_here(sets));
            }
            replace(args, store, &scenario, &new, name)
        }
        Action::Save { to } => {
            output::spare("save", to, &[args.file.as_deref().unwrap_or(&args.flash)])?;
            output::ends_in("save", to, "toml")?;
            write_text(to, &scenario.to_toml())?;
            show(args, &held, false, &[], None)
        }
        Action::Restore { .. } => match file.zip(given) {
            Some((path, new)) => {
                super::scenario::remind(&path.display().to_string(), &new);
                let name = path.file_stem().unwrap_or("rig".as_ref()).to_string_lossy();
                replace(args, store, &scenario, &new, &name)
            }
            None => {
                store.restore()?;
                let now = store.held()?;
                show_changes(args, &now, true, &scenario, &scenario_of(&now))
            }
        },
        Action::Migrate => replace(args, store, &scenario, &scenario, &held.name),
        Action::Diff { .. } => {
            let other = given.map_or_else(|| Scenario::named(&scenario.preset), Ok)?;
            show_changes(args, &held, false, &other, &scenario)
        }
    }
}

/// Makes the rig of `new` active and shows the changes.
fn replace(
    args: &Args,
    store: &mut impl Store,
    old: &Scenario,
    new: &Scenario,
    name: &str,
) -> Result<Outcome, Failure> {
    let set = set_of(name, &new.rig).map_err(Failure::input)?;
    store.put(&set)?;
    let now = store.held()?;
    if now.rig != new.rig {
        return Err(Failure::run("the active parameters are not those that were stored"));
    }
    show_changes(args, &now, true, old, new)
}

/// The scenario of a held rig; one whose name is no preset is compared with the prototype.
pub(super) fn scenario_of(held: &Held) -> Scenario {
    let preset = PRESETS.iter().find(|preset| **preset == held.name).unwrap_or(&PRESETS[0]);
    Scenario::of_rig(preset, held.rig.clone())
}

fn not_here(sets: &[String]) -> Failure {
    let key = |set: &&String| ELSEWHERE.iter().any(|section| set.trim().starts_with(section));
    let set = sets.iter().find(key).map_or("", String::as_str);
    Failure::input(format!("{set}: belongs to a scenario, not to what a board holds"))
}

/// The keys that a board holds.
fn held_keys(scenario: &Scenario) -> Vec<KeyInfo> {
    let here = |info: &KeyInfo| !ELSEWHERE.iter().any(|section| info.key.starts_with(section));
    scenario.keys().into_iter().filter(here).collect()
}

/// These keys, or all.
fn chosen(scenario: &Scenario, keys: &[String]) -> Result<Vec<KeyInfo>, Failure> {
    let all = held_keys(scenario);
    if keys.is_empty() {
        return Ok(all);
    }
    let one = |key: &String| {
        let found = all.iter().find(|info| info.key == *key).cloned();
        found.ok_or_else(|| {
            Failure::input(format!("{key}: no such parameter; `rig keys` lists them"))
        })
    };
    keys.iter().map(one).collect()
}

/// Shows the keys whose values differ between two scenarios.
fn show_changes(
    args: &Args,
    held: &Held,
    changed: bool,
    old: &Scenario,
    new: &Scenario,
) -> Result<Outcome, Failure> {
    let pairs = held_keys(old).into_iter().zip(held_keys(new));
    let (before, after): (Vec<_>, Vec<_>) =
        pairs.filter(|(old, new)| old.value != new.value).unzip();
    show(args, held, changed, &after, Some(&before))
}

fn show(
    args: &Args,
    held: &Held,
    changed: bool,
    rows: &[KeyInfo],
    before: Option<&[KeyInfo]>,
) -> Result<Outcome, Failure> {
    let printed = Printed {
        name: &held.name,
        origin: &held.origin,
        schema: held.schema,
        hash: format!("{:08x}", held.hash),
        changed,
        parameters: values(rows),
        before: before.map(values),
    };
    output::result(args.json, &printed, || human(held, rows, before))?;
    Ok(Outcome::Good)
}

fn values(rows: &[KeyInfo]) -> BTreeMap<&str, &Value> {
    rows.iter().map(|info| (info.key.as_str(), &info.value)).collect()
}

fn human(held: &Held, rows: &[KeyInfo], before: Option<&[KeyInfo]>) -> String {
    let mut text = format!("{}, {:08x}, from {}\n", held.name, held.hash, held.origin);
    if !held.is_current() {
        text += "its constants are of another schema: `migrate` makes them again from its rig\n";
    }
    let head = if before.is_some() {
        &["key", "was", "is", "unit"][..]
    } else {
        &["key", "value", "unit"]
    };
    let cells = rows.iter().enumerate().map(|(place, info)| {
        let old = before.map(|before| before[place].value.to_string());
        let values = old.into_iter().chain([info.value.to_string(), info.unit.to_owned()]);
        std::iter::once(info.key.clone()).chain(values).collect()
    });
    match before {
        Some([]) => text + "no difference\n",
        None if rows.is_empty() => text,
        _ => text + &format!("{}\n", plain(head, cells)),
    }
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Set { .. } | StoreError::Compile(_) => Self::input(error),
            _ => Self::run(error),
        }
    }
}
