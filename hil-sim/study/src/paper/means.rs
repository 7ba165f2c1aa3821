//! Four means of ten: a curve is fitted to each rig's readings, and the curves of ten
//! rigs are averaged, as the study did.

use nalgebra::{Matrix3, Vector3};

use super::experiment::{Experiment, Reading, groups};
use crate::figure::Series;
use hil_sim::report::axis::extent;

/// A parabola.
type Curve = [f64; 3];

/// A sweep of the experiment as four mean curves and the range of all rigs.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Means {
    /// Where the curves are given.
    pub at: Vec<f64>,
    /// The four means there.
    pub curves: Vec<Vec<f64>>,
    /// Least and largest of the rigs' own curves there.
    pub range: Vec<(f64, f64)>,
}

impl Means {
    /// Means of `figure` over the sweep, whose variable `x` picks from the case, at these places.
    ///
    /// Rigs that lack a reading are fitted without it; one with fewer than three is left
    /// out.
    pub(super) fn of(
        sweep: &[&Experiment],
        x: impl Fn(&Experiment) -> f64,
        figure: impl Fn(&Reading) -> f64,
        at: &[f64],
    ) -> Self {
        let rigs = sweep.iter().map(|experiment| experiment.runs.len()).min().unwrap_or(0);
        let curves: Vec<Option<Curve>> = (0..rigs)
            .map(|rig| {
                let point = |e: &&Experiment| Some((x(e), e.runs[rig].mean(&figure)?));
                parabola(&sweep.iter().filter_map(point).collect::<Vec<_>>())
            })
            .collect();
        let value = |curve: &Curve, x: f64| curve[0] + x * (curve[1] + x * curve[2]);
        let mean = |group: &Vec<usize>, x: f64| {
            let of: Vec<f64> = group
                .iter()
                .filter_map(|&rig| curves.get(rig)?.as_ref().map(|curve| value(curve, x)))
                .collect();
            of.iter().sum::<f64>() / of.len() as f64
        };
        let range_at = |&x: &f64| extent(curves.iter().flatten().map(|curve| value(curve, x)));
        let range = at.iter().filter_map(range_at).collect();
        let curves =
            groups().iter().map(|group| at.iter().map(|&x| mean(group, x)).collect()).collect();
        Self { at: at.to_vec(), curves, range }
    }

    /// Mean of the four means.
    pub(super) fn middle(&self) -> Vec<f64> {
        let count = self.curves.len() as f64;
        (0..self.at.len())
            .map(|i| self.curves.iter().map(|curve| curve[i]).sum::<f64>() / count)
            .collect()
    }

    /// Largest difference between two of the means at one place.
    pub(super) fn spread(&self) -> f64 {
        let ranges = (0..self.at.len()).filter_map(|i| extent(self.curves.iter().map(|c| c[i])));
        ranges.map(|(low, high)| high - low).fold(0.0, f64::max)
    }

    /// The means as series, the first with the range over all rigs.
    pub(super) fn series(&self) -> Vec<Series> {
        let band = self.at.iter().zip(&self.range).map(|(&x, &(low, high))| (x, low, high));
        let mut range: Vec<_> = band.collect();
        let curves = self
            .curves
            .iter()
            .map(|curve| self.at.iter().copied().zip(curve.iter().copied()).collect());
        Series::means(curves)
            .map(|one| Series { range: std::mem::take(&mut range), ..one })
            .collect()
    }
}

/// Largest distance of evenly spaced values from the straight line between their ends,
/// over the distance between these: 0 for a line, positive above it.
pub(super) fn bend(values: &[f64]) -> f64 {
    let last = values.len() - 1;
    let rise = values[last] - values[0];
    let off = |i: usize| values[i] - values[0] - rise * i as f64 / last as f64;
    let farther = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    (0..=last).map(off).fold(0.0, farther) / rise.abs()
}

/// Least-squares parabola through the points; none through fewer than three places.
fn parabola(points: &[(f64, f64)]) -> Option<Curve> {
    if points.len() < 3 {
        return None;
    }
    // About the middle, where the normal equations are well conditioned.
    let middle = points.iter().map(|p| p.0).sum::<f64>() / points.len() as f64;
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for &(x, y) in points {
        let row = Vector3::new(1.0, x - middle, (x - middle).powi(2));
        matrix += row * row.transpose();
        right += row * y;
    }
    let [a, b, c] = matrix.cholesky()?.solve(&right).into();
    Some([a - b * middle + c * middle * middle, b - 2.0 * c * middle, c])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::paper::case::{Case, Loads};
    use crate::paper::claims::{FALLS, RISES, goes};
    use crate::paper::experiment::Run;

    proptest! {
        #[test]
        fn a_parabola_is_found_again(a in -3.0..3.0, b in -1.0..1.0, c in -0.1..0.1f64) {
            let points: Vec<(f64, f64)> =
                [33.0, 36.0, 40.0, 45.0, 50.0].map(|x| (x, a + x * (b + c * x))).to_vec();
            let found = parabola(&points).unwrap();
            for (x, y) in points {
                let value = found[0] + x * (found[1] + x * found[2]);
                prop_assert!((value - y).abs() < 1e-8, "{} {}", value, y);
            }
        }
    }

    #[test]
    fn two_places_make_no_parabola() {
        assert_eq!(parabola(&[(1.0, 2.0), (2.0, 3.0)]), None);
        assert_eq!(parabola(&[(1.0, 2.0), (1.0, 3.0), (1.0, 4.0)]), None);
    }

    /// A sweep on which rig r reads `figure(r, x)`.
    fn sweep(figure: impl Fn(usize, f64) -> f64) -> Vec<Experiment> {
        let at = |x: f64| Experiment {
            case: Case::new(Loads::Prototype, x, 40.0),
            runs: (0..40)
                .map(|rig| Run {
                    crossings: vec![Reading { gap_mm: figure(rig, x), ..Reading::default() }],
                    ..Run::default()
                })
                .collect(),
        };
        [3.0, 5.0, 8.0].map(at).to_vec()
    }

    fn means(experiments: &[Experiment]) -> Means {
        let all: Vec<&Experiment> = experiments.iter().collect();
        let at: Vec<f64> = (0..11).map(|i| 3.0 + 0.5 * f64::from(i)).collect();
        Means::of(&all, |e| e.case.speed_mm_s, |reading| reading.gap_mm, &at)
    }

    #[test]
    fn equal_rigs_have_equal_means() {
        let found = means(&sweep(|_, x| 2.0 + 0.1 * x - 0.004 * x * x));
        assert!(found.spread() < 1e-12);
        let middle = found.middle();
        assert!((middle[10] - middle[0] - (0.5 - 0.004 * 55.0)).abs() < 1e-9);
        assert!(found.curves.iter().all(|curve| goes(curve, RISES) && !goes(curve, FALLS)));
        assert!(found.curves.iter().all(|curve| bend(curve) > 0.05));
        assert_eq!(found.series().len(), 4);
    }

    #[test]
    fn the_spread_is_that_of_the_means() {
        let found = means(&sweep(|rig, x| x + if rig == 0 { 1.0 } else { 0.0 }));
        assert!((found.spread() - 0.1).abs() < 1e-9, "{}", found.spread());
        assert!(found.curves.iter().all(|curve| bend(curve).abs() < 1e-9));
        let widest = found.range.iter().map(|(a, b)| b - a).fold(0.0, f64::max);
        assert!((widest - 1.0).abs() < 1e-9);
    }
}
