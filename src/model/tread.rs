//! The tread, rolled out: a viscoelastic ring over a step, in fixed point.
//!
//! Elements lie along rays from the wheel's centre, 0.008 rad apart. A stride rolls the tread on by
//! one of them. An element at depth d carries the pressure of the three-parameter solid
//! (`relaxation`), never a tension; the centre is where the contact carries what presses the wheel.
//! Only elements in contact are visited; those that leave it are fresh when they return.
//!
//! Equations, with c and s the sums of `p cos` and `p sin` over the contact: pushed `c = N`; driven
//! by torque against an axial load G `c + u s = N` with the utilisation `u = (G + s) / c`. One
//! step of Newton's method a stride, whose remainder the next stride makes good. The axle moves
//! `sqrt(ds^2 - dy^2)` while the tread rolls ds (docs/PLANT.md, rolling), or as far as the
//! tread where that is asked for.
//!
//! Source: Lee and Radok 1960 for the solid; the rolling scheme is this project's own.

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod rays;
mod relaxation;
mod state;

use crate::numeric::{between, divide, high, high_unsigned, sqrt};
use crate::units::{Direction, Millimetres, Newtons, Q16, Ratio, Seconds, q16};
use rays::{AHEAD, BEHIND, Ray, ahead, behind, tangent};
use relaxation::Stride;

pub use state::TreadState;
use state::{Element, Frame, Patch};

/// Farthest from the face that a wheel is put down, mm. Positions end at 512 mm; 200 strides of the
/// largest wheel are 240 mm.
const FARTHEST: Millimetres = q16(200_000_000);

/// Largest change of the centre's height in a stride over the stride: steeper than any step that
/// a wheel can climb.
const STEEPEST: Ratio = q16(950_000);

/// Wheel, rubber and step in machine units. The default is a place to read one into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Tread {
    /// Wheel radius and step height, mm, Q22.
    radius: i32,
    height: i32,
    /// Tread between two elements, mm.
    stride: Millimetres,
    /// Force of an element per depth when relaxed, N/mm.
    rate: Q16,
    /// Stiffening less 1, Q26.
    excess: i32,
    /// Reciprocal of the relaxation time, 1/s.
    per_tau: Q16,
    /// By how much the axle lags behind the tread per compression and travel, 1/mm.
    rolling_lag: Ratio,
}

/// How the wheel is moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axial {
    /// Pushed at its axle along a frictionless wall.
    #[default]
    Pushed,
    /// Turned by torque against this load along the sleeve outwards, N.
    Driven(Newtons),
}

/// What presses and moves the wheel in a stride.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drive {
    /// Direction of the run.
    pub direction: Direction,
    /// How the wheel is moved.
    pub axial: Axial,
    /// Radial force that presses it, N.
    pub pressed: Newtons,
    /// Duration, s.
    pub duration: Seconds,
    /// By how much less than the tread the axle moves, since the tread gives way along the wall, mm.
    pub gives: Millimetres,
    /// Stiffness over the nominal one.
    pub scale: Ratio,
    /// The axle moves as far as the tread.
    pub level: bool,
}

/// Contact at the end of a stride.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// Axial position of the centre from the face, outwards, mm; its height over the lower wall.
    pub position: Millimetres,
    /// See `position`.
    pub centre: Millimetres,
    /// Radial and axial sum of the pressure, N.
    pub radial: Newtons,
    /// See `radial`.
    pub axial: Newtons,
    /// Friction needed: traction over normal force.
    pub utilisation: Ratio,
    /// Largest pressure on the lower wall over the relaxed stiffness, mm: not positive where the
    /// lower wall carries nothing.
    pub floor: Millimetres,
    /// Elements visited.
    pub visits: u32,
}

/// What the rays meet from where the wheel is, places of the first ray on the face and of the first
/// on the upper wall; below them is the lower wall.
#[derive(Clone, Copy, Debug)]
struct Facets {
    face: i32,
    top: i32,
}

/// What an element touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Facet {
    Floor,
    Face,
    Top,
}

/// Sums over the elements in contact.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// Pressure, mm, by cosine, and by sine behind straight down and ahead of it, Q46.
    cos: u64,
    sin: [u64; 2],
    /// Elements whose depth changes with the height, and their tangents, Q29.
    moves: i32,
    tan: [u64; 2],
    /// Largest pressure on the lower wall, mm, Q16.
    floor: i32,
    visits: u32,
}

impl Tread {
    /// Tread between two elements, mm.
    pub const fn stride(&self) -> Millimetres {
        self.stride
    }

    /// Height of the step, mm.
    pub const fn height(&self) -> Millimetres {
        Q16::from_bits(self.height >> 6)
    }

    /// Wheel radius, mm.
    pub const fn radius(&self) -> Millimetres {
        Q16::from_bits(self.radius >> 6)
    }

    /// A wheel put down at this position from the face, relaxed, under this force, N.
    pub fn put_down(&self, state: &mut TreadState, position: Millimetres, drive: &Drive) {
        state.clear();
        let on_top = position >= Q16::ZERO;
        state.frame.position = between(position, -FARTHEST, FARTHEST).to_bits() << 6;
        let wall = if on_top { self.height } else { 0 };
        state.frame.centre = self.radius + wall;
        let still = Stride::RELAXED;
        for _ in 0..12 {
            let facets = self.facets(&state.frame);
            let sums = self.sums(state, &still, facets);
            let change = self.correction(&sums, &still, drive).1;
            let change = if sums.visits == 0 { q16(-100_000) } else { change };
            let change = change.to_bits().clamp(-10_000, 10_000) << 6;
            state.frame.centre = self.held(state.frame.centre + change);
        }
        let facets = self.facets(&state.frame);
        self.commit(state, &still, facets);
        state.frame.climb = 0;
    }

    /// Rolls on by one element.
    pub fn advance(&self, state: &mut TreadState, drive: &Drive) -> Contact {
        let forward = drive.direction == Direction::Deploy;
        state.frame.turn(forward);
        for patch in &mut state.patches {
            patch.turn(forward);
        }
        let travel = self.travel(state, drive);
        let travel = if forward { travel } else { -travel };
        state.frame.position = state.frame.position.saturating_add(travel);
        state.frame.centre = self.held(state.frame.centre + state.frame.climb);
        let stride = Stride::new(Stride::ratio(drive.duration, self.per_tau), self.excess);
        let facets = self.facets(&state.frame);
        let sums = self.sums(state, &stride, facets);
        let (contact, change) = self.correction(&sums, &stride, drive);
        let steepest = (self.stride * STEEPEST).to_bits() << 6;
        let change = if sums.visits == 0 { -steepest / 4 } else { change.to_bits() << 6 };
        let change = change.clamp(-steepest, steepest);
        state.frame.climb = (state.frame.climb + change).clamp(-steepest, steepest);
        state.frame.centre = self.held(state.frame.centre + change);
        let facets = self.facets(&state.frame);
        self.commit(state, &stride, facets);
        let floor = if sums.floor > i32::MIN {
            Q16::from_bits(sums.floor) - Q16::from_bits(high(change, stride.loads))
        } else {
            // What a fresh element as deep in the wall as it is away would carry.
            -Q16::from_bits(high((state.frame.centre - self.radius).abs(), stride.loads))
        };
        Contact {
            position: Q16::from_bits(state.frame.position >> 6),
            centre: Q16::from_bits(state.frame.centre >> 6),
            floor,
            visits: sums.visits,
            ..contact
        }
    }

    /// A height of the centre, within those that a wheel on either wall can have, mm, Q22.
    const fn held(&self, centre: i32) -> i32 {
        let (least, most) = (self.radius / 2, self.radius + self.radius / 4 + self.height);
        if centre < least {
            least
        } else if centre > most {
            most
        } else {
            centre
        }
    }

    /// Travel of the axle in a stride, mm, Q22.
    fn travel(&self, state: &TreadState, drive: &Drive) -> i32 {
        if drive.level {
            return self.stride.to_bits() << 6;
        }
        let rolled = self.stride - between(drive.gives, -self.stride, self.stride);
        let slope = divide(Q16::from_bits(state.frame.climb >> 6), self.stride);
        let level = sqrt((Q16::ONE - slope * slope).max(Q16::ZERO));
        let wall = if state.frame.position >= 0 { self.height } else { 0 };
        let pressed = Q16::from_bits((self.radius + wall - state.frame.centre) >> 6).max(Q16::ZERO);
        let rolls = Q16::ONE - pressed * self.rolling_lag;
        // Q16 x Q16 to Q22, kept to the last bit.
        let part = level * rolls;
        ((i64::from(part.to_bits()) * i64::from(rolled.to_bits())) >> 10) as i32
    }

    /// What the rays meet. A ray at the angle a meets the lower wall before the face for
    /// `y tan a < -x`, and the upper wall behind the corner for `(y - h) tan a > -x`.
    fn facets(&self, state: &Frame) -> Facets {
        let to_face = state.position.saturating_neg();
        let above = (state.centre - self.height).max(1);
        let first = |height: i32, from: i32| {
            let beyond = |place: &i32| {
                // Q22 x Q29 to Q19.
                tangent(*place).is_none_or(|tan| high(height, tan) >= to_face >> 3)
            };
            let (mut low, mut high) = (from, AHEAD);
            while low < high {
                let middle = (low + high).div_euclid(2);
                if beyond(&middle) { high = middle } else { low = middle + 1 }
            }
            low
        };
        let top = first(above, -BEHIND);
        let face = if to_face > 0 { first(state.centre, 0).min(top) } else { top };
        Facets { face, top }
    }
}

impl Tread {
    /// Calls for each element that touches the wall: its place, ray and depth, mm, Q22, what it
    /// touches, and whether it may be ahead of straight down. Gives the places visited on the lower
    /// wall and on the step.
    #[inline(always)]
    fn touching(
        &self,
        state: &Frame,
        facets: Facets,
        mut visit: impl FnMut(i32, &Ray, i32, Facet, bool),
    ) -> [Patch; 2] {
        let wall = |height: i32| move |ray: &Ray| self.radius - (high(height, ray.sec) << 3);
        let (floor, top) = (wall(state.centre), wall(state.centre - self.height));
        // x / sin a = x / (cos a tan a): by division, the face has few rays.
        let to_face = Q16::from_bits(state.position.saturating_neg() >> 6);
        let face = |ray: &Ray| {
            let sin = Q16::from_bits((ray.sin >> 14) as i32);
            self.radius - (divide(to_face, sin).to_bits() << 6)
        };
        let below = facets.face.min(1);
        let low = below
            - behind(below, -BEHIND, floor, |at, ray, depth| {
                visit(at, ray, depth, Facet::Floor, false)
            });
        let high = below
            + ahead(below, facets.face, floor, |at, ray, depth| {
                visit(at, ray, depth, Facet::Floor, true)
            });
        let corner = facets.top.max(0);
        let end = corner
            + ahead(corner, AHEAD, top, |at, ray, depth| visit(at, ray, depth, Facet::Top, true));
        let mut begin = corner
            - behind(corner, facets.top, top, |at, ray, depth| {
                visit(at, ray, depth, Facet::Top, false)
            });
        if begin == facets.top {
            begin -= behind(begin, facets.face, face, |at, ray, depth| {
                visit(at, ray, depth, Facet::Face, true)
            });
        }
        [Patch { low, high }, Patch { low: begin, high: end }]
    }

    /// Sums over the contact at the present height.
    fn sums(&self, state: &TreadState, stride: &Stride, facets: Facets) -> Sums {
        let mut sums = Sums { floor: i32::MIN, ..Sums::default() };
        // Unsigned products: the core adds them up at once.
        let loads = stride.loads as u32;
        self.touching(&state.frame, facets, |place, ray, depth, facet, is_ahead| {
            sums.visits += 1;
            let Element { memory, depth: before } = state.element(place);
            let relief = high(memory, stride.relieves) + high(before, stride.relieved);
            let pressure = high_unsigned(depth as u32, loads) as i32 - relief;
            if facet == Facet::Floor {
                sums.floor = sums.floor.max(pressure);
            }
            if pressure > 0 {
                let by = |factor: u32| u64::from(pressure as u32) * u64::from(factor);
                sums.cos += by(ray.cos);
                sums.sin[usize::from(is_ahead)] += by(ray.sin);
                if facet != Facet::Face {
                    sums.moves += 1;
                    sums.tan[usize::from(is_ahead)] += u64::from(ray.tan);
                }
            }
        });
        sums
    }

    /// Moves the elements' memory to the stride's end; what has left the wall is fresh.
    fn commit(&self, state: &mut TreadState, stride: &Stride, facets: Facets) {
        let TreadState { frame, elements, patches } = state;
        let touched = self.touching(frame, facets, |place, _, depth, _, _| {
            let Some(element) = elements.get_mut(frame.index(place)) else { return };
            let memory = high(element.memory, stride.keeps)
                + high_unsigned(depth as u32, stride.takes as u32) as i32
                + high(element.depth, stride.took);
            *element = Element { memory: memory << 1, depth };
        });
        for patch in &*patches {
            let mut place = patch.low;
            while place < patch.high {
                if let Some(now) = touched.iter().find(|now| now.has(place)) {
                    place = now.high;
                    continue;
                }
                if let Some(element) = elements.get_mut(frame.index(place)) {
                    *element = Element::default();
                }
                place += 1;
            }
        }
        *patches = touched;
    }

    /// Contact with the height corrected, and the correction, mm: one step of Newton's method.
    fn correction(&self, sums: &Sums, stride: &Stride, drive: &Drive) -> (Contact, Millimetres) {
        // In millimetres of relaxed depth, which keep their bits whatever the rubber's stiffness.
        let rate = self.rate * drive.scale;
        let pressed = divide(drive.pressed, rate);
        let depth = |sum: i64| Q16::saturating_from_bits(sum >> 30);
        let less = |[behind, ahead]: [u64; 2]| ahead.wrapping_sub(behind) as i64;
        let (c, s) = (depth(sums.cos as i64), depth(less(sums.sin)));
        let loads = Q16::from_bits(stride.loads >> 10);
        let dc = -(loads * Q16::from_num(sums.moves));
        let ds = -(loads * Q16::saturating_from_bits(less(sums.tan) >> 13));
        let used = |c: Q16, s: Q16| match drive.axial {
            Axial::Pushed => Q16::ZERO,
            Axial::Driven(_) if c <= Q16::ZERO => Q16::ZERO,
            Axial::Driven(load) => divide(divide(load, rate) + s, c),
        };
        let u = used(c, s);
        let du = if u == Q16::ZERO { u } else { divide(ds - u * dc, c) };
        let slope = dc + u * ds + du * s;
        let missing = pressed - c - u * s;
        let change = if slope < Q16::ZERO { divide(missing, slope) } else { -missing };
        let (c, s) = (c + dc * change, s + ds * change);
        let contact = Contact {
            radial: c * rate,
            axial: s * rate,
            utilisation: used(c, s),
            ..Contact::default()
        };
        (contact, change)
    }
}

#[cfg(test)]
mod tests;
