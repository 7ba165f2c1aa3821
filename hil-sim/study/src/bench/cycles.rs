//! Cycles on the emulated core, which is a program of its own: `rig-board cycles`.
//! `interstage_images` says what is exchanged.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use interstage::model::reduced::ReducedModel;
use interstage::rig::Rig;
use interstage_images::model::{
    FloatModel, Given, PRESET, VARIANTS, fixed_forward, fixed_inverse, points,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::json;

use hil_sim::provision::{Extra, featured};

use super::model::Variant;

/// Largest difference of core and host in floating point, LSB of Q15.16: a product and a sum
/// may be rounded once on the one and twice on the other.
const FLOAT_LSB: u32 = 64;

/// What the core measured: forward and inverse calls of each of [`VARIANTS`], in turn, and
/// the control tick.
pub type Measured = (Vec<Calls>, Tick);

/// Calls of one function.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Calls {
    /// What each returned.
    pub values: Vec<u32>,
    /// What they took.
    pub cost: Cost,
}

/// Textbook Cortex-M4 cycles of calls.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Cost {
    pub calls: u64,
    pub cycles: u64,
    /// Cycles of the costliest call.
    pub max: u64,
}

/// Textbook cycles of the control tick over a deployment and a retraction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tick {
    /// Mean of all ticks.
    pub mean: f64,
    /// The costliest tick.
    pub worst: u64,
    pub firmware: Firmware,
}

/// Cycles of the control tick's task in the firmware, over a deployment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Firmware {
    /// Mean textbook cycles.
    pub mean: f64,
    /// Most textbook cycles.
    pub worst: u64,
    /// With the flash's wait states.
    pub with_waits: WithWaits,
}

/// Cycles with the flash's wait states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WithWaits {
    pub mean: f64,
    /// Most.
    pub worst: u64,
}

/// Starts the emulated core, which is built first if need be.
pub fn run() -> Result<Measured> {
    #[derive(Deserialize)]
    struct TickCost {
        tick: Cost,
        firmware: Firmware,
    }
    let binary = featured(Extra::Board)?;
    let name = format!("rig-study-{}.json", std::process::id());
    let script = std::env::temp_dir().join(name);
    std::fs::write(&script, serde_json::to_vec(&steps()?)?)?;
    let done = start(&binary, &["--script".as_ref(), script.as_os_str()]);
    std::fs::remove_file(&script)?;
    // The first step builds the models.
    let mut calls: Vec<Calls> = done?;
    let built = calls.remove(0);
    ensure!(built.values == [1], "the core cannot build the models");
    let TickCost { tick, firmware } = start(&binary, &[])?;
    let mean = tick.cycles as f64 / tick.calls.max(1) as f64;
    Ok((calls, Tick { mean, worst: tick.max, firmware }))
}

/// Runs `rig-board cycles` with these arguments.
fn start<T: DeserializeOwned>(binary: &Path, arguments: &[&std::ffi::OsStr]) -> Result<T> {
    let output = Command::new(binary)
        .args(["cycles", "--json"])
        .args(arguments)
        .stderr(Stdio::inherit())
        .output()
        .with_context(|| format!("could not start {}", binary.display()))?;
    ensure!(output.status.success(), "{} ended with {}", binary.display(), output.status);
    serde_json::from_slice(&output.stdout).context("output of rig-board")
}

/// The script: build the models, then every function at every point.
fn steps() -> Result<Vec<serde_json::Value>> {
    let build = json!({ "call": { "function": "model_build", "arguments": [PRESET as u32] } });
    let [forward, inverse] = inputs()?;
    let measure = |function: &str, given: &[Given]| {
        let inputs: Vec<[u32; 3]> = given.iter().map(Given::words).collect();
        json!({ "measure": { "function": function, "inputs": inputs } })
    };
    let all = VARIANTS.iter().flat_map(|variant| {
        [measure(variant.forward, &forward), measure(variant.inverse, &inverse)]
    });
    Ok([build].into_iter().chain(all).collect())
}

fn rig() -> Result<Rig> {
    Rig::named(PRESET.name()).context("a preset is a rig")
}

/// Inputs forwards and back.
fn inputs() -> Result<[Vec<Given>; 2]> {
    let rig = rig()?;
    Ok([points(&rig).map(|p| p.forward).collect(), points(&rig).map(|p| p.inverse).collect()])
}

/// Puts the cycles into the variants, once the core's answers agree with the host's.
pub fn fill(measured: &[Calls], variants: &mut [Variant]) -> Result<()> {
    let host = on_host()?;
    ensure!(measured.len() == host.len(), "other functions on the core");
    for (index, (calls, host)) in measured.iter().zip(&host).enumerate() {
        let (variant, back) = (&mut variants[index / 2], index % 2 == 1);
        ensure!(calls.values.len() == host.len(), "{}: other points on the core", variant.name);
        let most = if index < 2 { 0 } else { FLOAT_LSB };
        for (point, (&core, &host)) in calls.values.iter().zip(host).enumerate() {
            let (name, core) = (variant.name, core as i32);
            let same = host.abs_diff(core) <= most;
            ensure!(same, "{name}, point {point}: {core} on the core, {host} on the host");
        }
        let measurement = if back { &mut variant.inverse } else { &mut variant.forward };
        measurement.cycles = Some(calls.cost.max);
    }
    Ok(())
}

/// Answers of this host, in the same order.
fn on_host() -> Result<[Vec<i32>; 6]> {
    let rig = rig()?;
    let fixed = ReducedModel::try_build(&rig)?;
    let (single, double) = (FloatModel::<f32>::of(&rig), FloatModel::<f64>::of(&rig));
    let [forward, inverse] = inputs()?;
    Ok([
        forward.iter().map(|given| fixed_forward(&fixed, given)).collect(),
        inverse.iter().map(|given| fixed_inverse(&fixed, given)).collect(),
        forward.iter().map(|given| single.forward(given)).collect(),
        inverse.iter().map(|given| single.inverse(given)).collect(),
        forward.iter().map(|given| double.forward(given)).collect(),
        inverse.iter().map(|given| double.inverse(given)).collect(),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::model;

    #[test]
    fn cycles_count_only_with_the_same_answers() {
        let mut variants = model::measure().unwrap();
        let answers = on_host().unwrap();
        assert_eq!(steps().unwrap().len(), 1 + answers.len());
        let calls = answers.iter().zip([500, 300, 1500, 600, 60_000, 20_000]);
        let mut measured: Vec<Calls> = calls
            .map(|(values, max)| Calls {
                values: values.iter().map(|&value| value as u32).collect(),
                cost: Cost { calls: 1, cycles: max, max },
            })
            .collect();
        fill(&measured, &mut variants).unwrap();
        assert_eq!(variants[1].inverse.cycles, Some(600));
        // Fixed point is the same to the bit, floating point nearly.
        measured[2].values[3] += 1;
        fill(&measured, &mut variants).unwrap();
        measured[0].values[3] += 1;
        let error = fill(&measured, &mut variants).unwrap_err().to_string();
        assert!(error.starts_with("fixed, point 3:"), "{error}");
    }
}
