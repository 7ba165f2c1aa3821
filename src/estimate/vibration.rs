//! Vibration of the arm: an observer of its mode in the tread's compression, which swings with
//! it by 7 um per newton; the sensor's noise is 2 um.

use crate::numeric::cosine_of_turns;
use crate::rig::{Rig, RigError};
use crate::units::{Millimetres, Q16, TICK_HZ};

/// Distance of the observer's poles from the origin. Chosen: an answer within 30 ms,
/// which is a tenth of the shortest crossing, and a third of the sensor's noise.
const RADIUS: f64 = 0.96;

/// Modes that a sample a tick shows without doubt, Hz.
const SEEN_HZ: (f64, f64) = (40.0, 460.0);

/// Largest change of the compression in a tick that is taken as such, bits of Q16: a
/// quarter of a millimetre. The fastest crossing presses a tenth; more is a bad code.
const LARGEST: i32 = 1 << 14;

/// Bits of the fraction of gains, and of the state, mm.
const GAIN_BITS: u32 = 30;
const STATE_BITS: u32 = 28;

/// Sine of an eighth of a turn, sine and cosine of a sixteenth, Q15, rounded down.
const EIGHTH: i32 = 23_170;
const SIXTEENTH: (i32, i32) = (12_539, 30_273);

/// Luenberger observer of one undamped mode in the differences of a signal.
///
/// Model of the mode: `x+ = R(w) x`, `u = x1`, R a rotation by the angle w of a tick. The
/// observer `x^+ = (R - l c) x^ + l u` has its poles at `p e^(+-iw)`, p = 0.96: `l1 = 2 cos w
/// (1 - p)`, `l2 = (1 - p^2 - l1 cos w)/sin w`. It is computed in the coordinates z in which
/// that matrix is `p R(w)`: `x1 = z1`, `x2 = p z2 - (1 - p) z1 / tan w`. A tone of the mode's
/// frequency is met in amplitude and phase, a constant compression not at all.
///
/// Mm; the input is clamped to +-0.25 mm a tick, which bounds the state (`sum |h|`, checked at
/// build), so no sum wraps. State Q3.28, gains Q1.30. Products are cut towards zero: without
/// input the length of z falls in every tick until it is zero, with no limit cycle. Error: 60
/// nm beside the model's. Source: Luenberger 1971; coupled form and cutting: Barnes and Fam
/// 1977.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct VibrationObserver {
    /// `p cos w` and `p sin w`, Q30.
    turn: (i32, i32),
    /// Gains of the input on z1 and z2, Q30.
    gain: (i32, i32),
    /// `x2` from z1 and z2, Q30.
    second: (i32, i32),
}

/// State of a [`VibrationObserver`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VibrationState {
    /// The mode in the observer's coordinates, mm, Q28.
    z: (i32, i32),
    /// Compression a tick ago, mm.
    last: Millimetres,
}

/// The observer's state and what it has shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct VibrationTracking {
    observer: VibrationState,
    awake: bool,
    peak: Millimetres,
}

impl VibrationTracking {
    /// Largest amplitude since tracking last began, mm.
    pub const fn peak(&self) -> Millimetres {
        self.peak
    }
}

impl VibrationObserver {
    /// One tick of tracking: from the first tick that is `awake` the observer starts again and
    /// the peak counts. Asleep the observer runs only if nothing is skipped.
    pub fn track(
        &self,
        tracking: &mut VibrationTracking,
        compression: Millimetres,
        awake: bool,
        skipping: bool,
    ) {
        if awake && !tracking.awake {
            self.reset(&mut tracking.observer, compression);
            tracking.peak = Q16::ZERO;
        }
        tracking.awake = awake;
        if awake || !skipping {
            let amplitude = self.step(&mut tracking.observer, compression);
            if awake {
                tracking.peak = tracking.peak.max(amplitude);
            }
        }
    }

    /// An observer of the rig's highest mode that a millisecond shows; one that sees
    /// nothing if there is none.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let seen = |hz: &&f64| **hz >= SEEN_HZ.0 && **hz <= SEEN_HZ.1;
        let highest = rig.drive.modes_hz.iter().filter(seen).copied().reduce(f64::max);
        highest.map_or(Ok(Self::blind()), Self::of_mode)
    }

    /// An observer without gain: its output is zero.
    const fn blind() -> Self {
        Self { turn: (0, 0), gain: (0, 0), second: (0, 0) }
    }

    /// An observer of a mode of this frequency.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    fn of_mode(hz: f64) -> Result<Self, RigError> {
        let (cosine, sine) = (cosine_of_turns, |turns: f64| cosine_of_turns(turns - 0.25));
        let turns = hz / f64::from(TICK_HZ);
        let (sin, cos, p) = (sine(turns), cosine(turns), RADIUS);
        // What differencing makes of the amplitude.
        let difference = 2.0 * sine(0.5 * turns);
        let first = 2.0 * cos * (1.0 - p);
        let second = (1.0 - p * p - first * cos) / sin;
        let lean = -(1.0 - p) * cos / sin;
        let gains = (first / difference, (second - lean * first) / (p * difference));
        // Largest state: sum of the response to a pulse, times the largest input.
        let reach = libm::hypot(gains.0, gains.1) / (1.0 - p) * f64::from(LARGEST) / 65_536.0;
        let format = |value: f64| {
            let scaled = libm::round(value * f64::from(1_u32 << GAIN_BITS));
            let fits = value.abs() < 2.0 && reach < 3.9;
            fits.then_some(scaled as i32).ok_or(RigError::OutOfRange {
                key: "drive.modes_hz",
                value: hz,
                min: SEEN_HZ.0,
                max: SEEN_HZ.1,
            })
        };
        Ok(Self {
            turn: (format(p * cos)?, format(p * sin)?),
            gain: (format(gains.0)?, format(gains.1)?),
            second: (format(lean)?, format(p)?),
        })
    }

    /// Forgets all but the present compression, mm.
    pub fn reset(&self, state: &mut VibrationState, compression: Millimetres) {
        *state = VibrationState { z: (0, 0), last: compression };
    }

    /// One tick: the mode's amplitude, mm, 0 to 2 % below that of the observed state.
    pub fn step(&self, state: &mut VibrationState, compression: Millimetres) -> Millimetres {
        let change = (compression - state.last).to_bits().clamp(-LARGEST, LARGEST);
        state.last = compression;
        let input = change << (STATE_BITS - 16);
        let (z1, z2) = state.z;
        let ((cos, sin), (one, two)) = (self.turn, self.gain);
        state.z = (
            cut(wide(cos, z1) - wide(sin, z2) + wide(one, input)),
            cut(wide(sin, z1) + wide(cos, z2) + wide(two, input)),
        );
        let (z1, z2) = state.z;
        let quadrature = cut(wide(self.second.0, z1) + wide(self.second.1, z2));
        let bits = length(z1, quadrature) >> (STATE_BITS - 16);
        Q16::from_bits(bits)
    }
}

const fn wide(a: i32, b: i32) -> i64 {
    a as i64 * b as i64
}

/// A product or a sum of three without the gain's fraction, cut towards zero.
const fn cut(product: i64) -> i32 {
    let up = (product >> 63) & ((1 << GAIN_BITS) - 1);
    ((product + up) >> GAIN_BITS) as i32
}

/// Length of a vector of components below 2^30 each, 0 to 1.93 % below the exact one: the
/// largest of its projections on five directions of the eighth of the circle.
fn length(a: i32, b: i32) -> i32 {
    let (a, b) = (a.unsigned_abs() as i32, b.unsigned_abs() as i32);
    let (most, least) = if a > b { (a, b) } else { (b, a) };
    let between = (wide(SIXTEENTH.1, most) + wide(SIXTEENTH.0, least)) >> 15;
    let diagonal = (wide(EIGHTH, most) + wide(EIGHTH, least)) >> 15;
    most.max(between as i32).max(diagonal as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LSB: f64 = 1.0 / 65_536.0;

    fn observer() -> VibrationObserver {
        VibrationObserver::try_build(&Rig::prototype()).unwrap()
    }

    fn mm(value: f64) -> Millimetres {
        Q16::from_num(value)
    }

    /// Amplitudes shown from tick `from` on of a tone on a climb.
    fn shown(hz: f64, amplitude: f64, climb: f64, from: u32, to: u32) -> Vec<f64> {
        let observer = observer();
        let mut state = VibrationState::default();
        observer.reset(&mut state, mm(0.4));
        let all = (1..to).map(|tick| {
            let t = f64::from(tick);
            let tone = amplitude * (2.0 * core::f64::consts::PI * hz * 1e-3 * t).sin();
            observer.step(&mut state, mm(0.4 + tone + climb * t)).to_num::<f64>()
        });
        all.skip(from as usize).collect()
    }

    #[test]
    fn a_mode_that_the_format_does_not_hold_is_refused() {
        for hz in 1..500 {
            let of_mode = VibrationObserver::of_mode(f64::from(hz));
            let Ok(observer) = of_mode else {
                // Too slow to be told from the climb, or too close to half the rate.
                assert!(!(SEEN_HZ.0..=SEEN_HZ.1).contains(&f64::from(hz)), "{hz}");
                continue;
            };
            let held = |bits: i32| bits.unsigned_abs() < 2 << GAIN_BITS;
            let (gain, second) = (observer.gain, observer.second);
            assert!(held(gain.0) && held(gain.1) && held(second.0) && held(second.1), "{hz}");
            // The largest input, over and over in the worst order, stays in the state.
            let mut largest: f64 = 0.0;
            let gains = [gain.0, gain.1].map(|bits| f64::from(bits) / f64::from(1 << GAIN_BITS));
            for tick in 0..4000 {
                let (x, y) = (f64::from(tick), 2.0 * core::f64::consts::PI * f64::from(hz) * 1e-3);
                largest += (gains[0] * (x * y).cos() - gains[1] * (x * y).sin()).abs()
                    * RADIUS.powi(tick)
                    * f64::from(LARGEST)
                    / 65_536.0;
            }
            assert!(largest < 4.0, "{hz}: {largest}");
        }
        assert!(VibrationObserver::of_mode(1.0).is_err());
    }

    #[test]
    fn the_highest_mode_that_shows_is_taken() {
        let mut rig = Rig::prototype();
        assert_eq!(observer(), VibrationObserver::of_mode(276.0).unwrap());
        let _ = rig.drive.modes_hz.push(900.0);
        assert_eq!(VibrationObserver::try_build(&rig).unwrap(), observer());
        rig.drive.modes_hz.clear();
        let blind = VibrationObserver::try_build(&rig).unwrap();
        let mut state = VibrationState::default();
        for tick in 0..100 {
            assert_eq!(blind.step(&mut state, mm(f64::from(tick % 3))), Q16::ZERO);
        }
    }

    #[test]
    fn the_poles_stand_where_they_are_placed() {
        let one = f64::from(1_u32 << GAIN_BITS);
        for hz in [41.0, 163.0, 250.0, 276.0, 459.0] {
            let observer = VibrationObserver::of_mode(hz).unwrap();
            let (cos, sin) = (f64::from(observer.turn.0) / one, f64::from(observer.turn.1) / one);
            assert!((cos.hypot(sin) - RADIUS).abs() < 2e-9);
            assert!((sin.atan2(cos) - 2.0 * core::f64::consts::PI * hz * 1e-3).abs() < 2e-9);
        }
        assert!(VibrationObserver::of_mode(0.001).is_err());
        assert!(VibrationObserver::of_mode(499.999).is_err());
    }

    #[test]
    fn a_tone_of_the_mode_is_met_and_others_are_not() {
        for amplitude in [0.002, 0.03, 0.15] {
            for got in shown(276.0, amplitude, 0.0, 300, 1000) {
                assert!(got <= amplitude + 3.0 * LSB, "{got}");
                assert!(got >= 0.98 * amplitude - 3.0 * LSB, "{got} {amplitude}");
            }
        }
        // A mode a tenth off is seen at a fifth, the other mode at a twentieth.
        let worst = |hz| shown(hz, 0.1, 0.0, 400, 1000).into_iter().fold(0.0, f64::max);
        assert!(worst(276.0 * 0.9) < 0.025, "{}", worst(276.0 * 0.9));
        assert!(worst(163.0) < 0.008, "{}", worst(163.0));
        assert!(worst(23.0) < 0.001, "{}", worst(23.0));
    }

    #[test]
    fn a_rest_is_not_seen_and_a_climb_hardly() {
        assert!(shown(276.0, 0.0, 0.0, 0, 50).iter().all(|&x| x == 0.0));
        // 5 mm/s on the steepest slope of a corner.
        let worst = shown(276.0, 0.0, 0.003, 0, 300).into_iter().fold(0.0, f64::max);
        assert!(worst < 0.21e-3, "{worst}");
        let last = shown(276.0, 0.0, 0.003, 280, 300).into_iter().fold(0.0, f64::max);
        assert!(last < 0.04 * 0.003 + LSB, "{last}");
    }

    #[test]
    fn the_length_is_that_of_the_vector() {
        let (mut least, mut most) = (f64::MAX, 0.0f64);
        for degree in 0..3600 {
            let (sin, cos) = (f64::from(degree) * 0.1).to_radians().sin_cos();
            let vector = ((1e9 * cos) as i32, (1e9 * sin) as i32);
            let part = f64::from(length(vector.0, vector.1)) / 1e9;
            (least, most) = (least.min(part), most.max(part));
        }
        assert!((0.9805..0.981).contains(&least) && most <= 1.0, "{least} {most}");
    }

    #[test]
    fn without_input_nothing_is_left_and_nothing_drifts() {
        let observer = observer();
        for z in [(i32::MAX >> 2, -1), (7, -3), (-1, 1), (12_345, 1 << 28)] {
            let mut state = VibrationState { z, last: mm(1.0) };
            let mut before = f64::MAX;
            let mut ticks = 0;
            while state.z != (0, 0) {
                observer.step(&mut state, mm(1.0));
                let now = f64::from(state.z.0).hypot(f64::from(state.z.1));
                assert!(now < before);
                (before, ticks) = (now, ticks + 1);
                assert!(ticks < 1000, "{:?}", state.z);
            }
        }
        // Shaken for a million ticks, it holds what it held after a thousand, and then
        // lets it go.
        let mut state = VibrationState::default();
        let mut tone = (0.0f64, 0.1f64);
        let (sin, cos) = (2.0 * core::f64::consts::PI * 0.276).sin_cos();
        let (mut early, mut late) = (0.0f64, 0.0f64);
        for tick in 0..1_000_000 {
            tone = (tone.0 * cos - tone.1 * sin, tone.0 * sin + tone.1 * cos);
            let shown = observer.step(&mut state, mm(0.4 + tone.0)).to_num::<f64>();
            if (1000..2000).contains(&tick) {
                early = early.max(shown);
            } else if tick >= 999_000 {
                late = late.max(shown);
            }
        }
        assert!((early - late).abs() < 2.0 * LSB, "{early} {late}");
        for _ in 0..1000 {
            observer.step(&mut state, mm(0.4));
        }
        assert_eq!(state.z, (0, 0));
    }

    proptest! {
        #[test]
        fn it_is_the_observer_in_f64(
            hz in 60.0..440.0f64,
            inputs in prop::collection::vec(0.0..0.2f64, 300),
        ) {
            let fixed = VibrationObserver::of_mode(hz).unwrap();
            let angle = 2.0 * core::f64::consts::PI * hz * 1e-3;
            let (sin, cos) = angle.sin_cos();
            // In the coordinates of the mode, as written in the docs.
            let l1 = 2.0 * cos * (1.0 - RADIUS);
            let l2 = (1.0 - RADIUS * RADIUS - l1 * cos) / sin;
            let (mut x1, mut x2, mut last) = (0.0, 0.0, 0.0);
            let mut state = VibrationState::default();
            for input in inputs {
                let compression = mm(input);
                let u = (compression.to_num::<f64>() - last) / (2.0 * (0.5 * angle).sin());
                last = compression.to_num();
                let (a, b) = (cos * x1 - sin * x2, sin * x1 + cos * x2);
                (x1, x2) = (a + l1 * (u - x1), b + l2 * (u - x1));
                let got = fixed.step(&mut state, compression).to_num::<f64>();
                let exact = x1.hypot(x2);
                prop_assert!(got <= exact + 60e-9 / sin + LSB, "{got} {exact}");
                prop_assert!(got >= 0.9807 * exact - 60e-9 / sin - LSB, "{got} {exact}");
            }
        }

        #[test]
        fn no_input_overflows(
            hz in 40.0..460.0f64,
            inputs in prop::collection::vec(any::<i32>(), 1..400),
            shake in any::<bool>(),
        ) {
            let observer = VibrationObserver::of_mode(hz).unwrap();
            let mut state = VibrationState::default();
            for (tick, bits) in inputs.into_iter().enumerate() {
                // Full swing at about the mode, or garbage.
                let tone = (tick as f64 * hz * 1e-3 * 2.0).floor() as i64 % 2 == 0;
                let bits = if shake { if tone { i32::MAX } else { i32::MIN } } else { bits };
                let shown = observer.step(&mut state, Q16::from_bits(bits));
                prop_assert!(shown >= Q16::ZERO && shown < mm(4.0));
                prop_assert!(state.z.0.unsigned_abs() < 1 << 30);
                prop_assert!(state.z.1.unsigned_abs() < 1 << 30);
            }
        }
    }
}
