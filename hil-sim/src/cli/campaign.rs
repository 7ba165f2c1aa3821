//! How a verb runs its campaign: a part of it, up to Ctrl-C, or from the lines of several parts.

use std::collections::HashSet;
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::failure::{Failure, Outcome};
use super::log_files::Stop;
use super::output;
use crate::campaign::{Campaign, Frame, Shard, Watch};
use crate::files::write_text;
use crate::progress;
use crate::table::counted;

/// Which part of a campaign, and how its outcome is shown.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct CampaignArgs {
    /// Only every n-th case, beginning with the i-th; with --json for `rig merge`.
    #[arg(long, value_name = "I/N", default_value_t = Shard::ALL)]
    shard: Shard,

    #[command(flatten)]
    show: Show,

    /// What the parts have found that `rig merge` puts together.
    #[arg(skip)]
    given: Option<Part>,
}

/// How the outcome of a campaign is shown.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Show {
    /// Prints the outcome as one JSON object.
    #[arg(long)]
    json: bool,

    /// Writes the rows into this file, CSV or HTML by its ending; may be repeated.
    #[arg(long, value_name = "FILE", value_parser = table)]
    table: Vec<PathBuf>,
}

fn table(text: &str) -> Result<PathBuf, &'static str> {
    let path = PathBuf::from(text);
    let known = ["csv", "html"].iter().any(|ending| path.extension().is_some_and(|e| e == *ending));
    known.then_some(path).ok_or("expected a name that ends in .csv or .html")
}

/// What a part of a campaign found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Part {
    /// Version of this program.
    version: String,
    /// The command, without what concerns the part and its output.
    pub(super) command: Vec<String>,
    /// The scenario, TOML.
    parameters: String,
    /// Cases of the complete campaign.
    cases: usize,
    /// Places of the cases that are done, and their lines.
    lines: Vec<(usize, Value)>,
}

impl Part {
    /// The parts in these files as one.
    pub(super) fn merged(files: &[PathBuf]) -> Result<Self, Failure> {
        let mut all: Option<Self> = None;
        for file in files {
            let wrong = |why: &str| Failure::input(format!("{}: {why}", file.display()));
            let text = std::fs::read(file).map_err(|error| wrong(&error.to_string()))?;
            let mut value: Value = serde_json::from_slice(&text).unwrap_or_default();
            let part: Self = serde_json::from_value(value["campaign"].take()).map_err(|_| {
                wrong("no part of a campaign: expected what --shard and --json have printed")
            })?;
            let Some(all) = &mut all else {
                all = Some(part);
                continue;
            };
            let of = |part: &Self| (part.version.clone(), part.command.clone(), part.cases);
            if of(all) != of(&part) || all.parameters != part.parameters {
                let (this, first) = (part.command.join(" "), all.command.join(" "));
                return Err(wrong(&format!("a part of `{this}`, expected one of `{first}`")));
            }
            let known: HashSet<usize> = all.lines.iter().map(|line| line.0).collect();
            if let Some((place, _)) = part.lines.iter().find(|new| known.contains(&new.0)) {
                return Err(wrong(&format!("case {place} is in another part, too")));
            }
            all.lines.extend(part.lines);
        }
        all.ok_or_else(|| Failure::input("expected the files of the parts"))
    }
}

/// The command of this process without what concerns its part and its output.
fn command() -> Vec<String> {
    let (mut words, mut all) = (Vec::new(), std::env::args_os().skip(1));
    while let Some(word) = all.next() {
        let word = word.to_string_lossy().into_owned();
        match word.split('=').next().unwrap_or_default() {
            "--shard" | "--table" if !word.contains('=') => drop(all.next()),
            "--json" | "--shard" | "--table" => {}
            _ => words.push(word),
        }
    }
    words
}

/// The outcome of a campaign or of a part of it.
pub(super) struct Found<O> {
    pub(super) outcome: O,
    /// Its lines, unless they are all of the campaign.
    part: Option<Part>,
    partial: Option<Partial>,
}

/// How much is done of what was asked for.
#[derive(Clone, Copy, Debug, Serialize)]
struct Partial {
    done: usize,
    of: usize,
}

impl CampaignArgs {
    /// All that is shown like this, from the lines of parts.
    pub(super) fn of_parts(show: Show, given: Part) -> Self {
        Self { shard: Shard::ALL, show, given: Some(given) }
    }

    /// Whether nothing is run.
    pub(super) const fn is_given(&self) -> bool {
        self.given.is_some()
    }

    /// Runs what is asked for of a campaign, or takes it from the parts. Ctrl-C ends it with what is
    /// done. `parameters` and the command say all that decides cases and lines: parts must agree in both.
    pub(super) fn carry_out<C, L, O, E>(
        &self,
        parameters: String,
        campaign: Campaign<'_, C, L, O, E>,
    ) -> Result<Found<O>, Failure>
    where
        C: Sync,
        L: Serialize + DeserializeOwned + Send,
        E: Send,
        Failure: From<E>,
    {
        let cases = campaign.cases.len();
        let places = self.shard.places(cases);
        if places.is_empty() {
            let shard = self.shard;
            let why = format!("--shard {shard}: a campaign of {cases} has none for this one");
            return Err(Failure::input(why));
        }
        let (lines, command) = match &self.given {
            Some(part) if (part.cases, &part.parameters) == (cases, &parameters) => {
                (part.lines.clone(), part.command.clone())
            }
            Some(part) => {
                let command = part.command.join(" ");
                let why = format!("the parts have other parameters than `{command}` has here");
                return Err(Failure::input(why));
            }
            None => {
                let lines = lines(&campaign, &places)?.into_iter();
                let line = |(at, line)| serde_json::to_value(line).map(|line| (at, line));
                (lines.map(line).collect::<Result<_, _>>().map_err(Failure::run)?, command())
            }
        };
        let (done, of) = (lines.len(), places.len());
        if done == 0 {
            let cases = counted(of, "case");
            return Err(Failure::run(format!("interrupted before the first of {cases}")));
        }
        // One machine reads its lines as `rig merge` does, so that both print the same.
        let read = |(at, line): &(usize, Value)| L::deserialize(line).map(|line| (*at, line));
        let read: Result<Vec<_>, _> = lines.iter().map(read).collect();
        let outcome = campaign.outcome(read.map_err(Failure::input)?);
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let part = (done < cases).then_some(Part { version, command, parameters, cases, lines });
        Ok(Found { outcome, part, partial: (done < of).then_some(Partial { done, of }) })
    }
}

/// The lines of the cases at these places, up to Ctrl-C.
fn lines<C: Sync, L: Send, O, E: Send>(
    campaign: &Campaign<'_, C, L, O, E>,
    places: &[usize],
) -> Result<Vec<(usize, L)>, E> {
    let (what, steps) = campaign.steps;
    let (stop, bar) = (Stop::by_ctrl_c(), progress::bar(what, (places.len() * steps) as u64));
    campaign.lines(places, Watch { done: &|| bar.advance(1), stop: &|| stop.is_wanted() })
}

/// The outcome of all cases; none if Ctrl-C ends it before.
pub fn complete<C: Sync, L: Send, O, E: Send>(
    campaign: Campaign<'_, C, L, O, E>,
) -> Result<Option<O>, E> {
    let places: Vec<usize> = (0..campaign.cases.len()).collect();
    let lines = lines(&campaign, &places)?;
    Ok((lines.len() == places.len()).then(|| campaign.outcome(lines)))
}

impl<O> Found<O> {
    /// Prints the outcome as `printed`, or as text, and writes its rows. Good if `good` holds
    /// and nothing is missing.
    pub(super) fn print(
        &self,
        args: &CampaignArgs,
        printed: &impl Serialize,
        rows: &Frame,
        text: impl FnOnce() -> String,
        good: bool,
    ) -> Result<Outcome, Failure> {
        #[derive(Serialize)]
        struct Printed<'a, T: Serialize> {
            #[serde(flatten)]
            outcome: &'a T,
            #[serde(skip_serializing_if = "Option::is_none")]
            partial: Option<Partial>,
            #[serde(skip_serializing_if = "Option::is_none")]
            campaign: &'a Option<Part>,
        }
        let (text, good) = (text(), good && self.partial.is_none());
        let partial = self.partial.as_ref().map_or_else(String::new, |Partial { done, of }| {
            format!("Partial: {done} of {of} cases are done\n")
        });
        for file in &args.show.table {
            let is_page = file.extension().is_some_and(|ending| ending == "html");
            // What is said before the first table.
            let said = text.split('\u{2500}').next().unwrap_or_default().trim().replace('\n', " ");
            let headline = if said.is_empty() { "Rows of a campaign" } else { &said };
            let headline = partial.clone() + headline;
            write_text(
                file,
                &if is_page { rows.html(&headline, &text, good) } else { rows.csv() },
            )?;
        }
        let printed = Printed { outcome: printed, partial: self.partial, campaign: &self.part };
        output::result(args.show.json, &printed, || {
            partial + &text + &output::wrote(&args.show.table)
        })?;
        Ok(Outcome::of(good))
    }
}
