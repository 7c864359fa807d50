//! The README and the manual in `docs/` are true: every command is run verbatim, every link leads somewhere, and
//! the reference of commands is the help that the program prints.
//!
//! In a page, ```` ```sh ```` is run in a separate folder, which contains `freefem` and `fenicsx` as in the
//! sources, and must end with exit code 0, or with the one of a comment `<!-- exit N -->` before it. ```` ```text ```` after it are lines of
//! what it prints, in which `…` stands for anything. `<!-- file: NAME -->` puts the block after it into a file. What cannot be
//! typed says `<!-- not run: WHY -->`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{assert_valid, folder, run, source, told, validated};

/// A fenced block: the comment before it, its language, and its text.
struct Block {
    comment: String,
    language: String,
    text: String,
}

fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut comment = String::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let inner: Vec<&str> = lines.by_ref().take_while(|l| *l != "```").collect();
            blocks.push(Block {
                comment: std::mem::take(&mut comment),
                language: language.to_owned(),
                text: inner.join("\n") + "\n",
            });
        } else if let Some(told) = line.strip_prefix("<!-- ") {
            comment = told.trim_end_matches(" -->").to_owned();
        } else if !line.is_empty() {
            comment.clear();
        }
    }
    blocks
}

/// Are the parts of `line` between `…` in one line of what was printed, in this order? Blanks are as good as one.
fn is_printed(line: &str, printed: &str) -> bool {
    let plain = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let parts: Vec<String> = line.split('…').map(plain).collect();
    printed.lines().map(plain).any(|printed| {
        let mut rest = &*printed;
        let mut found = parts.iter().map(|part| match rest.find(&**part) {
            Some(at) => {
                rest = &rest[at + part.len()..];
                true
            }
            None => false,
        });
        found.all(|found| found)
    })
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
        }
    }
}

/// Types a page.
fn typed(page: &str) {
    let text = fs::read_to_string(source(page)).unwrap();
    let folder = folder();
    let at = folder.path();
    for name in ["freefem", "fenicsx"] {
        copy(&source(name), &at.join(name));
    }
    let program = Path::new(env!("CARGO_BIN_EXE_faceoff")).parent().unwrap();
    let path = std::env::var("PATH").unwrap();
    let mut printed = None;
    for block in blocks(&text) {
        let Block {
            comment, language, ..
        } = &block;
        if let Some(name) = comment.strip_prefix("file: ") {
            fs::write(at.join(name), &block.text).unwrap();
        } else if language == "sh" && !comment.starts_with("not run: ") {
            let code = comment.strip_prefix("exit ").unwrap_or("0");
            assert!(comment.is_empty() || code != "0", "{page}: {comment}");
            let mut bash = Command::new("bash");
            bash.args(["-e", "-c", &block.text])
                .current_dir(at)
                .env("PATH", format!("{}:{path}", program.display()));
            // Completions and manual pages go to a home of the page's own; Python's packages of the user are not of it.
            // Compiled forms are the same for every page.
            let cache = std::env::var("XDG_CACHE_HOME")
                .unwrap_or_else(|_| std::env::var("HOME").unwrap() + "/.cache");
            bash.env("HOME", at.join("home"))
                .env("XDG_CACHE_HOME", cache)
                .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
                .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
            // Pages start mpirun as well, for which what tests/run sets for single processes is wrong.
            bash.env_remove("OMPI_MCA_ess_singleton_isolated")
                .env_remove("OMPI_MCA_orte_create_session_dirs");
            let ran = told(bash.output().unwrap());
            let all = ran.stdout + &ran.stderr;
            assert_eq!(ran.code, code.parse().ok(), "{page}: {}\n{all}", block.text);
            printed = Some(all);
        } else if language == "text"
            && let Some(printed) = printed.take()
        {
            for line in block.text.lines().filter(|line| !line.is_empty()) {
                assert!(is_printed(line, &printed), "{page}: {line}\n{printed}");
            }
        }
    }
}

/// A test for each page that has commands, by which they are run side by side.
macro_rules! pages {
    ($($name:ident: $page:literal)*) => {
        /// All pages that are typed.
        const TYPED: &[&str] = &[$($page),*];
        mod pages {
            $(#[test] fn $name() { super::typed($page); })*
        }
    };
}

pages! {
    hunt: "docs/theory/hunt.md"
    readme: "README.md"
    tour: "docs/tour.md"
    install: "docs/install.md"
    freefem: "docs/tutorials/freefem.md"
    dolfinx: "docs/tutorials/dolfinx.md"
    analyst: "docs/tutorials/analyst.md"
    pipelines: "docs/tutorials/pipelines.md"
    compare: "docs/how-to/compare.md"
    tolerances: "docs/how-to/tolerances.md"
    meshes: "docs/how-to/meshes.md"
    baselines: "docs/how-to/baselines.md"
    engine: "docs/how-to/engine.md"
    matrix: "docs/how-to/matrix.md"
    hunting: "docs/how-to/hunt.md"
    accuracy: "docs/how-to/accuracy.md"
    costs: "docs/how-to/costs.md"
    clusters: "docs/how-to/clusters.md"
    environment: "docs/reference/environment.md"
    scenes: "docs/reference/scenes.md"
    face_off: "docs/reference/face-off.md"
    form: "docs/reference/form.md"
    formats: "docs/reference/formats.md"
    speed: "docs/reference/speed.md"
    methods: "docs/theory/methods.md"
    paper: "docs/paper.md"
    python: "docs/python.md"
    systems: "docs/how-to/systems.md"
    untrusted: "docs/how-to/untrusted.md"
}

fn markdown(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let (folders, files): (Vec<_>, Vec<_>) = entries.partition(|path| path.is_dir());
    let files = files
        .into_iter()
        .filter(|p| p.extension().is_some_and(|e| e == "md"));
    files
        .chain(folders.iter().flat_map(|f| markdown(f)))
        .collect()
}

fn name(path: &Path) -> String {
    let path = path.strip_prefix(source("")).unwrap();
    path.to_string_lossy().into_owned()
}

/// What a heading is called in a link, as GitHub and mdBook do.
fn anchors(page: &str) -> BTreeSet<String> {
    let headings = page.lines().filter(|line| line.starts_with('#'));
    let kept = |c: char| c.is_alphanumeric() || "-_ ".contains(c);
    let anchor = |line: &str| -> String {
        let words = line.trim_start_matches('#').trim().to_lowercase();
        words
            .chars()
            .filter(|c| kept(*c))
            .collect::<String>()
            .replace(' ', "-")
    };
    headings.map(anchor).collect()
}

/// The targets of `[…](target)` outside of code.
fn links(page: &str) -> Vec<String> {
    let mut is_code = false;
    let mut found = Vec::new();
    for line in page.lines() {
        is_code ^= line.starts_with("```");
        for part in line.split("](").skip(1).filter(|_| !is_code) {
            if let Some((target, _)) = part.split_once(')') {
                found.push(target.to_owned());
            }
        }
    }
    found
}

#[test]
fn every_page_is_typed_and_every_link_leads_somewhere() {
    let manual = markdown(&source("docs"));
    let further = [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "CHANGELOG.md",
    ];
    let further = further.iter().map(|name| source(name));
    let summary = fs::read_to_string(source("docs/SUMMARY.md")).unwrap();
    let mut faults = Vec::new();
    for path in manual.iter().cloned().chain(further) {
        let page = fs::read_to_string(&path).unwrap();
        let here = name(&path);
        let is_manual = here.starts_with("docs/");
        let commands = blocks(&page).iter().any(|block| block.language == "sh");
        if commands && is_manual && !TYPED.contains(&&*here) {
            faults.push(format!("{here} has commands that nobody types"));
        }
        let of_manual = here.strip_prefix("docs/").unwrap_or_default();
        if is_manual && of_manual != "SUMMARY.md" && !summary.contains(&format!("({of_manual})")) {
            faults.push(format!("{here} is not in docs/SUMMARY.md"));
        }
        for link in links(&page) {
            if link.contains("://") {
                continue;
            }
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => path.clone(),
                _ => path.parent().unwrap().join(file),
            };
            // The book holds the manual alone.
            let leaves = is_manual
                && !target
                    .canonicalize()
                    .is_ok_and(|t| t.starts_with(source("docs").canonicalize().unwrap()));
            if !target.exists() || leaves {
                faults.push(format!("{here}: {link} leads nowhere"));
            } else if !anchor.is_empty()
                && !anchors(&fs::read_to_string(&target).unwrap()).contains(anchor)
            {
                faults.push(format!("{here}: {link} is no heading there"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The help of a command and of those below it.
fn helps(words: &[&str], text: &mut String) {
    let at = folder();
    let help: Vec<&str> = words.iter().copied().chain(["--help"]).collect();
    let ran = run(at.path(), &help);
    assert_eq!(ran.code, Some(0), "{help:?}");
    let title = std::iter::once("faceoff").chain(words.iter().copied());
    let title: Vec<&str> = title.collect();
    let depth = "#".repeat(words.len().max(1) + 1);
    let lines: Vec<&str> = ran.stdout.lines().map(str::trim_end).collect();
    *text += &format!(
        "\n{depth} {}\n\n```text\n{}\n```\n",
        title.join(" "),
        lines.join("\n").trim_end()
    );
    for line in ["Commands:", "More:"].iter().flat_map(|heading| {
        let below = lines.iter().skip_while(move |line| *line != heading);
        below.skip(1).take_while(|line| !line.is_empty())
    }) {
        let is_name = line.starts_with("  ") && !line.starts_with("   ");
        let name = line.split_whitespace().next().unwrap_or("help");
        if is_name && name != "help" {
            let words: Vec<&str> = words.iter().copied().chain([name]).collect();
            helps(&words, text);
        }
    }
}

#[test]
fn the_reference_is_what_the_program_says() {
    let mut text = "# Commands\n\nThe output of `faceoff --help` and of the help of each command. `FACEOFF_WRITE=1 cargo test --test all docs::the_reference` \
        writes this page.\n"
        .to_owned();
    helps(&[], &mut text);
    let page = source("docs/reference/cli.md");
    if std::env::var_os("FACEOFF_WRITE").is_some() {
        fs::write(&page, &text).unwrap();
    }
    let there = fs::read_to_string(&page).unwrap_or_default();
    assert!(
        there == text,
        "{} is not what the program says: write it again by FACEOFF_WRITE=1",
        page.display()
    );
}

#[test]
fn a_page_is_cut_into_what_is_typed_and_what_is_printed() {
    let page = "a\n<!-- exit 1 -->\n```sh\nfalse\n```\n\n```text\nx … z\n```\n<!-- no -->\nb\n\n```sh\ntrue\n```\n";
    let found = blocks(page);
    let told: Vec<_> = found
        .iter()
        .map(|b| (&*b.comment, &*b.language, &*b.text))
        .collect();
    assert_eq!(
        told,
        [
            ("exit 1", "sh", "false\n"),
            ("", "text", "x … z\n"),
            ("", "sh", "true\n")
        ]
    );
    for (line, printed, is) in [
        ("x … z", "  x  yy z w", true),
        ("x … z", "z x", false),
        ("x", "ax\nb", true),
        ("x z", "x\nz", false),
    ] {
        assert_eq!(is_printed(line, printed), is, "{line}");
    }
}

#[test]
fn editors_know_what_files_hold() {
    let schema = |text: &str| match (
        text.contains("[form") || text.contains("[eigen"),
        text.contains("[codes"),
    ) {
        (true, _) => "docs/reference/form.schema.json",
        (_, true) => "docs/reference/face-off.schema.json",
        _ => "docs/reference/scene.schema.json",
    };
    let is_toml = |path: &PathBuf| path.extension().is_some_and(|e| e == "toml");
    let mut files = Vec::new();
    let examples = fs::read_dir(source("examples"))
        .unwrap()
        .map(|e| e.unwrap().path());
    let builtin = [
        "crates/fem/src/scene/builtin",
        "crates/form/src/elastic/builtin",
    ]
    .map(source);
    for folder in examples.chain(builtin) {
        let Ok(entries) = fs::read_dir(folder) else {
            continue;
        };
        files.extend(entries.map(|e| e.unwrap().path()).filter(is_toml));
    }
    assert!(files.len() > 12, "{files:?}");
    for file in &files {
        assert_valid("toml", schema(&fs::read_to_string(file).unwrap()), file);
    }
    // What the schema refuses, the program does.
    let scene = "name = \"a\"\n[mesh]\ngenerator = \"union-jack\"\n[boundary]\ndirichlet = [\"top\"]\nneumann = [\"left\", \"right\"]\ncontact = [\"bottom\"]\n";
    let face_off = fs::read_to_string(source("examples/blank/blank.toml")).unwrap();
    let form = fs::read_to_string(source("examples/forms/poisson.toml")).unwrap();
    let folder = folder();
    let elastic =
        fs::read_to_string(source("crates/form/src/elastic/builtin/contact-patch.toml")).unwrap();
    let elastic = &*elastic;
    for (text, from, to) in [
        (elastic, "plane = \"strain\"", "plane = \"stain\""),
        (elastic, "nu = 0.3", "mu = 0.3"),
        (elastic, "[elastic]", "[elastics]"),
        (elastic, "contact = [\"bottom\"]", "contacts = [\"bottom\"]"),
        (
            elastic,
            "[numbers.error]",
            "[method]\nh = \"local\"\n[numbers.error]",
        ),
        (elastic, "g = [\"0\", \"free\"]", "g = [\"0\"]"),
        (
            scene,
            "generator = \"union-jack\"",
            "generator = \"union-jill\"",
        ),
        (scene, "generator = \"union-jack\"", "n = 4"),
        (scene, "[mesh]", "[mush]"),
        (scene, "dirichlet", "dirchlet"),
        (scene, "[boundary]", "[method]\ngamma0 = -1\n[boundary]"),
        (scene, "[boundary]", "[data]\nf = []\n[boundary]"),
        (&face_off, "[codes.freefem]", "[codes.freefem]\ncolour = 1"),
        (&face_off, "same = \"discretisation\"", "same = \"mesh\""),
        (&form, "[spaces]", "[space]"),
        (&form, "[form]", "[form]\ndegree = 6"),
        (&form, "use = [", "used = ["),
        (&form, "orders = { l2", "orders = { l1"),
        (&form, "[fields.u]", "[numbers.a]\n[fields.u]"),
        (
            &face_off,
            "command = [\"FreeFem++-nw\"",
            "comand = [\"FreeFem++-nw\"",
        ),
    ] {
        let file = folder.path().join("a.toml");
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        let refused = validated("toml", schema(text), &file);
        assert!(refused.starts_with("ValidationError"), "{to}: {refused}");
        let ran = run(folder.path(), &["verify", "a.toml", "--n", "4"]);
        assert_eq!(ran.code, Some(2), "{to}: {}", ran.stdout);
    }
}
