//! The gates behind the first power-up, which logs prove: first crossing, identification,
//! acceptance; and what a rig still lacks.

use std::error::Error;
use std::path::Path;

use super::{Check, GATES, Progress, Stage, row};
use crate::files::write_text;
use crate::identify::result::BY;
use crate::record::Summary;
use crate::scenario::Scenario;

/// Files in the folder of a rig: how far it has come, and its parameters.
pub(crate) const STATE: &str = "bringup.json";
pub(crate) const MINE: &str = "mine.toml";
/// The folder, where none is named.
pub(crate) const FOLDER: &str = "out/bringup";

/// Fastest cruise of a first crossing, mm/s.
const SLOW_MM_S: f64 = 5.0;

/// Whether a log is that of a first crossing.
pub(crate) fn crossed(run: &Summary, scenario: &Scenario) -> Check {
    let (steps, lines) = (scenario.rig.rig.step_positions_mm.len(), &run.crossings);
    let cruise = scenario.rig.drive.cruise_speed_mm_s;
    let slips = lines.iter().filter_map(|line| line.slip_measured_mm);
    let slip = slips.map(f64::abs).fold(0.0, f64::max);
    let arrives = run.completed && run.faults.is_empty() && lines.len() == steps;
    let slips = (arrives && cruise <= SLOW_MM_S).then_some(slip);
    let fault = run.faults.first().map_or(String::new(), |fault| format!("; {}", fault.text));
    let of = lines.len();
    let measured = format!("{of} of {steps} steps, {cruise:.1} mm/s, slip {slip:.2} mm{fault}");
    let advice = "deploy at drive.cruise_speed_mm_s = 5 over every step";
    row::FIRST_CROSSING.by(slips, measured, advice)
}

/// Whether complete logs have shown tread and friction.
pub(crate) fn identified(scenario: &Scenario, is_complete: bool) -> Check {
    let wanted = ["tread.k_inf_pa_per_m", "tread.stiffening", "tread.tau_s", "plant.mu"];
    let by_logs = |key: &&str| scenario.sources.get(*key).is_some_and(|by| by.contains(BY));
    let shown: Vec<&str> = wanted.into_iter().filter(by_logs).collect();
    let ok = is_complete && shown.len() == wanted.len();
    let advice = "give three complete logs, at 0.75, 1 and 1.25 times the cruise preload";
    row::IDENTIFIED.check(ok, format!("shown: {}", shown.join(", ")), advice)
}

/// That a rig is what its parameters say, or the first reason why not.
pub(crate) fn accepted(reasons: &[String]) -> Check {
    let measured = reasons.first().map_or("as its parameters say", String::as_str).to_owned();
    row::ACCEPTED.check(reasons.is_empty(), measured, "`rig accept` names every reason")
}

/// Records a gate in this folder, with the parameters that it has found. The log's controller had
/// `logged`; none of it may contradict what the folder knows.
///
/// # Errors
/// A sentence: the folder has no power-up, the log is another rig's, or it cannot be written.
pub(crate) fn record(
    folder: &Path,
    stage: Stage,
    found: Check,
    logged: &Scenario,
    merged: Option<&Scenario>,
) -> Result<Progress, Box<dyn Error>> {
    let path = folder.join(STATE);
    let mut progress = Progress::open(&path)
        .ok_or_else(|| format!("{}: no power-up of a rig: `rig bringup`", path.display()))?;
    let (ours, its) = (progress.proposed.keys(), logged.keys());
    // Identification replaces what it finds: it needs the sensors alone.
    let counts = |key: &String| {
        progress.proposed.sources.contains_key(key)
            && (merged.is_none() || key.starts_with("sense."))
    };
    let mut pairs = ours.iter().zip(&its).filter(|(ours, _)| counts(&ours.key));
    if let Some((ours, its)) = pairs.find(|(ours, its)| ours.value != its.value) {
        let (key, folder) = (&ours.key, folder.display());
        return Err(format!(
            "the log had {key} = {}, the rig in {folder} has {}",
            its.value, ours.value
        )
        .into());
    }
    let ok = found.ok;
    progress.add(stage, vec![found]);
    if let Some(merged) = merged.filter(|_| ok) {
        // Another rig is to be accepted again.
        progress.forget(Stage::Acceptance);
        progress.proposed = with(&progress.proposed, merged)?;
    }
    progress.write(&path)?;
    write_text(&folder.join(MINE), &progress.proposed.to_toml())?;
    Ok(progress)
}

/// The rig with each value of which another has the source.
fn with(rig: &Scenario, other: &Scenario) -> Result<Scenario, crate::scenario::ScenarioError> {
    let values = other.keys().into_iter().filter(|of| other.sources.contains_key(&of.key));
    let sets: Vec<String> = values.map(|of| format!("{}={}", of.key, of.value)).collect();
    let mut merged = rig.clone().with(&sets)?;
    merged.sources.extend(other.sources.clone());
    Ok(merged)
}

/// What the rig of this scenario file lacks, in a sentence: that of its folder, or of the usual one.
/// None if it has passed every gate.
pub(crate) fn lacking(file: Option<&Path>) -> Option<String> {
    let beside = file.and_then(Path::parent).filter(|at| at.join(STATE).exists());
    let folder = beside.unwrap_or(Path::new(FOLDER));
    let Some(progress) = Progress::open(&folder.join(STATE)) else {
        return Some(format!("no first power-up in {}: `rig bringup`", folder.display()));
    };
    let missing = GATES.iter().filter(|gate| !progress.is_done(gate.stage));
    let names = missing.map(|gate| gate.name).collect::<Vec<_>>().join(", ");
    (!names.is_empty()).then(|| format!("gates not passed: {names} ({})", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::CrossingLine;

    #[test]
    fn gates_are_recorded_for_their_rig_alone_and_keys_merge_with_their_sources() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let passed = || accepted(&[]);
        let mut rig = Scenario::default();
        assert!(record(folder, Stage::Crossing, passed(), &rig, None).is_err());
        assert!(lacking(None).unwrap().starts_with("no first power-up in out/bringup"));
        let mut progress = Progress::new(rig.clone());
        progress.proposed.rig.sense.preload_full_scale_n = 199.5;
        let by = "198.5 to 200.5, first power-up, by two weights".to_owned();
        progress.proposed.sources.insert("sense.preload_full_scale_n".to_owned(), by.clone());
        progress.write(&folder.join(STATE)).unwrap();
        let other = record(folder, Stage::Crossing, passed(), &rig, None).unwrap_err().to_string();
        assert!(other.contains("preload_full_scale_n = 200"), "{other}");
        rig.rig.sense.preload_full_scale_n = 199.5;
        for stage in [Stage::Acceptance, Stage::Crossing] {
            record(folder, stage, passed(), &rig, None).unwrap();
        }
        assert!(
            lacking(Some(&folder.join(MINE)))
                .unwrap()
                .ends_with(&format!("friction, identification ({})", folder.display()))
        );
        rig.rig.plant.mu = 0.93;
        rig.sources.insert("plant.mu".to_owned(), format!("0.9 to 0.96{BY}a"));
        let found = record(folder, Stage::Identification, passed(), &rig, Some(&rig)).unwrap();
        assert!(!found.is_done(Stage::Acceptance) && found.is_done(Stage::Crossing));
        let mine = std::fs::read_to_string(folder.join(MINE)).unwrap();
        let mine = Scenario::parse(MINE, &mine, &[]).unwrap();
        assert_eq!((mine.rig.plant.mu, &mine.sources["sense.preload_full_scale_n"]), (0.93, &by));
        assert!(!identified(&mine, true).ok, "the tread is missing");
        for key in ["k_inf_pa_per_m", "stiffening", "tau_s"] {
            rig.sources.insert(format!("tread.{key}"), format!("1 to 2{BY}a"));
        }
        assert!(identified(&rig, true).ok && !identified(&rig, false).ok);
    }

    #[test]
    fn a_first_crossing_is_slow_and_without_fault_or_slip() {
        let mut rig = Scenario::default();
        // The tread runs faster around an edge than the axle.
        let line = CrossingLine { speed_mm_s: 6.9, ..CrossingLine::default() };
        let good = Summary { completed: true, crossings: vec![line; 3], ..Summary::default() };
        assert!(!crossed(&good, &rig).ok, "fast");
        rig.rig.drive.cruise_speed_mm_s = 5.0;
        assert!(crossed(&good, &rig).ok);
        let spoilt: [fn(&mut Summary); 3] = [
            |run| run.completed = false,
            |run| run.crossings.truncate(2),
            |run| run.crossings[2].slip_measured_mm = Some(-0.8),
        ];
        for spoil in spoilt {
            let mut run = good.clone();
            spoil(&mut run);
            assert!(!crossed(&run, &rig).ok);
        }
    }
}
