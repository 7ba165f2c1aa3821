//! What injected faults do to sensors and actuators.

use super::*;

fn injector(target: Target, kind: Kind, magnitude: f64) -> FaultInjector {
    injecting(Injection::at(target, kind, 0.010, magnitude))
}

fn injecting(fault: Injection) -> FaultInjector {
    let mut scenario = Scenario::default();
    scenario.run.faults = vec![fault];
    FaultInjector::of(&scenario).expect("a fault")
}

/// The first of 100 ticks in which something is so, and in how many it is.
fn ticks(mut of: FaultInjector, is_so: impl Fn(&FaultInjector) -> bool) -> (u32, usize) {
    let so = (0..100u32).filter(|tick| {
        of.begin(f64::from(*tick) * TICK_S, &Truth::default());
        is_so(&of)
    });
    let so: Vec<u32> = so.collect();
    (so[0], so.len())
}

/// Duties that reach the drive when 0.001, 0.002 ... are asked for.
fn duties(kind: Kind, magnitude: f64) -> Vec<f64> {
    let mut injector = injector(Target::Drive, kind, magnitude);
    (1..=30)
        .map(|tick| {
            injector.begin(f64::from(tick) * TICK_S, &Truth::default());
            let drive = f64::from(tick) * 0.001;
            let on = tick != 25;
            injector.drives(Drives { drive, drive_on: on, ..Drives::default() }).worked()[0]
        })
        .collect()
}

#[test]
fn each_kind_changes_the_duty_in_its_own_manner() {
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    for kind in [Kind::Stalled, Kind::Stuck, Kind::Weak, Kind::Reversed, Kind::Delayed] {
        near(duties(kind, 0.005)[8], 0.009);
    }
    near(duties(Kind::Stalled, 0.0)[19], 0.0);
    near(duties(Kind::Off, 0.0)[19], 0.0);
    near(duties(Kind::Stuck, 0.0)[19], 0.010);
    near(duties(Kind::Weak, 0.5)[19], 0.010);
    near(duties(Kind::Reversed, 0.0)[19], -0.020);
    near(duties(Kind::Delayed, 0.005)[19], 0.015);
    near(duties(Kind::Runaway, -1.0)[19], -1.0);
}

#[test]
fn a_fault_behind_the_bridge_does_not_show_at_its_output() {
    for (kind, seen) in
        [(Kind::Stalled, false), (Kind::Weak, false), (Kind::Off, true), (Kind::Reversed, true)]
    {
        let mut injector = injector(Target::Pretightener, kind, 0.4);
        injector.begin(0.020, &Truth::default());
        let asked = Drives { preload: 0.5, preload_on: true, ..Drives::default() };
        let drives = injector.drives(asked);
        assert_eq!(drives.preload != asked.preload, seen, "{kind:?}");
        assert!((drives.worked()[1] - 0.5).abs() > 0.1, "{kind:?}");
        assert_eq!((injector.times().acts_s, injector.times().shows_s), (Some(0.020), Some(0.020)));
    }
}

#[test]
fn a_fault_below_the_band_of_the_readback_acts_too() {
    let mut injector = injector(Target::Drive, Kind::Runaway, 0.5);
    let mut drive = |t_s: f64, drive: f64| {
        injector.begin(t_s, &Truth::default());
        let _ = injector.drives(Drives { drive, drive_on: true, ..Drives::default() });
        (injector.times().acts_s, injector.times().shows_s)
    };
    assert_eq!(drive(0.010, 0.49), (None, None));
    assert_eq!(drive(0.011, 0.45), (Some(0.011), None));
    assert_eq!(drive(0.012, 0.40), (Some(0.011), Some(0.012)));
}

#[test]
fn a_bridge_regulates_by_the_speed_of_its_motor() {
    let mut injector = injector(Target::Drive, Kind::Regulating, 0.5);
    let mut given = |speed_part: f64, drive: f64| {
        let tread_mm_s = speed_part * injector.faults[0].no_load_mm_s;
        injector.begin(0.020, &Truth { tread_mm_s, ..Truth::default() });
        injector.drives(Drives { drive, drive_on: true, ..Drives::default() }).drive
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    near(given(0.0, 0.9), 0.5);
    near(given(0.25, 0.9), 0.75);
    near(given(0.25, 0.6), 0.6);
    near(given(-0.7, 0.3), 0.0);
    near(given(0.8, -0.1), 0.0);
}

#[test]
fn a_bridge_that_is_off_stays_off() {
    assert_eq!(duties(Kind::Runaway, 1.0)[24], 0.025);
    assert_eq!(duties(Kind::Runaway, 1.0)[25], 1.0);
}

#[test]
fn ticks_are_lost_once_for_as_long_as_asked_and_a_fault_ends_when_its_time_is_over() {
    let overrun = injector(Target::Tick, Kind::Overrun, 0.003);
    assert_eq!(ticks(overrun, FaultInjector::lost), (10, 3));
    let hung = Injection::at(Target::Model, Kind::Hung, 0.010, 0.0);
    let injector = injecting(Injection { duration_s: Some(0.005), ..hung });
    assert_eq!(ticks(injector, FaultInjector::model_hangs), (10, 5));
}

#[test]
fn a_crossing_counts_once_however_its_corner_chatters() {
    let mut fault = Injection::at(Target::Log, Kind::Gone, 0.0, 0.0);
    (fault.at_s, fault.at_crossing) = (None, Some(2));
    let mut injector = injecting(fault);
    let mut at = |position_mm: f64, corner_n: f64| {
        injector.begin(0.0, &Truth { position_mm, corner_n, ..Truth::default() });
        injector.log_gone()
    };
    assert!(!at(0.0, 0.0) && !at(8.0, 3.0) && !at(9.0, 0.0) && !at(9.5, 3.0));
    assert!(at(30.0, 4.0));
}
