//! Tread compression from the displacement sensor between arm and wheel.

use super::analog::AnalogChannel;
use crate::rig::{Rig, RigError};

/// Default time constant of the displacement sensor's low-pass, s. Chosen: as the
/// load cell's, so that both see a crossing with the same lag.
pub const FILTER_S: f64 = 0.005;

/// The displacement sensor: mm, positive as the tread is compressed; zero at 5 %
/// of the converter, full scale at 90 %.
///
/// Range: -0.17 mm to 5.4 mm at a full scale of 5 mm, a code being 9e-5 mm. Error:
/// 2e-5 mm and half a code, before the sensor's own.
pub fn tread(rig: &Rig, tau_s: f64) -> Result<AnalogChannel, RigError> {
    AnalogChannel::try_build("sense.tread_full_scale_mm", rig.sense.tread_full_scale_mm, tau_s)
}
