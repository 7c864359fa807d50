//! Codes that are all right and differ: an ill-conditioned scheme, and one with two solutions.

use serde_json::Value;

use crate::common::{assert_valid, changed_companion, folder, run, source, write};

fn case_of(outcome: &Value) -> &Value {
    &outcome["cases"][0]
}

/// 1 × 0.001, held on the left, contact along the bottom: rounding in one row moves the far end by 1e8 times as much.
const THIN: &str = r#"
name = "thin"
[mesh]
generator = "union-jack"
n = 16
size = [1, 1e-3]
[boundary]
dirichlet = ["left"]
neumann = ["right", "top"]
contact = ["bottom"]
[data]
f = "-2*pi*sin(2*pi*x)"
"#;

#[test]
fn what_rounding_moves_agrees_conditioned_and_a_fault_does_not() {
    let folder = folder();
    let at = folder.path();
    write(at, "thin.toml", THIN);
    let words = [
        "verify",
        "thin.toml",
        "--json",
        "out.json",
        "--junit",
        "out.xml",
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let last = ran.stdout.lines().last().unwrap();
    assert!(
        last.starts_with("agree (conditioned): the answers differ by "),
        "{last}"
    );
    assert!(last.contains("rounding alone may move them by"), "{last}");
    let schema = source("src/report/schema/verify-1.json");
    assert_valid("json", &schema.to_string_lossy(), &at.join("out.json"));
    let outcome: Value =
        serde_json::from_slice(&std::fs::read(at.join("out.json")).unwrap()).unwrap();
    let case = case_of(&outcome);
    let part = &case["settled"][0]["parts"][0];
    assert!(part["condition"].as_f64().unwrap() > 1e5, "{part}");
    let beyond = |p: &&Value| p["max_rel"].as_f64() > p["tolerance"].as_f64();
    let fields: Vec<&Value> = case["pairs"]
        .as_array()
        .unwrap()
        .iter()
        .filter(beyond)
        .collect();
    assert!(!fields.is_empty());
    for field in fields {
        assert_eq!(field["verdict"], "agree (conditioned)", "{field}");
        assert!(
            field["max_rel"].as_f64() <= field["conditioned"].as_f64(),
            "{field}"
        );
    }
    let junit = std::fs::read_to_string(at.join("out.xml")).unwrap();
    assert!(junit.contains("failures=\"0\" errors=\"0\""), "{junit}");

    // What conditioning allows is no excuse for what the residual shows.
    let engine = changed_companion(at, "freefem", "(f*v)", "((1 + 1e-4)*f*v)");
    let ran = run(
        at,
        &[
            "verify",
            "thin.toml",
            "--engines",
            &format!("rust,{engine}"),
        ],
    );
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    let last = ran.stdout.lines().last().unwrap();
    assert!(
        last.starts_with("disagree: changed: f is × 1.000100"),
        "{last}"
    );
}

/// Held along the top, u is small nearly everywhere: elimination leaves a row with small terms a rounding of the large ones.
#[test]
fn a_row_with_small_terms_is_no_fault() {
    let folder = folder();
    let wavy = THIN.to_owned() + "psi = \"0.01*cos(9*x)\"\n";
    let held_on_top = wavy
        .replace("dirichlet = [\"left\"]", "dirichlet = [\"top\"]")
        .replace("\"right\", \"top\"", "\"left\", \"right\"")
        .replace("n = 16", "n = 24");
    write(folder.path(), "thin.toml", &held_on_top);
    let ran = run(folder.path(), &["verify", "thin.toml", "--methods", "p2"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

/// Two cells, one contact face with two points, γ₀ below what Proposition 4.2 asks for.
const TWO: &str = r#"
name = "two"
[mesh]
file = "two.msh"
[boundary]
dirichlet = ["top"]
neumann = ["left", "right"]
contact = ["bottom"]
[data]
f = "if(x < 0.8015418398431017, 38.54120251181655, -36.58353029149689)"
g = "0.6705759162753228*(x-0.35741410335388696)"
[method]
gamma0 = 0.010227514332361886
contact_quadrature = "gauss-2"
"#;
const MESH: &str = r#"$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
4
1 1 "bottom"
1 2 "right"
1 3 "top"
1 4 "left"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 -0.1453610615331987 0.05194617483615526 0
4 0.8546389384668013 0.05194617483615526 0
$EndNodes
$Elements
6
1 1 2 1 1 1 2
2 1 2 2 2 2 4
3 1 2 3 3 4 3
4 1 2 4 4 3 1
5 2 2 0 5 1 2 4
6 2 2 0 5 1 4 3
$EndElements
"#;

#[test]
fn two_solutions_are_told_as_such() {
    let folder = folder();
    let at = folder.path();
    write(at, "two.msh", MESH);
    write(at, "two.toml", TWO);
    // Nothing is changed but where Newton's method starts.
    let engine = changed_companion(
        at,
        "freefem",
        "  if (!broken) u[] = coefficients;",
        "  real[int] held = fixed(0, Wh, tgv=1);\n\
         for (int i = 0; i < coefficients.n; ++i) coefficients[i] += 0.3*(1 - held[i])*sin(4 + 5.7*i*i);\n\
         if (!broken) u[] = coefficients;",
    );
    let engines = format!("rust,{engine}");
    let words = [
        "verify",
        "two.toml",
        "--engines",
        &engines,
        "--methods",
        "cr",
        "--json",
        "out.json",
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let last = ran.stdout.lines().last().unwrap();
    assert!(
        last.starts_with("several solutions: the codes rust and changed have found two"),
        "{last}"
    );
    assert!(
        last.contains("face [0, 1]") && last.contains("no code is wrong"),
        "{last}"
    );
    let schema = source("src/report/schema/verify-1.json");
    assert_valid("json", &schema.to_string_lossy(), &at.join("out.json"));
    let outcome: Value =
        serde_json::from_slice(&std::fs::read(at.join("out.json")).unwrap()).unwrap();
    let case = case_of(&outcome);
    assert_eq!(case["verdict"], "several solutions");
    let several = &case["settled"][0]["several"];
    assert_eq!(
        (&several["found"], &several["tried"]),
        (&2.into(), &2.into()),
        "{several}"
    );
    assert!(several["apart"].as_f64().unwrap() > 0.05);

    // With a γ₀ that the condition allows there is one, wherever the iteration starts; `solve` says which γ₀ that is.
    let least = several["unique_above"].as_f64().unwrap();
    for (gamma0, warns) in [(0.99 * least, true), (1.01 * least, false)] {
        let ran = run(at, &["solve", "two.toml", "--gamma0", &gamma0.to_string()]);
        assert_eq!(
            ran.stderr.contains("the scheme may have several solutions"),
            warns,
            "{}",
            ran.stderr
        );
        assert_eq!(ran.code, Some(0));
    }
    let one = TWO.replace("0.010227514332361886", &(1.01 * least).to_string());
    write(at, "two.toml", &one);
    assert_eq!(run(at, &words).code, Some(0));
}
