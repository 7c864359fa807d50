//! Points and cells of an XDMF grid. The order of nodes is VTK's.

use super::item::Items;
use crate::error::Result;
use crate::io::elements::{self, ELEMENTS};
use crate::io::raw::Nodes;
use crate::io::raw::RawNumbers;
use crate::io::vtu::cells::order;
use crate::mesh::{Array, CellKind};

/// XDMF's name and number of a kind.
pub fn name(kind: CellKind) -> Option<(&'static str, i64)> {
    let number = elements::name(|element| element.xdmf, kind)?;
    let names = elements::name(|element| element.xdmf_names, kind)?;
    Some((names[0], number))
}

/// Points along each dimension of a structured grid, the slowest first; none for others.
pub fn structure(items: &Items<'_>, topology: Option<usize>) -> Result<Option<Vec<usize>>> {
    let Some(topology) = topology else {
        return Ok(None);
    };
    let element = items.tree.at(topology);
    let kind = kind_of(items, topology);
    if ![
        "2dsmesh",
        "2drectmesh",
        "2dcorectmesh",
        "3dsmesh",
        "3drectmesh",
        "3dcorectmesh",
    ]
    .contains(&kind.as_str())
    {
        return Ok(None);
    }
    let text = element
        .get("Dimensions")
        .or(element.get("NumberOfElements"))
        .unwrap_or_default();
    let counts: Option<Vec<usize>> = text
        .split_ascii_whitespace()
        .map(|word| word.parse().ok())
        .collect();
    let counts = counts.filter(|counts| [1, 2, 3].contains(&counts.len()));
    counts.map(Some).ok_or_else(|| {
        items.refuse(format!(
            "the dimensions {text:?} of a structured grid are not numbers"
        ))
    })
}

fn kind_of(items: &Items<'_>, topology: usize) -> String {
    let element = items.tree.at(topology);
    let kind = element
        .get("TopologyType")
        .or(element.get("Type"))
        .unwrap_or_default();
    kind.to_ascii_lowercase()
}

/// The points of a geometry.
pub fn points(
    items: &Items<'_>,
    geometry: usize,
    structure: Option<&[usize]>,
) -> Result<Array<[f64; 3]>> {
    let element = items.tree.at(geometry);
    let kind = element
        .get("GeometryType")
        .or(element.get("Type"))
        .unwrap_or("XYZ")
        .to_ascii_uppercase();
    let columns = || -> Result<Vec<Vec<f64>>> {
        items
            .of(geometry)?
            .into_iter()
            .map(|item| Ok(items.read(item)?.values().to_f64()))
            .collect()
    };
    match kind.as_str() {
        "XYZ" | "XY" => {
            let item = items.only(geometry)?;
            // dolfinx and others give XY for three columns and XYZ for two.
            let width = match item.rows() {
                (_, width) if item.shape.len() > 1 => width,
                _ => kind.len(),
            };
            if !(1..=3).contains(&width) || !item.numbers.len().is_multiple_of(width) {
                return Err(items.refuse(format!("points with {width} coordinates")));
            }
            Ok(item.numbers.points(width))
        }
        "X_Y_Z" | "X_Y" => {
            let columns = columns()?;
            let count = columns.first().map_or(0, Vec::len);
            if columns.len() > 3 || columns.iter().any(|column| column.len() != count) {
                return Err(items.refuse("the coordinates are not of one length"));
            }
            let point = |k: usize| {
                std::array::from_fn(|axis| columns.get(axis).map_or(0.0, |column| column[k]))
            };
            Ok((0..count).map(point).collect())
        }
        "VXVYVZ" | "VXVY" => grid_points(items, &columns()?),
        "ORIGIN_DXDYDZ" | "ORIGIN_DXDY" => {
            let [origin, step] = &columns()?[..] else {
                return Err(items.refuse("a regular grid has an origin and steps"));
            };
            let structure = structure.unwrap_or_default();
            let axes = structure.iter().enumerate().map(|(k, &count)| {
                let (first, step) = (
                    origin.get(k).copied().unwrap_or(0.0),
                    step.get(k).copied().unwrap_or(1.0),
                );
                if count > 1 << 28 {
                    return Err(items.refuse(format!("{count} points along one axis")));
                }
                Ok((0..count).map(|i| first + step * i as f64).collect())
            });
            let mut axes: Vec<Vec<f64>> = axes.collect::<Result<_>>()?;
            // The slowest, z, comes first.
            axes.reverse();
            grid_points(items, &axes)
        }
        other => Err(items.refuse(format!("a geometry of the type {other:?} is not read"))),
    }
}

/// All points of a grid of coordinates along x, y and z.
fn grid_points(items: &Items<'_>, axes: &[Vec<f64>]) -> Result<Array<[f64; 3]>> {
    let count = axes
        .iter()
        .try_fold(1_usize, |all, axis| all.checked_mul(axis.len()));
    let count = count.filter(|&count| count <= 1 << 28 && axes.len() <= 3);
    let count = count.ok_or_else(|| items.refuse("a grid of too many points"))?;
    crate::memory::require(64.0 * count as f64, "a grid of its size")?;
    let points = (0..count).map(|k| {
        let mut rest = k;
        std::array::from_fn(|axis| {
            axes.get(axis).map_or(0.0, |values| {
                let x = values[rest % values.len()];
                rest /= values.len();
                x
            })
        })
    });
    Ok(points.collect())
}

/// The cells of a topology in blocks, with Gmsh's order of nodes. Nodes are numbered from `first` on.
pub fn cells(
    items: &Items<'_>,
    topology: usize,
    structure: Option<&[usize]>,
    points: usize,
    first: u32,
) -> Result<Vec<(CellKind, Array<u32>)>> {
    if let Some(counts) = structure {
        let count = counts
            .iter()
            .try_fold(1_usize, |all, &n| all.checked_mul(n));
        if count != Some(points) {
            return Err(items.refuse(format!("a grid of {counts:?} for {points} points")));
        }
        let (kind, nodes) = crate::io::sets::grid(counts, first);
        return Ok(vec![(kind, nodes.into())]);
    }
    let element = items.tree.at(topology);
    let kind = kind_of(items, topology);
    let base = element.get("BaseOffset").unwrap_or("0");
    let base: u32 = base.trim().parse().map_err(|_| {
        items.refuse(format!(
            "the BaseOffset {base:?} is not the number of a first node"
        ))
    })?;
    let read = |kind: CellKind, numbers: &RawNumbers<'_>| {
        let places: Vec<usize> = (0..kind.points()).collect();
        let nodes = numbers.nodes(&Nodes {
            base,
            points: first..first + points as u32,
            width: kind.points(),
            order: order(kind).as_deref().unwrap_or(&places),
            by_place: false,
        });
        nodes.map_err(|what| items.refuse(format!("a topology of {kind} cells: {what}")))
    };
    // Consecutive cells of one kind.
    let mut runs: Vec<(CellKind, Vec<i64>)> = Vec::new();
    let mut add = |kind: CellKind, nodes: &[i64]| match runs.last_mut() {
        Some((last, run)) if *last == kind => run.extend(nodes),
        _ => runs.push((kind, nodes.to_vec())),
    };
    let blocks = |runs: Vec<(CellKind, Vec<i64>)>| {
        let runs = runs.into_iter();
        runs.map(|(kind, run)| Ok((kind, read(kind, &RawNumbers::of(run))?)))
            .collect()
    };
    if kind.is_empty() || items.of(topology)?.is_empty() && kind == "polyvertex" {
        let last = first + points as u32;
        return Ok(vec![(CellKind::Vertex, (first..last).collect())]);
    }
    let item = items.only(topology)?;
    let integers = || {
        let numbers = item.numbers.integers();
        numbers.ok_or_else(|| items.refuse("nodes of cells are not integers"))
    };
    if kind == "mixed" {
        let numbers = integers()?;
        let mut rest = &numbers[..];
        while let [number, tail @ ..] = rest {
            let of = |kind: CellKind| Ok((kind, tail));
            let (kind, tail) = match *number {
                // These give their number of nodes.
                1..=3 => match (*number, tail) {
                    (1, [1, tail @ ..]) => Ok((CellKind::Vertex, tail)),
                    (2, [2, tail @ ..]) => Ok((CellKind::Line, tail)),
                    (3, [3, tail @ ..]) => Ok((CellKind::Triangle, tail)),
                    (3, [4, tail @ ..]) => Ok((CellKind::Quadrangle, tail)),
                    (3, [corners @ 5..256, tail @ ..]) => {
                        Ok((CellKind::Polygon(*corners as u32), tail))
                    }
                    (_, [nodes, ..]) => Err(items.refuse(format!(
                        "a cell of the kind {number} with {nodes} nodes is not read"
                    ))),
                    _ => Err(items.refuse("the cells end too early")),
                },
                number => match elements::kind(|element| element.xdmf, number) {
                    Some(kind) => of(kind),
                    None => {
                        Err(items.refuse(format!("cells of XDMF's kind {number} are not read")))
                    }
                },
            }?;
            let nodes = tail
                .get(..kind.points())
                .ok_or_else(|| items.refuse("the cells end too early"))?;
            add(kind, nodes);
            rest = tail.split_at(kind.points()).1;
        }
        return blocks(runs);
    }
    let is = |name: &&str| name.eq_ignore_ascii_case(&kind);
    let mut all = ELEMENTS.iter();
    let found = match all.find(|element| element.xdmf_names.iter().any(is)) {
        Some(element) => element.kind,
        None if kind == "polygon" => CellKind::Triangle,
        None => return Err(items.refuse(format!("a topology of the type {kind:?} is not read"))),
    };
    let per = element
        .get("NodesPerElement")
        .and_then(|n| n.parse::<usize>().ok());
    let width = match item.shape.len() {
        2 => item.rows().1,
        _ => per.unwrap_or(found.points()),
    };
    let found = match (kind.as_str(), width) {
        ("polygon", 4) => CellKind::Quadrangle,
        ("polygon", 5..256) => CellKind::Polygon(width as u32),
        // Longer lines are lines one after another.
        ("polyline", 3..) => {
            for line in integers()?.chunks_exact(width) {
                line.windows(2).for_each(|pair| add(CellKind::Line, pair));
            }
            return blocks(runs);
        }
        _ => found,
    };
    if width != found.points() {
        return Err(items.refuse(format!(
            "a topology {kind:?} of {width} nodes per cell is not read"
        )));
    }
    Ok(vec![(found, read(found, &item.numbers)?)])
}
