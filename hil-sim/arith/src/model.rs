//! The polynomials of the shipping model, solved as it does by one step from a guess in
//! cells, once for all arithmetics.
//!
//! Lengths over R and forces over a unit, a power of two; the run over the corner as part
//! of the longest. Polynomials in parts of a whole are in `2 part - 1`, from -1 to 1.

use crate::number::{HalfOctave, Number};

/// Coefficients of one way: see [`Way`].
pub const WAY: usize = 2 + FELT + FAST_CELLS * FORCE_CELLS * CELL;

/// Terms of the felt stiffening.
pub const FELT: usize = 22;

/// Equal parts of the range of the fast part, and half octaves of the force from
/// 2^-7 to 2^-2, with a guess of the run each, and terms of that.
pub const FAST_CELLS: usize = 4;
/// See [`FAST_CELLS`].
pub const FORCE_CELLS: usize = 10;
/// See [`FAST_CELLS`].
pub const CELL: usize = 10;

/// Coefficients of both ways and of what they share.
pub const COEFFICIENTS: usize = 32 + 2 * WAY;

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
    /// 256 N over the unit of force.
    pub parts_per_256_n: N,
    /// Unit of force over 256 N.
    pub unit_256_n: N,
    /// Free run over R, shortest over longest.
    pub free: N,
    /// See `free`.
    pub least: N,
    /// 1 over the longest run over R, over 4.
    pub inverse_longest_4: N,
    /// 1/R, 1/mm.
    pub inverse_radius: N,
    /// Load, and what its largest slope takes off every force, over the unit.
    pub load: N,
    /// See `load`.
    pub most_lifting: N,
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
    pub cosine: [N; 4],
    /// Gap over 16 mm.
    pub gap: [N; 6],
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
    /// Run by cells of the fast part and of the force: `u^i m^j`, by the mantissa m and then
    /// the part u, 4, 3 and 3 terms.
    pub guess: [[[N; CELL]; FORCE_CELLS]; FAST_CELLS],
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
            self.parts_per_256_n,
            self.unit_256_n,
            self.free,
            self.least,
            self.inverse_longest_4,
            self.inverse_radius,
            self.load,
            self.most_lifting,
            self.stress,
            self.ramp,
            self.deflection,
            self.friction,
        ];
        single.into_iter().chain(self.force).chain(self.slope).chain(self.cosine).chain(self.gap)
    }
}

impl Way {
    fn list(&self) -> impl Iterator<Item = f64> {
        let guess = self.guess.into_iter().flatten().flatten();
        [self.half_speed, self.relaxed].into_iter().chain(self.felt).chain(guess)
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
            parts_per_256_n: next()?,
            unit_256_n: next()?,
            free: next()?,
            least: next()?,
            inverse_longest_4: next()?,
            inverse_radius: next()?,
            load: next()?,
            most_lifting: next()?,
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
                guess: cells(&mut next)?,
            })
        };
        Some(Self { shared, ways: [way()?, way()?], scale: N::ONE, inverse_scale: N::ONE })
    }

    /// Everything about the crossing at this radial force.
    #[inline(always)]
    pub fn crossing(&self, given: &Given) -> Answer {
        let (shared, way) = (&self.shared, self.way(given.direction));
        let speed = N::input(given.speed, 7);
        let wanted = N::input(given.wanted, 8) * shared.parts_per_256_n;
        let fast = speed / (speed + way.half_speed);
        let load = shared.load * self.inverse_scale;
        let sought = wanted * self.inverse_scale;
        let excess = (sought - shared.most_lifting).half_octave();
        let guess = way.guess(fast, &excess);
        let (run, slope) = shared.refine(&guess, sought, load, way, fast, &excess);
        let t = run + run - N::ONE;
        let reaction = (wanted - shared.load * slope).at_least(N::ZERO);
        let [c0, c1, c2, c3] = shared.cosine;
        let radial = reaction * (horner!(t; c0, c1, c2, c3));
        let used = shared.load / radial.at_least(shared.load * N::HALF) + slope;
        let [g0, g1, g2, g3, g4, g5] = shared.gap;
        let ramp = (speed * shared.ramp / run).at_most(N::ONE);
        Answer {
            gap: (horner!(t; g0, g1, g2, g3, g4, g5)).output(4),
            corner_force: (radial * slope * shared.unit_256_n).output(8),
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
        let fast = speed / (speed + way.half_speed);
        let elastic = run * run * quartic(&shared.force, t) * way.stiffness(fast, t);
        let lifting = shared.load * quartic(&shared.slope, t);
        ((elastic * self.scale + lifting) * shared.unit_256_n).output(8)
    }

    #[inline(always)]
    fn way(&self, direction: u32) -> &Way<N> {
        // One address: a choice of two references would be made anew for each coefficient.
        &self.ways[(direction & 1) as usize]
    }
}

/// A guess of the run, and its derivative by the mantissa of the force.
struct Guess<N> {
    run: N,
    by_force: N,
}

impl<N: Number> Way<N> {
    /// Effective over instant stiffness.
    #[inline(always)]
    fn stiffness(&self, fast: N, t: N) -> N {
        #[rustfmt::skip]
        let [a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, c0, c1, c2, c3, d0, d1, d2, e0, e1, f0,
            g0] = self.felt;
        let u = fast + fast - N::ONE;
        let felt = horner!(
            t;
            (horner!(u; a0, a1, a2, a3, a4, a5)),
            (horner!(u; b0, b1, b2, b3, b4)),
            (horner!(u; c0, c1, c2, c3)),
            (horner!(u; d0, d1, d2)),
            (horner!(u; e0, e1)),
            f0,
            g0
        );
        self.relaxed + fast * felt
    }

    #[inline(always)]
    fn guess(&self, fast: N, excess: &HalfOctave<N>) -> Guess<N> {
        let (column, u) = fast.quarter();
        let cells = &self.guess[column.min(FAST_CELLS - 1)];
        let [a0, a1, a2, a3, b0, b1, b2, c0, c1, c2] = cells[excess.row.min(FORCE_CELLS - 1)];
        let m = excess.mantissa;
        let bend = m * (horner!(u; c0, c1, c2));
        let rise = (horner!(u; b0, b1, b2)) + bend;
        Guess { run: (horner!(u; a0, a1, a2, a3)) + m * rise, by_force: rise + bend }
    }
}

impl<N: Number> Shared<N> {
    /// One step towards the run whose force is `sought`, by the guess's own derivative;
    /// also the slope of the contact there.
    #[inline(always)]
    fn refine(
        &self,
        guess: &Guess<N>,
        sought: N,
        load: N,
        way: &Way<N>,
        fast: N,
        excess: &HalfOctave<N>,
    ) -> (N, N) {
        let run = guess.run.at_least(self.least).at_most(N::ONE);
        let t = run + run - N::ONE;
        let [s0, s1, s2, s3, s4] = self.slope;
        let (slope, tilt) = horner_with_slope!(t; s0, s1, s2, s3, s4);
        let elastic = run * run * quartic(&self.force, t) * way.stiffness(fast, t);
        let lacking = (sought - elastic - load * slope).by_places(excess.places);
        let better = (run + guess.by_force * lacking).at_least(self.least).at_most(N::ONE);
        let step = better - run;
        (better, slope + tilt * (step + step))
    }
}

#[inline(always)]
fn quartic<N: Number>(coefficients: &[N; 5], t: N) -> N {
    let [c0, c1, c2, c3, c4] = *coefficients;
    horner!(t; c0, c1, c2, c3, c4)
}

/// The next cells.
fn cells<N: Number, const R: usize, const Q: usize>(
    next: &mut impl FnMut() -> Option<N>,
) -> Option<[[[N; CELL]; R]; Q]> {
    let mut all = [[[N::ZERO; CELL]; R]; Q];
    for cell in all.iter_mut().flatten() {
        *cell = list(next)?;
    }
    Some(all)
}

/// The next so many coefficients.
fn list<N: Number, const C: usize>(next: &mut impl FnMut() -> Option<N>) -> Option<[N; C]> {
    let mut all = [N::ZERO; C];
    for slot in &mut all {
        *slot = next()?;
    }
    Some(all)
}
