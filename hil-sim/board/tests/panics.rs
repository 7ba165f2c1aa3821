//! No panic that the control tick can reach in the image, but those that are known never to
//! be taken.
//!
//! A function of the image calls, or continues in, the targets of its branches. From the functions
//! in which the task of the control tick and those of the sensors were put together, all
//! that can be reached is walked; where a branch leads into the machinery of panics, that
//! is a site. Its place in the source comes from the debug information, with everything
//! that was inlined there. A branch through a register names no function: it is listed with
//! the place that makes it, and judged by it.

mod graph;
mod known;
mod names;

use graph::Graph;
use known::judge;
use names::{Frame, Names};

use crate::common::elf;

/// Functions of the source whose tasks run on the control tick's executor: their names
/// are among what was inlined into the function that the executor calls.
const ROOTS: [&str; 4] = [
    "interstage::tasks::motors::motors",
    "interstage::tasks::sensors::wheel_encoder",
    "interstage::tasks::sensors::analog",
    "interstage::tasks::sensors::arm_angle",
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
#[derive(Clone, Debug)]
struct Site {
    /// What is called, empty through a register.
    calls: String,
    /// Functions of the source, innermost first, with file and line.
    frames: Vec<Frame>,
    /// How it is reached: functions of the image from the root on.
    path: Vec<String>,
}

/// What was found in an image.
struct Found {
    /// Functions that can be reached from the roots, and all of them.
    reached: (usize, usize),
    sites: Vec<Site>,
}

fn walk(elf: &[u8]) -> Found {
    let graph = Graph::of(elf);
    let names = Names::read(elf);
    let mut roots = Vec::new();
    for root in ROOTS {
        let is_root = |index: &usize| {
            let function = &graph.functions[*index];
            // What the task does first may be anything; it is in there somewhere.
            function.name.contains(POLL)
                && graph.branches[*index].iter().any(|branch| {
                    names.frames(branch.from).iter().any(|frame| frame.function.starts_with(root))
                })
        };
        let before = roots.len();
        roots.extend((0..graph.functions.len()).filter(is_root));
        assert!(roots.len() > before, "no {root}");
    }
    let reached = graph.reach(&roots, &is_machinery);
    let mut sites = Vec::new();
    for (index, path) in &reached {
        for branch in &graph.branches[*index] {
            let called = branch.to.map(|to| graph.functions[to].name.clone());
            if called.as_deref().is_none_or(is_machinery) {
                sites.push(Site {
                    calls: called.unwrap_or_default(),
                    frames: names.frames(branch.from),
                    path: path.iter().map(|at| graph.functions[*at].name.clone()).collect(),
                });
            }
        }
    }
    Found { reached: (reached.len(), graph.functions.len()), sites }
}

#[test]
fn the_control_tick_reaches_no_panic_of_its_own() {
    let found = walk(elf());
    // What was walked is what it is said to be: the tick and what it calls.
    let (reached, all) = found.reached;
    assert!(reached > 20 && reached < all, "{reached} of {all}");
    let reached = |name: &str| {
        found.sites.iter().any(|site| {
            let frames = site.frames.iter().map(|frame| &frame.function);
            site.path.iter().chain(frames).any(|function| function.contains(name))
        })
    };
    assert!(reached("tasks::motors::motors") && reached("tasks::sensors::arm_angle"));
    let unexplained: Vec<_> = found.sites.iter().filter(|site| judge(site).is_none()).collect();
    assert!(unexplained.is_empty(), "{unexplained:#?}");
    // In the controller itself there is not even one that is known to be harmless.
    let own =
        ["src/tick", "src/control/", "src/estimate/", "src/supervise/", "src/sense/", "src/model/"];
    for site in found.sites.iter().filter(|site| !site.calls.is_empty()) {
        let within = site.frames.iter().find(|frame| own.iter().any(|o| frame.file.starts_with(o)));
        let made = site.frames.iter().find(|frame| !frame.function.starts_with("core::"));
        assert!(within.is_none() || within != made, "{site:#?}");
    }
}
