//! Quadrangles and hexahedra, in all codes that have them: cells that are no parallelograms, and whose corners begin anywhere.

use std::path::Path;

use faceoff_form::{Problem, own};
use faceoff_mesh::mesh::generate::{Cuboid, lattice_mesh};
use faceoff_mesh::mesh::{CellBlock, CellKind, Group, Mesh};

use super::{Codes, agree_on, form, lacking};

/// The codes without quadrangles and hexahedra of any place.
const WITHOUT: [&str; 2] = ["freefem", "nutils"];

/// A square or cube of n^d cells, bent so that no face need be plane. Every cell begins at another corner, and the outer ones are another group.
pub fn lattice(dim: usize, n: usize) -> Mesh {
    let cuboid = match dim {
        2 => Cuboid::new([0.0; 2], [1.0; 2]),
        _ => Cuboid::new([0.0; 3], [1.0; 3]),
    };
    let mut mesh = lattice_mesh(n, &cuboid).expect("a small mesh");
    for point in mesh.points.to_mut() {
        let [x, y, z] = *point;
        let across = |t: f64| 4.0 * t * (1.0 - t);
        let bump = across(x) * across(y) * if dim == 3 { across(z) } else { 1.0 };
        // The outer ones too.
        point[0] += 0.06 * y * (y + z);
        point[0] += 0.08 * bump * (7.0 * y + 3.0 * z).sin();
        point[1] += 0.08 * bump * (5.0 * x + 1.0).cos();
        if dim == 3 {
            point[2] -= 0.06 * bump * (4.0 * y + x).cos();
        }
    }
    let first = mesh.blocks[0].len() as u32;
    let cells = mesh.blocks[1].len() as u32;
    let width = 1 << dim;
    let mut corners = mesh.blocks[1].nodes.to_vec();
    for (k, nodes) in corners.chunks_exact_mut(width).enumerate() {
        // Rotations about z, and in 3D turns of the cube about its diagonal.
        nodes[..4].rotate_left(k % 4);
        if dim == 3 {
            nodes[4..].rotate_left(k % 4);
            if k % 3 == 1 {
                let [a, b, c, d, e, f, g, h] =
                    <[u32; 8]>::try_from(&*nodes).expect("eight corners");
                nodes.copy_from_slice(&[a, d, h, e, b, c, g, f]);
            }
        }
    }
    mesh.blocks[1].nodes = corners.into();
    let mut groups = ["inner", "outer"].map(|name| {
        let mut group = Group::new(dim as u8, if name == "inner" { 21 } else { 22 });
        group.name = Some(name.into());
        group
    });
    for cell in 0..cells {
        groups[usize::from(cell % 3 == 0)].cells.push(first + cell);
    }
    mesh.groups.extend(groups);
    assert_eq!(mesh.validate(), Ok(()));
    mesh
}

#[test]
fn poisson_of_degree_one_and_two() {
    for degree in [1, 2] {
        let text = form("poisson").replace("\"P2\"", &format!("\"P{degree}\""));
        assert_eq!(lacking(&text, &lattice(2, 5)), WITHOUT);
        let cube = r#"
name = "cube"
[spaces]
u = "P1"
[data]
k = [[2, "x", 0], ["x", 3, "y*z"], [0, "y*z", 2]]
[form]
F = "inner(dot(k, grad(u)), grad(v))*dx + 3*h*u*v*dx(outer) - exp(x)*sin(4*y)*z*v*dx - (1 + x*n[1])*v*ds(top, back) + u*v*ds(right)"
[dirichlet]
left = "y*z + x"
front = "1 + x*z"
"#;
        let text = cube.replace("\"P1\"", &format!("\"P{degree}\""));
        assert_eq!(lacking(&text, &lattice(3, 3)), WITHOUT);
    }
}

#[test]
fn elasticity() {
    assert_eq!(lacking(&form("elasticity"), &lattice(2, 4)), WITHOUT);
    let text = r#"
name = "block"
[spaces]
u = "P2^3"
[form]
F = "inner(2*sym(grad(u)) + (1 + x)*div(u)*Identity(3), sym(grad(v)))*dx - dot([sin(3*y), exp(z)*x, x*y], v)*dx - 0.3*dot(n, v)*ds(top)"
[dirichlet]
left = ["y*z", "0", "free"]
bottom = ["free", "x", "0.1*x*y"]
"#;
    assert_eq!(lacking(text, &lattice(3, 2)), WITHOUT);
}

#[test]
fn what_is_not_linear() {
    assert_eq!(lacking(&form("neo-hooke"), &lattice(2, 4)), WITHOUT);
    assert_eq!(lacking(&form("minimal-surface"), &lattice(2, 5)), WITHOUT);
    let text = r#"
name = "cubic"
[spaces]
u = "P2"
[form]
F = "(1 + u^2)*inner(grad(u), grad(v))*dx + exp(u)*v*dx - 5*x*y*v*dx + u^3*v*ds(top)"
[dirichlet]
left = "y*z"
"#;
    assert_eq!(lacking(text, &lattice(3, 2)), WITHOUT);
}

/// Both sides of a facet have the same points, whichever corners their cells begin at.
#[test]
fn integrals_over_facets_between_cells() {
    assert_eq!(lacking(&form("interior-penalty"), &lattice(2, 4)), WITHOUT);
    for (dim, n) in [(2, 4), (3, 2)] {
        let text = r#"
name = "jumps"
[spaces]
u = "DG2"
w = "P0"
[form]
F = """
inner(grad(u), grad(v))*dx + u*v*dx + 20/avg(h)*jump(u)*jump(v)*dS - dot(avg(grad(u)), jump(v, n))*dS - dot(avg(grad(v)), jump(u, n))*dS
+ x*y*avg(u)*avg(v)*dS - exp(x)*y*v*dx - v*ds(right) + w*test.w*dx + 0.2*jump(w)*jump(test.w)*dS - u*test.w*dx + x*w*v*dx
"""
"#;
        assert_eq!(lacking(text, &lattice(dim, n)), WITHOUT);
    }
}

/// Several unknowns, a mean, interpolated data and steps in time.
#[test]
fn flows_in_time() {
    assert_eq!(lacking(&form("stokes"), &lattice(2, 3)), WITHOUT);
    let text = r#"
name = "closed"
[spaces]
u = "P2^d"
p = "P1"
[data]
k = { expr = "exp(x*y) + t", space = "P1" }
[time]
step = 0.25
end = 0.5
[initial]
u = ["y*(1 - y)*x*(1 - x)", "x*y*(1 - x)*(1 - y)"]
[form]
F = """
dot(u - old(u), v)/dt*dx + k*inner(grad(u), grad(v))*dx + dot(dot(grad(u), u), v)*dx - p*div(v)*dx - q*div(u)*dx - sin(3*y + t)*v[0]*dx
"""
[mean]
p = 0.5
[dirichlet]
u = { left = [0, 0], right = [0, 0], bottom = [0, 0], top = ["x*(1 - x)*t", 0] }
"#;
    assert_eq!(lacking(text, &lattice(2, 3)), WITHOUT);
    let text = r#"
name = "heat"
[spaces]
u = "P2"
[data]
k = { expr = "exp(x*y) + z", space = "P2" }
[time]
step = 0.25
end = 0.5
[initial]
u = "x*y*z"
[form]
F = "(u - old(u))/dt*v*dx + k*inner(grad(u), grad(v))*dx - t*v*dx"
[dirichlet]
left = "t*y"
"#;
    assert_eq!(lacking(text, &lattice(3, 2)), WITHOUT);
}

/// The reasons are told in words, with the place where there is one.
#[test]
fn what_is_not_there_is_told() {
    let text = "name = \"n\"\n[spaces]\nu = \"P1\"\n[form]\nF = \"u*v*dx - x*v*dx\"\n";
    let mesh = lattice(2, 2);
    let told = agree_on(text, &mesh, Codes::InTurn);
    assert_eq!(
        told,
        [
            (
                "freefem",
                "FreeFEM has no quadrangles, only triangles".into()
            ),
            (
                "nutils",
                "nutils has quadrangles in structured meshes only".into()
            ),
        ]
    );
    let refused = |text: &str, mesh: &Mesh| {
        let parsed = Problem::parse(Path::new("n.toml"), text, mesh);
        parsed.expect_err("it should be refused").to_string()
    };
    for space in ["CR", "RT0", "N1curl", "P3"] {
        let error = refused(&text.replace("P1", space), &mesh);
        let what =
            format!("n.toml:3:5: the mesh is of quadrangles, and {space} is a space on triangles");
        assert!(error.starts_with(&what), "{error}");
    }
    let error = refused(
        &text.replace("u*v*dx", "inner(grad(grad(u)), grad(grad(v)))*dx"),
        &mesh,
    );
    assert!(
        error.starts_with("n.toml:5:12: a second derivative on quadrangles"),
        "{error}"
    );
    let error = refused(&text.replace("u*v*dx", "circumradius*u*v*dx"), &mesh);
    assert!(
        error.starts_with("n.toml:5:6: quadrangles have no circumradius"),
        "{error}"
    );
    let cubic = text.replace(
        "[form]",
        "[data]\nf = {expr = \"x\", space = \"P3\"}\n[form]",
    );
    let error = refused(&cubic, &mesh);
    assert!(error.contains("interpolated in P1 or P2"), "{error}");
    let error = refused(&text.replace("F =", "degree = 10\nF ="), &mesh);
    assert!(error.contains("from 1 to 9"), "{error}");

    let mut mixed = mesh.clone();
    let corners = mixed.blocks[1].nodes[..3].to_vec();
    mixed
        .blocks
        .push(CellBlock::new(CellKind::Triangle, corners));
    let error = refused(text, &mixed);
    assert!(error.contains("4 quadrangles and 1 triangles"), "{error}");
    let mut folded = mesh.clone();
    folded.points.to_mut()[4] = [1.2, 1.2, 0.0];
    let error = refused(text, &folded);
    assert!(error.contains("is flat, folded or not convex"), "{error}");
    let mut twice = mesh.clone();
    let corners = twice.blocks[1].nodes[..4].to_vec();
    twice
        .blocks
        .push(CellBlock::new(CellKind::Quadrangle, corners));
    let error = refused(text, &twice);
    assert!(error.contains("belongs to 3 cells"), "{error}");
    // The right half is one cell, in the middle of whose left side a vertex hangs.
    let mut hanging = lattice_mesh(2, &Cuboid::new([0.0; 2], [1.0; 2])).unwrap();
    hanging.groups.clear();
    hanging.points.to_mut()[5] = [1.0, 1.0, 0.0];
    hanging.points.to_mut().truncate(8);
    let cells = vec![0, 1, 4, 3, 3, 4, 7, 6, 1, 2, 5, 7];
    hanging.blocks = vec![CellBlock::new(CellKind::Quadrangle, cells)];
    let error = refused(text, &hanging);
    assert!(
        error.contains("vertex 4 at [0.5, 0.5, 0.0] lies inside"),
        "{error}"
    );
    hanging.points.to_mut().push([2.0, 2.0, 0.0]);
    let error = refused(text, &hanging);
    assert!(
        error.contains("vertex 8 at [2.0, 2.0, 0.0] belongs to no cell"),
        "{error}"
    );
}

/// The solution is a function of the space on any mesh: nothing of a code is needed to know it.
#[test]
fn linear_functions_are_solved_exactly() {
    for (dim, exact) in [(2, "1 + 2*x - 3*y"), (3, "1 + 2*x - 3*y + z")] {
        for degree in [1, 2] {
            let mesh = lattice(dim, 3);
            let text = format!(
                "name = \"n\"\n[spaces]\nu = \"P{degree}\"\n[data]\ng = \"{exact}\"\n[form]\nF = \"inner(grad(u), grad(v))*dx + u*v*ds(left) - g*v*ds(left) - dot(grad(g), n)*v*ds\"\n[dirichlet]\nright = \"g\"\n"
            );
            let problem = Problem::parse(Path::new("n.toml"), &text, &mesh).unwrap();
            let solution = own::solve(&problem, &mesh).unwrap();
            let (nodes, fields) = own::output(&solution.assembler, &solution.u);
            for (at, u) in nodes.points.iter().zip(fields[0].values.to_f64()) {
                let wanted = 1.0 + 2.0 * at[0] - 3.0 * at[1] + at[2];
                assert!((u - wanted).abs() < 1e-12, "{dim} {degree}: {u} {wanted}");
            }
        }
    }
}
