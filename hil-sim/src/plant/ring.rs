//! The tread as a ring of radial elements with memory, rolling over the wall.
//!
//! An element whose ray from the wheel centre meets the wall at depth delta
//! carries p = k_inf delta + (k_0 - k_inf)(delta - q), q' = (delta - q)/tau,
//! p >= 0: the three-parameter solid per area. Elements turn with the wheel.
//! Within a step delta runs linearly, and q is integrated exactly for it.

use interstage::rig::Rig;

use super::wall::{Edge, Facet, LocalWall};

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
        }
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
    /// element reaches the floor, minus k_inf times the clearance.
    pub floor_pressure: f64,
    /// Derivatives of `cosine_n` and `sine_n` by the centre's height, N/mm.
    pub slope: (f64, f64),
}

impl Contact {
    /// Magnitude of the step's force on the wheel, N.
    #[must_use]
    pub fn step_force_n(&self) -> f64 {
        self.step_cosine_n.hypot(self.step_sine_n)
    }
}

/// The ring's elements and how far the wheel has turned.
#[derive(Clone, Debug)]
pub struct Ring {
    parameters: RingParameters,
    cos: Vec<f64>,
    sin: Vec<f64>,
    elements: Vec<Element>,
    /// Angle turned since the start, rad; positive rolls forwards.
    rotation: f64,
    /// Time of the last step's end, s.
    time: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Element {
    /// Internal displacement, mm.
    q: f64,
    /// Depth at `at`, mm.
    depth: f64,
    /// When the two were last brought up to date, s.
    at: f64,
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
    #[must_use]
    pub fn new(parameters: RingParameters) -> Self {
        let pitch = std::f64::consts::TAU / parameters.elements as f64;
        let angles = (0..parameters.elements).map(|i| i as f64 * pitch);
        Self {
            parameters,
            cos: angles.clone().map(f64::cos).collect(),
            sin: angles.map(f64::sin).collect(),
            elements: vec![Element::default(); parameters.elements],
            rotation: 0.0,
            time: 0.0,
        }
    }

    /// Wheel and rubber.
    #[must_use]
    pub fn parameters(&self) -> &RingParameters {
        &self.parameters
    }

    /// Contact after `motion`, leaving the ring as it is.
    #[must_use]
    pub fn trial(&self, motion: &Motion) -> Contact {
        let mut contact = Contact::default();
        let law = Law::new(&self.parameters, motion.dt_s);
        let mut floor_pressure = f64::NEG_INFINITY;
        let edge = motion.wall.edge(motion.height_mm);
        let patch = self.pitch() * self.parameters.radius_mm * self.parameters.width_mm;
        self.sweep(motion, |index, sin, cos| {
            let (depth, facet, covered) = self.meets(motion, &edge, sin, cos);
            if depth <= 0.0 {
                return;
            }
            let element = &self.elements[index];
            let (q, before) = element.at_start(self.time, &law);
            let pressure = law.pressure(depth, law.advance(q, before, depth));
            if facet == Facet::Floor {
                floor_pressure = floor_pressure.max(pressure);
            }
            if pressure <= 0.0 {
                return;
            }
            let patch = patch * covered;
            let force = pressure * patch;
            contact.normal_n += force;
            contact.cosine_n += force * cos;
            contact.sine_n += force * sin;
            contact.area_mm2 += patch;
            if facet == Facet::Floor {
                contact.floor_n += force * cos;
            } else {
                contact.step_cosine_n += force * cos;
                contact.step_sine_n += force * sin;
            }
            let slope = -law.tangent * motion.wall.slope(motion.height_mm, sin, cos) * patch;
            contact.slope.0 += slope * cos;
            contact.slope.1 += slope * sin;
        });
        contact.depth_mm = self.parameters.radius_mm - motion.wall.nearest(motion.height_mm);
        contact.floor_pressure = if floor_pressure.is_finite() {
            floor_pressure
        } else {
            -self.parameters.k_inf * (motion.height_mm - self.parameters.radius_mm).abs()
        };
        contact
    }

    /// Takes the ring through `motion`.
    pub fn commit(&mut self, motion: &Motion) {
        let law = Law::new(&self.parameters, motion.dt_s);
        let end = self.time + motion.dt_s;
        let edge = motion.wall.edge(motion.height_mm);
        let mut touched = Vec::with_capacity(512);
        self.sweep(motion, |index, sin, cos| {
            let depth = self.meets(motion, &edge, sin, cos).0.max(0.0);
            let element = &self.elements[index];
            if depth > 0.0 || element.depth > 0.0 {
                let (q, before) = element.at_start(self.time, &law);
                touched.push((index, law.advance(q, before, depth), depth));
            }
        });
        for (index, q, depth) in touched {
            self.elements[index] = Element { q, depth, at: end };
        }
        self.time = end;
        self.rotation += motion.turn_rad;
    }

    /// Puts the ring into the state that `profile` gives for an angle from straight
    /// down (rad): depth and internal displacement, both mm, at time `time_s`.
    pub fn seed(&mut self, time_s: f64, profile: impl Fn(f64) -> (f64, f64)) {
        let pitch = self.pitch();
        for (index, element) in self.elements.iter_mut().enumerate() {
            let angle = index as f64 * pitch - self.rotation;
            let angle = angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round();
            let (depth, q) = profile(angle);
            *element = Element { q, depth, at: time_s };
        }
        self.time = time_s;
    }

    /// Depth of an element, what it meets, and the part of its width that does.
    #[inline]
    fn meets(&self, motion: &Motion, edge: &Edge, sin: f64, cos: f64) -> (f64, Facet, f64) {
        let covered = edge.covered(sin, cos, self.pitch());
        let (distance, facet) = if covered > 0.0 && covered < 1.0 {
            (motion.height_mm / cos, Facet::Floor)
        } else {
            motion.wall.ray(motion.height_mm, sin, cos)
        };
        (self.parameters.radius_mm - distance, facet, covered)
    }

    /// Angle between two elements, rad.
    fn pitch(&self) -> f64 {
        std::f64::consts::TAU / self.parameters.elements as f64
    }

    /// Calls `visit` with index, sine and cosine of every element within reach of
    /// the wall after the turn.
    fn sweep(&self, motion: &Motion, mut visit: impl FnMut(usize, f64, f64)) {
        let (count, pitch) = (self.parameters.elements, self.pitch());
        let turned = self.rotation + motion.turn_rad;
        let (ahead, behind) = self.reach(motion);
        let first = ((turned - behind) / pitch).ceil() as i64;
        let last = ((turned + ahead) / pitch).floor() as i64;
        let (turned_sin, turned_cos) = turned.sin_cos();
        for element in first..=last {
            let index = element.rem_euclid(count as i64) as usize;
            let (sin, cos) = (self.sin[index], self.cos[index]);
            visit(index, sin * turned_cos - cos * turned_sin, cos * turned_cos + sin * turned_sin);
        }
    }

    /// Half-angles within which an element can touch, or touched a step ago, rad.
    fn reach(&self, motion: &Motion) -> (f64, f64) {
        let radius = self.parameters.radius_mm;
        let half = |height: f64| (height / radius).clamp(-1.0, 1.0).acos();
        let floor = half(motion.height_mm);
        let margin = motion.turn_rad.abs() + 0.02;
        let ahead = if motion.wall.ahead_mm < radius {
            floor.max(half(motion.height_mm - motion.wall.rise_mm))
        } else {
            floor
        };
        ((ahead + margin).min(1.5), (floor + margin).min(1.5))
    }
}

impl Element {
    /// Internal displacement and depth at the start of the step that begins at `time`.
    #[inline]
    fn at_start(&self, time: f64, law: &Law) -> (f64, f64) {
        let idle = time - self.at;
        if idle <= 0.0 || self.q == 0.0 {
            (self.q, self.depth)
        } else {
            // Out of contact since `at`: only the memory decays.
            (self.q * (-idle / law.tau).exp(), 0.0)
        }
    }
}

/// The three-parameter solid over one step.
struct Law {
    k_inf: f64,
    excess: f64,
    tau: f64,
    keep: f64,
    from_old: f64,
    from_new: f64,
    /// dp/d(depth) at the step's end.
    tangent: f64,
}

impl Law {
    fn new(parameters: &RingParameters, dt_s: f64) -> Self {
        let ratio = dt_s / parameters.tau_s;
        let keep = (-ratio).exp();
        // Mean of the kernel over the step; series where the quotient cancels.
        let mean = if ratio < 1e-5 { 1.0 - 0.5 * ratio } else { -(-ratio).exp_m1() / ratio };
        let excess = parameters.k_0 - parameters.k_inf;
        Self {
            k_inf: parameters.k_inf,
            excess,
            tau: parameters.tau_s,
            keep,
            from_old: mean - keep,
            from_new: 1.0 - mean,
            tangent: parameters.k_inf + excess * mean,
        }
    }

    #[inline]
    fn advance(&self, q: f64, old: f64, new: f64) -> f64 {
        self.keep * q + self.from_old * old + self.from_new * new
    }

    #[inline]
    fn pressure(&self, depth: f64, q: f64) -> f64 {
        self.k_inf * depth + self.excess * (depth - q)
    }
}
