//! Elements coupled by the rubber between them: a layer of incompressible rubber on a rigid
//! hub, small strains, in which all shear relaxes alike.
//!
//! With the displacement u of the rim, inwards, and its memory q, `z = T u - E q` is what the
//! relaxed layer would be pressed in by the same pressure (correspondence principle, Lee
//! 1955): z = C p / G, with the layer's compliance C (`layer`) and the relaxed shear modulus
//! G. Where the rim bears, u is the depth of the wall; where it is free, p = 0 leaves it
//! u = (z + E q) / T. So it bulges beside a patch, sags around a corner, and recovers slowly.
//! Both follow from p >= 0 and z no less than the walls ask for (`complementarity`).
//!
//! Large strains stiffen rubber: all pressures rise by the part
//! `STIFFENING` (largest depth / thickness).
//!
//! Valid for thicknesses of 4 to 16 mm and compressions up to half of it. Neither fibres nor
//! bulging at the tread's sides nor tangential tractions on the rim are in it.

use std::f64::consts::TAU;

use super::complementarity::Complementarity;
use super::law::Law;
use super::layer::{self, STIFFENING};
use super::{Contact, Motion, RingParameters, Work};

use crate::plant::wall::LocalWall;

/// Angle from straight down beyond which a wall is not met and a bulge is none, rad.
const WIDEST: f64 = 1.4;

/// Height of a bulge at most, mm: elements that far off the wall may touch it.
const BULGE_MM: f64 = 1.5;

/// Height by which a trial may be lower than the first and still see all that may touch, mm.
const LOWER_MM: f64 = 0.5;

/// Loss of depth over the distance by which a ray passes the arc of an edge.
const PASSING: f64 = 10.0;

/// Displacement that counts as none, before it turns denormal and slow, mm.
const NONE_MM: f64 = 1e-30;

/// An element as a stride finds it.
#[derive(Clone, Copy, Debug, Default)]
struct Placed {
    sin: f64,
    cos: f64,
    /// What memory takes off `T u`, mm.
    carried: f64,
}

/// What an element meets.
#[derive(Clone, Copy, Debug, Default)]
struct Met {
    depth: f64,
    /// Change of the depth with the centre's height.
    rate: f64,
    floor: bool,
}

/// The step that the elements are laid out for.
#[derive(Clone, Debug, Default)]
struct Ready {
    of: Option<(LocalWall, f64, f64)>,
    lowest: f64,
    /// Number of the first element that faces the wall, counted on over the turns.
    first: i64,
    facing: Vec<Placed>,
    /// Of them, those that may touch.
    near: std::ops::Range<usize>,
}

/// The rim of a coupled tread.
#[derive(Clone, Debug, Default)]
pub(super) struct Coupled {
    /// Relaxed shear modulus over k_inf, mm.
    modulus_mm: f64,
    contact: Complementarity,
    /// Displacement of the rim and memory of both relaxations, mm, inwards.
    u: Vec<f64>,
    q: [Vec<f64>; 2],
    /// Elements in contact at the last trial.
    active: Vec<bool>,
    ready: Ready,
    met: Vec<Met>,
    wanted: Vec<f64>,
    touching: Vec<bool>,
    z: Vec<f64>,
    /// Rise of all pressures by large strains at the last trial.
    stiffer: f64,
    /// Forces on the elements at the end of the last stride, N.
    forces: Vec<f64>,
}

impl Coupled {
    /// A rim at rest and unloaded.
    pub(super) fn new(parameters: &RingParameters) -> Self {
        let count = parameters.elements;
        let table = layer::compliance(parameters.radius_mm, parameters.tread_thickness_mm, count);
        let facing = (2.0 * WIDEST / TAU * count as f64) as usize + 2;
        Self {
            modulus_mm: layer::modulus_mm(parameters),
            contact: Complementarity::new(&table, facing.min(count)),
            u: vec![0.0; count],
            q: [vec![0.0; count], vec![0.0; count]],
            active: vec![false; count],
            stiffer: 1.0,
            forces: vec![0.0; count],
            ..Self::default()
        }
    }

    /// Mean depth of the patch as [`super::Ring::carrying_mm`] has it, mm.
    pub(super) fn carrying_mm(&self) -> f64 {
        let (mut carried, mut sum) = (0.0, 0.0);
        for (force, u) in self.forces.iter().zip(&self.u) {
            (carried, sum) = (carried + force, sum + force * u);
        }
        if carried > 0.0 { 1.25 * sum / carried } else { 0.0 }
    }

    /// Contact after `motion`, leaving the rim as it is.
    pub(super) fn trial(
        &mut self,
        parameters: &RingParameters,
        law: &Law,
        rotation: f64,
        motion: &Motion,
        work: &mut Work,
    ) -> Contact {
        self.lay_out(parameters, law, rotation, motion);
        let near = self.ready.near.clone();
        work.iterations += 1;
        work.elements += near.len() as u64;
        self.meet(parameters, law, motion);
        let count = self.u.len() as i64;
        let index =
            |i: usize| (self.ready.first + (near.start + i) as i64).rem_euclid(count) as usize;
        self.touching.clear();
        self.touching.extend((0..near.len()).map(|i| self.active[index(i)]));
        self.contact.solve(&self.wanted, &mut self.touching);
        self.active.fill(false);
        for (i, touches) in self.touching.iter().enumerate() {
            self.active[index(i)] = *touches;
        }
        self.total(parameters, law, motion)
    }

    /// What the last trial has found becomes the rim's state; gives the work of the contact on
    /// it, mJ, by trapezia under force over displacement.
    pub(super) fn commit(&mut self, parameters: &RingParameters, law: &Law) -> f64 {
        let scale = self.scale(parameters) * self.stiffer;
        let Self { contact, u, q, ready, z, forces, .. } = self;
        let mut work_mj = 0.0;
        let (facing, count) = (ready.facing.len(), u.len());
        contact.displacement_over(ready.near.start, facing, z);
        let (tangent, shares) = relative(law);
        let branches = [Some(law.first), law.second];
        let first = ready.first.rem_euclid(count as i64) as usize;
        for (i, u) in u.iter_mut().enumerate() {
            let place = if i >= first { i - first } else { i + count - first };
            let mut eased = z.get(place).copied().unwrap_or(0.0);
            let old = *u;
            for ((q, branch), share) in q.iter_mut().zip(branches).zip(shares) {
                if let Some(branch) = branch {
                    q[i] = branch.keep * q[i] + branch.from_old * old;
                    eased += share * q[i];
                }
            }
            *u = eased / tangent;
            for (q, branch) in q.iter_mut().zip(branches) {
                if let Some(branch) = branch {
                    q[i] += branch.from_new * *u;
                    q[i] = if q[i].abs() < NONE_MM { 0.0 } else { q[i] };
                }
            }
            *u = if u.abs() < NONE_MM { 0.0 } else { *u };
            let near = place.checked_sub(ready.near.start);
            let pressure = near.and_then(|near| contact.pressures.get(near));
            let force = scale * pressure.copied().unwrap_or(0.0);
            work_mj += 0.5 * (force + forces[i]) * (*u - old);
            forces[i] = force;
        }
        ready.of = None;
        work_mj
    }

    /// Force by the pressure over the shear modulus on an element, N.
    fn scale(&self, parameters: &RingParameters) -> f64 {
        let pitch = TAU / self.u.len() as f64;
        let patch = pitch * parameters.radius_mm * parameters.width_mm;
        parameters.k_inf * self.modulus_mm * patch
    }

    /// Places the elements that face the wall, unless they are.
    fn lay_out(&mut self, parameters: &RingParameters, law: &Law, rotation: f64, motion: &Motion) {
        let of = (motion.wall, motion.turn_rad, motion.dt_s);
        if self.ready.of == Some(of) && motion.height_mm >= self.ready.lowest {
            return;
        }
        let (count, radius) = (self.u.len(), parameters.radius_mm);
        let pitch = TAU / count as f64;
        let turned = rotation + motion.turn_rad;
        let first = ((turned - WIDEST) / pitch).ceil() as i64;
        let last = ((turned + WIDEST) / pitch).floor() as i64;
        let (_, shares) = relative(law);
        let Self { u, q, ready, .. } = self;
        ready.facing.clear();
        ready.facing.extend((first..=last.min(first + count as i64 - 1)).map(|number| {
            let index = number.rem_euclid(count as i64) as usize;
            let (sin, cos) = (number as f64 * pitch - turned).sin_cos();
            let mut carried = 0.0;
            for ((q, branch), share) in q.iter().zip([Some(law.first), law.second]).zip(shares) {
                if let Some(branch) = branch {
                    carried += share * (branch.keep * q[index] + branch.from_old * u[index]);
                }
            }
            Placed { sin, cos, carried }
        }));
        // Beside the nearest points of the wall, as far as a bulge may reach.
        let lowest = motion.height_mm - LOWER_MM;
        let (floor, step) = super::layout::reach(&motion.wall, lowest - BULGE_MM, radius);
        let (from, to) = (-floor, step.map_or(floor, |(_, to)| to.max(floor)));
        let at = |angle: f64| ((turned + angle) / pitch).floor() as i64 - first;
        let facing = ready.facing.len() as i64;
        let start = at(from).clamp(0, facing - 1);
        ready.near = start as usize..(at(to) + 1).clamp(start + 1, facing) as usize;
        (ready.of, ready.lowest, ready.first) = (Some(of), lowest, first);
    }

    /// Depths of the walls, and the displacements that they ask for.
    fn meet(&mut self, parameters: &RingParameters, law: &Law, motion: &Motion) {
        let (wall, height) = (&motion.wall, motion.height_mm);
        let radius = parameters.radius_mm;
        let pitch = TAU / self.u.len() as f64;
        let edge = wall.edge(height);
        let (tangent, _) = relative(law);
        self.met.clear();
        self.wanted.clear();
        for element in &self.ready.facing[self.ready.near.clone()] {
            let mut met = meet(wall, radius, height, element);
            if met.floor && wall.edge_radius_mm == 0.0 {
                // Up to half of an element that reaches past the edge the wall carries it all,
                // then soon nothing: pressure is singular at an edge.
                let behind = 1.0 - 2.0 * edge.covered(element.sin, element.cos, pitch);
                if behind > 0.0 {
                    met.depth -= behind * wall.drop_mm / element.cos;
                }
                if behind > 0.0 && behind < 1.0 {
                    // The higher the centre, the nearer to straight down the edge.
                    let away = wall.behind_mm.powi(2) + height * height;
                    let turns = wall.behind_mm / away;
                    met.rate -= 2.0 * turns / pitch * wall.drop_mm / element.cos;
                }
            }
            self.met.push(met);
            self.wanted.push(tangent * met.depth - element.carried);
        }
    }

    /// Resultants of the pressures found.
    fn total(&mut self, parameters: &RingParameters, law: &Law, motion: &Motion) -> Contact {
        let Self { contact, ready, met, wanted, touching, modulus_mm, .. } = self;
        let near = &ready.facing[ready.near.clone()];
        let nearest = motion.wall.nearest(motion.height_mm);
        let depth_mm = parameters.radius_mm - nearest;
        let thickness = parameters.tread_thickness_mm;
        let stiffer = 1.0 + STIFFENING * depth_mm.max(0.0) / thickness;
        let modulus = parameters.k_inf * *modulus_mm;
        let patch = TAU / self.u.len() as f64 * parameters.radius_mm * parameters.width_mm;
        let scale = modulus * stiffer * patch;
        self.stiffer = stiffer;
        let mut out = Contact { depth_mm, floor_pressure: f64::NEG_INFINITY, ..Contact::default() };
        let per_mm = modulus / contact.own();
        for (i, (element, met)) in near.iter().zip(met.iter()).enumerate() {
            let pressure = contact.pressures[i];
            if touching[i] {
                let force = scale * pressure;
                let (c, s) = (force * element.cos, force * element.sin);
                out.normal_n += force;
                out.cosine_n += c;
                out.sine_n += s;
                if met.floor {
                    out.floor_n += c;
                } else {
                    out.step_cosine_n += c;
                    out.step_sine_n += s;
                }
                out.area_mm2 += patch;
            }
            if met.floor {
                // Off the wall: minus what its own compliance would make of that distance.
                let raw = if touching[i] {
                    stiffer * modulus * pressure
                } else {
                    per_mm * (wanted[i] - contact.displacement[i])
                };
                out.floor_pressure = out.floor_pressure.max(raw);
            }
        }
        // The pressures follow the walls, and all stiffen with the largest depth.
        let (tangent, _) = relative(law);
        let (indices, change) = contact.respond(|i| tangent * met[i].rate);
        let (mut dc, mut ds) = (0.0, 0.0);
        for (i, change) in indices.iter().zip(change) {
            dc += scale * change * near[*i].cos;
            ds += scale * change * near[*i].sin;
        }
        if depth_mm > 0.0 {
            let round = motion.wall.edge_radius_mm;
            let over = motion.height_mm - motion.wall.rise_mm + round;
            let sinks = if nearest < motion.height_mm { over / (nearest + round) } else { 1.0 };
            let more = -STIFFENING / thickness * sinks / stiffer;
            dc += more * out.cosine_n;
            ds += more * out.sine_n;
        }
        (out.cosine_n, out.sine_n) = motion.wall.tilt((out.cosine_n, out.sine_n));
        out.slope = motion.wall.tilt((dc, ds));
        out
    }
}

/// What the ray of an element meets of wall, step ahead and rounded edges; a sharp edge behind
/// is left to its elements.
fn meet(wall: &LocalWall, radius: f64, height: f64, element: &Placed) -> Met {
    let Placed { sin, cos, .. } = *element;
    let (round, over) = (wall.edge_radius_mm, height - wall.rise_mm);
    let plane = |distance: f64, rate: f64, floor| Met { depth: radius - distance, rate, floor };
    let arc = |ahead: f64, below: f64, floor| {
        let (distance, rate) = meet_arc(round, ahead, below, element)?;
        (distance * sin < ahead || floor).then(|| plane(distance, rate, floor))
    };
    if height * sin > wall.ahead_mm * cos {
        let met = if over * sin <= wall.ahead_mm * cos {
            plane(wall.ahead_mm / sin, 0.0, false)
        } else {
            plane(over / cos, -1.0 / cos, false)
        };
        let on_arc = (round > 0.0)
            .then(|| arc(wall.ahead_mm + round, over + round, false))
            .flatten()
            .filter(|arc| (radius - arc.depth) * cos < over + round);
        on_arc.unwrap_or(met)
    } else if round > 0.0 && height * sin < (round - wall.behind_mm) * cos {
        let (ahead, below) = (round - wall.behind_mm, height + round);
        arc(ahead, below, true).unwrap_or_else(|| {
            // A ray that passes the arc soon meets nothing.
            let passes = ahead * cos - below * sin - round;
            let depth = radius - (ahead * sin + below * cos) - PASSING * passes.max(0.0);
            Met { depth, rate: PASSING * sin - cos, floor: true }
        })
    } else {
        plane(height / cos, -1.0 / cos, true)
    }
}

/// Distance to an arc with its centre `ahead` of the wheel's and `below` it, mm, and change of
/// depth by the height; none if the ray passes it.
fn meet_arc(round: f64, ahead: f64, below: f64, element: &Placed) -> Option<(f64, f64)> {
    let Placed { sin, cos, .. } = *element;
    let past = ahead * cos - below * sin;
    let rest = round * round - past * past;
    if rest <= 0.0 {
        return None;
    }
    let half = rest.sqrt();
    // Where a ray grazes the arc, a bound.
    Some((ahead * sin + below * cos - half, past * sin / half.max(0.1 * round) - cos))
}

/// Tangent and shares of the relaxations over k_inf.
fn relative(law: &Law) -> (f64, [f64; 2]) {
    let excess = law.excess / law.k_inf;
    let shares = if law.second.is_some() { [0.5 * excess; 2] } else { [excess, 0.0] };
    (law.tangent / law.k_inf, shares)
}

#[cfg(test)]
mod tests {
    use super::super::Ring;
    use super::*;
    use crate::plant::balance::Balance;
    use crate::plant::wall::{Step, Wall};
    use interstage::rig::Rig;

    fn rubber(thickness: f64, elements: usize) -> RingParameters {
        let ring = RingParameters::of(&Rig::fe(), elements);
        RingParameters { tread_thickness_mm: thickness, ..ring }
    }

    fn wall(at_mm: f64) -> LocalWall {
        Wall::new(vec![Step { position_mm: 0.0, height_mm: 4.0 }]).local(at_mm)
    }

    /// On the level wall, on wall and corner, on the corner alone, off an edge.
    fn places() -> [(f64, f64); 4] {
        [(-40.0, 24.6), (-12.0, 24.8), (-9.0, 25.6), (1.0, 24.5)]
    }

    #[test]
    fn the_slope_is_the_derivative() {
        for (at, height_mm) in places() {
            let mut ring = Ring::new(rubber(8.0, 720));
            Balance::rest(&mut ring, wall(-40.0), 24.7, 30.0).unwrap();
            let wall = wall(at);
            let motion = |height_mm| Motion { wall, height_mm, turn_rad: 0.002, dt_s: 0.01 };
            let contact = ring.trial(&motion(height_mm));
            let [low, high] = [-1e-5, 1e-5].map(|d| ring.trial(&motion(height_mm + d)));
            let cosine = (high.cosine_n - low.cosine_n) / 2e-5;
            let sine = (high.sine_n - low.sine_n) / 2e-5;
            assert!((cosine / contact.slope.0 - 1.0).abs() < 1e-3, "{at}: {cosine} {contact:?}");
            assert!((sine - contact.slope.1).abs() < 1e-3 * cosine.abs(), "{at}: {sine}");
            assert!(contact.normal_n >= contact.cosine_n);
        }
    }

    /// A small radius is no radius; a larger one moves the depth of the corner by less than it.
    #[test]
    fn a_rounded_edge_is_a_sharp_one_in_the_limit() {
        for (at, height_mm) in places() {
            let force = |edge_radius_mm| {
                let mut ring = Ring::new(rubber(8.0, 1440));
                let wall = LocalWall { edge_radius_mm, ..wall(at) };
                ring.trial(&Motion { wall, height_mm, turn_rad: 0.0, dt_s: 1e9 }).cosine_n
            };
            let [sharp, fine, round] = [0.0, 0.02, 0.3].map(force);
            assert!((fine / sharp - 1.0).abs() < 0.03, "{at}: {sharp} {fine}");
            assert!(round < 1.01 * sharp && round > 0.7 * sharp, "{at}: {sharp} {round}");
        }
    }

    #[test]
    fn what_is_pressed_in_bulges_out() {
        let mut ring = Ring::new(rubber(5.0, 720));
        let solved = Balance::rest(&mut ring, wall(-40.0), 24.7, 50.0).unwrap();
        assert!((solved.contact.cosine_n - 50.0).abs() < 1e-3);
        let u = &ring.coupled.as_ref().unwrap().u;
        let deepest = u.iter().copied().fold(0.0, f64::max);
        assert!((deepest - solved.contact.depth_mm).abs() < 2e-3, "{deepest}");
        // Behind the hub a bulge of a hundredth of it is left out.
        let volume: f64 = u.iter().copied().filter(|u| *u > 0.0).sum();
        let left: f64 = u.iter().sum();
        assert!((0.0..0.02 * volume).contains(&left), "{left} of {volume}");
    }

    #[test]
    fn twice_the_elements_carry_the_same() {
        for (at, height_mm) in places() {
            let force = |elements| {
                let mut ring = Ring::new(rubber(8.0, elements));
                let motion = Motion { wall: wall(at), height_mm, turn_rad: 0.0, dt_s: 1e9 };
                ring.trial(&motion).cosine_n
            };
            let (coarse, fine) = (force(1440), force(2880));
            assert!((coarse / fine - 1.0).abs() < 0.015, "{at}: {coarse} {fine}");
        }
    }

    /// A rim let go of keeps its shape at first and loses it by the retardation time.
    #[test]
    fn a_free_rim_recovers_slowly() {
        let parameters = rubber(8.0, 720);
        let mut ring = Ring::new(parameters);
        let pressed = Balance::rest(&mut ring, wall(-40.0), 24.7, 50.0).unwrap().contact.depth_mm;
        let free = |dt_s| Motion { wall: wall(-40.0), height_mm: 27.0, turn_rad: 0.0, dt_s };
        let deepest =
            |ring: &Ring| ring.coupled.as_ref().unwrap().u.iter().copied().fold(0.0, f64::max);
        ring.commit(&free(1e-6));
        let lost = parameters.k_inf / parameters.k_0;
        assert!((deepest(&ring) / (pressed * (1.0 - lost)) - 1.0).abs() < 1e-2);
        let before = deepest(&ring);
        for _ in 0..1000 {
            ring.commit(&free(1e-3));
        }
        let kept = (-lost / parameters.tau_s).exp();
        assert!((deepest(&ring) / before / kept - 1.0).abs() < 1e-2, "{}", deepest(&ring) / before);
    }
}
