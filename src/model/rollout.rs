//! One crossing by the rolled-out tread: from where the wheel is to past the lower wall.

use super::tread::{Axial, Contact, Drive, Tread, TreadState};
use super::wind_up::Shear;
use crate::numeric::{between, divide, sqrt};
use crate::units::{Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, q16};

/// What a crossing gives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rolled {
    /// Lift-off (retract: touch-down).
    pub lift: LiftOff,
    /// Largest axial force of the contact against the motion outwards, N.
    pub corner_force: Newtons,
    /// Elements visited and strides made.
    pub visits: u32,
    /// See `visits`.
    pub strides: u32,
}

/// The instant at which the lower wall stops (retract: begins) to carry, as the strides come to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LiftOff {
    /// Clearance between step root and undeformed wheel there, mm; zero as long as it is not found.
    pub gap: Millimetres,
    /// Axial position and height of the centre there, mm.
    pub position: Millimetres,
    /// See `position`.
    pub centre: Millimetres,
    /// Friction needed there.
    pub used_there: Ratio,
    /// The most friction needed so far.
    pub utilisation: Ratio,
    wary: bool,
    /// The largest `floor` so far, mm.
    carried: Millimetres,
    /// The last stride's contact before the face, and the strides made.
    last: Option<Contact>,
    strides: u32,
}

impl LiftOff {
    /// For a plan: a wall that was all but left counts as left there, even if it carries again.
    pub fn wary() -> Self {
        Self { wary: true, ..Self::default() }
    }

    /// Whether it has come.
    pub fn is_found(&self) -> bool {
        self.gap > Q16::ZERO
    }

    /// One stride further.
    pub fn follow(&mut self, tread: &Tread, direction: Direction, now: &Contact) {
        self.strides += 1;
        if self.strides > SETTLES {
            self.utilisation = self.utilisation.max(now.utilisation);
        }
        let before = self.last.filter(|_| now.position < Q16::ZERO);
        self.last = (now.position < Q16::ZERO).then_some(*now);
        let Some(before) = before else { return };
        let [carried, carries] = [&before, now].map(|contact| contact.floor > Q16::ZERO);
        self.carried = self.carried.max(before.floor);
        let skims = self.wary && now.floor > before.floor && before.floor < self.carried * SKIMS;
        if skims && !self.is_found() && direction == Direction::Deploy {
            self.leave(tread, &before);
        }
        // A wall that carries again has not been left: the last lift-off counts, and the first
        // touch-down.
        if self.is_found() {
            if carries && !self.wary && direction == Direction::Deploy {
                self.gap = Millimetres::ZERO;
            }
            return;
        }
        let deploys = direction == Direction::Deploy;
        if carried == deploys && carries != deploys {
            let part = if deploys {
                divide(before.floor, before.floor - now.floor)
            } else {
                let left = before.centre - tread.radius();
                between(divide(left, before.centre - now.centre), Q16::ZERO, Q16::ONE)
            };
            let mix = |a: Q16, b: Q16| a + part * (b - a);
            let there = Contact {
                position: mix(before.position, now.position),
                centre: mix(before.centre, now.centre),
                utilisation: mix(before.utilisation, now.utilisation),
                ..*now
            };
            self.leave(tread, &there);
        }
    }

    fn leave(&mut self, tread: &Tread, there: &Contact) {
        (self.position, self.centre) = (there.position, there.centre);
        self.used_there = there.utilisation;
        let (x, y) = (self.position, self.centre);
        self.gap = sqrt(x * x + y * y) - tread.radius();
    }
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
    /// How the tread gives way along the wall; none if it does not.
    pub shear: Option<Shear>,
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
    let Run { direction, axial, scale, level, .. } = *run;
    let pressed = course(run.from).1;
    let mut drive = Drive { direction, axial, pressed, scale, level, ..Drive::default() };
    tread.put_down(state, run.from, &drive);
    let mut rolled = Rolled::default();
    let mut position = run.from;
    let sense = if forward { Q16::ONE } else { -Q16::ONE };
    let load = if let Axial::Driven(load) = run.axial { load } else { Q16::ZERO };
    let mut winding = run.shear.map(|shear| shear.rest(load));
    // The wheel needs a stride to each stride of travel, and on the edge up to twice that.
    let most = between(divide((run.until - run.from).abs(), tread.stride()).floor(), 0, 2000);
    for _ in 0..2 * most {
        let (speed, pressed) = course(position);
        drive.pressed = pressed;
        drive.duration = divide(tread.stride() - drive.gives, speed.max(LEAST_SPEED));
        let contact = tread.advance(state, &drive);
        position = contact.position;
        if let (Some(shear), Some(winding)) = (&run.shear, &mut winding) {
            let stride = (tread.stride(), drive.duration);
            drive.gives = sense * shear.follow(winding, &contact, stride);
        }
        rolled.visits += contact.visits;
        rolled.strides += 1;
        rolled.lift.follow(tread, run.direction, &contact);
        if rolled.strides > SETTLES {
            rolled.corner_force = rolled.corner_force.max(contact.axial);
        }
        if (position > run.until) == forward {
            break;
        }
    }
    rolled
}

/// Part of what the lower wall carried below which it was all but left: the pressure falls by three
/// fifths of what the wheel rises, so that one which brakes 0.2 mm late would have left it.
const SKIMS: Ratio = q16(120_000);

/// Strides after which a wheel that was put down rolls.
const SETTLES: u32 = 8;
