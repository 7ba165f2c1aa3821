//! Where the wheel is, and what its tread remembers.

use super::relaxation::Stride;
use crate::numeric::high;

/// An element: memory and depth at the last stride's end, mm, Q22.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) memory: i32,
    pub(super) depth: i32,
}

/// Places of neighbouring elements, from `low` to before `high`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Patch {
    pub(super) low: i32,
    pub(super) high: i32,
}

/// What the rays meet: the lower wall below `face`, the face from there on, the upper wall from
/// `top` on. And the places of the elements that touch the lower wall, and the step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Reach {
    pub(super) face: i32,
    pub(super) top: i32,
    /// From where on ahead the upper wall is out of reach.
    pub(super) upper: i32,
    pub(super) floor: Patch,
    pub(super) step: Patch,
}

/// The wheel's place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Frame {
    /// Axial position of the centre from the face, and its height over the lower wall, mm, Q22.
    pub(super) position: i32,
    pub(super) centre: i32,
    /// Change of the height in the last stride, mm, Q22.
    pub(super) climb: i32,
    /// Element straight down.
    bottom: i32,
}

/// State of a rolling tread of this many elements, a power of two: 2 kB as shipped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PitchedState<const ELEMENTS: usize> {
    pub(super) frame: Frame,
    pub(super) elements: Elements<ELEMENTS>,
    /// The rubber at the corner, about which the wheel pivots.
    pub(super) corner: Element,
    pub(super) reach: Reach,
}

/// Elements in the order of the tread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Elements<const COUNT: usize>([Element; COUNT]);

impl<const ELEMENTS: usize> Default for PitchedState<ELEMENTS> {
    fn default() -> Self {
        Self {
            frame: Frame::default(),
            elements: Elements([Element::default(); ELEMENTS]),
            corner: Element::default(),
            reach: Reach::default(),
        }
    }
}

impl Element {
    /// After a stride to this depth.
    #[inline(always)]
    pub(super) fn pressed(self, depth: i32, stride: &Stride) -> Self {
        let memory = high(self.memory, stride.keeps)
            + high(depth, stride.takes)
            + high(self.depth, stride.took);
        Self { memory: memory << 1, depth }
    }
}

impl<const COUNT: usize> Elements<COUNT> {
    /// The element of this number, which counts on around the tread.
    #[inline(always)]
    pub(super) const fn at(&self, number: usize) -> &Element {
        &self.0[number % COUNT]
    }

    /// See [`Self::at`].
    #[inline(always)]
    pub(super) const fn at_mut(&mut self, number: usize) -> &mut Element {
        &mut self.0[number % COUNT]
    }
}

impl Frame {
    /// Number of the element at a place.
    #[inline(always)]
    pub(super) const fn number(&self, place: i32) -> usize {
        self.bottom.wrapping_add(place) as usize
    }

    /// Rolls on by one element.
    pub(super) const fn turn(&mut self, forward: bool) {
        self.bottom = self.bottom.wrapping_add(if forward { 1 } else { -1 });
    }
}

impl Patch {
    /// The same part of the tread once the wheel has rolled on by one element.
    pub(super) const fn turned(self, forward: bool) -> Self {
        let by = if forward { -1 } else { 1 };
        Self { low: self.low + by, high: self.high + by }
    }

    /// What of it is before this place.
    pub(super) fn below(self, place: i32) -> Self {
        let high = self.high.min(place);
        Self { low: self.low.min(high), high }
    }

    /// What of it is at this place and after.
    pub(super) fn from(self, place: i32) -> Self {
        let low = self.low.max(place);
        Self { low, high: self.high.max(low) }
    }

    /// Whether the element at this place belongs to it.
    pub(super) const fn has(self, place: i32) -> bool {
        self.low <= place && place < self.high
    }
}
