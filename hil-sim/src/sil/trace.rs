//! What is kept of a run while it goes on.

use interstage::control::Output;
use interstage::log::{CrossingRecord, Event, Telemetry};
use interstage::supervise::Direction;
use interstage::units::Q16;
use sha2::{Digest, Sha256};

use super::{Reported, Rows, TICK_S, report};
use crate::plant::ledger::Crossing;
use crate::plant::rig::{Truth, VirtualRig};
use crate::record::{CrossingLine, LogLine, Recording, Report, Row, Summary, mode_number};
use crate::scenario::Scenario;

/// Short of the wanted preload by no more than this part of it, it stands: what the
/// controller allows of measured preload, and three deviations of the load cell.
const STANDS_PART: f64 = 0.035;
/// How far from the end of travel a run that arrived may stand, mm: twice what creep and
/// wheel radius leave on the drawn rigs.
const ARRIVED_WITHIN_MM: f64 = 1.0;

/// A run's record as it grows.
pub(super) struct Trace {
    digest: Sha256,
    rows: Rows,
    log: Vec<LogLine>,
    faults: Vec<Report>,
    limits: Vec<Report>,
    reported: Vec<Reported>,
    /// True preload of every tick, N.
    preload: Vec<f32>,
    /// Preload asked for in every tick, N.
    wanted: Vec<f32>,
    gap_ref: f64,
    start_mm: f64,
    run_started: Option<f64>,
    run_ended: f64,
    preload_sum: f64,
    moving: u32,
    worst_separation: f64,
    ticks: u32,
}

impl Trace {
    pub(super) fn new(gap_ref: f64, start_mm: f64) -> Self {
        Self {
            digest: Sha256::new(),
            rows: Rows::new(),
            log: Vec::new(),
            faults: Vec::new(),
            limits: Vec::new(),
            reported: Vec::new(),
            preload: Vec::new(),
            wanted: Vec::new(),
            gap_ref,
            start_mm,
            run_started: None,
            run_ended: 0.0,
            preload_sum: 0.0,
            moving: 0,
            worst_separation: 0.0,
            ticks: 0,
        }
    }

    /// Looks at one tick: the controller's output on the plant's state before it.
    pub(super) fn look(&mut self, output: &Output, truth: &Truth, keep_row: bool) {
        let t_s = f64::from(self.ticks) * TICK_S;
        self.ticks += 1;
        let seen = &output.telemetry;
        digest(&mut self.digest, seen);
        for entry in &output.events {
            let (line, found) = report(t_s, &entry.event);
            self.log.push(line);
            match found {
                Some((true, fault)) => self.faults.push(fault),
                Some((false, limit)) => self.limits.push(limit),
                None => {}
            }
            if let Event::Crossing(record) = entry.event {
                self.reported.push((t_s, record));
            }
        }
        self.preload.push(truth.preload_n as f32);
        self.wanted.push(seen.preload_ref.to_num());
        if seen.mode.moves() {
            self.run_started.get_or_insert(t_s);
            self.run_ended = t_s;
            self.preload_sum += truth.preload_n;
            self.moving += 1;
            self.worst_separation = self.worst_separation.max(truth.separation_mm);
        }
        if keep_row {
            self.rows.push(row(t_s, seen, truth));
        }
    }

    /// The record of a run that `arrived` at the end of this way by the controller's
    /// word, if it did, and took `wall_s` to compute.
    pub(super) fn finish(
        self,
        scenario: &Scenario,
        plant: &VirtualRig,
        arrived: Option<Direction>,
        wall_s: f64,
    ) -> Recording {
        let truth = plant.truth();
        let steps = plant.parameters().wall.steps().len();
        let there = arrived.is_some_and(|way| {
            let end_mm = match way {
                Direction::Deploy => scenario.rig.rig.travel_mm,
                Direction::Retract => 0.0,
            };
            (truth.position_mm - end_mm).abs() <= ARRIVED_WITHIN_MM
        });
        let crossings: Vec<CrossingLine> =
            plant.ledger().crossings().iter().map(|crossing| self.line(crossing)).collect();
        let worst = crossings.iter().map(|c| c.gap_mm).fold(self.worst_separation, f64::max);
        let total_s = f64::from(self.ticks) * TICK_S;
        let summary = Summary {
            completed: there && crossings.len() == steps && self.faults.is_empty(),
            target: "sil".into(),
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
            index: crossing.index as u8,
            speed_mm_s: crossing.speed_mm_s,
            preload_n: crossing.preload_n,
            gap_mm: crossing.gap_mm,
            gap_predicted_mm: num(|r| r.gap_predicted),
            gap_measured_mm: num(|r| r.gap_measured),
            corner_force_n: crossing.corner_n,
            lead_time_s: Some(self.lead_time(crossing.touch_s)),
            slip_mm: crossing.slip_mm,
            touch_s: crossing.touch_s,
            lift_s: crossing.lift_s,
            step_mm: crossing.step_mm,
            step_found_mm: num(|r| r.position),
            peak_preload_n: crossing.peak_preload_n,
            peak_utilisation: crossing.peak_utilisation,
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
        t_s,
        mode: mode_number(seen.mode),
        stage: seen.stage as u8,
        level: seen.level,
        position_true_mm: truth.position_mm,
        position_est_mm: seen.position.to_num(),
        speed_true_mm_s: truth.speed_mm_s,
        speed_est_mm_s: seen.speed.to_num(),
        speed_ref_mm_s: seen.speed_ref.to_num(),
        preload_true_n: truth.preload_n,
        preload_meas_n: seen.preload.to_num(),
        preload_ref_n: seen.preload_ref.to_num(),
        radius_true_mm: truth.radius_mm,
        radius_est_mm: seen.radius.to_num(),
        compression_true_mm: truth.depth_mm,
        compression_meas_mm: seen.compression.to_num(),
        root_clearance_mm: truth.root_clearance_mm.unwrap_or(f64::NAN),
        gap_predicted_mm: seen.gap_predicted.to_num(),
        corner_force_n: truth.corner_n,
        floor_force_n: truth.floor_n,
        utilisation: truth.utilisation,
        slip_margin_true: truth.friction - truth.utilisation.abs(),
        slip_margin_est: seen.slip_margin.to_num(),
        slip_mm: truth.slip_mm,
        vibration_um: truth.vibration_mm * 1e3,
        drive_duty: f64::from(seen.drive.to_bits()) / 32_768.0,
        preload_duty: f64::from(seen.pretightener.to_bits()) / 32_768.0,
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
