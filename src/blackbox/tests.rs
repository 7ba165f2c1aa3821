//! Records as words, and what a start makes of them.

use super::*;
use crate::estimate::PositionConfidence;
use crate::fault::Fault;
use crate::supervise::{Leg, Mode};
use crate::tick::Telemetry;
use crate::units::{Direction, Q16};
use proptest::prelude::*;

fn flight() -> impl Strategy<Value = Flight> {
    let bits = (any::<u8>(), any::<u8>(), any::<u16>(), any::<u16>(), any::<i16>());
    (any::<u32>(), any::<i32>(), bits).prop_map(
        |(tick, position, (mode, level, fault, late, pace))| Flight {
            tick,
            position: Q16::from_bits(position),
            mode,
            level,
            fault,
            late: Late::from_bits(late),
            pace: Pace(pace),
        },
    )
}

fn crash() -> impl Strategy<Value = Crash> {
    (any::<u32>(), 0..5, any::<[u32; 4]>()).prop_map(|(build, kind, [a, b, c, d])| Crash {
        build,
        stopped: match kind {
            0 => Stopped::Panic { place: a, line: b },
            1 => Stopped::Fault { pc: a, lr: b, cfsr: c, hfsr: d },
            2 => Stopped::Hang { pc: a, lr: b, late: Late::from_bits(c as u16), at: d },
            3 => Stopped::Supply,
            _ => Stopped::Image,
        },
    })
}

proptest! {
    #[test]
    fn a_record_is_read_as_it_was_kept(flight in flight(), crash in crash()) {
        prop_assert_eq!(Flight::open(&flight.seal()), Some(flight));
        prop_assert_eq!(Crash::open(&crash.seal()), Some(crash));
    }

    #[test]
    fn a_word_that_changed_makes_it_none(
        flight in flight(),
        crash in crash(),
        at in any::<prop::sample::Index>(),
        change in 1_u32..,
    ) {
        let mut words = flight.seal();
        words[at.index(FLIGHT_WORDS)] ^= change;
        prop_assert_eq!(Flight::open(&words), None);
        let mut words = crash.seal();
        words[at.index(CRASH_WORDS)] ^= change;
        prop_assert_eq!(Crash::open(&words), None);
    }

    #[test]
    fn memory_that_was_never_written_is_none(
        flight in any::<[u32; FLIGHT_WORDS]>(),
        crash in any::<[u32; CRASH_WORDS]>(),
        same in any::<u8>(),
    ) {
        prop_assert_eq!(Flight::open(&flight), None);
        prop_assert_eq!(Crash::open(&crash), None);
        let same = u32::from_le_bytes([same; 4]);
        prop_assert_eq!(Flight::open(&[same; FLIGHT_WORDS]), None);
        prop_assert_eq!(Crash::open(&[same; CRASH_WORDS]), None);
    }
}

#[test]
fn the_later_place_counts_also_when_the_clock_wraps() {
    let at = |tick| Some(Flight::open(&[0; 5]).unwrap_or(Flight { tick, ..EMPTY }));
    assert_eq!(later(at(7), at(8)), at(8));
    assert_eq!(later(at(8), at(7)), at(8));
    assert_eq!(later(at(u32::MAX), at(0)), at(0));
    assert_eq!(later(at(0), at(u32::MAX)), at(0));
    assert_eq!((later(None, at(3)), later(at(3), None)), (at(3), at(3)));
    assert_eq!(later(None, None), None);
}

const EMPTY: Flight = Flight {
    tick: 0,
    position: Q16::ZERO,
    mode: 0,
    level: 0,
    fault: 0,
    late: Late::NOBODY,
    pace: Pace(0),
};

#[test]
fn a_pace_is_the_speed_to_a_32nd() {
    for (speed, placed) in [(0.0, true), (47.3, false), (-47.3, true), (-511.9, false)] {
        let pace = Pace::of(Q16::from_num(speed), placed);
        let read = pace.speed().to_num::<f64>();
        assert!((read - speed).abs() <= 1.0 / 32.0, "{read} for {speed}");
        assert_eq!(pace.placed(), placed);
    }
    assert!(Pace::of(Q16::MIN, true).speed() < Q16::from_num(-511));
}

#[test]
fn the_place_is_the_record_s_and_the_way_gone_after_it() {
    let pace = Pace::of(Q16::from_num(-40), true);
    let flight = Flight { tick: 900, position: Q16::from_num(30), pace, ..EMPTY };
    let restart = |reset, crash| Restart { reset, flight: Some(flight), crash };
    let at = |restart: Restart| {
        restart.place().map(|place| (place.position.to_num::<f64>(), place.sure))
    };
    let near = |restart, mm: f64, sure| {
        let (position, told) = at(restart).expect("a place");
        assert!((position - mm).abs() < 1e-3 && told == sure, "{restart}: {position}");
    };
    near(restart(Reset::Pin, None), 29.92, true);
    near(restart(Reset::Watchdog, None), 30.0 - 40.0 * 0.102, false);
    let crash = |stopped| Some(Crash { build: 1, stopped });
    let hang = |at| crash(Stopped::Hang { pc: 0, lr: 0, late: Late::TICK, at });
    near(restart(Reset::Watchdog, hang(900)), 29.92, true);
    near(restart(Reset::Watchdog, hang(975)), 30.0 - 40.0 * 0.077, false);
    near(restart(Reset::Software, crash(Stopped::Panic { place: 1, line: 2 })), 29.92, true);
    // A dip, one that lasts until the watchdog bites, and a supply that was away: nobody
    // knows for how long.
    near(restart(Reset::Software, crash(Stopped::Supply)), 29.92, false);
    near(restart(Reset::Watchdog, crash(Stopped::Supply)), 29.92, false);
    near(restart(Reset::Pin, crash(Stopped::Supply)), 29.92, false);
    near(restart(Reset::Power, crash(Stopped::Supply)), 29.92, false);
    // Not confirmed by any step.
    let since = Flight { level: Flight::UNSURE | 2, ..flight };
    near(Restart { flight: Some(since), ..restart(Reset::Pin, None) }, 29.92, false);
    let lost = Flight { pace: Pace::of(Q16::from_num(-40), false), ..flight };
    assert_eq!(Restart { flight: Some(lost), ..restart(Reset::Pin, None) }.place(), None);
    let held = Flight { fault: 123, ..flight };
    assert_eq!(Restart { flight: Some(held), ..restart(Reset::Pin, None) }.place(), None);
    let stopped = Flight { fault: Fault::EmergencyStop.code(), ..flight };
    near(Restart { flight: Some(stopped), ..restart(Reset::Pin, None) }, 29.92, true);
    assert_eq!(Restart { flight: None, ..restart(Reset::Power, None) }.place(), None);
}

/// A reset before the first tick finds what the start before it made of the record.
#[test]
fn what_a_start_keeps_is_where_the_wheel_came_to_rest_and_unsure() {
    let pace = Pace::of(Q16::from_num(40), true);
    let flight = Flight { tick: 900, position: Q16::from_num(30), level: 1, pace, ..EMPTY };
    let hang = Stopped::Hang { pc: 0, lr: 0, late: Late::TICK, at: 975 };
    let crash = Some(Crash { build: 1, stopped: hang });
    let hung = Restart { reset: Reset::Watchdog, flight: Some(flight), crash };
    let sure = Restart { reset: Reset::Pin, crash: None, ..hung };
    for (first, way) in [(hung, 40.0 * 0.077), (sure, 40.0 * 0.002)] {
        let kept = first.standing().expect("a record");
        assert_eq!((kept.tick, kept.level), (900, Flight::UNSURE | 1));
        let again = Restart { reset: Reset::Pin, flight: Some(kept), crash: None };
        let place = again.place().expect("a place");
        assert!((place.position.to_num::<f64>() - 30.0 - way).abs() < 1e-3 && !place.sure);
        // And a third changes nothing more.
        assert_eq!(again.standing(), Some(kept));
    }
    // What was a guess stays one; what was a fault too.
    let guess = Flight { pace: Pace::of(Q16::from_num(40), false), ..flight };
    let held = Flight { fault: 123, ..flight };
    for flight in [guess, held] {
        let kept = Restart { flight: Some(flight), ..hung }.standing().expect("a record");
        assert_eq!(kept, Flight { level: Flight::UNSURE | 1, ..flight });
        let again = Restart { reset: Reset::Pin, flight: Some(kept), crash: None };
        assert_eq!(again.place(), None);
    }
    assert_eq!(Restart { flight: None, ..hung }.standing(), None);
}

#[test]
fn the_last_fault_is_kept_beyond_its_hold() {
    let mut recorder = Recorder::default();
    let mut row = Telemetry { at: 5, level: 2, position: Q16::from_num(41), ..Telemetry::EMPTY };
    assert_eq!(
        recorder.flight(&row, PositionConfidence::Sure, Late::NOBODY).mode(),
        Some(Mode::Boot)
    );
    row.mode = Mode::Run(Direction::Deploy, Leg::Crossing);
    let flight = recorder.flight(&row, PositionConfidence::Sure, Late::TICK);
    assert_eq!((flight.mode(), flight.fault), (Some(row.mode), 0));
    assert_eq!((flight.tick, flight.level, flight.position), (5, 2, row.position));
    assert_eq!(flight.late, Late::TICK);
    assert!(flight.pace.placed());
    let unsure = recorder.flight(&row, PositionConfidence::Unsure, Late::TICK);
    assert_eq!(unsure, Flight { level: Flight::UNSURE | 2, ..flight });
    row.mode = Mode::FaultHold(Fault::DriveStalled);
    assert_eq!(
        recorder.flight(&row, PositionConfidence::Guess, Late::NOBODY).mode(),
        Some(row.mode)
    );
    row.mode = Mode::Idle;
    let flight = recorder.flight(&row, PositionConfidence::Guess, Late::NOBODY);
    assert!(!flight.pace.placed());
    assert_eq!((flight.mode(), flight.fault), (Some(Mode::Idle), 122));
}

#[test]
fn a_report_names_what_is_known() {
    let restart = Restart { reset: Reset::Power, flight: None, crash: None };
    assert_eq!(restart.to_string(), "started: power came up");
    let hung = Restart { reset: Reset::Watchdog, ..restart };
    assert_eq!(hung.to_string(), "started: by the watchdog; a hang with interrupts shut out");
    let crash = |stopped| Some(Crash { build: 1, stopped });
    let fell = Restart { crash: crash(Stopped::Supply), ..restart };
    assert_eq!(fell.to_string(), "started: power came up; the supply fell too low");
    let turned = Restart { reset: Reset::Software, crash: crash(Stopped::Image), ..restart };
    let text = "started: by software or debugger; a bit of the image had turned over";
    assert_eq!(turned.to_string(), text);
    let away = Flight { tick: 9, mode: 6, level: Flight::UNSURE | 1, ..EMPTY };
    let again = Restart { reset: Reset::Pin, flight: Some(away), crash: None };
    assert_eq!(
        again.to_string(),
        "started: by the reset pin; before: Run(Deploy, Approach) at tick 9, 0.00 mm, level 1, \
         its place unsure"
    );
    let flight = Flight { tick: 9, mode: 6, level: 1, fault: 122, late: Late::TICK, ..EMPTY };
    let stopped = Stopped::Hang { pc: 16, lr: 32, late: Late::STARVED, at: 80 };
    let crash = Some(Crash { build: 1, stopped });
    let text = Restart { reset: Reset::Watchdog, flight: Some(flight), crash }.to_string();
    assert_eq!(
        text,
        "started: by the watchdog; the control tick, kept from the processor did not come, \
         at 0x10 from 0x20; before: Run(Deploy, Approach) at tick 9, 0.00 mm, level 1, \
         last fault 122, the control tick was late"
    );
}

#[test]
fn everyone_has_a_name() {
    assert_eq!(Late::NOBODY.name(), "nobody");
    assert!(Late::NOBODY.is_nobody() && !Late::TICK.is_nobody());
    let names: std::collections::BTreeSet<_> =
        (0..16).map(|bit| Late::from_bits(1 << bit).name()).collect();
    assert_eq!(names.len(), 9, "{names:?}");
    let both = Late::TICK.and(Late::station(1));
    assert_eq!((both.name(), both.last()), ("pressure", Some(Late::TICK)));
    assert_eq!(Late::NOBODY.last(), None);
    assert_eq!(Late::STARVED.name(), "the control tick, kept from the processor");
}
