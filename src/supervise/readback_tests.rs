//! Outputs of bridges that are sound, regulate, or are broken.

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
            let exact = f64::from(to) + f64::from(from - to) * (-f64::from(tick) / LAG_TICKS).exp();
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
            let (_, tick) = found_with(motor, &given, &NOMINAL.codes(&[0.9; 900])).expect("found");
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
