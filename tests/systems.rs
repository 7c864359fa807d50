//! Linear systems of two codes: right ones are equal to rounding, and each of ten planted faults is named with its rows, its term and its number.
//!
//! FreeFEM keeps constrained rows by a penalty, dolfinx as rows of the identity, and scikit-fem eliminates them: their values show in the loads only. The faults are in dolfinx's script beside
//! FreeFEM's, and in scikit-fem's beside dolfinx's.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{self, assert_valid, faceoff, folder, run, source, write};

/// What the sentence of each fault must have: alternatives are divided by `|`, as codes come in alphabetical order.
type Faults = [&'static [&'static str]; 10];

const ELASTICITY: Faults = [
    &[
        "everywhere",
        "`div(u)*div(v)*dx`",
        "λ = ",
        "8.0769e10",
        "1.2115e11",
    ],
    &["`div(u)*div(v)*dx`", "6.9231e10", "1.2115e11"],
    &["loads differ", "times -1"],
    &["loads differ", "on `left`", "on `right`"],
    &["`inner(sym(grad(u)), sym(grad(v)))*dx`", "μ = "],
    &[
        "`inner(grad(u), grad(v))*dx`",
        "rotations are in the kernel",
    ],
    &["7800 times `dot(u, v)*dx`|has 7800"],
    &["on `bottom`", "`dot(u, v)*ds(bottom)`", "1e11"],
    &["loads differ", "times 0.5|times 2"],
    &["loads differ", "76518 times `v[1]*dx`|-76518"],
];

const STOKES: Faults = [
    &["of `u` differ", "0.505", "`inner(grad(u), grad(v))*dx`"],
    &["`p` with `u`", "times -1"],
    &["of `u` differ", "`inner(sym(grad(u)), sym(grad(v)))*dx`"],
    &["loads of `u` differ", "`x*v[0]*dx`", "`y*v[1]*dx`"],
    &[
        "constrained rows have other values, on `left`|loads differ in|loads of `u` differ in",
        "times 0.5|times 2|the loads differ in 7 rows, between (0.1667, 0)",
    ],
    &[
        "constrained are 24 rows only in",
        "on `left`|on `top`|on `bottom`|on `right`",
    ],
    &["of `p` differ", "-0.001|0.001 times `u*v*dx`"],
    &[
        "of `u` differ",
        "`(grad(u)[0, 0]*v[0] + grad(u)[1, 0]*v[1])*dx`",
    ],
    &["loads of `u` differ", "`y*v[1]*dx`"],
    &["`u` with `p`", "times 0.5|times 2"],
];

const DARCY: Faults = [
    &["of `q` differ", "times 2|times 0.5", "`dot(u, v)*dx`"],
    &["`q` with `p`", "times -1"],
    &["`p` with `q`", "times -1"],
    &["of `p` differ", "0.5 times `u*v*dx`|has 0.5"],
    &["of `q` differ", "2 times `u[0]*v[0]*dx`|has 2"],
    &["loads of `p` differ", "times -0.5|times -2"],
    &["loads of `q` differ", "times 3|times 0.33333"],
    &[
        "of `q` differ",
        "on `right`",
        "3 times `dot(u, n)*dot(v, n)*ds(right)`|has 3",
    ],
    &["of `q` differ", "0.1 times `div(u)*div(v)*dx`|has 0.1"],
    &["loads of `q` differ", "on `bottom`", "on `top`"],
];

const CURL: Faults = [
    &[
        "4.4",
        "`curl(u)*curl(v)*dx`",
        "the difference is 0 for gradients",
    ],
    &["3.3", "`dot(u, v)*dx`"],
    &["`dot(u, v)*dx`", "gradients are in the kernel"],
    &["`dot(u, v)*dx`", "-3"],
    &["`(u[0]*v[1] - u[1]*v[0])*dx`", "skew-symmetric"],
    &[
        "on `top`",
        "`(u[0]*n[1] - u[1]*n[0])*(v[0]*n[1] - v[1]*n[0])*ds(top)`",
        "5",
    ],
    &["everywhere", "times 0.5|times 2"],
    &["loads differ", "times -1"],
    &["loads differ", "`v[0]*dx`"],
    &["loads differ", "`(v[0]*n[1] - v[1]*n[0])*ds(right)`"],
];

const CONVECTION: Faults = [
    &["everywhere", "2.02", "`dot(grad(u), grad(v))*dx`"],
    &["-3", "`grad(u)[0]*v*dx`", "-1", "`grad(u)[1]*v*dx`"],
    &["5.5", "`u*v*dx`"],
    &[
        "`u*v*dx`",
        "constants are in the kernel|5 times `u*v*dx` on top, which scikit-fem has not",
    ],
    &["on `right`", "4 times `u*v*ds(right)`|has 4"],
    &["2.09|0.09", "`grad(u)[0]*grad(v)[0]*dx`"],
    &["loads differ", "`v*dx`", "7"],
    &["loads differ", "`v*ds(top)`"],
    &[
        "constrained rows have other values, on `left`|loads differ in|loads of `u` differ in",
        "times 0.5|times 2|the loads differ in 7 rows, between (0.1667, 0)",
    ],
    &["constrained are 7 rows only in", "on `"],
];

/// Copies what hides the differences between releases of dolfinx.
fn add_compat(folder: &Path) {
    let name = "compat.py";
    fs::copy(source("examples/blank").join(name), folder.join(name)).unwrap();
}

/// Runs a problem with all faults, and looks at every sentence.
fn told(problem: &str, faults: &Faults, codes: [(&str, [&str; 2], &str, &str); 2]) {
    let at = folder();
    for entry in fs::read_dir(source("tests/systems")).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), at.path().join(entry.file_name())).unwrap();
    }
    add_compat(at.path());
    let table = |(name, program, mesh, fault): (&str, [&str; 2], &str, &str)| {
        let words: Vec<&str> = match name {
            "freefem" => vec![
                program[0], "-v", "0", program[1], "{mesh}", problem, "{out}",
            ],
            _ => vec![
                program[0],
                "each.py",
                program[1],
                "{mesh}",
                "{out}",
                problem,
                fault,
                if fault == "1" { "1" } else { "11" },
            ],
        };
        format!(
            "[codes.{name}]\ncommand = {words:?}\nmesh = \"{mesh}\"\nsystem = \"A.mtx b.mtx dofs.csv\"\n"
        )
    };
    let text = format!(
        "name = \"{problem}\"\n[mesh]\ngenerator = \"union-jack\"\nn = 6\n[parameters]\nfault = {:?}\n{}{}",
        (1..=11).collect::<Vec<_>>(),
        table(codes[0]),
        table(codes[1])
    );
    write(at.path(), "problem.toml", &text);
    let ran = run(
        at.path(),
        &["verify", "--run", "problem.toml", "--json", "o.json"],
    );
    assert_eq!(ran.code, Some(1), "{}\n{}", ran.stdout, ran.stderr);
    assert_valid(
        "json",
        "src/report/schema/face-off-1.json",
        &at.path().join("o.json"),
    );
    let all: Value = serde_json::from_str(&read(at.path(), "o.json")).unwrap();
    let systems = all["systems"].as_array().unwrap();
    assert_eq!(systems.len(), 11);
    let sentence = |k: usize| systems[k]["sentence"].as_str().unwrap();
    assert_eq!(systems[0]["verdict"], "agree", "{}", sentence(0));
    for (k, wanted) in faults.iter().enumerate() {
        assert_eq!(systems[k + 1]["verdict"], "disagree", "fault {}", k + 2);
        for wanted in *wanted {
            let is_told = wanted
                .split('|')
                .any(|words| sentence(k + 1).contains(words));
            assert!(
                is_told,
                "{problem}, fault {}: `{wanted}` is not in {}",
                k + 2,
                sentence(k + 1)
            );
        }
    }
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

fn beside_freefem(problem: &str, faults: &Faults) {
    let freefem = ("freefem", ["FreeFem++-nw", "problem.edp"], "freefem", "");
    told(
        problem,
        faults,
        [
            freefem,
            (
                "dolfinx",
                ["/usr/bin/python3", "problem.py"],
                "msh2",
                "{fault}",
            ),
        ],
    );
}

fn beside_dolfinx(problem: &str, faults: &Faults) {
    let python = source("target/python/bin/python3").display().to_string();
    let dolfinx = ("dolfinx", ["/usr/bin/python3", "problem.py"], "msh2", "1");
    told(
        problem,
        faults,
        [
            dolfinx,
            (
                "scikit-fem",
                [&python, "problem_skfem.py"],
                "msh2",
                "{fault}",
            ),
        ],
    );
}

macro_rules! faults_are_named {
    ($($test:ident: $of:ident $problem:literal $faults:ident;)*) => {
        $(#[test]
        fn $test() {
            $of($problem, &$faults);
        })*
    };
}

faults_are_named! {
    elasticity_of_freefem_and_dolfinx: beside_freefem "elasticity" ELASTICITY;
    stokes_of_freefem_and_dolfinx: beside_freefem "stokes" STOKES;
    darcy_of_freefem_and_dolfinx: beside_freefem "darcy" DARCY;
    curl_of_freefem_and_dolfinx: beside_freefem "curl" CURL;
    convection_of_freefem_and_dolfinx: beside_freefem "convection" CONVECTION;
    elasticity_of_dolfinx_and_scikit_fem: beside_dolfinx "elasticity" ELASTICITY;
    stokes_of_dolfinx_and_scikit_fem: beside_dolfinx "stokes" STOKES;
    darcy_of_dolfinx_and_scikit_fem: beside_dolfinx "darcy" DARCY;
    curl_of_dolfinx_and_scikit_fem: beside_dolfinx "curl" CURL;
    convection_of_dolfinx_and_scikit_fem: beside_dolfinx "convection" CONVECTION;
}

/// The form's own system beside that of a code of the user's own: equal as it is, and with a fault named.
#[test]
fn the_system_of_a_form_is_compared_with_that_of_a_code() {
    let at = folder();
    for name in ["problem.py", "system.py"] {
        fs::copy(source("tests/systems").join(name), at.path().join(name)).unwrap();
    }
    add_compat(at.path());
    let verify = |fault: usize| {
        let text = format!(
            "name = \"own\"\n[mesh]\ngenerator = \"union-jack\"\nn = 6\n[spaces]\nu = \"P1\"\n[form]\n\
             F = \"2*dot(grad(u), grad(v))*dx + (3*grad(u)[0] + grad(u)[1])*v*dx + 5*u*v*dx - 7*v*dx\"\n[dirichlet]\nleft = \"1 + y\"\n\
             [codes]\nuse = [\"rust\"]\n[codes.dolfinx]\ncommand = [\"/usr/bin/python3\", \"problem.py\", \"{{mesh}}\", \"{{out}}\", \"convection\", \"{fault}\"]\n\
             mesh = \"msh2\"\nresult = \"u.csv\"\nsystem = \"A.mtx b.mtx dofs.csv\"\n[fields.u]\nrtol = 1e-11\n"
        );
        write(at.path(), "own.toml", &text);
        run(
            at.path(),
            &["verify", "--run", "own.toml", "--json", "o.json"],
        )
    };
    verify(1);
    let all: Value = serde_json::from_str(&read(at.path(), "o.json")).unwrap();
    assert!(
        all["systems"][0]["sentence"]
            .as_str()
            .unwrap()
            .contains("equal"),
        "{}",
        all["systems"]
    );
    assert_eq!(verify(4).code, Some(1));
    let all = read(at.path(), "o.json");
    assert!(
        all.contains("rust has 5 times `u*v*dx`, dolfinx has 5.5"),
        "{all}"
    );
}

/// What is wrong with a system is refused in words, and with exit code 2.
#[test]
fn systems_that_cannot_be_matched_are_refused() {
    let at = folder();
    let code = |name: &str, dofs: &str| {
        let text = format!(
            "import sys; out = sys.argv[1]\nopen(out + '/A.mtx', 'w').write('%%MatrixMarket matrix coordinate real general\\n2 2 2\\n1 1 1\\n2 2 3\\n')\n\
             open(out + '/b.mtx', 'w').write('%%MatrixMarket matrix array real general\\n2 1\\n1\\n2\\n')\nopen(out + '/dofs.csv', 'w').write('{dofs}')\n"
        );
        write(at.path(), &format!("{name}.py"), &text);
        format!(
            "[codes.{name}]\ncommand = [\"python3\", \"{name}.py\", \"{{out}}\"]\nsystem = \"A.mtx b.mtx dofs.csv\"\n"
        )
    };
    let verify = |a: &str, b: &str| {
        let text = format!("name = \"p\"\n{}{}", code("a", a), code("b", b));
        write(at.path(), "p.toml", &text);
        run(at.path(), &["verify", "--run", "p.toml"])
    };
    let right = "x\\n0\\n1\\n";
    assert_eq!(verify(right, "x\\n1\\n0\\n").code, Some(1));
    for (wrong, words) in [
        ("x\\n0\\n0\\n", "several partners"),
        ("x\\n0\\n2\\n", "no partner"),
        ("x\\n0\\n", "2 rows"),
        ("x\\n0\\nfive\\n", ":3: `five` in column `x`"),
    ] {
        let ran = verify(right, wrong);
        assert_eq!(ran.code, Some(2), "{words}: {}", ran.stdout);
        assert!(
            (ran.stdout.clone() + &ran.stderr).contains(words),
            "{words}: {}\n{}",
            ran.stdout,
            ran.stderr
        );
    }
    let text = read(at.path(), "p.toml").replace("A.mtx b.mtx dofs.csv", "A.mtx b.mtx");
    write(at.path(), "p.toml", &text);
    let ran = run(at.path(), &["verify", "--run", "p.toml"]);
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("its system is 2 files"),
        "{}",
        ran.stderr
    );
}

/// Spaces, a form and Dirichlet values, a mesh, and codes that write its system beside `rust`.
const SPACES: [[&str; 5]; 16] = [
    [
        "u = 'P1'",
        POISSON,
        "u = { left = 'y' }",
        "union-jack",
        "freefem ngsolve mfem",
    ],
    [
        "u = 'P2'",
        POISSON,
        "u = { left = 'y' }",
        "union-jack",
        "ngsolve getfem",
    ],
    [
        "u = 'P3'",
        POISSON,
        "u = { left = 'y' }",
        "union-jack",
        "ngsolve scikit-fem",
    ],
    [
        "u = 'P0'",
        "u*v*dx - x*v*dx + jump(u)*jump(v)*dS",
        "",
        "union-jack",
        "freefem mfem",
    ],
    [
        "u = 'CR'",
        POISSON,
        "u = { left = 'y' }",
        "union-jack",
        "freefem ngsolve",
    ],
    [
        "q = 'RT0'\np = 'P0'",
        DARCY_FORM,
        "q = { left = ['y', 0] }",
        "union-jack",
        "dolfinx freefem scikit-fem getfem",
    ],
    [
        "u = 'N1curl'",
        "curl(u)*curl(v)*dx + dot(u, v)*dx - dot([y, x], v)*dx",
        "u = { left = ['x', 'y'] }",
        "union-jack",
        "ngsolve getfem",
    ],
    [
        "u = 'P1^2'",
        LAME,
        "u = { left = ['y', 0] }",
        "union-jack",
        "scikit-fem mfem",
    ],
    [
        "u = 'P2^2'",
        LAME,
        "u = { left = ['y', 0] }",
        "union-jack",
        "freefem",
    ],
    [
        "u = 'P2^2'\np = 'P1'",
        STOKES_FORM,
        "u = { left = ['y', 0], top = [0, 0] }",
        "union-jack",
        "dolfinx freefem scikit-fem ngsolve",
    ],
    [
        "u = 'CR^2'\np = 'P0'",
        STOKES_FORM,
        "u = { left = ['y', 0], top = [0, 0] }",
        "union-jack",
        "freefem",
    ],
    [
        "u = 'P1'",
        POISSON,
        "u = { left = 'y' }",
        "quadrangles",
        "getfem",
    ],
    [
        "u = 'P2'",
        POISSON,
        "u = { left = 'y' }",
        "quadrangles",
        "scikit-fem",
    ],
    [
        "u = 'P1'",
        CUBIC,
        "u = { left = 'y' }",
        "union-jack",
        "freefem dolfinx scikit-fem ngsolve getfem mfem",
    ],
    [
        "u = 'P2^2'\np = 'P1'",
        NAVIER,
        "u = { left = ['y', 0], top = [0, 0], right = [0, 0] }",
        "union-jack",
        "freefem ngsolve",
    ],
    [
        "u = 'P2^3'",
        "inner(grad(u), grad(v))*dx - x*v[1]*dx",
        "u = { left = ['y', 0, 0] }",
        "union-cube",
        "freefem",
    ],
];
const POISSON: &str = "dot(grad(u), grad(v))*dx + u*v*dx - exp(x)*v*dx";
const DARCY_FORM: &str = "dot(q, test.q)*dx - p*div(test.q)*dx + (x - y - div(q))*test.p*dx";
const CUBIC: &str = "(1 + u*u)*dot(grad(u), grad(v))*dx + u*u*u*v*dx - exp(x)*v*dx";
const NAVIER: &str = "inner(grad(u), grad(v))*dx + dot(dot(grad(u), u), v)*dx - p*div(v)*dx - q*div(u)*dx - x*v[0]*dx";
const LAME: &str = "inner(sym(grad(u)), sym(grad(v)))*dx + 3*div(u)*div(v)*dx - x*v[1]*dx";
const STOKES_FORM: &str = "inner(grad(u), grad(v))*dx - p*div(v)*dx - q*div(u)*dx - x*v[0]*dx";

/// Scripts of one form write equal systems in each space, whatever basis the code has.
#[test]
fn codes_of_forms_write_equal_systems() {
    for [spaces, form, held, mesh, codes] in SPACES {
        let folder = folder();
        let codes = codes.replace(' ', "', '");
        let text = format!(
            "name = 'form'\n[mesh]\ngenerator = '{mesh}'\nn = [2]\n[spaces]\n{spaces}\n[form]\nF = '{form}'\n[dirichlet]\n{held}\n[codes]\nsystems = true\nuse = ['rust', '{codes}']\n"
        );
        write(folder.path(), "form.toml", &text);
        let path = std::env::var("PATH").unwrap_or_default();
        let path = format!("{}:{path}", source("target/python/bin").display());
        let words = ["verify", "form.toml", "--json", "out.json"];
        let ran = common::told(
            faceoff(folder.path())
                .env("PATH", path)
                .args(words)
                .output()
                .expect("the program starts"),
        );
        let all = fs::read_to_string(folder.path().join("out.json")).unwrap_or_default();
        let all: Value = serde_json::from_str(&all).unwrap_or_default();
        let found = all["systems"].as_array().map_or(&[][..], |all| all);
        assert!(!found.is_empty(), "{spaces}: {}", ran.stderr);
        for pair in found {
            assert_eq!(pair["verdict"], "agree", "{spaces}: {pair}");
        }
    }
}
