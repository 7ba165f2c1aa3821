//! The pages that a user reads: their commands, links, drawings and examples.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use hil_sim::testing::long;
use serde_json::Value;

use crate::cli::{code, folder, good_in, json, object, rig_in, stderr};
use crate::common::python::python;

/// Verbs that another program of the workspace runs; the command's own help lists them.
const ELSEWHERE: [&str; 3] = ["bench", "modes", "paper"];

/// Bound of the words of all pages, without code and tables: more than an hour's reading helps
/// nobody to find the sentence that is needed.
const MOST_WORDS: usize = 15_000;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the workspace")
}

/// README, `docs/*.md` and the examples' page, with their places.
fn pages() -> Vec<(PathBuf, String)> {
    let root = root();
    let docs = fs::read_dir(root.join("docs")).expect("docs").map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> =
        docs.filter(|path| path.extension().is_some_and(|ending| ending == "md")).collect();
    paths.extend([root.join("README.md"), root.join("examples/README.md")]);
    paths.sort();
    let page = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("a page");
        (path, text)
    };
    paths.into_iter().map(page).collect()
}

/// Every `cargo rig ...` of a page, up to the end of the code or of the line.
fn commands(text: &str) -> Vec<&str> {
    let starts = text.split("cargo rig ").skip(1);
    starts.map(|rest| rest.split(['`', '\n', '#', '|']).next().unwrap_or_default().trim()).collect()
}

/// What `rig ARGUMENTS --help` prints.
fn help(arguments: &[&str]) -> String {
    let output = good_in(&root(), &[arguments, &["--help"]].concat());
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Whether a text has this word, alone or before `=`, `,` or a blank.
fn has_word(text: &str, word: &str) -> bool {
    text.split(|c: char| c.is_whitespace() || "=,[]`".contains(c)).any(|found| found == word)
}

#[test]
fn every_command_of_the_pages_exists_with_its_options() {
    let verbs = help(&[]);
    let mut helps: BTreeMap<String, String> = BTreeMap::new();
    let mut seen = 0;
    for (path, text) in pages() {
        for command in commands(&text) {
            let shown = format!("{}: cargo rig {command}", path.display());
            let words: Vec<&str> = command.split_whitespace().take_while(|w| *w != "--").collect();
            let (Some(verb), options) =
                (words.first(), words.iter().filter(|w| w.starts_with("--")))
            else {
                panic!("{shown}: no verb");
            };
            assert!(
                verbs.lines().any(|line| line.split_whitespace().next() == Some(verb)),
                "{shown}"
            );
            seen += 1;
            if ELSEWHERE.contains(verb) {
                continue;
            }
            let mut place = vec![*verb];
            if *verb == "params" {
                place.extend(words.get(1).filter(|word| !word.starts_with('-')));
            }
            let known = helps.entry(place.join(" ")).or_insert_with(|| help(&place));
            for option in options {
                let option = option.split('=').next().unwrap_or_default();
                assert!(has_word(known, option), "{shown}: no {option}");
            }
        }
    }
    assert!(seen > 60, "{seen} commands");
}

#[test]
fn the_first_deployment_s_page_names_what_to_measure() {
    let page = fs::read_to_string(root().join("docs/GETTING_STARTED.md")).expect("the page");
    let listed = object(&good_in(&root(), &["keys", "--json"]));
    let keys = listed["keys"].as_array().expect("keys");
    let name = |key: &Value| key["key"].as_str().expect("a name").to_owned();
    let measured: Vec<String> =
        keys.iter().filter(|key| key["measure"] == true).map(name).collect();
    assert!(measured.len() > 20, "{measured:?}");
    for key in measured {
        assert!(page.contains(&format!("`{key}`")), "{key}");
    }
}

/// Words of a page outside code and rows of tables.
fn words(text: &str) -> usize {
    let mut in_code = false;
    let lines = text.lines().filter(|line| {
        let is_fence = line.trim_start().starts_with("```");
        in_code ^= is_fence;
        !(in_code || is_fence || line.starts_with('|'))
    });
    lines.map(|line| line.split_whitespace().count()).sum()
}

#[test]
fn the_pages_stay_readable_in_an_hour() {
    assert_eq!(words("two words\n| a row |\n```sh\ncode\n```\nthree more words"), 5);
    let study = root().join("docs/paper/README.md");
    let study = (study.clone(), fs::read_to_string(study).expect("the study's page"));
    let counts: Vec<(usize, PathBuf)> =
        pages().into_iter().chain([study]).map(|(path, text)| (words(&text), path)).collect();
    let sum: usize = counts.iter().map(|(count, _)| count).sum();
    assert!(sum < MOST_WORDS, "{sum} words, at most {MOST_WORDS}: {counts:?}");
    assert!(sum > MOST_WORDS / 2, "{sum} words: are these the pages?");
}

/// The anchor that a heading gets: lower case, without punctuation, hyphens for blanks.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn every_link_of_the_pages_leads_somewhere() {
    let mut seen = 0;
    for (path, text) in pages() {
        let links = text.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
        for (link, _) in links.filter(|(link, _)| !link.starts_with("http")) {
            let shown = format!("{}: {link}", path.display());
            let (file, place) = link.split_once('#').unwrap_or((link, ""));
            let there =
                if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            assert!(there.exists(), "{shown}: no such file");
            if !place.is_empty() {
                let target = fs::read_to_string(&there).expect("a page");
                let mut headings = target.lines().filter(|line| line.starts_with('#'));
                assert!(
                    headings.any(|heading| anchor(heading) == place),
                    "{shown}: no such heading"
                );
            }
            seen += 1;
        }
    }
    assert!(seen > 100, "{seen} links");
}

#[test]
fn the_drawings_are_what_their_script_writes() {
    let docs = root().join("docs");
    let folder = tempfile::tempdir().expect("a temporary directory");
    let output = Command::new("python3")
        .arg(docs.join("drawings.py"))
        .arg(folder.path())
        .output()
        .expect("python3 starts");
    assert!(output.status.success(), "{}", stderr(&output));
    let mut seen = 0;
    for entry in fs::read_dir(folder.path()).expect("the drawings") {
        let made = entry.unwrap().path();
        let name = made.file_name().unwrap();
        let kept = fs::read_to_string(docs.join(name)).expect("a committed drawing");
        let same = fs::read_to_string(&made).unwrap() == kept;
        assert!(same, "{name:?}: run `python3 docs/drawings.py`");
        let name = name.to_str().unwrap();
        assert!(pages().iter().any(|(_, text)| text.contains(&format!("]({name})"))), "{name}");
        seen += 1;
    }
    assert_eq!(seen, 5);
}

/// The tables of the results, and the README's, are what `figures.sh` wrote.
#[test]
fn the_results_are_those_of_the_figures() {
    let page = |path: &str| fs::read_to_string(root().join(path)).expect("a page");
    let [results, readme, safety] = ["docs/RESULTS.md", "README.md", "docs/SAFETY.md"].map(page);
    let script = page("docs/figures.sh");
    let read = |name: &str| json(&root().join(format!("docs/figures/{name}.json")));
    let number = |value: &Value| value.as_f64().expect("a number");
    for (name, direction) in [("montecarlo", "deploy"), ("montecarlo-retract", "retract")] {
        let found = read(name);
        let shown = |key: &str, parts: &[&str], n: usize| {
            let parts = parts.iter().map(|part| format!("{:.n$}", number(&found[key][part])));
            parts.collect::<Vec<_>>().join(" / ")
        };
        let seed = found["worst_gap_seed"].as_u64().expect("a seed") / 10_000 * 10_000;
        assert!(script.contains(&format!("--seed {seed}")), "{seed}");
        let (all, far) = (["p50", "p95", "max"], ["p95", "max"]);
        let [time, gap] = [("duration_s", 2), ("gap_over_ref", 3)].map(|(k, n)| shown(k, &all, n));
        let (margin, end) = (shown("slip_margin", &["min"], 3), shown("end_off_mm", &far, 2));
        let [done, of, slips] = ["completed", "runs", "slip_events"].map(|key| &found[key]);
        let row = format!(
            "`--seed {seed}` | {done} of {of} | {slips} | {time} | {gap} | {margin} | {end} |"
        );
        assert!(results.contains(&format!("| {direction}, {row}")), "{row}");
    }
    let found = read("compare");
    let entries = found["entries"].as_array().expect("entries");
    for entry in entries {
        let [time, preload, first] =
            [&entry["duration_s"], &entry["mean_preload_n"], &entries[0]["duration_s"]].map(number);
        let (name, ratio) = (entry["controller"].as_str().expect("a name"), time / first);
        assert!(results.contains(&format!("| {name} | {time:.3} ({ratio:.3}) |")), "{name}");
        assert!(results.contains(&format!(" | {preload:.1} |")), "{name}");
        let row = format!("| {name} | {ratio:.3} times that | {preload:.1} N |");
        assert_eq!(readme.contains(&row), ["constant", "limit"].contains(&name), "{row}");
    }
    let faults = read("faults-sil");
    let rows = faults["matrix"].as_array().expect("rows");
    let count = |key: &str| rows.iter().map(|row| row[key].as_u64().expect("a count")).sum::<u64>();
    let counts = ["otherwise", "tolerated", "undetected", "unsafe"].map(count);
    assert_eq!((count("found") + count("limited"), counts), (6197, [595, 1108, 0, 0]));
    assert!(readme.contains("6,197 are reported by name, 595 as another fault and 1,108 not at"));
    assert!(safety.contains("| 79 | 7,900 | 6,197 | 595 | 1,108 | 0 | 0 |"));
}

/// The figure behind a word of a printed summary.
fn figure(text: &str, before: &str) -> Option<f64> {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    text.split_once(before)?.1.split_whitespace().next()?.trim_end_matches(',').parse().ok()
}

/// Each command on the examples' page ends as the block behind it says, within 0.1 s and 0.05 mm,
/// and reports the limits that it names.
#[test]
fn the_examples_end_as_their_page_says() {
    let page = fs::read_to_string(root().join("examples/README.md")).expect("the page");
    let blocks: Vec<&str> = page.split("```").skip(1).step_by(2).collect();
    let mut seen = 0;
    for pair in blocks.windows(2) {
        let (Some(command), Some(printed)) =
            (pair[0].strip_prefix("sh\ncargo rig "), pair[1].strip_prefix("text\n"))
        else {
            continue;
        };
        let mut arguments: Vec<&str> = command.split_whitespace().collect();
        arguments.push("--no-files");
        let output = rig_in(&root(), &arguments);
        let made = String::from_utf8_lossy(&output.stdout);
        let complete = printed.starts_with("Deployed ");
        assert_eq!(code(&output), i32::from(!complete), "{command}: {made}");
        let outcome = |text: &str| text.split(" after ").next().unwrap().to_owned();
        assert!(complete || outcome(&made) == outcome(printed), "{command}: {made}");
        for (before, within) in [("mm in ", 0.1), ("worst gap ", 0.05), ("gross slip ", 0.05)] {
            let [now, then] = [made.as_ref(), printed].map(|text| figure(text, before));
            let near = now.zip(then).map_or(now == then, |(now, then)| (now - then).abs() < within);
            assert!(near, "{command}: `{before}` {then:?} on the page, now {now:?}");
        }
        let codes = |text: &str| -> Vec<String> {
            text.split("  limit ").skip(1).map(|line| line[..3].to_owned()).collect()
        };
        let (now, then) = (codes(&made), codes(printed));
        assert!(then.is_empty() || now == then, "{command}: limits {then:?}, now {now:?}");
        seen += 1;
    }
    assert_eq!(seen, 5);
}

#[test]
fn a_log_is_drawn_and_a_table_without_its_columns_is_refused() {
    let at = &folder();
    good_in(at, &["deploy", "--out", "run"]);
    let draw = |log: &str, step: &str| {
        let script = root().join("examples/plot_log.py");
        let mut python = Command::new("python3");
        python.current_dir(&**at).arg(script).args([log, step, "out.svg"]);
        python.output().expect("python3 starts")
    };
    let output = draw("run/log.csv", "2");
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(fs::read_to_string(at.join("out.svg")).unwrap().ends_with("</svg>\n"));
    let gap = figure(std::str::from_utf8(&output.stdout).unwrap(), "gap ").expect("a gap");
    let summary = json(&at.join("run/summary.json"));
    let measured = summary["crossings"][1]["gap_measured_mm"].as_f64().expect("a gap");
    assert!((gap - measured).abs() < 6e-4, "{gap} and {measured} mm");
    fs::write(at.join("bad.csv"), "tick,level\n0,0\n").unwrap();
    for (log, step, why) in [("run/log.csv", "9", "step 9"), ("bad.csv", "1", "bad.csv")] {
        let refused = draw(log, step);
        assert_eq!(refused.status.code(), Some(1));
        assert!(stderr(&refused).contains(why) && !stderr(&refused).contains("Traceback"));
    }
}

/// With the long samples: the same picture by pandas as by Python's own reader of tables.
#[test]
fn pandas_draws_a_log_alike() {
    if !long() {
        return;
    }
    let python = match python("examples", &["pandas==3.1.1"]) {
        Ok(python) => python,
        Err(why) => {
            // Not `eprintln`: the tests' program keeps that to itself.
            let _ = writeln!(std::io::stderr(), "left out: a log drawn with pandas. {why}");
            return;
        }
    };
    let at = &folder();
    good_in(at, &["capture", "--out", "run"]);
    let script = root().join("examples/plot_log.py");
    let draw = |isolated: bool, out: &str| {
        let mut command = Command::new(&python);
        // `-S` leaves the environment's packages out.
        command.args(isolated.then_some("-S")).arg(&script).args(["run/log.csv", "3", out]);
        let output = command.current_dir(&**at).output().expect("it starts");
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read_to_string(at.join(out)).expect("a picture")
    };
    let has_pandas = |isolated: bool| {
        let mut command = Command::new(&python);
        command.args(isolated.then_some("-S")).args(["-c", "import pandas"]);
        command.output().expect("it starts").status.success()
    };
    assert!(has_pandas(false) && !has_pandas(true));
    let (by_pandas, by_csv) = (draw(false, "pandas.svg"), draw(true, "csv.svg"));
    assert!(by_pandas.contains("gap") && by_pandas == by_csv);
}

fn fields(log: &Path) -> BTreeMap<String, Vec<String>> {
    let bytes = fs::read(log).expect("a log");
    let mut topics = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).expect("a log") {
        let channel = message.expect("intact").channel;
        let schema = channel.schema.as_ref().expect("a schema");
        let Ok(schema) = serde_json::from_slice::<Value>(&schema.data) else { continue };
        let properties = schema["properties"].as_object().expect("properties");
        topics.insert(channel.topic.clone(), properties.keys().cloned().collect());
    }
    topics
}

/// The panels of a layout of Foxglove: the leaves of its tree.
fn panels<'a>(tree: &'a Value, found: &mut Vec<&'a str>) {
    match tree.as_str() {
        Some(panel) => found.push(panel),
        None => {
            assert!(["row", "column"].map(Value::from).contains(&tree["direction"]), "{tree}");
            panels(&tree["first"], found);
            panels(&tree["second"], found);
        }
    }
}

/// Writes each curve of a layout of PlotJuggler on a line, its plots' places checked.
const CURVES: &str = "import sys, xml.etree.ElementTree as tree
root = tree.parse(sys.argv[1]).getroot()
assert root.tag == 'root'
for split in root.findall('tabbed_widget/Tab/Container/DockSplitter'):
    areas = split.findall('DockArea')
    assert int(split.get('count')) == len(areas) == len(split.get('sizes').split(';'))
    assert split.get('orientation') in '|-'
    for area in areas:
        plot = area.find('plot')
        assert plot.get('mode') == 'TimeSeries'
        for curve in plot.findall('curve'):
            print(curve.get('name'))
";

#[test]
fn layouts_of_viewers_name_what_a_log_has() {
    let at = &folder();
    good_in(at, &["capture", "--out", "run"]);
    let topics = fields(&at.join("run/log.mcap"));
    let has = |topic: &str, field: &str| {
        topics.get(topic).is_some_and(|fields| fields.iter().any(|name| name == field))
    };
    let layouts = root().join("examples/layouts");

    let layout = json(&layouts.join("foxglove.json"));
    let mut shown = Vec::new();
    panels(&layout["layout"], &mut shown);
    let configured = layout["configById"].as_object().expect("panels");
    assert_eq!(shown.len(), configured.len(), "{shown:?}");
    let mut seen = 0;
    for panel in shown {
        let panel = &configured[panel];
        for path in panel["paths"].as_array().into_iter().flatten() {
            let path = path["value"].as_str().expect("a path");
            let (topic, field) = path.split_once('.').expect("a field of a topic");
            assert!(has(topic, field), "{path}");
            seen += 1;
        }
        if let Some(topic) = panel["topicToRender"].as_str() {
            assert!(topics.contains_key(topic), "{topic}");
        }
    }
    assert!(seen >= 8, "{seen} paths");

    let mut python = Command::new("python3");
    let output = python.args(["-c", CURVES]).arg(layouts.join("plotjuggler.xml")).output();
    let output = output.expect("python3 starts");
    assert!(output.status.success(), "{}", stderr(&output));
    let curves = String::from_utf8(output.stdout).expect("text");
    for curve in curves.lines() {
        let (topic, field) = curve.rsplit_once('/').expect("a field of a topic");
        assert!(has(topic, field), "{curve}");
    }
    assert!(curves.lines().count() >= 8, "{curves}");
}
