//! Lengths of cells and facets other than the diameter: no two are alike on these meshes.

use super::cubes::lattice;
use super::{NONE, cube, lacking, square};

/// Interior penalty; on the boundary by Nitsche's method.
fn penalty(length: &str) -> String {
    format!(
        r#"
name = "penalty"
[spaces]
u = "DG1"
[form]
F = """
inner(grad(u), grad(v))*dx - exp(x)*v*dx
- inner(avg(grad(u)), jump(v, n))*dS - inner(jump(u, n), avg(grad(v)))*dS + 10/{length}*jump(u)*jump(v)*dS
- dot(grad(u), n)*v*ds - dot(grad(v), n)*(u - x*y)*ds + 10/facet_length*(u - x*y)*v*ds
"""
degree = 2
facet_degree = 2
"#
    )
}

#[test]
fn circumradii() {
    let text = r#"
name = "radii"
[spaces]
u = "P1"
[form]
F = "inner(grad(u), grad(v))*dx + 9*circumradius*u*v*dx - exp(x)*circumradius^2*v*dx - x*v*circumradius*ds(left) + h*u*v*ds"
degree = 2
facet_degree = 2
"#;
    assert_eq!(lacking(text, &square()), NONE);
    assert_eq!(lacking(text, &cube()), NONE);
    let sides = penalty("avg(circumradius)").replace("facet_length", "circumradius");
    assert_eq!(lacking(&sides, &square()), NONE);
    assert_eq!(lacking(&sides, &cube()), ["freefem"]);
    let sides = sides.replace(
        "avg(circumradius)",
        "max(circumradius('+'), circumradius('-'))",
    );
    assert_eq!(lacking(&sides, &square()), NONE);
}

#[test]
fn lengths_of_facets() {
    assert_eq!(lacking(&penalty("facet_length"), &square()), NONE);
    assert_eq!(lacking(&penalty("avg(facet_length)"), &cube()), ["freefem"]);
    // Without integrals between cells; names are those that scripts give to lengths.
    let text = r#"
name = "nitsche"
[spaces]
u = "P1"
[parameters]
edge = 10.0
slope = 0.5
[data]
radii = "y"
edges = { expr = "exp(x)", space = "P1" }
length = ["x", "y", "x*y"]
[form]
F = """
inner(grad(u), grad(v))*dx - edges*v*dx - dot(grad(u), n)*v*ds - dot(grad(v), n)*(u - radii)*ds + edge/facet_length*(u - radii)*v*ds
- slope*dot(length, grad(v))*circumradius*dx
"""
degree = 2
facet_degree = 2
"#;
    assert_eq!(lacking(text, &cube()), NONE);
}

#[test]
fn lengths_of_facets_of_quadrangles_and_hexahedra() {
    let text = penalty("facet_length('-')");
    assert_eq!(lacking(&text, &lattice(2, 4)), ["freefem", "nutils"]);
    assert_eq!(
        lacking(&text, &lattice(3, 2)),
        ["freefem", "dolfinx", "nutils"]
    );
}
