//! Steady rolling of the ring on the continuous wall, without the ring: one pass
//! over the patch from where an element enters to where it leaves.

use super::ring::RingParameters;

/// Nodes across the patch; 64 give the force within 0.05 % of the converged value.
const NODES: usize = 64;

/// Contact of the steadily rolling wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rolling {
    /// Height of the centre above the wall, mm.
    pub height_mm: f64,
    /// Sum of p, N.
    pub normal_n: f64,
    /// Sum of p cos(psi), N.
    pub cosine_n: f64,
    /// Sum of p sin(psi), N: the rolling resistance, against the motion.
    pub sine_n: f64,
    /// Contact area, mm^2.
    pub area_mm2: f64,
    /// d(cosine)/d(height), N/mm.
    pub slope: f64,
}

/// Steady contact at this height and tread speed (mm/s, signed).
pub(crate) fn at_height(ring: &RingParameters, height_mm: f64, speed_mm_s: f64) -> Rolling {
    sum(ring, height_mm, speed_mm_s, NODES)
}

fn sum(ring: &RingParameters, height_mm: f64, speed_mm_s: f64, nodes: usize) -> Rolling {
    let mut out = Rolling { height_mm, ..Rolling::default() };
    walk(ring, height_mm, speed_mm_s, nodes, |(sin, cos), step, depth, q| {
        let pressure = ring.k_inf * depth + (ring.k_0 - ring.k_inf) * (depth - 0.5 * (q[0] + q[1]));
        if pressure > 0.0 {
            let patch = step * ring.radius_mm * ring.width_mm;
            out.normal_n += pressure * patch;
            out.cosine_n += pressure * patch * cos;
            out.sine_n += pressure * patch * sin;
            out.area_mm2 += patch;
        }
    });
    // Depth grows by 1/cos of what the centre sinks; memory scales with depth.
    out.slope = if height_mm < ring.radius_mm {
        -1.5 * out.cosine_n / (ring.radius_mm - height_mm)
    } else {
        -ring.k_inf
    };
    out
}

/// Height at which steady rolling carries what is asked: `balance` gives residual,
/// N, from the contact; it must fall as the height grows. `guess` speeds it up.
pub fn solve(
    ring: &RingParameters,
    speed_mm_s: f64,
    guess_mm: f64,
    balance: impl Fn(&Rolling) -> f64,
) -> Rolling {
    solve_by(ring, speed_mm_s, guess_mm, |contact| (balance(contact), contact.slope))
}

/// The same with the residual's derivative by the height, N/mm, beside it. The residual may
/// rise with the height where it is below zero.
fn solve_by(
    ring: &RingParameters,
    speed_mm_s: f64,
    guess_mm: f64,
    balance: impl Fn(&Rolling) -> (f64, f64),
) -> Rolling {
    let (mut low, mut high) = (0.5 * ring.radius_mm, ring.radius_mm);
    let mut height = guess_mm.clamp(low, high - 1e-9);
    let mut best = at_height(ring, height, speed_mm_s);
    for _ in 0..60 {
        let (residual, slope) = balance(&best);
        if residual.abs() < 1e-6 || high - low < 1e-12 {
            break;
        }
        if residual > 0.0 {
            low = height;
        } else {
            high = height;
        }
        let newton = height - residual / slope;
        height =
            if slope < 0.0 && newton > low && newton < high { newton } else { 0.5 * (low + high) };
        best = at_height(ring, height, speed_mm_s);
    }
    best
}

/// Relative change of depth and speed from where steady rolling was last computed up to
/// which its tangent stands in for it: forces within a part of 3e-4, less than what the nodes
/// leave.
const NEAR: f64 = 0.02;

/// Part of the depth by which a contact is moved without being computed again: its forces
/// then err by a part in the square of it.
const CLOSE: f64 = 1e-4;

impl Rolling {
    /// The contact a little higher up: forces as depth^1.5, arc as depth^0.5.
    fn moved(self, ring: &RingParameters, change_mm: f64) -> Self {
        let deeper = -change_mm / (ring.radius_mm - self.height_mm);
        let force = 1.0 + 1.5 * deeper;
        Self {
            height_mm: self.height_mm + change_mm,
            normal_n: self.normal_n * force,
            cosine_n: self.cosine_n + self.slope * change_mm,
            sine_n: self.sine_n * force,
            area_mm2: self.area_mm2 * (1.0 + 0.5 * deeper),
            slope: self.slope * (1.0 + 0.5 * deeper),
        }
    }
}

/// Steady rolling near a depth and a speed: what scales out (force with depth^1.5, arc
/// with depth^0.5) is exact, the rest, which hardly changes, is a tangent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tangent {
    depth: f64,
    speed: f64,
    /// Normal, cosine and sine sums over depth^1.5, area over depth^0.5.
    value: [f64; 4],
    /// Their derivatives by depth and by speed, relative.
    by_depth: [f64; 4],
    by_speed: [f64; 4],
}

impl Tangent {
    /// Taken at this height above the wall, mm, and tread speed, mm/s; none off the wall.
    pub(crate) fn new(ring: &RingParameters, height_mm: f64, speed_mm_s: f64) -> Option<Self> {
        let depth = ring.radius_mm - height_mm;
        if depth <= 0.0 {
            return None;
        }
        let scaled = |depth: f64, speed: f64| {
            let at = at_height(ring, ring.radius_mm - depth, speed);
            let (root, force) = (depth.sqrt(), depth * depth.sqrt());
            [at.normal_n / force, at.cosine_n / force, at.sine_n / force, at.area_mm2 / root]
        };
        let apart = |a: [f64; 4], b: [f64; 4]| std::array::from_fn(|i| (a[i] - b[i]) / NEAR);
        let (low, high) = (1.0 - 0.5 * NEAR, 1.0 + 0.5 * NEAR);
        Some(Self {
            depth,
            speed: speed_mm_s,
            value: scaled(depth, speed_mm_s),
            by_depth: apart(scaled(high * depth, speed_mm_s), scaled(low * depth, speed_mm_s)),
            by_speed: apart(scaled(depth, high * speed_mm_s), scaled(depth, low * speed_mm_s)),
        })
    }

    /// Whether it holds at this height and speed.
    pub(crate) fn holds(&self, ring: &RingParameters, height_mm: f64, speed_mm_s: f64) -> bool {
        (ring.radius_mm - height_mm - self.depth).abs() <= NEAR * self.depth
            && (speed_mm_s - self.speed).abs() <= NEAR * self.speed.abs()
    }

    /// Contact at this height and tread speed.
    pub(crate) fn at(&self, ring: &RingParameters, height_mm: f64, speed_mm_s: f64) -> Rolling {
        let depth = ring.radius_mm - height_mm;
        if depth <= 0.0 {
            return Rolling { height_mm, slope: -ring.k_inf, ..Rolling::default() };
        }
        let deeper = depth / self.depth - 1.0;
        let faster = if self.speed == 0.0 { 0.0 } else { speed_mm_s / self.speed - 1.0 };
        let of = |i: usize| self.value[i] + self.by_depth[i] * deeper + self.by_speed[i] * faster;
        let root = depth.sqrt();
        let force = depth * root;
        Rolling {
            height_mm,
            normal_n: force * of(0),
            cosine_n: force * of(1),
            sine_n: force * of(2),
            area_mm2: root * of(3),
            slope: -1.5 * root * of(1) - force * self.by_depth[1] / self.depth,
        }
    }
}

/// Steady rolling solved again and again under slowly changing load and speed: mostly by
/// the tangent at one of the last solutions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Steady {
    tangent: Option<Tangent>,
    /// Contacts computed node by node.
    computed: u64,
    /// Heights tried.
    iterations: u64,
}

impl Steady {
    /// As [`solve`], by tangents within the error named there.
    pub(crate) fn solve(
        &mut self,
        ring: &RingParameters,
        speed_mm_s: f64,
        guess_mm: f64,
        balance: impl Fn(&Rolling) -> (f64, f64),
    ) -> Rolling {
        if let Some(tangent) = self.tangent {
            let mut height = guess_mm;
            for _ in 0..8 {
                if !tangent.holds(ring, height, speed_mm_s) {
                    break;
                }
                let at = tangent.at(ring, height, speed_mm_s);
                self.iterations += 1;
                let (residual, slope) = balance(&at);
                if slope >= 0.0 {
                    break;
                }
                let change = -residual / slope;
                // So close, the last step needs no contact of its own.
                if change.abs() <= CLOSE * tangent.depth {
                    return at.moved(ring, change);
                }
                height += change;
            }
        }
        self.computed += 1;
        let solved = solve_by(ring, speed_mm_s, guess_mm, balance);
        self.tangent = Tangent::new(ring, solved.height_mm, speed_mm_s);
        solved
    }

    /// Contacts computed node by node and heights tried by tangents so far.
    pub(super) const fn work(&self) -> (u64, u64) {
        (self.computed, self.iterations)
    }
}

/// Depth and internal displacements (mm) across the patch, by angle from straight
/// down, for seeding the ring.
pub(crate) fn profile(
    ring: &RingParameters,
    height_mm: f64,
    speed_mm_s: f64,
) -> Vec<(f64, f64, [f64; 2])> {
    let mut out = Vec::with_capacity(NODES);
    walk(ring, height_mm, speed_mm_s, NODES, |(sin, _), _, depth, q| {
        out.push((sin.asin(), depth, q));
    });
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out
}

/// Mean depth of the patch as [`super::ring::Ring::carrying_mm`] has it, mm.
pub(crate) fn carrying_mm(ring: &RingParameters, height_mm: f64, speed_mm_s: f64) -> f64 {
    let (mut carried, mut sum) = (0.0, 0.0);
    walk(ring, height_mm, speed_mm_s, NODES, |_, _, depth, q| {
        let memory = 0.5 * (q[0] + q[1]);
        let pressure = (ring.k_0 * depth - (ring.k_0 - ring.k_inf) * memory).max(0.0);
        (carried, sum) = (carried + pressure, sum + pressure * depth);
    });
    if carried > 0.0 { 1.25 * sum / carried } else { 0.0 }
}

/// Visits the patch from its leading to its trailing edge: sine and cosine of the angle,
/// width of the node (rad), depth, internal displacements: one twice if there is but one
/// relaxation.
fn walk(
    ring: &RingParameters,
    height_mm: f64,
    speed_mm_s: f64,
    nodes: usize,
    mut visit: impl FnMut((f64, f64), f64, f64, [f64; 2]),
) {
    if height_mm >= ring.radius_mm {
        return;
    }
    let half = (height_mm / ring.radius_mm).acos();
    let step = 2.0 * half / nodes as f64;
    let ahead = if speed_mm_s < 0.0 { -1.0 } else { 1.0 };
    let [fast_s, slow_s] = ring.relaxations_s();
    let fast = weights(step * ring.radius_mm, speed_mm_s, fast_s);
    let slow = ring.relaxes_twice().then(|| weights(step * ring.radius_mm, speed_mm_s, slow_s));
    let (mut q, mut before) = ([0.0; 2], 0.0);
    let (mut sin, mut cos) = (half - 0.5 * step).sin_cos();
    let (step_sin, step_cos) = step.sin_cos();
    for _ in 0..nodes {
        let depth = (ring.radius_mm - height_mm / cos).max(0.0);
        // The first node lies half a step behind the edge; taking a whole step there
        // errs by a part in the square of the node count.
        let advance = |q: f64, (keep, mean): (f64, f64)| {
            keep * q + (mean - keep) * before + (1.0 - mean) * depth
        };
        q[0] = advance(q[0], fast);
        q[1] = slow.map_or(q[0], |slow| advance(q[1], slow));
        before = depth;
        visit((ahead * sin, cos), step, depth, q);
        // On to the next: turned back by one step.
        (sin, cos) = (sin * step_cos - cos * step_sin, cos * step_cos + sin * step_sin);
    }
}

/// Decay over a node's travel, mm, and its mean over it.
fn weights(travel_mm: f64, speed_mm_s: f64, tau_s: f64) -> (f64, f64) {
    // At rest the memory has caught up with the depth.
    let ratio =
        if speed_mm_s == 0.0 { f64::INFINITY } else { travel_mm / (speed_mm_s.abs() * tau_s) };
    let mean = if ratio.is_infinite() {
        0.0
    } else if ratio < 1e-5 {
        1.0 - 0.5 * ratio
    } else {
        -(-ratio).exp_m1() / ratio
    };
    ((-ratio).exp(), mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::balance::{Axial, Balance};
    use crate::plant::ring::{Motion, Ring};
    use crate::plant::wall::Wall;
    use interstage::rig::Rig;

    fn ring() -> RingParameters {
        RingParameters::of(&Rig::fe(), 5760)
    }

    #[test]
    fn the_nodes_suffice() {
        for height in [24.9, 24.65, 24.0] {
            for speed in [0.0, 0.5, 3.0, 10.0, 40.0, -40.0] {
                let coarse = at_height(&ring(), height, speed);
                let fine = sum(&ring(), height, speed, 16_384);
                let off = coarse.cosine_n / fine.cosine_n - 1.0;
                assert!(off.abs() < 5e-4, "{off} at {height} mm, {speed} mm/s");
                assert!((coarse.sine_n - fine.sine_n).abs() < 1e-4 * fine.cosine_n);
                assert!((coarse.area_mm2 / fine.area_mm2 - 1.0).abs() < 0.01);
            }
        }
    }

    #[test]
    fn rolling_costs_work_either_way_and_none_without_memory() {
        for speed in [0.5, 5.0, 40.0] {
            let forwards = at_height(&ring(), 24.6, speed);
            let back = at_height(&ring(), 24.6, -speed);
            assert!(forwards.sine_n > 0.0 && back.sine_n == -forwards.sine_n);
            assert_eq!(forwards.cosine_n, back.cosine_n);
            let elastic = RingParameters { k_0: ring().k_inf, ..ring() };
            assert!(at_height(&elastic, 24.6, speed).sine_n.abs() < 1e-9);
        }
        assert!(at_height(&ring(), 24.6, 0.0).sine_n.abs() < 1e-9);
        assert_eq!(at_height(&ring(), 25.0, 5.0).cosine_n, 0.0);
    }

    #[test]
    fn agrees_with_the_rolled_ring() {
        for (speed, preload) in [(5.0, 33.3), (30.0, 50.0), (-12.0, 100.0)] {
            let steady = solve(&ring(), speed, 24.8, |c| c.cosine_n - preload);
            let mut rolled = Ring::new(ring());
            let wall = Wall::default().local(0.0);
            let balance = Balance::under(preload, Axial::Pushed);
            let dx = 0.01f64.copysign(speed);
            let mut height = 24.8;
            let mut contact = None;
            for _ in 0..2500 {
                let motion =
                    Motion { wall, height_mm: height, turn_rad: dx / 25.0, dt_s: dx / speed };
                let solved = balance.solve(&mut rolled, motion).unwrap();
                height = solved.height_mm;
                rolled.commit(&Motion { height_mm: height, ..motion });
                contact = Some(solved.contact);
            }
            let contact = contact.unwrap();
            assert!(
                (steady.height_mm - height).abs() < 0.002,
                "height {} {height} at {speed}",
                steady.height_mm
            );
            assert!(
                (steady.sine_n - contact.sine_n).abs() < 0.02 * contact.sine_n.abs() + 0.01,
                "resistance {} {} at {speed}",
                steady.sine_n,
                contact.sine_n
            );
        }
    }

    #[test]
    fn a_tangent_stands_in_for_what_is_near() {
        for depth in [0.05, 0.3, 1.0] {
            for speed in [0.0, 0.3, 8.0, 40.0, -8.0, 2000.0] {
                let tangent = Tangent::new(&ring(), 25.0 - depth, speed).unwrap();
                for (deeper, faster) in
                    [(0.0199, 0.0199), (-0.0199, 0.0199), (0.0199, -0.0199), (0.0, 0.0)]
                {
                    let (height, speed) = (25.0 - depth * (1.0 + deeper), speed * (1.0 + faster));
                    assert!(tangent.holds(&ring(), height, speed));
                    let (near, exact) =
                        (tangent.at(&ring(), height, speed), at_height(&ring(), height, speed));
                    let part = (near.cosine_n / exact.cosine_n - 1.0).abs();
                    assert!(part < 3e-4, "{part} at {depth} mm, {speed} mm/s");
                    assert!((near.sine_n - exact.sine_n).abs() < 3e-4 * exact.cosine_n);
                    assert!((near.normal_n / exact.normal_n - 1.0).abs() < 3e-4);
                    assert!((near.area_mm2 / exact.area_mm2 - 1.0).abs() < 0.04);
                }
                assert!(!tangent.holds(&ring(), 25.0 - 1.04 * depth, speed));
            }
        }
        assert!(Tangent::new(&ring(), 25.0, 5.0).is_none());
    }

    #[test]
    fn solved_again_and_again_it_stays_with_the_solution() {
        let mut steady = Steady::default();
        let mut height = 24.9;
        for i in 0..2000 {
            let t = f64::from(i) / 2000.0;
            let (preload, speed) = (30.0 + 90.0 * t + 0.5 * (300.0 * t).sin(), 3.0 + 20.0 * t * t);
            let at = steady.solve(&ring(), speed, height, |c| (c.cosine_n - preload, c.slope));
            height = at.height_mm;
            assert!((at.cosine_n - preload).abs() < 1e-4 * preload, "{at:?} {preload}");
            let exact = solve(&ring(), speed, height, |c| c.cosine_n - preload);
            let part = (25.0 - height) / (25.0 - exact.height_mm) - 1.0;
            assert!(part.abs() < 3e-4, "{part} at {preload} N, {speed} mm/s");
        }
        assert!(steady.computed < 150, "{steady:?}");
    }
}
