//! The study's results, regenerated: every figure that its text describes, as theory
//! (the controller's model), simulation (the reference models) and experiment (the virtual
//! rig, forty runs and four means of ten), with the numbers that it prints as marks, and
//! every claim of it judged by these data.
//!
//! A claim is judged by code from the data of the figure below which it is printed; nothing
//! is fitted but the three numbers of the tread, and nothing is tuned so that a claim
//! would hold. Everything is deterministic: the same build writes the same bytes.

mod amplitudes;
mod case;
mod cases;
mod claims;
pub mod experiment;
mod finite_elements;
mod histories;
mod history;
mod hold;
mod means;
mod measure;
mod modes;
pub(crate) mod page;
mod published;
mod simulation;
mod sweeps;
mod theory;
mod transitions;

use anyhow::Result;
use rayon::prelude::*;
use serde::Serialize;

use crate::figure::{Claim, Figure};
use amplitudes::Amplitudes;
use case::Case;
use experiment::Experiment;
use histories::Histories;
use hold::Hold;
use modes::Modes;
use sweeps::{Sweep, Variable};

/// Everything that is regenerated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Study {
    /// The figures, in the study's order.
    pub(crate) figures: Vec<Figure>,
    pub(crate) claims: Vec<Claim>,
}

/// Cases of all experiments, each once.
pub fn cases() -> Vec<Case> {
    let all: [&[Case]; 5] = [
        &cases::cases(),
        &Variable::Preload.cases(),
        &Variable::Speed.cases(),
        &transitions::cases(),
        &Hold::cases(),
    ];
    let mut unique: Vec<Case> = Vec::new();
    for case in all.concat() {
        if !unique.contains(&case) {
            unique.push(case);
        }
    }
    unique
}

/// Computes theory and simulation beside the experiments of all [`cases`], and judges the claims.
pub fn regenerate(experiments: &[Experiment]) -> Result<Study> {
    let find = |wanted: &[Case]| -> Vec<&Experiment> {
        let of = |case: &Case| experiments.iter().find(|e| e.case == *case);
        wanted.iter().filter_map(of).collect()
    };
    let deployments = [cases::cases(), transitions::cases()].concat();
    let deployments = find(&deployments).into_par_iter().map(Histories::new);
    let histories = deployments.collect::<Result<Vec<_>>>()?;
    let (at_study, at_rig) = histories.split_at(cases::cases().len());
    let amplitudes = Amplitudes::new(&find(&cases::cases()))?;
    let modes = Modes::new()?;
    let preload = Sweep::new(Variable::Preload, &find(&Variable::Preload.cases()))?;
    let speed = Sweep::new(Variable::Speed, &find(&Variable::Speed.cases()))?;
    let hold = Hold::new(&find(&Hold::cases()))?;
    let figures = vec![
        cases::figure(at_study),
        amplitudes.loads_figure(),
        amplitudes.gap_figure(at_study),
        modes.figure(),
        preload.gap_figure(),
        speed.gap_figure(),
        preload.depth_figure(),
        speed.depth_figure(),
        transitions::figure(at_rig),
        hold.figure(),
    ];
    let verdicts = [
        cases::verdicts(at_study),
        amplitudes::verdicts(&amplitudes, at_study),
        modes::verdicts(&modes),
        sweeps::verdicts(&preload, &speed, experiments),
        transitions::verdicts(at_rig),
        hold::verdicts(&hold, experiments, &speed.gap),
    ];
    Ok(Study { figures, claims: claims::Said::read()?.judged(&verdicts.concat())? })
}

/// The study's figures and claims as JSON, values to four figures: what a comparison
/// across builds can rely on.
pub fn json(study: &Study) -> serde_json::Result<String> {
    let mut value = serde_json::to_value(study)?;
    round(&mut value);
    serde_json::to_string(&value)
}

/// Rounds every number to four figures.
fn round(value: &mut serde_json::Value) {
    use serde_json::Value;
    match value {
        Value::Number(number) => {
            let rounded = number.as_f64().and_then(|x| format!("{x:.3e}").parse::<f64>().ok());
            if let Some(shorter) = rounded.and_then(serde_json::Number::from_f64) {
                *number = shorter;
            }
        }
        Value::Array(all) => all.iter_mut().for_each(round),
        Value::Object(all) => all.values_mut().for_each(round),
        _ => {}
    }
}
