//! Which stages of the control tick run in which phase, with their share of its cycles
//! on the emulated core, and what it would cost to run them all in every tick. The
//! outputs are the same to the bit.

use serde::Serialize;

/// Parts of the source that the tick's cycles go to.
pub const STAGES: [&str; 8] = [
    "senses",
    "odometry, contact",
    "vibration observer",
    "supervision",
    "schedule, profile",
    "loops",
    "tick, telemetry",
    "primitives",
];

/// The part of the source that a function belongs to, as an index into [`STAGES`]; what
/// is inlined counts where it comes from.
#[must_use]
pub fn stage(function: &str) -> usize {
    let of = [
        ("interstage::sense::", 0),
        ("interstage::estimate::vibration", 2),
        ("interstage::estimate::", 1),
        ("interstage::supervise::", 3),
        ("interstage::control::schedule", 4),
        ("interstage::control::profile", 4),
        ("interstage::model::corner_profile", 4),
        ("interstage::model::timing", 4),
        ("interstage::control::speed_loop", 5),
        ("interstage::control::preload_loop", 5),
        ("interstage::tick::", 6),
        ("interstage::log::", 6),
        ("interstage::tasks::", 6),
    ];
    let name = function.trim_start_matches('<');
    of.into_iter().find(|(path, _)| name.starts_with(path)).map_or(7, |(_, stage)| stage)
}

/// The tick in one phase.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhaseCycles {
    /// Mode and contact stage.
    pub phase: String,
    /// Whether it is under way on the smooth wall.
    pub smooth: bool,
    /// Ticks.
    pub ticks: u64,
    /// Mean cycles of a tick.
    pub mean: f64,
    /// Cycles of the dearest.
    pub most: u64,
    /// Mean cycles by stage, in the order of [`STAGES`].
    pub stages: [f64; STAGES.len()],
    /// Mean cycles with nothing skipped.
    pub mean_whole: f64,
}

/// The account of a deployment and a retraction on the emulated core.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Firmware {
    /// Names of the stages.
    pub stages: [&'static str; STAGES.len()],
    /// By phase.
    pub phases: Vec<PhaseCycles>,
    /// Mean cycles of a tick over both runs.
    pub mean: f64,
    /// The same with nothing skipped.
    pub mean_whole: f64,
    /// Cycles of the dearest tick.
    pub most: u64,
    /// Cycles of the dearest answer of the planner, between the ticks.
    pub plan_most: u64,
}

impl Firmware {
    /// Cycles of the dearest tick on the smooth wall.
    #[must_use]
    pub fn smooth_most(&self) -> u64 {
        self.phases.iter().filter(|phase| phase.smooth).map(|phase| phase.most).max().unwrap_or(0)
    }

    /// Part of the cycles of a tick that skipping saves on the smooth wall.
    #[must_use]
    pub fn smooth_saving(&self) -> f64 {
        let sum = |of: fn(&PhaseCycles) -> f64| -> f64 {
            let smooth = self.phases.iter().filter(|phase| phase.smooth);
            smooth.map(|phase| phase.ticks as f64 * of(phase)).sum()
        };
        1.0 - sum(|phase| phase.mean) / sum(|phase| phase.mean_whole)
    }

    /// Mean cycles in the busiest phase.
    #[must_use]
    pub fn busiest_mean(&self) -> f64 {
        self.phases.iter().map(|phase| phase.mean).fold(0.0, f64::max)
    }
}

/// Measures it, with the prototype's controller.
///
/// # Errors
/// If the image cannot be built, or core and host differ in a bit of the output.
#[cfg(feature = "board")]
pub fn measure() -> anyhow::Result<Firmware> {
    use hil_sim::firmware::{Profile, build_binary};
    use hil_sim::scenario::{Direction, Scenario};
    use rig_board::account::{Account, IMAGE};
    use rig_board::image::Image;

    let elf = build_binary(IMAGE.0, IMAGE.1, Profile::Release, &[])?;
    let mut image = Image::open(&elf)?;
    let (mut account, mut whole) = (Account::default(), Account::without_skipping());
    for direction in [Direction::Deploy, Direction::Retract] {
        let mut scenario = Scenario::default();
        scenario.run.direction = direction;
        account.add(&mut image, &scenario)?;
        whole.add(&mut image, &scenario)?;
    }
    let mut phases = Vec::new();
    for (cost, whole) in account.phases.iter().zip(&whole.phases) {
        let mut stages = [0.0; STAGES.len()];
        for share in account.profile(&image, &cost.phase)? {
            stages[stage(&share.function)] += share.cycles;
        }
        phases.push(PhaseCycles {
            phase: cost.phase.to_string(),
            smooth: cost.phase.is_smooth(),
            ticks: cost.tick.calls,
            mean: cost.tick.mean(),
            most: cost.tick.most,
            stages,
            mean_whole: whole.tick.mean(),
        });
    }
    Ok(Firmware {
        stages: STAGES,
        phases,
        mean: account.tick.mean(),
        mean_whole: whole.tick.mean(),
        most: account.tick.most,
        plan_most: account.plan.most,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_belong_to_the_stage_of_their_source() {
        for (function, expected) in [
            ("interstage::sense::speed::Speedometer::correct", "senses"),
            ("interstage::estimate::crossing::CrossingWatch::step", "odometry, contact"),
            ("interstage::estimate::vibration::VibrationObserver::step", "vibration observer"),
            ("interstage::control::schedule::Schedule::targets", "schedule, profile"),
            ("interstage::control::preload_loop::PreloadLoop::step", "loops"),
            ("interstage::tick::Controller::telemetry", "tick, telemetry"),
            ("<interstage::units::q16::Q16 as core::ops::arith::Mul>::mul", "primitives"),
            ("<interstage::supervise::mode::Mode as core::cmp::PartialEq>::eq", "supervision"),
            ("<i64 as core::cmp::Ord>::clamp", "primitives"),
            ("__aeabi_memcpy", "primitives"),
        ] {
            assert_eq!(STAGES[stage(function)], expected, "{function}");
        }
    }

    #[test]
    fn the_smooth_wall_and_the_busiest_phase_are_found() {
        let phase = |smooth: bool, mean: f64, most: u64| PhaseCycles {
            phase: String::new(),
            smooth,
            ticks: 1,
            mean,
            most,
            stages: [0.0; STAGES.len()],
            mean_whole: 1.25 * mean,
        };
        let firmware = Firmware {
            stages: STAGES,
            phases: vec![phase(false, 90.0, 900), phase(true, 20.0, 300), phase(true, 30.0, 400)],
            mean: 50.0,
            mean_whole: 60.0,
            most: 900,
            plan_most: 5000,
        };
        assert_eq!(firmware.smooth_most(), 400);
        assert_eq!(firmware.busiest_mean(), 90.0);
        assert!((firmware.smooth_saving() - 0.2).abs() < 1e-12);
    }
}
