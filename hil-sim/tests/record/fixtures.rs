//! Makes the recordings in `tests/data`, and notices when they are stale.
//!
//! After an intended change of controller or plant this writes all of them again:
//! `INTERSTAGE_WRITE_FIXTURES=1 cargo test -p hil-sim --test main fixtures`

use std::collections::BTreeSet;
use std::fs;
use std::io::{Cursor, Sink};

use hil_sim::record::{Source, Virtual, Writer};
use hil_sim::scenario::Scenario;
use hil_sim::session::{Options, RunningRig, Session};
use interstage::supervise::{Command, Mode};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::logs::data;

/// Set where the recordings are to be written.
const WRITE: &str = "INTERSTAGE_WRITE_FIXTURES";

/// Runs with resets: this and their seed are their names.
const RESETS: &str = "resets-";
const STARTS: u32 = 10;
/// Longest time from one start to the next, ticks.
const LONGEST: u32 = 3000;
/// Longest time after the last start, ticks.
const LAST: u32 = 20_000;
/// One reset of so many loses the record, too.
const FORGETS: u32 = 5;

/// A recording that grows in memory.
type File<'a> = Writer<&'a mut Cursor<Vec<u8>>, Sink>;

/// Names of the files in `tests/data` with this ending, without it.
fn stems(ending: &str) -> BTreeSet<String> {
    let files = fs::read_dir(data("")).expect("a folder").map(|file| file.expect("a file").path());
    let ours = files.filter(|path| path.extension().is_some_and(|its| its == ending));
    ours.map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned()).collect()
}

/// The recordings by name: two plain runs, those of the scenarios beside them, those with resets.
fn names() -> BTreeSet<String> {
    let mut names = stems("toml");
    names.extend(["deploy", "retract"].map(str::to_owned));
    names.extend((1..=3).map(|seed| format!("{RESETS}{seed}")));
    names
}

fn made(name: &str) -> Vec<u8> {
    let resolve = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let path = data(&format!("{name}.toml"));
        Scenario::resolve(None, path.exists().then_some(path.as_path()), &sets).expect("a scenario")
    };
    if let Some(seed) = name.strip_prefix(RESETS) {
        let scenario = resolve(&[&format!("run.seed={seed}")]);
        return written(&scenario, |file| resets(&scenario, file));
    }
    let scenario = match name {
        "deploy" => resolve(&["run.seed=1"]),
        "retract" => resolve(&["run.direction=retract", "run.seed=1"]),
        _ => resolve(&[]),
    };
    written(&scenario, |file| {
        let mut source = Virtual::new(&scenario, false).expect("a session");
        while let Some(bytes) = source.read().expect("runs") {
            file.take(&bytes, &mut |_| {}).expect("written");
        }
    })
}

/// A file without decoded ticks, as `rig capture --bare` writes it.
fn written(scenario: &Scenario, fill: impl FnOnce(&mut File<'_>)) -> Vec<u8> {
    let mut bytes = Cursor::default();
    let mut file =
        Writer::new(Some(&mut bytes), None, Some(&scenario.to_toml()), false).expect("a file");
    fill(&mut file);
    file.finish(&mut |_| {}).expect("written");
    bytes.into_inner()
}

/// A run that is reset again and again, out and back, mostly near corners.
fn resets(scenario: &Scenario, file: &mut File<'_>) {
    let steps = &scenario.rig.rig.step_positions_mm;
    let mut random = ChaCha8Rng::seed_from_u64(scenario.run.seed);
    let mut session = Session::new(scenario, Options::default()).expect("a session").logging();
    for start in 1..=STARTS {
        let last = start == STARTS;
        let command =
            if start == 1 || random.random_bool(0.6) { Command::Start } else { Command::Retract };
        let step = steps[random.random_range(0..steps.len())];
        let place = step - random.random_range(-6.0..15.0);
        let is_before = |session: &Session| session.plant().truth().position_mm < place;
        let began_before = is_before(&session);
        let (mut left, mut given_at) = (Some(command), None);
        for tick in 0..if last { LAST } else { LONGEST } {
            let given = if session.mode() == Mode::Idle { left.take() } else { None };
            given_at = given_at.or(given.map(|_| tick));
            session.step(given).expect("runs");
            let there = !last && is_before(&session) != began_before;
            let over = matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_));
            if (over || there) && given_at.is_some_and(|at| tick > at + 20) {
                break;
            }
        }
        file.take(&session.take_log(false), &mut |_| {}).expect("written");
        if !last {
            if random.random_ratio(1, FORGETS) { session.reboot() } else { session.restart() }
        }
    }
}

/// Writes the recordings where [`WRITE`] is set; else each has to be the stored one.
#[test]
fn the_recordings_are_those_of_this_controller_and_plant() {
    assert_eq!(stems("mcap"), names(), "each recording has a maker");
    let write = std::env::var_os(WRITE).is_some();
    let is_stale = |name: &String| {
        let (path, made) = (data(&format!("{name}.mcap")), made(name));
        if write {
            fs::write(&path, &made).expect("written");
        }
        fs::read(path).expect("a recording") != made
    };
    let stale: Vec<String> = names().into_par_iter().filter(is_stale).collect();
    assert!(stale.is_empty(), "{stale:?} are not those of today; set {WRITE} to write all again");
}
