//! Figure 19: modes of the drive arm.

use super::figure::{Claim, Figure, Mark, Panel, Series, Source};
use super::published::{CONSTRAINED_HZ, FREE_HZ};
use crate::reference::beam::{Beam, BeamError, Ends, Tip};

const SECTION: &str = "Experiment scheme";

/// Points of a mode shape.
const POINTS: usize = 60;

/// Frequencies that are nearly met, relative.
const NEAR: f64 = 0.1;

/// The modes of the figure.
#[derive(Clone, Debug)]
pub struct Modes {
    beam: Beam,
    /// Tip mass that the published constrained mode takes, kg.
    pub tip_mass_kg: f64,
    /// First constrained mode without and with that mass: wave number times length, Hz.
    constrained: [(f64, f64); 2],
    /// First bending mode of the free arm, the seventh after six of a rigid body, without
    /// and with that mass.
    free: [(f64, f64); 2],
}

impl Modes {
    /// Modes of the drive arm.
    ///
    /// # Errors
    /// [`BeamError`] if the arm refuses.
    pub fn new() -> Result<Self, BeamError> {
        let beam = Beam::drive_arm();
        let tip_mass_kg = beam.tip_mass_for(CONSTRAINED_HZ)?;
        let first = |ends, mass_kg| {
            let mode = beam.modes(ends, Tip { mass_kg, ..Tip::default() }, 1)?[0];
            Ok::<_, BeamError>((mode.beta_l, mode.frequency_hz))
        };
        let both = |ends| Ok::<_, BeamError>([first(ends, 0.0)?, first(ends, tip_mass_kg)?]);
        let (constrained, free) = (both(Ends::ClampedFree)?, both(Ends::FreeFree)?);
        Ok(Self { beam, tip_mass_kg, constrained, free })
    }

    /// The figure.
    #[must_use]
    pub fn figure(&self) -> Figure {
        let mut hertz = Panel::new("Natural frequency", "mode", "frequency, Hz");
        hertz.categories = vec!["first constrained".into(), "seventh free".into()];
        for (source, index) in [(Source::Theory, 0), (Source::Simulation, 1)] {
            let points = vec![(0.0, self.constrained[index].1), (1.0, self.free[index].1)];
            hertz.series.push(Series::new(source, points));
        }
        hertz.series.push(Series::new(Source::Fitted, vec![(0.0, CONSTRAINED_HZ)]));
        hertz.series.push(Series::new(Source::Published, vec![(1.0, FREE_HZ)]));
        hertz.least_y = Some((0.0, 0.0));
        let shapes = [
            ("First constrained mode", clamped as fn(f64, f64) -> f64, self.constrained),
            ("Seventh free mode", free as fn(f64, f64) -> f64, self.free),
        ];
        let mut panels = vec![hertz];
        panels.extend(shapes.map(|(title, shape, modes)| {
            let mut panel = Panel::new(title, "along the arm, mm", "deflection over largest");
            for (source, mode) in [Source::Theory, Source::Simulation].into_iter().zip(modes) {
                panel.series.push(Series::new(source, self.shape(shape, mode.0)));
            }
            panel
        }));
        let mark = |what: &str, published, fitted, of: [(f64, f64); 2]| Mark {
            what: what.into(),
            unit: "Hz",
            published,
            fitted,
            ours: vec![(Source::Theory, of[0].1), (Source::Simulation, of[1].1)],
        };
        Figure {
            id: "fig19",
            file: "fig19.svg".into(),
            title: "Modes of the drive arm",
            caption: format!(
                "Frequencies by the wave-vector method (equation 54), shapes of these wave numbers; here theory is \
                 the bare arm and simulation the arm with {:.1} g at the wheel's end, the mass with which \
                 its first constrained mode is the published one: fitted. The free arm's seventh mode is \
                 its first bending mode, after six of a rigid body. The virtual rig is given the two \
                 published frequencies as parameters and is no test of them; the study's table of six \
                 constrained modes is not published.",
                self.tip_mass_kg * 1e3
            ),
            columns: 3,
            panels,
            published: vec![
                mark("first constrained mode", CONSTRAINED_HZ, true, self.constrained),
                mark("seventh free mode", FREE_HZ, false, self.free),
            ],
        }
    }

    /// Shape of a mode over the arm, mm, its largest deflection 1.
    fn shape(&self, shape: fn(f64, f64) -> f64, beta_l: f64) -> Vec<(f64, f64)> {
        let along = |i: usize| i as f64 / (POINTS - 1) as f64;
        let values: Vec<f64> = (0..POINTS).map(|i| shape(beta_l, along(i))).collect();
        let most = values.iter().fold(0.0, |most: f64, w| if w.abs() > most.abs() { *w } else { most });
        let length = self.beam.length_m * 1e3;
        values.iter().enumerate().map(|(i, w)| (along(i) * length, w / most)).collect()
    }

    /// The claims about it; `ripple_hz` excites the arm between these speeds of the study.
    #[must_use]
    pub fn claims(&self, ripple_hz: (f64, f64)) -> Vec<Claim> {
        let of = |id| Claim::of("fig19", SECTION, id);
        let constrained = self.constrained.map(|mode| mode.1);
        let free = self.free.map(|mode| mode.1);
        let near = |hz: f64, published: f64| (hz / published - 1.0).abs() < NEAR;
        let apart = ripple_hz.1 < 0.8 * FREE_HZ.min(CONSTRAINED_HZ);
        vec![
            of("first-constrained-276").judged(
                "The first constrained mode is 276 Hz.",
                near(constrained[1], CONSTRAINED_HZ),
                format!(
                    "{:.1} Hz with {:.1} g at the wheel's end, a mass that is fitted to it and stands for \
                     wheel, axle and what yields in the clamp; {:.1} Hz without.",
                    constrained[1], self.tip_mass_kg * 1e3, constrained[0]
                ),
                "",
            ),
            of("seventh-free-163").judged(
                "The seventh free mode is 163 Hz.",
                free.into_iter().any(|hz| near(hz, FREE_HZ)),
                format!("{:.0} Hz without and {:.0} Hz with the mass at the wheel's end.", free[0], free[1]),
                "The arm alone is far too stiff for it. The published mode is that of the whole device, \
                 whose masses and joints the study does not give; a free body softer than the clamped arm \
                 bends somewhere else.",
            ),
            of("no-coupling").judged(
                "The design introduces no coupling: the excitation keeps away from the modes.",
                apart,
                format!(
                    "The drive's torque ripple excites with {:.0} to {:.0} Hz at the study's 3 to 8 mm/s, \
                     below {FREE_HZ} Hz.",
                    ripple_hz.0, ripple_hz.1
                ),
                "",
            ),
        ]
    }
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
    fn shapes_meet_their_ends() {
        let second = |shape: fn(f64, f64) -> f64, beta_l: f64, x: f64| {
            let h = 1e-4;
            (shape(beta_l, x + h) - 2.0 * shape(beta_l, x) + shape(beta_l, x - h)) / (h * h)
        };
        let modes = Modes::new().unwrap();
        for (beta_l, _) in modes.constrained {
            assert!(clamped(beta_l, 0.0).abs() < 1e-12 && clamped(beta_l, 1e-5).abs() < 1e-8);
            let bend = second(clamped, beta_l, 1.0) / second(clamped, beta_l, 0.0);
            assert!(bend.abs() < 1e-5, "{bend}");
        }
        for (beta_l, _) in modes.free {
            let bend = second(free, beta_l, 0.0) / second(free, beta_l, 0.5);
            assert!(bend.abs() < 1e-5, "{bend}");
        }
    }
}
