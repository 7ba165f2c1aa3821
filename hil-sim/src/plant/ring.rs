//! The tread as a ring of radial elements with memory, rolling over the wall.
//!
//! An element whose ray from the wheel centre meets the wall at depth delta
//! carries p = k_inf delta + (k_0 - k_inf)(delta - q), q' = (delta - q)/tau,
//! p >= 0: the three-parameter solid per area. Elements turn with the wheel.
//! Within a step delta runs linearly, and q is integrated exactly for it.
//!
//! With `tread_thickness_mm` the elements are coupled as a layer of incompressible rubber
//! couples them (`coupled`); with `second_relaxation` the rubber relaxes twice (`law`).
//!
//! Only elements that can touch are visited (`window`), four at a time (`sweep`). The
//! memory of the others is brought up to date in closed form when they come back.

mod complementarity;
mod coupled;
mod law;
mod layer;
mod sweep;
mod window;

use std::f64::consts::TAU;

use interstage::rig::Rig;

use super::balance::{Axial, Balance, BalanceError, Solved};
use super::wall::LocalWall;
use coupled::Coupled;
use law::Law;
use sweep::{Block, Lanes, Place, Sums};
use window::{LANES, WIDEST, Window};

/// Wheel and rubber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingParameters {
    /// Undeformed radius, mm.
    pub radius_mm: f64,
    /// Width, mm.
    pub width_mm: f64,
    /// Relaxed stiffness per area, N/mm^3 (1e9 Pa/m).
    pub k_inf: f64,
    /// Instant stiffness per area, N/mm^3.
    pub k_0: f64,
    /// Relaxation time, s.
    pub tau_s: f64,
    /// Elements around the ring.
    pub elements: usize,
    /// Thickness of the tread, a layer of incompressible rubber bonded to the hub, mm;
    /// 0: independent elements, of no thickness.
    pub tread_thickness_mm: f64,
    /// Spread s of two relaxations of equal share, at `tau_s / s` and `tau_s s`; 1: one.
    pub second_relaxation: f64,
}

impl RingParameters {
    /// Wheel and rubber of a rig, by this many elements.
    #[must_use]
    pub fn of(rig: &Rig, elements: usize) -> Self {
        // Pa/m to N/mm^3.
        let k_inf = rig.tread.k_inf_pa_per_m * 1e-9;
        Self {
            radius_mm: rig.rig.wheel_radius_mm,
            width_mm: rig.rig.wheel_width_mm,
            k_inf,
            k_0: k_inf * rig.tread.stiffening,
            tau_s: rig.tread.tau_s,
            elements,
            tread_thickness_mm: 0.0,
            second_relaxation: 1.0,
        }
    }

    /// Whether the elements are coupled.
    #[must_use]
    pub fn is_coupled(&self) -> bool {
        self.tread_thickness_mm > 0.0
    }

    /// Whether the rubber relaxes twice.
    #[must_use]
    pub fn relaxes_twice(&self) -> bool {
        self.second_relaxation > 1.0
    }

    /// Relaxation times, the faster one first, s.
    #[must_use]
    pub fn relaxations_s(&self) -> [f64; 2] {
        [self.tau_s / self.second_relaxation, self.tau_s * self.second_relaxation]
    }
}

/// Resultants of the contact pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// Sum of p over all contact, N.
    pub normal_n: f64,
    /// Sum of p cos(psi) over all contact, N.
    pub cosine_n: f64,
    /// Sum of p sin(psi) over all contact, N.
    pub sine_n: f64,
    /// The part of `cosine_n` carried by the floor, N.
    pub floor_n: f64,
    /// Sum of p cos(psi) over face and top of the step ahead, N.
    pub step_cosine_n: f64,
    /// Sum of p sin(psi) over face and top of the step ahead, N.
    pub step_sine_n: f64,
    /// Largest depth, at the point of the wall nearest to the centre, mm; negative is
    /// clearance.
    pub depth_mm: f64,
    /// Arc in contact times width, mm^2.
    pub area_mm2: f64,
    /// Largest pressure on the floor before it is cut off at zero, N/mm^2; where no
    /// element reaches the floor, minus what a fresh one would carry as deep in it as it
    /// is away, so that the instant of a touch-down lies on a straight line.
    pub floor_pressure: f64,
    /// Derivatives of `cosine_n` and `sine_n` by the centre's height, N/mm.
    pub slope: (f64, f64),
}

impl Contact {
    /// The contact a little higher up, by its derivatives, its parts as the whole.
    #[must_use]
    pub fn moved(self, change_mm: f64) -> Self {
        let cosine_n = self.cosine_n + self.slope.0 * change_mm;
        let part = cosine_n / self.cosine_n;
        Self {
            normal_n: self.normal_n * part,
            cosine_n,
            sine_n: self.sine_n + self.slope.1 * change_mm,
            floor_n: self.floor_n * part,
            step_cosine_n: self.step_cosine_n * part,
            step_sine_n: self.step_sine_n * part,
            depth_mm: self.depth_mm - change_mm,
            ..self
        }
    }

    /// Magnitude of the step's force on the wheel, N.
    #[must_use]
    pub fn step_force_n(&self) -> f64 {
        self.step_cosine_n.hypot(self.step_sine_n)
    }
}

/// What a ring has been made to compute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Steps.
    pub strides: u64,
    /// Heights tried.
    pub iterations: u64,
    /// Elements visited, once for every height tried.
    pub elements: u64,
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.strides += other.strides;
        self.iterations += other.iterations;
        self.elements += other.elements;
    }
}

/// The ring's elements and how far the wheel has turned.
#[derive(Clone, Debug)]
pub struct Ring {
    parameters: RingParameters,
    /// Sine and cosine of the elements' angles, by blocks; zero beyond the last.
    sin: Vec<Lanes>,
    cos: Vec<Lanes>,
    /// Internal displacement and depth, mm.
    q: Vec<Lanes>,
    depth: Vec<Lanes>,
    /// Internal displacement of the slower relaxation, mm, if there are two.
    slow: Vec<Lanes>,
    /// When a block that is not active was last brought up to date, s.
    at: Vec<f64>,
    /// Blocks that are up to date.
    active: Window,
    /// Angle turned since the start, rad; positive rolls forwards.
    rotation: f64,
    /// Time of the last step's end, s.
    time: f64,
    law: Law,
    ready: Ready,
    visit_all: bool,
    work: Work,
    /// Work on the elements, mJ.
    taken_mj: f64,
    /// In place of all of the above elements where they are coupled.
    coupled: Option<Box<Coupled>>,
}

/// The step that the blocks are laid out for.
#[derive(Clone, Debug, Default)]
struct Ready {
    /// Wall, turn and length of the step.
    of: Option<(LocalWall, f64, f64)>,
    /// Least height that the window allows, mm.
    lowest: f64,
    window: Window,
    blocks: Vec<Block>,
    /// Where the blocks are kept.
    indices: Vec<usize>,
    rise: Option<f64>,
    edge: bool,
}

/// One trial step: where the ring is taken to.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Wall around the new position.
    pub wall: LocalWall,
    /// Height of the centre above the wall under it, mm.
    pub height_mm: f64,
    /// Angle turned in the step, rad.
    pub turn_rad: f64,
    /// Length of the step, s.
    pub dt_s: f64,
}

/// A step so long that all memory has caught up, s.
const FOREVER_S: f64 = 1e9;

/// How far below the height asked for the window still holds, per radius.
const SLACK: f64 = 5e-4;

/// Secant of elements that look away from the wall: none touches.
const AWAY: f64 = 1e9;

impl Ring {
    /// A ring at rest and unloaded.
    #[must_use]
    pub fn new(parameters: RingParameters) -> Self {
        let count = parameters.elements;
        let blocks = count.div_ceil(LANES);
        let pitch = TAU / count as f64;
        let lanes = |of: fn(f64) -> f64| -> Vec<Lanes> {
            let at = |i: usize| if i < count { of(i as f64 * pitch) } else { 0.0 };
            (0..blocks)
                .map(|block| std::array::from_fn(|lane| at(block * LANES + lane)).into())
                .collect()
        };
        Self {
            sin: lanes(f64::sin),
            cos: lanes(f64::cos),
            q: vec![Lanes::ZERO; blocks],
            depth: vec![Lanes::ZERO; blocks],
            slow: vec![Lanes::ZERO; if parameters.relaxes_twice() { blocks } else { 0 }],
            at: vec![0.0; blocks],
            active: Window::default(),
            rotation: 0.0,
            time: 0.0,
            law: Law::new(&parameters, 0.0),
            ready: Ready::default(),
            visit_all: false,
            work: Work::default(),
            taken_mj: 0.0,
            coupled: parameters.is_coupled().then(|| Box::new(Coupled::new(&parameters))),
            parameters,
        }
    }

    /// The same ring, visiting every element that faces the wall, in reach or not: for
    /// proof that the others change nothing.
    #[must_use]
    pub fn visiting_all(mut self) -> Self {
        self.visit_all = true;
        self
    }

    /// What the elements took up, mJ: stored in those in contact, the rest lost in them.
    #[must_use]
    pub fn taken_mj(&self) -> f64 {
        self.taken_mj
    }

    /// Stiffness becomes this from now on, N/mm^3, relaxed and instant.
    pub(super) fn set_stiffness(&mut self, k_inf: f64, k_0: f64) {
        (self.parameters.k_inf, self.parameters.k_0) = (k_inf, k_0);
        self.law = Law::new(&self.parameters, 0.0);
        self.ready = Ready::default();
    }

    /// Wheel and rubber.
    #[must_use]
    pub fn parameters(&self) -> &RingParameters {
        &self.parameters
    }

    /// What has been computed since the last call.
    pub(super) fn take_work(&mut self) -> Work {
        std::mem::take(&mut self.work)
    }

    /// Contact after `motion`, leaving the elements as they are.
    #[must_use]
    pub fn trial(&mut self, motion: &Motion) -> Contact {
        if self.coupled.is_some() {
            return self.trial_coupled(motion);
        }
        self.prepare(motion);
        self.count();
        let place = self.place(motion);
        let p = &self.parameters;
        let totals = sweep::totals(&self.ready.blocks, &place, &self.law);
        let patch = self.patch();
        let floor_pressure = if totals.floor_pressure > f64::NEG_INFINITY {
            totals.floor_pressure
        } else {
            -self.law.tangent * (motion.height_mm - p.radius_mm).abs()
        };
        let (forces, slope) = (totals.sums.forces, totals.sums.slope);
        let (cosine, sine) = motion.wall.tilt(forces);
        let slope = motion.wall.tilt(slope);
        Contact {
            normal_n: patch * totals.normal,
            cosine_n: patch * cosine,
            sine_n: patch * sine,
            floor_n: patch * totals.floor.0,
            step_cosine_n: patch * totals.step.0,
            step_sine_n: patch * totals.step.1,
            depth_mm: p.radius_mm - motion.wall.nearest(motion.height_mm),
            area_mm2: patch * totals.count,
            floor_pressure,
            slope: (patch * slope.0, patch * slope.1),
        }
    }

    /// Cosine and sine sums after `motion`, N, and their derivatives by the height, N/mm:
    /// the part of [`Ring::trial`] that a balance needs.
    pub(super) fn forces(&mut self, motion: &Motion) -> ((f64, f64), (f64, f64)) {
        if self.coupled.is_some() {
            let contact = self.trial_coupled(motion);
            return ((contact.cosine_n, contact.sine_n), contact.slope);
        }
        self.prepare(motion);
        self.count();
        let patch = self.patch();
        let Sums { forces, slope } =
            sweep::sums(&self.ready.blocks, &self.place(motion), &self.law);
        let ((c, s), (dc, ds)) = (motion.wall.tilt(forces), motion.wall.tilt(slope));
        ((patch * c, patch * s), (patch * dc, patch * ds))
    }

    /// Mean depth of the patch, mm, each part weighted with the pressure that it carries, and
    /// by 5/4, so that on a level wall it is the deepest; zero off the wall.
    #[must_use]
    pub fn carrying_mm(&self) -> f64 {
        if let Some(coupled) = &self.coupled {
            return coupled.carrying_mm();
        }
        let p = &self.parameters;
        let (mut carried, mut sum) = (0.0, 0.0);
        for number in self.active.blocks() {
            let index = number.rem_euclid(self.q.len() as i64) as usize;
            let fast = self.q[index];
            let q = self.slow.get(index).map_or(fast, |slow| Lanes::HALF * (fast + *slow));
            let (depth, q) = (self.depth[index].to_array(), q.to_array());
            for (depth, q) in depth.into_iter().zip(q) {
                let pressure = (p.k_0 * depth - (p.k_0 - p.k_inf) * q).max(0.0);
                if depth > 0.0 {
                    (carried, sum) = (carried + pressure, sum + pressure * depth);
                }
            }
        }
        if carried > 0.0 { 1.25 * sum / carried } else { 0.0 }
    }

    fn trial_coupled(&mut self, motion: &Motion) -> Contact {
        self.refresh_law(motion.dt_s);
        let Self { coupled: Some(coupled), parameters, law, rotation, work, .. } = self else {
            return Contact::default();
        };
        coupled.trial(parameters, law, *rotation, motion, work)
    }

    fn refresh_law(&mut self, dt_s: f64) {
        if self.law.dt_s != dt_s {
            self.law = Law::new(&self.parameters, dt_s);
        }
    }

    /// Takes the ring through `motion`.
    pub fn commit(&mut self, motion: &Motion) {
        if self.coupled.is_some() {
            self.trial_coupled(motion);
            if let Some(coupled) = &mut self.coupled {
                self.taken_mj += coupled.commit(&self.parameters, &self.law);
            }
        } else {
            self.commit_elements(motion);
        }
        self.time += motion.dt_s;
        self.rotation += motion.turn_rad;
        self.work.strides += 1;
    }

    fn commit_elements(&mut self, motion: &Motion) {
        self.prepare(motion);
        let place = self.place(motion);
        let end = self.time + motion.dt_s;
        let patch = self.patch();
        let Self { ready, active, law, q, depth, slow, at, taken_mj, parameters, .. } = self;
        let count = q.len() as i64;
        let (k_0, excess) = (Lanes::splat(parameters.k_0), Lanes::splat(law.excess));
        let pressure = |depth: Lanes, q: Lanes| {
            let pressure = (k_0 * depth - excess * q).fast_max(Lanes::ZERO);
            pressure & depth.simd_gt(Lanes::ZERO)
        };
        // Trapezia under pressure over depth, N/mm.
        let mut work = Lanes::ZERO;
        match law.second {
            None => sweep::advance(&ready.blocks, &place, law, |number, depths, qs| {
                let index = ready.indices[number];
                let (old, new) = (pressure(depth[index], q[index]), pressure(depths, qs));
                work += (old + new) * (depths - depth[index]);
                (depth[index], q[index]) = (depths, qs);
            }),
            Some(second) => sweep::advance(&ready.blocks, &place, law, |number, depths, _| {
                let index = ready.indices[number];
                let before = depth[index];
                let old = pressure(before, Lanes::HALF * (q[index] + slow[index]));
                q[index] = law.first.advance(q[index], before, depths);
                slow[index] = second.advance(slow[index], before, depths);
                let new = pressure(depths, Lanes::HALF * (q[index] + slow[index]));
                work += (old + new) * (depths - before);
                depth[index] = depths;
            }),
        }
        // Out of reach: let go of within this step.
        for number in active.blocks().filter(|number| !ready.window.contains(*number)) {
            let index = number.rem_euclid(count) as usize;
            let old = std::mem::replace(&mut depth[index], Lanes::ZERO);
            let memory = slow.get(index).map_or(q[index], |s| Lanes::HALF * (q[index] + *s));
            work -= pressure(old, memory) * old;
            q[index] = law.first.carry(q[index], old);
            if let Some(second) = law.second {
                slow[index] = second.carry(slow[index], old);
            }
            at[index] = end;
        }
        *taken_mj += 0.5 * patch * work.to_array().iter().sum::<f64>();
        self.active = self.ready.window;
        self.ready.of = None;
    }

    /// Brings the ring to rest on this wall under a radial load, N, from this height above
    /// it, mm, its rubber relaxed; gives the contact and its height.
    ///
    /// # Errors
    /// [`BalanceError`] if no height carries the load.
    pub fn rest(
        &mut self,
        wall: LocalWall,
        height_mm: f64,
        load_n: f64,
    ) -> Result<Solved, BalanceError> {
        let motion = Motion { wall, height_mm, turn_rad: 0.0, dt_s: FOREVER_S };
        let axial = Axial::Pushed;
        let balance = Balance { preload_n: load_n, spring_n_per_mm: 0.0, arm_n: 0.0, axial };
        let solved = balance.solve(self, motion)?;
        self.commit(&Motion { height_mm: solved.height_mm, ..motion });
        Ok(solved)
    }

    /// Puts the ring into the state that `profile` gives for an angle from straight
    /// down (rad) of at most `within_rad`: depth and internal displacement, both mm, at
    /// time `time_s`. Elsewhere it is unloaded and fresh.
    pub fn seed(&mut self, time_s: f64, within_rad: f64, profile: impl Fn(f64) -> (f64, [f64; 2])) {
        self.q.fill(Lanes::ZERO);
        self.slow.fill(Lanes::ZERO);
        self.depth.fill(Lanes::ZERO);
        self.at.fill(time_s);
        self.rotation = 0.0;
        self.time = time_s;
        self.active = Window::default();
        let (first, last) = self.span(0.0, -within_rad, within_rad);
        self.active.add(first, last);
        self.active.limit(self.q.len() as i64);
        let pitch = self.pitch();
        for number in self.active.blocks() {
            let index = number.rem_euclid(self.q.len() as i64) as usize;
            let (mut depths, mut qs) = ([0.0; LANES], [[0.0; LANES]; 2]);
            for lane in 0..LANES {
                let element = index * LANES + lane;
                if element < self.parameters.elements {
                    let angle = element as f64 * pitch;
                    let angle = angle - TAU * (angle / TAU).round();
                    let (depth, [fast, slow]) = profile(angle);
                    (depths[lane], qs[0][lane], qs[1][lane]) = (depth, fast, slow);
                }
            }
            (self.depth[index], self.q[index]) = (depths.into(), qs[0].into());
            if let Some(slow) = self.slow.get_mut(index) {
                *slow = qs[1].into();
            }
        }
        self.ready.of = None;
    }

    /// Angle between two elements, rad.
    fn pitch(&self) -> f64 {
        TAU / self.parameters.elements as f64
    }

    /// Area of an element, mm^2.
    fn patch(&self) -> f64 {
        self.pitch() * self.parameters.radius_mm * self.parameters.width_mm
    }

    fn count(&mut self) {
        self.work.iterations += 1;
        self.work.elements += (self.ready.blocks.len() * LANES) as u64;
    }

    fn place(&self, motion: &Motion) -> Place {
        let (y, wall) = (motion.height_mm, &motion.wall);
        Place {
            radius: self.parameters.radius_mm,
            height: y,
            rise: self.ready.rise,
            edge: self.ready.edge.then(|| (wall.edge(y), wall.drop_mm, self.pitch())),
            round: (wall.edge_radius_mm > 0.0).then_some((
                wall.edge_radius_mm,
                wall.ahead_mm,
                wall.behind_mm,
            )),
        }
    }

    /// Blocks between two angles from straight down, rad, once the wheel has turned.
    fn span(&self, turned: f64, from: f64, to: f64) -> (i64, i64) {
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
    fn prepare(&mut self, motion: &Motion) {
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

#[cfg(test)]
mod tests;
