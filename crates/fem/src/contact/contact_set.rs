//! The contact set of a discrete solution: where P(u_h) ≤ 0 on Γ_C.

use std::collections::BTreeMap;

use serde::Serialize;

use super::face::ContactFace;
use super::form::Problem;

/// Along a curve the contact set is given by its ends, on a surface by its extent.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ContactSet {
    /// In 2D: maximal runs of contact along Γ_C.
    Runs(Vec<[f64; 2]>),
    /// In 3D.
    Zones(Zones),
}

/// Zones of contact on a surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Zones {
    /// The area of all.
    pub area: f64,
    /// Connected zones.
    pub zones: usize,
    /// The contact faces that are at least partly in contact, ascending.
    pub faces: Vec<ZoneFace>,
}

/// A face of Γ_C, and how much of it is in contact.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ZoneFace {
    /// Its number in the mesh.
    #[serde(skip)]
    pub face: usize,
    /// Its vertices, ascending.
    pub vertices: Vec<u32>,
    /// The part of it that is in contact.
    pub share: f64,
    /// The zone it belongs to, from 0.
    pub zone: usize,
}

impl ContactSet {
    /// The contact set of u (values at all dofs).
    pub fn new(problem: &Problem, u: &[f64]) -> Self {
        match problem.space.mesh.dim {
            2 => ContactSet::Runs(runs(problem, u)),
            _ => ContactSet::Zones(zones(problem, u)),
        }
    }

    /// The runs; none in 3D.
    pub fn runs(&self) -> &[[f64; 2]] {
        match self {
            ContactSet::Runs(runs) => runs,
            ContactSet::Zones(_) => &[],
        }
    }
}

/// Zones of contact. On each face P is taken as affine, by least squares from the quadrature points;
/// two faces are connected if they share a vertex at which both are in contact.
fn zones(problem: &Problem, u: &[f64]) -> Zones {
    let mesh = problem.space.mesh;
    let mut faces = Vec::new();
    let mut area = 0.0;
    // Vertices in contact, and the first place in `faces` where each is.
    let mut reached: BTreeMap<u32, usize> = BTreeMap::new();
    let mut joined: Vec<usize> = Vec::new();
    for face in &problem.contact {
        let corners = corner_values(problem, face, u);
        let share = share_below_zero(&corners);
        if share == 0.0 {
            continue;
        }
        area += share * face.measure;
        let place = faces.len();
        joined.push(place);
        let vertices = mesh.face(face.face).to_vec();
        for (&vertex, _) in vertices.iter().zip(corners).filter(|(_, p)| *p <= 0.0) {
            let first = *reached.entry(vertex).or_insert(place);
            let (a, b) = (root(&joined, first), root(&joined, place));
            joined[a.max(b)] = a.min(b);
        }
        faces.push(ZoneFace {
            face: face.face,
            vertices,
            share,
            zone: 0,
        });
    }
    let mut zones = 0;
    for place in 0..faces.len() {
        // The root of a zone is its first face.
        let root = root(&joined, place);
        faces[place].zone = if root == place {
            zones += 1;
            zones - 1
        } else {
            faces[root].zone
        };
    }
    Zones { area, zones, faces }
}

fn root(joined: &[usize], mut place: usize) -> usize {
    while joined[place] != place {
        place = joined[place];
    }
    place
}

/// P at the vertices of a triangle, ascending: with b_i = ∫ P λ_i / |F| and the mean P̄ the affine
/// function nearest to P has the values 12 b_i - 3 P̄.
fn corner_values(problem: &Problem, face: &ContactFace, u: &[f64]) -> [f64; 3] {
    let local = problem.space.local(face.cell, u);
    let mut moments = [0.0; 3];
    for (q, point) in face.points.iter().enumerate() {
        let weighted = point.weight / face.measure * point.trace(face.gamma, &local).p;
        let lambda = problem.face_rule.barycentric(q);
        for (moment, l) in moments.iter_mut().zip(lambda) {
            *moment += weighted * l;
        }
    }
    let mean: f64 = moments.iter().sum();
    moments.map(|moment| 12.0 * moment - 3.0 * mean)
}

/// The part of a triangle where the affine function with these values at the corners is ≤ 0.
fn share_below_zero(corners: &[f64; 3]) -> f64 {
    let cut_off = |i: usize| -> f64 {
        let others = (0..3).filter(|j| *j != i);
        others
            .map(|j| corners[i] / (corners[i] - corners[j]))
            .product()
    };
    let below: Vec<usize> = (0..3).filter(|&i| corners[i] <= 0.0).collect();
    match *below {
        [] => 0.0,
        [i] => cut_off(i),
        [_, _] => (0..3)
            .find(|i| !below.contains(i))
            .map_or(1.0, |above| 1.0 - cut_off(above)),
        _ => 1.0,
    }
}

/// Maximal runs of contact along Γ_C. Positions are coordinates where Γ_C lies on
/// one line parallel to an axis; else arc length, connected pieces one after the other. Inside a
/// face the end of a run is where P, linear between quadrature points, vanishes.
fn runs(problem: &Problem, u: &[f64]) -> Vec<[f64; 2]> {
    let mut runs: Vec<[f64; 2]> = Vec::new();
    let mut offset = 0.0;
    for chain in chains(problem) {
        let straight = chain.axis;
        let mut from = straight.map_or(offset, |_| chain.start);
        for &(index, reversed) in &chain.faces {
            let face = &problem.contact[index];
            let to = from + face.measure;
            let local = problem.space.local(face.cell, u);
            let mut samples: Vec<(f64, f64)> = face
                .points
                .iter()
                .enumerate()
                .map(|(q, point)| {
                    let s = problem.face_rule.barycentric(q)[1];
                    let s = if reversed { 1.0 - s } else { s };
                    (from + s * face.measure, point.trace(face.gamma, &local).p)
                })
                .collect();
            samples.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (k, &(s, p)) in samples.iter().enumerate() {
                if p > 0.0 {
                    continue;
                }
                let meet = |other: Option<&(f64, f64)>, end: f64| match other {
                    None => end,
                    Some(&(_, q)) if q <= 0.0 => end,
                    Some(&(t, q)) => s + (t - s) * p / (p - q),
                };
                let before = if k > 0 { samples.get(k - 1) } else { None };
                let after = samples.get(k + 1);
                let low = meet(before, before.map_or(from, |b| b.0));
                let high = meet(after, after.map_or(to, |a| a.0));
                let joins = 1e-9 * face.measure;
                match runs.last_mut() {
                    Some(run) if low <= run[1] + joins && low >= run[0] => {
                        run[1] = run[1].max(high);
                    }
                    _ => runs.push([low, high]),
                }
            }
            from = to;
        }
        offset = from;
    }
    runs
}

/// Contact faces one after the other.
struct Chain {
    /// Indices into the contact faces, and whether the face is passed against its vertices' order.
    faces: Vec<(usize, bool)>,
    /// The axis that all of Γ_C is parallel to.
    axis: Option<usize>,
    /// The coordinate along that axis where the chain starts.
    start: f64,
}

fn chains(problem: &Problem) -> Vec<Chain> {
    let mesh = problem.space.mesh;
    let vertices = |k: usize| {
        let face = mesh.face(problem.contact[k].face);
        [face[0], face[1]]
    };
    let at = |vertex: u32| mesh.points[vertex as usize];
    let count = problem.contact.len();
    let mut touching: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for k in 0..count {
        for vertex in vertices(k) {
            touching.entry(vertex).or_default().push(k);
        }
    }
    let axis = (0..2).find(|&axis| {
        let level = |v: u32| at(v)[1 - axis];
        count > 0 && touching.keys().all(|&v| level(v) == level(vertices(0)[0]))
    });
    let key = |vertex: u32| {
        let p = at(vertex);
        (p[0], p[1], vertex)
    };
    let order = |a: &u32, b: &u32| {
        let (a, b) = (key(*a), key(*b));
        a.0.total_cmp(&b.0)
            .then(a.1.total_cmp(&b.1))
            .then(a.2.cmp(&b.2))
    };
    // Chains start at loose ends; what is left over is closed and starts anywhere.
    let mut starts: Vec<u32> = touching.keys().copied().collect();
    starts.sort_by(|a, b| {
        let loose = |v: &u32| touching[v].len() != 1;
        loose(a).cmp(&loose(b)).then(order(a, b))
    });
    let mut used = vec![false; count];
    let mut chains = Vec::new();
    for start in starts {
        let mut vertex = start;
        let mut faces = Vec::new();
        while let Some(&k) = touching[&vertex].iter().find(|&&k| !used[k]) {
            used[k] = true;
            let [a, b] = vertices(k);
            faces.push((k, vertex == b));
            vertex = if vertex == a { b } else { a };
        }
        if !faces.is_empty() {
            chains.push(Chain {
                faces,
                axis,
                start: axis.map_or(0.0, |axis| at(start)[axis]),
            });
        }
    }
    chains
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_triangles_are_those_of_affine_functions() {
        for (corners, share) in [
            ([1.0, 2.0, 3.0], 0.0),
            ([-1.0, -2.0, -3.0], 1.0),
            ([-1.0, 1.0, 1.0], 0.25),
            ([1.0, -3.0, 1.0], 0.5625),
            ([-1.0, -1.0, 1.0], 0.75),
            ([0.0, 1.0, 1.0], 0.0),
            ([0.0, -1.0, 1.0], 0.5),
            ([0.0, 0.0, 0.0], 1.0),
        ] {
            assert!(
                (share_below_zero(&corners) - share).abs() < 1e-15,
                "{corners:?}"
            );
        }
    }
}
