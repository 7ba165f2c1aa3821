//! What the model offers beside the quantities of a crossing, against the formulas or
//! against itself the other way round.

use interstage::hal::hil::Given;
use interstage::model::formula::Formula;
use interstage::model::reduced::ReducedModel;
use interstage::model::{PlanRequest, Planner};
use interstage::rig::{Rig, RigError};
use interstage::sense::raw::{AdcCode, AngleFrame, BridgeCode, BridgeCodes, EncoderCount};
use interstage::supervise::Command;
use interstage::units::{Direction, Q16, Ratio};

const WAYS: [Direction; 2] = [Direction::Deploy, Direction::Retract];

fn load(rig: &Rig) -> f64 {
    rig.plant.top_load_n * rig.plant.top_load_share
}

#[test]
fn stiffness_times_the_relaxed_force_is_the_force() {
    let rig = Rig::fe();
    let formula = Formula::new(&rig);
    for way in WAYS {
        for speed in [0.5, 5.0, 8.0, 30.0] {
            for gap in [1.4, 1.8, 2.2] {
                let kind =
                    interstage::model::effective_stiffness::Kind { direction: way, driven: false };
                let force = formula.force_n(way, speed, gap, None);
                let product =
                    formula.stiffness(way, speed, gap, None) * formula.relaxed_force_n(kind, gap);
                assert!((force / product - 1.0).abs() < 1e-9, "{force} {product}");
            }
        }
        let slow = formula.stiffness(way, 1e-6, 1.8, None);
        let fast = formula.stiffness(way, 1e6, 1.8, None);
        assert!(slow < 1.01 && fast > slow && fast < rig.tread.stiffening * 1.01, "{slow} {fast}");
    }
}

#[test]
fn friction_used_is_that_of_the_forces_at_the_corner() {
    let rig = Rig::fe();
    let formula = Formula::new(&rig);
    for way in WAYS {
        for (speed, gap) in [(3.0, 1.6), (5.0, 1.8), (8.0, 2.0)] {
            let lift = load(&rig);
            let used = formula.utilisation(way, speed, gap, lift);
            // Normal force N and friction F at a contact that slopes by s, in balance with
            // the preload across and the load along: both from the two equations.
            let slope = formula.contact(gap).slope();
            let preload = formula.force_n(way, speed, gap, Some(lift));
            let length = (1.0 + slope * slope).sqrt();
            let normal = (preload - lift * slope) / length;
            let friction = (preload * slope + lift) / length;
            assert!((used - friction / normal).abs() < 1e-12, "{used}");
            assert!(used > slope);
        }
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
        scale: Ratio::from_num(1),
        review: None,
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

#[test]
fn a_tread_that_no_model_holds_is_named() {
    let mut rig = Rig::fe();
    rig.tread.k_inf_pa_per_m = 1e13;
    let error = Planner::try_build(&rig).unwrap_err();
    assert!(error.to_string().contains("tread.k_inf_pa_per_m"), "{error}");
}

#[test]
fn codes_given_in_the_loop_are_the_sensors() {
    let given = Given::codes(
        EncoderCount::new(40_000),
        AdcCode::new(1_234),
        AdcCode::new(777),
        AngleFrame::new(0x8421),
        BridgeCodes { drive: BridgeCode::new(3000), pretightener: BridgeCode::new(17) },
    );
    let readback = given.readback().map(|codes| (codes.drive.get(), codes.pretightener.get()));
    assert_eq!(readback, Some((3000, 17)));
    assert_eq!((given.wheel_encoder, given.preload_sensor), (40_000, Some(1_234)));
    assert_eq!(
        (given.compression_sensor, given.arm_angle, given.stop, given.command),
        (Some(777), Some(0x8421), false, 0)
    );
    let commanded = given.with(Some(Command::Retract));
    assert_ne!(commanded.command, 0);
    assert_eq!(commanded.with(None), given);
    let silent = commanded.silent();
    assert_eq!((silent.wheel_encoder, silent.command), (40_000, 0));
    assert_eq!(
        (silent.preload_sensor, silent.compression_sensor, silent.arm_angle),
        (None, None, None)
    );
    assert_eq!(silent.readback(), None);
}
