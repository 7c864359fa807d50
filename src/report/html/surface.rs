//! A residual in 3D: Γ_C seen from outside, and all rows from the side.

use super::Html;
use super::markup::figure;
use super::plane::{Layers, View, WIDTH, circle, drawing, ends, line, map, path, polygon, word};
use super::residual::Put;
use crate::text::number::whole;
use crate::text::text;
use faceoff_mesh::mesh::Triangulation;

const HIGHEST: f64 = 380.0;
const AXES: [&str; 3] = ["x", "y", "z"];

/// The two axes of a picture of faces, and whether the first points to the left, so that the view is from outside.
pub(super) struct Sight {
    pub axes: [usize; 2],
    pub is_mirrored: bool,
}

impl Sight {
    /// Along the axis in which the faces extend least.
    pub fn new(mesh: &Triangulation, faces: &[usize]) -> Self {
        let extent = |axis: usize| {
            let [low, high] = ends(faces.iter().map(|f| mesh.face_midpoint(*f)[axis]));
            high - low
        };
        let mut axes = [0, 1, 2];
        axes.sort_by(|&i, &j| extent(j).total_cmp(&extent(i)));
        let across = axes[2];
        let mut axes = [axes[0], axes[1]];
        axes.sort_unstable();
        // From the centroid of the cell towards the face.
        let outwards: f64 = faces
            .iter()
            .map(|face| {
                let cell = mesh.face_cells(*face)[0] as usize;
                let centroid = mesh.vertices(cell).iter().map(|v| v[across]).sum::<f64>() / 4.0;
                mesh.face_midpoint(*face)[across] - centroid
            })
            .sum();
        // x, y and z, x are right-handed, x, z is not.
        let turns = if across == 1 { -1.0 } else { 1.0 };
        Sight {
            axes,
            is_mirrored: outwards * turns < 0.0,
        }
    }

    pub fn flat(&self, p: [f64; 3]) -> [f64; 2] {
        let sign = if self.is_mirrored { -1.0 } else { 1.0 };
        [sign * p[self.axes[0]], p[self.axes[1]]]
    }

    pub fn words(&self) -> String {
        let [i, j] = self.axes.map(|axis| AXES[axis]);
        let side = if self.is_mirrored { "left" } else { "right" };
        format!("{i} to the {side}, {j} upwards")
    }
}

/// The faces of Γ_C in the projection.
pub(super) struct Surface<'a> {
    mesh: &'a Triangulation,
    sight: Sight,
    view: View,
}

impl<'a> Surface<'a> {
    pub fn new(mesh: &'a Triangulation, faces: &[usize]) -> Self {
        let sight = Sight::new(mesh, faces);
        let corners = faces.iter().flat_map(|face| mesh.face(*face));
        let view = View::of(
            corners.map(|v| sight.flat(mesh.points[*v as usize])),
            HIGHEST,
        );
        Surface { mesh, sight, view }
    }

    fn corners(&self, face: usize) -> Vec<[f64; 2]> {
        let vertices = self.mesh.face(face).iter();
        let place = |v: &u32| self.sight.flat(self.mesh.points[*v as usize]);
        vertices.map(place).collect()
    }

    /// Each face in its colour, and a circle around one of them.
    pub fn picture(
        &self,
        label: &str,
        faces: &[(usize, usize)],
        red: &[usize],
        worst: Option<usize>,
    ) -> Html {
        let mut layers = Layers::new("k");
        for (face, colour) in faces {
            layers.add(*colour, &self.view, &self.corners(*face));
        }
        let outline = |face: usize| polygon(&self.view, self.corners(face));
        let edges: String = faces.iter().map(|(face, _)| outline(*face)).collect();
        let red: String = red.iter().map(|face| outline(*face)).collect();
        let mut svg = layers.svg(true) + &path("net", edges) + &line("redl", 2.5, red);
        if let Some(face) = worst {
            let at = self.sight.flat(self.mesh.face_midpoint(face));
            svg += &circle(self.view.pixel(at), 10.0);
        }
        drawing(label, [WIDTH, self.view.height], &svg)
    }

    pub fn words(&self) -> String {
        self.sight.words()
    }
}

/// Dots in 3D in the projection along the second axis, those of larger colours in front.
pub(super) fn from_side(
    label: &str,
    mesh: &Triangulation,
    spots: impl Iterator<Item = ([f64; 3], usize)>,
) -> Html {
    let side = |p: [f64; 3]| [p[0], p[2]];
    let view = View::of(mesh.points.iter().map(|p| side(*p)), HIGHEST);
    let mut layers = Layers::new("k");
    layers.add_spots(&view, spots.map(|(p, colour)| (side(p), colour)));
    let axes = word("t m", [0.5 * WIDTH, view.height + 13.0], "x, and z upwards");
    drawing(
        label,
        [WIDTH, view.height + 14.0],
        &(layers.svg(true) + &axes),
    )
}

/// The cause in 3D.
pub(super) fn cause(put: &Put, about: &str) -> Html {
    let (problem, mesh) = (put.problem, put.problem.space.mesh);
    let worse = |a: f64, b: f64| if a.is_nan() || a >= b { a } else { b };
    // A face of Γ_C by the worst row of the adjacent cell, since its data change these rows.
    let behind = |cell: usize| {
        let rows = problem.space.cell_dofs(cell).iter();
        rows.fold(0.0, |most: f64, row| worse(put.errors[*row as usize], most))
    };
    let faces: Vec<(usize, usize)> = problem
        .contact
        .iter()
        .map(|f| (f.face, put.ramp.step(behind(f.cell))))
        .collect();
    let farthest = problem.contact.iter().map(|f| (f.face, behind(f.cell)));
    let farthest = farthest.filter(|(_, error)| !(*error <= put.ramp.tolerance));
    let farthest = farthest.reduce(|a, b| if worse(b.1, a.1) == a.1 { a } else { b });
    let blamed = put
        .blamed()
        .iter()
        .filter_map(|spot| mesh.find_face(&spot.vertices));
    let blamed: Vec<usize> = blamed.collect();
    let all: Vec<usize> = faces.iter().map(|(face, _)| *face).collect();
    let mut pictures = Vec::new();
    let sight = Sight::new(mesh, &all);
    if !all.is_empty() {
        let surface = Surface::new(mesh, &all);
        let caption = text!(
            "**The cause.** Γ_C from outside, {}: each face by the worst row of the cell behind it; {put.name}, {about}",
            surface.words()
        );
        let label = format!("residual of {} on Γ_C, {about}", put.name);
        let worst = farthest.map(|(face, _)| face);
        let picture = surface.picture(&label, &faces, &blamed, worst);
        pictures.push(figure("", caption, picture));
    }
    let across = 3 - sight.axes[0] - sight.axes[1];
    let side = |p: [f64; 3]| [p[sight.axes[0]], p[across]];
    let view = View::of(mesh.points.iter().map(|p| side(*p)), HIGHEST);
    let mut layers = Layers::new("k");
    let place = |row: usize| side(problem.space.point(row));
    let rows = 0..put.errors.len();
    layers.add_spots(&view, rows.map(|row| (place(row), put.colour(row))));
    let mut svg = layers.svg(true);
    if let Some(row) = put.worst() {
        svg += &circle(view.pixel(place(row)), 12.0);
    }
    let axes = [sight.axes[0], across].map(|axis| AXES[axis]);
    svg += &word("t m", [0.5 * WIDTH, view.height + 18.0], axes[0]);
    let failing = (0..put.errors.len()).filter(|row| put.fails(*row)).count();
    let caption = text!(
        "**All rows from the side**, {} to the right, {} upwards, the worst in front; {} of {} fail",
        axes[0],
        axes[1],
        whole(failing),
        whole(put.errors.len())
    );
    let label = format!("residual of {} from the side, {about}", put.name);
    pictures.push(map(caption, &label, view.height + 20.0, &svg));
    pictures.into_iter().collect()
}
