//! cmake, ninja and libclang in a virtual environment.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::ProvisionError;
use crate::firmware::{self, output};

/// The wheels, as tried.
const WHEELS: [&str; 3] = ["cmake==4.4.4", "ninja==1.13.2", "libclang==18.1.1"];
/// pip without questions, without messages, and with short timeouts.
const PIP: &str = "-m pip install --quiet --disable-pip-version-check --no-input \
                   --only-binary=:all: --retries=2 --timeout=15";
/// Folder in the target directory.
const FOLDER: &str = "board-tools";
/// File that is written last and names the wheels.
const COMPLETE: &str = "complete";

/// The tools, and the settings of a build that uses them. They stay the same from build to
/// build, or cargo would build the core again each time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tools {
    programs: PathBuf,
    libclang: PathBuf,
    /// Folder of the compiler's own headers, which libclang as a wheel lacks.
    headers: PathBuf,
}

impl Tools {
    /// The tools, fetched first if they are missing.
    pub(crate) fn ready() -> Result<Self, ProvisionError> {
        let place = firmware::target_directory().join(FOLDER);
        let failed = |why: &str| ProvisionError::Tools(place.clone(), why.into());
        let headers = headers()?.ok_or_else(|| failed("the C compiler names no headers"))?;
        if !is_complete(&place, &WHEELS) || !starts(&place) {
            eprintln!("fetching cmake, ninja and libclang into {}", place.display());
            fetch(&place, &WHEELS).map_err(|why| failed(&why))?;
        }
        let libclang =
            find(&place, "libclang").ok_or_else(|| failed("no libclang in its wheel"))?;
        Ok(Self { programs: place.join("bin"), libclang, headers })
    }

    /// Makes the build of `command` use the tools.
    pub(crate) fn apply(&self, command: &mut Command) {
        let old = env::var_os("PATH").unwrap_or_default();
        let paths = std::iter::once(self.programs.clone())
            .chain(env::split_paths(&old).filter(|path| *path != self.programs));
        // A path with a separator in it cannot have been in PATH.
        let path = env::join_paths(paths).unwrap_or(old);
        let mut include = OsString::from("-I");
        include.push(&self.headers);
        command
            .env("PATH", path)
            .env("LIBCLANG_PATH", &self.libclang)
            .env("BINDGEN_EXTRA_CLANG_ARGS", include);
    }
}

/// Whether these packages are there, of these versions.
fn is_complete(place: &Path, packages: &[&str]) -> bool {
    fs::read_to_string(place.join(COMPLETE)).is_ok_and(|text| text == packages.join("\n"))
}

/// Puts these packages, each `name==version`, into a virtual environment, unless it has them.
pub fn fetched(place: &Path, packages: &[&str]) -> Result<(), String> {
    if is_complete(place, packages) { Ok(()) } else { fetch(place, packages) }
}

/// Whether the programs start: they name their interpreter by its path, so that a moved or
/// copied folder fails.
fn starts(place: &Path) -> bool {
    ["cmake", "ninja"].iter().all(|program| {
        let mut command = Command::new(place.join("bin").join(program));
        command.arg("--version").output().is_ok()
    })
}

/// Puts packages there: into a virtual environment or, where Python lacks `venv`, by pip into a
/// plain folder. An error says why not.
fn fetch(place: &Path, packages: &[&str]) -> Result<(), String> {
    let file = |error: std::io::Error| error.to_string();
    let output = |command: &mut Command| output(command).map_err(|error| error.to_string());
    if place.exists() {
        fs::remove_dir_all(place).map_err(file)?;
    }
    fs::create_dir_all(place).map_err(file)?;
    let made = output(Command::new("python3").args(["-m", "venv"]).arg(place))?;
    let mut pip = if made.status.success() {
        let mut pip = Command::new(place.join("bin").join("python3"));
        pip.args(PIP.split_whitespace());
        pip
    } else {
        let mut pip = Command::new("python3");
        pip.args(PIP.split_whitespace()).arg("--target").arg(place);
        pip
    };
    let installed = output(pip.args(packages))?;
    if !installed.status.success() {
        // An incomplete folder must not remain.
        let _ = fs::remove_dir_all(place);
        let said = String::from_utf8_lossy(&installed.stderr);
        let last = said.lines().rev().map(str::trim).find(|line| !line.is_empty());
        return Err(last.unwrap_or("it did not say why").to_owned());
    }
    fs::write(place.join(COMPLETE), packages.join("\n")).map_err(file)
}

/// The folder below `place` in which a file begins with `name` and is a library.
fn find(place: &Path, name: &str) -> Option<PathBuf> {
    let is_library = |file: &str| {
        file.starts_with(name) && [".so", ".dylib", ".dll"].iter().any(|end| file.contains(end))
    };
    let mut below = Vec::new();
    for entry in fs::read_dir(place).ok()?.flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            below.push(entry.path());
        } else if entry.file_name().to_str().is_some_and(is_library) {
            return Some(place.to_owned());
        }
    }
    below.sort();
    below.iter().find_map(|folder| find(folder, name))
}

/// The C compiler's folder of `stddef.h` and the like, if it names one.
fn headers() -> Result<Option<PathBuf>, ProvisionError> {
    let compiler = env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let said = output(Command::new(compiler).arg("-print-file-name=include"))?;
    let folder = PathBuf::from(String::from_utf8_lossy(&said.stdout).trim());
    Ok((folder.is_absolute() && folder.is_dir()).then_some(folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_is_found_wherever_the_wheel_has_it() {
        let place = tempfile::tempdir().unwrap();
        let deep = place.path().join("lib").join("clang").join("native");
        fs::create_dir_all(&deep).unwrap();
        assert_eq!(find(place.path(), "libclang"), None);
        fs::write(deep.join("libclang.so"), "").unwrap();
        fs::write(place.path().join("libclang.txt"), "").unwrap();
        assert_eq!(find(place.path(), "libclang"), Some(deep));
    }

    #[test]
    fn what_was_fetched_for_other_versions_is_not_complete() {
        let place = tempfile::tempdir().unwrap();
        assert!(!is_complete(place.path(), &WHEELS));
        fs::write(place.path().join(COMPLETE), "cmake==1").unwrap();
        assert!(!is_complete(place.path(), &WHEELS));
        fs::write(place.path().join(COMPLETE), WHEELS.join("\n")).unwrap();
        assert!(is_complete(place.path(), &WHEELS));
    }

    #[cfg(unix)]
    #[test]
    fn tools_that_have_lost_their_interpreter_do_not_start() {
        use std::os::unix::fs::PermissionsExt;
        let place = tempfile::tempdir().unwrap();
        let bin = place.path().join("bin");
        fs::create_dir(&bin).unwrap();
        let put = |interpreter: &str| {
            for program in ["cmake", "ninja"] {
                let path = bin.join(program);
                fs::write(&path, format!("#!{interpreter}\n")).unwrap();
                fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
            }
        };
        assert!(!starts(place.path()));
        put("/bin/sh");
        assert!(starts(place.path()));
        put("/no/such/place/python3");
        assert!(!starts(place.path()));
    }

    #[test]
    fn a_build_gets_the_places_of_all_tools() {
        let place = tempfile::tempdir().unwrap();
        let tools = Tools {
            programs: place.path().join("bin"),
            libclang: place.path().join("clang"),
            headers: place.path().join("include"),
        };
        let mut command = Command::new("cargo");
        tools.apply(&mut command);
        let variable = |name: &str| {
            let found = command.get_envs().find(|(key, _)| *key == name);
            found.and_then(|(_, value)| value).unwrap().to_string_lossy().into_owned()
        };
        assert!(variable("PATH").starts_with(&tools.programs.display().to_string()));
        assert_eq!(variable("LIBCLANG_PATH"), tools.libclang.display().to_string());
        assert_eq!(variable("BINDGEN_EXTRA_CLANG_ARGS"), format!("-I{}", tools.headers.display()));
    }

    #[test]
    fn the_compiler_names_its_headers() {
        assert!(headers().unwrap().unwrap().join("stddef.h").is_file());
    }
}
