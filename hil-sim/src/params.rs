//! Reads, changes and activates stored parameters of a board or a file.
//!
//! A board keeps its parameters as a set that this program makes
//! ([`interstage::params`]). A file may hold a set as well, so that every operation can be
//! tried without a board.

mod line;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use interstage::params::{CompileError, ParameterSet, SCHEMA, SetError, compile};
use interstage::rig::Rig;

use crate::files::{FileError, atomic_write};
use crate::probe::PortError;

pub use line::Client;

/// Why an operation on parameters failed. Displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// A file could not be read, or the emulated board's flash written.
    #[error("{path}: {source}")]
    File { path: String, source: std::io::Error },
    #[error(transparent)]
    Write(#[from] FileError),
    /// There is no valid set.
    #[error("{place}: {source}")]
    Set { place: String, source: SetError },
    #[error(transparent)]
    Compile(#[from] CompileError),
    #[error("the board does not answer within {seconds} s")]
    Silent { seconds: f64 },
    #[error("the board refuses: {0}")]
    Refused(&'static str),
    #[error("the board answered something else than it was asked")]
    Answer,
    #[error(transparent)]
    Port(#[from] PortError),
    /// The emulated board cannot be started.
    #[error("{0}")]
    Wire(String),
}

/// The active parameters of a place.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// Name of the rig.
    pub name: String,
    pub rig: Rig,
    /// Layout of its constants; if it is not [`SCHEMA`], they must be made again.
    pub schema: u16,
    pub hash: u32,
    /// Where it is, in words.
    pub origin: String,
}

impl Held {
    /// From the bytes of a set of any schema.
    pub fn of(set: &[u8], origin: String) -> Result<Self, SetError> {
        let set = ParameterSet::open_any(set)?;
        let header = set.header();
        Ok(Self {
            name: header.name.as_str().to_owned(),
            rig: set.rig()?,
            schema: header.schema,
            hash: header.parameters,
            origin,
        })
    }

    /// Whether its constants are of this program's layout.
    pub(crate) const fn is_current(&self) -> bool {
        self.schema == SCHEMA
    }
}

/// A place that holds parameters.
pub trait Store {
    /// The active parameters.
    fn held(&mut self) -> Result<Held, StoreError>;

    /// Makes a set the active one, completely or not at all.
    fn put(&mut self, set: &[u8]) -> Result<(), StoreError>;

    /// Makes the defaults the active set.
    fn restore(&mut self) -> Result<(), StoreError>;
}

pub fn set_of(name: &str, rig: &Rig) -> Result<Vec<u8>, CompileError> {
    Ok(compile(name, rig)?.to_vec())
}

/// A file that holds one set. Until it exists, the prototype's set is active.
#[derive(Clone, Debug)]
pub(crate) struct SetFile {
    path: PathBuf,
}

impl SetFile {
    /// This file, which need not exist.
    pub(crate) fn new(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    fn place(&self) -> String {
        self.path.display().to_string()
    }
}

impl Store for SetFile {
    fn held(&mut self) -> Result<Held, StoreError> {
        let (set, origin) = if self.path.exists() {
            let set = fs::read(&self.path);
            let failed = |source| StoreError::File { path: self.place(), source };
            (set.map_err(failed)?, self.place())
        } else {
            let set = set_of("prototype", &Rig::prototype())?;
            (set, format!("defaults: {} does not exist yet", self.place()))
        };
        Held::of(&set, origin).map_err(|source| StoreError::Set { place: self.place(), source })
    }

    fn put(&mut self, set: &[u8]) -> Result<(), StoreError> {
        Ok(atomic_write(&self.path, |out| Ok(out.write_all(set)?))?)
    }

    fn restore(&mut self) -> Result<(), StoreError> {
        self.put(&set_of("prototype", &Rig::prototype())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_holds_what_was_put_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.set");
        let mut file = SetFile::new(&path);
        assert_eq!(file.held().unwrap().rig, Rig::prototype());
        file.put(&set_of("mine", &Rig::fe()).unwrap()).unwrap();
        let held = file.held().unwrap();
        assert_eq!((held.name.as_str(), &held.rig), ("mine", &Rig::fe()));
        assert!(held.is_current());
        file.restore().unwrap();
        assert_eq!(file.held().unwrap().rig, Rig::prototype());
    }

    #[test]
    fn a_damaged_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.set");
        let mut set = set_of("mine", &Rig::fe()).unwrap();
        set[300] ^= 1;
        fs::write(&path, &set).unwrap();
        let error = SetFile::new(&path).held().unwrap_err().to_string();
        assert!(error.contains("mine.set") && error.contains("damaged"), "{error}");
    }
}
