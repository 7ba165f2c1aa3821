//! The service mode: small duties at the host's request, for the first power-up of a rig.
//!
//! The host asks and repeats; the bounds are here. A motion is what happens between two requests
//! for rest. It ends by itself when the host falls silent, after [`MOTION_TICKS`], when the wheel
//! has turned [`TRAVEL`], or when preload or compression have left what they were when the mode
//! was entered by [`PRELOAD`] or [`COMPRESSION`]. Then both bridges stay at rest until the host
//! has asked for rest.

use serde::{Deserialize, Serialize};

use crate::fault::Limit;
use crate::units::{Duty, Millimetres, Newtons, Q16, Travel, q16};

/// Largest duty of the drive, Q15: 0.3, 18 mm/s of the prototype's wheel without load.
pub const DRIVE_DUTY: i16 = 9830;
/// Largest duty of the pre-tightener, Q15: 0.4, 10 N/s on the prototype.
pub const PRELOAD_DUTY: i16 = 13_107;
/// Ticks after which a request that is not repeated has run out.
pub const DEAD_MAN_TICKS: u16 = 200;
/// Ticks for which the drive's bridge stays on at zero duty after a motion. It brakes the wheel,
/// which would otherwise drive its motor as a generator: that is another output than none.
const BRAKE_TICKS: u16 = 150;
/// Longest motion, ticks.
pub const MOTION_TICKS: u16 = 2500;
/// Longest travel of the tread in a motion, mm.
pub const TRAVEL: Travel = Travel::const_from_int(20);
/// Largest change of the preload since the mode was entered, N: half of the prototype's cruise.
pub const PRELOAD: Newtons = q16(16_000_000);
/// Largest change of the compression since then, mm: twice what [`PRELOAD`] does to the
/// prototype's tread. It bounds a preload whose sensor does not show it.
pub const COMPRESSION: Millimetres = q16(500_000);
/// How much farther a motion may go that begins beyond these, N and mm: it is for the way back.
const AGAIN: (Newtons, Millimetres) = (q16(1_000_000), q16(50_000));

/// Duties that the host asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ServiceDuties {
    /// Drive: forward deploys.
    pub drive: Duty,
    /// Pre-tightener: forward raises the preload.
    pub pretightener: Duty,
}

impl ServiceDuties {
    /// Both bridges at rest.
    pub const REST: Self = Self { drive: Duty::ZERO, pretightener: Duty::ZERO };

    /// Whether the service mode carries this out: one motor at a time, within its bound.
    pub const fn is_allowed(self) -> bool {
        let (drive, pretightener) = (self.drive.to_bits(), self.pretightener.to_bits());
        drive.unsigned_abs() <= DRIVE_DUTY.unsigned_abs()
            && pretightener.unsigned_abs() <= PRELOAD_DUTY.unsigned_abs()
            && (drive == 0 || pretightener == 0)
    }

    /// Whether both bridges are to rest.
    pub const fn is_rest(self) -> bool {
        self.drive.to_bits() == 0 && self.pretightener.to_bits() == 0
    }
}

/// What the bounds look at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServiceView {
    /// Odometry, mm.
    pub travel: Travel,
    /// Preload, filtered, N.
    pub preload: Newtons,
    /// Compression, filtered, mm.
    pub compression: Millimetres,
}

/// State of the service mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServiceState {
    /// The latest request; kept beyond the mode, for the log.
    asked: ServiceDuties,
    /// Ticks since it came.
    age: u16,
    /// Ticks of the present motion; 0 at rest.
    moving: u16,
    /// The motion has ended by a bound.
    ended: bool,
    /// Ticks for which the wheel is still braked.
    braking: u16,
    /// As the mode was entered.
    entry: ServiceView,
    /// As the motion began.
    start: ServiceView,
}

impl ServiceState {
    /// The mode is entered: at rest, with the bounds around what is `seen`.
    pub fn enter(&mut self, seen: &ServiceView) {
        *self = Self { asked: self.asked, entry: *seen, ended: true, ..Self::default() };
    }

    /// Takes a request; returns whether it differs from the one before.
    pub fn ask(&mut self, request: ServiceDuties) -> bool {
        self.age = 0;
        core::mem::replace(&mut self.asked, request) != request
    }

    /// Whether the drive's bridge stays on without a duty.
    pub const fn brakes(&self) -> bool {
        self.braking > 0
    }

    /// Duties of a tick of the mode, and the limit that has ended a motion in it.
    pub fn step(&mut self, seen: &ServiceView) -> (ServiceDuties, Option<Limit>) {
        let (duties, limit) = self.judge(seen);
        let drives = duties.drive != Duty::ZERO;
        self.braking = if drives { BRAKE_TICKS } else { self.braking.saturating_sub(1) };
        (duties, limit)
    }

    fn judge(&mut self, seen: &ServiceView) -> (ServiceDuties, Option<Limit>) {
        self.age = self.age.saturating_add(1);
        if self.asked.is_rest() || !self.asked.is_allowed() {
            self.moving = 0;
            self.ended = !self.asked.is_rest();
            return (ServiceDuties::REST, None);
        }
        if self.ended {
            return (ServiceDuties::REST, None);
        }
        if self.moving == 0 {
            self.start = *seen;
        }
        self.moving = self.moving.saturating_add(1);
        let limit = if self.age > DEAD_MAN_TICKS {
            Limit::ServiceSilent
        } else if self.moving > MOTION_TICKS || self.is_beyond(seen) {
            Limit::ServiceBounded
        } else {
            return (self.asked, None);
        };
        self.ended = true;
        (ServiceDuties::REST, Some(limit))
    }

    /// Whether the motion has left its bounds.
    fn is_beyond(&self, seen: &ServiceView) -> bool {
        let off = |at: Q16, entry: Q16| (at - entry).abs();
        let preload = off(seen.preload, self.entry.preload);
        let compression = off(seen.compression, self.entry.compression);
        let began = off(self.start.preload, self.entry.preload) + AGAIN.0;
        let began_mm = off(self.start.compression, self.entry.compression) + AGAIN.1;
        let travel = seen.travel.wrapping_sub(self.start.travel);
        travel.wrapping_abs() > TRAVEL
            || preload > began.max(PRELOAD)
            || compression > began_mm.max(COMPRESSION)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn drive(bits: i16) -> ServiceDuties {
        ServiceDuties { drive: Duty::from_bits(bits), ..ServiceDuties::REST }
    }

    fn press(bits: i16) -> ServiceDuties {
        ServiceDuties { pretightener: Duty::from_bits(bits), ..ServiceDuties::REST }
    }

    fn seen(travel: f64, preload: f64, compression: f64) -> ServiceView {
        ServiceView {
            travel: Travel::from_num(travel),
            preload: Q16::from_num(preload),
            compression: Q16::from_num(compression),
        }
    }

    /// The mode entered, and rest asked for.
    fn entered() -> ServiceState {
        let mut state = ServiceState::default();
        state.enter(&seen(0.0, 0.0, 0.0));
        state.ask(ServiceDuties::REST);
        state.step(&seen(0.0, 0.0, 0.0));
        state
    }

    /// Ticks for which this request, repeated each 50 ticks, drives; and the limit that ended it.
    fn lasts(
        state: &mut ServiceState,
        request: ServiceDuties,
        at: impl Fn(u32) -> ServiceView,
    ) -> (u32, Option<Limit>) {
        for tick in 0..10_000 {
            if tick % 50 == 0 {
                state.ask(request);
            }
            let (duties, limit) = state.step(&at(tick));
            if duties.is_rest() {
                return (tick, limit);
            }
            assert_eq!(duties, request);
        }
        panic!("a motion without end");
    }

    #[test]
    fn one_small_duty_at_a_time_is_allowed() {
        for (duties, allowed) in [
            (ServiceDuties::REST, true),
            (drive(DRIVE_DUTY), true),
            (drive(-DRIVE_DUTY), true),
            (drive(DRIVE_DUTY + 1), false),
            (drive(i16::MIN), false),
            (press(-PRELOAD_DUTY), true),
            (press(PRELOAD_DUTY + 1), false),
            (ServiceDuties { drive: Duty::from_bits(1), ..press(1) }, false),
        ] {
            assert_eq!(duties.is_allowed(), allowed, "{duties:?}");
            let mut state = entered();
            state.ask(duties);
            let (given, _) = state.step(&seen(0.0, 0.0, 0.0));
            assert_eq!(given, if allowed { duties } else { ServiceDuties::REST });
        }
    }

    #[test]
    fn nothing_moves_before_rest_was_asked_for() {
        let mut state = ServiceState::default();
        state.enter(&seen(0.0, 0.0, 0.0));
        assert_eq!(lasts(&mut state, drive(3000), |_| seen(0.0, 0.0, 0.0)), (0, None));
        assert_eq!(lasts(&mut state, ServiceDuties::REST, |_| seen(0.0, 0.0, 0.0)), (0, None));
        assert!(lasts(&mut state, drive(3000), |_| seen(0.0, 0.0, 0.0)).0 > 0);
    }

    #[test]
    fn a_silent_host_ends_the_motion_and_must_ask_for_rest() {
        let mut state = entered();
        state.ask(drive(3000));
        let still = seen(0.0, 0.0, 0.0);
        for tick in 1..=200 {
            assert_eq!(state.step(&still), (drive(3000), None), "{tick}");
        }
        assert_eq!(state.step(&still), (ServiceDuties::REST, Some(Limit::ServiceSilent)));
        // One that comes back does not go on where it was.
        assert_eq!(lasts(&mut state, drive(3000), |_| still), (0, None));
        state.ask(ServiceDuties::REST);
        state.step(&still);
        assert!(lasts(&mut state, drive(-3000), |_| still).0 > 200);
    }

    #[test]
    fn each_bound_ends_the_motion() {
        let bounded = Some(Limit::ServiceBounded);
        let still = |_| seen(0.0, 0.0, 0.0);
        assert_eq!(lasts(&mut entered(), drive(3000), still), (2500, bounded));
        // 0.02 mm a tick, either way; 0.02 N a tick; 0.001 mm a tick.
        for sign in [1.0, -1.0] {
            let turning = |tick| seen(sign * 0.02 * f64::from(tick), 0.0, 0.0);
            let (ticks, limit) = lasts(&mut entered(), drive(3000), turning);
            assert!((1000..=1002).contains(&ticks) && limit == bounded, "{ticks}");
            let rising = |tick| seen(0.0, sign * 0.02 * f64::from(tick), 0.0);
            let (ticks, limit) = lasts(&mut entered(), press(3000), rising);
            assert!((800..=802).contains(&ticks) && limit == bounded, "{ticks}");
            let pressed = |tick| seen(0.0, 0.0, sign * 0.001 * f64::from(tick));
            let (ticks, limit) = lasts(&mut entered(), press(3000), pressed);
            assert!((500..=502).contains(&ticks) && limit == bounded, "{ticks}");
        }
    }

    #[test]
    fn a_wheel_that_was_driven_is_braked_for_a_while() {
        let mut state = entered();
        assert!(!state.brakes());
        state.ask(drive(3000));
        state.step(&seen(0.0, 0.0, 0.0));
        state.ask(ServiceDuties::REST);
        let braked = (0..1000).take_while(|_| {
            state.step(&seen(0.0, 0.0, 0.0));
            state.brakes()
        });
        assert_eq!(braked.count(), usize::from(BRAKE_TICKS) - 1);
        state.ask(press(3000));
        state.step(&seen(0.0, 0.0, 0.0));
        assert!(!state.brakes(), "the screw locks itself");
    }

    #[test]
    fn beyond_its_bound_a_preload_can_be_taken_back_and_not_be_raised() {
        let mut state = entered();
        lasts(&mut state, press(9000), |tick| seen(0.0, 0.02 * f64::from(tick), 0.0));
        state.ask(ServiceDuties::REST);
        state.step(&seen(0.0, 18.0, 0.0));
        let back = lasts(&mut state, press(-9000), |t| seen(0.0, 18.0 - 0.01 * f64::from(t), 0.0));
        assert!(back.0 > 1500, "{back:?}");
        let mut state = entered();
        state.ask(ServiceDuties::REST);
        state.step(&seen(0.0, 18.0, 0.0));
        let on = lasts(&mut state, press(9000), |t| seen(0.0, 18.0 + 0.01 * f64::from(t), 0.0));
        assert!(on.0 <= 102, "{on:?}");
    }

    proptest! {
        /// Whatever the host asks, in whatever order.
        #[test]
        fn no_request_drives_beyond_duty_and_time(
            requests in prop::collection::vec(
                (any::<i16>(), any::<i16>(), any::<bool>(), 1_u16..3000), 1..20),
        ) {
            let mut state = entered();
            let mut driven = 0_u32;
            for (a, b, one, ticks) in requests {
                let duties = ServiceDuties {
                    drive: Duty::from_bits(a),
                    pretightener: Duty::from_bits(if one { 0 } else { b }),
                };
                for tick in 0..ticks {
                    if tick % 100 == 0 {
                        state.ask(duties);
                    }
                    let (given, _) = state.step(&seen(0.0, 0.0, 0.0));
                    prop_assert!(given.is_allowed());
                    driven = if given.is_rest() { 0 } else { driven + 1 };
                    prop_assert!(driven <= u32::from(MOTION_TICKS));
                }
            }
        }
    }
}
