//! The motor task with the shipped controller and all other tasks around it.

use crate::common::{
    Answer, Bench, Bridges, Dog, Operator, Record, Sensor, UNLOADED, arm_frame, forever, now_ms,
    preload_sensor_code,
};
use crate::tasks_sensors::spawn;
use interstage::fault::Fault;
use interstage::hal::Light;
use interstage::log::{Identity, LogEncoder};
use interstage::model::Planner;
use interstage::restart::MissedCheckIns;
use interstage::rig::Rig;
use interstage::sense::raw::SensorId;
use interstage::supervise::{Command, Mode};
use interstage::tasks::{self, CHECK_IN_TICKS, Exchange, TaskId, TickIo, TickIoCell};
use interstage::tick::{Controller, Entry, Event};
use interstage::units::{Direction, MotorCommand};

/// All tasks of the firmware on a mocked board: at rest, unloaded, stowed.
pub(crate) struct Board {
    pub(crate) bench: Bench,
    pub(crate) exchange: &'static Exchange,
    pub(crate) wheel: Sensor,
    pub(crate) preload_sensor: Sensor,
    tread: Sensor,
    arm: Sensor,
    pub(crate) operator: Operator,
    pub(crate) motors: Record<(MotorCommand, MotorCommand)>,
    pub(crate) bridges: Bridges,
    pub(crate) watchdog: Dog,
    pub(crate) journal: Record<Entry>,
    light: Record<Light>,
}

impl Board {
    fn new() -> Self {
        Self::without(&[])
    }

    /// A board on which some tasks never get the processor.
    fn without(missing: &[TaskId]) -> Self {
        let exchange = forever(Exchange::new());
        let rig = Rig::prototype();
        let controller = forever(Controller::try_build(&rig).expect("the prototype is valid"));
        let planner = forever(Planner::try_build(&rig).expect("the prototype is valid"));
        let bridges = Bridges::default();
        let mut board = Self {
            bench: Bench::new(),
            exchange,
            wheel: Sensor::new(0),
            preload_sensor: Sensor::alive(UNLOADED),
            tread: Sensor::alive(UNLOADED),
            arm: Sensor::new(arm_frame(0)),
            operator: Operator::default(),
            motors: bridges.applied.clone(),
            bridges,
            watchdog: Dog::default(),
            journal: Record::default(),
            light: Record::default(),
        };
        let runs = |task| !missing.contains(&task);
        let bench = &mut board.bench;
        bench.spawn(async { tasks::clock(exchange).await });
        let parts = [&board.wheel, &board.preload_sensor, &board.tread, &board.arm];
        for (sensor, part) in SensorId::ALL.into_iter().zip(parts) {
            if runs(TaskId::Sensor(sensor)) {
                spawn(bench, part, sensor, exchange);
            }
        }
        let (motors, watchdog) = (board.bridges.clone(), board.watchdog.clone());
        let latest = forever(TickIoCell::new(TickIo::default()));
        bench.spawn(async { tasks::motors(motors, watchdog, controller, latest, exchange).await });
        bench.spawn(async { tasks::record(latest, exchange).await });
        if runs(TaskId::Model) {
            bench.spawn(async { tasks::model(planner, exchange, || ()).await });
        }
        if runs(TaskId::Operator(0)) {
            let operator = board.operator.clone();
            bench.spawn(async { tasks::operator(operator, exchange).await });
        }
        if runs(TaskId::Journal) {
            let (journal, light) = (board.journal.clone(), board.light.clone());
            bench.spawn(async {
                let mut encoder = LogEncoder::new(Identity::NOBODY);
                tasks::journal(journal, light, &mut encoder, exchange).await
            });
        }
        board
    }

    pub(crate) fn mode(&self) -> Mode {
        self.exchange.telemetry().expect("a tick has run").mode
    }

    /// Lets the tasks run until that mode; gives up after `limit_ms`.
    pub(crate) fn reach(&mut self, mode: Mode, limit_ms: u32) {
        let end = now_ms() + limit_ms;
        while now_ms() < end {
            self.bench.run_ms(1);
            if self.mode() == mode {
                return;
            }
        }
        panic!("{mode:?} not reached in {limit_ms} ms, but {:?}", self.mode());
    }

    pub(crate) fn idle() -> Self {
        let mut board = Self::new();
        board.reach(Mode::Idle, 3000);
        board
    }

    pub(crate) fn bridges_are_off(&self) -> bool {
        self.motors.items().last() == Some(&(MotorCommand::OFF, MotorCommand::OFF))
    }
}

#[test]
fn bridges_are_off_from_the_first_instant_until_a_command() {
    let mut board = Board::new();
    board.bench.poll();
    assert_eq!(board.motors.all(), [(0, (MotorCommand::OFF, MotorCommand::OFF))]);
    board.reach(Mode::Idle, 3000);
    board.bench.run_ms(1000);
    assert_eq!(board.mode(), Mode::Idle);
    for (at, bridges) in board.motors.all() {
        assert_eq!(bridges, (MotorCommand::OFF, MotorCommand::OFF), "{at} ms");
    }
    assert!(board.light.items().iter().all(|&light| light == Light::Off));
}

#[test]
fn the_tick_runs_at_a_kilohertz_is_numbered_by_the_clock_and_feeds_the_watchdog() {
    let mut board = Board::new();
    for expected in 1..=1000 {
        board.bench.run_ms(1);
        assert_eq!(board.exchange.telemetry().map(|row| row.at), Some(expected));
    }
    // One call before the first tick, then one a tick.
    assert_eq!(board.motors.times(), (0..=1000).collect::<Vec<_>>());
    assert_eq!(board.watchdog.fed.times(), (1..=1000).collect::<Vec<_>>());
}

#[test]
fn start_raises_the_preload_before_the_drive_moves() {
    let mut board = Board::idle();
    board.motors.clear();
    board.operator.gives(&[Command::Start]);
    board.reach(Mode::Preload(Direction::Deploy), 20);
    board.bench.run_ms(100);
    assert_eq!(board.mode(), Mode::Preload(Direction::Deploy));
    let bridges = board.motors.items();
    assert!(bridges.iter().all(|(drive, _)| !drive.enable));
    let (_, preload) = bridges.last().expect("ticks ran");
    assert!(preload.enable && preload.duty.to_bits() > 0, "{preload:?}");
    assert_eq!(board.exchange.light(), Light::On);
}

#[test]
fn the_watchdog_starves_when_any_task_is_dead_and_the_record_names_it() {
    for (task, name) in [
        (TaskId::Sensor(SensorId::WheelEncoder), "wheel encoder"),
        (TaskId::Sensor(SensorId::PreloadSensor), "preload sensor"),
        (TaskId::Sensor(SensorId::CompressionSensor), "compression sensor"),
        (TaskId::Sensor(SensorId::ArmAngle), "arm angle"),
        (TaskId::Model, "model"),
        (TaskId::Journal, "journal"),
    ] {
        let mut board = Board::without(&[task]);
        board.bench.run_ms(500);
        let last = board.watchdog.fed.times().last().copied();
        assert_eq!(last, Some(CHECK_IN_TICKS), "{task:?}");
        let kept = board.watchdog.kept.items();
        let named: Vec<&str> = kept.iter().map(|snapshot| snapshot.missed.name()).collect();
        assert!(named[..CHECK_IN_TICKS as usize].iter().all(|name| *name == "nobody"));
        assert!(named[CHECK_IN_TICKS as usize..].iter().all(|late| *late == name), "{named:?}");
        assert_eq!(board.exchange.unfed(500).name(), name);
    }
}

#[test]
fn a_tick_that_does_not_start_is_distinguished_from_one_that_hangs() {
    let mut board = Board::idle();
    let now = now_ms();
    assert_eq!(board.exchange.unfed(now), MissedCheckIns::NOBODY);
    // No task gets the processor, and none was running.
    board.bench.freeze_ms(100);
    assert_eq!(board.exchange.unfed(now_ms()), MissedCheckIns::STARVED);
}

#[test]
fn what_the_drive_does_is_kept_every_tick() {
    let mut board = Board::idle();
    board.watchdog.kept.clear();
    board.operator.gives(&[Command::Start]);
    board.bench.run_ms(50);
    let kept = board.watchdog.kept.all();
    assert_eq!(kept.len(), 50);
    assert!(kept.iter().all(|(at, snapshot)| snapshot.tick == *at));
    let last = kept.last().map(|(_, snapshot)| *snapshot).expect("fifty");
    assert_eq!(last.mode(), Some(Mode::Preload(Direction::Deploy)));
    assert_eq!((last.level, last.fault), (0, 0));
}

#[test]
fn a_hanging_sensor_is_a_fault_and_stops_neither_tick_nor_watchdog() {
    type Pick = fn(&Board) -> &Sensor;
    let sensors: [(Pick, Fault); 3] = [
        (|board| &board.preload_sensor, Fault::PreloadSensorStale),
        (|board| &board.tread, Fault::CompressionSensorStale),
        (|board| &board.arm, Fault::ArmAngleStale),
    ];
    for (sensor, fault) in sensors {
        let mut board = Board::idle();
        let hung = now_ms();
        sensor(&board).answers(Answer::Hang);
        board.reach(Mode::FaultHold(fault), 100);
        assert!(board.bridges_are_off());
        board.bench.run_ms(500);
        assert_eq!(board.exchange.light(), Light::Alarm);
        let ticks: Vec<u32> = board.motors.times().into_iter().filter(|&at| at > hung).collect();
        assert_eq!(ticks, (hung + 1..=now_ms()).collect::<Vec<_>>(), "{fault:?}");
        assert_eq!(board.watchdog.fed.times().last(), Some(&now_ms()), "{fault:?}");
        let logged = board.journal.items().iter().any(|entry| entry.event == Event::Fault(fault));
        assert!(logged, "{fault:?} is in the log");
    }
}

#[test]
fn a_converter_of_the_bridges_that_falls_silent_is_a_fault() {
    let mut board = Board::idle();
    board.bridges.mute.set(true);
    board.reach(Mode::FaultHold(Fault::ReadbackStale), 30);
    assert!(board.bridges_are_off());
    // Back again, a reset leads on.
    board.bridges.mute.set(false);
    board.bench.run_ms(150);
    board.operator.gives(&[Command::Reset]);
    board.reach(Mode::Idle, 3000);
}

#[test]
fn a_bridge_that_takes_another_duty_is_off_within_ten_ticks() {
    let mut board = Board::idle();
    board.operator.gives(&[Command::Start]);
    board.reach(Mode::Preload(Direction::Deploy), 20);
    board.bench.run_ms(50);
    board.bridges.runaway_preload.set(Some(-20_000));
    board.reach(Mode::FaultHold(Fault::PretightenerBridge), 10);
    assert!(board.bridges_are_off());
}

#[test]
fn a_dead_model_task_does_not_hold_up_the_tick() {
    let mut board = Board::without(&[TaskId::Model]);
    board.reach(Mode::Idle, 3000);
    board.operator.gives(&[Command::Start]);
    board.reach(Mode::Preload(Direction::Deploy), 20);
    // Some preload comes up, but no plan: the drive has nothing to follow.
    board.preload_sensor.answers(Answer::Code(preload_sensor_code(5.0)));
    let before = now_ms();
    board.bench.run_ms(300);
    let ticks: Vec<u32> = board.motors.times().into_iter().filter(|&at| at > before).collect();
    assert_eq!(ticks, (before + 1..=before + 300).collect::<Vec<_>>());
    // The wait ends in a fault: here by the preload, which no motor moves.
    board.bench.run_ms(1200);
    assert!(matches!(board.mode(), Mode::FaultHold(_)) && board.bridges_are_off());
}

#[test]
fn the_emergency_stop_holds_and_only_a_reset_gives_the_bridges_back() {
    let mut board = Board::idle();
    board.operator.gives(&[Command::Start]);
    board.reach(Mode::Preload(Direction::Deploy), 20);
    board.bench.run_ms(50);
    board.bridges.open.set(true);
    board.bench.run_ms(3);
    let held = Mode::FaultHold(Fault::EmergencyStop);
    assert_eq!(board.mode(), held);
    assert!(board.bridges_are_off());
    // Released: nothing comes back by itself.
    board.bridges.open.set(false);
    board.bench.run_ms(500);
    assert!(board.bridges.cut.get() && board.bridges_are_off());
    assert_eq!(board.mode(), held);
    // Reset while it is pressed: held again.
    board.bridges.open.set(true);
    board.operator.gives(&[Command::Reset]);
    board.bench.run_ms(50);
    assert_eq!(board.mode(), held);
    board.bridges.open.set(false);
    board.bench.run_ms(150);
    board.operator.gives(&[Command::Reset]);
    board.reach(Mode::Idle, 3000);
    assert!(!board.bridges.cut.get() && board.bridges_are_off());
}

#[test]
fn a_late_tick_is_a_fault_and_is_not_made_up() {
    let mut board = Board::idle();
    board.bench.freeze_ms(6);
    board.bench.poll();
    let row = board.exchange.telemetry().expect("a tick has run");
    assert_eq!(row.at, now_ms());
    assert_eq!(row.mode, Mode::FaultHold(Fault::TickOverrun));
    let ticks = board.motors.times().into_iter().filter(|&at| at == now_ms()).count();
    assert_eq!(ticks, 1);
    board.bench.run_ms(3);
    assert_eq!(board.exchange.telemetry().map(|row| row.at), Some(now_ms()));
}

#[test]
fn a_tick_late_by_less_than_a_period_is_none() {
    let mut board = Board::idle();
    for _ in 0..50 {
        embassy_time::MockDriver::get().advance(embassy_time::Duration::from_micros(1900));
        board.bench.poll();
        embassy_time::MockDriver::get().advance(embassy_time::Duration::from_micros(100));
        board.bench.poll();
    }
    assert_eq!(board.mode(), Mode::Idle);
}

#[test]
fn commands_are_answered_in_their_order_one_a_tick() {
    let mut board = Board::idle();
    board.journal.clear();
    let given = [Command::Stop, Command::Start, Command::Stop, Command::Retract, Command::Stop];
    board.operator.gives(&given);
    board.bench.run_ms(40);
    let answered: Vec<Command> = board
        .journal
        .items()
        .iter()
        .filter_map(|entry| match entry.event {
            Event::Command(command) | Event::Refused(command) => Some(command),
            _ => None,
        })
        .collect();
    assert_eq!(answered, given);
}
