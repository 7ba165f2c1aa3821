//! The faults of the matrix, and each at an instant of a run.

use interstage::rig::Geometry;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::twin::Twin;
use crate::faults::sets;
use crate::params::set_of;
use crate::plant::wall::touch_mm;
use crate::scenario::injection::{CATALOGUE, Entry, HARDWARE, Injection, Kind, STEPS, Target};
use crate::scenario::{Scenario, StepAnomaly};

/// Duration of an interrupt storm, s: longer than the watchdog waits, and finite, so that the
/// board comes up again to report.
const STORM_S: f64 = 0.25;
/// Duration of random commands, s.
const COMMANDS_S: f64 = 1.0;

/// Times for which a debugger halts the core, ms: a read of memory, an attachment, a look.
const HALTS_MS: [f64; 4] = [5.0, 1.0, 50.0, 500.0];

/// Currents that a bridge regulates, parts of that at standstill and full duty: the prescribed
/// one first, and the least that the readback allows.
const LIMITS: [f64; 4] = [0.5, 0.25, 0.75, 0.5];

/// A fault of the matrix.
#[derive(Clone, Copy, Debug)]
pub struct Case(pub &'static Entry);

impl Case {
    /// Every fault of the matrix.
    pub fn all() -> Vec<Self> {
        CATALOGUE.iter().chain(STEPS).map(Self).collect()
    }

    /// Every fault of the matrix on the emulated board: those of software and of hardware. A
    /// model that does not answer is a task that hangs there, and a reset has its own causes.
    pub fn all_on_board() -> Vec<Self> {
        let software =
            CATALOGUE.iter().filter(|e| !matches!(e.target, Target::Model | Target::Reset));
        software.chain(HARDWARE).chain(STEPS).map(Self).collect()
    }

    /// Its name in the matrix.
    pub fn name(&self) -> String {
        format!("{} {}", self.0.target.name(), self.0.kind.name())
    }

    /// Whether it resets the board, at once or by the watchdog.
    fn resets(&self) -> bool {
        self.0.target.resets_board(self.0.kind)
    }

    /// Whether the name of the fault contains one of these, or there are none; `reset` is
    /// every reset.
    pub fn is_one_of(&self, wanted: &[String]) -> bool {
        wanted.is_empty()
            || wanted
                .iter()
                .any(|text| self.name().contains(text) || text == "reset" && self.resets())
    }

    /// What happens, in words.
    pub(crate) fn text(&self) -> String {
        let Entry { text, magnitude, unit, .. } = self.0;
        if unit.is_empty() { (*text).to_owned() } else { format!("{text}: {magnitude} {unit}") }
    }

    /// The sign or direction of the measure by the number of the instant.
    fn magnitude(entry: &Entry, instant: usize) -> f64 {
        let other = instant % 4 >= 2;
        match entry.kind {
            Kind::Gain if other => 1.0 / entry.magnitude,
            Kind::Offset | Kind::Runaway if other => -entry.magnitude,
            // One bit of the word, which the parity shows, or two, which it does not.
            Kind::BitErrors => f64::from((1 + 2 * u16::from(other)) << (instant % 14)),
            Kind::Stuck if entry.target.is_hardware() && !entry.unit.is_empty() => {
                [entry.magnitude, 0.0, 12_000.0, 65_535.0][instant % 4]
            }
            Kind::Halted => HALTS_MS[instant % 4],
            Kind::Regulating => LIMITS[instant % 4],
            _ => entry.magnitude,
        }
    }

    /// The measure of a fault of stored parameters: a random bit, every fourth time of the
    /// seal and length, or a random operation of the flash.
    fn measure(
        entry: &Entry,
        base: &Scenario,
        instant: usize,
        random: &mut ChaCha8Rng,
    ) -> Option<f64> {
        let stored = entry.target != Target::ImageSet;
        let set = set_of(if stored { sets::KEPT } else { "prototype" }, &base.rig).ok()?;
        let number = match entry.kind {
            Kind::BitErrors if stored && instant % 4 == 1 => {
                random.random_range(0..sets::PREFIX_BITS)
            }
            Kind::BitErrors | Kind::TwoWrongBits => {
                random.random_range(0..sets::bits(set.len(), stored))
            }
            _ => random.random_range(1..=sets::operations(set.len())),
        };
        Some(f64::from(number))
    }

    /// Such a difference of a random step of this rig.
    fn anomaly(entry: &Entry, rig: &Geometry, random: &mut ChaCha8Rng) -> StepAnomaly {
        let steps = &rig.step_positions_mm;
        let step = random.random_range(0..steps.len().max(1)) as u8 + 1;
        let of = |mm: f64| entry.magnitude * mm;
        let offset_mm = of(rig.step_tolerance_mm);
        match entry.kind {
            Kind::Early => StepAnomaly::Early { step, offset_mm },
            Kind::Late => StepAnomaly::Late { step, offset_mm },
            Kind::Missing => StepAnomaly::Missing { step },
            Kind::Higher => StepAnomaly::Higher { step, offset_mm: of(rig.step_height_mm) },
            // In the widest room behind a step.
            _ => StepAnomaly::Extra {
                position_mm: steps.last().map_or(0.5 * rig.travel_mm, |last| {
                    last + of(touch_mm(rig.wheel_radius_mm, rig.step_height_mm))
                }),
            },
        }
    }

    /// The scenario of an instant.
    pub(super) fn scenario(&self, base: &Scenario, twin: &Twin, instant: usize) -> Scenario {
        let mut scenario = base.clone();
        let mut random = ChaCha8Rng::seed_from_u64(base.run.seed ^ 0x00fa_017e);
        let entry = self.0;
        if entry.target == Target::Step {
            scenario.run.anomalies = vec![Self::anomaly(entry, &base.rig.rig, &mut random)];
            return scenario;
        }
        let mut at_s = twin.instant(instant, &mut random);
        let mut magnitude = Self::magnitude(entry, instant);
        if entry.target == Target::OptionBytes {
            // The chip loads them at its start.
            at_s = 0.0;
        } else if entry.target.is_of_sets() {
            magnitude = Self::measure(entry, base, instant, &mut random).unwrap_or(1.0);
            // One of three before the board starts.
            at_s = if instant.is_multiple_of(3) { 0.0 } else { at_s };
        }
        if self.resets() && instant % 4 == 3 {
            // In the start of the board.
            at_s = (random.random_range(0.05..twin.started_s.max(0.1)) * 1e3).round() * 1e-3;
        }
        if entry.target == Target::Image {
            magnitude = random.random_range(entry.range.0..=entry.range.1).floor();
        }
        let mut fault = Injection::at(entry.target, entry.kind, at_s, magnitude);
        // Random commands and interrupts have an end.
        fault.duration_s = match entry.target {
            Target::Commands => Some(COMMANDS_S),
            Target::Interrupt => Some(STORM_S),
            _ => None,
        };
        scenario.run.faults = vec![fault];
        scenario
    }
}
