//! A deeper stack for the measurement image: it makes its constants itself, in f64, which
//! the firmware leaves to the host.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!("cargo::rustc-link-arg-bin=measure=--defsym=_stack_size=40K");
    }
}
