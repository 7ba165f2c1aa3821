//! The arm's angle from the magnetic encoder's frames.

use super::freshness::{Filtered, LastGood, Reason};
use super::raw::{AngleFrame, Sample};
use crate::numeric::LowPass;
use crate::units::{Q16, Tick};

/// Angle from the pillar in codes of the sensor, 16384 a turn, LSB 2^-16 code = 5.9 nrad;
/// positive outwards.
pub type Codes = Q16;

/// The error flag of a frame: something was wrong with a command, this one's or one before.
const ERROR: u16 = 1 << 14;

/// Of the sensor's diagnostics, register 0x3FFD, whose lowest eight bits are the automatic gain:
/// offset compensation finished, overflow of the angle's computation, field too strong, field too
/// weak. Source: ams, AS5048A data sheet, diagnostics.
const COMPENSATED: u16 = 1 << 8;
const OVERFLOW: u16 = 1 << 9;
const TOO_STRONG: u16 = 1 << 10;
const TOO_WEAK: u16 = 1 << 11;

/// Whether a frame has the error flag.
pub const fn is_flagged(frame: AngleFrame) -> bool {
    frame.get() & ERROR != 0
}

/// Whether the sensor's diagnostics in this frame confirm a magnet that it can measure.
///
/// # Errors
/// As [`decode`]: the frame says nothing.
pub fn field(diagnostics: AngleFrame) -> Result<bool, Reason> {
    let confirms = COMPENSATED | OVERFLOW | TOO_STRONG | TOO_WEAK;
    decode(diagnostics).map(|bits| bits & confirms == COMPENSATED)
}

/// The 14-bit code of a frame with even parity and without the error flag, bit 14.
///
/// # Errors
/// [`Reason::NoField`] for [`AngleFrame::NO_FIELD`], [`Reason::Parity`], [`Reason::SensorError`].
pub const fn decode(frame: AngleFrame) -> Result<u16, Reason> {
    if frame.get() == AngleFrame::NO_FIELD.get() {
        return Err(Reason::NoField);
    }
    let frame = frame.get();
    if !frame.count_ones().is_multiple_of(2) {
        return Err(Reason::Parity);
    }
    if frame & ERROR != 0 {
        return Err(Reason::SensorError);
    }
    Ok(frame & 0x3FFF)
}

/// The angle sensor: frame to angle, range check, low-pass. `angle = code - zero`, wrapping at
/// half a turn. Error: half a code (192 urad) of quantisation, 2 LSB of rounding.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct AngleSensor {
    /// Code of the zero; 2^32 is a turn.
    zero: u32,
    /// Least and largest angle the arm can take.
    lo: Codes,
    hi: Codes,
    filter: LowPass,
}

impl AngleSensor {
    /// A sensor reading `zero_code` with the arm along the pillar, for arms that
    /// move from `lo` to `hi`.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn build(zero_code: f64, (lo, hi): (Codes, Codes), tau_s: f64) -> Self {
        // Reduced to a turn by the cast's wrap from 64 bits.
        let zero = libm::round(zero_code * f64::from(1_u32 << 18)) as i64 as u32;
        Self { zero, lo, hi, filter: LowPass::build(tau_s) }
    }

    /// One tick with the latest sample, new or not; `limit` is the largest age, ticks.
    pub(super) fn step(
        &self,
        state: &mut LastGood,
        now: Tick,
        sample: Option<Sample<AngleFrame>>,
        limit: u32,
    ) -> Filtered {
        state.take(sample, |frame| self.within(decode(frame)?));
        state.step(&self.filter, Codes::ZERO, now, limit)
    }

    /// A code as an angle within the arm's reach.
    fn within(&self, code: u16) -> Result<Codes, Reason> {
        let angle = (u32::from(code) << 18).wrapping_sub(self.zero) as i32;
        let angle = Q16::from_bits(angle >> 2);
        if (self.lo..=self.hi).contains(&angle) { Ok(angle) } else { Err(Reason::OutOfRange) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::freshness::Validity;
    use super::*;

    const LIMIT: u32 = 20;

    /// A sound frame of a code.
    fn frame(code: u16) -> AngleFrame {
        let parity = (code.count_ones() % 2) as u16;
        AngleFrame::new(code | parity << 15)
    }

    fn sensor(zero: f64) -> AngleSensor {
        AngleSensor::build(zero, (Codes::from_num(100), Codes::from_num(4000)), 0.0)
    }

    #[test]
    fn every_frame_is_judged() {
        for bits in 0..=u16::MAX {
            let ones = (0..16).filter(|bit| bits >> bit & 1 == 1).count();
            let expected = if bits == 0xC000 {
                Err(Reason::NoField)
            } else if ones % 2 == 1 {
                Err(Reason::Parity)
            } else if bits >> 14 & 1 == 1 {
                Err(Reason::SensorError)
            } else {
                Ok(bits % 16_384)
            };
            assert_eq!(decode(AngleFrame::new(bits)), expected);
        }
    }

    #[test]
    fn the_diagnostics_confirm_a_field_in_range_alone() {
        for (bits, expected) in [
            (0x0180, Ok(true)),
            (0x01FF, Ok(true)),
            (0x0080, Ok(false)),
            (0x0380, Ok(false)),
            (0x0500, Ok(false)),
            (0x09FF, Ok(false)),
            (0x4180, Err(Reason::SensorError)),
        ] {
            assert_eq!(field(frame(bits)), expected, "{bits:#x}");
        }
        assert_eq!(field(AngleFrame::new(0x0100)), Err(Reason::Parity));
    }

    #[test]
    fn every_code_gives_its_angle_from_any_zero() {
        for zero in [0.0, 2000.0, 2000.37, 15_000.0, 16_383.0] {
            let sensor = sensor(zero);
            for code in 0..16_384 {
                let mut state = LastGood::default();
                let sample = Some(Sample { code: frame(code), at: 1 });
                let angle = sensor.step(&mut state, 1, sample, LIMIT);
                let exact = (f64::from(code) - zero + 8192.0).rem_euclid(16_384.0) - 8192.0;
                if (100.001..=3999.999).contains(&exact) {
                    assert!((angle.reading.value.to_num::<f64>() - exact).abs() <= 2.0 / 65_536.0);
                    assert_eq!(angle.reading.validity, Validity::Valid);
                } else if !(99.999..=4000.001).contains(&exact) {
                    assert_eq!(angle.reading.validity, Validity::Invalid(Reason::OutOfRange));
                }
            }
        }
    }

    #[test]
    fn bad_frames_hold_the_angle() {
        let sensor = sensor(2000.0);
        let mut state = LastGood::default();
        sensor.step(&mut state, 0, Some(Sample { code: frame(3000), at: 0 }), LIMIT);
        let parity = AngleFrame::new(frame(3500).get() ^ 1);
        let flagged = AngleFrame::new(frame(3500).get() ^ 0xC000);
        for (now, code, reason) in [(2, parity, Reason::Parity), (4, flagged, Reason::SensorError)]
        {
            let angle = sensor.step(&mut state, now, Some(Sample { code, at: now }), LIMIT);
            assert_eq!(angle.reading.validity, Validity::Held(reason));
            assert_eq!(angle.reading.value, Codes::from_num(1000));
            assert_eq!(angle.reading.at, 0);
        }
        let angle = sensor.step(&mut state, 21, Some(Sample { code: flagged, at: 20 }), LIMIT);
        assert_eq!(angle.reading.validity, Validity::Invalid(Reason::SensorError));
    }
}
