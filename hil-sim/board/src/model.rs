//! What the reduced model costs on the core, function by function, with the answers
//! checked against the host's.

use interstage::model::reduced::ReducedModel;
use interstage::rig::{Rig, RigError};
use interstage_images::model::{FUNCTIONS, Given, PREPARE};
use interstage_images::tick::Preset;
use serde::Serialize;

use super::account::Spread;
use super::image::{Image, ImageError};

/// One in Q15.16.
const ONE: f64 = 65_536.0;

/// What can go wrong.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The image failed.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The preset makes no model.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The core answered otherwise than the host.
    #[error("{function} of input {index} is {core} on the core and {host} on the host")]
    Differs {
        /// The function.
        function: &'static str,
        /// The input.
        index: usize,
        /// Bits on the core.
        core: i32,
        /// Bits on the host.
        host: i32,
    },
}

/// What one function takes.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Its symbol.
    pub function: &'static str,
    /// Its calls.
    pub cost: Spread,
    /// The input of the dearest call.
    #[serde(skip)]
    pub dearest: Given,
}

/// Points over the model's domain: speeds from 1 to 100 mm/s and forces from 15 to
/// 150 N in equal ratios, both ways, stiffness scales from 0.75 to 1.25; each with the
/// gap that the model gives there.
#[must_use]
pub fn points(model: &ReducedModel) -> Vec<Given> {
    const STEPS: u32 = 12;
    let bits = |value: f64| (value * ONE).round() as i32;
    let between = |low: f64, high: f64, at: u32| {
        low * (high / low).powf(f64::from(at) / f64::from(STEPS - 1))
    };
    let mut points = Vec::new();
    for direction in 0..2 {
        for scale in [0.75, 1.0, 1.25] {
            for (speed, force) in (0..STEPS).flat_map(|s| (0..STEPS).map(move |f| (s, f))) {
                let mut given = Given {
                    direction,
                    speed: bits(between(1.0, 100.0, speed)),
                    scale: bits(scale),
                    gap: 0,
                    force: bits(between(15.0, 150.0, force)),
                };
                given.gap = interstage_images::model::forward(model, given.scale(), &given);
                points.push(given);
            }
        }
    }
    points
}

/// Measures every function of the model of a preset over [`points`].
///
/// # Errors
/// [`ModelError`], also if one answer differs from the host's.
pub fn measure(image: &mut Image, preset: Preset) -> Result<Vec<Measured>, ModelError> {
    let rig = Rig::named(preset.name()).unwrap_or_else(Rig::prototype);
    let model = ReducedModel::try_build(&rig)?;
    let build = image.function("model_build")?;
    image.call(build, &[preset as u32])?;
    let points = points(&model);
    let words: Vec<_> = points.iter().map(Given::words).collect();
    let mut measured = Vec::new();
    for (function, host) in FUNCTIONS {
        let (values, cost) = image.measure_prepared(Some(PREPARE), function, &words)?;
        for (index, (value, given)) in values.iter().zip(&points).enumerate() {
            let (core, host) = (*value as i32, host(&model, given.scale(), given));
            if core != host {
                return Err(ModelError::Differs { function, index, core, host });
            }
        }
        let dearest = points.get(cost.dearest).copied().unwrap_or_default();
        measured.push(Measured { function, cost, dearest });
    }
    Ok(measured)
}
