//! Cases of the stress: all corners of the ranges, and a low-discrepancy sequence between them.
//!
//! Every case is possible: preload, load and spring press no more than the tread carries under
//! the corner of its step. Impossible cases are drawn separately: they must be refused.

use interstage::rig::Rig;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::plant::draw::ELEMENTS;
use crate::plant::limits::{DEEPEST, DIGS, HIGHEST, SINKS, TOWERS, leans, takes};
use crate::plant::ring::RingParameters;

/// Radius and width of the wheel, mm.
pub(super) const RADIUS_MM: f64 = 25.0;
const WIDTH_MM: f64 = 28.0;

/// The value at this part of a range that is filled evenly.
fn even((low, high): (f64, f64), part: f64) -> f64 {
    low + part * (high - low)
}

/// The value at this part of a range that is filled evenly in the logarithm.
fn decades((low, high): (f64, f64), part: f64) -> f64 {
    if part >= 1.0 { high } else { low * (high / low).powf(part) }
}

/// Parameters whose ends are all combined as corners.
const ENDS: usize = 8;

const DIMENSIONS: usize = 13;

/// How the wheel is driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Course {
    /// At constant speed outwards.
    Forward,
    /// At constant speed back.
    Back,
    /// Outwards, then back over the same distance.
    Reversing,
    /// To and fro, four times.
    Rocking,
    /// Outwards, then the bridge is switched off.
    Coasting,
}

impl Course {
    pub(crate) const ALL: [Self; 5] =
        [Self::Forward, Self::Back, Self::Reversing, Self::Rocking, Self::Coasting];

    /// Speed in parts of the full one at this part of the run.
    pub(crate) fn speed(self, part: f64) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Back => -1.0,
            Self::Reversing if part < 0.5 => 1.0,
            Self::Reversing => -1.0,
            Self::Rocking if (4.0 * part).fract() < 0.5 => 1.0,
            Self::Rocking => -1.0,
            Self::Coasting if part < 0.5 => 1.0,
            Self::Coasting => 0.0,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StressCase {
    pub index: usize,
    /// Relaxed stiffness of the contact, Pa/m.
    pub k_inf_pa_per_m: f64,
    pub stiffening: f64,
    /// Relaxation time, s.
    pub tau_s: f64,
    /// Step of time, s.
    pub dt_s: f64,
    /// Moved mass over reflected mass.
    pub mass_ratio: f64,
    pub mass_kg: f64,
    pub speed_mm_s: f64,
    /// Height of the step, mm.
    pub step_mm: f64,
    pub mu: f64,
    pub preload_n: f64,
    /// Axial load, N.
    pub load_n: f64,
    /// Sense of the arm's coupling.
    pub coupling: f64,
    pub course: Course,
    /// Rate of the preload spring, N/mm.
    pub spring_n_per_mm: f64,
    /// Where the run begins, parts of the distance over the step before the touch.
    pub phase: f64,
}

impl StressCase {
    /// Wheel and rubber.
    pub(super) fn ring(&self) -> RingParameters {
        let k_inf = self.k_inf_pa_per_m * 1e-9;
        let (k_0, tau_s) = (k_inf * self.stiffening, self.tau_s);
        RingParameters { k_inf, k_0, tau_s, ..RingParameters::of(&Rig::prototype(), ELEMENTS) }
    }

    /// Speed of the unloaded motor, mm/s.
    pub(super) fn no_load_mm_s(&self) -> f64 {
        (1.25 * self.speed_mm_s).max(1.0)
    }

    /// Axial distance between the step and a wheel that just touches its corner, mm.
    pub(super) fn reach_mm(&self) -> f64 {
        let below = RADIUS_MM - self.step_mm;
        (RADIUS_MM * RADIUS_MM - below * below).max(0.0).sqrt()
    }
}

/// Rate of the preload spring where the tread is stiff enough for it, N/mm.
const SPRING: f64 = 1.2;

/// Parts of what a tread carries that preload, spring and load may press it with at most.
const PARTS: (f64, f64, f64) = (0.4, 0.3, 0.2);

/// The first `count` cases of the stress with this seed: every fourth corner of the
/// eight ranges for small counts, all corners from a thousand cases on, the rest from
/// the sequence.
pub(super) fn draw(count: usize, seed: u64) -> Vec<StressCase> {
    let every = if count < 1000 { 4 } else { 1 };
    let corners = (0..1 << ENDS).step_by(every).map(corner);
    let point = sequence(seed);
    let inside = (0..).map(|n| of(&point(n)));
    let all = corners.chain(inside).take(count).enumerate();
    all.map(|(index, case)| StressCase { index, ..case }).collect()
}

/// Largest force on a corner of the step with this tread, N: relaxed, `F = k L d^2`.
fn carries(k_inf_pa_per_m: f64, step_mm: f64) -> f64 {
    1e-9 * k_inf_pa_per_m * WIDTH_MM * deepest(step_mm).powi(2)
}

/// Deepest that a corner of the step may come into the tread, mm.
fn deepest(step_mm: f64) -> f64 {
    (DEEPEST * RADIUS_MM).min(HIGHEST * RADIUS_MM - step_mm)
}

/// Impossible cases, each with the name of its refusal: the first `count`, pressed with more
/// than the tread carries, or braked with more momentum than it takes.
pub(super) fn beyond(count: usize, seed: u64) -> Vec<(StressCase, &'static str)> {
    let changed = |case: StressCase| {
        if case.index.is_multiple_of(3) {
            let mu = 1.05 / leans(RADIUS_MM, case.step_mm.max(2.0));
            let case = StressCase { mu, step_mm: case.step_mm.max(2.0), load_n: 0.0, ..case };
            let most = takes(&case.ring(), case.step_mm);
            let mass_kg = 2.1e3 * most / case.no_load_mm_s().powi(2);
            return (StressCase { mass_kg, ..case }, DIGS);
        }
        let most = carries(case.k_inf_pa_per_m, case.step_mm);
        // Where a deep corner is refused before a high one.
        let deep = (DEEPEST * RADIUS_MM / deepest(case.step_mm)).powi(2);
        let sinks = case.phase < 0.5;
        let (name, force_n) = if sinks {
            (SINKS, 1.05 * deep * most)
        } else if deep > 1.1 {
            (TOWERS, (1.0 + 0.5 * (deep - 1.0)) * most)
        } else {
            (SINKS, 2.0 * most)
        };
        let case = StressCase { preload_n: force_n, load_n: 0.0, spring_n_per_mm: 1e-6, ..case };
        (case, name)
    };
    draw(count, seed).into_iter().map(changed).collect()
}

fn corner(bits: usize) -> StressCase {
    // The dimensions that have no ends cycle through their middle values.
    let cycle = |of: usize| ((bits * 7 + of * 3) % 10) as f64 / 10.0 + 0.05;
    let mut parts: [f64; DIMENSIONS] = std::array::from_fn(cycle);
    for (dimension, part) in parts.iter_mut().enumerate().take(ENDS) {
        *part = f64::from(u8::from(bits >> dimension & 1 == 1));
    }
    of(&parts)
}

/// The case at these parts of the ranges.
fn of(parts: &[f64; DIMENSIONS]) -> StressCase {
    let [k, s, tau, dt, ratio, v, h, mu, preload, load, arm, course, phase] = *parts;
    let mass_ratio = decades((1e-3, 1e3), ratio);
    let (stiffness, step_mm) = (decades((1e6, 1e12), k), even((0.0, 20.0), h));
    let carried_n = carries(stiffness, step_mm);
    let mut case = StressCase {
        index: 0,
        k_inf_pa_per_m: stiffness,
        // A fifth of the treads is without damping.
        stiffening: decades((1.0, 100.0), (1.25 * s - 0.25).max(0.0)),
        tau_s: decades((1e-6, 1e3), tau),
        dt_s: decades((1e-6, 20e-3), dt),
        mass_ratio,
        // Both masses move away from 40 kg and 1 kg by half of the ratio's decades.
        mass_kg: 6.0 * mass_ratio.sqrt(),
        // Cubed, so that slow runs have their share.
        speed_mm_s: even((0.0, 2000.0), v * v * v),
        step_mm,
        mu: even((0.0, 3.0), mu),
        preload_n: decades((5.0, 150.0), preload).min(PARTS.0 * carried_n),
        load_n: even((0.0, 60.0), load * load).min(PARTS.2 * carried_n),
        coupling: [1.0, 1.0, 0.0, 0.0, 0.0, -1.0][((arm * 6.0) as usize).min(5)],
        course: Course::ALL[((course * 5.0) as usize).min(4)],
        spring_n_per_mm: SPRING.min(PARTS.1 * carried_n / step_mm.max(1.0)),
        phase,
    };
    // A braked wheel with more momentum than its tread takes digs itself in, unless it slides.
    let top = case.no_load_mm_s();
    if 0.5e-3 * case.mass_kg * top * top > takes(&case.ring(), step_mm) {
        let pressed_n = PARTS.0 + PARTS.1 + 1.2 * PARTS.2;
        let depth_mm = deepest(step_mm) * pressed_n.sqrt();
        case.mu = case.mu.min(0.95 / leans(RADIUS_MM, step_mm + depth_mm));
    }
    case
}

/// The additive recurrence with the powers of the generalised golden ratio, from an
/// offset drawn from the seed.
///
/// Source: Roberts, The unreasonable effectiveness of quasirandom sequences, 2018.
fn sequence(seed: u64) -> impl Fn(u64) -> [f64; DIMENSIONS] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // The real root of x^(d+1) = x + 1.
    let mut root = 1.0f64;
    for _ in 0..64 {
        root = (1.0 + root).powf(1.0 / (DIMENSIONS as f64 + 1.0));
    }
    let offset: [f64; DIMENSIONS] = std::array::from_fn(|_| random.random());
    let step: [f64; DIMENSIONS] = std::array::from_fn(|d| root.powi(-(d as i32) - 1));
    move |n| std::array::from_fn(|d| (offset[d] + n as f64 * step[d]).fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_range_is_reached_from_end_to_end() {
        let cases = draw(4000, 1);
        type Pick = fn(&StressCase) -> f64;
        let ranges: [(Pick, f64, f64); 8] = [
            (|c| c.k_inf_pa_per_m, 1e6, 1e12),
            (|c| c.stiffening, 1.0, 100.0),
            (|c| c.tau_s, 1e-6, 1e3),
            (|c| c.dt_s, 1e-6, 20e-3),
            (|c| c.mass_ratio, 1e-3, 1e3),
            (|c| c.speed_mm_s, 0.0, 2000.0),
            (|c| c.step_mm, 0.0, 20.0),
            (|c| c.mu, 0.0, 3.0),
        ];
        for (index, (pick, low, high)) in ranges.into_iter().enumerate() {
            let values = || cases.iter().map(pick);
            assert_eq!(values().fold(f64::INFINITY, f64::min), low, "{index}");
            assert_eq!(values().fold(0.0, f64::max), high, "{index}");
            let tenth = low + 0.1 * (high - low);
            assert!(values().filter(|&v| v > low && v < tenth).count() > 100, "{index}");
        }
        for course in Course::ALL {
            assert!(cases.iter().filter(|case| case.course == course).count() > 400);
        }
        assert!(cases.iter().filter(|case| case.stiffening == 1.0).count() > 500);
    }

    #[test]
    fn a_seed_is_a_set_of_cases() {
        assert_eq!(draw(500, 3), draw(500, 3));
        assert_ne!(draw(500, 3)[400], draw(500, 4)[400]);
        assert_eq!(draw(500, 3)[..64], draw(64, 9)[..]);
    }
}
