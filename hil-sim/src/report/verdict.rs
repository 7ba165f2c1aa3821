//! A run in one sentence.

use crate::record::Summary;
use crate::scenario::brief;
use crate::table::{counted, number};

/// How a run went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Grade {
    /// It completed, with every gap within the tolerance of the reference and no gross slip.
    Good,
    /// It completed, but a gap was larger or is unknown, or the wheel slipped.
    Fair,
    /// It did not complete or ended in a fault.
    Bad,
}

/// Part of the reference by which a gap of a good run may exceed it: what tolerances of the rig and
/// errors of its sensors do to a crossing that is planned right.
pub(crate) const GAP_TOLERANCE: f64 = 0.03;

/// Gross slip from which a run no longer counts as free of slip, mm.
pub(crate) const SLIP_SEEN_MM: f64 = 0.05;

/// What a run that completed is not good for, in words. What a log without truth measures as slip
/// includes creep and the steps' tolerances, so that it shows none.
fn reservations(summary: &Summary) -> Vec<&'static str> {
    let gap = gap_excess(summary).and_then(|excess| match excess {
        excess if excess > GAP_TOLERANCE => Some("over the reference gap"),
        excess if excess.is_nan() => Some("gap unknown"),
        _ => None,
    });
    let slips = !summary.measured && summary.slip_mm > SLIP_SEEN_MM;
    gap.into_iter().chain(slips.then_some("the wheel slipped")).collect()
}

/// Why a run has its grade, and what takes most time beside travel at cruise speed.
pub(crate) fn verdict(summary: &Summary) -> String {
    let why = match Grade::of(summary) {
        Grade::Good if summary.gap_ref_mm > 0.0 => {
            let most = 100.0 * GAP_TOLERANCE;
            let slip = if summary.measured { "" } else { ", no slip" };
            format!("good: every gap at most {most:.0} % over the reference{slip}")
        }
        Grade::Good => "good".to_owned(),
        Grade::Fair => reservations(summary).join(", "),
        Grade::Bad => String::new(),
    };
    let slow = summary.lost.as_ref().map(|lost| format!("largest loss of time: {}", lost.main()));
    let parts = [Some(why).filter(|why| !why.is_empty()), slow];
    parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
}

impl Grade {
    /// Its name in the style of a page.
    pub(crate) const fn name(self) -> &'static str {
        ["good", "fair", "bad"][self as usize]
    }

    /// Its colour on a terminal: green, amber, red.
    pub(crate) const fn ansi(self) -> u8 {
        [32, 33, 31][self as usize]
    }

    pub(crate) fn of(summary: &Summary) -> Self {
        if !summary.completed || !summary.faults.is_empty() {
            Self::Bad
        } else if reservations(summary).is_empty() {
            Self::Good
        } else {
            Self::Fair
        }
    }
}

/// Worst gap over the reference, relative: positive is worse. None without reference.
pub(crate) fn gap_excess(summary: &Summary) -> Option<f64> {
    (summary.gap_ref_mm > 0.0).then(|| summary.max_gap_mm / summary.gap_ref_mm - 1.0)
}

/// Slip and its name, as half a sentence.
pub(crate) fn slip_sentence(summary: &Summary) -> String {
    let slip_mm = Some(summary.slip_mm).filter(|slip_mm| slip_mm.is_finite());
    let slip = slip_mm.map_or("unknown".to_owned(), |mm| format!("{} mm", number(mm, 3)));
    let name = if summary.measured { "measured slip with creep" } else { "gross slip" };
    format!("{name} {slip}")
}

/// What ran and with which parameters, as half a sentence: overrides and seed included.
pub(crate) fn origin(summary: &Summary) -> String {
    let Summary { controller, target, rig, seed, overrides, measured, .. } = summary;
    let rig = if rig.is_empty() { "unknown" } else { rig };
    let mut parts = vec![format!("{controller} controller on {target}"), format!("rig {rig}")];
    // The seed of a measured plant is that of its parameters, if it has any.
    parts.extend((!measured || *seed > 0).then(|| format!("seed {seed}")));
    parts.extend(overrides.iter().map(|(key, value)| format!("{key} = {}", brief(value))));
    parts.join(", ")
}

/// The headline: the outcome of the run.
pub(crate) fn headline(summary: &Summary) -> String {
    let verb = if summary.direction == "retract" { "Retracted" } else { "Deployed" };
    let moving = format!("{:.2} s in motion", summary.moving_s);
    let time = summary.duration_s.map_or(moving.clone(), |duration_s| {
        format!("{duration_s:.2} s from the command ({moving})")
    });
    let mut travel = format!("{:.1} mm in {time}", summary.travel_mm);
    // Of a run that ended on a corner the last one is none.
    if summary.completed {
        travel += &format!(", {}", counted(summary.crossings.len(), "crossing"));
    }
    match (summary.completed, summary.faults.first()) {
        (true, None) => {
            let then = summary.restart.as_ref().map(|cause| format!("; then a restart: {cause}"));
            format!("{verb} {travel}{}", then.unwrap_or_default())
        }
        (true, Some(fault)) => {
            format!("{verb} {travel}, with fault {}: {}", fault.code, fault.text)
        }
        (false, None) if let Some(cause) = &summary.restart => {
            format!("Restarted after {travel}: {cause}")
        }
        (false, None) if !summary.missing.is_empty() => format!("Log ends after {travel}"),
        (false, None) => {
            let end = summary.cut_off_s.map(|s| format!("time-out at {s:.0} s from boot"));
            format!("Did not complete: {} after {travel}", end.as_deref().unwrap_or("stopped"))
        }
        (false, Some(fault)) => {
            format!("Did not complete: fault {} after {travel}: {}", fault.code, fault.text)
        }
    }
}

/// The worst gap beside the reference, as a half-sentence.
pub(crate) fn gap_sentence(summary: &Summary) -> String {
    if !summary.max_gap_mm.is_finite() {
        let none =
            if summary.crossings.is_empty() { "no crossing, so no gap" } else { "gap unknown" };
        return none.to_owned();
    }
    let by = if summary.measured { "measured " } else { "" };
    let worst = format!("worst {by}gap {:.3} mm", summary.max_gap_mm);
    match gap_excess(summary) {
        None => worst,
        Some(excess) => format!(
            "{worst}, {:.1} % {} the reference of {:.3} mm",
            100.0 * excess.abs(),
            if excess > 0.0 { "over" } else { "below" },
            summary.gap_ref_mm
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn a_completed_run_below_the_reference_is_good() {
        let mut summary = example::deploy().summary;
        (summary.gap_ref_mm, summary.max_gap_mm) = (1.62, 1.59);
        assert_eq!(Grade::of(&summary), Grade::Good);
        (summary.travel_mm, summary.moving_s) = (79.8, 4.264);
        for (duration_s, time) in
            [(Some(6.98), "6.98 s from the command (4.26 s in motion)"), (None, "4.26 s in motion")]
        {
            summary.duration_s = duration_s;
            let expected = format!("Deployed 79.8 mm in {time}, 3 crossings");
            assert_eq!(headline(&summary), expected);
        }
        assert_eq!(
            gap_sentence(&summary),
            "worst gap 1.590 mm, 1.9 % below the reference of 1.620 mm"
        );
        summary.slip_mm = 0.2;
        assert_eq!(Grade::of(&summary), Grade::Fair);
    }

    #[test]
    fn an_unknown_gap_is_not_good_and_without_a_reference_the_gap_is_alone() {
        let mut summary = example::deploy().summary;
        summary.max_gap_mm = f64::NAN;
        assert_eq!((Grade::of(&summary), &*gap_sentence(&summary)), (Grade::Fair, "gap unknown"));
        assert_eq!(reservations(&summary), ["gap unknown"]);
        let summary = Summary { max_gap_mm: 1.0, ..Summary::default() };
        assert_eq!(gap_sentence(&summary), "worst gap 1.000 mm");
    }

    #[test]
    fn just_over_the_tolerance_of_the_reference_has_its_grade_and_its_word() {
        let mut summary = example::deploy().summary;
        (summary.gap_ref_mm, summary.max_gap_mm) = (2.0, 2.059);
        assert_eq!(Grade::of(&summary), Grade::Good);
        assert!(verdict(&summary).starts_with("good: every gap at most 3 % over the reference"));
        assert!(verdict(&summary).contains("; largest loss of time: "), "{}", verdict(&summary));
        summary.max_gap_mm = 2.061;
        assert_eq!(Grade::of(&summary), Grade::Fair);
        assert_eq!(reservations(&summary), ["over the reference gap"]);
        summary.slip_mm = 0.2;
        assert_eq!(reservations(&summary), ["over the reference gap", "the wheel slipped"]);
        // With creep in it, a measured slip is no gross slip.
        summary.measured = true;
        assert_eq!(reservations(&summary), ["over the reference gap"]);
        assert!(slip_sentence(&summary).starts_with("measured slip"));
        summary.max_gap_mm = 2.0;
        assert_eq!((Grade::of(&summary), reservations(&summary)), (Grade::Good, vec![]));
    }

    #[test]
    fn a_log_that_is_cut_off_is_not_said_to_have_failed() {
        let mut summary = Summary { missing: vec!["cut off".to_owned()], ..Summary::default() };
        assert_eq!(headline(&summary), "Log ends after 0.0 mm in 0.00 s in motion");
        summary.max_gap_mm = f64::NAN;
        assert_eq!(gap_sentence(&summary), "no crossing, so no gap");
    }
}
