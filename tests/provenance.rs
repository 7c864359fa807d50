//! Whose answer it is, and of which run: a code counts by what it wrote into its own folder, and a kept answer as long as all that it
//! depends on is what it was.

use std::fs;
use std::path::Path;

use crate::common::{Ran, faceoff, folder, run, source, told, write};

/// A face-off of codes with these commands, and more keys of each.
fn face_off(at: &Path, codes: &[(&str, &str, &str)]) {
    let code = |(name, command, more): &(&str, &str, &str)| {
        format!("[codes.{name}]\ncommand = {command}\n{more}\n")
    };
    let codes: String = codes.iter().map(code).collect();
    let text = format!("name = \"x\"\n{codes}[fields.u]\nsame = \"discretisation\"\nrtol = 1e-3\n");
    write(at, "x.toml", &text);
}

fn verify(at: &Path, words: &[&str]) -> Ran {
    run(at, &[&["verify", "--run", "x.toml"], words].concat())
}

const U: &str = "result = \"u.csv\"";
const VALUES: &str = "vertex,u\n0,1\n1,2\n";

/// Neither what another code wrote, nor what lay there before, whenever it is dated.
#[test]
fn a_code_cannot_pass_with_a_file_that_it_did_not_write() {
    let folder = folder();
    let at = folder.path();
    write(at, "u.csv", VALUES);
    let later = std::time::SystemTime::now() + std::time::Duration::from_secs(86400);
    fs::File::open(at.join("u.csv"))
        .unwrap()
        .set_modified(later)
        .unwrap();
    let honest = r#"["cp", "u.csv", "{out}/u.csv"]"#;
    let shared = r#"["sh", "-c", "cp u.csv v.csv"]"#;
    for (first, second) in [
        (r#"["true", "a"]"#, r#"["true"]"#),
        (honest, r#"["true"]"#),
        (shared, r#"["sh", "-c", "exit 0"]"#),
        (honest, r#"["cp", "u.csv", "{{out}/u.csv"]"#),
    ] {
        face_off(at, &[("a", first, U), ("b", second, U)]);
        let ran = verify(at, &[]);
        assert_eq!(ran.code, Some(2), "{second}: {}{}", ran.stdout, ran.stderr);
        let said = "its command does not say where its results go";
        assert!(ran.stderr.contains(said), "{second}: {}", ran.stderr);
    }
    // A folder of its own is empty when it begins, and stays its own.
    let link = r#"["sh", "-c", "rmdir $0 && ln -s $PWD $0", "{out}"]"#;
    for (second, said) in [
        (
            r#"["true", "{out}"]"#,
            "has not written u.csv, nor anything else",
        ),
        (link, "has put something else where its folder {out} was"),
    ] {
        face_off(at, &[("a", honest, U), ("b", second, U)]);
        for words in [&[][..], &["--keep", "runs"], &["--keep", "runs"]] {
            let ran = verify(at, words);
            let told = format!("{}{}", ran.stdout, ran.stderr);
            assert!(
                ran.code == Some(2) && told.contains(said),
                "{second}: {told}"
            );
        }
    }
}

/// What a run that goes on must see: each change makes the answer of the code another one.
#[test]
fn a_kept_answer_counts_as_long_as_its_program_is_what_it_was() {
    let folder = folder();
    let at = folder.path();
    for inner in ["x", "x/lib", "shared", "bin"] {
        fs::create_dir(at.join(inner)).unwrap();
    }
    let home = at.join("x");
    write(&home, "u.csv", VALUES);
    write(&home, "w.csv", "vertex,u\n0,1\n1,2.5\n");
    let sh = |file: &str| format!("#!/bin/sh\ncp {file} $1/u.csv\n");
    let program = |path: &str, file: &str| {
        write(at, path, &sh(file));
        let done = std::process::Command::new("chmod")
            .arg("+x")
            .arg(at.join(path))
            .status();
        assert!(done.unwrap().success());
    };
    let python =
        |file: &str| format!("import shutil, sys\nshutil.copy('{file}', sys.argv[1] + '/u.csv')\n");
    let copy = r#"["cp", "u.csv", "{out}/u.csv"]"#;
    write(
        &home,
        "main.py",
        "import sys\nsys.path.insert(0, 'lib')\nimport core\n",
    );
    for (command, changed) in [
        (r#"["./solver", "{out}"]"#, "x/solver"),
        (r#"["sh", "../shared/solve", "{out}"]"#, "shared/solve"),
        (
            r#"["sh", "-c", "sh ../shared/solve $0", "{out}"]"#,
            "shared/solve",
        ),
        (r#"["../bin/solver", "{out}"]"#, "bin/solver"),
        (
            r#"["/usr/bin/python3", "-B", "main.py", "{out}"]"#,
            "x/lib/core.py",
        ),
        (
            r#"["/usr/bin/python3", "-B", "../shared/outside.py", "{out}"]"#,
            "shared/part.py",
        ),
        (r#"["cp", "data/v.csv", "{out}/u.csv"]"#, "x/data/v.csv"),
    ] {
        write(at, "shared/outside.py", "import part\n");
        let write_as = |file: &str| match changed {
            _ if changed.ends_with(".py") => {
                write(at, changed, &python(file));
            }
            _ if changed.ends_with(".csv") => {
                fs::create_dir_all(home.join("data")).unwrap();
                fs::copy(home.join(file), at.join(changed)).unwrap();
            }
            _ => program(changed, file),
        };
        write_as("u.csv");
        face_off(&home, &[("a", command, U), ("b", copy, U)]);
        for _ in 0..2 {
            let ran = verify(&home, &["--resume", "../kept"]);
            assert_eq!(ran.code, Some(0), "{command}: {}{}", ran.stdout, ran.stderr);
        }
        write_as("w.csv");
        let ran = verify(&home, &["--resume", "../kept"]);
        assert_eq!(ran.code, Some(2), "{command}: {}{}", ran.stdout, ran.stderr);
        let name = changed.rsplit('/').next().unwrap();
        assert!(ran.stderr.contains(name), "{command}: {}", ran.stderr);
        assert_eq!(verify(&home, &[]).code, Some(1), "{command}");
        fs::remove_dir_all(at.join("kept")).unwrap();
    }
}

/// Its program lies where nobody here can look at it.
#[test]
fn an_answer_from_another_system_is_not_kept() {
    let folder = folder();
    let engine = "name = \"there\"\ncommand = [\"true\"]\nwithin = [\"env\", \"--chdir={job}\"]\n";
    write(folder.path(), "there.toml", engine);
    let words = "verify one-zone --n 4 --engines rust,there.toml --resume kept";
    let ran = run(folder.path(), &words.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    let told = "nobody can tell what its answer depends on; run it without --resume";
    assert!(ran.stderr.contains(told), "{}", ran.stderr);
}

/// What was kept of a record is not what another record holds.
#[test]
fn a_kept_answer_of_a_record_counts_as_long_as_the_record_is_what_it_was() {
    let folder = folder();
    let at = folder.path();
    let verify = |more: &str| {
        let words = format!("verify one-zone --n 4 --methods cr {more}");
        run(at, &words.split(' ').collect::<Vec<_>>())
    };
    assert_eq!(verify("--engines rust,freefem --record r").code, Some(0));
    for _ in 0..2 {
        let ran = verify("--against r --resume kept");
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    }
    let path = at.join("r/baseline.json");
    let text = fs::read_to_string(&path).unwrap();
    let other = text.replace("\"converged\": true", "\"converged\": false");
    assert_ne!(other, text);
    fs::write(&path, other).unwrap();
    let ran = verify("--against r --resume kept");
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(ran.stderr.contains("record was"), "{}", ran.stderr);
}

/// A newer release of the code that a script imports gives another answer.
#[test]
fn a_kept_answer_of_a_form_counts_as_long_as_the_module_is_what_it_was() {
    let folder = folder();
    let at = folder.path();
    fs::create_dir(at.join("modules")).unwrap();
    let sh = |line: &str| {
        let done = std::process::Command::new("sh")
            .args(["-c", line])
            .current_dir(at)
            .status();
        assert!(done.unwrap().success(), "{line}");
    };
    sh(
        "cp -rL \"$(/usr/bin/python3 -c 'import os, getfem; print(os.path.dirname(getfem.__file__))')\" modules",
    );
    let python =
        "#!/bin/sh\nPYTHONPATH=\"$(dirname \"$0\")/modules\" exec /usr/bin/python3 \"$@\"\n";
    write(at, "python3", python);
    sh("chmod +x python3");
    let form = source("examples/forms/poisson.toml");
    let verify = || {
        let mut command = faceoff(at);
        command.arg("verify").arg(&form);
        command.args(["--engines", "rust,getfem", "--n", "4", "--resume", "kept"]);
        told(
            command
                .env("FACEOFF_PYTHON", at.join("python3"))
                .output()
                .unwrap(),
        )
    };
    for _ in 0..2 {
        let ran = verify();
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    }
    sh("echo '# newer' >> modules/getfem/__init__.py");
    let ran = verify();
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(
        ran.stderr.contains("of getfem: n = 4, module was"),
        "{}",
        ran.stderr
    );
}
