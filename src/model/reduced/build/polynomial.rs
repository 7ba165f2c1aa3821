//! Interpolation at Chebyshev's nodes, as powers of a variable from -1/2 to 1/2.

use crate::numeric::cosine_of_turns;

/// Chebyshev's polynomials T_0 to T_(N-1) of `scale t + shift` by powers of t.
pub(super) fn rows<const N: usize>(scale: f64, shift: f64) -> [[f64; N]; N] {
    let mut rows = [[0.0; N]; N];
    for n in 0..N {
        let mut row = [0.0; N];
        match n {
            0 => row[0] = 1.0,
            1 => (row[0], row[1]) = (shift, scale),
            _ => {
                let (last, before) = (rows[n - 1], rows[n - 2]);
                for (power, out) in row.iter_mut().enumerate() {
                    let lower = if power > 0 { last[power - 1] } else { 0.0 };
                    *out = 2.0 * (shift * last[power] + scale * lower) - before[power];
                }
            }
        }
        rows[n] = row;
    }
    rows
}

/// Node `index` of `count`, from -1 to 1.
pub(super) fn node(index: usize, count: usize) -> f64 {
    cosine(2 * index + 1, 4 * count)
}

/// Weight of node `index` of `count` in the coefficient of T_n.
fn weight(n: usize, index: usize, count: usize) -> f64 {
    (if n == 0 { 1.0 } else { 2.0 }) / count as f64 * cosine(n * (2 * index + 1), 4 * count)
}

/// Cosine of a part of a turn.
fn cosine(part: usize, of: usize) -> f64 {
    cosine_of_turns(part as f64 / of as f64)
}

/// Value by powers.
pub(super) fn value<const N: usize>(powers: &[f64; N], t: f64) -> f64 {
    powers.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// The polynomial through `f` at N nodes from -1/2 to 1/2, by powers.
pub(super) fn interpolate<const N: usize>(f: impl Fn(f64) -> f64) -> [f64; N] {
    let mut chebyshev = [0.0; N];
    for index in 0..N {
        let y = f(0.5 * node(index, N));
        for (n, c) in chebyshev.iter_mut().enumerate() {
            *c += weight(n, index, N) * y;
        }
    }
    let rows = rows::<N>(2.0, 0.0);
    let mut powers = [0.0; N];
    for (c, row) in chebyshev.iter().zip(&rows) {
        for (out, t) in powers.iter_mut().zip(row) {
            *out += c * t;
        }
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_chebyshev_polynomials() {
        let rows = rows::<8>(1.5, -0.2);
        for (n, row) in rows.iter().enumerate() {
            for t in [-0.5, -0.1, 0.3, 0.5] {
                let angle = f64::acos(1.5 * t - 0.2);
                assert!((value(row, t) - (n as f64 * angle).cos()).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn polynomials_are_met_exactly() {
        let powers: [f64; 5] = interpolate(|t| 1.0 + t * (2.0 - t * (3.0 + t * t)));
        for (got, exact) in powers.into_iter().zip([1.0, 2.0, -3.0, 0.0, -1.0]) {
            assert!((got - exact).abs() < 1e-12, "{powers:?}");
        }
    }
}
