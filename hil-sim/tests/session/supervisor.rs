//! The supervisor from its output side: the bridges' commands in every mode, whatever the input.

use std::collections::BTreeMap;

use crate::common::echo::Echo;
use hil_sim::plant::rig::VirtualRig;
use hil_sim::plant::sensors::Sensors;
use hil_sim::scenario::Scenario;
use hil_sim::session::{drives, read};
use interstage::fault::Fault;
use interstage::model::{Plan, Planner};
use interstage::sense::raw::{BridgeCode, BridgeCodes, Sample, SensorFrame, SensorId};
use interstage::supervise::{Command, Mode, ServiceDuties};
use interstage::tick::{Controller, Event, Input, Output, State};
use interstage::units::{Direction, Duty, MotorCommand};
use proptest::prelude::*;

/// The controller in the middle of a mode, and what it was last given.
#[derive(Clone)]
struct Snapshot {
    state: State,
    input: Input,
    plan: Option<Plan>,
}

fn controller() -> Controller {
    Controller::try_build(&Scenario::default().rig).expect("a sound rig")
}

/// One snapshot of every mode and leg that a run out and back passes through, taken some
/// ticks after it was entered, and of a stop in each direction.
fn snapshots() -> Vec<(Mode, Snapshot)> {
    let scenario = Scenario::default();
    let controller = controller();
    let planner = Planner::try_build(&scenario.rig).expect("a sound rig");
    let mut found: BTreeMap<String, (Mode, Snapshot)> = BTreeMap::new();
    let boot = Snapshot { state: State::default(), input: Input::default(), plan: None };
    found.insert("Boot".to_owned(), (Mode::Boot, boot));
    let runs = [None, Some(Direction::Deploy), Some(Direction::Retract)];
    for (stop_at, serves) in runs.map(|stop| (stop, false)).into_iter().chain([(None, true)]) {
        let parameters = scenario.plant();
        let mut sensors = Sensors::new(parameters.sensors.clone(), 1);
        let mut plant = VirtualRig::new(parameters, 0.0, 0.0, 1e-3);
        let (mut state, mut frame) = (State::default(), SensorFrame::default());
        let (mut plan, mut within) = (None, 0);
        for now in 0..30_000 {
            let codes = read(&mut sensors, &plant);
            codes.put(&mut frame, now);
            let before = state.mode();
            let command = match before {
                Mode::Idle if within > 20 && !serves => Some(Command::Start),
                Mode::Complete(Direction::Deploy) if within > 20 => Some(Command::Retract),
                Mode::Run(direction, _) if stop_at == Some(direction) && within > 20 => {
                    Some(Command::Stop)
                }
                _ => None,
            };
            let service = match before {
                Mode::Idle if serves => Some(ServiceDuties::REST),
                Mode::Service if within == 2 => Some(ServiceDuties {
                    pretightener: Duty::from_bits(3000),
                    ..ServiceDuties::REST
                }),
                _ => None,
            };
            let input = Input { now, sensors: frame, command, service, plan, ..Input::default() };
            let output = controller.step(&mut state, &input);
            plan = output.request.map(|request| planner.plan(&request));
            plant.step(&drives(output.drive, output.preload), 1e-3).expect("a sound plant");
            within = if state.mode() == before { within + 1 } else { 0 };
            if within == 5 {
                let snapshot = Snapshot { state: state.clone(), input, plan };
                found.entry(format!("{:?}", state.mode())).or_insert((state.mode(), snapshot));
            }
            let ends = [Mode::Complete(Direction::Retract), Mode::Service];
            let over = ends.contains(&state.mode()) && within > 5
                || stop_at.is_some() && matches!(before, Mode::Stopping(_)) && within > 5;
            if over {
                break;
            }
        }
    }
    found.into_values().collect()
}

/// Invariants of every tick.
fn check(before: Mode, output: &Output) -> Result<(), String> {
    let mode = output.telemetry.mode;
    let off = |bridge: MotorCommand| bridge == MotorCommand::OFF;
    if mode == Mode::Service {
        let duties = ServiceDuties {
            drive: output.telemetry.drive,
            pretightener: output.telemetry.pretightener,
        };
        return if duties.is_allowed() { Ok(()) } else { Err(format!("{duties:?}")) };
    }
    if mode.is_at_rest() && !(off(output.drive) && off(output.preload)) {
        return Err(format!("{before:?} to {mode:?} with a bridge on"));
    }
    if !mode.moves() && !off(output.drive) {
        return Err(format!("{before:?} to {mode:?} with the drive on"));
    }
    let fault = output.events.iter().any(|entry| matches!(entry.event, Event::Fault(_)));
    if fault && !matches!(mode, Mode::FaultHold(_)) {
        return Err(format!("{before:?}: a fault led to {mode:?}"));
    }
    Ok(())
}

#[test]
fn every_mode_of_a_run_is_among_the_snapshots() {
    let found: Vec<Mode> = snapshots().into_iter().map(|(mode, _)| mode).collect();
    for (mode, _) in Mode::WITHOUT_FAULT {
        assert!(found.contains(&mode), "{mode:?} is missing in {found:?}");
    }
}

/// An input that causes a fault within a sensor's age, from every mode.
type Spoil = (Fault, fn(&mut Input));

const SPOILS: [Spoil; 12] = [
    (Fault::EmergencyStop, |input| input.emergency_stop = true),
    (Fault::TickOverrun, |input| input.overrun = true),
    (Fault::WheelEncoderStale, |_| {}),
    (Fault::PreloadSensorStale, |_| {}),
    (Fault::CompressionSensorStale, |_| {}),
    (Fault::ArmAngleStale, |_| {}),
    (Fault::ReadbackStale, |input| input.sensors.bridges = None),
    (Fault::DriveBridge, |input| spoil(input, |codes| codes.drive = BridgeCode::of(29_000))),
    (Fault::PretightenerBridge, |input| {
        spoil(input, |codes| codes.pretightener = BridgeCode::of(-29_000));
    }),
    (Fault::PreloadSensorRange, |input| set(input, SensorId::PreloadSensor, 0)),
    (Fault::CompressionSensorRange, |input| set(input, SensorId::CompressionSensor, 0xffff)),
    (Fault::ArmAngleRange, |input| set(input, SensorId::ArmAngle, 2000)),
];

fn spoil(input: &mut Input, of: fn(&mut BridgeCodes)) {
    input.sensors.bridges.iter_mut().for_each(of);
}

fn set(input: &mut Input, sensor: SensorId, code: u16) {
    input.sensors[sensor].iter_mut().for_each(|sample| sample.code = code);
}

/// The next input: fresh readings as before, but for the sensor that falls silent.
fn next(input: &Input, silent: Fault) -> Input {
    let mut input = Input { now: input.now + 1, command: None, plan: None, ..*input };
    let stale = [
        Fault::WheelEncoderStale,
        Fault::PreloadSensorStale,
        Fault::CompressionSensorStale,
        Fault::ArmAngleStale,
    ];
    for (sample, fault) in input.sensors.samples.iter_mut().zip(stale) {
        if let Some(sample) = sample.as_mut().filter(|_| fault != silent) {
            sample.at = input.now;
        }
    }
    input
}

#[test]
fn every_fault_holds_from_every_mode_with_both_bridges_off_in_the_same_tick() {
    let controller = controller();
    // Nothing is watched before every sensor has answered.
    for (mode, snapshot) in snapshots().into_iter().filter(|(mode, _)| *mode != Mode::Boot) {
        for (fault, spoil) in SPOILS {
            if (mode, fault) == (Mode::SelfTest, Fault::DriveBridge) {
                // Until the wheel is known to rest, it may be the voltage of a coasting motor;
                // a bridge that drives is found by the wheel that turns.
                continue;
            }
            let Snapshot { mut state, mut input, .. } = snapshot.clone();
            let mut held = None;
            for tick in 0..40 {
                let before = state.mode();
                input = next(&input, fault);
                spoil(&mut input);
                let output = controller.step(&mut state, &input);
                check(before, &output).unwrap_or_else(|error| panic!("{fault:?}: {error}"));
                if let Mode::FaultHold(found) = state.mode() {
                    held = Some((found, tick));
                    break;
                }
            }
            let (found, tick) = held.unwrap_or_else(|| panic!("{mode:?}, {fault:?}: not held"));
            // A frozen input follows neither wheel nor bridges: another check may be faster.
            assert!(
                found == fault || mode.moves() || matches!(mode, Mode::Preload(_)),
                "{mode:?}: {fault:?} found as {found:?}"
            );
            assert!(tick <= 22, "{mode:?}, {fault:?}: {tick} ticks");
        }
    }
}

fn sample<T: std::fmt::Debug>(
    code: impl Strategy<Value = T>,
) -> impl Strategy<Value = Option<(T, u32)>> {
    // Mostly fresh, sometimes old, sometimes none.
    prop::option::weighted(0.9, (code, prop_oneof![4 => Just(0u32), 1 => 0u32..40]))
}

/// An arbitrary tick: wheel counts, codes of preload, compression and arm angle, each with its
/// age (or the last good one); the readback of the drive's bridge, if it is wrong (`None`:
/// silent); command, overrun, emergency stop, an old plan.
fn tick() -> impl Strategy<Value = Tick> {
    let readback = prop::option::weighted(0.1, any::<u16>().prop_map(BridgeCode::new));
    (
        sample(-6i16..6),
        sample(prop_oneof![3 => 3000u16..20_000, 1 => any::<u16>()]),
        sample(prop_oneof![3 => 3000u16..12_000, 1 => any::<u16>()]),
        sample(prop_oneof![3 => 3700u16..4600, 1 => any::<u16>()]),
        prop::option::weighted(0.98, readback),
        prop::option::weighted(0.1, prop::sample::select(Command::ALL.to_vec())),
        prop::option::weighted(0.1, service()),
        prop::bool::weighted(0.02),
        prop::bool::weighted(0.02),
        any::<bool>(),
    )
}

/// Duties that a host asks for, allowed or not.
fn service() -> impl Strategy<Value = ServiceDuties> {
    let duty = || prop_oneof![2 => Just(0), 2 => -12_000_i16..12_000, 1 => any::<i16>()];
    let duties = |(drive, preload)| ServiceDuties {
        drive: Duty::from_bits(drive),
        pretightener: Duty::from_bits(preload),
    };
    (duty(), duty()).prop_map(duties)
}

/// The values of [`tick`].
type Tick = (
    Option<(i16, u32)>,
    Option<(u16, u32)>,
    Option<(u16, u32)>,
    Option<(u16, u32)>,
    Option<Option<BridgeCode>>,
    Option<Command>,
    Option<ServiceDuties>,
    bool,
    bool,
    bool,
);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn no_input_moves_what_the_mode_does_not(
        from in 0usize..64,
        ticks in prop::collection::vec(tick(), 1..120),
    ) {
        thread_local!(static FROM: Vec<(Mode, Snapshot)> = snapshots());
        let Snapshot { mut state, input, plan } =
            FROM.with(|all| all[from % all.len()].1.clone());
        let controller = controller();
        let mut count = input.sensors[SensorId::WheelEncoder].map_or(0, |wheel| wheel.code);
        let (mut echo, mut sound) = (Echo::default(), input.sensors.bridges.unwrap_or_default());
        for (now, tick) in (input.now + 1..).zip(ticks) {
            let before = state.mode();
            let (wheel, preload, compression, arm, bridges, command, service, overrun, stop, plans) =
                tick;
            count = count.wrapping_add_signed(wheel.map_or(0, |(by, _)| by));
            let at = |age: u32| now.saturating_sub(age);
            let angle =
                |code: u16| code & 0x3fff | ((code & 0x3fff).count_ones() as u16 & 1) << 15;
            let codes = [
                wheel.map(|(_, age)| (count, age)),
                preload,
                compression,
                arm.map(|(code, age)| (angle(code), age)),
            ];
            let drive = bridges.map(|drive| drive.unwrap_or(sound.drive));
            let bridges = drive.map(|drive| BridgeCodes { drive, ..sound });
            let mut sensors = SensorFrame { bridges, ..SensorFrame::default() };
            for (sample, code) in sensors.samples.iter_mut().zip(codes) {
                *sample = code.map(|(code, age)| Sample { code, at: at(age) });
            }
            let input = Input {
                now,
                sensors,
                command,
                service,
                plan: plan.filter(|_| plans),
                overrun,
                emergency_stop: stop,
            };
            let output = controller.step(&mut state, &input);
            sound = echo.read(&output);
            prop_assert_eq!(output.telemetry.mode, state.mode());
            if let Err(error) = check(before, &output) {
                return Err(TestCaseError::fail(error));
            }
        }
    }
}
