//! SciPy's ODE solvers and MuJoCo on one identical crossing, beside the plant's ring.
//!
//! - SciPy solves exactly the ring's equations, compiled, from loose to tight tolerances.
//! - MuJoCo has its wheel, its step and its soft contacts, fitted to the ring at loads
//!   around the crossing's own.
//!
//! Errors are those of gap and largest axial force against the converged ring.

use std::path::Path;

use anyhow::{Context, Result};
use interstage::rig::Rig;
use serde::{Deserialize, Serialize};

use hil_sim::plant::balance::{Axial, BalanceError};
use hil_sim::plant::crossing::{CrossingCase, CrossingResult, cross};
use hil_sim::plant::precision::{FINER, Setting as Mesh};
use hil_sim::plant::ring::RingParameters;
use hil_sim::plant::rolling;

use super::{least, python};

/// The published case: speed, mm/s, and preload, N.
const SPEED_MM_S: f64 = 5.0;
const PRELOAD_N: f64 = 100.0;

/// Element counts of the solvers.
const ELEMENTS: [usize; 4] = [240, 480, 960, 1920];
/// Neighbouring element counts of which the worst error counts: where the elements lie at
/// lift-off shifts the gap by about a third of their pitch.
const NEIGHBOURS: [isize; 3] = [-3, 0, 3];
/// The ring's element counts and strides over the usual ones.
const FINENESS: [f64; 7] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// MuJoCo's time steps, s.
const TIME_STEPS_S: [f64; 7] = [2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2];
/// Preloads that MuJoCo's contacts are fitted at, over the crossing's own.
const FITS: [f64; 2] = [0.8, 1.2];
/// Error at which times are compared.
pub const LEVEL: f64 = 0.005;
/// Name of the ring among the methods.
pub const RING: &str = "ring";

/// One setting of one method; a script's answer has no error yet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// The method.
    pub name: String,
    /// Elements around the ring, if it has one.
    pub elements: Option<usize>,
    /// Relative and absolute tolerance of a solver.
    pub tolerance: Option<f64>,
    pub time_step_s: Option<f64>,
    /// Gap, mm, if the wheel lifted off.
    pub gap_mm: Option<f64>,
    /// Largest axial force, N.
    pub corner_force_n: f64,
    /// Relative error of gap or largest axial force, the larger; none without a gap.
    pub error: Option<f64>,
    /// Processor time, s.
    pub seconds: f64,
}

/// The comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Peers {
    /// Versions of SciPy and MuJoCo.
    pub versions: [String; 2],
    /// Settings of every method, the ring first.
    pub settings: Vec<Setting>,
    /// Least time within [`LEVEL`] by method, s; none if a method does not get there.
    pub least_seconds: Vec<(String, Option<f64>)>,
}

/// What a script is given.
#[derive(Serialize)]
struct Given<'a> {
    radius_mm: f64,
    width_mm: f64,
    k_inf: f64,
    k_0: f64,
    tau_s: f64,
    step_height_mm: f64,
    speed_mm_s: f64,
    preload_n: f64,
    start_mm: f64,
    end_mm: f64,
    repeats: usize,
    budget_s: f64,
    folder: &'a Path,
    elements: Vec<usize>,
    time_steps_s: [f64; 7],
    fits: Vec<Fit>,
}

/// A point that MuJoCo's contacts are fitted to.
#[derive(Serialize)]
struct Fit {
    preload_n: f64,
    sinkage_mm: f64,
    gap_mm: f64,
}

/// What a script answers.
#[derive(Deserialize)]
struct Answer {
    version: String,
    points: Vec<Setting>,
}

/// Gap, mm, and largest axial force, N, of the converged ring.
#[derive(Clone, Copy)]
struct Exact(f64, f64);

impl Exact {
    fn error(self, gap_mm: f64, force_n: f64) -> f64 {
        (gap_mm / self.0 - 1.0).abs().max((force_n / self.1 - 1.0).abs())
    }
}

fn crossing(preload_n: f64, mesh: Mesh) -> Result<CrossingResult, BalanceError> {
    let rig = Rig::fe();
    cross(&CrossingCase {
        ring: RingParameters::of(&rig, mesh.elements),
        step_height_mm: rig.rig.step_height_mm,
        speed_mm_s: SPEED_MM_S,
        preload_n,
        axial: Axial::Pushed,
        stride_mm: mesh.stride_mm,
    })
}

/// Runs the comparison; what it needs is set up first, under the target directory.
pub fn compare(say: &dyn Fn(&str)) -> Result<Peers> {
    let python = python::provide(say)?;
    say("converged ring");
    let found = crossing(PRELOAD_N, Mesh::usual().finer(FINER))?;
    let exact = Exact(found.gap_mm, found.corner_force_n);
    let given = given(&python.folder)?;
    say("ring");
    let mut settings =
        FINENESS.into_iter().map(|factor| ring(factor, exact)).collect::<Result<Vec<_>>>()?;
    say("SciPy");
    let solved: Answer = python.run("solvers.py", &given)?;
    say("MuJoCo");
    let engine: Answer = python.run("mujoco_crossing.py", &given)?;
    settings.extend(merged(solved.points.into_iter().chain(engine.points), exact));
    Ok(Peers {
        versions: [solved.version, engine.version],
        least_seconds: least_seconds(&settings),
        settings,
    })
}

/// The ring at this fineness.
fn ring(factor: f64, exact: Exact) -> Result<Setting> {
    let usual = Mesh::usual();
    let mesh = |shift: isize| Mesh {
        elements: ((usual.elements as f64 * factor).round() as usize).saturating_add_signed(shift),
        stride_mm: usual.stride_mm / factor,
    };
    let (seconds, found) = least(|| crossing(PRELOAD_N, mesh(0)));
    let found = found?;
    let mut error = 0.0_f64;
    for shift in NEIGHBOURS {
        let found = crossing(PRELOAD_N, mesh(shift))?;
        error = error.max(exact.error(found.gap_mm, found.corner_force_n));
    }
    Ok(Setting {
        name: RING.to_owned(),
        elements: Some(mesh(0).elements),
        tolerance: None,
        time_step_s: Some(mesh(0).stride_mm / SPEED_MM_S),
        gap_mm: Some(found.gap_mm),
        corner_force_n: found.corner_force_n,
        error: Some(error),
        seconds,
    })
}

fn given(folder: &Path) -> Result<Given<'_>> {
    let rig = Rig::fe();
    let ring = RingParameters::of(&rig, Mesh::usual().elements);
    let (radius, step) = (ring.radius_mm, rig.rig.step_height_mm);
    let run = (radius * radius - (radius - step) * (radius - step)).sqrt();
    let mut fits = Vec::new();
    for part in FITS {
        let preload_n = part * PRELOAD_N;
        let gap_mm = crossing(preload_n, Mesh::usual().finer(2))?.gap_mm;
        let balance = |rolling: &rolling::Rolling| rolling.cosine_n - preload_n;
        let rolled = rolling::solve(&ring, SPEED_MM_S, radius - 0.1, balance);
        fits.push(Fit { preload_n, sinkage_mm: radius - rolled.height_mm, gap_mm });
    }
    Ok(Given {
        radius_mm: radius,
        width_mm: ring.width_mm,
        k_inf: ring.k_inf,
        k_0: ring.k_0,
        tau_s: ring.tau_s,
        step_height_mm: step,
        speed_mm_s: SPEED_MM_S,
        preload_n: PRELOAD_N,
        // As `cross` does it: long enough to forget how the wheel was put down, and
        // past the corner until the patch has left its edge.
        start_mm: -run - (8.0 * ring.tau_s * SPEED_MM_S).min(2.0 * radius) - 0.5 * radius,
        end_mm: 0.6 * radius,
        repeats: 5,
        budget_s: 0.6,
        folder,
        elements: ELEMENTS
            .iter()
            .flat_map(|n| NEIGHBOURS.map(|shift| n.saturating_add_signed(shift)))
            .collect(),
        time_steps_s: TIME_STEPS_S,
        fits,
    })
}

/// One setting from neighbouring element counts: the least time and the largest error.
fn merged(points: impl Iterator<Item = Setting>, exact: Exact) -> Vec<Setting> {
    let nearest = |n: usize| ELEMENTS.into_iter().min_by_key(|m| m.abs_diff(n)).unwrap_or(n);
    let mut settings: Vec<Setting> = Vec::new();
    for point in points {
        let elements = point.elements.map(nearest);
        let error = point.gap_mm.map(|gap| exact.error(gap, point.corner_force_n));
        let same = |s: &&mut Setting| {
            (&s.name, s.elements, s.tolerance, s.time_step_s)
                == (&point.name, elements, point.tolerance, point.time_step_s)
        };
        if let Some(setting) = settings.iter_mut().find(same) {
            setting.error = setting.error.zip(error).map(|(a, b)| a.max(b));
            setting.seconds = setting.seconds.min(point.seconds);
        } else {
            settings.push(Setting { elements, error, ..point });
        }
    }
    settings
}

/// Least time within [`LEVEL`] of every method, in the order in which they come.
fn least_seconds(settings: &[Setting]) -> Vec<(String, Option<f64>)> {
    let mut all: Vec<(String, Option<f64>)> = Vec::new();
    for setting in settings {
        let good = setting.error.is_some_and(|error| error <= LEVEL).then_some(setting.seconds);
        match all.iter_mut().find(|(name, _)| *name == setting.name) {
            Some((_, least)) => *least = least.iter().copied().chain(good).reduce(f64::min),
            None => all.push((setting.name.clone(), good)),
        }
    }
    all
}

impl Peers {
    /// Least error of SciPy's solvers: how far two independent solutions agree.
    pub fn agreement(&self) -> Result<f64> {
        let solvers = self.settings.iter().filter(|s| s.tolerance.is_some());
        let errors = solvers.filter_map(|s| s.error);
        errors.reduce(f64::min).context("no solver was run")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(elements: usize, gap_mm: Option<f64>, seconds: f64) -> Setting {
        Setting {
            name: "A".to_owned(),
            elements: Some(elements),
            tolerance: Some(1e-2),
            time_step_s: None,
            gap_mm,
            corner_force_n: 50.0,
            error: None,
            seconds,
        }
    }

    #[test]
    fn neighbours_count_as_one_setting_with_the_worst_error() {
        let points = [
            point(237, Some(2.002), 3.0),
            point(240, Some(2.0), 2.0),
            point(243, Some(1.992), 4.0),
            point(480, Some(2.04), 1.0),
            point(960, None, 0.5),
        ];
        let found = merged(points.into_iter(), Exact(2.0, 50.0));
        assert_eq!(found.len(), 3);
        assert_eq!((found[0].elements, found[0].seconds), (Some(240), 2.0));
        assert!((found[0].error.unwrap() - 0.004).abs() < 1e-12);
        // Without a gap a setting has no precision.
        assert_eq!(found[2].error, None);
        assert_eq!(least_seconds(&found), [("A".to_owned(), Some(2.0))]);
    }

    #[test]
    fn the_crossing_is_the_one_that_the_rubber_was_fitted_to() {
        let found = crossing(PRELOAD_N, Mesh { elements: 2880, stride_mm: 0.02 }).unwrap();
        assert!(
            (found.gap_mm - 1.744).abs() < 0.002 && (found.corner_force_n - 53.72).abs() < 0.05
        );
        let given = given(Path::new("/tmp")).unwrap();
        let [less, more] = &given.fits[..] else { panic!("two fits") };
        assert!(less.gap_mm > more.gap_mm && less.sinkage_mm < more.sinkage_mm);
    }
}
