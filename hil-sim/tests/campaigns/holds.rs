//! Runs that cannot complete: each holds in the fault that names the cause, bridges off.

use crate::common::{Bench, overridden};
use hil_sim::scenario::Direction;
use interstage::fault::Fault;
use interstage::supervise::{Command, Mode};

/// The prototype with these overrides, run to its end in this direction.
fn run(sets: &[&str], direction: Direction) -> Bench {
    let mut scenario = overridden("prototype", sets);
    scenario.run.direction = direction;
    let mut bench = Bench::idle(&scenario);
    bench.go(direction);
    bench
}

fn assert_held(mut bench: Bench, fault: Fault) {
    assert_eq!(bench.mode(), Mode::FaultHold(fault));
    assert_eq!(bench.faults(), [fault]);
    bench.run_s(0.05);
    for _ in 0..200 {
        bench.tick();
        assert!(bench.now().is_off() && bench.now().is_still(), "moved in the hold");
    }
    // No command but a reset leads out.
    for command in [Command::Start, Command::Retract, Command::Stop] {
        bench.give(command);
        assert_eq!(bench.mode(), Mode::FaultHold(fault), "{command:?}");
    }
    bench.give(Command::Reset);
    assert_eq!(bench.mode(), Mode::SelfTest);
}

#[test]
fn a_wheel_that_turns_at_a_corner_or_on_the_spot_is_noticed() {
    assert_held(run(&["plant.mu=0.3"], Direction::Deploy), Fault::FrictionShort);
    assert_held(run(&["plant.mu=0"], Direction::Deploy), Fault::StepsLost);
}

#[test]
fn nothing_moves_where_no_step_can_give_the_position() {
    let bench = run(&["rig.step_positions_mm=[]"], Direction::Retract);
    let from = bench.moments.first().expect("a tick").truth.position_mm;
    // The tread gives way a little more under its load.
    assert!((bench.position_mm() - from).abs() < 1e-3);
    assert_held(bench, Fault::PositionUnknown);
}

#[test]
fn a_reset_given_before_the_fault_does_not_clear_it() {
    let mut bench = run(&["plant.mu=0.3"], Direction::Deploy);
    bench.give(Command::Reset);
    assert_eq!(bench.mode(), Mode::FaultHold(Fault::FrictionShort));
}
