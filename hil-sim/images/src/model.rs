//! The reduced model in floating point, and calls of the shipping one: gap of a force, and
//! force of a gap.
//!
//! The shipping model (`interstage::model::reduced`) takes one step from a tabulated guess.
//! [`FloatModel`] solves the same equations by Newton's method to the last bit or so of its
//! number. Nothing ships from here.

use interstage::model::effective_stiffness::{self, FAST_DEGREE, Kind, RUN_DEGREE, RUN_END};
use interstage::model::formula::{Formula, LEAST_RUN};
use interstage::model::reduced::{self, ReducedModel};
use interstage::rig::Rig;
use interstage::units::Direction;
use interstage::units::Q16;

use crate::number::Number;
use crate::tick::Preset;

/// The rig whose cycles are measured.
pub const PRESET: Preset = Preset::Prototype;

/// One in Q15.16.
const ONE: f64 = 65_536.0;

/// A variant of the model: its name and the image's functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Name of the number format.
    pub name: &'static str,
    /// Symbol of gap from speed and force.
    pub forward: &'static str,
    /// Symbol of force from speed and gap.
    pub inverse: &'static str,
}

/// Every variant, the shipping one first.
pub const VARIANTS: [Variant; 3] = [
    Variant { name: "fixed", forward: "fixed_forward", inverse: "fixed_inverse" },
    Variant { name: "f32", forward: "f32_forward", inverse: "f32_inverse" },
    Variant { name: "f64", forward: "f64_forward", inverse: "f64_inverse" },
];

/// Arguments of a call.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Given {
    /// 0 deploys, 1 retracts.
    pub direction: u32,
    /// Speed at lift-off, mm/s, bits of Q15.16.
    pub speed: i32,
    /// Radial force, N, forwards; gap, mm, back; bits of Q15.16.
    pub wanted: i32,
}

impl Given {
    /// The words as memory holds them.
    pub const fn words(&self) -> [u32; 3] {
        [self.direction, self.speed as u32, self.wanted as u32]
    }

    fn direction(&self) -> Direction {
        if self.direction == 0 { Direction::Deploy } else { Direction::Retract }
    }

    fn point(&self) -> reduced::Point {
        reduced::Point::nominal(self.direction(), Q16::from_bits(self.speed))
    }
}

/// Gap by the shipping model, bits of Q15.16, mm.
#[inline(always)]
pub fn fixed_forward(model: &ReducedModel, given: &Given) -> i32 {
    model.gap(&given.point(), Q16::from_bits(given.wanted)).to_bits()
}

/// Force by the shipping model, bits of Q15.16, N.
#[inline(always)]
pub fn fixed_inverse(model: &ReducedModel, given: &Given) -> i32 {
    model.force(&given.point(), Q16::from_bits(given.wanted)).to_bits()
}

/// A working point with the exact answers, both by [`Formula`] in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Speed and force.
    pub forward: Given,
    pub gap_mm: f64,
    /// Speed and gap.
    pub inverse: Given,
    pub force_n: f64,
}

/// Speeds, mm/s, and forces, N, of the model's domain.
const SPEEDS_MM_S: (f64, f64) = (1.0, 100.0);
const FORCES_N: (f64, f64) = (15.0, 150.0);
/// Points on each axis.
const GRID: u32 = 8;
/// Friction above which no rubber lifts the load.
const MOST_UTILISATION: f64 = 1.7;

/// Points over speed, force and direction in equal ratios, without those beyond an end of
/// the model or of what friction lifts.
pub fn points(rig: &Rig) -> impl Iterator<Item = Point> {
    let formula = Formula::new(rig);
    let load_n = load_n(rig);
    (0..2 * GRID * GRID).filter_map(move |index| point(&formula, load_n, index))
}

fn load_n(rig: &Rig) -> f64 {
    rig.plant.top_load_n * rig.plant.top_load_share
}

fn point(formula: &Formula, load_n: f64, index: u32) -> Option<Point> {
    let bits = |value: f64| (value * ONE + 0.5) as i32;
    let between = |(low, high): (f64, f64), at: u32| {
        low * libm::pow(high / low, f64::from(at) / f64::from(GRID - 1))
    };
    let forward = Given {
        direction: index / (GRID * GRID),
        speed: bits(between(SPEEDS_MM_S, index / GRID % GRID)),
        wanted: bits(between(FORCES_N, index % GRID)),
    };
    let value = |bits: i32| f64::from(bits) / ONE;
    let (direction, speed) = (forward.direction(), value(forward.speed));
    let gap_mm = formula.gap_mm(direction, speed, value(forward.wanted), Some(load_n));
    let run = formula.run_mm(gap_mm);
    let longest = formula.largest_run_mm(Kind { direction, driven: true });
    let inside = run > 1.01 * LEAST_RUN * formula.radius_mm && run < 0.995 * longest;
    let grips = formula.utilisation(direction, speed, gap_mm, load_n) <= MOST_UTILISATION;
    if !(inside && grips) {
        return None;
    }
    let inverse = Given { wanted: bits(gap_mm), ..forward };
    let force_n = formula.force_n(direction, speed, value(inverse.wanted), Some(load_n));
    Some(Point { forward, gap_mm, inverse, force_n })
}

/// Terms of a Chebyshev series in the run.
const TERMS: usize = RUN_DEGREE + 1;
/// Most steps of Newton's method; four or five are needed.
const STEPS: usize = 12;

/// A Chebyshev series over -1 to 1.
type Series<N> = [N; TERMS];

/// The model of one driven rig in floating point.
///
/// Equation: `P = k(x, r) F(r) r^2 + T s(r)` with run r, relaxed force `F r^2` and slope s of
/// the contact as Chebyshev series in the run, and `k = 1 + (stiffening - 1) x E(x, r)` with
/// the same polynomial E as the shipping model. Error of the series: 1e-6 relative.
#[derive(Clone, Copy, Debug)]
pub struct FloatModel<N> {
    radius_mm: N,
    free_run_mm: N,
    longest_mm: N,
    least_mm: N,
    load_n: N,
    /// Relaxed force over the run squared, N/mm^2, and slope of the contact.
    force: Series<N>,
    slope: Series<N>,
    stiffening: N,
    directions: [FloatDirection<N>; 2],
}

/// What depends on the direction.
#[derive(Clone, Copy, Debug)]
struct FloatDirection<N> {
    half_speed_mm_s: N,
    /// E by degree in x and in the run.
    felt: [Series<N>; FAST_DEGREE + 1],
}

impl<N: Number> FloatModel<N> {
    /// The model of a rig.
    pub fn of(rig: &Rig) -> Self {
        let formula = Formula::new(rig);
        let kind = |direction| Kind { direction, driven: true };
        let longest_mm = formula.largest_run_mm(kind(Direction::Deploy));
        let least_mm = LEAST_RUN * formula.radius_mm;
        let at = |t: f64| least_mm + 0.5 * (t + 1.0) * (longest_mm - least_mm);
        let force = |t: f64| {
            let gap = formula.gap_after_mm(at(t));
            formula.relaxed_force_n(kind(Direction::Deploy), gap) / (at(t) * at(t))
        };
        let slope = |t: f64| formula.contact(formula.gap_after_mm(at(t))).slope();
        Self {
            radius_mm: N::of(formula.radius_mm),
            free_run_mm: N::of(formula.free_run_mm()),
            longest_mm: N::of(longest_mm),
            least_mm: N::of(least_mm),
            load_n: N::of(load_n(rig)),
            force: interpolated(force).map(N::of),
            slope: interpolated(slope).map(N::of),
            stiffening: N::of(formula.stiffening),
            directions: [Direction::Deploy, Direction::Retract].map(|direction| FloatDirection {
                half_speed_mm_s: N::of(formula.half_speed_mm_s(kind(direction))),
                felt: formula.fold(kind(direction), load_n(rig)).map(|row| row.map(N::of)),
            }),
        }
    }

    /// Gap at this speed and force, bits of Q15.16, mm.
    #[inline(always)]
    pub fn forward(&self, given: &Given) -> i32 {
        self.gap_mm(given).output()
    }

    /// Radial force that gives this gap at this speed, bits of Q15.16, N.
    #[inline(always)]
    pub fn inverse(&self, given: &Given) -> i32 {
        self.radial_n(given).output()
    }

    /// Gap at this speed and force, mm; at the ends of the model the gap there.
    #[inline(always)]
    pub fn gap_mm(&self, given: &Given) -> N {
        let (series, fast) = self.stiffening_at(given);
        let wanted = N::input(given.wanted);
        let mut run = N::of(0.5) * self.longest_mm;
        for _ in 0..STEPS {
            let (force, by_run) = self.force_n(&series, fast, run);
            let step = (wanted - force) / by_run;
            run = limited(run + step, self.least_mm, self.longest_mm);
            if step * step < N::of(1e-10) {
                break;
            }
        }
        let distance = self.free_run_mm - run;
        let square = distance * distance;
        let reach = (square + self.radius_mm * self.radius_mm).sqrt();
        square / (reach + self.radius_mm)
    }

    /// Radial force that gives this gap at this speed, N.
    #[inline(always)]
    pub fn radial_n(&self, given: &Given) -> N {
        let (series, fast) = self.stiffening_at(given);
        let gap = N::input(given.wanted);
        let distance = (gap * (gap + self.radius_mm + self.radius_mm)).sqrt();
        let run = limited(self.free_run_mm - distance, self.least_mm, self.longest_mm);
        self.force_n(&series, fast, run).0
    }

    /// E as a series in the run at this speed, and x times the stiffening less one.
    #[inline(always)]
    fn stiffening_at(&self, given: &Given) -> (Series<N>, N) {
        let of = &self.directions[(given.direction & 1) as usize];
        let speed = N::input(given.speed);
        let x = speed / (speed + of.half_speed_mm_s);
        let t = x + x - N::of(1.0);
        let mut series = of.felt[0];
        let (mut before, mut now) = (N::of(1.0), t);
        for row in &of.felt[1..] {
            for (sum, term) in series.iter_mut().zip(row) {
                *sum = *sum + now * *term;
            }
            (before, now) = (now, (t + t) * now - before);
        }
        (series, x * (self.stiffening - N::of(1.0)))
    }

    /// Radial force after this run, N, and its derivative, N/mm.
    #[inline(always)]
    fn force_n(&self, felt: &Series<N>, fast: N, run: N) -> (N, N) {
        let (one, two) = (N::of(1.0), N::of(2.0));
        let per_mm = two / (self.longest_mm - self.least_mm);
        let t = (run - self.least_mm) * per_mm - one;
        let (force, force_rise) = value_and_slope(&self.force, t);
        let (slope, slope_rise) = value_and_slope(&self.slope, t);
        let felt_per_mm = two / (N::of(RUN_END) * self.radius_mm);
        let (felt, felt_rise) = value_and_slope(felt, run * felt_per_mm - one);
        let stiffness = one + fast * felt;
        let relaxed = force * run * run;
        let relaxed_rise = force_rise * per_mm * run * run + two * force * run;
        let rise = stiffness * relaxed_rise + fast * felt_rise * felt_per_mm * relaxed;
        (stiffness * relaxed + self.load_n * slope, rise + self.load_n * slope_rise * per_mm)
    }
}

#[inline(always)]
fn limited<N: Number>(value: N, low: N, high: N) -> N {
    let above = if value < low { low } else { value };
    if above > high { high } else { above }
}

/// Value of a Chebyshev series and its derivative, by the recurrences of `T_n` and `T_n'`.
#[inline(always)]
fn value_and_slope<N: Number>(series: &Series<N>, t: N) -> (N, N) {
    let twice = t + t;
    let (mut before, mut now) = (N::of(1.0), t);
    let (mut slope_before, mut slope_now) = (N::of(0.0), N::of(1.0));
    let (mut value, mut slope) = (series[0], N::of(0.0));
    for &term in &series[1..] {
        value = value + term * now;
        slope = slope + term * slope_now;
        let next = twice * now - before;
        let slope_next = now + now + twice * slope_now - slope_before;
        (before, now) = (now, next);
        (slope_before, slope_now) = (slope_now, slope_next);
    }
    (value, slope)
}

/// Coefficients of the series that meets `of` at Chebyshev's nodes.
fn interpolated(of: impl Fn(f64) -> f64) -> Series<f64> {
    let count = TERMS as f64;
    let mut series = [0.0; TERMS];
    for node in 0..TERMS {
        let t = libm::cos(core::f64::consts::PI * (node as f64 + 0.5) / count);
        let value = of(t);
        for (index, polynomial) in
            effective_stiffness::chebyshev::<TERMS>(t).into_iter().enumerate()
        {
            let weight = if index == 0 { 1.0 } else { 2.0 };
            series[index] += weight / count * value * polynomial;
        }
    }
    series
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn the_words_lie_as_the_structure_does() {
        assert_eq!(size_of::<Given>(), size_of_val(&Given::default().words()));
        assert_eq!(core::mem::offset_of!(Given, wanted), 2 * 4);
    }

    #[test]
    fn every_variant_follows_the_formulas_both_ways() {
        for rig in [Rig::prototype(), Rig::fe()] {
            let fixed = ReducedModel::try_build(&rig).unwrap();
            let (single, double) = (FloatModel::<f32>::of(&rig), FloatModel::<f64>::of(&rig));
            let mut count = 0;
            for point in points(&rig) {
                let (there, back) = (&point.forward, &point.inverse);
                let gaps =
                    [fixed_forward(&fixed, there), single.forward(there), double.forward(there)];
                let forces =
                    [fixed_inverse(&fixed, back), single.inverse(back), double.inverse(back)];
                for (gap, force) in gaps.into_iter().zip(forces) {
                    let off = (f64::from(gap) / ONE - point.gap_mm) / point.gap_mm.max(0.1);
                    assert!(off.abs() < 1e-4, "{off} {point:?}");
                    let off = f64::from(force) / ONE / point.force_n - 1.0;
                    assert!(off.abs() < 1e-4, "{off} {point:?}");
                }
                count += 1;
            }
            assert!(count >= 80, "{count}");
        }
    }
}
