//! Plants to test on, and how to roll them.

use hil_sim::plant::balance::Axial;
use hil_sim::plant::crossing::{CrossingCase, CrossingResult, cross};
use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::ledger::Crossing;
use hil_sim::plant::rig::{Drives, PlantError, Resolution, VirtualRig};
use hil_sim::plant::ring::RingParameters;
use hil_sim::scenario::Scenario;
use interstage::rig::Rig;

pub(crate) const TICK_S: f64 = 1e-3;

/// Acceleration from rest, mm/s^2, as the controller's.
const ACCELERATION_MM_S2: f64 = 250.0;

pub(crate) fn nominal(preset: &str) -> PlantParameters {
    Scenario::named(preset).unwrap().plant()
}

/// A plant whose preload and speed are what is asked for: no spring, no ripple, an arm
/// without thrust on the wheel, a drive that does not yield.
pub(crate) fn ideal(preset: &str) -> PlantParameters {
    let mut plant = nominal(preset);
    plant.spring_n_per_mm = 0.0;
    plant.ripple.0 = 0.0;
    plant.arm.coupling = 0.0;
    plant.wind_up = 1e-4;
    plant.drive.stall_n = 1e7;
    plant.drive.limit_n = 1e7;
    plant.drive.friction_n = 0.0;
    plant
}

/// Wheel and rubber of both rigs with this many elements.
pub(crate) fn rubber(elements: usize) -> RingParameters {
    RingParameters::of(&Rig::prototype(), elements)
}

/// The same rubber without memory.
pub(crate) fn elastic(elements: usize) -> RingParameters {
    let ring = rubber(elements);
    RingParameters { k_0: ring.k_inf, ..ring }
}

/// A crossing of the 4 mm step on the converged ring.
pub(crate) fn fine(speed_mm_s: f64, preload_n: f64, axial: Axial) -> CrossingCase {
    CrossingCase::of(&Rig::prototype(), (5760, 0.005), (speed_mm_s, preload_n, axial))
}

/// The same on the ring that deployments use.
pub(crate) fn usual(speed_mm_s: f64, preload_n: f64, axial: Axial) -> CrossingCase {
    CrossingCase::of(&Rig::prototype(), (1440, 0.02), (speed_mm_s, preload_n, axial))
}

/// Crosses, or says which crossing could not be made.
pub(crate) fn crossed(case: &CrossingCase) -> CrossingResult {
    cross(case).unwrap_or_else(|error| panic!("{case:?}: {error}"))
}

/// A duty by the speed that the tread would have without load, mm/s.
pub(crate) fn drive(plant: &PlantParameters, speed_mm_s: f64) -> Drives {
    Drives { drive: speed_mm_s / plant.drive.no_load_mm_s, drive_on: true, ..Drives::default() }
}

/// Steps a rig for this many ticks under these commands.
pub(crate) fn steps(rig: &mut VirtualRig, drives: &Drives, ticks: u32) {
    (0..ticks).for_each(|_| rig.step(drives, TICK_S).unwrap());
}

/// Rolls a rig, its tread held at this speed and its screw locked, until it has passed
/// `to_mm` or the time is over; whether it got there.
pub(crate) fn roll(
    rig: &mut VirtualRig,
    speed_mm_s: f64,
    to_mm: f64,
    longest_s: f64,
    mut look: impl FnMut(&VirtualRig),
) -> Result<bool, PlantError> {
    let (mut wanted, mut sum) = (0.0f64, 0.0);
    for _ in 0..(longest_s / TICK_S) as usize {
        wanted = (wanted + ACCELERATION_MM_S2 * TICK_S).min(speed_mm_s.abs());
        let aim = wanted.copysign(speed_mm_s);
        sum += 40.0 * TICK_S * (aim - rig.truth().tread_mm_s);
        let drives = drive(rig.parameters(), aim + sum);
        rig.step(&drives, TICK_S)?;
        look(rig);
        if (rig.truth().position_mm - to_mm) * speed_mm_s >= 0.0 {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Deploys (or, at a negative speed, retracts) over the full travel from this preload,
/// and returns the rig at the end.
pub(crate) fn deploy(
    plant: PlantParameters,
    resolution: Resolution,
    speed_mm_s: f64,
    preload_n: f64,
    look: impl FnMut(&VirtualRig),
) -> VirtualRig {
    let (from, to) = if speed_mm_s > 0.0 { (0.0, 80.0) } else { (80.0, 0.0) };
    let mut rig = VirtualRig::new(plant, from, preload_n, TICK_S).with_resolution(resolution);
    let arrived = roll(&mut rig, speed_mm_s, to, 60.0, look).unwrap();
    assert!(arrived, "stuck: {:?}", rig.truth());
    rig
}

/// The same crossings of two runs, side by side.
pub(crate) fn pairs<'a>(a: &'a VirtualRig, b: &'a VirtualRig) -> Vec<(&'a Crossing, &'a Crossing)> {
    let (a, b) = (a.ledger().crossings(), b.ledger().crossings());
    assert_eq!((a.len(), b.len()), (3, 3));
    a.iter().zip(b).collect()
}

/// Relative difference.
pub(crate) fn off(got: f64, expected: f64) -> f64 {
    got / expected - 1.0
}

/// Asserts a relative difference.
#[track_caller]
pub(crate) fn close(got: f64, expected: f64, within: f64) {
    assert!(off(got, expected).abs() < within, "{got}, expected {expected} within {within}");
}
