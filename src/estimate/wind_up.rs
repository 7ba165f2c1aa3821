//! What a tread is pulled by, as the sensors have it, and the travel that it takes: the rim gives
//! way against the hub ([`model::wind_up`](crate::model::wind_up)).

use super::odometry::Odometry;
use crate::model::wind_up::{CONTACT, Pull, Shear, Spread, Winding};
use crate::numeric::{between, checked, divide, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{
    Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, TICK_HZ, Travel, q16, ticks_to_seconds,
};

/// Ticks of a step in time.
const PERIOD: u8 = 8;
/// Least compression of a tread that carries, mm.
const LEAST: Millimetres = q16(50_000);

/// A tread, and the wheel that it is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Pulls {
    shear: Shear,
    radius: Millimetres,
}

/// What presses and pulls a wheel, and where.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulled {
    /// Radial force, and axial load inwards, N.
    pub(super) pressed: Newtons,
    pub(super) load: Newtons,
    /// Compression, mm.
    pub(super) depth: Millimetres,
    /// Axial distance outwards from the centre to the edge of the wall that carries, mm.
    pub(super) ahead: Millimetres,
    /// Compression by the wall below the edge, or by the one that it rolls on, mm.
    pub(super) floor: Millimetres,
    /// Whether that wall bears a part of the load.
    pub(super) below: bool,
    /// Part of its load that an edge has lost at least.
    pub(super) lost: Ratio,
    /// On a wall, far from any edge.
    pub(super) level: bool,
}

/// Displacement of the tread, and what it has given way by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WindUp {
    winding: Winding,
    spread: Spread,
    /// Travel of the tread in this period.
    from: Travel,
    ticks: u8,
    known: bool,
    /// Radial force on a wall per compression to 3/2.
    carries: Q16,
}

impl Pulls {
    /// The tread of a rig; fails where a parameter is out of range.
    pub(super) fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let radius = checked("rig.wheel_radius_mm", rig.rig.wheel_radius_mm)?;
        Ok(Self { shear: Shear::try_build(rig)?, radius })
    }

    /// Compression by a wall at which the tread's memory lets go of it, mm.
    pub(super) fn short(&self, state: &WindUp) -> Millimetres {
        state.winding.floor * self.shear.short()
    }

    /// The first run begins at this travel: the tread has relaxed under its load, N; 1 mm of it
    /// `carries` so much, N.
    pub(super) fn begin(
        &self,
        state: &mut WindUp,
        travel: Travel,
        load: Newtons,
        carries: Newtons,
    ) {
        if !core::mem::replace(&mut state.known, true) {
            (state.winding, state.from) = (self.shear.rest(load), travel);
            state.carries = carries;
        }
    }

    /// A tick at this travel of the tread, less what it gave way by.
    pub(super) fn step(
        &self,
        state: &mut WindUp,
        odometry: &mut Odometry,
        travel: Travel,
        pulled: &Pulled,
    ) {
        let travel = travel.saturating_add(state.spread.gave);
        state.spread.step();
        state.ticks += 1;
        if state.ticks < PERIOD {
            return;
        }
        state.ticks = 0;
        let from = core::mem::replace(&mut state.from, travel);
        let sinks = pulled.floor - state.winding.sunk;
        let presses = (pulled.floor + sinks * self.shear.stiffens).max(Q16::ZERO);
        let to_load = sqrt(pulled.floor) * presses;
        if pulled.level {
            state.carries = divide(pulled.pressed, to_load.max(LEAST * LEAST));
        }
        let table = divide(to_load * state.carries, pulled.pressed.max(Newtons::ONE));
        let share = table.min(Ratio::ONE).max(pulled.lost);
        let below = if pulled.below { share } else { Ratio::ZERO };
        let rolled = Q16::narrow(travel.saturating_sub(from));
        let patch = sqrt(pulled.floor * (self.radius + self.radius));
        let duration = ticks_to_seconds(PERIOD.into());
        let edge = self.edge(pulled);
        let drag = |half: Millimetres| self.shear.drag(rolled, half, duration);
        let lever = lever(edge, drag(edge[0]), rolled > Q16::ZERO);
        let on_edge = self.traction(pulled, lever);
        let on_wall = self.traction(pulled, drag(patch));
        let both = |i: usize| on_edge[i] + below * (on_wall[i] - on_edge[i]);
        let pull = Pull {
            traction: both(0),
            normal: both(1),
            contact: self.contact(pulled, edge, (below, presses), rolled > Q16::ZERO),
            rolled: rolled.abs(),
            floor: pulled.floor,
            patch,
            duration,
        };
        self.shear.sink(&mut state.winding, &pull);
        state.spread.owes += odometry.give(self.shear.roll(&mut state.winding, &pull)).widen();
    }

    /// Traction outwards and normal force, N, where the resultant is so far ahead of the centre, at the
    /// angle t: `L cos t + P sin t` and `P cos t - L sin t`.
    fn traction(&self, pulled: &Pulled, lever: Millimetres) -> [Newtons; 2] {
        let Pulled { pressed, load, .. } = *pulled;
        let sine = between(divide(lever, self.radius), -Ratio::ONE, Ratio::ONE);
        let cosine = sqrt(Ratio::ONE - sine * sine);
        [load * cosine + pressed * sine, pressed * cosine - load * sine]
    }

    /// Half of the contact on a wall without end, and where the wall that carries ends in it, mm outwards.
    fn edge(&self, pulled: &Pulled) -> [Millimetres; 2] {
        let depth = pulled.depth.max(LEAST);
        let over = pulled.ahead.max(Q16::ZERO);
        let half = sqrt(depth * (self.radius + self.radius - depth) + over * over);
        [half, between(pulled.ahead, -half, half)]
    }

    /// Length of the contact, mm: with the wall above an edge, and with the wall below, which bears this part
    /// of the load. On a wall its trailing end lets go early; at an edge that the tread leaves it is cut off.
    /// The lower wall `presses` that end as by so much compression, the leading one by all of the floor's.
    /// Inwards it lies between that of independent elements, which touch the face, too, and of a bonded layer.
    fn contact(
        &self,
        pulled: &Pulled,
        [half, ahead]: [Millimetres; 2],
        (below, presses): (Ratio, Millimetres),
        outwards: bool,
    ) -> Millimetres {
        let to = |depth: Millimetres| sqrt(depth * (self.radius + self.radius));
        let bears = |part: Millimetres| if pulled.below { part } else { Q16::ZERO };
        if outwards {
            let trails = to(presses.min(pulled.floor)) * (CONTACT + CONTACT - Ratio::ONE);
            return (half - ahead).min((half + half) * CONTACT) + bears(to(pulled.floor) + trails);
        }
        // What an edge has lost is on a wall, wherever its table has that.
        let met = if pulled.lost > Q16::ZERO { pulled.depth * below } else { Q16::ZERO };
        (half - ahead + bears(to(pulled.floor.max(met)))) * CONTACT
    }
}

/// How far ahead of the centre the resultant is, mm: that of a parabola from the edge at A to the contact's
/// end at b, `3 (b + A)^2 / 4 (2 b + A)`, and a part of the rolling resistance. That part is fitted to the
/// virtual rig's traction, within 2 N of 35 at an edge. It has no derivation: a steady profile that is cut
/// off leaves less outwards and more inwards; but this wheel rises or sinks.
fn lever([half, ahead]: [Millimetres; 2], drag: Millimetres, outwards: bool) -> Millimetres {
    let reach = half + ahead;
    let elastic = divide(reach * reach, half + reach).half() * q16(1_500_000);
    let part = divide(half - ahead, half).half();
    elastic + drag * if outwards { part } else { part * part }
}

impl WindUp {
    /// Whether the drive makes up for what the tread gives way by.
    pub(super) fn follow(&mut self, follows: bool) {
        self.spread.stops = !follows;
    }

    /// Whether a run has shown what the tread carries.
    pub(super) const fn is_known(&self) -> bool {
        self.known
    }

    /// Displacement of the rim against the hub, mm.
    pub(super) const fn displaced(&self) -> Millimetres {
        self.winding.displaced
    }

    /// Travel of the tread that moved no axle, outwards.
    pub(super) const fn gave(&self) -> Travel {
        self.spread.gave
    }

    /// By how much more it has given way than the drive makes up for, mm.
    pub(super) fn lags(&self) -> Travel {
        self.spread.lags()
    }

    /// Speed of the tread that moves no axle, outwards, mm/s.
    pub(super) fn speed(&self) -> MillimetresPerSecond {
        Q16::narrow(self.spread.gives * i64::from(TICK_HZ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PRESSED_N: f64 = 33.3;
    const DEPTH_MM: f64 = 0.5;

    /// Half of the contact with a wall, mm.
    fn half() -> f64 {
        (DEPTH_MM * (2.0 * Rig::prototype().rig.wheel_radius_mm - DEPTH_MM)).sqrt()
    }

    /// A tread, and how far it has turned, mm.
    #[derive(Default)]
    struct Bench(WindUp, Odometry, f64);

    impl Bench {
        /// A tick at this speed, mm/s, under this load, N, on an edge this far ahead, mm; none: on a wall.
        fn tick(&mut self, speed: f64, load: f64, ahead: Option<f64>) {
            let Self(state, odometry, turned) = self;
            *turned += 1e-3 * speed;
            let level = ahead.is_none();
            let pulled = Pulled {
                pressed: Q16::from_num(PRESSED_N),
                load: Q16::from_num(load),
                depth: Q16::from_num(DEPTH_MM),
                ahead: ahead.map_or(Q16::MIN, Q16::from_num),
                floor: if level { Q16::from_num(DEPTH_MM) } else { Q16::ZERO },
                below: false,
                lost: Q16::ZERO,
                level,
            };
            let travel = Travel::from_num(*turned).saturating_sub(state.gave());
            Pulls::try_build(&Rig::prototype()).unwrap().step(state, odometry, travel, &pulled);
        }

        /// All that it has given way by, with what is not in `gave` yet, mm.
        fn gave(&self) -> f64 {
            (self.0.spread.gave + self.0.spread.owes).to_num()
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
            let contact = 1.6 * half();
            let (mut w, mut q, mut gave, dt_s) = (0.0, 0.0, 0.0, 1e-4);
            for (speed, axial, periods) in history {
                let renewed = 2.0 * speed.abs() / contact;
                let rolling = 1.0 + stiffens * renewed * tau_s / (1.0 + renewed * tau_s);
                let passes = speed.abs() * tau_s / half();
                let drag = stiffens * passes
                    / (1.0 + passes * (2.0 + stiffens + 2.5 * (1.0 + stiffens) * passes));
                let sine = drag.copysign(speed) * half() / rig.rig.wheel_radius_mm;
                let load = axial * (1.0 - sine * sine).sqrt() + PRESSED_N * sine;
                let carter = 2.0 / (1.0 + (1.0 - load / (rig.plant.mu * PRESSED_N)).sqrt());
                let stiffness = k * shear.relaxation_lengths * contact * rolling;
                let creeps = speed.abs() * load / stiffness * carter;
                for step in 0..80 * periods {
                    q += dt_s * ((w - q) / tau_s - renewed * q);
                    let from = std::mem::replace(&mut w, (load / k + stiffens * q) / (1.0 + stiffens));
                    gave += dt_s * creeps + w - from;
                    if step % 10 == 0 {
                        bench.tick(speed, axial, None);
                    }
                }
                let off = [bench.0.winding.displaced.to_num::<f64>() - w, bench.gave() - gave];
                prop_assert!(off.iter().all(|off| off.abs() < 0.02 * 20.0 / k), "{off:?}");
            }
        }

        #[test]
        fn at_rest_it_relaxes_to_traction_over_stiffness(
            load in 0.0..20.0f64, ahead in proptest::option::of(-5.0..12.0f64),
        ) {
            let mut bench = Bench::default();
            (0..5000).for_each(|_| bench.tick(0.0, load, ahead));
            let rig = Rig::prototype();
            let half = half().hypot(ahead.unwrap_or(0.0).max(0.0));
            let ahead = ahead.map_or(-half, |ahead| ahead.max(-half));
            // Centre of the pressure of independent elements, from the edge on.
            let part = |n: i32| {
                let x = ahead + (half - ahead) * (f64::from(n) + 0.5) / 1000.0;
                (half * half - x * x, x)
            };
            let whole: f64 = (0..1000).map(|n| part(n).0).sum();
            let moment: f64 = (0..1000).map(|n| part(n).0 * part(n).1).sum();
            let angle = (moment / whole / rig.rig.wheel_radius_mm).asin();
            let traction = load * angle.cos() + PRESSED_N * angle.sin();
            let (gave, relaxed) = (bench.gave(), traction / rig.shear().n_per_mm);
            prop_assert!((gave - relaxed).abs() < 0.005, "{gave} {relaxed}");
            prop_assert!(bench.0.lags().to_num::<f64>().abs() < 1e-3);
        }
    }

    #[test]
    fn an_edge_takes_the_resistance_off_later_outwards_than_inwards() {
        let [half, drag] = [q16(8_000_000), q16(2_000_000)];
        let resists = |ahead: i64, outwards: bool| {
            let edge = [half, q16(ahead)];
            (lever(edge, drag, outwards) - lever(edge, Q16::ZERO, outwards)).to_num::<f64>()
        };
        for (ahead, parts) in [(-8, [1.0, 1.0]), (0, [0.5, 0.25]), (8, [0.0, 0.0])] {
            let got = [true, false].map(|outwards| resists(ahead * 1_000_000, outwards) / 2.0);
            assert!(got.iter().zip(parts).all(|(a, b)| (a - b).abs() < 1e-3), "{ahead}: {got:?}");
        }
    }

    #[test]
    fn nothing_gives_way_without_traction() {
        let mut bench = Bench::default();
        (0..2000).for_each(|_| bench.tick(0.0, 0.0, None));
        assert_eq!((bench.gave(), bench.0.lags()), (0.0, Travel::ZERO));
    }
}
