//! Results of forms that were changed, put into the form as it was: the change is named, and nothing that was not changed is.

mod random;
mod values;

use std::path::Path;

use faceoff_form::judge::{Cause, Change, Digits, Explanation, Interpolated, Judged, Part, judge};
use faceoff_form::problem::{Element, Space};
use faceoff_form::scalar::{Id, Length, Node, Scalars};
use faceoff_form::{Problem, own};
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::mesh::{CellKind, Group, Mesh, Triangulation};

/// A square whose inner vertices are moved, so that no two cells are alike.
fn square(n: usize) -> Mesh {
    let mut mesh = union_jack(n, [1.0, 1.0]);
    for point in mesh.points.to_mut() {
        let [x, y, _] = *point;
        let bump = 16.0 * x * (1.0 - x) * y * (1.0 - y);
        point[0] += 0.03 * bump * (7.0 * y).sin();
        point[1] += 0.03 * bump * (5.0 * x + 1.0).cos();
    }
    mesh
}

/// The same with groups of one cell, of one facet of the right side, and of the others but the first and the last.
fn divided(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let cells: Vec<u32> = mesh.cells_of(CellKind::Triangle).map(|(k, ..)| k).collect();
    let is_right = |group: &&mut Group| group.name.as_deref() == Some("right");
    let right = mesh.groups.iter_mut().find(is_right).expect("it has sides");
    let mut others = right.cells.split_off(1);
    right.cells.extend(others.pop());
    let facet = others.remove(others.len() / 2);
    let groups = [
        ("cell", 7, 2, vec![cells[cells.len() / 2 + 3]]),
        ("facet", 8, 1, vec![facet]),
        ("facets", 9, 1, others),
    ];
    for (name, tag, dim, cells) in groups {
        mesh.groups.push(Group {
            name: Some(name.into()),
            cells,
            ..Group::new(dim, tag)
        });
    }
    mesh
}

/// Diffusion, convection, reaction, a load and a flux, with an element.
fn diffusion(element: &str) -> String {
    format!(
        r#"name = "diffusion"
[spaces]
u = "{element}"
[parameters]
c = 2.0
[data]
k = "1 + x*y"
b = ["1", "x"]
f = "exp(x)*sin(4*y)"
t = "cos(2*y)"
[form]
F = "k*inner(grad(u), grad(v))*dx + dot(b, grad(u))*v*dx + c*u*v*dx - f*v*dx - t*v*ds(right)"
degree = 4
[dirichlet]
left = 0
bottom = "x"
"#
    )
}

const ELASTICITY: &str = r#"name = "elasticity"
[spaces]
u = "P2^2"
[parameters]
lam = 2.0
mu = 1.0
[data]
f = ["x", "exp(y)"]
[form]
F = "2*mu*inner(sym(grad(u)), sym(grad(v)))*dx + lam*div(u)*div(v)*dx - dot(f, v)*dx - y*v[0]*ds(right)"
[dirichlet]
left = [0, 0]
"#;

const STOKES: &str = r#"name = "stokes"
[spaces]
u = "P2^2"
p = "P1"
[parameters]
nu = 0.5
[data]
f = ["sin(3*y)", "x"]
[form]
F = "nu*inner(grad(u), grad(v))*dx + dot(dot(grad(u), u), v)*dx - p*div(v)*dx - q*div(u)*dx - dot(f, v)*dx"
[dirichlet]
u = { left = ["y*(1 - y)", 0], top = [0, 0], bottom = [0, 0] }
"#;

const SURFACE: &str = r#"name = "surface"
[spaces]
u = "P1"
[parameters]
a = 1.0
[data]
g = "x*y"
[form]
F = "inner(grad(u), grad(v))/sqrt(a + inner(grad(u), grad(u)))*dx + 0.1*g*v*dx"
[dirichlet]
left = "y"
right = "g"
top = "x"
bottom = 0
"#;

const PENALTY: &str = r#"name = "penalty"
[spaces]
u = "DG1"
[parameters]
sigma = 10.0
[data]
f = "3*exp(x)*sin(2*y)"
g = "exp(x)*sin(2*y)"
[form]
F = """inner(grad(u), grad(v))*dx - f*v*dx - dot(avg(grad(u)), n('+'))*jump(v)*dS - dot(avg(grad(v)), n('+'))*jump(u)*dS
  + sigma/avg(h)*jump(u)*jump(v)*dS - dot(grad(u), n)*v*ds - dot(grad(v), n)*(u - g)*ds + sigma/h*(u - g)*v*ds"""
"#;

fn parse(text: &str, mesh: &Mesh) -> Problem {
    Problem::parse(Path::new("form.toml"), text, mesh).unwrap_or_else(|e| panic!("{e}"))
}

/// What the solution of a form leaves of another.
fn put(solved: &str, form: &Problem, mesh: &Mesh, change: impl Fn(&mut Problem)) -> Judged {
    // Coarse meshes have too few facets to be divided.
    let (source, text) = match mesh.points.len() > 40 {
        true => (
            divided(mesh),
            solved.replace("ds(right)", "ds(right, facet, facets)"),
        ),
        false => (mesh.clone(), solved.to_owned()),
    };
    let mut solved = parse(&text, &source);
    change(&mut solved);
    let solution = own::solve(&solved, &source).unwrap_or_else(|e| panic!("{e}"));
    let (cells, fields) = own::output(&solution.assembler, &solution.u);
    let result = Mesh { fields, ..cells };
    judge(form, mesh, &result, 2e-16).unwrap_or_else(|e| panic!("{e}"))
}

/// A change in a few characters; numbers to six digits.
fn said(form: &Problem, judged: &Judged, Cause { change, factor }: &Cause) -> String {
    let term = |k: &usize| judged.terms[*k].text.clone();
    let group = |k: &usize| form.groups[*k].name.clone();
    let number = format!("{:.5e}", factor).parse::<f64>();
    let number = number.expect("it was a number");
    match change {
        Change::Factor { term: k } => format!("{} × {number}", term(k)),
        Change::Parameter { parameter } => {
            format!("{} = {number}", form.parameters[*parameter].name)
        }
        Change::Rule {
            term: Some(k),
            rule,
        } => format!("{} by {rule}", term(k)),
        Change::Rule { term: None, rule } => format!("all by {rule}"),
        Change::Data {
            datum,
            term: of,
            by,
        } => {
            let of = of.map_or(String::new(), |k| format!(" in {}", term(&k)));
            let by = match by {
                Interpolated::Points => "at points".to_owned(),
                Interpolated::Degree(k) => format!("in P{k}"),
            };
            format!("{} {by}{of}", form.data[*datum].name)
        }
        Change::One { datum } => format!("{} = 1", form.data[*datum].name),
        Change::Size { term: k, of, size } => {
            let within = k.map_or(String::new(), |k| format!(" in {}", term(&k)));
            format!("{} {size:?}{within}", of.name())
        }
        Change::Normal { term: k } => {
            let of = k.map_or(String::new(), |k| format!(" in {}", term(&k)));
            format!("-n{of}")
        }
        Change::Coordinates { digits } => format!("{digits:?}"),
        Change::Slope { unknown, axis } => {
            format!("+ {number} ∂{axis}{}", form.unknowns[*unknown].name)
        }
        Change::Given { condition, by } => {
            let held = &form.held()[*condition];
            format!("{by:?} {number} on {}", group(&held.group))
        }
        Change::Penalty { by } => format!("{by:?} {number}"),
        Change::Uncoupled => "uncoupled".into(),
        Change::Obstacle { by } => format!("obstacle {by:?} {number}"),
        Change::Exchanged { count, .. } => format!("{count} exchanged"),
        Change::Values { count, .. } => format!("{count} values"),
        Change::Stopped { step, of } => format!("step {step} of {of}"),
        Change::Transposed { term: k } => format!("{} transposed", term(k)),
        Change::Moved { term: k, group: g } => format!("{} on {}", term(k), group(g)),
        Change::Group { term: k, group: g } => format!("{} × {number} on {}", term(k), group(g)),
        Change::Part { term: k, part } => match part {
            Part::Slope(axis) => format!("{} × {number} by ∂{axis}", term(k)),
            Part::Component(c) => format!("{} × {number} by [{c}]", term(k)),
        },
        Change::Varying { term: k, axis } => format!("{} × (1 + {number} x{axis})", term(k)),
        Change::Mass {
            unknown,
            rule: None,
        } => format!("+ {number} {}", form.unknowns[*unknown].name),
        Change::Mass {
            rule: Some(rule), ..
        } => format!("+ {number} by {rule}"),
        Change::Some {
            count,
            is_all: true,
            ..
        } => format!("all × {number} in {count}"),
        Change::Some { term: k, count, .. } => format!("{} × {number} in {count}", term(k)),
    }
}

fn all(form: &Problem, judged: &Judged, causes: &[Cause]) -> String {
    let mut all: Vec<String> = causes.iter().map(|c| said(form, judged, c)).collect();
    all.sort();
    all.join(" and ")
}

/// All explanations that leave rounding, the told one first.
fn exact(form: &Problem, judged: &Judged) -> Vec<String> {
    let found = judged.explanation.iter().filter(|found| found.is_exact);
    let of = |found: &Explanation| {
        let alike = found.alike.iter().map(|causes| all(form, judged, causes));
        std::iter::once(all(form, judged, &found.causes))
            .chain(alike)
            .collect::<Vec<_>>()
    };
    found.flat_map(of).collect()
}

/// What is told where a text of the form is another one.
fn told(text: &str, edits: &[(&str, &str)], mesh: &Mesh) -> Vec<String> {
    let form = parse(text, mesh);
    let mut changed = text.to_owned();
    for (from, to) in edits {
        assert!(changed.contains(from), "no {from} in {text}");
        changed = changed.replacen(from, to, 1);
    }
    let judged = put(&changed, &form, mesh, |_| ());
    exact(&form, &judged)
}

/// Texts of the form, each with another one, and what is told.
type Case<'a> = (&'a [(&'a str, &'a str)], &'a str);

/// Changes, each with what is told; of a form on a mesh.
fn check(text: &str, mesh: &Mesh, cases: &[Case]) {
    let mut failed = Vec::new();
    for (edits, wanted) in cases {
        let found = told(text, edits, mesh);
        println!("{edits:?}: {}", found.join(", or "));
        // Alone or first, but where two changes are one.
        let is_right = match wanted.strip_prefix("or ") {
            Some(wanted) => found.iter().any(|text| text == wanted),
            None if *wanted == "none" => found.is_empty(),
            None => found.first().is_some_and(|text| text == wanted),
        };
        if !is_right {
            failed.push(format!("{edits:?}: {found:?} in place of {wanted}"));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn changes_of_diffusion_are_named() {
    for element in ["P1", "P2"] {
        let text = diffusion(element);
        check(
            &text,
            &square(8),
            &[
                (
                    &[(" + dot(b, grad(u))*v*dx", "")],
                    "dot(b, grad(u))*v*dx × 0",
                ),
                (&[("+ c*u*v*dx", "- c*u*v*dx")], "or c*u*v*dx × -1"),
                (
                    &[("k*inner", "1.001*k*inner")],
                    "k*inner(grad(u), grad(v))*dx × 1.001",
                ),
                (
                    &[("- f*v*dx", "- f*v*dx + f*v*dx(cell)")],
                    "f*v*dx × 0 in 1",
                ),
                (
                    &[("+ c*u", "+ 1e-3*k*inner(grad(u), grad(v))*dx(cell) + c*u")],
                    "k*inner(grad(u), grad(v))*dx × 1.001 in 1",
                ),
                (&[("k = \"1 + x*y\"", "k = \"1\"")], "k = 1"),
                (&[("- f*v*dx", "- f*v*dx + 1e-4*u*v*dx")], "or + 0.0001 u"),
                (
                    &[("- f*v*dx", "- f*v*dx + 1e-3*grad(u)[1]*v*dx")],
                    "+ 0.001 ∂1u",
                ),
                (
                    &[("- t*v", "+ t*v*ds(facet) - t*v")],
                    "t*v*ds(right) × 0 in 1",
                ),
                (
                    &[("- t*v", "+ 0.3*t*v*ds(facets) - t*v")],
                    "t*v*ds(right) × 0.7 in 5",
                ),
                (
                    &[("dot(b, grad(u))*v*dx", "dot(b, grad(v))*u*dx")],
                    "dot(b, grad(u))*v*dx transposed",
                ),
                (
                    &[(
                        "f = \"exp(x)*sin(4*y)\"",
                        "f = {expr = \"exp(x)*sin(4*y)\", space = \"P1\"}",
                    )],
                    "f in P1",
                ),
                (
                    &[(
                        "k = \"1 + x*y\"",
                        "k = {expr = \"1 + x*y\", space = \"P1\"}",
                    )],
                    "or k in P1",
                ),
                (&[("ds(right)", "ds(top)")], "t*v*ds(right) on top"),
                (&[("c = 2.0", "c = 2.5")], "c = 2.5"),
                (
                    &[("- f*v*dx", "- (1 + 0.25*x)*f*v*dx")],
                    "f*v*dx × (1 + 0.25 x0)",
                ),
                // Two at once.
                (
                    &[("- f*v*dx - t*v", "- 1.01*f*v*dx - 0.98*t*v")],
                    "f*v*dx × 1.01 and t*v*ds(right) × 0.98",
                ),
                (
                    &[
                        ("dot(b, grad(u))*v*dx + ", ""),
                        (
                            "f = \"exp(x)*sin(4*y)\"",
                            "f = {expr = \"exp(x)*sin(4*y)\", space = \"P1\"}",
                        ),
                    ],
                    "dot(b, grad(u))*v*dx × 0 and f in P1",
                ),
            ],
        );
    }
}

#[test]
fn changes_of_systems_are_named() {
    let load = ("- dot(f, v)*dx", "- dot(f, v)*dx + dot(f, v)*dx(cell)");
    check(
        ELASTICITY,
        &square(6),
        &[
            (
                &[("2*mu*inner", "2.002*mu*inner")],
                "or 2*mu*inner(sym(grad(u)), sym(grad(v)))*dx × 1.001",
            ),
            (
                &[("mu = 1.0", "mu = 1.1"), ("lam = 2.0", "lam = 2.5")],
                "lam = 2.5 and mu = 1.1",
            ),
            (&[("- y*v[0]", "- y*v[1]")], "none"),
            (&[("ds(right)", "ds(top)")], "y*v[0]*ds(right) on top"),
            (&[load], "dot(f, v)*dx × 0 in 1"),
            (&[("f = [\"x\"", "f = [\"0\"")], "dot(f, v)*dx × 0 by [0]"),
        ],
    );
    check(
        STOKES,
        &square(6),
        &[
            (
                &[("+ dot(dot(grad(u), u), v)*dx", "")],
                "dot(dot(grad(u), u), v)*dx × 0",
            ),
            (&[("- p*div(v)*dx", "+ p*div(v)*dx")], "p*div(v)*dx × -1"),
            (
                &[("- q*div(u)*dx", "- q*div(u)*dx - 1e-3*p*q*dx")],
                "+ -0.001 p",
            ),
            (
                &[(
                    "nu*inner(grad(u), grad(v))",
                    "2*nu*inner(sym(grad(u)), sym(grad(v)))",
                )],
                "none",
            ),
            (&[("nu = 0.5", "nu = 0.4999")], "nu = 0.4999"),
        ],
    );
    check(
        SURFACE,
        &square(8),
        &[
            (&[("a = 1.0", "a = 1.2")], "a = 1.2"),
            (&[("0.1*g", "0.1001*g")], "or 0.1*g*v*dx × 1.001"),
            (
                &[("a = 1.0", "a = 1.1"), ("0.1*g", "0.11*g")],
                "or 0.1*g*v*dx × 1.1 and a = 1.1",
            ),
        ],
    );
    check(
        PENALTY,
        &square(5),
        &[
            (
                &[(
                    "- dot(grad(v), n)*(u - g)*ds",
                    "+ dot(grad(v), n)*(u - g)*ds",
                )],
                "dot(grad(v), n)*(u - g)*ds × -1",
            ),
            (
                &[("- dot(avg(grad(v)), n('+'))*jump(u)*dS", "")],
                "dot(avg(grad(v)), n('+'))*jump(u)*dS × 0",
            ),
            (&[("sigma = 10.0", "sigma = 12.0")], "sigma = 12"),
            (&[("sigma/h", "8/h")], "sigma/h*(u - g)*v*ds × 0.8"),
        ],
    );
}

#[test]
fn rules_and_data_at_centres_are_named() {
    for element in ["P1", "P2"] {
        let (text, mesh) = (diffusion(element), square(8));
        let form = parse(&text, &mesh);
        type Changed = fn(&mut Problem);
        let changes: [(&str, Changed); 3] = [
            ("f in P0", |p| {
                p.data[2].space = Some(Space {
                    element: Element::Broken(0),
                    size: None,
                });
            }),
            ("all by edges-3", |p| p.degree = 2),
            ("t*v*ds(right) by gauss-2", |p| p.facet_degree = 3),
        ];
        for (wanted, change) in changes {
            let found = exact(&form, &put(&text, &form, &mesh, change));
            println!("{element}: {}", found.join(", or "));
            assert!(
                found.iter().any(|text| text == wanted),
                "{element}: {found:?} in place of {wanted}"
            );
        }
    }
}

#[test]
fn sizes_of_cells_and_normals_are_named() {
    let mesh = square(5);
    let replaced = |text: &str, with: &dyn Fn(&mut Scalars, Node) -> Option<Id>| {
        let change = |p: &mut Problem| {
            let terms = p.integrals.iter_mut().flat_map(|i| i.terms.values_mut());
            for value in terms {
                *value = p
                    .scalars
                    .map(*value, &mut |scalars, node| with(scalars, node));
            }
        };
        let form = parse(text, &mesh);
        exact(&form, &put(text, &form, &mesh, change))
    };
    for length in [Length::Circumradius, Length::Inradius, Length::Facet] {
        let found = replaced(PENALTY, &|scalars, node| match node {
            Node::Length(_, side) => Some(scalars.push(Node::Length(length, side))),
            _ => None,
        });
        assert_eq!(found[0], format!("h Of({length:?})"), "{found:?}");
    }
    let facets = PENALTY.replace("avg(h)", "facet_length");
    let facets = facets.replace("/h", "/facet_length");
    let found = replaced(&facets, &|scalars, node| match node {
        Node::Length(Length::Facet, side) => {
            Some(scalars.push(Node::Length(Length::Diameter, side)))
        }
        _ => None,
    });
    assert_eq!(found[0], "facet_length Of(Diameter)", "{found:?}");
    let largest = (0..mesh.cells_of(CellKind::Triangle).count()).map(|cell| {
        let mesh = Triangulation::new("square", &mesh).expect("it is sound");
        mesh.geometry(cell).diameter
    });
    let largest = largest.fold(0.0, f64::max);
    let found = replaced(PENALTY, &|scalars, node| match node {
        Node::Length(..) => Some(scalars.number(largest)),
        _ => None,
    });
    assert_eq!(found[0], "h Largest", "{found:?}");
    let found = replaced(PENALTY, &|scalars, node| match node {
        Node::Normal(..) => {
            let n = scalars.push(node);
            Some(scalars.negative(n))
        }
        _ => None,
    });
    assert_eq!(found[0], "-n", "{found:?}");
}

#[test]
fn coordinates_that_were_rounded_are_named() {
    let (text, mesh) = (diffusion("P1"), square(8));
    let form = parse(&text, &mesh);
    for digits in [Digits::Significant(6), Digits::Decimals(7), Digits::Single] {
        let mut rounded = mesh.clone();
        for x in rounded.points.to_mut().iter_mut().flatten() {
            *x = digits.round(*x);
        }
        let solution = own::solve(&form, &rounded).unwrap_or_else(|e| panic!("{e}"));
        let (cells, fields) = own::output(&solution.assembler, &solution.u);
        let result = Mesh { fields, ..cells };
        let judged = judge(&form, &mesh, &result, 2e-16).unwrap_or_else(|e| panic!("{e}"));
        let found = exact(&form, &judged);
        // Below 1 digits and decimals are one.
        assert!(found.contains(&format!("{digits:?}")), "{found:?}");
    }
}

/// What is no change that is known is not called one.
#[test]
fn nothing_is_accused_that_was_not_changed() {
    let text = diffusion("P1");
    let mesh = square(8);
    let form = parse(&text, &mesh);
    let edits = [
        ("- f*v*dx", "- (f + 0.3*sin(7*x))*v*dx"),
        ("k = \"1 + x*y\"", "k = \"1 + x*y + 0.1*exp(x)\""),
        ("k = \"1 + x*y\"", "k = \"1 + x*y + 1e-5*sin(9*x*y)\""),
        ("c*u*v", "c*u*u*v"),
        ("b = [\"1\", \"x\"]", "b = [\"1\", \"x + y^3\"]"),
        ("- t*v", "- (t + 0.01*sin(8*y))*v"),
        ("+ c*u*v*dx", "+ c*u*v*dx + 1e-6*abs(u - 0.5)*v*dx"),
    ];
    for (from, to) in edits {
        let found = told(&text, &[(from, to)], &mesh);
        assert!(found.is_empty(), "{from} to {to}: {found:?}");
    }
    for k in 0..60 {
        let k = f64::from(k);
        let size = 10_f64.powf(-6.0 * (0.37 * k).fract());
        let wave = format!(
            "{size:?}*sin({:?}*x + {:?}*y)",
            2.0 + (0.71 * k).fract() * 9.0,
            1.0 + (0.53 * k).fract() * 7.0
        );
        let to = match k as usize % 3 {
            0 => ("- f*v*dx", format!("- (f + {wave})*v*dx")),
            1 => ("k = \"1 + x*y\"", format!("k = \"1 + x*y + 0.3*{wave}\"")),
            _ => ("c*u*v", format!("(c + {wave})*u*v")),
        };
        let found = told(&text, &[(to.0, &to.1)], &mesh);
        assert!(found.is_empty(), "{to:?}: {found:?}");
    }
    // On meshes of few equations a few numbers explain everything.
    for n in [1, 2, 3] {
        let coarse = square(n);
        for (from, to) in edits {
            let found = told(&text, &[(from, to)], &coarse);
            assert!(found.is_empty(), "n = {n}, {from} to {to}: {found:?}");
        }
    }
    let judged = put(&text, &form, &mesh, |_| ());
    assert!(judged.explanation.is_none() && judged.rows[0].error < 1e-13);
}
