//! The points that the arithmetics are compared on: a Sobol sequence over speed, force
//! and way, for both presets and five heights of the step.

use anyhow::{Context, Result};
use interstage::model::effective_stiffness::Kind;
use interstage::model::formula::Formula;
use interstage::model::reduced::ReducedModel;
use interstage::rig::Rig;
use interstage_arith::{COEFFICIENTS, Double, Given, Model};
use interstage_images::arith::with_step;
use interstage_images::tick::Preset;
use sobol_burley::sample;

use super::{direction, fit};

/// One in Q15.16.
pub(super) const ONE: f64 = 65_536.0;

/// The domain of the model: speed, mm/s, radial force, N, step, mm.
const SPEEDS: (f64, f64) = (1.0, 100.0);
const FORCES: (f64, f64) = (15.0, 150.0);
const STEPS_MM: [f64; 5] = [2.0, 3.0, 4.0, 5.0, 6.0];

/// Seed of the sequence's scrambling.
const SEED: u32 = 1;

/// One point with the exact answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Speed and force.
    pub forward: Given,
    /// The gap there, by the formulas solved to convergence, mm.
    pub gap_mm: f64,
    /// Speed and gap.
    pub inverse: Given,
    /// The force there, by the formulas, N.
    pub force_n: f64,
}

/// One rig with its points.
pub struct Scene {
    /// The preset.
    pub preset: Preset,
    /// Height of its steps, bits of Q15.16, mm.
    pub step_height: i32,
    /// The preset with that step.
    pub rig: Rig,
    /// Load that friction lifts, N.
    pub load_n: f64,
    /// The shipping model.
    pub shipping: ReducedModel,
    /// Coefficients for the others.
    pub flat: [f64; COEFFICIENTS],
    /// Its points.
    pub points: Vec<Point>,
    /// Points left out: beyond an end of the model, or of what friction lifts.
    pub beyond: usize,
}

/// Value of the bits of a Q15.16.
pub(super) fn value(bits: i32) -> f64 {
    f64::from(bits) / ONE
}

fn bits(value: f64) -> i32 {
    (value * ONE).round() as i32
}

/// Every preset and step with so many points.
///
/// # Errors
/// If a model cannot be built.
pub fn scenes(points: u32) -> Result<Vec<Scene>> {
    let mut scenes = Vec::new();
    for preset in Preset::ALL {
        for step_mm in STEPS_MM {
            scenes.push(scene(preset, bits(step_mm), points)?);
        }
    }
    Ok(scenes)
}

fn scene(preset: Preset, step_height: i32, count: u32) -> Result<Scene> {
    let rig = Rig::named(preset.name()).context("a preset is a rig")?;
    let rig = with_step(rig, step_height);
    let formula = Formula::new(&rig);
    let load_n = rig.plant.top_load_n * rig.plant.top_load_share;
    let (shared, ways) = fit::coefficients(&rig).context("the model's polynomials do not fit")?;
    let drawn: Vec<Option<Point>> =
        (0..count).map(|index| point(&formula, load_n, index)).collect();
    let points: Vec<Point> = drawn.iter().copied().flatten().collect();
    Ok(Scene {
        preset,
        step_height,
        shipping: ReducedModel::try_build(&rig)?,
        flat: Model::<Double>::flat(&shared, &ways),
        beyond: drawn.len() - points.len(),
        points,
        load_n,
        rig,
    })
}

/// Point number `index` of the sequence; none beyond an end of the model or of what
/// friction lifts.
fn point(formula: &Formula, load_n: f64, index: u32) -> Option<Point> {
    let at = |dimension: u32, (low, high): (f64, f64)| {
        low * (high / low).powf(f64::from(sample(index, dimension, SEED)))
    };
    let forward = Given {
        direction: u32::from(sample(index, 2, SEED) < 0.5),
        speed: bits(at(0, SPEEDS)),
        wanted: bits(at(1, FORCES)),
    };
    let (way, speed) = (direction(&forward), value(forward.speed));
    let gap_mm = formula.gap_mm(way, speed, value(forward.wanted), Some(load_n));
    let kind = Kind { direction: way, driven: true };
    let run = formula.run_mm(gap_mm);
    let least = interstage::model::formula::LEAST_RUN * formula.radius_mm;
    let beyond = run < 1.01 * least || run > 0.995 * formula.largest_run_mm(kind);
    // No rubber lifts the load there.
    let slips = formula.utilisation(way, speed, gap_mm, load_n) > fit::MOST_UTILISATION;
    if beyond || slips {
        return None;
    }
    let inverse = Given { wanted: bits(gap_mm), ..forward };
    let force_n = formula.force_n(way, speed, value(inverse.wanted), Some(load_n));
    Some(Point { forward, gap_mm, inverse, force_n })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_cover_the_domain_and_lie_inside_the_model() {
        let scenes = scenes(64).unwrap();
        assert_eq!(scenes.len(), 10);
        let all: Vec<Point> = scenes.iter().flat_map(|scene| scene.points.clone()).collect();
        let beyond: usize = scenes.iter().map(|scene| scene.beyond).sum();
        assert_eq!(all.len() + beyond, 640);
        assert!(all.len() > 480, "{}", all.len());
        let extent = |pick: fn(&Point) -> i32| {
            let values = all.iter().map(|p| value(pick(p)));
            values.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)))
        };
        let (slow, fast) = extent(|p| p.forward.speed);
        let (weak, strong) = extent(|p| p.forward.wanted);
        assert!(slow < 1.2 && fast > 80.0, "{slow} {fast}");
        assert!(weak < 20.0 && strong > 120.0, "{weak} {strong}");
        assert!(all.iter().any(|p| p.forward.direction == 1));
    }
}
