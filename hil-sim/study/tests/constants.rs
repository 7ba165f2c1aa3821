//! The image's parameter set is that of this build.

use interstage::rig::Rig;

#[test]
fn the_set_of_the_image_is_fresh() {
    let set = interstage::params::compile("prototype", &Rig::prototype()).unwrap();
    assert!(
        set == *include_bytes!("../../../src/params/prototype.set"),
        "stale: run `rig-study constants --set`; if a type of a set has changed, raise \
         interstage::params::SCHEMA"
    );
}
