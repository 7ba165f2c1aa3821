//! Travel and speed from the wheel encoder.

use super::freshness::{Freshness, Reading, Reason, age};
use super::raw::{EncoderCount, Sample};
use crate::numeric::checked;
use crate::rig::{Rig, RigError};
use crate::units::{MillimetresPerSecond, MillimetresPerSecond2, Q16, Tick, Travel};

/// Default bandwidth of the observer, rad/s. Chosen: the fastest that keeps the
/// ripple of the counts within 1 % from 3 to 30 mm/s, also where counts and ticks
/// beat (3.19 mm/s is a count every sixth tick, nearly).
pub const BANDWIDTH_RAD_S: f64 = 23.0;

/// Speed above which a change of the counter counts as a disturbance, mm/s, unless the motor
/// reaches more than half of it.
const IMPLAUSIBLE_MM_S: f64 = 200.0;

/// Longest gap between samples that the plausibility check scales with, ticks:
/// beyond it the counter may have wrapped.
const LONGEST_GAP: u32 = 1000;

/// Travel and speed of the wheel: exact odometry and a tracking observer.
///
/// Travel is `counts x 2 pi R / counts_per_turn`, summed without rounding. The observer, once a
/// tick T with the profile's acceleration a: `e += dz - (v T + a T^2/2)`,
/// `v += a T + (1 - p)^2 e / T`, `e -= (1 - p^2) e`, `p = exp(-w T)`: both poles at the
/// bandwidth w. An acceleration error da appears as a speed error of 2 da / w.
///
/// Positive in the direction of deployment; mm and mm/s, to +-2000 mm/s. Error: travel 2e-8
/// relative beside one count (0.0192 mm); speed, with w = 23 rad/s, 1 % peak from 3 to 30 mm/s
/// where counts and ticks beat, bias 0.01 %, 0.1 mm/s through an S-curve of 250 mm/s^2.
/// Source: the critically damped g-h filter (Benedict and Bordner 1962).
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Speedometer {
    /// Travel of one count, mm, Q32.
    count: i64,
    /// `1 - p^2`, Q30.
    position_gain: i32,
    /// `(1 - p)^2`, Q30.
    speed_gain: i32,
    /// Most counts in a tick, Q8.
    plausible: u32,
}

/// State of a [`Speedometer`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SpeedState {
    freshness: Freshness,
    count: EncoderCount,
    travel: Travel,
    /// Measured minus tracked position, mm, Q48.
    error: i64,
    /// Tracked speed, mm per tick, Q48.
    speed: i64,
}

/// What a [`Speedometer`] gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motion {
    /// Travel since the first sample, mm, exact.
    pub travel: Travel,
    /// Speed, with the time and validity of the counter.
    pub speed: Reading<MillimetresPerSecond>,
}

/// Largest tracked speed, mm per tick, Q48.
const SPEED_LIMIT: i64 = 2 << 48;

impl Speedometer {
    /// The encoder of `rig` with an observer of `bandwidth_rad_s`.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig, bandwidth_rad_s: f64) -> Result<Self, RigError> {
        let turn_mm = 2.0 * core::f64::consts::PI * rig.rig.wheel_radius_mm;
        let count_mm = turn_mm / rig.sense.encoder_counts;
        checked("sense.encoder_counts", count_mm)?;
        let pole = libm::exp(-bandwidth_rad_s / f64::from(crate::units::TICK_HZ));
        let q30 = |gain: f64| libm::round(gain * f64::from(1_u32 << 30)) as i32;
        let fastest_mm_s = IMPLAUSIBLE_MM_S.max(2.0 * rig.drive.no_load_speed_mm_s);
        let plausible = fastest_mm_s / f64::from(crate::units::TICK_HZ) / count_mm;
        Ok(Self {
            count: libm::round(count_mm * 4_294_967_296.0) as i64,
            position_gain: q30(1.0 - pole * pole),
            speed_gain: q30((1.0 - pole) * (1.0 - pole)),
            plausible: libm::ceil(plausible * 256.0) as u32,
        })
    }

    /// One tick with the latest sample, new or not; `acceleration` is that of the profile in
    /// this tick, `limit` the largest age, ticks.
    pub fn step(
        &self,
        state: &mut SpeedState,
        now: Tick,
        sample: Option<Sample<EncoderCount>>,
        acceleration: MillimetresPerSecond2,
        limit: u32,
    ) -> Motion {
        predict(state, acceleration);
        let before = state.freshness.newest;
        if let Some(sample) = state.freshness.take(sample) {
            self.correct(state, now, sample, before, limit);
        }
        let speed = state.freshness.reading(speed_mm_s(state.speed), now, limit);
        Motion { travel: state.travel, speed }
    }

    /// Takes a new sample into odometry and observer, unless the counter changed faster than the
    /// wheel can turn. After one jump it stays invalid: the travel in between is lost.
    fn correct(
        &self,
        state: &mut SpeedState,
        now: Tick,
        sample: Sample<EncoderCount>,
        newest: Option<Tick>,
        limit: u32,
    ) {
        let Some((before, newest)) = state.freshness.good.zip(newest) else {
            state.count = sample.code;
            (state.error, state.speed) = (0, 0);
            state.freshness.judge(Ok(()));
            return;
        };
        let counts = i32::from(sample.code.since(state.count));
        let gap = age(sample.at, before).clamp(1, LONGEST_GAP);
        let since = age(sample.at, newest).clamp(1, LONGEST_GAP);
        if counts.unsigned_abs() > ((self.plausible * since) >> 8) + 1 {
            state.freshness.judge(Err(Reason::Implausible));
            return;
        }
        state.freshness.judge(Ok(()));
        state.count = sample.code;
        let moved = i64::from(counts) * self.count;
        state.travel = state.travel.saturating_add(Travel::from_bits(moved));
        if gap > limit {
            // Too long without a correction: start again.
            (state.error, state.speed) = (0, 0);
            return;
        }
        state.error += moved << 16;
        // A sample a few ticks old is compared with the position at that time.
        let late = i64::from(age(now, sample.at).min(limit));
        let innovation = state.error + state.speed * late;
        // Q48 to Q28; beyond 8 mm the correction is bounded.
        let innovation = (innovation >> 20).clamp(i32::MIN.into(), i32::MAX.into());
        state.error -= (innovation * i64::from(self.position_gain)) >> 10;
        state.speed += (innovation * i64::from(self.speed_gain)) >> 10;
        state.speed = state.speed.clamp(-SPEED_LIMIT, SPEED_LIMIT);
    }
}

/// Advances the tracked position and speed by a tick.
fn predict(state: &mut SpeedState, acceleration: MillimetresPerSecond2) {
    // 1e-6 s^2 in Q48: mm/s^2 in Q16 to mm/tick^2 in Q48.
    const TICK_SQUARED: i64 = 281_474_977;
    let gained = (i64::from(acceleration.to_bits()) * TICK_SQUARED) >> 16;
    let moved = state.speed + (gained >> 1);
    state.error = (state.error - moved).clamp(-ERROR_LIMIT, ERROR_LIMIT);
    state.speed = (state.speed + gained).clamp(-SPEED_LIMIT, SPEED_LIMIT);
}

/// Largest tracking error kept, mm, Q48: far beyond what a correction uses.
const ERROR_LIMIT: i64 = 4096 << 48;

/// mm per tick, Q48, as mm/s.
fn speed_mm_s(speed: i64) -> MillimetresPerSecond {
    let bits = ((speed >> 16) * i64::from(crate::units::TICK_HZ) + (1 << 15)) >> 16;
    Q16::saturating_from_bits(bits)
}

#[cfg(test)]
mod tests {
    use super::super::freshness::Validity;
    use super::*;
    use proptest::prelude::*;

    const LIMIT: u32 = 20;

    fn build() -> Speedometer {
        Speedometer::try_build(&Rig::prototype(), BANDWIDTH_RAD_S).expect("in range")
    }

    fn count_mm() -> f64 {
        2.0 * core::f64::consts::PI * 25.0 / 8192.0
    }

    fn sample(position_mm: f64, at: Tick) -> Option<Sample<EncoderCount>> {
        let counts = (position_mm / count_mm()).floor() as i64;
        Some(Sample { code: EncoderCount::new(counts as u16), at })
    }

    /// One tick with the wheel at this position, mm.
    fn read(meter: &Speedometer, state: &mut SpeedState, now: Tick, position: f64) -> Motion {
        meter.step(state, now, sample(position, now), Default::default(), LIMIT)
    }

    /// Runs at constant speed and gives the mean relative error and the largest, after settling.
    fn steady(meter: &Speedometer, speed_mm_s: f64) -> (f64, f64) {
        let mut state = SpeedState::default();
        let (mut sum, mut worst) = (0.0_f64, 0.0_f64);
        let (settle, total) = (1000, 21_000_u32);
        for now in 0..total {
            let position = 0.003 + speed_mm_s * f64::from(now) * 1e-3;
            let motion = read(meter, &mut state, now, position);
            if now >= settle {
                let error = motion.speed.value.to_num::<f64>() / speed_mm_s - 1.0;
                sum += error;
                worst = worst.max(error.abs());
            }
        }
        (sum / f64::from(total - settle), worst)
    }

    #[test]
    fn steady_speed_has_no_bias_and_little_ripple() {
        let meter = build();
        for (speed, bound) in [
            (3.0, 4e-3),
            (-3.0, 4e-3),
            (3.7, 4e-3),
            (5.0, 3e-3),
            (8.0, 2e-3),
            (-17.3, 1e-3),
            (30.0, 4e-4),
        ] {
            let (bias, worst) = steady(&meter, speed);
            assert!(bias.abs() <= 1e-4, "{speed}: bias {bias}");
            assert!(worst <= bound, "{speed}: {worst}");
        }
    }

    #[test]
    fn beats_of_counts_and_ticks_stay_within_a_percent() {
        let meter = build();
        let mut worst = 0.0_f64;
        for ticks_per_count in [6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 2.0 / 3.0] {
            for detuning in [-4e-3, -2e-3, -1e-3, -5e-4, 5e-4, 1e-3, 2e-3, 4e-3] {
                let speed = count_mm() / (ticks_per_count * 1e-3) * (1.0 + detuning);
                let (bias, ripple) = steady(&meter, speed);
                assert!(bias.abs() <= 1e-4, "{speed}: bias {bias}");
                worst = worst.max(ripple);
            }
        }
        // The beat is there, and bounded.
        assert!((0.005..=0.01).contains(&worst), "{worst}");
    }

    #[test]
    fn travel_is_exact_whatever_the_distance() {
        let meter = build();
        let mut state = SpeedState::default();
        let mut counts = 0_i64;
        for now in 0..600_000_u32 {
            counts += if now % 3 == 0 { 5 } else { 4 };
            let sample = Some(Sample { code: EncoderCount::new(counts as u16), at: now });
            let motion = meter.step(&mut state, now, sample, Default::default(), LIMIT);
            if now == 599_999 {
                // The first count only sets the origin.
                let exact = (counts - 5) as f64 * count_mm();
                let got = motion.travel.to_num::<f64>();
                assert!((got - exact).abs() <= exact * 2e-8, "{got} {exact}");
            }
        }
    }

    #[test]
    fn an_s_curve_is_followed_without_lag() {
        let meter = build();
        let mut state = SpeedState::default();
        // 5000 mm/s^3 up to 250 mm/s^2 and down again: 0 to 30 mm/s in 170 ms.
        let (jerk, ramp, hold) = (5000.0, 50, 70);
        let (mut acceleration, mut speed, mut position) = (0.0, 0.0, 0.003);
        let mut worst = 0.0_f64;
        for now in 0..600_u32 {
            let slope = if now < ramp {
                jerk
            } else if (ramp + hold..2 * ramp + hold).contains(&now) {
                -jerk
            } else {
                0.0
            };
            let before = acceleration;
            acceleration += slope * 1e-3;
            let mean = 0.5 * (before + acceleration);
            let input = MillimetresPerSecond2::from_num(mean);
            position += speed * 1e-3 + 0.5 * mean * 1e-6;
            speed += mean * 1e-3;
            let motion = meter.step(&mut state, now, sample(position, now), input, LIMIT);
            worst = worst.max((motion.speed.value.to_num::<f64>() - speed).abs());
        }
        assert!((speed - 30.0).abs() < 1e-6, "{speed}");
        assert!(worst <= 0.1, "{worst}");
    }

    #[test]
    fn a_wrong_acceleration_shows_as_predicted() {
        let meter = build();
        let mut state = SpeedState::default();
        let (mut speed, mut position) = (0.0, 0.003);
        let mut error = 0.0;
        for now in 0..1000_u32 {
            position += speed * 1e-3 + 0.5 * 100.0 * 1e-6;
            speed += 100.0 * 1e-3;
            let motion = meter.step(
                &mut state,
                now,
                sample(position, now),
                MillimetresPerSecond2::from_num(90),
                LIMIT,
            );
            error = speed - motion.speed.value.to_num::<f64>();
        }
        let predicted = 2.0 * 10.0 / BANDWIDTH_RAD_S;
        assert!((error - predicted).abs() <= 0.05 * predicted, "{error}");
    }

    #[test]
    fn samples_that_come_late_or_every_other_tick_leave_no_error() {
        let meter = build();
        for (every, delay) in [(1, 1), (2, 0), (2, 1), (3, 2), (10, 0)] {
            let mut state = SpeedState::default();
            let mut sum = 0.0;
            for now in 10..5010_u32 {
                let at = (now - delay) / every * every;
                let position = 20.0 * f64::from(at) * 1e-3;
                let motion =
                    meter.step(&mut state, now, sample(position, at), Default::default(), LIMIT);
                if now >= 2010 {
                    sum += motion.speed.value.to_num::<f64>() - 20.0;
                }
            }
            let bias = sum / 3000.0;
            assert!(bias.abs() <= 20.0 * 1e-3, "every {every}, delay {delay}: {bias}");
        }
    }

    #[test]
    fn a_jump_is_refused_and_leaves_no_trace() {
        let meter = build();
        let mut state = SpeedState::default();
        for now in 0..1000_u32 {
            let position = 8e-3 * f64::from(now);
            let glitch = if now == 700 { 30.0 } else { 0.0 };
            let motion = read(&meter, &mut state, now, position + glitch);
            if now == 700 {
                assert_eq!(motion.speed.validity, Validity::Held(Reason::Implausible));
            } else {
                assert_eq!(motion.speed.validity, Validity::Valid);
            }
            if now >= 690 {
                assert!((motion.speed.value.to_num::<f64>() - 8.0).abs() <= 0.02);
                assert!((motion.travel.to_num::<f64>() - position).abs() <= 0.03);
            }
        }
    }

    #[test]
    fn a_counter_that_jumped_becomes_invalid() {
        let meter = build();
        let mut state = SpeedState::default();
        for now in 0..100_u32 {
            read(&meter, &mut state, now, 0.0);
        }
        for now in 100..130_u32 {
            let motion = read(&meter, &mut state, now, 300.0);
            let expected = if now < 120 {
                Validity::Held(Reason::Implausible)
            } else {
                Validity::Invalid(Reason::Implausible)
            };
            assert_eq!(motion.speed.validity, expected, "{now}");
        }
    }

    #[test]
    fn the_limit_of_plausibility_is_eleven_counts_a_tick() {
        let meter = build();
        for (counts, good) in [(11, true), (-11, true), (12, false), (-12, false)] {
            let mut state = SpeedState::default();
            let at = |code: i32, at| Some(Sample { code: EncoderCount::new(code as u16), at });
            meter.step(&mut state, 0, at(0, 0), Default::default(), LIMIT);
            let motion = meter.step(&mut state, 1, at(counts, 1), Default::default(), LIMIT);
            assert_eq!(motion.speed.validity == Validity::Valid, good, "{counts}");
        }
    }

    proptest! {
        #[test]
        fn no_sequence_panics(
            inputs in prop::collection::vec(any::<(u16, u32, i32)>(), 1..300),
        ) {
            let meter = build();
            let mut state = SpeedState::default();
            for (code, at, acceleration) in inputs {
                let acceleration = Q16::from_bits(acceleration);
                let sample = Some(Sample { code: EncoderCount::new(code), at });
                meter.step(&mut state, at.wrapping_add(2), sample, acceleration, LIMIT);
            }
        }
    }

    #[test]
    fn a_gap_within_the_limit_is_bridged_and_after_a_longer_one_the_observer_starts_again() {
        let after = |gap: u32| {
            let meter = build();
            let mut state = SpeedState::default();
            let step = |state: &mut SpeedState, now: Tick, at: Tick| {
                let position = 10.0e-3 * f64::from(at);
                meter.step(state, now, sample(position, at), Default::default(), LIMIT)
            };
            for now in 0..2000 {
                step(&mut state, now, now);
            }
            for now in 2000..1999 + gap {
                step(&mut state, now, 1999);
            }
            step(&mut state, 1999 + gap, 1999 + gap).speed.value.to_num::<f64>()
        };
        for gap in [1, 2, LIMIT - 1, LIMIT] {
            assert!((after(gap) - 10.0).abs() < 1.0, "{gap}: {}", after(gap));
        }
        assert!(after(LIMIT + 1).abs() < 1e-9);
    }

    #[test]
    fn twice_the_motor_s_speed_is_still_plausible() {
        let mut rig = Rig::prototype();
        rig.drive.no_load_speed_mm_s = 2.0 * IMPLAUSIBLE_MM_S;
        let meter = Speedometer::try_build(&rig, BANDWIDTH_RAD_S).expect("in range");
        let believed = |part: f64| {
            let mut state = SpeedState::default();
            let step_mm = part * rig.drive.no_load_speed_mm_s * 1e-3;
            (0..50).all(|now| {
                let at = sample(step_mm * f64::from(now), now);
                let motion = meter.step(&mut state, now, at, Default::default(), LIMIT);
                motion.speed.validity == Validity::Valid
            })
        };
        assert!(believed(1.0) && believed(1.9) && believed(-1.9));
        assert!(!believed(3.0) && !believed(-3.0));
    }
}
