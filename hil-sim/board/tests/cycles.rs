//! The control tick on the emulated core: the same bits as on the host, and the same cycles
//! each time.

use hil_sim::firmware::{Profile, build_binary};
use interstage_images::tick::Preset;
use rig_board::cycles::{CyclesError, IMAGE, Step, record, replay, run, tick};
use rig_board::image::Image;

use crate::common::scenario;

fn image() -> Image {
    let path = build_binary(IMAGE.0, IMAGE.1, Profile::Release, &[]).expect("the image builds");
    Image::start(&std::fs::read(path).expect("readable")).expect("an image")
}

#[test]
fn a_deployment_and_a_retraction_give_the_same_bits_on_the_core() {
    if !hil_sim::testing::long() {
        return;
    }
    let cycles = tick(&mut image(), &scenario(&["run.seed=3"])).expect("equal");
    assert!(cycles.tick.calls > 8_000 && cycles.tick.calls == cycles.without_skipping.calls);
    assert!(cycles.smooth.calls > 500 && cycles.plan.calls >= 8, "{cycles:?}");
    assert!(cycles.tick.cycles < cycles.without_skipping.cycles, "{cycles:?}");
}

#[test]
fn a_tick_with_another_code_differs() {
    let mut ticks = record(&scenario(&[])).expect("a run");
    ticks.truncate(300);
    ticks[200].given.codes[1][1] ^= 0x40;
    let error = replay(&mut image(), Preset::Prototype, &ticks, true);
    assert!(matches!(error, Err(CyclesError::Differs(200))), "{error:?}");
}

#[test]
fn the_same_run_costs_the_same_cycles() {
    let ticks = &record(&scenario(&[])).expect("a run")[..500];
    let cycles = || replay(&mut image(), Preset::Prototype, ticks, true).expect("equal");
    assert_eq!(cycles(), cycles());
}

#[test]
fn a_script_measures_a_function_and_names_one_that_is_not_there() {
    let mut image = image();
    let script = r#"[{"call": {"function": "model_build", "arguments": [0]}},
                     {"put": [1, 2, 3]},
                     {"measure": {"function": "no_such_function", "inputs": [[1], [2]]}}]"#;
    let steps: Vec<Step> = serde_json::from_str(script).expect("a script");
    let done = run(&mut image, &steps[..2]).expect("runs");
    assert!(done[0].cost.cycles > 100 && done[0].cost.calls == 1, "{done:?}");
    let error = run(&mut image, &steps).expect_err("not there").to_string();
    assert!(error.contains("no_such_function"), "{error}");
}

#[test]
fn a_call_that_faults_is_an_error_and_spoils_nothing() {
    let mut image = image();
    let load = image.function("tick_load").expect("there");
    // Far outside every memory.
    assert!(image.call(load, &[0x9000_0000]).is_err());
    let steps = [Step::Call { function: "model_build".to_owned(), arguments: Some(vec![0]) }];
    assert!(run(&mut image, &steps).is_ok());
}
