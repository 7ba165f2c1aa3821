//! Jog, home, release and zero on the emulated board: the plant's truth is what they are judged by.

use std::cell::Cell;

use hil_sim::bringup::{Action, BringupError, Line, Operated, Operation, Operator, Stdin, operate};
use hil_sim::probe::Port;
use hil_sim::scenario::{Direction, Scenario};
use rig_board::bench::Bench;
use rig_board::bringup::Attended;
use rig_board::wiring::Mistake;

use crate::common::{OnUsb, elf, strings};

fn bench(direction: Direction) -> Bench<'static> {
    let mut scenario = Scenario::default();
    scenario.run.direction = direction;
    Bench::new(elf(), strings(), &scenario).expect("a bench")
}

fn person() -> impl Operator {
    Stdin::new(std::io::empty(), std::io::sink(), true)
}

/// Carries it out; the operator stops it after so many looks.
fn stopped(port: &mut dyn Port, what: Operation, looks: u32) -> Result<Operated, BringupError> {
    let left = Cell::new(looks);
    let stop = || {
        left.set(left.get().saturating_sub(1));
        left.get() == 0
    };
    operate(&mut Line::new(port), &mut person(), what, &stop)
}

fn done(port: &mut dyn Port, what: Operation) -> Operated {
    let ended = operate(&mut Line::new(port), &mut person(), what, &|| false);
    ended.unwrap_or_else(|error| panic!("{what:?}: {error}"))
}

#[test]
fn a_rig_goes_home_and_lets_go_and_is_not_zeroed_while_the_load_wedges_its_arm() {
    let mut bench = bench(Direction::Retract);
    let home = done(&mut bench, Operation::Home);
    assert!(home.done && home.mode == "retracted", "{home:?}");
    assert!(bench.plant.truth().position_mm.abs() < 0.5, "{home:?}");
    let release = done(&mut bench, Operation::Release);
    assert!(release.done && release.mode == "idle", "{release:?}");
    assert!(bench.plant.truth().preload_n < 1.0, "{release:?}");
    let zero = done(&mut bench, Operation::Zero);
    assert!(!zero.done && zero.note.starts_with("no zeros taken"), "{zero:?}");
}

#[test]
fn a_release_that_presses_ends_after_one_motion() {
    let mistakes = [Mistake::PretightenerLeads];
    let mut bench = Bench::wired(elf(), strings(), &Scenario::default(), &mistakes).expect("wired");
    let release = done(&mut bench, Operation::Release);
    assert!(!release.done && release.note.starts_with("the preload rises"), "{release:?}");
    assert!((1.0..10.0).contains(&bench.plant.truth().preload_n), "{release:?}");
}

#[test]
fn the_operators_stop_ends_what_moves_and_a_jog_goes_as_far_as_it_was_asked() {
    let mut bench = bench(Direction::Retract);
    let home = stopped(&mut bench, Operation::Home, 100).expect("no failure");
    assert!(!home.done && home.mode == "idle" && home.travel_mm < -1.0, "{home:?}");
    let jogged = |bench: &mut Bench<'_>, wanted, looks| {
        let before = bench.tread_mm();
        let jog = stopped(bench, Operation::Jog(wanted), looks).expect("no failure");
        let truly = bench.tread_mm() - before;
        assert!((truly - jog.travel_mm).abs() < 0.05, "{truly} {jog:?}");
        (jog, truly)
    };
    let (jog, truly) = jogged(&mut bench, 20.0, 200);
    assert!(!jog.done && (0.5..10.0).contains(&truly), "{truly} {jog:?}");
    for wanted in [-25.0, 3.0] {
        let (jog, truly) = jogged(&mut bench, wanted, u32::MAX);
        assert!(jog.done && (truly - wanted).abs() < 0.7, "{truly} {jog:?}");
    }
}

#[test]
fn a_fault_is_named_and_nothing_moves_until_it_is_reset() {
    let attended = Attended::new(bench(Direction::Deploy));
    let mut beside = attended.person(person());
    let mut attended = OnUsb::new(attended);
    for action in [Action::SwitchOn, Action::PressStop] {
        beside.act(action).expect("a hand");
    }
    let refused = stopped(&mut attended, Operation::Jog(5.0), 0).expect_err("a fault");
    assert!(refused.to_string().contains("fault 151: the emergency stop"), "{refused}");
    beside.act(Action::ReleaseStop).expect("a hand");
    assert!(done(&mut attended, Operation::Zero).done);
    let jog = done(&mut attended, Operation::Jog(5.0));
    assert!(jog.done && (jog.travel_mm - 5.0).abs() < 1.5, "{jog:?}");
}
