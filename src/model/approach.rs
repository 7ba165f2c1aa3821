//! How the wheel comes to a step, and the speed that this asks for on the way: planned by rollouts,
//! followed by the tick.

use super::timing::Timing;
use crate::units::{Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Ratio, Seconds, q16};

/// Speed over the slowest one at which the wheel may speed up again.
const SLOWEST_WITHIN: Ratio = q16(1_100_000);

/// A course over a step: slow while its corner is looked for, slowest from where it is felt, and fast
/// again from shortly before the lower wall is left. Distances are axial, along the run, to the
/// face of the step.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Approach {
    /// Where the corner may first be felt, mm.
    pub window_from: Millimetres,
    /// Speed from there on, mm/s.
    pub window_speed: MillimetresPerSecond,
    /// Where a corner that is felt makes the wheel brake, mm.
    pub brake_from: Millimetres,
    /// Speed down to which it brakes, mm/s.
    pub slowest_speed: MillimetresPerSecond,
    /// Where it may speed up again, mm.
    pub release_from: Millimetres,
    /// Time from there to lift-off (retract: touch-down), s.
    pub release_time: Seconds,
    /// Lift-off (retract: touch-down), mm.
    pub lift: Millimetres,
}

/// What of an approach has begun; once so, until the step is behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Begun {
    /// The speed is brought down for the window.
    pub looking: bool,
    /// The speed is brought down on the corner.
    pub braking: bool,
    /// The wheel speeds up again on the corner.
    pub released: bool,
}

/// Where the wheel is on its approach.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Distance to the face, mm.
    pub distance: Millimetres,
    /// The corner is felt.
    pub felt: bool,
    /// Speed and acceleration of the profile, along the run, mm/s and mm/s^2.
    pub speed: MillimetresPerSecond,
    /// See `speed`.
    pub acceleration: MillimetresPerSecond2,
    /// The preload is reached, or will be when the wheel lifts off.
    pub ready: bool,
}

impl Approach {
    /// Speed that it asks for here, mm/s; `cruise` is that before and behind it.
    pub fn speed(
        &self,
        begun: &mut Begun,
        at: &Place,
        timing: &Timing,
        cruise: MillimetresPerSecond,
    ) -> MillimetresPerSecond {
        if !begun.looking {
            let braking = timing.distance_to(at.speed, at.acceleration, self.window_speed);
            begun.looking = at.felt || at.distance - self.window_from <= braking;
        }
        begun.braking |= at.felt && at.distance <= self.brake_from;
        begun.released |= begun.braking
            && at.distance <= self.release_from
            && at.speed <= self.slowest_speed * SLOWEST_WITHIN
            && at.ready;
        match begun {
            Begun { released: true, .. } => cruise,
            Begun { braking: true, .. } => self.slowest_speed,
            Begun { looking: true, .. } => self.window_speed,
            _ => cruise,
        }
    }
}
