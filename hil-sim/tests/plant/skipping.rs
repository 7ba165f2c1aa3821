//! Skipped computations change no bit.

use hil_sim::plant::rig::{Resolution, Truth, VirtualRig};
use hil_sim::plant::ring::Work;
use hil_sim::plant::wall::{Step, Wall};
use hil_sim::scenario::Scenario;
use hil_sim::session::{Options, Session, run_session};

use super::bench::{TICK_S, nominal, roll};

/// All states of a deployment or retraction, and the rig at its end.
fn states(all: bool, speed: f64) -> (Vec<Truth>, VirtualRig) {
    let (from, to) = if speed > 0.0 { (0.0, 80.0) } else { (80.0, 0.0) };
    let mut rig = VirtualRig::new(nominal("prototype"), from, 45.0, TICK_S);
    if all {
        rig = rig.visiting_all();
    }
    let mut states = Vec::new();
    assert_eq!(roll(&mut rig, speed, to, 60.0, |rig| states.push(*rig.truth())), Ok(true));
    (states, rig)
}

#[test]
fn elements_out_of_reach_change_no_bit() {
    for speed in [8.0, 30.0, -8.0, -30.0] {
        let (few, rig) = states(false, speed);
        let (all, complete) = states(true, speed);
        assert_eq!(few, all);
        assert_eq!(rig.ledger().crossings(), complete.ledger().crossings());
        let (some, every) = (rig.work().0.elements, complete.work().0.elements);
        assert!(some * 5 < every, "{some} of {every}");
    }
}

#[test]
fn a_run_is_the_same_with_skipping_and_without() {
    for direction in ["deploy", "retract"] {
        let set = vec![format!("run.direction={direction}")];
        let scenario = Scenario::resolve(Some("prototype"), None, &set).unwrap();
        let made = |options, all| {
            let session = Session::new(&scenario, options).unwrap();
            let session = if all { session.visiting_all() } else { session };
            let mut recording = run_session(session, &scenario).unwrap();
            recording.summary.real_time_factor = 0.0;
            recording
        };
        let usual = made(Options::default(), false);
        let all = made(Options::default(), true);
        assert_eq!((&usual.summary, &usual.log), (&all.summary, &all.log));
        // Recording rows changes nothing either.
        let rows = made(Options::ROWS, false);
        assert_eq!((&usual.summary, &usual.log), (&rows.summary, &rows.log));
        assert!(usual.rows.is_empty() && !rows.rows.is_empty());
    }
}

#[test]
fn memory_evaluated_lazily_is_the_same() {
    // Back and forth, so that elements return with their memory: closed form against step by step.
    let ends = [false, true].map(|all| {
        let mut plant = nominal("prototype");
        plant.wall = Wall::new(vec![Step { position_mm: 50.0, height_mm: 4.0 }]);
        plant.ring.tau_s = 3.0;
        let awake = Resolution { always_awake: true, ..Resolution::default() };
        let mut rig = VirtualRig::new(plant, 10.0, 40.0, TICK_S).with_resolution(awake);
        if all {
            rig = rig.visiting_all();
        }
        for to in [22.0, 12.0, 24.0] {
            let speed = if to > rig.truth().position_mm { 20.0 } else { -20.0 };
            assert_eq!(roll(&mut rig, speed, to, 10.0, |_| {}), Ok(true));
        }
        *rig.truth()
    });
    let [lazy, eager] = ends;
    assert!((lazy.height_mm - eager.height_mm).abs() < 1e-9, "{lazy:?} {eager:?}");
    assert!((lazy.utilisation - eager.utilisation).abs() < 1e-8, "{lazy:?} {eager:?}");
}

/// Time, s, ring work, contacts of steady rolling computed, and heights tried on a tangent.
#[derive(Clone, Copy, Debug, Default)]
struct Computed {
    time_s: f64,
    ring: Work,
    steady: (u64, u64),
}

/// What a run at 8 mm/s computed in ticks with the ring asleep, awake, and under a corner.
fn computed(mut rig: VirtualRig) -> [Computed; 3] {
    let (mut parts, mut before) = ([Computed::default(); 3], rig.work());
    let ended = roll(&mut rig, 8.0, 80.0, 60.0, |rig| {
        let (truth, (ring, steady)) = (rig.truth(), rig.work());
        let part = &mut parts[usize::from(truth.ring_awake) + usize::from(truth.corner_n > 0.0)];
        part.time_s += TICK_S;
        part.ring.strides += ring.strides - before.0.strides;
        part.ring.iterations += ring.iterations - before.0.iterations;
        part.steady.0 += steady.0 - before.1.0;
        part.steady.1 += steady.1 - before.1.1;
        before = (ring, steady);
    });
    assert_eq!(ended, Ok(true));
    parts
}

#[test]
fn the_ring_rests_on_the_smooth_wall_and_needs_few_heights_on_a_corner() {
    let parts = computed(VirtualRig::new(nominal("prototype"), 0.0, 45.0, TICK_S));
    let [smooth, awake, crossing] = parts;
    assert!(smooth.ring.strides == 0 && smooth.steady.1 > 0, "{smooth:?}");
    assert!(awake.ring.strides > 0 && crossing.ring.strides > 0, "{parts:?}");
    // The first guess is good enough for two or three heights a stride.
    assert!(crossing.ring.iterations < 3 * crossing.ring.strides, "{crossing:?}");
}

#[test]
fn on_the_smooth_wall_hardly_anything_is_computed() {
    let mut plant = nominal("prototype");
    plant.wall = Wall::new(Vec::new());
    let [smooth, awake, crossing] = computed(VirtualRig::new(plant, 0.0, 33.3, TICK_S));
    assert!(smooth.time_s > 8.0 && crossing.time_s == 0.0);
    assert!(awake.time_s < 1.5, "{awake:?}");
    assert!(smooth.steady.0 < 10, "{smooth:?}");
    let ticks = (smooth.time_s / TICK_S) as u64;
    assert!(smooth.steady.1 <= ticks + ticks / 5, "{smooth:?}");
}
