//! The record of a run on the board: the plant's truth, inputs and outputs, and the firmware's
//! log.

use interstage::model::{LimitedBy, Planner};
use sha2::Digest;

use crate::bench::Passed;
use crate::log::Line;
use hil_sim::plant::ledger::Crossing;
use hil_sim::plant::rig::{Truth, VirtualRig};
use hil_sim::record::{
    Controller, CrossingLine, Ended, LogLine, MODE_NAMES, Recording, Report, Tally, Tick, true_line,
};
use hil_sim::scenario::Scenario;

const PRELOAD: u8 = 4;
const COMPLETE: u8 = 10;
const FAULT_HOLD: u8 = 11;

/// Values of the log's line about a crossing, in their order: milliseconds, step,
/// position, residual, speed, preload, peak, lead, compression, gap measured, predicted, slip
/// margin, stiffness.
const VALUES: usize = 13;

/// A crossing in the firmware's log.
#[derive(Clone, Copy, Debug)]
struct Reported {
    index: u8,
    found_mm: f64,
    lead_s: f64,
    measured_mm: f64,
    predicted_mm: f64,
    limited_by: Option<LimitedBy>,
}

/// A run's record as it grows.
pub(super) struct Trace {
    tally: Tally,
    reported: Vec<Reported>,
    mode: u8,
    stage: u8,
}

impl Trace {
    pub(super) fn new(scenario: &Scenario, plant: &VirtualRig) -> Self {
        let planner = Planner::try_build(&scenario.rig).ok();
        let direction = scenario.run.direction.into();
        let gap_ref = planner.map_or(f64::NAN, |planner| planner.gap_ref(direction).to_num());
        Self {
            tally: Tally::new(gap_ref, plant.truth().position_mm),
            reported: Vec::new(),
            mode: 0,
            stage: 1,
        }
    }

    /// Whether it has arrived, or holds because of a fault.
    pub(super) const fn is_over(&self) -> bool {
        matches!(self.mode, COMPLETE | FAULT_HOLD)
    }

    /// Adds a millisecond that ended with the plant in `truth`.
    pub(super) fn add(&mut self, passed: &Passed, lines: &[Line], truth: &Truth, keep_row: bool) {
        let t_s = self.tally.time_s();
        self.digest_pins(passed);
        for line in lines {
            self.tally.digest.update(line.text.as_bytes());
            self.read(t_s, line);
        }
        if keep_row {
            let row = self.row(passed, truth);
            self.tally.rows.push(row);
        }
        self.tally.close_tick(self.mode, truth);
    }

    /// Adds every bit of the board's inputs and outputs to the digest.
    fn digest_pins(&mut self, passed: &Passed) {
        let Passed { codes, drives } = passed;
        let digest = &mut self.tally.digest;
        for code in [
            codes.wheel_encoder.get(),
            codes.preload_sensor.get(),
            codes.compression_sensor.get(),
            codes.arm_angle.get(),
            codes.bridges.drive.get(),
            codes.bridges.pretightener.get(),
        ] {
            digest.update(code.to_le_bytes());
        }
        for duty in [drives.drive, drives.preload] {
            digest.update(duty.to_le_bytes());
        }
        digest.update([u8::from(drives.drive_on), u8::from(drives.preload_on)]);
    }

    /// Reads a line of the log.
    fn read(&mut self, t_s: f64, line: &Line) {
        let level = if line.level.is_empty() { "" } else { " " };
        let text = format!("{}{level}{}", line.level, line.text);
        self.tally.log.push(LogLine { t_s, text });
        if let Some(mode) = line.after("mode: ") {
            self.mode = number_of(mode);
            if self.mode == PRELOAD {
                self.tally.accept_command();
            }
        } else if line.text.contains("] stage ") {
            self.stage = line.numbers().get(1).map_or(self.stage, |number| *number as u8);
        } else if line.text.contains("] step ") {
            self.reported.extend(crossing(line));
        } else {
            let Tally { faults, limits, .. } = &mut self.tally;
            for (kind, reports) in [("] fault ", faults), ("] limit ", limits)] {
                let said = line.after(kind).and_then(|rest| rest.split_once(": "));
                if let Some((code, text)) = said
                    && let Ok(code) = code.parse()
                {
                    reports.push(Report { t_s, code, text: text.to_owned() });
                }
            }
        }
    }

    /// A row from plant, outputs and log.
    fn row(&self, passed: &Passed, truth: &Truth) -> Tick {
        let controller = Controller {
            mode: self.mode,
            stage: self.stage,
            level: self.reported.len() as u8,
            drive_duty: passed.drives.drive,
            pretightener_duty: passed.drives.preload,
            ..Controller::unknown(self.tally.rows.len() as u32)
        };
        Tick { controller, truth: Some(truth.into()) }
    }

    /// The record of a run that took `wall_s` to compute.
    pub(super) fn finish(self, scenario: &Scenario, plant: &VirtualRig, wall_s: f64) -> Recording {
        let Self { tally, reported, mode, .. } = self;
        let arrived = (mode == COMPLETE).then(|| scenario.run.direction.into());
        let ended = Ended { target: "board", scenario, plant, arrived, wall_s };
        tally.finish(&ended, |crossing| line(&reported, crossing))
    }
}

/// Ledger line: the plant's truth with the firmware's log of the same step.
fn line(reported: &[Reported], crossing: &Crossing) -> CrossingLine {
    let said = reported.iter().find(|reported| u32::from(reported.index) == crossing.index as u32);
    let logged = |value: fn(&Reported) -> f64| said.map(value);
    CrossingLine {
        gap_predicted_mm: logged(|r| r.predicted_mm),
        gap_measured_mm: logged(|r| r.measured_mm),
        lead_time_s: logged(|r| r.lead_s),
        step_found_mm: logged(|r| r.found_mm),
        limited_by: said.and_then(|r| r.limited_by),
        ..true_line(crossing)
    }
}

/// Number of a mode from the log, in [`MODE_NAMES`].
fn number_of(text: &str) -> u8 {
    if matches!(text, "deployed" | "retracted") {
        return COMPLETE;
    }
    let found = MODE_NAMES.iter().position(|name| text.contains(name));
    found.map_or(FAULT_HOLD, |number| number as u8)
}

/// Reads a line about a crossing.
fn crossing(line: &Line) -> Option<Reported> {
    let values = line.numbers();
    let [_, index, found_mm, _, _, _, _, lead_s, _, measured_mm, predicted_mm, _, _] =
        <[f64; VALUES]>::try_from(values).ok()?;
    let limited_by = line.text.split_once("limited by ").map(|(_, words)| words.trim());
    let limited_by = LimitedBy::ALL.into_iter().find(|by| Some(by.words()) == limited_by);
    Some(Reported { index: index as u8, found_mm, lead_s, measured_mm, predicted_mm, limited_by })
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
