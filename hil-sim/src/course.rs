//! A course over a step: speed and preload by the axle's position.

use std::path::Path;

use serde::Deserialize;

/// Fastest crossing, mm/s.
pub const MAX_SPEED_MM_S: f64 = 2000.0;
/// Largest preload, N.
pub const MAX_PRELOAD_N: f64 = 1000.0;

/// Columns of a file.
const COLUMNS: [&str; 3] = ["x_mm", "speed_mm_s", "preload_n"];

/// Speed and preload at a position.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Row {
    /// Position of the axle from the step's face, outwards, mm.
    pub x_mm: f64,
    /// Axial speed, mm/s.
    pub speed_mm_s: f64,
    /// Radial preload, N.
    pub preload_n: f64,
}

/// Rows in the order of their positions. The first holds before it, the last after it; between two
/// rows speed and preload are linear in the position.
#[derive(Clone, Debug, PartialEq)]
pub struct Course(Vec<Row>);

/// What is wrong with a course.
#[derive(Debug, thiserror::Error)]
pub enum CourseError {
    /// The file cannot be read.
    #[error("{0}")]
    File(#[from] csv::Error),
    /// A column is missing.
    #[error("column {0} is missing: expected the columns x_mm, speed_mm_s, preload_n")]
    Column(&'static str),
    /// A value is wrong.
    #[error("row {row}, column {column}: {value}: expected {expected}")]
    Value {
        /// Row below the heading, from 1.
        row: usize,
        /// Column.
        column: &'static str,
        /// The value as it is there.
        value: String,
        /// What may be there.
        expected: String,
    },
    /// There is no row.
    #[error("no row: expected at least one below the heading")]
    Empty,
}

impl Course {
    /// The same speed, mm/s, and preload, N, everywhere.
    #[must_use]
    pub fn constant(speed_mm_s: f64, preload_n: f64) -> Self {
        Self(vec![Row { x_mm: 0.0, speed_mm_s, preload_n }])
    }

    /// A course of these rows.
    ///
    /// # Errors
    /// [`CourseError`] if there is none, one is out of range, or they are out of order.
    pub fn try_new(rows: Vec<Row>) -> Result<Self, CourseError> {
        let mut before = f64::NEG_INFINITY;
        for (index, row) in rows.iter().enumerate() {
            let wrong = |column, value: f64, expected: String| CourseError::Value {
                row: index + 1,
                column,
                value: value.to_string(),
                expected,
            };
            if !(row.x_mm > before && row.x_mm.is_finite()) {
                let expected = format!("a position after that of the row before, {before}");
                return Err(wrong(COLUMNS[0], row.x_mm, expected));
            }
            before = row.x_mm;
            for (column, value, max, unit) in [
                (COLUMNS[1], row.speed_mm_s, MAX_SPEED_MM_S, "mm/s"),
                (COLUMNS[2], row.preload_n, MAX_PRELOAD_N, "N"),
            ] {
                // A NaN fails too.
                if !(value > 0.0 && value <= max) {
                    let expected = format!("a value above 0, at most {max} {unit}");
                    return Err(wrong(column, value, expected));
                }
            }
        }
        if rows.is_empty() { Err(CourseError::Empty) } else { Ok(Self(rows)) }
    }

    /// The course of a CSV file with the columns `x_mm`, `speed_mm_s`, `preload_n`.
    ///
    /// # Errors
    /// [`CourseError`] that names row, column and what is expected.
    pub fn read(path: &Path) -> Result<Self, CourseError> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path)?;
        let heading = reader.headers()?.clone();
        let mut places = [0; 3];
        for (place, column) in places.iter_mut().zip(COLUMNS) {
            let found = heading.iter().position(|name| name == column);
            *place = found.ok_or(CourseError::Column(column))?;
        }
        let mut rows = Vec::new();
        for (index, record) in reader.records().enumerate() {
            let record = record?;
            let number = |which: usize| {
                let text = record.get(places[which]).unwrap_or_default();
                text.parse::<f64>().map_err(|_| CourseError::Value {
                    row: index + 1,
                    column: COLUMNS[which],
                    value: format!("`{text}`"),
                    expected: "a number".to_owned(),
                })
            };
            let [x_mm, speed_mm_s, preload_n] = [number(0)?, number(1)?, number(2)?];
            rows.push(Row { x_mm, speed_mm_s, preload_n });
        }
        Self::try_new(rows)
    }

    /// Speed, mm/s, and preload, N, at this position.
    #[must_use]
    pub fn at(&self, x_mm: f64) -> (f64, f64) {
        let next = self.0.partition_point(|row| row.x_mm <= x_mm);
        let last = self.0.len() - 1;
        let (before, after) = (self.0[next.saturating_sub(1)], self.0[next.min(last)]);
        let length = after.x_mm - before.x_mm;
        let part = if length > 0.0 { (x_mm - before.x_mm) / length } else { 0.0 };
        let mix = |from: f64, to: f64| from + part * (to - from);
        (mix(before.speed_mm_s, after.speed_mm_s), mix(before.preload_n, after.preload_n))
    }

    /// The rows.
    #[must_use]
    pub fn rows(&self) -> &[Row] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(x_mm: f64, speed_mm_s: f64, preload_n: f64) -> Row {
        Row { x_mm, speed_mm_s, preload_n }
    }

    #[test]
    fn it_holds_at_the_ends_and_is_linear_between() {
        let course = Course::try_new(vec![row(-10.0, 30.0, 33.0), row(-5.0, 10.0, 48.0)]).unwrap();
        assert_eq!(course.at(f64::NEG_INFINITY), (30.0, 33.0));
        assert_eq!(course.at(-10.0), (30.0, 33.0));
        assert_eq!(course.at(-7.5), (20.0, 40.5));
        assert_eq!(course.at(-5.0), (10.0, 48.0));
        assert_eq!(course.at(f64::INFINITY), (10.0, 48.0));
        assert_eq!(Course::constant(5.0, 40.0).at(3.0), (5.0, 40.0));
    }

    #[test]
    fn a_bad_file_is_named_by_row_column_and_what_is_expected() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("course.csv");
        let good = "x_mm,speed_mm_s,preload_n\n-10,30,33\n-5,10,48\n";
        for (text, error) in [
            (
                "x_mm,speed_mm_s\n-10,30\n",
                "column preload_n is missing: expected the columns x_mm, speed_mm_s, preload_n",
            ),
            ("x_mm,speed_mm_s,preload_n\n", "no row: expected at least one below the heading"),
            (&good.replace("30", "fast"), "row 1, column speed_mm_s: `fast`: expected a number"),
            (
                &good.replace("48", "-48"),
                "row 2, column preload_n: -48: expected a value above 0, at most 1000 N",
            ),
            (
                &good.replace("-5", "-15"),
                "row 2, column x_mm: -15: expected a position after that of the row before, -10",
            ),
            (
                &good.replace("30", "NaN"),
                "row 1, column speed_mm_s: NaN: expected a value above 0, at most 2000 mm/s",
            ),
        ] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(Course::read(&path).unwrap_err().to_string(), error);
        }
        std::fs::write(&path, "preload_n, x_mm, speed_mm_s\n33,-10,30\n48,-5,10\n").unwrap();
        let course = Course::read(&path).unwrap();
        assert_eq!(course.rows(), [row(-10.0, 30.0, 33.0), row(-5.0, 10.0, 48.0)]);
    }
}
