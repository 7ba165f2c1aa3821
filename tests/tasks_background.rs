//! The tasks below the control rate: model, operator, journal.

use crate::common::{Bench, Operator, Record, forever, now_ms};
use embassy_time::Duration;
use interstage::fault::Fault;
use interstage::hal::Light;
use interstage::log::{Identity, LogEncoder};
use interstage::model::{Learned, PlanRequest, Planner};
use interstage::rig::Rig;
use interstage::supervise::{Command, Mode};
use interstage::tasks::{self, COMMANDS, ENTRIES, Exchange};
use interstage::tick::{Entry, Event, Output, Telemetry};
use interstage::units::{Direction, Q16, Ratio};

fn planner() -> &'static Planner {
    forever(Planner::try_build(&Rig::prototype()).expect("the prototype is valid"))
}

fn request(sequence: u32) -> PlanRequest {
    PlanRequest {
        sequence,
        direction: Direction::Deploy,
        step: 1,
        learned: Learned::default(),
        preload: Ratio::from_num(50),
        distance: Ratio::from_num(4),
        speed: Q16::ZERO,
        searching: false,
        review: None,
        slipped: None,
    }
}

fn entry(at: u32) -> Entry {
    Entry { at, event: Event::Command(Command::Stop) }
}

/// Command for a tick now.
fn command(exchange: &Exchange) -> Option<Command> {
    exchange.input(0, false).command
}

fn plan_sequence(exchange: &Exchange) -> Option<u32> {
    exchange.input(0, false).plan.map(|plan| plan.sequence)
}

/// The journal's task with its exchange.
fn journal(written: &Record<Entry>, shown: &Record<Light>) -> (Bench, &'static Exchange) {
    let (mut bench, exchange) = (Bench::new(), forever(Exchange::new()));
    let (journal, light) = (written.clone(), shown.clone());
    bench.spawn(async {
        let mut encoder = LogEncoder::new(Identity::NOBODY);
        tasks::journal(journal, light, &mut encoder, exchange).await
    });
    (bench, exchange)
}

#[test]
fn a_request_is_answered_once_and_of_several_the_latest() {
    let mut bench = Bench::new();
    let exchange = forever(Exchange::new());
    bench.spawn(async { tasks::model(planner(), exchange, || ()).await });
    bench.run_ms(50);
    assert_eq!(plan_sequence(exchange), None);
    exchange.request_plan(request(5));
    bench.poll();
    assert_eq!(plan_sequence(exchange), Some(5));
    assert_eq!(plan_sequence(exchange), None);
    for sequence in 1..=3 {
        exchange.request_plan(request(sequence));
    }
    bench.run_ms(100);
    assert_eq!(plan_sequence(exchange), Some(3));
    assert_eq!(plan_sequence(exchange), None);
}

#[test]
fn commands_reach_the_tick_in_their_order_and_none_is_lost() {
    let mut bench = Bench::new();
    let (exchange, operator) = (forever(Exchange::new()), Operator::default());
    let source = operator.clone();
    bench.spawn(async { tasks::operator(source, exchange).await });
    let given = [
        Command::Start,
        Command::Stop,
        Command::Retract,
        Command::Reset,
        Command::Start,
        Command::Reset,
        Command::Stop,
    ];
    operator.gives(&given);
    // Without a reader the queue fills and the source waits.
    bench.run_ms(100);
    assert_eq!(operator.left(), given.len() - COMMANDS - 1);
    let mut taken = Vec::new();
    for _ in 0..20 {
        taken.extend(command(exchange));
        bench.run_ms(1);
    }
    assert_eq!(taken, given);
}

#[test]
fn a_gesture_longer_than_a_check_in_is_not_forgotten() {
    let mut bench = Bench::new();
    let exchange = forever(Exchange::new());
    let operator = Operator::slow(Duration::from_millis(400));
    let source = operator.clone();
    bench.spawn(async { tasks::operator(source, exchange).await });
    operator.gives(&[Command::Retract]);
    bench.run_ms(390);
    assert_eq!(command(exchange), None);
    bench.run_ms(20);
    assert_eq!(command(exchange), Some(Command::Retract));
}

#[test]
fn two_sources_do_not_wait_for_one_another() {
    let mut bench = Bench::new();
    let exchange = forever(Exchange::new());
    let (button, console) = (Operator::default(), Operator::default());
    let (first, second) = (button.clone(), console.clone());
    bench.spawn(async { tasks::operator(first, exchange).await });
    bench.spawn(async { tasks::operator(second, exchange).await });
    console.gives(&[Command::Stop]);
    bench.run_ms(1);
    assert_eq!(command(exchange), Some(Command::Stop));
    button.gives(&[Command::Start]);
    bench.run_ms(1);
    assert_eq!(command(exchange), Some(Command::Start));
}

#[test]
fn entries_are_written_in_their_order() {
    let written = Record::default();
    let (mut bench, exchange) = journal(&written, &Record::default());
    for at in 0..ENTRIES as u32 {
        exchange.log(entry(at));
    }
    bench.run_ms(1);
    exchange.log(entry(1000));
    bench.run_ms(1);
    let expected: Vec<u32> = (0..ENTRIES as u32).chain([1000]).collect();
    assert_eq!(written.items().iter().map(|entry| entry.at).collect::<Vec<_>>(), expected);
    assert_eq!(exchange.lost_entries(), 0);
}

#[test]
fn entries_that_do_not_fit_are_counted_and_the_others_kept() {
    let written = Record::default();
    let (mut bench, exchange) = journal(&written, &Record::default());
    bench.poll();
    for at in 0..ENTRIES as u32 + 9 {
        exchange.log(entry(at));
    }
    assert_eq!(exchange.lost_entries(), 9);
    bench.run_ms(1);
    let items = written.items();
    let times: Vec<u32> = items.iter().take(ENTRIES).map(|entry| entry.at).collect();
    assert_eq!(times, (0..ENTRIES as u32).collect::<Vec<_>>());
    let events: Vec<Event> = items.iter().skip(ENTRIES).map(|entry| entry.event).collect();
    assert_eq!(events, [Event::Lost(9)], "behind what was kept, once");
    exchange.log(entry(5000));
    bench.run_ms(1);
    assert_eq!(written.items().last().map(|entry| entry.at), Some(5000));
    assert_eq!(exchange.lost_entries(), 9);
}

#[test]
fn the_light_is_set_when_it_changes_and_only_then() {
    let shown = Record::default();
    let (mut bench, exchange) = journal(&Record::default(), &shown);
    bench.run_ms(100);
    assert_eq!(shown.items(), [Light::Off]);
    let modes = [Mode::Preload(Direction::Deploy), Mode::FaultHold(Fault::SelfTest), Mode::Idle];
    for (mode, light) in modes.into_iter().zip([Light::On, Light::Alarm, Light::Off]) {
        let telemetry = Telemetry { mode, ..Telemetry::default() };
        exchange.publish(&Output { telemetry, ..Output::default() });
        let asked = now_ms();
        bench.run_ms(200);
        let (at, last) = shown.all().last().copied().expect("shown");
        assert_eq!(last, light);
        assert!(at - asked <= 20, "{} ms", at - asked);
    }
    assert_eq!(shown.items().len(), 4);
}
