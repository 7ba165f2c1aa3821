//! The slide of a retracting wheel before the lower wall takes it.
//!
//! The edge under the wheel shows its face at `x + sqrt((R - c)^2 - (R - f)^2)`, with the fall f
//! below the upper wall and the compression c, which grows on the edge. While the wheel rolls, the
//! face stays where it is; it moves outwards while the wheel slides, and inwards once the lower
//! wall carries, because the wheel no longer falls. There the compression falls, too, which must
//! not look like a slide: where the wheel landed is found with the largest compression so far.

use crate::numeric::{divide, sqrt};
use crate::units::{Millimetres, Q16, Ratio, Travel, q16};

/// Part of the tread's travel by which the face must move for a slide, or for a wall that carries: a sensor
/// of the mean, creep and coupled rubber move it by a tenth. Without a derivation between that and 0.5.
const MOVES: Ratio = q16(250_000);
/// Least slide by the largest compression, mm: three deviations of an edge's place by the arm's code.
const SHOWN: Millimetres = q16(90_000);
/// Least slide in all, mm: two sigma of what it is off by, with the reading's own.
const SLID: Millimetres = q16(300_000);
/// Distance by which the face has moved inwards once the wheel has landed, mm.
const LANDED: Millimetres = q16(200_000);
/// Part that the largest compression has in the slide, the rest has the compression as read: a tread that
/// slides is stiffer, and a wall that carries makes it shallower. By which part a slide goes on while the
/// edge hands over the load. Fitted to 34 slides of virtual rigs: one sigma of 0.15 mm.
const BY_LARGEST: Ratio = q16(750_000);
const GOES_ON: Ratio = q16(600_000);
/// Travels of the tread by which the face moves at most while a wall takes a wheel that rolls: twice what a
/// sensor of the mean makes of a creeping wheel on virtual rigs, without a derivation.
const ROLLS: Ratio = q16(3_000_000);
/// Motion of the face in a tick that is none of a slide, mm: 5 mm/s. A wheel that slides is out of balance,
/// faster after 0.1 mm at 0.13 m/s2; a tread that relaxes beside a slow wheel is slower.
const SINKS: Millimetres = q16(5_000);

/// A wheel on the edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OnEdge {
    /// Travel of the tread when the arm was there.
    pub travel: Travel,
    /// Position, mm.
    pub position: Millimetres,
    /// Fall below the upper wall, mm.
    pub fall: Millimetres,
    /// Compression, mm.
    pub depth: Millimetres,
    /// What the tread has given way by, outwards, as its model has it.
    pub gave: Travel,
}

impl OnEdge {
    /// Axial distance from the centre of a wheel of this radius to the face, mm.
    pub(super) fn ahead(&self, radius: Millimetres) -> Millimetres {
        let (over, reach) = (radius - self.fall, radius - self.depth);
        sqrt((reach * reach - over * over).max(Q16::ZERO))
    }
}

/// A retracting wheel as the lower wall took it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Landing {
    /// Position of the face by the edge, before any slide or where the wheel lands, mm.
    pub face: Millimetres,
    /// How far the wheel slides in all, mm; 0 if it rolls.
    pub slid: Millimetres,
    /// By how much it is further in than its position has it, mm: a climb without a turn counted as one.
    pub lost: Millimetres,
}

impl Landing {
    /// One sigma of the slide, mm: what the fit leaves, and that of the part that goes on, anything
    /// from none to twice as much, evenly spread: `0.577 * 0.6 / 1.6`.
    pub fn sigma(&self) -> Millimetres {
        q16(150_000) + self.slid * q16(217_000)
    }
}

/// Where a tick has the face over the axial travel, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Face {
    by_largest: Millimetres,
    as_read: Millimetres,
    /// Axial travel by the tread since the edge was first seen, mm.
    travelled: Millimetres,
    at: OnEdge,
    /// Its position by the compression as read, mm.
    position: Millimetres,
    /// As read, less what [`MOVES`] or [`SINKS`] explain: least where a slide begins, mm.
    beyond: Millimetres,
}

impl Face {
    /// Largest where the wheel lands.
    fn end(&self) -> Millimetres {
        self.by_largest + self.travelled * MOVES
    }
}

/// What is kept of a retracting wheel on an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slide {
    travel: Option<Travel>,
    travelled: Millimetres,
    /// The same in a tick, smoothed.
    turns: Millimetres,
    /// By how much a wheel that rolls may have moved the face: by [`MOVES`] and by [`ROLLS`], mm.
    rolled: [Millimetres; 2],
    /// Largest compression, mm.
    deepest: Millimetres,
    begin: Option<Face>,
    /// Begin and end of the slide, if the wheel landed at the end.
    found: Option<(Face, Face)>,
    /// Least and largest rise so far of what grows in a slide alone, mm.
    least: Option<Millimetres>,
    beyond: Millimetres,
    landed: bool,
}

impl Slide {
    /// A tick of a wheel of this radius, mm, on an edge; its landing, once, when it is seen.
    pub fn step(&mut self, radius: Millimetres, at: &OnEdge) -> Option<Landing> {
        self.deepest = self.deepest.max(at.depth);
        let over = radius - at.fall;
        let edge = |depth: Millimetres| OnEdge { depth, ..*at }.ahead(radius);
        let turned = self.travel.map_or(Travel::ZERO, |travel| travel.saturating_sub(at.travel));
        let turned = Q16::narrow(turned) * divide(over, radius - at.depth).min(Ratio::ONE);
        self.travelled += turned;
        // Over some ticks: a slow wheel's encoder counts in few of them.
        self.turns += (turned - self.turns) * q16(125_000);
        for (rolled, travels) in self.rolled.iter_mut().zip([MOVES, ROLLS]) {
            *rolled += (self.turns * travels).max(SINKS);
        }
        self.travel = Some(at.travel);
        let as_read = edge(at.depth) - self.travelled;
        let [of_slide, beyond] = self.rolled.map(|rolled| as_read - rolled);
        let face = Face {
            by_largest: edge(self.deepest) - self.travelled,
            as_read,
            travelled: self.travelled,
            at: *at,
            position: at.position + edge(at.depth),
            beyond: of_slide,
        };
        let least = self.least.map_or(beyond, |least| least.min(beyond));
        self.least = Some(least);
        self.beyond = self.beyond.max(beyond - least);
        // On a wheel that creeps noise may look like a landing: a slide behind it still counts.
        if self.landed {
            return None;
        }
        let begin = self.begin.filter(|begin| begin.beyond <= face.beyond).unwrap_or(face);
        self.begin = Some(begin);
        let most = self.found.map_or(Q16::MIN, |(_, end)| end.end());
        if face.end() >= most {
            self.found = Some((begin, face));
        }
        self.landed = face.end() < most - LANDED;
        if self.landed { self.landing() } else { None }
    }

    /// The landing as far as it was seen.
    pub fn landing(&self) -> Option<Landing> {
        let (begin, end) = self.found?;
        let by_largest = end.by_largest - begin.by_largest;
        let as_read = end.as_read - begin.as_read;
        let less = (by_largest - as_read) * BY_LARGEST;
        let on = (as_read + less) * GOES_ON;
        let slid = as_read + less + on;
        // What is more than a tread moves it by that rolls must have been fast.
        let more = as_read - (end.travelled - begin.travelled) * ROLLS;
        let fast = more.min(SLID.half()) <= self.beyond;
        let shown = by_largest > SHOWN && slid >= self.beyond && fast;
        let lost = if shown { end.position - begin.position + less + on } else { self.beyond };
        let slid = if shown { slid } else { self.beyond };
        if slid <= SLID {
            let face = end.position + end.by_largest - end.as_read;
            return Some(Landing { face, slid: Q16::ZERO, lost: Q16::ZERO });
        }
        Some(Landing { face: begin.position, slid, lost })
    }

    /// What of so long a slide is none on a wall that lies lower than its table: the model of the tread
    /// unwinds it where the table has the wall, and what it does too early looks like a slide of anything
    /// between none and all of that. No more than that is no slide.
    pub fn unwound(&self, slid: Millimetres) -> Millimetres {
        let Some((begin, end)) = self.found else { return Q16::ZERO };
        let early = Q16::narrow(begin.at.gave.saturating_sub(end.at.gave)).max(Q16::ZERO);
        let early = early + early * GOES_ON;
        if slid - early > SLID { early.half() } else { slid }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const R: f64 = 25.0;

    /// A wheel goes inwards from 6 mm past a face at 18 mm until it lands on a wall 4 mm below and 1 mm
    /// farther, a hundredth at a tick. Its tread slips over the last `slid` mm before the landing,
    /// at `rate` times its travel. The compression grows from 0.9 mm and is read as `mean` of it;
    /// behind the landing it falls to a third within 1 mm, as that of a wheel whose wall takes
    /// over.
    fn land(slid: f64, rate: f64, mean: f64, noise: f64) -> Option<Landing> {
        let mut slide = Slide::default();
        let (mut tread, mut past, mut found) = (0.0, 6.3f64, None);
        let lands = 4.0;
        for tick in 0.. {
            let depth = 0.9 + 0.05 * (past - 6.3);
            let reach = R - depth;
            let fall = R - (reach * reach - past * past).max(0.0).sqrt();
            let landed = fall >= lands;
            // The wall carries: it falls by no more than the tread gives way.
            let since = (past - distance_at(lands)).max(0.0);
            let fall = if landed { lands + 0.2 * since } else { fall };
            let depth = if landed { depth * (1.0 - 0.66 * since.min(1.0)) } else { depth };
            let left = distance_at(lands) - past;
            let sliding = !landed && left < slid;
            let moved = if sliding { 0.01 * (1.0 + rate) } else { 0.01 };
            let jitter = noise * f64::from(tick * 7919 % 101 - 50) / 50.0;
            let at = OnEdge {
                travel: Travel::from_num(-tread),
                position: Q16::from_num(18.0 - 6.3 - tread),
                fall: Q16::from_num(fall + jitter),
                depth: Q16::from_num(depth * mean),
                gave: Travel::ZERO,
            };
            found = found.or(slide.step(Q16::from_num(R), &at));
            if since > 1.5 {
                return found;
            }
            past += moved;
            // On the edge the tread runs farther than the axle.
            let flat = if landed { 1.0 } else { (R - fall) / (R - depth) };
            tread += 0.01 / flat;
        }
        unreachable!()
    }

    /// A slow wheel rolls to 10 mm past the face, its arm once off by 0.1 mm; there its axle moves on by
    /// 1 mm, so much in a tick, as if a tread that hardly turns slid or gave way. What it slid.
    fn moves_on(by: f64) -> f64 {
        let mut slide = Slide::default();
        let mut landings = Vec::new();
        for tick in 0..4000 {
            let rolled = 0.002 * f64::from(tick.min(1850));
            let slid = by * f64::from((tick - 1850).max(0));
            let past: f64 = 6.3 + rolled + slid.min(1.0);
            let reach: f64 = R - 1.4;
            let fall = R - (reach * reach - past * past).sqrt();
            let off = if tick == 1000 { 0.1 } else { 0.0 };
            let at = OnEdge {
                travel: Travel::from_num(-rolled),
                position: Q16::from_num(18.0 - 6.3 - rolled),
                fall: Q16::from_num(fall - off),
                depth: Q16::from_num(1.4),
                gave: Travel::ZERO,
            };
            landings.extend(slide.step(Q16::from_num(R), &at));
        }
        assert_eq!(landings.iter().map(|landing| landing.slid).collect::<Vec<_>>(), [Q16::ZERO]);
        slide.landing().expect("it landed").slid.to_num()
    }

    #[test]
    fn a_slide_behind_what_looked_like_a_landing_counts_and_a_tread_that_gives_way_does_not() {
        assert!((moves_on(0.04) - 1.0).abs() < 0.2, "{}", moves_on(0.04));
        assert_eq!(moves_on(0.004), 0.0);
    }

    /// A wheel that lands at 11 mm past the face and slides `slid` mm with the wall already under it: it
    /// does not fall, the edge lets go of the tread, and then it rolls on.
    fn land_sliding(slid: f64, noise: f64) -> Option<Landing> {
        let mut slide = Slide::default();
        let (mut tread, mut past, mut found) = (0.0, 6.3f64, None);
        for tick in 0..3000 {
            let at_wall = past.min(11.0);
            let reach = R - 1.4;
            let fall = R - (reach * reach - at_wall * at_wall).sqrt() + 0.1 * (past - at_wall);
            let jitter = noise * f64::from(tick * 7919 % 101 - 50) / 50.0;
            let depth = R - past.hypot(R - fall);
            let at = OnEdge {
                travel: Travel::from_num(-tread),
                position: Q16::from_num(18.0 - 6.3 - tread),
                fall: Q16::from_num(fall),
                depth: Q16::from_num(depth.max(0.3) + jitter),
                gave: Travel::ZERO,
            };
            found = found.or(slide.step(Q16::from_num(R), &at));
            let slides = past >= 11.0 && past < 11.0 + slid;
            past += if slides { 0.04 } else { 0.002 };
            tread += 0.002;
        }
        found.or(slide.landing())
    }

    #[test]
    fn what_the_model_unwinds_before_the_wall_is_there_is_no_slide() {
        let face = |gave| {
            let at = OnEdge { gave: q16(gave).widen(), ..OnEdge::default() };
            Face { at, ..Face::default() }
        };
        let slide = Slide { found: Some((face(500_000), face(300_000))), ..Slide::default() };
        // 1.6 times the 0.2 mm, and 0.3 mm that are no slide anyway.
        let [all, half] = [600_000, 640_000].map(|slid| slide.unwound(q16(slid)).to_num::<f64>());
        assert!((all - 0.6).abs() < 1e-3 && (half - 0.16).abs() < 1e-3, "{all} {half}");
    }

    /// Distance past the face at which the wheel of [`land`] has fallen so far.
    fn distance_at(fall: f64) -> f64 {
        (0..1000)
            .map(|i| 6.3 + 0.01 * f64::from(i))
            .find(|past| {
                let reach = R - 0.9 - 0.05 * (past - 6.3);
                R - (reach * reach - past * past).max(0.0).sqrt() >= fall
            })
            .expect("it falls")
    }

    proptest! {
        #[test]
        fn a_wheel_that_rolls_lands_without_a_slide(
            mean in 0.6..1.0f64,
            noise in 0.0..0.01f64,
        ) {
            let landing = land(0.0, 0.0, mean, noise).expect("it landed");
            prop_assert_eq!((landing.slid, landing.lost), (Q16::ZERO, Q16::ZERO));
        }

        #[test]
        fn a_slide_with_the_wall_under_the_wheel_is_measured_too(
            slid in 0.6..1.5f64,
            noise in 0.0..0.01f64,
        ) {
            let got = land_sliding(slid, noise).expect("it landed").slid.to_num::<f64>();
            // The tread turns by a twentieth of it.
            prop_assert!((got - 0.95 * slid).abs() < 0.3, "{got} {slid}");
            let rolls = land_sliding(0.0, noise).expect("it landed");
            prop_assert_eq!(rolls.slid, Q16::ZERO);
        }

        #[test]
        fn a_slide_is_measured_within_a_third_of_a_millimetre(
            slid in 0.6..2.5f64,
            rate in 1.0..20.0f64,
            mean in 0.7..1.0f64,
            noise in 0.0..0.01f64,
        ) {
            let landing = land(slid, rate, mean, noise).expect("it landed");
            // This one ends where it lands.
            let slip = slid * rate / (1.0 + rate);
            let got = landing.slid.to_num::<f64>() / (1.0 + GOES_ON.to_num::<f64>());
            prop_assert!((got - slip).abs() < 0.33, "{got} {slip}");
            // The face is where it was before the slide.
            let face: f64 = landing.face.to_num();
            prop_assert!((face - 18.0).abs() < 0.8, "{face}");
        }
    }
}
