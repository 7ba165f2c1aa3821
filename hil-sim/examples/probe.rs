//! constants
fn main() {
    let (s, e) = hil_sim::constants::generate(&|| ()).unwrap();
    std::fs::write("src/model/constants.rs", s).unwrap();
    println!("{e:?}");
}
