//! `docs/MODES.md` is what the firmware's table of modes, faults and limits gives; with the
//! environment variable `UPDATE_DOCS` the page is written.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use interstage::fault::{Fault, Limit};
use interstage::supervise::{Mode, Trigger, next};
use interstage::units::Direction;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/MODES.md");

#[test]
fn the_page_of_modes_is_current() {
    let page = page();
    for mode in Mode::WITHOUT_FAULT {
        assert!(page.contains(&name(mode)), "{mode:?}");
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(PATH, &page).expect("the page can be written");
    }
    let current = std::fs::read_to_string(PATH).unwrap_or_default();
    assert!(current == page, "docs/MODES.md: UPDATE_DOCS=1 cargo test -p hil-sim modes_page");
}

fn page() -> String {
    let mut page = String::from(
        "# Modes, faults and limits\n\n\
         Written by `UPDATE_DOCS=1 cargo test -p hil-sim modes_page`; do not edit.\n\n\
         The drive is always in one mode. [`src/supervise/transition.rs`]\
         (../src/supervise/transition.rs) is the one table of transitions; this page is read \
         out of it.\n\n```mermaid\nstateDiagram-v2\n",
    );
    for ((from, to), triggers) in edges() {
        let _ = writeln!(page, "    {from} --> {to}: {}", triggers.join(", "));
    }
    page += "```\n\nA fault leads from every mode to the fault hold: both bridges off, the \
             self-locking gears hold wheel and screw where they are, the preload stays in its \
             spring. Only a reset leads out. A command that a mode does not take is refused, \
             logged and changes nothing.\n\n## Faults, latched\n\nWhat happens when each is \
             provoked, and how soon it is found: [SAFETY.md](SAFETY.md).\n\n\
             | code | fault | cause | detection | reset |\n|---|---|---|---|---|\n";
    let mut reactions = BTreeMap::<&str, Vec<String>>::new();
    for fault in Fault::ALL {
        let (code, sentence, account) = (fault.code(), fault.sentence(), fault.description());
        let (cause, detection, reset) = (account.cause, account.detection, account.reset);
        let _ = writeln!(page, "| {code} | {sentence} | {cause} | {detection} | {reset} |");
        reactions.entry(account.reaction).or_default().push(code.to_string());
    }
    page += "\nReaction to each:\n\n";
    for (reaction, codes) in reactions {
        let _ = writeln!(page, "- {}: {reaction}.", codes.join(", "));
    }
    page += "\n## Limits, active\n\nReported and acted on; gone when their cause is gone.\n\n\
             | code | limit | reaction | until |\n|---|---|---|---|\n";
    for limit in Limit::ALL {
        let (reaction, until) = limit.description();
        let (code, sentence) = (limit.code(), limit.sentence());
        let _ = writeln!(page, "| {code} | {sentence} | {reaction} | {until} |");
    }
    page
}

/// Transitions by the pair of their ends, without the faults; both directions of a run and
/// its legs are drawn as one.
fn edges() -> BTreeMap<(String, String), Vec<String>> {
    let mut edges: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    // One hold stands for all.
    let hold = Mode::FaultHold(Fault::SelfTest);
    for mode in Mode::WITHOUT_FAULT.into_iter().chain([hold]) {
        for trigger in Trigger::WITHOUT_FAULT {
            let Some(after) = next(mode, trigger) else { continue };
            let ends = (name(mode), name(after));
            if ends.0 == ends.1 && !matches!(mode, Mode::Run(..)) {
                continue;
            }
            let (label, labels) = (label(trigger), edges.entry(ends).or_default());
            if !labels.contains(&label) {
                labels.push(label);
            }
        }
    }
    edges
}

fn name(mode: Mode) -> String {
    match mode {
        Mode::Preload(_) => "Preload".into(),
        Mode::Run(..) => "Run".into(),
        Mode::Stopping(_) => "Stopping".into(),
        Mode::Complete(Direction::Deploy) => "Deployed".into(),
        Mode::Complete(Direction::Retract) => "Retracted".into(),
        Mode::FaultHold(_) => "FaultHold".into(),
        // Boot, SelfTest, Zero, Idle.
        plain => format!("{plain:?}"),
    }
}

fn label(trigger: Trigger) -> String {
    match trigger {
        Trigger::SensorsAnswer => "sensors answer".into(),
        Trigger::TestPassed { stowed: true } => "passed, stowed".into(),
        Trigger::TestPassed { stowed: false } => "passed, elsewhere".into(),
        Trigger::Zeroed => "zeros taken".into(),
        Trigger::PreloadStands => "preload stands".into(),
        Trigger::AtRest => "at rest".into(),
        // Start, Stop, Retract, Reset; Cruise, Approach, Crossing, Settle; Arrived.
        Trigger::Command(command) => format!("{command:?}").to_lowercase(),
        Trigger::Leg(leg) => format!("{leg:?}").to_lowercase(),
        plain => format!("{plain:?}").to_lowercase(),
    }
}
