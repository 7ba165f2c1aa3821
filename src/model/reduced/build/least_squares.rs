//! Weighted least squares of few coefficients, by the normal equations.

/// What is small enough not to change a solution, and large enough to make one where the
/// points do not determine it, relative.
const RIDGE: f64 = 1e-11;

/// Sums over the points of a fit with T coefficients. The matrix is symmetric: its lower
/// HALF, row by row, `T (T + 1) / 2` sums.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeastSquares<const T: usize, const HALF: usize> {
    lower: [f64; HALF],
    right: [f64; T],
}

impl<const T: usize, const HALF: usize> LeastSquares<T, HALF> {
    /// No point yet.
    pub(super) const fn new() -> Self {
        assert!(2 * HALF == T * (T + 1));
        Self { lower: [0.0; HALF], right: [0.0; T] }
    }

    /// A point: what each coefficient counts with there, and the value wanted.
    pub(super) fn add(&mut self, terms: &[f64; T], value: f64, weight: f64) {
        let pairs = (0..T).flat_map(|i| terms[..=i].iter().map(move |other| terms[i] * other));
        for (sum, product) in self.lower.iter_mut().zip(pairs) {
            *sum += weight * product;
        }
        for (sum, term) in self.right.iter_mut().zip(terms) {
            *sum += weight * term * value;
        }
    }

    /// The coefficients, by Cholesky's decomposition; zeros without a point.
    pub(super) fn solve(self) -> [f64; T] {
        let (mut lower, mut solution) = (self.lower, self.right);
        let at = |i: usize, j: usize| i * (i + 1) / 2 + j;
        let most = (0..T).map(|i| lower[at(i, i)]).fold(f64::MIN_POSITIVE, f64::max);
        for i in 0..T {
            for j in 0..=i {
                let done: f64 = (0..j).map(|k| lower[at(i, k)] * lower[at(j, k)]).sum();
                let rest = lower[at(i, j)] - done;
                lower[at(i, j)] = if i == j {
                    libm::sqrt(rest.max(0.0) + RIDGE * most)
                } else {
                    rest / lower[at(j, j)]
                };
            }
            let done: f64 = (0..i).map(|k| lower[at(i, k)] * solution[k]).sum();
            solution[i] = (solution[i] - done) / lower[at(i, i)];
        }
        for i in (0..T).rev() {
            let done: f64 = (i + 1..T).map(|k| lower[at(k, i)] * solution[k]).sum();
            solution[i] = (solution[i] - done) / lower[at(i, i)];
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
        assert_eq!(LeastSquares::<3, 6>::new().solve(), [0.0; 3]);
    }

    proptest! {
        #[test]
        fn a_polynomial_is_found_again(c in prop::array::uniform4(-2.0..2.0f64)) {
            let mut fit = LeastSquares::<4, 10>::new();
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
            let mut fit = LeastSquares::<1, 1>::new();
            for (value, weight) in &values {
                fit.add(&[1.0], *value, *weight);
            }
            let weights: f64 = values.iter().map(|v| v.1).sum();
            let mean = values.iter().map(|v| v.0 * v.1).sum::<f64>() / weights;
            prop_assert!((fit.solve()[0] - mean).abs() < 1e-9);
        }
    }
}
