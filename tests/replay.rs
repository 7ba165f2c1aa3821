//! Recorded runs, replayed through the controller: every output of every tick has to be the
//! recorded one, to the bit.
//!
//! The recordings in `hil-sim/tests/data` are the frames that the image would send, in an MCAP
//! file. After an intended change of controller or plant they are recorded again by
//! `INTERSTAGE_WRITE_FIXTURES=1 cargo test -p hil-sim --test main fixtures`.

use std::path::Path;

use interstage::fault::Fault;
use interstage::log::frame::{Body, Frame};
use interstage::log::{Flags, Record};
use interstage::model::{Plan, PlanRequest, Planner};
use interstage::restart::Restart;
use interstage::rig::Rig;
use interstage::sense::raw::{SensorFrame, SensorId};
use interstage::supervise::Mode;
use interstage::tick::{Controller, Entry, Event, Input, Output, State};
use interstage::units::Direction;

/// The log from one start to the next.
#[derive(Default)]
struct Boot {
    /// Report of the run before.
    restart: Option<Restart>,
    ticks: Vec<Record>,
    plans: Vec<(u32, Plan)>,
    requests: Vec<(u32, PlanRequest)>,
    events: Vec<Entry>,
}

impl Boot {
    /// The item of this tick, if there is one.
    fn of<T: Clone>(all: &[(u32, T)], tick: u32) -> Option<T> {
        all.iter().find(|(at, _)| *at == tick).map(|(_, what)| what.clone())
    }

    /// Events up to the last tick: after that a reset keeps events alone.
    fn events(&self) -> Vec<Entry> {
        let last = self.ticks.last().map_or(0, Record::at);
        self.events.iter().filter(|entry| entry.at <= last).cloned().collect()
    }
}

/// A recorded run, start by start.
struct Recorded(Vec<Boot>);

impl Recorded {
    fn read(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("hil-sim/tests/data").join(name);
        let bytes = std::fs::read(&path).expect(name);
        let mut boots: Vec<Boot> = Vec::new();
        for message in mcap::MessageStream::new(&bytes).expect(name) {
            let message = message.expect(name);
            if message.channel.topic == "/frames" {
                let frame = Frame::open(data(&message.data)).unwrap();
                // Frames are counted from each start on.
                if frame.head.sequence == 0 {
                    boots.push(Boot::default());
                }
                add(boots.last_mut().expect("a start"), frame.body().unwrap());
            }
        }
        Self(boots)
    }

    fn ticks(&self) -> usize {
        self.0.iter().map(|boot| boot.ticks.len()).sum()
    }
}

/// The frame in a protobuf message with one field of bytes; a frame alone begins otherwise.
fn data(message: &[u8]) -> &[u8] {
    let [0x0A, rest @ ..] = message else { return message };
    let length = rest.iter().position(|byte| byte & 0x80 == 0).map_or(0, |last| last + 1);
    &rest[length..]
}

fn add(boot: &mut Boot, body: Body<'_>) {
    match body {
        Body::Ticks(ticks) => boot.ticks.extend(ticks.map(Option::unwrap)),
        Body::Plan(at, plan) => boot.plans.push((at, plan)),
        Body::Request(at, request) => boot.requests.push((at, request)),
        Body::Event(Entry { event: Event::Restart(restart), .. }) => boot.restart = Some(restart),
        Body::Event(entry) => boot.events.push(entry),
        _ => {}
    }
}

/// Gives each tick of a controller that starts as it did then its recorded input as `alter`
/// leaves it; what came out is compared in `judge`.
fn step_through(
    boot: &Boot,
    mut alter: impl FnMut(&mut Input),
    mut judge: impl FnMut(&Record, &Input, &Output),
) {
    let controller = Controller::try_build(&Rig::prototype()).expect("the prototype is sound");
    let place = boot.restart.as_ref().and_then(Restart::place);
    let (mut state, mut sensors) = (State::restored(place), SensorFrame::default());
    for record in &boot.ticks {
        let mut input = Input {
            plan: record
                .flags
                .has(Flags::PLAN)
                .then(|| Boot::of(&boot.plans, record.at()))
                .flatten(),
            ..record.input(&sensors)
        };
        sensors = input.sensors;
        alter(&mut input);
        let output = controller.step(&mut state, &input);
        judge(record, &input, &output);
    }
}

#[test]
fn a_sensor_that_never_answers_is_named() {
    let Recorded(boots) = Recorded::read("deploy.mcap");
    let all = [
        Fault::WheelEncoderStale,
        Fault::PreloadSensorStale,
        Fault::CompressionSensorStale,
        Fault::ArmAngleStale,
    ];
    for (sensor, fault) in SensorId::ALL.into_iter().zip(all) {
        let mut said = None;
        let silence = |input: &mut Input| input.sensors[sensor] = None;
        step_through(&boots[0], silence, |_, _, output| {
            assert!(!output.drive.enable && !output.preload.enable, "{fault:?}");
            if let Mode::FaultHold(fault) = output.telemetry.mode {
                said.get_or_insert(fault);
            }
        });
        assert_eq!(said, Some(fault));
    }
}

/// Replays a run; returns the mode of its last tick.
fn replayed(name: &str, crossings: usize) -> Mode {
    let run = Recorded::read(name);
    assert!(run.ticks() > 1500, "{name}: {} ticks", run.ticks());
    let mut last = None;
    let mut closed = 0;
    for (start, boot) in run.0.iter().enumerate() {
        let mut events = Vec::new();
        step_through(
            boot,
            |_| {},
            |record, input, output| {
                let at = record.at();
                assert_eq!(Record::of(input, output), *record, "{name}, start {start}, tick {at}");
                let request = Boot::of(&boot.requests, at);
                assert_eq!(output.request, request, "{name}, start {start}, tick {at}");
                events.extend(output.events.iter().cloned());
                last = Some(output.telemetry.mode);
            },
        );
        assert_eq!(events, boot.events(), "{name}, start {start}");
        let is_crossing = |entry: &&Entry| matches!(entry.event, Event::Crossing(_));
        closed += events.iter().filter(is_crossing).count();
        plans_again(boot, name);
    }
    assert_eq!(closed, crossings, "{name}");
    last.expect("ticks")
}

/// Each plan is the planner's answer to its request.
fn plans_again(boot: &Boot, name: &str) {
    let planner = Planner::try_build(&Rig::prototype()).expect("the prototype is sound");
    for (at, plan) in &boot.plans {
        let mut requests = boot.requests.iter().map(|(_, request)| request);
        let request = requests.find(|request| request.sequence == plan.sequence);
        let request = request.expect("a plan is asked for");
        assert_eq!(planner.plan(request), *plan, "{name}, tick {at}");
    }
}

#[test]
fn what_is_skipped_changes_no_bit() {
    let unskipped = Controller::try_build(&Rig::prototype()).expect("sound").without_skipping();
    for name in ["deploy.mcap", "slip.mcap"] {
        let mut state = State::default();
        step_through(
            &Recorded::read(name).0[0],
            |_| {},
            |record, input, output| {
                let again = unskipped.step(&mut state, input);
                assert_eq!(again.telemetry, output.telemetry, "{name}, tick {}", record.at());
                assert_eq!(state.mode(), output.telemetry.mode);
                assert!((0.5..2.0).contains(&state.stiffness_scale().to_num::<f64>()));
            },
        );
    }
}

#[test]
fn every_recorded_run_is_replayed_to_the_bit() {
    use Direction::{Deploy, Retract};
    // Crossings, and the end at which the run completes; none if it ends in a fault.
    for (name, crossings, end) in [
        ("deploy", 3, Some(Deploy)),
        ("retract", 3, Some(Retract)),
        // Steps elsewhere than in the table; the table's first step missing on retract; a
        // step higher than the table has it.
        ("astray", 3, None),
        ("back", 1, None),
        ("higher", 3, Some(Deploy)),
        // Commands on a corner that end at the start, at the end; buttons pressed at random.
        ("back-again", 4, Some(Retract)),
        ("on-again", 3, Some(Deploy)),
        ("presses", 0, Some(Retract)),
        // A wheel that slips on a corner; a late and weak preload; twice the load; late ticks.
        ("slip", 1, None),
        ("soft", 3, Some(Deploy)),
        ("load", 3, Some(Retract)),
        ("late", 0, None),
        // Preload sensor stuck, compression sensor too high, encoder losing counts, arm angle
        // jumping.
        ("stuck", 0, None),
        ("tread-gain", 3, Some(Deploy)),
        ("encoder-gain", 0, None),
        ("arm-offset", 1, None),
    ] {
        let mode = replayed(&format!("{name}.mcap"), crossings);
        match end {
            Some(direction) => assert_eq!(mode, Mode::Complete(direction), "{name}"),
            None => assert!(matches!(mode, Mode::FaultHold(_)), "{name}: {mode:?}"),
        }
    }
}

#[test]
fn resets_near_corners() {
    for (name, crossings) in [("resets-1.mcap", 7), ("resets-2.mcap", 7), ("resets-3.mcap", 10)] {
        replayed(name, crossings);
        assert_eq!(Recorded::read(name).0.len(), 10, "{name}");
    }
}
