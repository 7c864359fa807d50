//! No name of a problem hides a name that a script needs, and no template uses a missing field.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use faceoff_mesh::mesh::Mesh;
use faceoff_mesh::mesh::generate::{union_cube, union_jack};
use minijinja::Value;

use super::speaker::Speaker;
use super::{CODES, Code, fields, frame};
use crate::Problem;

/// With everything that a frame may need: several unknowns, data of both kinds, all measures and functions.
const FORM: &str = r#"
name = "words"
[spaces]
qqu = "P2^d"
qqp = "P1"
[parameters]
qqk = 2.0
[data]
qqf = "abs(x - 0.5) + max(x, y) + conditional(x < y, sin(x), 1)"
qqg = { expr = "exp(x)", space = "P2" }
qqb = ["1", "x"]
[form]
F = """
inner(grad(qqu), grad(test.qqu))*dx + qqk*qqp*test.qqp*dx + h*qqf*test.qqp*dx - qqg*test.qqp*dx + qqb[1]*qqu[0]*test.qqu[1]*dx
+ sqrt(1 + qqp^2)*test.qqp*ds(left) + n[0]*test.qqp*ds - tanh(qqp)*atan2(qqp, 2)*div(test.qqu)*dx + cofac(Identity(2))[0, 0]*test.qqp*dx
"""
degree = 2
[dirichlet]
qqu = { left = [0, "x"], right = ["free", 1] }
"#;

/// With time steps, a mean, vectors of both kinds and second derivatives.
const MORE: &str = r#"
name = "words"
[spaces]
qqu = "P2^d"
qqp = "P1"
qqr = "RT0"
qqe = "N1curl"
[data]
qqg = { expr = "t*exp(x)", space = "P2" }
[time]
step = 0.5
end = 1.0
[initial]
qqu = [0, "x"]
[mean]
qqp = 0
[form]
F = """
dot(qqu - old(qqu), test.qqu)/dt*dx + inner(grad(qqu), grad(test.qqu))*dx - qqp*div(test.qqu)*dx - div(qqu)*test.qqp*dx
+ t*qqg*dot(qqr, test.qqr)*dx + div(qqr)*div(test.qqr)*dx - dot(old(qqr), test.qqr)*dx + dot(qqe, test.qqe)*dx + inner(curl(qqe), curl(test.qqe))*dx
+ 0.1*inner(grad(grad(qqu)), grad(grad(test.qqu)))*dx + conditional(x < y, sin(x), 1)*div(test.qqr)*dx
"""
degree = 2
[dirichlet]
qqu = { left = [0, "t*x"], right = ["t", 1], bottom = [0, 0], top = [0, 0], back = [0, 0], front = [0, 0] }
qqr = { left = [0, 1] }
qqe = { left = [0, 1] }
"#;

/// An eigenproblem with data, a boundary term and a constraint of either kind.
const MODES: &str = r#"
name = "words"
[spaces]
qqu = "SPACE"
[parameters]
qqk = 2.0
[data]
qqg = { expr = "exp(x)", space = "P2" }
[eigen]
a = "qqk*inner(grad(qqu), grad(v))*dx + qqg*dot(qqu, v)*dx + dot(qqu, v)*ds(left)"
m = "qqk*dot(qqu, v)*dx"
count = 3
shift = -1
[dirichlet]
right = [0, 0]
"#;

/// Words of a script outside of comments and strings, except members and names of arguments.
fn words(script: &str, is_python: bool) -> BTreeSet<String> {
    let mut plain = String::new();
    let mut rest = script;
    while let Some(c) = rest.chars().next() {
        let comment = if is_python { "#" } else { "//" };
        let mut skip = c.len_utf8();
        if rest.starts_with(comment) {
            skip = rest.find('\n').unwrap_or(rest.len());
        } else if let Some(text) = rest.strip_prefix("\"\"\"") {
            skip = text.find("\"\"\"").map_or(rest.len(), |end| end + 6);
        } else if c == '"' || (c == '\'' && is_python) {
            if [" f", "{f", "[f"]
                .iter()
                .any(|start| plain.ends_with(start))
            {
                plain.pop();
            }
            skip = rest[1..].find(c).map_or(rest.len(), |end| end + 2);
        } else {
            plain.push(c);
        }
        rest = &rest[skip..];
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = BTreeSet::new();
    let mut depth = 0;
    for line in plain.lines() {
        // Names inside of functions hide nothing outside.
        let is_outside = depth > 0 || !line.starts_with(' ') || !is_python;
        let mut line = line;
        if is_python && line.starts_with("def ") {
            line = line.split('(').next().unwrap_or(line);
        } else if is_outside {
            let count = |sign: &str| line.matches(|c| sign.contains(c)).count();
            depth = (depth + count("([{")).saturating_sub(count(")]}"));
        }
        let mut before = ' ';
        for (at, word) in line.split(|c| !is_word(c)).scan(0, |at, word| {
            let start = *at;
            *at += word.len() + 1;
            Some((start, word))
        }) {
            let after = &line[at + word.len()..];
            let is_argument = is_python && after.starts_with('=') && !after.starts_with("==");
            // Names of a problem begin with a letter.
            let is_name = word.starts_with(char::is_alphabetic);
            if is_name && before != '.' && !is_argument && (is_outside || BUILTINS.contains(&word))
            {
                found.insert(word.to_owned());
            }
            before = after.chars().next().unwrap_or(' ');
        }
    }
    found
}

/// Functions of Python that frames call.
const BUILTINS: [&str; 18] = [
    "abs",
    "all",
    "any",
    "bool",
    "dict",
    "divmod",
    "enumerate",
    "float",
    "getattr",
    "hasattr",
    "int",
    "iter",
    "len",
    "map",
    "max",
    "next",
    "range",
    "slice",
];

/// The forms with everything that a template may need, in 2D and 3D, with and without spaces of vectors.
fn forms() -> [(String, Mesh); 7] {
    let cube = FORM
        .replace("Identity(2)", "Identity(3)")
        .replace("[0, \"x\"]", "[0, \"x\", 0]")
        .replace("[\"free\", 1]", "[\"free\", 1, 0]");
    let plane = MORE.replace(", back = [0, 0], front = [0, 0]", "");
    let solid = MORE
        .replace("[0, \"x\"]", "[0, \"x\", 0]")
        .replace("\"t*x\"]", "\"t*x\", 0]");
    let solid = solid
        .replace("[\"t\", 1]", "[\"t\", 1, 0]")
        .replace("[0, 0]", "[0, 0, 0]")
        .replace("[0, 1]", "[0, 1, 0]");
    let without = plane
        .replace("\"RT0\"", "\"P1^d\"")
        .replace("\"N1curl\"", "\"P1^d\"");
    let without = without.replace("[initial]", "[initial]\nqqr = [0, 0]");
    let square = union_jack(2, [1.0, 1.0]);
    let cube_mesh = union_cube(1, [1.0; 3]);
    [
        (FORM.to_owned(), square.clone()),
        (cube, cube_mesh.clone()),
        (without, square.clone()),
        (plane, square.clone()),
        (solid, cube_mesh),
        (MODES.replace("SPACE", "P2^2"), square.clone()),
        (MODES.replace("SPACE", "N1curl"), square),
    ]
}

#[test]
fn words_of_scripts_are_reserved() {
    let mut with_systems = BTreeSet::new();
    for (form, mesh) in forms() {
        let problem =
            Problem::parse(Path::new("words.toml"), &form, &mesh).unwrap_or_else(|e| panic!("{e}"));
        for code in &CODES {
            let is_lacking = match code.name {
                "getfem" | "nutils" | "mfem" if form.contains("[eigen]") => true,
                "nutils" => form.contains("RT0"),
                "mfem" => form.contains("RT0") || form.contains("grad(grad("),
                _ => false,
            };
            let Ok(script) = code.script(&problem) else {
                assert!(is_lacking, "{}", code.name);
                continue;
            };
            // The time and its step are parameters, and v is the test function if there is one unknown.
            let own = |word: &String| {
                let is_test = word.trim_end_matches(|c: char| c.is_ascii_digit()) == "v";
                word.contains("qq")
                    || is_test
                    || ["t", "dt", "v"].contains(&word.trim_end_matches('_'))
            };
            let known: BTreeSet<&str> = reserved(code).collect();
            let stem = |word: &str| {
                word.trim_end_matches(|c: char| c.is_ascii_digit())
                    .to_owned()
            };
            // Shared expressions are `s1` and so on, unless the problem has such names.
            let is_known = |word: &String| {
                known.contains(word.as_str())
                    || known.contains(stem(word).as_str())
                    || stem(word) == "s"
            };
            let is_free = |word: &String| !own(word) && !is_known(word);
            let with_system = code.script_with_system(&problem).ok();
            with_systems.extend(with_system.is_some().then_some(code.name));
            for script in [Some(script), with_system].into_iter().flatten() {
                let all = words(&script, code.suffix.ends_with(".py")).into_iter();
                let missing: Vec<String> = all.filter(is_free).collect();
                assert!(missing.is_empty(), "{}: {}", code.name, missing.join(" "));
            }
        }
    }
    assert_eq!(with_systems.len(), CODES.len() - 1, "{with_systems:?}");
}

fn reserved(code: &Code) -> impl Iterator<Item = &'static str> {
    let lists = code.reserved.iter();
    lists.flat_map(|words| words.split_whitespace())
}

/// Every form of the examples, in 2D and 3D if it allows both, and those above.
#[test]
fn every_template_is_filled_for_every_form() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/forms");
    let files = std::fs::read_dir(folder).expect("forms");
    let texts = files.map(|file| std::fs::read_to_string(file.expect("a form").path()));
    let texts: Vec<String> = texts.map(|text| text.expect("a text")).collect();
    let meshes = [union_jack(2, [1.0, 1.0]), union_cube(1, [1.0; 3])];
    let examples = texts
        .iter()
        .flat_map(|text| meshes.iter().map(|mesh| (text.clone(), mesh.clone())));
    let mut written = BTreeMap::new();
    for (form, mesh) in forms().into_iter().chain(examples) {
        let Ok(problem) = Problem::parse(Path::new("form.toml"), &form, &mesh) else {
            continue;
        };
        for code in &CODES {
            match code.script(&problem) {
                Err(why) => assert!(!why.contains("internal error"), "{}: {why}", problem.name),
                Ok(script) => {
                    let what = format!("{} for {}", problem.name, code.name);
                    assert!(!script.contains("{%") && !script.contains("}}"), "{what}");
                    *written.entry(code.name).or_insert(0) += 1;
                }
            }
        }
    }
    assert!(
        CODES.iter().all(|code| written[code.name] >= 20),
        "{written:?}"
    );
}

/// A missing field is reported as an error of this program, and never an empty part of a script.
#[test]
fn a_missing_field_is_an_internal_error() {
    let [(form, mesh), ..] = forms();
    let problem = Problem::parse(Path::new("form.toml"), &form, &mesh).expect("a form");
    for code in &CODES {
        let all = fields::fields(&mut Speaker::new(code, &problem), "words.msh", false)
            .expect("it has P2");
        let keys = all.try_iter().expect("a map");
        let keys = keys.filter(|key| key.as_str() != Some("name"));
        let fields = keys.map(|key| (key.clone(), all.get_item(&key).expect("its value")));
        let error = frame::fill(code.name, Value::from_pairs(fields));
        let start = format!("an internal error: the template for {} cannot", code.name);
        let error = error.expect_err("the name is missing");
        assert!(error.starts_with(&start), "{error}");
        frame::fill(code.name, all).expect("nothing is missing");
    }
}
