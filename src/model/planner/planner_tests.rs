//! Plans and reviews on the preset rigs.

use super::*;
use crate::model::history::History;
use crate::model::plan::KNOWN_DEVIATION;
use crate::model::plan::{Outcome, Strategy};
use crate::rig::Rig;
use crate::units::q16;
use proptest::prelude::{any, prop_assert, proptest};

fn planner() -> Planner {
    Planner::try_build(&Rig::prototype()).expect("a sound rig")
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
        speed: Q16::ZERO,
        searching: false,
        review: None,
        slipped: None,
    }
}

/// What the planner makes of a crossing at 8 mm/s whose gap is this much wider than it predicts, mm,
/// after what is known.
fn reviewed_after(wider: f64, trusted: bool, known: &Learned) -> Outcome {
    let planner = planner();
    let mut review = Review {
        direction: Direction::Deploy,
        history: History::steady(25, q16(54_000_000)),
        distance: q16(12_000_000),
        held: q16(8_000_000),
        felt_at: None,
        tan_arm: q16(1_000_000),
        gap_as_table: Millimetres::from_num(2.5),
        gap: Millimetres::from_num(2.5),
        trusted: false,
        slipped: false,
    };
    let review_of = |review: &Review| {
        let state = &mut TreadState::default();
        block_on(planner.review((state, &mut async || ()), review, known))
    };
    let predicted = review_of(&review).gap_predicted;
    review.gap_as_table = predicted + Millimetres::from_num(wider);
    review.trusted = trusted;
    review_of(&review)
}

/// The same of a tread as known.
fn reviewed(wider: f64, trusted: bool) -> Outcome {
    reviewed_after(wider, trusted, &Learned::default())
}

#[test]
fn the_gap_of_a_review_is_that_of_a_plan_which_crosses_likewise() {
    // Rolled through its own history the planned crossing has the planned gap, but that the wheel, and
    // not the axle, then has the speed.
    let planner = planner();
    let predicted = reviewed(0.0, false).gap_predicted.to_num::<f64>();
    let speed = Planner::try_build_as(&Rig::prototype(), Strategy::Limit)
        .and_then(|planner| planner.with_speed(8.0, true))
        .expect("a sound rig");
    let plan = speed.plan(&request(Direction::Deploy));
    let planned = plan.gap.to_num::<f64>();
    assert!((predicted / planned - 1.0).abs() < 0.03, "{predicted} {planned}");
    assert!(planned < 1.05 * planner.gap_ref(Direction::Deploy).to_num::<f64>(), "{planned}");
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
fn a_wide_gap_is_believed_at_once_and_a_narrow_one_when_the_next_agrees() {
    let wide = reviewed(0.5, true).learned;
    assert!(wide.scale > q16(1_800_000) && wide.unknown, "{wide:?}");
    let noise = reviewed(0.02, true).learned;
    assert!((1.0..1.04).contains(&noise.scale.to_num::<f64>()) && !noise.unknown, "{noise:?}");
    assert!(noise.deviation < KNOWN_DEVIATION);
    let once = reviewed(-0.4, true).learned;
    assert!(once.scale > q16(800_000) && once.deviation > q16(200_000), "{once:?}");
    let twice = reviewed_after(-0.4, true, &once).learned;
    assert!(twice.scale < once.scale - q16(30_000), "{twice:?}");
}

#[test]
fn a_first_crossing_clears_a_tread_that_is_softer_than_it_seemed() {
    let shown = Learned {
        scale: q16(1_160_000),
        deviation: SHOWN_DEVIATION,
        unknown: true,
        ..Learned::default()
    };
    assert!(!reviewed_after(-0.3, true, &shown).learned.unknown);
    assert!(reviewed_after(0.1, true, &shown).learned.unknown);
    // Later it has to be shown by the deviation.
    let later = Learned { grips: q16(500_000), ..shown };
    assert!(reviewed_after(-0.3, true, &later).learned.unknown);
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
    let planner = planner();
    let plan = |slipped: Option<i64>| {
        let slipped = slipped.map(Newtons::from_num);
        planner.plan(&PlanRequest { slipped, ..request(Direction::Deploy) })
    };
    let grips = plan(None);
    assert!(!grips.short && grips.slips == Ratio::MAX);
    // At less than the limit's preload: that needs less.
    let slipped = plan(Some(40));
    assert!(!slipped.short && slipped.slips < planner.friction, "{slipped:?}");
    assert!(slipped.slip_margin < grips.slip_margin);
    // At the limit nothing is left.
    assert!(plan(Some(64)).short);
}

#[test]
fn friction_slows_only_where_that_buys_margin_worth_its_time() {
    for mu in [0.78, 0.80, 0.81, 0.82] {
        let mut rig = Rig::prototype();
        rig.plant.mu = mu;
        let planner = Planner::try_build(&rig).expect("a sound rig");
        let plan = planner.plan(&request(Direction::Retract));
        assert!(plan.cross_speed > q16(8_000_000), "{mu} {plan:?}");
        assert!(plan.slip_margin > Ratio::ZERO, "{mu} {plan:?}");
    }
}

#[test]
fn a_load_presses_by_the_arm_and_is_lifted_by_friction() {
    let planner = planner();
    let request = request(Direction::Deploy);
    let approach = planner.plan(&request).approach;
    let rolled = |extra: i64| {
        let learned = Learned { extra_load: Newtons::from_num(extra), ..Learned::default() };
        let scene = planner.scene(&PlanRequest { learned, ..request }, planner.cruise_speed);
        let mut state = TreadState::default();
        block_on(planner.roll_out((&mut state, &mut async || ()), &scene, &approach))
    };
    let (known, more) = (rolled(0), rolled(8));
    // 1.05 of the load presses, 0.6 is lost to its lift.
    assert!(more.gap < known.gap, "{more:?} {known:?}");
    assert!(more.utilisation > known.utilisation, "{more:?} {known:?}");
}

proptest! {
    #[test]
    fn every_plan_keeps_its_gap_or_says_why_not(
        back in any::<bool>(),
        scale in 0.8..3.0f64,
        deviation in 0.02..0.3f64,
        preload in 0.0..48.0f64,
        distance in 5.0..40.0f64,
        unknown in any::<bool>(),
    ) {
        let planner = planner();
        let direction = if back { Direction::Retract } else { Direction::Deploy };
        let learned = Learned {
            scale: Ratio::from_num(scale),
            deviation: Ratio::from_num(deviation),
            unknown,
            ..Learned::default()
        };
        let (preload, distance) = (Newtons::from_num(preload), Millimetres::from_num(distance));
        let request = PlanRequest { learned, preload, distance, speed: q16(1_000_000), ..request(direction) };
        let (mut pauses, state) = (0, &mut TreadState::default());
        let plan = block_on(planner.plan_pausing(state, &request, async || pauses += 1));
        // By these the board has its answer in time.
        prop_assert!(distance > q16(12_000_000) || pauses < 1150, "{pauses}");
        let target = planner.aimed[direction as usize];
        let wide = plan.gap > target + target * SAME_GAP;
        prop_assert!(plan.gap > Q16::ZERO);
        prop_assert!(!wide || plan.limits.contains(&Some(Limit::SpeedFloor)), "{plan:?}");
        let approach = &plan.approach;
        prop_assert!(approach.slowest_speed <= approach.window_speed);
        prop_assert!(approach.window_speed <= planner.cruise_speed);
        prop_assert!(approach.slowest_speed >= planner.least_speed.min(approach.window_speed));
        prop_assert!(plan.cross_preload <= planner.most_preload.max(preload));
    }
}

#[test]
fn a_stiffer_tread_and_less_preload_are_crossed_slower() {
    let planner = planner();
    for direction in [Direction::Deploy, Direction::Retract] {
        let slowest = |scale: i64, preload: i64| {
            let learned = Learned { scale: q16(scale), ..Learned::default() };
            let preload = q16(preload);
            let mut constant = planner.clone();
            constant.most_preload = preload;
            let request = PlanRequest { learned, preload, ..request(direction) };
            constant.plan(&request).approach.slowest_speed
        };
        assert!(slowest(1_300_000, 47_000_000) < slowest(1_000_000, 47_000_000));
        assert!(slowest(1_000_000, 40_000_000) < slowest(1_000_000, 47_000_000));
    }
}

#[test]
fn a_search_that_no_speed_suits_is_at_the_safe_speed() {
    let planner = planner();
    let learned = Learned { scale: q16(1_500_000), ..Learned::default() };
    let [known, searching] = [false, true].map(|searching| {
        let distance = q16(18_000_000);
        let request = PlanRequest { learned, distance, searching, ..request(Direction::Retract) };
        planner.plan(&request)
    });
    assert!(known.gap > planner.aimed[1], "{known:?}");
    let slowest = [known, searching].map(|plan| plan.approach.slowest_speed);
    assert_eq!(slowest, [planner.least_speed, planner.safe_speed]);
    for plan in [known, searching] {
        assert_eq!(plan.limited_by, LimitedBy::LeastSpeed);
        assert!(plan.limits.contains(&Some(Limit::SpeedFloor)));
    }
}

#[test]
fn a_speed_at_which_an_unknown_tread_has_kept_the_gap_is_kept() {
    let planner = planner();
    let slowest = |trusted: bool, gap: i64| {
        let review = Review {
            direction: Direction::Retract,
            history: History::steady(40, q16(47_000_000)),
            distance: q16(12_000_000),
            held: q16(-12_000_000),
            felt_at: None,
            tan_arm: q16(1_000_000),
            gap_as_table: q16(2_600_000),
            gap: q16(gap),
            trusted,
            slipped: false,
        };
        let learned = Learned { scale: q16(1_500_000), unknown: true, ..Learned::default() };
        let review = Some(review);
        let request = PlanRequest { learned, review, ..request(Direction::Retract) };
        planner.plan(&request).approach.slowest_speed.to_num::<f64>()
    };
    assert!((slowest(true, 2_300_000) - 5.0).abs() < 0.01);
    // Not where it was wider than the reference, or odd.
    let least = planner.least_speed.to_num::<f64>();
    assert_eq!([slowest(true, 2_400_000), slowest(false, 2_300_000)], [least; 2]);
}

#[test]
fn a_corner_that_is_felt_late_is_crossed_within_the_same_gap() {
    let planner = planner();
    let plan = |late: i64, unknown: bool| {
        let learned = Learned { felt_late: [q16(late); 2], unknown, ..Learned::default() };
        planner.plan(&PlanRequest { learned, ..request(Direction::Deploy) })
    };
    for late in (0..=600_000).step_by(100_000) {
        assert!(plan(late, false).gap <= planner.aimed[0], "{late}");
    }
    // Of a tread that is not as known it is not known how late.
    assert_eq!(plan(0, true).approach, plan(600_000, true).approach);
}

#[test]
fn a_preload_that_rises_is_planned_with() {
    let planner = planner();
    let at = |preload: i64| {
        planner.plan(&PlanRequest {
            step: 1,
            preload: q16(preload),
            distance: q16(18_000_000),
            ..request(Direction::Deploy)
        })
    };
    let (empty, full) = (at(0), at(50_000_000));
    assert!(empty.cross_preload < full.cross_preload - q16(5_000_000), "{empty:?}");
    assert_eq!(empty.limited_by, LimitedBy::Slew);
    assert_eq!(empty.ramp_preload, planner.most_preload);
    // Not below that with which it rolls.
    assert!(empty.cross_preload > planner.rolling_preload);
}

#[test]
fn a_plan_names_what_keeps_the_crossing_from_being_faster() {
    let by = |change: &dyn Fn(&mut Rig), direction| {
        let mut rig = Rig::prototype();
        change(&mut rig);
        let planner = Planner::try_build(&rig).expect("a sound rig");
        planner.plan(&request(direction)).limited_by
    };
    assert_eq!(by(&|_| (), Direction::Deploy), LimitedBy::Preload);
    assert_eq!(by(&|_| (), Direction::Retract), LimitedBy::Drive);
    let little = |rig: &mut Rig| (rig.plant.mu, rig.plant.top_load_share) = (0.85, 0.7);
    assert_eq!(by(&little, Direction::Deploy), LimitedBy::Friction);
    let narrow = |rig: &mut Rig| rig.control.gap_ref_mm = 2.1;
    assert_eq!(by(&narrow, Direction::Deploy), LimitedBy::LeastSpeed);
}

#[test]
fn the_other_strategies_keep_to_theirs() {
    let plan = |strategy| {
        let planner = Planner::try_build_as(&Rig::prototype(), strategy).expect("a sound rig");
        let plan = planner
            .plan(&PlanRequest { preload: planner.between_steps(), ..request(Direction::Deploy) });
        (planner, plan)
    };
    let (planner, constant) = plan(Strategy::Constant);
    assert_eq!(constant.ramp_preload, planner.cruise_preload);
    let (planner, limit) = plan(Strategy::Limit);
    assert_eq!(limit.cruise_preload, planner.most_preload);
    let (_, reactive) = plan(Strategy::Reactive);
    assert!(!reactive.look_ahead && reactive.cross_preload < planner.most_preload);
    let speeds = [&constant, &reactive, &limit].map(|plan| plan.approach.slowest_speed);
    assert!(speeds.is_sorted() && speeds[0] < speeds[2], "{speeds:?}");
}
