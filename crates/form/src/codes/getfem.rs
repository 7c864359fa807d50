//! GetFEM: the form in its weak form language, in scalars, with GetFEM's own derivative.

use faceoff_fem::scene::expression::Function;

use super::Code;
use super::python;
use super::spelling::{Shared, Spelling, Words, comment, measure, shared};
use crate::problem::{Domain, Element, Measure, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// GetFEM 5 in the system's Python, where packages of Linux distributions put it.
pub const CODE: Code = Code {
    name: "getfem",
    suffix: "_getfem.py",
    command: &["/usr/bin/python3"],
    mesh: ("msh2", "msh"),
    write,
};

/// Names that the frame makes, and words of the weak form language.
pub const RESERVED: &str = "gf model mesh sides side on space spaces value hold held free nodes at order output faces exact facet where fixed cell \
    X Normal Id Trace Sym Skew Det Inv Cofactor Norm Heaviside sign pos_part neg_part sqr element_size timestep qdim meshdim sin cos tan asin \
    name of_it region F getfem corners dofs face longest total \
    acos atan atan2 sinh cosh tanh exp log sqrt erf Interpolate Print Derivative Def t T u_";

fn element(element: Element, dim: usize) -> Result<String, String> {
    match element {
        Element::Continuous(degree) => Ok(format!("FEM_PK({dim},{degree})")),
        Element::Broken(degree) => Ok(format!("FEM_PK_DISCONTINUOUS({dim},{degree})")),
        Element::CrouzeixRaviart if dim == 2 => Ok("FEM_P1_NONCONFORMING".into()),
        Element::CrouzeixRaviart => Err("GetFEM has no Crouzeix-Raviart element in 3D".into()),
        Element::RaviartThomas => Ok(format!("FEM_RT0({dim})")),
        Element::Nedelec => Ok(format!("FEM_NEDELEC({dim})")),
    }
}

/// GetFEM takes no points, only names; a rule on facets is part of one on cells.
fn rules(problem: &Problem) -> Result<[&'static str; 2], String> {
    let [cells, facets] = problem.rules().map(|rule| rule.name);
    let of_cells = match cells {
        "radon-7" => "IM_TRIANGLE(5)",
        "edges-3" => "IM_NC(2,2)",
        "hammer-4" => "IM_TETRAHEDRON(2)",
        _ => {
            return Err(format!(
                "GetFEM has no rule with the points of {cells}: take a degree of at most 2"
            ));
        }
    };
    let of_facets = match (facets, problem.dim) {
        ("gauss-5", _) => "IM_TRIANGLE(9)",
        ("gauss-3", _) => "IM_TRIANGLE(5)",
        ("gauss-2", _) => "IM_TRIANGLE(2)",
        ("radon-7", _) => "IM_TETRAHEDRON(5)",
        _ => "IM_NC(3,2)",
    };
    Ok([of_cells, of_facets])
}

fn call(function: Function, arguments: &[String]) -> String {
    format!("{}({})", function.names()[0], arguments.join(", "))
}

/// The weak form language has no choice; `Heaviside` is 1 from 0 on.
fn choice(sign: &str, [a, b, c, d]: &[String; 4]) -> String {
    let (step, yes, no) = match sign {
        "<" => (format!("Heaviside({a} - ({b}))"), d, c),
        "<=" => (format!("Heaviside({b} - ({a}))"), c, d),
        ">" => (format!("Heaviside({b} - ({a}))"), d, c),
        _ => (format!("Heaviside({a} - ({b}))"), c, d),
    };
    format!("(({no}) + {step}*(({yes}) - ({no})))")
}

fn end(problem: &Problem, words: &Words, node: Node) -> String {
    let other = |name: String, side| match side {
        Side::Minus => format!("Interpolate({name}, neighbor_element)"),
        _ => name,
    };
    match node {
        Node::Pi => "pi".into(),
        Node::Parameter(k) => words.parameters[k].clone(),
        Node::Coordinate(k) => format!("X({})", k + 1),
        Node::Normal(k, Side::Minus) => format!("(-Normal({}))", k + 1),
        Node::Normal(k, _) => format!("Normal({})", k + 1),
        Node::Diameter(side) => other("h".into(), side),
        Node::Leaf(leaf) => {
            let (test, field) = match leaf.field {
                Field::Test(k) => ("Test_", Field::Unknown(k)),
                field => ("", field),
            };
            let name = words.part(Leaf { field, ..leaf });
            match leaf.axis {
                _ if matches!(field, Field::Datum(k) if problem.data[k].space.is_none()) => {
                    name.to_owned()
                }
                None => other(format!("{test}{name}"), leaf.side),
                Some(k) => format!(
                    "{}({})",
                    other(format!("Grad_{test}{name}"), leaf.side),
                    k + 1
                ),
            }
        }
        _ => String::new(),
    }
}

fn write(problem: &mut Problem) -> Result<String, String> {
    let dim = problem.dim;
    let [rule, facet_rule] = rules(problem)?;
    let words = Words::new(problem, &format!("{} {RESERVED}", python::RESERVED), 0, '_');
    let mut s = python::top(problem, CODE.suffix, "import getfem as gf\n", &words);
    s += &FRAME
        .replace("CORNERS", &(dim + 1).to_string())
        .replace("DIM", &dim.to_string());
    for (k, group) in problem.groups.iter().enumerate() {
        let name = comment(&group.name);
        let (region, tag) = (k + 1, group.tag);
        if group.dim == dim {
            s += &format!(
                "mesh.set_region({region}, np.flatnonzero(regions == {tag})[None])  # {name}\n"
            );
        } else if group.dim + 1 == dim {
            s += &format!("mesh.set_region({region}, on[labels == {tag}].T)  # {name}\n");
        }
    }
    let [whole, between] = [1, 2].map(|more| problem.groups.len() + more);
    s += &format!(
        "mesh.set_region({whole}, mesh.outer_faces())\nmesh.set_region({between}, mesh.inner_faces())\n"
    );
    s += &format!(
        "\n# Quadrature rules with the same points as in the other codes.\n\
         exact, facet = gf.MeshIm(mesh, gf.Integ(\"{rule}\")), gf.MeshIm(mesh, gf.Integ(\"{facet_rule}\"))\nmodel = gf.Model(\"real\")\n"
    );
    for name in &words.parameters {
        s += &format!("model.add_initialized_data(\"{name}\", {name})\n");
    }
    if problem.has_diameter() {
        s += &"corners = points[cells]\nlongest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3).max(axis=(1, 2))\n\
              model.add_initialized_fem_data(\"h\", space(\"FEM_PK(DIM,0)\"), longest)  # the longest edge of each cell\n"
            .replace("DIM", &dim.to_string());
    }
    let residual = problem.residual();
    let problem = &*problem;
    let numpy = |id: Id| {
        python::numpy(&problem.scalars, id, ["x", "y", "z"], &|k| {
            words.parameters[k].clone()
        })
    };
    let axes = ["x", "y", "z"][..dim].join(", ");
    let ends = |node: Node| end(problem, &words, node);
    let spelling = Spelling {
        end: &ends,
        call,
        power: |base, n| format!("pow({base}, {})", n.text()),
        choice,
    };
    for (k, datum) in problem.data.iter().enumerate() {
        for (name, id) in words.parts(Field::Datum(k)).iter().zip(&datum.components) {
            s += &match datum.space {
                None => format!(
                    "model.add_macro(\"{name}\", \"{}\")\n",
                    spelling.text(&problem.scalars, *id, &Shared::new())
                ),
                Some(of) => format!(
                    "nodes = space(\"{0}\")\nmodel.add_initialized_fem_data(\"{name}\", nodes, (lambda {axes}: {1})(*nodes.basic_dof_nodes()))\n",
                    element(of.element, dim)?,
                    numpy(*id)
                ),
            };
        }
    }
    s += "\nspaces = {\n";
    for (k, c) in problem.components() {
        let name = &words.parts(Field::Unknown(k))[c];
        s += &format!(
            "    \"{name}\": space(\"{}\"),\n",
            element(problem.unknowns[k].space.element, dim)?
        );
    }
    s += "}\nfor name, of_it in spaces.items():\n    model.add_fem_variable(name, of_it)\n";
    let roots: Vec<Id> = residual
        .iter()
        .flat_map(|i| i.terms.values().copied())
        .collect();
    let reserved = format!("{} {RESERVED}", python::RESERVED);
    let found = shared(
        &problem.scalars,
        &roots,
        &mut Words::new(problem, &reserved, 0, '_'),
    );
    let mut known = Shared::new();
    for (id, name) in &found {
        let value = spelling.definition(&problem.scalars, *id, &known);
        s += &format!("model.add_macro(\"{name}\", \"{value}\")\n");
        known.insert(*id, name.clone());
    }
    for integral in &residual {
        let terms = integral.terms.iter().map(|(test, c)| {
            format!(
                "({})*{}",
                spelling.text(&problem.scalars, *c, &known),
                ends(Node::Leaf(*test))
            )
        });
        let terms: Vec<String> = terms.map(|term| format!("    \"{term}\"")).collect();
        let over = regions(&integral.measure, [whole, between]);
        let rule = if integral.measure.domain == Domain::Cells {
            "exact"
        } else {
            "facet"
        };
        s += &format!(
            "\n# {}\nF = (\n{}\n)\nfor region in {over}:\n    model.add_nonlinear_term({rule}, F, region)\n",
            comment(&measure(problem, &integral.measure)),
            terms.join("\n    \" + \"\n")
        );
    }
    s += "\n# Dirichlet values; where two groups share a dof, the later one counts.\nheld = np.zeros(model.nbdof(), bool)\ntotal = np.zeros(len(held))\n";
    if !problem.conditions.is_empty() {
        s += HOLD;
    }
    for condition in &problem.conditions {
        let name = &words.parts(Field::Unknown(condition.unknown))[condition.component];
        let value = numpy(condition.value);
        s += &format!(
            "hold(\"{name}\", {}, lambda {axes}: {value})\n",
            condition.group + 1
        );
    }
    s += NEWTON;
    let (nodes, kind) = python::nodes(problem.output(), dim)?;
    let nodes: Vec<String> = nodes
        .iter()
        .map(|node| format!("{:?}", &node[1..]))
        .collect();
    s += &RESULT
        .replace("DEGREE", &problem.output().degree().to_string())
        .replace("DIM", &dim.to_string())
        .replace("NODES", &nodes.join(", "))
        .replace("REST", &(3 - dim).to_string());
    let values = problem.unknowns.iter().enumerate().map(|(k, u)| {
        let parts = words.parts(Field::Unknown(k)).iter();
        let parts: Vec<String> = parts.map(|name| format!("\"{name}\"")).collect();
        (u.name.clone(), format!("values({})", parts.join(", ")))
    });
    Ok(s + &python::bottom(problem.output(), kind, &values.collect::<Vec<_>>()))
}

/// The regions of a measure; of cells all are -1.
fn regions(measure: &Measure, [whole, between]: [usize; 2]) -> String {
    let groups: Vec<String> = measure.groups.iter().map(|k| (k + 1).to_string()).collect();
    match (groups.is_empty(), measure.domain) {
        (true, Domain::Cells) => "[-1]".into(),
        (true, Domain::Boundary) => format!("[{whole}]"),
        (true, Domain::Interior) => format!("[{between}]"),
        _ => format!("[{}]", groups.join(", ")),
    }
}

const FRAME: &str = r#"
gf.util_trace_level(0)
gf.util_warning_level(0)
mesh = gf.Mesh("ptND", points.T, cells.T)


def space(element):
    found = gf.MeshFem(mesh, 1)
    found.set_fem(gf.Fem(element))
    return found


# Facet i of a cell lies opposite its vertex i.
faces = np.sort(np.stack([np.delete(cells, i, axis=1) for i in range(CORNERS)], axis=1), axis=2)
sides = {tuple(face): divmod(i, CORNERS) for i, face in enumerate(faces.reshape(-1, DIM).tolist())}
on = np.array([sides[tuple(sorted(vertices))] for vertices in facets.tolist()])
"#;

const HOLD: &str = r#"

def hold(name, region, g):
    dofs = spaces[name].basic_dof_on_region(region)
    first, _ = model.interval_of_variable(name)
    held[first + dofs] = True
    total[first + dofs] = g(*spaces[name].basic_dof_nodes(dofs))


"#;

const NEWTON: &str = r#"
# Newton's method, from 0 with these values. A linear form takes one step, and a second one confirms it.
free = np.flatnonzero(~held)
for step in range(30):
    model.to_variables(total)
    model.assembly("build_all")
    A = gf.Spmat("copy", model.tangent_matrix(), free, free)
    d = gf.linsolve_mumps(A, model.rhs()[free]).ravel()
    total[free] += d
    if abs(d).max(initial=0) <= 1e-10*abs(total).max():
        break
else:
    sys.exit("Newton's method did not converge.")
model.to_variables(total)
"#;

const RESULT: &str = r#"
# The values at the nodes of VTK's cells.
output = space("FEM_PK_DISCONTINUOUS(DIM,DEGREE)")
nodes = np.array([NODES])
own = gf.Fem("FEM_PK_DISCONTINUOUS(DIM,DEGREE)").pts().T
order = np.linalg.norm(nodes[:, None] - own, axis=2).argmin(axis=1)
dofs = output.basic_dof_from_cvid()[0].reshape(len(cells), -1)[:, order]
at = np.pad(output.basic_dof_nodes().T[dofs], ((0, 0), (0, 0), (0, REST)))


def values(*names):
    each = [gf.compute_interpolate_on(spaces[name], model.variable(name), output).ravel()[dofs] for name in names]
    return np.stack(each, axis=2)
"#;
