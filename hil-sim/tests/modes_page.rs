//! Modes, transitions, faults and limits, from the table that the firmware uses.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use interstage::fault::{Fault, FaultDescription, Limit};
use interstage::supervise::{Command, Leg, Mode, Trigger, next};
use interstage::units::Direction;

use super::head;

/// The page `docs/MODES.md`.
#[must_use]
pub fn modes() -> String {
    let mut page = head("Modes, faults and limits");
    page += "\nThe drive is always in one mode. [`src/supervise/transition.rs`]\
             (../src/supervise/transition.rs) is the one table of transitions; this page is \
             read out of it.\n\n```mermaid\nstateDiagram-v2\n";
    for ((from, to), triggers) in edges() {
        let _ = writeln!(page, "    {from} --> {to}: {}", triggers.join(", "));
    }
    page += "```\n\nA fault leads from every mode to the fault hold: both bridges off, the \
             self-locking gears hold wheel and screw where they are, the preload stays in its \
             spring. Only a reset leads out. A command that a mode does not take is refused, \
             logged and changes nothing.\n\n## Faults, latched\n\nWhat happens when each is provoked, and how soon \
             it is found: [SAFETY.md](SAFETY.md).\n\n| code | fault | cause | detection | reset \
             |\n|---|---|---|---|---|\n";
    for fault in Fault::ALL {
        let FaultDescription { cause, detection, reset, .. } = fault.description();
        let (code, sentence) = (fault.code(), fault.sentence());
        let _ = writeln!(page, "| {code} | {sentence} | {cause} | {detection} | {reset} |");
    }
    page += "\nReaction to each:\n\n";
    for reaction in reactions() {
        let of = Fault::ALL.into_iter().filter(|fault| fault.description().reaction == reaction);
        let codes: Vec<String> = of.map(|fault| fault.code().to_string()).collect();
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

/// Every reaction once.
fn reactions() -> Vec<&'static str> {
    let mut all: Vec<&str> = Fault::ALL.map(|fault| fault.description().reaction).to_vec();
    all.sort_unstable();
    all.dedup();
    all
}

/// Transitions by the pair of their ends, without the faults; both ways of a run and
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
            let label = label(trigger);
            let labels = edges.entry(ends).or_default();
            if !labels.contains(&label) {
                labels.push(label);
            }
        }
    }
    edges
}

fn name(mode: Mode) -> String {
    match mode {
        Mode::Boot => "Boot".into(),
        Mode::SelfTest => "SelfTest".into(),
        Mode::Zero => "Zero".into(),
        Mode::Idle => "Idle".into(),
        Mode::Preload(_) => "Preload".into(),
        Mode::Run(..) => "Run".into(),
        Mode::Stopping(_) => "Stopping".into(),
        Mode::Complete(Direction::Deploy) => "Deployed".into(),
        Mode::Complete(Direction::Retract) => "Retracted".into(),
        Mode::FaultHold(_) => "FaultHold".into(),
    }
}

fn label(trigger: Trigger) -> String {
    match trigger {
        Trigger::SensorsAnswer => "sensors answer".into(),
        Trigger::TestPassed { stowed: true } => "passed, stowed".into(),
        Trigger::TestPassed { stowed: false } => "passed, elsewhere".into(),
        Trigger::Zeroed => "zeros taken".into(),
        Trigger::Command(Command::Start) => "start".into(),
        Trigger::Command(Command::Stop) => "stop".into(),
        Trigger::Command(Command::Retract) => "retract".into(),
        Trigger::Command(Command::Reset) => "reset".into(),
        Trigger::PreloadStands => "preload stands".into(),
        Trigger::Leg(Leg::Cruise) => "cruise".into(),
        Trigger::Leg(Leg::Approach) => "approach".into(),
        Trigger::Leg(Leg::Crossing) => "crossing".into(),
        Trigger::Leg(Leg::Settle) => "settle".into(),
        Trigger::AtRest => "at rest".into(),
        Trigger::Arrived => "arrived".into(),
        Trigger::Fault(fault) => format!("fault {}", fault.code()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_and_code_is_on_the_page() {
        let page = modes();
        for mode in Mode::WITHOUT_FAULT {
            assert!(page.contains(&name(mode)), "{mode:?}");
        }
        for fault in Fault::ALL {
            assert!(page.contains(&format!("| {} | {}", fault.code(), fault.sentence())));
        }
        for limit in Limit::ALL {
            assert!(page.contains(&format!("| {} | {}", limit.code(), limit.sentence())));
        }
    }

    #[test]
    fn the_page_in_the_repository_is_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/MODES.md");
        let page = std::fs::read_to_string(path).unwrap_or_default();
        assert_eq!(page, modes(), "run `cargo rig docs`");
    }
}
