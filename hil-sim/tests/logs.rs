//! Logs over a long time, as regression fixtures, and in the hands of another program.
//!
//! The fixtures are written by
//! `cargo rig capture --bare --seed 1 --out hil-sim/tests/data --name deploy` and the same
//! with `--retract` and `--name retract`; again whenever the controller is meant to do
//! something else.

use std::path::{Path, PathBuf};
use std::process::Command;

use hil_sim::export::write_mcap;
use hil_sim::log::{Decoder, Item, Run};
use hil_sim::replay::replay;
use hil_sim::scenario::{Direction, Scenario};
use hil_sim::sil::{Options, Session};
use interstage::rig::Rig;
use interstage::supervise::{Command as Order, Mode};
use serde_json::Value;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

#[test]
fn recorded_runs_give_the_same_bits() {
    for (name, least) in [("deploy.mcap", 6000), ("retract.mcap", 4500)] {
        let run = Run::read(&data(name)).expect("a log");
        assert!(run.is_whole() && run.rows.len() > least, "{name}: {:?}", run.tally);
        assert_eq!(run.ledger.len(), 3, "{name}");
        let result = replay(&run, &Rig::prototype()).expect("a sound rig");
        assert!(
            result.is_equal(),
            "{name}: {}",
            result.difference.map_or_else(String::new, |difference| difference.to_string())
        );
    }
}

/// An hour of deploying and retracting: every tick is in the log, which stays as close to
/// the truth as it was in the first minute, and nothing grows.
#[test]
fn an_hour_of_deploying_and_retracting_is_logged_without_a_gap() {
    const HOUR_S: f64 = 3600.0;
    let options = Options { rows: true, ..Options::default() };
    let mut scenario = Scenario::default();
    scenario.run.direction = Direction::Deploy;
    let mut decoder = Decoder::new();
    let (mut ticks, mut off_first, mut off_last, mut runs, mut largest) = (0_u64, 0.0, 0.0, 0, 0);
    let mut total_s = 0.0;
    while total_s < HOUR_S {
        // The plant's own ledger grows with its crossings: a minute of it at a time, as
        // if the board lost power there.
        let mut session = Session::new(&scenario, options).expect("a session");
        let mut next = Order::Start;
        while session.time_s() < 60.0 {
            let command = match session.mode() {
                Mode::Idle | Mode::Complete(_) => {
                    let given = next;
                    next = if given == Order::Start { Order::Retract } else { Order::Start };
                    runs += 1;
                    Some(given)
                }
                Mode::FaultHold(fault) => panic!("{fault:?} at {total_s} s"),
                _ => None,
            };
            session.step(command).expect("runs");
            let truth = session.plant().truth().position_mm;
            let bytes = session.take_stream();
            largest = largest.max(bytes.len());
            decoder.read(&bytes, &mut |item| match item {
                Item::Tick(record, _) => {
                    ticks += 1;
                    // The truth of the frame's last tick.
                    let off = record.telemetry.position.to_num::<f64>() - truth;
                    if record.telemetry.mode
                        == Mode::Run(
                            interstage::supervise::Direction::Deploy,
                            interstage::supervise::Leg::Cruise,
                        )
                    {
                        let worst = if total_s < 60.0 { &mut off_first } else { &mut off_last };
                        *worst = f64::max(*worst, off.abs());
                    }
                }
                Item::Mark(hil_sim::log::Mark::Restart) => {}
                Item::Mark(mark) => panic!("{mark} at {total_s} s"),
                _ => {}
            });
        }
        total_s += session.time_s();
    }
    let tally = decoder.tally();
    assert_eq!(tally.ticks, ticks);
    assert!(ticks as f64 >= 0.999 * HOUR_S * 1e3, "{ticks}");
    assert_eq!((tally.lost_frames, tally.lost_ticks, tally.garbage_bytes), (0, 0, 0));
    assert!(runs > 400, "{runs} runs");
    // Position and truth are a tick or a frame apart, 0.3 mm at cruise; the same an hour
    // later.
    assert!(off_first < 1.0 && off_last <= 1.1 * off_first, "{off_first} {off_last}");
    // What is handed over at once: a frame of ticks, events, a piece of a capture.
    assert!(largest < 2048, "{largest}");
}

/// Python with the `mcap` package, which has nothing in common with the writer.
fn python() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("target"),
        PathBuf::from,
    );
    let folder = target.join("mcap-reader");
    let program = folder.join("bin/python3");
    let ready = |program: &Path| {
        let asked = Command::new(program).args(["-c", "import mcap.reader, lz4"]).output();
        asked.is_ok_and(|output| output.status.success())
    };
    if !ready(&program) {
        let run = |command: &mut Command| {
            let output = command.output().expect("starts");
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        };
        run(Command::new("python3").args(["-m", "venv"]).arg(&folder));
        let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
        run(Command::new(&program).args(pip).arg("mcap==1.6.0"));
        assert!(ready(&program), "the package is there");
    }
    program
}

/// What Python finds in a file.
fn found(file: &Path) -> Value {
    let output =
        Command::new(python()).arg(data("read_mcap.py")).arg(file).output().expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn python_reads_the_files_by_the_schemas_inside() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("log.mcap");
    let options = Options { rows: true, ..Options::default() };
    let recording = hil_sim::sil::run(&Scenario::default(), options).expect("a run");
    write_mcap(&recording, &path).expect("written");
    let found = found(&path);
    let counts = &found["counts"];
    assert_eq!(counts["/telemetry"], recording.rows.len());
    assert_eq!(counts["/crossing"], 3);
    assert_eq!(counts["/log"], recording.log.len());
    assert_eq!(found["undescribed"], serde_json::json!([]), "fields that no schema names");
    let last = recording.rows.last().expect("rows");
    assert_eq!(found["last"]["/telemetry"]["position_est_mm"], last.position_est_mm);
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
