//! One call of the reduced model as words.

use interstage::model::reduced::{Point, ReducedModel, Scale};
use interstage::units::{Direction, Q16, q16};

/// What a call of the model is given: Q15.16 bits, in the units of [`Point`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Given {
    /// Index into [`Direction::ALL`].
    pub direction: u32,
    /// Speed at lift-off, mm/s.
    pub speed: i32,
    /// Stiffness scale.
    pub scale: i32,
    /// Gap, mm, for the inverse.
    pub gap: i32,
    /// Radial force, N, for forward and for the speed.
    pub force: i32,
}

/// Lowest and highest speed that [`inverse_speed`] looks between, mm/s.
const SPEEDS: [Q16; 2] = [q16(1_000_000), q16(100_000_000)];

/// A function of the model that can be measured: its symbol in the image, and what it
/// computes.
pub type Function = (&'static str, fn(&ReducedModel, Scale, &Given) -> i32);

/// Symbol of what makes the scale of a call's tread beforehand: it changes once a crossing
/// and is used many times.
pub const PREPARE: &str = "model_scale";

/// Every function.
pub const FUNCTIONS: [Function; 3] = [
    ("model_forward", forward),
    ("model_inverse_preload", inverse_preload),
    ("model_inverse_speed", inverse_speed),
];

impl Given {
    /// Scale of the tread's stiffness.
    #[must_use]
    pub fn scale(&self) -> Scale {
        Scale::new(Q16::from_bits(self.scale))
    }

    fn point(&self, scale: Scale) -> Point {
        Point {
            direction: if self.direction == 1 { Direction::Retract } else { Direction::Deploy },
            speed: Q16::from_bits(self.speed),
            scale,
        }
    }

    /// The words as the image's memory holds them.
    #[must_use]
    pub const fn words(&self) -> [u32; 5] {
        let Self { direction, speed, scale, gap, force } = *self;
        [direction, speed as u32, scale as u32, gap as u32, force as u32]
    }
}

/// Gap under a force, mm.
#[must_use]
pub fn forward(model: &ReducedModel, scale: Scale, given: &Given) -> i32 {
    model.gap(&given.point(scale), Q16::from_bits(given.force)).to_bits()
}

/// Force for a gap, N.
#[must_use]
pub fn inverse_preload(model: &ReducedModel, scale: Scale, given: &Given) -> i32 {
    model.force(&given.point(scale), Q16::from_bits(given.gap)).to_bits()
}

/// Speed at which a force holds a gap, mm/s.
#[must_use]
pub fn inverse_speed(model: &ReducedModel, scale: Scale, given: &Given) -> i32 {
    let (gap, force) = (Q16::from_bits(given.gap), Q16::from_bits(given.force));
    let [floor, ceiling] = SPEEDS;
    model.speed(&given.point(scale), gap, force, floor, ceiling).to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_lie_as_the_structure_does() {
        assert_eq!(size_of::<Given>(), size_of_val(&Given::default().words()));
        assert_eq!(core::mem::offset_of!(Given, force), 4 * 4);
    }

    #[test]
    fn the_inverse_undoes_the_forward() {
        let rig = interstage::rig::Rig::prototype();
        let model = ReducedModel::try_build(&rig).unwrap();
        let one = 1 << 16;
        let given = Given { speed: 8 * one, scale: one, force: 40 * one, ..Given::default() };
        let gap = forward(&model, Scale::NOMINAL, &given);
        let force = inverse_preload(&model, Scale::NOMINAL, &Given { gap, ..given });
        assert!((force - given.force).abs() < one / 20, "{force}");
        let speed = inverse_speed(&model, Scale::NOMINAL, &Given { gap, ..given });
        assert!((speed - given.speed).abs() < one / 20, "{speed}");
    }
}
