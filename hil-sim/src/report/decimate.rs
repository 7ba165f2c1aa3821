//! Lines with no more points than a picture can show.

/// The points within `x` as pieces, broken where one is outside or not finite, with at most four
/// points in each of `columns` columns: the first, the lowest, the highest and the last, so that no
/// peak is lost.
pub(super) fn decimate(
    points: &[(f64, f64)],
    x: (f64, f64),
    columns: usize,
) -> Vec<Vec<(f64, f64)>> {
    let width = (x.1 - x.0) / columns.max(1) as f64;
    let column = |point: &(f64, f64)| ((point.0 - x.0) / width) as i64;
    let shown = |point: &(f64, f64)| (x.0..=x.1).contains(&point.0) && point.1.is_finite();
    let pieces = points.chunk_by(|a, b| shown(a) == shown(b)).filter(|piece| shown(&piece[0]));
    pieces
        .map(|piece| piece.chunk_by(|a, b| column(a) == column(b)).flat_map(outline).collect())
        .collect()
}

/// First, lowest, highest and last of the points of a column, in their order.
fn outline(points: &[(f64, f64)]) -> impl Iterator<Item = (f64, f64)> {
    let by_height = |a: &usize, b: &usize| points[*a].1.total_cmp(&points[*b].1);
    let places = 0..points.len();
    let (low, high) = (places.clone().min_by(by_height), places.clone().max_by(by_height));
    let mut kept: Vec<usize> =
        [places.clone().next(), low, high, places.last()].into_iter().flatten().collect();
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|place| points[place])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_spike_survives() {
        let height = |i| if i == 4321 { 7.0 } else { 0.0 };
        let points: Vec<_> = (0..10_000).map(|i| (f64::from(i), height(i))).collect();
        let pieces = decimate(&points, (0.0, 10_000.0), 100);
        assert_eq!(pieces.len(), 1);
        assert!(pieces[0].len() <= 400);
        assert!(pieces[0].contains(&(4321.0, 7.0)));
        assert_eq!(pieces[0].first(), Some(&(0.0, 0.0)));
        assert_eq!(pieces[0].last(), Some(&(9999.0, 0.0)));
    }

    #[test]
    fn missing_and_outside_values_break_the_line_and_one_that_turns_back_keeps_its_order() {
        let points =
            [(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.0), (3.0, f64::INFINITY), (4.0, 2.0), (9.0, 1.0)];
        let pieces = decimate(&points, (0.0, 5.0), 10);
        assert_eq!(pieces, [vec![(0.0, 1.0)], vec![(2.0, 1.0)], vec![(4.0, 2.0)]]);
        let points = [(0.0, 0.0), (5.0, 1.0), (0.0, 2.0)];
        assert_eq!(decimate(&points, (0.0, 10.0), 10), [points.to_vec()]);
    }
}
