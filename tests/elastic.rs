//! Scenes of contact in elasticity: our solver, FreeFEM and dolfinx by schemes that are written by hand, and what results of other methods are told to solve.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, source, times, write};

fn read(at: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(at.join("o.json")).unwrap()).unwrap()
}

/// A built-in scene in a folder, with one text instead of another.
fn scene(at: &Path, name: &str, from: &str, to: &str) -> String {
    let file = format!("{name}.toml");
    let text = source("crates/form/src/elastic/builtin").join(&file);
    let text = fs::read_to_string(text).unwrap();
    assert!(text.contains(from), "{name} does not contain {from}");
    write(at, &file, &text.replacen(from, to, 1));
    file
}

/// What a command reports that ends with agreement, in valid JSON.
fn agreed(at: &Path, words: &str) -> Value {
    let ran = run(at, &words.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let json = at.join("o.json");
    assert_valid("json", "src/report/schema/face-offs-1.json", &json);
    read(at)
}

#[test]
fn three_codes_agree_on_every_scene() {
    let folder = folder();
    let at = folder.path();
    let words = "verify elastic-transition contact-patch hertz-line --methods cr --n 2 --json o.json --report page --junit j.xml";
    let told = agreed(at, words);
    assert_valid("xsd", "tests/junit.xsd", &at.join("j.xml"));
    let all = told["face_offs"].as_array().unwrap();
    let names: Vec<&str> = all.iter().map(|of| of["name"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        ["elastic-transition-cr", "contact-patch-cr", "hertz-line-cr"]
    );
    for of in all {
        let fields = of["fields"].as_array().unwrap();
        let names: Vec<&str> = fields
            .iter()
            .map(|f| f["field"].as_str().unwrap())
            .collect();
        // On each facet of Γ_C σₙ, σ_t and the status, and u.
        assert_eq!(names, ["status", "stress", "u"]);
        for field in fields {
            let pairs = field["pairs"].as_array().unwrap();
            assert_eq!(pairs.len(), 3, "{of}");
            for pair in pairs {
                assert!(pair["max_rel"].as_f64().unwrap() < 1e-11, "{pair}");
                assert_eq!(pair["verdict"], "agree");
            }
        }
        let numbers = of["numbers"].as_array().unwrap();
        for name in ["contact", "force", "pressure"] {
            let number = numbers.iter().find(|number| number["number"] == name);
            assert_eq!(number.unwrap()["verdict"], "agree", "{name} of {of}");
        }
    }
    // Hertz's pressure from outside: p₀ = √(F E*/(πR)), of which ∫p² is 8 p₀ F/(3π).
    let pressure = &all[2]["numbers"].as_array().unwrap();
    let pressure = pressure.iter().find(|n| n["number"] == "pressure").unwrap();
    let p0 = (8.0 * 1000.0 / (0.91 * std::f64::consts::PI)).sqrt();
    let exact = 8.0 * p0 * 8.0 / (3.0 * std::f64::consts::PI);
    let found = pressure["rows"][0]["values"]["freefem"].as_f64().unwrap();
    assert!((found / exact - 1.0).abs() < 1e-2, "{found} {exact}");
}

/// Plane stress is plane strain with E(1 + 2ν)/(1 + ν)² and ν/(1 + ν).
#[test]
fn plane_stress_is_plane_strain_with_other_constants() {
    let folder = folder();
    let at = folder.path();
    let (e, nu) = (1.0_f64, 0.3_f64);
    let mut found = Vec::new();
    for (plane, e, nu) in [
        ("stress", e, nu),
        (
            "strain",
            e * (1.0 + 2.0 * nu) / (1.0 + nu).powi(2),
            nu / (1.0 + nu),
        ),
        // The check can fail.
        ("strain", e, nu),
    ] {
        let material = format!("E = {e:?}\nnu = {nu:?}\nplane = \"{plane}\"");
        let usual = "E = 1.0\nnu = 0.3\nplane = \"strain\"";
        let file = scene(at, "elastic-transition", usual, &material);
        let words = "--methods cr --n 4 --engines rust,freefem --json o.json";
        let words: Vec<&str> = ["verify", &file]
            .into_iter()
            .chain(words.split(' '))
            .collect();
        let ran = run(at, &words);
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
        let told = read(at);
        let numbers = told["numbers"].as_array().unwrap();
        let values = numbers
            .iter()
            .map(|of| of["rows"][0]["values"]["freefem"].as_f64().unwrap());
        found.push(values.collect::<Vec<_>>());
    }
    let far = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a / b - 1.0).abs())
            .fold(0.0, f64::max)
    };
    assert!(far(&found[0], &found[1]) < 1e-12, "{found:?}");
    assert!(far(&found[0], &found[2]) > 1e-3, "{found:?}");
}

/// Hertz's ball: in our solver and in dolfinx's scheme by hand. FreeFEM has no jumps in space, and is left out unless it is named.
#[test]
fn a_ball_on_a_plane_has_the_pressure_of_hertz() {
    let folder = folder();
    let at = folder.path();
    let words = "verify hertz-sphere-elastic --methods cr --json o.json";
    let ran = run(at, &words.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let told = read(at);
    assert_eq!(told["missing"][0]["engine"], "freefem", "{told}");
    assert_eq!(told["missing"].as_array().unwrap().len(), 1);
    assert!(ran.stderr.contains("no integrals over interior faces"));
    let named = format!("{words} --engines rust,freefem");
    let ran = run(at, &named.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    for of in told["numbers"].as_array().unwrap() {
        assert_eq!(of["verdict"], "agree", "{of}");
    }
    let fields = told["fields"].as_array().unwrap();
    assert_eq!(fields.len(), 3);
}

/// E, ν, friction and thin bodies at their extremes, and γ₀ and β over their ranges.
#[test]
fn extremes_and_ranges_are_swept() {
    let folder = folder();
    let at = folder.path();
    // Coarser meshes show the same.
    let usual = "n = [8, 16, 32]";
    let n = if times() > 1 { usual } else { "n = [4, 8, 16]" };
    let transition = || scene(at, "elastic-transition", usual, n);
    let file = transition();
    let words = format!("stress {file} contact-patch --methods cr --json o.json --report page");
    let told = agreed(at, &words);
    let all = told["face_offs"].as_array().unwrap();
    let names: Vec<&str> = all.iter().map(|of| of["name"].as_str().unwrap()).collect();
    for name in [
        "elastic-transition-cr over nu",
        "elastic-transition-cr of height 0.02",
        "contact-patch-cr over E",
    ] {
        assert!(names.contains(&name), "{names:?}");
    }
    // With a coefficient of 10 there are several solutions, and Newton's method does not converge to one of them on every mesh, which is no agreement.
    let words = "stress friction-patch --methods cr --families friction --json o.json";
    let ran = run(at, &words.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    let told = read(at);
    let points = told["face_offs"][0]["sweep"]["points"].as_array().unwrap();
    let verdicts: Vec<_> = points
        .iter()
        .map(|of| (&of["at"]["q"], &of["verdict"]))
        .collect();
    for (point, q) in points.iter().zip(["0", "0.1", "1"]) {
        assert_eq!(
            (&point["at"]["q"], &point["verdict"]),
            (&q.into(), &"agree".into()),
            "{verdicts:?}"
        );
    }
    assert_eq!(points[3]["verdict"], "undetermined", "{verdicts:?}");
    // P1 locks, which is found: on meshes with all diagonals in one direction.
    write(at, "diagonal.msh", &diagonals(4));
    let from = "generator = \"union-jack\"\nn = [8, 16, 32]";
    let to = "file = \"diagonal.msh\"\nn = [1, 2, 4]";
    let file = scene(at, "elastic-transition", from, to);
    let words = ["stress", &file, "--methods", "p1", "--families", "nu"];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);

    let file = transition();
    let words = ["study", &file, "--methods", "cr", "--json", "o.json"];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let told = read(at);
    let points = told["face_offs"][0]["sweep"]["points"].as_array().unwrap();
    let error = |gamma0: &str| {
        let point = points.iter().find(|of| of["at"]["gamma0"] == gamma0);
        point.unwrap()["errors"][0].as_f64().unwrap()
    };
    // A small γ₀ is far worse, and a large one is not: the table of docs/paper.md.
    assert!(error("0.01") > 20.0 * error("100"), "{points:?}");
    assert!(
        (error("10000") / error("100") - 1.0).abs() < 0.02,
        "{points:?}"
    );
}

/// Squares with diagonals in one direction, on which P1 locks; on Union-Jack meshes it does not.
fn diagonals(n: usize) -> String {
    let number = |i: usize, j: usize| 1 + i + (n + 1) * j;
    let (mut points, mut cells) = (String::new(), Vec::new());
    for j in 0..=n {
        for i in 0..=n {
            let [x, y] = [i, j].map(|k| k as f64 / n as f64);
            points += &format!("{} {x} {y} 0\n", number(i, j));
        }
    }
    for k in 0..n {
        cells.push(format!("1 2 1 1 {} {}", number(k, 0), number(k + 1, 0)));
        cells.push(format!("1 2 2 2 {} {}", number(n, k), number(n, k + 1)));
        cells.push(format!("1 2 3 3 {} {}", number(k, n), number(k + 1, n)));
        cells.push(format!("1 2 4 4 {} {}", number(0, k), number(0, k + 1)));
        for i in 0..n {
            let [a, b] = [number(i, k), number(i + 1, k)];
            let [c, d] = [number(i, k + 1), number(i + 1, k + 1)];
            cells.push(format!("2 2 5 5 {a} {b} {c}"));
            cells.push(format!("2 2 5 5 {b} {d} {c}"));
        }
    }
    let names = "5\n1 1 \"bottom\"\n1 2 \"right\"\n1 3 \"top\"\n1 4 \"left\"\n2 5 \"domain\"\n";
    let rows = cells.iter().enumerate();
    let rows: String = rows.map(|(k, row)| format!("{} {row}\n", k + 1)).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{names}$EndPhysicalNames\n$Nodes\n{}\n{points}$EndNodes\n$Elements\n{}\n{rows}$EndElements\n",
        (n + 1) * (n + 1),
        cells.len()
    )
}

/// Orders and locking: of P1 for a material that is nearly incompressible, and not of Crouzeix–Raviart.
#[test]
fn nearly_incompressible_bodies_lock_with_p1_alone() {
    let folder = folder();
    let at = folder.path();
    write(at, "diagonal.msh", &diagonals(4));
    let file = scene(
        at,
        "elastic-transition",
        "generator = \"union-jack\"",
        "file = \"diagonal.msh\"",
    );
    let words = "--methods cr,p1 --set nu=0.4999 --n 2,4 --json o.json";
    let words: Vec<&str> = ["orders", &file]
        .into_iter()
        .chain(words.split(' '))
        .collect();
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert_valid(
        "json",
        "src/report/schema/face-offs-1.json",
        &at.join("o.json"),
    );
    let told = read(at);
    let of = |k: usize| &told["face_offs"][k];
    assert_eq!(of(0)["name"], "elastic-transition-cr");
    let order = |k: usize| {
        let h1 = &of(k)["fields"][0]["orders"][0]["h1"];
        h1["steps"][0].as_f64().unwrap()
    };
    assert!(
        order(0) > 0.95 && order(1) < 0.2,
        "{} {}",
        order(0),
        order(1)
    );
}

/// Coulomb's problem with a large coefficient has several solutions: that of the patch test, which Tresca's with the same friction has too, and one in
/// which a part sticks. Both solve the same equations.
#[test]
fn friction_with_a_large_coefficient_has_several_solutions() {
    let folder = folder();
    let at = folder.path();
    let coulomb = scene(at, "friction-patch", "q = 0.4", "q = 3.0");
    let text = fs::read_to_string(at.join(&coulomb)).unwrap();
    let tresca = text.replacen("coulomb = \"q\"", "friction = \"q*p*E\"", 1);
    assert_ne!(text, tresca);
    write(at, "tresca.toml", &tresca);
    let error = |scene: &str| {
        let words = [
            "solve", scene, "--n", "4", "--out", "u.vtu", "--json", "o.json",
        ];
        let ran = run(at, &words);
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
        let told = read(at);
        let ran = run(at, &["judge", "u.vtu", "--scene", &coulomb, "--n", "4"]);
        assert_eq!(ran.code, Some(0), "{scene}: {}{}", ran.stdout, ran.stderr);
        told["numbers"]["error"]["value"].as_f64().unwrap()
    };
    let found = [&*coulomb, "tresca.toml"].map(error);
    assert!(found[0] > 1e-3 && found[1] < 1e-25, "{found:?}");
}

/// One code solves a scene, and writes u, stress and what is known on Γ_C, which are exact in the patch test.
#[test]
fn a_scene_is_solved_by_one_code() {
    let folder = folder();
    let at = folder.path();
    for engine in ["rust", "freefem"] {
        let words = format!(
            "solve contact-patch --engine {engine} --n 2 --set p=0.2 --out u.vtu --json o.json --report page"
        );
        let ran = run(at, &words.split(' ').collect::<Vec<_>>());
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
        let schema = "src/report/schema/solve-elastic-1.json";
        assert_valid("json", schema, &at.join("o.json"));
        let told = read(at);
        assert_eq!(told["name"], "contact-patch-cr");
        assert_eq!(told["engine"], engine);
        assert_eq!(told["cells"], 8);
        assert_eq!(told["facets"], 2);
        let force = told["numbers"]["force"]["value"].as_f64().unwrap();
        assert!((force - 0.2).abs() < 1e-13, "{force}");
        let contact = told["numbers"]["contact"]["value"].as_f64().unwrap();
        assert!((contact - 1.0).abs() < 1e-13, "{contact}");
        let values = |file: &str, name: &str| {
            let mesh = faceoff_mesh::io::read(&at.join(file)).unwrap();
            let mut fields = mesh.fields.iter().filter(|field| &*field.name == name);
            let field = fields.next();
            assert!(fields.next().is_none(), "{name} is there twice");
            let field = field.unwrap_or_else(|| panic!("{file} has no {name}"));
            field
                .values
                .to_f64()
                .chunks(field.components)
                .map(<[f64]>::to_vec)
                .collect::<Vec<_>>()
        };
        // The body is free to widen: σ_yy = -p, and σ_xx and σ_xy are 0.
        let stress = values("u.vtu", "sigma");
        assert_eq!(stress.len(), 8);
        for of_cell in stress {
            for (found, exact) in of_cell.iter().zip([0.0, -0.2, 0.0]) {
                assert!((found - exact).abs() < 1e-13, "{of_cell:?}");
            }
        }
        for (name, exact) in [
            ("reaction", [0.2, 0.0]),
            ("stress", [-0.2, 0.0]),
            ("status", [1.0, 0.0]),
        ] {
            let found = values("u-faces.vtu", name);
            assert_eq!(found.len(), 2, "{name}");
            for (found, exact) in found.iter().flat_map(|of| of.iter().zip(exact)) {
                assert!((found - exact).abs() < 1e-13, "{name}: {found}");
            }
        }
        assert!(at.join("page/contact-patch-cr.vtu").exists());
        assert!(!values("u.vtu", "u").is_empty());
    }
    // Where the solution is known, errors are reported: half as large on the finer mesh.
    let error = |n: &str| {
        let words = ["solve", "elastic-transition", "--n", n, "--json", "o.json"];
        let ran = run(at, &words);
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
        read(at)["error"]["h1"].as_f64().unwrap()
    };
    let [coarse, fine] = ["8", "16"].map(error);
    assert!((coarse / fine - 2.0).abs() < 0.1, "{coarse} {fine}");
}

/// Contact by penalty, as one writes it in FreeFEM with its usual rules: it is named, with its number.
#[test]
fn contact_by_penalty_is_told_as_such() {
    let folder = folder();
    let at = folder.path();
    let file = scene(at, "elastic-transition", "facet_degree = 9", "");
    let words = [
        "write", &file, "--for", "freefem", "--method", "p1", "--n", "4", "-o", ".",
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let text = fs::read_to_string(at.join("elastic-transition-p1.edp")).unwrap();
    let (head, rest) = text.split_once("varf F(").unwrap();
    let (_, rest) = rest.split_once("elasticDerivative(du, u, v)").unwrap();
    let penalty = "
real k = 1000.;
varf F([du1, du2], [v1, v2]) = int2d(Th)(energy(u, v) - loads(v)) - int1d(Th, GammaN)(t1*v1 + t2*v2)
  + int1d(Th, GammaC)(k*max(un(u) - psi, 0.)*un(v));
varf J([du1, du2], [v1, v2]) = int2d(Th)(energy(du, v)) + int1d(Th, GammaC)(k*(un(u) > psi)*un(du)*un(v))";
    write(at, "penalty.edp", &format!("{head}{penalty}{rest}"));
    let mut command = Command::new("FreeFem++-nw");
    let out = command
        .current_dir(at)
        .args(["-v", "0", "penalty.edp"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(out.status.success(), "{said}");

    let words = [
        "judge",
        "elastic-transition-p1.vtu",
        "--scene",
        &file,
        "--method",
        "p1",
        "--n",
        "4",
        "--json",
        "o.json",
        "--report",
        "page",
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert_valid(
        "json",
        "src/report/schema/judge-form-1.json",
        &at.join("o.json"),
    );
    let told = read(at);
    let causes = told["explanations"].as_array().unwrap();
    let kinds: Vec<&str> = causes
        .iter()
        .map(|of| of["kind"].as_str().unwrap())
        .collect();
    assert_eq!(kinds, ["uncoupled", "penalty"], "{told}");
    let factor = causes[1]["factor"].as_f64().unwrap();
    assert!((factor - 1000.0).abs() < 1e-6, "{factor}");
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    for said in [&*ran.stdout, &page] {
        assert!(
            said.contains("contact was imposed by the penalty"),
            "{said}"
        );
    }
}

/// A script with another β solves another scheme, and the number is found.
#[test]
fn a_changed_number_in_a_script_is_named() {
    let folder = folder();
    let at = folder.path();
    let words = "write elastic-transition --for fenicsx --n 4 -o .";
    let ran = run(at, &words.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let script = at.join("elastic-transition-cr_fenicsx.py");
    let text = fs::read_to_string(&script).unwrap();
    assert!(text.contains("beta = 10.0\n"));
    fs::write(&script, text.replacen("beta = 10.0\n", "beta = 5.0\n", 1)).unwrap();
    let mut command = Command::new("/usr/bin/python3");
    let out = command.current_dir(at).arg(&script).output().unwrap();
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let words = "judge elastic-transition-cr_fenicsx.vtu --scene elastic-transition --n 4";
    let ran = run(at, &words.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("`beta` were 5"), "{}", ran.stdout);
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    let folder = folder();
    let at = folder.path();
    let file = scene(
        at,
        "elastic-transition",
        "\"4/5*mu*y*sin(2*x) + lam*b\"",
        "\"4/5*mue\"",
    );
    write(
        at,
        "matrix.toml",
        "scenes = [\"contact-patch\"]\n[[releases]]\nname = \"f\"\ncompanion = \"freefem\"\nwithin = [\"env\", \"--chdir={job}\"]\n",
    );
    for (words, what) in [
        (
            vec!["verify", "elastic-transition", "one-zone"],
            "one-zone is no scene of elasticity",
        ),
        (
            vec!["verify", "elastic-transition", "--methods", "cr-fc"],
            "cr-fc is no method for elasticity",
        ),
        (
            vec![
                "verify",
                "elastic-transition",
                "contact-patch",
                "--record",
                "r",
            ],
            "--record is of one scene",
        ),
        (
            vec!["verify", &file],
            "elastic-transition.toml:27:11: `mue` is not known",
        ),
        (
            vec!["solve", "contact-patch", "--accuracy", "0.1"],
            "solve --accuracy is not for scenes of elasticity",
        ),
        (
            vec![
                "solve",
                "contact-patch",
                "--engine",
                "freefem",
                "--set",
                "mue=1",
            ],
            "mue",
        ),
        (
            vec!["solve", "gap", "--set", "nu=0.3"],
            "--set is for parameters of scenes of elasticity",
        ),
        (
            vec!["matrix", "--run", "matrix.toml"],
            "faceoff verify contact-patch --methods cr --record DIR",
        ),
        (
            vec!["orders", "contact-patch"],
            "nothing is known of the solution of contact-patch",
        ),
        (
            vec!["certify", "u.vtu", "--scene", "contact-patch"],
            "contact-patch is a scene of elasticity",
        ),
        (
            vec!["stress", "contact-patch", "--families", "mu"],
            "there is no family `mu` of scenes of elasticity; did you mean `nu`?",
        ),
        (
            vec!["study", "contact-patch", "gap"],
            "gap is no scene of elasticity",
        ),
        (
            vec!["study", "contact-patch", "--methods", "cr-fc"],
            "cr-fc is no method for elasticity",
        ),
        (
            vec!["orders", "gap", "--set", "nu=0.3"],
            "--set is for parameters of scenes of elasticity",
        ),
    ] {
        let ran = run(at, &words);
        assert_eq!(ran.code, Some(2), "{words:?}: {}{}", ran.stdout, ran.stderr);
        assert!(ran.stderr.contains(what), "{words:?}: {}", ran.stderr);
    }
}
