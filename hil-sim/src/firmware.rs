//! Builds the firmware image and measures its flash and RAM.

mod building;

use std::env;
use std::ffi::OsString;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Output};

use object::read::elf::ElfFile32;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, elf};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::probe::{Port, PortError};

/// Compilation target of the board.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// Name of the package and of its binary.
const PACKAGE: &str = "interstage";

/// Symbol of the channels' control block.
const BLOCK: &str = "_SEGGER_RTT";
/// Section of the linker's hash over the image.
const ID: &str = ".note.gnu.build-id";

/// The chip's flash, both banks.
const FLASH: Range<u64> = 0x0800_0000..0x0808_0000;

/// A file of the release that this program is from, which has no source to build it from.
pub(crate) fn released(name: &str) -> Option<PathBuf> {
    let file = env::current_exe().ok()?.with_file_name(name);
    (file.with_file_name("SHA256SUMS").is_file() && file.is_file()).then_some(file)
}

/// Why an image is not available.
#[derive(Debug, thiserror::Error)]
pub enum FirmwareError {
    #[error("could not start `{0}`: {1}")]
    Start(String, io::Error),
    #[error(
        "the Rust target {TARGET} is not installed and `rustup target add {TARGET}` failed: {0}"
    )]
    Target(String),
    /// cargo did not build the binary; its own messages have gone to standard error.
    #[error("building {0} failed ({1})")]
    Build(String, ExitStatus),
    #[error("cargo reported no executable for {0}")]
    NoExecutable(String),
    #[error("could not read {path}: {source}")]
    Read { path: PathBuf, source: io::Error },
    #[error("not a firmware image: {0}")]
    Image(String),
}

/// Build profile of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// As flashed.
    Release,
    /// As flashed, with the host in the loop.
    Loop,
}

/// The workspace that this tool was built from.
pub(crate) fn workspace() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package)
}

/// The directory of build results, if nothing but `CARGO_TARGET_DIR` moves it.
pub fn target_directory() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace().join("target"), PathBuf::from)
}

/// Settings of cargo that keep this machine's folders out of the image: panic messages
/// contain the paths of libraries, so that its size would depend on them.
fn remapped_paths() -> String {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(env::home_dir()?.join(".cargo"))).unwrap_or_default();
    let folders = std::fs::read_dir(home.join("registry/src")).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = folders.map(|folder| folder.path()).collect();
    folders.sort();
    // To the root, so that the rest is no relative path.
    let flag = |folder: &PathBuf| Some(format!("--remap-path-prefix={}=/", folder.to_str()?));
    let flags: Vec<String> = folders.iter().filter_map(flag).collect();
    format!("target.{TARGET}.rustflags={flags:?}")
}

/// A tool of the toolchain: from the environment, or by its name.
pub(crate) fn tool(variable: &str, name: &str) -> OsString {
    env::var_os(variable).unwrap_or_else(|| name.into())
}

/// A program's output, whatever its exit status.
pub(crate) fn output(command: &mut Command) -> Result<Output, FirmwareError> {
    command.output().map_err(|source| could_not_start(command, source))
}

/// A program's exit code; 1 if it was killed.
pub(crate) fn exit_code(status: ExitStatus) -> u8 {
    status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)
}

pub(crate) fn could_not_start(command: &Command, source: io::Error) -> FirmwareError {
    FirmwareError::Start(command.get_program().to_string_lossy().into_owned(), source)
}

/// Adds the board's target to the toolchain if it is missing.
pub(crate) fn ensure_target() -> Result<(), FirmwareError> {
    // The folder of libraries decides for toolchains with and without rustup.
    let mut rustc = Command::new(tool("RUSTC", "rustc"));
    rustc.args(["--print", "target-libdir", "--target", TARGET]).current_dir(workspace());
    let libraries = output(&mut rustc)?.stdout;
    let libraries = String::from_utf8_lossy(&libraries);
    if !libraries.trim().is_empty() && Path::new(libraries.trim()).is_dir() {
        return Ok(());
    }
    let mut rustup = Command::new("rustup");
    rustup.args(["target", "add", TARGET]).current_dir(workspace());
    let added = output(&mut rustup).map_err(|error| FirmwareError::Target(error.to_string()))?;
    if added.status.success() {
        return Ok(());
    }
    Err(FirmwareError::Target(String::from_utf8_lossy(&added.stderr).trim().to_owned()))
}

/// Builds the image, adding the target first if it is missing, and returns its path.
/// Progress and cargo's messages go to standard error.
pub(crate) fn build(profile: Profile) -> Result<PathBuf, FirmwareError> {
    build_binary(PACKAGE, PACKAGE, profile, &[])
}

/// Builds a binary for the board as `build` does the firmware, with these settings
/// of cargo (`key=value`) instead of the workspace's.
pub fn build_binary(
    package: &str,
    binary: &str,
    profile: Profile,
    settings: &[String],
) -> Result<PathBuf, FirmwareError> {
    ensure_target()?;
    let mut cargo = build_command(&["--package", package, "--bin", binary, "--target", TARGET]);
    let settings = settings.iter().cloned().chain([remapped_paths()]);
    cargo.args(settings.flat_map(|setting| ["--config".to_owned(), setting]));
    cargo.args(match profile {
        Profile::Release => &["--release"][..],
        Profile::Loop => &["--profile", "hil", "--no-default-features", "--features", "hil"],
    });
    // Flags from the environment would displace the linker arguments of `.cargo/config.toml`, and
    // an incremental build is another image.
    for name in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_INCREMENTAL"] {
        cargo.env_remove(name);
    }
    executable(&mut cargo, "the firmware", binary)
}

/// `cargo build` of this in the workspace, for [`executable`].
pub(crate) fn build_command(arguments: &[&str]) -> Command {
    let mut cargo = Command::new(tool("CARGO", "cargo"));
    cargo.current_dir(workspace()).arg("build").args(arguments);
    cargo.args(["--message-format", "json-render-diagnostics"]);
    cargo
}

/// Runs a [`build_command`] of `what`, with progress if there is something to build, and returns
/// the path of the binary, as cargo names it.
pub(crate) fn executable(
    cargo: &mut Command,
    what: &str,
    binary: &str,
) -> Result<PathBuf, FirmwareError> {
    let (status, messages) =
        building::run(cargo, what).map_err(|source| could_not_start(cargo, source))?;
    if !status.success() {
        return Err(FirmwareError::Build(binary.to_owned(), status));
    }
    named(&messages, binary).ok_or_else(|| FirmwareError::NoExecutable(binary.to_owned()))
}

/// The binary's path from cargo's messages, one JSON object a line.
fn named(messages: &str, binary: &str) -> Option<PathBuf> {
    let messages = messages.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let mut executables = messages.filter(|message| message["target"]["name"] == binary);
    executables.find_map(|message| message["executable"].as_str().map(PathBuf::from))
}

/// Builds the firmware and returns the image.
pub fn image(profile: Profile) -> Result<Vec<u8>, FirmwareError> {
    let path = build(profile)?;
    std::fs::read(&path).map_err(|source| FirmwareError::Read { path, source })
}

/// Identity of an image: the linker's hash and its address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Address of the channels' control block.
    pub block: u32,
    place: u32,
    id: Vec<u8>,
}

impl Image {
    /// Of the image in `elf`.
    pub fn of(elf: &[u8]) -> Result<Self, FirmwareError> {
        let file = parse(elf)?;
        let section = file.section_by_name(ID);
        let section = section.ok_or_else(|| FirmwareError::Image("it has no hash".to_owned()))?;
        let id = section.data().map_err(|error| FirmwareError::Image(error.to_string()))?.to_vec();
        // Addresses of a chip with 32 bits.
        Ok(Self { block: symbol(&file, BLOCK)? as u32, place: section.address() as u32, id })
    }

    /// Whether a board has this image in its flash.
    pub fn is_on(&self, port: &mut dyn Port) -> Result<bool, PortError> {
        let mut there = vec![0; self.id.len()];
        port.memory(self.place, &mut there)?;
        Ok(there == self.id)
    }
}

fn parse(elf: &[u8]) -> Result<ElfFile32<'_>, FirmwareError> {
    ElfFile32::parse(elf).map_err(|error| FirmwareError::Image(error.to_string()))
}

fn symbol(file: &ElfFile32<'_>, name: &str) -> Result<u64, FirmwareError> {
    let symbol = file.symbols().find(|symbol| symbol.name() == Ok(name));
    let address = symbol.map(|symbol| symbol.address());
    address.ok_or_else(|| FirmwareError::Image(format!("no symbol {name}")))
}

/// Cycles with the flash's wait states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WithWaits {
    pub mean: f64,
    pub worst: u64,
}

/// Memory of an image, bytes. Its bounds are asserted in `memory.x`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Footprint {
    /// Flash, with the copies that fill RAM at start.
    pub flash: u64,
    /// RAM, the stack included.
    pub ram: u64,
    /// Reserved for the stack.
    pub stack: u64,
}

impl Footprint {
    /// Measures the image in `bytes`.
    pub fn of_elf(bytes: &[u8]) -> Result<Self, FirmwareError> {
        let file = parse(bytes)?;
        let stack = symbol(&file, "_stack_start")?.saturating_sub(symbol(&file, "_stack_end")?);
        let mut taken = Self { flash: 0, ram: stack, stack };
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(elf::SHF_ALLOC) == 0 {
                continue;
            }
            let in_flash = FLASH.contains(&section.address());
            if in_flash || section.kind() != SectionKind::UninitializedData {
                taken.flash += section.size();
            }
            if !in_flash {
                taken.ram += section.size();
            }
        }
        Ok(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_kind_is_refused() {
        let error = Footprint::of_elf(b"#!/bin/sh\n").expect_err("not an ELF");
        assert!(matches!(error, FirmwareError::Image(_)));
    }

    #[test]
    fn the_image_is_found_among_cargos_messages() {
        let messages = r#"{"reason":"compiler-artifact","target":{"name":"defmt"},"executable":null}
{"reason":"compiler-artifact","target":{"name":"interstage"},"executable":null}
{"reason":"compiler-artifact","target":{"name":"interstage"},"executable":"/t/interstage"}
{"reason":"build-finished","success":true}"#;
        assert_eq!(named(messages, "interstage"), Some(PathBuf::from("/t/interstage")));
        assert_eq!(named("", "interstage"), None);
    }
}
