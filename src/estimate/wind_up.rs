//! The tread gives way along the wall: under traction it winds up against the hub, and rolling it
//! creeps. That is travel of the wheel that moves no axle.
//!
//! Traction F displaces the rim against the hub by w: `F = k (w + (s - 1) (w - q))`, the
//! three-parameter solid of the tread with the memory q. Rolling brings unstrained rubber into the
//! contact: the memory is lost over half its length. Creep is Carter's (1926),
//! `2 / (1 + sqrt(1 - p))` times the one of little traction, with the part p of friction used.

#![deny(clippy::float_arithmetic)]

use super::odometry::Odometry;
use crate::numeric::{checked, divide, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, TICK_HZ, Travel, q16};

/// Ticks of a step in time.
const PERIOD: u8 = 8;
/// Logarithm of the ticks over which what gives way is spread: a corner that is felt late would jolt
/// the drive.
const SMOOTH: u32 = 4;
const SMOOTHER: u32 = 6;
/// Part of friction beyond which the wheel is about to slip.
const MOST: Ratio = q16(990_000);
/// Length of a contact over the chord of the wall through the undeformed wheel: 1 of a row of elements,
/// 0.6 of a bonded layer.
const CONTACT: Ratio = q16(800_000);
/// Least compression of a tread that carries, mm.
const LEAST: Millimetres = q16(50_000);

/// Rubber between rim and hub.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Shear {
    /// Displacement of the relaxed tread per traction, mm/N.
    compliance: Q16,
    /// Instant over relaxed stiffness, less 1.
    stiffens: Ratio,
    /// Part of the relaxation time that a period takes.
    relaxes: Ratio,
    /// Relaxation length over the length of the contact.
    relaxation_lengths: Ratio,
    friction: Ratio,
    radius: Millimetres,
}

/// What presses and pulls a wheel, and where.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulled {
    /// Radial force, and axial load inwards, N.
    pub(super) pressed: Newtons,
    /// See `pressed`.
    pub(super) load: Newtons,
    /// Compression, mm.
    pub(super) depth: Millimetres,
    /// Axial distance from the centre to an edge that carries; 0 on a wall.
    pub(super) ahead: Millimetres,
    /// Compression by the wall below the edge, mm.
    pub(super) floor: Millimetres,
    /// On a wall, far from any edge.
    pub(super) level: bool,
}

/// Displacement of the tread, and what it has given way by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WindUp {
    displaced: Millimetres,
    memory: Millimetres,
    /// Travel of the tread that moved no axle, outwards.
    pub(super) gave: Travel,
    /// What a tick adds to it, smooth enough for the drive.
    gives: Travel,
    /// The sum of that.
    held: Travel,
    /// What is not in it yet.
    owes: Travel,
    /// Travel of the tread in this period.
    from: Travel,
    ticks: u8,
    known: bool,
    /// Radial force on a wall per compression to 3/2.
    carries: Q16,
    /// What the tread remembers of its compression by the lower wall, mm.
    floor: Millimetres,
}

impl Shear {
    /// The tread of a rig; fails where a parameter is out of range.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub(super) fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let shear = rig.shear();
        let key = "tread.thickness_mm";
        Ok(Self {
            compliance: checked(key, 1.0 / shear.n_per_mm)?,
            stiffens: checked("tread.stiffening", rig.tread.stiffening - 1.0)?,
            relaxes: checked("tread.tau_s", 1e-3 * f64::from(PERIOD) / rig.tread.tau_s)?,
            relaxation_lengths: checked(key, shear.relaxation_lengths)?,
            friction: checked("plant.mu", rig.plant.mu)?,
            radius: checked("rig.wheel_radius_mm", rig.rig.wheel_radius_mm)?,
        })
    }

    /// Compression by a wall at which the tread's memory q lets go of it, mm: `q (s - 1) / s`.
    pub(super) fn short(&self, state: &WindUp) -> Millimetres {
        state.floor * divide(self.stiffens, Ratio::ONE + self.stiffens)
    }

    /// A run begins, on a wall: the tread has relaxed under its load.
    pub(super) fn rest(&self, state: &mut WindUp, load: Newtons) {
        let relaxed = load * self.compliance;
        if core::mem::replace(&mut state.known, true) {
            state.gave += (relaxed - state.displaced).widen();
        }
        (state.displaced, state.memory) = (relaxed, relaxed);
    }

    /// A tick at this travel of the tread, less what it gave way by.
    pub(super) fn step(
        &self,
        state: &mut WindUp,
        odometry: &mut Odometry,
        travel: Travel,
        pulled: &Pulled,
    ) {
        let travel = travel.saturating_add(state.gave);
        let gives = state.owes >> SMOOTH;
        state.owes -= gives;
        state.gave = state.gave.saturating_add(gives);
        state.gives += (gives - state.gives) >> SMOOTHER;
        state.held = state.held.saturating_add(state.gives);
        state.ticks += 1;
        if state.ticks < PERIOD {
            return;
        }
        state.ticks = 0;
        let from = core::mem::replace(&mut state.from, travel);
        let rolled = Q16::narrow(travel.saturating_sub(from)).abs();
        let sinks = pulled.floor - state.floor;
        let presses = (pulled.floor + sinks * self.stiffens).max(Q16::ZERO);
        let to_load = sqrt(presses) * presses;
        if pulled.level {
            state.carries = divide(pulled.pressed, to_load.max(LEAST * LEAST));
        }
        let floor =
            divide(to_load * state.carries, pulled.pressed.max(Newtons::ONE)).min(Ratio::ONE);
        let (traction, part) = self.traction(pulled, floor);
        let rolls = divide(rolled, self.contact(pulled, floor));
        let renewed = rolls + rolls;
        let all = Ratio::ONE + self.relaxes + renewed;
        let (follows, kept) = (divide(self.relaxes, all), divide(state.memory, all));
        state.floor = follows * pulled.floor + divide(state.floor, all);
        let pulls = traction * self.compliance;
        let stiffer = Ratio::ONE + self.stiffens * (Ratio::ONE - follows);
        let displaced = divide(pulls + self.stiffens * kept, stiffer);
        let rolling = Ratio::ONE + self.stiffens * divide(renewed, renewed + self.relaxes);
        let carter = Ratio::ONE + sqrt(Ratio::ONE - part);
        let creeps = divide(pulls * (rolls + rolls), self.relaxation_lengths * rolling * carter);
        let gives = odometry.give([creeps, displaced - state.displaced]);
        state.owes += gives.widen();
        state.displaced = displaced;
        state.memory = follows * displaced + kept;
    }

    /// Traction outwards, N, and the part of friction that it takes: on an edge, at the angle t
    /// from below the centre, `L cos t + P sin t` under `P cos t - L sin t`.
    fn traction(&self, pulled: &Pulled, floor: Ratio) -> (Newtons, Ratio) {
        let Pulled { pressed, load, .. } = *pulled;
        let reach = self.radius - pulled.depth;
        let sine = divide(pulled.ahead, reach).min(Ratio::ONE);
        let cosine = sqrt(Ratio::ONE - sine * sine);
        let corner = load * cosine + pressed * sine;
        let traction = corner + floor * (load - corner);
        let corner = pressed * cosine - load * sine;
        let normal = corner + floor * (pressed - corner);
        let part = divide(traction, self.friction * normal.max(Newtons::ONE));
        (traction, part.min(MOST).max(Q16::ZERO))
    }

    /// Length of the contact, mm: from the edge on, or on both sides of the centre.
    fn contact(&self, pulled: &Pulled, floor: Ratio) -> Millimetres {
        let ahead = pulled.ahead;
        let depth = pulled.depth.max(LEAST);
        let chord = sqrt(depth * (self.radius + self.radius - depth) + ahead * ahead) - ahead;
        let wall = sqrt(pulled.floor * (self.radius + self.radius));
        let all = if ahead > Q16::ZERO { chord + wall + wall * floor } else { chord + chord };
        all * CONTACT
    }
}

impl WindUp {
    /// The wheel stands at this travel, less what the tread gave way by.
    pub(super) fn stand(&mut self, travel: Travel) {
        (self.gives, self.ticks) = (Travel::ZERO, 0);
        self.from = travel.saturating_add(self.gave);
    }

    /// By how much more it has given way than the drive makes up for, mm.
    pub(super) fn lags(&self) -> Travel {
        self.gave.saturating_sub(self.held)
    }

    /// Speed of the tread that moves no axle, outwards, mm/s.
    pub(super) fn speed(&self) -> MillimetresPerSecond {
        Q16::narrow(self.gives * i64::from(TICK_HZ))
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PRESSED_N: f64 = 33.3;
    const DEPTH_MM: f64 = 0.5;

    /// A tread, and how far it has turned, mm.
    #[derive(Default)]
    struct Bench(WindUp, Odometry, f64);

    impl Bench {
        /// A tick at this speed, mm/s, under this load, N, on an edge this far ahead, mm; 0: on a wall.
        fn tick(&mut self, speed: f64, load: f64, ahead: f64) {
            let Self(state, odometry, turned) = self;
            *turned += 1e-3 * speed;
            let level = ahead == 0.0;
            let pulled = Pulled {
                pressed: Q16::from_num(PRESSED_N),
                load: Q16::from_num(load),
                depth: Q16::from_num(DEPTH_MM),
                ahead: Q16::from_num(ahead),
                floor: if level { Q16::from_num(DEPTH_MM) } else { Q16::ZERO },
                level,
            };
            let travel = Travel::from_num(*turned).saturating_sub(state.gave);
            Shear::try_build(&Rig::prototype()).unwrap().step(state, odometry, travel, &pulled);
        }

        /// All that it has given way by, with what is not in `gave` yet, mm.
        fn gave(&self) -> f64 {
            (self.0.gave + self.0.owes).to_num()
        }
    }

    proptest! {
        /// Backward Euler of 8 ms errs by 1.1 % of a jump of the load, relaxed within 0.14 s or more.
        #[test]
        fn on_a_wall_it_gives_way_as_the_solid_with_carters_creep(
            history in proptest::collection::vec((-20.0..20.0f64, 0.0..20.0f64, 1..30i32), 1..12),
        ) {
            let mut bench = Bench::default();
            let (rig, shear) = (Rig::prototype(), Rig::prototype().shear());
            let (k, stiffens, tau_s) = (shear.n_per_mm, rig.tread.stiffening - 1.0, rig.tread.tau_s);
            let contact = 1.6 * (DEPTH_MM * (2.0 * rig.rig.wheel_radius_mm - DEPTH_MM)).sqrt();
            let (mut w, mut q, mut gave, dt_s) = (0.0, 0.0, 0.0, 1e-4);
            for (speed, load, periods) in history {
                let renewed = 2.0 * speed.abs() / contact;
                let rolling = 1.0 + stiffens * renewed * tau_s / (1.0 + renewed * tau_s);
                let carter = 2.0 / (1.0 + (1.0 - load / (rig.plant.mu * PRESSED_N)).sqrt());
                let stiffness = k * shear.relaxation_lengths * contact * rolling;
                let creeps = speed.abs() * load / stiffness * carter;
                for step in 0..80 * periods {
                    q += dt_s * ((w - q) / tau_s - renewed * q);
                    let from = std::mem::replace(&mut w, (load / k + stiffens * q) / (1.0 + stiffens));
                    gave += dt_s * creeps + w - from;
                    if step % 10 == 0 {
                        bench.tick(speed, load, 0.0);
                    }
                }
                let off = [bench.0.displaced.to_num::<f64>() - w, bench.gave() - gave];
                prop_assert!(off.iter().all(|off| off.abs() < 0.02 * 20.0 / k), "{off:?}");
            }
        }

        #[test]
        fn at_rest_it_relaxes_to_traction_over_stiffness(
            load in 0.0..20.0f64, ahead in prop_oneof![Just(0.0), 0.1..12.0f64],
        ) {
            let mut bench = Bench::default();
            (0..5000).for_each(|_| bench.tick(0.0, load, ahead));
            let rig = Rig::prototype();
            let angle = (ahead / (rig.rig.wheel_radius_mm - DEPTH_MM)).asin();
            let traction = load * angle.cos() + PRESSED_N * angle.sin();
            let (gave, relaxed) = (bench.gave(), traction / rig.shear().n_per_mm);
            prop_assert!((gave - relaxed).abs() < 0.005, "{gave} {relaxed}");
            prop_assert!(bench.0.lags().to_num::<f64>().abs() < 1e-3);
        }
    }

    #[test]
    fn nothing_gives_way_without_traction() {
        let mut bench = Bench::default();
        (0..2000).for_each(|tick| bench.tick(if tick < 1000 { 30.0 } else { -8.0 }, 0.0, 0.0));
        assert_eq!((bench.gave(), bench.0.lags()), (0.0, Travel::ZERO));
    }
}
