//! The intersection of two simplices, as simplices: one is cut by the half-spaces of the other.
//!
//! No sign is decided exactly. A cut that rounding moves is moved for both of its sides, so that measures add up.

/// Three or four corners, counterclockwise in 2D and with positive determinant in 3D; in 2D the last is not used.
pub(crate) type Simplex = [[f64; 3]; 4];

/// More than a triangle cut by three lines has corners.
const CORNERS: usize = 9;

/// |κ| with the sign of its orientation: area in 2D, volume in 3D.
pub(crate) fn measure(dim: usize, s: &Simplex) -> f64 {
    let [a, b, c] = [1, 2, 3].map(|i| subtract(&s[i], &s[0]));
    match dim {
        2 => 0.5 * (a[0] * b[1] - a[1] * b[0]),
        _ => dot(&a, &cross(&b, &c)) / 6.0,
    }
}

/// Changes the order of two corners of a triangle that turns right, as the projection of one of another surface may.
pub(super) fn turn_left(dim: usize, s: &mut Simplex) {
    if dim == 2 && measure(dim, s) < 0.0 {
        s.swap(1, 2);
    }
}

/// Gradients of the barycentric coordinates of a simplex.
pub(super) fn barycentric(dim: usize, corners: &Simplex) -> [[f64; 3]; 4] {
    let edges = [1, 2, 3].map(|k| match k <= dim {
        true => subtract(&corners[k], &corners[0]),
        false => [0.0, 0.0, 1.0],
    });
    let rows = [
        cross(&edges[1], &edges[2]),
        cross(&edges[2], &edges[0]),
        cross(&edges[0], &edges[1]),
    ];
    let determinant = dot(&edges[0], &rows[0]);
    let mut all = [[0.0; 3]; 4];
    for k in 0..dim {
        all[k + 1] = rows[k].map(|x| x / determinant);
        (0..3).for_each(|c| all[0][c] -= all[k + 1][c]);
    }
    all
}

pub(crate) fn subtract(p: &[f64; 3], q: &[f64; 3]) -> [f64; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

pub(super) fn dot(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

pub(super) fn cross(p: &[f64; 3], q: &[f64; 3]) -> [f64; 3] {
    [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ]
}

/// A point on the face opposite corner i, and a vector that points from there to the inside.
fn face(dim: usize, s: &Simplex, i: usize) -> ([f64; 3], [f64; 3]) {
    if dim == 2 {
        let (p, q) = (s[(i + 1) % 3], s[(i + 2) % 3]);
        return (p, [p[1] - q[1], q[0] - p[0], 0.0]);
    }
    // Corners in the order in which they turn right about the inside.
    let [p, q, r] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]][i].map(|k| s[k]);
    let normal = cross(&subtract(&q, &p), &subtract(&r, &p));
    (p, normal.map(|n| -n))
}

/// Appends a ∩ b to `pieces`; `scratch` is memory that is used again. Returns its measure.
pub(super) fn clip(
    dim: usize,
    a: &Simplex,
    b: &Simplex,
    pieces: &mut Vec<Simplex>,
    scratch: &mut Vec<Simplex>,
) -> f64 {
    pieces.clear();
    match dim {
        2 => triangles(a, b, pieces),
        _ => tetrahedra(a, b, pieces, scratch),
    }
    let mut sum = 0.0;
    pieces.retain(|piece| {
        let measure = measure(dim, piece);
        let keep = measure > 0.0;
        sum += if keep { measure } else { 0.0 };
        keep
    });
    sum
}

/// Where the line from p to q, at distances of different sign, meets the plane.
fn between(p: &[f64; 3], q: &[f64; 3], at_p: f64, at_q: f64) -> [f64; 3] {
    // From the nearer end, where the step is smaller than its rounding.
    let (p, q, at_p, at_q) = match at_p.abs() <= at_q.abs() {
        true => (p, q, at_p, at_q),
        false => (q, p, at_q, at_p),
    };
    let t = at_p / (at_p - at_q);
    [0, 1, 2].map(|k| p[k] + t * (q[k] - p[k]))
}

/// Sutherland and Hodgman's algorithm, and the polygon as a fan.
fn triangles(a: &Simplex, b: &Simplex, pieces: &mut Vec<Simplex>) {
    let mut polygon = [[0.0; 3]; CORNERS];
    polygon[..3].copy_from_slice(&a[..3]);
    let mut count = 3;
    for i in 0..3 {
        let (on, inside) = face(2, b, i);
        let distance = |p: &[f64; 3]| dot(&inside, &subtract(p, &on));
        let before = polygon;
        let corners = count;
        count = 0;
        let mut previous = (before[corners - 1], distance(&before[corners - 1]));
        for corner in &before[..corners] {
            let here = (*corner, distance(corner));
            if (previous.1 < 0.0) != (here.1 < 0.0) && previous.1 != 0.0 && here.1 != 0.0 {
                polygon[count] = between(&previous.0, &here.0, previous.1, here.1);
                count += 1;
            }
            // Rounding may leave a polygon that is not convex, which is cut more often.
            if here.1 >= 0.0 && count < CORNERS {
                polygon[count] = here.0;
                count += 1;
            }
            if count >= CORNERS - 1 {
                break;
            }
            previous = here;
        }
        if count < 3 {
            return;
        }
    }
    for k in 1..count - 1 {
        pieces.push([polygon[0], polygon[k], polygon[k + 1], [0.0; 3]]);
    }
}

/// Cut by one plane after another, each tetrahedron into at most three.
fn tetrahedra(a: &Simplex, b: &Simplex, pieces: &mut Vec<Simplex>, scratch: &mut Vec<Simplex>) {
    let planes = [0, 1, 2, 3].map(|i| face(3, b, i));
    let distance =
        |(on, inside): &([f64; 3], [f64; 3]), p: &[f64; 3]| dot(inside, &subtract(p, on));
    // Most of those whose boxes meet are on one side of a face.
    if planes
        .iter()
        .any(|plane| a.iter().all(|p| distance(plane, p) <= 0.0))
    {
        return;
    }
    for i in 0..4 {
        let plane = face(3, a, i);
        if b.iter().all(|p| distance(&plane, p) <= 0.0) {
            return;
        }
    }
    pieces.push(*a);
    for plane in &planes {
        scratch.clear();
        for piece in pieces.iter() {
            cut(piece, &piece.map(|p| distance(plane, &p)), scratch);
        }
        std::mem::swap(pieces, scratch);
        if pieces.is_empty() {
            return;
        }
    }
}

/// Appends the part of a tetrahedron where the distance is positive.
fn cut(piece: &Simplex, at: &[f64; 4], out: &mut Vec<Simplex>) {
    let is_inside = at.map(|d| d > 0.0);
    // An even permutation of the corners, so that the orientation stays: the odd one out first, or the two inside.
    let inside = is_inside.iter().filter(|inside| **inside).count();
    if inside == 0 {
        return;
    }
    if inside == 4 {
        out.push(*piece);
        return;
    }
    const FIRST: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
    const PAIRS: [[usize; 4]; 6] = [
        [0, 1, 2, 3],
        [0, 2, 3, 1],
        [0, 3, 1, 2],
        [1, 2, 0, 3],
        [1, 3, 2, 0],
        [2, 3, 0, 1],
    ];
    let odd = |inside: bool| is_inside.iter().position(|of| *of == inside).unwrap_or(0);
    let [i, j, k, l] = match inside {
        1 => FIRST[odd(true)],
        3 => FIRST[odd(false)],
        _ => PAIRS
            .into_iter()
            .find(|pair| is_inside[pair[0]] && is_inside[pair[1]])
            .unwrap_or(PAIRS[0]),
    };
    let on = |p: usize, q: usize| match at[q] == 0.0 {
        true => piece[q],
        false => between(&piece[p], &piece[q], at[p], at[q]),
    };
    // A prism with the triangles (p0, p1, p2) and (q0, q1, q2), of which p_i is joined to q_i.
    let mut prism = |p: [[f64; 3]; 3], q: [[f64; 3]; 3]| {
        out.push([p[0], p[1], p[2], q[2]]);
        out.push([p[0], p[1], q[2], q[1]]);
        out.push([p[0], q[1], q[2], q[0]]);
    };
    match inside {
        1 => out.push([piece[i], on(i, j), on(i, k), on(i, l)]),
        2 => prism(
            [piece[i], on(i, k), on(i, l)],
            [piece[j], on(j, k), on(j, l)],
        ),
        _ => prism(
            [on(j, i), on(k, i), on(l, i)],
            [piece[j], piece[k], piece[l]],
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::{RngSeed, TestRunner};

    fn config(cases: u32) -> ProptestConfig {
        ProptestConfig {
            cases,
            failure_persistence: None,
            rng_seed: RngSeed::Fixed(2017),
            ..ProptestConfig::default()
        }
    }

    fn oriented(dim: usize, mut s: Simplex) -> Simplex {
        if measure(dim, &s) < 0.0 {
            s.swap(1, 2);
        }
        s
    }

    fn intersection(dim: usize, a: &Simplex, b: &Simplex) -> f64 {
        clip(dim, a, b, &mut Vec::new(), &mut Vec::new())
    }

    fn corner(dim: usize) -> impl Strategy<Value = [f64; 3]> {
        // Few distinct places, so that corners, edges and planes are shared.
        let at = prop_oneof![(0..4i32).prop_map(f64::from), 0.0..3.0];
        [at.clone(), at.clone(), at].prop_map(move |mut x| {
            x[dim..].fill(0.0);
            x
        })
    }

    fn simplex(dim: usize) -> impl Strategy<Value = Simplex> {
        proptest::array::uniform4(corner(dim))
            .prop_map(move |s| oriented(dim, s))
            .prop_filter("it has a measure", move |s| measure(dim, s) > 1e-9)
    }

    /// Both orders give the same measure, a simplex and itself its own, and the parts on both sides of each plane the whole.
    #[test]
    fn what_is_cut_adds_up() {
        for dim in [2, 3] {
            let mut runner = TestRunner::new(config(4000));
            let pairs = (simplex(dim), simplex(dim), 0..4usize, corner(dim));
            let ran = runner.run(&pairs, |(a, b, i, p)| {
                let [of_a, of_b] = [&a, &b].map(|s| measure(dim, s));
                let [ab, ba] = [intersection(dim, &a, &b), intersection(dim, &b, &a)];
                prop_assert!((ab - ba).abs() < 1e-13, "{ab} {ba}");
                prop_assert!(ab <= of_a.min(of_b) + 1e-13);
                prop_assert!((intersection(dim, &a, &a) - of_a).abs() < 1e-13);
                // b is a corner replaced by p: if p is on the inside of all faces that meet there, a holds b; and a and the
                // others, with p instead of each corner, add up to a where p is inside.
                let mut sum = 0.0;
                for k in 0..=dim {
                    let mut part = b;
                    part[k] = p;
                    let sign = measure(dim, &part).signum();
                    sum += sign * intersection(dim, &a, &oriented(dim, part));
                }
                prop_assert!((sum - ab).abs() < 1e-12, "{sum} {ab}");
                // Away from its own face there is nothing.
                let (on, inside) = face(dim, &a, i % (dim + 1));
                let mut mirrored = a;
                let norm = dot(&inside, &inside);
                for x in &mut mirrored {
                    let d = 2.0 * dot(&inside, &subtract(x, &on)) / norm;
                    x.iter_mut().zip(inside).for_each(|(x, n)| *x -= d * n);
                }
                let nothing = intersection(dim, &a, &oriented(dim, mirrored));
                prop_assert!(nothing < 1e-13, "{nothing}");
                Ok(())
            });
            ran.unwrap();
        }
    }

    /// Two triangles that make a star of six corners, and a tetrahedron with its mirror image about its centre.
    #[test]
    fn measures_known_in_closed_form() {
        let height = 3.0_f64.sqrt();
        let up = [
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [1.0, height, 0.0],
            [0.0; 3],
        ];
        let down = up.map(|x| [2.0 - x[0], 2.0 / 3.0 * height - x[1], 0.0]);
        // The hexagon is six of nine equal triangles.
        let hexagon = 6.0 / 9.0 * measure(2, &up);
        assert!((intersection(2, &up, &down) - hexagon).abs() < 1e-15);
        let corners = [
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
        ];
        let (a, b) = (
            oriented(3, corners),
            oriented(3, corners.map(|x| x.map(|x| -x))),
        );
        // The stella octangula: what both have is an octahedron of half the volume, 4/3.
        assert!((intersection(3, &a, &b) - 4.0 / 3.0).abs() < 1e-14);
    }
}
