//! GetFEM: the form in its weak form language, in scalars, with GetFEM's own derivative.

use faceoff_fem::scene::expression::Function;

use super::Code;
use super::python;
use super::spelling::{Shared, Spelling, Words, comment, measure, shared, traces};
use crate::problem::{Domain, Element, Measure, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// GetFEM 5 in the system's Python, where packages of Linux distributions put it.
pub const CODE: Code = Code {
    name: "getfem",
    suffix: "_getfem.py",
    command: &["/usr/bin/python3"],
    mesh: ("msh2", "msh"),
    script: super::Script::Own(write),
};

/// Names that the frame makes, and words of the weak form language.
pub const RESERVED: &str = "gf model mesh sides side on space spaces value hold held free nodes at order output faces exact facet where fixed cell \
    X Normal Id Trace Sym Skew Det Inv Cofactor Norm Heaviside sign pos_part neg_part sqr element_size timestep qdim meshdim sin cos tan asin \
    name of_it region F getfem corners dofs face longest total \
    acos atan atan2 sinh cosh tanh exp log sqrt erf Interpolate Print Derivative Def t T u_ goal first number size hold_whole";

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
            let is_vector = match field {
                Field::Unknown(k) | Field::Old(k) => problem.unknowns[k].space.element.is_vector(),
                _ => false,
            };
            let name = match is_vector {
                true => words.whole(field),
                false => words.part(Leaf { field, ..leaf }),
            };
            let index = match is_vector {
                true => format!("{},", leaf.component + 1),
                false => String::new(),
            };
            match (leaf.axis, leaf.second) {
                _ if matches!(field, Field::Datum(k) if problem.data[k].space.is_none()) => {
                    name.to_owned()
                }
                (None, _) => {
                    let value = other(format!("{test}{name}"), leaf.side);
                    match is_vector {
                        true => format!("{value}({})", leaf.component + 1),
                        false => value,
                    }
                }
                (Some(k), None) => format!(
                    "{}({index}{})",
                    other(format!("Grad_{test}{name}"), leaf.side),
                    k + 1
                ),
                (Some(k), Some(l)) => format!(
                    "{}({index}{},{})",
                    other(format!("Hess_{test}{name}"), leaf.side),
                    k + 1,
                    l + 1
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
    let name_of = |field: Field, c: Option<usize>| match c {
        Some(c) => words.parts(field)[c].as_str(),
        None => words.whole(field),
    };
    for (k, c) in problem.blocks() {
        let name = name_of(Field::Unknown(k), c);
        let element = element(problem.unknowns[k].space.element, dim)?;
        let size = match c {
            Some(_) => String::new(),
            None => format!(", {dim}"),
        };
        s += &format!("    \"{name}\": space(\"{element}\"{size}),\n");
    }
    s += "}\nfor name, of_it in spaces.items():\n    model.add_fem_variable(name, of_it)\n";
    let mut olds = Vec::new();
    if problem.time.is_some() {
        for (k, c) in problem.blocks() {
            let [old, now] = [Field::Old(k), Field::Unknown(k)].map(|field| name_of(field, c));
            s += &format!("model.add_fem_data(\"{old}\", spaces[\"{now}\"])\n");
            olds.push(format!(
                "model.set_variable(\"{old}\", model.variable(\"{now}\"))\n"
            ));
        }
    }
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
    for (k, mean) in problem.means.iter().enumerate() {
        let p = name_of(Field::Unknown(mean.unknown), Some(0));
        s += &format!(
            "\n# The mean is held by a multiplier.\nmodel.add_variable(\"multiplier{k}\", 1)\n\
             model.add_nonlinear_term(exact, \"multiplier{k}*Test_{p} + ({p} - ({:?}))*Test_multiplier{k}\")\n",
            mean.value
        );
    }
    s += "\n# Dirichlet values; where two groups share a dof, the later one counts.\nheld = np.zeros(model.nbdof(), bool)\ntotal, goal = np.zeros(len(held)), np.zeros(len(held))\n";
    let conditions = problem.held();
    if conditions.iter().any(|held| held.component.is_some()) {
        s += HOLD;
    }
    if conditions.iter().any(|held| held.component.is_none()) {
        s += HOLD_WHOLE;
    }
    let mut solve = String::new();
    for held in &conditions {
        let name = name_of(Field::Unknown(held.unknown), held.component);
        let region = held.group + 1;
        solve += &match held.component {
            Some(_) => {
                let value = numpy(held.values[0]);
                format!("hold(\"{name}\", {region}, lambda {axes}: {value})\n")
            }
            None => {
                let list = |of: &dyn Fn(usize) -> String| (0..dim).map(of).collect::<Vec<_>>();
                let n = list(&|k| format!("Normal({})", k + 1));
                let element = problem.unknowns[held.unknown].space.element;
                let trace = |of: &dyn Fn(usize) -> String| traces(element, &list(of), &n);
                let test = trace(&|k| format!("Test_{name}({})", k + 1));
                let trial = trace(&|k| format!("Test2_{name}({})", k + 1));
                let value =
                    trace(&|k| spelling.text(&problem.scalars, held.values[k], &Shared::new()));
                let sum = |a: &[String]| {
                    let each = a.iter().zip(&test).map(|(a, b)| format!("{a}*{b}"));
                    each.collect::<Vec<_>>().join(" + ")
                };
                format!(
                    "hold_whole(\n    \"{name}\",\n    {region},\n    \"{}\",\n    \"{}\",\n)\n",
                    sum(&trial),
                    sum(&value)
                )
            }
        };
    }
    solve += NEWTON;
    match &problem.time {
        None => s += &solve,
        Some(time) => {
            s += "\n# Initial values.\n";
            for initial in &time.initial {
                let name = name_of(Field::Unknown(initial.unknown), Some(initial.component));
                s += &format!(
                    "first, size = model.interval_of_variable(\"{name}\")\n\
                     total[first : first + size] = (lambda {axes}: {})(*spaces[\"{name}\"].basic_dof_nodes())\n",
                    numpy(initial.value)
                );
            }
            let t = &words.parameters[time.parameter];
            let mut again =
                format!("model.set_variable(\"{t}\", {t})\nmodel.to_variables(total)\n");
            again += &olds.concat();
            for (name, of, id) in words.interpolated(problem) {
                again += &format!(
                    "nodes = space(\"{}\").basic_dof_nodes()\nmodel.set_variable(\"{name}\", (lambda {axes}: {})(*nodes))\n",
                    element(of, dim)?,
                    numpy(id)
                );
            }
            s += &python::steps(
                time,
                &words,
                |t, dt| format!("{t} = number*{dt}"),
                &again,
                &solve,
            );
        }
    }
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
        let names = match u.space.element.is_vector() {
            true => &[words.whole(Field::Unknown(k)).to_owned()],
            false => words.parts(Field::Unknown(k)),
        };
        let parts: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
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


def space(element, size=1):
    found = gf.MeshFem(mesh, size)
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
    goal[first + dofs] = g(*spaces[name].basic_dof_nodes(dofs))


"#;

const HOLD_WHOLE: &str = r#"

def hold_whole(name, region, product, load):
    """Hold the normal or tangential moments of a vector on facets, by projection."""
    M, b = (gf.asm_generic(facet, order, text, region, model, "select_output", *[name]*order) for order, text in ((2, product), (1, load)))
    first, size = model.interval_of_variable(name)
    diagonal = np.array(M.diag()).ravel()
    found = np.flatnonzero(diagonal > 1e-10*diagonal.max())
    held[first + found] = True
    goal[first + found] = gf.linsolve_mumps(gf.Spmat("copy", M, found, found), b[found]).ravel()


"#;

const NEWTON: &str = r#"
# Newton's method. Dirichlet values come in by its first increment; a linear form takes one step, and a second one confirms it.
free = np.flatnonzero(~held)
for step in range(30):
    model.to_variables(total)
    model.assembly("build_all")
    A = model.tangent_matrix()
    d = np.where(held, goal - total, 0.0)
    r = (model.rhs() - A.mult(d))[free]
    d[free] = gf.linsolve_mumps(gf.Spmat("copy", A, free, free), r).ravel()
    total += d
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
    found = [gf.compute_interpolate_on(spaces[name], model.variable(name), output) for name in names]
    each = [part[dofs] for values in found for part in np.atleast_2d(values)]
    return np.stack(each, axis=2)
"#;
