//! What the elements remember of a stride.

use super::PitchedTread;
use super::rays::{Ray, Rays};
use super::reach::Wall;
use super::relaxation::Stride;
use super::state::{Element, Patch, PitchedState, Reach};

impl<const PITCH: u32, const ELEMENTS: usize> PitchedTread<PITCH, ELEMENTS> {
    /// Moves the elements' memory to the end of a stride in this direction; what has left the wall
    /// is fresh.
    pub(super) fn commit(
        &self,
        state: &mut PitchedState<ELEMENTS>,
        stride: &Stride,
        reach: Reach,
        forward: bool,
    ) {
        let Reach { top, floor, step, .. } = reach;
        let wall = self.wall(&state.frame);
        self.press(state, stride, floor, |ray| Wall::level(wall.lower, ray));
        self.press(state, stride, step.below(top), |ray| wall.face(ray));
        self.press(state, stride, step.from(top), |ray| Wall::level(wall.upper, ray));
        for (was, now) in [(state.reach.floor, floor), (state.reach.step, step)] {
            let Patch { low, high } = was.turned(forward);
            for place in (low..high.min(now.low)).chain(low.max(now.high)..high) {
                if !floor.has(place) && !step.has(place) {
                    *state.elements.at_mut(state.frame.number(place)) = Element::default();
                }
            }
        }
        let depth = self.corner_depth(&wall, &reach);
        state.corner = depth.map_or(Element::default(), |d| state.corner.pressed(d, stride));
        state.reach = reach;
    }

    /// Presses the elements of a patch on one facet.
    #[inline(always)]
    fn press(
        &self,
        state: &mut PitchedState<ELEMENTS>,
        stride: &Stride,
        patch: Patch,
        distance: impl Fn(&Ray) -> i32,
    ) {
        let mut number = state.frame.number(patch.low);
        for ray in Rays::<PITCH, ELEMENTS>::between(patch.low, patch.high) {
            let element = state.elements.at_mut(number);
            number = number.wrapping_add(1);
            *element = element.pressed(self.radius - distance(ray), stride);
        }
    }
}
