//! The model's other quantities against the formulas.

use interstage::model::effective_stiffness::Kind;
use interstage::model::formula::Formula;
use interstage::model::reduced::ReducedModel;
use interstage::model::{Learned, PlanRequest, Planner};
use interstage::rig::{Rig, RigError};
use interstage::units::{Direction, Q16};

#[test]
fn stiffness_times_the_relaxed_force_is_the_force() {
    let rig = Rig::fe();
    let formula = Formula::new(&rig);
    for direction in Direction::ALL {
        for speed in [0.5, 5.0, 8.0, 30.0] {
            for gap in [1.4, 1.8, 2.2] {
                let kind = Kind { direction, driven: false };
                let force = formula.force_n(direction, speed, gap, None);
                let product = formula.stiffness(direction, speed, gap, None)
                    * formula.relaxed_force_n(kind, gap);
                assert!((force / product - 1.0).abs() < 1e-9, "{force} {product}");
            }
        }
        let slow = formula.stiffness(direction, 1e-6, 1.8, None);
        let fast = formula.stiffness(direction, 1e6, 1.8, None);
        assert!(slow < 1.01 && fast > slow && fast < rig.tread.stiffening * 1.01, "{slow} {fast}");
    }
}

#[test]
fn the_depth_at_the_corner_is_the_formulas() {
    for rig in [Rig::prototype(), Rig::fe()] {
        let (formula, model) = (Formula::new(&rig), ReducedModel::try_build(&rig).unwrap());
        let (least, most) = model.gap_range();
        for part in 0..=20 {
            let gap = least + (most - least) * Q16::from_num(0.05 * f64::from(part));
            let depth: f64 = model.depth(gap).to_num();
            let exact = formula.depth_mm(gap.to_num());
            assert!((depth - exact).abs() < 4e-3 * exact.max(0.1), "{gap}: {depth} {exact}");
        }
    }
}

#[test]
fn a_prescribed_speed_is_planned() {
    let request = PlanRequest {
        sequence: 1,
        direction: Direction::Deploy,
        step: 1,
        learned: Learned::default(),
        preload: Q16::from_num(50),
        distance: Q16::from_num(4),
        review: None,
        slipped: None,
    };
    let planner = || Planner::try_build(&Rig::prototype()).unwrap();
    let plan = |uniform| planner().with_speed(6.0, uniform).unwrap().plan(&request);
    let six = Q16::from_num(6);
    assert_eq!(plan(false).cross_speed, six);
    assert_ne!(plan(false).cruise_speed, six);
    assert_eq!((plan(true).cross_speed, plan(true).cruise_speed), (six, six));
    assert_ne!(planner().plan(&request).cross_speed, six);
    assert!(matches!(planner().with_speed(1e9, false), Err(RigError::OutOfRange { .. })));
}
