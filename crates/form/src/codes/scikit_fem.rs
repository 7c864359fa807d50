//! scikit-fem: the form as functions of NumPy arrays, in scalars, with our derivative.

use super::Code;
use super::python;
use super::spelling::{Shared, Spelling, Words, comment, measure, shared, traces};
use crate::problem::{Domain, Element, Problem, Unknown};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// scikit-fem, from release 8 on.
pub const CODE: Code = Code {
    name: "scikit-fem",
    suffix: "_skfem.py",
    command: &["python3"],
    mesh: ("msh2", "msh"),
    script: super::Script::Own(write),
};

/// Names that the frame imports or makes.
pub const RESERVED: &str = "skfem mesh here element basis w rule facet_rule nodes at boundary fixed diameter splu bases values total free facets_of \
    BilinearForm LinearForm Basis FacetBasis InteriorFacetBasis interpolated where held hold found given residual derivative scipy asm sides other number goal before bent part rows wanted hold_whole of_element";

fn element(unknown: &Unknown, dim: usize, bends: bool) -> Result<String, String> {
    let cell = if dim == 2 { "Tri" } else { "Tet" };
    let lagrange = |degree| match bends && degree > 1 {
        true => format!("bent(skfem.Element{cell}P{degree})"),
        false => format!("skfem.Element{cell}P{degree}()"),
    };
    let name = match unknown.space.element {
        Element::Continuous(3) if dim == 3 => {
            return Err("scikit-fem has no P3 on tetrahedra".into());
        }
        Element::Continuous(degree) => lagrange(degree),
        Element::Broken(0) => format!("skfem.Element{cell}P0()"),
        Element::Broken(degree) => format!("skfem.ElementDG({})", lagrange(degree)),
        Element::RaviartThomas => return Ok(format!("skfem.Element{cell}RT0()")),
        Element::Nedelec if dim == 2 => return Ok("skfem.ElementTriN1()".into()),
        Element::Nedelec => return Ok("skfem.ElementTetN0()".into()),
        Element::CrouzeixRaviart => format!("skfem.Element{cell}CR()"),
    };
    Ok(match unknown.space.size {
        None => name,
        Some(size) => format!("skfem.ElementVector({name}, {size})"),
    })
}

/// The sides of a measure: those of interior facets, or the only one.
fn sides(domain: Domain) -> &'static [Side] {
    match domain {
        Domain::Interior => &[Side::Plus, Side::Minus],
        _ => &[Side::Here],
    }
}

fn mark(side: Side) -> &'static str {
    match side {
        Side::Here => "",
        Side::Plus => "_plus",
        Side::Minus => "_minus",
    }
}

fn end(problem: &Problem, words: &Words, node: Node) -> String {
    match node {
        Node::Pi => "np.pi".into(),
        Node::Parameter(k) => words.parameters[k].clone(),
        Node::Coordinate(k) => ["x", "y", "z"][k].into(),
        Node::Normal(k, Side::Minus) => format!("(-n[{k}])"),
        Node::Normal(k, _) => format!("n[{k}]"),
        Node::Diameter(side) => format!("w.h{}", mark(side)),
        Node::Leaf(Leaf {
            field: Field::Datum(k),
            ..
        }) if problem.data[k].space.is_none() => {
            let Node::Leaf(leaf) = node else {
                return String::new();
            };
            format!(
                "{}({})",
                words.part(leaf),
                ["x", "y", "z"][..problem.dim].join(", ")
            )
        }
        Node::Leaf(leaf) => {
            let element = match leaf.field {
                Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k) => {
                    Some(problem.unknowns[k].space.element)
                }
                Field::Datum(_) => None,
            };
            let (name, size) = match leaf.field {
                Field::Datum(_) => (format!("w.{}{}", words.part(leaf), mark(leaf.side)), None),
                Field::Unknown(k) | Field::Old(k) => (
                    format!("{}{}", words.whole(leaf.field), mark(leaf.side)),
                    problem.unknowns[k].space.size,
                ),
                Field::Test(k) | Field::Increment(k) => (
                    words.whole(leaf.field).to_owned(),
                    problem.unknowns[k].space.size,
                ),
            };
            let of = match size {
                None => String::new(),
                Some(_) => format!("{}, ", leaf.component),
            };
            match (leaf.axis, leaf.second, element) {
                (None, ..) if size.is_none() => name,
                (None, ..) => format!("{name}[{}]", leaf.component),
                (Some(_), _, Some(Element::RaviartThomas)) => {
                    format!("({name}.div/{})", problem.dim)
                }
                // The only slopes are half the components of the curl.
                (Some(_), _, Some(Element::Nedelec)) if problem.dim == 2 => {
                    format!("({name}.curl/2)")
                }
                (Some(axis), _, Some(Element::Nedelec)) => {
                    format!("({name}.curl[{}]/2)", 3 - axis - leaf.component)
                }
                (Some(axis), None, _) => format!("{name}.grad[{of}{axis}]"),
                (Some(axis), Some(second), _) => format!("{name}.hess[{of}{axis}, {second}]"),
            }
        }
        _ => String::new(),
    }
}

fn write(problem: &mut Problem) -> Result<String, String> {
    let dim = problem.dim;
    let words = Words::new(problem, &format!("{} {RESERVED}", python::RESERVED), 0, '_');
    let bends = problem.has_second();
    let imports = match problem.means.is_empty() {
        true => "import skfem\nfrom scipy.sparse.linalg import splu",
        false => "import scipy.sparse\nimport skfem\nfrom scipy.sparse.linalg import splu",
    };
    let elements = problem
        .unknowns
        .iter()
        .map(|u| element(u, dim, bends))
        .collect::<Result<Vec<_>, _>>()?;
    let mut s = python::top(problem, CODE.suffix, imports, &words);
    let axes = &["x", "y", "z"][..dim];
    let parameters = words.parameters.clone();
    let numpy = |problem: &Problem, id: Id| {
        python::numpy(&problem.scalars, id, ["x", "y", "z"], &|k| {
            parameters[k].clone()
        })
    };
    let [rule, facet_rule] = problem.rules().map(|rule| python::rule(&rule));
    let array =
        |(points, weights): (String, String)| format!("np.array({points}).T, np.array({weights})");
    let cell = if dim == 2 { "Tri" } else { "Tet" };
    if bends {
        s += BENT;
    }
    s += &format!(
        "mesh = skfem.Mesh{cell}(points.T.copy(), cells.T.copy())\n\
         element = {}\n\n# The quadrature points are given explicitly, so that all codes use the same.\nrule = {}\nfacet_rule = {}\n\n\
         number = {{tuple(vertices): i for i, vertices in enumerate(np.sort(mesh.facets, axis=0).T.tolist())}}\n\
         boundary = np.array([number[tuple(sorted(vertices))] for vertices in facets.tolist()])\n\
         diameter = np.max([np.linalg.norm(mesh.p[:, mesh.t[i]] - mesh.p[:, mesh.t[j]], axis=0) for i in range({}) for j in range(i)], axis=0)\n",
        elements.join(" * "),
        array(rule),
        array(facet_rule),
        dim + 1
    );
    for (k, datum) in problem.data.iter().enumerate() {
        for (name, id) in words.parts(Field::Datum(k)).iter().zip(&datum.components) {
            s += &format!(
                "\n\ndef {name}({}):\n    return {}\n",
                axes.join(", "),
                numpy(problem, *id)
            );
        }
    }

    let residual = problem.residual();
    let jacobian: Vec<_> = residual
        .iter()
        .map(|integral| problem.derivative(integral))
        .collect();
    let names: Vec<String> = (0..problem.unknowns.len())
        .map(|k| words.whole(Field::Unknown(k)).to_owned())
        .collect();
    let list = |field: fn(usize) -> Field| {
        let each = (0..problem.unknowns.len()).map(|k| words.whole(field(k)).to_owned());
        each.collect::<Vec<_>>().join(", ")
    };
    let (tests, increments) = (list(Field::Test), list(Field::Increment));
    let olds: Vec<String> = match problem.time {
        Some(_) => (0..problem.unknowns.len())
            .map(|k| words.whole(Field::Old(k)).to_owned())
            .collect(),
        None => Vec::new(),
    };
    let interpolated = words.interpolated(problem);
    let mut calls = [Vec::new(), Vec::new()];
    for (i, (integral, by)) in residual.iter().zip(&jacobian).enumerate() {
        let roots: Vec<Id> = integral
            .terms
            .values()
            .chain(by.values())
            .copied()
            .collect();
        let used = Words::new(problem, &format!("{} {RESERVED}", python::RESERVED), 0, '_');
        let ends = |node: Node| end(problem, &used, node);
        let spelling = Spelling {
            end: &ends,
            call: python::numpy_call,
            power: |base, n| n.after(base, "**"),
            choice: python::numpy_choice,
        };
        let mut fresh = Words::new(problem, &format!("{} {RESERVED}", python::RESERVED), 0, '_');
        let found = shared(&problem.scalars, &roots, &mut fresh);
        let body = |products: Vec<(Id, Vec<Leaf>)>| {
            let needed = problem.scalars.nodes_of(products.iter().map(|(c, _)| *c));
            let mut known = Shared::new();
            let mut text = format!("    {}, = w.x\n", axes.join(", "));
            if needed
                .iter()
                .any(|id| matches!(problem.scalars.node(*id), Node::Normal(..)))
            {
                text += "    n = w.n\n";
            }
            let fields = names
                .iter()
                .enumerate()
                .map(|(k, name)| (Field::Unknown(k), name));
            let before = olds
                .iter()
                .enumerate()
                .map(|(k, name)| (Field::Old(k), name));
            for (field, name) in fields.chain(before) {
                for side in sides(integral.measure.domain) {
                    let is_used = needed.iter().any(
                        |id| matches!(problem.scalars.node(*id), Node::Leaf(l) if l.field == field),
                    );
                    if is_used {
                        text += &format!("    {name}{0} = w.{name}{0}\n", mark(*side));
                    }
                }
            }
            for (id, name) in &found {
                if needed.contains(id) {
                    text += &format!(
                        "    {name} = {}\n",
                        spelling.definition(&problem.scalars, *id, &known)
                    );
                    known.insert(*id, name.clone());
                }
            }
            let each = products.iter().map(|(c, leaves)| {
                let ends = leaves
                    .iter()
                    .map(|leaf| (spelling.end)(Node::Leaf(*leaf)))
                    .collect::<Vec<_>>()
                    .join("*");
                match problem.scalars.number_of(*c) {
                    Some(1.0) => ends,
                    Some(-1.0) => format!("-{ends}"),
                    _ => format!("{}*{ends}", spelling.factor(&problem.scalars, *c, &known)),
                }
            });
            let sum = each
                .collect::<Vec<_>>()
                .join("\n        + ")
                .replace("+ -", "- ");
            format!("{text}    return (\n        {sum}\n    )\n")
        };
        let title = measure(problem, &integral.measure);
        let all = sides(integral.measure.domain);
        let (here, bases) = match integral.measure.domain {
            Domain::Cells => (
                format!(
                    "skfem.Basis(mesh, element, quadrature=rule{})",
                    groups(problem, &integral.measure.groups, "elements", "regions")
                ),
                1,
            ),
            Domain::Boundary if integral.measure.groups.is_empty() => (
                "skfem.FacetBasis(mesh, element, quadrature=facet_rule)".into(),
                1,
            ),
            Domain::Boundary => (
                format!(
                    "skfem.FacetBasis(mesh, element, quadrature=facet_rule{})",
                    groups(problem, &integral.measure.groups, "facets", "labels")
                ),
                1,
            ),
            Domain::Interior => (
                format!(
                    "skfem.InteriorFacetBasis(mesh, element, quadrature=facet_rule{}, side=SIDE)",
                    groups(problem, &integral.measure.groups, "facets", "labels")
                ),
                2,
            ),
        };
        s += &format!("\n\n# {}\n", comment(&title));
        if bases == 1 {
            s += &format!("basis{i} = {here}\n");
        } else {
            s += &format!("basis{i}_plus, basis{i}_minus = ({here} for other in (0, 1))\n")
                .replace("SIDE", "other");
        }
        for test in all {
            let linear: Vec<_> = integral
                .terms
                .iter()
                .filter(|(leaf, _)| leaf.side == *test)
                .map(|(leaf, c)| (*c, vec![*leaf]))
                .collect();
            if !linear.is_empty() {
                let name = format!("residual{i}{}", mark(*test));
                s += &format!(
                    "\n\n@skfem.LinearForm\ndef {name}({tests}, w):\n{}",
                    body(linear)
                );
                calls[0].push(format!(
                    "{name}.assemble(basis{i}{}, **given{i})",
                    mark(*test)
                ));
            }
            for trial in all {
                let of_both: Vec<_> = by
                    .iter()
                    .filter(|((t, d), _)| t.side == *test && d.side == *trial)
                    .map(|((t, d), c)| (*c, vec![*d, *t]))
                    .collect();
                if !of_both.is_empty() {
                    let name = format!("derivative{i}{}{}", mark(*trial), mark(*test));
                    s += &format!(
                        "\n\n@skfem.BilinearForm\ndef {name}({increments}, {tests}, w):\n{}",
                        body(of_both)
                    );
                    calls[1].push(format!(
                        "{name}.assemble(basis{i}{}, basis{i}{}, **given{i})",
                        mark(*trial),
                        mark(*test)
                    ));
                }
            }
        }
    }
    s += "\n\nbasis = skfem.Basis(mesh, element, quadrature=rule)\ntotal = basis.zeros()\n";
    if !olds.is_empty() {
        s += "before = basis.zeros()\n";
    }
    if !interpolated.is_empty() {
        s += OF_ELEMENT;
    }
    // What the forms are given: the unknowns and data at the points of each basis.
    s += "\n\ndef given(basis, mark=\"\"):\n    \"\"\"The unknowns and data at the points of a basis.\"\"\"\n    of_cells = diameter[basis.tind if hasattr(basis, \"tind\") and basis.tind is not None else slice(None)]\n";
    let dict = |names: &[String], of: &str| match names {
        [one] => format!("{{\"{one}\" + mark: basis.interpolate({of})}}"),
        _ => format!(
            "dict(zip([name + mark for name in ({})], basis.interpolate({of})))",
            names
                .iter()
                .map(|n| format!("\"{n}\""))
                .collect::<Vec<_>>()
                .join(", ")
        ),
    };
    s += &format!("    all = {}\n", dict(&names, "total"));
    if !olds.is_empty() {
        s += &format!("    all.update({})\n", dict(&olds, "before"));
    }
    for (name, element, _) in &interpolated {
        let degree = element.degree();
        s += &format!(
            "    own = of_element(basis, skfem.Element{cell}P{degree}(), mark)\n    all[\"{name}\" + mark] = own.interpolate({name}(*own.doflocs))\n"
        );
    }
    s += "    return {**all, \"h\" + mark: of_cells[:, None] + 0*basis.dx}\n";
    s += "\n\n# Dirichlet values; where two groups share a dof, the later one counts.\nheld, goal = np.zeros(basis.N, bool), basis.zeros()\n";
    let part = |k: usize, c: Option<usize>| {
        let part = match problem.unknowns.len() {
            1 => "np.arange(basis.N)".to_owned(),
            _ => format!("basis.split_indices()[{k}]"),
        };
        match (c, problem.unknowns[k].space.size) {
            (Some(c), Some(size)) => format!("{part}[{c}::{size}]"),
            _ => part,
        }
    };
    let conditions = problem.held();
    let list = |values: &[Id]| {
        let each = values.iter().map(|id| numpy(problem, *id));
        match values {
            [_] => each.collect::<String>(),
            _ => format!("[{}]", each.collect::<Vec<_>>().join(", ")),
        }
    };
    if conditions.iter().any(|c| c.component.is_some()) {
        s += HOLD;
    }
    let mut solve = String::new();
    for condition in &conditions {
        let unknown = &problem.unknowns[condition.unknown];
        let whole = match condition.component {
            Some(_) => String::new(),
            None => {
                let n: Vec<String> = (0..dim).map(|k| format!("n[{k}]")).collect();
                let u: Vec<String> = (0..dim).map(|k| format!("u[{k}]")).collect();
                let trace = traces(unknown.space.element, &u, &n).join(", ");
                if !s.contains("def hold_whole of_element") {
                    s += HOLD_WHOLE;
                }
                format!(
                    ", {}, lambda u, n: [{trace}]",
                    element(unknown, dim, false)?
                )
            }
        };
        solve += &format!(
            "hold{}({}, {}{whole}, lambda {}: {})\n",
            if whole.is_empty() { "" } else { "_whole" },
            problem.groups[condition.group].tag,
            part(condition.unknown, condition.component),
            axes.join(", "),
            list(&condition.values)
        );
    }
    let [vectors, matrices] = calls.map(|all| all.join("\n        + "));
    let mut step =
        "    d[free] = splu(A.tocsc()[free][:, free]).solve((r - A @ d)[free])\n".to_owned();
    if !problem.means.is_empty() {
        let rows: Vec<String> = problem
            .means
            .iter()
            .map(|mean| {
                let test = words.whole(Field::Test(mean.unknown));
                format!("skfem.LinearForm(lambda {tests}, w: {test} + 0*w.x[0]).assemble(basis)")
            })
            .collect();
        let values: Vec<String> = problem
            .means
            .iter()
            .map(|m| format!("{:?}", m.value))
            .collect();
        s += &format!(
            "\n# The means are held by multipliers: the product of a row with dofs is the integral.\nrows = np.array([{}])\nwanted = basis.dx.sum()*np.array([{}])\n",
            rows.join(", "),
            values.join(", ")
        );
        step = python::BORDERED.to_owned();
    }
    let mut newton = "\n# Newton's method. Dirichlet values come in by its first increment; a linear form takes one step, and a second one confirms it.\nfree = ~held\nfor step in range(30):\n".to_owned();
    for (i, integral) in residual.iter().enumerate() {
        newton += &match integral.measure.domain {
            Domain::Interior => format!(
                "    given{i} = {{**given(basis{i}_plus, \"_plus\"), **given(basis{i}_minus, \"_minus\")}}\n"
            ),
            _ => format!("    given{i} = given(basis{i})\n"),
        };
    }
    newton += &format!(
        "    r = (\n        {vectors}\n    )\n    A = (\n        {matrices}\n    )\n    d = np.where(held, total - goal, 0.0)\n{step}    total -= d\n    \
         if abs(d).max(initial=0) <= 1e-10*abs(total).max():\n        break\nelse:\n    sys.exit(\"Newton's method did not converge.\")\n"
    );
    solve += &newton;
    match &problem.time {
        None => s += &solve,
        Some(time) => {
            s += "\n# Initial values.\n";
            for initial in &time.initial {
                s += &format!(
                    "part = {}\ntotal[part] = (lambda {}: {})(*basis.doflocs[:, part])\n",
                    part(initial.unknown, Some(initial.component)),
                    axes.join(", "),
                    numpy(problem, initial.value)
                );
            }
            s += &python::steps(
                time,
                &words,
                |t, dt| format!("{t} = number*{dt}"),
                "before[:] = total\n",
                &solve,
            );
        }
    }
    let (nodes, kind) = python::nodes(problem.output(), dim)?;
    let nodes: Vec<String> = nodes
        .iter()
        .map(|node| format!("{:?}", &node[1..]))
        .collect();
    s += &format!(
        "\n# The values at the nodes of VTK's cells.\nnodes = np.array([{}]).T\nat = np.moveaxis(mesh.mapping().F(nodes), 0, 2)\nat = np.pad(at, ((0, 0), (0, 0), (0, {})))\n\
         found = skfem.Basis(mesh, element, quadrature=(nodes, np.ones(nodes.shape[1]))).interpolate(total)\n",
        nodes.join(", "),
        3 - dim
    );
    let values = problem.unknowns.iter().enumerate().map(|(k, u)| {
        let found = if names.len() == 1 {
            "found".to_owned()
        } else {
            format!("found[{k}]")
        };
        let value = match u.space.size {
            None => format!("np.asarray({found})"),
            Some(_) => format!("np.moveaxis(np.asarray({found}), 0, 2)"),
        };
        (u.name.clone(), value)
    });
    Ok(s + &python::bottom(problem.output(), kind, &values.collect::<Vec<_>>()))
}

/// The argument that names the cells or facets of some groups.
fn groups(problem: &Problem, groups: &[usize], name: &str, marks: &str) -> String {
    if groups.is_empty() {
        return String::new();
    }
    let tags: Vec<String> = groups
        .iter()
        .map(|k| problem.groups[*k].tag.to_string())
        .collect();
    let chosen = format!("np.isin({marks}, [{}])", tags.join(", "));
    match name {
        "elements" => format!(", elements=np.flatnonzero({chosen})"),
        _ => format!(", facets=boundary[{chosen}]"),
    }
}

/// `with_element` of scikit-fem 12 forgets the side.
const OF_ELEMENT: &str = r#"

def of_element(basis, element, mark):
    """The basis of another element at the same points."""
    if not mark:
        return basis.with_element(element)
    return skfem.InteriorFacetBasis(mesh, element, quadrature=basis.quadrature, facets=basis.find, side=int(mark == "_minus"))

"#;

const HOLD: &str = r#"

def hold(group, part, g):
    found = basis.get_dofs(facets=boundary[labels == group]).flatten()
    dofs = found[np.isin(found, part)]
    held[dofs] = True
    goal[dofs] = g(*basis.doflocs[:, dofs])


"#;

const HOLD_WHOLE: &str = r#"

def hold_whole(group, part, element, trace, g):
    """Hold the normal or tangential moments of a vector on facets, by projection."""
    own = skfem.FacetBasis(mesh, element, facets=boundary[labels == group], quadrature=facet_rule)
    product = lambda u, v, n: sum(a*b for a, b in zip(trace(u, n), trace(v, n)))
    M = skfem.BilinearForm(lambda u, v, w: product(u, v, w.n)).assemble(own)
    b = skfem.LinearForm(lambda v, w: product(g(*w.x), v, w.n)).assemble(own)
    found = np.flatnonzero(M.diagonal() > 1e-10*M.diagonal().max())
    held[part[found]] = True
    goal[part[found]] = splu(M.tocsc()[found][:, found]).solve(b[found])


"#;

/// Lagrange elements with second derivatives.
const BENT: &str = r#"

def bent(kind):
    """An element with second derivatives, by central differences, which are exact for slopes that are quadratic."""

    class Bent(kind):
        def gbasis(self, mapping, X, i, tind=None):
            field, = super().gbasis(mapping, X, i, tind)
            slope = lambda X: np.asarray(self.lbasis(X, i)[1]) + 0*X
            shift = np.eye(len(X)).reshape(len(X), len(X), *[1]*(X.ndim - 1))
            own = np.array([slope(X + e) - slope(X - e) for e in shift])/2
            own = own if X.ndim == 3 else own[:, :, None]
            inverse = mapping.invDF(X, tind)
            own = np.broadcast_to(own, (*own.shape[:2], *inverse.shape[2:]))
            field.hess = np.einsum("abek,aiek,bjek->ijek", own, inverse, inverse)
            return field,

    return Bent()


"#;
