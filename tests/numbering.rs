//! A verdict does not depend on how a mesh numbers its vertices and cells, nor on the order of the
//! vertices of a cell.

use crate::common::{folder, run, scene, source, write};

/// A reproducible permutation of 0..n.
fn permutation(n: usize, mut seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    for k in (1..n).rev() {
        // Knuth's multiplier; the high bits are the random ones.
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        order.swap(k, (seed >> 33) as usize % (k + 1));
    }
    order
}

/// The plate in MSH 2.2, renumbered: vertices, the order of elements, and each one's own vertices.
fn renumbered(seed: u64) -> String {
    let mesh = faceoff_mesh::io::msh::read(
        "plate.msh".as_ref(),
        &std::fs::read(source("meshes/plate.msh")).unwrap(),
    )
    .unwrap()
    .mesh;
    let points = permutation(mesh.points.len(), seed);
    let mut new = vec![0; points.len()];
    for (number, &old) in points.iter().enumerate() {
        new[old] = number + 1;
    }
    let mut elements = Vec::new();
    for (index, kind, nodes) in mesh.cells() {
        let (number, dim) = match nodes.len() {
            2 => (1, 1),
            3 => (2, 2),
            _ => continue,
        };
        let groups = mesh.groups.iter();
        let tag = groups
            .filter(|g| g.dim == dim)
            .find(|g| g.cells.contains(&index))
            .unwrap_or_else(|| panic!("{kind} {index} is in no group"))
            .tag;
        let turn = permutation(nodes.len(), seed + u64::from(index));
        let nodes: Vec<String> = turn
            .iter()
            .map(|&k| new[nodes[k] as usize].to_string())
            .collect();
        elements.push(format!("{number} 2 {tag} {tag} {}", nodes.join(" ")));
    }
    let order = permutation(elements.len(), seed + 1);
    let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n");
    for group in &mesh.groups {
        let name = group.name.as_deref().unwrap();
        text += &format!("{} {} \"{name}\"\n", group.dim, group.tag);
    }
    text += &format!("$EndPhysicalNames\n$Nodes\n{}\n", points.len());
    for (number, &old) in points.iter().enumerate() {
        let p = mesh.points[old];
        text += &format!("{} {:?} {:?} {:?}\n", number + 1, p[0], p[1], p[2]);
    }
    text += &format!("$EndNodes\n$Elements\n{}\n", elements.len());
    for (number, &k) in order.iter().enumerate() {
        text += &format!("{} {}\n", number + 1, elements[k]);
    }
    text + "$EndElements\n"
}

#[test]
fn renumbering_changes_no_verdict() {
    let folder = folder();
    let file = scene(
        folder.path(),
        "plate",
        "name = \"plate\"",
        "name = \"plate\"",
    );
    let mut norms = Vec::new();
    for seed in [1, 20] {
        write(folder.path(), "plate.msh", &renumbered(seed));
        let ran = run(folder.path(), &["verify", &file, "--json", "-"]);
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
        let ran = run(folder.path(), &["solve", &file, "--json", "-"]);
        norms.push(ran.json()["grad_norm_sq"].as_f64().unwrap());
    }
    let ran = run(folder.path(), &["solve", "plate", "--json", "-"]);
    norms.push(ran.json()["grad_norm_sq"].as_f64().unwrap());
    for norm in &norms {
        assert!((norm - norms[0]).abs() < 1e-13 * norms[0], "{norms:?}");
    }
}
