//! What the plant computed, by what the contact was doing.

use super::VirtualRig;
use crate::plant::ring::Work;

/// What the contact is doing, by what it costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Steady rolling on the continuous wall; the ring sleeps.
    Smooth,
    /// The ring is resolved on the continuous wall: before a step, behind one, or while
    /// load or speed change.
    Awake,
    /// A corner, a face or an edge bears on the wheel.
    Crossing,
}

/// All phases.
pub const PHASES: [Phase; 3] = [Phase::Smooth, Phase::Awake, Phase::Crossing];

impl Phase {
    /// Name for tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Smooth => "smooth wall",
            Self::Awake => "ring awake",
            Self::Crossing => "crossing",
        }
    }
}

/// What was computed in a phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhaseWork {
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Ring steps, heights tried on the ring, elements visited.
    pub ring: Work,
    /// Steady contacts computed node by node.
    pub steady_computed: u64,
    /// Heights tried on the tangent of one.
    pub steady_iterations: u64,
}

impl VirtualRig {
    /// What the contact did in the last step.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    fn present_phase(&self) -> Phase {
        let truth = &self.truth;
        let local = self.parameters.wall.local(truth.position_mm);
        let edge = || local.behind_mm < self.patch_mm(truth.height_mm - local.base_mm);
        if !truth.ring_awake {
            Phase::Smooth
        } else if truth.corner_n > 0.0 || edge() {
            Phase::Crossing
        } else {
            Phase::Awake
        }
    }

    /// What has been computed so far in each phase, in the order of [`PHASES`].
    pub fn phases(&self) -> &[PhaseWork; PHASES.len()] {
        &self.phases
    }

    /// Books under the present phase what was computed since the last call.
    pub(super) fn count(&mut self, dt_s: f64) {
        self.phase = self.present_phase();
        let phase = &mut self.phases[self.phase as usize];
        phase.simulated_s += dt_s;
        phase.ring += self.ring.take_work();
        let (computed, iterations) = self.steady.take_work();
        phase.steady_computed += computed;
        phase.steady_iterations += iterations;
    }
}
