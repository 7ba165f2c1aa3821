//! Figure 24: collision, impact and vibration over the three transitions at rig loads.

use std::ops::RangeInclusive;

use super::case::{Case, Loads};
use super::claims::{BySource, FALLS, RISES, all_go, goes, largest, row, spans, table, within};
use super::histories::{Histories, panels};
use super::history::Quantity::{self, Collision, Impact, Vibration};
use crate::figure::{Claim, Figure, SOURCES, Source};

/// Cases: the study's four at a third of their preload, which spans the 33 to 40 N that
/// it names. Its own table of them is not published.
pub const CASES: [(f64, f64); 4] = [(5.0, 33.3), (5.0, 40.0), (8.0, 33.3), (3.0, 40.0)];

/// Time of the first collision in the study, s.
const FIRST_BEFORE_S: f64 = 2.0;

/// Time that the study's figure allows for a peak "at 2 s", s: plus or minus its log's
/// interval.
const AT_2_S: RangeInclusive<f64> = 1.9..=2.1;

pub fn cases() -> [Case; 4] {
    CASES.map(|(speed, preload)| Case::new(Loads::Prototype, speed, preload))
}

pub fn figure(all: &[Histories]) -> Figure {
    let caption = "Three transitions at rig loads (20 N on top, of which this wheel lifts a \
                   third). (a) Collision: axial force of the contact against the motion, beyond \
                   rolling resistance. (b) Impact: that force over the part of the wheel that the \
                   step cuts off. (c) Vibration: deflection of the arm at the wheel by the part of the \
                   collision that lies across it. Theory: an elastic ring of the model's \
                   effective stiffness, the arm as under a still force. Simulation: the reference \
                   models, a ring with memory and inertia, waves in the tread to the hub, six modes \
                   of the arm. Virtual rig: logged every 0.1 s, four means of ten; forces are the plant's own. The study prints no value of its curves."
        .to_owned();
    let title = "Collision, impact and vibration over the three transitions";
    Figure::new("fig24", title, caption, CASES.len(), panels(all))
}

#[rustfmt::skip]
pub fn claims(all: &[Histories]) -> Vec<Claim> {
    let all @ [_, _, fast, _]: [&Histories; 4] = std::array::from_fn(|i| &all[i]);
    let least = |of: &dyn Fn(&Histories) -> f64| all.map(of).into_iter().fold(1.0, f64::min);
    let shapes = Quantity::ALL.map(|quantity| least(&|one| likeness(one, quantity)));
    let falls = |quantity: Quantity| {
        let peaks = all.map(|one| one.peak_values(quantity));
        let texts = all.map(|one| one.peaks_text(quantity)).join(". ");
        let found = format!(
            "By stage, {} (theory; simulation; virtual rig). {texts}. Of what makes the stages \
             differ there is the inclination of the arm alone: its thrust on the wheel falls by a \
             few per cent from sleeve to sleeve.",
            quantity.axis()
        );
        (peaks.iter().flatten().all(|by_stage| goes(by_stage, FALLS)), found)
    };
    let following = [Impact, Vibration].map(|quantity| least(&|one| following(one, quantity)));
    let left: [f64; 3] = std::array::from_fn(|source| {
        let over = |one: &Histories| Quantity::ALL.map(|quantity| one.left_over(quantity)[source]);
        largest(all.into_iter().flat_map(over))
    });
    let peaks = fast.peak_values(Collision);
    let first_highest = peaks.iter().all(|by_stage| largest(*by_stage) <= by_stage[0]);
    let [collided, hit, shaken] = Quantity::ALL
        .map(|quantity| SOURCES.map(|source| fast.peaks(quantity, source)[0].time_s));
    let seconds = |times: BySource| times.map(|t| format!("{t:.2}")).join(", ");
    let until = fast.first_passed_s + 0.25;
    let humps = SOURCES.map(|source| {
        let points = fast.points(Vibration, source);
        let first = points.iter().take_while(|p| p.0 <= until);
        count_humps(first.map(|p| p.1), 0.05)
    });
    let pairs = |related: fn(&Case, &Case) -> bool, sense| {
        let pairs = all.into_iter().flat_map(|a| all.map(|b| [a, b]));
        let pairs: Vec<_> = pairs.filter(|[a, b]| related(&a.case, &b.case)).collect();
        let first = |pair: &[&Histories; 2]| pair.map(|one| one.peak(Collision, 0));
        let text = |pair: &[&Histories; 2]| {
            let [from, to] = pair.map(|one| one.case.name());
            format!("{from} to {to}: {}", spans(first(pair), 1, "N"))
        };
        let texts = pairs.iter().map(text).collect::<Vec<_>>().join("; ");
        let found = format!("{texts} (theory, simulation, virtual rig).");
        (pairs.iter().all(|pair| all_go(first(pair), sense)), found)
    };
    table("fig24", "Analysis and discussion of test results", [
        row("three-sources-agree", (shapes.iter().all(|&shape| shape > 0.9), format!(
                "Least correlation of simulation and virtual rig at the log's times with theory \
                 over the four cases: collision {:.3}, impact {:.3}, vibration {:.3}.",
                shapes[0], shapes[1], shapes[2])),
            "Collision, impact and vibration show the same trends in theory, simulation and \
             virtual rig.",
            "The pulses are the same; they lie by up to 0.2 s apart, as each rig's steps \
             do.").fitted(),
        row("collision-peaks-fall", falls(Collision),
            "The peaks of the collision fall from the first transition to the third.", ""),
        row("impact-peaks-fall", falls(Impact),
            "The peaks of the impact fall from the first transition to the third.",
            "They differ by a per cent or two, which is what a log of 0.1 s leaves of a peak."),
        row("vibration-peaks-fall", falls(Vibration),
            "The peaks of the vibration fall from the first transition to the third.", ""),
        row("impact-and-vibration-fall-with-collision",
            (following.iter().all(|&least| least > 0.7), format!(
                "Least correlation with the collision within a source: impact {:.2}, vibration \
                 {:.2}.",
                following[0], following[1])),
            "Impact and vibration diminish as the collision does.", ""),
        row("nothing-after-the-third", (within(left, 0.05), format!(
                "Largest value after it, beyond that before the first, over the largest of all: \
                 theory {:.3}, simulation {:.3}, virtual rig {:.3}. What is there before and after \
                 is the drive's torque ripple, which shakes the arm between the steps as well.",
                left[0], left[1], left[2])),
            "After the third transition the values approach zero: contact is smooth.", ""),
        row("collision-before-2-s", (largest(collided) < FIRST_BEFORE_S && first_highest, format!(
                "At 8 mm/s, 33.3 N: {} s (theory, simulation, virtual rig).", seconds(collided))),
            "The largest collision comes in the first transition, before 2 s.", ""),
        row("impact-at-2-s",
            (hit.iter().zip(collided).all(|(t, before)| AT_2_S.contains(t) && *t > before), format!(
                "At 8 mm/s, 33.3 N: {} s, against {} s of the collision (theory, simulation, \
                 virtual rig).", seconds(hit), seconds(collided))),
            "The impact peaks at 2 s, after the collision, held up by the tread's deformation.",
            "The stress peaks no later than the force: the corner then presses on a narrow part of \
             the tread. A stress wave crosses the tread in about 0.1 ms: it cannot hold anything \
             up by tenths of a second."),
        row("vibration-peaks-twice", (humps.iter().all(|&count| count >= 2), format!(
                "Peaks of the first transition at 8 mm/s, 33.3 N: {}, {}, {} (theory, simulation, \
                 virtual rig), at {} s.", humps[0], humps[1], humps[2], seconds(shaken))),
            "The vibration peaks before 2 s and again after it.",
            "The arm follows the collision within milliseconds (its first mode is 276 Hz) and has \
             one peak with it; no second one arises from stress waves."),
        row("collision-grows-with-speed-rig",
            pairs(|a, b| a.preload_n == b.preload_n && a.speed_mm_s < b.speed_mm_s, RISES),
            "Within one sleeve and at the same preload, a faster wheel meets a larger \
             collision.", ""),
        row("collision-falls-with-preload-rig",
            pairs(|a, b| a.speed_mm_s == b.speed_mm_s && a.preload_n < b.preload_n, FALLS),
            "Within one sleeve and at the same speed, more preload makes for a smaller collision.",
            "It makes for a larger one: the wheel climbs with the force that presses it, P tan of \
             the angle at which the corner bears; the smaller gap turns that angle down by less \
             than the force grows."),
    ])
}

/// Local maxima that exceed the minima before and after them by this part of the largest
/// value.
pub(super) fn count_humps(values: impl Iterator<Item = f64> + Clone, part: f64) -> usize {
    let least = part * values.clone().fold(0.0, f64::max);
    let first = values.clone().next().unwrap_or(0.0);
    // The valley before, and the extreme since.
    let (mut valley, mut extreme, mut rising, mut count) = (first, first, true, 0);
    for value in values {
        extreme = if rising { f64::max(extreme, value) } else { f64::min(extreme, value) };
        if (value - extreme).abs() <= least {
            continue;
        }
        if rising && extreme - valley > least {
            count += 1;
        }
        valley = extreme;
        (rising, extreme) = (!rising, value);
    }
    count
}

/// Least correlation of simulation and experiment with theory, at the log's times.
fn likeness(one: &Histories, quantity: Quantity) -> f64 {
    let theory = one.points(quantity, Source::Theory);
    let against = |source| {
        let points = one.points(quantity, source).into_iter();
        let pairs = points.filter_map(|(t, y)| Some((y, at(&theory, t)?)));
        correlation(&pairs.collect::<Vec<_>>())
    };
    against(Source::Simulation).min(against(Source::Experiment))
}

/// Least correlation with the collision within a source.
fn following(one: &Histories, quantity: Quantity) -> f64 {
    let within = |source| {
        let pairs = one.points(Collision, source).into_iter().zip(one.points(quantity, source));
        correlation(&pairs.map(|(a, b)| (a.1, b.1)).collect::<Vec<_>>())
    };
    SOURCES.map(within).into_iter().fold(1.0, f64::min)
}

/// Value at a time, linear between points; none outside.
pub(super) fn at(points: &[(f64, f64)], time: f64) -> Option<f64> {
    let next = points.partition_point(|p| p.0 < time);
    let (a, b) = (points.get(next.checked_sub(1)?)?, points.get(next)?);
    Some(a.1 + (time - a.0) / (b.0 - a.0) * (b.1 - a.1))
}

/// Pearson's correlation.
fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    let mean = |pick: fn(&(f64, f64)) -> f64| pairs.iter().map(pick).sum::<f64>() / count;
    let (a, b) = (mean(|p| p.0), mean(|p| p.1));
    let sum = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>();
    let product = sum(&|p| (p.0 - a) * (p.1 - b));
    product / (sum(&|p| (p.0 - a).powi(2)) * sum(&|p| (p.1 - b).powi(2))).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn humps_are_counted() {
        for (values, count) in [
            ([0.0, 1.0, 3.0, 2.0, 1.0], 1),
            ([0.0, 3.0, 1.0, 3.0, 0.0], 2),
            ([0.0, 3.0, 2.99, 3.0, 0.0], 1),
            ([0.0, 0.0, 0.0, 0.0, 0.0], 0),
            ([5.0, 3.0, 1.0, 4.0, 0.0], 1),
        ] {
            assert_eq!(count_humps([values.as_slice(), &[0.0]].concat().into_iter(), 0.05), count);
        }
    }

    #[test]
    fn correlation_is_one_for_lines() {
        let line: Vec<(f64, f64)> = (0..9).map(|i| (f64::from(i), 3.0 - f64::from(i))).collect();
        assert!((correlation(&line) + 1.0).abs() < 1e-12);
    }

    #[test]
    fn values_are_interpolated_and_not_extrapolated() {
        let points = [(0.0, 1.0), (1.0, 3.0)];
        assert_eq!(at(&points, 0.25), Some(1.5));
        assert_eq!(at(&points, 1.5), None);
    }
}
