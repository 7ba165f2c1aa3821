//! Lines with no more points than a picture can show.

/// A line as pieces without gaps.
pub(super) type Pieces = Vec<Vec<(f64, f64)>>;

/// The points within `x` and `y`, broken where a value is not finite or lies
/// outside, with at most four points for each of `columns` columns: the first, the
/// lowest, the highest and the last, so that no peak is lost.
pub(super) fn decimate(
    points: impl IntoIterator<Item = (f64, f64)>,
    x: (f64, f64),
    y: (f64, f64),
    columns: usize,
) -> Pieces {
    let width = (x.1 - x.0) / columns.max(1) as f64;
    let mut pieces = vec![Piece::default()];
    for (px, py) in points {
        let inside = px >= x.0 && px <= x.1 && py >= y.0 && py <= y.1;
        let piece = pieces.last_mut().expect("there is always one");
        if inside {
            piece.add(((px - x.0) / width) as i64, (px, py));
        } else if !piece.is_empty() {
            pieces.push(Piece::default());
        }
    }
    pieces.into_iter().map(Piece::finish).filter(|piece| !piece.is_empty()).collect()
}

#[derive(Default)]
struct Piece {
    done: Vec<(f64, f64)>,
    column: i64,
    open: Vec<(f64, f64)>,
}

impl Piece {
    fn is_empty(&self) -> bool {
        self.done.is_empty() && self.open.is_empty()
    }

    fn add(&mut self, column: i64, point: (f64, f64)) {
        if column != self.column {
            self.close();
            self.column = column;
        }
        self.open.push(point);
    }

    fn close(&mut self) {
        let by_height = |a: &usize, b: &usize| self.open[*a].1.total_cmp(&self.open[*b].1);
        let places = 0..self.open.len();
        let low = places.clone().min_by(by_height);
        let high = places.clone().max_by(by_height);
        let mut kept: Vec<usize> =
            [places.clone().next(), low, high, places.last()].into_iter().flatten().collect();
        kept.sort_unstable();
        kept.dedup();
        self.done.extend(kept.into_iter().map(|place| self.open[place]));
        self.open.clear();
    }

    fn finish(mut self) -> Vec<(f64, f64)> {
        self.close();
        self.done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

    #[test]
    fn a_single_spike_survives() {
        let points = (0..10_000).map(|i| (f64::from(i), if i == 4321 { 7.0 } else { 0.0 }));
        let pieces = decimate(points, (0.0, 10_000.0), ALL, 100);
        assert_eq!(pieces.len(), 1);
        assert!(pieces[0].len() <= 400);
        assert!(pieces[0].contains(&(4321.0, 7.0)));
        assert_eq!(pieces[0].first(), Some(&(0.0, 0.0)));
        assert_eq!(pieces[0].last(), Some(&(9999.0, 0.0)));
    }

    #[test]
    fn the_order_of_points_stays() {
        let points = (0..1000).map(|i| (f64::from(i), (f64::from(i) * 0.7).sin()));
        let pieces = decimate(points, (0.0, 1000.0), ALL, 50);
        assert!(pieces[0].windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn missing_and_outside_values_break_the_line() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.0), (3.0, 9.0), (4.0, 2.0), (9.0, 1.0)];
        let pieces = decimate(points, (0.0, 5.0), (0.0, 5.0), 10);
        assert_eq!(pieces, [vec![(0.0, 1.0)], vec![(2.0, 1.0)], vec![(4.0, 2.0)]]);
    }

    #[test]
    fn a_line_that_turns_back_keeps_its_way() {
        let points = [(0.0, 0.0), (5.0, 1.0), (0.0, 2.0)];
        assert_eq!(decimate(points, (0.0, 10.0), ALL, 10), [points.to_vec()]);
    }
}
