//! Preload from the load cell between pre-tightener and arm.

use super::analog::AnalogChannel;
use crate::rig::{Rig, RigError};

/// Default time constant of the load cell's low-pass, s. Chosen: takes off a
/// millisecond's noise by a factor of three and costs the preload loop 5 ms beside
/// the 140 ms of its actuator.
pub const FILTER_S: f64 = 0.005;

/// The load cell: N, positive in compression; zero at 5 % of the converter, full
/// scale at 90 %.
///
/// Range: -7 N to 218 N at a full scale of 200 N, a code being 0.0036 N. Error: 2e-5
/// N and half a code, before the sensor's own.
pub fn load_cell(rig: &Rig, tau_s: f64) -> Result<AnalogChannel, RigError> {
    AnalogChannel::try_build(
        "sense.load_cell_full_scale_n",
        rig.sense.load_cell_full_scale_n,
        tau_s,
    )
}
