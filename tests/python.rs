//! The Python package: its wheel is built and installed into environments of their own, where its tests run: with scikit-fem
//! alone, with Debian's dolfinx and GetFEM, and with what else is on PyPI.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::source;

/// An environment: its folder below `target`, whether it sees Debian's packages, what is installed into it, and the tests that
/// it runs. One is that of `tests/requirements.txt`, which `tests/run` makes.
type Environment = (
    &'static str,
    bool,
    &'static [&'static str],
    &'static [&'static str],
);

const ENVIRONMENTS: [Environment; 3] = [
    (
        "python-skfem",
        false,
        &["pytest", "scikit-fem"],
        &[
            "test_skfem.py",
            "test_systems.py",
            "test_every_dof.py",
            "test_docs.py",
        ],
    ),
    (
        "python-debian",
        true,
        &["pytest", "nbclient", "ipykernel"],
        &[
            "test_dolfinx.py",
            "test_getfem.py",
            "test_systems.py",
            "test_every_dof.py",
            "test_docs.py",
            "test_notebook.py",
        ],
    ),
    (
        "python",
        false,
        &[],
        &[
            "test_compare.py",
            "test_program.py",
            "test_plugin.py",
            "test_meshes.py",
            "test_ngsolve.py",
            "test_systems.py",
            "test_every_dof.py",
            "test_stubs.py",
            "test_docs.py",
            // It has an environment of its own.
            "-k not skfem",
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

fn pip(python: &Path) -> Command {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "--quiet", "--disable-pip-version-check"]);
    pip
}

/// The Python of an environment, which is made where it is not there or where its packages have changed.
fn environment(name: &str, debian: bool, packages: &[&str]) -> PathBuf {
    let folder = source("target").join(name);
    let python = folder.join("bin/python3");
    let (of, wanted) = (folder.join("packages.txt"), packages.join("\n"));
    if packages.is_empty() || fs::read_to_string(&of).is_ok_and(|has| has == wanted) {
        return python;
    }
    let mut venv = Command::new("/usr/bin/python3");
    venv.args(["-m", "venv", "--clear"]);
    if debian {
        venv.arg("--system-site-packages");
    }
    run(venv.arg(&folder));
    // Most modules are never imported.
    run(pip(&python)
        .args(["install", "--no-compile"])
        .args(packages));
    fs::write(of, wanted).expect("the list is kept");
    python
}

/// Of the profile that the tests have, so that its crates are built once.
fn wheel() -> PathBuf {
    let wheels = source("target/wheels");
    let _ = fs::remove_dir_all(&wheels);
    run(Command::new(source("target/python/bin/python3"))
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
    let wheels = wheel.parent().expect("the folder of wheels");
    std::thread::scope(|scope| {
        for (name, debian, packages, tests) in ENVIRONMENTS {
            let wheel = &wheel;
            scope.spawn(move || {
                let python = environment(name, debian, packages);
                // A wheel with the number of the one before would be thought installed.
                run(pip(&python).args(["uninstall", "--yes", "faceoff-fem"]));
                run(pip(&python).arg("install").arg(wheel));
                let folder = source("python/tests");
                // Elsewhere, since Python looks for packages beside what it runs.
                run(Command::new(python)
                    .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
                    .args(tests.iter().map(|test| match test.starts_with('-') {
                        true => PathBuf::from(test),
                        false => folder.join(test),
                    }))
                    .current_dir(wheels));
            });
        }
    });
}

#[test]
fn every_test_of_the_package_has_an_environment() {
    let of_environments: Vec<&str> = ENVIRONMENTS.iter().flat_map(|e| e.3).copied().collect();
    let mut count = 0;
    for entry in fs::read_dir(source("python/tests")).expect("the tests") {
        let name = entry.expect("a file").file_name();
        let name = name.to_str().expect("UTF-8");
        if name.starts_with("test_") {
            count += 1;
            assert!(of_environments.contains(&name), "{name} runs nowhere");
        }
    }
    assert!(count > 10, "{count}");
}
