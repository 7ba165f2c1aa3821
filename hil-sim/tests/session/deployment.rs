//! Complete runs of the shipping controller on the plant: both rigs, both directions, drawn
//! plants. Reported, sensed and true values are compared pairwise.

use std::sync::LazyLock;

use crate::common::{DIRECTIONS, NO_SLIP_MM, RIGS, STEP_CODES, end_mm, scenario};
use hil_sim::record::{Columns, MODE_NAMES, Row, Summary, TrueState};
use hil_sim::scenario::{ControllerKind, Direction, Scenario};
use hil_sim::session::{Options, run};
use hil_sim::testing::long;
use interstage::fault::Limit;
use rayon::prelude::*;

/// The preload is reached within this part of its reference: the controller's tolerance of
/// the measured preload, and three standard deviations of the sensor.
const REACHED_PART: f64 = 0.035;

struct Run {
    name: String,
    scenario: Scenario,
    summary: Summary,
    rows: Vec<Row>,
    nominal: bool,
}

impl Run {
    fn new(rig: &str, direction: Direction, seed: u64) -> Self {
        let scenario = scenario(rig, direction, seed);
        let recording = run(&scenario, Options::ROWS).expect("a run");
        let name = format!("{rig} {} seed {seed}", direction.name());
        let (summary, rows) = (recording.summary, recording.rows);
        Self { name, scenario, summary, rows, nominal: seed == 0 }
    }

    fn deploys(&self) -> bool {
        self.scenario.run.direction == Direction::Deploy
    }
}

/// Seeds 0 to 20, or 4, of both rigs in both directions.
static RUNS: LazyLock<Vec<Run>> = LazyLock::new(|| {
    let last = if long() { 20 } else { 4 };
    let pairs = RIGS.iter().flat_map(|rig| DIRECTIONS.map(|direction| (*rig, direction)));
    let all: Vec<_> =
        pairs.flat_map(|(rig, direction)| (0..=last).map(move |s| (rig, direction, s))).collect();
    all.into_par_iter().map(|(rig, direction, seed)| Run::new(rig, direction, seed)).collect()
});

fn mode(name: &str) -> u8 {
    MODE_NAMES.iter().position(|known| *known == name).expect("a mode") as u8
}

/// A list without the repetitions of neighbours.
fn changes(values: impl Iterator<Item = u8>) -> Vec<u8> {
    let mut all: Vec<u8> = values.collect();
    all.dedup();
    all
}

#[test]
fn every_drawn_rig_completes_without_fault_or_slip() {
    for Run { name, scenario, summary, rows, .. } in RUNS.iter() {
        assert!(summary.completed, "{name}");
        assert!(summary.faults.is_empty(), "{name}: {:?}", summary.faults);
        assert!(summary.slip_mm < NO_SLIP_MM, "{name}: {}", summary.slip_mm);
        let odd = summary.limits.iter().find(|limit| STEP_CODES.contains(&limit.code));
        assert_eq!(odd, None, "{name}");
        let off =
            rows.last().expect("rows").position_mm() - end_mm(scenario, scenario.run.direction);
        let within = if summary.rig == "fe" { 0.7 } else { 0.6 };
        assert!(off.abs() < within, "{name}: {off} mm from the end");
        // Between cruise speed throughout and 17 mm/s on average.
        assert!((2.9..6.6).contains(&summary.moving_s), "{name}: {}", summary.moving_s);
        // The command comes before the preload is built; that takes two seconds at most.
        let before = summary.duration_s.expect("commanded") - summary.moving_s;
        assert!((0.055..2.0).contains(&before), "{name}: {before}");
    }
}

#[test]
fn a_rig_at_its_bounds_is_crossed_without_slip_both_ways() {
    // The whole load or none; little friction, and the first step while the preload still rises.
    let little =
        ["16", "19", "20", "24"].map(|at| format!("mu=0.8 rig.step_positions_mm=[{at},44,66]"));
    let rigs =
        ["top_load_share=0", "top_load_share=1"].map(str::to_owned).into_iter().chain(little);
    for (rig, direction) in rigs.flat_map(|rig| DIRECTIONS.map(|to| (rig.clone(), to.name()))) {
        let sets = format!("plant.{rig} run.direction={direction}");
        let sets: Vec<String> = sets.split(' ').map(str::to_owned).collect();
        let scenario = Scenario::resolve(Some("prototype"), None, &sets).expect("a scenario");
        let summary = run(&scenario, Options::default()).expect("a run").summary;
        // Where 210 says that the margin is not to be had it may slip by a tenth.
        let short = summary.limits.iter().any(|l| l.code == Limit::SlipMarginLow.code());
        let most = if short { 0.15 } else { NO_SLIP_MM };
        assert!(summary.completed && summary.slip_mm < most, "{sets:?}: {summary:?}");
    }
}

#[test]
fn each_step_is_crossed_once_and_in_its_order() {
    for run in RUNS.iter() {
        let Run { name, summary, rows, .. } = run;
        let order: Vec<u8> = summary.crossings.iter().map(|line| line.index).collect();
        let (expected, level) = if run.deploys() { ([1, 2, 3], 3) } else { ([3, 2, 1], 0) };
        assert_eq!(order, expected, "{name}");
        assert_eq!(rows.last().map(|row| row.controller.level), Some(level), "{name}");
        for line in &summary.crossings {
            let found = line.step_found_mm.expect("reported") - line.step_mm;
            assert!(found.abs() < 0.5, "{name} step {}: {found}", line.index);
        }
    }
}

#[test]
fn steps_of_any_height_and_place_are_found_where_they_are() {
    // A wheel of the radius that the table has, so that nothing grows with the distance.
    let seeds = if long() { 1..301 } else { 1..41 };
    let errors: Vec<[f64; 3]> = seeds
        .into_par_iter()
        .map(|seed| {
            let sets = [
                "spread.wheel_radius_mm=0".to_owned(),
                "spread.wear_mm=0".to_owned(),
                "rig.wheel_wear_mm=0".to_owned(),
                format!("run.seed={seed}"),
            ];
            let scenario = Scenario::resolve(Some("prototype"), None, &sets).expect("a scenario");
            let summary = run(&scenario, Options::default()).expect("a run").summary;
            let off = summary.crossings.iter().map(|c| c.step_found_mm.expect("found") - c.step_mm);
            off.collect::<Vec<_>>().try_into().expect("three steps")
        })
        .collect();
    for step in 0..3 {
        let mut off: Vec<f64> = errors.iter().map(|run| run[step]).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        off.iter_mut().for_each(|off| *off = off.abs());
        off.sort_by(f64::total_cmp);
        let most = off[(off.len() * 95).div_ceil(100) - 1];
        println!("step {}: mean {mean:.3} mm, 95 % within {most:.3} mm", step + 1);
        // A lift-off shows its face within 0.055 mm, one sigma; how far the tread gave way before it is
        // known within a third at the first step, and better from then on.
        assert!(most < [0.16, 0.27, 0.34][step], "step {}: {most} mm", step + 1);
        assert!(mean.abs() < 0.04, "step {}: {mean} mm on average", step + 1);
    }
}

#[test]
fn gaps_stay_near_the_reference_with_the_preload_reached_before_every_corner() {
    for Run { name, scenario, summary, rows, nominal } in RUNS.iter() {
        // At the study's loads the gap is two thirds as large, and the same tolerances of
        // sleeve and tread weigh more: of a thousand drawn rigs the worst is 7 % above.
        // There the measured gap is up to 5 % high, and the schedule keeps as much more below.
        let range = match (summary.rig.as_str(), nominal) {
            ("fe", _) => 0.84..1.08,
            (_, true) => 0.95..1.02,
            _ => 0.88..1.05,
        };
        for line in &summary.crossings {
            let part = line.gap_mm / summary.gap_ref_mm;
            // The wheel rolls to the first step while the preload builds: slow, less opens.
            let first = line.index == 1 && name.contains("deploy");
            let enough = part > 0.75 && part < range.end;
            assert!(range.contains(&part) || first && enough, "{name}, {}: {part}", line.index);
            assert!(line.lead_time_s.is_some(), "{name}: the controller reports it");
            let touch = (1e3 * line.touch_s) as usize;
            let reached = |row: &Row| {
                let wanted = row.controller.preload_ref_n;
                row.truth.expect("truth").preload_true_n >= wanted * (1.0 - REACHED_PART)
            };
            // It lifts off once it has about that with which the plan builds up, 0.88 of cruise.
            let enough = line.preload_n > 0.85 * scenario.rig.preload.cruise_n;
            let has_lead = rows[touch - 1..=touch].iter().all(reached);
            assert!(if first { enough } else { has_lead }, "{name}: {line:?}");
        }
        if *nominal && summary.rig == "prototype" {
            let worst = summary.crossings.iter().map(|line| line.gap_mm).fold(0.0, f64::max);
            assert_eq!(summary.max_gap_mm, worst, "{name}: separated away from a step");
        }
    }
}

#[test]
fn the_duration_is_the_travel_at_cruise_speed_and_what_each_part_loses() {
    for Run { name, scenario, summary, .. } in RUNS.iter() {
        let lost = summary.lost.expect("it arrived");
        let parts = [lost.preload_s, lost.approach_s, lost.crossing_s, lost.end_s];
        assert!(parts.iter().all(|part| *part > 0.0), "{name}: {lost:?}");
        let at_cruise = summary.travel_mm / scenario.rig.drive.cruise_speed_mm_s;
        let sum = at_cruise + parts.iter().sum::<f64>();
        let off = sum - summary.duration_s.expect("commanded");
        assert!(off.abs() < 0.01, "{name}: {sum} s, off by {off}");
        // What limits a crossing is known of each.
        assert!(summary.crossings.iter().all(|line| line.limited_by.is_some()), "{name}");
    }
}

#[test]
fn the_gap_is_measured_and_predicted() {
    for Run { name, summary, nominal, .. } in RUNS.iter() {
        // A drawn plant has gains and heights off that no sensor of the rig can show; at the
        // study's loads the gap is smaller and the same errors weigh more, and a wheel that
        // skims the lower wall while it brakes leaves it early or late: one of thirty by over 9 %.
        let (measured, predicted) = match (summary.rig.as_str(), nominal) {
            ("prototype", true) => (0.02, 0.05),
            ("fe", true) => (0.03, 0.06),
            ("prototype", false) => (0.03, 0.07),
            _ => (0.07, 0.14),
        };
        for line in &summary.crossings {
            for (gap, bound) in
                [(line.gap_measured_mm, measured), (line.gap_predicted_mm, predicted)]
            {
                let off = gap.expect("reported") / line.gap_mm - 1.0;
                assert!(off.abs() < bound, "{name} step {}: {off}", line.index);
            }
        }
    }
}

#[test]
fn the_preload_uses_its_limit_and_never_exceeds_it() {
    for Run { name, scenario, rows, .. } in RUNS.iter() {
        let limit = scenario.rig.preload.limit_n;
        let preloads = rows.iter().map(|row| row.of_truth(|t| t.preload_true_n));
        let peak = preloads.fold(0.0, f64::max);
        // Back, less preload is over the step sooner.
        let least = if name.contains("deploy") { 0.94 } else { 0.8 };
        assert!(peak <= limit && peak > least * limit, "{name}: {peak} N");
    }
}

#[test]
fn the_pretightener_does_not_start_or_lift_off_with_a_tick_of_the_wrong_sign() {
    let sliding = 4;
    for Run { name, rows, .. } in RUNS.iter().filter(|run| run.deploys()) {
        let (mut starts, mut lifts) = (0, 0);
        for pair in rows.windows(2) {
            let [before, now] = [&pair[0].controller, &pair[1].controller];
            if now.mode == mode("preload") && before.mode != now.mode {
                starts += 1;
                assert!(now.pretightener_duty > -0.1, "{name}: {}", now.pretightener_duty);
            }
            if now.stage == sliding && before.stage != now.stage {
                lifts += 1;
                let change = now.preload_ref_n - before.preload_ref_n;
                assert!(change > -0.01, "{name} at {} s: {change} N", now.t_s);
            }
        }
        assert!(starts == 1 && lifts > 2, "{name}: {starts} starts, {lifts} crossings");
    }
}

#[test]
fn a_crossing_is_never_slower_than_the_least_speed() {
    for Run { name, scenario, summary, rows, .. } in RUNS.iter() {
        let least = scenario.rig.drive.min_crossing_speed_mm_s;
        for line in &summary.crossings {
            let on_corner = |row: &&Row| (line.touch_s..=line.lift_s).contains(&row.controller.t_s);
            let speed = |row: &Row| row.of_truth(|t| t.speed_true_mm_s).abs();
            let speeds: Vec<f64> = rows.iter().filter(on_corner).map(speed).collect();
            assert!(speeds.len() > 100, "{name} step {}: {} rows", line.index, speeds.len());
            // A wheel that brakes lags behind its profile: the mean of a tenth of a second counts.
            let means = speeds.windows(100).map(|span| span.iter().sum::<f64>() / 100.0);
            let slowest = means.fold(f64::MAX, f64::min);
            // A wheel that waits for its preload is up to 1 % slower.
            assert!(slowest >= 0.99 * least, "{name} step {}: {slowest}", line.index);
        }
    }
}

#[test]
fn the_preload_returns_to_cruise_after_the_last_step() {
    for run in RUNS.iter() {
        let cruise = run.scenario.rig.preload.cruise_n;
        let last = run.rows.iter().rfind(|row| row.controller.mode == mode("cruise"));
        let last = last.expect("the wall behind the last step");
        assert!((last.controller.preload_ref_n - cruise).abs() < 0.01, "{}", run.name);
        let preload = |row: &Row| row.of_truth(|t| t.preload_true_n);
        // A retraction ends 4 mm behind the last step, before the screw has arrived: since it was
        // released it has run at its slew, behind dead time and lags.
        let lift_s = run.summary.crossings.last().expect("crossings").lift_s;
        let is_released = |row: &&Row| {
            row.controller.t_s > lift_s && (row.controller.preload_ref_n - cruise).abs() < 0.01
        };
        let released = run.rows.iter().find(is_released).expect("released");
        let plant = run.scenario.plant();
        let since_s = last.controller.t_s - released.controller.t_s;
        let ran_s = (since_s - plant.delay_s - 2.0 * plant.lag_s).max(0.0);
        let left = preload(released) - 0.9 * plant.slew_n_per_s * ran_s;
        // It is held by the sensor, whose gain is drawn.
        let held = cruise / plant.sensors.preload_sensor_gain;
        let most = left.max(1.02 * held) + 0.01 * run.scenario.rig.preload.limit_n;
        let now = preload(last);
        assert!((0.97 * cruise..most).contains(&now), "{}: {now} N, at most {most}", run.name);
        assert!(!run.deploys() || left < 1.02 * held, "{}: no time to return", run.name);
    }
}

#[test]
fn contact_stages_and_legs_follow_one_another() {
    let [cruise, approach, crossing, settle] =
        ["cruise", "approach", "crossing", "settle"].map(mode);
    for run in RUNS.iter() {
        let name = &run.name;
        // On retraction the edge carries alone first, then the lower wall as well.
        let per_step = if run.deploys() { [3, 4, 5, 6] } else { [4, 3, 5, 6] };
        let stages = changes(run.rows.iter().map(|row| row.controller.stage));
        assert_eq!(stages, [&[1, 2, 6][..], &per_step.repeat(3)].concat(), "{name}");
        let modes = run.rows.iter().map(|row| row.controller.mode);
        let legs = changes(modes.filter(|mode| (cruise..=settle).contains(mode)));
        assert_eq!(legs.last(), Some(&cruise), "{name}");
        // Cruise between two steps needs enough distance.
        let busy: Vec<u8> = legs.into_iter().filter(|leg| *leg != cruise).collect();
        assert_eq!(busy, [approach, crossing, settle].repeat(3), "{name}");
    }
}

#[test]
fn the_same_seed_gives_the_same_run_to_the_bit_and_another_seed_another() {
    for direction in DIRECTIONS {
        for seed in [0, 7] {
            let [first, second] = [(); 2].map(|()| {
                let scenario = scenario("prototype", direction, seed);
                let mut recording = run(&scenario, Options::default()).expect("a run");
                // The one figure that depends on the host.
                recording.summary.real_time_factor = 0.0;
                (recording.summary, recording.log)
            });
            assert_eq!(first, second);
        }
    }
    let mut digests: Vec<&str> = RUNS.iter().map(|run| run.summary.trace_digest.as_str()).collect();
    assert!(digests.iter().all(|digest| digest.len() == 64));
    digests.sort_unstable();
    digests.dedup();
    assert_eq!(digests.len(), RUNS.len());
}

#[test]
fn reported_values_follow_the_true_ones() {
    type Pair = fn(&Columns, &TrueState) -> (f64, f64);
    let pairs: [(&str, Pair); 4] = [
        ("position", |seen, t| (seen.position_mm, t.position_true_mm)),
        ("preload", |seen, t| (seen.preload_n, t.preload_true_n)),
        ("radius", |seen, t| (seen.radius_mm, t.radius_true_mm)),
        ("compression", |seen, t| (seen.compression_mm, t.compression_true_mm)),
    ];
    for Run { name, scenario, rows, nominal, summary, .. } in RUNS.iter() {
        let preload = &scenario.rig.preload;
        // The position by what the tread gives way by on a corner, more under three times the load.
        // The sensor shows the wheel's speed, the plant the axle's, which lunges at lift-off.
        let (gives, lunge) = if summary.rig == "fe" { (1.3, 3.2) } else { (0.7, 2.5) };
        let bounds = if *nominal {
            // A known tread gives way as modelled; six deviations of the noise and a millisecond of
            // the screw; a code of the angle and 5 ms of lag.
            [0.45 * gives, 0.3 + 1e-3 * preload.slew_n_per_s, 0.2, 0.08]
        } else {
            [gives, 0.3 + 0.015 * preload.limit_n, 0.35, 0.13]
        };
        let (mut bias, mut squares, mut moving, mut ticks) = (0.0, 0.0, 0, 0);
        for row in rows.iter().filter(|row| row.controller.mode >= mode("idle")) {
            let (seen, truth) = (&row.controller, row.truth.as_ref().expect("the plant's truth"));
            for ((what, pair), bound) in pairs.iter().zip(bounds) {
                let (got, exact) = pair(seen, truth);
                let off = got - exact;
                assert!(off.abs() <= bound, "{name} at {} s: {what} off by {off}", seen.t_s);
            }
            bias += seen.preload_n - truth.preload_true_n;
            ticks += 1;
            if (mode("cruise")..=mode("settle")).contains(&seen.mode) {
                squares += (seen.wheel_speed_mm_s - truth.speed_true_mm_s).powi(2);
                moving += 1;
            }
        }
        bias /= f64::from(ticks);
        assert!(!nominal || bias.abs() < 0.02, "{name}: preload bias {bias}");
        let speed = (squares / f64::from(moving)).sqrt();
        assert!(speed < lunge, "{name}: speed off by {speed} mm/s, rms");
    }
}

#[test]
fn the_true_compression_is_the_one_that_its_sensor_looks_at() {
    let sets = ["mismatch.compression_compliance_mm_per_n=0.01".to_owned()];
    let scenario = Scenario::resolve(None, None, &sets).expect("a scenario");
    let rows = run(&scenario, Options::ROWS).expect("a run").rows;
    for row in rows.iter().filter(|row| row.controller.mode >= mode("cruise")) {
        let off = row.controller.compression_mm - row.of_truth(|t| t.compression_true_mm);
        assert!(off.abs() < 0.13, "off by {off} at {} s", row.controller.t_s);
    }
}

/// The summary of the nominal prototype with this strategy and prescribed speed.
fn strategy(kind: ControllerKind, direction: Direction, speed: Option<(f64, bool)>) -> Summary {
    let mut scenario = scenario("prototype", direction, 0);
    scenario.run.controller = kind;
    run(&scenario, Options { rows: false, speed }).expect("a run").summary
}

#[test]
fn every_strategy_runs_to_the_end() {
    for kind in [ControllerKind::Constant, ControllerKind::Limit, ControllerKind::Reactive] {
        for direction in DIRECTIONS {
            let summary = strategy(kind, direction, None);
            let name = format!("{} {}", kind.name(), direction.name());
            assert!(summary.completed, "{name}");
            assert_eq!(summary.controller, kind.name());
            assert!(summary.slip_mm < NO_SLIP_MM, "{name}");
            // The highest preload from the start on costs no time: nothing waits for it.
            let own_s = strategy(ControllerKind::Scheduled, direction, None).moving_s;
            let most = if kind == ControllerKind::Limit { 1.01 * own_s } else { f64::MAX };
            assert!(summary.moving_s < most, "{name}: {} s, scheduled {own_s}", summary.moving_s);
            for line in &summary.crossings {
                let part = line.gap_mm / summary.gap_ref_mm;
                assert!((0.9..1.05).contains(&part), "{name}: {part}");
            }
        }
    }
}

#[test]
fn at_one_crossing_speed_the_scheduled_preload_leaves_the_smaller_gap() {
    for direction in DIRECTIONS {
        let crossings = |kind| strategy(kind, direction, Some((8.0, false))).crossings;
        let scheduled = crossings(ControllerKind::Scheduled);
        let constant = crossings(ControllerKind::Constant);
        assert_eq!((scheduled.len(), constant.len()), (3, 3));
        for (ours, theirs) in scheduled.iter().zip(&constant) {
            assert_eq!(ours.index, theirs.index);
            assert!((ours.speed_mm_s - theirs.speed_mm_s).abs() < 1.0, "{ours:?} {theirs:?}");
            let part = ours.gap_mm / theirs.gap_mm;
            let name = direction.name();
            // The first step outwards is crossed while the preload rises.
            let most = if (direction, ours.index) == (Direction::Deploy, 1) { 1.0 } else { 0.99 };
            assert!((0.91..most).contains(&part), "{name} step {}: {part}", ours.index);
        }
    }
}
