//! The tread, rolled out: a viscoelastic ring over a step, in fixed point. The one place in the
//! controller that knows rubber.
//!
//! Elements lie along rays from the wheel's centre. A stride rolls the tread on by one of them. An
//! element at depth d carries the pressure of the three-parameter solid ([`relaxation`]), never a
//! tension; the centre is where the contact carries what presses the wheel. Only elements in
//! contact are visited; those that leave it are fresh when they return.
//!
//! Equations, with c and s the sums of `p cos` and `p sin` over the contact ([`sums`]): pushed
//! `c = N`; driven by torque against an axial load G `c + u s = N` with the utilisation
//! `u = (G + s) / c`. One step of Newton's method a stride, whose remainder the next stride makes
//! good; another where the first moved far. The axle moves `sqrt(ds^2 - dy^2)` while the tread
//! rolls ds (a wheel that pivots about an edge runs farther than its axle), or as far as the tread
//! where that is asked for.
//!
//! Source: Lee and Radok 1960 for the solid; the rolling scheme is this project's own.

#![deny(clippy::float_arithmetic)]

mod balance;
#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod memory;
mod rays;
mod reach;
mod relaxation;
mod state;
mod sums;

use crate::numeric::{divide, high, sqrt};
use crate::units::{Direction, Millimetres, Newtons, Q16, Ratio, Seconds, q16};
use relaxation::Stride;

pub use state::PitchedState;

/// The tread as shipped: on the published wheel an element is 0.2 mm of it.
pub type Tread = PitchedTread<8000, 256>;
/// Its state.
pub type TreadState = PitchedState<256>;

/// Largest change of the centre's height in a stride over the stride: steeper than any step that
/// a wheel can climb.
const STEEPEST: Ratio = q16(950_000);

/// A correction of less than the steepest one over two to this is the last.
const NEAR: u32 = 4;

/// Most steps of Newton's method in a stride.
const PASSES: u32 = 4;

/// Wheel, rubber and step in machine units, with elements `PITCH` microradians apart. The default
/// is a place to read one into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PitchedTread<const PITCH: u32, const ELEMENTS: usize> {
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axial {
    /// Pushed at its axle along a frictionless wall.
    Pushed,
    /// Turned by torque against this load along the sleeve outwards, N.
    Driven(Newtons),
}

/// What presses and moves the wheel in a stride.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    /// Direction of the run.
    pub direction: Direction,
    /// How the wheel is moved.
    pub axial: Axial,
    /// Radial force that presses it, N.
    pub pressed: Newtons,
    /// Duration, s.
    pub duration: Seconds,
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

impl<const PITCH: u32, const ELEMENTS: usize> PitchedTread<PITCH, ELEMENTS> {
    /// Tread between two elements, mm.
    pub const fn stride(&self) -> Millimetres {
        self.stride
    }

    /// Wheel radius, mm.
    pub const fn radius(&self) -> Millimetres {
        Q16::from_bits(self.radius >> 6)
    }

    /// A wheel put down at this position from the face, relaxed, under this force, N.
    pub fn put_down(
        &self,
        state: &mut PitchedState<ELEMENTS>,
        position: Millimetres,
        drive: &Drive,
    ) {
        *state = PitchedState::default();
        let on_top = position >= Q16::ZERO;
        state.frame.position = position.to_bits().saturating_mul(64);
        let wall = if on_top { self.height } else { 0 };
        state.frame.centre = self.radius + wall;
        let still = Stride::RELAXED;
        for _ in 0..12 {
            state.reach = self.reach(&state.frame, &state.reach);
            let sums = self.sums(state, &still, &state.reach);
            let change = self.correction(&sums, &still, drive).1;
            let change = if sums.visits == 0 { q16(-100_000) } else { change };
            state.frame.centre += change.to_bits().clamp(-10_000, 10_000) << 6;
        }
        let reach = self.reach(&state.frame, &state.reach);
        self.commit(state, &still, reach, true);
    }

    /// Rolls on by one element.
    pub fn advance(&self, state: &mut PitchedState<ELEMENTS>, drive: &Drive) -> Contact {
        let forward = drive.direction == Direction::Deploy;
        state.frame.turn(forward);
        let travel = self.travel(state, drive);
        state.frame.position += if forward { travel } else { -travel };
        let before = state.frame.centre;
        state.frame.centre += state.frame.climb;
        let stride = Stride::new(Stride::ratio(drive.duration, self.per_tau), self.excess);
        let steepest = (self.stride * STEEPEST).to_bits() << 6;
        let mut reach = self.reach(&state.frame, &state.reach);
        let (mut contact, mut floor, mut visits) = (Contact::default(), None, 0);
        for _ in 0..PASSES {
            let sums = self.sums(state, &stride, &reach);
            visits += sums.visits;
            let (at, change) = self.correction(&sums, &stride, drive);
            let change = if sums.visits == 0 { -steepest / 4 } else { change.to_bits() << 6 };
            let change = change.clamp(-steepest, steepest);
            state.frame.centre += change;
            reach = self.reach(&state.frame, &reach);
            // An element that the correction lifts off is followed.
            let carried = if sums.floor > i32::MIN { Some(sums.floor) } else { floor };
            floor = carried.map(|pressure| pressure - high(change, stride.loads));
            contact = at;
            // Where the lower wall is left, what was linear is not.
            let leaves = floor.is_some_and(|now| now < sums.floor / 2) && sums.floor > 0;
            if !leaves && change.abs() < steepest >> NEAR {
                break;
            }
        }
        state.frame.climb = state.frame.centre - before;
        self.commit(state, &stride, reach, forward);
        // A fresh element above the lower wall would carry as much as one as deep in it.
        let above = || -high((state.frame.centre - self.radius).abs(), stride.loads);
        Contact {
            position: Q16::from_bits(state.frame.position >> 6),
            centre: Q16::from_bits(state.frame.centre >> 6),
            floor: Q16::from_bits(floor.unwrap_or_else(above)),
            visits,
            ..contact
        }
    }

    /// Travel of the axle in a stride, mm, Q22.
    fn travel(&self, state: &PitchedState<ELEMENTS>, drive: &Drive) -> i32 {
        if drive.level {
            return self.stride.to_bits() << 6;
        }
        let slope = divide(Q16::from_bits(state.frame.climb >> 6), self.stride);
        let level = sqrt((Q16::ONE - slope * slope).max(Q16::ZERO));
        let wall = if state.frame.position >= 0 { self.height } else { 0 };
        let compression =
            Q16::from_bits((self.radius + wall - state.frame.centre) >> 6).max(Q16::ZERO);
        let rolls = Q16::ONE - compression * self.rolling_lag;
        // Q16 x Q16 to Q22, kept to the last bit.
        let part = level * rolls;
        ((i64::from(part.to_bits()) * i64::from(self.stride.to_bits())) >> 10) as i32
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests;
