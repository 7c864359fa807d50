//! MFEM's own mesh: conforming with straight or curved cells, and non-conforming (NC) by its leaves. Read, not written.
//!
//! Attributes are groups, and named sets of attributes too. A grid function of nodes of order 2 makes cells of second
//! order; of higher orders the corners are read. NURBS have no cells before they are cut, and are refused.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::builder::{Builder, Numbering};
use super::scan::Scan;
use super::sides::{self, edges};
use super::{Content, Native, mfem_inline, read_only};
use crate::error::Result;
use crate::mesh::{CellKind, Shape};

pub static FORMAT: Native = Native {
    title: "MFEM's mesh",
    names: &["mfem"],
    suffixes: &[],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| bytes.trim_ascii_start().starts_with(b"MFEM "),
    read,
    write: read_only,
};

/// MFEM's numbers of shapes: the kinds of first and of second order.
const KINDS: [(CellKind, CellKind); 8] = [
    (CellKind::Vertex, CellKind::Vertex),
    (CellKind::Line, CellKind::Line3),
    (CellKind::Triangle, CellKind::Triangle6),
    (CellKind::Quadrangle, CellKind::Quadrangle9),
    (CellKind::Tetrahedron, CellKind::Tetrahedron10),
    (CellKind::Hexahedron, CellKind::Hexahedron27),
    (CellKind::Prism, CellKind::Prism18),
    (CellKind::Pyramid, CellKind::Pyramid14),
];

/// The edges and the quadrangles of a cell in the order in which MFEM numbers them.
fn local(shape: Shape) -> (&'static [[usize; 2]], &'static [[usize; 4]]) {
    match shape {
        Shape::Vertex => (&[], &[]),
        Shape::Line => (&[[0, 1]], &[]),
        Shape::Triangle => (&[[0, 1], [1, 2], [2, 0]], &[]),
        Shape::Quadrangle => (&[[0, 1], [1, 2], [2, 3], [3, 0]], &[[0, 1, 2, 3]]),
        Shape::Tetrahedron => (&[[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]], &[]),
        Shape::Hexahedron => (
            &[
                [0, 1],
                [1, 2],
                [3, 2],
                [0, 3],
                [4, 5],
                [5, 6],
                [7, 6],
                [4, 7],
                [0, 4],
                [1, 5],
                [2, 6],
                [3, 7],
            ],
            &[
                [3, 2, 1, 0],
                [0, 1, 5, 4],
                [1, 2, 6, 5],
                [2, 3, 7, 6],
                [3, 0, 4, 7],
                [4, 5, 6, 7],
            ],
        ),
        Shape::Prism => (
            &[
                [0, 1],
                [1, 2],
                [2, 0],
                [3, 4],
                [4, 5],
                [5, 3],
                [0, 3],
                [1, 4],
                [2, 5],
            ],
            &[[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
        ),
        Shape::Pyramid => (
            &[
                [0, 1],
                [1, 2],
                [3, 2],
                [0, 3],
                [0, 4],
                [1, 4],
                [2, 4],
                [3, 4],
            ],
            &[[3, 2, 1, 0]],
        ),
    }
}

/// An element: its attribute, its kinds of first and second order, its vertices.
struct Element {
    attribute: i64,
    kinds: (CellKind, CellKind),
    vertices: Vec<u32>,
}

/// A named set of attributes.
type Set = (String, Vec<i64>);

/// What the file says.
#[derive(Default)]
struct Raw {
    elements: Vec<Element>,
    boundary: Vec<Element>,
    /// Coordinates of the vertices.
    points: Vec<[f64; 3]>,
    /// The vertices in the middle of two others, which non-conforming meshes have.
    parents: HashMap<u32, [u32; 2]>,
    /// Whether a version before NC has vertices in the middle of edges, where dofs are numbered in another way.
    hanging: bool,
    nodes: Option<Nodes>,
    sets: Vec<Set>,
    boundary_sets: Vec<Set>,
}

/// A grid function: coordinates of the dofs of a space.
struct Nodes {
    collection: String,
    points: Vec<[f64; 3]>,
}

/// Reads a mesh from its bytes.
fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::with_comments(path, bytes, b'#');
    let mut title = scan.line();
    while title.trim_ascii().is_empty() && scan.peek().is_some() {
        title = scan.line();
    }
    let title = String::from_utf8_lossy(title.trim_ascii()).into_owned();
    let (kind, version) = title.rsplit_once(" v").unwrap_or((&title, ""));
    let mut content = Content {
        format: "mfem".into(),
        version: Some(version.to_owned()),
        encoding: "ascii".into(),
        ..Content::default()
    };
    let non_conforming = match kind {
        "MFEM mesh" => false,
        "MFEM NC mesh" => true,
        "MFEM INLINE mesh" => {
            content.mesh = mfem_inline::read(&mut scan)?;
            return Ok(content);
        }
        _ => {
            return Err(scan.error_with(
                format!("{kind:?} has no cells before its patches are cut"),
                "save it from MFEM as a mesh with nodes of order 2",
            ));
        }
    };
    let raw = Raw::read(&mut scan, non_conforming, &mut content)?;
    content.mesh = raw.build(&scan, &mut content.unread)?;
    Ok(content)
}

impl Raw {
    fn read(scan: &mut Scan<'_>, non_conforming: bool, content: &mut Content) -> Result<Raw> {
        let mut raw = Raw::default();
        while let Some(word) = scan.word() {
            let word = String::from_utf8_lossy(word.get(..60).unwrap_or(word)).into_owned();
            scan.section.clone_from(&word);
            match word.as_str() {
                "dimension" | "rank" | "sfc_version" => drop(scan.u64()?),
                "elements" => raw.elements = elements(scan, non_conforming)?,
                "boundary" => raw.boundary = elements(scan, false)?,
                "vertices" | "coordinates" => raw.points = points(scan)?,
                "nodes" => raw.nodes = Some(Nodes::read(scan)?),
                "attribute_sets" => raw.sets = sets(scan)?,
                "bdr_attribute_sets" => raw.boundary_sets = sets(scan)?,
                "vertex_parents" if non_conforming => {
                    let count = scan.count("vertices", 6)?;
                    for _ in 0..count {
                        let child = vertex(scan)?;
                        raw.parents.insert(child, [vertex(scan)?, vertex(scan)?]);
                    }
                }
                "mfem_mesh_end" => break,
                other => {
                    // The tree of refinements is no part of the mesh.
                    raw.hanging |= other == "vertex_parents";
                    match other {
                        "root_state" | "coarse_elements" | "vertex_parents" => {
                            content.warnings.push(format!("{other} was skipped"));
                        }
                        _ => content.unread.push(format!("the section {other}")),
                    }
                    while scan
                        .peek()
                        .is_some_and(|word| !word[0].is_ascii_alphabetic())
                    {
                        scan.word();
                    }
                }
            }
        }
        scan.section.clear();
        Ok(raw)
    }

    fn build(mut self, scan: &Scan<'_>, unread: &mut Vec<String>) -> Result<crate::mesh::Mesh> {
        if self.elements.is_empty() {
            return Err(scan.error("the file has no elements"));
        }
        self.place_children(scan)?;
        let order = self.nodes.as_ref().map_or(1, |nodes| nodes.order());
        let lost = |unread: &mut Vec<String>, nodes: &Nodes| {
            unread.push(format!(
                "how the cells are curved, which is of {}: they are read with straight sides",
                nodes.collection
            ));
        };
        let mut builder = Builder::default();
        let all = std::mem::take(&mut self.elements);
        let boundary = std::mem::take(&mut self.boundary);
        let cells: Vec<(CellKind, Vec<u32>)> = match self.nodes.take() {
            Some(nodes) if nodes.collection.starts_with("L2_T1_") => {
                if order > 2 {
                    lost(unread, &nodes);
                }
                broken(scan, &all, &boundary, &nodes, order, &mut self.points)?
            }
            Some(nodes) if order == 2 && nodes.is_nodal() && !self.hanging => {
                quadratic(scan, &all, &boundary, nodes, &mut self.points)?
            }
            nodes => {
                if let Some(nodes) = nodes {
                    if nodes.collection.starts_with("L2") || nodes.collection.starts_with("NURBS") {
                        return Err(scan.error_with(
                            format!("nodes of {} do not say where corners are", nodes.collection),
                            "save the mesh from MFEM with nodes of order 2",
                        ));
                    }
                    if order > 1 {
                        lost(unread, &nodes);
                    }
                    // The dofs of vertices come first.
                    self.points = nodes.points;
                    let highest = all.iter().chain(&boundary).flat_map(|e| &e.vertices).max();
                    self.points.truncate(highest.map_or(0, |&v| v as usize + 1));
                }
                let both = all.iter().chain(&boundary);
                both.map(|e| (e.kinds.0, e.vertices.clone())).collect()
            }
        };
        let mut of_attribute: HashMap<(bool, i64), Vec<u32>> = HashMap::new();
        let sides = all.len();
        for (at, (element, (kind, nodes))) in all.iter().chain(&boundary).zip(cells).enumerate() {
            if nodes.iter().any(|&node| node as usize >= self.points.len()) {
                return Err(scan.error(format!(
                    "a {kind} has a vertex beyond the {} there are",
                    self.points.len()
                )));
            }
            let number = builder.new_number();
            let cell = builder.cell(kind, &nodes, number, element.attribute);
            of_attribute
                .entry((at >= sides, element.attribute))
                .or_default()
                .push(cell);
        }
        for (is_side, sets) in [(false, &self.sets), (true, &self.boundary_sets)] {
            for (name, attributes) in sets {
                let attributes: HashSet<i64> = attributes.iter().copied().collect();
                let cells = attributes
                    .iter()
                    .filter_map(|&a| of_attribute.get(&(is_side, a)));
                builder.set(name, cells.flatten().copied());
            }
        }
        builder.mesh.points = self.points;
        Ok(builder.finish())
    }

    /// Places the vertices in the middle of others, and leaves out the numbers that no element has.
    fn place_children(&mut self, scan: &Scan<'_>) -> Result<()> {
        if self.parents.is_empty() {
            return Ok(());
        }
        let mut known: HashMap<u32, [f64; 3]> = (0..).zip(self.points.iter().copied()).collect();
        let mut wanted: Vec<u32> = self
            .elements
            .iter()
            .flat_map(|e| e.vertices.iter().copied())
            .collect();
        wanted.sort_unstable();
        wanted.dedup();
        let mut numbering = Numbering::default();
        let mut points = Vec::with_capacity(wanted.len());
        for &vertex in &wanted {
            let mut open = vec![vertex];
            while let Some(&at) = open.last() {
                let missing = || {
                    scan.error(format!(
                        "vertex {at} has neither coordinates nor parents that have them"
                    ))
                };
                if known.contains_key(&at) {
                    open.pop();
                    continue;
                }
                let &[a, b] = self.parents.get(&at).ok_or_else(missing)?;
                match (known.get(&a), known.get(&b)) {
                    (Some(x), Some(y)) => {
                        let middle = std::array::from_fn(|i| 0.5 * (x[i] + y[i]));
                        known.insert(at, middle);
                    }
                    // A chain that is longer than there are children goes round.
                    _ if open.len() > self.parents.len() => return Err(missing()),
                    (None, _) => open.push(a),
                    _ => open.push(b),
                }
            }
            numbering.push(u64::from(vertex));
            points.extend(known.get(&vertex));
        }
        let place = |vertex: u32| {
            wanted
                .binary_search(&vertex)
                .map_or(u32::MAX, |place| place as u32)
        };
        for element in self.elements.iter_mut().chain(&mut self.boundary) {
            element
                .vertices
                .iter_mut()
                .for_each(|vertex| *vertex = place(*vertex));
        }
        self.points = points;
        Ok(())
    }
}

/// The cells of second order of a continuous grid function; its dofs are the points. Dofs belong to vertices, then edges,
/// then quadrangles, then the inside of cells, each in the order in which they first appear.
fn quadratic(
    scan: &Scan<'_>,
    elements: &[Element],
    boundary: &[Element],
    nodes: Nodes,
    points: &mut Vec<[f64; 3]>,
) -> Result<Vec<(CellKind, Vec<u32>)>> {
    let all = || elements.iter().chain(boundary);
    let mut next = all()
        .flat_map(|e| &e.vertices)
        .max()
        .map_or(0, |&v| v + 1)
        .max(points.len() as u32);
    if next as usize > nodes.points.len() {
        return Err(scan.error(format!(
            "vertex {} is beyond the {} nodes",
            next - 1,
            nodes.points.len()
        )));
    }
    let mut dofs: HashMap<[u32; 4], u32> = HashMap::new();
    let key = |vertices: &[u32], local: &[usize]| {
        let mut key = [u32::MAX; 4];
        for (place, &at) in key.iter_mut().zip(local) {
            *place = vertices.get(at).copied().unwrap_or(u32::MAX);
        }
        key.sort_unstable();
        key
    };
    let mut number = |key: [u32; 4]| {
        dofs.entry(key).or_insert_with(|| {
            next += 1;
            next - 1
        });
    };
    for element in all() {
        let (edges, _) = local(element.kinds.0.shape());
        edges
            .iter()
            .for_each(|edge| number(key(&element.vertices, edge)));
    }
    // In a plane mesh a quadrangle is a cell; its inside comes in the same order.
    for element in all() {
        let (_, quadrangles) = local(element.kinds.0.shape());
        quadrangles
            .iter()
            .for_each(|face| number(key(&element.vertices, face)));
    }
    let mut cells = Vec::with_capacity(elements.len() + boundary.len());
    for element in all() {
        let (vertices, kind) = (&element.vertices, element.kinds.1);
        let shape = kind.shape();
        let node = |[a, b]: sides::Between| {
            let [a, b] = [a, b].map(usize::from);
            if a == b {
                return vertices.get(a).copied();
            }
            let (edges, quadrangles) = local(shape);
            let edge = edges
                .iter()
                .find(|edge| edge.contains(&a) && edge.contains(&b));
            let face = || {
                quadrangles
                    .iter()
                    .find(|face| face.contains(&a) && face.contains(&b))
            };
            let key = match edge {
                Some(edge) => key(vertices, edge),
                None => key(vertices, face()?),
            };
            dofs.get(&key).copied()
        };
        let mut found: Vec<u32> = Vec::with_capacity(kind.points());
        for between in sides::nodes(kind) {
            // What is in the middle of no face is in the middle of a hexahedron.
            found.push(node(between).unwrap_or(next));
        }
        if shape == Shape::Hexahedron {
            next += 1;
        }
        cells.push((kind, found));
    }
    // Some versions have a dof inside of each pyramid.
    let pyramids = elements
        .iter()
        .filter(|e| e.kinds.0 == CellKind::Pyramid)
        .count();
    let there = nodes.points.len();
    if there != next as usize && (pyramids == 0 || there != next as usize + pyramids) {
        return Err(scan.error(format!(
            "{there} nodes of {} do not fit a mesh that needs {next}",
            nodes.collection
        )));
    }
    *points = nodes.points;
    points.truncate(next as usize);
    Ok(cells)
}

/// The cells of a grid function that each cell has for itself, as periodic meshes do; nodes of one place and of the same
/// vertices become one point.
fn broken(
    scan: &Scan<'_>,
    elements: &[Element],
    boundary: &[Element],
    nodes: &Nodes,
    order: usize,
    points: &mut Vec<[f64; 3]>,
) -> Result<Vec<(CellKind, Vec<u32>)>> {
    points.clear();
    let mut known: HashMap<Vec<u32>, Vec<u32>> = HashMap::new();
    let close = 1e-9
        * nodes
            .points
            .as_flattened()
            .iter()
            .fold(0.0, |m: f64, x| m.max(x.abs()));
    let mut sides: HashMap<Vec<u32>, Vec<u32>> = HashMap::new();
    let wanted: HashSet<Vec<u32>> = boundary.iter().map(|e| sorted(&e.vertices)).collect();
    let mut cells = Vec::new();
    let mut first = 0;
    for element in elements {
        let kind = if order == 2 {
            element.kinds.1
        } else {
            element.kinds.0
        };
        let lattice = lattice(kind.shape(), order);
        let mut found = Vec::with_capacity(kind.points());
        for [a, b] in sides::nodes(kind) {
            let (x, y) = (corner(kind.shape(), a), corner(kind.shape(), b));
            let at: [usize; 3] = std::array::from_fn(|i| (x[i] + y[i]) * order / 2);
            let place = lattice.iter().position(|&point| point == at);
            let point = place
                .and_then(|place| nodes.points.get(first + place))
                .copied();
            let point = point.ok_or_else(|| {
                scan.error(format!("there are too few nodes of {}", nodes.collection))
            })?;
            // What the node lies on, by its vertices; a periodic mesh has several places for it.
            let on = |face: &&&[u8]| face.contains(&a) && face.contains(&b);
            let on = match faces(kind.shape()).iter().find(on) {
                _ if a == b || edges(kind.shape()).contains(&[a, b]) => vec![a, b],
                Some(face) => face.to_vec(),
                None => (0..kind.shape().corners() as u8).collect(),
            };
            let vertices = on
                .iter()
                .filter_map(|&a| element.vertices.get(usize::from(a)).copied());
            let places = known
                .entry(sorted(&vertices.collect::<Vec<u32>>()))
                .or_default();
            let same = |&&node: &&u32| {
                let there: [f64; 3] = points.get(node as usize).copied().unwrap_or([f64::NAN; 3]);
                there.iter().zip(point).all(|(x, y)| (x - y).abs() <= close)
            };
            let node = places.iter().find(same).copied();
            let node = node.unwrap_or_else(|| {
                places.push(points.len() as u32);
                points.push(point);
                points.len() as u32 - 1
            });
            found.push(node);
        }
        first += lattice.len();
        for corners in faces(kind.shape()) {
            let vertices = corners
                .iter()
                .filter_map(|&a| element.vertices.get(usize::from(a)).copied());
            let key = sorted(&vertices.collect::<Vec<u32>>());
            if wanted.contains(&key)
                && let Some((_, side)) = sides::side(kind, &found, corners)
            {
                sides.entry(key).or_insert(side);
            }
        }
        cells.push((kind, found));
    }
    if first != nodes.points.len() {
        return Err(scan.error(format!(
            "{} nodes of {} do not fit the elements, which have {first}",
            nodes.points.len(),
            nodes.collection
        )));
    }
    for element in boundary {
        let side = sides.get(&sorted(&element.vertices));
        let side =
            side.ok_or_else(|| scan.error("a part of the boundary is no side of an element"))?;
        let kind = if order == 2 {
            element.kinds.1
        } else {
            element.kinds.0
        };
        cells.push((kind, side.clone()));
    }
    Ok(cells)
}

/// The corners of the sides of a cell.
fn faces(shape: Shape) -> &'static [&'static [u8]] {
    match shape {
        Shape::Vertex => &[],
        Shape::Line => &[&[0], &[1]],
        Shape::Triangle => &[&[0, 1], &[1, 2], &[2, 0]],
        Shape::Quadrangle => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
        Shape::Tetrahedron => &[&[1, 2, 3], &[0, 3, 2], &[0, 1, 3], &[0, 2, 1]],
        Shape::Hexahedron => &[
            &[3, 2, 1, 0],
            &[0, 1, 5, 4],
            &[1, 2, 6, 5],
            &[2, 3, 7, 6],
            &[3, 0, 4, 7],
            &[4, 5, 6, 7],
        ],
        Shape::Prism => &[
            &[0, 2, 1],
            &[3, 4, 5],
            &[0, 1, 4, 3],
            &[1, 2, 5, 4],
            &[2, 0, 3, 5],
        ],
        Shape::Pyramid => &[
            &[3, 2, 1, 0],
            &[0, 1, 4],
            &[1, 2, 4],
            &[2, 3, 4],
            &[3, 0, 4],
        ],
    }
}

fn sorted(vertices: &[u32]) -> Vec<u32> {
    let mut vertices = vertices.to_vec();
    vertices.sort_unstable();
    vertices
}

/// A corner of the reference cell.
fn corner(shape: Shape, corner: u8) -> [usize; 3] {
    const SIMPLEX: [[usize; 3]; 4] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const CUBE: [[usize; 3]; 4] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]];
    let (layer, base): (usize, _) = match shape {
        Shape::Prism => (3, SIMPLEX),
        Shape::Triangle | Shape::Tetrahedron => (4, SIMPLEX),
        _ => (4, CUBE),
    };
    let corner = usize::from(corner);
    let [x, y, z] = base[corner % layer];
    [x, y, z + corner / layer]
}

/// The nodes of an order inside a reference cell that is as large as the order, x first.
fn lattice(shape: Shape, order: usize) -> Vec<[usize; 3]> {
    let dim = shape.dim();
    let end = |on: bool| if on { order } else { 0 };
    let mut points = Vec::new();
    for z in 0..=end(dim > 2) {
        for y in 0..=end(dim > 1) {
            for x in 0..=end(dim > 0) {
                let inside = match shape {
                    Shape::Triangle | Shape::Prism => x + y <= order,
                    Shape::Tetrahedron => x + y + z <= order,
                    Shape::Pyramid => x.max(y) + z <= order,
                    _ => true,
                };
                if inside {
                    points.push([x, y, z]);
                }
            }
        }
    }
    points
}

impl Nodes {
    fn read(scan: &mut Scan<'_>) -> Result<Nodes> {
        let mut collection = String::new();
        let (mut components, mut by_component) = (0, true);
        while let Some(word) = scan.peek().filter(|word| word[0].is_ascii_alphabetic()) {
            scan.word();
            match word {
                b"FiniteElementCollection:" => {
                    collection = String::from_utf8_lossy(scan.line().trim_ascii()).into_owned();
                }
                b"VDim:" => components = scan.u64()?,
                b"Ordering:" => by_component = scan.u64()? == 0,
                _ => {}
            }
        }
        let components = usize::try_from(components)
            .ok()
            .filter(|c| (1..=3).contains(c));
        let components = components.ok_or_else(|| scan.error("nodes have 1 to 3 coordinates"))?;
        let mut values = Vec::new();
        while scan
            .peek()
            .is_some_and(|word| !word[0].is_ascii_alphabetic())
        {
            values.push(scan.f64()?);
        }
        let count = values.len() / components;
        if values.len() % components != 0 {
            return Err(scan.error(format!(
                "{} values do not make nodes of {components} coordinates",
                values.len()
            )));
        }
        let value = |node: usize, axis: usize| match by_component {
            true => values[axis * count + node],
            false => values[node * components + axis],
        };
        let point = |node| {
            std::array::from_fn(|axis| {
                if axis < components {
                    value(node, axis)
                } else {
                    0.0
                }
            })
        };
        Ok(Nodes {
            collection,
            points: (0..count).map(point).collect(),
        })
    }

    /// The order of the space; 0 where its name does not say.
    fn order(&self) -> usize {
        match self.collection.as_str() {
            "Linear" => 1,
            "Quadratic" => 2,
            "Cubic" => 3,
            other => other
                .rsplit_once("_P")
                .and_then(|(_, order)| order.parse().ok())
                .unwrap_or(0),
        }
        .min(20)
    }

    /// Whether the dofs are the values at nodes.
    fn is_nodal(&self) -> bool {
        self.collection == "Quadratic" || self.collection.starts_with("H1_")
    }
}

fn vertex(scan: &mut Scan<'_>) -> Result<u32> {
    let vertex = scan.u64()?;
    let small = u32::try_from(vertex).ok().filter(|&v| v < u32::MAX - 1);
    small.ok_or_else(|| scan.error(format!("{vertex} is not the number of a vertex")))
}

/// Rows of attribute, shape and vertices; those of non-conforming meshes have a rank first, and either vertices or children.
fn elements(scan: &mut Scan<'_>, non_conforming: bool) -> Result<Vec<Element>> {
    let count = scan.count("elements", 6)?;
    let mut elements = Vec::new();
    for _ in 0..count {
        if non_conforming {
            scan.i32()?;
        }
        let attribute = scan.i32()?.into();
        let shape = scan.u64()?;
        let known = usize::try_from(shape)
            .ok()
            .and_then(|shape| KINDS.get(shape));
        let &kinds =
            known.ok_or_else(|| scan.error(format!("{shape} is not the number of a shape")))?;
        if non_conforming && scan.u64()? != 0 {
            scan.line();
            continue;
        }
        let vertices = (0..kinds.0.points()).map(|_| vertex(scan));
        elements.push(Element {
            attribute,
            kinds,
            vertices: vertices.collect::<Result<_>>()?,
        });
    }
    Ok(elements)
}

/// The number of vertices, and their coordinates unless the nodes have them.
fn points(scan: &mut Scan<'_>) -> Result<Vec<[f64; 3]>> {
    let declared = scan.u64()?;
    if !scan.peek().is_some_and(|word| word[0].is_ascii_digit()) {
        return Ok(Vec::new());
    }
    let dimension = scan.u64()?;
    if !(1..=3).contains(&dimension) {
        return Err(scan.error(format!("vertices have 1 to 3 coordinates, not {dimension}")));
    }
    let count = scan.believe(declared, "vertices", 2 * dimension as usize)?;
    let mut points = vec![[0.0; 3]; count];
    for point in &mut points {
        for x in point.iter_mut().take(dimension as usize) {
            *x = scan.f64()?;
        }
    }
    Ok(points)
}

/// Named sets of attributes.
fn sets(scan: &mut Scan<'_>) -> Result<Vec<Set>> {
    let count = scan.count("sets", 4)?;
    let mut sets = Vec::new();
    for _ in 0..count {
        scan.skip_blanks();
        let quoted = scan.rest().strip_prefix(b"\"");
        let name = match quoted {
            Some(rest) => rest.get(..memchr::memchr(b'"', rest).unwrap_or(rest.len())),
            None => scan.peek(),
        };
        let name = name.unwrap_or_default();
        scan.advance(name.len() + if quoted.is_some() { 2 } else { 0 });
        let size = scan.count("attributes", 2)?;
        let attributes = (0..size).map(|_| scan.i32().map(i64::from));
        sets.push((
            String::from_utf8_lossy(name).into_owned(),
            attributes.collect::<Result<_>>()?,
        ));
    }
    Ok(sets)
}
