//! Functions of the point in NumPy, and the points of a result.

use faceoff_fem::scene::expression::Function;
use faceoff_mesh::io::vtk_nodes;
use faceoff_mesh::mesh::CellKind;

use super::spelling::{Shared, Style};
use crate::grid::Cells;
use crate::problem::Element;
use crate::scalar::{Id, Node, Scalars};

/// NumPy's spellings of functions, powers and conditionals; for a conditional it computes both values.
pub const NUMPY: Style = Style {
    call: |function, arguments| {
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
    },
    power: |base, n| n.after(base, "**"),
    choice: |sign, [a, b, c, d]| format!("np.where({a} {sign} {b}, {c}, {d})"),
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
    let spelling = NUMPY.with(&end);
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

/// The nodes of VTK's cell of a result, as positions in the reference cell, and its type.
///
/// # Errors
/// Cells for which there is no output.
pub fn nodes(output: Element, cells: Cells, dim: usize) -> Result<(Vec<Vec<f64>>, u8), String> {
    let kind = CellKind::complete(cells.shape(dim), output.degree());
    match kind.and_then(vtk_nodes) {
        Some((number, nodes)) if output.degree() < 3 || dim == 2 => {
            let place = |[x, y, z]: [f64; 3]| [1.0 - (x + y + z), x, y, z][..=dim].to_vec();
            Ok((nodes.into_iter().map(place).collect(), number))
        }
        _ => Err("P3 is not written in 3D".into()),
    }
}
