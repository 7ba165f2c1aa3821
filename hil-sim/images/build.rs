//! What the measurement image is linked with: the sets of parameters of the presets, made
//! here as for the firmware; and a deeper stack, because the image makes its tread itself, in
//! f64.

use std::{env, error::Error, fs, path::PathBuf};

use interstage::params::compile;
use interstage::rig::Rig;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    println!("cargo::rustc-link-arg-bin=measure=--defsym=_stack_size=40K");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    for (name, rig) in [("prototype", Rig::prototype()), ("fe", Rig::fe())] {
        fs::write(out.join(name).with_extension("set"), compile(name, &rig)?)?;
    }
    Ok(())
}
