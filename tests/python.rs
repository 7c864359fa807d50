//! The Python package: its wheel is built and installed into environments of their own, where its tests run: with scikit-fem
//! alone, with Debian's dolfinx and GetFEM, and with what else is on PyPI.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::source;

/// An environment: its name, whether it sees Debian's packages, what is installed into it, and the tests that it runs.
type Environment = (
    &'static str,
    bool,
    &'static [&'static str],
    &'static [&'static str],
);

const ENVIRONMENTS: [Environment; 3] = [
    (
        "skfem",
        false,
        &["scikit-fem"],
        &["test_skfem.py", "test_every_dof.py", "test_docs.py"],
    ),
    (
        "debian",
        true,
        &["nbclient", "ipykernel"],
        &[
            "test_dolfinx.py",
            "test_getfem.py",
            "test_every_dof.py",
            "test_docs.py",
            "test_notebook.py",
        ],
    ),
    (
        "others",
        false,
        &[
            "ngsolve",
            "meshio",
            "pyvista",
            "pandas",
            "polars",
            "pytest-xdist",
            "mypy",
        ],
        &[
            "test_compare.py",
            "test_program.py",
            "test_plugin.py",
            "test_meshes.py",
            "test_ngsolve.py",
            "test_every_dof.py",
            "test_stubs.py",
            "test_docs.py",
        ],
    ),
];

/// Runs a program, whose output is shown where it fails.
fn run(command: &mut Command) {
    let done = command.output().expect("it starts");
    let said = [&done.stdout[..], &done.stderr].map(String::from_utf8_lossy);
    assert!(
        done.status.success(),
        "{command:?}\n{}\n{}",
        said[0],
        said[1]
    );
}

fn environment(name: &str, debian: bool, packages: &[&str]) -> PathBuf {
    // A name that no package has, since Python looks for packages beside it.
    let folder = source("target/python").join(format!("of-{name}"));
    let mut venv = Command::new("/usr/bin/python3");
    venv.args(["-m", "venv", "--clear"]);
    if debian {
        venv.arg("--system-site-packages");
    }
    run(venv.arg(&folder));
    let python = folder.join("bin/python3");
    let install = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        // Most modules of VTK and NGSolve are never imported.
        "--no-compile",
    ];
    run(Command::new(&python).args(install).args(packages));
    python
}

/// Of the profile that the tests have, so that its crates are built once.
fn wheel() -> PathBuf {
    let python = environment("tools", false, &["maturin"]);
    let wheels = source("target/python/wheels");
    let _ = std::fs::remove_dir_all(&wheels);
    run(Command::new(&python)
        // tests/run sets it to print times; with it cargo would compile everything again.
        .env_remove("RUSTC_BOOTSTRAP")
        .args(["-m", "maturin", "build", "--profile", "dev", "--out"])
        .arg(&wheels)
        .arg("--manifest-path")
        .arg(source("python/Cargo.toml")));
    let mut found = wheels.read_dir().expect("wheels");
    found.next().expect("a wheel").expect("a wheel").path()
}

#[test]
fn the_wheel_installs_into_clean_environments_and_passes_its_tests() {
    let wheel = wheel();
    let wheel = wheel.to_str().expect("plain letters");
    std::thread::scope(|scope| {
        for (name, debian, packages, tests) in ENVIRONMENTS {
            scope.spawn(move || {
                let packages = [packages, &["pytest", wheel]].concat();
                let python = environment(name, debian, &packages);
                let folder = source("python/tests");
                run(Command::new(python)
                    .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
                    .args(tests.iter().map(|test| folder.join(test)))
                    .current_dir(Path::new(&source("target/python"))));
            });
        }
    });
}
