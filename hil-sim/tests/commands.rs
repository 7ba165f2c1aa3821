//! An operator and failing sensors in the middle of a run: stop, resume, reverse, reset, and
//! commands that the mode does not accept.

use crate::common::{
    Bench, DIRECTIONS, Moment, NO_SLIP_MM, RIGS, check_each, end_mm, opposite, scenario, starter,
};
use hil_sim::plant::wall::touch_mm;
use hil_sim::scenario::{Direction, Scenario};
use hil_sim::testing::long;
use interstage::estimate::ContactStage as Stage;
use interstage::fault::Fault;
use interstage::rig::Rig;
use interstage::sense::raw::SensorId;
use interstage::supervise::{Command, Leg, Mode, Trigger, next};
use interstage::tick::Event;
use interstage::units;

/// Where in a run something happens.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// On the wall behind the last step.
    Cruise,
    /// Before the second step of the run.
    Approach,
    /// On that step, the lower wall carrying too (retract: the corner alone).
    FirstHalf,
    /// On that step, the corner carrying alone (retract: the lower wall too).
    SecondHalf,
    /// Behind that step, before its record is closed.
    Settle,
}

impl Place {
    fn is_at(self, direction: Direction, now: &Moment) -> bool {
        let (before, halves) = match direction {
            Direction::Deploy => (1, [Stage::StaticFriction, Stage::Sliding]),
            Direction::Retract => (2, [Stage::Sliding, Stage::StaticFriction]),
        };
        let (level, stage) = (now.seen.level, now.seen.stage);
        let behind = if direction == Direction::Deploy { before + 1 } else { before - 1 };
        let moving = now.truth.speed_mm_s.abs() > 5.0;
        let leg = |leg: Leg| now.seen.mode == Mode::Run(direction.into(), leg);
        match self {
            Self::Cruise => leg(Leg::Cruise) && moving,
            Self::Approach => leg(Leg::Approach) && moving && level == before,
            Self::FirstHalf => stage == halves[0] && level == before,
            Self::SecondHalf => stage == halves[1] && level == before,
            Self::Settle => leg(Leg::Settle) && level == behind,
        }
    }
}

/// A run in which something happens this many milliseconds after a place.
struct Case {
    scenario: Scenario,
    place: Place,
    later_ms: u32,
    name: String,
}

/// Every rig and direction with each place and delay.
fn cases(places: &[Place], later_ms: &[u32]) -> Vec<Case> {
    let mut all = Vec::new();
    for rig in RIGS {
        for direction in DIRECTIONS {
            for &place in places {
                for &later_ms in later_ms {
                    let name = format!("{rig} {} {place:?} and {later_ms} ms", direction.name());
                    let scenario = scenario(rig, direction, 0);
                    all.push(Case { scenario, place, later_ms, name });
                }
            }
        }
    }
    all
}

fn everywhere() -> impl Iterator<Item = Case> {
    // An approach lasts a tenth of a second at least.
    let between = cases(&[Place::Cruise, Place::Approach], &[0, 40, 80]);
    let on_step = [Place::FirstHalf, Place::SecondHalf, Place::Settle];
    between.into_iter().chain(cases(&on_step, &[0, 60, 120, 180, 240]))
}

/// A quarter of the cases, of every rig, direction and place, unless the long samples run.
fn sample(cases: impl Iterator<Item = Case>) -> impl Iterator<Item = Case> {
    cases.step_by(if long() { 1 } else { 4 })
}

/// The run up to that place and time.
fn run_to(case: &Case) -> Bench {
    let direction = case.scenario.run.direction;
    let mut bench = Bench::idle(&case.scenario);
    bench.give(starter(direction));
    bench.until(&case.name, 20.0, |now| case.place.is_at(direction, now));
    bench.run_s(f64::from(case.later_ms) * 1e-3);
    bench
}

/// Stopped there, at rest for half a second.
fn stopped(case: &Case) -> Bench {
    let mut bench = run_to(case);
    bench.give(Command::Stop);
    bench.until(&format!("idle after {}", case.name), 0.4, |now| now.seen.mode == Mode::Idle);
    bench.run_s(0.5);
    bench
}

/// How far an axle may sink on a wheel that stands, mm: rubber that carries all of a corner's force at
/// its stiffness at once, and then relaxes.
fn sinks_mm(scenario: &Scenario) -> f64 {
    let Rig { rig, preload, plant, tread, .. } = &scenario.rig;
    let sine = touch_mm(rig.wheel_radius_mm, rig.step_height_mm) / rig.wheel_radius_mm;
    let force_n = preload.limit_n * sine + plant.top_load_n * plant.top_load_share;
    force_n / scenario.rig.shear().n_per_mm * (1.0 - 1.0 / tread.stiffening)
}

#[test]
fn a_stop_brings_the_drive_to_rest_and_keeps_the_preload() {
    check_each(sample(everywhere()), |case| {
        let name = &case.name;
        let mut bench = run_to(case);
        bench.give(Command::Stop);
        assert!(matches!(bench.mode(), Mode::Stopping(_)), "{name}");
        let after = |what: &str| format!("{what} after {name}");
        bench.until(&after("rest"), 0.3, |now| now.truth.rigid_mm_s.abs() < 0.5);
        bench.until(&after("idle"), 0.1, |now| now.seen.mode == Mode::Idle);
        bench.until(&after("standstill"), 0.025, Moment::is_still);
        let (from, sinks_mm) = (bench.now().clone(), sinks_mm(&case.scenario));
        let moments = bench.moments.len();
        bench.run_s(1.0);
        for now in &bench.moments[moments..] {
            assert!(now.is_off() && now.is_still(), "{name}");
            let sunk = from.truth.position_mm - now.truth.position_mm;
            assert!((-0.05..sinks_mm).contains(&sunk), "{name}: {sunk}");
            // The tread sinks in or down, by less than its depth, and takes some spring with it.
            let rises = now.truth.radius_mm - from.truth.radius_mm;
            let spring_n = case.scenario.rig.preload.spring_n_per_mm * rises;
            let off = (now.truth.preload_n + spring_n) / from.truth.preload_n - 1.0;
            assert!(rises < from.truth.depth_mm && off.abs() < 0.002, "{name}: {rises} {off}");
        }
        let off = |now: &Moment| now.seen.position.to_num::<f64>() - now.truth.position_mm;
        let lost = off(bench.now()) - off(&from);
        // Off a corner the controller knows by how much; on it the edge shows the place when it goes on.
        let on_wall = matches!(case.place, Place::Cruise | Place::Settle);
        assert!(!on_wall || lost.abs() < 0.3, "{name}: {lost}");
        assert_eq!(bench.mode(), Mode::Idle, "{name}");
        assert!(bench.faults().is_empty(), "{name}");
    });
}

/// Arrived at the end in this direction, unharmed, with no step out of place.
fn assert_arrived(bench: &Bench, scenario: &Scenario, direction: Direction, name: &str) {
    assert_eq!(bench.mode(), Mode::Complete(direction.into()), "{name}");
    let off = bench.position_mm() - end_mm(scenario, direction);
    // At three times the load the tread gives way by three times as much.
    let within = if scenario.preset == "fe" { 0.7 } else { 0.5 };
    assert!(off.abs() < within, "{name}: {off} mm from the end");
    assert_eq!(bench.now().seen.level, 3 * u8::from(direction == Direction::Deploy), "{name}");
    assert!(bench.step_codes().is_empty(), "{name}: {:?}", bench.step_codes());
    assert!(bench.now().truth.slip_mm < NO_SLIP_MM, "{name}");
    assert!(bench.peak_preload_n() <= scenario.rig.preload.limit_n, "{name}");
}

/// Three crossings in one direction, each recorded once and near the reference gap.
fn assert_three_crossings(bench: &Bench, scenario: &Scenario, name: &str) {
    let direction = scenario.run.direction;
    let order = if direction == Direction::Deploy { [1, 2, 3] } else { [3, 2, 1] };
    let truly: Vec<usize> = bench.crossings().iter().map(|crossing| crossing.index).collect();
    assert_eq!(truly, order, "{name}");
    let recorded: Vec<_> = bench.records().iter().map(|r| usize::from(r.index)).collect();
    assert_eq!(recorded, order, "{name}");
    for record in bench.records() {
        assert_eq!(record.direction, direction.into(), "{name}");
        assert!(record.residual.to_num::<f64>().abs() < 0.5, "{name}: {record:?}");
    }
    for crossing in bench.crossings() {
        // A tread that has rested on the corner is softer: less gap, hardly ever more.
        let part = crossing.gap_mm / gap_ref(scenario, direction.into());
        // On the fe rig the measured gap, which the schedule learns from, is up to 6 % off.
        let most = if scenario.preset == "fe" { 1.08 } else { 1.04 };
        assert!((0.65..most).contains(&part), "{name} step {}: {part}", crossing.index);
    }
}

fn gap_ref(scenario: &Scenario, direction: units::Direction) -> f64 {
    let planner = interstage::model::Planner::try_build(&scenario.rig).expect("a sound rig");
    planner.gap_ref(direction).to_num()
}

#[test]
fn a_run_stopped_anywhere_goes_on_to_its_end() {
    check_each(sample(everywhere()), |case| {
        let Case { scenario, name, .. } = case;
        let mut bench = stopped(case);
        bench.go(scenario.run.direction);
        assert_arrived(&bench, scenario, scenario.run.direction, name);
        assert_three_crossings(&bench, scenario, name);
    });
}

#[test]
fn a_run_stopped_while_the_preload_builds_starts_again() {
    for direction in DIRECTIONS {
        let scenario = scenario("prototype", direction, 0);
        let mut bench = Bench::idle(&scenario);
        bench.give(starter(direction));
        bench.run_s(0.03);
        assert_eq!(bench.mode(), Mode::Preload(direction.into()));
        bench.give(Command::Stop);
        assert_eq!(bench.mode(), Mode::Idle);
        assert!(bench.now().is_off());
        bench.run_s(0.5);
        bench.go(direction);
        assert_arrived(&bench, &scenario, direction, direction.name());
        assert_three_crossings(&bench, &scenario, direction.name());
    }
}

/// Every record of the controller is of a step at its place in the table, with a gap near the
/// reference.
fn assert_sound_records(bench: &Bench, scenario: &Scenario, name: &str) {
    for record in bench.records() {
        assert!(record.residual.to_num::<f64>().abs() < 0.5, "{name}: {record:?}");
        let measured = record.gap_measured.to_num::<f64>();
        let truth = bench.true_gap_mm(&record);
        // At the study's loads one that is turned back just after touch-down leaves at 19 mm/s: 1.07.
        let (most, off) = if name.starts_with("fe") { (1.08, 0.06) } else { (1.05, 0.03) };
        let part = truth.unwrap_or(measured) / gap_ref(scenario, record.direction);
        assert!((0.65..most).contains(&part), "{name}: {part} {record:?}");
        let error = measured / truth.unwrap_or(measured) - 1.0;
        assert!(error.abs() < off, "{name}: {truth:?} mm, {record:?}");
    }
}

#[test]
fn a_run_turned_back_anywhere_returns() {
    check_each(sample(everywhere()), |case| {
        let Case { scenario, name, .. } = case;
        let home = opposite(scenario.run.direction);
        let mut bench = stopped(case);
        bench.go(home);
        // One step that is left may not bear out where the wheel is under these loads.
        let on_second = !matches!(case.place, Place::Cruise | Place::Settle);
        let alone = name.starts_with("fe retract") && on_second;
        if !alone || bench.mode() != Mode::FaultHold(Fault::PlaceUnconfirmed) {
            assert_arrived(&bench, scenario, home, name);
        }
        assert_sound_records(&bench, scenario, name);
    });
}

#[test]
fn a_session_goes_out_back_and_out_again() {
    for rig in RIGS {
        let scenario = scenario(rig, Direction::Deploy, 0);
        let mut bench = Bench::idle(&scenario);
        for direction in [Direction::Deploy, Direction::Retract, Direction::Deploy] {
            bench.go(direction);
            assert_arrived(&bench, &scenario, direction, rig);
            bench.run_s(1.0);
            assert!(bench.now().is_off(), "{rig}");
        }
        let order: Vec<_> = bench.crossings().iter().map(|c| (c.index, c.climbing)).collect();
        let out = [(1, true), (2, true), (3, true)];
        let home = [(3, false), (2, false), (1, false)];
        assert_eq!(order, [out, home, out].concat(), "{rig}");
        let records = bench.records();
        assert_eq!(records.len(), 9, "{rig}");
        for (record, crossing) in records.iter().zip(bench.crossings()) {
            assert_eq!(usize::from(record.index), crossing.index, "{rig}");
            let off = |gap: f64| gap / crossing.gap_mm - 1.0;
            let measured = off(record.gap_measured.to_num());
            let predicted = off(record.gap_predicted.to_num());
            // A tread that is pressed three times as deep remembers more than the last half
            // millimetre, over which the speed of a crossing is taken; three sigmas of a measured
            // gap are 0.11 mm.
            let (read, bound) = if rig == "fe" { (0.06, 0.06) } else { (0.03, 0.05) };
            assert!(measured.abs() < read, "{rig} {crossing:?}: {measured}");
            assert!(predicted.abs() < bound, "{rig} {crossing:?}: {predicted}");
        }
    }
}

/// Commands that this mode does not accept, by the table of transitions.
fn refused_in(mode: Mode) -> Vec<Command> {
    let refused = |command: &Command| next(mode, Trigger::Command(*command)).is_none();
    Command::ALL.into_iter().filter(refused).collect()
}

/// A session through every mode: late sensors, a start, a stop, the rest of the run, and a
/// fault at its end. With `pester`, each tick that needs no command is given one that its mode
/// does not accept; returns the number of those.
fn through_every_mode(direction: Direction, pester: bool) -> (Bench, usize) {
    let mut bench = Bench::new(&scenario("prototype", direction, 0));
    let (mut stopped, mut waited, mut pestered) = (false, 0, 0);
    let mut last = None;
    for tick in 0..20_000_usize {
        let mode = bench.mode();
        let approaching =
            bench.moments.last().is_some_and(|now| Place::Approach.is_at(direction, now));
        let wanted = match mode {
            Mode::Idle if waited >= 20 => Some(starter(direction)),
            Mode::Run(..) if approaching && !stopped => Some(Command::Stop),
            _ => None,
        };
        stopped |= wanted == Some(Command::Stop);
        let rests = matches!(mode, Mode::Idle | Mode::Complete(_) | Mode::FaultHold(_));
        waited = if rests { waited + 1 } else { 0 };
        if waited > 200 {
            break;
        }
        let refused = refused_in(mode);
        assert!(!refused.is_empty(), "{mode:?} takes every command");
        let unwanted = refused[tick % refused.len()];
        let command = if pester { wanted.or(Some(unwanted)) } else { wanted };
        pestered += usize::from(pester && wanted.is_none());
        bench.spoiled(command, |frame| {
            if tick < 50 {
                frame[SensorId::ArmAngle] = None;
            }
            if matches!(mode, Mode::Complete(_) | Mode::FaultHold(_)) && waited > 50 {
                *frame = *last.get_or_insert(*frame);
            }
        });
    }
    (bench, pestered)
}

#[test]
fn commands_in_the_wrong_mode_are_refused_and_change_nothing() {
    for direction in DIRECTIONS {
        let ((quiet, _), (pestered, times)) =
            (through_every_mode(direction, false), through_every_mode(direction, true));
        assert_eq!(quiet.moments, pestered.moments, "{}", direction.name());
        let refusals = |bench: &Bench| {
            bench.log.iter().filter(|entry| matches!(entry.event, Event::Refused(_))).count()
        };
        assert_eq!((refusals(&quiet), refusals(&pestered)), (0, times), "{}", direction.name());
        let mut rest = pestered.log.clone();
        rest.retain(|entry| !matches!(entry.event, Event::Refused(_)));
        assert_eq!(quiet.log, rest, "{}", direction.name());
        for (what, is) in VISITED {
            let ticks = quiet.moments.iter().filter(|now| is(&now.seen.mode)).count();
            assert!(ticks > 10, "{}, {what}: {ticks}", direction.name());
        }
    }
}

/// A mode that a session passes through.
type Visited = (&'static str, fn(&Mode) -> bool);

const VISITED: [Visited; 8] = [
    ("boot", |mode| *mode == Mode::Boot),
    ("self-test", |mode| *mode == Mode::SelfTest),
    ("idle", |mode| *mode == Mode::Idle),
    ("preload", |mode| matches!(mode, Mode::Preload(_))),
    ("run", |mode| matches!(mode, Mode::Run(..))),
    ("stopping", |mode| matches!(mode, Mode::Stopping(_))),
    ("complete", |mode| matches!(mode, Mode::Complete(_))),
    ("fault hold", |mode| matches!(mode, Mode::FaultHold(_))),
];

/// A sensor that can fall silent, and the fault that reports it.
type Silence = (SensorId, Fault);

const SENSORS: [Silence; 4] = [
    (SensorId::WheelEncoder, Fault::WheelEncoderStale),
    (SensorId::PreloadSensor, Fault::PreloadSensorStale),
    (SensorId::CompressionSensor, Fault::CompressionSensorStale),
    (SensorId::ArmAngle, Fault::ArmAngleStale),
];

/// The sensor is silent for so long from now on.
fn silence(bench: &mut Bench, sensor: &Silence, ms: u32) {
    let mut last = None;
    for _ in 0..ms {
        bench.spoiled(None, |frame| {
            let old = *last.get_or_insert(*frame);
            frame[sensor.0] = old[sensor.0];
        });
    }
}

#[test]
fn a_sensor_that_falls_silent_stops_everything_at_once() {
    for (index, sensor) in SENSORS.into_iter().enumerate() {
        let cases = everywhere().filter(|case| case.later_ms == 0);
        for case in sample(cases.skip(index)) {
            let name = format!("{}, {:?}", case.name, sensor.0);
            let scenario = &case.scenario;
            let mut bench = run_to(&case);
            let from = bench.moments.len();
            silence(&mut bench, &sensor, 300);
            assert_eq!(bench.faults(), [sensor.1], "{name}");
            let held = |now: &Moment| matches!(now.seen.mode, Mode::FaultHold(_));
            let found = bench.moments[from..].iter().position(held).expect("a fault hold");
            let limit = (scenario.rig.sense.stale_after_s * 1e3) as usize;
            // The arm answers every second tick only.
            assert!((limit..=limit + 3).contains(&found), "{name}: {found} ms");
            let (moving, stopped) = bench.moments[from..].split_at(found);
            assert!(moving.iter().all(|now| now.drive.enable && now.preload.enable), "{name}");
            assert!(stopped.iter().all(Moment::is_off), "{name}");
            let moved = stopped[20..].iter().map(|now| now.truth.rigid_mm_s.abs() * 1e-3);
            assert!(moved.sum::<f64>() < 0.02, "{name}");
            assert!(stopped[60].is_still(), "{name}");
            let pressed = stopped[0].truth.preload_n;
            let kept = stopped.iter().map(|now| now.truth.preload_n / pressed);
            assert!(kept.clone().fold(f64::MAX, f64::min) > 0.98, "{name}");
            assert!(kept.fold(0.0, f64::max) < 1.02, "{name}");
            assert!(bench.peak_preload_n() <= scenario.rig.preload.limit_n, "{name}");
        }
    }
}

#[test]
fn a_sensor_silent_for_less_than_its_limit_is_ridden_out() {
    let all = cases(&[Place::FirstHalf], &[20]);
    for case in all.iter().filter(|case| case.scenario.preset == "prototype") {
        for sensor in SENSORS {
            let name = format!("{}, {:?}", case.name, sensor.0);
            let mut bench = run_to(case);
            silence(&mut bench, &sensor, 15);
            bench.finish();
            assert_eq!(bench.faults(), [], "{name}");
            assert_arrived(&bench, &case.scenario, case.scenario.run.direction, &name);
            assert_three_crossings(&bench, &case.scenario, &name);
        }
    }
}

/// The run ended in a fault at that place, was reset, and was sent on.
fn reset(case: &Case, sensor: &Silence) -> Bench {
    let mut bench = run_to(case);
    silence(&mut bench, sensor, 100);
    assert_eq!(bench.mode(), Mode::FaultHold(sensor.1));
    bench.run_s(0.5);
    assert_eq!(bench.mode(), Mode::FaultHold(sensor.1), "a fault never clears itself");
    bench.give(Command::Reset);
    bench.until("idle", 1.0, |now| now.seen.mode == Mode::Idle);
    assert!(bench.now().is_off());
    bench.go(case.scenario.run.direction);
    bench
}

#[test]
fn a_run_reset_after_a_fault_anywhere_goes_on() {
    check_each(sample(everywhere()).zip(SENSORS.iter().cycle()), |(case, sensor)| {
        let Case { scenario, .. } = case;
        let name = format!("{}, {:?}", case.name, sensor.0);
        let bench = reset(case, sensor);
        assert_arrived(&bench, scenario, scenario.run.direction, &name);
        assert_three_crossings(&bench, scenario, &name);
    });
}

/// Stopped at that place of the sleeve during deployment, powered down and up again, and sent
/// in this direction.
fn after_power_loss(at_mm: f64, direction: Direction) -> Bench {
    let mut bench = Bench::idle(&scenario("prototype", Direction::Deploy, 0));
    bench.give(Command::Start);
    bench.until("place", 20.0, |now| now.truth.position_mm >= at_mm);
    bench.give(Command::Stop);
    bench.until("idle", 0.4, |now| now.seen.mode == Mode::Idle);
    bench.session.reboot();
    bench.tick();
    bench.until("idle", 1.0, |now| now.seen.mode == Mode::Idle);
    bench.go(direction);
    bench
}

#[test]
fn after_power_loss_between_two_steps_the_next_step_gives_the_position() {
    // Clear of the corners at 18, 40 and 62 mm.
    for at_mm in [20.0, 22.0, 41.0, 44.0] {
        for direction in DIRECTIONS {
            let bench = after_power_loss(at_mm, direction);
            let scenario = scenario("prototype", direction, 0);
            let name = format!("{at_mm} mm, {}", direction.name());
            assert_arrived(&bench, &scenario, direction, &name);
        }
    }
}

#[test]
fn after_power_loss_an_end_is_not_claimed_before_it_is_reached() {
    let mut wrong = Vec::new();
    for at_mm in [2.0, 4.0, 12.0, 28.0, 32.0, 51.0, 56.0, 64.0, 70.0, 76.0] {
        for direction in DIRECTIONS {
            let bench = after_power_loss(at_mm, direction);
            let off = bench.position_mm() - end_mm(&scenario("prototype", direction, 0), direction);
            if bench.faults().is_empty() && off.abs() > 1.0 {
                wrong.push(format!("{at_mm} mm, {}: {off:+.1} mm", direction.name()));
            }
        }
    }
    assert!(wrong.is_empty(), "complete, but away from the end: {wrong:?}");
}
