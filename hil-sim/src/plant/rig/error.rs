//! A rig whose state means nothing any more.

use super::VirtualRig;
use crate::plant::balance::BalanceError;

/// The rig left the set of states that mean something.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// No height of the wheel balances the radial forces.
    #[error("plant at {time_s:.3} s, {position_mm:.3} mm: {source}")]
    Balance {
        /// When, s.
        time_s: f64,
        /// Where, mm.
        position_mm: f64,
        /// Why.
        source: BalanceError,
    },
    /// A state is not a number.
    #[error("plant at {time_s:.3} s: {name} is not finite")]
    NotFinite {
        /// When, s.
        time_s: f64,
        /// Which state.
        name: &'static str,
    },
}

impl VirtualRig {
    /// Fails if a state is not finite.
    pub(super) fn check(&self) -> Result<(), PlantError> {
        let t = &self.truth;
        // Causes first, so that the name is that of the origin.
        let states = [
            ("tread speed", t.tread_mm_s),
            ("screw", self.preload.seat_n()),
            ("vibration", self.vibration_n),
            ("speed", t.speed_mm_s),
            ("position", t.position_mm),
            ("rotation", t.rotation_rad),
            ("height", t.height_mm),
            ("utilisation", t.utilisation),
            ("slip", t.slip_mm),
            ("work", t.work_mj + t.wear_mj),
        ];
        // One look at all of them: none finite makes the other finite again.
        if states.iter().map(|(_, value)| value * 0.0).sum::<f64>() == 0.0 {
            return Ok(());
        }
        match states.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((name, _)) => Err(PlantError::NotFinite { time_s: t.time_s, name }),
            None => Ok(()),
        }
    }
}
