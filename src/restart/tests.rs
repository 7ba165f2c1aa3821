//! Records as words, and what a start makes of them.

use super::*;
use crate::fault::Fault;
use crate::sense::Zeros;
use crate::units::Q16;
use proptest::prelude::*;

fn snapshot() -> impl Strategy<Value = DriveSnapshot> {
    let bits =
        (any::<u8>(), any::<u8>(), any::<u16>(), any::<u16>(), any::<i16>(), any::<(i16, i16)>());
    (any::<u32>(), any::<i32>(), bits).prop_map(
        |(tick, position, (mode, level, fault, missed, packed_speed, zeros))| DriveSnapshot {
            tick,
            position: Q16::from_bits(position),
            mode,
            level,
            fault,
            missed: MissedCheckIns(missed),
            packed_speed: PackedSpeed(packed_speed),
            packed_zeros: PackedZeros(zeros.0, zeros.1),
        },
    )
}

fn crash() -> impl Strategy<Value = Crash> {
    (any::<u32>(), 0..5, any::<[u32; 4]>()).prop_map(|(build, kind, [a, b, c, d])| Crash {
        build,
        stopped: match kind {
            0 => Stopped::Panic { place: a, line: b },
            1 => Stopped::Fault { pc: a, lr: b, cfsr: c, hfsr: d },
            2 => Stopped::Hang { pc: a, lr: b, missed: MissedCheckIns(c as u16), at: d },
            3 => Stopped::Supply,
            _ => Stopped::Image,
        },
    })
}

proptest! {
    #[test]
    fn a_record_is_read_as_it_was_kept(snapshot in snapshot(), crash in crash()) {
        prop_assert_eq!(DriveSnapshot::open(&snapshot.seal()), Some(snapshot));
        prop_assert_eq!(Crash::open(&crash.seal()), Some(crash));
    }

    #[test]
    fn a_word_that_changed_makes_it_none(
        snapshot in snapshot(),
        crash in crash(),
        at in any::<prop::sample::Index>(),
        change in 1_u32..,
    ) {
        let mut words = snapshot.seal();
        words[at.index(SNAPSHOT_WORDS)] ^= change;
        prop_assert_eq!(DriveSnapshot::open(&words), None);
        let mut words = crash.seal();
        words[at.index(CRASH_WORDS)] ^= change;
        prop_assert_eq!(Crash::open(&words), None);
    }

    #[test]
    fn memory_that_was_never_written_is_none(
        snapshot in any::<[u32; SNAPSHOT_WORDS]>(),
        crash in any::<[u32; CRASH_WORDS]>(),
        same in any::<u8>(),
    ) {
        prop_assert_eq!(DriveSnapshot::open(&snapshot), None);
        prop_assert_eq!(Crash::open(&crash), None);
        let same = u32::from_le_bytes([same; 4]);
        prop_assert_eq!(DriveSnapshot::open(&[same; SNAPSHOT_WORDS]), None);
        prop_assert_eq!(Crash::open(&[same; CRASH_WORDS]), None);
    }
}

#[test]
fn the_later_place_counts_also_when_the_clock_wraps() {
    let at = |tick| Some(DriveSnapshot { tick, ..EMPTY });
    for (before, after) in [(7, 8), (u32::MAX, 0)] {
        assert_eq!(later(at(before), at(after)), at(after));
        assert_eq!(later(at(after), at(before)), at(after));
    }
    assert_eq!((later(None, at(3)), later(at(3), None)), (at(3), at(3)));
    assert_eq!(later(None, None), None);
}

const EMPTY: DriveSnapshot = DriveSnapshot {
    tick: 0,
    position: Q16::ZERO,
    mode: 0,
    level: 0,
    fault: 0,
    missed: MissedCheckIns::NOBODY,
    packed_speed: PackedSpeed(0),
    packed_zeros: PackedZeros(0, 0),
};

#[test]
fn zeros_are_kept_to_a_noise_s_part() {
    for (preload, compression) in [(0.0, 0.0), (3.0, 0.1), (-6.0, -0.15), (60.0, 1.5)] {
        let zeros =
            Zeros { preload: Q16::from_num(preload), compression: Q16::from_num(compression) };
        let read = PackedZeros::of(zeros).zeros();
        assert!((read.preload.to_num::<f64>() - preload).abs() < 0.004, "{read:?}");
        assert!((read.compression.to_num::<f64>() - compression).abs() < 1e-4, "{read:?}");
    }
}

#[test]
fn a_pace_is_the_speed_to_a_32nd() {
    for (speed, placed) in [(0.0, true), (47.3, false), (-47.3, true), (-511.9, false)] {
        let packed_speed = PackedSpeed::of(Q16::from_num(speed), placed);
        let read = packed_speed.speed().to_num::<f64>();
        assert!((read - speed).abs() <= 1.0 / 32.0, "{read} for {speed}");
        assert_eq!(packed_speed.placed(), placed);
    }
    assert!(PackedSpeed::of(Q16::MIN, true).speed() < Q16::from_num(-511));
}

#[test]
fn the_place_is_the_record_s_and_the_way_gone_after_it() {
    let packed_speed = PackedSpeed::of(Q16::from_num(-40), true);
    let snapshot = DriveSnapshot { tick: 900, position: Q16::from_num(30), packed_speed, ..EMPTY };
    let restart = |reset, crash| Restart { reset, snapshot: Some(snapshot), crash };
    let near = |restart: Restart, mm: f64, sure| {
        let place = restart.place().expect("a place");
        let position = place.position.to_num::<f64>();
        assert!((position - mm).abs() < 1e-3 && place.sure == sure, "{restart}: {position}");
    };
    near(restart(Reset::Pin, None), 29.92, true);
    near(restart(Reset::Watchdog, None), 30.0 - 40.0 * 0.102, false);
    let crash = |stopped| Some(Crash { build: 1, stopped });
    let hang = |at| crash(Stopped::Hang { pc: 0, lr: 0, missed: MissedCheckIns::TICK, at });
    near(restart(Reset::Watchdog, hang(900)), 29.92, true);
    near(restart(Reset::Watchdog, hang(975)), 30.0 - 40.0 * 0.077, false);
    near(restart(Reset::Software, crash(Stopped::Panic { place: 1, line: 2 })), 29.92, true);
    // A dip, one that lasts until the watchdog bites, and a supply that was away: nobody
    // knows for how long.
    for reset in [Reset::Software, Reset::Watchdog, Reset::Pin, Reset::Power] {
        near(restart(reset, crash(Stopped::Supply)), 29.92, false);
    }
    // Not confirmed by any step.
    let since = DriveSnapshot { level: DriveSnapshot::UNSURE | 2, ..snapshot };
    near(Restart { snapshot: Some(since), ..restart(Reset::Pin, None) }, 29.92, false);
    let lost =
        DriveSnapshot { packed_speed: PackedSpeed::of(Q16::from_num(-40), false), ..snapshot };
    assert_eq!(Restart { snapshot: Some(lost), ..restart(Reset::Pin, None) }.place(), None);
    let held = DriveSnapshot { fault: 123, ..snapshot };
    assert_eq!(Restart { snapshot: Some(held), ..restart(Reset::Pin, None) }.place(), None);
    let stopped = DriveSnapshot { fault: Fault::EmergencyStop.code(), ..snapshot };
    near(Restart { snapshot: Some(stopped), ..restart(Reset::Pin, None) }, 29.92, true);
    assert_eq!(Restart { snapshot: None, ..restart(Reset::Power, None) }.place(), None);
}

/// A reset before the first tick finds what the start before it made of the record.
#[test]
fn what_a_start_keeps_is_where_the_wheel_came_to_rest_and_unsure() {
    let packed_speed = PackedSpeed::of(Q16::from_num(40), true);
    let snapshot =
        DriveSnapshot { tick: 900, position: Q16::from_num(30), level: 1, packed_speed, ..EMPTY };
    let hang = Stopped::Hang { pc: 0, lr: 0, missed: MissedCheckIns::TICK, at: 975 };
    let crash = Some(Crash { build: 1, stopped: hang });
    let hung = Restart { reset: Reset::Watchdog, snapshot: Some(snapshot), crash };
    let sure = Restart { reset: Reset::Pin, crash: None, ..hung };
    for (first, travel) in [(hung, 40.0 * 0.077), (sure, 40.0 * 0.002)] {
        let kept = first.at_start().expect("a record");
        assert_eq!((kept.tick, kept.level), (900, DriveSnapshot::UNSURE | 1));
        let again = Restart { reset: Reset::Pin, snapshot: Some(kept), crash: None };
        let place = again.place().expect("a place");
        assert!((place.position.to_num::<f64>() - 30.0 - travel).abs() < 1e-3 && !place.sure);
        // And a third changes nothing more.
        assert_eq!(again.at_start(), Some(kept));
    }
    // What was a guess stays one; what was a fault too.
    let guess =
        DriveSnapshot { packed_speed: PackedSpeed::of(Q16::from_num(40), false), ..snapshot };
    let held = DriveSnapshot { fault: 123, ..snapshot };
    for snapshot in [guess, held] {
        let kept = Restart { snapshot: Some(snapshot), ..hung }.at_start().expect("a record");
        assert_eq!(kept, DriveSnapshot { level: DriveSnapshot::UNSURE | 1, ..snapshot });
        let again = Restart { reset: Reset::Pin, snapshot: Some(kept), crash: None };
        assert_eq!(again.place(), None);
    }
    assert_eq!(Restart { snapshot: None, ..hung }.at_start(), None);
}

#[test]
fn a_report_names_what_is_known() {
    let power = Restart { reset: Reset::Power, snapshot: None, crash: None };
    let crash = |stopped| Some(Crash { build: 1, stopped });
    let away = DriveSnapshot { tick: 9, mode: 6, level: DriveSnapshot::UNSURE | 1, ..EMPTY };
    let missed = MissedCheckIns::TICK;
    let late = DriveSnapshot { level: 1, fault: 122, missed, ..away };
    let hang = Stopped::Hang { pc: 16, lr: 32, missed: MissedCheckIns::STARVED, at: 80 };
    let watchdog = Restart { reset: Reset::Watchdog, ..power };
    for (restart, text) in [
        (power, "power came up"),
        (watchdog, "by the watchdog; a hang with interrupts shut out"),
        (
            Restart { crash: crash(Stopped::Supply), ..power },
            "power came up; the supply fell too low",
        ),
        (
            Restart { reset: Reset::Software, crash: crash(Stopped::Image), ..power },
            "by software or debugger; a bit of the image had turned over",
        ),
        (
            Restart { reset: Reset::Pin, snapshot: Some(away), crash: None },
            "by the reset pin; before: deploying: approach at 0.009 s, 0.00 mm, level 1, \
             its place unsure",
        ),
        (
            Restart { snapshot: Some(late), crash: crash(hang), ..watchdog },
            "by the watchdog; the control tick, kept from the processor did not come, \
             at 0x10 from 0x20; before: deploying: approach at 0.009 s, 0.00 mm, level 1, \
             last fault 122, the control tick was late",
        ),
    ] {
        assert_eq!(restart.to_string(), format!("started: {text}"));
    }
}

#[test]
fn everyone_has_a_name() {
    assert_eq!(MissedCheckIns::NOBODY.name(), "nobody");
    assert!(MissedCheckIns::NOBODY.is_nobody() && !MissedCheckIns::TICK.is_nobody());
    let names: std::collections::BTreeSet<_> =
        (0..16).map(|bit| MissedCheckIns(1 << bit).name()).collect();
    assert_eq!(names.len(), 9, "{names:?}");
    assert_eq!(MissedCheckIns::TICK.and(MissedCheckIns::task(1)).name(), "preload sensor");
    assert_eq!(MissedCheckIns::STARVED.name(), "the control tick, kept from the processor");
}
