//! Rigs whose parameters are hidden from identification, and how well it finds them.
//!
//! A rig is drawn far beyond its tolerances where the parameter is to be found, within
//! them where only a tolerance is known. The shipping controller, which takes it for the
//! nominal rig, makes three deployments; their sensor readings alone are handed on.

use hil_sim::identify::record::{Reader, Record};
use hil_sim::identify::result::identify;
use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::rig::VirtualRig;
use hil_sim::plant::sensors::Sensors;
use hil_sim::scenario::TICK_S;
use hil_sim::scenario::{ControllerKind, Scenario};
use hil_sim::session::{Options, RunningRig, Session, drives, is_over, once};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Longest log, ticks.
const LONGEST: usize = 20_000;
/// Half-widths of the zeros of preload and compression sensor, N and mm.
const ZEROS: (f64, f64) = (0.3, 0.02);
/// The deployments that together excite every parameter: as scheduled, at a constant
/// preload below cruise (slow, near the limit of friction), and at one above it.
const EXPERIMENTS: [(&str, ControllerKind, f64); 3] = [
    ("scheduled", ControllerKind::Scheduled, 1.0),
    ("light", ControllerKind::Constant, 0.75),
    ("heavy", ControllerKind::Constant, 1.25),
];

/// One parameter over all rigs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Line {
    /// Rigs whose logs determine it.
    pub(crate) identified: usize,
    /// Seeds of those whose interval does not hold the hidden value.
    pub(crate) outside: Vec<u64>,
    /// Largest error over the hidden value.
    pub(crate) worst_rel: f64,
    pub(crate) half_widths: Vec<f64>,
}

/// Books what is found of a parameter on the rig of a seed; nothing on a rig whose preload
/// does not come in time (fault 121), so that the wheel never moves.
pub(crate) fn found(seed: u64, mut book: impl FnMut(&str, &dyn Fn(&mut Line))) {
    let scenario = widened(seed);
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x1de7_71f1);
    let mut about = |half_width: f64| half_width * (2.0 * random.random::<f64>() - 1.0);
    let zeros = (about(ZEROS.0), about(ZEROS.1));
    let records: Vec<Record> =
        (0..EXPERIMENTS.len()).map(|index| log(index, &scenario, zeros)).collect();
    let known = &records[0].scenario;
    let found = match identify(&records, known) {
        Err(error) if error.to_string().ends_with("the drive was never on") => return,
        // Logs of one rig taken for those of two: missed in every parameter.
        Err(error) if error.to_string().contains("not of the rig of the other logs") => {
            let names = hidden(&scenario.plant(), known, zeros).into_iter();
            return names.for_each(|(name, _)| book(&name, &|line| line.outside.push(seed)));
        }
        found => found.unwrap_or_else(|error| panic!("seed {seed}: {error}")),
    };
    for (name, truth) in hidden(&scenario.plant(), known, zeros) {
        let parameter = found.parameter(&name).unwrap_or_else(|| panic!("{name} is missing"));
        let (Some(low), Some(high)) = (parameter.low, parameter.high) else { continue };
        if parameter.identified {
            book(&name, &|line| {
                line.identified += 1;
                line.outside.extend((!(low..=high).contains(&truth)).then_some(seed));
                line.worst_rel = line.worst_rel.max((parameter.value / truth - 1.0).abs());
                line.half_widths.push(0.5 * (high - low));
            });
        }
    }
}

/// How widely the hidden parameters of a seed are drawn about the nominal rig.
fn widened(seed: u64) -> Scenario {
    let wide = include_str!("hidden.toml");
    let part = ChaCha8Rng::seed_from_u64(seed ^ 0x5ea2).random::<f64>();
    let compliance = format!("mismatch.wind_up_compliance={}", 0.7 * 2f64.powf(part));
    let sets = [format!("run.seed={seed}"), compliance];
    Scenario::parse("hidden.toml", wide, &sets).expect("a scenario")
}

/// The hidden values by the names under which three deployments identify them.
fn hidden(p: &PlantParameters, known: &Scenario, zeros: (f64, f64)) -> Vec<(String, f64)> {
    let zero_code =
        p.sensors.angle_zero_code + 16_384.0 * p.sensors.angle_zero_rad / std::f64::consts::TAU;
    let mut list: Vec<(String, f64)> = [
        ("tread.k_inf_pa_per_m", 1e9 * p.ring.k_inf),
        ("tread.stiffening", p.ring.k_0 / p.ring.k_inf),
        ("tread.tau_s", p.ring.tau_s),
        ("plant.mu", p.mu),
        ("compliance along the wall over nominal", p.wind_up),
        ("plant.top_load_n", p.load_n / known.rig.plant.top_load_share),
        ("drive.no_load_speed_mm_s", p.drive.no_load_mm_s),
        ("sense.angle_zero_code", zero_code),
        ("preload.delay_s", p.delay_s),
        ("preload.lag_s", p.lag_s),
        ("preload.slew_n_per_s", p.slew_n_per_s),
        ("preload.spring_n_per_mm", p.spring_n_per_mm),
        ("preload sensor zero", zeros.0),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .into();
    for (index, step) in p.wall.steps().iter().enumerate() {
        list.push((format!("rig.step_positions_mm[{}]", index + 1), step.position_mm));
        list.push((format!("rig.step_height_mm[{}]", index + 1), step.height_mm));
    }
    list
}

/// A deployment of a hidden rig by a controller that believes in the nominal one.
fn log(index: usize, wide: &Scenario, zeros: (f64, f64)) -> Record {
    let (name, controller, part) = EXPERIMENTS[index];
    let mut scenario = wide.clone();
    scenario.run.controller = controller;
    scenario.rig.preload.cruise_n *= part;
    // The log names the nominal rig; the draw is hidden.
    let plant = scenario.plant();
    scenario.run.seed = 0;
    // Sensors of their own, or every log of a rig would have the same noise.
    let noise = wide.run.seed.wrapping_mul(31) + 1 + index as u64;
    let sensors = Sensors::new(plant.sensors.clone(), noise);
    let rig = VirtualRig::new(plant, 0.0, 0.0, TICK_S);
    let session = Session::new(&scenario, Options::default()).expect("a sound scenario");
    let mut session = session.with_plant(|plant, own| (*plant, *own) = (rig, sensors));
    let (mut reader, mut samples) = (Reader::new(&scenario), Vec::new());
    let mut operator = once(scenario.run.direction);
    while samples.len() < LONGEST && !is_over(session.mode()) {
        let (command, frame) = (operator(session.mode()), session.sense());
        let output = session.advance(&frame, command).expect("a sound plant");
        let mut sample = reader.sample(&frame, &drives(output.drive, output.preload));
        sample.preload_n += zeros.0;
        sample.compression_mm += zeros.1;
        samples.push((samples.len() as u32, sample));
    }
    Record::new(name, scenario, samples).expect("a sound record")
}
