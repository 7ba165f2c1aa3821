//! The tread before the first step: what load its compression means, by rubber as known.
//!
//! Elements of the tread cross the patch with the rolling wheel. At a distance x from the
//! nearest point of the wall one is pressed by `d = c - x^2 / 2R` and carries
//! `k_inf (d + (s - 1)(d - q))`, where its memory q follows d with the relaxation time. The sum
//! over the patch is the load that the compression c means. At rest it checks preload and
//! compression sensor against each other. Elements that push each other, as in a thick bonded
//! tread, carry a load that grows less with the compression, and lift off from a wider gap. Such
//! a tread is stiffer than known at rest under a low preload, and softer while it rolls under a
//! higher one. The ratio of both does not depend on the sensors' gains.

#![deny(clippy::float_arithmetic)]

use crate::model::corner_profile::CornerProfile;
use crate::numeric::{LowPass, LowPassState, checked, divide, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Travel, q16,
    ticks_to_seconds,
};

/// Part of the load that the compression may show too much or too little. Rubber that is off
/// by three deviations of 4 % makes 0.13, gains of both sensors 0.03, the noise of what they
/// zeroed 0.01; the worst of the random rigs is 0.17.
const BAND: Ratio = q16(220_000);
/// Least preload at which it is compared, part of the cruise preload: the wheel rolls from about
/// 0.4 of it on.
const LEAST_PART: f64 = 0.3;
/// Ticks after which what the tread remembers from before is forgotten far enough.
const FORGETS: u16 = 300;
/// Ticks that it must be off.
const OFF_TICKS: u16 = 50;

/// Ratio of both loads at rest over rolling up to which the tread is as known: three deviations
/// of random rigs, 0.99 +- 0.012; and by how much a crossing is stiffer per ratio beyond that. Fitted
/// to 160 rigs drawn from the wide ranges: the stiffness that the first crossing shows grows with
/// the power 2.6 of the ratio, +- 24 %; too stiff a guess only costs time.
const RATIO_WITHIN: Ratio = q16(1_030_000);
const PER_RATIO: Q16 = q16(4_000_000);
/// Load of the rolling tread over the known one below which it is softer than rubber and sensors
/// within their tolerances make it, and as how stiff it then counts at least: it has shown that
/// it is not as known, and the first crossing of such rigs opens the gap the widest.
const SOFT: Ratio = q16(900_000);
const SOFT_AS: Ratio = q16(1_160_000);
/// The same above which it is stiffer than known by as much; below, it may be the sensors.
const STIFF: Ratio = q16(1_030_000);

/// Load at rest of a tread as known over the load that its compression means, as a difference
/// from 1: three deviations of its stiffness, of 4 %.
const REST_WITHIN: Ratio = q16(120_000);

/// Elements, and their distance over the wheel's radius: 20 mm of the published wheel's tread.
const ELEMENTS: usize = 32;
const SPACING: f64 = 1.0 / 40.0;
/// Elements ahead of the wheel's centre when it begins to roll: as far as it is observed, and
/// half a patch.
const AHEAD: usize = 19;
/// Where the rolling tread is observed, over the wheel's radius.
const ROLLING: [f64; 2] = [0.03, 0.12];
/// Coulomb friction of the gearbox, and one sigma of the load that the drive shows, as parts of the
/// stall force: friction of the gearbox to a tenth, supply of the bridge to 0.6 %, rolling loss of
/// a tread as far from the known one as the random rigs'.
const GEARBOX: f64 = 0.02;
const LOAD_SIGMA: f64 = 0.005;

/// A sum counts 1/256 of its terms, so that a second of 1,000 N fits.
const LONGEST: u16 = 4096;

/// The tread as known.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Tread {
    /// Relaxed stiffness of an element, N/mm.
    rate: Q16,
    /// Load over the compression to the power 1.5, relaxed, N/mm^1.5.
    relaxed: Q16,
    /// `s - 1`.
    excess: Ratio,
    memory: LowPass,
    /// Distance of the elements, mm.
    spacing: Millimetres,
    /// `1 / 2R`, 1/mm.
    curvature: Q16,
    /// Travel between which the rolling tread is observed, mm.
    rolling: (Millimetres, Millimetres),
    /// Least preload at which it is compared, N.
    least: Newtons,
    /// Force of the drive at full duty, N, its friction, and one sigma of the load that it shows.
    stall: Newtons,
    gearbox: Newtons,
    load_sigma: Newtons,
    /// Duty per speed, s/mm.
    per_speed: Q16,
    /// Rotor, gears and carriage at the tread, N s^2/mm.
    inertia: Q16,
}

/// State of a [`Tread`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TreadState {
    /// Memory of each element, mm.
    q: [LowPassState; ELEMENTS],
    ticks: u16,
    off: u16,
    /// The preload rose from below the least one since the wheel came to rest.
    rises: bool,
    /// Where the wheel was at rest.
    from: Travel,
    rest: Sums,
    rolled: Sums,
    drive: DriveSums,
}

/// What the drive does while the wheel rolls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct DriveSums {
    /// Travel along the run and speed at its beginning.
    from: Option<(Millimetres, MillimetresPerSecond)>,
    ticks: u16,
    duty: Ratio,
    /// Rolling resistance that the compression means, 1/256 N.
    resistance: Newtons,
}

/// Sums of the loads measured and meant, 1/256 N.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sums {
    measured: Newtons,
    meant: Newtons,
    ticks: u16,
}

impl Sums {
    fn add(&mut self, measured: Newtons, meant: Newtons) {
        if self.ticks < LONGEST {
            self.ticks += 1;
            self.measured += Q16::from_bits(measured.to_bits() >> 8);
            self.meant += Q16::from_bits(meant.to_bits() >> 8);
        }
    }

    fn ratio(&self) -> Ratio {
        divide(self.measured, self.meant)
    }
}

/// A tick of a wheel that rolls on a wall.
#[derive(Clone, Copy, Debug)]
pub struct Rolls {
    /// Direction of the run.
    pub direction: Direction,
    /// Travel outwards.
    pub travel: Travel,
    /// Speed outwards, mm/s.
    pub speed: MillimetresPerSecond,
    /// Duty of the drive, outwards.
    pub duty: Ratio,
    /// Radial force on the wheel, N.
    pub pressed: Newtons,
    /// Compression of the tread, mm.
    pub compression: Millimetres,
}

/// What tread and drive show before the first crossing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Load measured over the load that the compression means, of the wheel at rest.
    pub rest: Ratio,
    /// Of the rolling wheel.
    pub rolled: Ratio,
    /// Radial force on the rolling wheel as known so far, N.
    pub pressed: Newtons,
    /// Axial load by the drive's effort, N; none on retract, where the worm holds it.
    pub load: Option<Newtons>,
    /// One sigma of it, N.
    pub load_sigma: Newtons,
}

impl Shown {
    /// Load measured over meant of the rolling wheel that the arm presses by `thrust`, N, more.
    fn rolled_under(self, thrust: Newtons) -> Ratio {
        self.rolled + divide(self.rolled * thrust, self.pressed)
    }

    /// Whether the compression may be that of a wheel that the arm presses by `thrust`, N, more than
    /// was known: rubber within its tolerance does not hide that.
    pub fn bears(self, thrust: Newtons) -> bool {
        let off = |ratio: Ratio| (ratio - Ratio::ONE).abs();
        off(self.rolled_under(thrust)) < off(self.rolled) + BAND
    }

    /// Stiffness to expect of the first crossing, over the known one; 1 while nothing speaks
    /// against that. The arm presses the wheel by `thrust`, N, more than was known.
    pub fn stiffness(self, thrust: Newtons) -> Ratio {
        let rolled = self.rolled_under(thrust);
        let beyond = divide(self.rest, rolled) - RATIO_WITHIN;
        let coupled = Ratio::ONE + beyond.max(Q16::ZERO) * PER_RATIO;
        if rolled < SOFT {
            coupled.max(SOFT_AS + SOFT - rolled)
        } else if rolled > STIFF {
            coupled.max(rolled)
        } else {
            coupled
        }
    }
}

impl Tread {
    /// The tread of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let radius = rig.rig.wheel_radius_mm;
        let spacing = SPACING * radius;
        let rate = 1e-9 * rig.tread.k_inf_pa_per_m * rig.rig.wheel_width_mm * spacing;
        let [from, to] = ROLLING.map(|part| part * radius);
        // No farther than to where the first corner may touch.
        let touch = CornerProfile::try_build(rig)?.first_contact(Direction::Deploy).to_num::<f64>();
        let first = rig
            .rig
            .step_positions_mm
            .first()
            .map_or(to, |face| face - rig.rig.step_tolerance_mm - touch);
        let to = to.min(first);
        let length = |mm| checked("rig.wheel_radius_mm", mm);
        Ok(Self {
            rate: checked("tread.k_inf_pa_per_m", rate)?,
            relaxed: checked(
                "tread.k_inf_pa_per_m",
                (4.0 / 3.0 * rate / spacing * libm::sqrt(2.0 * radius)).min(f64::from(i16::MAX)),
            )?,
            excess: checked("tread.stiffening", rig.tread.stiffening - 1.0)?,
            memory: LowPass::build(rig.tread.tau_s),
            spacing: length(spacing)?,
            curvature: length(0.5 / radius)?,
            rolling: (length(from)?, length(to)?),
            least: checked("preload.cruise_n", LEAST_PART * rig.preload.cruise_n)?,
            stall: checked("drive.stall_force_n", rig.drive.stall_force_n)?,
            gearbox: checked("drive.stall_force_n", GEARBOX * rig.drive.stall_force_n)?,
            load_sigma: checked("drive.stall_force_n", LOAD_SIGMA * rig.drive.stall_force_n)?,
            per_speed: checked("drive.no_load_speed_mm_s", 1.0 / rig.drive.no_load_speed_mm_s)?,
            inertia: checked(
                "drive.reflected_mass_kg",
                1e-3 * (rig.drive.reflected_mass_kg + rig.plant.moved_mass_kg),
            )?,
        })
    }

    /// Whether a wheel at rest may be on an edge, which presses the tread in twice as far: on a wall
    /// that compression would carry twice the preload. Under little preload it may.
    pub fn may_rest_on_edge(&self, preload: Newtons, compression: Millimetres) -> bool {
        preload < self.least || self.means(compression) > preload + preload
    }

    /// Load on a relaxed tread that is compressed by so much, N: `4/3 k_inf L c sqrt(2 R c)`.
    pub fn means(&self, compression: Millimetres) -> Newtons {
        let depth = compression.max(Q16::ZERO);
        sqrt(depth) * depth * self.relaxed
    }

    /// The wheel is at rest here and has been pressed like this for long.
    pub fn begin(
        &self,
        state: &mut TreadState,
        travel: Travel,
        preload: Newtons,
        compression: Millimetres,
    ) {
        *state = TreadState { from: travel, rises: preload < self.least, ..TreadState::default() };
        for (index, q) in state.q.iter_mut().enumerate() {
            *q = LowPassState::at(self.depth(index, Q16::ZERO, compression));
        }
    }

    /// A tick of a wheel at rest on a wall; true once, if compression and preload contradict
    /// each other. The arm's inclination may add `arm_thrust` to the preload, or nothing while
    /// the latch at the stow end carries the load.
    pub fn rest(
        &self,
        state: &mut TreadState,
        preload: Newtons,
        arm_thrust: Newtons,
        compression: Millimetres,
    ) -> bool {
        let (meant, _) = self.load(state, Q16::ZERO, compression);
        state.ticks = state.ticks.saturating_add(1);
        if preload < self.least {
            return false;
        }
        let forgot = state.ticks >= FORGETS;
        if forgot || !state.rises {
            state.rest.add(preload, meant);
        }
        if !forgot {
            return false;
        }
        let most = preload + arm_thrust;
        let off = meant > most + most * BAND || meant < preload - preload * BAND;
        state.off = if off { state.off.saturating_add(1) } else { 0 };
        state.off == OFF_TICKS
    }

    /// A tick of a wheel that rolls on a wall. Once, where enough has been seen, the tread at rest
    /// and rolling, and the load.
    /// None while the wheel is too close to where it was at rest, or too far away, or if its
    /// preload did not rise there.
    pub fn roll(&self, state: &mut TreadState, tick: &Rolls) -> Option<Shown> {
        if !state.rises {
            // A wheel that stood under its preload before a first drop shows its tread at rest.
            let rest = core::mem::take(&mut state.rest);
            let seen = tick.direction == Direction::Retract && rest.ticks > OFF_TICKS;
            let (rest, pressed) = (rest.ratio(), tick.pressed);
            let other = (rest - Ratio::ONE).abs() > REST_WITHIN;
            let load_sigma = self.load_sigma;
            let shown = Shown { rest, rolled: rest, pressed, load: None, load_sigma };
            return (seen && other).then_some(shown);
        }
        let rolled = match tick.direction {
            Direction::Deploy => Q16::narrow(tick.travel - state.from),
            Direction::Retract => Q16::narrow(state.from - tick.travel),
        };
        let (meant, resistance) = self.load(state, rolled, tick.compression);
        let (from, to) = self.rolling;
        if rolled > from && tick.pressed > self.least {
            state.rolled.add(tick.pressed, meant);
            let drive = &mut state.drive;
            if drive.from.is_none() {
                drive.from = Some((rolled, tick.speed));
            } else if drive.ticks < LONGEST {
                drive.ticks += 1;
                drive.duty += tick.duty;
                drive.resistance += Q16::from_bits(resistance.to_bits() >> 8);
            }
        }
        if rolled <= to {
            return None;
        }
        state.rises = false;
        let seen = state.rest.ticks > OFF_TICKS && state.rolled.ticks > OFF_TICKS;
        let ticks = Q16::from_bits(i32::from(state.rolled.ticks) << 8);
        seen.then(|| Shown {
            rest: state.rest.ratio(),
            rolled: state.rolled.ratio(),
            pressed: divide(state.rolled.measured, ticks),
            load: self.axial(&state.drive, rolled, tick),
            load_sigma: self.load_sigma,
        })
    }

    /// Axial load, N, by the drive's mean effort since it is watched: what its duty is beyond that of
    /// its speed, less acceleration, friction of the gearbox and rolling resistance.
    fn axial(&self, drive: &DriveSums, rolled: Millimetres, tick: &Rolls) -> Option<Newtons> {
        let (from, speed) = drive.from.filter(|_| tick.direction == Direction::Deploy)?;
        let ticks = Q16::from_num(drive.ticks);
        let seconds = ticks_to_seconds(u32::from(drive.ticks));
        let duty = divide(drive.duty, ticks) - divide(rolled - from, seconds) * self.per_speed;
        let accelerates = self.inertia * divide(tick.speed - speed, seconds);
        let resistance = divide(drive.resistance, Q16::from_bits(ticks.to_bits() >> 8));
        Some(self.stall * duty - accelerates - self.gearbox - resistance)
    }

    /// Depth of an element, mm.
    fn depth(&self, index: usize, rolled: Millimetres, compression: Millimetres) -> Millimetres {
        let x = self.place(index) - rolled;
        (compression - x * x * self.curvature).max(Q16::ZERO)
    }

    /// Place of an element ahead of where the wheel was at rest, mm.
    fn place(&self, index: usize) -> Millimetres {
        self.spacing * Q16::from_num(index as i32 + AHEAD as i32 - ELEMENTS as i32 + 1)
    }

    /// Load and rolling resistance that the compression means, N; the memory moves on by a tick.
    fn load(
        &self,
        state: &mut TreadState,
        rolled: Millimetres,
        compression: Millimetres,
    ) -> (Newtons, Newtons) {
        let (mut sum, mut moment) = (Q16::ZERO, Q16::ZERO);
        for (index, q) in state.q.iter_mut().enumerate() {
            let depth = self.depth(index, rolled, compression);
            if depth > Q16::ZERO {
                let part = (depth + (depth - q.output()) * self.excess).max(Q16::ZERO);
                sum += part;
                moment += part * (self.place(index) - rolled);
            }
            self.memory.step(q, depth);
        }
        (sum * self.rate, (moment + moment) * self.curvature * self.rate)
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// `K` of the relaxed tread, N/mm^(3/2): a ring carries `K c^(3/2)`.
    fn stiffness(rig: &Rig) -> f64 {
        let area = 1e-9 * rig.tread.k_inf_pa_per_m * rig.rig.wheel_width_mm;
        4.0 / 3.0 * area * (2.0 * rig.rig.wheel_radius_mm).sqrt()
    }

    /// A tick of a wheel whose drive does nothing.
    fn rolling(direction: Direction, travel: Travel, pressed: Q16, compression: Q16) -> Rolls {
        Rolls { direction, travel, speed: Q16::ZERO, duty: Q16::ZERO, pressed, compression }
    }

    /// A state that began with the wheel unloaded.
    fn begun(tread: &Tread) -> TreadState {
        let mut state = TreadState::default();
        tread.begin(&mut state, Travel::ZERO, Q16::ZERO, Q16::ZERO);
        state
    }

    /// Presses a wheel of rubber that is `stiff` times as stiff from nothing to the preload at
    /// which crossings are made, at the pre-tightener's slew, with sensors of these gains;
    /// gives the tick of the report.
    fn pressed(name: &str, stiff: f64, load_gain: f64, tread_gain: f64) -> Option<u32> {
        let rig = Rig::named(name).expect("a preset");
        let tread = Tread::try_build(&rig).expect("in range");
        let mut state = begun(&tread);
        let rate = stiff * stiffness(&rig);
        let (mut force, mut memory, s) = (0.0f64, 0.0f64, rig.tread.stiffening);
        (0..3000).find(|_| {
            force = (force + rig.preload.slew_n_per_s * 1e-3).min(0.95 * rig.preload.limit_n);
            // Many short steps of the same solid, by another integration.
            for _ in 0..20 {
                let elastic = (force + (s - 1.0) * memory) / s;
                memory += (elastic - memory) / rig.tread.tau_s * 50e-6;
            }
            let elastic = (force + (s - 1.0) * memory) / s;
            let compression = (elastic / rate).powf(2.0 / 3.0);
            tread.rest(
                &mut state,
                Q16::from_num(force * load_gain),
                Q16::ZERO,
                Q16::from_num(compression * tread_gain),
            )
        })
    }

    /// A wheel pressed at the slew that rolls from half of the cruise preload on; gives the ratio
    /// that is reported. Elements a tenth as far apart and steps a tenth as long as the
    /// observer's. The compression sensor has this gain; the load grows with the power
    /// `1.5 / power` of what it shows.
    fn rolled(name: &str, power: f64, gain: f64, direction: Direction) -> Option<f64> {
        let rig = Rig::named(name).expect("a preset");
        let tread = Tread::try_build(&rig).expect("in range");
        let mut state = begun(&tread);
        let (radius, s) = (rig.rig.wheel_radius_mm, rig.tread.stiffening);
        let spacing = 0.1 * SPACING * radius;
        let rate = 1e-9 * rig.tread.k_inf_pa_per_m * rig.rig.wheel_width_mm * spacing;
        let mut memory = vec![0.0f64; 320];
        let keep = 1e-4 / rig.tread.tau_s;
        let (mut compression, mut travel) = (0.0f64, 0.0f64);
        for tick in 0..4000 {
            let force = rig.preload.slew_n_per_s * 1e-3 * f64::from(tick);
            let rolls = force > 0.5 * rig.preload.cruise_n;
            for _ in 0..10 {
                travel += if rolls { 1e-4 * 8.0 } else { 0.0 };
                let depth = |i: usize, c: f64| {
                    let x = spacing * (i as f64 - 120.0) - travel;
                    (c - x * x / (2.0 * radius)).max(0.0)
                };
                let load = |c: f64, memory: &[f64]| -> f64 {
                    let at = |(i, q): (usize, &f64)| (depth(i, c), *q);
                    let of = |(d, q): (f64, f64)| (d + (s - 1.0) * (d - q)).max(0.0);
                    let touching = memory.iter().enumerate().map(at).filter(|(d, _)| *d > 0.0);
                    rate * touching.map(of).sum::<f64>()
                };
                // One step of Newton's method from the height before.
                let (here, there) = (load(compression, &memory), load(compression + 1e-4, &memory));
                let slope = ((there - here) / 1e-4).max(1.0);
                compression = (compression + (force - here) / slope).max(0.0);
                for (i, q) in memory.iter_mut().enumerate() {
                    *q += keep * (depth(i, compression) - *q);
                }
            }
            let (load, shown) =
                (Q16::from_num(force), Q16::from_num(gain * 0.3 * (compression / 0.3).powf(power)));
            let outwards = Travel::from_num(travel);
            let ratio = match direction {
                _ if !rolls => {
                    tread.rest(&mut state, load, Q16::ZERO, shown);
                    None
                }
                Direction::Deploy => {
                    tread.roll(&mut state, &rolling(direction, outwards, load, shown))
                }
                Direction::Retract => {
                    tread.roll(&mut state, &rolling(direction, -outwards, load, shown))
                }
            };
            if let Some(shown_now) = ratio {
                let again = tread.roll(&mut state, &rolling(direction, outwards, load, shown));
                assert_eq!(again, None, "once");
                return Some(divide(shown_now.rest, shown_now.rolled).to_num());
            }
        }
        None
    }

    #[test]
    fn rubber_that_relaxes_as_known_is_as_stiff_rolling_as_at_rest() {
        for name in ["prototype", "fe"] {
            for direction in [Direction::Deploy, Direction::Retract] {
                let ratio = rolled(name, 1.0, 1.0, direction).expect("seen");
                assert!((ratio - 1.0).abs() < 0.012, "{name} {ratio}");
            }
        }
    }

    #[test]
    fn a_tread_whose_load_grows_less_shows_in_the_ratio_and_a_sensor_s_gain_does_not() {
        let ratio =
            |power, gain| rolled("prototype", power, gain, Direction::Deploy).expect("seen");
        assert!(ratio(1.25, 1.0) > 1.1, "{}", ratio(1.25, 1.0));
        assert!(ratio(0.8, 1.0) < 1.0 / 1.1, "{}", ratio(0.8, 1.0));
        for gain in [0.9, 1.1] {
            assert!((ratio(1.0, gain) - 1.0).abs() < 0.03, "{}", ratio(1.0, gain));
        }
    }

    proptest! {
        #[test]
        fn only_what_speaks_against_the_known_tread_makes_the_first_crossing_stiffer(
            rolled in 0.4..1.3f64,
            ratio in 0.95..1.25f64,
        ) {
            // An arm that presses by a quarter more than was known leaves four fifths of it.
            let shown = Shown {
                rest: Q16::from_num(rolled * ratio),
                rolled: Q16::from_num(0.8 * rolled),
                pressed: q16(40_000_000),
                load: None,
                load_sigma: Q16::ONE,
            };
            let got: f64 = shown.stiffness(q16(10_000_000)).to_num();
            let coupled = 1.0 + 4.0 * (ratio - 1.03).max(0.0);
            let exact = match rolled {
                r if r < 0.9 => coupled.max(1.16 + 0.9 - r),
                r if r > 1.03 => coupled.max(r),
                _ => coupled,
            };
            prop_assert!((got - exact).abs() < 1e-3, "{got} {exact}");
        }
    }

    #[test]
    fn a_load_that_presses_the_wheel_shows_in_the_tread() {
        let shown = |rolled: f64| Shown {
            rest: Q16::ONE,
            rolled: Q16::from_num(rolled),
            pressed: q16(20_000_000),
            load: None,
            load_sigma: Q16::ONE,
        };
        // A tread as known bears what presses it by a fifth; a load that presses by 8 N without
        // being in the known force shows as a tread that is softer by as much.
        for (rolled, thrust, bears) in
            [(1.0, 4, true), (1.0, 5, false), (0.71, 8, true), (1.0, -5, false), (1.2, 5, false)]
        {
            let by = Q16::from_num(thrust);
            assert_eq!(shown(rolled).bears(by), bears, "{rolled} {thrust}");
        }
    }

    #[test]
    fn a_wheel_that_was_pressed_before_shows_no_ratio() {
        let tread = Tread::try_build(&Rig::prototype()).expect("in range");
        let mut state = TreadState::default();
        let (load, compression) = (q16(30_000_000), q16(300_000));
        tread.begin(&mut state, Travel::ZERO, load, compression);
        for _ in 0..1000 {
            tread.rest(&mut state, load, Q16::ZERO, compression);
        }
        for tick in 0..1000 {
            let travel = Travel::from_num(0.01 * f64::from(tick));
            let rolls = rolling(Direction::Deploy, travel, load, compression);
            assert_eq!(tread.roll(&mut state, &rolls), None);
        }
    }

    #[test]
    fn a_compression_sensor_that_is_a_fifth_off_is_reported() {
        for name in ["prototype", "fe"] {
            assert_eq!(pressed(name, 1.0, 1.0, 1.0), None);
            assert!(pressed(name, 1.0, 1.0, 1.2).is_some());
            assert!(pressed(name, 1.0, 1.0, 1.0 / 1.2).is_some());
            assert!(pressed(name, 1.0, 0.7, 1.0).is_some());
        }
    }

    #[test]
    fn what_the_arm_may_add_excuses_as_much() {
        let rig = Rig::prototype();
        let tread = Tread::try_build(&rig).expect("in range");
        let relaxed = |arm_thrust: f64, compression: f64| {
            let mut state = TreadState::default();
            let (preload, compression) = (q16(40_000_000), Q16::from_num(compression));
            tread.begin(&mut state, Travel::ZERO, preload, compression);
            (0..1000)
                .any(|_| tread.rest(&mut state, preload, Q16::from_num(arm_thrust), compression))
        };
        let at = |force: f64| (force / stiffness(&rig)).powf(2.0 / 3.0);
        assert!(!relaxed(0.0, at(40.0 * 1.2)) && relaxed(0.0, at(40.0 * 1.25)));
        assert!(!relaxed(8.0, at(48.0 * 1.2)) && relaxed(8.0, at(40.0 * 0.75)));
        assert!(relaxed(0.0, 0.0), "a sensor that shows nothing");
    }

    proptest! {
        #[test]
        fn rubber_within_its_tolerance_is_not_reported(
            stiff in 0.88..1.12f64,
            load_gain in 0.985..1.015f64,
            tread_gain in 0.985..1.015f64,
        ) {
            prop_assert_eq!(pressed("prototype", stiff, load_gain, tread_gain), None);
        }

        #[test]
        fn a_relaxed_tread_carries_what_a_ring_does(compression in 0.1..0.9f64) {
            let rig = Rig::prototype();
            let tread = Tread::try_build(&rig).expect("in range");
            let mut state = TreadState::default();
            let shown = Q16::from_num(compression);
            tread.begin(&mut state, Travel::ZERO, Q16::ZERO, shown);
            let load = tread.load(&mut state, Q16::ZERO, shown).0.to_num::<f64>();
            let exact = stiffness(&rig) * compression.powf(1.5);
            prop_assert!((load / exact - 1.0).abs() < 0.04, "{load} {exact}");
        }
    }

    proptest! {
        /// A wheel that speeds up against this load; no rolling resistance without compression.
        #[test]
        fn the_load_is_what_the_duty_is_beyond_speed_acceleration_and_gearbox(
            load in 0.0..20.0f64,
            speeds_up in 0.0..200.0f64,
            supply in 0.994..1.006f64,
        ) {
            for rig in [Rig::prototype(), Rig::fe()] {
                let tread = Tread::try_build(&rig).expect("in range");
                let mut state = begun(&tread);
                let pressed = q16(80_000_000);
                for _ in 0..u32::from(FORGETS + 2 * OFF_TICKS) {
                    tread.rest(&mut state, pressed, Q16::ZERO, Q16::ZERO);
                }
                let (mut travel, mut speed) = (0.0, 8.0);
                let mass = 1e-3 * (rig.drive.reflected_mass_kg + rig.plant.moved_mass_kg);
                let shown = (0..2000).find_map(|_| {
                    speed += 1e-3 * speeds_up;
                    travel += 1e-3 * speed;
                    let force = load + mass * speeds_up + GEARBOX * rig.drive.stall_force_n;
                    let duty = speed / rig.drive.no_load_speed_mm_s
                        + force / rig.drive.stall_force_n;
                    let rolls = Rolls {
                        speed: Q16::from_num(speed),
                        duty: Q16::from_num(duty / supply),
                        ..rolling(Direction::Deploy, Travel::from_num(travel), pressed, Q16::ZERO)
                    };
                    tread.roll(&mut state, &rolls)
                });
                let shown = shown.expect("seen");
                let got = shown.load.expect("shows on the way out").to_num::<f64>();
                let sigma = shown.load_sigma.to_num::<f64>();
                prop_assert!((got - load).abs() < 1.5 * sigma, "{got} of {load}, {sigma}");
            }
        }
    }

    #[test]
    fn it_is_compared_from_the_least_preload_on_and_after_its_ticks() {
        let rig = Rig::prototype();
        let tread = Tread::try_build(&rig).expect("in range");
        let reported = |preload: Newtons| {
            let mut state = TreadState::default();
            tread.begin(&mut state, Travel::ZERO, preload, Q16::ZERO);
            (1..2000).find(|_| tread.rest(&mut state, preload, Q16::ZERO, Q16::ZERO))
        };
        let least = Q16::from_num(LEAST_PART * rig.preload.cruise_n);
        assert_eq!(reported(least - q16(10_000)), None);
        assert_eq!(reported(q16(1_000_000)), None);
        // The first of the ticks that it must be off is that at which enough is forgotten.
        let ticks = u32::from(FORGETS + OFF_TICKS) - 1;
        assert_eq!(reported(tread.least), Some(ticks));
        assert_eq!(reported(least + q16(10_000)), Some(ticks));
    }
}
