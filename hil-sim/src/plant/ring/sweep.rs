//! The sums over the elements in reach, a block side by side.
//!
//! An element's ray meets the floor at depth `R - y sec`, the step ahead at the deeper
//! of face and top if that is deeper; with the step's law its pressure is
//! `tangent depth - excess carried`. What does not depend on the height y is laid down
//! once a step, and every height tried costs one pass over it. The lanes are added up by
//! their place in the block, so that blocks which do not touch change no bit of a sum.

use super::super::wall::Edge;
use super::law::Law;
use super::window::LANES;

/// A number per element of a block.
pub(super) type Lanes = [f64; LANES];

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
}

/// Depth of an element, what of its width it is met on, and the depth of the rest.
#[derive(Clone, Copy)]
struct Met {
    depth: f64,
    /// On the step ahead, and there on its face.
    step: bool,
    face: bool,
    covered: f64,
    /// Depth at the wall behind the edge, mm.
    behind: f64,
}

#[inline(always)]
fn meet<const STEP: bool, const EDGE: bool>(block: &Block, lane: usize, place: &Place) -> Met {
    let sec = block.sec[lane];
    let floor = place.radius - place.height * sec;
    let mut met = Met { depth: floor, step: false, face: false, covered: 1.0, behind: 0.0 };
    if STEP {
        let top = floor + place.rise.unwrap_or(0.0) * sec;
        let face = block.face[lane];
        let step = if face < top { face } else { top };
        met.step = step > floor;
        met.face = met.step & (face < top);
        met.depth = if met.step { step } else { floor };
    }
    if EDGE && let Some((edge, drop, pitch)) = &place.edge {
        met.covered = edge.covered(block.sin[lane], block.cos[lane], *pitch);
        met.behind = floor - drop * sec;
    }
    met
}

/// Pressure, nought where there is no depth or no pressure.
#[inline(always)]
fn press(law: &Law, depth: f64, carried: f64) -> f64 {
    let pressure = law.tangent * depth - law.excess * carried;
    if (depth > 0.0) & (pressure > 0.0) { pressure } else { 0.0 }
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

fn total(lanes: &Lanes) -> f64 {
    lanes.iter().sum()
}

#[inline(always)]
fn sums_of<const STEP: bool, const EDGE: bool>(blocks: &[Block], place: &Place, law: &Law) -> Sums {
    let [mut c, mut s, mut dc, mut ds] = [[0.0; LANES]; 4];
    for block in blocks {
        for lane in 0..LANES {
            let met = meet::<STEP, EDGE>(block, lane, place);
            let mut pressure = press(law, met.depth, block.carried[lane]);
            // On the face the depth does not change with the height.
            let mut moves = if (pressure > 0.0) & !met.face { law.tangent } else { 0.0 };
            if EDGE {
                let behind = press(law, met.behind, block.carried[lane]);
                let rest = 1.0 - met.covered;
                let also = if behind > 0.0 { law.tangent } else { 0.0 };
                pressure = met.covered * pressure + rest * behind;
                moves = met.covered * moves + rest * also;
            }
            c[lane] += pressure * block.cos[lane];
            s[lane] += pressure * block.sin[lane];
            dc[lane] -= moves;
            ds[lane] -= moves * (block.sin[lane] * block.sec[lane]);
        }
    }
    Sums { forces: (total(&c), total(&s)), slope: (total(&dc), total(&ds)) }
}

#[inline(always)]
fn totals_of<const STEP: bool, const EDGE: bool>(
    blocks: &[Block],
    place: &Place,
    law: &Law,
) -> Totals {
    let [mut normal, mut fc, mut fs, mut sc, mut ss] = [[0.0; LANES]; 5];
    let [mut dc, mut ds, mut count] = [[0.0; LANES]; 3];
    let mut highest = [f64::NEG_INFINITY; LANES];
    for block in blocks {
        for lane in 0..LANES {
            let (sin, cos) = (block.sin[lane], block.cos[lane]);
            let met = meet::<STEP, EDGE>(block, lane, place);
            let raw = law.tangent * met.depth - law.excess * block.carried[lane];
            let mut pressure = press(law, met.depth, block.carried[lane]);
            let mut one = if pressure > 0.0 { 1.0 } else { 0.0 };
            let mut moves = if (pressure > 0.0) & !met.face { law.tangent } else { 0.0 };
            let on_floor = (met.depth > 0.0) & !met.step;
            let mut top = if on_floor { raw } else { f64::NEG_INFINITY };
            if EDGE {
                let behind = press(law, met.behind, block.carried[lane]);
                let rest = 1.0 - met.covered;
                if met.covered <= 0.0 {
                    top = if behind > 0.0 { behind } else { f64::NEG_INFINITY };
                }
                let also = if behind > 0.0 { 1.0 } else { 0.0 };
                pressure = met.covered * pressure + rest * behind;
                moves = met.covered * moves + rest * also * law.tangent;
                one = met.covered * one + rest * also;
            }
            let (floor, step) = if met.step { (0.0, pressure) } else { (pressure, 0.0) };
            normal[lane] += pressure;
            fc[lane] += floor * cos;
            fs[lane] += floor * sin;
            sc[lane] += step * cos;
            ss[lane] += step * sin;
            count[lane] += one;
            dc[lane] -= moves;
            ds[lane] -= moves * (sin * block.sec[lane]);
            highest[lane] = if top > highest[lane] { top } else { highest[lane] };
        }
    }
    let (floor, step) = ((total(&fc), total(&fs)), (total(&sc), total(&ss)));
    Totals {
        sums: Sums {
            forces: (floor.0 + step.0, floor.1 + step.1),
            slope: (total(&dc), total(&ds)),
        },
        normal: total(&normal),
        floor,
        step,
        count: total(&count),
        floor_pressure: highest.into_iter().fold(f64::NEG_INFINITY, f64::max),
    }
}

/// Hands over the new depths and internal displacements, block after block.
#[inline(always)]
fn advance_of<const STEP: bool, const EDGE: bool>(
    blocks: &[Block],
    place: &Place,
    law: &Law,
    mut store: impl FnMut(usize, Lanes, Lanes),
) {
    for (index, block) in blocks.iter().enumerate() {
        let (mut depths, mut qs) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let met = meet::<STEP, EDGE>(block, lane, place);
            let depth = if EDGE && met.covered <= 0.0 { met.behind } else { met.depth };
            let depth = if depth > 0.0 { depth } else { 0.0 };
            let q = block.carried[lane] + law.from_new * depth;
            depths[lane] = depth;
            // What has all but decayed is gone, before it turns denormal and slow.
            qs[lane] = if q.abs() > 1e-200 { q } else { 0.0 };
        }
        store(index, depths, qs);
    }
}

macro_rules! by_wall {
    ($place:expr, $of:ident, $($argument:expr),*) => {
        match ($place.rise.is_some(), $place.edge.is_some()) {
            (false, false) => $of::<false, false>($($argument),*),
            (true, false) => $of::<true, false>($($argument),*),
            (false, true) => $of::<false, true>($($argument),*),
            (true, true) => $of::<true, true>($($argument),*),
        }
    };
}

pub(super) fn sums(blocks: &[Block], place: &Place, law: &Law) -> Sums {
    by_wall!(place, sums_of, blocks, place, law)
}

pub(super) fn totals(blocks: &[Block], place: &Place, law: &Law) -> Totals {
    by_wall!(place, totals_of, blocks, place, law)
}

pub(super) fn advance(
    blocks: &[Block],
    place: &Place,
    law: &Law,
    store: impl FnMut(usize, Lanes, Lanes),
) {
    by_wall!(place, advance_of, blocks, place, law, store);
}
