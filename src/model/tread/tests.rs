// The scheme in floating point, which the measurement image runs too.
#[path = "../../../hil-sim/images/src/tread.rs"]
mod float;
#[path = "../../../hil-sim/images/src/number.rs"]
mod number;

use super::state::{Element, Patch, Reach};
use super::*;
use crate::model::rollout::{LEAST_SPEED, Rolled, Run, roll};
use crate::rig::Rig;
use float::{Course, Crossing, FloatTread, Wheel};
use proptest::prelude::*;

const RADIUS: f64 = 25.0;

fn tread(change: impl FnOnce(&mut Rig)) -> Tread {
    let mut rig = Rig::prototype();
    change(&mut rig);
    Tread::try_build(&rig).unwrap()
}

fn drive(direction: Direction, load_n: Option<f64>, pressed_n: f64, speed_mm_s: f64) -> Drive {
    Drive {
        direction,
        axial: load_n.map_or(Axial::Pushed, |load| Axial::Driven(Q16::from_num(load))),
        pressed: Q16::from_num(pressed_n),
        duration: Q16::from_num(0.2 / speed_mm_s),
        scale: Q16::ONE,
        level: true,
    }
}

fn run(direction: Direction, load_n: Option<f64>, scale: f64) -> Run {
    let (from, until) = match direction {
        Direction::Deploy => (-32.0, 10.0),
        Direction::Retract => (20.0, -25.0),
    };
    Run {
        direction,
        axial: load_n.map_or(Axial::Pushed, |load| Axial::Driven(Q16::from_num(load))),
        scale: Q16::from_num(scale),
        level: true,
        from: Q16::from_num(from),
        until: Q16::from_num(until),
    }
}

fn crossed(tread: &Tread, run: &Run, speed: f64, pressed: f64) -> Rolled {
    let course = |_| (Q16::from_num(speed), Q16::from_num(pressed));
    roll(tread, &mut TreadState::default(), run, course)
}

/// The same in f64.
fn exact(rig: &Rig, run: &Run, load_n: Option<f64>, speed: f64, pressed: f64) -> Crossing {
    let wheel = Wheel {
        radius_mm: rig.rig.wheel_radius_mm,
        width_mm: rig.rig.wheel_width_mm,
        height_mm: rig.rig.step_height_mm,
        k_inf: 1e-9 * rig.tread.k_inf_pa_per_m,
        stiffening: rig.tread.stiffening,
        tau_s: rig.tread.tau_s,
        load_n,
    };
    FloatTread::<f64, 8000, 256>::new(&wheel).cross(&Course {
        forward: run.direction == Direction::Deploy,
        from_mm: f64_of(run.from),
        until_mm: f64_of(run.until),
        speed_mm_s: speed,
        pressed_n: pressed,
    })
}

fn f64_of(number: Q16) -> f64 {
    number.to_num()
}

#[test]
fn a_wheel_put_down_sinks_as_hertz_s_elastic_bed_does() {
    // N = 4/3 k L sqrt(2 R) c^1.5 for a compression c far below R; and the integral itself,
    // N = 2 k L R (R sin a - y a) with cos a = y/R.
    for pressed in [5.0, 15.0, 50.0, 150.0] {
        for (position, wall) in [(-50.0, 0.0), (50.0, 4.0)] {
            let mut state = TreadState::default();
            let drive = drive(Direction::Deploy, None, pressed, 8.0);
            tread(|_| ()).put_down(&mut state, Q16::from_num(position), &drive);
            let y = f64::from(state.frame.centre) / f64::from(1 << 22) - wall;
            let (sunk, stiffness) = (RADIUS - y, 0.6044 * 28.0);
            let hertz = 4.0 / 3.0 * stiffness * (2.0 * RADIUS).sqrt() * sunk.powf(1.5);
            assert!((hertz / pressed - 1.0).abs() < 3.0 * sunk / RADIUS, "{pressed} N: {sunk} mm");
            let angle = (y / RADIUS).acos();
            let force = 2.0 * stiffness * RADIUS * (RADIUS * angle.sin() - y * angle);
            assert!((force / pressed - 1.0).abs() < 0.003, "{pressed} N: {force} N");
        }
    }
}

#[test]
fn the_contact_carries_what_presses_the_wheel() {
    for load in [None, Some(6.7)] {
        let (tread, mut state) = (tread(|_| ()), TreadState::default());
        let drive = drive(Direction::Deploy, load, 48.0, 8.0);
        tread.put_down(&mut state, Q16::from_num(-30.0), &drive);
        for stride in 0..200 {
            let contact = tread.advance(&mut state, &drive);
            let carried =
                f64_of(contact.radial) + f64_of(contact.utilisation) * f64_of(contact.axial);
            assert!(stride < 2 || (carried / 48.0 - 1.0).abs() < 0.005, "{stride}: {contact:?}");
        }
    }
}

#[test]
fn rubber_without_memory_is_symmetric_and_gives_back_the_climb() {
    // On the way up the work is preload times height; down, the same comes back.
    let tread = tread(|rig| rig.tread.stiffening = 1.0);
    let work = |direction| {
        let run = run(direction, None, 1.0);
        let drive = drive(direction, None, 48.0, 8.0);
        let mut state = TreadState::default();
        tread.put_down(&mut state, run.from, &drive);
        let (mut work, mut before) = (0.0, 0.0);
        let strides = ((f64_of(run.until) - f64_of(run.from)).abs() / 0.2) as usize;
        for _ in 0..strides {
            let axial = f64_of(tread.advance(&mut state, &drive).axial);
            work += 0.5 * (axial + before) * 0.2;
            before = axial;
        }
        work
    };
    for direction in [Direction::Deploy, Direction::Retract] {
        let work = work(direction);
        assert!((work / (48.0 * 4.0) - 1.0).abs() < 0.01, "{direction:?} {work}");
    }
    let gap = |direction| f64_of(crossed(&tread, &run(direction, None, 1.0), 8.0, 48.0).gap);
    let (up, down) = (gap(Direction::Deploy), gap(Direction::Retract));
    assert!((up / down - 1.0).abs() < 0.01, "{up} {down}");
}

#[test]
fn rubber_with_memory_takes_work_and_lifts_off_low() {
    let tread = tread(|_| ());
    let up = crossed(&tread, &run(Direction::Deploy, None, 1.0), 8.0, 48.0);
    let down = crossed(&tread, &run(Direction::Retract, None, 1.0), 8.0, 48.0);
    // The ring's gaps, converged.
    assert!((f64_of(up.gap) - 2.4560).abs() < 0.007, "{up:?}");
    assert!((f64_of(down.gap) - 2.0783).abs() < 0.007, "{down:?}");
    assert!(f64_of(up.lift.1) < RADIUS - 0.1 && down.lift.1 == tread.radius());
    assert!(up.utilisation == Q16::ZERO && up.corner_force > down.corner_force);
}

#[test]
fn elements_out_of_contact_change_no_bit() {
    let tread = tread(|_| ());
    for direction in [Direction::Deploy, Direction::Retract] {
        let run = run(direction, Some(6.7), 1.0);
        let drive = drive(direction, Some(6.7), 48.0, 8.0);
        let mut state = TreadState::default();
        tread.put_down(&mut state, run.from, &drive);
        let strides = ((f64_of(run.until) - f64_of(run.from)).abs() / 0.2) as usize;
        for stride in 0..strides {
            let mut other = state.clone();
            // What touches neither before the stride nor after it.
            let mut after = state.clone();
            tread.advance(&mut after, &drive);
            let turn = if direction == Direction::Deploy { -1 } else { 1 };
            for place in -Shipped::BEHIND + 1..Shipped::AHEAD - 1 {
                let near = |reach: &Reach, place: i32| {
                    let near = |patch: Patch| patch.low - 4 <= place && place < patch.high + 4;
                    near(reach.floor) || near(reach.step) || (reach.top - place).abs() < 4
                };
                if !near(&state.reach, place) && !near(&after.reach, place + turn) {
                    let number = other.frame.number(place);
                    assert_eq!(*other.elements.at(number), Element::default(), "{stride} {place}");
                    *other.elements.at_mut(number) = Element { memory: 1 << 21, depth: 1 << 20 };
                }
            }
            let contact = tread.advance(&mut state, &drive);
            assert_eq!(contact, tread.advance(&mut other, &drive), "{stride}");
        }
    }
}

type Shipped = rays::Rays<8000, 256>;

#[test]
fn a_stiffer_faster_or_less_pressed_tread_leaves_a_wider_gap() {
    let tread = tread(|_| ());
    for direction in [Direction::Deploy, Direction::Retract] {
        for load in [None, Some(6.7)] {
            let gap = |scale, speed, pressed| {
                crossed(&tread, &run(direction, load, scale), speed, pressed).gap
            };
            let gaps = [0.8, 1.0, 1.25].map(|scale| gap(scale, 8.0, 48.0));
            assert!(gaps[0] < gaps[1] && gaps[1] < gaps[2], "{gaps:?}");
            // Stiffness and force in one ratio are one gap.
            let (one, other) = (f64_of(gap(1.0, 8.0, 40.0)), f64_of(gap(1.25, 8.0, 50.0)));
            assert!(load.is_some() || (one - other).abs() < 1e-3, "{one} {other}");
            assert!(gap(1.0, 8.0, 60.0) < gap(1.0, 8.0, 48.0));
            assert!(gap(1.0, 30.0, 48.0) > gap(1.0, 8.0, 48.0));
        }
    }
}

#[test]
fn where_the_axle_lags_behind_the_tread_the_wheel_runs_farther() {
    let tread = tread(|_| ());
    let level = run(Direction::Deploy, None, 1.0);
    let strides = |run: &Run| crossed(&tread, run, 8.0, 48.0).strides;
    let farther = strides(&Run { level: false, ..level }) - strides(&level);
    // Rolling over the corner, 0.4 to 0.8 mm, and a third of the compression over the radius.
    assert!((3..=6).contains(&farther), "{farther}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Fixed point against the same scheme in f64: 3 um of the gap, 0.001 of the friction, and 0.1 %
    /// of the force.
    #[test]
    fn fixed_point_is_the_scheme_in_f64(
        speed in 1.0..100.0f64,
        pressed in 15.0..150.0f64,
        height in 2.0..6.0f64,
        tau in -2.0..0.0f64,
        load in prop::option::of(0.0..10.0f64),
        up in any::<bool>(),
    ) {
        let direction = if up { Direction::Deploy } else { Direction::Retract };
        let mut rig = Rig::prototype();
        rig.rig.step_height_mm = height;
        rig.tread.tau_s = 10f64.powf(tau);
        let run = run(direction, load, 1.0);
        let exact = exact(&rig, &run, load, speed, pressed);
        let got = crossed(&Tread::try_build(&rig).unwrap(), &run, speed, pressed);
        prop_assert!((f64_of(got.gap) - exact.gap_mm).abs() < 0.003, "{got:?} {exact:?}");
        if exact.utilisation < 1.5 {
            prop_assert!((f64_of(got.utilisation) - exact.utilisation).abs() < 0.001);
        }
        prop_assert!((f64_of(got.corner_force) / exact.corner_force_n - 1.0).abs() < 0.001);
    }

    /// Whatever the validator accepts rolls to the end, and what no number holds saturates.
    #[test]
    fn no_accepted_rig_panics(
        radius in 10.0..150.0f64,
        width in 1.0..200.0f64,
        height in 0.0..1.0f64,
        k in 7.0..10.7f64,
        stiffening in 1.0..20.0f64,
        tau in -3.0..1.0f64,
        load in prop::option::of(-200.0..200.0f64),
        pressed in 0.0..180.0f64,
        speed in 0.0..300.0f64,
        scale in 0.1..10.0f64,
        up in any::<bool>(),
        level in any::<bool>(),
    ) {
        let tread = tread(|rig| {
            rig.rig.wheel_radius_mm = radius;
            rig.rig.wheel_width_mm = width;
            rig.rig.step_height_mm = 1.5 + (8.0_f64.min(0.9 * radius) - 1.5) * height;
            rig.tread.k_inf_pa_per_m = 10f64.powf(k).min(5e10);
            rig.tread.stiffening = stiffening;
            rig.tread.tau_s = 10f64.powf(tau);
        });
        let direction = if up { Direction::Deploy } else { Direction::Retract };
        let run = Run { level, ..run(direction, load, scale) };
        let rolled = crossed(&tread, &run, speed, pressed);
        prop_assert!(rolled.strides > 0);
    }
}

#[test]
fn the_least_speed_is_held() {
    let tread = tread(|_| ());
    let run = run(Direction::Deploy, None, 1.0);
    let still = crossed(&tread, &run, 0.0, 48.0);
    assert_eq!(still, crossed(&tread, &run, f64_of(LEAST_SPEED), 48.0));
}
