//! The sums of a run on any target: when it moved, with what preload, how far wheel and
//! wall separated, whether it arrived.

use interstage::restart::Restart;
use interstage::units::Direction;
use sha2::{Digest, Sha256};

use super::tick::MOVES;
use super::time_lost::TimeSplit;
use super::{CrossingLine, LogLine, Recording, Report, Summary, Tick, drawn};
use crate::plant::ledger::Crossing;
use crate::plant::rig::{Truth, VirtualRig};
use crate::scenario::Scenario;
use crate::session::longest_s;

/// Period of a tick, s.
pub(super) const TICK_S: f64 = 1e-3;
/// Largest distance from the end of travel after arrival, mm: twice the effect of creep and
/// wheel radius on the drawn rigs.
const ARRIVED_WITHIN_MM: f64 = 1.0;

/// The sums of a run as it goes on.
#[derive(Default)]
pub(super) struct Tally {
    /// Digest of the controller's outputs.
    pub(super) digest: Sha256,
    /// One row a tick, if they are kept.
    pub(super) rows: Vec<Tick>,
    pub(super) log: Vec<LogLine>,
    /// Latched faults.
    pub(super) faults: Vec<Report>,
    /// Active limits.
    pub(super) limits: Vec<Report>,
    gap_ref_mm: f64,
    start_mm: f64,
    commanded: Option<f64>,
    run_started: Option<f64>,
    run_ended: f64,
    preload_sum: f64,
    moving: u32,
    worst_separation: f64,
    split: TimeSplit,
    /// What restarted the controller after the command.
    restart: Option<String>,
    passed: u32,
}

pub(super) struct Ended<'a> {
    /// What ran the controller.
    pub(super) target: &'static str,
    pub(super) scenario: &'a Scenario,
    /// The plant at the end.
    pub(super) plant: &'a VirtualRig,
    /// Direction of a completed run, as the controller reports it.
    pub(super) arrived: Option<Direction>,
    /// Wall-clock time that it took, s.
    pub(super) wall_s: f64,
}

impl Tally {
    /// A run that begins at `start_mm` and is planned for gaps of `gap_ref_mm`.
    pub(super) fn new(gap_ref_mm: f64, start_mm: f64) -> Self {
        Self { gap_ref_mm, start_mm, ..Self::default() }
    }

    /// Time at which this tick began, s.
    pub(super) fn time_s(&self) -> f64 {
        f64::from(self.passed) * TICK_S
    }

    /// A command was accepted in this tick: from it on the duration counts, unless the drive
    /// already moved.
    pub(super) fn accept_command(&mut self) {
        if self.run_started.is_none() {
            self.commanded = Some(self.time_s());
        }
    }

    /// The controller reports why it started: under way, that ends the run.
    pub(super) fn restart(&mut self, cause: Restart) {
        if self.commanded.is_some() {
            self.restart = Some(restart_words(cause));
        }
    }

    /// Ends a tick in the mode of this number.
    pub(super) fn close_tick(&mut self, mode: u8, truth: &Truth) {
        let t_s = self.time_s();
        self.split.add(t_s, mode, truth.position_mm);
        if MOVES.contains(&mode) {
            self.run_started.get_or_insert(t_s);
            self.run_ended = t_s;
            self.preload_sum += truth.preload_n;
            self.moving += 1;
            self.worst_separation = self.worst_separation.max(truth.separation_mm);
        }
        self.passed += 1;
    }

    /// The record of the run; `line` makes a line of its ledger.
    pub(super) fn finish(
        self,
        ended: &Ended<'_>,
        line: impl Fn(&Crossing) -> CrossingLine,
    ) -> Recording {
        let Ended { target, scenario, plant, arrived, wall_s } = *ended;
        let truth = plant.truth();
        let steps = plant.parameters().wall.steps().len();
        let there = arrived.is_some_and(|direction| {
            let end_mm = match direction {
                Direction::Deploy => scenario.rig.rig.travel_mm,
                Direction::Retract => 0.0,
            };
            (truth.position_mm - end_mm).abs() <= ARRIVED_WITHIN_MM
        });
        let crossings: Vec<CrossingLine> = plant.ledger().crossings().iter().map(line).collect();
        let worst = crossings.iter().map(|c| c.gap_mm).fold(self.worst_separation, f64::max);
        let completed = there && crossings.len() == steps && self.faults.is_empty();
        let cruise_mm_s = scenario.rig.drive.cruise_speed_mm_s;
        let has_gap = !crossings.is_empty() || worst > 0.0;
        let total_s = self.time_s();
        let summary = Summary {
            completed,
            target: target.into(),
            controller: scenario.run.controller.name().into(),
            direction: scenario.run.direction.name().into(),
            rig: scenario.preset.clone(),
            seed: scenario.run.seed,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            overrides: scenario.overrides(),
            drawn: drawn::of(plant.parameters(), scenario),
            measured: false,
            missing: Vec::new(),
            commanded_s: self.run_started.and(self.commanded),
            duration_s: self.run_started.and(self.commanded).map(|from| self.run_ended - from),
            moving_s: self.run_started.map_or(0.0, |from| self.run_ended - from),
            lost: completed.then(|| self.split.lost(cruise_mm_s)),
            total_s,
            cut_off_s: Some(longest_s(&scenario.rig)).filter(|longest_s| total_s >= *longest_s),
            travel_mm: (truth.position_mm - self.start_mm).abs(),
            gap_ref_mm: self.gap_ref_mm,
            max_gap_mm: if has_gap { worst } else { f64::NAN },
            slip_mm: truth.slip_mm,
            mean_preload_n: self.preload_sum / f64::from(self.moving.max(1)),
            energy_j: truth.work_mj * 1e-3,
            wear_j: truth.wear_mj * 1e-3,
            faults: self.faults,
            limits: self.limits,
            injected: scenario.run.faults.iter().map(ToString::to_string).collect(),
            real_time_factor: total_s / wall_s.max(1e-9),
            trace_digest: self.digest.finalize().iter().map(|b| format!("{b:02x}")).collect(),
            restart: self.restart,
            crossings,
        };
        Recording {
            summary,
            rows: self.rows,
            log: self.log,
            parameters: scenario.to_toml(),
            stream: Vec::new(),
        }
    }
}

/// A ledger line with what the plant knows.
pub(super) fn true_line(crossing: &Crossing) -> CrossingLine {
    CrossingLine {
        index: crossing.index as u8,
        speed_mm_s: crossing.speed_mm_s,
        preload_n: crossing.preload_n,
        gap_mm: crossing.gap_mm,
        gap_predicted_mm: None,
        gap_measured_mm: None,
        corner_force_n: crossing.corner_n,
        lead_time_s: None,
        slip_mm: crossing.slip_mm,
        slip_measured_mm: None,
        height_measured_mm: None,
        touch_s: crossing.touch_s,
        lift_s: crossing.lift_s,
        step_mm: crossing.step_mm,
        step_found_mm: None,
        peak_preload_n: crossing.peak_preload_n,
        peak_utilisation: crossing.peak_utilisation,
        limited_by: None,
    }
}

/// What restarted the target, and what it did before.
pub(super) fn restart_words(restart: Restart) -> String {
    restart.to_string().replacen("started: ", "", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth(preload_n: f64, separation_mm: f64) -> Truth {
        let scenario = Scenario::resolve(Some("prototype"), None, &[]).expect("a scenario");
        let plant = VirtualRig::new(scenario.plant(), 0.0, 0.0, TICK_S);
        Truth { preload_n, separation_mm, ..*plant.truth() }
    }

    #[test]
    fn only_ticks_under_way_count() {
        let mut tally = Tally::new(2.5, 0.0);
        for (moves, preload, separation) in
            [(false, 90.0, 9.0), (true, 30.0, 0.1), (true, 40.0, 0.3), (false, 90.0, 9.0)]
        {
            tally.close_tick(if moves { 5 } else { 3 }, &truth(preload, separation));
        }
        assert_eq!((tally.run_started, tally.run_ended), (Some(1e-3), 2e-3));
        assert_eq!((tally.preload_sum, tally.moving), (70.0, 2));
        assert_eq!((tally.worst_separation, tally.time_s()), (0.3, 4e-3));
    }

    #[test]
    fn the_duration_counts_from_the_last_command_before_the_motion() {
        let durations = |moves: bool, commands: &[usize]| {
            let scenario = Scenario::default();
            let plant = VirtualRig::new(scenario.plant(), 0.0, 0.0, TICK_S);
            let mut tally = Tally::new(2.5, 0.0);
            for tick in 0..10 {
                if commands.contains(&tick) {
                    tally.accept_command();
                }
                let under_way = moves && (5..9).contains(&tick);
                tally.close_tick(if under_way { 5 } else { 3 }, plant.truth());
            }
            let ended = Ended {
                target: "sil",
                scenario: &scenario,
                plant: &plant,
                arrived: None,
                wall_s: 1.0,
            };
            let summary = tally.finish(&ended, true_line).summary;
            (summary.duration_s.map(|s| (1e3 * s).round()), (1e3 * summary.moving_s).round())
        };
        assert_eq!(durations(true, &[1, 3, 7]), (Some(5.0), 3.0));
        // Without a command in the log nothing is claimed, nor without motion.
        assert_eq!(durations(true, &[]), (None, 3.0));
        assert_eq!(durations(false, &[1]), (None, 0.0));
    }

    #[test]
    fn arriving_takes_the_place_and_every_step() {
        let scenario = Scenario::resolve(Some("prototype"), None, &[]).expect("a scenario");
        let end = scenario.rig.rig.travel_mm;
        let plant = VirtualRig::new(scenario.plant(), end, 33.3, TICK_S);
        let finish = |arrived| {
            let ended =
                Ended { target: "sil", scenario: &scenario, plant: &plant, arrived, wall_s: 1.0 };
            Tally::new(2.5, 0.0).finish(&ended, true_line).summary
        };
        // It is at the end of travel, but no step has been crossed.
        assert!(!finish(Some(Direction::Deploy)).completed);
        assert_eq!(finish(Some(Direction::Deploy)).travel_mm, end);
        assert!(!finish(None).completed);
    }

    #[test]
    fn a_run_that_is_cut_off_says_so() {
        let scenario = Scenario::default();
        let plant = VirtualRig::new(scenario.plant(), 0.0, 0.0, TICK_S);
        let cut_off = |passed| {
            let ended = Ended {
                target: "sil",
                scenario: &scenario,
                plant: &plant,
                arrived: None,
                wall_s: 1.0,
            };
            let tally = Tally { passed, ..Tally::new(2.5, 0.0) };
            tally.finish(&ended, true_line).summary
        };
        assert_eq!(cut_off(119_999).cut_off_s, None);
        assert_eq!(cut_off(120_000).cut_off_s, Some(120.0));
        let said = crate::report::verdict::headline(&cut_off(120_000));
        assert!(said.starts_with("Did not complete within 120 s: "), "{said}");
    }
}
