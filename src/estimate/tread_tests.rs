//! The tread before the first crossing, against the reference in f64.

use super::*;
use proptest::prelude::*;

/// `K` of the relaxed tread, N/mm^(3/2): a ring carries `K c^(3/2)`.
fn stiffness(rig: &Rig) -> f64 {
    let area = 1e-9 * rig.tread.k_inf_pa_per_m * rig.rig.wheel_width_mm;
    4.0 / 3.0 * area * (2.0 * rig.rig.wheel_radius_mm).sqrt()
}

/// A tick of a wheel whose drive does nothing.
fn rolling(direction: Direction, travel: Travel, pressed: Q16, compression: Q16) -> Rolls {
    Rolls { direction, travel, speed: Q16::ZERO, duty: Q16::ZERO, pressed, compression }
}

/// A state that began with the wheel unloaded.
fn begun(tread: &Tread) -> TreadState {
    let mut state = TreadState::default();
    tread.begin(&mut state, (Travel::ZERO, None), Q16::ZERO, Q16::ZERO);
    state
}

/// Presses a wheel of rubber that is `stiff` times as stiff from nothing to the preload at
/// which crossings are made, at the pre-tightener's slew, with sensors of these gains;
/// gives the tick of the report.
fn pressed(name: &str, stiff: f64, load_gain: f64, tread_gain: f64) -> Option<u32> {
    let rig = Rig::named(name).expect("a preset");
    let tread = Tread::try_build(&rig).expect("in range");
    let mut state = begun(&tread);
    let rate = stiff * stiffness(&rig);
    let (mut force, mut memory, s) = (0.0f64, 0.0f64, rig.tread.stiffening);
    (0..3000).find(|_| {
        force = (force + rig.preload.slew_n_per_s * 1e-3).min(0.95 * rig.preload.limit_n);
        // Many short steps of the same solid, by another integration.
        for _ in 0..20 {
            let elastic = (force + (s - 1.0) * memory) / s;
            memory += (elastic - memory) / rig.tread.tau_s * 50e-6;
        }
        let elastic = (force + (s - 1.0) * memory) / s;
        let compression = (elastic / rate).powf(2.0 / 3.0);
        tread.rest(
            &mut state,
            Q16::from_num(force * load_gain),
            Q16::ZERO,
            Q16::from_num(compression * tread_gain),
        )
    })
}

/// A wheel pressed at the slew that rolls from half of the cruise preload on; gives the ratio
/// that is reported. Elements a tenth as far apart and steps a tenth as long as the
/// observer's. The compression sensor has this gain; the load grows with the power
/// `1.5 / power` of what it shows.
fn rolled(name: &str, power: f64, gain: f64, direction: Direction) -> Option<f64> {
    let rig = Rig::named(name).expect("a preset");
    let tread = Tread::try_build(&rig).expect("in range");
    let mut state = begun(&tread);
    let (radius, s) = (rig.rig.wheel_radius_mm, rig.tread.stiffening);
    let spacing = 0.1 * SPACING * radius;
    let rate = 1e-9 * rig.tread.k_inf_pa_per_m * rig.rig.wheel_width_mm * spacing;
    let mut memory = vec![0.0f64; 320];
    let keep = 1e-4 / rig.tread.tau_s;
    let (mut compression, mut travel) = (0.0f64, 0.0f64);
    for tick in 0..4000 {
        let force = rig.preload.slew_n_per_s * 1e-3 * f64::from(tick);
        let rolls = force > 0.5 * rig.preload.cruise_n;
        for _ in 0..10 {
            travel += if rolls { 1e-4 * 8.0 } else { 0.0 };
            let depth = |i: usize, c: f64| {
                let x = spacing * (i as f64 - 120.0) - travel;
                (c - x * x / (2.0 * radius)).max(0.0)
            };
            let load = |c: f64, memory: &[f64]| -> f64 {
                let at = |(i, q): (usize, &f64)| (depth(i, c), *q);
                let of = |(d, q): (f64, f64)| (d + (s - 1.0) * (d - q)).max(0.0);
                let touching = memory.iter().enumerate().map(at).filter(|(d, _)| *d > 0.0);
                rate * touching.map(of).sum::<f64>()
            };
            // One step of Newton's method from the height before.
            let (here, there) = (load(compression, &memory), load(compression + 1e-4, &memory));
            let slope = ((there - here) / 1e-4).max(1.0);
            compression = (compression + (force - here) / slope).max(0.0);
            for (i, q) in memory.iter_mut().enumerate() {
                *q += keep * (depth(i, compression) - *q);
            }
        }
        let (load, shown) =
            (Q16::from_num(force), Q16::from_num(gain * 0.3 * (compression / 0.3).powf(power)));
        let outwards = Travel::from_num(travel);
        let ratio = match direction {
            _ if !rolls => {
                tread.rest(&mut state, load, Q16::ZERO, shown);
                None
            }
            Direction::Deploy => tread.roll(&mut state, &rolling(direction, outwards, load, shown)),
            Direction::Retract => {
                tread.roll(&mut state, &rolling(direction, -outwards, load, shown))
            }
        };
        if let Some(shown_now) = ratio {
            let again = tread.roll(&mut state, &rolling(direction, outwards, load, shown));
            assert_eq!(again, None, "once");
            return Some(divide(shown_now.rest, shown_now.rolled).to_num());
        }
    }
    None
}

#[test]
fn rubber_that_relaxes_as_known_is_as_stiff_rolling_as_at_rest() {
    for name in ["prototype", "fe"] {
        for direction in [Direction::Deploy, Direction::Retract] {
            let ratio = rolled(name, 1.0, 1.0, direction).expect("seen");
            assert!((ratio - 1.0).abs() < 0.012, "{name} {ratio}");
        }
    }
}

#[test]
fn a_tread_whose_load_grows_less_shows_in_the_ratio_and_a_sensor_s_gain_does_not() {
    let ratio = |power, gain| rolled("prototype", power, gain, Direction::Deploy).expect("seen");
    assert!(ratio(1.25, 1.0) > 1.1, "{}", ratio(1.25, 1.0));
    assert!(ratio(0.8, 1.0) < 1.0 / 1.1, "{}", ratio(0.8, 1.0));
    for gain in [0.9, 1.1] {
        assert!((ratio(1.0, gain) - 1.0).abs() < 0.03, "{}", ratio(1.0, gain));
    }
}

proptest! {
    #[test]
    fn only_what_speaks_against_the_known_tread_makes_the_first_crossing_stiffer(
        rolled in 0.4..1.3f64,
        ratio in 0.95..1.25f64,
    ) {
        // An arm that presses by a quarter more than was known leaves four fifths of it.
        let shown = Shown {
            rest: Q16::from_num(rolled * ratio),
            rolled: Q16::from_num(0.8 * rolled),
            pressed: q16(40_000_000),
            load: None,
            load_sigma: Q16::ONE,
        };
        let got: f64 = shown.stiffness(q16(10_000_000)).to_num();
        let coupled = 1.0 + 4.0 * (ratio - 1.03).max(0.0);
        let exact = match rolled {
            r if r < 0.84 => coupled.max(2.0 - r),
            r => coupled.max(r),
        };
        prop_assert!((got - exact).abs() < 1e-3, "{got} {exact}");
    }
}

#[test]
fn a_load_that_presses_the_wheel_shows_in_the_tread() {
    let shown = |rolled: f64| Shown {
        rest: Q16::ONE,
        rolled: Q16::from_num(rolled),
        pressed: q16(20_000_000),
        load: None,
        load_sigma: Q16::ONE,
    };
    // A tread as known bears what presses it by a sixth; a load that presses by 8 N without
    // being in the known force shows as a tread that is softer by as much.
    for (rolled, thrust, bears) in
        [(1.0, 3, true), (1.0, 4, false), (0.71, 8, true), (1.0, -5, false), (1.2, 5, false)]
    {
        let by = Q16::from_num(thrust);
        assert_eq!(shown(rolled).bears(by), bears, "{rolled} {thrust}");
    }
}

#[test]
fn a_wheel_that_was_pressed_before_shows_its_relaxed_tread_on_the_way_back() {
    let tread = Tread::try_build(&Rig::prototype()).expect("in range");
    let (thrust, compression) = (q16(6_000_000), q16(370_000));
    let (out, back) = (Direction::Deploy, Direction::Retract);
    let shown = [(out, None, 1.2, false), (back, Some(1000), 1.2, false), (back, None, 1.2, true)];
    for (direction, rested, stiff, shows) in shown.into_iter().chain([(back, None, 1.0, false)]) {
        let mut state = TreadState::default();
        let preload = tread.means(compression) * Q16::from_num(stiff) - thrust;
        tread.begin(&mut state, (Travel::ZERO, rested), preload, compression);
        (0..100).for_each(|_| _ = tread.rest(&mut state, preload, thrust, compression));
        let rolls = rolling(direction, Travel::ZERO, preload + thrust, compression);
        assert_eq!(tread.roll(&mut state, &rolls).is_some(), shows, "{rested:?} {stiff}");
    }
}

#[test]
fn a_compression_sensor_that_is_a_fifth_off_is_reported() {
    for name in ["prototype", "fe"] {
        assert_eq!(pressed(name, 1.0, 1.0, 1.0), None);
        assert!(pressed(name, 1.0, 1.0, 1.2).is_some());
        assert!(pressed(name, 1.0, 1.0, 1.0 / 1.2).is_some());
        assert!(pressed(name, 1.0, 0.7, 1.0).is_some());
    }
}

#[test]
fn rubber_and_gains_at_their_bounds_are_not_reported() {
    for gain in [1.0, 1.012, 1.0145, 1.015] {
        assert_eq!(pressed("prototype", 0.88, 0.985, gain), None, "{gain}");
        assert_eq!(pressed("prototype", 1.12, 1.015, 2.0 - gain), None, "{gain}");
    }
}

#[test]
fn what_the_arm_may_add_excuses_as_much() {
    let rig = Rig::prototype();
    let tread = Tread::try_build(&rig).expect("in range");
    let relaxed = |arm_thrust: f64, compression: f64| {
        let mut state = TreadState::default();
        let (preload, compression) = (q16(40_000_000), Q16::from_num(compression));
        tread.begin(&mut state, (Travel::ZERO, None), preload, compression);
        (0..1000).any(|_| tread.rest(&mut state, preload, Q16::from_num(arm_thrust), compression))
    };
    let at = |force: f64| (force / stiffness(&rig)).powf(2.0 / 3.0);
    assert!(!relaxed(0.0, at(40.0 * 1.17)) && relaxed(0.0, at(40.0 * 1.25)));
    assert!(!relaxed(8.0, at(48.0 * 1.17)) && relaxed(8.0, at(40.0 * 0.75)));
    assert!(relaxed(0.0, 0.0), "a sensor that shows nothing");
}

proptest! {
    #[test]
    fn rubber_within_its_tolerance_is_not_reported(
        stiff in 0.88..1.12f64,
        load_gain in 0.985..1.015f64,
        tread_gain in 0.985..1.015f64,
    ) {
        prop_assert_eq!(pressed("prototype", stiff, load_gain, tread_gain), None);
    }

    #[test]
    fn a_relaxed_tread_carries_what_a_ring_does(compression in 0.1..0.9f64) {
        let rig = Rig::prototype();
        let tread = Tread::try_build(&rig).expect("in range");
        let mut state = TreadState::default();
        let shown = Q16::from_num(compression);
        tread.begin(&mut state, (Travel::ZERO, None), Q16::ZERO, shown);
        let load = tread.load(&mut state, Q16::ZERO, shown).0.to_num::<f64>();
        let exact = stiffness(&rig) * compression.powf(1.5);
        prop_assert!((load / exact - 1.0).abs() < 0.04, "{load} {exact}");
    }
}

proptest! {
    /// A wheel that speeds up against this load; no rolling resistance without compression.
    #[test]
    fn the_load_is_what_the_duty_is_beyond_speed_acceleration_and_gearbox(
        load in 0.0..20.0f64,
        speeds_up in 0.0..200.0f64,
        supply in 0.994..1.006f64,
    ) {
        for rig in [Rig::prototype(), Rig::fe()] {
            let tread = Tread::try_build(&rig).expect("in range");
            let mut state = begun(&tread);
            let pressed = q16(80_000_000);
            for _ in 0..u32::from(FORGETS + 2 * OFF_TICKS) {
                tread.rest(&mut state, pressed, Q16::ZERO, Q16::ZERO);
            }
            let (mut travel, mut speed, mut duty) = (0.0, 8.0, 0.0);
            let mass = 1e-3 * (rig.drive.reflected_mass_kg + rig.plant.moved_mass_kg);
            let shown = (0..2000).find_map(|_| {
                speed += 1e-3 * speeds_up;
                travel += 1e-3 * speed;
                let force = load + mass * speeds_up + GEARBOX * rig.drive.stall_force_n;
                duty = speed / rig.drive.no_load_speed_mm_s
                    + force / rig.drive.stall_force_n;
                let rolls = Rolls {
                    speed: Q16::from_num(speed),
                    duty: Q16::from_num(duty / supply),
                    ..rolling(Direction::Deploy, Travel::from_num(travel), pressed, Q16::ZERO)
                };
                tread.roll(&mut state, &rolls)
            });
            let shown = shown.expect("seen");
            let got = shown.load.expect("shows on the way out").to_num::<f64>();
            let sigma = shown.load_sigma.to_num::<f64>();
            // What the supply is off shows in the whole effort, the largest at the end.
            let most = 0.25 * sigma + (1.0 / supply - 1.0).abs() * duty * rig.drive.stall_force_n;
            prop_assert!((got - load).abs() < most, "{got} of {load}, {most}");
        }
    }
}

#[test]
fn it_is_compared_from_the_least_preload_on_and_after_its_ticks() {
    let rig = Rig::prototype();
    let tread = Tread::try_build(&rig).expect("in range");
    let reported = |preload: Newtons| {
        let mut state = TreadState::default();
        tread.begin(&mut state, (Travel::ZERO, None), preload, Q16::ZERO);
        (1..2000).find(|_| tread.rest(&mut state, preload, Q16::ZERO, Q16::ZERO))
    };
    let least = Q16::from_num(LEAST_PART * rig.preload.cruise_n);
    assert_eq!(reported(least - q16(10_000)), None);
    assert_eq!(reported(q16(1_000_000)), None);
    // The first of the ticks that it must be off is that at which enough is forgotten.
    let ticks = u32::from(FORGETS + OFF_TICKS) - 1;
    assert_eq!(reported(tread.least), Some(ticks));
    assert_eq!(reported(least + q16(10_000)), Some(ticks));
}
