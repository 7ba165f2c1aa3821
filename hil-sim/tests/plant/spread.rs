//! What a seed draws, against the meaning that the scenario's keys document.

use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::spread::Section;
use hil_sim::plant::spread::Spread;
use hil_sim::scenario::Scenario;

use super::bench::nominal;

const SEEDS: u64 = 2000;

fn drawn(seed: u64) -> PlantParameters {
    let mut scenario = Scenario::default();
    scenario.run.seed = seed;
    scenario.plant()
}

#[test]
fn seed_0_is_the_nominal_rig() {
    // Without spread every seed is that rig.
    let mut narrow = Scenario { spread: Spread::default(), ..Scenario::default() };
    narrow.run.seed = 5;
    assert_eq!(narrow.plant(), nominal("prototype"));
}

#[test]
fn a_seed_is_always_the_same_rig_and_none_is_like_another() {
    for seed in [1, 2, 1 << 40] {
        assert_eq!(drawn(seed), drawn(seed));
        assert_ne!(drawn(seed), drawn(seed + 1));
    }
}

#[test]
fn the_draws_mean_what_the_spread_documents() {
    let spread = Spread::usual();
    let nominal = nominal("prototype");
    let plants: Vec<PlantParameters> = (1..=SEEDS).map(drawn).collect();
    // Keys in `_rel`: relative standard deviation, cut at three of it.
    type Of = fn(&PlantParameters) -> f64;
    let relative: [(&str, f64, Of); 11] = [
        ("k_inf", spread.k_inf_rel, |p| p.ring.k_inf),
        ("stiffening", spread.stiffening_rel, |p| p.ring.k_0 / p.ring.k_inf),
        ("tau", spread.tau_rel, |p| p.ring.tau_s),
        ("mu", spread.mu_rel, |p| p.mu),
        ("top_load", spread.top_load_rel, |p| p.load_n),
        ("spring", spread.spring_rel, |p| p.spring_n_per_mm),
        ("delay", spread.delay_rel, |p| p.delay_s),
        ("lag", spread.lag_rel, |p| p.lag_s),
        ("slew", spread.slew_rel, |p| p.slew_n_per_s),
        ("preload_sensor_gain", spread.preload_sensor_gain_rel, |p| p.sensors.preload_sensor_gain),
        ("compression_gain", spread.compression_sensor_gain_rel, |p| p.sensors.compression_gain),
    ];
    let mut columns = Vec::new();
    for (name, deviation, of) in relative {
        let off: Vec<f64> = plants.iter().map(|plant| of(plant) / of(&nominal) - 1.0).collect();
        let (mean, found) = statistics(&off);
        assert!(mean.abs() < 0.08 * deviation, "{name}: mean {mean}");
        assert!((found / deviation - 1.0).abs() < 0.06, "{name}: {found} for {deviation}");
        assert!(off.iter().all(|x| x.abs() <= 3.0 * deviation + 1e-12), "{name}");
        columns.push((name, off));
    }
    // Keys with a unit: half-widths of an even spread.
    let steps = nominal.wall.steps();
    let even = |name: &'static str, half_width: f64, values: Vec<f64>| {
        let (mean, found) = statistics(&values);
        assert!(mean.abs() < 0.06 * half_width, "{name}: mean {mean}");
        assert!((found * 3f64.sqrt() / half_width - 1.0).abs() < 0.05, "{name}: {found}");
        let most = values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        assert!((0.99..=1.0).contains(&(most / half_width)), "{name}: {most}");
    };
    for (index, step) in steps.iter().enumerate() {
        let of = |f: fn(&hil_sim::plant::wall::Step) -> f64| {
            plants.iter().map(|plant| f(&plant.wall.steps()[index]) - f(step)).collect()
        };
        even("step_position", spread.step_position_mm, of(|step| step.position_mm));
        even("step_height", spread.step_height_mm, of(|step| step.height_mm));
    }
    let zero = plants.iter().map(|plant| plant.sensors.angle_zero_rad.to_degrees());
    even("arm_zero", spread.arm_angle_zero_deg, zero.collect());
    // The radius: as made, within its half-width, less wear from none to all.
    let lost: Vec<f64> =
        plants.iter().map(|plant| nominal.ring.radius_mm - plant.ring.radius_mm).collect();
    let (mean, _) = statistics(&lost);
    assert!((mean / (0.5 * spread.wear_mm) - 1.0).abs() < 0.06, "{mean}");
    let range = -spread.wheel_radius_mm..=spread.wheel_radius_mm + spread.wear_mm;
    assert!(lost.iter().all(|x| range.contains(x)));
    // No two of them hang together.
    for (i, (a, x)) in columns.iter().enumerate() {
        for (b, y) in &columns[..i] {
            let r = correlation(x, y);
            assert!(r.abs() < 0.08, "{a} and {b}: {r}");
        }
    }
}

fn statistics(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, square.sqrt())
}

fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let ((mx, sx), (my, sy)) = (statistics(x), statistics(y));
    let sum: f64 = x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum();
    sum / (x.len() as f64 - 1.0) / (sx * sy)
}
