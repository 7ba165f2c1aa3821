//! The firmware for the emulated board, built once.

pub(crate) mod reset;

use std::sync::OnceLock;

use hil_sim::firmware::{self, Profile};
use hil_sim::scenario::Scenario;
use rig_board::log::Strings;

/// The image as it would be flashed.
pub(crate) fn elf() -> &'static [u8] {
    static ELF: OnceLock<Vec<u8>> = OnceLock::new();
    ELF.get_or_init(|| firmware::image(Profile::Release).expect("the firmware builds"))
}

/// What its log is decoded with.
pub(crate) fn strings() -> &'static Strings {
    static STRINGS: OnceLock<Strings> = OnceLock::new();
    STRINGS.get_or_init(|| Strings::of(elf()).expect("it logs"))
}

/// The prototype with these parameters.
pub(crate) fn scenario(sets: &[&str]) -> Scenario {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    Scenario::resolve(Some("prototype"), None, &sets).expect("a scenario")
}
