//! The pages of reports in a real browser. Runs with the long samples where a Chromium is there.

mod chromium;

use std::io::Write;
use std::path::Path;

use hil_sim::testing::long;
use serde_json::json;

use crate::cli::{code, rig_in, stderr};
use chromium::Browser;

/// A browser, if the long samples are wanted and this machine has one.
fn browser() -> Option<Browser> {
    if !long() {
        return None;
    }
    let program = chromium::program();
    if program.is_none() {
        // Not `eprintln`: the tests' program keeps that to itself.
        let _ = writeln!(
            std::io::stderr(),
            "left out: pages in a browser. No Chromium in PATH; install one (Debian: \
             `apt install chromium`) or name its program in CHROME"
        );
    }
    program.map(|program| Browser::start(&program))
}

/// Runs the command, which must end with this code.
fn run(expected: i32, at: &Path, arguments: &[&str]) {
    let output = rig_in(at, arguments);
    assert_eq!(code(&output), expected, "{arguments:?}: {}", stderr(&output));
}

/// Where each cursor of the shown plots over time is, less where the slider's instant belongs,
/// pixels of the drawing.
const CURSORS: &str = "[...document.querySelectorAll('figure[data-across=time]')] \
    .filter((f) => f.offsetParent && f.querySelector('.cursor').style.display === '') \
    .map((f) => { \
      const [low, high, left, right] = f.dataset.frame.split(' ').map(Number); \
      const value = Number(document.getElementById('scrub').value) - Number(f.dataset.since); \
      const x = Number(f.querySelector('.cursor').getAttribute('x1')); \
      return Math.abs(left + (value - low) / (high - low) * (right - left) - x); })";

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
    let directory = tempfile::tempdir().unwrap();
    run(0, directory.path(), &["deploy", "--out", "run"]);
    browser.open(&directory.path().join("run/report.html"), 1400);

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
    let place = browser.value(
        "(() => { const f = [...document.querySelectorAll('figure[data-across=time]')] \
           .find((f) => f.offsetParent && f.dataset.since === '0'); \
         f.scrollIntoView({ block: 'center' }); \
         const [low, high, left, right] = f.dataset.frame.split(' ').map(Number); \
         const svg = f.querySelector('svg'), box = svg.getBoundingClientRect(); \
         const x = (left + 0.6 * (right - left)) / svg.viewBox.baseVal.width * box.width; \
         return [box.left + x, box.top + box.height / 2, low + 0.6 * (high - low)]; })()",
    );
    let [x, y, wanted] = [0, 1, 2].map(|i| place[i].as_f64().expect("a number"));
    browser.click(x, y);
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
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    run(0, at, &["deploy", "--out", "a"]);
    let slips = ["deploy", "--set", "plant.mu=0.7", "--controller", "constant", "--out", "b"];
    run(1, at, &slips);
    run(0, at, &["capture", "--out", "c"]);
    run(0, at, &["report", "c/log.mcap", "--out", "captured.html"]);
    run(0, at, &["report", "a/log.mcap", "b/log.mcap", "--out", "both.html"]);
    for page in ["a/report.html", "b/report.html", "captured.html", "both.html"] {
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
    let directory = tempfile::tempdir().unwrap();
    run(0, directory.path(), &["deploy", "--out", "run"]);
    browser.call("Emulation.setScriptExecutionDisabled", &json!({ "value": true }));
    browser.open(&directory.path().join("run/report.html"), 1400);
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
