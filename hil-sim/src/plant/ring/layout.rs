//! The blocks that a step visits, laid out once for all its trials.

use super::law::Lanes;
use super::sweep::Block;
use super::window::{self, LANES, WIDEST, Window};
use super::{Motion, Ring};
use crate::plant::wall::LocalWall;

/// The step that the blocks are laid out for.
#[derive(Clone, Debug, Default)]
pub(super) struct Ready {
    /// Wall, turn and length of the step.
    pub(super) of: Option<(LocalWall, f64, f64)>,
    /// Least height that the window allows, mm.
    pub(super) lowest: f64,
    pub(super) window: Window,
    pub(super) blocks: Vec<Block>,
    /// Where the blocks are kept.
    pub(super) indices: Vec<usize>,
    pub(super) rise: Option<f64>,
    pub(super) edge: bool,
}

/// How far below the height asked for the window still holds, per radius.
const SLACK: f64 = 5e-4;

/// Secant of elements that look away from the wall: none touches.
const AWAY: f64 = 1e9;

impl Ring {
    /// Blocks between two angles from straight down, rad, once the wheel has turned.
    pub(super) fn span(&self, turned: f64, from: f64, to: f64) -> (i64, i64) {
        let pitch = self.pitch();
        let (count, blocks) = (self.parameters.elements as i64, self.q.len() as i64);
        // Blocks are numbered on over the turns, the last of each may not be full.
        let block = |element: i64| {
            element.div_euclid(count) * blocks + element.rem_euclid(count) / LANES as i64
        };
        let (first, last) = ((turned + from) / pitch, (turned + to) / pitch);
        (block(first.ceil() as i64), block(last.floor() as i64))
    }

    /// Lays the blocks out for a step, unless they are.
    pub(super) fn prepare(&mut self, motion: &Motion) {
        let of = (motion.wall, motion.turn_rad, motion.dt_s);
        if self.ready.of == Some(of) && motion.height_mm >= self.ready.lowest {
            return;
        }
        let radius = self.parameters.radius_mm;
        // Lower than predicted: by as much again.
        let more =
            if self.ready.of == Some(of) { self.ready.lowest - motion.height_mm } else { 0.0 };
        let lowest = motion.height_mm - SLACK * radius - more;
        self.refresh_law(motion.dt_s);
        let turned = self.rotation + motion.turn_rad;
        let (floor, step) = window::reach(&motion.wall, lowest, radius);
        let mut window = Window::default();
        if self.visit_all {
            let (first, last) = self.span(turned, -WIDEST, WIDEST);
            window.add(first, last);
        } else {
            let (first, last) = self.span(turned, -floor, floor);
            window.add(first, last);
            if let Some((from, to)) = step {
                let (first, last) = self.span(turned, from, to);
                window.add(first, last);
            }
        }
        window.limit(self.q.len() as i64);
        // Where the patch may end on the floor, and half an element more.
        let chord = (radius * radius - lowest * lowest).max(0.0).sqrt();
        let margin = radius * self.pitch() / floor.cos().max(0.05);
        self.ready.rise = (self.visit_all || step.is_some()).then_some(motion.wall.rise_mm);
        self.ready.edge = motion.wall.behind_mm < chord + margin
            || (self.visit_all && motion.wall.behind_mm < f64::INFINITY);
        self.ready.window = window;
        self.ready.lowest = lowest;
        self.ready.of = Some(of);
        self.lay_out(turned, motion.wall.ahead_mm);
    }

    fn lay_out(&mut self, turned: f64, ahead: f64) {
        let Self { ready, active, law, q, depth, slow, at, sin, cos, parameters, time, .. } = self;
        let count = q.len() as i64;
        let (turned_sin, turned_cos) = turned.sin_cos();
        let (turned_sin, turned_cos) = (Lanes::splat(turned_sin), Lanes::splat(turned_cos));
        let relaxations_s = parameters.relaxations_s();
        let on_face = Lanes::splat(ahead / parameters.radius_mm).fast_max(Lanes::splat(1e-9));
        let (radius, ahead) = (Lanes::splat(parameters.radius_mm), Lanes::splat(ahead));
        let (away, facing) = (Lanes::splat(AWAY), Lanes::splat(0.05));
        let step = ready.rise.is_some();
        ready.blocks.clear();
        ready.indices.clear();
        for number in ready.window.blocks() {
            let index = number.rem_euclid(count) as usize;
            let remembers =
                q[index] != Lanes::ZERO || slow.get(index).is_some_and(|s| *s != Lanes::ZERO);
            if !active.contains(number) && remembers {
                // Out of contact since: only the memory has decayed.
                let decayed = |q: Lanes, tau_s: f64| {
                    let decayed = q * Lanes::splat((-(*time - at[index]) / tau_s).exp());
                    decayed & decayed.abs().simd_gt(Lanes::splat(1e-200))
                };
                q[index] = decayed(q[index], relaxations_s[0]);
                if let Some(slow) = slow.get_mut(index) {
                    *slow = decayed(*slow, relaxations_s[1]);
                }
                at[index] = *time;
            }
            let mut carried = law.first.carry(q[index], depth[index]);
            if let Some(second) = law.second {
                carried = Lanes::HALF * (carried + second.carry(slow[index], depth[index]));
            }
            let (s, c) = (sin[index], cos[index]);
            let (sin, cos) = (s * turned_cos - c * turned_sin, c * turned_cos + s * turned_sin);
            // The face is touched where it is nearer than the radius.
            let near = sin.simd_gt(on_face);
            let face = if step && near.any() {
                near.bitselect(radius - ahead / sin, -away)
            } else {
                -away
            };
            ready.blocks.push(Block {
                cos,
                sin,
                sec: cos.simd_gt(facing).bitselect(Lanes::ONE / cos, away),
                face,
                carried,
            });
            ready.indices.push(index);
        }
    }
}
