//! What is done of a campaign, in a file, so that one which is broken off goes on from there.
//!
//! A line of JSON says which campaign it is, and one more stands for each fault that is done
//! at all of its instants. A last line that is not whole, because its writer was ended in the
//! middle of it, is taken off and its fault done again.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{Campaign, Line};

/// A file of a campaign that cannot be used; displays as one line with its path.
#[derive(Debug, thiserror::Error)]
pub enum KeptError {
    /// It cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// What stands in it is no campaign.
    #[error("{}: line {line} is no part of a campaign of faults: {why}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Which, from 1.
        line: usize,
        /// Why.
        why: String,
    },
    /// It is of another campaign.
    #[error("{}: is of a campaign with another {what}; take another file, or remove it", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What is different.
        what: &'static str,
    },
}

/// Which campaign a file is of. The faults tried are not in it: a campaign of some goes on
/// into one of all.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Head {
    /// What runs the controller.
    target: String,
    /// Instants a fault.
    instants: usize,
    /// Digest of rig, strategy and first seed.
    scenario: String,
    /// Digest of what judges and of what is judged.
    program: String,
}

/// The faults that are done, and where they are kept.
#[derive(Debug, Default)]
pub struct Kept {
    done: Vec<Line>,
    file: Option<(PathBuf, File)>,
}

impl Kept {
    /// Keeps the faults of `campaign` in the file at `path`, and takes from it what is done.
    /// `programs` is what judges and what is judged, byte for byte: no fault is taken over
    /// from another state of either.
    ///
    /// # Errors
    /// [`KeptError`] if the file cannot be read or written, is no campaign, or another one;
    /// it then stays as it is.
    pub fn at(
        path: &Path,
        target: &str,
        campaign: &Campaign,
        programs: &[&[u8]],
    ) -> Result<Self, KeptError> {
        let failed = |source| KeptError::File { path: path.to_owned(), source };
        let mut file = OpenOptions::new();
        let file = file.read(true).append(true).create(true).open(path).map_err(failed)?;
        let text = std::fs::read(path).map_err(failed)?;
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        let head = Head {
            target: target.to_owned(),
            instants: campaign.instants,
            scenario: digest(&[format!("{:?}", campaign.scenario).as_bytes()]),
            program: digest(programs),
        };
        let done = read(path, &text[..whole], &head)?;
        file.set_len(whole as u64).map_err(failed)?;
        let mut kept = Self { done, file: Some((path.to_owned(), file)) };
        if whole == 0 {
            kept.write(&head)?;
        }
        Ok(kept)
    }

    /// What became of a fault, if it is done.
    #[must_use]
    pub fn line(&self, fault: &str) -> Option<&Line> {
        self.done.iter().find(|line| line.fault == fault)
    }

    /// Keeps what became of a fault.
    ///
    /// # Errors
    /// [`KeptError::File`] if it cannot be written.
    pub(super) fn keep(&mut self, line: &Line) -> Result<(), KeptError> {
        self.write(line)
    }

    fn write(&mut self, what: &impl Serialize) -> Result<(), KeptError> {
        let Some((path, file)) = &mut self.file else { return Ok(()) };
        let failed = |source| KeptError::File { path: path.clone(), source };
        let mut text = serde_json::to_string(what).map_err(|error| failed(error.into()))?;
        text.push('\n');
        file.write_all(text.as_bytes()).and_then(|()| file.sync_data()).map_err(failed)
    }
}

/// The faults that are done, of whole lines.
fn read(path: &Path, text: &[u8], wanted: &Head) -> Result<Vec<Line>, KeptError> {
    let unread = |line: usize, why: String| KeptError::Line { path: path.to_owned(), line, why };
    let mut lines = text.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()).zip(1..);
    let Some((first, number)) = lines.next() else { return Ok(Vec::new()) };
    let head: Head = serde_json::from_slice(first).map_err(|e| unread(number, e.to_string()))?;
    let differs = [
        (head.target == wanted.target, "--target"),
        (head.instants == wanted.instants, "-n"),
        (head.scenario == wanted.scenario, "rig, strategy or seed"),
        (head.program == wanted.program, "rig command or firmware"),
    ];
    if let Some((_, what)) = differs.into_iter().find(|(same, _)| !same) {
        return Err(KeptError::Other { path: path.to_owned(), what });
    }
    let line = |(line, number)| {
        serde_json::from_slice(line).map_err(|e: serde_json::Error| unread(number, e.to_string()))
    };
    lines.map(line).collect()
}

fn digest(parts: &[&[u8]]) -> String {
    let mut digest = Sha256::new();
    for part in parts {
        digest.update((part.len() as u64).to_le_bytes());
        digest.update(part);
    }
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::super::Case;
    use super::*;
    use crate::scenario::Scenario;

    fn campaign(names: &[&str]) -> Campaign {
        let cases = Case::all().into_iter().filter(|case| names.contains(&case.name().as_str()));
        Campaign { scenario: Scenario::default(), instants: 2, cases: cases.collect() }
    }

    /// The outcome as JSON, and how many plants were run for it.
    fn outcome(campaign: &Campaign, path: &Path) -> (String, usize) {
        let runs = AtomicUsize::new(0);
        let mut kept = Kept::at(path, "sil", campaign, &[b"judge"]).expect("a file");
        let outcome = campaign.run_keeping(&mut kept, &|| {
            runs.fetch_add(1, Ordering::Relaxed);
        });
        let text = serde_json::to_string(&outcome.expect("a campaign")).expect("JSON");
        (text, runs.into_inner())
    }

    #[test]
    fn a_campaign_that_is_broken_off_comes_out_as_one_that_is_not() {
        let directory = tempfile::tempdir().expect("a directory");
        let [part, whole] = ["part", "whole"].map(|name| directory.path().join(name));
        let all = campaign(&["encoder offset", "tick overrun", "drive runaway"]);
        let expected = outcome(&all, &whole).0;
        outcome(&campaign(&["tick overrun"]), &part);
        // The writer is ended in the middle of the second fault's line, at every place.
        let one = std::fs::read(&part).expect("a file");
        let more = std::fs::read(&whole).expect("a file");
        let second = more.split_inclusive(|b| *b == b'\n').nth(1).expect("a line").to_vec();
        for cut in [0, 1, second.len() / 2, second.len() - 1] {
            std::fs::write(&part, [&one[..], &second[..cut]].concat()).expect("a file");
            assert_eq!(outcome(&all, &part), (expected.clone(), all.runs() as usize));
            let kept = Kept::at(&part, "sil", &all, &[b"judge"]).expect("a file");
            assert!(kept.line("tick overrun").is_some() && kept.done.len() == 3, "{kept:?}");
        }
    }

    #[test]
    fn what_is_kept_is_not_run_again() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("kept");
        let all = campaign(&["tick overrun"]);
        outcome(&all, &path);
        // A mark that no run would make.
        let text = std::fs::read_to_string(&path).expect("a file");
        std::fs::write(&path, text.replace("\"worst_motion_mm\":", "\"worst_motion_mm\":9"))
            .expect("");
        assert!(outcome(&all, &path).0.contains("\"worst_motion_mm\":9"));
    }

    #[test]
    fn a_file_of_another_campaign_is_refused_by_name_and_left_alone() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("kept");
        let first = campaign(&["tick overrun"]);
        outcome(&first, &path);
        let before = std::fs::read(&path).expect("a file");
        let mut other = first.clone();
        other.scenario.run.seed += 1;
        let more = Campaign { instants: 3, ..first.clone() };
        let refused = |target, campaign: &Campaign, program: &[u8]| {
            let error = Kept::at(&path, target, campaign, &[program]).expect_err("another");
            assert_eq!(std::fs::read(&path).expect("a file"), before);
            error.to_string()
        };
        assert!(refused("board", &first, b"judge").contains("another --target"));
        assert!(refused("sil", &more, b"judge").contains("another -n"));
        assert!(refused("sil", &other, b"judge").contains("another rig, strategy or seed"));
        assert!(refused("sil", &first, b"j").contains("another rig command or firmware"));
    }

    #[test]
    fn a_file_of_something_else_is_refused_by_line() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("kept");
        let all = campaign(&["tick overrun"]);
        std::fs::write(&path, "[rig]\nname = \"x\"\n").expect("a file");
        let error = Kept::at(&path, "sil", &all, &[]).expect_err("no campaign").to_string();
        assert!(error.contains("kept: line 1 is no part of a campaign"), "{error}");
        assert_eq!(std::fs::read(&path).expect("a file"), b"[rig]\nname = \"x\"\n");
    }

    #[test]
    fn a_file_that_cannot_be_is_named() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("no/such/kept");
        let error = Kept::at(&path, "sil", &campaign(&[]), &[]).expect_err("no directory");
        assert!(error.to_string().contains("no/such/kept"), "{error}");
    }
}
