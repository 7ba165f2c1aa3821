//! Records a run on any target as it goes on: its sums, what the controller reported, and its rows.

use interstage::model::LimitedBy;
use interstage::restart::Restart;
use interstage::supervise::{Mode, ServiceDuties};
use interstage::tick::{CrossingRecord, Entry, Event, Telemetry};
use interstage::units::{Direction, Duty, Q16};
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use super::row::MOVES;
use super::time_lost::TimeSplit;
use super::{
    Columns, CrossingLine, LogLine, Recording, Report, Row, Summary, mode_number, mode_words,
    stage_name,
};
use crate::plant::draw::PlantParameters;
use crate::plant::ledger::Crossing;
use crate::plant::rig::{Truth, VirtualRig};
use crate::plant::spread::Section;
use crate::scenario::{MismatchDraw, Scenario, TICK_S};
use crate::session::longest_s;
use crate::table::counted;

/// Largest distance from the end of travel after arrival, mm: twice the effect of creep and
/// wheel radius on the drawn rigs.
const ARRIVED_WITHIN_MM: f64 = 1.0;
/// Largest distance of a step from where the controller found it, mm: the most that a rig may have as
/// its `rig.step_tolerance_mm`, which is less than half of what parts two steps.
const SAME_STEP_MM: f64 = 5.0;

/// The record of a run that goes on: the one builder of a [`Summary`], with the plant's truth or
/// from what the controller measured alone.
#[derive(Default)]
pub(crate) struct RunRecorder {
    /// Digest of the controller's outputs.
    digest: Sha256,
    /// One row a tick, if they are kept.
    pub(super) rows: Vec<Row>,
    pub(super) log: Vec<LogLine>,
    /// Crossings as the controller reported them, and when, s.
    reported: Vec<(f64, CrossingRecord)>,
    /// Reference gap, faults, limits, and what restarted the controller after the command.
    summary: Summary,
    start_mm: f64,
    /// The mode seen last.
    pub(super) mode: Mode,
    commanded: Option<f64>,
    run_started: Option<f64>,
    run_ended: f64,
    preload_sum: f64,
    moving: u32,
    worst_separation: f64,
    split: TimeSplit,
    passed: u32,
}

impl RunRecorder {
    /// A run from `start_mm` with this reference gap, mm.
    pub(crate) fn new(gap_ref_mm: f64, start_mm: f64) -> Self {
        let summary = Summary { gap_ref_mm, ..Summary::default() };
        Self { summary, start_mm, ..Self::default() }
    }

    /// Takes the tick after the last: the controller's state and events, the plant's `truth` before
    /// it, and the controller's columns if rows are kept.
    pub(crate) fn take(
        &mut self,
        telemetry: &Telemetry,
        events: &[Entry],
        truth: &Truth,
        columns: Option<Columns>,
    ) {
        let at = self.passed;
        digest(&mut self.digest, telemetry);
        events.iter().for_each(|entry| self.event(at, &entry.event));
        if let Some(controller) = columns {
            self.rows.push(Row { controller, truth: Some(truth.into()) });
        }
        self.close_tick(at, telemetry, (truth.position_mm, truth.preload_n), truth.separation_mm);
    }

    /// Takes an event of the tick of this number.
    pub(super) fn event(&mut self, at: u32, event: &Event) {
        let t_s = f64::from(at) * TICK_S;
        self.log.push(LogLine { t_s, text: text(event) });
        self.summary.take(t_s, event);
        match event {
            Event::Crossing(record) => self.reported.push((t_s, *record)),
            // Under way, it ends the run.
            Event::Restart(restart) if self.commanded.is_some() => {
                self.summary.restart = Some(restart_words(*restart));
            }
            Event::Mode(mode) => {
                // From the accepted command on the duration counts, unless the drive already moved.
                if matches!(mode, Mode::Preload(_)) && self.run_started.is_none() {
                    self.commanded = Some(t_s);
                }
                self.mode = *mode;
            }
            _ => {}
        }
    }

    /// Ends the tick of this number; position and preload, mm and N, are the true ones, or as measured;
    /// `separation_mm` from the wall, 0 where it is unknown.
    pub(super) fn close_tick(
        &mut self,
        at: u32,
        seen: &Telemetry,
        (position_mm, preload_n): (f64, f64),
        separation_mm: f64,
    ) {
        let t_s = f64::from(at) * TICK_S;
        let mode = mode_number(seen.mode);
        self.split.add(t_s, mode, position_mm);
        if MOVES.contains(&mode) {
            self.run_started.get_or_insert(t_s);
            self.run_ended = t_s;
            self.preload_sum += preload_n;
            self.moving += 1;
            self.worst_separation = self.worst_separation.max(separation_mm);
        }
        let sigma = seen.position_sigma;
        self.summary.position_sigma_mm = (sigma < Q16::MAX).then(|| sigma.to_num());
        self.mode = seen.mode;
        self.passed = at + 1;
    }

    /// What ticks and events make of the summary of a run that got there or did not.
    pub(super) fn summary(&mut self, scenario: Option<&Scenario>, arrived: bool) -> Summary {
        let completed = arrived && self.summary.faults.is_empty();
        let commanded_s = self.run_started.and(self.commanded);
        let known = scenario.filter(|_| completed && commanded_s.is_some());
        Summary {
            completed,
            controller: scenario.map_or("unknown", |known| known.run.controller.name()).into(),
            seed: scenario.map_or(0, |scenario| scenario.run.seed),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            overrides: scenario.map(Scenario::overrides).unwrap_or_default(),
            commanded_s,
            duration_s: commanded_s.map(|from| self.run_ended - from),
            moving_s: self.run_started.map_or(0.0, |from| self.run_ended - from),
            lost: known.map(|known| self.split.lost(known.rig.drive.cruise_speed_mm_s)),
            total_s: f64::from(self.passed) * TICK_S,
            mean_preload_n: self.preload_sum / f64::from(self.moving.max(1)),
            ..std::mem::take(&mut self.summary)
        }
    }

    /// The record of a run on `target` that took `wall_s` to compute. `arrived` is the
    /// direction of a completed run, as the controller reports it.
    pub(crate) fn finish(
        mut self,
        target: &'static str,
        scenario: &Scenario,
        plant: &VirtualRig,
        arrived: Option<Direction>,
        wall_s: f64,
    ) -> Recording {
        let truth = plant.truth();
        let steps = plant.parameters().wall.steps().len();
        let there = arrived.is_some_and(|direction| {
            let deploys = direction == Direction::Deploy;
            let end_mm = if deploys { scenario.rig.rig.travel_mm } else { 0.0 };
            (truth.position_mm - end_mm).abs() <= ARRIVED_WITHIN_MM
        });
        let crossings: Vec<CrossingLine> =
            plant.ledger().crossings().iter().map(|c| crossing_line(c, &self.reported)).collect();
        let worst = crossings.iter().map(|c| c.gap_mm).fold(self.worst_separation, f64::max);
        let has_gap = !crossings.is_empty() || worst > 0.0;
        let common = self.summary(Some(scenario), there && crossings.len() == steps);
        let total_s = common.total_s;
        let faults = scenario.run.faults.iter();
        let summary = Summary {
            target: target.into(),
            direction: scenario.run.direction.name().into(),
            rig: scenario.preset.clone(),
            drawn: drawn(plant.parameters(), scenario),
            cut_off_s: Some(longest_s(&scenario.rig)).filter(|longest_s| total_s >= *longest_s),
            travel_mm: (truth.position_mm - self.start_mm).abs(),
            max_gap_mm: if has_gap { worst } else { f64::NAN },
            slip_mm: truth.slip_mm,
            energy_j: truth.work_mj * 1e-3,
            friction_work_j: truth.friction_work_mj * 1e-3,
            injected: faults.map(|fault| fault.words(common.commanded_s)).collect(),
            real_time_factor: total_s / wall_s.max(1e-9),
            trace_digest: self.digest.finalize().iter().map(|b| format!("{b:02x}")).collect(),
            crossings,
            ..common
        };
        let parameters = scenario.to_toml();
        Recording { summary, rows: self.rows, log: self.log, parameters, ..Recording::default() }
    }
}

/// Ledger line: the plant's truth beside what the controller reported of the same step.
fn crossing_line(crossing: &Crossing, reported: &[(f64, CrossingRecord)]) -> CrossingLine {
    // Reported when the crossing is closed: the first of this step after lift-off.
    let same = |(t_s, r): &&(f64, CrossingRecord)| {
        *t_s >= crossing.lift_s
            && (r.direction == Direction::Deploy) == crossing.climbing
            && (r.position.to_num::<f64>() - crossing.step_mm).abs() < SAME_STEP_MM
    };
    let reported = reported.iter().find(same);
    CrossingLine {
        index: crossing.index as u8,
        speed_mm_s: crossing.speed_mm_s,
        preload_n: crossing.preload_n,
        gap_mm: crossing.gap_mm,
        corner_force_n: crossing.corner_n,
        slip_mm: crossing.slip_mm,
        touch_s: crossing.touch_s,
        lift_s: crossing.lift_s,
        step_mm: crossing.step_mm,
        peak_preload_n: crossing.peak_preload_n,
        peak_utilisation: crossing.peak_utilisation,
        ..reported.map_or_else(CrossingLine::default, |(_, record)| record.into())
    }
}

impl From<&CrossingRecord> for CrossingLine {
    /// What the controller reported, without what only a plant or its own rows know.
    fn from(record: &CrossingRecord) -> Self {
        let num = |value: Q16| Some(value.to_num());
        Self {
            gap_predicted_mm: num(record.gap_predicted),
            gap_measured_mm: num(record.gap_measured),
            lead_time_s: num(record.lead_time),
            slip_measured_mm: num(record.slip),
            slip_sigma_mm: num(record.slip_sigma),
            height_measured_mm: num(record.height),
            step_found_mm: num(record.position),
            limited_by: record.limited_by,
            ..Self::default()
        }
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

impl Summary {
    /// Takes the report of a fault or a limit, if the event is one.
    fn take(&mut self, t_s: f64, event: &Event) {
        let (all, code, text) = match event {
            Event::Fault(fault) => (&mut self.faults, fault.code(), fault.sentence()),
            Event::Limit(limit) => (&mut self.limits, limit.code(), limit.sentence()),
            _ => return,
        };
        all.push(Report { t_s, code, text: text.to_owned() });
    }
}

/// An event as one line of text.
pub(crate) fn text(event: &Event) -> String {
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
        Event::Lost(entries) => format!("lost of the log: {}", counted(entries, "event")),
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

/// What restarted the target, and what it did before.
pub(super) fn restart_words(restart: Restart) -> String {
    restart.to_string().replacen("started: ", "", 1)
}

/// The value that the plant has of each key that its seed draws; of `mismatch.*` where that is
/// drawn. Lists are one value a step.
fn drawn(plant: &PlantParameters, scenario: &Scenario) -> Map<String, Value> {
    let share = scenario.rig.plant.top_load_share;
    let steps = plant.wall.steps();
    let positions: Vec<f64> = steps.iter().map(|step| step.position_mm).collect();
    let heights: Vec<f64> = steps.iter().map(|step| step.height_mm).collect();
    let top_load_n = if share > 0.0 { plant.load_n / share } else { 0.0 };
    let drawn = [
        ("tread.k_inf_pa_per_m", json!(1e9 * plant.ring.k_inf)),
        ("tread.stiffening", json!(plant.ring.k_0 / plant.ring.k_inf)),
        ("tread.tau_s", json!(plant.ring.tau_s)),
        ("plant.mu", json!(plant.mu)),
        ("plant.top_load_n", json!(top_load_n)),
        ("rig.wheel_radius_mm", json!(plant.ring.radius_mm)),
        ("rig.step_positions_mm", json!(positions)),
        ("rig.step_height_mm", json!(heights)),
        ("preload.spring_n_per_mm", json!(plant.spring_n_per_mm)),
        ("preload.delay_s", json!(plant.delay_s)),
        ("preload.lag_s", json!(plant.lag_s)),
        ("preload.slew_n_per_s", json!(plant.slew_n_per_s)),
        ("preload sensor gain", json!(plant.sensors.preload_sensor_gain)),
        ("compression sensor gain", json!(plant.sensors.compression_gain)),
        ("arm angle zero, deg", json!(plant.sensors.angle_zero_rad.to_degrees() + 0.0)),
    ];
    let mut all: Map<String, Value> =
        drawn.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    if scenario.run.mismatch != MismatchDraw::Stated && scenario.run.seed > 0 {
        let mismatch = scenario.drawn_mismatch();
        let values = mismatch.values();
        all.extend(values.map(|(field, value)| (format!("mismatch.{}", field.name), json!(value))));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use interstage::supervise::Leg;

    const REST: Mode = Mode::Idle;
    const RUN: Mode = Mode::Run(Direction::Deploy, Leg::Cruise);

    fn at_rest() -> (Scenario, VirtualRig) {
        let scenario = Scenario::default();
        let plant = VirtualRig::new(scenario.plant(), 0.0, 0.0, TICK_S);
        (scenario, plant)
    }

    #[test]
    fn a_step_crossed_again_has_the_figures_of_its_own_report() {
        let report = |gap: f64| CrossingRecord {
            position: Q16::from_num(18.0),
            gap_measured: Q16::from_num(gap),
            ..CrossingRecord::default()
        };
        let reported = [(2.0, report(2.5)), (9.0, report(2.75))];
        for (lift_s, gap) in [(1.9, 2.5), (8.8, 2.75)] {
            let again = Crossing { lift_s, step_mm: 18.0, climbing: true, ..Crossing::default() };
            assert_eq!(crossing_line(&again, &reported).gap_measured_mm, Some(gap));
        }
    }

    #[test]
    fn only_ticks_under_way_count() {
        let mut recorder = RunRecorder::new(2.5, 0.0);
        let (_, plant) = at_rest();
        let ticks = [(REST, 90.0, 9.0), (RUN, 30.0, 0.1), (RUN, 40.0, 0.3), (REST, 90.0, 9.0)];
        for (mode, preload_n, separation_mm) in ticks {
            let truth = Truth { preload_n, separation_mm, ..*plant.truth() };
            recorder.take(&Telemetry { mode, ..Telemetry::default() }, &[], &truth, None);
        }
        assert_eq!((recorder.run_started, recorder.run_ended), (Some(1e-3), 2e-3));
        assert_eq!((recorder.preload_sum, recorder.moving), (70.0, 2));
        assert_eq!((recorder.worst_separation, recorder.passed), (0.3, 4));
    }

    #[test]
    fn the_duration_counts_from_the_last_command_before_the_motion() {
        let durations = |moves: bool, commands: &[u32]| {
            let (scenario, plant) = at_rest();
            let mut recorder = RunRecorder::new(2.5, 0.0);
            for at in 0..10 {
                let event = Event::Mode(Mode::Preload(Direction::Deploy));
                let events = commands.contains(&at).then_some(Entry { at, event });
                let mode = if moves && (5..9).contains(&at) { RUN } else { REST };
                let telemetry = Telemetry { mode, ..Telemetry::default() };
                recorder.take(&telemetry, events.as_slice(), plant.truth(), None);
            }
            let summary = recorder.finish("sil", &scenario, &plant, None, 1.0).summary;
            (summary.duration_s.map(|s| (1e3 * s).round()), (1e3 * summary.moving_s).round())
        };
        assert_eq!(durations(true, &[1, 3, 7]), (Some(5.0), 3.0));
        // Without a command in the log nothing is claimed, nor without motion.
        assert_eq!(durations(true, &[]), (None, 3.0));
        assert_eq!(durations(false, &[1]), (None, 0.0));
    }

    #[test]
    fn arriving_takes_the_place_and_every_step() {
        let scenario = Scenario::default();
        let end = scenario.rig.rig.travel_mm;
        let plant = VirtualRig::new(scenario.plant(), end, 33.3, TICK_S);
        let finish = |arrived| {
            RunRecorder::new(2.5, 0.0).finish("sil", &scenario, &plant, arrived, 1.0).summary
        };
        // It is at the end of travel, but no step has been crossed.
        assert!(!finish(Some(Direction::Deploy)).completed);
        assert_eq!(finish(Some(Direction::Deploy)).travel_mm, end);
        assert!(!finish(None).completed);
    }

    #[test]
    fn a_run_that_is_cut_off_says_so() {
        let (scenario, plant) = at_rest();
        let cut_off = |passed| {
            let recorder = RunRecorder { passed, ..RunRecorder::new(2.5, 0.0) };
            recorder.finish("sil", &scenario, &plant, None, 1.0).summary
        };
        assert_eq!(cut_off(119_999).cut_off_s, None);
        assert_eq!(cut_off(120_000).cut_off_s, Some(120.0));
        let said = crate::report::verdict::headline(&cut_off(120_000));
        assert!(said.starts_with("Did not complete: time-out at 120 s from boot after "), "{said}");
    }

    #[test]
    fn the_nominal_plant_has_the_values_of_its_scenario_and_a_seed_others() {
        let drawn = |set: &str| {
            let scenario = Scenario::resolve(None, None, &[set.to_owned()]).unwrap();
            (super::drawn(&scenario.plant(), &scenario), scenario)
        };
        let (nominal, scenario) = drawn("run.seed=0");
        let value = |key: &str| nominal[key].as_f64().unwrap();
        let rig = &scenario.rig;
        for (key, stated) in [
            ("tread.k_inf_pa_per_m", rig.tread.k_inf_pa_per_m),
            ("tread.stiffening", rig.tread.stiffening),
            ("tread.tau_s", rig.tread.tau_s),
            ("plant.mu", rig.plant.mu),
            ("plant.top_load_n", rig.plant.top_load_n),
            ("rig.wheel_radius_mm", rig.rig.wheel_radius_mm),
            ("preload.delay_s", rig.preload.delay_s),
            ("preload.lag_s", rig.preload.lag_s),
        ] {
            assert!((value(key) / stated - 1.0).abs() < 1e-9, "{key} {} {stated}", value(key));
        }
        let (other, _) = drawn("run.seed=5");
        assert!(other.iter().all(|(key, value)| nominal[key] != *value), "{other:?}");
    }
}
