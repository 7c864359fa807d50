//! Checks whether two files have the same cells. Cells are part of a result: the same values on points with a different
//! connectivity are a different function.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::parts::number;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{PADDING, Results};
use faceoff_mesh::io::reference_nodes;
use faceoff_mesh::mesh::{CellKind, Shape};

/// Compares the cells of the dimensions that both files have, in any order, each as a set of vertices; in O(N log N). If
/// only one side has some cells, returns how many, and the first of them.
///
/// # Errors
/// [`faceoff_mesh::Error::Ended`].
pub(super) fn other_cells(a: (&Results, &[u32]), b: (&Results, &[u32])) -> Result<Option<String>> {
    // A table of points has no cells.
    if a.0.cell_count() == 0 || b.0.cell_count() == 0 {
        return Ok(None);
    }
    let width = a.0.width.max(b.0.width);
    let orders = [a.0, b.0].map(Order::of_all);
    // If a file does not state the kinds of its cells, the order of their nodes is unknown.
    let ordered = orders.iter().all(|of| !of.is_empty())
        && orders
            .iter()
            .flatten()
            .any(|(order, _)| !order.pairs.is_empty());
    let orders = orders.each_ref().map(|of| ordered.then_some(&**of));
    let (of_a, of_b) = (
        Cells::new(a.0, a.1, width, &b.0.dimensions(), orders[0])?,
        Cells::new(b.0, b.1, width, &a.0.dimensions(), orders[1])?,
    );
    let (mut i, mut j) = (0, 0);
    let (mut only_a, mut only_b) = (Vec::new(), Vec::new());
    loop {
        cancel::check()?;
        let order = match (of_a.order.get(i), of_b.order.get(j)) {
            (None, None) => break,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(&k), Some(&l)) => of_a.key(k).cmp(of_b.key(l)),
        };
        match order {
            Ordering::Less => only_a.push(of_a.order[i]),
            Ordering::Greater => only_b.push(of_b.order[j]),
            Ordering::Equal => {}
        }
        i += usize::from(order.is_le());
        j += usize::from(order.is_ge());
    }
    let (only, others, of, with, side, other) = if only_a.is_empty() {
        (only_b, only_a, of_b, of_a, b.0, a.0)
    } else {
        (only_a, only_b, of_a, of_b, a.0, b.0)
    };
    let Some(&first) = only.iter().min_by_key(|k| of.cells[**k as usize]) else {
        return Ok(None);
    };
    let vertices = of.key(first)[..width].iter().filter(|v| **v != PADDING);
    let vertices: Vec<_> = vertices.collect();
    let cell = of.cells[first as usize] as usize;
    let place = side.centroid(cell);
    let place = place.map_or(String::new(), |x| format!(" at {:?}", &x[..side.space]));
    let is_turned = others
        .iter()
        .any(|k| with.key(*k)[..width] == of.key(first)[..width]);
    let turned = if is_turned {
        ", whose nodes are in a different order there"
    } else {
        ""
    };
    Ok(Some(format!(
        "{} of {} cells of {} are not in {}: the first is {vertices:?}{place}{turned}",
        only.len(),
        of.cells.len(),
        side.source,
        other.source
    )))
}

/// Some of the cells of a file.
struct Cells {
    /// Node numbers of each cell, ascending, padded with [`PADDING`]; then, if there are any orders, two numbers of [`Order::of`], since the
    /// same nodes in a different order may be a different cell.
    keys: Vec<u32>,
    /// Numbers per cell in `keys`.
    width: usize,
    /// The index in the file of each cell.
    cells: Vec<u32>,
    /// The cells, sorted by their keys.
    order: Vec<u32>,
}

impl Cells {
    /// The cells of some dimensions; all cells if a file does not state dimensions.
    fn new(
        side: &Results,
        numbers: &[u32],
        width: usize,
        dims: &[u8],
        orders: Option<&[(Order, usize)]>,
    ) -> Result<Self> {
        let all = dims.is_empty() || side.kinds.is_empty();
        let mut found = Cells {
            keys: Vec::new(),
            width: width + if orders.is_some() { 2 } else { 0 },
            cells: Vec::new(),
            order: Vec::new(),
        };
        let runs = orders.into_iter().flatten();
        let mut runs = runs.flat_map(|(order, count)| std::iter::repeat_n(order, *count));
        let mut nodes = Vec::new();
        for (cell, dim) in side.cell_dimensions().iter().enumerate() {
            let order = runs.next();
            cancel::check()?;
            if all || dims.contains(dim) {
                let start = found.keys.len();
                let of_cell = side.cell(cell).map(|point| number(numbers, point));
                found.keys.extend(of_cell);
                found.keys[start..].sort_unstable();
                found.keys.resize(start + width, PADDING);
                if orders.is_some() {
                    nodes.clear();
                    nodes.extend(side.cell(cell).map(|point| number(numbers, point)));
                    let order = order.map_or(0, |order| order.of(&nodes));
                    found.keys.extend([order as u32, (order >> 32) as u32]);
                }
                found.cells.push(cell as u32);
            }
        }
        let mut order: Vec<u32> = (0..found.cells.len() as u32).collect();
        order.par_sort_unstable_by(|&k, &l| found.key(k).cmp(found.key(l)));
        found.order = order;
        Ok(found)
    }

    fn key(&self, k: u32) -> &[u32] {
        &self.keys[self.width * k as usize..self.width * (k as usize + 1)]
    }
}

/// Pairs of nodes of one kind of cell with their distances in the most regular such cell. They are the same for all ways to
/// number the cell, mirrored ones included, and for no other order of its nodes.
struct Order {
    /// Two nodes, the second of which is a corner, and their distance.
    pairs: Vec<(usize, usize, u64)>,
}

impl Order {
    /// One for each run of cells of the same kind, with the number of these cells.
    fn of_all(side: &Results) -> Vec<(Self, usize)> {
        let runs = side.kinds.iter();
        runs.map(|(kind, count)| (Order::new(*kind), *count))
            .collect()
    }

    fn new(kind: CellKind) -> Self {
        let nodes = regular(kind);
        let corners = kind.corners().min(nodes.len());
        let far = |i: usize, j: usize| -> f64 {
            let [x, y]: [[f64; 3]; 2] = [nodes[i], nodes[j]];
            (0..3).map(|k| (x[k] - y[k]).powi(2)).sum()
        };
        let pairs = (0..nodes.len()).flat_map(|i| (0..corners.min(i)).map(move |j| (i, j)));
        // Squares of multiples of 1/p up to p = 10 are never halfway between two of these.
        let pairs = pairs.map(|(i, j)| (i, j, (1e6 * far(i, j)).round() as u64));
        let mut pairs: Vec<(usize, usize, u64)> = pairs.collect();
        // All corners of a simplex are equivalent.
        if pairs.iter().all(|pair| pair.2 == pairs[0].2) {
            pairs.clear();
        }
        Order { pairs }
    }

    /// A number that depends on the order of these nodes as the cell does.
    fn of(&self, nodes: &[u32]) -> u64 {
        let pairs = self.pairs.iter().filter(|(i, ..)| *i < nodes.len());
        let each = pairs.map(|(i, j, far)| {
            let (v, w) = (nodes[*i].min(nodes[*j]), nodes[*i].max(nodes[*j]));
            scattered((u64::from(v) << 32 | u64::from(w)) ^ scattered(*far))
        });
        each.fold(0, u64::wrapping_add)
    }
}

/// The finaliser of the generator SplitMix64.
fn scattered(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The nodes of a regular cell. If the inner nodes of a kind are not known here, only its corners; empty for a polyhedron.
fn regular(kind: CellKind) -> Vec<[f64; 3]> {
    let (shape, count) = (kind.shape(), kind.points());
    if shape == Shape::Polygon {
        let turn = std::f64::consts::TAU / kind.corners() as f64;
        let corners = (0..kind.corners()).map(|k| turn * k as f64);
        return corners
            .map(|angle| [angle.cos(), angle.sin(), 0.0])
            .collect();
    }
    if shape == Shape::Pyramid {
        let base = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        return [&base[..], &[[0.5, 0.5, 0.9]]].concat();
    }
    let of = |order| CellKind::complete(shape, order).and_then(reference_nodes);
    let whole = kind.complete_order().and_then(of);
    // Without inner nodes, the other nodes have the same order.
    let nodes = whole.or_else(|| of(kind.order()?).filter(|nodes| nodes.len() > count));
    let mut nodes = nodes.or_else(|| of(1)).unwrap_or_default();
    nodes.truncate(count);
    match shape {
        Shape::Triangle | Shape::Tetrahedron | Shape::Prism => {
            nodes.iter_mut().for_each(|[x, y, z]| {
                // From the unit simplex to the regular one; the height of a prism is a little larger than its width.
                let up = if shape == Shape::Prism {
                    [0.0, 0.0, 1.1]
                } else {
                    [0.5, 0.75_f64.sqrt() / 3.0, (2.0_f64 / 3.0).sqrt()]
                };
                let p = [
                    *x + 0.5 * *y + up[0] * *z,
                    0.75_f64.sqrt() * *y + up[1] * *z,
                    up[2] * *z,
                ];
                [*x, *y, *z] = p;
            });
        }
        _ => {}
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MatchBy, Settings, Verdict, compare_results};
    use faceoff_mesh::field::ResultField;

    /// The same nodes in an order that is not a numbering of the same cell: another hexahedron, or a midpoint on another edge.
    #[test]
    fn nodes_of_a_cell_in_another_order_are_another_cell() {
        let cell = |kind: CellKind, places: &[[f64; 3]], order: &[u32]| Results {
            source: "q".into(),
            points: places.to_vec().into(),
            space: 3,
            cells: order.to_vec().into(),
            width: order.len(),
            kinds: vec![(kind, 1)],
            on_points: vec![ResultField {
                name: "u".into(),
                components: 1,
                values: (0..places.len())
                    .map(|k| 1.0 + k as f64)
                    .collect::<Vec<_>>()
                    .into(),
                rest: None,
                at: None,
                scaled_by: None,
                single: false,
            }],
            ..Results::default()
        };
        let cube: Vec<[f64; 3]> = [
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [1, 1, 1],
            [0, 1, 1],
        ]
        .map(|x: [i32; 3]| x.map(f64::from))
        .to_vec();
        let six = vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.0, 0.0],
            [0.5, 0.5, 0.0],
            [0.0, 0.5, 0.0],
        ];
        let prism: Vec<[f64; 3]> = [
            [0, 0, 0],
            [1, 0, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [0, 1, 1],
        ]
        .map(|x: [i32; 3]| x.map(f64::from))
        .to_vec();
        let pyramid: Vec<[f64; 3]> = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]]
            .map(|x: [i32; 3]| x.map(f64::from))
            .to_vec();
        type Orders<'a> = &'a [&'a [u32]];
        let cases: [(CellKind, &[[f64; 3]], Orders, Orders); 4] = [
            (
                CellKind::Hexahedron,
                &cube,
                &[
                    &[1, 2, 3, 0, 5, 6, 7, 4],
                    &[4, 5, 6, 7, 0, 1, 2, 3],
                    &[0, 4, 7, 3, 1, 5, 6, 2],
                ],
                &[
                    &[0, 1, 3, 2, 4, 5, 7, 6],
                    &[0, 1, 2, 3, 5, 6, 7, 4],
                    &[0, 1, 2, 3, 4, 5, 7, 6],
                ],
            ),
            (
                CellKind::Triangle6,
                &six,
                &[&[1, 2, 0, 4, 5, 3], &[0, 2, 1, 5, 4, 3]],
                &[&[0, 1, 2, 4, 5, 3], &[0, 1, 2, 3, 5, 4]],
            ),
            (
                CellKind::Prism,
                &prism,
                &[&[1, 2, 0, 4, 5, 3], &[3, 4, 5, 0, 1, 2]],
                &[&[0, 1, 2, 4, 5, 3], &[0, 1, 5, 3, 4, 2]],
            ),
            (
                CellKind::Pyramid,
                &pyramid,
                &[&[1, 2, 3, 0, 4], &[3, 2, 1, 0, 4]],
                &[&[0, 2, 1, 3, 4], &[4, 1, 2, 3, 0]],
            ),
        ];
        let compare = |a: &Results, b: &Results, map: Option<MatchBy>| {
            let settings = Settings {
                map,
                ..Settings::default()
            };
            compare_results(a, b, &settings)
        };
        let verdict =
            |a: &Results, b: &Results| compare(a, b, None).ok().map(|found| found.verdict);
        for (kind, places, same, others) in cases {
            let whole: Vec<u32> = (0..places.len() as u32).collect();
            let whole = cell(kind, places, &whole);
            for order in same {
                assert_eq!(
                    verdict(&whole, &cell(kind, places, order)),
                    Some(Verdict::Agree),
                    "{kind}, {order:?}"
                );
            }
            for order in others {
                let found = compare(&whole, &cell(kind, places, order), Some(MatchBy::Vertices));
                let told = found.unwrap_err().to_string();
                assert!(
                    told.contains("whose nodes are in a different order"),
                    "{kind}, {order:?}: {told}"
                );
                assert_ne!(
                    verdict(&whole, &cell(kind, places, order)),
                    Some(Verdict::Agree),
                    "{kind}, {order:?}"
                );
            }
        }
    }
}
