//! FreeFEM: the form as `varf` in scalars, on meshes of triangles or tetrahedra, without plugins.

use faceoff_fem::scene::expression::Function;

use super::Code;
use super::spelling::{Shared, Spelling, Words, head, shared};
use crate::problem::{Domain, Element, Integral, Measure, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// FreeFEM 4, by the program without graphics.
pub const CODE: Code = Code {
    name: "freefem",
    suffix: ".edp",
    command: &["FreeFem++-nw", "-v", "0"],
    mesh: ("medit", "mesh"),
    write,
};

/// Words of FreeFEM, and those of the frame.
const RESERVED: &str = "x y z N P label region nuTriangle nuEdge hTriangle lenEdge area volume pi i Th Vh Out F J Th0 X Y Z A r d it e k \
    mesh mesh3 real int func macro varf string result order file values fixed held dx dy dz dxx dyy jump mean average on int1d int2d int3d \
    P0 P1 P2 P3 P1nc P1dc P2dc P1b sin cos tan exp log sqrt abs min max pow atan2 asin acos atan sinh cosh tanh cout cin endl square \
    trunc matrix complex bool if else for while break continue return try catch true false verbosity ARGV CG LU UMFPACK sparsesolver \
    clock exit assert load include plot border solve problem fespace ofstream ifstream set qft qfe qfV tgv solver hK name reads writes";

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
            match (leaf.axis, leaf.field) {
                (None, Field::Datum(_)) => name,
                (None, _) => other(name, leaf.side),
                (Some(k), _) => other(format!("d{}({name})", axis(k)), leaf.side),
            }
        }
        _ => String::new(),
    }
}

fn write(problem: &mut Problem) -> Result<String, String> {
    let dim = problem.dim;
    let words = Words::new(problem, RESERVED, 1, '0');
    let residual = problem.residual();
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
    let components = problem.components();
    let elements: Vec<&str> = components
        .iter()
        .map(|(k, _)| element(problem.unknowns[*k].space.element, dim))
        .collect::<Result<_, _>>()?;
    let output = problem.output();
    if output == Element::Broken(2) {
        return Err("FreeFEM's discontinuous P2 has its nodes inside of cells, so that its values at theirs are not written".into());
    }
    let out = element(output, dim)?;
    let names = |of: fn(usize) -> Field| {
        let each = components
            .iter()
            .map(|(k, c)| words.parts(of(*k))[*c].clone());
        each.collect::<Vec<_>>()
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

    let mut sums = Vec::new();
    let roots: Vec<Id> = residual
        .iter()
        .flat_map(|i| i.terms.values().copied())
        .chain(jacobian.iter().flat_map(|(_, j)| j.values().copied()))
        .collect();
    let found = shared(
        &problem.scalars,
        &roots,
        &mut Words::new(problem, RESERVED, 1, '0'),
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
                "{}(\n          0.5*(nTonEdge - 1)*({sum}))",
                over(problem, measure)
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
    let conditions = |value: &dyn Fn(Id) -> String| {
        let each = problem.conditions.iter().map(|c| {
            let group = problem.groups[c.group].tag;
            let name = &increments[problem.position(c.unknown, c.component)];
            format!("on({group}, {name} = {})", value(c.value))
        });
        each.collect::<Vec<_>>()
    };
    let ones = conditions(&|_| "1.0".into());
    let values = conditions(&|id| formulas.text(&problem.scalars, id, &none));
    let zeros = conditions(&|_| "0.0".into());
    let on: String = zeros.iter().map(|on| format!("\n  + {on}")).collect();
    s += &format!(
        "varf J({}, {}) =\n    {}{on};\n",
        list(&increments),
        list(&tests),
        sums.join("\n  + ")
    );
    let u = &unknowns[0];
    s += "\n// The values that are held; of two that hold one dof, the later counts.\nreal[int] fixed(Vh.ndof), held(Vh.ndof);\nfixed = 0;\n";
    for (k, (one, value)) in ones.iter().zip(&values).enumerate() {
        let arguments = format!("({}, {})", list(&increments), list(&tests));
        s += &format!(
            "varf where{k}{arguments} = {one};\nvarf value{k}{arguments} = {value};\n{{\n  real[int] there = where{k}(0, Vh, tgv=1), value = value{k}(0, Vh, tgv=1);\n  \
             for (int i = 0; i < Vh.ndof; ++i) if (there[i] > 0) {{ fixed[i] = 1; {u}[][i] = value[i]; }}\n}}\n"
        );
    }
    s += &format!(
        "\n// Newton's method from 0 with those values; a linear form takes one step, and a second one to see it.\n\
         bool done = false;\nfor (int it = 0; it < 30 && !done; ++it) {{\n  real[int] r = F(0, Vh);\n  for (int i = 0; i < Vh.ndof; ++i) if (fixed[i] > 0) r[i] = 0;\n  \
         matrix A = J(Vh, Vh, tgv=-1);\n  set(A, solver=UMFPACK);\n  real[int] d = A^-1*r;\n  {u}[] -= d;\n  done = d.l2 <= 1e-10*{u}[].l2; // of NaN, linfty is 0 and l2 is NaN\n}}\n\
         if (!done) {{ cout << \"Newton's method did not converge.\" << endl; exit(1); }}\n"
    );
    s += &result(problem, &words, out, output);
    Ok(s)
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
    let tags: String = measure
        .groups
        .iter()
        .map(|k| format!("{}, ", problem.groups[*k].tag))
        .collect();
    match (measure.domain, problem.dim) {
        (Domain::Cells, 2) => format!("int2d(Th, {tags}{cells})"),
        (Domain::Cells, _) => format!("int3d(Th, {tags}{cells})"),
        (Domain::Boundary, 2) => format!("int1d(Th, {tags}{facets})"),
        (Domain::Boundary, _) => format!("int2d(Th, {tags}{facets})"),
        (Domain::Interior, _) => format!("intalledges(Th, {facets})"),
    }
}

/// The values of all unknowns at the nodes of cells, as VTU, for which FreeFEM has no writer of its own.
fn result(problem: &Problem, words: &Words, out: &str, output: Element) -> String {
    let dim = problem.dim;
    let (order, kind) = match (output.degree(), dim) {
        (1, 2) => ("0, 1, 2", 5),
        (1, _) => ("0, 1, 2, 3", 10),
        (_, 2) => ("0, 1, 2, 5, 3, 4", 22),
        (_, _) => ("0, 1, 2, 3, 4, 7, 5, 6, 8, 9", 24),
    };
    let axes = &["x", "y", "z"][..dim];
    let mut s = format!(
        "\n// The result as VTU: the nodes of {out}, in VTK's order.\nfespace Out(Th, {out});\nOut X = x, Y = y, Z = {};\n",
        axes.get(2).unwrap_or(&"0")
    );
    let mut arrays = vec!["X".to_owned(), "Y".into(), "Z".into()];
    let mut at = 0;
    let mut fields = Vec::new();
    for (k, unknown) in problem.unknowns.iter().enumerate() {
        let mut of_it = Vec::new();
        for part in words.parts(Field::Unknown(k)) {
            s += &format!("Out out{at} = {part};\n");
            of_it.push(format!("out{at}"));
            at += 1;
        }
        arrays.extend(of_it.iter().cloned());
        fields.push((unknown.name.clone(), of_it));
    }
    if !output.is_continuous() {
        let (nodes, shrink) = if dim == 2 { (3, "0.99") } else { (4, "0.9999") };
        s += &format!(
            "// The nodes of {out} are the vertices, drawn towards the centre of their cell by {shrink}: linear functions are drawn back.\n\
             func int drawBack(real[int] & a) {{\n  for (int k = 0; k < Th.nt; ++k) {{\n    real mean = 0;\n    for (int i = 0; i < {nodes}; ++i) mean += a[Out(k, i)]/{nodes};\n    \
             for (int i = 0; i < {nodes}; ++i) a[Out(k, i)] = mean + (a[Out(k, i)] - mean)/{shrink};\n  }}\n  return 0;\n}}\n"
        );
        for array in &arrays {
            s += &format!("drawBack({array}[]);\n");
        }
    }
    s += &format!(
        "int[int] order = [{order}];\n{{\n  ofstream file(writes);\n  file.precision(17);\n  \
         file << \"<VTKFile type='UnstructuredGrid' version='1.0' byte_order='LittleEndian'><UnstructuredGrid>\" << endl\n       \
         << \"<Piece NumberOfPoints='\" << Out.ndof << \"' NumberOfCells='\" << Th.nt << \"'>\" << endl\n       \
         << \"<Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>\" << endl;\n  \
         for (int i = 0; i < Out.ndof; ++i) file << X[][i] << \" \" << Y[][i] << \" \" << Z[][i] << endl;\n  \
         file << \"</DataArray></Points><Cells><DataArray type='Int64' Name='connectivity' format='ascii'>\" << endl;\n  \
         for (int k = 0; k < Th.nt; ++k) {{\n    for (int i = 0; i < order.n; ++i) file << Out(k, order[i]) << \" \";\n    file << endl;\n  }}\n  \
         file << \"</DataArray><DataArray type='Int64' Name='offsets' format='ascii'>\" << endl;\n  \
         for (int k = 1; k <= Th.nt; ++k) file << order.n*k << endl;\n  \
         file << \"</DataArray><DataArray type='UInt8' Name='types' format='ascii'>\" << endl;\n  \
         for (int k = 0; k < Th.nt; ++k) file << {kind} << endl;\n  file << \"</DataArray></Cells><PointData>\" << endl;\n"
    );
    for (name, parts) in fields {
        let values: Vec<String> = parts.iter().map(|part| format!("{part}[][i]")).collect();
        s += &format!(
            "  file << \"<DataArray type='Float64' Name='{name}' NumberOfComponents='{}' format='ascii'>\" << endl;\n  \
             for (int i = 0; i < Out.ndof; ++i) file << {} << endl;\n  file << \"</DataArray>\" << endl;\n",
            parts.len(),
            values.join(" << \" \" << ")
        );
    }
    s + "  file << \"</PointData></Piece></UnstructuredGrid></VTKFile>\" << endl;\n}\n"
}
