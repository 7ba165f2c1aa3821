//! Sums of the pressure over the contact, as a piecewise linear function along the tread.
//!
//! Between two neighbouring rays the pressure is linear, and where it would be a tension it is
//! none: so a patch ends between rays, and the corner lies between rays. The sum over the rays in
//! contact, which is the trapezoidal rule inside a patch, is corrected in these cells.

use super::PitchedTread;
use super::rays::{Ray, Rays};
use super::reach::Wall;
use super::relaxation::Stride;
use super::state::{Element, Patch, PitchedState, Reach};
use crate::numeric::{divide, high, sqrt};
use crate::units::Q16;

/// Sums over the elements in contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums {
    /// Pressure, mm of relaxed depth, by cosine and sine, Q46.
    pub(super) cos: i64,
    pub(super) sin: i64,
    /// Elements whose depth changes with the height, Q16, and their tangents, Q45.
    pub(super) moves: i32,
    pub(super) tan: i64,
    /// Largest pressure on the lower wall, mm, Q16; the least number without contact.
    pub(super) floor: i32,
    pub(super) visits: u32,
}

/// One half, Q16.
const HALF: i32 = 1 << 15;

impl Default for Sums {
    fn default() -> Self {
        Self { cos: 0, sin: 0, moves: 0, tan: 0, floor: i32::MIN, visits: 0 }
    }
}

impl Sums {
    /// An element in contact.
    #[inline(always)]
    fn add(&mut self, pressure: i32, ray: &Ray) {
        self.cos += i64::from(pressure) * i64::from(ray.cos);
        self.sin += i64::from(pressure) * i64::from(ray.sin);
    }

    /// Elements whose depth changes with the height at this ray, Q16.
    #[inline(always)]
    fn yields(&mut self, part: i32, ray: &Ray) {
        self.moves += part;
        self.tan += i64::from(part) * i64::from(ray.tan);
    }

    /// The patch ends between an element that carries and one that would pull. Half a cell of the
    /// first is in the sum; what carries is a triangle.
    #[inline(never)]
    fn end<const LEVEL: bool>(&mut self, carries: i32, ray: &Ray, pulls: i32) {
        let part = reaches(carries, pulls);
        self.add(-scaled(carries, HALF - part / 2), ray);
        if LEVEL {
            self.yields(part - HALF, ray);
        }
    }
}

/// Where between an element that carries and one that would pull the pressure ends, Q16.
fn reaches(carries: i32, pulls: i32) -> i32 {
    divide(Q16::from_bits(carries), Q16::from_bits(carries.saturating_sub(pulls))).to_bits()
}

/// A number times a part in Q16.
const fn scaled(number: i32, part: i32) -> i32 {
    ((number as i64 * part as i64) >> 16) as i32
}

/// Mean over a cell of a pressure that is linear from a to b and no tension, and how it grows with
/// b alone or with both, Q16.
fn mean(a: i32, b: i32, both: bool) -> (i32, i32) {
    match (a > 0, b > 0) {
        (true, true) => ((a >> 1) + (b >> 1), if both { 2 * HALF } else { HALF }),
        (false, false) => (0, 0),
        (true, false) => {
            let part = reaches(a, b);
            (scaled(a, part / 2), if both { part } else { 0 })
        }
        (false, true) => {
            let part = reaches(b, a);
            let alone = part - scaled(part, part / 2);
            (scaled(b, part / 2), if both { part } else { alone })
        }
    }
}

impl<const PITCH: u32, const ELEMENTS: usize> PitchedTread<PITCH, ELEMENTS> {
    /// Sums over the contact at the present height.
    pub(super) fn sums(
        &self,
        state: &PitchedState<ELEMENTS>,
        stride: &Stride,
        reach: &Reach,
    ) -> Sums {
        let Reach { face, top, floor, step, .. } = *reach;
        let wall = self.wall(&state.frame);
        let ends = [-Rays::<PITCH, ELEMENTS>::BEHIND, Rays::<PITCH, ELEMENTS>::AHEAD];
        let lower = |ray: &Ray| Wall::level(wall.lower, ray);
        let upper = |ray: &Ray| Wall::level(wall.upper, ray);
        let run = Run { tread: self, state, stride };
        let mut sums = Sums::default();
        sums.floor = run.sums::<true>(&mut sums, floor, [ends[0], face], lower);
        run.sums::<false>(&mut sums, step.below(top), [face, top], |ray| wall.face(ray));
        run.corner(&mut sums, &wall, reach);
        run.sums::<true>(&mut sums, step.from(top), [top, ends[1]], upper);
        sums
    }
}

/// What a run over neighbouring elements reads.
struct Run<'a, const PITCH: u32, const ELEMENTS: usize> {
    tread: &'a PitchedTread<PITCH, ELEMENTS>,
    state: &'a PitchedState<ELEMENTS>,
    stride: &'a Stride,
}

impl<const PITCH: u32, const ELEMENTS: usize> Run<'_, PITCH, ELEMENTS> {
    /// Pressure of an element this far from the wall, mm, Q16.
    #[inline(always)]
    fn pressure(&self, element: &Element, distance: i32) -> i32 {
        let Element { memory, depth } = *element;
        let relief = high(memory, self.stride.relieves) + high(depth, self.stride.relieved);
        high(self.tread.radius - distance, self.stride.loads) - relief
    }

    /// Adds the elements of a patch on one facet, which is met from one place to before another;
    /// returns the largest pressure.
    #[inline(always)]
    fn sums<const LEVEL: bool>(
        &self,
        sums: &mut Sums,
        patch: Patch,
        [from, until]: [i32; 2],
        distance: impl Fn(&Ray) -> i32,
    ) -> i32 {
        let rays = Rays::<PITCH, ELEMENTS>::between(patch.low, patch.high);
        let first = self.state.frame.number(patch.low);
        // Of the element that many rays on, with its sign turned: what is known to be negative is
        // multiplied with its sign, in one instruction.
        let pull = |on: usize, ray: &Ray| {
            let element = self.state.elements.at(first.wrapping_add(on));
            -self.pressure(element, distance(ray))
        };
        // A neighbour out of contact on the same facet shows where the pressure ends.
        let outside = |there: bool, on: usize, place: i32| {
            Rays::<PITCH, ELEMENTS>::at(place).filter(|_| there).map(|ray| pull(on, ray))
        };
        let mut before = outside(patch.low > from, usize::MAX, patch.low - 1);
        let (mut least, mut on) = (i32::MAX, 0);
        while let Some(ray) = rays.get(on) {
            let now = pull(on, ray);
            least = least.min(now);
            if now >= 0 {
                (before, on) = (Some(now), on + 1);
                continue;
            }
            if let Some(before) = before.filter(|before| *before >= 0) {
                sums.end::<LEVEL>(-now, ray, -before);
            }
            // As long as they carry.
            let (mut cos, mut sin, mut tan) = (0_i64, 0_i64, 0_i32);
            let (mut last, begin) = ((now, ray), on);
            for ray in rays.get(on..).unwrap_or_default() {
                let now = pull(on, ray);
                if now >= 0 {
                    break;
                }
                least = least.min(now);
                cos += i64::from(now) * i64::from(ray.cos);
                sin += i64::from(now) * i64::from(ray.sin);
                tan += ray.tan >> 8;
                (last, on) = ((now, ray), on + 1);
            }
            sums.cos -= cos;
            sums.sin -= sin;
            if LEVEL {
                sums.moves += ((on - begin) as i32) << 16;
                sums.tan += i64::from(tan) << 24;
            }
            let place = patch.low + on as i32;
            if let Some(next) = outside(place < until, on, place) {
                sums.end::<LEVEL>(-last.0, last.1, -next.max(0));
            }
            before = None;
        }
        sums.visits += rays.len() as u32;
        if rays.is_empty() { i32::MIN } else { -least }
    }

    /// Adds what the cell with the corner in it carries beside the halves of its two elements.
    #[inline(never)]
    fn corner(&self, sums: &mut Sums, wall: &Wall, reach: &Reach) {
        let Reach { face, top, .. } = *reach;
        let at = Rays::<PITCH, ELEMENTS>::at;
        let (Some(low), Some(ray)) = (at(top - 1), at(top)) else { return };
        let Some(depth) = self.tread.corner_depth(wall, reach) else { return };
        let number = self.state.frame.number(top);
        let above = self.pressure(self.state.elements.at(number), Wall::level(wall.upper, ray));
        let corner = self.pressure(&self.state.corner, self.tread.radius - depth);
        // Part of the cell before the corner, Q16.
        let before = Wall::ahead(wall.upper, low);
        let cell = Wall::ahead(wall.upper, ray) - before;
        let part = divide(Q16::from_bits(wall.face - before), Q16::from_bits(cell)).to_bits();
        let part = part.clamp(0, 2 * HALF);
        let rest = 2 * HALF - part;
        let (on_top, yields) = mean(above, corner, true);
        let mut carried = scaled(on_top, rest) - (above.max(0) >> 1);
        let mut moves = scaled(yields, rest) - if above > 0 { HALF } else { 0 };
        if top > face {
            let element = self.state.elements.at(number.wrapping_sub(1));
            let below = self.pressure(element, wall.face(low));
            let (on_face, yields) = mean(below, corner, false);
            carried += scaled(on_face, part) - (below.max(0) >> 1);
            moves += scaled(yields, part);
        }
        sums.add(carried, ray);
        sums.yields(moves, ray);
    }
}

impl<const PITCH: u32, const ELEMENTS: usize> PitchedTread<PITCH, ELEMENTS> {
    /// Depth at the corner if it touches, mm, Q22.
    pub(super) fn corner_depth(&self, wall: &Wall, reach: &Reach) -> Option<i32> {
        let Reach { top, step, .. } = *reach;
        if !(step.low <= top && top <= step.high) {
            return None;
        }
        let (x, y) = (Q16::from_bits(wall.face >> 6), Q16::from_bits(wall.upper >> 6));
        let depth = self.radius - (sqrt(x * x + y * y).to_bits() << 6);
        (depth > 0).then_some(depth)
    }
}
