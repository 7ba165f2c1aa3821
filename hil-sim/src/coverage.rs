//! What of the controller's library its own tests visit, from the account that LLVM keeps.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// The export of `llvm-cov`, as far as it is read here.
#[derive(Deserialize)]
struct Export {
    data: Vec<Data>,
}

#[derive(Deserialize)]
struct Data {
    functions: Vec<Function>,
    totals: Totals,
}

/// An instance of a function: a generic one has several.
#[derive(Deserialize)]
struct Function {
    name: String,
    count: u64,
    filenames: Vec<PathBuf>,
    /// Line, column, and six more numbers each.
    regions: Vec<[u64; 8]>,
}

#[derive(Deserialize)]
struct Totals {
    lines: Share,
    regions: Share,
}

#[derive(Deserialize)]
struct Share {
    percent: f64,
}

/// What the tests visited.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coverage {
    /// Functions and closures of the library in the source.
    pub functions: usize,
    /// Those that no test visits.
    pub unvisited: Vec<Unvisited>,
    /// Lines that were visited, percent; those of tests count too.
    pub lines_percent: f64,
    /// Regions, that is branches of code, percent; as lines.
    pub regions_percent: f64,
}

/// A function that no test visits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Unvisited {
    /// Its file, from the root of the workspace.
    pub file: PathBuf,
    /// The line in which it begins.
    pub line: u64,
    /// Its name, as the linker has it.
    pub symbol: String,
}

/// Reads an export in JSON. Counted is what lies in `src` of the workspace at `root`,
/// except the program: on a host it is empty.
///
/// # Errors
/// If it is no such export, or has no function of the library.
pub fn read(export: &str, root: &Path) -> Result<Coverage, String> {
    let export: Export =
        serde_json::from_str(export).map_err(|error| format!("no export of llvm-cov: {error}"))?;
    let [data] = &export.data[..] else {
        return Err(format!("{} accounts in the export, expected one", export.data.len()));
    };
    let (library, program) = (root.join("src"), root.join("src/main.rs"));
    let mut all = BTreeMap::new();
    for function in &data.functions {
        let (Some(file), Some([line, column, ..])) =
            (function.filenames.first(), function.regions.first())
        else {
            continue;
        };
        if file.starts_with(&library) && *file != program {
            let (count, _) = all.entry((file, line, column)).or_insert((0, &function.name));
            *count += function.count;
        }
    }
    if all.is_empty() {
        return Err(format!("no function of {} in the export", library.display()));
    }
    let unvisited = all.iter().filter(|(_, (count, _))| *count == 0);
    let unvisited = unvisited
        .map(|(&(file, line, _), (_, name))| Unvisited {
            file: file.strip_prefix(root).unwrap_or(file).to_owned(),
            line: *line,
            symbol: (*name).clone(),
        })
        .collect();
    Ok(Coverage {
        functions: all.len(),
        unvisited,
        lines_percent: data.totals.lines.percent,
        regions_percent: data.totals.regions.percent,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(name: &str, file: &str, line: u64, count: u64) -> serde_json::Value {
        serde_json::json!({
            "name": name, "count": count, "filenames": [file],
            "regions": [[line, 5, line + 3, 6, count, 0, 0, 0]], "branches": [],
        })
    }

    fn export(functions: &[serde_json::Value]) -> String {
        let totals = serde_json::json!({
            "lines": { "percent": 90.5 }, "regions": { "percent": 80.25 },
        });
        let data = serde_json::json!({ "data": [{ "functions": functions, "totals": totals }] });
        data.to_string()
    }

    #[test]
    fn an_instance_that_ran_stands_for_all_of_its_function() {
        let text = export(&[
            function("a1", "/w/src/a.rs", 3, 0),
            function("a2", "/w/src/a.rs", 3, 7),
            function("b", "/w/src/a.rs", 9, 0),
            function("main", "/w/src/main.rs", 1, 0),
            function("elsewhere", "/w/hil-sim/src/a.rs", 1, 0),
        ]);
        let found = read(&text, Path::new("/w")).unwrap();
        let left = Unvisited { file: "src/a.rs".into(), line: 9, symbol: "b".to_owned() };
        assert_eq!((found.functions, found.unvisited), (2, vec![left]));
        assert_eq!((found.lines_percent, found.regions_percent), (90.5, 80.25));
    }

    #[test]
    fn what_is_no_account_is_refused() {
        for text in ["", "{}", "[]", &export(&[]), r#"{"data": []}"#] {
            assert!(read(text, Path::new("/w")).is_err(), "{text}");
        }
    }
}
