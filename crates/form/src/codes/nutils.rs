//! nutils: the form as expressions of NumPy's functions on nutils' arrays, with nutils' own derivative.

use super::Code;
use super::python;
use super::spelling::{Shared, Spelling, Words, comment, measure, shared};
use crate::problem::{Domain, Element, Measure, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// nutils 9.
pub const CODE: Code = Code {
    name: "nutils",
    suffix: "_nutils.py",
    command: &["python3"],
    mesh: ("msh2", "msh"),
    write,
};

/// Names that the frame imports or makes.
pub const RESERVED: &str = "function mesh sample solver types quadrature pointsseq topo geom corners sides marked at hold held spaces bases rule \
    facet_rule total tests first F system free here found nodes degree basis interpolated unknowns part parts cell dofs fields integrand longest nodal nutils tag arguments goal mean0 multiplier0 number";

/// nutils' name of a basis, and its degree.
fn basis(element: Element) -> Result<(&'static str, usize), String> {
    match element {
        Element::Continuous(degree) => Ok(("lagrange", degree.into())),
        Element::Broken(degree) => Ok(("discont", degree.into())),
        other => Err(format!("nutils has no {}", other.name())),
    }
}

/// nutils has `<` and `>` only, and no `np.where`.
fn choice(sign: &str, [a, b, c, d]: &[String; 4]) -> String {
    let (name, yes, no) = match sign {
        "<" => ("less", c, d),
        "<=" => ("greater", d, c),
        ">" => ("greater", c, d),
        _ => ("less", d, c),
    };
    format!("np.choose(np.{name}({a}, {b}).astype(int), [{no}, {yes}])")
}

fn other(name: String, side: Side) -> String {
    match side {
        Side::Minus => format!("function.opposite({name})"),
        _ => name,
    }
}

fn end(problem: &Problem, words: &Words, node: Node) -> String {
    match node {
        Node::Pi => "np.pi".into(),
        // It changes from step to step.
        Node::Parameter(k)
            if problem
                .time
                .as_ref()
                .is_some_and(|time| time.parameter == k) =>
        {
            format!("function.Argument(\"{}\", ())", words.parameters[k])
        }
        Node::Parameter(k) => words.parameters[k].clone(),
        Node::Coordinate(k) => ["x", "y", "z"][k].into(),
        Node::Normal(k, Side::Minus) => format!("(-n[{k}])"),
        Node::Normal(k, _) => format!("n[{k}]"),
        Node::Diameter(side) => other("h".into(), side),
        Node::Leaf(leaf) => {
            let name = words.part(leaf).to_owned();
            let second = |k: usize, l: usize| {
                let twice = format!("function.grad(function.grad({name}, geom), geom)");
                format!("{}[{k}, {l}]", other(twice, leaf.side))
            };
            match (leaf.field, leaf.axis) {
                (Field::Datum(k), _) if problem.data[k].space.is_none() => name,
                (_, None) => other(name, leaf.side),
                (_, Some(k)) if leaf.second.is_some() => second(k, leaf.second.unwrap_or(k)),
                (_, Some(k)) => format!(
                    "{}[{k}]",
                    other(format!("function.grad({name}, geom)"), leaf.side)
                ),
            }
        }
        _ => String::new(),
    }
}

fn write(problem: &mut Problem) -> Result<String, String> {
    let dim = problem.dim;
    let reserved = format!("{} {RESERVED}", python::RESERVED);
    let words = Words::new(problem, &reserved, 0, '_');
    let imports = "from nutils import function, mesh, pointsseq, sample, solver, types\nfrom nutils import points as quadrature\n";
    let mut s = python::top(problem, CODE.suffix, imports, &words);
    let [rule, facet_rule] = problem.rules().map(|rule| python::rule(&rule));
    let residual = problem.residual();
    let problem = &*problem;
    let tags = |of: usize| {
        let all = problem.groups.iter().filter(|group| group.dim == of);
        let tags: Vec<String> = all.map(|group| group.tag.to_string()).collect();
        tags.join(", ")
    };
    s += &FRAME
        .replace("CORNERS", &(dim + 1).to_string())
        .replace("CELLS", &tags(dim))
        .replace("FACETS", &tags(dim - 1));
    let axes = &["x", "y", "z"][..dim];
    s += &format!(
        "{}, = geom\nn = function.normal(geom)\n\n# The quadrature points are given explicitly, so that all codes use the same.\nrule = {}, {}\nfacet_rule = {}, {}\n",
        axes.join(", "),
        rule.0,
        rule.1,
        facet_rule.0,
        facet_rule.1
    );
    if problem.has_diameter() {
        s += "longest = np.linalg.norm(points[cells][:, :, None] - points[cells][:, None], axis=3).max(axis=(1, 2))\n\
              h = function.get(longest, 0, topo.f_index)  # the longest edge of each cell\n";
    }
    let ends = |node: Node| end(problem, &words, node);
    let spelling = Spelling {
        end: &ends,
        call: python::numpy_call,
        power: |base, n| n.after(base, "**"),
        choice,
    };
    let numpy = |id: Id| {
        let parameter = |k: usize| words.parameters[k].clone();
        python::numpy(&problem.scalars, id, ["x", "y", "z"], &parameter)
    };
    let axes = axes.join(", ");
    s += &NODAL.replace("CORNERS", &(dim + 1).to_string());
    for (k, datum) in problem.data.iter().enumerate() {
        for (name, id) in words.parts(Field::Datum(k)).iter().zip(&datum.components) {
            s += &match datum.space {
                None => format!(
                    "{name} = {}\n",
                    spelling.text(&problem.scalars, *id, &Shared::new())
                ),
                Some(of) => {
                    let (kind, degree) = basis(of.element)?;
                    format!(
                        "basis = topo.basis(\"{kind}\", degree={degree})\n{}\n",
                        match problem.time {
                            // Known from step to step.
                            Some(_) => format!(
                                "{name} = basis @ function.Argument(\"of_{name}\", (len(basis),))"
                            ),
                            None => format!(
                                "_, values = nodal(topo, basis, {degree}, lambda {axes}: {})\n{name} = basis @ values",
                                numpy(*id)
                            ),
                        }
                    )
                }
            };
        }
    }
    s += "\nbases = [\n";
    let components = problem.components();
    for (k, _) in &components {
        let (kind, degree) = basis(problem.unknowns[*k].space.element)?;
        s += &format!("    topo.basis(\"{kind}\", degree={degree}),\n");
    }
    let names = |field: fn(usize) -> Field| {
        let each = components
            .iter()
            .map(|(k, c)| words.parts(field(*k))[*c].clone());
        each.collect::<Vec<_>>()
    };
    for _ in &problem.means {
        s += "    function.ones((1,)),  # a multiplier\n";
    }
    let [mut unknowns, mut tests] = [names(Field::Unknown), names(Field::Test)];
    for k in 0..problem.means.len() {
        unknowns.push(format!("multiplier{k}"));
        tests.push(format!("mean{k}"));
    }
    s += &format!(
        "]\nfirst = np.cumsum([0, *map(len, bases)]).tolist()\n\n\ndef fields(name):\n    \"\"\"One function for each basis; all coefficients are in one argument.\"\"\"\n    \
         all = function.Argument(name, (first[-1],))\n    return [basis @ all[i:j] for basis, i, j in zip(bases, first, first[1:])]\n\n\n\
         {}, = fields(\"total\")\n{}, = fields(\"tests\")\n",
        unknowns.join(", "),
        tests.join(", ")
    );
    if problem.time.is_some() {
        // Multipliers of the step before are of no use.
        s += &format!(
            "{}, *_ = fields(\"before\")\n",
            names(Field::Old).join(", ")
        );
    }
    let roots = residual.iter().flat_map(|i| i.terms.values().copied());
    let roots: Vec<Id> = roots.collect();
    let mut known = Shared::new();
    for (id, name) in shared(
        &problem.scalars,
        &roots,
        &mut Words::new(problem, &reserved, 0, '_'),
    ) {
        s += &format!(
            "{name} = {}\n",
            spelling.definition(&problem.scalars, id, &known)
        );
        known.insert(id, name);
    }
    s += "F = 0.0\n";
    for integral in &residual {
        let each = integral.terms.iter().map(|(test, c)| {
            let test: &Leaf = test;
            format!(
                "{}*{}",
                spelling.factor(&problem.scalars, *c, &known),
                ends(Node::Leaf(*test))
            )
        });
        let (parts, rule) = parts(problem, &integral.measure);
        s += &format!(
            "\n# {}\nintegrand = (\n    {}\n)\nfor part in {parts}:\n    F += at(part, *{rule}).integral(integrand*function.J(geom))\n",
            comment(&measure(problem, &integral.measure)),
            each.collect::<Vec<_>>().join("\n    + ")
        );
    }
    for (k, mean) in problem.means.iter().enumerate() {
        let [p, q] = [Field::Unknown, Field::Test].map(|of| words.whole(of(mean.unknown)));
        s += &format!(
            "\n# The mean is held by a multiplier.\nF += at(topo, *rule).integral((multiplier{k}*{q} + ({p} - ({:?}))*mean{k})*function.J(geom))\n",
            mean.value
        );
    }
    s += "\nsystem = solver.System(F, trial=\"total\", test=\"tests\")\nheld, total, goal = np.zeros(first[-1], bool), np.zeros(first[-1]), np.zeros(first[-1])\n";
    let mut solve =
        "# Dirichlet values; where two groups share a dof, the later one counts.\n".to_owned();
    for condition in &problem.conditions {
        let group = &problem.groups[condition.group];
        let within = if group.on == Some(Domain::Interior) {
            "interfaces"
        } else {
            "boundary"
        };
        let at = problem.position(condition.unknown, condition.component);
        let (_, degree) = basis(problem.unknowns[condition.unknown].space.element)?;
        solve += &format!(
            "dofs, values = nodal(topo.{within}[\"g{}\"], bases[{at}], {degree}, lambda {axes}: {})\n\
             held[first[{at}] + dofs], goal[first[{at}] + dofs] = True, values\n",
            group.tag,
            numpy(condition.value)
        );
    }
    match &problem.time {
        None => {
            s += "arguments = {}\n\n";
            s += &(solve + NEWTON);
        }
        Some(time) => {
            s += "\n# Initial values.\n";
            for initial in &time.initial {
                let at = problem.position(initial.unknown, initial.component);
                let (_, degree) = basis(problem.unknowns[initial.unknown].space.element)?;
                s += &format!(
                    "dofs, values = nodal(topo, bases[{at}], {degree}, lambda {axes}: {})\ntotal[first[{at}] + dofs] = values\n",
                    numpy(initial.value)
                );
            }
            let t = &words.parameters[time.parameter];
            let mut again = format!("arguments = {{\"{t}\": {t}, \"before\": total.copy()}}\n");
            for (name, of, id) in words.interpolated(problem) {
                let (kind, degree) = basis(of)?;
                again += &format!(
                    "basis = topo.basis(\"{kind}\", degree={degree})\n_, arguments[\"of_{name}\"] = nodal(topo, basis, {degree}, lambda {axes}: {})\n",
                    numpy(id)
                );
            }
            let clock = |t: &str, dt: &str| format!("{t} = number*{dt}");
            s += &python::steps(time, &words, clock, &again, &(solve + NEWTON));
        }
    }
    let (nodes, kind) = python::nodes(problem.output(), dim)?;
    let nodes: Vec<String> = nodes
        .iter()
        .map(|node| format!("{:?}", &node[1..]))
        .collect();
    s += &format!(
        "\n# The values at the nodes of VTK's cells.\nnodes = at(topo, [{}], [1.0]*{})\n\n\ndef values(*parts):\n    \
         found = [nodes.eval(part, arguments={{\"total\": total}}).reshape(len(cells), {}) for part in parts]\n    return np.stack(found, axis=2)\n\n\n\
         at = np.pad(values({axes}), ((0, 0), (0, 0), (0, {})))\n",
        nodes.join(", "),
        nodes.len(),
        nodes.len(),
        3 - dim
    );
    let values = problem.unknowns.iter().enumerate().map(|(k, u)| {
        let parts = words.parts(Field::Unknown(k)).join(", ");
        (u.name.clone(), format!("values({parts})"))
    });
    Ok(s + &python::bottom(problem.output(), kind, &values.collect::<Vec<_>>()))
}

/// The parts of the mesh that a measure is on, and the name of the rule there.
fn parts(problem: &Problem, measure: &Measure) -> (String, &'static str) {
    let (of, rule) = match measure.domain {
        Domain::Cells => ("topo", "rule"),
        Domain::Boundary => ("topo.boundary", "facet_rule"),
        Domain::Interior => ("topo.interfaces", "facet_rule"),
    };
    let groups = measure.groups.iter();
    let each: Vec<String> = groups
        .map(|k| format!("{of}[\"g{}\"]", problem.groups[*k].tag))
        .collect();
    match each.is_empty() {
        true => (format!("[{of}]"), rule),
        false => (format!("[{}]", each.join(", ")), rule),
    }
}

const FRAME: &str = r#"
corners = np.sort(cells, axis=1)
sides = {tuple(np.delete(cell, j)): (i, j) for i, cell in enumerate(corners.tolist()) for j in range(CORNERS)}
marked = np.array([sides[tuple(sorted(vertices))] for vertices in facets.tolist()])
topo, geom = mesh.simplex(
    corners,
    corners,
    points,
    {f"g{tag}": np.flatnonzero(regions == tag) for tag in [CELLS]},
    {f"g{tag}": marked[labels == tag] for tag in [FACETS]},
    {},
)


def at(part, places, weights):
    """The quadrature points in each cell or facet of a part of the mesh."""
    rule = quadrature.CoordsWeightsPoints(types.arraydata(np.array(places)), types.arraydata(np.array(weights)))
    everywhere = pointsseq.PointsSequence.uniform(rule, len(part))
    return sample.Sample.new(part.space, (part.transforms, part.opposites), everywhere)


"#;

const NODAL: &str = r#"

def nodal(part, basis, degree, g):
    """The dofs of the nodes on a part of the mesh, and the values of g there."""
    nodes = part.sample("bezier", degree + 1) if degree else at(part, [[1/CORNERS]*(CORNERS - 1)], [1.0])
    dofs, first = np.unique(nodes.eval(basis).argmax(axis=1), return_index=True)
    return dofs, g(*nodes.eval(geom)[first].T)


"#;

const NEWTON: &str = r#"
# Newton's method. Dirichlet values come in by its first increment; a linear form takes one step, and a second one confirms it.
free = ~held
for step in range(30):
    r = system.assemble_residual({"total": total, **arguments})
    A = system.assemble_jacobian({"total": total, **arguments})
    d = np.where(held, total - goal, 0.0)
    d[free] = A.submatrix(free, free).solve((r - A @ d)[free])
    total -= d
    if abs(d).max(initial=0) <= 1e-10*abs(total).max():
        break
else:
    sys.exit("Newton's method did not converge.")
"#;
