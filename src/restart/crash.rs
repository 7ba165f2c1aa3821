//! What stopped the program.

use serde::{Deserialize, Serialize};

use super::{CRASH_WORDS, MissedCheckIns, check};
use crate::units::Tick;

/// What stopped the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Stopped {
    /// A panic.
    #[error("a panic in line {line}, place {place:#x}")]
    Panic {
        /// Address of the place's description in the image.
        place: u32,
        /// Line in the source.
        line: u32,
    },
    /// A hard fault.
    #[error("a hard fault at {pc:#x} from {lr:#x}, CFSR {cfsr:#x}, HFSR {hfsr:#x}")]
    Fault {
        /// Instruction that faulted, 0 if the stack does not tell.
        pc: u32,
        /// Where it would have returned to, 0 likewise.
        lr: u32,
        /// Configurable fault status register.
        cfsr: u32,
        /// Hard fault status register.
        hfsr: u32,
    },
    /// The watchdog was no longer fed.
    #[error("{} did not come, at {pc:#x} from {lr:#x}", missed.name())]
    Hang {
        /// Instruction at which the processor was.
        pc: u32,
        /// Its return address.
        lr: u32,
        /// Tasks that had not checked in.
        missed: MissedCheckIns,
        /// When the bridges were cut.
        at: Tick,
    },
    /// The supply fell too low.
    #[error("the supply fell too low")]
    Supply,
    /// A bit of the image had flipped.
    #[error("a bit of the image had turned over")]
    Image,
}

/// Record of a program that was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crash {
    /// First word of the image's hash, which identifies its addresses.
    pub build: u32,
    /// What stopped it.
    pub stopped: Stopped,
}

impl Crash {
    /// Seed of its check.
    const SEED: u32 = 0xF11E_0002;

    /// As words.
    pub fn seal(&self) -> [u32; CRASH_WORDS] {
        let (kind, [a, b, c, d]) = match self.stopped {
            Stopped::Panic { place, line } => (1, [place, line, 0, 0]),
            Stopped::Fault { pc, lr, cfsr, hfsr } => (2, [pc, lr, cfsr, hfsr]),
            Stopped::Hang { pc, lr, missed, at } => (3, [pc, lr, u32::from(missed.0), at]),
            Stopped::Supply => (4, [0; 4]),
            Stopped::Image => (5, [0; 4]),
        };
        let build = self.build;
        [kind, build, a, b, c, d, check(Self::SEED, &[kind, build, a, b, c, d])]
    }

    /// From words, if they are intact.
    pub fn open(words: &[u32; CRASH_WORDS]) -> Option<Self> {
        let [kind, build, a, b, c, d, sum] = *words;
        let stopped = match kind {
            1 => Stopped::Panic { place: a, line: b },
            2 => Stopped::Fault { pc: a, lr: b, cfsr: c, hfsr: d },
            3 => Stopped::Hang { pc: a, lr: b, missed: MissedCheckIns(c as u16), at: d },
            4 => Stopped::Supply,
            5 => Stopped::Image,
            _ => return None,
        };
        let sound = check(Self::SEED, &[kind, build, a, b, c, d]) == sum;
        sound.then_some(Self { build, stopped })
    }
}
