//! The plant of a seed by the keys of its scenario.

use serde_json::{Map, Value, json};

use crate::plant::draw::PlantParameters;
use crate::plant::section::Section;
use crate::scenario::{MismatchDraw, Scenario};

/// The value that the plant has of each key that its seed draws; of `mismatch.*` where that is
/// drawn. Lists are one value a step.
pub(super) fn of(plant: &PlantParameters, scenario: &Scenario) -> Map<String, Value> {
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
        ("compression sensor gain", json!(plant.sensors.tread_gain)),
        ("arm angle zero, deg", json!(plant.sensors.angle_zero_rad.to_degrees())),
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

    #[test]
    fn the_nominal_plant_has_the_values_of_its_scenario_and_a_seed_others() {
        let drawn = |set: &str| {
            let scenario = Scenario::resolve(None, None, &[set.to_owned()]).unwrap();
            (of(&scenario.plant(), &scenario), scenario)
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
