//! Problems that leave something open: a pressure, a solution of Neumann's problem, a body without supports. Codes that fix it in
//! different ways agree up to that and in nothing less, faults among what is left open included.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Ran, assert_valid, folder, run, source, write};

const STOKES: &str = r#"name = "stokes"
[mesh]
generator = "union-jack"
n = 4
[spaces]
u = "P2^2"
p = "P1"
[parameters]
nu = 0.5
[data]
f = ["(2*nu*pi^2 - pi)*sin(pi*x)*cos(pi*y)", "-(2*nu*pi^2 + pi)*cos(pi*x)*sin(pi*y)"]
g = "sin(pi*x)*cos(pi*y)"
k = "-cos(pi*x)*sin(pi*y)"
[form]
F = "nu*inner(grad(u), grad(v))*dx - p*div(v)*dx - q*div(u)*dx - dot(f, v)*dx"
[dirichlet]
u = { left = ["g", "k"], bottom = ["g", "k"], right = ["g", "k"], top = ["g", "k"] }
[mean]
p = 0
[codes]
use = ["rust", "getfem"]
"#;

const NEUMANN: &str = r#"name = "neumann"
[mesh]
generator = "union-jack"
n = [4, 8]
[spaces]
u = "P2"
[data]
f = "4*pi^2*cos(2*pi*x)"
[form]
F = "inner(grad(u), grad(v))*dx - f*v*dx"
degree = 5
[mean]
u = 0
[codes]
use = ["rust", "dolfinx"]
"#;

/// All of the boundary is closed: the pressure is known up to a constant. With u = -k∇p, of p = cos πx cos πy.
const DARCY: &str = r#"name = "flow"
[mesh]
generator = "union-jack"
n = 4
[spaces]
q = "RT0"
p = "P0"
[data]
k = "1 + x"
f = "pi*sin(pi*x)*cos(pi*y) + 2*(1 + x)*pi^2*cos(pi*x)*cos(pi*y)"
[form]
F = "dot(q, test.q)/k*dx - p*div(test.q)*dx + (f - div(q))*test.p*dx"
[dirichlet]
q = { left = ["0", "0"], right = ["0", "0"], bottom = ["0", "0"], top = ["0", "0"] }
[mean]
p = 0
[codes]
use = ["rust", "dolfinx", "getfem"]
"#;

/// A vector potential, of which the small term leaves a gradient almost free.
const MAXWELL: &str = r#"name = "potential"
[mesh]
generator = "union-jack"
n = 4
[spaces]
u = "N1curl"
[data]
f = ["(pi^2 + 1e-3)*sin(pi*y)", "(pi^2 + 1e-3)*sin(pi*x)"]
c = "pi*(cos(pi*x) - cos(pi*y))"
[form]
F = "curl(u)*curl(v)*dx + 1e-3*dot(u, v)*dx - dot(f, v)*dx"
[dirichlet]
left = ["sin(pi*y)", "sin(pi*x)"]
bottom = ["sin(pi*y)", "sin(pi*x)"]
top = ["sin(pi*y)", "sin(pi*x)"]
right = ["sin(pi*y)", "sin(pi*x)"]
[codes]
use = ["rust", "dolfinx", "getfem"]
"#;

/// What FreeFEM's script is run by, which has another mean.
const SHIFTED: &str = r#"[codes.shifted]
command = ["FreeFem++-nw", "-v", "0", "shifted.edp", "{mesh}", "{out}/u.vtu"]
mesh = "medit"
result = "u.vtu"
"#;

/// A form, and FreeFEM's script of it with another mean, whose fields are judged as `fields` say.
fn shifted(at: &Path, form: &str, fields: &str) -> String {
    write(at, "form.toml", form);
    let ran = run(at, &["write", "form.toml", "--for", "freefem"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let mean = "(0.0)*row0.sum";
    assert!(ran.stdout.contains(mean));
    write(at, "all.toml", &format!("{form}{SHIFTED}{fields}"));
    ran.stdout.replace(mean, "(0.342)*row0.sum")
}

/// Runs a face-off after a text was put in the place of another in the script of a code.
fn verify(
    at: &Path,
    script: &str,
    text: &str,
    (from, to): (&str, &str),
    file: &str,
) -> (Ran, Value) {
    assert!(text.contains(from), "{from} is not in {text}");
    write(at, script, &text.replacen(from, to, 1));
    let ran = run(
        at,
        &[
            "verify", "--run", file, "--json", "o.json", "--report", "page",
        ],
    );
    assert_valid(
        "json",
        "src/report/schema/face-off-1.json",
        &at.join("o.json"),
    );
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    (ran, serde_json::from_str(&told).unwrap())
}

/// All pairs of a field on all levels.
fn pairs<'a>(told: &'a Value, name: &str) -> Vec<&'a Value> {
    let mut fields = told["fields"].as_array().unwrap().iter();
    let field = fields.find(|f| f["field"] == name).unwrap();
    field["pairs"].as_array().unwrap().iter().collect()
}

fn of_pair<'a>(told: &'a Value, name: &str, codes: [&str; 2]) -> &'a Value {
    let is = |pair: &&&Value| {
        codes
            .iter()
            .all(|code| pair["a"] == *code || pair["b"] == *code)
    };
    let all = pairs(told, name);
    all.iter().find(is).unwrap()
}

fn size(removed: &Value) -> f64 {
    removed["parts"][0]["size"].as_f64().unwrap()
}

#[test]
fn pressures_agree_up_to_a_constant_and_in_nothing_less() {
    let folder = folder();
    let at = folder.path();
    let fields = "[fields.u]\nrtol = 1e-11\n[fields.p]\nrtol = 1e-10\nup_to = \"constant\"\n\
                  exact = \"cos(pi*x)*cos(pi*y) + 5\"\norders = { l2 = 2 }\n";
    let script = shifted(at, STOKES, fields);
    let (ran, told) = verify(at, "shifted.edp", &script, ("", ""), "all.toml");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    for pair in pairs(&told, "p") {
        assert!(pair["max_rel"].as_f64().unwrap() < 1e-12, "{pair}");
    }
    let one = of_pair(&told, "p", ["rust", "shifted"]);
    assert!((size(&one["removed"][0]) - 0.342).abs() < 1e-12, "{one}");
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert!(page.contains("0.342"));
    let faults = [
        ("real nu = 0.5", "real nu = 0.5005"),
        // Within what is open: the value at a vertex is set after p was found, and a constant on a part of the domain.
        ("C out2 = p;", "p[](Vh(0, 13)) = 0;\nC out2 = p;"),
        ("C out2 = p;", "C out2 = p + 1e-3*(x < 0.4);"),
    ];
    for fault in faults {
        let (ran, told) = verify(at, "shifted.edp", &script, fault, "all.toml");
        assert_eq!(ran.code, Some(1), "{fault:?} {}", ran.stdout);
        let p = of_pair(&told, "p", ["rust", "shifted"]);
        assert_eq!(
            (&p["verdict"], p.get("equal_after")),
            (&"disagree".into(), None),
            "{fault:?}"
        );
        assert_eq!(of_pair(&told, "p", ["rust", "getfem"])["verdict"], "agree");
    }
    // Not asked for, it is told and not passed over; and where Dirichlet values are given nothing is open.
    write(
        at,
        "all.toml",
        &format!("{STOKES}{SHIFTED}[fields.p]\nrtol = 1e-10\n"),
    );
    let (ran, told) = verify(at, "shifted.edp", &script, ("", ""), "all.toml");
    assert_eq!(ran.code, Some(1));
    let p = of_pair(&told, "p", ["rust", "shifted"]);
    assert_eq!(p["verdict"], "disagree");
    assert!((size(&p["equal_after"][0]) - 0.342).abs() < 1e-12, "{p}");
    assert!(ran.stdout.contains("equal after adding"), "{}", ran.stdout);
    write(
        at,
        "all.toml",
        &format!("{STOKES}{SHIFTED}[fields.u]\nup_to = \"constant\"\n"),
    );
    let ran = run(at, &["verify", "--run", "all.toml"]);
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("Dirichlet values on `left` fix `u`"),
        "{}",
        ran.stderr
    );
}

#[test]
fn solutions_of_neumanns_problem_have_orders_up_to_a_constant() {
    let folder = folder();
    let at = folder.path();
    let fields = "[fields.u]\nrtol = 1e-10\nup_to = \"constant\"\nexact = \"cos(2*pi*x) - 3\"\norders = { l2 = 3, h1 = 2 }\n";
    let script = shifted(at, NEUMANN, fields);
    let (ran, told) = verify(at, "shifted.edp", &script, ("", ""), "all.toml");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let one = of_pair(&told, "u", ["rust", "shifted"]);
    assert!((size(&one["removed"][0]) - 0.342).abs() < 1e-12, "{one}");
    let (ran, _) = verify(
        at,
        "shifted.edp",
        &script,
        ("4.0*pi^2", "4.004*pi^2"),
        "all.toml",
    );
    assert_eq!(ran.code, Some(1));
    // The dof that should have been fixed in the equations was overwritten in the result.
    let (ran, told) = verify(
        at,
        "shifted.edp",
        &script,
        ("C out0 = u;", "u[][7] = 0;\nC out0 = u;"),
        "all.toml",
    );
    assert_eq!(ran.code, Some(1));
    assert_eq!(
        of_pair(&told, "u", ["dolfinx", "shifted"])["verdict"],
        "disagree"
    );
}

#[test]
fn pressures_of_closed_flows_agree_up_to_a_constant_with_fluxes_of_rt0() {
    let folder = folder();
    let at = folder.path();
    let fields = "[fields.q]\nrtol = 1e-11\norders = { l2 = 1 }\n\
                  exact = [\"(1 + x)*pi*sin(pi*x)*cos(pi*y)\", \"(1 + x)*pi*cos(pi*x)*sin(pi*y)\"]\n\
                  [fields.p]\nrtol = 1e-10\nup_to = \"constant\"\norders = { l2 = 1 }\nexact = \"cos(pi*x)*cos(pi*y) + 5\"\n";
    let script = shifted(at, DARCY, fields);
    let (ran, told) = verify(at, "shifted.edp", &script, ("", ""), "all.toml");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    for name in ["q", "p"] {
        for pair in pairs(&told, name) {
            assert!(pair["max_rel"].as_f64().unwrap() < 1e-12, "{pair}");
        }
    }
    let one = of_pair(&told, "p", ["rust", "shifted"]);
    assert!((size(&one["removed"][0]) - 0.342).abs() < 1e-12, "{one}");
    let faults = [
        ("func kX = 1.0 + x;", "func kX = 1.001 + x;", "q"),
        // Within what is open: a constant on a part of the domain.
        ("D out2 = p;", "D out2 = p + 1e-3*(x < 0.4);", "p"),
    ];
    for (from, to, wrong) in faults {
        let fault = (from, to);
        let (ran, told) = verify(at, "shifted.edp", &script, fault, "all.toml");
        assert_eq!(ran.code, Some(1), "{fault:?} {}", ran.stdout);
        let of = of_pair(&told, wrong, ["rust", "shifted"]);
        assert_eq!(of["verdict"], "disagree", "{fault:?}");
        for name in ["q", "p"] {
            let others = of_pair(&told, name, ["rust", "getfem"]);
            assert_eq!(others["verdict"], "agree", "{fault:?}");
        }
    }
}

#[test]
fn vector_potentials_agree_up_to_a_gradient_and_in_nothing_less() {
    let folder = folder();
    let at = folder.path();
    write(at, "form.toml", MAXWELL);
    let ran = run(at, &["write", "form.toml", "--for", "freefem"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    // Another gauge: the gradient of the piecewise linear interpolant of x y is added, which is one in the space.
    let before = "D out0 = u1;";
    let with = |more: &str| format!("Vh [g1, g2] = {more};\nu1[] += g1[];\n{before}");
    let gauge = with("[y, x]");
    assert!(ran.stdout.contains(before));
    let script = ran.stdout.replacen(before, &gauge, 1);
    let of_curl = "[fields.\"curl(u)\"]\nrtol = 1e-9\nexact = \"c\"\norders = { l2 = 1 }\n";
    let open = format!("[fields.u]\nrtol = 1e-9\nup_to = \"gradient\"\n{of_curl}");
    write(at, "all.toml", &format!("{MAXWELL}{SHIFTED}{open}"));
    let (ran, told) = verify(at, "shifted.edp", &script, ("", ""), "all.toml");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let curls = of_pair(&told, "curl(u)", ["rust", "shifted"]);
    assert!(curls["max_rel"].as_f64().unwrap() < 1e-12, "{curls}");
    let faults = [
        // The curl is too large.
        with("[y - 1e-3*y, x]"),
        // Within what is open: a gradient on a part of the domain.
        with("[y + 1e-3*y*(x < 0.4), x + 1e-3*x*(x < 0.4)]"),
    ];
    for wrong in faults {
        let fault = (&*gauge, &*wrong);
        let (ran, told) = verify(at, "shifted.edp", &script, fault, "all.toml");
        assert_eq!(ran.code, Some(1), "{wrong} {}", ran.stdout);
        for name in ["u", "curl(u)"] {
            let of = of_pair(&told, name, ["rust", "shifted"]);
            assert_eq!(of["verdict"], "disagree", "{wrong}");
            let others = of_pair(&told, name, ["rust", "getfem"]);
            assert_eq!(others["verdict"], "agree", "{wrong}");
        }
    }
    // If it is not asked for, a gradient is a difference.
    let closed = open.replace("up_to = \"gradient\"\n", "");
    write(at, "all.toml", &format!("{MAXWELL}{SHIFTED}{closed}"));
    let (ran, told) = verify(at, "shifted.edp", &script, ("", ""), "all.toml");
    assert_eq!(ran.code, Some(1));
    let of = of_pair(&told, "u", ["rust", "shifted"]);
    assert_eq!(of["verdict"], "disagree", "{of}");
    let curls = of_pair(&told, "curl(u)", ["rust", "shifted"]);
    assert_eq!(curls["verdict"], "agree", "{curls}");
}

#[test]
fn bodies_without_supports_agree_up_to_rigid_motions() {
    let folder = folder();
    let at = folder.path();
    for name in ["body.edp", "body_skfem.py", "body_dolfinx.py"] {
        fs::copy(source("tests/open").join(name), at.join(name)).unwrap();
    }
    let python = source("target/python/bin/python");
    let text = fs::read_to_string(source("tests/open/body.toml")).unwrap();
    let text = text.replace("PYTHON", &python.display().to_string());
    write(at, "all.toml", &text);
    let script = fs::read_to_string(at.join("body_skfem.py")).unwrap();
    let (ran, told) = verify(at, "body_skfem.py", &script, ("", ""), "all.toml");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let turned = &of_pair(&told, "u", ["skfem", "dolfinx"])["removed"][0]["parts"][0];
    // The two are pinned so that one turns with the bending: by what its left side would else turn.
    let spin = turned["of_a"][2].as_f64().unwrap() - turned["of_b"][2].as_f64().unwrap();
    assert!(spin.abs() > 0.05, "{turned}");
    let faults = [
        (
            "mu = float(sys.argv[3])",
            "mu = 1.0001 * float(sys.argv[3])",
        ),
        // Within what is open, but for its second order: a rotation by an angle, as of large strains.
        (
            "values = np",
            "u[basis.nodal_dofs] += np.array([[np.cos(0.01) - 1, -np.sin(0.01)], [np.sin(0.01), np.cos(0.01) - 1]]) @ mesh.p\nvalues = np",
        ),
    ];
    for fault in faults {
        let (ran, told) = verify(at, "body_skfem.py", &script, fault, "all.toml");
        assert_eq!(ran.code, Some(1), "{fault:?} {}", ran.stdout);
        assert_eq!(
            of_pair(&told, "u", ["freefem", "dolfinx"])["verdict"],
            "agree"
        );
        assert_eq!(
            of_pair(&told, "u", ["skfem", "dolfinx"])["verdict"],
            "disagree"
        );
    }
    write(at, "all.toml", &text.replace("up_to = \"rigid\"\n", ""));
    let (ran, told) = verify(at, "body_skfem.py", &script, ("", ""), "all.toml");
    assert_eq!(ran.code, Some(1));
    for pair in pairs(&told, "u") {
        assert_eq!(pair["equal_after"][0]["up_to"], "rigid", "{pair}");
    }
}

#[test]
fn complex_fields_are_one_and_free_in_their_phase() {
    let folder = folder();
    let at = folder.path();
    let table = |names: [&str; 2], turn: f64, fault: f64| {
        let rows = (0..40).map(|k| {
            let [x, y] = [k % 8, k / 8].map(|k| f64::from(k) / 8.0);
            let (phase, size) = (3.0 * x + turn, 1.0 + y + if k == 17 { fault } else { 0.0 });
            format!(
                "{x},{y},{:?},{:?}\n",
                size * phase.cos(),
                size * phase.sin()
            )
        });
        format!(
            "x,y,{},{}\n{}",
            names[0],
            names[1],
            rows.collect::<String>()
        )
    };
    write(at, "a.csv", &table(["u_re", "u_im"], 0.0, 0.0));
    write(at, "b.csv", &table(["real_u", "imag_u"], 0.7, 0.0));
    let compared = |more: &[&str]| {
        run(
            at,
            &[&["compare", "a.csv", "b.csv", "--only", "u"], more].concat(),
        )
    };
    let plain = compared(&[]);
    assert_eq!(plain.code, Some(1));
    assert!(
        plain.stdout.contains("turning the phase of b by -40.11°"),
        "{}",
        plain.stdout
    );
    let asked = compared(&["--field", "u:up_to=phase", "--json", "o.json"]);
    assert_eq!(asked.code, Some(0), "{}", asked.stdout);
    assert_valid(
        "json",
        "src/report/schema/compare-1.json",
        &at.join("o.json"),
    );
    assert_eq!(compared(&["--field", "u:up_to=sign"]).code, Some(1));
    // The magnitude has no phase, and a fault in it is no phase either.
    let magnitude = run(at, &["compare", "a.csv", "b.csv", "--only", "|u|"]);
    assert_eq!(magnitude.code, Some(0), "{}", magnitude.stdout);
    write(at, "b.csv", &table(["real_u", "imag_u"], 0.7, 1e-6));
    assert_eq!(compared(&["--field", "u:up_to=phase"]).code, Some(1));
}
