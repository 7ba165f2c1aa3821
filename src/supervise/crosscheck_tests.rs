//! Each check at its threshold, and within tolerated noise.

use super::*;
use crate::supervise::Mode;
use proptest::prelude::*;

/// One count of the prototype's encoder, mm.
const COUNT_MM: f64 = 2.0 * core::f64::consts::PI * 25.0 / 8192.0;

/// What the checks compare.
#[derive(Clone, Copy)]
struct Compared {
    now: Tick,
    /// When the encoder was read.
    read_at: Tick,
    travel: Travel,
    radius: Millimetres,
    preload: Newtons,
    preload_due: Newtons,
    preload_off: Newtons,
    compression: Millimetres,
    speed_ref: MillimetresPerSecond,
    effort: Option<Ratio>,
}

impl Compared {
    /// What `then` makes of it as the monitor sees it, and of the preload's deviation.
    fn seen<T>(&self, then: impl FnOnce(&Observed<'_>, Newtons) -> T) -> T {
        let mut sensed = crate::estimate::sensed(0, 0.0, 0.0);
        sensed.speed.at = self.read_at;
        sensed.radius.value = self.radius;
        sensed.preload.value = self.preload;
        sensed.compression.value = self.compression;
        let observed = Observed {
            now: self.now,
            mode: Mode::Idle,
            sensed: &sensed,
            travel: self.travel,
            wound: Q16::ZERO,
            bridges: None,
            speed_ref: self.speed_ref,
            preload_due: self.preload_due,
            effort: self.effort,
            overrun: false,
            emergency_stop: false,
        };
        then(&observed, self.preload_off)
    }

    fn step(&self, check: &CrossCheck, state: &mut CrossState) -> Option<Fault> {
        self.seen(|seen, off| check.step(state, &Noise::default(), seen, off))
    }

    fn preload(&self, check: &CrossCheck, state: &mut CrossState) -> Option<Fault> {
        self.seen(|seen, off| check.preload(state, &Noise::default(), seen, off))
    }

    fn bends(&self, check: &CrossCheck, state: &mut CrossState) -> bool {
        self.seen(|seen, _| check.bends(state, seen))
    }

    fn begin(&self, state: &mut CrossState) {
        self.seen(|seen, _| state.begin(seen));
    }
}

/// True state of a drive.
#[derive(Clone, Copy, Debug)]
struct Rolls {
    /// Travel of wheel and reference, mm.
    travel: f64,
    reference: f64,
    radius: f64,
    preload: f64,
    due: f64,
    compression: f64,
    effort: Option<f64>,
    /// Codes stand still.
    stuck: bool,
}

const ROLLS: Rolls = Rolls {
    travel: 0.0,
    reference: 0.0,
    radius: 125.0,
    preload: 40.0,
    due: 40.0,
    compression: 0.4,
    effort: None,
    stuck: false,
};

/// First fault, and its tick, of a drive with this state at each time, after 100 ticks of
/// settling; the encoder counts, and preload and compression sensor are noisy.
fn found(mut at: impl FnMut(f64) -> Rolls) -> Option<(Fault, i32)> {
    let check = CrossCheck::try_build(&Rig::prototype()).expect("a sound rig");
    let mut state = CrossState::default();
    let mut before = 0.0;
    (0..3000).find_map(|tick| {
        let now = at(f64::from(tick - 100) * 1e-3);
        // Any noise that keeps the last bits moving.
        let noise = if now.stuck { 0.0 } else { f64::from((tick * 7919) % 101) / 101.0 - 0.5 };
        let counts = (now.travel / COUNT_MM).floor();
        let speed_ref = (now.reference - before) * 1e3;
        before = now.reference;
        let seen = Compared {
            now: tick as Tick,
            read_at: tick as Tick,
            travel: Travel::from_num(counts * COUNT_MM),
            radius: Q16::from_num(now.radius),
            preload: Q16::from_num(now.preload + 0.3 * noise),
            preload_due: Q16::from_num(now.due),
            preload_off: Q16::from_num(now.preload - now.due),
            compression: Q16::from_num(now.compression + 0.012 * noise),
            speed_ref: Q16::from_num(speed_ref),
            effort: now.effort.map(Q16::from_num),
        };
        if tick == 0 {
            state.preload.value = seen.preload;
            seen.begin(&mut state);
        }
        seen.step(&check, &mut state).map(|fault| (fault, tick - 100))
    })
}

/// As of an encoder that sticks on a corner: the tread winds up, so that the axle seems to go back.
#[test]
fn an_axle_that_recedes_makes_no_progress() {
    let recedes = |back: f64| {
        found(|t| {
            let (before, late) = (20.0 * (t.min(0.0) + 0.1), t.max(0.0));
            Rolls { travel: before - back * late, reference: before + 2.0 * late, ..ROLLS }
        })
    };
    for (back, within) in [(0.0, 240), (1.6, 140)] {
        let (fault, after) = recedes(back).expect("found");
        assert!(fault == Fault::DriveStalled && after < within, "{back}: {fault:?} {after} ms");
    }
}

/// A wheel at constant speed, mm/s, that leaves it with this acceleration, mm/s^2.
fn leaves(speed: f64, acceleration: f64) -> Option<(Fault, i32)> {
    found(|t| {
        let reference = speed * (t + 0.1);
        let late = t.max(0.0);
        Rolls { travel: reference + 0.5 * acceleration * late * late, reference, ..ROLLS }
    })
}

#[test]
fn a_wheel_that_runs_away_is_found_within_ten_ticks() {
    for speed in [3.0, 5.3, 8.0, 17.0, 30.0, -8.0, -30.0] {
        for sign in [1.0, -1.0] {
            // Full duty on the level, against the load of the rig.
            let (fault, after) = leaves(speed, sign * 1700.0).expect("found");
            assert_eq!(fault, Fault::DriveRunaway, "{speed}");
            assert!((2..=10).contains(&after), "{speed} {after}");
        }
    }
}

#[test]
fn a_bridge_at_full_duty_from_the_first_tick_is_found_as_soon() {
    let check = CrossCheck::try_build(&Rig::prototype()).expect("a sound rig");
    let mut state = CrossState::default();
    let found = (0..100).find(|&tick| {
        let t = f64::from(tick) * 1e-3;
        let travel = (0.5 * 1700.0 * t * t / COUNT_MM).floor() * COUNT_MM;
        let seen = Compared { travel: Travel::from_num(travel), ..off_by(tick, Q16::ZERO) };
        if tick == 0 {
            seen.begin(&mut state);
        }
        seen.step(&check, &mut state) == Some(Fault::DriveRunaway)
    });
    assert!(found.is_some_and(|tick| tick <= 10), "{found:?}");
}

#[test]
fn what_bends_less_than_the_threshold_is_tolerated() {
    // A full count beyond quantisation needs 530 mm/s^2 over the spans; a lasting deviation adds
    // up to a distance off the reference.
    for acceleration in [0.0, 250.0, -250.0] {
        let found = found(|t| {
            let reference = 8.0 * (t + 0.1);
            let late = t.clamp(0.0, 0.012);
            Rolls { travel: reference + 0.5 * acceleration * late * late, reference, ..ROLLS }
        });
        assert_eq!(found, None, "{acceleration}");
    }
}

#[test]
fn a_distance_off_the_reference_is_found_however_slowly_it_grows() {
    let (fault, after) = leaves(8.0, 300.0).expect("found");
    // 0.15 mm in 12 ms is 12.5 mm/s, and 300 mm/s^2 take 42 ms to that.
    assert!(fault == Fault::DriveRunaway && (40..60).contains(&after), "{fault:?} {after}");
}

#[test]
fn a_stalled_wheel_is_found_by_the_travel_of_its_reference() {
    // At 3 mm/s it is stalled after 100 ticks, and the reference takes 133 for 0.4 mm from the
    // last progress, which is up to 17 ticks back.
    for (speed, least, most) in [(3.0, 216, 234), (8.0, 5, 60), (30.0, 1, 20)] {
        let stalled = found(|t| {
            let reference = speed * (t + 0.1);
            // It has turned before.
            Rolls { travel: reference.min(0.6f64.max(speed * 0.1)), reference, ..ROLLS }
        });
        let (fault, after) = stalled.expect("found");
        assert!(matches!(fault, Fault::DriveStalled | Fault::DriveRunaway), "{speed}");
        assert!((least..=most).contains(&after), "{speed}: {after}");
    }
}

#[test]
fn an_arm_that_outruns_the_wheel_is_found() {
    let moved =
        |by: f64| found(|t| Rolls { radius: 125.0 - if t > 0.0 { by } else { 0.0 }, ..ROLLS });
    assert_eq!(moved(0.24), None);
    assert_eq!(moved(0.26).map(|(fault, _)| fault), Some(Fault::ArmMismatch));
    // On the steepest corner the arm moves as far as the wheel.
    let climbs = found(|t| {
        let travel = 8.0 * (t + 0.1);
        Rolls { travel, reference: travel, radius: 125.0 - travel, ..ROLLS }
    });
    assert_eq!(climbs, None);
}

#[test]
fn effort_outside_its_band_is_found_at_speed_and_after_its_time() {
    let cruising = |speed: f64, effort: f64| {
        found(|t| {
            let travel = speed * (t + 0.1);
            let effort = (t >= 0.0).then_some(effort * speed.signum());
            Rolls { travel, reference: travel, effort, ..ROLLS }
        })
    };
    for speed in [30.0, -30.0] {
        for (effort, bad) in [(-0.06, true), (-0.04, false), (0.12, false), (0.14, true)] {
            let expected = bad.then_some((Fault::DutyMismatch, i32::from(EFFORT_TICKS) - 1));
            assert_eq!(cruising(speed, effort), expected, "{speed} {effort}");
        }
    }
    assert_eq!(cruising(8.0, 0.5), None, "too slow to tell");
}

#[test]
fn a_preload_that_strays_is_found_after_its_time() {
    let strays =
        |by: f64| found(|t| Rolls { due: if t >= 0.0 { 40.0 + by } else { 40.0 }, ..ROLLS });
    // A quarter of 33.3 N, with half of 0.3 N of noise.
    for sign in [1.0, -1.0] {
        assert_eq!(strays(sign * 8.1), None);
        let (fault, after) = strays(sign * 8.6).expect("found");
        assert_eq!((fault, after), (Fault::PretightenerRunaway, i32::from(STRAYED_TICKS) - 1));
    }
}

#[test]
fn a_stuck_code_is_found_and_one_bit_of_noise_is_not_stuck() {
    let stalled = found(|t| Rolls { stuck: t >= 0.0, ..ROLLS });
    let (fault, after) = stalled.expect("found");
    assert_eq!(fault, Fault::PreloadSensorImplausible);
    assert!((64..=66).contains(&after), "{after}");
    let mut state = CodeState::default();
    for tick in 0..10_000 {
        let value = Q16::from_bits(1000 + i32::from(tick % 60 == 0));
        assert!(!judge(&mut state, value, Q16::ZERO, &LIMITS), "{tick}");
    }
}

/// Bounds of a preload sensor whose noise is not known.
const LIMITS: Limits = Limits { stuck: STUCK, jump: JUMP_N, due: Q16::MAX };

#[test]
fn a_run_of_equal_codes_is_judged_by_the_changes_at_rest() {
    // Half a code of noise; a code that repeats by 0.97; none at all.
    for (changes, expected) in [(64, 64), (26, 77), (2, 1792), (1, 3584), (0, u16::MAX)] {
        assert_eq!(run_of(changes), expected, "{changes}");
    }
    for changes in 1..=64 {
        let repeats: f64 = 1.0 - f64::from(changes) / f64::from(NOISE_TICKS);
        let chance = repeats.powi(run_of(changes).into());
        assert!(chance < 1e-12, "{changes}: {chance}");
    }
    let mut noise = CodeNoise::default();
    for tick in 0..200 {
        noise.rest(Q16::from_bits(tick / 2));
    }
    assert_eq!(noise.stuck, run_of(32), "the last complete count");
}

#[test]
fn a_code_that_sleeps_through_a_change_of_the_preload_is_stuck() {
    let sleeps = |rises: f64| {
        let limits = Limits { stuck: u16::MAX, due: q16(4_000_000), ..LIMITS };
        let mut state = CodeState::default();
        (0..500).find(|tick| {
            let due = Q16::from_num(rises * f64::from(*tick));
            judge(&mut state, Q16::DELTA, due, &limits)
        })
    };
    assert_eq!(sleeps(0.0), None);
    assert_eq!(sleeps(0.025), Some(161));
    assert_eq!(sleeps(-1.0), Some(64));
}

#[test]
fn a_jump_is_tolerated_and_repeated_jumps_are_not() {
    let jumps = |every: i32| {
        let mut state = CodeState::default();
        (0..5000).find(|tick| {
            let up = tick / every % 2 == 0;
            let value = Q16::from_num(if up { 20 } else { 30 }) + Q16::from_bits(*tick);
            judge(&mut state, value, Q16::ZERO, &LIMITS)
        })
    };
    assert_eq!(jumps(2000), None);
    assert_eq!(jumps(10), None, "a jump every ten ticks is forgotten between");
    assert!(jumps(1).is_some_and(|tick| tick <= 9));
}

proptest! {
    /// A wheel that follows a smooth reference within what the checks allow.
    #[test]
    fn no_alarm_within_the_tolerances(
        speed in -30.0..30.0f64,
        phase in 0.0..1.0f64,
        off in -0.02..0.02f64,
        strayed in -7.5..7.5f64,
        effort in -0.04..0.12f64,
    ) {
        let found = found(|t| {
            let reference = speed * (t + 0.1);
            Rolls {
                travel: reference + off * (20.0 * (t + phase)).sin(),
                reference,
                due: 40.0 + strayed,
                effort: Some(effort * speed.signum()),
                ..ROLLS
            }
        });
        prop_assert_eq!(found, None);
    }

    #[test]
    fn nothing_overflows(inputs in prop::collection::vec(any::<(u32, i64, [i32; 6])>(), 1..60)) {
        let check = CrossCheck::try_build(&Rig::prototype()).expect("a sound rig");
        let mut state = CrossState::default();
        for (now, travel, [radius, preload, due, compression, speed_ref, effort]) in inputs {
            let seen = Compared {
                now,
                read_at: now,
                travel: Travel::from_bits(travel),
                radius: Q16::from_bits(radius),
                preload: Q16::from_bits(preload),
                preload_due: Q16::from_bits(due),
                preload_off: Q16::from_bits(preload) - Q16::from_bits(due),
                compression: Q16::from_bits(compression),
                speed_ref: Q16::from_bits(speed_ref),
                effort: Some(Q16::from_bits(effort)),
            };
            seen.step(&check, &mut state);
            seen.preload(&check, &mut state);
        }
    }
}

/// A tick of a wheel that is this far off a reference at rest, mm.
fn off_by(now: Tick, off: Millimetres) -> Compared {
    Compared {
        now,
        read_at: now,
        travel: off.widen(),
        radius: q16(125_000_000),
        preload: q16(40_000_000),
        preload_due: q16(40_000_000),
        preload_off: Q16::ZERO,
        compression: q16(400_000),
        speed_ref: Q16::ZERO,
        effort: None,
    }
}

/// A drive switched on at tick 0, and 100 ticks of rest after it.
fn rested() -> (CrossCheck, CrossState) {
    let check = CrossCheck::try_build(&Rig::prototype()).expect("a sound rig");
    let mut state = CrossState::default();
    off_by(0, Q16::ZERO).begin(&mut state);
    assert!((0..=100).all(|tick| !off_by(tick, Q16::ZERO).bends(&check, &mut state)));
    (check, state)
}

#[test]
fn across_a_missing_reading_no_distance_is_judged() {
    let far = q16(200_000);
    // The tick's own reading is old, or the tick before was lost.
    let old = Compared { read_at: 100, ..off_by(101, far) };
    for gap in [old, off_by(102, far)] {
        let (check, mut state) = rested();
        assert!(!gap.bends(&check, &mut state));
        for tick in 1..100 {
            assert!(!off_by(gap.now + tick, far).bends(&check, &mut state), "{tick}");
        }
        // From then on it is again.
        assert!(off_by(gap.now + 100, Q16::ZERO).bends(&check, &mut state));
    }
}

#[test]
fn of_what_shows_in_one_tick_the_arm_is_named_before_the_wheel_that_stands() {
    let (check, state) = rested();
    let seen = off_by(state.at.wrapping_add(1), Q16::ZERO);
    // Its reference has gone on by 20 mm, and the arm by 1 mm.
    let ahead = Travel::from_num(20);
    let stands = CrossState {
        reference: ahead,
        past: [Q16::narrow(seen.travel.wrapping_sub(ahead)); 2 * SPAN],
        progress: (seen.travel, Travel::ZERO),
        ..state
    };
    let moves = |by: i32| (seen.radius - Q16::from_num(by), seen.travel);
    for (by, named) in [(0, Fault::DriveStalled), (1, Fault::ArmMismatch)] {
        let mut state = CrossState { arm: moves(by), arm_ticks: 10, ..stands.clone() };
        assert_eq!(seen.step(&check, &mut state), Some(named));
    }
}

#[test]
fn off_by_exactly_the_threshold_is_tolerated() {
    let check = CrossCheck::try_build(&Rig::prototype()).expect("a sound rig");
    // Steadily away from the reference: half of the distance in each span.
    let drifts = |distance: Q16| {
        let mut past = [Q16::ZERO; 2 * SPAN];
        past[SPAN] = distance.half();
        let mut state = CrossState { past, held: 2 * SPAN, ..CrossState::default() };
        off_by(1, distance).bends(&check, &mut state)
    };
    let off = check.off;
    assert!(!drifts(off) && !drifts(-off));
    assert!(drifts(off + Q16::DELTA) && drifts(-off - Q16::DELTA));
    let strays = |off: Newtons| {
        let mut state = CrossState::default();
        let at = off_by(1, Q16::ZERO);
        let seen = Compared { preload: at.preload_due + off, preload_off: off, ..at };
        (0..50).find_map(|_| seen.preload(&check, &mut state))
    };
    assert_eq!(strays(check.strayed), None);
    assert_eq!(strays(-check.strayed), None);
    assert_eq!(strays(check.strayed + Q16::DELTA), Some(Fault::PretightenerRunaway));
    assert!(
        (check.strayed.to_num::<f64>() / Rig::prototype().preload.cruise_n - 0.25).abs() < 1e-4
    );
}

#[test]
fn a_preload_astray_before_the_drive_starts_is_counted_on() {
    let check = CrossCheck::try_build(&Rig::prototype()).expect("a sound rig");
    let astray = |tick: Tick| Compared {
        preload: q16(55_000_000) + Q16::from_bits(i32::from(tick.is_multiple_of(7))),
        preload_off: q16(15_000_000),
        ..off_by(tick, Q16::ZERO)
    };
    let before = STRAYED_TICKS - 3;
    let mut state = CrossState::default();
    for tick in 0..Tick::from(before) {
        let seen = astray(tick);
        assert_eq!(seen.preload(&check, &mut state), None);
    }
    astray(Tick::from(before)).begin(&mut state);
    let start = Tick::from(before);
    let found: Vec<_> = (start..start + 3).map(|t| astray(t).step(&check, &mut state)).collect();
    assert_eq!(found, [None, None, Some(Fault::PretightenerRunaway)]);
}
