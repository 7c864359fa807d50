//! dolfinx: the form in UFL as it was written, with UFL's own derivative; releases from 0.5 on.

use faceoff_fem::scene::expression::Function;
use faceoff_fem::scene::expression::syntax::Term;

use super::Code;
use super::python;
use super::spelling::{Words, traces};
use super::ufl::{formula, ufl};
use crate::problem::{Domain, Element, Problem, Unknown};
use crate::scalar::{Field, Id, Node};

/// dolfinx in the system's Python, where packages of Linux distributions put it.
pub const CODE: Code = Code {
    name: "dolfinx",
    suffix: "_dolfinx.py",
    command: &["/usr/bin/python3"],
    mesh: ("msh2", "msh"),
    script: super::Script::Own(write),
};

/// Names that the frame imports or makes.
pub const RESERVED: &str = "CellDiameter FacetNormal Measure SpatialCoordinate TestFunction TestFunctions derivative lines mpi4py parts petsc4py MPI PETSc basix dolfinx fem io petsc ufl mesh marked here V W F J dx ds dS md fixed hold element space spaces bcs solver \
    grad div curl dot inner outer cross sym skew dev tr det inv cofac transpose Identity jump avg conditional lt le gt ge max_value min_value \
    sin cos tan asin acos atan atan2 sinh cosh tanh exp ln sqrt sign as_tensor split graph old facet_tags cell_tags function at nodes cell rank w goal held before number rows scipy splu start volume wanted hold_whole normal tangential";

fn element(unknown: &Unknown) -> String {
    let family = match unknown.space.element {
        Element::Continuous(degree) => format!("\"Lagrange\", {degree}"),
        Element::Broken(degree) => format!("\"DG\", {degree}"),
        Element::CrouzeixRaviart => "\"CR\", 1".into(),
        Element::RaviartThomas => "\"RT\", 1".into(),
        Element::Nedelec => "\"N1curl\", 1".into(),
    };
    match unknown.space.size {
        None => format!("element({family})"),
        Some(size) if !unknown.space.element.is_vector() => format!("element({family}, {size})"),
        Some(_) => format!("element({family})"),
    }
}

fn write(problem: &mut Problem) -> Result<String, String> {
    let dim = problem.dim;
    let words = Words::new(problem, &format!("{} {RESERVED}", python::RESERVED), 0, '_');
    let held = problem.held();
    let is_whole = held.iter().any(|held| held.component.is_none());
    let scipy = match is_whole || !problem.means.is_empty() {
        true => "import scipy.sparse\nfrom scipy.sparse.linalg import splu\n",
        false => "",
    };
    let imports = "import basix\nimport dolfinx\n{scipy}import ufl\nfrom dolfinx import fem, graph, io\nfrom dolfinx.fem import petsc\nfrom mpi4py import MPI\nfrom petsc4py import PETSc\n\
        from ufl import (\n    CellDiameter, FacetNormal, Identity, Measure, SpatialCoordinate, TestFunction, TestFunctions, acos, as_tensor, asin, atan, avg,\n    \
        conditional, cos, cosh, cross, curl, derivative, det, dev, div, dot, exp, ge, grad, gt, inner, inv, jump, le, ln, lt, max_value,\n    \
        min_value, outer, pi, sign, sin, sinh, skew, sqrt, sym, tan, tanh, tr, transpose,\n)".replace("{scipy}", scipy);
    let mut s = python::top(problem, CODE.suffix, &imports, &words);
    let cell = if dim == 2 { "triangle" } else { "tetrahedron" };
    let [rule, facet_rule] = problem.rules().map(|rule| python::rule(&rule));
    s += &format!(
        "\nold = not hasattr(fem, \"functionspace\")  # before 0.7\n\n\n\
         def element(family, degree, size=None):\n    \
         variant = basix.LagrangeVariant.equispaced if degree > 2 else basix.LagrangeVariant.unset  # nodes of P3 at thirds\n    \
         if old and degree > 2:\n        scalar = basix.ufl_wrapper.create_element(\"P\", \"{cell}\", degree, variant)\n    \
         elif old:\n        scalar = ufl.FiniteElement(family, \"{cell}\", degree)\n    \
         else:\n        return basix.ufl.element(family, \"{cell}\", degree, variant, shape=None if size is None else (size,))\n    \
         return scalar if size is None else ufl.VectorElement(scalar, dim=size)\n\n\n\
         def space(mesh, element):\n    return fem.FunctionSpace(mesh, element) if old else fem.functionspace(mesh, element)\n\n\n\
         lines = ufl.Mesh(element(\"Lagrange\", 1, {dim})) if old else element(\"Lagrange\", 1, {dim})\n\
         mesh = dolfinx.mesh.create_mesh(MPI.COMM_WORLD, cells, points, lines) if old else dolfinx.mesh.create_mesh(\n    MPI.COMM_WORLD, cells=cells, x=points, e=lines\n)\n\n\n\
         def marked(rank, vertices, numbers):\n    \"\"\"The group numbers of entities; dolfinx has renumbered the mesh.\"\"\"\n    \
         mesh.topology.create_connectivity(rank, 0)\n    mesh.topology.create_connectivity(rank, {dim})\n    \
         found, numbers = io.distribute_entity_data(getattr(mesh, \"_mesh\", mesh), rank, vertices, numbers)\n    \
         adjacency = getattr(graph, \"adjacencylist\", None) or graph.create_adjacencylist\n    \
         return dolfinx.mesh.meshtags_from_entities(mesh, rank, adjacency(found), numbers.astype(np.int32))\n\n\n\
         facet_tags, cell_tags = marked({0}, facets, labels), marked({dim}, cells, regions)\n",
        dim - 1
    );
    s += &format!(
        "\n\n# The quadrature points are given explicitly, so that all codes use the same.\n\
         md = {{\n    \"quadrature_rule\": \"custom\",\n    \"quadrature_points\": np.array({}),\n    \"quadrature_weights\": np.array({}),\n}}\n",
        rule.0
            .replace("\n]", "\n    ]")
            .replace("\n    [", "\n        ["),
        rule.1
            .replace("\n    ", "\n        ")
            .replace("\n]", "\n    ]")
    );
    let facets = format!(
        "md = {{\n    \"quadrature_rule\": \"custom\",\n    \"quadrature_points\": np.array({}),\n    \"quadrature_weights\": np.array({}),\n}}\n",
        facet_rule
            .0
            .replace("\n]", "\n    ]")
            .replace("\n    [", "\n        ["),
        facet_rule
            .1
            .replace("\n    ", "\n        ")
            .replace("\n]", "\n    ]")
    );
    s += "dx = Measure(\"dx\", domain=mesh, subdomain_data=cell_tags, metadata=md)\n";
    let mut domains: Vec<Domain> = problem.integrals.iter().map(|i| i.measure.domain).collect();
    if is_whole {
        domains.push(Domain::Boundary);
    }
    if domains.iter().any(|d| *d != Domain::Cells) {
        s += &facets;
        for (domain, name) in [(Domain::Boundary, "ds"), (Domain::Interior, "dS")] {
            if domains.contains(&domain) {
                s += &format!(
                    "{name} = Measure(\"{name}\", domain=mesh, subdomain_data=facet_tags, metadata=md)\n"
                );
            }
        }
    }
    let texts = problem.data.iter().flat_map(|datum| &datum.texts);
    let uses =
        |word: &str| texts.clone().any(|text| text.contains(word)) || problem.form.0.contains(word);
    if uses("cofac") {
        s += COFACTORS;
    }
    let of_held = held.iter().flat_map(|held| held.values.iter().copied());
    let nodes = problem.scalars.nodes_of(of_held);
    let is_angle = |id: &Id| matches!(problem.scalars.node(*id), Node::Call(Function::Atan2, ..));
    if uses("atan2") || is_whole && nodes.iter().any(is_angle) {
        s += "atan2 = getattr(ufl, \"atan2\", None) or ufl.atan_2\n";
    }
    s += "x = SpatialCoordinate(mesh)\n";
    if problem.form.0.contains('n') || is_whole {
        s += "n = FacetNormal(mesh)\n";
    }
    if problem.has_diameter() {
        s += "h = CellDiameter(mesh)\n";
    }
    for name in words.parameters.clone() {
        s += &format!("{name} = fem.Constant(mesh, PETSc.ScalarType({name}))\n");
    }
    let in_ufl = |text: &str| {
        Term::parse(text)
            .map(|term| ufl(problem, &words, text, &term))
            .unwrap_or_default()
    };
    for (k, datum) in problem.data.iter().enumerate() {
        let name = words.whole(Field::Datum(k));
        let parts: Vec<String> = match datum.space {
            None => {
                let each = datum.texts.iter().zip(&datum.components);
                each.map(|(text, id)| match constant(problem, *id) {
                    // UFL differentiates numbers only if they know the mesh.
                    Some(value) => number(value),
                    None => in_ufl(text),
                })
                .collect()
            }
            Some(space) => {
                let parts = words.parts(Field::Datum(k));
                for (part, id) in parts.iter().zip(&datum.components) {
                    s += &format!(
                        "{part} = fem.Function(space(mesh, element(\"Lagrange\", {})))\n",
                        space.element.degree()
                    );
                    s += &format!(
                        "{part}.interpolate(lambda x: {})\n",
                        at_points(problem, &words, *id)
                    );
                }
                parts.to_vec()
            }
        };
        match &datum.shape[..] {
            [] if datum.space.is_some() => {}
            [] => s += &format!("{name} = {}\n", parts[0]),
            [_] => s += &format!("{name} = as_tensor([{}])\n", parts.join(", ")),
            [_, columns, ..] => {
                let rows: Vec<String> = parts
                    .chunks(*columns)
                    .map(|row| format!("[{}]", row.join(", ")))
                    .collect();
                s += &format!("{name} = as_tensor([{}])\n", rows.join(", "));
            }
        }
    }
    let names: Vec<&str> = (0..problem.unknowns.len())
        .map(|k| words.whole(Field::Unknown(k)))
        .collect();
    let olds: Vec<&str> = match problem.time {
        Some(_) => (0..problem.unknowns.len())
            .map(|k| words.whole(Field::Old(k)))
            .collect(),
        None => Vec::new(),
    };
    let tests: Vec<&str> = (0..problem.unknowns.len())
        .map(|k| words.whole(Field::Test(k)))
        .collect();
    let elements: Vec<String> = problem.unknowns.iter().map(element).collect();
    let all = match &names[..] {
        [one] => {
            s += &format!(
                "\nV = space(mesh, {})\n{one} = fem.Function(V)\n{} = TestFunction(V)\n",
                elements[0], tests[0]
            );
            if let [old] = olds[..] {
                s += &format!("{old} = before = fem.Function(V)\n");
            }
            (*one).to_owned()
        }
        _ => {
            s += &format!(
                "\nparts = [{}]\nV = space(mesh, ufl.MixedElement(parts) if old else basix.ufl.mixed_element(parts))\nw = fem.Function(V)\n{} = ufl.split(w)\n{} = TestFunctions(V)\n",
                elements.join(", "),
                names.join(", "),
                tests.join(", ")
            );
            if !olds.is_empty() {
                s += &format!(
                    "before = fem.Function(V)\n{} = ufl.split(before)\n",
                    olds.join(", ")
                );
            }
            "w".to_owned()
        }
    };
    let text = problem
        .form
        .0
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect::<Vec<_>>()
        .join("\n");
    let form = Term::parse(&text)
        .map(|term| ufl(problem, &words, &text, &term))
        .unwrap_or_default();
    s += &format!(
        "F = (\n    {}\n)\nJ = derivative(F, {all})\n",
        form.replace('\n', "\n    ")
    );
    s += "\n# Dirichlet values; where two groups share a dof, the later one counts.\nfixed, goal = [], fem.Function(V)\n";
    if held.iter().any(|held| held.component.is_some()) {
        s += &HOLD.replace("DIM", &(dim - 1).to_string());
    }
    if is_whole {
        // A function whose trace is taken, and its normal.
        let list = |name: &str| (0..dim).map(|k| format!("{name}[{k}]")).collect::<Vec<_>>();
        let trace = |element| traces(element, &list("w"), &list("n")).join(", ");
        s += &HOLD_WHOLE
            .replace("RAVIART_THOMAS", &trace(Element::RaviartThomas))
            .replace("NEDELEC", &trace(Element::Nedelec));
    }
    let part = |k: usize, c: Option<usize>| {
        let mut part = "V".to_owned();
        if problem.unknowns.len() > 1 {
            part += &format!(".sub({k})");
        }
        match (c, problem.unknowns[k].space.size) {
            (Some(c), Some(_)) => part + &format!(".sub({c})"),
            _ => part,
        }
    };
    let mut solve = "fixed.clear()\n".to_owned();
    for held in &held {
        let part = part(held.unknown, held.component);
        let tag = problem.groups[held.group].tag;
        solve += &match held.component {
            Some(_) => {
                let value = at_points(problem, &words, held.values[0]);
                format!("hold({part}, {tag}, lambda x: {value})\n")
            }
            None => {
                let trace = match problem.unknowns[held.unknown].space.element {
                    Element::RaviartThomas => "normal",
                    _ => "tangential",
                };
                let values = held.values.iter().map(|id| match constant(problem, *id) {
                    // A form without its coefficients, which are 0, has no mesh.
                    Some(value) => number(value),
                    None => formula(problem, &words, *id),
                });
                let values: Vec<String> = values.collect();
                format!(
                    "hold_whole({part}, {tag}, {trace}, as_tensor([{}]))\n",
                    values.join(", ")
                )
            }
        };
    }
    let mut mean = String::new();
    let mut step = KSP;
    if !problem.means.is_empty() {
        let rows: Vec<String> = problem
            .means
            .iter()
            .map(|mean| {
                let test = words.whole(Field::Test(mean.unknown));
                format!("petsc.assemble_vector(fem.form({test}*dx)).array")
            })
            .collect();
        let values: Vec<String> = problem
            .means
            .iter()
            .map(|m| format!("{:?}", m.value))
            .collect();
        mean = format!(
            "\n# The means are held by multipliers: the product of a row with dofs is the integral.\nrows = np.array([{}])\n\
             volume = fem.assemble_scalar(fem.form(fem.Constant(mesh, PETSc.ScalarType(1.0))*dx))\nwanted = volume*np.array([{}])\n",
            rows.join(", "),
            values.join(", ")
        );
        step = BORDERED;
    }
    s += &format!("{mean}F, J = fem.form(F), fem.form(J)\n");
    solve += &format!(
        "held = np.unique(np.concatenate([*fixed, []])).astype(np.int32)\n\n\
         # Newton's method. Dirichlet values come in by its first increment; a linear form takes one step, and a second one confirms it.\n\
         for step in range(30):\n    A = petsc.assemble_matrix(J)\n    A.assemble()\n    r = petsc.assemble_vector(F)\n    d = A.createVecRight()\n    \
         d.array[held] = ({all}.x.array - goal.x.array)[held]\n{}    {all}.x.array[:] -= d.array\n    \
         if abs(d.array).max() <= 1e-10*abs({all}.x.array).max():\n        break\nelse:\n    sys.exit(\"Newton's method did not converge.\")\n",
        step.replace("TOTAL", &all)
    );
    match &problem.time {
        None => s += &format!("\n{solve}"),
        Some(time) => {
            s += START;
            for initial in &time.initial {
                s += &format!(
                    "start({all}, {}, lambda x: {})\n",
                    part(initial.unknown, Some(initial.component)),
                    at_points(problem, &words, initial.value)
                );
            }
            let mut again = String::new();
            for (name, _, id) in words.interpolated(problem) {
                let value = at_points(problem, &words, id);
                again += &format!("{name}.interpolate(lambda x: {value})\n");
            }
            s += &python::steps(
                time,
                &words,
                |t, dt| format!("{t}.value = number*{dt}.value"),
                &format!("before.x.array[:] = {all}.x.array\n{again}"),
                &solve,
            );
        }
    }
    s += "\n\n";
    let (nodes, kind) = python::nodes(problem.output(), dim)?;
    let nodes: Vec<String> = nodes
        .iter()
        .map(|node| format!("{:?}", &node[1..]))
        .collect();
    s += &format!(
        "# The values at the nodes of VTK's cells.\nnodes = np.array([{}])\n\n\n\
         def values(expression):\n    found = fem.Expression(expression, nodes)\n    each = np.arange(len(cells), dtype=np.int32)\n    \
         return (found.eval(each) if old else found.eval(mesh, each)).reshape(len(cells), len(nodes), -1)\n\n\n\
         at = values(x)\nat = np.pad(at, ((0, 0), (0, 0), (0, 3 - at.shape[2])))\n",
        nodes.join(", ")
    );
    let values: Vec<(String, String)> = names
        .iter()
        .zip(&problem.unknowns)
        .map(|(name, u)| (u.name.clone(), format!("values({name})")))
        .collect();
    Ok(s + &python::bottom(problem.output(), kind, &values))
}

/// A number that knows the mesh.
fn number(value: f64) -> String {
    format!("fem.Constant(mesh, PETSc.ScalarType({value:?}))")
}

/// The value of an expression of numbers only.
fn constant(problem: &Problem, id: Id) -> Option<f64> {
    let nodes = problem.scalars.nodes_of([id]);
    let is_given = |id: &Id| {
        matches!(
            problem.scalars.node(*id),
            Node::Coordinate(_) | Node::Parameter(_)
        )
    };
    let value = problem.scalars.value(id, &|_| f64::NAN);
    (!nodes.iter().any(is_given) && value.is_finite()).then_some(value)
}

const COFACTORS: &str = r#"

def cofac(A):
    """The matrix of cofactors, det(A) inv(A).T; UFL's own is its transpose in some releases."""
    if A.ufl_shape == (2, 2):
        return as_tensor([[A[1, 1], -A[1, 0]], [-A[0, 1], A[0, 0]]])
    minor = lambda i, j, k, l: A[i, j]*A[k, l] - A[i, l]*A[k, j]
    rows = [[minor((i + 1) % 3, (j + 1) % 3, (i + 2) % 3, (j + 2) % 3) for j in range(3)] for i in range(3)]
    return as_tensor(rows)


"#;

/// A function of the point in a lambda of dolfinx, whose argument `x` has the coordinates as rows.
fn at_points(problem: &Problem, words: &Words, id: Id) -> String {
    let parameter = |k: usize| format!("{}.value", words.parameters[k]);
    python::numpy(&problem.scalars, id, ["x[0]", "x[1]", "x[2]"], &parameter)
}

const HOLD: &str = r#"

def hold(part, group, g):
    found = facet_tags.find(group)
    if part is V:
        values = fem.Function(V)
        dofs = own = fem.locate_dofs_topological(V, DIM, found)
    else:
        values = fem.Function(part.collapse()[0])
        dofs, own = fem.locate_dofs_topological((part, values.function_space), DIM, found)
    values.interpolate(g)
    goal.x.array[dofs] = values.x.array[own]
    fixed.append(dofs)


"#;

const HOLD_WHOLE: &str = r#"

normal = lambda w: [RAVIART_THOMAS]
tangential = lambda w: [NEDELEC]


def hold_whole(part, group, trace, g):
    """Hold the normal or tangential moments of a vector on facets, by projection."""
    own, dofs = (V, np.arange(len(goal.x.array))) if part is V else part.collapse()
    q, v = ufl.TrialFunction(own), TestFunction(own)
    product = lambda a, b: sum(i*j for i, j in zip(trace(a), trace(b)))*ds(group)
    M = petsc.assemble_matrix(fem.form(product(q, v)))
    M.assemble()
    M = scipy.sparse.csr_matrix(M.getValuesCSR()[::-1])
    b = petsc.assemble_vector(fem.form(product(g, v))).array
    found = np.flatnonzero(M.diagonal() > 1e-10*M.diagonal().max())
    dofs = np.asarray(dofs)[found]
    goal.x.array[dofs] = splu(M.tocsc()[found][:, found]).solve(b[found])
    fixed.append(dofs)


"#;

/// The increment, by MUMPS; rows and columns of Dirichlet values are taken out.
const KSP: &str = r#"    A.zeroRowsColumns(held, 1.0, d, r)
    solver = PETSc.KSP().create(mesh.comm)
    solver.setOperators(A)
    solver.setType("preonly")
    solver.getPC().setType("lu")
    solver.getPC().setFactorSolverType("mumps")
    solver.getPC().setFactorSetUpSolverType()
    solver.getPC().getFactorMatrix().setMumpsIcntl(14, 200)  # room to pivot, in percent
    solver.setErrorIfNotConverged(True)
    solver.solve(r, d)
"#;

/// The same with given means.
const BORDERED: &str = r#"    A = scipy.sparse.csr_matrix(A.getValuesCSR()[::-1])
    free = np.setdiff1d(np.arange(len(d.array)), held)
    border = scipy.sparse.csc_matrix(rows[:, free])
    both = scipy.sparse.bmat([[A.tocsc()[free][:, free], border.T], [border, None]], format="csc")
    right = np.concatenate([(r.array - A @ d.array)[free], rows @ TOTAL.x.array - wanted])
    d.array[free] = splu(both).solve(right)[: len(free)]
"#;

const START: &str = r#"

def start(total, part, g):
    """Interpolate the initial value of a part."""
    own, dofs = (V, slice(None)) if part is V else part.collapse()
    values = fem.Function(own)
    values.interpolate(g)
    total.x.array[dofs] = values.x.array


"#;
