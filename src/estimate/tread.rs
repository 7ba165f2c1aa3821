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

use crate::model::corner_profile::CornerProfile;
use crate::model::planner::KNOWN_SCALE;
use crate::numeric::{LowPass, LowPassState, checked, divide, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Travel, q16,
    ticks_to_seconds,
};

/// Part of the load that the compression may show too much or too little: rubber off by three
/// deviations of 4 %, both sensors' gains by three of 0.5 %, `1.015^1.5 / (0.88 * 0.985)`, and the
/// noise of what they zeroed, 0.01.
const BAND: Ratio = q16(190_000);
/// Error of the elements while the preload rises, 3 % of a load that may be 1.18 times the measured.
const OF_ELEMENTS: Ratio = q16(36_000);
/// Least preload at which it is compared, part of the cruise preload: the wheel rolls from about
/// 0.4 of it on.
const LEAST_PART: f64 = 0.3;
/// Ticks after which what the tread remembers from before is forgotten far enough.
const FORGETS: u16 = 300;
/// Ticks that it must be off.
const OFF_TICKS: u16 = 50;

/// Ratio of both loads at rest over rolling up to which the tread is as known, and by how much a
/// crossing is stiffer per ratio beyond that. Fitted, without a derivation: on 160 virtual rigs with
/// a bonded tread the stiffness that the first crossing shows grows with the power 2.6 of the ratio,
/// +- 24 %. Four, because too stiff a guess only costs time. A real tread has to show it.
const RATIO_WITHIN: Ratio = q16(1_030_000);
const PER_RATIO: Q16 = q16(4_000_000);

/// Elements, and their distance over the wheel's radius: 20 mm of the published wheel's tread.
const ELEMENTS: usize = 32;
const SPACING: f64 = 1.0 / 40.0;
/// Elements ahead of the wheel's centre when it begins to roll: as far as it is observed, and
/// half a patch.
const AHEAD: usize = 19;
/// Where the rolling tread is observed, over the wheel's radius.
const ROLLING: [f64; 2] = [0.03, 0.12];
/// Coulomb friction of the gearbox, and one sigma of the load that the drive shows, as parts of the
/// stall force: that friction to a tenth, and the supply of the bridge to 0.6 % of a duty of 0.25.
const GEARBOX: f64 = 0.02;
const LOAD_SIGMA: f64 = 0.0025;
/// The same as a part of the rolling loss: of an unknown relaxation it is anything from none to
/// twice what the compression means, evenly spread.
const LOSS_SIGMA: Ratio = q16(577_000);

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
    /// Ticks in which a loaded tread gives way but for 2 %.
    relaxes: u32,
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
    pub(super) rises: bool,
    /// The tread had relaxed by then.
    relaxed: bool,
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
        // A tread that is too soft is not as known, either: it may be as far off on a corner.
        let off = rolled - Ratio::ONE;
        let soft = -off > KNOWN_SCALE - Ratio::ONE;
        coupled.max(Ratio::ONE + if soft { -off } else { off })
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
            // Under a constant load it gives way with `s tau`: four of these.
            relaxes: (4e3 * rig.tread.stiffening * rig.tread.tau_s) as u32,
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

    /// The wheel is at rest here, and has been for these ticks or for long.
    pub fn begin(
        &self,
        state: &mut TreadState,
        (travel, rested): (Travel, Option<u32>),
        preload: Newtons,
        compression: Millimetres,
    ) {
        let relaxed = rested.is_none_or(|ticks| ticks >= self.relaxes);
        let rises = preload < self.least;
        *state = TreadState { from: travel, rises, relaxed, ..TreadState::default() };
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
            // One that stands under its preload bears the load as well.
            state.rest.add(if state.rises { preload } else { preload + arm_thrust }, meant);
        }
        if !forgot {
            return false;
        }
        let most = preload + arm_thrust;
        let band = BAND + OF_ELEMENTS;
        let off = meant > most + most * band || meant < preload - preload * band;
        state.off = if off { state.off.saturating_add(1) } else { 0 };
        state.off == OFF_TICKS
    }

    /// A tick of a wheel that rolls on a wall. Once, where enough has been seen, the tread at rest
    /// and rolling, and the load.
    /// None while the wheel is too close to where it was at rest, or too far away, or if its
    /// preload did not rise there and it did not stand before a first drop either.
    pub fn roll(&self, state: &mut TreadState, tick: &Rolls) -> Option<Shown> {
        if !state.rises {
            // A wheel that stood under its preload before a first drop shows its tread at rest.
            let rest = core::mem::take(&mut state.rest);
            let back = tick.direction == Direction::Retract && state.relaxed;
            let seen = back && rest.ticks > OFF_TICKS;
            let (rest, pressed) = (rest.ratio(), tick.pressed);
            let other = (rest - Ratio::ONE).abs() > KNOWN_SCALE - Ratio::ONE;
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
        let (load, loss) = self.axial(&state.drive, rolled, tick);
        seen.then(|| Shown {
            rest: state.rest.ratio(),
            rolled: state.rolled.ratio(),
            pressed: divide(state.rolled.measured, ticks),
            load,
            load_sigma: self.load_sigma + loss * LOSS_SIGMA,
        })
    }

    /// Axial load and rolling resistance, N. The load, by the drive's mean effort since it is watched,
    /// is what its duty is beyond that of its speed, less acceleration, friction of the gearbox and that
    /// resistance.
    fn axial(
        &self,
        drive: &DriveSums,
        rolled: Millimetres,
        tick: &Rolls,
    ) -> (Option<Newtons>, Newtons) {
        let ticks = Q16::from_num(drive.ticks);
        let resistance = divide(drive.resistance, Q16::from_bits(ticks.to_bits() >> 8));
        let load =
            drive.from.filter(|_| tick.direction == Direction::Deploy).map(|(from, speed)| {
                let seconds = ticks_to_seconds(u32::from(drive.ticks));
                let duty =
                    divide(drive.duty, ticks) - divide(rolled - from, seconds) * self.per_speed;
                let accelerates = self.inertia * divide(tick.speed - speed, seconds);
                self.stall * duty - accelerates - self.gearbox - resistance
            });
        (load, resistance)
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
#[path = "tread_tests.rs"]
mod tests;
