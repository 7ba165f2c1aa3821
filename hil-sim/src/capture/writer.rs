//! MCAP and CSV files that grow with the log.
//!
//! Once a second of the log's time all that has come is handed to the system, as whole
//! chunks, so that a file which is cut off there, by a full disk or a lost supply, is
//! read up to its last second.

use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};

use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};

use super::message::messages;
use crate::live::Topic;
use crate::log::{Decoder, FRAMES, Header, Item, Mark, Row, Tally, pieces};
use interstage::log::frame::LONGEST;

/// Nanoseconds of a tick.
const TICK_NS: u64 = 1_000_000;
/// Ticks between two hand-overs to the system.
const FLUSH_TICKS: u64 = 1000;

/// Why writing came to an end. What had been handed over before stays readable.
#[derive(Debug, thiserror::Error)]
#[error("writing stopped after {ticks} ticks, of which {kept} are safe: {}", chain(&**source))]
pub struct WriteError {
    /// Ticks that had come.
    pub ticks: u64,
    /// Ticks that the files hold for certain.
    pub kept: u64,
    /// What the system said.
    source: Box<dyn std::error::Error + Send + Sync>,
}

/// An error and what is behind it: the system's word stands last.
fn chain(error: &(dyn std::error::Error + 'static)) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    let mut texts: Vec<String> = causes.map(ToString::to_string).collect();
    texts.dedup();
    texts.join(": ")
}

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Writes a log to an MCAP file and a CSV file, of which each may be left out.
pub struct Writer<M: Write + Seek, C: Write> {
    mcap: Option<Messages<M>>,
    csv: Option<csv::Writer<C>>,
    decoder: Decoder,
    partial: Vec<u8>,
    /// Ticks handed over to the system.
    kept: u64,
}

impl<M: Write + Seek, C: Write> Writer<M, C> {
    /// Begins the files. `parameters` are those of the controller as TOML, if they are
    /// known; `decoded` says whether rows go into the MCAP file beside the frames.
    ///
    /// # Errors
    /// [`WriteError`] with the reason.
    pub fn new(
        mcap: Option<M>,
        csv: Option<C>,
        parameters: Option<&str>,
        decoded: bool,
    ) -> Result<Self, WriteError> {
        let fail = |source: Failure| WriteError { ticks: 0, kept: 0, source };
        let mcap = mcap.map(|out| Messages::new(out, parameters, decoded));
        Ok(Self {
            mcap: mcap.transpose().map_err(fail)?,
            csv: csv.map(csv::Writer::from_writer),
            decoder: Decoder::new(),
            partial: Vec::new(),
            kept: 0,
        })
    }

    /// What has come so far.
    pub const fn tally(&self) -> &Tally {
        self.decoder.tally()
    }

    /// Takes bytes as they come; each item is shown to `see`.
    ///
    /// # Errors
    /// [`WriteError`] if a file cannot grow any more.
    pub fn take(&mut self, bytes: &[u8], see: &mut impl FnMut(&Item)) -> Result<(), WriteError> {
        let mut held = std::mem::take(&mut self.partial);
        held.extend_from_slice(bytes);
        let mut used = 0;
        for frame in pieces(&held) {
            used += frame.len();
            self.frame(frame, see).map_err(|source| self.failed(source))?;
        }
        // Of what is no frame, only the end may become one.
        let strange = (held.len() - used).saturating_sub(LONGEST);
        if strange > LONGEST {
            let strange = &held[used..used + strange];
            used += strange.len();
            self.frame(strange, see).map_err(|source| self.failed(source))?;
        }
        held.drain(..used);
        self.partial = held;
        if self.decoder.tally().ticks >= self.kept + FLUSH_TICKS {
            self.flush().map_err(|source| self.failed(source))?;
        }
        Ok(())
    }

    fn failed(&self, source: Failure) -> WriteError {
        WriteError { ticks: self.decoder.tally().ticks, kept: self.kept, source }
    }

    fn frame(&mut self, frame: &[u8], see: &mut impl FnMut(&Item)) -> Result<(), Failure> {
        let mut items = Vec::new();
        self.decoder.read(frame, &mut |item| items.push(item));
        self.items(&items, see)?;
        if let Some(mcap) = &mut self.mcap {
            mcap.frame(frame)?;
        }
        Ok(())
    }

    fn items(&mut self, items: &[Item], see: &mut impl FnMut(&Item)) -> Result<(), Failure> {
        for item in items {
            see(item);
            if let Some(mcap) = &mut self.mcap {
                mcap.item(item)?;
            }
            if let (Some(csv), Item::Tick(record, sensors)) = (&mut self.csv, item) {
                csv.serialize(Row::of(record, sensors))?;
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Failure> {
        if let Some(mcap) = &mut self.mcap {
            mcap.out.flush()?;
        }
        if let Some(csv) = &mut self.csv {
            csv.flush()?;
        }
        self.kept = self.decoder.tally().ticks;
        Ok(())
    }

    /// Closes the files; what came.
    ///
    /// # Errors
    /// [`WriteError`] if a file cannot be closed.
    pub fn finish(mut self, see: &mut impl FnMut(&Item)) -> Result<Tally, WriteError> {
        let mut items = Vec::new();
        self.decoder.finish(&mut |item| items.push(item));
        let closed = self.items(&items, see).and_then(|()| self.flush()).and_then(|()| {
            if let Some(mcap) = &mut self.mcap {
                mcap.out.finish()?;
            }
            Ok(())
        });
        closed.map_err(|source| self.failed(source))?;
        Ok(*self.decoder.tally())
    }
}

/// The messages of the MCAP file.
struct Messages<M: Write + Seek> {
    out: mcap::Writer<M>,
    counts: BTreeMap<u16, u32>,
    frames: u16,
    /// Channels of what is written beside the frames.
    channels: HashMap<Topic, u16>,
    header: Option<Header>,
    /// Time of the latest message, ns; it never goes back.
    now: u64,
    /// Time at which the target started, ns.
    start: u64,
}

impl<M: Write + Seek> Messages<M> {
    fn new(out: M, parameters: Option<&str>, decoded: bool) -> Result<Self, Failure> {
        let options = WriteOptions::new()
            .compression(Some(mcap::Compression::Lz4))
            .library(concat!("interstage ", env!("CARGO_PKG_VERSION")));
        let mut out = options.create(out)?;
        if let Some(toml) = parameters {
            out.write_metadata(&Metadata {
                name: "parameters".to_owned(),
                metadata: BTreeMap::from([("toml".to_owned(), toml.to_owned())]),
            })?;
        }
        let none = BTreeMap::new();
        let frames = out.add_channel(0, FRAMES, "interstage-frames", &none)?;
        let mut channels = HashMap::new();
        for topic in Topic::ALL {
            if topic == Topic::Controller && !decoded {
                continue;
            }
            let schema = topic.schema();
            let name = schema["title"].as_str().unwrap_or(topic.name());
            let schema = out.add_schema(name, "jsonschema", &serde_json::to_vec(&schema)?)?;
            channels.insert(topic, out.add_channel(schema, topic.name(), "json", &none)?);
        }
        let (counts, header) = (BTreeMap::new(), None);
        Ok(Self { out, counts, frames, channels, header, now: 0, start: 0 })
    }

    fn message(&mut self, channel_id: u16, body: &[u8]) -> Result<(), Failure> {
        let sequence = self.counts.entry(channel_id).or_default();
        let (log_time, publish_time) = (self.now, self.now);
        let header = MessageHeader { channel_id, sequence: *sequence, log_time, publish_time };
        *sequence = sequence.wrapping_add(1);
        Ok(self.out.write_to_known_channel(&header, body)?)
    }

    fn frame(&mut self, frame: &[u8]) -> Result<(), Failure> {
        self.message(self.frames, frame)
    }

    fn item(&mut self, item: &Item) -> Result<(), Failure> {
        match item {
            Item::Tick(record, _) => {
                self.now = self.now.max(self.start + u64::from(record.at()) * TICK_NS);
            }
            Item::Mark(Mark::Restart) => self.start = self.now,
            Item::Identity(identity) => {
                let header = Header::from(identity);
                if self.header.as_ref() != Some(&header) {
                    self.out.write_metadata(&of_header(&header)?)?;
                    self.header = Some(header);
                }
            }
            _ => {}
        }
        let Some((topic, body)) = messages(item) else { return Ok(()) };
        match self.channels.get(&topic).copied() {
            Some(channel) => self.message(channel, &body),
            None => Ok(()),
        }
    }
}

fn of_header(header: &Header) -> Result<Metadata, Failure> {
    let value = serde_json::to_value(header)?;
    let pairs = value.as_object().into_iter().flatten().map(|(key, value)| {
        (key.clone(), value.as_str().map_or_else(|| value.to_string(), str::to_owned))
    });
    Ok(Metadata { name: "identity".to_owned(), metadata: pairs.collect() })
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Error, ErrorKind, SeekFrom};
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::log::Run;
    use crate::scenario::Scenario;
    use crate::sil;

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

    fn stream() -> Vec<u8> {
        let options = sil::Options { rows: true, ..sil::Options::default() };
        sil::run(&Scenario::default(), options).unwrap().stream
    }

    fn read(bytes: &[u8]) -> Run {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log");
        std::fs::write(&path, bytes).unwrap();
        Run::read(&path).unwrap()
    }

    /// Writes the stream in pieces to disks of these sizes.
    fn write(stream: &[u8], disks: (&Disk, &Disk)) -> Result<Tally, WriteError> {
        let (mcap, csv) = (Some(disks.0.clone()), Some(disks.1.clone()));
        let mut writer = Writer::new(mcap, csv, Some("[run]\nseed = 0\n"), true)?;
        for part in stream.chunks(777) {
            writer.take(part, &mut |_| {})?;
        }
        writer.finish(&mut |_| {})
    }

    #[test]
    fn both_files_give_back_what_came() {
        let (stream, disks) = (stream(), (Disk::of(u64::MAX), Disk::of(u64::MAX)));
        let tally = write(&stream, (&disks.0, &disks.1)).unwrap();
        let (whole, mcap, csv) =
            (Run::of_stream(&stream), read(&disks.0.content()), read(&disks.1.content()));
        assert_eq!(tally, whole.tally);
        assert_eq!(csv.rows, whole.rows);
        assert_eq!(mcap.parameters.as_deref(), Some("[run]\nseed = 0\n"));
        assert_eq!(Run { parameters: None, ..mcap }, whole);
    }

    #[test]
    fn a_full_disk_is_told_and_what_was_written_stays_readable() {
        let stream = stream();
        for (mcap, csv) in [(400_000, u64::MAX), (u64::MAX, 500_000)] {
            let disks = (Disk::of(mcap), Disk::of(csv));
            let error = write(&stream, (&disks.0, &disks.1)).unwrap_err();
            let text = error.to_string();
            assert!(text.contains("no storage space") && text.lines().count() == 1, "{text}");
            assert!(error.kept >= 1000 && error.kept <= error.ticks, "{error}");
            for disk in [&disks.0, &disks.1] {
                let run = read(&disk.content());
                assert!(run.rows.len() as u64 >= error.kept, "{} rows", run.rows.len());
                assert!(run.rows.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1));
            }
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_read_up_to_there() {
        let (stream, disks) = (stream(), (Disk::of(u64::MAX), Disk::of(u64::MAX)));
        write(&stream, (&disks.0, &disks.1)).unwrap();
        let whole = disks.0.content();
        let mut before = 0;
        for tenth in 4..10 {
            let rows = read(&whole[..whole.len() * tenth / 10]).rows.len();
            assert!(rows >= before && rows > 500, "{rows} rows of {tenth} tenths");
            before = rows;
        }
        assert!(before >= 3000, "{before}");
    }

    #[test]
    fn time_in_the_file_never_goes_back_even_if_the_target_starts_anew() {
        let disks = (Disk::of(u64::MAX), Disk::of(u64::MAX));
        let twice = [stream(), stream()].concat();
        let tally = write(&twice, (&disks.0, &disks.1)).unwrap();
        assert_eq!(tally.restarts, 1);
        let content = disks.0.content();
        let mut last = 0;
        for message in mcap::MessageStream::new(&content).unwrap() {
            let message = message.unwrap();
            assert!(message.log_time >= last, "{}", message.channel.topic);
            last = message.log_time;
        }
    }
}
