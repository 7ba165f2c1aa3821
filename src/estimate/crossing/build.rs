//! Geometry of the crossing watch, once at start.

use super::CrossingWatch;
use crate::numeric::{LowPass, checked};
use crate::rig::{Rig, RigError};

/// Low-pass of the baseline on the continuous wall, s: averages the steps of the
/// angle code.
const BASELINE_S: f64 = 0.1;
/// Low-pass of the next wall's baseline, s.
const SETTLE_S: f64 = 0.02;

impl CrossingWatch {
    /// The watch of a rig.
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let (r, h) = (rig.rig.wheel_radius_mm, rig.rig.step_height_mm);
        Ok(Self {
            radius: checked("rig.wheel_radius_mm", r)?,
            step: checked("rig.step_height_mm", h)?,
            outermost: checked("rig.wall_radius_mm", rig.centre_radius_mm(0))?,
            baseline: LowPass::build(BASELINE_S),
            settle: LowPass::build(SETTLE_S),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Contact, CrossingEvent, WatchInput, WatchState};
    use super::*;
    use crate::units::Direction;
    use crate::units::{Q16, Travel, q16};
    use proptest::prelude::*;

    fn seen(radius: f64, compression: f64) -> WatchInput {
        WatchInput {
            radius: Q16::from_num(radius),
            compression: Q16::from_num(compression),
            preload: q16(33_300_000),
            travel: Travel::ZERO,
            near: false,
            over: false,
            clear: Some(true),
            short: q16(84_000),
        }
    }

    /// Rolls a wheel with constant corner depth over a step and returns the signs.
    fn roll(depth: f64, height: f64, direction: Direction) -> Vec<CrossingEvent> {
        roll_from(depth, height, direction, None)
    }

    /// The same from this place on the corner, known by the table alone.
    fn roll_from(
        depth: f64,
        height: f64,
        direction: Direction,
        from: Option<f64>,
    ) -> Vec<CrossingEvent> {
        let watch = CrossingWatch::try_build(&Rig::prototype()).unwrap();
        let mut state = WatchState::default();
        let flat = 0.3;
        let reach = 25.0 - depth;
        let mut signs = Vec::new();
        let track: Vec<f64> = (0..4000).map(|i| -20.0 + 0.01 * f64::from(i)).collect();
        let walk: Vec<f64> = match direction {
            Direction::Deploy => track,
            Direction::Retract => track.into_iter().rev().collect(),
        };
        let ahead = |x: &f64| match (from, direction) {
            (None, _) => true,
            (Some(from), Direction::Deploy) => *x >= from,
            (Some(from), Direction::Retract) => *x <= from,
        };
        for (index, x) in walk.into_iter().filter(ahead).enumerate() {
            // Height above the lower wall: resting on it, on the corner, on the upper.
            let over_corner =
                if x < 0.0 && x > -reach { height + (reach * reach - x * x).sqrt() } else { 0.0 };
            let flat_low = 25.0 - flat;
            let flat_high = if x >= 0.0 { height + 25.0 - flat } else { 0.0 };
            let y = over_corner.max(flat_low).max(flat_high);
            let compression = if x < 0.0 && over_corner > flat_low { depth } else { flat };
            let clear = match direction {
                Direction::Deploy => x > 4.0,
                Direction::Retract => x < -15.0,
            };
            // The next step is far.
            let near = x.abs() < 16.0 && state.contact != Contact::Leaving;
            let over = direction == Direction::Retract && x < -14.0;
            let now = WatchInput { near, over, clear: Some(clear), ..seen(150.0 - y, compression) };
            if index == 0 {
                let level = u8::from(direction == Direction::Retract);
                match from {
                    None => watch.begin(&mut state, &now),
                    Some(_) => watch.begin_between(&mut state, direction, level, &now),
                }
            }
            if let Some(sign) = watch.step(&mut state, direction, &now) {
                signs.push(sign);
            }
        }
        assert_eq!(
            state.contact,
            Contact::Wall,
            "{direction:?} {depth} {height} {signs:?} {state:?}"
        );
        signs
    }

    fn order(signs: &[CrossingEvent]) -> String {
        signs.iter().filter_map(|sign| format!("{sign:?}").chars().next()).collect()
    }

    #[test]
    fn a_step_gives_its_signs_once_in_order() {
        for direction in [Direction::Deploy, Direction::Retract] {
            assert_eq!(order(&roll(0.7, 4.0, direction)), "TLPG", "{direction:?}");
        }
    }

    #[test]
    fn begun_on_a_corner_a_step_gives_what_is_left_of_its_signs() {
        for from in [-12.0, -9.0, -5.0, -2.0] {
            for direction in [Direction::Deploy, Direction::Retract] {
                let signs = roll_from(0.7, 4.0, direction, Some(from));
                assert_eq!(order(&signs), "LPG", "{direction:?} from {from}");
            }
        }
    }

    proptest! {
        #[test]
        fn a_wheel_on_an_edge_tells_how_far_its_face_is(
            depth in 0.4..1.6f64,
            distance in 1.0..12.0f64,
            level in 0..3_u8,
        ) {
            let watch = CrossingWatch::try_build(&Rig::prototype()).unwrap();
            let height = 4.0 + ((25.0 - depth).powi(2) - distance.powi(2)).sqrt();
            let radius = 150.0 - 4.0 * f64::from(level) - height;
            let (radius_mm, depth_mm) = (Q16::from_num(radius), Q16::from_num(depth));
            let got = watch.to_edge(level, radius_mm, depth_mm).to_num::<f64>();
            prop_assert!((got - distance).abs() < 2e-3, "{got} for {distance}");
            let over = watch.height_over(level, radius_mm, depth_mm).to_num::<f64>();
            prop_assert!((over - (height - 25.0 + depth)).abs() < 1e-4);
        }

        #[test]
        fn gap_and_height_are_measured_by_geometry(
            depth in 0.4..1.6f64,
            height in 3.1..4.9f64,
            back in any::<bool>(),
        ) {
            let direction = if back { Direction::Retract } else { Direction::Deploy };
            // Height at which the watch takes the lower wall for left.
            let y = if back { 25.0 } else { 25.0 - 0.084 };
            let exact = ((25.0 - depth).powi(2) + height * (2.0 * y - height)).sqrt() - 25.0;
            for sign in roll(depth, height, direction) {
                match sign {
                    CrossingEvent::Lifted(lift) => {
                        let distance = ((25.0 - depth).powi(2) - (y - 4.0).powi(2)).sqrt();
                        // Back, a lower step is over before the arm says so.
                        let told = !back || height > 3.89;
                        let off = (lift.distance.to_num::<f64>() - distance).abs();
                        // The walk goes on by up to 0.01 mm after the wheel has come down.
                        let within = if back { 1.1e-2 } else { 1e-3 };
                        prop_assert!(!told || off < within, "{off}");
                    }
                    CrossingEvent::GapClosed(seen) => {
                        let far = |h: f64| ((25.0 - depth).powi(2) - (y - h).powi(2)).sqrt();
                        let moved = if back { 0.0 } else { far(height) - far(4.0) };
                        let off = |got: Q16, want: f64| (got.to_num::<f64>() - want).abs();
                        prop_assert!(off(seen.shift, moved) < 0.03, "{seen:?} {moved}");
                        prop_assert!(seen.plausible && off(seen.height, height) < 0.02);
                        prop_assert!(off(seen.gap, exact) < 0.02, "{seen:?} {exact}");
                    }
                    _ => {}
                }
            }
        }

        #[test]
        fn noise_below_the_threshold_is_no_step(seed in any::<u64>()) {
            let watch = CrossingWatch::try_build(&Rig::prototype()).unwrap();
            let mut state = WatchState::default();
            let mut x = seed | 1;
            watch.begin(&mut state, &seen(125.3, 0.3));
            for _ in 0..2000 {
                x ^= x << 13;
                x ^= x >> 7;
                x ^= x << 17;
                let noise = (x % 1000) as f64 * 1.2e-4 - 0.06;
                let sign = watch.step(&mut state, Direction::Deploy, &seen(125.3 + noise, 0.3));
                prop_assert_eq!(sign, None);
            }
        }
    }

    fn watch() -> CrossingWatch {
        CrossingWatch::try_build(&Rig::prototype()).expect("a sound rig")
    }

    #[test]
    fn an_edge_that_no_one_expects_is_felt_however_slowly_the_wheel_sinks_off_it() {
        let watch = watch();
        for speed in [0.5, 1.7, 30.0] {
            let mut state = WatchState::default();
            watch.begin(&mut state, &seen(121.3, 0.3));
            let touched = (0..20_000).map(|tick| 0.001 * speed * f64::from(tick)).find(|past| {
                let fallen = 25.0 - (25.0 * 25.0 - past * past).sqrt();
                let travel = Travel::from_num(-past);
                let at = WatchInput { travel, ..seen(121.3 + fallen, 0.3) };
                watch.step(&mut state, Direction::Retract, &at).is_some()
            });
            let off = state.baseline.output().to_num::<f64>() - 121.0;
            let past = touched.expect("an edge");
            assert!(past < 3.4 && off.abs() < 0.05, "{speed}: {past} {off}");
        }
    }

    #[test]
    fn at_rest_the_baseline_follows_a_wall_that_it_nearly_is_and_nothing_else() {
        let rested = |contact: Contact, off: f64| {
            let watch = watch();
            let mut state = WatchState::default();
            watch.begin(&mut state, &seen(125.0, 0.0));
            state.contact = contact;
            for _ in 0..1000 {
                watch.rest(&mut state, &seen(125.0 + off, 0.0));
            }
            state.baseline.output().to_num::<f64>() - 125.0
        };
        for off in [0.05, -0.05] {
            assert!((rested(Contact::Wall, off) - off).abs() < 1e-3, "{off}");
            for contact in [Contact::Both, Contact::Corner, Contact::Leaving] {
                assert!(rested(contact, off).abs() < 1e-9, "{contact:?}");
            }
        }
        for off in [0.2, -0.2] {
            assert!(rested(Contact::Wall, off).abs() < 1e-9, "{off}");
        }
    }

    #[test]
    fn a_corner_is_felt_from_its_rise_on_and_held_down_to_another() {
        // So high over a wall of 125 mm with the tread 0.5 mm deep.
        let high = |rise: Q16| {
            let wall = seen(125.5, 0.5);
            WatchInput { radius: wall.radius - rise, near: true, ..wall }
        };
        let out = Direction::Deploy;
        let signs = |rise: Q16| {
            let watch = watch();
            let mut state = WatchState::default();
            watch.begin(&mut state, &high(Q16::ZERO));
            (1..100)
                .find_map(|tick| watch.step(&mut state, out, &high(rise)).map(|sign| (sign, tick)))
        };
        let (touch, release) = (super::super::TOUCH, super::super::RELEASE);
        assert_eq!(signs(touch), Some((CrossingEvent::Touched, 3)));
        assert_eq!(signs(touch - Q16::DELTA), None);
        let after = |rise: Q16| {
            let watch = watch();
            let mut state = WatchState::default();
            watch.begin(&mut state, &high(Q16::ZERO));
            for _ in 0..3 {
                watch.step(&mut state, out, &high(touch));
            }
            assert_eq!(state.contact, Contact::Both);
            (1..200)
                .find_map(|tick| watch.step(&mut state, out, &high(rise)).map(|sign| (sign, tick)))
        };
        assert_eq!(after(release), None);
        assert_eq!(after(release - Q16::DELTA), Some((CrossingEvent::Released, 60)));
    }

    #[test]
    fn turned_back_on_a_corner_the_tread_still_keeps_what_the_wall_pressed() {
        let watch = watch();
        let mut state = WatchState::default();
        // Back over the edge between walls at 121 and 125 mm, 0.3 mm deep in the tread.
        watch.begin(&mut state, &seen(121.3, 0.3));
        let back = [(121.3, 0.3), (121.9, 0.6), (121.9, 0.6), (121.9, 0.6), (125.3, 0.7)];
        let signs: Vec<CrossingEvent> = back
            .iter()
            .filter_map(|at| watch.step(&mut state, Direction::Retract, &seen(at.0, at.1)))
            .collect();
        assert!(
            matches!(signs[..], [CrossingEvent::Touched, CrossingEvent::Lifted(_)]),
            "{signs:?}"
        );
        // And up again: the lower wall stops to carry that much before the undeformed wheel.
        watch.reverse(&mut state, Direction::Deploy);
        let kept = 0.084;
        let up = |radius: f64| seen(radius, 0.7);
        assert_eq!(watch.step(&mut state, Direction::Deploy, &up(125.0 + kept + 0.01)), None);
        let sign = watch.step(&mut state, Direction::Deploy, &up(125.0 + kept - 0.01));
        let Some(CrossingEvent::Lifted(lift)) = sign else { panic!("{sign:?}") };
        assert!((lift.height.to_num::<f64>() - (25.0 - kept)).abs() < 1e-3, "{lift:?}");
    }

    #[test]
    fn in_doubt_a_wall_is_where_the_ground_is_flat() {
        let watch = watch();
        let mut state = WatchState::default();
        watch.begin_on_corner(&mut state, Direction::Deploy, 1);
        let wall = watch.wall(1).to_num::<f64>();
        // From 4 mm before a face, over 3 mm of a wall, onto the corner behind it.
        let (mut at, mut measured) = (-4.0f64, None);
        while at < 6.0 {
            at += 0.01;
            let off = at.min(0.0).powi(2) / 50.0 - 0.08 * (at - 3.0).max(0.0);
            let ground = ((wall + off) / 0.04).round() * 0.04;
            let travel = Travel::from_num(at);
            let now = WatchInput { travel, near: true, clear: None, ..seen(ground, 0.0) };
            match watch.step(&mut state, Direction::Deploy, &now) {
                Some(CrossingEvent::GapClosed(_)) => measured = Some(at),
                Some(CrossingEvent::Touched) => break,
                _ => {}
            }
        }
        let base = state.baseline.output().to_num::<f64>() - wall;
        assert!(measured.is_some_and(|at| at < 3.0) && base.abs() < 0.06, "{measured:?} {base}");
        assert!((4.5..5.5).contains(&at), "felt at {at}");
    }

    #[test]
    fn the_next_corner_is_felt_before_the_wall_between_was_measured() {
        let again = super::super::AGAIN;
        let signs = |direction: Direction, beyond: Q16| {
            let watch = watch();
            let (mut state, level) =
                (WatchState::default(), u8::from(direction == Direction::Deploy));
            watch.begin_on_corner(&mut state, direction, level);
            // So far off the wall that this level has by the table, in the way of the run.
            let wall = watch.wall(level);
            let off = if direction == Direction::Deploy { -beyond } else { beyond };
            let at =
                WatchInput { radius: wall + off, near: true, clear: Some(false), ..seen(0.0, 0.0) };
            let sign = (1..50)
                .find_map(|tick| watch.step(&mut state, direction, &at).map(|sign| (sign, tick)));
            (sign, watch.rise(&state, direction, &at), state.contact)
        };
        for (direction, contact) in
            [(Direction::Deploy, Contact::Both), (Direction::Retract, Contact::Corner)]
        {
            let (sign, _, _) = signs(direction, again);
            assert_eq!(sign, None, "{direction:?}");
            let beyond = again + q16(10_000);
            let (sign, rise, now) = signs(direction, beyond);
            assert_eq!(
                sign,
                Some((CrossingEvent::Retouched { gap_as_table: Q16::ZERO }, 3)),
                "{direction:?}"
            );
            // From now on off that wall.
            assert_eq!((rise, now), (beyond, contact));
        }
    }

    #[test]
    fn back_over_a_step_lower_than_its_table_the_wall_carries_before_the_arm_says_so() {
        let watch = watch();
        let wall = seen(121.1, 0.1);
        let high = |rise: Q16| WatchInput { radius: wall.radius + rise, near: true, ..wall };
        let lifts = |rise: Q16| {
            let mut state = WatchState::default();
            watch.begin(&mut state, &wall);
            for _ in 0..3 {
                watch.step(&mut state, Direction::Retract, &high(super::super::TOUCH));
            }
            assert_eq!(state.contact, Contact::Corner);
            let sign = watch.step(&mut state, Direction::Retract, &high(rise));
            matches!(sign, Some(CrossingEvent::Lifted(_)))
        };
        let over = watch.step - super::super::OVER;
        assert!(over + wall.compression < watch.step);
        assert!(lifts(over) && !lifts(over - Q16::DELTA));
    }
}
