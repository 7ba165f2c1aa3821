//! Figure 24: collision, impact and vibration over the three transitions at rig loads.

use std::ops::RangeInclusive;

use super::case::{Case, Loads};
use super::claims::{BySource, FALLS, RISES, Verdict, all_go, fixed, goes, largest, spans, within};
use super::histories::{Histories, panels};
use super::history::Quantity::{self, Collision, Impact, Vibration};
use crate::figure::{Figure, SOURCES, Source};

/// Cases: the study's four at a third of their preload, which spans the 33 to 40 N that
/// it names. Its own table of them is not published.
pub(super) const CASES: [(f64, f64); 4] = [(5.0, 33.3), (5.0, 40.0), (8.0, 33.3), (3.0, 40.0)];

/// Time of the first collision in the study, s.
const FIRST_BEFORE_S: f64 = 2.0;

/// Time that the study's figure allows for a peak "at 2 s", s: plus or minus its log's
/// interval.
const AT_2_S: RangeInclusive<f64> = 1.9..=2.1;

pub(super) fn cases() -> [Case; 4] {
    CASES.map(|(speed, preload)| Case::new(Loads::Prototype, speed, preload))
}

pub(super) fn figure(all: &[Histories]) -> Figure {
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

pub(super) fn verdicts(all: &[Histories]) -> Vec<Verdict> {
    let all @ [_, _, fast, _]: [&Histories; 4] = std::array::from_fn(|i| &all[i]);
    let least = |of: &dyn Fn(&Histories) -> f64| all.map(of).into_iter().fold(1.0, f64::min);
    let shapes = Quantity::ALL.map(|quantity| least(&|one| likeness(one, quantity)));
    let falls = |id, quantity| -> Verdict {
        let peaks = all.map(|one| one.peak_values(quantity));
        let is_falling = peaks.iter().flatten().all(|by_stage| goes(by_stage, FALLS));
        (id, is_falling, vec![all.map(|one| one.peaks_text(quantity)).join(". ")])
    };
    let following = [Impact, Vibration].map(|quantity| least(&|one| following(one, quantity)));
    let left: [f64; 3] = std::array::from_fn(|source| {
        let over = |one: &Histories| Quantity::ALL.map(|quantity| one.left_over(quantity)[source]);
        largest(all.into_iter().flat_map(over))
    });
    let peaks = fast.peak_values(Collision);
    let first_highest = peaks.iter().all(|by_stage| largest(*by_stage) <= by_stage[0]);
    let [collided, hit, shaken] =
        Quantity::ALL.map(|quantity| SOURCES.map(|source| fast.peaks(quantity, source)[0].time_s));
    let seconds = |times: BySource| times.map(|t| format!("{t:.2}")).join(", ");
    let until = fast.first_passed_s + 0.25;
    let humps = SOURCES.map(|source| {
        let points = fast.points(Vibration, source);
        let first = points.iter().take_while(|p| p.0 <= until);
        count_humps(first.map(|p| p.1), 0.05)
    });
    let pairs = |id, related: fn(&Case, &Case) -> bool, sense| -> Verdict {
        let pairs = all.into_iter().flat_map(|a| all.map(|b| [a, b]));
        let pairs: Vec<_> = pairs.filter(|[a, b]| related(&a.case, &b.case)).collect();
        let first = |pair: &[&Histories; 2]| pair.map(|one| one.peak(Collision, 0));
        let text = |pair: &[&Histories; 2]| {
            let [from, to] = pair.map(|one| one.case.name());
            format!("{from} to {to}: {}", spans(first(pair), 1, "N"))
        };
        let texts = pairs.iter().map(text).collect::<Vec<_>>().join("; ");
        (id, pairs.iter().all(|pair| all_go(first(pair), sense)), vec![texts])
    };
    let is_faster = |a: &Case, b: &Case| a.preload_n == b.preload_n && a.speed_mm_s < b.speed_mm_s;
    let is_pressed = |a: &Case, b: &Case| a.speed_mm_s == b.speed_mm_s && a.preload_n < b.preload_n;
    let are_like = shapes.iter().all(|&shape| shape > 0.9);
    let are_following = following.iter().all(|&least| least > 0.7);
    let is_before = largest(collided) < FIRST_BEFORE_S && first_highest;
    let is_after = hit.iter().zip(collided).all(|(t, before)| AT_2_S.contains(t) && *t > before);
    let is_twice = humps.iter().all(|&count| count >= 2);
    let peaks = humps.map(|count| count.to_string()).into_iter().chain([seconds(shaken)]);
    vec![
        ("three-sources-agree", are_like, fixed(3, shapes)),
        falls("collision-peaks-fall", Collision),
        falls("impact-peaks-fall", Impact),
        falls("vibration-peaks-fall", Vibration),
        ("impact-and-vibration-fall-with-collision", are_following, fixed(2, following)),
        ("nothing-after-the-third", within(left, 0.05), fixed(3, left)),
        ("collision-before-2-s", is_before, vec![seconds(collided)]),
        ("impact-at-2-s", is_after, vec![seconds(hit), seconds(collided)]),
        ("vibration-peaks-twice", is_twice, peaks.collect()),
        pairs("collision-grows-with-speed-rig", is_faster, RISES),
        pairs("collision-falls-with-preload-rig", is_pressed, FALLS),
    ]
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
