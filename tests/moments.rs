//! Fields on facets and edges: fluxes of RT0 and circulations of N1curl as dofs in CSV are functions, the divergence and curl of which are
//! compared cell by cell.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, source, write};

/// A form of the gallery with FreeFEM's script as a code of its own, which writes moments too.
fn with_moments(at: &Path, form: &str, space: &str, vector: [&str; 2], fields: &str) {
    let text = fs::read_to_string(source("examples/forms").join(format!("{form}.toml"))).unwrap();
    let (text, _) = text.split_once("[codes]").unwrap();
    let text = text.replace("n = [8, 16, 32]", "n = [4, 8]");
    let mine = "[codes]\nuse = [\"rust\", \"dolfinx\"]\n[codes.mine]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"mine.edp\", \"{mesh}\", \"{out}/all.vtu\"]\n\
                mesh = \"medit\"\nresult = [\"all.vtu\", \"all.vtu.csv\"]\n";
    write(at, "form.toml", &format!("{text}{mine}{fields}"));
    write(
        at,
        "alone.toml",
        &format!("{text}[codes]\nuse = [\"rust\"]\n"),
    );
    let ran = run(at, &["write", "alone.toml", "--for", "freefem"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let [a, b] = vector;
    let more = format!(
        "include \"moments.idp\"\nfespace Eh(Th, {space});\nEh [a1, a2] = [{a}, {b}];\nwriteMoments(writes + \".csv\", Th, \"moments\", a1[]);\n"
    );
    write(at, "mine.edp", &(ran.stdout + &more));
    fs::copy(source("examples/blank/moments.idp"), at.join("moments.idp")).unwrap();
}

/// What is found with another text in a file.
fn verify(at: &Path, script: &str, (from, to): (&str, &str)) -> (Option<i32>, Value, String) {
    let path = at.join(script);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from} is not in {text}");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let ran = run(at, &["verify", "--run", "form.toml", "--json", "o.json"]);
    fs::write(&path, text).unwrap();
    let schema = "src/report/schema/face-off-1.json";
    assert_valid("json", schema, &at.join("o.json"));
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    let told = serde_json::from_str(&told).unwrap();
    (ran.code, told, ran.stdout + &ran.stderr)
}

/// The verdicts of a field's pairs on the finest mesh, of which `with` says whether mine is one of the two.
fn verdicts<'a>(told: &'a Value, field: &str, with: bool) -> Vec<&'a str> {
    let fields = told["fields"].as_array().unwrap();
    let of = fields.iter().find(|of| of["field"] == field).unwrap();
    let pairs = of["pairs"].as_array().unwrap().iter();
    let pairs = pairs.filter(|p| p["n"] == 8 && (p["a"] == "mine" || p["b"] == "mine") == with);
    pairs.map(|p| p["verdict"].as_str().unwrap()).collect()
}

#[test]
fn fluxes_of_darcy_are_functions_of_rt0_with_a_divergence() {
    let folder = folder();
    let at = folder.path();
    let fields = "[fields.q]\nrtol = 1e-11\nnames = { mine = \"RT0(moments)\" }\norders = { l2 = 1 }\n\
                  exact = [\"(1 + x)*pi*sin(pi*x)*sin(pi*y)\", \"-(1 + x)*pi*cos(pi*x)*cos(pi*y)\"]\n\
                  [fields.\"div(q)\"]\nrtol = 1e-11\nnames = { mine = \"div(RT0(moments))\" }\nexact = \"f\"\norders = { l2 = 1 }\n\
                  [fields.p]\nrtol = 1e-11\n";
    with_moments(at, "darcy", "RT0", ["q1", "q2"], fields);
    let (code, told, said) = verify(at, "mine.edp", ("", ""));
    assert_eq!(code, Some(0), "{said}");
    for field in ["q", "div(q)"] {
        assert_eq!(verdicts(&told, field, true), ["agree"; 2], "{said}");
        let of = told["fields"].as_array().unwrap();
        let of = of.iter().find(|of| of["field"] == field).unwrap();
        assert_eq!(of["orders"].as_array().unwrap().len(), 3, "{of}");
    }
    // The order of the two vertices in a row says nothing.
    let turned = ("file << v0 << \",\" << v1", "file << v1 << \",\" << v0");
    assert_eq!(verify(at, "moments.idp", turned).0, Some(0));
    // A sign that follows the cell instead, and one edge that has another flux.
    let of_cell = (
        "<< moments[edge]",
        "<< (v0 < v1 ? moments[edge] : -moments[edge])",
    );
    let one = (
        "<< moments[edge]",
        "<< moments[edge] + (edge == 7 ? 1e-6 : 0.)",
    );
    for fault in [of_cell, one] {
        let (code, told, said) = verify(at, "moments.idp", fault);
        assert_eq!(code, Some(1), "{said}");
        assert_eq!(verdicts(&told, "q", true), ["disagree"; 2], "{said}");
        assert_eq!(verdicts(&told, "div(q)", true), ["disagree"; 2], "{said}");
        assert_eq!(verdicts(&told, "p", true), ["agree"; 2], "{said}");
        assert_eq!(verdicts(&told, "q", false), ["agree"], "{said}");
    }
    // A row that is missing, and one of no edge.
    let missing = ("if (done[edge] == 0)", "if (done[edge] == 0 && edge != 7)");
    let other = ("<< v1 <<", "<< (edge == 7 ? v1 + 1 : v1) <<");
    for fault in [missing, other] {
        let (code, _, said) = verify(at, "moments.idp", fault);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains("is not a function there"), "{said}");
    }
}

#[test]
fn circulations_of_maxwell_are_functions_of_nedelec_with_a_curl() {
    let folder = folder();
    let at = folder.path();
    let fields = "[fields.u]\nrtol = 1e-11\nnames = { mine = \"N1curl(moments)\" }\norders = { l2 = 1 }\nexact = [\"sin(pi*y)\", \"sin(pi*x)\"]\n\
                  [fields.\"curl(u)\"]\nrtol = 1e-11\nnames = { mine = \"curl(N1curl(moments))\" }\nexact = \"c\"\norders = { l2 = 1 }\n";
    with_moments(at, "curl-curl", "RT0Ortho", ["u1", "u2"], fields);
    let (code, told, said) = verify(at, "mine.edp", ("", ""));
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(verdicts(&told, "curl(u)", true), ["agree"; 2], "{said}");
    // The gradient of a hat function, which no curl shows, and a curl of its own.
    let gradient =
        "<< moments[edge] + (max(v0, v1) == 30 ? 1e-6 : (min(v0, v1) == 30 ? -1e-6 : 0.))";
    let bend = "<< moments[edge] + (v0 == 30 ? 1e-6 : 0.)";
    for (to, of_curl) in [(gradient, "agree"), (bend, "disagree")] {
        let (code, told, said) = verify(at, "moments.idp", ("<< moments[edge]", to));
        assert_eq!(code, Some(1), "{said}");
        assert_eq!(verdicts(&told, "u", true), ["disagree"; 2], "{said}");
        assert_eq!(verdicts(&told, "curl(u)", true), [of_curl; 2], "{said}");
    }
}
