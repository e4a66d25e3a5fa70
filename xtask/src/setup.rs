//! The Python environment in `.venv`: libclang, which building the master needs, and FMPy with pytest for the
//! tests.
//!
//! It is made once, and again when the list of packages or the Python version changes.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{Outcome, portable, process, root};

/// What the set-up provides.
pub struct Tools {
    /// The environment's Python.
    pub python: PathBuf,
    libclang: PathBuf,
    compiler_headers: PathBuf,
}

impl Tools {
    /// Lets a cargo command build the `fmi` crate.
    pub fn apply<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        for (name, value) in self.variables() {
            command.env(name, value);
        }
        command
    }

    /// The same variables as lines for a shell.
    pub fn shell_lines(&self) -> String {
        self.variables().iter().map(|(name, value)| format!("export {name}='{value}'\n")).collect()
    }

    fn variables(&self) -> [(&'static str, String); 2] {
        let headers = format!("-I{}", self.compiler_headers.display());
        [("LIBCLANG_PATH", self.libclang.display().to_string()), ("BINDGEN_EXTRA_CLANG_ARGS", headers)]
    }
}

/// The linker for libraries that older systems load, and cargo's way to it.
pub struct Zig {
    command: PathBuf,
    zig: PathBuf,
}

impl Zig {
    /// A cargo command that builds for `portable::TARGET` with the C library of `portable::GLIBC`.
    pub fn cargo(&self, arguments: &[&str]) -> Command {
        let [major, minor] = portable::GLIBC;
        self.cargo_for(&format!("{}.{major}.{minor}", portable::TARGET), arguments)
    }

    /// A cargo command that builds for a target with zig as its linker.
    pub fn cargo_for(&self, target: &str, arguments: &[&str]) -> Command {
        let mut command = process::in_repository(Command::new(&self.command));
        command.args(arguments).args(["--target", target]);
        command.env("CARGO_ZIGBUILD_ZIG_PATH", &self.zig);
        command
    }

    /// Compiles a C file for a target that zig knows.
    ///
    /// # Errors
    /// What the compiler says.
    pub fn compile_c(&self, target: &str, source: &Path, arguments: &[&str], output: &Path) -> Outcome {
        let mut command = Command::new(&self.zig);
        command.args(["cc", "-target", target, "-O1", "-Wall", "-Werror"]).arg(source).args(arguments);
        process::run_quietly(command.arg("-o").arg(output))
    }
}

/// Adds zig and cargo-zigbuild to the environment (100 MB, so only where they are asked for).
///
/// # Errors
/// As `prepare`, and on systems other than Linux.
pub fn prepare_zig() -> Outcome<Zig> {
    if !cfg!(target_os = "linux") {
        return Err("--portable and --windows are for Linux; elsewhere `cargo xtask package` does it".into());
    }
    let tools = prepare()?;
    let requirements = root().join("xtask/portable-requirements.txt");
    let wanted = process::read(&requirements)?;
    let stamp = root().join(".venv/swarf-portable-stamp.txt");
    if std::fs::read_to_string(&stamp).is_ok_and(|text| text != wanted) || !stamp.is_file() {
        eprintln!("xtask: fetching zig and cargo-zigbuild from PyPI (once; 100 MB)");
        install(&tools.python, &requirements)?;
        process::write(&stamp, wanted.as_bytes())?;
    }
    let program = "import os, ziglang; print(os.path.join(os.path.dirname(ziglang.__file__), 'zig'))";
    let zig = process::output(Command::new(&tools.python).args(["-c", program]))?;
    Ok(Zig { command: root().join(".venv/bin/cargo-zigbuild"), zig: PathBuf::from(zig.trim()) })
}

/// Installs a list of packages. It pins every package, so pip has nothing to add.
fn install(python: &Path, requirements: &Path) -> Outcome {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]);
    pip.args(["--only-binary", ":all:", "--requirement"]).arg(requirements);
    process::run_quietly(&mut pip).map_err(|text| {
        format!(
            "{text}\npip could not fetch the packages of '{}'; is PyPI reachable?",
            requirements.display()
        )
    })
}

/// Makes the environment where it is missing or stale.
///
/// # Errors
/// Says which program or network access is missing, and what to install.
pub fn prepare() -> Outcome<Tools> {
    let compiler_headers = compiler_headers()?;
    let requirements = root().join("fmpy_tests/requirements.txt");
    let wanted = process::read(&requirements)?;
    let venv = root().join(".venv");
    let stamp = venv.join("swarf-stamp.txt");
    let python = if cfg!(windows) { venv.join("Scripts/python.exe") } else { venv.join("bin/python") };
    // The stamp names the folder too: an environment does not survive being moved.
    let mark = format!("{}\n{wanted}", venv.display());
    let is_current = std::fs::read_to_string(&stamp).is_ok_and(|text| text == mark) && runs(&python);
    if !is_current {
        let base = base_python()?;
        eprintln!("xtask: setting up Python packages in '{}' (once; needs the network)", venv.display());
        let _ = std::fs::remove_file(&stamp);
        process::run_quietly(Command::new(&base).args(["-m", "venv", "--clear"]).arg(&venv)).map_err(
            |text| {
                format!(
                    "{text}\nPython's venv module is missing or broken; on Debian or Ubuntu: apt-get install \
                python3-venv"
                )
            },
        )?;
        install(&python, &requirements)?;
        process::write(&stamp, mark.as_bytes())?;
    }
    let libclang = libclang(&python)?;
    Ok(Tools { python, libclang, compiler_headers })
}

/// The first Python of at least 3.9 among `PYTHON`, python3 and python.
fn base_python() -> Outcome<String> {
    let named = std::env::var("PYTHON").ok();
    let candidates = named.into_iter().chain(["python3".to_string(), "python".to_string()]);
    let mut found = Vec::new();
    for candidate in candidates {
        let mut command = Command::new(&candidate);
        let output = command.args(["-c", "import sys; print('%d.%d' % sys.version_info[:2])"]).output();
        let Ok(output) = output else { continue };
        let version = String::from_utf8_lossy(&output.stdout).trim().to_string();
        let parts: Vec<u32> = version.split('.').filter_map(|part| part.parse().ok()).collect();
        if parts.as_slice() >= [3, 9].as_slice() {
            return Ok(candidate);
        }
        found.push(format!("{candidate} is {version}"));
    }
    let found = if found.is_empty() { "none was found".into() } else { found.join(", ") };
    Err(format!(
        "Python 3.9 or newer is needed, but {found}; install it with its venv module \
         (Debian or Ubuntu: apt-get install python3 python3-venv), or name one in the variable PYTHON"
    ))
}

/// The folder of the C compiler's own headers, which libclang's wheel lacks.
fn compiler_headers() -> Outcome<PathBuf> {
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let output = Command::new(&compiler).arg("-print-file-name=include").output();
    let path = output.ok().map(|o| PathBuf::from(String::from_utf8_lossy(&o.stdout).trim()));
    match path {
        Some(path) if path.join("stddef.h").is_file() => Ok(path),
        _ => Err(format!(
            "no C compiler: '{compiler} -print-file-name=include' gave no folder with stddef.h; install one \
             (Debian or Ubuntu: apt-get install gcc libc6-dev), or name one in the variable CC"
        )),
    }
}

/// The folder of libclang: the user's own, or the environment's.
fn libclang(python: &Path) -> Outcome<PathBuf> {
    if let Some(path) = std::env::var_os("LIBCLANG_PATH") {
        return Ok(path.into());
    }
    let program = "import clang.native, os; print(os.path.dirname(clang.native.__file__))";
    let path = process::output(Command::new(python).args(["-c", program]))?;
    Ok(PathBuf::from(path.trim()))
}

fn runs(python: &Path) -> bool {
    Command::new(python).args(["-c", "pass"]).output().is_ok_and(|output| output.status.success())
}
