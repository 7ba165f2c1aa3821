//! The schedule of one segment: from the present position over the next step.

use crate::rig::{Rig, RigError};

/// What the tick asks the model task for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanRequest {
    /// Numbers the requests, so that a late answer is told from a current one.
    pub sequence: u32,
}

/// Speed and preload for one segment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plan {
    /// Sequence of the request answered.
    pub sequence: u32,
}

/// The model side of the schedule; runs outside the tick.
#[derive(Clone, Debug)]
pub struct Planner {}

impl Planner {
    /// Turns a rig into machine units, once.
    ///
    /// # Errors
    /// [`RigError`] if a parameter is out of range.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        rig.validate()?;
        Ok(Self {})
    }

    /// Answers a request.
    #[must_use]
    pub fn plan(&self, request: &PlanRequest) -> Plan {
        Plan { sequence: request.sequence }
    }
}
