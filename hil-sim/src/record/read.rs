//! Reads logs from files: MCAP, CSV, or the bare bytes of the channel.

use std::path::Path;

use super::tick::OFF;
use super::{Controller, Decoder, FRAMES, Run};
use interstage::log::frame::{Found, find};
use mcap::records::{Metadata, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// First bytes of an MCAP file.
pub(super) const MCAP: &[u8] = b"\x89MCAP";
/// First bytes of a CSV file of rows.
const CSV: &[u8] = b"tick,";

/// A log that cannot be read; displays as one line with its path.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file at this path cannot be read.
    #[error("{0}: {1}")]
    File(String, std::io::Error),
    /// The file at this path is no log, and why.
    #[error("{0}: no log of the controller: {1}")]
    Content(String, String),
}

impl ReadError {
    /// What is wrong, without the path.
    #[must_use]
    pub fn reason(&self) -> String {
        match self {
            Self::File(_, why) => why.to_string(),
            Self::Content(_, why) => why.clone(),
        }
    }
}

/// The content of the file at `path`.
pub(super) fn content(path: &Path) -> Result<Vec<u8>, ReadError> {
    std::fs::read(path).map_err(|error| ReadError::File(path.display().to_string(), error))
}

/// The stream, cut after every frame; what follows the last one is left out.
pub fn pieces(stream: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = stream;
    std::iter::from_fn(move || {
        let mut used = 0;
        loop {
            used += match find(rest.get(used..).filter(|rest| !rest.is_empty())?) {
                Found::Garbage(length) => length,
                Found::Part => 1,
                Found::Frame(_, length) => {
                    let (piece, behind) = rest.split_at(used + length);
                    rest = behind;
                    return Some(piece);
                }
            };
        }
    })
}

impl Run {
    /// Reads a log of any form: MCAP with the controller's frames, CSV of rows, or the
    /// bytes of the channel. A file that was cut off is read up to there.
    ///
    /// # Errors
    /// [`ReadError`] if the file cannot be read or holds no tick.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let bytes = content(path)?;
        let no_log = |why: String| ReadError::Content(path.display().to_string(), why);
        let run = if bytes.starts_with(MCAP) {
            of_mcap(&bytes)
        } else if bytes.starts_with(CSV) {
            of_csv(&bytes).map_err(no_log)?
        } else {
            Self::of_stream(&bytes)
        };
        if run.rows.is_empty() {
            return Err(no_log("it holds no tick".to_owned()));
        }
        Ok(run)
    }
}

/// Longest record, bytes: some hundred times those that this program writes.
const LONGEST_RECORD: usize = 1 << 26;

/// Largest ratio of a chunk's content to its size in the file: the limit of LZ4.
const EXPANSION: u64 = 256;

/// The file up to the first record whose length cannot be true: longer than the rest of the
/// file, or a chunk larger than LZ4 can expand to. The reader would allocate that length.
fn credible(bytes: &[u8]) -> &[u8] {
    const CHUNK: u8 = 6;
    // An opcode and a length; in a chunk two times come before the length of its content.
    const HEAD: usize = 9;
    let number = |at: usize| Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let mut at = MCAP.len() + 3;
    while let Some(length) = number(at + 1) {
        let rest = (bytes.len() - at - HEAD) as u64;
        let holds = if bytes[at] == CHUNK { number(at + HEAD + 16).unwrap_or(0) } else { 0 };
        if length > rest || holds > length.saturating_mul(EXPANSION) {
            return &bytes[..at];
        }
        at += HEAD + length as usize;
    }
    bytes
}

/// Hands over the records of an MCAP file, those of its chunks one by one, up to the end or to
/// where the file was cut off or damaged.
pub(super) fn records(bytes: &[u8], mut take: impl FnMut(Record<'_>)) {
    let mut rest = credible(bytes);
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    while let Some(Ok(event)) = reader.next_event() {
        match event {
            LinearReadEvent::ReadRequest(wanted) => {
                let (now, later) = rest.split_at(wanted.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            LinearReadEvent::Record { data, opcode } => match mcap::parse_record(opcode, data) {
                Ok(record) => take(record),
                Err(_) => return,
            },
        }
    }
}

/// The rig's parameters, if this is where a file has them.
pub(super) fn parameters(metadata: &Metadata) -> Option<String> {
    metadata.metadata.get("toml").filter(|_| metadata.name == "parameters").cloned()
}

fn of_mcap(bytes: &[u8]) -> Run {
    let (mut decoder, mut run, mut frames) = (Decoder::new(), Run::default(), None);
    records(bytes, |record| match record {
        Record::Channel(channel) if channel.topic == FRAMES => frames = Some(channel.id),
        Record::Message { header, data } if Some(header.channel_id) == frames => {
            decoder.read(&data, &mut |item| run.add(&item));
        }
        Record::Metadata(metadata) => {
            run.parameters = run.parameters.take().or(parameters(&metadata))
        }
        _ => {}
    });
    decoder.finish(&mut |item| run.add(&item));
    run.counts = *decoder.counts();
    run
}

/// Reads the controller's columns. Ticks that did not run and an incomplete last row are left
/// out.
fn of_csv(bytes: &[u8]) -> Result<Run, String> {
    let mut run = Run::default();
    let mut reader = csv::Reader::from_reader(bytes);
    let head = reader.headers().map_err(|error| error.to_string())?.clone();
    let columns = serde_json::to_value(Controller::default()).unwrap_or_default();
    let lacks = |name: &&String| !head.iter().any(|found| found == name.as_str());
    if let Some((name, _)) = columns.as_object().into_iter().flatten().find(|(name, _)| lacks(name))
    {
        return Err(format!("it lacks the column {name}"));
    }
    let mut rows = reader.records().peekable();
    while let Some(row) = rows.next() {
        match row.and_then(|row| row.deserialize::<Controller>(Some(&head))) {
            Ok(row) if row.mode == OFF => {}
            Ok(row) => run.rows.push(row),
            Err(_) if rows.peek().is_none() => break,
            Err(error) => return Err(error.to_string()),
        }
    }
    run.counts.bytes = bytes.len() as u64;
    run.counts.ticks = run.rows.len() as u64;
    Ok(run)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    use crate::record::decoder::tests::frames;

    fn file(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log");
        std::fs::write(&path, bytes).unwrap();
        (directory, path)
    }

    #[test]
    fn a_length_that_cannot_be_ends_the_file_there() {
        let record = |opcode: u8, length: u64, body: &[u8]| {
            [&[opcode][..], &length.to_le_bytes(), body].concat()
        };
        let head = [MCAP, b"0\r\n"].concat();
        let good = [head, record(1, 3, b"abc"), record(6, 40, &[0; 40])].concat();
        assert_eq!(credible(&good), good);
        let long = [good.clone(), record(5, 1 << 62, b"xyz")].concat();
        assert_eq!(credible(&long), good);
        // A chunk of 24 bytes that claims to hold more than 6 KiB.
        let mut body = [0; 24];
        body[16..].copy_from_slice(&10_000_u64.to_le_bytes());
        let swollen = [good.clone(), record(6, 24, &body)].concat();
        assert_eq!(credible(&swollen), good);
        for cut in 0..good.len() {
            assert!(credible(&good[..cut]).len() <= cut);
        }
    }

    #[test]
    fn the_bytes_of_the_channel_are_a_log() {
        let (_directory, path) = file(&frames(0, 80).concat());
        let run = Run::read(&path).unwrap();
        assert_eq!(run.rows.len(), 80);
        assert!(run.is_complete());
        assert_eq!(run.header.unwrap().rig, "test");
    }

    #[test]
    fn a_stream_is_cut_behind_its_frames() {
        let all = frames(0, 80);
        let stream = [b"strange", &all.concat()[..], &all[3][..9]].concat();
        let cut: Vec<&[u8]> = pieces(&stream).collect();
        assert_eq!(cut.len(), all.len());
        assert_eq!(cut[0], [b"strange", &all[0][..]].concat());
        assert!(cut[1..].iter().zip(&all[1..]).all(|(piece, frame)| piece == frame));
    }

    #[test]
    fn rows_come_back_from_csv_even_if_it_was_cut() {
        let run = Run::of_stream(&frames(0, 80).concat());
        let mut csv = csv::Writer::from_writer(Vec::new());
        for row in &run.rows {
            csv.serialize(row).unwrap();
        }
        let bytes = csv.into_inner().unwrap();
        let (_directory, path) = file(&bytes);
        assert_eq!(Run::read(&path).unwrap().rows, run.rows);
        let (_directory, path) = file(&bytes[..bytes.len() - 40]);
        assert_eq!(Run::read(&path).unwrap().rows, run.rows[..79]);
    }

    #[test]
    fn what_is_no_log_is_refused_in_one_line() {
        for bytes in [&b""[..], b"hello", b"\x89MCAP0\r\n", &[7; 900]] {
            let (_directory, path) = file(bytes);
            let error = Run::read(&path).unwrap_err().to_string();
            assert!(error.contains("no log") && error.lines().count() == 1, "{error}");
        }
        let (_directory, path) = file(b"tick,t_s,mode,preload_sensor_code\n1,0.001,0,7\n");
        let error = Run::read(&path).unwrap_err().to_string();
        assert!(error.contains("it lacks the column arm_angle_at"), "{error}");
        let missing = Run::read(Path::new("/nowhere/log.mcap")).unwrap_err();
        assert!(matches!(missing, ReadError::File(..)));
    }
}
