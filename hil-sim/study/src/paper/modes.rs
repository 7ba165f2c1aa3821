//! Figure 19: modes of the drive arm.

use interstage::rig::Rig;

use super::claims::{Verdict, fixed};
use super::published::{CONSTRAINED_HZ, FREE_HZ};
use crate::figure::{Chart, Figure, Mark, Series, Source};
use crate::reference::beam::{Beam, BeamError, Ends, Shape, Tip, bisect};

/// Points of a mode shape.
const POINTS: usize = 60;

/// Frequencies that are nearly met, relative.
const NEAR: f64 = 0.1;

/// Shape or frequency equation of a beam.
type Classical = fn(f64, f64) -> f64;

#[derive(Clone, Debug)]
pub(super) struct Modes {
    beam: Beam,
    /// Tip mass that the published constrained mode takes, kg.
    pub tip_mass_kg: f64,
    /// First constrained mode with that mass, from theory and simulation: wave number
    /// times length, Hz.
    constrained: [(f64, f64); 2],
    /// First bending mode of the free arm, the seventh after six of a rigid body, the
    /// same.
    free: [(f64, f64); 2],
    /// Their shapes by the waves.
    shapes: [Shape; 2],
    /// The same two frequencies of the bare arm, Hz.
    bare_hz: (f64, f64),
}

impl Modes {
    /// Modes of the drive arm.
    pub(super) fn new() -> Result<Self, BeamError> {
        let beam = Beam::drive_arm();
        let tip_mass_kg = beam.tip_mass_for(CONSTRAINED_HZ)?;
        let first = |ends, mass_kg| {
            let shapes = beam.shapes(ends, Tip { mass_kg, ..Tip::default() }, 1)?;
            Ok::<_, BeamError>(shapes[0].clone())
        };
        let pair = |shape: &Shape| (shape.mode.beta_l, shape.mode.frequency_hz);
        let shapes = [first(Ends::ClampedFree, tip_mass_kg)?, first(Ends::FreeFree, tip_mass_kg)?];
        let [constrained, free] = [pair(&shapes[0]), pair(&shapes[1])];
        let bare_hz =
            (pair(&first(Ends::ClampedFree, 0.0)?).1, pair(&first(Ends::FreeFree, 0.0)?).1);
        // The classical frequency equations, in products of the two ends' functions.
        let ratio = tip_mass_kg / beam.mass_kg();
        let hz = |beta_l: f64| constrained.1 * (beta_l / constrained.0).powi(2);
        let classical = |equation: Classical, range| {
            let beta_l = root(|b| equation(b, ratio), range);
            (beta_l, hz(beta_l))
        };
        let constrained = [classical(clamped_equation, (0.2, 2.0)), constrained];
        let free = [classical(free_equation, (3.5, 5.0)), free];
        Ok(Self { beam, tip_mass_kg, constrained, free, shapes, bare_hz })
    }

    pub(super) fn figure(&self) -> Figure {
        let of = |source, index: usize| {
            Series::new(source, vec![(0.0, self.constrained[index].1), (1.0, self.free[index].1)])
        };
        let series = vec![
            of(Source::Theory, 0),
            of(Source::Simulation, 1),
            Series::new(Source::Fitted, vec![(0.0, CONSTRAINED_HZ)]),
            Series::new(Source::Published, vec![(1.0, FREE_HZ)]),
        ];
        let names = vec!["first constrained".into(), "seventh free".into()];
        let mut hertz =
            Chart::of_categories("Natural frequency", ("mode", names), "frequency, Hz", series);
        hertz.least_y = Some((0.0, 0.0));
        let classical = [
            ("First constrained mode", clamped as Classical, self.constrained[0].0),
            ("Seventh free mode", free, self.free[0].0),
        ];
        let mut panels = vec![hertz];
        for ((title, shape, beta_l), waves) in classical.into_iter().zip(&self.shapes) {
            let theory = self.shape(|part| shape(beta_l, part));
            let simulation = self.shape(|part| waves.at(part * self.beam.length_m));
            let series = vec![
                Series::new(Source::Theory, theory),
                Series::new(Source::Simulation, simulation),
            ];
            let (x, y) = ("along the arm, mm", "deflection over largest");
            panels.push(Chart::new(title, x, y, series));
        }
        let mark = |what: &str, published, of: [(f64, f64); 2]| {
            let ours = [(Source::Theory, of[0].1), (Source::Simulation, of[1].1)];
            Mark::new(what.into(), "Hz", published, &ours)
        };
        let caption = format!(
            "The arm with {:.1} g at the wheel's end, the mass with which its first constrained mode is \
                 the published one: fitted. Theory: the classical frequency equations of a beam with a point \
                 mass. Simulation: the wave-vector method (equations 54 and 55). The free arm's seventh mode is its \
                 first bending mode, after six of a rigid body. The virtual rig has the two \
                 published frequencies as parameters and is no test of them.",
            self.tip_mass_kg * 1e3
        );
        let published = vec![
            mark("first constrained mode", (CONSTRAINED_HZ, true), self.constrained),
            mark("seventh free mode", (FREE_HZ, false), self.free),
        ];
        let title = "Modes of the drive arm";
        Figure { published, ..Figure::new("fig19", title, caption, 3, panels) }
    }

    /// Shape of a mode over the arm, mm, its largest deflection 1.
    fn shape(&self, shape: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let along = |i: usize| i as f64 / (POINTS - 1) as f64;
        let values: Vec<f64> = (0..POINTS).map(|i| shape(along(i))).collect();
        let most =
            values.iter().fold(0.0, |most: f64, w| if w.abs() > most.abs() { *w } else { most });
        let length = self.beam.length_m * 1e3;
        values.iter().enumerate().map(|(i, w)| (along(i) * length, w / most)).collect()
    }
}

pub(super) fn verdicts(modes: &Modes) -> Vec<Verdict> {
    let (constrained, free) = (modes.constrained[1].1, modes.free[1].1);
    let mass_g = modes.tip_mass_kg * 1e3;
    let bare = modes.bare_hz;
    let near = |hz: f64, published: f64| (hz / published - 1.0).abs() < NEAR;
    // The torque ripple at the study's slowest and fastest.
    let ripple = [3.0, 8.0].map(|speed| speed / Rig::prototype().drive.ripple_pitch_mm);
    let is_free = near(free, FREE_HZ) || near(bare.1, FREE_HZ);
    let is_below = ripple[1] < 0.8 * FREE_HZ.min(CONSTRAINED_HZ);
    let first = fixed(1, [constrained, mass_g, bare.0]);
    vec![
        ("first-constrained-276", near(constrained, CONSTRAINED_HZ), first),
        ("seventh-free-163", is_free, fixed(0, [free, bare.1])),
        ("no-coupling", is_below, fixed(0, ripple)),
    ]
}

/// Frequency equation of a beam clamped at one end with a point mass, in beam masses, at
/// the other (Blevins, Formulas for Natural Frequency and Mode Shape, table 8-8).
fn clamped_equation(b: f64, mass: f64) -> f64 {
    1.0 + b.cos() * b.cosh() + mass * b * (b.cos() * b.sinh() - b.sin() * b.cosh())
}

/// Frequency equation of a free beam with a point mass, in beam masses, at one end.
fn free_equation(b: f64, mass: f64) -> f64 {
    1.0 - b.cos() * b.cosh() - mass * b * (b.cos() * b.sinh() - b.sin() * b.cosh())
}

/// Root of a function that changes sign once in a range.
fn root(f: impl Fn(f64) -> f64, (low, high): (f64, f64)) -> f64 {
    bisect(low, high, f(high).signum(), f)
}

/// Shape of a beam clamped at 0 with a free end or a point mass at 1.
fn clamped(beta_l: f64, x: f64) -> f64 {
    let b = beta_l;
    let part = (b.cosh() + b.cos()) / (b.sinh() + b.sin());
    let at = b * x;
    (at.cosh() - at.cos()) - part * (at.sinh() - at.sin())
}

/// Shape of a beam free at 0 with a free end or a point mass at 1.
fn free(beta_l: f64, x: f64) -> f64 {
    let b = beta_l;
    let part = (b.cosh() - b.cos()) / (b.sinh() - b.sin());
    let at = b * x;
    (at.cosh() + at.cos()) - part * (at.sinh() + at.sin())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_classical_equations_give_what_the_waves_do() {
        let modes = Modes::new().unwrap();
        for [classical, waves] in [modes.constrained, modes.free] {
            assert!((classical.0 / waves.0 - 1.0).abs() < 1e-9, "{classical:?} {waves:?}");
        }
        assert!((root(|b| free_equation(b, 0.0), (3.5, 5.0)) - 4.730_040_745).abs() < 1e-9);
        assert!((root(|b| clamped_equation(b, 0.0), (0.2, 2.0)) - 1.875_104_069).abs() < 1e-9);
    }

    #[test]
    fn the_classical_shapes_are_those_of_the_waves() {
        let modes = Modes::new().unwrap();
        let classical = [(clamped as Classical, modes.constrained[0].0), (free, modes.free[0].0)];
        for ((shape, beta_l), waves) in classical.into_iter().zip(&modes.shapes) {
            let theory = modes.shape(|part| shape(beta_l, part));
            let simulation = modes.shape(|part| waves.at(part * modes.beam.length_m));
            for (a, b) in theory.iter().zip(&simulation) {
                assert!((a.1 - b.1).abs() < 1e-6, "{a:?} {b:?}");
            }
        }
    }
}
