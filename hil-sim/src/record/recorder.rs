//! Records a run as it goes on.

use interstage::model::LimitedBy;
use interstage::supervise::{Mode, ServiceDuties};
use interstage::tick::{CrossingRecord, Entry, Event, Telemetry};
use interstage::units::{Direction, Duty, Q16};
use sha2::{Digest, Sha256};

use super::tally::{Ended, Tally, true_line};
use super::{
    Controller, CrossingLine, LogLine, Recording, Report, Tick, mode_number, mode_words, stage_name,
};
use crate::plant::ledger::Crossing;
use crate::plant::rig::{Truth, VirtualRig};
use crate::scenario::Scenario;

/// The record of a run that goes on.
pub struct RunRecorder {
    tally: Tally,
    /// Crossings as the controller reported them, and when, s.
    reported: Vec<(f64, CrossingRecord)>,
}

impl RunRecorder {
    /// A run from `start_mm` with this reference gap, mm.
    pub fn new(gap_ref: f64, start_mm: f64) -> Self {
        Self { tally: Tally::new(gap_ref, start_mm), reported: Vec::new() }
    }

    /// Takes a tick: the controller's state and events, the plant's `truth` before it, and the
    /// controller's columns if rows are kept.
    pub fn take(
        &mut self,
        telemetry: &Telemetry,
        events: &[Entry],
        truth: &Truth,
        columns: Option<Controller>,
    ) {
        let Self { tally, reported: crossings } = self;
        let t_s = tally.time_s();
        digest(&mut tally.digest, telemetry);
        for Entry { event, .. } in events {
            tally.log.push(LogLine { t_s, text: text(event) });
            match reported(t_s, event) {
                Some((true, fault)) => tally.faults.push(fault),
                Some((false, limit)) => tally.limits.push(limit),
                None => {}
            }
            match event {
                Event::Crossing(record) => crossings.push((t_s, *record)),
                Event::Restart(restart) => tally.restart(*restart),
                Event::Mode(Mode::Preload(_)) => tally.accept_command(),
                _ => {}
            }
        }
        if let Some(controller) = columns {
            tally.rows.push(Tick { controller, truth: Some(truth.into()) });
        }
        tally.close_tick(mode_number(telemetry.mode), truth);
    }

    /// The record of a run on `target` that took `wall_s` to compute. `arrived` is the
    /// direction of a completed run, as the controller reports it.
    pub fn finish(
        self,
        target: &'static str,
        scenario: &Scenario,
        plant: &VirtualRig,
        arrived: Option<Direction>,
        wall_s: f64,
    ) -> Recording {
        let Self { tally, reported } = self;
        let ended = Ended { target, scenario, plant, arrived, wall_s };
        tally.finish(&ended, |crossing| crossing_line(crossing, &reported))
    }
}

/// Ledger line: the plant's truth beside what the controller reported of the same step.
fn crossing_line(crossing: &Crossing, reported: &[(f64, CrossingRecord)]) -> CrossingLine {
    // Reported when the crossing is closed: the first of this step after lift-off.
    let same = |(t_s, r): &&(f64, CrossingRecord)| {
        *t_s >= crossing.lift_s
            && (r.direction == Direction::Deploy) == crossing.climbing
            && (r.position.to_num::<f64>() - crossing.step_mm).abs() < 5.0
    };
    let reported = reported.iter().find(same);
    let num = |f: fn(&CrossingRecord) -> Q16| reported.map(|(_, r)| f(r).to_num::<f64>());
    CrossingLine {
        gap_predicted_mm: num(|r| r.gap_predicted),
        gap_measured_mm: num(|r| r.gap_measured),
        slip_measured_mm: num(|r| r.slip),
        height_measured_mm: num(|r| r.height),
        lead_time_s: num(|r| r.lead_time),
        step_found_mm: num(|r| r.position),
        limited_by: reported.and_then(|(_, r)| r.limited_by),
        ..true_line(crossing)
    }
}

/// Adds every bit of the controller's output in this tick.
fn digest(digest: &mut Sha256, seen: &Telemetry) {
    digest.update(seen.at.to_le_bytes());
    for quantity in seen.quantities() {
        digest.update(quantity.to_bits().to_le_bytes());
    }
    digest.update([mode_number(seen.mode), seen.stage as u8, seen.level]);
    digest.update(seen.drive.to_bits().to_le_bytes());
    digest.update(seen.pretightener.to_bits().to_le_bytes());
}

/// Code and sentence of a fault or a limit, and whether it is a fault.
pub(super) fn reported(t_s: f64, event: &Event) -> Option<(bool, Report)> {
    let (latched, code, text) = match event {
        Event::Fault(fault) => (true, fault.code(), fault.sentence()),
        Event::Limit(limit) => (false, limit.code(), limit.sentence()),
        _ => return None,
    };
    Some((latched, Report { t_s, code, text: text.to_owned() }))
}

/// An event as one line of text.
pub fn text(event: &Event) -> String {
    match event {
        Event::Mode(mode) => format!("mode: {}", mode_words(*mode)),
        Event::Stage(stage) => {
            let stage = *stage as u8;
            format!("contact stage {stage}: {}", stage_name(stage))
        }
        Event::Command(command) => format!("command: {}", command.word()),
        Event::Refused(command) => format!("command refused in this mode: {}", command.word()),
        Event::Fault(fault) => format!("fault {}: {}", fault.code(), fault.sentence()),
        Event::Limit(limit) => format!("limit {}: {}", limit.code(), limit.sentence()),
        Event::Lost(entries) => format!("{entries} log entries lost"),
        Event::Restart(restart) => restart.to_string(),
        Event::Service(ServiceDuties { drive, pretightener }) => {
            let percent = |duty: Duty| 100.0 * f64::from(duty.to_bits()) / 32_768.0;
            let (drive, preload) = (percent(*drive), percent(*pretightener));
            format!("service: drive {drive:.1} %, pre-tightener {preload:.1} %")
        }
        Event::Slip(slip) => {
            let [at, amount, sigma] =
                [slip.position, slip.amount, slip.sigma].map(|value| value.to_num::<f64>());
            format!("slipped {amount:.2} mm (one sigma {sigma:.2}) at {at:.1} mm")
        }
        Event::Crossing(c) => format!(
            "crossing {} at {:.2} mm ({:+.2}): {:.2} mm/s, {:.1} N, gap {:.3} mm measured, \
             {:.3} mm predicted, lead {:.2} s, stiffness x{:.3}, limited by {}",
            c.index,
            c.position.to_num::<f64>(),
            c.residual.to_num::<f64>(),
            c.speed.to_num::<f64>(),
            c.preload.to_num::<f64>(),
            c.gap_measured.to_num::<f64>(),
            c.gap_predicted.to_num::<f64>(),
            c.lead_time.to_num::<f64>(),
            c.stiffness_scale.to_num::<f64>(),
            c.limited_by.map_or("no plan", LimitedBy::words),
        ),
    }
}
