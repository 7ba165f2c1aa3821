//! The page `docs/MODES.md` against the table of transitions and the codes of the firmware.

use std::collections::BTreeMap;

use interstage::fault::{Fault, Limit};
use interstage::supervise::{Command, Leg, Mode, Trigger, next};
use interstage::units::Direction;

/// The page that an operator reads.
const PAGE: &str = include_str!("../../docs/MODES.md");

#[test]
fn the_diagram_is_the_table_of_transitions() {
    let (_, diagram) = PAGE.split_once("stateDiagram-v2\n").expect("a diagram");
    let (diagram, _) = diagram.split_once("```").expect("its end");
    let edge = |((from, to), triggers): (_, Vec<String>)| -> String {
        let (from, to): (String, String) = (from, to);
        format!("    {from} --> {to}: {}\n", triggers.join(", "))
    };
    assert_eq!(diagram, edges().into_iter().map(edge).collect::<String>());
}

#[test]
fn every_code_has_its_row_once_and_every_fault_its_reaction() {
    let faults = Fault::ALL.map(|fault| (fault.code(), fault.sentence()));
    let limits = Limit::ALL.map(|limit| (limit.code(), limit.sentence()));
    for (code, sentence) in faults.into_iter().chain(limits) {
        assert_eq!(PAGE.matches(&format!("| {code} | {sentence} | ")).count(), 1, "{code}");
    }
    for (code, _) in faults {
        let code = code.to_string();
        let reacts = |line: &&str| line.starts_with("- ") && line.contains(&code);
        assert_eq!(PAGE.lines().filter(reacts).count(), 1, "{code}");
    }
}

/// Transitions by the pair of their ends, without the faults; both directions of a run and
/// its legs are drawn as one.
fn edges() -> BTreeMap<(String, String), Vec<String>> {
    let mut edges: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    // One hold stands for all.
    let hold = Mode::FaultHold(Fault::SelfTest);
    for mode in Mode::WITHOUT_FAULT.map(|(mode, _)| mode).into_iter().chain([hold]) {
        for (trigger, label) in LABELS {
            let Some(after) = next(mode, trigger) else { continue };
            let ends = (name(mode), name(after));
            if ends.0 == ends.1 && !matches!(mode, Mode::Run(..)) {
                continue;
            }
            let label = label.to_owned();
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
        Mode::Service => "Service".into(),
    }
}

/// Every trigger but the faults, and its label.
const LABELS: [(Trigger, &str); 16] = [
    (Trigger::SensorsAnswer, "sensors answer"),
    (Trigger::TestPassed { stowed: true }, "passed, stowed"),
    (Trigger::TestPassed { stowed: false }, "passed, elsewhere"),
    (Trigger::Zeroed, "zeros taken"),
    (Trigger::Command(Command::Start), "start"),
    (Trigger::Command(Command::Stop), "stop"),
    (Trigger::Command(Command::Retract), "retract"),
    (Trigger::Command(Command::Reset), "reset"),
    (Trigger::PreloadReached, "preload reached"),
    (Trigger::Leg(Leg::Cruise), "cruise"),
    (Trigger::Leg(Leg::Approach), "approach"),
    (Trigger::Leg(Leg::Crossing), "crossing"),
    (Trigger::Leg(Leg::Settle), "settle"),
    (Trigger::AtRest, "at rest"),
    (Trigger::Arrived, "arrived"),
    (Trigger::Service, "host on the line"),
];
