//! Numbers of forms: integrals of what each code found, against values from outside.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, source, write};

/// -Δu = -2 with u = xy + y², which P2 holds: all numbers are known by hand.
const FORM: &str = r#"
name = "known"
[mesh]
generator = "union-jack"
n = [1, 2]
[spaces]
u = "P2"
[parameters]
k = 2.0
[data]
g = "x*y + y^2"
[form]
F = "inner(grad(u), grad(v))*dx + 2*v*dx"
[dirichlet]
left = "g"
right = "g"
bottom = "g"
top = "g"
[codes]
use = ["rust", "freefem"]
[numbers.energy]
value = "inner(grad(u), grad(u))*dx"
exact = 3
exact_rtol = 1e-13
[numbers.flux]
value = "dot(grad(u), n)*ds(right, top)"
exact = 3
exact_rtol = 1e-13
[numbers.sum]
value = "k*u*dx - (x - g)*dx"
exact = "7/12*k + 1/12"
exact_rtol = 1e-13
[numbers.area]
value = "1*dx + 1*ds"
exact = 5
exact_rtol = 1e-13
[numbers.jumps]
value = "jump(u)^2*dS + avg(g - u)*dS"
exact = 0
exact_rtol = 0
atol = 1e-14
"#;

fn verify(at: &Path, text: &str, words: &[&str]) -> (Option<i32>, String, Value) {
    write(at, "known.toml", text);
    let words = [&["verify", "known.toml", "--json", "o.json"], words].concat();
    let ran = run(at, &words);
    let schema = "src/report/schema/face-off-1.json";
    assert_valid("json", schema, &at.join("o.json"));
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    let all = ran.stdout + &ran.stderr;
    (ran.code, all, serde_json::from_str(&told).unwrap())
}

fn verdicts(told: &Value) -> Vec<(&str, &str)> {
    let numbers = told["numbers"].as_array().unwrap().iter();
    numbers
        .map(|n| {
            (
                n["number"].as_str().unwrap(),
                n["verdict"].as_str().unwrap(),
            )
        })
        .collect()
}

#[test]
fn numbers_are_those_known_by_hand() {
    let folder = folder();
    let at = folder.path();
    let (code, all, told) = verify(at, FORM, &["--record", "record", "--diagnose"]);
    assert_eq!(code, Some(0), "{all}");
    let names = ["area", "energy", "flux", "jumps", "sum"];
    let agree: Vec<_> = names.iter().map(|name| (*name, "agree")).collect();
    assert_eq!(verdicts(&told), agree);
    // Judged against a record, and each with its own exact value.
    let (code, all, _) = verify(at, FORM, &["--against", "record", "--engines", "rust"]);
    assert_eq!(code, Some(0), "{all}");
    for (name, from, to) in [
        (
            "energy",
            "inner(grad(u), grad(u))",
            "1.001*inner(grad(u), grad(u))",
        ),
        ("flux", "ds(right, top)", "ds(right)"),
        ("sum", "k*u*dx", "1.001*k*u*dx"),
        ("area", "+ 1*ds", "+ 1*ds(left, right, top)"),
        ("jumps", "jump(u)^2", "(1 + jump(u)^2)"),
    ] {
        let (code, all, told) = verify(at, &FORM.replacen(from, to, 1), &["--n", "1"]);
        assert_eq!(code, Some(1), "{name}: {all}");
        let wrong: Vec<_> = agree
            .iter()
            .map(|(known, word)| (*known, if *known == name { "disagree" } else { *word }))
            .collect();
        assert_eq!(verdicts(&told), wrong, "{all}");
    }
}

/// A program with a field that is off has numbers that are off; one whose result is not on the mesh has none, and says why.
#[test]
fn numbers_of_programs_are_taken_from_their_fields() {
    let folder = folder();
    let at = folder.path();
    write(at, "known.toml", FORM);
    let ran = run(at, &["write", "known.toml", "--for", "freefem"]);
    let changed = ran.stdout.replace("C out0 = u;", "C out0 = 1.001*u;");
    assert_ne!(changed, ran.stdout);
    write(at, "changed.edp", &changed);
    let own = "use = [\"rust\"]\n[codes.changed]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"changed.edp\", \"{mesh}\", \"{out}/u.vtu\"]\n\
               mesh = \"medit\"\nresult = \"u.vtu\"";
    let text = FORM.replacen("use = [\"rust\", \"freefem\"]", own, 1);
    let text = text.replacen(
        "[numbers.energy]",
        "[fields.u]\nrtol = 0.1\n[numbers.energy]",
        1,
    );
    let (code, all, told) = verify(at, &text, &["--run"]);
    assert_eq!(code, Some(1), "{all}");
    assert_eq!(told["fields"][0]["verdict"], "agree", "{all}");
    let off = |name| ["energy", "flux", "sum"].contains(&name);
    for (name, verdict) in verdicts(&told) {
        let wanted = if off(name) { "disagree" } else { "agree" };
        assert!(verdict == wanted || name == "jumps", "{name}: {all}");
    }
    let (code, all, _) = verify(
        at,
        &FORM.replacen("n = [1, 2]", "n = 4", 1),
        &["--keep", "kept"],
    );
    assert_eq!(code, Some(0), "{all}");
    let own = "use = [\"rust\"]\n[codes.other]\ncommand = [\"cp\", \"--no-preserve=timestamps\", \"kept/known-freefem-n4/out/known.vtu\", \"{out}/u.vtu\"]\n\
               result = \"u.vtu\"";
    let text = FORM.replacen("use = [\"rust\", \"freefem\"]", own, 1);
    let (code, all, told) = verify(at, &text, &["--run"]);
    assert_eq!(code, Some(2), "{all}");
    let rows = told["numbers"][0]["rows"].to_string();
    assert!(
        rows.contains("other has no number `area`") && rows.contains("the result has 32 cells"),
        "{rows}"
    );
}

#[test]
fn what_is_no_number_is_refused_with_its_place() {
    let folder = folder();
    let at = folder.path();
    let value = "value = \"inner(grad(u), grad(u))*dx\"";
    for (to, part) in [
        (
            "value = \"u*v*dx\"",
            "numbers.energy: value, character 3: `v` is not known",
        ),
        (
            "value = \"u*test.u*dx\"",
            "value, character 1: a test function in a number",
        ),
        ("value = \"u\"", "this is not integrated"),
        ("value = \"grad(u)*dx\"", "value, character 1"),
        ("value = \"u*dx(\"", "value, character"),
        ("value = \"old(u)*dx\"", "there are no steps in time"),
        ("value = \"u*ds(rihgt)\"", "did you mean `right`?"),
        (
            "rtol = 1e-9",
            "numbers.energy: scripts of forms write fields only",
        ),
    ] {
        write(at, "known.toml", &FORM.replacen(value, to, 1));
        let ran = run(at, &["verify", "known.toml"]);
        assert_eq!(ran.code, Some(2), "{to}: {}", ran.stdout);
        assert!(ran.stderr.contains(part), "{to}: {}", ran.stderr);
    }
    let of_field = FORM.replacen("[numbers.energy]", "[fields.u]", 1);
    let blank = fs::read_to_string(source("examples/blank/blank.toml")).unwrap();
    let of_scripts = blank.replacen("[numbers.mean]", "[numbers.mean]\nvalue = \"u*dx\"", 1);
    for text in [of_field, of_scripts] {
        write(at, "known.toml", &text);
        let ran = run(at, &["verify", "--run", "known.toml"]);
        assert_eq!(ran.code, Some(2), "{}", ran.stdout);
        assert!(
            ran.stderr.contains("only numbers of a form have a value"),
            "{}",
            ran.stderr
        );
    }
}

/// Means on facets, which a program's result has off where its field is; and what is no such field.
#[test]
fn fields_on_facets_are_compared_facet_by_facet() {
    let folder = folder();
    let at = folder.path();
    let slope =
        "[fields.slope]\nvalue = [\"dot(grad(u), n)*ds(right, top)\", \"k*u*ds(right, top)\"]\n";
    let text = FORM.to_owned() + slope;
    let (code, all, told) = verify(at, &text, &[]);
    assert_eq!(code, Some(0), "{all}");
    let names: Vec<_> = told["fields"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| &f["field"])
        .collect();
    assert_eq!(names, ["slope", "u"], "{all}");
    let ran = run(at, &["write", "known.toml", "--for", "freefem"]);
    let changed = ran.stdout.replace("C out0 = u;", "C out0 = u + 1e-8*x^2;");
    assert_ne!(changed, ran.stdout);
    write(at, "changed.edp", &changed);
    let own = "use = [\"rust\"]\n[codes.changed]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"changed.edp\", \"{mesh}\", \"{out}/u.vtu\"]\n\
               mesh = \"freefem\"\nresult = \"u.vtu\"\n";
    let text = text.replacen("use = [\"rust\", \"freefem\"]", own, 1);
    let (code, all, told) = verify(at, &text, &["--run"]);
    assert_eq!(code, Some(1), "{all}");
    let field = &told["fields"][0];
    assert_eq!(
        (&field["field"], &field["verdict"]),
        (&"slope".into(), &"disagree".into()),
        "{all}"
    );
    let pair = field["pairs"].as_array().unwrap().last().unwrap();
    // 2·10⁻⁸ in the slope on the right side.
    let far = pair["max_abs"].as_f64().unwrap();
    assert!((far - 2e-8).abs() < 1e-13, "{pair}");
    for (to, part) in [
        (
            "value = \"u*dx\"",
            "a field on facets is of one part of the boundary",
        ),
        (
            "value = \"jump(u)^2*dS\"",
            "a field on facets is of one part",
        ),
        (
            "value = [\"u*ds(left)\", \"u*ds(right)\"]",
            "value 2, character 1: a field on facets is of one part",
        ),
        ("value = \"u\"", "this is not integrated"),
        (
            "value = \"u*ds(left)\"\nexact = 0",
            "it has a value and exact",
        ),
        (
            "value = \"u*ds(left)\"\nsame = \"problem\"\nrtol = 1",
            "it has a value and same",
        ),
        ("rtol = 1", "slope is not an unknown of the form"),
    ] {
        write(at, "known.toml", &format!("{FORM}[fields.slope]\n{to}\n"));
        let ran = run(at, &["verify", "known.toml"]);
        assert_eq!(ran.code, Some(2), "{to}: {}", ran.stdout);
        assert!(ran.stderr.contains(part), "{to}: {}", ran.stderr);
    }
}

/// Vectors as a whole, and two unknowns: of a divergence the integral is the flux through the boundary.
#[test]
fn numbers_of_vectors_and_of_two_unknowns() {
    let folder = folder();
    let at = folder.path();
    let text = fs::read_to_string(source("examples/forms/darcy.toml")).unwrap()
        + "\n[numbers.through]\nvalue = \"div(q)*dx - dot(q, n)*ds + p*dx - p*dx\"\nexact = 0\nexact_rtol = 0\natol = 1e-12\n\
           [numbers.out]\nvalue = \"dot(q, n)*ds(left) + p^2*dx\"\nrtol = 1e-11\n";
    let (code, all, told) = verify(
        at,
        &text,
        &["--n", "4", "--engines", "rust,freefem,dolfinx"],
    );
    assert_eq!(code, Some(0), "{all}");
    assert_eq!(verdicts(&told), [("out", "agree"), ("through", "agree")]);
}
