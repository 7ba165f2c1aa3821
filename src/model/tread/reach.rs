//! What the rays meet, and which elements touch it.

use super::PitchedTread;
use super::rays::{Ray, Rays};
use super::state::{Frame, Patch, Reach};
use crate::numeric::high;

/// The wall as seen from the centre, mm, Q22: the lower wall below it, the upper wall below it, the
/// face ahead of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wall {
    pub(super) lower: i32,
    pub(super) upper: i32,
    pub(super) face: i32,
}

impl Wall {
    /// Distance to a level wall that is this far below, Q22.
    #[inline(always)]
    pub(super) const fn level(below: i32, ray: &Ray) -> i32 {
        high(below, ray.sec) << 3
    }

    /// Distance to the face, Q22.
    #[inline(always)]
    pub(super) const fn face(&self, ray: &Ray) -> i32 {
        ((self.face as i64 * ray.csc as i64) >> 24) as i32
    }

    /// Where the ray meets a level wall that is this far below, from under the centre, Q22.
    #[inline(always)]
    pub(super) const fn ahead(below: i32, ray: &Ray) -> i32 {
        high(below, ray.tan) << 3
    }
}

impl<const PITCH: u32, const ELEMENTS: usize> PitchedTread<PITCH, ELEMENTS> {
    /// The wall as seen from here.
    pub(super) fn wall(&self, frame: &Frame) -> Wall {
        let upper = (frame.centre - self.height).max(1);
        Wall { lower: frame.centre, upper, face: -frame.position }
    }

    /// What the rays meet from here, searched from `near` on. A ray at the angle a meets the lower
    /// wall before the face for `y tan a < -x`, the upper wall behind the corner for
    /// `(y - h) tan a >= -x`, and the face between.
    pub(super) fn reach(&self, frame: &Frame, near: &Reach) -> Reach {
        let wall = self.wall(frame);
        let first = first::<PITCH, ELEMENTS>;
        let beyond = |below: i32| move |ray: &Ray| Wall::ahead(below, ray) >= wall.face;
        let clear = |below: i32| move |ray: &Ray| Wall::level(below, ray) >= self.radius;
        let (behind, ahead) = (Rays::<PITCH, ELEMENTS>::BEHIND, Rays::<PITCH, ELEMENTS>::AHEAD);
        let top = first(-behind, ahead, near.top, &beyond(wall.upper));
        let face = if wall.face > 0 {
            first(0, top.max(0), near.face, &beyond(wall.lower)).min(top)
        } else {
            top
        };
        // What is level is touched as far behind as ahead.
        let touched = |near: i32, below: i32| {
            let high = first(0, ahead, near, &clear(below));
            Patch { low: (1 - high).max(-behind), high }
        };
        let floor = touched(near.floor.high, wall.lower).below(face);
        let upper = touched(near.upper, wall.upper);
        let mut step = upper.from(top);
        if step.low == top {
            let deep = |place: i32| {
                Rays::<PITCH, ELEMENTS>::at(place).is_some_and(|ray| wall.face(ray) < self.radius)
            };
            while step.low > face && deep(step.low - 1) {
                step.low -= 1;
            }
        }
        Reach { face, top, upper: upper.high, floor, step }
    }
}

/// The first place from `low` to before `high` whose ray is like that, as are all after it;
/// searched from `near` on.
#[inline(always)]
fn first<const PITCH: u32, const ELEMENTS: usize>(
    low: i32,
    high: i32,
    near: i32,
    like: &dyn Fn(&Ray) -> bool,
) -> i32 {
    let like = |place: i32| Rays::<PITCH, ELEMENTS>::at(place).is_some_and(like);
    let mut place = near.max(low).min(high);
    while place < high && !like(place) {
        place += 1;
    }
    while place > low && like(place - 1) {
        place -= 1;
    }
    place
}
