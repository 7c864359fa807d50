//! The cells of one result as straight simplices, each with the cell whose functions hold there.

use std::borrow::Cow;
use std::ops::Range;

use super::clip::{Simplex, barycentric, clip, dot, measure, subtract, turn_left};
use super::element::{Element, PYRAMID};
use super::frame::Frame;
use super::geometry::{Geometry, is_convex};
use super::tree::{Bounds, Tree};
use faceoff_mesh::CellKind;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::memory;
use faceoff_mesh::mesh::{Shape, sides};
use faceoff_mesh::parallel;

/// Pieces that one thread takes at a time.
pub(super) const BLOCK: usize = 1 << 10;

/// How far two surfaces may be from each other and be one, in lengths of the larger of two pieces.
pub(super) const APART: f64 = 0.1;

/// Cells of another dimension have no element.
const OTHER: u8 = u8::MAX;

/// A straight part of a cell: all of it where it is a straight simplex.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// Points of the domain; in 2D the last is not used.
    pub corners: [u32; 4],
    /// The cell of the file.
    pub cell: u32,
}

/// The cells of the highest dimension of one result.
#[derive(Debug)]
pub(super) struct Domain<'a> {
    pub side: &'a Results,
    pub dim: usize,
    /// Do its cells, of dimension 2, not lie in one plane z = const?
    pub is_surface: bool,
    pub elements: Vec<Element>,
    /// For each of them that of the coordinates where edges are straight.
    of_corners: Vec<Option<Element>>,
    /// The element of each cell of the file.
    of_cell: Vec<u8>,
    pub geometries: Vec<Geometry>,
    /// The first corner of each cell.
    pub first_corners: Vec<u32>,
    /// Points of the file, and those that divide its curved cells.
    points: Cow<'a, [[f64; 3]]>,
    pub pieces: Vec<Piece>,
    pub tree: Tree,
    /// How near points are that are one place.
    pub near: f64,
    /// Area or volume.
    pub measure: f64,
    pub curved: usize,
}

impl<'a> Domain<'a> {
    /// Number of cells of the highest dimension.
    pub fn cell_count(&self) -> usize {
        self.of_cell.iter().filter(|of| **of != OTHER).count()
    }

    pub fn element(&self, cell: u32) -> &Element {
        &self.elements[usize::from(self.of_cell[cell as usize])]
    }

    /// The element of order 1 on the reference cell of another; none where that is the same, or where all cells with straight edges are affine.
    pub fn of_corners(&self, element: &Element) -> Option<&Element> {
        let mut all = self.elements.iter().zip(&self.of_corners);
        let (_, found) = all.find(|(of, _)| of.kind == element.kind)?;
        found.as_ref()
    }

    /// `None` for cells of other dimensions.
    pub fn known_element(&self, cell: u32) -> Option<&Element> {
        self.elements.get(usize::from(self.of_cell[cell as usize]))
    }

    /// Divides the cells of the highest dimension and looks for those that overlap.
    ///
    /// # Errors
    /// Cells on which functions are not known here, cells without measure, folded or overlapping ones.
    pub fn new(side: &'a Results, near: f64) -> Result<Self> {
        let mut domain = Domain::divided(side, near)?;
        let pieces = &domain.pieces;
        let boxes = parallel::collect(pieces.len(), |k| domain.reach(&pieces[k]));
        domain.tree = Tree::new(&boxes);
        domain.refuse_overlaps(&boxes)?;
        Ok(domain)
    }

    /// The same without a look at overlaps, and without a tree.
    ///
    /// # Errors
    /// Cells on which functions are not known here, cells without measure, folded ones.
    pub fn divided(side: &'a Results, near: f64) -> Result<Self> {
        let dim = side.dimensions().last().map_or(0, |dim| usize::from(*dim));
        let refuse = |what: String, remedy: &str| Error::Mesh {
            mesh: side.source.clone(),
            what,
            remedy: remedy.into(),
        };
        let counted: usize = side.kinds.iter().map(|(_, count)| count).sum();
        if !(2..=3).contains(&dim) || counted != side.cell_count() || side.points.is_empty() {
            let what =
                "it has no triangles, quadrangles, tetrahedra, hexahedra, prisms or pyramids in known places"
                    .into();
            return Err(refuse(what, "give results on a mesh"));
        }
        let mut domain = Domain {
            side,
            dim,
            is_surface: false,
            elements: Vec::new(),
            of_corners: Vec::new(),
            of_cell: Vec::with_capacity(side.cell_count()),
            geometries: vec![Geometry::Straight; side.cell_count()],
            first_corners: Vec::new(),
            points: Cow::from(&*side.points),
            pieces: Vec::new(),
            tree: Tree::new(&[]),
            near,
            measure: 0.0,
            curved: 0,
        };
        let mut pieces = 0.0;
        for &(kind, count) in &side.kinds {
            let known = domain.elements.iter().position(|e| e.kind == kind);
            let of = match known {
                _ if usize::from(kind.dim()) != dim || count == 0 => usize::from(OTHER),
                Some(k) => k,
                None => {
                    let remedy = "give results on triangles, quadrangles, tetrahedra, hexahedra, prisms up to order 2 or pyramids of order 1, whose nodes are all there";
                    let what = || format!("functions on a {kind} are not known here");
                    let element = Element::new(kind).ok_or_else(|| refuse(what(), remedy))?;
                    let first = domain.of_cell.len() as u32;
                    let own = domain.at_own_nodes(&element, first..first + count as u32);
                    domain.of_corners.push(match kind.shape() {
                        Shape::Quadrangle => Element::new(CellKind::Quadrangle),
                        Shape::Hexahedron => Element::new(CellKind::Hexahedron),
                        Shape::Prism => Element::new(CellKind::Prism),
                        _ => None,
                    });
                    domain.elements.push(own.unwrap_or(element));
                    domain.elements.len() - 1
                }
            };
            let most = domain
                .elements
                .get(of)
                .map_or(0, |e| e.order.pow(dim as u32) * most_pieces(e));
            pieces += (most * count) as f64;
            domain.of_cell.extend(std::iter::repeat_n(of as u8, count));
        }
        memory::require(200.0 * pieces, "the cells of the mesh")?;
        let mut next = 0;
        for cell in 0..side.cell_count() {
            domain.first_corners.push(next);
            next += side.cell(cell).count() as u32;
        }
        // Before cells are looked at without their z.
        domain.is_surface = dim == 2 && !domain.is_plane();
        for cell in 0..side.cell_count() as u32 {
            cancel::check()?;
            if domain.of_cell[cell as usize] != OTHER {
                domain.divide(cell).map_err(|what| {
                    let place = side.centroid(cell as usize).unwrap_or_default();
                    let what = format!("cell {cell} at {:?} {what}", &place[..side.space]);
                    refuse(
                        what,
                        "repair the mesh: functions on it have no values there",
                    )
                })?;
            }
        }
        let measures = domain
            .pieces
            .iter()
            .map(|piece| domain.piece_measure(piece));
        domain.measure = measures.sum();
        Ok(domain)
    }

    /// The element whose nodes are where the file has them, if those are the same places of every cell, but not Gmsh's: dolfinx
    /// has the points of Gauss, Lobatto and Legendre, and writes them as they are. Read as equidistant ones they would make
    /// curved cells of straight ones, and another function.
    fn at_own_nodes(&self, element: &Element, cells: Range<u32>) -> Option<Element> {
        // Up to order two there is no choice.
        if element.order < 3 {
            return None;
        }
        let places = |cell: u32| -> Vec<[f64; 3]> {
            let first = self.side.cell(cell as usize).next();
            let origin = first
                .map(|point| self.points[point as usize])
                .unwrap_or_default();
            self.nodes(cell, &Frame::at(origin)).collect()
        };
        let first = places(cells.start);
        // The edges from the first corner, and what is normal to them in a plane.
        let mut edges = nalgebra::Matrix3::identity();
        for axis in 0..self.dim {
            edges.set_column(axis, &first[element.corner(axis)].into());
        }
        let inverse = edges.try_inverse()?;
        let own = first
            .iter()
            .map(|place| (inverse * nalgebra::Vector3::from(*place)).into());
        let own: Vec<[f64; 3]> = own.collect();
        let same = |a: &[f64; 3], b: &[f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-6);
        if own.iter().zip(&element.nodes).all(|(a, b)| same(a, b)) {
            return None;
        }
        let own = element.clone().with_nodes(own)?;
        let mut all = cells.map(|cell| Geometry::of(&own, &places(cell), self.near));
        all.all(|geometry| geometry == Geometry::Straight)
            .then_some(own)
    }

    /// Have all nodes of cells one z?
    fn is_plane(&self) -> bool {
        let cells = (0..self.of_cell.len()).filter(|cell| self.of_cell[*cell] != OTHER);
        let mut nodes = cells.flat_map(|cell| self.side.cell(cell));
        let z = |point: u32| self.points[point as usize][2];
        let Some(height) = nodes.next().map(z) else {
            return true;
        };
        nodes.all(|point| (z(point) - height).abs() <= self.near)
    }

    /// z of a plane mesh.
    pub fn height(&self) -> f64 {
        let first = self.pieces.first();
        first.map_or(0.0, |p| self.points[p.corners[0] as usize][2])
    }

    /// Corners of a piece in a frame; those of a surface are projected on its plane.
    pub fn simplex(&self, piece: &Piece, frame: &Frame) -> Simplex {
        let mut corners = [[0.0; 3]; 4];
        for (x, point) in corners.iter_mut().zip(piece.corners).take(self.dim + 1) {
            *x = self.place(point, frame);
        }
        corners
    }

    fn place(&self, point: u32, frame: &Frame) -> [f64; 3] {
        let mut x = frame.coordinates(&self.points[point as usize]);
        x[self.dim..].fill(0.0);
        x
    }

    /// The first corner, from which all else is measured, and the plane of a piece of a surface.
    pub fn frame(&self, piece: &Piece) -> Frame {
        let corners = [0, 1, 2].map(|k| self.points[piece.corners[k] as usize]);
        match self.is_surface {
            true => Frame::of_triangle(corners),
            false => Frame::at(corners[0]),
        }
    }

    pub fn piece_measure(&self, piece: &Piece) -> f64 {
        measure(self.dim, &self.simplex(piece, &self.frame(piece)))
    }

    /// The nodes of a cell in a frame; those of a surface are projected on its plane.
    pub fn nodes(&self, cell: u32, frame: &Frame) -> impl Iterator<Item = [f64; 3]> {
        let points = self.side.cell(cell as usize);
        points.map(move |point| self.place(point, frame))
    }

    /// How far, up or down, a piece of a surface is from the plane of a frame above what the two have in common; 0 in a plane.
    pub fn rise(&self, piece: &Piece, frame: &Frame, common: &[Simplex]) -> f64 {
        if !self.is_surface {
            return 0.0;
        }
        let corners = self.simplex(piece, frame);
        let gradients = barycentric(self.dim, &corners);
        let heights = [0, 1, 2].map(|k| {
            let corner = &self.points[piece.corners[k] as usize];
            frame.coordinates(corner)[2]
        });
        let height = |x: &[f64; 3]| {
            let from = subtract(x, &corners[0]);
            let steps = (1..3).map(|k| dot(&gradients[k], &from) * (heights[k] - heights[0]));
            heights[0] + steps.sum::<f64>()
        };
        let places = common.iter().flat_map(|simplex| &simplex[..=self.dim]);
        places.fold(0.0, |most, x| height(x).abs().max(most))
    }

    pub fn bounds(&self, piece: &Piece) -> Bounds {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for &corner in &piece.corners[..=self.dim] {
            let x = match self.is_surface {
                true => self.points[corner as usize],
                false => self.place(corner, &Frame::at([0.0; 3])),
            };
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(x[k]);
                bounds[1][k] = bounds[1][k].max(x[k]);
            }
        }
        bounds
    }

    /// Pieces of one cell: itself, or the simplices between the nodes of a lattice.
    fn divide(&mut self, cell: u32) -> Result<(), &'static str> {
        let nodes: Vec<u32> = self.side.cell(cell as usize).collect();
        let element = self.element(cell).clone();
        let origin = self.points[nodes[0] as usize];
        let offset = |point: &u32| match self.is_surface {
            true => subtract(&self.points[*point as usize], &origin),
            false => self.place(*point, &Frame::at(origin)),
        };
        let places: Vec<[f64; 3]> = nodes.iter().map(offset).collect();
        let geometry = Geometry::of(&element, &places, self.near);
        let is_quadrangle = element.kind.shape() == Shape::Quadrangle;
        let order = if geometry == Geometry::Curved {
            element.order
        } else {
            1
        };
        let shape = element.kind.shape();
        let is_hexahedron = shape == Shape::Hexahedron;
        let is_solid = is_hexahedron || element.is_prism() || element.is_pyramid();
        let is_around_centre = is_solid && geometry != Geometry::Straight;
        let mut pieces = Vec::new();
        if order == 1 && !is_hexahedron && !is_around_centre {
            let of = |corners: [usize; 4]| corners.map(|k| nodes.get(k).copied().unwrap_or(0));
            match (is_quadrangle, self.dim) {
                (true, _) => pieces.extend([[0, 1, 2, 0], [0, 2, 3, 0]].map(of)),
                (_, 2) => pieces.push(of([0, 1, 2, 0])),
                _ if element.is_prism() => {
                    pieces.extend([[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]].map(of));
                }
                _ if element.is_pyramid() => pieces.extend([[0, 1, 2, 4], [0, 2, 3, 4]].map(of)),
                _ => pieces.push(of([0, 1, 2, 3])),
            }
        } else {
            let (lattice, simplices) = match is_around_centre {
                true => around_centres(shape, order),
                _ => lattice(order, self.dim, element.is_product()),
            };
            let first = self.points.len() as u32;
            let new = lattice.into_iter().map(|x| {
                let place = element.interpolate(&places, &x);
                [0, 1, 2].map(|k| place[k] + origin[k])
            });
            let new: Vec<[f64; 3]> = new.collect();
            pieces.extend(simplices.into_iter().map(|s| s.map(|k| first + k)));
            self.points.to_mut().extend(new);
            // The faces of quadrangles need not be plane.
            self.curved += usize::from(geometry != Geometry::Straight);
        }
        let first = self.frame(&Piece {
            corners: pieces[0],
            cell,
        });
        // On a surface each piece has a plane of its own, in which none is turned: against that of the first.
        let turned = |piece: &Piece| match self.is_surface {
            true => self.frame(piece).cosine(&first) < 0.0,
            false => self.piece_measure(piece) < 0.0,
        };
        let mut pieces: Vec<Piece> = pieces
            .into_iter()
            .map(|corners| Piece { corners, cell })
            .collect();
        if pieces
            .iter()
            .any(|piece| !(self.piece_measure(piece).abs() > 0.0))
        {
            return Err("has no measure");
        }
        let backwards = pieces.iter().filter(|piece| turned(piece)).count();
        let is_folded = backwards != 0 && backwards != pieces.len();
        let is_bent = geometry == Geometry::Multilinear && is_quadrangle;
        let flat = |place: &[f64; 3]| match self.is_surface {
            true => first.coordinates(&[0, 1, 2].map(|k| place[k] + origin[k])),
            false => *place,
        };
        let flat = || places.iter().map(flat).collect::<Vec<_>>();
        if is_folded || is_bent && !is_convex(&flat()) {
            return Err("is folded");
        }
        if backwards > 0 {
            pieces.iter_mut().for_each(|piece| piece.corners.swap(1, 2));
        }
        self.geometries[cell as usize] = geometry;
        self.pieces.extend(pieces);
        Ok(())
    }

    /// # Errors
    /// Two cells with more in common than their sides.
    fn refuse_overlaps(&self, boxes: &[Bounds]) -> Result<()> {
        let overlap = |&i: &u32| -> Result<()> {
            cancel::check()?;
            let piece = &self.pieces[i as usize];
            let frame = self.frame(piece);
            let of_piece = self.simplex(piece, &frame);
            let size = measure(self.dim, &of_piece);
            let (mut cut, mut scratch) = (Vec::new(), Vec::new());
            let mut found = None;
            self.tree.query(&boxes[i as usize], |j| {
                let other = &self.pieces[j as usize];
                if j <= i || found.is_some() || self.share_a_face(piece, other) {
                    return;
                }
                let mut of_other = self.simplex(other, &frame);
                turn_left(self.dim, &mut of_other);
                let common = clip(self.dim, &of_piece, &of_other, &mut cut, &mut scratch);
                let smaller = size.min(measure(self.dim, &of_other));
                let strip = self.near * self.span(piece).min(self.span(other));
                // Sheets of a surface may lie near each other, or end in an edge.
                let touches = |cut: &[Simplex]| {
                    let rounding = self.near + 1e-9 * self.length(piece);
                    self.rise(other, &frame, cut) <= rounding
                };
                if common > 1e-6 * smaller + strip.min(1e-2 * smaller) && touches(&cut) {
                    found = Some((other.cell, common));
                }
            });
            let Some((other, common)) = found else {
                return Ok(());
            };
            let cell = piece.cell;
            let place = self.side.centroid(cell as usize).unwrap_or_default();
            Err(Error::Mesh {
                mesh: self.side.source.clone(),
                what: format!(
                    "cells {cell} at {:?} and {other} overlap by {common:.3e}: it is folded, or two meshes in one file",
                    &place[..self.side.space]
                ),
                remedy: "repair the mesh: a function on it has two values there".into(),
            })
        };
        let blocks = self.tree.order.chunks(BLOCK);
        let found = parallel::map(blocks, |block| block.iter().try_for_each(overlap));
        found.into_iter().collect()
    }

    /// Do two straight simplices of the file lie on both sides of a face of both? Most that meet do.
    fn share_a_face(&self, a: &Piece, b: &Piece) -> bool {
        let [of_a, of_b] = [a, b].map(|piece| &piece.corners[..=self.dim]);
        let alone = |of: &[u32], other: &[u32]| {
            let mut alone = of.iter().filter(|corner| !other.contains(corner));
            (alone.next().copied(), alone.next().copied())
        };
        let ((Some(p), None), (Some(q), None)) = (alone(of_a, of_b), alone(of_b, of_a)) else {
            return false;
        };
        let frame = self.frame(a);
        let with = |from: u32, to: u32| {
            let corners = a.corners.map(|c| if c == from { to } else { c });
            let piece = Piece {
                corners,
                cell: a.cell,
            };
            measure(self.dim, &self.simplex(&piece, &frame))
        };
        with(p, q) < 0.0
    }

    /// The box in which pieces of the other mesh may have something in common with this one: around itself, and on a surface wider, since the
    /// other has its corners elsewhere on it.
    pub fn reach(&self, piece: &Piece) -> Bounds {
        let [low, high] = self.bounds(piece);
        let wider = match self.is_surface {
            true => APART * self.length(piece),
            false => 0.0,
        };
        [low.map(|x| x - wider), high.map(|x| x + wider)]
    }

    /// The longest side of the box around a piece.
    pub fn length(&self, piece: &Piece) -> f64 {
        let [low, high] = self.bounds(piece);
        (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max)
    }

    /// Larger than the largest face of a piece.
    pub fn span(&self, piece: &Piece) -> f64 {
        self.length(piece).powi(self.dim as i32 - 1)
    }
}

/// The most pieces of a cell of order 1.
fn most_pieces(element: &Element) -> usize {
    match element.kind.shape() {
        Shape::Hexahedron => 24,
        Shape::Prism => 14,
        Shape::Pyramid => 8,
        _ => 2,
    }
}

/// The points that divide a reference cell, and the simplices between them.
type Division = (Vec<[f64; 3]>, Vec<[u32; 4]>);

/// The parts of a hexahedron or a prism in p steps, or a pyramid, each divided into tetrahedra between its centre and its faces, those of quadrangles
/// around their centres: neighbours divide the face between them in the same way, although it need not be plane.
fn around_centres(shape: Shape, p: usize) -> Division {
    let step = 1.0 / p as f64;
    let whole = |at: [usize; 3]| at.map(|k| k as f64 * step);
    let cubes = (0..p).flat_map(|k| (0..p).flat_map(move |j| (0..p).map(move |i| [i, j, k])));
    let parts: Vec<Vec<[f64; 3]>> = match shape {
        Shape::Hexahedron => cubes
            .map(|[i, j, k]| {
                let corner = |[x, y, z]: [usize; 3]| whole([i + x, j + y, k + z]);
                [0, 1]
                    .into_iter()
                    .flat_map(|z| [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[x, y]| corner([x, y, z])))
                    .collect()
            })
            .collect(),
        Shape::Prism => cubes
            .flat_map(|[i, j, k]| {
                let of = |corners: [[usize; 2]; 3]| -> Vec<[f64; 3]> {
                    let at = |z: usize| corners.map(|[x, y]| whole([i + x, j + y, k + z]));
                    [at(0), at(1)].concat()
                };
                let (up, down) = (i + j < p, i + j + 1 < p);
                let up = up.then(|| of([[0, 0], [1, 0], [0, 1]]));
                let down = down.then(|| of([[1, 1], [0, 1], [1, 0]]));
                up.into_iter().chain(down)
            })
            .collect(),
        _ => vec![PYRAMID.to_vec()],
    };
    let middle = |of: &[[f64; 3]]| -> [f64; 3] {
        [0, 1, 2].map(|axis| of.iter().map(|x| x[axis]).sum::<f64>() / of.len() as f64)
    };
    let (mut points, mut simplices) = (Vec::new(), Vec::new());
    for part in parts {
        for side in sides(shape) {
            let corners: Vec<[f64; 3]> = side.iter().map(|k| part[*k]).collect();
            let triangles: Vec<[[f64; 3]; 3]> = match corners[..] {
                [a, b, c] => vec![[a, b, c]],
                _ => {
                    let next = corners.iter().cycle().skip(1);
                    let edges = corners.iter().zip(next);
                    edges.map(|(a, b)| [middle(&corners), *a, *b]).collect()
                }
            };
            for [a, b, c] in triangles {
                let first = points.len() as u32;
                points.extend([middle(&part), a, b, c]);
                simplices.push([0, 1, 2, 3].map(|k| first + k));
            }
        }
    }
    (points, simplices)
}

/// The points of a reference cell in steps of 1/p, and the p^d simplices between them, d! times as many in a quadrangle or hexahedron: those of
/// Kuhn's division of cubes, as far as they lie within x ≥ y ≥ z.
fn lattice(p: usize, dim: usize, is_product: bool) -> Division {
    let is_inside =
        |x: &[usize; 3]| x.iter().all(|k| *k <= p) && (is_product || x[0] >= x[1] && x[1] >= x[2]);
    let top = if dim == 3 { p } else { 0 };
    let all = (0..=top).flat_map(|k| (0..=p).flat_map(move |j| (0..=p).map(move |i| [i, j, k])));
    let points: Vec<[usize; 3]> = all.filter(is_inside).collect();
    // Every second one turns the other way.
    let paths: &[&[usize]] = match dim {
        2 => &[&[0, 1], &[1, 0]],
        _ => &[
            &[0, 1, 2],
            &[0, 2, 1],
            &[1, 2, 0],
            &[1, 0, 2],
            &[2, 0, 1],
            &[2, 1, 0],
        ],
    };
    let mut simplices = Vec::new();
    for start in &points {
        for (turn, path) in paths.iter().enumerate() {
            let mut corners = [0; 4];
            let mut x = *start;
            let mut all = true;
            for k in 0..=dim {
                let found = points.binary_search_by(|q| q.iter().rev().cmp(x.iter().rev()));
                all &= found.is_ok();
                corners[k] = found.unwrap_or(0) as u32;
                if let Some(axis) = path.get(k) {
                    x[*axis] += 1;
                }
            }
            if turn % 2 == 1 {
                corners.swap(1, 2);
            }
            if all {
                simplices.push(corners);
            }
        }
    }
    // From x ≥ y ≥ z to the corners 0, e₁, e₂, e₃.
    let unfold = |x: [usize; 3]| match is_product {
        true => x,
        false => [x[0] - x[1], x[1] - x[2], x[2]],
    };
    let points = points.into_iter().map(unfold);
    let points = points.map(|x| x.map(|k| k as f64 / p as f64));
    (points.collect(), simplices)
}
