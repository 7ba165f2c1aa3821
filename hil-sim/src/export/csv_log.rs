//! `log.csv`: one row a tick, the header holds the names of the fields.

use std::path::Path;

use super::{ExportError, whole};
use crate::record::Recording;

/// Writes the rows of `recording` to `path`. Numbers are written so that reading
/// them gives the same bits; a quantity that does not exist is `NaN`.
///
/// # Errors
/// [`ExportError::File`] with the reason.
pub fn write_csv(recording: &Recording, path: &Path) -> Result<(), ExportError> {
    whole::write(path, |out| {
        let mut csv = csv::Writer::from_writer(out);
        for row in &recording.rows {
            csv.serialize(row)?;
        }
        Ok(csv.flush()?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Row;
    use crate::report::example;

    #[test]
    fn rows_are_read_back_bit_by_bit() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log.csv");
        let recording = example::deploy();
        write_csv(&recording, &path).unwrap();
        let mut reader = csv::Reader::from_path(&path).unwrap();
        let header = reader.headers().unwrap().clone();
        assert_eq!(&header[0], "t_s");
        assert_eq!(header.len(), 27);
        let rows: Vec<Row> = reader.deserialize().map(Result::unwrap).collect();
        assert_eq!(rows.len(), recording.rows.len());
        for (read, written) in rows.iter().zip(&recording.rows) {
            // A NaN differs from itself; its text does not.
            assert_eq!(format!("{read:?}"), format!("{written:?}"));
        }
    }
}
