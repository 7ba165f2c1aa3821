//! The reduced model in fixed point as shipped, in f32 and in f64: error against the
//! formulas in f64, and time on this host.

use anyhow::Result;
use interstage::model::reduced::ReducedModel;
use interstage::rig::Rig;
use interstage_images::model::{
    FloatModel, Given, Point, VARIANTS, fixed_forward, fixed_inverse, points,
};
use interstage_images::number::Number;
use serde::Serialize;

use super::least;

/// Steps of the domain, mm.
const STEPS_MM: [f64; 5] = [2.0, 3.0, 4.0, 5.0, 6.0];

/// Gap below which errors are relative to this, mm: a tenth of what its sensor resolves.
pub const LEAST_GAP_MM: f64 = 0.1;

/// One in Q15.16.
const ONE: f64 = 65_536.0;

/// Error and cost of one direction of the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Measurement {
    /// Largest error, relative to the force, or to the gap or [`LEAST_GAP_MM`], whichever is
    /// larger.
    pub max_rel_error: f64,
    /// Root of its mean square.
    pub rms_rel_error: f64,
    /// Textbook Cortex-M4 cycles of the costliest call; none without the emulated core.
    pub cycles: Option<u64>,
    /// Time of a call on this host, ns, mean over the points.
    pub host_ns: f64,
}

/// The model in one number format.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Variant {
    /// The number format.
    pub name: &'static str,
    /// Gap from speed and force.
    #[serde(flatten)]
    pub forward: Measurement,
    /// Force from speed and gap.
    pub inverse: Measurement,
}

/// Both presets with every step of the domain.
fn rigs() -> impl Iterator<Item = Rig> {
    [Rig::prototype(), Rig::fe()].into_iter().flat_map(|rig| {
        STEPS_MM.map(|step_mm| {
            let mut rig = rig.clone();
            rig.rig.step_height_mm = step_mm;
            rig
        })
    })
}

/// The variants in the order of [`VARIANTS`], without cycles.
pub fn measure() -> Result<Vec<Variant>> {
    let scenes: Vec<(Rig, Vec<Point>)> =
        rigs().map(|rig| (rig.clone(), points(&rig).collect())).collect();
    let fixed: Vec<(ReducedModel, &[Point])> = scenes
        .iter()
        .map(|(rig, points)| Ok((ReducedModel::try_build(rig)?, points.as_slice())))
        .collect::<Result<_>>()?;
    let [shipped, single, double] = VARIANTS.map(|variant| variant.name);
    Ok(vec![
        variant(
            shipped,
            &fixed,
            |model, given| f64::from(fixed_forward(model, given)) / ONE,
            |model, given| f64::from(fixed_inverse(model, given)) / ONE,
        ),
        float::<f32>(single, &scenes),
        float::<f64>(double, &scenes),
    ])
}

fn float<N: Number>(name: &'static str, scenes: &[(Rig, Vec<Point>)]) -> Variant {
    let models: Vec<(FloatModel<N>, &[Point])> =
        scenes.iter().map(|(rig, points)| (FloatModel::of(rig), points.as_slice())).collect();
    variant(name, &models, |m, given| m.gap_mm(given).value(), |m, given| m.radial_n(given).value())
}

fn variant<M>(
    name: &'static str,
    scenes: &[(M, &[Point])],
    forward: impl Fn(&M, &Given) -> f64,
    inverse: impl Fn(&M, &Given) -> f64,
) -> Variant {
    Variant {
        name,
        forward: measured(scenes, |p| (&p.forward, p.gap_mm), forward),
        inverse: measured(scenes, |p| (&p.inverse, p.force_n), inverse),
    }
}

/// Errors and time over all points of all rigs.
fn measured<M>(
    scenes: &[(M, &[Point])],
    pick: impl Fn(&Point) -> (&Given, f64),
    call: impl Fn(&M, &Given) -> f64,
) -> Measurement {
    let calls = || scenes.iter().flat_map(|(model, points)| points.iter().map(move |p| (model, p)));
    let errors: Vec<f64> = calls()
        .map(|(model, point)| {
            let (given, exact) = pick(point);
            ((call(model, given) - exact) / exact.max(LEAST_GAP_MM)).abs()
        })
        .collect();
    // The answers are summed up, so that no call can be left out.
    let (seconds, _) = least(|| {
        calls().map(|(model, p)| call(model, std::hint::black_box(pick(p).0))).sum::<f64>()
    });
    let count = errors.len() as f64;
    Measurement {
        max_rel_error: errors.iter().copied().fold(0.0, f64::max),
        rms_rel_error: (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt(),
        cycles: None,
        host_ns: 1e9 * seconds / count,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variant_is_within_a_ten_thousandth_over_the_domain() {
        let variants = measure().unwrap();
        assert_eq!(variants.iter().map(|v| v.name).collect::<Vec<_>>(), ["fixed", "f32", "f64"]);
        for Variant { name, forward, inverse } in &variants {
            for measurement in [forward, inverse] {
                assert!(measurement.max_rel_error < 1e-4, "{name}: {measurement:?}");
                assert!(
                    measurement.rms_rel_error <= measurement.max_rel_error
                        && measurement.host_ns > 0.0
                );
            }
        }
    }
}
