//! What scripts in Python have in common: reading MSH, writing VTU, and scalars in the words of NumPy.

use faceoff_fem::quadrature::Rule;
use faceoff_fem::scene::expression::Function;

use crate::problem::{Element, Problem, Time};
use crate::scalar::{Id, Node, Scalars};

use super::spelling::Words;
use super::spelling::{Shared, Spelling, Style, head, indented};

/// Words of Python and of the frame.
pub const RESERVED: &str = "False None True and as assert async await break class continue def del elif else except finally for from global \
    if import in is lambda nonlocal not or pass raise return try while with abs float int len list map max min open pow print range repr \
    set str sum tuple zip all any bool dict divmod enumerate getattr hasattr iter next slice sorted i j vertices values here own numpy pathlib \
    __file__ np sys Path x y z n h pi reads writes points cells regions facets labels read_msh write_vtu step A r d form";

/// A function in NumPy.
pub fn numpy_call(function: Function, arguments: &[String]) -> String {
    let name = match function {
        Function::Asin => "arcsin",
        Function::Acos => "arccos",
        Function::Atan => "arctan",
        Function::Atan2 => "arctan2",
        Function::Min => "minimum",
        Function::Max => "maximum",
        other => other.names()[0],
    };
    format!("np.{name}({})", arguments.join(", "))
}

/// Values of both branches, of which one is taken.
pub fn numpy_choice(sign: &str, [a, b, c, d]: &[String; 4]) -> String {
    format!("np.where({a} {sign} {b}, {c}, {d})")
}

/// The form in NumPy's functions.
pub const NUMPY: Style = Style {
    call: numpy_call,
    power: |base, n| n.after(base, "**"),
    choice: numpy_choice,
};

/// A function of the point as an expression of arrays, the coordinates `axes`; its value has their shape.
pub fn numpy(
    scalars: &Scalars,
    id: Id,
    axes: [&str; 3],
    parameter: &dyn Fn(usize) -> String,
) -> String {
    let end = |node: Node| match node {
        Node::Pi => "np.pi".into(),
        Node::Parameter(k) => parameter(k),
        Node::Coordinate(k) => axes[k].into(),
        _ => String::new(),
    };
    let spelling = Spelling {
        end: &end,
        call: numpy_call,
        power: |base, n| n.after(base, "**"),
        choice: numpy_choice,
    };
    let text = spelling.text(scalars, id, &Shared::new());
    let varies = scalars
        .nodes_of([id])
        .iter()
        .any(|id| matches!(scalars.node(*id), Node::Coordinate(_)));
    if varies {
        text
    } else {
        format!("{text} + 0*{}", axes[0])
    }
}

/// The top of a script: what it solves, the imports, files, and parameters.
pub fn top(problem: &mut Problem, suffix: &str, imports: &str, words: &Words) -> String {
    let mesh = format!("{}.msh", problem.name);
    let program = format!("{}{suffix}", problem.name);
    let text = head(
        problem,
        &format!(
            "python3 {program} reads {mesh} and writes {}.",
            program.replace(".py", ".vtu")
        ),
    );
    let mut s = format!(
        "\"\"\"{}\n\"\"\"\n\nimport sys\nfrom pathlib import Path\n\nimport numpy as np\n{imports}\n",
        text.join("\n")
    );
    s += &format!(
        "\nhere = Path(__file__)\nreads, writes = sys.argv[1:3] or (here.with_name(\"{mesh}\"), here.with_suffix(\".vtu\"))\n"
    );
    for (name, parameter) in words.parameters.iter().zip(&problem.parameters) {
        s += &format!("{name} = {:?}\n", parameter.value);
    }
    s + &READ_MSH.replace("DIM", &problem.dim.to_string()).replace(
        "KINDS",
        if problem.dim == 2 {
            "(\"2\", \"1\")"
        } else {
            "(\"4\", \"2\")"
        },
    )
}

const READ_MSH: &str = r#"

def read_msh(path):
    """Points, and cells and facets (vertices, numbers of groups), of an MSH file: version 2.2, ASCII."""
    lines = iter(Path(path).read_text().splitlines())
    rows = {}
    for line in lines:
        if line in ("$Nodes", "$Elements"):
            rows[line] = [next(lines).split() for _ in range(int(next(lines)))]
    number = {row[0]: i for i, row in enumerate(rows["$Nodes"])}
    points = np.array([row[1 : DIM + 1] for row in rows["$Nodes"]], float)

    def elements(kind):
        found = [row for row in rows["$Elements"] if row[1] == kind]
        vertices = [[number[i] for i in row[3 + int(row[2]) :]] for row in found]
        return np.array(vertices, np.int64), np.array([int(row[3]) for row in found], np.int32)

    return points, *map(elements, KINDS)


points, (cells, regions), (facets, labels) = read_msh(reads)
"#;

/// A rule as two lists; the weights sum to the volume of the reference simplex.
pub fn rule(rule: &Rule) -> (String, String) {
    let dim = rule.points[0].len();
    let volume = [1.0, 0.5, 1.0 / 6.0][dim - 1];
    let points = rule
        .points
        .iter()
        .map(|point| format!("{point:?}"))
        .collect::<Vec<_>>();
    let weights: Vec<f64> = rule.weights.iter().map(|w| w * volume).collect();
    let lines: Vec<String> = points.chunks(2).map(|chunk| chunk.join(", ")).collect();
    let rows: Vec<String> = weights
        .chunks(4)
        .map(|w| {
            w.iter()
                .map(|w| format!("{w:?}"))
                .collect::<Vec<_>>()
                .join(", ")
        })
        .collect();
    (
        format!("[\n    {},\n]", lines.join(",\n    ")),
        format!("[\n    {},\n]", rows.join(",\n    ")),
    )
}

/// The nodes of VTK's cell of a result, as barycentric coordinates, and its type.
///
/// # Errors
/// Cells that are not written.
pub fn nodes(output: Element, dim: usize) -> Result<(Vec<Vec<f64>>, u8), String> {
    let vertex = |i: usize| {
        (0..=dim)
            .map(|k| f64::from(u8::from(k == i)))
            .collect::<Vec<f64>>()
    };
    let on_edge = |(i, j): (usize, usize), t: f64| {
        let [a, b] = [vertex(i), vertex(j)];
        a.iter()
            .zip(&b)
            .map(|(a, b)| (1.0 - t) * a + t * b)
            .collect::<Vec<f64>>()
    };
    let edges = &[(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)][..if dim == 2 { 3 } else { 6 }];
    let mut all: Vec<Vec<f64>> = (0..=dim).map(vertex).collect();
    Ok(match (output.degree(), dim) {
        (1, 2) => (all, 5),
        (1, _) => (all, 10),
        (2, _) => {
            all.extend(edges.iter().map(|edge| on_edge(*edge, 0.5)));
            (all, if dim == 2 { 22 } else { 24 })
        }
        (3, 2) => {
            for edge in edges {
                all.extend([1.0 / 3.0, 2.0 / 3.0].map(|t| on_edge(*edge, t)));
            }
            all.push(vec![1.0 / 3.0; 3]);
            (all, 69)
        }
        _ => return Err("P3 is not written in 3D".into()),
    })
}

/// A step of Newton's method with given means: `rows` times the dofs are their integrals, `wanted` the values of these.
pub const BORDERED: &str = r#"    border = scipy.sparse.csc_matrix(rows[:, free])
    both = scipy.sparse.bmat([[A.tocsc()[free][:, free], border.T], [border, None]], format="csc")
    d[free] = splu(both).solve(np.concatenate([(r - A @ d)[free], rows @ total - wanted]))[: free.sum()]
"#;

/// The loop over steps in time: what sets the time to that at the end of step `number`, what keeps the step before, and what solves one.
pub fn steps(
    time: &Time,
    words: &Words,
    clock: fn(&str, &str) -> String,
    keep: &str,
    solve: &str,
) -> String {
    let [t, dt] = [0, 1].map(|k| words.parameters[time.parameter + k].as_str());
    let clock = clock(t, dt);
    format!(
        "\n# Steps in time: {t} is that at the end of a step.\nfor number in range(1, {}):\n{}",
        time.steps + 1,
        indented(&format!("{clock}\n{keep}{solve}"), "    ")
    )
}

/// The end of a script: the writer of VTU and its call. `at` is an array cells × nodes × 3 of the places of the nodes, `values` are pairs of
/// names and arrays cells × nodes (× components).
pub fn bottom(output: Element, kind: u8, values: &[(String, String)]) -> String {
    let merge = match output.is_continuous() {
        true => {
            "    # Continuous functions: cells share nodes at the same place.\n    \
                 _, first, nodes = np.unique(np.round(at/np.ptp(at), 9), axis=0, return_index=True, return_inverse=True)\n"
        }
        false => "    first = nodes = np.arange(len(at))  # each cell has its own nodes\n",
    };
    let fields: Vec<String> = values
        .iter()
        .map(|(name, value)| format!("\"{name}\": {value}"))
        .collect();
    format!(
        "\n\ndef write_vtu(path, at, fields):\n    \"\"\"Coordinates of the nodes of each cell, in VTK's order, and the values there.\"\"\"\n    \
         shape, at = at.shape[:2], at.reshape(-1, 3)\n{merge}\n    \
         def array(name, values, kind=\"Float64\"):\n        size = 1 if values.ndim == 1 else values.shape[1]\n        \
         text = \" \".join(map(repr, values.ravel().tolist()))\n        \
         return f\"<DataArray type='{{kind}}' Name='{{name}}' NumberOfComponents='{{size}}' format='ascii'>{{text}}</DataArray>\"\n\n    \
         data = [array(name, values.reshape(len(at), -1)[first]) for name, values in fields.items()]\n    \
         Path(path).write_text(\n        \"<VTKFile type='UnstructuredGrid' version='1.0' byte_order='LittleEndian'><UnstructuredGrid>\"\n        \
         f\"<Piece NumberOfPoints='{{len(first)}}' NumberOfCells='{{shape[0]}}'>\"\n        \
         f\"<Points>{{array('points', at[first])}}</Points><Cells>\"\n        \
         + array(\"connectivity\", nodes.reshape(-1), \"Int64\")\n        \
         + array(\"offsets\", shape[1]*np.arange(1, shape[0] + 1), \"Int64\")\n        \
         + array(\"types\", np.full(shape[0], {kind}), \"UInt8\")\n        \
         + f\"</Cells><PointData>{{''.join(data)}}</PointData></Piece></UnstructuredGrid></VTKFile>\\n\"\n    )\n\n\n\
         write_vtu(writes, at, {{{}}})\n",
        fields.join(", ")
    )
}
