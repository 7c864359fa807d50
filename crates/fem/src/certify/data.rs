//! The data of a problem, enclosed on a mesh: what a piecewise polynomial flux can balance of f and t, what v has to be on
//! Γ_D and Γ_C, and what of all this is not known.

use super::cut_off::{CutOff, cut_offs};
use super::lift::{Lift, lifts};
use super::model::{Domain, Effort};
use super::obstacle::{Obstacle, obstacles};
use super::patch;
use super::products::Moments;
use super::refusal;
use super::simplex::Simplex;
use super::tree::Tree;
use crate::contact::Problem;
use crate::interval::{Interval, above_of_all};
use crate::scene::{Expression, Part};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::parallel;

/// ∫ |r| of f and t is wanted below this part of h ‖f‖, which costs the bound a hundredth or two.
const TOLERANCE: f64 = 0.006;
/// Less where v and σ are of second order, as ‖∇u - G‖ is that much smaller on a mesh of ordinary size.
const OF_SECOND_ORDER: f64 = 0.15;
/// Leaves beyond one per cell: this many per cell, plus a constant, but never more than the last.
const PER_CELL: usize = 60;
const MORE: usize = 20_000;
const MOST: usize = 2_000_000;
/// … and fewer, in proportion, for formulas with more than this many terms: each leaf takes its derivatives anew.
const TERMS: usize = 64;
/// Data of sizes beyond these powers of two are scaled.
const LARGE: i32 = 200;

/// Whether v and σ are of second order.
pub(super) fn is_second_order(problem: &Problem) -> bool {
    problem.space.mesh.dim == 2
}

/// The data of a problem on a mesh, the same for every field on it.
#[derive(Debug, Clone)]
pub struct PreparedData {
    /// All that follows is of 2^unit times the data, whose squares are in range.
    pub(super) unit: i32,
    pub(super) loads: Vec<Load>,
    /// |(f + div σ, w)_κ| ≤ this |κ|^½ ‖∇w‖_κ is small enough for the known part of f.
    pub(super) enough: f64,
    /// f by cells.
    pub(super) trees: Vec<Tree>,
    pub(super) tractions: Vec<Traction>,
    /// By cells.
    pub(super) lifts: Vec<Lift>,
    /// The same in 3D.
    pub(super) cut_offs: Vec<CutOff>,
    /// b with which 4 b λ_a λ_b is the larger part of what g and ψ have beyond their linear interpolants, by faces; empty
    /// where all are 0.
    pub(super) bends: Vec<f64>,
    /// g at the vertices of Γ_D.
    pub(super) dirichlet: Vec<Option<Interval>>,
    /// ψ on the contact faces.
    pub(super) obstacles: Vec<Obstacle>,
}

impl PreparedData {
    /// # Errors
    /// Data that are not bounded on a cell or a face, g that no function in H¹ has, an interruption.
    pub fn new(problem: &Problem) -> Result<Self> {
        let unit = unit(problem);
        let (trees, loads, enough) = loads(problem, unit)?;
        let dirichlet = dirichlet(problem, unit)?;
        let (mut obstacles, of_psi) = obstacles(problem, unit, &dirichlet)?;
        let mut lifts = lifts(problem, unit)?;
        lifts.extend(of_psi);
        let mesh = problem.space.mesh;
        let mut bends = vec![
            0.0;
            if lifts.is_empty() {
                0
            } else {
                mesh.face_count()
            }
        ];
        for lift in &lifts {
            bends[lift.face(mesh)] = lift.bend;
        }
        lifts.retain(|lift| !lift.sectors.is_empty());
        lifts.sort_by_key(|lift| lift.cell);
        let cut_offs = cut_offs(problem, unit)?;
        for (contact, obstacle) in problem.contact.iter().zip(&mut obstacles) {
            // At the vertices of Γ_D all of w is below χ max |g - I_h g|.
            if let Some(cut_off) = of_cell(&cut_offs, contact.cell) {
                let beyond = Interval::at(cut_off.beyond());
                for (ceiling, &vertex) in obstacle.ceiling.iter_mut().zip(mesh.face(contact.face)) {
                    if dirichlet[vertex as usize].is_some() {
                        *ceiling = (Interval::at(*ceiling) - beyond).low;
                    }
                }
            }
        }
        Ok(PreparedData {
            unit,
            cut_offs,
            tractions: tractions(problem, unit)?,
            loads,
            enough,
            trees,
            lifts,
            bends,
            dirichlet,
            obstacles,
        })
    }

    /// The lifts of a cell.
    pub(super) fn lifts_of(&self, cell: usize) -> &[Lift] {
        let first = self.lifts.partition_point(|lift| lift.cell < cell);
        let count = self.lifts[first..].partition_point(|lift| lift.cell == cell);
        &self.lifts[first..first + count]
    }

    /// The part of g in v next to Γ_D in 3D.
    pub(super) fn cut_off(&self, cell: usize) -> Option<&CutOff> {
        of_cell(&self.cut_offs, cell)
    }

    /// ∫_κ |w| of v's lifts w at most.
    pub(super) fn size_of_lifts(&self, simplex: &Simplex, cell: usize) -> f64 {
        let lifts = self.lifts_of(cell).iter();
        let cut_off = self.cut_off(cell).map(|cut_off| cut_off.size(simplex));
        above_of_all(lifts.map(|lift| lift.size(simplex)).chain(cut_off))
    }

    /// ‖∇w‖_κ of v's lifts w at most.
    pub(super) fn norm_of_lifts(&self, simplex: &Simplex, cell: usize) -> f64 {
        let lifts = self.lifts_of(cell).iter();
        let cut_off = self.cut_off(cell).map(|cut_off| cut_off.norms(simplex)[0]);
        above_of_all(lifts.map(|lift| lift.norms(simplex)[0]).chain(cut_off))
    }

    /// b of g or ψ on a face.
    pub(super) fn bend(&self, face: usize) -> f64 {
        self.bends.get(face).copied().unwrap_or(0.0)
    }

    /// Whether the squares of all data are in range without scaling.
    pub(super) fn scaled(&self, value: f64) -> f64 {
        if self.unit == 0 {
            return value;
        }
        Interval::at(value).times_power_of_two(self.unit).mid()
    }
}

/// The part of a cell, if it has one.
fn of_cell(cut_offs: &[CutOff], cell: usize) -> Option<&CutOff> {
    let found = cut_offs.binary_search_by_key(&cell, |cut_off| cut_off.cell);
    found.ok().map(|k| &cut_offs[k])
}

/// The power of two that brings the largest of the data to 1; 0 where they are of ordinary size.
fn unit(problem: &Problem) -> i32 {
    let (mesh, data) = (problem.space.mesh, problem.scene.data());
    let of_cell = |cell: usize| data.f.value(mesh.cell_midpoint(cell)).abs();
    let cells = parallel::collect(mesh.cell_count(), of_cell);
    let boundary = (0..mesh.face_count()).filter_map(|face| {
        let of = match problem.parts[face]? {
            Part::Dirichlet => &data.g,
            Part::Neumann => &data.t,
            Part::Contact => &data.psi,
        };
        Some(of.value(mesh.face_midpoint(face)).abs())
    });
    let largest = cells
        .into_iter()
        .chain(boundary)
        .filter(|v| v.is_finite())
        .fold(0.0, f64::max);
    let exponent = if largest > 0.0 {
        largest.log2() as i32
    } else {
        0
    };
    if exponent.abs() > LARGE { -exponent } else { 0 }
}

/// f on one cell, as the flux balances it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Load {
    /// About the mean of f.
    pub mean: f64,
    /// About (Π₁f - Π₀f) at the vertices.
    pub slopes: [f64; 4],
    /// About (s, λ_i)_κ / |κ| of what is carried apart.
    pub carried: [f64; 3],
    /// In 2D about (f, 4 λ_a λ_b)_κ / |κ|, by the vertex opposite.
    pub bubbles: [f64; 3],
}

impl Load {
    /// (f, λ_i)_κ / |κ|
    pub fn moment(&self, dim: usize, i: usize) -> f64 {
        self.balanced(dim, i) + self.carried.get(i).copied().unwrap_or(0.0)
    }

    /// The same without what is carried apart, which is what σ balances.
    fn balanced(&self, dim: usize, i: usize) -> f64 {
        let d = dim as f64;
        self.mean / (d + 1.0) + self.slopes[i] / ((d + 1.0) * (d + 2.0))
    }

    /// (f, φ_i)_κ / |κ| with the Crouzeix–Raviart function φ_i = 1 - d λ_i.
    pub fn on_face(&self, dim: usize, i: usize) -> f64 {
        self.mean - dim as f64 * self.moment(dim, i)
    }

    /// The same without what is carried apart.
    pub fn balanced_on_face(&self, dim: usize, i: usize) -> f64 {
        self.mean - dim as f64 * self.balanced(dim, i)
    }
}

/// t on one face of Γ_N.
#[derive(Debug, Clone, Copy)]
pub(super) struct Traction {
    pub face: usize,
    pub cell: usize,
    /// ∫_F p λ_i of t's model p, for the vertices of the cell; 0 for the one opposite F.
    pub moments: [Interval; 4],
    /// ∫_F p 4 λ_a λ_b, in 2D
    pub bubble: Interval,
    /// ∫_F σ·n, about ∫_F t
    pub total: f64,
    /// |(t - σ·n, w)_F| ≤ oscillation ‖∇w‖_κ for what is known
    pub oscillation: f64,
    /// The mean over F of what bounds the unknown.
    pub error: f64,
    /// |(e - ē, |w|)_F| ≤ spread ‖∇w‖_κ
    pub spread: f64,
    /// ∫_F |p|, ∫_F |s| and ∫_F |r| of the model at most.
    pub size: f64,
    pub wave: f64,
    pub rest: f64,
}

/// The budget for one of the data on a part of the mesh with a given number of simplices of this dimension and measure.
fn effort(problem: &Problem, data: &Expression, [count, dim]: [usize; 2], measure: f64) -> Effort {
    let root = 1.0 / dim as f64;
    let h = 1.0 / (count.max(1) as f64).powf(root);
    let is_second = is_second_order(problem);
    let order = if is_second { OF_SECOND_ORDER } else { 1.0 };
    Effort {
        tolerance: TOLERANCE * order * h * measure.sqrt(),
        budget: (PER_CELL * count + MORE).min(MOST) * TERMS / data.terms().max(TERMS),
    }
}

/// f on all cells.
fn loads(problem: &Problem, unit: i32) -> Result<(Vec<Tree>, Vec<Load>, f64)> {
    let mesh = problem.space.mesh;
    let measures = parallel::collect(mesh.cell_count(), |cell| mesh.measure(cell));
    let volume: f64 = measures.iter().sum();
    let domain = Domain {
        expression: &problem.scene.data().f,
        vertices: Box::new(|cell| mesh.vertices(cell)),
        measures,
        dim: mesh.dim,
        space: mesh.dim,
        unit,
    };
    let effort = effort(
        problem,
        domain.expression,
        [domain.measures.len(), mesh.dim],
        volume,
    );
    let mut trees = domain.enclose(&effort)?;
    for (cell, tree) in trees.iter().enumerate() {
        bounded("f", tree, || format!("cell {cell}"))?;
    }
    let cut = trees.iter_mut().filter(|tree| tree.is_cut());
    parallel::map(cut, |tree| {
        tree.moments = Some(Box::new(Moments::of(tree, mesh.dim)))
    });
    let mut loads = parallel::collect(trees.len(), |cell| {
        let tree = &trees[cell];
        let Some(of) = tree.moments.as_deref() else {
            let values = tree.whole.values;
            let mean = values[..=mesh.dim].iter().sum::<f64>() / (mesh.dim + 1) as f64;
            let all: f64 = values[..3].iter().sum();
            let carried = tree.carried.as_ref();
            return Load {
                mean,
                slopes: values.map(|value| value - mean),
                carried: carried.map_or([0.0; 3], |c| c.flat.map(Interval::mid)),
                bubbles: std::array::from_fn(|i| {
                    let of_wave = carried.map_or(0.0, |c| c.bubbles[i].mid());
                    2.0 * (2.0 * all - values[i]) / 30.0 + of_wave
                }),
            };
        };
        let count = mesh.dim as f64 + 1.0;
        let (mean, corners) = (of.mean.mid(), of.corners.map(Interval::mid));
        Load {
            mean,
            slopes: corners.map(|moment| count * (count + 1.0) * (moment - mean / count)),
            carried: [0.0; 3],
            bubbles: of.bubbles.map(Interval::mid),
        }
    });
    loads
        .iter_mut()
        .for_each(|load| load.slopes[mesh.dim + 1..].fill(0.0));
    let squares = loads.iter().zip(&domain.measures);
    let square: f64 = squares
        .map(|(load, measure)| measure * load.mean * load.mean)
        .sum();
    // A leaf of a tetrahedron costs more time, one of a triangle is more often worth it.
    let share = if mesh.dim == 2 { 0.25 } else { 1.0 };
    let size = volume.powf(1.0 / mesh.dim as f64);
    let enough = share * effort.tolerance / volume.sqrt() * size * (square / volume).sqrt();
    Ok((trees, loads, enough))
}

/// Unbounded data cannot be charged.
fn bounded(name: &str, tree: &Tree, place: impl Fn() -> String) -> Result<()> {
    let mut is_bounded = true;
    tree.for_each(&mut |node, _, _| is_bounded &= tree.leaf(node).unknown().is_finite());
    if is_bounded {
        return Ok(());
    }
    Err(refusal(
        format!(
            "{name} could not be bounded on {}: it is singular or not defined there",
            place()
        ),
        "give data that are bounded, or leave their singularity out of the domain",
    ))
}

/// g at the vertices of Γ_D.
fn dirichlet(problem: &Problem, unit: i32) -> Result<Vec<Option<Interval>>> {
    let (mesh, g) = (problem.space.mesh, &problem.scene.data().g);
    let mut values = vec![None; mesh.points.len()];
    for face in (0..mesh.face_count()).filter(|&f| problem.parts[f] == Some(Part::Dirichlet)) {
        for &vertex in mesh.face(face) {
            if values[vertex as usize].is_some() {
                continue;
            }
            let at = mesh.points[vertex as usize].map(Interval::at);
            let value = g.range(at).times_power_of_two(unit);
            if !value.is_finite() {
                return Err(refusal(
                    format!("g could not be bounded at {}", mesh.vertex_label(vertex)),
                    "give data that are defined and finite on Γ_D",
                ));
            }
            values[vertex as usize] = Some(value);
        }
    }
    Ok(values)
}

/// t on all faces of Γ_N where it is not 0.
///
/// With z of mean 0 over κ, the divergence theorem for z² (x - c), c the vertex opposite F and ℓ the longest edge from
/// it, gives ‖z‖²_F ≤ (|F|/|κ|) (‖z‖² + (2ℓ/d) ‖z‖ ‖∇z‖) ≤ C_F² ‖∇z‖², C_F² = (|F|/|κ|) C h (C h + 2ℓ/d).
fn tractions(problem: &Problem, unit: i32) -> Result<Vec<Traction>> {
    let t = &problem.scene.data().t;
    if t.is_zero() {
        return Ok(Vec::new());
    }
    let mesh = problem.space.mesh;
    let faces: Vec<usize> = (0..mesh.face_count())
        .filter(|&face| problem.parts[face] == Some(Part::Neumann))
        .collect();
    let cells: Vec<usize> = faces
        .iter()
        .map(|&face| mesh.face_cells(face)[0] as usize)
        .collect();
    let measures: Vec<f64> = faces
        .iter()
        .zip(&cells)
        .map(|(&face, &cell)| {
            mesh.geometry(cell)
                .face_measure(mesh.local_face(cell, face))
        })
        .collect();
    let whole: f64 = measures.iter().sum();
    let domain = Domain {
        expression: t,
        vertices: Box::new(|k| mesh.face_vertices(faces[k])),
        measures,
        dim: mesh.dim - 1,
        space: mesh.dim,
        unit,
    };
    let effort = effort(problem, t, [faces.len(), mesh.dim - 1], whole);
    let trees = domain.enclose(&effort)?;
    let pairs = faces.iter().copied().zip(cells);
    pairs
        .zip(&trees)
        .map(|((face, cell), tree)| {
            cancel::check()?;
            bounded("t", tree, || mesh.face_label(face))?;
            let simplex = Simplex::new(mesh, cell);
            let local = mesh.local_face(cell, face);
            let vertex_of = |v: &u32| mesh.cell(cell).iter().position(|c| c == v);
            let corners: Vec<usize> = mesh.face(face).iter().filter_map(vertex_of).collect();
            let measure = simplex.face_measure(local);
            let of = Moments::of(tree, mesh.dim - 1);
            let total = (measure * of.mean).mid();
            let mut moments = [Interval::ZERO; 4];
            for (&corner, moment) in corners.iter().zip(of.corners) {
                moments[corner] = measure * moment;
            }
            let [mut size, mut wave, mut rest] = [Interval::ZERO; 3];
            tree.for_each(&mut |node, _, share| {
                size += share * Interval::at(tree.leaf(node).size());
                wave += share * Interval::at(tree.leaf(node).swell);
                rest += share * Interval::at(tree.leaf(node).unknown());
            });
            let patch = patch::patch(
                &simplex,
                local,
                &corners,
                tree,
                Interval::at(total) / measure,
            );
            Ok(Traction {
                face,
                cell,
                moments,
                bubble: of.bubbles[0] * measure,
                total,
                oscillation: patch.oscillation,
                error: patch.error,
                spread: patch.spread,
                size: (size * measure).high,
                wave: (wave * measure).high,
                rest: (rest * measure).high,
            })
        })
        .collect()
}
