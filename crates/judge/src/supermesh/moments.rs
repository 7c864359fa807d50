//! Functions of RT0, BDM1 and N1curl from their moments on facets and edges, as a table keyed by vertices has them.

use std::collections::HashMap;

use super::clip::{barycentric, cross, dot, subtract};
use super::domain::Domain;
use crate::parts::number;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{ResultField, Results, Unread};

/// An element whose functions follow from numbers of each facet or edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Element {
    /// The flux through each facet: in the plane from left to right of the edge from its lower to its higher vertex number; in space along
    /// (b - a) × (c - a) for vertices a < b < c.
    RaviartThomas,
    /// The same flux, weighted by the barycentric coordinate of each vertex of the facet, the vertex with the lowest number first.
    BrezziDouglasMarini,
    /// The integral of the tangential component along each edge, from its lower to its higher vertex number.
    Nedelec,
}

impl Element {
    /// `RT0(q)` is the function of RT0 with the column q, `BDM1(q)` that of BDM1 with the columns q0, q1 and in space q2.
    pub fn named(name: &str) -> Option<(Self, &str)> {
        let all = [
            ("RT0(", Element::RaviartThomas),
            ("BDM1(", Element::BrezziDouglasMarini),
            ("N1curl(", Element::Nedelec),
        ];
        all.into_iter().find_map(|(start, element)| {
            Some((element, name.strip_prefix(start)?.strip_suffix(')')?))
        })
    }

    /// The columns that its moments are in, in a table whose rows have this number of vertices.
    pub fn columns(self, name: &str, width: usize) -> Vec<String> {
        match self {
            Element::BrezziDouglasMarini => (0..width).map(|k| format!("{name}{k}")).collect(),
            _ => vec![name.to_owned()],
        }
    }

    /// The corners of each facet or edge of a simplex, by their positions in it.
    fn carriers(self, dim: usize) -> Vec<Vec<usize>> {
        match self {
            Element::RaviartThomas | Element::BrezziDouglasMarini => (0..=dim)
                .map(|i| (0..=dim).filter(|j| *j != i).collect())
                .collect(),
            Element::Nedelec => (0..=dim)
                .flat_map(|i| (0..i).map(move |j| vec![j, i]))
                .collect(),
        }
    }
}

/// A row is keyed by the sorted numbers of its vertices.
fn key(vertices: impl Iterator<Item = u32>) -> [u32; 3] {
    let mut key = [u32::MAX; 3];
    key.iter_mut()
        .zip(vertices)
        .for_each(|(k, vertex)| *k = vertex);
    key.sort_unstable();
    key
}

/// The function with these moments, linear on each cell of a mesh whose vertices the table numbers; or why there is none.
///
/// # Errors
/// [`faceoff_mesh::Error::Ended`].
pub(super) fn function(
    table: &Results,
    mesh: &Results,
    element: Element,
    name: &str,
) -> Result<Result<Results, String>> {
    let refuse = |why: String| Ok(Err(why));
    let domain = Domain::divided(mesh, 0.0)?;
    let dim = domain.dim;
    if domain.is_surface {
        return refuse("the mesh is a surface in space".into());
    }
    let carriers = element.carriers(dim);
    let width = carriers[0].len();
    if domain
        .elements
        .iter()
        .any(|of| of.degree > 1 || of.is_product())
    {
        return refuse("the mesh has other cells than straight triangles or tetrahedra".into());
    }
    if table.width != width || !table.points.is_empty() {
        let columns = &["v0", "v1", "v2"][..width.min(3)];
        return refuse(format!("its rows are not keyed by {}", columns.join(",")));
    }
    let names = element.columns(name, width);
    let mut columns = Vec::with_capacity(names.len());
    for name in &names {
        let mut named = table.on_cells.iter().filter(|field| field.name == *name);
        let (Some(field), None) = (named.next(), named.next()) else {
            return refuse(match names.len() {
                1 => "it is not one column".into(),
                _ => format!("its columns are not {}", names.join(", ")),
            });
        };
        if field.at.is_some() || field.components != 1 {
            return refuse("some rows have no value".into());
        }
        columns.push(field);
    }
    let field = columns[0];
    let mut rows = HashMap::with_capacity(table.cell_count());
    for row in 0..table.cell_count() {
        let of = key(table.cell(row));
        if rows.insert(of, (row, false)).is_some() {
            return refuse(format!("vertices {:?} have two rows", &of[..width]));
        }
    }
    let ids = crate::comparison::by_id(mesh);
    let (mut points, mut values) = (Vec::new(), Vec::new());
    for piece in &domain.pieces {
        cancel::check()?;
        let corners: Vec<u32> = mesh.cell(piece.cell as usize).collect();
        let vertices: Vec<u32> = corners.iter().map(|point| number(&ids, *point)).collect();
        let origin = mesh.points[corners[0] as usize];
        let mut x = [[0.0; 3]; 4];
        for (x, point) in x.iter_mut().zip(&corners) {
            *x = subtract(&mesh.points[*point as usize], &origin);
            x[dim..].fill(0.0);
        }
        let gradients = barycentric(dim, &x);
        let mut at = vec![[0.0; 3]; dim + 1];
        for carrier in &carriers {
            let of = key(carrier.iter().map(|k| vertices[*k]));
            let Some((row, is_used)) = rows.get_mut(&of) else {
                return refuse(format!(
                    "vertices {:?} of cell {} have no row",
                    &of[..width],
                    piece.cell
                ));
            };
            *is_used = true;
            let moments: Vec<f64> = columns.iter().map(|column| column.values[*row]).collect();
            let mut ends = carrier.clone();
            ends.sort_unstable_by_key(|k| vertices[*k]);
            if element == Element::Nedelec {
                let [a, b] = [ends[0], ends[1]];
                for k in 0..3 {
                    at[a][k] += moments[0] * gradients[b][k];
                    at[b][k] -= moments[0] * gradients[a][k];
                }
                continue;
            }
            // f (x - x_i) / (d |K|), f outward; ∇λ_i points inward. At a vertex f is |F| times the normal component there.
            let opposite = (0..=dim).find(|k| !carrier.contains(k)).unwrap_or_default();
            let along = subtract(&x[ends[1]], &x[ends[0]]);
            let normal = match dim {
                2 => [along[1], -along[0], 0.0],
                _ => cross(&along, &subtract(&x[ends[2]], &x[ends[0]])),
            };
            let inward = dot(&normal, &gradients[opposite]);
            let factor = -inward.signum() / (dim as f64 * domain.piece_measure(piece).abs());
            for (corner, flux) in ends.iter().zip(at_vertices(&moments, dim)) {
                let away = subtract(&x[*corner], &x[opposite]);
                (0..3).for_each(|k| at[*corner][k] += factor * flux * away[k]);
            }
        }
        points.extend(corners.iter().map(|point| mesh.points[*point as usize]));
        values.extend(at.iter().flat_map(|v| &v[..dim]));
    }
    let unused = rows.iter().filter(|(_, (_, is_used))| !is_used);
    if let Some(of) = unused.map(|(of, _)| of).min() {
        return refuse(format!(
            "the mesh has nothing between the vertices {:?} of a row",
            &of[..width]
        ));
    }
    // What else the table has is not on this mesh, and must not be lost in silence, by whatever name it is asked for.
    let others = table.on_cells.iter();
    let others = others.filter(|other| !names.contains(&other.name));
    let others = others.flat_map(|other| {
        let other = &other.name;
        let what =
            format!("`{other}` is another column of the table of `{name}`: compare it by itself");
        [
            other.clone(),
            format!("RT0({other})"),
            format!("BDM1({other})"),
            format!("N1curl({other})"),
        ]
        .map(|name| Unread::new(name, what.clone()))
    });
    let kinds = vec![(domain.elements[0].kind, domain.pieces.len())];
    Ok(Ok(Results {
        source: table.source.clone(),
        space: dim,
        width: dim + 1,
        cells: (0..points.len() as u32).collect(),
        points: points.into(),
        kinds,
        on_points: vec![ResultField {
            name: name.to_owned(),
            components: dim,
            values: values.into(),
            ..field.clone()
        }],
        whole: table.whole.clone(),
        unread: table.unread.iter().cloned().chain(others).collect(),
        ..Results::default()
    }))
}

/// |F| times the normal component at each vertex of a facet in `dim` dimensions, the vertex with the lowest number first: one moment is the
/// flux of a constant, several are those of a linear function, ∫ λ_i λ_j = |F| (1 + δ_ij) / (d (d + 1)).
fn at_vertices(moments: &[f64], dim: usize) -> Vec<f64> {
    match moments {
        [flux] => vec![*flux; dim],
        _ => {
            let d = dim as f64;
            let part = moments.iter().sum::<f64>() / (d + 1.0);
            moments.iter().map(|m| d * (d + 1.0) * (m - part)).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::derive;
    use faceoff_mesh::CellKind;

    /// Two simplices, with vertices numbered against their places, and a function that the element has: its values and moments.
    fn given(dim: usize, element: Element) -> (Results, Results) {
        let points: Vec<[f64; 3]> = match dim {
            2 => vec![
                [1.0, 1.2, 0.0],
                [0.1, 0.0, 0.0],
                [1.0, 0.2, 0.0],
                [-0.3, 1.0, 0.0],
            ],
            _ => vec![
                [0.2, 0.1, 1.0],
                [0.0, 0.0, 0.1],
                [1.0, 0.0, 0.0],
                [0.1, 1.1, 0.0],
                [0.3, 0.2, -1.0],
            ],
        };
        let cells: Vec<u32> = match dim {
            2 => vec![2, 0, 1, 0, 3, 1],
            _ => vec![1, 2, 3, 0, 1, 3, 2, 4],
        };
        let mesh = Results {
            source: "mesh".into(),
            space: dim,
            width: dim + 1,
            kinds: vec![([CellKind::Triangle, CellKind::Tetrahedron][dim - 2], 2)],
            points: points.clone().into(),
            cells: cells.clone().into(),
            ..Results::default()
        };
        let mut rows: Vec<Vec<u32>> = Vec::new();
        for cell in cells.chunks(dim + 1) {
            for carrier in element.carriers(dim) {
                let mut of: Vec<u32> = carrier.iter().map(|k| cell[*k]).collect();
                of.sort_unstable();
                rows.push(of);
            }
        }
        rows.sort();
        rows.dedup();
        let u = value(dim, element);
        // Of a linear function: the value in the middle times the direction. Weighted by a barycentric coordinate, the integral of which is the d-th
        // part: the value in the middle of the weight, which has (2, 1, …) / (d + 1).
        let moment = |of: &Vec<u32>, vertex: usize| {
            let x: Vec<[f64; 3]> = of.iter().map(|p| points[*p as usize]).collect();
            let is_weighted = element == Element::BrezziDouglasMarini;
            let weight = |i: usize| 1.0 + f64::from(u8::from(is_weighted && i == vertex));
            let all: f64 = (0..x.len()).map(weight).sum();
            let middle = [0, 1, 2].map(|k| {
                let each = x.iter().enumerate().map(|(i, x)| weight(i) * x[k]);
                each.sum::<f64>() / all
            });
            let share = if is_weighted { 1.0 / dim as f64 } else { 1.0 };
            let along = subtract(&x[1], &x[0]);
            let direction = match (element, dim) {
                (Element::Nedelec, _) => along,
                (_, 2) => [along[1], -along[0], 0.0],
                _ => cross(&along, &subtract(&x[2], &x[0])).map(|n| 0.5 * n),
            };
            share * dot(&u(&middle), &direction)
        };
        let table = Results {
            source: "q.csv".into(),
            space: 2,
            width: rows[0].len(),
            on_cells: element
                .columns("q", rows[0].len())
                .into_iter()
                .enumerate()
                .map(|(k, name)| ResultField {
                    name,
                    components: 1,
                    values: rows.iter().map(|of| moment(of, k)).collect(),
                    rest: None,
                    at: None,
                    scaled_by: None,
                    single: false,
                })
                .collect(),
            // The order in a row says nothing.
            cells: rows
                .iter()
                .flat_map(|of| of.iter().rev().copied())
                .collect(),
            ..Results::default()
        };
        (table, mesh)
    }

    fn value(dim: usize, element: Element) -> impl Fn(&[f64; 3]) -> [f64; 3] {
        move |x| {
            let mut v = match element {
                Element::BrezziDouglasMarini => [
                    0.7 + 2.0 * x[0] - x[1],
                    -0.2 + x[0] + 5.0 * x[1] + 0.5 * x[2],
                    0.4 - x[0] + 3.0 * x[2],
                ],
                Element::RaviartThomas => [0.7 + 2.0 * x[0], -0.2 + 2.0 * x[1], 0.4 + 2.0 * x[2]],
                Element::Nedelec if dim == 2 => [0.7 - 3.0 * x[1], -0.2 + 3.0 * x[0], 0.0],
                Element::Nedelec => {
                    let turned = cross(&[1.0, -2.0, 3.0], x);
                    [0.7 + turned[0], -0.2 + turned[1], 0.4 + turned[2]]
                }
            };
            v[dim..].fill(0.0);
            v
        }
    }

    #[test]
    fn functions_follow_from_their_moments() {
        for (dim, element) in [2, 3].into_iter().flat_map(|dim| {
            [
                Element::RaviartThomas,
                Element::BrezziDouglasMarini,
                Element::Nedelec,
            ]
            .map(|of| (dim, of))
        }) {
            let (table, mesh) = given(dim, element);
            let found = function(&table, &mesh, element, "q").unwrap().unwrap();
            let u = value(dim, element);
            let values = found.on_points[0].values.chunks(dim);
            for (x, v) in found.points.iter().zip(values) {
                let exact = u(x);
                assert!(
                    (0..dim).all(|k| (v[k] - exact[k]).abs() < 1e-13),
                    "{dim} {element:?} {x:?}: {v:?}"
                );
            }
            let (name, operator, exact) = match (element, dim) {
                (Element::BrezziDouglasMarini, 2) => ("BDM1(q)", "div", vec![7.0]),
                (Element::BrezziDouglasMarini, _) => ("BDM1(q)", "div", vec![10.0]),
                (Element::RaviartThomas, 2) => ("RT0(q)", "div", vec![4.0]),
                (Element::RaviartThomas, _) => ("RT0(q)", "div", vec![6.0]),
                (Element::Nedelec, 2) => ("N1curl(q)", "curl", vec![6.0]),
                (Element::Nedelec, _) => ("N1curl(q)", "curl", vec![2.0, -4.0, 6.0]),
            };
            let mut side = table.clone();
            let derived = format!("{operator}({name})");
            assert!(derive(&mut side, &derived, Some(&mesh)).unwrap());
            for row in side.on_cells[0].values.chunks(exact.len()) {
                assert!(
                    row.iter().zip(&exact).all(|(v, e)| (v - e).abs() < 1e-12),
                    "{row:?}"
                );
            }
            assert!(derive(&mut table.clone(), name, None).is_err());
        }
    }

    #[test]
    fn tables_of_no_function_are_refused() {
        let (table, mesh) = given(2, Element::RaviartThomas);
        let refused = |change: &dyn Fn(&mut Results)| {
            let mut table = table.clone();
            change(&mut table);
            function(&table, &mesh, Element::RaviartThomas, "q")
                .unwrap()
                .unwrap_err()
        };
        assert!(refused(&|t| t.cells.to_mut()[0] = 9).contains("have no row"));
        let twice = |t: &mut Results| {
            t.cells.to_mut().extend([3, 2]);
            t.on_cells[0].values.to_mut().push(1.0);
        };
        assert!(refused(&twice).contains("nothing between the vertices [2, 3]"));
        let same = |t: &mut Results| {
            let first = [t.cells[1], t.cells[0]];
            t.cells.to_mut().extend(first);
            t.on_cells[0].values.to_mut().push(1.0);
        };
        assert!(refused(&same).contains("two rows"));
        assert!(refused(&|t| t.on_cells[0].at = Some(vec![0])).contains("no value"));
        assert!(refused(&|t| t.width = 3).contains("not keyed by v0,v1"));
        assert!(refused(&|t| t.on_cells[0].name = "p".into()).contains("not one column"));
        // Another column is not lost in silence.
        let mut both = table.clone();
        let p = ResultField {
            name: "p".into(),
            ..table.on_cells[0].clone()
        };
        both.on_cells.push(p);
        let found = function(&both, &mesh, Element::RaviartThomas, "q")
            .unwrap()
            .unwrap();
        assert_eq!(found.unread[0].name, "p");
    }
}
