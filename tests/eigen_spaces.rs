//! Eigenproblems in other spaces and on other cells than triangles with P2: codes agree in each, and faults are caught; and bodies without supports, whose
//! rigid motions `drop_kernel` leaves out.

use std::path::Path;

use serde_json::{Value, json};

use crate::common::{Ran, folder, in_turn, source, times, write};
use crate::eigen::{assert_agree, residual, run, verify, with_fault};

/// The Laplacian with u = 0 on the boundary.
struct Case {
    generator: &'static str,
    n: usize,
    space: &'static str,
    codes: &'static str,
    /// The lowest eigenvalue is π² times this number, up to this part of it.
    exact: (f64, f64),
}

const FIVE: &str = "\"rust\", \"freefem\", \"dolfinx\", \"scikit-fem\", \"ngsolve\"";
/// FreeFEM has neither quadrangles nor, without plugins, P3.
const FOUR: &str = "\"rust\", \"dolfinx\", \"scikit-fem\", \"ngsolve\"";

impl Case {
    fn text(&self) -> String {
        let Case {
            generator,
            n,
            space,
            codes,
            exact: (factor, part),
        } = self;
        let is_broken = space.starts_with("DG");
        let a = match is_broken {
            true => DG,
            false => "inner(grad(u), grad(v))*dx",
        };
        let in_space = ["union-cube", "hexahedra"].contains(generator);
        let sides: &[&str] = match (is_broken, in_space) {
            (true, _) => &[],
            (_, true) => &["left", "right", "bottom", "top", "front", "back"],
            (_, false) => &["left", "right", "bottom", "top"],
        };
        let held: String = sides.iter().map(|side| format!("{side} = 0\n")).collect();
        let exact = factor * std::f64::consts::PI.powi(2);
        format!(
            "name = \"modes\"\n[mesh]\ngenerator = \"{generator}\"\nn = {n}\n[spaces]\nu = \"{space}\"\n[eigen]\na = \"{a}\"\n\
             m = \"u*v*dx\"\ncount = 4\n[dirichlet]\n{held}[codes]\nuse = [{codes}]\n[spectra.lambda]\nexact = [{exact}]\n\
             exact_rtol = {part}\n"
        )
    }
}

/// The symmetric interior penalty method.
const DG: &str = "inner(grad(u), grad(v))*dx - dot(avg(grad(u)), n('+'))*jump(v)*dS - dot(avg(grad(v)), n('+'))*jump(u)*dS \
                  + 10/avg(h)*jump(u)*jump(v)*dS - dot(grad(u), n)*v*ds - dot(grad(v), n)*u*ds + 20/h*u*v*ds";

fn assert_caught(ran: &Ran, told: &Value, what: &str) {
    assert_eq!(ran.code, Some(1), "{what}: {}{}", ran.stdout, ran.stderr);
    assert_eq!(residual(told, "wrong")["verdict"], "disagree", "{what}");
    assert_eq!(residual(told, "rust")["verdict"], "agree", "{what}");
}

/// scikit-fem's script in the place of all codes but ours, one text in it put in the place of another.
fn with_fault_in_python(at: &Path, text: &str, (from, to): (&str, &str)) -> (Ran, Value) {
    write(at, "form.toml", text);
    let ran = run(at, &["write", "form.toml", "--for", "scikit-fem"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(ran.stdout.contains(from), "{from} is not in {}", ran.stdout);
    write(at, "wrong.py", &ran.stdout.replacen(from, to, 1));
    let python = source("target/python/bin/python");
    let wrong = format!(
        "[codes.wrong]\ncommand = [\"{}\", \"wrong.py\", \"{{mesh}}\", \"{{out}}/modes.vtu\"]\nmesh = \"msh2\"\nresult = \"modes.vtu\"\n\
         numbers = \"modes.csv\"\n",
        python.display()
    );
    let start = text.find("use = [").unwrap();
    let end = start + text[start..].find('\n').unwrap();
    let codes = format!("use = [\"rust\"]\n{wrong}");
    verify(at, &[&text[..start], &codes, &text[end..]].concat())
}

#[test]
fn modes_agree_in_every_kind_of_space() {
    let folder = folder();
    let at = folder.path();
    let cases = [
        ("union-jack", 4, "P3", FOUR, (2.0, 1e-4)),
        ("union-jack", 4, "CR", FIVE, (2.0, 2e-2)),
        ("union-jack", 8, "DG1", FIVE, (2.0, 0.03)),
        ("quadrangles", 8, "P1", FOUR, (2.0, 0.03)),
        ("hexahedra", 2, "P2", FOUR, (3.0, 1e-2)),
        ("quadrangles", 4, "P2", FOUR, (2.0, 1e-3)),
        ("union-cube", 4, "P2", FIVE, (3.0, 0.01)),
    ];
    // The last two have elements and meshes that others have as well: with `tests/run --all`.
    let count = if times() > 1 { 7 } else { 5 };
    for (k, (generator, n, space, codes, exact)) in (0..).zip(cases).take(count) {
        let case = Case {
            generator,
            n,
            space,
            codes,
            exact,
        };
        let text = case.text();
        let (ran, told) = verify(at, &text);
        assert_agree(&ran, &told, if codes == FIVE { 5 } else { 4 });
        let rows = told["spectra"][0]["exact"].as_array().unwrap();
        let agrees = |row: &Value| row["verdict"] == "agree";
        assert!(!rows.is_empty() && rows.iter().all(agrees), "{rows:?}");
        // A little more mass; and a mode with a part of another, which has all the values right: one of them in every run.
        let name = format!("{space} {generator}");
        if codes == FIVE {
            let faults = [
                ("du*v);", "1.0001*du*v);"),
                (
                    "u[] = modes(:, mode);",
                    "u[] = modes(:, mode);\nreal[int] other = modes(:, 1);\nif (mode == 0) u[] += 1e-3*other;",
                ),
            ];
            for fault in in_turn(k, 2, faults) {
                let (ran, told) = with_fault(at, &text, "modes", fault);
                assert_caught(&ran, &told, &format!("{name}: {fault:?}"));
            }
        } else {
            let faults = [
                ("        du*v\n", "        1.0001*du*v\n"),
                (
                    "modes[free] = found\n",
                    "modes[free] = found\nmodes[:, 0] += 1e-3*modes[:, 1]\n",
                ),
            ];
            for fault in in_turn(k, 2, faults) {
                let (ran, told) = with_fault_in_python(at, &text, fault);
                assert_caught(&ran, &told, &format!("{name}: {fault:?}"));
            }
        }
    }
}

/// A square of an elastic body that nothing holds: three rigid motions, and vibrations.
const FREE: &str = r#"name = "free"
[mesh]
generator = "union-jack"
n = 4
[spaces]
u = "P2^2"
[eigen]
a = "inner(sym(grad(u)), sym(grad(v)))*dx"
m = "dot(u, v)*dx"
count = 8
shift = 4
[codes]
use = ["rust", "freefem", "dolfinx", "scikit-fem", "ngsolve"]
[spectra.lambda]
drop_kernel = 1e-8
"#;

/// Lamé's: u = (cos πx, 0), (0, cos πy) and (cos πx sin πy, -sin πx cos πy) vibrate at λ = π² where Poisson's ratio is 0.
#[test]
fn a_free_body_vibrates_beside_its_rigid_motions() {
    let folder = folder();
    let at = folder.path();
    let (ran, told) = verify(at, FREE);
    assert_agree(&ran, &told, 5);
    let pairs = told["spectra"][0]["pairs"].as_array().unwrap();
    for pair in pairs {
        assert_eq!(pair["kernel"], json!([3, 3]), "{pair}");
        let of_lame = &pair["values"].as_array().unwrap()[3..6];
        let part = |value: &Value| value[0].as_f64().unwrap() / std::f64::consts::PI.powi(2);
        assert!(
            of_lame.iter().all(|value| (part(value) - 1.0).abs() < 0.02),
            "{pair}"
        );
    }
    let faults = [
        ("(0.5)*dx(du2)*dy(v1)", "(0.4999)*dx(du2)*dy(v1)"),
        ("+ du2*v2", "+ 1.0001*du2*v2"),
        // Within what is free: a rigid motion added to a vibration.
        (
            "u1[] = modes(:, mode);",
            "u1[] = modes(:, mode);\nVh [g1, g2] = [1, 0];\nif (mode > 5) u1[] += 1e-3*g1[];",
        ),
    ];
    for fault in faults {
        let (ran, told) = with_fault(at, FREE, "free", fault);
        assert_caught(&ran, &told, &format!("{fault:?}"));
    }
    // A body that springs hold weakly has fewer values in its kernel, which is told.
    let fault = ("dx(du1)*dx(v1)\n", "dx(du1)*dx(v1) + 1e-3*du1*v1\n");
    let (ran, told) = with_fault(at, FREE, "free", fault);
    assert_caught(&ran, &told, "springs");
    let pair = &told["spectra"][0]["pairs"][0];
    assert_eq!(pair["kernel"], json!([3, 1]), "{pair}");
    assert!(ran.stdout.contains("wrong has"), "{}", ran.stdout);
    // Nothing is left out unasked, and a part that leaves out vibrations leaves too few.
    let few = FREE.replace(", \"dolfinx\", \"scikit-fem\", \"ngsolve\"", "");
    let all = few.replace("drop_kernel = 1e-8", "");
    let (ran, told) = verify(at, &all);
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    assert_eq!(told["spectra"][0]["pairs"][0]["kernel"], json!([0, 0]));
    let (ran, _) = verify(at, &few.replace("1e-8", "0.5"));
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    assert!(
        ran.stdout.contains("of the lowest 8 eigenvalues"),
        "{}",
        ran.stdout
    );
    for bad in ["-1e-8", "nan", "inf"] {
        write(at, "form.toml", &few.replace("1e-8", bad));
        let ran = run(at, &["verify", "form.toml"]);
        assert_eq!(ran.code, Some(2), "{bad}: {}", ran.stdout);
        assert!(ran.stderr.contains("is not a tolerance"), "{}", ran.stderr);
    }
}
