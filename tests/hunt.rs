//! What a hunt for false passes and useless messages found: each is a test here; `mutants.py` hunts on.

use std::fs;
use std::process::Command;

use crate::common::{folder, run, write};

/// The octahedron on the sphere, each face of which may be cut in three at its middle, brought onto the sphere; u = x + 2.
fn sphere(cut: bool) -> String {
    let mut points = vec![
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0_f64],
    ];
    let mut cells: Vec<[usize; 3]> = Vec::new();
    for (x, y, z) in (0..8).map(|k| (k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2))) {
        if !cut {
            cells.push([x, y, z]);
            continue;
        }
        let middle: [f64; 3] =
            [0, 1, 2].map(|i| (points[x][i] + points[y][i] + points[z][i]) / 3.0_f64.sqrt());
        points.push(middle);
        let m = points.len() - 1;
        cells.extend([[x, y, m], [y, z, m], [z, x, m]]);
    }
    surface(&points, &cells)
}

fn surface(points: &[[f64; 3]], cells: &[[usize; 3]]) -> String {
    let words = |numbers: Vec<String>| numbers.join(" ");
    let array = |head: &str, numbers: Vec<String>| {
        format!(
            "<DataArray {head} format=\"ascii\">{}</DataArray>",
            words(numbers)
        )
    };
    let (n, m) = (points.len(), cells.len());
    let u = points.iter().map(|p| (p[0] + 2.0).to_string()).collect();
    let places = points.iter().flatten().map(f64::to_string).collect();
    let corners = cells.iter().flatten().map(usize::to_string).collect();
    let offsets = (1..=m).map(|k| (3 * k).to_string()).collect();
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\"><UnstructuredGrid><Piece NumberOfPoints=\"{n}\" NumberOfCells=\"{m}\">\
         <Points>{}</Points><Cells>{}{}{}</Cells><PointData>{}</PointData></Piece></UnstructuredGrid></VTKFile>",
        array("type=\"Float64\" NumberOfComponents=\"3\"", places),
        array("type=\"Int64\" Name=\"connectivity\"", corners),
        array("type=\"Int64\" Name=\"offsets\"", offsets),
        array("type=\"UInt8\" Name=\"types\"", vec!["5".to_owned(); m]),
        array("type=\"Float64\" Name=\"u\"", u),
    )
}

/// Surfaces that are far from each other are not one, nor is a surface a plane; on one mesh values are compared point by point.
#[test]
fn surfaces_in_space_that_are_far_apart_are_not_one() {
    let folder = folder();
    let at = folder.path();
    write(at, "coarse.vtu", &sphere(false));
    write(at, "fine.vtu", &sphere(true));
    write(at, "twin.vtu", &sphere(true).replace("<Piece", "\n<Piece"));
    write(
        at,
        "other.vtu",
        &sphere(true).replace(
            "Name=\"u\" format=\"ascii\">3 ",
            "Name=\"u\" format=\"ascii\">3.1 ",
        ),
    );
    let square = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    write(at, "flat.vtu", &surface(&square, &[[0, 1, 2], [0, 2, 3]]));
    let bump = [&square[..], &[[0.5, 0.5, 0.2]]].concat();
    write(
        at,
        "bump.vtu",
        &surface(&bump, &[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]),
    );
    for (a, b) in [("coarse", "fine"), ("fine", "coarse")] {
        let ran = run(at, &["compare", &format!("{a}.vtu"), &format!("{b}.vtu")]);
        assert_ne!(ran.code, Some(0), "{a}, {b}: {}", ran.stdout);
        let all = ran.stdout + &ran.stderr;
        let words = ["tenth of the cells' size", "nothing in common"];
        assert!(words.iter().any(|of| all.contains(of)), "{a}, {b}: {all}");
    }
    for (a, b) in [("flat", "bump"), ("bump", "flat")] {
        let ran = run(at, &["compare", &format!("{a}.vtu"), &format!("{b}.vtu")]);
        assert_eq!(ran.code, Some(2), "{a}, {b}: {}", ran.stdout);
        assert!(
            ran.stderr.contains("one mesh is a surface in space"),
            "{a}, {b}: {}",
            ran.stderr
        );
    }
    let ran = run(at, &["compare", "fine.vtu", "twin.vtu"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let ran = run(at, &["compare", "fine.vtu", "other.vtu"]);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
}

/// A time that no result has is not the only one there is.
#[test]
fn a_time_is_not_asked_of_results_without_times() {
    let folder = folder();
    let at = folder.path();
    write(at, "a.csv", "vertex,u\n0,1\n1,2\n");
    write(at, "b.csv", "vertex,u\n0,1\n1,2.0\n");
    assert_eq!(run(at, &["compare", "a.csv", "b.csv"]).code, Some(0));
    let ran = run(at, &["compare", "a.csv", "b.csv", "--time", "7"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(
        ran.stderr.contains("neither result has a time"),
        "{}",
        ran.stderr
    );
}

/// The scripts of templates read triangles: other cells are refused before anything is made.
#[test]
fn a_template_refuses_a_mesh_that_its_scripts_cannot_read() {
    let folder = folder();
    let at = folder.path();
    let nodes = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n$Elements\n";
    write(
        at,
        "quads.msh",
        &format!("{nodes}2\n1 1 2 1 1 1 2\n2 3 2 9 1 1 2 3 4\n$EndElements\n"),
    );
    write(
        at,
        "solid.msh",
        &format!(
            "{}1\n1 4 2 9 1 1 2 3 4\n$EndElements\n",
            nodes.replace("4 0 1 0", "4 0 1 1")
        ),
    );
    write(
        at,
        "plane.msh",
        &format!("{nodes}2\n1 2 2 9 1 1 2 3\n2 2 2 9 1 1 3 4\n$EndElements\n"),
    );
    for (mesh, kind) in [("quads.msh", "quadrangle"), ("solid.msh", "tetrahedron")] {
        let ran = run(at, &["new", "mine", "--from", "obstacle", "--mesh", mesh]);
        assert_eq!(ran.code, Some(2), "{}", ran.stdout);
        assert!(
            ran.stderr.contains(&format!("cells of kind {kind}")),
            "{}",
            ran.stderr
        );
        assert!(!at.join("mine").exists());
    }
    let ran = run(
        at,
        &["new", "mine", "--from", "obstacle", "--mesh", "plane.msh"],
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}

/// A face-off file is run as `verify` wants it: one that starts programs may have to be named as such.
fn face_off(at: &std::path::Path, file: &str) -> crate::common::Ran {
    let help = run(at, &["verify", "--help"]).stdout;
    let run_it: &[&str] = if help.contains("--run") {
        &["verify", "--run", file]
    } else {
        &["verify", file]
    };
    run(at, run_it)
}

fn freefem(at: &std::path::Path, script: &str) {
    write(at, "s.edp", script);
    write(at, "u.csv", "vertex,u\n0,1\n1,2\n");
    write(
        at,
        "x.toml",
        "name = \"x\"\n[codes.a]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"-ne\", \"s.edp\", \"{out}\"]\nnumbers = \"n.csv\"\n\
         [codes.b]\ncommand = [\"sh\", \"-c\", \"echo a,1 > {out}/n.csv\"]\nnumbers = \"n.csv\"\n\
         [numbers.a]\nsame = \"discretisation\"\nrtol = 1e-12\n",
    );
}

const WRITES: &str = "ofstream f(ARGV[ARGV.n - 1] + \"/n.csv\");\nf << \"a,1\" << endl;\n";

/// Debian's FreeFEM looks for its plugins where they are not; codes of a face-off find them all the same, and `engines` says so.
#[test]
fn freefem_finds_its_plugins() {
    let folder = folder();
    let at = folder.path();
    freefem(at, &format!("load \"msh3\"\n{WRITES}"));
    let ran = face_off(at, "x.toml");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let script = at.join("load.edp");
    fs::write(&script, "load \"msh3\"\n").unwrap();
    let loads = Command::new("FreeFem++-nw")
        .args(["-v", "0", "-ne"])
        .arg(&script)
        .output()
        .unwrap();
    let ran = run(at, &["engines"]);
    assert_eq!(
        !loads.status.success(),
        ran.stdout.contains("FF_LOADPATH"),
        "{}",
        ran.stdout
    );
}

/// The line of a script that FreeFEM names is in the message.
#[test]
fn the_line_that_freefem_names_is_quoted() {
    let folder = folder();
    let at = folder.path();
    freefem(at, &format!("int k = 1;\n\nfoo(k;\n{WRITES}"));
    let ran = face_off(at, "x.toml");
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    let told = format!("{}{}", ran.stdout, ran.stderr);
    assert!(
        told.contains("Compile error :") && told.contains("line number :3, foo"),
        "{told}"
    );
}

/// Where a code gave no answer that counts, nothing holds; a claim to have converged counts as much as its residual.
#[test]
fn stress_and_study_of_a_code_that_lies_are_no_pass() {
    let folder = folder();
    let at = folder.path();
    let script = "import json, os, pathlib, struct\njob = json.loads(pathlib.Path('job.json').read_text())\ncases = []\n\
                  for case in job['cases']:\n    rows = os.path.getsize(case['mesh']['cells']) // 8\n    dofs = 'out/' + case['id'] + '.dofs.f64'\n    \
                  pathlib.Path(dofs).write_bytes(struct.pack('<d', float('nan')) * rows)\n    \
                  cases.append({'id': case['id'], 'converged': True, 'iterations': 1, 'increments': [0.0], 'rows': rows, 'dofs': dofs})\n\
                  pathlib.Path('out/status.json').write_text(json.dumps({'protocol': 1, 'version': '1', 'cases': cases}))\n";
    write(at, "nan.py", script);
    write(
        at,
        "nan.toml",
        "name = \"nan\"\ncommand = [\"/usr/bin/python3\", \"nan.py\"]\n",
    );
    let words = [
        "stress",
        "transition-1.5",
        "--families",
        "gamma0",
        "--methods",
        "cr",
        "--engines",
    ];
    let ran = run(at, &[&words[..], &["nan.toml"]].concat());
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    write(at, "nan.py", &script.replace("float('nan')", "0.5"));
    let words = [
        "study",
        "one-zone",
        "--budget",
        "1s",
        "--finest",
        "4",
        "--methods",
        "cr",
        "--engines",
        "nan.toml",
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
}
