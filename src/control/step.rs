//! One tick of the controller.

use crate::hal::MotorCommand;
use crate::log::Entry;
use crate::model::{Plan, PlanRequest};
use crate::rig::{Rig, RigError};
use crate::sense::raw::SensorFrame;
use crate::supervise::Command;
use crate::units::Tick;

/// Most log entries one tick can give.
pub const EVENTS_PER_TICK: usize = 8;

/// What a tick is given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Input {
    /// Time.
    pub now: Tick,
    /// Latest code of each sensor.
    pub sensors: SensorFrame,
    /// Operator command since the last tick.
    pub command: Option<Command>,
    /// Answer to an earlier [`Output::request`].
    pub plan: Option<Plan>,
}

/// What a tick gives.
#[derive(Clone, Debug)]
pub struct Output {
    /// Drive bridge.
    pub drive: MotorCommand,
    /// Pre-tightener bridge.
    pub preload: MotorCommand,
    /// Work for the model task: the schedule of the segment ahead.
    pub request: Option<PlanRequest>,
    /// What happened.
    pub events: heapless::Vec<Entry, EVENTS_PER_TICK>,
    /// State after the tick.
    pub telemetry: crate::log::Telemetry,
}

/// The controller's configuration in machine units; its state is apart.
#[derive(Clone, Debug)]
pub struct Controller {}

/// What the controller remembers between ticks.
#[derive(Clone, Debug, Default)]
pub struct State {}

impl Controller {
    /// Turns a rig into machine units, once.
    ///
    /// # Errors
    /// [`RigError`] if a parameter is out of range or does not fit the others.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        rig.validate()?;
        Ok(Self {})
    }

    /// One tick.
    pub fn step(&self, _state: &mut State, _input: &Input) -> Output {
        unimplemented!()
    }
}
