//! A field that any code left in a file, as a function of a finite element space.
//!
//! What the file has values on says which space: points of linear or quadratic cells, corners of cells, faces, or places.
//! A function that is linear on each cell is P1 where it is continuous, CR where it is so at the midpoints of faces, and
//! otherwise neither. Nothing is projected: the function is the file's own, or it is refused.

mod parts;

use std::collections::HashMap;
use std::path::Path;

use serde::Serialize;

use crate::engine::meshio_python;
use faceoff_fem::contact::{Method, Problem};
use faceoff_fem::element::{CR, Element, P1, P2, Space};
use faceoff_fem::scene::{MeshSource, Scene};
use faceoff_judge::{first_at_place, partners};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::field::{ResultField, Results};
use faceoff_mesh::file;
use faceoff_mesh::io;
use faceoff_mesh::mesh::{
    CellBlock, CellKind, Mesh, Shape, Triangulation, local_edges, quadratic_edges,
};
use parts::divide;

/// Numbers in binary64, and those that a code rounded to binary32, agree to this, relative to the largest.
const NEAR: [f64; 2] = [1e-9, 1e-6];
/// Values on Γ_D that are g up to this, relative to the largest value, are taken as g.
const TAKEN: f64 = 1e-6;
/// Less than this is rounding, of which there is nothing to say.
const ROUNDING: f64 = 1e-12;
/// No point, or no number.
const NONE: u32 = u32::MAX;

/// How a file is to be understood, where it does not say so itself.
#[derive(Default)]
pub struct Options<'a> {
    pub field: Option<&'a str>,
    pub element: Option<&'static dyn Element>,
    /// The mesh of the result, instead of the file's own.
    pub mesh: Option<&'a Path>,
    /// The refinement of the scene's mesh, for a file without one.
    pub n: Option<usize>,
}

/// A field of a file as a function u of the space of an element on a mesh.
pub struct Foreign {
    pub mesh: Triangulation,
    pub element: &'static dyn Element,
    /// At all dofs.
    pub u: Vec<f64>,
    pub understood: Understood,
}

/// How a file was understood.
#[derive(Debug, Clone, Serialize)]
pub struct Understood {
    pub field: String,
    pub element: &'static str,
    /// What the values are of: points, corners, faces, vertices, places.
    pub values: &'static str,
    pub mesh: String,
    /// The parts of the boundary are those of the mesh's groups, or of the scene's mesh at the same place.
    pub boundary: &'static str,
}

impl Understood {
    /// One line.
    pub fn sentence(&self) -> String {
        format!(
            "field `{}`, values at {}, is a function of {} on mesh {}; the parts of its boundary are by {}",
            self.field, self.values, self.element, self.mesh, self.boundary
        )
    }
}

impl Foreign {
    /// Reads the result of a scene.
    ///
    /// # Errors
    /// A file that cannot be read; no field that is asked for, or too many; one that is no function of P1, P2 or CR; a mesh
    /// that is not of the scene's domain.
    pub fn read(path: &Path, scene: &Scene, options: &Options) -> Result<Self> {
        let bytes = file::read(path)?;
        let held = io::read_results(path, &bytes, meshio_python().as_deref())?;
        drop(bytes);
        let given = options.mesh.map(|mesh| on_file(scene, mesh)).transpose()?;
        let top = held.dimensions().last().copied().map(usize::from);
        let of_given = given.as_ref().map(|mesh| mesh.dim);
        let dim = of_given.or_else(|| scene.source().dim());
        let dim = dim.or(top).unwrap_or(2);
        let reader = Reader {
            path,
            held: &held,
            options,
            dim,
        };
        let own = |given: Option<Triangulation>| match given {
            Some(mesh) => Ok(mesh),
            None => scene.triangulation(options.n),
        };
        let mut found = match top {
            Some(top) if top == dim => reader.cells(given)?,
            Some(top) if top + 1 == dim => reader.faces(own(given)?)?,
            None | Some(0) if held.width > 1 => reader.faces(own(given)?)?,
            None | Some(0) => reader.table(own(given)?)?,
            Some(top) => {
                return Err(reader.refuse(
                    format!(
                        "its cells are of dimension {top}, and scene {} is {dim}D",
                        scene.name()
                    ),
                    "give a result of this scene",
                ));
            }
        };
        found.understood.boundary = divide(scene, &mut found.mesh)?;
        Ok(found)
    }

    /// The usual method of the field's element. The bounds hold by any; the flux on Γ_C that they use is the method's.
    pub fn method(&self) -> Method {
        let name = self.element.name().to_lowercase();
        name.parse()
            .expect("invariant: every element names a method")
    }
}

/// Takes values on Γ_D as g where all are so but for rounding, also to binary32; returns by how much they were off, relative
/// to the largest value, if that is worth a word.
pub fn take_boundary_values(problem: &Problem, u: &mut [f64]) -> Option<f64> {
    let largest = largest(u);
    let held = || problem.dirichlet.iter().enumerate();
    let held = || held().filter_map(|(dof, g)| Some((dof, (*g)?)));
    let off = held().fold(0.0, |most: f64, (dof, g)| match (u[dof] - g).abs() {
        0.0 => most,
        // Negated so that NaN is not taken for g.
        off if !(off <= TAKEN * largest.max(g.abs())) => f64::INFINITY,
        off => most.max(off / largest.max(g.abs())),
    });
    if off.is_infinite() {
        return None;
    }
    for (dof, g) in held() {
        u[dof] = g;
    }
    Some(off).filter(|off| *off > ROUNDING)
}

/// A mesh file in place of the scene's, as `solve --mesh` takes it.
fn on_file(scene: &Scene, path: &Path) -> Result<Triangulation> {
    let source = MeshSource::File {
        path: path.to_owned(),
        n: None,
        dim: scene.source().dim(),
    };
    scene.with_source(source)?.triangulation(None)
}

/// A file, and how it is to be understood.
struct Reader<'a> {
    path: &'a Path,
    held: &'a Results,
    options: &'a Options<'a>,
    dim: usize,
}

/// Fields that something carries, and what that is called.
type Carried<'a> = (&'static str, &'a [ResultField]);

/// A function on the cells of a mesh, each with values of its own.
struct OnCells {
    /// 1 or 2
    degree: usize,
    /// Vertices of each cell, `dim + 1`, as the mesh numbers them and in the order of the file.
    vertices: Vec<u32>,
    /// At the nodes of each cell: the vertices, and for degree 2 the midpoints of [`quadratic_edges`].
    values: Vec<f64>,
    /// The mesh's number of each cell.
    cells: Vec<u32>,
}

/// Where the values of neighbours are farthest apart, and how far.
#[derive(Default)]
struct Jump {
    size: f64,
    dof: usize,
}

impl<'a> Reader<'a> {
    fn refuse(&self, what: String, remedy: impl Into<String>) -> Error {
        Error::file(self.path, Place::Whole, what, remedy)
    }

    /// Every field of the file, as messages list them.
    fn listed(&self) -> String {
        let held = self.held;
        let on = |of: &'a [ResultField], what: &'static str| {
            let of = of.iter();
            of.map(move |f| match f.components {
                1 => format!("`{}` on {what}", f.name),
                n => format!("`{}` ({n} components) on {what}", f.name),
            })
        };
        let all = on(&held.on_points, "points")
            .chain(on(&held.on_cells, "cells"))
            .chain(on(&held.on_corners, "corners of cells"));
        let all: Vec<String> = all.collect();
        match all.is_empty() {
            true => "no field".into(),
            false => all.join(", "),
        }
    }

    /// The field that is named, else the only one that can be meant, else the one of a usual name; and what carries it.
    fn field(
        &self,
        all: &[Carried<'a>],
        usual: &[&str],
    ) -> Result<(&'static str, &'a ResultField)> {
        let carried = || {
            let of = |&(on, fields): &Carried<'a>| fields.iter().map(move |field| (on, field));
            all.iter().flat_map(of)
        };
        let named = |name: &str| carried().filter(|(_, f)| f.name == name).collect();
        let wanted = || {
            let on: Vec<&str> = all.iter().map(|(on, _)| *on).collect();
            format!("a field with one number at {}", on.join(" or "))
        };
        let (on, field) = if let Some(name) = self.options.field {
            let found: Vec<_> = named(name);
            match found[..] {
                [one] => one,
                [] => {
                    let what = match self.held.has(name) {
                        true => format!("`{name}` is no field at {}", all[0].0),
                        false => format!("it has no field `{name}`"),
                    };
                    let remedy = format!("name {}; it has {}", wanted(), self.listed());
                    return Err(self.refuse(what, remedy));
                }
                _ => {
                    let what = format!("it has {} fields `{name}`", found.len());
                    return Err(self.refuse(what, "write one of them, of one time, alone"));
                }
            }
        } else {
            // Whole numbers are labels.
            let fits = |(_, f): &(&str, &ResultField)| f.components == 1 && f.rest.is_none();
            let fitting: Vec<_> = carried().filter(fits).collect();
            let usual = usual.iter().find_map(|usual| {
                let mut found = fitting.iter().filter(|(_, f)| f.name == *usual);
                found.next().filter(|_| found.next().is_none())
            });
            match (&fitting[..], usual) {
                ([one], _) | (_, Some(one)) => *one,
                ([], _) => {
                    let what = format!("it has no field that can be u, but {}", self.listed());
                    return Err(self.refuse(what, format!("write {}", wanted())));
                }
                _ => {
                    let names = fitting.iter().map(|(_, f)| format!("`{}`", f.name));
                    let names = names.collect::<Vec<_>>().join(", ");
                    let what = format!("several of its fields can be u: {names}");
                    return Err(self.refuse(what, "name one by --field"));
                }
            }
        };
        if field.components != 1 {
            let (name, n) = (&field.name, field.components);
            let what = format!("`{name}` has {n} components, and u is one number");
            return Err(self.refuse(what, format!("name {}; it has {}", wanted(), self.listed())));
        }
        match field.values.iter().find(|value| !value.is_finite()) {
            None => Ok((on, field)),
            Some(value) => Err(self.refuse(
                format!("`{}` is {value} somewhere", field.name),
                "give a field of finite numbers",
            )),
        }
    }

    fn row(&self, field: &ResultField, item: u32, what: &str) -> Result<f64> {
        let value = field.row_of(item).and_then(|row| field.values.get(row));
        value.copied().ok_or_else(|| {
            let what = format!("`{}` has no value at {what} {item}", field.name);
            self.refuse(what, "give a field of the whole domain")
        })
    }

    fn found(
        &self,
        mesh: Triangulation,
        element: &'static dyn Element,
        u: Vec<f64>,
        (values, field): (&'static str, &ResultField),
    ) -> Foreign {
        let understood = Understood {
            field: field.name.clone(),
            element: element.name(),
            values,
            mesh: mesh.name.clone(),
            boundary: "",
        };
        Foreign {
            mesh,
            element,
            u,
            understood,
        }
    }

    /// Values at the nodes of the cells of a mesh.
    fn cells(&self, given: Option<Triangulation>) -> Result<Foreign> {
        let (held, dim) = (self.held, self.dim);
        let degree = self.degree()?;
        let all: [Carried; 2] = [("points", &held.on_points), ("corners", &held.on_corners)];
        let (on, field) = self.field(&all, &["u"])?;
        let (mut nodes, mut values, mut corner) = (Vec::new(), Vec::new(), 0);
        for (cell, of) in held.cell_dimensions().into_iter().enumerate() {
            cancel::check()?;
            for point in held.cell(cell) {
                if usize::from(of) == dim {
                    nodes.push(point);
                    values.push(match on {
                        "points" => self.row(field, point, "point")?,
                        _ => self.row(field, corner, "corner")?,
                    });
                }
                corner += 1;
            }
        }
        let per_cell = nodes_of(dim, degree);
        if degree == 2 {
            self.refuse_curved(&nodes, per_cell)?;
        }
        let (points, number) = self.vertices(&nodes, per_cell)?;
        let corners = nodes.chunks_exact(per_cell).flat_map(|c| &c[..=dim]);
        let mut vertices: Vec<u32> = corners.map(|&p| number[p as usize]).collect();
        let (mesh, cells) = match given {
            None => {
                let mesh = self.own_mesh(points, &number)?;
                let cells = (0..mesh.cell_count() as u32).collect();
                (mesh, cells)
            }
            Some(mesh) => {
                let cells = self.cells_among(&mesh, &points, &mut vertices)?;
                (mesh, cells)
            }
        };
        let function = OnCells {
            degree,
            vertices,
            values,
            cells,
        };
        let (element, u) = self.function(&mesh, &function, &field.name)?;
        Ok(self.found(mesh, element, u, (on, field)))
    }

    /// The degree of functions on the cells, by their nodes.
    fn degree(&self) -> Result<usize> {
        let mut degree = None;
        let kinds = self.held.kinds.iter();
        for (kind, count) in kinds.filter(|(k, n)| usize::from(k.dim()) == self.dim && *n > 0) {
            let of = match kind {
                CellKind::Triangle | CellKind::Tetrahedron => 1,
                CellKind::Triangle6 | CellKind::Tetrahedron10 => 2,
                _ => {
                    return Err(self.refuse(
                        format!("it has {count} cells of type {kind}, and P1, P2 and CR are of simplices with nodes at vertices, or at vertices and midpoints of edges"),
                        "write such cells",
                    ));
                }
            };
            if degree.replace(of).is_some_and(|other| other != of) {
                return Err(self.refuse(
                    "some of its cells are linear, others quadratic".into(),
                    "write cells of one kind",
                ));
            }
        }
        Ok(degree.unwrap_or(1))
    }

    /// Quadratic cells whose edges are no straight lines, halved by their nodes, are no cells of P2 here.
    fn refuse_curved(&self, nodes: &[u32], per_cell: usize) -> Result<()> {
        let at = |point: u32| self.held.points[point as usize];
        let near = near(&self.held.points);
        for (cell, nodes) in nodes.chunks_exact(per_cell).enumerate() {
            cancel::check()?;
            let middles = &nodes[self.dim + 1..];
            for (&[a, b], &middle) in quadratic_edges(self.dim).iter().zip(middles) {
                let (p, q, m) = (at(nodes[a]), at(nodes[b]), at(middle));
                if (0..3).any(|k| (0.5 * (p[k] + q[k]) - m[k]).abs() > near) {
                    return Err(self.refuse(
                        format!("its cell {cell} is curved: the node at {m:?} is not the midpoint of its edge"),
                        "mesh the domain with straight edges",
                    ));
                }
            }
        }
        Ok(())
    }

    /// The vertices of the cells, and the number of each point among them. Where every cell has points of its own, as in
    /// discontinuous output, those at one place are one vertex.
    fn vertices(&self, nodes: &[u32], per_cell: usize) -> Result<(Vec<[f64; 3]>, Vec<u32>)> {
        let points = &self.held.points;
        let mut seen = vec![false; points.len()];
        let is_once = |&node: &u32| !std::mem::replace(&mut seen[node as usize], true);
        let is_broken = nodes.len() > per_cell && nodes.iter().all(is_once);
        cancel::check()?;
        let first = match is_broken {
            // Each cell may have rounded its points in its own way.
            true => first_at_place(points)?,
            false => (0..points.len() as u32).collect(),
        };
        let mut number = vec![NONE; points.len()];
        for &corner in nodes.chunks_exact(per_cell).flat_map(|c| &c[..=self.dim]) {
            number[first[corner as usize] as usize] = 0;
        }
        let mut vertices = Vec::new();
        for (number, point) in number.iter_mut().zip(points).filter(|(n, _)| **n == 0) {
            *number = vertices.len() as u32;
            vertices.push(*point);
        }
        let number = first.iter().map(|&first| number[first as usize]).collect();
        Ok((vertices, number))
    }

    /// The mesh of the file: its cells, and those of its boundary that are in groups.
    fn own_mesh(&self, points: Vec<[f64; 3]>, number: &[u32]) -> Result<Triangulation> {
        let (held, dim) = (self.held, self.dim);
        let has_groups = held.groups.iter().any(|g| usize::from(g.dim) + 1 == dim);
        let mut blocks = Vec::new();
        let mut cell = 0;
        for &(kind, count) in &held.kinds {
            let cells = cell..cell + count;
            cell += count;
            let shape = kind.shape();
            // Without groups the rest says nothing; with them their numbers count it.
            if usize::from(shape.dim()) != dim && !has_groups {
                continue;
            }
            let linear = match shape {
                Shape::Vertex => CellKind::Vertex,
                Shape::Line => CellKind::Line,
                Shape::Triangle => CellKind::Triangle,
                Shape::Tetrahedron => CellKind::Tetrahedron,
                _ => kind,
            };
            let corners = cells.flat_map(|c| held.cell(c).take(linear.points()));
            let nodes = corners.map(|p| number[p as usize]).collect();
            blocks.push(CellBlock::new(linear, nodes));
        }
        let mesh = Mesh {
            points,
            blocks,
            groups: match has_groups {
                true => held.groups.clone(),
                false => Vec::new(),
            },
            ..Mesh::default()
        };
        Triangulation::new(&held.source, &mesh)
    }

    /// The number that another mesh has for each cell, and, put in their place, for the cells' vertices.
    fn cells_among(
        &self,
        mesh: &Triangulation,
        points: &[[f64; 3]],
        vertices: &mut [u32],
    ) -> Result<Vec<u32>> {
        let counts = |cells, points| format!("{cells} cells with {points} vertices");
        let corners = self.dim + 1;
        let other = "give the mesh that the result was computed on";
        let (cells, own) = (vertices.len() / corners, mesh.points.len());
        if cells != mesh.cell_count() || points.len() != own {
            let (it, has) = (counts(cells, points.len()), counts(mesh.cell_count(), own));
            let what = format!("it has {it}, and mesh {} {has}", mesh.name);
            return Err(self.refuse(what, other));
        }
        let partner = partners(points, &mesh.points)?;
        for vertex in vertices.iter_mut() {
            *vertex = partner[*vertex as usize].ok_or_else(|| {
                let at = points[*vertex as usize];
                let what = format!("mesh {} has no single vertex at {at:?}", mesh.name);
                self.refuse(what, other)
            })?;
        }
        let key = |cell: &[u32]| {
            let mut key = [NONE; 4];
            key[..corners].copy_from_slice(cell);
            key.sort_unstable();
            key
        };
        let of_mesh = mesh.all_cells().chunks_exact(corners).map(key);
        let known: HashMap<[u32; 4], u32> = of_mesh.zip(0..).collect();
        let found = vertices.chunks_exact(corners).map(|cell| {
            cancel::check()?;
            known.get(&key(cell)).copied().ok_or_else(|| {
                let what = format!("its cell {cell:?} is no cell of mesh {}", mesh.name);
                self.refuse(what, other)
            })
        });
        found.collect()
    }

    /// The first space that a function on cells is of.
    fn function(
        &self,
        mesh: &Triangulation,
        function: &OnCells,
        name: &str,
    ) -> Result<(&'static dyn Element, Vec<f64>)> {
        let of_degree: &[&'static dyn Element] = match function.degree {
            1 => &[&P1, &CR],
            _ => &[&P2],
        };
        let asked = self.options.element.as_slice();
        if let Some(element) = asked.iter().find(|e| e.degree() < function.degree) {
            return Err(self.refuse(
                format!(
                    "`{name}` is of degree 2 on its cells, and no function of {}",
                    element.name()
                ),
                "leave out --element, or write the function on linear cells",
            ));
        }
        let largest = largest(&function.values);
        let near = NEAR[usize::from(is_rounded(function.values.iter()))];
        let mut jumps = Vec::new();
        for &element in if asked.is_empty() { of_degree } else { asked } {
            let space = Space::new(mesh, element);
            let (u, jump) = function.at_dofs(&space)?;
            if jump.size <= near * largest {
                return Ok((element, u));
            }
            let at = space.point(jump.dof);
            jumps.push(format!(
                "no function of {}, as it jumps by {:.1e} at ({}, {}, {})",
                element.name(),
                jump.size,
                at[0],
                at[1],
                at[2]
            ));
        }
        Err(self.refuse(
            format!("`{name}`, of which the largest value is {largest:e}, is {}", jumps.join("; and ")),
            "write the values of P1 or P2 at the nodes, or those of CR at the corners of each cell, with all digits",
        ))
    }

    /// Values on the faces: those of CR at their midpoints.
    fn faces(&self, mesh: Triangulation) -> Result<Foreign> {
        let held = self.held;
        let (on, field) = self.field(&[("faces", &held.on_cells)], &["u", "mean"])?;
        self.only(&CR, "values on faces are those of CR")?;
        let other = "give the mesh of the result by --mesh, or --n";
        // Numbers alone are the mesh's; places make them so.
        let number: Option<Vec<Option<u32>>> = match held.points.is_empty() {
            true => None,
            false => Some(partners(&held.points, &mesh.points)?),
        };
        let vertex = |point: u32| match &number {
            None => Some(point),
            Some(number) => *number.get(point as usize)?,
        };
        let mut u = vec![None; mesh.face_count()];
        for cell in 0..held.cell_count() {
            cancel::check()?;
            let vertices: Option<Vec<u32>> = held.cell(cell).map(vertex).collect();
            let face = vertices.filter(|v| v.len() == mesh.dim).and_then(|mut v| {
                v.sort_unstable();
                mesh.find_face(&v)
            });
            let face = face.ok_or_else(|| {
                let points: Vec<u32> = held.cell(cell).collect();
                self.refuse(
                    format!("{points:?} is no face of mesh {}", mesh.name),
                    other,
                )
            })?;
            let value = self.row(field, cell as u32, "face")?;
            if u[face].replace(value).is_some() {
                let what = format!("it has {} twice", mesh.face_label(face));
                return Err(self.refuse(what, "write each face once"));
            }
        }
        let lacks = u.iter().position(Option::is_none);
        if let Some(face) = lacks {
            let what = format!(
                "it has no value on {} of mesh {}",
                mesh.face_label(face),
                mesh.name
            );
            return Err(self.refuse(what, other));
        }
        let u = u.into_iter().flatten().collect();
        Ok(self.found(mesh, &CR, u, (on, field)))
    }

    /// Values by the numbers of vertices, or by places: the nodes of an element.
    fn table(&self, mesh: Triangulation) -> Result<Foreign> {
        let held = self.held;
        let (_, field) = self.field(&[("points", &held.on_points)], &["u"])?;
        let other = "give the mesh of the result by --mesh, or --n";
        let all: Vec<u32> = (0..held.point_count() as u32).collect();
        let items = field.at.as_ref().unwrap_or(&all);
        let every: [&'static dyn Element; 3] = [&P1, &CR, &P2];
        let spaces = every.map(|element| Space::new(&mesh, element));
        let by_number = held.points.is_empty();
        let asked = self.options.element.map(Element::name);
        let fits = spaces.iter().find(|space| {
            let name = space.element.name();
            space.dofs == items.len()
                && asked.is_none_or(|asked| asked == name)
                && (!by_number || name == P1.name())
        });
        let Some(space) = fits else {
            let counts = spaces
                .iter()
                .map(|s| format!("{} has {}", s.element.name(), s.dofs));
            let counts = counts.collect::<Vec<_>>().join(", ");
            let what = format!(
                "`{}` has {} values, and on mesh {} {counts}{}",
                field.name,
                items.len(),
                mesh.name,
                match by_number {
                    true => "; numbers of vertices are those of P1",
                    false => "",
                }
            );
            return Err(self.refuse(what, other));
        };
        let places: Vec<[f64; 3]>;
        let row_of: Vec<Option<u32>> = if by_number {
            let mut row_of = vec![None; space.dofs];
            for (item, row) in items.iter().zip(0..) {
                let id = held.ids[*item as usize];
                let slot = row_of.get_mut(id as usize).ok_or_else(|| {
                    let what = format!("mesh {} has no vertex {id}", mesh.name);
                    self.refuse(what, other)
                })?;
                *slot = Some(row);
            }
            row_of
        } else {
            places = items.iter().map(|i| held.points[*i as usize]).collect();
            let nodes: Vec<[f64; 3]> = space.points().collect();
            partners(&nodes, &places)?
        };
        let value = |(row, dof): (&Option<u32>, usize)| {
            let row = row.ok_or_else(|| {
                let [x, y, z] = space.point(dof);
                let (name, mesh) = (space.element.name(), &mesh.name);
                let what = format!(
                    "it has no single value at ({x}, {y}, {z}), a node of {name} on mesh {mesh}"
                );
                self.refuse(what, other)
            })?;
            Ok(field.values[row as usize])
        };
        let u = row_of.iter().zip(0..).map(value).collect::<Result<_>>()?;
        let element = space.element;
        let on = match by_number {
            true => "vertices",
            false => "places",
        };
        Ok(self.found(mesh, element, u, (on, field)))
    }

    fn only(&self, element: &'static dyn Element, why: &str) -> Result<()> {
        let asked = self.options.element.map(Element::name);
        match asked.filter(|asked| *asked != element.name()) {
            None => Ok(()),
            Some(asked) => {
                Err(self.refuse(format!("{why}, not of {asked}"), "leave out --element"))
            }
        }
    }
}

impl OnCells {
    /// The function at the dofs of a space, and by how much its values there differ from cell to cell.
    fn at_dofs(&self, space: &Space) -> Result<(Vec<f64>, Jump)> {
        let dim = space.mesh.dim;
        let given: &dyn Element = match self.degree {
            1 => &P1,
            _ => &P2,
        };
        let mut u = vec![f64::NAN; space.dofs];
        let mut jump = Jump::default();
        let values = self.values.chunks_exact(nodes_of(dim, self.degree));
        let cells = self.vertices.chunks_exact(dim + 1).zip(values);
        for ((vertices, values), &cell) in cells.zip(&self.cells) {
            cancel::check()?;
            let local = in_order(dim, vertices, values, space.mesh.cell(cell as usize));
            for (node, &dof) in space.nodes.iter().zip(space.cell_dofs(cell as usize)) {
                let phi = given.values(dim, node);
                let value: f64 = phi.iter().zip(&local).map(|(phi, u)| phi * u).sum();
                let known = &mut u[dof as usize];
                let size = (value - *known).abs();
                if known.is_nan() {
                    *known = value;
                } else if size > jump.size {
                    let dof = dof as usize;
                    jump = Jump { size, dof };
                }
            }
        }
        Ok((u, jump))
    }
}

/// A cell's values in the order of the mesh, which may number its vertices in another way than the file.
fn in_order(dim: usize, vertices: &[u32], values: &[f64], of_mesh: &[u32]) -> [f64; 10] {
    let mut local = [0.0; 10];
    let mut place = [0; 4];
    for (i, vertex) in of_mesh.iter().enumerate() {
        let own = vertices.iter().position(|v| v == vertex);
        place[i] = own.expect("invariant: it is the same cell");
        local[i] = values[place[i]];
    }
    let edges = quadratic_edges(dim);
    let middles = &values[dim + 1..];
    if middles.len() == edges.len() {
        for (k, &[a, b]) in local_edges(dim).iter().enumerate() {
            let (a, b) = (place[a], place[b]);
            let own = edges.iter().position(|e| *e == [a, b] || *e == [b, a]);
            local[dim + 1 + k] = middles[own.expect("invariant: any two vertices have an edge")];
        }
    }
    local
}

/// Number of nodes of a cell.
fn nodes_of(dim: usize, degree: usize) -> usize {
    match degree {
        1 => dim + 1,
        _ => dim + 1 + quadratic_edges(dim).len(),
    }
}

fn largest(values: &[f64]) -> f64 {
    values
        .iter()
        .fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// Are all of these binary32?
fn is_rounded<'a>(mut values: impl Iterator<Item = &'a f64>) -> bool {
    values.all(|x| f64::from(*x as f32) == *x)
}

/// How far apart points may be and still be at one place.
fn near(points: &[[f64; 3]]) -> f64 {
    let extent = |k: usize| {
        let of = points.iter().map(|p| p[k]);
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = of.fold(ends, |(low, high), x| (low.min(x), high.max(x)));
        high - low
    };
    let rounded = is_rounded(points.iter().flatten());
    NEAR[usize::from(rounded)] * (0..3).map(extent).fold(0.0, f64::max)
}
