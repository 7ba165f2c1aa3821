//! Which panics the image can reach from the control tick, by its machine code.
//!
//! A function of the image calls, or goes on in, what its branches name. From the functions
//! in which the task of the control tick and those of the sensors were put together, all
//! that can be reached is walked; where a branch leads into the machinery of panics, that
//! is a site. Its place in the source comes from the debug information, with everything
//! that was inlined there.
//!
//! Branches through a register name nobody: they are listed with the place that makes
//! them, and judged by it.

mod graph;
mod known;

use serde::Serialize;

use crate::heat::names::{Frame, Names};
use crate::image::ImageError;

use graph::Graph;

pub use known::{Reason, judge, judge_indirect};

/// Functions of the source whose tasks run on the control tick's executor: their names
/// stand among what was inlined into the function that the executor calls.
const ROOTS: [&str; 7] = [
    "interstage::tasks::clock::clock",
    "interstage::tasks::motors::motors",
    "interstage::tasks::motors::record",
    "interstage::tasks::sensors::speed",
    "interstage::tasks::sensors::pressure",
    "interstage::tasks::sensors::displacement",
    "interstage::tasks::sensors::angle",
];

/// Where every panic ends, and what comes before it in the libraries.
const MACHINERY: [&str; 9] = [
    "core::panicking::",
    "core::cell::panic_",
    "core::option::unwrap_failed",
    "core::option::expect_failed",
    "core::result::unwrap_failed",
    "core::slice::index::",
    "rust_begin_unwind",
    // The logger's own.
    "_defmt_panic",
    "__defmt_default_panic",
];

/// Part of the names of the functions through which the executor runs tasks.
const POLL: &str = "TaskStorage<F>::poll";

/// Whether a function belongs to the machinery of panics.
fn is_machinery(name: &str) -> bool {
    MACHINERY.iter().any(|part| name.contains(part))
}

/// A place that can panic, or that calls through a register.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Site {
    /// Address of the branch.
    pub address: u32,
    /// Function of the image that it stands in.
    pub within: String,
    /// What is called, empty through a register.
    pub calls: String,
    /// Functions of the source, innermost first, with file and line.
    pub frames: Vec<Frame>,
    /// How it is reached: functions of the image from the root on.
    pub path: Vec<String>,
    /// Why it is never taken; none if nothing is known of it.
    pub reason: Option<Reason>,
}

impl Site {
    /// The first place in the source that is known.
    #[must_use]
    pub fn place(&self) -> String {
        self.frames
            .iter()
            .find(|frame| frame.line > 0 && !frame.file.is_empty())
            .map_or_else(|| "?".to_owned(), |frame| format!("{}:{}", frame.file, frame.line))
    }
}

/// What was found in an image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Found {
    /// Roots, by what they were inlined from.
    pub roots: Vec<String>,
    /// Functions that can be reached from them.
    pub reached: usize,
    /// Functions of the image.
    pub functions: usize,
    /// Sites of panics.
    pub panics: Vec<Site>,
    /// Calls through registers.
    pub indirect: Vec<Site>,
}

impl Found {
    /// Sites of panics for which no reason is known why they are never taken.
    pub fn unexplained(&self) -> impl Iterator<Item = &Site> {
        self.panics.iter().chain(&self.indirect).filter(|site| site.reason.is_none())
    }
}

/// Walks the image in `elf`.
///
/// # Errors
/// [`ImageError`] if it is no image of the board, has no debug information, or lacks a
/// root: then nothing would have been shown.
pub fn walk(elf: &[u8]) -> Result<Found, ImageError> {
    let graph = Graph::of(elf)?;
    let names = Names::read(elf)?;
    let mut roots = Vec::new();
    let mut found_roots = Vec::new();
    for root in ROOTS {
        let is_root = |index: &usize| {
            let function = &graph.functions[*index];
            // What the task does first may be anything; it is in there somewhere.
            function.name.contains(POLL)
                && graph.branches[*index].iter().any(|branch| {
                    names.frames(branch.from).iter().any(|frame| frame.function.starts_with(root))
                })
        };
        let polls: Vec<usize> = (0..graph.functions.len()).filter(is_root).collect();
        if polls.is_empty() {
            return Err(ImageError::Missing(root.to_owned()));
        }
        found_roots.push(root.to_owned());
        roots.extend(polls);
    }
    let reached = graph.reach(&roots, &|name| is_machinery(name));
    let mut panics = Vec::new();
    let mut indirect = Vec::new();
    for (index, path) in &reached {
        let function = &graph.functions[*index];
        for branch in &graph.branches[*index] {
            let called = branch.to.map(|to| graph.functions[to].name.clone());
            let panicking = called.as_deref().is_some_and(is_machinery);
            if called.is_some() && !panicking {
                continue;
            }
            let mut site = Site {
                address: branch.from,
                within: function.name.clone(),
                calls: called.unwrap_or_default(),
                frames: names.frames(branch.from),
                path: path.iter().map(|at| graph.functions[*at].name.clone()).collect(),
                reason: None,
            };
            if panicking {
                site.reason = judge(&site);
                panics.push(site);
            } else {
                site.reason = judge_indirect(&site);
                indirect.push(site);
            }
        }
    }
    Ok(Found {
        roots: found_roots,
        reached: reached.len(),
        functions: graph.functions.len(),
        panics,
        indirect,
    })
}
