//! The generated blocks of `docs/SAFETY.md`: the matrix of the campaign and its bounds.

use std::fmt::Write as _;

use anyhow::Result;

use super::blocks::fill;
use crate::faults::campaign::{Line, Outcome, Spread};
use crate::faults::judge::{GAP_PART, MOTION_MM, POSITION_MM, PRELOAD_PART, SLIDE_MM};
use crate::table::number;

/// `page` with its generated blocks as this campaign came out.
///
/// # Errors
/// If a block is missing.
pub fn fill_safety(page: &str, outcome: &Outcome) -> Result<String> {
    let page = fill(page, "bounds", &bounds())?;
    let page = fill(&page, "matrix", &matrix(outcome))?;
    fill(&page, "rest", &rest(outcome))
}

/// `page` with the matrix of the emulated board as this campaign came out.
///
/// # Errors
/// If the block is missing.
pub fn fill_board(page: &str, outcome: &Outcome) -> Result<String> {
    fill(page, "board-matrix", &matrix(outcome))
}

fn bounds() -> String {
    let preload = 100.0 * PRELOAD_PART;
    let gap = 100.0 * GAP_PART;
    format!(
        "| bound | value |\n|---|---|\n\
         | largest preload | {preload:.0} % of its limit; the screw has its stop at 125 % |\n\
         | way gone uncommanded, all together | {MOTION_MM} mm; {SLIDE_MM} mm where the wheel \
         has lost its grip |\n\
         | distance from the end that an arrival reports | {POSITION_MM} mm |\n\
         | gap of a run that reports nothing | {gap:.0} % of the reference |\n\
         | at its end | both bridges off, nothing moves for a second |"
    )
}

fn matrix(outcome: &Outcome) -> String {
    let mut text = format!(
        "`cargo rig faults{} -n {}`: {} faults at {} instants each, {} undetected, {} unsafe.\n\n\
         | fault | measure | codes (times) | borne | detection, ms: median | worst | from any \
         difference: worst | ends | preload, N | uncommanded, mm |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
        if outcome.target == "sil" { "" } else { " --target board" },
        outcome.instants,
        outcome.matrix.len(),
        outcome.instants,
        outcome.undetected,
        outcome.unheld
    );
    for line in &outcome.matrix {
        let _ = writeln!(text, "{}", row(line));
    }
    text
}

fn row(line: &Line) -> String {
    let list = |all: Vec<String>| if all.is_empty() { "-".to_owned() } else { all.join(", ") };
    let codes = line.codes.iter().map(|(code, times)| format!("{code} ({times})"));
    let restarts = line.restarts.iter().map(|(cause, times)| format!("{cause} ({times})"));
    let codes = codes.chain(restarts).collect();
    let ends = line.ends.iter().map(|(end, times)| format!("{end} {times}")).collect();
    let borne = match line.undetected {
        0 => line.tolerated.to_string(),
        missed => format!("{} and {missed} missed", line.tolerated),
    };
    format!(
        "| {} | {} | {} | {borne} | {} | {} | {} | {} | {:.1} | {:.2} |",
        line.fault,
        line.text,
        list(codes),
        number(line.latency_median_ms, 0),
        number(line.latency_ms, 0),
        number(line.latency_any_ms.map(|spread| spread.worst), 0),
        list(ends),
        line.worst_preload_n,
        line.worst_motion_mm
    )
}

/// How soon all is off and at rest after a report, by where the fault came.
fn rest(outcome: &Outcome) -> String {
    let worst = |of: fn(&Line) -> Option<Spread>| {
        let all = outcome.matrix.iter().filter(|line| line.fault != "wheel slip").filter_map(of);
        number(all.map(|spread| spread.worst).reduce(f64::max), 0)
    };
    format!(
        "| fault came | worst time from its report to rest, ms |\n|---|---|\n\
         | anywhere | {} |\n| in a crossing | {} |",
        worst(|line| line.rest_ms),
        worst(|line| line.rest_in_crossing_ms)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::campaign::{Campaign, Case};
    use crate::scenario::Scenario;

    fn page() -> String {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/SAFETY.md");
        std::fs::read_to_string(path).expect("docs/SAFETY.md")
    }

    #[test]
    fn every_fault_is_on_the_page_and_none_is_missed() {
        let page = page();
        for case in Case::all() {
            let head = format!("\n| {} | {} |", case.name(), case.text());
            assert!(page.contains(&head), "{}: run `cargo rig docs --only safety`", case.name());
        }
        assert!(page.contains(", 0 undetected, 0 unsafe."), "what the page promises");
        assert!(page.contains(&bounds()));
    }

    #[test]
    fn the_blocks_are_filled_from_a_campaign() {
        let case = Case::all().into_iter().find(|case| case.name() == "tick overrun");
        let cases = vec![case.expect("in the matrix")];
        let campaign = Campaign { scenario: Scenario::default(), instants: 2, cases };
        let outcome = campaign.run(&|| {}).expect("a campaign");
        let page = fill_safety(&page(), &outcome).expect("every block");
        assert!(page.contains("| tick overrun | control ticks are lost"), "{page}");
        assert!(page.contains("| 160 (2) | 0 |"), "{page}");
    }
}
