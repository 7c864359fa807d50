//! FreeFEM: the form as `varf` in scalars, on meshes of triangles or tetrahedra, without plugins.

use std::collections::BTreeMap;

use faceoff_fem::scene::expression::Function;

use super::Code;
use super::spelling::{Shared, Spelling, Words, head, indented, shared, traces};
use crate::problem::{Domain, Element, Held, Initial, Integral, Measure, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// FreeFEM 4, by the program without graphics.
pub const CODE: Code = Code {
    name: "freefem",
    suffix: ".edp",
    command: &["FreeFem++-nw", "-v", "0"],
    mesh: ("medit", "mesh"),
    script: super::Script::Own(write),
};

/// Words of FreeFEM, and those of the frame.
pub const RESERVED: &str = "x y z N P label region nuTriangle nuEdge hTriangle lenEdge area volume pi i Th Vh Out F J Th0 X Y Z A r d it e k \
    mesh mesh3 real int func macro varf string result order file values fixed held dx dy dz dxx dyy jump mean average on int1d int2d int3d \
    P0 P1 P2 P3 P1nc P1dc P2dc P1b sin C D from to own drawnBack cos tan exp log sqrt abs min max pow atan2 asin acos atan sinh cosh tanh cout cin endl square \
    trunc matrix complex bool if else for while break continue return try catch true false verbosity ARGV CG LU UMFPACK sparsesolver \
    clock exit assert load include plot border solve problem fespace ofstream ifstream set qft qfe qfV tgv solver hK name reads writes done j there value where out Hh DP qf1pE qf2pE qf3pE qf5pE qf2pT qf5pT qfV2 qfV5 readmesh readmesh3 given rest least moments M row gap J0 rm dm n RT0 RT03d RT0Ortho Edge03d dxy dxz dyy dyz dzz mean dofs P1dc3d";

fn element(element: Element, dim: usize) -> Result<&'static str, String> {
    Ok(match (element, dim) {
        (Element::Continuous(1), _) => "P1",
        (Element::Continuous(2), _) => "P2",
        (Element::Broken(0), _) => "P0",
        (Element::Broken(1), _) => {
            if dim == 2 {
                "P1dc"
            } else {
                "P1dc3d"
            }
        }
        (Element::CrouzeixRaviart, 2) => "P1nc",
        (Element::RaviartThomas, 2) => "RT0",
        (Element::RaviartThomas, _) => "RT03d",
        (Element::Nedelec, 2) => "RT0Ortho",
        (Element::Nedelec, _) => "Edge03d",
        (other, _) => {
            return Err(format!(
                "FreeFEM without plugins has no {} in {dim}D",
                other.name()
            ));
        }
    })
}

fn choice(sign: &str, [a, b, c, d]: &[String; 4]) -> String {
    // `?:` does not mix with varf.
    let or = match sign {
        "<" => ">=",
        "<=" => ">",
        ">" => "<=",
        _ => "<",
    };
    format!("(({a} {sign} {b})*({c}) + ({a} {or} {b})*({d}))")
}

fn call(function: Function, arguments: &[String]) -> String {
    format!("{}({})", function.names()[1], arguments.join(", "))
}

fn end(problem: &Problem, words: &Words, node: Node) -> String {
    let axis = |k: usize| ["x", "y", "z"][k];
    let other = |text: String, side| match side {
        // The jump is the value of the other cell less that of this one.
        Side::Minus => format!("({text} + jump({text}))"),
        _ => text,
    };
    match node {
        Node::Pi => "pi".into(),
        Node::Parameter(k) => words.parameters[k].clone(),
        Node::Coordinate(k) => axis(k).into(),
        Node::Normal(k, Side::Minus) => format!("(-N.{})", axis(k)),
        Node::Normal(k, _) => format!("N.{}", axis(k)),
        Node::Diameter(side) => other(
            if problem.dim == 2 { "hTriangle" } else { "hK" }.into(),
            side,
        ),
        Node::Leaf(leaf) => {
            let name = words.part(leaf).to_owned();
            match (leaf.axis, leaf.second, leaf.field) {
                (None, _, Field::Datum(_)) => name,
                (None, ..) => other(name, leaf.side),
                (Some(k), None, _) => other(format!("d{}({name})", axis(k)), leaf.side),
                (Some(k), Some(l), _) => {
                    other(format!("d{}{}({name})", axis(k), axis(l)), leaf.side)
                }
            }
        }
        _ => String::new(),
    }
}

fn write(problem: &mut Problem) -> Result<String, String> {
    let dim = problem.dim;
    let mut words = Words::new(problem, RESERVED, 1, 'X');
    let residual = problem.residual();
    // Names for what selects the facets of groups.
    let interior = residual.iter().map(|i| &i.measure);
    let interior = interior.filter(|m| m.domain == Domain::Interior && !m.groups.is_empty());
    let marks = interior.map(|m| (m.groups.clone(), words.fresh("marked")));
    let marks: BTreeMap<Vec<usize>, String> = marks.collect();
    let jacobian: Vec<_> = residual
        .iter()
        .map(|i| (i.measure.clone(), problem.derivative(i)))
        .collect();
    if dim == 3
        && residual
            .iter()
            .any(|i| i.measure.domain == Domain::Interior)
    {
        return Err("FreeFEM has no integrals over interior faces in 3D".into());
    }
    let starts = problem.time.iter().flat_map(|time| &time.initial);
    let is_drawn =
        |start: &Initial| problem.unknowns[start.unknown].space.element == Element::Broken(1);
    if starts.clone().any(is_drawn) {
        return Err(
            "FreeFEM interpolates DG1 at points inside of cells, and other codes at the vertices"
                .into(),
        );
    }
    let components = problem.components();
    let blocks = problem.blocks();
    let elements: Vec<&str> = blocks
        .iter()
        .map(|(k, _)| element(problem.unknowns[*k].space.element, dim))
        .collect::<Result<_, _>>()?;
    let output = problem.output();
    let names = |of: fn(usize) -> Field| {
        let each = components
            .iter()
            .map(|(k, c)| words.parts(of(*k))[*c].clone());
        each.collect::<Vec<_>>()
    };
    let olds = match problem.time {
        Some(_) => names(Field::Old),
        None => Vec::new(),
    };
    let [unknowns, tests, increments] = [
        names(Field::Unknown),
        names(Field::Test),
        names(Field::Increment),
    ];
    let list = |names: &[String]| match names {
        [one] => one.clone(),
        several => format!("[{}]", several.join(", ")),
    };
    let text = head(
        problem,
        &format!(
            "FreeFem++-nw {0}.edp reads {0}.mesh and writes {0}.vtu.",
            problem.name
        ),
    );
    let mut s = format!("// {}\n", text.join("\n// ")).replace("// \n", "//\n");
    let (mesh, read) = if dim == 2 {
        ("mesh", "readmesh")
    } else {
        ("mesh3", "readmesh3")
    };
    s += &format!(
        "\nstring reads = \"{0}.mesh\", writes = \"{0}.vtu\";\n\
         if (ARGV.n > 3 && ARGV[ARGV.n - 1].rfind(\".vtu\") > 0) {{ // given in the command\n  reads = ARGV[ARGV.n - 2];\n  writes = ARGV[ARGV.n - 1];\n}}\n\
         {mesh} Th = {read}(reads);\n",
        problem.name
    );
    for (k, parameter) in problem.parameters.iter().enumerate() {
        s += &format!("real {} = {:?};\n", words.parameters[k], parameter.value);
    }
    let ends = |node: Node| end(problem, &words, node);
    let spelling = Spelling {
        end: &ends,
        call,
        power: |base, n| n.after(base, "^"),
        choice,
    };
    let formulas = Spelling {
        choice: |sign, [a, b, c, d]| format!("(({a} {sign} {b}) ? ({c}) : ({d}))"),
        ..Spelling {
            end: &ends,
            call,
            power: |base, n| n.after(base, "^"),
            choice,
        }
    };
    let none = Shared::new();
    let mut spaces = Vec::new();
    for (k, datum) in problem.data.iter().enumerate() {
        for (name, value) in words.parts(Field::Datum(k)).iter().zip(&datum.components) {
            let value = formulas.text(&problem.scalars, *value, &none);
            match datum.space {
                None => s += &format!("func {name} = {value};\n"),
                Some(space) => {
                    let of = element(space.element, dim)?;
                    if !spaces.contains(&of) {
                        spaces.push(of);
                        s += &format!("fespace D{of}(Th, {of});\n");
                    }
                    s += &format!("D{of} {name} = {value};\n");
                }
            }
        }
    }
    if dim == 3 && problem.has_diameter() {
        s += "fespace Hh(Th, P0);\nHh hK;  // the longest edge of each cell\nfor (int k = 0; k < Th.nt; ++k) {\n  for (int i = 0; i < 4; ++i)\n    for (int j = 0; j < i; ++j)\n      \
              hK[][Hh(k, 0)] = max(hK[][Hh(k, 0)], sqrt((Th[k][i].x - Th[k][j].x)^2 + (Th[k][i].y - Th[k][j].y)^2 + (Th[k][i].z - Th[k][j].z)^2));\n}\n";
    }
    let space = list(&elements.iter().map(|e| (*e).to_owned()).collect::<Vec<_>>());
    s += &format!("\nfespace Vh(Th, {space});\nVh {};\n", list(&unknowns));
    if !olds.is_empty() {
        s += &format!("Vh {};  // of the step before\n", list(&olds));
    }

    for (groups, mark) in &marks {
        let tags = tags(problem, groups);
        s += &format!(
            "fespace E{mark}(Th, P0edge);\nE{mark} {mark};  // 1 on some facets, 0 on all others\n\
             varf on{mark}(e, f) = on({tags}e = 1);\n{mark}[] = on{mark}(0, E{mark}, tgv=1);\n"
        );
    }

    let mut sums = Vec::new();
    let roots: Vec<Id> = residual
        .iter()
        .flat_map(|i| i.terms.values().copied())
        .chain(jacobian.iter().flat_map(|(_, j)| j.values().copied()))
        .collect();
    let found = shared(
        &problem.scalars,
        &roots,
        &mut Words::new(problem, RESERVED, 1, 'X'),
    );
    let mut known = Shared::new();
    for (id, name) in &found {
        s += &format!(
            "macro {name}() ({}) //\n",
            spelling.definition(&problem.scalars, *id, &known)
        );
        known.insert(*id, name.clone());
    }
    let leaf = |leaf: Leaf| (spelling.end)(Node::Leaf(leaf));
    let product = |coefficient: Id, leaves: &[Leaf]| {
        let ends = leaves
            .iter()
            .map(|l| leaf(*l))
            .collect::<Vec<_>>()
            .join("*");
        match problem.scalars.number_of(coefficient) {
            Some(1.0) => ends,
            Some(-1.0) => format!("-{ends}"),
            _ => format!(
                "({})*{ends}",
                spelling.text(&problem.scalars, coefficient, &known)
            ),
        }
    };
    let integral = |measure: &Measure, products: Vec<String>| {
        let sum = products.join("\n        + ").replace("+ -", "- ");
        match measure.domain {
            // Each interior edge is seen from both cells, an edge of the boundary from one.
            Domain::Interior => format!(
                "{}(\n          0.5*(nTonEdge - 1)*{}({sum}))",
                over(problem, measure),
                marks
                    .get(&measure.groups)
                    .map_or(String::new(), |mark| format!("{mark}*"))
            ),
            _ => format!("{}(\n          {sum})", over(problem, measure)),
        }
    };
    for Integral { measure, terms, .. } in &residual {
        let products = terms.iter().map(|(test, c)| product(*c, &[*test]));
        sums.push(integral(measure, products.collect()));
    }
    s += &format!(
        "\n// The residual F(u; v), and its derivative in the direction of the increment.\nvarf F({}, {}) =\n    {};\n",
        list(&increments),
        list(&tests),
        sums.join("\n  + ")
    );
    sums.clear();
    for (measure, terms) in &jacobian {
        if !terms.is_empty() {
            let products = terms
                .iter()
                .map(|((test, increment), c)| product(*c, &[*increment, *test]));
            sums.push(integral(measure, products.collect()));
        }
    }
    // Dirichlet rows: `on` with a value for each component that it holds.
    let held = problem.held();
    let on = |held: &Held, values: &[String]| {
        let first = problem.position(held.unknown, held.component.unwrap_or(0));
        let each = increments[first..].iter().zip(values);
        let each: Vec<String> = each
            .map(|(name, value)| format!("{name} = {value}"))
            .collect();
        format!(
            "on({}, {})",
            problem.groups[held.group].tag,
            each.join(", ")
        )
    };
    let zeros = held.iter().map(|held| {
        format!(
            "\n  + {}",
            on(held, &vec!["0.0".to_owned(); held.values.len()])
        )
    });
    let arguments = format!("({}, {})", list(&increments), list(&tests));
    s += &format!(
        "varf J{arguments} =\n    {}{};\n",
        sums.join("\n  + "),
        zeros.collect::<String>()
    );
    let u = &unknowns[0];
    let formula = |id: &Id| formulas.text(&problem.scalars, *id, &none);
    s += "\n// Dirichlet values; where two groups share a dof, the later one counts.\nreal[int] fixed(Vh.ndof), given(Vh.ndof);\nfixed = 0;\ngiven = 0;\n";
    let mut solve = String::new();
    for (k, held) in held.iter().enumerate() {
        let values: Vec<String> = held.values.iter().map(formula).collect();
        if held.component.is_some() {
            s += &format!(
                "varf where{k}{arguments} = {};\nvarf value{k}{arguments} = {};\n",
                on(held, &["1.0".to_owned()]),
                on(held, &values)
            );
            solve += &format!(
                "{{\n  real[int] there = where{k}(0, Vh, tgv=1), value = value{k}(0, Vh, tgv=1);\n  \
                 for (int i = 0; i < Vh.ndof; ++i) if (there[i] > 0) {{ fixed[i] = 1; given[i] = value[i]; }}\n}}\n"
            );
            continue;
        }
        let normal = ["N.x", "N.y", "N.z"].map(str::to_owned);
        let element = problem.unknowns[held.unknown].space.element;
        let first = problem.position(held.unknown, 0);
        let of = |names: &[String]| traces(element, names, &normal[..dim]);
        let [du, v, g] = [
            &increments[first..first + dim],
            &tests[first..first + dim],
            &values,
        ]
        .map(of);
        let product = |a: &[String], b: &[String]| {
            let each = a.iter().zip(b).map(|(a, b)| format!("{a}*{b}"));
            each.collect::<Vec<_>>().join(" + ")
        };
        let measure = Measure {
            domain: Domain::Boundary,
            groups: vec![held.group],
        };
        let over = over(problem, &measure);
        s += &format!(
            "// The moments of facets, by projection.\nvarf where{k}{arguments} = {over}({});\nvarf value{k}{arguments} = {over}({});\n",
            product(&du, &v),
            product(&g, &v)
        );
        solve += &format!(
            "{{\n  matrix M = where{k}(Vh, Vh);\n  real[int] there = M.diag, value = value{k}(0, Vh), rest(Vh.ndof);\n  real least = 1e-10*there.max;\n  \
             for (int i = 0; i < Vh.ndof; ++i) {{ rest[i] = there[i] <= least; if (rest[i] > 0) value[i] = 0; }}\n  \
             matrix D = [rest];\n  M = M + D;\n  set(M, solver=UMFPACK);\n  real[int] moments = M^-1*value;\n  \
             for (int i = 0; i < Vh.ndof; ++i) if (rest[i] == 0) {{ fixed[i] = 1; given[i] = moments[i]; }}\n}}\n"
        );
    }
    let mut matrix = "matrix A = J(Vh, Vh, tgv=-1);".to_owned();
    let mut right = "real[int] d = A^-1*r;".to_owned();
    if !problem.means.is_empty() {
        let cells = Measure {
            domain: Domain::Cells,
            groups: Vec::new(),
        };
        let (mut columns, mut rows, mut wanted) = (String::new(), String::new(), String::new());
        let count = problem.means.len();
        for (k, mean) in problem.means.iter().enumerate() {
            let test = &tests[problem.position(mean.unknown, 0)];
            s += &format!(
                "varf mean{k}{arguments} = {}({test});\nreal[int] row{k} = mean{k}(0, Vh); // its product with dofs is the integral\n",
                over(problem, &cells)
            );
            columns += &format!(", row{k}");
            rows += &format!(", [row{k}'{}]", ", 0".repeat(count));
            wanted += &format!(
                "  real[int] gap{k}(1);\n  gap{k}[0] = row{k}'*{u}[] - ({:?})*row{k}.sum;\n",
                mean.value
            );
        }
        matrix = format!(
            "matrix J0 = J(Vh, Vh, tgv=-1);\n  matrix A = [[J0{columns}]{rows}]; // with a multiplier for each mean\n{wanted}"
        );
        let all: Vec<String> = (0..count).map(|k| format!("gap{k}")).collect();
        right = format!(
            "real[int] rm = [r, {}], dm = A^-1*rm, d(Vh.ndof);\n  for (int i = 0; i < Vh.ndof; ++i) d[i] = dm[i];",
            all.join(", ")
        );
    }
    let newton = format!(
        "\n// Newton's method. Dirichlet values come in by its first increment; a linear form takes one step, and a second one confirms it.\n\
         bool done = false;\nfor (int it = 0; it < 30 && !done; ++it) {{\n  real[int] r = F(0, Vh);\n  \
         for (int i = 0; i < Vh.ndof; ++i) if (fixed[i] > 0) r[i] = {u}[][i] - given[i];\n  \
         {matrix}\n  set(A, solver=UMFPACK);\n  {right}\n  {u}[] -= d;\n  done = d.l2 <= 1e-10*{u}[].l2; // of NaN, linfty is 0 and l2 is NaN\n}}\n\
         if (!done) {{ cout << \"Newton's method did not converge.\" << endl; exit(1); }}\n"
    );
    solve += &newton;
    match &problem.time {
        None => s += &solve,
        Some(time) => {
            let initial = components.iter().map(|(k, c)| {
                let is_it = |i: &&Initial| (i.unknown, i.component) == (*k, *c);
                let found = time.initial.iter().find(is_it);
                found.map_or("0.0".to_owned(), |i| formula(&i.value))
            });
            let initial: Vec<String> = initial.collect();
            let t = &words.parameters[time.parameter];
            let dt = &words.parameters[time.parameter + 1];
            let mut again = String::new();
            for (name, _, value) in words.interpolated(problem) {
                again += &format!("{name} = {};\n", formula(&value));
            }
            s += &format!(
                "\n// Steps in time: {0} is that at the end of a step.\n{t} = 0;\n{1} = {2};\nfor (int n = 1; n <= {3}; ++n) {{\n{4}}}\n",
                t,
                list(&unknowns),
                list(&initial),
                time.steps,
                indented(
                    &format!("{t} = n*{dt};\n{}[] = {u}[];\n{again}{solve}", olds[0]),
                    "  "
                )
            );
        }
    }
    s += &result(problem, &words, output)?;
    Ok(s)
}

/// The numbers of groups, each with a comma.
fn tags(problem: &Problem, groups: &[usize]) -> String {
    let each = groups.iter();
    each.map(|k| format!("{}, ", problem.groups[*k].tag))
        .collect()
}

/// `int2d(Th, …)` and the like, by the rules that FreeFEM has built in.
fn over(problem: &Problem, measure: &Measure) -> String {
    let [cells, facets] = problem.rules().map(|rule| match rule.name {
        "radon-7" => "qft=qf5pT",
        "edges-3" => "qft=qf2pT",
        "gauss-5" => "qfe=qf5pE",
        "gauss-3" => "qfe=qf3pE",
        "gauss-2" => "qfe=qf2pE",
        "walkington-14" => "qfV=qfV5",
        _ => "qfV=qfV2",
    });
    let tags = tags(problem, &problem.named(measure));
    match (measure.domain, problem.dim) {
        (Domain::Cells, 2) => format!("int2d(Th, {tags}{cells})"),
        (Domain::Cells, _) => format!("int3d(Th, {tags}{cells})"),
        (Domain::Boundary, 2) => format!("int1d(Th, {tags}{facets})"),
        (Domain::Boundary, _) => format!("int2d(Th, {tags}{facets})"),
        (Domain::Interior, _) => format!("intalledges(Th, {facets})"),
    }
}

/// The values of all unknowns at the nodes of cells, as VTU, for which FreeFEM has no writer of its own.
fn result(problem: &Problem, words: &Words, output: Element) -> Result<String, String> {
    let (dim, degree) = (problem.dim, output.degree());
    if degree > 2 {
        return Err(format!("FreeFEM without plugins has no {}", output.name()));
    }
    let kind = match (degree, dim) {
        (1, 2) => 5,
        (1, _) => 10,
        (_, 2) => 22,
        (_, _) => 24,
    };
    // Nodes are the middles of two vertices, in VTK's order; vertices are in the middle between themselves.
    let mut ends: Vec<(usize, usize)> = (0..=dim).map(|k| (k, k)).collect();
    if degree == 2 {
        ends.extend(
            [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
                .iter()
                .take(if dim == 2 { 3 } else { 6 }),
        );
    }
    let list = |of: &dyn Fn(&(usize, usize)) -> usize| {
        let all = ends.iter().map(|end| of(end).to_string());
        all.collect::<Vec<_>>().join(", ")
    };
    let mut s = format!(
        "\n// The result as VTU. Nodes are vertices and middles of edges, in VTK's order; each cell has its own.\n\
         int[int] from = [{}], to = [{}];\n",
        list(&|end| end.0),
        list(&|end| end.1)
    );
    // How FreeFEM numbers these nodes in a cell.
    let own = match (degree, dim) {
        (1, _) => "from",
        (_, 2) => {
            s += "int[int] own = [0, 1, 2, 5, 3, 4];\n";
            "own"
        }
        _ => {
            s += "int[int] own = [0, 1, 2, 3, 4, 7, 5, 6, 8, 9];\n";
            "own"
        }
    };
    let is_broken = |k: &usize| !problem.unknowns[*k].space.element.is_continuous();
    let (broken, whole): (Vec<usize>, Vec<usize>) =
        (0..problem.unknowns.len()).partition(is_broken);
    if !whole.is_empty() {
        s += &format!("fespace C(Th, P{degree});\n");
    }
    if !broken.is_empty() {
        let (space, shrink) = if dim == 2 {
            ("P1dc", "0.99")
        } else {
            ("P1dc3d", "0.9999")
        };
        s += &format!(
            "fespace D(Th, {space});  // its nodes are the vertices, drawn towards the centre of their cell by {shrink}\n\
             func real drawnBack(real[int] & dofs, int k, int i) {{\n  real mean = 0;\n  for (int j = 0; j < {0}; ++j) mean += dofs[D(k, j)]/{0};\n  \
             return mean + (0.5*(dofs[D(k, from[i])] + dofs[D(k, to[i])]) - mean)/{shrink};\n}}\n",
            dim + 1
        );
    }
    let mut values: Vec<Vec<String>> = vec![Vec::new(); problem.unknowns.len()];
    let mut at = 0;
    for (k, of_it) in values.iter_mut().enumerate() {
        for part in words.parts(Field::Unknown(k)) {
            match is_broken(&k) {
                true => {
                    s += &format!("D out{at} = {part};\n");
                    of_it.push(format!("drawnBack(out{at}[], k, i)"));
                }
                false => {
                    s += &format!("C out{at} = {part};\n");
                    of_it.push(format!("out{at}[][C(k, {own}[i])]"));
                }
            }
            at += 1;
        }
    }
    let coordinates = ["x", "y", "z"].map(|axis| match (axis, dim) {
        ("z", 2) => "0".to_owned(),
        _ => format!("0.5*(Th[k][from[i]].{axis} + Th[k][to[i]].{axis})"),
    });
    let each = |values: &[String]| {
        format!(
            "  for (int k = 0; k < Th.nt; ++k)\n    for (int i = 0; i < from.n; ++i) file << {} << endl;\n",
            values.join(" << \" \" << ")
        )
    };
    s += &format!(
        "{{\n  ofstream file(writes);\n  file.precision(17);\n  \
         file << \"<VTKFile type='UnstructuredGrid' version='1.0' byte_order='LittleEndian'><UnstructuredGrid>\" << endl\n       \
         << \"<Piece NumberOfPoints='\" << from.n*Th.nt << \"' NumberOfCells='\" << Th.nt << \"'>\" << endl\n       \
         << \"<Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>\" << endl;\n{}  \
         file << \"</DataArray></Points><Cells><DataArray type='Int64' Name='connectivity' format='ascii'>\" << endl;\n  \
         for (int i = 0; i < from.n*Th.nt; ++i) file << i << endl;\n  \
         file << \"</DataArray><DataArray type='Int64' Name='offsets' format='ascii'>\" << endl;\n  \
         for (int k = 1; k <= Th.nt; ++k) file << from.n*k << endl;\n  \
         file << \"</DataArray><DataArray type='UInt8' Name='types' format='ascii'>\" << endl;\n  \
         for (int k = 0; k < Th.nt; ++k) file << {kind} << endl;\n  file << \"</DataArray></Cells><PointData>\" << endl;\n",
        each(&coordinates)
    );
    for (unknown, values) in problem.unknowns.iter().zip(&values) {
        s += &format!(
            "  file << \"<DataArray type='Float64' Name='{}' NumberOfComponents='{}' format='ascii'>\" << endl;\n{}  file << \"</DataArray>\" << endl;\n",
            unknown.name,
            values.len(),
            each(values)
        );
    }
    Ok(s + "  file << \"</PointData></Piece></UnstructuredGrid></VTKFile>\" << endl;\n}\n")
}
