//! The finite-element reference (`fe/results.json`) as a column of the page: a rubber continuum
//! 8 mm thick, pushed over a frictionless step of 4 mm, with memory.
//!
//! Independent of the ring but for its shear modulus, which is calibrated to the ring's static
//! gap at 100 N.

use serde_json::Value;

/// Thickness of the tread in the column, mm; it is not published.
const THICKNESS_MM: f64 = 8.0;

/// What the reference has of a crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    pub(super) gap_mm: f64,
    /// Largest axial force until the lower wall is released, N.
    pub(super) collision_n: f64,
}

fn rows() -> Vec<Value> {
    let text = include_str!("../../fe/results.json");
    let Ok(Value::Object(mut results)) = serde_json::from_str(text) else { return Vec::new() };
    let Some(Value::Object(moving)) = results.remove("moving") else { return Vec::new() };
    // Rows of other meshes and laws have longer names.
    moving.into_iter().filter(|(name, _)| name.ends_with("/coarse")).map(|(_, row)| row).collect()
}

fn of(speed_mm_s: f64, preload_n: f64, wanted: impl Fn(f64) -> bool) -> Vec<Crossing> {
    let number = |row: &Value, name: &str| row[name].as_f64().unwrap_or(f64::NAN);
    let at = |row: &&Value| {
        number(row, "speed_mm_s") == speed_mm_s
            && number(row, "preload_n") == preload_n
            && wanted(number(row, "thickness"))
    };
    let crossing = |row: &Value| Crossing {
        gap_mm: number(row, "gap_mm"),
        collision_n: number(row, "largest_thrust_before_release_n"),
    };
    rows().iter().filter(at).map(crossing).collect()
}

/// The crossing at this speed, mm/s, and preload, N, if the reference has it.
pub(super) fn crossing(speed_mm_s: f64, preload_n: f64) -> Option<Crossing> {
    of(speed_mm_s, preload_n, |thickness| thickness == THICKNESS_MM).first().copied()
}

/// Least and largest gap there over treads of 5, 8 and 12 mm, mm.
pub(super) fn gap_range_mm(speed_mm_s: f64, preload_n: f64) -> (f64, f64) {
    let gaps = of(speed_mm_s, preload_n, |_| true).into_iter().map(|crossing| crossing.gap_mm);
    gaps.fold((f64::INFINITY, 0.0), |(low, high), gap| (low.min(gap), high.max(gap)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_has_two_of_the_three_cases() {
        let gap = crossing(5.0, 100.0).unwrap().gap_mm;
        assert!((1.6..1.7).contains(&gap), "{gap}");
        assert!(crossing(8.0, 100.0).unwrap().gap_mm > gap);
        assert_eq!(crossing(5.0, 120.0), None);
        let (low, high) = gap_range_mm(5.0, 100.0);
        assert!(low < gap && gap < high, "{low} {high}");
    }
}
