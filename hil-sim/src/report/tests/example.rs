//! A made-up run for the tests of what is shown of a run: three crossings in about
//! six seconds, shaped like a real one but from no physics.

use crate::record::{Controller, CrossingLine, LogLine, Recording, Summary, Tick, TrueState};
use crate::scenario::Scenario;

/// Corner touches this far before the step face, mm.
const RUN_MM: f64 = 13.5;
/// Floor lets go this far before the step face, mm.
const LIFT_MM: f64 = 7.2;
const STEPS_MM: [f64; 3] = [18.1, 39.8, 62.2];
const CRUISE_N: f64 = 33.3;
const RAISED_N: f64 = 47.0;
const FAST_MM_S: f64 = 30.0;
const SLOW_MM_S: f64 = 12.0;
const TRAVEL_MM: f64 = 80.0;

/// A completed deployment.
pub(crate) fn deploy() -> Recording {
    let rows = rows();
    let crossings: Vec<CrossingLine> =
        STEPS_MM.iter().enumerate().map(|(i, &step)| line(&rows, i, step)).collect();
    let duration_s =
        rows.iter().filter(|row| row.of_truth(|t| t.speed_true_mm_s) > 0.0).count() as f64 * 1e-3;
    let log = rows
        .windows(2)
        .filter(|pair| pair[0].controller.mode != pair[1].controller.mode)
        .map(|pair| LogLine {
            t_s: pair[1].controller.t_s,
            text: format!("mode {} <{}>", pair[1].controller.mode, pair[1].controller.level),
        })
        .collect();
    let summary = Summary {
        completed: true,
        target: "sil".into(),
        controller: "scheduled".into(),
        direction: "deploy".into(),
        rig: "prototype".into(),
        seed: 1,
        duration_s,
        total_s: rows.last().map_or(0.0, |row| row.controller.t_s),
        travel_mm: TRAVEL_MM,
        gap_ref_mm: 1.62,
        max_gap_mm: crossings.iter().map(|c| c.gap_mm).fold(0.0, f64::max),
        slip_mm: 0.004,
        mean_preload_n: 38.2,
        energy_j: 1.31,
        wear_j: 0.021,
        real_time_factor: 41.5,
        trace_digest: "9f2c6c1d0a53be47".repeat(4),
        crossings,
        ..Summary::default()
    };
    Recording {
        summary,
        rows,
        log,
        parameters: Scenario::default().to_toml(),
        ..Recording::default()
    }
}

/// The same, ended by a fault between the first and the second step.
pub(crate) fn faulted() -> Recording {
    let mut recording = deploy();
    let lift_s = recording.summary.crossings[0].lift_s;
    recording.rows.retain(|row| row.controller.t_s < lift_s + 0.9);
    recording.summary.completed = false;
    let last = recording.rows[recording.rows.len() - 1];
    recording.summary.travel_mm = last.position_mm();
    recording.summary.duration_s = last.controller.t_s - 2.0;
    recording.summary.total_s = last.controller.t_s;
    recording.summary.crossings.truncate(1);
    recording.summary.crossings[0].gap_measured_mm = None;
    recording.summary.max_gap_mm = 1.9;
    recording.summary.faults = vec![crate::record::Report {
        t_s: lift_s + 0.8,
        code: 121,
        text: "the preload did not reach its reference in time".into(),
    }];
    recording.summary.limits = vec![crate::record::Report {
        t_s: lift_s + 0.2,
        code: 201,
        text: "preload held at its limit & speed lowered".into(),
    }];
    recording
}

fn rows() -> Vec<Tick> {
    let mut rows: Vec<Tick> = Vec::new();
    let (mut position, mut speed, mut wanted, mut preload, mut noise) =
        (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64, 1_u32);
    for tick in 0_u32..9000 {
        let t_s = f64::from(tick) * 1e-3;
        let mut random = || {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(noise >> 8) / f64::from(1 << 23) - 1.0
        };
        let moving = t_s > 2.0;
        let near = STEPS_MM.iter().find(|&&s| position > s - RUN_MM - 3.0 && position < s + 1.0);
        let slow = near.is_some() || position > TRAVEL_MM - 2.0;
        let speed_ref = if !moving {
            0.0
        } else if slow {
            SLOW_MM_S
        } else {
            FAST_MM_S
        };
        speed += (speed_ref - speed).clamp(-0.25, 0.25);
        position += speed * 1e-3;
        let ahead = STEPS_MM.iter().any(|&s| position > s - RUN_MM - 12.0 && position < s - 2.0);
        let target = if t_s < 0.5 {
            0.0
        } else if moving && ahead {
            RAISED_N
        } else {
            CRUISE_N
        };
        wanted += (target - wanted).clamp(-0.025, 0.025);
        preload += (wanted - preload) * 0.017;

        let step = STEPS_MM.iter().copied().find(|&s| position > s - 20.0 && position < s + 6.0);
        let climb = step.map_or(0.0, |s| ((position - (s - RUN_MM)) / RUN_MM).clamp(0.0, 1.0));
        let rise = 4.0 * climb * climb * (3.0 - 2.0 * climb);
        let passed = STEPS_MM.iter().filter(|&&s| position > s + 6.0).count();
        let clearance = step.map_or(f64::NAN, |s| {
            let dx: f64 = s - position;
            dx.hypot(25.0 + 0.4 * rise) - 25.0
        });
        let load = (std::f64::consts::PI * climb).sin();
        let touching = step.is_some_and(|s| position > s - RUN_MM && position < s);
        let lifted = step.is_some_and(|s| position > s - LIFT_MM);
        let utilisation = 0.12 + if touching { 0.72 * load } else { 0.0 };
        let compression = preload / 60.0 + 0.35 * load;
        let mode = match (t_s, touching, near.is_some()) {
            _ if position >= TRAVEL_MM => 10,
            (t, ..) if t < 0.1 => 1,
            (t, ..) if t < 0.5 => 2,
            (t, ..) if t < 2.0 => 4,
            (_, true, _) => 7,
            (_, _, true) => 8,
            _ if ahead => 6,
            _ => 5,
        };
        let controller = Controller {
            tick,
            t_s,
            mode,
            stage: match (mode, touching, lifted) {
                (0..=2, ..) => 1,
                (4, ..) => 2,
                (_, true, false) => 3,
                (_, true, true) => 5,
                _ => 6,
            },
            level: passed as u8,
            position_mm: position + 0.05,
            wheel_speed_mm_s: speed + 0.15 * random(),
            speed_ref_mm_s: speed_ref,
            preload_n: preload + 0.2 * random(),
            preload_ref_n: wanted,
            radius_mm: 125.05 - 4.0 * passed as f64 - rise + 0.05 * random(),
            compression_mm: compression + 0.006 * random(),
            gap_predicted_mm: 1.57,
            slip_margin: 1.06 - utilisation,
            drive_duty: speed / 60.0,
            pretightener_duty: (wanted - preload) / 10.0,
            ..Controller::default()
        };
        let truth = TrueState {
            position_true_mm: position,
            speed_true_mm_s: speed,
            preload_true_n: preload,
            radius_true_mm: 125.0 - 4.0 * passed as f64 - rise,
            compression_true_mm: compression,
            root_clearance_mm: clearance,
            corner_force_n: if touching { 31.0 * load } else { 0.0 },
            floor_force_n: if lifted { 0.0 } else { preload * (1.0 - climb / 0.32).max(0.0) },
            utilisation,
            slip_margin_true: 1.1 - utilisation,
            slip_mm: 0.004,
            vibration_true_um: 0.4 * random(),
        };
        rows.push(Tick { controller, truth: Some(truth) });
        if position >= TRAVEL_MM + 0.5 {
            break;
        }
    }
    rows
}

fn line(rows: &[Tick], index: usize, step_mm: f64) -> CrossingLine {
    let at = |mm: f64| rows.iter().find(|row| row.position_mm() >= mm).expect("in the run");
    let (touch, lift) = (at(step_mm - RUN_MM), at(step_mm - LIFT_MM));
    let truth = lift.truth.expect("in every row");
    let gap_mm = truth.root_clearance_mm;
    CrossingLine {
        index: index as u8 + 1,
        speed_mm_s: truth.speed_true_mm_s,
        preload_n: truth.preload_true_n,
        gap_mm,
        gap_predicted_mm: Some(gap_mm * (0.97 + 0.015 * index as f64)),
        gap_measured_mm: (index != 1).then_some(gap_mm + 0.021),
        corner_force_n: 31.0,
        lead_time_s: Some(0.112 - 0.05 * index as f64),
        slip_mm: 0.001,
        touch_s: touch.controller.t_s,
        lift_s: lift.controller.t_s,
        step_mm,
        step_found_mm: Some(step_mm - 0.12),
        peak_preload_n: RAISED_N,
        peak_utilisation: 0.84,
    }
}
