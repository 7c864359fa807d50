//! Maps of faces by how much they differ: all of the mesh, and what is around the worst face. In space, Γ_C.

use std::fmt::Write as _;

use super::markup::{Html, escape, raw};
use faceoff_mesh::mesh::Triangulation;

/// Up to so many faces each is drawn; of more, the largest difference in each square.
const MOST: usize = 5000;
/// Squares across, of a map that shows a disagreement and of one that does not.
const ACROSS: [f64; 2] = [80.0, 48.0];
/// Size in pixels of the longer side.
const SIZE: f64 = 440.0;
const MARGIN: f64 = 30.0;

/// The classes of differences, in words.
pub(super) const CLASSES: [&str; 7] = [
    "at most 1/100 of the tolerance",
    "within the tolerance",
    "up to 10² times the tolerance",
    "up to 10⁴ times",
    "up to 10⁶ times",
    "more",
    "not a finite number",
];

/// What a map shows.
pub(super) struct Shown<'a> {
    pub mesh: &'a Triangulation,
    /// Faces that carry the field, and |a-b| relative to its unit.
    pub differences: Vec<(u32, f64)>,
    pub tolerance: f64,
    pub disagrees: bool,
    /// The face with the largest difference, where it lies on what is shown.
    pub worst: Option<u32>,
}

fn class(difference: f64, tolerance: f64) -> usize {
    let limits = [1e-2, 1.0, 1e2, 1e4, 1e6];
    if !difference.is_finite() {
        return 6;
    }
    let within = limits
        .iter()
        .position(|limit| difference <= limit * tolerance);
    within.unwrap_or(5)
}

/// From the plane of the picture to pixels; y points up.
struct View {
    low: [f64; 2],
    high: [f64; 2],
    scale: f64,
}

impl View {
    fn new(low: [f64; 2], high: [f64; 2]) -> Self {
        let longer = (high[0] - low[0]).max(high[1] - low[1]);
        View {
            low,
            high,
            scale: (SIZE - 2.0 * MARGIN) / longer.max(f64::MIN_POSITIVE),
        }
    }

    fn of(points: impl Iterator<Item = [f64; 2]>) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for p in points {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        if low[0] <= high[0] {
            View::new(low, high)
        } else {
            View::new([0.0; 2], [1.0; 2])
        }
    }

    fn pixel(&self, p: [f64; 2]) -> [f64; 2] {
        [
            MARGIN + (p[0] - self.low[0]) * self.scale,
            MARGIN + (self.high[1] - p[1]) * self.scale,
        ]
    }

    fn size(&self) -> [f64; 2] {
        [0, 1].map(|k| 2.0 * MARGIN + (self.high[k] - self.low[k]) * self.scale)
    }

    fn holds(&self, p: [f64; 2]) -> bool {
        (0..2).all(|k| self.low[k] <= p[k] && p[k] <= self.high[k])
    }
}

/// The faces of a mesh as they are shown: by x and y in the plane; a surface by the coordinates in which it extends most.
struct Flat<'a> {
    mesh: &'a Triangulation,
    axes: [usize; 2],
}

impl<'a> Flat<'a> {
    fn new(mesh: &'a Triangulation, faces: impl Iterator<Item = u32> + Clone) -> Self {
        let extent = |axis: usize| {
            let of = faces.clone().map(|f| mesh.face_midpoint(f as usize)[axis]);
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            let (low, high) = of.fold(ends, |e, x| (e.0.min(x), e.1.max(x)));
            high - low
        };
        let mut axes = [0, 1, 2];
        if mesh.dim == 3 {
            axes.sort_by(|&i, &j| extent(j).total_cmp(&extent(i)));
        }
        let mut axes = [axes[0], axes[1]];
        axes.sort_unstable();
        Flat { mesh, axes }
    }

    fn of(shown: &Shown<'a>) -> Self {
        Flat::new(shown.mesh, shown.differences.iter().map(|(face, _)| *face))
    }

    fn at(&self, p: [f64; 3]) -> [f64; 2] {
        self.axes.map(|axis| p[axis])
    }

    fn midpoint(&self, face: u32) -> [f64; 2] {
        self.at(self.mesh.face_midpoint(face as usize))
    }

    fn corners(&self, face: u32) -> impl Iterator<Item = [f64; 2]> {
        let vertices = self.mesh.face(face as usize).iter();
        vertices.map(|v| self.at(self.mesh.points[*v as usize]))
    }

    fn view(&self, faces: impl Iterator<Item = u32>) -> View {
        View::of(faces.flat_map(|face| self.corners(face)))
    }

    /// Is a face an area, and no line?
    fn is_filled(&self) -> bool {
        self.mesh.dim == 3
    }

    fn add_shape(&self, path: &mut String, view: &View, face: u32) {
        for (k, corner) in self.corners(face).enumerate() {
            let [x, y] = view.pixel(corner);
            let _ = write!(path, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
        }
        if self.is_filled() {
            path.push('Z');
        }
    }
}

/// The names of the axes of the map: `x to the right, y upwards`.
pub(super) fn orientation(shown: &Shown) -> String {
    let [i, j] = Flat::of(shown).axes.map(|axis| ["x", "y", "z"][axis]);
    format!("{i} to the right, {j} upwards")
}

/// All faces that carry the field, the worst marked.
pub(super) fn overview(label: &str, shown: &Shown) -> Html {
    let flat = Flat::of(shown);
    let view = flat.view(shown.differences.iter().map(|(face, _)| *face));
    let mut paths: [String; 7] = Default::default();
    let coarse = shown.mesh.dim == 2 && shown.differences.len() > MOST;
    if coarse {
        for (square, class) in squares(shown, &view, &flat) {
            paths[class].push_str(&square);
        }
    } else {
        for &(face, difference) in &shown.differences {
            flat.add_shape(&mut paths[class(difference, shown.tolerance)], &view, face);
        }
    }
    let mark = shown.worst.map(|face| Mark {
        at: view.pixel(flat.midpoint(face)),
        radius: 9.0,
        face: String::new(),
    });
    let filled = coarse || flat.is_filled();
    svg(label, &view, &paths, &CLASSES, filled, mark)
}

/// The worst face and some faces around it.
pub(super) fn zoom(label: &str, shown: &Shown) -> Option<Html> {
    let worst = shown.worst?;
    let flat = Flat::of(shown);
    let at = flat.midpoint(worst);
    let reach = flat
        .corners(worst)
        .map(|p| (p[0] - at[0]).abs().max((p[1] - at[1]).abs()))
        .fold(0.0, f64::max);
    let half = 7.0 * reach;
    // Not beyond the mesh, where there is nothing to see.
    let all = flat.view(shown.differences.iter().map(|(face, _)| *face));
    let low = [0, 1].map(|k| (at[k] - half).min(all.high[k] - 2.0 * half).max(all.low[k]));
    let high = [0, 1].map(|k| (low[k] + 2.0 * half).min(all.high[k]));
    let view = View::new(low, high);
    let mut paths: [String; 7] = Default::default();
    for &(face, difference) in &shown.differences {
        if flat.corners(face).any(|p| view.holds(p)) {
            flat.add_shape(&mut paths[class(difference, shown.tolerance)], &view, face);
        }
    }
    let mut face = String::new();
    flat.add_shape(&mut face, &view, worst);
    let mark = Some(Mark {
        at: view.pixel(at),
        radius: 16.0,
        face,
    });
    Some(svg(label, &view, &paths, &CLASSES, flat.is_filled(), mark))
}

/// Squares with a face in them, each in the class of its largest difference.
fn squares(shown: &Shown, view: &View, flat: &Flat) -> Vec<(String, usize)> {
    let across = ACROSS[usize::from(!shown.disagrees)];
    let side = (SIZE - 2.0 * MARGIN) / across;
    let columns = across as usize + 1;
    let mut worst: Vec<Option<usize>> = vec![None; columns * columns];
    for &(face, difference) in &shown.differences {
        let [x, y] = view.pixel(flat.midpoint(face));
        let place = |x: f64| (((x - MARGIN) / side).max(0.0) as usize).min(columns - 1);
        let square = &mut worst[place(y) * columns + place(x)];
        *square = (*square).max(Some(class(difference, shown.tolerance)));
    }
    let drawn = worst.into_iter().enumerate().filter_map(|(k, class)| {
        let at = |k: usize| MARGIN + k as f64 * side;
        let (x, y) = (at(k % columns), at(k / columns));
        let square = format!("M{x:.1} {y:.1}h{side:.1}v{side:.1}h-{side:.1}z");
        Some((square, class?))
    });
    drawn.collect()
}

/// A circle with a cross around it, and the outline of what it is about.
struct Mark {
    at: [f64; 2],
    radius: f64,
    face: String,
}

/// The kinds of faces that [`status`] shows.
pub(super) const STATUS: [&str; 4] = [
    "separated",
    "in contact",
    "in contact at some quadrature points",
    "codes differ",
];

/// A surface by the contact status of its faces, each an index into [`STATUS`].
pub(super) fn status(label: &str, mesh: &Triangulation, faces: &[(u32, usize)]) -> Html {
    let all = faces.iter().map(|(face, _)| *face);
    let flat = Flat::new(mesh, all.clone());
    let view = flat.view(all);
    let mut paths: [String; 7] = Default::default();
    for &(face, status) in faces {
        flat.add_shape(&mut paths[status], &view, face);
    }
    svg(label, &view, &paths, &STATUS, true, None)
}

fn svg(
    label: &str,
    view: &View,
    paths: &[String; 7],
    names: &[&str],
    filled: bool,
    mark: Option<Mark>,
) -> Html {
    let [width, height] = view.size();
    let label = escape(label);
    let mut svg = format!(
        "<svg role=\"img\" aria-label=\"{label}\" class=\"map{}\" viewBox=\"0 0 {width:.0} {height:.0}\" \
         width=\"{width:.0}\" height=\"{height:.0}\">",
        if filled { " filled" } else { "" },
    );
    for (k, (path, name)) in paths.iter().zip(names).enumerate() {
        if !path.is_empty() {
            let title = format!("<title>{name}</title>");
            let _ = write!(svg, "<path class=\"d{k}\" d=\"{path}\">{title}</path>");
        }
    }
    if let Some(mark) = mark {
        let ([x, y], radius, face) = (mark.at, mark.radius, mark.face);
        let (inner, outer) = (radius + 2.0, radius + 12.0);
        let _ = write!(
            svg,
            "<g class=\"mark\"><path class=\"face\" d=\"{face}\"/><circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>\
             <path d=\"M{x:.1} {y:.1}m{inner} 0h10m-{outer} {inner}v10m-{inner} -{outer}h-10m{outer} -{inner}v-10\"/>\
             <title>the worst face</title></g>"
        );
    }
    svg.push_str("</svg>");
    raw(svg)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_rise_with_the_difference() {
        let of = |d: f64| class(d, 1e-12);
        assert_eq!(
            [0.0, 1e-15, 1e-13, 5e-11, 5e-9, 5e-7, 1.0].map(of),
            [0, 0, 1, 2, 3, 4, 5]
        );
        assert_eq!(of(f64::NAN), 6);
        assert_eq!(of(f64::INFINITY), 6);
    }
}
