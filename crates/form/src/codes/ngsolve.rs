//! NGSolve: the form as coefficient functions of scalar trial and test functions, with NGSolve's own derivative.

use faceoff_fem::scene::expression::Function;

use super::Code;
use super::python;
use super::spelling::{Exponent, Shared, Spelling, Words, shared, traces};
use crate::problem::{Domain, Element, Integral, Measure, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// NGSolve 6.2, without its user interface.
pub const CODE: Code = Code {
    name: "ngsolve",
    suffix: "_ngsolve.py",
    command: &["python3"],
    mesh: ("msh2", "msh"),
    script: super::Script::Own(write),
};

/// Names that the frame imports or makes.
pub const RESERVED: &str = "ngsolve netgen mesh here descriptor grid groups inside label mapped point where known V W a b J u_ gf between found hold free nodes at values rule facet_rule number names CF IfPos sin cos tan exp log \
    sqrt atan atan2 asin acos sinh cosh grad ds dx specialcf TRIG SEGM TET BND VOL Mesh H1 L2 FESpace BilinearForm GridFunction total e t space inverse curl div goal before mean0 multiplier0 hold_whole normal tangential";

fn space(element: Element, dim: usize, held: &str, jumps: bool) -> Result<String, String> {
    let more = format!("{held}{}", if jumps { ", dgjumps=True" } else { "" });
    Ok(match element {
        Element::Continuous(degree) => format!("ngsolve.H1(mesh, order={degree}{more})"),
        Element::Broken(degree) => format!("ngsolve.L2(mesh, order={degree}{more})"),
        Element::CrouzeixRaviart if dim == 2 => {
            format!("ngsolve.FESpace(\"nonconforming\", mesh, order=1{more})")
        }
        Element::CrouzeixRaviart => {
            return Err("NGSolve has Crouzeix-Raviart elements on triangles only".into());
        }
        Element::RaviartThomas => format!("ngsolve.HDiv(mesh, order=0, RT=True{more})"),
        Element::Nedelec => format!("ngsolve.HCurl(mesh, order=0, type1=True{more})"),
    })
}

fn call(function: Function, arguments: &[String]) -> String {
    let all = arguments.join(", ");
    match (function, arguments) {
        (Function::Max, [a, b]) => format!("IfPos({a} - ({b}), {a}, {b})"),
        (Function::Min, [a, b]) => format!("IfPos({a} - ({b}), {b}, {a})"),
        (Function::Abs, [a, ..]) => format!("IfPos({a}, {a}, -({a}))"),
        (Function::Tanh, [a, ..]) => format!("(sinh({a})/cosh({a}))"),
        _ => format!("{}({all})", function.names()[0]),
    }
}

/// NGSolve differentiates powers by the logarithm, which negative bases do not have, unless the exponent is a positive integer.
fn power(base: &str, exponent: &Exponent) -> String {
    match exponent {
        Exponent::Integer(n) if *n < 0 => format!("(1.0/{base}**{})", -n),
        _ => exponent.after(base, "**"),
    }
}

/// `IfPos(a, b, c)` is b where a > 0.
fn choice(sign: &str, [a, b, c, d]: &[String; 4]) -> String {
    match sign {
        "<" => format!("IfPos({b} - ({a}), {c}, {d})"),
        "<=" => format!("IfPos({a} - ({b}), {d}, {c})"),
        ">" => format!("IfPos({a} - ({b}), {c}, {d})"),
        _ => format!("IfPos({b} - ({a}), {d}, {c})"),
    }
}

fn other(name: String, side: Side) -> String {
    match side {
        Side::Minus => format!("{name}.Other()"),
        _ => name,
    }
}

fn end(problem: &Problem, words: &Words, node: Node) -> String {
    match node {
        Node::Pi => "np.pi".into(),
        Node::Parameter(k) => words.parameters[k].clone(),
        Node::Coordinate(k) => ["x", "y", "z"][k].into(),
        Node::Normal(k, Side::Minus) => format!("(-n[{k}])"),
        Node::Normal(k, _) => format!("n[{k}]"),
        Node::Diameter(side) => other("h".into(), side),
        Node::Leaf(leaf) => {
            let is_formula =
                matches!(leaf.field, Field::Datum(k) if problem.data[k].space.is_none());
            match leaf.field {
                _ if is_formula => words.part(leaf).to_owned(),
                _ => slope(problem, function(problem, words, leaf), leaf),
            }
        }
        _ => String::new(),
    }
}

/// The name of the scalar function, or of that of vectors, that a leaf is a part of.
fn function<'a>(problem: &Problem, words: &'a Words, leaf: Leaf) -> &'a str {
    match leaf.field {
        Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k)
            if problem.unknowns[k].space.element.is_vector() =>
        {
            words.whole(leaf.field)
        }
        _ => words.part(leaf),
    }
}

/// The value or derivative of a function that a leaf stands for.
fn slope(problem: &Problem, name: &str, leaf: Leaf) -> String {
    let element = match leaf.field {
        Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k) => {
            Some(problem.unknowns[k].space.element)
        }
        Field::Datum(_) => None,
    };
    let sided = |text: String| other(text, leaf.side);
    match (leaf.axis, leaf.second, element) {
        (None, _, Some(element)) if element.is_vector() => {
            format!("{}[{}]", sided(name.to_owned()), leaf.component)
        }
        (None, ..) => sided(name.to_owned()),
        (Some(_), _, Some(Element::RaviartThomas)) => {
            format!("({}/{})", sided(format!("div({name})")), problem.dim)
        }
        // The only slopes are half the components of the curl.
        (Some(_), _, Some(Element::Nedelec)) if problem.dim == 2 => {
            format!("({}/2)", sided(format!("curl({name})")))
        }
        (Some(axis), _, Some(Element::Nedelec)) => {
            let curl = sided(format!("curl({name})"));
            format!("({curl}[{}]/2)", 3 - axis - leaf.component)
        }
        (Some(axis), None, _) => format!("{}[{axis}]", sided(format!("grad({name})"))),
        (Some(axis), Some(second), _) => {
            let hesse = sided(format!("{name}.Operator(\"hesse\")"));
            format!("{hesse}[{axis}, {second}]")
        }
    }
}

fn write(problem: &mut Problem) -> Result<String, String> {
    let dim = problem.dim;
    let words = Words::new(problem, &format!("{} {RESERVED}", python::RESERVED), 0, '_');
    let imports = "import netgen.meshing as netgen\nimport ngsolve\nfrom ngsolve import (\n    BND, CF, SEGM, TET, TRIG, VOL, IfPos, acos, asin, atan, atan2, cos, cosh, curl, div, ds, dx, exp, grad, log, sin, sinh, specialcf, sqrt, tan, x, y, z\n)";
    let mut s = python::top(problem, CODE.suffix, imports, &words);
    let boundaries: Vec<usize> = (0..problem.groups.len())
        .filter(|k| problem.groups[*k].dim == dim - 1)
        .collect();
    let tags: Vec<i64> = problem.groups.iter().map(|group| group.tag).collect();
    let name_of = |k: usize| format!("g{}", tags[k]);
    if let Some(time) = &problem.time {
        let t = &words.parameters[time.parameter];
        s += &format!("{t} = ngsolve.Parameter({t})  # changes from step to step\n");
    }
    s += &mesh(problem, &boundaries);
    let [rule, facet_rule] = problem.rules();
    let [(points, weights), (facet_points, facet_weights)] =
        [python::rule(&rule), python::rule(&facet_rule)];
    let (cell, facet) = if dim == 2 {
        ("TRIG", "SEGM")
    } else {
        ("TET", "TRIG")
    };
    s += &format!(
        "\n# The quadrature points are given explicitly, so that all codes use the same.\nrule = {{{cell}: ngsolve.IntegrationRule({points}, {weights})}}\n\
         facet_rule = {{{facet}: ngsolve.IntegrationRule({facet_points}, {facet_weights})}}\nn = specialcf.normal({dim})\n"
    );
    if problem.has_diameter() {
        s += &format!(
            "h = ngsolve.GridFunction(ngsolve.L2(mesh, order=0))  # the longest edge of each cell\nh.vec.FV().NumPy()[:] = np.max(\n    [np.linalg.norm(points[cells[:, i]] - points[cells[:, j]], axis=1) for i in range({}) for j in range(i)], axis=0\n)\n",
            dim + 1
        );
    }
    let jumps = problem
        .integrals
        .iter()
        .any(|i| i.measure.domain == Domain::Interior);
    let ends = |node: Node| end(problem, &words, node);
    let spelling = Spelling {
        end: &ends,
        call,
        power,
        choice,
    };
    let none = Shared::new();
    s += &format!(
        "\n\n{}",
        HOLD.replace("NODES", &reference(dim - 1))
            .replace("CELLS", &reference(dim))
    );
    let is_part =
        |i: &Integral| i.measure.domain == Domain::Interior && !i.measure.groups.is_empty();
    if problem.integrals.iter().any(is_part) {
        s += &BETWEEN.replace("FACETS", if dim == 2 { "edges" } else { "faces" });
    }
    for (k, datum) in problem.data.iter().enumerate() {
        for (name, value) in words.parts(Field::Datum(k)).iter().zip(&datum.components) {
            let value = spelling.text(&problem.scalars, *value, &none);
            match datum.space {
                None => s += &format!("{name} = CF({value})\n"),
                Some(of) => {
                    s += &format!(
                        "{name} = ngsolve.GridFunction({})\nhold({name}, VOL, {}, (None, CF({value})))\n",
                        space(of.element, dim, "", false)?,
                        of.element.degree()
                    )
                }
            }
        }
    }
    let blocks = problem.blocks();
    let conditions = problem.held();
    let mut spaces = Vec::new();
    for (k, c) in &blocks {
        let groups = conditions
            .iter()
            .filter(|held| (held.unknown, held.component) == (*k, *c));
        let groups: Vec<String> = groups.map(|held| name_of(held.group)).collect();
        let held = if groups.is_empty() {
            String::new()
        } else {
            format!(", dirichlet=\"{}\"", groups.join("|"))
        };
        spaces.push(space(
            problem.unknowns[*k].space.element,
            dim,
            &held,
            jumps,
        )?);
    }
    let names = |of: fn(usize) -> Field| {
        let each = blocks.iter().map(|(k, c)| match c {
            Some(c) => words.parts(of(*k))[*c].clone(),
            None => words.whole(of(*k)).to_owned(),
        });
        each.collect::<Vec<_>>()
    };
    let [mut unknowns, mut tests] = [names(Field::Unknown), names(Field::Test)];
    for k in 0..problem.means.len() {
        spaces.push("ngsolve.NumberSpace(mesh)".into());
        unknowns.push(format!("multiplier{k}"));
        tests.push(format!("mean{k}"));
    }
    // The functions that make up one in V.
    let parts = |of: &str| {
        let each = (0..spaces.len()).map(|at| match spaces.len() {
            1 => of.to_owned(),
            _ => format!("{of}.components[{at}]"),
        });
        each.collect::<Vec<_>>()
    };
    let at = |unknown: usize, component: Option<usize>| {
        let found = blocks
            .iter()
            .position(|block| block.0 == unknown && (block.1 == component || block.1.is_none()));
        found.unwrap_or(0)
    };
    s += &format!(
        "\nV = {}\n{} = V.TrialFunction()\n{} = V.TestFunction()\n",
        spaces.join(" * "),
        unknowns.join(", "),
        tests.join(", ")
    );
    if problem.time.is_some() {
        s += "before = ngsolve.GridFunction(V)\n";
        for (name, part) in names(Field::Old).iter().zip(parts("before")) {
            s += &format!("{name} = {part}\n");
        }
    }
    let residual = problem.residual();
    let by_hand: Vec<bool> = residual
        .iter()
        .map(|i| i.measure.domain == Domain::Interior && !problem.is_bilinear(i))
        .collect();
    let derivatives: Vec<_> = residual
        .iter()
        .zip(&by_hand)
        .map(|(integral, by_hand)| by_hand.then(|| problem.derivative(integral)))
        .collect();
    let ends = |node: Node| end(problem, &words, node);
    let spelling = Spelling {
        end: &ends,
        call,
        power,
        choice,
    };
    let name = |i: usize| if by_hand[i] { "b" } else { "a" };
    let each = residual.iter().enumerate().map(|(i, integral)| {
        let terms = integral.terms.iter().map(|(test, c)| (vec![*test], *c));
        (name(i), &integral.measure, terms.collect())
    });
    let each: Vec<Terms<'_>> = each.collect();
    s += "a = ngsolve.BilinearForm(V)\n";
    if by_hand.contains(&true) {
        s += "b = ngsolve.BilinearForm(V)\n";
    }
    s += &integrals(problem, &spelling, &each, &name_of);
    for (k, mean) in problem.means.iter().enumerate() {
        let [p, q] =
            [Field::Unknown, Field::Test].map(|of| words.whole(of(mean.unknown)).to_owned());
        s += &format!(
            "a += (multiplier{k}*{q} + ({p} - ({:?}))*mean{k})*dx(intrules=rule)  # the mean is held by a multiplier\n",
            mean.value
        );
    }
    s += "total, goal = ngsolve.GridFunction(V), ngsolve.GridFunction(V)\n";
    if by_hand.contains(&true) {
        s += "\n# NGSolve linearises integrals over interior facets correctly only if they are bilinear; J is the derivative of b.\nJ = ngsolve.BilinearForm(V)\n";
        let all = parts("total");
        let ends = |node: Node| match node {
            Node::Leaf(leaf) => match leaf.field {
                Field::Increment(k) => end(
                    problem,
                    &words,
                    Node::Leaf(Leaf {
                        field: Field::Unknown(k),
                        ..leaf
                    }),
                ),
                Field::Unknown(k) => slope(problem, &all[at(k, Some(leaf.component))], leaf),
                _ => end(problem, &words, node),
            },
            _ => end(problem, &words, node),
        };
        let spelling = Spelling {
            end: &ends,
            call,
            power,
            choice,
        };
        let each = residual
            .iter()
            .zip(&derivatives)
            .filter_map(|(integral, by)| {
                let terms = by.as_ref()?.iter();
                let terms = terms.map(|((test, increment), c)| (vec![*increment, *test], *c));
                Some(("J", &integral.measure, terms.collect()))
            });
        s += &integrals(problem, &spelling, &each.collect::<Vec<_>>(), &name_of);
    }
    let mut solve =
        "# Dirichlet values; where two groups share a dof, the later one counts.\n".to_owned();
    let formula = |id: &Id| spelling.text(&problem.scalars, *id, &none);
    for (part, (k, c)) in parts("goal").iter().zip(&blocks) {
        let mine = conditions
            .iter()
            .filter(|held| (held.unknown, held.component) == (*k, *c));
        if c.is_none() {
            for held in mine {
                let values = held
                    .values
                    .iter()
                    .map(|id| match problem.scalars.number_of(*id) {
                        // Of 0 alone a product is none.
                        Some(value) => format!("ngsolve.Parameter({value:?})"),
                        None => formula(id),
                    });
                let values: Vec<String> = values.collect();
                let trace = match problem.unknowns[*k].space.element {
                    Element::RaviartThomas => "normal",
                    _ => "tangential",
                };
                solve += &format!(
                    "hold_whole({part}, \"{}\", {trace}, CF(({})))\n",
                    name_of(held.group),
                    values.join(", ")
                );
            }
            continue;
        }
        let values = mine.map(|held| {
            format!(
                ", (\"{}\", CF({}))",
                name_of(held.group),
                formula(&held.values[0])
            )
        });
        let values: String = values.collect();
        if values.is_empty() {
            continue;
        }
        let degree = match problem.unknowns[*k].space.element {
            Element::CrouzeixRaviart => 0,
            element => element.degree(),
        };
        solve += &format!("hold({part}, BND, {degree}{values})\n");
    }
    if conditions.iter().any(|held| held.component.is_none()) {
        let list = |name: &str| (0..dim).map(|k| format!("{name}[{k}]")).collect::<Vec<_>>();
        let trace = |element| traces(element, &list("e"), &list("n")).join(", ");
        s += &HOLD_WHOLE
            .replace("RAVIART_THOMAS", &trace(Element::RaviartThomas))
            .replace("NEDELEC", &trace(Element::Nedelec));
    }
    s += "r, d = total.vec.CreateVector(), total.vec.CreateVector()\nfree = np.array([V.FreeDofs()[i] for i in range(V.ndof)])\n";
    solve += "\n# Newton's method. Dirichlet values come in by its first increment; a linear form takes one step, and a second one confirms it.\n\
          for step in range(30):\n    a.Apply(total.vec, r)\n    a.AssembleLinearization(total.vec)\n";
    if by_hand.contains(&true) {
        solve += "    b.Apply(total.vec, d)\n    r.data += d\n    J.Assemble()\n    a.mat.AsVector().data += J.mat.AsVector()\n";
    }
    solve += "    d.FV().NumPy()[:] = np.where(free, 0, total.vec.FV().NumPy() - goal.vec.FV().NumPy())\n    r.data -= a.mat * d\n    \
          d.data += a.mat.Inverse(V.FreeDofs(), inverse=\"umfpack\") * r\n    total.vec.data -= d\n    \
          if abs(d.FV().NumPy()).max() <= 1e-10*abs(total.vec.FV().NumPy()).max():\n        break\nelse:\n    sys.exit(\"Newton's method did not converge.\")\n";
    match &problem.time {
        None => s += &format!("\n{solve}"),
        Some(time) => {
            s += "\n# Initial values.\n";
            for initial in &time.initial {
                let part = &parts("total")[at(initial.unknown, Some(initial.component))];
                let nodes = match problem.unknowns[initial.unknown].space.element {
                    Element::CrouzeixRaviart => 4,
                    element => element.degree(),
                };
                s += &format!(
                    "hold({part}, VOL, {nodes}, (None, CF({})))\n",
                    formula(&initial.value)
                );
            }
            let mut again = "before.vec.data = total.vec\n".to_owned();
            for (name, element, id) in words.interpolated(problem) {
                let (degree, value) = (element.degree(), formula(&id));
                again += &format!("hold({name}, VOL, {degree}, (None, CF({value})))\n");
            }
            let clock = |t: &str, dt: &str| format!("{t}.Set(number*{dt})");
            s += &python::steps(time, &words, clock, &again, &solve);
        }
    }
    let (nodes, kind) = python::nodes(problem.output(), dim)?;
    // NGSolve's reference coordinates belong to the first vertices, the last one is the origin.
    let nodes: Vec<String> = nodes
        .iter()
        .map(|node| format!("{:?}", &node[..dim]))
        .collect();
    s += &format!(
        "\n# The values at the nodes of VTK's cells.\nnodes = ngsolve.IntegrationRule([{}], [1.0]*{})\nmapped = mesh.MapToAllElements({{{cell}: nodes}}, VOL)\n\n\n\
         def values(function):\n    return CF(function)(mapped).reshape(len(cells), {}, -1)\n\n\nat = values((x, y, z))\n",
        nodes.join(", "),
        nodes.len(),
        nodes.len()
    );
    let all = parts("total");
    let values = problem.unknowns.iter().enumerate().map(|(k, u)| {
        let mut mine: Vec<String> = (0..u.space.count())
            .map(|c| all[at(k, Some(c))].clone())
            .collect();
        mine.dedup();
        let text = match &mine[..] {
            [one] => format!("values({one})"),
            several => format!("values(({}))", several.join(", ")),
        };
        (u.name.clone(), text)
    });
    Ok(s + &python::bottom(problem.output(), kind, &values.collect::<Vec<_>>()))
}

/// Integrals: the form that they belong to, the measure, and products of functions with their coefficients.
type Terms<'a> = (&'static str, &'a Measure, Vec<(Vec<Leaf>, Id)>);

fn integrals(
    problem: &Problem,
    spelling: &Spelling<'_>,
    each: &[Terms<'_>],
    name_of: &dyn Fn(usize) -> String,
) -> String {
    let roots: Vec<Id> = each
        .iter()
        .flat_map(|(_, _, terms)| terms.iter().map(|(_, c)| *c))
        .collect();
    let reserved = format!("{} {RESERVED}", python::RESERVED);
    let found = shared(
        &problem.scalars,
        &roots,
        &mut Words::new(problem, &reserved, 0, '_'),
    );
    let mut known = Shared::new();
    let mut s = String::new();
    for (id, name) in &found {
        let value = spelling.definition(&problem.scalars, *id, &known);
        s += &format!("{name} = {value}\n");
        known.insert(*id, name.clone());
    }
    for (form, measure, terms) in each {
        let products = terms.iter().map(|(leaves, c)| {
            let ends = leaves.iter().map(|leaf| (spelling.end)(Node::Leaf(*leaf)));
            let ends = ends.collect::<Vec<_>>().join("*");
            match problem.scalars.number_of(*c) {
                Some(1.0) => ends,
                Some(-1.0) => format!("-{ends}"),
                _ => format!("{}*{ends}", spelling.factor(&problem.scalars, *c, &known)),
            }
        });
        let sum = products
            .collect::<Vec<_>>()
            .join("\n    + ")
            .replace("+ -", "- ");
        if !sum.is_empty() {
            s += &format!(
                "{form} += (\n    {sum}\n).Compile()*{}\n",
                over(problem, measure, name_of)
            );
        }
    }
    s
}

/// Netgen's mesh of the arrays, whose groups of facets are called `gN`.
fn mesh(problem: &Problem, boundaries: &[usize]) -> String {
    let dim = problem.dim;
    let tags: Vec<String> = boundaries
        .iter()
        .map(|k| problem.groups[*k].tag.to_string())
        .collect();
    let body = if dim == 2 {
        "inside = {int(r): netgen.FaceDescriptor(surfnr=i + 1, domin=i + 1, bc=i + 1) for i, r in enumerate(np.unique(regions))}\n\
         where = {r: grid.Add(descriptor) for r, descriptor in inside.items()}\n\
         for vertices, r in zip(cells, regions.tolist()):\n    grid.Add(netgen.Element2D(where[r], [number[i] for i in vertices]))\n\
         for i, r in enumerate(inside):\n    grid.SetMaterial(i + 1, f\"g{r}\")\n\
         for vertices, label in zip(facets, labels.tolist()):\n    grid.Add(netgen.Element1D([number[i] for i in vertices], index=groups.index(label) + 1))\n\
         for i, label in enumerate(groups):\n    grid.SetBCName(i, f\"g{label}\")\n"
    } else {
        "for i, label in enumerate(groups):\n    grid.Add(netgen.FaceDescriptor(surfnr=i + 1, domin=1, bc=i + 1))\n    grid.SetBCName(i, f\"g{label}\")\n\
         for vertices, label in zip(facets, labels.tolist()):\n    grid.Add(netgen.Element2D(groups.index(label) + 1, [number[i] for i in vertices]))\n\
         inside = np.unique(regions).tolist()\n\
         for vertices, r in zip(cells, regions.tolist()):\n    grid.Add(netgen.Element3D(inside.index(r) + 1, [number[i] for i in vertices]))\n\
         for i, r in enumerate(inside):\n    grid.SetMaterial(i + 1, f\"g{r}\")\n"
    };
    format!(
        "grid = netgen.Mesh(dim={dim})\nnumber = [grid.Add(netgen.MeshPoint(netgen.Pnt(*point, *[0.0]*{}))) for point in points]\n\
         groups = [{}]  # of the boundary\n{body}mesh = ngsolve.Mesh(grid)\n",
        3 - dim,
        tags.join(", ")
    )
}

/// The nodes of degrees 0 to 3 on a reference simplex, by the degree; of degree 0, the centre; and the centres of its facets.
fn reference(dim: usize) -> String {
    let points = |degree: usize| {
        let range = 0..=degree;
        let mut all: Vec<Vec<usize>> = vec![Vec::new()];
        for _ in 0..dim {
            all = all
                .iter()
                .flat_map(|p| range.clone().map(move |k| [&p[..], &[k]].concat()))
                .collect();
        }
        let inside = all
            .into_iter()
            .filter(|p| p.iter().sum::<usize>() <= degree);
        let each = inside.map(|p| {
            format!(
                "({})",
                p.iter()
                    .map(|k| format!("{:?},", *k as f64 / degree as f64))
                    .collect::<Vec<_>>()
                    .join(" ")
            )
        });
        format!("[{}]", each.collect::<Vec<_>>().join(", "))
    };
    let centre = format!(
        "[({})]",
        vec![format!("1/{}", dim + 1); dim].join(", ") + ","
    );
    // The centres of facets lie opposite the vertices.
    let facets = (0..=dim).map(|j| {
        let place = (0..dim).map(|i| {
            if i == j {
                "0,".to_owned()
            } else {
                format!("1/{dim},")
            }
        });
        format!("({})", place.collect::<Vec<_>>().join(" "))
    });
    let facets = facets.collect::<Vec<_>>().join(", ");
    format!(
        "[{centre}, {}, {}, {}, [{facets}]]",
        points(1),
        points(2),
        points(3)
    )
}

const HOLD: &str = r#"def hold(function, where, degree, *values):
    """Set nodal values on cells, or on facets of groups; of two values at one node, the later counts.

    NGSolve's basis is hierarchical, so a small system is solved for the dofs of each element.
    """
    nodes = {BND: NODES, VOL: CELLS}[where][degree]
    known, solved = {}, {}
    for group, g in values:
        for e in function.space.Elements(where):
            if group is None or e.mat == group:
                place, element = mesh.GetTrafo(e), function.space.GetFE(e)
                keys = [tuple(np.round(CF((x, y, z))(place(*t)), 9)) for t in nodes]
                known.update(zip(keys, [g(place(*t)) for t in nodes]))
                solved[e.nr] = e.dofs, [np.ravel(element.CalcShape(*t)) for t in nodes], keys
    for dofs, shapes, keys in solved.values():
        for dof, value in zip(dofs, np.linalg.solve(shapes, [known[key] for key in keys])):
            function.vec[dof] = value


"#;

/// The facets of groups between cells.
const BETWEEN: &str = r#"def between(*groups):
    """The facets of groups, as a set."""
    found = ngsolve.BitArray(mesh.nfacet)
    found.Clear()
    for e in mesh.Elements(BND):
        if e.mat in groups:
            found.Set(e.FACETS[0].nr)
    return found


"#;

fn over(problem: &Problem, measure: &Measure, name_of: &dyn Fn(usize) -> String) -> String {
    let groups = problem.named(measure).into_iter().map(name_of);
    let groups: Vec<String> = groups.collect();
    let all = groups.join("|");
    match measure.domain {
        Domain::Cells if groups.is_empty() => "dx(intrules=rule)".into(),
        Domain::Cells => format!("dx(\"{all}\", intrules=rule)"),
        Domain::Boundary if groups.is_empty() => "ds(skeleton=True, intrules=facet_rule)".into(),
        Domain::Boundary => format!("ds(\"{all}\", skeleton=True, intrules=facet_rule)"),
        Domain::Interior if groups.is_empty() => "dx(skeleton=True, intrules=facet_rule)".into(),
        Domain::Interior => format!(
            "dx(skeleton=True, definedonelements=between(\"{}\"), intrules=facet_rule)",
            groups.join("\", \"")
        ),
    }
}

const HOLD_WHOLE: &str = r#"

normal = lambda e: [RAVIART_THOMAS]
tangential = lambda e: [NEDELEC]


def hold_whole(function, group, trace, g):
    """Hold the normal or tangential moments of a vector on facets, by projection."""
    own = function.space
    q, v = own.TnT()
    measure = ds(group, skeleton=True, intrules=facet_rule)
    product = lambda a, b: sum(i*j for i, j in zip(trace(a), trace(b)))*measure
    M, right = ngsolve.BilinearForm(product(q, v)).Assemble(), ngsolve.LinearForm(product(g, v)).Assemble()
    diagonal = np.array([M.mat[i, i] for i in range(own.ndof)])
    found = ngsolve.BitArray(diagonal > 1e-10*diagonal.max())
    solved = right.vec.CreateVector()
    solved.data = M.mat.Inverse(found, inverse="umfpack") * right.vec
    for i in np.flatnonzero(diagonal > 1e-10*diagonal.max()):
        function.vec[i] = solved[i]


"#;
