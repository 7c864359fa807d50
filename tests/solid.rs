//! Bodies: tetrahedra through all three codes, from meshes of every format, and what bad ones get.

use std::path::Path;

use crate::common::{Ran, folder, in_turn, run, scene, source, times, write};
use faceoff_fem::truth::{DEFAULT_RESOLUTION, Reference};

fn agree(folder: &Path, words: &[&str]) -> Ran {
    let ran = run(folder, words);
    assert_eq!(ran.code, Some(0), "{words:?}: {}{}", ran.stdout, ran.stderr);
    ran
}

#[test]
fn three_engines_agree_on_bodies_with_both_methods() {
    let folder = folder();
    let n = match times() > 1 {
        true => ["4,8"; 2],
        // The mesh of the block is no coarser.
        false => ["2,4", "4"],
    };
    for (scene, n) in ["one-zone-3d", "block"].into_iter().zip(n) {
        agree_by_both_methods(folder.path(), scene, n);
    }
}

fn agree_by_both_methods(at: &Path, scene: &str, n: &str) {
    let words = ["verify", scene, "--n", n, "--json", "-"];
    let outcome = agree(at, &words).json();
    assert_eq!(outcome["verdict"], "agree");
    let cases = outcome["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 2 * n.split(',').count(), "methods, meshes");
    for case in cases {
        let tolerance = if case["method"] == "cr" { 1e-12 } else { 1e-11 };
        let engines = case["engines"].as_array().unwrap();
        assert_eq!(engines.len(), 3);
        for engine in engines {
            assert_eq!(engine["finite"], true);
            assert!(engine["residual"].as_f64().unwrap() < 1e-13);
        }
        let pairs = case["pairs"].as_array().unwrap();
        assert_eq!(pairs.len(), 3 * 4, "pairs of engines, fields");
        for pair in pairs {
            assert_eq!(pair["verdict"], "agree");
            assert!(pair["max_rel"].as_f64().unwrap() <= tolerance);
            assert_eq!(pair["worst"]["vertices"].as_array().unwrap().len(), 3);
        }
    }
}

#[test]
fn the_family_and_the_corrected_flux_agree_by_every_rule() {
    let folder = folder();
    std::fs::copy(source("meshes/block.msh"), folder.path().join("block.msh")).unwrap();
    let methods = ["cr", "cr-fc", "cr(1,1)", "p1", "p2(1,0)"];
    for (rule, (load, contact, h)) in (0..).zip([
        ("hammer-4", "edges-3", "global"),
        ("centroid", "centroid", "local"),
        ("walkington-14", "radon-7", "local"),
    ]) {
        let method = format!(
            "[method]\nload_quadrature = \"{load}\"\ncontact_quadrature = \"{contact}\"\nh = \"{h}\"\n\n[data]"
        );
        let scene = scene(folder.path(), "block", "[data]", &method);
        let methods = in_turn(rule, 3, methods).collect::<Vec<_>>().join(",");
        agree(folder.path(), &["verify", &scene, "--methods", &methods]);
    }
}

#[test]
fn exact_scenes_in_space_agree() {
    let folder = folder();
    // A disc, zones, and cells with two contact faces.
    let all = "cr,cr-fc,p2";
    // Its certificates take longer than all the rest.
    let of_zones = if times() > 1 { all } else { "p2" };
    for (scene, methods) in [
        ("hertz-sphere", all),
        ("checkerboard", of_zones),
        ("two-sides-free-3d", all),
    ] {
        let words = ["verify", scene, "--methods", methods, "--n", "4"];
        agree(folder.path(), &words);
    }
}

#[test]
fn plane_and_solid_scenes_run_together() {
    let folder = folder();
    let words = [
        "verify",
        "one-zone",
        "one-zone-3d",
        "--methods",
        "cr",
        "--n",
        "4",
        "--keep",
        "jobs",
        "--json",
        "-",
    ];
    let outcome = agree(folder.path(), &words).json();
    assert_eq!(outcome["cases"].as_array().unwrap().len(), 2);
    for job in ["freefem", "freefem-2", "fenicsx", "fenicsx-2"] {
        let status = folder.path().join("jobs").join(job).join("out/status.json");
        assert!(status.is_file(), "{job}");
    }
}

#[test]
fn the_contact_set_has_an_area_zones_and_faces() {
    let folder = folder();
    let solve = |scene: &str| -> serde_json::Value {
        let words = [
            "solve", scene, "--method", "cr-fc", "--n", "16", "--out", "u.vtu", "--json", "-",
        ];
        agree(folder.path(), &words).json()["contact_set"].clone()
    };
    // f presses about the corners and the middle of the side.
    let zones = scene(
        folder.path(),
        "one-zone-3d",
        "-2*pi*sin(2*pi*x)",
        "40*cos(2*pi*x)*cos(2*pi*y)",
    );
    for (scene, zones) in [("one-zone-3d", 1), ("hertz-sphere", 1), (&zones, 5)] {
        let set = solve(scene);
        assert_eq!(set["zones"], zones, "{scene}");
        let faces = set["faces"].as_array().unwrap();
        for face in faces {
            assert_eq!(face["vertices"].as_array().unwrap().len(), 3);
            let share = face["share"].as_f64().unwrap();
            assert!(share > 0.0 && share <= 1.0, "{face}");
            assert!(face["zone"].as_u64().unwrap() < zones, "{face}");
        }
        let told = std::fs::read_to_string(folder.path().join("u-faces.vtu")).unwrap();
        assert!(told.contains("\"contact rust\"") && told.contains("\"zone rust\""));
    }
}

/// Nothing depends on y: the mesh-free solution in x and z is the truth.
#[test]
fn the_extruded_scene_converges_to_the_plane_truth() {
    let truth = Reference::one_zone(DEFAULT_RESOLUTION).unwrap();
    let [from, to] = truth.contact_set[0];
    let folder = folder();
    let errors = |method: &str, n: &str| -> [f64; 4] {
        let words = [
            "solve",
            "one-zone-3d",
            "--method",
            method,
            "--n",
            n,
            "--json",
            "-",
        ];
        let answer = agree(folder.path(), &words).json();
        let of = |key: &str, truth: f64| (answer[key].as_f64().unwrap() - truth).abs();
        [
            of("grad_norm_sq", truth.grad_norm_sq),
            of("l2_norm", truth.l2_norm),
            of("contact_flux", truth.contact_flux),
            (answer["contact_set"]["area"].as_f64().unwrap() - (to - from)).abs(),
        ]
    };
    for method in ["cr", "cr-fc"] {
        let (coarse, fine) = (errors(method, "8"), errors(method, "16"));
        assert!(
            (coarse[0] / fine[0]).log2() > 1.8,
            "{method}: {coarse:?} {fine:?}"
        );
        assert!(
            (coarse[1] / fine[1]).log2() > 1.0,
            "{method}: {coarse:?} {fine:?}"
        );
        assert!(fine[2] < 1e-3, "{method}: {fine:?}");
        // A transition is found to a face's width.
        assert!(fine[3] < 1.0 / 16.0, "{method}: {fine:?}");
    }
    let p2 = errors("p2", "8");
    assert!(p2[0] < 1e-3 && p2[1] < 1e-3 && p2[2] < 1e-3, "{p2:?}");
}

#[test]
fn a_mesh_of_any_format_gives_the_same_answer() {
    let folder = folder();
    agree(
        folder.path(),
        &["mesh", "make", "one-zone-3d", "a.msh", "--n", "3"],
    );
    for file in ["b.vtu", "c.mesh", "d.msh"] {
        agree(
            folder.path(),
            &["mesh", "convert", "a.msh", file, "--lossy"],
        );
    }
    let solve = |file: &str, parts: &[&str]| {
        let words = ["solve", "one-zone-3d", "--n", "3", "--json", "-"];
        let words = if file.is_empty() {
            words.to_vec()
        } else {
            vec!["solve", file, "--json", "-"]
        };
        let answer = agree(folder.path(), &words).json();
        for part in parts {
            assert!(answer[part].is_number(), "{part}");
        }
        ["grad_norm_sq", "l2_norm", "contact_flux"].map(|key| answer[key].as_f64().unwrap())
    };
    let expected = solve("", &["residual"]);
    for (file, groups) in [
        ("a.msh", ["top", "bottom"]),
        ("b.vtu", ["top", "bottom"]),
        ("d.msh", ["top", "bottom"]),
    ] {
        let text = std::fs::read_to_string(source("crates/fem/src/scene/builtin/one-zone-3d.toml"))
            .unwrap();
        let text = text.replace(
            "generator = \"union-cube\"\nn = 8",
            &format!("file = \"{file}\""),
        );
        assert!(text.contains(groups[0]) && text.contains(groups[1]));
        write(folder.path(), "scene.toml", &text);
        assert_eq!(solve("scene.toml", &[]), expected, "{file}");
    }
    // Medit has numbers for groups: bottom 1, right 2, top 3, left 4, front 5, back 6.
    let numbered = "name = \"numbered\"\n[mesh]\nfile = \"c.mesh\"\n[boundary]\ndirichlet = [3]\n\
                    neumann = [2, 4, 5, 6]\ncontact = [1]\n[data]\nf = \"-2*pi*sin(2*pi*x)\"\n";
    write(folder.path(), "scene.toml", numbered);
    assert_eq!(solve("scene.toml", &[]), expected, "c.mesh");
}

/// A Medit file of these points and tetrahedra, every face of the first on Γ_D or Γ_C.
fn medit(points: &[[f64; 3]], cells: &[[usize; 4]], triangles: &[[usize; 4]]) -> String {
    let mut text = format!(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n",
        points.len()
    );
    for [x, y, z] in points {
        text += &format!("{x} {y} {z} 0\n");
    }
    text += &format!("Tetrahedra\n{}\n", cells.len());
    for [a, b, c, d] in cells {
        text += &format!("{a} {b} {c} {d} 0\n");
    }
    text += &format!("Triangles\n{}\n", triangles.len());
    for [a, b, c, label] in triangles {
        text += &format!("{a} {b} {c} {label}\n");
    }
    text + "End\n"
}

#[test]
fn bad_bodies_are_refused_in_words() {
    let folder = folder();
    let corner = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let with = |more: &[[f64; 3]]| [&corner[..], more].concat();
    let flat = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
    ];
    let mut sliver = flat;
    sliver[3][2] = 1e-9;
    let outside = [[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]];
    let scene =
        "name = \"bad\"\n[mesh]\nfile = \"bad.mesh\"\n[boundary]\ncontact = [1]\ndirichlet = [2]\n";
    for (mesh, parts) in [
        (
            medit(&flat, &[[1, 2, 3, 4]], &[[1, 2, 3, 1]]),
            ["degenerate", "dihedral"],
        ),
        (
            medit(&sliver, &[[1, 2, 3, 4]], &[[1, 2, 3, 1]]),
            ["sliver", "dihedral"],
        ),
        (
            medit(
                &with(&outside),
                &[[1, 2, 3, 4], [5, 2, 3, 4], [6, 2, 3, 4]],
                &[[1, 2, 3, 1]],
            ),
            ["face", "belongs to 3 cells"],
        ),
        (
            medit(
                &with(&[]),
                &[],
                &[[1, 2, 3, 1], [1, 2, 4, 2], [1, 3, 4, 2], [2, 3, 4, 2]],
            ),
            ["triangles do not lie in one plane", "a mesh of tetrahedra"],
        ),
        (
            medit(
                &with(&[[0.25, 0.25, 0.0]]),
                &[[1, 2, 3, 4]],
                &[[1, 2, 3, 1]],
            ),
            ["belongs to no cell", "orphan"],
        ),
        (
            medit(&with(&[]), &[[1, 2, 3, 4]], &[[1, 2, 3, 1], [1, 2, 4, 2]]),
            ["is in no part", "boundary"],
        ),
    ] {
        write(folder.path(), "bad.mesh", &mesh);
        write(folder.path(), "bad.toml", scene);
        for command in ["verify", "solve"] {
            let ran = run(folder.path(), &[command, "bad.toml"]);
            assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
            assert_eq!(ran.stderr.trim_end().lines().count(), 1, "{}", ran.stderr);
            for part in parts {
                assert!(ran.stderr.contains(part), "`{part}` in: {}", ran.stderr);
            }
        }
    }
}

#[test]
fn scenes_and_meshes_of_different_dimension_are_refused() {
    let folder = folder();
    agree(
        folder.path(),
        &["mesh", "make", "one-zone", "plane.msh", "--n", "2"],
    );
    agree(
        folder.path(),
        &["mesh", "make", "one-zone-3d", "solid.msh", "--n", "2"],
    );
    let surface = medit(
        &[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ],
        &[],
        &[[1, 2, 3, 1], [1, 2, 4, 2], [1, 3, 4, 2], [2, 3, 4, 2]],
    );
    write(folder.path(), "surface.mesh", &surface);
    for (scene, mesh, part) in [
        ("one-zone", "solid.msh", "the scene is 2D"),
        ("plate", "solid.msh", "the scene is 2D"),
        ("one-zone-3d", "plane.msh", "has no tetrahedra"),
        ("block", "surface.mesh", "has no tetrahedra"),
    ] {
        let ran = run(folder.path(), &["solve", scene, "--mesh", mesh]);
        assert_eq!(
            ran.code,
            Some(2),
            "{scene} {mesh}: {}{}",
            ran.stdout,
            ran.stderr
        );
        assert_eq!(ran.stderr.trim_end().lines().count(), 1, "{}", ran.stderr);
        assert!(ran.stderr.contains(part), "{}", ran.stderr);
    }
    // Rules of the other dimension.
    for (name, rule) in [("one-zone-3d", "radon-7"), ("one-zone", "walkington-14")] {
        let method = format!("[method]\nload_quadrature = \"{rule}\"\n\n[data]");
        let scene = scene(folder.path(), name, "[data]", &method);
        let ran = run(folder.path(), &["solve", &scene, "--n", "2"]);
        assert_eq!(ran.code, Some(2), "{}", ran.stderr);
        assert!(
            ran.stderr.contains("method.load_quadrature"),
            "{}",
            ran.stderr
        );
    }
    let ran = run(folder.path(), &["solve", "one-zone-3d", "--n", "100000"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(
        ran.stderr.contains("beyond the largest mesh"),
        "{}",
        ran.stderr
    );
}
