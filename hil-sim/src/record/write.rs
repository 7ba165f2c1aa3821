//! Writes MCAP and CSV files of a log that grows, and the files of a completed run.
//!
//! Once a second of the log's time everything is flushed as complete chunks, so that a file
//! that was cut off by a full disk or a lost supply is read up to its last second.

use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

use super::csv_file::{Metadata, write_metadata, write_row};
use super::mcap_file::{McapFile, TICK_NS, wrapped};
use super::row::OFF;
use super::{
    Columns, Counts, Decoder, Header, Item, Mark, Recording, Row, Run, Topic, messages, write_mcap,
};
use crate::files::{Failure, FileError, atomic_write, make_directory, with_causes};
use crate::table::counted;

/// Ticks between two flushes.
const FLUSH_TICKS: u64 = 1000;

/// Why writing stopped. What was flushed before stays readable.
#[derive(Debug, thiserror::Error)]
#[error("writing stopped after {}, of which {kept} are safe: {}", counted(ticks, "tick"), with_causes(&**source))]
pub struct WriteError {
    /// Ticks taken.
    pub ticks: u64,
    /// Ticks flushed.
    pub kept: u64,
    source: Failure,
}

/// Writes the rows of `recording` to `path`, below the names of the columns.
pub(super) fn write_csv(recording: &Recording, path: &Path) -> Result<(), FileError> {
    atomic_write(path, |out| {
        let mut csv = csv::Writer::from_writer(out);
        for tick in &recording.rows {
            write_row(&mut csv, tick)?;
        }
        Ok(csv.flush()?)
    })
}

/// Writes `log.csv` with its metadata, `log.mcap` and `summary.json`, the object that
/// `rig deploy --json` prints, into `directory`, which is made if it is missing, and returns
/// their paths.
pub fn write_all(recording: &Recording, directory: &Path) -> Result<Vec<PathBuf>, FileError> {
    make_directory(directory)?;
    let [csv, mcap, summary] =
        ["log.csv", "log.mcap", "summary.json"].map(|name| directory.join(name));
    write_csv(recording, &csv)?;
    let header = Run::of_stream(&recording.stream).header;
    let parameters = Some(recording.parameters.clone());
    let ticks = recording.rows.iter().filter(|row| row.controller.mode != OFF).count() as u64;
    let crossings = serde_json::json!(recording.summary.crossings);
    let metadata = Metadata { header, parameters, ticks: Some(ticks), crossings };
    let described = write_metadata(&csv, &metadata, true)?;
    write_mcap(recording, &mcap)?;
    atomic_write(&summary, |out| {
        serde_json::to_writer_pretty(&mut *out, &recording.summary)?;
        Ok(out.write_all(b"\n")?)
    })?;
    Ok(vec![csv, described, mcap, summary])
}

/// Writes a log that grows to an MCAP file and a CSV file, of which each may be absent.
pub struct Writer<M: Write + Seek, C: Write> {
    mcap: Option<McapFile<M>>,
    csv: Option<csv::Writer<C>>,
    /// Whether ticks go into the MCAP file beside the frames.
    decoded: bool,
    decoder: Decoder,
    header: Option<Header>,
    /// Time of the latest message, ns; it never goes back.
    now: u64,
    /// Time at which the target started, ns.
    start: u64,
    /// Ticks flushed.
    kept: u64,
}

impl<M: Write + Seek, C: Write> Writer<M, C> {
    /// Begins the files. `parameters` are the controller's as TOML, if known; `decoded` adds
    /// ticks to the MCAP file beside the frames.
    pub fn new(
        mcap: Option<M>,
        csv: Option<C>,
        parameters: Option<&str>,
        decoded: bool,
    ) -> Result<Self, WriteError> {
        let begin = |out| {
            let mut file = McapFile::new(out)?;
            parameters.map_or(Ok(()), |toml| file.parameters(toml))?;
            Ok(file)
        };
        let fail = |source: Failure| WriteError { ticks: 0, kept: 0, source };
        Ok(Self {
            mcap: mcap.map(begin).transpose().map_err(fail)?,
            csv: csv.map(csv::Writer::from_writer),
            decoded,
            decoder: Decoder::new(),
            header: None,
            now: 0,
            start: 0,
            kept: 0,
        })
    }

    /// Adds the controller's parameters, as TOML, to the MCAP file.
    pub(crate) fn parameters(&mut self, toml: &str) -> Result<(), WriteError> {
        let written = self.mcap.as_mut().map_or(Ok(()), |mcap| mcap.parameters(toml));
        written.map_err(|source| self.failed(source))
    }

    /// The target's identity, as soon as it has come.
    pub(crate) const fn header(&self) -> Option<&Header> {
        self.header.as_ref()
    }

    /// What has been read so far.
    pub(crate) const fn counts(&self) -> &Counts {
        self.decoder.counts()
    }

    /// Takes bytes in pieces of any size; passes each item to `see`.
    pub fn take(&mut self, bytes: &[u8], see: &mut impl FnMut(&Item)) -> Result<(), WriteError> {
        self.try_take(bytes, see).map_err(|source| self.failed(source))
    }

    fn try_take(&mut self, bytes: &[u8], see: &mut impl FnMut(&Item)) -> Result<(), Failure> {
        let mut items = Vec::new();
        self.decoder.read(bytes, &mut |item| items.push(item));
        self.items(&items, see)?;
        if self.counts().ticks >= self.kept + FLUSH_TICKS {
            self.flush()?;
        }
        Ok(())
    }

    fn failed(&self, source: Failure) -> WriteError {
        WriteError { ticks: self.counts().ticks, kept: self.kept, source }
    }

    fn items(&mut self, items: &[Item], see: &mut impl FnMut(&Item)) -> Result<(), Failure> {
        for item in items {
            see(item);
            match item {
                Item::Tick(record, sensors) => {
                    self.now = self.now.max(self.start + u64::from(record.at()) * TICK_NS);
                    if let Some(csv) = &mut self.csv {
                        let controller = Columns::of(record, sensors);
                        write_row(csv, &Row { controller, truth: None })?;
                    }
                }
                Item::Mark(Mark::Restart) => self.start = self.now,
                Item::Identity(identity) => self.identify(Header::from(identity))?,
                _ => {}
            }
            let message = match item {
                Item::Frame(bytes) => Some((Topic::Frames, wrapped(bytes))),
                item => messages(item).filter(|(topic, _)| self.decoded || *topic != Topic::Tick),
            };
            if let (Some(mcap), Some((topic, body))) = (&mut self.mcap, message) {
                mcap.message(self.now, topic, &body)?;
            }
        }
        Ok(())
    }

    /// Adds the target's identity if it is new.
    fn identify(&mut self, header: Header) -> Result<(), Failure> {
        if self.header.as_ref() == Some(&header) {
            return Ok(());
        }
        if let Some(mcap) = &mut self.mcap {
            let value = serde_json::to_value(&header)?;
            let pairs = value.as_object().into_iter().flatten().map(|(key, value)| {
                (key.clone(), value.as_str().map_or_else(|| value.to_string(), str::to_owned))
            });
            mcap.metadata("identity", pairs)?;
        }
        self.header = Some(header);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Failure> {
        self.mcap.as_mut().map_or(Ok(()), McapFile::flush)?;
        self.csv.as_mut().map_or(Ok(()), csv::Writer::flush)?;
        self.kept = self.counts().ticks;
        Ok(())
    }

    /// Closes the files; returns the counts.
    pub fn finish(mut self, see: &mut impl FnMut(&Item)) -> Result<Counts, WriteError> {
        let mut items = Vec::new();
        self.decoder.finish(&mut |item| items.push(item));
        let closed = self
            .items(&items, see)
            .and_then(|()| self.flush())
            .and_then(|()| self.mcap.as_mut().map_or(Ok(()), McapFile::finish));
        closed.map_err(|source| self.failed(source))?;
        Ok(*self.counts())
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Error, ErrorKind, SeekFrom};
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::record::decoder::tests::deployment;
    use crate::record::read::tests::read;
    use crate::record::{Run, Summary};
    use crate::report::example;

    /// A disk of so many bytes.
    #[derive(Clone)]
    struct Disk(Arc<Mutex<Cursor<Vec<u8>>>>, u64);

    impl Disk {
        fn of(bytes: u64) -> Self {
            Self(Arc::default(), bytes)
        }

        fn content(&self) -> Vec<u8> {
            self.0.lock().unwrap().get_ref().clone()
        }
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            let mut disk = self.0.lock().unwrap();
            let left = self.1.saturating_sub(disk.position()) as usize;
            if left == 0 {
                return Err(Error::from(ErrorKind::StorageFull));
            }
            disk.write(&bytes[..bytes.len().min(left)])
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Disk {
        fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
            self.0.lock().unwrap().seek(to)
        }
    }

    /// Writes the stream in pieces to an MCAP file and a table on these disks.
    fn write(stream: &[u8], [mcap, csv]: &[Disk; 2]) -> Result<Counts, WriteError> {
        let (mcap, csv) = (Some(mcap.clone()), Some(csv.clone()));
        let mut writer = Writer::new(mcap, csv, Some("[run]\nseed = 0\n"), true)?;
        for part in stream.chunks(777) {
            writer.take(part, &mut |_| {})?;
        }
        writer.finish(&mut |_| {})
    }

    /// The same on disks that are never full: what was counted, and the files.
    fn written(stream: &[u8]) -> (Counts, [Vec<u8>; 2]) {
        let disks = [Disk::of(u64::MAX), Disk::of(u64::MAX)];
        (write(stream, &disks).unwrap(), disks.map(|disk| disk.content()))
    }

    #[test]
    fn both_files_give_back_what_came() {
        let stream = deployment().stream;
        let (counts, files) = written(&stream);
        assert!(!String::from_utf8_lossy(&files[1]).contains("_true"), "no truth came");
        let (run, [mcap, csv]) = (Run::of_stream(&stream), files.map(|file| read(&file).unwrap()));
        assert_eq!(counts, run.counts);
        assert_eq!(csv.rows, run.rows);
        assert_eq!(mcap.parameters.as_deref(), Some("[run]\nseed = 0\n"));
        assert_eq!((mcap.cut, csv.cut), (None, None));
        assert_eq!(Run { parameters: None, ..mcap }, run);
    }

    #[test]
    fn a_full_disk_is_reported_and_what_was_written_stays_readable() {
        let stream = deployment().stream;
        for (mcap, csv) in [(400_000, u64::MAX), (u64::MAX, 500_000)] {
            let disks = [Disk::of(mcap), Disk::of(csv)];
            let error = write(&stream, &disks).unwrap_err();
            let text = error.to_string();
            assert!(text.contains("no storage space") && text.lines().count() == 1, "{text}");
            assert!(error.kept >= 1000 && error.kept <= error.ticks, "{error}");
            for disk in disks {
                let run = read(&disk.content()).unwrap();
                assert!(run.rows.len() as u64 >= error.kept, "{} rows", run.rows.len());
                assert!(run.rows.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1));
            }
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_read_up_to_there() {
        let (_, [file, _]) = written(&deployment().stream);
        let mut before = 0;
        for tenth in 4..10 {
            let run = read(&file[..file.len() * tenth / 10]).unwrap();
            let rows = run.rows.len();
            let cut = run.cut.expect("it is noticed");
            assert_eq!((cut.at_s, cut.missing_ticks), (run.rows[rows - 1].t_s, None));
            assert!(rows >= before && rows > 500, "{rows} rows of {tenth} tenths");
            before = rows;
        }
        assert!(before >= 3000, "{before}");
    }

    #[test]
    fn time_in_the_file_never_goes_back_even_if_the_target_restarts() {
        let (counts, [content, _]) = written(&deployment().stream.repeat(2));
        assert_eq!(counts.restarts, 1);
        let mut last = 0;
        for message in mcap::MessageStream::new(&content).unwrap() {
            let message = message.unwrap();
            assert!(message.log_time >= last, "{}", message.channel.topic);
            last = message.log_time;
        }
    }

    #[test]
    fn every_file_is_written_without_a_temporary_one_and_rows_come_back_to_the_bit() {
        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path().join("out/run");
        let recording = example::deploy();
        let files = write_all(&recording, &folder).unwrap();
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), files.len());
        let summary = std::fs::read_to_string(&files[3]).unwrap();
        assert_eq!(serde_json::from_str::<Summary>(&summary).unwrap(), recording.summary);
        let mut reader = csv::Reader::from_path(&files[0]).unwrap();
        let head = reader.headers().unwrap().clone();
        let row = |record: csv::Result<csv::StringRecord>| {
            let record = record.unwrap();
            let controller = record.deserialize(Some(&head)).unwrap();
            Row { controller, truth: Some(record.deserialize(Some(&head)).unwrap()) }
        };
        let rows: Vec<Row> = reader.records().map(row).collect();
        // A NaN differs from itself; its text does not.
        assert_eq!(format!("{rows:?}"), format!("{:?}", recording.rows));
    }
}
