//! What the study concludes, on the rig: the gap held at a step by raising the preload,
//! and its assumptions on speed, preload, grip and resonance.

use anyhow::Result;
use interstage::rig::Rig;

use super::case::{Case, Loads};
use super::claims::{BySource, Verdict, change, fixed, largest, percents, within};
use super::experiment::{Experiment, Reading, Run, marks};
use super::history::Points;
use super::published::{CONSTRAINED_HZ, FREE_HZ, LEAST_PRELOAD_N, LEAST_SPEED_MM_S};
use super::simulation;
use super::sweeps::Curves;
use super::theory::{self, Drive};
use crate::figure::{Chart, Figure, Series, Source};
use crate::reference::beam::BeamError;
use crate::reference::vibration::Arm;
use hil_sim::plant::balance::{Axial, BalanceError};
use hil_sim::plant::crossing::{CrossingCase, cross};
use hil_sim::plant::sensors::Noise;
use hil_sim::plant::spread::Section;
use hil_sim::rollout::{CrossingSetup, Wheel, halved};

/// The safe point, the faster one without and the faster one with more preload.
pub(super) const CASES: [(f64, f64); 3] = [(5.0, 33.3), (8.0, 33.3), (8.0, 40.0)];

/// Speeds of the curve of preloads.
const SPEEDS_MM_S: [f64; 6] = [3.0, 4.0, 5.0, 6.0, 7.0, 8.0];

/// Two gaps no farther apart than this, relative, are the same.
const SAME: f64 = 0.01;

/// Elements and stride of crossings of which the friction alone counts.
const COARSE: (usize, f64) = (1440, 0.02);

#[derive(Clone, Debug)]
pub(super) struct Hold {
    /// Preload that holds the gap of the safe point against speed: theory, simulation.
    preload: (Points, Points),
    /// Mean gap of the three transitions in each of [`CASES`], mm.
    gaps: [BySource; 3],
    /// Gaps of [`CASES`] in every run, mm.
    read: Vec<Vec<f64>>,
    /// Preload below which one wheel cannot lift its share of the study's top load, N.
    least_preload_n: f64,
    /// Friction that lifting the rig's entire top load takes at cruise preload.
    friction_alone: f64,
    /// Amplitude of the arm under 1 N at its first mode, and at the frequency of the torque
    /// ripple at 8 mm/s, um.
    response_um: (f64, f64),
}

impl Hold {
    pub(super) fn cases() -> [Case; 3] {
        CASES.map(|(speed, preload)| Case::new(Loads::Prototype, speed, preload))
    }

    /// Theory and simulation, and the experiments on [`Hold::cases`].
    pub(super) fn new(experiments: &[&Experiment]) -> Result<Self> {
        let [safe, ..] = Self::cases();
        let simulated = |case: &Case| simulation::lift(case, Drive::Driven, 1).map(|l| l.gap_mm);
        let mut gaps = [[0.0; 3]; 3];
        let mut all_read = Vec::new();
        for (gaps, experiment) in gaps.iter_mut().zip(experiments) {
            let read: Vec<f64> =
                experiment.runs.iter().filter_map(|run| run.mean(|r| r.gap_mm)).collect();
            *gaps = [
                theory::mean_lift(&experiment.case, Drive::Driven)?.gap_mm,
                simulated(&experiment.case)?,
                read.iter().sum::<f64>() / read.len() as f64,
            ];
            all_read.push(read);
        }
        let wheel = Wheel::try_build(&Loads::Prototype.rig())?;
        let thrust = safe.pressing_n(1) - safe.preload_n;
        let setup = theory::setup(&safe, Drive::Driven, 1);
        let wanted = theory::lift(&safe, Drive::Driven, 1)?.gap_mm;
        let force_n = |speed_mm_s| wheel.force_n(wanted, &CrossingSetup { speed_mm_s, ..setup });
        let theory = SPEEDS_MM_S.map(|v| (v, force_n(v) - thrust)).to_vec();
        let target = gaps[0][1];
        let mut simulation = Vec::new();
        for speed in SPEEDS_MM_S {
            let gap = |preload| simulated(&Case::new(Loads::Prototype, speed, preload));
            simulation.push((speed, secant(gap, target, (33.3, 40.0))?));
        }
        Ok(Self {
            preload: (theory, simulation),
            gaps,
            read: all_read,
            least_preload_n: least_preload_n(),
            friction_alone: friction_alone()?,
            response_um: (
                response_um(CONSTRAINED_HZ)?,
                response_um(8.0 / Rig::prototype().drive.ripple_pitch_mm)?,
            ),
        })
    }

    pub(super) fn figure(&self) -> Figure {
        let preload = vec![
            Series::new(Source::Theory, self.preload.0.clone()),
            Series::new(Source::Simulation, self.preload.1.clone()),
        ];
        let mut experiment = Series::new(Source::Experiment, Vec::new());
        for (x, read) in self.read.iter().enumerate() {
            marks(x as f64, read, &mut experiment);
        }
        let numbered = |source: usize| [0, 1, 2].map(|x| (x as f64, self.gaps[x][source])).to_vec();
        let gap = vec![
            Series::new(Source::Theory, numbered(0)),
            Series::new(Source::Simulation, numbered(1)),
            experiment,
        ];
        let title = "Preload that holds the gap of 5 mm/s, 33.3 N";
        let cases = ("speed in mm/s, preload", CASES.map(|(v, p)| format!("{v}, {p} N")).to_vec());
        let panels = vec![
            Chart::new(title, "speed, mm/s", "preload, N", preload),
            Chart::of_categories("Gap without and with more preload", cases, "gap, mm", gap),
        ];
        let caption = "The study's conclusion, at rig loads: the preload with which a faster wheel \
                       keeps the gap of 5 mm/s and 33.3 N. Theory: the tread rolled out in \
                       fixed point, as the controller uses it. Simulation: the ring, solved for the \
                       preload. Virtual rig: forty runs, mean of the three transitions. The study \
                       has no figure of this.";
        let title = "The gap held by raising the preload at the step";
        Figure::new("conclusion", title, caption.to_owned(), 2, panels)
    }
}

/// The verdicts, with what all experiments and the gap over the speed say.
pub(super) fn verdicts(hold: &Hold, experiments: &[Experiment], gap: &Curves) -> Vec<Verdict> {
    let Hold { preload, least_preload_n, friction_alone, response_um, .. } = hold;
    let (resonant, at_fastest) = response_um;
    let [safe, faster, held] = hold.gaps;
    let apart = |gap| change(safe, gap);
    let rig = Rig::prototype();
    let at_rig = experiments.iter().filter(|e| e.case.loads == Loads::Prototype);
    let runs: Vec<&Run> = at_rig.flat_map(|e| &e.runs).collect();
    let readings: Vec<&Reading> = runs.iter().flat_map(|run| &run.crossings).collect();
    let separation = largest(runs.iter().map(|run| run.separation_mm));
    let gaps = || readings.iter().map(|r| r.true_gap_mm);
    let swings: f64 = readings.iter().map(|r| r.preload_swing_n).sum();
    let swing = swings / readings.len().max(1) as f64;
    let times = |values: &[f64]| values[values.len() - 1] / values[0];
    let (speed_times, gap_times) = (times(&gap.experiment.at), times(&gap.simulation));
    let least_hz = LEAST_SPEED_MM_S / rig.drive.ripple_pitch_mm;
    let is_near = |value: f64, wanted: f64, part| (value / wanted - 1.0).abs() < part;
    let asked = preload.1[SPEEDS_MM_S.len() - 1].1;
    let mut kept = [held, faster].map(|gap| percents(apart(gap), 2, ", ")).to_vec();
    kept.extend(fixed(1, [asked]));
    let least_gap = gaps().fold(f64::INFINITY, f64::min);
    let parted = vec![format!("{separation:.3}"), format!("{least_gap:.2}")];
    let grown = vec![format!("{speed_times:.2}"), format!("{gap_times:.3}")];
    let spring = rig.preload.spring_n_per_mm * rig.rig.step_height_mm;
    let swung = vec![format!("{swing:.2}"), format!("{spring:.1}")];
    let mu = rig.plant.mu;
    let gripped = vec![format!("{least_preload_n:.0}"), mu.to_string()];
    let needed = vec![format!("{friction_alone:.2}"), mu.to_string()];
    let is_excited = [CONSTRAINED_HZ, FREE_HZ].into_iter().any(|hz| is_near(least_hz, hz, 0.1));
    let moved = vec![format!("{resonant:.1}"), format!("{at_fastest:.2}")];
    let has_six = runs.iter().all(|run| run.stages == [true; 6]);
    vec![
        ("preload-holds-the-gap", within(apart(held), SAME), kept),
        ("gap-as-on-the-continuous-surface", largest(gaps()) <= separation, parted),
        ("gap-in-proportion-to-speed", is_near(gap_times, speed_times, 0.1), grown),
        ("preload-follows-the-diameter", swing > Noise::usual().preload_sensor_n, swung),
        ("least-preload-100", is_near(*least_preload_n, LEAST_PRELOAD_N, 0.2), gripped),
        ("slip-is-possible", *friction_alone > mu, needed),
        ("least-speed-meets-a-natural-frequency", is_excited, fixed(1, [least_hz])),
        ("resonance-is-worst", *resonant > 5.0 * at_fastest, moved),
        ("six-stages", has_six, Vec::new()),
    ]
}

/// Preload at which `gap` is the wanted one, N: secant steps, from two guesses.
fn secant(
    gap: impl Fn(f64) -> Result<f64, BalanceError>,
    wanted: f64,
    (mut a, mut b): (f64, f64),
) -> Result<f64, BalanceError> {
    let (mut at_a, mut at_b) = (gap(a)? - wanted, gap(b)? - wanted);
    for _ in 0..6 {
        if at_b.abs() < 1e-5 || at_a == at_b {
            break;
        }
        let next = b - at_b * (b - a) / (at_b - at_a);
        (a, at_a) = (b, at_b);
        b = next;
        at_b = gap(b)? - wanted;
    }
    Ok(b)
}

/// Friction that a driven crossing takes at 5 mm/s.
fn friction(rig: &Rig, pressing_n: f64, load_n: f64) -> Result<f64, BalanceError> {
    let of = (rig.control.safe_speed_mm_s, pressing_n, Axial::Driven(load_n));
    let result = cross(&CrossingCase::of(rig, COARSE, of))?;
    Ok(result.mu_needed)
}

/// Preload, N, from which on a wheel of the study's rig grips with the friction that
/// there is.
fn least_preload_n() -> f64 {
    let rig = Rig::fe();
    halved((5.0, 150.0), |preload_n| {
        let case = Case::new(Loads::Fe, rig.control.safe_speed_mm_s, preload_n);
        let needed = friction(&rig, case.pressing_n(0), case.load_n());
        // A wheel that finds no balance does not grip either.
        !needed.is_ok_and(|needed| needed <= rig.plant.mu)
    })
}

/// Friction that the rig's entire top load takes, without the thrust through the arm.
fn friction_alone() -> Result<f64, BalanceError> {
    let rig = Rig::prototype();
    friction(&rig, rig.preload.cruise_n, rig.plant.top_load_n)
}

/// Amplitude of the arm at the wheel under 1 N at this frequency, um.
fn response_um(hz: f64) -> Result<f64, BeamError> {
    Ok(1e6 * Arm::of(&Rig::fe())?.receptance_m_per_n(hz)?.norm())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_secant_finds_the_root() {
        let root = secant(|x| Ok(3.0 - 0.05 * x + 1e-4 * x * x), 1.8, (20.0, 30.0)).unwrap();
        assert!((3.0 - 0.05 * root + 1e-4 * root * root - 1.8).abs() < 1e-5);
    }
}
