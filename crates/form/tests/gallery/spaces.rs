//! Spaces of vectors, means, steps in time and second derivatives, in all codes that have them.

use std::path::Path;

use faceoff_form::Problem;
use faceoff_form::codes::CODES;
use faceoff_mesh::mesh::Mesh;
use faceoff_mesh::mesh::generate::{union_cube, union_jack};

use super::{NONE, TOLERANCE, cube, form, lacking, ours, run, square};

/// Normal or tangential components that vary along facets, jumps and all derivatives.
#[test]
fn vectors_of_raviart_thomas_and_nedelec() {
    let fluxes = r#"
name = "fluxes"
[spaces]
q = "RT0"
p = "P0"
[data]
b = ["y", "x*y"]
[form]
F = """
(1 + x)*dot(q, test.q)*dx + 0.3*dot(dot(grad(q), b), test.q)*dx - p*div(test.q)*dx + div(q)*test.p*dx + 0.1*p^3*test.p*dx
- exp(x*y)*test.p*dx + x*dot(test.q, n)*ds(right) + 0.2*dot(q, n)*dot(test.q, n)*ds(top) + 0.1*inner(grad(q), grad(test.q))*dx
+ 0.1*dot(jump(q), jump(test.q))*dS + 0.1*avg(p)*jump(test.q, n)*dS + 0.1*avg(div(q))*avg(div(test.q))*dS
+ 0.1*sqrt(1 + dot(q, q))*q[0]*test.q[1]*dx
"""
[dirichlet]
q = { left = ["x + y", "y"], bottom = ["sin(x)", "1 + x*x"] }
"#;
    assert_eq!(lacking(fluxes, &square()), ["nutils", "mfem"]);
    let fields = fluxes
        .replace("RT0", "N1curl")
        .replace("jump(test.q, n)", "avg(curl(test.q))")
        .replace("div(", "curl(");
    assert_eq!(lacking(&fields, &square()), ["nutils", "mfem"]);
}

#[test]
fn vectors_in_tetrahedra() {
    let text = r#"
name = "fluxes"
[spaces]
q = "RT0"
p = "P0"
[form]
F = """
(1 + y)*dot(q, test.q)*dx - p*div(test.q)*dx + x*y*dot(test.q, n)*ds(left, top) + (exp(x)*z - div(q))*test.p*dx
+ 0.1*inner(grad(q), grad(test.q))*dx
"""
degree = 2
facet_degree = 2
[dirichlet]
q = { right = ["x", "y*z", "sin(y)"], bottom = ["y", "1", "z"] }
"#;
    assert_eq!(lacking(text, &cube()), ["nutils", "mfem"]);
    // The tangential components of two faces meet at an edge.
    let text = r#"
name = "fields"
[spaces]
u = "N1curl"
[form]
F = """
inner(curl(u), curl(v))*dx + (1 + x)*dot(u, v)*dx - dot([sin(3*y), exp(z)*x, x*y], v)*dx + 0.1*inner(grad(u), grad(v))*dx
+ 0.1*curl(u)[0]*v[1]*dx + dot(cross(n, u), cross(n, v))*ds(top)
"""
degree = 2
facet_degree = 2
[dirichlet]
left = ["x", "y*z", "sin(y)"]
bottom = ["y", "1", "z"]
"#;
    assert_eq!(lacking(text, &cube()), ["nutils", "mfem"]);
    let text = form("curl-curl-3d");
    assert_eq!(lacking(&text, &cube()), ["nutils", "mfem"]);
}

/// Two means; the given velocity lets more in than out, so that its divergence cannot be 0.
#[test]
fn means_where_constants_are_free() {
    let text = r#"
name = "means"
[spaces]
u = "P2^2"
p = "P1"
w = "DG1"
[form]
F = """
inner(grad(u), grad(v))*dx - p*div(v)*dx - q*div(u)*dx + 0.5*dot(dot(grad(u), u), v)*dx - x*v[0]*dx
+ inner(grad(w), grad(test.w))*dx - inner(avg(grad(w)), jump(test.w, n))*dS - inner(jump(w, n), avg(grad(test.w)))*dS
+ 9/avg(h)*jump(w)*jump(test.w)*dS - exp(x)*test.w*dx - y*test.w*ds(top)
"""
[dirichlet]
u = { left = ["y", 0], right = [0, 0], bottom = [0, 0], top = ["sin(x)", 0] }
[mean]
p = 0.25
w = -1.5
"#;
    assert_eq!(lacking(text, &square()), NONE);
    // Step by step, too.
    let text = r#"
name = "stirred"
[spaces]
u = "P2^2"
p = "P1"
[time]
step = 0.2
end = 0.4
[initial]
u = ["y*(1 - y)", "0"]
[form]
F = "dot(u - old(u), v)/dt*dx + inner(grad(u), grad(v))*dx - p*div(v)*dx - q*div(u)*dx + dot(dot(grad(u), old(u)), v)*dx"
[dirichlet]
u = { left = [0, 0], right = [0, 0], bottom = [0, 0], top = ["t*x", 0] }
[mean]
p = -1
"#;
    assert_eq!(lacking(text, &square()), NONE);
    // A reservoir without wells or outlets.
    let text = r#"
name = "closed"
[spaces]
q = "RT0"
p = "P0"
[form]
F = "dot(q, test.q)*dx - p*div(test.q)*dx + (x - y - div(q))*test.p*dx"
[dirichlet]
q = { left = ["y", 0], right = [0, 0], bottom = [0, 0], top = [0, 1] }
[mean]
p = 3
"#;
    assert_eq!(lacking(text, &square()), ["nutils", "mfem"]);
    let text = "name = \"flux\"\n[spaces]\nu = \"CR\"\n[form]\nF = \"inner(grad(u), grad(v))*dx - x*v*dx + v*ds(left)\"\n[mean]\nu = 2\n";
    assert_eq!(lacking(text, &square()), ["nutils"]);
}

/// Data, boundary values and a nonlinear form that change from step to step.
#[test]
fn steps_in_time() {
    let text = r#"
name = "steps"
[spaces]
u = "P1"
w = "P2^2"
p = "P0"
[data]
f = { expr = "t*sin(3*x)", space = "P1" }
[time]
step = 0.1
end = 0.3
[initial]
u = "exp(x)*y"
w = ["x*x", "sin(y)"]
p = "x"
[form]
F = """
(u - old(u))/dt*v*dx + inner(grad(u), grad(v))*dx + 0.2*avg(old(u))*avg(v)*dS + 0.1*jump(old(u))*jump(v)*dS - u*dot(grad(f), grad(v))*dx
+ dot(w - old(w), test.w)/dt*dx + inner(grad(w), grad(test.w))*dx - t*dot([1, u^2], test.w)*dx + dot(dot(grad(old(w)), old(w)), test.w)*dx
+ 0.1*dot(avg(grad(old(u))), n('+'))*jump(v)*dS + (p - old(p))*q*dx - f*u*q*dx + sqrt(1 + jump(p)^2)*jump(p)*jump(q)*dS
+ 0.1*avg(h)*dot(jump(grad(f)), jump(grad(w)[0]))*avg(v)*dS
"""
[dirichlet]
u = { left = "t*y" }
w = { left = ["t", "free"], top = [0, "t*x"] }
"#;
    assert_eq!(lacking(text, &square()), NONE);
    let text = text.replace("\"P1\"\nw", "\"CR\"\nw");
    assert_eq!(lacking(&text, &square()), ["nutils"]);
    // FreeFEM's nodes of DG1 are not the vertices.
    let text = "name = \"decay\"\n[spaces]\nu = \"DG1\"\nq = \"RT0\"\n[time]\nstep = 0.5\nend = 1\n[initial]\nu = \"exp(x)\"\n[form]\nF = \"(u - old(u))*v*dx + u*v*dx \
                + dot(q - old(q), test.q)*dx - u*div(test.q)*dx\"\n[dirichlet]\nq = { left = [\"t\", 0] }\n";
    assert_eq!(lacking(text, &square()), ["freefem", "nutils", "mfem"]);
}

/// In cells and on facets, of quadratic and cubic functions and of vectors.
#[test]
fn second_derivatives() {
    let text = r#"
name = "curvature"
[spaces]
u = "P2"
w = "P2^2"
[data]
g = "x^3*y"
[form]
F = """
(1 + x)*inner(grad(grad(u)), grad(grad(v)))*dx - x*y*v*dx - dot(dot(avg(grad(grad(u))), n('+')), n('+'))*jump(grad(v), n)*dS
+ 20/avg(h)*jump(grad(u), n)*jump(grad(v), n)*dS + u*v*dx + 0.1*div(grad(g))*v*dx + 20/h*dot(grad(u), n)*dot(grad(v), n)*ds
+ dot(w, test.w)*dx + inner(grad(w), grad(test.w))*dx + 0.01*inner(grad(grad(w)), grad(grad(test.w)))*dx - dot([1, x], test.w)*dx
+ 0.001*dot(div(grad(w)), div(grad(test.w)))*ds + 0.01*dot(avg(div(grad(w))), avg(div(grad(test.w))))*dS
+ 0.1*sqrt(1 + grad(grad(u))[0, 1]^2)*v*dx
"""
"#;
    assert_eq!(lacking(text, &square()), ["mfem"]);
    let text = text.replace("\"P2\"", "\"P3\"");
    assert_eq!(lacking(&text, &square()), ["freefem", "mfem"]);
    let text = "name = \"solid\"\n[spaces]\nu = \"P2\"\n[form]\nF = \"inner(grad(grad(u)), grad(grad(v)))*dx + u*v*dx - x*z*v*dx\"\ndegree = 2\nfacet_degree = 2\n";
    assert_eq!(lacking(text, &cube()), ["mfem"]);
}

/// Gradients of data that are interpolated have two values on a facet.
#[test]
fn gradients_of_data_on_facets() {
    let text = r#"
name = "kinks"
[spaces]
u = "P1"
[data]
f = { expr = "sin(5*x)*y^2", space = "P1" }
[form]
F = "u*v*dx - jump(grad(f), n)*avg(v)*dS + dot(jump(grad(f)), jump(grad(u)))*avg(v)*dS"
"#;
    assert_eq!(lacking(text, &square()), NONE);
}

/// All codes find a solution that their spaces have, exactly; at least so many do.
fn assert_reproduced(text: &str, mesh: &Mesh, least: usize, exact: impl Fn([f64; 3]) -> Vec<f64>) {
    let problem =
        Problem::parse(Path::new("form.toml"), text, mesh).unwrap_or_else(|e| panic!("{e}"));
    let mut count = 0;
    let others = CODES.iter().filter_map(|code| {
        let script = code.script(&problem).ok()?;
        Some((code.name, run(code, &problem, mesh, &script)))
    });
    for (name, found) in std::iter::once(("rust", ours(&problem, mesh))).chain(others) {
        let found = found.expect("a solution");
        let of_it = found.values().next().expect("an unknown");
        for (place, values) in of_it {
            // Nodes are at multiples of 1/4 and 1/6.
            let at = [3, 4, 5].map(|k| (place[k] as f64 * 12e-7).round() / 12.0);
            for (a, b) in values.iter().zip(exact(at)) {
                let what = format!("{name} on {}: {a}, not {b}", problem.name);
                assert!((a - b).abs() < TOLERANCE, "{what} at {at:?}");
            }
        }
        count += 1;
    }
    assert!(count >= least, "{} by {count} codes", problem.name);
}

#[test]
fn solutions_in_the_space_are_found() {
    let square = union_jack(2, [1.0, 1.0]);
    let cube = union_cube(2, [1.0; 3]);
    // Backward differences are exact for what is linear in time.
    let text = r#"
name = "heat"
[spaces]
u = "P2"
[time]
step = 0.25
end = 0.75
[initial]
u = "x^2 + y^2"
[form]
F = "(u - old(u))/dt*v*dx + inner(grad(u), grad(v))*dx - 2*x*v*ds(right)"
[dirichlet]
left = "y^2 + 4*t"
bottom = "x^2 + 4*t"
top = "x^2 + 1 + 4*t"
"#;
    assert_reproduced(text, &square, 7, |[x, y, _]| vec![x * x + y * y + 3.0]);
    let text = r#"
name = "flux"
[spaces]
u = "P1"
[form]
F = "inner(grad(u), grad(v))*dx - v*ds(right) + v*ds(left)"
[mean]
u = 2
"#;
    assert_reproduced(text, &square, 7, |[x, _, _]| vec![x + 1.5]);
    let text = r#"
name = "plate"
[spaces]
u = "P2"
[data]
g = "x^2 + 3*x*y - y^2"
[form]
F = """
inner(grad(grad(u)), grad(grad(v)))*dx - dot(dot(avg(grad(grad(u))), n('+')), n('+'))*jump(grad(v), n)*dS
- dot(dot(avg(grad(grad(v))), n('+')), n('+'))*jump(grad(u), n)*dS + 20/avg(h)*jump(grad(u), n)*jump(grad(v), n)*dS
- dot(dot(grad(grad(u)), n), n)*dot(grad(v), n)*ds - dot(dot(grad(grad(v)), n), n)*dot(grad(u - g), n)*ds
+ 20/h*dot(grad(u - g), n)*dot(grad(v), n)*ds
"""
[dirichlet]
left = "g"
right = "g"
bottom = "g"
top = "g"
"#;
    let plate = |[x, y, _]: [f64; 3]| vec![x * x + 3.0 * x * y - y * y];
    assert_reproduced(text, &square, 7, plate);
    // Cubic functions on tetrahedra, which scripts do not write.
    let text = r#"
name = "cubic"
[spaces]
u = "P3^2"
[form]
F = "inner(grad(u), grad(v))*dx + (6*x - 2*y)*v[0]*dx + 6*z*v[1]*dx"
[dirichlet]
left = ["x^3 - y*z^2", "z^3"]
right = ["x^3 - y*z^2", "z^3"]
bottom = ["x^3 - y*z^2", "z^3"]
top = ["x^3 - y*z^2", "z^3"]
front = ["x^3 - y*z^2", "z^3"]
back = ["x^3 - y*z^2", "z^3"]
"#;
    let cubic = |[x, y, z]: [f64; 3]| vec![x.powi(3) - y * z * z, z.powi(3)];
    assert_reproduced(text, &cube, 1, cubic);
    for (space, mesh, value) in [
        ("RT0", &square, ["1 + 2*x", "3 + 2*y", ""]),
        ("N1curl", &square, ["1 - 2*y", "3 + 2*x", ""]),
        ("RT0", &cube, ["1 + 2*x", "3 + 2*y", "2*z - 1"]),
        ("N1curl", &cube, ["1 + 2*z - 3*y", "3*x - z", "y - 2*x - 1"]),
    ] {
        let value: Vec<&str> = value.into_iter().filter(|text| !text.is_empty()).collect();
        let [list, texts] = [
            value.join(", "),
            value
                .iter()
                .map(|v| format!("\"{v}\""))
                .collect::<Vec<_>>()
                .join(", "),
        ];
        let text = format!(
            "name = \"held\"\n[spaces]\nu = \"{space}\"\n[form]\nF = \"dot(u - [{list}], v)*dx\"\ndegree = 2\nfacet_degree = 2\n\
             [dirichlet]\nleft = [{texts}]\nbottom = [{texts}]\n"
        );
        let exact = |[x, y, z]: [f64; 3]| match (space, value.len()) {
            ("RT0", 2) => vec![1.0 + 2.0 * x, 3.0 + 2.0 * y],
            ("RT0", _) => vec![1.0 + 2.0 * x, 3.0 + 2.0 * y, 2.0 * z - 1.0],
            (_, 2) => vec![1.0 - 2.0 * y, 3.0 + 2.0 * x],
            _ => vec![1.0 + 2.0 * z - 3.0 * y, 3.0 * x - z, y - 2.0 * x - 1.0],
        };
        assert_reproduced(&text, mesh, 6, exact);
    }
}
