//! One crossing by the rolled-out tread: from where the wheel is to past the lower wall.

#![deny(clippy::float_arithmetic)]

use super::tread::{Axial, Contact, Drive, PitchedState, PitchedTread};
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
pub fn roll<const PITCH: u32, const ELEMENTS: usize>(
    tread: &PitchedTread<PITCH, ELEMENTS>,
    state: &mut PitchedState<ELEMENTS>,
    run: &Run,
    course: impl FnMut(Millimetres) -> (MillimetresPerSecond, Newtons),
) -> Rolled {
    roll_watched(tread, state, run, course, |_| ())
}

/// The same, and shows each stride's contact.
pub fn roll_watched<const PITCH: u32, const ELEMENTS: usize>(
    tread: &PitchedTread<PITCH, ELEMENTS>,
    state: &mut PitchedState<ELEMENTS>,
    run: &Run,
    mut course: impl FnMut(Millimetres) -> (MillimetresPerSecond, Newtons),
    mut seen: impl FnMut(&Contact),
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
    // The last three contacts, the latest last.
    let mut contacts = [Contact::default(); 3];
    let mut lifted = None;
    let mut position = run.from;
    let ahead = if forward { tread.stride() } else { -tread.stride() };
    // The wheel needs a stride to each stride of travel, and on the edge up to twice that.
    let most = between(divide((run.until - run.from).abs(), tread.stride()).floor(), 0, 2000);
    for stride in 0..2 * most {
        // By halves, each exact where its acceleration is constant.
        let (middle, _) = course(position + ahead.half());
        let half = |from: Q16, to: Q16| {
            divide(tread.stride().half(), (from.half() + to.half()).max(LEAST_SPEED))
        };
        let first = half(speed, middle);
        (speed, drive.pressed) = course(position + ahead);
        drive.duration = first + half(middle, speed);
        let contact = tread.advance(state, &drive);
        position = contact.position;
        contacts = [contacts[1], contacts[2], contact];
        seen(&contact);
        rolled.visits += contact.visits;
        rolled.strides += 1;
        if stride > SETTLES {
            rolled.utilisation = rolled.utilisation.max(contact.utilisation);
            rolled.corner_force = rolled.corner_force.max(contact.axial);
        }
        if let Some(part) = lifted.take() {
            // A stride after the lower wall was left.
            let [_, now, next] = &contacts;
            rolled.peak(now, next, Q16::ONE - part);
        }
        if stride > 1 && position < Q16::ZERO && rolled.gap == Q16::ZERO {
            let part = lift(tread.radius(), &mut rolled, &contacts, forward);
            if let Some(part) = part {
                let [earlier, before, _] = &contacts;
                if forward {
                    lifted = Some(part);
                } else {
                    rolled.peak(before, earlier, part);
                }
            }
        }
        if (position > run.until) == forward {
            break;
        }
    }
    rolled
}

/// Strides after which a wheel that was put down rolls.
const SETTLES: i32 = 8;

/// The instant at which the lower wall stops (retract: begins) to carry, as a part of the last
/// stride, if it does so there.
///
/// A wheel that comes down falls on until it touches, at its undeformed radius: what follows is
/// slower.
fn lift(
    radius: Millimetres,
    rolled: &mut Rolled,
    [earlier, before, now]: &[Contact; 3],
    forward: bool,
) -> Option<Ratio> {
    let carries = |contact: &Contact| contact.floor > Q16::ZERO;
    if carries(before) != forward || carries(now) == forward {
        return None;
    }
    let part = if forward {
        falls_to_zero(earlier.floor, before.floor, now.floor)
    } else {
        divide(before.centre - radius, earlier.centre - before.centre)
    };
    let part = between(part, Q16::ZERO, Q16::ONE);
    let mix = |a: Q16, b: Q16| a + part * (b - a);
    let x = mix(before.position, now.position);
    let y = if forward { mix(before.centre, now.centre) } else { radius };
    rolled.lift = (x, y);
    rolled.gap = sqrt(x * x + y * y) - radius;
    Some(part)
}

/// Where the parabola through three values at equal distances, of which the last is not positive, is
/// zero, in parts of the last distance: a step of Newton's method from the chord's zero.
fn falls_to_zero(earlier: Q16, before: Q16, now: Q16) -> Ratio {
    let chord = divide(before, before - now);
    let (bend, slope) = ((now + earlier).half() - before, (now - earlier).half());
    let missing = before + chord * (slope + chord * bend);
    chord - divide(missing, slope + chord * (bend + bend))
}

impl Rolled {
    /// Friction and force where the corner alone begins (retract: ceases) to carry, from the two
    /// strides that it does, the first by this part of a stride from there. They peak there.
    fn peak(&mut self, first: &Contact, second: &Contact, part: Ratio) {
        let at = |first: Q16, second: Q16| first + part * (first - second);
        self.lift_utilisation = at(first.utilisation, second.utilisation);
        self.utilisation = self.utilisation.max(self.lift_utilisation);
        self.corner_force = self.corner_force.max(at(first.axial, second.axial));
    }
}
