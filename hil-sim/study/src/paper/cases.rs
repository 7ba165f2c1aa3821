//! Figure 11: collision, impact and vibration of the study's four cases, at its own
//! loads.

use super::case::{Case, Loads};
use super::claims::{FALLS, RISES, Verdict, all_go, change, fixed, largest, percents, within};
use super::histories::{Histories, panels};
use super::history::Quantity::{Collision, Impact, Vibration};
use super::published::{CASES, COLLISION_N};
use super::transitions::count_humps;
use crate::figure::{Figure, Series, Source};

/// Part of a peak that is as good as nothing.
const GONE: f64 = 0.02;

/// Two forces no farther apart than this, relative, are nearly identical.
const NEARLY: f64 = 0.03;

pub(super) fn cases() -> [Case; 4] {
    CASES.map(|(speed, preload)| Case::new(Loads::Fe, speed, preload))
}

pub(super) fn figure(all: &[Histories]) -> Figure {
    let mut panels = panels(all);
    for ((panel, one), force) in panels.iter_mut().zip(all).zip(COLLISION_N) {
        let when = one.peaks(Collision, Source::Simulation)[0].time_s;
        panel.series.push(Series::new(Source::Published, vec![(when, force)]));
    }
    let caption =
        "The study's four cases at its own loads (60 N on top, of which this wheel lifts a \
                   third); quantities and sources as in figure 24. The study's figure has theory \
                   alone. The marks are its finite-element forces of the first transition \
                   (figure 13), at the time of our peak."
            .to_owned();
    let title = "Collision, impact and vibration of the four cases";
    Figure::new("fig11", title, caption, CASES.len(), panels)
}

pub(super) fn verdicts(all: &[Histories]) -> Vec<Verdict> {
    let all @ [slow, pressed, fast, slowest]: [&Histories; 4] = std::array::from_fn(|i| &all[i]);
    let first = |id, quantity, ends: [&Histories; 2], sense| -> Verdict {
        let peaks = ends.map(|one| one.peaks_text(quantity)).join("; ");
        (id, all_go(ends.map(|one| one.peak(quantity, 0)), sense), vec![peaks])
    };
    let second = [slow, pressed].map(|one| one.peak(Collision, 1));
    let more = |stage| change(slow.peak(Collision, stage), pressed.peak(Collision, stage));
    let more_found = |stage| vec![percents(more(stage), 1, ", ")];
    let humps = all.map(|one| {
        let points = one.points(Collision, Source::Simulation);
        count_humps(points.iter().map(|p| p.1), 0.02)
    });
    let humps = humps.into_iter().fold(0, usize::max);
    let left = largest(all.into_iter().flat_map(|one| one.left_over(Impact)));
    let less = all.map(|one| one.peak(Collision, 0).map(|force| force - one.case.preload_n));
    let impact = all.map(|one| one.peak(Impact, 0));
    // Whether two cases are in the same order by both, in every source.
    let alike = |a: usize, b: usize| {
        (0..3).all(|of| (less[a][of] < less[b][of]) == (impact[a][of] < impact[b][of]))
    };
    let in_order = (0..4).all(|a| (0..4).all(|b| alike(a, b)));
    let stresses = [0, 1, 2, 3].map(|i| format!("{:.1} N, {:.0} kPa", less[i][1], impact[i][1]));
    vec![
        ("collision-decays-periodically", humps > 3, vec![humps.to_string()]),
        first("collision-falls-with-preload", Collision, [slow, pressed], FALLS),
        first("collision-grows-with-speed", Collision, [slow, fast], RISES),
        first("collision-grows-with-speed-120", Collision, [slowest, pressed], RISES),
        ("second-collision-grows-with-preload", all_go(second, RISES), more_found(1)),
        ("third-collision-equal", within(more(2), NEARLY), more_found(2)),
        ("stress-of-collision-less-preload", in_order, vec![stresses.join("; ")]),
        ("impact-decays-to-zero", left < GONE, fixed(3, [left])),
        first("impact-falls-with-preload", Impact, [slow, pressed], FALLS),
        first("vibration-grows-with-speed", Vibration, [slow, fast], RISES),
        first("vibration-falls-with-preload", Vibration, [slow, pressed], FALLS),
    ]
}
