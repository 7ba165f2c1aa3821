//! Where the wheel is, and what its tread remembers.

use crate::units::{Millimetres, Q16};

/// Elements of the state: a power of two, more than there are rays.
const ELEMENTS: usize = 256;

/// An element: memory and depth at the last stride's end, mm, Q22.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) memory: i32,
    pub(super) depth: i32,
}

/// Places of the elements of a patch, from `low` to before `high`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Patch {
    pub(super) low: i32,
    pub(super) high: i32,
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

/// State of a rolling tread: 2 kB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreadState {
    pub(super) frame: Frame,
    pub(super) elements: [Element; ELEMENTS],
    /// What touches the lower wall, and what touches face and upper wall.
    pub(super) patches: [Patch; 2],
}

impl Default for TreadState {
    fn default() -> Self {
        Self {
            frame: Frame::default(),
            elements: [Element::default(); ELEMENTS],
            patches: [Patch::default(); 2],
        }
    }
}

impl TreadState {
    /// Axial position of the centre from the face, outwards, mm.
    pub const fn position(&self) -> Millimetres {
        Q16::from_bits(self.frame.position >> 6)
    }

    /// A wheel off the wall.
    pub(super) fn clear(&mut self) {
        // In place: two kilobytes are never on the stack.
        self.frame = Frame::default();
        self.patches = [Patch::default(); 2];
        self.elements.fill(Element::default());
    }

    /// The element at a place.
    pub(super) fn element(&self, place: i32) -> Element {
        self.elements.get(self.frame.index(place)).copied().unwrap_or_default()
    }
}

impl Frame {
    /// Index of the element at a place.
    pub(super) const fn index(&self, place: i32) -> usize {
        self.bottom.wrapping_add(place).rem_euclid(ELEMENTS as i32) as usize
    }

    /// Rolls on by one element.
    pub(super) const fn turn(&mut self, forward: bool) {
        self.bottom = self.bottom.wrapping_add(if forward { 1 } else { -1 });
    }
}

impl Patch {
    /// The wheel has rolled on by one element.
    pub(super) const fn turn(&mut self, forward: bool) {
        let by = if forward { -1 } else { 1 };
        (self.low, self.high) = (self.low + by, self.high + by);
    }

    /// Whether the element at this place belongs to it.
    pub(super) const fn has(&self, place: i32) -> bool {
        self.low <= place && place < self.high
    }
}
