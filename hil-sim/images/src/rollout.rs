//! A rollout of the tread as words: its input, and its answer.

use interstage::model::rollout::{Run, roll};
use interstage::model::tread::{Axial, Tread, TreadState};
use interstage::units::{Direction, Q16};

use crate::tick::Preset;

/// The rig whose cycles are measured.
pub const PRESET: Preset = Preset::Prototype;

/// Arguments of a call. Numbers are bits of Q15.16.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Given {
    /// 0 deploys, 1 retracts.
    pub direction: u32,
    /// 1 if driven against `load`.
    pub driven: u32,
    /// Axial load, N.
    pub load: i32,
    /// Constant speed, mm/s, and radial force, N.
    pub speed: i32,
    /// See `speed`.
    pub force: i32,
    /// Position at which it begins and ends, from the face outwards, mm.
    pub from: i32,
    /// See `from`.
    pub until: i32,
}

impl Given {
    /// A run at nominal stiffness, whose axle moves as far as its tread.
    pub const fn of(run: &Run, speed: Q16, force: Q16) -> Self {
        let (driven, load) = match run.axial {
            Axial::Pushed => (0, Q16::ZERO),
            Axial::Driven(load) => (1, load),
        };
        Self {
            direction: run.direction as u32,
            driven,
            load: load.to_bits(),
            speed: speed.to_bits(),
            force: force.to_bits(),
            from: run.from.to_bits(),
            until: run.until.to_bits(),
        }
    }

    /// The words as memory holds them.
    pub const fn words(&self) -> [u32; 7] {
        let Self { direction, driven, load, speed, force, from, until } = *self;
        [direction, driven, load as u32, speed as u32, force as u32, from as u32, until as u32]
    }

    /// Gap of the crossing, bits of Q15.16, mm.
    pub fn gap(&self, tread: &Tread, state: &mut TreadState) -> i32 {
        let load = Axial::Driven(Q16::from_bits(self.load));
        let run = Run {
            direction: if self.direction == 0 { Direction::Deploy } else { Direction::Retract },
            axial: if self.driven == 0 { Axial::Pushed } else { load },
            scale: Q16::ONE,
            level: true,
            shear: None,
            from: Q16::from_bits(self.from),
            until: Q16::from_bits(self.until),
        };
        let course = (Q16::from_bits(self.speed), Q16::from_bits(self.force));
        roll(tread, state, &run, |_| course).lift.gap.to_bits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_lie_as_the_structure_does() {
        assert_eq!(size_of::<Given>(), size_of_val(&Given::default().words()));
        assert_eq!(core::mem::offset_of!(Given, until), 6 * 4);
    }
}
