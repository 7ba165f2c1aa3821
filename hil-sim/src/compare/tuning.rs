//! Brings the worst gap of a strategy to the reference.

use super::Entry;
use crate::session::RunError;

/// Reserves below the reference gap that are tried first, ascending.
const LADDER: [f64; 5] = [0.0, 0.03, 0.06, 0.12, 0.25];
/// How close to the reference the worst gap is tuned, relative.
pub(crate) const TUNED_WITHIN: f64 = 0.002;
/// Most evaluations of one tuning.
pub(super) const MOST_TRIES: usize = 11;

/// The entry, and what belongs to it, with the least reserve at which the worst gap is the
/// reference. Where the gap first falls below it on the ladder, the Illinois variant of regula
/// falsi goes on. Where no reserve suffices, the entry with the least gap is not tuned, nor is the
/// one without reserve where none is needed. None if an evaluation was given up.
pub(super) fn tune<T>(
    reference: f64,
    evaluate: impl Fn(f64) -> Result<Option<(Entry, T)>, RunError>,
) -> Result<Option<(Entry, T)>, RunError> {
    let off = |entry: &Entry| entry.worst_gap_mm.map_or(f64::INFINITY, |gap| gap / reference - 1.0);
    let tuned = |found: (Entry, T)| (Entry { tuned: true, ..found.0 }, found.1);
    let mut best: Option<(Entry, T)> = None;
    // Reserves and their gaps over the reference: above it, then below.
    let (mut wide, mut safe) = (None, None);
    for reserve in LADDER {
        let Some(found) = evaluate(reserve)? else { return Ok(None) };
        let f = off(&found.0);
        if f.abs() <= TUNED_WITHIN {
            return Ok(Some(tuned(found)));
        }
        if best.as_ref().is_none_or(|best| f < off(&best.0)) {
            best = Some(found);
        }
        if f < 0.0 {
            safe = Some((reserve, f));
            break;
        }
        wide = Some((reserve, f));
    }
    let mut best = best.expect("the ladder has rungs");
    let (Some(mut wide), Some(mut safe)) = (wide, safe) else { return Ok(Some(best)) };
    for _ in LADDER.len()..MOST_TRIES {
        let part = (safe.1 / (safe.1 - wide.1)).clamp(0.02, 0.98);
        // Without a gap there is nothing to interpolate.
        let part = if wide.1.is_finite() { part } else { 0.5 };
        let reserve = safe.0 + part * (wide.0 - safe.0);
        let Some(found) = evaluate(reserve)? else { return Ok(None) };
        let f = off(&found.0);
        if f.abs() <= TUNED_WITHIN {
            return Ok(Some(tuned(found)));
        }
        if f < 0.0 {
            safe = (reserve, f);
            wide.1 *= 0.5;
            // The fastest that keeps the reference, if the tries run out.
            best = found;
        } else {
            wide = (reserve, f);
            safe.1 *= 0.5;
        }
    }
    Ok(Some(best))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// Tunes a worst gap that is this function of the reserve; the entry and the tries.
    fn tuned(gap: impl Fn(f64) -> f64) -> (Entry, usize) {
        let tries = Cell::new(0);
        let found = tune(2.0, |reserve| {
            tries.set(tries.get() + 1);
            let worst_gap_mm = Some(gap(reserve));
            Ok(Some((Entry { gap_reserve: Some(reserve), worst_gap_mm, ..Entry::default() }, ())))
        });
        (found.unwrap().expect("tuned").0, tries.get())
    }

    #[test]
    fn the_reserve_of_the_reference_is_found() {
        let curves: [fn(f64) -> f64; 3] =
            [|r| 2.1 * (1.0 - r), |r| 2.2 - 1.3 * r.sqrt(), |r| 2.05 - 3.0 * r * r];
        for gap in curves {
            let (entry, tries) = tuned(gap);
            assert!(entry.tuned && tries <= MOST_TRIES, "{entry:?} {tries}");
            assert!((entry.worst_gap_mm.unwrap() / 2.0 - 1.0).abs() <= TUNED_WITHIN, "{entry:?}");
        }
    }

    #[test]
    fn a_reference_out_of_reach_is_reported() {
        // Always too large: the least. Always below: none.
        type Curve = fn(f64) -> f64;
        let curves: [(Curve, f64); 2] = [(|r| 2.5 + (r - 0.06).abs(), 0.06), (|_| 1.5, 0.0)];
        for (gap, reserve) in curves {
            let (entry, tries) = tuned(gap);
            assert!(!entry.tuned && tries <= LADDER.len());
            assert_eq!(entry.gap_reserve, Some(reserve));
        }
        // Met at an end.
        assert!(tuned(|r| if r > 0.2 { 2.0 } else { 2.5 }).0.tuned);
        // Met before more reserve makes it larger again.
        let (entry, _) = tuned(|r| 2.05 - 3.0 * r + 20.0 * r * r);
        assert!(entry.tuned && entry.gap_reserve < Some(0.05), "{entry:?}");
        // Jumped over: the fastest that keeps it.
        let (entry, tries) = tuned(|r| if r > 0.11 { 1.9 } else { 2.1 });
        assert!(!entry.tuned && entry.worst_gap_mm < Some(2.0) && tries <= MOST_TRIES, "{entry:?}");
        assert!(entry.gap_reserve < Some(0.15), "{entry:?}");
    }
}
