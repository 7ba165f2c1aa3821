//! What was measured at earlier versions, a line of JSON each, so that a regression
//! shows.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::Report;
use super::machine::Machine;
use super::run;

/// Change of a time or of a ratio of times that is told; less is noise.
const TOLD_TIME: f64 = 0.25;

/// Change of what does not depend on the machine that is told.
const TOLD: f64 = 0.02;

/// One measurement, flat.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Version of the package.
    pub version: String,
    /// What it was measured on.
    pub machine: Machine,
    /// Figures by name. Those that end in `_ms`, `_ns` or `_s` are times, those that
    /// begin with `ratio.` ratios of times within one run.
    pub figures: BTreeMap<String, f64>,
}

/// A figure that has moved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Its name.
    pub name: String,
    /// Before.
    pub before: f64,
    /// Now.
    pub now: f64,
}

impl Entry {
    /// The figures of `report` that are kept.
    #[must_use]
    pub fn of(report: &Report) -> Self {
        let mut figures = BTreeMap::new();
        let mut put = |name: String, value: f64| {
            if value.is_finite() {
                figures.insert(name, value);
            }
        };
        for variant in &report.variants {
            for (way, course) in [("forward", &variant.forward), ("inverse", &variant.inverse)] {
                let name = |what: &str| format!("model.{}.{way}.{what}", variant.name);
                put(name("max_error"), course.max_rel_error);
                if let Some(cycles) = course.cycles {
                    put(name("cycles"), cycles as f64);
                }
                put(name("host_ns"), course.host_ns);
            }
        }
        if let Some(account) = &report.account {
            put("tick.cycles.mean".into(), account.mean);
            put("tick.cycles.mean_whole".into(), account.mean_whole);
            put("tick.cycles.most".into(), account.most as f64);
            put("tick.cycles.smooth_most".into(), account.smooth_most() as f64);
        }
        if let Some(usual) = report.plant.usual() {
            put("plant.max_gap_error".into(), usual.gap_error);
            put("plant.max_force_error".into(), usual.force_error);
            put("plant.crossing_ns".into(), usual.wall_ns);
        }
        let costs = &report.plant.costs;
        put("plant.smooth_part".into(), run::part(&costs.account, "smooth wall"));
        put("plant.elements".into(), run::elements(&costs.account) as f64);
        put("plant.saving_of_elements".into(), costs.saving_of_elements);
        put("ratio.plant.real_time".into(), costs.plant_real_time_factor);
        put("ratio.plant.run_real_time".into(), costs.run_real_time_factor);
        put("ratio.plant.saving".into(), costs.saving);
        if let Some(ratio) = costs.crossing_over_smooth {
            put("ratio.plant.crossing_over_smooth".into(), ratio);
        }
        for ratio in report.peers.iter().flat_map(|peers| &peers.ratios) {
            if let Some(value) = ratio.time_ratio {
                put(format!("ratio.peer.{} at {}", ratio.name, ratio.level), value);
            }
        }
        Self { version: report.version.to_owned(), machine: report.machine.clone(), figures }
    }

    /// What has moved since `before` by more than noise. Times are compared on the same
    /// machine only.
    #[must_use]
    pub fn since(&self, before: &Self) -> Vec<Change> {
        let same = self.machine == before.machine;
        let moved = |(name, &now): (&String, &f64)| {
            let &before = before.figures.get(name)?;
            let time = ["_ms", "_ns", "_s"].iter().any(|end| name.ends_with(end));
            let depends = time || name.starts_with("ratio.");
            let told = if depends { TOLD_TIME } else { TOLD };
            let size = before.abs().max(now.abs());
            let differs = (now - before).abs() > told * size;
            (differs && (same || !depends)).then(|| Change { name: name.clone(), before, now })
        };
        self.figures.iter().filter_map(moved).collect()
    }
}

/// Where the history is kept.
#[must_use]
pub fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs/performance/history.jsonl")
}

/// The entries of a history; none if the file is not there.
///
/// # Errors
/// If a line is not an entry.
pub fn read(path: &Path) -> Result<Vec<Entry>> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let lines = text.lines().enumerate().filter(|(_, line)| !line.is_empty());
    lines
        .map(|(index, line)| {
            let at = || format!("{}, line {}", path.display(), index + 1);
            serde_json::from_str(line).with_context(at)
        })
        .collect()
}

/// Appends an entry.
///
/// # Errors
/// If the file cannot be written.
pub fn append(path: &Path, entry: &Entry) -> Result<()> {
    let at = || path.display().to_string();
    let mut file = OpenOptions::new().create(true).append(true).open(path).with_context(at)?;
    writeln!(file, "{}", serde_json::to_string(entry)?).with_context(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(figures: &[(&str, f64)]) -> Entry {
        Entry {
            version: "0.1.0".to_owned(),
            machine: Machine::here(),
            figures: figures.iter().map(|&(name, value)| (name.to_owned(), value)).collect(),
        }
    }

    #[test]
    fn what_is_appended_is_read_again_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("history.jsonl");
        assert!(read(&path).unwrap().is_empty());
        let entries = [entry(&[("a", 1.0)]), entry(&[("a", 2.0), ("b_ms", 3.0)])];
        for entry in &entries {
            append(&path, entry).unwrap();
        }
        assert_eq!(read(&path).unwrap(), entries);
        std::fs::write(&path, "{}\n").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("line 1"));
    }

    #[test]
    fn errors_are_told_at_once_and_times_beyond_noise() {
        let before = entry(&[("error", 1.0), ("crossing_ms", 1.0), ("gone", 1.0)]);
        let now = entry(&[("error", 1.05), ("crossing_ms", 1.05), ("new", 1.0)]);
        let names = |changes: Vec<Change>| -> Vec<String> {
            changes.into_iter().map(|change| change.name).collect()
        };
        assert_eq!(names(now.since(&before)), ["error"]);
        let slow = entry(&[("error", 1.0), ("crossing_ms", 2.0)]);
        assert_eq!(names(slow.since(&before)), ["crossing_ms"]);
        let mut elsewhere = before.clone();
        elsewhere.machine.processor = "another".to_owned();
        assert_eq!(names(slow.since(&elsewhere)), Vec::<String>::new());
    }

    #[test]
    fn the_history_in_the_repository_reads() {
        read(&path()).unwrap();
    }
}
