//! Plans and reviews on the preset rigs.

use super::*;
use crate::rig::Rig;
use crate::units::q16;

/// What the planner makes of a crossing whose gap is this much wider than it predicts, mm, after
/// what is known.
fn reviewed_after(wider: f64, trusted: bool, known: &Learned) -> Outcome {
    let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
    let mut review = Review {
        direction: Direction::Deploy,
        speed: q16(8_000_000),
        preload: q16(47_000_000),
        tan_arm: q16(1_000_000),
        gap: Millimetres::from_num(2.5),
        seen: Millimetres::from_num(2.5),
        trusted: false,
        slipped: false,
    };
    let predicted = planner.review(&review, known).gap_predicted;
    review.gap = predicted + Millimetres::from_num(wider);
    review.trusted = trusted;
    planner.review(&review, known)
}

/// The same of a tread as known.
fn reviewed(wider: f64, trusted: bool) -> Outcome {
    reviewed_after(wider, trusted, &Learned::default())
}

/// Scale that a crossing whose gap is this much wider shows, mm.
fn observed(wider: f64) -> f64 {
    let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
    let at = Point::nominal(Direction::Deploy, q16(8_000_000));
    let force = q16(47_000_000) + planner.thrust(&Learned::default(), q16(1_000_000));
    let gap = planner.model.crossing(&at, force).gap + Millimetres::from_num(wider);
    planner.model.observed_scale(&at, gap, force).to_num()
}

#[test]
fn a_gap_that_no_tread_of_the_rig_makes_is_strange() {
    for wider in [0.0, 0.05, -0.05] {
        assert!(!reviewed(wider, true).strange, "{wider}");
    }
    for wider in [0.5, -0.4] {
        assert!(reviewed(wider, true).strange, "{wider}");
        // Of a crossing that is not trusted nothing is concluded.
        let outcome = reviewed(wider, false);
        assert!(!outcome.strange && outcome.learned == Learned::default(), "{wider}");
    }
}

#[test]
fn a_far_stiffer_tread_is_learned_at_once_and_noise_by_half() {
    let scale = |wider: f64| reviewed(wider, true).learned.scale.to_num::<f64>();
    assert!(observed(0.2) > 1.25 && scale(0.2) > 1.0 + 0.9 * (observed(0.2) - 1.0));
    assert!((1.0..1.08).contains(&observed(0.02)));
    assert!((scale(0.02) - observed(0.02).sqrt()).abs() < 2e-3, "{}", scale(0.02));
}

#[test]
fn two_gaps_that_agree_override_what_was_known_of_the_stiffness() {
    // Rubber as known, after a guess twice as stiff; and a softer tread than known, of which the
    // first gap is taken by half only.
    for (known, softer) in [(2.0, 0.0), (1.0, -0.17)] {
        let known = Learned { scale: Ratio::from_num(known), ..Learned::default() };
        let gap = reviewed(softer, true).gap_predicted + Millimetres::from_num(softer);
        let again = |known: &Learned| {
            let wider = gap - reviewed_after(0.0, true, known).gap_predicted;
            reviewed_after(wider.to_num(), true, known).learned
        };
        let first = again(&known);
        let second = again(&first);
        let (from, to) = (known.scale.to_num::<f64>(), observed(softer));
        let [first, second] = [first, second].map(|learned| learned.scale.to_num::<f64>());
        assert!(first > (from * to).sqrt() * 0.98, "{first} of {from} to {to}");
        assert!((second / to - 1.0).abs() < 0.05, "{second} of {to}");
    }
}

#[test]
fn a_tread_that_is_not_as_known_is_learned_by_the_most_but_not_at_once() {
    let learned = |unknown| {
        let known = Learned {
            scale: q16(1_400_000),
            deviation: SHOWN_DEVIATION,
            unknown,
            ..Learned::default()
        };
        reviewed_after(-0.2, true, &known).learned
    };
    // Of what is observed as much as the variances say: 0.058 of 0.060 and of 0.098.
    let (unknown, known) = (learned(true), learned(false));
    assert!(known.scale < unknown.scale && unknown.scale < q16(1_400_000));
    assert!(unknown.deviation > known.deviation && known.deviation == KNOWN_DEVIATION);
}

#[test]
fn what_grips_may_be_used_and_what_slips_may_not() {
    let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
    let of = |grips: i64, slips: i64| {
        let learned = Learned { grips: q16(grips), slips: q16(slips), ..Learned::default() };
        let (friction, usable) = planner.friction_of(&learned);
        (friction.to_num::<f64>(), usable.to_num::<f64>())
    };
    let near = |got: (f64, f64), friction: f64, usable: f64| {
        assert!((got.0 - friction).abs() < 1e-3 && (got.1 - usable).abs() < 1e-3, "{got:?}");
    };
    near(of(0, 9_000_000), 1.1, 1.0);
    near(of(1_050_000, 9_000_000), 1.1, 1.05);
    near(of(0, 800_000), 0.8, 0.76);
    near(of(790_000, 800_000), 0.8, 0.79);
    assert_eq!(reviewed(0.0, true).learned.slips, Ratio::MAX);
    assert!(reviewed(0.0, true).learned.grips > q16(500_000));
}

#[test]
fn a_slip_is_planned_with_and_one_that_no_choice_avoids_stops() {
    let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
    let plan = |slipped: Option<i64>| {
        let slipped = slipped.map(Newtons::from_num);
        planner.plan(&PlanRequest { slipped, ..request(Direction::Deploy) })
    };
    let grips = plan(None);
    assert!(!grips.short && grips.slips == Ratio::MAX);
    // At less than the limit's preload: that needs less, and it is crossed slower.
    let slipped = plan(Some(48));
    assert!(!slipped.short && slipped.slips < planner.friction, "{slipped:?}");
    assert!(slipped.cross_speed < grips.cross_speed && slipped.slip_margin < grips.slip_margin);
    // At the limit nothing is left.
    assert!(plan(Some(60)).short);
}

#[test]
fn friction_slows_only_where_that_buys_margin_worth_its_time() {
    // The need falls by 0.015 from 20 mm/s to the least speed.
    for mu in [0.78, 0.80, 0.81, 0.82] {
        let mut rig = Rig::prototype();
        rig.plant.mu = mu;
        let planner = Planner::try_build(&rig).expect("a sound rig");
        let plan = planner.plan(&request(Direction::Retract));
        assert!(plan.cross_speed > q16(8_000_000), "{mu} {plan:?}");
        assert!(plan.slip_margin > q16(20_000), "{mu} {plan:?}");
    }
}

#[test]
fn a_load_presses_by_the_arm_and_is_lifted_by_friction() {
    let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
    let plan = |extra: i64| {
        let learned = Learned { extra_load: Newtons::from_num(extra), ..Learned::default() };
        planner.plan(&PlanRequest { learned, ..request(Direction::Deploy) })
    };
    let (known, more) = (plan(0), plan(8));
    // 1.05 of the load presses, 0.6 is lost to its lift: the gap lets the wheel go faster.
    assert!(more.cross_speed > known.cross_speed, "{more:?}");
    assert!(more.slip_margin < known.slip_margin, "{more:?}");
    // By the model of a rig with that load.
    let mut rig = Rig::prototype();
    rig.plant.top_load_n += 24.0;
    rig.control.gap_ref_mm = planner.gap_ref(Direction::Deploy).to_num();
    let loaded = Planner::try_build(&rig).expect("a sound rig").plan(&request(Direction::Deploy));
    let part = more.cross_speed.to_num::<f64>() / loaded.cross_speed.to_num::<f64>();
    assert!((part - 1.0).abs() < 0.1, "{part}");
    let margin = (more.slip_margin - loaded.slip_margin).to_num::<f64>();
    assert!(margin.abs() < 0.02, "{margin}");
}

/// A request for the second step with the limit's preload reached.
fn request(direction: Direction) -> PlanRequest {
    PlanRequest {
        sequence: 1,
        direction,
        step: 2,
        learned: Learned::default(),
        preload: q16(50_000_000),
        distance: q16(22_000_000),
        review: None,
        slipped: None,
    }
}

/// A tread of this scale.
fn stiff(scale: Ratio) -> Learned {
    Learned { scale, ..Learned::default() }
}

#[test]
fn the_friction_is_checked_at_the_speed_of_the_crossing() {
    let (mut smaller, mut whole) = (0, 0);
    for mu in [0.5, 0.6, 0.7, 0.8, 0.9, 1.1] {
        let mut rig = Rig::prototype();
        rig.plant.mu = mu;
        let Ok(planner) = Planner::try_build(&rig) else { continue };
        for direction in Direction::ALL {
            let at = Point::nominal(direction, planner.least_speed);
            let bounds = (planner.least_speed, planner.cruise_speed);
            let preload = planner.most_preload;
            let found = planner.gripping(&request(direction), &at, preload, Q16::ZERO, bounds);
            let used = planner.model.utilisation(&Point { speed: found.speed, ..at }, found.gap);
            assert!(!found.holds || used < planner.friction, "{mu} {direction:?} {used}");
            let target = planner.target(direction, Ratio::ONE);
            // No gap is given up for nothing: with the next larger one it would slip.
            let larger = divide(found.gap, q16(992_000));
            if found.gap < target {
                let (low, high) = bounds;
                let speed = planner.model.speed(&at, larger, preload, low, high);
                let used = planner.model.utilisation(&Point { speed, ..at }, larger);
                assert!(used > planner.usable, "{mu} {direction:?} {used}");
            }
            smaller += u32::from(found.gap < target);
            whole += u32::from(found.gap == target && found.speed > planner.least_speed);
        }
    }
    assert!(smaller > 0 && whole > 0, "{smaller} {whole}");
}

#[test]
fn the_preload_chosen_is_the_one_that_is_over_the_step_soonest() {
    let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
    let preload = |standing: f64, distance: f64| {
        let request = PlanRequest {
            step: 1,
            preload: Newtons::from_num(standing),
            distance: Millimetres::from_num(distance),
            ..request(Direction::Deploy)
        };
        planner.plan(&request).cross_preload
    };
    // Built already, or with time to build it: more is faster. From nothing, close to the step,
    // the time to build it costs more than the slower crossing.
    assert!(preload(50.0, 18.0) > q16(45_000_000));
    assert!(preload(0.0, 75.0) > q16(45_000_000));
    assert!(preload(0.0, 18.0) < q16(36_000_000));
}

#[test]
fn the_crossing_speed_is_reached_before_lift_off_and_in_time_from_the_window() {
    for rig in [Rig::prototype(), Rig::fe()] {
        let planner = Planner::try_build(&rig).expect("a sound rig");
        for direction in Direction::ALL {
            let plan = planner.plan(&request(direction));
            let (lift, to) = (planner.lift(direction, plan.gap), &plan.approach);
            assert!(to.slow_from >= to.release_from && to.release_from >= lift, "{plan:?}");
            assert!(to.ready_from > lift && to.window_from > to.slow_from, "{plan:?}");
            assert!(to.window_speed >= to.slowest_speed && plan.cross_speed >= to.slowest_speed);
            // Where it speeds up again at once, it may be slowest as late as at lift-off.
            let tolerance = if to.release_time > Q16::ZERO {
                planner.tolerance.half()
            } else {
                planner.tolerance
            };
            let distance = planner.timing.brake_distance(to.window_speed, to.slowest_speed);
            let room = to.window_from - tolerance - to.slow_from + (to.release_from - lift);
            assert!(to.window_speed == to.slowest_speed || distance <= room, "{plan:?}");
        }
    }
}

#[test]
fn only_a_tread_as_known_is_crossed_with_a_dip_and_below_the_cruise_preload() {
    let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
    let at = |scale: i64, direction| {
        let request = PlanRequest {
            step: 1,
            preload: Q16::ZERO,
            distance: q16(18_000_000),
            learned: stiff(q16(scale)),
            ..request(direction)
        };
        planner.plan(&request)
    };
    let known = at(1_000_000, Direction::Deploy);
    assert!(known.approach.release_time > Q16::ZERO, "{known:?}");
    assert!(known.approach.slowest_speed < known.cross_speed, "{known:?}");
    assert!(known.cross_preload < planner.cruise_preload, "{known:?}");
    for plan in [at(1_160_000, Direction::Deploy), at(1_000_000, Direction::Retract)] {
        assert_eq!(plan.approach.release_time, Q16::ZERO, "{plan:?}");
        assert_eq!(plan.approach.slowest_speed, plan.cross_speed, "{plan:?}");
    }
    assert!(at(1_160_000, Direction::Deploy).cross_preload >= planner.cruise_preload);
}

#[test]
fn the_reserve_is_halved_by_a_crossing_as_predicted_and_grows_with_what_is_missed() {
    let after = |wider: f64| reviewed(wider, true).learned.reserve.to_num::<f64>();
    assert!((after(0.0) - 0.5).abs() < 0.01, "{}", after(0.0));
    // As much of the gap missed as the prototype's reserve.
    let grown = after(Rig::prototype().control.gap_reserve * 2.5);
    assert!((1.3..1.7).contains(&grown), "{grown}");
    assert_eq!(reviewed(0.15, true).learned.reserve, MOST_RESERVE);
    assert_eq!(reviewed(0.15, false).learned.reserve, Ratio::ONE);
}

#[test]
fn a_crossing_slowed_by_its_preload_is_reported() {
    let (mut limited, mut free) = (0, 0);
    for gap_mm in [0.0, 1.5, 1.75, 2.0, 2.25, 2.5] {
        for (planner, plan) in plans(|rig| rig.control.gap_ref_mm = gap_mm) {
            let reported = plan.limits.contains(&Some(Limit::PreloadLimited));
            let floored = plan.limits.contains(&Some(Limit::SpeedFloor));
            let at_limit = plan.cross_preload >= planner.most_preload * q16(980_000);
            let slow = plan.cross_speed < planner.safe_speed;
            assert_eq!(reported, at_limit && slow && !floored, "{gap_mm} {plan:?}");
            limited += u32::from(reported);
            free += u32::from(!reported && !floored);
        }
    }
    assert!(limited > 0 && free > 0, "{limited} {free}");
}

/// Plans of a rig that is changed like this, in both directions, for treads around the nominal.
fn plans(change: impl Fn(&mut Rig)) -> Vec<(Planner, Plan)> {
    let mut rig = Rig::prototype();
    change(&mut rig);
    let Ok(planner) = Planner::try_build(&rig) else { return Vec::new() };
    let cases =
        [0.8, 1.0, 1.25].into_iter().flat_map(|s| Direction::ALL.map(|direction| (s, direction)));
    cases
        .map(|(scale, direction)| {
            let request =
                PlanRequest { learned: stiff(Ratio::from_num(scale)), ..request(direction) };
            (planner.clone(), planner.plan(&request))
        })
        .collect()
}

#[test]
fn a_crossing_that_no_speed_makes_narrow_enough_is_reported() {
    let (mut floored, mut free) = (0, 0);
    for gap_mm in [0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5] {
        for (planner, plan) in plans(|rig| rig.control.gap_ref_mm = gap_mm) {
            let reported = plan.limits.contains(&Some(Limit::SpeedFloor));
            let slowest = plan.cross_speed <= planner.least_speed;
            let hardest = plan.cross_preload == planner.most_preload;
            let wide = plan.gap > planner.target(plan.direction, Ratio::ONE);
            assert_eq!(reported, slowest && hardest && wide, "{gap_mm} {plan:?}");
            floored += u32::from(reported);
            free += u32::from(!reported);
        }
    }
    assert!(floored > 0 && free > 0, "{floored} {free}");
}

#[test]
fn a_crossing_that_leaves_too_little_friction_is_reported() {
    let (mut slips, mut grips) = (0, 0);
    for mu in [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1] {
        for (planner, plan) in plans(|rig| rig.plant.mu = mu) {
            let reported = plan.limits.contains(&Some(Limit::SlipMarginLow));
            let wanted = planner.friction - planner.usable;
            assert_eq!(reported, plan.slip_margin < wanted, "{mu} {plan:?}");
            // Reported or not, the margin is what the friction leaves.
            let margin = plan.slip_margin.to_num::<f64>();
            assert!(margin < mu && (wanted.to_num::<f64>() - 0.1).abs() < 1e-4, "{mu} {margin}");
            slips += u32::from(reported);
            grips += u32::from(!reported);
        }
    }
    assert!(slips > 0 && grips > 0, "{slips} {grips}");
}

#[test]
fn at_the_least_speed_the_wheel_stays_slow_beyond_the_predicted_lift_off() {
    let planner = Planner::try_build(&Rig::prototype()).expect("a sound rig");
    for (scale, beyond) in [(1_300_000, false), (3_000_000, true)] {
        let request = PlanRequest { learned: stiff(q16(scale)), ..request(Direction::Deploy) };
        let plan = planner.plan(&request);
        assert_eq!(plan.cross_speed == planner.least_speed, beyond, "{plan:?}");
        let further = plan.approach.lift - plan.approach.release_from;
        assert_eq!(further > q16(500_000), beyond, "{further}");
    }
}

#[test]
fn a_plan_names_what_keeps_the_crossing_from_being_faster() {
    let named = |mu: f64, change: &dyn Fn(&mut PlanRequest), rig: &dyn Fn(&mut Rig)| {
        let mut prototype = Rig::prototype();
        prototype.plant.mu = mu;
        rig(&mut prototype);
        let mut request = request(Direction::Deploy);
        change(&mut request);
        Planner::try_build(&prototype).expect("a sound rig").plan(&request).limited_by
    };
    let as_it_is = |_: &mut PlanRequest| {};
    let from_nothing = |request: &mut PlanRequest| {
        (request.step, request.preload, request.distance) = (1, Q16::ZERO, q16(18_000_000));
    };
    let prototype = |_: &mut Rig| {};
    assert_eq!(named(1.1, &as_it_is, &prototype), LimitedBy::Preload);
    assert_eq!(named(1.1, &from_nothing, &prototype), LimitedBy::Slew);
    assert_eq!(named(0.82, &as_it_is, &prototype), LimitedBy::Friction);
    let stiff = |request: &mut PlanRequest| request.learned = stiff(q16(3_000_000));
    assert_eq!(named(1.1, &stiff, &prototype), LimitedBy::LeastSpeed);
    let slow_drive = |rig: &mut Rig| {
        (rig.drive.cruise_speed_mm_s, rig.control.safe_speed_mm_s) = (6.0, 5.0);
    };
    assert_eq!(named(1.1, &as_it_is, &slow_drive), LimitedBy::Drive);
    // Back, with some preload the speed that holds the gap excites a mode.
    let excited = (20..50).any(|standing| {
        let back = |request: &mut PlanRequest| {
            (request.direction, request.step) = (Direction::Retract, 3);
            (request.preload, request.distance) = (Q16::from_num(standing), q16(18_000_000));
        };
        named(1.1, &back, &prototype) == LimitedBy::Resonance
    });
    assert!(excited);
}
