//! One crossing by the rolled-out tread: from where the wheel is to past the lower wall.

#![deny(clippy::float_arithmetic)]

use super::tread::{Axial, Contact, Drive, Tread, TreadState};
use crate::numeric::{between, divide, sqrt};
use crate::units::{Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, q16};

/// What a crossing gives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rolled {
    /// Clearance between step root and undeformed wheel when the lower wall stops (retract:
    /// begins) to carry, mm; zero if it never does.
    pub gap: Millimetres,
    /// Axial position and height of the centre there, mm.
    pub lift: (Millimetres, Millimetres),
    /// Friction needed there, and the most on the way.
    pub lift_utilisation: Ratio,
    /// See `lift_utilisation`.
    pub utilisation: Ratio,
    /// Largest axial force of the contact against the motion outwards, N.
    pub corner_force: Newtons,
    /// Elements visited and strides made.
    pub visits: u32,
    /// See `visits`.
    pub strides: u32,
}

/// How a wheel goes over a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Direction.
    pub direction: Direction,
    /// How it is moved.
    pub axial: Axial,
    /// Stiffness over the nominal one.
    pub scale: Ratio,
    /// The axle moves as far as the tread.
    pub level: bool,
    /// Position at which it begins and ends at the latest, from the face outwards, mm.
    pub from: Millimetres,
    /// See `from`.
    pub until: Millimetres,
}

/// Least speed of a course, mm/s: a stride takes 2 s.
pub const LEAST_SPEED: MillimetresPerSecond = q16(100_000);

/// Rolls a wheel from rest on its wall over the step. `course` gives speed, mm/s, and radial force,
/// N, at a position, mm from the face outwards.
pub fn roll(
    tread: &Tread,
    state: &mut TreadState,
    run: &Run,
    mut course: impl FnMut(Millimetres) -> (MillimetresPerSecond, Newtons),
) -> Rolled {
    let forward = run.direction == Direction::Deploy;
    let (mut speed, pressed) = course(run.from);
    let mut drive = Drive {
        direction: run.direction,
        axial: run.axial,
        pressed,
        duration: Q16::ZERO,
        scale: run.scale,
        level: run.level,
    };
    tread.put_down(state, run.from, &drive);
    let mut rolled = Rolled::default();
    let mut last: Option<Contact> = None;
    let mut position = run.from;
    let ahead = if forward { tread.stride() } else { -tread.stride() };
    // The wheel needs a stride to each stride of travel, and on the edge up to twice that.
    let most = between(divide((run.until - run.from).abs(), tread.stride()).floor(), 0, 2000);
    for stride in 0..2 * most {
        let before = speed;
        (speed, drive.pressed) = course(position + ahead);
        // Exact where the acceleration is constant.
        drive.duration = divide(tread.stride(), (before.half() + speed.half()).max(LEAST_SPEED));
        let contact = tread.advance(state, &drive);
        position = contact.position;
        rolled.visits += contact.visits;
        rolled.strides += 1;
        if stride > SETTLES {
            rolled.utilisation = rolled.utilisation.max(contact.utilisation);
            rolled.corner_force = rolled.corner_force.max(contact.axial);
        }
        let before = last.filter(|_| position < Q16::ZERO && rolled.gap == Q16::ZERO);
        if let Some(before) = before {
            let lifted = if forward {
                before.floor > Q16::ZERO && contact.floor <= Q16::ZERO
            } else {
                before.floor <= Q16::ZERO && contact.floor > Q16::ZERO
            };
            if lifted {
                note(tread, &mut rolled, &before, &contact);
            }
        }
        last = (position < Q16::ZERO).then_some(contact);
        if (position > run.until) == forward {
            break;
        }
    }
    rolled
}

/// Strides after which a wheel that was put down rolls.
const SETTLES: i32 = 8;

/// The instant at which the lower wall carries nothing, between two strides.
fn note(tread: &Tread, rolled: &mut Rolled, before: &Contact, now: &Contact) {
    let part = divide(before.floor, before.floor - now.floor);
    let mix = |a: Q16, b: Q16| a + part * (b - a);
    let (x, y) = (mix(before.position, now.position), mix(before.centre, now.centre));
    rolled.lift = (x, y);
    rolled.lift_utilisation = mix(before.utilisation, now.utilisation);
    rolled.gap = sqrt(x * x + y * y) - tread.radius();
}
