//! Integration tests of the study. The long ones run with `RIG_LONG=1`.

mod bench;
mod constants;
mod docs;
mod fe;
mod paper;

fn long() -> bool {
    std::env::var_os("RIG_LONG").is_some()
}

fn doc(name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
