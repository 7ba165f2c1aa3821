//! The page of a power-up.

use super::Progress;
use crate::report::svg::escape;
use crate::report::{capital, page_of};
use crate::table::counted;

/// The page; it needs no other file.
pub(crate) fn html(progress: &Progress) -> String {
    let failed = progress.checks().filter(|check| !check.ok).count();
    let (grade, headline) = match (progress.is_complete(), failed) {
        (true, _) => ("good", "The rig is wired as it should be".to_owned()),
        (false, 0) => ("fair", "Broken off: the next call goes on".to_owned()),
        (false, failed) => ("bad", format!("{} failed", counted(failed, "check"))),
    };
    let mut body = String::new();
    for (stage, checks) in progress.stages() {
        let rows: String = checks
            .iter()
            .map(|check| {
                let cells = [&check.name, &check.measured, &check.expected, &check.advice];
                let cells: String =
                    cells.iter().map(|text| format!("<td>{}</td>", escape(text))).collect();
                let verdict = if check.ok { "ok" } else { "failed" };
                format!("<tr><td>{verdict}</td>{cells}</tr>\n")
            })
            .collect();
        body += &format!(
            "<section>\n<h2>{}</h2>\n<table>\n<tr><th></th><th>check</th><th>measured</th>\
             <th>expected</th><th>advice</th></tr>\n{rows}</table>\n</section>\n",
            capital(stage.name()),
        );
    }
    let changes = super::proposals(progress);
    let list: String = changes
        .iter()
        .map(|(key, was, is)| {
            format!("<tr><td>{}</td><td>{was}</td><td>{is}</td></tr>\n", escape(key))
        })
        .collect();
    body += &format!(
        "<section>\n<h2>Parameters proposed</h2>\n<table>\n<tr><th>key</th><th>was</th>\
         <th>measured</th></tr>\n{list}</table>\n<p>`rig params restore mine.toml` writes \
         them.</p>\n</section>\n"
    );
    page_of("first power-up", grade, &headline, &body)
}
