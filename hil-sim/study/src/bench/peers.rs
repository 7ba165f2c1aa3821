//! Other engines and solvers on one identical crossing, beside the ring, in one run.
//!
//! - A general ODE solver (SciPy's) on exactly the ring's equations, compiled: loose
//!   to tight tolerances, in the form that is not stiff and in the one that is.
//! - MuJoCo with its wheel, its step and its soft contacts, fitted to the ring at
//!   loads around the crossing's own.
//!
//! Errors are those of gap and largest axial force against the converged ring; times
//! are processor time of one thread, the least of several runs.

mod venv;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

use super::clock::{Effort, least};
use super::problem::{Figures, Problem, Truth, lucks};
use hil_sim::plant::crossing::cross;
use hil_sim::plant::precision::Setting as Mesh;
use hil_sim::plant::rolling;

/// Element counts that the solvers are run with.
const ELEMENTS: [usize; 4] = [240, 480, 960, 1920];

/// MuJoCo's time steps, s.
const TIME_STEPS_S: [f64; 7] = [2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2];

/// Preloads that MuJoCo's contacts are fitted at, over the crossing's own.
const FITS: [f64; 2] = [0.8, 1.2];

/// Speed that MuJoCo is then also run at, over the crossing's own.
const OTHER_SPEED: f64 = 2.0;

/// Errors at which the times are compared.
const LEVELS: [f64; 2] = [0.005, 0.002];

/// One setting of one method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// The method.
    pub name: String,
    /// Elements around the ring, if it has one.
    pub elements: Option<usize>,
    /// Relative and absolute tolerance of a solver.
    pub tolerance: Option<f64>,
    /// Time step, s.
    pub time_step_s: Option<f64>,
    /// Largest relative error of the gap over the luck of where the elements stand;
    /// none if there was no gap.
    pub gap_error: Option<f64>,
    /// The same of the largest axial force.
    pub force_error: f64,
    /// Processor time, s.
    pub seconds: f64,
    /// Sums over the contact that it took, if it counts them.
    pub contact_sums: Option<u64>,
}

impl Setting {
    /// Largest relative error, infinite without a gap.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.gap_error.unwrap_or(f64::INFINITY).max(self.force_error)
    }
}

/// How much longer a method takes than the ring at the same precision.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// The method.
    pub name: String,
    /// Largest relative error of gap and force allowed.
    pub level: f64,
    /// Least time of the method over that of the ring; none if it does not get there.
    pub time_ratio: Option<f64>,
}

/// The comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Peers {
    /// Versions of what was compared with.
    pub versions: Vec<String>,
    /// Doubt about the converged answer itself, relative.
    pub doubt: f64,
    /// The settings of every method, the ring first.
    pub settings: Vec<Setting>,
    /// Times at equal precision.
    pub ratios: Vec<Ratio>,
    /// What MuJoCo gives at twice the speed with the contacts of the comparison:
    /// relative error of the gap, which memory moves.
    pub mujoco_gap_error_at_other_speed: Option<f64>,
    /// What MuJoCo's cylinder in place of the disc gives.
    pub mujoco_cylinder_gap_error: Option<f64>,
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
    folder: &'a str,
    elements: Vec<usize>,
    time_steps_s: &'a [f64],
    fits: Vec<Fit>,
    other_speed_mm_s: f64,
}

/// A point that MuJoCo's contacts are fitted to.
#[derive(Serialize)]
struct Fit {
    preload_n: f64,
    sinkage_mm: f64,
    gap_mm: f64,
}

#[derive(Deserialize)]
struct Solved {
    scipy: String,
    points: Vec<Point>,
}

#[derive(Deserialize)]
struct Engine {
    mujoco: String,
    points: Vec<Point>,
    other_speed: Point,
    cylinder: Point,
}

#[derive(Deserialize)]
struct Point {
    name: String,
    elements: Option<usize>,
    tolerance: Option<f64>,
    time_step_s: Option<f64>,
    gap_mm: Option<f64>,
    corner_force_n: f64,
    seconds: f64,
    contact_sums: Option<u64>,
}

/// Runs the comparison; what it needs is set up first, under the target directory.
///
/// # Errors
/// If Python or a package cannot be had, or a script fails.
pub fn compare(truth: &Truth, say: &dyn Fn(&str)) -> Result<Peers> {
    let problem = Problem::published();
    let python = venv::provide(say)?;
    let given = given(&problem, python.folder())?;
    say("ring");
    let mut settings = own(&problem, truth)?;
    say("ODE solvers");
    let solved: Solved = python.run("solvers.py", &given)?;
    say("MuJoCo");
    let engine: Engine = python.run("mujoco_crossing.py", &given)?;
    let errors = |point: &Point| {
        let gap = point.gap_mm.map(|gap| (gap / truth.figures.gap_mm - 1.0).abs());
        (gap, (point.corner_force_n / truth.figures.force_n - 1.0).abs())
    };
    for points in grouped(solved.points) {
        settings.push(worst(&points, errors));
    }
    for point in &engine.points {
        settings.push(worst(std::slice::from_ref(point), errors));
    }
    let faster = Problem { speed_mm_s: OTHER_SPEED * problem.speed_mm_s, ..problem };
    let faster_gap = cross(&faster.case(Mesh::usual().finer(2)))?.gap_mm;
    Ok(Peers {
        versions: vec![format!("SciPy {}", solved.scipy), format!("MuJoCo {}", engine.mujoco)],
        doubt: truth.doubt,
        ratios: ratios(&settings),
        settings,
        mujoco_gap_error_at_other_speed: engine
            .other_speed
            .gap_mm
            .map(|gap| (gap / faster_gap - 1.0).abs()),
        mujoco_cylinder_gap_error: errors(&engine.cylinder).0,
    })
}

/// Settings of the ring: elements and stride finer together.
fn meshes() -> Vec<Mesh> {
    let usual = Mesh::usual();
    let by = |factor: f64| Mesh {
        elements: (usual.elements as f64 * factor).round() as usize,
        stride_mm: usual.stride_mm / factor,
    };
    [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0].into_iter().map(by).collect()
}

/// The ring itself.
fn own(problem: &Problem, truth: &Truth) -> Result<Vec<Setting>> {
    let mut settings = Vec::new();
    for mesh in meshes() {
        let timed = least(Effort::USUAL, || problem.case(mesh), |case| cross(&case));
        let mut errors = (0.0_f64, 0.0_f64);
        let mut found = vec![Figures::from(timed.answer?)];
        for other in lucks(mesh) {
            found.push(cross(&problem.case(other))?.into());
        }
        for figures in found {
            let (gap, force) = figures.errors(&truth.figures);
            errors = (errors.0.max(gap), errors.1.max(force));
        }
        settings.push(Setting {
            name: RING.to_owned(),
            elements: Some(mesh.elements),
            tolerance: None,
            time_step_s: Some(mesh.stride_mm / problem.speed_mm_s),
            gap_error: Some(errors.0),
            force_error: errors.1,
            seconds: timed.seconds,
            contact_sums: None,
        });
    }
    Ok(settings)
}

/// Name of the ring among the methods.
pub const RING: &str = "ring";

fn given<'a>(problem: &Problem, folder: &'a str) -> Result<Given<'a>> {
    let ring = problem.ring;
    let (radius, step) = (ring.radius_mm, problem.step_height_mm);
    let run = (radius * radius - (radius - step) * (radius - step)).sqrt();
    let mut fits = Vec::new();
    for part in FITS {
        let preload_n = part * problem.preload_n;
        let gap_mm = cross(&problem.under(preload_n).case(Mesh::usual().finer(2)))?.gap_mm;
        let balance = |rolling: &rolling::Rolling| rolling.cosine_n - preload_n;
        let rolled = rolling::solve(&ring, problem.speed_mm_s, radius - 0.1, balance);
        fits.push(Fit { preload_n, sinkage_mm: radius - rolled.height_mm, gap_mm });
    }
    Ok(Given {
        radius_mm: radius,
        width_mm: ring.width_mm,
        k_inf: ring.k_inf,
        k_0: ring.k_0,
        tau_s: ring.tau_s,
        step_height_mm: step,
        speed_mm_s: problem.speed_mm_s,
        preload_n: problem.preload_n,
        // As `cross` does it: long enough to forget how the wheel was put down, and
        // past the corner until the patch has left its edge.
        start_mm: -run - (8.0 * ring.tau_s * problem.speed_mm_s).min(2.0 * radius) - 0.5 * radius,
        end_mm: 0.6 * radius,
        repeats: 5,
        budget_s: 0.6,
        folder,
        elements: ELEMENTS.iter().flat_map(|&n| [n - 3, n, n + 3]).collect(),
        time_steps_s: &TIME_STEPS_S,
        fits,
        other_speed_mm_s: OTHER_SPEED * problem.speed_mm_s,
    })
}

/// Points of one method, tolerance and element count, whose neighbours belong to it.
fn grouped(points: Vec<Point>) -> Vec<Vec<Point>> {
    let mut groups: Vec<Vec<Point>> = Vec::new();
    for point in points {
        let belongs = |group: &&mut Vec<Point>| {
            let first = &group[0];
            let near = |a: Option<usize>, b: Option<usize>| {
                a.zip(b).is_some_and(|(a, b)| a.abs_diff(b) <= 6)
            };
            first.name == point.name
                && first.tolerance == point.tolerance
                && near(first.elements, point.elements)
        };
        match groups.iter_mut().find(belongs) {
            Some(group) => group.push(point),
            None => groups.push(vec![point]),
        }
    }
    groups
}

/// A setting from its points: the middle one's, with the least time and the largest
/// errors of all.
fn worst(points: &[Point], errors: impl Fn(&Point) -> (Option<f64>, f64)) -> Setting {
    let middle = &points[points.len() / 2];
    let all: Vec<_> = points.iter().map(errors).collect();
    let gap = all.iter().map(|e| e.0.unwrap_or(f64::INFINITY)).fold(0.0, f64::max);
    Setting {
        name: middle.name.clone(),
        elements: middle.elements,
        tolerance: middle.tolerance,
        time_step_s: middle.time_step_s,
        gap_error: Some(gap).filter(|gap| gap.is_finite()),
        force_error: all.iter().map(|e| e.1).fold(0.0, f64::max),
        seconds: points.iter().map(|point| point.seconds).fold(f64::INFINITY, f64::min),
        contact_sums: middle.contact_sums,
    }
}

/// Times of all methods over the ring's where both are as precise as asked.
fn ratios(settings: &[Setting]) -> Vec<Ratio> {
    let mut names: Vec<&str> = Vec::new();
    for setting in settings {
        if setting.name != RING && !names.contains(&setting.name.as_str()) {
            names.push(&setting.name);
        }
    }
    let quickest = |name: &str, level: f64| {
        let good = settings.iter().filter(|s| s.name == name && s.error() <= level);
        good.map(|s| s.seconds).min_by(f64::total_cmp)
    };
    let pairs = LEVELS.iter().flat_map(|&level| names.iter().map(move |&name| (level, name)));
    let ratio = |(level, name): (f64, &str)| Ratio {
        name: name.to_owned(),
        level,
        time_ratio: quickest(name, level).zip(quickest(RING, level)).map(|(a, b)| a / b),
    };
    pairs.map(ratio).collect()
}

/// Checks that the solvers agree with the ring: the least error of any.
///
/// # Errors
/// If none comes within `most`, so that one of the two is wrong.
pub fn agree(peers: &Peers, most: f64) -> Result<f64> {
    let solvers = peers.settings.iter().filter(|s| s.tolerance.is_some());
    let least = solvers.map(Setting::error).min_by(f64::total_cmp).context("no solver was run")?;
    ensure!(least <= most, "no solver comes within {most} of the ring: {least}");
    Ok(least)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(name: &str, elements: usize, tolerance: f64, gap_mm: f64, seconds: f64) -> Point {
        Point {
            name: name.to_owned(),
            elements: Some(elements),
            tolerance: Some(tolerance),
            time_step_s: None,
            gap_mm: Some(gap_mm),
            corner_force_n: 50.0,
            seconds,
            contact_sums: None,
        }
    }

    #[test]
    fn neighbours_count_as_one_setting_with_the_worst_error() {
        let points = vec![
            point("A", 237, 1e-2, 2.02, 3.0),
            point("A", 237, 1e-3, 2.00, 9.0),
            point("A", 240, 1e-2, 2.00, 2.0),
            point("A", 243, 1e-2, 1.99, 4.0),
            point("A", 480, 1e-2, 2.00, 5.0),
            point("B", 240, 1e-2, 2.00, 5.0),
        ];
        let groups = grouped(points);
        assert_eq!(groups.iter().map(Vec::len).collect::<Vec<_>>(), [3, 1, 1, 1]);
        let errors = |p: &Point| (p.gap_mm.map(|gap| (gap / 2.0 - 1.0).abs()), 0.001);
        let setting = worst(&groups[0], errors);
        assert_eq!((setting.elements, setting.seconds), (Some(240), 2.0));
        assert!((setting.error() - 0.01).abs() < 1e-12);
    }

    #[test]
    fn a_crossing_without_a_gap_is_no_precision() {
        let lost = Point { gap_mm: None, ..point("A", 240, 1e-2, 0.0, 1.0) };
        let setting = worst(&[lost], |p| (p.gap_mm, 0.0));
        assert_eq!((setting.gap_error, setting.error()), (None, f64::INFINITY));
    }

    #[test]
    fn ratios_compare_the_quickest_that_are_precise_enough() {
        let setting = |name: &str, error: f64, seconds: f64| Setting {
            name: name.to_owned(),
            elements: None,
            tolerance: None,
            time_step_s: None,
            gap_error: Some(error),
            force_error: 0.0,
            seconds,
            contact_sums: None,
        };
        let all = [
            setting(RING, 0.01, 1.0),
            setting(RING, 0.004, 2.0),
            setting(RING, 0.001, 4.0),
            setting("A", 0.004, 10.0),
            setting("B", 0.02, 1.0),
        ];
        let found = ratios(&all);
        let of = |name: &str, level: f64| {
            found.iter().find(|r| r.name == name && r.level == level).unwrap().time_ratio
        };
        assert_eq!(of("A", LEVELS[0]), Some(5.0));
        assert_eq!(of("A", LEVELS[1]), None);
        assert_eq!(of("B", LEVELS[0]), None);
    }

    #[test]
    fn what_the_scripts_are_given_is_the_crossing() {
        let given = given(&Problem::published(), "/tmp").unwrap();
        assert_eq!((given.speed_mm_s, given.preload_n), (5.0, 100.0));
        assert!(given.start_mm < -13.6 && given.end_mm > 0.0);
        let [less, more] = &given.fits[..] else { panic!("two fits") };
        assert!(less.preload_n < 100.0 && more.preload_n > 100.0);
        assert!(less.gap_mm > more.gap_mm && less.sinkage_mm < more.sinkage_mm);
    }
}
