//! A function on the unit square as a surface, seen from the front and from above.

use super::plane::{Picture, Shades, path, word};
use crate::text::number::{number, trimmed};

/// The rotation of the square, and the elevation of the viewer.
const TURN: f64 = 0.62;
const TILT: f64 = 0.42;
/// The height of the surface relative to the side of the square.
const HIGH: f64 = 0.62;
const WIDEST: f64 = 535.0;

/// The map from space to the picture.
struct View {
    low: f64,
    high: f64,
    scale: f64,
    corner: [f64; 2],
}

impl View {
    /// To the right, and from the front to the back.
    fn turned([x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = TURN.sin_cos();
        [x * cos + y * sin, y * cos - x * sin]
    }

    fn at(&self, p: [f64; 2], u: f64) -> [f64; 2] {
        let [right, back] = Self::turned(p);
        let up = HIGH * (u - self.low) / (self.high - self.low).max(f64::MIN_POSITIVE);
        let up = up * TILT.cos() + back * TILT.sin();
        [
            self.corner[0] + self.scale * right,
            self.corner[1] - self.scale * up,
        ]
    }

    fn line(&self, class: &str, ends: [([f64; 2], f64); 2]) -> String {
        let [[a, b], [c, d]] = ends.map(|(p, u)| self.at(p, u));
        path(class, format_args!("M{a:.1} {b:.1}L{c:.1} {d:.1}"))
    }
}

/// Values on a lattice of the unit square, row by row from y = 0, which is in front; `marked` are intervals of x there, drawn at u = 0.
pub(in crate::report) fn elevation(
    heights: &[Vec<f64>],
    marked: &[[f64; 2]],
    label: &str,
    width: f64,
) -> Picture {
    let width = width.min(WIDEST);
    let all = || heights.iter().flatten().copied().filter(|u| u.is_finite());
    let (low, high) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
    let [margin, foot] = [54.0, 34.0];
    let (sin, cos) = TURN.sin_cos();
    let scale = (width - 2.0 * margin) / (sin + cos);
    let mut view = View {
        low,
        high,
        scale,
        corner: [margin, 0.0],
    };
    let [rows, columns] =
        [heights.len(), heights.first().map_or(0, Vec::len)].map(|n| n.max(2) - 1);
    let place = |i: usize, j: usize| [i as f64 / columns as f64, j as f64 / rows as f64];
    let points = heights.iter().enumerate().flat_map(|(j, row)| {
        let of = move |(i, u): (usize, &f64)| (place(i, j), *u);
        row.iter().enumerate().map(of)
    });
    let tops = points
        .chain([([0.0; 2], high)])
        .map(|(p, u)| view.at(p, u)[1]);
    view.corner[1] = 12.0 - tops.fold(f64::INFINITY, f64::min);
    let height = view.corner[1] + scale * sin * TILT.sin() + foot;
    let mut svg = String::new();
    for k in 0..=4 {
        let t = f64::from(k) / 4.0;
        svg += &view.line("hair", [([t, 0.0], low), ([t, 1.0], low)]);
        svg += &view.line("hair", [([0.0, t], low), ([1.0, t], low)]);
        let name = trimmed(&number(t, 2));
        let named = |axis: &str| match k {
            2 => format!("{axis} = {name}"),
            _ => name.clone(),
        };
        let [right, back] = [view.at([t, 0.0], low), view.at([1.0, t], low)];
        // The corners belong to both axes.
        if k > 0 {
            svg += &word("t e", [right[0] - 4.0, right[1] + 14.0], named("x"));
            svg += &word("t", [back[0] + 6.0, back[1] + 12.0], named("y"));
        }
    }
    let mut heights_told = vec![(low, ""), (high, "u = ")];
    let is_far = |end: &f64| end.abs() > 0.06 * (high - low);
    heights_told.extend([low, high].iter().all(is_far).then_some((0.0, "")));
    for (u, name) in heights_told {
        let [x, y] = view.at([0.0; 2], u);
        let told = format!("{name}{}", trimmed(&number(u, 2)));
        svg += &word("t e", [x - 6.0, y + 3.5], &told);
    }
    svg += &view.line("frame", [([0.0; 2], low), ([0.0; 2], high)]);
    let mut tiles = Vec::with_capacity(rows * columns);
    for (j, pair) in heights.windows(2).enumerate() {
        for i in 0..columns.min(pair[0].len().min(pair[1].len()).saturating_sub(1)) {
            let corners = [(i, 0), (i + 1, 0), (i + 1, 1), (i, 1)];
            let at = |(i, k): (usize, usize)| (place(i, j + k), pair[k][i]);
            let mean = corners.iter().map(|c| at(*c).1).sum::<f64>() / 4.0;
            let [_, back] = View::turned(place(i, j));
            tiles.push((back, mean, corners.map(at)));
        }
    }
    // From back to front, so that nearer tiles cover others.
    tiles.sort_by(|a, b| b.0.total_cmp(&a.0));
    let shades = Shades { low, high };
    for (_, mean, corners) in tiles.iter().filter(|tile| tile.1.is_finite()) {
        let [a, b, c, d] = corners.map(|(p, u)| view.at(p, u));
        let d = format_args!(
            "M{:.1} {:.1}L{:.1} {:.1} {:.1} {:.1} {:.1} {:.1}z",
            a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]
        );
        svg += &path(&format!("f tile g{}", shades.step(*mean)), d);
    }
    for [a, b] in marked {
        let ends = [([*a, 0.0], 0.0), ([*b, 0.0], 0.0)];
        svg += &view.line("redl marked", ends);
    }
    Picture::new(label, [width, height], svg)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_is_drawn_and_the_near_ones_last() {
        let heights: Vec<Vec<f64>> = (0..5)
            .map(|j| (0..5).map(|i| f64::from(i * j)).collect())
            .collect();
        let file = elevation(&heights, &[[0.25, 0.75]], "u & v", 1090.0).file();
        assert_eq!(file.matches("class=\"f tile").count(), 16);
        assert_eq!(file.matches("class=\"redl").count(), 1);
        assert!(
            file.contains("u &amp; v") && !file.contains("var("),
            "{file}"
        );
        // The last tile is that at x = 1, y = 0, where u is small; u is largest at the back.
        let last = file.rfind("class=\"f tile").unwrap();
        assert!(
            file[last..].starts_with("class=\"f tile g1\""),
            "{}",
            &file[last..]
        );
        assert!(file.find("tile g12").unwrap() < last);
    }
}
