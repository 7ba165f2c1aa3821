//! The firmware image: building it, and counting what it takes of flash and RAM.

use std::env;
use std::ffi::OsString;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, elf};
use serde::{Deserialize, Serialize};

/// Compilation target of the board.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Name of the package and of its binary.
const PACKAGE: &str = "interstage";

/// The chip's flash, both banks.
const FLASH: std::ops::Range<u64> = 0x0800_0000..0x0808_0000;

/// The chip's SRAM1, SRAM2 and the alias of the CCM SRAM behind them.
const RAM: std::ops::Range<u64> = 0x2000_0000..0x2002_0000;

/// What can go wrong with the image.
#[derive(Debug, thiserror::Error)]
pub enum FirmwareError {
    /// A program could not be started.
    #[error("could not start `{program}`: {source}")]
    Start {
        /// The program.
        program: String,
        /// Why.
        source: io::Error,
    },
    /// The target is missing and could not be added.
    #[error(
        "the Rust target {TARGET} is not installed and `rustup target add {TARGET}` failed: {why}"
    )]
    Target {
        /// What rustup said, or why it could not be asked.
        why: String,
    },
    /// cargo did not build the image; its own messages have gone to stderr.
    #[error("building the firmware failed ({0})")]
    Build(std::process::ExitStatus),
    /// cargo built something, but not this.
    #[error("cargo reported no executable for {0}")]
    NoExecutable(String),
    /// The image could not be read.
    #[error("could not read {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is not an image of this board.
    #[error("not a firmware image: {0}")]
    Image(String),
    /// The image is larger than it may be.
    #[error("{memory}: {used} bytes used of the {budget} budgeted")]
    OverBudget {
        /// `flash` or `RAM`.
        memory: &'static str,
        /// Bytes used.
        used: u64,
        /// Bytes allowed.
        budget: u64,
    },
    /// The stack does not stand below the statics, so an overflow would go unseen.
    #[error("the stack starts at {stack:#010x}, above the statics at {statics:#010x}")]
    StackNotBelow {
        /// Initial stack pointer.
        stack: u64,
        /// Lowest address of a static.
        statics: u64,
    },
}

/// Build profile of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// With overflow checks.
    Debug,
    /// As flashed.
    #[default]
    Release,
    /// As flashed, with the host in the loop.
    Loop,
}

impl Profile {
    /// The folder of the target directory that cargo puts it into.
    fn folder(self) -> &'static str {
        match self {
            Self::Debug => "debug",
            Self::Release => "release",
            Self::Loop => "hil",
        }
    }

    /// What cargo is told.
    fn arguments(self) -> &'static [&'static str] {
        match self {
            Self::Debug => &[],
            Self::Release => &["--release"],
            Self::Loop => &["--profile", "hil", "--no-default-features", "--features", "hil"],
        }
    }
}

/// The workspace that this tool was built from.
pub(crate) fn workspace() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package)
}

/// The directory of build results, if nothing but `CARGO_TARGET_DIR` moves it.
pub(crate) fn target_directory() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace().join("target"), PathBuf::from)
}

/// Where cargo leaves the image if nothing but `CARGO_TARGET_DIR` says otherwise;
/// [`build`] returns the place that cargo itself names.
#[must_use]
pub fn elf_path(profile: Profile) -> PathBuf {
    target_directory().join(TARGET).join(profile.folder()).join(PACKAGE)
}

/// Settings of cargo by which an image has no folder of this machine in it: the places of
/// panics name the sources of libraries, and would make an image as long as the way to them.
pub(crate) fn nameless() -> Vec<String> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(env::home_dir()?.join(".cargo"))).unwrap_or_default();
    let Ok(folders) = std::fs::read_dir(home.join("registry/src")) else { return Vec::new() };
    let mut folders: Vec<PathBuf> = folders.flatten().map(|folder| folder.path()).collect();
    folders.sort();
    let flags = folders.iter().filter_map(|folder| {
        // To the root, so that nobody takes what is left for a path from somewhere else.
        Some(format!("--remap-path-prefix={}=/", folder.to_str()?))
    });
    vec![format!("target.{TARGET}.rustflags={:?}", flags.collect::<Vec<_>>())]
}

/// A tool of the toolchain that runs this program, if it is known.
pub(crate) fn tool(variable: &str, name: &str) -> OsString {
    env::var_os(variable).unwrap_or_else(|| name.into())
}

/// A started program's output, whatever its exit status.
fn output(command: &mut Command) -> Result<std::process::Output, FirmwareError> {
    command.output().map_err(|source| FirmwareError::Start {
        program: command.get_program().to_string_lossy().into_owned(),
        source,
    })
}

/// Adds the board's target to the toolchain if it is missing.
///
/// # Errors
/// [`FirmwareError::Target`] with what rustup said.
pub fn ensure_target() -> Result<(), FirmwareError> {
    // The library folder tells for toolchains with and without rustup.
    let libraries = output(
        Command::new(tool("RUSTC", "rustc"))
            .args(["--print", "target-libdir", "--target", TARGET])
            .current_dir(workspace()),
    )?;
    let libraries = String::from_utf8_lossy(&libraries.stdout);
    if !libraries.trim().is_empty() && Path::new(libraries.trim()).is_dir() {
        return Ok(());
    }
    let added =
        output(Command::new("rustup").args(["target", "add", TARGET]).current_dir(workspace()))
            .map_err(|error| FirmwareError::Target { why: error.to_string() })?;
    if added.status.success() {
        Ok(())
    } else {
        let why = String::from_utf8_lossy(&added.stderr).trim().to_owned();
        Err(FirmwareError::Target { why })
    }
}

/// Builds the image, adding the target first if it is missing, and returns its
/// path. cargo's progress and messages go to stderr.
///
/// # Errors
/// [`FirmwareError`] if the target cannot be had or the build fails.
pub fn build(profile: Profile) -> Result<PathBuf, FirmwareError> {
    build_binary(PACKAGE, PACKAGE, profile, &[])
}

/// Builds a binary for the board as [`build`] does the firmware, with these settings
/// of cargo (`key=value`) instead of the workspace's.
///
/// # Errors
/// As [`build`].
pub fn build_binary(
    package: &str,
    binary: &str,
    profile: Profile,
    settings: &[String],
) -> Result<PathBuf, FirmwareError> {
    ensure_target()?;
    let mut cargo = Command::new(tool("CARGO", "cargo"));
    cargo
        .current_dir(workspace())
        .args(["build", "--package", package, "--bin", binary, "--target", TARGET])
        .args(["--message-format", "json-render-diagnostics"])
        .args(settings.iter().chain(&nameless()).flat_map(|setting| ["--config", setting]))
        // Flags from the environment would displace the linker arguments of
        // `.cargo/config.toml`.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .stderr(Stdio::inherit());
    cargo.args(profile.arguments());
    let built = output(&mut cargo)?;
    if !built.status.success() {
        return Err(FirmwareError::Build(built.status));
    }
    executable(&String::from_utf8_lossy(&built.stdout), binary)
        .ok_or_else(|| FirmwareError::NoExecutable(binary.to_owned()))
}

/// The part of a cargo message that names an executable.
#[derive(Deserialize)]
struct Artifact {
    target: ArtifactTarget,
    executable: Option<PathBuf>,
}

#[derive(Deserialize)]
struct ArtifactTarget {
    name: String,
}

/// The image's path from cargo's messages, one JSON object a line.
pub(crate) fn executable(messages: &str, binary: &str) -> Option<PathBuf> {
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Artifact>(line).ok())
        .filter(|artifact| artifact.target.name == binary)
        .find_map(|artifact| artifact.executable)
}

/// Builds the firmware and returns the image.
///
/// # Errors
/// [`FirmwareError`] if it does not build or cannot be read.
pub fn image(profile: Profile) -> Result<Vec<u8>, FirmwareError> {
    let path = build(profile)?;
    std::fs::read(&path).map_err(|source| FirmwareError::Read { path, source })
}

/// Largest image allowed, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Budget {
    /// Flash.
    pub flash: u64,
    /// RAM with the stack.
    pub ram: u64,
}

impl Default for Budget {
    /// Of flash a quarter: room for a second image and for what is still to come. Of RAM a
    /// third.
    fn default() -> Self {
        Self { flash: 128 * 1024, ram: 32 * 1024 }
    }
}

/// One section and what it takes, bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Section {
    /// Name in the image.
    pub name: String,
    /// Where it runs.
    pub address: u64,
    /// Bytes of flash: its contents, or the copy that fills it at start.
    pub flash: u64,
    /// Bytes of RAM.
    pub ram: u64,
}

/// What an image takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Footprint {
    /// Loaded sections that are not empty, in the order of the image.
    pub sections: Vec<Section>,
    /// Initial stack pointer.
    pub stack_start: u64,
    /// Lowest address of the stack.
    pub stack_end: u64,
}

impl Footprint {
    /// Measures the image at `path`.
    ///
    /// # Errors
    /// [`FirmwareError`] if it cannot be read or is not an image of this board.
    pub fn of_file(path: &Path) -> Result<Self, FirmwareError> {
        let bytes = std::fs::read(path)
            .map_err(|source| FirmwareError::Read { path: path.to_owned(), source })?;
        Self::of_elf(&bytes)
    }

    /// Measures the image in `bytes`.
    ///
    /// # Errors
    /// [`FirmwareError::Image`] if it is not an image of this board.
    pub fn of_elf(bytes: &[u8]) -> Result<Self, FirmwareError> {
        let file = ElfFile32::<Endianness>::parse(bytes)
            .map_err(|error| FirmwareError::Image(error.to_string()))?;
        let symbol = |name: &str| {
            file.symbols()
                .find(|symbol| symbol.name() == Ok(name))
                .map(|symbol| symbol.address())
                .ok_or_else(|| FirmwareError::Image(format!("no symbol {name}")))
        };
        let mut sections = Vec::new();
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(elf::SHF_ALLOC) == 0 || section.size() == 0 {
                continue;
            }
            let name = section.name().unwrap_or("?").to_owned();
            let stored = section.kind() != SectionKind::UninitializedData;
            sections.push(place(name, section.address(), section.size(), stored)?);
        }
        Ok(Self {
            sections,
            stack_start: symbol("_stack_start")?,
            stack_end: symbol("_stack_end")?,
        })
    }

    /// Bytes of flash.
    #[must_use]
    pub fn flash(&self) -> u64 {
        self.sections.iter().map(|section| section.flash).sum()
    }

    /// Bytes reserved for the stack.
    #[must_use]
    pub fn stack(&self) -> u64 {
        self.stack_start.saturating_sub(self.stack_end)
    }

    /// Bytes of RAM, the stack included.
    #[must_use]
    pub fn ram(&self) -> u64 {
        self.sections.iter().map(|section| section.ram).sum::<u64>() + self.stack()
    }

    /// Holds the image against a budget and checks that the stack stands at the
    /// bottom of RAM, below every static.
    ///
    /// # Errors
    /// [`FirmwareError::OverBudget`] or [`FirmwareError::StackNotBelow`].
    pub fn check(&self, budget: &Budget) -> Result<(), FirmwareError> {
        let statics = self.sections.iter().filter(|s| s.ram > 0).map(|s| s.address).min();
        if let Some(statics) = statics
            && self.stack_start > statics
        {
            return Err(FirmwareError::StackNotBelow { stack: self.stack_start, statics });
        }
        for (memory, used, budget) in
            [("flash", self.flash(), budget.flash), ("RAM", self.ram(), budget.ram)]
        {
            if used > budget {
                return Err(FirmwareError::OverBudget { memory, used, budget });
            }
        }
        Ok(())
    }
}

/// Which memory a section takes.
fn place(name: String, address: u64, size: u64, stored: bool) -> Result<Section, FirmwareError> {
    let (flash, ram) = match (FLASH.contains(&address), RAM.contains(&address), stored) {
        (true, _, true) => (size, 0),
        (_, true, true) => (size, size),
        (_, true, false) => (0, size),
        _ => {
            return Err(FirmwareError::Image(format!(
                "section {name} at {address:#010x} lies in no memory of the chip"
            )));
        }
    };
    Ok(Section { name, address, flash, ram })
}

impl fmt::Display for Footprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:<16}{:>12}{:>10}{:>10}", "section", "address", "flash", "RAM")?;
        let mut line = |name: &str, address: &str, flash: u64, ram: u64| {
            writeln!(f, "{name:<16}{address:>12}{flash:>10}{ram:>10}")
        };
        for section in &self.sections {
            let address = format!("{:#010x}", section.address);
            line(&section.name, &address, section.flash, section.ram)?;
        }
        line("stack", &format!("{:#010x}", self.stack_end), 0, self.stack())?;
        line("total", "", self.flash(), self.ram())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIB: u64 = 1024;

    /// 24 KiB of code, 1 KiB of initialised and 7 KiB of zeroed statics, 12 KiB of stack.
    fn image() -> Footprint {
        let section = |name: &str, address, size, stored| {
            place(name.to_owned(), address, size, stored).expect("in memory")
        };
        Footprint {
            sections: vec![
                section(".text", 0x0800_0200, 24 * KIB, true),
                section(".data", 0x2000_3000, KIB, true),
                section(".bss", 0x2000_3400, 7 * KIB, false),
            ],
            stack_start: 0x2000_3000,
            stack_end: 0x2000_0000,
        }
    }

    #[test]
    fn initialised_statics_count_in_both_memories_and_the_stack_in_one() {
        assert_eq!(image().flash(), 25 * KIB);
        assert_eq!(image().ram(), 20 * KIB);
    }

    #[test]
    fn a_budget_is_met_exactly_and_missed_by_one_byte() {
        let exact = Budget { flash: 25 * KIB, ram: 20 * KIB };
        assert!(image().check(&exact).is_ok());
        for (budget, memory) in [
            (Budget { flash: exact.flash - 1, ..exact }, "flash"),
            (Budget { ram: exact.ram - 1, ..exact }, "RAM"),
        ] {
            let error = image().check(&budget).expect_err("one byte over");
            assert!(matches!(error, FirmwareError::OverBudget { memory: m, .. } if m == memory));
        }
    }

    #[test]
    fn a_stack_above_the_statics_is_refused() {
        let above = Footprint { stack_start: 0x2001_8000, stack_end: 0x2001_5000, ..image() };
        let error = above.check(&Budget::default()).expect_err("unsafe layout");
        assert!(matches!(error, FirmwareError::StackNotBelow { statics: 0x2000_3000, .. }));
    }

    #[test]
    fn a_section_outside_the_chip_is_refused() {
        assert!(place(".text".to_owned(), 0x0900_0000, 4, true).is_err());
        // Flash holds nothing that has no contents.
        assert!(place(".bss".to_owned(), 0x0800_0000, 4, false).is_err());
    }

    #[test]
    fn a_file_of_another_kind_is_refused() {
        let error = Footprint::of_elf(b"#!/bin/sh\n").expect_err("not an ELF");
        assert!(matches!(error, FirmwareError::Image(_)));
    }

    #[test]
    fn the_table_lists_sections_stack_and_totals() {
        let table = image().to_string();
        let row = |name: &str| {
            let line = table.lines().find(|line| line.starts_with(name)).expect("a row");
            line.split_whitespace().skip(1).map(str::to_owned).collect::<Vec<_>>()
        };
        assert_eq!(row(".data"), ["0x20003000", "1024", "1024"]);
        assert_eq!(row("stack"), ["0x20000000", "0", "12288"]);
        assert_eq!(row("total"), ["25600", "20480"]);
    }

    #[test]
    fn the_image_is_found_among_cargos_messages() {
        let messages = r#"{"reason":"compiler-artifact","target":{"name":"defmt"},"executable":null}
{"reason":"compiler-artifact","target":{"name":"interstage"},"executable":null}
{"reason":"compiler-artifact","target":{"name":"interstage"},"executable":"/t/interstage"}
{"reason":"build-finished","success":true}"#;
        assert_eq!(executable(messages, "interstage"), Some(PathBuf::from("/t/interstage")));
        assert_eq!(executable("", "interstage"), None);
    }
}
