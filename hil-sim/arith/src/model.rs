//! The polynomials of the shipping model, solved by one step of Halley's method, once for
//! all arithmetics.
//!
//! Lengths over R and forces over a unit; the run over the corner as part of the
//! longest. Polynomials in parts of a whole are in `2 part - 1`, from -1 to 1.

use crate::number::Number;

/// Coefficients of one way: see [`Way`].
pub const WAY: usize = 2 + FELT + 21;

/// Terms of the felt stiffening.
pub const FELT: usize = 22;

/// Coefficients of both ways and of what they share.
pub const COEFFICIENTS: usize = 34 + 2 * WAY;

/// A working point, bits of Q15.16.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Given {
    /// 0 deploys, 1 retracts.
    pub direction: u32,
    /// Speed at lift-off, mm/s.
    pub speed: i32,
    /// Radial force, N, forwards; gap, mm, for the inverse.
    pub wanted: i32,
}

/// What the model says of a crossing, bits of Q15.16.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Answer {
    /// Clearance at the root of the step, mm.
    pub gap: i32,
    /// Axial force of the step's contact, N.
    pub corner_force: i32,
    /// Stress increment of the first touch, kPa.
    pub impact_stress_kpa: i32,
    /// Amplitude of the arm's first mode, um.
    pub vibration_um: i32,
    /// Friction that lifting the load uses.
    pub utilisation: i32,
    /// Friction left unused.
    pub slip_margin: i32,
}

impl Given {
    /// The words as memory holds them.
    #[must_use]
    pub const fn words(&self) -> [u32; 3] {
        [self.direction, self.speed as u32, self.wanted as u32]
    }
}

/// Coefficients that both ways share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shared<N = f64> {
    /// 128 N over the unit of force.
    pub parts_per_128_n: N,
    /// Unit of force over 128 N.
    pub unit_128_n: N,
    /// Free and longest run over R, shortest over longest.
    pub free: N,
    /// See `free`.
    pub longest: N,
    /// See `free`.
    pub least: N,
    /// 1 over the longest run over R, over 4.
    pub inverse_longest_4: N,
    /// R/2 over 16 mm.
    pub half_radius_16: N,
    /// 1/R, 1/mm.
    pub inverse_radius: N,
    /// Load, and what its least slope takes off every force, over the unit.
    pub load: N,
    /// See `load`.
    pub least_lifting: N,
    /// Impact stress at 128 mm/s over 16 kPa.
    pub stress: N,
    /// `2 v / (omega r)` at 128 mm/s and the longest run.
    pub ramp: N,
    /// Unit of force over the arm's stiffness, over 4096 um.
    pub deflection: N,
    /// Friction of tread on wall.
    pub friction: N,
    /// Relaxed force over `r^2`.
    pub force: [N; 5],
    /// Slope of the contact.
    pub slope: [N; 5],
    /// Radial reaction over elastic force.
    pub cosine: [N; 5],
    /// `2 R gap / d^2`.
    pub gap: [N; 5],
}

/// Coefficients of one way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way<N = f64> {
    /// Speed at which half the crossing is fast, over 128 mm/s.
    pub half_speed: N,
    /// Relaxed over instant stiffness.
    pub relaxed: N,
    /// Felt stiffening `(s - 1)/s E`: `u^i t^j` for i/5 + j/6 at most 1, by j and then i.
    pub felt: [N; FELT],
    /// Run over twice the root of the elastic force: total degree 5, by the root and then
    /// by the fast part.
    pub guess: [N; 21],
}

/// The model of one rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model<N> {
    shared: Shared<N>,
    ways: [Way<N>; 2],
    /// Estimated over nominal stiffness of the tread, and its reciprocal: both change once
    /// a crossing.
    scale: N,
    inverse_scale: N,
}

macro_rules! horner {
    ($t:expr; $c:expr) => { $c };
    ($t:expr; $c:expr, $($rest:expr),+) => { $c + $t * horner!($t; $($rest),+) };
}

/// A polynomial's value and its derivative.
macro_rules! horner_with_slope {
    ($t:expr; $c:expr, $last:expr) => { ($c + $t * $last, $last) };
    ($t:expr; $c:expr, $($rest:expr),+) => {{
        let (value, slope) = horner_with_slope!($t; $($rest),+);
        ($c + $t * value, value + $t * slope)
    }};
}

impl Shared {
    fn list(&self) -> impl Iterator<Item = f64> {
        let single = [
            self.parts_per_128_n,
            self.unit_128_n,
            self.free,
            self.longest,
            self.least,
            self.inverse_longest_4,
            self.half_radius_16,
            self.inverse_radius,
            self.load,
            self.least_lifting,
            self.stress,
            self.ramp,
            self.deflection,
            self.friction,
        ];
        let quartics = [self.force, self.slope, self.cosine, self.gap];
        single.into_iter().chain(quartics.into_iter().flatten())
    }
}

impl Way {
    fn list(&self) -> impl Iterator<Item = f64> {
        [self.half_speed, self.relaxed].into_iter().chain(self.felt).chain(self.guess)
    }
}

impl<N: Number> Model<N> {
    /// All coefficients in a row.
    #[must_use]
    pub fn flat(shared: &Shared, ways: &[Way; 2]) -> [f64; COEFFICIENTS] {
        let mut all = shared.list().chain(ways[0].list()).chain(ways[1].list());
        core::array::from_fn(|_| all.next().unwrap_or(f64::NAN))
    }

    /// The model with these coefficients; none if one is out of the arithmetic's range.
    #[must_use]
    pub fn of(flat: &[f64; COEFFICIENTS]) -> Option<Self> {
        let mut rest = flat.iter();
        let mut next = || N::of(*rest.next()?);
        let shared = Shared {
            parts_per_128_n: next()?,
            unit_128_n: next()?,
            free: next()?,
            longest: next()?,
            least: next()?,
            inverse_longest_4: next()?,
            half_radius_16: next()?,
            inverse_radius: next()?,
            load: next()?,
            least_lifting: next()?,
            stress: next()?,
            ramp: next()?,
            deflection: next()?,
            friction: next()?,
            force: list(&mut next)?,
            slope: list(&mut next)?,
            cosine: list(&mut next)?,
            gap: list(&mut next)?,
        };
        let mut way = || {
            Some(Way {
                half_speed: next()?,
                relaxed: next()?,
                felt: list(&mut next)?,
                guess: list(&mut next)?,
            })
        };
        Some(Self { shared, ways: [way()?, way()?], scale: N::ONE, inverse_scale: N::ONE })
    }

    /// Everything about the crossing at this radial force.
    #[inline(always)]
    pub fn crossing(&self, given: &Given) -> Answer {
        let (shared, way) = (&self.shared, self.way(given.direction));
        let speed = N::input(given.speed, 7);
        let wanted = N::input(given.wanted, 7) * shared.parts_per_128_n;
        let fast = speed / (speed + way.half_speed);
        let row = way.row(fast);
        let load = shared.load * self.inverse_scale;
        let sought = wanted * self.inverse_scale;
        let elastic = (sought - shared.least_lifting).at_least(N::ZERO);
        let root = (elastic + elastic + elastic + elastic).at_most(N::ONE).sqrt();
        let guess = (way.guess(fast, root) * root).at_least(shared.least).at_most(N::ONE);
        let run = shared.refine(guess, sought, load, &row);
        let t = run + run - N::ONE;
        let slope = quartic(&shared.slope, t);
        let reaction = (wanted - shared.load * slope).at_least(N::ZERO);
        let radial = reaction * quartic(&shared.cosine, t);
        let used = shared.load / radial.at_least(shared.least) + slope;
        let ramp = (speed * shared.ramp / run).at_most(N::ONE);
        Answer {
            gap: shared.gap_after(run, t),
            corner_force: (radial * slope * shared.unit_128_n).output(7),
            impact_stress_kpa: (speed * shared.stress).output(4),
            vibration_um: (radial * shared.deflection * ramp).output(12),
            utilisation: used.output(0),
            slip_margin: (shared.friction - used).output(0),
        }
    }

    /// Radial force that gives this gap, N.
    #[inline(always)]
    pub fn force(&self, given: &Given) -> i32 {
        let (shared, way) = (&self.shared, self.way(given.direction));
        let speed = N::input(given.speed, 7);
        let gap = N::input(given.wanted, 0) * shared.inverse_radius;
        let distance = (gap * gap + gap + gap).sqrt();
        let quarter = (shared.free - distance) * shared.inverse_longest_4;
        let run = quarter + quarter + quarter + quarter;
        let run = run.at_least(shared.least).at_most(N::ONE);
        let t = run + run - N::ONE;
        let row = way.row(speed / (speed + way.half_speed));
        let elastic = run * run * quartic(&shared.force, t) * row.stiffness(t);
        let lifting = shared.load * quartic(&shared.slope, t);
        ((elastic * self.scale + lifting) * shared.unit_128_n).output(7)
    }

    #[inline(always)]
    fn way(&self, direction: u32) -> &Way<N> {
        if direction == 0 { &self.ways[0] } else { &self.ways[1] }
    }
}

/// The stiffening at one speed: polynomial in the run.
struct Row<N> {
    terms: [N; 7],
    fast: N,
    relaxed: N,
}

impl<N: Number> Row<N> {
    #[inline(always)]
    fn stiffness(&self, t: N) -> N {
        let [c0, c1, c2, c3, c4, c5, c6] = self.terms;
        self.relaxed + self.fast * (horner!(t; c0, c1, c2, c3, c4, c5, c6))
    }

    #[inline(always)]
    fn stiffness_with_slope(&self, t: N) -> (N, N) {
        let [c0, c1, c2, c3, c4, c5, c6] = self.terms;
        let (felt, slope) = horner_with_slope!(t; c0, c1, c2, c3, c4, c5, c6);
        (self.relaxed + self.fast * felt, self.fast * slope)
    }
}

impl<N: Number> Way<N> {
    #[inline(always)]
    fn row(&self, fast: N) -> Row<N> {
        #[rustfmt::skip]
        let [a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, c0, c1, c2, c3, d0, d1, d2, e0, e1, f0,
            g0] = self.felt;
        let u = fast + fast - N::ONE;
        Row {
            terms: [
                horner!(u; a0, a1, a2, a3, a4, a5),
                horner!(u; b0, b1, b2, b3, b4),
                horner!(u; c0, c1, c2, c3),
                horner!(u; d0, d1, d2),
                horner!(u; e0, e1),
                f0,
                g0,
            ],
            fast,
            relaxed: self.relaxed,
        }
    }

    #[inline(always)]
    fn guess(&self, fast: N, root: N) -> N {
        #[rustfmt::skip]
        let [a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, c0, c1, c2, c3, d0, d1, d2, e0, e1, f0] =
            self.guess;
        let (p, q) = (fast + fast - N::ONE, root + root - N::ONE);
        horner!(
            q;
            (horner!(p; a0, a1, a2, a3, a4, a5)),
            (horner!(p; b0, b1, b2, b3, b4)),
            (horner!(p; c0, c1, c2, c3)),
            (horner!(p; d0, d1, d2)),
            (horner!(p; e0, e1)),
            f0
        )
    }
}

impl<N: Number> Shared<N> {
    /// One step of Halley's method towards the run whose force is `sought`:
    /// `dr = r d / (r F' + 0.35 d)`.
    #[inline(always)]
    fn refine(&self, guess: N, sought: N, load: N, row: &Row<N>) -> N {
        let [a0, a1, a2, a3, a4] = self.force;
        let [s0, s1, s2, s3, s4] = self.slope;
        let t = guess + guess - N::ONE;
        let square = guess * guess;
        let (force, force_slope) = horner_with_slope!(t; a0, a1, a2, a3, a4);
        let (slope, slope_slope) = horner_with_slope!(t; s0, s1, s2, s3, s4);
        let (stiffness, stiffness_slope) = row.stiffness_with_slope(t);
        let elastic = square * force * stiffness;
        let lacking = sought - elastic - load * slope;
        // Slopes are by t, which grows twice as fast as the run.
        let bend = force_slope * stiffness + force * stiffness_slope;
        let cubic = square * guess * bend + load * guess * slope_slope;
        let rise = elastic + elastic + cubic + cubic + N::CURVATURE * lacking;
        // By half the run at most.
        let half = rise * N::HALF;
        let lacking = lacking.at_most(half).at_least(N::ZERO - half);
        (guess + guess * (lacking / rise.at_least(self.least * self.least * self.least)))
            .at_least(self.least)
            .at_most(N::ONE)
    }

    #[inline(always)]
    fn gap_after(&self, run: N, t: N) -> i32 {
        let distance = self.free - self.longest * run;
        (distance * distance * quartic(&self.gap, t) * self.half_radius_16).output(4)
    }
}

#[inline(always)]
fn quartic<N: Number>(coefficients: &[N; 5], t: N) -> N {
    let [c0, c1, c2, c3, c4] = *coefficients;
    horner!(t; c0, c1, c2, c3, c4)
}

/// The next so many coefficients.
fn list<N: Number, const C: usize>(next: &mut impl FnMut() -> Option<N>) -> Option<[N; C]> {
    let mut all = [N::ZERO; C];
    for slot in &mut all {
        *slot = next()?;
    }
    Some(all)
}
