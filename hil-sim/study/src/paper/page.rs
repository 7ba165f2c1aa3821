//! The page of all figures, with their claims.

use std::fmt::Write as _;

use anyhow::Result;

use super::Study;
use super::claims::{NotJudged, Said};
use crate::figure::{Claim, Figure, Mark, Source};

pub(crate) fn markdown(study: &Study) -> Result<String> {
    let held = study.claims.iter().filter(|claim| claim.holds).count();
    let fitted = study.claims.iter().filter(|claim| claim.holds && claim.fitted).count();
    let mut page = format!(
        "# The study's figures, regenerated\n\nWritten by `cargo rig paper`; do not edit.\n\n\
         Every result that the study's text describes, three times. **Theory** is the controller's model, the tread rolled out in fixed point. **Simulation** is the reference models. **Virtual rig** is with the \
         shipping controller, sensor noise and tolerances: forty rigs a case, four means of ten, as in the study. \
         The three are one ring of rubber elements, so they agree on the contact by construction. **Continuum** \
         is independent of them: this project's own finite elements ([fe](../../hil-sim/study/fe/README.md)), a \
         rubber 8 mm thick, pushed without friction, with one modulus calibrated to the ring. What is fitted to \
         what: [PLANT.md](../PLANT.md#what-is-fitted-and-what-is-independent).\n\n\
         Filled squares are numbers that the study prints; to hollow ones a parameter is fitted. A claim that \
         holds because of a fit, to the study or of one source to another, is marked.\n\n\
         Of {} claims {held} hold, {fitted} of these because something is fitted to them, and {} do not. Code \
         judges each claim from the data of its figure, which are in [paper.json](paper.json).\n",
        study.claims.len(),
        study.claims.len() - held,
    );
    for figure in &study.figures {
        section(&mut page, figure, &study.claims);
    }
    page += "\n## Not judged\n\n| claim | why not |\n|---|---|\n";
    for NotJudged { claim, reason } in Said::read()?.not_judged {
        let _ = writeln!(page, "| {claim} | {reason} |");
    }
    Ok(page)
}

fn section(page: &mut String, figure: &Figure, claims: &[Claim]) {
    let _ = write!(
        page,
        "\n## {}{}\n\n![{}]({})\n\n{}\n",
        number(figure.id),
        figure.title,
        figure.title,
        figure.file,
        figure.caption
    );
    if !figure.published.is_empty() {
        *page += "\n| published | | theory | simulation | virtual rig | continuum |\n|---|---|---|---|---|---|\n";
        for mark in &figure.published {
            *page += &mark_row(mark);
        }
    }
    *page += "\n| the study says | here | why not |\n|---|---|---|\n";
    for claim in claims.iter().filter(|claim| claim.figure == figure.id) {
        let why = if claim.holds { "" } else { &claim.why };
        let _ = writeln!(page, "| {} | {} | {why} |", claim.claim, claim.verdict());
    }
}

/// Number of the figure in the study, if it has one.
fn number(id: &str) -> String {
    match id.strip_prefix("fig") {
        Some(number) => format!("Fig. {number}: "),
        None => String::new(),
    }
}

fn mark_row(mark: &Mark) -> String {
    let fitted = if mark.fitted { " (fitted)" } else { "" };
    let unit = if mark.unit.is_empty() { String::new() } else { format!(" {}", mark.unit) };
    let ours = |source: Source| {
        mark.ours.iter().find(|ours| ours.source == source).map_or_else(String::new, |ours| {
            format!("{} ({:+.1} %)", figures(ours.value), 100.0 * ours.deviation)
        })
    };
    format!(
        "| {} | {}{unit}{fitted} | {} | {} | {} | {} |\n",
        mark.what,
        figures(mark.published),
        ours(Source::Theory),
        ours(Source::Simulation),
        ours(Source::Experiment),
        ours(Source::FiniteElements)
    )
}

/// A value to four figures.
fn figures(value: f64) -> String {
    let digits = (3.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_four_figures() {
        let shown = [1.7079, 56.5261, 276.0, 0.0213, 2.04].map(figures);
        assert_eq!(shown, ["1.708", "56.53", "276.0", "0.0213", "2.040"]);
    }
}
