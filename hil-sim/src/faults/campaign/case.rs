//! The faults of the matrix, and each at an instant of a run.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::twin::Twin;
use crate::faults::sets;
use crate::params::set_of;
use crate::scenario::injection::{CATALOGUE, Entry, HARDWARE, Injection, Kind, Target};
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
pub enum Case {
    /// One that is injected into the run.
    Injected(&'static Entry),
    /// A step that differs from the table.
    Step(&'static StepFault),
}

/// A step that differs from the table.
#[derive(Debug)]
pub struct StepFault {
    name: &'static str,
    /// What happens, in words.
    text: &'static str,
    /// The anomaly of the step of this number; an extra step is at this position, mm.
    anomaly: fn(u8, f64) -> StepAnomaly,
}

const STEP_FAULTS: [StepFault; 5] = [
    StepFault {
        name: "step early",
        text: "2 mm nearer to the stow end than the table says",
        anomaly: |step, _| StepAnomaly::Early { step, offset_mm: 2.0 },
    },
    StepFault {
        name: "step late",
        text: "2 mm farther out than the table says",
        anomaly: |step, _| StepAnomaly::Late { step, offset_mm: 2.0 },
    },
    StepFault {
        name: "step missing",
        text: "not there",
        anomaly: |step, _| StepAnomaly::Missing { step },
    },
    StepFault {
        name: "step doubled",
        text: "another one 15 mm behind it",
        anomaly: |_, position_mm| StepAnomaly::Extra { position_mm },
    },
    StepFault {
        name: "step higher",
        text: "1 mm higher than the table says",
        anomaly: |step, _| StepAnomaly::Higher { step, offset_mm: 1.0 },
    },
];

impl Case {
    /// Every fault of the matrix.
    pub fn all() -> Vec<Self> {
        let injected = CATALOGUE.iter().map(Self::Injected);
        injected.chain(STEP_FAULTS.iter().map(Self::Step)).collect()
    }

    /// Every fault of the matrix on the emulated board: those of software and of hardware. A
    /// model that does not answer is a task that hangs there, and a reset has its own causes.
    pub fn all_on_board() -> Vec<Self> {
        let software =
            CATALOGUE.iter().filter(|e| !matches!(e.target, Target::Model | Target::Reset));
        let injected = software.chain(HARDWARE).map(Self::Injected);
        injected.chain(STEP_FAULTS.iter().map(Self::Step)).collect()
    }

    /// Its name in the matrix.
    pub fn name(&self) -> String {
        match self {
            Self::Injected(entry) => format!("{} {}", entry.target.name(), entry.kind.name()),
            Self::Step(fault) => fault.name.to_owned(),
        }
    }

    /// Whether it resets the board, at once or by the watchdog.
    fn resets(&self) -> bool {
        matches!(self, Self::Injected(entry) if entry.target.resets_board(entry.kind))
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
        match self {
            Self::Injected(entry) if entry.unit.is_empty() => entry.text.to_owned(),
            Self::Injected(entry) => {
                format!("{}: {} {}", entry.text, entry.magnitude, entry.unit)
            }
            Self::Step(fault) => fault.text.to_owned(),
        }
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

    /// The scenario of an instant.
    pub(super) fn scenario(&self, base: &Scenario, twin: &Twin, instant: usize) -> Scenario {
        let mut scenario = base.clone();
        let mut random = ChaCha8Rng::seed_from_u64(base.run.seed ^ 0x00fa_017e);
        match self {
            Self::Injected(entry) => {
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
                    at_s =
                        (random.random_range(0.05..twin.started_s.max(0.1)) * 1e3).round() * 1e-3;
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
            }
            Self::Step(fault) => {
                let steps = &base.rig.rig.step_positions_mm;
                let step = random.random_range(0..steps.len().max(1));
                // In the widest room behind a step.
                let extra_mm = steps.last().map_or(40.0, |last| last + 15.0);
                scenario.run.anomalies = vec![(fault.anomaly)(step as u8 + 1, extra_mm)];
            }
        }
        scenario
    }
}
