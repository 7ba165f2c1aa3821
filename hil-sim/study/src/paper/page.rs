//! The page of all figures, with their claims.

use std::fmt::Write as _;

use super::Study;
use crate::figure::{Claim, Figure, Mark, Source};

/// What the study claims and nothing here can judge, and why.
const NOT_JUDGED: [(&str, &str); 4] = [
    (
        "Stress concentrates on the drive arm as the preload rises (Simulation analysis results).",
        "It takes a three-dimensional model of the arm, whose shape is not published.",
    ),
    (
        "Deformation displacements of the finite elements in collision and impact, the six \
         constrained modes, the values of the last test (Tables 2, 3, 4).",
        "The tables are not part of the text, and are found nowhere else.",
    ),
    (
        "The values of the curves (Figs. 11, 16, 20 to 24).",
        "They are in images alone; nothing is read off them.",
    ),
    (
        "Wear, momentary slip and delayed preload make the differences between the means \
         (Analysis and discussion of test results).",
        "The tolerances of the virtual rig are chosen: how they share in its spread says nothing of the \
         study's.",
    ),
];

/// The page as Markdown.
#[must_use]
pub fn markdown(study: &Study) -> String {
    let held = study.claims.iter().filter(|claim| claim.holds).count();
    let fitted = study.claims.iter().filter(|claim| claim.holds && claim.fitted).count();
    let mut page = format!(
        "# The study's figures, regenerated\n\nWritten by `cargo rig paper`; do not edit.\n\n\
         Every result that the text of the study describes, three times: **theory**, the reduced model \
         that the controller uses; **simulation**, the reference models; **experiment**, the virtual \
         rig with the shipping controller, sensor noise and tolerances, forty rigs a case and four means \
         of ten, as the study made them. Filled diamonds are numbers that the study prints, hollow ones those \
         among them to which a parameter is fitted: three gaps, to which stiffness, stiffening and relaxation time of \
         the tread are, and one frequency, to which a tip mass is. Nothing else is fitted, and nothing is \
         tuned so that a claim would hold.\n\n\
         Of {} claims {held} hold, {fitted} of these because something is fitted to them, and {} do not. Each is judged by code from the data of its figure; \
         a test fails if a verdict changes. The data are in [paper.json](paper.json).\n",
        study.claims.len(),
        study.claims.len() - held,
    );
    for figure in &study.figures {
        section(&mut page, figure, &study.claims);
    }
    page += "\n## Not judged\n\n| claim | why not |\n|---|---|\n";
    for (claim, why) in NOT_JUDGED {
        let _ = writeln!(page, "| {claim} | {why} |");
    }
    page
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
        *page += "\n| published | | theory | simulation | experiment |\n|---|---|---|---|---|\n";
        for mark in &figure.published {
            *page += &mark_row(mark);
        }
    }
    *page += "\n| the study says | in its section | | in ours |\n|---|---|---|---|\n";
    for claim in claims.iter().filter(|claim| claim.figure == figure.id) {
        let verdict = claim.verdict();
        let _ =
            writeln!(page, "| {} | {} | {verdict} | {} |", claim.claim, claim.section, claim.why);
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
        "| {} | {}{unit}{fitted} | {} | {} | {} |\n",
        mark.what,
        figures(mark.published),
        ours(Source::Theory),
        ours(Source::Simulation),
        ours(Source::Experiment)
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

    #[test]
    fn a_row_of_the_table_cannot_be_broken_by_its_text() {
        for (claim, why) in NOT_JUDGED {
            assert!(!claim.contains(['|', '\n']) && !why.contains(['|', '\n']));
        }
    }
}
