//! A reading: when it was taken, whether its sensor still answers, and its low-pass.

use super::raw::Sample;
use crate::numeric::{LowPass, LowPassState};
use crate::units::{Q16, Tick};

/// A value with its time and validity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading<T> {
    /// The last good value; the type's default before there was one.
    pub value: T,
    /// When that value was taken.
    pub at: Tick,
    /// Whether it may be used.
    pub validity: Validity,
}

impl<T> Reading<T> {
    /// Ticks since the value was taken.
    pub fn age(&self, now: Tick) -> u32 {
        age(now, self.at)
    }

    /// Whether the value may be acted on.
    pub fn is_usable(&self) -> bool {
        matches!(self.validity, Validity::Valid | Validity::Held(_))
    }
}

/// Whether a value may be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validity {
    /// No reading since boot.
    #[default]
    Absent,
    /// The newest code is good.
    Valid,
    /// The newest code is bad, but the last good value is young enough.
    Held(Reason),
    /// No code has come for longer than the limit.
    Stale,
    /// Codes arrive, but no good one for longer than the limit.
    Invalid(Reason),
}

/// What is wrong with a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Outside the range of an intact sensor or the arm's reach.
    OutOfRange,
    /// A larger change than the mechanism can make.
    Implausible,
    /// The frame's parity is wrong.
    Parity,
    /// The sensor reports an error of its own.
    SensorError,
    /// The angle sensor has no magnet in range.
    NoField,
}

/// Ticks from `at` to `now`. A time stamp up to a second ahead counts as zero: a sensor task may
/// run between two ticks.
pub const fn age(now: Tick, at: Tick) -> u32 {
    let age = now.wrapping_sub(at);
    if age > u32::MAX - 1000 { 0 } else { age }
}

/// History of one sensor's codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Freshness {
    /// Time of the last code, good or bad.
    pub(super) newest: Option<Tick>,
    /// Time of the last good code.
    pub(super) good: Option<Tick>,
    fault: Option<Reason>,
}

impl Freshness {
    /// The sample, if it is not the one already seen.
    pub fn take<T>(&mut self, sample: Option<Sample<T>>) -> Option<Sample<T>> {
        let sample = sample?;
        if self.newest == Some(sample.at) {
            return None;
        }
        self.newest = Some(sample.at);
        Some(sample)
    }

    /// Judges the code taken last.
    pub fn judge(&mut self, verdict: Result<(), Reason>) {
        self.fault = verdict.err();
        if self.fault.is_none() {
            self.good = self.newest;
        }
    }

    /// `value` as a reading at `now`, with `limit` as the largest age, ticks.
    pub fn reading<T>(&self, value: T, now: Tick, limit: u32) -> Reading<T> {
        let young = |at: Tick| age(now, at) <= limit;
        let validity = match (self.newest, self.fault) {
            (None, _) => Validity::Absent,
            (Some(newest), _) if !young(newest) => Validity::Stale,
            (_, None) => Validity::Valid,
            (_, Some(reason)) if self.good.is_some_and(young) => Validity::Held(reason),
            (_, Some(reason)) => Validity::Invalid(reason),
        };
        Reading { value, at: self.good.unwrap_or_default(), validity }
    }
}

/// A reading, and its value through a low-pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filtered {
    /// The newest good value.
    pub reading: Reading<Q16>,
    /// The same through the low-pass.
    pub filtered: Q16,
}

/// A sensor's last good value and its low-pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LastGood {
    freshness: Freshness,
    pub(super) value: Q16,
    /// None before the first good value.
    filter: Option<LowPassState>,
}

impl LastGood {
    /// Takes a sample that is new; whether it is good.
    pub(super) fn take<T>(
        &mut self,
        sample: Option<Sample<T>>,
        decode: impl FnOnce(T) -> Result<Q16, Reason>,
    ) -> bool {
        let Some(sample) = self.freshness.take(sample) else { return false };
        let verdict = decode(sample.code);
        self.value = verdict.unwrap_or(self.value);
        self.freshness.judge(verdict.map(|_| ()));
        verdict.is_ok()
    }

    /// One tick of the filter, on the held value whatever the jitter of the samples; both outputs
    /// less `offset`. `limit` is the largest age, ticks.
    pub(super) fn step(&mut self, pass: &LowPass, offset: Q16, now: Tick, limit: u32) -> Filtered {
        let filtered = match &mut self.filter {
            Some(filter) => pass.step(filter, self.value),
            none => {
                *none = self.freshness.good.map(|_| LowPassState::at(self.value));
                self.value
            }
        };
        Filtered {
            reading: self.freshness.reading(self.value - offset, now, limit),
            filtered: filtered - offset,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: u32 = 20;

    fn validity(freshness: &Freshness, now: Tick) -> Validity {
        freshness.reading((), now, LIMIT).validity
    }

    fn sample(at: Tick) -> Option<Sample<()>> {
        Some(Sample { code: (), at })
    }

    #[test]
    fn a_reading_ages_from_valid_to_stale() {
        let mut freshness = Freshness::default();
        assert_eq!(validity(&freshness, 0), Validity::Absent);
        assert!(freshness.take(sample(5)).is_some());
        freshness.judge(Ok(()));
        assert_eq!(validity(&freshness, 5), Validity::Valid);
        assert_eq!(validity(&freshness, 25), Validity::Valid);
        assert_eq!(validity(&freshness, 26), Validity::Stale);
        assert_eq!(freshness.reading((), 26, LIMIT).age(26), 21);
    }

    #[test]
    fn bad_codes_hold_the_last_good_value_and_then_invalidate_it() {
        let mut freshness = Freshness::default();
        freshness.take(sample(100));
        freshness.judge(Ok(()));
        for at in 101..200 {
            freshness.take(sample(at));
            freshness.judge(Err(Reason::Parity));
            let expected = if at <= 120 {
                Validity::Held(Reason::Parity)
            } else {
                Validity::Invalid(Reason::Parity)
            };
            let reading = freshness.reading((), at, LIMIT);
            assert_eq!(reading.validity, expected);
            assert_eq!(reading.is_usable(), at <= 120);
            assert_eq!(reading.at, 100);
        }
        freshness.take(sample(200));
        freshness.judge(Ok(()));
        assert_eq!(validity(&freshness, 200), Validity::Valid);
    }

    #[test]
    fn time_wraps_and_may_run_ahead() {
        assert_eq!(age(3, u32::MAX - 1), 5);
        assert_eq!(age(7, 8), 0);
        assert_eq!(age(0, 1000), 0);
        assert_eq!(age(8, 7), 1);
    }
}
