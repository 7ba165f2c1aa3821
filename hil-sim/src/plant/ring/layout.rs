//! The blocks that a step visits, laid out once for all its trials: those that can touch, in the
//! patch on the floor and in the one on the step ahead, counted in whole blocks around the ring.

use super::law::Lanes;
use super::sweep::Block;
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
        let (floor, step) = reach(&motion.wall, lowest, radius);
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

/// Elements of a block: what is computed side by side.
pub(super) const LANES: usize = 4;

/// Largest angle from straight down that is looked at, rad.
pub(super) const WIDEST: f64 = 1.5;

/// Up to two ranges of blocks, ascending and apart, ends included. A block is numbered
/// on over the turns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Window {
    ranges: [(i64, i64); 2],
    used: usize,
}

impl Window {
    /// Adds a range that starts no lower than those before it, and joins what meets.
    pub(super) fn add(&mut self, first: i64, last: i64) {
        if first > last {
            return;
        }
        match self.ranges[..self.used].last_mut() {
            Some(before) if first <= before.1 + 1 => before.1 = before.1.max(last),
            _ => {
                self.ranges[self.used] = (first, last);
                self.used += 1;
            }
        }
    }

    pub(super) fn contains(&self, block: i64) -> bool {
        self.ranges[..self.used].iter().any(|&(first, last)| (first..=last).contains(&block))
    }

    pub(super) fn blocks(self) -> impl Iterator<Item = i64> {
        self.ranges.into_iter().take(self.used).flat_map(|(first, last)| first..=last)
    }

    /// At most this many blocks: a ring of few elements is all of it, once.
    pub(super) fn limit(&mut self, blocks: i64) {
        let Some(first) = self.ranges[..self.used].first().map(|range| range.0) else { return };
        for range in &mut self.ranges[..self.used] {
            range.1 = range.1.min(first + blocks - 1);
        }
        if self.used == 2 && self.ranges[1].0 > self.ranges[1].1 {
            self.used = 1;
        }
    }
}

/// Half-angle under which a plane `height` below the centre is met, rad, not less:
/// acos u <= sqrt(2(1-u)) (1 + 0.1108 (1-u)) for 0 <= u <= 1, at most 1 % above.
pub(super) fn half_angle(height: f64, radius: f64) -> f64 {
    let rest = (1.0 - height / radius).clamp(0.0, 1.0);
    (2.0 * rest).sqrt() * (1.0 + 0.1108 * rest)
}

/// Angles between which the wheel can touch at this height or above, rad from straight
/// down: on the floor, and on the step ahead if that is in reach.
pub(super) fn reach(wall: &LocalWall, height: f64, radius: f64) -> (f64, Option<(f64, f64)>) {
    let floor = half_angle(height, radius).min(WIDEST);
    let over = height - wall.rise_mm;
    // The nearest point of the step is its corner, or its face if the centre is lower.
    let near = wall.ahead_mm < radius
        && (over <= 0.0 || wall.ahead_mm.powi(2) + over * over < radius * radius);
    let step = near.then(|| {
        let first = std::f64::consts::FRAC_PI_2 - half_angle(wall.ahead_mm, radius);
        (first, half_angle(over, radius).min(WIDEST).max(first))
    });
    (floor, step)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plant::wall::{Step, Wall};

    #[test]
    fn the_half_angle_is_no_less_than_the_exact_one() {
        for i in 0..=10_000 {
            let u = f64::from(i) / 10_000.0;
            let (bound, exact) = (half_angle(25.0 * u, 25.0), u.acos());
            assert!(bound >= exact && bound < exact * 1.01 + 1e-12, "{u}: {bound} {exact}");
        }
        assert_eq!(half_angle(26.0, 25.0), 0.0);
        assert!(half_angle(-1.0, 25.0) >= std::f64::consts::FRAC_PI_2);
    }

    #[test]
    fn ranges_that_meet_are_one() {
        let mut window = Window::default();
        window.add(5, 4);
        assert_eq!(window.blocks().count(), 0);
        window.add(-3, 2);
        window.add(3, 7);
        assert_eq!(window.blocks().collect::<Vec<_>>(), (-3..=7).collect::<Vec<_>>());
        window.add(12, 13);
        assert!(window.contains(12) && window.contains(-3) && !window.contains(9));
        assert_eq!(window.blocks().count(), 13);
        window.limit(9);
        assert_eq!(window.blocks().collect::<Vec<_>>(), (-3..=5).collect::<Vec<_>>());
    }

    proptest! {
        /// No ray outside of the reach is short of the radius.
        #[test]
        fn nothing_touches_out_of_reach(
            decade in -3.0f64..1.5, rise in 0.0f64..20.0, height in 5.0f64..46.0,
            angle in -1.49f64..1.49,
        ) {
            let step = Step { position_mm: 10f64.powf(decade), height_mm: rise };
            let wall = Wall::new(vec![step]).local(0.0);
            let (floor, step) = reach(&wall, height, 25.0);
            let inside = angle.abs() <= floor
                || step.is_some_and(|(first, last)| (first..=last).contains(&angle));
            let (distance, _) = wall.ray(height, angle.sin(), angle.cos());
            prop_assert!(inside || distance >= 25.0 - 1e-9, "{distance}");
        }
    }
}
