//! The study's claims, `claims.toml`, with our verdicts; predicates and texts that these share.

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use crate::figure::Claim;

/// What our data say of a claim: its name, whether it holds, and the values that were found.
pub(super) type Verdict = (&'static str, bool, Vec<String>);

/// Values from theory, simulation and virtual rig.
pub(super) type BySource = [f64; 3];

/// Signs of a change.
pub(super) const RISES: f64 = 1.0;
pub(super) const FALLS: f64 = -1.0;

/// What the study says.
#[derive(Deserialize)]
pub(super) struct Said {
    tables: Vec<Table>,
    /// What nothing here can judge.
    pub not_judged: Vec<NotJudged>,
}

#[derive(Deserialize)]
pub(super) struct NotJudged {
    pub claim: String,
    /// Why not.
    pub reason: String,
}

/// The claims of one section, printed below one figure.
#[derive(Deserialize)]
struct Table {
    figure: String,
    section: String,
    claims: Vec<Row>,
}

#[derive(Deserialize)]
struct Row {
    id: String,
    claim: String,
    /// What was found, with a place `{}` for each value.
    found: String,
    /// Why it does not hold.
    #[serde(default)]
    reason: String,
    #[serde(default)]
    fitted: bool,
}

impl Said {
    pub(super) fn read() -> Result<Self> {
        Ok(toml::from_str(include_str!("claims.toml"))?)
    }

    /// The claims, each with the verdict of its name.
    pub(super) fn judged(self, verdicts: &[Verdict]) -> Result<Vec<Claim>> {
        let mut claims = Vec::new();
        for Table { figure, section, claims: rows } in self.tables {
            for Row { id, claim, found, reason, fitted } in rows {
                let verdict = verdicts.iter().find(|verdict| verdict.0 == id);
                let &(_, holds, ref values) =
                    verdict.with_context(|| format!("`{id}`: no verdict"))?;
                let text = if holds { found } else { format!("{found} {reason}") };
                let put = |text: String, value: &String| text.replacen("{}", value, 1);
                let why = values.iter().fold(text, put).trim_end().to_owned();
                ensure!(!why.contains("{}"), "`{id}`: a value is missing");
                let (figure, section) = (figure.clone(), section.clone());
                claims.push(Claim { id, figure, section, claim, holds, fitted, why });
            }
        }
        ensure!(claims.len() == verdicts.len(), "a verdict without its claim");
        Ok(claims)
    }
}

/// Whether values change with one sign from each to the next.
pub(super) fn goes(values: &[f64], sense: f64) -> bool {
    values.windows(2).all(|pair| sense * (pair[1] - pair[0]) > 0.0)
}

/// Whether every source's value goes in this sense from one case to another.
pub(super) fn all_go([from, to]: [BySource; 2], sense: f64) -> bool {
    from.into_iter().zip(to).all(|(from, to)| goes(&[from, to], sense))
}

/// Relative change of each value.
pub(super) fn change(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| to[i] / from[i] - 1.0)
}

/// Whether all values are nearer to zero than this.
pub(super) fn within(values: BySource, limit: f64) -> bool {
    values.iter().all(|value| value.abs() < limit)
}

/// The largest value, at least zero.
pub(super) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

/// The first and the last value, as text.
pub(super) fn span(values: &[f64], decimals: usize, unit: &str) -> String {
    let (from, to) = (values[0], values[values.len() - 1]);
    format!("{from:.decimals$} to {to:.decimals$} {unit}")
}

/// Every source's value in one case and in another, as text.
pub(super) fn spans([from, to]: [BySource; 2], decimals: usize, unit: &str) -> String {
    [0, 1, 2].map(|source| span(&[from[source], to[source]], decimals, unit)).join(", ")
}

/// Three parts in per cent, as text; `last` joins the third.
pub(super) fn percents(parts: BySource, decimals: usize, last: &str) -> String {
    let [a, b, c] = parts.map(|part| format!("{:+.decimals$} %", 100.0 * part));
    format!("{a}, {b}{last}{c}")
}

/// Values with so many decimals.
pub(super) fn fixed<const N: usize>(decimals: usize, values: [f64; N]) -> Vec<String> {
    values.map(|value| format!("{value:.decimals$}")).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_takes_the_verdict_of_its_name_with_its_values_and_its_reason() {
        let text = "not_judged = []\n[[tables]]\nfigure = ''\nsection = ''\n[[tables.claims]]\n\
                    id = 'a'\nclaim = ''\nfound = '{} of {}.'\nreason = 'No.'";
        let judged = |verdicts: &[Verdict]| toml::from_str::<Said>(text).unwrap().judged(verdicts);
        let found = |holds| ("a", holds, fixed(1, [2.0, 3.0]));
        assert_eq!(judged(&[found(true)]).unwrap()[0].why, "2.0 of 3.0.");
        assert_eq!(judged(&[found(false)]).unwrap()[0].why, "2.0 of 3.0. No.");
        for wrong in [&[][..], &[found(true), ("b", true, vec![])], &[("a", true, vec![])]] {
            assert!(judged(wrong).is_err(), "{wrong:?}");
        }
    }
}
