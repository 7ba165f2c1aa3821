//! What follows from the state of the rig, and when its state means nothing any more.

use super::VirtualRig;
use crate::plant::balance::BalanceError;
use crate::plant::rolling;

impl VirtualRig {
    /// What follows from the state.
    pub(super) fn derive(&mut self) {
        let (ahead, above) = self.eccentric();
        let compression_mm = self.compression_mm();
        let truth = &mut self.truth;
        truth.compression_mm = compression_mm;
        truth.friction = self.parameters.friction_at(truth.position_mm);
        truth.radius_mm = self.parameters.wall_radius_mm - (truth.height_mm - above);
        truth.arm_rad = self.parameters.arm.angle(truth.radius_mm);
        let radius = self.parameters.ring.radius_mm;
        let local = self.parameters.wall.local(truth.position_mm + ahead);
        let base_mm = local.base_mm + local.root_mm;
        truth.root_clearance_mm = (local.ahead_mm < radius)
            .then(|| away(local.ahead_mm, truth.height_mm - base_mm) - radius);
        self.truth.preload_n = self.preload_now();
    }

    /// What the compression sensor looks at, mm.
    fn compression_mm(&self) -> f64 {
        if let Some(thickness_mm) = self.gauge_mm {
            return thickness_mm;
        }
        let (p, truth) = (&self.parameters, &self.truth);
        let mut depth = truth.depth_mm;
        if p.compression_patch > 0.0 {
            let carrying = if truth.ring_awake {
                self.ring.carrying_mm()
            } else {
                let height = truth.height_mm - self.base_mm;
                rolling::carrying_mm(&p.ring, height, self.rolled_mm_s)
            };
            depth += p.compression_patch * (carrying - depth);
        }
        depth + p.compression_compliance_mm_per_n * truth.preload_n
    }
}

/// Length of the hypotenuse, for lengths far from the ends of the range.
fn away(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// The rig left the set of states that mean something.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// No height of the wheel balances the radial forces.
    #[error("plant at {time_s:.3} s, {position_mm:.3} mm: {source}")]
    Balance { time_s: f64, position_mm: f64, source: BalanceError },
    /// A state is not a number.
    #[error("plant at {time_s:.3} s: {name} is not finite")]
    NotFinite { time_s: f64, name: &'static str },
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
            ("work", t.work_mj + t.friction_work_mj),
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
