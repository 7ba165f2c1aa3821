//! Which blocks of elements can touch: the patch on the floor and the one on the step
//! ahead, counted in whole blocks around the ring.

use super::super::wall::LocalWall;

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
    use super::*;
    use crate::plant::wall::{Step, Wall};
    use proptest::prelude::*;

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
