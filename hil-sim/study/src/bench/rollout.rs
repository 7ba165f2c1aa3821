//! The tread rolled out in fixed point, as the firmware plans with it: error of the gap against the
//! plant's fine ring, and time on this host.

use anyhow::{Context, Result, ensure};
use hil_sim::plant::balance::Axial;
use hil_sim::plant::crossing::{CrossingCase, cross};
use hil_sim::plant::precision::{self, Setting};
use hil_sim::rollout::{CrossingSetup, Wheel};
use interstage::model::tread::{Tread, TreadState};
use interstage::rig::Rig;
use interstage::units::{Direction, Q16};
use interstage_images::rollout::{Given, PRESET};
use rayon::prelude::*;
use serde::Serialize;

use super::cycles::Calls;
use super::least;

/// How much finer the ring of the reference is than that of deployments: within 0.03 %.
const FINER: usize = 4;

/// Error and cost of a variant of the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Variant {
    pub name: &'static str,
    /// Largest error of the gap, relative.
    pub max_rel_error: f64,
    /// Root of its mean square.
    pub rms_rel_error: f64,
    /// Textbook Cortex-M4 cycles of the costliest crossing; none without the emulated core.
    pub cycles: Option<u64>,
    /// Time of a crossing on this host, ns, mean over the crossings.
    pub host_ns: f64,
}

/// The rig that is measured.
fn rig() -> Result<Rig> {
    Rig::named(PRESET.name()).context("a preset is a rig")
}

/// The crossings, those of [`precision::cases`].
pub fn inputs() -> Result<Vec<Given>> {
    let wheel = Wheel::try_build(&rig()?)?;
    let given = |(speed, preload_n, axial): (f64, f64, Axial)| {
        let setup = CrossingSetup {
            speed_mm_s: speed.abs(),
            preload_n,
            direction: if speed > 0.0 { Direction::Deploy } else { Direction::Retract },
            load_n: match axial {
                Axial::Driven(load_n) => Some(load_n),
                _ => None,
            },
        };
        let [speed, force] = [setup.speed_mm_s, setup.preload_n].map(Q16::from_num);
        Given::of(&wheel.run(&setup), speed, force)
    };
    Ok(precision::cases().into_iter().map(given).collect())
}

/// Answers of this host, bits of Q15.16, mm.
fn on_host(tread: &Tread, inputs: &[Given]) -> Vec<i32> {
    let mut state = TreadState::default();
    inputs.iter().map(|given| given.gap(tread, &mut state)).collect()
}

/// The variants, without cycles.
pub fn measure() -> Result<Vec<Variant>> {
    let (rig, inputs) = (rig()?, inputs()?);
    let tread = Tread::try_build(&rig)?;
    let fine = Setting::usual().finer(FINER);
    let exact = precision::cases()
        .into_par_iter()
        .map(|case| Ok(cross(&CrossingCase::of(&rig, fine.both(), case))?.gap_mm))
        .collect::<Result<Vec<f64>>>()?;
    let (seconds, gaps) = least(|| on_host(&tread, std::hint::black_box(&inputs)));
    let off = |(gap, exact): (i32, f64)| Q16::from_bits(gap).to_num::<f64>() / exact - 1.0;
    let errors: Vec<f64> = gaps.into_iter().zip(exact).map(off).collect();
    let count = errors.len() as f64;
    Ok(vec![Variant {
        name: "rollout",
        max_rel_error: errors.iter().fold(0.0, |most, error| error.abs().max(most)),
        rms_rel_error: (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt(),
        cycles: None,
        host_ns: 1e9 * seconds / count,
    }])
}

/// Puts the cycles into the variants, once the core's answers are the host's to the bit.
pub fn fill(calls: &Calls, variants: &mut [Variant]) -> Result<()> {
    let host = on_host(&Tread::try_build(&rig()?)?, &inputs()?);
    ensure!(calls.values.len() == host.len(), "other crossings on the core");
    for (index, (&core, host)) in calls.values.iter().zip(host).enumerate() {
        let core = core as i32;
        ensure!(core == host, "rollout {index}: {core} on the core, {host} on the host");
    }
    variants.iter_mut().for_each(|variant| variant.cycles = Some(calls.cost.max));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::cycles::Cost;

    #[test]
    fn the_gap_is_within_seven_thousandths_of_a_fine_ring() {
        let variants = measure().unwrap();
        let [rollout] = &variants[..] else { panic!("{variants:?}") };
        assert!(rollout.max_rel_error < 0.007, "{rollout:?}");
        assert!(rollout.rms_rel_error > 1e-5, "the plant has not this pitch: {rollout:?}");
    }

    #[test]
    fn cycles_count_only_with_the_same_answers() {
        let mut variants = measure().unwrap();
        let tread = Tread::try_build(&rig().unwrap()).unwrap();
        let values = on_host(&tread, &inputs().unwrap()).into_iter().map(|gap| gap as u32);
        let cost = Cost { calls: 12, cycles: 9, max: 600 };
        let mut calls = Calls { values: values.collect(), cost };
        fill(&calls, &mut variants).unwrap();
        assert_eq!(variants[0].cycles, Some(600));
        calls.values[3] += 1;
        let error = fill(&calls, &mut variants).unwrap_err().to_string();
        assert!(error.starts_with("rollout 3:"), "{error}");
    }
}
