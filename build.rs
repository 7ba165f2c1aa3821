//! Hands the linker the memory layout; the host build needs nothing.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=memory.x");
    if env::var("CARGO_CFG_TARGET_OS")? == "none" {
        // A copy, so that the linker finds it from whichever directory it runs in.
        let out = PathBuf::from(env::var("OUT_DIR")?);
        fs::copy("memory.x", out.join("memory.x"))?;
        println!("cargo::rustc-link-search={}", out.display());
        println!("cargo::rustc-link-arg-bins=--build-id=sha1");
        if env::var("PROFILE")? == "debug" {
            // Without link-time optimisation the frames are about twice as deep.
            println!("cargo::rustc-link-arg-bins=--defsym=_stack_size=20K");
        } else if env::var_os("CARGO_FEATURE_HIL").is_some() {
            // One more level than otherwise: the host's line below all tasks.
            println!("cargo::rustc-link-arg-bins=--defsym=_stack_size=14K");
        }
    }
    Ok(())
}
