//! Functions of the point in NumPy, and the points of a result.

use faceoff_fem::scene::expression::Function;

use super::spelling::{Shared, Style};
use crate::problem::Element;
use crate::scalar::{Id, Node, Scalars};

/// NumPy's words for functions, powers and choices; of a choice it computes both values.
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
