//! `faceoff judge`: planted faults, each left in a file of a code that is not run again, are named with their place.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{Ran, companion_with, folder, in_turn, run, told, write};
use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem, Splitting, Stop, solve};
use faceoff_fem::scene::{Expression, HRule, Scene};
use faceoff_mesh::mesh::Triangulation;

/// Data of every kind; Γ_C is free in part.
fn scene_text(dim: usize, extra: &str) -> String {
    let (generator, n, sides) = match dim {
        2 => ("union-jack", 8, "\"left\", \"right\""),
        _ => ("union-cube", 3, "\"left\", \"right\", \"front\", \"back\""),
    };
    format!(
        "name = \"all-data\"\n[mesh]\ngenerator = \"{generator}\"\nn = {n}\n\
         [boundary]\ndirichlet = [\"top\"]\nneumann = [{sides}]\ncontact = [\"bottom\"]\n\
         [data]\nf = \"-2*pi*sin(2*pi*x)\"\ng = \"0.02*x\"\nt = \"0.1*x - 0.03\"\npsi = \"0.02*cos(2*x) - 0.01\"\n{extra}"
    )
}

/// What is done to a problem before it is solved, and to its solution.
type Solve = fn(&Scene, &Triangulation, Method) -> Vec<f64>;

/// One with the scheme changed.
fn with(
    scene: &Scene,
    mesh: &Triangulation,
    method: Method,
    change: impl Fn(&mut Discretisation),
    also: impl Fn(&mut Problem),
) -> Vec<f64> {
    let mut discretisation = Discretisation::of(scene, method);
    change(&mut discretisation);
    let mut problem = Problem::new(scene, mesh, &discretisation).unwrap();
    also(&mut problem);
    let found = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(())).unwrap();
    assert!(found.converged);
    found.u
}

fn honest(scene: &Scene, mesh: &Triangulation, method: Method) -> Vec<f64> {
    with(scene, mesh, method, |_| {}, |_| {})
}

fn with_data(scene: &Scene, t: &str, psi: &str) -> Scene {
    let mut data = scene.data().clone();
    data.t = Expression::parse(&t.replace("OLD", data.t.text())).unwrap();
    data.psi = Expression::parse(&psi.replace("OLD", data.psi.text())).unwrap();
    scene.with_data(data)
}

/// The contact face on which γ says most: free, with the largest flux.
fn free_face(problem: &Problem, u: &[f64]) -> usize {
    let flux = |face: &faceoff_fem::contact::ContactFace| {
        let local = problem.space.local(face.cell, u);
        let traces = face.points.iter().map(|p| p.trace(face.gamma, &local));
        let traces: Vec<_> = traces.collect();
        match traces.iter().all(|t| t.p > 0.0) {
            true => traces[0].flux.abs(),
            false => 0.0,
        }
    };
    let faces = 0..problem.contact.len();
    faces
        .max_by(|a, b| flux(&problem.contact[*a]).total_cmp(&flux(&problem.contact[*b])))
        .unwrap()
}

/// A dof on Γ_D in the middle of the numbering.
fn held_dof(problem: &Problem) -> usize {
    let held: Vec<usize> = (0..problem.space.dofs)
        .filter(|dof| problem.dirichlet[*dof].is_some())
        .collect();
    held[held.len() / 2]
}

struct Fault {
    name: &'static str,
    solve: Solve,
    /// Of the first explanation, and in its words.
    ingredient: &'static str,
    said: &'static str,
    term: &'static str,
}

const FAULTS: [Fault; 13] = [
    Fault {
        name: "γ × 1.001",
        solve: |scene, mesh, method| with(scene, mesh, method, |d| d.gamma0 *= 1.001, |_| {}),
        ingredient: "γ",
        said: "γ is × 1.00100 on all faces",
        term: "contact",
    },
    Fault {
        name: "γ × 1.01 on one face",
        solve: |scene, mesh, method| {
            let u = honest(scene, mesh, method);
            with(
                scene,
                mesh,
                method,
                |_| {},
                |problem| {
                    let face = free_face(problem, &u);
                    let mut gamma: Vec<f64> = problem.contact.iter().map(|f| f.gamma).collect();
                    gamma[face] *= 1.01;
                    problem.set_gamma(&gamma);
                },
            )
        },
        ingredient: "γ",
        said: "γ is × 1.0100 on face",
        term: "contact",
    },
    Fault {
        name: "another rule for f",
        solve: |scene, mesh, method| {
            let rule = ["edges-3", "hammer-4"][mesh.dim - 2];
            let rule = Some(rule.to_owned());
            with(
                scene,
                mesh,
                method,
                |d| d.load_quadrature = rule.clone(),
                |_| {},
            )
        },
        ingredient: "the quadrature of the load",
        said: "(f,v) is integrated by",
        term: "load",
    },
    Fault {
        name: "another rule on Γ_C",
        solve: |scene, mesh, method| {
            let rule = ["gauss-2", "edges-3"][mesh.dim - 2];
            let rule = Some(rule.to_owned());
            with(
                scene,
                mesh,
                method,
                |d| d.contact_quadrature = rule.clone(),
                |_| {},
            )
        },
        ingredient: "the quadrature on Γ_C",
        said: "Γ_C is integrated by",
        term: "contact",
    },
    Fault {
        name: "sign of t",
        solve: |scene, mesh, method| honest(&with_data(scene, "-(OLD)", "OLD"), mesh, method),
        ingredient: "t",
        said: "t has the other sign",
        term: "load",
    },
    Fault {
        name: "ψ + 1e-6",
        solve: |scene, mesh, method| honest(&with_data(scene, "OLD", "OLD + 1e-6"), mesh, method),
        ingredient: "ψ",
        said: "ψ is 1e-6 too large",
        term: "contact",
    },
    Fault {
        name: "one value on Γ_D",
        solve: |scene, mesh, method| {
            with(
                scene,
                mesh,
                method,
                |_| {},
                |problem| {
                    let dof = held_dof(problem);
                    let g = problem.dirichlet[dof].unwrap();
                    problem.dirichlet.set(dof, g + 1e-3);
                },
            )
        },
        ingredient: "g",
        said: "not g = ",
        term: "dirichlet",
    },
    Fault {
        name: "float32 output",
        solve: |scene, mesh, method| {
            let u = honest(scene, mesh, method);
            u.into_iter().map(|u| f64::from(u as f32)).collect()
        },
        ingredient: "the digits",
        said: "as binary32",
        term: "",
    },
    Fault {
        name: "six digits",
        solve: |scene, mesh, method| {
            let u = honest(scene, mesh, method).into_iter();
            u.map(|u| format!("{u:.5e}").parse().unwrap()).collect()
        },
        ingredient: "the digits",
        said: "with 6 digits",
        term: "",
    },
    Fault {
        name: "u × -2",
        solve: |scene, mesh, method| {
            let u = honest(scene, mesh, method).into_iter();
            u.map(|u| -2.0 * u).collect()
        },
        ingredient: "u",
        said: "u is × -2.000 as a whole",
        term: "",
    },
    Fault {
        name: "one value off",
        solve: |scene, mesh, method| {
            let mut u = honest(scene, mesh, method);
            let k = u.len() / 2;
            u[k] += 1e-7;
            u
        },
        ingredient: "u",
        said: "one value is off",
        term: "",
    },
    Fault {
        name: "two values exchanged",
        solve: |scene, mesh, method| {
            let mut u = honest(scene, mesh, method);
            let (i, k) = (u.len() / 2, u.len() / 2 + 7);
            u.swap(i, k);
            u
        },
        ingredient: "the order",
        said: "2 of",
        term: "",
    },
    Fault {
        name: "all values permuted",
        solve: |scene, mesh, method| {
            let mut u = honest(scene, mesh, method);
            u.rotate_left(1);
            u
        },
        ingredient: "the order",
        said: "its values are permuted",
        term: "",
    },
];

/// u at the places of its dofs.
fn csv(at: &Path, name: &str, mesh: &Triangulation, method: Method, u: &[f64]) {
    let space = faceoff_fem::element::Space::new(mesh, method.element);
    let mut text = String::from("x,y,z,u\n");
    for ([x, y, z], u) in space.points().zip(u) {
        text += &format!("{x:e},{y:e},{z:e},{u:e}\n");
    }
    write(at, name, &text);
}

fn judge(at: &Path, words: &[&str]) -> Ran {
    run(at, &[&["judge"], words].concat())
}

/// What is found about a file with a fault.
fn found(at: &Path, words: &[&str]) -> Value {
    let ran = judge(at, &[words, &["--json", "-"]].concat());
    assert_eq!(ran.code, Some(1), "{words:?}: {}{}", ran.stdout, ran.stderr);
    let found = ran.json();
    assert_eq!(found["verdict"], "disagree");
    found
}

/// The first explanation accounts for the fault, in these words.
fn named(what: &str, found: &Value, ingredient: &str, said: &str) {
    let first = &found["findings"]["explanations"][0];
    println!(
        "{what} | {} | {} | {} | {}",
        first["ingredient"], found["findings"]["residual"], first["left"], first["what"]
    );
    let words = first["what"].as_str().unwrap();
    // Only the distance speaks for an iteration that stopped.
    assert_eq!(
        first["accounts"],
        ingredient != "the iteration",
        "{what}: {}",
        found["findings"]["explanations"]
    );
    assert_eq!(first["ingredient"], ingredient, "{what}: {words}");
    assert!(words.contains(said), "{what}: {words}");
    assert!(found["sentence"].as_str().unwrap().contains(said));
}

#[test]
fn planted_faults_are_named_from_a_csv() {
    let folder = folder();
    let at = folder.path();
    for dim in [2, 3] {
        write(at, "s.toml", &scene_text(dim, ""));
        let scene = Scene::find(&at.join("s.toml").to_string_lossy()).unwrap();
        let mesh = scene.triangulation(None).unwrap();
        for name in ["cr", "cr-fc", "p2"] {
            let method: Method = name.parse().unwrap();
            let words = ["u.csv", "--scene", "s.toml", "--method", name];
            let u = honest(&scene, &mesh, method);
            csv(at, "u.csv", &mesh, method, &u);
            let ran = judge(at, &words);
            assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
            for fault in &FAULTS {
                let what = format!("{dim}D {name}: {}", fault.name);
                let u = (fault.solve)(&scene, &mesh, method);
                csv(at, "u.csv", &mesh, method, &u);
                if is_no_fault(&scene, &mesh, method, &u) {
                    assert!(name == "cr-fc" && fault.term == "contact", "{what}");
                    continue;
                }
                let found = found(at, &words);
                named(&what, &found, fault.ingredient, fault.said);
                let term = &found["findings"]["explanations"][0]["term"];
                assert_eq!(term.as_str().unwrap_or_default(), fault.term);
                place(&what, fault, &scene, &mesh, method, &found);
            }
        }
    }
}

/// Where no face is in contact in part, the solution of `cr-fc` depends neither on γ nor on the rule on Γ_C.
fn is_no_fault(scene: &Scene, mesh: &Triangulation, method: Method, u: &[f64]) -> bool {
    let problem = Problem::new(scene, mesh, &Discretisation::of(scene, method)).unwrap();
    problem.backward_error(u).0 < 1e-13
}

/// A fault at a place is said to be there and nowhere else.
fn place(
    what: &str,
    fault: &Fault,
    scene: &Scene,
    mesh: &Triangulation,
    method: Method,
    found: &Value,
) {
    let problem = Problem::new(scene, mesh, &Discretisation::of(scene, method)).unwrap();
    let expected = match fault.name {
        "γ × 1.01 on one face" => {
            let u = honest(scene, mesh, method);
            let face = problem.contact[free_face(&problem, &u)].face;
            vec![mesh.face(face).to_vec()]
        }
        "one value off" => vec![problem.space.carrier(problem.space.dofs / 2)],
        "one value on Γ_D" => vec![problem.space.carrier(held_dof(&problem))],
        "two values exchanged" => {
            let i = problem.space.dofs / 2;
            vec![problem.space.carrier(i), problem.space.carrier(i + 7)]
        }
        _ => return,
    };
    let at = found["findings"]["explanations"][0]["at"]
        .as_array()
        .unwrap();
    let at: Vec<Vec<u32>> = at
        .iter()
        .map(|spot| serde_json::from_value(spot["vertices"].clone()).unwrap())
        .collect();
    assert_eq!(at, expected, "{what}");
}

/// What the folder of a report has of every row: its terms, which sum to the residual.
#[test]
fn the_rows_of_a_report_are_split_into_terms() {
    let folder = folder();
    let at = folder.path();
    write(at, "s.toml", &scene_text(2, ""));
    let solved = run(at, &["solve", "s.toml", "--gamma0", "7", "--out", "u.vtu"]);
    assert_eq!(solved.code, Some(0), "{}", solved.stderr);
    let ran = judge(
        at,
        &[
            "u.vtu", "--scene", "s.toml", "--report", "r", "--junit", "j.xml",
        ],
    );
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    let said = "γ is × 7.000000e-2 on all faces";
    assert!(
        ran.stdout.lines().last().unwrap().contains(said),
        "{}",
        ran.stdout
    );
    let junit = std::fs::read_to_string(at.join("j.xml")).unwrap();
    assert!(
        junit.contains("failures=\"1\"") && junit.contains(said),
        "{junit}"
    );
    let page = std::fs::read_to_string(at.join("r/index.html")).unwrap();
    assert!(page.contains(said));
    let rows = std::fs::read_to_string(at.join("r/rows.csv")).unwrap();
    let mut most = 0.0_f64;
    for row in rows.lines().skip(1) {
        let row: Vec<f64> = row.split(',').map(|x| x.parse().unwrap()).collect();
        let [error, residual] = [row[5], row[6]];
        let (sum, size) = row[7..]
            .iter()
            .fold((0.0, 0.0), |(s, t), x| (s + x, t + x.abs()));
        assert!(size == 0.0 || (sum - residual).abs() <= 1e-13 * size);
        most = most.max(error);
    }
    assert_eq!(rows.lines().count(), 209);
    let json = std::fs::read_to_string(at.join("r/judge.json")).unwrap();
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["findings"]["residual"].as_f64(), Some(most));
}

/// h is the same everywhere on the meshes of generators.
#[test]
fn a_global_h_is_named_on_unstructured_meshes() {
    let folder = folder();
    let at = folder.path();
    for (name, n) in [("plate", "16"), ("block", "4")] {
        let scene = Scene::find(name).unwrap();
        let mesh = scene.triangulation(n.parse().ok()).unwrap();
        for method in ["cr", "cr-fc", "p2"] {
            let words = ["u.csv", "--scene", name, "--n", n, "--method", method];
            let of: Method = method.parse().unwrap();
            let u = with(&scene, &mesh, of, |d| d.h = HRule::Global, |_| {});
            csv(at, "u.csv", &mesh, of, &u);
            let what = format!("{name} {method}: h global");
            if is_no_fault(&scene, &mesh, of, &u) {
                assert_eq!(method, "cr-fc");
                continue;
            }
            named(&what, &found(at, &words), "h", "h in γ = γ₀ h is global");
        }
    }
}

/// A step of Newton's method that was not the last, and a fixed point that was stopped.
#[test]
fn iterations_that_end_early_are_named() {
    let folder = folder();
    let at = folder.path();
    for dim in [2, 3] {
        write(at, "s.toml", &scene_text(dim, "[method]\ngamma0 = 0.2\n"));
        let scene = Scene::find(&at.join("s.toml").to_string_lossy()).unwrap();
        let mesh = scene.triangulation(None).unwrap();
        for name in ["cr", "cr-fc", "p2"] {
            let method: Method = name.parse().unwrap();
            let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
            let by = |iteration, stop| solve(&problem, iteration, stop, |_, _| Ok(())).unwrap();
            let steps = by(Iteration::Newton, Stop::default()).increments.len();
            let early = (1..steps).rev().map(|max_iterations| {
                let stop = Stop {
                    max_iterations,
                    ..Stop::default()
                };
                by(Iteration::Newton, stop)
            });
            let lags = |found: &faceoff_fem::contact::Solution| found.backward_error > 1e-9;
            let words = ["u.csv", "--scene", "s.toml", "--method", name];
            let found_early = early.into_iter().find(lags).unwrap();
            csv(at, "u.csv", &mesh, method, &found_early.u);
            let what = format!("{dim}D {name}: lagged contact");
            // Contact is sought face by face first, and so the step before the last may solve `cr-vi`, which is `cr-fc` with one
            // status a face.
            let lagged = found(at, &words);
            match name {
                "cr-fc" if dim == 2 => {
                    named(&what, &lagged, "the method", "it solves cr-vi, not cr-fc")
                }
                _ => {
                    let said = "contact lags by an iteration";
                    named(&what, &lagged, "the contact status", said);
                }
            }

            let stop = Stop {
                increment: 1e-6,
                max_iterations: 2000,
            };
            let fixed = Iteration::FixedPoint(Splitting::LaggedP);
            let stopped = by(fixed, stop);
            csv(at, "u.csv", &mesh, method, &stopped.u);
            let what = format!("{dim}D {name}: stopped at 1e-6");
            named(
                &what,
                &found(at, &words),
                "the iteration",
                "an iteration that stopped early",
            );
        }
    }
}

#[test]
fn an_agreement_takes_a_dozen_lines_and_the_rest_is_asked_for() {
    let folder = folder();
    let scenes = ["one-zone", "three-zones", "five-zones", "plate"];
    let words = ["--engines", "rust,freefem", "--methods", "cr,cr-fc,p2"];
    let words = [&["verify"][..], &scenes, &words].concat();
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let lines: Vec<&str> = ran.stdout.lines().collect();
    assert!(lines.len() <= 12, "{}", ran.stdout);
    assert_eq!(lines.last(), Some(&"agree"));
    assert!(lines[0].contains("4 more with --verbose"), "{}", ran.stdout);
    let ran = run(
        folder.path(),
        &[
            "verify",
            "one-zone",
            "--n",
            "4",
            "--engines",
            "rust,freefem",
            "-v",
        ],
    );
    assert!(ran.stdout.contains("rust – freefem") && ran.stdout.contains("moments"));
}

#[test]
fn the_verdict_has_a_colour_on_a_terminal_that_may_be_refused() {
    let folder = folder();
    let at = folder.path();
    run(at, &["solve", "one-zone", "--n", "4", "--out", "u.vtu"]);
    let on_terminal = |gamma0: &str, no_color: &str| {
        let program = env!("CARGO_BIN_EXE_faceoff");
        let typed = format!("'{program}' judge u.vtu --scene one-zone --gamma0 {gamma0}");
        crate::common::on_terminal(at, &typed, no_color).stdout
    };
    assert!(on_terminal("100", "").contains("\u{1b}[1;32magree: "));
    assert!(on_terminal("7", "").contains("\u{1b}[1;31mdisagree: "));
    let plain = on_terminal("7", "1");
    assert!(
        plain.contains("disagree: ") && !plain.contains('\u{1b}'),
        "{plain}"
    );
}

/// A fault of a companion: its name, and the changes to FreeFEM's and to dolfinx' script, in which `{cell}`, `{local}` and `{gamma}`
/// stand for numbers of the scene; the ingredient, and the words.
struct Planted {
    name: &'static str,
    freefem: &'static [(&'static str, &'static str)],
    fenicsx: &'static [(&'static str, &'static str)],
    ingredient: &'static str,
    said: &'static str,
}

const FREEFEM_GAMMA: &str = "gamma[][Ch(cell, 0)] = value;";
// After the companion has checked that γ is γ₀ h.
const FENICSX_GAMMA: &str = "of_input[numbers] = values";

const PLANTED: [Planted; 12] = [
    Planted {
        name: "γ × 1.001",
        freefem: &[(FREEFEM_GAMMA, "gamma[][Ch(cell, 0)] = 1.001*value;")],
        fenicsx: &[(FENICSX_GAMMA, "of_input[numbers] = 1.001 * values")],
        ingredient: "γ",
        said: "γ is × 1.00100 on all faces",
    },
    Planted {
        name: "γ × 1.01 on one face",
        freefem: &[(
            FREEFEM_GAMMA,
            "gamma[][Ch(cell, 0)] = (cell == {cell} ? 1.01 : 1.)*value;",
        )],
        fenicsx: &[(
            FENICSX_GAMMA,
            "of_input[numbers] = np.where(numbers == {cell}, 1.01, 1.0) * values",
        )],
        ingredient: "γ",
        said: "γ is × 1.0100 on face {face}",
    },
    Planted {
        name: "another rule for f",
        freefem: &[("int cellOrder = findCellOrder()", "int cellOrder = 3")],
        fenicsx: &[(
            "metadata=job.quadrature_rule(quadrature[\"cell\"], d))",
            "metadata={\"quadrature_degree\": 2})",
        )],
        ingredient: "the quadrature of the load",
        said: "(f,v) is integrated by",
    },
    Planted {
        name: "another rule on Γ_C",
        freefem: &[("faceOrder = findFaceOrder()", "faceOrder = 4")],
        fenicsx: &[(
            "metadata=job.quadrature_rule(quadrature[\"face\"], d - 1)",
            "metadata={\"quadrature_degree\": 3}",
        )],
        ingredient: "the quadrature on Γ_C",
        said: "Γ_C is integrated by gauss-2",
    },
    Planted {
        name: "sign of t",
        freefem: &[("(t*v)", "(-t*v)")],
        fenicsx: &[(
            "+ data[\"t\"] * v * ds(NEUMANN)",
            "- data[\"t\"] * v * ds(NEUMANN)",
        )],
        ingredient: "t",
        said: "t has the other sign",
    },
    Planted {
        name: "ψ + 1e-6",
        freefem: &[(
            "func psi = scenePsi(scene);",
            "func psi = scenePsi(scene) + 1e-6;",
        )],
        fenicsx: &[(
            "    P_gamma = gamma * flux(u) - (u - psi)",
            "    psi = psi + 1e-6\n    P_gamma = gamma * flux(u) - (u - psi)",
        )],
        ingredient: "ψ",
        said: "ψ is 1e-6 too large",
    },
    Planted {
        name: "one value on Γ_D",
        freefem: &[(
            "if (!broken) u[] = coefficients;",
            "coefficients[Wh({held}, {local})] += 1e-3; if (!broken) u[] = coefficients;",
        )],
        fenicsx: &[(
            "        bc = fem.dirichletbc(",
            "        u.x.array[on_D[len(on_D) // 2]] += 1e-3\n        bc = fem.dirichletbc(",
        )],
        ingredient: "g",
        said: "not g = ",
    },
    Planted {
        name: "lagged contact",
        freefem: &[(
            "converged = (isSmall && error <= enough) || (isRounding && wasRounding);",
            "converged = true;",
        )],
        fenicsx: &[(
            "converged = (is_small and error <= enough) or (is_rounding and was_rounding)",
            "converged = True",
        )],
        ingredient: "the contact status",
        said: "contact lags by an iteration",
    },
    Planted {
        name: "stopped at 1e-6",
        freefem: &[
            ("set(J, solver=UMFPACK);", "set(J, solver=GMRES, eps=1e-2);"),
            (
                "converged = (isSmall && error <= enough) || (isRounding && wasRounding);",
                "converged = increment < 1e-6;",
            ),
        ],
        fenicsx: &[
            (
                "    solver.setFromOptions()",
                "    solver.setType(\"gmres\")\n    solver.getPC().setType(\"ilu\")\n    solver.setTolerances(rtol=1e-2)",
            ),
            (
                "converged = (is_small and error <= enough) or (is_rounding and was_rounding)",
                "converged = increments[-1] < 1e-6",
            ),
        ],
        ingredient: "the iteration",
        said: "an iteration that stopped early",
    },
    Planted {
        name: "few digits",
        freefem: &[("dofs.precision(17);", "dofs.precision(7);")],
        fenicsx: &[(
            "dofs.astype(\"<f8\")",
            "dofs.astype(\"<f4\").astype(\"<f8\")",
        )],
        ingredient: "the digits",
        said: "its values are written",
    },
    Planted {
        name: "h global",
        freefem: &[(FREEFEM_GAMMA, "gamma[][Ch(cell, 0)] = {gamma};")],
        fenicsx: &[(FENICSX_GAMMA, "of_input[numbers] = {gamma}")],
        ingredient: "h",
        said: "h in γ = γ₀ h is global",
    },
    Planted {
        name: "permuted faces",
        freefem: &[(
            "rows = Th.nt*Wh.ndofK;",
            "rows = Th.nt*Wh.ndofK; { int p = Wh(3, 0), q = Wh(60, 0); real keep = coefficients[p]; coefficients[p] = coefficients[q]; coefficients[q] = keep; }",
        )],
        fenicsx: &[(
            "        dofs = job.gather_dofs(u, cells)",
            "        u.x.array[[11, 101]] = u.x.array[[101, 11]]\n        dofs = job.gather_dofs(u, cells)",
        )],
        ingredient: "the order",
        said: "its values are permuted: 2 of",
    },
];

/// Each code with each fault beside two that are right: the last line names it, the JSON has where and how much.
fn planted_in(companion: &str) {
    // FreeFEM, which starts at once, has each fault by both methods; dolfinx by one of them in turn.
    let of = if companion == "freefem" { 1 } else { 2 };
    for (k, fault) in PLANTED.iter().enumerate() {
        for method in in_turn(k, of, ["cr", "p2"]) {
            let folder = folder();
            let at = folder.path();
            let name = match fault.name {
                "h global" => "plate",
                _ => "s.toml",
            };
            write(at, "s.toml", &scene_text(2, ""));
            let text = at.join(name);
            let scene = match name {
                "plate" => Scene::find(name).unwrap(),
                _ => Scene::find(&text.to_string_lossy()).unwrap(),
            };
            let mesh = scene.triangulation(None).unwrap();
            let of: Method = method.parse().unwrap();
            let mut discretisation = Discretisation::of(&scene, of);
            let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let u = honest(&scene, &mesh, of);
            let face = &problem.contact[free_face(&problem, &u)];
            let on = held_dof(&problem) as u32;
            let local = |cell: usize| {
                let mut dofs = problem.space.cell_dofs(cell).iter();
                dofs.position(|dof| *dof == on)
            };
            let mut cells = (0..mesh.cell_count()).filter_map(|cell| Some((cell, local(cell)?)));
            let (held, local) = cells.next().unwrap();
            discretisation.h = HRule::Global;
            let global = Problem::new(&scene, &mesh, &discretisation).unwrap();
            let numbers = [
                ("{cell}", face.cell.to_string()),
                ("{face}", format!("{:?}", mesh.face(face.face))),
                ("{held}", held.to_string()),
                ("{local}", local.to_string()),
                ("{gamma}", format!("{:e}", global.contact[0].gamma)),
            ];
            let filled = |text: &str| {
                let fill = |text: String, (key, value): &(&str, String)| text.replace(key, value);
                numbers.iter().fold(text.to_owned(), fill)
            };
            let changes = match companion {
                "freefem" => fault.freefem,
                _ => fault.fenicsx,
            };
            let changes: Vec<(&str, String)> = changes
                .iter()
                .map(|(from, to)| (*from, filled(to)))
                .collect();
            let changes: Vec<(&str, &str)> = changes.iter().map(|(a, b)| (*a, &**b)).collect();
            let engine = companion_with(at, companion, &changes);
            let engines = format!("rust,freefem,{engine}");
            let words = ["verify", name, "--engines", &engines, "--methods", method];
            let ran = run(at, &[&words[..], &["--json", "out.json"]].concat());
            let what = format!("{companion} {method}: {}", fault.name);
            assert_eq!(ran.code, Some(1), "{what}: {}{}", ran.stdout, ran.stderr);
            let json: Value =
                serde_json::from_slice(&std::fs::read(at.join("out.json")).unwrap()).unwrap();
            let engines = json["cases"][0]["engines"].as_array().unwrap();
            assert!(engines[..2].iter().all(|e| e.get("findings").is_none()));
            let found = serde_json::json!({
                "findings": engines[2]["findings"],
                "sentence": json["sentence"],
            });
            named(&what, &found, fault.ingredient, &filled(fault.said));
            let last = ran.stdout.lines().last().unwrap();
            assert!(last.starts_with("disagree: changed: "), "{last}");
            assert!(last.contains(&filled(fault.said)), "{last}");
            assert!(last.contains("the other two agree to "), "{last}");
        }
    }
}

/// Faults that are no choice of the scheme, in the script of FreeFEM on a scene: its texts, each with another one, and what the last line says.
type OfForm = (&'static str, &'static [[&'static str; 2]], &'static str);

const SPACE: &str = "fespace Vh(Th, element);";
const FORM: &str =
    "onCells(Th, qforder=2*degree-1)(grad(w)'*grad(v))\n    + on(onNodes, w=0);\n  varf contact";
const CONTACT: [&str; 2] = [
    "(law(u) * contactTest(v) - flux(u)*v)",
    "(dLaw(w, u) * contactTest(v) - dn(w)*v)",
];

const OF_FORM: [OfForm; 9] = [
    (
        "one-zone",
        &[
            [
                SPACE,
                "fespace Vh(Th, element); fespace Dh(Th, P1); Dh data = f;",
            ],
            ["(f*v)", "(data*v)"],
        ],
        "as if `f` were interpolated by P1",
    ),
    (
        "plate",
        &[
            [
                SPACE,
                "fespace Vh(Th, element); fespace Dh(Th, P1); Dh data = psi;",
            ],
            [
                "(gamma*flux(u) - (u - psi))",
                "(gamma*flux(u) - (u - data))",
            ],
            [
                "max(u - psi, gamma*flux(u))",
                "max(u - data, gamma*flux(u))",
            ],
        ],
        "as if `psi` were interpolated by P1",
    ),
    (
        "plate",
        &[[
            FORM,
            "onCells(Th, qforder=2*degree-1)((1 + 0.001*(nuTriangle == 20))*(grad(w)'*grad(v)))\n    + on(onNodes, w=0);\n  varf contact",
        ]],
        "as if the term `(∇u,∇v)` in one cell of 1376, at (0.5697, 0.0743) had the factor 1.001",
    ),
    (
        "one-zone",
        &[["(f*v)", "((nuTriangle != 20)*f*v)"]],
        "as if the term `(f,v)` in one cell of 128, at (0.2917, 0.1667) were missing",
    ),
    (
        "plate",
        &[[
            FORM,
            "onCells(Th, qforder=2*degree-1)(grad(w)'*grad(v) + 1e-4*w*v)\n    + on(onNodes, w=0);\n  varf contact",
        ]],
        "as if 10⁻⁴ times `u*v*dx` by the rule `centroid` were added",
    ),
    (
        "one-zone",
        &[
            [
                CONTACT[0],
                "((abs(x - 0.5) > 0.125)*(law(u) * contactTest(v) - flux(u)*v))",
            ],
            [
                CONTACT[1],
                "((abs(x - 0.5) > 0.125)*(dLaw(w, u) * contactTest(v) - dn(w)*v))",
            ],
        ],
        "as if all terms over `ds(C)` on 2 facets of 8, from (0.4375, 0) to (0.5625, 0) were missing",
    ),
    (
        "plate",
        &[[
            "(law(u) * contactTest(v) - flux",
            "((u - psi) * contactTest(v) - flux",
        ]],
        "as if the term `<[P_γ(u)]₊,∂ₙv>` were missing",
    ),
    (
        "one-zone",
        &[
            ["func f = sceneF(scene);", "func f = 1.01*sceneF(scene);"],
            [FREEFEM_GAMMA, "gamma[][Ch(cell, 0)] = 1.01*value;"],
        ],
        "γ is × 1.0100 on all faces, as with γ₀ = 101, and f is × 1.0100",
    ),
    (
        "plate",
        &[["(f*v)", "(1.01*f*v)"], ["(t*v)", "(0.98*t*v)"]],
        "f is × 1.0100, and t is × 0.9800",
    ),
];

#[test]
fn changes_of_the_scheme_as_a_form_are_named() {
    for (scene, changes, said) in OF_FORM {
        let folder = folder();
        let at = folder.path();
        let changes: Vec<(&str, &str)> = changes.iter().map(|[from, to]| (*from, *to)).collect();
        let engine = companion_with(at, "freefem", &changes);
        let engines = format!("rust,{engine}");
        let mut words = vec!["verify", scene, "--engines", &engines, "--methods", "cr"];
        if scene == "one-zone" {
            words.extend(["--n", "8"]);
        }
        let ran = run(at, &words);
        let last = ran.stdout.lines().last().unwrap_or_default();
        assert_eq!(ran.code, Some(1), "{said}: {}{}", ran.stdout, ran.stderr);
        assert!(last.contains(said), "{said}: {last}");
    }
}

#[test]
fn planted_faults_are_named_in_freefem() {
    planted_in("freefem");
}

#[test]
fn planted_faults_are_named_in_dolfinx() {
    planted_in("fenicsx");
}

/// FreeFEM's own defaults: another rule on Γ_C than ours, and all that is written is a face's midpoint and the value there.
const SCRIPT: &str = r#"// One-zone by the penalty-free method on P1nc, with FreeFEM's usual quadrature.
mesh Th = readmesh("mesh.msh");
fespace Vh(Th, P1nc);
Vh u = 0, d, v;
func f = -2*pi*sin(2*pi*x);
real gamma0 = 100;
macro dn(w) (N.x*dx(w) + N.y*dy(w)) //
macro P(w) (gamma0*hTriangle*dn(w) - w) //
varf residual(w, v) = int2d(Th)(dx(u)*dx(v) + dy(u)*dy(v) - f*v)
  + int1d(Th, 1)((u + max(P(u), 0.))*dn(v) - dn(u)*v) + on(3, w=0);
varf tangent(w, v) = int2d(Th)(dx(w)*dx(v) + dy(w)*dy(v))
  + int1d(Th, 1)((w + (P(u) > 0)*P(w))*dn(v) - dn(w)*v) + on(3, w=0);
for (int step = 0; step < 20; ++step) {
  real[int] r = residual(0, Vh, tgv=-1);
  matrix A = tangent(Vh, Vh, tgv=-1, solver=UMFPACK);
  d[] = A^-1*r;
  u[] -= d[];
}
Vh px = x, py = y;
ofstream file("u.csv");
file.precision(17);
file << "x,y,u" << endl;
for (int i = 0; i < Vh.ndof; ++i)
  file << px[][i] << "," << py[][i] << "," << u[][i] << endl;
"#;

#[test]
fn a_short_script_of_a_freefem_user_is_told_its_quadrature() {
    let folder = folder();
    let at = folder.path();
    // Odd, so that a face is in contact in part.
    let n = "9";
    let made = run(
        at,
        &[
            "mesh", "make", "one-zone", "mesh.msh", "--n", n, "--format", "freefem", "--lossy",
        ],
    );
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    write(at, "mine.edp", SCRIPT);
    let mut freefem = Command::new("FreeFem++-nw");
    freefem
        .args(["-ne", "-v", "0", "-nw", "mine.edp"])
        .current_dir(at);
    let ran = told(freefem.output().unwrap());
    assert_eq!(ran.code, Some(0), "{}", ran.stdout);
    let words = ["u.csv", "--scene", "one-zone", "--n", n, "--method", "cr"];
    let found = found(at, &words);
    named(
        "a user's script",
        &found,
        "the quadrature on Γ_C",
        "Γ_C is integrated by gauss-",
    );
}
