//! The oracle: the fastest run found for one plant when everything about it is known in
//! advance, with the same actuators. It is what any controller of this rig is measured against,
//! an upper estimate of what is possible and no proof.
//!
//! The run is a row of legs, one a step. In a leg the wheel cruises at the limit, brakes as late
//! as acceleration and jerk allow to the crossing speed, keeps it from a distance before the
//! step's event to one behind it, and accelerates again; the preload goes to its target at full
//! slew and is held there over the corner. The event is the instant at which the lower wall
//! stops (retract: begins) to carry. These distances, the preload and the start are found by a
//! [pattern search](pattern), the crossing speed by a root search within it: the largest speed
//! that keeps the gap. Every evaluation is the plant itself, driven through its bridges by
//! feed-forward from its true parameters.
//!
//! Every leg ends at cruise speed under its preload, so the legs hardly affect one another and
//! are optimised one after the other.

mod drive;
mod leg;
pub(crate) mod pattern;

use crate::montecarlo::RunLine;
use crate::report::verdict::SLIP_SEEN_MM;
use crate::scenario::{Direction, Scenario};
use crate::session::{RunError, initial_rig};
use drive::{Driven, Limits};
use leg::{Leg, Reached, Track};
use pattern::pattern_search;

/// Cost of a leg that breaks a bound, s, beside that of by how much.
const BROKEN_S: f64 = 100.0;

/// How thoroughly the oracle searches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Effort {
    /// Halvings of the pattern search.
    halvings: usize,
    /// Distances before and behind the event, mm, from which the search of a leg starts.
    starts: &'static [(f64, f64)],
}

impl Effort {
    /// One start, one halving of the search's steps: for tests.
    #[cfg(test)]
    pub(crate) const COARSE: Self = Self { halvings: 1, starts: &[(0.8, 0.2)] };
    /// Until more no longer matters.
    pub(crate) const FULL: Self =
        Self { halvings: 4, starts: &[(0.8, 0.2), (0.8, -0.5), (0.4, -0.3)] };
}

/// Most runs of a leg for one crossing speed.
const TRIES: usize = 5;

/// What the best run must keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    /// Largest gap at a step, mm.
    pub gap_mm: f64,
    /// Least friction left unused in a crossing.
    pub slip_margin: f64,
}

impl Bounds {
    /// Its gap, or the reference if it did not complete; the `wanted` margin, or its own if less.
    pub(crate) fn of(line: &RunLine, gap_ref_mm: f64, wanted: f64) -> Self {
        let kept = line.least_slip_margin.filter(|_| line.completed).zip(Some(line.max_gap_mm));
        let (slip_margin, gap_mm) = kept.unwrap_or((0.0, gap_ref_mm));
        Self { gap_mm, slip_margin: slip_margin.clamp(0.0, wanted) }
    }
}

/// The best run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OracleRun {
    /// Its figures, as those of any run.
    pub line: RunLine,
    /// Crossing speed, mm/s, and preload, N, of each leg.
    pub legs: Vec<(f64, f64)>,
}

/// The fastest run of the scenario's plant that keeps these bounds, the preload limit, and on
/// the continuous wall the controller's slip margin. A run that cannot keep them does not
/// complete, and its line says why.
pub(crate) fn search(
    scenario: &Scenario,
    bounds: &Bounds,
    effort: Effort,
) -> Result<OracleRun, RunError> {
    let (plant, _) = initial_rig(scenario)?;
    let rig = &scenario.rig;
    let forward = scenario.run.direction == Direction::Deploy;
    let limits = Limits::of(rig, forward);
    let track = Track::new(rig, plant.parameters(), bounds, limits);
    let mut driven = Driven::new(plant, limits);
    let mut legs: Vec<Leg> = Vec::new();
    let mut fails = None;
    for index in 0..track.events.len() {
        let search = LegSearch { track: &track, from: &driven, index, effort };
        let (leg, reached) = search.best(legs.last())?;
        fails = reached.fails().map(|(bound, by)| {
            format!("step {} of the run: {bound} broken by {:.3} %", index + 1, 100.0 * by)
        });
        driven = reached.driven;
        legs.push(leg);
        if fails.is_some() {
            break;
        }
    }
    if fails.is_none() && !driven.run_out()? {
        fails = Some("the end of travel is not reached".to_owned());
    }
    let legs = legs.iter().map(|leg| (leg.speed_mm_s, leg.preload_n)).collect();
    Ok(OracleRun { line: line(scenario.run.seed, &driven, fails), legs })
}

/// The figures of a run that ended like this.
fn line(seed: u64, driven: &Driven, fails: Option<String>) -> RunLine {
    let crossings = driven.plant.ledger().crossings();
    let mu = driven.plant.parameters().mu;
    let gaps = crossings.iter().map(|crossing| crossing.gap_mm);
    let slips = crossings.iter().filter(|crossing| crossing.slip_mm > SLIP_SEEN_MM).count();
    let slipped = driven.plant.truth().slip_mm > SLIP_SEEN_MM;
    let margins = crossings.iter().map(|crossing| mu - crossing.peak_utilisation);
    RunLine {
        seed,
        completed: fails.is_none(),
        duration_s: Some(driven.time_s()),
        moving_s: driven.moving_s(),
        max_gap_mm: gaps.fold(driven.peaks.separation_mm, f64::max),
        slip_events: slips.max(usize::from(slipped)),
        least_slip_margin: margins.min_by(f64::total_cmp),
        mean_preload_n: driven.mean_preload_n(),
        error: fails,
        ..RunLine::default()
    }
}

/// The search for one leg from the state in which the last one ended.
struct LegSearch<'a> {
    track: &'a Track<'a>,
    from: &'a Driven,
    index: usize,
    effort: Effort,
}

impl LegSearch<'_> {
    /// The best leg and how it ends: the best of the searches from every start, one of them
    /// the leg before.
    fn best(&self, before: Option<&Leg>) -> Result<(Leg, Reached), RunError> {
        let fresh = |&(before_mm, after_mm): &(f64, f64)| Leg {
            speed_mm_s: self.track.rig.control.safe_speed_mm_s,
            before_mm,
            after_mm,
            preload_n: 0.98 * self.track.rig.preload.limit_n,
            start_s: 0.0,
        };
        let warm = before.map(|leg| Leg { start_s: 0.0, ..*leg });
        let starts = warm.into_iter().chain(self.effort.starts.iter().map(fresh));
        let mut best: Option<(Leg, Reached)> = None;
        for leg in starts {
            let found = self.improve(leg)?;
            if best.as_ref().is_none_or(|best| found.1.cost() < best.1.cost()) {
                best = Some(found);
            }
        }
        Ok(best.expect("there is a start"))
    }

    /// The best leg that the search finds from this one.
    fn improve(&self, mut leg: Leg) -> Result<(Leg, Reached), RunError> {
        let (limit, slew) = (self.track.rig.preload.limit_n, self.track.rig.preload.slew_n_per_s);
        let mut reached = self.cross(&mut leg)?;
        // The first leg waits for the preload; about how long is found first.
        let rise_s = (leg.preload_n - self.from.plant.truth().preload_n).max(0.0) / slew;
        let waits = rise_s > 0.1;
        for part in [0.2, 0.35, 0.5, 0.65, 0.8].into_iter().filter(|_| waits) {
            let mut later = Leg { start_s: part * rise_s, ..leg };
            let found = self.cross(&mut later)?;
            if found.cost() < reached.cost() {
                (leg, reached) = (later, found);
            }
        }
        let steps = [0.4, 0.3, 0.01 * limit, if waits { 0.1 * rise_s } else { 0.0 }];
        let mut best = (leg, reached);
        let mut failed = None;
        pattern_search(&steps, self.effort.halvings, |changes| {
            let mut tried = best.0.changed(changes, limit);
            match self.cross(&mut tried) {
                Ok(found) if found.cost() < best.1.cost() => best = (tried, found),
                Ok(_) => return false,
                Err(error) => {
                    failed = Some(error);
                    return false;
                }
            }
            true
        });
        failed.map_or(Ok(best), Err)
    }

    /// Runs the leg with the largest crossing speed that keeps the gap, near its own.
    fn cross(&self, leg: &mut Leg) -> Result<Reached, RunError> {
        let drive = &self.track.rig.drive;
        let range = (drive.min_crossing_speed_mm_s, drive.cruise_speed_mm_s);
        let mut best: Option<(f64, Reached)> = None;
        pattern::largest_below(range, leg.speed_mm_s, TRIES, |speed_mm_s| {
            let reached = self.track.run(self.from, self.index, &Leg { speed_mm_s, ..*leg })?;
            let excess = reached.gap_excess;
            if best.as_ref().is_none_or(|(_, best)| reached.cost() < best.cost()) {
                best = Some((speed_mm_s, reached));
            }
            Ok::<f64, RunError>(excess)
        })?;
        let (speed_mm_s, reached) = best.expect("at least one run was made");
        leg.speed_mm_s = speed_mm_s;
        Ok(reached)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_run_keeps_its_bounds_and_its_actuators() {
        // What a run of the nominal prototype reaches with any strategy.
        for (direction, gap_mm) in [(Direction::Deploy, 2.6), (Direction::Retract, 2.32)] {
            let mut scenario = Scenario::default();
            scenario.run.direction = direction;
            let bounds = Bounds { gap_mm, slip_margin: 0.2 };
            let run = search(&scenario, &bounds, Effort::COARSE).unwrap();
            let line = &run.line;
            assert!(line.completed, "{line:?}");
            assert!(line.max_gap_mm <= gap_mm && line.slip_events == 0, "{line:?}");
            assert!(line.least_slip_margin.unwrap() >= 0.2, "{line:?}");
            // No faster than without steps: 80 mm at 30 mm/s, accelerated and braked.
            assert!(line.moving_s > 2.83, "{line:?}");
            assert!(line.duration_s.unwrap() < 5.0, "{line:?}");
            assert_eq!(run.legs.len(), 3);
            assert!(run.legs.iter().all(|(_, preload)| *preload <= 50.0), "{run:?}");
        }
    }

    #[test]
    fn more_room_is_no_slower_and_no_room_does_not_complete() {
        let duration = |gap_mm| {
            let bounds = Bounds { gap_mm, slip_margin: 0.2 };
            let line = search(&Scenario::default(), &bounds, Effort::COARSE).unwrap().line;
            line.duration_s.filter(|_| line.completed)
        };
        let [narrow, wide] = [2.58, 2.68].map(|gap| duration(gap).expect("possible"));
        assert!(wide < narrow, "{wide} {narrow}");
        assert_eq!(duration(1.0), None);
    }

    #[test]
    fn a_run_that_did_not_complete_bounds_nothing_but_the_reference() {
        let mut line = RunLine {
            completed: true,
            max_gap_mm: 2.4,
            least_slip_margin: Some(0.3),
            ..RunLine::default()
        };
        assert_eq!(Bounds::of(&line, 2.6, 0.1), Bounds { gap_mm: 2.4, slip_margin: 0.1 });
        line.completed = false;
        assert_eq!(Bounds::of(&line, 2.6, 0.1), Bounds { gap_mm: 2.6, slip_margin: 0.0 });
    }
}
