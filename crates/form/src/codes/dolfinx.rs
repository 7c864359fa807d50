//! dolfinx: the form in UFL as it was written, with UFL's own derivative; releases from 0.5 on.

use faceoff_fem::scene::expression::syntax::Term;

use super::Code;
use super::python;
use super::spelling::Words;
use super::ufl::ufl;
use crate::problem::{Domain, Element, Problem, Unknown};
use crate::scalar::{Field, Id, Node};

/// dolfinx in the system's Python, where packages of Linux distributions put it.
pub const CODE: Code = Code {
    name: "dolfinx",
    suffix: "_dolfinx.py",
    command: &["/usr/bin/python3"],
    mesh: ("msh2", "msh"),
    write,
};

/// Names that the frame imports or makes.
pub const RESERVED: &str = "CellDiameter FacetNormal Measure SpatialCoordinate TestFunction TestFunctions derivative lines mpi4py parts petsc4py MPI PETSc basix dolfinx fem io petsc ufl mesh marked here V W F J dx ds dS md fixed hold element space spaces bcs solver \
    grad div curl dot inner outer cross sym skew dev tr det inv cofac transpose Identity jump avg conditional lt le gt ge max_value min_value \
    sin cos tan asin acos atan atan2 sinh cosh tanh exp ln sqrt sign as_tensor split graph old facet_tags cell_tags function at nodes cell rank w";

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
        Some(size) => format!("element({family}, {size})"),
    }
}

fn write(problem: &mut Problem) -> Result<String, String> {
    let dim = problem.dim;
    let words = Words::new(problem, &format!("{} {RESERVED}", python::RESERVED), 0, '_');
    let imports = "import basix\nimport dolfinx\nimport ufl\nfrom dolfinx import fem, graph, io\nfrom dolfinx.fem import petsc\nfrom mpi4py import MPI\nfrom petsc4py import PETSc\n\
        from ufl import (\n    CellDiameter, FacetNormal, Identity, Measure, SpatialCoordinate, TestFunction, TestFunctions, acos, as_tensor, asin, atan, avg,\n    \
        conditional, cos, cosh, cross, curl, derivative, det, dev, div, dot, exp, ge, grad, gt, inner, inv, jump, le, ln, lt, max_value,\n    \
        min_value, outer, pi, sign, sin, sinh, skew, sqrt, sym, tan, tanh, tr, transpose,\n)";
    let mut s = python::top(problem, CODE.suffix, imports, &words);
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
    let domains: Vec<Domain> = problem.integrals.iter().map(|i| i.measure.domain).collect();
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
    if uses("atan2") {
        s += "atan2 = getattr(ufl, \"atan2\", None) or ufl.atan_2\n";
    }
    s += "x = SpatialCoordinate(mesh)\n";
    if problem.form.0.contains('n') {
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
                    Some(value) => format!("fem.Constant(mesh, PETSc.ScalarType({value:?}))"),
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
            (*one).to_owned()
        }
        _ => {
            s += &format!(
                "\nparts = [{}]\nV = space(mesh, ufl.MixedElement(parts) if old else basix.ufl.mixed_element(parts))\nw = fem.Function(V)\n{} = ufl.split(w)\n{} = TestFunctions(V)\n",
                elements.join(", "),
                names.join(", "),
                tests.join(", ")
            );
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
    s += &format!(
        "\n# Dirichlet values; where two groups share a dof, the later one counts.\nfixed, bcs = [], []\n\n\n\
         def hold(part, group, g):\n    found = facet_tags.find(group)\n    if part is V:\n        dofs = fem.locate_dofs_topological(V, {0}, found)\n        \
         values = fem.Function(V)\n        own = dofs\n    else:\n        values = fem.Function(part.collapse()[0])\n        \
         dofs, own = fem.locate_dofs_topological((part, values.function_space), {0}, found)\n    values.interpolate(g)\n    \
         {all}.x.array[dofs] = values.x.array[own]\n    fixed.append(dofs)\n    \
         bcs.append(fem.dirichletbc(values, dofs) if part is V else fem.dirichletbc(values, [dofs, own], part))\n\n\n",
        dim - 1
    );
    for condition in &problem.conditions {
        let mut part = "V".to_owned();
        if problem.unknowns.len() > 1 {
            part += &format!(".sub({})", condition.unknown);
        }
        if problem.unknowns[condition.unknown].space.size.is_some() {
            part += &format!(".sub({})", condition.component);
        }
        let value = at_points(problem, &words, condition.value);
        s += &format!(
            "hold({part}, {}, lambda x: {value})\n",
            problem.groups[condition.group].tag
        );
    }
    s += &format!(
        "fixed = np.concatenate([*fixed, []]).astype(int)\n\n# Newton's method, from 0 with these values. A linear form takes one step, and a second one confirms it.\nF, J = fem.form(F), fem.form(J)\n\
         for step in range(30):\n    A = petsc.assemble_matrix(J, bcs=bcs)\n    A.assemble()\n    r = petsc.assemble_vector(F)\n    r.array[fixed] = 0\n    \
         solver = PETSc.KSP().create(mesh.comm)\n    solver.setOperators(A)\n    solver.setType(\"preonly\")\n    solver.getPC().setType(\"lu\")\n    solver.getPC().setFactorSolverType(\"mumps\")\n    solver.setErrorIfNotConverged(True)\n    \
         d = A.createVecRight()\n    solver.solve(r, d)\n    {all}.x.array[:] -= d.array\n    \
         if abs(d.array).max() <= 1e-10*abs({all}.x.array).max():\n        break\nelse:\n    sys.exit(\"Newton's method did not converge.\")\n\n\n"
    );
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
    Ok(s + python::bottom(problem.output(), kind, &values).trim_start_matches('\n'))
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
