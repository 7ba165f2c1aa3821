use super::*;
use crate::sense::Reading;
use crate::sense::raw::BridgeCode;
use crate::supervise::Leg;
use crate::units::{Direction, Duty, Q16, Travel};
use proptest::prelude::*;

const RUN: Mode = Mode::Run(Direction::Deploy, Leg::Cruise);
/// Readback of bridges that are off.
const IDLE: BridgeCodes = BridgeCodes { drive: BridgeCode::of(0), pretightener: BridgeCode::of(0) };

fn sensed(speed: f64, preload: f64) -> SensedState {
    let reading =
        |value: f64| Reading { value: Q16::from_num(value), at: 0, validity: Validity::Valid };
    SensedState {
        travel: Travel::ZERO,
        speed: reading(speed),
        preload: reading(preload),
        preload_filtered: Q16::from_num(preload),
        compression: reading(0.3),
        compression_filtered: Q16::from_num(0.3),
        radius: reading(125.0),
        tan_arm: Q16::from_num(1),
        steps_up: Q16::ZERO,
        level: 0,
    }
}

#[test]
fn each_sensor_s_state_has_its_fault() {
    let states = [
        (Validity::Valid, None),
        (Validity::Held(Reason::OutOfRange), None),
        (Validity::Absent, Some(0)),
        (Validity::Stale, Some(0)),
        (Validity::Invalid(Reason::OutOfRange), Some(1)),
    ];
    let faults = [
        [Fault::WheelEncoderStale, Fault::WheelEncoderStale],
        [Fault::PreloadSensorStale, Fault::PreloadSensorRange],
        [Fault::CompressionSensorStale, Fault::CompressionSensorRange],
        [Fault::ArmAngleStale, Fault::ArmAngleRange],
    ];
    for (validity, expected) in states {
        for (sensor, faults) in faults.iter().enumerate() {
            let mut sensed = sensed(0.0, 40.0);
            *sensed.validities_mut()[sensor] = validity;
            assert_eq!(sensor_fault(&sensed, true), expected.map(|which: usize| faults[which]));
        }
    }
}

/// A tick in this mode with all references zero and the bridges off.
fn observed(mode: Mode, sensed: &SensedState) -> Observed<'_> {
    Observed {
        now: 0,
        mode,
        sensed,
        travel: sensed.travel,
        wound: Q16::ZERO,
        bridges: Some(IDLE),
        speed_ref: Q16::ZERO,
        preload_due: Q16::ZERO,
        effort: None,
        overrun: false,
        emergency_stop: false,
    }
}

/// Ticks until a fault under a condition that lasts; `None` within five seconds.
fn found(mode: Mode, speed: f64, wanted: f64, preload: f64, due: f64) -> Option<(Fault, usize)> {
    let monitor = Monitor::try_build(&Rig::prototype()).unwrap();
    let mut state = MonitorState::default();
    let mut sensed = sensed(speed, preload);
    (1..5000).find_map(|tick| {
        // Travel at this speed, and codes that are alive.
        sensed.travel = Travel::from_num(speed * tick as f64 * 1e-3);
        sensed.speed.at = tick as Tick;
        sensed.preload.value = Q16::from_num(preload) + Q16::from_bits(tick as i32 % 50);
        sensed.compression.value += Q16::from_bits(if tick % 2 == 0 { 1 } else { -1 });
        let seen = Observed {
            now: tick as Tick,
            speed_ref: Q16::from_num(wanted),
            preload_due: Q16::from_num(due),
            ..observed(mode, &sensed)
        };
        monitor.step(&mut state, &seen).map(|fault| (fault, tick))
    })
}

#[test]
fn what_the_wheel_moves_the_spring_by_is_excused_until_the_loop_has_answered() {
    let monitor = Monitor::try_build(&Rig::prototype()).unwrap();
    // Down a step of 4 mm the spring of 1.2 N/mm yields by 4.8 N.
    let off = |radius: f64, ticks: usize| {
        let mut state = MonitorState::default();
        let mut sensed = sensed(8.0, 36.0);
        let of = |sensed: &SensedState, state: &mut MonitorState| {
            let due = q16(40_000_000);
            let seen = Observed { preload_due: due, ..observed(RUN, sensed) };
            monitor.off(state, &seen, true).to_num::<f64>()
        };
        of(&sensed, &mut state);
        sensed.radius.value += Q16::from_num(radius);
        (0..ticks).map(|_| of(&sensed, &mut state)).last()
    };
    let near = |radius, ticks, expected: f64| {
        let off = off(radius, ticks).unwrap();
        assert!((off - expected).abs() < 0.05, "{radius} {ticks}: {off}");
    };
    near(0.0, 1, -4.0);
    near(4.0, 1, 0.0);
    // Up a step it rises: that excuses no preload that is short.
    near(-4.0, 1, -4.0);
    near(4.0, 3000, -4.0);
}

#[test]
fn each_condition_is_found_in_its_time() {
    let pressed = Some((Fault::Overpressure, usize::from(OVERPRESSURE_TICKS)));
    let turns = Some((Fault::DriveRunaway, usize::from(RUNAWAY_TICKS)));
    let preload = Mode::Preload(Direction::Deploy);
    for (mode, [speed, wanted, preload, due], expected) in [
        // In motion even if commanded.
        (RUN, [8.0, 8.0, 56.0, 48.0], pressed),
        (RUN, [8.0, 8.0, 56.0, 56.0], pressed),
        (RUN, [8.0, 8.0, 40.0, 48.0], Some((Fault::PreloadNotReached, 490))),
        (Mode::Idle, [8.0, 0.0, 48.0, 48.0], turns),
        // A preload left over can be relieved.
        (Mode::Idle, [0.0, 0.0, 60.0, 0.0], None),
        (preload, [0.0, 0.0, 60.0, 60.0], None),
        // A tenth of the 33.3 N above what is due there, and still less than the quarter that
        // shows a runaway pre-tightener.
        (preload, [0.0, 0.0, 60.0, 57.0], None),
        (preload, [0.0, 0.0, 60.0, 56.0], pressed),
        (Mode::Service, [0.0, 0.0, 56.0, 0.0], pressed),
        (Mode::Service, [0.0, 0.0, 16.0, 0.0], None),
        (Mode::Service, [8.0, 0.0, 0.0, 0.0], turns),
    ] {
        let found = found(mode, speed, wanted, preload, due);
        assert_eq!(found, expected, "{mode:?} {speed} {preload} {due}");
    }
    assert!(found(preload, 0.0, 0.0, 60.0, 40.0).is_some());
    for speed in [30.0, -8.0] {
        let (fault, tick) = found(RUN, speed, 8.0, 48.0, 48.0).expect("found");
        assert!(fault == Fault::DriveRunaway && tick < 16, "{fault:?} {tick}");
    }
    let (fault, tick) = found(RUN, 0.0, 8.0, 48.0, 48.0).expect("found");
    // One that starts with a jerk, which no profile does, bends away at once.
    let stalled = matches!(fault, Fault::DriveStalled | Fault::DriveRunaway);
    assert!(stalled && tick < 60, "{fault:?} {tick}");
}

/// First fault of a drive whose preload sensor changes its code in one of `quiet` ticks, or
/// never from tick `stuck` on; the preload is built up at 25 N/s from tick 300, and the wheel
/// rolls from tick 3000.
fn with_noise(quiet: i32, stuck: i32) -> Option<(Fault, i32)> {
    let monitor = Monitor::try_build(&Rig::prototype()).unwrap();
    let mut state = MonitorState::default();
    let mut preload = Q16::ZERO;
    (1..30_000).find_map(|tick| {
        let (mode, built) = match tick {
            ..300 => (Mode::SelfTest, 0.0),
            300..3000 => (Mode::Preload(Direction::Deploy), f64::from(tick - 300) * 0.025),
            _ => (RUN, 33.3),
        };
        let (built, travel) = (built.min(33.3), 8e-3 * f64::from((tick - 3000).max(0)));
        if tick < stuck {
            let noise = if (tick.wrapping_mul(7919) % 1009) < 1009 / quiet { 200 } else { 0 };
            preload = Q16::from_num(built) + Q16::from_bits(noise);
        }
        let mut sensed = sensed(if mode == RUN { 8.0 } else { 0.0 }, 0.0);
        sensed.travel = Travel::from_num(travel);
        sensed.speed.at = tick as Tick;
        sensed.preload.value = preload;
        sensed.compression.value += Q16::from_bits(if tick % 2 == 0 { 1 } else { -1 });
        let seen = Observed {
            now: tick as Tick,
            speed_ref: sensed.speed.value,
            preload_due: Q16::from_num(built),
            ..observed(mode, &sensed)
        };
        monitor.step(&mut state, &seen).map(|fault| (fault, tick))
    })
}

#[test]
fn a_sensor_is_stuck_by_its_own_noise() {
    // One that changes its code in every other tick, and one that hardly does.
    for quiet in [2, 40] {
        assert_eq!(with_noise(quiet, i32::MAX), None, "{quiet}");
    }
    let (fault, tick) = with_noise(2, 10_000).expect("found");
    assert!(fault == Fault::PreloadSensorImplausible && tick < 10_150, "{fault:?} {tick}");
    let (fault, tick) = with_noise(40, 10_000).expect("found");
    assert!(fault == Fault::PreloadSensorImplausible && tick < 13_000, "{fault:?} {tick}");
    // Stuck from the start on, as soon as the preload has to rise.
    let (fault, tick) = with_noise(2, 1).expect("found");
    assert!(fault == Fault::PreloadSensorImplausible && tick < 500, "{fault:?} {tick}");
}

#[test]
fn a_wheel_driven_in_the_service_mode_may_turn_and_for_a_moment_after() {
    let monitor = Monitor::try_build(&Rig::prototype()).unwrap();
    let mut state = MonitorState::default();
    let turning = sensed(8.0, 0.0);
    let fault = (0..1000).find_map(|tick| {
        let duty = Duty::from_bits(if tick < 500 { 4369 } else { 0 });
        let code = BridgeCode::of(duty.to_bits().into());
        let codes = BridgeCodes { drive: code, pretightener: BridgeCode::of(0) };
        state.readback.set_duties(duty, Duty::ZERO);
        let seen = Observed { bridges: Some(codes), ..observed(Mode::Service, &turning) };
        monitor.step(&mut state, &seen).map(|fault| (fault, tick))
    });
    // At a step of the duty the readback's own lag is within its tolerance.
    let until = 500 + usize::from(COAST_TICKS + RUNAWAY_TICKS) - 2;
    assert_eq!(fault, Some((Fault::DriveRunaway, until)));
}

#[test]
fn a_late_tick_and_the_emergency_stop_are_faults_at_once() {
    let monitor = Monitor::try_build(&Rig::prototype()).unwrap();
    let sensed = sensed(0.0, 0.0);
    let mut seen = Observed { overrun: true, ..observed(Mode::Idle, &sensed) };
    let mut state = MonitorState::default();
    assert_eq!(monitor.step(&mut state, &seen), Some(Fault::TickOverrun));
    seen.emergency_stop = true;
    assert_eq!(monitor.step(&mut state, &seen), Some(Fault::EmergencyStop));
    seen.mode = Mode::FaultHold(Fault::TickOverrun);
    assert_eq!(monitor.step(&mut state, &seen), None);
}

proptest! {
    #[test]
    fn a_drive_near_its_references_raises_no_alarm(
        wanted in 1.0..30.0f64,
        off in -0.1..0.1f64,
        preload in 33.0..50.0f64,
        lag in -3.0..3.0f64,
    ) {
        let speed = wanted * (1.0 + off);
        prop_assert_eq!(found(RUN, speed, wanted, preload, preload + lag), None);
    }
}

#[test]
fn what_a_wheel_generates_is_excused_in_the_self_test_alone() {
    let found = |mode: Mode| {
        let monitor = Monitor::try_build(&Rig::prototype()).unwrap();
        let mut state = MonitorState::default();
        let sensed = sensed(0.0, 0.0);
        let generates = BridgeCodes { drive: BridgeCode::of(3000), ..IDLE };
        (0..40).find_map(|now| {
            let bridges = Some(generates);
            let seen = Observed { now, bridges, ..observed(mode, &sensed) };
            monitor.step(&mut state, &seen)
        })
    };
    assert_eq!(found(Mode::SelfTest), None);
    for mode in [Mode::Zero, Mode::Idle, Mode::Complete(Direction::Deploy)] {
        assert_eq!(found(mode), Some(Fault::DriveBridge), "{mode:?}");
    }
}
