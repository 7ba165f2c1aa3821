//! Tests of the control tick.

use super::drive::LEVEL_SLOPE;
use super::*;
use crate::estimate::ContactStage;
use crate::estimate::crossing::Contact;
pub(super) use crate::estimate::sensed;
use crate::rig::Rig;
use crate::sense::Validity;
use crate::sense::raw::{BridgeCode, BridgeCodes};
use crate::supervise::Leg;
use crate::units::{Direction, per_tick, q16};
use proptest::prelude::*;

/// With a stiff spring, whose pre-tightener follows at 6 mm/s of rise.
fn stiff() -> Controller {
    let mut rig = Rig::prototype();
    rig.preload.spring_n_per_mm = 0.9 * rig.preload.slew_n_per_s / 6.0;
    Controller::try_build(&rig).expect("a sound rig")
}

#[test]
fn on_a_steep_corner_the_spring_limits_the_speed() {
    let controller = stiff();
    let limited = controller.follow(q16(20_000_000), q16(600_000));
    assert!((limited - q16(10_000_000)).abs() < q16(1_000), "{limited}");
    assert_eq!(controller.follow(q16(8_000_000), q16(600_000)), q16(8_000_000));
    // Level wall, and down behind the edge.
    assert_eq!(controller.follow(q16(20_000_000), Q16::ZERO), q16(20_000_000));
    assert_eq!(controller.follow(q16(20_000_000), q16(-600_000)), q16(20_000_000));
}

proptest! {
    #[test]
    fn the_rise_stays_within_what_the_pretightener_follows(
        speed in 0..100 << 16_i32,
        slope in -(1 << 16)..1 << 16_i32,
    ) {
        let controller = stiff();
        let (speed, slope) = (Q16::from_bits(speed), Q16::from_bits(slope));
        let followed = controller.follow(speed, slope);
        prop_assert!(followed >= Q16::ZERO && followed <= speed);
        if slope > LEVEL_SLOPE {
            prop_assert!(followed * slope <= controller.climb_speed + Q16::DELTA);
        }
        if speed * slope <= controller.climb_speed {
            prop_assert_eq!(followed, speed);
        }
    }
}

#[test]
fn a_wheel_that_brakes_comes_back_to_where_its_profile_has_it() {
    let controller = stiff();
    let mode = Mode::Run(Direction::Deploy, Leg::Cruise);
    let mut state = State { mode, ..State::default() };
    (0..1000).for_each(|_| controller.profile.step(&mut state.profile, q16(20_000_000)));
    let (mut profile_mm, mut wheel_mm) = (0.0, 0.0);
    for tick in 0..1000 {
        controller.profile.step(&mut state.profile, Q16::ZERO);
        state.estimate.position = Q16::from_num(wheel_mm);
        let speed = state.profile.speed();
        let made_up = state.make_up(Q16::ZERO);
        profile_mm += 1e-3 * speed.to_num::<f64>();
        // The tread gives way by 0.2 mm as braking begins.
        wheel_mm += 1e-3 * (speed + made_up).to_num::<f64>() + if tick == 5 { 0.2 } else { 0.0 };
    }
    assert!((wheel_mm - profile_mm).abs() < 0.05, "{wheel_mm} {profile_mm}");
    assert_eq!((state.brake_position, state.profile.speed()), (None, Q16::ZERO));
}

/// Every sensor answers, and the wheel is at rest.
pub(super) fn answering() -> SensedState {
    let mut all = sensed(0, 0.0, 0.0);
    all.validities_mut().into_iter().for_each(|validity| *validity = Validity::Valid);
    all
}

/// Does something in a tick with these readings.
pub(super) fn within<T>(
    sensed: &SensedState,
    act: impl FnOnce(&Controller, &mut Pass<'_>) -> T,
) -> T {
    let controller = Controller::try_build(&Rig::prototype()).expect("sound");
    let mut output = Output::default();
    let (arm_thrust, output) = (Q16::ZERO, &mut output);
    act(&controller, &mut Pass { now: 0, sensed, arm_thrust, trigger: None, output })
}

#[test]
fn a_reset_right_after_a_fault_is_refused() {
    let idle = sensed(0, 0.0, 0.0);
    for (ticks, taken) in [(0, false), (50, false), (99, false), (100, true), (5000, true)] {
        let (mode, in_mode) = (Mode::FaultHold(Fault::TickOverrun), ticks);
        let mut state = State { mode, in_mode, ..State::default() };
        let events = within(&idle, |controller, pass| {
            controller.take_command(&mut state, pass, Some(Command::Reset));
            pass.output.events.clone()
        });
        let expected = if taken { Mode::SelfTest } else { Mode::FaultHold(Fault::TickOverrun) };
        assert_eq!(state.mode, expected, "{ticks}");
        let refused = events.iter().any(|e| e.event == Event::Refused(Command::Reset));
        assert_eq!(refused, !taken, "{ticks}");
    }
}

#[test]
fn off_a_run_the_stage_stays_while_there_is_preload() {
    for (preload, stage) in [
        (q16(40_000_000), ContactStage::Rolling),
        (q16(1_000_000) + Q16::DELTA, ContactStage::Rolling),
        (q16(1_000_000), ContactStage::Initial),
        (Q16::ZERO, ContactStage::Initial),
    ] {
        let seen = SensedState { preload_filtered: preload, ..sensed(0, 0.0, 0.3) };
        let mut state = State::default();
        (state.mode, state.stage) = (Mode::Idle, ContactStage::Rolling);
        let events = within(&seen, |controller, pass| {
            controller.note_stage(&mut state, pass);
            pass.output.events.len()
        });
        assert_eq!(state.stage, stage, "{preload}");
        assert_eq!(events, usize::from(stage != ContactStage::Rolling));
    }
}

#[test]
fn only_on_a_corner_the_climb_limits_the_speed() {
    let fast = q16(60_000_000);
    let limited = |contact: Contact| {
        let mut state = State::default();
        state.estimate.watch.contact = contact;
        // Eight millimetres before the face at 18 mm.
        state.estimate.position = Q16::from_num(10);
        stiff().climb(&state, fast)
    };
    assert_eq!(limited(Contact::Wall), fast);
    assert!(limited(Contact::Both) < q16(30_000_000));
    assert!(limited(Contact::Corner) < q16(30_000_000));
}

#[test]
fn the_duty_shows_the_load_only_at_a_steady_speed() {
    let controller = Controller::try_build(&Rig::prototype()).expect("sound");
    let idle = BridgeCode::of(0);
    let input = Input {
        sensors: SensorFrame {
            bridges: Some(BridgeCodes { drive: idle, pretightener: idle }),
            ..SensorFrame::default()
        },
        ..Input::default()
    };
    // At 20 mm/s, reached or accelerating to 30, with an effort far beyond its band.
    let found = |target: i32| {
        let mut state =
            State { mode: Mode::Run(Direction::Deploy, Leg::Cruise), ..State::default() };
        let wanted = Q16::from_num(target);
        while state.profile.speed() < Q16::from_num(20) {
            controller.profile.step(&mut state.profile, wanted);
        }
        if target == 20 {
            (0..1000).for_each(|_| controller.profile.step(&mut state.profile, wanted));
        }
        assert_eq!(state.profile.acceleration() == Q16::ZERO, target == 20);
        while state.speed_loop.value() < q16(200_000) {
            let (speed_loop, wanted) = (&mut state.speed_loop, Q16::from_num(20));
            controller.speed_loop.step(speed_loop, wanted, Q16::ZERO, Q16::ZERO);
        }
        let speed = state.outwards(state.profile.speed());
        let mut sensed = answering();
        sensed.speed.value = speed;
        (0..300).find_map(|now| {
            let mut output = Output::default();
            sensed.travel += per_tick(speed);
            sensed.speed.at = now;
            // Codes that are alive.
            sensed.preload.value = Q16::from_bits((now % 7) as i32);
            sensed.compression.value = sensed.preload.value;
            let (arm_thrust, output) = (Q16::ZERO, &mut output);
            let mut tick = Pass { now, sensed: &sensed, arm_thrust, trigger: None, output };
            controller.look_for_faults(&mut state, &mut tick, &input);
            controller.transit(&mut state, &mut tick);
            if let Mode::FaultHold(fault) = state.mode { Some(fault) } else { None }
        })
    };
    assert_eq!(found(20), Some(Fault::DutyMismatch));
    assert_eq!(found(30), None);
}
