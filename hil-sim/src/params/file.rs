//! A set of parameters in a file.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use interstage::rig::Rig;

use super::{Held, Store, StoreError, set_of};
use crate::files::atomic_write;

/// A file that holds one set. Until it exists, the prototype's set is active.
#[derive(Clone, Debug)]
pub struct SetFile {
    path: PathBuf,
}

impl SetFile {
    /// This file, which need not exist.
    #[must_use]
    pub fn new(path: &Path) -> Self {
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
