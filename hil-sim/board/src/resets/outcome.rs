//! What a campaign of resets comes to.

use serde::Serialize;

use super::aim::aim_of;
use super::{After, Kind};

/// The figures of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Resets made.
    pub resets: usize,
    /// Without a record, or with a wrong one.
    pub unrecorded: usize,
    /// By the watchdog, of which the record does not name who hung: caught with interrupts
    /// masked.
    pub unnamed: usize,
    /// Whose stored parameters changed.
    pub parameters_changed: usize,
    /// That moved, drove or let go before the command.
    pub not_held: usize,
    /// That arrived where they were sent.
    pub completed: usize,
    /// That asked for the other way, and arrived there.
    pub other_way: usize,
    /// That arrived nowhere.
    pub incomplete: usize,
    /// Most motion from reset to command, mm.
    pub worst_motion_mm: f64,
    /// Most motion from being caught to the watchdog's reset, mm.
    pub worst_hung_mm: f64,
    /// Most change of preload meanwhile, N.
    pub worst_preload_n: f64,
    /// The same by what reset the board.
    pub kinds: Vec<KindOutcome>,
    /// The same by what the drive was doing.
    pub modes: Vec<ModeOutcome>,
    /// Those with which something is wrong.
    pub wrong: Vec<After>,
}

/// The figures of one kind of reset.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KindOutcome {
    /// What reset the board.
    pub kind: Kind,
    /// Resets made.
    pub resets: usize,
    /// With their record.
    pub recorded: usize,
    /// Held until the command.
    pub held: usize,
    /// That arrived where they were sent.
    pub completed: usize,
    /// That arrived the other way.
    pub other_way: usize,
    /// Most motion from reset to command, mm.
    pub worst_motion_mm: f64,
}

/// The figures of the resets in one mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeOutcome {
    /// The mode, out and back alike.
    pub mode: &'static str,
    /// Resets made.
    pub resets: usize,
    /// Of them by the watchdog.
    pub watchdog: usize,
    /// That arrived where they were sent.
    pub completed: usize,
    /// That arrived the other way.
    pub other_way: usize,
}

/// By mode, in the order of their names.
fn modes(all: &[After]) -> Vec<ModeOutcome> {
    let mut modes = std::collections::BTreeMap::new();
    for after in all {
        let mode = aim_of(&after.mode);
        let of = modes.entry(mode).or_insert(ModeOutcome {
            mode,
            resets: 0,
            watchdog: 0,
            completed: 0,
            other_way: 0,
        });
        of.resets += 1;
        of.watchdog += usize::from(after.case.kind == Kind::Watchdog);
        of.completed += usize::from(after.completed);
        of.other_way += usize::from(after.other_way);
    }
    modes.into_values().collect()
}

fn most(of: impl Iterator<Item = f64>) -> f64 {
    of.fold(0.0, f64::max)
}

impl Outcome {
    /// Of these.
    #[must_use]
    pub fn of(all: &[After]) -> Self {
        let count = |pick: &dyn Fn(&After) -> bool| all.iter().filter(|a| pick(a)).count();
        let kinds = Kind::ALL.into_iter().map(|kind| {
            let of = |pick: &dyn Fn(&After) -> bool| count(&|a| a.case.kind == kind && pick(a));
            KindOutcome {
                kind,
                resets: of(&|_| true),
                recorded: of(&|a| a.record),
                held: of(&|a| a.held),
                completed: of(&|a| a.completed),
                other_way: of(&|a| a.other_way),
                worst_motion_mm: most(
                    all.iter().filter(|a| a.case.kind == kind).map(|a| a.motion_mm),
                ),
            }
        });
        Self {
            resets: all.len(),
            unrecorded: count(&|a| !a.record),
            unnamed: count(&|a| a.case.kind == Kind::Watchdog && a.late.is_empty()),
            parameters_changed: count(&|a| !a.parameters),
            not_held: count(&|a| !a.held),
            completed: count(&|a| a.completed),
            other_way: count(&|a| a.other_way),
            incomplete: count(&|a| !a.completed && !a.other_way),
            worst_motion_mm: most(all.iter().map(|a| a.motion_mm)),
            worst_hung_mm: most(all.iter().map(|a| a.hung_mm)),
            worst_preload_n: most(all.iter().map(|a| a.preload_n)),
            kinds: kinds.collect(),
            modes: modes(all),
            wrong: all.iter().filter(|a| !a.wrong.is_empty()).cloned().collect(),
        }
    }

    /// Whether every reset was survived.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.unrecorded + self.parameters_changed + self.not_held + self.incomplete == 0
            && self.wrong.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::super::case;
    use super::*;

    fn after(index: u64) -> After {
        After {
            case: case(3, index),
            mode: "idle".to_owned(),
            position_mm: 1.0,
            record: true,
            parameters: true,
            held: true,
            late: String::new(),
            hung_mm: 0.0,
            motion_mm: 0.25 * index as f64,
            preload_n: 0.5,
            completed: true,
            other_way: false,
            wrong: Vec::new(),
        }
    }

    #[test]
    fn one_bad_reset_is_counted_and_shown() {
        let good: Vec<After> = (0..8).map(after).collect();
        let outcome = Outcome::of(&good);
        assert!(outcome.is_good() && outcome.unnamed == 2);
        assert_eq!((outcome.resets, outcome.completed, outcome.worst_motion_mm), (8, 8, 1.75));
        assert!(outcome.kinds.iter().all(|kind| (kind.resets, kind.held) == (2, 2)));
        let spoil: [fn(&mut After); 5] = [
            |a| a.record = false,
            |a| a.parameters = false,
            |a| a.held = false,
            |a| a.completed = false,
            |a| a.wrong.push("odd".to_owned()),
        ];
        for spoilt in spoil {
            let mut some = good.clone();
            spoilt(&mut some[3]);
            assert!(!Outcome::of(&some).is_good());
        }
        let mut turned = good;
        (turned[2].completed, turned[2].other_way) = (false, true);
        let outcome = Outcome::of(&turned);
        assert!(outcome.is_good() && outcome.other_way == 1 && outcome.incomplete == 0);
    }
}
