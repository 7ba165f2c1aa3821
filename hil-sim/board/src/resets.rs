//! Resets at random instants of random runs on the emulated board: is the record there,
//! are the parameters whole, does the drive hold, and does it go on when it is told to?

mod aim;
mod case;
mod outcome;

use std::sync::atomic::{AtomicU64, Ordering};

use interstage::params::{CompileError, slots};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::bench::BenchError;
use crate::log::{Line, Strings};
use hil_sim::params::set_of;
use hil_sim::scenario::{Direction, Scenario};

pub use aim::Aim;
pub use case::{After, Case, Kind};
pub use outcome::{KindOutcome, ModeOutcome, Outcome};

/// Time from the command within which the reset comes, s: that of a run on the board, either
/// way, and a little more for the moment after the arrival.
const WITHIN_S: f64 = 4.0;
/// Of so many resets one is aimed at a mode, in turn; the others come at any time.
const AIMED: u64 = 4;

/// Why a campaign cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ResetError {
    /// The bench.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// The rig cannot be put into the board's flash.
    #[error(transparent)]
    Parameters(#[from] CompileError),
}

/// The cases of a campaign: number `index` is the same whatever the others are.
#[must_use]
pub fn case(seed: u64, index: u64) -> Case {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    chance.set_stream(index);
    let kinds = Kind::ALL.len() as u64;
    // Of every mode every kind comes, out and back.
    let (round, turn) = (index / (2 * kinds), index / (2 * kinds) / AIMED);
    let aimed = round.is_multiple_of(AIMED);
    Case {
        index,
        seed: seed + index,
        way: if index.is_multiple_of(2) { Direction::Deploy } else { Direction::Retract },
        kind: Kind::ALL[(index / 2 % kinds) as usize],
        aim: aimed.then(|| Aim::ALL[(turn % Aim::ALL.len() as u64) as usize]),
        after_s: chance.random_range(0.0..WITHIN_S),
        // The rest of a millisecond, so that it comes between any two instructions.
        part: chance.random_range(0.0..1.0),
        then: if chance.random_bool(0.5) { Direction::Deploy } else { Direction::Retract },
    }
}

/// Who is told how a campaign goes.
#[derive(Clone, Copy)]
pub struct Told<'a> {
    /// A reset has been made.
    pub done: &'a (dyn Fn(&After) + Sync),
    /// The board of this number has logged something, at this time since power-up, s.
    pub line: &'a (dyn Fn(u64, f64, &Line) + Sync),
}

impl Told<'_> {
    /// Nobody.
    pub const NOBODY: Told<'static> = Told { done: &|_| {}, line: &|_, _, _| {} };
}

/// Makes the cases with the image in `elf` and the rig of `scenario`.
///
/// The board's flash holds a stored set of the rig's parameters.
///
/// # Errors
/// [`ResetError`] if one cannot be made. What goes wrong in a case is its result.
pub fn run(
    elf: &[u8],
    strings: &Strings,
    scenario: &Scenario,
    cases: &[Case],
    told: &Told<'_>,
) -> Result<Vec<After>, ResetError> {
    let set = set_of("stored", &scenario.rig)?;
    let place = slots::place(&set, 7).ok_or(CompileError::Room)?;
    let broken = AtomicU64::new(0);
    cases
        .par_iter()
        .map(|case| {
            // After the first that cannot be made the rest is not worth the time.
            if broken.load(Ordering::Relaxed) > 0 {
                return Ok(None);
            }
            let after = case.make(elf, strings, scenario, &place, told.line);
            match &after {
                Ok(after) => (told.done)(after),
                Err(_) => broken.store(1, Ordering::Relaxed),
            }
            Ok(Some(after?))
        })
        .filter_map(Result::transpose)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_spread_over_ways_kinds_and_the_run() {
        let cases: Vec<Case> = (0..800).map(|index| case(1, index)).collect();
        for kind in Kind::ALL {
            for way in [Direction::Deploy, Direction::Retract] {
                let of: Vec<&Case> =
                    cases.iter().filter(|c| c.kind == kind && c.way == way).collect();
                assert_eq!(of.len(), 800 / 2 / Kind::ALL.len(), "{kind:?}");
                let early = of.iter().filter(|c| c.after_s < 0.25 * WITHIN_S).count();
                assert!((10..60).contains(&early), "{kind:?}: {early}");
                let out = of.iter().filter(|c| c.then == Direction::Deploy).count();
                assert!((20..90).contains(&out), "{kind:?}: {out}");
            }
        }
        assert_eq!(case(1, 5), cases[5]);
        assert_ne!(case(2, 5).after_s, cases[5].after_s);
    }
}
