//! Recorded runs, given to the controller again: every output of every tick has to be the
//! recorded one, to the bit.
//!
//! The recordings in `hil-sim/tests/data` are the frames that the image would send, in an
//! MCAP file: a deployment and a retraction, steps that stand elsewhere or are missing, lost
//! friction, a sensor that stands still, commands at random on a corner. After a change of
//! the controller that is wanted they are made anew: those of the scenarios beside them by
//! `cargo rig capture --bare NAME.toml --out hil-sim/tests/data --name NAME`, the first two
//! as `hil-sim/tests/logs.rs` says.

use std::path::Path;

use interstage::control::{Controller, Input, Output, State};
use interstage::log::frame::{Body, Frame};
use interstage::log::{Entry, Record};
use interstage::model::{Plan, PlanRequest, Planner};
use interstage::rig::Rig;
use interstage::sense::raw::SensorFrame;
use interstage::supervise::{Direction, Fault, Mode};

/// A run as the frames of its log tell it.
#[derive(Default)]
struct Recorded {
    ticks: Vec<Record>,
    plans: Vec<(u32, Plan)>,
    requests: Vec<(u32, PlanRequest)>,
    events: Vec<Entry>,
}

impl Recorded {
    fn read(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("hil-sim/tests/data").join(name);
        let bytes = std::fs::read(&path).expect(name);
        let mut run = Self::default();
        for message in mcap::MessageStream::new(&bytes).expect(name) {
            let message = message.expect(name);
            if message.channel.topic == "/frames" {
                run.add(&message.data);
            }
        }
        run
    }

    fn add(&mut self, frame: &[u8]) {
        match Frame::open(frame).unwrap().body().unwrap() {
            Body::Ticks(ticks) => self.ticks.extend(ticks.map(Result::unwrap)),
            Body::Plan(at, plan) => self.plans.push((at, plan)),
            Body::Request(at, request) => self.requests.push((at, request)),
            Body::Event(entry) => self.events.push(entry),
            _ => {}
        }
    }

    /// What the log has of this tick, in its order.
    fn of<T: Clone>(all: &[(u32, T)], tick: u32) -> Option<T> {
        all.iter().find(|(at, _)| *at == tick).map(|(_, what)| what.clone())
    }
}

/// Gives each tick of a fresh controller its recorded input as `alter` leaves it; what came
/// out is compared in `judge`.
fn step_through(
    run: &Recorded,
    mut alter: impl FnMut(&mut Input),
    mut judge: impl FnMut(&Record, &Input, &Output),
) {
    let controller = Controller::try_build(&Rig::prototype()).expect("the prototype is sound");
    let (mut state, mut sensors) = (State::default(), SensorFrame::default());
    for record in &run.ticks {
        let mut input = Input {
            plan: record.flags.plan().then(|| Recorded::of(&run.plans, record.at())).flatten(),
            ..record.input(&sensors)
        };
        sensors = input.sensors;
        alter(&mut input);
        let output = controller.step(&mut state, &input);
        judge(record, &input, &output);
    }
}

/// Gives each tick its recorded input; what came out is compared in `judge`.
fn again(name: &str, mut judge: impl FnMut(&Recorded, &Record, &Input, &Output)) -> Recorded {
    let run = Recorded::read(name);
    step_through(&run, |_| {}, |record, input, output| judge(&run, record, input, output));
    run
}

#[test]
fn a_sensor_that_never_answers_is_named() {
    let run = Recorded::read("deploy.mcap");
    type Silence = fn(&mut SensorFrame);
    let all: [(Silence, Fault); 4] = [
        (|sensors| sensors.wheel = None, Fault::SpeedStale),
        (|sensors| sensors.load_cell = None, Fault::PressureStale),
        (|sensors| sensors.tread = None, Fault::DisplacementStale),
        (|sensors| sensors.arm = None, Fault::AngleStale),
    ];
    for (silence, fault) in all {
        let mut said = None;
        let silence = |input: &mut Input| silence(&mut input.sensors);
        step_through(&run, silence, |_, _, output| {
            assert!(!output.drive.enable && !output.preload.enable, "{fault:?}");
            if let Mode::FaultHold(fault) = output.telemetry.mode {
                said.get_or_insert(fault);
            }
        });
        assert_eq!(said, Some(fault));
    }
}

/// Runs it again; the mode of its last tick.
fn replayed(name: &str, crossings: usize) -> Mode {
    let mut events = Vec::new();
    let mut last = None;
    let run = again(name, |run, record, input, output| {
        assert_eq!(Record::of(input, output), *record, "{name}, tick {}", record.at());
        let request = Recorded::of(&run.requests, record.at());
        assert_eq!(output.request, request, "{name}, tick {}", record.at());
        events.extend(output.events.iter().cloned());
        last = Some(output.telemetry.mode);
    });
    assert_eq!(events, run.events, "{name}");
    plans_again(&run, name);
    assert!(run.ticks.len() > 3000, "{name}: {} ticks", run.ticks.len());
    let closed = |entry: &&Entry| matches!(entry.event, interstage::log::Event::Crossing(_));
    assert_eq!(run.events.iter().filter(closed).count(), crossings, "{name}");
    last.expect("ticks")
}

/// Each plan is what the planner makes of the request that it answers.
fn plans_again(run: &Recorded, name: &str) {
    let planner = Planner::try_build(&Rig::prototype()).expect("the prototype is sound");
    for (at, plan) in &run.plans {
        let mut requests = run.requests.iter().map(|(_, request)| request);
        let request = requests.find(|request| request.sequence == plan.sequence);
        let request = request.expect("a plan is asked for");
        assert_eq!(planner.plan(request), *plan, "{name}, tick {at}");
    }
}

#[test]
fn what_is_skipped_changes_no_bit() {
    let whole = Controller::try_build(&Rig::prototype()).expect("sound").without_skipping();
    let mut state = State::default();
    for name in ["deploy.mcap", "slip.mcap"] {
        let mut skipped = 0;
        again(name, |_, record, input, output| {
            if skipped == 0 {
                state = State::default();
            }
            skipped += 1;
            let again = whole.step(&mut state, input);
            assert_eq!(again.telemetry, output.telemetry, "{name}, tick {}", record.at());
            assert_eq!(state.mode(), output.telemetry.mode);
            assert!((0.5..2.0).contains(&state.stiffness_scale().to_num::<f64>()));
        });
    }
}

#[test]
fn a_deployment() {
    assert!(matches!(replayed("deploy.mcap", 3), Mode::Complete(_)));
}

#[test]
fn a_retraction() {
    assert!(matches!(replayed("retract.mcap", 3), Mode::Complete(_)));
}

#[test]
fn steps_that_stand_elsewhere() {
    assert!(matches!(replayed("astray.mcap", 3), Mode::Complete(_)));
}

#[test]
fn commands_on_a_corner_that_end_at_the_start() {
    assert_eq!(replayed("back-again.mcap", 2), Mode::Complete(Direction::Retract));
}

#[test]
fn commands_on_a_corner_that_end_at_the_end() {
    assert_eq!(replayed("on-again.mcap", 3), Mode::Complete(Direction::Deploy));
}

#[test]
fn a_step_that_is_missing_on_the_way_back() {
    assert!(matches!(replayed("back.mcap", 1), Mode::FaultHold(_)));
}

#[test]
fn a_wheel_that_slips_on_a_corner() {
    assert!(matches!(replayed("slip.mcap", 1), Mode::FaultHold(_)));
}

#[test]
fn a_load_cell_that_stands_still() {
    assert!(matches!(replayed("stuck.mcap", 0), Mode::FaultHold(_)));
}
