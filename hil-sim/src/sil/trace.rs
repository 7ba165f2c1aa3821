//! What is kept of a run while it goes on.

use interstage::tick::{CrossingRecord, Event, Output, Telemetry};
use interstage::units::{Direction, Q16};
use sha2::{Digest, Sha256};

use super::{Reported, TICK_S, report};
use crate::plant::ledger::Crossing;
use crate::plant::rig::{Truth, VirtualRig};
use crate::record::tally::{Ended, Tally, true_line, true_row};
use crate::record::{CrossingLine, Recording, Row, mode_number};
use crate::scenario::Scenario;

/// Short of the wanted preload by no more than this part of it, it stands: what the
/// controller allows of measured preload, and three deviations of the load cell.
const STANDS_PART: f64 = 0.035;

/// A run's record as it grows.
pub(crate) struct Trace {
    tally: Tally,
    told: Told,
}

/// What the controller said that its ledger is made of.
#[derive(Default)]
struct Told {
    reported: Vec<Reported>,
    /// True preload of every tick, N.
    preload: Vec<f32>,
    /// Preload asked for in every tick, N.
    wanted: Vec<f32>,
}

impl Trace {
    pub(crate) fn new(gap_ref: f64, start_mm: f64) -> Self {
        Self { tally: Tally::new(gap_ref, start_mm), told: Told::default() }
    }

    /// Looks at one tick: the controller's output on the plant's state before it.
    pub(crate) fn look(&mut self, output: &Output, truth: &Truth, keep_row: bool) {
        let Self { tally, told } = self;
        let t_s = tally.time_s();
        let seen = &output.telemetry;
        digest(&mut tally.digest, seen);
        for entry in &output.events {
            let (line, found) = report(t_s, &entry.event);
            tally.log.push(line);
            match found {
                Some((true, fault)) => tally.faults.push(fault),
                Some((false, limit)) => tally.limits.push(limit),
                None => {}
            }
            if let Event::Crossing(record) = entry.event {
                told.reported.push((t_s, record));
            }
        }
        told.preload.push(truth.preload_n as f32);
        told.wanted.push(seen.preload_ref.to_num());
        if keep_row {
            tally.rows.push(row(t_s, seen, truth));
        }
        tally.close_tick(seen.mode.moves(), truth);
    }

    /// The record of a run on `target` that `arrived` at the end of this way by the
    /// controller's word, if it did, and took `wall_s` to compute.
    pub(crate) fn finish(
        self,
        target: &'static str,
        scenario: &Scenario,
        plant: &VirtualRig,
        arrived: Option<Direction>,
        wall_s: f64,
    ) -> Recording {
        let Self { tally, told } = self;
        let ended = Ended { target, scenario, plant, arrived, wall_s };
        tally.finish(&ended, |crossing| told.line(crossing))
    }
}

impl Told {
    /// Ledger line: the plant's truth with what the controller reported of the same
    /// step beside it.
    fn line(&self, crossing: &Crossing) -> CrossingLine {
        let climbed = |way: Direction| (way == Direction::Deploy) == crossing.climbing;
        // Reported when the crossing is closed: the first of this step after lift-off.
        let same = |(t_s, r): &&Reported| {
            *t_s >= crossing.lift_s
                && climbed(r.direction)
                && (r.position.to_num::<f64>() - crossing.step_mm).abs() < 5.0
        };
        let reported = self.reported.iter().find(same);
        let num = |f: fn(&CrossingRecord) -> Q16| reported.map(|(_, r)| f(r).to_num::<f64>());
        CrossingLine {
            gap_predicted_mm: num(|r| r.gap_predicted),
            gap_measured_mm: num(|r| r.gap_measured),
            lead_time_s: Some(self.lead_time(crossing.touch_s)),
            step_found_mm: num(|r| r.position),
            ..true_line(crossing)
        }
    }

    /// How long the true preload had stood close to the one then wanted when
    /// the corner touched, s; negative by how long it still took.
    fn lead_time(&self, touch_s: f64) -> f64 {
        let touch = ((touch_s / TICK_S) as usize).min(self.preload.len().saturating_sub(1));
        let wanted = self.wanted.get(touch).copied().map_or(0.0, f64::from);
        let stands = |n: &f32| f64::from(*n) >= wanted * (1.0 - STANDS_PART);
        if self.preload.get(touch).is_some_and(stands) {
            let since = self.preload[..touch].iter().rposition(|n| !stands(n)).map_or(0, |i| i + 1);
            (touch - since) as f64 * TICK_S
        } else {
            let late = self.preload[touch..].iter().position(stands);
            -(late.unwrap_or(self.preload.len() - touch) as f64) * TICK_S
        }
    }
}

/// Adds every bit that the controller put out in this tick.
fn digest(digest: &mut Sha256, seen: &Telemetry) {
    let quantities = [
        seen.position,
        seen.speed,
        seen.speed_ref,
        seen.preload,
        seen.preload_ref,
        seen.compression,
        seen.radius,
        seen.gap_predicted,
        seen.slip_margin,
        seen.vibration,
        seen.distance,
    ];
    digest.update(seen.at.to_le_bytes());
    for quantity in quantities {
        digest.update(quantity.to_bits().to_le_bytes());
    }
    digest.update([mode_number(seen.mode), seen.stage as u8, seen.level]);
    digest.update(seen.drive.to_bits().to_le_bytes());
    digest.update(seen.pretightener.to_bits().to_le_bytes());
}

fn row(t_s: f64, seen: &Telemetry, truth: &Truth) -> Row {
    Row {
        mode: mode_number(seen.mode),
        stage: seen.stage as u8,
        level: seen.level,
        position_est_mm: seen.position.to_num(),
        speed_est_mm_s: seen.speed.to_num(),
        speed_ref_mm_s: seen.speed_ref.to_num(),
        preload_meas_n: seen.preload.to_num(),
        preload_ref_n: seen.preload_ref.to_num(),
        radius_est_mm: seen.radius.to_num(),
        compression_meas_mm: seen.compression.to_num(),
        gap_predicted_mm: seen.gap_predicted.to_num(),
        slip_margin_est: seen.slip_margin.to_num(),
        drive_duty: f64::from(seen.drive.to_bits()) / 32_768.0,
        preload_duty: f64::from(seen.pretightener.to_bits()) / 32_768.0,
        ..true_row(t_s, truth)
    }
}

/// An event as one line of text.
#[must_use]
pub fn text(event: &Event) -> String {
    match event {
        Event::Mode(mode) => format!("mode {mode:?}"),
        Event::Stage(stage) => format!("contact stage {} ({stage:?})", *stage as u8),
        Event::Command(command) => format!("command {command:?}"),
        Event::Refused(command) => format!("command {command:?} refused in this mode"),
        Event::Fault(fault) => format!("fault {}: {}", fault.code(), fault.sentence()),
        Event::Limit(limit) => format!("limit {}: {}", limit.code(), limit.sentence()),
        Event::Lost(entries) => format!("{entries} log entries lost"),
        Event::Restart(restart) => restart.to_string(),
        Event::Crossing(c) => format!(
            "crossing {} at {:.2} mm ({:+.2}): {:.2} mm/s, {:.1} N, gap {:.3} mm measured, \
             {:.3} mm predicted, lead {:.2} s, stiffness x{:.3}",
            c.index,
            c.position.to_num::<f64>(),
            c.residual.to_num::<f64>(),
            c.speed.to_num::<f64>(),
            c.preload.to_num::<f64>(),
            c.gap_measured.to_num::<f64>(),
            c.gap_predicted.to_num::<f64>(),
            c.lead_time.to_num::<f64>(),
            c.stiffness_scale.to_num::<f64>(),
        ),
    }
}
