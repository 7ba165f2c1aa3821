//! The reduced model in five arithmetics on the same points: what each costs on the
//! board's core and on this host, and how far each is from the formulas.
//!
//! All evaluate the same polynomials and take the same one step from a guess in cells. The
//! shipping model's formats are chosen number by number; the others take what their
//! arithmetic gives (`interstage-arith`), each tuned: cells found by exponent and mantissa,
//! the format of the `fixed` crate with the least error, polynomials unrolled, micromath's
//! root brought to all bits.

#[cfg(feature = "board")]
mod cycles;
mod fit;
mod points;

use std::time::Duration;

use anyhow::{Context, Result};
use interstage::model::reduced::Scale;
use interstage::units::Direction;
use interstage_arith::{Double, Fixed, Given, Libm, Micro, Model, Number};
use interstage_images::arith::{FUNCTIONS, crossing, force};
use serde::Serialize;

use super::clock::{Effort, least};
use hil_sim::plant::balance::Axial;
use hil_sim::plant::crossing::{CrossingCase, cross};
use hil_sim::plant::precision::Setting;
use hil_sim::plant::ring::RingParameters;

pub use points::{Point, Scene, scenes};

/// Points that are compared with the ring too, in all.
const ON_THE_RING: usize = 60;

/// Gap below which errors are told relative to it, mm: a ten-thousandth of it is 10 nm, less
/// than the lengths of the controller resolve, and a hundredth of what its sensor does.
pub const LEAST_GAP_MM: f64 = 0.1;

/// Cost and error of one direction of the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Course {
    /// Largest error against the formulas solved to convergence, relative: to the force, or
    /// to the gap or [`LEAST_GAP_MM`], whichever is larger.
    pub max_rel_error: f64,
    /// The root of the mean square of that.
    pub rms_rel_error: f64,
    /// Textbook cycles of the dearest call; none without the emulated core.
    pub cycles: Option<u64>,
    /// Of the mean call.
    pub mean_cycles: Option<f64>,
    /// Time of a call on this host, ns, mean over the points.
    pub host_ns: f64,
}

/// The model in one arithmetic.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Variant {
    /// The arithmetic.
    pub name: &'static str,
    /// Everything of a crossing from speed and force; errors are those of the gap.
    #[serde(flatten)]
    pub forward: Course,
    /// Force from speed and gap.
    pub inverse: Course,
    /// Whether no other costs less, at worst, with less error.
    pub on_front: bool,
}

/// The comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Arithmetics {
    /// Points, and how many of those drawn lie beyond an end of the model or of friction.
    pub points: usize,
    /// See `points`.
    pub beyond: usize,
    /// The arithmetics, the shipping one first.
    #[serde(skip)]
    pub variants: Vec<Variant>,
    /// Error of the gap against the converged ring on some of the points.
    pub ring: AgainstRing,
    /// Why there are no cycles.
    pub cycles_left_out: Option<String>,
}

/// Error of the model itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AgainstRing {
    /// Crossings of the ring.
    pub crossings: usize,
    /// Largest relative error of the gap by the formulas.
    pub max_rel_error: f64,
    /// The root of the mean square of that.
    pub rms_rel_error: f64,
    /// Largest error, mm.
    pub max_error_mm: f64,
    /// The same with the shipping model for the formulas.
    pub shipping_max_rel_error: f64,
}

/// Measures all of it.
///
/// # Errors
/// If the model cannot be built, a crossing cannot be balanced, or the core answers
/// otherwise than the host.
pub fn measure(quick: bool, with_cycles: bool) -> Result<Arithmetics> {
    let scenes = scenes(if quick { 8 } else { 64 })?;
    let mut variants = vec![
        variant(
            FUNCTIONS[0].0,
            &scenes,
            |s, g| crossing(&s.shipping, Scale::NOMINAL, g).gap,
            |s, g| force(&s.shipping, Scale::NOMINAL, g),
        ),
        other::<Fixed>(FUNCTIONS[1].0, &scenes)?,
        other::<Micro>(FUNCTIONS[2].0, &scenes)?,
        other::<Libm>(FUNCTIONS[3].0, &scenes)?,
        other::<Double>(FUNCTIONS[4].0, &scenes)?,
    ];
    let mut cycles_left_out = Some("without the emulated board".to_owned());
    #[cfg(feature = "board")]
    if with_cycles {
        cycles::measure(&scenes, &mut variants)?;
        cycles_left_out = None;
    }
    #[cfg(not(feature = "board"))]
    if with_cycles {
        cycles_left_out = Some("this binary lacks the emulated board".to_owned());
    }
    front(&mut variants);
    Ok(Arithmetics {
        points: scenes.iter().map(|scene| scene.points.len()).sum(),
        beyond: scenes.iter().map(|scene| scene.beyond).sum(),
        variants,
        ring: against_ring(&scenes, if quick { 4 } else { ON_THE_RING })?,
        cycles_left_out,
    })
}

/// A variant by `interstage-arith`.
fn other<N: Number>(name: &'static str, scenes: &[Scene]) -> Result<Variant> {
    let of = |scene: &Scene| Model::<N>::of(&scene.flat).context("a coefficient is out of range");
    let models: Result<Vec<Model<N>>> = scenes.iter().map(of).collect();
    let models = models?;
    let both: Vec<(&Scene, &Model<N>)> = scenes.iter().zip(&models).collect();
    Ok(Variant {
        name,
        forward: course(&both, |p| (&p.forward, p.gap_mm), |m, g| m.1.crossing(g).gap),
        inverse: course(&both, |p| (&p.inverse, p.force_n), |m, g| m.1.force(g)),
        on_front: false,
    })
}

fn variant(
    name: &'static str,
    scenes: &[Scene],
    forward: impl Fn(&Scene, &Given) -> i32,
    inverse: impl Fn(&Scene, &Given) -> i32,
) -> Variant {
    let both: Vec<(&Scene, ())> = scenes.iter().map(|scene| (scene, ())).collect();
    Variant {
        name,
        forward: course(&both, |p| (&p.forward, p.gap_mm), |m, g| forward(m.0, g)),
        inverse: course(&both, |p| (&p.inverse, p.force_n), |m, g| inverse(m.0, g)),
        on_front: false,
    }
}

/// Errors and host time over all points of all scenes.
fn course<M>(
    scenes: &[(&Scene, M)],
    pick: impl Fn(&Point) -> (&Given, f64),
    call: impl Fn(&(&Scene, M), &Given) -> i32,
) -> Course {
    let mut errors = Vec::new();
    for both in scenes {
        for point in &both.0.points {
            let (given, exact) = pick(point);
            let error = f64::from(call(both, given)) / points::ONE - exact;
            errors.push((error / exact.max(LEAST_GAP_MM)).abs());
        }
    }
    // The answers are summed up, so that none can be left out.
    let all = |()| {
        let mut sum = 0_i64;
        for both in scenes {
            for point in &both.0.points {
                sum += i64::from(call(both, std::hint::black_box(pick(point).0)));
            }
        }
        sum
    };
    let effort = Effort { repeats: 25, within: Duration::from_millis(120) };
    let timed = least(effort, || (), all);
    let count = errors.len() as f64;
    Course {
        max_rel_error: errors.iter().copied().fold(0.0, f64::max),
        rms_rel_error: (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt(),
        cycles: None,
        mean_cycles: None,
        host_ns: 1e9 * timed.seconds / count,
    }
}

/// Marks the variants that no other beats in both cycles and error.
fn front(variants: &mut [Variant]) {
    let figures: Vec<(Option<u64>, f64)> =
        variants.iter().map(|v| (v.forward.cycles, v.forward.max_rel_error)).collect();
    for (variant, &(cycles, error)) in variants.iter_mut().zip(&figures) {
        let beaten = figures.iter().any(|&(other, off)| {
            let dearer = cycles.zip(other).is_some_and(|(own, other)| other < own);
            dearer && off <= error
        });
        variant.on_front = cycles.is_some() && !beaten;
    }
}

/// Formulas and shipping model against crossings of the ring.
fn against_ring(scenes: &[Scene], most: usize) -> Result<AgainstRing> {
    let per_scene = most.div_ceil(scenes.len());
    let mut sum = AgainstRing::default();
    let mut squares = 0.0;
    for scene in scenes {
        for point in scene.points.iter().take(per_scene) {
            let sign = if point.forward.direction == 0 { 1.0 } else { -1.0 };
            let mesh = Setting::usual().finer(3);
            let found = cross(&CrossingCase {
                ring: RingParameters::of(&scene.rig, mesh.elements),
                step_height_mm: scene.rig.rig.step_height_mm,
                speed_mm_s: sign * points::value(point.forward.speed),
                preload_n: points::value(point.forward.wanted),
                axial: Axial::Driven(scene.load_n),
                stride_mm: mesh.stride_mm,
            })?;
            let shipping =
                points::value(crossing(&scene.shipping, Scale::NOMINAL, &point.forward).gap);
            let error = (point.gap_mm / found.gap_mm - 1.0).abs();
            sum.crossings += 1;
            squares += error * error;
            sum.max_rel_error = sum.max_rel_error.max(error);
            sum.max_error_mm = sum.max_error_mm.max((point.gap_mm - found.gap_mm).abs());
            sum.shipping_max_rel_error =
                sum.shipping_max_rel_error.max((shipping / found.gap_mm - 1.0).abs());
        }
    }
    sum.rms_rel_error = (squares / sum.crossings as f64).sqrt();
    Ok(sum)
}

/// Way of a point.
fn direction(given: &Given) -> Direction {
    if given.direction == 0 { Direction::Deploy } else { Direction::Retract }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(name: &'static str, cycles: Option<u64>, error: f64) -> Variant {
        let forward = Course { cycles, max_rel_error: error, ..Course::default() };
        Variant { name, forward, inverse: Course::default(), on_front: false }
    }

    #[test]
    fn the_front_is_what_no_other_beats_in_both() {
        let mut variants = [
            with("cheap", Some(100), 1e-2),
            with("exact", Some(900), 1e-9),
            with("beaten", Some(500), 1e-3),
            with("good", Some(400), 1e-4),
            with("unknown", None, 1e-12),
        ];
        front(&mut variants);
        let on: Vec<_> = variants.iter().filter(|v| v.on_front).map(|v| v.name).collect();
        assert_eq!(on, ["cheap", "exact", "good"]);
    }

    #[test]
    fn every_arithmetic_gives_the_model() {
        let found = measure(true, false).unwrap();
        let [shipping, fixed, micro, libm, double] = &found.variants[..] else {
            panic!("five: {found:?}")
        };
        // Rounding of the answer is most of it, the fit of guess and polynomials the rest.
        for (variant, most) in
            [(shipping, 1e-4), (fixed, 1e-4), (micro, 1e-4), (libm, 1e-4), (double, 1e-4)]
        {
            assert!(variant.forward.max_rel_error < most, "{variant:?}");
            assert!(variant.inverse.max_rel_error < most, "{variant:?}");
            assert!(variant.forward.rms_rel_error <= variant.forward.max_rel_error);
            assert!(variant.forward.host_ns > 1.0, "{variant:?}");
        }
        assert!(found.points > 40 && found.ring.crossings >= 4);
        assert!(found.ring.max_rel_error < 0.02, "{:?}", found.ring);
    }
}
