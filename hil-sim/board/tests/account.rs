//! The control tick on the emulated core: the same bits as on the host, and cycles
//! that add up.

#[path = "common/board.rs"]
mod common;

use hil_sim::firmware::{Profile, build_binary};
use interstage_images::tick::Preset;
use rig_board::account::{Account, AccountError, IMAGE, both_ways, record};
use rig_board::image::{ARGUMENTS, Image, ImageError};
use rig_board::model::measure;

use common::scenario;

fn image() -> std::path::PathBuf {
    build_binary(IMAGE.0, IMAGE.1, Profile::Release, &[]).expect("the image builds")
}

#[test]
fn a_deployment_and_a_retraction_give_the_same_bits_on_the_core() {
    let (account, image) = both_ways(&image(), &scenario(&["run.seed=3"])).expect("equal");
    let ticks: u64 = account.phases.iter().map(|cost| cost.tick.calls).sum();
    assert!(ticks == account.ticks && ticks > 8_000, "{ticks}");
    let cycles: u64 = account.phases.iter().map(|cost| cost.tick.cycles).sum();
    assert_eq!(cycles, account.tick.cycles);
    assert!(account.smooth().count() >= 2, "cruise on both ways");
    assert!(account.plan.calls >= 8, "a plan for each step and way");

    // The profile of a phase names the tick's stages and adds up to its cycles.
    let busiest = account.busiest().expect("a phase");
    let profile = account.profile(&image, &busiest.phase).expect("debug information");
    let sum: f64 = profile.iter().map(|share| share.share).sum();
    assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    assert!(profile.iter().any(|share| share.function.contains("senses")), "{profile:?}");
}

#[test]
fn a_tick_fed_another_code_is_told_apart() {
    let scenario = scenario(&[]);
    let mut image = Image::open(&image()).expect("an image");
    let mut ticks = record(&scenario).expect("a run");
    ticks.truncate(300);
    ticks[200].given.codes[1].code ^= 0x40;
    let error = Account::default()
        .replay(&mut image, "deploy", Preset::Prototype, &ticks)
        .expect_err("differs");
    assert!(matches!(error, AccountError::Differs { tick: 200, .. }), "{error}");
}

#[test]
fn the_same_run_costs_the_same_cycles() {
    let ticks = &record(&scenario(&[])).expect("a run")[..500];
    let cycles = || {
        let mut image = Image::open(&image()).expect("an image");
        let mut account = Account::default();
        account.replay(&mut image, "deploy", Preset::Prototype, ticks).expect("equal");
        account.tick
    };
    assert_eq!(cycles(), cycles());
}

#[test]
fn a_rig_that_the_image_cannot_build_is_refused() {
    let changed = scenario(&["tread.tau_s=0.2"]);
    assert!(matches!(both_ways(&image(), &changed), Err(AccountError::Rig(_))));
}

#[test]
fn a_function_that_is_not_there_is_named() {
    let image = Image::open(&image()).expect("an image");
    let error = image.function("no_such_function").expect_err("not there");
    assert!(matches!(error, ImageError::Missing(name) if name == "no_such_function"));
}

#[test]
fn a_call_that_faults_is_an_error_and_spoils_nothing() {
    let mut image = Image::open(&image()).expect("an image");
    let load = image.function("tick_load").expect("there");
    // Far outside every memory.
    assert!(image.call(load, &[0x9000_0000]).is_err());
    // The image is still good.
    image.put(ARGUMENTS, &[1, 2, 3]).expect("a mailbox");
    assert_eq!(image.get(ARGUMENTS).expect("a mailbox"), [1, 2, 3]);
}

#[test]
fn the_model_gives_the_same_bits_on_the_core() {
    let mut image = Image::open(&image()).expect("an image");
    for preset in Preset::ALL {
        let measured = measure(&mut image, preset).expect("equal");
        assert_eq!(measured.len(), 3);
        for function in measured {
            assert!(function.cost.calls > 800 && function.cost.least > 20, "{function:?}");
        }
    }
}
