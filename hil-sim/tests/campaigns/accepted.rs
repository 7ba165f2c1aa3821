//! Parameters that the checks accept: the rig runs out and back without a fault, and keeps its
//! preload limit. Others are refused in one line that names the key, the value and what is expected.

use hil_sim::scenario::{Direction, Scenario, ScenarioError};
use hil_sim::session::{Options, run};
use hil_sim::testing::long;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{at_end, number};
use crate::common::DIRECTIONS;

/// Keys of sensors, pre-tightener and drive. Load, friction and tread may ask for more than the rig
/// can give, which it says.
const KEYS: [&str; 20] = [
    "rig.step_tolerance_mm",
    "preload.cruise_n",
    "preload.limit_n",
    "preload.spring_n_per_mm",
    "preload.slew_n_per_s",
    "preload.delay_s",
    "preload.lag_s",
    "drive.no_load_speed_mm_s",
    "drive.stall_force_n",
    "drive.force_limit_n",
    "drive.reflected_mass_kg",
    "drive.cruise_speed_mm_s",
    "drive.min_crossing_speed_mm_s",
    "drive.acceleration_mm_s2",
    "drive.jerk_mm_s3",
    "sense.encoder_counts",
    "sense.preload_full_scale_n",
    "sense.preload_error",
    "sense.tread_full_scale_mm",
    "control.adaptation_range",
];

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
    let cases: Vec<_> = presets.iter().flat_map(|preset| KEYS.map(|key| (*preset, key))).collect();
    let fails = |(preset, key): (&str, &str)| {
        let base = Scenario::named(preset).expect("a preset");
        let (_, least, most) = number(&base, key);
        [least, most].map(|end| {
            let (nearest, refusal) = at_end(&base, key, end);
            let ill = refusal.and_then(|refusal| well_refused(&refusal, key));
            ill.or_else(|| fails(&nearest, 0))
        })
    };
    let wrong: Vec<String> = cases.into_par_iter().flat_map_iter(fails).flatten().collect();
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
                    let key = KEYS[random.random_range(0..KEYS.len())];
                    let (value, least, most) = number(&base, key);
                    // Evenly in the logarithm from half to twice.
                    let factor = f64::exp2(2.0 * random.random::<f64>() - 1.0);
                    format!("{key}={}", (value * factor).clamp(least, most))
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
