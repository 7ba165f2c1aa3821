pub(crate) mod example;

use super::panels::{Across, View};
use super::*;
use crate::record::{Recording, Report};

#[test]
fn the_page_needs_no_other_file_is_small_and_shows_every_plot_and_figure() {
    let recording = example::deploy();
    let page = html(&recording, &[]);
    for outside in ["http://", "https://", " src=", "<link", "url(", "@import", "fetch(", "import("]
    {
        let found = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!found.contains(outside), "{outside}");
    }
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
    // Seven plots and the bands on two axes, six plots for each of three crossings.
    assert_eq!(page.matches("<figure data-across").count(), 2 * 8 + 3 * 6);
    for text in ["3 crossings", "worst gap", "tau_s = 0.1059", env!("CARGO_PKG_VERSION")] {
        assert!(page.to_lowercase().contains(&text.to_lowercase()), "{text}");
    }
    assert!(page.contains(&recording.summary.trace_digest));
}

#[test]
fn the_page_of_a_long_log_is_small_too() {
    let log = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/resets-3.mcap");
    let boots = crate::record::recordings(log.as_ref()).unwrap();
    assert!(boots.iter().map(|boot| boot.rows.len()).sum::<usize>() > 18_000);
    let page = log_html(&boots);
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
    let cause = "by the reset pin; before: deploying: crossing at 2.025";
    assert!(page.contains(cause) && !page.contains("Deploy, "), "a mode is in words");
}

#[test]
fn every_number_drawn_is_finite() {
    for recording in [example::deploy(), example::faulted(), Recording::default()] {
        let text = html(&recording, &[]);
        assert!(!text.contains("NaN") && !text.contains("inf,"));
        assert_eq!(text.contains("No rows were recorded"), recording.rows.is_empty());
    }
}

#[test]
fn a_crossing_is_animated_from_the_rows_of_the_run() {
    let page = html(&example::deploy(), &[]);
    let data = page.split("id=\"scene\">").nth(1).expect("no data of the scene");
    let data = data.split("</script>").next().unwrap();
    let scene: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(scene["geometry"]["wheel_radius_mm"], 25.0);
    assert_eq!(scene["crossings"].as_array().unwrap().len(), 3);
    assert!(scene["rows"].as_array().unwrap().len() > 1000);
    // What the script looks for is in the page.
    let script = include_str!("scene.js");
    for id in script.split("$(\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
    }
}

#[test]
fn the_times_of_a_page_count_from_the_command() {
    let recording = example::faulted();
    let commanded_s = recording.summary.commanded_s.expect("a command");
    let since = recording.since_command();
    let zero = since.log.iter().find(|line| line.text == "command: start").expect("it is logged");
    assert!(zero.t_s.abs() < 2e-3, "{}", zero.t_s);
    let first = (&since.rows[0].controller, &recording.rows[0].controller);
    assert!((first.1.t_s - first.0.t_s - commanded_s).abs() < 1e-9);
    let page = html(&recording, &[]);
    assert!(page.contains("Time counts from the command."), "{page}");
    let carried = since.summary.duration_s.expect("a duration") - since.summary.moving_s;
    assert!(page.contains(&format!(" carries the wheel from {carried:.2} s")), "{page}");
    let fault = recording.summary.faults[0].t_s - commanded_s;
    assert!(page.contains(&format!("{fault:.3} s")) && !page.contains("-0.0,"), "no negative zero");
}

#[test]
fn faults_limits_and_steps_are_marked_and_other_parameters_listed() {
    let mut recording = example::faulted();
    let page = html(&recording, &[]);
    assert!(page.contains("<header class=\"bad\">"));
    assert!(page.contains("Did not complete: fault 121"));
    let is_marked = |page: &str, mark: &str| page.contains(&format!(">{mark}</text>"));
    assert!(is_marked(&page, "201") && !page.contains(">touch</text>"));
    // At the right edge a name is to the left of its line.
    assert!(page.contains("text-anchor=\"end\" fill=\"#b91c1c\">121</text>"));
    assert!(is_marked(&html(&example::deploy(), &[]), "step 1"));
    let mut together = recording.clone();
    let first = together.summary.limits[0].clone();
    together.summary.limits.push(Report { code: 205, ..first });
    assert!(is_marked(&html(&together, &[]), "201, 205"));
    recording.summary.overrides.insert("tread.tau_s".to_owned(), 0.2.into());
    assert!(html(&recording, &[]).contains("tread.tau_s = 0.2"));
}

#[test]
fn axes_have_units_time_begins_at_the_command_and_the_measured_is_over_the_truth() {
    let recording = example::deploy().since_command();
    let view = View::new(&recording, Across::Time);
    assert!(recording.rows[0].controller.t_s < -0.1);
    assert_eq!(view.x.0, 0.0);
    for panel in view.all() {
        assert!(panel.y_name.contains(", "), "{}: {}", panel.title, panel.y_name);
    }
    let svg = view.preload().figure("", (1100, 240), "");
    let line = |name: &str| svg.find(&format!("line{name}\"")).expect(name);
    assert!(line("\" data-name=\"measured") > line(" truth"), "the truth hides the measured");
}

/// What the script shows at the cursor it reads off these paths.
#[test]
fn a_plot_has_the_run_s_own_values_and_a_place_for_each() {
    let recording = example::deploy();
    let page = html(&recording, &[]);
    let zero_s = recording.summary.commanded_s.expect("a command");
    let figures: Vec<&str> = page.split("<figure data-across").skip(1).collect();
    for figure in &figures {
        let figure = figure.split("</figure>").next().unwrap();
        assert_eq!(figure.matches("<output></output>").count(), 1);
        for name in figure.split("class=\"line").skip(1) {
            let name = name.split("data-name=\"").nth(1).unwrap().split('"').next().unwrap();
            let place = format!("<span data-name=\"{name}\">");
            let is_empty =
                figure.contains(&format!("data-name=\"{name}\"")) && !figure.contains(&place);
            assert!(!is_empty || figure.contains("d=\"\""), "{name} has no place for its value");
        }
    }
    let preload = figures.iter().find(|figure| figure.contains("<b>Preload</b>")).unwrap();
    let path = preload.split("class=\"line truth\"").nth(1).unwrap();
    let path = path.split("d=\"M").nth(1).unwrap().split('"').next().unwrap();
    let numbers: Vec<f64> = path.split(['M', ' ']).map(|text| text.parse().unwrap()).collect();
    for line in &recording.summary.crossings {
        let lift_s = line.lift_s - zero_s;
        let near = numbers
            .chunks(2)
            .min_by(|a, b| (a[0] - lift_s).abs().total_cmp(&(b[0] - lift_s).abs()));
        let [t_s, preload_n] = near.unwrap() else { panic!("pairs") };
        assert!(
            (t_s - lift_s).abs() < 0.01 && (preload_n - line.preload_n).abs() < 0.2,
            "{near:?}"
        );
    }
}
