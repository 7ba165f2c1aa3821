//! The control tick and its planner, one call each.

use interstage::model::{Plan, Planner};
use interstage::params::ParameterSet;
use interstage::tick::{Controller, Input, Output, State};
use interstage_images::tick::{Given, Preset, Taken};

use super::slot::Slot;

static CONTROLLER: Slot<Controller> = Slot::new();
static PLANNER: Slot<Planner> = Slot::new();
static STATE: Slot<State> = Slot::new();
static INPUT: Slot<Input> = Slot::new();
static OUTPUT: Slot<Output> = Slot::new();
static PLAN: Slot<Plan> = Slot::new();

/// The set of a preset, as the firmware has it.
const fn set(preset: Preset) -> &'static [u8] {
    match preset {
        Preset::Prototype => include_bytes!(concat!(env!("OUT_DIR"), "/prototype.set")),
        Preset::Fe => include_bytes!(concat!(env!("OUT_DIR"), "/fe.set")),
    }
}

/// Controller and planner of a preset, and a state as after power-up. Returns 1 if
/// they can be read from its set.
#[unsafe(no_mangle)]
pub(super) extern "C" fn tick_build(preset: u32) -> u32 {
    let Some(preset) = Preset::ALL.into_iter().find(|p| *p as u32 == preset) else { return 0 };
    let Ok(set) = ParameterSet::open(set(preset)) else { return 0 };
    STATE.put(State::default);
    OUTPUT.put(Output::default);
    PLAN.take();
    CONTROLLER.put(Controller::default);
    PLANNER.put(Planner::default);
    let (Some(controller), Some(planner)) = (CONTROLLER.get(), PLANNER.get()) else { return 0 };
    let Ok(rest) = set.read_controller(controller) else { return 0 };
    u32::from(rest.read_planner(planner).is_ok())
}

/// Has the controller run every stage in every tick.
#[unsafe(no_mangle)]
pub(super) extern "C" fn tick_skip_nothing() {
    if let Some(controller) = CONTROLLER.get() {
        *controller = controller.clone().without_skipping();
    }
}

/// Takes the next tick's input from `given`, and the plan that waits.
#[unsafe(no_mangle)]
pub(super) extern "C" fn tick_load(given: &Given) {
    INPUT.put(|| given.input(PLAN.take()));
}

/// The control tick, as the motor task calls it.
#[unsafe(no_mangle)]
pub(super) extern "C" fn tick_step() {
    if let (Some(controller), Some(state), Some(input), Some(output)) =
        (CONTROLLER.get(), STATE.get(), INPUT.get(), OUTPUT.get())
    {
        controller.step_into(state, input, output);
    }
}

/// Answers the tick's request, if there is one; returns whether there was.
#[unsafe(no_mangle)]
pub(super) extern "C" fn tick_plan() -> u32 {
    let (Some(planner), Some(output)) = (PLANNER.get(), OUTPUT.get()) else { return 0 };
    let Some(request) = output.request else { return 0 };
    PLAN.put(|| planner.plan(&request));
    1
}

/// Writes what is looked at of the tick's output to `taken`.
#[unsafe(no_mangle)]
pub(super) extern "C" fn tick_save(taken: &mut Taken) {
    if let Some(output) = OUTPUT.get() {
        *taken = Taken::of(output);
    }
}
