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
//! Only elements that can touch are visited (`layout`), four at a time (`sweep`). The
//! memory of the others is brought up to date in closed form when they come back.

mod complementarity;
mod coupled;
mod law;
pub(super) mod layer;
mod layout;
mod parameters;
mod sweep;

use std::f64::consts::TAU;

use super::wall::LocalWall;
use coupled::Coupled;
use law::{Lanes, Law};
use layout::{LANES, Ready, Window};
use sweep::{Place, Sums};

pub use parameters::{Contact, RingParameters};

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

impl Ring {
    /// A ring at rest and unloaded.
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
    pub(crate) fn visiting_all(mut self) -> Self {
        self.visit_all = true;
        self
    }

    /// What the elements took up, mJ: stored in those in contact, the rest lost in them.
    pub(crate) fn taken_mj(&self) -> f64 {
        self.taken_mj
    }

    /// Stiffness becomes this from now on, N/mm^3, relaxed and instant.
    pub(super) fn set_stiffness(&mut self, k_inf: f64, k_0: f64) {
        (self.parameters.k_inf, self.parameters.k_0) = (k_inf, k_0);
        self.law = Law::new(&self.parameters, 0.0);
        self.ready = Ready::default();
    }

    pub fn parameters(&self) -> &RingParameters {
        &self.parameters
    }

    /// What has been computed so far.
    pub(super) const fn work(&self) -> Work {
        self.work
    }

    /// Contact after `motion`, leaving the elements as they are.
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
    pub(crate) fn carrying_mm(&self) -> f64 {
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

    /// Puts the ring into the state that `profile` gives for an angle from straight
    /// down (rad) of at most `within_rad`: depth and internal displacement, both mm, at
    /// time `time_s`. Elsewhere it is unloaded and fresh.
    pub(crate) fn seed(
        &mut self,
        time_s: f64,
        within_rad: f64,
        profile: impl Fn(f64) -> (f64, [f64; 2]),
    ) {
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
        self.parameters.pitch_mm() * self.parameters.width_mm
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
}

#[cfg(test)]
mod tests;
