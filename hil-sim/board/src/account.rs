//! What the control tick costs on the core, phase by phase: a run in software is
//! recorded and its ticks are given to the measurement image, which must answer with
//! the same bits.

mod phases;
mod recorded;

use std::path::Path;

use interstage_images::tick::{Preset, Taken};
use serde::Serialize;

use super::core::{Heat, Meter};
use super::image::{ARGUMENTS, Image, ImageError};
use hil_sim::scenario::Scenario;
use hil_sim::sil::RunError;

pub use phases::{Phase, PhaseCost, Spread};
pub use recorded::{Recorded, record};

/// Package and binary of the measurement image.
pub const IMAGE: (&str, &str) = ("interstage-images", "measure");

/// Where the image writes what is looked at of an output.
const ANSWERS: u32 = ARGUMENTS + 0x1000;

/// What can go wrong with an account.
#[derive(Debug, thiserror::Error)]
pub enum AccountError {
    /// The run could not be recorded.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The image failed.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The image knows the presets alone.
    #[error("the measurement image has the rigs prototype and fe as they are, not `{0}` changed")]
    Rig(String),
    /// The core answered otherwise than the host.
    #[error("tick {tick} of the {direction} run differs between host and core")]
    Differs {
        /// Way of the run.
        direction: &'static str,
        /// The first tick that differs.
        tick: usize,
    },
}

/// The account of one or more runs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Account {
    /// Ticks run, each with the same output on host and core.
    pub ticks: u64,
    /// The control tick over all of them.
    pub tick: Spread,
    /// The control tick by phase, in the order of first appearance.
    pub phases: Vec<PhaseCost>,
    /// The planner's answers between the ticks.
    pub plan: Spread,
    /// Cycles by block and phase, for [`Account::profile`].
    #[serde(skip)]
    heat: Vec<Heat>,
    /// Every stage is run in every tick.
    #[serde(skip)]
    whole: bool,
}

/// A function's share of a phase.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Share {
    /// Name in the source.
    pub function: String,
    /// Cycles per tick of the phase.
    pub cycles: f64,
    /// Part of the phase's cycles.
    pub share: f64,
}

impl Account {
    /// An account of a controller that skips nothing.
    #[must_use]
    pub fn without_skipping() -> Self {
        Self { whole: true, ..Self::default() }
    }

    /// Gives the run of `scenario` to the image.
    ///
    /// # Errors
    /// [`AccountError`] if either cannot be run, or they differ.
    pub fn add(&mut self, image: &mut Image, scenario: &Scenario) -> Result<(), AccountError> {
        let preset = preset(scenario)?;
        let ticks = record(scenario)?;
        self.replay(image, scenario.run.direction.name(), preset, &ticks)
    }

    /// Gives these ticks to the image, whose controller is built afresh from this
    /// preset.
    ///
    /// # Errors
    /// [`AccountError::Differs`] at the first tick that the image answers otherwise.
    pub fn replay(
        &mut self,
        image: &mut Image,
        direction: &'static str,
        preset: Preset,
        ticks: &[Recorded],
    ) -> Result<(), AccountError> {
        let calls = Calls::of(image)?;
        image.call(calls.build, &[preset as u32])?;
        if self.whole {
            image.call(calls.skip_nothing, &[])?;
        }
        for (number, tick) in ticks.iter().enumerate() {
            image.put(ARGUMENTS, &tick.given.words())?;
            image.call(calls.load, &[ARGUMENTS])?;
            image.take_heat();
            let cost = image.call(calls.step, &[])?.meter;
            self.note(tick, cost, image.take_heat());
            let planned = image.call(calls.plan, &[])?;
            if planned.value != 0 {
                self.plan.note(planned.meter, number);
            }
            image.call(calls.save, &[ANSWERS])?;
            if Taken::from_words(image.get(ANSWERS)?) != tick.taken {
                return Err(AccountError::Differs { direction, tick: number });
            }
        }
        Ok(())
    }

    fn note(&mut self, tick: &Recorded, cost: Meter, heat: Heat) {
        let now = tick.given.now as usize;
        self.ticks += 1;
        self.tick.note(cost, now);
        let found = self.phases.iter().position(|cost| cost.phase == tick.phase);
        let index = found.unwrap_or_else(|| {
            self.phases.push(PhaseCost { phase: tick.phase, tick: Spread::default() });
            self.heat.push(Heat::new());
            self.phases.len() - 1
        });
        self.phases[index].tick.note(cost, now);
        for (block, cycles) in heat {
            *self.heat[index].entry(block).or_default() += cycles;
        }
    }

    /// The phase with the largest mean; none before the first tick.
    #[must_use]
    pub fn busiest(&self) -> Option<&PhaseCost> {
        self.phases.iter().max_by(|a, b| a.tick.mean().total_cmp(&b.tick.mean()))
    }

    /// The smooth wall: under way with no step inside the horizon.
    pub fn smooth(&self) -> impl Iterator<Item = &PhaseCost> {
        self.phases.iter().filter(|cost| cost.phase.is_smooth())
    }

    /// Functions of a phase, the most expensive first.
    ///
    /// # Errors
    /// [`ImageError::Form`] if the image's debug information cannot be read.
    pub fn profile(&self, image: &Image, phase: &Phase) -> Result<Vec<Share>, ImageError> {
        let Some(index) = self.phases.iter().position(|cost| cost.phase == *phase) else {
            return Ok(Vec::new());
        };
        let spread = &self.phases[index].tick;
        let share = |(function, cycles): (String, u64)| Share {
            function,
            cycles: cycles as f64 / spread.calls as f64,
            share: cycles as f64 / spread.cycles as f64,
        };
        Ok(image.by_function(&self.heat[index])?.into_iter().map(share).collect())
    }
}

/// Addresses of the image's functions for the tick.
struct Calls {
    build: u32,
    skip_nothing: u32,
    load: u32,
    step: u32,
    plan: u32,
    save: u32,
}

impl Calls {
    fn of(image: &Image) -> Result<Self, ImageError> {
        Ok(Self {
            build: image.function("tick_build")?,
            skip_nothing: image.function("tick_skip_nothing")?,
            load: image.function("tick_load")?,
            step: image.function("tick_step")?,
            plan: image.function("tick_plan")?,
            save: image.function("tick_save")?,
        })
    }
}

/// The preset that this scenario's controller is built from.
///
/// # Errors
/// [`AccountError::Rig`] if it is none of the presets, unchanged.
pub fn preset(scenario: &Scenario) -> Result<Preset, AccountError> {
    let none = || AccountError::Rig(scenario.preset.clone());
    let preset = Preset::named(&scenario.preset).ok_or_else(none)?;
    let unchanged = interstage::rig::Rig::named(preset.name()).as_ref() == Some(&scenario.rig);
    if unchanged { Ok(preset) } else { Err(none()) }
}

/// The account of a deployment and a retraction of `scenario` on the image at `elf`.
///
/// # Errors
/// As [`Account::add`].
pub fn both_ways(elf: &Path, scenario: &Scenario) -> Result<(Account, Image), AccountError> {
    use hil_sim::scenario::Direction;
    let mut image = Image::open(elf)?;
    let mut account = Account::default();
    for direction in [Direction::Deploy, Direction::Retract] {
        let mut scenario = scenario.clone();
        scenario.run.direction = direction;
        account.add(&mut image, &scenario)?;
    }
    Ok((account, image))
}
