//! The dofs of a result that any code has written: values at the nodes of cells, or of cells, on the mesh of a form.
//!
//! Nothing is projected: a field is a function of the space of its unknown, or it is rejected.

use std::collections::{BTreeSet, HashMap};

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Field, Mesh, Support};

use super::assemble::Assembler;
use super::dofs::sign;
use super::element::{Shape, carriers};
use super::output::values;
use super::places::centre;

/// Points are equal if their distance is less than this fraction of the domain.
const NEAR: f64 = 1e-6;
/// The tolerance for the position of a node, as a fraction of the cell.
const SHIFT: f64 = 1e-3;
/// Values that differ by less than this fraction of the largest are of one function: codes that evaluate one value per cell leave such differences.
const SAME: f64 = 1e-12;
/// If numbers were rounded when they were written, two may differ by this many units of their last digits.
const WRITTEN: f64 = 4.0;

fn refuse(what: String, remedy: &str) -> Error {
    Error::usage(what, remedy)
}

/// The dofs of all unknowns, whose values were written with this relative precision; those of an unknown without a name are 0.
///
/// # Errors
/// A result on another mesh, and fields that are missing or are not functions of the spaces.
pub fn read(assembler: &Assembler, result: &Mesh, unit: f64) -> Result<Vec<f64>> {
    let cells = cells(assembler, result)?;
    let mut u = vec![0.0; assembler.dofs.count()];
    let unknowns = assembler.problem.unknowns.iter().enumerate();
    for (k, _) in unknowns.filter(|(_, unknown)| !unknown.name.is_empty()) {
        unknown(assembler, result, &cells, k, unit, &mut u)?;
    }
    Ok(u)
}

/// A cell of the result: its number, the corresponding cell of ours, and its nodes with their positions.
struct Cell {
    number: u32,
    own: usize,
    nodes: Vec<(u32, [f64; 3])>,
}

fn cells(assembler: &Assembler, result: &Mesh) -> Result<Vec<Cell>> {
    let mesh = &assembler.mesh;
    let mut extent = 0.0_f64;
    for axis in 0..3 {
        let all = mesh.points.iter().map(|p| p[axis]);
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        extent = extent.max(high - low);
    }
    let width = NEAR * extent;
    let key = |p: &[f64; 3]| p.map(|x| (x / width).floor() as i64);
    let mut at: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for (k, point) in mesh.points.iter().enumerate() {
        at.entry(key(point)).or_default().push(k as u32);
    }
    let find = |point: &[f64; 3]| {
        let [x, y, z] = key(point);
        let around = (0..27).map(|k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        let candidates = around.filter_map(|key| at.get(&key)).flatten();
        candidates.copied().find(|k| {
            let own = mesh.points[*k as usize];
            own.iter().zip(point).all(|(a, b)| (a - b).abs() <= width)
        })
    };
    let sorted = |mut vertices: Vec<u32>| {
        vertices.sort_unstable();
        vertices
    };
    let own: HashMap<Vec<u32>, usize> = (0..mesh.cell_count())
        .map(|cell| (sorted(mesh.cell(cell).to_vec()), cell))
        .collect();
    let count = result
        .cells()
        .filter(|(_, kind, _)| usize::from(kind.dim()) == mesh.dim)
        .count();
    let other = |what: String| {
        refuse(
            what,
            "give the result of the form's mesh: name its refinement by --n",
        )
    };
    if count != mesh.cell_count() {
        return Err(other(format!(
            "the result has {count} cells, and the form's mesh {}",
            mesh.cell_count()
        )));
    }
    let mut found = Vec::with_capacity(count);
    let mut is_found = vec![false; count];
    for (number, kind, nodes) in result
        .cells()
        .filter(|(_, kind, _)| usize::from(kind.dim()) == mesh.dim)
    {
        let points: Vec<[f64; 3]> = nodes.iter().map(|k| result.points[*k as usize]).collect();
        let corners: Vec<Option<u32>> = points.iter().take(kind.corners()).map(find).collect();
        let corners = corners.into_iter().collect::<Option<Vec<u32>>>();
        let own = corners.and_then(|corners| own.get(&sorted(corners)).copied());
        let Some(own) = own.filter(|cell| !std::mem::replace(&mut is_found[*cell], true)) else {
            return Err(other(format!(
                "cell {number} of the result is not a cell of the form's mesh"
            )));
        };
        let nodes = nodes.iter().copied().zip(points).collect();
        found.push(Cell { number, own, nodes });
    }
    Ok(found)
}

fn unknown(
    assembler: &Assembler,
    result: &Mesh,
    cells: &[Cell],
    k: usize,
    unit: f64,
    u: &mut [f64],
) -> Result<()> {
    let (mesh, dofs) = (&assembler.mesh, &assembler.dofs);
    let unknown = &assembler.problem.unknowns[k];
    let (name, size, element) = (&unknown.name, unknown.space.count(), unknown.space.element);
    let is_it = |field: &&Field| {
        field.name == *name && field.at.is_empty() && field.on != Support::CellPoints
    };
    let all: Vec<&Field> = result.fields.iter().filter(is_it).collect();
    let field = match all[..] {
        [one] => one,
        _ => {
            let names: Vec<&str> = result
                .fields
                .iter()
                .map(|field| field.name.as_str())
                .collect();
            return Err(refuse(
                match all.is_empty() {
                    true if names.is_empty() => "the result has no fields".into(),
                    true => format!(
                        "the result has no field `{name}` on points or cells, only {}",
                        names.join(", ")
                    ),
                    false => format!("the result has {} fields `{name}`", all.len()),
                },
                "write each unknown once, by its name in the form",
            ));
        }
    };
    // In 2D, vectors may have a third component.
    if field.components != size && !(field.components == 3 && size == 2) {
        return Err(refuse(
            format!(
                "`{name}` has {} components, and the unknown {size}",
                field.components
            ),
            "write the unknown as the form has it",
        ));
    }
    let numbers = field.values.to_f64();
    let nodal = |degree| Shape::nodal(mesh.shape, degree);
    let degree = |cell: &Cell| match field.on {
        Support::Cells => Some(0),
        _ => (1..=3).find(|degree| nodal(*degree).count(mesh.dim) == cell.nodes.len()),
    };
    let row = |item: u32, c: usize| {
        numbers
            .get(item as usize * field.components + c)
            .copied()
            .unwrap_or(f64::NAN)
    };
    // The values of the cell's nodes in the order of ours.
    let local = |cell: &Cell| -> Option<(u8, Vec<u32>)> {
        let degree = degree(cell)?;
        if degree == 0 {
            return Some((0, vec![cell.number]));
        }
        let vertices = mesh.vertices(cell.own);
        let near = SHIFT * mesh.diameter(&vertices);
        let node = |at: &[f64; 4]| {
            let wanted = mesh.place(&vertices, at);
            let far = |(_, at): &(u32, [f64; 3])| -> f64 {
                let squares = at.iter().zip(&wanted).map(|(a, b)| (a - b) * (a - b));
                squares.sum::<f64>().sqrt()
            };
            let nearest = cell.nodes.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
            (far(nearest) <= near).then_some(nearest.0)
        };
        let found: Vec<u32> = nodal(degree)
            .nodes(mesh.dim)
            .iter()
            .map(node)
            .collect::<Option<_>>()?;
        let distinct: BTreeSet<u32> = found.iter().copied().collect();
        (distinct.len() == found.len()).then_some((degree, found))
    };
    let nodes: Vec<[f64; 4]> = match element.is_vector() {
        false => Shape::of(element, mesh.shape).nodes(mesh.dim),
        true => carriers(element, mesh.dim)
            .into_iter()
            .map(|carrier| centre(mesh.dim, carrier))
            .collect(),
    };
    let tables: Vec<_> = (0..4)
        .map(|degree| nodal(degree).table(mesh.dim, &nodes))
        .collect();
    let mut given = Vec::with_capacity(cells.len());
    for cell in cells {
        let Some((degree, items)) = local(cell) else {
            return Err(refuse(
                format!(
                    "cell {} of the result has nodes that are not those of linear, quadratic or cubic cells",
                    cell.number
                ),
                "write values at the nodes of such cells",
            ));
        };
        let at = |i: usize, c: usize| -> f64 {
            let phi = tables[usize::from(degree)].row(0, i);
            phi.iter()
                .zip(&items)
                .filter(|(p, _)| **p != 0.0)
                .map(|(p, item)| p * row(*item, c))
                .sum()
        };
        for (i, node) in dofs.of_cell(k, cell.own).iter().enumerate() {
            let of_node = dofs.of_node(*node);
            if !element.is_vector() {
                of_node.enumerate().for_each(|(c, dof)| u[dof] = at(i, c));
                continue;
            }
            let carrier = carriers(element, mesh.dim)[i];
            let geometry = mesh.geometry(cell.own);
            let [a, b] = carrier;
            let along = match a == b {
                true => geometry.normal(a) * geometry.face_measure(a),
                false => geometry.vertices[b] - geometry.vertices[a],
            };
            let moment: f64 = (0..size).map(|c| at(i, c) * along[c]).sum();
            u[of_node.start] = sign(mesh, cell.own, carrier) * moment;
        }
        given.push((cell.own, degree, items));
    }
    let same = SAME.max(WRITTEN * unit);
    check(assembler, k, u, &given, row, same)
}

/// Do the dofs represent the given function?
fn check(
    assembler: &Assembler,
    k: usize,
    u: &[f64],
    given: &[(usize, u8, Vec<u32>)],
    row: impl Fn(u32, usize) -> f64,
    same: f64,
) -> Result<()> {
    let unknown = &assembler.problem.unknowns[k];
    let (size, dim) = (unknown.space.count(), assembler.mesh.dim);
    let largest = given
        .iter()
        .flat_map(|(.., items)| items)
        .flat_map(|item| (0..size).map(|c| row(*item, c)));
    let largest = largest.fold(
        0.0_f64,
        |most, v| if v.abs() <= most { most } else { v.abs() },
    );
    for degree in 0..4 {
        if !given.iter().any(|(_, own, _)| *own == degree) {
            continue;
        }
        let nodes = Shape::nodal(assembler.mesh.shape, degree).nodes(dim);
        let found = values(assembler, u, k, &nodes);
        for (cell, _, items) in given.iter().filter(|(_, own, _)| *own == degree) {
            for (q, item) in items.iter().enumerate() {
                for c in 0..size {
                    let (value, wanted) =
                        (found[(cell * nodes.len() + q) * size + c], row(*item, c));
                    // Negated so that NaN is rejected.
                    if !((value - wanted).abs() <= same * largest) {
                        return Err(refuse(
                            format!(
                                "`{}` of the result is not a function of {}: it is {wanted} where a function of that space with its nodes is {value}",
                                unknown.name,
                                unknown.space.name()
                            ),
                            "write the dofs' function, not a projection, on cells that hold its degree",
                        ));
                    }
                }
            }
        }
    }
    Ok(())
}
