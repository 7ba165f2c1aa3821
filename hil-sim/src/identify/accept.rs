//! Acceptance: logs of a rig against the virtual rig with the parameters that the controller had.

use interstage::rig::Rig;
use serde::Serialize;
use toml::Table;

use super::IdentifyError;
use super::coordinates::{FRICTION, LOAD, STIFFENING, STIFFNESS, TAU};
use super::forward::{CHANNELS, quotient};
use super::least_squares::Noise;
use super::record::Record;
use super::result::{Fit, Identification, Parameter, WITHIN, fitted, place_of};
use crate::record::Summary;
use crate::scenario::Scenario;
use crate::table::number;

/// Part of the gap by which two ways of knowing it may differ: the verdict's tolerance.
const GAP: f64 = 0.03;

/// Slip that a sound run does not have, as the controller measures it, mm.
const SLIP_MM: f64 = 0.5;

/// How far a quantity of the logs may be from the virtual rig's, root mean square. Sound rigs leave
/// 0.001 mm, 0.1 mrad, 0.12 N and 0.02 N; one key of load, friction or tread at its limit leaves up
/// to 0.025 mm, 0.26 mrad and 0.55 N. Chosen above both: what several keys leave that are off alike.
const RESIDUALS: [(&str, f64); 4] =
    [("compression", 0.03), ("arm angle", 1.5), ("drive effort", 1.5), ("preload", 0.2)];

/// How far what the logs show may be from what the controller was told.
enum Limit {
    /// Part of the stated value.
    Part(f64),
    /// In the key's unit.
    Of(f64),
    /// The first: part by which it may be less than stated. The second: part of the stated value that
    /// it must exceed, by 19 to 1. How much more there is hardly shows, and costs no grip.
    Less(f64, f64),
}

impl Limit {
    /// The limit in the key's unit, and whether a parameter keeps it that is to be `off` what is stated.
    fn judge(&self, of: &Parameter, stated: f64, off: f64) -> (f64, bool) {
        let limit = match self {
            Self::Part(part) => part * stated.abs(),
            Self::Of(limit) => *limit,
            Self::Less(part, surely) => {
                let low = of.low.map_or(0.0, |low| low / of.value);
                let least = of.value * low.powf(ONE_SIDED / WITHIN);
                let ok = of.value >= (1.0 - part) * stated && least > surely * stated;
                return (part * stated, ok);
            }
        };
        // The drive's force is known by its tolerance, another key by an interval within its limit.
        let within = of.high.zip(of.low).is_some_and(|(high, low)| high - low <= 2.0 * limit);
        let is_known = of.identified || within || of.name == DRIVE;
        (limit, is_known && (of.value - off - stated).abs() <= limit)
    }
}

/// Name of what is told over nominal.
const DRIVE: &str = "drive force over nominal";

/// Start of the names of the steps' places.
const PLACES: &str = "rig.step_positions_mm";
/// How far from its end a run arrives at most, mm.
const ARRIVES_MM: f64 = 0.5;

/// Standard deviations below which a value lies one time in 20.
const ONE_SIDED: f64 = 1.64;

/// By the start of the name. At its limit a tread's key changes the gap by 1 %, a height by 3 %, the
/// load changes the friction needed by 3 % (`rig crossing` at 10 mm/s and 47.6 N). Friction: two sigma
/// of what two logs show of sound rigs, a quarter less excluded. Places: what the end of travel has.
/// Dead time and lag: half a newton at full rate. Rate, spring and drive: chosen, so that a scale of the
/// preload sensor 10 % off, which shows in all of them and in the tread, exceeds one at least.
const LIMITS: [(&str, Limit); 12] = [
    ("tread.k_inf_pa_per_m", Limit::Part(0.06)),
    ("tread.stiffening", Limit::Part(0.08)),
    ("tread.tau_s", Limit::Part(0.2)),
    ("plant.mu", Limit::Less(0.1, 0.75)),
    ("plant.top_load_n", Limit::Part(0.1)),
    (DRIVE, Limit::Part(0.04)),
    (PLACES, Limit::Of(ARRIVES_MM)),
    ("rig.step_height_mm", Limit::Of(0.1)),
    ("preload.delay_s", Limit::Of(0.02)),
    ("preload.lag_s", Limit::Of(0.02)),
    ("preload.slew_n_per_s", Limit::Part(0.06)),
    ("preload.spring_n_per_mm", Limit::Part(0.06)),
];

/// A quantity of the logs beside the virtual rig's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Residual {
    pub quantity: &'static str,
    pub unit: &'static str,
    /// Root mean square of the difference.
    pub rms: f64,
    pub limit: f64,
    pub ok: bool,
}

/// A parameter as stated and as the logs show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Key {
    #[serde(flatten)]
    pub found: Parameter,
    pub stated: f64,
    /// Largest difference; of friction, how much less it may be.
    pub limit: f64,
    pub ok: bool,
}

/// The gap of a crossing by two ways.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gap {
    pub log: String,
    /// Number of the step, from 1.
    pub step: usize,
    /// By the controller; none if it did not measure it.
    pub measured_mm: Option<f64>,
    /// By another way; none if the ring did not cross there.
    pub independent_mm: Option<f64>,
    /// What that is: `reading`, typed in, or `ring`, the virtual rig's tread driven by the log.
    pub by: Option<&'static str>,
    pub ok: bool,
}

/// The result.
#[derive(Clone, Debug, Serialize)]
pub struct Acceptance {
    pub passed: bool,
    pub residuals: Vec<Residual>,
    pub keys: Vec<Key>,
    pub gap: Vec<Gap>,
    /// What speaks against it, in sentences.
    pub reasons: Vec<String>,
}

/// Compares logs of one rig with the parameters in them. `readings` are gaps of the first log by a
/// camera or a feeler gauge: step, from 1, and mm.
pub fn accept(
    records: &[Record],
    runs: &[Summary],
    readings: &[(usize, f64)],
) -> Result<Acceptance, IdentifyError> {
    let first = records.first().ok_or_else(|| IdentifyError::NoFit("there are no logs".into()))?;
    let chosen = |rig: &Rig| {
        let mut rig = rig.clone();
        (rig.preload.cruise_n, rig.drive.cruise_speed_mm_s) = Default::default();
        rig
    };
    let its = chosen(&first.scenario.rig);
    if let Some(other) = records.iter().find(|other| chosen(&other.scenario.rig) != its) {
        let why = format!("its controller had other parameters than that of {}", first.name);
        return Err(IdentifyError::Log(other.name.clone(), why));
    }
    let (found, fit) = fitted(records, &first.scenario)?;
    let mut reasons = found.notes[..records.iter().map(|of| of.missing.len()).sum()].to_vec();
    reasons.extend(records.iter().zip(runs).filter_map(|(record, run)| {
        let fault = run.faults.first().map(|fault| fault.text.clone());
        let short = (!run.completed).then(|| "it did not complete".to_owned());
        Some(format!("{}: {}", record.name, fault.or(short)?))
    }));
    for (record, run) in records.iter().zip(runs) {
        let slips = run.crossings.iter().filter_map(|line| Some((line, line.slip_measured_mm?)));
        reasons.extend(slips.filter(|(_, slip)| slip.abs() > SLIP_MM).map(|(line, slip)| {
            format!("{}: slipped by {slip:.2} mm at step {}", record.name, line.index)
        }));
    }
    reasons.extend(fit.agree(records).err().map(|error| error.to_string()));
    let off = fit.starts_off(&first.scenario);
    let residuals = residuals(&found, &fit, off)?;
    let keys = keys(&found, &first.scenario, off);
    let gap = gaps(records, runs, &fit, readings);
    let off = residuals
        .iter()
        .filter(|of| !of.ok)
        .map(|of| format!("{}: {:.3} {} from the virtual rig's", of.quantity, of.rms, of.unit));
    reasons.extend(off);
    let off = keys.iter().filter(|of| !of.ok).map(|Key { found, stated, .. }| {
        let [value, stated] = [found.value, *stated].map(brief);
        format!("{}: {value} {} in the logs, {stated} stated", found.name, found.unit)
    });
    reasons.extend(off);
    let off = gap.iter().filter(|of| !of.ok);
    reasons.extend(off.map(|of| format!("{}: the gap at step {}", of.log, of.step)));
    Ok(Acceptance { passed: reasons.is_empty(), residuals, keys, gap, reasons })
}

/// A number as a table shows it.
pub(crate) fn brief(value: f64) -> String {
    if value.abs() >= 1e4 { format!("{value:.3e}") } else { number(value, 3) }
}

/// What the virtual rig with the stated parameters leaves, all its steps this far off, mm; sensors and wheel within their
/// tolerances, as found. The preload is the pre-tightener's as found: its keys are judged.
fn residuals(found: &Identification, fit: &Fit, off: f64) -> Result<Vec<Residual>, IdentifyError> {
    let mut x = fit.contact.x.clone();
    let stated =
        [STIFFNESS, STIFFENING, TAU, FRICTION, LOAD].into_iter().chain(fit.coordinates.of_steps());
    for index in stated {
        x[index] = fit.coordinates.priors()[index].mean;
    }
    for step in 0..fit.coordinates.steps() {
        x[fit.coordinates.position(step)] += off;
    }
    let mut left: [Vec<f64>; 3] = Default::default();
    for run in &fit.runs {
        let at = run
            .simulate(&fit.coordinates, &x)
            .map_err(|error| IdentifyError::Log(run.name.clone(), error.to_string()))?;
        let remaining = quotient(&run.predicted(&at, &x), &run.measured(), 1.0);
        left.iter_mut().zip(remaining).for_each(|(left, of)| left.extend(of));
    }
    let preload = found.residuals.iter().filter(|of| of.channel == "preload");
    let preload: Vec<f64> =
        preload.flat_map(|of| of.series.iter().map(|(_, left)| *left)).collect();
    let units = CHANNELS.map(|(_, unit)| unit).into_iter().chain(["N"]);
    let rows = left.into_iter().chain([preload]).zip(RESIDUALS).zip(units);
    let row = |((values, (quantity, limit)), unit): ((Vec<f64>, _), _)| {
        let rms = Noise::of(&values).deviation;
        Residual { quantity, unit, rms, limit, ok: rms <= limit }
    };
    Ok(rows.map(row).collect())
}

fn keys(found: &Identification, scenario: &Scenario, off: f64) -> Vec<Key> {
    let mut table = Table::try_from(scenario).expect("a scenario is always TOML");
    let mut key = |of: &Parameter| {
        let (_, limit) = LIMITS.iter().find(|(name, _)| of.name.starts_with(name))?;
        let stated = place_of(&mut table, &of.name).map_or(Some(1.0), |value| value.as_float())?;
        let off = if of.name.starts_with(PLACES) { off } else { 0.0 };
        let (limit, ok) = limit.judge(of, stated, off);
        Some(Key { found: of.clone(), stated, limit, ok })
    };
    found.parameters.iter().filter_map(&mut key).collect()
}

impl Fit {
    /// How far all steps are off that logs show which begin where an earlier run arrived, mm: their
    /// starts are. Of a log that begins stowed it is none.
    fn starts_off(&self, scenario: &Scenario) -> f64 {
        let stated = &scenario.rig.rig.step_positions_mm;
        let (of, x) = (&self.coordinates, &self.contact.x);
        if stated.is_empty() || self.runs.iter().any(|run| !run.traces.is_loaded()) {
            return 0.0;
        }
        let steps = stated.iter().enumerate();
        together(steps.map(|(step, at)| of.scale(x) * x[of.position(step)] - at).collect())
    }
}

/// Part of these distances, mm, that one start explains.
fn together(off_mm: Vec<f64>) -> f64 {
    let mean = off_mm.iter().sum::<f64>() / off_mm.len() as f64;
    mean.clamp(-ARRIVES_MM, ARRIVES_MM)
}

/// Every crossing's gap by a second way: a reading if there is one, else the ring that followed the
/// log, its tread as the logs show it. A gap over the reference is none to accept.
fn gaps(records: &[Record], runs: &[Summary], fit: &Fit, readings: &[(usize, f64)]) -> Vec<Gap> {
    let mut all = Vec::new();
    let readings = std::iter::once(readings).chain(std::iter::repeat(&[][..]));
    let logs = records.iter().zip(runs).zip(&fit.contact.trajectories);
    for (((record, run), at), readings) in logs.zip(readings) {
        for line in &run.crossings {
            let step = usize::from(line.index);
            let of_step = |(of, _): &&(usize, f64)| *of == step;
            let reading = readings.iter().find(of_step).map(|of| (of.1, "reading"));
            let ring = at.gaps_mm.iter().find(of_step).map(|of| (of.1, "ring"));
            let (independent_mm, by) = reading.or(ring).unzip();
            let measured_mm = line.gap_measured_mm;
            let ok = measured_mm.zip(independent_mm).is_some_and(|(measured, other)| {
                (measured - other).abs() <= GAP * other && measured <= (1.0 + GAP) * run.gap_ref_mm
            });
            let log = record.name.clone();
            all.push(Gap { log, step, measured_mm, independent_mm, by, ok });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_refused_off_its_limit() {
        let of = |limit: &Limit, value: f64, half: f64, identified: bool| {
            let (name, low, high) = (String::new(), Some(value - half), Some(value + half));
            let found =
                Parameter { name, unit: "", value, low, high, identified, by: String::new() };
            limit.judge(&found, 1.0, 0.0).1
        };
        for (value, within) in [(0.85, false), (0.9, true), (1.1, true), (1.3, false)] {
            let ok = [Limit::Part(0.12), Limit::Of(0.12)].map(|limit| of(&limit, value, 0.1, true));
            assert_eq!(ok, [within; 2], "{value}");
        }
        // Of friction, less is refused, and what is not known to be more than a quarter less.
        let less = Limit::Less(0.1, 0.75);
        for (value, half, ok) in [
            (0.89, 0.01, false),
            (0.91, 0.2, true),
            (0.91, 0.4, false),
            (1.0, 0.4, true),
            (1.0, 0.6, false),
            (1.5, 0.4, true),
        ] {
            assert_eq!(of(&less, value, half, false), ok, "{value} {half}");
        }
        // One that the logs do not show says nothing.
        assert!(
            !of(&Limit::Part(0.12), 1.0, 0.2, false) && of(&Limit::Part(0.12), 1.0, 0.1, false)
        );
    }

    #[test]
    fn a_start_explains_what_all_steps_are_off_and_no_more_than_a_run_arrives_off() {
        let left = |off: [f64; 3]| {
            let start = together(off.to_vec());
            off.map(|off| (off - start).abs()).into_iter().fold(0.0, f64::max)
        };
        for (off, ok) in [
            ([-0.7, -0.65, -0.6], true),
            ([0.9; 3], true),
            ([2.0; 3], false),
            ([-2.0; 3], false),
            ([0.0, 1.0, 0.0], false),
            ([0.0, -1.0, 0.0], false),
        ] {
            assert_eq!(left(off) <= ARRIVES_MM, ok, "{off:?}");
        }
    }
}
