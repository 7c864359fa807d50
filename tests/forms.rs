//! Weak forms: each code gets its script from the form, and what they solve is held against each other and against exact solutions.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::common::{Ran, assert_valid, faceoff, folder, source, told, write};

/// Those that are installed for the tests (see tests/run).
const CODES: [&str; 6] = [
    "freefem",
    "dolfinx",
    "scikit-fem",
    "ngsolve",
    "getfem",
    "nutils",
];

/// What most forms of the gallery use.
const USE: &str = "use = [\"rust\", \"freefem\", \"dolfinx\", \"scikit-fem\", \"ngsolve\", \"getfem\", \"nutils\"]";

/// The program, where scikit-fem, NGSolve and nutils are in the first Python of the path.
fn run(folder: &Path, words: &[&str]) -> Ran {
    told(
        with_codes(&mut faceoff(folder))
            .args(words)
            .output()
            .unwrap(),
    )
}

fn with_codes(command: &mut Command) -> &mut Command {
    let path = std::env::var("PATH").unwrap();
    let engines = source("target/python/bin");
    command.env("PATH", format!("{}:{path}", engines.display()))
}

/// A form of the gallery in a folder, with one text instead of another.
fn form(folder: &Path, name: &str, from: &str, to: &str) -> String {
    let file = format!("{name}.toml");
    let text = fs::read_to_string(source("examples/forms").join(&file)).unwrap();
    assert!(text.contains(from), "{name} does not contain {from}");
    write(folder, &file, &text.replacen(from, to, 1));
    for mesh in ["beam.msh", "l.msh", "ring.msh"] {
        if text.contains(mesh) {
            fs::copy(source("examples/forms").join(mesh), folder.join(mesh)).unwrap();
        }
    }
    file
}

fn verify(folder: &Path, file: &str, words: &[&str]) -> (Ran, Value) {
    let ran = run(
        folder,
        &[&["verify", file, "--json", "o.json"], words].concat(),
    );
    let schema = "src/report/schema/face-off-1.json";
    assert_valid("json", schema, &folder.join("o.json"));
    let told = fs::read_to_string(folder.join("o.json")).unwrap();
    (ran, serde_json::from_str(&told).unwrap())
}

/// Of all pairs of a field, relative to its largest value.
fn largest(field: &Value) -> f64 {
    let pairs = field["pairs"].as_array().unwrap();
    assert!(!pairs.is_empty(), "{field}");
    pairs.iter().fold(0.0, |most, pair| {
        pair["max_rel"].as_f64().unwrap().max(most)
    })
}

/// Where all processes of Open MPI make the folders of one session, one that ends may remove what another is about to use. A file in the
/// place of the session's folder ends each process that would make one.
#[test]
fn scripts_that_run_at_once_share_no_folder() {
    let folder = folder();
    let at = folder.path();
    let file = form(at, "poisson", USE, "use = [\"rust\", \"dolfinx\"]");
    let in_folder = |command: &mut Command| {
        command.current_dir(at).env("TMPDIR", at);
        command.env_remove("OMPI_MCA_orte_create_session_dirs");
        told(command.output().unwrap())
    };
    let words = "touch ompi.$(uname -n | cut -d . -f 1).$(id -u)\n\
                 OMPI_MCA_ess_singleton_isolated=1 /usr/bin/python3 -c 'from mpi4py import MPI'";
    let ended = in_folder(Command::new("sh").args(["-c", words]));
    assert!(
        ended.stderr.contains("orte_init failed"),
        "{}",
        ended.stderr
    );
    let ran = in_folder(faceoff(at).args(["verify", &file, "--n", "4"]));
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

#[test]
fn codes_agree_on_a_form_and_a_changed_script_is_found() {
    let folder = folder();
    let at = folder.path();
    let file = form(at, "poisson", USE, "use = [\"freefem\", \"dolfinx\"]");
    // A form starts no program of its own: it needs no --run.
    let words = ["--n", "4,8", "--report", "page", "--junit", "j.xml"];
    let (ran, told) = verify(at, &file, &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_valid("xsd", "tests/junit.xsd", &at.join("j.xml"));
    assert!(largest(&told["fields"][0]) < 1e-11, "{told}");
    let html = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert!(html.contains("dolfinx, freefem <em>agree</em> on poisson"));

    let ran = run(at, &["write", &file, "--for", "freefem"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    // With what is told; a factor in the derivative alone changes the way there and not the answer.
    let changes = [
        (
            "(-t)*v",
            "(t)*v",
            "as if the term `t*v*ds(right)` had the other sign",
        ),
        ("dx(du)*dx(v)", "1.01*dx(du)*dx(v)", ""),
        (
            "qft=qf5pT",
            "qft=qf2pT",
            "as if all terms were integrated by the rule `edges-3`",
        ),
        (
            "on(3, du = exp",
            "on(3, du = 1.001*exp",
            "as if the Dirichlet values of `u` on `top` had the factor 1.001",
        ),
    ];
    for (from, to, words) in changes {
        assert!(ran.stdout.contains(from), "{from}: {}", ran.stdout);
        let code = if words.is_empty() { 0 } else { 1 };
        write(at, "changed.edp", &ran.stdout.replace(from, to));
        let own = "use = [\"dolfinx\"]\n[codes.changed]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"changed.edp\", \"{mesh}\", \
                   \"{out}/poisson.vtu\"]\nmesh = \"medit\"\nresult = \"poisson.vtu\"";
        let file = form(at, "poisson", USE, own);
        let refused = run(at, &["verify", &file]);
        assert_eq!(refused.code, Some(2));
        assert!(
            refused.stderr.contains("starts programs: FreeFem++-nw"),
            "{}",
            refused.stderr
        );
        let (ran, told) = verify(at, &file, &["--n", "4", "--run"]);
        assert_eq!(ran.code, Some(code), "{to}: {}{}", ran.stdout, ran.stderr);
        let expected = if code == 0 { "agree" } else { "disagree" };
        assert_eq!(told["fields"][0]["verdict"], expected, "{to}");
        let in_form = |code: &str| {
            let mut all = told["in_form"].as_array().into_iter().flatten();
            all.find(|of| of["code"] == code).cloned()
        };
        if code == 0 {
            assert!(told.get("in_form").is_none(), "{told}");
            continue;
        }
        assert_eq!(in_form("dolfinx").unwrap()["verdict"], "agree", "{told}");
        let changed = in_form("changed").unwrap();
        let sentence = changed["sentence"].as_str().unwrap();
        assert!(sentence.contains(words), "{words}: {sentence}");
        let last = ran.stdout.trim_end().lines().last().unwrap_or_default();
        assert!(
            last.starts_with("disagree: changed does not solve the form"),
            "{last}"
        );
        assert!(last.contains(words), "{last}");
    }
}

#[test]
fn what_is_wrong_with_a_form_is_told_with_its_place_and_nothing_is_written() {
    let folder = folder();
    let at = folder.path();
    let faults = [
        ("grad(u)", "grad(w)", "poisson.toml:17:17: `w` is not known"),
        ("*v*ds(right)", "*v*ds(rihgt)", "did you mean `right`?"),
        (
            "u = \"P2\"",
            "u = \"P7\"",
            "poisson.toml:9:5: there is no space `P7`",
        ),
        (
            "left = \"g\"",
            "lfet = \"g\"",
            "poisson.toml:20:1: the mesh has no group `lfet`",
        ),
        ("[form]", "[from]", "unknown field `from`"),
        (
            "f = \"3*exp(x)",
            "f = \"3*exq(x)",
            "poisson.toml:12:8: there is no function `exq`",
        ),
        (
            "use = [\"rust\"",
            "use = [\"fenicsx\"",
            "no scripts are written for a code `fenicsx`",
        ),
        (
            "use = [\"rust\"",
            "use = [\"dolfinx\"",
            "dolfinx is there twice",
        ),
        (
            "[fields.u]",
            "[fields.w]",
            "w is not an unknown of the form",
        ),
        (
            "[fields.u]",
            "[numbers.w]",
            "scripts of forms write fields only",
        ),
        (
            "[mesh]\ngenerator = \"union-jack\"\nn = [4, 8, 16]",
            "",
            "a form has no mesh",
        ),
        (
            "name = \"poisson\"",
            "name = \"../poisson\"",
            "cannot name output files",
        ),
        ("exact = \"g\"", "exact = \"q\"", "exact"),
        ("name = ", "name ", "line 1"),
        (USE, "use = []", "it has 0 codes"),
    ];
    for (from, to, part) in faults {
        let file = form(at, "poisson", from, to);
        let ran = run(at, &["verify", &file]);
        assert_eq!(ran.code, Some(2), "{to}: {}", ran.stdout);
        assert!(ran.stderr.contains(part), "{to}: {}", ran.stderr);
    }
    let ran = run(at, &["solve", "poisson.toml"]);
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("poisson.toml is not a scene"),
        "{}",
        ran.stderr
    );
    let broken = form(at, "poisson", "grad(u)", "grad(w)");
    let words: [(&[&str], &str); 5] = [
        (&[&broken, "--for", "freefem"], "poisson.toml:17:17"),
        (&["none.toml", "--for", "freefem"], "none.toml"),
        (
            &[&broken, "--for", "freefm"],
            "a similar value exists: 'freefem'",
        ),
        (&[&broken], "--for <CODE>"),
        (&["o.toml", "--for", "dolfinx"], "there is no form"),
    ];
    write(at, "o.toml", "name = \"o\"\n");
    for (words, part) in words {
        let ran = run(at, &[&["write", "-o", "new.edp"], words].concat());
        assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stdout);
        assert!(ran.stderr.contains(part), "{words:?}: {}", ran.stderr);
    }
    let there: Vec<String> = fs::read_dir(at)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert!(
        there.iter().all(|name| name.ends_with(".toml")),
        "{there:?}"
    );
    // A mesh that is there already and another one is not replaced.
    let file = form(at, "poisson", "rtol", "rtol");
    write(at, "poisson.mesh", "mine");
    let ran = run(at, &["write", &file, "--for", "freefem", "-o", "."]);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(ran.stderr.contains("is another mesh"), "{}", ran.stderr);
    assert!(!at.join("poisson.edp").exists());
    assert_eq!(fs::read_to_string(at.join("poisson.mesh")).unwrap(), "mine");
}

/// What a code does not have is never a pass: it is missing, with the reason, and is left out only where the user says so.
#[test]
fn a_code_that_lacks_a_space_is_missing() {
    let folder = folder();
    let at = folder.path();
    let file = form(at, "interior-penalty", "\"DG1\"", "\"DG2\"");
    let words = ["--n", "4", "--engines", "freefem,dolfinx,scikit-fem"];
    let (ran, told) = verify(at, &file, &words);
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(told["verdict"], "undetermined");
    assert!(
        ran.stderr.contains("engine freefem: FreeFEM"),
        "{}",
        ran.stderr
    );
    let (ran, told) = verify(at, &file, &[&words[..], &["--allow-missing"]].concat());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(told["missing"][0]["engine"], "freefem");
    // Nor one that is not installed.
    let bare = || {
        let mut command = faceoff(at);
        command.env("PATH", "/usr/bin:/bin");
        command
    };
    let file = form(at, "poisson", USE, "use = [\"dolfinx\", \"scikit-fem\"]");
    let ran = told_of(bare().args(["verify", &file, "--n", "4"]));
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(
        ran.stderr.contains("no Python here has skfem"),
        "{}",
        ran.stderr
    );
    let ran = told_of(bare().args(["verify", &file, "--n", "4", "--allow-missing"]));
    assert_eq!(ran.code, Some(2), "one code shows nothing: {}", ran.stdout);
    assert!(
        ran.stderr.contains("dolfinx alone shows nothing"),
        "{}",
        ran.stderr
    );
}

fn told_of(command: &mut Command) -> Ran {
    told(command.output().unwrap())
}

/// Each script is run as a user would, with the code alone, and its result is that of the others.
#[test]
fn scripts_run_alone() {
    let folder = folder();
    let at = folder.path();
    let file = form(at, "stokes", "rtol", "rtol");
    let mut results: Vec<PathBuf> = Vec::new();
    for code in CODES {
        let place = at.join(code);
        fs::create_dir(&place).unwrap();
        let place = place.to_str().unwrap();
        let ran = run(at, &["write", &file, "--for", code, "-o", place]);
        assert_eq!(ran.code, Some(0), "{code}: {}", ran.stderr);
        let mut bash = Command::new("bash");
        bash.args(["-e", "-c", &ran.stdout]).current_dir(at);
        let alone = told_of(with_codes(&mut bash));
        assert_eq!(
            alone.code,
            Some(0),
            "{code}: {}{}",
            alone.stdout,
            alone.stderr
        );
        let written = fs::read_dir(place).unwrap().map(|e| e.unwrap().path());
        let is_result = |path: &PathBuf| path.extension().is_some_and(|e| e == "vtu");
        results.extend(written.filter(is_result));
    }
    assert_eq!(results.len(), CODES.len(), "{results:?}");
    for other in &results[1..] {
        let [a, b] = [&results[0], other].map(|path| path.to_str().unwrap());
        let ran = run(at, &["compare", a, b, "--rtol", "1e-11"]);
        assert_eq!(ran.code, Some(0), "{b}: {}{}", ran.stdout, ran.stderr);
    }
}

/// Kept runs are taken up, recorded ones judged against, and a changed form is another problem.
#[test]
fn runs_of_forms_are_kept_and_recorded() {
    let folder = folder();
    let at = folder.path();
    let file = form(at, "convection", "rtol", "rtol");
    let first = ["--n", "4", "--engines", "rust,freefem,dolfinx"];
    let kept = [&first[..], &["--resume", "runs", "--record", "record"]].concat();
    let (ran, before) = verify(at, &file, &kept);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let (ran, after) = verify(at, &file, &[&first[..], &["--resume", "runs"]].concat());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(
        before["runs"], after["runs"],
        "times are those of the first run"
    );
    let against = |code| ["--n", "4", "--engines", code, "--against", "record"];
    for code in ["rust", "freefem"] {
        let (ran, _) = verify(at, &file, &against(code));
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    }
    let file = form(at, "convection", "c = 1.0", "c = 1.5");
    for code in ["rust", "freefem"] {
        let (ran, _) = verify(at, &file, &against(code));
        assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
        assert!(
            ran.stderr.contains("it was another problem"),
            "{}",
            ran.stderr
        );
    }
}

#[test]
fn a_new_form_runs_at_once() {
    let folder = folder();
    let at = folder.path();
    let ran = run(at, &["new", "mine", "--form", "nitsche"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(
        ran.stdout
            .contains("faceoff verify mine/mine.toml --report mine/page"),
        "{}",
        ran.stdout
    );
    let words = ["--n", "4", "--engines", "freefem,dolfinx"];
    let (ran, told) = verify(at, "mine/mine.toml", &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(told["name"], "mine");
    let pipeline = fs::read_to_string(at.join("mine/ci.yml")).unwrap();
    assert!(pipeline.contains("faceoff verify mine.toml"), "{pipeline}");
    let ran = run(at, &["new", "other", "--form", "poison"]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("poisson"), "{}", ran.stderr);
    assert!(!at.join("other").exists());
}

/// What a stranger writes into a form stays a comment.
#[test]
fn no_text_of_a_form_becomes_code() {
    let folder = folder();
    let at = folder.path();
    let about =
        "about = \"x\\\"\\\"\\\"\\nimport os\\u000dexec('touch planted')\\u2028exec(1) \\\\\"";
    let from = "about = \"Poisson's equation with a flux given on the right\"";
    let file = form(at, "poisson", from, about);
    for code in CODES {
        let ran = run(at, &["write", &file, "--for", code]);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let lines: Vec<&str> = ran.stdout.split(['\n', '\r', '\u{2028}']).collect();
        let planted: Vec<_> = lines.iter().filter(|line| line.contains("exec(")).collect();
        assert_eq!(planted.len(), 1, "{code}: {planted:?}");
        assert!(planted[0].contains("poisson: x"), "{code}: {planted:?}");
        assert_eq!(
            ran.stdout.matches("\"\"\"poisson").count() + ran.stdout.matches("// poisson").count(),
            1
        );
        assert!(!planted[0][4..].contains("\"\"\""), "{code}: {planted:?}");
    }
    let (ran, _) = verify(at, &file, &["--n", "2"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(!at.join("planted").exists());
}

/// The gallery as a table of the manual: `FACEOFF_WRITE=1 cargo test --workspace --test all forms::the_gallery` writes it again.
/// `tests/run` takes every fourth form and two codes, whose orders are the answer from outside: crates/form holds codes against each other on
/// all forms; `tests/run --all` takes all forms and codes here as well.
#[test]
fn the_gallery_agrees_as_the_manual_says() {
    let given = |name: &str| std::env::var_os(name).is_some();
    let is_whole = given("FACEOFF_WRITE") || given("FACEOFF_SCENES");
    let mut names: Vec<String> = fs::read_dir(source("examples/forms"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter_map(|name| Some(name.strip_suffix(".toml")?.to_owned()))
        .collect();
    names.sort();
    let forms = names.len();
    if !is_whole {
        names = names.into_iter().step_by(4).collect();
    }
    let mut table = String::from(
        "| form | spaces | codes | largest difference | observed orders |\n|---|---|---|---|---|\n",
    );
    for name in &names {
        let folder = folder();
        let at = folder.path();
        let file = form(at, name, "[", "[");
        let text = fs::read_to_string(at.join(&file)).unwrap();
        // FreeFEM has no quadrangles.
        let words: &[&str] = match text.contains("\"freefem\"") {
            _ if is_whole => &[],
            true => &["--engines", "rust,freefem"],
            false => &["--engines", "rust,scikit-fem"],
        };
        let (ran, told) = verify(at, &file, words);
        assert_eq!(ran.code, Some(0), "{name}: {}{}", ran.stdout, ran.stderr);
        let spaces: BTreeMap<String, toml::Value> = text.parse::<toml::Table>().unwrap()["spaces"]
            .as_table()
            .unwrap()
            .clone()
            .into_iter()
            .collect();
        let spaces: Vec<String> = spaces
            .iter()
            .map(|(u, space)| format!("{u} {}", space.as_str().unwrap()))
            .collect();
        let mut codes: Vec<&str> = told["runs"]
            .as_array()
            .unwrap()
            .iter()
            .map(|run| run["code"].as_str().unwrap())
            .collect();
        codes.sort_unstable();
        codes.dedup();
        let least = if is_whole { 4 } else { 2 };
        assert!(codes.len() >= least, "{name}: {codes:?}");
        let fields = told["fields"].as_array().unwrap();
        // Of an eigenproblem, that of the eigenvalues.
        let spectra = told["spectra"].as_array().into_iter().flatten();
        let pairs = spectra.flat_map(|found| found["pairs"].as_array().unwrap());
        let of_values = pairs.map(|pair| pair["relative"].as_f64().unwrap());
        let most = fields.iter().map(largest).chain(of_values);
        let most = most.fold(0.0, f64::max);
        assert!(most < 1e-11, "{name}: {most:e}");
        let mut orders = Vec::new();
        for field in fields {
            // Codes agree to rounding, so that one of them stands for all.
            let Some(order) = field["orders"].as_array().unwrap().first() else {
                continue;
            };
            let fit = |norm: &str| order[norm]["fit"]["exponent"].as_f64();
            let theory = order["theory"].as_array().unwrap();
            for (norm, (word, theory)) in ["l2", "h1"]
                .into_iter()
                .zip(["L²", "H¹"].into_iter().zip(theory))
            {
                if let (Some(fit), false) = (fit(norm), theory.is_null()) {
                    orders.push(format!(
                        "{} {word} {fit:.1}",
                        field["field"].as_str().unwrap()
                    ));
                }
            }
        }
        table += &format!(
            "| `{name}` | {} | {} | {} | {} |\n",
            spaces.join(", "),
            codes.join(", "),
            power(most),
            orders.join(", ")
        );
    }
    let page = source("docs/reference/form.md");
    let there = fs::read_to_string(&page).unwrap();
    let (before, rest) = there.split_once("<!-- gallery -->\n").unwrap();
    let (old, after) = rest.split_once("<!-- end -->\n").unwrap();
    if given("FACEOFF_WRITE") {
        fs::write(
            &page,
            format!("{before}<!-- gallery -->\n{table}<!-- end -->\n{after}"),
        )
        .unwrap();
        return;
    }
    // Rounding is another one on another machine.
    let bare = |table: &str| -> Vec<String> {
        let is_of = |line: &str, name: &String| line.starts_with(&format!("| `{name}` "));
        let has_turn =
            |line: &&str| !line.starts_with("| `") || names.iter().any(|name| is_of(line, name));
        let rows = table.lines().filter(has_turn).map(|line| {
            let cells = line.split('|').enumerate();
            cells
                .filter(|(k, _)| *k != 4 && (is_whole || *k != 3))
                .map(|(_, cell)| cell)
                .collect::<Vec<_>>()
                .join("|")
        });
        rows.collect()
    };
    assert_eq!(bare(old), bare(&table));
    assert_eq!(old.lines().count(), forms + 2);
}

/// The power of ten above a number: `10⁻¹⁵`.
fn power(number: f64) -> String {
    let digits: String = format!("{}", -number.log10().ceil())
        .chars()
        .map(|digit| {
            "⁰¹²³⁴⁵⁶⁷⁸⁹"
                .chars()
                .nth(digit.to_digit(10).unwrap() as usize)
                .unwrap()
        })
        .collect();
    format!("10⁻{digits}")
}

/// A parameter that is a list makes levels, in scripts and here: u = x(1 - x)/(2k) of -k u'' = 1.
#[test]
fn a_parameter_that_is_a_list_makes_levels() {
    let folder = folder();
    let at = folder.path();
    let text = r#"name = "levels"
[mesh]
generator = "union-jack"
n = 4
[spaces]
u = "P2"
[parameters]
k = [2.0, 1.0, 0.5]
[form]
F = "k*inner(grad(u), grad(v))*dx - v*dx"
[dirichlet]
left = 0
right = 0
[codes]
use = ["rust", "freefem", "scikit-fem"]
[fields.u]
rtol = 1e-11
[numbers.mean]
value = "u*dx"
"#;
    write(at, "levels.toml", text);
    let (ran, told) = verify(at, "levels.toml", &[]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let rows = told["numbers"][0]["rows"].as_array().unwrap();
    let levels: Vec<&str> = rows
        .iter()
        .map(|row| row["level"].as_str().unwrap())
        .collect();
    assert_eq!(levels, ["k = 2", "k = 1", "k = 0.5"]);
    for (row, k) in rows.iter().zip([2.0, 1.0, 0.5]) {
        let values = row["values"].as_object().unwrap();
        assert_eq!(values.len(), 3);
        for value in values.values() {
            assert!(
                (value.as_f64().unwrap() - 1.0 / (12.0 * k)).abs() < 1e-14,
                "{row}"
            );
        }
    }
}
