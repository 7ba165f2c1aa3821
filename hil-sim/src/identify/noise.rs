//! Noise of residuals: its standard deviation, and how far correlation inflates the variance
//! of a mean.

/// Standard deviation about zero of residuals, and how much their correlation adds to the
/// variance of a mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Root mean square.
    pub deviation: f64,
    /// Variance of a mean over that of as many independent ones, at least 1.
    pub inflation: f64,
}

impl Noise {
    /// Of residuals in order of time. The inflation is the integrated autocorrelation
    /// 1 + 2 sum rho_k, summed until it no longer grows faster than a fifth of the lags
    /// summed (Sokal's window), at most a third of the residuals.
    pub fn of(residuals: &[f64]) -> Self {
        let n = residuals.len();
        let square: f64 = residuals.iter().map(|r| r * r).sum();
        if n < 3 || square == 0.0 {
            return Self { deviation: (square / n.max(1) as f64).sqrt(), inflation: 1.0 };
        }
        let mut inflation = 1.0;
        for lag in 1..n / 3 {
            let product: f64 = residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b).sum();
            inflation += 2.0 * product / square;
            if lag as f64 >= WINDOW * inflation {
                break;
            }
        }
        Self { deviation: (square / n as f64).sqrt(), inflation: inflation.max(1.0) }
    }

    /// Standard deviation of independent residuals with the same variance of the mean.
    pub fn effective(&self) -> f64 {
        self.deviation * self.inflation.sqrt()
    }
}

/// Lags summed per integrated autocorrelation.
const WINDOW: f64 = 5.0;

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// First-order autoregression.
    fn series(part: f64, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut value = 0.0;
        (0..4000)
            .map(|_| {
                value = part * value + random.random::<f64>() - 0.5;
                value
            })
            .collect()
    }

    #[test]
    fn independent_residuals_count_each() {
        let noise = Noise::of(&series(0.0, 1));
        assert!((noise.deviation / (1.0f64 / 12.0).sqrt() - 1.0).abs() < 0.05, "{noise:?}");
        assert!(noise.inflation < 1.2, "{noise:?}");
    }

    #[test]
    fn correlated_residuals_count_less() {
        // (1 + a) / (1 - a) of a first-order autoregression.
        for part in [0.5, 0.8] {
            let noise = Noise::of(&series(part, 2));
            let expected = (1.0 + part) / (1.0 - part);
            assert!((noise.inflation / expected - 1.0).abs() < 0.35, "{noise:?} {expected}");
        }
    }

    #[test]
    fn no_residuals_or_zeros_are_no_noise() {
        assert_eq!(Noise::of(&[]), Noise { deviation: 0.0, inflation: 1.0 });
        assert_eq!(Noise::of(&[0.0; 9]).effective(), 0.0);
    }
}
