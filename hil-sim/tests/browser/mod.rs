//! The pages of reports in a real browser. Runs with the long samples where a Chromium is there.

mod chromium;

use std::io::Write;

use hil_sim::testing::long;
use serde_json::json;

use crate::cli::{ends_with, folder, good_in};
use chromium::Browser;

/// A browser, if the long samples are wanted and this machine has one.
fn browser() -> Option<Browser> {
    if long() { any_browser() } else { None }
}

/// A browser, if this machine has one.
fn any_browser() -> Option<Browser> {
    let program = chromium::program();
    if program.is_none() {
        // Not `eprintln`: the tests' program keeps that to itself.
        let _ = writeln!(
            std::io::stderr(),
            "left out: pages in a browser, of which only the text is tested. No Chromium in PATH; \
             install one (Debian: `apt install chromium`) or name its program in CHROME"
        );
    }
    program.map(|program| Browser::start(&program))
}

/// Where each cursor of the shown plots over time is, less where the slider's instant belongs,
/// pixels of the drawing.
const CURSORS: &str = "[...document.querySelectorAll('figure[data-across=time]')] \
    .filter((f) => f.offsetParent && f.querySelector('.cursor').getAttribute('d')) \
    .map((f) => { \
      const data = f.querySelector('.data'), [low, , long] = data.getAttribute('viewBox').split(' ').map(Number); \
      const value = Number(document.getElementById('scrub').value) - Number(f.dataset.since); \
      const x = Number(data.getAttribute('x')) + (value - low) / long * Number(data.getAttribute('width')); \
      return Math.abs(Number(f.querySelector('.cursor').getAttribute('d').split(/[M ]/)[1]) - x); })";

/// Brings the n-th plot over time into view and returns the point of the window at this part of its
/// width, and the time there.
fn point(browser: &mut Browser, n: usize, part: f64) -> ((f64, f64), f64) {
    let place = browser.value(&format!(
        "(() => {{ const f = [...document.querySelectorAll('figure[data-across=time]')] \
           .filter((f) => f.offsetParent)[{n}]; \
         f.scrollIntoView({{ block: 'center' }}); \
         const box = f.querySelector('.plot').getBoundingClientRect(), data = f.querySelector('.data'); \
         const [low, , long] = data.getAttribute('viewBox').split(' ').map(Number); \
         const x = Number(data.getAttribute('x')) + {part} * Number(data.getAttribute('width')); \
         return [box.left + x, box.top + box.height / 2, low + {part} * long + Number(f.dataset.since)]; }})()"
    ));
    let [x, y, t_s] = [0, 1, 2].map(|i| place[i].as_f64().expect("a number"));
    ((x, y), t_s)
}

/// Range of time of each plot of the run.
const RANGES: &str = "[...document.querySelectorAll('.time .data')] \
    .map((data) => data.getAttribute('viewBox').split(' ').map(Number)).map((b) => [b[0], b[0] + b[2]])";

#[test]
fn every_plot_shows_the_time_of_the_pointer_and_they_zoom_together() {
    let Some(mut browser) = any_browser() else { return };
    let at = &folder();
    good_in(at, &["deploy", "--out", "run"]);
    let summary = std::fs::read(at.join("run/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    browser.open(&at.join("run/report.html"), 1400);
    let times = "[...document.querySelectorAll('figure')].filter((f) => f.querySelector('output')) \
                 .map((f) => f.querySelector('output').textContent)";
    // In a plot of the run, and in one of a crossing, whose axis has another zero.
    for (n, part) in [(0, 0.3), (4, 0.7), (12, 0.5)] {
        let (at, t_s) = point(&mut browser, n, part);
        browser.hover(at);
        let shown = browser.value(times);
        let shown = shown.as_array().expect("a list");
        assert!(shown.len() > 30 && shown.iter().all(|one| one == &shown[0]), "{shown:?}");
        let time = shown[0].as_str().unwrap().trim_end_matches(" s").parse::<f64>().unwrap();
        assert!((time - t_s).abs() < 0.02, "{time} s shown at {t_s} s");
        let off = browser.value(CURSORS);
        assert!(off.as_array().unwrap().iter().all(|off| off.as_f64().unwrap() < 1.0), "{off}");
    }
    // At lift-off the clearance is the gap, in mm too.
    let lift_s = summary["crossings"][1]["lift_s"].as_f64().unwrap()
        - summary["commanded_s"].as_f64().unwrap();
    browser.value(&format!("plots.show({lift_s})"));
    let gap = browser.value(
        "[...document.querySelectorAll('.time span[data-name=clearance] b')][0].textContent",
    );
    let gap_mm = summary["crossings"][1]["gap_mm"].as_f64().unwrap();
    let shown = gap.as_str().unwrap().split('(').nth(1).unwrap().split(' ').next().unwrap();
    assert!((shown.parse::<f64>().unwrap() - gap_mm).abs() < 0.01, "{gap} instead of {gap_mm} mm");
    let speeds = "new Set([...document.querySelectorAll('figure[data-of^=speed] [data-name=true] b')].map((b) => b.textContent && Number(b.textContent).toFixed(2)).filter(Boolean)).size";
    assert_eq!(browser.number(speeds), 1.0, "the plots of one quantity show one value");

    // Dragging zooms every plot of the run to the stretch; a double click shows everything again.
    let before = browser.value(RANGES);
    let ((from, low), (to, high)) = (point(&mut browser, 1, 0.4), point(&mut browser, 1, 0.6));
    browser.drag(from, to);
    let after = browser.value(RANGES);
    let ranges = after.as_array().unwrap();
    assert!(ranges.len() >= 8);
    for range in ranges {
        let [a, b] = [0, 1].map(|i| range[i].as_f64().unwrap());
        assert!((a - low).abs() < 0.01 && (b - high).abs() < 0.01, "{range}, {low} to {high}");
    }
    let (middle, _) = point(&mut browser, 1, 0.5);
    browser.click(middle, 2);
    assert_eq!(browser.value(RANGES), before);
    // The same by the buttons.
    let press = |name: &str| {
        format!(
            "[...document.querySelectorAll('.time .zoom button')].find((b) => b.textContent === '{name}').click()"
        )
    };
    browser.value(&press("zoom in"));
    assert_ne!(browser.value(RANGES), before);
    browser.value(&press("reset"));
    assert_eq!(browser.value(RANGES), before);
    assert_eq!(browser.errors(), [""; 0]);
    assert_eq!(browser.requests(), [""; 0]);
}

/// Sets the slider to a part of its range, as a hand does.
fn scrub(browser: &mut Browser, part: f64) {
    browser.value(&format!(
        "(() => {{ const s = document.getElementById('scrub'); \
         s.value = Number(s.min) + {part} * (s.max - s.min); \
         s.dispatchEvent(new Event('input')); }})()"
    ));
}

#[test]
fn the_page_of_a_run_moves_and_its_cursors_follow() {
    let Some(mut browser) = browser() else { return };
    let at = &folder();
    good_in(at, &["deploy", "--out", "run"]);
    browser.open(&at.join("run/report.html"), 1400);

    // The animation moves, and ends with its crossing.
    let turned = "document.getElementById('wheel').getAttribute('transform')";
    let at = "Number(document.getElementById('scrub').value)";
    let (before, since) = (browser.value(turned), browser.number(at));
    browser.value("document.getElementById('play').click()");
    std::thread::sleep(std::time::Duration::from_millis(1500));
    browser.value("document.getElementById('play').click()");
    let passed = browser.number(at) - since;
    assert!((0.02..1.5).contains(&passed), "{passed} s at a fifth of real time");
    assert_ne!(browser.value(turned), before);

    // The slider moves wheel and cursors alike.
    for part in [0.1, 0.5, 0.9] {
        scrub(&mut browser, part);
        let off = browser.value(CURSORS);
        let off = off.as_array().expect("a list");
        assert!(off.len() >= 6, "{} cursors", off.len());
        assert!(off.iter().all(|off| off.as_f64().unwrap() < 0.5), "{off:?}");
    }
    let words = browser.value("document.getElementById('phase').textContent");
    assert!(words.as_str().unwrap().contains("mm/s"), "{words}");

    // A click in a plot goes to its instant.
    let (place, wanted) = point(&mut browser, 0, 0.6);
    browser.click(place, 1);
    let now = browser.number(at);
    assert!((now - wanted).abs() < 0.02, "{now} s instead of {wanted} s");

    // The other axis has the same plots.
    browser.value("document.getElementById('position').click()");
    let shown = "[...document.querySelectorAll('figure[data-across=position]')] \
                 .filter((f) => f.offsetParent).length";
    assert!(browser.number(shown) >= 6.0);
    assert_eq!(browser.errors(), [""; 0]);
}

/// By how much the page is wider than its window, CSS pixels.
const OVERFLOW: &str =
    "document.documentElement.scrollWidth - document.documentElement.clientWidth";

/// The least contrast of headings, paragraphs, tables and still pictures with what is behind them,
/// by WCAG 2. The plots are turned dark by a filter, which styles do not show.
const CONTRAST: &str = "(() => { \
    const parse = (text) => (text.match(/[\\d.]+/g) || [0, 0, 0, 0]).map(Number); \
    const light = (c) => c.slice(0, 3).map((v) => v / 255) \
      .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)) \
      .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0); \
    const behind = (e) => { for (; e; e = e.parentElement) { \
      const c = parse(getComputedStyle(e).backgroundColor); \
      if (c.length < 4 || c[3] > 0.5) return c; } return [255, 255, 255]; }; \
    const all = [...document.querySelectorAll('h1, h2, p, td, th, label, .still text')] \
      .filter((e) => e.getClientRects().length && e.textContent.trim()); \
    const of = (e) => { const style = getComputedStyle(e); \
      const ink = light(parse(e instanceof SVGElement ? style.fill : style.color)); \
      const paper = light(behind(e)); \
      return (Math.max(ink, paper) + 0.05) / (Math.min(ink, paper) + 0.05); }; \
    const worst = all.reduce((a, b) => (of(b) < of(a) ? b : a)); \
    return [of(worst), worst.tagName + ' ' + worst.textContent.slice(0, 60), all.length]; })()";

#[test]
fn every_page_fits_a_phone_a_zoomed_window_and_a_dark_room() {
    let Some(mut browser) = browser() else { return };
    let at = &folder();
    good_in(at, &["deploy", "--out", "a"]);
    let slips = ["deploy", "--set", "plant.mu=0.7", "--controller", "constant", "--out", "b"];
    ends_with(1, at, &slips);
    good_in(at, &["capture", "--out", "c"]);
    good_in(at, &["report", "c/log.mcap", "--out", "captured.html"]);
    good_in(at, &["report", "a/log.mcap", "b/log.mcap", "--out", "both.html"]);
    good_in(at, &["montecarlo", "-n", "5", "--table", "runs.html"]);
    for page in ["a/report.html", "b/report.html", "captured.html", "both.html", "runs.html"] {
        for (width, scale) in [(1400, 1.0), (700, 2.0), (400, 1.0)] {
            browser.open(&at.join(page), width);
            browser.resize(width, scale);
            let over = browser.number(OVERFLOW);
            assert!(over <= 0.0, "{page}, {width} px: {over} px too wide");
        }
        for colours in ["light", "dark"] {
            browser.media("screen", colours);
            let found = browser.value(CONTRAST);
            let (contrast, count) = (found[0].as_f64().unwrap(), found[2].as_f64().unwrap());
            assert!(count > 20.0, "{page}: {found}");
            assert!(contrast >= 4.5, "{page}, {colours}: {found}");
        }
        if page == "b/report.html" {
            let words = browser.value("document.getElementById('phase').textContent");
            assert!(words.as_str().unwrap().contains("does not get over"), "{words}");
        }
        browser.media("", "light");
        assert_eq!(browser.errors(), [""; 0], "{page}");
    }
}

#[test]
fn without_its_script_the_page_prints_two_still_pictures() {
    let Some(mut browser) = browser() else { return };
    let at = &folder();
    good_in(at, &["deploy", "--out", "run"]);
    browser.call("Emulation.setScriptExecutionDisabled", &json!({ "value": true }));
    browser.open(&at.join("run/report.html"), 1400);
    let shown = |what: &str| {
        format!(
            "[...document.querySelectorAll('{what}')] \
             .filter((e) => e.getClientRects().length).length"
        )
    };
    assert_eq!(browser.value(&shown("#stage")), 0);
    let stills = browser.number(&shown(".still svg"));
    assert!(stills >= 2.0, "{stills} still pictures");
    let printed = browser.call("Page.printToPDF", &json!({ "printBackground": true }));
    let pdf = printed["data"].as_str().expect("a document");
    // `%PDF` in base 64, and more than an empty page.
    assert!(pdf.starts_with("JVBER") && pdf.len() > 40_000, "{} letters", pdf.len());
    browser.media("print", "light");
    assert_eq!(browser.value(&shown("#stage")), 0);
    assert!(browser.number(&shown(".still svg")) >= 2.0);
    assert_eq!(browser.errors(), [""; 0]);
}
