//! Cycles of the measuring image's functions, which are built like the firmware's.

use interstage::estimate::ContactStage;
use interstage::supervise::{Leg, Mode};
use interstage::tick::Input;
use interstage_images::tick::{Given, Preset, Taken};
use serde::{Deserialize, Serialize};

use crate::core::Meter;
use crate::error::ImageError;
use crate::image::{ARGUMENTS, Image};
use crate::spread::Spread;
use hil_sim::scenario::{Direction, Scenario};
use hil_sim::session::{Options, RunError, RunningRig, Session, is_over, longest_s, once};

/// Package and binary of the measuring image.
pub const IMAGE: (&str, &str) = ("interstage-images", "measure");

/// Address at which the image writes its outputs.
const ANSWERS: u32 = ARGUMENTS + 0x1000;

/// A step of a script.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Step {
    /// Writes words to the memory of arguments by reference.
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

/// Result of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Done {
    /// Return value of each call.
    pub values: Vec<u32>,
    pub cost: Spread,
}

/// Carries out the steps of a script.
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

/// Why the tick cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum CyclesError {
    /// The run in software cannot be made.
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Image(#[from] ImageError),
    #[error("tick {0} differs between host and core")]
    Differs(usize),
}

/// Cycles of the control tick over complete runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TickCycles {
    pub tick: Spread,
    /// Ticks on the continuous wall, no step inside the horizon.
    pub smooth: Spread,
    /// Every tick, with every stage executed.
    pub without_skipping: Spread,
    /// The planner's answers between ticks.
    pub plan: Spread,
}

/// A tick of a run in software.
#[derive(Clone, Copy, Debug)]
pub struct Recorded {
    /// Input of the controller; the image computes the plan again.
    pub given: Given,
    /// Its output, as far as it is compared.
    pub taken: Taken,
    /// Whether the drive was in cruise on the continuous wall.
    pub smooth: bool,
}

/// Runs a scenario in software and records each tick.
pub fn record(scenario: &Scenario) -> Result<Vec<Recorded>, RunError> {
    let mut session = Session::new(scenario, Options::default())?;
    let (mut operator, mut ticks) = (once(scenario.run.direction), Vec::new());
    while !is_over(session.mode()) && session.time_s() < longest_s(&scenario.rig) {
        let (command, sensors) = (operator(session.mode()), session.sense());
        let now = ticks.len() as u32;
        let given = Given::of(&Input { now, sensors, command, ..Input::default() });
        let output = session.advance(&sensors, command)?;
        let smooth = matches!(output.telemetry.mode, Mode::Run(_, Leg::Cruise))
            && output.telemetry.stage == ContactStage::Continuous;
        ticks.push(Recorded { given, taken: Taken::of(&output), smooth });
    }
    Ok(ticks)
}

/// Cost of a replayed tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickCost {
    /// Of the control tick.
    pub step: Meter,
    /// Of the planner's answer, if the tick requested one.
    pub plan: Option<Meter>,
}

/// Replays ticks on the image's controller, built from this preset. Every output must equal
/// the recorded one to the bit.
pub fn replay(
    image: &mut Image,
    preset: Preset,
    ticks: &[Recorded],
    skips: bool,
) -> Result<Vec<TickCost>, CyclesError> {
    let (load, step) = (image.function("tick_load")?, image.function("tick_step")?);
    let (plan, save) = (image.function("tick_plan")?, image.function("tick_save")?);
    image.call(image.function("tick_build")?, &[preset as u32])?;
    if !skips {
        image.call(image.function("tick_skip_nothing")?, &[])?;
    }
    let mut costs = Vec::with_capacity(ticks.len());
    for (number, tick) in ticks.iter().enumerate() {
        image.put(ARGUMENTS, &tick.given.words())?;
        image.call(load, &[ARGUMENTS])?;
        let step = image.call(step, &[])?.meter;
        let planned = image.call(plan, &[])?;
        image.call(save, &[ANSWERS])?;
        if Taken::from_words(image.get(ANSWERS)?) != tick.taken {
            return Err(CyclesError::Differs(number));
        }
        costs.push(TickCost { step, plan: (planned.value != 0).then_some(planned.meter) });
    }
    Ok(costs)
}

/// Measures the control tick over a deployment and a retraction of a preset's scenario.
pub fn tick(image: &mut Image, scenario: &Scenario) -> Result<TickCycles, CyclesError> {
    let preset = Preset::named(&scenario.preset).unwrap_or(Preset::Prototype);
    let mut cycles = TickCycles::default();
    for direction in [Direction::Deploy, Direction::Retract] {
        let mut scenario = scenario.clone();
        scenario.run.direction = direction;
        let ticks = record(&scenario)?;
        let costs = replay(image, preset, &ticks, true)?;
        for (number, (tick, cost)) in ticks.iter().zip(costs).enumerate() {
            cycles.tick.note(cost.step, number);
            if tick.smooth {
                cycles.smooth.note(cost.step, number);
            }
            if let Some(plan) = cost.plan {
                cycles.plan.note(plan, number);
            }
        }
        for (number, cost) in replay(image, preset, &ticks, false)?.into_iter().enumerate() {
            cycles.without_skipping.note(cost.step, number);
        }
    }
    Ok(cycles)
}
