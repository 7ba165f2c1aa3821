//! Reads logs from files: MCAP, CSV, or the bare bytes of the channel.

use std::path::{Path, PathBuf};

use super::csv_file::{self, Metadata as TableMetadata};
use super::mcap_file::unwrapped;
use super::row::OFF;
use super::{Columns, Decoder, FRAMES, Mark, Run};
use mcap::records::{Metadata, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// First bytes of an MCAP file.
pub(super) const MCAP: &[u8] = b"\x89MCAP";
/// First bytes of a CSV file of rows.
pub(super) const CSV: &[u8] = b"tick,";

/// A log that cannot be read; displays as one line with its path.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file at this path cannot be read.
    #[error("{0}: {1}")]
    File(String, std::io::Error),
    #[error("{0}: a table of ticks has no crossings and no events: give the log.mcap of the run")]
    Table(String),
    #[error("{0}: no log of the controller: {1}")]
    Content(String, String),
}

impl ReadError {
    /// What is wrong, without the path.
    pub(crate) fn reason(&self) -> String {
        match self {
            Self::File(_, why) => why.to_string(),
            Self::Table(_) => "a table of ticks".to_owned(),
            Self::Content(_, why) => why.clone(),
        }
    }
}

/// The log at `path`: the file, or that of the run in this folder.
pub(crate) fn log_at(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("log.mcap") } else { path.to_owned() }
}

/// The content of the file at `path`.
pub(super) fn content(path: &Path) -> Result<Vec<u8>, ReadError> {
    std::fs::read(path).map_err(|error| ReadError::File(path.display().to_string(), error))
}

impl Run {
    /// Reads a log of any form: MCAP with the controller's frames, CSV of rows with the metadata
    /// beside it, or the bytes of the channel. A file that was cut off is read up to there.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let bytes = content(path)?;
        let no_log = |why: String| ReadError::Content(path.display().to_string(), why);
        let run = if bytes.starts_with(MCAP) {
            of_mcap(&bytes)
        } else if bytes.starts_with(CSV) {
            of_csv(&bytes, csv_file::metadata_of(path).map_err(no_log)?).map_err(no_log)?
        } else {
            let mut run = Self::of_stream(&bytes);
            // The beginning of a frame at the end.
            if matches!(run.marks.last(), Some((at, Mark::Garbage { .. })) if *at == run.rows.len())
            {
                run.cut_off(None, None);
            }
            run
        };
        let other = run.marks.iter().find(|(_, mark)| matches!(mark, Mark::Schema { .. }));
        // What came before the first identity may be of any layout.
        if run.rows.is_empty() || run.header.is_none() && other.is_some() {
            let why = other.map_or("it holds no tick".to_owned(), |(_, mark)| mark.to_string());
            return Err(no_log(why));
        }
        Ok(run)
    }
}

/// Longest record, bytes: some hundred times those that this program writes.
const LONGEST_RECORD: usize = 1 << 26;

/// Largest ratio of a chunk's content to its size in the file: the limit of LZ4.
const EXPANSION: u64 = 256;

/// The file up to the first record whose length cannot be true: longer than the rest of the
/// file, or a chunk larger than LZ4 can expand to. The reader would allocate that length. And
/// the bytes that this record lacks.
fn credible(bytes: &[u8]) -> (&[u8], Option<u64>) {
    const CHUNK: u8 = 6;
    // An opcode and a length; in a chunk two times come before the length of its content.
    const HEAD: usize = 9;
    let number = |at: usize| Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let mut at = MCAP.len() + 3;
    while let Some(length) = number(at + 1) {
        let rest = (bytes.len() - at - HEAD) as u64;
        let holds = if bytes[at] == CHUNK { number(at + HEAD + 16).unwrap_or(0) } else { 0 };
        if length > rest || holds > length.saturating_mul(EXPANSION) {
            let lacks = length.saturating_sub(rest);
            return (&bytes[..at], (1..=LONGEST_RECORD as u64).contains(&lacks).then_some(lacks));
        }
        at += HEAD + length as usize;
    }
    (bytes, None)
}

/// The end of an MCAP file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct End {
    /// The footer is there.
    pub(super) is_complete: bool,
    /// Bytes that the last record lacks, if it ends within one.
    pub(super) lacks_bytes: Option<u64>,
}

/// Hands over the records of an MCAP file, those of its chunks one by one, up to the end or to
/// where the file was cut off or damaged.
pub(super) fn records(bytes: &[u8], mut take: impl FnMut(Record<'_>)) -> End {
    let (mut rest, lacks_bytes) = credible(bytes);
    let mut end = End { is_complete: false, lacks_bytes };
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
                Ok(Record::Footer(_)) => end.is_complete = true,
                Ok(record) => take(record),
                Err(_) => return end,
            },
        }
    }
    end
}

/// The rig's parameters, if this is where a file has them.
pub(super) fn parameters(metadata: &Metadata) -> Option<String> {
    metadata.metadata.get("toml").filter(|_| metadata.name == "parameters").cloned()
}

/// The number of ticks, if this is where a file has it.
pub(super) fn stated_ticks(metadata: &Metadata) -> Option<u64> {
    metadata.metadata.get("ticks").filter(|_| metadata.name == "run")?.parse().ok()
}

fn of_mcap(bytes: &[u8]) -> Run {
    let (mut decoder, mut run) = (Decoder::new(), Run::default());
    let (mut frames, mut total) = (None, None);
    let end = records(bytes, |record| match record {
        Record::Channel(channel) if channel.topic == FRAMES => frames = Some(channel.id),
        Record::Message { header, data } if Some(header.channel_id) == frames => {
            decoder.read(unwrapped(&data), &mut |item| run.add(&item));
        }
        Record::Metadata(metadata) => {
            total = total.or(stated_ticks(&metadata));
            run.parameters = run.parameters.take().or(parameters(&metadata));
        }
        _ => {}
    });
    decoder.finish(&mut |item| run.add(&item));
    run.counts = *decoder.counts();
    if !end.is_complete {
        run.cut_off(total, end.lacks_bytes);
    }
    run
}

/// Reads the controller's columns. Ticks that did not run and an incomplete last row are left
/// out.
fn of_csv(bytes: &[u8], metadata: TableMetadata) -> Result<Run, String> {
    let TableMetadata { header, parameters, ticks: total, .. } = metadata;
    let mut run = Run { header, parameters, ..Run::default() };
    // A last row without its line feed may lack digits.
    let ends_within = bytes.last() != Some(&b'\n');
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
    let bytes = &bytes[..whole];
    let mut reader = csv::Reader::from_reader(bytes);
    let head = reader.headers().map_err(|error| error.to_string())?.clone();
    let columns = serde_json::to_value(Columns::default()).unwrap_or_default();
    // A quantity that the table lacks is unknown; what the controller was given must be there.
    let is_quantity = |name: &str| Columns::QUANTITIES.iter().any(|column| column.name == name);
    let lacks = |name: &&String| !is_quantity(name) && !head.iter().any(|found| found == *name);
    if let Some((name, _)) = columns.as_object().into_iter().flatten().find(|(name, _)| lacks(name))
    {
        return Err(format!("it lacks the column {name}"));
    }
    let mut last = None;
    for row in reader.records() {
        let row = row.and_then(|row| row.deserialize::<Columns>(Some(&head)));
        let row = row.map_err(|error| error.to_string())?;
        let behind = last.map_or(0, |last: u32| row.tick.saturating_sub(last.saturating_add(1)));
        run.counts.lost_ticks += u64::from(behind);
        last = Some(row.tick);
        // A tick that did not run.
        if row.mode != OFF {
            run.rows.push(row);
        }
    }
    run.counts.bytes = bytes.len() as u64;
    run.counts.ticks = run.rows.len() as u64;
    if ends_within || total.is_some_and(|total| total > run.counts.ticks) {
        run.cut_off(total, None);
    }
    Ok(run)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    use crate::record::decoder::tests::frames;

    pub(crate) fn read(bytes: &[u8]) -> Result<Run, ReadError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log");
        std::fs::write(&path, bytes).unwrap();
        Run::read(&path)
    }

    #[test]
    fn a_length_that_cannot_be_ends_the_file_there() {
        let record = |opcode: u8, length: u64, body: &[u8]| {
            [&[opcode][..], &length.to_le_bytes(), body].concat()
        };
        let head = [MCAP, b"0\r\n"].concat();
        let good = [head, record(1, 3, b"abc"), record(6, 40, &[0; 40])].concat();
        assert_eq!(credible(&good), (&good[..], None));
        let long = [good.clone(), record(5, 1 << 62, b"xyz")].concat();
        assert_eq!(credible(&long), (&good[..], None));
        let short = [good.clone(), record(5, 10, b"xyz")].concat();
        assert_eq!(credible(&short), (&good[..], Some(7)));
        // A chunk of 24 bytes that claims to hold more than 6 KiB.
        let mut body = [0; 24];
        body[16..].copy_from_slice(&10_000_u64.to_le_bytes());
        let swollen = [good.clone(), record(6, 24, &body)].concat();
        assert_eq!(credible(&swollen), (&good[..], None));
        for cut in 0..good.len() {
            assert!(credible(&good[..cut]).0.len() <= cut);
        }
    }

    #[test]
    fn rows_come_back_from_csv_even_if_it_was_cut() {
        let run = Run::of_stream(&frames(0, 80).concat());
        let mut csv = csv::Writer::from_writer(Vec::new());
        for row in &run.rows {
            csv.serialize(row).unwrap();
        }
        let bytes = csv.into_inner().unwrap();
        let intact = read(&bytes).unwrap();
        assert_eq!((intact.rows, intact.cut), (run.rows.clone(), None));
        for lacks in [1, 40] {
            let short = read(&bytes[..bytes.len() - lacks]).unwrap();
            assert_eq!(short.rows, run.rows[..79], "without its last {lacks} bytes");
            let cut = short.cut.expect("it is noticed");
            assert_eq!((cut.at_s, cut.missing_ticks), (run.rows[78].t_s, None));
        }
    }

    #[test]
    fn what_is_no_log_is_refused_in_one_line() {
        for bytes in [&b""[..], b"hello", b"\x89MCAP0\r\n", &[7; 900]] {
            let error = read(bytes).unwrap_err().to_string();
            assert!(error.contains("no log") && error.lines().count() == 1, "{error}");
        }
        let table = b"tick,t_s,mode,preload_sensor_code\n1,0.001,0,7\n";
        let error = read(table).unwrap_err().to_string();
        assert!(error.contains("it lacks the column arm_angle_at"), "{error}");
        let missing = Run::read(Path::new("/nowhere/log.mcap")).unwrap_err();
        assert!(matches!(missing, ReadError::File(..)));
    }
}
