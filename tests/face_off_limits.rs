//! What one mesh or one set of parameters does not show: what codes converge to, and parameters that one code takes otherwise.

use std::fs;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, write};

/// -Δu = factor · 2π² sin(πx) sin(πy) on the unit square by linear triangles with diagonals of either kind; writes u and its integral, which
/// is 4/π² for the factor 1.
const POISSON: &str = r#"
// The last words: n, diagonals, factor, folder.
int first = ARGV.n - 4, n = atoi(ARGV[first]), flags = atoi(ARGV[first + 1]);
real factor = atof(ARGV[first + 2]);
string out = ARGV[first + 3];
mesh Th = square(n, n, flags = flags);
fespace Vh(Th, P1);
Vh u, v;
solve poisson(u, v) = int2d(Th)(dx(u)*dx(v) + dy(u)*dy(v)) - int2d(Th)(factor*2*pi^2*sin(pi*x)*sin(pi*y)*v)
  + on(1, 2, 3, 4, u = 0);
ofstream numbers(out + "/numbers.csv");
numbers.precision(17);
numbers << "name,value" << endl << "integral," << int2d(Th)(u) << endl;
ofstream f(out + "/u.vtu");
f.precision(17);
f << "<VTKFile type='UnstructuredGrid' version='1.0' byte_order='LittleEndian'><UnstructuredGrid><Piece NumberOfPoints='" << Th.nv
  << "' NumberOfCells='" << Th.nt << "'><Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>" << endl;
for (int i = 0; i < Th.nv; ++i) f << Th(i).x << " " << Th(i).y << " 0" << endl;
f << "</DataArray></Points><Cells><DataArray type='Int64' Name='connectivity' format='ascii'>" << endl;
for (int k = 0; k < Th.nt; ++k) f << Th[k][0] << " " << Th[k][1] << " " << Th[k][2] << endl;
f << "</DataArray><DataArray type='Int64' Name='offsets' format='ascii'>" << endl;
for (int k = 1; k <= Th.nt; ++k) f << 3*k << " ";
f << "</DataArray><DataArray type='UInt8' Name='types' format='ascii'>" << endl;
for (int k = 0; k < Th.nt; ++k) f << "5 ";
f << "</DataArray></Cells><PointData><DataArray type='Float64' Name='u' format='ascii'>" << endl;
for (int i = 0; i < Th.nv; ++i) f << u[][i] << " ";
f << "</DataArray></PointData></Piece></UnstructuredGrid></VTKFile>" << endl;
"#;

/// Two codes with diagonals of their own on these meshes, the second with a load times a factor.
fn verify(factor: f64, n: &str, rtol: f64) -> (String, Value) {
    let folder = folder();
    let at = folder.path();
    write(at, "poisson.edp", POISSON);
    let code = |name: &str, flags: u32, factor: f64| {
        format!(
            "[codes.{name}]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"poisson.edp\", \"{{n}}\", \"{flags}\", \"{factor}\", \"{{out}}\"]\nmesh = \"none\"\nresult = \"u.vtu\"\nnumbers = \"numbers.csv\"\n"
        )
    };
    let text = format!(
        "name = \"x\"\n[mesh]\ngenerator = \"union-jack\"\nn = {n}\n{}{}[fields.u]\nsame = \"problem\"\nrtol = {rtol}\n[numbers.integral]\n\
         same = \"problem\"\nrtol = {rtol}\n",
        code("a", 0, 1.0),
        code("b", 1, factor)
    );
    write(at, "x.toml", &text);
    let ran = run(at, &["verify", "--run", "x.toml", "--json", "o.json"]);
    let path = at.join("o.json");
    let told = fs::read_to_string(&path).unwrap_or_else(|_| panic!("{}", ran.stderr));
    assert_valid("json", "src/report/schema/face-off-1.json", &path);
    (
        ran.stdout + &ran.stderr,
        serde_json::from_str(&told).unwrap(),
    )
}

/// Right codes converge to each other; one with a load 10 % too large does not; and three coarse meshes do
/// not say, but name the next one.
#[test]
fn what_codes_converge_to_is_judged() {
    let (out, right) = verify(1.0, "[4, 8, 16, 32]", 1.5e-2);
    assert_eq!(right["verdict"], "agree", "{out}");
    let of = |told: &Value, kind: &str| told[kind][0]["meetings"][0].clone();
    for kind in ["fields", "numbers"] {
        assert_eq!(of(&right, kind)["found"], "zero", "{kind} {out}");
        for course in of(&right, kind)["courses"].as_array().unwrap() {
            let order = course["order"].as_f64().unwrap();
            assert!((order - 2.0).abs() < 0.2, "{kind} {course}");
        }
    }
    // 4/π², which neither code has on any mesh, lies where it is said to be.
    let exact = 4.0 / std::f64::consts::PI.powi(2);
    for code in ["a", "b"] {
        let found = &right["numbers"][0]["extrapolated"][code];
        let [value, room] = ["value", "room"].map(|key| found[key].as_f64().unwrap());
        assert!(
            (value - exact).abs() <= room && room < 2e-3 * exact,
            "{code} {found}"
        );
    }
    let (out, wrong) = verify(1.1, "[4, 8, 16, 32]", 1.5e-2);
    assert_eq!(wrong["verdict"], "disagree", "{out}");
    for kind in ["fields", "numbers"] {
        assert_eq!(of(&wrong, kind)["found"], "apart", "{kind} {out}");
        let interval = &of(&wrong, kind)["interval"];
        let scale = of(&wrong, kind)["scale"].as_f64().unwrap();
        let [low, high] = [0, 1].map(|k| interval[k].as_f64().unwrap() / scale);
        assert!(
            low <= 0.1 && high >= 0.1 / 1.1,
            "{kind} {interval} of {scale}"
        );
    }
    let (out, coarse) = verify(1.0, "[2, 4, 8]", 1e-3);
    assert_eq!(coarse["verdict"], "undetermined", "{out}");
    assert!(out.contains("add n = 16"), "{out}");
}

/// Two codes that agree at ν = 1/4 alone, as one exchanges λ and μ; one that ignores a parameter, and one that stops too early.
#[test]
fn parameters_that_one_code_takes_otherwise_are_named() {
    let folder = folder();
    let at = folder.path();
    let of = |name: &str, value: &str| {
        let program = format!(
            "import sys; E, nu, tol = map(float, sys.argv[1:4]); l, m = E*nu/(1 + nu)/(1 - 2*nu), E/2/(1 + nu); open(sys.argv[4] + '/n.csv', \
             'w').write('d,%r' % ({value}))"
        );
        format!(
            "[codes.{name}]\ncommand = [\"/usr/bin/python3\", \"-c\", \"{program}\", \"{{E}}\", \"{{nu}}\", \"{{tol}}\", \"{{out}}\"]\n\
             numbers = \"n.csv\"\n"
        )
    };
    let outcomes = |a: &str, b: &str, nu: &str| {
        let text = format!(
            "name = \"y\"\n[parameters]\nE = 7.0\nnu = {nu}\ntol = 1e-3\n{}{}[numbers.d]\nsame = \"discretisation\"\nrtol = 1e-9\n",
            of("a", a),
            of("b", b)
        );
        write(at, "y.toml", &text);
        let words = [
            "verify",
            "--run",
            "y.toml",
            "--diagnose",
            "--json",
            "o.json",
        ];
        let ran = run(at, &words);
        let path = at.join("o.json");
        assert_valid("json", "src/report/schema/face-off-1.json", &path);
        let told: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
        let outcomes = told["diagnosis"]["outcomes"].as_array().unwrap();
        (ran.code, outcomes.clone(), ran.stderr)
    };
    let (code, found, told) = outcomes("l + 2*m", "m + 2*l", "0.25");
    assert_eq!((code, found.len()), (Some(0), 1), "{found:?}");
    assert_eq!(found[0]["parameter"], "nu");
    assert_eq!(found[0]["only_here"], true);
    assert!(
        told.contains("they agree with the value that it has"),
        "{told}"
    );
    // Where they differ it is known from which parameter, and that E is taken alike.
    let (code, found, _) = outcomes("l + 2*m", "m + 2*l", "0.3");
    assert_eq!((code, found.len()), (Some(1), 1), "{found:?}");
    assert_eq!(found[0]["parameter"], "nu");
    let (_, found, told) = outcomes("l", "l/E*7.1", "0.3");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        told.contains("`E` does not move b; changed by a tenth, it moves a by 1.0e-1"),
        "{told}"
    );
    let (_, found, told) = outcomes("m", "m*(1 + tol)", "0.3");
    assert_eq!(found[0]["change"], "tolerances divided by 100", "{found:?}");
    assert!(
        told.contains("b moves by") && told.contains("it stops too early"),
        "{told}"
    );
    let (code, found, _) = outcomes("m", "1*m", "0.3");
    assert_eq!((code, found.len()), (Some(0), 0), "{found:?}");
}
