//! Makes a recorded run that is reset over and over and gone on with, out and back, mostly near
//! corners: `cargo run -p hil-sim --example resets -- SEED FILE.mcap`. The recordings in
//! `tests/data` that begin with `resets` are its own.

use std::error::Error;
use std::fs::File;
use std::io::sink;

use hil_sim::capture::Writer;
use hil_sim::scenario::Scenario;
use hil_sim::sil::{Options, Session};
use interstage::supervise::{Command, Mode};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Starts of a recording.
const STARTS: u32 = 10;
/// Longest time from one start to the next, ticks.
const LONGEST: u32 = 3000;
/// Longest way to an end, ticks.
const LAST: u32 = 20_000;
/// Of so many resets one takes the record with it.
const FORGETS: u32 = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(seed), Some(file)) = (words.next(), words.next()) else {
        return Err("expected: SEED FILE.mcap".into());
    };
    let sets = [format!("run.seed={seed}")];
    let scenario = Scenario::resolve(Some("prototype"), None, &sets)?;
    let faces = scenario.rig.rig.step_positions_mm.clone();
    let mut random = ChaCha8Rng::seed_from_u64(seed.parse()?);
    let mut session = Session::new(&scenario, Options { rows: true, ..Options::default() })?;
    let mut writer = Writer::new(
        Some(File::create(&file)?),
        None::<std::io::Sink>,
        Some(&scenario.to_toml()),
        false,
    )?;
    for start in 1..=STARTS {
        let command =
            if start == 1 || random.random_bool(0.6) { Command::Start } else { Command::Retract };
        let place = faces[random.random_range(0..faces.len())] - random.random_range(-6.0..15.0);
        let before = session.plant().truth().position_mm < place;
        let (mut left, mut given_at) = (Some(command), None);
        for tick in 0..if start == STARTS { LAST } else { LONGEST } {
            let given = if session.mode() == Mode::Idle { left.take() } else { None };
            given_at = given_at.or(given.map(|_| tick));
            session.step(given)?;
            let there = (session.plant().truth().position_mm < place) != before;
            let over = matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_));
            let waited = given_at.is_some_and(|at| tick > at + 20);
            if waited && (over || there && start < STARTS) {
                break;
            }
        }
        writer.take(&session.take_stream(), &mut |_| {})?;
        if start < STARTS {
            if random.random_ratio(1, FORGETS) { session.reboot() } else { session.restart() }
        }
    }
    let tally = writer.finish(&mut |_| {})?;
    println!("{file}: {} ticks, {} restarts", tally.ticks, tally.restarts);
    let _ = sink();
    Ok(())
}
