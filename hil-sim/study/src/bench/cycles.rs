//! Cycles on the emulated core, which is a program of its own: `rig-board cycles --json`.
//! `interstage_images` says what is exchanged.

use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use interstage::model::reduced::ReducedModel;
use interstage::rig::Rig;
use interstage_images::model::{
    FloatModel, PRESET, VARIANTS, fixed_forward, fixed_inverse, points,
};
use serde::{Deserialize, Serialize};

use hil_sim::provision::{Extra, featured};

use super::model::Variant;

/// Largest difference of core and host in floating point, LSB of Q15.16: a product and a sum
/// may be rounded once on the one and twice on the other.
const FLOAT_LSB: u32 = 64;

/// What the core measured.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Measured {
    /// By number format.
    pub variants: Vec<MeasuredVariant>,
    /// The control tick.
    pub tick: Option<Tick>,
}

/// Cycles and answers of one number format.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct MeasuredVariant {
    /// The number format.
    pub name: String,
    /// Cycles of the costliest call forwards.
    pub forward_cycles: u64,
    /// Cycles of the costliest call back.
    pub inverse_cycles: u64,
    /// Answers of all points forwards, then of all points back, bits of Q15.16.
    pub outputs: Vec<i32>,
}

/// Textbook cycles of the control tick over a deployment.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Tick {
    /// Mean of all ticks.
    pub mean: f64,
    /// The costliest tick.
    pub worst: u64,
}

/// Starts the emulated core, which is built first if need be.
///
/// # Errors
/// If it cannot be built or does not run.
pub fn run() -> Result<Measured> {
    let binary = featured(Extra::Board)?;
    let output = Command::new(&binary)
        .args(["cycles", "--json"])
        .stderr(Stdio::inherit())
        .output()
        .with_context(|| format!("could not start {}", binary.display()))?;
    ensure!(output.status.success(), "{} ended with {}", binary.display(), output.status);
    serde_json::from_slice(&output.stdout).context("output of rig-board")
}

/// Puts the cycles into the variants, once the core's answers agree with the host's.
///
/// # Errors
/// If an answer differs.
pub fn fill(measured: &Measured, variants: &mut [Variant]) -> Result<Option<Tick>> {
    for variant in variants {
        let found = measured.variants.iter().find(|found| found.name == variant.name);
        let found = found.with_context(|| format!("the core has no {}", variant.name))?;
        let host = on_host(variant.name)?;
        ensure!(host.len() == found.outputs.len(), "{}: other points on the core", variant.name);
        let most = if variant.name == VARIANTS[0].name { 0 } else { FLOAT_LSB };
        for (index, (&host, &core)) in host.iter().zip(&found.outputs).enumerate() {
            let same = host.abs_diff(core) <= most;
            ensure!(same, "{} {index}: {core} on the core, {host} on the host", variant.name);
        }
        variant.forward.cycles = Some(found.forward_cycles);
        variant.inverse.cycles = Some(found.inverse_cycles);
    }
    Ok(measured.tick)
}

/// The answers of one number format on this host.
fn on_host(name: &str) -> Result<Vec<i32>> {
    let rig = Rig::named(PRESET.name()).context("a preset is a rig")?;
    let fixed = ReducedModel::try_build(&rig)?;
    let (single, double) = (FloatModel::<f32>::of(&rig), FloatModel::<f64>::of(&rig));
    let both = |inverse: bool| {
        points(&rig).map(move |p| (inverse, if inverse { p.inverse } else { p.forward }))
    };
    let answer = |(inverse, given)| match (name, inverse) {
        ("fixed", false) => fixed_forward(&fixed, &given),
        ("fixed", true) => fixed_inverse(&fixed, &given),
        ("f32", false) => single.forward(&given),
        ("f32", true) => single.inverse(&given),
        (_, false) => double.forward(&given),
        (_, true) => double.inverse(&given),
    };
    Ok(both(false).chain(both(true)).map(answer).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::model;

    fn measured() -> Measured {
        let of = |name: &str| MeasuredVariant {
            name: name.to_owned(),
            forward_cycles: 500,
            inverse_cycles: 300,
            outputs: on_host(name).unwrap(),
        };
        let tick = Some(Tick { mean: 4e3, worst: 5000 });
        Measured { variants: VARIANTS.map(|variant| of(variant.name)).to_vec(), tick }
    }

    #[test]
    fn cycles_count_only_with_the_same_answers() {
        let mut variants = model::measure().unwrap();
        let mut measured = measured();
        assert_eq!(fill(&measured, &mut variants).unwrap().unwrap().worst, 5000);
        assert!(variants.iter().all(|v| v.forward.cycles == Some(500)));
        // Fixed point is the same to the bit, floating point nearly.
        measured.variants[1].outputs[3] += 1;
        assert!(fill(&measured, &mut variants).is_ok());
        measured.variants[0].outputs[3] += 1;
        let error = fill(&measured, &mut variants).unwrap_err().to_string();
        assert!(error.starts_with("fixed 3:"), "{error}");
    }
}
