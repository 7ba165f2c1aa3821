//! The service mode through all tasks, with a host at the line, under virtual time.

use crate::common::now_ms;
use crate::tasks_link::{Wire, spawn_link};
use crate::tasks_motors::Board;
use interstage::fault::{Fault, Limit};
use interstage::params::Refusal;
use interstage::params::link::ToHost;
use interstage::params::service::{Request, Response};
use interstage::supervise::{Command, Mode, ServiceDuties};
use interstage::tick::Event;
use interstage::units::{Direction, Duty, Millimetres, MotorCommand};

const DRIVE: ServiceDuties =
    ServiceDuties { drive: Duty::from_bits(4000), pretightener: Duty::ZERO };
const PRESS: ServiceDuties =
    ServiceDuties { drive: Duty::ZERO, pretightener: Duty::from_bits(4000) };

/// A board with a host.
struct Served {
    board: Board,
    wire: Wire,
    number: u16,
}

impl Served {
    fn idle() -> Self {
        let mut board = Board::idle();
        let wire = Wire::default();
        spawn_link(&mut board.bench, &wire, board.exchange);
        Self { board, wire, number: 0 }
    }

    /// In the service mode.
    fn serving() -> Self {
        let mut served = Self::idle();
        assert_eq!(served.ask(Request::Service(ServiceDuties::REST)), Response::Done);
        served.board.reach(Mode::Service, 3);
        served
    }

    fn ask(&mut self, request: Request) -> Response {
        self.number += 1;
        self.wire.ask(self.number, request);
        self.board.bench.run_ms(15);
        match &self.wire.answers()[..] {
            [ToHost::Parameters(number, response)] if *number == self.number => response.clone(),
            other => panic!("{other:?}"),
        }
    }

    /// The bridges as of now.
    fn bridges(&self) -> (MotorCommand, MotorCommand) {
        *self.board.motors.items().last().expect("a tick")
    }

    fn logged(&self, event: Event) -> bool {
        self.board.journal.items().iter().any(|entry| entry.event == event)
    }
}

#[test]
fn the_host_drives_while_it_repeats_and_200_ms_after_its_last_word() {
    let mut served = Served::serving();
    for _ in 0..10 {
        assert_eq!(served.ask(Request::Service(PRESS)), Response::Done);
        served.board.bench.run_ms(35);
        assert_eq!(served.bridges(), (MotorCommand::OFF, MotorCommand::on(PRESS.pretightener)));
    }
    let last = now_ms();
    while served.bridges().1 != MotorCommand::OFF {
        served.board.bench.run_ms(1);
    }
    let lasted = now_ms() - last;
    assert!((140..=200).contains(&lasted), "{lasted} ms");
    assert!(served.logged(Event::Limit(Limit::ServiceSilent)));
    served.board.bench.run_ms(5000);
    assert_eq!(served.board.mode(), Mode::Service);
    // It does not go on where it was.
    served.ask(Request::Service(PRESS));
    assert!(served.board.bridges_are_off());
    served.ask(Request::Service(ServiceDuties::REST));
    served.ask(Request::Service(PRESS));
    assert!(!served.board.bridges_are_off());
}

#[test]
fn it_is_entered_at_rest_from_idle_alone() {
    let mut served = Served::idle();
    let refused = Response::Refused(Refusal::NotService);
    assert_eq!(served.ask(Request::Service(DRIVE)), refused);
    served.board.operator.gives(&[Command::Start]);
    served.board.reach(Mode::Preload(Direction::Deploy), 20);
    for duties in [ServiceDuties::REST, DRIVE] {
        assert_eq!(served.ask(Request::Service(duties)), refused);
    }
    assert_eq!(served.board.mode(), Mode::Preload(Direction::Deploy));
    served.board.bridges.open.set(true);
    served.board.reach(Mode::FaultHold(Fault::EmergencyStop), 3);
    assert_eq!(served.ask(Request::Service(ServiceDuties::REST)), refused);
    // One clock, one board.
    drop(served);
    // A request that is too large is refused in words and ignored by the tick.
    let mut served = Served::serving();
    let large = ServiceDuties { drive: Duty::from_bits(20_000), ..ServiceDuties::REST };
    assert_eq!(served.ask(Request::Service(large)), Response::Refused(Refusal::Duty));
    assert!(served.board.bridges_are_off());
}

#[test]
fn button_letter_and_host_lead_out_through_the_self_test() {
    for command in Command::ALL {
        let mut served = Served::serving();
        served.ask(Request::Service(PRESS));
        served.board.operator.gives(&[command]);
        served.board.reach(Mode::SelfTest, 5);
        assert!(served.board.bridges_are_off());
        served.board.reach(Mode::Idle, 3000);
        assert!(
            served.logged(Event::Mode(Mode::Service)) && served.logged(Event::Mode(Mode::Zero))
        );
    }
    let mut served = Served::serving();
    assert_eq!(served.ask(Request::Reset), Response::Done);
    served.board.reach(Mode::Idle, 3000);
}

#[test]
fn stop_contact_readback_and_sensors_end_it_in_the_fault_hold() {
    type Spoil = fn(&Board);
    let spoils: [(Fault, Spoil); 4] = [
        (Fault::EmergencyStop, |board| board.bridges.open.set(true)),
        (Fault::ReadbackStale, |board| board.bridges.mute.set(true)),
        (Fault::PretightenerBridge, |board| board.bridges.runaway_preload.set(Some(-9000))),
        (Fault::PreloadSensorRange, |board| {
            board.preload_sensor.answers(crate::common::Answer::Code(0));
        }),
    ];
    for (fault, spoil) in spoils {
        let mut served = Served::serving();
        served.ask(Request::Service(PRESS));
        spoil(&served.board);
        served.board.reach(Mode::FaultHold(fault), 60);
        assert!(served.board.bridges_are_off());
        assert_eq!(served.ask(Request::Service(PRESS)), Response::Refused(Refusal::NotService));
        assert!(served.board.bridges_are_off());
    }
}

#[test]
fn parameters_do_not_change_in_the_service_mode() {
    let mut served = Served::serving();
    let begin = Request::Begin { length: 8 };
    assert_eq!(served.ask(begin), Response::Refused(Refusal::Moving));
}

#[test]
fn nothing_of_it_is_left_for_a_deployment() {
    let mut served = Served::serving();
    // The wheel turns by 5 mm without its place changing.
    for step in 0..50_u16 {
        served.board.wheel.answers(crate::common::Answer::Code(step * 5));
        served.ask(Request::Service(DRIVE));
    }
    let position = |served: &Served| served.board.exchange.telemetry().expect("a tick").position;
    // A record of this moment has no place.
    let kept = served.board.watchdog.kept.items();
    assert!(!kept.last().expect("kept").packed_speed.placed());
    served.ask(Request::Service(ServiceDuties::REST));
    served.board.bench.run_ms(300);
    served.ask(Request::Reset);
    served.board.reach(Mode::Idle, 3000);
    assert_eq!(position(&served), Millimetres::ZERO);
    let kept = served.board.watchdog.kept.items();
    assert!(kept.last().expect("kept").packed_speed.placed());
}
