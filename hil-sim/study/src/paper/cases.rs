//! Figure 11: collision, impact and vibration of the study's four cases, at its own
//! loads.

use super::case::{Case, Loads};
use super::histories::Quantity;
use super::histories::{Histories, panels};
use super::published::{CASES, COLLISION_N};
use super::transitions::{count_humps, first_rises, peaks_text};
use crate::figure::{Claim, Figure, SOURCES, Series, Source};

const SECTION: &str = "Vibration transmission model";

/// Part of a peak that is as good as nothing.
const GONE: f64 = 0.02;

/// Two forces no farther apart than this, relative, are nearly identical.
const NEARLY: f64 = 0.03;

/// The study's four cases.
pub fn cases() -> Vec<Case> {
    CASES.map(|(speed, preload)| Case::new(Loads::Fe, speed, preload)).to_vec()
}

pub fn figure(all: &[Histories]) -> Figure {
    let mut panels = panels(all);
    for ((panel, one), force) in panels.iter_mut().zip(all).zip(COLLISION_N) {
        let when = one.peaks(Quantity::Collision, Source::Simulation)[0].time_s;
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

/// The claims about it; `all` in the order of [`CASES`].
pub fn claims(all: &[Histories]) -> Vec<Claim> {
    let of = |id| Claim::of("fig11", SECTION, id);
    let [slow, pressed, fast, slowest] = [&all[0], &all[1], &all[2], &all[3]];
    // The first peak rises (falls) from the one case to the other.
    let rises = |id, (a, b): (&Histories, &Histories), quantity, sense, claim, reason| {
        let [before, after] = [a, b].map(|one| peaks_text(one, quantity));
        let found = format!("{before}; {after} (theory; simulation; virtual rig, by stage).");
        of(id).explained(claim, first_rises(a, b, quantity, sense), found, reason)
    };
    let (collision, impact, vibration) =
        (Quantity::Collision, Quantity::Impact, Quantity::Vibration);
    let stage = |number: usize| {
        let [of_pressed, of_slow] = [pressed, slow].map(|one| one.stage(collision, number));
        std::array::from_fn::<f64, 3, _>(|source| of_pressed[source] / of_slow[source] - 1.0)
    };
    let percent = |parts: [f64; 3]| parts.map(|part| format!("{:+.1} %", 100.0 * part)).join(", ");
    let humps = |one: &Histories| {
        let points = one.points(collision, Source::Simulation);
        count_humps(points.iter().map(|p| p.1), 0.02)
    };
    let humps = all.iter().map(humps).max().unwrap_or(0);
    vec![
        of("collision-decays-periodically").explained(
            "The collision force decays periodically, because the tread is elastic.",
            humps > 3,
            format!("At most {humps} peaks in a deployment with three transitions, in the simulation."),
            "One peak a transition. The wheel closes in on the corner at 2 to 4 mm/s and never leaves it: \
             it climbs and does not bounce.",
        ),
        rises("collision-falls-with-preload", (slow, pressed), collision, -1.0,
            "At 5 mm/s the collision force of the first transition is smaller at 120 N than at 100 N.",
            "It is larger, as climbing must be: the axial force is the pressing force times the tangent of \
             the angle at which the corner bears. The study contradicts itself here between its first and \
             its second transition.",
        ),
        rises("collision-grows-with-speed", (slow, fast), collision, 1.0,
            "At 100 N the collision is larger at 8 mm/s than at 5 mm/s.",
            "",
        ),
        rises("collision-grows-with-speed-120", (slowest, pressed), collision, 1.0,
            "At 120 N, too, the collision grows with the speed (5 mm/s against 3 mm/s).",
            "",
        ),
        of("second-collision-grows-with-preload").judged(
            "In the second transition more preload makes for a larger force.",
            stage(1).iter().all(|&part| part > 0.0),
            format!("{} from 100 to 120 N at 5 mm/s (theory, simulation, virtual rig).", percent(stage(1))),
        ),
        of("third-collision-equal").explained(
            "In the third transition 20 N more preload make no difference: the peaks are nearly identical.",
            stage(2).iter().all(|part| part.abs() < NEARLY),
            format!("{} from 100 to 120 N at 5 mm/s (theory, simulation, virtual rig).", percent(stage(2))),
            "Nothing in the third transition differs but the inclination of the arm, by two degrees from the \
             second: more preload has the same effect in all three.",
        ),
        of("stress-of-collision-less-preload").explained(
            "The stress wave is determined by the difference between collision force and preload.",
            SOURCES.into_iter().all(|source| {
                let of = |quantity| all.iter().map(move |one: &Histories| one.peaks(quantity, source)[0].value);
                let less = of(collision).zip(all).map(|(force, one)| force - one.case.preload_n);
                order(&less.collect::<Vec<_>>()) == order(&of(impact).collect::<Vec<_>>())
            }),
            format!(
                "Collision less preload and impact of the four cases (simulation): {}.",
                all.iter()
                    .map(|one| {
                        let peak = |quantity| one.peaks(quantity, Source::Simulation)[0].value;
                        format!("{:.1} N, {:.0} kPa", peak(collision) - one.case.preload_n, peak(impact))
                    })
                    .collect::<Vec<_>>()
                    .join("; ")
            ),
            "The two are not even in the same order: the speed stiffens the tread and narrows the contact, \
             which raises the stress at nearly the same force.",
        ),
        of("impact-decays-to-zero").judged(
            "The impact load decays to zero.",
            all.iter().all(|one| {
                SOURCES.into_iter().all(|source| one.left_over(impact, source) < GONE)
            }),
            format!(
                "Once the wheel is on the last sleeve at most {:.3} of the peak is left, in any case and \
                 source.",
                all.iter()
                    .flat_map(|one| SOURCES.map(|source| one.left_over(impact, source)))
                    .fold(0.0, f64::max)
            ),
        ),
        rises("impact-falls-with-preload", (slow, pressed), impact, -1.0,
            "More preload makes for a smaller impact in the first transition.",
            "The force grows more than the area on which it acts.",
        ),
        rises("vibration-grows-with-speed", (slow, fast), vibration, 1.0,
            "At the same load and preload the vibration amplitude grows with the speed.",
            "",
        ),
        rises("vibration-falls-with-preload", (slow, pressed), vibration, -1.0,
            "At the same load and speed more preload makes for a smaller vibration amplitude.",
            "The arm's deflection follows the collision force, which grows. What does fall is the gap, which \
             the study equates with the amplitude: figures 15 and 16.",
        ),
    ]
}

/// Places of the values in ascending order.
fn order(values: &[f64]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..values.len()).collect();
    places.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    places
}
