//! Eigenvalues and modes of three codes: the square with its pairs, the L-shape with digits from outside, and planted faults.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, source, write};

/// Eigenvalues of the Laplacian on the L-shape of three unit squares with u = 0 on the boundary: Trefethen and Betcke, Computed
/// eigenmodes of planar regions, 2006; the third and the pair are 2π² and 5π².
const L_SHAPE: [f64; 10] = [
    9.639_723_844_0,
    15.197_251_926_5,
    19.739_208_802_2,
    29.521_481_114_2,
    31.912_635_957_1,
    41.474_509_889_3,
    44.948_487_783_1,
    49.348_022_005_4,
    49.348_022_005_4,
    56.709_609_887_4,
];

/// The L-shape of squares with edges 1/n, cut along one diagonal, with its boundary in one group.
fn l_shape(n: usize) -> String {
    let is_in = |i: usize, j: usize| i < n || j < n;
    // No point of the square that is missing, but for its two sides.
    let is_point = |i: usize, j: usize| i <= n || j <= n;
    let all = || (0..=2 * n).flat_map(|j| (0..=2 * n).map(move |i| (i, j)));
    let points: Vec<(usize, usize)> = all().filter(|(i, j)| is_point(*i, *j)).collect();
    let at = |i: usize, j: usize| {
        1 + points
            .binary_search_by_key(&(j, i), |(i, j)| (*j, *i))
            .unwrap()
    };
    let mut nodes = String::new();
    for (k, (i, j)) in points.iter().enumerate() {
        let [x, y] = [i, j].map(|k| *k as f64 / n as f64);
        writeln!(nodes, "{} {x} {y} 0", k + 1).unwrap();
    }
    let (mut lines, mut cells) = (Vec::new(), Vec::new());
    for (i, j) in (0..2 * n).flat_map(|j| (0..2 * n).map(move |i| (i, j))) {
        if !is_in(i, j) {
            continue;
        }
        let [p, q, r, s] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        cells.push([p, q, r]);
        cells.push([p, r, s]);
        let is_out = |di: isize, dj: isize| {
            let [k, l] = [i as isize + di, j as isize + dj];
            let all = 0..2 * n as isize;
            !(all.contains(&k) && all.contains(&l) && is_in(k as usize, l as usize))
        };
        for (step, edge) in [
            ((0, -1), [p, q]),
            ((1, 0), [q, r]),
            ((0, 1), [r, s]),
            ((-1, 0), [s, p]),
        ] {
            if is_out(step.0, step.1) {
                lines.push(edge);
            }
        }
    }
    let mut elements = String::new();
    for (k, [p, q]) in lines.iter().enumerate() {
        writeln!(elements, "{} 1 2 1 1 {p} {q}", k + 1).unwrap();
    }
    for (k, [p, q, r]) in cells.iter().enumerate() {
        writeln!(elements, "{} 2 2 1 1 {p} {q} {r}", lines.len() + k + 1).unwrap();
    }
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n{nodes}$EndNodes\n$Elements\n{}\n{elements}$EndElements\n",
        points.len(),
        lines.len() + cells.len()
    )
}

/// A face-off of the three codes.
fn file(mesh: &str, count: usize, spectrum: &str) -> String {
    let python = source("target/python/bin/python");
    let list = |suffix: &str| {
        let names: Vec<String> = (1..=count).map(|k| format!("\"m{k}.{suffix}\"")).collect();
        names.join(", ")
    };
    let code = |name: &str, command: &str, mesh: &str, suffix: &str| {
        format!(
            "[codes.{name}]\ncommand = [{command}, \"{{mesh}}\", \"{{out}}\", \"{count}\"]\nmesh = \"{mesh}\"\nresult = [{}]\nnumbers = \"numbers.csv\"\n",
            list(suffix)
        )
    };
    [
        format!("name = \"modes\"\n[mesh]\n{mesh}\n"),
        code(
            "freefem",
            "\"FreeFem++-nw\", \"-v\", \"0\", \"modes.edp\"",
            "freefem",
            "vtu",
        ),
        code(
            "skfem",
            &format!("\"{}\", \"modes_skfem.py\"", python.display()),
            "msh2",
            "vtu",
        ),
        code(
            "dolfinx",
            "\"/usr/bin/python3\", \"modes_dolfinx.py\"",
            "msh2",
            "pvd",
        ),
        format!(
            "[spectra.s]\nvalues = \"lambda\"\nmodes = \"m\"\nsame = \"discretisation\"\n{spectrum}"
        ),
    ]
    .concat()
}

fn scripts(at: &Path) {
    for name in ["modes.edp", "modes_skfem.py", "modes_dolfinx.py"] {
        fs::copy(source("tests/open").join(name), at.join(name)).unwrap();
    }
}

/// What is found with another text in a script.
fn verify(at: &Path, script: &str, (from, to): (&str, &str)) -> (Option<i32>, Value, String) {
    let path = at.join(script);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from} is not in {text}");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let ran = run(
        at,
        &[
            "verify", "--run", "all.toml", "--json", "o.json", "--report", "page",
        ],
    );
    fs::write(&path, text).unwrap();
    assert_valid(
        "json",
        "src/report/schema/face-off-1.json",
        &at.join("o.json"),
    );
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    (
        ran.code,
        serde_json::from_str(&told).unwrap(),
        ran.stdout + &ran.stderr,
    )
}

fn of_pair<'a>(told: &'a Value, codes: [&str; 2]) -> &'a Value {
    let rows = told["spectra"][0]["pairs"].as_array().unwrap();
    let is = |row: &&Value| {
        codes
            .iter()
            .all(|code| row["a"] == *code || row["b"] == *code)
    };
    rows.iter().rfind(is).unwrap()
}

#[test]
fn ten_modes_of_the_l_shape_agree_in_three_codes() {
    let folder = folder();
    let at = folder.path();
    scripts(at);
    write(at, "l.msh", &l_shape(8));
    let exact: Vec<String> = L_SHAPE.iter().map(f64::to_string).collect();
    let spectrum = format!("exact = [{}]\nexact_rtol = 5e-3\n", exact.join(", "));
    write(at, "all.toml", &file("file = \"l.msh\"", 11, &spectrum));
    let (code, told, said) = verify(at, "modes_skfem.py", ("", ""));
    assert_eq!(code, Some(0), "{said}");
    for codes in [
        ["freefem", "skfem"],
        ["freefem", "dolfinx"],
        ["skfem", "dolfinx"],
    ] {
        let row = of_pair(&told, codes);
        assert!(row["relative"].as_f64().unwrap() < 1e-11, "{row}");
        let sines = row["spaces"].as_array().unwrap().iter();
        let largest = sines
            .map(|space| space["sine"].as_f64().unwrap())
            .fold(0.0, f64::max);
        assert!(largest < 1e-7, "{row}");
        assert_eq!(row["values"].as_array().unwrap().len(), 11);
    }
    assert!(
        told["spectra"][0]["exact"]
            .as_array()
            .unwrap()
            .iter()
            .all(|row| row["verdict"] == "agree")
    );
    // Signs and norms are free, and what else a code does to its modes is not.
    let free = ("modes[free] = vectors", "modes[free] = -3*vectors");
    assert_eq!(verify(at, "modes_skfem.py", free).0, Some(0));
    let mixed = (
        "modes[free] = vectors",
        "modes[free] = vectors\nmodes[:, 3] += 1e-4*modes[:, 4]",
    );
    let (code, told, said) = verify(at, "modes_skfem.py", mixed);
    assert_eq!(code, Some(1), "{said}");
    let row = of_pair(&told, ["freefem", "skfem"]);
    let wrong: Vec<&Value> = row["spaces"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|of| of["verdict"] == "disagree")
        .collect();
    assert_eq!(wrong.len(), 1, "{row}");
    assert!(
        (wrong[0]["sine"].as_f64().unwrap() / 1e-4 - 1.0).abs() < 1e-3,
        "{row}"
    );
    assert!((wrong[0]["values"][0].as_f64().unwrap() - 29.52).abs() < 0.1);
    assert_eq!(of_pair(&told, ["freefem", "dolfinx"])["verdict"], "agree");
    // A mass that is one part in ten thousand too large.
    let heavy = ("mass.assemble(basis), D", "1.0001*mass.assemble(basis), D");
    let (code, told, _) = verify(at, "modes_skfem.py", heavy);
    assert_eq!(code, Some(1));
    let row = of_pair(&told, ["skfem", "dolfinx"]);
    assert!(
        (row["relative"].as_f64().unwrap() / 1e-4 - 1.0).abs() < 1e-3,
        "{row}"
    );
    // An eigenvalue that is passed over.
    let (code, _, said) = verify(
        at,
        "modes_skfem.py",
        (
            "values, vectors = eigsh(K, count, M, sigma=0, v0=np.ones(K.shape[0]))",
            "values, vectors = eigsh(K, count + 1, M, sigma=0)\nvalues, vectors = np.delete(values, 4), np.delete(vectors, 4, axis=1)",
        ),
    );
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("skfem** misses 31.9") || said.contains("skfem misses 31.9"),
        "{said}"
    );
}

#[test]
fn pairs_of_the_square_are_spaces_and_spurious_values_are_named() {
    let folder = folder();
    let at = folder.path();
    scripts(at);
    let exact: Vec<String> = [2.0, 5.0, 5.0, 8.0]
        .map(|k: f64| (k * std::f64::consts::PI.powi(2)).to_string())
        .into();
    let spectrum = format!("exact = [{}]\nexact_rtol = 1e-2\n", exact.join(", "));
    let mesh = "generator = \"union-jack\"\nn = [4, 8]";
    write(at, "all.toml", &file(mesh, 5, &spectrum));
    let (code, told, said) = verify(at, "modes_skfem.py", ("", ""));
    // The fifth of a pair stands at the end of each list, where it may be any.
    let row = of_pair(&told, ["freefem", "skfem"]);
    let spaces = row["spaces"].as_array().unwrap();
    assert_eq!(
        (&spaces[1]["dimension"], &spaces[1]["verdict"]),
        (&2.into(), &"agree".into()),
        "{said}"
    );
    let last = spaces.last().unwrap();
    assert_eq!(last["is_cut"], true);
    assert_ne!(last["verdict"], "disagree");
    assert!(
        code == Some(0) || said.contains("ask for further modes"),
        "{said}"
    );
    // The rest shows on one mesh.
    write(
        at,
        "all.toml",
        &file("generator = \"union-jack\"\nn = 8", 5, &spectrum),
    );
    // A rotation of the pair is free; what turns it out of its space is not.
    let turned =
        "modes[free] = vectors\nmodes[:, 1:3] = modes[:, 1:3] @ np.array([[2, 1], [-1, 1]])";
    let (_, told, _) = verify(at, "modes_skfem.py", ("modes[free] = vectors", turned));
    assert_eq!(
        of_pair(&told, ["freefem", "skfem"])["spaces"][1]["verdict"],
        "agree"
    );
    let dependent = "modes[free] = vectors\nmodes[:, 2] = 2*modes[:, 1]";
    let (code, told, said) = verify(at, "modes_skfem.py", ("modes[free] = vectors", dependent));
    assert_eq!(
        (
            code,
            &of_pair(&told, ["freefem", "skfem"])["spaces"][1]["sine"]
        ),
        (Some(1), &Value::Null),
        "{said}"
    );
    // Rows of Dirichlet values with 1 in the diagonal of the mass.
    let spurious = ("diagonal=0.0", "diagonal=1.0");
    let (code, told, said) = verify(at, "modes_dolfinx.py", spurious);
    assert_eq!(code, Some(1));
    assert!(said.contains("dolfinx has the spurious 1, 1"), "{said}");
    assert_eq!(
        of_pair(&told, ["freefem", "skfem"])["verdict"],
        row["verdict"]
    );
}

#[test]
fn a_list_that_ends_early_is_not_an_agreement() {
    let folder = folder();
    let at = folder.path();
    scripts(at);
    let mesh = "generator = \"union-jack\"\nn = 4";
    // Two codes are enough.
    let all = file(mesh, 5, "");
    let [start, end] = ["[codes.dolfinx]", "[spectra.s]"].map(|name| all.find(name).unwrap());
    let all = [&all[..start], &all[end..]].concat();
    let first = ("enumerate(values))", "enumerate(values[:1]))");
    let runs = [
        // All have 2π² and 5π² twice, then 8π² and the first of the pair 10π², where lists may end.
        ("", ("", ""), Some(0), "agree"),
        ("", first, Some(2), "the 1 of skfem end below 4 of freefem"),
        ("count = 5\n", first, Some(1), "skfem has 1 of the lowest 5"),
        ("count = 3\n", first, Some(1), "skfem has 1 of the lowest 3"),
        ("count = 9\n", ("", ""), Some(1), "has 5 of the lowest 9"),
        ("count = 1\n", first, Some(0), "agree"),
    ];
    for (count, fault, expected, words) in runs {
        write(at, "all.toml", &(all.clone() + count));
        let (code, told, said) = verify(at, "modes_skfem.py", fault);
        assert_eq!(code, expected, "{count}{fault:?}: {said}");
        assert!(said.contains(words), "{count}{fault:?}: {said}");
        let row = of_pair(&told, ["freefem", "skfem"]);
        let beyond = row.get("beyond").map(|of| of[0].as_array().unwrap().len());
        let is_beyond = fault == first && count != "count = 1\n";
        assert_eq!(beyond.is_some(), is_beyond, "{row}");
    }
    // A code with one more of the last pair is not longer.
    let fewer = ("enumerate(values))", "enumerate(values[:2]))");
    write(at, "all.toml", &(all + "count = 2\n"));
    let (code, _, said) = verify(at, "modes_skfem.py", fewer);
    assert!(
        code == Some(0) || said.contains("ask for further modes"),
        "{said}"
    );
}

/// curl curl E = λE in the square, E × n = 0: the kernel has a gradient for each vertex inside.
#[test]
fn modes_of_a_cavity_agree_beside_their_kernel() {
    let folder = folder();
    let at = folder.path();
    for name in ["cavity.edp", "cavity_skfem.py", "cavity_dolfinx.py"] {
        fs::copy(source("tests/open").join(name), at.join(name)).unwrap();
    }
    fs::copy(source("examples/blank/moments.idp"), at.join("moments.idp")).unwrap();
    // Two codes write moments on edges, and one functions on cells.
    let spectrum = "names = { dolfinx = [\"lambda\", \"m\"] }\ndrop_kernel = 1e-8\ncount = 9\n\
                    exact = [9.8696, 9.8696, 19.739]\nexact_rtol = 0.05\n";
    let all = file("generator = \"union-jack\"\nn = 4", 20, spectrum)
        .replace("modes = \"m\"", "modes = \"N1curl(m*)\"")
        .replace("modes.edp", "cavity.edp")
        .replace("modes_", "cavity_");
    let [start, end] = ["[codes.freefem]", "[codes.dolfinx]"].map(|name| all.find(name).unwrap());
    let tables = all[start..end].replace(".vtu\"", ".csv\"");
    write(
        at,
        "all.toml",
        &[&all[..start], &tables, &all[end..]].concat(),
    );
    let (code, told, said) = verify(at, "cavity_skfem.py", ("", ""));
    assert_eq!(code, Some(0), "{said}");
    for codes in [
        ["freefem", "skfem"],
        ["freefem", "dolfinx"],
        ["skfem", "dolfinx"],
    ] {
        let row = of_pair(&told, codes);
        assert_eq!(row["kernel"], serde_json::json!([9, 9]), "{row}");
        assert_eq!(row["values"].as_array().unwrap().len(), 9);
        let spaces = row["spaces"].as_array().unwrap();
        assert_eq!(spaces.len(), 5, "{row}");
        assert!(
            spaces
                .iter()
                .all(|space| space["sine"].as_f64().unwrap() < 1e-7),
            "{row}"
        );
    }
    // A pair may be rotated; a gradient, which the curl does not see, may not be added, nor may rows of values that are held be modes.
    let turned =
        "modes[free] = vectors\nmodes[:, 9:11] = modes[:, 9:11] @ np.array([[2, 1], [-1, 1]])";
    let polluted = "modes[free] = vectors\nmodes[:, 11] += 1e-4*modes[:, 0]";
    for (to, expected) in [(turned, Some(0)), (polluted, Some(1))] {
        let (code, _, said) = verify(at, "cavity_skfem.py", ("modes[free] = vectors", to));
        assert_eq!(code, expected, "{said}");
    }
    let spurious = ("bcs=[held], diagonal=1e6", "bcs=[held], diagonal=5.0");
    let (code, _, said) = verify(at, "cavity_dolfinx.py", spurious);
    assert_eq!(code, Some(1));
    assert!(said.contains("dolfinx has the spurious 5, 5"), "{said}");
}

#[test]
fn modes_on_other_meshes_are_compared_as_functions() {
    let folder = folder();
    let at = folder.path();
    scripts(at);
    let spectrum = "rtol = 2e-2\nangle = 2e-2\ncount = 4\n";
    let all = file("generator = \"union-jack\"\nn = 8", 6, spectrum);
    let [start, end] = ["[codes.dolfinx]", "[spectra.s]"].map(|name| all.find(name).unwrap());
    let all = [&all[..start], &all[end..]].concat();
    let own = all
        .replace(
            "\"modes_skfem.py\", \"{mesh}\"",
            "\"modes_skfem.py\", \"-\"",
        )
        .replace("mesh = \"msh2\"", "mesh = \"none\"")
        .replace("same = \"discretisation\"", "same = \"problem\"");
    write(at, "all.toml", &own);
    let script = fs::read_to_string(at.join("modes_skfem.py")).unwrap();
    let script = script
        .replace("read = meshio.read(sys.argv[1])\n", "")
        .replace(
            "MeshTri(read.points[:, :2].T, read.cells_dict[\"triangle\"].T)",
            "MeshTri.init_tensor(*2*(np.linspace(0, 1, 8)**1.1,))",
        );
    fs::write(at.join("modes_skfem.py"), script).unwrap();
    // A pair may come in any basis; a mode is told from a mixture of two.
    let turned =
        "modes[free] = vectors\nmodes[:, 1:3] = modes[:, 1:3] @ np.array([[2, 1], [-1, 1]])";
    let mixed = "modes[free] = vectors\nmodes[:, 0] += 0.1*modes[:, 3]";
    let missing = "modes[free] = vectors\nvalues[1:] = values[1:] + values[1]/2";
    for (to, expected) in [(turned, Some(0)), (mixed, Some(1)), (missing, Some(1))] {
        let (code, told, said) = verify(at, "modes_skfem.py", ("modes[free] = vectors", to));
        assert_eq!(code, expected, "{to}: {said}");
        let spaces = of_pair(&told, ["freefem", "skfem"])["spaces"].as_array();
        let first = spaces.unwrap()[0]["sine"].as_f64().unwrap();
        assert_eq!(first > 2e-2, to == mixed, "{to}: {said}");
        assert!(first > 1e-7, "other meshes, other modes: {said}");
    }
}
