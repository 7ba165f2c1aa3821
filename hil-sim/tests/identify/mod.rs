//! Identification from logs: hidden parameters are within their intervals, the command reads
//! the files of a deployment, and the scenario that it writes can be run.

mod hidden;

use std::collections::{BTreeMap, BTreeSet};

use crate::cli::{code, good_in, object, refused_in, rig_in, stderr};
use hidden::Line;
use hil_sim::identify::CALIBRATION;
use hil_sim::identify::published::{self, AMPLITUDE_MM};
use hil_sim::scenario::Scenario;
use hil_sim::testing::long;

#[test]
fn all_hidden_parameters_of_19_rigs_of_20_lie_within_their_intervals() {
    let cases = if long() { 100 } else { 2 };
    let judged = 11..=110_u64;
    assert!(!judged.clone().any(|seed| CALIBRATION.iter().any(|used| used.contains(&seed))));
    let mut lines = BTreeMap::<String, Line>::new();
    for seed in judged.take(cases) {
        hidden::found(seed, |name, of| of(lines.entry(name.to_owned()).or_default()));
    }
    assert_eq!(lines.len(), 19);
    // Two of a hundred rigs have a run that does not start.
    let least = cases - cases / 20;
    assert!(lines.values().all(|line| line.identified >= least), "{lines:#?}");
    let outside: BTreeSet<_> = lines.values().flat_map(|line| &line.outside).collect();
    assert!(20 * outside.len() <= cases, "{outside:?}: {lines:#?}");
    let tread = Scenario::default().rig.tread;
    let values = [tread.k_inf_pa_per_m, tread.stiffening, tread.tau_s];
    for (name, value) in ["k_inf_pa_per_m", "stiffening", "tau_s"].into_iter().zip(values) {
        let line = lines.get_mut(&format!("tread.{name}")).expect(name);
        assert!(line.worst_rel < 0.05, "{name}: {line:?}");
        // An interval that holds everything says nothing.
        line.half_widths.sort_by(f64::total_cmp);
        let median = line.half_widths[line.half_widths.len() / 2];
        assert!(median < 0.06 * value, "{name}: {line:?}");
    }
}

/// Least squares of three gaps: better than the presets' tread by the same ring, and the
/// gaps within 2.5 %.
#[test]
fn three_published_gaps_are_met_as_far_as_the_ring_can() {
    let scenario = Scenario::default();
    let square = |tread: &published::Tread| {
        tread.residuals_mm.iter().zip(AMPLITUDE_MM).map(|(r, gap)| (r / gap).powi(2)).sum::<f64>()
    };
    // A coarse ring, about as coarse as the one that the presets' tread was fitted with.
    let fineness = (720, 0.05);
    let fitted = published::fit(&scenario, fineness, false).unwrap();
    let stated = published::stated(&scenario, fineness).unwrap();
    for (residual, gap) in fitted.residuals_mm.iter().zip(AMPLITUDE_MM) {
        assert!((residual / gap).abs() < 0.025, "{fitted:?}");
    }
    assert!(square(&fitted) < square(&stated), "{fitted:?} {stated:?}");
    // With one of the three given, the other two come out near the presets'.
    let held = published::fit(&scenario, fineness, true).unwrap();
    let ratios = [
        held.k_inf_pa_per_m / stated.k_inf_pa_per_m,
        held.stiffening / stated.stiffening,
        held.tau_s / stated.tau_s,
    ];
    assert!((ratios[1] - 1.0).abs() < 1e-6, "{held:?}");
    assert!(ratios.iter().all(|ratio| (0.9..1.1).contains(ratio)), "{held:?}");
    assert!(square(&held) < square(&stated) && square(&held) > square(&fitted));
}

/// Logs of two rigs gave a friction between both with a narrow interval.
#[test]
fn logs_of_two_rigs_are_refused_and_the_odd_one_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let log = |name: &str, more: &[&str]| {
        good_in(at, &[&["deploy", "--out", name], more].concat());
        format!("{name}/log.mcap")
    };
    let light = ["--controller", "constant", "--set", "preload.cruise_n=25"];
    let one = log("one", &["--seed", "9"]);
    let of_one = log("of-one", &[&["--seed", "9"], &light[..]].concat());
    let odd = log("odd", &["--seed", "4"]);
    refused_in(at, &["identify", &one, &of_one, &odd], &["odd/log.mcap: not of the rig"]);
    // The same sleeve, less friction; the same contact, another pre-tightener.
    let nominal = log("nominal", &[]);
    for set in ["plant.mu=0.85", "preload.slew_n_per_s=28"] {
        let other = log("other", &["--set", set]);
        refused_in(at, &["identify", &nominal, &other], &["not of the rig of the other logs"]);
    }
    good_in(at, &["identify", &one, &of_one]);
    // A log is accepted; a reading of the first one, or rubber that it was not told of, is not.
    let judged = |logs: &[&str]| object(&rig_in(at, &[&["accept", "--json"], logs].concat()));
    let back = log("back", &["--retract"]);
    assert_eq!(judged(&[&nominal, &back, "--gap", "2=2.63"])["passed"], true);
    let wide = judged(&[&nominal, &back, "--gap", "2=2.8"]);
    let off = wide["gap"].as_array().unwrap().iter().filter(|gap| gap["ok"] == false).count();
    assert!(wide["passed"] == false && off == 1, "{wide}");
    let soft = judged(&[&log("soft", &["--set", "mismatch.tread_stiffness=0.85"])]);
    assert_eq!(soft["residuals"][0]["ok"], false, "{soft}");
    refused_in(at, &["accept", &back, "--gap", "7=2.6"], &["--gap: step 7"]);
    // How far off a run began that begins pressed, no step shows: 0.25 mm, one sigma.
    let of_back = object(&rig_in(at, &["identify", "--json", &back]));
    let mut all = of_back["parameters"].as_array().unwrap().iter();
    let place = all.find(|of| of["name"] == "rig.step_positions_mm[2]").unwrap();
    let [low, high] = ["low", "high"].map(|end| place[end].as_f64().unwrap());
    assert!(high - low > 6.0 * 0.25 && low < 40.0 && 40.0 < high, "{place}");
}

#[test]
fn a_log_that_lacks_something_is_identified_with_a_word_and_exit_code_1() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    assert_eq!(code(&rig_in(at, &["deploy", "--out", "run"])), 0);
    let bytes = std::fs::read(at.join("run/log.mcap")).unwrap();
    std::fs::write(at.join("cut.mcap"), &bytes[..bytes.len() * 9 / 10]).unwrap();
    let table = std::fs::read_to_string(at.join("run/log.csv")).unwrap();
    let lossy: Vec<&str> =
        table.lines().enumerate().filter(|(n, _)| *n != 3000).map(|(_, line)| line).collect();
    std::fs::write(at.join("lossy.csv"), lossy.join("\n") + "\n").unwrap();
    let described = std::fs::read(at.join("run/log.csv-metadata.json")).unwrap();
    std::fs::write(at.join("lossy.csv-metadata.json"), described).unwrap();
    for (log, what) in [("cut.mcap", "cut off"), ("lossy.csv", "1 tick missing")] {
        let output = rig_in(at, &["identify", log, "--json"]);
        assert_eq!(code(&output), 1, "{log}: {}", stderr(&output));
        let notes = object(&output)["notes"].to_string();
        assert!(notes.contains(&format!("{log}: ")) && notes.contains(what), "{notes}");
    }
}

#[test]
fn the_command_reads_what_deployments_leave_and_writes_what_one_can_run() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let runs: [(&str, &[&str]); 2] = [
        ("fast", &["--seed", "4"]),
        ("light", &["--seed", "4", "--controller", "constant", "--set", "preload.cruise_n=25"]),
    ];
    for (name, arguments) in runs {
        good_in(at, &[&["deploy", "--out", name], arguments].concat());
    }
    let output =
        good_in(at, &["identify", "fast/log.mcap", "light/log.mcap", "--out", "found", "--json"]);
    let found = object(&output);
    assert!(found["degrees_of_freedom"].as_u64().unwrap() > 1000);
    assert!(found["residuals"].as_array().unwrap().len() == 8, "{found}");
    let parameters = found["parameters"].as_array().unwrap();
    let parameter = |name: &str| {
        parameters.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("{name}"))
    };
    let k = parameter("tread.k_inf_pa_per_m");
    assert!(k["identified"].as_bool().unwrap(), "{k}");
    let [low, value, high] = ["low", "value", "high"].map(|key| k[key].as_f64().unwrap());
    assert!(low < value && value < high, "{k}");
    for file in found["files"].as_array().unwrap() {
        assert!(at.join(file.as_str().unwrap()).is_file(), "{file}");
    }
    good_in(at, &["deploy", "found/identified.toml", "--no-files", "--json"]);
}
