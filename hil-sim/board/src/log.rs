//! The board's log, decoded by defmt's own decoder.

use defmt_decoder::{DecodeError, StreamDecoder, Table};

use super::error::ImageError;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Level, in lower case; empty for plain output.
    pub level: String,
    pub text: String,
}

impl Line {
    /// The message after `mark`.
    pub fn after(&self, mark: &str) -> Option<&str> {
        self.text.split_once(mark).map(|(_, rest)| rest)
    }
}

pub struct Strings(Table);

impl Strings {
    /// Reads the strings of an image.
    pub fn of(elf: &[u8]) -> Result<Self, ImageError> {
        let table = Table::parse(elf).map_err(|error| ImageError::Form(format!("{error:#}")))?;
        table.map(Self).ok_or_else(|| ImageError::Form("it logs nothing".to_owned()))
    }

    /// A reader at the beginning of a log.
    pub fn reader(&self) -> Reader<'_> {
        Reader { decoder: self.0.new_stream_decoder() }
    }
}

/// Reads a log as it comes.
pub struct Reader<'a> {
    decoder: Box<dyn StreamDecoder + Send + Sync + 'a>,
}

impl Reader<'_> {
    /// The lines that are complete with these bytes.
    pub fn read(&mut self, bytes: &[u8]) -> Vec<Line> {
        let mut lines = Vec::new();
        if bytes.is_empty() {
            return lines;
        }
        self.decoder.received(bytes);
        loop {
            match self.decoder.decode() {
                Ok(frame) => lines.push(Line {
                    level: frame.level().map_or("", |level| level.as_str()).to_owned(),
                    text: frame.display_message().to_string(),
                }),
                Err(DecodeError::UnexpectedEof) => return lines,
                // A reset truncates the last frame.
                Err(DecodeError::Malformed) => {}
            }
        }
    }
}
