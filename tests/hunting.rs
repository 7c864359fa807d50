//! `faceoff hunt` finds what is planted in a code or library of this machine, and nothing in codes as they are.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Ran, assert_valid, faceoff, folder, source, told, write};

/// FreeFEM behind a program of the same name, which changes each script before or does something else.
fn freefem(at: &Path, does: &str) {
    let path = std::env::var("PATH").unwrap();
    let mut places = path
        .split(':')
        .map(|place| Path::new(place).join("FreeFem++-nw"));
    let real = places.find(|path| path.exists()).expect("FreeFEM is here");
    let text = format!(
        "#!/bin/sh\nfor script; do case \"$script\" in *.edp) {does};; esac; done\nexec {} \"$@\"\n",
        real.display()
    );
    let program = write(at, "bin/FreeFem++-nw", &text);
    let mut rights = fs::metadata(&program).unwrap().permissions();
    std::os::unix::fs::PermissionsExt::set_mode(&mut rights, 0o755);
    fs::set_permissions(&program, rights).unwrap();
}

fn hunt(at: &Path, words: &str) -> (Ran, Value) {
    let path = format!(
        "{}:{}",
        at.join("bin").display(),
        std::env::var("PATH").unwrap()
    );
    let words = format!("hunt {words} --json o.json --quiet");
    let ran = told(
        faceoff(at)
            .args(words.split(' '))
            .env("PATH", path)
            .output()
            .unwrap(),
    );
    let json = at.join("o.json");
    let found = fs::read_to_string(&json);
    let found = found.unwrap_or_else(|e| panic!("{e}: {}{}", ran.stdout, ran.stderr));
    assert_valid("json", "src/report/schema/hunt-1.json", &json);
    (ran, serde_json::from_str(&found).unwrap())
}

#[test]
fn planted_faults_are_found_and_made_small() {
    for (does, engines, count, kind, words) in [
        // The sign of n.
        (
            "sed -i 's/N\\.x/(-N.x)/g; s/N\\.y/(-N.y)/g' \"$script\"",
            "rust,freefem --seed 5",
            16,
            "wrong",
            "`n` pointed the other way",
        ),
        // The rule of the highest degree is one of degree 2.
        (
            "sed -i 's/qf5pT/qf2pT/g' \"$script\"",
            "rust,freefem --seed 2",
            4,
            "wrong",
            "by the rule `edges-3`",
        ),
        // A code by itself whose derivatives along x are too large.
        (
            "sed -i 's/dx(u)/(1.1*dx(u))/g; s/dx(du)/(1.1*dx(du))/g' \"$script\"",
            "freefem --seed 18",
            10,
            "moves",
            "turned",
        ),
        // The same, where the solution is known.
        (
            "sed -i 's/dx(u)/(1.1*dx(u))/g; s/dx(du)/(1.1*dx(du))/g' \"$script\"",
            "freefem --seed 10",
            2,
            "wrong",
            "a polynomial of its space solves the form",
        ),
        ("kill -SEGV $$", "rust,freefem", 1, "crashes", "SIGSEGV"),
        (
            "sleep 60",
            "rust,freefem --patience 0.5s",
            1,
            "hangs",
            "did not end within 0.5 s",
        ),
    ] {
        let folder = folder();
        let at = folder.path();
        freefem(at, does);
        let asked = format!("--engines {engines} --count {count} --out found");
        let (ran, found) = hunt(at, &asked);
        assert_eq!(ran.code, Some(1), "{does}: {}{}", ran.stdout, ran.stderr);
        let all = found["findings"].as_array().unwrap();
        assert!(
            all.iter().all(|of| of["code"] == "freefem"),
            "{does}: {all:#?}"
        );
        let is_it = |of: &&Value| of["kind"] == kind && of.to_string().contains(words);
        let one = all.iter().find(is_it);
        let one = one.unwrap_or_else(|| panic!("{does}: {all:#?}"));
        let form = one["form"].as_str().unwrap();
        assert!(form.lines().count() <= 20, "{form}");
        assert!(at.join("found/freefem-1/form.toml").exists());
        println!(
            "{does}: {} of {} findings\n{one:#}",
            all.len(),
            found["problems"]
        );
    }
}

#[test]
fn nothing_is_found_in_codes_as_they_are_and_a_hunt_goes_on() {
    let folder = folder();
    let at = folder.path();
    freefem(at, ":");
    let of = "--engines rust,freefem --seed 5";
    let (ran, whole) = hunt(at, &format!("{of} --count 20"));
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    hunt(at, &format!("{of} --count 11 --out kept"));
    let (_, rest) = hunt(at, &format!("{of} --count 20 --out kept --resume"));
    for key in [
        "problems",
        "forms",
        "agree",
        "conditioned",
        "refused",
        "findings",
    ] {
        assert_eq!(whole[key], rest[key], "{key}");
    }
    // What is there is not overwritten, and another hunt does not go on there.
    for words in [
        "--engines rust,freefem --out kept",
        "--engines rust,freefem --seed 6 --out kept --resume",
    ] {
        let words = format!("hunt {words} --count 1");
        let ran = told(faceoff(at).args(words.split(' ')).output().unwrap());
        assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    }
}

/// A Python with meshio, VTK and Gmsh, which changes the script that it runs.
fn python(at: &Path, does: &str) -> std::path::PathBuf {
    let real = source("target/python/bin/python3");
    let text = format!(
        "#!/bin/sh\n[ \"$1\" = -I ] || exec {real} \"$@\"\nexec {real} -I -c \"$(printf '%s' \"$3\" | sed '{does}')\" \"$4\" \"$5\"\n",
        real = real.display()
    );
    let program = write(at, "bin/python-of-libraries", &text);
    let mut rights = fs::metadata(&program).unwrap().permissions();
    std::os::unix::fs::PermissionsExt::set_mode(&mut rights, 0o755);
    fs::set_permissions(&program, rights).unwrap();
    program
}

#[test]
fn planted_faults_of_files_are_found_and_nothing_in_files_as_they_are() {
    for (does, words) in [
        ("", None),
        // One library reads a point in another place.
        (
            "s/list(grid.GetPoint(k))/[1.001 * x for x in grid.GetPoint(k)]/",
            Some("a point is lost"),
        ),
        (
            "s/return grid$/grid.GetPointData().Initialize(); return grid/",
            Some("is lost"),
        ),
        (
            "s/reader.Update()/os.kill(os.getpid(), 11)/",
            Some("signal"),
        ),
        ("s/reader.Update()/time.sleep(60)/", Some("hangs")),
    ] {
        let folder = folder();
        let at = folder.path();
        let program = python(at, does);
        // Seeds whose first cases show the fault. What hangs takes the time limit for each smaller case.
        let (count, seed, patience) = match words {
            None => (12, 1, "30s"),
            Some("hangs") => (3, 4, "1s"),
            Some("is lost") => (3, 9, "30s"),
            Some(_) => (3, 4, "30s"),
        };
        let asked = format!(
            "hunt --files --engines rust,vtk --count {count} --seed {seed} --patience {patience} --out found --json o.json --quiet"
        );
        let ran = told(
            faceoff(at)
                .args(asked.split(' '))
                .env("FACEOFF_PYTHON", program)
                .output()
                .unwrap(),
        );
        assert_valid("json", "src/report/schema/hunt-1.json", &at.join("o.json"));
        let found: Value =
            serde_json::from_str(&fs::read_to_string(at.join("o.json")).unwrap()).unwrap();
        let all = found["findings"].as_array().unwrap();
        match words {
            None => {
                assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
                assert!(found["agree"].as_u64().unwrap() > 0, "{found:#}");
            }
            Some(words) => {
                assert_eq!(ran.code, Some(1), "{does}: {}{}", ran.stdout, ran.stderr);
                let is_it = |of: &&Value| of["code"].as_str().unwrap().contains("vtk");
                let one = all.iter().find(is_it).unwrap_or_else(|| panic!("{all:#?}"));
                assert!(one.to_string().contains(words), "{does}: {one:#}");
                let place = format!("found/{}-1/case.json", one["code"].as_str().unwrap());
                assert!(at.join(&place).exists(), "{place}");
            }
        }
    }
}
