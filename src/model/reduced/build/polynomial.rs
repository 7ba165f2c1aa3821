//! Interpolation at Chebyshev's nodes, as powers of a variable from -1/2 to 1/2.

use crate::numeric::cosine_of_turns;

/// Nodes of each axis of a surface.
const NODES: usize = 8;

/// Powers of one variable of a surface, at most.
const POWERS: usize = 6;

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
fn node(index: usize, count: usize) -> f64 {
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

/// The part of a total degree up to 5, that with TERMS terms, of the polynomial through
/// `f` at 8 by 8 nodes over two ranges within 0 to 1, by powers of the differences from
/// 1/2; by those of the second variable and then the first.
pub(super) fn interpolate_surface<const TERMS: usize>(
    first: (f64, f64),
    second: (f64, f64),
    f: impl Fn(f64, f64) -> f64,
) -> [f64; TERMS] {
    let total = (0..POWERS).find(|n| (n + 1) * (n + 2) / 2 >= TERMS).unwrap_or(POWERS - 1);
    let at =
        |(low, high): (f64, f64), index| 0.5 * (low + high + (high - low) * node(index, NODES));
    let mut chebyshev = [[0.0; POWERS]; POWERS];
    for (k, l) in (0..NODES).flat_map(|k| (0..NODES).map(move |l| (k, l))) {
        let y = f(at(first, k), at(second, l));
        for (i, row) in chebyshev.iter_mut().enumerate() {
            for (j, c) in row.iter_mut().enumerate() {
                *c += weight(i, k, NODES) * weight(j, l, NODES) * y;
            }
        }
    }
    let centred = |(low, high): (f64, f64)| {
        rows::<POWERS>(2.0 / (high - low), (1.0 - low - high) / (high - low))
    };
    let (by_first, by_second) = (centred(first), centred(second));
    let mut powers = [[0.0; POWERS]; POWERS];
    for (i, j) in (0..=total).flat_map(|i| (0..=total - i).map(move |j| (i, j))) {
        for (row, p) in powers.iter_mut().zip(&by_first[i]) {
            for (out, q) in row.iter_mut().zip(&by_second[j]) {
                *out += chebyshev[i][j] * p * q;
            }
        }
    }
    let mut terms = [0.0; TERMS];
    let order = (0..=total).flat_map(|j| (0..=total - j).map(move |i| (i, j)));
    for (slot, (i, j)) in terms.iter_mut().zip(order) {
        *slot = powers[i][j];
    }
    terms
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
        let terms: [f64; 21] = interpolate_surface((0.2, 1.0), (0.0, 0.7), |p, q| {
            let (p, q) = (p - 0.5, q - 0.5);
            1.0 + p + 3.0 * p * p * q - q * q * q * q * q
        });
        let expected = [(0, 1.0), (1, 1.0), (8, 3.0), (20, -1.0)];
        for (index, got) in terms.into_iter().enumerate() {
            let exact = expected.iter().find(|(i, _)| *i == index).map_or(0.0, |(_, v)| *v);
            assert!((got - exact).abs() < 1e-11, "{index}: {got}");
        }
    }
}
