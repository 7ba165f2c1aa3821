//! `rig params` on the emulated board, as a user has it.

use std::path::{Path, PathBuf};

use hil_sim::params::set_of;
use interstage::log::crc32;
use interstage::params::{ParameterSet, SCHEMA, SetError, slots};
use interstage::rig::Rig;
use rig_board::chip::map::PARAMETER_SETS;
use serde_json::Value;

use crate::common::Board;
use crate::common::cli::{Said, rig};

/// A place for the board's flash, and for files.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a directory"))
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn flash(&self) -> Vec<u8> {
        std::fs::read(self.at("flash")).expect("kept")
    }

    fn run(&self, arguments: &[&str]) -> Said {
        let target = ["--target", "board", "--flash", "flash", "--json"];
        rig(self.0.path(), &[&["params"], arguments, &target].concat())
    }

    /// What a command prints that must end well.
    fn good(&self, arguments: &[&str]) -> Value {
        let said = self.run(arguments);
        assert_eq!(said.code, Some(0), "{arguments:?}: {}", said.text);
        said.printed
    }

    /// The last line that a command says which must be refused.
    fn refused(&self, arguments: &[&str]) -> String {
        let said = self.run(arguments);
        assert_eq!((said.code, said.printed), (Some(2), Value::Null), "{arguments:?}");
        said.text.lines().last().expect("it says why").to_owned()
    }
}

const KEY: &str = "tread.tau_s";

#[test]
fn parameters_are_read_changed_saved_and_restored() {
    let place = Place::new();
    let fresh = place.good(&["get", KEY]);
    let usual = Rig::prototype().tread.tau_s;
    assert_eq!(fresh["parameters"][KEY], usual);
    assert_eq!((&fresh["name"], &fresh["schema"]), (&"prototype".into(), &SCHEMA.into()));
    assert!(fresh["origin"].as_str().expect("text").contains("image"), "{fresh}");

    let set = place.good(&["set", "tread.tau_s=0.12"]);
    assert_eq!((&set["before"][KEY], &set["parameters"][KEY]), (&usual.into(), &0.12.into()));
    assert_eq!(set["changed"], true);
    assert_ne!(set["hash"], fresh["hash"]);
    // It outlasts the power.
    let kept = place.good(&["get", KEY]);
    assert_eq!((&kept["parameters"][KEY], &kept["hash"]), (&0.12.into(), &set["hash"]));
    assert!(kept["origin"].as_str().expect("text").contains("number 1"), "{kept}");

    // What is refused changes nothing, to the byte.
    let before = place.flash();
    for (bad, named) in [
        ("tread.tau_s=-1", "tread.tau_s"),
        ("tread.tau=0.1", "tread.tau"),
        ("preload.limit_n=1", "limit"),
        ("run.seed=3", "run.seed=3"),
    ] {
        let line = place.refused(&["set", bad]);
        assert!(line.starts_with("error: ") && line.contains(named), "{bad}: {line}");
    }
    assert!(place.flash() == before, "the flash was written");
    assert_eq!(place.good(&["get", KEY])["parameters"][KEY], 0.12);

    let differing = place.good(&["diff"]);
    let keys = |value: &Value| -> Vec<String> {
        value.as_object().expect("an object").keys().cloned().collect()
    };
    assert_eq!(keys(&differing["parameters"]), [KEY]);
    assert_eq!(differing["before"][KEY], usual);

    place.good(&["save", "mine.toml"]);
    let restored = place.good(&["restore"]);
    assert_eq!((&restored["parameters"][KEY], &restored["hash"]), (&usual.into(), &fresh["hash"]));
    assert_eq!(keys(&place.good(&["diff"])["parameters"]), Vec::<String>::new());
    let again = place.good(&["restore", "mine.toml"]);
    assert_eq!(again["parameters"][KEY], 0.12);
    assert_eq!((&again["name"], &again["hash"]), (&"mine".into(), &set["hash"]));
}

/// What a board with this flash says in so many milliseconds, and whether a bridge was driven.
fn powered(flash: &[u8], milliseconds: u32) -> (Vec<String>, bool) {
    let mut board = Board::off(&[]);
    board.machine().poke(PARAMETER_SETS, flash).expect("flash");
    let mut driven = false;
    for _ in 0..milliseconds {
        let drives = board.step().drives;
        driven |= drives.drive_on || drives.preload_on;
    }
    assert!(board.machine().restarts().is_empty(), "{:?}", board.log);
    (board.log, driven)
}

/// A set as firmware before the present schema wrote it: another number, and constants
/// that mean nothing here.
fn old_set(name: &str, rig: &Rig) -> Vec<u8> {
    let mut set = set_of(name, rig).expect("a sound rig");
    assert_eq!(set[0], SCHEMA as u8, "its number is first");
    let rig_ends = usize::from(ParameterSet::open(&set).expect("a set").header().rig_length);
    set[0] -= 1;
    set.truncate(set.len() - 4 - 200);
    // Behind the header and the rig.
    for byte in &mut set[rig_ends + 100..] {
        *byte = byte.wrapping_mul(3).wrapping_add(1);
    }
    set.extend(crc32(&set).to_le_bytes());
    set
}

/// Flash with this set in its first place.
fn flash_with(set: &[u8], path: &Path) -> Vec<u8> {
    let mut flash = slots::slot_image(set, 7).expect("it fits").to_vec();
    flash.resize(2 * slots::SLOT_BYTES, 0xFF);
    std::fs::write(path, &flash).expect("written");
    flash
}

#[test]
fn a_board_with_parameters_of_an_older_schema_holds_and_is_migrated_without_loss() {
    let mut rig = Rig::prototype();
    rig.tread.tau_s = 0.123;
    rig.preload.cruise_n += 1.25;
    rig.rig.step_positions_mm[1] += 0.375;
    let old = old_set("rig 7", &rig);
    assert_eq!(ParameterSet::open(&old), Err(SetError::Schema { found: SCHEMA - 1 }));
    let place = Place::new();
    let flash = flash_with(&old, &place.at("flash"));
    // It comes up, says what is the matter, and drives nothing.
    let (said, driven) = powered(&flash, 3000);
    let complaint = format!("of another schema, {}", SCHEMA - 1);
    assert!(said.iter().filter(|line| line.contains(&complaint)).count() >= 2, "{said:?}");
    assert!(!driven && !said.iter().any(|line| line.contains("mode: ")), "{said:?}");
    // Its rig is still to be read.
    let got = place.good(&["get", KEY]);
    assert_eq!((&got["schema"], &got["name"]), (&(SCHEMA - 1).into(), &"rig 7".into()));
    assert_eq!(got["parameters"][KEY], 0.123);
    let migrated = place.good(&["migrate"]);
    assert_eq!((&migrated["schema"], &migrated["name"]), (&SCHEMA.into(), &"rig 7".into()));
    assert_eq!(migrated["hash"], got["hash"]);
    assert_eq!(migrated["parameters"].as_object().expect("an object").len(), 0, "{migrated}");
    // The same set as if it had been made from that rig today, and it runs.
    let flash = place.flash();
    let wanted = set_of("rig 7", &rig).expect("a sound rig");
    assert!(flash.windows(wanted.len()).any(|part| part == wanted), "not the same set");
    let (said, _) = powered(&flash, 1500);
    assert!(said.iter().any(|line| line.contains("mode: idle")), "{said:?}");
    assert!(!said.iter().any(|line| line.contains("of another schema")), "{said:?}");
}

#[test]
fn a_damaged_set_is_named_drives_nothing_and_can_be_restored() {
    let place = Place::new();
    let set = set_of("mine", &Rig::prototype()).expect("a sound rig");
    let mut flash = flash_with(&set, &place.at("flash"));
    flash[1000] ^= 4;
    std::fs::write(place.at("flash"), &flash).expect("written");
    let (said, driven) = powered(&flash, 1500);
    let complaints = said.iter().filter(|line| line.contains("the set is damaged")).count();
    assert!(complaints >= 2 && !driven, "{said:?}");
    let asked = place.run(&["get"]).text;
    assert!(asked.contains("the set in force is damaged"), "{asked}");
    assert_eq!(place.good(&["restore"])["name"], "prototype");
    let (said, _) = powered(&place.flash(), 1500);
    assert!(said.iter().any(|line| line.contains("mode: idle")), "{said:?}");
}

#[test]
fn unreadable_parameters_are_reported_and_can_be_restored() {
    // A rig of another layout: its bytes are no rig.
    let mut set = set_of("odd", &Rig::prototype()).expect("a sound rig");
    let length = usize::from(ParameterSet::open(&set).expect("a set").header().rig_length);
    set[0] -= 1;
    set.truncate(set.len() - 4);
    // Behind the header, and not beyond the rig.
    set[30..length].fill(0xFF);
    set.extend(crc32(&set).to_le_bytes());
    let place = Place::new();
    flash_with(&set, &place.at("flash"));
    let line = place.refused(&["get"]);
    assert!(line.contains("board: ") && line.contains("not readable"), "{line}");
    let restored = place.good(&["restore"]);
    assert_eq!(restored["parameters"].as_object().expect("an object").len(), 0);
    assert_eq!(place.good(&["get", KEY])["name"], "prototype");
}
