//! The frame of data that the claims are judged by, and the rows, predicates and texts that
//! their tables share.

use std::borrow::Cow;

use super::amplitudes::Amplitudes;
use super::case::Case;
use super::experiment::Experiment;
use super::histories::{Histories, Quantity};
use super::hold::Hold;
use super::modes::Modes;
use super::sweeps::Sweep;
use super::theory::Lift;
use crate::figure::Claim;

/// Values from theory, simulation and virtual rig.
pub type BySource = [f64; 3];

/// Signs of a change.
pub const RISES: f64 = 1.0;
pub const FALLS: f64 = -1.0;

/// A quantity that a case has one value of, from each source.
#[derive(Clone, Copy, Debug)]
pub enum Column {
    /// Largest value in a transition, counted from 0.
    Peak(Quantity, usize),
    /// At lift-off from the first step, of the finite-element cases.
    Lift(fn(&Lift) -> f64),
    /// Mean gap of the three transitions, mm, of the conclusion's cases.
    HeldGap,
}

/// What figures and claims are made of.
#[derive(Debug)]
pub struct Data {
    pub experiments: Vec<Experiment>,
    pub histories: Vec<Histories>,
    pub amplitudes: Amplitudes,
    pub modes: Modes,
    /// Over the preload.
    pub preload: Sweep,
    /// Over the speed.
    pub speed: Sweep,
    pub hold: Hold,
}

impl Data {
    /// The deployments of these cases, in their order.
    pub fn histories<const N: usize>(&self, cases: [Case; N]) -> [&Histories; N] {
        let of = |case| self.histories.iter().find(|one| one.case == case);
        cases.map(|case| of(case).expect("a case that was run"))
    }

    pub fn get(&self, column: Column, case: Case) -> BySource {
        match column {
            Column::Peak(quantity, stage) => {
                let [one] = self.histories([case]);
                one.peak_values(quantity).map(|peaks| peaks[stage])
            }
            Column::Lift(pick) => self.amplitudes.lift(case, pick),
            Column::HeldGap => self.hold.gap(case),
        }
    }

    /// Whether a column goes in this sense from one case to another, in every source.
    pub fn goes(&self, column: Column, cases: [Case; 2], sense: f64) -> bool {
        let [from, to] = cases.map(|case| self.get(column, case));
        from.into_iter().zip(to).all(|(from, to)| goes(&[from, to], sense))
    }

    /// Relative change of a column from one case to another.
    pub fn change(&self, column: Column, cases: [Case; 2]) -> BySource {
        let [from, to] = cases.map(|case| self.get(column, case));
        change(from, to)
    }

    /// A column in one case and in another, as text.
    pub fn span(&self, column: Column, cases: [Case; 2], decimals: usize, unit: &str) -> String {
        let [from, to] = cases.map(|case| self.get(column, case));
        let of = |source: usize| span(&[from[source], to[source]], decimals, unit);
        [0, 1, 2].map(of).join(", ")
    }

    /// The peaks of a case by stage, as text.
    pub fn peaks_text(&self, quantity: Quantity, case: Case) -> String {
        let [one] = self.histories([case]);
        let of = |peaks: [f64; 3]| peaks.map(|peak| format!("{peak:.1}")).join(", ");
        format!("{}: {}", case.name(), one.peak_values(quantity).map(of).join("; "))
    }
}

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

/// Three parts in per cent, as text; `last` joins the third.
pub fn percents(parts: BySource, decimals: usize, last: &str) -> String {
    let [a, b, c] = parts.map(|part| format!("{:+.decimals$} %", 100.0 * part));
    format!("{a}, {b}{last}{c}")
}
