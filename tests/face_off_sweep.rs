//! Sweeps: what one set of parameters hides, the simplest case of a failure, and what cannot be swept.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Ran, assert_valid, folder, run, write};

/// A block of the Lamé constants λ and μ, clamped on the left and pulled on the right; writes how far the right side moves.
const BLOCK: &str = r#"
// The last words: n, ν, whether λ and μ are swapped, folder.
int first = ARGV.n - 4, n = atoi(ARGV[first]);
real nu = atof(ARGV[first + 1]);
real lambda = nu/((1 + nu)*(1 - 2*nu)), mu = 0.5/(1 + nu);
if (atoi(ARGV[first + 2]) == 1) { real other = lambda; lambda = mu; mu = other; }
mesh Th = square(n, n);
fespace Vh(Th, [P2, P2]);
Vh [u, v], [p, q];
solve block([u, v], [p, q]) = int2d(Th)(lambda*(dx(u) + dy(v))*(dx(p) + dy(q))
    + 2*mu*(dx(u)*dx(p) + dy(v)*dy(q) + 0.5*(dy(u) + dx(v))*(dy(p) + dx(q))))
  - int1d(Th, 2)(p) + on(4, u = 0, v = 0);
ofstream numbers(ARGV[first + 3] + "/numbers.csv");
numbers.precision(17);
numbers << "name,value" << endl << "tip," << int1d(Th, 2)(u) << endl;
"#;

/// Two such codes, of which the second may swap the constants, with a sweep or without one.
fn block(at: &Path, swaps: u8, sweep: &str) {
    write(at, "block.edp", BLOCK);
    let code = |name: &str, swaps: u8| {
        format!(
            "[codes.{name}]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"block.edp\", \"{{n}}\", \"{{nu}}\", \"{swaps}\", \"{{out}}\"]\nmesh = \"none\"\nnumbers = \"numbers.csv\"\n"
        )
    };
    // The second command is another one in any case.
    let text = format!(
        "name = \"block\"\n[mesh]\nn = 4\n[parameters]\nnu = 0.25\n{}{}[numbers.tip]\nsame = \"discretisation\"\nrtol = 1e-9\n{sweep}",
        code("a", 0),
        code("b", swaps).replace("-v", "-ns\", \"-v")
    );
    write(at, "block.toml", &text);
}

fn json(at: &Path, ran: &Ran) -> Value {
    let path = at.join("o.json");
    let told = fs::read_to_string(&path).unwrap_or_else(|_| panic!("{}", ran.stderr));
    assert_valid("json", "src/report/schema/face-off-1.json", &path);
    serde_json::from_str(&told).unwrap()
}

/// Swapped Lamé constants agree at ν = 1/4, whatever n is; a sweep over ν catches them, and prints the simplest case as a command.
#[test]
fn swapped_constants_are_caught_by_a_sweep() {
    let folder = folder();
    let at = folder.path();
    let sweep = "[sweep.over]\nnu = [0.25, 0.373]\nn = [4, 8]\n";
    block(at, 1, sweep);
    let one = run(
        at,
        &[
            "verify",
            "--run",
            "block.toml",
            "--set",
            "nu=0.25",
            "--n",
            "4",
        ],
    );
    assert_eq!(one.code, Some(0), "{}", one.stderr);

    let all = run(
        at,
        &[
            "verify",
            "--run",
            "block.toml",
            "--json",
            "o.json",
            "--junit",
            "j.xml",
            "--report",
            "page",
        ],
    );
    assert_eq!(all.code, Some(1), "{}", all.stderr);
    assert!(
        all.stderr.contains("4 points: 8 runs of codes")
            && all.stderr.contains("the rest of the sweep takes about"),
        "{}",
        all.stderr
    );
    let found = json(at, &all);
    let sweep = &found["sweep"];
    let verdicts = sweep["points"].as_array().unwrap().iter();
    let verdicts: Vec<(&str, &str)> = verdicts
        .map(|of| {
            (
                of["at"]["nu"].as_str().unwrap(),
                of["verdict"].as_str().unwrap(),
            )
        })
        .collect();
    assert_eq!(verdicts.len(), 4);
    for (nu, verdict) in verdicts {
        assert_eq!(
            verdict,
            if nu == "0.25" { "agree" } else { "disagree" },
            "{sweep}"
        );
    }
    // 0.25, which the file has, passes; 0.4 is outside of the sweep.
    let smallest = &sweep["smallest"]["at"];
    assert_eq!(
        (&smallest["n"], &smallest["nu"]),
        (&"1".into(), &"0.37".into())
    );
    let command = sweep["smallest"]["command"].as_str().unwrap();
    let words = shlex::split(command).unwrap();
    let words: Vec<&str> = words[1..].iter().map(String::as_str).collect();
    assert_eq!(run(at, &words).code, Some(1), "{command}");
    assert!(all.stdout.contains("at n = 1, nu = 0.37"), "{}", all.stdout);
    let junit = fs::read_to_string(at.join("j.xml")).unwrap();
    assert!(
        junit.contains("at n = 8, nu = 0.373") && junit.contains("failures=\"3\""),
        "{junit}"
    );
    assert!(
        fs::read_to_string(at.join("page/index.html"))
            .unwrap()
            .contains("over nu")
    );

    // The right codes agree at all points, drawn or not.
    block(
        at,
        0,
        "[sweep]\ndraw = 3\nseed = 5\n[sweep.over]\nnu = { from = 0.1, to = 0.45 }\nn = [2, 4]\n",
    );
    let right = run(
        at,
        &[
            "verify",
            "--run",
            "block.toml",
            "--json",
            "o.json",
            "--report",
            "page",
        ],
    );
    assert_eq!(right.code, Some(0), "{}", right.stderr);
    let found = json(at, &right);
    let drawn = found["sweep"]["points"].as_array().unwrap();
    let inside = |of: &Value| {
        let nu: f64 = of["at"]["nu"].as_str().unwrap().parse().unwrap();
        (0.1..=0.45).contains(&nu)
    };
    assert!(
        drawn.len() == 3 && drawn.iter().all(inside),
        "{}",
        found["sweep"]
    );
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert!(page.contains("at all 3 points of the sweep"));
}

/// The degree, a parameter, n and the step of a form, in our solver and FreeFEM.
#[test]
fn forms_are_swept() {
    let folder = folder();
    let at = folder.path();
    let form = "name = \"heat\"\n[mesh]\ngenerator = \"union-jack\"\nn = 2\n[spaces]\nu = \"P1\"\n[parameters]\nkappa = 1.0\n\
        [time]\nstep = 0.1\nend = 0.2\n[form]\nF = \"(u - old(u))*v*dx + dt*kappa*inner(grad(u), grad(v))*dx - dt*v*dx\"\n\
        [initial]\nu = \"x\"\n[dirichlet]\nleft = \"0\"\n[codes]\nuse = [\"rust\", \"freefem\"]\n";
    let sweep = "[sweep]\ndraw = 4\n[sweep.over]\nkappa = [0.5, 2]\ndegree = [1, 2]\nn = [1, 2]\ndt = [0.1, 0.2]\n";
    write(at, "heat.toml", &format!("{form}{sweep}"));
    assert_valid(
        "toml",
        "docs/reference/form.schema.json",
        &at.join("heat.toml"),
    );
    let ran = run(
        at,
        &["verify", "heat.toml", "--json", "o.json", "--keep", "kept"],
    );
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let found = json(at, &ran);
    let points = found["sweep"]["points"].as_array().unwrap();
    assert_eq!(points.len(), 4, "{}", found["sweep"]);
    // Each has folders of its own, whose scripts are those of its degree.
    let kept: Vec<String> = fs::read_dir(at.join("kept"))
        .unwrap()
        .map(|e| e.unwrap().path().display().to_string())
        .collect();
    for point in points {
        let of = |name: &str| point["at"][name].as_str().unwrap();
        let is_of = |path: &&String| {
            path.contains("freefem")
                && ["degree", "kappa", "dt"]
                    .iter()
                    .all(|name| path.contains(&format!("-{name}{}", of(name))))
        };
        let folder = kept
            .iter()
            .find(is_of)
            .unwrap_or_else(|| panic!("{point} {kept:?}"));
        let mut scripts = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
        let script = scripts
            .find(|path| path.extension().is_some_and(|e| e == "edp"))
            .unwrap();
        let space = format!("P{}", of("degree"));
        assert!(
            fs::read_to_string(script).unwrap().contains(&space),
            "{folder}"
        );
    }
}

/// Each is refused with the place and what to do, before anything runs.
#[test]
fn what_cannot_be_swept_is_refused() {
    let folder = folder();
    let at = folder.path();
    for (sweep, words) in [
        ("[sweep.over]\nmu = [1, 2]\n", "nothing is called `mu`"),
        ("[sweep.over]\nnu = []\n", "its list is empty"),
        ("[sweep]\nover = {}\n", "it is over nothing"),
        (
            "[sweep.over]\nnu = { from = 0.1, to = 0.2 }\n",
            "how many values",
        ),
        (
            "[sweep.over]\nnu = { from = 0.3, to = 0.2, count = 3 }\n",
            "from 0.3 to 0.2",
        ),
        (
            "[sweep.over]\nnu = { from = 0, to = 1, count = 3, log = true }\n",
            "both above 0",
        ),
        ("[sweep.over]\nnu = [nan]\n", "neither a finite number"),
        ("[sweep.over]\nnu = [\"../x\"]\n", "cannot name folders"),
        (
            "[sweep]\ndraw = 0\nover = { nu = [1] }\n",
            "0 points are not a draw",
        ),
        (
            "[sweep]\nover = { nu = [1] }\nseeds = 3\n",
            "unknown field `seeds`",
        ),
        (
            "[sweep.over]\nn = { from = 1, to = 200, count = 200 }\nnu = { from = 0.1, to = 0.2, count = 200 }\n",
            "more than 10000 points",
        ),
        ("[sweep.over]\nn = [0, 1]\n", "without cells"),
        ("[sweep.over]\nn = [1.5]\n", "n"),
    ] {
        block(at, 0, sweep);
        let ran = run(at, &["verify", "--run", "block.toml"]);
        assert_eq!(ran.code, Some(2), "{sweep} {}", ran.stdout);
        assert!(ran.stderr.contains(words), "{sweep} {}", ran.stderr);
    }
    block(at, 0, "[sweep.over]\nnu = [0.1, 0.2]\n");
    for (words, why) in [
        (&["--record", "r"][..], "--record is of one point"),
        (&["--set", "mu=1"], "nothing is called `mu`"),
        (&["--set", "nu=1", "--set", "nu=2"], "twice"),
        (&["--set", "nu"], "not NAME=VALUE"),
        (&["--set", "n=3"], "--n 3"),
    ] {
        let ran = run(at, &[&["verify", "--run", "block.toml"], words].concat());
        assert_eq!(ran.code, Some(2), "{words:?} {}", ran.stdout);
        assert!(ran.stderr.contains(why), "{words:?} {}", ran.stderr);
    }
    let ran = run(at, &["verify", "one-zone", "--set", "nu=1"]);
    assert_eq!(ran.code, Some(2));
}
