//! Cycles of the measuring image's functions, which are built like the firmware's.

use interstage::estimate::ContactStage;
use interstage::supervise::{Command, Leg, Mode};
use interstage::tick::Input;
use interstage_images::tick::{Given, Preset, Taken};
use serde::{Deserialize, Serialize};

use crate::error::ImageError;
use crate::image::{ARGUMENTS, Image};
use crate::spread::Spread;
use hil_sim::scenario::{Direction, Scenario};
use hil_sim::session::{Options, RunError, Session};

/// Package and binary of the measuring image.
pub const IMAGE: (&str, &str) = ("interstage-images", "measure");

/// Where the image writes what is compared of an output.
const ANSWERS: u32 = ARGUMENTS + 0x1000;
/// Longest run recorded, ticks.
const LONGEST: usize = 120_000;

/// A step of a script.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Step {
    /// Puts words where functions find what they are given by reference.
    Put(Vec<u32>),
    /// Calls a function with at most four arguments.
    Call {
        /// Its symbol.
        function: String,
        /// The arguments; by reference if there are none.
        #[serde(default)]
        arguments: Option<Vec<u32>>,
    },
    /// Calls a function once for each input, given by reference.
    Measure {
        /// Its symbol.
        function: String,
        /// Words of each input.
        inputs: Vec<Vec<u32>>,
    },
}

/// What came of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Done {
    /// What each call returned.
    pub values: Vec<u32>,
    /// What the calls took.
    pub cost: Spread,
}

/// Carries out the steps of a script.
///
/// # Errors
/// [`ImageError`] at the first call that fails.
pub fn run(image: &mut Image, steps: &[Step]) -> Result<Vec<Done>, ImageError> {
    let one = |step: &Step| {
        let (values, cost) = match step {
            Step::Put(words) => {
                image.put(ARGUMENTS, words)?;
                (Vec::new(), Spread::default())
            }
            Step::Call { function, arguments } => {
                let function = image.function(function)?;
                let call = image.call(function, arguments.as_deref().unwrap_or(&[ARGUMENTS]))?;
                let mut cost = Spread::default();
                cost.note(call.meter, 0);
                (vec![call.value], cost)
            }
            Step::Measure { function, inputs } => image.measure(function, inputs)?,
        };
        Ok(Done { values, cost })
    };
    steps.iter().map(one).collect()
}

/// Why the tick was not measured.
#[derive(Debug, thiserror::Error)]
pub enum CyclesError {
    /// The run in software cannot be made.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The image failed.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The core answered otherwise than the host.
    #[error("tick {0} differs between host and core")]
    Differs(usize),
}

/// Cycles of the control tick over whole runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TickCycles {
    /// Every tick.
    pub tick: Spread,
    /// Ticks on the continuous wall, no step inside the horizon.
    pub smooth: Spread,
    /// Every tick, with every stage run in each.
    pub without_skipping: Spread,
    /// The planner's answers between the ticks.
    pub plan: Spread,
}

/// A tick of a run in software.
#[derive(Clone, Copy, Debug)]
pub struct Recorded {
    /// What the controller was given; the plan is worked out again.
    pub given: Given,
    /// What is compared of what it gave.
    pub taken: Taken,
    /// Whether it was under way on the continuous wall.
    pub smooth: bool,
}

/// Runs a scenario in software and keeps each tick.
///
/// # Errors
/// [`RunError`] as for a run in software.
pub fn record(scenario: &Scenario) -> Result<Vec<Recorded>, RunError> {
    let mut session = Session::new(scenario, Options::default())?;
    let mut start = Some(match scenario.run.direction {
        Direction::Deploy => Command::Start,
        Direction::Retract => Command::Retract,
    });
    let mut ticks = Vec::new();
    while ticks.len() < LONGEST {
        let command = if session.mode() == Mode::Idle { start.take() } else { None };
        let sensors = session.sense();
        let now = ticks.len() as u32;
        let given = Given::of(&Input { now, sensors, command, ..Input::default() });
        let output = session.advance(&sensors, command)?;
        let smooth = matches!(output.telemetry.mode, Mode::Run(_, Leg::Cruise))
            && output.telemetry.stage == ContactStage::Continuous;
        ticks.push(Recorded { given, taken: Taken::of(&output), smooth });
        if matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_)) {
            break;
        }
    }
    Ok(ticks)
}

/// Gives ticks to the image's controller, built from this preset. Every output must be the
/// recorded one to the bit.
///
/// # Errors
/// [`CyclesError::Differs`] at the first tick that the image answers otherwise.
pub fn replay(
    image: &mut Image,
    preset: Preset,
    ticks: &[Recorded],
    skips: bool,
    mut note: impl FnMut(&Recorded, &dyn Fn(&mut Spread), Option<&dyn Fn(&mut Spread)>),
) -> Result<(), CyclesError> {
    let function = |image: &Image, name: &str| image.function(name);
    let (load, step) = (function(image, "tick_load")?, function(image, "tick_step")?);
    let (plan, save) = (function(image, "tick_plan")?, function(image, "tick_save")?);
    image.call(function(image, "tick_build")?, &[preset as u32])?;
    if !skips {
        image.call(function(image, "tick_skip_nothing")?, &[])?;
    }
    for (number, tick) in ticks.iter().enumerate() {
        image.put(ARGUMENTS, &tick.given.words())?;
        image.call(load, &[ARGUMENTS])?;
        let cost = image.call(step, &[])?.meter;
        let planned = image.call(plan, &[])?;
        let add = |spread: &mut Spread| spread.note(cost, number);
        let add_plan = |spread: &mut Spread| spread.note(planned.meter, number);
        note(tick, &add, if planned.value != 0 { Some(&add_plan) } else { None });
        image.call(save, &[ANSWERS])?;
        if Taken::from_words(image.get(ANSWERS)?) != tick.taken {
            return Err(CyclesError::Differs(number));
        }
    }
    Ok(())
}

/// Measures the control tick over a deployment and a retraction of a preset's scenario.
///
/// # Errors
/// [`CyclesError`] if it cannot be run, or host and core differ.
pub fn tick(image: &mut Image, scenario: &Scenario) -> Result<TickCycles, CyclesError> {
    let preset = Preset::named(&scenario.preset).unwrap_or(Preset::Prototype);
    let mut cycles = TickCycles::default();
    for direction in [Direction::Deploy, Direction::Retract] {
        let mut scenario = scenario.clone();
        scenario.run.direction = direction;
        let ticks = record(&scenario)?;
        replay(image, preset, &ticks, true, |tick, add, add_plan| {
            add(&mut cycles.tick);
            if tick.smooth {
                add(&mut cycles.smooth);
            }
            if let Some(add) = add_plan {
                add(&mut cycles.plan);
            }
        })?;
        replay(image, preset, &ticks, false, |_, add, _| add(&mut cycles.without_skipping))?;
    }
    Ok(cycles)
}
