//! The sums over the elements in reach, a block side by side.
//!
//! An element's ray meets the floor at depth `R - y sec`, the step ahead at the deeper
//! of face and top if that is deeper; with the step's law its pressure is
//! `tangent depth - excess carried`. What does not depend on the height y is laid down
//! once a step, and every height tried costs one pass over it. The lanes are added up by
//! their place in the block, so that blocks which do not touch change no bit of a sum.

use super::super::wall::Edge;
use super::law::{Lanes, Law};

/// What a block brings into a step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Block {
    pub(super) cos: Lanes,
    pub(super) sin: Lanes,
    /// 1/cos; for elements that look away, so large that none touches.
    pub(super) sec: Lanes,
    /// Depth at the face ahead, mm.
    pub(super) face: Lanes,
    /// Internal displacement at the step's end but for the new depth's part, mm.
    pub(super) carried: Lanes,
}

/// Where the blocks stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) radius: f64,
    /// Height of the centre above the wall under it, mm.
    pub(super) height: f64,
    /// Height of the step ahead, if in reach, mm.
    pub(super) rise: Option<f64>,
    /// Direction of the edge behind, height of the wall above the one behind it, mm, and
    /// the angle between elements, rad, if in reach.
    pub(super) edge: Option<(Edge, f64, f64)>,
    /// Radius of the edges, if they are round, and the distances to the faces ahead and
    /// behind, mm.
    pub(super) round: Option<(f64, f64, f64)>,
}

/// Place and law, a number for every lane.
#[derive(Clone, Copy)]
struct Given {
    radius: Lanes,
    height: Lanes,
    rise: Lanes,
    edge: (Lanes, Lanes),
    drop: Lanes,
    per_pitch: Lanes,
    tangent: Lanes,
    excess: Lanes,
    from_new: Lanes,
    /// Radius of the edges, its square, and the axial distances of their arcs' centres ahead.
    round: (Lanes, Lanes),
    arcs: (Lanes, Lanes),
}

impl Given {
    fn new(place: &Place, law: &Law) -> Self {
        let ((sin, cos), drop, pitch) = place
            .edge
            .map_or(((1.0, 0.0), 0.0, 1.0), |(edge, drop, pitch)| (edge.direction(), drop, pitch));
        let (round, ahead, behind) = place.round.unwrap_or_default();
        Self {
            round: (Lanes::splat(round), Lanes::splat(round * round)),
            arcs: (Lanes::splat(ahead + round), Lanes::splat(round - behind)),
            radius: Lanes::splat(place.radius),
            height: Lanes::splat(place.height),
            rise: Lanes::splat(place.rise.unwrap_or(0.0)),
            edge: (Lanes::splat(sin), Lanes::splat(cos)),
            drop: Lanes::splat(drop),
            per_pitch: Lanes::splat(1.0 / pitch),
            tangent: Lanes::splat(law.tangent),
            excess: Lanes::splat(law.excess),
            from_new: Lanes::splat(law.first.from_new),
        }
    }
}

/// Depth of the elements, what they meet, and of the edge behind: what of their width it
/// leaves on the near wall, and their depth at the wall behind.
#[derive(Clone, Copy)]
struct Met {
    depth: Lanes,
    /// Mask: on the step ahead.
    step: Lanes,
    /// Mask: there on its face.
    face: Lanes,
    covered: Lanes,
    behind: Lanes,
    /// Change of the depth by the height over that on a plane.
    leans: Lanes,
}

/// Where the rays meet an arc of an edge, its centre `ahead` of the wheel's and `below` it:
/// distance, change of it by the height over that on a plane, and square of the distance by
/// which they pass the arc's centre.
#[inline(always)]
fn meet_arc(block: &Block, g: &Given, ahead: Lanes, below: Lanes) -> (Lanes, Lanes, Lanes) {
    let along = ahead * block.sin + below * block.cos;
    let past = ahead * block.cos - below * block.sin;
    let half = (g.round.1 - past * past).fast_max(Lanes::ZERO).sqrt();
    // Where a ray grazes the arc, a bound.
    let least = Lanes::splat(0.1) * g.round.0;
    let leans = (block.cos - past * block.sin / half.fast_max(least)) * block.cos;
    (along - half, leans, past * past)
}

#[inline(always)]
fn meet<const STEP: bool, const EDGE: bool, const ROUND: bool>(block: &Block, g: &Given) -> Met {
    let floor = g.radius - g.height * block.sec;
    let none = Lanes::ZERO;
    let one = Lanes::ONE;
    let mut met =
        Met { depth: floor, step: none, face: none, covered: one, behind: none, leans: one };
    if EDGE && ROUND {
        let (distance, leans, _) = meet_arc(block, g, g.arcs.1, g.height + g.round.0);
        let on_arc = (g.height * block.sin * block.sec).simd_lt(g.arcs.1);
        met.depth = on_arc.bitselect(g.radius - distance, floor);
        met.leans = on_arc.bitselect(leans, one);
    }
    if STEP {
        let top = floor + g.rise * block.sec;
        let on_face = block.face.simd_lt(top);
        let (mut step, mut face, mut leans) = (on_face.bitselect(block.face, top), on_face, one);
        if ROUND {
            let below = g.height - g.rise + g.round.0;
            let (distance, by_height, past) = meet_arc(block, g, g.arcs.0, below);
            let on_arc = past.simd_lt(g.round.1)
                & (distance * block.sin).simd_lt(g.arcs.0)
                & (distance * block.cos).simd_lt(below);
            step = on_arc.bitselect(g.radius - distance, step);
            leans = on_arc.bitselect(by_height, one);
            face &= !on_arc;
        }
        met.step = step.simd_gt(met.depth);
        met.face = met.step & face;
        met.depth = met.step.bitselect(step, met.depth);
        if ROUND {
            met.leans = met.step.bitselect(leans, met.leans);
        }
    }
    if EDGE {
        let within = (g.edge.0 * block.cos + g.edge.1 * block.sin) * g.per_pitch;
        met.covered = (within + Lanes::HALF).fast_max(Lanes::ZERO).fast_min(Lanes::ONE);
        met.behind = floor - g.drop * block.sec;
    }
    met
}

/// Pressure, and the mask of where there is some: depth, and nothing pulls.
#[inline(always)]
fn press(g: &Given, depth: Lanes, carried: Lanes) -> (Lanes, Lanes) {
    let pressure = g.tangent * depth - g.excess * carried;
    let touches = depth.simd_gt(Lanes::ZERO) & pressure.simd_gt(Lanes::ZERO);
    (pressure & touches, touches)
}

/// Cosine and sine sums of the pressure, N/mm^2, and their derivatives by height.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) forces: (f64, f64),
    pub(super) slope: (f64, f64),
}

/// Everything about the contact, as sums over the pressure, N/mm^2.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Totals {
    pub(super) sums: Sums,
    pub(super) normal: f64,
    pub(super) floor: (f64, f64),
    pub(super) step: (f64, f64),
    /// Elements in contact.
    pub(super) count: f64,
    /// Largest pressure on the floor before it is cut off; minus infinity if none.
    pub(super) floor_pressure: f64,
}

fn total(lanes: Lanes) -> f64 {
    lanes.to_array().iter().sum()
}

/// Pressure of a block, its stiffness against the height, and its part in contact.
#[inline(always)]
fn bear<const EDGE: bool, const ROUND: bool>(
    block: &Block,
    g: &Given,
    met: &Met,
) -> (Lanes, Lanes, Lanes) {
    let (mut pressure, touches) = press(g, met.depth, block.carried);
    // On the face the depth does not change with the height.
    let mut moves = g.tangent & touches & !met.face;
    if ROUND {
        moves *= met.leans;
    }
    let mut part = Lanes::ONE & touches;
    if EDGE {
        let (behind, there) = press(g, met.behind, block.carried);
        let rest = Lanes::ONE - met.covered;
        pressure = met.covered * pressure + rest * behind;
        moves = met.covered * moves + rest * (g.tangent & there);
        part = met.covered * part + (rest & there);
    }
    (pressure, moves, part)
}

#[inline(always)]
fn sums_of<const STEP: bool, const EDGE: bool, const ROUND: bool>(
    blocks: &[Block],
    place: &Place,
    law: &Law,
) -> Sums {
    let g = Given::new(place, law);
    let [mut c, mut s, mut dc, mut ds] = [Lanes::ZERO; 4];
    for block in blocks {
        let met = meet::<STEP, EDGE, ROUND>(block, &g);
        let (pressure, moves, _) = bear::<EDGE, ROUND>(block, &g, &met);
        c += pressure * block.cos;
        s += pressure * block.sin;
        dc -= moves;
        ds -= moves * (block.sin * block.sec);
    }
    Sums { forces: (total(c), total(s)), slope: (total(dc), total(ds)) }
}

#[inline(always)]
fn totals_of<const STEP: bool, const EDGE: bool, const ROUND: bool>(
    blocks: &[Block],
    place: &Place,
    law: &Law,
) -> Totals {
    let g = Given::new(place, law);
    let least = Lanes::splat(f64::NEG_INFINITY);
    let [mut normal, mut fc, mut fs, mut sc, mut ss] = [Lanes::ZERO; 5];
    let [mut dc, mut ds, mut count] = [Lanes::ZERO; 3];
    let mut highest = least;
    for block in blocks {
        let met = meet::<STEP, EDGE, ROUND>(block, &g);
        let (pressure, moves, part) = bear::<EDGE, ROUND>(block, &g, &met);
        let (floor, step) = (pressure & !met.step, pressure & met.step);
        normal += pressure;
        fc += floor * block.cos;
        fs += floor * block.sin;
        sc += step * block.cos;
        ss += step * block.sin;
        dc -= moves;
        ds -= moves * (block.sin * block.sec);
        count += part;
        // Before the cut: what is in the floor, pressing or pulling.
        let depth = if EDGE {
            met.covered.simd_gt(Lanes::ZERO).bitselect(met.depth, met.behind)
        } else {
            met.depth
        };
        let raw = g.tangent * depth - g.excess * block.carried;
        let on_floor = depth.simd_gt(Lanes::ZERO) & !met.step;
        highest = highest.fast_max(on_floor.bitselect(raw, least));
    }
    let (floor, step) = ((total(fc), total(fs)), (total(sc), total(ss)));
    Totals {
        sums: Sums { forces: (floor.0 + step.0, floor.1 + step.1), slope: (total(dc), total(ds)) },
        normal: total(normal),
        floor,
        step,
        count: total(count),
        floor_pressure: highest.to_array().into_iter().fold(f64::NEG_INFINITY, f64::max),
    }
}

/// Hands over the new depths and internal displacements, block after block.
#[inline(always)]
fn advance_of<const STEP: bool, const EDGE: bool, const ROUND: bool>(
    blocks: &[Block],
    place: &Place,
    law: &Law,
    mut store: impl FnMut(usize, Lanes, Lanes),
) {
    let g = Given::new(place, law);
    // What has all but decayed is gone, before it turns denormal and slow.
    let gone = Lanes::splat(1e-200);
    for (index, block) in blocks.iter().enumerate() {
        let met = meet::<STEP, EDGE, ROUND>(block, &g);
        let depth = if EDGE {
            met.covered.simd_gt(Lanes::ZERO).bitselect(met.depth, met.behind)
        } else {
            met.depth
        };
        let depth = depth & depth.simd_gt(Lanes::ZERO);
        let q = block.carried + g.from_new * depth;
        store(index, depth, q & q.abs().simd_gt(gone));
    }
}

/// Picks the pass that looks at no more than what is in reach.
macro_rules! by_wall {
    ($place:expr, $of:ident, $($argument:expr),*) => {
        match ($place.rise.is_some(), $place.edge.is_some(), $place.round.is_some()) {
            (false, false, _) => $of::<false, false, false>($($argument),*),
            (true, false, false) => $of::<true, false, false>($($argument),*),
            (false, true, false) => $of::<false, true, false>($($argument),*),
            (true, true, false) => $of::<true, true, false>($($argument),*),
            (true, false, true) => $of::<true, false, true>($($argument),*),
            (false, true, true) => $of::<false, true, true>($($argument),*),
            (true, true, true) => $of::<true, true, true>($($argument),*),
        }
    };
}

pub(super) fn sums(blocks: &[Block], place: &Place, law: &Law) -> Sums {
    by_wall!(place, sums_of, blocks, place, law)
}

pub(super) fn totals(blocks: &[Block], place: &Place, law: &Law) -> Totals {
    by_wall!(place, totals_of, blocks, place, law)
}

/// Calls with the block's number, its depths and its internal displacements.
pub(super) fn advance(
    blocks: &[Block],
    place: &Place,
    law: &Law,
    store: impl FnMut(usize, Lanes, Lanes),
) {
    by_wall!(place, advance_of, blocks, place, law, store);
}
