//! Where a field does not solve its scheme: the residual of each row in 2D, around the worst one, and by the
//! terms in the rows. For 3D see [`super::surface`].

use super::Html;
use super::markup::html;
use super::plane::{
    Layers, View, WIDTH, circle, flat, line, map, mean, path, position, segments, word,
};
use super::ramp::Ramp;
use super::surface;
use crate::text::number::{number, size, whole};
use crate::text::{at_most, text};
use crate::why::{self, Explanation, Findings, Spot};
use faceoff_fem::contact::{Problem, Term};
use faceoff_fem::scene::Part;
use faceoff_mesh::mesh::Triangulation;

/// A map of the whole with more rows has squares instead of faces.
const MOST: usize = 20_000;
/// The same for small maps, of which there are several.
const MOST_SMALL: usize = 1_500;
/// The number of faces across a zoom.
const ACROSS: f64 = 7.0;
const HIGHEST: f64 = 400.0;

/// A field substituted into a scheme.
pub(in crate::report) struct Put<'a> {
    /// The name of its code.
    pub name: &'a str,
    pub problem: &'a Problem<'a>,
    pub u: &'a [f64],
    /// The backward error of each row.
    pub errors: Vec<f64>,
    pub findings: Option<&'a Findings>,
    pub(super) ramp: Ramp,
}

impl<'a> Put<'a> {
    pub fn new(
        name: &'a str,
        problem: &'a Problem<'a>,
        u: &'a [f64],
        findings: Option<&'a Findings>,
    ) -> Self {
        let rows = problem.rows(u);
        let errors: Vec<f64> = (0..u.len()).map(|row| rows.error(row)).collect();
        let limit = findings.map_or(crate::run::RESIDUAL_TOLERANCE, |found| found.limit);
        let ramp = Ramp::over(limit, errors.iter().copied());
        Put {
            name,
            problem,
            u,
            errors,
            findings,
            ramp,
        }
    }

    pub fn fails(&self, row: usize) -> bool {
        // NaN fails.
        !(self.errors[row] <= self.ramp.tolerance)
    }

    /// The row with the largest residual, or with NaN.
    pub fn worst(&self) -> Option<usize> {
        let key = |row: &usize| match self.errors[*row] {
            error if error.is_nan() => f64::INFINITY,
            error => error,
        };
        let rows = (0..self.errors.len()).filter(|row| self.fails(*row));
        rows.max_by(|a, b| key(a).total_cmp(&key(b)))
    }

    /// The faces whose datum is at fault.
    pub fn blamed(&self) -> &'a [Spot] {
        let culprit = self.findings.and_then(Findings::culprit);
        culprit.map_or(&[], |of: &Explanation| &of.at)
    }

    /// The colour of a row.
    pub fn colour(&self, row: usize) -> usize {
        self.ramp.step(self.errors[row])
    }

    /// A row from above.
    fn place(&self, row: usize) -> [f64; 2] {
        flat(self.problem.space.point(row))
    }
}

/// The residual as a whole, and around the worst row.
pub(in crate::report) fn cause(put: &Put, about: &str) -> Html {
    let held = "Residual of each row, over the sizes of its terms";
    let pictures = match put.problem.space.mesh.dim {
        3 => surface::cause(put, about),
        _ => {
            let [all, near] = [overview(put, about), zoom(put, about)];
            return html! { .two { (all) div { (near) (put.ramp.bar(held)) } } };
        }
    };
    html! { .two { (pictures) } (put.ramp.bar(held)) }
}

/// The shape of each row in 2D: the kite of a face between its ends and the centroids of its cells, and around a
/// vertex the nearest part. If rows belong to both, each edge is divided as 1 : 2 : 1.
pub(super) fn shapes(problem: &Problem) -> Vec<(usize, Vec<[f64; 2]>)> {
    let (space, mesh) = (&problem.space, problem.space.mesh);
    let on = space.element.on();
    let cut = match (on.vertices, on.edges || on.faces) {
        (true, true) => 0.25,
        (true, false) => 0.5,
        _ => 0.0,
    };
    let mut shapes = Vec::new();
    if on.edges || on.faces {
        let first = if on.vertices { mesh.points.len() } else { 0 };
        shapes.extend((0..mesh.face_count()).map(|face| (first + face, kite(mesh, face, cut))));
    }
    if on.vertices {
        for cell in 0..mesh.cell_count() {
            let vertices = mesh.cell(cell);
            for k in 0..3 {
                let [p, q, r] =
                    [k, (k + 1) % 3, (k + 2) % 3].map(|k| flat(mesh.points[vertices[k] as usize]));
                let corners = vec![
                    p,
                    towards(p, q, cut),
                    centroid(mesh, cell),
                    towards(p, r, cut),
                ];
                shapes.push((vertices[k] as usize, corners));
            }
        }
    }
    shapes
}

/// The region nearest to a face of a 2D mesh, without a part at both of its ends.
pub(super) fn kite(mesh: &Triangulation, face: usize, cut: f64) -> Vec<[f64; 2]> {
    let [a, b] = ends(mesh, face);
    let [one, other] = mesh.face_cells(face);
    let mut corners = vec![
        towards(a, b, cut),
        centroid(mesh, one as usize),
        towards(b, a, cut),
    ];
    if !mesh.is_boundary(face) {
        corners.push(centroid(mesh, other as usize));
    }
    corners
}

fn towards(p: [f64; 2], q: [f64; 2], share: f64) -> [f64; 2] {
    [0, 1].map(|k| p[k] + share * (q[k] - p[k]))
}

/// Vertices of a cell of a 2D mesh.
pub(super) fn centroid(mesh: &Triangulation, cell: usize) -> [f64; 2] {
    mean(&[0, 1, 2].map(|k| flat(mesh.points[mesh.cell(cell)[k] as usize])))
}

/// Ends of a face of a 2D mesh.
pub(super) fn ends(mesh: &Triangulation, face: usize) -> [[f64; 2]; 2] {
    let ends = mesh.face(face);
    [ends[0], ends[1]].map(|v| flat(mesh.points[v as usize]))
}

/// The rows in their colours, restricted to those selected by `shows`.
pub(super) fn rows(put: &Put, view: &View, most: usize, shows: impl Fn(usize) -> bool) -> String {
    let mut layers = Layers::new("k");
    let shown = (0..put.errors.len()).filter(|row| shows(*row));
    let points = shown.map(|row| (put.place(row), put.colour(row)));
    let has_room = put.errors.len() <= most;
    let shapes = if has_room {
        shapes(put.problem)
    } else {
        Vec::new()
    };
    let shapes = shapes.into_iter().filter(|(row, _)| shows(*row));
    let shapes = shapes.map(|(row, corners)| (corners, put.colour(row)));
    layers.fill(view, has_room, shapes, points);
    layers.svg(put.errors.len() > MOST / 4)
}

/// The boundary, with Γ_C as a thick line.
pub(super) fn outline(problem: &Problem, view: &View, thick: f64) -> String {
    let mesh = problem.space.mesh;
    let of = |is_contact: bool| {
        let faces = (0..mesh.face_count()).filter(|face| mesh.is_boundary(*face));
        let faces =
            faces.filter(|face| (problem.parts[*face] == Some(Part::Contact)) == is_contact);
        segments(view, faces.map(|face| ends(mesh, face)))
    };
    path("frame", of(false)) + &line("ink", thick, of(true))
}

fn overview(put: &Put, about: &str) -> Html {
    let problem = put.problem;
    let view = View::of_points(&problem.space.mesh.points, HIGHEST);
    let mut svg = rows(put, &view, MOST, |_| true) + &outline(problem, &view, 2.5);
    if let Some(window) = near(put, &view) {
        let [x, y] = view.pixel([window.low[0], window.high[1]]);
        let [r, b] = view.pixel([window.high[0], window.low[1]]);
        svg += &line(
            "ink",
            1.2,
            format_args!("M{x:.0} {y:.0}H{r:.0}V{b:.0}H{x:.0}z"),
        );
    }
    if let Some(row) = put.worst() {
        svg += &circle(view.pixel(put.place(row)), 9.0);
    }
    svg += &corners(&view);
    let caption = text!("**The cause.** Residual of {put.name}, row by row: {about}");
    let label = format!("residual of {}, {about}", put.name);
    map(caption, &label, view.height + 14.0, &svg)
}

/// The ends of the first axis, below a map.
pub(super) fn corners(view: &View) -> String {
    let y = view.height + 13.0;
    let [left, right] = [view.low, view.high].map(|p| view.pixel(p)[0]);
    let of = |x: f64| position(x, view.high[0] - view.low[0]);
    word("t", [left, y], of(view.low[0])) + &word("t e", [right, y], of(view.high[0]))
}

/// Some faces around the worst row; `None` if that is nearly the whole mesh.
fn near(put: &Put, all: &View) -> Option<View> {
    let (space, mesh) = (&put.problem.space, put.problem.space.mesh);
    let row = put.worst()?;
    let at = put.place(row);
    let carrier = space.carrier(row);
    let cell =
        (0..mesh.cell_count()).find(|cell| carrier.iter().all(|v| mesh.cell(*cell).contains(v)))?;
    let width = ACROSS * mesh.geometry(cell).diameter / std::f64::consts::SQRT_2;
    let extent = [0, 1].map(|k| all.high[k] - all.low[k]);
    if width > 0.75 * extent[0] {
        return None;
    }
    let sides = [width, (0.85 * width).min(extent[1])];
    let low = [0, 1].map(|k| {
        (at[k] - 0.5 * sides[k])
            .min(all.high[k] - sides[k])
            .max(all.low[k])
    });
    Some(View::new(low, [0, 1].map(|k| low[k] + sides[k]), HIGHEST))
}

fn zoom(put: &Put, about: &str) -> Html {
    let problem = put.problem;
    let (space, mesh) = (&problem.space, problem.space.mesh);
    let Some(view) = near(put, &View::of_points(&mesh.points, HIGHEST)) else {
        return Html::default();
    };
    let mut layers = Layers::new("k");
    for (row, corners) in shapes(problem).iter().filter(|(_, c)| view.meets(c)) {
        layers.add(put.colour(*row), &view, corners);
    }
    let inside = |face: &usize| view.meets(&ends(mesh, *face));
    let lines = |faces: &mut dyn Iterator<Item = usize>| {
        segments(&view, faces.filter(inside).map(|face| ends(mesh, face)))
    };
    let blamed = put.blamed().iter();
    let blamed = blamed.filter_map(|spot| mesh.find_face(&spot.vertices));
    let blamed: Vec<usize> = blamed.filter(inside).collect();
    let height = view.height;
    let mut svg = format!(
        "<clipPath id=\"z\"><path d=\"M0 -2h{WIDTH}v{h:.0}H0z\"/></clipPath><g clip-path=\"url(#z)\">{}{}{}{}</g>",
        layers.svg(false),
        path("net", lines(&mut (0..mesh.face_count()))),
        line(
            "ink",
            2.5,
            lines(&mut put.problem.contact.iter().map(|f| f.face))
        ),
        line("redl", 5.0, lines(&mut blamed.iter().copied())),
        h = height + 4.0,
    );
    svg += &path("frame", format_args!("M0 0h{WIDTH}v{height:.0}H0z"));
    // The two rows with the largest residuals, with a line to each.
    let mut failing: Vec<usize> = (0..put.errors.len())
        .filter(|row| put.fails(*row))
        .collect();
    failing.sort_by(|a, b| put.errors[*b].total_cmp(&put.errors[*a]));
    let count = failing.len();
    failing.retain(|row| view.meets(&[put.place(*row)]));
    failing.truncate(2);
    failing.sort_by(|a, b| space.point(*a)[0].total_cmp(&space.point(*b)[0]));
    let is_low = put
        .worst()
        .is_some_and(|row| view.pixel(put.place(row))[1] > 0.5 * height);
    for (k, row) in failing.iter().enumerate() {
        let [x, y] = view.pixel(put.place(*row));
        let is_left = k == 0 && (failing.len() > 1 || x > 0.5 * WIDTH);
        let [to, anchor] = match is_left {
            true => [x.min(WIDTH) - 46.0, 1.0],
            false => [x.max(0.0) + 46.0, 0.0],
        };
        let to = to.clamp(96.0 * anchor, WIDTH - 96.0 * (1.0 - anchor));
        let (up, text) = match is_low {
            true => (y - 56.0, y - 76.0),
            false => (y + 46.0, y + 62.0),
        };
        let class = if is_left { "s halo e" } else { "s halo" };
        svg += &line("ink", 0.9, format_args!("M{x:.0} {y:.0}L{to:.0} {up:.0}"));
        svg += &word(
            class,
            [to, text],
            format!("row of {:?}", space.carrier(*row)),
        );
        svg += &word(class, [to, text + 15.0], size(put.errors[*row]));
    }
    let mut below = 4.0;
    if let (Some(face), Some(factor)) = (
        blamed.first(),
        put.findings
            .and_then(Findings::culprit)
            .and_then(|c| c.factor),
    ) {
        let [x, y] = view.pixel(flat(mesh.face_midpoint(*face)));
        if y > height - 2.0 {
            let x = x.clamp(50.0, WIDTH - 50.0);
            svg += &word(
                "s red m",
                [x, height + 17.0],
                format!("γ × {}", number(factor, 5)),
            );
            svg += &word(
                "t m",
                [x, height + 31.0],
                format!("face {:?}", mesh.face(*face)),
            );
            below = 34.0;
        }
    }
    let shape = match (
        space.element.on().vertices,
        space.element.on().edges || space.element.on().faces,
    ) {
        (true, true) => "A kite is the row of an edge, a star that of a vertex",
        (true, false) => "Around each vertex, its row",
        _ => "Each kite is a face, with a row of its own",
    };
    let rest = (0..put.errors.len())
        .filter(|row| !put.fails(*row))
        .map(|row| put.errors[row]);
    let rest = rest.fold(0.0, f64::max);
    let caption = text!(
        "**Around the worst.** {shape}; {} rows fail, all others are at most {}",
        whole(count),
        at_most(rest, 2)
    );
    let label = format!("the worst row of {}, {about}", put.name);
    map(caption, &label, height + below, &svg)
}

/// A small map for each term: the rows that contain it.
pub(in crate::report) fn by_term(put: &Put, about: &str) -> Html {
    let (problem, Some(found)) = (put.problem, put.findings) else {
        return Html::default();
    };
    if problem.space.mesh.dim == 3 {
        return Html::default();
    }
    let mut at_contact = vec![false; put.errors.len()];
    let dofs = problem
        .conditions
        .iter()
        .flat_map(|condition| &condition.dofs);
    dofs.for_each(|dof| at_contact[*dof as usize] = true);
    let view = View::of_points(&problem.space.mesh.points, HIGHEST);
    let maps = found.terms.iter().map(|of| {
        let is_held = |row: usize| problem.dirichlet[row].is_some();
        let holds = |row: usize| match of.term {
            Term::Dirichlet => is_held(row),
            Term::Volume => !is_held(row),
            Term::Load => !is_held(row) && problem.load[row] != 0.0,
            Term::Consistency | Term::Contact => !is_held(row) && at_contact[row],
        };
        let svg = rows(put, &view, MOST_SMALL, holds) + &outline(problem, &view, 2.5);
        let name = why::name(of.term);
        let fail = match (of.failing, of.suspect) {
            (0, _) => "none fails".into(),
            (failing, true) => text!("**{} fail**: may be wrong", whole(failing)),
            (failing, _) => format!("{} fail", whole(failing)).into(),
        };
        let caption = text!("**{name}**: {} rows, {fail}", whole(of.rows));
        let label = format!("rows of {name}, {about}");
        map(caption, &label, view.height, &svg)
    });
    html! { .five { @for map in maps { (map) } } }
}
