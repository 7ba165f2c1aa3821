//! A planner that holds a given speed.

use interstage::model::{Learned, PlanRequest, Planner};
use interstage::rig::{Rig, RigError};
use interstage::units::{Direction, Q16};

#[test]
fn a_prescribed_speed_is_planned() {
    let request = PlanRequest {
        sequence: 1,
        direction: Direction::Deploy,
        step: 1,
        learned: Learned::default(),
        preload: Q16::from_num(50),
        distance: Q16::from_num(4),
        speed: Q16::ZERO,
        searching: false,
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
