//! From readings to the state of motion and contact: where the wheel is on its travel, which
//! steps are behind it, and what carries it.

mod close;
pub mod crossing;
mod follow;
mod landing;
pub mod odometry;
mod position;
mod restore;
mod run;
mod slip;
mod stage;
mod state;
mod steps;
pub mod tread;
pub mod vibration;
mod wind_up;

use crate::model::corner_profile::CornerProfile;
use crate::numeric::{LowPass, checked};
use crate::rig::{Rig, RigError};
use crossing::CrossingWatch;
use tread::Tread;
use wind_up::Pulls;

pub use follow::Follow;
pub use position::{Place, Position, PositionConfidence};
pub use slip::CornerSlip;
pub use stage::ContactStage;
pub use state::{EstimateState, Findings, LiftPoint, OpenCrossing, Slip};
pub use steps::{Expectation, Steps};
pub use tread::Shown;

use crate::units::{Millimetres, Ratio};

/// Wheel travel on a corner over the wheel radius beyond which the wheel slips: twice the
/// travel of a crossing.
const CORNER_TRAVEL_PART: f64 = 1.5;

/// Least distance from an edge at which the wheel's height tells it, over the wheel radius.
const TELLING_PART: f64 = 0.25;

/// Part of the compression by which a loaded rubber wheel rolls on less than its undeformed
/// radius (Clark, Mechanics of Pneumatic Tires).
const ROLLING_COMPRESSION: f64 = 1.0 / 3.0;

/// Time constant of the preload's memory over the relaxation time of the tread.
const MEMORY_PART: f64 = 0.6;

/// The estimator of a rig; its state is apart.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimator {
    watch: CrossingWatch,
    tread: Tread,
    steps: Steps,
    /// Tread in a stride of the history, mm.
    stride: Millimetres,
    /// Low-pass of the preload as the tread's memory makes it.
    memory: LowPass,
    /// Wheel travel on a corner beyond which the wheel slips, mm.
    corner_travel: Millimetres,
    /// Least distance from an edge at which the wheel's height tells it, mm.
    telling: Millimetres,
    /// Part by which the axle lags behind the tread per compression, 1/mm.
    rolling_lag: Ratio,
    /// The same of a wheel in the middle of its life.
    worn: Ratio,
    pulls: Pulls,
}

impl Estimator {
    /// The estimator of a rig; fails where a parameter is out of range.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        Ok(Self {
            watch: CrossingWatch::try_build(rig)?,
            tread: Tread::try_build(rig)?,
            steps: Steps::try_build(rig)?,
            stride: crate::model::tread::Tread::try_build(rig)?.stride(),
            memory: LowPass::build(MEMORY_PART * rig.tread.tau_s),
            corner_travel: checked(
                "rig.wheel_radius_mm",
                CORNER_TRAVEL_PART * rig.rig.wheel_radius_mm,
            )?,
            telling: checked("rig.wheel_radius_mm", TELLING_PART * rig.rig.wheel_radius_mm)?,
            rolling_lag: checked(
                "rig.wheel_radius_mm",
                ROLLING_COMPRESSION / rig.rig.wheel_radius_mm,
            )?,
            worn: checked(
                "rig.wheel_wear_mm",
                0.5 * rig.rig.wheel_wear_mm / rig.rig.wheel_radius_mm,
            )?,
            pulls: Pulls::try_build(rig)?,
        })
    }

    /// Step table and end of travel.
    pub const fn steps(&self) -> &Steps {
        &self.steps
    }

    /// Geometry of a corner.
    pub const fn corner(&self) -> &CornerProfile {
        self.steps.corner()
    }
}

#[cfg(test)]
pub(crate) use restore::tests::sensed;
