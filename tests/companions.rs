//! The companions as programs of their own, against each other and the Rust solver: with nothing from us but a mesh, or not even that.

use std::path::Path;
use std::process::Command;

use crate::common::{Ran, changed_companion, folder, run, scene, source, test_config, told, write};
use faceoff_fem::scene::Expression;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

const OF_SQUARE: &str = "name = \"square\"\n[mesh]\nfile = \"MESH\"\n[boundary]\ndirichlet = [3]\nneumann = [2, 4]\n\
                         contact = [1]\n[data]\nf = \"-2*pi*sin(2*pi*x)\"\n";

/// `FreeFem++-nw paper.edp` in `folder`, as its own header says.
fn freefem(folder: &Path, words: &[&str]) -> Ran {
    let mut command = Command::new("FreeFem++-nw");
    let script = source("freefem/paper.edp");
    command.args(["-v", "0"]).arg(script).args(words);
    told(
        command
            .current_dir(folder)
            .output()
            .expect("FreeFem++-nw: use tests/run"),
    )
}

/// `python3 paper.py`.
fn dolfinx(folder: &Path, words: &[&str]) -> Ran {
    let mut command = Command::new("/usr/bin/python3");
    command
        .arg("-B")
        .arg(source("fenicsx/paper.py"))
        .args(words);
    told(
        command
            .current_dir(folder)
            .output()
            .expect("python3 is there"),
    )
}

fn done(ran: Ran) -> Ran {
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    ran
}

/// The fields u of two files, to rtol of the largest value.
fn same(folder: &Path, a: &str, b: &str, rtol: &str) {
    let words = ["compare", a, b, "--only", "u", "--rtol", rtol];
    let ran = run(folder, &words);
    assert_eq!(ran.code, Some(0), "{a} {b}: {}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.ends_with("\nagree\n"), "{}", ran.stdout);
}

fn number_after(text: &str, word: &str) -> f64 {
    let rest = text
        .split_once(word)
        .unwrap_or_else(|| panic!("{word}: {text}"))
        .1;
    let number = rest.trim_start().split([' ', ',', '\n']).next().unwrap();
    number
        .parse()
        .unwrap_or_else(|_| panic!("{number}: {text}"))
}

/// Each on the Union-Jack mesh that it makes itself; ours solves on FreeFEM's, from the file it wrote, which has 12 digits: enough
/// for sixteenths.
#[test]
fn alone_they_find_what_verify_finds() {
    let folder = folder();
    let at = folder.path();
    write(at, "square.toml", &OF_SQUARE.replace("MESH", "ff.mesh"));
    for (of_freefem, method, of_dolfinx, rtol) in [
        ("CR", "cr", "cr", "1e-12"),
        ("P2", "p2", "p2", "1e-11"),
        // (2.5) in the place of (2.4).
        ("P2", "p2", "chr", "1e-11"),
    ] {
        let words = ["-n", "16", "-method", of_freefem, "-out", "ff"];
        let one = done(freefem(at, &words)).stdout;
        let words = ["-n", "16", "--method", of_dolfinx, "--out", "dx"];
        let two = done(dolfinx(at, &words)).stdout;
        let words = [
            "solve",
            "square.toml",
            "--method",
            method,
            "--out",
            "own.vtu",
            "--json",
            "-",
        ];
        let own = done(run(at, &words)).json();
        same(at, "own.vtu", "ff.vtu", rtol);
        same(at, "own.vtu", "dx_p0_000000.vtu", rtol);

        // What they tell is right as well: the residual of (2.2), and the same errors to P2 on the pieces of the cells.
        let residual = own["contact_residual"].as_f64().unwrap();
        for (text, word) in [
            (&one, "|u + [P]_+| on Gamma_C"),
            (&two, "‖u + [P]₊‖ on Γ_C"),
        ] {
            let told = number_after(text, word);
            assert!((told / residual - 1.0).abs() < 1e-9, "{told} {residual}");
        }
        let weights = [
            number_after(&one, "gamma^(-1/2)"),
            number_after(&two, "γ^(-1/2)"),
            residual / (100.0 * 2.0_f64.sqrt() / 16.0).sqrt(),
        ];
        assert!((weights[0] / weights[2] - 1.0).abs() < 1e-9, "{weights:?}");
        assert!((weights[1] / weights[2] - 1.0).abs() < 1e-9, "{weights:?}");
        for (a, b) in [("H1", "H¹"), ("L2", "L²"), ("|e|_{1,h}", "‖e‖_1,h")] {
            let [a, b] = [number_after(&one, a), number_after(&two, b)];
            assert!(a > 1e-5 && a < 0.2 && (a / b - 1.0).abs() < 1e-6, "{a} {b}");
        }
    }
    for name in ["ff.eps", "ff.vtu", "dx.pvd"] {
        assert!(at.join(name).metadata().unwrap().len() > 100, "{name}");
    }
}

/// 6.2, and the paper's fixed point as it may have been: all three take as many steps.
#[test]
fn the_fixed_point_takes_as_many_steps_in_each_code() {
    let folder = folder();
    let at = folder.path();
    write(at, "square.toml", &OF_SQUARE.replace("MESH", "ff.mesh"));
    let words = [
        "-iteration",
        "fixed-point",
        "-gamma0",
        "4.5",
        "-fine",
        "1",
        "-out",
        "ff",
    ];
    let steps = done(freefem(at, &words)).stdout;
    let steps: usize = steps
        .split_once(" steps")
        .unwrap()
        .0
        .trim()
        .parse()
        .unwrap();
    let words = [
        "--iteration",
        "fixed-point",
        "--gamma0",
        "4.5",
        "--fine",
        "1",
        "--out",
        "dx",
    ];
    let other = done(dolfinx(at, &words)).stdout;
    let other: usize = other
        .split_once(" steps")
        .unwrap()
        .0
        .trim()
        .parse()
        .unwrap();
    let words = [
        "solve",
        "square.toml",
        "--iteration",
        "displacement-new",
        "--gamma0",
        "4.5",
        "--tolerance",
        "1e-7",
        "--max-iterations",
        "300",
        "--json",
        "-",
    ];
    let own = run(at, &words).json()["iterations"].as_u64().unwrap() as usize;
    assert_eq!((steps, other), (own, own));
    assert!((70..90).contains(&own), "{own}");
    same(at, "ff.vtu", "dx_p0_000000.vtu", "1e-9");

    let words = [
        "-example", "6.2", "-N", "3", "-n", "24", "-fine", "1", "-out", "ff",
    ];
    let one = done(freefem(at, &words)).stdout;
    let words = [
        "--example",
        "6.2",
        "-N",
        "3",
        "-n",
        "24",
        "--fine",
        "1",
        "--out",
        "dx",
    ];
    done(dolfinx(at, &words));
    same(at, "ff.vtu", "dx_p0_000000.vtu", "1e-12");
    // Two of the zones end at a side: 2N changes.
    let ends = one.split_once("begins or ends at").unwrap().1;
    assert_eq!(ends.matches('(').count(), 6, "{one}");
}

/// One file of Gmsh's, with tags that count from anywhere: FreeFEM by its plugin, dolfinx by gmsh, ours by our own.
#[test]
fn each_reads_the_original_mesh_by_its_own_reader() {
    let folder = folder();
    let at = folder.path();
    let python = source("target/python/bin/python3");
    let script = "import gmsh\ngmsh.initialize()\ngmsh.option.setNumber('General.Terminal', 0)\nm = gmsh.model\n\
                  p = [m.geo.addPoint(x, y, 0, 0.11) for x, y in [(0, 0), (1, 0), (1, 1), (0, 1)]]\n\
                  l = [m.geo.addLine(p[i], p[(i + 1) % 4]) for i in range(4)]\n\
                  s = m.geo.addPlaneSurface([m.geo.addCurveLoop(l)])\nm.geo.synchronize()\n\
                  m.addPhysicalGroup(1, [l[0]], 21, 'obstacle')\nm.addPhysicalGroup(1, [l[2]], 13, 'held')\n\
                  m.addPhysicalGroup(1, [l[1], l[3]], 12, 'free')\nm.addPhysicalGroup(2, [s], 1, 'body')\nm.mesh.generate(2)\n\
                  gmsh.option.setNumber('Mesh.MshFileVersion', 2.2)\ngmsh.write('own.msh')\nprint(gmsh.__file__)\n";
    let mut made = Command::new(python);
    let made = done(told(
        made.args(["-c", script]).current_dir(at).output().unwrap(),
    ));
    // gmsh alone for dolfinx: with all of that folder it would get another numpy.
    std::fs::create_dir(at.join("modules")).unwrap();
    let module = made.stdout.trim().lines().last().unwrap();
    std::os::unix::fs::symlink(module, at.join("modules/gmsh.py")).unwrap();
    let text = OF_SQUARE.replace("MESH", "own.msh");
    let text = text
        .replace("[3]", "[\"held\"]")
        .replace("[2, 4]", "[\"free\"]");
    write(at, "own.toml", &text.replace("[1]", "[\"obstacle\"]"));

    for (of_freefem, method, rtol) in [("CR", "cr", "1e-12"), ("P2", "p2", "1e-11")] {
        let mesh = at.join("own.msh");
        let out = at.join("ff");
        let mut command = Command::new("FreeFem++-nw");
        command
            .args(["-v", "0", "paper-gmsh.edp", "-mesh"])
            .arg(mesh)
            .args([
                "-contact",
                "21",
                "-dirichlet",
                "13",
                "-fine",
                "1",
                "-method",
                of_freefem,
                "-out",
            ])
            .arg(out)
            .env("FF_LOADPATH", "/usr/lib/freefem++;;")
            .current_dir(source("freefem"));
        done(told(command.output().expect("FreeFem++-nw: use tests/run")));
        let mut command = Command::new("/usr/bin/python3");
        command
            .arg("-B")
            .arg(source("fenicsx/paper.py"))
            .args([
                "--mesh",
                "own.msh",
                "--contact",
                "21",
                "--dirichlet",
                "13",
                "--fine",
                "1",
                "--method",
                method,
                "--out",
                "dx",
            ])
            .env("PYTHONPATH", at.join("modules"))
            .current_dir(at);
        done(told(command.output().expect("python3 is there")));
        done(run(
            at,
            &["solve", "own.toml", "--method", method, "--out", "own.vtu"],
        ));
        same(at, "own.vtu", "ff.vtu", rtol);
        same(at, "own.vtu", "dx_p0_000000.vtu", rtol);
    }
}

#[test]
fn alone_they_refuse_in_words() {
    let folder = folder();
    let at = folder.path();
    let ran = freefem(at, &["-contact", "9"]);
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stdout.contains("no face has the label of -contact"),
        "{}",
        ran.stdout
    );
    assert!(
        freefem(at, &["-method", "P3"])
            .stdout
            .contains("-method is CR or P2")
    );
    let ran = freefem(at, &["-mesh", "none.mesh"]);
    assert!(
        ran.code != Some(0) && ran.stdout.contains("none.mesh"),
        "{}",
        ran.stdout
    );
    // Lags in the displacement are not damped for a large γ.
    let ran = freefem(
        at,
        &["-n", "4", "-iteration", "fixed-point", "-gamma0", "1e-9"],
    );
    assert!(
        ran.code == Some(0) || ran.stdout.contains("not converged"),
        "{}",
        ran.stdout
    );
    let ran = dolfinx(at, &["--contact", "9"]);
    assert_eq!(ran.code, Some(1));
    assert!(
        ran.stderr.contains("the labels are [1, 2, 3, 4]"),
        "{}",
        ran.stderr
    );
}

/// γ = γ₀h is made by the companions too: one whose γ₀h is another than the job's says so.
#[test]
fn a_gamma_that_is_not_gamma0_h_is_refused() {
    for (companion, from, to) in [
        ("freefem", "caseGamma0[c]*h[][", "1.0001*caseGamma0[c]*h[]["),
        (
            "fenicsx",
            "case[\"gamma0\"] * size) <=",
            "1.0001 * case[\"gamma0\"] * size) <=",
        ),
    ] {
        let folder = folder();
        let engine = changed_companion(folder.path(), companion, from, to);
        let engines = format!("rust,{engine}");
        let words = [
            "verify",
            "one-zone",
            "--n",
            "4",
            "--methods",
            "cr",
            "--engines",
            &engines,
        ];
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
        assert!(ran.stderr.contains("gamma0 h"), "{}", ran.stderr);
    }
    // h of the largest cell, where cells differ.
    let folder = folder();
    let words = "[data]\nf = \"-2*pi*sin(2*pi*x)\"";
    let scene = scene(
        folder.path(),
        "one-zone",
        words,
        &format!("[method]\nh = \"global\"\n\n{words}"),
    );
    let ran = run(folder.path(), &["verify", &scene, "--n", "5"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

#[test]
fn theta_may_be_any_real_number() {
    let folder = folder();
    let scene = scene(
        folder.path(),
        "one-zone",
        "[data]",
        "[method]\ngamma0 = 0.05\n\n[data]",
    );
    let methods = "p2(0.25,1),p1(-0.375,1.5),p2(2.5,0.75),cr(0.7,0.1)";
    let words = ["verify", &scene, "--n", "8", "--methods", methods];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    for method in ["p2(nan,1)", "p2(1,inf)", "p2(0,-0)"] {
        let ran = run(folder.path(), &["verify", &scene, "--methods", method]);
        assert_eq!(ran.code, Some(2), "{method}");
    }
}

/// Random formulas, without the parentheses that precedence makes unnecessary.
fn formula() -> impl Strategy<Value = String> {
    let constant = (1u32..40).prop_map(|k| format!("{:?}", f64::from(k) / 8.0));
    let leaf = prop_oneof![
        Just("x".to_owned()),
        Just("y".to_owned()),
        Just("pi".to_owned()),
        constant
    ];
    let one = [
        "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt",
        "abs",
    ];
    let two = ["pow", "atan2", "min", "max"];
    leaf.prop_recursive(5, 40, 3, move |inner| {
        let pair = (inner.clone(), inner.clone());
        prop_oneof![
            4 => (pair.clone(), prop::sample::select(vec![" + ", " - ", "*", "/", "^", "**"]))
                .prop_map(|((a, b), op)| format!("{a}{op}{b}")),
            2 => inner.clone().prop_map(|a| format!("({a})")),
            1 => inner.clone().prop_map(|a| format!("-{a}")),
            3 => (prop::sample::select(one.to_vec()), inner.clone()).prop_map(|(f, a)| format!("{f}({a})")),
            1 => (prop::sample::select(two.to_vec()), pair.clone()).prop_map(|(f, (a, b))| format!("{f}({a}, {b})")),
            1 => (pair.clone(), pair, prop::sample::select(vec!["<", "<=", ">", ">="]))
                .prop_map(|((a, b), (c, d), op)| format!("if({a} {op} {b}, {c}, {d})")),
        ]
    })
}

/// Python's own parser and arithmetic say the same of formulas; `^` is `**` there, and `if` a function.
#[test]
fn formulas_mean_what_python_says() {
    let mut runner = TestRunner::new(test_config(1));
    let texts: Vec<String> = (0..600)
        .map(|_| formula().new_tree(&mut runner).unwrap().current())
        .collect();
    let points = [[0.3, 0.7], [1.25, 0.1], [0.9, 2.5]];
    let script = "import json, math, sys\nnames = {n: getattr(math, n) for n in dir(math)} | {'abs': abs, 'min': min, 'max': max,\n\
                  'If': lambda c, a, b: a if c else b}\nout = []\nfor text, point in json.load(sys.stdin):\n    try:\n\
                  \x20       v = eval(text.replace('^', '**').replace('if(', 'If('), names | {'x': point[0], 'y': point[1]})\n\
                  \x20   except (ValueError, ArithmeticError):\n        v = None\n\
                  \x20   out.append(v if isinstance(v, (int, float)) and math.isfinite(v) else None)\nprint(json.dumps(out))\n";
    let folder = folder();
    let asked: Vec<(&String, [f64; 2])> = texts
        .iter()
        .flat_map(|text| points.map(|point| (text, point)))
        .collect();
    let path = write(
        folder.path(),
        "formulas.json",
        &serde_json::to_string(&asked).unwrap(),
    );
    let mut python = Command::new("/usr/bin/python3");
    python
        .args(["-c", script])
        .stdin(std::fs::File::open(path).unwrap());
    let ran = done(told(python.output().unwrap()));
    let values: Vec<Option<f64>> = serde_json::from_str(&ran.stdout).unwrap();
    let mut compared = 0;
    for ((text, [x, y]), value) in asked.into_iter().zip(values) {
        // What is not a real number in Python may be an infinity on the way here.
        let Some(value) = value.filter(|v| v.abs() < 1e9) else {
            continue;
        };
        let own = Expression::parse(text).unwrap_or_else(|e| panic!("{text}: {e:?}"));
        let own = own.value([x, y, 0.0]);
        assert!(
            (own - value).abs() <= 1e-9 * value.abs().max(1.0),
            "{text} at ({x}, {y}): {own} {value}"
        );
        compared += 1;
    }
    assert!(compared > 600, "{compared}");
}
