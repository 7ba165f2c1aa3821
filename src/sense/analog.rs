//! A linear sensor behind the converter: code to quantity, zero, range, filter.

use super::freshness::{Filtered, LastGood, Reason};
use super::raw::{AdcCode, Sample};
use crate::numeric::LowPass;
use crate::rig::RigError;
use crate::units::{Q16, Tick};

/// Part of the converter at zero.
pub const ZERO_AT: f64 = 0.05;
/// Part of the converter at full scale.
pub const FULL_AT: f64 = 0.90;
/// Least part of the converter of an intact bridge.
pub const BROKEN_BELOW: f64 = 0.02;
/// Largest part of the converter of an intact bridge.
pub const BROKEN_ABOVE: f64 = 0.98;
/// Largest zero correction, part of full scale: it stays clear of [`BROKEN_BELOW`].
pub const ZERO_LIMIT: f64 = 0.03;
/// Samples in the mean of a zero, a power of two.
pub const ZERO_SAMPLES: u32 = 1 << ZERO_SHIFT;
const ZERO_SHIFT: u32 = 8;

/// Largest code.
const CODE_SPAN: f64 = 65_535.0;

/// A linear sensor: `value = (code - zero) gain - offset`, with the offset taken by averaging
/// [`ZERO_SAMPLES`] codes of the unloaded sensor.
///
/// Unit: that of the full scale. Range: -3.5 % to 109 % of it; beyond, the code is
/// [`Reason::OutOfRange`] and the last value is held. Error: 0.5 LSB, 0.002 codes, and
/// `1.3e-5 x 0.5 / full scale` relative.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct AnalogChannel {
    /// Code of the zero, times 2^8.
    zero: i32,
    /// Units per code, times 2^32.
    gain: i32,
    /// Least and largest code of an intact bridge.
    low: u16,
    high: u16,
    /// Largest zero correction, units.
    pub(super) zero_limit: Q16,
    filter: LowPass,
}

/// State of an [`AnalogChannel`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogState {
    /// Before the offset.
    uncorrected: LastGood,
    pub(super) offset: Q16,
    pub(super) zeroing: Zeroing,
}

/// Progress of taking the zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Zeroing {
    /// Not asked for.
    #[default]
    Off,
    /// Running.
    Running {
        /// Sum of the values so far, LSB.
        sum: i64,
        /// Number of values so far.
        count: u32,
    },
    /// Taken and applied.
    Done,
    /// The mean is too far from the nominal zero; the offset before still applies.
    Rejected,
}

impl AnalogChannel {
    /// A sensor of full scale `full_scale`, the value of the parameter `key`, with
    /// a low-pass of time constant `tau_s`.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(key: &'static str, full_scale: f64, tau_s: f64) -> Result<Self, RigError> {
        let (min, max) = (0.1, 20_000.0);
        if !(full_scale >= min && full_scale <= max) {
            return Err(RigError::OutOfRange { key, value: full_scale, min, max });
        }
        let gain = full_scale / ((FULL_AT - ZERO_AT) * CODE_SPAN);
        Ok(Self {
            zero: libm::round(ZERO_AT * CODE_SPAN * 256.0) as i32,
            gain: libm::round(gain * 4_294_967_296.0) as i32,
            low: libm::ceil(BROKEN_BELOW * CODE_SPAN) as u16,
            high: libm::floor(BROKEN_ABOVE * CODE_SPAN) as u16,
            zero_limit: crate::numeric::checked(key, ZERO_LIMIT * full_scale)?,
            filter: LowPass::build(tau_s),
        })
    }

    /// One tick with the latest sample, new or not; `limit` is the largest age, ticks.
    pub fn step(
        &self,
        state: &mut AnalogState,
        now: Tick,
        sample: Option<Sample<AdcCode>>,
        limit: u32,
    ) -> Filtered {
        if state.uncorrected.take(sample, |code| self.value(code.get())) {
            self.accumulate(state);
        }
        state.uncorrected.step(&self.filter, state.offset, now, limit)
    }

    /// The code of an intact bridge in units, before the offset.
    fn value(&self, code: u16) -> Result<Q16, Reason> {
        if !(self.low..=self.high).contains(&code) {
            return Err(Reason::OutOfRange);
        }
        let above = i64::from((i32::from(code) << 8) - self.zero);
        // Q8 x Q32 = Q40 to Q16, rounded.
        let bits = (above * i64::from(self.gain) + (1 << 23)) >> 24;
        Ok(Q16::saturating_from_bits(bits))
    }

    fn accumulate(&self, state: &mut AnalogState) {
        let Zeroing::Running { sum, count } = &mut state.zeroing else {
            return;
        };
        *sum += i64::from(state.uncorrected.value.to_bits());
        *count += 1;
        if *count < ZERO_SAMPLES {
            return;
        }
        let mean = (*sum + i64::from(ZERO_SAMPLES / 2)) >> ZERO_SHIFT;
        let offset = Q16::from_bits(mean as i32);
        state.zeroing = if offset.abs() <= self.zero_limit {
            state.offset = offset;
            Zeroing::Done
        } else {
            Zeroing::Rejected
        };
    }
}

impl AnalogState {
    /// Starts averaging the zero from the next good code on.
    pub fn begin_zero(&mut self) {
        self.zeroing = Zeroing::Running { sum: 0, count: 0 };
    }
}

#[cfg(test)]
mod tests {
    use super::super::freshness::Validity;
    use super::*;
    use proptest::prelude::*;

    const LIMIT: u32 = 20;
    const LSB: f64 = 1.0 / 65_536.0;

    fn channel() -> AnalogChannel {
        AnalogChannel::try_build("k", 200.0, 0.005).expect("in range")
    }

    fn sample(code: u16, at: Tick) -> Option<Sample<AdcCode>> {
        Some(Sample { code: AdcCode::new(code), at })
    }

    fn code_of(value: f64, full_scale: f64) -> u16 {
        (CODE_SPAN * (ZERO_AT + (FULL_AT - ZERO_AT) * value / full_scale)).round() as u16
    }

    #[test]
    fn every_code_of_every_full_scale_is_right() {
        for full_scale in [0.5, 5.0, 20.0, 200.0, 2000.0] {
            let channel = AnalogChannel::try_build("k", full_scale, 0.0).expect("in range");
            let per_code = full_scale / ((FULL_AT - ZERO_AT) * CODE_SPAN);
            for code in 0..=u16::MAX {
                let mut state = AnalogState::default();
                let output = channel.step(&mut state, 1, sample(code, 1), LIMIT);
                let part = f64::from(code) / CODE_SPAN;
                if (BROKEN_BELOW..=BROKEN_ABOVE).contains(&part) {
                    let exact = (f64::from(code) - ZERO_AT * CODE_SPAN) * per_code;
                    let error = (output.reading.value.to_num::<f64>() - exact).abs();
                    // One rounding, the zero's 2^-9 code, the gain's half LSB.
                    let gain_error = 0.5 / (per_code * 4_294_967_296.0);
                    let bound = 0.501 * LSB + per_code * 2e-3 + exact.abs() * gain_error;
                    assert!(error <= bound, "{code}: {error}");
                    assert_eq!(output.reading.validity, Validity::Valid);
                } else {
                    assert_eq!(output.reading.validity, Validity::Invalid(Reason::OutOfRange));
                }
            }
        }
    }

    #[test]
    fn a_broken_bridge_holds_the_value_and_is_then_invalid() {
        let channel = channel();
        let mut state = AnalogState::default();
        let good = code_of(40.0, 200.0);
        channel.step(&mut state, 0, sample(good, 0), LIMIT);
        for (code, now) in [0, 1310, 64_226, 65_535].into_iter().zip(1..) {
            let output = channel.step(&mut state, now, sample(code, now), LIMIT);
            assert_eq!(output.reading.validity, Validity::Held(Reason::OutOfRange));
            assert!((output.reading.value.to_num::<f64>() - 40.0).abs() < 0.002);
            assert!((output.filtered.to_num::<f64>() - 40.0).abs() < 0.002);
        }
        for now in 5..=30 {
            channel.step(&mut state, now, sample(0, now), LIMIT);
        }
        let output = channel.step(&mut state, 31, sample(0, 31), LIMIT);
        assert_eq!(output.reading.validity, Validity::Invalid(Reason::OutOfRange));
    }

    #[test]
    fn the_zero_is_the_mean_of_its_samples_and_shifts_both_outputs() {
        let channel = channel();
        let mut state = AnalogState::default();
        state.begin_zero();
        // A zero 3 N up, with 0.2 N of noise that averages out.
        for now in 0..ZERO_SAMPLES {
            assert!(matches!(state.zeroing, Zeroing::Running { .. }));
            let noise = if now % 2 == 0 { 0.2 } else { -0.2 };
            channel.step(&mut state, now, sample(code_of(3.0 + noise, 200.0), now), LIMIT);
        }
        assert_eq!(state.zeroing, Zeroing::Done);
        assert!((state.offset.to_num::<f64>() - 3.0).abs() < 0.002);
        for now in 300..400 {
            channel.step(&mut state, now, sample(code_of(36.3, 200.0), now), LIMIT);
        }
        let output = channel.step(&mut state, 400, sample(code_of(36.3, 200.0), 400), LIMIT);
        assert!((output.reading.value.to_num::<f64>() - 33.3).abs() < 0.004);
        assert!((output.filtered.to_num::<f64>() - 33.3).abs() < 0.004);
    }

    #[test]
    fn a_zero_too_far_off_is_rejected() {
        let channel = channel();
        let mut state = AnalogState { offset: Q16::from_num(1), ..AnalogState::default() };
        state.begin_zero();
        for now in 0..ZERO_SAMPLES {
            channel.step(&mut state, now, sample(code_of(6.1, 200.0), now), LIMIT);
        }
        assert!(state.zeroing == Zeroing::Rejected);
        assert_eq!(state.offset, Q16::from_num(1));
    }

    #[test]
    fn repeated_and_bad_codes_do_not_count_towards_the_zero() {
        let channel = channel();
        let mut state = AnalogState::default();
        state.begin_zero();
        let good = code_of(0.0, 200.0);
        for now in 0..1000 {
            channel.step(&mut state, now, sample(good, 0), LIMIT);
        }
        for now in 1000..2000 {
            channel.step(&mut state, now, sample(0, now), LIMIT);
        }
        assert!(matches!(state.zeroing, Zeroing::Running { count: 1, .. }));
    }

    #[test]
    fn the_filter_keeps_time_when_samples_come_every_other_tick() {
        let channel = channel();
        let (mut every, mut other) = (AnalogState::default(), AnalogState::default());
        let (from, to) = (code_of(20.0, 200.0), code_of(50.0, 200.0));
        channel.step(&mut every, 0, sample(from, 0), LIMIT);
        channel.step(&mut other, 0, sample(from, 0), LIMIT);
        for now in 1..50 {
            let a = channel.step(&mut every, now, sample(to, now), LIMIT);
            let b = channel.step(&mut other, now, sample(to, now | 1), LIMIT);
            assert_eq!(a.filtered, b.filtered);
        }
    }

    proptest! {
        #[test]
        fn no_sequence_of_codes_panics(codes in prop::collection::vec(any::<(u16, u32)>(), 1..600)) {
            let channel = channel();
            let mut state = AnalogState::default();
            state.begin_zero();
            for (code, at) in codes {
                channel.step(&mut state, at.wrapping_add(3), sample(code, at), LIMIT);
            }
        }
    }

    #[test]
    fn a_full_scale_out_of_range_is_refused() {
        for sound in [0.1, 1.0, 20_000.0] {
            assert!(AnalogChannel::try_build("k", sound, 0.005).is_ok(), "{sound}");
        }
        for value in [0.0, -5.0, 0.099, 20_001.0] {
            let refused = AnalogChannel::try_build("k", value, 0.005);
            let error = RigError::OutOfRange { key: "k", value, min: 0.1, max: 20_000.0 };
            assert_eq!(refused.err(), Some(error));
        }
        assert!(AnalogChannel::try_build("k", f64::NAN, 0.005).is_err());
    }
}
