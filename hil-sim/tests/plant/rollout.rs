//! The controller's rolled-out tread against the plant's ring.

use hil_sim::course::{Course, Row};
use hil_sim::plant::balance::Axial;
use hil_sim::plant::crossing::{CrossingCase, CrossingResult, cross_course, span_mm};
use hil_sim::plant::ring::RingParameters;
use hil_sim::testing;
use interstage::model::rollout::{Rolled, Run, roll};
use interstage::model::tread::{self, Tread, TreadState};
use interstage::rig::Rig;
use interstage::units::{Direction, Q16};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

/// The converged ring: within 0.1 % of twice as many elements and half the stride.
const CONVERGED: (usize, f64) = (2880, 0.01);

/// A crossing to compare.
#[derive(Debug)]
struct Case {
    height_mm: f64,
    tau_s: f64,
    retract: bool,
    load_n: Option<f64>,
    course: Course,
    /// Where the elements lie at the start, in mm of tread.
    phase_mm: f64,
}

/// Errors of gap, mm and relative, friction and relative force.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    gap_mm: f64,
    gap: f64,
    friction: f64,
    force: f64,
}

impl Case {
    /// Errors of the rollout, unless the wheel has no gap or needs friction above 1.5.
    fn errors(&self) -> Option<Errors> {
        let mut rig = Rig::prototype();
        rig.rig.step_height_mm = self.height_mm;
        rig.tread.tau_s = self.tau_s;
        let sign = if self.retract { -1.0 } else { 1.0 };
        let (speed, preload_n) = self.course.at(f64::NEG_INFINITY * sign);
        let (elements, stride_mm) = CONVERGED;
        let case = CrossingCase {
            ring: RingParameters::of(&rig, elements),
            step_height_mm: self.height_mm,
            speed_mm_s: sign * speed,
            preload_n,
            axial: self.load_n.map_or(Axial::Pushed, Axial::Driven),
            stride_mm,
        };
        let exact = cross_course(&case, |x| self.course.at(x)).ok()?;
        if exact.lift == (0.0, 0.0) || exact.mu_needed > 1.5 {
            return None;
        }
        let got = self.rolled(&rig, span_mm(&case, speed));
        Some(Errors::of(&got, &exact))
    }

    fn rolled(&self, rig: &Rig, (from, until): (f64, f64)) -> Rolled {
        let sign = if self.retract { -1.0 } else { 1.0 };
        let axial = |load| tread::Axial::Driven(Q16::from_num(load));
        let run = Run {
            direction: if self.retract { Direction::Retract } else { Direction::Deploy },
            axial: self.load_n.map_or(tread::Axial::Pushed, axial),
            scale: Q16::ONE,
            level: true,
            from: Q16::from_num(from - sign * self.phase_mm),
            until: Q16::from_num(until),
        };
        let tread = Tread::try_build(rig).unwrap();
        roll(&tread, &mut TreadState::default(), &run, |x| {
            let (speed, preload) = self.course.at(x.to_num());
            (Q16::from_num(speed), Q16::from_num(preload))
        })
    }
}

impl Errors {
    fn of(got: &Rolled, exact: &CrossingResult) -> Self {
        let gap: f64 = got.gap.to_num();
        Self {
            gap_mm: gap - exact.gap_mm,
            gap: gap / exact.gap_mm - 1.0,
            friction: got.utilisation.to_num::<f64>() - exact.mu_needed,
            force: got.corner_force.to_num::<f64>() / exact.corner_force_n - 1.0,
        }
    }

    /// The largest part of its bound: 0.7 % or 10 um of the gap, 0.02, 3 %.
    fn over_bounds(&self) -> f64 {
        let gap = (self.gap.abs() / 7e-3).min(self.gap_mm.abs() / 0.01);
        gap.max(self.friction.abs() / 0.02).max(self.force.abs() / 0.03)
    }
}

/// Draws equal ratios.
fn ratio(draw: &mut StdRng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(draw.random::<f64>())
}

/// A crossing anywhere in the domain.
fn drawn(draw: &mut StdRng, course: impl Fn(&mut StdRng, f64, bool) -> Course) -> Case {
    let height_mm = draw.random_range(2.0..6.0);
    let retract = draw.random();
    Case {
        height_mm,
        tau_s: ratio(draw, 0.01, 1.0),
        retract,
        load_n: draw.random::<bool>().then(|| draw.random_range(0.0..20.0)),
        course: course(draw, height_mm, retract),
        phase_mm: draw.random_range(0.0..0.2),
    }
}

/// Brakes to a slow speed shortly before the wheel lifts off (lands), and changes the preload until
/// then, as fast as a rig can.
fn late_braking(draw: &mut StdRng, height_mm: f64, retract: bool) -> Course {
    let fast = ratio(draw, 1.0, 100.0);
    let slow = ratio(draw, 1.0, fast.max(1.001));
    let [early, late] = [ratio(draw, 15.0, 150.0), ratio(draw, 15.0, 150.0)];
    let braking_mm_s2 = ratio(draw, 50.0, 500.0);
    let slew_n_per_s = ratio(draw, 10.0, 50.0);
    let below = 25.0 - height_mm;
    let run = (25.0 * 25.0 - below * below).sqrt();
    let slow_from = -run * draw.random_range(0.5..1.0);
    // Along the motion, s = 0 where it is slow, to 1.5 mm after it; then it accelerates.
    let sign = if retract { -1.0 } else { 1.0 };
    let speed = |s: f64| {
        let way = (-s).max(s - 1.5).max(0.0);
        (slow * slow + 2.0 * braking_mm_s2 * way).sqrt().min(fast)
    };
    // Back from there: the preload is what the slew rate allows. Over 12 mm, within which the ring
    // looks for the largest force and friction.
    const ROW_MM: f64 = 0.05;
    let mut preload = late;
    let mut rows = Vec::new();
    for index in -240..400 {
        rows.push((f64::from(index) * ROW_MM, late));
    }
    for (s, value) in rows.iter_mut().rev().filter(|(s, _)| *s < 0.0) {
        let most = slew_n_per_s * ROW_MM / speed(*s);
        preload += (early - preload).clamp(-most, most);
        *value = preload;
    }
    let mut rows: Vec<Row> = rows
        .into_iter()
        .map(|(s, preload_n)| Row { x_mm: slow_from + sign * s, speed_mm_s: speed(s), preload_n })
        .collect();
    rows.sort_by(|a, b| a.x_mm.total_cmp(&b.x_mm));
    Course::try_new(rows).unwrap()
}

fn constant(draw: &mut StdRng, _: f64, _: bool) -> Course {
    Course::constant(ratio(draw, 1.0, 100.0), ratio(draw, 15.0, 150.0))
}

/// The worst of so many crossings, and how many of them are beyond a bound.
fn worst(seed: u64, count: usize, course: fn(&mut StdRng, f64, bool) -> Course) -> (Errors, usize) {
    let mut draw = StdRng::seed_from_u64(seed);
    let (mut worst, mut beyond, mut done) = (Errors::default(), 0, 0);
    while done < count {
        let case = drawn(&mut draw, course);
        let Some(errors) = case.errors() else { continue };
        done += 1;
        if errors.over_bounds() > 1.0 {
            beyond += 1;
            eprintln!("{errors:?} {case:.80?}");
        }
        let far = |a: f64, b: f64| if a.abs() > b.abs() { a } else { b };
        worst = Errors {
            gap_mm: far(errors.gap_mm, worst.gap_mm),
            gap: if errors.gap_mm.abs() > 0.01 { far(errors.gap, worst.gap) } else { worst.gap },
            friction: far(errors.friction, worst.friction),
            force: far(errors.force, worst.force),
        };
    }
    (worst, beyond)
}

#[test]
fn a_crossing_at_constant_speed_is_the_rings() {
    let count = if testing::long() { 4000 } else { 60 };
    let (worst, beyond) = worst(1, count, constant);
    eprintln!("worst of {count}: {worst:?}");
    assert_eq!(beyond, 0, "{worst:?}");
}

#[test]
fn a_crossing_braked_late_is_the_rings() {
    let count = if testing::long() { 4000 } else { 60 };
    let (worst, beyond) = worst(2, count, late_braking);
    eprintln!("worst of {count}: {worst:?}");
    assert_eq!(beyond, 0, "{worst:?}");
}
