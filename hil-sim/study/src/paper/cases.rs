//! Figure 11: collision, impact and vibration of the study's four cases, at its own
//! loads.

use super::case::{Case, Loads};
use super::claims::{FALLS, RISES, all_go, change, largest, percents, row, table, within};
use super::histories::{Histories, panels};
use super::history::Quantity::{Collision, Impact, Vibration};
use super::published::{CASES, COLLISION_N};
use super::transitions::count_humps;
use crate::figure::{Claim, Figure, Series, Source};

const SECTION: &str = "Vibration transmission model";

/// Part of a peak that is as good as nothing.
const GONE: f64 = 0.02;

/// Two forces no farther apart than this, relative, are nearly identical.
const NEARLY: f64 = 0.03;

pub fn cases() -> [Case; 4] {
    CASES.map(|(speed, preload)| Case::new(Loads::Fe, speed, preload))
}

pub fn figure(all: &[Histories]) -> Figure {
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

#[rustfmt::skip]
pub fn claims(all: &[Histories]) -> Vec<Claim> {
    let all @ [slow, pressed, fast, slowest]: [&Histories; 4] = std::array::from_fn(|i| &all[i]);
    let first = |quantity, ends: [&Histories; 2], sense| {
        let peaks = ends.map(|one| one.peaks_text(quantity)).join("; ");
        let found = format!("{peaks} (theory; simulation; virtual rig, by stage).");
        (all_go(ends.map(|one| one.peak(quantity, 0)), sense), found)
    };
    let second = [slow, pressed].map(|one| one.peak(Collision, 1));
    let more = |stage| change(slow.peak(Collision, stage), pressed.peak(Collision, stage));
    let more_found = |stage| {
        let parts = percents(more(stage), 1, ", ");
        format!("{parts} from 100 to 120 N at 5 mm/s (theory, simulation, virtual rig).")
    };
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
    table("fig11", SECTION, [
        row("collision-decays-periodically", (humps > 3, format!(
                "At most {humps} peaks in a deployment with three transitions, in the simulation."
            )),
            "The collision force decays periodically, because the tread is elastic.",
            "One peak a transition. The wheel closes in on the corner at 2 to 4 mm/s and never \
             leaves it: it climbs and does not bounce."),
        row("collision-falls-with-preload", first(Collision, [slow, pressed], FALLS),
            "At 5 mm/s the collision force of the first transition is smaller at 120 N than at \
             100 N.",
            "It is larger, as climbing must be: the axial force is the pressing force times the \
             tangent of the angle at which the corner bears. The study contradicts itself here \
             between its first and its second transition."),
        row("collision-grows-with-speed", first(Collision, [slow, fast], RISES),
            "At 100 N the collision is larger at 8 mm/s than at 5 mm/s.", ""),
        row("collision-grows-with-speed-120", first(Collision, [slowest, pressed], RISES),
            "At 120 N, too, the collision grows with the speed (5 mm/s against 3 mm/s).", ""),
        row("second-collision-grows-with-preload",
            (all_go(second, RISES), more_found(1)),
            "In the second transition more preload makes for a larger force.", ""),
        row("third-collision-equal", (within(more(2), NEARLY), more_found(2)),
            "In the third transition 20 N more preload make no difference: the peaks are nearly \
             identical.",
            "Nothing in the third transition differs but the inclination of the arm, by two \
             degrees from the second: more preload has the same effect in all three."),
        row("stress-of-collision-less-preload", (in_order, format!(
                "Collision less preload and impact of the four cases (simulation): {}.",
                stresses.join("; "))),
            "The stress wave is determined by the difference between collision force and preload.",
            "The two are not even in the same order: the speed stiffens the tread and narrows the \
             contact, which raises the stress at nearly the same force."),
        row("impact-decays-to-zero", (left < GONE, format!(
                "Once the wheel is on the last sleeve at most {left:.3} of the peak is left, in \
                 any case and source.")),
            "The impact load decays to zero.", ""),
        row("impact-falls-with-preload", first(Impact, [slow, pressed], FALLS),
            "More preload makes for a smaller impact in the first transition.",
            "The force grows more than the area on which it acts."),
        row("vibration-grows-with-speed", first(Vibration, [slow, fast], RISES),
            "At the same load and preload the vibration amplitude grows with the speed.", ""),
        row("vibration-falls-with-preload", first(Vibration, [slow, pressed], FALLS),
            "At the same load and speed more preload makes for a smaller vibration amplitude.",
            "The arm's deflection follows the collision force, which grows. What does fall is the \
             gap, which the study equates with the amplitude: figures 15 and 16."),
    ])
}
