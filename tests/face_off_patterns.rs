//! What limits an order is named: patterns planted in FreeFEM and in scikit-fem, and nothing where the order is right.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, source, warm, write};

/// Problems in FreeFEM; the last words: which, n, a parameter, mesh, folder.
const FREEFEM: &str = include_str!("patterns/patterns.edp");
/// The same in scikit-fem.
const SKFEM: &str = include_str!("patterns/patterns.py");

/// A square of (2n)² squares, each cut in two, that is slit from its middle to the left: points there are double, those above a
/// little higher, since FreeFEM reads no two points at one place.
fn slit(n: usize) -> String {
    let side = 2 * n + 1;
    let plain = side * side;
    let at = |i: usize, j: usize, is_upper: bool| match j == n && i < n && is_upper {
        true => plain + i,
        false => side * j + i,
    };
    let mut nodes = String::new();
    let mut put = |k: usize, i: usize, j: usize| {
        let [x, y] = [i, j].map(|k| k as f64 / n as f64 - 1.0);
        writeln!(nodes, "{} {x} {y} 0", k + 1).unwrap();
    };
    for j in 0..side {
        for i in 0..side {
            put(side * j + i, i, j);
        }
    }
    for i in 0..n {
        let x = i as f64 / n as f64 - 1.0;
        writeln!(nodes, "{} {x} 1e-6 0", plain + i + 1).unwrap();
    }
    let mut cells: Vec<String> = Vec::new();
    let mut line = |a: usize, b: usize| cells.push(format!("1 2 1 1 {} {}", a + 1, b + 1));
    for k in 0..2 * n {
        line(at(k, 0, false), at(k + 1, 0, false));
        line(at(k, 2 * n, true), at(k + 1, 2 * n, true));
        line(at(2 * n, k, true), at(2 * n, k + 1, true));
        line(at(0, k, k >= n), at(0, k + 1, k >= n));
    }
    for i in 0..n {
        for is_upper in [false, true] {
            line(at(i, n, is_upper), at(i + 1, n, is_upper));
        }
    }
    for j in 0..2 * n {
        for i in 0..2 * n {
            let is_upper = j >= n;
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                .map(|(i, j)| at(i, j, is_upper) + 1);
            cells.push(format!("2 2 2 2 {a} {b} {c}"));
            cells.push(format!("2 2 2 2 {a} {c} {d}"));
        }
    }
    let mut all = String::new();
    for (k, cell) in cells.iter().enumerate() {
        writeln!(all, "{} {cell}", k + 1).unwrap();
    }
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n{nodes}$EndNodes\n$Elements\n{}\n{all}$EndElements\n",
        plain + n,
        cells.len()
    )
}

/// Runs scikit-fem's script on each level, and on the last one with a changed parameter; the command of the face-off copies the
/// results. All are children of one process, since it takes longer to load scikit-fem than to run the script.
fn solve(at: &Path, case: &str, n: &str, values: [&str; 2]) {
    let levels: Vec<&str> = n.trim_matches(['[', ']']).split(", ").collect();
    let given = levels.iter().map(|n| [n, values[0]]);
    let changed = levels.last().map(|n| [n, values[1]]);
    for [n, value] in given.chain(changed.filter(|of| of[1] != values[0])) {
        let out = at.join(format!("{case}-{n}-{value}"));
        fs::create_dir_all(&out).unwrap();
        let python = source("target/python/bin/python");
        let modules = warm::modules("scikit-fem").unwrap();
        let words = [case, n, value, "none", &out.to_string_lossy()];
        let (has_ended_well, said) = warm::run(&python, modules, &at.join("patterns.py"), &words);
        assert!(has_ended_well, "{case}: {}", said.concat());
    }
}

/// Both codes on a problem: what limits each, and the words of the report.
fn limits(
    at: &Path,
    case: &str,
    exact: &str,
    orders: &str,
    [n, parameter, mesh]: [&str; 3],
    words: &str,
) -> ([Value; 2], String) {
    let (name, value) = parameter.split_once(" = ").unwrap_or(("", "0"));
    let word = match name {
        "" => "0".to_owned(),
        name => format!("{{{name}}}"),
    };
    let changed = words.split_once(&format!("{name} = "));
    let changed = changed.map_or("0", |(_, rest)| rest.split(' ').next().unwrap());
    let python = source("target/python/bin/python");
    let all = |script: &str, of_mesh: &str| {
        format!("{script}, \"{case}\", \"{{n}}\", \"{word}\", \"{of_mesh}\", \"{{out}}\"")
    };
    let freefem = "\"FreeFem++-nw\", \"-v\", \"0\", \"patterns.edp\"";
    let skfem = format!("\"{}\", \"patterns.py\"", python.display());
    let (commands, forms) = match mesh {
        "" => {
            solve(at, case, n, [value, changed]);
            let given = format!("\"cp\", \"{case}-{{n}}-{word}/u.vtu\", \"{{out}}\"");
            ([all(freefem, "none"), given], ["none", "none"])
        }
        _ => (
            [all(freefem, "{mesh}"), all(&skfem, "{mesh}")],
            ["freefem", "msh2"],
        ),
    };
    let code = |name: &str, command: &str, form: &str| {
        format!("[codes.{name}]\ncommand = [{command}]\nmesh = \"{form}\"\nresult = \"u.vtu\"\n")
    };
    let text = format!(
        "name = \"{case}\"\n[mesh]\n{mesh}\nn = {n}\n[parameters]\n{parameter}\n{}{}[fields.u]\nsame = \"problem\"\nexact = \"{exact}\"\norders = {orders}\n",
        code("freefem", &commands[0], forms[0]),
        code("skfem", &commands[1], forms[1]),
    );
    write(at, "x.toml", &text);
    let ran = run(
        at,
        &[
            "verify", "--run", "x.toml", "--json", "o.json", "--report", "page",
        ],
    );
    let path = at.join("o.json");
    let told = fs::read_to_string(&path).unwrap_or_else(|_| panic!("{case} {}", ran.stderr));
    assert_valid("json", "src/report/schema/face-off-1.json", &path);
    let told: Value = serde_json::from_str(&told).unwrap();
    let all = told["fields"][0]["orders"].as_array().unwrap();
    let of = ["freefem", "skfem"].map(|code| {
        let order = all.iter().find(|order| order["of"] == code);
        let order = order.unwrap_or_else(|| panic!("{case} {code} {}{}", ran.stdout, ran.stderr));
        assert!(
            order["verdict"] == "agree" || order["limiting"]["kind"].is_string(),
            "{case} {order:#}"
        );
        if case == "disc" {
            let last = ["l2", "h1"].map(|norm| order[norm]["steps"][1].as_f64().unwrap());
            assert!(
                (last[0] - 2.0).abs() < 0.2 && (last[1] - 1.5).abs() < 0.2,
                "{last:?}"
            );
        }
        order["limiting"].clone()
    });
    (of, fs::read_to_string(at.join("page/index.html")).unwrap())
}

/// Eight causes, of which straight sides show in both norms, each in two codes.
#[test]
fn planted_patterns_are_named() {
    let folder = folder();
    let at = folder.path();
    write(at, "patterns.edp", FREEFEM);
    write(at, "patterns.py", SKFEM);
    write(at, "slit.msh", &slit(4));
    let smooth = "sin(pi*x)*sin(pi*y)";
    let [p1, p2] = ["{ l2 = 2, h1 = 1 }", "{ l2 = 3, h1 = 2 }"];
    let n = "[8, 16, 32]";
    for (case, exact, orders, given, kind, words) in [
        (
            "disc",
            "(1 - x^2 - y^2)/4",
            p2,
            ["[2, 3, 4]", "", ""],
            "straight-sides",
            "straight sides on a curved domain",
        ),
        (
            "heat",
            "exp(-0.2*pi^2)*sin(pi*x)*sin(pi*y)",
            p1,
            [n, "dt = 0.05", ""],
            "parameter",
            "with dt = 0.025 instead of 0.05",
        ),
        (
            "solver",
            "x*(1-x)*y*(1-y)",
            p1,
            [n, "cg_tol = 0.3", ""],
            "parameter",
            "with cg_tol = 0.003 instead of 0.3",
        ),
        (
            "penalty",
            smooth,
            p1,
            [n, "penalty = 0.1", ""],
            "parameter",
            "with penalty = 0.05 instead of 0.1",
        ),
        (
            "corner",
            "(x^2+y^2)^(1/3)*sin(2/3*(atan2(y+0, x) + pi/2))",
            p1,
            ["[4, 8, 16]", "", ""],
            "corner",
            "the corner of 270° at (0, 0)",
        ),
        (
            "slit",
            "sqrt(max(0, (sqrt(x^2+y^2) + x)/2))",
            p1,
            ["[1, 2, 4]", "", "file = \"slit.msh\""],
            "corner",
            "the corner of 360° at (0, 0)",
        ),
        (
            "jump",
            "if(x < 1/3, 1, 0.1)*sin(3*pi*x)",
            p1,
            [n, "", ""],
            "jump",
            "where a coefficient jumps inside cells",
        ),
        (
            "nitsche",
            smooth,
            p2,
            ["[4, 8, 16]", "", ""],
            "nonsymmetric",
            "nonsymmetric interior penalty",
        ),
    ] {
        let (found, page) = limits(at, case, exact, orders, given, words);
        for of in found {
            assert_eq!(of["kind"], kind, "{case} {of}");
        }
        assert!(page.contains(words), "{case}");
    }
    // Where the order is right, nothing limits it.
    for (case, exact, orders, given) in [
        ("symmetric", smooth, p2, ["[4, 8, 16]", "", ""]),
        ("fitted", "if(x < 1/2, 1, 0.1)*sin(2*pi*x)", p1, [n, "", ""]),
    ] {
        let (found, _) = limits(at, case, exact, orders, given, "");
        assert_eq!(found, [Value::Null, Value::Null], "{case}");
    }
}
