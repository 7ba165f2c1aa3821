//! Rows of a table, and the metadata beside it: `log.csv-metadata.json`, in the form of the W3C's "CSV on the
//! Web". It describes the columns, and has what a table has no place for: the firmware, the
//! rig's parameters and the number of ticks.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{Header, MODE_NAMES, Row, STAGE_NAMES};
use crate::files::{FileError, write_text};

/// What a table has no place for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Metadata {
    /// Firmware and hashes of its parameters.
    pub header: Option<Header>,
    /// The rig's parameters as TOML.
    pub parameters: Option<String>,
    /// Ticks that ran, once the log is complete.
    pub ticks: Option<u64>,
    /// The ledger of the crossings, once the log is complete; null in a log of several starts.
    #[serde(default)]
    pub crossings: Value,
}

/// Adds a row. Reading gives the same bits; what is unknown is `NaN`. Without truth its
/// columns are absent.
pub(super) fn write_row<W: Write>(csv: &mut csv::Writer<W>, tick: &Row) -> csv::Result<()> {
    match tick.truth {
        Some(truth) => csv.serialize((tick.controller, truth)),
        None => csv.serialize(tick.controller),
    }
}

/// Path of the metadata of the table at `csv`.
fn beside(csv: &Path) -> PathBuf {
    let mut name = csv.as_os_str().to_owned();
    name.push("-metadata.json");
    PathBuf::from(name)
}

/// The metadata beside the table at `csv`; nothing if there are none.
pub(super) fn metadata_of(csv: &Path) -> Result<Metadata, String> {
    let path = beside(csv);
    let Ok(text) = std::fs::read_to_string(&path) else { return Ok(Metadata::default()) };
    let bad = |error: serde_json::Error| format!("{}: {error}", path.display());
    let mut described: Value = serde_json::from_str(&text).map_err(bad)?;
    Metadata::deserialize(described["notes"][0].take()).map_err(bad)
}

/// Writes the metadata of the table at `csv`, with the plant's columns where it has the truth,
/// and returns their path.
pub(crate) fn write_metadata(
    csv: &Path,
    metadata: &Metadata,
    with_truth: bool,
) -> Result<PathBuf, FileError> {
    let path = beside(csv);
    let described = json!({
        "@context": "http://www.w3.org/ns/csvw",
        "url": csv.file_name().map(|name| name.to_string_lossy()),
        "tableSchema": { "columns": columns(with_truth), "primaryKey": "tick" },
        "notes": [metadata],
    });
    write_text(&path, &format!("{described:#}\n"))?;
    Ok(path)
}

/// The columns in their order, as a CSV writer derives it.
fn columns(with_truth: bool) -> Vec<Value> {
    let example = Row::example(with_truth);
    let mut table = csv::Writer::from_writer(Vec::new());
    // Numbers and texts always have a form.
    let written = write_row(&mut table, &example).ok().and_then(|()| table.into_inner().ok());
    let text = String::from_utf8(written.unwrap_or_default()).unwrap_or_default();
    let examples = json!(example);
    let one = |name: &str| match name {
        "mode" => json!({ "name": name, "datatype": words(&MODE_NAMES) }),
        "stage" => json!({ "name": name, "datatype": words(&STAGE_NAMES) }),
        _ => {
            // A code or its time is absent in the example.
            let whole = examples[name].is_null() || examples[name].is_u64();
            json!({ "name": name, "datatype": if whole { "integer" } else { "number" } })
        }
    };
    text.lines().next().unwrap_or_default().split(',').map(one).collect()
}

/// A column that takes these words.
fn words(names: &[&str]) -> Value {
    json!({ "base": "string", "format": names.join("|") })
}

#[cfg(test)]
mod tests {
    use documented::DocumentedFields as _;

    use super::*;
    use crate::record::write::write_csv;
    use crate::record::{Columns, TrueState};
    use crate::report::example;

    #[test]
    fn every_column_of_the_table_is_described_in_order() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log.csv");
        write_csv(&example::deploy(), &path).unwrap();
        let mut table = csv::Reader::from_path(&path).unwrap();
        let head: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
        let columns = columns(true);
        let names: Vec<&str> = columns.iter().filter_map(|one| one["name"].as_str()).collect();
        assert_eq!(names, head);
        for row in table.records().map(Result::unwrap) {
            for (cell, column) in row.iter().zip(&columns) {
                let fits = match column["datatype"].as_str() {
                    Some("integer") => cell.is_empty() || cell.parse::<u64>().is_ok(),
                    Some(_) => cell.is_empty() || cell.parse::<f64>().is_ok(),
                    None => column["datatype"]["format"].as_str().unwrap().contains(cell),
                };
                assert!(fits, "{cell} in {column}");
            }
        }
    }

    #[test]
    fn the_page_lists_the_columns_of_controller_and_truth() {
        let row = |column: &Value| {
            let name = column["name"].as_str().unwrap();
            let text = Columns::get_field_docs(name).or_else(|_| TrueState::get_field_docs(name));
            format!("| `{name}` | {} |\n", text.unwrap().replace('\n', " "))
        };
        let all: Vec<String> = columns(true).iter().map(row).collect();
        let (controller, truth) = all.split_at(columns(false).len());
        for table in [controller.concat(), truth.concat()] {
            let page = include_str!("../../../docs/LOGGING.md");
            assert!(page.contains(&table), "docs/LOGGING.md lacks\n{table}");
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let directory = tempfile::tempdir().unwrap();
        let csv = directory.path().join("log.csv");
        assert_eq!(metadata_of(&csv), Ok(Metadata::default()));
        let parameters = Some("[run]\nseed = 1\n".to_owned());
        let header = Some(Header { rig: "fe".to_owned(), ..Header::default() });
        let crossings = json!([]);
        let metadata = Metadata { header, parameters, ticks: Some(7), crossings };
        let path = write_metadata(&csv, &metadata, false).unwrap();
        assert_eq!(metadata_of(&csv), Ok(metadata));
        std::fs::write(&path, "{").unwrap();
        assert!(metadata_of(&csv).unwrap_err().contains("log.csv-metadata.json"));
    }
}
