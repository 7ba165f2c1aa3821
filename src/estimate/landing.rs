//! The slide of a retracting wheel before the lower wall takes it.
//!
//! The edge under the wheel shows its face at `x + sqrt((R - c)^2 - (R - f)^2)`, with the fall f
//! below the upper wall and the compression c, which grows on the edge. While the wheel rolls, the
//! face stays where it is; it moves outwards while the wheel slides, and inwards once the lower
//! wall carries, because the wheel no longer falls. There the compression falls, too, which must
//! not look like a slide: where the wheel landed is found with the largest compression so far.

#![deny(clippy::float_arithmetic)]

use crate::numeric::{divide, sqrt};
use crate::units::{Millimetres, Q16, Ratio, Travel, q16};

/// Part of the tread's travel by which the face must move for a slide, or for a wall that carries:
/// a sensor of the mean compression, creep and coupled rubber move it by a tenth.
const MOVES: Ratio = q16(250_000);
/// Least slide by the largest compression, mm: what the arm's code makes of an edge's place, three
/// deviations.
const SLID: Millimetres = q16(100_000);
/// Distance by which the face has moved inwards once the wheel has landed, mm.
const LANDED: Millimetres = q16(200_000);
/// Part that the largest compression has in the slide; the rest has the compression as read. A tread
/// that slides is stiffer, so the first is too little; the wall that carries makes the second too
/// much.
const BY_LARGEST: Ratio = q16(250_000);

/// A retracting wheel on the edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnEdge {
    /// Travel of the tread.
    pub travel: Travel,
    /// Position, mm.
    pub position: Millimetres,
    /// Fall below the upper wall, mm.
    pub fall: Millimetres,
    /// Compression, mm.
    pub depth: Millimetres,
}

/// A retracting wheel as the lower wall took it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landing {
    /// Position of the face by the edge, before any slide, mm.
    pub face: Millimetres,
    /// How far the wheel slid, mm; 0 if it rolled.
    pub slid: Millimetres,
    /// By how much it is further in than its position has it, mm: a climb that no tread made
    /// counted as one.
    pub lost: Millimetres,
}

/// Where a tick has the face over the axial travel, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Face {
    by_largest: Millimetres,
    as_read: Millimetres,
    /// Axial travel by the tread since the edge was first seen, mm.
    travelled: Millimetres,
    /// Its position by the compression as read, mm.
    position: Millimetres,
}

impl Face {
    /// Least where a slide begins: before it the travel, in it the face moves this on.
    fn begin(&self) -> Millimetres {
        self.as_read - self.travelled * MOVES
    }

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
    /// Largest compression, mm.
    deepest: Millimetres,
    begin: Option<Face>,
    /// Begin and end of the slide, if the wheel landed at the end.
    found: Option<(Face, Face)>,
    landed: bool,
}

impl Slide {
    /// A tick of a wheel of this radius, mm, on an edge; its landing, once, when it is seen.
    pub fn step(&mut self, radius: Millimetres, at: &OnEdge) -> Option<Landing> {
        if self.landed {
            return None;
        }
        self.deepest = self.deepest.max(at.depth);
        let over = radius - at.fall;
        let edge = |depth: Millimetres| {
            let reach = radius - depth;
            sqrt((reach * reach - over * over).max(Q16::ZERO))
        };
        let turned = self.travel.map_or(Travel::ZERO, |travel| travel.saturating_sub(at.travel));
        self.travelled += Q16::narrow(turned) * divide(over, radius - at.depth).min(Ratio::ONE);
        self.travel = Some(at.travel);
        let face = Face {
            by_largest: edge(self.deepest) - self.travelled,
            as_read: edge(at.depth) - self.travelled,
            travelled: self.travelled,
            position: at.position + edge(at.depth),
        };
        let begin = self.begin.filter(|begin| begin.begin() <= face.begin()).unwrap_or(face);
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
        let face = begin.position;
        if by_largest <= SLID {
            return Some(Landing { face, slid: Q16::ZERO, lost: Q16::ZERO });
        }
        let less = (by_largest - as_read) * BY_LARGEST;
        Some(Landing { face, slid: as_read + less, lost: end.position - face + less })
    }
}
