//! Face-offs of results at several times, of levels in a time step, and verdicts that say no more than was seen.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Ran, assert_valid, folder, run, write};

/// Writes a series u = factor·exp(-t)·(1 + x) on two triangles as a `.pvd` into a folder: its words are the folder, the times,
/// the number of the time at which the factor is another one, and that factor.
const SERIES: &str = r#"
import math, sys
out, times, wrong, factor = sys.argv[1], [float(t) for t in sys.argv[2].split(',')], int(sys.argv[3]), float(sys.argv[4])
def vtu(name, u):
    open(f'{out}/{name}', 'w').write(f'''<VTKFile type='UnstructuredGrid' version='1.0' byte_order='LittleEndian'><UnstructuredGrid>
<Piece NumberOfPoints='4' NumberOfCells='2'><Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>
<Cells><DataArray type='Int64' Name='connectivity' format='ascii'>0 1 2 0 2 3</DataArray><DataArray type='Int64' Name='offsets' format='ascii'>3 6</DataArray>
<DataArray type='UInt8' Name='types' format='ascii'>5 5</DataArray></Cells>
<PointData><DataArray type='Float64' Name='u' format='ascii'>{' '.join(map(repr, u))}</DataArray></PointData></Piece></UnstructuredGrid></VTKFile>''')
entries = ''
for k, t in enumerate(times):
    s = math.exp(-t) * (factor if k == wrong else 1)
    vtu(f'u{k}.vtu', [s, 2*s, 2*s, s])
    entries += f"<DataSet timestep='{t!r}' file='u{k}.vtu'/>"
open(f'{out}/u.pvd', 'w').write(f'<VTKFile><Collection>{entries}</Collection></VTKFile>')
"#;

fn verify(folder: &Path, text: &str, words: &[&str]) -> (Ran, Value) {
    write(folder, "x.toml", text);
    let ran = run(
        folder,
        &[&["verify", "--run", "x.toml", "--json", "o.json"], words].concat(),
    );
    let path = folder.join("o.json");
    let Ok(told) = fs::read_to_string(&path) else {
        return (ran, Value::Null);
    };
    fs::remove_file(&path).unwrap();
    let json: Value = serde_json::from_str(&told).unwrap();
    // A file that is refused has an error in its place.
    if !json["fields"].is_array() {
        return (ran, Value::Null);
    }
    write(folder, "o.json", &told);
    assert_valid("json", "src/report/schema/face-off-1.json", &path);
    fs::remove_file(&path).unwrap();
    (ran, json)
}

/// A code by the words of its script behind the folder.
fn code(name: &str, script: &str, words: &[&str], more: &str) -> String {
    let words: String = words.iter().map(|word| format!(", \"{word}\"")).collect();
    format!(
        "[codes.{name}]\ncommand = [\"/usr/bin/python3\", \"{script}\", \"{{out}}\"{words}]\n{more}\n"
    )
}

fn series(name: &str, words: &[&str]) -> String {
    code(name, "series.py", words, "result = \"u.pvd\"")
}

/// Verdicts of the pairs by their times.
fn times(told: &Value) -> Vec<(Option<f64>, String)> {
    let pairs = told["fields"][0]["pairs"].as_array().unwrap().iter();
    let pair = |p: &Value| (p["t"].as_f64(), p["verdict"].as_str().unwrap().to_owned());
    pairs.map(pair).collect()
}

/// A wrong time is found wherever it is, one that is missing is no pass, and what is left out is said.
#[test]
fn every_time_is_judged() {
    let folder = folder();
    let at = folder.path();
    write(at, "series.py", SERIES);
    let all = "0.1,0.2,0.3";
    let with = |words: &[&str], head: &str, more: &str| {
        let (a, b) = (series("a", &[all, "-1", "1"]), series("b", words));
        format!("name = \"x\"\n{head}\n{a}{b}[fields.u]\nsame = \"discretisation\"\n{more}\n")
    };
    let (ran, told) = verify(at, &with(&[all, "-1", "1.0"], "", ""), &[]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(times(&told).len(), 3);

    let middle = [all, "1", "1.5"];
    let words = ["--junit", "j.xml", "--report", "page"];
    let (ran, told) = verify(at, &with(&middle, "", ""), &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let verdicts = ["agree", "disagree", "agree"].map(str::to_owned);
    let expected = [0.1, 0.2, 0.3].map(Some).into_iter().zip(verdicts);
    assert_eq!(times(&told), expected.collect::<Vec<_>>());
    let junit = fs::read_to_string(at.join("j.xml")).unwrap();
    assert!(junit.contains("t = 0.2: "), "{junit}");
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert!(page.contains("All times of"), "a fold has every time");

    let refused = |text: &str, code: i32, part: &str| {
        let (ran, _) = verify(at, text, &[]);
        let told = format!("{}{}", ran.stdout, ran.stderr);
        assert_eq!(ran.code, Some(code), "{part}: {told}");
        assert!(told.contains(part), "{part}: {told}");
    };
    let right = |times: &str| [times.to_owned(), "-1".into(), "1.0".into()];
    let of = |times: &str, head: &str, more: &str| {
        let words = right(times);
        with(&words.each_ref().map(String::as_str), head, more)
    };
    refused(
        &of("0.1,0.2", "", ""),
        2,
        "b has no time 0.3 (it has 0.1, 0.2), and a has it",
    );
    refused(&of("1,2,3", "", ""), 2, "has no time");
    refused(&of("0.1", "", ""), 2, "has no time");
    // One time that is stated is one, too.
    let short = with(&["0.2", "-1", "1.0"], "times = \"last\"", "");
    refused(&short, 2, "the last time of a is 0.3, that of b is 0.2");
    // What the file leaves out is said.
    refused(
        &with(&middle, "times = \"last\"", ""),
        0,
        "only the last time of each result is judged",
    );
    refused(
        &with(&middle, "", "times = [0.1, 0.3]"),
        0,
        "only these times are judged: 0.1, 0.3",
    );
    refused(
        &with(&middle, "times = \"last\"", "times = \"all\""),
        1,
        "0.2",
    );
    refused(
        &with(&middle, "times = [0.1, 0.25]", ""),
        2,
        "a has no time 0.25",
    );
    refused(
        &with(&middle, "times = \"first\"", ""),
        2,
        "times are \"all\", \"last\" or a list",
    );
    // Numbered files have their numbers as times.
    let pattern = with(&middle, "", "").replace("u.pvd", "u*.vtu");
    refused(&pattern, 1, "disagree");
}

/// The exact solution at each time; without t in it, at the last, which is said.
#[test]
fn exact_knows_the_time() {
    let folder = folder();
    let at = folder.path();
    write(at, "series.py", SERIES);
    let of = |exact: &str, wrong: &str, head: &str| {
        let a = series("a", &["{n}.0,0.5,2.0", wrong, "1.01"]);
        let b = series("b", &["{n}.0,0.5,2", wrong, "1.01"]);
        let file =
            format!("name = \"x\"\n[mesh]\ngenerator = \"union-jack\"\nn = [3, 4]\n{head}{a}{b}");
        format!(
            "{file}[fields.u]\nsame = \"discretisation\"\nexact = \"{exact}\"\norders = {{ l2 = 1 }}\n"
        )
    };
    let l2 = |told: &Value, level: usize| {
        let levels = &told["fields"][0]["orders"][0]["levels"];
        levels[level]["l2"].as_f64().unwrap()
    };
    // ‖1 + x‖ = √(7/3); the time 0.5 is 1 % too large, and is not the last.
    let (_, told) = verify(at, &of("exp(-t)*(1 + x)", "1", ""), &[]);
    let expected = 0.01 * (-0.5_f64).exp() * (7.0_f64 / 3.0).sqrt();
    assert!((l2(&told, 0) / expected - 1.0).abs() < 1e-9, "{told}");
    assert_eq!(
        told["fields"][0]["errors_of"],
        "the time at which they are largest"
    );
    let (ran, told) = verify(
        at,
        &of("exp(-{k})*(1 + x)", "1", "[parameters]\nk = 3\n"),
        &[],
    );
    assert!(l2(&told, 0) < 1e-14, "{told}");
    assert!(
        ran.stdout.contains("the last time, as exact has no t"),
        "{}",
        ran.stdout
    );
    let (ran, _) = verify(at, &of("exp(-s)*x", "1", ""), &[]);
    assert!(
        ran.code == Some(2) && ran.stderr.contains("`s` is not known: use x, y, z, t"),
        "{}",
        ran.stderr
    );
    let number = of("1", "1", "").replace("[fields.u]", "[numbers.u]");
    let number = number
        .replace("exact = \"1\"", "exact = \"t\"")
        .replace("result", "numbers");
    let (ran, _) = verify(at, &number, &[]);
    assert!(
        ran.stderr.contains("a number is of no time"),
        "{}",
        ran.stderr
    );
}

/// Levels in a time step: u = (1 + dt^p)(1 + x), a number with them, and what is kept and recorded of each.
#[test]
fn a_parameter_is_an_axis() {
    let folder = folder();
    let at = folder.path();
    write(at, "series.py", SERIES);
    let script = "import sys, subprocess\nout, dt, p, k = sys.argv[1:]\ndt = float(dt)\nf = 1 + dt**float(p)\n\
         subprocess.run([sys.executable, 'series.py', out, '0.1,0', '1', repr(f)])\nopen(out + '/n.csv', 'w').write(f'e,{dt!r}\\n')\nopen('ran', 'a').write(f'{dt} ')\n";
    write(at, "dt.py", script);
    let of = |dt: &str, p: &str, n: &str, more: &str| {
        let of_code = |name: &str, k: &str| {
            let more = "result = \"u.pvd\"\nnumbers = \"n.csv\"";
            code(name, "dt.py", &["{dt}", p, k], more)
        };
        let (a, b) = (of_code("a", "0"), of_code("b", "1"));
        format!(
            "name = \"x\"\n{n}[parameters]\ndt = {dt}\n{more}{a}{b}[fields.u]\nsame = \"discretisation\"\nexact = \"exp(-t)*(1 + x)\"\n\
             orders = {{ l2 = 2 }}\n[numbers.e]\nsame = \"discretisation\"\n"
        )
    };
    let dt = "[0.1, 0.05, 0.025]";
    let (ran, told) = verify(at, &of(dt, "2", "", ""), &["--record", "record"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let order = &told["fields"][0]["orders"][0];
    assert_eq!(
        (&order["axis"], &order["verdict"]),
        (&"dt".into(), &"agree".into())
    );
    let fit = order["l2"]["fit"]["exponent"].as_f64().unwrap();
    assert!((fit - 2.0).abs() < 1e-6, "{fit}");
    assert_eq!(told["numbers"][0]["rows"][1]["level"], "dt = 0.05");
    assert_eq!(told["runs"][5]["level"], "dt = 0.025");
    assert!(at.join("record/a-dt0.025/u.pvd").is_file());
    let (ran, told) = verify(
        at,
        &of(dt, "1", "", ""),
        &["--against", "record", "--engines", "a"],
    );
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    assert_eq!(told["fields"][0]["orders"][0]["verdict"], "disagree");
    // Each level is found again.
    let ran_before = fs::read_to_string(at.join("ran")).unwrap();
    for _ in 0..2 {
        let (ran, _) = verify(at, &of(dt, "2", "", ""), &["--resume", "kept"]);
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    }
    let ran_after = fs::read_to_string(at.join("ran")).unwrap();
    let all: Vec<&str> = ran_after[ran_before.len()..].split_whitespace().collect();
    assert_eq!(all, ["0.1", "0.1", "0.05", "0.05", "0.025", "0.025"]);

    let refused = |text: &str, part: &str| {
        let (ran, _) = verify(at, text, &[]);
        assert!(
            ran.code == Some(2) && ran.stderr.contains(part),
            "{part}: {}",
            ran.stderr
        );
    };
    refused(
        &of("[0.025, 0.1]", "2", "", ""),
        "not from the coarsest to the finest",
    );
    refused(&of("[0.1]", "2", "", ""), "a list of one value");
    refused(&of(dt, "2", "", "k = [2, 4]\n"), "dt and k are lists");
    let mesh = "[mesh]\ngenerator = \"union-jack\"\nn = [2, 4]\n";
    refused(&of(dt, "2", mesh, ""), "n has 2 values and dt has 3");
    // With the mesh, level by level: here one mesh, so that the order is in 1/n.
    let mesh = "[mesh]\ngenerator = \"union-jack\"\nn = [2, 4, 8]\n";
    let (ran, told) = verify(at, &of(dt, "2", mesh, ""), &[]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let order = &told["fields"][0]["orders"][0];
    assert_eq!(order["axis"], "1/n");
    assert_eq!(told["runs"][5]["level"], "n = 8, dt = 0.025");
}

/// A verdict for each norm, levels that are not judged, and a headline of what was seen.
#[test]
fn rows_and_headlines_say_what_was_seen() {
    let folder = folder();
    let at = folder.path();
    write(at, "series.py", SERIES);
    // u + c h^p keeps its gradient: in H¹ exact, up to a part that converges.
    let script = "import sys, subprocess\nout, n, f = sys.argv[1:]\n\
         subprocess.run([sys.executable, 'series.py', out, '0', '0', repr(1 + float(f)/int(n)**2)])\nopen(out + '/n.csv', 'w').write(f'e,{f}e-3\\nz,{f}e-14\\n')\n";
    write(at, "run.py", script);
    let of = |a: &str, b: &str, more: &str| {
        let of_code = |name: &str, f: &str| {
            let more = "result = \"u.pvd\"\nnumbers = \"n.csv\"";
            code(name, "run.py", &["{n}", f], more)
        };
        let (a, b) = (of_code("a", a), of_code("b", b));
        format!("name = \"x\"\n[mesh]\ngenerator = \"union-jack\"\nn = [2, 4, 8]\n{a}{b}{more}")
    };
    let field = "[fields.u]\nsame = \"problem\"\nrtol = 0.5\nexact = \"EXACT\"\norders = { l2 = 2, h1 = 2 }\n";
    // Off by a constant: H¹ has its order, and L² has not.
    let shifted = field.replace("EXACT", "2 + x");
    let (ran, told) = verify(at, &of("1", "1.0", &shifted), &["--report", "page"]);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let order = &told["fields"][0]["orders"][0];
    assert_eq!(order["verdicts"], serde_json::json!(["disagree", "agree"]));
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert!(
        !page.contains("wrong form") && page.contains("what fixes the constant"),
        "{page}"
    );
    // Both are off: no code is accused of it.
    assert!(
        page.contains("<em>u</em> does not converge to 0"),
        "the headline is of the field: {page}"
    );

    // The code whose order is wrong leads, whatever differs with it.
    let right = field.replace("EXACT", "1 + x").replace("0.5", "1e-9");
    let b = "[numbers.e]\nsame = \"problem\"\nrtol = 1e-9\n";
    let text = of("1", "1.5", &(right + b));
    write(
        at,
        "run.py",
        &script.replace("**2)", "**(2 if f == '1' else 0))"),
    );
    let (ran, told) = verify(at, &text, &["--report", "page"]);
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    let rows = told["numbers"][0]["rows"].as_array().unwrap();
    let states: Vec<_> = rows.iter().map(|r| (&r["judged"], &r["verdict"])).collect();
    let coarse = (&Value::from(false), &Value::from("undetermined"));
    assert_eq!(states, [coarse, coarse, (&true.into(), &"disagree".into())]);
    assert!(ran.stdout.contains("not judged"), "{}", ran.stdout);
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert!(
        page.contains("of <em>b</em> does not converge to 0"),
        "{page}"
    );

    // Numbers that are 0 need atol alone.
    let zero = "[numbers.z]\nsame = \"problem\"\natol = 1e-12\nexact = 0\nexact_rtol = 0\n";
    let (ran, _) = verify(at, &of("1", "2", zero), &[]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let (ran, _) = verify(at, &of("1", "200", zero), &[]);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let zero = "[fields.u]\nsame = \"problem\"\natol = 1e-12\n";
    write(at, "run.py", script);
    let nothing = of("-64", "-64.0", zero);
    let (ran, _) = verify(at, &of("-64", "-64.1", zero), &["--n", "8"]);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let (ran, _) = verify(at, &nothing, &["--n", "8"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let (ran, _) = verify(
        at,
        &nothing.replace("atol = 1e-12", "rtol = 1e-12"),
        &["--n", "8"],
    );
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(ran.stdout.contains("give atol"), "{}", ran.stdout);
}

/// A wrong time in the middle is found on several levels too, where the codes share the problem only: limits are those of results of one time.
#[test]
fn limits_hide_no_time() {
    let folder = folder();
    let at = folder.path();
    write(at, "series.py", SERIES);
    let all = "0.1,0.2,0.3";
    let of = |words: &[&str]| {
        let (a, b) = (series("a", &[all, "-1", "1"]), series("b", words));
        format!(
            "name = \"x\"\n[mesh]\ngenerator = \"union-jack\"\nn = [2, 4, 8]\n{a}{b}[fields.u]\nsame = \"problem\"\nrtol = 0.1\n"
        )
    };
    let (ran, told) = verify(at, &of(&[all, "-1", "1.0"]), &[]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(told["fields"][0]["meetings"].is_null());
    let (ran, _) = verify(at, &of(&[all, "1", "1.5"]), &[]);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
}
