//! Checks of the sensors against one another and against the bridges' commands. Each compares two
//! quantities that no single fault changes alike. They run while the drive is on and start again
//! when it has been off.

use super::Observed;
use crate::fault::Fault;
use crate::numeric::checked;
use crate::rig::{Rig, RigError, SHORT_PART, START_LAG_MM};
use crate::units::{
    Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, Tick, Travel, per_tick, q16,
};

/// Ticks between the three positions of an acceleration.
const SPAN: usize = 6;
/// Distance by which reference and encoder may bend apart within two spans, counts. Three
/// readings of a counter are off by less than 2 counts together; a third full count takes
/// `1 / (6 ms)^2`, 530 mm/s^2 beyond the reference: twice the acceleration of the profile. Of
/// finer counts that acceleration itself is the bound.
const BENT_COUNTS: f64 = 2.5;
const BENT_ACCELERATIONS: f64 = 2.0;
/// Distance off the reference within two spans, mm: the dips behind a step make 0.11, and two
/// readings of a counter are off by a count.
const OFF_MM: f64 = 0.11;
const OFF_COUNTS: f64 = 2.0;
/// Distance that counts as progress of the wheel, counts.
const PROGRESS_COUNTS: f64 = 2.5;
/// Travel of the reference that a wheel which has turned may stay behind, mm, beside its progress.
const LAG_MM: f64 = 0.35;
/// Number of progresses after which the wheel counts as turned.
const TURNED: u8 = 10;
/// Ticks within which arm and wheel are compared.
const ARM_TICKS: u8 = 32;
/// Distance that the arm may move more than the wheel within them, mm; noise and the slope of a
/// corner, at most 1, make 0.08.
const ARM_BEYOND: Millimetres = q16(250_000);
/// Least speed at which duty and speed are compared, mm/s.
const TELLING: MillimetresPerSecond = q16(10_000_000);
/// Duty beyond the feed-forward at cruise: gearbox friction makes 0.02, a motor that is off by 5 % 0.03
/// in either direction; and as a force, twice the load one load more, and the rolling resistance this
/// part of the preload, 6 N on the virtual prototype. What a corner leaves is duty: at least half of
/// what an encoder makes that reads two thirds.
const EFFORT: f64 = 0.05;
const ROLLS: f64 = 0.12;
const MISREAD: f64 = 0.25;
/// Ticks for which it must be outside: more than two time constants of the loop, in which it
/// settles after a corner.
const EFFORT_TICKS: u16 = 120;
/// Dead times and lags of its slew by which a preload may be short: what it makes with these off by
/// half. At least a part of the cruise preload.
const SHORT_LATENCIES: f64 = 0.5;
/// Deviation of the preload from its model that is a fault, over what is short: 1.8 at the ramps of
/// an actuator whose dead time, lag and slew are all off.
const STRAYED: f64 = 2.5;
/// Ticks for which it must deviate.
const STRAYED_TICKS: u16 = 10;
/// Equal codes in a row that count as stuck if the preload has to change meanwhile, or if nothing
/// is known of the sensor's noise.
const STUCK: u16 = 64;
/// Ticks of rest over which the changes of a code are counted: fewer than the self-test's.
const NOISE_TICKS: u16 = 64;
/// Chance of a run of equal codes that counts as stuck, as -ln: 1e-12.
const RARE: u16 = 28;
/// Change within a tick that no force can make, N: the spring yields 36 N/s at cruise speed.
const JUMP_N: Newtons = q16(4_000_000);
/// The same of the tread's compression, mm: it runs in at 20 mm/s.
const JUMP_MM: Millimetres = q16(100_000);
/// Increment of the jump count at a jump; each good tick decrements it by one.
const JUMP_COUNTS: u8 = 8;
/// Jump count of a fault: eight jumps close together.
const ERRATIC: u8 = 60;

#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct CrossCheck {
    /// See [`BENT_COUNTS`], [`OFF_MM`], [`PROGRESS_COUNTS`], [`LAG_MM`], mm.
    bent: Millimetres,
    off: Millimetres,
    progress: Millimetres,
    lag: Millimetres,
    /// See [`START_LAG_MM`], mm.
    start_lag: Millimetres,
    /// See [`EFFORT`].
    effort: (Ratio, Ratio),
    /// See [`SHORT_LATENCIES`] and [`STRAYED`], N.
    pub(super) short: Newtons,
    strayed: Newtons,
}

/// How often the codes of preload and compression sensor change at rest, by their own noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Noise {
    preload: CodeNoise,
    compression: CodeNoise,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CodeNoise {
    value: Q16,
    ticks: u16,
    changes: u16,
    /// Equal codes in a row that count as stuck.
    stuck: u16,
}

impl Default for CodeNoise {
    fn default() -> Self {
        Self { value: Q16::ZERO, ticks: 0, changes: 0, stuck: STUCK }
    }
}

impl Noise {
    /// A tick in which both bridges are off.
    pub(super) fn rest(&mut self, seen: &Observed<'_>) {
        self.preload.rest(seen.sensed.preload.value);
        self.compression.rest(seen.sensed.compression.value);
    }
}

impl CodeNoise {
    fn rest(&mut self, value: Q16) {
        self.changes += u16::from(value != self.value);
        self.value = value;
        self.ticks += 1;
        if self.ticks == NOISE_TICKS {
            self.stuck = run_of(self.changes);
            (self.ticks, self.changes) = (0, 0);
        }
    }
}

/// Equal codes in a row that are too rare by chance, of a sensor with so many changes in
/// [`NOISE_TICKS`]: `p^n < e^-28`, with `-ln p >= c / 64`. Of few changes half counts, of many
/// seven eighths, since they are a sample. A sensor without any is never stuck by its noise.
const fn run_of(changes: u16) -> u16 {
    // In halves of a change.
    let sure = if changes < 16 { changes } else { 2 * changes - changes / 4 };
    match (2 * RARE * NOISE_TICKS).checked_div(sure) {
        Some(run) if run < STUCK => STUCK,
        Some(run) => run,
        None => u16::MAX,
    }
}

/// State between ticks.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CrossState {
    /// Travel of the reference since the drive was switched on.
    reference: Travel,
    /// Encoder less reference, mm, of the ticks of the last two spans, the oldest first, and how many of
    /// them are known.
    past: [Millimetres; 2 * SPAN],
    held: usize,
    at: Tick,
    /// Travel and reference at the last progress.
    progress: (Travel, Travel),
    /// Number of progresses, up to [`TURNED`].
    turned: u8,
    /// Radius and encoder when arm and wheel were last set equal, and the ticks since.
    arm: (Millimetres, Travel),
    arm_ticks: u8,
    effort: u16,
    strayed: u16,
    preload: CodeState,
    compression: CodeState,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct CodeState {
    value: Q16,
    same: u16,
    /// Preload that was due at the last change, N.
    due: Newtons,
    erratic: u8,
}

/// Distance off its reference within two spans that is a fault, mm.
#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
pub fn off_reference_mm(rig: &Rig) -> f64 {
    OFF_MM + OFF_COUNTS * count_mm(rig)
}

/// Travel of a count of the encoder, mm.
#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
fn count_mm(rig: &Rig) -> f64 {
    2.0 * core::f64::consts::PI * rig.rig.wheel_radius_mm / rig.sense.encoder_counts
}

impl CrossCheck {
    /// Thresholds of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub(super) fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let count_mm = count_mm(rig);
        let counts = |mm: f64| checked("sense.encoder_counts", mm);
        let late = SHORT_LATENCIES * rig.preload.slew_n_per_s * rig.preload_latency_s();
        let short = late.max(SHORT_PART * rig.preload.cruise_n);
        let span_s = 1e-3 * SPAN as f64;
        let bent = BENT_ACCELERATIONS * rig.drive.acceleration_mm_s2 * span_s * span_s;
        let resists = rig.plant.top_load_n * rig.plant.top_load_share + ROLLS * rig.preload.limit_n;
        let cruise = rig.drive.cruise_speed_mm_s / rig.drive.no_load_speed_mm_s;
        let most = (EFFORT + resists / rig.drive.stall_force_n).max(MISREAD * cruise);
        let effort = |duty: f64| checked("drive.stall_force_n", duty);
        Ok(Self {
            effort: (effort(-EFFORT)?, effort(most)?),
            bent: counts(bent.max(BENT_COUNTS * count_mm))?,
            off: counts(off_reference_mm(rig))?,
            progress: counts(PROGRESS_COUNTS * count_mm)?,
            start_lag: counts(START_LAG_MM)?,
            lag: counts(LAG_MM + PROGRESS_COUNTS * count_mm)?,
            short: checked("preload.slew_n_per_s", short)?,
            strayed: checked("preload.slew_n_per_s", STRAYED * short)?,
        })
    }

    /// Check of the pre-tightener and its sensor, whenever that is on. The preload is `off` what
    /// the actuator should have reached and what the spring's own motion makes, N.
    pub(super) fn preload(
        &self,
        state: &mut CrossState,
        noise: &Noise,
        seen: &Observed<'_>,
        off: Newtons,
    ) -> Option<Fault> {
        let limits = Limits { stuck: noise.preload.stuck, jump: JUMP_N, due: self.telling() };
        let preload = seen.sensed.preload.value;
        let unsound = judge(&mut state.preload, preload, seen.preload_due, &limits);
        let strayed = lasts(&mut state.strayed, off.abs() > self.strayed, STRAYED_TICKS);
        unsound
            .then_some(Fault::PreloadSensorImplausible)
            .or(strayed.then_some(Fault::PretightenerRunaway))
    }

    /// Change of the preload that no sensor sleeps through, N: half of what counts as astray.
    fn telling(&self) -> Newtons {
        self.strayed.half()
    }

    /// Every check of a tick in which the drive is on; `off` as for the pre-tightener.
    pub(super) fn step(
        &self,
        state: &mut CrossState,
        noise: &Noise,
        seen: &Observed<'_>,
        off: Newtons,
    ) -> Option<Fault> {
        let bent = self.bends(state, seen);
        // Without a new reading the wheel's position is unknown.
        let fresh = seen.sensed.speed.at == seen.now;
        let lags = fresh && self.lags(state, seen);
        let preload = self.preload(state, noise, seen, off);
        let stuck = noise.compression.stuck;
        let limits = Limits { stuck, jump: JUMP_MM, due: self.telling() };
        let compression = seen.sensed.compression.value;
        let unsound = judge(&mut state.compression, compression, seen.preload_due, &limits);
        let arm = fresh && arm_runs_ahead(state, seen);
        let effort = seen.effort.is_some_and(|effort| {
            let along = if seen.speed_ref < Q16::ZERO { -effort } else { effort };
            seen.speed_ref.abs() > TELLING && !(self.effort.0..=self.effort.1).contains(&along)
        });
        let effort = lasts(&mut state.effort, effort, EFFORT_TICKS);
        bent.then_some(Fault::DriveRunaway)
            .or(preload.filter(|fault| *fault == Fault::PreloadSensorImplausible))
            .or(unsound.then_some(Fault::CompressionSensorImplausible))
            .or(arm.then_some(Fault::ArmMismatch))
            .or(lags.then_some(Fault::DriveStalled))
            .or(effort.then_some(Fault::DutyMismatch))
            .or(preload)
    }

    /// Whether the wheel leaves its reference: first or second difference of encoder less
    /// reference over 12 ms.
    fn bends(&self, state: &mut CrossState, seen: &Observed<'_>) -> bool {
        state.reference = state.reference.wrapping_add(per_tick(seen.speed_ref));
        // A tick without a new reading, or one lost: the times would not be equal.
        let missed = seen.sensed.speed.at != seen.now || seen.now.wrapping_sub(state.at) != 1;
        state.at = seen.now;
        if missed {
            state.held = 0;
            return false;
        }
        let now = Q16::narrow(seen.travel.wrapping_sub(state.reference));
        let (old, middle) = (state.past[0], state.past[SPAN]);
        let known = state.held >= state.past.len();
        state.held = state.held.saturating_add(1);
        state.past.rotate_left(1);
        state.past[2 * SPAN - 1] = now;
        let bend = (now - middle) - (middle - old);
        known && (bend.abs() > self.bent || (now - old).abs() > self.off)
    }

    /// Whether the axle falls behind its reference without progress.
    fn lags(&self, state: &mut CrossState, seen: &Observed<'_>) -> bool {
        let (travel, reference) = state.progress;
        let along = |d: Travel| {
            let d = Q16::narrow(d);
            if seen.speed_ref < Q16::ZERO { -d } else { d }
        };
        let moved = along(seen.travel.saturating_sub(travel));
        if moved > self.progress {
            state.progress = (seen.travel, state.reference);
            state.turned = state.turned.saturating_add(1).min(TURNED);
            return false;
        }
        let most = if state.turned < TURNED { self.start_lag } else { self.lag };
        along(state.reference.saturating_sub(reference)) - moved > most
    }
}

/// Whether the arm has moved farther than the wheel, and the tread that lets go of its axle.
fn arm_runs_ahead(state: &mut CrossState, seen: &Observed<'_>) -> bool {
    if state.arm_ticks == 0 {
        state.arm = (seen.sensed.radius.value, seen.travel);
        state.arm_ticks = ARM_TICKS;
    }
    state.arm_ticks -= 1;
    let (radius, travel) = state.arm;
    let rolled = Q16::narrow(seen.travel.saturating_sub(travel)).abs();
    (seen.sensed.radius.value - radius).abs() > rolled + seen.wound + ARM_BEYOND
}

/// Bounds of a sensor's codes.
struct Limits {
    /// Equal codes in a row that its noise does not make.
    stuck: u16,
    /// Largest change in a tick.
    jump: Q16,
    /// Change of the preload that must show.
    due: Newtons,
}

/// Whether a converter is stuck or jumps repeatedly.
fn judge(state: &mut CodeState, value: Q16, due: Newtons, limits: &Limits) -> bool {
    let change = (value - state.value).abs();
    state.value = value;
    if change == Q16::ZERO {
        state.same = state.same.saturating_add(1);
    } else {
        (state.same, state.due) = (0, due);
    }
    let sleeps = state.same >= STUCK && (due - state.due).abs() > limits.due;
    state.erratic = if change > limits.jump {
        state.erratic.saturating_add(JUMP_COUNTS)
    } else {
        state.erratic.saturating_sub(1)
    };
    state.same >= limits.stuck || sleeps || state.erratic >= ERRATIC
}

/// Counts ticks while a condition lasts, and whether they are `enough`.
pub(super) fn lasts(count: &mut u16, condition: bool, enough: u16) -> bool {
    *count = if condition { count.saturating_add(1) } else { 0 };
    *count >= enough
}

impl CrossState {
    /// Starts with the drive, which has been at rest until now.
    pub(super) fn begin(&mut self, seen: &Observed<'_>) {
        *self = Self {
            past: [Q16::narrow(seen.travel); 2 * SPAN],
            held: 2 * SPAN,
            at: seen.now.wrapping_sub(1),
            progress: (seen.travel, Travel::ZERO),
            strayed: self.strayed,
            preload: self.preload,
            ..Self::default()
        };
        self.compression.value = seen.sensed.compression.value;
        self.compression.due = seen.preload_due;
    }
}

#[cfg(test)]
#[path = "crosscheck_tests.rs"]
mod tests;
