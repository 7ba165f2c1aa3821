//! A record prepared for the fit: the wheel's rotation and the preload as smooth inputs,
//! compression, arm angle and drive effort as means over bins.
//!
//! An encoder count is 19 um of tread. The rotation is taken at the edges between counts,
//! where it is known to half a tick of travel, and smoothed over 16 ms. The bins of 10 ms
//! hold at least two periods of the arm's modes and of the torque ripple; speeds at which
//! the one excites the other are left out.

use std::f64::consts::TAU;
use std::ops::Range;

use super::IdentifyError;
use super::record::{Record, Sample};
use crate::plant::wall::touch_mm;
use crate::scenario::TICK_S;

/// Length of a bin, ticks.
pub(crate) const BIN: usize = 10;
/// Length of a bin of the drive's effort, ticks: its speed is a difference of counts.
pub(crate) const EFFORT_BIN: usize = 40;
/// Half-width of the smoothing windows of rotation and preload, ticks. The model takes the
/// residual steps of the counts for acceleration, and near the limit of friction creep
/// grows faster than its mean.
const SMOOTH_TURN: usize = 16;
const SMOOTH_PRELOAD: usize = 6;
/// Least number of readings of the unloaded rig for a zero.
const LEAST_UNLOADED: usize = 50;
/// Preload, N, and compression, mm, that still count as none, as for the controller's zero.
const UNLOADED: (f64, f64) = (3.0, 0.1);
/// Least preload at which a reading is compared, N.
const LEAST_PRELOAD_N: f64 = 2.0;
/// Relative distance from a mode's speed within which nothing is compared.
const NEAR_MODE: f64 = 0.12;
/// How far before a face the wheel is clear of its corner, parts of the distance at which it
/// touches.
const CLEAR: f64 = 1.18;
/// Change of the arm's mean over so many ticks below which it is at rest, rad: a tenth of
/// a millimetre, as a slipping wheel bounces.
const AT_REST_RAD: f64 = 1e-3;
const STEADY: usize = 40;
/// Time after the drive's start in which nothing is compared, ticks: the first counts do
/// not show when the wheel began to turn.
const STARTING: usize = 40;
/// Relaxations after which the tread remembers nothing that shows.
const FORGETS: f64 = 5.0;
/// Acceleration beyond which the drive's effort is its inertia, mm/s^2.
const MOST_ACCELERATION: f64 = 60.0;
/// Duty beyond which the current limit may bind.
const MOST_PART_OF_LIMIT: f64 = 0.95;

/// A zero of a sensor: mean over the unloaded rig, and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Zero {
    /// Reading of the unloaded sensor.
    pub value: f64,
    /// Standard error of it.
    pub error: f64,
    /// Readings behind it; 0 if the log has no unloaded rig.
    pub count: usize,
}

/// Mean of a channel over a bin.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bin {
    pub ticks: Range<usize>,
    /// Compression without its zero, mm.
    pub compression_mm: f64,
    /// Arm angle, rad; none if no frame came.
    pub arm_rad: Option<f64>,
    /// Preload as read without the preload sensor's zero, N.
    pub preload_n: f64,
    /// Whether the preload is compared.
    pub pressed: bool,
    /// Whether it is compared.
    pub used: bool,
}

/// What the drive did over a bin.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Effort {
    pub ticks: Range<usize>,
    /// Mean duty.
    pub duty: f64,
    /// Mean rate of turn, rad/s.
    pub turn_rad_s: f64,
    /// Mean acceleration of the turn, rad/s^2.
    pub gain_rad_s2: f64,
    /// Whether it is compared.
    pub used: bool,
}

/// A prepared record.
#[derive(Clone, Debug)]
pub(crate) struct Traces {
    /// Ticks that are compared: from the first preload to the last drive.
    pub span: Range<usize>,
    /// Rotation since the start, rad, every tick.
    pub turn_rad: Vec<f64>,
    /// Preload without the preload sensor's zero, N, every tick.
    pub preload_n: Vec<f64>,
    /// Zero of the preload sensor, N.
    pub preload_zero: Zero,
    /// Zero of the compression sensor, mm.
    pub compression_zero: Zero,
    /// Bins of compression and arm angle.
    pub bins: Vec<Bin>,
    /// Bins of the drive's effort.
    pub efforts: Vec<Effort>,
    /// Whether at the end the wheel turns at a step without getting up.
    pub slips: bool,
}

impl Traces {
    /// Prepares a record.
    pub(crate) fn of(record: &Record) -> Result<Self, IdentifyError> {
        let bad = |why: &str| IdentifyError::Log(record.name.clone(), why.into());
        let samples = &record.samples;
        let pressed = samples.iter().position(|s| s.pretightener_on);
        let start = pressed.ok_or_else(|| bad("the pre-tightener was never on"))?;
        let driven = samples.iter().position(|s| s.drive_on);
        let moving = driven.ok_or_else(|| bad("the drive was never on"))?;
        let last = samples.iter().rposition(|s| s.drive_on).unwrap_or(moving);
        let end = last + 1;
        if end < start + 4 * EFFORT_BIN {
            return Err(bad("the run is too short"));
        }
        let idle = if record.deploys() { unloaded(&samples[..start]) } else { &[] };
        let preload_zero = zero(idle, |s| s.preload_n);
        let compression_zero = zero(idle, |s| s.compression_mm);
        let per_count = TAU / record.scenario.rig.sense.encoder_counts;
        let turn_rad: Vec<f64> =
            turn(samples, moving).into_iter().map(|counts| counts * per_count).collect();
        let raw: Vec<f64> = samples.iter().map(|s| s.preload_n - preload_zero.value).collect();
        let delay = record.scenario.noise.preload_sensor_delay_s / TICK_S;
        let smooth = smoothed(&raw, SMOOTH_PRELOAD);
        let preload_n = (0..raw.len()).map(|n| at(&smooth, n as f64 + delay).max(0.0)).collect();
        let mut traces = Self {
            span: start..end,
            turn_rad,
            preload_n,
            preload_zero,
            compression_zero,
            bins: Vec::new(),
            efforts: Vec::new(),
            slips: false,
        };
        traces.bin(record, moving);
        Ok(traces)
    }

    /// Whether it begins with a preload, as an earlier run has left it.
    pub(crate) const fn is_loaded(&self) -> bool {
        self.preload_zero.count == 0
    }

    /// Tick before the corner touches, if at the end the wheel turns at a step without
    /// rising.
    fn onset_of_slip(&self, record: &Record) -> Option<usize> {
        let rig = &record.scenario.rig.rig;
        if !record.deploys() {
            return None;
        }
        let samples = &record.samples[..self.span.end];
        let mean = |ticks: Range<usize>| {
            let arms = samples[ticks].iter().filter_map(|s| s.arm_rad);
            let (sum, count) = arms.fold((0.0, 0), |(sum, count), arm| (sum + arm, count + 1));
            (count > 0).then(|| sum / f64::from(count))
        };
        let end = self.span.end;
        let (first, last) = (mean(0..STEADY)?, mean(end - STEADY..end)?);
        let risen = rig.arm_length_mm * (first.sin() - last.sin()) / rig.step_height_mm;
        let face = rig.step_positions_mm.get(risen.round().max(0.0) as usize)?;
        // Back from the end for as long as the arm is at rest.
        let mut steady = end - STEADY;
        while steady >= self.span.start + STEADY
            && mean(steady - STEADY..steady).is_some_and(|arm| (arm - last).abs() < AT_REST_RAD)
        {
            steady -= STEADY;
        }
        let steady = steady + STEADY;
        let clear_mm = CLEAR * touch_mm(rig.wheel_radius_mm, rig.step_height_mm);
        // Without getting up it has rolled no farther than the step is high.
        let rolled = |tick: usize| self.turn_rad[tick] * rig.wheel_radius_mm;
        let onset = (self.span.start..end).find(|&tick| rolled(tick) > face - clear_mm)?;
        let slips =
            steady > onset && rolled(end - 1) - rolled(steady.min(end - 1)) > rig.step_height_mm;
        slips.then_some(onset)
    }

    fn bin(&mut self, record: &Record, moving: usize) {
        let (samples, rig) = (&record.samples, &record.scenario.rig);
        let speed = |ticks: &Range<usize>| {
            let turn = self.turn_rad[ticks.end - 1] - self.turn_rad[ticks.start];
            turn / ((ticks.len() - 1) as f64 * TICK_S)
        };
        let radius = rig.rig.wheel_radius_mm;
        // How an earlier run has left the tread and the load at rest is not known.
        let is_loaded = self.is_loaded();
        let forgets = (FORGETS * rig.tread.tau_s / TICK_S) as usize;
        let starting = |ticks: &Range<usize>| {
            let after = |start: usize| ticks.start < moving + start;
            if is_loaded { after(forgets) } else { after(STARTING) && ticks.end > moving }
        };
        // The instant at which grip ends is ill-conditioned, and from there on the wheel
        // grips and slips by turns: nothing that can be followed tick by tick.
        let slip = self.onset_of_slip(record);
        self.slips = slip.is_some();
        let slipping = |ticks: &Range<usize>| slip.is_some_and(|onset| ticks.end > onset);
        let rings = |turn_rad_s: f64| {
            let hz = (turn_rad_s * radius).abs() / rig.drive.ripple_pitch_mm;
            rig.drive.modes_hz.iter().any(|mode| (hz / mode - 1.0).abs() < NEAR_MODE)
        };
        self.bins = ranges(&self.span, BIN)
            .map(|ticks| {
                let of = &samples[ticks.clone()];
                let arms: Vec<f64> = of.iter().filter_map(|s| s.arm_rad).collect();
                let pressed = self.preload_n[ticks.start] > LEAST_PRELOAD_N;
                Bin {
                    preload_n: mean(of, |s| s.preload_n) - self.preload_zero.value,
                    pressed,
                    compression_mm: mean(of, |s| s.compression_mm) - self.compression_zero.value,
                    arm_rad: (!arms.is_empty())
                        .then(|| arms.iter().sum::<f64>() / arms.len() as f64),
                    used: pressed
                        && !rings(speed(&ticks))
                        && !starting(&ticks)
                        && !slipping(&ticks),
                    ticks,
                }
            })
            .collect();
        let limit = MOST_PART_OF_LIMIT * rig.drive.force_limit_n;
        self.efforts = ranges(&(moving..self.span.end), EFFORT_BIN)
            .map(|ticks| {
                let of = &samples[ticks.clone()];
                let duty = mean(of, |s| s.drive);
                let turn_rad_s = speed(&ticks);
                let mid = (ticks.start + ticks.end) / 2;
                let (first, second) = (speed(&(ticks.start..mid)), speed(&(mid..ticks.end)));
                let gain_rad_s2 = (second - first) / (0.5 * ticks.len() as f64 * TICK_S);
                let force = |s: &Sample| {
                    let loss = turn_rad_s * radius / rig.drive.no_load_speed_mm_s;
                    rig.drive.stall_force_n * (s.drive - loss)
                };
                let free = of.iter().all(|s| s.drive_on && force(s).abs() < limit);
                let turning = turn_rad_s.abs() * radius > 0.5;
                let steady = (gain_rad_s2 * radius).abs() < MOST_ACCELERATION;
                let used = free && turning && steady && !starting(&ticks) && !slipping(&ticks);
                Effort { ticks, duty, turn_rad_s, gain_rad_s2, used }
            })
            .collect();
    }
}

/// The complete bins of a span.
fn ranges(span: &Range<usize>, length: usize) -> impl Iterator<Item = Range<usize>> + use<> {
    let (start, count) = (span.start, span.len() / length);
    (0..count).map(move |i| start + i * length..start + (i + 1) * length)
}

fn mean(samples: &[Sample], of: impl Fn(&Sample) -> f64) -> f64 {
    samples.iter().map(of).sum::<f64>() / samples.len() as f64
}

/// These readings at rest, none if they show a preload that an earlier run has left.
fn unloaded(idle: &[Sample]) -> &[Sample] {
    let shows = |of: fn(&Sample) -> f64, most: f64| mean(idle, of).abs() < most;
    let is_free = shows(|s| s.preload_n, UNLOADED.0) && shows(|s| s.compression_mm, UNLOADED.1);
    if is_free { idle } else { &[] }
}

fn zero(idle: &[Sample], of: impl Fn(&Sample) -> f64) -> Zero {
    let count = idle.len();
    if count < LEAST_UNLOADED {
        return Zero::default();
    }
    let n = count as f64;
    let value = mean(idle, &of);
    let square = idle.iter().map(|s| (of(s) - value).powi(2)).sum::<f64>();
    Zero { value, error: (square / (n - 1.0) / n).sqrt(), count }
}

/// Turn at every tick, counts: linear between the instants at which the count changed,
/// smoothed, at rest until the drive is switched on.
fn turn(samples: &[Sample], moving: usize) -> Vec<f64> {
    let first = samples.first().map_or(0.0, |s| s.counts);
    let mut knots = vec![(moving as f64, first)];
    for n in moving.max(1)..samples.len() {
        let (before, now) = (samples[n - 1].counts, samples[n].counts);
        if before != now {
            // Mean of the edges passed, half a tick ago.
            knots.push((n as f64 - 0.5, 0.5 * (before + now + 1.0)));
        }
    }
    let mut next = 0;
    let linear: Vec<f64> = (0..samples.len())
        .map(|n| {
            let t = n as f64;
            while next < knots.len() && knots[next].0 <= t {
                next += 1;
            }
            match (next.checked_sub(1).map(|i| knots[i]), knots.get(next)) {
                (None, _) => first,
                (Some(a), None) => a.1,
                (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0),
            }
        })
        .collect();
    let mut smooth = smoothed(&linear, SMOOTH_TURN);
    smooth[..=moving.min(samples.len() - 1)].fill(first);
    smooth.iter_mut().for_each(|counts| *counts -= first);
    smooth
}

/// Triangular mean over so many ticks to both sides, less at the ends.
fn smoothed(values: &[f64], most: usize) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..values.len())
        .map(|n| {
            let reach = most.min(n).min(last - n);
            let weight = |k: usize| (reach + 1 - k.abs_diff(reach)) as f64;
            let sum: f64 = (0..=2 * reach).map(|k| weight(k) * values[n - reach + k]).sum();
            sum / ((reach + 1) * (reach + 1)) as f64
        })
        .collect()
}

/// `values` at a place between two of them; the ends beyond.
pub(super) fn at(values: &[f64], place: f64) -> f64 {
    let last = values.len() - 1;
    let place = place.clamp(0.0, last as f64);
    let (index, part) = (place as usize, place.fract());
    values[index] + part * (values[(index + 1).min(last)] - values[index])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;
    use proptest::prelude::*;

    /// Ticks of a wheel that turns as `counts` has it, from tick 100 on.
    fn turning(length: usize, counts: impl Fn(f64) -> f64) -> Vec<Sample> {
        (0..length)
            .map(|n| {
                let t = (n as f64 - 100.0).max(0.0) * TICK_S;
                Sample { counts: counts(t).floor(), drive_on: n >= 100, ..Sample::default() }
            })
            .collect()
    }

    proptest! {
        /// Known to a third of a count at any speed of the drive, in both directions. At a
        /// count a tick the edges keep their place within the tick, which no reading shows:
        /// half a count.
        #[test]
        fn the_turn_is_known_finer_than_a_count(per_s in 100.0f64..1600.0, back in any::<bool>()) {
            let sign = if back { -1.0 } else { 1.0 };
            let travel = |t: f64| sign * per_s * (t - 0.05 * (1.0 - (-t / 0.05).exp()));
            let samples = turning(1500, travel);
            let turn = turn(&samples, 100);
            let square: f64 = (400..1400)
                .map(|n| (turn[n] - travel((n as f64 - 100.0) * TICK_S)).powi(2))
                .sum();
            let off = (square / 1000.0).sqrt();
            let drifts = (per_s * TICK_S - 1.0).abs() * 1000.0;
            prop_assert!(off < if drifts < 0.5 { 0.5 } else { 0.35 }, "{off}");
            prop_assert!(turn[..=100].iter().all(|turn| *turn == 0.0));
        }

        #[test]
        fn smoothing_keeps_a_straight_line(from in -9.0f64..9.0, rate in -9.0f64..9.0) {
            let line: Vec<f64> = (0..40).map(|n| from + rate * f64::from(n)).collect();
            for (smooth, straight) in smoothed(&line, 6).iter().zip(&line) {
                prop_assert!((smooth - straight).abs() < 1e-9);
            }
            prop_assert!((at(&line, 12.25) - (from + 12.25 * rate)).abs() < 1e-9);
            prop_assert_eq!((at(&line, -3.0), at(&line, 99.0)), (line[0], line[39]));
        }
    }

    #[test]
    fn the_zero_is_the_mean_of_the_unloaded_rig() {
        let idle: Vec<Sample> = (0..400)
            .map(|n| Sample {
                preload_n: 0.2 + 0.05 * f64::from(n % 2 * 2 - 1),
                ..Sample::default()
            })
            .collect();
        let found = zero(&idle, |s| s.preload_n);
        assert!((found.value - 0.2).abs() < 1e-12 && (found.error - 0.0025).abs() < 1e-5);
        assert_eq!(zero(&idle[..10], |s| s.preload_n), Zero::default());
    }

    #[test]
    fn a_wheel_of_any_size_that_turns_at_its_corner_slips() {
        for (radius, height, from) in [(25.0, 4.0, 84.0), (100.0, 8.0, 53.8)] {
            let mut scenario = Scenario::default();
            let rig = &mut scenario.rig.rig;
            (rig.wheel_radius_mm, rig.step_height_mm) = (radius, height);
            rig.step_positions_mm = [100.0].into();
            let turns = |t: f64| 30.0 * t * 8192.0 / (TAU * radius);
            let ticked = turning(4000, turns).into_iter().zip(0..).map(|(s, n)| {
                let arm_rad = Some(if n < 3000 { 1.0 } else { 1.01 });
                (n, Sample { arm_rad, pretightener_on: true, ..s })
            });
            let record = Record::new("b", scenario, ticked).unwrap();
            let traces = Traces::of(&record).unwrap();
            let onset = traces.onset_of_slip(&record).expect("it slips");
            assert!((traces.turn_rad[onset] * radius - from).abs() < 0.2, "{onset}");
        }
    }

    #[test]
    fn a_log_without_information_is_refused() {
        let refused = |samples: Vec<Sample>| {
            let ticked = samples.into_iter().enumerate().map(|(n, s)| (n as u32, s));
            let record = Record::new("b", Scenario::default(), ticked).unwrap();
            Traces::of(&record).unwrap_err().to_string()
        };
        assert!(refused(vec![Sample::default(); 500]).contains("b: the pre-tightener was never"));
        let pressed = Sample { pretightener_on: true, ..Sample::default() };
        assert!(refused(vec![pressed; 500]).contains("the drive was never on"));
        let driven = Sample { drive_on: true, ..pressed };
        assert!(refused(vec![driven; 100]).contains("too short"));
    }
}
