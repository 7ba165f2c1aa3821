//! Files of a log that grows, for `capture` and `live`.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use interstage::log::identity::fingerprint;
use serde_json::json;

use super::failure::Failure;
use crate::files::{make_directory, vacant};
use crate::record::{
    Counts, Header, Item, Metadata, WriteError, Writer, recordings, write_metadata,
};
use crate::scenario::Scenario;

/// Ctrl-C as a request to end with complete files.
pub(super) struct Stop(Arc<AtomicBool>);

impl Stop {
    pub(super) fn by_ctrl_c() -> Self {
        let wanted = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&wanted);
        // Without it Ctrl-C ends the program at once, and the files say that they were cut off.
        // The second one does so where the source gives nothing.
        let _ = ctrlc::set_handler(move || {
            if seen.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
        Self(wanted)
    }

    pub(super) fn is_wanted(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// An MCAP file and a table with its metadata.
pub(super) struct LogFiles {
    writer: Writer<BufWriter<File>, BufWriter<File>>,
    folder: PathBuf,
    mcap: PathBuf,
    /// None if it is left out.
    csv: Option<PathBuf>,
    /// What the target is said to run with: hash and TOML.
    given: (String, String),
    /// The target's identity, as soon as it has come, and what it runs with, if that is what was
    /// given.
    metadata: Metadata,
    news: Vec<String>,
}

impl LogFiles {
    /// Begins the files `name` in `folder`; without a name `log`, with a number if that is there.
    /// `bare` leaves the table and the decoded ticks out.
    pub(super) fn new(
        folder: &Path,
        name: Option<&str>,
        bare: bool,
        scenario: &Scenario,
    ) -> Result<Self, Failure> {
        let mcap = free(folder, name)?;
        make_directory(folder)?;
        let csv = (!bare).then(|| mcap.with_extension("csv"));
        let table = csv.as_deref().map(created).transpose()?;
        let writer = Writer::new(Some(created(&mcap)?), table, None, !bare);
        let given = (format!("{:08x}", fingerprint(&scenario.rig)), scenario.to_toml());
        Ok(Self {
            writer: writer.map_err(|error| failed(folder, error))?,
            folder: folder.to_owned(),
            mcap,
            csv,
            given,
            metadata: Metadata::default(),
            news: Vec::new(),
        })
    }

    /// The file with the frames.
    pub(super) fn mcap(&self) -> &Path {
        &self.mcap
    }

    /// Takes bytes in pieces of any size; passes each item to `see`.
    pub(super) fn take(
        &mut self,
        bytes: &[u8],
        see: &mut impl FnMut(&Item),
    ) -> Result<(), Failure> {
        self.writer.take(bytes, see).map_err(|error| failed(&self.folder, error))?;
        match self.writer.header() {
            Some(header) if self.metadata.header.as_ref() != Some(header) => {
                self.identified(header.clone())
            }
            _ => Ok(()),
        }
    }

    /// The target has said what it runs with: parameters that have its hash belong to the log.
    fn identified(&mut self, header: Header) -> Result<(), Failure> {
        let (hash, toml) = &self.given;
        if header.parameters == *hash {
            let written = self.writer.parameters(toml);
            written.map_err(|error| failed(&self.folder, error))?;
            self.metadata.parameters = Some(toml.clone());
        } else {
            self.news.push(format!(
                "the target runs with parameters {}, those given are {hash}: the log has none \
                 (`rig params save FILE` writes a board's; give that file)",
                header.parameters
            ));
        }
        self.metadata.header = Some(header);
        // The number of ticks follows at the end.
        describe(self.csv.as_deref(), &self.metadata).map(drop)
    }

    /// What has been read so far.
    pub(super) const fn counts(&self) -> &Counts {
        self.writer.counts()
    }

    /// What the operator should know, a line each, since the last call.
    pub(super) fn news(&mut self) -> Vec<String> {
        std::mem::take(&mut self.news)
    }

    /// Completes the files and returns what was read, and their paths.
    pub(super) fn finish(
        self,
        see: &mut impl FnMut(&Item),
    ) -> Result<(Counts, Vec<PathBuf>), Failure> {
        let Self { writer, folder, mcap, csv, mut metadata, .. } = self;
        let counts = writer.finish(see).map_err(|error| failed(&folder, error))?;
        let starts = csv.as_ref().and_then(|_| recordings(&mcap).ok()).unwrap_or_default();
        if let [start] = &starts[..] {
            metadata.crossings = json!(start.summary.crossings);
        }
        metadata.ticks = Some(counts.ticks);
        let described = describe(csv.as_deref(), &metadata)?;
        Ok((counts, [Some(mcap), csv, described].into_iter().flatten().collect()))
    }
}

/// Writes the metadata of the table, if there is one; their path.
fn describe(csv: Option<&Path>, metadata: &Metadata) -> Result<Option<PathBuf>, Failure> {
    Ok(csv.map(|csv| write_metadata(csv, metadata, false)).transpose()?)
}

fn failed(folder: &Path, error: WriteError) -> Failure {
    Failure::run(format!("{}: {error}", folder.display()))
}

/// The first of the files: what is there is kept.
fn free(folder: &Path, asked: Option<&str>) -> Result<PathBuf, Failure> {
    let taken = |mcap: &Path| {
        [mcap.to_owned(), mcap.with_extension("csv")].into_iter().find(|path| path.exists())
    };
    let Some(name) = asked else {
        return Ok(vacant(&folder.join("log.mcap"), |mcap| taken(mcap).is_some()));
    };
    let mcap = folder.join(format!("{name}.mcap"));
    let refused = match taken(&mcap) {
        _ if Path::new(name).file_name().is_none_or(|file| file != name) => {
            format!("--name {name}: a name without a folder is expected")
        }
        Some(path) => format!("{}: is there already; give another --name", path.display()),
        None => return Ok(mcap),
    };
    Err(Failure::input(refused))
}

fn created(path: &Path) -> Result<BufWriter<File>, Failure> {
    let file = File::create(path);
    let file = file.map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
    Ok(BufWriter::new(file))
}
