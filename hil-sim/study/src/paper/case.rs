//! Speed, preload and loads of a crossing, and the rig that is run with them.

use interstage::rig::Rig;

use crate::reference::beam::BeamError;
use crate::reference::vibration::{self, MODES, Modal};
use hil_sim::plant::arm::Arm;
use hil_sim::scenario::{ControllerKind, Scenario};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Loads {
    /// Of its theory and finite elements: 60 N on top, 100 N and more of preload.
    Fe,
    /// Of its rig: a third of that.
    Prototype,
}

impl Loads {
    /// The rig with these loads.
    pub(super) fn rig(self) -> Rig {
        match self {
            Self::Fe => Rig::fe(),
            Self::Prototype => Rig::prototype(),
        }
    }
}

/// A deployment at constant speed and preload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    pub(super) loads: Loads,
    /// Axial speed, mm/s.
    pub speed_mm_s: f64,
    /// Radial preload, N.
    pub preload_n: f64,
}

impl Case {
    pub(super) const fn new(loads: Loads, speed_mm_s: f64, preload_n: f64) -> Self {
        Self { loads, speed_mm_s, preload_n }
    }

    /// Speed and preload as text.
    pub(super) fn name(&self) -> String {
        format!("{} mm/s, {} N", self.speed_mm_s, self.preload_n)
    }

    /// Axial load that this wheel lifts, N.
    pub(super) fn load_n(&self) -> f64 {
        let plant = self.loads.rig().plant;
        plant.top_load_n * plant.top_load_share
    }

    /// Arm, and the radius of a wheel on sleeve `level`, mm.
    fn arm(&self, level: usize) -> (Arm, f64) {
        let rig = self.loads.rig();
        let step = rig.rig.step_height_mm;
        let centre = rig.rig.wall_radius_mm - rig.rig.wheel_radius_mm - step * level as f64;
        (Arm::of(&rig), centre)
    }

    /// Radial force on a wheel that lifts its load from sleeve `level`, N: the preload,
    /// and what the inclined arm makes of the thrust.
    pub(super) fn pressing_n(&self, level: usize) -> f64 {
        let (arm, centre) = self.arm(level);
        self.preload_n + arm.thrust_ratio(centre) * self.load_n()
    }

    /// The deployment of the rig that `seed` draws: this preload and speed
    /// throughout, with room above the preload for its loop.
    pub(super) fn scenario(&self, seed: u64) -> Scenario {
        let mut scenario = Scenario { rig: self.loads.rig(), ..Scenario::default() };
        scenario.preset = if self.loads == Loads::Fe { "fe" } else { "prototype" }.to_owned();
        let preload = &mut scenario.rig.preload;
        preload.cruise_n = self.preload_n;
        preload.limit_n = preload.limit_n.max(1.25 * self.preload_n);
        scenario.rig.drive.cruise_speed_mm_s = self.speed_mm_s;
        // The safe speed may not lie above it; nothing here asks for a reference gap.
        let safe = &mut scenario.rig.control.safe_speed_mm_s;
        *safe = safe.min(self.speed_mm_s);
        scenario.run.controller = ControllerKind::Constant;
        scenario.run.seed = seed;
        scenario
    }
}

/// The arm on each sleeve: the reference's, bent by the part of the collision force that
/// lies across it.
#[derive(Clone, Debug)]
pub(super) struct Arms {
    arm: vibration::Arm,
    /// Sine of its angle from the pillar, by level.
    across: [f64; 3],
}

impl Arms {
    /// The arm of a case.
    pub(super) fn of(case: &Case) -> Result<Self, BeamError> {
        let across = std::array::from_fn(|level| {
            let (arm, centre) = case.arm(level);
            arm.angle(centre).sin()
        });
        Ok(Self { arm: vibration::Arm::of(&case.loads.rig())?, across })
    }

    /// Force across the arm of a collision force from sleeve `level`, N.
    pub(super) fn across_n(&self, level: usize, collision_n: f64) -> f64 {
        self.across[level.min(2)] * collision_n
    }

    /// Deflection under a static collision force, mm.
    pub(super) fn static_mm(&self, level: usize, collision_n: f64) -> f64 {
        1e3 * self.arm.compliance_m_per_n() * self.across_n(level, collision_n)
    }

    /// Its motion.
    pub(super) fn modal(&self) -> Result<Modal, BeamError> {
        self.arm.modal(MODES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenarios_are_valid() {
        for case in [Case::new(Loads::Fe, 3.0, 120.0), Case::new(Loads::Prototype, 8.0, 50.0)] {
            let scenario = case.scenario(7);
            scenario.validate().unwrap();
            interstage::model::Planner::try_build(&scenario.rig).unwrap();
            assert_eq!(scenario.rig.preload.cruise_n, case.preload_n);
        }
    }

    #[test]
    fn the_arm_lies_flatter_and_presses_less_from_sleeve_to_sleeve() {
        let case = Case::new(Loads::Prototype, 5.0, 40.0);
        let pressing: Vec<f64> = (0..3).map(|level| case.pressing_n(level)).collect();
        assert!(pressing.windows(2).all(|pair| pair[1] < pair[0]), "{pressing:?}");
        assert!((pressing[0] - 40.0 - 1.05 * 20.0 / 3.0).abs() < 0.01, "{pressing:?}");
        let arms = Arms::of(&Case::new(Loads::Fe, 5.0, 100.0)).unwrap();
        let bent: Vec<f64> = (0..3).map(|level| arms.static_mm(level, 50.0)).collect();
        assert!(bent.windows(2).all(|pair| pair[1] < pair[0]), "{bent:?}");
        // 50 N sin(46.4 deg) on a cantilever of 145 mm.
        assert!((bent[0] / (36.2 * 0.145_f64.powi(3) / (3.0 * 244.69) * 1e3) - 1.0).abs() < 1e-3);
    }
}
