//! What is kept of a run on the board: the plant's truth, what passed at the pins, and
//! what the firmware says of itself in its log.

use interstage::model::Planner;
use sha2::{Digest, Sha256};

use crate::board::bench::Passed;
use crate::board::log::Line;
use crate::plant::ledger::Crossing;
use crate::plant::rig::{Truth, VirtualRig};
use crate::record::{CrossingLine, LogLine, Recording, Report, Row, Summary};
use crate::scenario::{Direction, Scenario};

/// As in software: how far from the end of travel a run that arrived may stand, mm.
const ARRIVED_WITHIN_MM: f64 = 1.0;

/// What the log says of a mode, and its number in [`crate::record::MODE_NAMES`].
const MODES: [(&str, u8); 11] = [
    ("boot", 0),
    ("self-test", 1),
    ("zeroing", 2),
    ("idle", 3),
    ("preloading", 4),
    ("cruise", 5),
    ("approach", 6),
    ("crossing", 7),
    ("settle", 8),
    ("stopping", 9),
    ("fault hold", 11),
];
const COMPLETE: u8 = 10;
const FAULT_HOLD: u8 = 11;
const IDLE: u8 = 3;
/// Under way or coming to rest.
const MOVING: std::ops::Range<u8> = 5..10;

/// Values of the log's line about a crossing, in their order: milliseconds, step,
/// position, residual, speed, preload, peak, lead, tread, gap measured, predicted, slip
/// margin, stiffness.
const VALUES: usize = 13;

/// What the firmware reported of a crossing.
#[derive(Clone, Copy, Debug)]
struct Reported {
    index: u8,
    found_mm: f64,
    lead_s: f64,
    measured_mm: f64,
    predicted_mm: f64,
}

/// A run's record as it grows.
pub(super) struct Trace {
    digest: Sha256,
    rows: Vec<Row>,
    log: Vec<LogLine>,
    faults: Vec<Report>,
    limits: Vec<Report>,
    reported: Vec<Reported>,
    gap_ref: f64,
    start_mm: f64,
    mode: u8,
    stage: u8,
    run_started: Option<f64>,
    run_ended: f64,
    preload_sum: f64,
    moving: u32,
    worst_separation: f64,
    steps: u32,
}

impl Trace {
    pub(super) fn new(scenario: &Scenario, plant: &VirtualRig) -> Self {
        let planner = Planner::try_build(&scenario.rig).ok();
        let direction = scenario.run.direction.into();
        Self {
            digest: Sha256::new(),
            rows: Vec::new(),
            log: Vec::new(),
            faults: Vec::new(),
            limits: Vec::new(),
            reported: Vec::new(),
            gap_ref: planner.map_or(f64::NAN, |planner| planner.gap_ref(direction).to_num()),
            start_mm: plant.truth().position_mm,
            mode: 0,
            stage: 1,
            run_started: None,
            run_ended: 0.0,
            preload_sum: 0.0,
            moving: 0,
            worst_separation: 0.0,
            steps: 0,
        }
    }

    /// What it does, as a number in [`crate::record::MODE_NAMES`].
    pub(super) const fn mode(&self) -> u8 {
        self.mode
    }

    /// Waiting for a command, by its own word.
    pub(super) const fn is_idle(&self) -> bool {
        self.mode == IDLE
    }

    /// Arrived, or held by a fault.
    pub(super) const fn is_over(&self) -> bool {
        matches!(self.mode, COMPLETE | FAULT_HOLD)
    }

    /// Looks at a millisecond that began at `t_s` and ended with the plant in `truth`.
    pub(super) fn look(
        &mut self,
        t_s: f64,
        passed: &Passed,
        lines: &[Line],
        truth: &Truth,
        keep_row: bool,
    ) {
        self.steps += 1;
        self.digest_pins(passed);
        for line in lines {
            self.digest.update(line.text.as_bytes());
            self.read(t_s, line);
        }
        if MOVING.contains(&self.mode) {
            self.run_started.get_or_insert(t_s);
            self.run_ended = t_s;
            self.preload_sum += truth.preload_n;
            self.moving += 1;
            self.worst_separation = self.worst_separation.max(truth.separation_mm);
        }
        if keep_row {
            self.rows.push(self.row(t_s, passed, truth));
        }
    }

    /// Adds every bit that went into the board and came out of it.
    fn digest_pins(&mut self, passed: &Passed) {
        let Passed { codes, drives } = passed;
        for code in [codes.wheel.get(), codes.load_cell.get(), codes.tread.get(), codes.arm.get()] {
            self.digest.update(code.to_le_bytes());
        }
        for duty in [drives.drive, drives.preload] {
            self.digest.update(duty.to_le_bytes());
        }
        self.digest.update([u8::from(drives.drive_on), u8::from(drives.preload_on)]);
    }

    /// Takes from a line of the log what it says.
    fn read(&mut self, t_s: f64, line: &Line) {
        let level = if line.level.is_empty() { "" } else { " " };
        let text = format!("{}{level}{}", line.level, line.text);
        self.log.push(LogLine { t_s, text });
        if let Some(mode) = line.behind("mode: ") {
            self.mode = number_of(mode);
        } else if line.text.contains("] stage ") {
            self.stage = line.numbers().get(1).map_or(self.stage, |number| *number as u8);
        } else if line.text.contains("] step ") {
            self.reported.extend(crossing(line));
        } else {
            for (kind, reports) in [("] fault ", &mut self.faults), ("] limit ", &mut self.limits)]
            {
                let said = line.behind(kind).and_then(|rest| rest.split_once(": "));
                if let Some((code, text)) = said
                    && let Ok(code) = code.parse()
                {
                    reports.push(Report { t_s, code, text: text.to_owned() });
                }
            }
        }
    }

    fn row(&self, t_s: f64, passed: &Passed, truth: &Truth) -> Row {
        // What the firmware believes is inside it; the pins do not tell.
        let unknown = f64::NAN;
        Row {
            t_s,
            mode: self.mode,
            stage: self.stage,
            level: self.reported.len() as u8,
            position_true_mm: truth.position_mm,
            position_est_mm: unknown,
            speed_true_mm_s: truth.speed_mm_s,
            speed_est_mm_s: unknown,
            speed_ref_mm_s: unknown,
            preload_true_n: truth.preload_n,
            preload_meas_n: unknown,
            preload_ref_n: unknown,
            radius_true_mm: truth.radius_mm,
            radius_est_mm: unknown,
            compression_true_mm: truth.depth_mm,
            compression_meas_mm: unknown,
            root_clearance_mm: truth.root_clearance_mm.unwrap_or(f64::NAN),
            gap_predicted_mm: unknown,
            corner_force_n: truth.corner_n,
            floor_force_n: truth.floor_n,
            utilisation: truth.utilisation,
            slip_margin_true: truth.friction - truth.utilisation.abs(),
            slip_margin_est: unknown,
            slip_mm: truth.slip_mm,
            vibration_um: truth.vibration_mm * 1e3,
            drive_duty: passed.drives.drive,
            preload_duty: passed.drives.preload,
        }
    }

    /// The record of a run that took `wall_s` to compute.
    pub(super) fn finish(self, scenario: &Scenario, plant: &VirtualRig, wall_s: f64) -> Recording {
        let truth = plant.truth();
        let steps = plant.parameters().wall.steps().len();
        let end_mm = match scenario.run.direction {
            Direction::Deploy => scenario.rig.rig.travel_mm,
            Direction::Retract => 0.0,
        };
        let there =
            self.mode == COMPLETE && (truth.position_mm - end_mm).abs() <= ARRIVED_WITHIN_MM;
        let crossings: Vec<CrossingLine> =
            plant.ledger().crossings().iter().map(|crossing| self.line(crossing)).collect();
        let worst = crossings.iter().map(|c| c.gap_mm).fold(self.worst_separation, f64::max);
        let total_s = f64::from(self.steps) * 1e-3;
        let summary = Summary {
            completed: there && crossings.len() == steps && self.faults.is_empty(),
            target: "board".into(),
            controller: scenario.run.controller.name().into(),
            direction: scenario.run.direction.name().into(),
            rig: scenario.preset.clone(),
            seed: scenario.run.seed,
            duration_s: self.run_started.map_or(0.0, |from| self.run_ended - from),
            total_s,
            travel_mm: (truth.position_mm - self.start_mm).abs(),
            gap_ref_mm: self.gap_ref,
            max_gap_mm: worst,
            slip_mm: truth.slip_mm,
            mean_preload_n: self.preload_sum / f64::from(self.moving.max(1)),
            energy_j: truth.work_mj * 1e-3,
            wear_j: truth.wear_mj * 1e-3,
            faults: self.faults,
            limits: self.limits,
            real_time_factor: total_s / wall_s.max(1e-9),
            trace_digest: self.digest.finalize().iter().map(|b| format!("{b:02x}")).collect(),
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

    /// Ledger line: the plant's truth with what the firmware logged of the same step.
    fn line(&self, crossing: &Crossing) -> CrossingLine {
        let index = crossing.index as u8;
        let said = self.reported.iter().find(|reported| reported.index == index);
        let told = |value: fn(&Reported) -> f64| said.map(value);
        CrossingLine {
            index,
            speed_mm_s: crossing.speed_mm_s,
            preload_n: crossing.preload_n,
            gap_mm: crossing.gap_mm,
            gap_predicted_mm: told(|r| r.predicted_mm),
            gap_measured_mm: told(|r| r.measured_mm),
            corner_force_n: crossing.corner_n,
            lead_time_s: told(|r| r.lead_s),
            slip_mm: crossing.slip_mm,
            touch_s: crossing.touch_s,
            lift_s: crossing.lift_s,
            step_mm: crossing.step_mm,
            step_found_mm: told(|r| r.found_mm),
            peak_preload_n: crossing.peak_preload_n,
            peak_utilisation: crossing.peak_utilisation,
        }
    }
}

/// Number of the mode that the log names so.
fn number_of(text: &str) -> u8 {
    if matches!(text, "deployed" | "retracted") {
        return COMPLETE;
    }
    let found = MODES.iter().find(|(name, _)| text.contains(name));
    found.map_or(FAULT_HOLD, |(_, number)| *number)
}

/// What a line about a crossing says.
fn crossing(line: &Line) -> Option<Reported> {
    let values = line.numbers();
    let [_, index, found_mm, _, _, _, _, lead_s, _, measured_mm, predicted_mm, _, _] =
        <[f64; VALUES]>::try_from(values).ok()?;
    Some(Reported { index: index as u8, found_mm, lead_s, measured_mm, predicted_mm })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_known_by_what_the_log_calls_them() {
        assert_eq!(number_of("zeroing"), 2);
        assert_eq!(number_of("preloading to deploy"), 4);
        assert_eq!(number_of("retracting: settle"), 8);
        assert_eq!(number_of("deployed"), COMPLETE);
        assert_eq!(number_of("stopping while deploying"), 9);
        assert_eq!(number_of("fault hold, 104"), FAULT_HOLD);
    }
}
