//! The rows, predicates and texts that the tables of claims share.

use std::borrow::Cow;

use crate::figure::Claim;

/// Values from theory, simulation and virtual rig.
pub type BySource = [f64; 3];

/// Signs of a change.
pub const RISES: f64 = 1.0;
pub const FALLS: f64 = -1.0;

/// A row of a table of claims: its stable name, whether it holds and what was found, what it
/// says, and the reason if it does not hold.
pub fn row(
    id: &'static str,
    (holds, found): (bool, String),
    claim: impl Into<Cow<'static, str>>,
    reason: &str,
) -> Claim {
    let why = if holds || reason.is_empty() { found } else { format!("{found} {reason}") };
    Claim { id, figure: "", section: "", claim: claim.into(), holds, fitted: false, why }
}

/// The claims that the study makes in one section, printed below one figure.
pub fn table<const N: usize>(
    figure: &'static str,
    section: &'static str,
    rows: [Claim; N],
) -> Vec<Claim> {
    rows.map(|row| Claim { figure, section, ..row }).to_vec()
}

/// Whether values change with one sign from each to the next.
pub fn goes(values: &[f64], sense: f64) -> bool {
    values.windows(2).all(|pair| sense * (pair[1] - pair[0]) > 0.0)
}

/// Whether every source's value goes in this sense from one case to another.
pub fn all_go([from, to]: [BySource; 2], sense: f64) -> bool {
    from.into_iter().zip(to).all(|(from, to)| goes(&[from, to], sense))
}

/// Relative change of each value.
pub fn change(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| to[i] / from[i] - 1.0)
}

/// Whether all values are nearer to zero than this.
pub fn within(values: BySource, limit: f64) -> bool {
    values.iter().all(|value| value.abs() < limit)
}

/// The largest value, at least zero.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

/// The first and the last value, as text.
pub fn span(values: &[f64], decimals: usize, unit: &str) -> String {
    let (from, to) = (values[0], values[values.len() - 1]);
    format!("{from:.decimals$} to {to:.decimals$} {unit}")
}

/// Every source's value in one case and in another, as text.
pub fn spans([from, to]: [BySource; 2], decimals: usize, unit: &str) -> String {
    [0, 1, 2].map(|source| span(&[from[source], to[source]], decimals, unit)).join(", ")
}

/// Three parts in per cent, as text; `last` joins the third.
pub fn percents(parts: BySource, decimals: usize, last: &str) -> String {
    let [a, b, c] = parts.map(|part| format!("{:+.decimals$} %", 100.0 * part));
    format!("{a}, {b}{last}{c}")
}
