//! The course of an isolated crossing: speed and preload over the axle's place.

use std::path::Path;

use serde::Deserialize;

/// Largest speed, mm/s, and preload, N, of a course.
pub const MAX_SPEED_MM_S: f64 = 2000.0;
/// See [`MAX_SPEED_MM_S`].
pub const MAX_PRELOAD_N: f64 = 1000.0;

/// One line of a course.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Knot {
    /// Place of the axle from the face outwards, mm.
    pub x_mm: f64,
    /// Axial speed there, mm/s.
    pub speed_mm_s: f64,
    /// Radial force there, N.
    pub preload_n: f64,
}

/// Knots in the order in which the wheel comes to them: straight lines between them, the first one
/// before it, the last one behind it.
#[derive(Clone, Debug, PartialEq)]
pub struct Course(Vec<Knot>);

impl Course {
    /// Reads a CSV file with the columns of [`Knot`].
    ///
    /// # Errors
    /// One sentence that names the file, the line and what was expected.
    pub fn read(path: &Path, retracts: bool) -> Result<Self, String> {
        let at = |what: &dyn std::fmt::Display| format!("{}: {what}", path.display());
        let mut table = csv::Reader::from_path(path).map_err(|error| at(&error))?;
        let knots = table.deserialize().collect::<Result<_, _>>().map_err(|error| at(&error))?;
        Self::try_new(knots, retracts).map_err(|error| at(&error))
    }

    /// The course through these knots.
    ///
    /// # Errors
    /// One sentence that names the knot and what was expected.
    pub fn try_new(knots: Vec<Knot>, retracts: bool) -> Result<Self, String> {
        if knots.is_empty() {
            return Err("expected at least one row of x_mm, speed_mm_s, preload_n".to_owned());
        }
        for (index, knot) in knots.iter().enumerate() {
            for (name, value, most) in [
                ("speed_mm_s", knot.speed_mm_s, MAX_SPEED_MM_S),
                ("preload_n", knot.preload_n, MAX_PRELOAD_N),
            ] {
                // A NaN fails too.
                if !(value > 0.0 && value <= most) {
                    return Err(format!(
                        "row {}: {name} {value}: expected a value above 0, at most {most}",
                        index + 1
                    ));
                }
            }
            let before = index.checked_sub(1).map(|before| knots[before].x_mm);
            let onwards =
                before.is_none_or(|x| if retracts { knot.x_mm < x } else { knot.x_mm > x });
            if !(knot.x_mm.is_finite() && onwards) {
                let order = if retracts { "falls" } else { "rises" };
                return Err(format!(
                    "row {}: x_mm {}: expected a place that {order} from row to row",
                    index + 1,
                    knot.x_mm
                ));
            }
        }
        Ok(Self(knots))
    }

    /// Speed, mm/s, and preload, N, with which it begins.
    pub fn start(&self) -> (f64, f64) {
        (self.0[0].speed_mm_s, self.0[0].preload_n)
    }

    /// Speed, mm/s, and preload, N, at a place, mm.
    pub fn at(&self, x_mm: f64) -> (f64, f64) {
        let value = |knot: &Knot| (knot.speed_mm_s, knot.preload_n);
        let is_between = |pair: &&[Knot]| {
            let (a, b) = (pair[0].x_mm, pair[1].x_mm);
            (a.min(b)..a.max(b)).contains(&x_mm)
        };
        let Some([a, b]) = self.0.windows(2).find(is_between) else {
            let (first, last) = (&self.0[0], &self.0[self.0.len() - 1]);
            let is_before = (x_mm - first.x_mm).abs() < (x_mm - last.x_mm).abs();
            return value(if is_before { first } else { last });
        };
        let part = (x_mm - a.x_mm) / (b.x_mm - a.x_mm);
        let mix = |a: f64, b: f64| a + part * (b - a);
        (mix(a.speed_mm_s, b.speed_mm_s), mix(a.preload_n, b.preload_n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(knots: &[(f64, f64, f64)], retracts: bool) -> Result<Course, String> {
        let knot = |&(x_mm, speed_mm_s, preload_n): &_| Knot { x_mm, speed_mm_s, preload_n };
        Course::try_new(knots.iter().map(knot).collect(), retracts)
    }

    #[test]
    fn between_knots_it_is_straight_and_beyond_them_held() {
        let out = course(&[(-14.0, 20.0, 30.0), (-12.0, 10.0, 40.0)], false).unwrap();
        for (x, expected) in [(-50.0, (20.0, 30.0)), (-13.0, (15.0, 35.0)), (5.0, (10.0, 40.0))] {
            assert_eq!(out.at(x), expected, "{x}");
        }
        let back = course(&[(4.0, 20.0, 30.0), (-12.0, 4.0, 46.0)], true).unwrap();
        for (x, expected) in [(9.0, (20.0, 30.0)), (-4.0, (12.0, 38.0)), (-20.0, (4.0, 46.0))] {
            assert_eq!(back.at(x), expected, "{x}");
        }
    }

    #[test]
    fn a_course_that_no_wheel_can_drive_is_refused_by_its_row() {
        let error = |knots: &[(f64, f64, f64)]| course(knots, false).unwrap_err();
        assert!(error(&[]).contains("at least one row"));
        assert!(error(&[(0.0, 0.0, 30.0)]).starts_with("row 1: speed_mm_s 0"));
        assert!(error(&[(0.0, 1.0, f64::NAN)]).starts_with("row 1: preload_n NaN"));
        let twice = error(&[(0.0, 1.0, 30.0), (0.0, 1.0, 30.0)]);
        assert!(twice.starts_with("row 2: x_mm 0: expected a place that rises"), "{twice}");
        assert!(course(&[(0.0, 1.0, 30.0), (1.0, 1.0, 30.0)], true).is_err());
    }
}
