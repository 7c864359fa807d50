//! Faults and surprises of released codes, each with a reproduction that runs here: `docs/found.md` is written from what it printed.

use std::fmt::Write as _;
use std::fs;
use std::process::Command;

use serde::Deserialize;

use crate::common::{folder, source, told, write};

/// One of them, as its file in `tests/found` has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Finding {
    title: String,
    /// Of Python or Debian.
    package: String,
    /// Is it documented or meant?
    #[serde(default)]
    choice: bool,
    /// The release that has it, where that of Debian 12 does not.
    elsewhere: Option<String>,
    /// What happens.
    what: String,
    /// Who meets it.
    seen: String,
    /// How `faceoff hunt` found it, where it did.
    hunt: Option<String>,
    /// How the right value is known.
    known: String,
    /// What faceoff does about it.
    faceoff: String,
    /// The right value, where the script ends before it could print it.
    right: Option<String>,
    script: String,
}

/// What came of a script.
struct Came {
    release: String,
    gives: String,
    right: String,
}

impl Finding {
    fn is_freefem(&self) -> bool {
        self.package == "freefem++"
    }

    /// Packages of Debian run with the system's Python.
    fn python(&self) -> std::path::PathBuf {
        match self.package.starts_with("fenics-") || self.package.starts_with("python3-") {
            true => "/usr/bin/python3".into(),
            false => source("target/python/bin/python3"),
        }
    }

    /// As the package says.
    fn release(&self) -> String {
        let mut command = match self.is_freefem() || self.package.starts_with("python3-") {
            true => Command::new("dpkg-query"),
            false => Command::new(self.python()),
        };
        match self.is_freefem() || self.package.starts_with("python3-") {
            true => command.args(["-W", "-f", "${Version}", &self.package]),
            false => command.args([
                "-c",
                "import sys, importlib.metadata; print(importlib.metadata.version(sys.argv[1]))",
                &self.package,
            ]),
        };
        let ran = told(command.output().unwrap());
        assert_eq!(ran.code, Some(0), "{}: {}", self.package, ran.stderr);
        ran.stdout.trim().to_owned()
    }

    /// Runs the script in a folder of its own.
    fn run(&self) -> Came {
        let folder = folder();
        let at = folder.path();
        let (name, mut command) = match self.is_freefem() {
            true => {
                let mut command = Command::new("FreeFem++-nw");
                command.args(["-v", "0", "-ne"]);
                ("found.edp", command)
            }
            false => ("found.py", Command::new(self.python())),
        };
        write(at, name, self.script.trim_start());
        command.arg(name).current_dir(at);
        let ran = told(command.output().unwrap());
        let line = |start: &str| {
            let mut lines = ran.stdout.lines();
            lines.find_map(|line| Some(line.strip_prefix(start)?.trim().to_owned()))
        };
        let last = ran.stderr.lines().rfind(|line| !line.trim().is_empty());
        let failed = match (ran.code, last) {
            (None, _) => "a crash".to_owned(),
            (_, last) => {
                let words = last.unwrap_or("nothing");
                let kind = words.split(':').next().unwrap_or(words);
                format!("`{}`", kind.rsplit('.').next().unwrap_or(kind))
            }
        };
        let right = self.right.clone().or_else(|| line("right "));
        Came {
            release: self.release(),
            gives: line("gives ").unwrap_or(failed),
            right: right.unwrap_or_else(|| panic!("{}: {}{}", self.title, ran.stdout, ran.stderr)),
        }
    }
}

/// Does the number, or the word, differ?
fn differs(came: &Came) -> bool {
    match [&came.gives, &came.right].map(|text| text.parse::<f64>()) {
        [Ok(a), Ok(b)] => !((a - b).abs() <= 1e-9 * a.abs().max(b.abs())),
        _ => came.gives != came.right,
    }
}

/// A page without releases and printed values, which may change while a fault stays.
fn without_releases(page: &str) -> String {
    let line = |line: &str| match line.split_once("; right is ") {
        Some((_, right)) if line.starts_with("- Prints ") => right.to_owned(),
        _ => match line.split_once(": ") {
            Some((head, rest)) if head.split(' ').count() == 2 && !head.starts_with('-') => {
                format!("{}: {rest}", head.split(' ').next().unwrap_or_default())
            }
            _ => line.to_owned(),
        },
    };
    page.lines().map(|of| line(of) + "\n").collect()
}

/// The page has what each script prints with the installed releases, and says of a fault that is gone that it is.
/// `FACEOFF_WRITE=1 cargo test --workspace --test all found::` writes it again.
#[test]
fn the_page_has_what_the_installed_releases_do() {
    let mut files: Vec<_> = fs::read_dir(source("tests/found"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    assert!(files.len() >= 12, "{}", files.len());
    let mut text = String::from(
        "# What was found\n\nFaults and surprises of released codes that came up while faceoff was built, each with a script that needs only that code.\n\
         `tests/found.rs` runs them and writes this page. No code is free of faults, and those here are named so that nobody has to find them\n\
         again; what is documented or meant is called a choice.\n",
    );
    for file in files {
        let found = fs::read_to_string(&file).unwrap();
        let found: Finding =
            toml::from_str(&found).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let count = found.script.trim().lines().count();
        assert!(count <= 15, "{}: {count} lines", found.title);
        let came = found.run();
        let state = match (differs(&came), found.choice, &found.elsewhere) {
            (true, true, _) => "a choice".to_owned(),
            (true, false, _) => "a fault".to_owned(),
            (false, _, Some(release)) => format!("right, but a fault of {release}"),
            (false, _, None) => "gone".to_owned(),
        };
        let hunt = found.hunt.as_ref();
        let hunt = hunt.map(|how| format!("- Found by the hunt: {how}\n"));
        let language = if found.is_freefem() { "cpp" } else { "python" };
        write!(
            text,
            "\n## {}\n\n{} {}: {state}. {}\n\n- Met by: {}\n{}- Prints {}; right is {}. {}\n- faceoff: {}\n\n```{language}\n{}\n```\n",
            found.title,
            found.package,
            came.release,
            found.what,
            found.seen,
            hunt.unwrap_or_default(),
            came.gives,
            came.right,
            found.known,
            found.faceoff,
            found.script.trim()
        )
        .unwrap();
    }
    let page = source("docs/found.md");
    if std::env::var_os("FACEOFF_WRITE").is_some() {
        fs::write(&page, &text).unwrap();
    }
    let kept = fs::read_to_string(&page).unwrap();
    assert!(
        without_releases(&kept) == without_releases(&text),
        "docs/found.md is not what the scripts print: write it again by FACEOFF_WRITE=1\n{text}"
    );
}
