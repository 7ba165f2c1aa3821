//! Compares each bridge's output with its duty. The output, the difference of its two legs, goes
//! through a low-pass to a converter; the duty goes through the same low-pass here. A wrong duty
//! shows within milliseconds.
//!
//! A bridge at its current limit gives less than its duty, of the same sign: as much as holds
//! the limit. With the motor at rest or turning with its duty that is [`REGULATED`] at least.
//! A motor that still turns against its duty adds its own voltage to the current, and the bridge
//! gives less by that, down to nothing. So much is no fault; less, more or the other sign is.
//!
//! Faults behind the output (a motor without force, a slipping gear, a jammed screw) are left to
//! the comparison of the sensors in `crosscheck`.

#![deny(clippy::float_arithmetic)]

use super::motor::{Motor, Turning};
use crate::fault::Fault;
use crate::rig::Rig;
use crate::sense::raw::{BridgeCode, BridgeCodes};
use crate::units::Duty;

/// Time constant of the low-pass before the converter, ticks. A period of the PWM, 50 us, leaves
/// 1 % of ripple after it, and next to none in the mean of 0.15 ms.
pub const LAG_TICKS: f64 = 1.0;
/// Response of the low-pass to a step within a tick, Q15: `1 - exp(-1 / LAG_TICKS)`.
const TAKES: i32 = 20_713;
/// The same of a low-pass that is 15 % faster or slower.
const TAKES_ENDS: [i32; 2] = [22_662, 19_035];
/// Tolerance of the output, Q15 duty: five deviations of its noise, 0.002 each, and three of its
/// zero, as much again; the voltage drop of the transistors is less.
pub const BAND: i32 = 655;
/// Tolerance relative to the expected output, as a shift: three deviations of supply, divider
/// and reference together, 0.7 % each.
pub const BAND_SHIFT: u32 = 5;
/// Least output of a bridge that regulates its current and whose motor does not turn against its
/// duty, Q15 duty: a quarter. At standstill the
/// presets' force limit takes half of the full duty, more in motion; the other half is for the
/// spread of limit and winding, and for a wheel that is braked. A smaller duty never reaches the
/// limit and is judged by itself.
const REGULATED: i16 = 8192;
/// Ticks for which the output must be off.
pub const OFF_TICKS: i8 = 4;
/// Ticks without a conversion that count as a fault, as for the sensors.
const SILENT_TICKS: u8 = 20;

/// Ticks after the start that are not judged: then the low-pass keeps a thousandth of the duty
/// before a restart.
const SETTLES: i8 = 7;

/// Both bridges' motors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Readback {
    drive: Motor,
    pretightener: Motor,
}

/// State of both bridges' comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadbackState {
    drive: Bridge,
    pretightener: Bridge,
    /// Ticks without a conversion.
    silent: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Bridge {
    /// Duty commanded until now, Q15.
    commanded: i16,
    /// It through the fastest and the slowest low-pass.
    lags: [Lag; 2],
    /// The same of what regulation at least leaves of it.
    regulated: [Lag; 2],
    /// What the motor's speed may be.
    turning: Turning,
    /// Least and largest output a tick ago, Q15.
    before: (i32, i32),
    /// Ticks for which it has been off; if negative, ticks until it is judged.
    off: i8,
}

impl Default for Bridge {
    fn default() -> Self {
        let lags = [Lag(0); 2];
        let turning = Turning::default();
        Self { commanded: 0, lags, regulated: lags, turning, before: (0, 0), off: -SETTLES }
    }
}

/// The low-pass before the converter: `y' = (u - y) / LAG_TICKS`, exact for a duty that is
/// held through the tick, but for the rounding, 1 LSB of Q15 at most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lag(i32);

impl Lag {
    /// Output after a tick under this duty, Q15.
    pub const fn step(&mut self, duty: i32) -> i32 {
        self.step_by(duty, TAKES)
    }

    const fn step_by(&mut self, duty: i32, takes: i32) -> i32 {
        // |duty - output| <= 2^16: the product stays below 2^31.
        self.0 += ((duty - self.0) * takes + (1 << 14)) >> 15;
        self.0
    }
}

impl Readback {
    /// The motors of a rig. The drive's follows its bridge as its torque over speed accelerates
    /// the rotor.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn build(rig: &Rig) -> Self {
        let drive = &rig.drive;
        let drive_s =
            1e-3 * drive.reflected_mass_kg * drive.no_load_speed_mm_s / drive.stall_force_n;
        Self { drive: Motor::build(drive_s), pretightener: Motor::build(rig.preload.lag_s) }
    }

    /// One tick with the readback of the duties set before it. A wheel that may coast, as after a
    /// restart in motion, drives its motor as a generator: then its bridge is not judged.
    pub fn step(
        &self,
        state: &mut ReadbackState,
        found: Option<BridgeCodes>,
        coasts: bool,
    ) -> Option<Fault> {
        let Some(found) = found else {
            state.drive.advance(&self.drive);
            state.pretightener.advance(&self.pretightener);
            state.silent = state.silent.saturating_add(1);
            return (state.silent >= SILENT_TICKS).then_some(Fault::ReadbackStale);
        };
        state.silent = 0;
        let drive = state.drive.is_off(&self.drive, found.drive);
        let pretightener = state.pretightener.is_off(&self.pretightener, found.pretightener);
        if drive && !coasts {
            return Some(Fault::DriveBridge);
        }
        if coasts {
            state.drive.off = state.drive.off.min(0);
        }
        pretightener.then_some(Fault::PretightenerBridge)
    }
}

impl ReadbackState {
    /// Sets the duties until the next tick; 0 with the bridge off.
    pub const fn set_duties(&mut self, drive: Duty, pretightener: Duty) {
        self.drive.commanded = drive.to_bits();
        self.pretightener.commanded = pretightener.to_bits();
    }

    /// Whether the drive has been given a duty.
    pub const fn drives(&self) -> bool {
        self.drive.commanded != 0
    }
}

impl Bridge {
    /// Least and largest output after a tick under the duty.
    fn advance(&mut self, motor: &Motor) -> (i32, i32) {
        // The speed before the tick, when it is farthest from the duty, in Q15.
        let against = self.turning.against(self.commanded).to_bits() >> 1;
        // Between 0 and REGULATED.
        let leaves = (i32::from(REGULATED) - against).max(0) as i16;
        // Not `clamp`, which can panic.
        let least = self.commanded.max(-leaves).min(leaves);
        motor.step(&mut self.turning, self.commanded);
        for (lags, duty) in [(&mut self.lags, self.commanded), (&mut self.regulated, least)] {
            let [fast, slow] = lags;
            fast.step_by(duty.into(), TAKES_ENDS[0]);
            slow.step_by(duty.into(), TAKES_ENDS[1]);
        }
        self.bounds()
    }

    /// Least and largest output now. Whatever the output is between the two duties, its low-pass
    /// is between theirs.
    fn bounds(&self) -> (i32, i32) {
        let ([Lag(a), Lag(b)], [Lag(c), Lag(d)]) = (self.lags, self.regulated);
        (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
    }

    /// Whether it has been off for too long. The code was taken at some moment of the last two
    /// ticks: it may lie anywhere between the outputs of three.
    fn is_off(&mut self, motor: &Motor, code: BridgeCode) -> bool {
        let older = self.before;
        let before = self.bounds();
        let now = self.advance(motor);
        self.before = before;
        let low = now.0.min(before.0).min(older.0);
        let high = now.1.max(before.1).max(older.1);
        let band = BAND + (now.0.abs().max(now.1.abs()) >> BAND_SHIFT);
        let found = code.duty();
        let off = found < low - band || found > high + band;
        self.off = if off || self.off < 0 { self.off.saturating_add(1) } else { 0 };
        self.off >= OFF_TICKS
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::super::motor::LAG_ENDS;
    use super::*;
    use proptest::prelude::*;

    /// A bridge as built: its output through a low-pass of this time constant, read at this
    /// part of the tick, times a gain, plus an offset.
    #[derive(Clone, Copy)]
    struct Built {
        tau: f64,
        at: f64,
        gain: f64,
        offset: f64,
    }

    const NOMINAL: Built = Built { tau: LAG_TICKS, at: 1.0, gain: 1.0, offset: 0.0 };

    impl Built {
        /// Codes tick by tick of a bridge that takes these duties.
        fn codes(self, duties: &[f64]) -> Vec<BridgeCode> {
            let mut output = 0.0;
            let code = |duty: &f64| {
                let after = |time: f64| duty + (output - duty) * (-time / self.tau).exp();
                let (read, end) = (after(self.at), after(1.0));
                output = end;
                BridgeCode::of(((self.gain * read + self.offset) * 32_768.0).round() as i32)
            };
            duties.iter().map(code).collect()
        }
    }

    fn q15(duty: f64) -> Duty {
        Duty::from_bits((duty * 32_767.0).round() as i16)
    }

    /// Begun long ago.
    fn settled() -> ReadbackState {
        let mut readback = ReadbackState::default();
        (readback.drive.off, readback.pretightener.off) = (0, 0);
        readback
    }

    /// First fault of a drive with these duties, and its tick. The other bridge is off.
    fn found(duties: &[f64], codes: &[BridgeCode]) -> Option<(Fault, usize)> {
        found_with(Readback::build(&Rig::prototype()).drive, duties, codes)
    }

    /// The same with this motor.
    fn found_with(motor: Motor, duties: &[f64], codes: &[BridgeCode]) -> Option<(Fault, usize)> {
        let (readback, mut state) = (Readback { drive: motor, ..Readback::default() }, settled());
        duties.iter().zip(codes).enumerate().find_map(|(tick, (duty, code))| {
            state.set_duties(q15(*duty), Duty::ZERO);
            let codes = BridgeCodes { drive: *code, pretightener: BridgeCode::of(0) };
            let fault = readback.step(&mut state, Some(codes), false);
            fault.map(|fault| (fault, tick))
        })
    }

    #[test]
    fn the_low_pass_is_the_exact_one() {
        for (from, to) in [(0, 32_767), (32_767, -32_768), (-5, 5), (1000, 0)] {
            let mut lag = Lag(from);
            for tick in 1..20 {
                let exact =
                    f64::from(to) + f64::from(from - to) * (-f64::from(tick) / LAG_TICKS).exp();
                let got = f64::from(lag.step(to));
                assert!((got - exact).abs() <= 2.0, "{got} {exact}");
            }
        }
    }

    #[test]
    fn a_bridge_that_runs_away_is_found_in_five_ticks() {
        for asked in [-0.9, 0.0, 0.2, 0.85] {
            let given = [asked; 40];
            let taken: Vec<f64> = (0..40).map(|tick| if tick < 20 { asked } else { 1.0 }).collect();
            for at in [0.0, 0.2, 1.0] {
                let codes = Built { at, ..NOMINAL }.codes(&taken);
                let (fault, tick) = found(&given, &codes).expect("found");
                assert_eq!(fault, Fault::DriveBridge);
                assert!((23..=25).contains(&tick), "{asked} {at}: {tick}");
            }
        }
    }

    #[test]
    fn a_bridge_that_drives_although_it_is_off_is_found() {
        let codes = NOMINAL.codes(&[0.3; 20]);
        assert_eq!(found(&[0.0; 20], &codes), Some((Fault::DriveBridge, 3)));
    }

    #[test]
    fn a_bridge_that_regulates_its_current_is_no_fault() {
        for sense in [1.0, -1.0] {
            // At standstill it regulates at half of the full duty, less as a wheel is braked.
            for least in [0.27, 0.5, 0.7] {
                let given: Vec<f64> = (0..300).map(|tick| [0.2, 0.9, 1.0][tick / 100]).collect();
                // From tick to tick it finds another output.
                let regulated = |(tick, duty): (usize, &f64)| {
                    sense * duty.min(least + 0.05 * f64::from((tick % 3) as u8))
                };
                let outputs: Vec<f64> = given.iter().enumerate().map(regulated).collect();
                let given: Vec<f64> = given.iter().map(|duty| sense * duty).collect();
                assert_eq!(found(&given, &NOMINAL.codes(&outputs)), None, "{sense} {least}");
            }
        }
    }

    #[test]
    fn a_bridge_with_less_than_regulation_leaves_or_the_wrong_sign_is_found() {
        for (asked, taken) in [
            (0.9, 0.0),
            (0.9, 0.15),
            (0.9, -0.5),
            (-0.9, 0.0),
            (-0.9, 0.9),
            // More than asked, and too little asked for the current to reach its limit.
            (0.5, 0.7),
            (0.2, 0.1),
        ] {
            let codes = NOMINAL.codes(&[taken; 40]);
            assert!(found(&[asked; 40], &codes).is_some(), "{asked} {taken}");
        }
    }

    /// Outputs of a bridge that keeps its motor's current, the output beyond the speed, to this
    /// part of that at standstill and full duty; the motor follows with this lag, ticks.
    fn regulated(most: f64, lag: f64, duties: &[f64]) -> Vec<f64> {
        let mut speed = 0.0;
        let output = |duty: &f64| {
            // Towards no output, never through it.
            let left = duty.clamp(speed - most, speed + most);
            let left =
                if left * duty <= 0.0 { 0.0 } else { duty.signum() * left.abs().min(duty.abs()) };
            speed = left + (speed - left) * (-1.0 / lag).exp();
            left
        };
        duties.iter().map(output).collect()
    }

    #[test]
    fn a_dead_bridge_is_found_while_its_motor_turns_against_the_duty() {
        // As long as the slowest motor takes to fall to the least limit less the band, and 7 ms.
        let motors = Readback::build(&Rig::prototype());
        for (motor, most) in [(motors.drive, 40), (motors.pretightener, 140)] {
            for after in [-0.9, -0.3, -0.13] {
                let given: Vec<f64> =
                    (0..900).map(|tick| if tick < 500 { 0.9 } else { after }).collect();
                let dead = |(tick, duty): (usize, &f64)| if tick < 500 { *duty } else { 0.0 };
                let taken: Vec<f64> = given.iter().enumerate().map(dead).collect();
                let (_, tick) = found_with(motor, &given, &NOMINAL.codes(&taken)).expect("found");
                assert!((500..500 + most).contains(&tick), "{after}: {tick}");
                // One that keeps its duty is found at once.
                let (_, tick) =
                    found_with(motor, &given, &NOMINAL.codes(&[0.9; 900])).expect("found");
                assert!((503..=505).contains(&tick), "{after}: {tick}");
            }
        }
    }

    #[test]
    fn what_a_coasting_wheel_generates_is_no_fault_until_it_rests() {
        let (readback, mut state) = (Readback::build(&Rig::prototype()), settled());
        let mut step = |drive, pretightener, coasts| {
            let [drive, pretightener] = [drive, pretightener].map(BridgeCode::of);
            readback.step(&mut state, Some(BridgeCodes { drive, pretightener }), coasts)
        };
        for _ in 0..100 {
            assert_eq!(step(16_000, 0, true), None);
        }
        let rested: Vec<_> = (0..4).map(|_| step(16_000, 0, false)).collect();
        assert_eq!(rested, [None, None, None, Some(Fault::DriveBridge)]);
        // The screw does not coast.
        let screw: Vec<_> = (0..4).map(|_| step(0, 9000, true)).collect();
        assert_eq!(screw, [None, None, None, Some(Fault::PretightenerBridge)]);
    }

    #[test]
    fn what_the_low_pass_keeps_of_a_run_before_the_start_is_no_fault() {
        let readback = Readback::build(&Rig::prototype());
        for duty in [-1.0_f64, 0.3, 1.0] {
            let mut state = ReadbackState::default();
            for tick in 0..40 {
                let left = duty * (-f64::from(tick) / LAG_TICKS).exp() + 0.006;
                let code = BridgeCode::of((left * 32_768.0) as i32);
                let codes = BridgeCodes { drive: code, pretightener: code };
                assert_eq!(readback.step(&mut state, Some(codes), false), None, "{duty} {tick}");
            }
        }
        // One that goes on driving is.
        let mut state = ReadbackState::default();
        let code = BridgeCode::of(20_000);
        let codes = BridgeCodes { drive: BridgeCode::of(0), pretightener: code };
        let found = (1..40).find(|_| readback.step(&mut state, Some(codes), false).is_some());
        assert_eq!(found, Some(i32::from(SETTLES + OFF_TICKS)));
    }

    #[test]
    fn each_bridge_has_its_own_fault_and_silence_has_one() {
        let (readback, mut state) = (Readback::build(&Rig::prototype()), settled());
        let codes = BridgeCodes { drive: BridgeCode::of(0), pretightener: BridgeCode::of(9000) };
        let mut faults = |codes, ticks| -> Vec<_> {
            (0..ticks).map(|_| readback.step(&mut state, codes, false)).collect()
        };
        let pressed = faults(Some(codes), 4);
        assert_eq!(pressed, [None, None, None, Some(Fault::PretightenerBridge)]);
        let silent = faults(None, 20);
        assert!(silent[..19].iter().all(Option::is_none));
        assert_eq!(silent[19], Some(Fault::ReadbackStale));
    }

    proptest! {
        /// Supply, divider, zero, low-pass and moment all at the ends of what is foreseen.
        #[test]
        fn a_sound_bridge_raises_no_alarm(
            steps in prop::collection::vec((-1.0..1.0f64, 1usize..30), 1..20),
            tau in 0.85..1.15f64,
            at in 0.05..1.0f64,
            late in any::<bool>(),
            gain in 0.979..1.021f64,
            offset in -0.006..0.006f64,
            noise in prop::collection::vec(-0.008..0.008f64, 600),
        ) {
            let given: Vec<f64> =
                steps.iter().flat_map(|(duty, ticks)| vec![*duty; *ticks]).collect();
            let built = Built { tau: tau * LAG_TICKS, at, gain, offset };
            // Late, it is of the tick before.
            let late = late.then_some(BridgeCode::of((offset * 32_768.0) as i32));
            let codes: Vec<BridgeCode> = late
                .into_iter()
                .chain(built.codes(&given))
                .zip(&noise)
                .map(|(code, noise)| BridgeCode::of(code.duty() + (noise * 32_768.0) as i32))
                .collect();
            prop_assert_eq!(found(&given, &codes), None);
        }

        /// At any limit, whatever is asked and however fast the motor follows.
        #[test]
        fn a_bridge_that_regulates_raises_no_alarm_while_its_motor_turns(
            steps in prop::collection::vec((-1.0..1.0f64, 1usize..200), 1..20),
            most in 0.25..1.0f64,
            lag in LAG_ENDS[0]..LAG_ENDS[1],
            tau in 0.85..1.15f64,
            at in 0.05..1.0f64,
            gain in 0.979..1.021f64,
            offset in -0.006..0.006f64,
            noise in -0.008..0.008f64,
        ) {
            let given: Vec<f64> =
                steps.iter().flat_map(|(duty, ticks)| vec![*duty; *ticks]).collect();
            let taken = regulated(most, 60.0 * lag, &given);
            let built = Built { tau: tau * LAG_TICKS, at, gain, offset: offset + noise };
            let motor = Motor::build(0.06);
            prop_assert_eq!(found_with(motor, &given, &built.codes(&taken)), None);
        }

        /// Whatever is off by twice the band and stays so, beyond what regulation leaves.
        #[test]
        fn what_is_off_by_twice_the_band_is_found(
            asked in -0.9..0.9f64,
            beyond in 0.005..1.0f64,
            up in any::<bool>(),
            at in 0.05..1.0f64,
            gain in 0.979..1.021f64,
        ) {
            let off = 0.04 + asked.abs() / 16.0 + beyond;
            let least = asked.clamp(-0.25, 0.25);
            let taken = if up { asked.max(least) + off } else { asked.min(least) - off };
            let duties: Vec<f64> =
                (0..60).map(|tick| if tick < 30 { asked } else { taken }).collect();
            let codes = Built { at, gain, ..NOMINAL }.codes(&duties);
            let (_, tick) = found(&[asked; 60], &codes).expect("found");
            prop_assert!((33..=39).contains(&tick), "{}", tick);
        }
    }

    #[test]
    fn off_by_the_band_is_borne_and_by_more_is_not() {
        let step = |given: i16, found: i32| {
            let given_q15 = i32::from(given);
            let mut bridge = Bridge {
                commanded: given,
                lags: [Lag(given_q15); 2],
                regulated: [Lag(given_q15); 2],
                turning: Turning::default(),
                before: (given_q15, given_q15),
                off: 0,
            };
            let motor = Motor::default();
            // The code's own steps are coarser than what is asked here.
            let code = BridgeCode::of(found);
            assert_eq!(code.duty(), found);
            (0..20).any(|_| bridge.is_off(&motor, code))
        };
        // Duties and bands of whole steps of the code: 655 and 5 of 160.
        for given in [160_i16, -160] {
            let wide = 660;
            assert!(!step(given, i32::from(given) + wide));
            assert!(!step(given, i32::from(given) - wide));
            assert!(step(given, i32::from(given) + wide + 20));
            assert!(step(given, i32::from(given) - wide - 20));
        }
    }
}
