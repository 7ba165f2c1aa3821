//! Figure 24: collision, impact and vibration over the three transitions at rig loads.

use super::case::{Case, Loads};
use super::experiment::STAGES;
use super::histories::Quantity;
use super::histories::{Histories, panels};
use crate::figure::{Claim, Figure, SOURCES, Source};

/// Cases: the study's four at a third of their preload, which spans the 33 to 40 N that
/// it names. Its own table of them is not published.
pub const CASES: [(f64, f64); 4] = [(5.0, 33.3), (5.0, 40.0), (8.0, 33.3), (3.0, 40.0)];

const SECTION: &str = "Analysis and discussion of test results";

/// Time of the first collision in the study, s.
const FIRST_BEFORE_S: f64 = 2.0;

/// Time that the study's figure allows for a peak "at 2 s", s: plus or minus its log's
/// interval.
const AT_2_S: (f64, f64) = (1.9, 2.1);

pub fn cases() -> Vec<Case> {
    CASES.map(|(speed, preload)| Case::new(Loads::Prototype, speed, preload)).to_vec()
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

/// The peaks of the stages as text.
pub(super) fn peaks_text(one: &Histories, quantity: Quantity) -> String {
    let of = |source| {
        let peaks = one.peaks(quantity, source).map(|peak| format!("{:.1}", peak.value));
        peaks.join(", ")
    };
    let [theory, simulation, experiment] = SOURCES.map(of);
    format!("{}: {theory}; {simulation}; {experiment}", one.case.name())
}

/// Whether the peaks fall from stage to stage in every source.
pub(super) fn fall(one: &Histories, quantity: Quantity) -> bool {
    SOURCES.into_iter().all(|source| {
        let peaks = one.peaks(quantity, source);
        peaks.windows(2).all(|pair| pair[1].value < pair[0].value)
    })
}

/// The claims about it; `all` in the order of [`CASES`].
pub fn claims(all: &[Histories]) -> Vec<Claim> {
    let of = |id| Claim::of("fig24", SECTION, id);
    let shapes = Quantity::ALL.map(|quantity| {
        all.iter().map(|one| likeness(one, quantity)).fold(f64::INFINITY, f64::min)
    });
    let fast = &all[2];
    let first = |quantity| SOURCES.map(|source| fast.peaks(quantity, source)[0].time_s);
    let falls = |quantity| all.iter().all(|one| fall(one, quantity));
    let texts = |quantity: Quantity| {
        let all: Vec<String> = all.iter().map(|one| peaks_text(one, quantity)).collect();
        format!(
            "By stage, {} (theory; simulation; virtual rig). {}. Of what makes the stages differ there is \
             the inclination of the arm alone: its thrust on the wheel falls by a few per cent from sleeve to sleeve.",
            quantity.axis(),
            all.join(". ")
        )
    };
    let left = SOURCES.map(|source| {
        let over = |one: &Histories| Quantity::ALL.map(|quantity| one.left_over(quantity, source));
        all.iter().flat_map(over).fold(0.0, f64::max)
    });
    let [collided, hit, shaken] = Quantity::ALL.map(first);
    let seconds = |times: [f64; 3]| times.map(|t| format!("{t:.2}")).join(", ");
    let humps = SOURCES.map(|source| humps(fast, Quantity::Vibration, source));
    let faster = all_pairs(all, |a, b| a.preload_n == b.preload_n && a.speed_mm_s < b.speed_mm_s);
    let pressed = all_pairs(all, |a, b| a.speed_mm_s == b.speed_mm_s && a.preload_n < b.preload_n);
    vec![
        of("three-sources-agree").fitted().explained(
            "Collision, impact and vibration show the same trends in theory, simulation and \
             virtual rig.",
            shapes.iter().all(|&shape| shape > 0.9),
            format!(
                "Least correlation of simulation and virtual rig at the log's times with theory \
                 over the four cases: collision {:.3}, impact {:.3}, vibration {:.3}.",
                shapes[0], shapes[1], shapes[2]
            ),
            "The pulses are the same; they lie by up to 0.2 s apart, as each rig's steps do.",
        ),
        of("collision-peaks-fall").judged(
            "The peaks of the collision fall from the first transition to the third.",
            falls(Quantity::Collision),
            texts(Quantity::Collision),
        ),
        of("impact-peaks-fall").explained(
            "The peaks of the impact fall from the first transition to the third.",
            falls(Quantity::Impact),
            texts(Quantity::Impact),
            "They differ by a per cent or two, which is what a log of 0.1 s leaves of a peak.",
        ),
        of("vibration-peaks-fall").judged(
            "The peaks of the vibration fall from the first transition to the third.",
            falls(Quantity::Vibration),
            texts(Quantity::Vibration),
        ),
        of("impact-and-vibration-fall-with-collision").judged(
            "Impact and vibration diminish as the collision does.",
            all.iter().all(|one| follows(one, Quantity::Impact) && follows(one, Quantity::Vibration)),
            format!(
                "Least correlation with the collision within a source: impact {:.2}, vibration \
                 {:.2}.",
                least_following(all, Quantity::Impact),
                least_following(all, Quantity::Vibration)
            ),
        ),
        of("nothing-after-the-third").judged(
            "After the third transition the values approach zero: contact is smooth.",
            left.iter().all(|&part| part < 0.05),
            format!(
                "Largest value after it, beyond that before the first, over the largest of all: theory \
                 {:.3}, simulation {:.3}, virtual rig {:.3}. What is there before and after is the \
                 drive's torque ripple, which shakes the arm between the steps as well.",
                left[0], left[1], left[2]
            ),
        ),
        of("collision-before-2-s").judged(
            "The largest collision comes in the first transition, before 2 s.",
            collided.iter().all(|&t| t < FIRST_BEFORE_S) && highest_first(fast, Quantity::Collision),
            format!("At 8 mm/s, 33.3 N: {} s (theory, simulation, virtual rig).", seconds(collided)),
        ),
        of("impact-at-2-s").explained(
            "The impact peaks at 2 s, after the collision, held up by the tread's deformation.",
            hit.iter().all(|&t| (AT_2_S.0..=AT_2_S.1).contains(&t))
                && hit.iter().zip(&collided).all(|(hit, collided)| hit > collided),
            format!(
                "At 8 mm/s, 33.3 N: {} s, against {} s of the collision (theory, simulation, \
                 virtual rig).",
                seconds(hit),
                seconds(collided)
            ),
            "The stress peaks no later than the force: the corner then presses on a narrow part of the tread. A \
             stress wave crosses the tread in about 0.1 ms: it cannot hold anything up by tenths of \
             a second.",
        ),
        of("vibration-peaks-twice").explained(
            "The vibration peaks before 2 s and again after it.",
            humps.iter().all(|&count| count >= 2),
            format!(
                "Peaks of the first transition at 8 mm/s, 33.3 N: {}, {}, {} (theory, simulation, \
                 virtual rig), at {} s.",
                humps[0],
                humps[1],
                humps[2],
                seconds(shaken)
            ),
            "The arm follows the collision within milliseconds (its first mode is 276 Hz) and has \
             one peak with it; no second one arises from stress waves.",
        ),
        of("collision-grows-with-speed-rig").judged(
            "Within one sleeve and at the same preload, a faster wheel meets a larger collision.",
            faster.iter().all(|(a, b)| first_rises(a, b, Quantity::Collision, 1.0)),
            pairs_text(&faster),
        ),
        of("collision-falls-with-preload-rig").explained(
            "Within one sleeve and at the same speed, more preload makes for a smaller collision.",
            pressed.iter().all(|(a, b)| first_rises(a, b, Quantity::Collision, -1.0)),
            pairs_text(&pressed),
            "It makes for a larger one: the wheel climbs with the force that presses it, P tan of the \
             angle at which the corner bears; the smaller gap turns that angle down by less than the \
             force grows.",
        ),
    ]
}

type Pair<'a> = (&'a Histories, &'a Histories);

fn all_pairs(all: &[Histories], related: impl Fn(&Case, &Case) -> bool) -> Vec<Pair<'_>> {
    let pairs = all.iter().flat_map(|a| all.iter().map(move |b| (a, b)));
    pairs.filter(|(a, b)| related(&a.case, &b.case)).collect()
}

/// Whether the first peak rises (falls) from one case to another in every source.
pub(super) fn first_rises(a: &Histories, b: &Histories, quantity: Quantity, sense: f64) -> bool {
    let firsts = a.stage(quantity, 0).into_iter().zip(b.stage(quantity, 0));
    firsts.into_iter().all(|(a, b)| sense * (b - a) > 0.0)
}

fn pairs_text(pairs: &[Pair]) -> String {
    let text = |(a, b): &Pair| {
        let [first_a, first_b] = [a, b].map(|one| one.stage(Quantity::Collision, 0));
        let change = |(a, b)| format!("{a:.1} to {b:.1} N");
        let changes: Vec<String> = first_a.into_iter().zip(first_b).map(change).collect();
        format!("{} to {}: {}", a.case.name(), b.case.name(), changes.join(", "))
    };
    let all: Vec<String> = pairs.iter().map(text).collect();
    format!("{} (theory, simulation, virtual rig).", all.join("; "))
}

/// Whether the highest peak is that of the first stage, in every source.
fn highest_first(one: &Histories, quantity: Quantity) -> bool {
    let first = one.stage(quantity, 0);
    (1..STAGES)
        .all(|n| one.stage(quantity, n).iter().zip(first).all(|(peak, first)| *peak <= first))
}

/// Local maxima of the first transition that exceed both neighbouring minima by a
/// twentieth of its peak.
fn humps(one: &Histories, quantity: Quantity, source: Source) -> usize {
    let until = one.first_passed_s + 0.25;
    let points = one.points(quantity, source);
    count_humps(points.iter().take_while(|p| p.0 <= until).map(|p| p.1), 0.05)
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
        let other = one.points(quantity, source);
        let pairs: Vec<(f64, f64)> =
            other.iter().filter_map(|&(t, y)| Some((y, at(&theory, t)?))).collect();
        correlation(&pairs)
    };
    against(Source::Simulation).min(against(Source::Experiment))
}

fn following(one: &Histories, quantity: Quantity, source: Source) -> f64 {
    let collision = one.points(Quantity::Collision, source);
    let other = one.points(quantity, source);
    correlation(&collision.iter().zip(&other).map(|(a, b)| (a.1, b.1)).collect::<Vec<_>>())
}

fn follows(one: &Histories, quantity: Quantity) -> bool {
    SOURCES.into_iter().all(|source| following(one, quantity, source) > 0.7)
}

fn least_following(all: &[Histories], quantity: Quantity) -> f64 {
    let of = |one: &Histories| {
        SOURCES.map(|source| following(one, quantity, source)).into_iter().fold(1.0, f64::min)
    };
    all.iter().map(of).fold(1.0, f64::min)
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
