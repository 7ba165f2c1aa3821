//! The hot paths on this machine: control tick, reduced model both ways, ring
//! crossing, plant, deployment. `cargo bench -p hil-sim`.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use hil_sim::bench::problem::Problem;
use hil_sim::plant::crossing::cross;
use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::precision::Setting;
use hil_sim::plant::rig::VirtualRig;
use hil_sim::scenario::Scenario;
use hil_sim::sil::{self, Options, Session};
use interstage::model::formula::Formula;
use interstage::model::reduced::{Point, ReducedModel, Scale};
use interstage::rig::Rig;
use interstage::supervise::{Command, Direction};
use interstage::units::q16;

/// A session on its way over the first step, ticks after its start.
fn under_way(scenario: &Scenario, ticks: u32) -> Session {
    let mut session = Session::new(scenario, Options::default()).expect("the rig builds");
    for tick in 0..ticks {
        let command = (tick == 900).then_some(Command::Start);
        session.step(command).expect("the plant runs");
    }
    session
}

fn tick(c: &mut Criterion) {
    let scenario = Scenario::default();
    for (name, ticks) in [("idle", 500), ("under way", 2500)] {
        c.bench_function(&format!("control tick and plant, a millisecond, {name}"), |b| {
            b.iter_batched_ref(
                || under_way(&scenario, ticks),
                |session| session.step(None).expect("the plant runs"),
                BatchSize::LargeInput,
            );
        });
    }
}

fn reduced(c: &mut Criterion) {
    let rig = Rig::prototype();
    let model = ReducedModel::try_build(&rig).expect("the rig builds");
    let formula = Formula::new(&rig);
    let point =
        Point { direction: Direction::Deploy, speed: q16(8_000_000), scale: Scale::NOMINAL };
    let force = q16(48_000_000);
    let gap = model.gap(&point, force);
    assert!((gap.to_num::<f64>() - 2.58).abs() < 0.1, "{gap}");
    c.bench_function("reduced model, fixed point, force to a crossing", |b| {
        b.iter(|| model.crossing(black_box(&point), black_box(force)));
    });
    c.bench_function("reduced model, fixed point, gap to force", |b| {
        b.iter(|| model.force(black_box(&point), black_box(gap)));
    });
    c.bench_function("reduced model, f64, force to gap", |b| {
        b.iter(|| black_box(&formula).gap_mm(Direction::Deploy, black_box(8.0), 48.0, Some(6.7)));
    });
}

fn ring(c: &mut Criterion) {
    let case = Problem::published().case(Setting::usual());
    c.bench_function("crossing of the ring, default resolution", |b| {
        b.iter(|| cross(black_box(&case)).expect("it balances").gap_mm);
    });
}

fn deployment(c: &mut Criterion) {
    let scenario = Scenario::default();
    c.bench_function("building a plant", |b| {
        b.iter(|| VirtualRig::new(PlantParameters::draw(black_box(&scenario)), 0.0, 0.0, 1e-3));
    });
    c.bench_function("deployment", |b| {
        b.iter(|| {
            let run = sil::run(black_box(&scenario), Options::default()).expect("it runs");
            assert!(run.summary.completed);
            run
        });
    });
}

criterion_group! {
    name = hot_paths;
    config = Criterion::default().sample_size(20);
    targets = tick, reduced, ring, deployment
}
criterion_main!(hot_paths);
