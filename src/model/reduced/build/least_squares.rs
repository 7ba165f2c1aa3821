//! Weighted least squares of few coefficients, by the normal equations.

/// What is small enough not to change a solution, and large enough to make one where the
/// points do not determine it, relative.
const RIDGE: f64 = 1e-11;

/// Sums over the points of a fit with T coefficients.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeastSquares<const T: usize> {
    matrix: [[f64; T]; T],
    right: [f64; T],
}

impl<const T: usize> LeastSquares<T> {
    /// No point yet.
    pub(super) const fn new() -> Self {
        Self { matrix: [[0.0; T]; T], right: [0.0; T] }
    }

    /// A point: what each coefficient counts with there, and the value wanted.
    pub(super) fn add(&mut self, terms: &[f64; T], value: f64, weight: f64) {
        for (i, (row, term)) in self.matrix.iter_mut().zip(terms).enumerate() {
            let weighted = weight * term;
            for (sum, other) in row.iter_mut().zip(terms).take(i + 1) {
                *sum += weighted * other;
            }
            self.right[i] += weighted * value;
        }
    }

    /// The coefficients, by Cholesky's decomposition; zeros without a point.
    pub(super) fn solve(mut self) -> [f64; T] {
        let most = (0..T).map(|i| self.matrix[i][i]).fold(0.0, f64::max);
        let mut solution = self.right;
        for i in 0..T {
            for j in 0..=i {
                let done: f64 = (0..j).map(|k| self.matrix[i][k] * self.matrix[j][k]).sum();
                let rest = self.matrix[i][j] - done;
                self.matrix[i][j] = if i == j {
                    libm::sqrt((rest + RIDGE * most).max(f64::MIN_POSITIVE))
                } else {
                    rest / self.matrix[j][j]
                };
            }
            let done: f64 = (0..i).map(|k| self.matrix[i][k] * solution[k]).sum();
            solution[i] = (solution[i] - done) / self.matrix[i][i];
        }
        for i in (0..T).rev() {
            let done: f64 = (i + 1..T).map(|k| self.matrix[k][i] * solution[k]).sum();
            solution[i] = (solution[i] - done) / self.matrix[i][i];
        }
        solution
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn without_points_there_is_nothing() {
        assert_eq!(LeastSquares::<3>::new().solve(), [0.0; 3]);
    }

    proptest! {
        #[test]
        fn a_polynomial_is_found_again(c in prop::array::uniform4(-2.0..2.0f64)) {
            let mut fit = LeastSquares::<4>::new();
            for k in 0..30 {
                let t = f64::from(k) / 29.0 - 0.5;
                let terms = [1.0, t, t * t, t * t * t];
                let value = terms.iter().zip(c).map(|(a, b)| a * b).sum();
                fit.add(&terms, value, 1.0 + t);
            }
            for (got, exact) in fit.solve().into_iter().zip(c) {
                prop_assert!((got - exact).abs() < 1e-6, "{got} {exact}");
            }
        }

        #[test]
        fn the_weighted_mean_is_the_fit_of_a_constant(
            values in prop::collection::vec((-3.0..3.0f64, 0.1..5.0f64), 1..20),
        ) {
            let mut fit = LeastSquares::<1>::new();
            for (value, weight) in &values {
                fit.add(&[1.0], *value, *weight);
            }
            let weights: f64 = values.iter().map(|v| v.1).sum();
            let mean = values.iter().map(|v| v.0 * v.1).sum::<f64>() / weights;
            prop_assert!((fit.solve()[0] - mean).abs() < 1e-9);
        }
    }
}
