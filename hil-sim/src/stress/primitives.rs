//! Every fixed-point primitive against exact arithmetic: over all of its inputs where
//! they are at most 2^32, over corners and a lattice of pairs where they are more. The
//! bound asserted is the one in the primitive's docstring.

use interstage::numeric::{self, Table};
use interstage::rig::Rig;
use interstage::sense::arm::Arm;
use interstage::units::Q16;
use rayon::prelude::*;
use serde::Serialize;

/// LSB of [`Q16`].
const LSB: f64 = 1.0 / 65_536.0;

/// Bound of the table below: 1.5 LSB, and 64 intervals times 2^-32 of the steepest
/// interval's slope, 1.1e8 LSB.
const TABLE_BOUND: f64 = 3.2;

/// Bound of the quotient of numbers below 1.
const FRACTION_BOUND: f64 = 24.0;

/// Bound of the inverse root, LSB: 1e-5 of its least value, 2^29.
const INVERSE_BOUND: f64 = 5368.0;

/// Bound of its guess, LSB: 0.22 % of the same.
const GUESS_BOUND: f64 = 1_181_116.0;

/// Inputs of a chunk.
const CHUNK: u64 = 1 << 20;

/// A primitive and how far it is off.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Its name.
    pub name: &'static str,
    /// Inputs looked at.
    pub inputs: u64,
    /// Whether these are all.
    pub exhaustive: bool,
    /// Least and largest error, LSB of the result.
    pub least_lsb: f64,
    /// See `least_lsb`.
    pub most_lsb: f64,
    /// Bounds of the docstring, LSB.
    pub bound_lsb: (f64, f64),
    /// Input of the largest error, bits.
    pub worst_input: u64,
    /// Whether the bounds hold.
    pub holds: bool,
}

/// What is swept: error, LSB, by the input's bits.
struct Sweep {
    name: &'static str,
    from: u64,
    to: u64,
    bound: (f64, f64),
    /// Whether the inputs are all there are.
    whole: bool,
    error: Box<dyn Fn(u64) -> f64 + Sync>,
}

/// All primitives, looking at every `stride`-th input of each, from all on 1; `done` is
/// called with the share of the work that is done.
#[must_use]
pub fn run(stride: u64, done: &(dyn Fn(u64) + Sync)) -> Vec<Line> {
    sweeps().iter().map(|sweep| line(sweep, stride, done)).collect()
}

/// Inputs of all sweeps, for a bar.
#[must_use]
pub fn inputs() -> u64 {
    sweeps().iter().map(|sweep| sweep.to - sweep.from).sum()
}

fn line(sweep: &Sweep, stride: u64, done: &(dyn Fn(u64) + Sync)) -> Line {
    let chunks = (sweep.to - sweep.from).div_ceil(CHUNK);
    let error = &sweep.error;
    let (least, most, worst, inputs) = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let from = sweep.from + chunk * CHUNK;
            let to = (from + CHUNK).min(sweep.to);
            // The lattice goes on across the chunks; both ends of a chunk are met.
            let first = from + (stride - (from % stride)) % stride;
            let mut found = (f64::INFINITY, f64::NEG_INFINITY, from, 0u64);
            let all = (first..to).step_by(stride as usize).chain([from, to - 1]);
            for input in all {
                let off = error(input);
                let largest = found.0.abs().max(found.1.abs());
                // A NaN is the worst there is.
                if found.3 == 0 || off.abs() > largest || off.is_nan() {
                    found.2 = input;
                }
                found.0 = lower(found.0, off);
                found.1 = -lower(-found.1, -off);
                found.3 += 1;
            }
            done(to - from);
            found
        })
        .reduce(
            || (f64::INFINITY, f64::NEG_INFINITY, sweep.from, 0),
            |a, b| {
                let size = |f: &(f64, f64, u64, u64)| {
                    if f.3 == 0 { f64::NEG_INFINITY } else { f.0.abs().max(f.1.abs()) }
                };
                let worst = if size(&a) >= size(&b) { a.2 } else { b.2 };
                (lower(a.0, b.0), -lower(-a.1, -b.1), worst, a.3 + b.3)
            },
        );
    Line {
        name: sweep.name,
        inputs,
        exhaustive: sweep.whole && stride == 1,
        least_lsb: least,
        most_lsb: most,
        bound_lsb: sweep.bound,
        worst_input: worst,
        // Written so that a NaN fails.
        holds: least >= sweep.bound.0 && most <= sweep.bound.1,
    }
}

/// The lower of two numbers; a NaN if there is one.
fn lower(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

fn q(bits: u64) -> Q16 {
    Q16::from_bits(bits as u32 as i32)
}

fn bits(value: Q16) -> f64 {
    f64::from(value.to_bits())
}

/// A number that a [`Q16`] cannot hold saturates.
fn saturated(exact: f64) -> f64 {
    exact.clamp(f64::from(i32::MIN), f64::from(i32::MAX))
}

fn sweeps() -> Vec<Sweep> {
    let all = 1u64 << 32;
    let whole = |name, bound, error: Box<dyn Fn(u64) -> f64 + Sync>| Sweep {
        name,
        from: 0,
        to: all,
        bound,
        whole: true,
        error,
    };
    vec![
        whole("sqrt", (-0.51, 0.51), Box::new(sqrt)),
        Sweep {
            name: "reciprocal_of_normalised",
            from: 1 << 31,
            to: all,
            bound: (-16.0, 0.0),
            whole: true,
            error: Box::new(|n| {
                let got = numeric::reciprocal_of_normalised(n as u32);
                // 2^63 / n in integers, the rest as a fraction.
                let (exact, rest) = ((1u64 << 63) / n, (1u64 << 63) % n);
                (i64::from(got) - exact as i64) as f64 - rest as f64 / n as f64
            }),
        },
        whole(
            "sqrt_fraction",
            (-1.5, 0.0),
            Box::new(|x| {
                f64::from(numeric::sqrt_fraction(x as u32)) - 65_536.0 * (x as f64).sqrt()
            }),
        ),
        whole("table", (-TABLE_BOUND, TABLE_BOUND), table()),
        Sweep {
            name: "inverse_sqrt_normalised",
            from: 1,
            to: all,
            bound: (-INVERSE_BOUND, INVERSE_BOUND),
            whole: true,
            error: Box::new(|x| {
                let (shift, got) = numeric::inverse_sqrt_normalised(x as u32);
                let m = (x << shift) as f64 / 4_294_967_296.0;
                // Relative, as the bound is.
                f64::from(got) * m.sqrt() - 536_870_912.0
            }),
        },
        Sweep {
            name: "inverse_sqrt_guess",
            from: 1,
            to: all,
            bound: (-GUESS_BOUND, GUESS_BOUND),
            whole: true,
            error: Box::new(|x| {
                let (shift, got) = numeric::inverse_sqrt_guess(x as u32);
                let m = (x << shift) as f64 / 4_294_967_296.0;
                f64::from(got) * m.sqrt() - 536_870_912.0
            }),
        },
        whole(
            "sin_cos",
            (-7.0, 7.0),
            Box::new(|angle| {
                let (sine, cosine) = numeric::sin_cos(angle as u32);
                let exact = (angle as f64 / 4_294_967_296.0 * std::f64::consts::TAU).sin_cos();
                let scale = f64::from(1 << 30);
                let off = (f64::from(sine) - scale * exact.0, f64::from(cosine) - scale * exact.1);
                if off.0.abs() > off.1.abs() { off.0 } else { off.1 }
            }),
        ),
        arm(
            "arm radius",
            |arm, angle| arm.stance(angle).0,
            |codes, rig: &Rig| {
                let angle = codes * std::f64::consts::TAU / 16_384.0;
                rig.rig.arm_pivot_radius_mm + rig.rig.arm_length_mm * angle.sin()
            },
        ),
        arm(
            "arm tangent",
            |arm, angle| arm.stance(angle).1,
            |codes, _: &Rig| (codes * std::f64::consts::TAU / 16_384.0).tan(),
        ),
        pairs("divide", (-0.5, 0.5), divide),
        // The error of a quotient grows with its numerator: the largest for every
        // denominator; a shift brings the others there.
        Sweep {
            name: "fraction, largest",
            from: 1 << 31,
            to: all,
            bound: (-FRACTION_BOUND, 0.0),
            whole: true,
            error: Box::new(|b| fraction(b as u32 - 1, b as u32)),
        },
        pairs("fraction", (-FRACTION_BOUND, 0.0), fraction),
    ]
}

fn sqrt(input: u64) -> f64 {
    let x = input as u32 as i32;
    let got = bits(numeric::sqrt(q(input)));
    if x <= 0 { got } else { got - (f64::from(x) * 65_536.0).sqrt() }
}

fn fraction(a: u32, b: u32) -> f64 {
    let got = numeric::fraction(a, b);
    if a >= b {
        return f64::from(got) - f64::from(u32::MAX);
    }
    let (exact, rest) = ((u64::from(a) << 32) / u64::from(b), (u64::from(a) << 32) % u64::from(b));
    (i64::from(got) - exact as i64) as f64 - rest as f64 / f64::from(b)
}

fn divide(a: u32, b: u32) -> f64 {
    let (a, b) = (a as i32, b as i32);
    let got = i64::from(numeric::divide(Q16::from_bits(a), Q16::from_bits(b)).to_bits());
    if b == 0 {
        return (got - i64::from(a.signum()).max(-1) * i64::from(i32::MAX) + i64::from(a < 0))
            as f64;
    }
    let (n, b) = (i64::from(a) << 16, i64::from(b));
    let (exact, rest) = (n / b, n % b);
    if exact >= i64::from(i32::MAX) || exact <= i64::from(i32::MIN) {
        return got as f64 - saturated(exact as f64);
    }
    (got - exact) as f64 - rest as f64 / b as f64
}

/// Pairs of corners, of numbers around powers of two, and of a lattice.
fn pairs(
    name: &'static str,
    bound: (f64, f64),
    error: impl Fn(u32, u32) -> f64 + Sync + 'static,
) -> Sweep {
    let mut corners: Vec<u32> = vec![0, 1, 2, 3, u32::MAX, u32::MAX - 1, 1 << 31];
    for power in 2..32 {
        let p = 1u32 << power;
        corners.extend([p - 1, p, p + 1, p.wrapping_neg(), p | p >> 1, p.wrapping_mul(3)]);
    }
    let structured = (corners.len() * corners.len()) as u64;
    let lattice = 1u64 << 26;
    Sweep {
        name,
        from: 0,
        to: structured + lattice,
        bound,
        whole: false,
        error: Box::new(move |input| {
            if input < structured {
                let (a, b) = (input as usize / corners.len(), input as usize % corners.len());
                return error(corners[a], corners[b]);
            }
            // Weyl sequences, shifted so that all magnitudes have their share.
            let a = input.wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let b = input.wrapping_mul(0xD1B5_4A32_D192_ED03);
            let shift = |word: u64| ((word >> 32) as u32 as i32 >> (word & 31)) as u32;
            error(shift(a), shift(b))
        }),
    }
}

/// The interpolation's arithmetic, on a table over all arguments: against the same
/// splines in f64.
fn table() -> Box<dyn Fn(u64) -> f64 + Sync> {
    const POINTS: usize = 65;
    let (lo, hi) = (f64::from(i32::MIN) * LSB, f64::from(i32::MAX) * LSB);
    let pitch = (hi - lo) / (POINTS - 1) as f64;
    // Wild, but not beyond what a table takes.
    let value = |index: usize| {
        let x = index as f64;
        (900.0 * (1.7 * x).sin() + 40.0 * x) * 65_536.0
    };
    let samples: [i32; POINTS] = std::array::from_fn(|index| value(index) as i32);
    let built = Table::<POINTS>::build(lo, hi, |x| {
        let index = ((x - lo) / pitch).round() as usize;
        f64::from(samples[index.min(POINTS - 1)]) * LSB
    })
    .expect("the values above bend little enough");
    let extended: Vec<f64> = {
        let s: Vec<f64> = samples.iter().map(|&s| f64::from(s)).collect();
        let n = s.len();
        let first = 3.0 * (s[0] - s[1]) + s[2];
        let last = 3.0 * (s[n - 1] - s[n - 2]) + s[n - 3];
        std::iter::once(first).chain(s.iter().copied()).chain([last]).collect()
    };
    Box::new(move |input| {
        let x = input as u32 as i32;
        let position = (i64::from(x) - i64::from(i32::MIN)) as f64 / (f64::from(u32::MAX))
            * (POINTS - 1) as f64;
        let index = (position as usize).min(POINTS - 2);
        let t = position - index as f64;
        let [p0, p1, p2, p3] = [0, 1, 2, 3].map(|k| extended[index + k]);
        let cubic = (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) + t * (3.0 * (p1 - p2) + p3 - p0);
        let exact = p1 + 0.5 * t * ((p2 - p0) + t * cubic);
        bits(built.eval(q(input))) - exact
    })
}

/// The arm over all angles of its reach, against the geometry: within 2e-5 mm and 2e-5.
fn arm(
    name: &'static str,
    eval: impl Fn(&Arm, Q16) -> Q16 + Sync + 'static,
    exact: impl Fn(f64, &Rig) -> f64 + Sync + 'static,
) -> Sweep {
    let rig = Rig::prototype();
    let arm = Arm::try_build(&rig).expect("the prototype can be built");
    let (lo, hi) = arm.reach();
    Sweep {
        name,
        from: u64::from(lo.to_bits() as u32),
        to: u64::from(hi.to_bits() as u32) + 1,
        bound: (-2e-5 / LSB, 2e-5 / LSB),
        whole: true,
        error: Box::new(move |input| {
            let codes = bits(q(input)) * LSB;
            bits(eval(&arm, q(input))) - exact(codes, &rig) / LSB
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_of_the_docstrings_hold_on_a_lattice() {
        for line in run(40_009, &|_| {}) {
            assert!(line.holds && line.inputs > 1500, "{line:?}");
        }
    }

    #[test]
    fn a_primitive_that_is_off_is_told() {
        let error = Box::new(|x: u64| if x == 70_000 { -3.0 } else { 0.25 });
        let sweep =
            Sweep { name: "off", from: 0, to: 2 << 20, bound: (-0.5, 0.5), whole: true, error };
        let found = line(&sweep, 1, &|_| {});
        assert!(!found.holds && found.exhaustive);
        assert_eq!((found.worst_input, found.least_lsb, found.most_lsb), (70_000, -3.0, 0.25));
        let nan = Sweep { error: Box::new(|_| f64::NAN), ..sweep };
        assert!(!line(&nan, 1000, &|_| {}).holds);
    }
}
