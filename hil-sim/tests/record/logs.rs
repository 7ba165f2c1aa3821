//! Logs over a long time, as regression fixtures, and read by another program.
//!
//! The fixtures are written by
//! `INTERSTAGE_WRITE_FIXTURES=1 cargo test -p hil-sim --test main fixtures`, again whenever the
//! controller or the plant is meant to do something else.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::Command;

use hil_sim::record::{Decoder, FRAMES, Item, Mark, Run, unwrapped, write_mcap};
use hil_sim::replay::replay;
use hil_sim::scenario::Scenario;
use hil_sim::session::{Options, RunningRig, Session};
use hil_sim::testing::long;
use interstage::log::TICKS_PER_FRAME;
use interstage::rig::Rig;
use interstage::supervise::{Command as Order, Mode};
use interstage::units::Q16;

use crate::common::python::python;
use serde_json::Value;

/// Largest error of the log while moving. Position: the tolerance of the steps'
/// places, which the controller knows from its table and corrects itself by. Preload: two
/// deviations of the preload sensor's gain at 50 N, six of its noise, and its age.
const POSITION_MM: f64 = 1.0;
const PRELOAD_N: f64 = 1.0;

pub(crate) fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The frames in an MCAP file, which together are what was on the channel.
pub(crate) fn frames(path: &Path) -> Vec<Vec<u8>> {
    let file = std::fs::read(path).expect("a file");
    let messages = mcap::MessageStream::new(&file).expect("an MCAP file");
    let ours = messages.map(|one| one.expect("intact")).filter(|one| one.channel.topic == FRAMES);
    ours.map(|one| unwrapped(&one.data).to_vec()).collect()
}

#[test]
fn recorded_runs_give_the_same_bits() {
    for (name, least) in [("deploy.mcap", 4500), ("retract.mcap", 3000)] {
        let run = Run::read(&data(name)).expect("a log");
        assert!(run.is_complete() && run.rows.len() > least, "{name}: {:?}", run.counts);
        assert_eq!(run.ledger.len(), 3, "{name}");
        let result = replay(&run, &Rig::prototype()).expect("a sound rig");
        assert!(result.is_equal(), "{name}: {result:?}");
        assert_eq!(result.ticks as usize, run.rows.len(), "{name}");
        assert_eq!(result.events as usize, run.events.len(), "{name}");
        assert!(result.plans.0 >= 4 && result.plans.1 == 0, "{name}: {:?}", result.plans);
    }
}

/// Resident memory of this process, bytes; none where the system does not report it.
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    text.split_whitespace().nth(1)?.parse::<u64>().ok().map(|pages| pages * 4096)
}

/// Largest error of the log while moving, in a minute: position, mm, preload, N.
#[derive(Clone, Copy, Debug, Default)]
struct Off {
    position_mm: f64,
    preload_n: f64,
}

/// An hour of deploying and retracting, six rigs for ten minutes each or two for two: every tick is in
/// the log, which stays as close to the truth as in its first half, and nothing grows.
#[test]
fn an_hour_of_deploying_and_retracting_is_logged_without_a_gap() {
    let (sessions, minutes) = if long() { (6, 10) } else { (2, 2) };
    let mut scenario = Scenario::default();
    let mut decoder = Decoder::new();
    let mut off = vec![vec![Off::default(); minutes]; sessions];
    let (mut ticks, mut runs, mut largest, mut waiting) = (0_u64, 0, 0, 0);
    let mut memory = Vec::new();
    for part in &mut off {
        let mut session = Session::new(&scenario, Options::default()).expect("a session").logging();
        let (mut next, mut truths) = (Order::Start, VecDeque::new());
        while session.time_s() < 60.0 * minutes as f64 {
            let command = match session.mode() {
                Mode::Idle | Mode::Complete(_) => {
                    let given = next;
                    next = if given == Order::Start { Order::Retract } else { Order::Start };
                    runs += 1;
                    Some(given)
                }
                Mode::FaultHold(fault) => panic!("{fault:?} at {} s", session.time_s()),
                _ => None,
            };
            let truth = session.plant().truth();
            truths.push_back((truth.position_mm, truth.preload_n));
            session.step(command).expect("runs");
            let bytes = session.take_log(false);
            largest = largest.max(bytes.len());
            decoder.read(&bytes, &mut |item| match item {
                Item::Tick(record, _) => {
                    ticks += 1;
                    let (position, preload) = truths.pop_front().expect("a tick of the session");
                    let minute = record.at() as usize / 60_000;
                    if let (Mode::Run(..), Some(off)) =
                        (record.telemetry.mode, part.get_mut(minute))
                    {
                        let by = |seen: Q16, truth: f64| (seen.to_num::<f64>() - truth).abs();
                        let seen = &record.telemetry;
                        off.position_mm = off.position_mm.max(by(seen.position, position));
                        off.preload_n = off.preload_n.max(by(seen.preload, preload));
                    }
                }
                Item::Mark(Mark::Restart) => {}
                Item::Mark(mark) => panic!("{mark} after {ticks} ticks"),
                _ => {}
            });
            waiting = waiting.max(truths.len());
        }
        memory.extend(resident());
        scenario.run.seed += 1;
    }
    println!("{off:.3?}\nresident after each session: {memory:?}");
    let counts = decoder.counts();
    assert_eq!(counts.ticks, ticks);
    // What a session ends with, the log of the next does not have: less than a frame.
    let wanted = (sessions * minutes * 60_000) as u64;
    assert!((wanted - ticks) < 8 * sessions as u64, "{ticks}");
    assert_eq!((counts.lost_frames, counts.lost_ticks, counts.garbage_bytes), (0, 0, 0));
    assert_eq!(counts.restarts, sessions as u64 - 1);
    assert!(runs > 6 * sessions * minutes, "{runs} runs");
    for minutes in &off {
        for (minute, off) in minutes.iter().enumerate() {
            assert!(off.position_mm < POSITION_MM, "minute {minute}: {off:?}");
            assert!(off.preload_n < PRELOAD_N, "minute {minute}: {off:?}");
        }
        // No drift: as close in the later half of the minutes as in the first, but for noise.
        let off: Vec<f64> = minutes.iter().map(|off| off.position_mm).collect();
        let (first, later) = off.split_at(off.len() / 2);
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        assert!(mean(later) < 1.15 * mean(first) && off.iter().all(|mm| *mm < 1.6 * mean(first)));
    }
    // What is handed over at once: a frame of ticks, events, a piece of a capture; what waits.
    assert!(largest < 2048 && waiting <= 2 * TICKS_PER_FRAME, "{largest} bytes, {waiting} ticks");
    // The plant's own ledger and what a run's trace keeps go with their session.
    // Other tests keep what they need meanwhile, in some sessions: of two nothing follows.
    let mut more: Vec<u64> = memory.windows(2).map(|w| w[1].saturating_sub(w[0])).collect();
    more.sort_unstable();
    assert!(more.len() < 2 || more[more.len() / 2] < (3 << 20), "{memory:?}");
}

/// What Python finds in a file.
fn found(file: &Path) -> Value {
    // The package has nothing in common with the writer.
    let python = python("mcap-reader", &["mcap==1.6.0"]).expect("the package");
    let output = Command::new(python).arg(data("read_mcap.py")).arg(file).output().expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn python_reads_the_files_by_the_schemas_inside() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("log.mcap");
    let recording = hil_sim::session::run(&Scenario::default(), Options::ROWS).expect("a run");
    write_mcap(&recording, &path).expect("written");
    let found = found(&path);
    let counts = &found["counts"];
    assert_eq!(counts["/tick"], recording.rows.len());
    assert_eq!(counts["/crossing"], 3);
    assert_eq!(counts["/log"], recording.log.len());
    assert_eq!(found["undescribed"], serde_json::json!([]), "fields that no schema names");
    let last = recording.rows.last().expect("rows");
    assert_eq!(found["last"]["/tick"]["position_mm"], last.controller.position_mm);
    assert_eq!(found["metadata"]["parameters"]["toml"], recording.parameters);
    // The frames that Python took out are the log to the bit.
    let frames = found["frames"].as_str().expect("hexadecimal");
    let hex: String = recording.stream.iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(frames == hex, "{} and {} digits", frames.len(), hex.len());
}

#[test]
fn python_reads_a_captured_file() {
    let found = found(&data("deploy.mcap"));
    assert_eq!(found["counts"]["/ledger"], 3);
    assert_eq!(found["metadata"]["identity"]["rig"], "prototype");
    assert_eq!(found["undescribed"], serde_json::json!([]));
}
