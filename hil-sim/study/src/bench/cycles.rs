//! Cycles on the emulated core, which is a program of its own: `rig-board cycles`.
//! `interstage_images` says what is exchanged.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use interstage_images::rollout::{Given, PRESET};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::json;

use hil_sim::firmware::WithWaits;
use hil_sim::provision::{Extra, featured};

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

/// Rollouts of these crossings and the control tick on the emulated core, which is built first if
/// need be.
pub fn run(inputs: &[Given]) -> Result<(Calls, Tick)> {
    #[derive(Deserialize)]
    struct TickCost {
        tick: Cost,
        firmware: Firmware,
    }
    let binary = featured(Extra::Board)?;
    let name = format!("rig-study-{}.json", std::process::id());
    let script = std::env::temp_dir().join(name);
    std::fs::write(&script, serde_json::to_vec(&steps(inputs))?)?;
    let done = start(&binary, &["--script".as_ref(), script.as_os_str()]);
    std::fs::remove_file(&script)?;
    let calls: [Calls; 2] = done?;
    let [built, rollouts] = calls;
    ensure!(built.values == [1], "the core cannot build the tread");
    let TickCost { tick, firmware } = start(&binary, &[])?;
    let mean = tick.cycles as f64 / tick.calls.max(1) as f64;
    Ok((rollouts, Tick { mean, worst: tick.max, firmware }))
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

/// The script: build the tread, then roll it out over every crossing.
fn steps(inputs: &[Given]) -> [serde_json::Value; 2] {
    let inputs: Vec<[u32; 7]> = inputs.iter().map(Given::words).collect();
    [
        json!({ "call": { "function": "model_build", "arguments": [PRESET as u32] } }),
        json!({ "measure": { "function": "rollout", "inputs": inputs } }),
    ]
}
