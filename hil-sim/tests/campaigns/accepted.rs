//! Parameters that the checks accept: the rig runs out and back without a fault, and keeps its
//! preload limit. Others are refused in one line that names the key, the value and what is expected.

use hil_sim::scenario::{Direction, Scenario, ScenarioError};
use hil_sim::session::{Options, run};
use hil_sim::testing::long;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::common::DIRECTIONS;

/// Keys of sensors, pre-tightener and drive with their least and largest value. Load, friction and
/// tread may ask for more than the rig can give, which it says.
const ENDS: [(&str, f64, f64); 20] = [
    ("rig.step_tolerance_mm", 0.1, 5.0),
    ("preload.cruise_n", 5.0, 180.0),
    ("preload.limit_n", 5.0, 180.0),
    ("preload.spring_n_per_mm", 0.1, 20.0),
    ("preload.slew_n_per_s", 1.0, 500.0),
    ("preload.delay_s", 0.0, 0.25),
    ("preload.lag_s", 0.005, 1.0),
    ("drive.no_load_speed_mm_s", 5.0, 300.0),
    ("drive.stall_force_n", 5.0, 5000.0),
    ("drive.force_limit_n", 5.0, 1000.0),
    ("drive.reflected_mass_kg", 0.1, 1000.0),
    ("drive.cruise_speed_mm_s", 3.0, 100.0),
    ("drive.min_crossing_speed_mm_s", 0.5, 20.0),
    ("drive.acceleration_mm_s2", 5.0, 2000.0),
    ("drive.jerk_mm_s3", 50.0, 30_000.0),
    ("sense.encoder_counts", 1024.0, 65_536.0),
    ("sense.preload_full_scale_n", 20.0, 2000.0),
    ("sense.preload_error", 0.0, 0.3),
    ("sense.tread_full_scale_mm", 0.5, 50.0),
    ("control.adaptation_range", 0.0, 0.9),
];

fn set(base: &Scenario, key: &str, value: f64) -> Result<Scenario, ScenarioError> {
    base.clone().with(&[format!("{key}={value}")])
}

fn value(base: &Scenario, key: &str) -> f64 {
    let info = base.keys().into_iter().find(|info| info.key == key).expect("a key");
    info.value.to_string().parse().expect("a number")
}

/// What is wrong with an accepted rig, if something is.
fn fails(case: &Scenario, seed: u64) -> Option<String> {
    DIRECTIONS.into_iter().find_map(|direction: Direction| {
        let mut case = case.clone();
        (case.run.direction, case.run.seed) = (direction, seed);
        let recording = run(&case, Options::default()).expect("runs");
        let summary = &recording.summary;
        (!summary.completed || !summary.faults.is_empty()).then(|| {
            format!("{:?}, {direction:?}, seed {seed}: {:?}", case.overrides(), summary.faults)
        })
    })
}

/// Refused in one line, with the key and what is expected.
fn well_refused(error: &ScenarioError, key: &str) -> Option<String> {
    let text = error.to_string();
    let well = text.contains(key) && text.contains("expect") && !text.contains('\n');
    (!well).then_some(text)
}

#[test]
fn a_rig_at_the_bound_of_any_key_runs() {
    let presets: &[&str] = if long() { &["prototype", "fe"] } else { &["prototype"] };
    let cases = presets.iter().flat_map(|preset| ENDS.map(|ends| (*preset, ends)));
    let cases: Vec<_> = cases.collect();
    let wrong: Vec<String> = cases
        .into_par_iter()
        .flat_map_iter(|(preset, (key, least, most))| [least, most].map(|end| (preset, key, end)))
        .filter_map(|(preset, key, end)| {
            let base = Scenario::named(preset).expect("a preset");
            let (mut good, mut bad) = (value(&base, key), end);
            match set(&base, key, end) {
                Ok(_) => good = end,
                Err(error) => {
                    if let Some(text) = well_refused(&error, key) {
                        return Some(text);
                    }
                    for _ in 0..10 {
                        let middle = 0.5 * (good + bad);
                        let kept = set(&base, key, middle).is_ok();
                        *(if kept { &mut good } else { &mut bad }) = middle;
                    }
                }
            }
            fails(&set(&base, key, good).expect("accepted"), 0)
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_rig_around_a_preset_runs_or_is_refused() {
    let rigs = if long() { 400 } else { 24 };
    let outcomes: Vec<_> = (1..=rigs)
        .into_par_iter()
        .map(|seed: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let preset = if random.random() { "prototype" } else { "fe" };
            let base = Scenario::named(preset).expect("a preset");
            let sets: Vec<String> = (0..random.random_range(1..=4))
                .map(|_| {
                    let (key, least, most) = ENDS[random.random_range(0..ENDS.len())];
                    // Evenly in the logarithm from half to twice.
                    let factor = f64::exp2(2.0 * random.random::<f64>() - 1.0);
                    format!("{key}={}", (value(&base, key) * factor).clamp(least, most))
                })
                .collect();
            let keys = sets.iter().filter_map(|set| set.split('=').next());
            match base.clone().with(&sets) {
                Ok(case) => (true, fails(&case, seed)),
                Err(error) => {
                    let named = keys.clone().any(|key| well_refused(&error, key).is_none());
                    (false, (!named).then(|| error.to_string()))
                }
            }
        })
        .collect();
    let wrong: Vec<_> = outcomes.iter().filter_map(|(_, wrong)| wrong.as_ref()).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    let accepted = outcomes.iter().filter(|(accepted, _)| *accepted).count();
    assert!(2 * accepted > outcomes.len(), "{accepted} of {}", outcomes.len());
}

#[test]
fn a_first_step_at_its_least_place_is_crossed_like_another() {
    for first in [15.2, 16.0] {
        let sets = [format!("rig.step_positions_mm=[{first}, 40, 62]")];
        let case = Scenario::default().with(&sets).expect("accepted");
        let summary = run(&case, Options::default()).expect("runs").summary;
        assert!(summary.completed && summary.limits.is_empty(), "{first}: {:?}", summary.limits);
    }
}

#[test]
fn with_a_sensor_within_its_error_the_true_preload_keeps_its_limit() {
    // Gains up to 10 % off.
    let sets = ["sense.preload_error=0.1", "spread.preload_sensor_gain_rel=0.0333"];
    for seed in 1..=8 {
        let mut case = Scenario::default().with(&sets.map(str::to_owned)).expect("accepted");
        case.run.seed = seed;
        let recording = run(&case, Options::default()).expect("runs");
        let most = recording
            .rows
            .iter()
            .filter_map(|row| Some(row.truth?.preload_true_n))
            .fold(0.0, f64::max);
        assert!(recording.summary.completed && most <= case.rig.preload.limit_n, "{seed}: {most}");
    }
}
