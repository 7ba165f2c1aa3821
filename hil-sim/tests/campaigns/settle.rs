//! No limit cycles: under constant inputs every filter, observer and loop settles to the last
//! bit within a stated time, also from the far end of its range.

use hil_sim::plant::sensors::with_parity;
use interstage::control::preload_loop::{PreloadLoop, PreloadLoopState};
use interstage::control::speed_loop::{SpeedLoop, SpeedLoopState};
use interstage::estimate::vibration::{VibrationObserver, VibrationState};
use interstage::model::profile::{Profile, ProfileState};
use interstage::numeric::{LowPass, LowPassState};
use interstage::rig::Rig;
use interstage::sense::raw::{BridgeCode, BridgeCodes, SensorFrame};
use interstage::sense::{Senses, SensesState};
use interstage::tick::{Controller, Input, State};
use interstage::units::Q16;

/// Ticks for which an output must stay constant.
const LASTS: u32 = 3000;

/// The last tick in which the output of `step` changed, within `within` and [`LASTS`] more.
fn settled_after<T: PartialEq>(within: u32, mut step: impl FnMut(u32) -> T) -> u32 {
    let (mut last, mut changed) = (None, 0);
    for tick in 0..within + LASTS {
        let output = Some(step(tick));
        if output != last {
            (last, changed) = (output, tick);
        }
    }
    changed
}

fn assert_settles<T: PartialEq>(name: &str, within: u32, step: impl FnMut(u32) -> T) {
    let settled = settled_after(within, step);
    assert!(settled <= within, "{name}: changes after {settled} ticks, at most {within}");
}

#[test]
fn a_stage_that_rings_does_not_settle() {
    assert!(settled_after(100, |tick| tick % 2) > 100);
    assert_eq!(settled_after(100, |tick| tick.min(60)), 60);
}

#[test]
fn loops_and_observers_settle() {
    for rig in [Rig::prototype(), Rig::fe()] {
        loops(&rig);
    }
}

#[test]
fn sensors_and_controller_settle() {
    for rig in [Rig::prototype(), Rig::fe()] {
        sensed(&rig);
    }
}

/// 49 bits of error, 28 below the point: `tau ln 2^45` and the ticks for the last one.
#[test]
fn low_passes_settle() {
    for tau_s in [0.001, 0.005, 0.06, 1.0, 20.0] {
        let filter = LowPass::build(tau_s);
        let within = (35.0 * tau_s * 1e3) as u32 + 10;
        for (from, to) in [(Q16::MIN, Q16::MAX), (Q16::MAX, Q16::ZERO), (Q16::ZERO, Q16::DELTA)] {
            let mut state = LowPassState::at(from);
            let name = format!("low-pass of {tau_s} s, from {from} to {to}");
            assert_settles(&name, within, |_| filter.step(&mut state, to));
        }
    }
}

fn loops(rig: &Rig) {
    let speed_loop = SpeedLoop::try_build(rig).expect("a preset");
    let preload_loop = PreloadLoop::try_build(rig).expect("a preset");
    let profile = Profile::try_build(rig).expect("a preset");
    let vibration = VibrationObserver::try_build(rig).expect("a preset");
    let q = Q16::from_num::<f64>;
    for (wanted, measured) in [(5.0, 5.0), (30.0, 0.0), (-8.0, 30.0), (32_767.0, -32_768.0)] {
        let mut state = SpeedLoopState::default();
        // The integral runs to its limit, half of the duty, at the slowest gain.
        let name = format!("speed loop, {measured} mm/s for {wanted}");
        assert_settles(&name, 60_000, |_| {
            speed_loop.step(&mut state, q(wanted), q(measured), q(7.0))
        });
    }
    for (target, measured) in [(40.0, 40.0), (40.0, 0.0), (0.0, 200.0), (32_767.0, -32_768.0)] {
        let mut state = PreloadLoopState::default();
        let name = format!("preload loop, {measured} N for {target}");
        // A reference that runs at the slew to any target, then dead time and lag.
        let within = if target > 1000.0 { 3_000_000 } else { 20_000 };
        assert_settles(&name, within, |_| {
            preload_loop.step(&mut state, q(target), q(measured), Q16::ZERO)
        });
    }
    for target in [0.0, 0.013, 3.0, 30.0] {
        let mut state = ProfileState::default();
        for _ in 0..200 {
            profile.step(&mut state, q(17.0));
        }
        let name = format!("profile to {target} mm/s");
        assert_settles(&name, 2000, |_| {
            profile.step(&mut state, q(target));
            state.speed()
        });
    }
    let mut state = VibrationState::default();
    for tick in 0..500_u32 {
        vibration.step(&mut state, if tick % 3 == 0 { Q16::MAX } else { Q16::ZERO });
    }
    assert_settles("vibration observer at rest", 600, |_| vibration.step(&mut state, q(0.35)));
}

fn sensed(rig: &Rig) {
    let frame = |at, code: (u16, u16, u16, u16)| SensorFrame {
        bridges: Some(BridgeCodes { drive: BridgeCode::of(0), pretightener: BridgeCode::of(0) }),
        ..SensorFrame::taken(at, [code.0, code.1, code.2, with_parity(code.3)])
    };
    let senses = Senses::try_build(rig).expect("a preset");
    // Rolling and loaded, then everything rests.
    let mut state = SensesState::default();
    for tick in 0..2000_u32 {
        let codes = ((tick / 3) as u16, 20_000 + tick as u16, 9000, 4111 - (tick / 20) as u16);
        senses.step(&mut state, tick, &frame(tick, codes), Q16::ZERO);
    }
    let still = (666, 22_000, 9000, 4011);
    assert_settles("sensors of a wheel that stops", 4000, |tick| {
        let now = 2000 + tick;
        let sensed = senses.step(&mut state, now, &frame(now, still), Q16::ZERO);
        let analog = (sensed.preload.value, sensed.preload_filtered, sensed.compression_filtered);
        (
            sensed.travel,
            sensed.speed.value,
            analog,
            sensed.radius.value,
            sensed.tan_arm,
            sensed.level,
        )
    });
    // The complete tick, idle.
    let controller = Controller::try_build(rig).expect("a preset");
    let mut state = State::default();
    assert_settles("controller at rest", 4000, |now| {
        let sensors = frame(now, (7, 3277, 3277, 4111));
        let output = controller.step(&mut state, &Input { now, sensors, ..Input::default() });
        let mut telemetry = output.telemetry;
        telemetry.at = 0;
        (output.drive, output.preload, telemetry)
    });
}
